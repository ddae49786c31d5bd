//! Draws of a frame, in a buffer that the device reads: a list of them is one call, however many runs of triangles it has.

use enfilade::gpu::Gpu;
use std::ops::Range;
use wgpu::BufferUsages;

/// Bytes of a draw.
const BYTES: u64 = 16;

/// Two lists of draws, for two pipelines: of solid things and of glass, say.
pub struct Draws {
    /// Of each draw the number of its corners, 1, the first of its corners, and 0.
    pub buffer: wgpu::Buffer,
    /// Where they are.
    pub lists: [Range<u32>; 2],
    words: Vec<[u32; 4]>,
}

impl Draws {
    /// With room for `most` draws; of a `usage` besides.
    pub fn new(gpu: &Gpu, most: usize, usage: BufferUsages) -> Self {
        let buffer = gpu.buffer(BYTES * most.max(1) as u64, usage | BufferUsages::INDIRECT);
        Self { buffer, lists: [0..0, 0..0], words: Vec::new() }
    }

    /// Other lists of the same draws.
    pub fn with(&self, lists: [Range<u32>; 2]) -> Self {
        Self { buffer: self.buffer.clone(), lists, words: Vec::new() }
    }

    /// So many first draws, then others up to `count`.
    pub fn split(&mut self, first: u32, count: u32) {
        self.lists = [0..first, first..count];
    }

    /// Writes both lists into a buffer that is copied to, from runs of corners.
    pub fn set(&mut self, gpu: &Gpu, first: &[Range<u32>], second: &[Range<u32>]) {
        self.words.clear();
        self.words.extend(first.iter().chain(second).map(|run| [run.end - run.start, 1, run.start, 0]));
        self.split(first.len() as u32, self.words.len() as u32);
        gpu.queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&self.words));
    }

    /// Draws the first list.
    pub fn first(&self, pass: &mut wgpu::RenderPass<'_>, pipeline: &wgpu::RenderPipeline) {
        self.draw(pass, pipeline, &self.lists[0]);
    }

    /// Draws the second list.
    pub fn second(&self, pass: &mut wgpu::RenderPass<'_>, pipeline: &wgpu::RenderPipeline) {
        self.draw(pass, pipeline, &self.lists[1]);
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, pipeline: &wgpu::RenderPipeline, list: &Range<u32>) {
        if !list.is_empty() {
            pass.set_pipeline(pipeline);
            pass.multi_draw_indirect(&self.buffer, BYTES * u64::from(list.start), list.end - list.start);
        }
    }
}
