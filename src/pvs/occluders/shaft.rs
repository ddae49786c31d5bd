//! A shaft: all segments between two convex sets, bounded by planes.
//!
//! Based on: Haines, Wallace, *Shaft culling for efficient ray-traced radiosity*, 1991. Deviation: the planes are all those through an edge
//! of one set and a corner of the other with both sets on one side, so the shaft is the convex hull without caps.

use super::mesh::keep_inside;
use crate::math::geom::{Aabb, Plane, clip_to};
use glam::DVec3;

/// A convex set at one end of a shaft.
#[derive(Clone, Debug)]
pub(super) struct End {
    /// Its corners; those of a polygon in order.
    pub points: Vec<DVec3>,
    /// The polygon's plane, or `None` for a box.
    pub plane: Option<Plane>,
    /// Box around it.
    pub bounds: Aabb,
}

/// Edges of a box, as pairs of corners; bits of a corner's number give its position.
const BOX_EDGES: [(usize, usize); 12] =
    [(0, 1), (2, 3), (4, 5), (6, 7), (0, 2), (1, 3), (4, 6), (5, 7), (0, 4), (1, 5), (2, 6), (3, 7)];

impl End {
    /// A convex polygon in `plane`.
    pub fn polygon(points: &[DVec3], plane: Plane) -> Self {
        Self { points: points.to_vec(), plane: Some(plane), bounds: Aabb::of(points.iter().copied()) }
    }

    /// A box.
    pub fn cuboid(b: Aabb) -> Self {
        let corner = |i: usize| DVec3::select(glam::BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0), b.max, b.min);
        Self { points: (0..8).map(corner).collect(), plane: None, bounds: b }
    }

    /// Its extent along a direction, metres; for the zero vector, its box's diagonal.
    pub fn size(&self, along: DVec3) -> f64 {
        if along == DVec3::ZERO {
            return self.bounds.diagonal();
        }
        let (low, high) = reach(&self.points, &Plane { n: along, d: 0.0 });
        high - low
    }

    fn edges(&self) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
        let count = if self.plane.is_some() { self.points.len() } else { BOX_EDGES.len() };
        (0..count).map(|i| {
            let (a, b) = if self.plane.is_some() { (i, (i + 1) % self.points.len()) } else { BOX_EDGES[i] };
            (self.points[a], self.points[b])
        })
    }

    /// 1 if all of it is more than `margin` metres in front of a plane, -1 if behind, otherwise 0.
    pub fn side(&self, plane: &Plane, margin: f64) -> i32 {
        let (low, high) = reach(&self.points, plane);
        i32::from(low > margin) - i32::from(high < -margin)
    }
}

/// The least and the greatest distance of points from a plane, metres.
pub(super) fn reach(points: &[DVec3], plane: &Plane) -> (f64, f64) {
    points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &p| {
        let d = plane.distance(p);
        (low.min(d), high.max(d))
    })
}

/// The shaft of two sets.
pub(super) struct Shaft {
    planes: Vec<Plane>,
}

impl Shaft {
    /// The shaft of all segments from `a` to `b`, grown by `slack` metres.
    pub fn new(a: &End, b: &End, slack: f64, planes: Vec<Plane>) -> Self {
        let mut shaft = Self { planes };
        shaft.planes.clear();
        let eps = 0.01 * slack;
        for (from, to) in [(a, b), (b, a)] {
            for (p, q) in from.edges() {
                for &r in &to.points {
                    let Some(n) = (q - p).cross(r - p).try_normalize() else { continue };
                    let plane = Plane::through(p, n);
                    let (s, t) = (reach(&a.points, &plane), reach(&b.points, &plane));
                    let facing = match (s.0.min(t.0) >= -eps, s.1.max(t.1) <= eps) {
                        (true, false) => plane.flipped(),
                        (false, true) => plane,
                        _ => continue,
                    };
                    shaft.planes.push(Plane { d: facing.d + slack, ..facing });
                }
            }
        }
        let bounds = a.bounds.union(b.bounds).inflated(slack);
        for axis in DVec3::AXES {
            shaft.planes.push(Plane { n: axis, d: bounds.max.dot(axis) });
            shaft.planes.push(Plane { n: -axis, d: -bounds.min.dot(axis) });
        }
        shaft
    }

    /// The stretch of the segment from `a` to `b` that may lie in the shaft.
    pub fn clip_segment(&self, a: DVec3, b: DVec3) -> Option<[f64; 2]> {
        let mut span = [0.0, 1.0];
        for plane in &self.planes {
            keep_inside(plane.distance(a), plane.distance(b), &mut span);
            if span[0] > span[1] {
                return None;
            }
        }
        Some(span)
    }

    /// The part of a triangle that may lie in the shaft, in one of two buffers.
    pub fn clip<'b>(&self, corners: &[DVec3; 3], [part, rest]: &'b mut [Vec<DVec3>; 2]) -> &'b [DVec3] {
        part.clear();
        part.extend(corners);
        for plane in &self.planes {
            if part.iter().any(|&p| plane.distance(p) > 0.0) {
                clip_to(part, plane, 0.0, rest);
                std::mem::swap(part, rest);
                if part.is_empty() {
                    break;
                }
            }
        }
        part
    }

    /// Returns its memory for reuse.
    pub fn into_planes(self) -> Vec<Plane> {
        self.planes
    }
}
