//! Visibility cubes of 256 x 256 x 6 pixels by a graphics processor, beside one thread of the software rasteriser, in generated furnished offices
//! of 60,000 to 4 million triangles: twenty eyes, in rooms, corridors and doorways.
//!
//! First the answers: ids are held against rays, a batch against cubes one by one, sums against ids. Then the times, the least of each eye.
//! `--test` takes the smallest office alone, `--quick` none above a million triangles.

use enfilade::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, Raster, Rays};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use enfilade_scenes::{Kind, generate};
use enfilade_studies::device_cubes::{CORNERS, EDGE, GpuCubes, GpuScene, NEAR};
use glam::DVec3;
use std::path::PathBuf;
use std::sync::Arc;
use testing::cube_times::{SIZE, cubes, row, timed};
use testing::explain::{Allowed, compare};
use testing::eyes;

/// A software driver takes long.
const REPEATS: usize = 3;
/// Offices: 60,000, 250,000, a million and 4 million triangles.
const ROOMS: [usize; 4] = [40, 165, 660, 2650];

fn main() {
    let has = |flag: &str| std::env::args().any(|a| a == flag);
    let rooms = if has("--test") { &ROOMS[..1] } else { &ROOMS[..if has("--quick") { 3 } else { 4 }] };
    println!("| triangles | engine | mean, ms | slowest, ms | made ready, s |");
    println!("| --- | --- | --- | --- | --- |");
    for &rooms in rooms {
        let office = generate(Kind::Office { rooms, storeys: None, furnished: true }, 0).expect("an office");
        let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("device-cubes-{rooms}.glb"));
        std::fs::write(&path, &office.glb).expect("a folder to write to");
        let scene = import(&path, &ImportOptions::default()).expect("what was generated");
        measure(&scene, &eyes::of_an_office(&office, &scene));
    }
}

fn measure(scene: &Scene, eyes: &[DVec3]) {
    let (ready, ready_in) = timed(|| CubeScene::new(scene));
    row(scene, "raster", &cubes(&mut Raster::new(&ready), eyes, REPEATS).1, ready_in);
    let allowed = Allowed { edge: EDGE, corners: CORNERS, near: f64::from(NEAR) };
    let (there, there_in) = match timed(|| GpuScene::new(scene)) {
        (Ok(there), time) => (Arc::new(there), time),
        (Err(why), _) => return println!("not run: {why}"),
    };
    let name = there.adapter().to_owned();
    let mut engine = GpuCubes::new(there, &ready);
    // The answers.
    let rays = RayScene::new(scene);
    let mut truth = Rays::new(&rays);
    let (mut want, mut got, mut differ) = (Cube::default(), Cube::default(), 0);
    for &eye in eyes {
        let view = CubeView::new(eye, 40);
        truth.cube(&view, &mut want);
        engine.cubes(&[view], std::slice::from_mut(&mut got)).expect("a cube");
        differ += compare(scene, &view, &got, &want, allowed);
    }
    let views: Vec<CubeView> = eyes.iter().map(|&eye| CubeView::new(eye, SIZE)).collect();
    let mut out = vec![Cube::default(); views.len()];
    let (alone, times) = cubes(&mut engine, eyes, REPEATS);
    engine.cubes(&views, &mut out).expect("cubes");
    assert!(out == alone, "a batch gives other cubes");
    let shares = engine.shares(&views).expect("sums");
    assert!(views.iter().zip(&out).zip(&shares).all(|((v, c), s)| engine.shares_of(v, c) == *s), "sums differ");
    // The times.
    println!("{name}: {differ} of {} ids and hits differ from rays, all explained", 40 * 40 * 6 * eyes.len());
    row(scene, "graphics processor, one by one", &times, there_in);
    let least = |work: &mut dyn FnMut()| (0..REPEATS).map(|_| timed(&mut *work).1).min().expect("a time");
    let batch = least(&mut || engine.cubes(&views, &mut out).expect("cubes")) / views.len() as u32;
    row(scene, "graphics processor, a batch of 20", &[batch], there_in);
    let sums = least(&mut || drop(engine.shares(&views).expect("sums"))) / views.len() as u32;
    row(scene, "graphics processor, sums of a batch of 20, opaque only", &[sums], there_in);
}
