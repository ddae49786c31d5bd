//! Tubes on the graphics processor: sections of 16 bytes, and the bands of a frame. Each ring of a band is worked out once (`rings.wgsl`), and
//! corners from it (`tubes.wgsl`), which triangles share. Any shader of the scene can draw them: `tubes.wgsl` stands in the place of `geometry.wgsl`.
//!
//! Based on: the thesis' tubes of discrete curves, whose triangles are made as they are drawn; Persson 2012 (thin things a pixel wide, by their
//! weight). What differs: no tessellation stage, sides of a ring, not of a patch, by a bound in pixels; weight in place of width.

use super::bind::{self, STORAGE, WRITABLE};
use super::pipelines::{self, CameraBinding, ITEMS, NEAR, PipelineDesc, Pipelines, depth_state, shader};
use super::targets::Targets;
use crate::building::Building;
use crate::settings::TUBE_PIXELS;
use crate::units::number;
use clap::ValueEnum;
use enfilade::ObjectId;
use enfilade::gpu::{Gpu, GpuError};
use enfilade::runtime::Camera;
use enfilade::scene::Scene;
use enfilade_tubes::{Chosen, Runs, SIDES, Selection, Tube, View, usual_sides};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use wgpu::{BlendState, BufferUsages, CompareFunction, ShaderStages, TextureFormat};

/// Bytes of a tube, and of what comes before the bands.
const TUBE: usize = 32;
const HEAD: usize = 64;
/// Bytes of a band, and of its two rings.
const BAND: usize = 16;
const RINGS: usize = 96;
/// Rings of a workgroup, and workgroups in a row.
const GROUP: u32 = 64;
const ROW: u32 = 65_535;
/// The lower bits of a corner's number: which one it is of those with as many sides. The upper ones: which number of sides that is.
const OF_BUCKET: u32 = 27;
/// Corners of a draw; on a software driver, which takes long over large draws of which anything is clipped.
const DRAWN: u32 = 8192;
const DRAWN_BY_SOFTWARE: u32 = 1024;
/// Bands that a list has room for at first.
const ROOM: usize = 256;
/// Bytes of a triangle of a mesh whose places aren't shared: three of 12, and three numbers.
const TRIANGLE: u64 = 48;

/// How tubes are drawn that are thinner than a pixel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, ValueEnum)]
pub enum Thin {
    /// As they are: they fall into dots.
    Off,
    /// A pixel wide, with the weight of what they are.
    #[default]
    Weighed,
    /// Two pixels wide, with full weight.
    Wide,
}

/// All of them, with what they are called.
pub const THIN: [(Thin, &str); 3] = [(Thin::Off, "off"), (Thin::Weighed, "a pixel, weighed"), (Thin::Wide, "two pixels")];

/// How tubes are drawn.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Look {
    /// Pixels that their surface may be off.
    pub limit: f64,
    /// Thin ones.
    pub thin: Thin,
    /// How much wider than they are these may be.
    pub most: f64,
    /// Sides are colours, and there are lines at sections.
    pub shows_sides: bool,
}

impl Default for Look {
    fn default() -> Self {
        Self { limit: TUBE_PIXELS.usual, thin: Thin::default(), most: 1e3, shows_sides: false }
    }
}

/// Bands that are drawn by a camera.
pub struct List {
    /// The chosen bands.
    pub selection: Selection,
    bands: wgpu::Buffer,
    /// Groups for computing rings, and for drawing.
    groups: [wgpu::BindGroup; 2],
    words: Vec<u32>,
    /// By number of sides: how many bands there are.
    counts: [u32; SIDES.len()],
    triangles: Triangles,
}

