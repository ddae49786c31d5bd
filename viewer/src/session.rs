//! What a person does in a building: walks, opens doors, freezes the culling, asks why. No window is needed for it.

mod counters;
mod finding;
mod going;
mod ground;
mod insight;
mod measuring;
mod rebinding;
pub mod section;
mod tools;
mod tubes;

use crate::args::Shown;
use crate::building::Building;
use crate::collision::{NOBODY, Solid};
use crate::colours::Tints;
use crate::culling::{Decision, MODES};
use crate::doors::swings::swings;
use crate::draw::alarm::Missed;
use crate::draw::frame::{Painter, Stage, Wish};
use crate::draw::lines::Overlay;
use crate::draw::marks::Marking;
use crate::draw::mirror::Mirrors;
use crate::draw::split::Split;
use crate::kept::Kept;
use crate::keymap::KeyMap;
use crate::looks::Detail;
use crate::measure::Measure;
use crate::mode::ViewMode;
use crate::opening::Share;
use crate::settings::{FIELD_OF_VIEW, LastPlace, Layers, Preferences, Settings};
use crate::start::rooms::Room;
use crate::start::start;
use crate::ui::find::{self, Find};
use crate::ui::graphs::{Graphs, Sample};
use crate::ui::keys::Action;
use crate::ui::matrix::Matrix;
use crate::ui::paint::Egui;
use crate::ui::plan::Plan;
use crate::ui::rebind::Rebind;
use crate::ui::{hud, keys, legend, marks, preferences, profile, toolbar};
use crate::walker::{Walker, Wants};
use crate::{explain, overlays, pick};
use enfilade::proof::{Asker, Goal};
use enfilade::runtime::{Camera, FrameMode, Mirror, Scratch};
use enfilade::scene::Role;
use enfilade::scene::rays::{Hit, RayScene};
use enfilade::{CellId, ObjectId};
use enfilade_measure::walkthrough::path::CameraPath;
use glam::{DVec2, DVec3, Vec3};
use std::cell::OnceCell;
use std::time::Instant;
use tools::{Asked, Paths};
use wgpu::{TextureFormat, TextureView};

/// A normal with a larger cosine with the vertical than this is a floor's or a ceiling's.
const LEVEL: f64 = 0.9;

/// How far doors are opened from, metres.
const REACH: f64 = 4.0;
/// A door is opened by what is so far before its portals, metres: its leaf, its frame.
const WALL: f64 = 0.6;
/// Width and height of a mirror, metres.
const MIRROR: [f32; 2] = [1.2, 1.8];
/// Steps of the walked way are this long, metres, and so many are kept.
const WAY: (f64, usize) = (0.25, 4000);

/// What is shown.
#[derive(Clone, Debug)]
pub struct Show {
    /// How frames are culled.
    pub mode: ViewMode,
    /// How the scene is drawn; cells' colours are always plain.
    pub detail: Detail,
    /// How it was drawn before it was plain.
    looks: Detail,
    /// Colours.
    pub tints: Tints,
    /// What lies over the picture.
    pub layers: Layers,
    /// While the culling is frozen, what it left out.
    pub culled: bool,
    /// Counters.
    pub hud: bool,
    /// The list of keys.
    pub keys: bool,
    /// The buttons.
    pub menu: bool,
    /// The settings.
    pub preferences: bool,
    /// Whether to quit.
    pub question: bool,
    /// A cross in the middle, where keys aim.
    pub crosshair: bool,
    /// Vertical opening angle, radians.
    pub fov_y: f64,
}

impl Show {
    /// Whether something lies over the picture; `None` for what isn't shown or not, but done.
    fn layer(&mut self, shown: Shown) -> Option<&mut bool> {
        match shown {
            Shown::Portals => Some(&mut self.layers.portals),
            Shown::Rectangles => Some(&mut self.layers.rectangles),
            Shown::Plan => Some(&mut self.layers.plan),
            Shown::Matrix => Some(&mut self.layers.matrix),
            Shown::Graphs => Some(&mut self.layers.graphs),
            Shown::Keys => Some(&mut self.keys),
            Shown::Names => Some(&mut self.layers.names),
            Shown::Cells | Shown::Mirror | Shown::Why | Shown::Section => None,
            Shown::Waste | Shown::Split | Shown::Profile | Shown::Heat => None,
            Shown::Ground | Shown::Tubes => None,
        }
    }
}

