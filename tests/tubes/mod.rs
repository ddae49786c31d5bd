//! Tubes.

mod bake;
mod curves;
mod select;

use enfilade_tubes::curve::{Arc, Piece};
use glam::{DVec3, dvec3};
use std::f64::consts::FRAC_PI_2;

/// A line along +X, an elbow, and a line along -Z, about 5 m; the elbow's middle is at (2, 0, -bend).
fn elbow(bend: f64) -> Vec<Piece> {
    let arc = Arc { middle: dvec3(2.0, 0.0, -bend), x: dvec3(0.0, 0.0, bend), y: dvec3(bend, 0.0, 0.0), angle: FRAC_PI_2 };
    let [from, to] = [arc.at(0.0), arc.at(FRAC_PI_2)];
    vec![Piece::Line([DVec3::ZERO, from]), Piece::Arc(arc), Piece::Line([to, to - 3.0 * DVec3::Z])]
}

/// Points of a helix, 0.1 radians apart.
fn helix(count: u32, pitch: f64) -> Vec<DVec3> {
    (0..count).map(|k| 0.1 * f64::from(k)).map(|t| dvec3(t.cos(), pitch * t, t.sin())).collect()
}

/// Names, points, radii, and whether they are closed.
fn stiff() -> [(&'static str, Vec<DVec3>, f64, bool); 10] {
    let far = DVec3::splat(1e7);
    let corner = || vec![DVec3::ZERO, DVec3::X, dvec3(1.0, 1.0, 0.0)];
    [
        ("two points 1 nm apart", vec![DVec3::ZERO, dvec3(1e-9, 0.0, 0.0)], 1.0, false),
        ("a radius of 1 um", corner(), 1e-6, false),
        ("a radius of 10 km", corner(), 1e4, false),
        ("far away", vec![far, far + DVec3::X, far + DVec3::ONE], 0.1, false),
        ("a spike", vec![DVec3::ZERO, dvec3(10.0, 0.0, 0.0), dvec3(0.0, 0.2, 0.0)], 0.1, false),
        ("a helix", helix(20_000, 0.05), 0.1, false),
        ("a ring", helix(62, 0.0), 0.1, true),
        ("a triangle", vec![DVec3::ZERO, DVec3::X, DVec3::Y], 0.1, true),
        ("along -Z", vec![DVec3::Z, DVec3::ZERO, dvec3(1e-3, 0.0, -1.0)], 0.1, false),
        ("a line of 10,000 points", (0..10_000).map(|k| dvec3(0.001 * f64::from(k), 0.0, 0.0)).collect(), 0.1, false),
    ]
}
