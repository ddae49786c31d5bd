//! Potentially visible objects from a place, in all directions: for engines that update visibility only when it changes, and do their own
//! frustum culling.
//!
//! A line of sight crosses only portals that are open, or shut with the eye in their doorway, and all cells along it are in the row. So a
//! flood over such portals within the row finds every visible cell. Shut portals work as in [`super::doors`]: objects in the doorway are
//! visible.

use super::culler::{Culler, directed_plane, target};
use super::doors::Doors;
use super::locate::MOST_HOMES;
use super::scratch::Scratch;
use super::visible::near_doors;
use crate::{CellId, ObjectId, PortalId};
use glam::Vec3;

/// What is seen around an eye.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Around<'v> {
    /// The potentially visible objects in all directions, each once.
    pub objects: &'v [ObjectId],
    /// False if they are those of the view's last call: the eye is in the same cells, and no door and no row is another one.
    pub is_new: bool,
}

/// What determines the objects around an eye.
#[derive(Clone, PartialEq, Debug)]
struct Place {
    /// Ascending; empty if the eye is in no cell.
    cells: Vec<CellId>,
    /// Portals that are shut in some direction, with the eye in their doorway, ascending.
    doorways: Vec<PortalId>,
    doors: Doors,
    /// Number of learned rows.
    learned: usize,
}

/// The objects around the last eye, and its place.
#[derive(Clone, Debug)]
pub(super) struct Surroundings {
    place: Place,
    known: Place,
    /// False before the first call.
    is_known: bool,
    objects: Vec<ObjectId>,
}

impl Surroundings {
    pub fn for_culler(culler: &Culler) -> Self {
        let place = || Place {
            cells: Vec::with_capacity(MOST_HOMES),
            doorways: Vec::with_capacity(culler.portal_count()),
            doors: Doors::open(culler),
            learned: 0,
        };
        Self { place: place(), known: place(), is_known: false, objects: Vec::with_capacity(culler.object_count()) }
    }

    /// Finds the objects around an eye, with the doors of `scratch`. Linear in the number of shut portals if the place is the last one.
    pub fn find(&mut self, culler: &Culler, eye: Vec3, scratch: &mut Scratch) -> Around<'_> {
        self.place.find(culler, eye, scratch);
        let is_new = !self.is_known || self.known != self.place;
        if is_new {
            self.place.see(culler, scratch);
            self.objects.clear();
            self.objects.extend_from_slice(&scratch.objects);
            // Both keep their memory.
            std::mem::swap(&mut self.known, &mut self.place);
            self.is_known = true;
        }
        Around { objects: &self.objects, is_new }
    }
}

impl Place {
    /// The place of an eye, metres relative to the file's origin.
    fn find(&mut self, culler: &Culler, eye: Vec3, scratch: &mut Scratch) {
        self.cells.clear();
        self.doorways.clear();
        self.doors.assign(&scratch.doors);
        self.learned = culler.learned_rows();
        let homes = culler.locate(eye, &mut scratch.last_piece);
        if !homes.overflow {
            self.cells.extend_from_slice(homes.as_slice());
            self.cells.sort_unstable();
            near_doors(culler, &self.doors, eye, &mut self.doorways);
        }
    }

    /// Fills a scratch with the potentially visible objects: those of the rows that are in cells reachable through open portals, or in the
    /// doorways of shut ones. All objects, if the place is in no cell.
    fn see(&self, culler: &Culler, scratch: &mut Scratch) {
        scratch.begin();
        culler.join_rows(&self.cells, scratch);
        if self.cells.is_empty() {
            return scratch.objects.extend((0..culler.object_count() as u32).map(ObjectId));
        }
        self.cells.iter().for_each(|&cell| scratch.reach(cell));
        let mut next = 0;
        while let Some(&cell) = scratch.cells.get(next) {
            next += 1;
            culler.take_in_cell(cell, |_| true, scratch);
            for &portal in culler.cell_portals.get(cell.index()) {
                let target = target(culler, portal);
                if !culler.may_enter(target, scratch) {
                    continue;
                }
                if self.doors.is_open(portal) || self.doorways.binary_search(&portal.portal()).is_ok() {
                    scratch.reach(target);
                } else {
                    let (n, d) = directed_plane(culler, portal);
                    let doorway = (n, d, culler.doorway(portal));
                    culler.take_in_cell(target, |object| culler.is_in(doorway, object), scratch);
                }
            }
        }
    }
}

impl Culler {
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
