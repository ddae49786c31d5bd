//! The culler: a `.pvs` file laid out for queries by cameras.

use super::boxes::Boxes;
use super::locate::{Homes, Locator, piece_bounds};
use crate::file::{FileCell, FilePortal, FileWaysIn, PvsFile};
use crate::math::bits::BitMatrix;
use crate::math::geom::Aabb;
use crate::math::sorting;
use crate::math::tolerance::single_precision;
use crate::types::guarantee::Guarantee;
use crate::types::portal::PortalKind;
use crate::{CellId, DirectedPortal, ObjectId, PortalId};
use glam::{Vec3, Vec4};
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// Lists of different lengths, concatenated in one array.
#[derive(Clone, Debug)]
pub(super) struct Lists<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T> Lists<T> {
    pub fn new<I: IntoIterator<Item = T>>(lists: impl IntoIterator<Item = I>) -> Self {
        let (mut starts, mut items) = (vec![0], Vec::new());
        for list in lists {
            items.extend(list);
            starts.push(items.len() as u32);
        }
        Self { starts, items }
    }

    #[inline]
    pub fn get(&self, i: usize) -> &[T] {
        &self.items[self.range(i)]
    }

    /// The range of a list in [`Self::items`].
    #[inline]
    pub fn range(&self, i: usize) -> Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// The items of all lists.
    #[inline]
    pub fn items(&self) -> &[T] {
        &self.items
    }
}

/// Margin of placement in cells, in tolerances: two clearances are less than 1.5 tolerances.
pub(super) const PLACED: f64 = 2.0;

/// A view cell's index in the file.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct ViewCellId(pub u32);

/// View cells with rows.
#[derive(Clone, Debug)]
pub(super) struct ViewCells {
    pub locator: Locator<ViewCellId>,
    /// View cells x objects.
    pub rows: BitMatrix,
}

/// The rows of a cell that was learned: objects and cells.
type Learned = [Box<[u64]>; 2];

/// A `.pvs` file laid out for queries by cameras: flat arrays, `f32`, nothing borrowed. It is shared and does not change; what a camera
/// changes is in its [`View`](super::View), the states of doors in [`Doors`](super::Doors).
#[derive(Debug)]
pub struct Culler {
    pub(super) tolerance: f64,
    pub(super) locator: Locator,
    /// Directed portals that lead out of each cell.
    pub(super) cell_portals: Lists<DirectedPortal>,
    /// Objects in each cell.
    pub(super) cell_objects: Lists<ObjectId>,
    /// `(n, d)` from `cells[0]` into `cells[1]`, by portal.
    pub(super) portal_planes: Vec<Vec4>,
    pub(super) portal_cells: Vec<[CellId; 2]>,
    pub(super) portal_corners: Lists<Vec3>,
    /// Portals shut by a solid leaf in the model.
    pub(super) found_shut: Vec<PortalId>,
    pub(super) windows: Vec<PortalId>,
    pub(super) boxes: Boxes,
    /// Boxes of objects' parts, in the order of `cell_objects`.
    pub(super) placed: Boxes,
    /// The box around each cell, with the margin of placement; `None` if it is unbounded.
    pub(super) cell_boxes: Vec<Option<[Vec3; 2]>>,
    /// First index of each object, and the end of the last, in an index buffer with the objects' triangles in their order.
    indices: Vec<u32>,
    triangles: Vec<u32>,
    /// Keys of portals, and the portals in their order.
    keys: Vec<String>,
    by_key: Vec<PortalId>,
    /// Whether each cell is open: outdoors, or without a roof.
    open_cells: Vec<bool>,
    object_rows: Option<BitMatrix>,
    cell_rows: Option<BitMatrix>,
    /// By cell: rows that were learned.
    learned: Vec<OnceLock<Learned>>,
    /// `None` if no view cell has a row.
    pub(super) views: Option<ViewCells>,
    /// Whether cells outside the row are certainly hidden.
    pub(super) cell_rows_prune: bool,
    /// Largest distance from the origin along an axis, metres.
    pub(super) extent: f64,
    /// The cells without an end.
    pub(super) outside: Vec<CellId>,
    /// The box around all other cells.
    pub(super) inside: Option<[Vec3; 2]>,
    /// The box around these and all objects.
    pub(super) whole: Option<[Vec3; 2]>,
    ways_in: Option<WaysIn>,
}

