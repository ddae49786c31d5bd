//! Potentially visible sets of cells, with both bounds.
//!
//! [`bake`] is the main path. The lower bound: [`sampling`], with the engines of [`cubes`]. The upper bound: `flow`, `backfaces`, then
//! `occluders`. Contradictions between the two: `repair`. Undecided pairs: `gap`. A bake after an edit: `again`. Both bounds for regions across cells: `view_cells`, which
//! a user gives or [`partition`] chooses by cost. Common rows of neighbours: [`clusters`]. Single pairs with a proof: `pair_proof`.

pub mod again;
mod backfaces;
mod bake;
mod beyond;
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
pub(crate) mod ways_in;

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
    /// The cells and portals: those of the input, with added portals where proofs showed that one was missing.
    pub graph: CellGraph,
    /// Cells x cells; the diagonal is set.
    pub cells_lower: BitMatrix,
    /// Cells x cells; the diagonal is set.
    pub cells_upper: BitMatrix,
    /// Cells x objects.
    pub objects_lower: BitMatrix,
    /// Cells x objects.
    pub objects_upper: BitMatrix,
    /// The objects in each cell.
    pub placement: Placement,
    /// Cells x objects: pairs that rays reached or shafts tested, but that are undecided down to the tolerance.
    pub unresolved: BitMatrix,
    /// One for each pair of `objects_lower`, ordered by cell, then object.
    pub witnesses: Vec<Witness>,
    /// Confidence bound of the unseen part; `None` without test rays.
    pub unseen: Option<Unseen>,
    /// The reason for the end of sampling.
    pub sampling_end: SamplingEnd,
    /// Whether all steps were done; else it was stopped, and more pairs are undecided than would be.
    pub is_whole: bool,
    /// The bound to ship.
    pub guarantee: Guarantee,
    /// For each cell, the number of cells joined into it ([`clusters`]); empty if none were joined.
    pub clusters: Vec<u32>,
    /// Repaired holes.
    pub repairs: Vec<Repair>,
    /// Counters.
    pub stats: PvsStats,
    /// What became of the last bake's pairs, if there was one.
    pub again: Option<again::Again>,
}

/// Memory of a witness during a bake, bytes.
pub const WITNESS_BYTES: u64 = (size_of::<Witness>() + size_of::<DVec3>()) as u64;
