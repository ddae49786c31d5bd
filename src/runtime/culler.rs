//! The culler: a `.pvs` file laid out for a frame, and the frame itself.

use super::boxes::{Boxes, HalfSpaces, LANES};
use super::frustum::{Camera, Octagon};
use super::locate::{Homes, Locator};
use super::portals::Eye;
use super::scratch::{Scratch, VisibleSet};
use super::{Mode, Narrowing, portals};
use crate::bits::{BitMatrix, ones};
use crate::file::PvsFile;
use crate::geom::Aabb;
use crate::simd::{Vectorize, vectorized};
use crate::tolerance::single_precision;
use crate::types::guarantee::Guarantee;
use crate::{CellId, DirectedPortal, ObjectId, PortalId};
use glam::{Vec3, Vec4};
use std::ops::Range;

/// Lists of different lengths, one after the other in one array.
#[derive(Clone, Debug)]
pub(super) struct Lists<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T> Lists<T> {
    fn new<I: IntoIterator<Item = T>>(lists: impl IntoIterator<Item = I>) -> Self {
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

    /// Where a list is in [`Self::items`].
    #[inline]
    pub fn range(&self, i: usize) -> Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    /// All of them.
    #[inline]
    pub fn items(&self) -> &[T] {
        &self.items
    }
}

/// A `.pvs` file, laid out for questions about single cameras: flat arrays, `f32`, nothing borrowed.
#[derive(Clone, Debug)]
pub struct Culler {
    pub(super) tolerance: f64,
    pub(super) narrowing: Narrowing,
    locator: Locator,
    /// Directed portals that lead out of each cell.
    pub(super) cell_portals: Lists<DirectedPortal>,
    /// Objects in each cell.
    pub(super) cell_objects: Lists<ObjectId>,
    /// `(n, d)` from `cells[0]` into `cells[1]`, by portal.
    pub(super) portal_planes: Vec<Vec4>,
    pub(super) portal_cells: Vec<[CellId; 2]>,
    pub(super) portal_corners: Lists<Vec3>,
    /// Directed portals that nothing is seen through at the moment, as bits.
    pub(super) shut: Vec<u64>,
    /// Portals that a solid leaf shut as the model stood.
    pub(super) found_shut: Vec<PortalId>,
    pub(super) boxes: Boxes,
    /// Those of `cell_objects`, in that order.
    pub(super) placed: Boxes,
    triangles: Vec<u32>,
    pub(super) object_rows: Option<BitMatrix>,
    pub(super) cell_rows: Option<BitMatrix>,
    /// Whether a cell that isn't in the row is certainly not seen into.
    pub(super) cell_rows_prune: bool,
}

impl Culler {
    /// Lays out a file. The file must be consistent (ids in range, matrices of the right shape), as [`PvsFile::load`] makes
    /// sure; panics otherwise.
    pub fn new(file: &PvsFile) -> Self {
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
        Self {
            tolerance,
            narrowing: Narrowing::default(),
            locator: Locator::new(&file.cells, extent, tolerance),
            cell_portals: Lists::new(leading_out),
            placed: Boxes::new(cell_objects.items().iter().map(|o| file.objects[o.index()].bounds)),
            cell_objects,
            portal_planes: file.portals.iter().map(|p| p.plane).collect(),
            portal_cells: file.portals.iter().map(|p| p.cells).collect(),
            portal_corners: Lists::new(file.portals.iter().map(|p| p.winding.iter().copied())),
            shut: vec![0; (2 * file.portals.len()).div_ceil(64)],
            found_shut: (0u32..)
                .zip(&file.portals)
                .filter(|(_, p)| p.state.shut && !p.state.see_through && !p.state.ajar)
                .map(|(i, _)| PortalId(i))
                .collect(),
            boxes: Boxes::new(file.objects.iter().map(|o| o.bounds)),
            triangles: file.objects.iter().map(|o| o.triangles).collect(),
            object_rows: file.object_rows.clone(),
            cell_rows: file.cell_rows.clone(),
            cell_rows_prune: file.guarantee == Guarantee::Conservative,
        }
    }

