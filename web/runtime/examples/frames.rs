//! What the native run time says of a path and of random views, for the tests of the wasm: `frames FILE.pvs PATH.json|- VIEWS OUT`.
//!
//! `OUT`, little-endian: the number of frames (32 bits); for each frame a view-projection matrix and an eye (19 doubles), then for each mode
//! the number of objects (32 bits) and the XXH3 of their ids in order (64 bits). A line on stdout tells the microseconds of `both`: median, 99 %.

use enfilade::file::PvsFile;
use enfilade::math::random::Prng;
use enfilade::runtime::{Culler, Mode, View};
use enfilade_measure::walkthrough::path::CameraPath;
use glam::dcamera::rh::{proj::directx, view};
use glam::{DMat4, DVec3};
use std::error::Error;
use std::path::Path;
use std::time::Instant;
use xxhash_rust::xxh3::xxh3_64;

const ASPECT: f64 = 16.0 / 9.0;
const FOV: f64 = 65.0;
/// A frame's time is the mean of so many: as in browsers, whose clocks are coarse.
const ROUNDS: u32 = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [pvs, path, views, out] = &args[..] else { return Err("frames FILE.pvs PATH.json|- VIEWS OUT".into()) };
    let file = PvsFile::load(Path::new(pvs))?;
    let mut frames: Vec<[DVec3; 2]> = Vec::new();
    if path != "-" {
        frames.extend(CameraPath::load(Path::new(path))?.frames.iter().map(|frame| [frame.eye, frame.target]));
    }
    frames.extend((0..views.parse()?).map(|number| random(&file, number)));
    let culler = Culler::new(&file);
    let mut view = View::new(&culler);
    let (mut bytes, mut times) = ((frames.len() as u32).to_le_bytes().to_vec(), Vec::new());
    for [eye, target] in frames {
        let matrix = projection() * look_at(eye, target);
        let numbers = matrix.to_cols_array();
        numbers.iter().chain(&eye.to_array()).for_each(|number| bytes.extend(number.to_le_bytes()));
        let camera = enfilade_web::camera(&numbers, eye, file.origin)?;
        let start = Instant::now();
        for _ in 0..ROUNDS {
            view.cull(&camera, Mode::PortalsAndPvs);
        }
        times.push(start.elapsed().as_secs_f64() * 1e6 / f64::from(ROUNDS));
        for mode in Mode::WITHOUT_QUERIES {
            let frame = view.cull(&camera, mode);
            let ids: Vec<u8> = frame.objects.iter().flat_map(|object| object.0.to_le_bytes()).collect();
            bytes.extend((frame.objects.len() as u32).to_le_bytes());
            bytes.extend(xxh3_64(&ids).to_le_bytes());
        }
    }
    std::fs::write(out, bytes)?;
    times.sort_by(f64::total_cmp);
    println!("{} {}", times[times.len() / 2], times[times.len() * 99 / 100]);
    Ok(())
}

/// A view from around a portal, or from anywhere in and about the building.
fn random(file: &PvsFile, number: u64) -> [DVec3; 2] {
    let mut random = Prng::new(1, number);
    let mut signed = || 2.0 * random.unit() - 1.0;
    let any = DVec3::new(signed(), signed(), signed());
    let along = DVec3::new(signed(), 0.5 * signed(), signed());
    let corners: Vec<DVec3> = file.objects.iter().flat_map(|o| o.bounds).map(|p| p.as_dvec3()).collect();
    let (low, high) = corners.iter().fold((corners[0], corners[0]), |(low, high), p| (low.min(*p), high.max(*p)));
    let eye = match file.portals.get(number as usize % (file.portals.len() + 1)) {
        Some(portal) => portal.winding[0].as_dvec3() + 2.0 * any,
        None => low.lerp(high, 0.5) + 0.6 * any * (high - low),
    };
    let eye = eye + file.origin;
    [eye, eye + along]
}

fn projection() -> DMat4 {
    directx::perspective(FOV.to_radians(), ASPECT, 0.05, 1000.0)
}

fn look_at(eye: DVec3, target: DVec3) -> DMat4 {
    // Upright while it can be.
    let is_steep = (target - eye).normalize_or_zero().y.abs() > 0.999;
    view::look_at_mat4(eye, target, if is_steep { DVec3::Z } else { DVec3::Y })
}
