//! Furniture: each piece has a few hundred triangles, its origin on the floor, its front towards +z.

use super::solid::{Solid, cuboid, lathe, loft, turn};
use enfilade::math::random::Prng;
use glam::DVec3;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A box from the middle of its base in plan, the height of its base and its size.
fn block(x: f64, y: f64, z: f64, w: f64, h: f64, d: f64) -> Solid {
    cuboid(v(x - w / 2.0, y, z - d / 2.0), v(x + w / 2.0, y + h, z + d / 2.0))
}

fn rod(x: f64, y: f64, z: f64, radius: f64, height: f64, segments: u32) -> Solid {
    lathe(&[(0.0, 0.0), (radius, 0.0), (radius, height), (0.0, height)], segments).at(v(x, y, z))
}

/// A desk of 1.6 x 0.8 m, 0.74 m high, with drawers.
pub(super) fn desk() -> Solid {
    let mut parts = vec![block(0.0, 0.71, 0.0, 1.6, 0.03, 0.8)];
    for (x, z) in [(-0.74, -0.34), (0.74, -0.34), (-0.74, 0.34)] {
        parts.push(rod(x, 0.0, z, 0.025, 0.71, 8));
    }
    parts.push(block(0.52, 0.05, 0.0, 0.42, 0.64, 0.7));
    for i in 0..3 {
        parts.push(block(0.52, 0.08 + 0.2 * f64::from(i), 0.36, 0.38, 0.18, 0.015));
        parts.push(block(0.52, 0.16 + 0.2 * f64::from(i), 0.372, 0.14, 0.015, 0.01));
    }
    Solid::of(&parts)
}

/// An office chair on five castors.
pub(super) fn chair() -> Solid {
    let mut parts = vec![rod(0.0, 0.1, 0.0, 0.03, 0.32, 10)];
    for k in 0..5 {
        let (cos, sin) = turn(f64::from(k) / 5.0);
        parts.push(rod(0.26 * cos, 0.0, 0.26 * sin, 0.03, 0.06, 5));
        // A flat spoke from the column to its castor.
        let (a, b) = (v(0.02 * cos, 0.06, 0.02 * sin), v(0.28 * cos, 0.06, 0.28 * sin));
        let side = v(-sin, 0.0, cos) * 0.02;
        let ring = |p: DVec3| vec![p - side, p + side, p + side + DVec3::Y * 0.04, p - side + DVec3::Y * 0.04];
        let end = |p: DVec3| vec![p + DVec3::Y * 0.02];
        parts.push(loft(&[end(b), ring(b), ring(a), end(a)]));
    }
    parts.push(lathe(&[(0.0, 0.42), (0.2, 0.42), (0.24, 0.45), (0.24, 0.48), (0.2, 0.51), (0.0, 0.5)], 10));
    parts.push(block(0.0, 0.45, -0.24, 0.06, 0.25, 0.03));
    // A curved back.
    let rib = |k: i32, r: f64| {
        let (cos, sin) = turn(0.75 + f64::from(k) * 0.025);
        v(r * cos, 0.0, 0.2 + r * sin)
    };
    let section = |k: i32| {
        let (inner, outer) = (rib(k, 0.42), rib(k, 0.46));
        vec![inner + DVec3::Y * 0.62, inner + DVec3::Y * 1.08, outer + DVec3::Y * 1.08, outer + DVec3::Y * 0.62]
    };
    let cap = |k: i32| vec![rib(k, 0.44) + DVec3::Y * 0.85];
    let mut rings = vec![cap(-4)];
    rings.extend((-4..=4).map(section));
    rings.push(cap(4));
    parts.push(loft(&rings));
    Solid::of(&parts)
}

/// A cupboard 0.9 m wide, 1.9 m high, 0.45 m deep, with doors and handles.
pub(super) fn cupboard() -> Solid {
    let mut parts = vec![block(0.0, 0.06, 0.0, 0.9, 1.84, 0.42), block(0.0, 0.0, 0.0, 0.84, 0.06, 0.36)];
    for side in [-1.0, 1.0] {
        for (foot, height) in [(0.08, 0.88), (0.98, 0.9)] {
            parts.push(block(side * 0.222, foot, 0.22, 0.43, height, 0.02));
            parts.push(rod(side * 0.05, foot + 0.4, 0.24, 0.008, 0.12, 8));
        }
    }
    Solid::of(&parts)
}

/// A flat screen on a foot, and a keyboard, to stand on a desk.
pub(super) fn screen() -> Solid {
    let mut parts = vec![
        lathe(&[(0.0, 0.0), (0.12, 0.0), (0.12, 0.008), (0.03, 0.015), (0.02, 0.2), (0.0, 0.2)], 8),
        block(0.0, 0.12, 0.0, 0.6, 0.36, 0.02),
        block(0.0, 0.0, 0.28, 0.44, 0.012, 0.14),
    ];
    for row in 0..4 {
        parts.push(block(0.0, 0.012, 0.235 + 0.03 * f64::from(row), 0.4, 0.006, 0.022));
    }
    Solid::of(&parts)
}

