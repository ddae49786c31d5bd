//! Triangles of many tiles: block by block, and in a block eight tiles at a time. A tile that a triangle covers, nearer all over than what
//! is there, takes its plane, and no pixel is looked at; tiles left over go to `tile.rs`.

use super::draw::Drawn;
use super::{BLOCK, COUNT, DepthBuffer, Index, Lanes, SIDE, UNTOUCHED, chosen, max, min, ones};
use crate::occlusion::pixels::FORM_ERROR;

/// Of tiles with a corner this near to an edge, pixels; pixels decide: more than a distance of up to 1,000 pixels is off by in `f32`.
/// Larger: more tiles are looked at pixel by pixel.
const MARGIN: f64 = 1e-3;
/// From a tile's first pixel to its last.
const LAST: f32 = (SIDE - 1) as f32;

/// What is needed in each block; arrays are along a row of tiles.
struct Steps {
    /// What each edge changes by.
    edges: [Lanes; 3],
    /// What is added to an edge's value at the first pixel of a tile, for the greatest and the least in it.
    rises: [f32; 3],
    falls: [f32; 3],
    /// Of each edge, the most and the least in the first block; widened.
    blocks: [[f64; 2]; 3],
    depth: [f64; SIDE],
    /// The most that depths change within a tile.
    spread: f64,
    /// Of the planes.
    slope: [f32; 2],
}

impl Drawn {
    /// Draws it into all blocks that it may be in.
    #[inline(always)]
    pub fn blocks(&self, buffer: &mut DepthBuffer<'_>) {
        let mut steps = Steps {
            edges: [[0.0; SIDE]; 3],
            rises: [0.0; 3],
            falls: [0.0; 3],
            blocks: self.edges.map(|e| [e.at + e.rise(BLOCK) + MARGIN, e.at + e.fall(BLOCK) - MARGIN]),
            depth: [0.0; SIDE],
            spread: (self.depth.x.abs() + self.depth.y.abs()) * SIDE as f64,
            slope: [self.depth.x as f32, self.depth.y as f32],
        };
        for k in 0..SIDE {
            for (edge, form) in steps.edges.iter_mut().zip(&self.edges) {
                edge[k] = (form.x * (k * SIDE) as f64) as f32;
            }
            steps.depth[k] = self.depth.x * (k * SIDE) as f64;
        }
        for (k, form) in self.edges.iter().enumerate() {
            steps.rises[k] = (form.rise(SIDE) + MARGIN) as f32;
            steps.falls[k] = (form.fall(SIDE) - MARGIN) as f32;
        }
        let [columns, rows] = self.pixels.map(|[first, last]| [first / BLOCK, last / BLOCK]);
        for y in rows[0]..=rows[1] {
            for x in columns[0]..=columns[1] {
                self.block(buffer, &steps, [x, y]);
            }
        }
    }

    #[inline(always)]
    fn block(&self, buffer: &mut DepthBuffer<'_>, steps: &Steps, [block_x, block_y]: [usize; 2]) {
        let [x, y] = [block_x * BLOCK, block_y * BLOCK];
        let mut whole = true;
        for (edge, [most, least]) in self.edges.iter().zip(&steps.blocks) {
            let at = edge.x * x as f64 + edge.y * y as f64;
            if at < -most {
                return;
            }
            whole &= at > -least;
        }
        let index = block_y * buffer.across + block_x;
        let (at, error) = self.depth.within(x, y, BLOCK);
        let most = at + self.depth.rise(BLOCK) + error;
        if most.min(f64::from(self.range[0])) <= f64::from(buffer.block(index)) {
            return;
        }
        // Nothing of it in this block is as near as the near plane.
        let is_beyond = most < self.near * (1.0 - 1e-6) - 3.0 * error;
        let within = |[first, last]: [usize; 2], start: usize| {
            [first.max(start) - start, last.min(start + BLOCK - 1) - start].map(|p| p / SIDE)
        };
        let (columns, rows) = (within(self.pixels[0], x), within(self.pixels[1], y));
        let of_columns = (2 << columns[1]) - (1 << columns[0]);
        for row in rows[0]..=rows[1] {
            let of = index * SIDE + row;
            let mut left = of_columns;
            if is_beyond && y + (row + 1) * SIDE <= buffer.rays.size[1] {
                let corner = [x, y + row * SIDE];
                left &= match whole {
                    true => self.row::<false>(buffer, steps, corner, of),
                    false => self.row::<true>(buffer, steps, corner, of),
                };
            }
            while left != 0 {
                let column = left.trailing_zeros() as usize;
                left &= left - 1;
                let place = Index { block: index, row: of, column };
                if self.range[0] > buffer.farthest(place) {
                    self.tile(buffer, [block_x * SIDE + column, block_y * SIDE + row], place);
                }
            }
        }
    }