/// A person in a building.
pub struct Session<'b> {
    /// What draws.
    pub stage: Stage<'b>,
    /// What is shown.
    pub show: Show,
    /// Who walks.
    pub walker: Walker,
    /// The interface.
    pub egui: Egui,
    /// How a person likes to walk and to read.
    pub preferences: Preferences,
    /// Which key does what.
    pub keys: KeyMap,
    /// Which of them is being changed.
    pub rebind: Rebind,
    /// Where pictures and paths go.
    pub kept: Kept,
    /// A path is recorded or played.
    pub paths: Paths,
    /// What a window is asked for by a button.
    pub asked: Asked,
    /// How far the bake is that is still to come.
    pub opening: Option<Share>,
    /// The plan.
    pub plan: Plan,
    /// The window to find things in.
    pub find: Find,
    /// What explains the culling.
    pub insight: insight::Insight<'b>,
    /// Lengths.
    pub measure: Measure,
    building: &'b Building,
    format: TextureFormat,
    size: [u32; 2],
    solid: Solid<'b>,
    overlay: Overlay,
    mirrors: Mirrors,
    scratch: Scratch,
    matrix: Matrix,
    graphs: Graphs,
    way: Vec<DVec3>,
    /// The camera that culls, and who walks on from there.
    frozen: Option<(Camera, Walker)>,
    /// Made when they are first needed.
    rooms: OnceCell<Vec<Room>>,
    rays: Option<RayScene<'b>>,
    asker: Option<Asker<'b>>,
    picked: Vec<(CellId, Hit)>,
    selected: finding::Selected,
    cut: section::Cut,
    pair: Option<(CellId, CellId)>,
    told: Option<explain::Told>,
    /// A line at the bottom, and for how many seconds yet.
    note: Option<(String, f64)>,
    frame_ms: f64,
    /// The processor's milliseconds of the last frame, without culling.
    rest_ms: f64,
}

impl<'b> Session<'b> {
    /// Nobody has gone anywhere yet: see [`Session::begin`] and [`Session::stand`]. Pictures are of `size` pixels and `format`.
    pub fn new(building: &'b Building, stage: Stage<'b>, format: TextureFormat, size: [u32; 2]) -> Result<Self, String> {
        let show = Show {
            mode: FrameMode::Auto.into(),
            detail: Detail::Plain,
            looks: Detail::Full,
            tints: Tints::default(),
            layers: Layers::NONE,
            culled: true,
            hud: true,
            keys: false,
            menu: false,
            preferences: false,
            question: false,
            crosshair: false,
            fov_y: FIELD_OF_VIEW.usual.to_radians(),
        };
        let mut session = Self {
            egui: Egui::new(&stage.gpu, format),
            mirrors: Mirrors::new(&stage.gpu, &stage.pipelines, &stage.culling.culler, format),
            scratch: Scratch::for_culler(&stage.culling.culler),
            solid: Solid::without(&building.scene, &|t| stage.doors.is_leaf[t]),
            plan: Plan::new(&building.file),
            matrix: Matrix::new(&building.file),
            walker: Walker::new(DVec3::ZERO, DVec3::NEG_Z, false),
            opening: None,
            overlay: Overlay::default(),
            graphs: Graphs::default(),
            way: Vec::new(),
            frozen: None,
            rooms: OnceCell::new(),
            rays: None,
            asker: None,
            picked: Vec::new(),
            selected: Default::default(),
            find: Find::default(),
            insight: Default::default(),
            measure: Measure::default(),
            cut: section::Cut::default(),
            pair: None,
            told: None,
            preferences: Preferences::default(),
            keys: KeyMap::default(),
            rebind: Rebind::default(),
            kept: Kept::here(&building.scene.name),
            paths: Paths::default(),
            asked: Asked::default(),
            note: None,
            frame_ms: 0.0,
            rest_ms: 0.0,
            building,
            format,
            size,
            show,
            stage,
        };
        session.plan.swings = swings(&session.stage.doors);
        session.paint();
        session.solid.put_in_the_way(&session.stage.doors.blocks());
        Ok(session)
    }

