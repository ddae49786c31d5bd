//! The interface on the device, by egui.

use super::frame::Painter;
use egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use enfilade::gpu::Gpu;
use wgpu::TextureFormat;

/// Panels, and what paints them.
pub struct Interface {
    /// Where panels are made.
    pub context: egui::Context,
    renderer: Renderer,
    jobs: Vec<egui::ClippedPrimitive>,
    changes: Vec<egui::TexturesDelta>,
    screen: ScreenDescriptor,
}

impl Interface {
    /// On pictures of `format`.
    pub fn new(gpu: &Gpu, format: TextureFormat) -> Self {
        let context = egui::Context::default();
        context.set_visuals(egui::Visuals::dark());
        // Panels are there at once, in pictures as in the window.
        context.all_styles_mut(|style| style.animation_time = 0.0);
        Self {
            context,
            renderer: Renderer::new(&gpu.device, format, RendererOptions { dithering: false, ..Default::default() }),
            jobs: Vec::new(),
            changes: Vec::new(),
            screen: ScreenDescriptor { size_in_pixels: [1; 2], pixels_per_point: 1.0 },
        }
    }

    /// Runs the interface for a picture of `size` pixels. Returns requests to the window.
    pub fn run(&mut self, input: egui::RawInput, size: [u32; 2], panels: impl FnMut(&mut egui::Ui)) -> egui::PlatformOutput {
        let output = self.context.run_ui(input, panels);
        self.jobs = self.context.tessellate(output.shapes, output.pixels_per_point);
        self.changes.push(output.textures_delta);
        self.screen = ScreenDescriptor { size_in_pixels: size, pixels_per_point: output.pixels_per_point };
        output.platform_output
    }
}

impl Painter for Interface {
    fn prepare(&mut self, gpu: &Gpu, commands: &mut wgpu::CommandEncoder) {
        for change in self.changes.drain(..) {
            for (id, deltas) in &change.set {
                deltas.iter().for_each(|delta| self.renderer.update_texture(&gpu.device, &gpu.queue, *id, delta));
            }
            change.free.iter().for_each(|id| self.renderer.free_texture(id));
        }
        // There are no callbacks that would have commands of their own.
        self.renderer.update_buffers(&gpu.device, &gpu.queue, commands, &self.jobs, &self.screen);
    }

    fn paint(&mut self, mut pass: wgpu::RenderPass<'static>) {
        self.renderer.render(&mut pass, &self.jobs, &self.screen);
    }
}
