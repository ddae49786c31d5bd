//! Level files of games (`.bsp`): the tree, its portals, and the rows of visibility, read and written back.
//!
//! Quake (bsp29, BSP2, 2PSB), Half-Life (bsp30), Quake 2 (IBSP 38, QBSP 38), Quake 3 (IBSP 46) and Source (VBSP 19, 20, 21, 25, also
//! packed and of consoles), known by their content. `games` has what differs between them; docs/levels.md tells of it.
//!
//! A *cell* is what has a row: leaf `i + 1` is cell `i` in Quake and Half-Life, a cluster is a cell in the others.

mod ambient;
mod chains;
mod displacements;
pub(crate) mod entities;
pub(crate) mod error;
pub(crate) mod faces;
pub(crate) mod fences;
pub(crate) mod file;
mod fit;
pub(crate) mod games;
pub(crate) mod infos;
pub(crate) mod layout;
mod lzma;
mod meshes;
mod patches;
pub(crate) mod portals;
pub(crate) mod props;
pub(crate) mod record;
mod replace;
mod rows;
pub(crate) mod tree;

use super::Level;
pub use ambient::SOUNDS;
use enfilade::BitMatrix;
use enfilade::types::level::LevelPortal;
pub use error::BspError;
use file::LevelFile;
pub use fit::Fit;
use glam::DVec3;
use layout::{Lump, Rows};
use tree::Tree;

/// Whether a file begins as a level that is read.
pub fn is_level(head: &[u8]) -> bool {
    file::recognise(head).is_ok()
}

/// A level, whole, with its tree checked.
#[derive(Clone, Debug)]
pub struct Bsp {
    pub(crate) file: LevelFile,
    pub(crate) tree: Tree,
}

/// A level's file with other rows.
#[derive(Clone, PartialEq, Debug)]
pub struct Rewritten {
    /// The file.
    pub bytes: Vec<u8>,
    /// Bytes of the new visibility lump, as written (run-length coded in most games), before it is packed.
    pub lump: usize,
    /// Ordered pairs of what can be heard, in games that keep them.
    pub heard_pairs: Option<u64>,
}

/// Portals of a level, derived from its tree.
#[derive(Clone, PartialEq, Debug)]
pub struct Derived {
    /// Cells and portals.
    pub level: Level,
    /// Number of skipped slivers: portals narrower than [`Bsp::rounding`].
    pub slivers: usize,
}

impl Bsp {
    /// Reads a file's bytes.
    ///
    /// # Errors
    ///
    /// Faults of the header, or of the lumps of the tree.
    pub fn read(bytes: Vec<u8>) -> Result<Self, BspError> {
        let file = LevelFile::read(bytes)?;
        let tree = Tree::read(&file)?;
        Ok(Self { file, tree })
    }

