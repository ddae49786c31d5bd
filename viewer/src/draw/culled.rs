//! What was culled, shown over a frozen frame as one layer of grey glass.

use super::mesh::{Mesh, Runs};
use super::pipelines::{Eye, Pipelines, Recipe, shader};
use super::targets::{Targets, texture};
use super::tubes::Pipes;
use enfilade::ObjectId;
use enfilade::gpu::Gpu;
use wgpu::{
    BindingType, LoadOp, Operations, ShaderStages, StoreOp, TextureFormat, TextureSampleType, TextureUsages, TextureView,
};

/// Draws it.
pub struct Culled {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    format: TextureFormat,
    /// What the layer is drawn into, and its size.
    layer: Option<([u32; 2], TextureView)>,
    runs: Runs,
}

impl Culled {
    /// Over pictures of `format`.
    pub fn new(gpu: &Gpu, format: TextureFormat) -> Self {
        let sampled = |sample_type| BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let kinds = [TextureSampleType::Depth, TextureSampleType::Depth, TextureSampleType::Float { filterable: false }];
        let visibility = ShaderStages::FRAGMENT;
        let entry = |(binding, kind)| wgpu::BindGroupLayoutEntry { binding, visibility, ty: sampled(kind), count: None };
        let entries: Vec<_> = (0..).zip(kinds).map(entry).collect();
        let layout =
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let blend = Some(wgpu::BlendState::ALPHA_BLENDING);
        let target = wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::COLOR };
        let module = shader(gpu, include_str!("culled.wgsl"));
        let groups = [Some(&layout)];
        let pipeline =
            Recipe { groups: &groups, pixel: Some(("pixel", target)), ..Recipe::new(&module, "corner") }.pipeline(gpu);
        Self { pipeline, layout, format, layer: None, runs: Runs::default() }
    }

    /// Records the layer of all objects but `drawn`, over a picture that has the depth in `targets`.
    #[expect(clippy::too_many_arguments, reason = "a stage of the frame takes what the frame has")]
    pub fn record(
        &mut self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        eye: &Eye,
        (mesh, tubes): (&Mesh, Option<&Pipes>),
        drawn: &[ObjectId],
        targets: &Targets,
        picture: &TextureView,
        commands: &mut wgpu::CommandEncoder,
    ) {
        if self.layer.as_ref().is_none_or(|(size, _)| *size != targets.size) {
            let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
            let layer = texture(gpu, targets.size, self.format, usage);
            self.layer = Some((targets.size, layer.create_view(&Default::default())));
        }
        let Some((_, layer)) = &self.layer else { return };
        // 1. The rest, whether one sees through it or not.
        let mut is_drawn = vec![false; mesh.ranges.len()];
        drawn.iter().for_each(|o| is_drawn[o.index()] = true);
        let culled: Vec<ObjectId> =
            (0..).map(ObjectId).zip(&is_drawn).filter(|(_, drawn)| !**drawn).map(|(o, _)| o).collect();
        self.runs.set(mesh, &culled, &vec![false; is_drawn.len()], None);
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[super::frame::colour(layer, Some(wgpu::Color::BLACK))],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.whole,
                depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pipelines.bind(&mut pass, eye);
        pipelines.colours.draw(&mut pass, &self.runs.solid, &[]);
        tubes.into_iter().for_each(|pipes| pipes.draw(&mut pass, eye, &pipes.culled));
        drop(pass);
        // 2. Over what was drawn, where it is nearer.
        let view = wgpu::BindingResource::TextureView;
        let resources = [view(&targets.depth), view(&targets.whole), view(layer)];
        let entries: Vec<_> =
            (0..).zip(resources).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let layout = &self.layout;
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries });
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[super::frame::colour(picture, None)],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}
