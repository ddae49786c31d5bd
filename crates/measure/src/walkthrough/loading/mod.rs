//! Walks through a building that does not fit into memory: the objects that each frame lacks, by loading method.

mod loader;
mod on_demand;

use super::stroll::Stroll;
use enfilade::ObjectId;
use enfilade::file::PvsFile;
use enfilade::runtime::prefetch::{ChunkId, Chunks, Prefetcher, Step};
use enfilade::runtime::{Camera, Culler, Doors, Mode, Motion, View};
use loader::Loader;
use on_demand::OnDemand;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

/// Walking speed, metres a second.
pub const WALK: f64 = 1.4;
/// Frames a second.
pub const RATE: f64 = 60.0;
/// Bytes of a triangle in memory: three corners, each with a position, a normal and texture coordinates of four bytes a number.
pub const TRIANGLE_BYTES: u64 = 96;

/// How objects are loaded.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Method {
    /// By [`enfilade::runtime::prefetch`].
    Rows,
    /// When a frame sees them; the least recently seen object is evicted.
    OnDemand,
}

impl Method {
    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rows => "rows",
            Self::OnDemand => "on-demand",
        }
    }
}

/// Memory, bandwidth and latency.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LoadingOptions {
    /// Maximum bytes in memory and under way.
    pub budget: u64,
    /// Bytes a second, above 0; infinite: loads take no time.
    pub bandwidth: f64,
    /// Seconds from the last sent byte until the object can be drawn, 0 or more.
    pub latency: f64,
    /// Width of the picture over its height.
    pub aspect: f64,
}

/// Results of a walk with one method.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct LoadingSummary {
    /// The method's name.
    pub method: &'static str,
    /// Counted frames: all but those of `after_jumps`.
    pub frames: u64,
    /// Counted frames with missing objects.
    pub frames_missing: u64,
    /// Missing objects, summed over these frames.
    pub objects_missing: u64,
    /// Frames after a jump (or the start) until the first complete frame.
    pub after_jumps: u64,
    /// Jumps.
    pub jumps: u64,
    /// Frames, of all, whose objects exceed the budget.
    pub frames_over_budget: u64,
    /// Bytes loaded.
    pub bytes_loaded: u64,
    /// Peak bytes in memory and under way.
    pub bytes_most: u64,
    /// Microseconds of the method per frame: median, 99th percentile, maximum.
    pub us: [f64; 3],
}

/// A frame as drawn.
pub struct LoadingFrame<'f> {
    /// The culler's set.
    pub visible: &'f [ObjectId],
    /// By object: whether it is in memory.
    pub in_memory: &'f [bool],
    /// How many of `visible` are missing.
    pub missing: u64,
    /// Whether the frame counts: after a jump, counting starts with the first complete frame.
    pub counts: bool,
    /// The camera.
    pub camera: Camera,
}

/// Bytes of each object in memory, [`TRIANGLE_BYTES`] a triangle.
pub fn object_bytes(file: &PvsFile) -> Vec<u64> {
    file.objects.iter().map(|object| u64::from(object.triangles) * TRIANGLE_BYTES).collect()
}

/// Walks at [`RATE`]. `on_frame` receives each frame as drawn, with the objects loaded by then.
pub fn walk_loading(
    file: &PvsFile,
    (culler, doors): (&Arc<Culler>, &Doors),
    bytes: &[u64],
    stroll: &Stroll,
    (method, options): (Method, &LoadingOptions),
    on_frame: &mut dyn FnMut(&LoadingFrame<'_>),
) -> LoadingSummary {
    let mut client = Client::new(method, file, (culler, doors), bytes, options);
    let mut view = View::new(culler);
    view.set_doors(doors);
    let mut times = Vec::with_capacity(stroll.frames());
    let mut frame = 0u64;
    for leg in &stroll.legs {
        let mut motion = Motion::default();
        let mut is_settled = false;
        client.summary.jumps += 1;
        for place in leg {
            let now = frame as f64 / RATE;
            let camera = stroll.camera(place, file.origin, options.aspect);
            motion.see(&camera, now);
            let visible = view.cull(&camera, Mode::PortalsAndPvs).objects;
            times.push(client.load(&camera, &motion, visible, now));
            let missing = visible.iter().filter(|object| !client.in_memory[object.index()]).count() as u64;
            is_settled |= missing == 0;
            client.count(visible, missing, is_settled);
            on_frame(&LoadingFrame { visible, in_memory: &client.in_memory, missing, counts: is_settled, camera });
            frame += 1;
        }
    }
    times.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| times.get(((times.len().max(1) - 1) as f64 * share) as usize).copied().unwrap_or(0.0);
    LoadingSummary { us: [at(0.5), at(0.99), at(1.0)], ..client.summary }
}

/// The loading method in use.
enum Policy<'b> {
    Rows(Box<Prefetcher>),
    OnDemand(Box<OnDemand<'b>>),
}

/// A client with a memory and a loader of its own.
struct Client<'b> {
    policy: Policy<'b>,
    loader: Loader,
    bytes: &'b [u64],
    budget: u64,
    in_memory: Vec<bool>,
    /// Bytes in memory and under way.
    used: u64,
    summary: LoadingSummary,
}

