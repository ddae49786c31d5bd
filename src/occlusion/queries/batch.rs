//! Batches of work for the device, and their answers.

use super::scene::GpuScene;
use crate::gpu::{Gpu, GpuError};
use crate::occlusion::bounds::Bounds;
use crate::occlusion::pixels::{FORM_ERROR, Rays};
use crate::occlusion::slabs::Slabs;
use std::ops::Range;
use std::sync::mpsc::Sender;
use wgpu::BufferUsages;

/// Most queries of a batch. More: larger buffers for every batch. Fewer: long walks need more batches.
pub(super) const QUESTIONS: usize = 512;
/// Most boxes of a batch, and so of a query.
pub(super) const BOXES: usize = 4096;
/// Words and bytes of a box.
const WORDS: usize = 28;
pub(super) const BOX: u64 = 4 * WORDS as u64;
/// Largest displacement of corners by a rasterizer, pixels: it rounds to a grid of 1/256 of a pixel or finer. Larger: boxes at a grazing
/// angle seem too near. Smaller: their depth is no longer conservative.
const GRID: f64 = 1.0 / 256.0;
/// Bytes of an answer.
const ANSWER: u64 = 8;

/// The batch whose answers arrived, or the error.
pub(super) type Arrival = (usize, Result<(), wgpu::BufferAsyncError>);

/// Recorded work before submission, in order.
#[derive(Default)]
pub(super) struct Recorded {
    steps: Vec<Step>,
    boxes: Vec<f32>,
    /// Recorded queries, in order.
    pub questions: Vec<u32>,
}

enum Step {
    /// Draws these triangles.
    Draw(Range<u32>),
    /// Queries these boxes.
    Ask(Range<u32>),
}

impl Recorded {
    pub fn clear(&mut self) {
        self.steps.clear();
        self.boxes.clear();
        self.questions.clear();
    }

    /// Whether there is room for one more query with this many boxes.
    pub fn has_room(&self, boxes: usize) -> bool {
        self.questions.len() < QUESTIONS && self.box_count() as usize + boxes <= BOXES
    }

    pub fn draw(&mut self, triangles: Range<u32>) {
        match self.steps.last_mut() {
            Some(Step::Draw(last)) if last.end == triangles.start => last.end = triangles.end,
            _ => self.steps.push(Step::Draw(triangles)),
        }
    }

    /// Records a query of all boxes from `first`.
    pub fn ask(&mut self, question: u32, first: u32) {
        self.steps.push(Step::Ask(first..self.box_count()));
        self.questions.push(question);
    }

    pub fn box_count(&self) -> u32 {
        (self.boxes.len() / WORDS) as u32
    }

    /// Removes boxes from `first`.
    pub fn truncate(&mut self, first: u32) {
        self.boxes.truncate(first as usize * WORDS);
    }

    /// Adds a box that may cover these pixels, first and last by axis, with 1/w at most `most`.
    pub fn add(&mut self, rays: &Rays, bounds: &Bounds, [columns, rows]: [[usize; 2]; 2], most: f64) {
        let slabs = Slabs::new(rays, bounds);
        // The device's value.
        let near = f64::from(rays.view.near as f32);
        self.boxes.extend([columns[0], rows[0], columns[1] + 1, rows[1] + 1].map(|p| p as f32));
        let most = near * most * (1.0 + FORM_ERROR);
        for i in 0..6 {
            let outwards = if i < slabs.nearer { 1.0 } else { -1.0 };
            let [at, x, y] = [slabs.at[i], slabs.x[i], slabs.y[i]].map(|v| v * near);
            let at = at + x * columns[0] as f64 + y * rows[0] as f64;
            // Rasterizers may compute depth from the picture's corner.
            let spread = x.abs() * rays.size[0] as f64 + y.abs() * rays.size[1] as f64;
            let error = FORM_ERROR * (at.abs() + spread) + GRID * (x.abs() + y.abs());
            let plane = if outwards > 0.0 && most + 2.0 * error > 1.0 {
                // Almost edge-on: it would extend in front of the near plane, and be clipped there.
                [most.min(1.0), 0.0, 0.0, outwards]
            } else {
                [at + outwards * error, x, y, outwards]
            };
            self.boxes.extend(plane.map(|v| v as f32));
        }
    }
}

/// Buffers of one batch for answers.
pub(super) struct Batch {
    answers: wgpu::QuerySet,
    there: wgpu::Buffer,
    here: wgpu::Buffer,
    questions: Vec<u32>,
    /// The frame of the batch.
    pub frame: u64,
}

impl Batch {
    pub fn new(gpu: &Gpu) -> Self {
        let (ty, count) = (wgpu::QueryType::Occlusion, QUESTIONS as u32);
        let bytes = ANSWER * u64::from(count);
        Self {
            answers: gpu.device.create_query_set(&wgpu::QuerySetDescriptor { label: None, ty, count }),
            there: gpu.buffer(bytes, BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            here: gpu.buffer(bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST),
            questions: Vec::with_capacity(QUESTIONS),
            frame: 0,
        }
    }

    /// Submits the recorded work; `told` receives `name` when the answers arrive. `is_first` starts a frame.
    pub fn submit(
        &mut self,
        scene: &GpuScene,
        recorded: &mut Recorded,
        is_first: bool,
        name: usize,
        told: Sender<Arrival>,
    ) -> wgpu::SubmissionIndex {
        let gpu = &scene.gpu;
        gpu.queue.write_buffer(&scene.boxes, 0, bytemuck::cast_slice(&recorded.boxes));
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        let load = if is_first { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &scene.depth,
                depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            occlusion_query_set: Some(&self.answers),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_bind_group(0, &scene.group, &[]);
        let (mut asks, mut question) = (None, 0);
        for step in &recorded.steps {
            let is_asked = matches!(step, Step::Ask(_));
            if asks != Some(is_asked) {
                pass.set_pipeline(if is_asked { &scene.asks } else { &scene.hides });
                asks = Some(is_asked);
            }
            match step {
                Step::Draw(triangles) => pass.draw(3 * triangles.start..3 * triangles.end, 0..1),
                Step::Ask(boxes) => {
                    pass.begin_occlusion_query(question);
                    pass.draw(18 * boxes.start..18 * boxes.end, 0..1);
                    pass.end_occlusion_query();
                    question += 1;
                }
            }
        }
        drop(pass);
        let bytes = ANSWER * u64::from(question);
        commands.resolve_query_set(&self.answers, 0..question, &self.there, 0);
        commands.copy_buffer_to_buffer(&self.there, 0, &self.here, 0, bytes);
        let index = gpu.queue.submit([commands.finish()]);
        self.here.map_async(wgpu::MapMode::Read, ..bytes, move |result| {
            // There is no receiver after a failure.
            drop(told.send((name, result)));
        });
        std::mem::swap(&mut self.questions, &mut recorded.questions);
        recorded.clear();
        index
    }

    /// Reads the arrived answers.
    pub fn read(&self, gpu: &Gpu, mut answer: impl FnMut(u32, bool)) -> Result<(), GpuError> {
        let bytes = ANSWER * self.questions.len() as u64;
        let view = self.here.get_mapped_range(..bytes).map_err(|error| gpu.fail(&error.to_string()))?;
        for (question, pixels) in self.questions.iter().zip(view.chunks_exact(ANSWER as usize)) {
            // WebGPU does not define nonzero values.
            answer(*question, pixels.iter().any(|byte| *byte != 0));
        }
        drop(view);
        self.here.unmap();
        Ok(())
    }
}
