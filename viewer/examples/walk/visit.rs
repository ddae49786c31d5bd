//! Where the camera is at every second: on a way, and half way above the building.

use enfilade::runtime::Mode;
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};
use enfilade_measure::walkthrough::picture::Picture;
use enfilade_viewer::args::Shown;
use enfilade_viewer::building::Building;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::pipelines::NEAR;
use enfilade_viewer::draw::renderer::Renderer;
use enfilade_viewer::draw::targets::{Canvas, PICTURE};
use enfilade_viewer::headless::device;
use enfilade_viewer::looks::Detail;
use enfilade_viewer::recording::Recording;
use enfilade_viewer::session::Session;
use enfilade_viewer::walker::{MoveInput, Walker};
use glam::{DVec2, DVec3, Vec3Swizzles};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// The whole visit, seconds.
pub const SECONDS: f64 = 120.0;
/// When the culling is frozen, and for how long; of that, seconds of the way out and of the way back.
const FREEZE: f64 = 55.0;
const FROZEN: f64 = 20.0;
const OUT: f64 = 7.0;
/// From where the building is looked at, in its diagonals from its middle; and how far that turns meanwhile, radians.
const OUTSIDE: DVec3 = DVec3::new(-0.14, 0.19, 0.28);
const TURNS: f64 = 0.7;
/// One step of the walk, seconds.
const STEP: f64 = 1.0 / 40.0;
/// Times the viewer's usual speed of walking: 1.2 m a second.
const SPEED: f64 = 0.5;
/// The walker goes towards a point of the way so far ahead, and looks at one farther ahead, metres.
const AHEAD: f64 = 0.5;
const LOOK: f64 = 1.6;
/// The fastest turn, radians a second.
const TURN: f64 = 2.0;
/// Doors are open while the way passes them from so far behind to so far ahead, metres.
const OPEN: [f64; 2] = [1.4, 2.0];
/// A way passes a door if it comes so near to its middle, metres.
const THROUGH: f64 = 0.7;
/// Points of a way are so far apart, metres.
const SPACING: f64 = 0.1;
/// Size of text, times the usual.
const TEXT: f64 = 0.62;

/// Opening angle, degrees.
const FIELD_OF_VIEW: f64 = 65.0;
/// The way through the office, eyes in the model's coordinates: from the garden to the lobby, through two offices, up the stairs, and
/// through six offices there.
const WAY: [[f64; 3]; 52] = [
    [-13.5, 1.6, 8.9],
    [0.3, 1.6, 8.9],
    [1.4, 1.6, 8.0],
    [2.1, 1.6, 6.3],
    [8.6, 1.6, 6.3],
    [9.1, 1.6, 6.8],
    [9.1, 1.6, 8.4],
    [10.2, 1.6, 9.1],
    [13.2, 1.6, 9.1],
    [14.15, 1.6, 8.4],
    [14.15, 1.6, 6.8],
    [13.6, 1.6, 6.3],
    [2.4, 1.6, 6.3],
    [1.5, 1.6, 5.4],
    [1.5, 1.6, 2.2],
    [0.8, 1.6, 1.45],
    [-0.5, 1.6, 1.45],
    [-0.9, 1.6, 0.8],
    [-1.5, 1.6, 0.8],
    [-4.2, 3.2, 0.8],
    [-4.9, 3.2, 1.0],
    [-4.9, 3.2, 2.0],
    [-4.2, 3.2, 2.18],
    [-1.5, 4.9, 2.18],
    [-0.8, 4.9, 2.0],
    [-0.5, 4.9, 1.45],
    [0.8, 4.9, 1.45],
    [1.5, 4.9, 2.2],
    [1.5, 4.9, 5.4],
    [2.4, 4.9, 6.3],
    [9.2, 4.9, 6.3],
    [9.7, 4.9, 5.8],
    [9.7, 4.9, 4.1],
    [10.5, 4.9, 3.25],
    [12.2, 4.9, 3.6],
    [12.5, 4.9, 5.9],
    [12.05, 4.9, 6.8],
    [12.05, 4.9, 8.4],
    [13.0, 4.9, 9.45],
    [16.6, 4.9, 9.45],
    [17.65, 4.9, 8.4],
    [17.65, 4.9, 6.8],
    [18.2, 4.9, 6.3],
    [20.2, 4.9, 6.3],
    [20.75, 4.9, 6.8],
    [20.75, 4.9, 8.2],
    [21.6, 4.9, 9.0],
    [24.6, 4.9, 9.0],
    [25.45, 4.9, 8.4],
    [25.45, 4.9, 6.8],
    [26.0, 4.9, 6.3],
    [34.0, 4.9, 6.3],
];

