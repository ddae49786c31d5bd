//! What a session has for who keeps it open: looking and speed, pictures, paths, and leaving.

use super::section::Cut;
use super::{Session, Show};
use crate::colours::Tints;
use crate::draw::pipelines::NEAR;
use crate::draw::targets::Canvas;
use crate::looks::Detail;
use crate::measure::Measure;
use crate::recording::{self, Recording};
use crate::settings::{closer, faster};
use crate::ui::escape::{Escape, Panel, escape};
use crate::ui::keys::Action;
use crate::walker::Walker;
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};
use enfilade_measure::walkthrough::picture::Picture;
use glam::DVec2;
use std::path::PathBuf;

/// Radians of a pixel that the mouse is moved by.
const MOUSE: f64 = 0.003;
/// How long a line stays on the screen, seconds.
const NOTE: f64 = 5.0;

/// Before a window is shut, and the answers.
pub(super) const QUESTION: &str = "A recorded path isn't saved.";
pub(super) const ANSWERS: [&str; 3] = ["Save and quit", "Quit", "Stay"];

/// What a window is asked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Asked {
    /// The whole screen, or no longer.
    pub full_screen: bool,
    /// The end.
    pub quit: bool,
    /// A dialog to choose another file in.
    pub open: bool,
}

/// Paths that are recorded and played.
#[derive(Default)]
pub struct Paths {
    recording: Option<Recording>,
    /// What is played.
    last: Option<CameraPath>,
    /// Recorded, and in no file: it couldn't be written.
    unsaved: Option<CameraPath>,
    /// Seconds since the path's beginning, and whether the walker flies elsewhere.
    playing: Option<(f64, bool)>,
}

/// What goes on when more is known of a building, and a session begins anew.
pub struct Ongoing {
    show: Show,
    paths: Paths,
    asked: Asked,
    note: Option<(String, f64)>,
    cut: Cut,
    measure: Measure,
}

impl Paths {
    /// The path that was recorded or played last.
    pub(super) fn last(&self) -> Option<&CameraPath> {
        self.last.as_ref()
    }
}

