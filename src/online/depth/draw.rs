//! Triangles into the depth buffer.
//!
//! Each edge is a plane through the eye. Two triangles that share it have planes of opposite sign and equal size, to the last bit, so
//! no pixel falls through between them; a pixel too near to an edge for `f32` is decided in `f64`.

use super::{DepthBuffer, Form, PIXELS, Rays, SIDE, Tile, UNTOUCHED, lanes};
use glam::DVec3;
use std::ops::Range;

/// Pixels are this near to an edge where `f32` might not know the side: more than it is off by within a tile, 1e-5 at most. Larger: more
/// pixels are looked at twice.
const NEAR_EDGE: f32 = 2e-5;

/// Triangles yet to be drawn.
pub(super) struct Draw<'a, 's> {
    pub buffer: &'a mut DepthBuffer<'s>,
    pub triangles: Range<u32>,
}

impl pulp::WithSimd for Draw<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let eye = self.buffer.rays.view.eye;
        for t in self.triangles {
            let corners = self.buffer.scene.corners(t as usize).map(|p| p - eye);
            triangle(self.buffer, corners);
        }
    }
}

/// What is needed in each tile.
struct Drawn {
    /// Not below 0 inside; a unit is about a pixel's size from the edge.
    edges: [Form; 3],
    depth: Form,
    /// The depths of the nearest and the farthest corner.
    range: [f32; 2],
    /// What is nearer isn't drawn.
    near: f64,
}

/// Draws a triangle, its corners relative to the eye.
#[inline(always)]
fn triangle(buffer: &mut DepthBuffer<'_>, corners: [DVec3; 3]) {
    let rays = &buffer.rays;
    let Some(pixels) = extent(rays, corners) else { return };
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    let planes = [a.cross(b), b.cross(c), c.cross(a)];
    // Six times the volume of the tetrahedron with the eye: of either sign, since both sides are drawn.
    let volume = normal.dot(a);
    if volume == 0.0 {
        return;
    }
    let edges = planes.map(|n| {
        let form = rays.form(n);
        form.scaled(volume.signum() / (form.x.abs() + form.y.abs()).max(f64::MIN_POSITIVE))
    });
    let w = corners.map(|v| rays.view.w.dot(v));
    let least = w[0].min(w[1]).min(w[2]);
    let near = 1.0 / rays.view.near;
    let nearest = if least > rays.view.near { 1.0 / least } else { near };
    let drawn = Drawn {
        edges,
        depth: rays.form(normal * (1.0 / volume)),
        // Rounded by less than this factor.
        range: [nearest as f32, if least > 0.0 { (1.0 / w[0].max(w[1]).max(w[2])) as f32 * (1.0 - 1e-6) } else { 0.0 }],
        near,
    };
    let [columns, rows] = pixels.map(|[first, last]| [first / SIDE, last / SIDE]);
    for y in rows[0]..=rows[1] {
        let [first, last] = drawn.span(columns, y);
        for x in first..=last {
            let index = y * buffer.across[0] + x;
            // A tile's depth isn't read before it is touched: it may be of an earlier frame.
            let (tile, farthest) = (&mut buffer.tiles[index], &mut buffer.farthest[index]);
            if drawn.range[0] <= *farthest {
                continue;
            }
            if *farthest == UNTOUCHED {
                clear(tile, [x * SIDE, y * SIDE], buffer.rays.size);
            }
            if let Some(new) = drawn.tile(tile, x * SIDE, y * SIDE) {
                *farthest = new;
                buffer.blocks[y / SIDE * buffer.across[1] + x / SIDE] = None;
            }
        }
    }
}

/// Nothing is drawn; what is beyond the picture is as if it were covered.
#[inline(always)]
fn clear(tile: &mut Tile, corner: [usize; 2], size: [usize; 2]) {
    let [columns, rows] = [size[0] - corner[0], size[1] - corner[1]];
    for (row, pixels) in tile.0.chunks_exact_mut(SIDE).enumerate() {
        for (column, pixel) in pixels.iter_mut().enumerate() {
            *pixel = if row < rows && column < columns { 0.0 } else { f32::INFINITY };
        }
    }
}

