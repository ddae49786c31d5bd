//! Shade in corners and lines along edges, from the depth of a picture: see `shade.wgsl`.

use super::bind::{self, COLOUR_TEXTURE, DEPTH_TEXTURE, SAMPLES_TEXTURE, UNIFORM, view};
use super::frame::FrameContext;
use super::pass::begin_flat;
use super::pipelines::{NEAR, PipelineDesc, shader};
use super::smooth::{SHADER, Smooth};
use super::targets::{texture, view_of};
use enfilade::gpu::Gpu;
use enfilade::scene::Scene;
use wgpu::{BlendComponent, BlendFactor, BlendState, ShaderStages, TextureFormat, TextureUsages, TextureView};

/// How far things shade each other: metres, and no more than this share of the scene's size.
const REACH: (f64, f64) = (0.7, 0.05);
/// Of shade.
const SHADE: TextureFormat = TextureFormat::R8Unorm;

/// Draws shade and edges.
pub struct Shade {
    corners: wgpu::RenderPipeline,
    smoothed: wgpu::RenderPipeline,
    over: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    /// For pictures with several samples a pixel.
    over_smooth: (wgpu::RenderPipeline, wgpu::BindGroupLayout),
    view: wgpu::Buffer,
    reach: f32,
    /// Two of half the size of pictures; and a single texel, which stands for what nothing is taken from.
    half: Option<([u32; 2], [TextureView; 2])>,
    nothing: TextureView,
}

impl Shade {
    /// For pictures of `format`.
    pub fn new(gpu: &Gpu, scene: &Scene, format: TextureFormat) -> Self {
        let layout = bind::layout(gpu, ShaderStages::FRAGMENT, &[UNIFORM, DEPTH_TEXTURE, COLOUR_TEXTURE]);
        let module = shader(gpu, SHADER);
        let darkens = BlendComponent {
            src_factor: BlendFactor::Dst,
            dst_factor: BlendFactor::Zero,
            operation: wgpu::BlendOperation::Add,
        };
        let multiplied = wgpu::ColorTargetState {
            format,
            blend: Some(BlendState { color: darkens, alpha: BlendComponent::REPLACE }),
            write_mask: wgpu::ColorWrites::COLOR,
        };
        let kinds = [(0, UNIFORM), (2, COLOUR_TEXTURE), (3, SAMPLES_TEXTURE)];
        let smooth = bind::layout_at(gpu, ShaderStages::FRAGMENT, &kinds);
        let pipeline = |fragment, target, layout| {
            let groups = [Some(layout)];
            PipelineDesc { groups: &groups, pixel: Some((fragment, target)), ..PipelineDesc::new(&module, "everywhere") }
                .pipeline(gpu)
        };
        let (reach, share) = REACH;
        Self {
            corners: pipeline("occlusion", SHADE.into(), &layout),
            smoothed: pipeline("smoothed", SHADE.into(), &layout),
            over: pipeline("over", multiplied.clone(), &layout),
            over_smooth: (pipeline("over_smooth", multiplied, &smooth), smooth),
            view: gpu.buffer(16, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST),
            reach: reach.min(share * scene.bounds().diagonal()) as f32,
            half: None,
            nothing: texture(gpu, [1; 2], SHADE, TextureUsages::TEXTURE_BINDING).create_view(&Default::default()),
            layout,
        }
    }

    /// Darkens the picture by its depth; lines are those of samples, if there are several a pixel.
    pub fn record(&mut self, frame: &FrameContext<'_>, smooth: Option<&Smooth>, commands: &mut wgpu::CommandEncoder) {
        let FrameContext { gpu, camera, targets, picture, .. } = *frame;
        let size = targets.size.map(|side| side.div_ceil(2));
        if self.half.as_ref().is_none_or(|(old, _)| *old != size) {
            self.half = Some((size, [(); 2].map(|()| view_of(gpu, size, SHADE))));
        }
        let Some((_, [rough, smooth_half])) = &self.half else { return };
        let tangents = [camera.x, camera.y].map(|row| camera.w.length() / row.length());
        let words = [tangents[0], tangents[1], self.reach, NEAR];
        gpu.queue.write_buffer(&self.view, 0, bytemuck::cast_slice(&words));
        let uniform = || self.view.as_entire_binding();
        let of = |shade| bind::group(gpu, &self.layout, [uniform(), view(&targets.depth), view(shade)]);
        let over = match smooth {
            None => (&self.over, of(smooth_half)),
            Some(smooth) => {
                let (pipeline, layout) = &self.over_smooth;
                (pipeline, bind::group_at(gpu, layout, [(0, uniform()), (2, view(smooth_half)), (3, view(&smooth.depth))]))
            }
        };
        let white = Some(wgpu::Color::WHITE);
        for ((pipeline, group), to, clear) in [
            ((&self.corners, of(&self.nothing)), rough, white),
            ((&self.smoothed, of(rough)), smooth_half, white),
            (over, picture, None),
        ] {
            let mut pass = begin_flat(commands, to, clear);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