impl Session<'_> {
    /// Hands on what the next session goes on with.
    pub fn ongoing(&mut self) -> Ongoing {
        let (paths, note) = (std::mem::take(&mut self.paths), self.note.take());
        let (cut, measure) = (self.cut, std::mem::take(&mut self.measure));
        Ongoing { show: self.show.clone(), paths, asked: self.asked, note, cut, measure }
    }

    /// Goes on with it.
    pub fn go_on(&mut self, Ongoing { show, paths, asked, note, cut, measure }: Ongoing) {
        (self.cut, self.measure) = (cut, measure);
        (self.show, self.paths, self.asked, self.note) = (show, paths, asked, note);
        // A profile was of the session before.
        if matches!(self.show.tints, Tints::Seen | Tints::InVain) {
            self.show.tints = Tints::Roles;
        }
        self.paint();
    }

    /// The mouse was moved by so many pixels.
    pub fn look(&mut self, by: DVec2) {
        let by = by * (MOUSE * self.preferences.sensitivity);
        self.walker.turn(by.x, if self.preferences.inverted { by.y } else { -by.y });
    }

    /// The wheel was turned by so many notches, away from a person.
    pub fn wheel(&mut self, notches: f64, zooms: bool) {
        if zooms {
            self.show.fov_y = closer(self.show.fov_y.to_degrees(), notches).to_radians();
        } else {
            self.preferences.speed = faster(self.preferences.speed, notches);
            self.walker.speed = self.preferences.speed;
        }
    }

    /// Shows a line for a moment.
    pub fn tell(&mut self, line: String) {
        self.note = Some((line, NOTE));
    }

    /// Whether what a button does is so now.
    pub fn is_on(&self, action: Action) -> bool {
        let show = &self.show;
        match action {
            Action::Mode(mode) => show.mode == crate::culling::MODES[mode].into(),
            Action::Freeze => self.is_frozen(),
            Action::Cells => show.tints == Tints::Cells,
            Action::Waste => show.tints == Tints::Waste,
            Action::Culled => show.culled,
            Action::Split => self.insight.split.is_some(),
            Action::OtherMode(mode) => {
                self.insight.split.as_ref().is_some_and(|split| split.mode == crate::culling::MODES[mode].into())
            }
            Action::Profile => self.insight.shows_profile,
            Action::Heat => matches!(show.tints, Tints::Seen | Tints::InVain),
            Action::Detail => show.detail != Detail::Plain,
            Action::Layer(shown) => show.clone().layer(shown).is_some_and(|layer| *layer),
            Action::Alarm => show.layers.alarm,
            Action::Fly => self.walker.flies,
            Action::Hud => show.hud,
            Action::Menu => show.menu,
            Action::Preferences => show.preferences,
            Action::Record => self.paths.recording.is_some(),
            Action::Play => self.paths.playing.is_some(),
            Action::Find => self.find.is_open,
            Action::Section => self.cut.is_on,
            Action::Measure => self.measure.is_on,
            Action::Door | Action::Mirror | Action::Pick | Action::Screenshot | Action::FullScreen => false,
            Action::Storey(_) | Action::Open | Action::Hide | Action::Isolate | Action::ShowAll | Action::SavePlan => false,
            Action::TurnSection => false,
            Action::Ground => self.shows_tiles(),
            Action::Tubes => self.shows_sides(),
        }
    }

    /// What is on the screen without the panels.
    ///
    /// # Errors
    ///
    /// One line.
    pub fn screenshot(&mut self) -> Result<Picture, String> {
        let (gpu, format) = (&self.stage.gpu, self.format);
        let canvas = Canvas::of_format(gpu, self.size, format).ok_or_else(|| format!("no picture of {format:?}"))?;
        let camera = self.camera();
        self.picture(&canvas.view, camera, false)?;
        canvas.read(&self.stage.gpu).map_err(|e| e.to_string())
    }

    pub(super) fn save_screenshot(&mut self) {
        let saved = self
            .screenshot()
            .and_then(|picture| self.kept.save("png", &|to| picture.write_png(to).map_err(std::io::Error::other)));
        self.tell_saved(saved);
    }

    pub(super) fn tell_saved(&mut self, saved: Result<PathBuf, String>) {
        self.tell(saved.map_or_else(|e| format!("not saved: {e}"), |path| format!("saved: {}", path.display())));
    }

    /// Where a path is, in the model's own coordinates.
    fn place(&self) -> PathFrame {
        let eye = self.walker.eye + self.building.file.origin;
        PathFrame { eye, target: eye + self.walker.forward() }
    }

    pub(super) fn record_or_stop(&mut self) {
        if self.paths.recording.is_some() {
            return self.stop_recording();
        }
        let (name, fov_y) = (&self.building.scene.name, self.show.fov_y.to_degrees());
        self.paths.recording = Some(Recording::new(name, fov_y, f64::from(NEAR), self.place()));
    }

    /// Ends a recording, if there is one, and saves what isn't.
    fn stop_recording(&mut self) {
        if let Some(recording) = self.paths.recording.take() {
            let path = recording.end();
            self.paths.last = Some(path.clone());
            self.paths.unsaved = Some(path);
        }
        let Some(path) = &self.paths.unsaved else { return };
        let saved = self.kept.save("path.json", &|to| serde_json::to_writer(to, path).map_err(Into::into));
        if saved.is_ok() {
            self.paths.unsaved = None;
        }
        self.tell_saved(saved);
    }

    /// Ends a recording and saves it. Returns false where it can't be written.
    pub fn save_recording(&mut self) -> bool {
        self.stop_recording();
        self.paths.unsaved.is_none()
    }

    /// Records for `seconds`.
    pub(super) fn record(&mut self, seconds: f64) {
        let place = self.place();
        if self.paths.recording.as_mut().is_some_and(|recording| !recording.step(seconds, place)) {
            self.stop_recording();
        }
    }

    /// Plays a path from its beginning.
    pub fn play_path(&mut self, path: CameraPath) {
        self.paths.last = Some(path);
        self.paths.playing = Some((0.0, self.walker.flies));
        self.play(0.0);
    }

    pub(super) fn play_or_stop(&mut self) {
        match (self.paths.playing.take(), &self.paths.last) {
            (Some((_, flies)), _) => self.walker.flies = flies,
            (None, Some(_)) => self.paths.playing = Some((0.0, self.walker.flies)),
            (None, None) => self.tell(format!("no path to play: {} records one", self.keys.name_of(Action::Record))),
        }
    }

    /// Goes on along a path for `seconds`; false where none is played.
    pub(super) fn play(&mut self, seconds: f64) -> bool {
        let (Some((now, flies)), Some(path)) = (&mut self.paths.playing, &self.paths.last) else { return false };
        *now += seconds;
        // After its end somebody stays there, and walks on or flies as before.
        let (at, flies, goes_on) = match recording::at(path, *now) {
            Some(at) => (at, true, true),
            None => (path.frames[path.frames.len() - 1], *flies, false),
        };
        self.walker = Walker::new(at.eye - self.building.file.origin, at.target - at.eye, flies);
        self.paths.playing.take_if(|_| !goes_on);
        true
    }

    /// Whether a walker flies, or goes along a path only.
    pub(super) fn flies_by_itself(&self, walker: &Walker) -> bool {
        self.paths.playing.filter(|_| !self.is_frozen()).map_or(walker.flies, |(_, flies)| flies)
    }

    /// A line for the counters while a path is recorded or played.
    pub(super) fn say_path(&self) -> Option<String> {
        match &self.paths {
            Paths { recording: Some(recording), .. } => {
                Some(format!("recording: {:.1} s; {} stops", recording.seconds(), self.keys.name_of(Action::Record)))
            }
            Paths { playing: Some((now, _)), .. } => {
                Some(format!("playing: {now:.1} s; {} stops", self.keys.name_of(Action::Play)))
            }
            _ => None,
        }
    }

    /// Whether quitting loses something.
    fn is_unsaved(&self) -> bool {
        self.paths.recording.is_some() || self.paths.unsaved.is_some()
    }

    /// Does what Escape does; true where the window is to let go of the mouse.
    pub fn escape(&mut self, grabbed: bool) -> bool {
        let show = &self.show;
        let open = [
            (Panel::Question, show.question),
            (Panel::Keys, show.keys),
            (Panel::Find, self.find.is_open),
            (Panel::Preferences, show.preferences),
            (Panel::Profile, self.insight.shows_profile),
            (Panel::Why, self.told.is_some()),
            (Panel::Measure, self.measure.is_on),
        ];
        let open: Vec<Panel> = open.into_iter().filter(|panel| panel.1).map(|panel| panel.0).collect();
        match escape(grabbed, &open, self.is_unsaved()) {
            Escape::LetGo => return true,
            Escape::Close(Panel::Question) => self.show.question = false,
            Escape::Close(Panel::Keys) => self.show.keys = false,
            Escape::Close(Panel::Find) => self.find.toggle(),
            Escape::Close(Panel::Preferences) => self.turn_settings(),
            Escape::Close(Panel::Profile) => self.leave_profile(),
            Escape::Close(Panel::Why) => {
                self.told = None;
                self.land();
                self.picked.clear();
                self.pair = None;
            }
            Escape::Close(Panel::Measure) => self.toggle_measuring(),
            Escape::Ask => self.show.question = true,
            Escape::Quit => self.asked.quit = true,
        }
        false
    }

    /// The window is to be shut: asks where something would be lost.
    pub fn close(&mut self) {
        self.show.question = self.is_unsaved();
        self.asked.quit = !self.show.question;
    }

    /// One of [`ANSWERS`].
    pub(super) fn answer(&mut self, answer: usize) {
        self.show.question = false;
        match ANSWERS[answer] {
            "Save and quit" => self.asked.quit = self.save_recording(),
            "Quit" => self.asked.quit = true,
            _ => {}
        }
    }
}
