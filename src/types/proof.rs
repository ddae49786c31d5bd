//! Segments as proofs of a bake.

use crate::{CellId, ObjectId};
use glam::DVec3;

/// Proof that something is visible: an unobstructed segment from a point in `cell` to a point on `object`.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Witness {
    /// The cell.
    pub cell: CellId,
    /// The object.
    pub object: ObjectId,
    /// A point in the cell, metres relative to the scene's origin.
    pub from: DVec3,
    /// A point on the object.
    pub to: DVec3,
}

/// A hole in the cell graph that a witness proved, and its repair.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Repair {
    /// The two cells between which the segment passed without a portal.
    pub cells: [CellId; 2],
    /// Its place.
    pub at: DVec3,
    /// The segment.
    pub segment: [DVec3; 2],
}
