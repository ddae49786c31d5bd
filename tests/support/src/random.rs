//! Seeded numbers, the same everywhere.

use glam::{DMat3, DQuat, DVec3};
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::SplitMix64;

/// Words of SplitMix64 and what is made of them.
pub struct Random(SplitMix64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::seed_from_u64(seed))
    }

    pub fn word(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Below `n`; 0 where there is nothing below.
    pub fn below(&mut self, n: usize) -> usize {
        (self.word() % n.max(1) as u64) as usize
    }

    /// In `low..high`.
    pub fn real(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.word() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In -1..1.
    pub fn signed(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Any way, of length 1.
    pub fn direction(&mut self) -> DVec3 {
        let y = 2.0 * self.real(0.0, 1.0) - 1.0;
        let (sin, cos) = (std::f64::consts::TAU * self.real(0.0, 1.0)).sin_cos();
        let r = (1.0 - y * y).sqrt();
        DVec3::new(r * cos, y, r * sin)
    }

    pub fn chance(&mut self, p: f64) -> bool {
        self.real(0.0, 1.0) < p
    }

    /// Of a convex polygon, by area.
    pub fn point_of(&mut self, polygon: &[DVec3]) -> DVec3 {
        let a = polygon[0];
        let triangles = || polygon[1..].windows(2).map(|w| [w[0] - a, w[1] - a]);
        let area = |[u, v]: [DVec3; 2]| u.cross(v).length();
        let mut left = self.real(0.0, triangles().map(area).sum());
        let within = |triangle: &[DVec3; 2]| {
            left -= area(*triangle);
            left < 0.0
        };
        let [u, v] = triangles().find(within).unwrap_or([polygon[1] - a, polygon[2] - a]);
        let (s, t) = (self.real(0.0, 1.0), self.real(0.0, 1.0));
        if s + t > 1.0 { a + u * (1.0 - s) + v * (1.0 - t) } else { a + u * s + v * t }
    }
}

/// Numbers in `0..1` of a linear congruence (Knuth's MMIX), and places made of them.
pub struct Places(u64);

impl Places {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// In `0..1`.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    fn units(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit())
    }

    /// In the cube from -1 to 1.
    pub fn point(&mut self) -> DVec3 {
        self.units() * 2.0 - 1.0
    }

    /// In a box.
    pub fn between(&mut self, a: DVec3, b: DVec3) -> DVec3 {
        a + (b - a) * self.units()
    }

    /// Axes turned any way.
    pub fn frame(&mut self) -> DMat3 {
        DMat3::from_quat(DQuat::from_scaled_axis(self.point() * 3.0))
    }
}
