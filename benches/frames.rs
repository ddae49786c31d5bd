//! A frame's culling over the size of buildings: offices of 30 to 1,000 rooms along their recorded paths; or, with files named, those
//! (`cargo bench --bench frames -- A.pvs A.glb A.path.json`, as often as wanted).
//!
//! First the answers are checked: around eyes of the path, whatever a face of a visibility cube shows is in the set of every mode for the camera
//! that sees that face. Then the times, one thread, each frame the fastest of several in which the path is gone along from end to end:
//! median, 99th percentile and the slowest over the frames; and of the faces, the triangles in the set for each of an object that shows.
//! `--test` takes the smallest alone.

use enfilade::ObjectId;
use enfilade::file::PvsFile;
use enfilade::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, Raster};
use enfilade::runtime::{Camera, Culler, Mode, View};
use enfilade::scene::Scene;
use enfilade_formats::import;
use enfilade_measure::walkthrough::path::CameraPath;
use glam::DVec3;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use testing::bakes::{baked, office, with_rays};
use testing::cube_times::face;
use testing::times::{is_told, names};

const ROOMS: [usize; 4] = [30, 100, 300, 1000];
const ASPECT: f64 = 16.0 / 9.0;
const TIMES: usize = 20;
/// Eyes at which answers are checked, spread evenly over the path, and the side of the cubes' faces, pixels.
const EYES: usize = 20;
const SIDE: u32 = 400;

fn main() {
    println!("| file | mode | cells | objects | us, median | 99 % | slowest | triangles of all | for each that shows |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let files = names();
    for named in files.chunks(3) {
        let [pvs, model, path] = named else { panic!("give files in threes: FILE.pvs MODEL PATH.json") };
        let file = PvsFile::load(pvs.as_ref()).unwrap_or_else(|e| panic!("{e}"));
        let scene = import(Path::new(model), &file.import.options()).unwrap_or_else(|e| panic!("{model}: {e}"));
        let path = CameraPath::load(path.as_ref()).unwrap_or_else(|e| panic!("{path}: {e}"));
        measure(pvs.rsplit('/').next().unwrap_or(pvs), &scene, &file, &path);
    }
    let rooms = if is_told("--test") { &ROOMS[..1] } else { &ROOMS[..] };
    for &rooms in rooms.iter().filter(|_| files.is_empty()) {
        let (office, scene) = office(rooms, false);
        let file = baked(&scene, with_rays(2_000_000));
        let path = serde_json::to_string(&office.path).expect("a path");
        measure(&format!("office of {rooms}"), &scene, &file, &CameraPath::from_json(&path).expect("a path"));
    }
}

fn measure(name: &str, scene: &Scene, file: &PvsFile, path: &CameraPath) {
    let culler = Culler::new(file);
    let cameras: Vec<Camera> = (0..path.frames.len()).map(|i| path.camera(i, file.origin, ASPECT)).collect();
    let modes = [Mode::Frustum, Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs];
    let excess = check(scene, &culler, &cameras, &modes);
    for (mode, excess) in modes.into_iter().zip(excess) {
        let mut view = View::new(&culler);
        let (mut best, mut triangles) = (vec![f64::INFINITY; cameras.len()], 0);
        for _ in 0..TIMES {
            for (best, camera) in best.iter_mut().zip(&cameras) {
                let begin = Instant::now();
                let visible = std::hint::black_box(view.cull(camera, mode));
                *best = best.min(begin.elapsed().as_secs_f64() * 1e6);
                triangles += visible.stats.triangles;
            }
        }
        best.sort_by(f64::total_cmp);
        let at = |share: f64| best[((best.len() - 1) as f64 * share) as usize];
        let (cells, objects) = (culler.cell_count(), culler.object_count());
        let mean = triangles as f64 / (TIMES * cameras.len() * scene.triangles.len()) as f64;
        println!(
            "| {name} | {mode} | {cells} | {objects} | {:.1} | {:.1} | {:.1} | {:.2} % | {excess:.2} |",
            at(0.5),
            at(0.99),
            at(1.0),
            mean * 100.0
        );
    }
}

/// Triangles in each mode's sets for each triangle of an object that shows, over the faces of cubes around some of the eyes.
fn check(scene: &Scene, culler: &Arc<Culler>, cameras: &[Camera], modes: &[Mode]) -> Vec<f64> {
    // As it is drawn: glass and leaves hide what is behind them.
    let mut opaque = scene.clone();
    opaque.objects.iter_mut().for_each(|o| o.opaque = true);
    let (ready, mut cube, mut view_of) = (CubeScene::new(&opaque), Cube::default(), View::new(culler));
    let (mut shown, mut taken) = (0, vec![0; modes.len()]);
    let triangles = |objects: &[ObjectId]| objects.iter().map(|&o| u64::from(culler.triangles(o))).sum::<u64>();
    for i in 0..EYES.min(cameras.len()) {
        let eye = cameras[i * cameras.len() / EYES.min(cameras.len())].eye;
        let view = CubeView::new(eye.as_dvec3(), SIDE);
        Raster::new(&ready).cube(&view, &mut cube);
        for side in 0..6 {
            let ([x, y, w], seen) = face(scene, &view, &cube, side);
            let [x, y, w] = [x, y, w].map(DVec3::as_vec3);
            let camera = Camera { eye, x, y, w };
            shown += triangles(&seen);
            for (taken, &mode) in taken.iter_mut().zip(modes) {
                let mut set = view_of.cull(&camera, mode).objects.to_vec();
                set.sort_unstable();
                assert!(seen.iter().all(|o| set.binary_search(o).is_ok()), "{mode}: an object that shows isn't in the set");
                *taken += triangles(&set);
            }
        }
    }
    taken.iter().map(|&taken| taken as f64 / shown as f64).collect()
}
