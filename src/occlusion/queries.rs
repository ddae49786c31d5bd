//! Occlusion queries of a graphics processor, behind the cargo feature `gpu`.
//!
//! Based on: the `OcclusionQuery` of WebGPU, by wgpu, and Bittner, Wimmer, Piringer, Purgathofer, *Coherent hierarchical culling: hardware
//! occlusion queries made useful*, 2004, for the use of late answers. Deviations: a triangle covers a pixel only if that is certain, and a
//! box covers every pixel where it may be visible. Shaders decide both per pixel, by planes through the eye; the rasterizer only selects
//! candidate pixels.
//!
//! # What is hidden
//!
//! As in [`depth`](super::depth): a box is hidden if, at the centre of every pixel that it covers, a drawn surface is nearer than the box.
//! In contrast, drawn surfaces may count as slightly smaller and farther, so that rounding hides nothing:
//!
//! * **Triangles** are relative to the eye before they are rounded to `f32` ([`crate::gpu`]). A pixel's centre is covered if it is inside
//!   all three edges by more than `ROUNDING` (of `hide.wgsl`; 2^-19 of the multiplied lengths, some thousandths of a pixel), or beyond one
//!   edge but inside the adjacent triangle. Depth comes from the triangle's plane, without interpolation between corners, at the far end of
//!   its rounding error. So neither the rasterizer's grid of 1/256 of a pixel nor its clipping at the screen's sides matters: a missing
//!   pixel only hides less. A smaller `ROUNDING` would hide visible boxes. It leaves cracks of that width between objects that touch,
//!   because the adjacent triangle is always of the same object, and pinholes where more than two triangles meet; a larger value makes them
//!   wider.
//! * **Boxes** are six functions of the picture, computed in `f64` and rounded outwards, by the device's error and a corner moved by 1/256
//!   of a pixel. They are drawn as their rectangle of pixels, at the depth of each plane towards the eye.
//! * A box that extends in front of the near plane counts as visible.
//!
//! # When answers come
//!
//! A pass cannot read its own answers, so recorded work is submitted together: by [`poll`](OcclusionOracle::poll), when the device is idle,
//! so that batches grow with the device's time. `poll` does not wait while the caller has other work. A caller that polls `POLLS` times in
//! a row has none: then `poll` waits.
//!
//! Frames allocate, because wgpu does. After a failure (such as a lost device), every answer is *visible*: see [`GpuQueries::failure`].

mod batch;
mod partners;
mod scene;

use super::bounds::Bounds;
use super::geometry::Geometry;
use super::oracle::{OcclusionOracle, QueryId};
use super::pixels::Rays;
use super::slabs::Place;
use super::view::View;
use crate::ObjectId;
use crate::gpu::{GpuError, two};
use batch::{Arrival, BOX, BOXES, Batch, Recorded};
use glam::DVec3;
use scene::GpuScene;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::mpsc::{Receiver, Sender, channel};

/// Number of polls in a row without waiting, if nothing is drawn or queried in between. Fewer: a caller that has only walked nodes is
/// blocked. More: a caller without work polls uselessly.
const POLLS: u32 = 16;
/// Distance at which the error of 48-bit positions equals that of rounding to `f32` relative to the eye, relative to the farthest
/// coordinate: four times 2^-48 (position, eye, and their difference) over 2^-24. Larger: scenes far from their origin hide less. Smaller:
/// no longer conservative.
const GRAIN: f64 = 4.0 / (1u64 << 24) as f64;

/// The oracle on a graphics processor.
pub struct GpuQueries {
    scene: GpuScene,
    /// Triangles of each occluder.
    objects: Vec<Option<Range<u32>>>,
    /// Largest absolute coordinate, metres.
    farthest: f64,
    rays: Rays,
    /// Counts from 1.
    frame: u64,
    /// Batches submitted in this frame.
    batches: u64,
    /// Answers by query of this frame.
    answers: Vec<Option<bool>>,
    recorded: Recorded,
    /// Buffers for answers, and the free ones.
    places: Vec<Batch>,
    free: Vec<usize>,
    /// Submitted batches in flight, the oldest first.
    flying: VecDeque<(usize, wgpu::SubmissionIndex)>,
    told: Sender<Arrival>,
    heard: Receiver<Arrival>,
    /// Polls without an answer since the last draw or query.
    vain: u32,
    failure: Option<GpuError>,
}

