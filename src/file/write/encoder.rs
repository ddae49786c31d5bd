//! The arithmetic encoder; [`crate::file::rows::coder`] has the models.

use crate::file::rows::arithmetic::{Coder, Interval, Model};

/// Encodes decisions.
#[derive(Clone, Debug)]
pub(in crate::file) struct Encoder {
    interval: Interval,
    out: Vec<u8>,
}

impl Encoder {
    pub fn new() -> Self {
        Self { interval: Interval::ALL, out: Vec::new() }
    }

    pub fn finish(mut self) -> Vec<u8> {
        let (bytes, n) = self.interval.end();
        self.out.extend(&bytes[..n]);
        self.out
    }
}

impl Coder for Encoder {
    fn decide(&mut self, model: &mut Model, bit: bool) -> bool {
        self.interval.take(self.interval.middle(*model), bit);
        model.learn(bit);
        while let Some(byte) = self.interval.shift() {
            self.out.push(byte);
        }
        bit
    }
}

/// Counts the cost of decisions, in 1/65,536 bits.
#[derive(Clone, Debug, Default)]
pub(in crate::file) struct Meter {
    pub cost: u64,
}

impl Coder for Meter {
    fn decide(&mut self, model: &mut Model, bit: bool) -> bool {
        let p = if bit { u32::from(model.one) } else { 65_536 - u32::from(model.one) };
        self.cost += u64::from(COST[p as usize >> 7]);
        model.learn(bit);
        bit
    }
}

/// -log2 of a probability at the centre of its 512th, in 1/65,536 bits; a table, so that the choice of references is the same on every
/// machine.
static COST: [u32; 512] = cost_table();

/// By repeated squaring, in integers.
const fn cost_table() -> [u32; 512] {
    let mut table = [0; 512];
    let mut i = 0;
    while i < 512 {
        // (2 i + 1) / 1024 as a number in 1..2 times a power of two.
        let x = 2 * i as u64 + 1;
        let whole = 63 - x.leading_zeros();
        let mut mantissa = x << (31 - whole);
        let (mut log, mut bit) = (whole << 16, 1 << 15);
        while bit > 0 {
            mantissa = (mantissa * mantissa) >> 31;
            if mantissa >= 1 << 32 {
                mantissa >>= 1;
                log += bit;
            }
            bit >>= 1;
        }
        table[i] = (10 << 16) - log;
        i += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::rows::arithmetic::Decoder;

    /// Decisions by three models: mostly set, mostly clear, anything.
    fn decisions(n: usize) -> Vec<(usize, bool)> {
        let mut x = 7u64;
        (0..n)
            .map(|_| {
                x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let k = (x >> 40) as usize % 3;
                (k, (x >> 50) % 100 < [97, 2, 50][k])
            })
            .collect()
    }

    #[test]
    fn decisions_are_read_as_they_were_written_and_end_where_they_end() {
        for n in [0, 1, 2, 7, 50, 5000] {
            let list = decisions(n);
            let (mut encoder, mut models) = (Encoder::new(), [Model::EVEN; 3]);
            list.iter().for_each(|&(k, bit)| assert_eq!(encoder.decide(&mut models[k], bit), bit));
            let bytes = encoder.finish();
            let (mut decoder, mut models) = (Decoder::new(&bytes), [Model::EVEN; 3]);
            list.iter().for_each(|&(k, bit)| assert_eq!(decoder.decide(&mut models[k], !bit), bit));
            assert!(decoder.is_at_end(), "{n}");
            let longer = [&bytes[..], &[0]].concat();
            let (mut decoder, mut models) = (Decoder::new(&longer), [Model::EVEN; 3]);
            list.iter().for_each(|&(k, bit)| assert_eq!(decoder.decide(&mut models[k], !bit), bit));
            assert!(!decoder.is_at_end(), "{n}");
        }
    }

    #[test]
    fn decisions_cost_their_entropy() {
        let list = decisions(30_000);
        let (mut encoder, mut models, mut meter) = (Encoder::new(), [Model::EVEN; 3], Meter::default());
        let mut metered = models;
        list.iter().for_each(|&(k, bit)| {
            encoder.decide(&mut models[k], bit);
            meter.decide(&mut metered[k], bit);
        });
        let entropy = |p: f64| -p * p.log2() - (1.0 - p) * (1.0 - p).log2();
        let expected = 10_000.0 * (entropy(0.97) + entropy(0.02) + 1.0);
        let bits = encoder.finish().len() as f64 * 8.0;
        assert!((0.98..1.05).contains(&(bits / expected)), "{bits} bits, entropy {expected}");
        let metered = meter.cost as f64 / 65_536.0;
        assert!((0.98..1.02).contains(&(metered / bits)), "{metered} {bits}");
    }

    #[test]
    fn numbers_of_any_length() {
        let numbers: Vec<u32> = (0..300).chain([1 << 20, (1 << 31) - 2]).collect();
        let (mut encoder, mut models) = (Encoder::new(), [Model::EVEN; 31]);
        numbers.iter().for_each(|&n| assert_eq!(encoder.number(&mut models, n), n));
        let bytes = encoder.finish();
        let (mut decoder, mut models) = (Decoder::new(&bytes), [Model::EVEN; 31]);
        numbers.iter().for_each(|&n| assert_eq!(decoder.number(&mut models, 0), n));
    }
}
