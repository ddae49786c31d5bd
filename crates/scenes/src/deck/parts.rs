//! Parts of a platform, in sizes that a placement scales. Pipes and fittings are for a radius of 1 and run along +x from the
//! origin; other parts stand on the origin, +y up, with edges of 1 m unless noted.

use super::super::model::Material;
use super::super::solid::{Solid, cuboid, extrude, lathe, loft, perforated, pipe, turn};
use enfilade::math::geom::Aabb;
use enfilade::scene::Role;
use glam::{DVec2, DVec3};

/// Bend radius of an elbow, in radii of the pipe: a long-radius elbow (ASME B16.9).
pub(super) const BEND: f64 = 3.0;
/// Edge of a panel of gratings, metres.
pub(super) const PANEL: f64 = 4.0;
/// Length of a piece of railing, metres.
pub(super) const RAIL: f64 = 2.0;
/// Length of a boom of lattice, metres.
pub(super) const BOOM: f64 = 60.0;

/// A part whose mesh many nodes share.
pub(super) struct Part {
    /// Name of the mesh; nodes add a number.
    pub(super) key: &'static str,
    pub(super) role: Role,
    pub(super) material: Material,
    pub(super) make: fn() -> Solid,
}

const fn part(key: &'static str, role: Role, material: Material, make: fn() -> Solid) -> Part {
    Part { key, role, material, make }
}

use Material::{Bronze, Concrete, Fabric, Lamp, Metal, Plaster, Roof, Stone};
use Role::{Furnishing, Stair, Structure};

/// Straight pipes and elbows: thin, middle and thick, with more sides the thicker they are.
pub(super) const PIPES: [Part; 3] = [
    part("thin pipe", Furnishing, Metal, || pipe(1.0, 1.0, 8)),
    part("middle pipe", Furnishing, Plaster, || pipe(1.0, 1.0, 12)),
    part("thick pipe", Furnishing, Plaster, || pipe(1.0, 1.0, 20)),
];
pub(super) const ELBOWS: [Part; 3] = [
    part("thin elbow", Furnishing, Metal, || elbow(8, 4)),
    part("middle elbow", Furnishing, Plaster, || elbow(12, 6)),
    part("thick elbow", Furnishing, Plaster, || elbow(20, 8)),
];
pub(super) const FLANGE: Part = part("flange", Furnishing, Metal, flange);
pub(super) const BOLTS: Part = part("bolts", Furnishing, Stone, bolts);
pub(super) const VALVE: Part = part("valve", Furnishing, Roof, valve);
/// A block of 1 x 1 x 1 m: clips of pipes, brackets, boxes, plates.
pub(super) const BLOCK: Part = part("block", Furnishing, Stone, || cuboid(v(-0.5, 0.0, -0.5), v(0.5, 1.0, 0.5)));
pub(super) const CABINET: Part = part("cabinet", Furnishing, Plaster, cabinet);
pub(super) const GAUGE: Part = part("gauge", Furnishing, Bronze, gauge);
pub(super) const LAMP: Part =
    part("lamp", Furnishing, Lamp, || lathe(&[(0.0, 0.0), (0.3, 0.0), (0.5, 0.6), (0.2, 1.0), (0.0, 1.0)], 10));
/// A channel along +x, 1 m long, 0.3 m wide.
pub(super) const TRAY: Part = part("tray", Furnishing, Metal, tray);
pub(super) const MACHINE: Part = part("machine", Furnishing, Fabric, machine);
/// A horizontal vessel along +x on saddles, radius 1, length 6; and the tubes inside.
pub(super) const VESSEL: Part = part("vessel", Furnishing, Plaster, vessel);
pub(super) const BUNDLE: Part = part("bundle of tubes", Furnishing, Bronze, bundle);
/// An upright tank, 1 m high, radius 1.
pub(super) const TANK: Part =
    part("tank", Furnishing, Plaster, || lathe(&[(0.0, 0.0), (1.0, 0.0), (1.0, 0.9), (0.6, 1.0), (0.0, 1.02)], 32));
/// An I-beam along +x, 1 m long, 0.4 m high.
pub(super) const BEAM: Part = part("beam", Structure, Metal, beam);
/// A plate of 1 x 1 m, its top at the origin, 0.02 m thick.
pub(super) const PLATE: Part = part("plate", Structure, Metal, || cuboid(v(0.0, -0.02, 0.0), v(1.0, 0.0, 1.0)));
pub(super) const GRATING: Part = part("grating", Structure, Metal, grating);
pub(super) const COLUMN: Part =
    part("column", Structure, Concrete, || lathe(&[(0.0, 0.0), (0.5, 0.0), (0.5, 1.0), (0.0, 1.0)], 24));
