//! Windows: the part of a portal's winding that the lines of one chain can pass.
//!
//! Based on: Sutherland, Hodgman, *Reentrant polygon clipping*, 1974. Two deviations. The plane is moved out by [`Slack::reach`] before the
//! cut, and the cut itself has no tolerance: the usual epsilon for corners would drop the wedge between a corner and the crossing of a long
//! edge. And a segment or a point is still a window, because a chain ends only if provably no line is left.
//!
//! Corners are a structure of arrays, padded to groups of four with copies of the first, so that their distances to a plane are a loop
//! without branches. Their number is not limited.

use crate::math::geom::{Aabb, Plane};
use crate::math::lanes;
use glam::DVec3;
use pulp::Simd;

/// Tolerances of comparisons with planes, metres.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Slack {
    /// A cut keeps points up to this far outside. Covers the rounding of previous cuts.
    pub reach: f64,
    /// A window nowhere deeper than this inside is cut off: only lines that touch the plane would be left.
    pub strict: f64,
    /// The caller's tolerance: windows without a plane, and boxes of objects, are cut off only if they are this far outside.
    pub coplanar: f64,
}

/// Corners, or planes, in one group.
pub const LANES: usize = 4;

/// Corners of a convex polygon that contains every point where a line of the chain can cross the portal. Without corners: unknown, a line
/// may cross anywhere.
#[derive(Clone, Default, Debug)]
pub struct Window {
    /// x of all corners, then y, then z, each `room` long.
    corners: Vec<f64>,
    room: usize,
    len: usize,
    /// Bit i: the edge that ends at corner i is an original edge of the portal, not made by a cut. Corners from 64 on count as original.
    own: u64,
    /// The portal's direction. Corners of a flat window are counter-clockwise seen from its tip.
    pub normal: DVec3,
    /// Whether the corners lie in one known plane. Other windows are never clipped, only kept or cut off as a whole, because clipping the
    /// outline of a body does not clip the body.
    pub flat: bool,
}

impl Window {
    /// A window with these corners. They may be collinear or coincide.
    pub fn new(corners: &[DVec3], normal: DVec3, flat: bool) -> Self {
        let mut window = Self { normal, flat, own: !0, ..Self::default() };
        corners.iter().for_each(|&p| window.push(p));
        window.pad();
        window
    }

    /// Copies another window, reusing memory.
    #[inline(always)]
    pub fn assign(&mut self, other: &Self) {
        if self.room == other.room {
            self.corners.copy_from_slice(&other.corners);
        } else {
            self.corners.clear();
            self.corners.extend_from_slice(&other.corners);
            self.room = other.room;
        }
        (self.len, self.normal, self.flat, self.own) = (other.len, other.normal, other.flat, other.own);
    }