/// Tubes of a scene.
pub struct TubeRenderer {
    /// How they are drawn.
    pub look: Look,
    /// The default for thin tubes in this model.
    pub usual: Thin,
    /// Those that the frame draws.
    pub drawn: List,
    /// All, for the alarm: as they are, however thin.
    pub all: List,
    /// Those that the frame draws, as they are, for the alarm.
    bare: List,
    /// Those that it doesn't draw, while they are shown.
    pub culled: List,
    /// Sections and pipelines that lists share.
    pub source: Source,
    /// Bytes that they take on the device, without lists of frames.
    pub bytes: u64,
    /// Bytes that a mesh of them would take, with the sides that meshes have.
    pub bytes_of_mesh: u64,
    /// Objects that are tubes.
    objects: Vec<ObjectId>,
    colours: wgpu::RenderPipeline,
    items: wgpu::RenderPipeline,
    no_items: wgpu::RenderPipeline,
}

/// Sections and pipelines that lists of bands share.
pub struct Source {
    /// Layout of the group of a list.
    pub layout: wgpu::BindGroupLayout,
    runs: Runs,
    /// Works out the rings of a list.
    rings: wgpu::ComputePipeline,
    of_rings: wgpu::BindGroupLayout,
    triangles: Triangles,
    sections: wgpu::Buffer,
    tubes: wgpu::Buffer,
    materials: wgpu::Buffer,
}

impl Source {
    /// Puts the tubes of a building on a device; `objects`: those that are tubes.
    fn new(gpu: &Gpu, building: &Building, objects: &[ObjectId]) -> Result<Self, GpuError> {
        let Building { scene, looks, .. } = building;
        let tubes = &scene.tubes;
        gpu.fits("sections of tubes", (16 * tubes.sections.len()).max(TUBE * tubes.tubes.len()) as u64)?;
        let words = tubes.sections.iter().flat_map(|section| section.bytes().as_chunks::<4>().0.to_owned());
        let sections: Vec<u32> = words.map(u32::from_le_bytes).collect();
        let materials: Vec<u32> = looks.of_objects.iter().map(|&material| u32::from(material)).collect();
        let filled = |words: &[u32]| gpu.filled(words, BufferUsages::STORAGE);
        let [sections, of_tubes, materials] = [&sections[..], &of_tubes(scene), &materials].map(filled);
        let segments = objects.iter().map(|o| scene.objects[o.index()].segments.clone());
        let of_rings = bind::layout(gpu, ShaderStages::COMPUTE, &[STORAGE, STORAGE, STORAGE, WRITABLE]);
        Ok(Self {
            layout: bind::layout(gpu, ShaderStages::VERTEX, &[STORAGE; 3]),
            runs: Runs::new(tubes, segments),
            rings: rings(gpu, &of_rings),
            of_rings,
            triangles: Triangles::new(gpu),
            sections,
            tubes: of_tubes,
            materials,
        })
    }
}

/// Triangles of bands: numbers of corners, which they share.
#[derive(Clone)]
struct Triangles {
    buffer: wgpu::Buffer,
    /// By number of sides: the first of its numbers, and bands of a draw.
    of_sides: [(u32, u32); SIDES.len()],
}

impl Triangles {
    fn new(gpu: &Gpu) -> Self {
        let most = if gpu.is_software { DRAWN_BY_SOFTWARE } else { DRAWN };
        let mut numbers: Vec<u16> = Vec::new();
        let of_sides = SIDES.map(|sides| {
            let (first, bands) = (numbers.len() as u32, (most / (2 * sides)).max(1));
            for band in 0..bands {
                let corner = |ring, side| (2 * sides * band + sides * ring + side % sides) as u16;
                let side =
                    |k| [corner(0, k), corner(0, k + 1), corner(1, k), corner(1, k), corner(0, k + 1), corner(1, k + 1)];
                numbers.extend((0..sides).flat_map(side));
            }
            (first, bands)
        });
        let words: Vec<u32> = numbers.as_chunks().0.iter().map(|&[a, b]| u32::from(a) | u32::from(b) << 16).collect();
        Self { buffer: gpu.filled(&words, BufferUsages::INDEX), of_sides }
    }
}

