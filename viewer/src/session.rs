//! What a person does in a building: walks, opens doors, freezes the culling, asks why. No window is needed for it.

mod finding;
mod going;
mod rebinding;
mod tools;

use crate::args::Shown;
use crate::building::Building;
use crate::collision::{NOBODY, Solid};
use crate::colours::{Tints, colours};
use crate::culling::MODES;
use crate::draw::alarm::Missed;
use crate::draw::frame::{Painter, Stage, Wish};
use crate::draw::lines::Overlay;
use crate::draw::mirror::Mirrors;
use crate::kept::Kept;
use crate::keymap::KeyMap;
use crate::looks::Detail;
use crate::opening::Share;
use crate::settings::{FIELD_OF_VIEW, LastPlace, Layers, Preferences, Settings};
use crate::start::rooms::Room;
use crate::start::start;
use crate::ui::find::{self, Find};
use crate::ui::graphs::{Graphs, Sample, number};
use crate::ui::keys::Action;
use crate::ui::matrix::Matrix;
use crate::ui::paint::Egui;
use crate::ui::plan::Plan;
use crate::ui::rebind::Rebind;
use crate::ui::{hud, keys, preferences, toolbar};
use crate::walker::{Walker, Wants};
use crate::{explain, overlays, pick};
use enfilade::proof::{Asker, Goal};
use enfilade::runtime::{Camera, FrameMode, Mirror, Scratch};
use enfilade::scene::Role;
use enfilade::scene::rays::{Hit, RayScene};
use enfilade::walkthrough::path::CameraPath;
use enfilade::{CellId, ObjectId};
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
    pub mode: FrameMode,
    /// How the scene is drawn; cells' colours are always plain.
    pub detail: Detail,
    /// Colours.
    pub tints: Tints,
    /// What lies over the picture.
    pub layers: Layers,
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
            Shown::Cells | Shown::Mirror | Shown::Why => None,
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
    pair: Option<(CellId, CellId)>,
    told: Option<explain::Told>,
    /// A line at the bottom, and for how many seconds yet.
    note: Option<(String, f64)>,
    frame_ms: f64,
}

