//! Where the real buildings are.

use std::path::PathBuf;

/// The data folder. Tests that need it are ignored without the feature `full`.
///
/// # Panics
///
/// If it is missing.
pub fn data() -> PathBuf {
    let folder = std::env::var_os("ENFILADE_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    assert!(folder.is_dir(), "{}: no data folder; name one in $ENFILADE_DATA", folder.display());
    folder
}
