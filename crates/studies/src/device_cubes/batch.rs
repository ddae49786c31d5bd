//! Faces drawn together: their buffers, the commands that fill them, and what is read back.

use super::scene::GpuScene;
use enfilade::gpu::{Gpu, GpuError, two};
use enfilade::pvs::cubes::CubeView;
use std::ops::Range;
use wgpu::BufferUsages;

/// Bytes of ids in one batch, unless one face takes more: what a few views of the usual size take.
const BUDGET: u64 = 16 << 20;
/// Most faces of a batch: the shader keeps a face in the upper bits of a word.
const FACES: u64 = 4096;
/// Blocks of large triangles that there is room for at first: most batches queue fewer.
const BLOCKS: u32 = 1 << 18;
/// Hits that there is room for at first, as a fraction of the pixels.
const HITS: f64 = 0.125;
/// Triangles that a workgroup takes.
const GROUP: u32 = 64;
/// Workgroups that draw blocks: enough for the largest device.
const DRAWERS: u32 = 2048;
/// Words of a view and of a stage in the shader.
const VIEW: usize = 20;
const STAGE: usize = 8;
/// Kinds of stages in the shader.
const LARGE: u32 = 0;
const SMALL: u32 = 1;
const IDS: u32 = 2;
const SEE_THROUGH: u32 = 3;
/// Pixels along a tile's edge in the shader.
const TILE: u32 = 8;

/// Buffers for faces of one size.
pub(super) struct Batch {
    pub size: u32,
    pub faces: u32,
    /// No more faces fit.
    pub is_full: bool,
    nearest: wgpu::Buffer,
    ids: wgpu::Buffer,
    ids_here: wgpu::Buffer,
    marks: wgpu::Buffer,
    views: wgpu::Buffer,
    /// The stages, one after the other, `stride` bytes apart.
    stages: wgpu::Buffer,
    stride: u64,
    /// Blocks of large triangles; counted apart are those of opaque and of see-through ones.
    queue: List<2>,
    /// Of see-through triangles.
    hits: List<3>,
    hits_here: wgpu::Buffer,
    counts_here: wgpu::Buffer,
    weights: Option<wgpu::Buffer>,
}

/// A list that the device writes after its counts, of items of some words.
struct List<const WORDS: u64> {
    /// Its name in errors.
    what: &'static str,
    capacity: u32,
    there: wgpu::Buffer,
}

/// A face to be drawn.
pub(super) struct Face<'v> {
    /// Which of the views it is of.
    pub index: usize,
    pub view: &'v CubeView,
    pub face: usize,
}

impl Batch {
    /// For `wanted` faces at once, or as many as fit.
    pub fn new(scene: &GpuScene, size: u32, wanted: usize) -> Result<Self, GpuError> {
        let gpu = &scene.gpu;
        let bytes = u64::from(size).pow(2) * 4;
        gpu.fits("a face's pixels", bytes)?;
        let most = (BUDGET / bytes).clamp(1, FACES);
        let faces = (wanted as u64).clamp(1, most) as u32;
        let all = bytes * u64::from(faces);
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let tiles = u64::from(size.div_ceil(TILE)).pow(2) * 4 * u64::from(faces);
        let stride = (STAGE as u64 * 4).next_multiple_of(u64::from(gpu.limits.min_uniform_buffer_offset_alignment));
        // The first view and the last may have faces in other batches, too.
        let views = u64::from(faces) / 6 + 2;
        let marks = (views * u64::from(scene.opaque().end).div_ceil(32)).max(1) * 4;
        gpu.fits("marks of triangles", marks)?;
        let hits = List::new(gpu, "hits of see-through triangles", (all as f64 / 4.0 * HITS) as u32 + 64)?;
        Ok(Self {
            size,
            faces,
            is_full: u64::from(faces) == most,
            nearest: gpu.buffer(all + tiles, usage),
            ids: gpu.buffer(all, usage | BufferUsages::COPY_SRC),
            ids_here: here(gpu, all),
            marks: gpu.buffer(marks, usage),
            views: gpu.buffer(views * VIEW as u64 * 4, usage),
            stages: gpu.buffer(stride * 4, BufferUsages::UNIFORM | BufferUsages::COPY_DST),
            stride,
            queue: List::new(gpu, "blocks of large triangles", BLOCKS)?,
            hits_here: here(gpu, hits.there.size()),
            hits,
            counts_here: here(gpu, 12),
            weights: None,
        })
    }

