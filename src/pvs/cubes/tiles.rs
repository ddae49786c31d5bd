//! A face's pixels in tiles of eight by eight, with the farthest depth of each tile.
//!
//! Based on: Greene, Kass, Miller, *Hierarchical Z-buffer visibility*, 1993 (here with two levels, pixels and tiles), and Hasselgren,
//! Andersson, Akenine-Moeller, *Masked software occlusion culling*, 2016 (tiles processed one row of lanes at a time). Depth is 1/w; 0 is
//! empty. Of two triangles at the same depth, the one with the lesser index is in front, so that the result does not depend on the order of
//! drawing.

use super::NONE;
use super::face::{Drawn, Rect};
use super::tree::LANES;
use pulp::Simd;

const PIXELS: usize = LANES * LANES;
const COUNT: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// A tile's pixels, row by row.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Tile {
    pub depth: [f32; PIXELS],
    pub triangle: [u32; PIXELS],
}

impl Tile {
    pub const EMPTY: Self = Self { depth: [0.0; PIXELS], triangle: [NONE; PIXELS] };

    /// Draws the part of a triangle in some rows of this tile; `at` are its functions at the tile's corner. Returns the farthest depth, or
    /// `None` if certainly nothing changed.
    #[inline(always)]
    pub fn draw<S: Simd>(&mut self, simd: S, drawn: &Drawn, at: [f32; 4], farthest: f32, rows: [usize; 2]) -> Option<f32> {
        let (a, b) = drawn.steps();
        // Rounding is monotone: the values of all pixels are within those of the corner pixels, as rounded.
        let end = (LANES - 1) as f32;
        let corner = |i: usize, right: bool, low: bool| {
            (at[i] + if low { b[i] * end } else { 0.0 }) + if right { a[i] * end } else { 0.0 }
        };
        let most = [
            corner(0, a[0] > 0.0, b[0] > 0.0),
            corner(1, a[1] > 0.0, b[1] > 0.0),
            corner(2, a[2] > 0.0, b[2] > 0.0),
            corner(3, a[3] > 0.0, b[3] > 0.0),
        ];
        let inside = |of: [f32; 4]| (of[0] >= 0.0) & (of[1] >= 0.0) & (of[2] >= 0.0);
        let nearest = if most[3] > drawn.farthest { most[3] } else { drawn.farthest };
        if !inside(most) || nearest < farthest {
            return None;
        }
        if inside([
            corner(0, a[0] < 0.0, b[0] < 0.0),
            corner(1, a[1] < 0.0, b[1] < 0.0),
            corner(2, a[2] < 0.0, b[2] < 0.0),
            0.0,
        ]) {
            Some(self.fill::<S, false>(simd, drawn, at, a, b, rows))
        } else {
            Some(self.fill::<S, true>(simd, drawn, at, a, b, rows))
        }
    }

