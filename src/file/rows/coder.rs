//! Binary arithmetic coding with adaptive models: a decision costs what its context makes of it, down to 1/1,400 of a bit.
//!
//! Based on: Ian H. Witten, Radford M. Neal, John G. Cleary, *Arithmetic coding for data compression*, 1987; Matt Mahoney,
//! *Adaptive weighing of context models for lossless data compression*, 2005 (the interval as its two ends, rates that fall
//! with the count).
//! Deviations: 64-bit ends, so that no carry and no lost precision need care; the end is the fewest bytes that fall into the
//! interval, zeros taken after them: a block of rows ends a byte after its last decision, most times.

/// What a context has seen so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Model {
    /// Probability of a set bit, of 65,536.
    one: u16,
    /// Decisions seen, up to [`SLOWEST`].
    seen: u8,
}

/// Decisions that a starting probability counts for.
const TRUST: u8 = 3;
/// From this many decisions on, a model changes by the same part each time.
const SLOWEST: u8 = 60;
/// Part of the way to what was seen, of 65,536, that a model goes: 1 / (decisions + 1.5).
const RATE: [u32; SLOWEST as usize + 1] = {
    let mut rate = [0; SLOWEST as usize + 1];
    let mut n = 0;
    while n <= SLOWEST as usize {
        rate[n] = (2 * 65_536) / (2 * n as u32 + 3);
        n += 1;
    }
    rate
};

impl Model {
    /// One that expects a set bit with a probability of `one` / 65,536.
    pub const fn new(one: u16) -> Self {
        Self { one, seen: TRUST }
    }

    /// Both bits alike.
    pub const EVEN: Self = Self::new(1 << 15);

    #[inline]
    fn learn(&mut self, bit: bool) {
        let rate = RATE[self.seen as usize];
        let one = u32::from(self.one);
        // The parts fall so fast that a probability never comes to 0 or 1.
        self.one = (if bit { one + (((65_535 - one) * rate) >> 16) } else { one - ((one * rate) >> 16) }) as u16;
        self.seen = (self.seen + 1).min(SLOWEST);
    }
}

/// Codes decisions, or decodes them: what walks a row is the same code either way.
pub(super) trait Coder {
    /// A decision by a model, which learns from it. Decoders take no notice of `bit`.
    fn decide(&mut self, model: &mut Model, bit: bool) -> bool;

    /// The low `count` bits of a number, each as likely set as not.
    fn plain(&mut self, count: u32, value: u32) -> u32 {
        (0..count).rev().fold(0, |out, i| out << 1 | u32::from(self.decide(&mut { Model::EVEN }, value >> i & 1 != 0)))
    }

    /// A number from 0: its length by models of its own, its bits plain (Elias's gamma code). Lengths stop at `models.len()`.
    fn number(&mut self, models: &mut [Model], value: u32) -> u32 {
        let length = (value + 1).ilog2();
        let mut n = 0;
        while n < models.len() as u32 && self.decide(&mut models[n as usize], n < length) {
            n += 1;
        }
        ((1 << n) | self.plain(n, value.wrapping_add(1))) - 1
    }
}

/// The interval that is left, both ends in it.
#[derive(Clone, Copy, Debug)]
struct Interval {
    low: u64,
    high: u64,
}

impl Interval {
    const ALL: Self = Self { low: 0, high: u64::MAX };

    /// Set bits take what is up to here.
    #[inline]
    fn middle(self, model: Model) -> u64 {
        self.low + ((self.high - self.low) >> 16) * u64::from(model.one)
    }

    #[inline]
    fn take(&mut self, middle: u64, bit: bool) {
        if bit {
            self.high = middle;
        } else {
            self.low = middle + 1;
        }
    }

    /// A byte that both ends have in common is settled.
    #[inline]
    fn shift(&mut self) -> Option<u8> {
        let settled = (self.low ^ self.high) >> 56 == 0;
        settled.then(|| {
            let byte = (self.low >> 56) as u8;
            (self.low, self.high) = (self.low << 8, self.high << 8 | 0xff);
            byte
        })
    }

    /// The fewest bytes that fall into it if zeros follow: the greatest such number.
    fn end(self) -> ([u8; 8], usize) {
        let of = |bytes: usize| if bytes == 0 { 0 } else { self.high & (u64::MAX << (64 - 8 * bytes)) };
        let bytes = (0..8).find(|&n| of(n) >= self.low).unwrap_or(8);
        (of(bytes).to_be_bytes(), bytes)
    }
}

/// Writes decisions.
#[derive(Clone, Debug)]
pub(super) struct Encoder {
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

/// Reads decisions; past its last byte it reads zeros.
#[derive(Clone, Debug)]
pub(super) struct Decoder<'a> {
    interval: Interval,
    value: u64,
    bytes: &'a [u8],
    /// Bytes that have gone into `value`, zeros among them.
    at: usize,
}

impl<'a> Decoder<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        let value = (0..8).fold(0, |value, i| value << 8 | u64::from(bytes.get(i).copied().unwrap_or(0)));
        Self { interval: Interval::ALL, value, bytes, at: 8 }
    }

    /// Whether an encoder of these decisions ends with these bytes.
    pub fn is_at_end(&self) -> bool {
        let (end, n) = self.interval.end();
        self.bytes.get(self.at - 8..) == Some(&end[..n])
    }
}

impl Coder for Decoder<'_> {
    #[inline]
    fn decide(&mut self, model: &mut Model, _: bool) -> bool {
        let middle = self.interval.middle(*model);
        let bit = self.value <= middle;
        self.interval.take(middle, bit);
        model.learn(bit);
        while self.interval.shift().is_some() {
            self.value = self.value << 8 | u64::from(self.bytes.get(self.at).copied().unwrap_or(0));
            self.at += 1;
        }
        bit
    }
}

/// Counts what decisions would cost, 1/65,536 bits.
#[derive(Clone, Debug, Default)]
pub(super) struct Meter {
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

/// -log2 of a probability in the middle of its 512th, 1/65,536 bits; by table, so that the choice of references is the same on
/// every machine.
static COST: [u32; 512] = cost_table();

/// By repeated squaring, in whole numbers.
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