/// Rows of directed portals that lead in from outside.
#[derive(Clone, Debug)]
struct WaysIn {
    /// By directed portal: its row.
    of: Vec<Option<u32>>,
    /// Ways in x cells.
    cells: BitMatrix,
    /// Ways in x objects.
    objects: BitMatrix,
}

impl Culler {
    /// Lays out a file, for any number of views on any number of threads. The file must be consistent (ids in range, matrices of the right
    /// shape), as [`PvsFile::load`] ensures; otherwise panics.
    pub fn new(file: &PvsFile) -> Arc<Self> {
        let objects = file.objects.iter().fold(Aabb::EMPTY, |b, o| o.bounds.iter().fold(b, |b, p| b.with(p.as_dvec3())));
        let corners = file.portals.iter().flat_map(|p| &p.winding).map(|p| p.as_dvec3());
        let bounds = objects.union(Aabb::of(corners));
        let extent = if bounds.is_empty() { 1.0 } else { bounds.min.abs().max(bounds.max.abs()).max_element().max(1e-6) };
        // Portals are drawn up to `clearance` within the real opening in each direction of their plane, and stored as `f32`.
        let tolerance = file.clearance() * std::f64::consts::SQRT_2 + single_precision(extent);
        let mut leading_out = vec![Vec::new(); file.cells.len()];
        for (p, portal) in file.portals.iter().enumerate() {
            for side in 0..2 {
                leading_out[portal.cells[side].index()].push(PortalId(p as u32).directed(side as u32));
            }
        }
        let cell_objects = Lists::new((0..file.cells.len()).map(|c| file.placement.ones(c).map(|o| ObjectId(o as u32))));
        let cell_boxes: Vec<_> = file.cells.iter().map(|cell| cell_bounds(cell, extent, tolerance)).collect();
        let keys = file.portal_keys();
        let mut by_key: Vec<u32> = (0..keys.len() as u32).collect();
        sorting::sort(&mut by_key, &mut Vec::new(), &|a, b| keys[a as usize] < keys[b as usize]);
        let around = |boxes: &mut dyn Iterator<Item = [Vec3; 2]>| boxes.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)]);
        Arc::new(Self {
            tolerance,
            extent,
            outside: (0..).map(CellId).zip(&cell_boxes).filter(|(_, bounds)| bounds.is_none()).map(|(c, _)| c).collect(),
            inside: around(&mut cell_boxes.iter().copied().flatten()),
            whole: around(&mut file.objects.iter().map(|o| o.bounds).chain(cell_boxes.iter().copied().flatten())),
            ways_in: file.ways_in.as_ref().map(|FileWaysIn { portals, cells, objects }| {
                let mut of = vec![None; 2 * file.portals.len()];
                (0..).zip(portals).for_each(|(row, portal)| of[portal.0 as usize] = Some(row));
                WaysIn { of, cells: cells.clone(), objects: objects.clone() }
            }),
            locator: Locator::new((0..).map(CellId).zip(file.cells.iter().map(|c| &c.pieces[..])), extent, tolerance),
            cell_portals: Lists::new(leading_out),
            placed: Boxes::new(placed_bounds(file, &cell_objects, &cell_boxes)),
            cell_boxes,
            cell_objects,
            portal_planes: file.portals.iter().map(|p| p.plane).collect(),
            portal_cells: file.portals.iter().map(|p| p.cells).collect(),
            portal_corners: Lists::new(file.portals.iter().map(|p| p.winding.iter().copied())),
            found_shut: portals_of(file, |p| p.state.shut && !p.state.see_through && !p.state.ajar),
            windows: portals_of(file, |p| p.kind == PortalKind::Window),
            boxes: Boxes::new(file.objects.iter().map(|o| o.bounds)),
            indices: indices(file),
            triangles: file.objects.iter().map(|o| o.triangles).collect(),
            keys,
            by_key: by_key.into_iter().map(PortalId).collect(),
            open_cells: file.cells.iter().map(|c| c.open).collect(),
            object_rows: file.object_rows.clone(),
            cell_rows: file.cell_rows.clone(),
            learned: vec![OnceLock::new(); file.cells.len()],
            views: file.views.rows.clone().map(|rows| {
                let ids = (0..).map(ViewCellId);
                let views = ids.zip(file.views.cells.iter().map(|c| &c.pieces[..]));
                ViewCells { locator: Locator::new(views, extent, tolerance), rows }
            }),
            cell_rows_prune: file.guarantee == Guarantee::Conservative,
        })
    }

    /// Whether a cell is open: outdoors, or without a roof.
    pub(super) fn is_open_cell(&self, cell: CellId) -> bool {
        self.open_cells[cell.index()]
    }

    /// Learns the row of a cell that was computed at run time: objects and cells that may be visible from it, as bits, the first in the
    /// lowest. A cell without a row sees everything, so rows may arrive at any time and from any thread; the first of a cell stays, and the
    /// result is whether this was it. A learned row goes before the file's.
    ///
    /// # Panics
    ///
    /// If there is no such cell, or a row has the wrong length.
    pub fn learn_row(&self, cell: CellId, objects: &[u64], cells: &[u64]) -> bool {
        let row = |columns: usize, row: &[u64]| -> Box<[u64]> {
            assert_eq!(row.len(), columns.div_ceil(64), "words of a row of {columns}");
            row.iter().enumerate().map(|(word, bits)| bits & all_ones(columns, word)).collect()
        };
        let rows = [row(self.object_count(), objects), row(self.cell_count(), cells)];
        self.learned[cell.index()].set(rows).is_ok()
    }

    /// Number of cells whose row was learned ([`Culler::learn_row`]).
    pub(super) fn learned_rows(&self) -> usize {
        self.learned.iter().filter(|learned| learned.get().is_some()).count()
    }

    /// The row of a cell: objects; `None`: all.
    #[inline]
    pub(super) fn object_row(&self, cell: CellId) -> Option<&[u64]> {
        let learned = self.learned[cell.index()].get().map(|[objects, _]| &**objects);
        learned.or_else(|| self.object_rows.as_ref().map(|rows| rows.row(cell.index())))
    }

    /// The row of a cell: cells; `None`: all.
    #[inline]
    pub(super) fn cell_row(&self, cell: CellId) -> Option<&[u64]> {
        let learned = self.learned[cell.index()].get().map(|[_, cells]| &**cells);
        learned.or_else(|| self.cell_rows.as_ref().map(|rows| rows.row(cell.index())))
    }

    /// What a directed portal shows of the cell behind it, from anywhere before it: rows of objects and cells; `None`: all.
    pub(super) fn way_in_rows(&self, portal: DirectedPortal) -> [Option<&[u64]>; 2] {
        let of = self.ways_in.as_ref().and_then(|ways| Some((ways, ways.of[portal.0 as usize]? as usize)));
        match of {
            Some((ways, row)) => [Some(ways.objects.row(row)), Some(ways.cells.row(row))],
            None => {
                let before = target(self, portal.reversed());
                [self.object_row(before), self.cell_row(before)]
            }
        }
    }

    /// Whether a cell has no end.
    pub(super) fn is_outside(&self, cell: CellId) -> bool {
        self.cell_boxes[cell.index()].is_none()
    }

    /// The cell of a point (metres, relative to the file's origin); on a border, the one with the point deepest inside.
    pub fn cell_of(&self, p: Vec3) -> Option<CellId> {
        self.locate(p, &mut u32::MAX.clone()).as_slice().first().copied()
    }

    /// The cells that a point is in; `last_piece`: where it was before.
    pub(super) fn locate(&self, p: Vec3, last_piece: &mut u32) -> Homes {
        self.locator.locate(p, self.tolerance, last_piece)
    }

    /// The portal with a key ([`PvsFile::portal_keys`]), in any bake of the model.
    pub fn portal(&self, key: &str) -> Option<PortalId> {
        let found = self.by_key.binary_search_by(|portal| self.keys[portal.index()].as_str().cmp(key));
        found.ok().map(|at| self.by_key[at])
    }

    /// The key of a portal.
    ///
    /// # Panics
    ///
    /// If there is no such portal.
    pub fn portal_key(&self, portal: PortalId) -> &str {
        &self.keys[portal.index()]
    }

    /// Number of objects.
    pub fn object_count(&self) -> usize {
        self.triangles.len()
    }

    /// Number of cells.
    pub fn cell_count(&self) -> usize {
        self.cell_portals.starts.len() - 1
    }

    /// Number of portals, each counted once.
    pub fn portal_count(&self) -> usize {
        self.portal_cells.len()
    }

    /// Number of triangles of an object.
    pub fn triangles(&self, object: ObjectId) -> u32 {
        self.triangles[object.index()]
    }

    /// The range of an object in an index buffer that holds the objects' triangles in the order of their ids.
    pub fn indices(&self, object: ObjectId) -> Range<u32> {
        self.indices[object.index()]..self.indices[object.index() + 1]
    }

    /// Largest distance of a stored portal's edge or plane from the real opening's, metres: windings grow by this, and an eye this near to
    /// a cell is in it.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }
}

