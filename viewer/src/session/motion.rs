//! The walker, the camera, and what moves them: keys, a flight along a line, a path that is played.

use super::Session;
use super::paths::Paths;
use crate::collision::NOBODY;
use crate::settings::{closer, faster};
use crate::walker::{MoveInput, Walker};
use enfilade::ObjectId;
use enfilade::runtime::Camera;
use enfilade::scene::Role;
use glam::{DVec2, DVec3};

/// Radians for a pixel that the mouse moves.
const MOUSE: f64 = 0.003;
/// Steps of the trail, metres, and how many are kept.
const TRAIL: (f64, usize) = (0.25, 4000);
/// Speed of a flight along a line of sight, metres a second; and its least and greatest duration, seconds.
const ALONG: f64 = 2.5;
const FLIGHT: [f64; 2] = [1.5, 12.0];
/// Distance from the end of the line where a flight stops, metres; at most this part of it.
const BEFORE: (f64, f64) = (0.4, 0.2);

/// Where a person is, and how they move.
pub struct Motion {
    /// The walker.
    pub walker: Walker,
    /// Paths that are recorded and played.
    pub paths: Paths,
    /// The camera that culls, and the walker to go on with.
    pub(super) frozen: Option<(Camera, Walker)>,
    /// The walked way.
    pub(super) trail: Vec<DVec3>,
    /// A flight along a line: from, to, and the seconds since its start.
    pub(super) flight: Option<([DVec3; 2], f64)>,
}

impl Default for Motion {
    fn default() -> Self {
        let walker = Walker::new(DVec3::ZERO, DVec3::NEG_Z, false);
        Self { walker, paths: Paths::default(), frozen: None, trail: Vec::new(), flight: None }
    }
}

impl Motion {
    /// Adds a step to the trail.
    pub(super) fn leave_trail(&mut self) {
        if self.frozen.is_none() && self.trail.last().is_none_or(|last| last.distance(self.walker.eye) > TRAIL.0) {
            self.trail.push(self.walker.eye);
            let more = self.trail.len().saturating_sub(TRAIL.1);
            self.trail.drain(..more);
        }
    }

    /// Flies on for `seconds`; false without a flight.
    fn fly_on(&mut self, seconds: f64) -> bool {
        let Some(([from, to], now)) = &mut self.flight else { return false };
        *now += seconds;
        let length = from.distance(*to);
        let part = (*now / (length / ALONG).clamp(FLIGHT[0], FLIGHT[1])).min(1.0);
        let stop = 1.0 - (BEFORE.0 / length.max(BEFORE.0)).min(BEFORE.1);
        self.walker = Walker::new(from.lerp(*to, part * stop), *to - *from, true);
        self.flight.take_if(|_| part >= 1.0);
        true
    }

    /// Whether a walker flies, and not only along a path.
    pub(super) fn flies_by_itself(&self, walker: &Walker) -> bool {
        self.paths.flew().filter(|_| self.frozen.is_none()).unwrap_or(walker.flies)
    }
}

impl Session<'_> {
    /// Moves on for `seconds`.
    pub fn go(&mut self, seconds: f64, input: &MoveInput) {
        // 1. Doors: none shuts on a walker.
        let walks = (!self.motion.walker.flies).then_some(self.motion.walker.eye);
        if self.renderer.doors.step(seconds, walks) {
            self.doors_changed();
        }
        self.renderer.people.iter_mut().for_each(|people| people.go(seconds));
        // 2. The walker: along a line, a path, or by keys.
        if !self.motion.fly_on(seconds) && !self.play(seconds) {
            self.walk(seconds, input);
        }
        self.record(seconds);
    }

    fn walk(&mut self, seconds: f64, input: &MoveInput) {
        let Self { motion, document, renderer, user, .. } = self;
        motion.walker.speed = user.preferences.speed;
        let (scene, doors) = (&document.building.scene, &renderer.doors);
        // A door that hangs in no portal cannot be opened: walkers pass it.
        let passes = |o: ObjectId| o != NOBODY && scene.objects[o.index()].role == Role::Door && !doors.is_hung[o.index()];
        let (terrain, origin) = (&renderer.terrain, document.building.file.origin);
        let ground = |p: DVec3| terrain.as_ref().and_then(|terrain| terrain.land.height(p, origin));
        // A long frame does not move the walker far.
        motion.walker.go(seconds.min(0.1), input, &document.solid, &passes, &ground);
    }

    /// The walker's camera.
    pub fn camera(&self) -> Camera {
        let [width, height] = self.size().map(f64::from);
        self.motion.walker.camera(self.view.fov_y, width / height)
    }

    /// Turns by a movement of the mouse, pixels.
    pub fn look(&mut self, by: DVec2) {
        let by = by * (MOUSE * self.user.preferences.sensitivity);
        self.motion.walker.turn(by.x, if self.user.preferences.inverted { by.y } else { -by.y });
    }

    /// Changes speed or field of view by notches of the wheel; away from the person is positive.
    pub fn wheel(&mut self, notches: f64, zooms: bool) {
        if zooms {
            self.view.fov_y = closer(self.view.fov_y.to_degrees(), notches).to_radians();
        } else {
            self.user.preferences.speed = faster(self.user.preferences.speed, notches);
            self.motion.walker.speed = self.user.preferences.speed;
        }
    }

    /// Keeps the culling as it is, and flies.
    pub fn freeze(&mut self) {
        self.motion.frozen = Some((self.camera(), self.motion.walker));
        self.motion.walker.flies = true;
    }

    pub(super) fn freeze_or_go_on(&mut self) {
        match self.motion.frozen.take() {
            Some((_, walker)) => self.motion.walker = walker,
            None => self.freeze(),
        }
    }

    /// Whether the culling stands still.
    pub fn is_frozen(&self) -> bool {
        self.motion.frozen.is_some()
    }

    /// Flies along the line that answers `why`.
    pub fn fly_along_sight(&mut self) {
        if let Some(sight) = self.selection.sight() {
            self.motion.flight = Some((sight, 0.0));
        }
    }

    /// Jumps elsewhere; with a frozen culling, the walker flies.
    pub(super) fn be(&mut self, to: Walker) {
        self.motion.walker = to;
        self.motion.walker.flies |= self.is_frozen();
        self.panels.plan.follow(DVec2::new(to.eye.x, to.eye.z));
        // The trail does not lead there.
        self.motion.trail.clear();
    }
}
