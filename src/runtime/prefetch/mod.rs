//! Prefetching: what a client should load before it becomes visible, and what it may evict, within a memory budget. What is loaded and evicted
//! at once is a chunk: one object, or several ([`Chunks`]).
//!
//! Based on: T. Funkhouser, C. Séquin and S. Teller, *Management of large amounts of data in interactive building walkthroughs*, 1992:
//! objects visible from the cells that the eye may reach, nearest in time first, by shortest paths through portals. The order by these
//! times minimizes the maximum lateness of loads (J. R. Jackson, *Scheduling a production line to minimize maximum tardiness*, 1955).
//!
//! Deviations: the horizon is the memory budget and not a time. So there is nothing to tune, and all unplanned objects are farther off than
//! planned ones. If the rows of the eye's own cells exceed the budget, as outside a building with windows, the plan begins with the objects
//! that the eye sees now and within two seconds (`sight`).
//!
//! ```no_run
//! use enfilade::file::PvsFile;
//! use enfilade::runtime::prefetch::{ChunkId, Chunks, Prefetcher, Step};
//! use enfilade::runtime::{Camera, Culler, Mode, Motion, View};
//!
//! # struct Loader;
//! # impl Loader {
//! #     fn is_idle(&self) -> bool { true }
//! #     fn ask(&mut self, _: ChunkId) {}
//! #     fn forget(&mut self, _: ChunkId) {}
//! #     fn next_that_came(&mut self) -> Option<ChunkId> { None }
//! # }
//! # fn demo(file: &PvsFile, camera: Camera, seconds: f64, bytes: Vec<u64>, loader: &mut Loader) {
//! let culler = Culler::new(file);
//! let mut view = View::new(&culler);
//! let mut motion = Motion::default();
//! let mut prefetcher = Prefetcher::new(file, &culler, Chunks::of_one(bytes), 64 << 20);
//! // Each frame:
//! while let Some(chunk) = loader.next_that_came() {
//!     prefetcher.loaded(chunk);
//! }
//! motion.see(&camera, seconds);
//! let visible = view.cull(&camera, Mode::PortalsAndPvs);
//! let missing = prefetcher.frame(camera.eye, &motion, visible.objects);
//! println!("{} objects are drawn, {missing} are late", visible.objects.len());
//! while loader.is_idle() {
//!     match prefetcher.next_step() {
//!         Some(Step::Evict(chunk)) => loader.forget(chunk),
//!         Some(Step::Load { chunk, .. }) => loader.ask(chunk),
//!         None => break,
//!     }
//! }
//! # }
//! ```
//!
//! # Guarantees
//!
//! * The bytes of loaded and pending chunks never exceed the budget.
//! * Chunks with objects visible in a frame are not evicted before the next frame. The core of the plan, its first three quarters (starting with the
//!   rows of the eye's cells), is evicted only for what is visible and missing. The rest of the plan uses free memory only, so that distant
//!   chunks are not loaded and evicted with every step.
//! * No object is missing in a frame under three conditions. The rows are sound, and the eye passes only portals that are not barred. The
//!   chunks before it in the plan fit into three quarters of the budget. And it is loaded before the eye has moved by
//!   [`Step::Load::metres`], a lower bound of the distance.
//! * Steps depend only on previous calls. After [`Prefetcher::new`], no call allocates.
//!
//! # Limits
//!
//! * The first frame, and the one after a jump, are not planned: its visible objects are loaded first, the rest of its rows after that.
//! * If the rows of the eye's cells exceed the budget, objects may be missing after a fast turn. If the frame itself exceeds it, some
//!   always are. A chunk larger than the budget is never loaded.
//! * Pending loads are not cancelled, even if the eye has turned away.
//!
//! # Special cases
//!
//! * A shut door may open, so the plan goes through it; [`Prefetcher::bar`] excludes it. Windows are barred from the start. Rows take every
//!   door as open, and so does a plan.
//! * An eye in no cell keeps the last plan while it is near that plan's place. Elsewhere, and at the start, the distance to each portal is
//!   straight. A non-finite eye keeps the last plan, too.
//! * Without rows in the file, a plan has the objects of each cell. An object in no row (and in no cell) is loaded when a frame sees it.

