//! The part of an object's box in a cell, in six bytes.

use crate::math::geom::Aabb;
use glam::DVec3;

/// The box of an object's part in one of its cells, in 255ths of the object's own box: least x, y, z, then greatest.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PlacedBox(pub [u8; 6]);

/// The greatest step.
const STEPS: f64 = 255.0;
/// Distance within which a corner is on a step, in steps. Larger: the box might not contain its part. Smaller: rounding of a corner on a
/// step costs a whole step.
#[cfg(feature = "bake")]
const ON: f64 = 1e-9;

impl PlacedBox {
    /// The whole object.
    pub const WHOLE: Self = Self([0, 0, 0, 255, 255, 255]);

    /// The smallest one that contains `part` of `whole`.
    #[cfg(feature = "bake")]
    pub(crate) fn of(part: Aabb, whole: Aabb) -> Self {
        let steps = |p: DVec3| ((p - whole.min) / whole.size() * STEPS).to_array();
        let least = steps(part.min).map(|x| if x.is_finite() { (x + ON).floor() as u8 } else { 0 });
        let greatest = steps(part.max).map(|x| if x.is_finite() { (x - ON).ceil() as u8 } else { 255 });
        Self(std::array::from_fn(|i| if i < 3 { least[i].min(greatest[i]) } else { greatest[i - 3].max(least[i - 3]) }))
    }

    /// The smallest one that contains both.
    #[cfg(feature = "bake")]
    pub(crate) fn union(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| if i < 3 { self.0[i].min(other.0[i]) } else { self.0[i].max(other.0[i]) }))
    }

    /// Decodes the part, from the object's box.
    pub fn of_box(self, whole: Aabb) -> Aabb {
        let at = |i: usize| DVec3::from_array(std::array::from_fn(|axis| f64::from(self.0[i + axis]) / STEPS));
        let corner = |share: DVec3| whole.min * (1.0 - share) + whole.max * share;
        Aabb { min: corner(at(0)), max: corner(at(3)) }
    }

    /// True if it is not inverted.
    pub(crate) fn is_sound(self) -> bool {
        (0..3).all(|i| self.0[i] <= self.0[i + 3])
    }
}

#[cfg(all(test, feature = "bake"))]
mod tests {
    use super::*;

    #[test]
    fn a_placed_box_holds_its_part_and_is_less_than_a_step_larger() {
        let mut random = crate::math::random::SplitMix::new(7);
        let mut point = |scale: f64| DVec3::new(random.unit(), random.unit(), random.unit()) * scale;
        for scale in [1e-3, 1.0, 1e6] {
            for _ in 0..1000 {
                let whole = Aabb::of([point(scale), point(scale)]);
                let share = [point(1.0), point(1.0)].map(|s| whole.min + whole.size() * s);
                let part = Aabb::of(share);
                let found = PlacedBox::of(part, whole).of_box(whole);
                let step = whole.size() / 255.0 * (1.0 + 1e-6);
                let off = DVec3::splat(1e-8 * step.max_element());
                assert!(
                    found.min.cmple(part.min + off).all() && found.max.cmpge(part.max - off).all(),
                    "{part:?} in {whole:?}"
                );
                assert!((part.min - found.min).cmple(step).all() && (found.max - part.max).cmple(step).all());
            }
        }
        let whole = Aabb { min: DVec3::ZERO, max: DVec3::new(1.0, 0.0, 2.0) };
        assert_eq!(PlacedBox::of(whole, whole), PlacedBox([0, 0, 0, 255, 255, 255]), "flat along y");
        assert_eq!(PlacedBox::WHOLE.of_box(whole), whole);
    }
}
