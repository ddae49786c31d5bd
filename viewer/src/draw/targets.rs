//! Render targets: depth, items, and a picture that can be read without a window.

use super::pass::depth_attachment;
use super::pipelines::{DEPTH, ITEMS};
use enfilade::gpu::{Gpu, GpuError};
use enfilade_measure::walkthrough::picture::Picture;
use wgpu::{BufferUsages, TextureFormat, TextureUsages, TextureView};

/// Of pictures without a window.
pub const PICTURE: TextureFormat = TextureFormat::Rgba8Unorm;

/// Textures of one size.
pub struct Targets {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Depth of what is drawn.
    pub depth: TextureView,
    /// Depth of everything, for the alarm.
    pub whole: TextureView,
    /// Items of everything, for the alarm.
    pub items: TextureView,
}

impl Targets {
    /// Of `size` pixels, each above 0.
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let texture = |format| view_of(gpu, size, format);
        Self { size, depth: texture(DEPTH), whole: texture(DEPTH), items: texture(ITEMS) }
    }

    /// A pass that adds to the depth. Items are drawn into as well, and are worth nothing: the alarm clears them before it draws.
    pub fn adds_depth<'e>(&self, commands: &'e mut wgpu::CommandEncoder) -> wgpu::RenderPass<'e> {
        let (load, store) = (wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), wgpu::StoreOp::Discard);
        commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.items,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load, store },
            })],
            depth_stencil_attachment: Some(depth_attachment(&self.depth, None)),
            ..Default::default()
        })
    }
}

/// A view of a new texture that is drawn into and sampled.
pub fn view_of(gpu: &Gpu, size: [u32; 2], format: TextureFormat) -> TextureView {
    let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
    texture(gpu, size, format, usage).create_view(&Default::default())
}

/// A texture of one level.
pub fn texture(gpu: &Gpu, [width, height]: [u32; 2], format: TextureFormat, usage: TextureUsages) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

/// A picture that stands for a window.
pub struct Canvas {
    size: [u32; 2],
    texture: wgpu::Texture,
    /// By byte of a pixel's red, green and blue.
    order: [usize; 3],
    /// To draw into.
    pub view: TextureView,
    pixels: wgpu::Buffer,
}

impl Canvas {
    /// Of `size` pixels, each above 0.
    pub fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        Self::ordered(gpu, size, PICTURE, [0, 1, 2])
    }

    /// In the format of a window; `None` where its pixels aren't four bytes.
    pub fn of_format(gpu: &Gpu, size: [u32; 2], format: TextureFormat) -> Option<Self> {
        let order = match format {
            TextureFormat::Rgba8Unorm | TextureFormat::Rgba8UnormSrgb => [0, 1, 2],
            TextureFormat::Bgra8Unorm | TextureFormat::Bgra8UnormSrgb => [2, 1, 0],
            _ => return None,
        };
        Some(Self::ordered(gpu, size, format, order))
    }

    fn ordered(gpu: &Gpu, size: [u32; 2], format: TextureFormat, order: [usize; 3]) -> Self {
        let texture = texture(gpu, size, format, TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC);
        let bytes = u64::from(row(size) * size[1]);
        let pixels = gpu.buffer(bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        Self { size, view: texture.create_view(&Default::default()), texture, order, pixels }
    }

    /// Waits for what was drawn, and takes it.
    pub fn read(&self, gpu: &Gpu) -> Result<Picture, GpuError> {
        let [width, height] = self.size;
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row(self.size)), rows_per_image: None };
        let to = wgpu::TexelCopyBufferInfo { buffer: &self.pixels, layout };
        let extent = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        commands.copy_texture_to_buffer(self.texture.as_image_copy(), to, extent);
        let mut picture = Picture::new(width as usize, height as usize, [0; 3]);
        gpu.run(commands.finish(), &[(&self.pixels, self.pixels.size())], |views| {
            let rows = views[0].chunks_exact(row(self.size) as usize);
            for (to, from) in picture.pixels_mut().chunks_exact_mut(width as usize).zip(rows) {
                to.iter_mut().zip(from.chunks_exact(4)).for_each(|(to, from)| *to = self.order.map(|byte| from[byte]));
            }
        })?;
        Ok(picture)
    }
}

/// Bytes of a row, of which copies want multiples of 256.
fn row([width, _]: [u32; 2]) -> u32 {
    (4 * width).next_multiple_of(256)
}
