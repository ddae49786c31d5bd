//! Separating planes of two windows: how far the lines through both can spread beyond the second.
//!
//! Based on: Teller, *Visibility computations in densely occluded polyhedral environments*, 1992 (antipenumbra); the planes
//! through an edge of one window and a corner of the other are the ones that portal flow in level compilers takes, after an
//! idea of Carmack, 1996. Deviates in how a plane is accepted: not by the way it was made, but by testing that the first
//! window lies wholly on its outside and the second wholly on its inside. That alone makes a plane valid, for any two sets
//! of points: a line from `s` to `w` that has not gone inwards by `w` never comes back out beyond it. So bad input
//! (collinear corners, edges of length zero, windings that aren't quite flat) can make planes fail the test, never pass it
//! wrongly.

use crate::geom::Plane;
use glam::DVec3;

/// A window must reach this many times the rounding error of the test away from a plane that it touches. Rounding can then
/// lose lines only within that fraction of the window's width from its edge. Larger: narrower slits go without planes.
const DEPTH: f64 = 1024.0;

/// Appends planes whose inside holds everything that lines through `first` and then `second` can meet beyond `second`.
///
/// The planes of the windows themselves are not among them. Where a window is empty (nothing is known about it) there are none.
pub(super) fn separators(first: &[DVec3], second: &[DVec3], planes: &mut Vec<Plane>) {
    let Some(&origin) = first.first() else { return };
    let size = first.iter().chain(second).fold(0.0f64, |s, &p| s.max(p.distance_squared(origin))).sqrt();
    // No corner is farther than twice `size` from another: distances between corners are exact to this.
    let rounding = 16.0 * f64::EPSILON * size;
    let start = planes.len();
    through_edges(first, second, rounding, |plane| add(planes, start, plane));
    // Here the second window lies outside of the plane and the first inside: turn it round.
    through_edges(second, first, rounding, |plane| add(planes, start, plane.flipped()));
}

/// Leaves out planes that are there already: an edge of one window is often parallel to one of the other.
fn add(planes: &mut Vec<Plane>, start: usize, plane: Plane) {
    let same = |p: &Plane| (p.n - plane.n).abs().max_element() < 1e-12 && p.d == plane.d;
    if !planes[start..].iter().any(same) {
        planes.push(plane);
    }
}

/// Calls `found` with every plane through an edge of `edges` and a corner of `others` that has `edges` outside and `others`
/// inside.
fn through_edges(edges: &[DVec3], others: &[DVec3], rounding: f64, mut found: impl FnMut(Plane)) {
    let Some(&first) = others.first() else { return };
    for (i, &a) in edges.iter().enumerate() {
        let along = edges[(i + 1) % edges.len()] - a;
        // Turn two planes about the edge, one each way, until `others` lies on one side of them. One round is enough where
        // that can be done at all.
        let (mut left, mut right) = (along.cross(first - a), along.cross(a - first));
        for p in others[1..].iter().map(|&p| p - a) {
            if left.dot(p) > 0.0 || left == DVec3::ZERO {
                left = along.cross(p);
            }
            if right.dot(p) > 0.0 || right == DVec3::ZERO {
                right = -along.cross(p);
            }
        }
        // The rest of `edges` tells which of the two is of use.
        let across = edges[(i + 2) % edges.len()] - a;
        for normal in [left, right] {
            if normal.dot(across) >= 0.0
                && let Some(plane) = accept(normal, a, edges, others, rounding)
            {
                found(plane);
            }
        }
    }
}

