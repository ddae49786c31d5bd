//! Teapots(n, s): n teapots of scale s at random positions and rotations in a box.
//!
//! Based on: P. Ivson, *Técnicas de Otimização para Visualização de Modelos Massivos*, PUC-Rio, 2006, section 6.1. His teapot has
//! 1,364 vertices, drawn by 2,781 indices. This one also has 1,364: four closed solids (body, lid, spout, handle), which makes 2
//! * 1,364 - 4 * 4 = 2,712 triangles. Only its outline follows M. Newell's (1975); no data were taken.
//!
//! Two sizes follow from his table 6.2.1, areas of boxes at scale 10: the tightest box around one teapot has 22.70 square units,
//! the upright one around 5,000 has 10,835. By the first, a teapot of scale 1 is 0.27 units long, life size in metres. By the
//! second, the teapots' centres fit a cube of 40 m; the cube is an assumption. His camera paths aren't published. This path
//! varies the same: how much is in view, and how much of that is hidden.

use super::building::Building;
use super::facts::Facts;
use super::model::{Material, Model};
use super::path::CameraPath;
use super::solid::{Solid, lathe, loft, turn};
use enfilade::math::random::Prng;
use enfilade::scene::Role;
use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Random stream of positions and rotations.
const PLACES: u64 = 1;
/// Edge of the cube of the teapots' centres, metres; the origin is its centre.
const EDGE: f64 = 40.0;
/// Surface of the box around a teapot of scale 1, square metres.
const BOX_AREA: f64 = 0.227;
/// Points per ring of the body and lid, and of the spout and handle. With the rings below they make 1,364 vertices.
const AROUND: u32 = 32;
const ACROSS: u32 = 12;
/// The camera's first and last distance from the centre, metres: all teapots are in view, then those ahead.
const DISTANCES: [f64; 2] = [60.0, 2.0];
/// The camera's revolutions, and its frames.
const ROUNDS: f64 = 1.5;
const FRAMES: usize = 600;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// `count` teapots with one mesh.
pub(super) fn teapots(count: usize, scale: usize, seed: u64) -> Building {
    let rng = &mut Prng::new(seed, PLACES);
    let mut model = Model::default();
    for i in 0..count {
        let at = v(rng.range(-0.5, 0.5), rng.range(-0.5, 0.5), rng.range(-0.5, 0.5)) * EDGE;
        let placement = DAffine3::from_mat3_translation(DMat3::from_quat(rotation(rng)) * scale as f64, at);
        model.place(format!("teapot {i}"), Role::Furnishing, placement, "teapot", Material::Bronze, teapot);
    }
    let counted = vec![("teapots", count), ("scale", scale)];
    Building { name: format!("teapots{count}x{scale}"), seed, counted, model, facts: Facts::default(), path: spiral() }
}

/// A random rotation, uniformly distributed (K. Shoemake, *Uniform random rotations*, 1992).
fn rotation(rng: &mut Prng) -> DQuat {
    let share = rng.unit();
    let ((c1, s1), (c2, s2)) = (turn(rng.unit()), turn(rng.unit()));
    let (a, b) = ((1.0 - share).sqrt(), share.sqrt());
    DQuat::from_xyzw(a * s1, a * c1, b * s2, b * c2)
}

/// A spiral from outside to the centre, which is the target.
fn spiral() -> CameraPath {
    let frame = |i: usize| {
        let part = i as f64 / (FRAMES - 1) as f64;
        let (c, s) = turn(ROUNDS * part);
        [v(c, 0.0, s) * (DISTANCES[0] + (DISTANCES[1] - DISTANCES[0]) * part), DVec3::ZERO]
    };
    CameraPath { frames: (0..FRAMES).map(frame).collect() }
}

/// A point of a cubic Bézier curve.
fn bezier([a, b, c, d]: [DVec3; 4], t: f64) -> DVec3 {
    let s = 1.0 - t;
    a * (s * s * s) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * (t * t * t)
}

/// The direction of such a curve.
fn heading([a, b, c, d]: [DVec3; 4], t: f64) -> DVec3 {
    let s = 1.0 - t;
    ((b - a) * (s * s) + (c - b) * (2.0 * s * t) + (d - c) * (t * t)).normalize()
}

