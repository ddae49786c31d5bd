//! What the device counted in a frame, read by the processor some frames later: nobody waits for it.

use enfilade::gpu::Gpu;
use std::sync::mpsc::{Receiver, Sender, channel};
use wgpu::{BufferUsages, BufferView};

/// Frames that may be under way at once; of one more, nothing is heard.
const SLOTS: usize = 4;

/// Buffers on their way; of each frame, `T` is kept until its buffer is read.
pub struct Readback<T> {
    slots: Vec<Slot<T>>,
    told: Sender<usize>,
    heard: Receiver<usize>,
}

struct Slot<T> {
    buffer: wgpu::Buffer,
    /// `None`: free.
    kept: Option<T>,
}

impl<T> Readback<T> {
    /// Of so many bytes a frame, at most.
    pub fn new(gpu: &Gpu, bytes: u64) -> Self {
        let slot = |_| Slot { buffer: gpu.buffer(bytes, BufferUsages::COPY_DST | BufferUsages::MAP_READ), kept: None };
        let (told, heard) = channel();
        Self { slots: (0..SLOTS).map(slot).collect(), told, heard }
    }

    /// Records the copy of a buffer's first bytes. Returns where they will be, for [`Self::ask`]; `None` where too many frames are under way.
    pub fn copy(&mut self, from: &wgpu::Buffer, bytes: u64, kept: T, commands: &mut wgpu::CommandEncoder) -> Option<usize> {
        let free = self.slots.iter().position(|slot| slot.kept.is_none())?;
        self.slots[free].kept = Some(kept);
        commands.copy_buffer_to_buffer(from, 0, &self.slots[free].buffer, 0, bytes);
        Some(free)
    }

    /// Asks for the bytes, once the commands are submitted.
    pub fn ask(&self, slot: usize) {
        let told = self.told.clone();
        self.slots[slot].buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            if result.is_ok() {
                let _ = told.send(slot);
            }
        });
    }

    /// The next buffer that has come: what `read` makes of it, or `None` where it can't be read.
    pub fn heard<R>(&mut self, read: impl FnOnce(T, &BufferView) -> R) -> Option<Option<R>> {
        let slot = &mut self.slots[self.heard.try_recv().ok()?];
        let kept = slot.kept.take()?;
        let result = slot.buffer.get_mapped_range(..).ok().map(|view| read(kept, &view));
        slot.buffer.unmap();
        Some(result)
    }
}
