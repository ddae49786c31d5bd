//! Shortest lines through a sequence of convex polygons.
//!
//! The length of such a line is a convex function of its corners, one a polygon. So moving one corner after the other to its best
//! place leads to the shortest line (coordinate descent; in two dimensions it is the funnel of D. T. Lee, F. P. Preparata,
//! *Euclidean shortest paths in the presence of rectilinear barriers*, 1984). If the line turns about an edge that two polygons
//! share, the descent may stop early; the result still passes through all of them.

use enfilade::math::geom::Plane;
use glam::DVec3;

/// The line is tight if no point moves by more than this share of its length (metres, if that is shorter than a metre).
const STILL: f64 = 1e-9;

/// Maximum rounds.
const ROUNDS: usize = 2000;

/// Moves `points[1..]`, each within its polygon of `through`, until the line is shortest. `points[0]` stays fixed; there is one
/// point more than polygons. The last one is free within its polygon.
pub(super) fn tighten(points: &mut [DVec3], through: &[(&[DVec3], Plane)]) {
    for _ in 0..ROUNDS {
        let mut moved: f64 = 0.0;
        for i in 1..points.len() {
            let (polygon, plane) = &through[i - 1];
            let to = match points.get(i + 1) {
                Some(&next) => best(polygon, plane, points[i - 1], next),
                None => closest(polygon, plane, points[i - 1]),
            };
            moved = moved.max(to.distance(points[i]));
            points[i] = to;
        }
        if moved < STILL * points[0].distance(points[points.len() - 1]).max(STILL) {
            break;
        }
    }
}