/// A corrugated wall along +x, 1 x 1 m, 0.2 m thick.
pub(super) const WALL: Part = part("wall", Structure, Plaster, wall);
/// A wall of 1 x 1 m with a doorway, 0.1 m thick.
pub(super) const GATE: Part = part("gate", Structure, Plaster, gate);
pub(super) const RAILING: Part = part("railing", Furnishing, Roof, railing);
/// Stairs along +x, up to the next deck.
pub(super) const STAIRS: Part = part("stairs", Stair, Metal, stairs);
pub(super) const HELIDECK: Part =
    part("helideck", Structure, Concrete, || lathe(&[(0.0, -0.6), (11.0, -0.6), (13.0, 0.0), (0.0, 0.0)], 8));
/// A lattice of [`BOOM`] metres along +y.
pub(super) const LATTICE: Part = part("lattice", Structure, Roof, lattice);

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// A bend from the origin along +x to +y.
fn elbow(sides: u32, pieces: u32) -> Solid {
    let ring = |i: u32| -> Vec<DVec3> {
        let (cos, sin) = turn(0.25 * f64::from(i) / f64::from(pieces));
        let (middle, outwards) = (v(sin, 1.0 - cos, 0.0) * BEND, v(-sin, cos, 0.0));
        let corner = |k: u32| {
            let (c, s) = turn(f64::from(k) / f64::from(sides));
            middle + outwards * s + DVec3::Z * c
        };
        (0..sides).map(corner).collect()
    };
    let mut rings = vec![vec![DVec3::ZERO]];
    rings.extend((0..=pieces).map(ring));
    rings.push(vec![v(BEND, BEND, 0.0)]);
    loft(&rings)
}

/// Turns a solid from +y to +x.
fn along_x(mut solid: Solid) -> Solid {
    for p in &mut solid.positions {
        *p = v(p.y, -p.x, p.z);
    }
    solid
}

/// Two discs face to face, welded to their pipes.
fn flange() -> Solid {
    let half = [(0.0, -0.6), (1.08, -0.6), (1.3, -0.3), (1.9, -0.3), (1.9, -0.03), (1.4, -0.03)];
    let mut profile = half.to_vec();
    profile.extend(half.iter().rev().map(|&(r, y)| (r, -y)));
    along_x(lathe(&profile, 20))
}

/// Eight bolts around a flange.
fn bolts() -> Solid {
    let bolt = |k: u32| {
        let (c, s) = turn(f64::from(k) / 8.0);
        cuboid(v(-0.45, -0.1, -0.1), v(0.45, 0.1, 0.1)).at(v(0.0, 1.65 * s, 1.65 * c))
    };
    Solid::of(&(0..8).map(bolt).collect::<Vec<_>>())
}

/// A body on the pipe, a stem and a hand wheel.
fn valve() -> Solid {
    let body =
        [(0.0, -2.0), (1.9, -2.0), (1.9, -1.6), (1.2, -1.5), (1.6, 0.0), (1.2, 1.5), (1.9, 1.6), (1.9, 2.0), (0.0, 2.0)];
    let stem = lathe(&[(0.0, 1.4), (0.5, 1.4), (0.5, 2.6), (0.15, 2.8), (0.15, 4.6), (0.0, 4.6)], 12);
    let wheel = lathe(&[(1.5, 4.2), (1.7, 4.2), (1.7, 4.4), (1.5, 4.4)], 20);
    let spokes = [v(1.55, 0.08, 0.08), v(0.08, 0.08, 1.55)].map(|half| cuboid(-half, half).at(v(0.0, 4.3, 0.0)));
    Solid::of(&[&[along_x(lathe(&body, 16)), stem, wheel][..], &spokes].concat())
}

/// A cabinet of 0.6 x 2 x 0.4 m, with a door and a plinth.
fn cabinet() -> Solid {
    let parts = [
        (v(-0.3, 0.1, -0.2), v(0.3, 2.0, 0.2)),
        (v(-0.26, 0.2, 0.21), v(0.26, 1.9, 0.24)),
        (v(-0.28, 0.0, -0.18), v(0.28, 0.09, 0.18)),
    ];
    Solid::of(&parts.map(|(low, high)| cuboid(low, high)))
}

