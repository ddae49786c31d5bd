//! Least ways between the portals of a building, all doors open.
//!
//! E. W. Dijkstra's shortest paths (1959) from strip to strip: each portal is cut into upright strips, so that a way that goes through it does not
//! gain the whole of its width. A way from strip to strip is at least the distance of boxes around them.

use super::super::culler::{Culler, target};
use super::facets::Facets;
use crate::DirectedPortal;
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Most directed portals in the table. More: memory and time to make it grow with the square. Fewer: larger buildings have none, and ways
/// there are searched for along the straight line.
const MOST_LISTED: usize = 2000;
/// Most strips of a portal. More: time to make the table grows with the square. Fewer: weaker bounds, and more lines.
const MOST_STRIPS: usize = 4;
/// Width of a strip, metres, where so many are enough.
const WIDTH: f32 = 0.3;

/// No place in the table.
pub(super) const NONE: u32 = u32::MAX;

/// Least ways from one directed portal, once it is passed, to another.
#[derive(Clone, Debug)]
pub(super) struct Table {
    /// By directed portal: its place.
    places: Vec<u32>,
    count: usize,
    /// Metres.
    rows: Vec<f32>,
}

/// What a table is made of.
struct Net<'n> {
    culler: &'n Culler,
    facets: &'n Facets,
    places: &'n [u32],
    portals: &'n [DirectedPortal],
    /// By place: boxes around strips.
    strips: Vec<Vec<[Vec3; 2]>>,
}

impl Table {
    /// The table of some portals, in this order, made on all cores; empty if they are too many.
    pub fn new(culler: &Culler, facets: &Facets, mut portals: Vec<DirectedPortal>) -> Self {
        if portals.len() > MOST_LISTED {
            portals.clear();
        }
        let (count, mut places) = (portals.len(), vec![NONE; 2 * culler.portal_count()]);
        (0..).zip(&portals).for_each(|(place, portal)| places[portal.0 as usize] = place);
        let strips = portals.iter().map(|portal| strips(culler.portal_corners.get(portal.portal().index()))).collect();
        let net = Net { culler, facets, places: &places, portals: &portals, strips };
        let mut rows = vec![f32::INFINITY; count * count];
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let part = count.div_ceil(threads).max(1);
        std::thread::scope(|scope| {
            for (k, rows) in rows.chunks_mut(part * count.max(1)).enumerate() {
                let net = &net;
                scope.spawn(move || {
                    let mut known = vec![f32::INFINITY; count * MOST_STRIPS];
                    let rows = rows.chunks_mut(count).enumerate();
                    rows.for_each(|(i, row)| net.fill(k * part + i, row, &mut known));
                });
            }
        });
        Self { places, count, rows }
    }

    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The place of a portal.
    pub fn place(&self, portal: DirectedPortal) -> u32 {
        self.places[portal.0 as usize]
    }

    /// By place: the least ways from a portal at a place.
    pub fn row(&self, place: u32) -> &[f32] {
        &self.rows[place as usize * self.count..][..self.count]
    }
}

impl Net<'_> {
    /// Fills in the ways from a portal.
    fn fill(&self, from: usize, row: &mut [f32], known: &mut [f32]) {
        known.fill(f32::INFINITY);
        let mut queue = BinaryHeap::new();
        for k in 0..self.strips[from].len() {
            known[from * MOST_STRIPS + k] = 0.0;
            queue.push(Reverse((0, (from * MOST_STRIPS + k) as u32)));
        }
        while let Some(Reverse((bits, at))) = queue.pop() {
            let (metres, place) = (f32::from_bits(bits), at as usize / MOST_STRIPS);
            if metres > known[at as usize] {
                continue;
            }
            let (here, portal) = (&self.strips[place][at as usize % MOST_STRIPS], self.portals[place]);
            row[place] = row[place].min(metres);
            for next in self.facets.out(target(self.culler, portal)) {
                let place = self.places[next.0 as usize];
                if place == NONE || next.portal() == portal.portal() {
                    continue;
                }
                for (k, strip) in self.strips[place as usize].iter().enumerate() {
                    // Rounded down, so that it stays a bound; but not below what is on the way, so that rounds end.
                    let way = ((metres + gap(here, strip)) * (1.0 - 2.0 * f32::EPSILON)).max(metres);
                    let node = place as usize * MOST_STRIPS + k;
                    if way < known[node] {
                        known[node] = way;
                        queue.push(Reverse((way.to_bits(), node as u32)));
                    }
                }
            }
        }
    }
}

/// Boxes around upright strips of a winding.
fn strips(corners: &[Vec3]) -> Vec<[Vec3; 2]> {
    let [low, high] = corners.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[l, h], &p| [l.min(p), h.max(p)]);
    let (low, high) = (low.map(f32::next_down), high.map(f32::next_up));
    let size = high - low;
    let axis = if size.x > size.z { 0 } else { 2 };
    let count = (size[axis] / WIDTH).ceil().clamp(1.0, MOST_STRIPS as f32) as usize;
    let cut = |k: usize| if k == count { high[axis] } else { low[axis] + size[axis] * (k as f32 / count as f32) };
    (0..count)
        .map(|k| {
            let (mut from, mut to) = (low, high);
            (from[axis], to[axis]) = (cut(k), cut(k + 1));
            [from, to]
        })
        .collect()
}

/// Distance of two boxes, metres.
fn gap(a: &[Vec3; 2], b: &[Vec3; 2]) -> f32 {
    (a[0] - b[1]).max(b[0] - a[1]).max(Vec3::ZERO).length()
}
