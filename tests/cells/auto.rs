//! Which strategy a scene gets when nobody asks for one, and the line that says why.

use enfilade::bake::find_cells;
use enfilade::cells::{CellGraph, SplitOptions, Strategy, split};
use enfilade::job::Job;
use enfilade::math::geom;
use enfilade::scene::{Role, RoomHint, Scene};
use glam::{DQuat, DVec2, DVec3, dvec3 as v};
use testing::meshes::{builder, cuboid, soup};
use testing::rooms::house;

fn scene(parts: &[Vec<[DVec3; 3]>], rooms: Vec<RoomHint>) -> Scene {
    let mut builder = builder();
    for (i, part) in parts.iter().enumerate() {
        builder.add(soup(&format!("part {i}"), Role::Structure, true, part)).unwrap();
    }
    builder.hints.rooms = rooms;
    builder.finish("scene").unwrap()
}

fn room(name: &str, min: DVec3, max: DVec3) -> RoomHint {
    RoomHint { id: name.into(), name: name.into(), storey: None, surface: cuboid(min, max), outside: false, drawn: true }
}

fn rooms() -> Vec<RoomHint> {
    vec![room("west", v(0., 0., 0.), v(4., 2.8, 5.)), room("east", v(4.2, 0., 0.), v(8.2, 2.8, 5.))]
}

/// The same room without its lid.
fn open(mut room: RoomHint) -> RoomHint {
    room.surface.truncate(10);
    room
}

/// The strategy that is picked, and why: one line.
fn picked(scene: &Scene) -> (CellGraph, String) {
    let graph = find_cells(scene, &SplitOptions::default(), &Job::quiet()).unwrap();
    assert!(!graph.reason.contains('\n') && !graph.reason.is_empty());
    let reason = graph.reason.clone();
    (graph, reason)
}

#[test]
fn a_house_without_rooms_is_cut_by_its_plan() {
    let (graph, reason) = picked(&scene(&house(), Vec::new()));
    assert_eq!((graph.strategy, graph.cells.len()), (Strategy::Plan, 3));
    assert!(reason.starts_with("the model names no rooms; with the floor plan, "), "{reason}");
}

#[test]
fn an_authors_sound_rooms_are_taken() {
    let (graph, reason) = picked(&scene(&house(), rooms()));
    assert_eq!(graph.strategy, Strategy::Authored);
    assert_eq!(reason, "2 of the model's 2 rooms are usable");
    let mut named: Vec<&str> = graph.cells.iter().filter_map(|c| c.source.as_deref()).collect();
    named.sort_unstable();
    assert_eq!(named, ["east", "west"]);
}

#[test]
fn half_of_the_rooms_must_be_sound() {
    let [west, east] = rooms().try_into().unwrap();
    let (graph, reason) = picked(&scene(&house(), vec![west.clone(), open(east.clone())]));
    assert_eq!(graph.strategy, Strategy::Authored);
    assert_eq!(reason, "1 of the model's 2 rooms are usable");
    // The unsound one names nothing, and is a cell for all that.
    assert_eq!(graph.cells.len(), 3);
    assert_eq!(graph.cells.iter().filter_map(|c| c.source.as_deref()).collect::<Vec<_>>(), ["west"]);
    let (graph, reason) = picked(&scene(&house(), vec![open(west), open(east)]));
    assert_eq!((graph.strategy, graph.cells.len()), (Strategy::Plan, 3));
    assert!(reason.starts_with("only 0 of the model's 2 rooms are usable; with the floor plan, "), "{reason}");
    assert!(graph.cells.iter().all(|c| c.source.is_none()));
}

/// A closed tube along z with walls that slope: 12 sides, none of them upright, its radius 3 m and a bottleneck of 1 m in the
/// middle.
fn cave() -> Vec<[DVec3; 3]> {
    let radius = |z: f64| 1.0 + 2.0 * ((z - 6.0) / 6.0).powi(2);
    let ring = |k: usize| {
        let z = k as f64;
        // Turned by 7 degrees, so that no side is upright or level.
        (0..12).map(move |i| {
            let p = DVec2::from_angle((30.0 * i as f64 + 7.0).to_radians()) * radius(z);
            v(p.x, p.y, z)
        })
    };
    let rings: Vec<Vec<DVec3>> = (0..=12).map(|k| ring(k).collect()).collect();
    let mut out = Vec::new();
    for pair in rings.windows(2) {
        for i in 0..12 {
            let j = (i + 1) % 12;
            // Facing in, as rock does around a hollow.
            out.extend([[pair[0][i], pair[1][j], pair[0][j]], [pair[0][i], pair[1][i], pair[1][j]]]);
        }
    }
    // Ends that lean, as cones do.
    for (ring, tip) in [(&rings[0], v(0., 0., -2.)), (&rings[12], v(0., 0., 14.))] {
        let inwards = (ring[1] - ring[0]).cross(tip - ring[0]).dot(v(0., 0., 6.) - ring[0]) > 0.0;
        out.extend((0..12).map(|i| {
            let (a, b) = (ring[i], ring[(i + 1) % 12]);
            if inwards { [a, b, tip] } else { [b, a, tip] }
        }));
    }
    out
}