/// As [`tighten`], for polygons partly covered by walls: each corner moves within its polygon as long as that shortens the line
/// and both parts of it stay unobstructed (compass search: R. Hooke, T. A. Jeeves, *Direct search*, 1961).
pub(super) fn polish(points: &mut [DVec3], through: &[(&[DVec3], Plane)], is_open: &impl Fn(DVec3, DVec3) -> bool) {
    let mut step = 0.25 * points.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
    let least = 1e-4 * step;
    while step > least {
        let mut moved = false;
        for i in 1..points.len() {
            let (polygon, plane) = &through[i - 1];
            let (u, v) = plane.n.any_orthonormal_pair();
            let (before, after) = (points[i - 1], points.get(i + 1).copied());
            let way = |x: DVec3| x.distance(before) + after.map_or(0.0, |a| x.distance(a));
            for d in [u, -u, v, -v, u + v, u - v, v - u, -u - v] {
                let to = closest(polygon, plane, points[i] + d * step);
                let shorter = way(to) < way(points[i]) * (1.0 - 1e-12);
                if shorter && is_open(before, to) && after.is_none_or(|a| is_open(to, a)) {
                    points[i] = to;
                    moved = true;
                }
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
}

/// The half-spaces of a polygon's edges within its plane, normals pointing out.
pub(super) fn rim(polygon: &[DVec3], plane: &Plane) -> Vec<Plane> {
    let middle = enfilade::math::geom::middle(polygon);
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    edges
        .filter_map(|(&a, &b)| {
            let out = (b - a).cross(plane.n).try_normalize()?;
            let edge = Plane::through(a, out);
            // For either orientation of the polygon.
            Some(if edge.distance(middle) <= 0.0 { edge } else { edge.flipped() })
        })
        .collect()
}

/// The point of a convex polygon that is closest to `p`.
pub(super) fn closest(polygon: &[DVec3], plane: &Plane, p: DVec3) -> DVec3 {
    let foot = p - plane.n * plane.distance(p);
    if rim(polygon, plane).iter().all(|e| e.distance(foot) <= 0.0) {
        return foot;
    }
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let on_edge = |(&a, &b): (&DVec3, &DVec3)| {
        let along = b - a;
        a + along * ((p - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    let nearest = edges.map(on_edge).min_by(|x, y| x.distance_squared(p).total_cmp(&y.distance_squared(p)));
    nearest.unwrap_or(foot)
}

/// The point of a convex polygon with the shortest path from `a` over it to `b`.
fn best(polygon: &[DVec3], plane: &Plane, a: DVec3, b: DVec3) -> DVec3 {
    let (da, db) = (plane.distance(a), plane.distance(b));
    // If both are on one side, the path is as long as that to the mirror image.
    let b = if da * db > 0.0 { b - plane.n * (2.0 * db) } else { b };
    let (da, db) = (da.abs(), db.abs());
    let edges = rim(polygon, plane);
    let crossing = if da + db > 0.0 { a.lerp(b, da / (da + db)) } else { a };
    if edges.iter().all(|e| e.distance(crossing) <= 0.0) {
        return crossing;
    }
    // Otherwise the point is on an edge: a straight line after unfolding about it.
    let pairs = polygon.iter().zip(polygon.iter().cycle().skip(1));
    let on_edge = |(&p, &q): (&DVec3, &DVec3)| {
        let (length, along) = (p.distance(q), (q - p).normalize_or_zero());
        let foot = |x: DVec3| {
            let t = (x - p).dot(along);
            (t, x.distance(p + along * t))
        };
        let ((ta, ha), (tb, hb)) = (foot(a), foot(b));
        let t = if ha + hb > 0.0 { ta + (tb - ta) * (ha / (ha + hb)) } else { ta };
        p + along * t.clamp(0.0, length)
    };
    let way = |x: &DVec3| x.distance(a) + x.distance(b);
    // If both lie in the polygon's plane, the line may run within it.
    let inside = [closest(polygon, plane, a), closest(polygon, plane, b)];
    pairs.map(on_edge).chain(inside).min_by(|x, y| way(x).total_cmp(&way(y))).unwrap_or(crossing)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    /// A square hole of 2 m in the plane at `x`, its middle at `(y, z)`.
    fn hole(x: f64, y: f64, z: f64) -> (Vec<DVec3>, Plane) {
        let corners = [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(a, b)| v(x, y + a, z + b));
        (corners.to_vec(), Plane { n: DVec3::X, d: x })
    }

    #[test]
    fn a_line_bends_about_the_edges_in_its_way_only() {
        let holes = [hole(1.0, 0.0, 0.0), hole(2.0, 4.0, 0.0), hole(3.0, 4.0, 0.5), hole(6.0, 0.0, 0.0)];
        let through: Vec<_> = holes.iter().map(|(w, p)| (w.as_slice(), *p)).collect();
        let mut points = vec![v(0.0, 0.0, 0.0)];
        points.extend(holes.iter().map(|h| enfilade::math::geom::middle(&h.0)));
        tighten(&mut points, &through);
        // In the plane z = 0: from (0, 0) over (1, 1) to (2, 3), on to (3, 3) and back down to (6, 1).
        let length: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
        let expected = 2f64.sqrt() + 5f64.sqrt() + 1.0 + 13f64.sqrt();
        assert!((length - expected).abs() < 1e-6, "{length} for {expected}: {points:?}");
        assert!(points[4].distance(v(6.0, 1.0, 0.0)) < 1e-4, "the end is free: {points:?}");
    }

    #[test]
    fn the_closest_point_of_a_polygon_is_over_it_on_an_edge_or_a_corner() {
        let (polygon, plane) = hole(1.0, 0.0, 0.0);
        for (p, expected) in [
            (v(5.0, 0.5, 0.25), v(1.0, 0.5, 0.25)),
            (v(0.0, 3.0, 0.5), v(1.0, 1.0, 0.5)),
            (v(0.0, -9.0, 2.0), v(1.0, -1.0, 1.0)),
        ] {
            assert!(closest(&polygon, &plane, p).distance(expected) < 1e-12);
            let turned: Vec<DVec3> = polygon.iter().rev().copied().collect();
            assert!(closest(&turned, &plane, p).distance(expected) < 1e-12, "either way round");
        }
    }
}
