//! The portal graph of a game level, from any file.

use enfilade::types::level::LevelPortal;
use glam::DVec3;

/// Greatest coordinate, in the level's units, so that products of coordinates stay precise.
pub const FARTHEST: f64 = 1e7;
/// Maximum clusters: rows take the square of their number in bits (2 GiB here).
pub const MOST_CLUSTERS: u64 = 1 << 17;

/// A finished portal graph, as in a `.prt` file. Lengths may be in any unit.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Level {
    /// Number of cells (clusters, if the file has clusters).
    pub cells: usize,
    /// Portals; each is crossed both ways.
    pub portals: Vec<LevelPortal>,
    /// Half of the last decimal place of coordinates, in their unit; 0 if they are not rounded.
    pub rounding: f64,
}

impl Level {
    /// The winding of a portal, `2 * portal + side`: counter-clockwise as seen from the cell that it leads into.
    pub(crate) fn winding(&self, directed: u32) -> Vec<DVec3> {
        let mut winding = self.portals[directed as usize / 2].winding.clone();
        if directed % 2 == 1 {
            winding.reverse();
        }
        winding
    }
}
