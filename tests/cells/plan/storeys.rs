//! Rooms over each other: galleries, half storeys, roofs, stairs, shafts.

use super::known::{Known, assert_known};
use super::{EYE, FAR, HIGH, between, door_x, door_z, v};
use enfilade::scene::Role;
use glam::DVec3;
use testing::solids::Box3;
use testing::walls::{Building, WALL};

#[test]
fn a_gallery_open_to_its_hall_is_part_of_it() {
    let mut b = Building::default();
    b.shell(v(0., 0., 0.), v(9., 5.8, 6.), &[door_z(2., 0., -WALL)]);
    // A slab at half height over a third of it, without anything at its edge.
    b.solid(v(6., 2.6, 0.), v(9., 2.9, 6.));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("hall", vec![v(3., EYE, 3.), v(7.5, EYE, 3.), v(7.5, 4.4, 3.), v(3., 5.5, 5.8), v(8.9, 0.1, 5.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("hall", "outside", [v(2., EYE, 2.), v(2., EYE, -2.)])],
            within: vec![[v(1., EYE, 3.), v(8., 4.9, 3.)], [v(1., EYE, 3.), v(8.5, 0.5, 3.)]],
        },
    );
}

#[test]
fn a_room_under_a_gallery_is_one_of_its_own() {
    let mut b = Building::default();
    b.shell(v(0., 0., 0.), v(9., 5.8, 6.), &[]);
    b.solid(v(6., 2.6, 0.), v(9., 2.9, 6.));
    // A wall under its edge, with a doorway.
    b.holed(v(6., 0., 0.), v(6. + WALL, 2.6, 6.), &[door_x(6., 0., 3.)]);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("hall", vec![v(3., EYE, 3.), v(7.5, 4.4, 3.), v(3., 5.5, 5.8)]),
                ("store", vec![v(7.5, EYE, 3.), v(8.9, 0.1, 5.9), v(6.3, 2.5, 0.1)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("hall", "store", [v(3., 1.2, 3.), v(8., 1.2, 3.1)])],
            within: vec![[v(1., EYE, 3.), v(8., 4.9, 3.)]],
        },
    );
}

#[test]
fn split_levels_joined_by_half_a_stair_are_two_rooms() {
    let mut b = Building::default();
    let way: Box3 = [v(3.9, 1.4, 2.), v(4.3, 3.4, 3.)];
    // Floors at 0 and 1.4 m, each 3.6 m high; the wall between stands from the lower floor to the upper roof.
    b.shell(v(0., 0., 0.), v(4., 3.6, 5.), &[way]);
    b.shell(v(4.2, 1.4, 0.), v(8.2, 5., 5.), &[way]);
    for step in 0..8 {
        let s = f64::from(step);
        b.solid_as("stair", Role::Stair, true, [v(2. + 0.25 * s, 0., 2.), v(2.25 + 0.25 * s, 0.175 * (s + 1.), 3.)]);
    }
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("lower", vec![v(1., EYE, 2.5), v(0.1, 0.1, 0.1), v(3.9, 3.5, 4.9), v(3., 2., 2.5), v(3., EYE, 4.)]),
                ("upper", vec![v(6., 3., 2.5), v(4.3, 1.5, 0.1), v(8.1, 4.9, 4.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("lower", "upper", [v(1., 1.9, 2.4), v(6., 2.9, 2.6)])],
            within: vec![[v(0.5, 2., 4.5), v(3.5, 3., 1.)]],
        },
    );
}

/// A house of 6 x 8 m whose roof, 0.2 m thick, goes from 1 m at the eaves to 4 m along the ridge at x = 3.
fn attic(b: &mut Building) {
    let gable = |x0: f64, x1: f64, low: f64| {
        let top = |x: f64| 4.0 - (x - 3.0).abs();
        let mut ring = vec![v(x0, low, 0.), v(x1, low, 0.), v(x1, top(x1), 0.)];
        if x0 < 3.0 && x1 > 3.0 {
            ring.push(v(3., 4., 0.));
        }
        ring.push(v(x0, top(x0), 0.));
        ring
    };
    let at = |ring: Vec<DVec3>, z: f64| ring.into_iter().map(|p| p + DVec3::Z * z).collect::<Vec<_>>();
    b.solid(v(-WALL, -WALL, -WALL), v(6. + WALL, 0., 8. + WALL));
    for side in [-1.0, 1.0] {
        let at = |x: f64, y: f64| v(3. + side * x, y, -WALL);
        b.swept(&[at(3., 0.), at(3. + WALL, 0.), at(3. + WALL, 1. - WALL), at(3., 1.)], v(0., 0., 8. + 2. * WALL));
        b.swept(
            &[at(0., 4.), at(3. + WALL, 4. - 3. - WALL), at(3. + WALL, 4.3 - 3. - WALL), at(0., 4.3)],
            v(0., 0., 8. + 2. * WALL),
        );
    }
    b.swept(&at(gable(0., 6., 0.), -WALL), v(0., 0., WALL));
    b.swept(&at(gable(0., 6., 0.), 8.), v(0., 0., WALL));
    // A partition at z = 4 with a doorway in the middle.
    for part in [gable(0., 2.55, 0.), gable(3.45, 6., 0.), gable(2.55, 3.45, 2.1)] {
        b.swept(&at(part, 4.), v(0., 0., WALL));
    }
}