mod chunks;
mod order;
mod reach;
mod sight;

use super::culler::Culler;
use super::doors::Doors;
use super::motion::Motion;
use crate::file::PvsFile;
use crate::math::sorting;
use crate::types::portal::PortalKind;
use crate::{CellId, ObjectId, PortalId};
pub use chunks::{ChunkId, Chunks};
use glam::Vec3;
use order::{Plan, Planned};
use reach::{Reach, Walker};
use sight::Sight;
use std::sync::Arc;

/// Movement of the eye that triggers a new plan, metres. Larger: older orders. Smaller: more work.
const MOVED: f32 = 0.25;
/// Distance over which an eye in no cell keeps its plan, metres: most likely it is in a wall or a door leaf.
const ASTRAY: f32 = 2.0;
/// Extrapolation of the eye's motion, seconds.
const AHEAD: f64 = 1.0;
/// Cosine of the turn that triggers a new plan by sight, some 15 degrees. Smaller: older orders. Larger: more work.
const TURNED: f32 = 0.966;
/// An extrapolated movement beyond this is a jump, metres, and is ignored.
const JUMP: f32 = 50.0;

/// An action for the client.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Step {
    /// Evict a chunk now: its bytes count as free from here on.
    Evict(ChunkId),
    /// Load a chunk, and call [`Prefetcher::loaded`] or [`Prefetcher::failed`] afterwards.
    Load {
        /// The chunk.
        chunk: ChunkId,
        /// Lower bound of the eye's distance until the chunk may be visible, metres: 0 if it may be visible from the eye's cell. Divided
        /// by the speed, it is the remaining time in seconds.
        metres: f32,
    },
}

/// The state of a chunk.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    Absent,
    UnderWay,
    Loaded,
    /// Loading failed.
    Failed,
}

/// Prefetches for one eye; see the [module](self).
#[derive(Clone, Debug)]
pub struct Prefetcher {
    culler: Arc<Culler>,
    budget: u64,
    chunks: Chunks,
    /// By chunk.
    states: Vec<State>,
    /// By chunk: the last frame that saw it, and the frame of the last plan with it.
    shown: Vec<u64>,
    planned: Vec<u64>,
    /// Bytes loaded and pending.
    used: u64,
    /// Bytes loaded, and those of them visible in the frame.
    loaded: u64,
    loaded_and_shown: u64,
    frame: u64,
    /// Chunks with visible objects that are not loaded.
    missing: Vec<ChunkId>,
    plan: Plan,
    sight: Sight,
    /// Frame, eye and view direction of the plan; `None` before the first, and if a new one is necessary.
    made: Option<(u64, [Vec3; 2])>,
    homes: Vec<CellId>,
    last_piece: u32,
    /// Loaded chunks that are not planned, the oldest first; valid if `is_listed`.
    spare: Vec<u32>,
    /// Room for its sort.
    sorted: Vec<u32>,
    is_listed: bool,
    /// Positions of this frame in `missing`, the plan, `spare`, and the plan from its end.
    at: Places,
}

#[derive(Clone, Copy, Debug, Default)]
struct Places {
    missing: usize,
    plan: usize,
    spare: usize,
    tail: usize,
}

impl Prefetcher {
    /// A prefetcher for a file and its culler, with what is loaded at once, and the memory budget, bytes. Nothing is loaded.
    ///
    /// # Panics
    ///
    /// If `culler` is of another file, or `chunks` are of another number of objects.
    pub fn new(file: &PvsFile, culler: &Arc<Culler>, chunks: Chunks, budget: u64) -> Self {
        let (objects, count) = (culler.object_count(), chunks.bytes.len());
        assert_eq!((file.objects.len(), chunks.of.len()), (objects, objects), "objects of the file, and in chunks");
        assert_eq!(file.portals.len(), culler.portal_count(), "portals of the file");
        let windows = file.portals.iter().map(|portal| portal.kind == PortalKind::Window).collect();
        Self {
            culler: culler.clone(),
            budget,
            states: vec![State::Absent; count],
            shown: vec![0; count],
            planned: vec![0; count],
            used: 0,
            loaded: 0,
            loaded_and_shown: 0,
            frame: 0,
            missing: Vec::with_capacity(count),
            plan: Plan::new(&chunks, Reach::new(culler, windows), budget),
            chunks,
            sight: Sight::new(culler),
            made: None,
            homes: Vec::with_capacity(super::locate::MOST_HOMES),
            last_piece: 0,
            spare: Vec::with_capacity(count),
            sorted: Vec::with_capacity(count),
            is_listed: false,
            at: Places::default(),
        }
    }

