//! Reads files from disk.

use super::format::MAGIC;
use super::{FileError, PvsFile};
use std::fs::File;
use std::io::Read;
use std::path::Path;

impl PvsFile {
    /// Reads a file (see [`PvsFile::read`]).
    pub fn load(path: &Path) -> Result<Self, FileError> {
        Self::read(&load_bytes(path)?)
    }
}

/// The bytes of a `.pvs` file, for [`super::Container::parse`]. A file that does not begin like a `.pvs` file is not read further.
pub fn load_bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    let mut file = File::open(path)?;
    let mut bytes = Vec::new();
    (&mut file).take(MAGIC.len() as u64).read_to_end(&mut bytes)?;
    if !MAGIC.starts_with(&bytes) {
        return Err(FileError::NotPvs);
    }
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}
