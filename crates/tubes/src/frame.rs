//! Tangents of sections, axes for tangents, and rolls that keep rings from twisting about the curve.
//!
//! Based on: Wang, Jüttler, Zheng, Liu 2008 (double reflection); Duff and others 2017 (an axis from a tangent alone).

use super::section::{Section, Tangent};
use glam::{DVec3, Vec3};

/// The unit tangent of section `i` of a tube; if `closed`, the last section precedes the first. +X if there is no direction.
pub(super) fn tangent(sections: &[Section], i: usize, closed: bool) -> Vec3 {
    let count = sections.len();
    let at = |k: usize| Vec3::from(sections[k].place);
    let before = if i > 0 { Some(i - 1) } else { closed.then(|| count - 1) };
    let after = if i + 1 < count { Some(i + 1) } else { closed.then_some(0) };
    let direction = |from: usize, to: usize| at(to) - at(from);
    let found = match (sections[i].tangent(), before, after) {
        (Tangent::Before, Some(b), _) => direction(b, i),
        (Tangent::After, _, Some(a)) => direction(i, a),
        (Tangent::Circle, Some(b), Some(a)) => of_circle(direction(b, i), direction(i, a)),
        (_, Some(b), _) => at_end(direction(b, i), tangent_within(sections, b)).unwrap_or(Vec3::ZERO),
        (_, None, Some(a)) => at_end(direction(i, a), tangent_within(sections, a)).unwrap_or(Vec3::ZERO),
        (_, None, None) => Vec3::ZERO,
    };
    found.try_normalize().unwrap_or(Vec3::X)
}

/// The tangent of the section next to an open end; zero if that is the other end.
fn tangent_within(sections: &[Section], i: usize) -> Vec3 {
    if i == 0 || i + 1 == sections.len() { Vec3::ZERO } else { tangent(sections, i, false) }
}

/// The tangent at the middle one of three points of a circle, from the two chords.
fn of_circle(u: Vec3, v: Vec3) -> Vec3 {
    // Weights of the chords: the inverse of the squared length.
    let [uu, vv] = [u.length_squared(), v.length_squared()];
    if uu == 0.0 || vv == 0.0 { u + v } else { u * (vv / (uu + vv)) + v * (uu / (uu + vv)) }
}

/// The tangent at the end of a circle's chord whose other end has the tangent `other`: its mirror image.
fn at_end(chord: Vec3, other: Vec3) -> Option<Vec3> {
    let along = chord.try_normalize()?;
    Some(if other == Vec3::ZERO { along } else { 2.0 * along.dot(other) * along - other })
}

/// Tangents with a lower z have other axes. Any number above -1 works if few curves reach it: a shader with other rounding must
/// choose the same axes. At 0, level pipes could have either.
const DOWN: f32 = -0.912_3;

/// Two unit vectors perpendicular to a unit tangent. They depend on it alone, continuously except where z passes [`DOWN`].
pub(super) fn across(t: Vec3) -> [Vec3; 2] {
    let sign = if t.z < DOWN { -1.0 } else { 1.0 };
    let a = -1.0 / (sign + t.z);
    let b = t.x * t.y * a;
    [Vec3::new(1.0 + sign * t.x * t.x * a, sign * b, -sign * t.x), Vec3::new(b, sign + t.y * t.y * a, -t.y)]
}

/// Sets the rolls of sections to a frame without twist about the curve; on a closed curve the remaining twist is spread.
pub(super) fn roll(sections: &mut [Section], closed: bool) {
    let tangents: Vec<DVec3> = (0..sections.len()).map(|i| tangent(sections, i, closed).as_dvec3()).collect();
    let places: Vec<DVec3> = sections.iter().map(|s| Vec3::from(s.place).as_dvec3()).collect();
    let angle = |i: usize, n: DVec3| {
        let [x, y] = across(tangents[i].as_vec3()).map(|v| v.as_dvec3());
        n.dot(y).atan2(n.dot(x))
    };
    let Some(&first) = tangents.first() else { return };
    let start = across(first.as_vec3())[0].as_dvec3();
    let (mut normal, mut rolls) = (start, vec![0.0]);
    for i in 1..sections.len() {
        normal = transported(normal, [places[i - 1], places[i]], [tangents[i - 1], tangents[i]]);
        rolls.push(angle(i, normal));
    }
    let last = sections.len() - 1;
    let twist = if closed { angle(0, transported(normal, [places[last], places[0]], [tangents[last], first])) } else { 0.0 };
    let (mut along, mut so_far) = (vec![0.0], 0.0);
    for i in 0..last {
        so_far += places[i].distance(places[i + 1]);
        along.push(so_far);
    }
    let whole = so_far + if closed { places[last].distance(places[0]) } else { 0.0 };
    for (i, section) in sections.iter_mut().enumerate() {
        let spread = if whole > 0.0 { twist * along[i] / whole } else { 0.0 };
        *section = Section::new(section.place, section.radius(), section.tangent(), (rolls[i] - spread) as f32);
    }
}

