//! How a level lies in its file: the lumps, and what can be wrong with them.

use crate::level::Level;
use crate::level::prt::MOST_CLUSTERS;
use qbsp::reader::BspParseContext;

/// Lumps of a Quake 1 level, in the directory's order.
pub(super) const LUMPS: [&str; 15] = [
    "entities",
    "planes",
    "textures",
    "vertices",
    "visibility",
    "nodes",
    "texture infos",
    "faces",
    "lighting",
    "clip nodes",
    "leaves",
    "mark surfaces",
    "edges",
    "surface edges",
    "models",
];
pub(super) const PLANES: usize = 1;
pub(super) const TEXTURES: usize = 2;
pub(super) const VERTICES: usize = 3;
pub(super) const VISIBILITY: usize = 4;
pub(super) const NODES: usize = 5;
pub(super) const TEXTURE_INFOS: usize = 6;
pub(super) const FACES: usize = 7;
pub(super) const LEAVES: usize = 10;
pub(super) const MODELS: usize = 14;
/// Magic or version, then offset and length of each lump.
pub(super) const HEADER: usize = 4 + 8 * LUMPS.len();

/// What is wrong with a level.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BspError {
    /// Another format.
    #[error("{0} is not read; Quake's bsp29 and BSP2 are")]
    Format(String),
    /// Shorter than its header.
    #[error("ends after {0} bytes, within the header")]
    Cut(usize),
    /// A lump is beyond the end, or not a whole number of entries.
    #[error("lump {lump} {what}")]
    Lump {
        /// Name of the lump.
        lump: &'static str,
        /// What is wrong with it.
        what: String,
    },
    /// An entry of a lump.
    #[error("lump {lump}, entry {entry}: {what}")]
    Entry {
        /// Name of the lump.
        lump: &'static str,
        /// Index, from 0.
        entry: usize,
        /// What is wrong with it.
        what: String,
    },
    /// See-through faces on solid leaves.
    #[error(
        "{0} faces of the world bear textures named {{..., which games look through, but the leaves behind are solid: the tree doesn't tell what is seen; put the level's .prt beside it"
    )]
    Fences(usize),
    /// A file too long for its own offsets.
    #[error("would be longer than 2 GiB")]
    TooLong,
}

/// Where a lump lies.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Lump {
    pub offset: usize,
    pub length: usize,
}

impl Lump {
    pub fn end(self) -> usize {
        self.offset + self.length
    }
}

/// What lumps are read from.
pub(super) struct Source<'s> {
    pub bytes: &'s [u8],
    pub lumps: &'s [Lump; LUMPS.len()],
    pub context: BspParseContext,
}

impl<'s> Source<'s> {
    pub fn lump(&self, lump: usize) -> &'s [u8] {
        let Lump { offset, length } = self.lumps[lump];
        &self.bytes[offset..offset + length]
    }

    /// The entries of a lump.
    pub fn entries<T: qbsp::reader::BspValue>(&self, lump: usize) -> Result<Vec<T>, BspError> {
        let Lump { offset, length } = self.lumps[lump];
        let size = T::bsp_struct_size(&self.context);
        let fault = |what: String| BspError::Lump { lump: LUMPS[lump], what };
        if !length.is_multiple_of(size) {
            return Err(fault(format!("has {length} bytes, not a multiple of {size}")));
        }
        // `directory` has checked that both fit.
        let entry = qbsp::data::LumpEntry { offset: offset as u32, len: length as u32 };
        qbsp::read_lump(self.bytes, entry, LUMPS[lump], &self.context).map_err(|e| fault(format!("can't be read: {e}")))
    }
}

/// Whether a number of leaves is one that rows can be made for.
pub(super) fn countable(leaves: usize) -> Result<(), BspError> {
    if leaves as u64 > MOST_CLUSTERS {
        let what = format!("has {leaves} leaves in the world, more than {MOST_CLUSTERS}");
        return Err(BspError::Lump { lump: LUMPS[LEAVES], what });
    }
    Ok(())
}

/// Portals of a level, and where they come from.
#[derive(Clone, PartialEq, Debug)]
pub struct Derived {
    /// Cells (leaf `i + 1` is cell `i`) and portals.
    pub level: Level,
    /// Slivers left out: portals narrower than [`Bsp::rounding`].
    pub slivers: usize,
}
