//! Tests of boxes against the depth buffer.
//!
//! Linear functions over the picture (`slabs.rs`) have their extremes at corners, so blocks, tiles and pixels are tested in the same way.

use super::lanes::{COUNT, F32x8, Lanes, SIDE};
use super::squares::Squares;
use super::{BLOCK, DepthBuffer};
use crate::math::simd::Vectorize;
use crate::occlusion::bounds::Bounds;
use crate::occlusion::pixels::FORM_ERROR;
use crate::occlusion::slabs::{Place, Slabs};

/// Most tiles of a box that are tested one by one.
const FEW_TILES: usize = 9;
/// Most blocks in a row that are tested one by one.
const FEW: u32 = 1;

/// A box test, for dispatch.
pub(super) struct Ask<'a, 's, 'b> {
    pub buffer: &'a mut DepthBuffer<'s>,
    pub bounds: &'b Bounds,
    /// Remaining pixels that must be visible; visible pixels are subtracted.
    pub wanted: &'b mut u32,
}

impl Vectorize for Ask<'_, '_, '_> {
    type Output = bool;

    #[inline(always)]
    fn work(self) -> bool {
        shows(self.buffer, self.bounds, self.wanted)
    }
}

/// A box's pixels, first and last by axis, and the depth of its nearest corner.
#[derive(Clone, Copy)]
struct Asked {
    pixels: [[usize; 2]; 2],
    nearest: f32,
}

#[inline(always)]
fn shows(buffer: &mut DepthBuffer<'_>, bounds: &Bounds, wanted: &mut u32) -> bool {
    // 1. Its position in the picture.
    let (pixels, most) = match Place::of(&buffer.rays, bounds) {
        Place::Near => return true,
        Place::Beside => return false,
        Place::Within { pixels, most } => (pixels, most),
    };
    let nearest = (most * (1.0 + 1e-6)) as f32;
    // 2. First the central tile, where most visible boxes show. If pixels are counted, none may count twice.
    let mut slabs = None;
    let middle = pixels.map(|[first, last]| first.midpoint(last) / SIDE);
    if *wanted == 1 && buffer.farthest(buffer.index(middle)) <= nearest {
        let slabs = slabs.insert(Slabs::new(&buffer.rays, bounds));
        if slabs.tile(buffer, middle, pixels, wanted) {
            return true;
        }
    }
    // 3. All of it. If the box's nearest depth is hidden all over a block or a tile, that is skipped. A small box is tested tile by tile
    //    directly.
    let [columns, rows] = pixels.map(|[first, last]| [first / SIDE, last / SIDE]);
    if (columns[1] - columns[0] + 1) * (rows[1] - rows[0] + 1) <= FEW_TILES {
        for (x, y) in (rows[0]..=rows[1]).flat_map(|y| (columns[0]..=columns[1]).map(move |x| (x, y))) {
            if buffer.farthest(buffer.index([x, y])) <= nearest {
                let slabs = slabs.get_or_insert_with(|| Slabs::new(&buffer.rays, bounds));
                if slabs.tile(buffer, [x, y], pixels, wanted) {
                    return true;
                }
            }
        }
        return false;
    }
    buffer.freshen();
    let [columns, rows] = pixels.map(|[first, last]| [first / BLOCK, last / BLOCK]);
    for y in (rows[0]..=rows[1]).step_by(SIDE) {
        for x in (columns[0]..=columns[1]).step_by(SIDE) {
            let last = [columns[1].min(x + SIDE - 1), rows[1].min(y + SIDE - 1)];
            let asked = Asked { pixels, nearest };
            if blocks(buffer, bounds, &mut slabs, [[x, last[0]], [y, last[1]]], asked, wanted) {
                return true;
            }
        }
    }
    false
}

/// The same for up to eight by eight blocks, first and last by axis.
#[inline(always)]
fn blocks(
    buffer: &mut DepthBuffer<'_>,
    bounds: &Bounds,
    slabs: &mut Option<Slabs>,
    [columns, rows]: [[usize; 2]; 2],
    asked: Asked,
    wanted: &mut u32,
) -> bool {
    let nearest = asked.nearest;
    let of_columns = (2 << (columns[1] - columns[0])) - 1;
    let mut squares = None;
    for y in rows[0]..=rows[1] {
        let first = y * buffer.across + columns[0];
        let farthest: Lanes = std::array::from_fn(|k| buffer.blocks[first..first + SIDE][k]);
        let mut left = of_columns & not_nearer(&farthest, nearest);
        // A box in one or two blocks is tested tile by tile directly.
        if left.count_ones() > FEW {
            let slabs = slabs.get_or_insert_with(|| Slabs::new(&buffer.rays, bounds));
            let corner = [columns[0] * BLOCK, rows[0] * BLOCK];
            let squares = squares.get_or_insert_with(|| Squares::new(slabs, corner, BLOCK));
            left &= squares.row(y - rows[0], &farthest, nearest);
        }
        while left != 0 {
            let x = columns[0] + left.trailing_zeros() as usize;
            left &= left - 1;
            let slabs = slabs.get_or_insert_with(|| Slabs::new(&buffer.rays, bounds));
            if block(buffer, slabs, [x, y], asked, wanted) {
                return true;
            }
        }
    }
    false
}

