//! Polygons of an object that meet as sides of a convex solid do.
//!
//! Each patch grows from the largest polygon that is left, across edges, while each of its faces has all of it behind. A
//! patch may be closed or not: a building without a floor, a side of a wall with a part of the lintel.

use super::occluders::{Edge, Face};
use super::polygons::{Polygon, Polygons};
use enfilade::math::geom::{Aabb, Plane, middle};
use glam::DVec3;
use std::collections::HashMap;

/// Most faces of a patch. More: a frame's choice takes long for what is round. Fewer: round towers hide less.
const MOST_FACES: usize = 32;

/// An occluder.
pub struct Patch {
    /// Its faces with their edges.
    pub faces: Vec<(Face, Vec<Edge>)>,
    /// Square metres.
    pub area: f64,
    pub bounds: Aabb,
}

/// All patches of an object; each polygon is in one.
pub fn patches(polygons: &Polygons, coplanar: f64) -> Vec<Patch> {
    let all = &polygons.all;
    let mut growth = Growth { polygons, coplanar, owners: owners(all), taken: vec![false; all.len()] };
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|&a, &b| all[b].area.total_cmp(&all[a].area));
    let mut patches = Vec::new();
    for seed in order {
        if growth.taken[seed] {
            continue;
        }
        // Models don't agree on which side is outside.
        let [out, back] = [1.0, -1.0].map(|sign| growth.grow(seed, sign));
        let area = |faces: &[usize]| faces.iter().map(|&f| all[f].area).sum::<f64>();
        let (faces, sign) = if area(&back) > area(&out) { (back, -1.0) } else { (out, 1.0) };
        faces.iter().for_each(|&f| growth.taken[f] = true);
        patches.push(growth.patch(&faces, sign));
    }
    patches
}

/// The polygon that has an edge in this direction; `None` where several have.
fn owners(all: &[Polygon]) -> HashMap<[u32; 2], Option<usize>> {
    let mut owners = HashMap::new();
    for (p, polygon) in all.iter().enumerate() {
        for side in sides(&polygon.ring) {
            owners.entry(side).and_modify(|owner| *owner = None).or_insert(Some(p));
        }
    }
    owners
}

fn sides(ring: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    (0..ring.len()).map(|k| [ring[k], ring[(k + 1) % ring.len()]])
}

struct Growth<'p> {
    polygons: &'p Polygons,
    coplanar: f64,
    owners: HashMap<[u32; 2], Option<usize>>,
    taken: Vec<bool>,
}

impl Growth<'_> {
    /// The polygon across an edge, if it is the only one, and this edge has one owner, too.
    fn across(&self, [a, b]: [u32; 2]) -> Option<usize> {
        let owner = |side: [u32; 2]| self.owners.get(&side).copied().flatten();
        owner([a, b]).and(owner([b, a]))
    }

    /// A patch around a polygon whose outside is at the front of its polygons (`sign` 1) or at their back (-1).
    fn grow(&self, seed: usize, sign: f64) -> Vec<usize> {
        let mut faces = vec![seed];
        let mut at = 0;
        while at < faces.len() {
            for next in sides(&self.polygons.all[faces[at]].ring).filter_map(|side| self.across(side)) {
                let free = !self.taken[next] && !faces.contains(&next) && faces.len() < MOST_FACES;
                if free && faces.iter().all(|&face| self.is_convex(face, next, sign)) {
                    faces.push(next);
                }
            }
            at += 1;
        }
        faces
    }

    /// Whether each of two polygons has the other one behind. Not if one is in the plane of the other: together they weren't
    /// convex, or they would be merged.
    fn is_convex(&self, one: usize, other: usize, sign: f64) -> bool {
        let [one, other] = [one, other].map(|p| &self.polygons.all[p]);
        let range = |plane: &Plane, of: &Polygon| {
            let distances = of.ring.iter().map(|&c| sign * plane.distance(self.polygons.places[c as usize]));
            distances.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], d| [least.min(d), most.max(d)])
        };
        [range(&one.plane, other), range(&other.plane, one)]
            .iter()
            .all(|&[least, most]| most <= self.coplanar && least < -self.coplanar)
    }

    fn patch(&self, faces: &[usize], sign: f64) -> Patch {
        let at = |c: &u32| self.polygons.places[*c as usize];
        let of = |p: usize| &self.polygons.all[p];
        let corners = || faces.iter().flat_map(|&p| &of(p).corners).map(at);
        let face = |&p: &usize| {
            let polygon = of(p);
            let (normal, point) = (sign * polygon.plane.n, at(&polygon.ring[0]));
            let height = |corner: DVec3| normal.dot(corner - point);
            let mut ring = polygon.ring.clone();
            if sign < 0.0 {
                ring.reverse();
            }
            let edge = |side: [u32; 2]| {
                let across = self.across(if sign < 0.0 { [side[1], side[0]] } else { side });
                let neighbour = across.and_then(|p| faces.iter().position(|&f| f == p)).map(|n| n as u32);
                Edge { ends: side.map(|c| at(&c)), neighbour }
            };
            let edges = sides(&ring).map(edge).collect();
            let points: Vec<DVec3> = ring.iter().map(at).collect();
            let face = Face {
                normal,
                point,
                before: corners().map(height).fold(0.0, f64::max),
                behind: polygon.corners.iter().map(|c| -height(at(c))).fold(0.0, f64::max),
                area: polygon.area,
                centre: middle(&points),
                edges: 0..0,
            };
            (face, edges)
        };
        let area = faces.iter().map(|&p| of(p).area).sum();
        Patch { faces: faces.iter().map(face).collect(), area, bounds: Aabb::of(corners()) }
    }
}
