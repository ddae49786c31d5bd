//! Distances, hits and edges, the plain way.

use crate::meshes::Triangle;
use glam::DVec3;
use std::collections::BTreeMap;

/// How far along a ray a triangle is met, from either side, by Cramer's rule.
pub fn meets(origin: DVec3, direction: DVec3, [a, b, c]: Triangle) -> Option<f64> {
    let det = |x: DVec3, y: DVec3, z: DVec3| x.dot(y.cross(z));
    let (e, f, g) = (b - a, c - a, origin - a);
    let d = det(e, f, -direction);
    let (u, v, t) = (det(g, f, -direction) / d, det(e, g, -direction) / d, det(e, f, g) / d);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

/// The point of a segment that is nearest to another point.
pub fn nearest_of_segment([a, b]: [DVec3; 2], p: DVec3) -> DVec3 {
    let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    a.lerp(b, if t.is_nan() { 0.0 } else { t })
}

/// The point of a triangle that is nearest to another point.
pub fn nearest([a, b, c]: Triangle, p: DVec3) -> DVec3 {
    let n = (b - a).cross(c - a);
    let on_plane = p - n * ((p - a).dot(n) / n.length_squared());
    let edges = [[a, b], [b, c], [c, a]];
    if edges.iter().all(|[u, v]| (*v - *u).cross(on_plane - *u).dot(n) >= 0.0) {
        return on_plane;
    }
    let of_edges = edges.map(|edge| nearest_of_segment(edge, p));
    of_edges.into_iter().min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p))).expect("three")
}

/// Edges that triangles don't share as often one way as the other.
pub fn open_edges<K: Ord + Copy>(triangles: impl IntoIterator<Item = [K; 3]>) -> usize {
    let mut edges: BTreeMap<[K; 2], i32> = BTreeMap::new();
    for [a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| from != to) {
            *edges.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    edges.values().filter(|&&sum| sum != 0).count()
}
