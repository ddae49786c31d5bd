//! Which objects a client should load before an eye sees them, and which it may forget, within so many bytes.
//!
//! Based on: T. Funkhouser, C. Séquin and S. Teller, *Management of large amounts of data in interactive building walkthroughs*, 1992: what is
//! seen from the cells that the eye may come to, the nearest in time first, by the shortest ways through portals. Loads in the order of these
//! times are late by as little as any order allows (J. R. Jackson, *Scheduling a production line to minimize maximum tardiness*, 1955).
//!
//! Where it deviates: no length of time is looked ahead, but as much as memory holds. So nothing has to be tuned, and whatever is not planned is
//! farther off than all that is. And where the rows of the eye's own cells are more than the budget, as outside of a building with windows, the
//! plan begins with what the eye sees now and will see within two seconds (`sight`).
//!
//! ```no_run
//! # use enfilade::ObjectId;
//! use enfilade::file::PvsFile;
//! use enfilade::runtime::prefetch::{Prefetcher, Step};
//! use enfilade::runtime::{Camera, Culler, Mode, Motion, Scratch};
//!
//! # struct Loader;
//! # impl Loader {
//! #     fn is_idle(&self) -> bool { true }
//! #     fn ask(&mut self, _: ObjectId) {}
//! #     fn forget(&mut self, _: ObjectId) {}
//! #     fn next_that_came(&mut self) -> Option<ObjectId> { None }
//! # }
//! # fn demo(file: &PvsFile, camera: Camera, seconds: f64, bytes: &[u64], loader: &mut Loader) {
//! let culler = Culler::new(file);
//! let mut scratch = Scratch::for_culler(&culler);
//! let mut motion = Motion::default();
//! let mut prefetcher = Prefetcher::new(file, &culler, bytes, 64 << 20);
//! // Each frame:
//! while let Some(object) = loader.next_that_came() {
//!     prefetcher.loaded(object);
//! }
//! motion.see(&camera, seconds);
//! let visible = culler.cull(&camera, Mode::PortalsAndPvs, &mut scratch);
//! let missing = prefetcher.frame(&culler, camera.eye, &motion, visible.objects);
//! println!("{} objects are drawn, {missing} are late", visible.objects.len());
//! while loader.is_idle() {
//!     match prefetcher.next_step() {
//!         Some(Step::Evict(object)) => loader.forget(object),
//!         Some(Step::Load { object, .. }) => loader.ask(object),
//!         None => break,
//!     }
//! }
//! # }
//! ```
//!
//! # What holds
//!
//! * The bytes of what is in memory and of what is under way are never more than the budget.
//! * What a frame sees is not evicted before the next frame. The core of the plan, its first three quarters (the rows of the eye's cells before
//!   all), is evicted for nothing but an object that the frame sees and that is not there. The rest of it takes what is free: so objects far off
//!   don't come and go with every step.
//! * Nothing is missing in a frame if three things hold. The rows are sound, and the eye goes through portals that are not barred. What the
//!   plan has before an object fits into three quarters of the budget. And the object comes within the time in which the eye goes as far as
//!   [`Step::Load::metres`] says, which is never farther than it has to go.
//! * Steps depend on the calls before them, and on nothing else. After [`Prefetcher::new`], no call allocates.
//!
//! # What does not
//!
//! * Nothing is known of the first frame, or of the one after a jump: what it sees is asked for first, the rest of its rows after that.
//! * Where the rows of the eye's cells are more than the budget, what the eye turns to at once may be missing. Where the frame itself is more,
//!   something always is. An object that is larger than the budget is never asked for.
//! * What is under way is waited for, also where the eye has turned away from it.
//!
//! # Special cases
//!
//! * A door that is shut may be opened, so the eye goes through it in the plan; [`Prefetcher::bar`] says that it does not. Windows are barred
//!   from the start. Rows take every door as open, and so does a plan.
//! * An eye in no cell keeps the last plan while it is near to where that was made. Elsewhere, and from the start, the way to each portal is
//!   straight. An eye that is not finite keeps the last plan, too.
//! * Without rows in the file, a plan has what is in each cell. An object that is in no row (and in no cell) is loaded when a frame sees it.

mod plan;
mod reach;
mod sight;

use super::culler::Culler;
use super::motion::Motion;
use crate::file::PvsFile;
use crate::types::portal::PortalKind;
use crate::{CellId, ObjectId, PortalId};
use glam::Vec3;
use plan::{Plan, Planned};
use reach::{Reach, Walker};
use sight::Sight;

