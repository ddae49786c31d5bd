//! Reads files from disk.

use super::format::MAGIC;
use super::{FileError, PvsFile};
use std::fs::File;
use std::io::Read;
use std::path::Path;

impl PvsFile {
    /// Reads a file (see [`PvsFile::read`]).
    ///
    /// # Errors
    ///
    /// [`FileError::At`], which names the path, whatever is wrong.
    pub fn load(path: &Path) -> Result<Self, FileError> {
        Self::read(&load_bytes(path)?).map_err(|fault| at(path, fault))
    }
}

/// The bytes of a `.pvs` file, for [`super::Container::parse`]. A file that does not begin like a `.pvs` file is not read further. Errors name
/// the path.
pub fn load_bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    bytes(path).map_err(|fault| at(path, fault))
}

fn bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    let mut file = File::open(path)?;
    let mut bytes = Vec::new();
    (&mut file).take(MAGIC.len() as u64).read_to_end(&mut bytes)?;
    if !MAGIC.starts_with(&bytes) {
        return Err(FileError::NotPvs);
    }
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn at(path: &Path, fault: FileError) -> FileError {
    FileError::At { path: path.into(), fault: Box::new(fault) }
}
