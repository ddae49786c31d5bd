//! Boxes held against the depth buffer.
//!
//! A box is what is between three pairs of planes. Along the ray through a pixel each plane is met at one 1/w, and that is linear over
//! the picture: so the nearest of the box is the least of at most three linear functions, its farthest the greatest of the others, and a
//! pixel shows the box where the farthest isn't nearer than the nearest. Blocks, tiles and pixels are all asked the same way.

use super::{DepthBuffer, Form, SIDE, lanes};
use crate::online::bounds::Bounds;

/// Boxes are grown by this fraction of their distance and size, and an eye this near to the plane of a face is inside of it: what
/// roundings in `f64` may add up to, and much more. Larger: boxes just behind a wall show.
const GROWN: f64 = 1e-9;

/// A box yet to be asked about.
pub(super) struct Ask<'a, 's, 'b> {
    pub buffer: &'a mut DepthBuffer<'s>,
    pub bounds: &'b Bounds,
}

impl pulp::WithSimd for Ask<'_, '_, '_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> bool {
        shows(self.buffer, self.bounds)
    }
}

#[inline(always)]
fn shows(buffer: &mut DepthBuffer<'_>, bounds: &Bounds) -> bool {
    let rays = &buffer.rays;
    let at = bounds.centre - rays.view.eye;
    // 1. What reaches nearer than the near plane can't be asked about.
    let w = rays.view.w.dot(at);
    let size = at.abs().element_sum() + bounds.half.element_sum();
    let least = w - bounds.reach(rays.view.w) - GROWN * size;
    if least <= rays.view.near {
        return true;
    }
    // 2. Where it is in the picture.
    let steps: [_; 3] = std::array::from_fn(|k| bounds.axes[k] * bounds.half[k]);
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for i in 0..8 {
        let step = |k: usize| if i >> k & 1 == 0 { -steps[k] } else { steps[k] };
        let p = rays.project(at + step(0) + step(1) + step(2));
        for k in 0..2 {
            min[k] = min[k].min(p[k]);
            max[k] = max[k].max(p[k]);
        }
    }
    let Some(pixels) = rays.pixels(min, max) else { return false };
    let nearest = (1.0 / least * (1.0 + 1e-6)) as f32;
    let slabs = Slabs::new(buffer, bounds, size);
    // 3. First the tile in the middle: most boxes that show do so there.
    let [columns, rows] = pixels;
    let middle = [columns, rows].map(|[first, last]| first.midpoint(last) / SIDE);
    if slabs.tile(buffer, middle, pixels, nearest) {
        return true;
    }
    // 4. All of it.
    let [columns, rows] = pixels.map(|[first, last]| [first / SIDE, last / SIDE]);
    for block_y in rows[0] / SIDE..=rows[1] / SIDE {
        for block_x in columns[0] / SIDE..=columns[1] / SIDE {
            if buffer.block(block_x, block_y) > nearest {
                continue;
            }
            let within =
                |[first, last]: [usize; 2], block: usize| first.max(block * SIDE)..=last.min(block * SIDE + SIDE - 1);
            for y in within(rows, block_y) {
                for x in within(columns, block_x) {
                    if slabs.tile(buffer, [x, y], pixels, nearest) {
                        return true;
                    }
                }
            }
        }
    }
    false
}

/// The planes of a box: the first `nearer` face the eye.
struct Slabs {
    forms: [Form; 6],
    nearer: usize,
}

impl Slabs {
    #[inline(always)]
    fn new(buffer: &DepthBuffer<'_>, bounds: &Bounds, size: f64) -> Self {
        let at = bounds.centre - buffer.rays.view.eye;
        let mut forms = [Form { at: 0.0, x: 0.0, y: 0.0 }; 6];
        let (mut nearer, mut farther) = (0, 6);
        let least = GROWN * size;
        for k in 0..3 {
            let form = buffer.rays.form(bounds.axes[k]);
            let (middle, half) = (bounds.axes[k].dot(at), bounds.half[k] + least);
            let (low, high) = (middle - half, middle + half);
            let (near, far) = if low > least {
                (Some(low), [high, high])
            } else if high < -least {
                (Some(high), [low, low])
            } else {
                // Between the planes, or so near to one that it counts as between: the box only grows by that.
                (None, [low.min(-least), high.max(least)])
            };
            farther -= 1;
            forms[farther] = form.scaled(1.0 / far[0]);
            match near {
                Some(near) => {
                    forms[nearer] = form.scaled(1.0 / near);
                    nearer += 1;
                }
                None => {
                    farther -= 1;
                    forms[farther] = form.scaled(1.0 / far[1]);
                }
            }
        }
        Self { forms, nearer }
    }

    /// Whether a pixel of the box shows in a tile, of those within `pixels`.
    #[inline(always)]
    fn tile(&self, buffer: &DepthBuffer<'_>, [x, y]: [usize; 2], pixels: [[usize; 2]; 2], nearest: f32) -> bool {
        let index = y * buffer.across[0] + x;
        let drawn = buffer.farthest[index];
        if drawn > nearest {
            return false;
        }
        let (x, y) = (x * SIDE, y * SIDE);
        let (near, far) = self.forms.split_at(self.nearer);
        // The nearest and the farthest that the box may be anywhere in the tile; then by pixel, with its rounding outwards.
        let (mut most, mut least) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut forms = [[0.0f32; 3]; 6];
        for (i, form) in self.forms.iter().enumerate() {
            let ([_, dx, dy], error) = form.in_tile(x, y);
            let at = form.value(x, y);
            if i < near.len() {
                most = most.min(at + form.rise(SIDE) + error);
                forms[i] = [(at + error) as f32, dx, dy];
            } else {
                least = least.max(at + form.fall(SIDE) - error);
                forms[i] = [(at - error) as f32, dx, dy];
            }
        }
        if most < f64::from(drawn) || least > most {
            return false;
        }
        let untouched = drawn < 0.0;
        let (near, far) = (near.len(), far.len());
        let mut shows = [false; SIDE];
        for row in pixels[1][0].max(y) - y..=pixels[1][1].min(y + SIDE - 1) - y {
            let (mut enter, mut leave) = ([f32::INFINITY; SIDE], [f32::NEG_INFINITY; SIDE]);
            for form in &forms[..near] {
                let values = lanes(*form, row);
                for i in 0..SIDE {
                    enter[i] = enter[i].min(values[i]);
                }
            }
            for form in &forms[near..near + far] {
                let values = lanes(*form, row);
                for i in 0..SIDE {
                    leave[i] = leave[i].max(values[i]);
                }
            }
            let depths = &buffer.tiles[index].0[row * SIDE..][..SIDE];
            for i in 0..SIDE {
                shows[i] |= (enter[i] >= leave[i]) & (untouched | (enter[i] >= depths[i]));
            }
        }
        shows[pixels[0][0].max(x) - x..=pixels[0][1].min(x + SIDE - 1) - x].contains(&true)
    }
}