/// A gauge: a dial of 0.5 m on a stem.
fn gauge() -> Solid {
    let stem = lathe(&[(0.0, 0.0), (0.06, 0.0), (0.06, 0.5), (0.0, 0.5)], 8);
    let dial = along_x(lathe(&[(0.0, -0.1), (0.25, -0.1), (0.25, 0.06), (0.2, 0.1), (0.0, 0.1)], 16)).at(v(0.0, 0.75, 0.0));
    Solid::of(&[stem, dial])
}

fn tray() -> Solid {
    let outline =
        [(-0.15, 0.1), (-0.15, 0.0), (0.15, 0.0), (0.15, 0.1), (0.14, 0.1), (0.14, 0.01), (-0.14, 0.01), (-0.14, 0.1)];
    extrude(&outline.map(|(z, y)| DVec2::new(z, y)), DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 1.0)
}

/// A motor with cooling fins, a shaft and a pump on a skid of 3 x 1.2 m.
fn machine() -> Solid {
    let mut fins = vec![(0.0, -1.3)];
    for i in 0..18 {
        let at = -1.3 + 0.065 * f64::from(i);
        fins.extend([(0.36, at), (0.45, at + 0.02), (0.45, at + 0.03), (0.36, at + 0.05)]);
    }
    fins.push((0.0, -0.1));
    let axle = lathe(&[(0.0, -0.2), (0.08, -0.2), (0.08, 0.6), (0.0, 0.6)], 12);
    let pump = lathe(&[(0.0, 0.4), (0.3, 0.4), (0.6, 0.6), (0.6, 0.9), (0.3, 1.1), (0.25, 1.4), (0.0, 1.4)], 24);
    let turned = [lathe(&fins, 32), axle, pump].map(|solid| along_x(solid).at(v(0.0, 0.9, 0.0)));
    let skid = cuboid(v(-1.5, 0.0, -0.6), v(1.5, 0.2, 0.6));
    let feet = [-0.9, 0.7].map(|x| cuboid(v(x - 0.2, 0.2, -0.4), v(x + 0.2, 0.5, 0.4)));
    Solid::of(&[&turned[..], &[skid], &feet].concat())
}

fn vessel() -> Solid {
    let dome = |k: u32| {
        let (c, s) = turn(0.25 * f64::from(k) / 5.0);
        (c, s)
    };
    let mut profile = vec![(0.0, -3.5)];
    profile.extend((0..5).rev().map(|k| (dome(k).0, -3.0 - 0.5 * dome(k).1)));
    profile.extend((0..5).map(|k| (dome(k).0, 3.0 + 0.5 * dome(k).1)));
    profile.push((0.0, 3.5));
    let saddles = [-2.0, 2.0].map(|x| cuboid(v(x - 0.15, -1.3, -0.7), v(x + 0.15, -0.75, 0.7)));
    let nozzle = lathe(&[(0.0, 0.9), (0.15, 0.9), (0.15, 1.2), (0.25, 1.2), (0.25, 1.25), (0.0, 1.25)], 12);
    Solid::of(&[&[along_x(lathe(&profile, 32)), nozzle][..], &saddles].concat())
}

/// 12 by 12 tubes within a vessel.
fn bundle() -> Solid {
    let tube = |i: u32| {
        let at = |k: u32| 0.1 * (f64::from(k) - 5.5);
        pipe(5.8, 0.035, 8).at(v(-2.9, at(i / 12), at(i % 12)))
    };
    Solid::of(&(0..144).map(tube).collect::<Vec<_>>())
}

fn beam() -> Solid {
    let right = [(0.1, 0.0), (0.1, 0.03), (0.01, 0.03), (0.01, 0.37), (0.1, 0.37), (0.1, 0.4)];
    let outline = right.iter().copied().chain(right.iter().rev().map(|&(z, y)| (-z, y)));
    let outline: Vec<DVec2> = outline.map(|(z, y)| DVec2::new(z, y)).collect();
    extrude(&outline, DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 1.0)
}

/// A panel, [`PANEL`] metres square: bars on edge, and two across.
fn grating() -> Solid {
    let bar = |i: u32| {
        let x = PANEL * f64::from(i) / 40.0;
        cuboid(v(x + 0.04, -0.04, 0.02), v(x + 0.06, 0.0, PANEL - 0.02))
    };
    let across = [1.0, 3.0].map(|z| cuboid(v(0.02, -0.09, z), v(PANEL - 0.02, -0.05, z + 0.02)));
    Solid::of(&(0..40).map(bar).chain(across).collect::<Vec<_>>())
}

