//! What a game's level is made of, whatever file it comes from.

use glam::DVec3;

/// No coordinate is farther from the origin than this, in the level's units: products of coordinates stay exact enough.
pub const FARTHEST: f64 = 1e7;
/// Most clusters, as rows take their number squared in bits (2 GiB here).
pub const MOST_CLUSTERS: u64 = 1 << 17;

/// A convex planar polygon between two cells.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct LevelPortal {
    /// The normal ([`crate::geom::newell`]) leads from `cells[0]` into `cells[1]`.
    pub cells: [u32; 2],
    /// Corners, counter-clockwise seen from the tip of that normal; 3 or more, any number.
    pub winding: Vec<DVec3>,
}

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
