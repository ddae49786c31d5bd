//! Mirrors: what a reflected camera sees is drawn into a picture of its own, pixel for pixel where the mirror shows it.
//!
//! Based on: Luebke and Georges 1995, as [`enfilade::runtime::Mirror`] has it. A mirror in a mirror shows as dark glass.

use super::frame::colour;
use super::full::Full;
use super::leaves::{Drawn, Leaves};
use super::mesh::{Mesh, Runs};
use super::pipelines::{DEPTH, Eye, Pipelines, Recipe, depth_state, shader};
use super::targets::texture;
use super::tubes::{At, List, Pipes};
use crate::doors::Doors;
use enfilade::gpu::Gpu;
use enfilade::runtime::{Camera, Culler, Mirror, Mode, Reflections, Scratch};
use enfilade::scene::Scene;
use glam::Vec3;
use wgpu::{BufferUsages, ShaderStages, TextureFormat, TextureUsages, TextureView};

/// Most mirrors; of more, the first go.
pub const MOST: usize = 4;
/// What is behind everything in a mirror.
const DARK: wgpu::Color = wgpu::Color { r: 0.72, g: 0.82, b: 0.86, a: 1.0 };

/// Mirrors of a building, and what they show in a frame.
pub struct Mirrors {
    mirrors: Vec<Mirror>,
    corners: Vec<Vec<Vec3>>,
    reflections: Reflections,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    format: TextureFormat,
    /// Of each mirror: its camera, its corners, and its picture with depth at a size.
    places: Vec<Place>,
}

struct Place {
    eye: Eye,
    corners: wgpu::Buffer,
    picture: Option<([u32; 2], TextureView, TextureView, wgpu::BindGroup)>,
    /// Made when there are tubes.
    tubes: Option<List>,
    shows: bool,
}