/// A teapot of scale 1 around the origin, upright, its spout towards +x. Curves are in units of half the body's radius.
fn teapot() -> Solid {
    let points = |curve: [DVec3; 4], from: u32, to: u32, parts: u32| {
        (from..to).map(move |i| bezier(curve, f64::from(i) / f64::from(parts))).map(|p| (p.x, p.y))
    };
    let foot = [v(1.45, 0.0, 0.0), v(1.75, 0.15, 0.0), v(2.0, 0.5, 0.0), v(2.0, 0.95, 0.0)];
    let wall = [v(2.0, 0.95, 0.0), v(2.0, 1.5, 0.0), v(1.6, 2.0, 0.0), v(1.4, 2.4, 0.0)];
    let mut body = vec![(0.0, 0.0)];
    body.extend(points(foot, 0, 8, 8).chain(points(wall, 0, 12, 11)));
    body.push((0.0, 2.3));

    let dome = [v(1.35, 2.44, 0.0), v(1.3, 2.65, 0.0), v(0.3, 2.6, 0.0), v(0.2, 2.8, 0.0)];
    let knob = [v(0.2, 2.8, 0.0), v(0.55, 2.85, 0.0), v(0.5, 3.2, 0.0), v(0.0, 3.2, 0.0)];
    let mut lid = vec![(0.0, 2.35), (1.35, 2.36)];
    lid.extend(points(dome, 0, 5, 4).chain(points(knob, 1, 5, 5)));
    lid.push((0.0, 3.2));

    let spout = [v(1.5, 0.8, 0.0), v(3.0, 0.6, 0.0), v(2.4, 2.0, 0.0), v(3.2, 2.4, 0.0)];
    let handle = [v(-1.4, 2.1, 0.0), v(-3.6, 2.4, 0.0), v(-3.4, 0.9, 0.0), v(-1.7, 0.7, 0.0)];
    let parts = [
        lathe(&body, AROUND),
        lathe(&lid, AROUND),
        tube(spout, 15, |t| [0.6 - 0.38 * t, 0.55 - 0.35 * t]),
        tube(handle, 18, |_| [0.14, 0.22]),
    ];
    let all = Solid::of(&parts);
    let low = all.positions.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let high = all.positions.iter().copied().reduce(DVec3::max).unwrap_or_default();
    let (size, middle) = (high - low, (low + high) / 2.0);
    let unit = (BOX_AREA / (2.0 * (size.x * size.y + size.y * size.z + size.z * size.x))).sqrt();
    let mut teapot = all.at(-middle);
    for p in &mut teapot.positions {
        *p *= unit;
    }
    teapot
}

/// A closed tube along a curve in the xy plane; `radii`: in that plane and along z.
fn tube(curve: [DVec3; 4], rings: u32, radii: impl Fn(f64) -> [f64; 2]) -> Solid {
    let ring = |i: u32| -> Vec<DVec3> {
        let t = f64::from(i) / f64::from(rings - 1);
        let (middle, ahead, [r, rz]) = (bezier(curve, t), heading(curve, t), radii(t));
        let corner = |k: u32| {
            let (c, s) = turn(f64::from(k) / f64::from(ACROSS));
            middle + v(-ahead.y, ahead.x, 0.0) * (r * s) + DVec3::Z * (rz * c)
        };
        (0..ACROSS).map(corner).collect()
    };
    let mut all = vec![vec![curve[0]]];
    all.extend((0..rings).map(ring));
    all.push(vec![curve[3]]);
    loft(&all)
}

#[cfg(test)]
mod tests {
    use super::super::solid::tests::assert_closed;
    use super::*;

    #[test]
    fn a_teapot_is_closed() {
        assert_closed(&teapot(), "teapot");
    }

    #[test]
    fn rotations_favour_no_direction() {
        let rng = &mut Prng::new(1, PLACES);
        // An axis of a uniform rotation is a uniform direction: means of 0, squares of 1/3.
        let n = 20_000;
        let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for _ in 0..n {
            let q = rotation(rng);
            assert!((q.length() - 1.0).abs() < 1e-12);
            let p = q * v(0.6, 0.0, 0.8);
            (sum, squares) = (sum + p, squares + p * p);
        }
        let n = f64::from(n);
        assert!((sum / n).abs().max_element() < 0.02, "{}", sum / n);
        assert!((squares / n - 1.0 / 3.0).abs().max_element() < 0.01, "{}", squares / n);
    }
}