/// A ceiling lamp; its origin is at the ceiling.
pub(super) fn lamp() -> Solid {
    let shade = lathe(&[(0.0, -0.3), (0.16, -0.28), (0.2, -0.22), (0.19, -0.2), (0.03, -0.14), (0.0, -0.14)], 12);
    Solid::of(&[shade, rod(0.0, -0.14, 0.0, 0.008, 0.14, 8)])
}

/// A table `length` metres long and 1.1 m wide.
pub(super) fn table(length: f64) -> Solid {
    let mut parts = vec![block(0.0, 0.7, 0.0, length, 0.04, 1.1)];
    for (x, z) in [(-0.5, -0.45), (0.5, -0.45), (0.5, 0.45), (-0.5, 0.45)] {
        parts.push(rod(x * (length - 0.2), 0.0, z, 0.04, 0.7, 12));
    }
    Solid::of(&parts)
}

/// A bench, 1.6 m long.
pub(super) fn bench() -> Solid {
    let mut parts: Vec<Solid> = (0..4).map(|i| block(0.0, 0.42, -0.165 + 0.11 * f64::from(i), 1.6, 0.04, 0.09)).collect();
    for x in [-0.6, 0.6] {
        parts.extend([block(x, 0.06, 0.0, 0.06, 0.36, 0.36), block(x, 0.0, 0.0, 0.1, 0.06, 0.44)]);
    }
    Solid::of(&parts)
}

/// A picture and its frame, `width` x `height` metres, its back at z = 0, its middle at the origin.
pub(super) fn picture(width: f64, height: f64) -> Solid {
    let (w, h, bar) = (width / 2.0, height / 2.0, 0.06);
    let mut parts = vec![cuboid(v(-w + bar, -h + bar, 0.005), v(w - bar, h - bar, 0.025))];
    for (a, b) in [
        (v(-w, -h, 0.005), v(w, -h + bar, 0.045)),
        (v(-w, h - bar, 0.005), v(w, h, 0.045)),
        (v(-w, -h + bar, 0.005), v(-w + bar, h - bar, 0.045)),
        (v(w - bar, -h + bar, 0.005), v(w, h - bar, 0.045)),
    ] {
        parts.push(cuboid(a, b));
    }
    Solid::of(&parts)
}

/// A plinth, 1 m high.
pub(super) fn plinth() -> Solid {
    Solid::of(&[
        block(0.0, 0.0, 0.0, 0.76, 0.08, 0.76),
        block(0.0, 0.08, 0.0, 0.64, 0.86, 0.64),
        block(0.0, 0.94, 0.0, 0.7, 0.06, 0.7),
    ])
}

/// A leaning bronze column of varying thickness, about a metre high, its origin at its foot; each state of `rng` gives another.
pub(super) fn sculpture(rng: &mut Prng) -> Solid {
    const SIDES: u32 = 10;
    const RINGS: usize = 8;
    let twist = rng.range(-0.6, 0.6);
    let (ex, ez) = (rng.range(0.6, 1.2), rng.range(0.6, 1.2));
    let (mut lean, mut radius) = (DVec3::ZERO, rng.range(0.14, 0.22));
    let mut rings = vec![vec![DVec3::ZERO]];
    let height = rng.range(0.8, 1.3);
    for i in 0..RINGS {
        let y = height * i as f64 / (RINGS - 1) as f64;
        rings.push(
            (0..SIDES)
                .map(|k| {
                    let (cos, sin) = turn(f64::from(k) / f64::from(SIDES) + twist * y);
                    lean + v(radius * ex * cos, y, radius * ez * sin)
                })
                .collect(),
        );
        lean += v(rng.range(-0.04, 0.04), 0.0, rng.range(-0.04, 0.04));
        radius = (radius + rng.range(-0.07, 0.06)).clamp(0.05, 0.26);
    }
    rings.push(vec![lean + v(0.0, height + 0.04, 0.0)]);
    loft(&rings)
}

#[cfg(test)]
mod tests {
    use super::super::solid::tests::assert_closed;
    use super::*;

    #[test]
    fn every_piece_is_closed_and_of_a_few_hundred_triangles_at_most() {
        let mut rng = Prng::new(1, 0);
        for (name, solid) in [
            ("desk", desk()),
            ("chair", chair()),
            ("cupboard", cupboard()),
            ("screen", screen()),
            ("lamp", lamp()),
            ("table", table(2.4)),
            ("bench", bench()),
            ("picture", picture(1.2, 0.8)),
            ("plinth", plinth()),
            ("sculpture", sculpture(&mut rng)),
        ] {
            assert_closed(&solid, name);
            assert!((36..=400).contains(&solid.triangles.len()), "{name}: {}", solid.triangles.len());
        }
    }
}