impl TubeRenderer {
    /// Puts the tubes of a scene on a device; `None`: it has none. Pictures are of `format`.
    ///
    /// # Errors
    ///
    /// Where they don't fit.
    pub fn new(
        gpu: &Gpu,
        pipelines: &Pipelines,
        building: &Building,
        format: TextureFormat,
    ) -> Result<Option<Self>, GpuError> {
        let scene = &building.scene;
        let numbered = (0..).map(ObjectId).zip(&scene.objects);
        let objects: Vec<ObjectId> = numbered.filter(|(_, object)| object.is_tube()).map(|(o, _)| o).collect();
        if objects.is_empty() {
            return Ok(None);
        }
        let source = Source::new(gpu, building, &objects)?;
        let text = concat!(
            include_str!("bands.wgsl"),
            include_str!("tubes.wgsl"),
            include_str!("scene.wgsl"),
            include_str!("tubes_plain.wgsl")
        );
        let module = shader(gpu, text);
        let groups = [Some(&pipelines.layout), None, Some(&source.layout)];
        let pipeline = |corner, pixel, target: wgpu::ColorTargetState| {
            let depth = Some(depth_state(true, CompareFunction::Greater));
            PipelineDesc { groups: &groups, depth, pixel: Some((pixel, target)), ..PipelineDesc::new(&module, corner) }
                .pipeline(gpu)
        };
        // A map of mains is kilometres wide: weighed tubes would be invisible.
        let usual = if objects.len() == scene.objects.len() { Thin::Wide } else { Thin::default() };
        Ok(Some(Self {
            look: Look { thin: usual, ..Look::default() },
            usual,
            drawn: List::new(gpu, &source),
            all: List::new(gpu, &source),
            bare: List::new(gpu, &source),
            culled: List::new(gpu, &source),
            bytes: source.sections.size() + source.tubes.size(),
            bytes_of_mesh: TRIANGLE * scene.tubes.tubes.iter().map(|tube| of_mesh(scene, tube)).sum::<u64>(),
            colours: pipeline("tubular", "colour_of_tube", blended(format)),
            items: pipeline("tubular", "item_of_tube", ITEMS.into()),
            no_items: pipeline("tubular", "no_item", ITEMS.into()),
            source,
            objects,
        }))
    }

    /// Sets the error limit, pixels, and how thin tubes are drawn; `None`: the default.
    pub fn set(&mut self, pixels: Option<f64>, thin: Option<Thin>) {
        self.look.limit = pixels.unwrap_or(TUBE_PIXELS.usual);
        self.look.thin = thin.unwrap_or(self.usual);
    }

    /// Segments and triangles of the frame, in a line.
    pub fn say_drawn(&self) -> String {
        let chosen = self.drawn.chosen();
        let [segments, triangles] = [chosen.segments, chosen.triangles].map(|n| number(n as f64));
        format!("tubes: {segments} segments, {triangles} triangles")
    }