/// A visit.
pub struct Visit<'b> {
    session: Session<'b>,
    canvas: Canvas,
    /// Points of the way, relative to the origin.
    way: Vec<DVec3>,
    /// Which of them the walker has come to.
    at: usize,
    now: f64,
    recording: Recording,
    /// The walker while the culling is frozen.
    inside: Option<Walker>,
    /// Around the building: its middle, and its diagonal.
    around: (DVec3, f64),
    origin: DVec3,
    last: Instant,
    walked: f64,
    doors: usize,
}

/// Opens a building, and bakes it where that is to be done.
pub fn open(model: &Path) -> Result<Building, String> {
    Building::open(model, None, &|_, _| {}, &AtomicBool::new(false), None)
}

impl<'b> Visit<'b> {
    /// On pictures of `size` pixels.
    pub fn new(building: &'b Building, size: [u32; 2]) -> Result<Self, String> {
        let (file, bounds) = (&building.file, building.scene.bounds());
        let gpu = device()?;
        let canvas = Canvas::new(&gpu, size);
        let mut renderer = Renderer::new(gpu, building, Oracle::Software, size, PICTURE)?;
        renderer.doors.set_all(false);
        renderer.doors_changed();
        let mut session = Session::new(building, renderer);
        session.view.mode = Mode::Portals.into();
        session.view.detail = Detail::Smooth;
        session.view.layers.plan = true;
        session.user.preferences.text = TEXT;
        session.user.preferences.speed = SPEED;
        session.view.fov_y = FIELD_OF_VIEW.to_radians();
        let way = points(&WAY.map(|corner| DVec3::from(corner) - file.origin));
        session.motion.walker = Walker::new(way[0], way[way.len().min(20) - 1] - way[0], false);
        let place = place(&session.motion.walker, file.origin);
        Ok(Self {
            recording: Recording::new("walk", FIELD_OF_VIEW, f64::from(NEAR), place),
            around: (bounds.centre(), bounds.diagonal()),
            origin: file.origin,
            last: Instant::now(),
            inside: None,
            at: 0,
            now: 0.0,
            walked: 0.0,
            doors: 0,
            session,
            canvas,
            way,
        })
    }

    /// Goes on until that second.
    pub fn go_to(&mut self, second: f64) {
        while self.now < second {
            self.now += STEP;
            let since = self.now - FREEZE;
            if (0.0..FROZEN).contains(&since) {
                self.fly(since);
            } else {
                self.walk();
            }
            self.recording.step(STEP, place(&self.session.motion.walker, self.origin));
        }
    }

    /// Out of the building with the culling frozen and without the plan, and back.
    fn fly(&mut self, since: f64) {
        let inside = *self.inside.get_or_insert_with(|| {
            self.session.act(Action::Freeze);
            self.session.act(Action::Layer(Shown::Plan));
            self.session.motion.walker
        });
        let smooth = |t: f64| t.clamp(0.0, 1.0).powi(2) * (3.0 - 2.0 * t.clamp(0.0, 1.0));
        let out = smooth(since / OUT) * smooth((FROZEN - since) / OUT);
        let turned = DVec2::from_angle(TURNS * (since / FROZEN - 0.5)).rotate(OUTSIDE.xz());
        let far = self.around.0 + DVec3::new(turned.x, OUTSIDE.y, turned.y) * self.around.1;
        let eye = inside.eye.lerp(far, out);
        let along = inside.forward().lerp((inside.eye.lerp(self.around.0, 0.4) - far).normalize(), smooth(2.0 * out));
        self.session.motion.walker = Walker::new(eye, along, true);
    }