    /// Draws what is easy of eight tiles, from pixel `x`, `y`. Returns a bit for each whose pixels must be looked at.
    #[inline(always)]
    fn row<const EDGES: bool>(
        &self,
        buffer: &mut DepthBuffer<'_>,
        steps: &Steps,
        [x, y]: [usize; 2],
        row: usize,
    ) -> u32 {
        let ([nearest, floor], width) = (self.range, ((buffer.rays.size[0] - x) / SIDE) as f32);
        // 1. Edges: not below 0 where the tile may meet it, and above 0 where it has all of it.
        let (mut meets, mut whole) = ([f32::INFINITY; SIDE], [f32::INFINITY; SIDE]);
        for e in 0..if EDGES { 3 } else { 0 } {
            let start = self.edges[e].value(x, y) as f32;
            for k in 0..SIDE {
                let value = start + steps.edges[e][k];
                meets[k] = min(meets[k], value + steps.rises[e]);
                whole[k] = min(whole[k], value + steps.falls[e]);
            }
        }
        // 2. Depths of the pixels in the corners, new and old: linear functions, of which these are the extremes.
        let (start, old, drawn) = (self.depth.value(x, y), &mut buffer.planes[row], &mut buffer.farthest[row].0);
        let [dx, dy] = steps.slope.map(|slope| slope * LAST);
        let mut at = [0.0; SIDE];
        for k in 0..SIDE {
            let value = start + steps.depth[k];
            at[k] = (value - FORM_ERROR * (value.abs() + steps.spread)) as f32;
        }
        // What is new over what is old, at the least and at the most.
        let (mut gain, mut most_gain) = ([f32::INFINITY; SIDE], [f32::NEG_INFINITY; SIDE]);
        let (mut most, mut least) = ([floor; SIDE], [f32::INFINITY; SIDE]);
        for k in 0..SIDE {
            let [below, old_below] = [at[k] + dy, old.at[k] + old.y[k] * LAST];
            let old_dx = old.x[k] * LAST;
            let new = [at[k], at[k] + dx, below, below + dx];
            let was = [old.at[k], old.at[k] + old_dx, old_below, old_below + old_dx];
            for c in 0..4 {
                let new = max(new[c], floor);
                most[k] = max(new, most[k]);
                least[k] = min(new, least[k]);
                let difference = new - max(was[c], old.floor[k]);
                gain[k] = min(difference, gain[k]);
                most_gain[k] = max(difference, most_gain[k]);
            }
        }
        // 3. What is to be done.
        let (mut takes, mut left) = ([0; SIDE], [0; SIDE]);
        for k in 0..SIDE {
            let open = ones(meets[k] >= 0.0) & ones(min(most[k], nearest) > drawn[k]);
            let inside = ones(whole[k] > 0.0) & ones(COUNT[k] < width);
            let nothing_there = ones(drawn[k] == UNTOUCHED);
            let has_plane = ones(old.at[k] == old.at[k]);
            takes[k] = open & inside & (nothing_there | (has_plane & ones(gain[k] >= 0.0)));
            let keeps = inside & !nothing_there & has_plane & ones(most_gain[k] <= 0.0);
            left[k] = open & !takes[k] & !keeps & (1 << k);
        }
        for k in 0..SIDE {
            old.at[k] = chosen(takes[k], at[k], old.at[k]);
            old.x[k] = chosen(takes[k], steps.slope[0], old.x[k]);
            old.y[k] = chosen(takes[k], steps.slope[1], old.y[k]);
            old.floor[k] = chosen(takes[k], floor, old.floor[k]);
            drawn[k] = chosen(takes[k], least[k], drawn[k]);
        }
        // Where nothing changed, it is found again for nothing.
        buffer.blocks[row / SIDE] = f32::NAN;
        left.into_iter().fold(0, |all, bit| all | bit)
    }
}
