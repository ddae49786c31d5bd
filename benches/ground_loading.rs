//! Ground from disk: wanted tiles that are there, with a disk that answers four frames late and takes eight tiles a frame, with and without
//! looking ahead (`cargo bench --bench ground_loading -- X.ground`; without a file, a made raster of 2,049 x 2,049).
//!
//! First, with the file's own thread, what frames take and what the process has in memory. Then the scripted disk, which keeps all of the file in
//! memory; every frame must draw some ground.

use enfilade::runtime::{Camera, Motion, Rect};
use enfilade_scenes::ground;
use enfilade_terrain::raster::{Raster as File, RasterOptions};
use enfilade_terrain::{Ground, GroundScratch, GroundView, Limit, Loading, MakeOptions, make};
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::time::Instant;
use testing::ground::Scripted;
use testing::times::{names, us};

const SIZE: [u32; 2] = [1920, 1080];
const CACHE: u64 = 32 << 20;
const LATE: u64 = 4;
const A_FRAME: usize = 8;
const FRAMES: usize = 600;
/// Frames at the start that are not counted: nothing is in memory then.
const WARM: usize = 120;
const RATE: f64 = 60.0;
/// Seconds that are looked ahead.
const AHEAD: f64 = 0.25;
const PIXELS: Limit = Limit::Pixels(1.0);

fn main() {
    let named = names().first().map(PathBuf::from);
    let path = named.unwrap_or_else(made);
    let table = Ground::open(&path, 0).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut real = Ground::open(&path, CACHE).expect("as before");
    let mut times = Vec::new();
    let mut start = Instant::now();
    fly(&mut real, 150.0, 30.0, AHEAD, |_, _, _| {
        times.push(start.elapsed());
        start = Instant::now();
    });
    times.sort_unstable();
    println!(
        "frames of the file's own thread, selection and loading: {:.0} us median, {:.0} at 99 %",
        us(&times, 50),
        us(&times, 99)
    );
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        let of = |name: &str| status.lines().find(|l| l.starts_with(name)).unwrap_or_default().to_owned();
        println!("in memory: {}, at most {}", of("VmRSS"), of("VmHWM"));
    }
    println!("| flight | looks ahead | wanted tiles that are there, % | frames with all, % | worst frame, % |");
    println!("| --- | --- | --- | --- | --- |");
    for (name, speed, turn) in [("15 m/s", 15.0, 0.0), ("150 m/s", 150.0, 0.0), ("15 m/s, 90 degrees a second", 15.0, 90.0)]
    {
        for ahead in [AHEAD, 0.0] {
            let mut late = Ground::from_disk(&table, Box::new(Scripted::new(&path, &table, LATE, A_FRAME)), CACHE);
            let (mut wanted, mut present, mut whole, mut worst) = (0, 0, 0, 1f64);
            fly(&mut late, speed, turn, ahead, |k, loading, triangles| {
                if k >= WARM {
                    assert!(triangles > 0, "{name}: no ground in frame {k}");
                    wanted += u64::from(loading.wanted);
                    present += u64::from(loading.present);
                    whole += u64::from(loading.wanted == loading.present);
                    worst = worst.min(f64::from(loading.present) / f64::from(loading.wanted.max(1)));
                }
            });
            let percent = |a: u64, b: u64| 100.0 * a as f64 / b as f64;
            let frames = percent(whole, (FRAMES - WARM) as u64);
            println!("| {name} | {ahead} s | {:.2} | {frames:.1} | {:.1} |", percent(present, wanted), 100.0 * worst);
        }
    }
}

fn made() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (raster, path) = (folder.join("loading.tif"), folder.join("loading.ground"));
    ground(2049, 2.0, 1, &raster).expect("a ground");
    let mut heights = File::open(&[raster], &RasterOptions::default()).expect("what was made");
    let mut out = std::fs::File::create(&path).expect("a folder to write to");
    make(&mut heights, &MakeOptions::default(), &mut out).expect("a ground");
    path
}

/// Flies 60 m above the ground, a quarter of its width from its edge; tells each frame.
fn fly(ground: &mut Ground, speed: f64, turn: f64, ahead: f64, mut told: impl FnMut(usize, Loading, u64)) {
    let (mut scratch, mut motion) = (GroundScratch::default(), Motion::default());
    let [columns, rows] = ground.header().grid.size();
    let [x, z] = ground.header().plan(columns / 4, rows / 2);
    let mut height = 0.0;
    for k in 0..FRAMES {
        let seconds = k as f64 / RATE;
        let eye = DVec3::new(x + speed * seconds, 0.0, z);
        // Slowly up and down with the ground, as far as it is known.
        let here = ground.height_at(eye.x, eye.z).unwrap_or(height);
        height += (here - height) * if k == 0 { 1.0 } else { 0.02 };
        let eye = eye + DVec3::Y * (height + 60.0);
        let angle = (turn * seconds).to_radians();
        let camera = Camera::look_at(eye, eye + DVec3::new(angle.cos(), -0.15, angle.sin()), 60f64.to_radians(), 16.0 / 9.0);
        let view = GroundView { camera, size: SIZE, windows: &[Rect::FULL] };
        ground.select(&view, PIXELS, &mut scratch);
        motion.see(&camera, seconds);
        let loading = ground.load(&view, PIXELS, &motion, ahead, scratch.patches());
        told(k, loading, scratch.triangles());
    }
}