    /// All objects that are tubes.
    pub fn objects(&self) -> impl Iterator<Item = ObjectId> + Clone + '_ {
        self.objects.iter().copied()
    }

    /// Selects bands of some objects and, for the alarm, of `all`: for a camera and a size of pictures.
    pub fn select(
        &mut self,
        gpu: &Gpu,
        scene: &Scene,
        (camera, size): (&Camera, [u32; 2]),
        objects: impl Iterator<Item = ObjectId> + Clone,
        all: Option<&dyn Fn(ObjectId) -> bool>,
    ) {
        let at = At::new(camera, size, self.look);
        self.drawn.fill(gpu, scene, &self.source, &at, objects.clone());
        let at = At::new(camera, size, Look { thin: Thin::Off, ..self.look });
        let of_all = self.objects.iter().copied().filter(|o| all.is_some_and(|is_one| is_one(*o)));
        self.all.fill(gpu, scene, &self.source, &at, of_all);
        self.bare.fill(gpu, scene, &self.source, &at, objects.filter(|_| all.is_some()));
    }

    /// Selects bands of all objects but `drawn`.
    pub fn select_culled(&mut self, gpu: &Gpu, scene: &Scene, (camera, size): (&Camera, [u32; 2]), drawn: &[ObjectId]) {
        let mut is_drawn = vec![false; scene.objects.len()];
        drawn.iter().for_each(|o| is_drawn[o.index()] = true);
        let rest = self.objects.iter().copied().filter(|o| !is_drawn[o.index()]);
        self.culled.fill(gpu, scene, &self.source, &At::new(camera, size, self.look), rest);
    }

    /// Draws a list in flat colours.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, list: &List) {
        self.draw_by(pass, eye, &self.colours, list);
    }

    /// Draws a list as items.
    pub fn draw_items(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, list: &List) {
        self.draw_by(pass, eye, &self.items, list);
    }

    /// Draws a list as what hides things, and is no item.
    pub fn draw_no_items(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, list: &List) {
        self.draw_by(pass, eye, &self.no_items, list);
    }

    /// Draws the depth of what the frame draws as it is, for the alarm: what is widened needn't hold what it stands for, where it bends.
    pub fn stand_in(&self, eye: &CameraBinding, targets: &Targets, commands: &mut wgpu::CommandEncoder) {
        let mut pass = targets.adds_depth(commands);
        self.draw_items(&mut pass, eye, &self.bare);
    }

    fn draw_by(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, pipeline: &wgpu::RenderPipeline, list: &List) {
        if list.counts.iter().any(|&bands| bands > 0) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &eye.group, &[]);
            list.draw(pass);
        }
    }
}

/// Where tubes are looked at from, and how they are drawn there.
pub struct At {
    view: View,
    look: Look,
    focal: f32,
}

impl At {
    /// For a camera and a size of pictures.
    pub fn new(camera: &Camera, size: [u32; 2], look: Look) -> Self {
        let rows = [camera.x, camera.y, camera.w].map(Vec3::as_dvec3);
        let view = View::new(camera.eye.as_dvec3(), rows, f64::from(NEAR), size.map(f64::from), look.limit);
        Self { view, look, focal: camera.y.length() / camera.w.length() * size[1] as f32 / 2.0 }
    }
}

impl List {
    /// An empty one.
    pub fn new(gpu: &Gpu, source: &Source) -> Self {
        let (bands, groups) = room(gpu, source, ROOM);
        let triangles = source.triangles.clone();
        Self { selection: Selection::default(), bands, groups, words: Vec::new(), counts: [0; _], triangles }
    }

    /// Fills it with what is drawn of those objects that are tubes.
    pub fn fill(
        &mut self,
        gpu: &Gpu,
        scene: &Scene,
        source: &Source,
        at: &At,
        objects: impl Iterator<Item = ObjectId> + Clone,
    ) {
        let segments = objects.map(|o| (o.0, scene.objects[o.index()].segments.clone()));
        let of_tubes = segments.filter(|(_, segments)| !segments.is_empty());
        self.selection.select(&scene.tubes, &source.runs, &at.view, of_tubes);
        self.upload(gpu, source, at);
    }

    /// How much of tubes it is.
    pub fn chosen(&self) -> Chosen {
        self.selection.chosen()
    }

