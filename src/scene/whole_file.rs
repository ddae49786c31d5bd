//! A model's file, or one that it names, as bytes.

use std::io;
use std::path::Path;

/// How a pointer of Git LFS starts, which stands in a checkout for a large file that was not fetched.
const POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Reads a whole file.
///
/// # Errors
///
/// Where it can't be read, or is only a pointer to the file that is meant.
pub(super) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let bytes = std::fs::read(path)?;
    match bytes.starts_with(POINTER) {
        true => Err(io::Error::other("a Git LFS pointer, not the file itself; `git lfs pull` fetches that")),
        false => Ok(bytes),
    }
}
