//! Vectors of eight numbers, in two registers of four.
//!
//! Registers are explicit and not left to the compiler, which scalarized loops over eight numbers in some builds.

use glam::{BVec4A, Vec4};
use std::ops::{Add, BitAnd, BitOr, Mul, Not, Sub};

/// Pixels along the side of a tile, and tiles along that of a block.
pub(super) const SIDE: usize = 8;
/// Pixels of a row, or tiles.
pub(super) const COUNT: Lanes = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Values in memory, one per pixel of a tile's row, or per tile of a block's row.
pub(super) type Lanes = [f32; SIDE];

/// The same in registers.
#[derive(Clone, Copy)]
pub(super) struct F32x8(Vec4, Vec4);

/// A boolean for each of eight lanes.
#[derive(Clone, Copy)]
pub(super) struct Mask8(BVec4A, BVec4A);

impl F32x8 {
    pub const COUNT: Self = Self(Vec4::new(0.0, 1.0, 2.0, 3.0), Vec4::new(4.0, 5.0, 6.0, 7.0));
    pub const ZERO: Self = Self(Vec4::ZERO, Vec4::ZERO);
    pub const INFINITY: Self = Self(Vec4::INFINITY, Vec4::INFINITY);

    #[inline(always)]
    pub fn splat(value: f32) -> Self {
        Self(Vec4::splat(value), Vec4::splat(value))
    }

    #[inline(always)]
    pub fn load(from: &Lanes) -> Self {
        let [a, b, c, d, e, f, g, h] = *from;
        Self(Vec4::new(a, b, c, d), Vec4::new(e, f, g, h))
    }

    #[inline(always)]
    pub fn store(self, to: &mut Lanes) {
        let ([a, b, c, d], [e, f, g, h]) = (self.0.to_array(), self.1.to_array());
        *to = [a, b, c, d, e, f, g, h];
    }

    /// The minimum; with a NaN argument, either.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }

    /// The maximum, likewise.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }

    /// The least of the eight.
    #[inline(always)]
    pub fn least(self) -> f32 {
        self.0.min(self.1).min_element()
    }

    #[inline(always)]
    pub fn less(self, other: Self) -> Mask8 {
        Mask8(self.0.cmplt(other.0), self.1.cmplt(other.1))
    }

    #[inline(always)]
    pub fn at_least(self, other: Self) -> Mask8 {
        Mask8(self.0.cmpge(other.0), self.1.cmpge(other.1))
    }

    #[inline(always)]
    pub fn is_nan(self) -> Mask8 {
        Mask8(self.0.is_nan_mask(), self.1.is_nan_mask())
    }
}

impl Add for F32x8 {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}

impl Sub for F32x8 {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}

impl Mul<f32> for F32x8 {
    type Output = Self;

    #[inline(always)]
    fn mul(self, by: f32) -> Self {
        Self(self.0 * by, self.1 * by)
    }
}

impl Mask8 {
    pub const ALL: Self = Self(BVec4A::TRUE, BVec4A::TRUE);

    /// New values where set, old ones elsewhere.
    #[inline(always)]
    pub fn choose(self, new: F32x8, old: F32x8) -> F32x8 {
        F32x8(Vec4::select(self.0, new.0, old.0), Vec4::select(self.1, new.1, old.1))
    }

    /// A bit for each lane.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0.bitmask() | self.1.bitmask() << 4
    }
}

impl BitAnd for Mask8 {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0, self.1 & other.1)
    }
}

impl BitOr for Mask8 {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0, self.1 | other.1)
    }
}

impl Not for Mask8 {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}
