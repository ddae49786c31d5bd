//! The `.pvs` container: the data for the run time, and information about the bake.
//!
//! [`PvsFile`] is a decoded file: [`PvsFile::from_bake`] makes one, [`PvsFile::save`] and [`PvsFile::load`] keep it on disk. [`Container`]
//! is a file of which only the table is read. docs/format.md describes the bytes.

mod bytes;
mod codes;
mod error;
mod format;
mod frame;
#[cfg(feature = "bake")]
mod graph;
mod keys;
mod lines;
mod load;
mod read;
mod rows;
#[cfg(feature = "bake")]
mod summary;
#[cfg(feature = "bake")]
mod write;

pub use crate::types::bounds::{CONFIDENCE, Unseen};
pub use error::FileError;
#[cfg(feature = "bake")]
pub use format::{Container, MAGIC, Section, SectionId, VERSION};
#[cfg(feature = "bake")]
pub use load::load_bytes;
#[cfg(feature = "bake")]
pub use rows::{decode_rows, entropy_bits_per_pair};
#[cfg(feature = "bake")]
pub use summary::{FileSummary, GapSummary, PortalsSummary, PvsSummary, SectionSummary, UnseenSummary, ViewCellsSummary};
#[cfg(feature = "bake")]
pub use write::{encode_rows, replace_file, replace_file_by};

use crate::math::bits::ones;
use crate::math::geom::Aabb;
use crate::math::tolerance::Tolerance;
pub use crate::types::gap::Gap;
pub use crate::types::guarantee::Guarantee;
#[cfg(feature = "bake")]
use crate::types::import::ImportOptions;
pub use crate::types::placed::PlacedBox;
pub use crate::types::portal::{PortalKind, PortalState};
pub use crate::types::proof::{Repair, Witness};
pub use crate::types::stats::PvsStats;
pub use crate::types::strategy::Strategy;
pub use crate::types::view_cell_name::ViewCellName;
use crate::{BitMatrix, CellId, DirectedPortal, ObjectId};
use glam::{DVec3, Vec3, Vec4};

/// A decoded file. Geometry is `f32`, metres, relative to [`PvsFile::origin`].
#[derive(Clone, PartialEq, Debug)]
pub struct PvsFile {
    /// [`crate::scene::Scene::hash`] of its model.
    pub model_hash: u128,
    /// Added to positions to get the model's own coordinates.
    pub origin: DVec3,
    /// The guarantee of the rows.
    pub guarantee: Guarantee,
    /// Options of the import: another import has other objects, and another hash.
    pub import: Import,
    /// The strategy of the split.
    pub strategy: Strategy,
    /// The reason for it.
    pub reason: String,
    /// Narrower openings may have been sealed on purpose, metres.
    pub smallest_hole: f64,
    /// Convex polygons of holes that count as opaque: below the user's limit (`--smallest-hole`), or undrawn walls of a level.
    pub closed_holes: Vec<Vec<Vec3>>,
    /// For each cell, the number of cells joined into it after visibility, 1 or more; empty: none were joined.
    pub clusters: Vec<u32>,
    /// Omissions of this file, one line each, with the reason.
    pub left_out: Vec<String>,
    /// Notes of the import and the split, most important first; no details.
    pub notes: Vec<String>,
    /// Cells.
    pub cells: Vec<FileCell>,
    /// Portals.
    pub portals: Vec<FilePortal>,
    /// Objects.
    pub objects: Vec<FileObject>,
    /// Cells x objects: the objects in each cell.
    pub placement: BitMatrix,
    /// Box of each object's part in each of its cells, one for each bit of the placement, in order; `None`: the intersection of the
    /// object's box and the cell's.
    pub placed: Option<Vec<PlacedBox>>,
    /// Cells x cells; `None` if all bits are set, or if there is only one cell.
    pub cell_rows: Option<BitMatrix>,
    /// Cells x objects; `None` if all bits are set.
    pub object_rows: Option<BitMatrix>,
    /// Both bounds, if kept.
    pub bounds: Option<Bounds>,
    /// Numbers of set pairs in both bounds, always kept.
    pub pairs: PairCounts,
    /// Repaired holes in the cell graph.
    pub repairs: Vec<Repair>,
    /// The bake's counters.
    pub stats: PvsStats,
    /// Confidence bounds of the unseen parts; `None` if not tested.
    pub unseen: Option<Unseen>,
    /// Undecided pairs; `None` if there are none, or if unknown.
    pub gap: Option<Gap>,
    /// View cells with their rows.
    pub views: Views,
    /// Rows of bodies that go some metres, if kept.
    pub relevance: Option<FileRelevance>,
    /// Rows of portals that lead in from outside, if kept.
    pub ways_in: Option<FileWaysIn>,
    /// Digests of the model, and of the options and the program of the bake ([`Digest::of_and_how`](crate::job::Digest::of_and_how)): another
    /// bake with the same has the same result. `None`: unknown.
    pub bake: Option<[u128; 2]>,
}

