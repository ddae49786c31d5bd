//! What explains the culling: a second mode in the right half, colours, profiles of paths.

use super::Session;
use crate::colours::{Tints, colours};
use crate::draw::frame::FrameRequest;
use crate::draw::lines::Overlay;
use crate::draw::marks::Marking;
use crate::draw::split::Split;
use crate::heat;
use crate::mode::ViewMode;
use crate::profile::Profile;
use crate::walker::Walker;
use enfilade::runtime::{Camera, Mode};
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::tour::tour;

/// Frames at most of a profile of a generated path. More: it takes minutes on a software driver. Fewer: small rooms are passed by.
const MOST_FRAMES: usize = 300;

/// State of the tools that explain the culling.
#[derive(Default)]
pub struct Insight<'b> {
    /// Another mode, in the right half of the picture.
    pub split: Option<Split<'b>>,
    /// Lines and faces over that half.
    pub(super) overlay: Overlay,
    /// The last profile.
    pub profile: Option<Profile<'b>>,
    /// It is shown, and measured until it is done.
    pub shows_profile: bool,
    /// The walker to go on with when it is done.
    back: Option<Walker>,
    /// The frame of the profile that the walker jumped to.
    at: Option<(usize, Walker)>,
    /// A frozen frame is culled once more.
    pub(super) culls_again: bool,
}

impl<'b> Session<'b> {
    /// Shows colours, or those of roles again.
    pub(super) fn tint(&mut self, tints: Tints) {
        self.view.tints = if self.view.tints == tints { Tints::Roles } else { tints };
        self.paint();
    }

    /// Colours objects.
    pub(super) fn paint(&self) {
        let tints = self.view.tints;
        let colours = match (&self.insight.profile, tints) {
            (Some(profile), Tints::Seen | Tints::InVain) => heat::of_objects(profile, tints),
            _ => colours(&self.document.building.scene, &self.document.building.file, tints),
        };
        self.renderer.paint(colours);
    }

    /// The heat of the last profile: how often objects are seen, what they cost in vain, and neither.
    pub(super) fn turn_heat(&mut self) {
        if self.insight.profile.as_ref().is_none_or(|profile| profile.costs.is_empty()) {
            return self.tell("no profile yet: F7 makes one".to_owned());
        }
        self.tint(match self.view.tints {
            Tints::Seen | Tints::InVain => Tints::InVain,
            _ => Tints::Seen,
        });
    }

    /// Another mode beside the first, or no longer. At first it is the frustum, or nothing.
    pub(super) fn split_or_join(&mut self) {
        self.insight.split = match self.insight.split.take() {
            Some(_) => None,
            None => {
                let frustum = Mode::Frustum.into();
                let other = if self.view.mode == frustum { Mode::None.into() } else { frustum };
                Some(Split::new(&self.renderer, other, self.renderer.format))
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
        let culled_by =
            culled_by.or(self.motion.frozen.map(|frozen| frozen.0).filter(|_| split.side.culling.last.is_none()));
        let (mode, overlay) = (split.mode, &self.insight.overlay);
        let request = FrameRequest { culled_by, overlay, ..FrameRequest::new(camera, mode) };
        split.draw(&mut self.renderer, request, marking)
    }

    /// A profile of the path that was recorded or played last, else of one through every cell; or shows the last one, or hides it.
    pub(super) fn profile_or_hide(&mut self) {
        match (self.insight.shows_profile, &self.insight.profile) {
            (true, _) => self.leave_profile(),
            (false, None) => self.start_profile(),
            (false, Some(_)) => self.insight.shows_profile = true,
        }
    }

    /// Measures a path from its beginning to its end.
    ///
    /// # Errors
    ///
    /// One line: the device has failed.
    pub fn profile(&mut self, path: CameraPath) -> Result<(), String> {
        let origin = self.document.building.file.origin;
        let mut profile = Profile::new(&self.renderer, path, self.view.mode, self.renderer.format);
        while !profile.is_done() {
            profile.step(&mut self.renderer, origin)?;
        }
        self.insight.profile = Some(profile);
        Ok(())
    }

    pub(super) fn start_profile(&mut self) {
        let path = self.motion.paths.last.clone().unwrap_or_else(|| thinned(tour(&self.document.building.file, 0)));
        if path.frames.is_empty() {
            return self.tell("no path: the model has no cell to walk in".to_owned());
        }
        self.insight.back.get_or_insert(self.motion.walker);
        self.insight.profile = Some(Profile::new(&self.renderer, path, self.view.mode, self.renderer.format));
        self.insight.shows_profile = true;
        self.paint();
    }

    /// The walker returns to where it was; an unfinished profile is dropped.
    pub(super) fn leave_profile(&mut self) {
        self.insight.shows_profile = false;
        self.motion.walker = self.insight.back.take().unwrap_or(self.motion.walker);
        self.insight.profile.take_if(|profile| !profile.is_done());
    }

    /// Goes to a frame of the profile.
    pub(super) fn go_to_frame(&mut self, frame: usize) {
        let Some(profile) = &self.insight.profile else { return };
        let at = profile.path.frames[frame];
        self.insight.back = None;
        self.be(Walker::new(at.eye - self.document.building.file.origin, at.target - at.eye, true));
        self.insight.at = Some((frame, self.motion.walker));
    }

    /// Writes the profile as a file.
    pub(super) fn save_profile(&mut self) {
        let Some(profile) = &self.insight.profile else { return };
        let costs = &profile.costs;
        let saved = self.document.output.save("profile.json", &|to| serde_json::to_writer(to, costs).map_err(Into::into));
        self.tell_saved(saved);
    }

    /// Measures a frame of the profile, if it isn't done.
    pub(super) fn go_on_with_profile(&mut self) -> Result<(), String> {
        let Some(profile) = self.insight.profile.as_mut().filter(|profile| !profile.is_done()) else { return Ok(()) };
        let at = profile.path.frames[profile.costs.len()];
        let origin = self.document.building.file.origin;
        profile.step(&mut self.renderer, origin)?;
        self.motion.walker = Walker::new(at.eye - origin, at.target - at.eye, true);
        self.insight.at = None;
        if profile.is_done() {
            self.motion.walker = self.insight.back.take().unwrap_or(self.motion.walker);
            self.paint();
        }
        Ok(())
    }

    /// The frame of the profile at which the walker stands.
    pub(super) fn frame_of_profile(&self) -> Option<usize> {
        self.insight.at.filter(|(_, there)| !self.motion.walker.has_gone_from(there)).map(|(frame, _)| frame)
    }
}

/// A path of [`MOST_FRAMES`] at most.
fn thinned(mut path: CameraPath) -> CameraPath {
    let step = path.frames.len().div_ceil(MOST_FRAMES).max(1);
    path.frames = path.frames.into_iter().step_by(step).collect();
    path
}
