//! A box held against the farthest depths of squares of the picture, eight in a row at a time: what is left over is asked pixel by pixel.

use super::{COUNT, Lanes, SIDE, max, min, ones};
use crate::occlusion::pixels::FORM_ERROR;
use crate::occlusion::slabs::Slabs;

/// The planes of a box over eight by eight squares: for those of its front the most that they are in a square, for the others the least, with
/// all rounding outwards.
pub(super) struct Squares {
    at: [f32; 8],
    /// From a square to the next.
    x: [f32; 8],
    y: [f32; 8],
    nearer: usize,
}

impl Squares {
    /// From pixel `x`, `y` on, for squares of so many pixels along the side.
    #[inline(always)]
    pub fn new(slabs: &Slabs, [x, y]: [usize; 2], side: usize) -> Self {
        let (mut squares, all) = (Self { at: [0.0; 8], x: [0.0; 8], y: [0.0; 8], nearer: slabs.nearer }, (side * SIDE) as f64);
        for i in 0..8 {
            let sign = if i < slabs.nearer { 1.0 } else { -1.0 };
            let at = (slabs.at[i] + slabs.x[i] * x as f64) + slabs.y[i] * y as f64;
            let spread = slabs.x[i].abs() + slabs.y[i].abs();
            // Of the corners' values the greatest or the least: half of the sum of both, and half of the difference.
            let extreme = ((slabs.x[i] + slabs.y[i]) + sign * spread) * ((side - 1) as f64 * 0.5);
            squares.at[i] = (at + extreme + sign * FORM_ERROR * (at.abs() + spread * all)) as f32;
            squares.x[i] = (slabs.x[i] * side as f64) as f32;
            squares.y[i] = (slabs.y[i] * side as f64) as f32;
        }
        squares
    }

    /// A bit for each where a part of the box that is at most as near as `nearest` may show before what is drawn, in a row of squares; these are
    /// the farthest depths in them.
    #[inline(always)]
    pub fn row(&self, row: usize, farthest: &Lanes, nearest: f32) -> u32 {
        let (mut enter, mut leave) = ([nearest; SIDE], *farthest);
        for i in 0..self.nearer {
            let start = self.at[i] + self.y[i] * COUNT[row];
            for k in 0..SIDE {
                enter[k] = min(enter[k], start + self.x[i] * COUNT[k]);
            }
        }
        for i in self.nearer..6 {
            let start = self.at[i] + self.y[i] * COUNT[row];
            for k in 0..SIDE {
                leave[k] = max(leave[k], start + self.x[i] * COUNT[k]);
            }
        }
        let mut shows = [0; SIDE];
        for k in 0..SIDE {
            shows[k] = ones(enter[k] >= leave[k]) & (1 << k);
        }
        shows.into_iter().fold(0, |all, bit| all | bit)
    }
}