impl<'b> Client<'b> {
    fn new(
        method: Method,
        file: &PvsFile,
        (culler, doors): (&Arc<Culler>, &Doors),
        bytes: &'b [u64],
        options: &LoadingOptions,
    ) -> Self {
        let budget = options.budget;
        let policy = match method {
            Method::Rows => {
                let mut prefetcher = Prefetcher::new(file, culler, Chunks::of_one(bytes.to_vec()), budget);
                prefetcher.set_doors(doors);
                Policy::Rows(Box::new(prefetcher))
            }
            Method::OnDemand => Policy::OnDemand(Box::new(OnDemand::new(bytes, budget))),
        };
        let summary = LoadingSummary {
            method: method.name(),
            frames: 0,
            frames_missing: 0,
            objects_missing: 0,
            after_jumps: 0,
            jumps: 0,
            frames_over_budget: 0,
            bytes_loaded: 0,
            bytes_most: 0,
            us: [0.0; 3],
        };
        let loader = Loader::new(options.bandwidth, options.latency);
        Self { policy, loader, bytes, budget, in_memory: vec![false; bytes.len()], used: 0, summary }
    }

    /// Loads for a frame; returns the microseconds of deciding.
    fn load(&mut self, camera: &Camera, motion: &Motion, visible: &[ObjectId], now: f64) -> f64 {
        self.take_in(now);
        let mut us = self.timed(|policy| match policy {
            Policy::Rows(rows) => drop(rows.frame(camera.eye, motion, visible)),
            Policy::OnDemand(plain) => plain.frame(visible),
        });
        // Requests enough to keep the loader busy until the next frame.
        while self.loader.is_idle_before(now + 1.0 / RATE) {
            let mut step = None;
            us += self.timed(|policy| {
                step = match policy {
                    Policy::Rows(rows) => rows.next_step(),
                    Policy::OnDemand(plain) => plain.next_step(),
                }
            });
            match step {
                None => break,
                // A chunk is an object.
                Some(Step::Evict(chunk)) => {
                    self.in_memory[chunk.index()] = false;
                    self.used -= self.bytes[chunk.index()];
                }
                Some(Step::Load { chunk, .. }) => {
                    self.used += self.bytes[chunk.index()];
                    self.summary.bytes_most = self.summary.bytes_most.max(self.used);
                    self.loader.ask(now, ObjectId(chunk.0), self.bytes[chunk.index()]);
                }
            }
        }
        // Objects without delay are drawn in this frame.
        self.take_in(now);
        us
    }

    fn timed(&mut self, work: impl FnOnce(&mut Policy<'_>)) -> f64 {
        let start = Instant::now();
        work(&mut self.policy);
        start.elapsed().as_secs_f64() * 1e6
    }

    fn take_in(&mut self, now: f64) {
        while let Some(object) = self.loader.take(now) {
            self.in_memory[object.index()] = true;
            self.summary.bytes_loaded += self.bytes[object.index()];
            match &mut self.policy {
                Policy::Rows(rows) => rows.loaded(ChunkId(object.0)),
                Policy::OnDemand(plain) => plain.loaded(object),
            }
        }
    }

    fn count(&mut self, visible: &[ObjectId], missing: u64, is_settled: bool) {
        let summary = &mut self.summary;
        if is_settled {
            summary.frames += 1;
            summary.frames_missing += u64::from(missing > 0);
            summary.objects_missing += missing;
        } else {
            summary.after_jumps += 1;
        }
        let seen: u64 = visible.iter().map(|object| self.bytes[object.index()]).sum();
        summary.frames_over_budget += u64::from(seen > self.budget);
    }
}
