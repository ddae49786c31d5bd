//! Four samples a pixel: edges of what is drawn as it looks are smooth.

use super::frame::{begin, colour};
use super::pipelines::{DEPTH, Recipe, depth_state, shader};
use super::targets::Targets;
use enfilade::gpu::Gpu;
use wgpu::{LoadOp, Operations, StoreOp, TextureFormat, TextureUsages, TextureView};

/// Samples a pixel: what every device has.
pub const SAMPLES: u32 = 4;

/// What is drawn into, of one size.
pub struct Smooth {
    size: [u32; 2],
    colour: TextureView,
    /// Depth of samples.
    pub depth: TextureView,
    group: wgpu::BindGroup,
    nearest: wgpu::RenderPipeline,
}

/// The shader of shade, and what it takes of samples.
pub(super) const SHADER: &str = concat!(include_str!("shade.wgsl"), include_str!("smooth.wgsl"));

/// Depth of samples, as shaders take it.
pub(super) fn samples(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Depth,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: true,
    };
    wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None }
}

impl Smooth {
    /// For pictures of `size` pixels and `format`.
    pub fn new(gpu: &Gpu, [width, height]: [u32; 2], format: TextureFormat) -> Self {
        let texture = |format| {
            let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: SAMPLES,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let depth = texture(DEPTH);
        let entries = [samples(3)];
        let layout =
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &[wgpu::BindGroupEntry { binding: 3, resource: wgpu::BindingResource::TextureView(&depth) }],
        });
        let module = shader(gpu, SHADER);
        let nothing = wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::empty() };
        let nearest = Recipe {
            groups: &[Some(&layout)],
            depth: Some(depth_state(true, wgpu::CompareFunction::Always)),
            pixel: Some(("nearest", nothing)),
            ..Recipe::new(&module, "everywhere")
        }
        .pipeline(gpu);
        Self { size: [width, height], colour: texture(format), depth, group, nearest }
    }

    /// Whether it is of that size.
    pub fn fits(&self, size: [u32; 2]) -> bool {
        self.size == size
    }

    /// A pass over the scene. `clear`: it is the first; `to`: it is the last, and the picture is its means.
    pub fn begin<'e>(
        &self,
        commands: &'e mut wgpu::CommandEncoder,
        clear: Option<wgpu::Color>,
        to: Option<&TextureView>,
        stamps: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'e> {
        let load = if clear.is_some() { LoadOp::Clear(0.0) } else { LoadOp::Load };
        let attachment = colour(&self.colour, clear);
        commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[
                attachment.map(|attachment| wgpu::RenderPassColorAttachment { resolve_target: to, ..attachment })
            ],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(Operations { load, store: StoreOp::Store }),
                stencil_ops: None,
            }),
            timestamp_writes: stamps,
            ..Default::default()
        })
    }

    /// Gives pixels the depth of their nearest sample.
    pub fn settle(&self, targets: &Targets, picture: &TextureView, commands: &mut wgpu::CommandEncoder) {
        let mut pass = begin(commands, picture, &targets.depth, None, None);
        pass.set_pipeline(&self.nearest);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}
