//! Triangles of many tiles: block by block, and in a block eight tiles at a time. A tile entirely covered by a nearer triangle stores its
//! plane, without any pixel; other tiles go to `tile.rs`.

use super::draw::Drawn;
use super::lanes::{F32x8, Lanes, SIDE};
use super::{BLOCK, DepthBuffer, Index};
use crate::occlusion::pixels::FORM_ERROR;

/// Distance of a tile's corner from an edge, pixels, within which pixels decide: more than the error of a distance of up to 1,000 pixels in
/// `f32`. Larger: more tiles are drawn pixel by pixel.
const MARGIN: f64 = 1e-3;
/// From a tile's first pixel to its last.
const LAST: f32 = (SIDE - 1) as f32;

/// Data for each block; arrays are along a row of tiles.
struct Steps {
    /// Steps of each edge.
    edges: [Lanes; 3],
    /// Differences of an edge's maximum and minimum in a tile to its value at the first pixel.
    rises: [f32; 3],
    falls: [f32; 3],
    /// Maximum and minimum of each edge in the first block, widened.
    blocks: [[f64; 2]; 3],
    depth: [f64; SIDE],
    /// Largest change of depth within a tile.
    spread: f64,
    /// Slope of the planes.
    slope: [f32; 2],
}

impl Drawn {
    /// Draws it into all blocks that it may cover.
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
        // The triangle is beyond the near plane in this block.
        let is_beyond = most < self.near * (1.0 - 1e-6) - 3.0 * error;
        let within = |[first, last]: [usize; 2], start: usize| {
            [first.max(start) - start, last.min(start + BLOCK - 1) - start].map(|p| p / SIDE)
        };
        let (columns, rows) = (within(self.pixels[0], x), within(self.pixels[1], y));
        let of_columns = (2 << columns[1]) - (1 << columns[0]);
        for row in rows[0]..=rows[1] {
            let of = index * SIDE + row;
            let mut left = !0;
            if is_beyond && y + (row + 1) * SIDE <= buffer.rays.size[1] {
                let corner = [x, y + row * SIDE];
                left = match whole {
                    true => self.row::<false>(buffer, steps, corner, of),
                    false => self.row::<true>(buffer, steps, corner, of),
                };
            }
            left &= of_columns;
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

    /// Draws the easy ones of eight tiles, from pixel `x`, `y`. Returns the tiles that need pixels, a bit each.
    #[inline(always)]
    fn row<const EDGES: bool>(&self, buffer: &mut DepthBuffer<'_>, steps: &Steps, [x, y]: [usize; 2], row: usize) -> u32 {
        // 1. Edges: `meets` is not below 0 if the triangle may meet the tile, and `whole` is above 0 if it covers the tile.
        let (mut meets, mut whole) = (F32x8::INFINITY, F32x8::load(&buffer.complete[x / BLOCK].0));
        for e in 0..if EDGES { 3 } else { 0 } {
            let value = F32x8::splat(self.edges[e].value(x, y) as f32) + F32x8::load(&steps.edges[e]);
            meets = meets.min(value + F32x8::splat(steps.rises[e]));
            whole = whole.min(value + F32x8::splat(steps.falls[e]));
        }
        // 2. Depths of the corner pixels, new and old: the extremes of linear functions.
        let start = self.depth.value(x, y);
        let mut at = [0.0; SIDE];
        for k in 0..SIDE {
            let value = start + steps.depth[k];
            at[k] = (value - FORM_ERROR * (value.abs() + steps.spread)) as f32;
        }
        let (at, nearest, floor) = (F32x8::load(&at), F32x8::splat(self.range[0]), F32x8::splat(self.range[1]));
        let (old, drawn) = (&buffer.planes[row], F32x8::load(&buffer.farthest[row].0));
        let (old_at, old_floor) = (F32x8::load(&old.at), F32x8::load(&old.floor));
        let (dx, dy) = (F32x8::splat(steps.slope[0] * LAST), F32x8::splat(steps.slope[1] * LAST));
        let [a, b, c, d] = corners(at, dx, dy, floor);
        let [was_a, was_b, was_c, was_d] =
            corners(old_at, F32x8::load(&old.x) * LAST, F32x8::load(&old.y) * LAST, old_floor);
        let (least, most) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        // New minus old depth, minimum and maximum.
        let (a, b, c, d) = (a - was_a, b - was_b, c - was_c, d - was_d);
        let (gain, most_gain) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
        // 3. The decision for each tile.
        let zero = F32x8::ZERO;
        let open = meets.at_least(zero) & drawn.less(most.min(nearest));
        let inside = zero.less(whole);
        let nothing_there = drawn.less(zero);
        let has_plane = !old_at.is_nan();
        let takes = open & inside & (nothing_there | (has_plane & gain.at_least(zero)));
        let keeps = inside & !nothing_there & has_plane & zero.at_least(most_gain);
        if takes.bits() != 0 {
            let (x, y) = (F32x8::splat(steps.slope[0]), F32x8::splat(steps.slope[1]));
            let old = &mut buffer.planes[row];
            takes.choose(at, old_at).store(&mut old.at);
            takes.choose(x, F32x8::load(&old.x)).store(&mut old.x);
            takes.choose(y, F32x8::load(&old.y)).store(&mut old.y);
            takes.choose(floor, old_floor).store(&mut old.floor);
            takes.choose(least, drawn).store(&mut buffer.farthest[row].0);
            buffer.blocks[row / SIDE] = f32::NAN;
            buffer.is_stale = true;
        }
        (open & !takes & !keeps).bits()
    }
}

/// The depths of planes at the corner pixels of a tile, from the value at the first pixel and the differences to the last.
#[inline(always)]
fn corners(at: F32x8, dx: F32x8, dy: F32x8, floor: F32x8) -> [F32x8; 4] {
    let below = at + dy;
    [at.max(floor), (at + dx).max(floor), below.max(floor), (below + dx).max(floor)]
}

#[cfg(test)]
mod tests {
    use super::super::super::oracle::OcclusionOracle;
    use super::super::super::scenes::{Picture, add, row, turned};
    use super::super::super::view::View;
    use super::super::UNTOUCHED;
    use super::*;
    use crate::ObjectId;
    use crate::math::random::Prng;
    use glam::{DQuat, DVec3};

