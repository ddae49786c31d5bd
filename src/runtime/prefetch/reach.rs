//! How far an eye has to go to be in which cell, at least.
//!
//! Based on: E. W. Dijkstra's shortest ways (1959), from portal to portal. The way within a cell is taken as straight, from the box around one
//! portal to the box around the next: no way through the cell is shorter, so no length is more than the true one.
//!
//! Where it deviates: a cell is gone on from for its first ways in only ([`MOST_WAYS_IN`]). The last of these stands for all later ones, with
//! the straight line from the eye, which no way undercuts either. So a start costs a few looks at each portal that it comes to, whatever the
//! graph is like.

use super::super::culler::{Culler, target};
use crate::{CellId, DirectedPortal, PortalId};
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Ways into a cell that are gone on from. More: starts cost more in halls with many doors. Fewer: what is behind such a hall seems nearer than
/// it is.
const MOST_WAYS_IN: u8 = 8;

/// Where an eye is, and where it goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walker {
    pub eye: Vec3,
    /// Where it will be soon if it goes on as it does.
    pub ahead: Vec3,
}

impl Walker {
    /// Metres to a box, at most: of two doors at the same distance, the one to which the eye goes counts as nearer.
    fn distance(&self, to: &[Vec3; 2]) -> f32 {
        let here = gap(&[self.eye; 2], to);
        0.5 * (here + here.min(gap(&[self.ahead; 2], to)))
    }
}

/// Cells in the order in which an eye may come to them.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    /// By portal: the box around it.
    boxes: Vec<[Vec3; 2]>,
    /// By portal: the eye does not go through it.
    barred: Vec<bool>,
    /// By directed portal: the least that is known of the way to it, metres.
    lengths: Vec<f32>,
    /// By cell: ways in that were gone on from.
    ways_in: Vec<u8>,
    /// Ways that wait: bits of a length, which are in its order, and a directed portal.
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
            // Each directed portal leads out of one cell, and waits once a way into that, and once for an eye that is in no cell.
            queue: BinaryHeap::with_capacity((usize::from(MOST_WAYS_IN) + 2) * directed),
            walker: Walker { eye: Vec3::ZERO, ahead: Vec3::ZERO },
        }
    }

    pub fn bar(&mut self, portal: PortalId, barred: bool) {
        self.barred[portal.index()] = barred;
    }

    /// Starts anew from an eye in some cells; in none, the way to each portal is straight.
    pub fn start(&mut self, culler: &Culler, walker: Walker, homes: &[CellId]) {
        self.queue.clear();
        self.lengths.fill(f32::INFINITY);
        self.ways_in.fill(0);
        self.walker = walker;
        for &home in homes {
            // A way that comes back is longer than the straight one from here.
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

    /// The next cell that the eye may come to, and after how many metres; not those where it is.
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

    /// Goes on through a cell; the last way in stands for all later ones.
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

/// Metres between two boxes.
fn gap(a: &[Vec3; 2], b: &[Vec3; 2]) -> f32 {
    (a[0] - b[1]).max(b[0] - a[1]).max(Vec3::ZERO).length()
}
