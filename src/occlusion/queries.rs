//! Occlusion queries of a graphics processor, behind the cargo feature `gpu`.
//!
//! Based on: the `OcclusionQuery` of WebGPU, by wgpu, and Bittner, Wimmer, Piringer, Purgathofer, *Coherent hierarchical culling: hardware
//! occlusion queries made useful*, 2004, for how answers that come late are used. Deviations: what is drawn covers a pixel here only where
//! that is certain, and boxes cover every pixel where they may be seen; both are settled at each pixel, by planes through the eye, and the
//! rasteriser only says which pixels to look at.
//!
//! # What is hidden
//!
//! As in [`depth`](super::depth): a box is hidden where at the middle of every pixel that shows it, something drawn is nearer than the box
//! there. Other than there, something drawn may be taken for a little smaller and farther, so that rounding hides nothing:
//!
//! * **Triangles** are relative to the eye before they are rounded to `f32` ([`crate::gpu`]), and a pixel's middle is covered where it is
//!   inside of all three edges by more than `ROUNDING` (of `hide.wgsl`; 2^-19 of the lengths that are multiplied, some thousandths of a
//!   pixel), or beyond one edge, but inside of the triangle that goes on there. Depth is taken from the triangle's plane, not interpolated
//!   between corners, and as far off as it may be by rounding. So neither the rasteriser's grid of 1/256 of a pixel nor what it cuts
//!   off at the screen's sides matters: where it leaves out a pixel, less is hidden. A smaller `ROUNDING` would hide what shows. It
//!   leaves cracks of that width between objects that touch, since the triangle beyond is of the same object always, and pinholes where more
//!   than two triangles meet; a larger one, wider ones.
//! * **Boxes** are six functions of the picture, worked out in `f64` and rounded outwards, by what a device may be off and a corner moved by
//!   1/256 of a pixel; they are drawn as the rectangle of pixels that they are within, at the depth of each plane towards the eye.
//! * What reaches nearer than the near plane shows.
//!
//! # When answers come
//!
//! A pass can't read its own answers, so what is recorded is submitted together: by [`poll`](OcclusionOracle::poll), where the device has
//! nothing to do, so that batches grow with the time that it takes. While the caller goes on, `poll` doesn't wait. A caller that only
//! polls, for so many times in a row as `POLLS` says, has nothing else to do: then it waits.
//!
//! Frames allocate: wgpu does. After a failure (the device was lost, say), every answer is that it shows: see [`GpuQueries::failure`].

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

/// So many times in a row an answer isn't waited for, if nothing is drawn and asked in between. Fewer: a caller that has walked some nodes
/// without either is held up. More: one that has nothing to do asks in vain.
const POLLS: u32 = 16;
/// Of the farthest coordinate, the distance at which positions are off as much by having 48 bits as by being rounded to `f32` relative
/// to the eye: four times 2^-48, the position's, the eye's and those of their difference, over 2^-24. Larger: less hides in scenes far from
/// their origin. Smaller: not certain any more.
const GRAIN: f64 = 4.0 / (1u64 << 24) as f64;

/// The oracle on a graphics processor.
pub struct GpuQueries {
    scene: GpuScene,
    /// Triangles of each object that hides anything.
    objects: Vec<Option<Range<u32>>>,
    /// No position has a coordinate farther from 0, metres.
    farthest: f64,
    rays: Rays,
    /// Counts from 1.
    frame: u64,
    /// How many batches of this frame were submitted.
    batches: u64,
    /// By question of this frame.
    answers: Vec<Option<bool>>,
    recorded: Recorded,
    /// Places for answers, and those of them that are free.
    places: Vec<Batch>,
    free: Vec<usize>,
    /// Submitted and not read yet, the oldest first.
    flying: VecDeque<(usize, wgpu::SubmissionIndex)>,
    told: Sender<Arrival>,
    heard: Receiver<Arrival>,
    /// Times that somebody polled in vain since anything was drawn or asked.
    vain: u32,
    failure: Option<GpuError>,
}

impl GpuQueries {
    /// For pictures of `width` by `height` pixels, both above 0; opens the device that there is and puts the model there. Opaque objects
    /// hide what is behind them. An error where there is no adapter, or the model or the picture is too large for it.
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

    /// Starts a frame: nothing is drawn yet, and questions of the last one aren't answered any more.
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

    /// The adapter, its driver, and how it is spoken to.
    pub fn adapter(&self) -> &str {
        &self.scene.gpu.name
    }

    /// How many times the device was given work in this frame.
    pub fn batches(&self) -> u64 {
        self.batches
    }

    /// Why everything is said to show from some time on; `None` where nothing has failed.
    pub fn failure(&self) -> Option<&GpuError> {
        self.failure.as_ref()
    }

    /// Gives the device up: whatever is asked of it from now on shows.
    pub fn close(&self) {
        self.scene.gpu.close();
    }

    /// Records a question, or answers it.
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

    /// Hands in what is recorded.
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

    /// Goes on towards the answer to a question, and waits for it where the caller has nothing else to do.
    fn go_on(&mut self, question: u32) -> Result<(), GpuError> {
        self.vain += 1;
        let waits = self.vain > POLLS;
        let is_recorded = self.recorded.questions.first().is_some_and(|first| *first <= question);
        if is_recorded && (waits || self.flying.is_empty()) {
            self.submit();
        }
        // Questions of one frame are answered in the order in which they were recorded.
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

    /// Reads the answers that have come. Returns of how many batches.
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

/// What `hide.wgsl` knows of a camera.
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
        // The word that holds 0.
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
