//! What any engine has: a device, a pipeline, and a picture at the end of a frame.

use enfilade::runtime::Camera;
use enfilade_measure::walkthrough::picture::Picture;
use glam::{Mat4, Vec3, Vec4};
use wgpu::{BufferUsages, TextureFormat, TextureUsages};

/// Size of the pictures, pixels. A row of them takes a multiple of 256 bytes, as copies want it.
pub const SIZE: [u32; 2] = [640, 360];
/// Width over height.
pub const ASPECT: f64 = SIZE[0] as f64 / SIZE[1] as f64;
/// Distance of the near plane, metres. What is seen is seen from the eye: nearer things would have to be looked through.
const NEAR: f32 = 1e-3;

/// A device that draws into a texture.
pub struct Canvas {
    /// The name of what draws.
    pub adapter: String,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    colour: wgpu::Texture,
    depth: wgpu::Texture,
    pixels: wgpu::Buffer,
}

impl Canvas {
    /// Opens a device, of software where there is no other.
    pub fn new() -> Result<Self, String> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let none = |e: &dyn std::fmt::Display| format!("no graphics processor can be used: {e}");
        let adapter = pollster::block_on(instance.request_adapter(&Default::default())).map_err(|e| none(&e))?;
        let wanted = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wanted)).map_err(|e| none(&e))?;
        let texture = |format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: extent(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let colour = texture(TextureFormat::Rgba8Unorm, TextureUsages::COPY_SRC);
        let depth = texture(TextureFormat::Depth32Float, TextureUsages::empty());
        let pixels = buffer(&device, u64::from(4 * SIZE[0] * SIZE[1]), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        Ok(Self { adapter: adapter.get_info().name, device, queue, colour, depth, pixels })
    }

    /// A buffer that is written later.
    pub fn buffer(&self, bytes: u64, usage: BufferUsages) -> wgpu::Buffer {
        buffer(&self.device, bytes, usage | BufferUsages::COPY_DST)
    }

    /// Buffers for the shaders of a pipeline, by their bindings.
    pub fn group(&self, pipeline: &wgpu::RenderPipeline, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let layout = &pipeline.get_bind_group_layout(0);
        self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }

    /// Triangles by a shader with the entry points `corner` and `pixel`; of equal depths the first that is drawn shows.
    pub fn pipeline(&self, shader: &str, corners: &[Option<wgpu::VertexBufferLayout<'_>>]) -> wgpu::RenderPipeline {
        let source = wgpu::ShaderSource::Wgsl(shader.into());
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: corners,
            },
            // Models are wound both ways: nothing is culled by winding.
            primitive: Default::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("pixel"),
                compilation_options: Default::default(),
                targets: &[Some(TextureFormat::Rgba8Unorm.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// One frame: `draw` draws it.
    pub fn frame(&self, draw: impl FnOnce(&mut wgpu::RenderPass<'_>)) -> Result<Picture, String> {
        let mut commands = self.device.create_command_encoder(&Default::default());
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.colour.create_view(&Default::default()),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth.create_view(&Default::default()),
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        draw(&mut pass);
        drop(pass);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * SIZE[0]), rows_per_image: None };
        let to = wgpu::TexelCopyBufferInfo { buffer: &self.pixels, layout };
        commands.copy_texture_to_buffer(self.colour.as_image_copy(), to, extent());
        self.queue.submit([commands.finish()]);
        self.read().map_err(|e| format!("{}: {e}", self.adapter))
    }

    /// Waits for the frame and takes its pixels.
    fn read(&self) -> Result<Picture, Box<dyn std::error::Error>> {
        let (told, done) = std::sync::mpsc::channel();
        self.pixels.map_async(wgpu::MapMode::Read, .., move |result| drop(told.send(result)));
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        done.recv()??;
        let mut picture = Picture::new(SIZE[0] as usize, SIZE[1] as usize, [0; 3]);
        for (to, from) in picture.pixels_mut().iter_mut().zip(self.pixels.get_mapped_range(..)?.chunks_exact(4)) {
            to.copy_from_slice(&from[..3]);
        }
        self.pixels.unmap();
        Ok(picture)
    }
}

/// From metres relative to the origin to clip space: no far plane, depth 1 at the near plane and 0 far away.
pub fn clip(camera: &Camera) -> Mat4 {
    let row = |v: Vec3| v.extend(-v.dot(camera.eye));
    Mat4::from_cols(row(camera.x), row(camera.y), Vec4::W * NEAR, row(camera.w)).transpose()
}

fn extent() -> wgpu::Extent3d {
    wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 }
}

fn buffer(device: &wgpu::Device, size: u64, usage: BufferUsages) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
}
