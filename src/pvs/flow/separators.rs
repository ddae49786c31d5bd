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

use super::window::{LANES, Slack, Window};
use crate::math::geom::Plane;
use crate::math::lanes;
use glam::DVec3;
use pulp::Simd;

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

/// Planes through consecutive edges of a window, as a structure of arrays: x, y and z of unit normals, then distances from the origin. Those
/// with a distance of NaN do not separate the windows.
pub(crate) type Planes = [[f64; LANES]; 4];

/// Those that separate.
#[inline(always)]
fn separating(planes: &Planes) -> impl Iterator<Item = Plane> {
    let [x, y, z, d] = planes;
    (0..LANES).filter(|&k| !d[k].is_nan()).map(|k| Plane { n: DVec3::new(x[k], y[k], z[k]), d: d[k] })
}

/// A consumer of planes.
pub(crate) trait Sink {
    /// Takes those that separate; false to stop.
    fn take<S: Simd>(&mut self, simd: S, planes: &Planes) -> bool;
}

/// Collects distinct planes, from some place of a list on.
struct Distinct<'a> {
    planes: &'a mut Vec<Plane>,
    start: usize,
}

impl Sink for Distinct<'_> {
    #[inline(always)]
    fn take<S: Simd>(&mut self, _simd: S, planes: &Planes) -> bool {
        for plane in separating(planes) {
            if !self.planes[self.start..].iter().any(|p| p.n.dot(plane.n) > SAME) {
                self.planes.push(plane);
            }
        }
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
    fn take<S: Simd>(&mut self, simd: S, planes: &Planes) -> bool {
        if !self.window.is_cut_by_any(simd, planes, self.slack) {
            return true;
        }
        self.passes = separating(planes).all(|plane| self.window.cut(&plane, self.slack, self.spare));
        self.passes
    }
}

/// Makes separating planes. Holds scratch memory, and the rounding error of a distance between two corners.
pub(crate) struct Separators {
    rounding: f64,
    /// Inverse heights of the other window's corners over the plane of the current one.
    heights: Vec<f64>,
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
    pub fn each<S: Simd>(&mut self, simd: S, [first, second]: [&Window; 2], way: Way, sink: &mut impl Sink) {
        if first.is_empty() || second.is_empty() {
            return;
        }
        if self.turn(first, second, way, Turn::Kept).through_edges(simd, Edges::All, sink) {
            self.turn(second, first, way.reversed(), Turn::Over).through_edges(simd, Edges::All, sink);
        }
    }

    /// As [`Separators::each`], through original edges of `second` only.
    #[inline(always)]
    pub fn through_second<S: Simd>(&mut self, simd: S, [first, second]: [&Window; 2], way: Way, sink: &mut impl Sink) {
        if !first.is_empty() && !second.is_empty() {
            self.turn(second, first, way.reversed(), Turn::Over).through_edges(simd, Edges::Own, sink);
        }
    }

    /// Appends these planes to a list; of `second`, only those through original edges. Near duplicates, as from parallel edges, are left
    /// out.
    #[inline(always)]
    pub fn list<S: Simd>(&mut self, simd: S, [first, second]: [&Window; 2], way: Way, planes: &mut Vec<Plane>) {
        if first.is_empty() || second.is_empty() {
            return;
        }
        let start = planes.len();
        let mut sink = Distinct { planes, start };
        self.turn(first, second, way, Turn::Kept).through_edges(simd, Edges::All, &mut sink);
        self.turn(second, first, way.reversed(), Turn::Over).through_edges(simd, Edges::Own, &mut sink);
    }

    /// As [`Separators::list`], through all edges of both.
    #[inline(always)]
    pub fn list_all<S: Simd>(&mut self, simd: S, windows: [&Window; 2], way: Way, planes: &mut Vec<Plane>) {
        let start = planes.len();
        self.each(simd, windows, way, &mut Distinct { planes, start });
    }

    #[inline(always)]
    fn turn<'w>(&'w mut self, edges: &'w Window, others: &'w Window, way: Way, turn: Turn) -> Turned<'w> {
        let sign = if way == Way::Along { 1.0 } else { -1.0 };
        let turn = if turn == Turn::Kept { 1.0 } else { -1.0 };
        let Self { rounding, heights } = self;
        Turned { edges, others, sign, turn, rounding: *rounding, heights }
    }
}

/// Planes through an edge of `edges` and a corner of `others`, with `edges` outside and `others` inside. Edges are taken in groups of four,
/// a register's worth.
struct Turned<'w> {
    edges: &'w Window,
    others: &'w Window,
    /// 1 if `others` is on the side that the normal of `edges` points to, otherwise -1.
    sign: f64,
    /// 1, or -1 to orient planes towards `edges`.
    turn: f64,
    rounding: f64,
    heights: &'w mut Vec<f64>,
}