impl GpuQueries {
    /// An oracle for pictures of `width` by `height` pixels, both above 0; opens the device and uploads the model. Opaque objects are
    /// occluders. Fails without an adapter, or if the scene or the picture is too large for it.
    pub fn new<'a>(model: impl Into<Geometry<'a>>, width: usize, height: usize) -> Result<Self, GpuError> {
        let model = model.into();
        let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, 1.0, 1.0, 0.1);
        let (told, heard) = channel();
        Ok(Self {
            scene: GpuScene::new(&model, [width, height], BOXES as u64 * BOX)?,
            objects: model.objects.iter().map(|o| o.opaque.then(|| o.triangles.clone())).collect(),
            farthest: model.positions.iter().fold(0.0, |most, p| p.abs().max_element().max(most)),
            rays: Rays::new(&view, [width, height]),
            frame: 0,
            batches: 0,
            answers: Vec::new(),
            recorded: Recorded::default(),
            places: Vec::new(),
            free: Vec::new(),
            flying: VecDeque::new(),
            told,
            heard,
            vain: 0,
            failure: None,
        })
    }

    /// Starts an empty frame; queries of the last frame are no longer answered.
    pub fn begin(&mut self, view: &View) {
        self.rays = Rays::new(view, self.rays.size);
        self.frame += 1;
        self.batches = 0;
        self.answers.clear();
        self.recorded.clear();
        self.vain = 0;
        let camera = camera(&self.rays, self.farthest);
        self.scene.gpu.queue.write_buffer(&self.scene.camera, 0, bytemuck::cast_slice(&camera));
    }

    /// The adapter, its driver, and the graphics API.
    pub fn adapter(&self) -> &str {
        &self.scene.gpu.name
    }

    /// Number of submissions in this frame.
    pub fn batches(&self) -> u64 {
        self.batches
    }

    /// The failure after which every answer is *visible*; `None` without a failure.
    pub fn failure(&self) -> Option<&GpuError> {
        self.failure.as_ref()
    }

    /// Closes the device: every later answer is *visible*.
    pub fn close(&self) {
        self.scene.gpu.close();
    }

    /// Records a query, or answers it directly.
    fn ask(&mut self, question: u32, boxes: &[Bounds]) -> Option<bool> {
        if boxes.len() > BOXES {
            return Some(true);
        }
        if !self.recorded.has_room(boxes.len()) {
            self.submit();
        }
        let first = self.recorded.box_count();
        for bounds in boxes {
            match Place::of(&self.rays, bounds) {
                Place::Near => {
                    self.recorded.truncate(first);
                    return Some(true);
                }
                Place::Beside => {}
                Place::Within { pixels, most } => self.recorded.add(&self.rays, bounds, pixels, most),
            }
        }
        if self.recorded.box_count() == first {
            return Some(false);
        }
        self.recorded.ask(question, first);
        None
    }

    /// Submits the recorded work.
    fn submit(&mut self) {
        let place = self.free.pop().unwrap_or_else(|| {
            self.places.push(Batch::new(&self.scene.gpu));
            self.places.len() - 1
        });
        let batch = &mut self.places[place];
        batch.frame = self.frame;
        let index = batch.submit(&self.scene, &mut self.recorded, self.batches == 0, place, self.told.clone());
        self.flying.push_back((place, index));
        self.batches += 1;
    }

    /// Makes progress towards the answer of a query, and waits for it if the caller has no other work.
    fn go_on(&mut self, question: u32) -> Result<(), GpuError> {
        self.vain += 1;
        let waits = self.vain > POLLS;
        let is_recorded = self.recorded.questions.first().is_some_and(|first| *first <= question);
        if is_recorded && (waits || self.flying.is_empty()) {
            self.submit();
        }
        // Queries of one frame are answered in order.
        while waits && self.answers[question as usize].is_none() {
            let Some((_, index)) = self.flying.front() else { break };
            self.scene.gpu.wait(index.clone())?;
            if self.hear()? == 0 {
                return Err(self.scene.gpu.fail("no answer"));
            }
        }
        if !waits {
            let polled = self.scene.gpu.device.poll(wgpu::PollType::Poll);
            polled.map_err(|error| self.scene.gpu.fail(&error.to_string()))?;
            self.hear()?;
        }
        Ok(())
    }

    /// Reads the arrived answers. Returns the number of batches.
    fn hear(&mut self) -> Result<usize, GpuError> {
        self.scene.gpu.check()?;
        let before = self.flying.len();
        while let Ok((place, result)) = self.heard.try_recv() {
            result.map_err(|error| self.scene.gpu.fail(&error.to_string()))?;
            let batch = &self.places[place];
            let (answers, is_of_now) = (&mut self.answers, batch.frame == self.frame);
            batch.read(&self.scene.gpu, |question, shows| {
                if is_of_now {
                    answers[question as usize] = Some(shows);
                }
            })?;
            self.flying.retain(|(flying, _)| *flying != place);
            self.free.push(place);
        }
        Ok(before - self.flying.len())
    }
}

impl OcclusionOracle for GpuQueries {
    fn begin(&mut self, view: &View) {
        Self::begin(self, view);
    }

    fn issue(&mut self, boxes: &[Bounds]) -> QueryId {
        self.vain = 0;
        let question = self.answers.len() as u32;
        let answer = if self.failure.is_some() { Some(true) } else { self.ask(question, boxes) };
        self.answers.push(answer);
        QueryId(question)
    }

    fn poll(&mut self, query: QueryId) -> Option<bool> {
        let answered = |queries: &Self| queries.answers[query.0 as usize].or(queries.failure.is_some().then_some(true));
        if answered(self).is_none() {
            self.failure = self.go_on(query.0).err();
        }
        answered(self)
    }

    fn draw(&mut self, object: ObjectId) {
        self.vain = 0;
        if let Some(triangles) = self.objects[object.index()].clone() {
            self.recorded.draw(triangles);
        }
    }
}

/// The camera data of `hide.wgsl`.
fn camera(rays: &Rays, farthest: f64) -> [u32; 32] {
    let View { eye, x, y, w, near, .. } = rays.view;
    let [width, height] = rays.size.map(|s| s as f64);
    let [middle, right, up] = rays.frame();
    let reach = middle.length() + right.length() + up.length();
    let grain = GRAIN * farthest.max(eye.abs().max_element());
    let parts = eye.to_array().map(two);
    let f32s = |v: DVec3| v.to_array().map(|v| v as f32);
    let rows = [
        (parts.map(|p| p[0]), near as f32),
        // An unused word.
        (parts.map(|p| p[1]), 0.0),
        (f32s(x), grain as f32),
        (f32s(y), reach as f32),
        (f32s(w), width as f32),
        (f32s(middle), height as f32),
        (f32s(right / width), 0.0),
        (f32s(up / height), 0.0),
    ];
    let mut words = [0; 32];
    for (words, (row, fourth)) in words.chunks_exact_mut(4).zip(rows) {
        words.copy_from_slice(&[row[0], row[1], row[2], fourth].map(f32::to_bits));
    }
    words
}