    /// Takes the states of the doors: what the eye sees now and soon goes by them. At the start, all are open.
    ///
    /// # Panics
    ///
    /// If they are of a culler with another number of portals.
    pub fn set_doors(&mut self, doors: &Doors) {
        self.sight.set_doors(doors);
    }

    /// Begins a frame: the eye (metres, relative to the file's origin), its motion, and its visible objects
    /// ([`super::VisibleSet::objects`]). Returns the number of these that are not loaded; see [`Self::is_loaded`].
    pub fn frame(&mut self, eye: Vec3, motion: &Motion, visible: &[ObjectId]) -> usize {
        self.frame += 1;
        self.loaded_and_shown = 0;
        self.missing.clear();
        let mut missing = 0;
        for &object in visible {
            let chunk = self.chunks.of(object);
            let (at, is_loaded) = (chunk.index(), self.states[chunk.index()] == State::Loaded);
            missing += usize::from(!is_loaded);
            if std::mem::replace(&mut self.shown[at], self.frame) == self.frame {
                continue;
            }
            if is_loaded {
                self.loaded_and_shown += self.chunks.bytes[at];
            } else {
                self.missing.push(chunk);
            }
        }
        if eye.is_finite() {
            self.look_ahead(eye, motion);
        }
        self.at = Places { tail: self.plan.order().len(), ..Places::default() };
        missing
    }

    /// Makes a new plan if necessary.
    fn look_ahead(&mut self, eye: Vec3, motion: &Motion) {
        let homes = self.culler.locate(eye, &mut self.last_piece);
        let homes = if homes.overflow { &[] } else { homes.as_slice() };
        let looks = motion.ahead(0.0).map_or(Vec3::ZERO, |camera| camera.w.normalize_or_zero());
        let moved = self.made.map_or(f32::INFINITY, |(_, [from, _])| from.distance(eye));
        let has_turned = self.plan.is_by_sight() && self.made.is_some_and(|(_, [_, looked])| looked.dot(looks) < TURNED);
        let is_new = if homes.is_empty() { moved >= ASTRAY } else { moved >= MOVED || has_turned || homes != self.homes };
        if !is_new {
            return;
        }
        self.homes.clear();
        self.homes.extend_from_slice(homes);
        let ahead = motion.ahead(AHEAD).map_or(eye, |camera| camera.eye);
        let ahead = if ahead.distance(eye) < JUMP { ahead } else { eye };
        self.plan.make(&self.culler, &self.chunks, Walker { eye, ahead }, &self.homes, &mut self.sight, motion);
        for planned in self.plan.order() {
            self.planned[planned.chunk.index()] = self.frame;
        }
        self.made = Some((self.frame, [eye, looks]));
        self.is_listed = false;
    }

    /// The next action; `None`: nothing in this frame. A returned step counts as taken.
    pub fn next_step(&mut self) -> Option<Step> {
        while let Some((Planned { chunk, metres }, is_shown)) = self.wanted() {
            let bytes = self.chunks.bytes[chunk.index()];
            if bytes <= self.budget && self.used <= self.budget - bytes {
                self.states[chunk.index()] = State::UnderWay;
                self.used += bytes;
                return Some(Step::Load { chunk, metres });
            }
            // Planned chunks fit, unless unplanned ones are pending. Visible ones may not fit.
            let stays = self.used - self.loaded + self.loaded_and_shown;
            let fits = bytes <= self.budget && stays <= self.budget - bytes;
            let core = self.plan.core();
            let leaver = match is_shown {
                true if fits => self.leaver(0),
                false if self.at.plan < core => self.leaver(core),
                _ => None,
            };
            match leaver {
                Some(leaver) => {
                    let bytes = self.chunks.bytes[leaver.index()];
                    self.states[leaver.index()] = State::Absent;
                    self.used -= bytes;
                    self.loaded -= bytes;
                    return Some(Step::Evict(leaver));
                }
                // A smaller one may fit.
                None if is_shown => self.at.missing += 1,
                None => return None,
            }
        }
        None
    }