#[test]
fn an_attic_has_rooms_under_its_slopes() {
    let mut b = Building::default();
    attic(&mut b);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("front", vec![v(3., EYE, 2.), v(0.1, 0.1, 0.1), v(5.9, 0.5, 3.9), v(3., 3.8, 2.), v(1.5, 2.2, 3.)]),
                ("back", vec![v(3., EYE, 6.), v(0.1, 0.1, 4.3), v(5.9, 0.5, 7.9), v(3., 3.8, 6.), v(4.5, 2.2, 5.)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("front", "back", [v(2.9, 1.2, 1.), v(3.1, 1.2, 7.)])],
            within: vec![[v(0.2, 0.2, 2.), v(3., 3.8, 2.)], [v(0.2, 0.2, 2.), v(5.8, 0.9, 2.)]],
        },
    );
}

/// Two sheets of a floor lie over each other for 2 m, one 40 micrometres above the other. What leads between them is too narrow for a portal.
#[test]
fn a_floor_of_two_sheets_parts_storeys() {
    let mut b = Building::default();
    let (lo, hi) = (v(0., 0., 0.), v(10., 6., 5.));
    for (a, c) in [
        (lo, hi.with_y(0.)),
        (lo.with_y(6.), hi),
        (lo, hi.with_x(0.)),
        (lo.with_x(10.), hi),
        (lo, hi.with_z(0.)),
        (lo.with_z(5.), hi),
        (v(0., 3., 0.), v(6., 3., 5.)),
        (v(4., 3.00004, 0.), v(10., 3.00004, 5.)),
    ] {
        b.sheet(a, c, &[]);
    }
    let known = Known {
        cells: vec![
            ("lower", vec![v(2., EYE, 2.5), v(9.9, 2.9, 0.1)]),
            ("upper", vec![v(2., 3. + EYE, 2.5), v(9.9, 3.1, 0.1)]),
            ("outside", vec![FAR]),
        ],
        ..Known::default()
    };
    assert_known(&b.finish(), &known);
}

#[test]
fn stairs_join_two_storeys_through_the_floor() {
    let mut b = Building::default();
    let hole: Box3 = [v(4., HIGH - 0.1, 0.5), v(5., HIGH + 0.3, 4.)];
    b.shell(v(0., 0., 0.), v(7., HIGH, 6.), &[hole]);
    b.shell(v(0., HIGH + WALL, 0.), v(7., 2. * HIGH + WALL, 6.), &[hole]);
    for step in 0..15 {
        let s = f64::from(step);
        let z = 0.5 + 3.5 * s / 15.0;
        b.solid_as("stair", Role::Stair, true, [v(4., 0.2 * s, z), v(5., 0.2 * (s + 1.), z + 3.5 / 15.0)]);
    }
    let (graph, of) = assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("lower", vec![v(1., EYE, 3.), v(6.9, 0.1, 5.9), v(4.5, 2.5, 0.8), v(0.1, 2.7, 0.1)]),
                ("upper", vec![v(1., 4.5, 3.), v(6.9, 3.1, 5.9), v(4.5, 4.5, 2.)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("lower", "upper", [v(4.5, 1.8, 0.7), v(4.5, 4.8, 0.8)])],
            within: vec![[v(1., EYE, 1.), v(6.5, EYE, 5.5)]],
        },
    );
    let portals = between(&graph, of["lower"], of["upper"]);
    assert!(portals.iter().all(|p| p.plane.n.y.abs() > 0.999), "level, all of them: {portals:?}");
}

#[test]
fn a_lift_shaft_is_one_cell_over_its_storeys() {
    let mut b = Building::default();
    let (lo, hi) = (v(6.2, 0., 2.), v(8.2, 8.8, 4.));
    let mut known = Known { within: vec![[v(7.2, 0.3, 3.), v(7.2, 8.5, 3.)]], ..Known::default() };
    let doors: Vec<Box3> =
        (0..3).map(|storey| 3.0 * f64::from(storey)).map(|y| [v(5.9, y, 2.5), v(6.3, y + 2.1, 3.5)]).collect();
    b.shell(lo, hi, &doors);
    for (storey, name) in ["ground", "first", "second"].into_iter().enumerate() {
        let y = 3.0 * storey as f64;
        b.shell(v(0., y, 0.), v(6., y + HIGH, 6.), &doors);
        known.cells.push((name, vec![v(2., y + EYE, 3.), v(0.1, y + 0.1, 0.1), v(5.9, y + 2.7, 5.9)]));
        known.sights.push((name, "shaft", [v(3., y + 1.2, 2.9), v(7.5, y + 1.2, 3.1)]));
    }
    known.cells.push(("shaft", vec![v(7.2, 0.5, 3.), v(7.2, 2.9, 3.), v(7.2, 8.7, 3.)]));
    known.cells.push(("outside", vec![FAR]));
    assert_known(&b.finish(), &known);
}
