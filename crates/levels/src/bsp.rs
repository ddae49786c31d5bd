//! Reads and writes rows in the visibility lump of a Quake 1 level. [`crate::quake`] reads the level itself.

mod ambient;
mod lump;

use super::Level;
use crate::quake::layout::VISIBILITY;
pub use crate::quake::{Bsp, BspError, Fit};
pub use ambient::SOUNDS;
use enfilade::BitMatrix;
use glam::DVec3;

/// Portals of a level, derived from its tree.
#[derive(Clone, PartialEq, Debug)]
pub struct Derived {
    /// Cells (leaf `i + 1` is cell `i`) and portals.
    pub level: Level,
    /// Number of skipped slivers: portals narrower than [`Bsp::rounding`].
    pub slivers: usize,
}

impl Bsp {
    /// Derives portals from the tree.
    ///
    /// # Errors
    ///
    /// [`BspError::Fences`] if the tree does not decide which faces are see-through.
    pub fn level(&self) -> Result<Derived, BspError> {
        let (portals, slivers) = self.portals()?;
        Ok(Derived { level: Level { cells: self.leaves(), portals, rounding: 0.0 }, slivers })
    }

    /// The leaf (leaf `i + 1` at `i`) at a point, in the level's own coordinates; `None` in solid, and outside the level.
    pub fn leaf_at(&self, place: DVec3) -> Option<usize> {
        let leaf = self.tree.leaf_at(place);
        (1..=self.leaves()).contains(&leaf).then(|| leaf - 1)
    }

    /// Rows of the file's visibility lump, a row and a column per cell; `None` without rows.
    ///
    /// # Errors
    ///
    /// A row that extends beyond the lump.
    pub fn rows(&self) -> Result<Option<BitMatrix>, BspError> {
        let vis = self.source().lump(VISIBILITY);
        if vis.is_empty() { Ok(None) } else { lump::decode(vis, &self.tree).map(Some) }
    }

    /// Volume of water, sky, slime and lava per leaf (leaf `i + 1` at `i`), 0 to 255. `rows`, `clusters`: as in
    /// [`Self::with_rows`].
    ///
    /// # Errors
    ///
    /// A leaf with missing faces.
    ///
    /// # Panics
    ///
    /// If `clusters` does not have an entry for each leaf, or `rows` a row for each cluster.
    pub fn ambient_levels(&self, rows: &BitMatrix, clusters: &[u32]) -> Result<Vec<[u8; SOUNDS]>, BspError> {
        assert_eq!(clusters.len(), self.leaves(), "a cluster for each leaf");
        ambient::levels(self, rows, clusters)
    }

    /// The ambient levels in the file, per leaf as in [`Self::ambient_levels`].
    pub fn own_ambient_levels(&self) -> Vec<[u8; SOUNDS]> {
        lump::ambient(self)
    }

    /// The file with other rows: `rows` of clusters, and the cluster of each leaf (leaf `i + 1` at `i`); optionally with
    /// `ambient` levels. Apart from the visibility lump, the leaves' offsets into it, those levels and the directory's offsets,
    /// every byte is unchanged.
    ///
    /// # Errors
    ///
    /// [`BspError::TooLong`], and damage after the lumps.
    ///
    /// # Panics
    ///
    /// If `clusters` or `ambient` does not have an entry for each leaf, or `rows` a row for each cluster.
    pub fn with_rows(
        &self,
        rows: &BitMatrix,
        clusters: &[u32],
        ambient: Option<&[[u8; SOUNDS]]>,
    ) -> Result<Vec<u8>, BspError> {
        assert_eq!(clusters.len(), self.leaves(), "a cluster for each leaf");
        assert!(ambient.is_none_or(|levels| levels.len() == self.leaves()), "levels for each leaf");
        lump::write(self, rows, clusters, ambient)
    }
}
