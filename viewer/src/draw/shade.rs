//! Shade in corners and lines along edges, from the depth of a picture: see `shade.wgsl`.

use super::pipelines::{NEAR, Recipe, shader};
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
        let module = shader(gpu, include_str!("shade.wgsl"));
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
        let pipeline = |fragment, target| {
            let groups = [Some(&layout)];
            Recipe { groups: &groups, pixel: Some((fragment, target)), ..Recipe::new(&module, "everywhere") }.pipeline(gpu)
        };
        let (reach, share) = REACH;
        Self {
            corners: pipeline("occlusion", SHADE.into()),
            smoothed: pipeline("smoothed", SHADE.into()),
            over: pipeline("over", multiplied),
            view: gpu.buffer(16, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST),
            reach: reach.min(share * scene.bounds().diagonal()) as f32,
            half: None,
            nothing: texture(gpu, [1; 2], SHADE, TextureUsages::TEXTURE_BINDING).create_view(&Default::default()),
            layout,
        }
    }

    /// Darkens a picture by the depth in `targets`.
    pub fn record(
        &mut self,
        gpu: &Gpu,
        camera: &Camera,
        targets: &Targets,
        picture: &TextureView,
        commands: &mut wgpu::CommandEncoder,
    ) {
        let size = targets.size.map(|side| side.div_ceil(2));
        if self.half.as_ref().is_none_or(|(old, _)| *old != size) {
            let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
            let half = || texture(gpu, size, SHADE, usage).create_view(&Default::default());
            self.half = Some((size, [half(), half()]));
        }
        let Some((_, [rough, smooth])) = &self.half else { return };
        let tangents = [camera.x, camera.y].map(|row| camera.w.length() / row.length());
        let words = [tangents[0], tangents[1], self.reach, NEAR];
        gpu.queue.write_buffer(&self.view, 0, bytemuck::cast_slice(&words));
        let group = |shade| {
            let view = wgpu::BindingResource::TextureView;
            let resources = [self.view.as_entire_binding(), view(&targets.depth), view(shade)];
            let entries: Vec<_> =
                (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            let layout = &self.layout;
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
        };
        let white = Some(wgpu::Color::WHITE);
        for (pipeline, from, to, clear) in [
            (&self.corners, &self.nothing, rough, white),
            (&self.smoothed, rough, smooth, white),
            (&self.over, smooth, picture, None),
        ] {
            let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[super::frame::colour(to, clear)],
                ..Default::default()
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &group(from), &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
