//! Eight numbers side by side: what fits a register, or two.

/// Pixels along the side of a tile, and tiles along that of a block.
pub(super) const SIDE: usize = 8;
/// Pixels of a row, or tiles.
pub(super) const COUNT: Lanes = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Values side by side, one a pixel of a tile's row, or a tile of a block's row.
pub(super) type Lanes = [f32; SIDE];

/// The lesser; one instruction a register, which [`f32::min`] is not. No argument is a NaN.
#[inline(always)]
pub(super) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater, likewise.
#[inline(always)]
pub(super) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// All bits where it is so: masks of a register's lanes.
#[inline(always)]
pub(super) fn ones(is_so: bool) -> u32 {
    0u32.wrapping_sub(u32::from(is_so))
}

/// One number where the mask has its bits, another where it has none.
#[inline(always)]
pub(super) fn chosen(mask: u32, new: f32, old: f32) -> f32 {
    f32::from_bits((new.to_bits() & mask) | (old.to_bits() & !mask))
}
