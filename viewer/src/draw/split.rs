//! Two ways to cull side by side: the left half of the picture is of one, the right half of the other.

use super::frame::{Painter, Side, Stage, Wish};
use super::marks::Marking;
use super::pipelines::{Recipe, shader};
use super::targets::texture;
use crate::doors::Doors;
use crate::mode::ViewMode;
use enfilade::gpu::Gpu;
use wgpu::{BindGroup, RenderPass, TextureFormat, TextureUsages, TextureView};

/// The other way to cull, and its picture.
pub struct Split<'b> {
    /// How the right half is culled.
    pub mode: ViewMode,
    /// With what it keeps from frame to frame.
    pub side: Side<'b>,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    format: TextureFormat,
    picture: Option<([u32; 2], TextureView, BindGroup)>,
}

/// Draws the right half, then the interface.
pub struct Half<'p> {
    pipeline: &'p wgpu::RenderPipeline,
    group: &'p BindGroup,
    /// The interface, if there is one.
    pub over: Option<&'p mut dyn Painter>,
}

impl<'b> Split<'b> {
    /// Of a stage whose pictures are of `format`; culled by `mode`.
    pub fn new(stage: &Stage<'b>, mode: ViewMode, format: TextureFormat) -> Self {
        let gpu = &stage.gpu;
        let sampled = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let visibility = wgpu::ShaderStages::FRAGMENT;
        let entry = wgpu::BindGroupLayoutEntry { binding: 0, visibility, ty: sampled, count: None };
        let layout =
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &[entry] });
        let module = shader(gpu, include_str!("split.wgsl"));
        let groups = [Some(&layout)];
        let pixel = Some(("pixel", format.into()));
        let pipeline = Recipe { groups: &groups, pixel, ..Recipe::new(&module, "corner") }.pipeline(gpu);
        Self { mode, side: stage.side(), pipeline, layout, format, picture: None }
    }

    /// Doors were opened or shut.
    pub fn doors_changed(&mut self, doors: &Doors) {
        doors.tell(&mut self.side.culling.culler);
    }

    /// Draws a frame of the other way, all of it, with triangles told apart or not. Its pictures are of the stage's size.
    ///
    /// # Errors
    ///
    /// One line: the device has failed.
    pub fn draw(&mut self, stage: &mut Stage<'b>, wish: Wish<'_>, marking: Marking) -> Result<(), String> {
        let size = stage.targets.size;
        if self.picture.as_ref().is_none_or(|(old, ..)| *old != size) {
            self.side.culling.resize(size);
            let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
            let view = texture(&stage.gpu, size, self.format, usage).create_view(&Default::default());
            let group = stage.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: None,
                layout: &self.layout,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) }],
            });
            self.picture = Some((size, view, group));
        }
        let Some((_, view, _)) = &self.picture else { return Ok(()) };
        stage.swap(&mut self.side);
        let drawn = stage.set_marking(marking).and_then(|()| stage.frame(wish, view, None).map_err(|e| e.to_string()));
        stage.swap(&mut self.side);
        drawn
    }

    /// What draws the right half of the last frame over another picture. `None` before the first frame.
    pub fn half(&self) -> Option<Half<'_>> {
        self.picture.as_ref().map(|(_, _, group)| Half { pipeline: &self.pipeline, group, over: None })
    }
}

impl Painter for Half<'_> {
    fn prepare(&mut self, gpu: &Gpu, commands: &mut wgpu::CommandEncoder) {
        if let Some(over) = &mut self.over {
            over.prepare(gpu, commands);
        }
    }

    fn paint(&mut self, mut pass: RenderPass<'static>) {
        pass.set_pipeline(self.pipeline);
        pass.set_bind_group(0, self.group, &[]);
        pass.draw(0..3, 0..1);
        if let Some(over) = &mut self.over {
            over.paint(pass);
        }
    }
}