    fn depth(buffer: &DepthBuffer<'_>, x: usize, y: usize) -> f32 {
        let index = buffer.index([x / SIDE, y / SIDE]);
        let plane = buffer.planes[index.row].get(index.column);
        match buffer.farthest(index) {
            UNTOUCHED => 0.0,
            _ if plane.at.is_nan() => buffer.tiles[index.tile()].0[y % SIDE][x % SIDE],
            _ => plane.depth(x % SIDE, y % SIDE),
        }
    }

    /// Large boxes, some of them around the eye or touching it with a face, with opening angles of 1e-5 to 179.9 degrees, near the origin
    /// and 1e6 m from it: no pixel is drawn outside, none too near, whatever was drawn before; and no pixel is missing.
    #[test]
    fn large_triangles_are_never_too_near() {
        let mut rng = Prng::new(22, 0);
        let (mut whole, mut drawn) = (0, 0);
        for round in 0..48 {
            let degrees = [1e-5, 0.01, 5.0, 70.0, 140.0, 179.9][round % 6];
            let eye = DVec3::new(rng.unit(), rng.unit(), rng.unit()) * [1.0, 1e6][round / 6 % 2];
            let mut point = || DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
            let view = View::look_at(eye, eye + point(), f64::to_radians(degrees), 1.5, 0.05);
            let spread = (0.5 * f64::to_radians(degrees)).tan().min(2.0);
            let mut scene = row(&[]);
            for i in 0..4 {
                let (aside, half) = (point(), point().abs() + 0.01);
                let turn = if i % 2 == 0 { DQuat::IDENTITY } else { DQuat::from_rotation_y(aside.z * 3.0) };
                let size = half * spread * 8.0;
                let mut centre = eye + view.w * (4.0 + 2.0 * f64::from(i)) + aside * spread * 6.0;
                if i == 3 {
                    // A face through the eye.
                    centre = eye + DVec3::Y * size.y;
                }
                add(&mut scene, &turned(centre, turn, size), 1);
            }
            let size = [[200, 136], [157, 141]][round % 2];
            let objects: Vec<ObjectId> = (0..4).map(ObjectId).collect();
            let mut buffer = DepthBuffer::new(&scene, size[0], size[1]);
            buffer.begin(&view);
            objects.iter().rev().for_each(|&o| buffer.draw(o));
            let picture = Picture::new(&scene, &objects, &view, size);
            for (p, pixel) in picture.pixels.iter().enumerate() {
                let (want, got) = (pixel.map_or(0.0, |p| p.0), f64::from(depth(&buffer, p % size[0], p / size[0])));
                assert!(got <= want, "round {round}, pixel {p}: {got} for {want}");
                assert!((got > 0.0) == (want > 0.0), "round {round}, pixel {p}: {got} for {want}");
                drawn += usize::from(got > 0.0);
            }
            whole += buffer.planes.iter().flat_map(|p| p.at).filter(|at| !at.is_nan()).count();
        }
        assert!(drawn > 100_000 && whole > 500, "{drawn} pixels, {whole} planes: a test of nothing");
    }
}
