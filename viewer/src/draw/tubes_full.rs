//! Tubes as they look: in the sun, which they keep from what is behind them.

use super::pipelines::{CameraBinding, PipelineDesc, Pipelines, depth_state, shader};
use super::smooth::SAMPLES;
use super::tubes::{At, List, TubeRenderer, blended};
use enfilade::ObjectId;
use enfilade::gpu::Gpu;
use enfilade::scene::Scene;
use wgpu::{CompareFunction, TextureFormat};

/// See [`self`].
pub struct TubesInSun {
    /// For one sample a pixel, and for more.
    solid: [wgpu::RenderPipeline; 2],
    /// Tubes thinner than a pixel: blended, without depth.
    thin: wgpu::RenderPipeline,
    shadow: wgpu::RenderPipeline,
    casting: List,
}

impl TubesInSun {
    /// Of tubes. `layout` binds the sun, materials and pictures, and `of_sun` the sun alone.
    pub fn new(
        gpu: &Gpu,
        pipelines: &Pipelines,
        tubes: &TubeRenderer,
        [layout, of_sun]: [&wgpu::BindGroupLayout; 2],
        format: TextureFormat,
    ) -> Self {
        let source = concat!(
            include_str!("bands.wgsl"),
            include_str!("tubes.wgsl"),
            include_str!("full.wgsl"),
            include_str!("tubes_full.wgsl")
        );
        let module = shader(gpu, source);
        let groups = [Some(&pipelines.layout), Some(layout), Some(&tubes.source.layout)];
        let solid = |samples| {
            let depth = Some(depth_state(true, CompareFunction::Greater));
            let pixel = Some(("solid_tube", format.into()));
            PipelineDesc { groups: &groups, depth, samples, pixel, ..PipelineDesc::new(&module, "lit_tube") }.pipeline(gpu)
        };
        Self {
            solid: [1, SAMPLES].map(solid),
            thin: PipelineDesc {
                groups: &groups,
                depth: Some(depth_state(false, CompareFunction::Greater)),
                pixel: Some(("thin_tube", blended(format))),
                ..PipelineDesc::new(&module, "lit_tube")
            }
            .pipeline(gpu),
            shadow: PipelineDesc {
                groups: &[None, Some(of_sun), Some(&tubes.source.layout)],
                depth: Some(depth_state(true, CompareFunction::Less)),
                ..PipelineDesc::new(&module, "shadow")
            }
            .pipeline(gpu),
            casting: List::new(gpu, &tubes.source),
        }
    }

    /// Chooses how some objects cast shadows, as seen from the sun.
    pub fn cast_by(
        &mut self,
        gpu: &Gpu,
        scene: &Scene,
        tubes: &TubeRenderer,
        sun: &At,
        objects: impl Iterator<Item = ObjectId> + Clone,
    ) {
        self.casting.fill(gpu, scene, &tubes.source, sun, objects);
    }

    /// Draws their depth for the sun, in a pass that has it.
    pub fn cast(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_pipeline(&self.shadow);
        self.casting.draw(pass);
    }

    /// Draws a list, in a pass of one sample a pixel or several that has the sun and materials; without those that are thinner than a pixel.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, list: &List, is_smooth: bool) {
        pass.set_pipeline(&self.solid[usize::from(is_smooth)]);
        pass.set_bind_group(0, &eye.group, &[]);
        list.draw(pass);
    }

    /// Draws those, in a pass of one sample a pixel, once all that is solid is there.
    pub fn draw_thin(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, list: &List) {
        pass.set_pipeline(&self.thin);
        pass.set_bind_group(0, &eye.group, &[]);
        list.draw(pass);
    }
}
