//! The first cuts of space, and the assignment of leaves to cells.
//!
//! The first cuts make *tiles*: along the wall that covers the largest share of its cut, while there are large walls; then in halves, while
//! a tile is large. A cell is a connected component of a tile's leaves. Small parts join the neighbour with the largest opening: a niche is
//! no cell.

use super::adjacency::Contact;
use super::tree::{Bsp, Cut, Face, Fragment, Poly, reach};
use crate::cells::disjoint_sets::DisjointSets;
use crate::math::geom::{Aabb, Plane, area};
use glam::DVec3;
use std::collections::BTreeMap;

/// A wall that covers less than this share of its cut makes no tile: the rest of the cut would be useless portals. Larger: walls that end
/// in a hall are lost. Smaller: parapets and steps divide halls.
const LEAST_COVERED: f64 = 0.25;
/// A plane that leaves less than this on one side of a part only grazes it and makes no cut, as a share of the model's diagonal. Larger:
/// thin walls make no cuts. Smaller: an impossible cut ends the tile.
const GRAZING: f64 = 1e-7;
/// Candidate planes for a cut.
const TRIED: usize = 16;
/// A part of a tile is small if its longest extent is at most this, or its volume at most the cube of this, in smallest occluders.
const SMALL: f64 = 1.5;
/// The number of the outside.
pub const OUTSIDE: u32 = 0;

/// How to cut.
pub struct Tiles<'t> {
    /// Planes of the triangles.
    pub planes: &'t [Plane],
    /// Tiles are halved across these axes.
    pub axes: [DVec3; 3],
    /// The model's box: space outside is no tile.
    pub around: Aabb,
    /// Largest edge of a tile, metres.
    pub edge: f64,
    /// Smallest edge of a wall that makes tiles, metres.
    pub occluder: f64,
}

/// Labels of leaves.
pub struct Parts {
    /// Label of each leaf; [`OUTSIDE`] at the rim.
    pub labels: Vec<Option<u32>>,
    /// Number of labels.
    pub count: usize,
}

