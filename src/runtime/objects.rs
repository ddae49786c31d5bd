//! Collects the visible objects of the reached cells: those within the rectangles of portals, in blocks of boxes.

use super::boxes::{HalfSpaces, LANES};
use super::camera::{Camera, Rect};
use super::culler::{Culler, bit, directed_plane, target};
use super::scratch::{PortalState, Scratch};
use crate::CellId;
use crate::math::bits::ones;
use crate::math::simd::Vectorize;
use glam::Vec3;

/// What an eye sees, or a mirror's reflected one.
#[derive(Clone, Copy)]
pub(super) struct Opened<'a> {
    pub culler: &'a Culler,
    pub camera: &'a Camera,
    /// If set, only what is beyond this plane is visible.
    pub front: Option<(Vec3, f32)>,
    /// The part of the screen on which the eye sees its own cells.
    pub open: &'a Rect,
    /// Largest error of the camera's place, metres.
    pub off: f32,
}

/// Adds objects to the scratch: first those of the eye's own cells, then those of other cells through portals.
pub(super) struct CollectObjects<'a> {
    pub seen: Opened<'a>,
    /// The eye's cells.
    pub homes: &'a [CellId],
    /// Cells that are seen on another part of the screen, with no portal of this culler before them.
    pub beside: Option<(&'a [CellId], Rect)>,
    pub scratch: &'a mut Scratch,
}

impl Vectorize for CollectObjects<'_> {
    type Output = ();

    #[inline(always)]
    fn work(mut self) {
        self.take_whole(self.homes, self.seen.around());
        if let Some((cells, open)) = self.beside {
            self.take_whole(cells, self.seen.of(&open));
        }
        for i in 0..self.scratch.reached.len() {
            let cell = self.scratch.reached[i];
            // The eye's own cell is complete on the screen.
            if self.seen.front.is_some() || !self.homes.contains(&cell) {
                let around = self.seen.open(cell, self.scratch);
                self.take(cell, around);
            }
        }
    }
}

impl Opened<'_> {
    /// The half-spaces of the rectangle.
    pub fn around(&self) -> HalfSpaces {
        let mut around = self.of(self.open);
        if let Some((n, d)) = self.front {
            around.go_beyond(n, self.behind(d));
        }
        around
    }

    /// The half-spaces of a part of the screen.
    #[inline]
    fn of(&self, open: &Rect) -> HalfSpaces {
        let mut spaces = HalfSpaces::of(self.camera, open);
        spaces.grow(self.off);
        spaces
    }

    /// Sets `spaces` to the half-spaces of each portal into a cell. Returns half-spaces around all of them.
    pub fn open(&self, cell: CellId, scratch: &mut Scratch) -> HalfSpaces {
        let culler = self.culler;
        scratch.spaces.clear();
        let (mut all, mut next) = (Rect::EMPTY, scratch.ways_in[cell.index()].first);
        while let Some(crossed) = scratch.crossed.get(next as usize) {
            let PortalState { open, shut, .. } = scratch.portal_states[crossed.portal.0 as usize];
            let (n, d) = directed_plane(culler, crossed.portal);
            let mut space = self.of(&open);
            space.go_beyond(n, self.behind(d));
            if shut {
                space.go_beyond(-n, -(d + culler.doorway(crossed.portal)));
            }
            all = all.union(open);
            scratch.spaces.push(space);
            next = scratch.next_in[next as usize];
        }
        if let [one] = scratch.spaces[..] { one } else { self.of(&all) }
    }

    /// A plane's distance from the origin, moved by the tolerance: twice as everywhere, and once more for rounding, whose terms are within
    /// the model's extent.
    fn behind(&self, d: f32) -> f32 {
        d - 3.0 * self.culler.tolerance as f32
    }
}

impl CollectObjects<'_> {
    /// Adds the objects of whole cells that are within `around`.
    #[inline(always)]
    fn take_whole(&mut self, cells: &[CellId], around: HalfSpaces) {
        for &cell in cells {
            self.scratch.spaces.clear();
            self.scratch.spaces.push(around);
            self.take(cell, around);
        }
    }

    /// Adds the objects of a cell that are in the row and in one of `spaces`; `around` contains all of these.
    #[cfg_attr(feature = "simd", inline(always))]
    fn take(&mut self, cell: CellId, around: HalfSpaces) {
        let Self { seen: Opened { culler, .. }, scratch, .. } = self;
        let range = culler.cell_objects.range(cell.index());
        for start in range.clone().step_by(LANES) {
            let mut wanted = around.meet(&culler.placed, start);
            if range.end - start < LANES {
                wanted &= (1 << (range.end - start)) - 1;
            }
            for i in ones(&[u64::from(wanted)]) {
                let object = culler.cell_objects.items()[start + i];
                if scratch.taken[object.index()] == scratch.frame || !bit(&scratch.object_row, object.index()) {
                    wanted &= !(1 << i);
                }
            }
            let mut next = 0;
            while wanted != 0 && next < scratch.spaces.len() {
                let seen = if scratch.spaces.len() == 1 {
                    wanted
                } else {
                    wanted & scratch.spaces[next].meet(&culler.placed, start)
                };
                for i in ones(&[u64::from(seen)]) {
                    let object = culler.cell_objects.items()[start + i];
                    scratch.taken[object.index()] = scratch.frame;
                    scratch.objects.push(object);
                }
                wanted &= !seen;
                next += 1;
            }
        }
    }
}

/// Groups the crossed portals by target cell; fills [`Scratch::reached`].
pub(super) fn group(culler: &Culler, scratch: &mut Scratch) {
    scratch.reached.clear();
    scratch.next_in.clear();
    for (i, crossed) in scratch.crossed.iter().enumerate() {
        let cell = target(culler, crossed.portal);
        let ways = &mut scratch.ways_in[cell.index()];
        scratch.next_in.push(u32::MAX);
        if scratch.portal_states[crossed.portal.0 as usize].joined {
            continue;
        }
        if ways.frame == scratch.frame {
            scratch.next_in[ways.last as usize] = i as u32;
            ways.last = i as u32;
        } else {
            *ways = super::scratch::WaysIn { frame: scratch.frame, first: i as u32, last: i as u32 };
            scratch.reached.push(cell);
        }
    }
}
