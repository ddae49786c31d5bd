//! One face of a visibility cube: projection of boxes and triangles.
//!
//! Based on: Olano, Greer, *Triangle scan conversion using 2D homogeneous coordinates*, 1997: the edge functions and 1/w of a triangle are
//! linear over the image even if it extends behind the eye, so nothing is clipped, and an eye may be arbitrarily near to a wall.
//! Deviations: edge functions and 1/w are set up in `f64` from corners relative to the eye and evaluated at the corner of each tile in
//! `f64`; only steps within a tile are `f32`. A common edge gives both triangles functions of opposite sign and equal size, to the last
//! bit, so there are no cracks between them.
//!
//! The coverage of a triangle depends only on the triangle, the eye, the frame and the size. Engines skip different triangles, but only
//! hidden ones: so they agree to the bit, on every machine.

use super::tree::{Block, LANES, Node};
use super::{CubeView, EDGE};

/// Growth of triangles' bounds, pixels: far more than the rounding of edge functions, which decide coverage, and invisibly small.
const MARGIN: f64 = EDGE;
/// The same for boxes, whose bounds are rounded to `f32` and must contain those of triangles.
const BOX_MARGIN: f32 = 0.01;
/// Growth of boxes, as a fraction of their distance: more than the rounding of `f32` in the projection.
const BOX_PAD: f32 = 1e-6;

/// Bound of the rounding error of an edge function within a tile, as a fraction of its steps.
const SLACK: f64 = 1e-4;

/// The first and the last column, the first and the last row.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Rect {
    pub x: [u16; 2],
    pub y: [u16; 2],
}

/// A face as a camera: a point `p` projects to `x / w`, `y / w` in -1 to 1.
pub(super) struct Face {
    /// Unit vectors along x, y and w.
    axes: [[f64; 3]; 3],
    eye: [f64; 3],
    /// The same in `f32`; the eye in two parts.
    near_axes: [[f32; 3]; 3],
    eye_parts: [[f32; 3]; 2],
    /// Pixels along an edge.
    size: f64,
}

/// Eight boxes on a face.
pub(super) struct Boxes {
    /// First and last column, first and last row that a box may touch.
    pub x: [[f32; LANES]; 2],
    pub y: [[f32; LANES]; 2],
    /// Upper bound of 1/w for points of the box on this face.
    pub nearest: [f32; LANES],
    /// Lanes that touch the face, as bits.
    pub seen: u32,
}

/// Eight triangles on a face.
pub(super) struct Triangles {
    /// x, y and w by corner.
    corners: [[[f64; LANES]; 3]; 3],
    x: [[f64; LANES]; 2],
    y: [[f64; LANES]; 2],
    /// Bounds of 1/w.
    nearest: [f64; LANES],
    farthest: [f64; LANES],
    /// Lanes that may cover a pixel, as bits.
    pub seen: u32,
}

/// A triangle ready to be drawn: edge functions (at least 0 inside) and 1/w as `a * column + b * row + c`.
pub(super) struct Drawn {
    a: [f64; 4],
    b: [f64; 4],
    c: [f64; 4],
    /// Bounds of 1/w.
    pub farthest: f32,
    pub nearest: f32,
    pub triangle: u32,
}

#[inline(always)]
fn lesser<T: PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

impl Face {
    pub fn new(view: &CubeView, face: usize) -> Self {
        let [x, y, w] = view.axes(face).map(|a| a.to_array());
        let axes = [x, y, w];
        let eye = view.eye.to_array();
        let high = eye.map(|e| e as f32);
        let low = [0, 1, 2].map(|k| (eye[k] - f64::from(high[k])) as f32);
        let near_axes = axes.map(|axis| axis.map(|a| a as f32));
        Self { axes, eye, near_axes, eye_parts: [high, low], size: f64::from(view.size) }
    }

