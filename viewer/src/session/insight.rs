//! What explains the culling: another mode beside the first, what frames draw in vain, profiles of paths, and the line that answers `why`.

use super::Session;
use crate::colours::{Tints, colours};
use crate::draw::frame::Wish;
use crate::draw::lines::Overlay;
use crate::draw::marks::Marking;
use crate::draw::split::Split;
use crate::heat;
use crate::mode::ViewMode;
use crate::profile::Profile;
use crate::ui::profile;
use crate::walker::Walker;
use enfilade::runtime::{Camera, FrameMode};
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::tour::tour;
use glam::DVec3;

/// How fast one flies along a line of sight, metres a second; and how long it takes at least and at most, seconds.
const ALONG: f64 = 2.5;
const FLIGHT: [f64; 2] = [1.5, 12.0];
/// How far before the end of the line one stays, metres; at most this part of it.
const BEFORE: (f64, f64) = (0.4, 0.2);

/// Most frames of a profile of a path that nobody walked. More: it takes minutes on a software driver. Fewer: small rooms are passed by.
const MOST_FRAMES: usize = 300;

/// What a session keeps for that.
#[derive(Default)]
pub struct Insight<'b> {
    /// Another mode, in the right half of the picture.
    pub split: Option<Split<'b>>,
    /// What lies over that half.
    pub(super) overlay: Overlay,
    /// The last profile.
    pub profile: Option<Profile<'b>>,
    /// It is shown, and measured until it is done.
    pub shows_profile: bool,
    /// Who walks on when it is done.
    back: Option<Walker>,
    /// The frame of the profile that somebody went to.
    at: Option<(usize, Walker)>,
    /// A frozen frame is culled once more.
    pub(super) culls_again: bool,
    /// Along the line of sight: from, to, and the seconds since.
    flight: Option<([DVec3; 2], f64)>,
}

impl<'b> Session<'b> {
    /// Shows colours, or those of roles again.
    pub(super) fn tint(&mut self, tints: Tints) {
        self.show.tints = if self.show.tints == tints { Tints::Roles } else { tints };
        self.paint();
    }

    /// Colours objects.
    pub(super) fn paint(&self) {
        let tints = self.show.tints;
        let colours = match (&self.insight.profile, tints) {
            (Some(profile), Tints::Seen | Tints::InVain) => heat::of_objects(profile, tints),
            _ => colours(&self.building.scene, &self.building.file, tints),
        };
        self.stage.paint(colours);
    }

    /// The heat of the last profile: how often objects are seen, what they cost in vain, and neither.
    pub(super) fn turn_heat(&mut self) {
        if self.insight.profile.as_ref().is_none_or(|profile| profile.costs.is_empty()) {
            return self.tell("no profile yet: F7 makes one".to_owned());
        }
        self.tint(match self.show.tints {
            Tints::Seen | Tints::InVain => Tints::InVain,
            _ => Tints::Seen,
        });
    }

    /// Another mode beside the first, or no longer. At first it is the frustum, or nothing.
    pub(super) fn split_or_join(&mut self) {
        self.insight.split = match self.insight.split.take() {
            Some(_) => None,
            None => {
                let frustum = FrameMode::Frustum.into();
                let other = if self.show.mode == frustum { FrameMode::None.into() } else { frustum };
                Some(Split::new(&self.stage, other, self.format))
            }
        };
    }

    /// How the right half is culled; without one, it is there from now on.
    pub(super) fn set_other_mode(&mut self, mode: ViewMode) {
        if self.insight.split.is_none() {
            self.split_or_join();
        }
        if let Some(split) = &mut self.insight.split {
            split.mode = mode;
        }
        self.insight.culls_again = true;
    }

    /// The other mode's half of a frame.
    pub(super) fn draw_other(&mut self, camera: Camera, culled_by: Option<Camera>, marking: Marking) -> Result<(), String> {
        let Some(split) = &mut self.insight.split else { return Ok(()) };
        // What it decided when it was last asked; at first there is nothing.
        let culled_by = culled_by.or(self.frozen.map(|frozen| frozen.0).filter(|_| split.side.culling.last.is_none()));
        let (mode, overlay) = (split.mode, &self.insight.overlay);
        let wish = Wish { camera, culled_by, mode, alarm: false, timed: false, overlay, mirrors: None };
        split.draw(&mut self.stage, wish, marking)
    }

    /// A profile of the path that was recorded or played last, else of one through every cell; or shows the last one, or hides it.
    pub(super) fn profile_or_hide(&mut self) {
        if self.insight.profile.is_none() {
            return self.start_profile();
        }
        self.insight.shows_profile ^= true;
        if !self.insight.shows_profile {
            self.leave_profile();
        }
    }

