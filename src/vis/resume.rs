//! What a run leaves behind when it is interrupted: a file to go on from.
//!
//! A magic, the length and checksum (XXH3) of what follows, then the state as JSON, compressed with zstd.

use super::State;
use std::io::{self, Read, Write};
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: &[u8; 8] = b"EnfVis1\n";

/// Why a state can't be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StateError {
    /// The system's word.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It begins otherwise.
    #[error("is no state of vis")]
    NotAState,
    /// It ends too early, or its checksum is wrong.
    #[error("is damaged")]
    Damaged,
    /// Its content is not what this version writes.
    #[error("is of another version: {0}")]
    Version(serde_json::Error),
}

/// Writes a state.
///
/// # Errors
///
/// Those of `out`.
pub fn write_state(state: &State, out: &mut dyn Write) -> io::Result<()> {
    let mut encoder = zstd::Encoder::new(Vec::new(), 3)?;
    serde_json::to_writer(&mut encoder, state)?;
    let payload = encoder.finish()?;
    out.write_all(MAGIC)?;
    out.write_all(&(payload.len() as u64).to_le_bytes())?;
    out.write_all(&xxh3_64(&payload).to_le_bytes())?;
    out.write_all(&payload)
}

/// Reads a state. Whether it is a level's, [`State::matches`] tells. What doesn't begin as a state is not read further.
///
/// # Errors
///
/// [`StateError`].
pub fn read_state(input: &mut dyn Read) -> Result<State, StateError> {
    let mut head = Vec::new();
    input.take(24).read_to_end(&mut head)?;
    if !head.starts_with(MAGIC) {
        return Err(StateError::NotAState);
    }
    let word = |at: usize| head.get(at..at + 8).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
    let (Some(length), Some(sum)) = (word(8), word(16)) else { return Err(StateError::Damaged) };
    let mut payload = Vec::new();
    input.read_to_end(&mut payload)?;
    if payload.len() as u64 != length || xxh3_64(&payload) != sum {
        return Err(StateError::Damaged);
    }
    serde_json::from_reader(zstd::Decoder::new(payload.as_slice())?).map_err(StateError::Version)
}
