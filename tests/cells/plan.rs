//! The plan strategy on hand-made scenes: which rooms there are, which of them are joined, and a line of sight through each opening.
//!
//! Metres, +Y up. Walls are 0.2 m thick unless something else is said, storeys 2.8 m high, doorways 0.9 x 2.1 m.

mod known;
mod open_air;
mod storeys;

use enfilade::CellId;
use enfilade::cells::{CellGraph, PortalKind};
use enfilade::scene::Role;
use glam::{DVec2, DVec3, dvec3 as v};
use known::{Known, assert_known};
use testing::meshes::changed;
use testing::solids::Box3;
use testing::walls::{Building, WALL};

const HIGH: f64 = 2.8;
const EYE: f64 = 1.5;

/// A doorway through walls across x: 0.9 m wide around `z`, 2.1 m high from `y`, wherever a wall stands between `x` and `x + 0.2`.
fn door_x(x: f64, y: f64, z: f64) -> Box3 {
    [v(x - 0.01, y, z - 0.45), v(x + WALL + 0.01, y + 2.1, z + 0.45)]
}

/// The same through walls across z.
fn door_z(x: f64, y: f64, z: f64) -> Box3 {
    [v(x - 0.45, y, z - 0.01), v(x + 0.45, y + 2.1, z + WALL + 0.01)]
}

const FAR: DVec3 = DVec3::new(-3.0, EYE, -2.0);

/// Two rooms of 4 x 5 m along x, parted by a wall at x = 4 with what `holes` leave of it, and without a way out.
fn two_rooms(holes: &[Box3]) -> Building {
    let mut b = Building::default();
    b.shell(v(0., 0., 0.), v(8.2, HIGH, 5.), &[]);
    b.holed(v(4., 0., 0.), v(4. + WALL, HIGH, 5.), holes);
    b
}

fn two_known(sight: [DVec3; 2]) -> Known {
    Known {
        cells: vec![
            ("west", vec![v(2., EYE, 2.5), v(0.1, 0.1, 0.1), v(3.9, 2.7, 4.9)]),
            ("east", vec![v(6., EYE, 2.5), v(4.3, 0.1, 0.1), v(8.1, 2.7, 4.9)]),
            ("outside", vec![FAR]),
        ],
        sights: vec![("west", "east", sight)],
        within: vec![],
    }
}

pub fn between(graph: &CellGraph, a: CellId, b: CellId) -> Vec<&enfilade::cells::Portal> {
    graph.portals.iter().filter(|p| p.cells == [a, b] || p.cells == [b, a]).collect()
}

const THROUGH: [DVec3; 2] = [DVec3::new(2., 1.2, 2.4), DVec3::new(6., 1.2, 2.6)];

#[test]
fn a_round_room_is_one() {
    let mut b = Building::default();
    let corner = |i: usize, r: f64| DVec2::from_angle(i as f64 * std::f64::consts::TAU / 16.0 + 0.05) * r;
    for (low, thick) in [(-WALL, WALL), (HIGH, WALL)] {
        b.swept(&(0..16).map(|i| corner(i, 3.3)).map(|p| v(p.x, low, p.y)).collect::<Vec<_>>(), DVec3::Y * thick);
    }
    let at = |p: DVec2, y: f64| v(p.x, y, p.y);
    for i in 0..16 {
        let (a, c) = ((corner(i, 3.0), corner(i, 3.3)), (corner(i + 1, 3.0), corner(i + 1, 3.3)));
        let along = |t: f64| (a.0.lerp(c.0, t), a.1.lerp(c.1, t));
        let mut part = |s: (DVec2, DVec2), t: (DVec2, DVec2), low: f64| {
            b.swept(&[at(s.0, low), at(t.0, low), at(t.1, low), at(s.1, low)], DVec3::Y * (HIGH - low));
        };
        if i == 3 {
            // The facet's inner side is 1.17 m long: a doorway of 0.9 m.
            part(a, along(0.115), 0.0);
            part(along(0.885), c, 0.0);
            part(along(0.115), along(0.885), 2.1);
        } else {
            part(a, c, 0.0);
        }
    }
    let out = corner(3, 1.0).lerp(corner(4, 1.0), 0.5);
    let (near, far) = (out * 1.0, out * 5.0);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("round", vec![v(0., EYE, 0.), v(2.8, 0.1, 0.), v(0., 2.7, -2.8), v(-2., EYE, 1.9)]),
                ("outside", vec![v(-8., EYE, 0.)]),
            ],
            sights: vec![("round", "outside", [at(near, 1.2), at(far, 1.2)])],
            within: vec![[v(-2.8, EYE, 0.), v(2.8, EYE, 0.3)]],
        },
    );
}

