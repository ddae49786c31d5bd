//! Things that move in an office of 1,182 rooms: 10,000 boxes of five sizes on their ways through its doors, a tenth of them a step further
//! each frame, and a camera on a tour (`cargo bench --bench movers`; `--test` takes a small office and few boxes; `-- FILE.pvs MODEL` others).
//!
//! First the answers are checked: in frames of the tour, every pixel that shows a mover is of one in the set, in each mode. Then the times, one
//! thread: of moving, and of a view's movers; testing all boxes against the frustum, with the same vectors, is the mode `frustum`.

use enfilade::file::PvsFile;
use enfilade::runtime::{self, Camera, Culler, Mode};
use enfilade::scene::Scene;
use enfilade::scene::rays::RayScene;
use enfilade_formats::import;
use enfilade_measure::walkthrough::crowd::{Crowd, CrowdSeen};
use enfilade_measure::walkthrough::raster::{View, draw};
use enfilade_measure::walkthrough::tour::tour;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use testing::bakes::{baked, office, with_rays};
use testing::times::{is_told, names, timed, us};

const MODES: [Mode; 4] = [Mode::Frustum, Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs];
/// Frames of the tour that are compared with pictures, and that are timed.
const COMPARED: usize = 60;
const TIMED: usize = 2000;
/// Pixels of a picture.
const SIZE: [usize; 2] = [640, 360];
/// One in so many moves each frame.
const PARTS: usize = 10;

fn main() {
    let small = is_told("--test");
    let (scene, file) = match &names()[..] {
        [pvs, model] => {
            let file = PvsFile::load(pvs.as_ref()).unwrap_or_else(|e| panic!("{e}"));
            let scene = import(Path::new(model), &file.import.options()).unwrap_or_else(|e| panic!("{model}: {e}"));
            (scene, file)
        }
        _ => {
            let scene = office(if small { 30 } else { 1000 }, true).1;
            let file = baked(&scene, with_rays(1_000_000));
            (scene, file)
        }
    };
    let culler = Culler::new(&file);
    let mut crowd = Crowd::new(&file, &culler, if small { 300 } else { 10_000 }, 0);
    println!("{} cells, {} objects, {} movers", file.cells.len(), file.objects.len(), crowd.ids.len());
    let path = tour(&file, 1);
    let cameras: Vec<Camera> =
        (0..path.frames.len()).map(|i| path.camera(i, file.origin, SIZE[0] as f64 / SIZE[1] as f64)).collect();
    let drawn = compare(&scene, &culler, &mut crowd, &cameras);
    println!("| mode | us, median | 99 % | slowest | movers | for each that shows |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for (mode, drawn) in MODES.into_iter().zip(drawn) {
        let ratio = drawn.movers as f64 / drawn.movers_shown.max(1) as f64;
        let (times, movers) = view_times(&culler, &mut crowd, &cameras, mode);
        let mean = movers as f64 / times.len() as f64;
        println!(
            "| {mode} | {:.1} | {:.1} | {:.1} | {mean:.1} | {ratio:.2} |",
            us(&times, 50),
            us(&times, 99),
            us(&times, 100)
        );
    }
    let mut moving: Vec<Duration> = cameras.iter().take(TIMED).map(|_| go_on(&mut crowd)).collect();
    moving.sort();
    let moved = crowd.ids.len().div_ceil(PARTS);
    println!("moving {moved}: {:.1} us, 99 % {:.1}, slowest {:.1}", us(&moving, 50), us(&moving, 99), us(&moving, 100));
}

/// Some movers go on; gives the time.
fn go_on(crowd: &mut Crowd) -> Duration {
    let moves = crowd.step(PARTS);
    let set = || moves.iter().for_each(|(id, bounds)| crowd.movers.set(*id, *bounds).expect("a mover"));
    timed(set).1
}

/// What each mode takes, and what shows, over some frames.
fn compare(scene: &Scene, culler: &Arc<Culler>, crowd: &mut Crowd, cameras: &[Camera]) -> Vec<CrowdSeen> {
    let (rays, mut view) = (RayScene::new(scene), runtime::View::new(culler));
    let mut seen = vec![Vec::new(); MODES.len()];
    for camera in cameras.iter().step_by(cameras.len().div_ceil(COMPARED)) {
        go_on(crowd);
        let picture = View { camera: *camera, near: 1e-3, width: SIZE[0], height: SIZE[1] };
        let full = draw(scene, &picture, &|_| true);
        let shown = crowd.shown(&picture, &full);
        for (mode, seen) in MODES.into_iter().zip(&mut seen) {
            view.cull(camera, mode);
            let found = crowd.compare(&rays, &shown, view.movers(&crowd.movers));
            assert_eq!(found.missed_mover_pixels, 0, "{mode}: from {}", camera.eye);
            seen.push(found);
        }
    }
    seen.into_iter().map(|of_mode| of_mode.into_iter().sum()).collect()
}

/// Times of a view's movers, sorted, and how many there were.
fn view_times(culler: &Arc<Culler>, crowd: &mut Crowd, cameras: &[Camera], mode: Mode) -> (Vec<Duration>, usize) {
    let (mut view, mut count) = (runtime::View::new(culler), 0);
    let mut times: Vec<Duration> = cameras
        .iter()
        .take(TIMED)
        .map(|camera| {
            go_on(crowd);
            view.cull(camera, mode);
            let (found, took) = timed(|| black_box(view.movers(&crowd.movers)).len());
            count += found;
            took
        })
        .collect();
    times.sort();
    (times, count)
}