    /// Measures a path from its beginning to its end.
    ///
    /// # Errors
    ///
    /// One line: the device has failed.
    pub fn profile(&mut self, path: CameraPath) -> Result<(), String> {
        let origin = self.building.file.origin;
        let mut profile = Profile::new(&self.stage, path, self.show.mode, self.format);
        while !profile.is_done() {
            profile.step(&mut self.stage, origin)?;
        }
        self.insight.profile = Some(profile);
        Ok(())
    }

    fn start_profile(&mut self) {
        let path = self.paths.last().cloned().unwrap_or_else(|| thinned(tour(&self.building.file, 0)));
        if path.frames.is_empty() {
            return self.tell("no path: the model has no cell that one can be in".to_owned());
        }
        self.insight.back.get_or_insert(self.walker);
        self.insight.profile = Some(Profile::new(&self.stage, path, self.show.mode, self.format));
        self.insight.shows_profile = true;
        self.paint();
    }

    /// Who was led along the path is where they were; a profile that isn't done is given up.
    pub(super) fn leave_profile(&mut self) {
        self.insight.shows_profile = false;
        self.walker = self.insight.back.take().unwrap_or(self.walker);
        self.insight.profile.take_if(|profile| !profile.is_done());
    }

    /// Does what the panel of the profile is asked for.
    pub(super) fn do_profile_wish(&mut self, wish: profile::Wish) {
        match (wish, &self.insight.profile) {
            (profile::Wish::Again, _) => self.start_profile(),
            (profile::Wish::Go(frame), Some(profile)) => {
                self.insight.back = None;
                let at = profile.path.frames[frame];
                self.be(Walker::new(at.eye - self.building.file.origin, at.target - at.eye, true));
                self.insight.at = Some((frame, self.walker));
            }
            (profile::Wish::Save, Some(profile)) => {
                let costs = &profile.costs;
                let saved = self.kept.save("profile.json", &|to| serde_json::to_writer(to, costs).map_err(Into::into));
                self.tell_saved(saved);
            }
            _ => {}
        }
    }

    /// Measures a frame of the profile, if it isn't done.
    pub(super) fn go_on_with_profile(&mut self) -> Result<(), String> {
        let Some(profile) = self.insight.profile.as_mut().filter(|profile| !profile.is_done()) else { return Ok(()) };
        let at = profile.path.frames[profile.costs.len()];
        let origin = self.building.file.origin;
        profile.step(&mut self.stage, origin)?;
        self.walker = Walker::new(at.eye - origin, at.target - at.eye, true);
        self.insight.at = None;
        if profile.is_done() {
            self.walker = self.insight.back.take().unwrap_or(self.walker);
            self.paint();
        }
        Ok(())
    }

    /// The frame of the profile that somebody is at.
    pub(super) fn frame_of_profile(&self) -> Option<usize> {
        self.insight.at.filter(|(_, there)| !self.walker.has_gone_from(there)).map(|(frame, _)| frame)
    }

    /// The line that answers `why`: from, to, metres relative to the origin.
    pub fn sight(&self) -> Option<[DVec3; 2]> {
        self.told.as_ref()?.sight
    }

    /// Flies along the line that answers `why`.
    pub fn fly_along_sight(&mut self) {
        if let Some(sight) = self.sight() {
            self.insight.flight = Some((sight, 0.0));
        }
    }

    /// Ends the flight.
    pub(super) fn land(&mut self) {
        self.insight.flight = None;
    }

    /// Goes on along the line for `seconds`; false where one doesn't fly along it.
    pub(super) fn fly_on(&mut self, seconds: f64) -> bool {
        let Some(([from, to], now)) = &mut self.insight.flight else { return false };
        *now += seconds;
        let length = from.distance(*to);
        let part = (*now / (length / ALONG).clamp(FLIGHT[0], FLIGHT[1])).min(1.0);
        let stop = 1.0 - (BEFORE.0 / length.max(BEFORE.0)).min(BEFORE.1);
        self.walker = Walker::new(from.lerp(*to, part * stop), *to - *from, true);
        self.insight.flight.take_if(|_| part >= 1.0);
        true
    }
}

/// A path of [`MOST_FRAMES`] at most.
fn thinned(mut path: CameraPath) -> CameraPath {
    let step = path.frames.len().div_ceil(MOST_FRAMES).max(1);
    path.frames = path.frames.into_iter().step_by(step).collect();
    path
}