    /// The most urgent chunk that is neither loaded nor pending, and whether the frame sees it.
    fn wanted(&mut self) -> Option<(Planned, bool)> {
        let is_absent = |chunk: ChunkId| self.states[chunk.index()] == State::Absent;
        while let Some(&chunk) = self.missing.get(self.at.missing) {
            if is_absent(chunk) {
                return Some((Planned { chunk, metres: 0.0 }, true));
            }
            self.at.missing += 1;
        }
        while let Some(&planned) = self.plan.order().get(self.at.plan) {
            if is_absent(planned.chunk) {
                return Some((planned, false));
            }
            self.at.plan += 1;
        }
        None
    }

    /// The next chunk to evict: first unplanned ones, the oldest first; then planned ones, the farthest first, except the first `kept`.
    fn leaver(&mut self, kept: usize) -> Option<ChunkId> {
        if !self.is_listed {
            self.list_spare();
        }
        let may_leave =
            |chunk: ChunkId| self.states[chunk.index()] == State::Loaded && self.shown[chunk.index()] != self.frame;
        while let Some(chunk) = self.spare.get(self.at.spare).map(|&chunk| ChunkId(chunk)) {
            self.at.spare += 1;
            if may_leave(chunk) {
                return Some(chunk);
            }
        }
        while self.at.tail > kept {
            self.at.tail -= 1;
            let chunk = self.plan.order()[self.at.tail].chunk;
            if may_leave(chunk) {
                return Some(chunk);
            }
        }
        None
    }

    fn list_spare(&mut self) {
        let now = self.made.map_or(0, |(frame, _)| frame);
        let (states, planned, shown) = (&self.states, &self.planned, &self.shown);
        let is_spare = |i: &usize| states[*i] == State::Loaded && (planned[*i] != now || now == 0);
        self.spare.clear();
        self.spare.extend((0..states.len()).filter(is_spare).map(|i| i as u32));
        let last = |chunk: u32| planned[chunk as usize].max(shown[chunk as usize]);
        sorting::sort(&mut self.spare, &mut self.sorted, &|a, b| last(a) < last(b));
        self.is_listed = true;
        self.at.spare = 0;
    }

    /// Reports that a requested chunk is loaded. Others are ignored.
    pub fn loaded(&mut self, chunk: ChunkId) {
        let at = chunk.index();
        if self.states.get(at) == Some(&State::UnderWay) {
            self.states[at] = State::Loaded;
            self.loaded += self.chunks.bytes[at];
            if self.shown[at] == self.frame {
                self.loaded_and_shown += self.chunks.bytes[at];
            }
            // If it is no longer planned, it must be listed.
            self.is_listed &= self.made.is_some_and(|(frame, _)| self.planned[at] == frame);
        }
    }

    /// Reports that a requested chunk cannot be loaded. It is not requested again.
    pub fn failed(&mut self, chunk: ChunkId) {
        if self.states.get(chunk.index()) == Some(&State::UnderWay) {
            self.states[chunk.index()] = State::Failed;
            self.used -= self.chunks.bytes[chunk.index()];
        }
    }

    /// Sets whether a portal is barred for the eye: at the start, only windows are barred.
    ///
    /// # Panics
    ///
    /// If there is no such portal.
    pub fn bar(&mut self, portal: PortalId, barred: bool) {
        self.plan.reach_mut().bar(portal, barred);
        self.made = None;
    }

    /// Whether an object's chunk is reported as loaded.
    pub fn is_loaded(&self, object: ObjectId) -> bool {
        self.chunks.of.get(object.index()).is_some_and(|chunk| self.states[chunk.index()] == State::Loaded)
    }

    /// Bytes of loaded and pending chunks.
    pub fn used(&self) -> u64 {
        self.used
    }
}
