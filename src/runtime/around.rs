//! Potentially visible objects from a place, in all directions: for engines that update visibility only when it changes, and do their own
//! frustum culling.
//!
//! A line of sight crosses only portals that are open, or shut with the eye in their doorway, and all cells along it are in the row. So a
//! flood over such portals within the row finds every visible cell. Shut portals work as in [`super::doors`]: objects in the doorway are
//! visible.

use super::culler::{Culler, directed_plane, target};
use super::portals;
use super::scratch::Scratch;
use crate::math::bits::ones;
use crate::{CellId, ObjectId, PortalId};
use glam::Vec3;

/// The place of an eye, with respect to visibility: two equal places see the same, until a door moves.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Place {
    /// Ascending; empty if the eye is in no cell.
    cells: Vec<CellId>,
    /// Portals that are shut in some direction, with the eye in their doorway, ascending.
    doorways: Vec<PortalId>,
}

impl Place {
    /// The eye's cells, ascending: several if it is within their tolerance. Empty: everything is visible.
    pub fn cells(&self) -> &[CellId] {
        &self.cells
    }
}

impl Culler {
    /// Finds the place of an eye, metres relative to the file's origin. Linear in the number of shut portals.
    pub fn find_place(&self, eye: Vec3, scratch: &mut Scratch, place: &mut Place) {
        scratch.begin(self);
        place.cells.clear();
        place.doorways.clear();
        let homes = self.locate(eye, scratch);
        if homes.overflow {
            return;
        }
        place.cells.extend_from_slice(homes.as_slice());
        place.cells.sort_unstable();
        for directed in ones(&self.shut) {
            let portal = PortalId(directed as u32 / 2);
            if place.doorways.last() != Some(&portal) && portals::is_in_doorway(self, eye.as_dvec3(), portal) {
                place.doorways.push(portal);
            }
        }
    }

    /// The potentially visible objects from a place in all directions, with the current doors, each once: objects of the rows that are in
    /// cells reachable through open portals, or in the doorways of shut ones. All objects, if the place is in no cell.
    pub fn seen_around<'s>(&self, place: &Place, scratch: &'s mut Scratch) -> &'s [ObjectId] {
        scratch.begin(self);
        self.join_rows(&place.cells, scratch);
        if place.cells.is_empty() {
            scratch.objects.extend((0..self.object_count() as u32).map(ObjectId));
            return &scratch.objects;
        }
        place.cells.iter().for_each(|&cell| scratch.reach(cell));
        let mut next = 0;
        while let Some(&cell) = scratch.cells.get(next) {
            next += 1;
            self.take_in_cell(cell, |_| true, scratch);
            for &portal in self.cell_portals.get(cell.index()) {
                let target = target(self, portal);
                if !self.may_enter(target, scratch) {
                    continue;
                }
                if self.is_open(portal) || place.doorways.binary_search(&portal.portal()).is_ok() {
                    scratch.reach(target);
                } else {
                    let (n, d) = directed_plane(self, portal);
                    let doorway = (n, d, self.doorway(portal));
                    self.take_in_cell(target, |object| self.is_in(doorway, object), scratch);
                }
            }
        }
        &scratch.objects
    }

    /// Adds the objects of a cell that are in the joined rows and satisfy `is_seen`.
    fn take_in_cell(&self, cell: CellId, is_seen: impl Fn(ObjectId) -> bool, scratch: &mut Scratch) {
        for &object in self.cell_objects.get(cell.index()) {
            let taken = &mut scratch.taken[object.index()];
            if *taken != scratch.frame && super::culler::bit(&scratch.object_row, object.index()) && is_seen(object) {
                *taken = scratch.frame;
                scratch.objects.push(object);
            }
        }
    }
    /// True if a part of an object's box is beyond a plane, at most `depth` metres, to within twice a frame's tolerance.
    fn is_in(&self, (n, d, depth): (Vec3, f32, f32), object: ObjectId) -> bool {
        let behind = d - 6.0 * self.tolerance as f32;
        let (centre, half) = self.boxes.get(object.index());
        let (at, reach) = (n.dot(centre), n.abs().dot(half) + 3.0 * self.tolerance as f32);
        at + reach >= behind && at - reach <= d + depth
    }
}
