//! The result of a frame.

use super::camera::Rect;
use super::culler::Culler;
use super::doors::Doors;
use super::portals;
use crate::math::bits::ones;
use crate::{CellId, DirectedPortal, ObjectId, PortalId};
use glam::Vec3;
use std::ops::{Add, AddAssign, Range};

/// Counters of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FrameStats {
    /// Cells reached (portals, both) or in the row (pvs); 0 in other modes.
    pub cells: u64,
    /// Directed portals crossed.
    pub portals: u64,
    /// Objects in the set.
    pub objects: u64,
    /// Their triangles.
    pub triangles: u64,
    /// Small objects left out ([`View::set_min_pixels`](super::View::set_min_pixels)).
    pub small: u64,
    /// Occlusion queries.
    pub queries: u64,
    /// Times that a limit on work was reached, so that more was kept.
    pub capped: u64,
}

impl Add for FrameStats {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            cells: self.cells + other.cells,
            portals: self.portals + other.portals,
            objects: self.objects + other.objects,
            triangles: self.triangles + other.triangles,
            small: self.small + other.small,
            queries: self.queries + other.queries,
            capped: self.capped + other.capped,
        }
    }
}

impl AddAssign for FrameStats {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// A portal crossed in the frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CrossedPortal {
    /// The directed portal.
    pub portal: DirectedPortal,
    /// Its rectangle on the screen: covers every pixel that shows something beyond it.
    pub rect: Rect,
}

/// The result of a frame, kept in its [`View`](super::View) until the next one.
#[derive(Debug)]
pub struct VisibleSet<'v> {
    /// The objects to draw, each once; in modes with portals, those of the eye's cell come first.
    pub objects: &'v [ObjectId],
    /// The cells reached (portals, both), the eye's own first.
    pub cells: &'v [CellId],
    /// The crossed portals, nearest (in portals) first.
    pub portals: &'v [CrossedPortal],
    /// The eye's cells, the one with the eye deepest inside first: several on a border. Empty if it is in none, or if the mode does not use
    /// cells.
    pub homes: &'v [CellId],
    /// Counters.
    pub stats: FrameStats,
    pub(super) eye: Vec3,
    pub(super) culler: &'v Culler,
    pub(super) doors: &'v Doors,
    pub(super) lists: &'v mut Lists,
}

impl VisibleSet<'_> {
    /// The objects as ranges of an index buffer that holds the objects' triangles in the order of their ids ([`Culler::indices`]):
    /// ascending, with neighbours joined, each for one draw.
    pub fn runs(&mut self) -> &[Range<u32>] {
        let Lists { marks, runs, .. } = &mut *self.lists;
        runs.clear();
        marks.fill(0);
        self.objects.iter().for_each(|o| marks[o.index() / 64] |= 1 << (o.index() % 64));
        for object in ones(marks) {
            let range = self.culler.indices(ObjectId(object as u32));
            match runs.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ if range.is_empty() => {}
                _ => runs.push(range),
            }
        }
        runs
    }

    /// The shut doors that count as open, ascending, since the eye is in their doorway: the leaf may be behind it. Linear in the number of
    /// shut doors.
    pub fn near_doors(&mut self) -> &[PortalId] {
        self.lists.near_doors.clear();
        near_doors(self.culler, self.doors, self.eye, &mut self.lists.near_doors);
        &self.lists.near_doors
    }
}

/// Adds the shut portals with an eye in their doorway, ascending.
pub(super) fn near_doors(culler: &Culler, doors: &Doors, eye: Vec3, near: &mut Vec<PortalId>) {
    near.extend(doors.shut().filter(|&portal| portals::is_in_doorway(culler, eye.as_dvec3(), portal)));
}

/// Lists that are made from a result when they are asked for.
#[derive(Clone, Debug)]
pub(super) struct Lists {
    /// Objects, as bits.
    marks: Vec<u64>,
    runs: Vec<Range<u32>>,
    near_doors: Vec<PortalId>,
}

impl Lists {
    pub fn for_culler(culler: &Culler) -> Self {
        let objects = culler.object_count();
        Self {
            marks: vec![0; objects.div_ceil(64)],
            runs: Vec::with_capacity(objects.div_ceil(2)),
            near_doors: Vec::with_capacity(culler.portal_count()),
        }
    }
}
