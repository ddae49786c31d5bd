//! What the viewer's tests share: buildings that are baked quickly, and devices that may not be there.

use enfilade::bake::{BakeOptions, bake};
use enfilade::job::Job;
use enfilade::pvs::PvsOptions;
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
use std::path::{Path, PathBuf};

/// A building of this repository, with flow's rows only: what is undecided is drawn, so that pictures are whole all the same.
pub fn building(name: &str) -> Building {
    let model = shipped(name, "glb");
    baked(import(&model, &options()).unwrap(), &model)
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
    let pvs = PvsOptions { ray_budget, ..PvsOptions::default() };
    let file = bake(&scene, BakeOptions { pvs, keep_bounds: true, ..BakeOptions::default() }, &Job::quiet()).unwrap().file;
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