impl PvsFile {
    /// The clearance in [`Guarantee::STATEMENT`], metres: [`crate::math::tolerance::Tolerance::clearance`] of the objects' extent.
    pub fn clearance(&self) -> f64 {
        let corners = self.objects.iter().flat_map(|o| o.bounds).map(|p| p.as_dvec3());
        Tolerance::for_extent(Aabb::of(corners).diagonal()).clearance
    }
}

/// What may be seen from where a body may soon be ([`Relevance`](crate::runtime::Relevance)), according to [`PvsFile::guarantee`].
#[derive(Clone, PartialEq, Debug)]
pub struct FileRelevance {
    /// How far a body goes through doors, metres; 0 or more.
    pub metres: f64,
    /// Cells x cells.
    pub cells: BitMatrix,
    /// Cells x objects.
    pub objects: BitMatrix,
}

/// What portals that lead in from outside show of what is behind them, from anywhere before them, according to [`PvsFile::guarantee`]: for
/// modules that are joined ([`World`](crate::runtime::World)).
#[derive(Clone, PartialEq, Debug)]
pub struct FileWaysIn {
    /// The portals, in the direction inwards, ascending.
    pub portals: Vec<DirectedPortal>,
    /// Portals x cells.
    pub cells: BitMatrix,
    /// Portals x objects.
    pub objects: BitMatrix,
}

/// View cells and their visibility. Without view cells, all other fields are empty.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Views {
    /// View cells.
    pub cells: Vec<FileViewCell>,
    /// View cells x objects, according to [`PvsFile::guarantee`]; `None` if all bits are set.
    pub rows: Option<BitMatrix>,
    /// Both bounds, if kept.
    pub bounds: Option<ViewBounds>,
}

/// A view cell.
#[derive(Clone, PartialEq, Debug)]
pub struct FileViewCell {
    /// The author's id.
    pub id: ViewCellName,
    /// Convex pieces, each a list of planes `(n, d)`, inside `n . p <= d`.
    pub pieces: Vec<Vec<Vec4>>,
}

/// Lower and upper sets of view cells, and the proofs.
#[derive(Clone, PartialEq, Debug)]
pub struct ViewBounds {
    /// View cells x objects.
    pub lower: BitMatrix,
    /// View cells x objects.
    pub upper: BitMatrix,
    /// A segment for each pair of `lower`, in order, from a point in the view cell to a point on the object.
    pub witnesses: Vec<[DVec3; 2]>,
}

/// Options of the import.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct Import {
    /// Most triangles of an object; 1 or more.
    pub object_triangles: u32,
    /// Metres per unit of the source, above 0; `None`: the format's own.
    pub metres_per_unit: Option<f64>,
    /// Whether the source's +Z is up, in formats whose default is +Y.
    pub z_up: bool,
    /// Radius of tubes along lines without a radius, metres, above 0.
    pub tube_radius: Option<f64>,
    /// Whether pipes become tubes, if there are many.
    pub tubes: bool,
    /// Holes of a map up to this width count as closed, metres, above 0; `None`: 0.2 of its units.
    pub smallest_hole: Option<f64>,
}

impl Import {
    /// The options for the same import.
    #[cfg(feature = "bake")]
    pub fn options(&self) -> ImportOptions {
        let Self { object_triangles, metres_per_unit, z_up, tube_radius, tubes, smallest_hole } = *self;
        ImportOptions {
            object_triangles,
            metres_per_unit,
            z_up,
            tube_radius,
            tubes,
            smallest_hole,
            ..ImportOptions::default()
        }
    }
}

