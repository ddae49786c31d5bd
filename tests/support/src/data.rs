//! Where the real buildings are.

use std::path::PathBuf;

/// The data folder, or `None` after saying that the test wasn't run.
pub fn data(test: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("ENFILADE_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    assert!(std::env::var_os("CI").is_none(), "{test}: no data folder");
    eprintln!("not run: {test}: no data folder");
    None
}
