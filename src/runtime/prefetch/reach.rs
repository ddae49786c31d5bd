//! Lower bounds of the walking distance to each cell.
//!
//! Based on: E. W. Dijkstra's shortest paths (1959), from portal to portal. The distance within a cell is the straight one from the box of
//! one portal to the box of the next, a lower bound of the true one.
//!
//! Deviation: a cell is expanded only for its first [`MOST_WAYS_IN`] entries. The last of these represents all later ones, with the
//! straight distance from the eye, which is also a lower bound. So each reached portal is visited a few times, for any graph.

use super::super::culler::{Culler, target};
use crate::{CellId, DirectedPortal, PortalId};
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Most entries of a cell that are expanded. More: starts cost more in halls with many doors. Fewer: cells behind such a hall seem nearer
/// than they are.
const MOST_WAYS_IN: u8 = 8;

/// The eye and its motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walker {
    pub eye: Vec3,
    /// Its extrapolated position.
    pub ahead: Vec3,
}

impl Walker {
    /// Distance to a box, metres, reduced in the direction of motion: of two doors at the same distance, the one ahead counts as nearer.
    fn distance(&self, to: &[Vec3; 2]) -> f32 {
        let here = gap(&[self.eye; 2], to);
        0.5 * (here + here.min(gap(&[self.ahead; 2], to)))
    }
}

/// Cells in the order in which an eye may reach them.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    /// By portal: the box around it.
    boxes: Vec<[Vec3; 2]>,
    /// By portal: whether it is barred.
    barred: Vec<bool>,
    /// By directed portal: the shortest known distance, metres.
    lengths: Vec<f32>,
    /// By cell: number of expanded entries.
    ways_in: Vec<u8>,
    /// The queue: bits of a length, which sort like the length, and a directed portal.
    queue: BinaryHeap<Reverse<(u32, u32)>>,
    walker: Walker,
}

impl Reach {
    pub fn new(culler: &Culler, barred: Vec<bool>) -> Self {
        let around = |portal: usize| {
            let corners = culler.portal_corners.get(portal).iter();
            corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], &p| [low.min(p), high.max(p)])
        };
        let directed = 2 * culler.portal_count();
        Self {
            boxes: (0..culler.portal_count()).map(around).collect(),
            barred,
            lengths: vec![f32::INFINITY; directed],
            ways_in: vec![0; culler.cell_count()],
            // Each directed portal is queued at most once per expanded entry of its source cell, and once for an eye in no cell.
            queue: BinaryHeap::with_capacity((usize::from(MOST_WAYS_IN) + 2) * directed),
            walker: Walker { eye: Vec3::ZERO, ahead: Vec3::ZERO },
        }
    }

    pub fn bar(&mut self, portal: PortalId, barred: bool) {
        self.barred[portal.index()] = barred;
    }

    /// Restarts from an eye in some cells; without cells, the distance to each portal is straight.
    pub fn start(&mut self, culler: &Culler, walker: Walker, homes: &[CellId]) {
        self.queue.clear();
        self.lengths.fill(f32::INFINITY);
        self.ways_in.fill(0);
        self.walker = walker;
        for &home in homes {
            // A path that returns is longer than the straight distance.
            self.ways_in[home.index()] = MOST_WAYS_IN;
            for &next in culler.cell_portals.get(home.index()) {
                self.offer(next, walker.distance(&self.boxes[next.portal().index()]));
            }
        }
        if homes.is_empty() {
            for next in (0..self.lengths.len() as u32).map(DirectedPortal) {
                self.offer(next, walker.distance(&self.boxes[next.portal().index()]));
            }
        }
    }

    /// The next cell that the eye may reach, with its distance in metres; not its own cells.
    pub fn next(&mut self, culler: &Culler) -> Option<(CellId, f32)> {
        while let Some(Reverse((bits, portal))) = self.queue.pop() {
            let (length, portal) = (f32::from_bits(bits), DirectedPortal(portal));
            let cell = target(culler, portal);
            let ways_in = self.ways_in[cell.index()];
            if length > self.lengths[portal.0 as usize] || ways_in == MOST_WAYS_IN {
                continue;
            }
            self.ways_in[cell.index()] = ways_in + 1;
            self.go_on(culler, cell, portal, ways_in + 1 == MOST_WAYS_IN);
            if ways_in == 0 {
                return Some((cell, length));
            }
        }
        None
    }

    /// Expands a cell; the last entry represents all later ones.
    fn go_on(&mut self, culler: &Culler, cell: CellId, from: DirectedPortal, last: bool) {
        let (length, start) = (self.lengths[from.0 as usize], self.boxes[from.portal().index()]);
        for &next in culler.cell_portals.get(cell.index()) {
            let end = &self.boxes[next.portal().index()];
            let way = if last { length.max(self.walker.distance(end)) } else { length + gap(&start, end) };
            self.offer(next, way);
        }
    }

    fn offer(&mut self, portal: DirectedPortal, length: f32) {
        let known = &mut self.lengths[portal.0 as usize];
        if !self.barred[portal.portal().index()] && length < *known {
            *known = length;
            self.queue.push(Reverse((length.to_bits(), portal.0)));
        }
    }
}

/// Distance between two boxes, metres.
fn gap(a: &[Vec3; 2], b: &[Vec3; 2]) -> f32 {
    (a[0] - b[1]).max(b[0] - a[1]).max(Vec3::ZERO).length()
}
