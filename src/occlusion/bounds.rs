//! Boxes around points: along the axes, along the points' principal axes, along those of their convex hull, and of about the least volume.
//!
//! Based on: Gottschalk, Lin, Manocha, *OBBTree: a hierarchical structure for rapid interference detection*, 1996 (axes from the
//! covariance of the corners, or of the hull's surface weighted by area); Ivson 2006, who compares these boxes for culling. Deviation: of
//! the three weightings of the hull that he lists, only the exact integral over the surface is here.

#[cfg(feature = "bake")]
#[path = "../../crates/studies/src/boxes/hull.rs"]
mod hull;
#[cfg(feature = "bake")]
#[path = "../../crates/studies/src/boxes/minimum.rs"]
mod minimum;

use crate::geom::Aabb;
use glam::{DMat3, DVec3};

#[cfg(feature = "bake")]
pub use hull::Hull;

/// Of the size of a box's coordinates, how much it is grown on every side. Larger: flat things get boxes that show. Smaller: the
/// roundings of a rotation, some 2^-50, leave points outside.
const ROUNDING: f64 = 1e-14;

/// How a box is fitted.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fit {
    /// Along the axes of the coordinates.
    Aligned,
    /// Along the principal axes of the points, each of the same weight.
    Covariance,
    /// Along the principal axes of their convex hull's surface: neither points inside nor their density turn it.
    #[cfg(feature = "bake")]
    Hull,
    /// Of about the least volume: see [`Bounds::minimum`].
    #[cfg(feature = "bake")]
    Minimum,
}

#[cfg(feature = "bake")]
impl Fit {
    /// Every kind, the cheapest first.
    pub const ALL: [Self; 4] = [Self::Aligned, Self::Covariance, Self::Hull, Self::Minimum];
}

/// A box that need not be aligned with anything.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bounds {
    /// The middle, metres.
    pub centre: DVec3,
    /// Unit vectors at right angles.
    pub axes: [DVec3; 3],
    /// Half its length along each axis, metres, 0 or more.
    pub half: DVec3,
}

impl Bounds {
    /// The box around some points; `None` for none.
    pub fn fit(points: &[DVec3], fit: Fit) -> Option<Self> {
        if points.is_empty() {
            return None;
        }
        Some(match fit {
            Fit::Aligned => Self::from(Aabb::of(points.iter().copied())),
            Fit::Covariance => Self::along(points, principal(spread(points))),
            #[cfg(feature = "bake")]
            Fit::Hull => Self::along(points, principal(Hull::new(points).spread())),
            #[cfg(feature = "bake")]
            Fit::Minimum => Self::minimum(&Hull::new(points)),
        })
    }

    #[cfg(feature = "bake")]
    /// The box of about the least volume around a hull, never of more than the aligned one's.
    pub fn minimum(hull: &Hull) -> Self {
        minimum::minimum(hull)
    }

    /// The least box around one point or more with the given axes (unit vectors at right angles).
    pub fn along(points: &[DVec3], axes: [DVec3; 3]) -> Self {
        let to_axes = DMat3::from_cols(axes[0], axes[1], axes[2]).transpose();
        let range = Aabb::of(points.iter().map(|&p| to_axes * p));
        let centre = to_axes.transpose() * range.centre();
        // Measured from the middle as it came out: axes are at right angles up to rounding only.
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

    /// The axis that it is longest along; the first of equals.
    pub fn longest(&self) -> DVec3 {
        let h = self.half;
        self.axes[if h.x >= h.y && h.x >= h.z { 0 } else { usize::from(h.z > h.y) + 1 }]
    }

    /// A point as distances along the axes from the middle.
    pub fn local(&self, p: DVec3) -> DVec3 {
        let p = p - self.centre;
        DVec3::from_array(self.axes.map(|axis| axis.dot(p)))
    }

    /// Distance of a point from the box, metres; 0 inside.
    #[inline]
    pub fn distance(&self, p: DVec3) -> f64 {
        (self.local(p).abs() - self.half).max(DVec3::ZERO).length()
    }

    /// Half the length of its projection onto a line along `n`: how far it reaches from its middle.
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
        // Not the half of the difference: the middle rounds, too.
        let centre = aabb.centre();
        Self {
            centre,
            axes: DMat3::IDENTITY.to_cols_array_2d().map(DVec3::from),
            half: (aabb.max - centre).max(centre - aabb.min),
        }
    }
}

/// Covariance of points, each of the same weight.
fn spread(points: &[DVec3]) -> DMat3 {
    let each = 1.0 / points.len() as f64;
    let mean = points.iter().sum::<DVec3>() * each;
    points.iter().fold(DMat3::ZERO, |sum, &p| sum + outer(p - mean)) * each
}

