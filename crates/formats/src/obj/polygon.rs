//! Triangulates polygons: convex ones as a fan, others by ear clipping.
//!
//! Based on: Meisters, *Polygons have ears*, 1975. It works in the plane across the polygon's mean normal (Newell), with exact
//! orientation tests. Any polygon gives `n - 2` triangles.

use enfilade::math::geom::newell;
use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

/// Concave polygons with more corners become a fan: ear clipping takes quadratic time.
const MOST_CORNERS: usize = 2048;

/// How a polygon was triangulated.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Shape {
    /// As a fan, exactly.
    Convex,
    /// By ear clipping.
    Concave,
    /// As a fan, inexactly: it crosses itself, has no area, or is too large.
    Fanned,
}

/// Appends the triangles of the polygon `corners` (three or more valid indices into `positions`) to `out`, by corner numbers.
pub(crate) fn triangulate(positions: &[DVec3], corners: &[u32], out: &mut Vec<[usize; 3]>) -> Shape {
    let n = corners.len();
    if n == 3 {
        out.push([0, 1, 2]);
        return Shape::Convex;
    }
    let points = project(positions, corners);
    let start = out.len();
    let shape = match &points {
        Some(points) if is_convex(points) => Shape::Convex,
        Some(points) if n <= MOST_CORNERS && clip_ears(points, out) => Shape::Concave,
        _ => Shape::Fanned,
    };
    if shape != Shape::Concave {
        out.truncate(start);
        out.extend((1..n - 1).map(|i| [0, i, i + 1]));
    }
    shape
}

/// The corners in the plane, counter-clockwise; `None` without area.
fn project(positions: &[DVec3], corners: &[u32]) -> Option<Vec<DVec2>> {
    let start = positions[corners[0] as usize];
    let points: Vec<DVec3> = corners.iter().map(|&i| positions[i as usize] - start).collect();
    let n = newell(&points);
    let largest = n.abs().max_element();
    if largest <= 0.0 || !largest.is_finite() {
        return None;
    }
    // Dropping the dominant axis keeps coordinates unchanged, so the tests below are exact.
    let flat = |p: &DVec3| {
        if n.x.abs() == largest {
            if n.x > 0.0 { DVec2::new(p.y, p.z) } else { DVec2::new(p.z, p.y) }
        } else if n.y.abs() == largest {
            if n.y > 0.0 { DVec2::new(p.z, p.x) } else { DVec2::new(p.x, p.z) }
        } else if n.z > 0.0 {
            DVec2::new(p.x, p.y)
        } else {
            DVec2::new(p.y, p.x)
        }
    };
    Some(points.iter().map(flat).collect())
}

/// Positive if the path from `a` by `b` to `c` turns left.
fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p.x, y: p.y });
    orient2d(a, b, c)
}

/// Whether no corner turns right and the polygon winds once: then a fan from its first corner covers it once.
fn is_convex(points: &[DVec2]) -> bool {
    let n = points.len();
    (0..n).all(|i| turn(points[i], points[(i + 1) % n], points[(i + 2) % n]) >= 0.0)
        && (1..n - 1).all(|i| turn(points[0], points[i], points[i + 1]) >= 0.0)
}

/// Clips ears; false if no ear is left.
fn clip_ears(points: &[DVec2], out: &mut Vec<[usize; 3]>) -> bool {
    let mut left: Vec<usize> = (0..points.len()).collect();
    // Continuing after the last ear, not at the start, makes rounder triangles.
    let mut at = 0;
    while left.len() > 3 {
        let n = left.len();
        let ear = (0..n).map(|k| (at + k) % n).find(|&i| {
            let [a, b, c] = [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            let [pa, pb, pc] = [a, b, c].map(|i| points[i]);
            let bend = turn(pa, pb, pc);
            // A straight corner becomes a triangle without area, which the builder drops.
            let straight = bend == 0.0 && (pb - pa).dot(pc - pb) >= 0.0;
            let inside = |&&v: &&usize| {
                let p = points[v];
                v != a && v != b && v != c && p != pa && p != pb && p != pc && {
                    turn(pa, pb, p) >= 0.0 && turn(pb, pc, p) >= 0.0 && turn(pc, pa, p) >= 0.0
                }
            };
            straight || (bend > 0.0 && !left.iter().any(|v| inside(&v)))
        });
        let Some(i) = ear else { return false };
        out.push([left[(i + n - 1) % n], left[i], left[(i + 1) % n]]);
        left.remove(i);
        at = i % left.len();
    }
    let last = [left[0], left[1], left[2]];
    out.push(last);
    turn(points[last[0]], points[last[1]], points[last[2]]) >= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade::math::geom::area;

    fn cut(points: &[(f64, f64)]) -> (Shape, usize, f64) {
        // In a tilted plane, to test the projection.
        let positions: Vec<DVec3> = points.iter().map(|&(x, y)| DVec3::new(x, y, 0.5 * x - 2.0 * y)).collect();
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        let mut out = Vec::new();
        let shape = triangulate(&positions, &corners, &mut out);
        let facing = newell(&positions);
        let signed = |t: [DVec3; 3]| area(&t) * newell(&t).dot(facing).signum();
        let sum: f64 = out.iter().map(|t| signed(t.map(|i| positions[i]))).sum();
        (shape, out.len(), sum / area(&positions))
    }

    #[test]
    fn a_polygon_becomes_n_minus_two_triangles_that_cover_it_once() {
        let square = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)];
        let dart = [(0., 0.), (2., 1.), (0., 2.), (1., 1.)];
        let comb = [
            (0., 0.),
            (5., 0.),
            (5., 3.),
            (4., 3.),
            (4., 1.),
            (3., 1.),
            (3., 3.),
            (2., 3.),
            (2., 1.),
            (1., 1.),
            (1., 3.),
            (0., 3.),
        ];
        let bump = [(0., 0.), (1., 0.), (2., 0.), (2., 2.), (1., 1.), (0., 2.)];
        for (points, shape) in [
            (&square[..], Shape::Convex),
            (&dart[..], Shape::Concave),
            (&comb[..], Shape::Concave),
            (&bump[..], Shape::Concave),
        ] {
            for turned in 0..points.len() {
                let mut points = points.to_vec();
                points.rotate_left(turned);
                for _ in 0..2 {
                    let (found, count, covered) = cut(&points);
                    assert_eq!((found, count), (shape, points.len() - 2));
                    assert!((covered - 1.0).abs() < 1e-12, "{points:?}");
                    points.reverse();
                }
            }
        }
    }

    #[test]
    fn a_polygon_that_makes_no_sense_still_becomes_n_minus_two_triangles() {
        let bow = [(0., 0.), (2., 2.), (2., 0.), (0., 3.)];
        let line = [(0., 0.), (1., 1.), (2., 2.), (3., 3.), (1., 1.)];
        assert_eq!(cut(&bow).1, 2);
        assert_eq!((cut(&line).0, cut(&line).1), (Shape::Fanned, 3));
    }
}
