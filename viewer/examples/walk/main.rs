//! The moving picture of the README: two minutes in a building, drawn as the window draws them, without one.
//!
//! `cargo run --release -p enfilade-viewer --example walk -- MODEL OUT.gif OUT.path.json`
//!
//! MODEL is `office.glb` of `data/buildings`. The walker follows a way through it by the viewer's own rules: gravity, stairs, walls, doors.
//! Half way, the culling is frozen and somebody flies out and back. OUT.path.json holds the path of the camera, ten frames a second.

mod picture;
mod visit;

use picture::Moving;
use std::path::Path;
use visit::{SECONDS, Visit};

/// Of pictures, pixels.
const SIZE: [u32; 2] = [640, 360];
/// Pictures of the walk in one of its seconds, and how many times as fast they are shown.
const PICTURES_A_SECOND: f64 = 5.0 / 3.0;
const FASTER: f64 = 6.0;

fn main() -> Result<(), String> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [model, gif, path] = &args[..] else {
        return Err("give MODEL OUT.gif OUT.path.json".to_owned());
    };
    let building = visit::open(Path::new(model))?;
    let mut visit = Visit::new(&building, SIZE)?;
    // Panels have their size from the second picture on, and frames their time from the third.
    for _ in 0..2 {
        visit.picture()?;
    }
    let mut moving = Moving::new(SIZE, PICTURES_A_SECOND * FASTER);
    let pictures = (SECONDS * PICTURES_A_SECOND) as usize;
    for number in 0..pictures {
        visit.go_to(number as f64 / PICTURES_A_SECOND);
        moving.add(visit.picture()?.pixels());
    }
    moving.write(Path::new(gif)).map_err(|e| format!("{gif}: {e}"))?;
    println!("{}", visit.told());
    let text = serde_json::to_string(&visit.path()).map_err(|e| e.to_string())?;
    std::fs::write(path, text).map_err(|e| format!("{path}: {e}"))
}
