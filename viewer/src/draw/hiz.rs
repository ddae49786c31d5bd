//! Occlusion culling by the device alone, in two passes: what showed in the frame before is drawn, a pyramid is built of its depth, and the
//! boxes of the rest are held against that. What may show is drawn in the same frame, so nothing is missed, with or without a past.
//!
//! Based on: Aaltonen, Haar, *GPU-driven rendering pipelines*, SIGGRAPH 2015 (Advances in real-time rendering), as engines have it now.
//! Deviations: the processor lists what is in the frustum, near objects first. So tubes, leaves of doors, ground and, as it looks, glass are
//! drawn as the mode `frustum` draws them. Each object is one draw, which has no corners where the device leaves it out. A rectangle has up
//! to eight texels a side, where engines read two: in offices and cities a fifth to a half fewer triangles are drawn.

use super::bind::{self, COLOUR_TEXTURE, STORAGE, UNIFORM, WRITABLE, view};
use super::draws::Draws;
use super::mesh::Mesh;
use super::pipelines::{self, NEAR, clip, shader};
use super::pyramid::Pyramid;
use super::readback::ReadbackRing;
use crate::building::Building;
use crate::culling::{ByDevice, Decision};
use enfilade::ObjectId;
use enfilade::file::{FileObject, PvsFile};
use enfilade::gpu::{Gpu, GpuError};
use enfilade::runtime::Camera;
use glam::Vec3;
use wgpu::{BindGroup, BindGroupLayout, BufferUsages, ComputePipeline, ShaderStages, TextureView};

/// Bytes of an object: its box, its triangles; what is asked about it; its states; its draws in two passes.
const BYTES: u64 = 32 + 12 + 8 + 2 * 16;
/// Words before the states of objects: objects and triangles that were drawn.
const HEAD: u64 = 2;
/// Bytes of what shaders know of a frame.
const VIEW: usize = 112;
/// Invocations of a workgroup, as the shader has them.
const GROUP: u32 = 64;
/// Workgroups in a row, likewise.
const ROW: u32 = 1024;

/// Object states on the device, and the draws that it makes of them.
pub struct Hiz {
    early: ComputePipeline,
    late: ComputePipeline,
    layout: BindGroupLayout,
    pyramid: Pyramid,
    /// Binds all, with the pyramid as it is; none before the first frame.
    group: Option<BindGroup>,
    view: wgpu::Buffer,
    boxes: wgpu::Buffer,
    asked: wgpu::Buffer,
    states: wgpu::Buffer,
    /// Of the first pass, and of the second.
    pub passes: [Draws; 2],
    /// Of both.
    pub both: Draws,
    read: ReadbackRing<()>,
    /// Counts frames that it decides.
    frame: u32,
    /// By object: whether the device is asked about it.
    is_asked: Vec<bool>,
    /// How many are asked about.
    count: u32,
    list: List,
}

/// Objects in the frustum.
#[derive(Default)]
struct List {
    /// Whether one sees through it, how near it is, the first corner, and the object.
    keys: Vec<(bool, i32, u32, u32)>,
    words: Vec<[u32; 3]>,
    certain: Vec<ObjectId>,
}

impl Hiz {
    /// For the objects of a building.
    ///
    /// # Errors
    ///
    /// Where they don't fit.
    pub fn new(gpu: &Gpu, building: &Building) -> Result<Self, GpuError> {
        let scene = &building.scene;
        let most = scene.objects.len().max(1) as u64;
        gpu.fits("objects", BYTES * most)?;
        let kinds = [UNIFORM, STORAGE, STORAGE, WRITABLE, WRITABLE, COLOUR_TEXTURE];
        let layout = bind::layout(gpu, ShaderStages::COMPUTE, &kinds);
        let module = shader(gpu, include_str!("hiz.wgsl"));
        let pipeline = |name| pipelines::compute(gpu, &module, name, &[Some(&layout)]);
        let copied = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let both = Draws::new(gpu, 2 * scene.objects.len(), BufferUsages::STORAGE);
        Ok(Self {
            early: pipeline("early"),
            late: pipeline("late"),
            layout,
            pyramid: Pyramid::new(gpu),
            group: None,
            view: gpu.buffer(VIEW as u64, BufferUsages::UNIFORM | BufferUsages::COPY_DST),
            boxes: gpu.filled(&boxes(&building.file), BufferUsages::STORAGE),
            asked: gpu.buffer(12 * most, copied),
            states: gpu.buffer(4 * (HEAD + 2 * most), copied | BufferUsages::COPY_SRC),
            passes: [both.with([0..0, 0..0]), both.with([0..0, 0..0])],
            both,
            read: ReadbackRing::new(gpu, 4 * HEAD),
            // States begin with 0: not those of the frame before.
            frame: 1,
            is_asked: scene.objects.iter().map(|o| !o.is_tube()).collect(),
            count: 0,
            list: List::default(),
        })
    }

    /// As if no frame had been drawn yet.
    pub fn restart(&mut self) {
        self.frame += 1;
    }

