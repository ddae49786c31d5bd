//! Culled objects over a frozen frame, as one layer of grey glass.

use super::bind::{self, COLOUR_TEXTURE, DEPTH_TEXTURE, view};
use super::frame::{FrameContext, Passes};
use super::mesh::Runs;
use super::pass::{begin, begin_flat};
use super::pipelines::{PipelineDesc, shader};
use super::targets::view_of;
use enfilade::ObjectId;
use enfilade::gpu::Gpu;
use wgpu::{CommandEncoder, ShaderStages, TextureFormat, TextureView};

/// Records the layer, if it is shown.
pub fn draw(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut CommandEncoder) {
    if frame.shows_culled && !frame.lists.has_all {
        passes.culled.record(frame, commands);
    }
}

/// Draws it.
pub struct Culled {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    format: TextureFormat,
    /// Size and texture of the layer.
    layer: Option<([u32; 2], TextureView)>,
    runs: Runs,
}

impl Culled {
    /// Over pictures of `format`.
    pub fn new(gpu: &Gpu, format: TextureFormat) -> Self {
        let layout = bind::layout(gpu, ShaderStages::FRAGMENT, &[DEPTH_TEXTURE, DEPTH_TEXTURE, COLOUR_TEXTURE]);
        let blend = Some(wgpu::BlendState::ALPHA_BLENDING);
        let target = wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::COLOR };
        let module = shader(gpu, include_str!("culled.wgsl"));
        let groups = [Some(&layout)];
        let pipeline =
            PipelineDesc { groups: &groups, pixel: Some(("pixel", target)), ..PipelineDesc::new(&module, "corner") }
                .pipeline(gpu);
        Self { pipeline, layout, format, layer: None, runs: Runs::default() }
    }

    /// Records a layer of all objects that the frame does not draw.
    fn record(&mut self, frame: &FrameContext<'_>, commands: &mut CommandEncoder) {
        let FrameContext { gpu, mesh, targets, .. } = frame;
        if self.layer.as_ref().is_none_or(|(size, _)| *size != targets.size) {
            self.layer = Some((targets.size, view_of(gpu, targets.size, self.format)));
        }
        let Some((_, layer)) = &self.layer else { return };
        // 1. The rest, whether one sees through it or not.
        let mut is_drawn = vec![false; mesh.ranges.len()];
        frame.decision.objects.iter().for_each(|o| is_drawn[o.index()] = true);
        let culled: Vec<ObjectId> =
            (0..).map(ObjectId).zip(&is_drawn).filter(|(_, drawn)| !**drawn).map(|(o, _)| o).collect();
        self.runs.set(mesh, &culled, &vec![false; is_drawn.len()], None);
        let mut pass = begin(commands, layer, &targets.whole, Some(wgpu::Color::BLACK), None);
        frame.pipelines.bind(&mut pass, frame.eye);
        frame.pipelines.colours.draw(&mut pass, &self.runs.solid, &[]);
        frame.tubes.iter().for_each(|tubes| tubes.draw(&mut pass, frame.eye, &tubes.culled));
        drop(pass);
        // 2. Over what was drawn, where it is nearer.
        let group = bind::group(gpu, &self.layout, [&targets.depth, &targets.whole, layer].map(view));
        let mut pass = begin_flat(commands, frame.picture, None);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}
