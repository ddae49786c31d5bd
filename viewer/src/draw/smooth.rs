//! Four samples a pixel: edges of what is drawn as it looks are smooth.

use super::bind::{self, SAMPLES_TEXTURE, view};
use super::pass::{begin, begin_resolved};
use super::pipelines::{DEPTH, PipelineDesc, depth_state, shader};
use super::targets::Targets;
use enfilade::gpu::Gpu;
use wgpu::{ShaderStages, TextureFormat, TextureUsages, TextureView};

/// Samples a pixel: what every device has.
pub const SAMPLES: u32 = 4;

/// Render targets with several samples a pixel, of one size.
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
        let layout = bind::layout_at(gpu, ShaderStages::FRAGMENT, &[(3, SAMPLES_TEXTURE)]);
        let group = bind::group_at(gpu, &layout, [(3, view(&depth))]);
        let module = shader(gpu, SHADER);
        let nothing = wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::empty() };
        let nearest = PipelineDesc {
            groups: &[Some(&layout)],
            depth: Some(depth_state(true, wgpu::CompareFunction::Always)),
            pixel: Some(("nearest", nothing)),
            ..PipelineDesc::new(&module, "everywhere")
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
        begin_resolved(commands, (&self.colour, to), &self.depth, clear, stamps)
    }

    /// Gives pixels the depth of their nearest sample.
    pub fn settle(&self, targets: &Targets, picture: &TextureView, commands: &mut wgpu::CommandEncoder) {
        let mut pass = begin(commands, picture, &targets.depth, None, None);
        pass.set_pipeline(&self.nearest);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..3, 0..1);
    }
}
