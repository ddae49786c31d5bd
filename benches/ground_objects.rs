//! Objects that nearer ground hides, from eyes on rings around a building (`cargo bench --bench ground_objects -- X.ground F.pvs STEP RING...`).
//!
//! The building stands at nine places, `STEP` metres apart, and 32 eyes are on each ring of `RING` metres, 2 m above the ground. Boxes are in
//! view that would have a pixel without ground, and behind it that have none with it. None that is found may have a pixel.

use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, Rect};
use enfilade_terrain::{Ground, GroundScratch, GroundView, Horizon, Limit, Things};
use glam::DVec3;
use std::path::Path;
use std::time::Duration;
use testing::ground_picture::Picture;
use testing::times::{names, timed, us};

const SIZE: [usize; 2] = [640, 360];
const NEAR: f64 = 0.01;
const EYES: u32 = 32;
const ABOVE: f64 = 2.0;
const PIXELS: Limit = Limit::Pixels(1.0);
/// Of each frame, for its times.
const REPEATS: usize = 7;

fn main() {
    let args = names();
    let [ground, file, step, rings @ ..] = &args[..] else {
        println!("wanted: X.ground F.pvs STEP RING...");
        return;
    };
    let ground = Ground::open(Path::new(ground), u64::MAX).unwrap_or_else(|e| panic!("{ground}: {e}"));
    let file = PvsFile::load(Path::new(file)).unwrap_or_else(|e| panic!("{e}"));
    let metres = |text: &String| text.parse::<f64>().expect("metres");
    let step = metres(step);
    for ring in rings.iter().map(metres) {
        let mut sums = Sums::default();
        for place in 0..9 {
            let [x, z] = [place % 3, place / 3].map(|at| f64::from(at - 1) * step);
            if let Some(y) = ground.height_at(x, z) {
                sums.add(&ground, &file, DVec3::new(x, y, z), ring);
            }
        }
        sums.tell(file.objects.len(), ring);
    }
}

#[derive(Default)]
struct Sums {
    in_view: u32,
    behind: u32,
    found: u32,
    /// Of hiding tiles, and of that with objects.
    times: [Vec<Duration>; 2],
}

impl Sums {
    /// Looks at a building from a ring.
    fn add(&mut self, ground: &Ground, file: &PvsFile, at: DVec3, ring: f64) {
        let bounds = file.objects.iter().map(|object| object.bounds);
        let boxes: Vec<[DVec3; 2]> = bounds.map(|b| b.map(|p| p.as_dvec3() + file.origin + at)).collect();
        let things = Things::new(ground, boxes.iter().copied());
        let middle = boxes.iter().map(|b| (b[0] + b[1]) / 2.0).sum::<DVec3>() / boxes.len() as f64;
        let (mut horizon, mut scratch) = (Horizon::new(ground), GroundScratch::default());
        for k in 0..EYES {
            let (sin, cos) = ((f64::from(k) + 0.5) * std::f64::consts::TAU / f64::from(EYES)).sin_cos();
            let eye = middle + ring * DVec3::new(cos, 0.0, sin);
            let Some(height) = ground.height_at(eye.x, eye.z) else { continue };
            let eye = eye.with_y(height + ABOVE);
            let camera = Camera::look_at(eye, middle, 60f64.to_radians(), SIZE[0] as f64 / SIZE[1] as f64);
            let view = GroundView { camera, size: SIZE.map(|s| s as u32), windows: &[Rect::FULL] };
            let patches = ground.select(&view, PIXELS, &mut scratch);
            for _ in 0..REPEATS {
                self.times[0].push(timed(|| _ = horizon.hide(ground, &view, NEAR, patches)).1);
                self.times[1].push(timed(|| _ = horizon.hide_with(ground, &view, NEAR, patches, &things, 0..boxes.len())).1);
            }
            let picture = Picture::new(ground, &camera, SIZE, NEAR, patches);
            for (thing, &corners) in boxes.iter().enumerate() {
                let [free, left] = picture.pixels_of_box(&camera, NEAR, corners);
                assert!(left == 0 || !horizon.hides(thing), "object {thing} from {eye}: {left} pixels");
                self.in_view += u32::from(free > 0);
                self.behind += u32::from(free > 0 && left == 0);
                self.found += u32::from(free > 0 && horizon.hides(thing));
            }
        }
    }

    fn tell(mut self, objects: usize, ring: f64) {
        let [alone, with] = self.times.each_mut().map(|times| {
            times.sort_unstable();
            [50, 99].map(|percent| if times.is_empty() { 0.0 } else { us(times, percent).round() })
        });
        let Self { in_view, behind, found, .. } = self;
        println!("{objects} objects, ring of {ring} m: {in_view} in view, {behind} behind ground, {found} found;");
        println!("    median and 99 %, us: tiles alone {alone:?}, with objects {with:?}");
    }
}