impl Turned<'_> {
    /// Gives `sink` the planes. False if it stops.
    #[inline(always)]
    fn through_edges<S: Simd>(mut self, simd: S, which: Edges, sink: &mut impl Sink) -> bool {
        const { assert!(LANES.is_multiple_of(S::F64_LANES), "a group is whole registers") }
        let edges = self.edges;
        let mut before = edges.corner(edges.len() - 1).to_array();
        self.measure(DVec3::from_array(before));
        for (g, ends) in edges.groups().enumerate() {
            let starts: [[f64; LANES]; 3] = std::array::from_fn(|axis| {
                let [a, b, c, d] = *ends[axis];
                [std::mem::replace(&mut before[axis], d), a, b, c]
            });
            let asked = edges.edges(g, which == Edges::Own);
            if asked == [false; LANES] {
                continue;
            }
            let mut planes = [[f64::NAN; LANES]; 4];
            for k in 0..LANES / S::F64_LANES {
                let from = lanes::load::<S, LANES>(starts.each_ref(), k);
                self.planes(simd, from, lanes::load::<S, LANES>(ends, k), k, &mut planes);
            }
            planes[3].iter_mut().zip(asked).filter(|(_, asked)| !asked).for_each(|(d, _)| *d = f64::NAN);
            if planes[3].iter().any(|d| !d.is_nan()) && !sink.take(simd, &planes) {
                return false;
            }
        }
        true
    }

    /// The planes of a register of edges from `a` to `b`, register `k` of `planes`.
    ///
    /// Each contains the corner of `others` that it meets first when it is rotated about its edge: that with the least angle from the inside
    /// of the window, in its plane, to its normal.
    #[inline(always)]
    fn planes<S: Simd>(&self, simd: S, a: [S::f64s; 3], b: [S::f64s; 3], k: usize, planes: &mut Planes) {
        let along = lanes::sub(simd, b, a);
        // Towards the inside of the window, in its plane.
        let inward = lanes::cross(simd, lanes::splat(simd, self.edges.normal), along);
        let start = lanes::dot(simd, inward, a);
        let mut best = lanes::splat(simd, self.others.corner(0));
        let mut greatest = simd.splat_f64s(f64::NEG_INFINITY);
        for (p, &height) in self.others.iter().zip(&*self.heights) {
            let p = lanes::splat(simd, p);
            let ahead = simd.sub_f64s(lanes::dot(simd, inward, p), start);
            let cotangent = simd.mul_f64s(ahead, simd.splat_f64s(height));
            let more = simd.greater_than_f64s(cotangent, greatest);
            greatest = simd.select_f64s(more, cotangent, greatest);
            best = lanes::select(simd, more, p, best);
        }
        let normal = lanes::cross(simd, lanes::sub(simd, best, a), along);
        let length = simd.sqrt_f64s(lanes::dot(simd, normal, normal));
        let inverse = simd.div_f64s(simd.splat_f64s(self.sign), length);
        let normal = lanes::scale(simd, normal, inverse);
        let d = self.accept(simd, normal, lanes::dot(simd, normal, a));
        let turn = simd.splat_f64s(self.turn);
        let values = [normal[0], normal[1], normal[2], d];
        for i in 0..4 {
            S::as_mut_simd_f64s(&mut planes[i]).0[k] = simd.mul_f64s(values[i], turn);
        }
    }

    /// The distances of planes from the origin, moved outwards by what rounding explains; NaN for those that do not have `edges` outside and
    /// `others` inside.
    #[inline(always)]
    fn accept<S: Simd>(&self, simd: S, normal: [S::f64s; 3], d: S::f64s) -> S::f64s {
        let (rounding, depth) = (simd.splat_f64s(self.rounding), simd.splat_f64s(DEPTH * self.rounding));
        let inside = self.others.ranges(simd, normal, d);
        let outside = self.edges.ranges(simd, normal, d);
        let inside_holds = simd.and_m64s(
            simd.less_than_or_equal_f64s(inside[1], rounding),
            simd.less_than_f64s(inside[0], simd.neg_f64s(depth)),
        );
        let outside_holds = simd.and_m64s(
            simd.greater_than_or_equal_f64s(outside[0], simd.neg_f64s(rounding)),
            simd.greater_than_f64s(outside[1], depth),
        );
        // Edges too short to square have no finite plane.
        let holds = simd.and_m64s(inside_holds, simd.less_than_f64s(simd.abs_f64s(d), simd.splat_f64s(f64::INFINITY)));
        // The greatest distance inside is 0 apart from rounding.
        let out = simd.max_f64s(inside[1], simd.splat_f64s(0.0));
        simd.select_f64s(simd.and_m64s(holds, outside_holds), simd.add_f64s(d, out), simd.splat_f64s(f64::NAN))
    }

    /// The inverse heights of the corners of `others` above the plane of `edges`, which contains `base`.
    #[inline(always)]
    fn measure(&mut self, base: DVec3) {
        let up = self.edges.normal * self.sign;
        let base = up.dot(base);
        self.heights.clear();
        for [x, y, z] in self.others.groups() {
            let mut inverse = [0.0; LANES];
            for k in 0..LANES {
                let h = up.x * x[k] + up.y * y[k] + up.z * z[k] - base;
                inverse[k] = if h > self.rounding { 1.0 / h } else { LEVEL };
            }
            self.heights.extend_from_slice(&inverse);
        }
    }
}

/// Planes are equal if the dot product of their normals is greater.
const SAME: f64 = 1.0 - 1e-12;

/// Represents the inverse of a height of zero.
const LEVEL: f64 = 1e300;

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
            let windows = [&window(a), &window(b)];
            Separators::new(64.0 * f64::EPSILON).list(pulp::Scalar::new(), windows, way, &mut planes);
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