/// An eye that has moved by so much, metres, since its plan was made gets a new one. More: the order is older. Less: more work.
const MOVED: f32 = 0.25;
/// An eye in no cell keeps its plan so far, metres: it stands in a wall or in a leaf, most likely.
const ASTRAY: f32 = 2.0;
/// How far the eye is followed in the direction in which it goes, seconds.
const AHEAD: f64 = 1.0;
/// A plan by what the eye sees is made anew once it has turned by an angle whose cosine is less, some 15 degrees. Less: the order is older. More:
/// more work.
const TURNED: f32 = 0.966;
/// What would lead an eye farther than this in that time, metres, is a jump. It tells nothing of where the eye goes.
const JUMP: f32 = 50.0;

/// What a client is to do.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Step {
    /// To forget an object, now: its bytes are counted as free from here on.
    Evict(ObjectId),
    /// To load an object, and to tell [`Prefetcher::loaded`] or [`Prefetcher::failed`] when that is done.
    Load {
        /// Which.
        object: ObjectId,
        /// How far the eye has to go before it may see it, metres: 0 for what it may see from its own cell. Over its speed, the time that is
        /// left, in seconds.
        metres: f32,
    },
}

/// Where an object is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    Absent,
    UnderWay,
    Loaded,
    /// It can't be loaded.
    Failed,
}

/// Looks ahead for one eye; see the [module](self).
#[derive(Clone, Debug)]
pub struct Prefetcher {
    budget: u64,
    /// By object.
    bytes: Vec<u64>,
    states: Vec<State>,
    /// By object: the last frame that saw it, and the last frame in whose plan it was.
    shown: Vec<u64>,
    planned: Vec<u64>,
    /// Loaded and under way.
    used: u64,
    /// Loaded, and those of them that the frame sees.
    loaded: u64,
    loaded_and_shown: u64,
    frame: u64,
    /// What the frame sees and has not.
    missing: Vec<ObjectId>,
    plan: Plan,
    sight: Sight,
    /// The frame, the eye and where it looked when the plan was made; `None` before the first, and where it must be made anew.
    made: Option<(u64, [Vec3; 2])>,
    homes: Vec<CellId>,
    last_piece: u32,
    /// Loaded objects that are not planned, the oldest first; `false`: to be listed again.
    spare: Vec<ObjectId>,
    is_listed: bool,
    /// Where this frame is in `missing`, the plan, `spare`, and the plan from its end.
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
    /// For a file, the culler of it, the size of each object in memory, bytes, and the most bytes that they may have together. Nothing is
    /// loaded.
    ///
    /// # Panics
    ///
    /// Where `culler` is of another file, or `bytes` has not one size an object.
    pub fn new(file: &PvsFile, culler: &Culler, bytes: &[u64], budget: u64) -> Self {
        let objects = culler.object_count();
        assert_eq!((file.objects.len(), bytes.len()), (objects, objects), "objects of the file, and sizes");
        assert_eq!(file.portals.len(), culler.portal_count(), "portals of the file");
        let windows = file.portals.iter().map(|portal| portal.kind == PortalKind::Window).collect();
        Self {
            budget,
            bytes: bytes.to_vec(),
            states: vec![State::Absent; objects],
            shown: vec![0; objects],
            planned: vec![0; objects],
            used: 0,
            loaded: 0,
            loaded_and_shown: 0,
            frame: 0,
            missing: Vec::with_capacity(objects),
            plan: Plan::new(culler, Reach::new(culler, windows), budget),
            sight: Sight::new(culler),
            made: None,
            homes: Vec::with_capacity(super::locate::MOST_HOMES),
            last_piece: 0,
            spare: Vec::with_capacity(objects),
            is_listed: false,
            at: Places::default(),
        }
    }

    /// Begins a frame: an eye (metres, relative to the file's origin), how it moves, and what it sees ([`super::VisibleSet::objects`]). Returns
    /// how many of these are not loaded; [`Self::is_loaded`] says which. `culler` is always the same.
    pub fn frame(&mut self, culler: &Culler, eye: Vec3, motion: &Motion, visible: &[ObjectId]) -> usize {
        self.frame += 1;
        self.loaded_and_shown = 0;
        self.missing.clear();
        for &object in visible {
            let at = object.index();
            self.shown[at] = self.frame;
            match self.states[at] {
                State::Loaded => self.loaded_and_shown += self.bytes[at],
                _ if self.missing.len() < self.missing.capacity() => self.missing.push(object),
                _ => {}
            }
        }
        if eye.is_finite() {
            self.look_ahead(culler, eye, motion);
        }
        self.at = Places { tail: self.plan.order().len(), ..Places::default() };
        self.missing.len()
    }

