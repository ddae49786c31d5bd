//! Least ways between the portals of a building, all doors open.
//!
//! E. W. Dijkstra's shortest paths (1959) from strip to strip: each portal is cut into upright strips, so that a way that goes through it does not
//! gain the whole of its width. A way from strip to strip is at least the distance of boxes around them.
//!
//! What a search asks of one cell and one goal is a block of the table, in one place of the memory: its time is that of reading it.

use super::super::culler::{Culler, Lists, target};
use crate::math::parallel;
use crate::{CellId, DirectedPortal};
use glam::Vec3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

/// Most directed portals in the table. More: memory and time to make it grow with the square. Fewer: larger buildings have none, and ways
/// there are searched for along the straight line.
const MOST_LISTED: usize = 2000;
/// Most strips of a portal. More: time to make the table grows with the square. Fewer: weaker bounds, and more lines.
const MOST_STRIPS: usize = 4;
/// Width of a strip, metres, where so many are enough.
const WIDTH: f32 = 0.3;
/// What rounding adds to a sum of two lengths at most, as a share. Larger: weaker bounds. Smaller: they are none.
const ROUNDED: f32 = 4.0 * f32::EPSILON;

/// No place in the table.
const NONE: u32 = u32::MAX;
/// No way.
pub(super) const NO_WAY: u16 = u16::MAX;

/// A box around a strip of a portal.
pub(super) type Strip = [Vec3; 2];

/// Least ways from one directed portal, once it is passed, to another.
#[derive(Clone, Debug)]
pub(super) struct Table {
    /// By directed portal: its place. Those out of a cell are beside each other.
    places: Vec<u32>,
    /// By cell: the first place of its portals, and the end of the last.
    firsts: Vec<usize>,
    strips: Lists<Strip>,
    /// By place: metres of a unit of its ways.
    units: Vec<f32>,
    /// A block for each cell and each other one: the portals out of the former, and for each the ways to those into the latter. Blocks of
    /// the same former cell follow each other.
    ways: Vec<u16>,
}

impl Table {
    /// The table of some portals, in this order, those out of a cell beside each other, and with each the one back; made on all cores. Empty if
    /// they are too many.
    pub fn new(culler: &Culler, mut portals: Vec<DirectedPortal>) -> Self {
        if portals.len() > MOST_LISTED {
            portals.clear();
        }
        let count = portals.len();
        let net = Net::new(culler, portals);
        let (mut units, mut ways) = (vec![0.0; count], vec![NO_WAY; count * count]);
        let (mut units_left, mut ways_left) = (&mut units[..], &mut ways[..]);
        let bands = (0..culler.cell_count()).map(|cell| {
            let places = net.firsts[cell]..net.firsts[cell + 1];
            let units = units_left.split_off_mut(..places.len()).unwrap_or_default();
            let ways = ways_left.split_off_mut(..places.len() * count).unwrap_or_default();
            Band { places, units, ways }
        });
        parallel::deal(bands, &Work::default, &|band, work| net.fill(band, work));
        let mut places = vec![NONE; 2 * culler.portal_count()];
        (0..).zip(&net.portals).for_each(|(place, portal)| places[portal.0 as usize] = place);
        let strips = Lists::new(net.portals.iter().map(|portal| strips_of(culler, *portal)));
        Self { places, firsts: net.firsts, strips, units, ways }
    }

    pub fn is_empty(&self) -> bool {
        self.units.is_empty()
    }

    /// Whether a portal is in the table.
    pub fn has(&self, portal: DirectedPortal) -> bool {
        self.places[portal.0 as usize] != NONE
    }

    /// The strips of a portal of the table.
    pub fn strips(&self, portal: DirectedPortal) -> &[Strip] {
        self.strips.get(self.places[portal.0 as usize] as usize)
    }

    /// The least ways from a portal of the table, out of a cell, to each of the table into another, in the order of the latter's portals: in
    /// units, and their metres.
    pub fn ways(&self, portal: DirectedPortal, cell: CellId, into: CellId) -> (&[u16], f32) {
        let place = self.places[portal.0 as usize] as usize;
        let [band, block] = [cell, into].map(|cell| self.firsts[cell.index()]..self.firsts[cell.index() + 1]);
        let start = band.start * self.units.len() + block.start * band.len() + (place - band.start) * block.len();
        (&self.ways[start..start + block.len()], self.units[place])
    }
}

/// What is to be filled in: the ways from the portals out of a cell.
struct Band<'t> {
    places: Range<usize>,
    units: &'t mut [f32],
    ways: &'t mut [u16],
}

/// What a table is made of.
struct Net {
    portals: Vec<DirectedPortal>,
    /// By cell: the first place of its portals, and the end of the last.
    firsts: Vec<usize>,
    /// By place: that of the portal back.
    back: Vec<usize>,
    /// By place: the first of its strips, and the end of the last.
    starts: Vec<usize>,
    /// By strip: its place, and the strips of the cell that it leads into.
    strips: Vec<(usize, Range<usize>)>,
    /// The boxes of strips, an array for each number.
    boxes: [Vec<f32>; 6],
}

/// Memory of a thread.
#[derive(Default)]
struct Work {
    /// By strip, metres.
    known: Vec<f32>,
    next: Vec<f32>,
    /// Bits of a length, which sort like it, and a strip.
    queue: BinaryHeap<Reverse<(u32, u32)>>,
}

