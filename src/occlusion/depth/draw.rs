//! Triangles into the depth buffer.
//!
//! Each edge is a plane through the eye. Two triangles that share it have planes of opposite sign and equal size, to the last bit, so
//! no pixel falls through between them; a pixel too near to an edge for `f32` is decided in `f64`.

use super::closed::Outside;
use super::{COUNT, DepthBuffer, Lanes, PIXELS, Plane, SIDE, Tile, UNTOUCHED, max, min};
use crate::occlusion::pixels::{Form, Rays};
use crate::simd::Vectorize;
use glam::DVec3;
use std::ops::Range;

/// Pixels are this near to an edge where `f32` might not know the side: more than it is off by within a tile, 1e-5 at most. Larger: more
/// pixels are looked at twice.
const NEAR_EDGE: f32 = 2e-5;

/// Tiles in a row up to which the edges aren't asked where they cross it.
const FEW: usize = 3;

/// Triangles yet to be drawn.
pub(super) struct Draw<'a, 's> {
    pub buffer: &'a mut DepthBuffer<'s>,
    pub triangles: Range<u32>,
    /// Only those that show this side.
    pub front: Option<Outside>,
}

impl Vectorize for Draw<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let eye = self.buffer.rays.view.eye;
        for t in self.triangles {
            let [a, b, c] = self.buffer.scene.corners(t as usize);
            triangle(self.buffer, [a - eye, b - eye, c - eye], self.front);
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
fn triangle(buffer: &mut DepthBuffer<'_>, corners: [DVec3; 3], front: Option<Outside>) {
    let rays = &buffer.rays;
    let [a, b, c] = corners;
    let normal = (b - a).cross(c - a);
    // Six times the volume of the tetrahedron with the eye: of either sign where both sides are drawn.
    let volume = normal.dot(a);
    if volume == 0.0 || front.is_some_and(|front| !front.faces_eye(volume)) {
        return;
    }
    let Some(pixels) = extent(rays, corners) else { return };
    let edge = |n: DVec3| {
        let form = rays.form(n);
        form.scaled(volume.signum() / (form.x.abs() + form.y.abs()).max(f64::MIN_POSITIVE))
    };
    let edges = [edge(a.cross(b)), edge(b.cross(c)), edge(c.cross(a))];
    let w = [rays.view.w.dot(a), rays.view.w.dot(b), rays.view.w.dot(c)];
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
        // Of few tiles each is asked by itself.
        let [first, last] = if columns[1] - columns[0] < FEW { columns } else { drawn.span(columns, y) };
        for x in first..=last {
            let index = y * buffer.across[0] + x;
            if drawn.range[0] > buffer.farthest[index] {
                drawn.tile(buffer, [x, y], pixels[1]);
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
    let w = [rays.view.w.dot(corners[0]), rays.view.w.dot(corners[1]), rays.view.w.dot(corners[2])];
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

    /// Draws the part in a tile, in the rows of pixels given.
    #[inline(always)]
    fn tile(&self, buffer: &mut DepthBuffer<'_>, [tile_x, tile_y]: [usize; 2], rows: [usize; 2]) {
        let [x, y] = [tile_x * SIDE, tile_y * SIDE];
        let at = [self.edges[0].value(x, y), self.edges[1].value(x, y), self.edges[2].value(x, y)];
        let (mut outside, mut whole) = (false, true);
        for (at, edge) in at.iter().zip(&self.edges) {
            // Where rounding might turn a sign, pixels decide.
            outside |= at + edge.rise(SIDE) < -f64::from(NEAR_EDGE);
            whole &= at + edge.fall(SIDE) > f64::from(NEAR_EDGE);
        }
        if outside {
            return;
        }
        let index = tile_y * buffer.across[0] + tile_x;
        let farthest = buffer.farthest[index];
        let ([base, dx, dy], error) = self.depth.in_square(x, y, SIDE);
        let most = f64::from(base) + self.depth.rise(SIDE) + error;
        if most < f64::from(farthest) {
            return;
        }
        // The true depth is at most twice the error above; the rest is for this number's own rounding.
        let near = (self.near * (1.0 - 1e-6) - 3.0 * error) as f32;
        let plane = Plane { at: (f64::from(base) - error) as f32, x: dx, y: dy, floor: self.range[1] };
        let [width, height] = buffer.rays.size;
        if whole && most < f64::from(near) && x + SIDE <= width && y + SIDE <= height {
            // 1. All of it: often no pixel need be looked at.
            let new = plane.corners();
            let old = buffer.planes[index];
            let nothing_there = farthest == UNTOUCHED;
            if nothing_there || !old.at.is_nan() {
                let old = old.corners();
                // Linear functions: what is nearer in all corners is so everywhere, and where rounding says otherwise, farther by that.
                if nothing_there || (0..4).all(|k| new[k] >= old[k]) {
                    buffer.planes[index] = plane;
                    buffer.set_farthest([tile_x, tile_y], new[0].min(new[1]).min(new[2].min(new[3])));
                    return;
                }
                if (0..4).all(|k| new[k] <= old[k]) {
                    return;
                }
            }
        }
        // 2. Pixels.
        if farthest == UNTOUCHED {
            buffer.planes[index] = Plane::NONE;
            clear(&mut buffer.tiles[index], [x, y], [width, height]);
        }
        buffer.unfold(index);
        let tile = &mut buffer.tiles[index];
        let rows = [rows[0].max(y) - y, rows[1].min(y + SIDE - 1) - y];
        let edges = [0, 1, 2].map(|k| [at[k] as f32, self.edges[k].x as f32, self.edges[k].y as f32]);
        if whole {
            fill::<false>(tile, rows, &plane, &edges, near);
        } else if fill::<true>(tile, rows, &plane, &edges, near) <= NEAR_EDGE {
            self.settle(tile, [x, y], &plane, &edges, near);
        }
        let least = tile.0.chunks_exact(SIDE).fold([f32::INFINITY; SIDE], |least, row| {
            std::array::from_fn(|k| if row[k] < least[k] { row[k] } else { least[k] })
        });
        buffer.set_farthest([tile_x, tile_y], least.into_iter().fold(f32::INFINITY, f32::min));
    }

    /// Draws the pixels of a tile that `f32` couldn't decide.
    #[cold]
    fn settle(&self, tile: &mut Tile, [x, y]: [usize; 2], plane: &Plane, edges: &[[f32; 3]; 3], near: f32) {
        for p in 0..PIXELS {
            let (row, column) = (p / SIDE, p % SIDE);
            let [a, b, c] = edges.map(|[at, x, y]| (at + y * COUNT[row]) + x * COUNT[column]);
            let inside = || self.edges.iter().all(|e| e.value(x + column, y + row) >= 0.0);
            let depth = (plane.at + plane.y * COUNT[row]) + plane.x * COUNT[column];
            if a.min(b).min(c).abs() <= NEAR_EDGE && depth <= near && inside() {
                tile.0[p] = tile.0[p].max(depth.max(plane.floor));
            }
        }
    }
}

/// Draws the pixels of some rows of a tile that are inside for certain. Returns how near the middle of one came to an edge.
#[inline(always)]
fn fill<const EDGES: bool>(
    tile: &mut Tile,
    [first, last]: [usize; 2],
    plane: &Plane,
    edges: &[[f32; 3]; 3],
    near: f32,
) -> f32 {
    let forms = [[plane.at, plane.x, plane.y], edges[0], edges[1], edges[2]];
    let steps: [Lanes; 4] = forms.map(|[_, x, _]| COUNT.map(|count| x * count));
    let mut nearest_edge = [f32::INFINITY; SIDE];
    for (pixels, y) in tile.0.chunks_exact_mut(SIDE).zip(COUNT).take(last + 1).skip(first) {
        let starts = forms.map(|[at, _, by]| at + by * y);
        for k in 0..SIDE {
            let depth = starts[0] + steps[0][k];
            let mut wins = near >= depth;
            if EDGES {
                let [a, b, c] = [starts[1] + steps[1][k], starts[2] + steps[2][k], starts[3] + steps[3][k]];
                let inside = min(min(a, b), c);
                wins &= inside > NEAR_EDGE;
                nearest_edge[k] = min(nearest_edge[k], inside.abs());
            }
            let new = if wins { max(depth, plane.floor) } else { 0.0 };
            pixels[k] = max(new, pixels[k]);
        }
    }
    if EDGES { nearest_edge.into_iter().fold(f32::INFINITY, min) } else { f32::INFINITY }
}
