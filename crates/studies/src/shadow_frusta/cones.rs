//! Cones around shadows: most boxes are outside of most shadows, and one product tells. They decide nothing but whom to ask
//! further.

use super::culler::MOST_SHADOWS;
use enfilade::occlusion::bounds::Bounds;
use glam::DVec3;

/// The cones of a frame's shadows, their tips at the eye.
#[derive(Clone, Debug)]
pub struct Cones {
    count: usize,
    /// Unit vectors, by component.
    axes: [[f32; MOST_SHADOWS]; 3],
    /// Cosine and sine of half the opening angle.
    cosines: [f32; MOST_SHADOWS],
    sines: [f32; MOST_SHADOWS],
}

/// Shadows, as bits.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// Those that may hide a box: its middle is in the cone.
    pub may_hide: u64,
    /// Those that may fall on a part of it.
    pub touching: u64,
}

impl Cones {
    pub fn new() -> Self {
        let zero = [0.0; MOST_SHADOWS];
        Self { count: 0, axes: [zero; 3], cosines: zero, sines: zero }
    }

    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds the cone around some directions, unit vectors.
    pub fn push(&mut self, directions: impl Iterator<Item = DVec3> + Clone) {
        let axis = directions.clone().sum::<DVec3>().normalize_or_zero();
        let cosine = directions.map(|d| axis.dot(d)).fold(1.0, f64::min);
        // What opens further than half of space isn't within a cone.
        let cosine = if cosine > 0.0 { cosine } else { -1.0 };
        (0..3).for_each(|k| self.axes[k][self.count] = axis[k] as f32);
        self.cosines[self.count] = cosine as f32;
        self.sines[self.count] = (1.0 - cosine * cosine).max(0.0).sqrt() as f32;
        self.count += 1;
    }

    /// Which of some shadows a box meets; `at` is its middle, from the eye.
    pub fn met(&self, bounds: &Bounds, at: DVec3, among: u64) -> Met {
        let (distance, radius) = (at.length(), bounds.half.length());
        let [x, y, z] = (at / distance).to_array().map(|v| v as f32);
        let mut products = [0.0f32; MOST_SHADOWS];
        for (k, product) in products.iter_mut().enumerate() {
            *product = x * self.axes[0][k] + y * self.axes[1][k] + z * self.axes[2][k];
        }
        let sine = (radius / distance) as f32;
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        let mut met = Met { may_hide: 0, touching: 0 };
        let mut left = among;
        while left != 0 {
            let k = left.trailing_zeros() as usize;
            left &= left - 1;
            met.may_hide |= u64::from(products[k] >= self.cosines[k]) << k;
            // Cosine of the sum of half the angles of both; the eye may be in the ball around the box.
            let apart = products[k] < self.cosines[k] * cosine - self.sines[k] * sine;
            met.touching |= u64::from(!apart || sine >= 1.0) << k;
        }
        met
    }
}