    /// Projects the children of a node to this face, with bounds of their depth.
    #[inline(always)]
    pub fn boxes(&self, node: &Node, out: &mut Boxes) {
        // Centres and half sizes relative to the eye.
        let (mut middle, mut half) = ([[0.0f32; LANES]; 3], [[0.0f32; LANES]; 3]);
        let mut reach = [0.0f32; LANES];
        for k in 0..3 {
            let [high, low] = [self.eye_parts[0][k], self.eye_parts[1][k]];
            for l in 0..LANES {
                let a = (node.min[k][l] - high) - low;
                let b = (node.max[k][l] - high) - low;
                middle[k][l] = (a + b) * 0.5;
                half[k][l] = (b - a) * 0.5;
                reach[l] += greater(a.abs(), b.abs());
            }
        }
        let (mut from, mut to) = ([[0.0f32; LANES]; 3], [[0.0f32; LANES]; 3]);
        for k in 0..3 {
            let m = self.near_axes[k];
            for l in 0..LANES {
                let c = m[0] * middle[0][l] + m[1] * middle[1][l] + m[2] * middle[2][l];
                let h = m[0].abs() * half[0][l] + m[1].abs() * half[1][l] + m[2].abs() * half[2][l] + BOX_PAD * reach[l];
                from[k][l] = c - h;
                to[k][l] = c + h;
            }
        }
        let scale = self.size as f32 * 0.5;
        let last = self.size as f32 - 1.0;
        let mut seen = [0u32; LANES];
        for l in 0..LANES {
            let (x0, x1, y0, y1) = (from[0][l], to[0][l], from[1][l], to[1][l]);
            let (w0, w1) = (from[2][l], to[2][l]);
            // On the face, |x| and |y| are at most w.
            let near = greater(greater(w0, greater(x0, -x1)), greater(y0, -y1));
            let far = 1.0 / greater(w1, f32::MIN_POSITIVE);
            let nearest = 1.0 / greater(near, f32::MIN_POSITIVE);
            let least = |v: f32| v * if v >= 0.0 { far } else { nearest };
            let most = |v: f32| v * if v >= 0.0 { nearest } else { far };
            let column = |v: f32| (v + 1.0) * scale - 0.5;
            let first = |v: f32| greater((column(v) - BOX_MARGIN).ceil(), 0.0);
            let end = |v: f32| lesser((column(v) + BOX_MARGIN).floor(), last);
            let (c0, c1, r0, r1) = (first(least(x0)), end(most(x1)), first(least(y0)), end(most(y1)));
            out.x[0][l] = c0;
            out.x[1][l] = c1;
            out.y[0][l] = r0;
            out.y[1][l] = r1;
            out.nearest[l] = nearest * (1.0 + 1e-5);
            seen[l] = u32::from((w1 > 0.0) & (near <= w1) & (c0 <= c1) & (r0 <= r1));
        }
        out.seen = bits(&seen);
    }

    /// Projects the triangles of a block to this face.
    #[inline(always)]
    pub fn triangles(&self, block: &Block, out: &mut Triangles) {
        for corner in 0..3 {
            for l in 0..LANES {
                let x = block.corners[corner][0][l] - self.eye[0];
                let y = block.corners[corner][1][l] - self.eye[1];
                let z = block.corners[corner][2][l] - self.eye[2];
                for k in 0..3 {
                    let m = &self.axes[k];
                    out.corners[corner][k][l] = m[0] * x + m[1] * y + m[2] * z;
                }
            }
        }
        let last = self.size - 1.0;
        let mut seen = [0u32; LANES];
        let c = &out.corners;
        for l in 0..LANES {
            let span = |k: usize| {
                let (p, q, r) = (c[0][k][l], c[1][k][l], c[2][k][l]);
                (lesser(p, lesser(q, r)), greater(p, greater(q, r)))
            };
            let ((x0, x1), (y0, y1), (w0, w1)) = (span(0), span(1), span(2));
            let near = greater(greater(w0, greater(x0, -x1)), greater(y0, -y1));
            let before = w0 >= f64::MIN_POSITIVE;
            let inverse = [1.0 / c[0][2][l], 1.0 / c[1][2][l], 1.0 / c[2][2][l]];
            let range = |k: usize, from: f64, to: f64| {
                let (p, q, r) = (c[0][k][l] * inverse[0], c[1][k][l] * inverse[1], c[2][k][l] * inverse[2]);
                // A triangle that extends behind the eye is bounded only on the side that contains all of it.
                let far = if before {
                    lesser(p, lesser(q, r))
                } else if from >= 0.0 {
                    0.0
                } else {
                    -1.0
                };
                let end = if before {
                    greater(p, greater(q, r))
                } else if to <= 0.0 {
                    0.0
                } else {
                    1.0
                };
                let column = |v: f64| (v + 1.0) * (0.5 * self.size) - 0.5;
                (greater((column(far) - MARGIN).ceil(), 0.0), lesser((column(end) + MARGIN).floor(), last))
            };
            let ((c0, c1), (r0, r1)) = (range(0, x0, x1), range(1, y0, y1));
            out.x[0][l] = c0;
            out.x[1][l] = c1;
            out.y[0][l] = r0;
            out.y[1][l] = r1;
            out.nearest[l] = (1.0 + 1e-6) / greater(near, f64::MIN_POSITIVE);
            out.farthest[l] = (1.0 - 1e-6) / greater(w1, f64::MIN_POSITIVE);
            seen[l] = u32::from((w1 > 0.0) & (near <= w1) & (c0 <= c1) & (r0 <= r1) & (l < block.len));
        }
        out.seen = bits(&seen);
    }
}

#[inline(always)]
fn bits(lanes: &[u32; LANES]) -> u32 {
    let mut bits = 0;
    for (l, &lane) in lanes.iter().enumerate() {
        bits |= lane << l;
    }
    bits
}

impl Boxes {
    pub const fn new() -> Self {
        let none = [[0.0; LANES]; 2];
        Self { x: none, y: none, nearest: [0.0; LANES], seen: 0 }
    }