    /// Pictures are of another size from now on.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.size = size;
        self.stage.resize(size);
    }

    /// Of pictures, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Shows what was shown when somebody was here last.
    pub fn apply(&mut self, settings: &Settings) {
        let &Settings { detail, tints, layers, fov_y_degrees, flies, preferences, .. } = settings;
        // Whoever has not said has smooth edges where they cost little.
        let usual = if self.stage.gpu.is_software { Detail::Full } else { Detail::Smooth };
        let detail = detail.unwrap_or(usual);
        self.show = Show { detail, tints, layers, fov_y: fov_y_degrees.to_radians(), ..self.show.clone() };
        self.preferences = preferences;
        self.keys = settings.keys.clone();
        self.walker.flies = flies;
        self.apply_tubes(settings.tubes);
        self.paint();
    }

    /// Keeps that for the next time, and where somebody is.
    pub fn remember(&self, settings: &mut Settings) {
        let Show { mode, detail, tints, layers, fov_y, .. } = self.show;
        // Who looks at a frozen culling goes back to where that was.
        let walker = self.frozen.map_or(self.walker, |frozen| frozen.1);
        let (flies, size, fov_y_degrees) = (self.flies_by_itself(&walker), self.size, fov_y.to_degrees());
        let (mode, places) = (mode.name().to_owned(), std::mem::take(&mut settings.places));
        let (recent, keys) = (std::mem::take(&mut settings.recent), self.keys.clone());
        let (preferences, tubes) = (self.preferences, self.kept_tubes(settings));
        let tints = if tints.is_lasting() { tints } else { Tints::Roles };
        let detail = Some(detail);
        let shown = Settings { mode, detail, tints, layers, flies, size, fov_y_degrees, ..Settings::default() };
        *settings = Settings { preferences, tubes, places, recent, keys, ..shown };
        settings.leave(self.building.file.model_hash, walker.eye.to_array(), walker.yaw, walker.pitch);
    }

    /// Stands where a visit begins: where somebody was last, if that is in the model still.
    pub fn begin(&mut self, last: Option<&LastPlace>) {
        let last = last.and_then(|last| last.walker(&self.building.scene.bounds()));
        self.walker = last.unwrap_or_else(|| {
            let (eye, along) = start(self.building, &self.solid);
            Walker::new(eye, along, false)
        });
    }

    /// Stands where a frame of a path does, without weight.
    pub fn stand(&mut self, path: &CameraPath, frame: usize) {
        let at = path.frames[frame];
        self.walker = Walker::new(at.eye - self.building.file.origin, at.target - at.eye, true);
        self.show.fov_y = path.fov_y_degrees.to_radians();
    }

    /// Walks on for `seconds`.
    pub fn go(&mut self, seconds: f64, wants: &Wants) {
        // 1. Doors: nobody is shut in one.
        let walks = (!self.walker.flies).then_some(self.walker.eye);
        if self.stage.doors.step(seconds, walks) {
            self.doors_changed();
        }
        // 2. Who goes along a path, or walks.
        if !self.fly_on(seconds) && !self.play(seconds) {
            self.walk(seconds, wants);
        }
        self.record(seconds);
    }

    fn walk(&mut self, seconds: f64, wants: &Wants) {
        self.walker.speed = self.preferences.speed;
        let (scene, doors) = (&self.building.scene, &self.stage.doors);
        // A door that hangs in no portal can't be opened: it is gone through.
        let passes = |o: ObjectId| o != NOBODY && scene.objects[o.index()].role == Role::Door && !doors.is_hung[o.index()];
        // Who stands still and holds on isn't moved by a long frame.
        let (terrain, origin) = (&self.stage.terrain, self.building.file.origin);
        let ground = |p: DVec3| terrain.as_ref().and_then(|terrain| terrain.land.height(p, origin));
        self.walker.go(seconds.min(0.1), wants, &self.solid, &passes, &ground);
    }

    /// What the walker sees.
    pub fn camera(&self) -> Camera {
        self.walker.camera(self.show.fov_y, f64::from(self.size[0]) / f64::from(self.size[1]))
    }

    /// Does what a key does.
    pub fn act(&mut self, action: Action) {
        let show = &mut self.show;
        match action {
            Action::Mode(mode) => {
                show.mode = MODES[mode].into();
                self.insight.culls_again = true;
            }
            Action::OtherMode(mode) => self.set_other_mode(MODES[mode].into()),
            Action::Split => self.split_or_join(),
            Action::Culled => show.culled ^= true,
            Action::Waste => self.tint(Tints::Waste),
            Action::Profile => self.profile_or_hide(),
            Action::Heat => self.turn_heat(),
            Action::Freeze => match self.frozen.take() {
                Some((_, walker)) => self.walker = walker,
                None => self.freeze(),
            },
            Action::Cells => self.tint(Tints::Cells),
            Action::Detail => {
                // Back to what it was, full or smooth.
                show.detail = match show.detail {
                    Detail::Plain => std::mem::take(&mut show.looks),
                    detail => {
                        show.looks = detail;
                        Detail::Plain
                    }
                };
            }
            Action::Layer(shown) => {
                if let Some(layer) = show.layer(shown) {
                    *layer ^= true;
                }
            }
            Action::Alarm => show.layers.alarm ^= true,
            Action::Hud => show.hud ^= true,
            Action::Fly => self.walker.flies ^= true,
            Action::Door => drop(self.use_door(DVec2::ZERO)),
            Action::Mirror => self.hang_mirror(),
            Action::Pick => self.pick(DVec2::ZERO),
            Action::Menu => show.menu ^= true,
            Action::Preferences => self.turn_settings(),
            Action::Screenshot => self.save_screenshot(),
            Action::Record => self.record_or_stop(),
            Action::Play => self.play_or_stop(),
            Action::FullScreen => self.asked.full_screen = true,
            Action::Storey(up) => self.turn_storey(up),
            Action::Find => self.find.toggle(),
            Action::Hide => self.hide(false),
            Action::Isolate => self.hide(true),
            Action::ShowAll => self.show_all(),
            Action::SavePlan => self.save_shown_plan(),
            Action::Section => self.toggle_section(),
            Action::TurnSection => self.turn_section(),
            Action::Measure => self.toggle_measuring(),
            Action::Open => self.asked.open = true,
            Action::Ground => self.toggle_ground(),
            Action::Tubes => self.toggle_tubes(),
        }
    }

    /// Shows something that the command line names.
    pub fn show_this(&mut self, shown: Shown) {
        match shown {
            Shown::Cells => self.act(Action::Cells),
            Shown::Mirror => self.hang_mirror(),
            Shown::Waste => self.act(Action::Waste),
            Shown::Split => self.act(Action::Split),
            Shown::Profile | Shown::Heat => {
                self.insight.shows_profile |= shown == Shown::Profile;
                if shown == Shown::Heat {
                    self.turn_heat();
                }
            }
            Shown::Section => self.set_section(false),
            Shown::Ground => self.toggle_ground(),
            Shown::Tubes => self.toggle_tubes(),
            Shown::Why => {
                let home = self.stage.culling.culler.cell_of(self.walker.eye.as_vec3(), &mut self.scratch);
                if let (Some(home), Some(hit)) = (home, self.ahead(DVec2::ZERO)) {
                    self.picked = vec![(home, hit)];
                    self.select(hit.object, home);
                    self.ask(home, Goal::Object(hit.object));
                }
            }
            layer => {
                if let Some(is_shown) = self.show.layer(layer) {
                    *is_shown = true;
                }
            }
        }
    }

    /// A click on a point of the screen (normalised device coordinates): a point to measure, a door, or something to pick.
    pub fn click(&mut self, at: DVec2) {
        if self.measure.is_on {
            self.measure_at(at);
        } else if !self.use_door(at) {
            self.pick(at);
        }
    }

    /// Leaves the culling as it is, and flies.
    pub fn freeze(&mut self) {
        self.frozen = Some((self.camera(), self.walker));
        self.walker.flies = true;
    }

    /// Whether the culling stands still.
    pub fn is_frozen(&self) -> bool {
        self.frozen.is_some()
    }

    /// Draws a frame on `picture`. Returns what the interface wants of a window.
    pub fn draw(
        &mut self,
        picture: &TextureView,
        input: egui::RawInput,
        seconds: f64,
    ) -> Result<egui::PlatformOutput, String> {
        let start = Instant::now();
        let camera = self.camera();
        if self.frozen.is_none() && self.way.last().is_none_or(|last| last.distance(self.walker.eye) > WAY.0) {
            self.way.push(self.walker.eye);
            let more = self.way.len().saturating_sub(WAY.1);
            self.way.drain(..more);
        }
        self.note = self.note.take().map(|(line, left)| (line, left - seconds)).filter(|(_, left)| *left > 0.0);
        self.go_on_with_profile()?;
        self.lay_over();
        let output = self.panels(input);
        self.picture(picture, camera, true)?;
        self.frame_ms = seconds * 1e3;
        if let Some(last) = &self.stage.culling.last {
            let (objects, queries) = (last.stats.objects as f64, last.stats.queries as f64);
            let device = self.stage.heard.device_ms.unwrap_or(0.0);
            self.rest_ms = (start.elapsed().as_secs_f64() * 1e3 - last.ms).max(0.0);
            let values = [self.stage.triangles() as f64, objects, last.ms, self.rest_ms, device, queries];
            self.graphs.add(Sample { values });
        }
        Ok(output)
    }

    /// Draws what `camera` sees, what lies over it, and the panels.
    fn picture(&mut self, picture: &TextureView, camera: Camera, has_panels: bool) -> Result<(), String> {
        self.stage.set_section(self.section());
        if !self.mirrors.is_empty() {
            self.mirrors.look(&self.stage.culling.culler, &camera, &mut self.scratch);
        }
        let detail = if self.show.tints == Tints::Roles { self.show.detail } else { Detail::Plain };
        self.stage.set_detail(detail)?;
        self.stage.shows_culled = self.frozen.is_some() && self.show.culled;
        let marking = if self.show.tints == Tints::Waste { Marking::Coloured } else { Marking::Off };
        // 1. A frozen frame stays as it was decided, until another mode is asked for.
        let culls_again = std::mem::take(&mut self.insight.culls_again) || self.stage.culling.last.is_none();
        let frozen = self.frozen.map(|frozen| frozen.0);
        if let Some(frozen) = frozen.filter(|_| culls_again) {
            self.draw_other(frozen, Some(frozen), marking)?;
            self.stage.set_marking(marking)?;
            let (mode, overlay) = (self.mode(), &self.overlay);
            let again =
                Wish { camera: frozen, culled_by: Some(frozen), mode, alarm: false, timed: false, overlay, mirrors: None };
            self.stage.frame(again, picture, None).map_err(|e| e.to_string())?;
        }
        // 2. The other half, then the picture.
        let culled_by = if frozen.is_some() { None } else { Some(camera) };
        self.draw_other(camera, culled_by, marking)?;
        self.stage.set_marking(marking)?;
        let wish = Wish {
            camera,
            culled_by,
            mode: self.mode(),
            alarm: self.show.layers.alarm,
            timed: true,
            overlay: &self.overlay,
            // They show what the section cuts away.
            mirrors: Some(&mut self.mirrors).filter(|_| !self.cut.is_on),
        };
        let mut half = self.insight.split.as_ref().and_then(Split::half);
        let painter = has_panels.then_some(&mut self.egui as &mut dyn Painter);
        let painter = match &mut half {
            Some(half) => {
                half.over = painter;
                Some(half as &mut dyn Painter)
            }
            None => painter,
        };
        self.stage.frame(wish, picture, painter).map_err(|e| e.to_string())
    }

    /// What was missed, in a line.
    pub fn say_missed(&self, missed: &Missed) -> String {
        let first = missed.objects.first().map(|&(object, pixels)| {
            let objects = &self.building.scene.objects;
            let other = if object.index() > objects.len() { "ground" } else { "a leaf that was made" };
            let node = objects.get(object.index()).map_or(other, |o| o.node.as_str());
            format!(": object {object} ({node}), {pixels} pixels, and {} more", missed.objects.len() - 1)
        });
        format!("missed pixels: {}{}", missed.pixels, first.unwrap_or_default())
    }

    /// Opens or shuts the door that a ray meets, if it is near. Returns whether it did.
    fn use_door(&mut self, at: DVec2) -> bool {
        let direction = self.camera().ray(at).normalize();
        let wall = self.ahead(at).map_or(REACH, |hit| (hit.t + WALL).min(REACH));
        let Some(door) = self.stage.doors.aimed_at(self.walker.eye, direction, wall) else { return false };
        self.open_or_shut(door);
        true
    }

    /// Opens a door, or shuts it.
    pub fn open_or_shut(&mut self, door: usize) {
        self.stage.doors.use_door(door, self.walker.eye);
        self.doors_changed();
    }

    /// Doors were opened, shut or moved.
    fn doors_changed(&mut self) {
        self.stage.doors_changed();
        self.solid.put_in_the_way(&self.stage.doors.blocks());
        let doors = &self.stage.doors;
        self.insight.split.iter_mut().for_each(|split| split.doors_changed(doors));
    }

    /// Picks what a ray meets; the second picked thing is asked about from where the first is.
    fn pick(&mut self, at: DVec2) {
        let Some(hit) = self.ahead(at) else {
            // Nothing is ahead: nothing is picked any more.
            self.picked.clear();
            (self.told, self.selected) = (None, Default::default());
            return;
        };
        // A little before the surface is in the cell that it is seen from.
        let place = self.walker.eye + self.camera().ray(at).normalize() * (hit.t - 0.02).max(0.0);
        let Some(cell) = self.stage.culling.culler.cell_of(place.as_vec3(), &mut self.scratch) else { return };
        if self.picked.len() == 2 {
            self.picked.clear();
            self.told = None;
        }
        self.picked.push((cell, hit));
        self.select(hit.object, cell);
        if let [(cell, _), (_, hit)] = self.picked[..] {
            self.ask(cell, Goal::Object(hit.object));
        }
    }

    fn ask(&mut self, cell: CellId, goal: Goal) {
        let (building, units) = (self.building, self.preferences.units);
        if self.asker.is_none() {
            self.asker = Asker::new(&building.file, Some(&building.scene)).ok();
        }
        self.told = self.asker.as_ref().map(|asker| explain::tell(asker, &building.file, cell, goal, units));
    }

    /// What a ray meets; leaves are met where they are now, and nothing is where a leaf was made.
    fn ahead(&mut self, at: DVec2) -> Option<Hit> {
        let direction = self.camera().ray(at).normalize();
        let rays = self.rays.get_or_insert_with(|| RayScene::new(&self.building.scene));
        let (eye, stage) = (self.walker.eye, &self.stage);
        let wall = pick::pick(rays, eye, direction, &|hit| {
            let is_passed = stage.is_ghost[hit.object.index()] || stage.doors.is_leaf[hit.triangle as usize];
            is_passed || stage.is_hidden(hit.object) || stage.is_cut_away(eye + direction * hit.t)
        });
        match stage.doors.first_leaf(eye, direction, &|door| stage.is_door_hidden(door)) {
            Some((t, of)) if wall.is_none_or(|wall| t < wall.t) && !stage.is_cut_away(eye + direction * t) => {
                of.map(|(object, triangle)| Hit { t, object, triangle })
            }
            _ => wall,
        }
    }

    fn hang_mirror(&mut self) {
        let Some(hit) = self.ahead(DVec2::ZERO) else { return };
        // A leaf would leave without its mirror.
        if self.stage.doors.is_leaf[hit.triangle as usize] {
            return;
        }
        let at = self.walker.eye + self.camera().ray(DVec2::ZERO).normalize() * hit.t;
        let [a, b, c] = self.building.scene.corners(hit.triangle as usize);
        let n = (b - a).cross(c - a).normalize_or(DVec3::Z);
        let n = if n.dot(self.walker.forward()) > 0.0 { -n } else { n };
        let up = if n.y.abs() > LEVEL { DVec3::Z } else { DVec3::Y };
        let right = up.cross(n).normalize();
        let (n, up, right) = (n.as_vec3(), n.cross(right).as_vec3(), right.as_vec3());
        let middle = at.as_vec3() + n * 0.02;
        let [w, h] = MIRROR.map(|s| s * 0.5);
        let corners = [-right * w - up * h, right * w - up * h, right * w + up * h, -right * w + up * h].map(|p| middle + p);
        let Some(cell) = self.stage.culling.culler.cell_of(middle + n * 0.05, &mut self.scratch) else { return };
        let Some(mirror) = Mirror::new(cell, &corners) else { return };
        if !self.mirrors.hang(&self.stage.gpu, &self.stage.pipelines, mirror, &corners) {
            self.mirrors.clear();
        }
    }

    /// Lines and faces of this frame, from what the last one decided; of both halves.
    fn lay_over(&mut self) {
        let mut overlay = std::mem::take(&mut self.overlay);
        self.mark(&mut overlay, self.stage.culling.last.as_ref());
        self.overlay = overlay;
        if let Some(split) = &self.insight.split {
            let mut overlay = std::mem::take(&mut self.insight.overlay);
            self.mark(&mut overlay, split.side.culling.last.as_ref());
            self.insight.overlay = overlay;
        }
    }

    fn mark(&self, overlay: &mut Overlay, last: Option<&Decision>) {
        overlay.clear();
        let file = &self.building.file;
        if self.show.layers.portals {
            overlays::portals(overlay, file, last, &self.stage.doors.shut);
        }
        if let (Some((camera, _)), Some(last)) = (&self.frozen, last) {
            overlays::frusta(overlay, file, camera, last);
        }
        for (_, hit) in &self.picked {
            overlays::object(overlay, file, hit.object);
        }
        self.selected.boxes.iter().for_each(|&bounds| overlays::selected(overlay, bounds));
        if let (Some(profile), Tints::Seen | Tints::InVain) = (&self.insight.profile, self.show.tints) {
            overlays::path(overlay, profile, file.origin);
        }
        if let Some([a, b]) = self.sight() {
            overlays::sight(overlay, self.walker.eye.as_vec3(), a.as_vec3(), b.as_vec3());
        }
        self.lay_tiles_over(overlay);
        self.lay_lengths_over(overlay);
    }

    #[expect(clippy::too_many_lines, reason = "to be panels that return commands")]
    fn panels(&mut self, mut input: egui::RawInput) -> egui::PlatformOutput {
        if input.screen_rect.is_none() {
            let [width, height] = self.size.map(|s| s as f32 / self.preferences.text as f32);
            input.screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(width, height)));
        }
        let lines = self.lines();
        let last = self.stage.culling.last.as_ref();
        let (home, cells) = last.map_or((None, &[][..]), |d| (d.home, &d.cells[..]));
        let home = home.or(self.stage.culling.culler.cell_of(self.walker.eye.as_vec3(), &mut self.scratch));
        // A row is what modes without portals see.
        let row: Vec<CellId> = match home {
            Some(home) if cells.is_empty() => self.building.file.cells_seen(home).collect(),
            _ => cells.to_vec(),
        };
        let camera = self.frozen.map_or(self.camera(), |frozen| frozen.0);
        let sides = [-1.0, 1.0].map(|x| camera.ray(DVec2::new(x, 0.0))).map(|ray| DVec2::new(ray.x, ray.z));
        let (mut clicked, mut pressed, mut answer, size) = (None, None, None, self.size);
        let (mut wish, mut chosen, mut cuts, mut profiled, mut flies) = (None, None, None, None, false);
        let beside = self.lines_beside();
        let at = self.frame_of_profile();
        let kinds = self.stage.kinds().zip(self.stage.heard.marked.as_ref().map(|marked| marked.pixels));
        if self.show.layers.plan {
            self.rooms();
            self.plan.tell_in(self.preferences.units);
        }
        let marks = self.marks(&row);
        let on: Vec<Action> = keys::KEYS.iter().map(|key| key.2).filter(|&action| self.is_on(action)).collect();
        self.egui.context.set_zoom_factor(self.preferences.text as f32);
        let Self {
            show, preferences, note, plan, matrix, graphs, building, walker, way, told, pair, stage, opening, ..
        } = self;
        let Self { rooms, find, selected, insight, cut, keys, rebind, .. } = self;
        let is_frozen = self.frozen.is_some();
        let output = self.egui.run(input, size, |ui| {
            marks::show(ui, &marks, 1.0 / preferences.text);
            if show.layers.rectangles && !is_frozen {
                overlays::rectangles(ui, stage.culling.last.as_ref());
            }
            if show.crosshair {
                hud::crosshair(ui);
            }
            if show.hud {
                hud::show(ui, &lines, false);
            }
            if let Some(lines) = beside.as_ref().filter(|_| show.hud) {
                hud::show(ui, lines, true);
            }
            if let (Tints::Waste, Some((triangles, pixels))) = (show.tints, kinds) {
                legend::kinds(ui, triangles, pixels);
            }
            if let Some(made) = &insight.profile {
                legend::profile(ui, made, show.tints);
                if insight.shows_profile {
                    profiled = profiled.or(profile::show(ui, made, at));
                }
            }
            if show.menu {
                pressed = pressed.or(toolbar::open(ui, keys, &|action| on.contains(&action)));
            } else if show.hud {
                pressed = pressed.or(toolbar::closed(ui, keys));
            }
            if let Some(share) = opening {
                hud::meanwhile(ui, share);
            }
            if show.layers.plan {
                let rooms = rooms.get().map_or(&[][..], Vec::as_slice);
                wish = wish.or(plan.show(ui, &building.file, rooms, &row, walker.eye, sides, way));
            }
            if show.layers.matrix {
                clicked = clicked.or(matrix.show(ui, &building.file, home, *pair));
            }
            if show.layers.graphs {
                graphs.show(ui);
            }
            if show.keys {
                keys::show(ui, keys);
            }
            if show.preferences {
                preferences::show(ui, preferences, &mut show.fov_y, &mut show.detail, (&mut *keys, rebind));
            }
            if cut.is_on {
                cuts = cuts.or(cut.show(ui, building.file.origin.y));
            }
            if let Some(terrain) = stage.terrain.as_mut().filter(|terrain| terrain.land.shows_tiles) {
                ground::show(ui, terrain);
            }
            if let Some(pipes) = stage.pipes.as_mut().filter(|pipes| pipes.look.shows_sides) {
                tubes::show(ui, pipes, building.scene.tubes.sections.len());
            }
            if let Some((line, _)) = note {
                hud::note(ui, line);
            }
            if show.question {
                answer = answer.or(hud::question(ui, tools::QUESTION, &tools::ANSWERS));
            }
            if find.is_open {
                chosen = chosen.or(find.show(ui, building));
            }
            let facts = selected.facts(building, preferences.units);
            if !facts.is_empty() {
                find::tell(ui, keys, &facts, &selected.sheets);
            }
            if let Some(told) = told {
                let window = egui::Window::new("Why").anchor(egui::Align2::CENTER_BOTTOM, [0.0, -8.0]);
                window.collapsible(false).resizable(false).show(ui.ctx(), |ui| {
                    ui.set_max_width(460.0);
                    ui.label(&told.text);
                    flies |= told.sight.is_some() && ui.button("Fly along the line").clicked();
                });
            }
        });
        let cells = self.building.file.cells.len();
        if let Some((row, column)) = clicked.filter(|(a, b)| a.index() < cells && b.index() < cells) {
            self.pair = Some((row, column));
            self.picked.clear();
            self.ask(row, Goal::Cell(column));
        }
        pressed.into_iter().for_each(|action| self.act(action));
        answer.into_iter().for_each(|answer| self.answer(answer));
        if let Some(what) = chosen {
            self.go_to_found(what);
        }
        cuts.into_iter().for_each(|asked| self.do_section(asked));
        if let Some(wish) = wish {
            self.do_wish(wish);
        }
        profiled.into_iter().for_each(|wish| self.do_profile_wish(wish));
        if flies {
            self.fly_along_sight();
        }
        output
    }
}

/// The middle of some corners.
pub fn middle(corners: &[Vec3]) -> Vec3 {
    corners.iter().sum::<Vec3>() / corners.len().max(1) as f32
}
