//! What a run leaves behind when it is interrupted: a file to go on from.
//!
//! A magic, the length and checksum (XXH3) of what follows, then the state as JSON, compressed with zstd.

use super::State;
use crate::file::replace_file;
use std::fs;
use std::io::{self, Read};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: &[u8; 8] = b"EnfVis1\n";

/// Why a state can't be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StateError {
    /// The system's word.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// Another file, a damaged one, or one of another version.
    #[error("{0}; delete it, or name another with --state")]
    Damaged(String),
}

/// Writes a state whole or not at all.
///
/// # Errors
///
/// Those of the file system.
pub fn save_state(path: &Path, state: &State) -> io::Result<()> {
    let mut encoder = zstd::Encoder::new(Vec::new(), 3)?;
    serde_json::to_writer(&mut encoder, state)?;
    let payload = encoder.finish()?;
    replace_file(path, |out| {
        out.write_all(MAGIC)?;
        out.write_all(&(payload.len() as u64).to_le_bytes())?;
        out.write_all(&xxh3_64(&payload).to_le_bytes())?;
        out.write_all(&payload)
    })
}

/// Reads a state; `None` where there is no such file. Whether it is a level's, [`State::matches`] tells.
///
/// # Errors
///
/// [`StateError`].
pub fn load_state(path: &Path) -> Result<Option<State>, StateError> {
    let damaged = |what: &str| StateError::Damaged(what.to_owned());
    let mut file = match fs::File::open(path) {
        Ok(file) => file,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(e.into()),
    };
    // Another file is not read whole.
    let mut head = Vec::new();
    (&mut file).take(24).read_to_end(&mut head)?;
    if !head.starts_with(MAGIC) {
        return Err(damaged("is no state of vis"));
    }
    let word = |at: usize| head.get(at..at + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
    let (Some(length), Some(sum)) = (word(8), word(16)) else { return Err(damaged("is cut short")) };
    let mut payload = Vec::new();
    file.read_to_end(&mut payload)?;
    if payload.len() as u64 != length || xxh3_64(&payload) != sum {
        return Err(damaged("is damaged"));
    }
    let decoder = zstd::Decoder::new(payload.as_slice())?;
    let state = serde_json::from_reader(decoder).map_err(|e| StateError::Damaged(format!("is of another version: {e}")))?;
    Ok(Some(state))
}
