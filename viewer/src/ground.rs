//! Ground around a building: where it stands in it, which parts of the screen the ground can show in, and what of it is wanted there.

use crate::args::Args;
use crate::culling::Decision;
use crate::draw::pipelines::NEAR;
use enfilade::CellId;
use enfilade::file::{FileObject, PvsFile};
use enfilade::runtime::{Camera, Culler, Mode, Motion, Rect, View};
use enfilade_terrain::{Ground, GroundScratch, GroundView, Horizon, Limit, Loading, Patch, Placement, Things};
use glam::{DVec3, Vec3};
use std::path::Path;
use std::time::{Duration, Instant};

/// Bytes of the cache of tiles: at 33 x 33 samples of two bytes some 15,000 tiles, 30 million triangles.
const CACHE: u64 = 32 << 20;
/// Tiles are loaded for the place of the camera this many seconds ahead.
const AHEAD: f64 = 0.5;
/// Tiles are loaded if an open cell is at most this many portals away: 1 is a room with a window, 2 the rooms beside it. More: tiles that are
/// never seen. Fewer: a running walker is at the window before they are loaded.
const HOPS: u32 = 2;
/// How long the tiles under a building may take to come at the start, before it is placed by what is there.
const PATIENCE: Duration = Duration::from_secs(5);
/// Default error of a sample on the screen, pixels.
const PIXELS: f64 = 1.0;
/// Of coordinates, what the rounding of an eye to 32 bits, and of the way it looks, may amount to.
const ROUNDING: f64 = 1e-6;
/// Height of the camera that looks down at where a building will stand, metres above the highest tile; and half of what it sees, radians.
const ABOVE: f64 = 100.0;
const NARROW: f64 = 1e-4;

/// A ground with a building in it.
pub struct Land {
    /// Tiles.
    pub ground: Ground,
    /// Where the building's origin is in it.
    pub place: Placement,
    /// How well it is drawn.
    pub limit: Limit,
    /// Tiles are shown: colours by level, borders, boxes.
    pub shows_tiles: bool,
    /// By cell of the building in it, whether an open cell is near.
    is_near: Vec<bool>,
    /// Its objects.
    things: Things,
    motion: Motion,
    started: Instant,
}

/// The ground that a frame shows; each way to cull has its own.
#[derive(Default)]
pub struct Shown {
    /// The selection.
    pub scratch: GroundScratch,
    /// The part that nearer ground does not hide.
    pub horizon: Option<Horizon>,
    /// Objects that the frame doesn't draw since ground hides them.
    pub objects: usize,
    /// Parts of the screen through which ground can show. None: no ground.
    pub windows: Vec<Rect>,
    /// There is no such part, but an open cell is near: tiles are loaded as if ground could show on the whole screen.
    pub is_expected: bool,
    /// Where it was looked at from, in the ground's coordinates.
    pub camera: Option<Camera>,
    /// Tiles that the frame has loaded.
    pub loading: Loading,
}

impl Shown {
    /// Tiles to draw.
    pub fn patches(&self) -> &[Patch] {
        self.horizon.as_ref().map_or(&[], Horizon::patches)
    }

    /// Their triangles.
    pub fn triangles(&self) -> u64 {
        self.horizon.as_ref().map_or(0, Horizon::triangles)
    }

    /// Whether all tiles that it shows are there, or no more will come.
    pub fn is_whole(&self) -> bool {
        self.windows.is_empty() || is_whole(self.loading)
    }
}

/// Opens what the command line names. The error is one line.
pub fn open(args: &Args) -> Result<Option<Land>, String> {
    let Some(path) = &args.ground else { return Ok(None) };
    open_file(path, args.place).map(Some)
}

fn open_file(path: &Path, place: Option<Placement>) -> Result<Land, String> {
    let ground = Ground::open(path, CACHE).map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(Land::new(ground, place))
}

