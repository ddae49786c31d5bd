//! Joins convex polygons that tile larger ones: a wall of a thousand triangles becomes a few polygons.
//!
//! Greedy: a polygon joins one of the last few before it if the convex hull of both is hardly larger than both together. Passes alternate
//! between the two axes, until neither changes anything.
//!
//! Soundness: the part of a hull outside its polygons is smaller than a given area, so no point of it is farther from them than about the
//! root of that area.

use super::polygon::{area, convex_hull};
use glam::DVec2;
use std::cmp::Ordering;

/// Number of preceding polygons that a polygon is compared with. More: slower. Fewer: tiles far apart in the order stay separate.
const LOOKED_AT: usize = 4;
/// Most passes.
const PASSES: usize = 6;

/// A convex polygon, counter-clockwise.
struct Part {
    hull: Vec<DVec2>,
    area: f64,
    ends: [DVec2; 2],
    /// Area of the hull outside its polygons.
    missing: f64,
}

impl Part {
    fn new(hull: Vec<DVec2>, missing: f64) -> Self {
        let ends = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        let ends = hull.iter().fold(ends, |[low, high], &p| [low.min(p), high.max(p)]);
        Self { area: area(&hull), hull, ends, missing }
    }

    /// The hull of two parts, if its extra area is at most `most`.
    fn with(&self, other: &Self, most: f64) -> Option<Self> {
        let near = most.sqrt();
        let ([low, high], [least, greatest]) = (self.ends, other.ends);
        if !(low.cmple(greatest + near).all() && least.cmple(high + near).all()) {
            return None;
        }
        let hull = convex_hull([self.hull.as_slice(), &other.hull].concat());
        let apart = area(&hull) - self.area - other.area;
        // Their intersection counts once.
        let missing = if apart > most { apart } else { apart + area(&shared(&self.hull, &other.hull)) };
        let missing = self.missing + other.missing + missing.max(0.0);
        (missing <= most).then(|| Self::new(hull, missing))
    }
}

/// Joins convex polygons of any winding. Each result has at most the area `most` outside its polygons.
pub fn joined(polygons: impl Iterator<Item = Vec<DVec2>>, most: f64) -> Vec<Vec<DVec2>> {
    let mut parts: Vec<Part> = polygons.map(|corners| Part::new(convex_hull(corners), 0.0)).collect();
    let mut in_vain = 0;
    for pass in 0..PASSES {
        // By the centres of their boxes, which are equal for both halves of a rectangle.
        let key = |part: &Part| {
            let middle = part.ends[0] + part.ends[1];
            if pass % 2 == 0 { [middle.x, middle.y] } else { [middle.y, middle.x] }
        };
        parts.sort_by(|a, b| key(a).iter().zip(&key(b)).fold(Ordering::Equal, |told, (a, b)| told.then(a.total_cmp(b))));
        let before = parts.len();
        parts = once(parts, most);
        in_vain = if parts.len() == before { in_vain + 1 } else { 0 };
        if in_vain == 2 {
            break;
        }
    }
    parts.into_iter().map(|part| part.hull).filter(|hull| hull.len() > 2).collect()
}

/// One pass over all parts in order.
fn once(parts: Vec<Part>, most: f64) -> Vec<Part> {
    let mut out: Vec<Part> = Vec::with_capacity(parts.len());
    for part in parts {
        let looked_at = out.len().saturating_sub(LOOKED_AT)..out.len();
        match looked_at.rev().find_map(|i| Some((i, out[i].with(&part, most)?))) {
            Some((i, both)) => out[i] = both,
            None => out.push(part),
        }
    }
    out
}

/// The intersection of two convex polygons, both counter-clockwise.
pub fn shared(a: &[DVec2], b: &[DVec2]) -> Vec<DVec2> {
    let mut left = a.to_vec();
    for (i, &from) in b.iter().enumerate() {
        let edge = b[(i + 1) % b.len()] - from;
        let side = |p: DVec2| edge.perp_dot(p - from);
        let mut kept = Vec::with_capacity(left.len() + 1);
        for (k, &p) in left.iter().enumerate() {
            let q = left[(k + 1) % left.len()];
            let (dp, dq) = (side(p), side(q));
            if dp >= 0.0 {
                kept.push(p);
            }
            if (dp > 0.0 && dq < 0.0) || (dp < 0.0 && dq > 0.0) {
                kept.push(p + (q - p) * (dp / (dp - dq)));
            }
        }
        left = kept;
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [(f64, f64); 3]) -> Vec<DVec2> {
        corners.map(DVec2::from).to_vec()
    }

    #[test]
    fn a_fan_and_a_grid_are_one_polygon_whatever_their_order() {
        // A fan of a thousand slivers, its odd ones first.
        let at = |i: usize| (3.0, i as f64 * 1e-3);
        let fan = |i: usize| triangle([(0.0, 0.0), at(i), at(i + 1)]);
        let order = (0..500).map(|i| 2 * i + 1).chain((0..500).map(|i| 2 * i));
        let found = joined(order.map(fan), 1e-12);
        assert_eq!(found.len(), 1, "{}", found.len());
        assert!((area(&found[0]) - 1.5).abs() < 1e-9);
        let square = |x: f64, y: f64| {
            let [a, b, c, d] = [(x, y), (x + 1.0, y), (x + 1.0, y + 1.0), (x, y + 1.0)];
            [triangle([a, b, c]), triangle([a, d, c])]
        };
        let grid = (0..400).flat_map(|i| square(f64::from(i % 20), f64::from(i / 20)));
        assert_eq!(joined(grid, 1e-9).len(), 1);
    }

    #[test]
    fn what_is_between_polygons_stays_open() {
        let strip =
            |x: f64| vec![DVec2::new(x, 0.0), DVec2::new(x + 1.0, 0.0), DVec2::new(x + 1.0, 4.0), DVec2::new(x, 4.0)];
        // A crack of 1e-3; strips that overlap as much elsewhere.
        assert_eq!(joined([strip(0.0), strip(1.001)].into_iter(), 1e-9).len(), 2);
        assert_eq!(joined([strip(0.0), strip(0.5), strip(1.501)].into_iter(), 1e-9).len(), 2);
        // An L.
        let foot = vec![DVec2::new(1.0, 0.0), DVec2::new(4.0, 0.0), DVec2::new(4.0, 1.0), DVec2::new(1.0, 1.0)];
        assert_eq!(joined([strip(0.0), foot].into_iter(), 1e-9).len(), 2);
        assert_eq!(joined([strip(0.0), strip(0.0), strip(0.25)].into_iter(), 1e-9).len(), 1);
    }
}
