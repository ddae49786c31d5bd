//! Coplanar triangles of an object, merged to convex polygons.
//!
//! Based on: Hertel, Mehlhorn, *Fast triangulation of simple polygons*, 1983 (edges between triangles are taken out while
//! what is left is convex). Deviation: the longest edges first, since large polygons are wanted and not few.

use enfilade::math::geom::{Plane, newell};
use enfilade::scene::{Object, Scene};
use glam::DVec3;
use std::collections::HashMap;

/// Sine of the angle by which a corner of a polygon may turn back. Larger: what such a polygon surely hides is smaller than
/// it by so much of its size. Smaller: walls fall apart where `f32` has put a corner beside the line that it is on.
const REFLEX: f64 = 1e-3;

/// A polygon of triangles.
#[derive(Clone, PartialEq, Debug)]
pub struct Polygon {
    /// Its corners, counter-clockwise seen from before its plane: indices into [`Polygons::places`].
    pub ring: Vec<u32>,
    /// All corners of its triangles, some of them often.
    pub corners: Vec<u32>,
    /// Those are near it.
    pub plane: Plane,
    /// Square metres.
    pub area: f64,
}

/// Those of an object; each triangle is in one.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Polygons {
    /// Where corners are, each once.
    pub places: Vec<DVec3>,
    /// In the order of their first triangles.
    pub all: Vec<Polygon>,
}

/// Merges the triangles of an object whose corners are within `coplanar` metres of one plane.
pub fn polygons(scene: &Scene, object: &Object, coplanar: f64) -> Polygons {
    let mut places = Vec::new();
    let mut numbers: HashMap<[u64; 3], u32> = HashMap::new();
    let mut all: Vec<Option<Polygon>> = Vec::new();
    for t in object.triangles.clone() {
        let corners = scene.corners(t as usize);
        let ring = corners.map(|p| {
            // Both zeros are one place.
            *numbers.entry((p + DVec3::ZERO).to_array().map(f64::to_bits)).or_insert_with(|| {
                places.push(p);
                places.len() as u32 - 1
            })
        });
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        if let Some(n) = normal.try_normalize() {
            let plane = Plane::through(corners[0], n);
            all.push(Some(Polygon { ring: ring.into(), corners: ring.into(), plane, area: normal.length() * 0.5 }));
        }
    }
    let mut owners: Vec<u32> = (0..all.len() as u32).collect();
    for [a, b] in shared_edges(&places, &all) {
        let [a, b] = [a, b].map(|p| owner(&mut owners, p));
        let (Some(one), Some(other)) = (&all[a as usize], &all[b as usize]) else { continue };
        if a != b
            && let Some(merged) = merge(&places, one, other, coplanar)
        {
            let (keep, drop) = (a.min(b), a.max(b));
            owners[drop as usize] = keep;
            all[drop as usize] = None;
            all[keep as usize] = Some(merged);
        }
    }
    Polygons { places, all: all.into_iter().flatten().collect() }
}

/// The polygon that a triangle is in now.
fn owner(owners: &mut [u32], mut triangle: u32) -> u32 {
    while owners[triangle as usize] != triangle {
        // Halves the way for whoever comes next.
        owners[triangle as usize] = owners[owners[triangle as usize] as usize];
        triangle = owners[triangle as usize];
    }
    triangle
}

/// Pairs of triangles that have an edge alone and in opposite directions; the longest edge first.
fn shared_edges(places: &[DVec3], triangles: &[Option<Polygon>]) -> Vec<[u32; 2]> {
    let mut sides = Vec::with_capacity(3 * triangles.len());
    for (t, triangle) in triangles.iter().enumerate() {
        let ring = triangle.as_ref().map_or(&[][..], |p| &p.ring);
        for (k, &a) in ring.iter().enumerate() {
            let b = ring[(k + 1) % ring.len()];
            sides.push(([a.min(b), a.max(b)], a < b, t as u32));
        }
    }
    sides.sort_unstable();
    let pair = |same: &[([u32; 2], bool, u32)]| match *same {
        [(ends, false, a), (_, true, b)] => {
            let [from, to] = ends.map(|e| places[e as usize]);
            Some((from.distance_squared(to), [a.min(b), a.max(b)]))
        }
        _ => None,
    };
    let mut edges: Vec<_> = sides.chunk_by(|a, b| a.0 == b.0).filter_map(pair).collect();
    edges.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    edges.into_iter().map(|(_, pair)| pair).collect()
}

/// Two polygons as one, if they are coplanar and it is convex.
fn merge(places: &[DVec3], one: &Polygon, other: &Polygon, coplanar: f64) -> Option<Polygon> {
    // The plane of the larger: its corners are near it already.
    let (large, small) = if one.area >= other.area { (one, other) } else { (other, one) };
    let near = |&c: &u32| large.plane.distance(places[c as usize]).abs() <= coplanar;
    if large.plane.n.dot(small.plane.n) <= 0.0 || !small.corners.iter().all(near) {
        return None;
    }
    let ring = joined(&large.ring, &small.ring)?;
    let normal = large.plane.n;
    let at = |k: usize| places[ring[k % ring.len()] as usize];
    let turns = |k: usize| {
        let (before, after) = (at(k + 1) - at(k), at(k + 2) - at(k + 1));
        before.cross(after).dot(normal) >= -REFLEX * before.length() * after.length()
    };
    if !(0..ring.len()).all(turns) {
        return None;
    }
    let points: Vec<DVec3> = ring.iter().map(|&c| places[c as usize] - large.plane.n * large.plane.d).collect();
    let area = newell(&points).dot(normal) * 0.5;
    let corners = [&large.corners[..], &small.corners].concat();
    Some(Polygon { ring, corners, plane: large.plane, area })
}

/// The ring around two polygons that share an edge, or several in a row; `None` where less than a triangle is left.
fn joined(one: &[u32], other: &[u32]) -> Option<Vec<u32>> {
    let side = |ring: &[u32], k: usize| [ring[k], ring[(k + 1) % ring.len()]];
    let found = (0..one.len()).find_map(|i| {
        let [a, b] = side(one, i);
        Some((i, (0..other.len()).find(|&k| side(other, k) == [b, a])?))
    });
    let (i, k) = found?;
    // From the shared edge's end around to its start, then on along the other.
    let mut ring: Vec<u32> = (1..=one.len()).map(|s| one[(i + s) % one.len()]).collect();
    ring.extend((2..other.len()).map(|s| other[(k + s) % other.len()]));
    // Further edges that both have stick out as spikes.
    while ring.len() > 2 {
        let n = ring.len();
        let Some(tip) = (0..n).find(|&t| ring[(t + n - 1) % n] == ring[(t + 1) % n]) else { break };
        let after = (tip + 1) % n;
        ring.remove(tip.max(after));
        ring.remove(tip.min(after));
    }
    (ring.len() > 2).then_some(ring)
}
