//! The `.pvs` container: what the run time needs, and what a reader wants to know about how it came to be.

use crate::cells::{PortalKind, Strategy};
use crate::pvs::{Guarantee, PvsStats, Repair, Witness};
use crate::{BitMatrix, CellId};
use glam::{DVec3, Vec3, Vec4};

/// A decoded file. Geometry is `f32`, metres, relative to [`PvsFile::origin`].
#[derive(Clone, PartialEq, Debug)]
pub struct PvsFile {
    /// [`crate::scene::Scene::hash`] of the model that it was baked for.
    pub model_hash: u128,
    /// Added to positions to get the model's own coordinates.
    pub origin: DVec3,
    /// What the rows promise.
    pub guarantee: Guarantee,
    /// How the cells were found.
    pub strategy: Strategy,
    /// Why so.
    pub reason: String,
    /// Openings narrower than this, metres, may have been sealed on purpose.
    pub smallest_hole: f64,
    /// What was left out of this file, one line each, with the reason.
    pub left_out: Vec<String>,
    /// Notes of the importer and of the split.
    pub notes: Vec<String>,
    /// Cells.
    pub cells: Vec<FileCell>,
    /// Portals.
    pub portals: Vec<FilePortal>,
    /// Objects.
    pub objects: Vec<FileObject>,
    /// Cells x objects: which objects are in which cell.
    pub placement: BitMatrix,
    /// Cells x cells; `None` where everything sees everything, or where there is only one cell.
    pub cell_rows: Option<BitMatrix>,
    /// Cells x objects; `None` where everything sees everything.
    pub object_rows: Option<BitMatrix>,
    /// Both sides, if they were kept.
    pub bounds: Option<Bounds>,
    /// Numbers of set pairs on both sides, always kept.
    pub pairs: PairCounts,
    /// Holes found in the cell graph and mended.
    pub repairs: Vec<Repair>,
    /// The bake's counters.
    pub stats: PvsStats,
}

/// A cell.
#[derive(Clone, PartialEq, Debug)]
pub struct FileCell {
    /// Name.
    pub name: String,
    /// The author's id.
    pub source: Option<String>,
    /// Culling is done online here.
    pub open: bool,
    /// Convex pieces, each a list of planes `(n, d)`, inside `n . p <= d`.
    pub pieces: Vec<Vec<Vec4>>,
}

/// A portal; conventions as in [`crate::cells::Portal`].
#[derive(Clone, PartialEq, Debug)]
pub struct FilePortal {
    /// From, to.
    pub cells: [CellId; 2],
    /// `(n, d)`, normal from `cells[0]` into `cells[1]`.
    pub plane: Vec4,
    /// Corners.
    pub winding: Vec<Vec3>,
    /// What it is.
    pub kind: PortalKind,
    /// The author's id.
    pub source: Option<String>,
}

/// An object.
#[derive(Clone, PartialEq, Debug)]
pub struct FileObject {
    /// Node name or GlobalId.
    pub node: String,
    /// Number of triangles.
    pub triangles: u32,
    /// Box, rounded outwards.
    pub bounds: [Vec3; 2],
}

/// Lower and upper sets, and the proofs.
#[derive(Clone, PartialEq, Debug)]
pub struct Bounds {
    /// Cells x cells.
    pub cells_lower: BitMatrix,
    /// Cells x cells.
    pub cells_upper: BitMatrix,
    /// Cells x objects.
    pub objects_lower: BitMatrix,
    /// Cells x objects.
    pub objects_upper: BitMatrix,
    /// One for each pair of `objects_lower`.
    pub witnesses: Vec<Witness>,
}

/// How many pairs each side holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct PairCounts {
    /// Cell-object pairs with a witness.
    pub lower: u64,
    /// Cell-object pairs not proven hidden.
    pub upper: u64,
    /// Cell-cell pairs with a witness.
    pub cell_lower: u64,
    /// Cell-cell pairs not proven hidden.
    pub cell_upper: u64,
}