    #[inline(always)]
    pub fn rect(&self, l: usize) -> Rect {
        let to = |v: f32| v as i32 as u16;
        Rect { x: [to(self.x[0][l]), to(self.x[1][l])], y: [to(self.y[0][l]), to(self.y[1][l])] }
    }
}

impl Triangles {
    pub const fn new() -> Self {
        let none = [[0.0; LANES]; 2];
        let corners = [[[0.0; LANES]; 3]; 3];
        Self { corners, x: none, y: none, nearest: [0.0; LANES], farthest: [0.0; LANES], seen: 0 }
    }

    #[inline(always)]
    pub fn rect(&self, l: usize) -> Rect {
        let to = |v: f64| v as i32 as u16;
        Rect { x: [to(self.x[0][l]), to(self.x[1][l])], y: [to(self.y[0][l]), to(self.y[1][l])] }
    }

    /// Upper bound of the triangle's 1/w.
    #[inline(always)]
    pub fn nearest(&self, l: usize) -> f32 {
        self.nearest[l] as f32
    }

    /// The triangle's functions; `None` if it is seen edge-on.
    #[inline(always)]
    pub fn set_up(&self, l: usize, face: &Face, triangle: u32) -> Option<Drawn> {
        let at = |corner: usize| [self.corners[corner][0][l], self.corners[corner][1][l], self.corners[corner][2][l]];
        let (p, q, r) = (at(0), at(1), at(2));
        let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        let normal = cross(minus(q, p), minus(r, p));
        let volume = normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2];
        let (side, inverse) = (volume.signum(), 1.0 / volume);
        let planes = [cross(q, r), cross(r, p), cross(p, q), normal];
        let factors = [side, side, side, inverse];
        // Maps -1 to 1 over the face to columns and rows.
        let (step, start) = (2.0 / face.size, 1.0 / face.size - 1.0);
        let (mut a, mut b, mut c) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        for i in 0..4 {
            let [x, y, w] = planes[i];
            a[i] = x * factors[i] * step;
            b[i] = y * factors[i] * step;
            c[i] = (w + (x + y) * start) * factors[i];
        }
        // Steeper functions mean that the eye is on the triangle.
        let steep = a[3].abs().max(b[3].abs()).max(c[3].abs());
        (steep < 1e30).then_some(Drawn {
            a,
            b,
            c,
            farthest: self.farthest[l] as f32,
            nearest: self.nearest[l] as f32,
            triangle,
        })
    }
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

impl Drawn {
    /// The four functions at a pixel: the corner of a tile.
    #[inline(always)]
    pub fn at(&self, column: f64, row: f64) -> [f32; 4] {
        let mut out = [0.0; 4];
        for (i, out) in out.iter_mut().enumerate() {
            *out = (self.a[i] * column + self.b[i] * row + self.c[i]) as f32;
        }
        out
    }

    /// Calls `visit` for each tile of a rectangle of pixels that the triangle may cover, with its column and row, and its first and last
    /// row of pixels in the rectangle.
    #[inline(always)]
    pub fn tiles(&self, rect: Rect, mut visit: impl FnMut([usize; 2], [usize; 2])) {
        let [x0, x1] = rect.x.map(|x| x as usize / LANES);
        let [y0, y1] = rect.y.map(usize::from);
        let (top, bottom) = (y0 / LANES, y1 / LANES);
        // Per tile: the step of an edge function, and the column of tiles at which it is 0.
        let wide = x1 - x0 >= 2 && bottom > top;
        let (mut edges, mut inverse) = ([[0.0; 3]; 3], [0.0; 3]);
        if wide {
            let end = (LANES - 1) as f64;
            for i in 0..3 {
                let (a, b) = (self.a[i], self.b[i]);
                // The maximum of the function in a tile, plus more than the rounding of `f32`.
                let most = self.c[i] + greater(a, 0.0) * end + greater(b, 0.0) * end + (a.abs() + b.abs()) * SLACK;
                edges[i] = [a * LANES as f64, b * LANES as f64, most];
                inverse[i] = 1.0 / edges[i][0];
            }
        }
        for y in top..=bottom {
            let (mut from, mut to) = (x0 as f64, x1 as f64);
            if wide {
                for i in 0..3 {
                    let at = edges[i][1] * y as f64 + edges[i][2];
                    let zero = -at * inverse[i];
                    if edges[i][0] > 0.0 {
                        from = greater(zero.ceil(), from);
                    } else if edges[i][0] < 0.0 {
                        to = lesser(zero.floor(), to);
                    } else if at < 0.0 {
                        to = -1.0;
                    }
                }
            }
            let rows = [y0.saturating_sub(y * LANES), (y1 - y * LANES).min(LANES - 1)];
            let (mut x, to) = (from as i32, to as i32);
            while x <= to {
                visit([x as usize, y], rows);
                x += 1;
            }
        }
    }

    /// Their steps from column to column and from row to row.
    #[inline(always)]
    pub fn steps(&self) -> ([f32; 4], [f32; 4]) {
        (self.a.map(|a| a as f32), self.b.map(|b| b as f32))
    }
}
