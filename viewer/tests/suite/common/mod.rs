//! What the viewer's tests share: buildings that are baked quickly, and devices that may not be there.

pub mod body;

use enfilade::bake::BakeOptions;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::picture::Picture;
use enfilade_viewer::building::Building;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::renderer::Renderer;
use enfilade_viewer::draw::targets::{Canvas, PICTURE};
use enfilade_viewer::headless::device;
use enfilade_viewer::looks::Looks;
use enfilade_viewer::session::Session;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use testing::bakes;
use testing::boxes::{self, block};

/// A building of this repository, with flow's rows only: what is undecided is drawn, so that pictures are whole all the same.
pub fn building(name: &str) -> Building {
    let model = shipped(name, "glb");
    baked(import(&model, &options()).unwrap(), &model)
}

/// The villa, baked once for all tests.
pub fn villa() -> &'static Building {
    static VILLA: OnceLock<Building> = OnceLock::new();
    VILLA.get_or_init(|| building("villa_rotonda"))
}

/// A building by hand.
pub fn made(building: boxes::Building) -> Building {
    let (scene, file) = building.finish();
    Building::new(scene, file, Looks::default())
}

/// A hall that reaches so far to all sides, and things in it.
pub fn hall(reach: f64, things: &[(&str, DVec3, DVec3)]) -> Building {
    let mut hall = boxes::Building::default();
    hall.cell("hall", vec![block(DVec3::splat(-reach), DVec3::splat(reach))]);
    for &(name, min, max) in things {
        hall.thing(name, min, max);
    }
    made(hall)
}

/// An empty folder.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// A model from elsewhere, baked as fast. `None`, and by name, where this build doesn't read its format; fails where `CI` is set.
pub fn quickly_baked(test: &str, model: &Path) -> Option<Building> {
    match import(model, &options()) {
        Ok(scene) => Some(baked(scene, model)),
        Err(e) => {
            assert!(std::env::var_os("CI").is_none(), "{test}: {}: {e}", model.display());
            eprintln!("not run: {test}: {}: {e}", model.display());
            None
        }
    }
}

fn options() -> ImportOptions {
    ImportOptions { trace: true, ..ImportOptions::default() }
}

/// A scene that was read from `model`.
pub fn baked(scene: Scene, model: &Path) -> Building {
    sampled(scene, model, 0)
}

/// The same, with so many rays.
pub fn sampled(scene: Scene, model: &Path, ray_budget: u64) -> Building {
    let looks = Looks::read(&scene, model, &options(), &|_| {});
    let file = bakes::baked(&scene, BakeOptions { keep_bounds: true, ..bakes::with_rays(ray_budget) });
    Building::new(scene, file, looks).told_by(model)
}

/// The walk that comes with a building.
pub fn path(name: &str) -> CameraPath {
    CameraPath::load(&shipped(name, "path.json")).unwrap()
}

/// A file of `data/buildings`.
pub fn shipped(name: &str, end: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/buildings").join(name).with_extension(end)
}

/// Ends a test where there is no device.
#[allow(unused_macros, reason = "not every test needs one")]
macro_rules! needs_device {
    () => {
        if !crate::common::has_device() {
            return;
        }
    };
}
#[allow(unused_imports, reason = "not every test needs one")]
pub(crate) use needs_device;

/// Whether there is a device. Names the test that is not run where there is none; fails where `CI` is set.
pub fn has_device() -> bool {
    let missing = device().err();
    if let Some(line) = &missing {
        let test = std::thread::current().name().unwrap_or_default().to_owned();
        assert!(std::env::var_os("CI").is_none(), "{test}: {line}");
        eprintln!("not run: {test}: {line}");
    }
    missing.is_none()
}

/// A visit to a building, and a canvas for its pictures.
pub fn visit(building: &Building, oracle: Oracle, size: [u32; 2]) -> (Canvas, Session<'_>) {
    let gpu = device().unwrap();
    let canvas = Canvas::new(&gpu, size);
    let renderer = Renderer::new(gpu, building, oracle, size, PICTURE).unwrap();
    (canvas, Session::new(building, renderer))
}

/// Draws a frame; returns its pixels.
pub fn drawn(canvas: &Canvas, session: &mut Session<'_>) -> Vec<[u8; 3]> {
    session.draw(&canvas.view, egui::RawInput::default(), 0.0).unwrap();
    canvas.read(&session.renderer.gpu).unwrap().pixels().to_vec()
}

/// How many pixels are others.
pub fn differ(a: &[[u8; 3]], b: &[[u8; 3]]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a != b).count()
}

/// Compares a picture with a golden one; `ENFILADE_GOLDEN=write` writes that anew. Drivers differ at edges: one pixel in a hundred may.
pub fn compare(name: &str, picture: &Picture) {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite/golden").join(name).with_extension("png");
    if std::env::var_os("ENFILADE_GOLDEN").is_some_and(|v| v == "write") {
        picture.save(&golden).unwrap();
    }
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("golden_{name}.png"));
    picture.save(&out).unwrap();
    let wanted = read(&golden);
    assert_eq!(wanted.len(), picture.pixels().len(), "{name}: size");
    let differs = |(a, b): &(&[u8; 3], &[u8; 3])| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > 12);
    let different = picture.pixels().iter().zip(&wanted).filter(differs).count();
    assert!(different * 100 <= wanted.len(), "{name}: {different} pixels differ; see {}", out.display());
    // A picture of nothing would be of one colour.
    assert!(wanted.iter().filter(|p| **p != wanted[0]).count() * 4 > wanted.len(), "{name} shows nothing");
}

/// Pixels of a picture.
pub fn read(path: &Path) -> Vec<[u8; 3]> {
    let picture = image::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    picture.to_rgb8().pixels().map(|pixel| pixel.0).collect()
}
