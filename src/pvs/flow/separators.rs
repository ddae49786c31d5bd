//! Separating planes of two windows: bounds on the lines through both beyond the second.
//!
//! Based on: Teller, *Visibility computations in densely occluded polyhedral environments*, 1992 (antipenumbra); planes through an edge of
//! one window and a corner of the other are those of portal flow in level compilers, after Carmack, 1996. Two deviations.
//!
//! How a plane is found: rotated about an edge, away from the window's own plane, it first meets the other window's corner with the
//! greatest cotangent; so one pass over the corners gives the only candidate of an edge.
//!
//! How a plane is accepted: by a test that the first window is entirely outside and the second entirely inside, not by its construction.
//! The test alone makes a plane valid, for any two sets of points: a line that crosses from outside to inside never returns. So bad input
//! (collinear corners, edges of length zero, windings that are not quite flat, wrong normals) can make planes fail the test, but never pass
//! it wrongly.

use super::window::{Slack, Window};
use crate::math::geom::Plane;
use glam::DVec3;

/// Least extent of a window away from a plane that it touches, in rounding errors of the test. Rounding then loses lines only within that
/// fraction of the window's width from its edge. Larger: narrower slits get no planes.
const DEPTH: f64 = 1024.0;

/// Direction of lines through a window, relative to its portal.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Way {
    /// In the portal's direction.
    Along,
    /// Opposite.
    Against,
}

impl Way {
    fn reversed(self) -> Self {
        match self {
            Self::Along => Self::Against,
            Self::Against => Self::Along,
        }
    }
}

/// Which side of a plane counts as its inside.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Turn {
    /// That of the other window.
    Kept,
    /// That of the window whose edges it contains.
    Over,
}

/// Edges of a window that planes contain.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Edges {
    /// All of them.
    All,
    /// Original edges of the portal. The others lie in planes that clipped the window: their constraints are known already, apart from a
    /// little that is not worth the time.
    Own,
}

/// A consumer of planes.
pub(crate) trait Sink {
    /// False if the plane through `a` with the unit normal `n` is useless.
    fn is_of_use(&self, n: DVec3, a: DVec3) -> bool;

    /// Takes a plane; false to stop.
    fn take(&mut self, plane: Plane) -> bool;
}

/// Collects distinct planes, from some place of a list on.
struct Distinct<'a> {
    planes: &'a mut Vec<Plane>,
    start: usize,
}

impl Sink for Distinct<'_> {
    #[inline(always)]
    fn is_of_use(&self, n: DVec3, _a: DVec3) -> bool {
        !self.planes[self.start..].iter().any(|p| p.n.dot(n) > SAME)
    }

    #[inline(always)]
    fn take(&mut self, plane: Plane) -> bool {
        self.planes.push(plane);
        true
    }
}

/// Clips a window to the inside of each plane.
pub(crate) struct Cut<'a> {
    /// The window.
    pub window: &'a mut Window,
    /// Whether anything is left.
    pub passes: bool,
    /// Tolerances.
    pub slack: &'a Slack,
    /// Scratch.
    pub spare: &'a mut Window,
}

impl Sink for Cut<'_> {
    #[inline(always)]
    fn is_of_use(&self, n: DVec3, a: DVec3) -> bool {
        self.window.reaches(n, a)
    }

    #[inline(always)]
    fn take(&mut self, plane: Plane) -> bool {
        self.passes = self.window.cut(&plane, self.slack, self.spare);
        self.passes
    }
}

/// Makes separating planes. Holds scratch memory, and the rounding error of a distance between two corners.
pub(crate) struct Separators {
    rounding: f64,
    /// Inverse heights of the other window's corners over the plane of the current one.
    heights: Vec<[f64; 4]>,
}

impl Separators {
    /// `rounding`: [`super::net::Net::rounding`].
    pub fn new(rounding: f64) -> Self {
        Self { rounding, heights: Vec::new() }
    }

    /// Gives `sink` planes whose inside contains all points that lines through `first` and then `second` reach beyond `second`, until it
    /// stops.
    ///
    /// The planes of the windows themselves are not included. An empty (unknown) window gives none.
    #[inline(always)]
    pub fn each(&mut self, first: &Window, second: &Window, way: Way, sink: &mut impl Sink) {
        if first.is_empty() || second.is_empty() {
            return;
        }
        if self.through_edges(first, Edges::All, second, way, Turn::Kept, sink) {
            self.through_edges(second, Edges::All, first, way.reversed(), Turn::Over, sink);
        }
    }

    /// As [`Separators::each`], through original edges of `second` only.
    #[inline(always)]
    pub fn through_second(&mut self, first: &Window, second: &Window, way: Way, sink: &mut impl Sink) {
        if !first.is_empty() && !second.is_empty() {
            self.through_edges(second, Edges::Own, first, way.reversed(), Turn::Over, sink);
        }
    }

    /// Appends these planes to a list; of `second`, only those through original edges. Near duplicates, as from parallel edges, are left
    /// out.
    #[inline(always)]
    pub fn list(&mut self, first: &Window, second: &Window, way: Way, planes: &mut Vec<Plane>) {
        if first.is_empty() || second.is_empty() {
            return;
        }
        let start = planes.len();
        let mut sink = Distinct { planes, start };
        self.through_edges(first, Edges::All, second, way, Turn::Kept, &mut sink);
        self.through_edges(second, Edges::Own, first, way.reversed(), Turn::Over, &mut sink);
    }

