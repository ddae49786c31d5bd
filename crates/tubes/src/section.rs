//! One section of a tube, in 16 bytes.

use half::f16;
use std::f32::consts::TAU;

/// Source of a section's tangent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Tangent {
    /// The circle through the section and its neighbours; at an open end, through the next two sections.
    Circle,
    /// The segment before it.
    Before,
    /// The segment after it.
    After,
}

/// A section: a point of the curve, the tube's radius there, and the roll of its ring.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Section {
    /// Metres, relative to the tube's origin.
    pub place: [f32; 3],
    /// The radius, metres: half precision, 11 bits.
    radius: u16,
    /// 2 bits of [`Tangent`], below them 14 of the roll.
    turn: u16,
}

/// Steps of a full turn.
const STEPS: u16 = 1 << 14;

impl Section {
    /// A section with a radius (metres, above 0) and a roll (radians).
    pub fn new(place: [f32; 3], radius: f32, tangent: Tangent, roll: f32) -> Self {
        let steps = (roll / TAU * f32::from(STEPS)).round().rem_euclid(f32::from(STEPS));
        let tangent = match tangent {
            Tangent::Circle => 0,
            Tangent::Before => STEPS,
            Tangent::After => 2 * STEPS,
        };
        Self { place, radius: f16::from_f32(radius).to_bits(), turn: tangent | (steps as u16 % STEPS) }
    }

    /// The radius, metres.
    pub fn radius(&self) -> f32 {
        f16::from_bits(self.radius).to_f32()
    }

    /// Source of its tangent.
    pub fn tangent(&self) -> Tangent {
        match self.turn / STEPS {
            1 => Tangent::Before,
            2 => Tangent::After,
            _ => Tangent::Circle,
        }
    }

    /// Its 16 bytes, little endian: place, radius, and its tangent's kind with the roll.
    pub fn bytes(&self) -> [u8; 16] {
        let [x, y, z] = self.place.map(f32::to_bits);
        let last = u32::from(self.radius) | u32::from(self.turn) << 16;
        let mut bytes = [0; 16];
        for (to, word) in bytes.as_chunks_mut::<4>().0.iter_mut().zip([x, y, z, last]) {
            *to = word.to_le_bytes();
        }
        bytes
    }

    /// Angle from the tangent's first axis to the ring's first corner, radians: 0 to 2 pi.
    pub fn roll(&self) -> f32 {
        f32::from(self.turn % STEPS) / f32::from(STEPS) * TAU
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_bytes_hold_radius_tangent_and_roll() {
        assert_eq!(size_of::<Section>(), 16);
        for radius in [1e-6f32, 0.0127, 0.5, 1e4] {
            for (tangent, roll) in [(Tangent::Circle, 0.0), (Tangent::Before, 1.0), (Tangent::After, -1.0)] {
                let section = Section::new([1.0, 2.0, 3.0], radius, tangent, roll);
                // Half precision: 2^-11 of the radius, or 2^-25 m if that is more.
                assert!((section.radius() - radius).abs() <= radius / 2048.0 + 3e-8, "{radius}");
                assert_eq!(section.tangent(), tangent);
                assert!((section.roll() - roll.rem_euclid(TAU)).abs() < TAU / 16384.0, "{roll}");
            }
        }
    }
}
