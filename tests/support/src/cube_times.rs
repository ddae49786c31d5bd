//! Visibility cubes by the clock, for benches.

use enfilade::pvs::cubes::{Cube, CubeEngine, CubeView};
use enfilade::scene::Scene;
use glam::DVec3;
use std::time::{Duration, Instant};

/// Pixels along a face's edge.
pub const SIZE: u32 = 256;

/// One row of the table: how long cubes took by an engine, and what it took to make the scene ready.
pub fn row(scene: &Scene, name: &str, times: &[Duration], ready: Duration) {
    let mean = times.iter().sum::<Duration>().as_secs_f64() / times.len() as f64;
    let slowest = times.iter().max().expect("an eye").as_secs_f64();
    let (mean, slowest, ready) = (mean * 1e3, slowest * 1e3, ready.as_secs_f64());
    println!("| {} | {name} | {mean:.2} | {slowest:.2} | {ready:.2} |", scene.triangles.len());
}

/// What work gives, and its time.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let start = Instant::now();
    let out = work();
    (out, start.elapsed())
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