#[test]
fn a_cave_is_cut_along_its_walls() {
    let (graph, reason) = picked(&scene(&[cave()], Vec::new()));
    assert_eq!(graph.strategy, Strategy::Bsp);
    assert!(reason.starts_with("the model names no rooms; with the split along walls, "), "{reason}");
    assert!(reason.ends_with("no floor plan was made, because only 0 % of the walls' area is vertical"), "{reason}");
    // Both hollows are indoors, and apart.
    let locator = enfilade::cells::Locator::new(&graph);
    let scene = scene(&[cave()], Vec::new());
    let at = |z: f64| locator.locate(v(0., 0., z) - scene.origin).map(|f| f.0).expect("free space is in a cell");
    assert_ne!(at(1.0), at(11.0), "{:?}", graph.portals);
}

#[test]
fn a_level_floor_alone_is_one_open_cell() {
    let (graph, reason) = picked(&scene(&[cuboid(v(0., 0., 0.), v(10., 0.2, 10.))], Vec::new()));
    assert_eq!((graph.cells.len(), graph.cells[0].open), (1, true));
    assert!(reason.starts_with("the model names no rooms; walls hide too little (100 % "), "{reason}");
}

/// A house in a field of 400 x 400 m with 400 crates: its floors are a thousandth of all, it hides next to nothing from the field, and its rooms
/// are found for all that.
#[test]
fn a_house_in_a_wide_field_keeps_its_rooms() {
    let mut parts = house();
    parts.push(cuboid(v(-200., -0.4, -200.), v(200., -0.2, 200.)));
    for (x, z) in (0..20).flat_map(|i| (0..20).map(move |k| (20.0 * f64::from(i) - 188.0, 20.0 * f64::from(k) - 188.0))) {
        parts.push(cuboid(v(x, -0.2, z), v(x + 1., 0.8, z + 1.)));
    }
    let (graph, reason) = picked(&scene(&parts, Vec::new()));
    assert_eq!((graph.strategy, graph.cells.iter().filter(|cell| !cell.open).count()), (Strategy::Plan, 2), "{reason}");
}

/// A hall of 12 x 12 m with screens between its desks, 1.4 m long and up to the ceiling, in rows 3 m apart: no doorway, one room to the plan.
/// But who stands there sees a part of it.
#[test]
fn a_hall_with_screens_is_cut_by_them() {
    let mut parts = vec![cuboid(v(-0.1, -0.2, -0.1), v(12.1, 0., 12.1)), cuboid(v(-0.1, 2.6, -0.1), v(12.1, 2.8, 12.1))];
    for (i, at) in [0., 3., 6., 9., 12.].into_iter().enumerate() {
        let outer: &[[f64; 2]] = &[[-0.1, 12.1]];
        let screens: &[[f64; 2]] = &[[0.8, 2.2], [3.8, 5.2], [6.8, 8.2], [9.8, 11.2]];
        for &[from, to] in if i % 4 == 0 { outer } else { screens } {
            parts.push(cuboid(v(from, 0., at - 0.1), v(to, 2.6, at + 0.1)));
            parts.push(cuboid(v(at - 0.1, 0., from), v(at + 0.1, 2.6, to)));
        }
    }
    for (x, z) in [0.5, 3.5, 6.5, 9.5].into_iter().flat_map(|x| [0.5, 3.5, 6.5, 9.5].map(|z| (x, z))) {
        parts.push(cuboid(v(x, 0.7, z), v(x + 1.2, 0.75, z + 1.2)));
    }
    let scene = scene(&parts, Vec::new());
    let plan = split(&scene, &SplitOptions::default()).unwrap();
    assert_eq!((plan.strategy, plan.cells.len()), (Strategy::Plan, 2), "{}", plan.reason);
    let (found, reason) = picked(&scene);
    assert_eq!(found.strategy, Strategy::Bsp, "{reason}");
    assert!(reason.ends_with(" with the floor plan"), "{reason}");
    let candidates = found.notes.iter().filter(|note| note.starts_with("candidate: ")).count();
    assert_eq!(candidates, 2, "{:?}", found.notes);
}

