//! Quake 1 levels (`.bsp`, bsp29 and BSP2): portals out of the tree, rows into the visibility lump.
//!
//! Leaf 0 is what is solid; the world's leaves follow, and leaf `i + 1` is cell `i` here. Lumps' entries are decoded by the
//! `qbsp` crate, one lump at a time and only once lengths and bounds are checked here: its own way in asserts, and takes memory
//! on a count in the file.
//!
//! What can be looked through: air and liquids (with or without translucent water in the game, nothing is missing); not what is
//! solid, and not sky, behind which games draw nothing.

mod layout;
mod lump;
mod portals;
mod tree;

use super::LevelPortal;
use crate::BitMatrix;
use crate::level::prt::Prt;
use glam::DVec3;
use layout::*;
pub use layout::{BspError, Derived};
use qbsp::BspFormat;
use qbsp::reader::BspParseContext;
use tree::Tree;

/// A level, whole, with its tree checked.
#[derive(Clone, Debug)]
pub struct Bsp {
    bytes: Vec<u8>,
    format: BspFormat,
    lumps: [Lump; LUMPS.len()],
    tree: Tree,
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