impl Net {
    fn new(culler: &Culler, portals: Vec<DirectedPortal>) -> Self {
        let boxes: Vec<Vec<Strip>> = portals.iter().map(|portal| strips_of(culler, *portal).collect()).collect();
        let out_of = |portal: DirectedPortal| target(culler, reversed(portal)).index();
        let firsts: Vec<usize> =
            (0..=culler.cell_count()).map(|cell| portals.partition_point(|&portal| out_of(portal) < cell)).collect();
        let ends = boxes.iter().scan(0, |end, strips| {
            *end += strips.len();
            Some(*end)
        });
        let starts: Vec<usize> = std::iter::once(0).chain(ends).collect();
        let beyond = |portal: DirectedPortal| {
            let cell = target(culler, portal).index();
            starts[firsts[cell]]..starts[firsts[cell + 1]]
        };
        let of_place = |place: usize| std::iter::repeat_n((place, beyond(portals[place])), boxes[place].len());
        let strips = (0..portals.len()).flat_map(of_place).collect();
        let back = portals.iter().map(|&portal| {
            let cell = target(culler, portal).index();
            let beside = portals[firsts[cell]..firsts[cell + 1]].iter();
            firsts[cell] + beside.take_while(|&&other| other != reversed(portal)).count()
        });
        let number = |k: usize| boxes.iter().flatten().map(|strip| strip[k / 3][k % 3]).collect();
        Self { back: back.collect(), boxes: std::array::from_fn(number), portals, firsts, starts, strips }
    }

    fn fill(&self, Band { places, units, ways }: Band<'_>, work: &mut Work) {
        for (i, unit) in units.iter_mut().enumerate() {
            self.search(places.start + i, work);
            // By the portal back: those into a cell are in its order.
            let least = |place: usize| {
                let strips = self.starts[self.back[place]]..self.starts[self.back[place] + 1];
                work.known[strips].iter().copied().fold(f32::INFINITY, f32::min)
            };
            let finite = work.known.iter().copied().filter(|metres| metres.is_finite());
            *unit = (finite.fold(0.0, f32::max) / f32::from(NO_WAY - 1)).max(f32::MIN_POSITIVE);
            for block in self.firsts.windows(2) {
                let start = block[0] * places.len() + i * (block[1] - block[0]);
                for (way, place) in ways[start..].iter_mut().zip(block[0]..block[1]) {
                    let metres = least(place);
                    // Rounded down.
                    *way = if metres.is_finite() { (metres / *unit) as u16 } else { NO_WAY };
                }
            }
        }
    }

    /// Finds the ways from a portal's strips to all.
    fn search(&self, from: usize, Work { known, next, queue }: &mut Work) {
        known.clear();
        known.resize(self.strips.len(), f32::INFINITY);
        let start = self.starts[from]..self.starts[from + 1];
        known[start.clone()].fill(0.0);
        queue.extend(start.map(|strip| Reverse((0, strip as u32))));
        while let Some(Reverse((bits, at))) = queue.pop() {
            let (metres, (place, beyond)) = (f32::from_bits(bits), &self.strips[at as usize]);
            if metres > known[at as usize] {
                continue;
            }
            self.go_on(at as usize, metres, next);
            for (strip, &way) in beyond.clone().zip(&*next) {
                if way < known[strip] && self.strips[strip].0 != self.back[*place] {
                    known[strip] = way;
                    queue.push(Reverse((way.to_bits(), strip as u32)));
                }
            }
        }
    }

    /// The ways from a strip to all of the next cell, after so many metres.
    fn go_on(&self, at: usize, metres: f32, ways: &mut Vec<f32>) {
        let next = self.strips[at].1.clone();
        ways.clear();
        ways.resize(next.len(), 0.0);
        for axis in 0..3 {
            let [low, high] = [&self.boxes[axis], &self.boxes[axis + 3]];
            let (here, lows, highs) = ([low[at], high[at]], &low[next.clone()], &high[next.clone()]);
            for ((square, low), high) in ways.iter_mut().zip(lows).zip(highs) {
                let gap = (low - here[1]).max(here[0] - high).max(0.0);
                *square += gap * gap;
            }
        }
        // Rounded down, so that it stays a bound; but not below what is on the way, so that rounds end.
        ways.iter_mut().for_each(|way| *way = ((metres + way.sqrt()) * (1.0 - ROUNDED)).max(metres));
    }
}

/// The same portal the other way.
pub(super) fn reversed(portal: DirectedPortal) -> DirectedPortal {
    DirectedPortal(portal.0 ^ 1)
}

/// Boxes around upright strips of a portal.
pub(super) fn strips_of(culler: &Culler, portal: DirectedPortal) -> impl Iterator<Item = Strip> {
    let corners = culler.portal_corners.get(portal.portal().index());
    let [low, high] = corners.iter().fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[l, h], &p| [l.min(p), h.max(p)]);
    let (low, high) = (low.map(f32::next_down), high.map(f32::next_up));
    let size = high - low;
    let axis = if size.x > size.z { 0 } else { 2 };
    let count = (size[axis] / WIDTH).ceil().clamp(1.0, MOST_STRIPS as f32) as usize;
    let cut = move |k: usize| if k == count { high[axis] } else { low[axis] + size[axis] * (k as f32 / count as f32) };
    (0..count).map(move |k| {
        let (mut from, mut to) = (low, high);
        (from[axis], to[axis]) = (cut(k), cut(k + 1));
        [from, to]
    })
}

/// Distance of two boxes, metres, rounded down.
pub(super) fn gap(a: &Strip, b: &Strip) -> f32 {
    (a[0] - b[1]).max(b[0] - a[1]).max(Vec3::ZERO).length() * (1.0 - ROUNDED)
}
