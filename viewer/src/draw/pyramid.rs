//! The farthest depth of squares of pixels, from two pixels a side to the whole picture: what boxes are held against.
//!
//! Based on: Greene, Kass, Miller, *Hierarchical Z-buffer visibility*, 1993. Deviation: levels are rounded up where engines take powers of
//! two, so that a texel stands for its own pixels at any size of the picture, and for no other.

use super::bind::{self, COLOUR_TEXTURE, DEPTH_TEXTURE, SAMPLES_TEXTURE, UNIFORM, view};
use super::pipelines::{self, shader};
use enfilade::gpu::Gpu;
use wgpu::{
    BindGroup, BindGroupLayout, BindingType, BufferUsages, ComputePipeline, ShaderStages, TextureFormat, TextureUsages,
    TextureView, TextureViewDimension,
};

/// Texels that a workgroup writes, a side.
const GROUP: u32 = 8;
/// Bindings, as the shader has them: what a level may be made from, then the level, then the size of what it is made from.
const PIXELS: u32 = 0;
const SAMPLES: u32 = 1;
const FINER: u32 = 2;
const LEVEL: u32 = 3;
const READ: u32 = 4;

/// A pyramid on the device.
pub struct Pyramid {
    /// From pixels of one sample, and of more.
    first: [Step; 2],
    next: Step,
    /// Made for the size of the picture.
    levels: Option<Levels>,
}

/// How a level is made.
struct Step {
    /// The binding that it reads.
    from: u32,
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
}

/// Levels for one size of the picture.
struct Levels {
    size: [u32; 2],
    all: TextureView,
    /// The finest first.
    levels: Vec<Level>,
}

struct Level {
    view: TextureView,
    /// Texels.
    size: [u32; 2],
    /// Width and height of the level before.
    read: wgpu::Buffer,
    /// Binds the level before; none for the finest, whose depth may be another one in each frame.
    group: Option<BindGroup>,
}

impl Pyramid {
    /// Without levels yet.
    pub fn new(gpu: &Gpu) -> Self {
        let module = shader(gpu, include_str!("pyramid.wgsl"));
        let first = [("of_pixels", PIXELS), ("of_samples", SAMPLES)];
        Self {
            first: first.map(|(name, from)| Step::new(gpu, &module, name, from)),
            next: Step::new(gpu, &module, "of_finer", FINER),
            levels: None,
        }
    }

    /// Makes room for pictures of `size` pixels; returns all levels. They are as large as [`sizes`] says, in a texture that may be larger.
    pub fn fit(&mut self, gpu: &Gpu, size: [u32; 2]) -> &TextureView {
        if self.levels.as_ref().is_some_and(|levels| levels.size != size) {
            self.levels = None;
        }
        let next = &self.next;
        &self.levels.get_or_insert_with(|| Levels::new(gpu, next, size)).all
    }

    /// Whether there is room for pictures of `size` pixels.
    pub fn fits(&self, size: [u32; 2]) -> bool {
        self.levels.as_ref().is_some_and(|levels| levels.size == size)
    }

    /// Builds all levels, once there is room, of a depth with one sample a pixel or, where it `is_smooth`, more.
    pub fn record(&self, gpu: &Gpu, (depth, is_smooth): (&TextureView, bool), pass: &mut wgpu::ComputePass<'_>) {
        let Some(Levels { levels, .. }) = &self.levels else { return };
        for (i, level) in levels.iter().enumerate() {
            let step = if i == 0 { &self.first[usize::from(is_smooth)] } else { &self.next };
            let of_depth = (i == 0).then(|| step.group(gpu, depth, level));
            pass.set_pipeline(&step.pipeline);
            pass.set_bind_group(0, of_depth.as_ref().or(level.group.as_ref()), &[]);
            let [columns, rows] = level.size.map(|side| side.div_ceil(GROUP));
            pass.dispatch_workgroups(columns, rows, 1);
        }
    }
}

impl Step {
    fn new(gpu: &Gpu, module: &wgpu::ShaderModule, name: &str, from: u32) -> Self {
        let texture = match from {
            PIXELS => DEPTH_TEXTURE,
            SAMPLES => SAMPLES_TEXTURE,
            _ => COLOUR_TEXTURE,
        };
        let level = BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: TextureFormat::R32Float,
            view_dimension: TextureViewDimension::D2,
        };
        let kinds = [(from, texture), (LEVEL, level), (READ, UNIFORM)];
        let layout = bind::layout_at(gpu, ShaderStages::COMPUTE, &kinds);
        let pipeline = pipelines::compute(gpu, module, name, &[Some(&layout)]);
        Self { from, layout, pipeline }
    }

    fn group(&self, gpu: &Gpu, from: &TextureView, level: &Level) -> BindGroup {
        let read = level.read.as_entire_binding();
        bind::group_at(gpu, &self.layout, [(self.from, view(from)), (LEVEL, view(&level.view)), (READ, read)])
    }
}

impl Levels {
    fn new(gpu: &Gpu, next: &Step, size: [u32; 2]) -> Self {
        let sizes = sizes(size);
        // Textures round their levels down: from a power of two, that is what ours are, or more.
        let [width, height] = sizes[0].map(u32::next_power_of_two);
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: sizes.len() as u32,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TextureFormat::R32Float,
            usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let mut levels: Vec<Level> = Vec::new();
        for (i, &own) in (0..).zip(&sizes) {
            let one = wgpu::TextureViewDescriptor { base_mip_level: i, mip_level_count: Some(1), ..Default::default() };
            let [width, height] = levels.last().map_or(size, |finer| finer.size);
            let read = gpu.filled(&[width, height, 0, 0], BufferUsages::UNIFORM);
            let mut level = Level { view: texture.create_view(&one), size: own, read, group: None };
            level.group = levels.last().map(|finer| next.group(gpu, &finer.view, &level));
            levels.push(level);
        }
        Self { size, all: texture.create_view(&Default::default()), levels }
    }
}

/// Sizes of the levels for a picture, the finest first: half of the one before, rounded up, down to one texel.
pub fn sizes(size: [u32; 2]) -> Vec<[u32; 2]> {
    let half = |size: &[u32; 2]| size.map(|side| side.div_ceil(2));
    std::iter::successors(Some(half(&size)), |size| (*size != [1, 1]).then(|| half(size))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_end_with_one_texel_and_fit_into_those_of_a_texture() {
        assert_eq!(sizes([1, 1]), [[1, 1]]);
        assert_eq!(sizes([5, 2]), [[3, 1], [2, 1], [1, 1]]);
        for size in [[1, 1], [1, 8192], [333, 187], [960, 540], [4096, 4097], [8192, 8191]] {
            let sizes = sizes(size);
            let texture = sizes[0].map(u32::next_power_of_two);
            assert_eq!(sizes.last(), Some(&[1, 1]));
            for (level, own) in sizes.iter().enumerate() {
                for axis in 0..2 {
                    assert_eq!(own[axis], size[axis].div_ceil(2 << level), "a texel for each square of pixels");
                    assert!(own[axis] <= (texture[axis] >> level).max(1), "{size:?}: level {level} has no room");
                }
            }
            // As many levels as a texture of that size may have.
            assert!(sizes.len() as u32 <= texture[0].max(texture[1]).ilog2() + 1);
        }
    }
}