/// A normal, transported from one point to the next by two reflections.
fn transported(normal: DVec3, [from, to]: [DVec3; 2], [t0, t1]: [DVec3; 2]) -> DVec3 {
    let reflect = |v: DVec3, n: DVec3| {
        let nn = n.length_squared();
        if nn == 0.0 { v } else { v - 2.0 / nn * n.dot(v) * n }
    };
    let step = to - from;
    let [normal, tangent] = [normal, t0].map(|v| reflect(v, step));
    let normal = reflect(normal, t1 - tangent);
    (normal - t1 * normal.dot(t1)).normalize_or(across(t1.as_vec3())[0].as_dvec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sections(places: &[DVec3]) -> Vec<Section> {
        places.iter().map(|p| Section::new(p.as_vec3().to_array(), 0.1, Tangent::Circle, 0.0)).collect()
    }

    #[test]
    fn tangents_of_a_circle_are_its_own_however_unevenly_it_is_cut() {
        let angles = [0.0, 0.1, 0.5, 0.55, 1.2, 1.5];
        let places = angles.map(|a: f64| DVec3::new(3.0 * a.cos(), 1.0, 3.0 * a.sin()));
        let of = sections(&places);
        for (i, a) in angles.iter().enumerate() {
            let expected = DVec3::new(-a.sin(), 0.0, a.cos()).as_vec3();
            assert!(tangent(&of, i, false).distance(expected) < 1e-5, "{i}");
        }
    }

    #[test]
    fn axes_are_at_right_angles() {
        for t in [Vec3::X, Vec3::NEG_Z, Vec3::Z, Vec3::new(0.6, -0.64, 0.48), Vec3::new(1e-4, 0.0, -1.0).normalize()] {
            let [x, y] = across(t);
            let products = [x.dot(y), x.dot(t), y.dot(t), x.length() - 1.0, y.length() - 1.0];
            assert!(products.iter().all(|p| p.abs() < 1e-5) && x.cross(y).distance(t) < 1e-5, "{t}: {products:?}");
        }
    }

    /// In a plane nothing twists: the normal across the plane stays. On a closed curve, the ring returns to itself.
    #[test]
    fn a_ring_does_not_turn_about_its_curve() {
        let wave: Vec<DVec3> = (0..40).map(|k| DVec3::new(0.1 * f64::from(k), (0.3 * f64::from(k)).sin(), 0.0)).collect();
        let mut of = sections(&wave);
        roll(&mut of, false);
        let normal = |of: &[Section], i: usize, closed: bool| {
            let [x, y] = across(tangent(of, i, closed));
            let (sin, cos) = of[i].roll().sin_cos();
            cos * x + sin * y
        };
        let across_the_plane = normal(&of, 0, false).z;
        for i in 0..of.len() {
            assert!((normal(&of, i, false).z - across_the_plane).abs() < 1e-3, "{i}");
        }
        // A closed knot: neighbours differ at most by the curve's bend and the spread twist.
        let knot: Vec<DVec3> = (0..300)
            .map(|k| {
                let t = f64::from(k) / 300.0 * std::f64::consts::TAU;
                let ring = 2.0 + (3.0 * t).cos();
                DVec3::new(ring * (2.0 * t).cos(), (3.0 * t).sin(), ring * (2.0 * t).sin())
            })
            .collect();
        let mut of = sections(&knot);
        roll(&mut of, true);
        for i in 0..of.len() {
            let next = (i + 1) % of.len();
            let step = normal(&of, i, true).distance(normal(&of, next, true));
            assert!(step < 0.08, "{i}: the ring jumps by {step}");
        }
    }
}
