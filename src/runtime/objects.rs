//! Collects the visible objects of the reached cells: those within the rectangles of portals, in blocks of boxes.

use super::boxes::{HalfSpaces, LANES};
use super::camera::{Camera, Rect};
use super::culler::{Culler, bit, directed_plane, target};
use super::scratch::{PortalState, Scratch};
use crate::CellId;
use crate::math::bits::ones;
use crate::math::simd::Vectorize;
use glam::Vec3;

/// Adds objects to the scratch: first those of the eye's own cells, then those of other cells through portals.
pub(super) struct CollectObjects<'a> {
    pub culler: &'a Culler,
    pub camera: &'a Camera,
    /// If set, only objects beyond this plane are visible.
    pub front: Option<(Vec3, f32)>,
    /// The eye's cells, which it sees on `open`.
    pub homes: &'a [CellId],
    pub open: &'a Rect,
    pub scratch: &'a mut Scratch,
}

impl Vectorize for CollectObjects<'_> {
    type Output = ();

    #[inline(always)]
    fn work(mut self) {
        let mut around = HalfSpaces::of(self.camera, self.open);
        if let Some((n, d)) = self.front {
            around = around.beyond(n, self.behind(d));
        }
        for &home in self.homes {
            self.scratch.spaces.clear();
            self.scratch.spaces.push(around);
            self.take(home, around);
        }
        for i in 0..self.scratch.reached.len() {
            let cell = self.scratch.reached[i];
            // The eye's own cell is complete on the screen.
            if self.front.is_some() || !self.homes.contains(&cell) {
                let around = self.open(cell);
                self.take(cell, around);
            }
        }
    }
}

impl CollectObjects<'_> {
    /// Sets `spaces` to the half-spaces of each portal into a cell. Returns half-spaces around all of them.
    fn open(&mut self, cell: CellId) -> HalfSpaces {
        let Self { culler, camera, .. } = *self;
        self.scratch.spaces.clear();
        let (mut all, mut next) = (Rect::EMPTY, self.scratch.ways_in[cell.index()].first);
        while let Some(crossed) = self.scratch.crossed.get(next as usize) {
            let PortalState { open, shut, .. } = self.scratch.portal_states[crossed.portal.0 as usize];
            let (n, d) = directed_plane(culler, crossed.portal);
            let mut space = HalfSpaces::of(camera, &open).beyond(n, self.behind(d));
            if shut {
                space = space.beyond(-n, -(d + culler.doorway(crossed.portal)));
            }
            all = all.union(open);
            self.scratch.spaces.push(space);
            next = self.scratch.next_in[next as usize];
        }
        if let [one] = self.scratch.spaces[..] { one } else { HalfSpaces::of(camera, &all) }
    }

    /// A plane's distance from the origin, moved by the tolerance: twice as everywhere, and once more for rounding, whose terms are within
    /// the model's extent.
    fn behind(&self, d: f32) -> f32 {
        d - 3.0 * self.culler.tolerance as f32
    }

    /// Adds the objects of a cell that are in the row and in one of `spaces`; `around` contains all of these.
    #[inline(always)]
    fn take(&mut self, cell: CellId, around: HalfSpaces) {
        let Self { culler, scratch, .. } = self;
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
        if ways.frame == scratch.frame {
            scratch.next_in[ways.last as usize] = i as u32;
            ways.last = i as u32;
        } else {
            *ways = super::scratch::WaysIn { frame: scratch.frame, first: i as u32, last: i as u32 };
            scratch.reached.push(cell);
        }
    }
}
