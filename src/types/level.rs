//! A portal of a game level, independent of the file format.

use glam::DVec3;

/// A convex planar polygon between two cells.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct LevelPortal {
    /// The normal ([`crate::math::geom::newell`]) points from `cells[0]` into `cells[1]`.
    pub cells: [u32; 2],
    /// Corners, counter-clockwise seen from the tip of that normal; 3 or more.
    pub winding: Vec<DVec3>,
}
