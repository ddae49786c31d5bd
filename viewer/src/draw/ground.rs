//! Ground on the graphics processor: the slots of its cache in a buffer, and a draw of all patches, an instance for each part that may show.

use super::bind::{self, STORAGE, UNIFORM};
use super::pipelines::{ITEMS, NEAR, PipelineDesc, depth_state, shader};
use super::smooth::SAMPLES;
use super::sun::TOWARDS;
use crate::culling::Decision;
use crate::ground::{Land, Shown};
use enfilade::file::PvsFile;
use enfilade::gpu::Gpu;
use enfilade::runtime::Camera;
use enfilade_terrain::{Ground, GroundScratch, PARTS, Patch};
use glam::{DVec2, DVec3, Vec3};
use wgpu::{BufferUsages, CompareFunction, ShaderStages, TextureFormat};

/// Bytes of a part of a patch.
const PART: usize = 16;
/// Bytes of what holds for all of them.
const LAND: u64 = 128;

/// How ground looks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Look {
    /// In flat colours.
    Plain,
    /// In the sun.
    Full,
    /// Coloured by level, with borders of tiles.
    Levels,
}

/// Parts of patches on the device.
struct List {
    parts: wgpu::Buffer,
    group: wgpu::BindGroup,
    count: u32,
    words: Vec<[u32; 4]>,
}

/// A ground that is drawn.
pub struct Terrain {
    /// Its tiles.
    pub land: Land,
    /// The selection of the last frame.
    pub shown: Shown,
    /// All that the alarm holds against it.
    whole: GroundScratch,
    uniform: wgpu::Buffer,
    heights: wgpu::Buffer,
    drawn: List,
    all: List,
    plain: wgpu::RenderPipeline,
    smooth: wgpu::RenderPipeline,
    items: wgpu::RenderPipeline,
    /// The item that the alarm knows it by.
    item: u32,
    /// Metres from the lowest to the highest tile.
    relief: f32,
    origin: DVec3,
}

impl Terrain {
    /// Puts a ground on a device, with all tiles that are in memory. `item`: its number for the alarm; `origin`: of the building's file.
    ///
    /// # Errors
    ///
    /// One line: it doesn't fit.
    pub fn new(gpu: &Gpu, land: Land, format: TextureFormat, item: u32, origin: DVec3) -> Result<Self, String> {
        let slots = land.ground.slots();
        let words = land.ground.words(0).len();
        let bytes = 4 * (slots * words) as u64;
        gpu.fits("tiles of the ground", bytes).map_err(|e| e.to_string())?;
        let heights = gpu.buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_DST);
        let uniform = gpu.buffer(LAND, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        let layout = bind::layout(gpu, ShaderStages::VERTEX_FRAGMENT, &[UNIFORM, STORAGE, STORAGE]);
        let module = shader(gpu, include_str!("ground.wgsl"));
        let pipeline = |pixel, format: TextureFormat, samples| {
            PipelineDesc {
                groups: &[Some(&layout)],
                depth: Some(depth_state(true, CompareFunction::Greater)),
                samples,
                pixel: Some((pixel, format.into())),
                ..PipelineDesc::new(&module, "soil")
            }
            .pipeline(gpu)
        };
        let list = || List::new(gpu, &layout, [&uniform, &heights], slots);
        let tiles = || land.ground.tiles().iter().filter(|tile| tile.samples > 0);
        let high = tiles().map(|tile| tile.high).fold(f32::NEG_INFINITY, f32::max);
        let low = tiles().map(|tile| tile.low).fold(f32::INFINITY, f32::min);
        let terrain = Self {
            plain: pipeline("colour", format, 1),
            smooth: pipeline("colour", format, SAMPLES),
            items: pipeline("item", ITEMS, 1),
            drawn: list(),
            all: list(),
            shown: Shown::default(),
            whole: GroundScratch::default(),
            relief: (high - low).max(0.0),
            land,
            uniform,
            heights,
            item,
            origin,
        };
        let ground = &terrain.land.ground;
        let held = (0..ground.tiles().len() as u32).filter_map(|tile| ground.slot(tile));
        terrain.upload(gpu, held);
        Ok(terrain)
    }

    /// Puts slots on the device.
    fn upload(&self, gpu: &Gpu, slots: impl Iterator<Item = u32>) {
        let ground = &self.land.ground;
        for slot in slots {
            let words = ground.words(slot);
            let at = 4 * u64::from(slot) * words.len() as u64;
            gpu.queue.write_buffer(&self.heights, at, bytemuck::cast_slice(words));
        }
    }

    /// Selects what a frame shows. Objects that ground hides leave the decision.
    pub fn select(&mut self, decision: &mut Decision, file: &PvsFile, size: [u32; 2]) {
        self.land.select(decision, file, size, &mut self.shown);
    }