impl Mirrors {
    /// None yet.
    pub fn new(gpu: &Gpu, pipelines: &Pipelines, culler: &Culler, format: TextureFormat) -> Self {
        let layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: None,
            entries: &[wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Float { filterable: false },
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                },
                count: None,
            }],
        });
        let module = shader(gpu, include_str!("mirror.wgsl"));
        let pipeline = Recipe {
            groups: &[Some(&pipelines.layout), Some(&layout)],
            corners: Some(wgpu::VertexBufferLayout {
                array_stride: 12,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3],
            }),
            depth: Some(depth_state(true, wgpu::CompareFunction::GreaterEqual)),
            pixel: Some(("pixel", format.into())),
            ..Recipe::new(&module, "corner")
        }
        .pipeline(gpu);
        let (mirrors, corners, places) = (Vec::new(), Vec::new(), Vec::new());
        Self { mirrors, corners, reflections: Reflections::for_culler(culler), pipeline, layout, format, places }
    }

    /// Hangs one up. Returns whether there was room.
    pub fn hang(&mut self, gpu: &Gpu, pipelines: &Pipelines, mirror: Mirror, corners: &[Vec3; 4]) -> bool {
        if self.mirrors.len() == MOST {
            return false;
        }
        let [a, b, c, d] = corners.map(|p| p.to_array().map(f32::to_bits));
        let words: Vec<u32> = [a, b, c, a, c, d].into_iter().flatten().collect();
        let place = Place {
            eye: pipelines.eye(gpu),
            corners: gpu.filled(&words, BufferUsages::VERTEX),
            picture: None,
            tubes: None,
            shows: false,
        };
        self.mirrors.push(mirror);
        self.corners.push(corners.to_vec());
        self.places.push(place);
        true
    }

    /// Takes all of them down.
    pub fn clear(&mut self) {
        self.mirrors.clear();
        self.corners.clear();
        self.places.clear();
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.mirrors.is_empty()
    }

    /// Works out what they show, in the frame of a camera.
    pub fn look(&mut self, culler: &Culler, camera: &Camera, scratch: &mut Scratch) {
        if !self.mirrors.is_empty() {
            culler.cull(camera, Mode::Both, scratch);
            culler.reflect(camera, Mode::Both, &self.mirrors, 1, scratch, &mut self.reflections);
        }
    }

    /// Draws what they show into their pictures, in flat colours or as it looks.
    #[expect(clippy::too_many_arguments, reason = "a stage of the frame takes what the frame has")]
    pub fn record(
        &mut self,
        gpu: &Gpu,
        pipelines: &Pipelines,
        (mesh, full, tubes): (&Mesh, Option<&Full>, Option<(&Pipes, &Scene)>),
        is_ghost: &[bool],
        leaves: (&Leaves, &Doors),
        size: [u32; 2],
        commands: &mut wgpu::CommandEncoder,
    ) {
        self.places.iter_mut().for_each(|place| place.shows = false);
        let (mut runs, mut doors, mut drawn) = (Runs::default(), Vec::new(), Drawn::default());
        for (i, view) in self.reflections.views().iter().enumerate() {
            let Some(place) = self.places.get_mut(view.mirror) else { continue };
            if place.picture.as_ref().is_none_or(|picture| picture.0 != size) {
                let usage = TextureUsages::RENDER_ATTACHMENT;
                let seen = texture(gpu, size, self.format, usage | TextureUsages::TEXTURE_BINDING);
                let seen = seen.create_view(&Default::default());
                let depth = texture(gpu, size, DEPTH, usage).create_view(&Default::default());
                let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: None,
                    layout: &self.layout,
                    entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&seen) }],
                });
                place.picture = Some((size, seen, depth, group));
            }
            if let Some((pipes, scene)) = tubes {
                let list = place.tubes.get_or_insert_with(|| List::new(gpu, &pipes.source));
                let objects = self.reflections.objects(i).iter().copied().filter(|o| !mesh.is_hidden(*o));
                list.fill(gpu, scene, &pipes.source, &At::new(&view.camera, size, pipes.look), objects);
            }
            let tubes = tubes.map(|(pipes, _)| pipes).zip(place.tubes.as_ref());
            let Some((_, seen, depth, _)) = &place.picture else { continue };
            place.shows = true;
            place.eye.set(gpu, &view.camera, Some(plane(&self.corners[view.mirror])));
            runs.set(mesh, self.reflections.objects(i), is_ghost, Some(view.camera.eye));
            let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[colour(seen, Some(DARK))],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: depth,
                    depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                    stencil_ops: None,
                }),
                ..Default::default()
            });
            leaves.1.before(&view.camera, &mut doors);
            leaves.0.list(&doors, &mut drawn);
            if let Some(full) = full {
                let seen_through = self.reflections.objects(i).iter().copied().filter(|o| is_ghost[o.index()]);
                let eye = (&place.eye, view.camera.eye);
                let of_tubes = tubes.map(|(_, list)| list);
                full.draw_in_mirror(&mut pass, eye, mesh, &runs.solid, seen_through, (leaves.0, &drawn, of_tubes));
                continue;
            }
            pipelines.bind(&mut pass, &place.eye);
            pass.set_pipeline(&pipelines.mirrored);
            runs.solid.iter().for_each(|run| pass.draw(run.clone(), 0..1));
            leaves.0.bind(&mut pass, &place.eye);
            drawn.solid.iter().for_each(|run| pass.draw(run.clone(), 0..1));
            tubes.into_iter().for_each(|(pipes, list)| pipes.draw(&mut pass, &place.eye, list));
        }
    }

    /// Draws the mirrors themselves.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, eye: &Eye) {
        for place in self.places.iter().filter(|place| place.shows) {
            let Some((.., group)) = &place.picture else { continue };
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &eye.group, &[]);
            pass.set_bind_group(1, group, &[]);
            pass.set_vertex_buffer(0, place.corners.slice(..));
            pass.draw(0..6, 0..1);
        }
    }
}

/// The plane of some corners, its normal to where they go round counter-clockwise.
fn plane(corners: &[Vec3]) -> (Vec3, f32) {
    let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or(Vec3::Y);
    (n, n.dot(corners[0]))
}
