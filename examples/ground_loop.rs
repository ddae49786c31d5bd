//! The frame loop of an engine that draws ground around a building: through windows only, from tiles that come from disk meanwhile.
//!
//! ```text
//! cargo run --example ground_loop --features gpu -- X.ground FILE.pvs [PICTURE.png]
//! ```
//!
//! It walks through every cell of the building, which stands on the ground's highest point, and draws the ground alone, into a texture. No frame
//! waits for the disk, and none may draw a tile that is not in memory. Once all tiles are there that a frame wants, it must be as if all of the
//! ground were in memory. The picture is of the frame that draws the most.

#[path = "shared/canvas.rs"]
mod canvas;
#[path = "shared/command.rs"]
mod command;
#[path = "ground_loop/renderer.rs"]
mod renderer;

use canvas::{ASPECT, SIZE};
use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, CrossedPortal, Culler, Mode, Motion, Rect, View, VisibleSet};
use enfilade_measure::walkthrough::tour::tour;
use enfilade_terrain::{Ground, GroundScratch, GroundView, Limit, Placement};
use glam::{DVec3, Vec3};
use renderer::Renderer;
use std::path::Path;

/// Bytes of the cache: little, so that tiles come and go here, too. 32 MiB hold 15,000.
const CACHE: u64 = 256 << 10;
/// Pixels that ground may be drawn from its place.
const LIMIT: Limit = Limit::Pixels(1.0);
/// Frames a second, and how many seconds ahead tiles are asked for.
const RATE: f64 = 60.0;
const AHEAD: f64 = 0.5;

/// Walks, and says what was drawn of which tiles; an error is one line.
pub fn run(ground: &Path, pvs: &Path, picture: Option<&Path>) -> Result<String, String> {
    let mut ground = Ground::open(ground, CACHE).map_err(|e| format!("{}: {e}", ground.display()))?;
    let file = PvsFile::load(pvs).map_err(|e| e.to_string())?;
    let mut indoors = View::new(&Culler::new(&file));
    let mut renderer = Renderer::new(&ground)?;
    let place = Placement { at: DVec3::Y * f64::from(ground.tiles()[0].high), degrees: 0.0 };
    let (path, mut windows, mut motion) = (tour(&file, 0), Vec::new(), Motion::default());
    let (mut scratch, mut all) = (GroundScratch::default(), GroundScratch::default());
    let (mut drawn, mut most, mut seen, mut present, mut wanted, mut worst) = (0, 0, 0, 0, 0, 0f32);
    for frame in 0..path.frames.len() {
        // 1. Where on the screen ground can show.
        let camera = path.camera(frame, file.origin, ASPECT);
        look_out(&file, &indoors.cull(&camera, Mode::PortalsAndPvs), &mut windows);
        // 2. Which of the tiles in memory are drawn there.
        let camera = in_ground(&camera, &place, file.origin);
        let view = GroundView { camera, size: SIZE, windows: &windows };
        let patches = ground.select(&view, LIMIT, &mut scratch);
        let shown = renderer.frame(&ground, &camera, patches).map_err(|e| format!("frame {frame}: {e}"))?;
        // 3. Tiles that have come go to the device; others are asked for.
        motion.see(&camera, frame as f64 / RATE);
        let loading = ground.load(&view, LIMIT, &motion, AHEAD, patches);
        renderer.upload(&ground);

        let is_whole = loading.present == loading.wanted && loading.loaded == 0;
        if is_whole && patches != ground.select_all(&view, LIMIT, &mut all) {
            return Err(format!("frame {frame}: all tiles are there, and others are drawn than from memory"));
        }
        if let Some(to) = picture.filter(|_| patches.len() > most) {
            shown.save(to).map_err(|e| format!("{}: {e}", to.display()))?;
        }
        (drawn, most) = (drawn + patches.len(), most.max(patches.len()));
        seen += usize::from(!windows.is_empty());
        (present, wanted) = (present + loading.present, wanted + loading.wanted);
        worst = worst.max(if is_whole { scratch.worst() } else { 0.0 });
    }
    let (count, adapter) = (path.frames.len(), &renderer.canvas.adapter);
    let sums = format!("{count} frames, {seen} with a window: {drawn} tiles drawn, {present} of {wanted} wanted ones there");
    Ok(format!("{sums}; {worst:.2} pixels wrong at most where all were ({adapter})"))
}

/// Parts of the screen in which ground can show: all of it from outside, else what the portals leave that lead there.
fn look_out(file: &PvsFile, visible: &VisibleSet<'_>, windows: &mut Vec<Rect>) {
    let is_open = |cell: CellId| file.cells[cell.index()].open;
    windows.clear();
    if visible.homes.first().is_none_or(|&home| is_open(home)) {
        return windows.push(Rect::FULL);
    }
    let leads_out = |crossed: &&CrossedPortal| {
        let portal = crossed.portal;
        is_open(file.portals[portal.portal().index()].cells[1 - portal.side()])
    };
    windows.extend(visible.portals.iter().filter(leads_out).map(|crossed| crossed.rect));
}

/// A camera of the building in the ground's coordinates.
fn in_ground(camera: &Camera, place: &Placement, origin: DVec3) -> Camera {
    let turn = |row: Vec3| place.turn(row.as_dvec3()).as_vec3();
    let eye = place.to_ground(camera.eye.as_dvec3() + origin).as_vec3();
    Camera { eye, x: turn(camera.x), y: turn(camera.y), w: turn(camera.w) }
}

fn main() {
    command::main("ground_loop", "X.ground FILE.pvs", run);
}