#[test]
fn a_slanted_wall_parts_rooms_as_a_straight_one_does() {
    let mut b = Building::default();
    b.shell(v(0., 0., 0.), v(9., HIGH, 6.), &[]);
    // From the front wall at x = 3 to the back wall at x = 6, its doorway in the middle.
    let (from, to) = (DVec2::new(3., -0.05), DVec2::new(6., 6.05));
    let middle = 0.5 * from.distance(to);
    b.wall_along(from, to, [0., HIGH], WALL, Some([middle - 0.45, middle + 0.45]));
    let across = (to - from).normalize().perp();
    let centre = from.midpoint(to);
    let sight = [centre + across * 1.5, centre - across * 1.5].map(|p| v(p.x, 1.2, p.y));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("west", vec![v(1., EYE, 3.), v(0.1, 0.1, 0.1), v(5.5, 2.7, 5.9), v(2.5, EYE, 0.1)]),
                ("east", vec![v(8., EYE, 3.), v(3.3, 0.1, 0.1), v(8.9, 2.7, 5.9), v(6.3, EYE, 5.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("west", "east", sight)],
            within: vec![],
        },
    );
}

/// A pane over the whole of the wall between two rooms.
fn glass_wall(role: Role) {
    let mut b = two_rooms(&[[v(3.9, 0., 0.), v(4.3, HIGH, 5.)]]);
    b.solid_as("glass", role, false, [v(4.09, 0., 0.), v(4.11, HIGH, 5.)]);
    let (graph, of) = assert_known(&b.finish(), &two_known(THROUGH));
    let area: f64 = between(&graph, of["west"], of["east"]).iter().map(|p| enfilade::math::geom::area(&p.winding)).sum();
    assert!((area - 5.0 * HIGH).abs() < 0.1, "the whole wall is open to the eye, not {area} m2");
}

#[test]
fn a_window_from_wall_to_wall_parts_rooms_that_see_each_other() {
    glass_wall(Role::Window);
}

#[test]
fn a_wall_of_glass_parts_rooms_that_see_each_other() {
    glass_wall(Role::Structure);
}

#[test]
fn double_doors_are_one_door() {
    // 1.8 m wide.
    let way: Box3 = [v(3.9, 0., 1.6), v(4.3, 2.1, 3.4)];
    for open in [false, true] {
        let mut b = two_rooms(&[way]);
        for (name, hinge, side) in [("left", 1.6, 1.0), ("right", 3.4, -1.0)] {
            let along = if open { v(0.9, 0., 0.) } else { v(0., 0., 0.89 * side) };
            let thick = if open { v(0., 0., 0.04 * side) } else { v(0.04, 0., 0.) };
            let (a, c) = (v(4.1, 0.01, hinge), v(4.1, 2.09, hinge) + along + thick);
            b.solid_as(name, Role::Door, false, [a.min(c), a.max(c)]);
        }
        let (graph, of) = assert_known(&b.finish(), &two_known(THROUGH));
        let portals = between(&graph, of["west"], of["east"]);
        assert_eq!(portals.len(), 1, "{portals:?}");
        assert_eq!((portals[0].kind, portals[0].state.shut), (PortalKind::Door, !open), "{portals:?}");
        assert!((enfilade::math::geom::area(&portals[0].winding) - 1.8 * 2.1).abs() < 0.05);
    }
}

#[test]
fn an_arch_without_a_leaf_parts_rooms() {
    // 1.4 m wide, half round from 1.6 m up to 2.3 m.
    let mut b = two_rooms(&[[v(3.9, 0., 1.8), v(4.3, 2.4, 3.2)]]);
    let on = |k: usize| DVec2::from_angle(k as f64 * std::f64::consts::PI / 8.0) * 0.7 + DVec2::new(2.5, 1.6);
    for k in 0..8 {
        let (p, q) = (on(k), on(k + 1));
        b.swept(&[v(4., p.y, p.x), v(4., q.y, q.x), v(4., 2.4, q.x), v(4., 2.4, p.x)], v(WALL, 0., 0.));
    }
    let scene = b.finish();
    let (graph, of) = assert_known(&scene, &two_known(THROUGH));
    let portals = between(&graph, of["west"], of["east"]);
    assert!(portals.iter().all(|p| p.kind == PortalKind::Opening), "{portals:?}");
    // All of the arch is open, and at most the rectangle around it: its facets are too small to cut the plan.
    let area: f64 = portals.iter().map(|p| enfilade::math::geom::area(&p.winding)).sum();
    let arch = 1.4 * 1.6 + 4.0 * 0.7 * 0.7 * (std::f64::consts::PI / 8.0).sin();
    assert!(area >= arch - 0.01 && area <= 1.4 * 2.4 + 0.05, "{area} m2, the arch has {arch}");
}

