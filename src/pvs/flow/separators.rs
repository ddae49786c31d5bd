//! Separating planes of two windows: how far the lines through both can spread beyond the second.
//!
//! Based on: Teller, *Visibility computations in densely occluded polyhedral environments*, 1992 (antipenumbra); the planes
//! through an edge of one window and a corner of the other are the ones that portal flow in level compilers takes, after an
//! idea of Carmack, 1996. Deviates in two ways.
//!
//! How a plane is found: turned about an edge, away from the window's own plane, it meets the other window first in the corner
//! of the greatest cotangent; so one pass over the corners gives the only candidate of an edge.
//!
//! How a plane is accepted: not by the way it was made, but by testing that the first window lies wholly on its outside and
//! the second wholly on its inside. That alone makes a plane valid, for any two sets of points: a line from `s` to `w` that
//! has not gone inwards by `w` never comes back out beyond it. So bad input (collinear corners, edges of length zero, windings
//! that aren't quite flat, normals that are a guess) can make planes fail the test, never pass it wrongly.

use super::window::Window;
use crate::geom::Plane;
use glam::DVec3;

/// A window must reach this many times the rounding error of the test away from a plane that it touches. Rounding can then
/// lose lines only within that fraction of the window's width from its edge. Larger: narrower slits go without planes.
const DEPTH: f64 = 1024.0;

/// Which way lines go through a window, by the way its portal leads.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Way {
    /// As it leads.
    Along,
    /// The other way.
    Against,
}

/// Calls `found` with planes whose inside holds everything that lines through `first` and then `second` can meet beyond
/// `second`, until it returns false. `rounding` is the error of a distance of two corners.
///
/// The planes of the windows themselves are not among them. Where a window is empty (nothing is known about it) there are none.
#[inline]
pub(crate) fn separators(first: &Window, second: &Window, way: Way, rounding: f64, mut found: impl FnMut(Plane) -> bool) {
    if first.is_empty() || second.is_empty() {
        return;
    }
    let sign = if way == Way::Along { 1.0 } else { -1.0 };
    if through_edges(first, second, sign, rounding, &mut found) {
        // Here the second window lies outside of the plane and the first inside: turn it round.
        through_edges(second, first, -sign, rounding, &mut |plane| found(plane.flipped()));
    }
}

/// Calls `found` with planes through an edge of `edges` and a corner of `others` that have `edges` outside and `others`
/// inside; `sign` says on which side of `edges` the others lie. False where `found` ended it.
#[inline]
fn through_edges(edges: &Window, others: &Window, sign: f64, rounding: f64, found: &mut impl FnMut(Plane) -> bool) -> bool {
    let up = edges.normal * sign;
    let n = edges.len();
    let mut a = edges.corner(n - 1);
    for i in 0..n {
        let b = edges.corner(i);
        let along = b - a;
        // Towards the inside of `edges`, in its plane.
        let inward = edges.normal.cross(along);
        // The corner that a plane turned about the edge meets first: that with the least angle from `inward` to `up`.
        let nearest = others.corner(0) - a;
        let (mut best, mut best_y, mut best_h) = (0, inward.dot(nearest), up.dot(nearest));
        for k in 1..others.len() {
            let p = others.corner(k) - a;
            let (y, h) = (inward.dot(p), up.dot(p));
            if y * best_h > best_y * h {
                (best, best_y, best_h) = (k, y, h);
            }
        }
        let normal = (others.corner(best) - a).cross(along) * sign;
        if let Some(plane) = accept(normal, a, edges, others, rounding)
            && !found(plane)
        {
            return false;
        }
        a = b;
    }
    true
}

/// The plane through `a` across `normal`, if `outer` lies outside of it and `inner` inside.
#[inline]
fn accept(normal: DVec3, a: DVec3, outer: &Window, inner: &Window, rounding: f64) -> Option<Plane> {
    let n = normal * (1.0 / normal.length());
    if !n.is_finite() {
        return None;
    }
    let plane = Plane::through(a, n);
    let (inner_low, inner_high) = inner.range(&plane);
    if inner_high > rounding || -inner_low <= DEPTH * rounding {
        return None;
    }
    let (outer_low, outer_high) = outer.range(&plane);
    // `inner_high` is 0 but for rounding, which may only move the plane outwards.
    (outer_low >= -rounding && outer_high > DEPTH * rounding).then(|| Plane { n, d: plane.d + inner_high.max(0.0) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn square(x: f64, side: f64) -> Vec<DVec3> {
        [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(y, z)| DVec3::new(x, y * side, z * side)).to_vec()
    }

    fn between(a: &[DVec3], b: &[DVec3]) -> Vec<Plane> {
        let window = |corners: &[DVec3]| Window::new(corners, crate::geom::newell(corners).normalize_or_zero(), true);
        let mut planes = Vec::new();
        for way in [Way::Along, Way::Against] {
            separators(&window(a), &window(b), way, 64.0 * f64::EPSILON, |plane| {
                planes.push(plane);
                true
            });
        }
        planes
    }

    #[test]
    fn two_squares_spread_by_their_diagonals() {
        let planes = between(&square(0.0, 1.0), &square(1.0, 1.0));
        assert!(planes.len() >= 4);
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
