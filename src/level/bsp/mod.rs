//! Quake 1 levels (`.bsp`, bsp29 and BSP2): portals out of the tree, rows into the visibility lump.
//!
//! Leaf 0 is what is solid; the world's leaves follow, and leaf `i + 1` is cell `i` here. Lumps' entries are decoded by the
//! `qbsp` crate, one lump at a time and only once lengths and bounds are checked here: its own way in asserts, and takes memory
//! on a count in the file.
//!
//! What can be looked through: air and liquids (with or without translucent water in the game, nothing is missing); not what is
//! solid, and not sky, behind which games draw nothing.

mod lump;
mod portals;
mod tree;

use super::{Level, LevelPortal};
use crate::BitMatrix;
use crate::level::prt::{MOST_CLUSTERS, Prt};
use glam::DVec3;
use qbsp::BspFormat;
use qbsp::reader::BspParseContext;
use tree::Tree;

/// Lumps of a Quake 1 level, in the directory's order.
const LUMPS: [&str; 15] = [
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
const PLANES: usize = 1;
const TEXTURES: usize = 2;
const VERTICES: usize = 3;
const VISIBILITY: usize = 4;
const NODES: usize = 5;
const TEXTURE_INFOS: usize = 6;
const FACES: usize = 7;
const LEAVES: usize = 10;
const MODELS: usize = 14;
/// Magic or version, then offset and length of each lump.
const HEADER: usize = 4 + 8 * LUMPS.len();

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
struct Lump {
    offset: usize,
    length: usize,
}

impl Lump {
    fn end(self) -> usize {
        self.offset + self.length
    }
}

/// A level, whole, with its tree checked.
#[derive(Clone, Debug)]
pub struct Bsp {
    bytes: Vec<u8>,
    format: BspFormat,
    lumps: [Lump; LUMPS.len()],
    tree: Tree,
}

/// Portals of a level, and where they come from.
#[derive(Clone, PartialEq, Debug)]
pub struct Derived {
    /// Cells (leaf `i + 1` is cell `i`) and portals.
    pub level: Level,
    /// Slivers left out: portals narrower than [`Bsp::rounding`].
    pub slivers: usize,
}

impl Bsp {
    /// Takes a file's bytes.
    ///
    /// # Errors
    ///
    /// What is wrong with the header, or with the lumps that the tree is made of.
    pub fn read(bytes: Vec<u8>) -> Result<Self, BspError> {
        let format = format(&bytes)?;
        let lumps = directory(&bytes)?;
        let tree = Tree::read(&Source { bytes: &bytes, lumps: &lumps, context: BspParseContext { format } })?;
        Ok(Self { bytes, format, lumps, tree })
    }

    /// `bsp29` or `BSP2`.
    pub fn format(&self) -> &'static str {
        if self.format == BspFormat::BSP2 { "BSP2" } else { "bsp29" }
    }

    /// Leaves of the world that have a row: those after leaf 0 that don't belong to doors, lifts and so on.
    pub fn leaves(&self) -> usize {
        self.tree.vis_leaves
    }

    /// How far the file's own rounding (planes in `f32`) may shift a point of the level, in its units.
    pub fn rounding(&self) -> f64 {
        self.tree.rounding()
    }

    /// Derives portals from the tree.
    ///
    /// # Errors
    ///
    /// [`BspError::Fences`] where the tree doesn't tell what can be looked through.
    pub fn level(&self) -> Result<Derived, BspError> {
        let fences = tree::fences(&self.source())?;
        if fences > 0 {
            return Err(BspError::Fences(fences));
        }
        Ok(portals::derive(&self.tree))
    }

    /// Whether portals of a `.prt` can be this level's: it has a leaf for each of the level's, and nine in ten of its portals
    /// lie where the tree has the leaves of their clusters on both sides.
    pub fn fits(&self, prt: &Prt) -> bool {
        if prt.leaves.len() != self.leaves() {
            return false;
        }
        let cluster = |p: DVec3| {
            let leaf = self.tree.leaf_at(p);
            self.tree.leaves[leaf].open.then(|| leaf.checked_sub(1).and_then(|cell| prt.leaves.get(cell))).flatten().copied()
        };
        let between = |portal: &&LevelPortal| {
            let (middle, normal) = (crate::geom::middle(&portal.winding), crate::geom::newell(&portal.winding).normalize());
            let sides = [-1.0, 1.0].map(|side| cluster(middle + normal * side * 16.0 * self.rounding()));
            sides == portal.cells.map(Some)
        };
        let fitting = prt.level.portals.iter().filter(between).count();
        fitting * 10 >= prt.level.portals.len() * 9
    }

    /// Rows of the file's own visibility lump, a row and a column a cell; `None` where it has none.
    ///
    /// # Errors
    ///
    /// A row that goes on beyond the lump.
    pub fn rows(&self) -> Result<Option<BitMatrix>, BspError> {
        let vis = self.source().lump(VISIBILITY);
        if vis.is_empty() { Ok(None) } else { lump::decode(vis, &self.tree).map(Some) }
    }

    /// The file with other rows: `rows` of clusters, and the cluster of each leaf (leaf `i + 1` at `i`). But for the visibility
    /// lump, the leaves' offsets into it and the directory's offsets, every byte is as it was.
    ///
    /// # Errors
    ///
    /// [`BspError::TooLong`], and damage in what follows the lumps.
    ///
    /// # Panics
    ///
    /// If `clusters` hasn't an entry for each leaf, or `rows` no row for each cluster.
    pub fn with_rows(&self, rows: &BitMatrix, clusters: &[u32]) -> Result<Vec<u8>, BspError> {
        assert_eq!(clusters.len(), self.leaves(), "a cluster for each leaf");
        lump::write(self, rows, clusters)
    }

    fn source(&self) -> Source<'_> {
        Source { bytes: &self.bytes, lumps: &self.lumps, context: BspParseContext { format: self.format } }
    }
}

