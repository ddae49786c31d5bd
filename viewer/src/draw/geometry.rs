//! Triangles on the graphics processor. Shaders fetch corners by number: places are shared, and what all corners of a triangle
//! have in common is there once. That is 16 bytes a triangle and 12 a place; what it is made of takes 4 more, and 12 where it has a
//! picture.

use super::bind::{self, STORAGE};
use enfilade::gpu::Gpu;
use wgpu::{Buffer, BufferUsages, ShaderStages};

/// The buffers, as `geometry.wgsl` has them.
#[derive(Clone)]
pub struct Geometry {
    /// See the shader.
    pub places: Buffer,
    /// See the shader.
    pub corners: Buffer,
    /// See the shader.
    pub words: Buffer,
    /// Materials of triangles. Only detail `full` and `smooth` read these three.
    pub made_of: Buffer,
    /// See the shader.
    pub coordinates: Buffer,
    /// See the shader.
    pub first_coordinates: Buffer,
}

/// Layout of their group.
pub fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    bind::layout(gpu, ShaderStages::VERTEX, &[STORAGE; 6])
}

impl Geometry {
    /// Of places, numbers of places and words; what triangles are made of is not known.
    pub fn new(gpu: &Gpu, places: &[[u32; 3]], corners: &[u32], words: &[u32]) -> Self {
        let filled = |words: &[u32]| gpu.filled(words, BufferUsages::STORAGE);
        Self {
            places: filled(places.as_flattened()),
            corners: filled(corners),
            words: filled(words),
            made_of: filled(&[]),
            coordinates: filled(&[]),
            first_coordinates: filled(&[]),
        }
    }

    /// Bound for shaders.
    pub fn group(&self, gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::BindGroup {
        let buffers = [&self.places, &self.corners, &self.words, &self.made_of, &self.coordinates, &self.first_coordinates];
        bind::group(gpu, layout, buffers.map(Buffer::as_entire_binding))
    }
}
