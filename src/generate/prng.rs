//! Random numbers that never change: the same seed gives the same numbers on every machine.
//!
//! Based on: D. Blackman, S. Vigna, *Scrambled linear pseudorandom number generators*, 2021 (xoshiro256**), its state filled
//! by SplitMix64 (G. Steele, D. Lea, C. Flood, *Fast splittable pseudorandom number generators*, 2014). Numbers below a bound
//! come from D. Lemire's multiply-shift (2019) without its rejection step: the bias is below 2^-32 for the bounds used here.

/// A generator; streams of one seed are independent of each other.
#[derive(Clone, Debug)]
pub(crate) struct Prng([u64; 4]);

fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Prng {
    /// Stream number `stream` of `seed`.
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut state = seed;
        let mut mixed = splitmix(&mut state) ^ stream.wrapping_mul(0xd134_2543_de82_ef95);
        Self(std::array::from_fn(|_| splitmix(&mut mixed)))
    }

    /// 64 random bits.
    pub(crate) fn bits(&mut self) -> u64 {
        let s = &mut self.0;
        let result = s[1].wrapping_mul(5).rotate_left(7).wrapping_mul(9);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        result
    }

    /// Uniform in `[0, 1)`.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `[a, b)`.
    pub(crate) fn range(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.unit()
    }

    /// Uniform in `0..n`; 0 for `n = 0`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// A multiple of `step` in `a..=b`; `a` where that range is empty.
    pub(crate) fn steps(&mut self, a: i32, b: i32, step: i32) -> i32 {
        let count = (b - a).max(0) / step + 1;
        a + self.below(count as usize) as i32 * step
    }

    /// True with probability `p`.
    pub(crate) fn chance(&mut self, p: f64) -> bool {
        self.unit() < p
    }

    /// Shuffles (Fisher, Yates).
    pub(crate) fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splitmix_gives_the_published_first_numbers_of_seed_1234567() {
        let mut state = 1_234_567;
        let first: Vec<u64> = (0..3).map(|_| splitmix(&mut state)).collect();
        assert_eq!(first, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn xoshiro_gives_the_reference_numbers_of_state_1_2_3_4() {
        let mut rng = Prng([1, 2, 3, 4]);
        let first: Vec<u64> = (0..4).map(|_| rng.bits()).collect();
        assert_eq!(first, [11520, 0, 1_509_978_240, 1_215_971_899_390_074_240]);
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
