//! Faults of a level's file.

use super::games::LAYOUTS;
use super::layout::Lump;

/// Faults of a level.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BspError {
    /// Another format, or another version of one.
    #[error("{0}; levels that are read: {kinds}", kinds = kinds())]
    Format(String),
    /// Shorter than its header.
    #[error("ends after {0} bytes, within the header")]
    Cut(usize),
    /// A lump is beyond the end, not a whole number of entries, or can't be unpacked.
    #[error("lump {lump} {what}")]
    Lump {
        /// Name of the lump.
        lump: String,
        /// The fault.
        what: String,
    },
    /// An entry of a lump.
    #[error("lump {lump}, entry {entry}: {what}")]
    Entry {
        /// Name of the lump.
        lump: String,
        /// Index, from 0.
        entry: usize,
        /// The fault.
        what: String,
    },
    /// See-through faces with solid matter behind.
    #[error(
        "{0} faces of the world have see-through textures ({{...), but the space behind them is solid in the tree, so visibility is unknown; put the level's .prt beside it, or make their brushes func_detail_fence"
    )]
    Fences(usize),
    /// A file too long for its own offsets.
    #[error("would be longer than 2 GiB")]
    TooLong,
}

fn kinds() -> String {
    let names: Vec<&str> = LAYOUTS.iter().map(|layout| layout.name).collect();
    names.join(", ")
}

/// The error of a lump.
pub(crate) fn lump(lump: Lump, what: impl Into<String>) -> BspError {
    BspError::Lump { lump: lump.to_string(), what: what.into() }
}

/// The error of an entry of a lump.
pub(crate) fn entry(lump: Lump, entry: usize, what: impl Into<String>) -> BspError {
    BspError::Entry { lump: lump.to_string(), entry, what: what.into() }
}