#[test]
fn a_wide_opening_parts_rooms_and_a_missing_wall_does_not() {
    // 2 of 5 m.
    assert_known(&two_rooms(&[[v(3.9, 0., 1.5), v(4.3, HIGH, 3.5)]]).finish(), &two_known(THROUGH));
    // 4.4 of 5 m: what is left are pilasters.
    let scene = two_rooms(&[[v(3.9, 0., 0.3), v(4.3, HIGH, 4.7)]]).finish();
    let all = Known {
        cells: vec![("room", vec![v(2., EYE, 2.5), v(6., EYE, 2.5), v(8.1, 0.1, 4.9)]), ("outside", vec![FAR])],
        sights: vec![],
        within: vec![THROUGH],
    };
    assert_known(&scene, &all);
}

#[test]
fn an_l_shaped_room_is_one() {
    let mut b = Building::default();
    let yard: Box3 = [v(4.2, -1., 4.2), v(9., 9., 9.)];
    b.shell(v(0., 0., 0.), v(8., HIGH, 8.), &[yard]);
    b.solid(v(4., 0., 4.), v(4. + WALL, HIGH, 8. + WALL));
    b.solid(v(4. + WALL, 0., 4.), v(8. + WALL, HIGH, 4. + WALL));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("room", vec![v(2., EYE, 2.), v(7.9, 0.1, 0.1), v(0.1, 2.7, 7.9)]),
                ("outside", vec![FAR, v(6., EYE, 6.)]),
            ],
            sights: vec![],
            within: vec![[v(6., EYE, 1.5), v(1.5, EYE, 6.)]],
        },
    );
}

#[test]
fn a_massive_pier_is_no_room() {
    let mut b = Building::default();
    b.shell(v(0., 0., 0.), v(8., HIGH, 8.), &[]);
    b.solid(v(4., 0., 4.), v(8., HIGH, 8.));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![("room", vec![v(2., EYE, 2.), v(7.9, 0.1, 0.1), v(0.1, 2.7, 7.9)]), ("outside", vec![FAR])],
            sights: vec![],
            within: vec![[v(6., EYE, 1.5), v(1.5, EYE, 6.)]],
        },
    );
}

#[test]
fn paper_walls_part_rooms() {
    let mut b = Building::default();
    let (lo, hi) = (v(0., 0., 0.), v(12., HIGH, 5.));
    b.sheet(lo, hi.with_y(0.), &[]);
    b.sheet(lo.with_y(HIGH), hi, &[]);
    b.sheet(lo, hi.with_x(0.), &[]);
    b.sheet(lo.with_x(12.), hi, &[[v(11.9, 0., 2.), v(12.1, 2.1, 3.)]]);
    b.sheet(lo, hi.with_z(0.), &[]);
    b.sheet(lo.with_z(5.), hi, &[]);
    for x in [4., 8.] {
        b.sheet(lo.with_x(x), hi.with_x(x), &[[v(x - 0.1, 0., 2.), v(x + 0.1, 2.1, 2.9)]]);
    }
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("first", vec![v(2., EYE, 2.5), v(0.1, 0.1, 0.1), v(3.9, 2.7, 4.9)]),
                ("second", vec![v(6., EYE, 2.5), v(4.1, 0.1, 0.1), v(7.9, 2.7, 4.9)]),
                ("third", vec![v(10., EYE, 2.5), v(8.1, 0.1, 0.1), v(11.9, 2.7, 4.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![
                ("first", "second", [v(2., 1.2, 2.4), v(6., 1.2, 2.6)]),
                ("second", "third", [v(6., 1.2, 2.4), v(10., 1.2, 2.6)]),
                ("third", "outside", [v(10., 1.2, 2.4), v(15., 1.2, 2.6)]),
            ],
            within: vec![],
        },
    );
}

#[test]
fn a_room_inside_a_room_is_another() {
    let mut b = Building::default();
    b.shell(v(0., 0., 0.), v(11., HIGH, 9.), &[]);
    // 3 x 3 m inside, walls up to the ceiling, a doorway towards -x.
    let (lo, hi, door) = (v(4., 0., 3.), v(7., HIGH, 6.), door_x(3.8, 0., 4.5));
    b.holed(v(3.8, 0., 2.8), v(4., HIGH, 6.2), &[door]);
    b.solid(v(7., 0., 2.8), v(7.2, HIGH, 6.2));
    b.solid(lo.with_z(2.8), hi.with_z(3.));
    b.solid(lo.with_z(6.), hi.with_z(6.2));
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("core", vec![v(5.5, EYE, 4.5), v(4.1, 0.1, 3.1), v(6.9, 2.7, 5.9)]),
                ("around", vec![v(2., EYE, 4.5), v(9., EYE, 4.5), v(5.5, EYE, 1.), v(5.5, EYE, 8.), v(0.1, 0.1, 0.1)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("core", "around", [v(6., 1.2, 4.5), v(2., 1.2, 4.6)])],
            within: vec![[v(1., EYE, 1.), v(10., EYE, 1.)], [v(10., EYE, 1.), v(10., EYE, 8.)]],
        },
    );
}

