//! How long the graphics processor takes for a frame: time stamps at both ends, read when they come, some frames later.

use enfilade::gpu::Gpu;
use std::sync::mpsc::{Receiver, Sender, channel};
use wgpu::{BufferUsages, Features, QueryType};

/// Frames that may be under way at once; where all are, one isn't timed.
const SLOTS: usize = 4;

/// Times frames, where the device can.
pub struct Timer {
    /// Nanoseconds of a step of the clock.
    period: f64,
    slots: Vec<Slot>,
    told: Sender<usize>,
    heard: Receiver<usize>,
}

struct Slot {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    read: wgpu::Buffer,
    /// The frame that it times.
    frame: Option<u64>,
}

impl Timer {
    /// `None` where the device has no clock.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        if !gpu.features.contains(Features::TIMESTAMP_QUERY) {
            return None;
        }
        let slot = |_| Slot {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: QueryType::Timestamp,
                count: 2,
            }),
            resolved: gpu.buffer(16, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            read: gpu.buffer(16, BufferUsages::COPY_DST | BufferUsages::MAP_READ),
            frame: None,
        };
        let (told, heard) = channel();
        let period = f64::from(gpu.queue.get_timestamp_period());
        Some(Self { period, slots: (0..SLOTS).map(slot).collect(), told, heard })
    }

    /// A place for a frame's times.
    pub fn start(&mut self, frame: u64) -> Option<usize> {
        let free = self.slots.iter().position(|slot| slot.frame.is_none())?;
        self.slots[free].frame = Some(frame);
        Some(free)
    }

    /// For the first pass of a frame (`end` false), and the last.
    pub fn writes(&self, slot: usize, end: bool) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.slots[slot].queries,
            beginning_of_pass_write_index: (!end).then_some(0),
            end_of_pass_write_index: end.then_some(1),
        }
    }

    /// For a frame of one pass.
    pub fn both(&self, slot: usize) -> wgpu::RenderPassTimestampWrites<'_> {
        let queries = &self.slots[slot].queries;
        wgpu::RenderPassTimestampWrites {
            query_set: queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Records that the times are to be read.
    pub fn resolve(&self, slot: usize, commands: &mut wgpu::CommandEncoder) {
        let Slot { queries, resolved, read, .. } = &self.slots[slot];
        commands.resolve_query_set(queries, 0..2, resolved, 0);
        commands.copy_buffer_to_buffer(resolved, 0, read, 0, 16);
    }

    /// Asks for them, once the commands are submitted.
    pub fn ask(&self, slot: usize) {
        let told = self.told.clone();
        // Nobody listens any more after a failure.
        self.slots[slot].read.map_async(wgpu::MapMode::Read, .., move |result| {
            if result.is_ok() {
                let _ = told.send(slot);
            }
        });
    }

    /// Frames whose times have come, and their milliseconds.
    pub fn heard(&mut self, mut tell: impl FnMut(u64, f64)) {
        while let Ok(slot) = self.heard.try_recv() {
            let slot = &mut self.slots[slot];
            let frame = slot.frame.take();
            if let (Some(frame), Ok(view)) = (frame, slot.read.get_mapped_range(..)) {
                let times: Vec<u64> =
                    view.chunks_exact(8).map(|b| u64::from_le_bytes(b.try_into().unwrap_or_default())).collect();
                tell(frame, times[1].saturating_sub(times[0]) as f64 * self.period * 1e-6);
            }
            slot.read.unmap();
        }
    }
}
