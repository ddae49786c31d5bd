//! The layout of a level's file: its lumps and their faults.

use crate::MOST_CLUSTERS;
use qbsp::reader::BspParseContext;

/// Lumps of a Quake 1 level, in the directory's order.
pub(crate) const LUMPS: [&str; 15] = [
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
pub(crate) const ENTITIES: usize = 0;
pub(crate) const PLANES: usize = 1;
pub(crate) const TEXTURES: usize = 2;
pub(crate) const VERTICES: usize = 3;
pub(crate) const VISIBILITY: usize = 4;
pub(crate) const NODES: usize = 5;
pub(crate) const TEXTURE_INFOS: usize = 6;
pub(crate) const FACES: usize = 7;
pub(crate) const LEAVES: usize = 10;
pub(crate) const MARK_SURFACES: usize = 11;
pub(crate) const EDGES: usize = 12;
pub(crate) const SURFACE_EDGES: usize = 13;
pub(crate) const MODELS: usize = 14;
/// Magic or version, then offset and length of each lump.
pub(crate) const HEADER: usize = 4 + 8 * LUMPS.len();

/// Faults of a level.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BspError {
    /// Another format.
    #[error("{0} is not supported; Quake's bsp29 and BSP2 are")]
    Format(String),
    /// Shorter than its header.
    #[error("ends after {0} bytes, within the header")]
    Cut(usize),
    /// A lump is beyond the end, or not a whole number of entries.
    #[error("lump {lump} {what}")]
    Lump {
        /// Name of the lump.
        lump: &'static str,
        /// The fault.
        what: String,
    },
    /// An entry of a lump.
    #[error("lump {lump}, entry {entry}: {what}")]
    Entry {
        /// Name of the lump.
        lump: &'static str,
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

/// Range of a lump.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Lump {
    pub offset: usize,
    pub length: usize,
}

impl Lump {
    pub fn end(self) -> usize {
        self.offset + self.length
    }
}

/// The file behind lumps.
pub(crate) struct Source<'s> {
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

/// Checks that rows can be made for a number of leaves.
pub(super) fn countable(leaves: usize) -> Result<(), BspError> {
    if leaves as u64 > MOST_CLUSTERS {
        let what = format!("has {leaves} leaves in the world, more than {MOST_CLUSTERS}");
        return Err(BspError::Lump { lump: LUMPS[LEAVES], what });
    }
    Ok(())
}

/// The error of an entry of a lump.
pub(crate) fn entry(lump: usize, entry: usize, what: impl Into<String>) -> BspError {
    BspError::Entry { lump: LUMPS[lump], entry, what: what.into() }
}