/// A bit for each of eight depths that is not nearer than this.
#[inline(always)]
fn not_nearer(farthest: &Lanes, nearest: f32) -> u32 {
    F32x8::splat(nearest).at_least(F32x8::load(farthest)).bits()
}

/// Whether enough pixels of a box are visible in a block.
#[inline(always)]
fn block(
    buffer: &mut DepthBuffer<'_>,
    slabs: &Slabs,
    [block_x, block_y]: [usize; 2],
    Asked { pixels, nearest }: Asked,
    wanted: &mut u32,
) -> bool {
    let index = block_y * buffer.across + block_x;
    let within = |[first, last]: [usize; 2], block: usize| {
        let start = block * BLOCK;
        [first.max(start) - start, last.min(start + BLOCK - 1) - start].map(|p| p / SIDE)
    };
    let (columns, rows) = (within(pixels[0], block_x), within(pixels[1], block_y));
    let squares = Squares::new(slabs, [block_x * BLOCK, block_y * BLOCK], SIDE);
    let of_columns = (2 << columns[1]) - (1 << columns[0]);
    for row in rows[0]..=rows[1] {
        let mut left = of_columns & squares.row(row, &buffer.farthest[index * SIDE + row].0, nearest);
        while left != 0 {
            let column = left.trailing_zeros() as usize;
            left &= left - 1;
            if slabs.tile(buffer, [block_x * SIDE + column, block_y * SIDE + row], pixels, wanted) {
                return true;
            }
        }
    }
    false
}

impl Slabs {
    /// Whether enough pixels of the box within `pixels` are visible in a tile.
    #[inline(always)]
    fn tile(&self, buffer: &mut DepthBuffer<'_>, [x, y]: [usize; 2], pixels: [[usize; 2]; 2], wanted: &mut u32) -> bool {
        let index = buffer.index([x, y]);
        let drawn = buffer.farthest(index);
        let (x, y) = (x * SIDE, y * SIDE);
        // Bounds of the box's depth over the tile; then by pixel, rounded outwards.
        let (mut outwards, mut extreme) = ([0.0; 8], [0.0; 8]);
        for i in 0..8 {
            let sign = if i < self.nearer { 1.0 } else { -1.0 };
            let at = (self.at[i] + self.x[i] * x as f64) + self.y[i] * y as f64;
            let spread = self.x[i].abs() + self.y[i].abs();
            outwards[i] = at + sign * FORM_ERROR * (at.abs() + spread * SIDE as f64);
            // The maximum or minimum over the corners: half of the sum of both, and half of the difference.
            let steps = (SIDE - 1) as f64 * 0.5;
            extreme[i] = outwards[i] + ((self.x[i] + self.y[i]) + sign * spread) * steps;
        }
        let most = extreme[..self.nearer].iter().fold(f64::INFINITY, |a, &b| if a < b { a } else { b });
        let least = extreme[self.nearer..6].iter().fold(f64::NEG_INFINITY, |a, &b| if a > b { a } else { b });
        if most < f64::from(drawn) || least > most {
            return false;
        }
        buffer.unfold(index);
        // Pixels of each row where the box's nearest depth is nearer than its farthest depth and the drawn depth.
        let of_columns = of_lanes(pixels[0], x);
        let nearer = self.nearer.min(3);
        for row in pixels[1][0].max(y) - y..(pixels[1][1] + 1 - y).min(SIDE) {
            let mut enter = F32x8::INFINITY;
            for i in 0..nearer {
                let start = outwards[i] as f32 + self.y[i] as f32 * COUNT[row];
                enter = enter.min(F32x8::splat(start) + F32x8::COUNT * self.x[i] as f32);
            }
            // The depths of an untouched tile are from an earlier frame.
            let mut leave = F32x8::splat(f32::NEG_INFINITY);
            if drawn >= 0.0 {
                leave = F32x8::load(&buffer.tiles[index.tile()].0[row]);
            }
            for i in nearer..6 {
                let start = outwards[i] as f32 + self.y[i] as f32 * COUNT[row];
                leave = leave.max(F32x8::splat(start) + F32x8::COUNT * self.x[i] as f32);
            }
            *wanted = wanted.saturating_sub((enter.at_least(leave).bits() & of_columns).count_ones());
            if *wanted == 0 {
                return true;
            }
        }
        false
    }
}

/// A bit for each of the eight columns from `start` that is within a range, first and last.
#[inline(always)]
fn of_lanes([first, last]: [usize; 2], start: usize) -> u32 {
    let [first, last] = [first.max(start) - start, last.min(start + SIDE - 1) - start];
    (2 << last) - (1 << first)
}
