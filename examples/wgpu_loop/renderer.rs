//! A model on the device.

use super::canvas::{Canvas, clip};
use enfilade::runtime::Camera;
use enfilade::scene::Scene;
use enfilade_measure::walkthrough::picture::{Picture, hsv, hue};
use wgpu::BufferUsages;
use wgpu::util::{BufferInitDescriptor, DeviceExt};

/// Draws a scene, each object in a colour of its own, into a texture.
pub struct Renderer {
    pub canvas: Canvas,
    pipeline: wgpu::RenderPipeline,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    clip: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl Renderer {
    /// Uploads a scene: triangles, and so objects, in the scene's order.
    pub fn new(scene: &Scene) -> Result<Self, String> {
        let canvas = Canvas::new()?;
        let mut corners: Vec<[u32; 4]> =
            scene.positions.iter().map(|p| p.as_vec3()).map(|p| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits(), 0]).collect();
        for (i, object) in scene.objects.iter().enumerate() {
            let [r, g, b] = hsv(hue(i), 0.35, 0.95);
            for corner in scene.triangles[object.triangles.start as usize..object.triangles.end as usize].iter().flatten() {
                corners[*corner as usize][3] = u32::from_le_bytes([r, g, b, 255]);
            }
        }
        let filled = |contents: &[u8], usage| {
            canvas.device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
        };
        let vertices = filled(bytemuck::cast_slice(&corners), BufferUsages::VERTEX);
        let indices = filled(bytemuck::cast_slice(&scene.triangles), BufferUsages::INDEX);
        let layout = wgpu::VertexBufferLayout {
            array_stride: 16,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Unorm8x4],
        };
        let pipeline = canvas.pipeline(include_str!("shader.wgsl"), &[Some(layout)]);
        let clip = canvas.buffer(64, BufferUsages::UNIFORM);
        let group = canvas.group(&pipeline, &[&clip]);
        Ok(Self { canvas, pipeline, vertices, indices, clip, group })
    }

    /// One frame: `draw` says which triangles, three indices each.
    pub fn frame(&mut self, camera: &Camera, draw: impl FnOnce(&mut wgpu::RenderPass<'_>)) -> Result<Picture, String> {
        self.canvas.queue.write_buffer(&self.clip, 0, bytemuck::cast_slice(&clip(camera).to_cols_array()));
        self.canvas.frame(|pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.group, &[]);
            pass.set_vertex_buffer(0, self.vertices.slice(..));
            pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
            draw(pass);
        })
    }
}
