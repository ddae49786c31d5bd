//! What is free around a person, measured on every triangle, slice by slice; nothing of that is the viewer's.

use enfilade::scene::Scene;
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Of a person, metres.
pub const EYE: f64 = 1.6;
pub const KNEE: f64 = 0.45;
pub const HEAD: f64 = 1.8;
/// What must be free on all sides, metres.
pub const FREE: f64 = 0.4;

/// All triangles, in the coordinates of the model.
pub fn corners(scene: &Scene) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    scene.triangles.iter().map(|t| t.map(|i| scene.positions[i as usize] + scene.origin))
}

/// Distance in the plan of the nearest triangle to an axis between two heights, in the coordinates of the model: each triangle is cut at many
/// heights, into lines.
pub fn nearest_beside(scene: &Scene, at: DVec3, low: f64, high: f64) -> f64 {
    let mut nearest = f64::INFINITY;
    for triangle in corners(scene) {
        for i in 0..=60 {
            let y = low + (high - low) * f64::from(i) / 60.0;
            let sides = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (triangle[i], triangle[j]));
            let crossed = sides.into_iter().filter(|(a, b)| (a.y < y) != (b.y < y));
            let cut: Vec<DVec2> = crossed.map(|(a, b)| (a + (b - a) * ((y - a.y) / (b.y - a.y))).xz()).collect();
            if let [a, b] = cut[..] {
                let t = ((at.xz() - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
                nearest = nearest.min((a + (b - a) * t).distance(at.xz()));
            }
        }
    }
    nearest
}

/// Heights of all triangles over a point of the plan.
fn surfaces(scene: &Scene, at: DVec2) -> Vec<f64> {
    let over = |[a, b, c]: [DVec3; 3]| {
        let side = |p: DVec3, q: DVec3| (q.xz() - p.xz()).perp_dot(at - p.xz());
        let (u, v, w) = (side(b, c), side(c, a), side(a, b));
        let is_within = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        (is_within && u + v + w != 0.0).then(|| (a.y * u + b.y * v + c.y * w) / (u + v + w))
    };
    corners(scene).filter_map(over).collect()
}

/// That a person fits where the eye is; the height of the floor below.
pub fn free_and_on_a_floor(what: &str, scene: &Scene, eye: DVec3) -> f64 {
    let below = surfaces(scene, eye.xz()).into_iter().filter(|y| *y < eye.y).fold(f64::NEG_INFINITY, f64::max);
    assert!((eye.y - below - EYE).abs() < 1e-3, "{what}: {eye} is {} above what is below", eye.y - below);
    free(what, scene, eye);
    below
}

/// That a person fits where the eye is.
pub fn free(what: &str, scene: &Scene, eye: DVec3) {
    let feet = eye.y - EYE;
    let nearest = nearest_beside(scene, eye, feet + KNEE, feet + HEAD);
    assert!(nearest >= FREE - 1e-3, "{what}: {eye}: something is {nearest} m beside");
    for i in 0..16 {
        let way = DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 16.0) * FREE * f64::from(i % 2);
        let across = surfaces(scene, eye.xz() + way).into_iter().find(|y| (feet + KNEE..feet + HEAD).contains(y));
        assert!(across.is_none(), "{what}: {eye}: a surface at {across:?}");
    }
}