    /// What is to draw from this camera. Allocates nothing, as long as `scratch` was made for this culler.
    pub fn cull<'s>(&self, camera: &Camera, mode: Mode, scratch: &'s mut Scratch) -> VisibleSet<'s> {
        scratch.begin(self);
        let homes = match mode {
            Mode::None | Mode::Frustum => Homes::NONE,
            Mode::Portals | Mode::Pvs | Mode::Both => self.locate(camera.eye, scratch),
        };
        scratch.stats.capped += u64::from(homes.overflow);
        let lost = homes.overflow || homes.as_slice().is_empty();
        match mode {
            Mode::None => self.take(None, scratch),
            Mode::Frustum => self.take_frustum(camera, scratch),
            Mode::Portals | Mode::Pvs | Mode::Both if lost => self.take_frustum(camera, scratch),
            Mode::Pvs => {
                self.join_rows(homes.as_slice(), scratch);
                self.take(Some(camera), scratch);
                scratch.stats.cells = scratch.cell_row.iter().map(|w| u64::from(w.count_ones())).sum();
            }
            Mode::Portals | Mode::Both => {
                self.join_rows(if mode == Mode::Both { homes.as_slice() } else { &[] }, scratch);
                let eye = Eye::new(camera, self, None);
                portals::traverse(self, camera, &eye, homes.as_slice(), &Octagon::FULL, scratch);
            }
        }
        scratch.homes.extend_from_slice(if lost { &[] } else { homes.as_slice() });
        let home = scratch.homes.first().copied();
        scratch.finish(self, home)
    }

    /// The cells that an eye is in.
    pub(super) fn locate(&self, eye: Vec3, scratch: &mut Scratch) -> Homes {
        self.locator.locate(eye, self.tolerance, &mut scratch.last_piece)
    }

    fn take_frustum(&self, camera: &Camera, scratch: &mut Scratch) {
        self.join_rows(&[], scratch);
        self.take(Some(camera), scratch);
    }

    /// Takes what the modes without portals take, of the rows that were joined.
    pub(super) fn take_all(&self, camera: &Camera, mode: Mode, scratch: &mut Scratch) {
        self.take((mode != Mode::None).then_some(camera), scratch);
    }

    /// Takes the objects of the joined row that are not certainly off a camera's screen; without one, every object.
    fn take(&self, camera: Option<&Camera>, scratch: &mut Scratch) {
        match camera {
            None => scratch.objects.extend((0..self.object_count() as u32).map(ObjectId)),
            Some(camera) => {
                let (boxes, screen) = (&self.boxes, HalfSpaces::of(camera, &Octagon::FULL));
                vectorized(InRow { boxes, screen, row: &scratch.object_row, objects: &mut scratch.objects });
            }
        }
    }

    /// Joins the rows of some cells; where there are no rows, or no cells are given, everything.
    pub(super) fn join_rows(&self, cells: &[CellId], scratch: &mut Scratch) {
        let join = |rows: Option<&BitMatrix>, columns: usize, out: &mut [u64]| match rows {
            Some(rows) if !cells.is_empty() => {
                out.fill(0);
                for cell in cells {
                    for (out, word) in out.iter_mut().zip(rows.row(cell.index())) {
                        *out |= word;
                    }
                }
            }
            _ => (0..out.len()).for_each(|word| out[word] = all_ones(columns, word)),
        };
        join(self.object_rows.as_ref(), self.object_count(), &mut scratch.object_row);
        join(self.cell_rows.as_ref(), self.cell_count(), &mut scratch.cell_row);
    }

    /// Whether the traversal may go into a cell. Rows that are only sampled prune objects, not the way to them: a cell that
    /// no sample fell into may still be seen through.
    #[inline]
    pub(super) fn may_enter(&self, cell: CellId, scratch: &Scratch) -> bool {
        !self.cell_rows_prune || bit(&scratch.cell_row, cell.index())
    }

    /// How portals narrow the view from now on; by rectangles unless told otherwise.
    pub fn set_narrowing(&mut self, narrowing: Narrowing) {
        self.narrowing = narrowing;
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

    /// How far a stored portal's edge or plane may be from the real opening's, metres: windings grow by this much, and an eye
    /// this near to a cell is in it.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }
}

/// Takes the objects of a row that meet the screen.
struct InRow<'a> {
    boxes: &'a Boxes,
    screen: HalfSpaces,
    row: &'a [u64],
    objects: &'a mut Vec<ObjectId>,
}

impl Vectorize for InRow<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        for (word, &row) in self.row.iter().enumerate() {
            for first in (0..64).step_by(LANES) {
                let row = (row >> first) as u32 & ((1 << LANES) - 1);
                if row != 0 {
                    let start = word * 64 + first;
                    for i in ones(&[u64::from(row & self.screen.meet(self.boxes, start))]) {
                        self.objects.push(ObjectId((start + i) as u32));
                    }
                }
            }
        }
    }
}

/// A word of a row of `columns` ones.
fn all_ones(columns: usize, word: usize) -> u64 {
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
