//! What may be seen from where an eye stands, whichever way it looks: for engines that write down what is visible only when that changes,
//! and leave the view's frustum to their own culling.
//!
//! The cells that a sight line goes through from the eye are joined by portals that are open, or shut with the eye in their doorway, and all
//! of them are in the row. So a walk over such portals that keeps to the row finds every cell that is seen into, and what [`super::doors`]
//! says of shut portals holds here, too: what is in the doorway is seen.

use super::culler::{Culler, directed_plane, target};
use super::portals;
use super::scratch::Scratch;
use crate::bits::ones;
use crate::{CellId, ObjectId, PortalId};
use glam::Vec3;

/// Where an eye stands, as far as it matters to what may be seen from there: two equal places see the same, until a door moves.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Place {
    /// Ascending; none where the eye is in no cell.
    cells: Vec<CellId>,
    /// Portals that are shut in a direction and whose doorway the eye stands in, ascending.
    doorways: Vec<PortalId>,
}

impl Place {
    /// The cells that the eye is in, ascending: several where it is within the tolerance of them. None: everything is seen.
    pub fn cells(&self) -> &[CellId] {
        &self.cells
    }
}

impl Culler {
    /// Finds where an eye stands, metres relative to the file's origin. Costs a look at each portal that is shut.
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

    /// The objects that may be seen from a place whichever way the eye looks, with the doors as they are, each once: of the rows of its
    /// cells, what is in the cells that open portals lead to, and what is in the doorways of those that are shut. All objects, where the
    /// place is in no cell.
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

    /// Takes the objects of a cell that are in the joined rows and that `is_seen` holds of.
    fn take_in_cell(&self, cell: CellId, is_seen: impl Fn(ObjectId) -> bool, scratch: &mut Scratch) {
        for &object in self.cell_objects.get(cell.index()) {
            let taken = &mut scratch.taken[object.index()];
            if *taken != scratch.frame && super::culler::bit(&scratch.object_row, object.index()) && is_seen(object) {
                *taken = scratch.frame;
                scratch.objects.push(object);
            }
        }
    }
    /// True where an object's box is in part beyond a plane, at most `depth` metres, within twice the tolerance that a frame allows.
    fn is_in(&self, (n, d, depth): (Vec3, f32, f32), object: ObjectId) -> bool {
        let behind = d - 6.0 * self.tolerance as f32;
        let (centre, half) = self.boxes.get(object.index());
        let (at, reach) = (n.dot(centre), n.abs().dot(half) + 3.0 * self.tolerance as f32);
        at + reach >= behind && at - reach <= d + depth
    }
}
