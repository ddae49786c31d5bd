//! Situations from public bug reports, a folder each in the data folder's `cases`, with what is expected there. A test a folder, named after its number, or a row of a table.

mod command;
mod gltf;
mod ifc;
mod map;

use enfilade::file::PvsFile;
use enfilade::scene::Scene;
use enfilade_measure::verify::{CheckOptions, check};
use std::path::PathBuf;
use testing::data::data;

/// The folder of a case.
fn case(name: &str) -> PathBuf {
    let folder = data().join("cases").join(name);
    assert!(folder.is_dir(), "{}: no such case", folder.display());
    folder
}

/// Whether the check passes.
#[track_caller]
fn passes(file: &PvsFile, scene: &Scene) {
    let report = check(file, scene, &CheckOptions { rays: 50_000, views: 4, ..CheckOptions::default() }).unwrap();
    assert!(report.passed, "{}: {report:?}", scene.name);
}
