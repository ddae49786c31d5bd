//! A ground on the device: the slots of its cache in a buffer, and a draw of all patches, an instance each.

use super::canvas::{Canvas, clip};
use enfilade::runtime::Camera;
use enfilade_measure::walkthrough::picture::Picture;
use enfilade_terrain::{Ground, Patch};
use wgpu::BufferUsages;

/// Bytes of a patch, and of what holds for all of them.
const PATCH: usize = 16;
const LAND: u64 = 96;

/// Draws patches, coloured by level, into a texture.
pub struct Renderer {
    pub canvas: Canvas,
    pipeline: wgpu::RenderPipeline,
    land: wgpu::Buffer,
    heights: wgpu::Buffer,
    patches: wgpu::Buffer,
    group: wgpu::BindGroup,
    words: Vec<[u32; 4]>,
}

impl Renderer {
    /// Makes room for all slots, and uploads those that are filled.
    pub fn new(ground: &Ground) -> Result<Self, String> {
        let canvas = Canvas::new()?;
        let pipeline = canvas.pipeline(include_str!("shader.wgsl"), &[]);
        let land = canvas.buffer(LAND, BufferUsages::UNIFORM);
        let heights = canvas.buffer(ground.cache_bytes(), BufferUsages::STORAGE);
        let patches = canvas.buffer((PATCH * ground.slots()) as u64, BufferUsages::STORAGE);
        let group = canvas.group(&pipeline, &[&land, &heights, &patches]);
        let renderer = Self { canvas, pipeline, land, heights, patches, group, words: Vec::new() };
        renderer.upload(ground);
        Ok(renderer)
    }

    /// Uploads the slots that have changed.
    pub fn upload(&self, ground: &Ground) {
        for &slot in ground.changed() {
            let words = ground.words(slot);
            self.canvas.queue.write_buffer(
                &self.heights,
                u64::from(slot) * 4 * words.len() as u64,
                bytemuck::cast_slice(words),
            );
        }
    }

    /// One frame. A patch whose tile is not in memory is an error.
    pub fn frame(&mut self, ground: &Ground, camera: &Camera, patches: &[Patch]) -> Result<Picture, String> {
        self.words.clear();
        for Patch { tile, key, coarser, .. } in patches {
            let slot = ground.slot(*tile).ok_or(format!("tile {tile} is drawn and not in memory"))?;
            self.words.push([slot, key.x, key.y, key.level | u32::from(*coarser) << 8]);
        }
        let (header, queue) = (ground.header(), &self.canvas.queue);
        let ([columns, rows], [across, down]) = (header.grid.size(), header.spacing);
        let words = ground.words(0).len() as u32;
        let last = [(across as f32).to_bits(), (down as f32).to_bits(), columns - 1, rows - 1];
        let numbers = [(header.step as f32).to_bits(), header.grid.side(), header.width.bytes() as u32, words];
        queue.write_buffer(&self.land, 0, bytemuck::cast_slice(&clip(camera).to_cols_array()));
        queue.write_buffer(&self.land, 64, bytemuck::cast_slice(&[last, numbers]));
        queue.write_buffer(&self.patches, 0, bytemuck::cast_slice(&self.words));
        let corners = 6 * (header.grid.side() - 1).pow(2);
        self.canvas.frame(|pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.group, &[]);
            pass.draw(0..corners, 0..self.words.len() as u32);
        })
    }
}
