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
use crate::math::sorting;
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

/// What lies in front of a shut leaf: beyond the plane `(n, d)`, at most so many metres.
pub(super) type Doorway = (Vec3, f32, f32);

/// The objects around the last eye, and its place.
#[derive(Clone, Debug)]
pub(super) struct Surroundings {
    place: Place,
    known: Place,
    /// False before the first call.
    is_known: bool,
    /// Whether the objects are others than those that were told last.
    is_new: bool,
    objects: Vec<ObjectId>,
    /// The cells that are reached; none if the place is in none.
    pub cells: Vec<CellId>,
    /// Doorways of shut portals, with the cells behind.
    pub doorways: Vec<(CellId, Doorway)>,
}

impl Surroundings {
    pub fn for_culler(culler: &Culler) -> Self {
        let (cells, portals) = (culler.cell_count(), culler.portal_count());
        let place = || Place {
            cells: Vec::with_capacity(MOST_HOMES),
            doorways: Vec::with_capacity(portals),
            doors: Doors::open(culler),
            learned: 0,
        };
        Self {
            place: place(),
            known: place(),
            is_known: false,
            is_new: true,
            objects: Vec::with_capacity(culler.object_count()),
            cells: Vec::with_capacity(cells),
            doorways: Vec::with_capacity(2 * portals),
        }
    }

    /// Finds what is around an eye, with the doors of `scratch`. Linear in the number of shut portals if the place is the last one.
    pub fn find(&mut self, culler: &Culler, eye: Vec3, scratch: &mut Scratch) {
        self.place.find(culler, eye, scratch);
        if !self.is_known || self.known != self.place {
            self.is_new = true;
            self.doorways.clear();
            self.place.see(culler, scratch, &mut self.doorways);
            self.objects.clear();
            self.objects.extend_from_slice(&scratch.objects);
            self.cells.clear();
            self.cells.extend_from_slice(&scratch.cells);
            // Both keep their memory.
            std::mem::swap(&mut self.known, &mut self.place);
            self.is_known = true;
        }
    }

    /// Tells the objects.
    pub fn tell(&mut self) -> Around<'_> {
        Around { objects: &self.objects, is_new: std::mem::take(&mut self.is_new) }
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
            sorting::sort_few(&mut self.cells, &|a, b| a < b);
            near_doors(culler, &self.doors, eye, &mut self.doorways);
        }
    }

    /// Fills a scratch with the potentially visible objects: those of the rows that are in cells reachable through open portals, or in the
    /// doorways of shut ones, which are listed. All objects, if the place is in no cell.
    fn see(&self, culler: &Culler, scratch: &mut Scratch, doorways: &mut Vec<(CellId, Doorway)>) {
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
                    doorways.push((target, doorway));
                    culler.take_in_cell(target, |object| culler.is_in(doorway, culler.boxes.get(object.index())), scratch);
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

    /// True if a part of a box, given by centre and half size, is in a doorway, to within twice a frame's tolerance.
    pub(super) fn is_in(&self, (n, d, depth): Doorway, (centre, half): (Vec3, Vec3)) -> bool {
        let behind = d - 6.0 * self.tolerance as f32;
        let (at, reach) = (n.dot(centre), n.abs().dot(half) + 3.0 * self.tolerance as f32);
        at + reach >= behind && at - reach <= d + depth
    }
}
