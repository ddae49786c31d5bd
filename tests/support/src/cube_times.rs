//! Visibility cubes by the clock, for benches.

use enfilade::ObjectId;
use enfilade::pvs::cubes::{Cube, CubeEngine, CubeView, NONE};
use enfilade::scene::Scene;
use glam::DVec3;
use std::time::Duration;

pub use crate::times::timed;

/// Pixels along a face's edge.
pub const SIZE: u32 = 256;

/// One row of the table: how long cubes took by an engine, and what it took to make the scene ready.
pub fn row(scene: &Scene, name: &str, times: &[Duration], ready: Duration) {
    let mean = times.iter().sum::<Duration>().as_secs_f64() / times.len() as f64;
    let slowest = times.iter().max().expect("an eye").as_secs_f64();
    let (mean, slowest, ready) = (mean * 1e3, slowest * 1e3, ready.as_secs_f64());
    println!("| {} | {name} | {mean:.2} | {slowest:.2} | {ready:.2} |", scene.triangles.len());
}

/// Cubes of [`SIZE`], and the least time of each eye.
pub fn cubes(engine: &mut dyn CubeEngine, eyes: &[DVec3], repeats: usize) -> (Vec<Cube>, Vec<Duration>) {
    let mut out = vec![Cube::default(); eyes.len()];
    let mut times = vec![Duration::MAX; eyes.len()];
    for _ in 0..repeats {
        for (i, &eye) in eyes.iter().enumerate() {
            let ((), time) = timed(|| engine.cube(&CubeView::new(eye, SIZE), &mut out[i]));
            times[i] = times[i].min(time);
        }
    }
    (out, times)
}

/// A face of a cube as a camera sees it: the axes to the right, up and ahead, and the objects that show, in order.
pub fn face(scene: &Scene, view: &CubeView, cube: &Cube, face: usize) -> ([DVec3; 3], Vec<ObjectId>) {
    let (side, pixels) = (view.size, (view.size * view.size) as usize);
    let at = |x: u32, y: u32| view.direction(face * pixels + (y * side + x) as usize);
    let last = side - 1;
    let (across, down) = (at(last, 0) - at(0, 0), at(0, last) - at(0, 0));
    let ids = cube.triangles[face * pixels..][..pixels].iter().filter(|&&t| t != NONE);
    let mut seen: Vec<ObjectId> = ids.map(|&t| scene.object_of(t as usize)).collect();
    seen.sort_unstable();
    seen.dedup();
    ([across.normalize(), -down.normalize(), (at(0, 0) + at(last, last)).normalize()], seen)
}
