//! Boxes around all of Teapots(n, 10), as in Ivson's table 6.2.1. He has nine builders. Here are the four of
//! `enfilade_studies::boxes` and two of his that it lacks; left out are two weightings of the hull whose means aren't those of its surface (Hull_Unif_1,
//! Hull_Unif_3), and two grids of directions (Min_Aprox_GA, Min_Aprox_G), in whose place stands that of about
//! the least volume.

use crate::study::imported;
use enfilade::occlusion::bounds::Bounds;
use enfilade_scenes::Kind;
use enfilade_studies::boxes::{self, Fit, Hull};
use glam::DVec3;
use std::time::Instant;

const SCALE: usize = 10;
/// Rounds from one farthest point to the next. They end by themselves mostly before.
const ROUNDS: usize = 8;
/// Of the size of a scene, how far a point may be out of its box: roundings.
const ROUNDING: f64 = 1e-12;

type Builder = fn(&[DVec3]) -> Bounds;

/// Names as in the study, and what is beside them.
const BUILDERS: [(&str, Builder); 6] = [
    ("AABB: `Fit::Aligned`", |points| fit(points, Fit::Aligned)),
    ("Covar: `Fit::Covariance`", |points| fit(points, Fit::Covariance)),
    ("Hull_Covar: covariance of the hull's corners", |points| of_hull(points)),
    ("Hull_Unif_2: `Fit::Hull`", |points| fit(points, Fit::Hull)),
    ("Min_Aprox: diameters", |points| by_diameters(points)),
    ("`Fit::Minimum`", |points| fit(points, Fit::Minimum)),
];

fn fit(points: &[DVec3], by: Fit) -> Bounds {
    boxes::fit(points, by).expect("there are points")
}

fn of_hull(points: &[DVec3]) -> Bounds {
    let axes = fit(&Hull::new(points).points, Fit::Covariance).axes;
    Bounds::along(points, axes)
}

/// Along the diameter, the diameter across that, and the third direction; then, while that gains, along each axis of the
/// best box and the diameter across it (Barequet, Har-Peled 2001, as Ivson describes their program).
fn by_diameters(points: &[DVec3]) -> Bounds {
    let along = |u: DVec3| {
        let w = diameter(points, Some(u));
        Bounds::along(points, [u, w, u.cross(w)])
    };
    let mut best = along(diameter(points, None));
    for _ in 0..ROUNDS {
        let better = best.axes.map(along).into_iter().min_by(|a, b| a.volume().total_cmp(&b.volume())).expect("three");
        if better.volume() >= best.volume() {
            break;
        }
        best = better;
    }
    best
}

/// The direction between two points that are about as far apart as any, seen along `across`.
fn diameter(points: &[DVec3], across: Option<DVec3>) -> DVec3 {
    let flat = |p: DVec3| across.map_or(p, |u| p - u * u.dot(p));
    let (mut from, mut way) = (flat(points[0]), DVec3::ZERO);
    for _ in 0..ROUNDS {
        let far =
            points.iter().map(|&p| flat(p)).max_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)));
        let far = far.expect("there are points");
        if far.distance_squared(from) <= way.length_squared() {
            break;
        }
        (way, from) = (far - from, far);
    }
    // At a right angle to the last bit.
    flat(way).normalize()
}

pub fn table(is_test: bool) {
    let counts: &[usize] = if is_test { &[1, 5] } else { &[1, 5, 500, 5000] };
    let scenes: Vec<_> =
        counts.iter().map(|&n| imported(Kind::Teapots { count: n, scale: SCALE }, "boxes").0.positions).collect();
    print!("\n| box |");
    counts.iter().for_each(|n| print!(" Teapots({n}, {SCALE}): s | area, m2 |"));
    println!("\n| --- |{}", " --- | --- |".repeat(counts.len()));
    for (name, build) in BUILDERS {
        print!("| {name} |");
        for points in &scenes {
            let start = Instant::now();
            let bounds = build(points);
            let seconds = start.elapsed().as_secs_f64();
            let size = points.iter().fold(0.0, |size: f64, p| size.max(p.length()));
            assert!(points.iter().all(|&p| bounds.distance(p) <= ROUNDING * size), "{name}: a point is outside");
            print!(" {seconds:.4} | {:.2} |", bounds.area());
        }
        println!();
    }
}