impl Tiles<'_> {
    /// The cut of a part of space; `None` if it is a tile.
    pub fn cut(&self, poly: &Poly, inside: &[Fragment]) -> Option<Cut> {
        let bounds = poly.bounds();
        let touch = 1e-9 * self.around.diagonal();
        for (k, n) in DVec3::AXES.into_iter().enumerate() {
            for d in [self.around.min[k], self.around.max[k]] {
                if bounds.min[k] < d - touch && bounds.max[k] > d + touch {
                    return Some((Plane { n, d }, None));
                }
            }
        }
        if !self.around.inflated(touch).contains(bounds.centre()) {
            return None;
        }
        self.wall(poly, inside).or_else(|| self.half(poly))
    }

    /// The wall that covers the largest share of its cut.
    fn wall(&self, poly: &Poly, inside: &[Fragment]) -> Option<Cut> {
        let mut areas: BTreeMap<u32, f64> = BTreeMap::new();
        inside.iter().for_each(|f| *areas.entry(f.plane).or_default() += area(&f.points));
        let mut large: Vec<(u32, f64)> = areas.into_iter().filter(|a| a.1 >= self.occluder.powi(2)).collect();
        large.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        large.truncate(TRIED);
        let covered = |&(id, area_of_wall): &(u32, f64)| {
            let plane = &self.planes[id as usize];
            let section =
                if crosses(poly, plane, GRAZING * self.around.diagonal()) { area(&poly.section(plane)) } else { 0.0 };
            if section > 0.0 { (area_of_wall / section, id) } else { (0.0, id) }
        };
        let walls = large.iter().map(covered).filter(|wall| wall.0 >= LEAST_COVERED);
        let best = walls.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
        Some((self.planes[best.1 as usize], Some(best.1)))
    }

    /// A cut across the longest direction, if that is longer than a tile.
    fn half(&self, poly: &Poly) -> Option<Cut> {
        let along = |n: DVec3| {
            let origin = Plane { n, d: 0.0 };
            poly.faces
                .iter()
                .map(|f| reach(&f.points, &origin))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |a, r| (a.0.min(r.0), a.1.max(r.1)))
        };
        let longest =
            self.axes.into_iter().map(|n| (along(n), n)).max_by(|(a, _), (b, _)| (a.1 - a.0).total_cmp(&(b.1 - b.0)));
        let ((low, high), n) = longest?;
        (high - low > self.edge).then_some((Plane { n, d: 0.5 * (low + high) }, None))
    }

    /// The cells of the leaves; `slivers` as [`slivers`] gives them.
    pub fn parts(&self, bsp: &Bsp, contacts: &[Contact], slivers: &[(u32, u32)]) -> Parts {
        let leaves = bsp.leaves.len() as u32;
        let mut sets = DisjointSets::new(leaves as usize);
        let mut rim: Option<u32> = None;
        for (leaf, _) in (0..).zip(bsp.leaves_at_rim()).filter(|(_, at_rim)| *at_rim) {
            sets.join(*rim.get_or_insert(leaf), leaf);
        }
        let in_one_tile = |c: &Contact| c.leaves.map(|l| bsp.leaves[l as usize].tile);
        for c in contacts.iter().filter(|c| c.wide && in_one_tile(c)[0] == in_one_tile(c)[1]) {
            sets.join(c.leaves[0], c.leaves[1]);
        }
        slivers.iter().for_each(|&(a, b)| _ = sets.join(a, b));
        while self.join_small(bsp, contacts, rim, &mut sets) {}
        let mut numbers: BTreeMap<u32, u32> = rim.map(|leaf| (sets.find(leaf), OUTSIDE)).into_iter().collect();
        let mut number = |leaf: u32| {
            let next = numbers.len() as u32;
            *numbers.entry(sets.find(leaf)).or_insert(next)
        };
        let labels: Vec<Option<u32>> = (0..leaves).map(|leaf| Some(number(leaf))).collect();
        Parts { labels, count: numbers.len() }
    }

    /// Joins each small part to the neighbour with the largest opening; false if there is none.
    fn join_small(&self, bsp: &Bsp, contacts: &[Contact], rim: Option<u32>, sets: &mut DisjointSets) -> bool {
        let mut boxes: BTreeMap<u32, Aabb> = BTreeMap::new();
        for (leaf, l) in (0..).zip(&bsp.leaves) {
            let bounds = boxes.entry(sets.find(leaf)).or_insert(Aabb::EMPTY);
            *bounds = bounds.union(l.poly.bounds());
        }
        let outside = rim.map(|leaf| sets.find(leaf));
        let least = SMALL * self.occluder;
        let is_small = |part: u32| {
            let size = boxes[&part].size();
            Some(part) != outside && (size.max_element() < least || size.x * size.y * size.z < least.powi(3))
        };
        let mut open: BTreeMap<(u32, u32), f64> = BTreeMap::new();
        for c in contacts.iter().filter(|c| c.wide) {
            let [a, b] = c.leaves.map(|l| sets.find(l));
            for (a, b) in [(a, b), (b, a)] {
                if a != b && is_small(a) && Some(b) != outside {
                    *open.entry((a, b)).or_default() += c.open_area;
                }
            }
        }
        let mut best: BTreeMap<u32, (f64, u32)> = BTreeMap::new();
        for ((a, b), area) in open {
            let known = best.entry(a).or_insert((area, b));
            if area > known.0 {
                *known = (area, b);
            }
        }
        best.iter().for_each(|(&a, &(_, b))| _ = sets.join(a, b));
        !best.is_empty()
    }
}

/// Whether a plane leaves more than `least` metres of a part on both sides.
fn crosses(poly: &Poly, plane: &Plane, least: f64) -> bool {
    let sides = poly.faces.iter().map(|f| reach(&f.points, plane));
    let (low, high) = sides.fold((0.0f64, 0.0f64), |a, r| (a.0.min(r.0), a.1.max(r.1)));
    low < -least && high > least
}

/// Leaves thinner than `least` metres, each with the neighbour of the largest opening. All openings into a sliver may be narrower than the
/// smallest hole although a wide opening leads through it. So a sliver belongs to its neighbour, and is never solid by itself.
pub fn slivers(bsp: &Bsp, contacts: &[Contact], least: f64) -> Vec<(u32, u32)> {
    let is_sliver = |leaf: u32| {
        let poly = &bsp.leaves[leaf as usize].poly;
        let thickness = |f: &Face| {
            let (low, high) = poly
                .faces
                .iter()
                .map(|g| reach(&g.points, &f.plane))
                .fold((0.0f64, 0.0f64), |a, r| (a.0.min(r.0), a.1.max(r.1)));
            high - low
        };
        poly.faces.iter().map(thickness).fold(f64::INFINITY, f64::min) < least
    };
    let mut best: BTreeMap<u32, (f64, u32)> = BTreeMap::new();
    for c in contacts.iter().filter(|c| c.open_area > 0.0) {
        for [leaf, other] in [c.leaves, [c.leaves[1], c.leaves[0]]] {
            let known = best.get(&leaf).map_or(0.0, |b| b.0);
            if c.open_area > known && is_sliver(leaf) {
                best.insert(leaf, (c.open_area, other));
            }
        }
    }
    best.into_iter().map(|(leaf, (_, other))| (leaf, other)).collect()
}
