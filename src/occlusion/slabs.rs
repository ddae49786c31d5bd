//! A box as three pairs of planes (slabs) over the pixels of a picture, in `f64`: common to oracles that test boxes against depths.
//!
//! The ray through a pixel crosses each plane at one 1/w, which is linear over the picture. So the box's nearest depth is the minimum of at
//! most three linear functions, its farthest depth is the maximum of the others, and a pixel shows the box if the farthest is not nearer
//! than the nearest.

use super::bounds::Bounds;
use super::pixels::{Form, Rays};
use glam::DVec3;

/// Growth of boxes, as a fraction of their distance and size; an eye this near to the plane of a face is inside it. Far above the rounding
/// error in `f64`. Larger: boxes just behind a wall show.
const GROWN: f64 = 1e-9;

/// Position of a box relative to a picture.
pub(super) enum Place {
    /// It extends in front of the near plane: its visibility is unknown.
    Near,
    /// It covers no pixel centre.
    Beside,
    /// Beyond the near plane, within these pixels.
    Within {
        /// First and last by axis.
        pixels: [[usize; 2]; 2],
        /// Upper bound of 1/w.
        most: f64,
    },
}

impl Place {
    #[inline(always)]
    pub fn of(rays: &Rays, bounds: &Bounds) -> Self {
        let at = bounds.centre - rays.view.eye;
        let least = rays.view.w.dot(at) - bounds.reach(rays.view.w) - grown(at, bounds);
        if least <= rays.view.near {
            return Self::Near;
        }
        let corners = |n: DVec3| {
            let step = |k: usize| n.dot(bounds.axes[k]) * bounds.half[k];
            let (mut values, steps) = ([n.dot(at); 8], [step(0), step(1), step(2)]);
            for (i, value) in values.iter_mut().enumerate() {
                for (k, step) in steps.iter().enumerate() {
                    *value += if i >> k & 1 == 0 { -step } else { *step };
                }
            }
            values
        };
        let (x, y, w) = (corners(rays.view.x), corners(rays.view.y), corners(rays.view.w));
        let (mut min, mut max) = ([[f64::INFINITY; 4]; 2], [[f64::NEG_INFINITY; 4]; 2]);
        for i in 0..8 {
            let reciprocal = 1.0 / w[i];
            for (k, p) in [x[i] * reciprocal, y[i] * -reciprocal].into_iter().enumerate() {
                // Four accumulators in parallel.
                min[k][i % 4] = if p < min[k][i % 4] { p } else { min[k][i % 4] };
                max[k][i % 4] = if p > max[k][i % 4] { p } else { max[k][i % 4] };
            }
        }
        let pixel = |k: usize, of: f64| (of + 1.0) * (rays.size[k] as f64 * 0.5) - 0.5;
        let least_of = |k: usize| pixel(k, min[k].into_iter().fold(f64::INFINITY, |a, b| if a < b { a } else { b }));
        let most_of = |k: usize| pixel(k, max[k].into_iter().fold(f64::NEG_INFINITY, |a, b| if a > b { a } else { b }));
        match rays.pixels([least_of(0), least_of(1)], [most_of(0), most_of(1)]) {
            Some(pixels) => Self::Within { pixels, most: 1.0 / least },
            None => Self::Beside,
        }
    }
}

/// The planes of a box as functions of the picture, in arrays; the first `nearer` face the eye. There are six; two more are zero padding.
pub(super) struct Slabs {
    pub at: [f64; 8],
    pub x: [f64; 8],
    pub y: [f64; 8],
    pub nearer: usize,
}

impl Slabs {
    /// The slabs of a box beyond the near plane.
    #[inline(always)]
    pub fn new(rays: &Rays, bounds: &Bounds) -> Self {
        let at = bounds.centre - rays.view.eye;
        let mut forms = [Form { at: 0.0, x: 0.0, y: 0.0 }; 8];
        let (mut nearer, mut farther) = (0, 6);
        let least = grown(at, bounds);
        for k in 0..3 {
            let form = rays.form(bounds.axes[k]);
            let (middle, half) = (bounds.axes[k].dot(at), bounds.half[k] + least);
            let (low, high) = (middle - half, middle + half);
            let (near, far) = if low > least {
                (Some(low), [high, high])
            } else if high < -least {
                (Some(high), [low, low])
            } else {
                // Between the planes, or so near to one that it counts as between, which only enlarges the box.
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
        Self { at: forms.map(|f| f.at), x: forms.map(|f| f.x), y: forms.map(|f| f.y), nearer }
    }
}

/// Growth of a box, metres; `at` is its centre relative to the eye.
#[inline(always)]
fn grown(at: DVec3, bounds: &Bounds) -> f64 {
    GROWN * (at.abs().element_sum() + bounds.half.element_sum())
}
