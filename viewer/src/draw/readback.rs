//! Numbers that the device writes in a frame and the processor reads some frames later, without waiting.

use enfilade::gpu::Gpu;
use std::sync::mpsc::{Receiver, Sender, channel};
use wgpu::{BufferUsages, BufferView};

/// Frames in flight at once; a further frame is not read back.
const SLOTS: usize = 4;

/// A ring of buffers. Each frame in flight keeps a `T` until its buffer is read.
pub struct ReadbackRing<T> {
    slots: Vec<Slot<T>>,
    /// The slot that this frame copies to.
    pending: Option<usize>,
    sender: Sender<usize>,
    mapped: Receiver<usize>,
}

struct Slot<T> {
    buffer: wgpu::Buffer,
    /// `None`: free.
    kept: Option<T>,
}

impl<T> ReadbackRing<T> {
    /// With a number of bytes a frame.
    pub fn new(gpu: &Gpu, bytes: u64) -> Self {
        let slot = |_| Slot { buffer: gpu.buffer(bytes, BufferUsages::COPY_DST | BufferUsages::MAP_READ), kept: None };
        let (sender, mapped) = channel();
        Self { slots: (0..SLOTS).map(slot).collect(), pending: None, sender, mapped }
    }

    /// Records the copy of a buffer's first bytes. Returns false if too many frames are in flight: then nothing is read.
    pub fn copy(&mut self, from: &wgpu::Buffer, bytes: u64, kept: T, commands: &mut wgpu::CommandEncoder) -> bool {
        let Some(free) = self.slots.iter().position(|slot| slot.kept.is_none()) else { return false };
        self.slots[free].kept = Some(kept);
        commands.copy_buffer_to_buffer(from, 0, &self.slots[free].buffer, 0, bytes);
        self.pending = Some(free);
        true
    }

    /// Maps what this frame copied, once its commands are submitted.
    pub fn map(&mut self) {
        let Some(slot) = self.pending.take() else { return };
        let sender = self.sender.clone();
        self.slots[slot].buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            if result.is_ok() {
                let _ = sender.send(slot);
            }
        });
    }

    /// The next buffer that has arrived, as `read` decodes it; `None` inside if it cannot be read.
    pub fn receive<R>(&mut self, read: impl FnOnce(T, &BufferView) -> R) -> Option<Option<R>> {
        let slot = &mut self.slots[self.mapped.try_recv().ok()?];
        let kept = slot.kept.take()?;
        let result = slot.buffer.get_mapped_range(..).ok().map(|view| read(kept, &view));
        slot.buffer.unmap();
        Some(result)
    }
}