    #[inline(always)]
    fn fill<S: Simd, const EDGES: bool>(
        &mut self,
        simd: S,
        drawn: &Drawn,
        at: [f32; 4],
        a: [f32; 4],
        b: [f32; 4],
        rows: [usize; 2],
    ) -> f32 {
        // The functions at the start of each row, and the steps from there.
        let (mut starts, mut steps) = ([[0.0f32; LANES]; 4], [[0.0f32; LANES]; 4]);
        for i in 0..4 {
            let (at, a, b) = (simd.splat_f32s(at[i]), simd.splat_f32s(a[i]), simd.splat_f32s(b[i]));
            let (starts, steps) = (S::as_mut_simd_f32s(&mut starts[i]).0, S::as_mut_simd_f32s(&mut steps[i]).0);
            for ((start, step), &count) in starts.iter_mut().zip(steps).zip(S::as_simd_f32s(&COUNT).0) {
                *start = simd.add_f32s(at, simd.mul_f32s(b, count));
                *step = simd.mul_f32s(a, count);
            }
        }
        let of = |i: usize| S::as_simd_f32s(&steps[i]).0;
        let steps = [of(0), of(1), of(2), of(3)];
        let (zero, nearest) = (simd.splat_f32s(0.0), simd.splat_f32s(drawn.nearest));
        let farthest = simd.splat_f32s(drawn.farthest);
        let (new, none) = (simd.splat_u32s(drawn.triangle), simd.splat_u32s(0));
        let mut least = simd.splat_f32s(f32::INFINITY);
        for row in rows[0]..=rows[1] {
            let row = row % LANES;
            let of = |i: usize| simd.splat_f32s(starts[i][row]);
            let start = [of(0), of(1), of(2), of(3)];
            let pixels = row * LANES..(row + 1) * LANES;
            let depths = S::as_mut_simd_f32s(&mut self.depth[pixels.clone()]).0;
            let triangles = S::as_mut_simd_u32s(&mut self.triangle[pixels]).0;
            for (v, (depth, triangle)) in depths.iter_mut().zip(triangles).enumerate() {
                let value = |i: usize| simd.add_f32s(start[i], steps[i][v]);
                let z = simd.min_f32s(simd.max_f32s(value(3), farthest), nearest);
                let level = simd.and_m32s(simd.equal_f32s(z, *depth), simd.less_than_u32s(new, *triangle));
                let mut wins = simd.or_m32s(simd.greater_than_f32s(z, *depth), level);
                if EDGES {
                    let least = simd.min_f32s(simd.min_f32s(value(0), value(1)), value(2));
                    wins = simd.and_m32s(wins, simd.greater_than_or_equal_f32s(least, zero));
                }
                // By arithmetic: a select becomes a masked store, which is very slow on some machines.
                *depth = simd.max_f32s(simd.select_f32s(wins, z, zero), *depth);
                least = simd.min_f32s(least, *depth);
                let change = simd.select_u32s(wins, simd.xor_u32s(new, *triangle), none);
                *triangle = simd.xor_u32s(*triangle, change);
            }
        }
        let above = self.depth[..rows[0] * LANES].chunks_exact(LANES);
        for row in above.chain(self.depth[(rows[1] + 1) * LANES..].chunks_exact(LANES)) {
            for &depth in S::as_simd_f32s(row).0 {
                least = simd.min_f32s(least, depth);
            }
        }
        simd.reduce_min_f32s(least)
    }
}

/// A face's tiles.
#[derive(Default)]
pub(super) struct Tiles {
    /// Row by row.
    pub tiles: Vec<Tile>,
    /// Depth of the farthest pixel of each.
    pub farthest: Vec<f32>,
    /// Tiles along an edge.
    pub across: usize,
}

impl Tiles {
    /// Empties a face of `size` pixels along an edge. Pixels of tiles beyond the face get the nearest depth, so that they do not affect a
    /// tile's farthest depth.
    pub fn clear(&mut self, size: usize) {
        self.across = size.div_ceil(LANES);
        let count = self.across * self.across;
        self.tiles.clear();
        self.tiles.resize(count, Tile::EMPTY);
        self.farthest.clear();
        self.farthest.resize(count, 0.0);
        let used = size - (self.across - 1) * LANES;
        if used < LANES {
            for i in 0..self.across {
                let (right, bottom) = (i * self.across + self.across - 1, count - 1 - i);
                for p in (0..PIXELS).filter(|p| p % LANES >= used) {
                    self.tiles[right].depth[p] = f32::INFINITY;
                }
                self.tiles[bottom].depth[used * LANES..].fill(f32::INFINITY);
            }
        }
    }

    /// True if all pixels of a rectangle are nearer than `nearest`.
    #[inline(always)]
    pub fn hides(&self, rect: Rect, nearest: f32) -> bool {
        let [x0, x1] = rect.x.map(|x| x as usize / LANES);
        let [y0, y1] = rect.y.map(|y| y as usize / LANES);
        (y0..=y1).all(|y| self.farthest[y * self.across + x0..=y * self.across + x1].iter().all(|&far| far > nearest))
    }

    /// Copies triangles row by row; `out` is the face.
    pub fn copy_to(&self, size: usize, out: &mut [u32]) {
        for (y, row) in out.chunks_exact_mut(size).enumerate() {
            let from = &self.tiles[y / LANES * self.across..];
            for (tile, pixels) in from.iter().zip(row.chunks_mut(LANES)) {
                pixels.copy_from_slice(&tile.triangle[y % LANES * LANES..][..pixels.len()]);
            }
        }
    }
}
