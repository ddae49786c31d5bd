//! Boxes and triangles in the picture of a beam.
//!
//! A beam has three linear forms `x`, `y` and `w`. A point `p` relative to the eye is seen at `u = x.p / w.p`, `v = y.p / w.p`,
//! both from -1 to 1. Edges and `1/w` of a triangle are linear over the picture, also if it reaches behind the eye (Olano, Greer,
//! *Triangle scan conversion using 2D homogeneous coordinates*, 1997). Two triangles with a common edge have edge functions of
//! opposite sign and equal size, to the last bit.

use super::tree::Node;
use glam::{DMat3, DVec3};

/// Relative rounding error of a form: a sum of a dozen products of rounded numbers. Larger: narrow openings count as closed.
/// Smaller: shared edges leak.
const SLACK: f64 = 16.0 * f64::EPSILON;

/// Fraction of a triangle's size cubed. If the volume between it and the eye is smaller, its edges are rounding: it is seen
/// edge-on or is smaller than a third of a millionth of a radian. Larger: more triangles stay undecided. Smaller: edges cut in
/// wrong places.
const THIN: f64 = 400.0 * f64::EPSILON;

/// A part of a beam's picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Range of `u`.
    pub u: [f64; 2],
    /// Range of `v`.
    pub v: [f64; 2],
}

impl Cell {
    pub const ALL: Self = Self { u: [-1.0, 1.0], v: [-1.0, 1.0] };

    /// Its quarters.
    pub fn quarters(self) -> [Self; 4] {
        let (u, v) = (0.5 * (self.u[0] + self.u[1]), 0.5 * (self.v[0] + self.v[1]));
        let (us, vs) = ([[self.u[0], u], [u, self.u[1]]], [[self.v[0], v], [v, self.v[1]]]);
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, k)| Self { u: us[i], v: vs[k] })
    }

    /// Its corners, in order around it.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, k)| [self.u[i], self.v[k]])
    }

    /// Whether its interior meets a rectangle (least and greatest u, least and greatest v).
    #[inline]
    pub fn meets(&self, r: &[f64; 4]) -> bool {
        (r[0] < self.u[1]) & (r[1] > self.u[0]) & (r[2] < self.v[1]) & (r[3] > self.v[0])
    }
}

/// Range of a form over a cell.
#[inline]
pub(super) fn range(form: &[f64; 3], cell: &Cell) -> [f64; 2] {
    let pair = |a: f64, x: [f64; 2]| if a < 0.0 { [a * x[1], a * x[0]] } else { [a * x[0], a * x[1]] };
    let (u, v) = (pair(form[0], cell.u), pair(form[1], cell.v));
    [form[2] + u[0] + v[0], form[2] + u[1] + v[1]]
}

/// A form's value.
#[inline]
pub(super) fn value(form: &[f64; 3], at: [f64; 2]) -> f64 {
    form[0] * at[0] + form[1] * at[1] + form[2]
}

/// A beam from an eye.
pub(super) struct Frame {
    eye: DVec3,
    rows: [DVec3; 3],
    back: DMat3,
}

/// A triangle in a beam.
pub(super) struct Triangle {
    /// `x`, `y` and `w` of its corners.
    corners: [[f64; 3]; 3],
    /// Forms that are 0 on its edges and positive inside.
    pub edges: [[f64; 3]; 3],
    /// Error of each edge form.
    pub slack: [f64; 3],
    /// The form of `1/w` on it.
    pub inverse: [f64; 3],
    /// Relative error of `inverse`, as a fraction of `1/w` and of `1/size`.
    error: f64,
    /// Its greatest coordinate.
    size: f64,
    /// Its plane: `normal . p = volume`; the eye is on the lesser side.
    normal: [f64; 3],
    volume: f64,
    plane_slack: f64,
    /// Bounds of its picture; the whole picture if it reaches behind the eye.
    rect: [f64; 4],
    /// Upper limit of its `1/w`.
    near: f64,
    /// In the tree.
    pub place: u32,
    /// Whether it hides the things behind it.
    pub opaque: bool,
    /// Whether its edges are within rounding.
    pub thin: bool,
}

#[inline]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline]
fn greatest(a: [f64; 3]) -> f64 {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}

impl Frame {
    pub fn new(eye: DVec3, rows: [DVec3; 3]) -> Self {
        Self { eye, rows, back: DMat3::from_cols(rows[0], rows[1], rows[2]).transpose().inverse() }
    }

    /// Direction of a point of the picture.
    pub fn direction(&self, at: [f64; 2]) -> DVec3 {
        (self.back * DVec3::new(at[0], at[1], 1.0)).normalize_or_zero()
    }

    #[inline]
    fn place(&self, p: DVec3) -> [f64; 3] {
        let p = p - self.eye;
        self.rows.map(|row| row.dot(p))
    }

    /// Centre and half size of a box.
    #[inline]
    fn middle(&self, node: &Node) -> ([f64; 3], [f64; 3]) {
        let at = |p: [f32; 3]| DVec3::from_array(p.map(f64::from)) - self.eye;
        let (a, b) = (at(node.min), at(node.max));
        let (middle, half, reach) = ((a + b) * 0.5, (b - a) * 0.5, a.abs().max(b.abs()));
        (self.rows.map(|r| r.dot(middle)), self.rows.map(|r| r.abs().dot(half + SLACK * reach)))
    }

