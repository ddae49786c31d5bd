//! The camera over the pixels of a picture, in `f64`: common to oracles that test boxes against depths.

use super::view::View;
use glam::{DMat3, DVec3};

/// Bound of the relative rounding error of a linear form in `f32` within a square: under five roundings of 2^-24. Larger: surfaces at a
/// grazing angle hide less. Smaller: no longer conservative.
pub(super) const FORM_ERROR: f64 = 4e-7;
/// Bound of the error of projected corners, pixels. Larger: useless pixels are tested.
const MARGIN: f64 = 1e-3;

/// A linear function over the picture; `at` is its value at the centre of pixel (0, 0), at the top left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Form {
    pub at: f64,
    pub x: f64,
    pub y: f64,
}

impl Form {
    #[inline(always)]
    pub fn scaled(self, by: f64) -> Self {
        Self { at: self.at * by, x: self.x * by, y: self.y * by }
    }

    #[inline(always)]
    pub fn value(&self, x: usize, y: usize) -> f64 {
        (self.at + self.x * x as f64) + self.y * y as f64
    }

    /// The difference of its maximum in a square of `side` pixels to its value at the first pixel.
    #[inline(always)]
    pub fn rise(&self, side: usize) -> f64 {
        (self.x.max(0.0) + self.y.max(0.0)) * (side - 1) as f64
    }

    /// The same for the minimum.
    #[inline(always)]
    pub fn fall(&self, side: usize) -> f64 {
        (self.x.min(0.0) + self.y.min(0.0)) * (side - 1) as f64
    }

    /// Its value at the corner of the square of `side` pixels at pixel `x`, `y`, and the bound of rounding errors in `f32` within the
    /// square.
    #[inline(always)]
    pub fn within(&self, x: usize, y: usize, side: usize) -> (f64, f64) {
        let at = self.value(x, y);
        (at, FORM_ERROR * (at.abs() + (self.x.abs() + self.y.abs()) * side as f64))
    }
}

/// The camera over the pixels: the direction through pixel (x, y), 1 m along the view direction, is `origin + x * across + y * down`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rays {
    pub view: View,
    origin: DVec3,
    across: DVec3,
    down: DVec3,
    pub size: [usize; 2],
}

impl Rays {
    pub fn new(view: &View, size: [usize; 2]) -> Self {
        let unproject = DMat3::from_cols(view.x, view.y, view.w).transpose().inverse();
        let [width, height] = size.map(|s| s as f64);
        let origin = unproject * DVec3::new(1.0 / width - 1.0, 1.0 - 1.0 / height, 1.0);
        Self {
            view: *view,
            origin,
            across: unproject.x_axis * (2.0 / width),
            down: unproject.y_axis * (-2.0 / height),
            size,
        }
    }

    /// The direction through the picture's centre, 1 m along the view direction, and the offsets to the right edge and to the top.
    #[cfg(feature = "gpu")]
    pub fn frame(&self) -> [DVec3; 3] {
        let [width, height] = self.size.map(|s| s as f64);
        let (right, up) = (self.across * (width * 0.5), self.down * (height * -0.5));
        [self.origin + right * (1.0 - 1.0 / width) - up * (1.0 - 1.0 / height), right, up]
    }

    /// The dot product of `n` and each pixel's direction.
    #[inline(always)]
    pub fn form(&self, n: DVec3) -> Form {
        Form { at: n.dot(self.origin), x: n.dot(self.across), y: n.dot(self.down) }
    }

    /// Projects a point, relative to the eye and not behind it, to pixels from the centre of the first pixel.
    #[inline(always)]
    pub fn project(&self, v: DVec3) -> [f64; 2] {
        let w = 1.0 / self.view.w.dot(v);
        let [width, height] = [self.size[0] as f64 * 0.5, self.size[1] as f64 * 0.5];
        [self.view.x.dot(v) * w * width + (width - 0.5), self.view.y.dot(v) * -w * height + (height - 0.5)]
    }

    /// The pixels whose centres are between two points of the picture, first and last by axis; `None` if there are none.
    #[inline(always)]
    pub fn pixels(&self, min: [f64; 2], max: [f64; 2]) -> Option<[[usize; 2]; 2]> {
        let range = |k: usize| {
            let first = (min[k] - MARGIN).ceil().max(0.0);
            let last = (max[k] + MARGIN).floor().min((self.size[k] - 1) as f64);
            (first <= last).then_some([first as usize, last as usize])
        };
        Some([range(0)?, range(1)?])
    }
}
