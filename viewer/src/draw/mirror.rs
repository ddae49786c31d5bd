//! Mirrors: what a reflected camera sees is drawn into a picture of its own, pixel for pixel where the mirror shows it.
//!
//! Based on: Luebke and Georges 1995, as [`enfilade::runtime::Mirror`] has it. A mirror in a mirror shows as dark glass.

use super::bind::{self, COLOUR_TEXTURE, view};
use super::frame::{FrameContext, Passes};
use super::full::Full;
use super::leaves::Drawn;
use super::mesh::Runs;
use super::pass::begin;
use super::pipelines::{CameraBinding, DEPTH, PipelineDesc, Pipelines, depth_state, shader};
use super::targets::view_of;
use super::tubes::{At, List};
use enfilade::ObjectId;
use enfilade::gpu::Gpu;
use enfilade::runtime::{Camera, Culler, Doors, Mirror, Mode, View};
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;
use wgpu::{BufferUsages, CommandEncoder, ShaderStages, TextureFormat, TextureView};

/// Most mirrors; of more, the first go.
pub const MOST: usize = 4;
/// The background in a mirror.
const DARK: wgpu::Color = wgpu::Color { r: 0.72, g: 0.82, b: 0.86, a: 1.0 };

/// Mirrors of a building, and what they show in a frame.
pub struct Mirrors {
    mirrors: Vec<Mirror>,
    corners: Vec<Vec<Vec3>>,
    /// Culls for them.
    eyes: View,
    /// In the frame: mirror, camera and range of `objects`.
    reflections: Vec<(usize, Camera, Range<usize>)>,
    objects: Vec<ObjectId>,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    format: TextureFormat,
    /// Of each mirror: its camera, its corners, and its picture with depth at a size.
    places: Vec<Place>,
}

struct Place {
    eye: CameraBinding,
    corners: wgpu::Buffer,
    picture: Option<([u32; 2], TextureView, TextureView, wgpu::BindGroup)>,
    /// Made when there are tubes.
    tubes: Option<List>,
    shows: bool,
}

/// Records what the mirrors show, if they are drawn.
pub fn reflect(frame: &FrameContext<'_>, passes: &mut Passes, commands: &mut CommandEncoder) {
    let Passes { mirrors, full, .. } = passes;
    if frame.has_mirrors {
        mirrors.record(frame, full.as_ref().filter(|_| frame.is_full), commands);
    }
}

impl Mirrors {
    /// None yet.
    pub fn new(gpu: &Gpu, pipelines: &Pipelines, culler: &Arc<Culler>, format: TextureFormat) -> Self {
        let layout = bind::layout(gpu, ShaderStages::FRAGMENT, &[COLOUR_TEXTURE]);
        let module = shader(gpu, include_str!("mirror.wgsl"));
        let pipeline = PipelineDesc {
            groups: &[Some(&pipelines.layout), Some(&layout)],
            corners: Some(wgpu::VertexBufferLayout {
                array_stride: 12,
                step_mode: wgpu::VertexStepMode::Vertex,
                attributes: &wgpu::vertex_attr_array![0 => Float32x3],
            }),
            depth: Some(depth_state(true, wgpu::CompareFunction::GreaterEqual)),
            pixel: Some(("pixel", format.into())),
            ..PipelineDesc::new(&module, "corner")
        }
        .pipeline(gpu);
        Self {
            mirrors: Vec::new(),
            corners: Vec::new(),
            eyes: View::new(culler),
            reflections: Vec::new(),
            objects: Vec::new(),
            pipeline,
            layout,
            format,
            places: Vec::new(),
        }
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
    pub fn look(&mut self, doors: &Doors, camera: &Camera) {
        self.reflections.clear();
        self.objects.clear();
        if self.mirrors.is_empty() {
            return;
        }
        self.eyes.set_doors(doors);
        self.eyes.cull(camera, Mode::PortalsAndPvs);
        for reflection in self.eyes.mirrors(&self.mirrors, 1, None) {
            let start = self.objects.len();
            self.objects.extend_from_slice(reflection.objects);
            self.reflections.push((reflection.mirror, reflection.camera, start..self.objects.len()));
        }
    }

    /// Draws what they show into their pictures, in flat colours or as it looks.
    fn record(&mut self, frame: &FrameContext<'_>, full: Option<&Full>, commands: &mut CommandEncoder) {
        let FrameContext { gpu, pipelines, mesh, is_transparent, leaves, .. } = *frame;
        let size = frame.targets.size;
        self.places.iter_mut().for_each(|place| place.shows = false);
        let (mut runs, mut doors, mut drawn) = (Runs::default(), Vec::new(), Drawn::default());
        for (mirror, camera, objects) in &self.reflections {
            let Some(place) = self.places.get_mut(*mirror) else { continue };
            let objects = &self.objects[objects.clone()];
            if place.picture.as_ref().is_none_or(|picture| picture.0 != size) {
                let seen = view_of(gpu, size, self.format);
                let group = bind::group(gpu, &self.layout, [view(&seen)]);
                let depth = view_of(gpu, size, DEPTH);
                place.picture = Some((size, seen, depth, group));
            }
            if let Some(tubes) = frame.tubes {
                let list = place.tubes.get_or_insert_with(|| List::new(gpu, &tubes.source));
                let objects = objects.iter().copied().filter(|o| !mesh.is_hidden(*o));
                list.fill(gpu, &frame.building.scene, &tubes.source, &At::new(camera, size, tubes.look), objects);
            }
            let tubes = frame.tubes.zip(place.tubes.as_ref());
            let Some((_, seen, depth, _)) = &place.picture else { continue };
            place.shows = true;
            place.eye.set(gpu, camera, Some(plane(&self.corners[*mirror])));
            runs.set(mesh, objects, is_transparent, Some(camera.eye));
            let mut pass = begin(commands, seen, depth, Some(DARK), None);
            frame.doors.before(camera, &mut doors);
            leaves.list(&doors, &mut drawn);
            if let Some(full) = full {
                let seen_through = objects.iter().copied().filter(|o| is_transparent[o.index()]);
                let eye = (&place.eye, camera.eye);
                let of_tubes = tubes.map(|(_, list)| list);
                full.draw_in_mirror(&mut pass, eye, mesh, &runs.solid, seen_through, (leaves, &drawn, of_tubes));
                continue;
            }
            pipelines.bind(&mut pass, &place.eye);
            pass.set_pipeline(&pipelines.mirrored);
            runs.solid.iter().for_each(|run| pass.draw(run.clone(), 0..1));
            leaves.bind(&mut pass, &place.eye);
            drawn.solid.iter().for_each(|run| pass.draw(run.clone(), 0..1));
            tubes.into_iter().for_each(|(tubes, list)| tubes.draw(&mut pass, &place.eye, list));
        }
    }

    /// Draws the mirrors themselves.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding) {
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
