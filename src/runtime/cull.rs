//! A frame without queries: no culling, frustum, portals, rows, or portals and rows.

use super::boxes::{Boxes, HalfSpaces, LANES};
use super::camera::{Camera, Rect};
use super::culler::{Culler, ViewCells, all_ones, bit};
use super::locate::Homes;
use super::mode::Mode;
use super::portals::{self, Eye};
use super::scratch::Scratch;
use crate::math::bits::ones;
use crate::math::simd::{Vectorize, vectorized};
use crate::{CellId, ObjectId};
use glam::Vec3;

impl Culler {
    /// A frame of this camera, in `scratch`. Modes with queries give the result of portals and rows. Allocates nothing.
    pub(super) fn cull(&self, camera: &Camera, mode: Mode, scratch: &mut Scratch) {
        scratch.begin();
        let mode = mode.without_queries();
        // Without a common eye, nothing is known about lines of sight.
        let mode = if camera.is_orthographic() && mode != Mode::None { Mode::Frustum } else { mode };
        let homes = match mode {
            Mode::None | Mode::Frustum => Homes::none(),
            _ => self.locate(camera.eye, &mut scratch.last_piece),
        };
        scratch.stats.capped += u64::from(homes.overflow);
        let lost = homes.overflow || homes.as_slice().is_empty();
        match mode {
            Mode::None => self.take_every(scratch),
            Mode::Frustum => self.take_frustum(camera, scratch),
            _ if lost => self.take_frustum(camera, scratch),
            Mode::Pvs => {
                self.join_rows(homes.as_slice(), scratch);
                self.narrow_row(camera.eye, scratch);
                self.take_in_row(camera, 0.0, scratch);
                scratch.stats.cells = scratch.cell_row.iter().map(|w| u64::from(w.count_ones())).sum();
            }
            _ => {
                let has_rows = mode != Mode::Portals;
                self.join_rows(if has_rows { homes.as_slice() } else { &[] }, scratch);
                if has_rows {
                    self.narrow_row(camera.eye, scratch);
                }
                let eye = Eye::new(camera, self, None);
                portals::traverse(self, camera, &eye, homes.as_slice(), &Rect::FULL, scratch);
            }
        }
        self.leave_out_small(camera, mode, scratch);
        scratch.homes.extend_from_slice(if lost { &[] } else { homes.as_slice() });
        scratch.finish(self);
    }

    fn take_frustum(&self, camera: &Camera, scratch: &mut Scratch) {
        self.join_rows(&[], scratch);
        self.take_in_row(camera, 0.0, scratch);
    }

    /// Adds the objects of modes without portals, from the joined rows.
    pub(super) fn take_all(&self, camera: &Camera, mode: Mode, scratch: &mut Scratch) {
        match mode {
            Mode::None => self.take_every(scratch),
            _ => self.take_in_row(camera, 0.0, scratch),
        }
    }

    /// Adds every object.
    pub(super) fn take_every(&self, scratch: &mut Scratch) {
        scratch.objects.extend((0..self.object_count() as u32).map(ObjectId));
    }

    /// Adds the objects of the joined row that are not certainly off the screen of a camera whose place is known to within `off` metres.
    pub(super) fn take_in_row(&self, camera: &Camera, off: f32, scratch: &mut Scratch) {
        let (boxes, mut screen) = (&self.boxes, HalfSpaces::of(camera, &Rect::FULL));
        screen.grow(off);
        vectorized(InRow { boxes, screen, row: &scratch.object_row, objects: &mut scratch.objects });
    }

    /// Joins the rows of some cells; everything if there are no rows or no cells.
    pub(super) fn join_rows(&self, cells: &[CellId], scratch: &mut Scratch) {
        let Scratch { object_row, cell_row, .. } = scratch;
        join(cells, |cell| self.object_row(cell), self.object_count(), object_row);
        join(cells, |cell| self.cell_row(cell), self.cell_count(), cell_row);
    }

    /// Removes objects from the joined row that the eye's view cells do not see. An eye on the boundary of a view cell is not in it.
    pub(super) fn narrow_row(&self, eye: Vec3, scratch: &mut Scratch) {
        let Some(ViewCells { locator, rows }) = &self.views else { return };
        let homes = locator.locate(eye, -self.tolerance, &mut u32::MAX.clone());
        for view in homes.as_slice() {
            scratch.object_row.iter_mut().zip(rows.row(view.0 as usize)).for_each(|(out, row)| *out &= row);
        }
    }

    /// Whether the traversal may enter a cell. Sampled rows prune objects, but not cells on the way: a line of sight may pass a cell
    /// without samples.
    #[inline]
    pub(super) fn may_enter(&self, cell: CellId, scratch: &Scratch) -> bool {
        !self.cell_rows_prune || bit(&scratch.cell_row, cell.index())
    }
}

/// Joins rows of `columns`; all, if there are no cells, or one without a row.
fn join<'r>(cells: &[CellId], row: impl Fn(CellId) -> Option<&'r [u64]>, columns: usize, out: &mut [u64]) {
    if cells.is_empty() || cells.iter().any(|&cell| row(cell).is_none()) {
        return (0..out.len()).for_each(|word| out[word] = all_ones(columns, word));
    }
    out.fill(0);
    for row in cells.iter().filter_map(|&cell| row(cell)) {
        out.iter_mut().zip(row).for_each(|(out, word)| *out |= word);
    }
}

/// Adds the objects of a row that are on the screen, for dispatch.
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