/// Some portals of a file, ascending.
fn portals_of(file: &PvsFile, is_one: impl Fn(&FilePortal) -> bool) -> Vec<PortalId> {
    (0..).map(PortalId).zip(&file.portals).filter(|(_, portal)| is_one(portal)).map(|(id, _)| id).collect()
}

/// First index of each object, and the end of the last. Beyond what an index can count, ranges are empty.
fn indices(file: &PvsFile) -> Vec<u32> {
    let mut end = 0u32;
    let mut next = |triangles: u32| {
        end = end.saturating_add(triangles.saturating_mul(3));
        end
    };
    std::iter::once(0).chain(file.objects.iter().map(|object| next(object.triangles))).collect()
}

/// Boxes of each object's part in each of its cells, in the order of `cell_objects`.
fn placed_bounds(
    file: &PvsFile,
    cell_objects: &Lists<ObjectId>,
    cell_boxes: &[Option<[Vec3; 2]>],
) -> impl ExactSizeIterator<Item = [Vec3; 2]> {
    let arounds = cell_boxes.iter().enumerate();
    let cells = arounds.flat_map(|(c, &around)| std::iter::repeat_n(around, cell_objects.get(c).len()));
    let mut bounds: Vec<[Vec3; 2]> = Vec::with_capacity(cell_objects.items().len());
    for (i, (around, object)) in cells.zip(cell_objects.items()).enumerate() {
        let whole = file.objects[object.index()].bounds;
        let placed = file.placed.as_ref().map(|placed| single(placed[i].of_box(Aabb::of(whole.map(|p| p.as_dvec3())))));
        bounds.push(part(placed.unwrap_or(whole), around));
    }
    bounds.into_iter()
}

