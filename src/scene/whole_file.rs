//! A model's file, or one that it names, as bytes.

use std::io;
use std::path::Path;

/// How a pointer of Git LFS starts, which stands in a checkout for a large file that was not fetched.
const POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// Reads a whole model.
///
/// # Errors
///
/// As [`read`], and where nothing is in it.
pub(super) fn model(path: &Path) -> io::Result<Vec<u8>> {
    let bytes = read(path)?;
    if bytes.is_empty() { Err(io::Error::other("the file is empty")) } else { Ok(bytes) }
}

/// Reads a whole file.
///
/// # Errors
///
/// Where it can't be read, or is only a pointer to the file that is meant.
pub(super) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let absent = |e: io::Error| match e.kind() {
        io::ErrorKind::NotFound => io::Error::new(e.kind(), "there is no such file"),
        _ => e,
    };
    let bytes = std::fs::read(path).map_err(absent)?;
    match bytes.starts_with(POINTER) {
        true => Err(io::Error::other("a Git LFS pointer, not the file itself; `git lfs pull` fetches that")),
        false => Ok(bytes),
    }
}
