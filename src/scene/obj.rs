//! stub
use super::{ImportError, ImportOptions, Scene};
use std::path::Path;
/// Reads a file.
pub fn import(_path: &Path, _options: &ImportOptions) -> Result<Scene, ImportError> {
    Err(ImportError::Empty)
}