/// In single precision, rounded outwards.
fn single(b: Aabb) -> [Vec3; 2] {
    [b.min.as_vec3().map(f32::next_down), b.max.as_vec3().map(f32::next_up)]
}

/// The box around a cell, with the margin of placement; `None` if it is unbounded.
fn cell_bounds(cell: &FileCell, extent: f64, tolerance: f64) -> Option<[Vec3; 2]> {
    let around = cell.pieces.iter().try_fold(Aabb::EMPTY, |b, planes| Some(b.union(piece_bounds(planes, extent)?)))?;
    Some(single(around.inflated(PLACED * tolerance)))
}

/// The intersection of a box with a cell's box; the whole box if that is empty.
pub(super) fn part([min, max]: [Vec3; 2], around: Option<[Vec3; 2]>) -> [Vec3; 2] {
    let [low, high] = around.map_or([min, max], |[low, high]| [min.max(low), max.min(high)]);
    if low.cmple(high).all() { [low, high] } else { [min, max] }
}

/// A word of a row of `columns` ones.
pub(super) fn all_ones(columns: usize, word: usize) -> u64 {
    match columns.saturating_sub(word * 64) {
        0 => 0,
        rest @ 1..64 => (1 << rest) - 1,
        _ => u64::MAX,
    }
}

/// A bit of a row.
#[inline]
pub(super) fn bit(words: &[u64], i: usize) -> bool {
    words[i / 64] >> (i % 64) & 1 != 0
}

#[inline]
pub(super) fn directed_plane(culler: &Culler, portal: DirectedPortal) -> (Vec3, f32) {
    let plane = culler.portal_planes[portal.portal().index()];
    let plane = if portal.side() == 0 { plane } else { -plane };
    (plane.truncate(), plane.w)
}

pub(super) fn target(culler: &Culler, portal: DirectedPortal) -> CellId {
    culler.portal_cells[portal.portal().index()][1 - portal.side()]
}
