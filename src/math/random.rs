//! Deterministic random numbers: the same seed gives the same numbers on every machine.
//!
//! Generators are those of `rand_xoshiro`: xoshiro256** (D. Blackman, S. Vigna, *Scrambled linear pseudorandom number generators*, 2021)
//! for long streams, SplitMix64 (G. Steele, D. Lea, C. Flood, *Fast splittable pseudorandom number generators*, 2014) for many streams.
//! Numbers below a bound come from D. Lemire's multiply-shift (2019) without its rejection step: the bias is below 2^-32 for the bounds
//! used here.

#[cfg(feature = "bake")]
use glam::DVec3;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::{SplitMix64, Xoshiro256StarStar};

/// A generator; streams of one seed are independent of each other.
#[derive(Clone, Debug)]
pub struct Prng(Xoshiro256StarStar);

impl Prng {
    /// Stream number `stream` of `seed`.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mixed = SplitMix64::seed_from_u64(seed).next_u64() ^ stream.wrapping_mul(0xd134_2543_de82_ef95);
        Self(Xoshiro256StarStar::seed_from_u64(mixed))
    }

    /// 64 random bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `[a, b)`.
    #[cfg(feature = "bake")]
    pub fn range(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }

    /// Uniform in `0..n`; 0 for `n = 0`.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// A multiple of `step` in `a..=b`; `a` if that range is empty.
    #[cfg(feature = "bake")]
    pub fn steps(&mut self, a: i32, b: i32, step: i32) -> i32 {
        let count = (b - a).max(0) / step + 1;
        a + self.below(count as usize) as i32 * step
    }

    /// True with probability `p`.
    #[cfg(feature = "bake")]
    pub fn chance(&mut self, p: f64) -> bool {
        self.unit() < p
    }

    /// Shuffles (Fisher, Yates).
    #[cfg(feature = "bake")]
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

/// SplitMix64: a sequence for each seed, with cheap initialization.
#[cfg(feature = "bake")]
pub(crate) struct SplitMix(SplitMix64);

#[cfg(feature = "bake")]
impl SplitMix {
    /// The sequence of a seed.
    pub(crate) fn new(seed: u64) -> Self {
        Self(SplitMix64::seed_from_u64(seed))
    }

    /// The next 64 random bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// The next number in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform over the sphere (Marsaglia, *Choosing a point from the surface of a sphere*, 1972, whose method needs only a square root, so
    /// that it gives the same bits on every machine).
    pub(crate) fn direction(&mut self) -> DVec3 {
        loop {
            let (x, y) = (2.0 * self.unit() - 1.0, 2.0 * self.unit() - 1.0);
            let s = x * x + y * y;
            if s < 1.0 {
                let r = 2.0 * (1.0 - s).sqrt();
                return DVec3::new(x * r, y * r, 1.0 - 2.0 * s);
            }
        }
    }
}

/// The first number of a seed's sequence: a hash of it.
#[cfg(feature = "bake")]
pub fn mixed(seed: u64) -> u64 {
    SplitMix::new(seed).bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that earlier bakes depend on.
    #[test]
    fn streams_stay_what_they_were() {
        let first = |seed, stream| Prng::new(seed, stream).bits();
        assert_eq!([first(0, 0), first(7, 1)], [18_110_106_563_157_542_208, 3_551_196_810_685_514_886]);
    }

    #[test]
    fn bounds_hold_and_streams_differ() {
        let (mut a, mut b) = (Prng::new(7, 0), Prng::new(7, 1));
        assert_ne!(a.bits(), b.bits());
        for _ in 0..1000 {
            assert!(a.below(5) < 5 && (0.0..1.0).contains(&a.unit()));
            let s = a.steps(100, 260, 50);
            assert!((100..=250).contains(&s) && s % 50 == 0);
        }
        assert_eq!((a.below(0), a.steps(10, 3, 5)), (0, 10));
    }
}
