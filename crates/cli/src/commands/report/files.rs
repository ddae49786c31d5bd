//! Names and files of a report.

use crate::commands::{CliError, at};
use enfilade::file::replace_file;
use std::path::Path;

/// The last part of a path.
pub fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Writes files whole.
pub fn write(files: &[(impl AsRef<Path>, String)]) -> Result<(), CliError> {
    for (path, text) in files {
        let path = path.as_ref();
        replace_file(path, |out| out.write_all(text.as_bytes())).map_err(|e| at(path, e))?;
    }
    Ok(())
}