/// The plane through `a` across `normal`, if `outer` lies outside of it and `inner` inside.
///
/// Distances are taken from `a`, so that their error scales with the size of the windows and not with their coordinates.
fn accept(normal: DVec3, a: DVec3, outer: &[DVec3], inner: &[DVec3], rounding: f64) -> Option<Plane> {
    let n = normal.try_normalize()?;
    let (mut outer_high, mut inner_low, mut inner_high) = (0.0f64, 0.0f64, 0.0f64);
    for &p in outer {
        let d = n.dot(p - a);
        if d < -rounding {
            return None;
        }
        outer_high = outer_high.max(d);
    }
    for &p in inner {
        let d = n.dot(p - a);
        if d > rounding {
            return None;
        }
        (inner_low, inner_high) = (inner_low.min(d), inner_high.max(d));
    }
    // `inner_high` is 0 but for rounding, which may only move the plane outwards.
    (outer_high > DEPTH * rounding && -inner_low > DEPTH * rounding).then(|| Plane { n, d: n.dot(a) + inner_high })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn square(x: f64, side: f64) -> Vec<DVec3> {
        [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(y, z)| DVec3::new(x, y * side, z * side)).to_vec()
    }

    fn between(a: &[DVec3], b: &[DVec3]) -> Vec<Plane> {
        let mut planes = Vec::new();
        separators(a, b, &mut planes);
        planes
    }

    #[test]
    fn two_squares_spread_by_their_diagonals() {
        let planes = between(&square(0.0, 1.0), &square(1.0, 1.0));
        assert_eq!(planes.len(), 4);
        let inside = |y: f64, z: f64| planes.iter().all(|p| p.distance(DVec3::new(2.0, y, z)) <= 1e-12);
        assert!(inside(0.5, 0.5) && inside(2.0, 0.5) && inside(-1.0, -1.0));
        assert!(!inside(2.001, 0.5) && !inside(0.5, -1.001));
    }

    #[test]
    fn windows_that_tell_nothing_give_no_planes() {
        assert!(between(&[], &square(1.0, 1.0)).is_empty() && between(&square(0.0, 1.0), &[]).is_empty());
        // One on the other, and one point twice.
        assert!(between(&square(0.0, 1.0), &square(0.0, 1.0)).is_empty());
        assert!(between(&[DVec3::ZERO; 4], &[DVec3::ZERO; 4]).is_empty());
        assert!(between(&[DVec3::splat(f64::NAN); 4], &square(1.0, 1.0)).is_empty());
    }

    /// Corners of a window: round, thin, a segment or a point, anywhere.
    fn window() -> impl Strategy<Value = Vec<DVec3>> {
        let thin = prop_oneof![Just(1.0), Just(1e-3), Just(1e-6), Just(1e-9), Just(0.0)];
        let real = || -1.0..1.0f64;
        let vector = move || (real(), real(), real()).prop_map(DVec3::from);
        (vector(), vector(), vector(), thin, 3..8usize).prop_map(|(o, u, v, thin, n)| {
            let corner = |k: usize| (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
            (0..n).map(corner).map(|(s, c)| o + u * c + v * (s * thin)).collect()
        })
    }

    /// Any points at all: no window, but planes must hold for them too.
    fn cloud() -> impl Strategy<Value = Vec<DVec3>> {
        proptest::collection::vec((-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64).prop_map(DVec3::from), 3..6)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        /// Lines between random points of both windows, away from their edges, stay inside every plane.
        #[test]
        fn lines_stay_inside(a in prop_oneof![window(), cloud()], b in prop_oneof![window(), cloud()], seed in any::<u64>()) {
            let planes = between(&a, &b);
            let mut state = seed | 1;
            let mut real = || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 11) as f64 / (1u64 << 53) as f64
            };
            let mut point = |w: &[DVec3]| {
                let weights: Vec<f64> = w.iter().map(|_| real()).collect();
                w.iter().zip(&weights).map(|(&p, &k)| p * k).sum::<DVec3>() / weights.iter().sum::<f64>()
            };
            for _ in 0..20 {
                let (s, w) = (point(&a), point(&b));
                for far in [0.0, 1.0, 100.0] {
                    let p = w + (w - s) * far;
                    for plane in &planes {
                        prop_assert!(plane.distance(p) <= 1e-13 * (1.0 + far), "{p} {plane:?} {}", plane.distance(p));
                    }
                }
            }
        }
    }
}
