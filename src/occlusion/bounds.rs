//! Oriented bounding boxes.

use crate::math::geom::Aabb;
use glam::{DMat3, DVec3};

/// Growth of a box on every side, relative to its coordinates. Larger: boxes of flat objects show. Smaller: rounding of a rotation, some
/// 2^-50, leaves points outside.
const ROUNDING: f64 = 1e-14;

/// An oriented box.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bounds {
    /// The centre, metres.
    pub centre: DVec3,
    /// Orthonormal axes.
    pub axes: [DVec3; 3],
    /// Half its length along each axis, metres, 0 or more.
    pub half: DVec3,
}

impl Bounds {
    /// The least box around at least one point with the given orthonormal axes.
    pub fn along(points: &[DVec3], axes: [DVec3; 3]) -> Self {
        let to_axes = DMat3::from_cols(axes[0], axes[1], axes[2]).transpose();
        let range = Aabb::of(points.iter().map(|&p| to_axes * p));
        let centre = to_axes.transpose() * range.centre();
        // Measured from the rounded centre: axes are orthonormal only up to rounding.
        let reach = points.iter().fold(DVec3::ZERO, |reach, &p| reach.max((to_axes * (p - centre)).abs()));
        let grown = ROUNDING * range.min.abs().max(range.max.abs()).max_element();
        Self { centre, axes, half: reach + grown }
    }

    /// Cubic metres.
    pub fn volume(&self) -> f64 {
        8.0 * self.half.x * self.half.y * self.half.z
    }

    /// Area of its six faces, square metres.
    pub fn area(&self) -> f64 {
        let h = self.half;
        8.0 * (h.x * h.y + h.y * h.z + h.z * h.x)
    }

    /// Its longest axis; the first of equals.
    pub fn longest(&self) -> DVec3 {
        let h = self.half;
        self.axes[if h.x >= h.y && h.x >= h.z { 0 } else { usize::from(h.z > h.y) + 1 }]
    }

    /// A point in the box's coordinates, relative to its centre.
    pub fn local(&self, p: DVec3) -> DVec3 {
        let p = p - self.centre;
        DVec3::from_array(self.axes.map(|axis| axis.dot(p)))
    }

    /// Distance of a point from the box, metres; 0 inside.
    #[inline]
    pub fn distance(&self, p: DVec3) -> f64 {
        (self.local(p).abs() - self.half).max(DVec3::ZERO).length()
    }

    /// Half the length of its projection onto a line along `n`.
    #[inline]
    pub fn reach(&self, n: DVec3) -> f64 {
        (0..3).map(|k| self.axes[k].dot(n).abs() * self.half[k]).sum()
    }

    /// The corners; bit `k` of the index is set at the far end of axis `k`.
    pub fn corners(&self) -> [DVec3; 8] {
        let step = |k: usize, i: usize| self.axes[k] * if i >> k & 1 == 0 { -self.half[k] } else { self.half[k] };
        std::array::from_fn(|i| self.centre + step(0, i) + step(1, i) + step(2, i))
    }
}

impl From<Aabb> for Bounds {
    fn from(aabb: Aabb) -> Self {
        // Not half of the difference, because the centre is rounded, too.
        let centre = aabb.centre();
        Self {
            centre,
            axes: DMat3::IDENTITY.to_cols_array_2d().map(DVec3::from),
            half: (aabb.max - centre).max(centre - aabb.min),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Prng;
    use crate::occlusion::scenes::turned;
    use glam::DQuat;
    use proptest::prelude::*;

    fn turn(rng: &mut Prng) -> DQuat {
        let axis = point(rng).try_normalize().unwrap_or(DVec3::X);
        DQuat::from_axis_angle(axis, rng.unit() * 6.0)
    }

    /// In the cube from -1 to 1.
    fn point(rng: &mut Prng) -> DVec3 {
        DVec3::new(rng.unit(), rng.unit(), rng.unit()) * 2.0 - 1.0
    }

    #[test]
    fn a_turned_box_has_its_own_volume() {
        let mut rng = Prng::new(1, 0);
        for round in 0..50 {
            let half = DVec3::new(3.0, 2.0, 1.0 + 0.01 * f64::from(round));
            let own = turned(point(&mut rng) * 100.0, turn(&mut rng), half);
            let around = Bounds::along(&own.corners(), own.axes);
            let volume = around.volume() / (8.0 * half.element_product());
            assert!((volume - 1.0).abs() < 1e-9, "round {round}: {volume} of it");
            assert!(around.centre.distance(own.centre) < 1e-9, "round {round}");
            assert_eq!(around.longest(), own.axes[0]);
        }
    }

    #[test]
    fn points_on_a_line_and_a_single_one_have_boxes() {
        let own = turned(DVec3::ZERO, turn(&mut Prng::new(2, 0)), DVec3::ZERO).axes;
        let one = Bounds::along(&[DVec3::splat(3.0); 4], own);
        assert!(one.volume() < 1e-12 && one.distance(DVec3::splat(3.0)) < 1e-12);
        let line: Vec<DVec3> = (0..9).map(|i| own[1] * f64::from(i)).collect();
        let of_line = Bounds::along(&line, own);
        assert!(line.iter().all(|&p| of_line.distance(p) < 1e-12) && of_line.area() < 1e-9);
    }

    proptest! {
        #[test]
        fn every_box_holds_every_point(
            seed in 0u64..1000, count in 1usize..60, flat in any::<bool>(), scale in -3i32..4, grid in any::<bool>()
        ) {
            let mut rng = Prng::new(seed, 0);
            let (turn, at) = (turn(&mut rng), point(&mut rng) * 10.0);
            let points: Vec<DVec3> = (0..count).map(|_| {
                let mut p = point(&mut rng);
                if flat { p.z = 0.0; }
                // Many equal and coplanar points.
                if grid { p = (p * 2.0).round(); }
                (turn * p + at) * 10f64.powi(scale)
            }).collect();
            let size = points.iter().fold(1e-3, |size: f64, p| size.max(p.abs().max_element()));
            let aligned = Bounds::from(Aabb::of(points.iter().copied()));
            for bounds in [aligned, Bounds::along(&points, turned(at, turn, DVec3::ONE).axes)] {
                for &p in &points {
                    prop_assert!(bounds.distance(p) <= 1e-13 * size, "{bounds:?}: {}", bounds.distance(p));
                }
            }
        }
    }
}