/// A storey of 2.7 m in centimetres is told by its height, but not against what the user says.
#[test]
fn a_unit_that_is_given_is_taken() {
    let scale = |units: f64, in_metres: bool| {
        let sheets =
            [-0.3, 0.0, 2.7, 3.0].map(|y| cuboid(v(0., units * y, 0.), v(units * 6., units * (y + 0.01), units * 4.)));
        let graph = split(&scene(&sheets, Vec::new()), &SplitOptions { in_metres, ..SplitOptions::default() }).unwrap();
        graph.notes.iter().any(|note| note.starts_with("the model seems "))
    };
    assert_eq!([scale(100.0, false), scale(100.0, true), scale(1.0, false)], [true, false, false]);
}

#[test]
fn what_is_asked_for_is_done() {
    let scene = scene(&house(), rooms());
    let options = SplitOptions { strategy: Some(Strategy::Plan), ..SplitOptions::default() };
    let graph = split(&scene, &options).unwrap();
    assert_eq!((graph.strategy, graph.reason.as_str()), (Strategy::Plan, "requested"));
    assert!(graph.cells.iter().all(|c| c.source.is_none()), "the author's rooms are not read");
}

/// A nameless box of `size` with its foot at `at`, in the house; what the split says of it.
fn told_of(at: DVec3, size: DVec3) -> Option<String> {
    let mut builder = builder();
    for (i, part) in house().iter().enumerate() {
        builder.add(soup(&format!("part {i}"), Role::Unknown, true, part)).unwrap();
    }
    builder.add(soup("Cube.012", Role::Unknown, true, &cuboid(at, at + size))).unwrap();
    let graph = split(&builder.finish("house").unwrap(), &SplitOptions::default()).unwrap();
    let notes: Vec<String> = graph.notes.iter().map(|note| note.to_string()).collect();
    notes.into_iter().find(|note| note.contains("doorway"))
}

#[test]
fn a_nameless_mesh_that_closes_the_doorway_is_told_of() {
    // The doorway is 0.9 m wide and 2.1 m high, in a wall from x = 4 to 4.2 m.
    for (at, size) in [
        (v(4.08, 0.0, 2.0), v(0.04, 2.1, 0.9)),
        (v(4.0, 0.01, 2.02), v(0.2, 2.05, 0.86)),
        (v(3.9, 0.0, 2.0), v(0.4, 2.1, 0.9)),
    ] {
        let note = told_of(at, size).unwrap_or_else(|| panic!("{at} {size}"));
        assert!(note.contains("\"Cube.012\" stands in a doorway") && note.contains("MODEL.roles.json"), "{note}");
    }
    // Beside the wall; a table; half of the doorway; a cupboard against the outer wall.
    for (at, size) in [
        (v(2.0, 0.0, 2.0), v(0.04, 2.1, 0.9)),
        (v(4.0, 0.0, 2.0), v(0.2, 0.8, 0.9)),
        (v(4.08, 0.0, 2.0), v(0.04, 2.1, 0.4)),
        (v(0.0, 0.0, 2.0), v(0.4, 2.1, 0.9)),
    ] {
        assert_eq!(told_of(at, size), None, "{at} {size}");
    }
}

/// The house, turned about a level axis by so many degrees.
fn leaning(degrees: f64) -> CellGraph {
    let turn = DQuat::from_axis_angle(v(0.8, 0.0, 0.6), degrees.to_radians());
    let parts: Vec<Vec<[DVec3; 3]>> =
        house().iter().map(|part| part.iter().map(|t| t.map(|p| turn * p)).collect()).collect();
    find_cells(&scene(&parts, Vec::new()), &SplitOptions::default(), &Job::quiet()).unwrap()
}

#[test]
fn a_house_that_leans_has_the_rooms_of_one_that_stands() {
    let upright = leaning(0.0);
    let says_so = |graph: &CellGraph| graph.notes.iter().any(|note| note.contains("tilted"));
    assert!(!says_so(&upright));
    for degrees in [0.1, 1.0, -6.0] {
        let graph = leaning(degrees);
        assert_eq!((graph.cells.len(), graph.portals.len()), (upright.cells.len(), upright.portals.len()), "{degrees}");
        assert!(says_so(&graph), "{degrees}");
        let area = |graph: &CellGraph| geom::area(&graph.portals[0].winding);
        assert!((area(&graph) - area(&upright)).abs() < 1e-3 * area(&upright), "{degrees}");
    }
}
