//! Tests of a box against the farthest depths of squares of the picture, eight in a row at a time; the remaining squares are tested pixel
//! by pixel.

use super::lanes::{COUNT, F32x8, Lanes, SIDE};
use crate::occlusion::pixels::FORM_ERROR;
use crate::occlusion::slabs::Slabs;

/// The planes of a box over eight by eight squares: the maximum in a square for front planes, the minimum for others, rounded outwards.
pub(super) struct Squares {
    /// Front planes, infinitely near if absent.
    front: [f32; 8],
    /// Back planes, infinitely far if absent.
    back: [f32; 8],
    /// Steps from a square to the next.
    x: [f32; 8],
    y: [f32; 8],
}

impl Squares {
    /// From pixel `x`, `y`, for squares of `side` pixels.
    #[inline(always)]
    pub fn new(slabs: &Slabs, [x, y]: [usize; 2], side: usize) -> Self {
        let mut squares = Self { front: [f32::INFINITY; 8], back: [f32::NEG_INFINITY; 8], x: [0.0; 8], y: [0.0; 8] };
        let all = (side * SIDE) as f64;
        for i in 0..8 {
            let sign = if i < slabs.nearer { 1.0 } else { -1.0 };
            let at = (slabs.at[i] + slabs.x[i] * x as f64) + slabs.y[i] * y as f64;
            let spread = slabs.x[i].abs() + slabs.y[i].abs();
            // The maximum or minimum over the corners: half of the sum of both, and half of the difference.
            let extreme = ((slabs.x[i] + slabs.y[i]) + sign * spread) * ((side - 1) as f64 * 0.5);
            let outwards = (at + extreme + sign * FORM_ERROR * (at.abs() + spread * all)) as f32;
            squares.front[i] = if i < slabs.nearer { outwards } else { f32::INFINITY };
            squares.back[i] = if i < slabs.nearer { f32::NEG_INFINITY } else { outwards };
            squares.x[i] = (slabs.x[i] * side as f64) as f32;
            squares.y[i] = (slabs.y[i] * side as f64) as f32;
        }
        squares
    }

    /// A bit for each square of a row in which the box, at most as near as `nearest`, may be visible; `farthest` are the squares' farthest
    /// depths.
    #[inline(always)]
    pub fn row(&self, row: usize, farthest: &Lanes, nearest: f32) -> u32 {
        let (mut enter, mut leave) = (F32x8::splat(nearest), F32x8::load(farthest));
        let (mut front, mut back) = ([0.0; 8], [0.0; 8]);
        let down = F32x8::load(&self.y) * COUNT[row];
        (F32x8::load(&self.front) + down).store(&mut front);
        (F32x8::load(&self.back) + down).store(&mut back);
        // At most three sides face the eye, and at most five do not.
        for i in 0..3 {
            enter = enter.min(F32x8::splat(front[i]) + F32x8::COUNT * self.x[i]);
        }
        for i in 1..6 {
            leave = leave.max(F32x8::splat(back[i]) + F32x8::COUNT * self.x[i]);
        }
        enter.at_least(leave).bits()
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::bounds::Bounds;
    use super::super::super::pixels::Rays;
    use super::super::super::scenes::turned;
    use super::super::super::slabs::Place;
    use super::super::super::view::View;
    use super::*;
    use crate::math::random::Prng;
    use glam::{DQuat, DVec3};

    /// A view and a box in front of it: opening angles of 1e-5 to 179.9 degrees, near or 1e7 m from the origin; for some boxes the eye is
    /// in a face's plane.
    fn case(rng: &mut Prng, round: usize) -> (View, Bounds) {
        let degrees = [1e-5, 0.01, 1.0, 60.0, 150.0, 179.9][round % 6];
        let eye = DVec3::new(rng.unit(), rng.unit(), rng.unit()) * [1.0, 1e7][round / 6 % 2];
        let mut point = || DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0));
        let (target, aside, half) = (point(), point(), point().abs() * 3.0);
        let view = View::look_at(eye, eye + target, f64::to_radians(degrees), 1.5, 1e-3);
        let reach = (0.5 * f64::to_radians(degrees)).tan().min(5.0);
        let mut centre = eye + view.w * 20.0 + aside * 20.0 * reach;
        let turn = if round.is_multiple_of(3) { DQuat::IDENTITY } else { DQuat::from_rotation_y(aside.x * 3.0) };
        if round.is_multiple_of(9) {
            // The eye is in the plane of a side.
            centre.y = eye.y + half.y;
        }
        (view, turned(centre, turn, half))
    }

    /// In a square reported hidden, no pixel, tested in `f64`, has the box's front in front of its back and the drawn depth.
    #[test]
    fn no_square_that_shows_is_called_hidden() {
        let mut rng = Prng::new(21, 0);
        let (mut hidden, mut open) = (0, 0);
        for round in 0..6000 {
            let (view, bounds) = case(&mut rng, round);
            let rays = Rays::new(&view, [512, 384]);
            let Place::Within { most, .. } = Place::of(&rays, &bounds) else { continue };
            let slabs = Slabs::new(&rays, &bounds);
            let side = [SIDE, 1, 2][round % 3];
            let corner = [rng.below(8) * 64, rng.below(6) * 64];
            let squares = Squares::new(&slabs, corner, side);
            let nearest = (most * (1.0 + 1e-6)) as f32;
            let row = rng.below(SIDE);
            let drawn: Lanes = std::array::from_fn(|_| (most * rng.range(-0.1, 1.2)) as f32);
            let left = squares.row(row, &drawn, nearest);
            for (column, &drawn) in drawn.iter().enumerate() {
                let mut shows = false;
                for p in 0..side * side {
                    let [x, y] = [corner[0] + column * side + p % side, corner[1] + row * side + p / side];
                    let value = |i: usize| (slabs.at[i] + slabs.x[i] * x as f64) + slabs.y[i] * y as f64;
                    let front = (0..slabs.nearer).map(value).fold(f64::INFINITY, f64::min);
                    let back = (slabs.nearer..6).map(value).fold(f64::NEG_INFINITY, f64::max);
                    shows |= front >= back && front >= f64::from(drawn);
                }
                let is_left = left >> column & 1 != 0;
                assert!(is_left || !shows, "round {round}, square {column}");
                hidden += usize::from(!is_left);
                open += usize::from(shows);
            }
        }
        assert!(hidden > 3000 && open > 3000, "{hidden} and {open}: a test of nothing");
    }
}
