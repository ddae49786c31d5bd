//! Paths that are recorded and played.

use super::Session;
use crate::commands::Action;
use crate::draw::pipelines::NEAR;
use crate::recording::{self, Recording};
use crate::walker::Walker;
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};

/// Paths of a visit.
#[derive(Default)]
pub struct Paths {
    recording: Option<Recording>,
    /// The path that was recorded or played last.
    pub(super) last: Option<CameraPath>,
    /// Recorded, and not written to a file.
    unsaved: Option<CameraPath>,
    /// Seconds since the start of the path, and whether the walker flew before.
    playing: Option<(f64, bool)>,
}

impl Paths {
    /// Whether a path is recorded.
    pub fn is_recording(&self) -> bool {
        self.recording.is_some()
    }

    /// Whether a path is played.
    pub fn is_playing(&self) -> bool {
        self.playing.is_some()
    }

    /// Whether the walker flew before the path that is played.
    pub(super) fn flew(&self) -> Option<bool> {
        self.playing.map(|(_, flies)| flies)
    }

    /// Whether quitting loses something.
    pub(super) fn is_unsaved(&self) -> bool {
        self.recording.is_some() || self.unsaved.is_some()
    }
}

impl Session<'_> {
    /// Where the walker is, in the model's own coordinates.
    fn place(&self) -> PathFrame {
        let eye = self.motion.walker.eye + self.document.building.file.origin;
        PathFrame { eye, target: eye + self.motion.walker.forward() }
    }

    /// Begins a recording, or ends it and saves it.
    pub(super) fn record_or_stop(&mut self) {
        if self.motion.paths.is_recording() {
            return self.stop_recording();
        }
        let (name, fov_y) = (&self.document.building.scene.name, self.view.fov_y.to_degrees());
        self.motion.paths.recording = Some(Recording::new(name, fov_y, f64::from(NEAR), self.place()));
    }

    /// Ends a recording, if there is one, and saves what is unsaved.
    fn stop_recording(&mut self) {
        let paths = &mut self.motion.paths;
        if let Some(recording) = paths.recording.take() {
            let path = recording.end();
            paths.last = Some(path.clone());
            paths.unsaved = Some(path);
        }
        let Some(path) = &paths.unsaved else { return };
        let saved = self.document.output.save("path.json", &|to| serde_json::to_writer(to, path).map_err(Into::into));
        if saved.is_ok() {
            paths.unsaved = None;
        }
        self.tell_saved(saved);
    }

    /// Ends a recording and saves it. Returns false if it cannot be written.
    pub fn save_recording(&mut self) -> bool {
        self.stop_recording();
        self.motion.paths.unsaved.is_none()
    }

    /// Records for `seconds`.
    pub(super) fn record(&mut self, seconds: f64) {
        let place = self.place();
        if self.motion.paths.recording.as_mut().is_some_and(|recording| !recording.step(seconds, place)) {
            self.stop_recording();
        }
    }

    /// Plays a path from its beginning.
    pub fn play_path(&mut self, path: CameraPath) {
        self.motion.paths.last = Some(path);
        self.motion.paths.playing = Some((0.0, self.motion.walker.flies));
        self.play(0.0);
    }

    pub(super) fn play_or_stop(&mut self) {
        let paths = &mut self.motion.paths;
        match (paths.playing.take(), &paths.last) {
            (Some((_, flies)), _) => self.motion.walker.flies = flies,
            (None, Some(_)) => paths.playing = Some((0.0, self.motion.walker.flies)),
            (None, None) => self.tell(format!("no path to play: {} records one", self.user.keys.name_of(Action::Record))),
        }
    }

    /// Plays on for `seconds`; false if no path is played.
    pub(super) fn play(&mut self, seconds: f64) -> bool {
        let paths = &mut self.motion.paths;
        let (Some((now, flies)), Some(path)) = (&mut paths.playing, &paths.last) else { return false };
        *now += seconds;
        // At its end the walker stays, and walks or flies as before.
        let (at, flies, goes_on) = match recording::at(path, *now) {
            Some(at) => (at, true, true),
            None => (path.frames[path.frames.len() - 1], *flies, false),
        };
        self.motion.walker = Walker::new(at.eye - self.document.building.file.origin, at.target - at.eye, flies);
        paths.playing.take_if(|_| !goes_on);
        true
    }

    /// A line for the counters while a path is recorded or played.
    pub(super) fn say_path(&self) -> Option<String> {
        let (keys, paths) = (&self.user.keys, &self.motion.paths);
        if let Some(recording) = &paths.recording {
            return Some(format!("recording: {:.1} s; {} stops", recording.seconds(), keys.name_of(Action::Record)));
        }
        paths.playing.map(|(now, _)| format!("playing: {now:.1} s; {} stops", keys.name_of(Action::Play)))
    }
}
