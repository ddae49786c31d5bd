//! Shade in corners and lines along edges, from the depth of a picture: see `shade.wgsl`.

use super::pipelines::{NEAR, Recipe, shader};
use super::smooth::{SHADER, Smooth, samples};
use super::targets::{Targets, texture};
use enfilade::gpu::Gpu;
use enfilade::runtime::Camera;
use enfilade::scene::Scene;
use wgpu::{BindingType, BlendComponent, BlendFactor, BlendState, TextureFormat, TextureUsages, TextureView};

/// How far things shade each other: metres, and no more than this share of the scene's size.
const REACH: (f64, f64) = (0.7, 0.05);
/// Of shade.
const SHADE: TextureFormat = TextureFormat::R8Unorm;

/// What draws it.
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
        let texture_of = |sample_type| BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let uniform =
            BindingType::Buffer { ty: wgpu::BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: None };
        let kinds = [
            uniform,
            texture_of(wgpu::TextureSampleType::Depth),
            texture_of(wgpu::TextureSampleType::Float { filterable: false }),
        ];
        let entries: Vec<_> = (0..)
            .zip(kinds)
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty,
                count: None,
            })
            .collect();
        let layout =
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
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
        let smooth_entries = [entries[0], entries[2], samples(3)];
        let smooth =
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &smooth_entries });
        let pipeline = |fragment, target, layout| {
            let groups = [Some(layout)];
            Recipe { groups: &groups, pixel: Some((fragment, target)), ..Recipe::new(&module, "everywhere") }.pipeline(gpu)
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

    /// Darkens a picture by the depth in `targets`; lines are those of samples, where there are several a pixel.
    pub fn record(
        &mut self,
        gpu: &Gpu,
        camera: &Camera,
        (targets, smooth): (&Targets, Option<&Smooth>),
        picture: &TextureView,
        commands: &mut wgpu::CommandEncoder,
    ) {
        let size = targets.size.map(|side| side.div_ceil(2));
        if self.half.as_ref().is_none_or(|(old, _)| *old != size) {
            let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
            let half = || texture(gpu, size, SHADE, usage).create_view(&Default::default());
            self.half = Some((size, [half(), half()]));
        }
        let Some((_, [rough, smooth_half])) = &self.half else { return };
        let tangents = [camera.x, camera.y].map(|row| camera.w.length() / row.length());
        let words = [tangents[0], tangents[1], self.reach, NEAR];
        gpu.queue.write_buffer(&self.view, 0, bytemuck::cast_slice(&words));
        let view = wgpu::BindingResource::TextureView;
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = |layout, entries: &[wgpu::BindGroupEntry<'_>]| {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries })
        };
        let uniform = || entry(0, self.view.as_entire_binding());
        let of = |shade| group(&self.layout, &[uniform(), entry(1, view(&targets.depth)), entry(2, view(shade))]);
        let over = match smooth {
            None => (&self.over, of(smooth_half)),
            Some(smooth) => {
                let (pipeline, layout) = &self.over_smooth;
                (pipeline, group(layout, &[uniform(), entry(2, view(smooth_half)), entry(3, view(&smooth.depth))]))
            }
        };
        let white = Some(wgpu::Color::WHITE);
        for ((pipeline, group), to, clear) in [
            ((&self.corners, of(&self.nothing)), rough, white),
            ((&self.smoothed, of(rough)), smooth_half, white),
            (over, picture, None),
        ] {
            let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[super::frame::colour(to, clear)],
                ..Default::default()
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
