//! A model that nothing was baked of is opened: what there is meanwhile, what a stop leaves, what becomes of an older file.

use crate::common::folder;
use enfilade::file::PvsFile;
use enfilade_scenes::{Kind, generate};
use enfilade_viewer::building::{Building, EARLY};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// A folder of its own with a gallery of so many rooms.
fn model(test: &str, rooms: usize) -> PathBuf {
    let model = folder(test).join("model.glb");
    std::fs::write(&model, generate(Kind::Gallery { rooms }, 1).unwrap().glb).unwrap();
    model
}

fn names(model: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(model.parent().unwrap()).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn open(model: &Path) -> Building {
    Building::open(model, None, &|_, _| {}, &AtomicBool::new(false), None).unwrap()
}

#[test]
fn one_walks_before_anything_is_baked_and_through_portals_before_all_is() {
    let model = model("opening_early", 16);
    let seen = Mutex::new(Vec::new());
    let early = |number: usize, building: Building| {
        let is_sound = building.file.model_hash == building.scene.hash();
        let (cells, open) = (building.file.cells.len(), building.file.cells.iter().filter(|c| c.open).count());
        let whole = model.with_extension("pvs").exists();
        seen.lock().unwrap().push((number, cells, open, building.file.portals.len(), is_sound, whole));
    };
    let whole = Building::open(&model, None, &|_, _| {}, &AtomicBool::new(false), Some(&early)).unwrap();
    let (cells, portals) = (whole.file.cells.len(), whole.file.portals.len());
    let open = whole.file.cells.iter().filter(|c| c.open).count();
    assert!(cells >= 16 && portals >= 15, "{cells} cells, {portals} portals");
    // Nothing was on the disk by then.
    assert_eq!(*seen.lock().unwrap(), [(0, 1, 1, 0, true, false), (EARLY - 1, cells, open, portals, true, false)]);
    assert_eq!(names(&model), ["model.glb", "model.pvs"]);
    assert_eq!(PvsFile::load(&model.with_extension("pvs")).unwrap(), whole.file);
}

#[test]
fn a_bake_that_was_stopped_goes_on_to_the_same_file() {
    let undisturbed = model("opening_undisturbed", 16);
    open(&undisturbed);
    let stopped = model("opening_stopped", 16);
    // In the midst of each of these stages; the state is there, and no file.
    for stage in ["sampling", "aimed rays"] {
        let stop = AtomicBool::new(false);
        let progress = |now: &str, done: f64| {
            if now.starts_with(stage) && done > 0.2 {
                stop.store(true, Ordering::Relaxed);
            }
        };
        let refused = Building::open(&stopped, None, &progress, &stop, None).err();
        assert_eq!(refused.as_deref(), Some("stopped"), "{stage}");
        assert_eq!(names(&stopped), ["model.glb", "model.viewer-state"], "{stage}");
    }
    open(&stopped);
    assert_eq!(names(&stopped), ["model.glb", "model.pvs"]);
    let bytes = |model: &Path| std::fs::read(model.with_extension("pvs")).unwrap();
    assert!(bytes(&undisturbed) == bytes(&stopped));
}

#[test]
fn a_file_of_an_older_model_is_replaced_and_kept_beside() {
    let model = model("opening_outdated", 4);
    let pvs = model.with_extension("pvs");
    std::fs::write(&pvs, "no file").unwrap();
    // A state of something else is the viewer's own, and goes.
    std::fs::write(model.with_extension("viewer-state"), "something else").unwrap();
    let building = open(&model);
    assert_eq!(names(&model), ["model.glb", "model.pvs", "model.pvs.old"]);
    assert_eq!(std::fs::read(model.with_extension("pvs.old")).unwrap(), b"no file");
    assert_eq!(PvsFile::load(&pvs).unwrap(), building.file);
    // The second time it fits.
    let before = std::fs::metadata(&pvs).unwrap().modified().unwrap();
    assert_eq!(open(&model).file, building.file);
    assert_eq!(std::fs::metadata(&pvs).unwrap().modified().unwrap(), before);
}
