//! Two ways to cull side by side: the left half of the picture is of one, the right half of the other.

use super::bind::{self, COLOUR_TEXTURE};
use super::frame::{FrameRequest, Painter};
use super::marks::Marking;
use super::pipelines::{PipelineDesc, shader};
use super::renderer::{CullState, Renderer};
use super::targets::view_of;
use crate::doors::Doors;
use crate::mode::ViewMode;
use enfilade::gpu::Gpu;
use wgpu::{BindGroup, RenderPass, ShaderStages, TextureFormat, TextureView};

/// The other way to cull, and its picture.
pub struct Split<'b> {
    /// How the right half is culled.
    pub mode: ViewMode,
    /// With what it keeps from frame to frame.
    pub side: CullState<'b>,
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
    /// Of a renderer whose pictures are of `format`; culled by `mode`.
    pub fn new(renderer: &Renderer<'b>, mode: ViewMode, format: TextureFormat) -> Self {
        let gpu = &renderer.gpu;
        let layout = bind::layout(gpu, ShaderStages::FRAGMENT, &[COLOUR_TEXTURE]);
        let module = shader(gpu, include_str!("split.wgsl"));
        let groups = [Some(&layout)];
        let pixel = Some(("pixel", format.into()));
        let pipeline = PipelineDesc { groups: &groups, pixel, ..PipelineDesc::new(&module, "corner") }.pipeline(gpu);
        Self { mode, side: renderer.cull_state(), pipeline, layout, format, picture: None }
    }

    /// Doors were opened or shut.
    pub fn doors_changed(&mut self, doors: &Doors) {
        doors.tell(&mut self.side.culling.view);
    }

    /// Draws a frame of the other way, all of it, with triangles told apart or not. Its pictures are of the renderer's size.
    ///
    /// # Errors
    ///
    /// One line: the device has failed.
    pub fn draw(&mut self, renderer: &mut Renderer<'b>, request: FrameRequest<'_>, marking: Marking) -> Result<(), String> {
        let size = renderer.targets.size;
        if self.picture.as_ref().is_none_or(|(old, ..)| *old != size) {
            self.side.culling.resize(size);
            let view = view_of(&renderer.gpu, size, self.format);
            let group = bind::group(&renderer.gpu, &self.layout, [bind::view(&view)]);
            self.picture = Some((size, view, group));
        }
        let Some((_, view, _)) = &self.picture else { return Ok(()) };
        renderer.swap(&mut self.side);
        let drawn =
            renderer.set_marking(marking).and_then(|()| renderer.frame(request, view, None).map_err(|e| e.to_string()));
        renderer.swap(&mut self.side);
        drawn
    }

    /// Paints the right half of the last frame over another picture. `None` before the first frame.
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
