//! Scenes to cull, indoors and out, and a camera that goes six stretches of the path of each and jumps between them: what benches of culling
//! share.

use enfilade::runtime::Camera;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_scenes::{Kind, generate};
use std::path::Path;

/// How many there are.
pub const STRETCHES: usize = 6;
/// Frames of one; the software draws a million triangles of teapots in each.
const STRETCH: usize = 30;
const STRETCH_OF_TEAPOTS: usize = 3;
/// A teapot is one object.
const TEAPOT: u32 = 2712;

/// Names and scenes; a small office for a test.
pub fn scenes(is_test: bool) -> Vec<(String, Kind)> {
    let office = |rooms| (format!("office of {rooms}"), Kind::Office { rooms, storeys: None, furnished: true });
    if is_test {
        return vec![office(20)];
    }
    vec![
        office(165),
        ("city, dense".to_owned(), Kind::City { dense: true }),
        ("city, sparse".to_owned(), Kind::City { dense: false }),
        ("Teapots(500, 30)".to_owned(), Kind::Teapots { count: 500, scale: 30 }),
    ]
}

/// A scene, and the camera in it.
pub struct Stretches {
    pub scene: Scene,
    /// Frame after frame.
    pub cameras: Vec<Camera>,
    /// Frames of a stretch.
    pub stretch: usize,
    /// Of the near plane, metres.
    pub near: f64,
}

impl Stretches {
    /// Generates and imports a scene by way of a file, for pictures of so many pixels.
    pub fn new(kind: Kind, file: &Path, [width, height]: [usize; 2]) -> Self {
        let made = generate(kind, 0).expect("a scene");
        std::fs::write(file, &made.glb).expect("a folder to write to");
        let options = ImportOptions { object_triangles: TEAPOT, ..ImportOptions::default() };
        let scene = import(file, &options).expect("what was generated");
        let path = CameraPath::from_json(&made.path.to_string()).expect("a path");
        let stretch = if matches!(kind, Kind::Teapots { .. }) { STRETCH_OF_TEAPOTS } else { STRETCH };
        let camera = |i: usize| {
            let start = (path.frames.len() - stretch) * (i / stretch) / (STRETCHES - 1);
            path.camera(start + i % stretch, scene.origin, width as f64 / height as f64)
        };
        let cameras = (0..STRETCHES * stretch).map(camera).collect();
        Self { scene, cameras, stretch, near: path.near }
    }
}
