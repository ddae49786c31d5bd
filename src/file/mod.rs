//! The `.pvs` container: what the run time needs, and what a reader wants to know about how it came to be.
//!
//! [`PvsFile`] is a decoded file: [`PvsFile::from_bake`] makes one, [`PvsFile::save`] and [`PvsFile::load`] keep it on disk.
//! [`Container`] is a file whose table has been read and nothing else.
//! The bytes are drawn in docs/format.md.

mod bytes;
mod codes;
mod error;
mod format;
mod frame;
#[cfg(feature = "bake")]
mod graph;
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
pub use load::load_bytes;
#[cfg(feature = "bake")]
pub use rows::{decode_rows, entropy_bits_per_pair};
#[cfg(feature = "bake")]
pub use summary::{FileSummary, GapSummary, PortalsSummary, PvsSummary, SectionSummary, UnseenSummary, ViewCellsSummary};
#[cfg(feature = "bake")]
pub use write::{encode_rows, replace_file, replace_file_by};

use crate::bits::ones;
use crate::geom::Aabb;
use crate::tolerance::Tolerance;
pub use crate::types::gap::Gap;
use crate::types::guarantee::Guarantee;
#[cfg(feature = "bake")]
use crate::types::import::ImportOptions;
use crate::types::placed::PlacedBox;
use crate::types::portal::{PortalKind, PortalState};
use crate::types::proof::{Repair, Witness};
use crate::types::stats::PvsStats;
use crate::types::strategy::Strategy;
use crate::types::view_cell_name::ViewCellName;
use crate::{BitMatrix, CellId, ObjectId};
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
    /// How the model was imported: another import has other objects, and another hash.
    pub import: Import,
    /// How the cells were found.
    pub strategy: Strategy,
    /// Why so.
    pub reason: String,
    /// Openings narrower than this, metres, may have been sealed on purpose.
    pub smallest_hole: f64,
    /// Holes that count as opaque, convex polygons: too small for the user (`--smallest-hole`), or walls of a level that are not drawn.
    pub closed_holes: Vec<Vec<Vec3>>,
    /// For each cell, how many it was joined from once visibility was known, 1 or more; empty: each is as it was found.
    pub clusters: Vec<u32>,
    /// What was left out of this file, one line each, with the reason.
    pub left_out: Vec<String>,
    /// Notes of the importer and of the split, what matters most first; no details.
    pub notes: Vec<String>,
    /// Cells.
    pub cells: Vec<FileCell>,
    /// Portals.
    pub portals: Vec<FilePortal>,
    /// Objects.
    pub objects: Vec<FileObject>,
    /// Cells x objects: which objects are in which cell.
    pub placement: BitMatrix,
    /// The part of each object in each of its cells, one for each bit of the placement, in order; `None`: what of the object's box is in
    /// the cell's.
    pub placed: Option<Vec<PlacedBox>>,
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
    /// How much there is to see from each cell that is in no lower set, at most; `None` where that wasn't tested.
    pub unseen: Option<Unseen>,
    /// What is undecided; `None` where nothing is, or nobody says.
    pub gap: Option<Gap>,
    /// Regions that rows were asked for on top of the cells.
    pub views: Views,
}

impl PvsFile {
    /// The clearance that [`Guarantee::STATEMENT`] speaks of, metres: [`crate::tolerance::Tolerance::clearance`] of the objects' extent.
    pub fn clearance(&self) -> f64 {
        let corners = self.objects.iter().flat_map(|o| o.bounds).map(|p| p.as_dvec3());
        Tolerance::for_extent(Aabb::of(corners).diagonal()).clearance
    }
}

/// View cells and what is seen from them. Where there are none, there is nothing else either.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Views {
    /// View cells.
    pub cells: Vec<FileViewCell>,
    /// View cells x objects, as far as [`PvsFile::guarantee`] goes; `None` where every view cell sees everything.
    pub rows: Option<BitMatrix>,
    /// Both sides, if they were kept.
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
    /// A segment for each pair of `lower`, in order: from a point in the view cell to a point on the object.
    pub witnesses: Vec<[DVec3; 2]>,
}

/// How the model was imported.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct Import {
    /// Most triangles an object may have; 1 or more.
    pub object_triangles: u32,
    /// Metres per unit of the source, above 0; `None`: the format's own.
    pub metres_per_unit: Option<f64>,
    /// Whether the source's +Z is up, in formats whose +Y is otherwise.
    pub z_up: bool,
    /// Radius of tubes along lines that have none of their own, metres, above 0.
    pub tube_radius: Option<f64>,
    /// Whether pipes are tubes, where there are many.
    pub tubes: bool,
    /// No hole of a map that is wider lets anything out, metres, above 0; `None`: 0.2 of its units.
    pub smallest_hole: Option<f64>,
}

impl Import {
    /// What imports the model in the same way.
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
    /// What stands in it, as the model was.
    pub state: PortalState,
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

impl PvsFile {
    /// One closed cell that nothing leads out of: its row would hide the backs of its walls at most, so such a file has no rows.
    pub(crate) fn is_one_hall(&self) -> bool {
        self.portals.is_empty() && self.cells.iter().filter(|cell| !cell.open).count() == 1
    }

    /// Whether `cell` sees `object`, as far as [`PvsFile::guarantee`] goes.
    #[inline]
    pub fn sees_object(&self, cell: CellId, object: ObjectId) -> bool {
        self.object_rows.as_ref().is_none_or(|rows| rows.get(cell.index(), object.index()))
    }

    /// Whether one cell sees another, as far as [`PvsFile::guarantee`] goes. A cell sees itself.
    #[inline]
    pub fn sees_cell(&self, from: CellId, to: CellId) -> bool {
        from == to || self.cell_rows.as_ref().is_none_or(|rows| rows.get(from.index(), to.index()))
    }

    /// The words of a cell's object row, a bit an object; `None`: it sees every object.
    #[inline]
    pub fn object_row(&self, cell: CellId) -> Option<&[u64]> {
        self.object_rows.as_ref().map(|rows| rows.row(cell.index()))
    }

    /// The words of a cell's cell row, a bit a cell; `None`: it sees every cell.
    #[inline]
    pub fn cell_row(&self, cell: CellId) -> Option<&[u64]> {
        self.cell_rows.as_ref().map(|rows| rows.row(cell.index()))
    }

    /// The position of a view cell in [`Views::cells`], and so its row, by its id.
    pub fn view_cell(&self, id: &ViewCellName) -> Option<usize> {
        self.views.cells.iter().position(|cell| cell.id == *id)
    }

    /// The words of a view cell's object row, a bit an object; `None`: it sees every object.
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

/// The set bits of a row, or all `n` where there is no row.
fn seen(row: Option<&[u64]>, n: usize) -> impl Iterator<Item = usize> + '_ {
    let all = if row.is_none() { 0..n } else { 0..0 };
    row.into_iter().flat_map(ones).chain(all)
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