    /// Makes a new plan where one is needed.
    fn look_ahead(&mut self, culler: &Culler, eye: Vec3, motion: &Motion) {
        let homes = culler.locator.locate(eye, culler.tolerance, &mut self.last_piece);
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
        self.plan.make(culler, &self.bytes, Walker { eye, ahead }, &self.homes, &mut self.sight, motion);
        for planned in self.plan.order() {
            self.planned[planned.object.index()] = self.frame;
        }
        self.made = Some((self.frame, [eye, looks]));
        self.is_listed = false;
    }

    /// What to do next; `None`: nothing in this frame. A step counts as taken.
    pub fn next_step(&mut self) -> Option<Step> {
        while let Some((Planned { object, metres }, is_shown)) = self.wanted() {
            let bytes = self.bytes[object.index()];
            if bytes <= self.budget && self.used <= self.budget - bytes {
                self.states[object.index()] = State::UnderWay;
                self.used += bytes;
                return Some(Step::Load { object, metres });
            }
            // What is planned fits, as far as nothing is under way that isn't. What the frame sees may not.
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
                    let bytes = self.bytes[leaver.index()];
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

    /// The most urgent object that is neither there nor under way, and whether the frame sees it.
    fn wanted(&mut self) -> Option<(Planned, bool)> {
        let is_absent = |object: ObjectId| self.states[object.index()] == State::Absent;
        while let Some(&object) = self.missing.get(self.at.missing) {
            if is_absent(object) {
                return Some((Planned { object, metres: 0.0 }, true));
            }
            self.at.missing += 1;
        }
        while let Some(&planned) = self.plan.order().get(self.at.plan) {
            if is_absent(planned.object) {
                return Some((planned, false));
            }
            self.at.plan += 1;
        }
        None
    }

    /// What leaves next: what is not planned, the oldest first; then what is planned, the farthest first, but for the `kept` first ones.
    fn leaver(&mut self, kept: usize) -> Option<ObjectId> {
        if !self.is_listed {
            self.list_spare();
        }
        let may_leave =
            |object: ObjectId| self.states[object.index()] == State::Loaded && self.shown[object.index()] != self.frame;
        while let Some(&object) = self.spare.get(self.at.spare) {
            self.at.spare += 1;
            if may_leave(object) {
                return Some(object);
            }
        }
        while self.at.tail > kept {
            self.at.tail -= 1;
            let object = self.plan.order()[self.at.tail].object;
            if may_leave(object) {
                return Some(object);
            }
        }
        None
    }

    fn list_spare(&mut self) {
        let now = self.made.map_or(0, |(frame, _)| frame);
        let (states, planned, shown) = (&self.states, &self.planned, &self.shown);
        let is_spare = |i: &usize| states[*i] == State::Loaded && (planned[*i] != now || now == 0);
        self.spare.clear();
        self.spare.extend((0..states.len()).filter(is_spare).map(|i| ObjectId(i as u32)));
        self.spare.sort_unstable_by_key(|object| (planned[object.index()].max(shown[object.index()]), *object));
        self.is_listed = true;
        self.at.spare = 0;
    }

    /// Tells that an object that was asked for is in memory. Of others, nothing is noted.
    pub fn loaded(&mut self, object: ObjectId) {
        let at = object.index();
        if self.states.get(at) == Some(&State::UnderWay) {
            self.states[at] = State::Loaded;
            self.loaded += self.bytes[at];
            if self.shown[at] == self.frame {
                self.loaded_and_shown += self.bytes[at];
            }
            // One that is not planned any more is to be listed.
            self.is_listed &= self.made.is_some_and(|(frame, _)| self.planned[at] == frame);
        }
    }

    /// Tells that an object that was asked for can't be loaded. It is not asked for again.
    pub fn failed(&mut self, object: ObjectId) {
        if self.states.get(object.index()) == Some(&State::UnderWay) {
            self.states[object.index()] = State::Failed;
            self.used -= self.bytes[object.index()];
        }
    }

    /// Says whether the eye does not go through a portal: windows are barred from the start, and nothing else.
    ///
    /// # Panics
    ///
    /// Where there is no such portal.
    pub fn bar(&mut self, portal: PortalId, barred: bool) {
        self.plan.reach_mut().bar(portal, barred);
        self.made = None;
    }

    /// Whether an object is in memory, as far as the prefetcher was told.
    pub fn is_loaded(&self, object: ObjectId) -> bool {
        self.states.get(object.index()) == Some(&State::Loaded)
    }

    /// Bytes of what is in memory and of what is under way.
    pub fn used(&self) -> u64 {
        self.used
    }
}
