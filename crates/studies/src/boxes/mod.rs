//! Boxes fitted to points: along the axes, along the points' principal axes, along those of their convex hull, and of about the least volume.
//!
//! Based on: Gottschalk, Lin, Manocha, *OBBTree: a hierarchical structure for rapid interference detection*, 1996 (axes from the
//! covariance of the corners, or of the hull's surface weighted by area); Ivson 2006, who compares these boxes for culling. Deviation: of
//! the three weightings of the hull that he lists, only the exact integral over the surface is here.

mod hull;
mod minimum;

use enfilade::math::geom::Aabb;
use enfilade::occlusion::bounds::Bounds;
use glam::{DMat3, DVec3};

pub use hull::Hull;
pub use minimum::minimum;

/// How a box is fitted.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fit {
    /// Along the axes of the coordinates.
    Aligned,
    /// Along the principal axes of the points, each of the same weight.
    Covariance,
    /// Along the principal axes of their convex hull's surface: neither points inside nor their density turn it.
    Hull,
    /// Of about the least volume: see [`minimum()`].
    Minimum,
}

impl Fit {
    /// Every kind, the cheapest first.
    pub const ALL: [Self; 4] = [Self::Aligned, Self::Covariance, Self::Hull, Self::Minimum];
}

/// The box around some points; `None` for none.
pub fn fit(points: &[DVec3], fit: Fit) -> Option<Bounds> {
    if points.is_empty() {
        return None;
    }
    Some(match fit {
        Fit::Aligned => Bounds::from(Aabb::of(points.iter().copied())),
        Fit::Covariance => Bounds::along(points, principal(spread(points))),
        Fit::Hull => Bounds::along(points, principal(Hull::new(points).spread())),
        Fit::Minimum => minimum(&Hull::new(points)),
    })
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
mod tests {
    use super::*;
    use enfilade::math::random::Prng;
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
            for by in [Fit::Covariance, Fit::Hull, Fit::Minimum] {
                let volume = fit(&corners, by).unwrap().volume();
                assert!((volume / (8.0 * half.element_product()) - 1.0).abs() < 1e-9, "{by:?} in round {round}: {volume}");
            }
        }
    }

    /// The flaw that Ivson shows: many points inside turn the box by covariance, not that of the hull.
    #[test]
    fn points_inside_do_not_turn_the_box_of_the_hull() {
        let half = DVec3::new(4.0, 2.0, 1.0);
        let mut points = Bounds { centre: DVec3::ZERO, axes: [DVec3::X, DVec3::Y, DVec3::Z], half }.corners().to_vec();
        points.extend((0..200).map(|i| DVec3::new(1.0, 1.0, 0.2) * (f64::from(i) / 200.0)));
        let of = |by| fit(&points, by).unwrap().volume();
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
            let volume = fit(&cube.map(|p| turn * p), Fit::Minimum).unwrap().volume();
            assert!((volume - 8.0).abs() < 1e-9, "{volume}");
            // Flat: what is left to minimise is the area, 2 * 2 on both sides.
            let square = [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)].map(|(x, y)| turn * DVec3::new(x, y, 0.0));
            let area = fit(&square, Fit::Minimum).unwrap().area();
            assert!((area - 8.0).abs() < 1e-6, "{area}");
        }
    }

    #[test]
    fn the_least_box_of_a_regular_tetrahedron_is_the_cube_of_its_edges() {
        let turn = turn(&mut Prng::new(3, 0));
        let tetrahedron = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]].map(|p| turn * DVec3::from(p));
        let volume = fit(&tetrahedron, Fit::Minimum).unwrap().volume();
        // No face of it lies on that cube: what begins on faces must find its way, or come near.
        assert!((8.0 - 1e-9..8.8).contains(&volume), "{volume}");
    }

    #[test]
    fn points_on_a_line_and_a_single_one_have_boxes() {
        for by in Fit::ALL {
            assert!(fit(&[], by).is_none());
            let one = fit(&[DVec3::splat(3.0); 4], by).unwrap();
            assert!(one.volume() < 1e-12 && one.distance(DVec3::splat(3.0)) < 1e-12, "{by:?}");
            let line: Vec<DVec3> = (0..9).map(|i| DVec3::new(1.0, 2.0, -1.0) * f64::from(i)).collect();
            let of_line = fit(&line, by).unwrap();
            assert!(line.iter().all(|&p| of_line.distance(p) < 1e-12), "{by:?}");
            if by != Fit::Aligned {
                assert!(of_line.area() < 1e-9, "{by:?}");
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
            let aligned = fit(&points, Fit::Aligned).unwrap();
            for by in Fit::ALL {
                let bounds = fit(&points, by).unwrap();
                for &p in &points {
                    prop_assert!(bounds.distance(p) <= 1e-13 * size, "{by:?}: {}", bounds.distance(p));
                }
                if by == Fit::Minimum {
                    prop_assert!(bounds.volume() <= aligned.volume() * (1.0 + 1e-9) + 1e-12 * size.powi(3));
                }
            }
        }
    }
}