fn wall() -> Solid {
    const WAVES: u32 = 16;
    let front = (0..=2 * WAVES).map(|i| DVec2::new(f64::from(i) / f64::from(2 * WAVES), if i % 2 == 0 { 0.0 } else { 0.1 }));
    let back = front.clone().rev().map(|p| p + DVec2::new(0.0, 0.1));
    let outline: Vec<DVec2> = front.chain(back).collect();
    extrude(&outline, DVec3::ZERO, DVec3::X, DVec3::Z, 1.0).at(DVec3::Y)
}

fn gate() -> Solid {
    let hole = Aabb { min: v(0.44, -1.0, -1.0), max: v(0.56, 0.4, 1.0) };
    perforated(DVec3::ZERO, v(1.0, 1.0, 0.1), 2, &[hole])
}

/// Posts, rails and a kick plate along +x.
fn railing() -> Solid {
    let posts = [0.1, 1.9].map(|x| lathe(&[(0.0, 0.0), (0.025, 0.0), (0.025, 1.1), (0.0, 1.1)], 8).at(v(x, 0.0, 0.0)));
    let rails = [0.55, 1.1].map(|y| pipe(RAIL, 0.02, 8).at(v(0.0, y, 0.06)));
    let kick = cuboid(v(0.0, 0.02, 0.08), v(RAIL, 0.12, 0.09));
    Solid::of(&[&posts[..], &rails, &[kick]].concat())
}

/// 32 steps up 8 m.
fn stairs() -> Solid {
    let step = |i: u32| {
        let (x, y) = (0.25 * f64::from(i), 0.25 * f64::from(i + 1));
        cuboid(v(x, y - 0.03, 0.0), v(x + 0.24, y, 0.9))
    };
    let strings = [-0.06, 0.91].map(|z| {
        let outline = [(0.0, 0.0), (0.3, 0.0), (8.0, 7.7), (8.0, 8.0), (7.7, 8.0), (0.0, 0.3)];
        extrude(&outline.map(|(x, y)| DVec2::new(x, y)), v(0.0, 0.0, z), DVec3::X, DVec3::Y, 0.05)
    });
    Solid::of(&(0..32).map(step).chain(strings).collect::<Vec<_>>())
}

/// A lattice: three chords with struts between.
fn lattice() -> Solid {
    const BAYS: u32 = 60;
    let chord = |k: u32| {
        let (c, s) = turn(f64::from(k % 3) / 3.0);
        v(1.5 * c, 0.0, 1.5 * s)
    };
    let rise = BOOM / f64::from(BAYS);
    let mut parts: Vec<Solid> = (0..3).map(|k| strut(chord(k), chord(k) + DVec3::Y * BOOM, 0.09)).collect();
    for bay in 0..BAYS {
        let (low, high) = (DVec3::Y * rise * f64::from(bay), DVec3::Y * rise * f64::from(bay + 1));
        for k in 0..3 {
            parts.push(strut(low + chord(k), low + chord(k + 1), 0.04));
            parts.push(strut(low + chord(k), high + chord(k + 1), 0.04));
        }
    }
    Solid::of(&parts)
}

/// A round bar from one point to another.
fn strut(from: DVec3, to: DVec3, radius: f64) -> Solid {
    let way = to - from;
    let length = way.length();
    let x = way / length;
    let (y, z) = x.any_orthonormal_pair();
    let mut solid = pipe(length, radius, 8);
    for p in &mut solid.positions {
        *p = from + x * p.x + y * p.y + z * p.z;
    }
    solid
}

#[cfg(test)]
mod tests {
    use super::super::super::solid::tests::assert_closed;
    use super::*;

    #[test]
    fn every_part_is_closed() {
        let single = [
            &FLANGE, &BOLTS, &VALVE, &BLOCK, &CABINET, &GAUGE, &LAMP, &TRAY, &MACHINE, &VESSEL, &BUNDLE, &TANK, &BEAM,
            &PLATE, &GRATING, &COLUMN, &WALL, &GATE, &RAILING, &STAIRS, &HELIDECK, &LATTICE,
        ];
        for part in PIPES.iter().chain(&ELBOWS).chain(single) {
            assert_closed(&(part.make)(), part.key);
        }
    }

    #[test]
    fn an_elbow_leads_from_x_to_y_and_has_the_volume_of_its_bend() {
        let solid = elbow(64, 64);
        // Pappus: area of the section times the path of its centre.
        let volume = std::f64::consts::PI * (std::f64::consts::FRAC_PI_2 * BEND);
        assert!((solid.volume() / volume - 1.0).abs() < 5e-3, "{}", solid.volume() / volume);
        assert_eq!(solid.positions[solid.positions.len() - 1], v(BEND, BEND, 0.0));
    }
}