    /// Draws it, in a pass that has a pipeline and a camera.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(2, &self.groups[1], &[]);
        pass.set_index_buffer(self.triangles.buffer.slice(..), wgpu::IndexFormat::Uint16);
        for (k, &bands) in self.counts.iter().enumerate() {
            let (first, most) = self.triangles.of_sides[k];
            for start in (0..bands).step_by(most as usize) {
                let indices = 6 * SIDES[k] * most.min(bands - start);
                let base = ((k as u32) << OF_BUCKET) | (2 * SIDES[k] * start);
                pass.draw_indexed(first..first + indices, base as i32, 0..1);
            }
        }
    }

    /// Puts what was chosen on the device, and works out its rings; of more than it holds, those with the fewest sides.
    fn upload(&mut self, gpu: &Gpu, source: &Source, at: &At) {
        let most = (gpu.most() as usize).saturating_sub(HEAD) / RINGS;
        self.words.clear();
        self.words.resize(HEAD / 4, 0);
        let mut bands = 0;
        for (k, sides) in SIDES.into_iter().enumerate() {
            let chosen = self.selection.bands(k);
            let chosen = &chosen[..chosen.len().min(most - bands).min(((1 << OF_BUCKET) / (2 * sides)) as usize)];
            self.words.extend(chosen.iter().flat_map(|band| band.0));
            self.words[k] = bands as u32;
            self.counts[k] = chosen.len() as u32;
            bands += chosen.len();
        }
        if bands == 0 {
            return;
        }
        let Look { thin, most, shows_sides, .. } = at.look;
        self.words[11..HEAD / 4].copy_from_slice(&[
            bands as u32,
            thin as u32,
            u32::from(shows_sides),
            at.focal.to_bits(),
            (most as f32).to_bits(),
        ]);
        if self.bands.size() < 4 * self.words.len() as u64 {
            let most = (gpu.most() as usize - HEAD) / RINGS;
            (self.bands, self.groups) = room(gpu, source, (bands + bands / 4).min(most));
        }
        gpu.queue.write_buffer(&self.bands, 0, bytemuck::cast_slice(&self.words));
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let mut pass = commands.begin_compute_pass(&Default::default());
        pass.set_pipeline(&source.rings);
        pass.set_bind_group(0, &self.groups[0], &[]);
        let groups = (2 * bands as u32).div_ceil(GROUP);
        pass.dispatch_workgroups(groups.min(ROW), groups.div_ceil(ROW), 1);
        drop(pass);
        gpu.queue.submit([commands.finish()]);
    }
}

/// Blended by the weight of thin tubes.
pub(super) fn blended(format: TextureFormat) -> wgpu::ColorTargetState {
    wgpu::ColorTargetState { format, blend: Some(BlendState::ALPHA_BLENDING), write_mask: wgpu::ColorWrites::COLOR }
}

/// Tubes as the shader has them.
fn of_tubes(scene: &Scene) -> Vec<u32> {
    let of = |tube: &Tube| {
        let [x, y, z] = tube.origin.as_vec3().to_array().map(f32::to_bits);
        [x, y, z, tube.inner.to_bits(), tube.sections.start, tube.sections.end, u32::from(tube.closed), tube.scale.to_bits()]
    };
    scene.tubes.tubes.iter().flat_map(of).collect()
}

/// Triangles of a tube's mesh.
fn of_mesh(scene: &Scene, tube: &Tube) -> u64 {
    let sides = scene.tubes.of(tube).first().map_or(0, |section| usual_sides(f64::from(section.radius())));
    let is_hollow = tube.inner > 0.0;
    let walls = tube.segments().len() as u64 * u64::from(2 * sides) * if is_hollow { 2 } else { 1 };
    let cap = if is_hollow { 2 * sides } else { sides - 2 };
    walls + u64::from(if tube.capped && !tube.closed { 2 * cap } else { 0 })
}

/// Computes rings.
fn rings(gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::ComputePipeline {
    let module = shader(gpu, concat!(include_str!("bands.wgsl"), include_str!("rings.wgsl")));
    pipelines::compute(gpu, &module, "ring", &[Some(layout)])
}

/// A buffer for a number of bands, and the groups of bands and rings.
fn room(gpu: &Gpu, source: &Source, bands: usize) -> (wgpu::Buffer, [wgpu::BindGroup; 2]) {
    let list = gpu.buffer((HEAD + BAND * bands) as u64, BufferUsages::STORAGE | BufferUsages::COPY_DST);
    let rings = gpu.buffer((RINGS * bands) as u64, BufferUsages::STORAGE);
    let group = |layout, buffers: &[&wgpu::Buffer]| {
        bind::group(gpu, layout, buffers.iter().map(|buffer| buffer.as_entire_binding()))
    };
    let of_rings = group(&source.of_rings, &[&source.sections, &source.tubes, &list, &rings]);
    let drawn = group(&source.layout, &[&rings, &list, &source.materials]);
    (list, [of_rings, drawn])
}
