//! The bounding box of a convex polyhedron given by half-spaces, which may be unbounded, and its faces within a box.
//!
//! The box is based on the theorem of Minkowski and Weyl (a polyhedron is the hull of its vertices plus the cone of its rays): a vertex is
//! the intersection of three planes inside all others; a ray is a direction along two planes that leaves no half-space. Cubic time in the
//! number of planes, which is small for pieces ([`MAX_PLANES`]).

#[cfg(feature = "bake")]
use super::geom::middle;
use super::geom::{Aabb, Plane, clip};
use glam::DVec3;

/// Most planes of a piece that a user may give.
#[cfg(feature = "bake")]
pub const MAX_PLANES: usize = 128;

/// Largest relative error of a corner after clipping.
const ROUNDING: f64 = 1e-12;

/// Directions whose angle has a smaller sine than this are parallel.
#[cfg(feature = "bake")]
const LEAST_SINE: f64 = 1e-9;

/// The box of the intersection of all half-spaces, infinite where it is unbounded; `None` if it has no volume. Corners within `eps` metres
/// of a plane count as inside.
#[cfg(feature = "bake")]
pub fn bounds(planes: &[Plane], eps: f64) -> Option<Aabb> {
    // Directions unbounded on both sides get an extra plane, so that there are corners.
    let free = free_directions(planes);
    let cuts = free.iter().flat_map(|&n| [Plane { n, d: 0.0 }, Plane { n: -n, d: 0.0 }]);
    let all: Vec<Plane> = planes.iter().copied().chain(cuts).collect();
    let mut rays = free.clone();
    rays.extend(free.iter().map(|&v| -v));

    let (mut corners, mut sum, mut count) = (Aabb::EMPTY, DVec3::ZERO, 0.0);
    for (i, a) in all.iter().enumerate() {
        for (j, b) in all.iter().enumerate().skip(i + 1) {
            let edge = a.n.cross(b.n);
            if edge.length() < LEAST_SINE {
                continue;
            }
            let direction = edge.normalize();
            rays.extend([direction, -direction].into_iter().filter(|v| all.iter().all(|p| p.n.dot(*v) <= LEAST_SINE)));
            for c in &all[j + 1..] {
                // Cramer's rule.
                let determinant = edge.dot(c.n);
                if determinant.abs() < LEAST_SINE * LEAST_SINE.sqrt() {
                    continue;
                }
                let corner = (b.n.cross(c.n) * a.d + c.n.cross(a.n) * b.d + edge * c.d) / determinant;
                if corner.is_finite() && all.iter().all(|p| p.distance(corner) <= eps) {
                    corners = corners.with(corner);
                    sum += corner;
                    count += 1.0;
                }
            }
        }
    }
    if count == 0.0 {
        return None;
    }
    if rays.is_empty() {
        return bounded(planes, &corners, eps);
    }
    let inside = sum / count + rays.iter().sum::<DVec3>();
    if planes.iter().any(|p| p.distance(inside) >= 0.0) {
        return None;
    }
    for ray in rays {
        for axis in 0..3 {
            if ray[axis] > LEAST_SINE {
                corners.max[axis] = f64::INFINITY;
            } else if ray[axis] < -LEAST_SINE {
                corners.min[axis] = f64::NEG_INFINITY;
            }
        }
    }
    Some(corners)
}

/// As [`bounds`] for planes with all corners within `most`, to within `eps`. In slivers, points within `eps` of every plane may be far from
/// any true corner, so the faces decide.
#[cfg(feature = "bake")]
fn bounded(planes: &[Plane], most: &Aabb, eps: f64) -> Option<Aabb> {
    let around = most.inflated(eps);
    let corners: Vec<DVec3> = faces(planes, &around).into_iter().flatten().collect();
    let inside = middle(&corners);
    if corners.is_empty() || planes.iter().any(|p| p.distance(inside) >= 0.0) {
        return None;
    }
    let tight = Aabb::of(corners).inflated(ROUNDING * around.diagonal());
    Some(Aabb { min: tight.min.max(most.min), max: tight.max.min(most.max) })
}

/// The faces of the polyhedron within a box: a polygon for each plane, then for each side of the box; empty without a face. An empty
/// intersection has no faces.
pub fn faces(planes: &[Plane], within: &Aabb) -> Vec<Vec<DVec3>> {
    let all: Vec<Plane> = planes.iter().copied().chain(sides(within)).collect();
    let size = within.diagonal();
    (0..all.len()).map(|i| face(&all, i, within.centre(), size, ROUNDING * size)).collect()
}

/// The half-spaces of a box.
pub fn sides(b: &Aabb) -> impl Iterator<Item = Plane> {
    let (min, max) = (b.min, b.max);
    DVec3::AXES.into_iter().flat_map(move |n| [Plane { n, d: n.dot(max) }, Plane { n: -n, d: -n.dot(min) }])
}

/// The face of the polyhedron in plane number `i`, counter-clockwise seen from outside: a square of half edge `reach` around the projection
/// of `near`, clipped by the other planes; empty without a face. Corners up to `eps` metres outside a plane are kept.
pub fn face(planes: &[Plane], i: usize, near: DVec3, reach: f64, eps: f64) -> Vec<DVec3> {
    let plane = &planes[i];
    let others = planes.iter().enumerate().filter(|&(j, _)| j != i);
    let square = square(near - plane.n * plane.distance(near), plane.n, reach);
    others.fold(square, |face, (_, other)| if face.is_empty() { face } else { clip(&face, other, eps) })
}

