//! What any engine has: a device, a pipeline, a model on the device, and a picture at the end of a frame.

use enfilade::runtime::Camera;
use enfilade::scene::Scene;
use enfilade::walkthrough::picture::{Picture, hsv, hue};
use glam::{Mat4, Vec3, Vec4};
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BufferUsages, TextureFormat, TextureUsages};

/// Size of the pictures, pixels. A row of them takes a multiple of 256 bytes, as copies want it.
const SIZE: [u32; 2] = [640, 360];
/// Width over height.
pub const ASPECT: f64 = SIZE[0] as f64 / SIZE[1] as f64;
/// Distance of the near plane, metres. What is seen is seen from the eye: nearer things would have to be looked through.
const NEAR: f32 = 1e-3;

/// Draws a scene, each object in a colour of its own, into a texture.
pub struct Renderer {
    /// The name of what draws.
    pub adapter: String,
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    clip: wgpu::Buffer,
    group: wgpu::BindGroup,
    colour: wgpu::Texture,
    depth: wgpu::Texture,
    pixels: wgpu::Buffer,
}

impl Renderer {
    /// Opens a device, of software where there is no other, and uploads a scene: triangles, and so objects, in the scene's order.
    pub fn new(scene: &Scene) -> Result<Self, String> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12,
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let none = |e: &dyn std::fmt::Display| format!("no graphics processor can be used: {e}");
        let adapter = pollster::block_on(instance.request_adapter(&Default::default())).map_err(|e| none(&e))?;
        let wanted = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wanted)).map_err(|e| none(&e))?;

        let mut corners: Vec<[u32; 4]> =
            scene.positions.iter().map(|p| p.as_vec3()).map(|p| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), 0]).collect();
        for (i, object) in scene.objects.iter().enumerate() {
            let [r, g, b] = hsv(hue(i), 0.35, 0.95);
            for corner in scene.triangles[object.triangles.start as usize..object.triangles.end as usize].iter().flatten() {
                corners[*corner as usize][3] = u32::from_le_bytes([r, g, b, 255]);
            }
        }
        let filled =
            |contents: &[u8], usage| device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage });
        let vertices = filled(bytemuck::cast_slice(&corners), BufferUsages::VERTEX);
        let indices = filled(bytemuck::cast_slice(&scene.triangles), BufferUsages::INDEX);
        let empty = |size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        let clip = empty(64, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let pixels = empty(u64::from(4 * SIZE[0] * SIZE[1]), BufferUsages::MAP_READ | BufferUsages::COPY_DST);
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
        let pipeline = pipeline(&device);
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: clip.as_entire_binding() }],
        });
        let adapter = adapter.get_info().name;
        Ok(Self { adapter, device, queue, pipeline, vertices, indices, clip, group, colour, depth, pixels })
    }

    /// One frame: `draw` says which triangles, three indices each; of equal depths the first that is drawn shows.
    pub fn frame(&mut self, camera: &Camera, draw: impl FnOnce(&mut wgpu::RenderPass<'_>)) -> Result<Picture, String> {
        self.queue.write_buffer(&self.clip, 0, bytemuck::cast_slice(&clip(camera).to_cols_array()));
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
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
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

fn extent() -> wgpu::Extent3d {
    wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 }
}

/// From metres relative to the origin to clip space: no far plane, depth 1 at the near plane and 0 far away.
fn clip(camera: &Camera) -> Mat4 {
    let row = |v: Vec3| v.extend(-v.dot(camera.eye));
    Mat4::from_cols(row(camera.x), row(camera.y), Vec4::W * NEAR, row(camera.w)).transpose()
}

fn pipeline(device: &wgpu::Device) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(include_str!("shader.wgsl").into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: 16,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4],
            })],
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
