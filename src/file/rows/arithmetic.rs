//! Binary arithmetic coding with adaptive models: the cost of a decision depends on its context, down to 1/1,400 of a bit.
//!
//! Based on: Ian H. Witten, Radford M. Neal, John G. Cleary, *Arithmetic coding for data compression*, 1987; Matt Mahoney, *Adaptive
//! weighing of context models for lossless data compression*, 2005 (the interval as its two ends, rates that fall with the count).
//! Deviations: 64-bit ends, so that carries and loss of precision need no special handling; the output ends with the fewest bytes in the
//! interval, followed by implied zeros.

/// Adaptive probability of a context.
#[derive(Clone, Copy, Debug)]
pub(in crate::file) struct Model {
    /// Probability of a set bit, in 65,536ths.
    pub(in crate::file) one: u16,
    /// Number of decisions, up to [`SLOWEST`].
    seen: u8,
}

/// Weight of a starting probability, in decisions.
const TRUST: u8 = 3;
/// Number of decisions from which the adaptation rate is constant.
const SLOWEST: u8 = 60;
/// Adaptation rate by number of decisions, in 65,536ths: 1 / (decisions + 1.5).
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
    /// A model with probability `one` / 65,536 of a set bit.
    pub const fn new(one: u16) -> Self {
        Self { one, seen: TRUST }
    }

    /// Equal probability of both bits.
    pub const EVEN: Self = Self::new(1 << 15);

    #[inline]
    pub(in crate::file) fn learn(&mut self, bit: bool) {
        let rate = RATE[self.seen as usize];
        let one = u32::from(self.one);
        // The rates decrease fast enough that a probability never reaches 0 or 1.
        self.one = (if bit { one + (((65_535 - one) * rate) >> 16) } else { one - ((one * rate) >> 16) }) as u16;
        self.seen = (self.seen + 1).min(SLOWEST);
    }
}

/// Encodes or decodes decisions: both directions share the code that walks a row.
pub(in crate::file) trait Coder {
    /// Codes a decision by a model, and updates the model. Decoders ignore `bit`.
    fn decide(&mut self, model: &mut Model, bit: bool) -> bool;

    /// True if more bytes were read than exist.
    fn is_beyond(&self) -> bool {
        false
    }

    /// Codes the low `count` bits of a number with equal probabilities.
    fn plain(&mut self, count: u32, value: u32) -> u32 {
        (0..count).rev().fold(0, |out, i| out << 1 | u32::from(self.decide(&mut { Model::EVEN }, value >> i & 1 != 0)))
    }

    /// Codes a number from 0: its length by adaptive models, its bits plain (Elias's gamma code). Lengths are at most `models.len()`.
    fn number(&mut self, models: &mut [Model], value: u32) -> u32 {
        let length = (value + 1).ilog2();
        let mut n = 0;
        while n < models.len() as u32 && self.decide(&mut models[n as usize], n < length) {
            n += 1;
        }
        ((1 << n) | self.plain(n, value.wrapping_add(1))) - 1
    }
}

/// The current interval, with both ends included.
#[derive(Clone, Copy, Debug)]
pub(in crate::file) struct Interval {
    pub(in crate::file) low: u64,
    pub(in crate::file) high: u64,
}

impl Interval {
    pub(in crate::file) const ALL: Self = Self { low: 0, high: u64::MAX };

    /// End of the part for set bits.
    #[inline]
    pub(in crate::file) fn middle(self, model: Model) -> u64 {
        self.low + ((self.high - self.low) >> 16) * u64::from(model.one)
    }

    #[inline]
    pub(in crate::file) fn take(&mut self, middle: u64, bit: bool) {
        if bit {
            self.high = middle;
        } else {
            self.low = middle + 1;
        }
    }

    /// Shifts out a byte that both ends have in common.
    #[inline]
    pub(in crate::file) fn shift(&mut self) -> Option<u8> {
        let settled = (self.low ^ self.high) >> 56 == 0;
        settled.then(|| {
            let byte = (self.low >> 56) as u8;
            (self.low, self.high) = (self.low << 8, self.high << 8 | 0xff);
            byte
        })
    }

    /// The fewest bytes in the interval if zeros follow: the greatest such number.
    pub(in crate::file) fn end(self) -> ([u8; 8], usize) {
        let of = |bytes: usize| if bytes == 0 { 0 } else { self.high & (u64::MAX << (64 - 8 * bytes)) };
        let bytes = (0..8).find(|&n| of(n) >= self.low).unwrap_or(8);
        (of(bytes).to_be_bytes(), bytes)
    }
}

/// Decodes decisions; beyond the last byte it reads zeros.
#[derive(Clone, Debug)]
pub(in crate::file) struct Decoder<'a> {
    interval: Interval,
    value: u64,
    bytes: &'a [u8],
    /// Bytes shifted into `value`, including implied zeros.
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

    fn is_beyond(&self) -> bool {
        self.at - 8 > self.bytes.len()
    }
}
