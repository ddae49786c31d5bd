//! What can be seen from each cell: both sides of it.
//!
//! [`bake`] is the main path. The lower bound: [`sampling`], with the engines of [`cubes`]. The upper bound: `flow`, `backfaces`,
//! then `occluders`. Where the two contradict each other: `repair`. What stays between them: `gap`. Both for regions across cells:
//! `view_cells`, which a user gives or [`partition`] chooses by cost.
//! Rows that neighbours share: [`clusters`].
//! Single pairs once more, with the reason: `pair_proof`.

mod backfaces;
mod bake;
pub mod budget;
pub mod clusters;
pub mod cubes;
mod facets;
pub mod flow;
mod gap;
mod occluders;
mod options;
pub mod pair_proof;
pub mod partition;
mod repair;
pub mod sampling;
mod triangles;
pub mod view_cells;

pub use crate::types::bounds::{CONFIDENCE, SamplingEnd, Unseen};
pub use crate::types::guarantee::Guarantee;
pub use crate::types::proof::{Repair, Witness};
pub use crate::types::stats::PvsStats;
pub use bake::bake;
pub(crate) use bake::bake_by;
pub use options::PvsOptions;

use crate::BitMatrix;
use crate::cells::{CellGraph, Placement};
use glam::DVec3;

/// The result of a bake: lower and upper sets over cells and over objects. `lower` is a subset of `upper`.
#[derive(Clone, PartialEq, Debug)]
pub struct Pvs {
    /// The cells and portals that the sets are of: those that the bake was given, with a portal more wherever a proof shows that one was
    /// missing.
    pub graph: CellGraph,
    /// Cells x cells; the diagonal is set.
    pub cells_lower: BitMatrix,
    /// Cells x cells; the diagonal is set.
    pub cells_upper: BitMatrix,
    /// Cells x objects.
    pub objects_lower: BitMatrix,
    /// Cells x objects.
    pub objects_upper: BitMatrix,
    /// Which objects are in which cell.
    pub placement: Placement,
    /// Cells x objects: pairs that rays reached or shafts closed in on, but nothing clears or shuts down to the tolerance.
    pub unresolved: BitMatrix,
    /// One for each pair of `objects_lower`, ordered by cell, then object.
    pub witnesses: Vec<Witness>,
    /// How much there is to see that nobody has seen, at most; `None` where no rays were cast to tell.
    pub unseen: Option<Unseen>,
    /// What ended sampling.
    pub sampling_end: SamplingEnd,
    /// Which side to ship.
    pub guarantee: Guarantee,
    /// For each cell, how many it was joined from ([`clusters`]); empty where each is as it was found.
    pub clusters: Vec<u32>,
    /// Holes found and mended.
    pub repairs: Vec<Repair>,
    /// Counters.
    pub stats: PvsStats,
}

/// What a witness takes while it is worked with, bytes.
pub const WITNESS_BYTES: u64 = (size_of::<Witness>() + size_of::<DVec3>()) as u64;
