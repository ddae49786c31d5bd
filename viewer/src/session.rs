//! A visit to a building without a window: the document, the walker, the selection and the view settings, joined.
//!
//! [`execute`] does what commands say, [`panels`] runs the panels, and [`Session::draw`] draws a frame.

mod counters;
pub mod document;
pub mod execute;
mod going;
mod ground;
pub mod insight;
mod measuring;
pub mod motion;
pub mod panels;
pub mod paths;
pub mod section;
pub mod selection;
mod tubes;
pub mod view;

use crate::building::Building;
use crate::colours::Tints;
use crate::culling::Decision;
use crate::doors::swings::swings;
use crate::draw::alarm::Missed;
use crate::draw::frame::{FrameRequest, Painter};
use crate::draw::interface::Interface;
use crate::draw::lines::Overlay;
use crate::draw::marks::Marking;
use crate::draw::renderer::Renderer;
use crate::draw::split::Split;
use crate::draw::targets::Canvas;
use crate::keymap::KeyMap;
use crate::looks::Detail;
use crate::measure::Measure;
use crate::opening::Share;
use crate::overlays;
use crate::settings::{LastPlace, Preferences, Settings};
use crate::start::start;
use crate::ui::Panels;
use crate::ui::graphs::Sample;
use crate::walker::Walker;
use document::Document;
use enfilade::runtime::{Camera, Mirror};
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::picture::Picture;
use glam::{DVec2, DVec3};
use insight::Insight;
use motion::Motion;
use paths::Paths;
use section::Cut;
use selection::Selection;
use std::path::PathBuf;
use std::time::Instant;
use view::ViewSettings;
use wgpu::{TextureFormat, TextureView};

/// A normal with a larger cosine with the vertical than this is a floor's or a ceiling's.
const LEVEL: f64 = 0.9;
/// Doors are opened from this far at most, metres.
const REACH: f64 = 4.0;
/// A surface this far before a door's portals, metres, belongs to the door: its leaf, its frame.
const WALL: f64 = 0.6;
/// Width and height of a mirror, metres.
const MIRROR: [f32; 2] = [1.2, 1.8];
/// Seconds that a line stays on the screen.
const NOTE: f64 = 5.0;

/// A visit to a building.
pub struct Session<'b> {
    /// The building.
    pub document: Document<'b>,
    /// Draws it, and holds the state of its doors.
    pub renderer: Renderer<'b>,
    /// The walker, the camera and paths.
    pub motion: Motion,
    /// Picked and found objects.
    pub selection: Selection,
    /// View settings.
    pub view: ViewSettings,
    /// Preferences and keys of the person.
    pub user: User,
    /// State of the tools that explain the culling.
    pub insight: Insight<'b>,
    /// The section.
    pub section: Cut,
    /// Lengths.
    pub measure: Measure,
    /// State of panels.
    pub panels: Panels,
    /// Paints the panels.
    pub interface: Interface,
    /// Requests to the window.
    pub window: WindowRequests,
    /// Progress of a bake in the background.
    pub opening: Option<Share>,
    overlay: Overlay,
    /// A line at the bottom, and the seconds until it goes.
    note: Option<(String, f64)>,
    times: Times,
}

/// Preferences and keys of the person.
#[derive(Clone, Default)]
pub struct User {
    /// Speed, sensitivity, units, text.
    pub preferences: Preferences,
    /// Which key does what.
    pub keys: KeyMap,
}

/// Requests to the window.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct WindowRequests {
    /// Full screen, or a window again.
    pub full_screen: bool,
    /// Shut it.
    pub quit: bool,
    /// Open a dialog to choose another file.
    pub open: bool,
}

/// Milliseconds of the last frame.
#[derive(Default)]
struct Times {
    /// From frame to frame.
    frame_ms: f64,
    /// Of the processor, without culling.
    rest_ms: f64,
}

/// State that a session hands to the next one, when more is known of the building.
pub struct Ongoing {
    view: ViewSettings,
    paths: Paths,
    window: WindowRequests,
    note: Option<(String, f64)>,
    section: Cut,
    measure: Measure,
}