/// A cell.
#[derive(Clone, PartialEq, Debug)]
pub struct FileCell {
    /// Name.
    pub name: String,
    /// The author's id.
    pub source: Option<String>,
    /// Whether culling is online here.
    pub open: bool,
    /// Convex pieces, each a list of planes `(n, d)`, inside `n . p <= d`.
    pub pieces: Vec<Vec<Vec4>>,
}

/// A portal; conventions as in [`crate::cells::Portal`].
#[derive(Clone, PartialEq, Debug)]
pub struct FilePortal {
    /// The cells behind and in front of the plane.
    pub cells: [CellId; 2],
    /// `(n, d)`, normal from `cells[0]` into `cells[1]`.
    pub plane: Vec4,
    /// Corners.
    pub winding: Vec<Vec3>,
    /// Door, window or opening.
    pub kind: PortalKind,
    /// Its state in the model.
    pub state: PortalState,
    /// The author's id; not always there, and several portals may have the same. [`PvsFile::portal_keys`] are.
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

impl PvsFile {
    /// True for one closed cell without portals: its row would hide at most the backs of its walls, so such a file has no rows.
    pub(crate) fn is_one_hall(&self) -> bool {
        self.portals.is_empty() && self.cells.iter().filter(|cell| !cell.open).count() == 1
    }

    /// Whether `cell` sees `object`, according to [`PvsFile::guarantee`].
    #[inline]
    pub fn sees_object(&self, cell: CellId, object: ObjectId) -> bool {
        self.object_rows.as_ref().is_none_or(|rows| rows.get(cell.index(), object.index()))
    }

    /// Whether one cell sees another, according to [`PvsFile::guarantee`]. A cell sees itself.
    #[inline]
    pub fn sees_cell(&self, from: CellId, to: CellId) -> bool {
        from == to || self.cell_rows.as_ref().is_none_or(|rows| rows.get(from.index(), to.index()))
    }

    /// The words of a cell's object row, a bit per object; `None`: it sees every object.
    #[inline]
    pub fn object_row(&self, cell: CellId) -> Option<&[u64]> {
        self.object_rows.as_ref().map(|rows| rows.row(cell.index()))
    }

    /// The words of a cell's cell row, a bit per cell; `None`: it sees every cell.
    #[inline]
    pub fn cell_row(&self, cell: CellId) -> Option<&[u64]> {
        self.cell_rows.as_ref().map(|rows| rows.row(cell.index()))
    }

    /// The index of a view cell in [`Views::cells`], and so of its row, by its id.
    pub fn view_cell(&self, id: &ViewCellName) -> Option<usize> {
        self.views.cells.iter().position(|cell| cell.id == *id)
    }

    /// The words of a view cell's object row, a bit per object; `None`: it sees every object.
    #[inline]
    pub fn view_row(&self, view_cell: usize) -> Option<&[u64]> {
        self.views.rows.as_ref().map(|rows| rows.row(view_cell))
    }

    /// The objects that a view cell sees, ascending.
    pub fn objects_seen_from_view(&self, view_cell: usize) -> impl Iterator<Item = ObjectId> + '_ {
        seen(self.view_row(view_cell), self.objects.len()).map(|i| ObjectId(i as u32))
    }

    /// The objects that a cell sees, ascending.
    pub fn objects_seen(&self, cell: CellId) -> impl Iterator<Item = ObjectId> + '_ {
        seen(self.object_row(cell), self.objects.len()).map(|i| ObjectId(i as u32))
    }

    /// The cells that a cell sees, ascending.
    pub fn cells_seen(&self, cell: CellId) -> impl Iterator<Item = CellId> + '_ {
        seen(self.cell_row(cell), self.cells.len()).map(|i| CellId(i as u32))
    }
}

/// The set bits of a row, or all `n` without a row.
fn seen(row: Option<&[u64]>, n: usize) -> impl Iterator<Item = usize> + '_ {
    let all = if row.is_none() { 0..n } else { 0..0 };
    row.into_iter().flat_map(ones).chain(all)
}

/// Numbers of pairs in each bound.
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