    /// Bounds of a box's picture and its greatest `1/w` there; `None` if it is outside the beam.
    #[inline]
    pub fn bounds(&self, node: &Node) -> Option<([f64; 4], f64)> {
        let (c, h) = self.middle(node);
        let (from, to) = (minus(c, h), [c[0] + h[0], c[1] + h[1], c[2] + h[2]]);
        // In the beam, |x| and |y| are at most w.
        let near = from[2].max(from[0]).max(-to[0]).max(from[1]).max(-to[1]).max(f64::MIN_POSITIVE);
        if to[2] < near {
            return None;
        }
        let least = |x: f64| (x / if x < 0.0 { near } else { to[2] }).max(-1.0) - SLACK;
        let most = |x: f64| (x / if x < 0.0 { to[2] } else { near }).min(1.0) + SLACK;
        let rect = [least(from[0]), most(to[0]), least(from[1]), most(to[1])];
        Cell::ALL.meets(&rect).then_some((rect, 1.0 / near))
    }

    /// A triangle; `None` if all of it is behind the eye.
    pub fn triangle(&self, corners: &[DVec3; 3], place: u32, opaque: bool) -> Option<Triangle> {
        let p = corners.map(|c| self.place(c));
        let w = [p[0][2], p[1][2], p[2][2]];
        if w.iter().all(|&w| w <= 0.0) {
            return None;
        }
        let sizes = p.map(greatest);
        let size = sizes[0].max(sizes[1]).max(sizes[2]);
        let (a, b) = (minus(p[1], p[0]), minus(p[2], p[0]));
        let normal = cross(a, b);
        let volume = dot(normal, p[0]);
        let side = if volume < 0.0 { -1.0 } else { 1.0 };
        let turned = |e: [f64; 3]| e.map(|x| side * x);
        let volume = volume.abs();
        let pairs = [(1, 2), (2, 0), (0, 1)];
        let length = greatest(a).max(greatest(b));
        let before = w.iter().all(|&w| w > 0.0);
        let mut rect = [f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY];
        if before {
            let span = |k: usize| {
                let x = p.map(|q| q[k] / q[2]);
                [x[0].min(x[1]).min(x[2]) - SLACK, x[0].max(x[1]).max(x[2]) + SLACK]
            };
            let (u, v) = (span(0), span(1));
            rect = [u[0], u[1], v[0], v[1]];
        }
        Some(Triangle {
            corners: p,
            edges: pairs.map(|(i, k)| turned(cross(p[i], p[k]))),
            slack: pairs.map(|(i, k)| SLACK * sizes[i] * sizes[k]),
            inverse: turned(normal).map(|x| x / volume),
            error: SLACK * size * size * length / volume,
            size,
            normal: turned(normal),
            volume,
            plane_slack: SLACK * size * length,
            rect,
            near: if before { (1.0 + SLACK) / w[0].min(w[1]).min(w[2]) } else { f64::INFINITY },
            place,
            opaque,
            // NaN if the eye is on a corner.
            thin: volume.is_nan() || volume <= THIN * size * size * size,
        })
    }

    /// Whether all of a box is behind a triangle's plane.
    #[inline]
    pub fn is_behind(&self, node: &Node, plane: &Triangle) -> bool {
        let (c, h) = self.middle(node);
        let n = plane.normal;
        let least = dot(n, c) - dot(n.map(f64::abs), h) - plane.volume;
        least > plane.plane_slack * (greatest(c) + greatest(h) + plane.size)
    }
}

impl Triangle {
    /// Whether it may show in a cell.
    #[inline]
    pub fn touches(&self, cell: &Cell) -> bool {
        if !cell.meets(&self.rect) {
            return false;
        }
        if self.thin {
            return true;
        }
        let misses = |k: usize| range(&self.edges[k], cell)[1] <= self.slack[k];
        if misses(0) || misses(1) || misses(2) {
            return false;
        }
        // Behind the eye there are no bounds, so planes through the cell's sides decide.
        let beyond = |k: usize, at: f64, side: f64| self.corners.iter().all(|p| side * (p[k] - at * p[2]) >= 0.0);
        self.near != f64::INFINITY
            || !(beyond(0, cell.u[0], -1.0)
                || beyond(0, cell.u[1], 1.0)
                || beyond(1, cell.v[0], -1.0)
                || beyond(1, cell.v[1], 1.0))
    }

    /// Whether it hides everything behind it in a cell.
    #[inline]
    pub fn covers(&self, cell: &Cell) -> bool {
        let holds = |k: usize| range(&self.edges[k], cell)[0] >= -self.slack[k];
        self.hides() && holds(0) && holds(1) && holds(2)
    }

    /// Whether it is an occluder.
    pub fn hides(&self) -> bool {
        self.opaque && !self.thin
    }

    /// The greatest `1/w` in a cell.
    #[inline]
    pub fn nearest(&self, cell: &Cell) -> f64 {
        if self.thin { self.near } else { self.near.min(range(&self.inverse, cell)[1]) }
    }

    /// The least `1/w` in a cell that it covers.
    pub fn farthest(&self, cell: &Cell) -> f64 {
        range(&self.inverse, cell)[0]
    }

    /// Error of `1/w` at this value.
    #[inline]
    pub fn error_at(&self, inverse: f64) -> f64 {
        self.error * (inverse.abs() + 1.0 / self.size)
    }

    /// Whether all of it is behind another's plane or on it, with at least one corner behind.
    #[inline]
    pub fn is_behind(&self, plane: &Self) -> bool {
        let d = self.corners.map(|p| dot(plane.normal, p) - plane.volume);
        let slack = plane.plane_slack * (self.size + plane.size);
        d.iter().all(|&d| d >= -slack) && d.iter().any(|&d| d > slack)
    }

    /// Bounds of the picture of a thin triangle.
    pub fn outline(&self) -> [f64; 4] {
        self.rect
    }
}
