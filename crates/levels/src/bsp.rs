//! Rows of a Quake 1 level: into the visibility lump and out of it. The level itself is read by [`crate::quake`].

mod ambient;
mod lump;

use super::Level;
use crate::quake::layout::VISIBILITY;
pub use crate::quake::{Bsp, BspError, Fit};
pub use ambient::SOUNDS;
use enfilade::BitMatrix;
use glam::DVec3;

/// Portals of a level, and where they come from.
#[derive(Clone, PartialEq, Debug)]
pub struct Derived {
    /// Cells (leaf `i + 1` is cell `i`) and portals.
    pub level: Level,
    /// Slivers left out: portals narrower than [`Bsp::rounding`].
    pub slivers: usize,
}

impl Bsp {
    /// Derives portals from the tree.
    ///
    /// # Errors
    ///
    /// [`BspError::Fences`] where the tree doesn't tell what can be looked through.
    pub fn level(&self) -> Result<Derived, BspError> {
        let (portals, slivers) = self.portals()?;
        Ok(Derived { level: Level { cells: self.leaves(), portals, rounding: 0.0 }, slivers })
    }

    /// The leaf (leaf `i + 1` at `i`) that holds a place, in the level's own coordinates; `None` in solid, and beyond the level.
    pub fn leaf_at(&self, place: DVec3) -> Option<usize> {
        let leaf = self.tree.leaf_at(place);
        (1..=self.leaves()).contains(&leaf).then(|| leaf - 1)
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

    /// How loud each leaf (leaf `i + 1` at `i`) hears water, sky, slime and lava, 0 to 255. `rows` and `clusters` as for [`Self::with_rows`].
    ///
    /// # Errors
    ///
    /// A leaf whose faces don't exist.
    ///
    /// # Panics
    ///
    /// If `clusters` hasn't an entry for each leaf, or `rows` no row for each cluster.
    pub fn ambient_levels(&self, rows: &BitMatrix, clusters: &[u32]) -> Result<Vec<[u8; SOUNDS]>, BspError> {
        assert_eq!(clusters.len(), self.leaves(), "a cluster for each leaf");
        ambient::levels(self, rows, clusters)
    }

    /// The ambient levels that the file has, a leaf each as in [`Self::ambient_levels`].
    pub fn own_ambient_levels(&self) -> Vec<[u8; SOUNDS]> {
        lump::ambient(self)
    }

    /// The file with other rows: `rows` of clusters, and the cluster of each leaf (leaf `i + 1` at `i`); and with `ambient` levels, where
    /// there are some. But for the visibility lump, the leaves' offsets into it, those levels and the directory's offsets, every byte is
    /// as it was.
    ///
    /// # Errors
    ///
    /// [`BspError::TooLong`], and damage in what follows the lumps.
    ///
    /// # Panics
    ///
    /// If `clusters` or `ambient` hasn't an entry for each leaf, or `rows` no row for each cluster.
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