    /// As [`Separators::list`], through all edges of both.
    pub fn list_all(&mut self, first: &Window, second: &Window, way: Way, planes: &mut Vec<Plane>) {
        let start = planes.len();
        self.each(first, second, way, &mut Distinct { planes, start });
    }

    /// Gives `sink` planes through an edge of `edges` and a corner of `others`, on the side of `way`, with `edges` outside and `others`
    /// inside, oriented by the turn. False if it stops.
    #[inline(always)]
    fn through_edges(
        &mut self,
        edges: &Window,
        which: Edges,
        others: &Window,
        way: Way,
        turn: Turn,
        sink: &mut impl Sink,
    ) -> bool {
        let sign = if way == Way::Along { 1.0 } else { -1.0 };
        let turn = if turn == Turn::Kept { 1.0 } else { -1.0 };
        let up = edges.normal * sign;
        let n = edges.len();
        let mut a = edges.corner(n - 1);
        let base = up.dot(a);
        self.measure(others, up, base);
        for i in 0..n {
            let b = edges.corner(i);
            if which == Edges::Own && !edges.is_own(i) {
                a = b;
                continue;
            }
            let along = b - a;
            // Towards the inside of `edges`, in its plane.
            let inward = edges.normal.cross(along);
            let start = inward.dot(a);
            // The corner that a plane rotated about the edge meets first: that with the least angle from `inward` to `up`.
            let (mut best, mut greatest) = (0, f64::NEG_INFINITY);
            for (g, ([x, y, z], heights)) in others.groups().zip(&self.heights).enumerate() {
                let mut cotangents = [0.0; 4];
                for k in 0..4 {
                    cotangents[k] = (inward.x * x[k] + inward.y * y[k] + inward.z * z[k] - start) * heights[k];
                }
                for (k, &cotangent) in cotangents.iter().enumerate() {
                    if cotangent > greatest {
                        (best, greatest) = (g * 4 + k, cotangent);
                    }
                }
            }
            let best = if best < others.len() { best } else { 0 }; // copies of the first
            let normal = (others.corner(best) - a).cross(along) * sign;
            let normal = normal * (1.0 / normal.length());
            if normal.is_finite()
                && sink.is_of_use(normal * turn, a)
                && let Some(plane) = accept(normal, a, edges, others, self.rounding)
                && !sink.take(Plane { n: plane.n * turn, d: plane.d * turn })
            {
                return false;
            }
            a = b;
        }
        true
    }

    /// The inverse heights of a window's corners above the plane across `up` at `base`.
    #[inline(always)]
    fn measure(&mut self, others: &Window, up: DVec3, base: f64) {
        self.heights.clear();
        for [x, y, z] in others.groups() {
            let mut inverse = [0.0; 4];
            for k in 0..4 {
                let h = up.x * x[k] + up.y * y[k] + up.z * z[k] - base;
                inverse[k] = if h > self.rounding { 1.0 / h } else { LEVEL };
            }
            self.heights.push(inverse);
        }
    }
}

/// Planes are equal if the dot product of their normals is greater.
const SAME: f64 = 1.0 - 1e-12;

/// Represents the inverse of a height of zero.
const LEVEL: f64 = 1e300;

/// The plane through `a` with the unit normal `n`, if `outer` is outside of it and `inner` inside.
#[inline(always)]
fn accept(n: DVec3, a: DVec3, outer: &Window, inner: &Window, rounding: f64) -> Option<Plane> {
    let plane = Plane::through(a, n);
    let (inner_low, inner_high) = inner.range(&plane);
    if inner_high > rounding || -inner_low <= DEPTH * rounding {
        return None;
    }
    let (outer_low, outer_high) = outer.range(&plane);
    // `inner_high` is 0 apart from rounding, which may only move the plane outwards.
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
        let window = |corners: &[DVec3]| Window::new(corners, crate::math::geom::newell(corners).normalize_or_zero(), true);
        let mut planes = Vec::new();
        for way in [Way::Along, Way::Against] {
            Separators::new(64.0 * f64::EPSILON).list(&window(a), &window(b), way, &mut planes);
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
        // A window and itself, and degenerate windows of one point.
        assert!(between(&square(0.0, 1.0), &square(0.0, 1.0)).is_empty());
        assert!(between(&[DVec3::ZERO; 4], &[DVec3::ZERO; 4]).is_empty());
        assert!(between(&[DVec3::splat(f64::NAN); 4], &square(1.0, 1.0)).is_empty());
    }

    /// Corners of a random window: round, thin, a segment or a point.
    fn window() -> impl Strategy<Value = Vec<DVec3>> {
        let thin = prop_oneof![Just(1.0), Just(1e-3), Just(1e-6), Just(1e-9), Just(0.0)];
        let real = || -1.0..1.0f64;
        let vector = move || (real(), real(), real()).prop_map(DVec3::from);
        (vector(), vector(), vector(), thin, 3..8usize).prop_map(|(o, u, v, thin, n)| {
            let corner = |k: usize| (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
            (0..n).map(corner).map(|(s, c)| o + u * c + v * (s * thin)).collect()
        })
    }

    /// Random points: not a window, but planes must be valid for them, too.
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