/// A square of the given half edge, counter-clockwise seen from the tip of `n`.
pub fn square(middle: DVec3, n: DVec3, half: f64) -> Vec<DVec3> {
    let u = n.any_orthonormal_vector() * half;
    let v = n.cross(u);
    vec![middle - u - v, middle + u - v, middle + u + v, middle - u + v]
}

/// A basis of the directions along every plane.
#[cfg(feature = "bake")]
fn free_directions(planes: &[Plane]) -> Vec<DVec3> {
    let Some(first) = planes.first() else {
        return DVec3::AXES.to_vec();
    };
    let widest = |directions: &mut dyn Iterator<Item = DVec3>| directions.max_by(|a, b| a.length().total_cmp(&b.length()));
    let line = widest(&mut planes.iter().map(|p| first.n.cross(p.n))).unwrap_or_default();
    if line.length() < LEAST_SINE {
        let (a, b) = first.n.any_orthonormal_pair();
        return vec![a, b];
    }
    let line = line.normalize();
    if planes.iter().all(|p| p.n.dot(line).abs() < LEAST_SINE) { vec![line] } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(x: f64, y: f64, z: f64, d: f64) -> Plane {
        let n = DVec3::new(x, y, z);
        Plane { n: n.normalize(), d: d / n.length() }
    }

    fn close(a: DVec3, b: [f64; 3]) -> bool {
        a.to_array().iter().zip(b).all(|(&a, b)| a == b || (a - b).abs() < 1e-9)
    }

    const INF: f64 = f64::INFINITY;

    #[test]
    fn bounded_pieces_have_the_box_of_their_corners() {
        // The simplex with legs of 2 m.
        let simplex = [plane(-1., 0., 0., 0.), plane(0., -1., 0., 0.), plane(0., 0., -1., 0.), plane(1., 1., 1., 2.)];
        let b = bounds(&simplex, 1e-9).unwrap();
        assert!(close(b.min, [0.; 3]) && close(b.max, [2.; 3]));
    }

    #[test]
    fn slivers_have_a_volume_and_a_box_of_their_own() {
        // A wedge of 1e-4 degrees, 2 m long, its edge along y: within 1e-4 m of its planes it goes on for 60 m.
        let (s, c) = (1e-4f64).to_radians().sin_cos();
        let wedge = |tip: f64| {
            let flat = [plane(0., 0., -1., 0.), plane(s, 0., c, tip), plane(-1., 0., 0., 0.)];
            [&flat[..], &[plane(0., 1., 0., 1.), plane(0., -1., 0., 0.)]].concat()
        };
        let b = bounds(&wedge(2.0 * s), 1e-4).unwrap();
        assert!(close(b.min, [0.; 3]) && close(b.max, [2., 1., 2.0 * s / c]), "{b:?}");
        // Within 1e-4 m of all planes beyond its edge, but empty.
        assert_eq!(bounds(&wedge(-1e-7), 1e-4), None);
    }

    #[test]
    fn unbounded_pieces_are_infinite_only_where_they_go_on() {
        // Everything; a half-space; a slab; an upright quarter; a wedge that opens along +X and keeps |y| < x.
        let b = bounds(&[], 1e-9).unwrap();
        assert!(close(b.min, [-INF; 3]) && close(b.max, [INF; 3]));
        let b = bounds(&[plane(0., 2., 0., 6.)], 1e-9).unwrap();
        assert!(close(b.min, [-INF; 3]) && close(b.max, [INF, 3., INF]));
        let b = bounds(&[plane(0., 1., 0., 3.), plane(0., -1., 0., 1.)], 1e-9).unwrap();
        assert!(close(b.min, [-INF, -1., -INF]) && close(b.max, [INF, 3., INF]));
        let b = bounds(&[plane(1., 0., 0., 5.), plane(0., 0., -1., 4.)], 1e-9).unwrap();
        assert!(close(b.min, [-INF, -INF, -4.]) && close(b.max, [5., INF, INF]));
        let wedge = [plane(-1., 1., 0., 0.), plane(-1., -1., 0., 0.), plane(0., 0., 1., 1.), plane(0., 0., -1., 1.)];
        let b = bounds(&wedge, 1e-9).unwrap();
        assert!(close(b.min, [0., -INF, -1.]) && close(b.max, [INF, INF, 1.]));
    }

    #[test]
    fn faces_of_a_half_of_a_box_and_of_nothing() {
        let within = Aabb { min: DVec3::ZERO, max: DVec3::splat(2.0) };
        let half = faces(&[plane(1., 1., 0., 2.)], &within);
        let areas: Vec<f64> = half.iter().map(|f| crate::math::geom::area(f)).collect();
        let expected = [2.0 * 8f64.sqrt(), 0.0, 4.0, 0.0, 4.0, 2.0, 2.0];
        assert!(areas.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{areas:?}");
        let nothing = faces(&[plane(1., 0., 0., 0.5), plane(-1., 0., 0., -1.)], &within);
        assert!(nothing.iter().all(|f| crate::math::geom::area(f) == 0.0));
    }

    #[test]
    fn pieces_without_volume_are_none() {
        assert_eq!(bounds(&[plane(1., 0., 0., 0.), plane(-1., 0., 0., -1.)], 1e-9), None);
        assert_eq!(bounds(&[plane(1., 0., 0., 1.), plane(-1., 0., 0., -1.)], 1e-9), None);
    }
}