    /// Whether the device is asked about an object.
    pub fn asks_about(&self, object: ObjectId) -> bool {
        self.is_asked[object.index()]
    }

    /// Lists what the device is asked about in a frame, near objects first. Returns the rest, which is certain.
    pub fn list(
        &mut self,
        gpu: &Gpu,
        (mesh, is_transparent): (&Mesh, &[bool]),
        decision: &Decision,
        eye: Vec3,
    ) -> &[ObjectId] {
        let Self { list: List { keys, words, certain }, is_asked, .. } = self;
        certain.clear();
        certain.extend(decision.objects.iter().filter(|o| !is_asked[o.index()]));
        keys.clear();
        let asked = decision.objects.iter().filter(|o| is_asked[o.index()]);
        let key = |o: ObjectId| (is_transparent[o.index()], mesh.shell(o, eye), mesh.ranges[o.index()].start, o.0);
        keys.extend(asked.map(|&o| key(o)));
        keys.sort_unstable();
        words.clear();
        words.extend(keys.iter().map(|&(.., object)| {
            let range = mesh.drawn(ObjectId(object));
            [object, range.start, range.end - range.start]
        }));
        gpu.queue.write_buffer(&self.asked, 0, bytemuck::cast_slice(words));
        // Solid things of both passes, then glass of both.
        let (solid, count) = (keys.partition_point(|key| !key.0) as u32, words.len() as u32);
        let early = [0..solid, 2 * solid..solid + count];
        let late = [solid..2 * solid, solid + count..2 * count];
        self.passes = [early, late].map(|lists| self.both.with(lists));
        self.both.split(2 * solid, 2 * count);
        self.count = count;
        certain
    }

    /// Records the choice of what the first pass draws of the list: what showed in the frame before; or, `again`, all that the last frame
    /// drew, as a frozen view shows it.
    pub fn choose(&mut self, gpu: &Gpu, camera: &Camera, size: [u32; 2], again: bool, commands: &mut wgpu::CommandEncoder) {
        self.frame += u32::from(!again);
        let [width, height] = size.map(|side| (side as f32).to_bits());
        let eye = camera.eye.to_array().map(f32::to_bits);
        let mut words = [0; VIEW / 4];
        words[..16].copy_from_slice(&clip(camera).to_cols_array().map(f32::to_bits));
        words[16..19].copy_from_slice(&eye);
        let solid = self.passes[0].lists[0].end;
        words[19..26].copy_from_slice(&[NEAR.to_bits(), width, height, self.frame, self.count, solid, u32::from(again)]);
        gpu.queue.write_buffer(&self.view, 0, bytemuck::cast_slice(&words));
        if self.group.is_none() || !self.pyramid.fits(size) {
            self.group = Some(self.bind(gpu, size));
        }
        commands.clear_buffer(&self.states, 0, Some(4 * HEAD));
        self.run(&self.early, &mut commands.begin_compute_pass(&Default::default()));
    }

    /// Records the choice of what the second pass draws: what may show in front of the depth of the first pass, which has one sample a pixel
    /// or, if it `is_smooth`, more.
    pub fn choose_rest(&mut self, gpu: &Gpu, depth: (&TextureView, bool), commands: &mut wgpu::CommandEncoder) {
        let mut pass = commands.begin_compute_pass(&Default::default());
        self.pyramid.record(gpu, depth, &mut pass);
        self.run(&self.late, &mut pass);
        drop(pass);
        self.read.copy(&self.states, 4 * HEAD, (), commands);
    }

    /// Maps the counts, once the commands are submitted.
    pub fn map(&mut self) {
        self.read.map();
    }

    /// Objects and triangles that the device drew in the last frame that has been read.
    pub fn receive(&mut self) -> Option<ByDevice> {
        let mut last = None;
        while let Some(counts) = self.read.receive(|(), view| {
            let counts: &[u32] = bytemuck::cast_slice(view);
            ByDevice { objects: counts[0].into(), triangles: counts[1].into() }
        }) {
            last = counts.or(last);
        }
        last
    }

    fn run(&self, pipeline: &ComputePipeline, pass: &mut wgpu::ComputePass<'_>) {
        let groups = self.count.div_ceil(GROUP);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.dispatch_workgroups(groups.min(ROW), groups.div_ceil(ROW), 1);
    }

    fn bind(&mut self, gpu: &Gpu, size: [u32; 2]) -> BindGroup {
        let pyramid = view(self.pyramid.fit(gpu, size));
        let buffers = [&self.view, &self.boxes, &self.asked, &self.states, &self.both.buffer];
        let buffers = buffers.map(wgpu::Buffer::as_entire_binding);
        bind::group(gpu, &self.layout, buffers.into_iter().chain([pyramid]))
    }
}

/// Boxes of objects with their triangles, as the shader has them.
fn boxes(file: &PvsFile) -> Vec<u32> {
    let of = |object: &FileObject| {
        let [[a, b, c], [d, e, f]] = object.bounds.map(|p| p.to_array().map(f32::to_bits));
        [a, b, c, object.triangles, d, e, f, 0]
    };
    file.objects.iter().flat_map(of).collect()
}
