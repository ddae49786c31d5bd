//! What can be seen from each cell: both sides of it.

pub mod flow;

use crate::cells::CellGraph;
use crate::scene::Scene;
use crate::{BitMatrix, CellId, ObjectId};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Which side of the truth a file's rows are on.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Guarantee {
    /// Rows are the upper set: nothing visible is missing.
    Conservative,
    /// Rows are the lower set: everything in them is visible; something may be missing.
    Sampled,
}

/// How to bake.
#[derive(Clone, PartialEq, Debug)]
pub struct PvsOptions {
    /// Which side the rows take.
    pub ship: Guarantee,
    /// Seed of every random choice.
    pub seed: u64,
    /// Rays over the whole bake, in millions: the sampling budget; a count, so that the bytes don't depend on the machine.
    pub ray_budget: u64,
    /// Steps of portal flow that one source portal may take before its remaining targets are left "visible" and counted.
    pub flow_steps: u64,
}

impl Default for PvsOptions {
    fn default() -> Self {
        Self { ship: Guarantee::Conservative, seed: 0, ray_budget: 20_000_000, flow_steps: 200_000 }
    }
}

/// Proof that something is visible: an unobstructed segment from a point in `cell` to a point on `object`.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Witness {
    /// From where.
    pub cell: CellId,
    /// What.
    pub object: ObjectId,
    /// A point in the cell, metres relative to the scene's origin.
    pub from: DVec3,
    /// A point on the object.
    pub to: DVec3,
}

/// A hole in the cell graph that a witness proved, and what was done.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Repair {
    /// The two cells between which the segment passed without a portal.
    pub cells: [CellId; 2],
    /// Where it passed.
    pub at: DVec3,
    /// The segment.
    pub segment: [DVec3; 2],
}

/// What the bake did, for the report; times are kept out of the file, so that its bytes don't depend on the machine.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct PvsStats {
    /// Rays cast.
    pub rays: u64,
    /// Visibility cubes placed.
    pub cubes: u64,
    /// Steps of portal flow.
    pub flow_steps: u64,
    /// Source portals whose flow ran out of steps and kept what might be seen.
    pub flow_capped: u64,
    /// Rays that ended outside the upper set but not with a witness's clearance: cracks, not holes.
    pub cracks: u64,
}

/// The result of a bake: lower and upper sets over cells and over objects. `lower` is a subset of `upper`.
#[derive(Clone, PartialEq, Debug)]
pub struct Pvs {
    /// Cells x cells; the diagonal is set.
    pub cells_lower: BitMatrix,
    /// Cells x cells; the diagonal is set.
    pub cells_upper: BitMatrix,
    /// Cells x objects.
    pub objects_lower: BitMatrix,
    /// Cells x objects.
    pub objects_upper: BitMatrix,
    /// Cells x objects: which objects are in which cell.
    pub placement: BitMatrix,
    /// One for each pair of `objects_lower`, ordered by cell, then object.
    pub witnesses: Vec<Witness>,
    /// Which side to ship.
    pub guarantee: Guarantee,
    /// Holes found and mended.
    pub repairs: Vec<Repair>,
    /// Counters.
    pub stats: PvsStats,
}

/// Progress as a fraction of the work, called from any thread; stages are named.
pub type Progress<'p> = &'p (dyn Fn(&str, f64) + Sync);

/// Works out what can be seen from every cell. `graph` is changed only where a witness proves that a portal is missing.
pub fn bake(_scene: &Scene, _graph: &mut CellGraph, _options: &PvsOptions, _progress: Progress<'_>) -> Pvs {
    todo!()
}