/// The pixels that a triangle may cover, first and last by axis.
#[inline(always)]
fn extent(rays: &Rays, corners: [DVec3; 3]) -> Option<[[usize; 2]; 2]> {
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    let mut grow = |v: DVec3| {
        let p = rays.project(v);
        for k in 0..2 {
            min[k] = min[k].min(p[k]);
            max[k] = max[k].max(p[k]);
        }
    };
    // What is nearer than the near plane isn't drawn; half of that is a safe place to cut.
    let near = rays.view.near * 0.5;
    let w = corners.map(|v| rays.view.w.dot(v));
    for i in 0..3 {
        let j = (i + 1) % 3;
        if w[i] >= near {
            grow(corners[i]);
        }
        if (w[i] >= near) != (w[j] >= near) {
            grow(corners[i] + (corners[j] - corners[i]) * ((near - w[i]) / (w[j] - w[i])));
        }
    }
    rays.pixels(min, max)
}

impl Drawn {
    /// Of some tiles in a row, the first and the last that the edges leave.
    #[inline(always)]
    fn span(&self, columns: [usize; 2], y: usize) -> [usize; 2] {
        let side = SIDE as f64;
        let [mut first, mut last] = columns.map(|c| c as f64);
        for edge in &self.edges {
            // The most in the tile of column 0; from there it changes by this much a tile. One tile more for rounding.
            let at = edge.value(0, y * SIDE) + edge.rise(SIDE);
            let zero = -at / (edge.x * side);
            if edge.x > 0.0 {
                first = first.max((zero - 1.0).floor());
            } else if edge.x < 0.0 {
                last = last.min((zero + 1.0).ceil());
            } else if at < 0.0 {
                return [1, 0];
            }
        }
        if first <= last { [first as usize, last as usize] } else { [1, 0] }
    }

    /// Draws the part in the tile at pixel `x`, `y`. Returns the tile's farthest depth, `None` where nothing was drawn.
    #[inline(always)]
    fn tile(&self, tile: &mut Tile, x: usize, y: usize) -> Option<f32> {
        let at = self.edges.map(|e| e.value(x, y));
        let (mut outside, mut whole) = (false, true);
        for (at, edge) in at.iter().zip(&self.edges) {
            // Where rounding might turn a sign, pixels decide.
            outside |= at + edge.rise(SIDE) < -f64::from(NEAR_EDGE);
            whole &= at + edge.fall(SIDE) > f64::from(NEAR_EDGE);
        }
        if outside {
            return None;
        }
        let ([base, dx, dy], error) = self.depth.in_tile(x, y);
        let depth = [(f64::from(base) - error) as f32, dx, dy];
        // The true depth is at most twice the error above; the rest is for this number's own rounding.
        let near = (self.near * (1.0 - 1e-6) - 3.0 * error) as f32;
        let depths = |row: usize| lanes(depth, row).map(|d| d.max(self.range[1]));
        if whole {
            for row in 0..SIDE {
                let new = depths(row);
                for (pixel, new) in tile.0[row * SIDE..][..SIDE].iter_mut().zip(new) {
                    *pixel = pixel.max(if new <= near { new } else { 0.0 });
                }
            }
        } else {
            let edges: [[f32; 3]; 3] =
                std::array::from_fn(|e| [at[e] as f32, self.edges[e].x as f32, self.edges[e].y as f32]);
            let mut unsure = [false; SIDE];
            for row in 0..SIDE {
                let new = depths(row);
                let [a, b, c] = edges.map(|e| lanes(e, row));
                for (i, pixel) in tile.0[row * SIDE..][..SIDE].iter_mut().enumerate() {
                    let inside = a[i].min(b[i]).min(c[i]);
                    unsure[i] |= inside.abs() <= NEAR_EDGE;
                    *pixel = pixel.max(if (inside > NEAR_EDGE) & (new[i] <= near) { new[i] } else { 0.0 });
                }
            }
            if unsure.contains(&true) {
                self.settle(tile, x, y, edges, near, depths);
            }
        }
        Some(tile.0.iter().copied().fold(f32::INFINITY, f32::min))
    }

    /// Draws the pixels of a tile that `f32` couldn't decide.
    #[cold]
    fn settle(
        &self,
        tile: &mut Tile,
        x: usize,
        y: usize,
        edges: [[f32; 3]; 3],
        near: f32,
        depths: impl Fn(usize) -> [f32; SIDE],
    ) {
        for p in 0..PIXELS {
            let (row, column) = (p / SIDE, p % SIDE);
            let [a, b, c] = edges.map(|e| lanes(e, row)[column]);
            let new = depths(row)[column];
            let inside = || self.edges.iter().all(|e| e.value(x + column, y + row) >= 0.0);
            if a.min(b).min(c).abs() <= NEAR_EDGE && new <= near && inside() {
                tile.0[p] = tile.0[p].max(new);
            }
        }
    }
}