/// What lumps are read from.
struct Source<'s> {
    bytes: &'s [u8],
    lumps: &'s [Lump; LUMPS.len()],
    context: BspParseContext,
}

impl<'s> Source<'s> {
    fn lump(&self, lump: usize) -> &'s [u8] {
        let Lump { offset, length } = self.lumps[lump];
        &self.bytes[offset..offset + length]
    }

    /// The entries of a lump.
    fn entries<T: qbsp::reader::BspValue>(&self, lump: usize) -> Result<Vec<T>, BspError> {
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

fn format(bytes: &[u8]) -> Result<BspFormat, BspError> {
    let Some(magic) = bytes.first_chunk::<4>() else { return Err(BspError::Cut(bytes.len())) };
    let other = |name: &str| Err(BspError::Format(name.to_owned()));
    match magic {
        [29, 0, 0, 0] => Ok(BspFormat::BSP29),
        b"BSP2" => Ok(BspFormat::BSP2),
        [30, 0, 0, 0] => other("a Half-Life level (bsp30)"),
        b"2PSB" => other("a level in BSP2's first draft (2PSB)"),
        b"IBSP" | b"QBSP" => other("a Quake 2 or Quake 3 level"),
        b"VBSP" => other("a Source level"),
        _ => other("a file that doesn't begin as a level does"),
    }
}

fn directory(bytes: &[u8]) -> Result<[Lump; LUMPS.len()], BspError> {
    let Some(header) = bytes.get(4..HEADER) else { return Err(BspError::Cut(bytes.len())) };
    if i32::try_from(bytes.len()).is_err() {
        return Err(BspError::TooLong);
    }
    let mut lumps = [Lump::default(); LUMPS.len()];
    for ((lump, entry), name) in lumps.iter_mut().zip(header.chunks_exact(8)).zip(LUMPS) {
        let word = |at: usize| entry[at..at + 4].iter().rev().fold(0usize, |n, &b| n << 8 | usize::from(b));
        *lump = Lump { offset: word(0), length: word(4) };
        // An empty lump may point anywhere.
        if lump.length == 0 {
            lump.offset = lump.offset.min(bytes.len());
        }
        if lump.end() > bytes.len() {
            let what = format!("ends at byte {}, the file at {}", lump.end(), bytes.len());
            return Err(BspError::Lump { lump: name, what });
        }
    }
    Ok(lumps)
}

/// Whether a number of leaves is one that rows can be made for.
fn countable(leaves: usize) -> Result<(), BspError> {
    if leaves as u64 > MOST_CLUSTERS {
        let what = format!("has {leaves} leaves in the world, more than {MOST_CLUSTERS}");
        return Err(BspError::Lump { lump: LUMPS[LEAVES], what });
    }
    Ok(())
}