#[test]
fn a_cabin_in_a_hall_is_a_room_of_its_own() {
    let mut b = Building::default();
    b.shell(v(0., 0., 0.), v(14., 6., 10.), &[]);
    let door = door_x(4.8, 0., 5.);
    // 4 x 3 m inside, 2.5 m high, with a roof of its own.
    b.shell(v(5., 0.1, 3.5), v(9., 2.6, 6.5), &[door, [v(4., -1., 3.), v(10., -0.0, 7.)]]);
    assert_known(
        &b.finish(),
        &Known {
            cells: vec![
                ("cabin", vec![v(7., EYE, 5.), v(5.1, 0.2, 3.6), v(8.9, 2.5, 6.4)]),
                ("hall", vec![v(2., EYE, 5.), v(12., EYE, 5.), v(7., 4., 5.), v(7., EYE, 1.), v(13.9, 5.9, 9.9)]),
                ("outside", vec![FAR]),
            ],
            sights: vec![("cabin", "hall", [v(7., 1.2, 5.), v(2., 1.2, 5.1)])],
            within: vec![[v(1., 5., 1.), v(13., 4., 9.)]],
        },
    );
}

#[test]
fn doubled_and_crossing_walls_change_nothing() {
    let way = door_x(4., 0., 2.5);
    let mut b = two_rooms(&[way]);
    // The wall again; again, shifted within its thickness; and once more, through both outer walls and the slabs.
    b.holed(v(4., 0., 0.), v(4. + WALL, HIGH, 5.), &[way]);
    b.holed(v(4.05, 0., 0.), v(4.15, HIGH, 5.), &[way]);
    b.holed(v(4., -0.1, -0.1), v(4. + WALL, HIGH + 0.1, 5.1), &[way]);
    // Outer walls through each other at the corners, and all of them twice.
    for _ in 0..2 {
        b.solid(v(-0.5, 0., -WALL), v(8.7, HIGH, 0.));
        b.solid(v(-WALL, 0., -0.5), v(0., HIGH, 5.5));
    }
    // A flat sheet along the side of the wall, and one in the middle of it; in pieces that overlap.
    for (x, ends) in [(4., [0., 1.5]), (4., [1., 2.05]), (4.1, [2.95, 4.]), (4.1, [3.5, 5.])] {
        let [a, c] = [v(x, 0., ends[0]), v(x, HIGH, ends[1])];
        b.mesh("", Role::Structure, true, &[vec![a, a.with_y(c.y), c, c.with_y(0.)]]);
    }
    let (graph, of) = assert_known(&b.finish(), &two_known(THROUGH));
    let portals = between(&graph, of["west"], of["east"]);
    let area: f64 = portals.iter().map(|p| enfilade::math::geom::area(&p.winding)).sum();
    assert!(portals.len() == 1 && (area - 0.9 * 2.1).abs() < 0.02, "{portals:?}");
}

/// Files turn their triangles either way.
#[test]
fn two_rooms_of_solids_turned_inside_out_are_two_rooms() {
    let right = two_rooms(&[door_x(4., 0., 2.5)]).finish();
    assert_known(&changed(&right, |[a, b, c]| [a, c, b]), &two_known(THROUGH));
}

/// The same two rooms and their door, in units that a person's metre is so many of.
#[test]
fn two_rooms_in_other_units_are_two_rooms() {
    for unit in [1e-3, 0.01, 0.3, 1.0 / 0.3048, 1.0 / 0.0254, 40.0, 100.0, 1e3] {
        let metres = two_rooms(&[door_x(4., 0., 2.5)]).finish();
        let known = two_known(THROUGH);
        let scale = |p: &DVec3| *p * unit;
        let scaled = Known {
            cells: known.cells.iter().map(|(n, p)| (*n, p.iter().map(scale).collect())).collect(),
            sights: known.sights.iter().map(|(a, c, l)| (*a, *c, l.map(|p| p * unit))).collect(),
            within: vec![],
        };
        eprintln!("{unit} units to a metre");
        assert_known(&changed(&metres, |t| t.map(|p| p * unit)), &scaled);
    }
}
