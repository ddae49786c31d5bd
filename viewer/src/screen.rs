//! A window's surface: what frames are drawn on, and messages while there is nothing to draw.

use crate::draw::frame::Painter;
use crate::draw::interface::Interface;
use crate::draw::pass::begin_flat;
use crate::headless::{NEEDS, WISHES};
use enfilade::gpu::Gpu;
use std::sync::Arc;
use wgpu::{CurrentSurfaceTexture, SurfaceConfiguration, TextureFormat, TextureView};
use winit::window::Window;

/// Behind messages.
const BACK: wgpu::Color = wgpu::Color { r: 0.16, g: 0.17, b: 0.19, a: 1.0 };

/// A surface with its device, until a building takes that.
pub struct Screen {
    surface: wgpu::Surface<'static>,
    config: SurfaceConfiguration,
    gpu: Option<Gpu>,
    /// The device, as far as surfaces need it.
    device: wgpu::Device,
    egui: Interface,
}

impl Screen {
    /// Opens a device that draws on a window.
    ///
    /// # Errors
    ///
    /// One line: there is none.
    pub fn open(window: &Arc<Window>) -> Result<Self, String> {
        let instance = Gpu::instance().map_err(|e| e.to_string())?;
        let surface =
            instance.create_surface(window.clone()).map_err(|e| format!("nothing can be drawn in the window: {e}"))?;
        let gpu = Gpu::open_on(&instance, Some(&surface), &NEEDS, WISHES).map_err(|e| e.to_string())?;
        let size = window.inner_size();
        let formats = gpu.formats(&surface);
        // egui and the colours here are as the screen has them, without another curve.
        let plain = [TextureFormat::Bgra8Unorm, TextureFormat::Rgba8Unorm].into_iter().find(|f| formats.contains(f));
        let format = plain.or(formats.first().copied()).ok_or_else(|| format!("{} draws on no window", gpu.name))?;
        let config = SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            width: size.width.max(1),
            height: size.height.max(1),
            present_mode: wgpu::PresentMode::AutoVsync,
            desired_maximum_frame_latency: 2,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
            color_space: Default::default(),
        };
        surface.configure(&gpu.device, &config);
        let egui = Interface::new(&gpu, format);
        Ok(Self { surface, config, device: gpu.device.clone(), gpu: Some(gpu), egui })
    }

    /// The context of its panels.
    pub fn context(&self) -> &egui::Context {
        &self.egui.context
    }

    /// Whether no building has taken the device.
    pub fn has_gpu(&self) -> bool {
        self.gpu.is_some()
    }

    /// The device, for a building.
    pub fn take_gpu(&mut self) -> Option<Gpu> {
        self.gpu.take()
    }

    /// Of pictures.
    pub fn format(&self) -> TextureFormat {
        self.config.format
    }

    /// Of pictures, pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// The next picture, for a window of this size; `None` where there is nothing to draw on at the moment.
    ///
    /// # Errors
    ///
    /// The surface is lost for good.
    pub fn acquire(&mut self, [width, height]: [u32; 2]) -> Result<Option<wgpu::SurfaceTexture>, String> {
        if width == 0 || height == 0 {
            return Ok(None);
        }
        if [width, height] != self.size() {
            (self.config.width, self.config.height) = (width, height);
            self.surface.configure(&self.device, &self.config);
        }
        match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(texture) | CurrentSurfaceTexture::Suboptimal(texture) => Ok(Some(texture)),
            CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => Ok(None),
            CurrentSurfaceTexture::Outdated | CurrentSurfaceTexture::Lost => {
                self.surface.configure(&self.device, &self.config);
                Ok(None)
            }
            CurrentSurfaceTexture::Validation => Err("the window can't be drawn on any more".to_owned()),
        }
    }

    /// Draws panels on nothing. Returns what they want of a window.
    ///
    /// # Errors
    ///
    /// The device has failed.
    pub fn say(
        &mut self,
        view: &TextureView,
        input: egui::RawInput,
        panels: impl FnMut(&mut egui::Ui),
    ) -> Result<egui::PlatformOutput, String> {
        let Some(gpu) = &self.gpu else { return Ok(egui::PlatformOutput::default()) };
        gpu.check().map_err(|e| e.to_string())?;
        let size = [self.config.width, self.config.height];
        let output = self.egui.run(input, size, panels);
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        self.egui.prepare(gpu, &mut commands);
        let pass = begin_flat(&mut commands, view, Some(BACK));
        self.egui.paint(pass.forget_lifetime());
        gpu.queue.submit([commands.finish()]);
        Ok(output)
    }

    /// Shows a picture; `gpu` has drawn it, or the screen's own device has.
    pub fn present(&self, texture: wgpu::SurfaceTexture, gpu: Option<&Gpu>) {
        if let Some(gpu) = gpu.or(self.gpu.as_ref()) {
            gpu.queue.present(texture);
        }
    }
}