    /// Draws up to [`Batch::faces`] faces; hands the complements of their ids (0 where there is none), and of each hit pixel, triangle and depth, to
    /// `ids` and `hits`.
    pub fn draw(
        &mut self,
        scene: &GpuScene,
        faces: &[Face<'_>],
        mut ids: impl FnMut(&[u32]),
        hits: impl FnOnce(&[u32]),
    ) -> Result<(), GpuError> {
        let bytes = u64::from(self.size).pow(2) * 4 * faces.len() as u64;
        let found = self.run(
            scene,
            faces,
            true,
            |batch, commands| {
                commands.copy_buffer_to_buffer(&batch.ids, 0, &batch.ids_here, 0, bytes);
                (batch.ids_here.clone(), bytes)
            },
            |words| ids(words),
        )?;
        if found == 0 {
            hits(&[]);
            return Ok(());
        }
        let (gpu, bytes) = (&scene.gpu, u64::from(found) * 12);
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        commands.copy_buffer_to_buffer(&self.hits.there, 4, &self.hits_here, 0, bytes);
        gpu.run(commands.finish(), &[(&self.hits_here, bytes)], |views| hits(bytemuck::cast_slice(&views[0])))
    }

    /// Draws faces, adds up for each view that they are of (six a view, the first may begin in its middle) what objects show, and hands
    /// the sums to `read`: three words an object.
    pub fn count(
        &mut self,
        scene: &GpuScene,
        faces: &[Face<'_>],
        weights: impl FnOnce() -> Vec<u32>,
        mut read: impl FnMut(&[u32]),
    ) -> Result<(), GpuError> {
        let gpu = &scene.gpu;
        let first_face = faces.first().map_or(0, |f| f.face) as u32;
        let views = (first_face as usize + faces.len()).div_ceil(6);
        let bytes = (views * scene.objects).max(1) as u64 * 12;
        gpu.fits("sums of objects", bytes)?;
        let weights = self.weights.get_or_insert_with(|| gpu.filled(&weights(), BufferUsages::STORAGE)).clone();
        let sums = gpu.buffer(bytes, BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST);
        let here = here(gpu, bytes);
        let batch = gpu.filled(&[self.size, first_face, scene.objects as u32, 0], BufferUsages::UNIFORM);
        let buffers = [&self.ids, &scene.owners_there, &weights, &sums, &batch].map(|b| b.as_entire_binding());
        let group = group(gpu, &scene.pipelines.count_layout, &buffers);
        self.run(
            scene,
            faces,
            false,
            |batch, commands| {
                commands.clear_buffer(&sums, 0, None);
                let mut pass = commands.begin_compute_pass(&Default::default());
                pass.set_pipeline(&scene.pipelines.count);
                pass.set_bind_group(0, &group, &[]);
                // Eight by eight invocations, each of sixteen pixels of a row.
                pass.dispatch_workgroups(batch.size.div_ceil(128), batch.size.div_ceil(8), faces.len() as u32);
                drop(pass);
                commands.copy_buffer_to_buffer(&sums, 0, &here, 0, bytes);
                (here.clone(), bytes)
            },
            |words| read(words),
        )?;
        Ok(())
    }

    /// Draws faces, does what `then` adds to the commands, and hands the words of its buffer to `read`; again with more room where a list was cut
    /// short. How many hits there are.
    fn run(
        &mut self,
        scene: &GpuScene,
        faces: &[Face<'_>],
        see_through: bool,
        then: impl Fn(&Self, &mut wgpu::CommandEncoder) -> (wgpu::Buffer, u64),
        mut read: impl FnMut(&[u32]),
    ) -> Result<u32, GpuError> {
        let gpu = &scene.gpu;
        loop {
            gpu.check()?;
            let mut commands = gpu.device.create_command_encoder(&Default::default());
            self.fill(scene, faces, see_through, &mut commands);
            let (read_back, bytes) = then(self, &mut commands);
            let [blocks, hits] = [self.queue.capacity, self.hits.capacity];
            let counts = gpu.run(commands.finish(), &[(&self.counts_here, 12), (&read_back, bytes)], |views| {
                let counts: [u32; 3] = bytemuck::pod_read_unaligned(&views[0]);
                let fit = counts[0].max(counts[1]) <= blocks && counts[2] <= hits;
                if fit {
                    read(bytemuck::cast_slice(&views[1]));
                }
                (fit, counts)
            })?;
            let (fit, [opaque, clear, hits]) = counts;
            if fit {
                return Ok(hits);
            }
            self.queue.grow(gpu, opaque.max(clear))?;
            if self.hits.grow(gpu, hits)? {
                self.hits_here = here(gpu, self.hits.there.size());
            }
        }
    }

    /// The commands that fill the buffers.
    fn fill(&self, scene: &GpuScene, faces: &[Face<'_>], see_through: bool, commands: &mut wgpu::CommandEncoder) {
        let gpu = &scene.gpu;
        let views = faces.chunk_by(|a, b| a.index == b.index).map(|of_view| of_view[0].view);
        let views: Vec<u32> = views.flat_map(words_of_view).collect();
        gpu.queue.write_buffer(&self.views, 0, bytemuck::cast_slice(&views));
        let count = (views.len() / VIEW) as u32;
        let stages = self.write_stages(scene, faces, see_through);
        let pixels = u64::from(self.size).pow(2) * 4 * faces.len() as u64;
        commands.clear_buffer(&self.nearest, 0, Some(pixels));
        commands.clear_buffer(&self.ids, 0, Some(pixels));
        commands.clear_buffer(&self.marks, 0, None);
        commands.clear_buffer(&self.queue.there, 0, Some(8));
        commands.clear_buffer(&self.hits.there, 0, Some(4));
        let buffers = [
            &scene.positions,
            &scene.triangles,
            &self.views,
            &self.stages,
            &self.nearest,
            &self.ids,
            &self.queue.there,
            &self.hits.there,
            &self.marks,
        ];
        let mut buffers = buffers.map(|b| b.as_entire_binding());
        let size = wgpu::BufferSize::new(STAGE as u64 * 4);
        buffers[3] = wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer: &self.stages, offset: 0, size });
        let group = group(gpu, &scene.pipelines.ids_layout, &buffers);
        let mut pass = commands.begin_compute_pass(&Default::default());
        for (stage, (kind, triangles)) in (0u32..).zip(&stages) {
            pass.set_bind_group(0, &group, &[stage * self.stride as u32]);
            if matches!(*kind, SMALL | SEE_THROUGH) {
                let groups = self.size.div_ceil(TILE).div_ceil(8);
                pass.set_pipeline(&scene.pipelines.tiles);
                pass.dispatch_workgroups(groups, groups, faces.len() as u32);
            }
            pass.set_pipeline(&scene.pipelines.triangles);
            let groups = (triangles.len() as u32).div_ceil(GROUP);
            let columns = groups.min(gpu.limits.max_compute_workgroups_per_dimension);
            pass.dispatch_workgroups(columns, groups.div_ceil(columns), count);
            if *kind != SMALL {
                pass.set_pipeline(&scene.pipelines.blocks);
                pass.dispatch_workgroups(DRAWERS, 1, 1);
            }
        }
        drop(pass);
        commands.copy_buffer_to_buffer(&self.queue.there, 0, &self.counts_here, 0, 8);
        commands.copy_buffer_to_buffer(&self.hits.there, 0, &self.counts_here, 8, 4);
    }

    /// Writes the stages for the shader: kinds, and the triangles of each. Those without triangles are left out.
    fn write_stages(&self, scene: &GpuScene, faces: &[Face<'_>], see_through: bool) -> Vec<(u32, Range<u32>)> {
        let first_face = faces.first().map_or(0, |f| f.face) as u32;
        let mut stages = [LARGE, SMALL, IDS].map(|kind| (kind, scene.opaque())).to_vec();
        stages.extend(see_through.then(|| (SEE_THROUGH, scene.see_through())));
        stages.retain(|(_, triangles)| !triangles.is_empty());
        let mut words = vec![0u32; self.stride as usize / 4 * stages.len()];
        for (words, (kind, triangles)) in words.chunks_mut(self.stride as usize / 4).zip(&stages) {
            let (faces, lists) = ([faces.len() as u32, first_face], [self.queue.capacity, self.hits.capacity]);
            words[..STAGE].copy_from_slice(&[
                *kind,
                triangles.start,
                triangles.end,
                self.size,
                faces[0],
                faces[1],
                lists[0],
                lists[1],
            ]);
        }
        scene.gpu.queue.write_buffer(&self.stages, 0, bytemuck::cast_slice(&words));
        stages
    }
}

impl<const WORDS: u64> List<WORDS> {
    fn new(gpu: &Gpu, what: &'static str, capacity: u32) -> Result<Self, GpuError> {
        // Two words of counts at most.
        let bytes = 8 + u64::from(capacity) * WORDS * 4;
        gpu.fits(what, bytes)?;
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        Ok(Self { what, capacity, there: gpu.buffer(bytes, usage) })
    }

    /// With room for so many items, and some; whether it has grown.
    fn grow(&mut self, gpu: &Gpu, needed: u32) -> Result<bool, GpuError> {
        let grows = needed > self.capacity;
        if grows {
            *self = Self::new(gpu, self.what, needed.saturating_add(needed / 4))?;
        }
        Ok(grows)
    }
}

/// What the shader knows of a view.
fn words_of_view(view: &CubeView) -> [u32; VIEW] {
    let eye = view.eye.to_array().map(two);
    let axes = [0, 1, 2].map(|k| view.frame.col(k).to_array().map(|v| v as f32));
    let mut words = [0; VIEW];
    let rows = [eye.map(|e| e[0]), eye.map(|e| e[1]), axes[0], axes[1], axes[2]];
    for (row, words) in rows.into_iter().zip(words.chunks_mut(4)) {
        words[..3].copy_from_slice(&row.map(f32::to_bits));
    }
    words
}

/// Where what is read back goes.
fn here(gpu: &Gpu, bytes: u64) -> wgpu::Buffer {
    gpu.buffer(bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST)
}

/// Resources, in the order of their bindings.
fn group(gpu: &Gpu, layout: &wgpu::BindGroupLayout, resources: &[wgpu::BindingResource<'_>]) -> wgpu::BindGroup {
    let bound = (0u32..).zip(resources);
    let entries: Vec<_> =
        bound.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() }).collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}