impl<'b> Session<'b> {
    /// Nobody has gone anywhere yet: see [`Session::begin`] and [`Session::stand`]. Pictures are of `size` pixels and `format`.
    pub fn new(building: &'b Building, stage: Stage<'b>, format: TextureFormat, size: [u32; 2]) -> Result<Self, String> {
        let show = Show {
            mode: FrameMode::Auto,
            detail: Detail::Plain,
            tints: Tints::default(),
            layers: Layers::NONE,
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
            building,
            format,
            size,
            show,
            stage,
        };
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
        self.show = Show { detail, tints, layers, fov_y: fov_y_degrees.to_radians(), ..self.show.clone() };
        self.preferences = preferences;
        self.keys = settings.keys.clone();
        self.walker.flies = flies;
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
        let preferences = self.preferences;
        *settings = Settings { mode, detail, tints, layers, flies, size, fov_y_degrees, preferences, places, recent, keys };
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
        if !self.play(seconds) {
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
        self.walker.go(seconds.min(0.1), wants, &self.solid, &passes);
    }

    /// What the walker sees.
    pub fn camera(&self) -> Camera {
        self.walker.camera(self.show.fov_y, f64::from(self.size[0]) / f64::from(self.size[1]))
    }

    /// Does what a key does.
    pub fn act(&mut self, action: Action) {
        let show = &mut self.show;
        match action {
            Action::Mode(mode) => show.mode = MODES[mode],
            Action::Freeze => match self.frozen.take() {
                Some((_, walker)) => self.walker = walker,
                None => self.freeze(),
            },
            Action::Cells => {
                show.tints = if show.tints == Tints::Roles { Tints::Cells } else { Tints::Roles };
                self.paint();
            }
            Action::Detail => {
                show.detail = if show.detail == Detail::Plain { Detail::Full } else { Detail::Plain };
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
            Action::Open => self.asked.open = true,
        }
    }

    /// Shows something that the command line names.
    pub fn show_this(&mut self, shown: Shown) {
        match shown {
            Shown::Cells => self.act(Action::Cells),
            Shown::Mirror => self.hang_mirror(),
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

    /// A click on a point of the screen (normalised device coordinates): a door, or something to pick.
    pub fn click(&mut self, at: DVec2) {
        if !self.use_door(at) {
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
        self.lay_over();
        let output = self.panels(input);
        self.picture(picture, camera, true)?;
        // Where the device has no clock, whole frames are what is known.
        if !self.stage.has_clock() {
            let (frame, triangles) = (self.stage.frame, self.stage.triangles());
            self.stage.culling.frames.learn(frame, seconds * 1e3, triangles);
        }
        self.frame_ms = seconds * 1e3;
        if let Some(last) = &self.stage.culling.last {
            let (objects, queries) = (last.stats.objects as f64, last.stats.queries as f64);
            let device = self.stage.heard.device_ms.unwrap_or(0.0);
            let cpu = start.elapsed().as_secs_f64() * 1e3;
            self.graphs.add(Sample { values: [self.stage.triangles() as f64, objects, cpu, device, queries] });
        }
        Ok(output)
    }

    /// Draws what `camera` sees, what lies over it, and the panels.
    fn picture(&mut self, picture: &TextureView, camera: Camera, has_panels: bool) -> Result<(), String> {
        if !self.mirrors.is_empty() {
            self.mirrors.look(&self.stage.culling.culler, &camera, &mut self.scratch);
        }
        let detail = if self.show.tints == Tints::Cells { Detail::Plain } else { self.show.detail };
        self.stage.set_detail(detail)?;
        // The culling of the last frame is there from the first on.
        let culled_by = if self.frozen.is_some() && self.stage.culling.last.is_some() { None } else { Some(camera) };
        let wish = Wish {
            camera,
            culled_by,
            mode: self.show.mode,
            alarm: self.show.layers.alarm,
            timed: true,
            overlay: &self.overlay,
            mirrors: Some(&mut self.mirrors),
        };
        let painter = has_panels.then_some(&mut self.egui as &mut dyn Painter);
        self.stage.frame(wish, picture, painter).map_err(|e| e.to_string())
    }

    /// What was missed, in a line.
    pub fn say_missed(&self, missed: &Missed) -> String {
        let first = missed.objects.first().map(|&(object, pixels)| {
            let node = self.building.scene.objects.get(object.index()).map_or("a leaf that was made", |o| o.node.as_str());
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
            is_passed || stage.is_hidden(hit.object)
        });
        match stage.doors.first_leaf(eye, direction, &|door| stage.is_door_hidden(door)) {
            Some((t, of)) if wall.is_none_or(|wall| t < wall.t) => of.map(|(object, triangle)| Hit { t, object, triangle }),
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

    fn paint(&self) {
        self.stage.paint(colours(&self.building.scene, &self.building.file, self.show.tints));
    }

    /// Lines and faces of this frame, from what the last one decided.
    fn lay_over(&mut self) {
        self.overlay.clear();
        let file = &self.building.file;
        let last = self.stage.culling.last.as_ref();
        if self.show.layers.portals {
            overlays::portals(&mut self.overlay, file, last, &self.stage.doors.shut);
        }
        if let (Some((camera, _)), Some(last)) = (&self.frozen, last) {
            overlays::frusta(&mut self.overlay, file, camera, last);
        }
        for (_, hit) in &self.picked {
            overlays::object(&mut self.overlay, file, hit.object);
        }
        self.selected.boxes.iter().for_each(|&bounds| overlays::selected(&mut self.overlay, bounds));
        if let Some([a, b]) = self.told.as_ref().and_then(|told| told.sight) {
            self.overlay.line_through(a.as_vec3(), b.as_vec3(), overlays::SIGHT);
        }
    }

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
        let (mut wish, mut chosen) = (None, None);
        if self.show.layers.plan {
            self.rooms();
            self.plan.tell_in(self.preferences.units);
        }
        let on: Vec<Action> = keys::KEYS.iter().map(|key| key.2).filter(|&action| self.is_on(action)).collect();
        self.egui.context.set_zoom_factor(self.preferences.text as f32);
        let Self {
            show, preferences, note, plan, matrix, graphs, building, walker, way, told, pair, stage, opening, ..
        } = self;
        let Self { rooms, find, selected, keys, rebind, .. } = self;
        let is_frozen = self.frozen.is_some();
        let output = self.egui.run(input, size, |ui| {
            if show.layers.rectangles && !is_frozen {
                overlays::rectangles(ui, stage.culling.last.as_ref());
            }
            if show.crosshair {
                hud::crosshair(ui);
            }
            if show.hud {
                hud::show(ui, &lines);
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
                clicked = clicked.or(matrix.show(ui, home, *pair));
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
            if let Some((line, _)) = note {
                hud::note(ui, line);
            }
            if show.question {
                answer = answer.or(hud::question(ui, tools::QUESTION, &tools::ANSWERS));
            }
            if find.is_open {
                chosen = chosen.or(find.show(ui, building));
            }
            if let Some((object, cell)) = selected.told {
                find::tell(ui, keys, &find::facts(building, object, cell, preferences.units));
            }
            if let Some(told) = told {
                let window = egui::Window::new("Why").anchor(egui::Align2::CENTER_BOTTOM, [0.0, -8.0]);
                window.collapsible(false).resizable(false).show(ui.ctx(), |ui| {
                    ui.set_max_width(460.0);
                    ui.label(&told.text);
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
        if let Some(wish) = wish {
            self.do_wish(wish);
        }
        output
    }

    /// The counters.
    fn lines(&self) -> Vec<String> {
        let Some(last) = &self.stage.culling.last else { return vec!["...".to_owned()] };
        let mode = match self.show.mode {
            FrameMode::Auto => format!("auto: {}", last.method),
            mode => mode.to_string(),
        };
        let frozen = if self.frozen.is_some() { ", frozen" } else { "" };
        let home = match last.home {
            Some(cell) => match &self.building.file.cells[cell.index()] {
                named if named.source.is_some() => format!("cell {cell} ({})", named.name),
                _ => format!("cell {cell}"),
            },
            None => "no cell asked".to_owned(),
        };
        let (objects, all) = (self.building.scene.objects.len(), self.building.scene.triangles.len());
        let units = self.preferences.units;
        let device = self.stage.heard.device_ms.map_or(String::new(), |ms| format!(", GPU {ms:.2} ms"));
        let mut lines = vec![
            format!("{mode}{frozen}"),
            home,
            format!("{} of {} triangles", number(self.stage.triangles() as f64), number(all as f64)),
            format!("{} of {} objects", last.stats.objects, objects),
            format!("{} cells, {} portals, {} queries", last.stats.cells, last.stats.portals, last.stats.queries),
            format!("cull {:.2} ms{device}", last.ms),
            format!("{:.0} frames a second", 1e3 / self.frame_ms.max(1e-3)),
            format!("{}, {:.0}° field of view", units.speed(self.walker.metres_a_second()), self.show.fov_y.to_degrees()),
            format!("{}: keys", self.keys.name_of(Action::Layer(Shown::Keys))),
        ];
        lines.extend(self.say_path());
        if let Some(missed) = self.stage.heard.missed.as_ref().filter(|_| self.show.layers.alarm) {
            lines.push(self.say_missed(missed));
        }
        lines
    }
}

/// The middle of some corners.
pub fn middle(corners: &[Vec3]) -> Vec3 {
    corners.iter().sum::<Vec3>() / corners.len().max(1) as f32
}