/// `v` times its transpose.
fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// Eigenvectors of a symmetric matrix, by Jacobi's rotations (1846): a right-handed set of unit vectors.
fn principal(matrix: DMat3) -> [DVec3; 3] {
    /// Each sweep about squares what is off the diagonal; eight are past the last bit.
    const SWEEPS: usize = 8;
    let (mut m, mut axes) = (matrix, DMat3::IDENTITY);
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = m.col(q)[p];
            if off == 0.0 {
                continue;
            }
            let theta = (m.col(q)[q] - m.col(p)[p]) / (2.0 * off);
            let tan = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let cos = 1.0 / tan.hypot(1.0);
            let mut turn = DMat3::IDENTITY;
            turn.col_mut(p)[p] = cos;
            turn.col_mut(q)[q] = cos;
            turn.col_mut(q)[p] = tan * cos;
            turn.col_mut(p)[q] = -tan * cos;
            m = turn.transpose() * m * turn;
            axes *= turn;
        }
    }
    // Products of rotations drift from right angles by some roundings.
    let x = axes.x_axis.normalize();
    let y = (axes.y_axis - x * x.dot(axes.y_axis)).normalize();
    [x, y, x.cross(y)]
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::random::Prng;
    use glam::DQuat;
    use proptest::prelude::*;

    pub fn turn(rng: &mut Prng) -> DQuat {
        let axis = point(rng).try_normalize().unwrap_or(DVec3::X);
        DQuat::from_axis_angle(axis, rng.unit() * 6.0)
    }

    /// In the cube from -1 to 1.
    pub fn point(rng: &mut Prng) -> DVec3 {
        DVec3::new(rng.unit(), rng.unit(), rng.unit()) * 2.0 - 1.0
    }

    #[test]
    fn a_turned_box_has_its_own_volume() {
        let mut rng = Prng::new(1, 0);
        for round in 0..50 {
            let half = DVec3::new(3.0, 2.0, 1.0 + 0.01 * f64::from(round));
            let (turn, at) = (turn(&mut rng), point(&mut rng) * 100.0);
            let corners = Bounds { centre: DVec3::ZERO, axes: [DVec3::X, DVec3::Y, DVec3::Z], half }.corners();
            let corners = corners.map(|p| turn * p + at);
            for fit in [Fit::Covariance, Fit::Hull, Fit::Minimum] {
                let volume = Bounds::fit(&corners, fit).unwrap().volume();
                assert!((volume / (8.0 * half.element_product()) - 1.0).abs() < 1e-9, "{fit:?} in round {round}: {volume}");
            }
        }
    }

    /// The flaw that Ivson shows: many points inside turn the box by covariance, not that of the hull.
    #[test]
    fn points_inside_do_not_turn_the_box_of_the_hull() {
        let half = DVec3::new(4.0, 2.0, 1.0);
        let mut points = Bounds { centre: DVec3::ZERO, axes: [DVec3::X, DVec3::Y, DVec3::Z], half }.corners().to_vec();
        points.extend((0..200).map(|i| DVec3::new(1.0, 1.0, 0.2) * (f64::from(i) / 200.0)));
        let of = |fit| Bounds::fit(&points, fit).unwrap().volume();
        assert!((of(Fit::Hull) - 64.0).abs() < 1e-9);
        assert!((of(Fit::Minimum) - 64.0).abs() < 1e-9);
        assert!(of(Fit::Covariance) > 80.0, "{}", of(Fit::Covariance));
    }

    #[test]
    fn a_turned_cube_and_a_turned_square_are_found() {
        // Equal sides: covariance says nothing about the axes.
        let mut rng = Prng::new(2, 0);
        for _ in 0..20 {
            let turn = turn(&mut rng);
            let cube = Bounds { centre: DVec3::ONE, axes: [DVec3::X, DVec3::Y, DVec3::Z], half: DVec3::ONE }.corners();
            let volume = Bounds::fit(&cube.map(|p| turn * p), Fit::Minimum).unwrap().volume();
            assert!((volume - 8.0).abs() < 1e-9, "{volume}");
            // Flat: what is left to minimise is the area, 2 * 2 on both sides.
            let square = [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, y)| turn * DVec3::new(x, y, 0.0));
            let area = Bounds::fit(&square, Fit::Minimum).unwrap().area();
            assert!((area - 8.0).abs() < 1e-6, "{area}");
        }
    }

    #[test]
    fn the_least_box_of_a_regular_tetrahedron_is_the_cube_of_its_edges() {
        let turn = turn(&mut Prng::new(3, 0));
        let tetrahedron = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]].map(|p| turn * DVec3::from(p));
        let volume = Bounds::fit(&tetrahedron, Fit::Minimum).unwrap().volume();
        // No face of it lies on that cube: what begins on faces must find its way, or come near.
        assert!((8.0 - 1e-9..8.8).contains(&volume), "{volume}");
    }

    #[test]
    fn points_on_a_line_and_a_single_one_have_boxes() {
        for fit in Fit::ALL {
            assert!(Bounds::fit(&[], fit).is_none());
            let one = Bounds::fit(&[DVec3::splat(3.0); 4], fit).unwrap();
            assert!(one.volume() < 1e-12 && one.distance(DVec3::splat(3.0)) < 1e-12, "{fit:?}");
            let line: Vec<DVec3> = (0..9).map(|i| DVec3::new(1.0, 2.0, -1.0) * f64::from(i)).collect();
            let of_line = Bounds::fit(&line, fit).unwrap();
            assert!(line.iter().all(|&p| of_line.distance(p) < 1e-12), "{fit:?}");
            if fit != Fit::Aligned {
                assert!(of_line.area() < 1e-9, "{fit:?}");
            }
        }
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
                // Many points alike, and in planes of many.
                if grid { p = (p * 2.0).round(); }
                (turn * p + at) * 10f64.powi(scale)
            }).collect();
            let size = points.iter().fold(1e-3, |size: f64, p| size.max(p.abs().max_element()));
            let aligned = Bounds::fit(&points, Fit::Aligned).unwrap();
            for fit in Fit::ALL {
                let bounds = Bounds::fit(&points, fit).unwrap();
                for &p in &points {
                    prop_assert!(bounds.distance(p) <= 1e-13 * size, "{fit:?}: {}", bounds.distance(p));
                }
                if fit == Fit::Minimum {
                    prop_assert!(bounds.volume() <= aligned.volume() * (1.0 + 1e-9) + 1e-12 * size.powi(3));
                }
            }
        }
    }
}