    /// One step on the way.
    fn walk(&mut self) {
        if self.inside.take().is_some() {
            self.session.act(Action::Freeze);
            self.session.act(Action::Layer(Shown::Plan));
        }
        self.use_doors();
        let eye = self.session.motion.walker.eye;
        let is_there = self.at + 1 == self.way.len();
        while self.at + 1 < self.way.len() && self.way[self.at].xz().distance(eye.xz()) < AHEAD {
            self.at += 1;
        }
        let look = self.way[(self.at + (LOOK / SPACING) as usize).min(self.way.len() - 1)];
        let to = look.xz() - eye.xz();
        let walker = &mut self.session.motion.walker;
        let turn =
            (to.x.atan2(-to.y) - walker.yaw + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        walker.turn((turn * 3.0).clamp(-TURN, TURN) * STEP, -walker.pitch);
        let way = (self.way[self.at].xz() - eye.xz()).normalize_or_zero();
        let (sin, cos) = walker.yaw.sin_cos();
        let to = DVec3::new(way.dot(DVec2::new(cos, sin)), 0.0, way.dot(DVec2::new(sin, -cos)));
        self.session.go(STEP, &MoveInput { to: if is_there { DVec3::ZERO } else { to }, hurry: false });
        self.walked += self.session.motion.walker.eye.xz().distance(eye.xz());
    }

    /// Opens the doors ahead, and shuts those behind.
    fn use_doors(&mut self) {
        let [behind, ahead] = OPEN.map(|metres| (metres / SPACING) as usize);
        let near = &self.way[self.at.saturating_sub(behind)..(self.at + ahead).min(self.way.len())];
        let is_passed =
            |middle: DVec3| near.iter().any(|p| p.xz().distance(middle.xz()) < THROUGH && (p.y - middle.y).abs() < 1.5);
        let doors = &self.session.renderer.doors.doors;
        let wrong: Vec<usize> =
            (0..doors.len()).filter(|&d| doors[d].opens() != is_passed(doors[d].opening.middle)).collect();
        for door in wrong {
            self.doors += usize::from(!self.session.renderer.doors.doors[door].opens());
            self.session.open_or_shut(door);
        }
    }

    /// What is seen now.
    pub fn picture(&mut self) -> Result<Picture, String> {
        let seconds = self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
        self.session.draw(&self.canvas.view, egui::RawInput::default(), seconds)?;
        self.session.renderer.settle().map_err(|e| e.to_string())?;
        self.canvas.read(&self.session.renderer.gpu).map_err(|e| e.to_string())
    }

    /// What was recorded.
    pub fn path(self) -> CameraPath {
        self.recording.end()
    }

    /// What it came to, in a line.
    pub fn told(&self) -> String {
        format!(
            "{:.0} m of {:.0} m walked in {:.0} s, {} doors opened",
            self.walked,
            self.way.len() as f64 * SPACING,
            self.now,
            self.doors
        )
    }
}

/// Points along a line, evenly apart on the plan.
fn points(corners: &[DVec3]) -> Vec<DVec3> {
    let mut points = vec![corners[0]];
    for pair in corners.windows(2) {
        let steps = (pair[0].xz().distance(pair[1].xz()) / SPACING).round().max(1.0);
        points.extend((1..=steps as usize).map(|i| pair[0].lerp(pair[1], i as f64 / steps)));
    }
    points
}

fn place(walker: &Walker, origin: DVec3) -> PathFrame {
    let eye = walker.eye + origin;
    PathFrame { eye, target: eye + walker.forward() }
}
