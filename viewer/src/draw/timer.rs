//! Device time of a frame, by time stamps at both ends. One frame is timed at once.

use super::readback::ReadbackRing;
use enfilade::gpu::Gpu;
use wgpu::{BufferUsages, Features, QueryType};

/// Bytes of two time stamps.
const BYTES: u64 = 16;

/// Times frames.
pub struct Timer {
    /// Nanoseconds of a tick.
    period: f64,
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    read: ReadbackRing<()>,
    /// This frame is timed.
    is_timing: bool,
    /// The stamps of an earlier frame have not arrived yet.
    is_waiting: bool,
}

impl Timer {
    /// `None` if the device has no time stamps.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        gpu.features.contains(Features::TIMESTAMP_QUERY).then(|| Self {
            period: f64::from(gpu.queue.get_timestamp_period()),
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: QueryType::Timestamp,
                count: 2,
            }),
            resolved: gpu.buffer(BYTES, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            read: ReadbackRing::new(gpu, BYTES),
            is_timing: false,
            is_waiting: false,
        })
    }

    /// Begins a frame, and times it if `wanted`.
    pub fn start(&mut self, wanted: bool) {
        self.is_timing = wanted && !self.is_waiting;
    }

    /// For a pass of the frame: whether it is the first, and the last.
    pub fn stamps(&self, is_first: bool, is_last: bool) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        (self.is_timing && (is_first || is_last)).then(|| wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: is_first.then_some(0),
            end_of_pass_write_index: is_last.then_some(1),
        })
    }

    /// Records how the stamps are read.
    pub fn resolve(&mut self, commands: &mut wgpu::CommandEncoder) {
        if self.is_timing {
            commands.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
            self.is_waiting = self.read.copy(&self.resolved, BYTES, (), commands);
        }
    }

    /// Maps the stamps, once the commands are submitted.
    pub fn map(&mut self) {
        self.read.map();
    }

    /// Forgets the stamps that have not arrived.
    pub fn restart(&mut self) {
        self.is_waiting = false;
    }

    /// Milliseconds of the last timed frame, if they have arrived.
    pub fn receive(&mut self) -> Option<f64> {
        let times = self.read.receive(|(), view| {
            let ticks: &[u64] = bytemuck::cast_slice(view);
            ticks[1].saturating_sub(ticks[0])
        })?;
        self.is_waiting = false;
        times.map(|ticks| ticks as f64 * self.period * 1e-6)
    }
}
