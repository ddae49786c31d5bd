//! Draws a triangle into a tile pixel by pixel, if it does not cover the tile or is not in front of everything there.
//!
//! A pixel too near to an edge for `f32` is decided in `f64`.

use super::draw::Drawn;
use super::lanes::{COUNT, F32x8, Lanes, Mask8, SIDE};
use super::{DepthBuffer, Index, Plane, Tile, UNTOUCHED};

/// Distance from an edge within which `f32` may not decide the side: more than its error within a tile, at most 1e-5. Larger: more pixels
/// are tested twice.
const NEAR_EDGE: f32 = 2e-5;

/// Empties a tile; pixels outside the picture count as covered.
#[inline(always)]
fn clear(tile: &mut Tile, corner: [usize; 2], size: [usize; 2]) {
    let [columns, rows] = [size[0] - corner[0], size[1] - corner[1]];
    if columns.min(rows) >= SIDE {
        *tile = Tile([[0.0; SIDE]; SIDE]);
        return;
    }
    for (row, pixels) in tile.0.iter_mut().enumerate() {
        for (column, pixel) in pixels.iter_mut().enumerate() {
            *pixel = if row < rows && column < columns { 0.0 } else { f32::INFINITY };
        }
    }
}

impl Drawn {
    /// Draws the part in a tile.
    #[inline(always)]
    pub fn tile(&self, buffer: &mut DepthBuffer<'_>, [tile_x, tile_y]: [usize; 2], index: Index) {
        let [x, y] = [tile_x * SIDE, tile_y * SIDE];
        let at = [self.edges[0].value(x, y), self.edges[1].value(x, y), self.edges[2].value(x, y)];
        let (mut outside, mut whole) = (false, true);
        for (at, edge) in at.iter().zip(&self.edges) {
            // If rounding might change a sign, pixels decide.
            outside |= at + edge.rise(SIDE) < -f64::from(NEAR_EDGE);
            whole &= at + edge.fall(SIDE) > f64::from(NEAR_EDGE);
        }
        if outside {
            return;
        }
        let farthest = buffer.farthest(index);
        let (base, error) = self.depth.within(x, y, SIDE);
        let most = base + self.depth.rise(SIDE) + error;
        if most < f64::from(farthest) {
            return;
        }
        // The true depth is at most twice the error above; the rest covers this number's own rounding.
        let near = (self.near * (1.0 - 1e-6) - 3.0 * error) as f32;
        let plane =
            Plane { at: (base - error) as f32, x: self.depth.x as f32, y: self.depth.y as f32, floor: self.range[1] };
        if farthest == UNTOUCHED {
            buffer.planes[index.row].at[index.column] = f32::NAN;
            clear(&mut buffer.tiles[index.tile()], [x, y], buffer.rays.size);
        }
        buffer.unfold(index);
        let tile = &mut buffer.tiles[index.tile()];
        let [first, last] = self.pixels[1];
        let rows = [first.max(y) - y, last.min(y + SIDE - 1) - y];
        let edge = |k: usize| [at[k] as f32, self.edges[k].x as f32, self.edges[k].y as f32];
        let edges = [edge(0), edge(1), edge(2)];
        // Few tiles are as near as the near plane.
        let nearest_edge = match (whole, most < f64::from(near)) {
            (true, true) => fill::<false, false>(tile, rows, &plane, &edges, near),
            (true, false) => fill::<false, true>(tile, rows, &plane, &edges, near),
            (false, true) => fill::<true, false>(tile, rows, &plane, &edges, near),
            (false, false) => fill::<true, true>(tile, rows, &plane, &edges, near),
        };
        if nearest_edge <= NEAR_EDGE {
            self.settle(tile, [x, y], &plane, &edges, near);
        }
        let mut farthest = F32x8::INFINITY;
        for row in &tile.0 {
            farthest = farthest.min(F32x8::load(row));
        }
        buffer.set_farthest(index, farthest.least());
    }

    /// Draws the pixels of a tile that `f32` could not decide.
    #[cold]
    fn settle(&self, tile: &mut Tile, [x, y]: [usize; 2], plane: &Plane, edges: &[[f32; 3]; 3], near: f32) {
        for p in 0..SIDE * SIDE {
            let (row, column) = (p / SIDE, p % SIDE);
            let [a, b, c] = edges.map(|[at, x, y]| (at + y * COUNT[row]) + x * COUNT[column]);
            let inside = || self.edges.iter().all(|e| e.value(x + column, y + row) >= 0.0);
            let depth = (plane.at + plane.y * COUNT[row]) + plane.x * COUNT[column];
            if a.min(b).min(c).abs() <= NEAR_EDGE && depth <= near && inside() {
                let pixel = &mut tile.0[row][column];
                *pixel = pixel.max(depth.max(plane.floor));
            }
        }
    }
}

/// A linear function over a tile: its values along the first column, and its steps to the other columns.
struct Rows {
    starts: Lanes,
    steps: F32x8,
}

impl Rows {
    #[inline(always)]
    fn new([at, x, y]: [f32; 3]) -> Self {
        let mut starts = [0.0; SIDE];
        (F32x8::splat(at) + F32x8::COUNT * y).store(&mut starts);
        Self { starts, steps: F32x8::COUNT * x }
    }

    #[inline(always)]
    fn row(&self, row: usize) -> F32x8 {
        F32x8::splat(self.starts[row]) + self.steps
    }
}

/// Draws the pixels of some rows of a tile that are certainly inside. Returns the least distance of a pixel centre from an edge.
#[inline(always)]
fn fill<const EDGES: bool, const NEAR: bool>(
    tile: &mut Tile,
    [first, last]: [usize; 2],
    plane: &Plane,
    edges: &[[f32; 3]; 3],
    near: f32,
) -> f32 {
    let depths = Rows::new([plane.at, plane.x, plane.y]);
    let (a, b, c) = (Rows::new(edges[0]), Rows::new(edges[1]), Rows::new(edges[2]));
    let (floor, near, near_edge) = (F32x8::splat(plane.floor), F32x8::splat(near), F32x8::splat(NEAR_EDGE));
    let mut nearest_edge = F32x8::INFINITY;
    for row in first..(last + 1).min(SIDE) {
        let depth = depths.row(row);
        let mut wins = if NEAR { near.at_least(depth) } else { Mask8::ALL };
        if EDGES {
            let inside = a.row(row).min(b.row(row)).min(c.row(row));
            wins = wins & near_edge.less(inside);
            nearest_edge = nearest_edge.min(inside.abs());
        }
        let old = F32x8::load(&tile.0[row]);
        wins.choose(depth.max(floor).max(old), old).store(&mut tile.0[row]);
    }
    nearest_edge.least()
}