    /// The game's name for the format: `bsp29`, `BSP2`, `Half-Life's bsp30`, ...
    pub fn format(&self) -> &'static str {
        self.file.layout.name
    }

    /// Number of cells: the world's leaves with rows (those after leaf 0, without those of doors, lifts and so on), or its clusters.
    pub fn cells(&self) -> usize {
        self.tree.cells
    }

    /// Whether rows belong to leaves, of which a cluster of a portal file may have several.
    pub fn is_by_leaf(&self) -> bool {
        self.file.layout.rows == Rows::ByLeaf
    }

    /// How far a game draws, in the level's units: the greatest `farz` of Source's fog; `None` where no entity limits it.
    ///
    /// # Errors
    ///
    /// Entities that can't be read.
    pub fn far_z(&self) -> Result<Option<f64>, BspError> {
        let entities = entities::entities(&self.file.lump(Lump::Entities)?)?;
        let fogs = entities.iter().filter(|e| e.get("classname") == Some("env_fog_controller"));
        let limits: Option<Vec<f64>> =
            fogs.map(|fog| fog.get("farz").and_then(|z| z.trim().parse().ok()).filter(|z: &f64| *z > 0.0)).collect();
        // One fog without a limit is none.
        Ok(limits.and_then(|limits| limits.into_iter().reduce(f64::max)))
    }

    /// Whether the file has rows.
    pub fn has_rows(&self) -> bool {
        self.file.entry_of(Lump::Visibility).length > 0
    }

    /// Whether the file has a second set of rows, of what can be heard: `PHS` or `PAS`.
    pub fn second(&self) -> Option<&'static str> {
        if let Rows::ByCluster(name) = self.file.layout.rows { Some(name) } else { None }
    }

    /// Error of points from the file's own rounding (planes in `f32`), in its units.
    pub fn rounding(&self) -> f64 {
        self.tree.rounding()
    }

    /// Derives portals from the tree.
    ///
    /// # Errors
    ///
    /// [`BspError::Fences`] if the tree does not decide which faces are see-through.
    pub fn level(&self) -> Result<Derived, BspError> {
        let (portals, slivers) = self.portals()?;
        Ok(Derived { level: Level { cells: self.cells(), portals, rounding: self.rounding() }, slivers })
    }

    /// The portals between open cells, derived from the tree, and the number of skipped slivers: portals narrower than
    /// [`Bsp::rounding`].
    ///
    /// # Errors
    ///
    /// [`BspError::Fences`] if the tree does not decide which faces are see-through.
    pub fn portals(&self) -> Result<(Vec<LevelPortal>, usize), BspError> {
        fences::refuse(&self.fences_on_walls()?)?;
        let found = portals::derive(&self.tree, false);
        Ok((found.portals, found.slivers))
    }

    /// Fences with solid matter behind, as indices of faces, ascending.
    pub(crate) fn fences_on_walls(&self) -> Result<Vec<usize>, BspError> {
        fences::on_walls(&self.file, &self.tree)
    }

    /// The cell at a point, in the level's own coordinates; `None` in solid, and outside the level.
    pub fn cell_at(&self, place: DVec3) -> Option<usize> {
        self.tree.leaves[self.tree.leaf_at(place)].cell.map(|cell| cell as usize)
    }

    /// Rows of the file's visibility lump, a row and a column per cell; `None` without rows.
    ///
    /// # Errors
    ///
    /// A row that extends beyond the lump.
    pub fn rows(&self) -> Result<Option<BitMatrix>, BspError> {
        Ok(rows::decode(&self.file, &self.tree)?.map(|decoded| decoded.rows))
    }

    /// The second rows of the file: what can be heard from each cluster.
    ///
    /// # Errors
    ///
    /// As [`Self::rows`].
    pub fn second_rows(&self) -> Result<Option<BitMatrix>, BspError> {
        Ok(rows::decode(&self.file, &self.tree)?.and_then(|decoded| decoded.second))
    }

    /// Cells that share a row's place in the file, as compilers write it for the leaves of one cluster: the cluster of each cell,
    /// numbered in order. `None` for rows by cluster, and without rows.
    pub fn clusters_by_offset(&self) -> Option<Vec<u32>> {
        if !self.is_by_leaf() || !self.has_rows() {
            return None;
        }
        let (mut clusters, mut last) = (Vec::new(), None);
        let mut number = 0u32;
        for cell in 0..self.cells() {
            let row = self.tree.leaves[cell + 1].row;
            if row < 0 {
                return None;
            }
            if last.replace(row).is_some_and(|last| last != row) {
                number += 1;
            }
            clusters.push(number);
        }
        Some(clusters)
    }

    /// Volume of water, sky, slime and lava per leaf (leaf `i + 1` at `i`), 0 to 255; `None` in games without such levels.
    /// `rows`, `clusters`: as in [`Self::with_rows`].
    ///
    /// # Errors
    ///
    /// A leaf with missing faces.
    ///
    /// # Panics
    ///
    /// If `clusters` does not have an entry for each cell, or `rows` a row for each cluster.
    pub fn ambient_levels(&self, rows: &BitMatrix, clusters: &[u32]) -> Result<Option<Vec<[u8; SOUNDS]>>, BspError> {
        assert_eq!(clusters.len(), self.cells(), "a cluster for each cell");
        ambient::levels(self, rows, clusters)
    }

    /// The ambient levels in the file, per leaf as in [`Self::ambient_levels`].
    ///
    /// # Errors
    ///
    /// Leaves of an unknown kind.
    pub fn own_ambient_levels(&self) -> Result<Vec<[u8; SOUNDS]>, BspError> {
        ambient::own(self)
    }

    /// The file with other rows: `rows` of clusters, and the cluster of each cell; optionally with `ambient` levels. Apart from the
    /// visibility lump, the leaves' offsets into it, those levels and the directory's offsets, every byte is unchanged.
    ///
    /// # Errors
    ///
    /// [`BspError::TooLong`], and damage after the lumps.
    ///
    /// # Panics
    ///
    /// If `clusters` or `ambient` does not have an entry for each cell, or `rows` a row for each cluster.
    pub fn with_rows(
        &self,
        rows: &BitMatrix,
        clusters: &[u32],
        ambient: Option<&[[u8; SOUNDS]]>,
    ) -> Result<Rewritten, BspError> {
        assert_eq!(clusters.len(), self.cells(), "a cluster for each cell");
        assert!(ambient.is_none_or(|levels| levels.len() == self.cells()), "levels for each cell");
        let coded = rows::encode(&self.file, rows, clusters)?;
        let mut new = replace::replace(&self.file, &coded.lump)?;
        if self.is_by_leaf() {
            // Offsets and levels stand in the leaves. Leaves outside the world have no row.
            let record = self.file.of_version(Lump::Leaves, self.file.layout.leaves)?;
            let leaves = new.entries[self.file.layout.number(Lump::Leaves).unwrap_or_default()];
            for (leaf, entry) in new.bytes[leaves.offset..leaves.end()].chunks_exact_mut(record.size).enumerate() {
                let cell = leaf.checked_sub(1);
                // Leaf 0, which is all solid space, keeps what it has.
                let offset = cell.map(|cell| clusters.get(cell).map_or(-1, |&c| coded.offsets[c as usize]));
                if let Some(offset) = offset {
                    entry[record.row.at..record.row.at + 4].copy_from_slice(&offset.to_le_bytes());
                }
                let levels = cell.zip(ambient).and_then(|(cell, ambient)| ambient.get(cell));
                if let Some((levels, last)) = levels.zip(entry.last_chunk_mut()) {
                    *last = *levels;
                }
            }
        }
        Ok(Rewritten { bytes: new.bytes, lump: coded.lump.len(), heard_pairs: coded.heard_pairs })
    }
}