    /// Number of corners.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.len
    }

    /// True if the window is unknown.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// True if the edge that ends at a corner is an original edge of the portal.
    #[inline(always)]
    pub fn is_own(&self, i: usize) -> bool {
        i >= 64 || self.own >> i & 1 != 0
    }

    /// A corner.
    #[inline(always)]
    pub fn corner(&self, i: usize) -> DVec3 {
        DVec3::new(self.corners[i], self.corners[self.room + i], self.corners[2 * self.room + i])
    }

    /// All corners, in order.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = DVec3> + Clone + '_ {
        let (x, rest) = self.corners.split_at(self.room);
        let (y, z) = rest.split_at(self.room);
        x[..self.len].iter().zip(&y[..self.len]).zip(&z[..self.len]).map(|((&x, &y), &z)| DVec3::new(x, y, z))
    }

    /// The mean of the corners.
    pub fn middle(&self) -> DVec3 {
        self.iter().sum::<DVec3>() / self.len.max(1) as f64
    }

    /// x, y and z of the corners in groups of four; the last group is padded with copies of the first corner.
    #[inline(always)]
    pub fn groups(&self) -> impl Iterator<Item = [&[f64; LANES]; 3]> {
        let (x, rest) = self.corners.split_at(self.room);
        let (y, z) = rest.split_at(self.room);
        let groups = self.len.div_ceil(LANES);
        let ([x, y, z], _) = ([x, y, z].map(|axis| axis.as_chunks::<LANES>().0), ());
        x[..groups].iter().zip(&y[..groups]).zip(&z[..groups]).map(|((x, y), z)| [x, y, z])
    }

    /// The least and the greatest distance of corners to a plane.
    #[inline(always)]
    pub fn range(&self, plane: &Plane) -> (f64, f64) {
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        for [x, y, z] in self.groups() {
            for k in 0..LANES {
                let d = plane.n.x * x[k] + plane.n.y * y[k] + plane.n.z * z[k] - plane.d;
                low[k] = if d < low[k] { d } else { low[k] };
                high[k] = if d > high[k] { d } else { high[k] };
            }
        }
        let least = |a: f64, b: f64| if a < b { a } else { b };
        let most = |a: f64, b: f64| if a > b { a } else { b };
        (least(least(low[0], low[1]), least(low[2], low[3])), most(most(high[0], high[1]), most(high[2], high[3])))
    }

    /// The least and the greatest distance of corners to each plane of a register, given by unit normals and distances from the origin.
    #[inline(always)]
    pub fn ranges<S: Simd>(&self, simd: S, normal: [S::f64s; 3], d: S::f64s) -> [S::f64s; 2] {
        let mut low = simd.splat_f64s(f64::INFINITY);
        let mut high = simd.splat_f64s(f64::NEG_INFINITY);
        for p in self.iter() {
            let distance = simd.sub_f64s(lanes::dot(simd, normal, lanes::splat(simd, p)), d);
            low = simd.min_f64s(distance, low);
            high = simd.max_f64s(distance, high);
        }
        [low, high]
    }

    /// True if all corners are at least `limit` outside of one of four planes.
    #[inline(always)]
    pub fn is_beyond<S: Simd>(&self, simd: S, [x, y, z, d]: &[[f64; LANES]; 4], limit: f64) -> bool {
        let limit = simd.splat_f64s(limit);
        for k in 0..LANES / S::F64_LANES {
            let [low, _] = self.ranges(simd, lanes::load::<S, LANES>([x, y, z], k), S::as_simd_f64s(d).0[k]);
            if simd.first_true_m64s(simd.greater_than_or_equal_f64s(low, limit)) < S::F64_LANES {
                return true;
            }
        }
        false
    }

    /// False if a [cut](Self::cut) by each of four planes leaves the window as it is. Planes whose distance is NaN do not cut.
    #[inline(always)]
    pub fn is_cut_by_any<S: Simd>(&self, simd: S, [x, y, z, d]: &[[f64; LANES]; 4], slack: &Slack) -> bool {
        let (limit, reach) = if self.flat { (-slack.strict, slack.reach) } else { (slack.coplanar, f64::INFINITY) };
        let (limit, reach) = (simd.splat_f64s(limit), simd.splat_f64s(reach));
        if self.len == 0 {
            return false;
        }
        for k in 0..LANES / S::F64_LANES {
            let d = S::as_simd_f64s(d).0[k];
            let [low, high] = self.ranges(simd, lanes::load::<S, LANES>([x, y, z], k), d);
            let cut = simd.or_m64s(simd.greater_than_or_equal_f64s(low, limit), simd.greater_than_f64s(high, reach));
            if simd.first_true_m64s(simd.and_m64s(simd.equal_f64s(d, d), cut)) < S::F64_LANES {
                return true;
            }
        }
        false
    }

    /// For each edge of a group, the edge that ends at that corner: whether there is one, and an original one if `own` is set.
    #[inline(always)]
    pub fn edges(&self, group: usize, own: bool) -> [bool; LANES] {
        std::array::from_fn(|k| {
            let edge = group * LANES + k;
            edge < self.len && (!own || self.is_own(edge))
        })
    }

    /// True if every corner of another window of the same portal is in this one, to rounding. A window without corners contains everything.
    pub fn holds(&self, other: &Self) -> bool {
        if self.is_empty() || other.is_empty() {
            return self.is_empty();
        }
        // The box test handles windows that are only a segment.
        let inside = |k: usize| {
            let own = Aabb::of(self.iter());
            let p = other.corner(k);
            p.cmpge(own.min).all() && p.cmple(own.max).all()
        };
        let edge = |i: usize| {
            let a = self.corner(i);
            let inward = self.normal.cross(self.corner((i + 1) % self.len) - a);
            (0..other.len).all(|k| inward.dot(other.corner(k) - a) >= 0.0)
        };
        (0..other.len).all(inside) && (!self.flat || (0..self.len).all(edge))
    }

    /// Intersection of the line through two points with the inside of a flat window.
    pub fn met_by(&self, [a, b]: [DVec3; 2]) -> Option<DVec3> {
        if self.len < 3 || !self.flat {
            return None;
        }
        let p = a.lerp(b, self.normal.dot(self.corner(0) - a) / self.normal.dot(b - a));
        let inside = |i: usize| {
            let corner = self.corner(i);
            self.normal.cross(self.corner((i + 1) % self.len) - corner).dot(p - corner) > 0.0
        };
        (p.is_finite() && (0..self.len).all(inside)).then_some(p)
    }

    /// True if no line through the window goes inside `plane`, except touching lines.
    #[inline(always)]
    pub fn is_cut_off(&self, plane: &Plane, slack: &Slack) -> bool {
        let limit = if self.flat { -slack.strict } else { slack.coplanar };
        self.len > 0 && self.range(plane).0 >= limit
    }

    /// Clips the window to the inside of `plane`; false if no line is left. `spare` is scratch.
    #[must_use]
    #[inline(always)]
    pub fn cut(&mut self, plane: &Plane, slack: &Slack, spare: &mut Self) -> bool {
        if self.len == 0 {
            return true;
        }
        let (low, high) = self.range(plane);
        if low >= if self.flat { -slack.strict } else { slack.coplanar } {
            return false;
        }
        if self.flat && high > slack.reach {
            self.clip(plane, slack.reach, spare);
        }
        true
    }

    /// Clips at `reach` outside; there are corners on both sides.
    fn clip(&mut self, plane: &Plane, reach: f64, spare: &mut Self) {
        spare.len = 0;
        let mut own = Flags { bits: !0, next: 1 };
        let outside = |p: DVec3| plane.distance(p) - reach;
        let mut a = self.corner(self.len - 1);
        let mut da = outside(a);
        for i in 0..self.len {
            let b = self.corner(i);
            let db = outside(b);
            if (da > 0.0) != (db > 0.0) {
                // The return crossing ends the edge made by the plane.
                own.add(db > 0.0 && self.is_own(i));
                spare.push(a + (b - a) * (da / (da - db)));
            }
            if db <= 0.0 {
                own.add(self.is_own(i));
                spare.push(b);
            }
            (a, da) = (b, db);
        }
        if spare.len > 0 {
            spare.pad();
            (spare.normal, spare.flat, spare.own) = (self.normal, self.flat, own.bits);
            std::mem::swap(self, spare);
        }
    }

    #[inline(always)]
    fn push(&mut self, p: DVec3) {
        if self.len == self.room {
            self.grow();
        }
        let i = self.len;
        self.corners[i] = p.x;
        self.corners[self.room + i] = p.y;
        self.corners[2 * self.room + i] = p.z;
        self.len += 1;
    }

    #[cold]
    fn grow(&mut self) {
        let room = (2 * self.room).max(2 * LANES);
        let mut corners = vec![0.0; 3 * room];
        for axis in 0..3 {
            let from = &self.corners[axis * self.room..axis * self.room + self.len];
            corners[axis * room..axis * room + self.len].copy_from_slice(from);
        }
        (self.corners, self.room) = (corners, room);
    }

    #[inline(always)]
    fn pad(&mut self) {
        for axis in 0..3 {
            let start = axis * self.room;
            let first = self.corners.get(start).copied().unwrap_or_default();
            self.corners[start + self.len..start + self.len.next_multiple_of(LANES)].fill(first);
        }
    }
}