impl<'b> Session<'b> {
    /// The walker has no place yet: see [`Session::begin`] and [`Session::stand`].
    pub fn new(building: &'b Building, renderer: Renderer<'b>) -> Self {
        let mut session = Self {
            document: Document::new(building, &renderer.doors),
            interface: Interface::new(&renderer.gpu, renderer.format),
            panels: Panels::new(building),
            motion: Motion::default(),
            selection: Selection::default(),
            view: ViewSettings::default(),
            user: User::default(),
            insight: Insight::default(),
            section: Cut::default(),
            measure: Measure::default(),
            window: WindowRequests::default(),
            opening: None,
            overlay: Overlay::default(),
            note: None,
            times: Times::default(),
            renderer,
        };
        session.panels.plan.swings = swings(&session.renderer.doors);
        session.paint();
        session
    }

    /// Pictures are of another size from now on.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.renderer.resize(size);
    }

    /// Of pictures, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.renderer.targets.size
    }

    /// Applies settings of an earlier visit.
    pub fn apply(&mut self, settings: &Settings) {
        let &Settings { detail, tints, layers, fov_y_degrees, flies, preferences, .. } = settings;
        // By default, edges are smooth where that costs little.
        let usual = if self.renderer.gpu.is_software { Detail::Full } else { Detail::Smooth };
        let detail = detail.unwrap_or(usual);
        (self.view.detail, self.view.tints, self.view.layers) = (detail, tints, layers);
        self.view.fov_y = fov_y_degrees.to_radians();
        self.user = User { preferences, keys: settings.keys.clone() };
        self.motion.walker.flies = flies;
        self.apply_tubes(settings.tubes);
        self.paint();
    }

    /// Puts settings and the walker's place into the settings of the next visit.
    pub fn remember(&self, settings: &mut Settings) {
        let ViewSettings { mode, detail, tints, layers, fov_y, .. } = self.view;
        // A visit that ends with a frozen culling goes on where that was frozen.
        let walker = self.motion.frozen.map_or(self.motion.walker, |frozen| frozen.1);
        settings.mode = mode.name().to_owned();
        settings.detail = Some(detail);
        settings.tints = if tints.is_lasting() { tints } else { Tints::Roles };
        settings.layers = layers;
        settings.flies = self.motion.flies_by_itself(&walker);
        settings.size = self.size();
        settings.fov_y_degrees = fov_y.to_degrees();
        settings.preferences = self.user.preferences;
        settings.keys = self.user.keys.clone();
        settings.tubes = self.kept_tubes(settings);
        settings.leave(self.document.building.file.model_hash, walker.eye.to_array(), walker.yaw, walker.pitch);
    }

    /// Stands where a visit begins: at the last place, if that is in the model.
    pub fn begin(&mut self, last: Option<&LastPlace>) {
        let building = self.document.building;
        let last = last.and_then(|last| last.walker(&building.scene.bounds()));
        self.motion.walker = last.unwrap_or_else(|| {
            let (eye, along) = start(building, &self.document.solid);
            Walker::new(eye, along, false)
        });
    }

    /// Stands at a frame of a path, flying.
    pub fn stand(&mut self, path: &CameraPath, frame: usize) {
        let at = path.frames[frame];
        self.motion.walker = Walker::new(at.eye - self.document.building.file.origin, at.target - at.eye, true);
        self.view.fov_y = path.fov_y_degrees.to_radians();
    }

    /// Hands over what the next session goes on with.
    pub fn ongoing(&mut self) -> Ongoing {
        let (paths, note) = (std::mem::take(&mut self.motion.paths), self.note.take());
        let (section, measure) = (self.section, std::mem::take(&mut self.measure));
        Ongoing { view: self.view.clone(), paths, window: self.window, note, section, measure }
    }

    /// Goes on with it.
    pub fn go_on(&mut self, Ongoing { view, paths, window, note, section, measure }: Ongoing) {
        (self.section, self.measure, self.motion.paths) = (section, measure, paths);
        (self.view, self.window, self.note) = (view, window, note);
        // A profile belongs to the session before.
        if matches!(self.view.tints, Tints::Seen | Tints::InVain) {
            self.view.tints = Tints::Roles;
        }
        self.paint();
    }

    /// Shows a line for a moment.
    pub fn tell(&mut self, line: String) {
        self.note = Some((line, NOTE));
    }

    pub(crate) fn tell_saved(&mut self, saved: Result<PathBuf, String>) {
        self.tell(saved.map_or_else(|e| format!("not saved: {e}"), |path| format!("saved: {}", path.display())));
    }

    /// Draws a frame on `picture`. Returns requests of the panels to the window.
    ///
    /// # Errors
    ///
    /// One line: the device has failed.
    pub fn draw(
        &mut self,
        picture: &TextureView,
        input: egui::RawInput,
        seconds: f64,
    ) -> Result<egui::PlatformOutput, String> {
        let start = Instant::now();
        let camera = self.camera();
        self.motion.leave_trail();
        self.note = self.note.take().map(|(line, left)| (line, left - seconds)).filter(|(_, left)| *left > 0.0);
        self.go_on_with_profile()?;
        self.lay_over();
        let output = self.run_panels(input);
        self.picture(picture, camera, true)?;
        self.times.frame_ms = seconds * 1e3;
        if let Some(last) = &self.renderer.culling.last {
            let (objects, queries) = (last.stats.objects as f64, last.stats.queries as f64);
            let device = self.renderer.readback.device_ms.unwrap_or(0.0);
            self.times.rest_ms = (start.elapsed().as_secs_f64() * 1e3 - last.ms).max(0.0);
            let values = [self.renderer.triangles() as f64, objects, last.ms, self.times.rest_ms, device, queries];
            self.panels.graphs.add(Sample { values });
        }
        Ok(output)
    }

    /// Draws what `camera` sees, the overlay, and the panels.
    fn picture(&mut self, picture: &TextureView, camera: Camera, has_panels: bool) -> Result<(), String> {
        self.renderer.set_section(self.section());
        self.renderer.set_people(self.view.people);
        let detail = if self.view.tints == Tints::Roles { self.view.detail } else { Detail::Plain };
        self.renderer.set_detail(detail)?;
        self.renderer.shows_culled = self.is_frozen() && self.view.culled;
        let marking = if self.view.tints == Tints::Waste { Marking::Coloured } else { Marking::Off };
        // 1. A frozen frame stays as it was decided, until another mode is chosen.
        let culls_again = std::mem::take(&mut self.insight.culls_again) || self.renderer.culling.last.is_none();
        let frozen = self.motion.frozen.map(|frozen| frozen.0);
        if let Some(frozen) = frozen.filter(|_| culls_again) {
            self.draw_other(frozen, Some(frozen), marking)?;
            self.renderer.set_marking(marking)?;
            let again = FrameRequest { overlay: &self.overlay, ..FrameRequest::new(frozen, self.mode()) };
            self.renderer.frame(again, picture, None).map_err(|e| e.to_string())?;
        }
        // 2. The other half, then the picture.
        let culled_by = if frozen.is_some() { None } else { Some(camera) };
        self.draw_other(camera, culled_by, marking)?;
        self.renderer.set_marking(marking)?;
        let request = FrameRequest {
            camera,
            culled_by,
            mode: self.mode(),
            alarm: self.view.layers.alarm,
            timed: true,
            overlay: &self.overlay,
            // Mirrors would show what the section cuts away.
            mirrors: !self.section.is_on,
        };
        let mut half = self.insight.split.as_ref().and_then(Split::half);
        let painter = has_panels.then_some(&mut self.interface as &mut dyn Painter);
        let painter = match &mut half {
            Some(half) => {
                half.over = painter;
                Some(half as &mut dyn Painter)
            }
            None => painter,
        };
        self.renderer.frame(request, picture, painter).map_err(|e| e.to_string())
    }

    /// The picture on the screen without the panels.
    ///
    /// # Errors
    ///
    /// One line.
    pub fn screenshot(&mut self) -> Result<Picture, String> {
        let (gpu, format): (_, TextureFormat) = (&self.renderer.gpu, self.renderer.format);
        let canvas = Canvas::of_format(gpu, self.size(), format).ok_or_else(|| format!("no picture of {format:?}"))?;
        let camera = self.camera();
        self.picture(&canvas.view, camera, false)?;
        canvas.read(&self.renderer.gpu).map_err(|e| e.to_string())
    }

    pub(super) fn save_screenshot(&mut self) {
        let saved = self.screenshot().and_then(|picture| {
            self.document.output.save("png", &|to| picture.write_png(to).map_err(std::io::Error::other))
        });
        self.tell_saved(saved);
    }

    /// Missed pixels, in a line.
    pub fn say_missed(&self, missed: &Missed) -> String {
        let first = missed.objects.first().map(|&(object, pixels)| {
            let objects = &self.document.building.scene.objects;
            let other = if object.index() > objects.len() { "ground" } else { "a leaf that was made" };
            let node = objects.get(object.index()).map_or(other, |o| o.node.as_str());
            format!(": object {object} ({node}), {pixels} pixels, and {} more", missed.objects.len() - 1)
        });
        format!("missed pixels: {}{}", missed.pixels, first.unwrap_or_default())
    }

    /// Opens or shuts the door that a ray meets, if it is near. Returns whether it did.
    pub(crate) fn use_door(&mut self, at: DVec2) -> bool {
        let direction = self.camera().ray(at).normalize();
        let wall = self.ahead(at).map_or(REACH, |hit| (hit.t + WALL).min(REACH));
        let Some(door) = self.renderer.doors.aimed_at(self.motion.walker.eye, direction, wall) else { return false };
        self.open_or_shut(door);
        true
    }

    /// Opens a door, or shuts it.
    pub fn open_or_shut(&mut self, door: usize) {
        self.renderer.doors.use_door(door, self.motion.walker.eye);
        self.doors_changed();
    }

    /// Doors were opened, shut or moved.
    fn doors_changed(&mut self) {
        self.renderer.doors_changed();
        self.document.doors_changed(&self.renderer.doors);
        let doors = &self.renderer.doors;
        self.insight.split.iter_mut().for_each(|split| split.doors_changed(doors));
    }

    pub(crate) fn hang_mirror(&mut self) {
        let Some(hit) = self.ahead(DVec2::ZERO) else { return };
        // A leaf would leave without its mirror.
        if self.renderer.doors.is_leaf[hit.triangle as usize] {
            return;
        }
        let at = self.motion.walker.eye + self.camera().ray(DVec2::ZERO).normalize() * hit.t;
        let [a, b, c] = self.document.building.scene.corners(hit.triangle as usize);
        let n = (b - a).cross(c - a).normalize_or(DVec3::Z);
        let n = if n.dot(self.motion.walker.forward()) > 0.0 { -n } else { n };
        let up = if n.y.abs() > LEVEL { DVec3::Z } else { DVec3::Y };
        let right = up.cross(n).normalize();
        let (n, up, right) = (n.as_vec3(), n.cross(right).as_vec3(), right.as_vec3());
        let middle = at.as_vec3() + n * 0.02;
        let [w, h] = MIRROR.map(|s| s * 0.5);
        let corners = [-right * w - up * h, right * w - up * h, right * w + up * h, -right * w + up * h].map(|p| middle + p);
        let Some(cell) = self.renderer.culling.culler.cell_of(middle + n * 0.05) else { return };
        let Some(mirror) = Mirror::new(cell, &corners) else { return };
        let (mirrors, gpu, pipelines) = self.renderer.mirrors();
        if !mirrors.hang(gpu, pipelines, mirror, &corners) {
            mirrors.clear();
        }
    }

    /// Lines and faces of this frame, from what the last one decided; of both halves.
    fn lay_over(&mut self) {
        let mut overlay = std::mem::take(&mut self.overlay);
        self.mark(&mut overlay, self.renderer.culling.last.as_ref());
        self.overlay = overlay;
        if let Some(split) = &self.insight.split {
            let mut overlay = std::mem::take(&mut self.insight.overlay);
            self.mark(&mut overlay, split.side.culling.last.as_ref());
            self.insight.overlay = overlay;
        }
    }

    fn mark(&self, overlay: &mut Overlay, last: Option<&Decision>) {
        overlay.clear();
        let file = &self.document.building.file;
        if self.view.layers.portals {
            overlays::portals(overlay, file, last, &self.renderer.doors.shut);
        }
        if let (Some((camera, _)), Some(last)) = (&self.motion.frozen, last) {
            overlays::frusta(overlay, file, camera, last);
        }
        for (_, hit) in &self.selection.picked {
            overlays::object(overlay, file, hit.object);
        }
        self.selection.boxes.iter().for_each(|&bounds| overlays::selected(overlay, bounds));
        if let (Some(profile), Tints::Seen | Tints::InVain) = (&self.insight.profile, self.view.tints) {
            overlays::path(overlay, profile, file.origin);
        }
        if let Some([a, b]) = self.selection.sight() {
            overlays::sight(overlay, self.motion.walker.eye.as_vec3(), a.as_vec3(), b.as_vec3());
        }
        self.lay_tiles_over(overlay);
        self.lay_lengths_over(overlay);
    }
}