impl Land {
    /// Of a ground. By default, the building's origin is on the surface in the ground's middle.
    pub fn new(ground: Ground, place: Option<Placement>) -> Self {
        let mut land = Self {
            ground,
            place: place.unwrap_or_default(),
            limit: Limit::Pixels(PIXELS),
            shows_tiles: false,
            is_near: Vec::new(),
            things: Things::default(),
            motion: Motion::default(),
            started: Instant::now(),
        };
        if place.is_none() {
            land.place.at.y = land.height_of_middle();
        }
        land
    }

    /// Height of the ground in its middle, once the tiles there have come; 0 where there is none.
    fn height_of_middle(&mut self) -> f64 {
        let high = self.ground.tiles().iter().filter(|tile| tile.samples > 0).map(|tile| f64::from(tile.high));
        let eye = DVec3::Y * (high.fold(0.0, f64::max) + ABOVE);
        let camera = Camera::look_at(eye, DVec3::ZERO, 2.0 * NARROW, 1.0);
        let view = GroundView { camera, size: [1, 1], windows: &[Rect::FULL] };
        while self.started.elapsed() < PATIENCE {
            let heard = self.ground.load(&view, Limit::Pixels(0.0), &self.motion, 0.0, &[]);
            if is_whole(heard) {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        self.ground.height_at(0.0, 0.0).unwrap_or(0.0)
    }

    /// Puts a building in it: learns where its objects are, and which of its cells are near an open one. Doors count as open. Before that,
    /// none is.
    pub fn enter(&mut self, file: &PvsFile) {
        self.things = Things::new(&self.ground, file.objects.iter().map(|object| self.boxed(object, file.origin)));
        let mut view = View::new(&Culler::new(file));
        self.is_near.clear();
        self.is_near.resize(file.cells.len(), false);
        for (_, open) in file.cells.iter().zip((0..).map(CellId)).filter(|(cell, _)| cell.open) {
            view.within_hops(open, HOPS).iter().for_each(|(near, _)| self.is_near[near.index()] = true);
        }
    }

    /// A box around an object in the ground's coordinates.
    fn boxed(&self, object: &FileObject, origin: DVec3) -> [DVec3; 2] {
        let [low, high] = object.bounds.map(|p| p.as_dvec3() + origin);
        let half = (high - low) / 2.0;
        // Turned, it takes more room.
        let [x, z] = [DVec3::X, DVec3::Z].map(|axis| self.place.turn(axis * half).abs());
        let (at, half) = (self.place.to_ground((low + high) / 2.0), x + z + DVec3::Y * half.y);
        let [west, north] = self.ground.header().plan(0, 0);
        let half = half + ROUNDING * at.y.abs().max(west.abs()).max(north.abs());
        [at - half, at + half]
    }

    /// A camera of the building in the ground's coordinates. `origin`: of the building's file.
    pub fn camera(&self, camera: &Camera, origin: DVec3) -> Camera {
        let turn = |row: Vec3| self.place.turn(row.as_dvec3()).as_vec3();
        let eye = self.place.to_ground(camera.eye.as_dvec3() + origin).as_vec3();
        Camera { eye, x: turn(camera.x), y: turn(camera.y), w: turn(camera.w) }
    }

    /// A point of the ground in the building's coordinates, relative to the origin of its file.
    pub fn to_building(&self, p: DVec3, origin: DVec3) -> Vec3 {
        let back = Placement { at: DVec3::ZERO, degrees: -self.place.degrees };
        (back.turn(p - self.place.at) - origin).as_vec3()
    }

    /// Height of the ground over a point of the plan, relative to the origin of the building's file; `None` where there is none.
    pub fn height(&self, p: DVec3, origin: DVec3) -> Option<f64> {
        let at = self.place.to_ground(p + origin);
        self.ground.height_at(at.x, at.z).map(|height| height - self.place.at.y - origin.y)
    }

    /// Selects what a frame draws, less what nearer ground hides, of pictures of `size` pixels. Where ground shows on the whole screen, objects
    /// that it hides leave the decision.
    pub fn select(&self, decision: &mut Decision, file: &PvsFile, size: [u32; 2], shown: &mut Shown) {
        windows(decision, file, &mut shown.windows);
        let is_near = decision.home.is_some_and(|home| self.is_near.get(home.index()) == Some(&true));
        shown.is_expected = shown.windows.is_empty() && is_near;
        let camera = self.camera(&decision.camera, file.origin);
        shown.camera = Some(camera);
        let view = GroundView { camera, size, windows: &shown.windows };
        let patches = self.ground.select(&view, self.limit, &mut shown.scratch);
        let horizon = shown.horizon.get_or_insert_with(|| Horizon::new(&self.ground));
        let is_whole = shown.windows == [Rect::FULL];
        let asked = decision.objects.iter().filter(|_| is_whole).map(|object| object.index());
        horizon.hide_with(&self.ground, &view, f64::from(NEAR), patches, &self.things, asked);
        shown.objects = decision.leave_out(file, |object| horizon.hides(object.index()));
    }

    /// Selects what there is on the whole screen, hidden or not, to hold what was drawn against.
    pub fn select_whole(&self, camera: Camera, size: [u32; 2], scratch: &mut GroundScratch) {
        self.ground.select(&GroundView { camera, size, windows: &[Rect::FULL] }, self.limit, scratch);
    }

    /// Selects what would be drawn if all tiles were in memory.
    pub fn select_wanted(&self, size: [u32; 2], shown: &Shown, scratch: &mut GroundScratch) {
        let Some(camera) = shown.camera else { return };
        self.ground.select_all(&GroundView { camera, size, windows: &shown.windows }, self.limit, scratch);
    }

    /// Takes tiles in that have come, and asks for others: for what is shown, and for where the camera goes. Where nothing is shown, nothing is
    /// asked for, unless an open cell is near.
    pub fn load(&mut self, size: [u32; 2], shown: &mut Shown) {
        self.load_at(self.started.elapsed().as_secs_f64(), size, shown);
    }

    /// The same, some seconds after the start.
    pub fn load_at(&mut self, seconds: f64, size: [u32; 2], shown: &mut Shown) {
        let Some(camera) = shown.camera else { return };
        self.motion.see(&camera, seconds);
        let windows = if shown.is_expected { &[Rect::FULL][..] } else { &shown.windows };
        let view = GroundView { camera, size, windows };
        shown.loading = self.ground.load(&view, self.limit, &self.motion, AHEAD, shown.scratch.patches());
    }
}

/// Tiles are asked for once those that they are quarters of are under way: with none under way and none come, no more will.
fn is_whole(Loading { wanted, present, loaded, under_way }: Loading) -> bool {
    under_way == 0 && (present == wanted || loaded == 0)
}

/// The parts of the screen in which something outside can show. Where the eye is in a room and the cells beyond were reached through
/// portals, the parts that portals into open cells leave; else all of it.
pub fn windows(decision: &Decision, file: &PvsFile, windows: &mut Vec<Rect>) {
    windows.clear();
    let goes_through = match decision.method {
        Mode::Portals | Mode::PortalsAndPvs | Mode::Chc | Mode::ChcPlus => true,
        Mode::None | Mode::Frustum | Mode::Pvs | Mode::Auto => false,
    };
    let is_open = |cell: CellId| file.cells.get(cell.index()).is_none_or(|cell| cell.open);
    if !goes_through || decision.home.is_none_or(is_open) {
        windows.push(Rect::FULL);
        return;
    }
    for crossed in &decision.portals {
        let portal = &file.portals[crossed.portal.portal().index()];
        let leads_out = is_open(portal.cells[1 - crossed.portal.side()]);
        // From one open cell to the next one opens nothing new.
        if leads_out && !crossed.rect.is_empty() && !windows.iter().any(|window| window.covers(&crossed.rect)) {
            windows.push(crossed.rect);
        }
    }
}
