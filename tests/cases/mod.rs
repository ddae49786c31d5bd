//! Situations from public bug reports, a folder each in the data folder's `cases`, with what is expected there. A test a folder, named after its number.

mod command;
mod gltf;
mod ifc;
mod map;

use std::path::PathBuf;
use testing::data::data;

/// The folder of a case.
fn case(name: &str) -> PathBuf {
    let folder = data().join("cases").join(name);
    assert!(folder.is_dir(), "{}: no such case", folder.display());
    folder
}