    /// Before a frame's passes: where it is looked at from, and what is drawn. With `alarm`, what that is held against, too.
    pub fn prepare(&mut self, gpu: &Gpu, camera: &Camera, look: Look, size: [u32; 2], alarm: bool) {
        let look = if self.land.shows_tiles { Look::Levels } else { look };
        let camera = self.land.camera(camera, self.origin);
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::cast_slice(&self.words(&camera, look)));
        let ground = &self.land.ground;
        self.drawn.set(gpu, ground, self.shown.patches());
        self.all.count = 0;
        if alarm {
            self.land.select_whole(camera, size, &mut self.whole);
            self.all.set(gpu, ground, self.whole.patches());
        }
    }

    /// Pixels that what is drawn may be from what it is held against: each may be wrong by its own error.
    pub fn tolerance(&self) -> f32 {
        self.shown.scratch.worst() + self.whole.worst()
    }

    /// Uniforms: `Land` of the shader.
    fn words(&self, camera: &Camera, look: Look) -> [u32; LAND as usize / 4] {
        let header = self.land.ground.header();
        let size = header.grid.size();
        let eye = camera.eye.as_dvec3();
        // In columns and rows: whole ones, and the rest in metres.
        let spacing = DVec2::from_array(header.spacing);
        let middle = DVec2::from_array(size.map(|samples| f64::from(samples - 1) / 2.0));
        let at = DVec2::new(eye.x, eye.z) / spacing + middle;
        let whole = at.floor();
        let rest = ((at - whole) * spacing).as_vec2();
        let sun = self.land.place.turn(TOWARDS.normalize().as_dvec3()).as_vec3();
        let row = |v: Vec3, w: f32| v.extend(w).to_array().map(f32::to_bits);
        let [x, y, w] = [row(camera.x, 0.0), row(camera.y, 0.0), row(camera.w, NEAR)];
        let ground = &self.land.ground;
        let mut words = [0; LAND as usize / 4];
        let parts: [&[u32]; 8] = [
            &x,
            &y,
            &w,
            &row(sun, self.relief),
            &[rest.x, rest.y, spacing.x as f32, spacing.y as f32].map(f32::to_bits),
            &[whole.x as i32, whole.y as i32, size[0] as i32 - 1, size[1] as i32 - 1].map(i32::cast_unsigned),
            &[(header.step as f32).to_bits(), camera.eye.y.to_bits(), header.grid.side(), header.width.bytes() as u32],
            &[ground.words(0).len() as u32, look as u32, self.item],
        ];
        words.iter_mut().zip(parts.concat()).for_each(|(to, from)| *to = from);
        words
    }

    /// Draws it in a pass of one sample a pixel or several.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, is_smooth: bool) {
        self.draw_by(pass, if is_smooth { &self.smooth } else { &self.plain }, &self.drawn);
    }

    /// Draws all of it, for the alarm.
    pub fn draw_items(&self, pass: &mut wgpu::RenderPass<'_>) {
        self.draw_by(pass, &self.items, &self.all);
    }

    fn draw_by(&self, pass: &mut wgpu::RenderPass<'_>, pipeline: &wgpu::RenderPipeline, list: &List) {
        if list.count > 0 {
            let cells = (self.land.ground.header().grid.side() - 1) / PARTS;
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &list.group, &[]);
            pass.draw(0..6 * cells * cells, 0..list.count);
        }
    }

    /// After a frame: takes in tiles that have come, and asks for more.
    pub fn load(&mut self, gpu: &Gpu, size: [u32; 2]) {
        self.land.load(size, &mut self.shown);
        self.upload(gpu, self.land.ground.changed().iter().copied());
    }
}

impl List {
    /// Of as many patches as there are slots.
    fn new(gpu: &Gpu, layout: &wgpu::BindGroupLayout, [uniform, heights]: [&wgpu::Buffer; 2], slots: usize) -> Self {
        let most = slots * (PARTS * PARTS) as usize;
        let parts = gpu.buffer((PART * most) as u64, BufferUsages::STORAGE | BufferUsages::COPY_DST);
        let group = bind::group(gpu, layout, [uniform, heights, &parts].map(wgpu::Buffer::as_entire_binding));
        Self { group, count: 0, words: Vec::with_capacity(most), parts }
    }

    fn set(&mut self, gpu: &Gpu, ground: &Ground, patches: &[Patch]) {
        self.words.clear();
        for (patch, slot) in patches.iter().filter_map(|patch| Some((patch, ground.slot(patch.tile)?))) {
            let (key, sides) = (patch.key, u32::from(patch.coarser) << 8);
            let word = |[x, y]: [u32; 2]| [slot, key.x, key.y, key.level | sides | x << 16 | y << 24];
            self.words.extend(patch.drawn_parts().map(word));
        }
        self.count = self.words.len() as u32;
        if self.count > 0 {
            gpu.queue.write_buffer(&self.parts, 0, bytemuck::cast_slice(&self.words));
        }
    }
}