/// The first 64 bits; those beyond count as set.
struct Flags {
    bits: u64,
    next: u64,
}

impl Flags {
    #[inline(always)]
    fn add(&mut self, flag: bool) {
        if !flag {
            self.bits &= !self.next;
        }
        self.next <<= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::geom::area;

    const SLACK: Slack = Slack { reach: 1e-12, strict: 1e-10, coplanar: 1e-6 };

    fn window(points: &[(f64, f64)]) -> Window {
        let corners: Vec<DVec3> = points.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        Window::new(&corners, DVec3::Z, true)
    }

    fn cut(w: &mut Window, n: DVec3, d: f64) -> bool {
        w.cut(&Plane { n, d }, &SLACK, &mut Window::default())
    }

    fn size(w: &Window) -> f64 {
        area(&w.iter().collect::<Vec<_>>())
    }

    #[test]
    fn a_cut_keeps_the_inside_and_no_more() {
        let mut w = window(&[(0., 0.), (2., 0.), (2., 2.), (0., 2.)]);
        assert!(cut(&mut w, DVec3::X, 0.5) && (size(&w) - 1.0).abs() < 1e-9);
        assert!(cut(&mut w, DVec3::X, 7.0) && (size(&w) - 1.0).abs() < 1e-9);
        assert!(!cut(&mut w, DVec3::X, 0.0), "touching is not crossing");
    }

    #[test]
    fn the_wedge_beside_a_corner_that_nearly_touches_is_kept() {
        // A corner barely inside, its neighbour slightly outside and 100 m away: the crossing is far along the edge.
        let mut w = window(&[(0., -1e-9), (100., 1e-8), (100., 1.), (0., 1.)]);
        assert!(cut(&mut w, DVec3::Y, 0.0));
        assert!(w.iter().any(|p| p.x > 9.0), "{w:?}");
    }

    #[test]
    fn slivers_segments_and_points_stay_windows() {
        let mut sliver = window(&[(0., 0.), (1e-6, 0.), (1e-6, 100.), (0., 100.)]);
        assert!(cut(&mut sliver, DVec3::Y, 50.0) && cut(&mut sliver, DVec3::X, 5e-7));
        let mut segment = window(&[(0., 0.), (1., 0.), (1., 0.), (0., 0.)]);
        assert!(cut(&mut segment, DVec3::X, 0.5) && segment.iter().all(|p| p.x <= 0.5 + 1e-9));
        assert!(!cut(&mut segment, DVec3::X, -0.5));
        let mut unknown = Window::default();
        assert!(cut(&mut unknown, DVec3::X, -0.5), "without corners nothing can be cut off");
    }

    #[test]
    fn any_number_of_corners() {
        for n in 3..70 {
            let corner = |k: usize| (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
            let mut w = window(&(0..n).map(corner).map(|(s, c)| (c, s)).collect::<Vec<_>>());
            let whole = size(&w);
            let mut other = w.clone();
            assert!(cut(&mut w, DVec3::X, 0.1) && cut(&mut other, -DVec3::X, -0.1));
            assert!((size(&w) + size(&other) - whole).abs() < 1e-9 && w.len() + other.len() >= n);
            let (low, high) = w.range(&Plane { n: DVec3::X, d: 0.0 });
            assert!(low == w.iter().map(|p| p.x).fold(f64::INFINITY, f64::min) && (high - 0.1).abs() < 1e-9);
        }
    }
}
