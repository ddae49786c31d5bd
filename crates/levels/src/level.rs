//! What a game's level is made of, whatever file it comes from.

use enfilade::types::level::LevelPortal;
use glam::DVec3;

/// No coordinate is farther from the origin than this, in the level's units: products of coordinates stay exact enough.
pub const FARTHEST: f64 = 1e7;
/// Most clusters, as rows take their number squared in bits (2 GiB here).
pub const MOST_CLUSTERS: u64 = 1 << 17;

/// A ready portal graph: what a `.prt` file holds. Lengths are in any unit; nothing depends on which.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Level {
    /// Number of cells (clusters, where the file has clusters).
    pub cells: usize,
    /// Portals; each is crossed both ways.
    pub portals: Vec<LevelPortal>,
    /// Half of the last place to which coordinates were rounded, in their unit; 0: they are exact, as far as anybody knows.
    pub rounding: f64,
}

impl Level {
    /// The winding of a portal, `2 * portal + side`: counter-clockwise seen from the cell that it leads into.
    pub(crate) fn winding(&self, directed: u32) -> Vec<DVec3> {
        let mut winding = self.portals[directed as usize / 2].winding.clone();
        if directed % 2 == 1 {
            winding.reverse();
        }
        winding
    }
}
