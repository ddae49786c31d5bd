//! The bsp strategy: scenes with known rooms, and facts that hold whatever the unit, the turn and the mess.

use enfilade::bake::bake;
use enfilade::cells::{CellGraph, Locator, SplitOptions, Strategy, split};
use enfilade::job::Job;
use enfilade::scene::Scene;
use glam::{DVec3, dvec3 as v};
use testing::bakes::with_rays;
use testing::meshes::{Triangle, cuboid, parts as scene};
use testing::random::Random;
use testing::rooms;
use testing::sound::assert_sealed;

fn by_walls(scene: &Scene, smallest_occluder: Option<f64>) -> CellGraph {
    split(scene, &SplitOptions { strategy: Some(Strategy::Bsp), smallest_occluder, ..SplitOptions::default() }).unwrap()
}

/// Two rooms, with a doorway between them or none.
fn house(has_doorway: bool) -> Vec<Vec<Triangle>> {
    let mut parts = rooms::house();
    if !has_doorway {
        parts.push(cuboid(v(4., 0., 2.), v(4.2, 2.1, 2.9)));
    }
    parts
}

fn moved(parts: &[Vec<Triangle>], by: impl Fn(DVec3) -> DVec3) -> Vec<Vec<Triangle>> {
    parts.iter().map(|part| part.iter().map(|t| t.map(&by)).collect()).collect()
}

/// Whether portals join the cells of two points, in the model's coordinates.
fn are_joined(graph: &CellGraph, scene: &Scene, a: DVec3, b: DVec3) -> bool {
    let locator = Locator::new(graph);
    let [a, b] = [a, b].map(|p| locator.locate(p - scene.origin).expect("free space is in a cell").0);
    let mut reached = vec![a];
    let mut next = 0;
    while let Some(&cell) = reached.get(next) {
        next += 1;
        for &portal in &graph.cells[cell.index()].portals {
            let target = graph.target(portal);
            if !reached.contains(&target) {
                reached.push(target);
            }
        }
    }
    reached.contains(&b)
}

#[test]
fn rooms_are_joined_where_there_is_a_doorway_and_walls_are_no_cells() {
    for has_doorway in [true, false] {
        let scene = scene(&house(has_doorway));
        let graph = by_walls(&scene, None);
        assert_sealed(&graph, &scene, 1.0, 100_000);
        let [west, east, outside] = [v(2., 1., 1.), v(6., 1., 1.), v(-0.3, 1., 1.)];
        assert_eq!(are_joined(&graph, &scene, west, east), has_doorway);
        assert!(!are_joined(&graph, &scene, west, outside));
        let locator = Locator::new(&graph);
        assert_eq!(locator.locate(v(-0.1, 1., 1.) - scene.origin), None, "inside a wall");
        assert!(graph.cells.iter().filter(|cell| cell.open).count() == 1);
    }
}

/// A tree that follows the walls gives the same cells in metres, millimetres and units of a game, wherever the model stands.
#[test]
fn the_unit_does_not_matter() {
    let counts = |scale: f64, away: DVec3| {
        let scene = scene(&moved(&house(true), |p| p * scale + away));
        let graph = by_walls(&scene, None);
        assert_sealed(&graph, &scene, 1.0, 100_000);
        (graph.cells.len(), graph.portals.len())
    };
    let metres = counts(1.0, DVec3::ZERO);
    for (scale, away) in [(1000.0, DVec3::ZERO), (32.0, v(500., -70., 20.)), (0.0254, DVec3::ZERO)] {
        assert_eq!(counts(scale, away), metres, "scale {scale}");
    }
}

#[test]
fn a_house_is_split_as_finely_on_a_wide_ground() {
    let on_ground = |reach: f64| {
        let mut parts = house(true);
        parts.push(cuboid(v(-reach, -0.3, -reach), v(reach, -0.2, reach)));
        scene(&parts)
    };
    let (near, wide) = (on_ground(30.), on_ground(300.));
    let [of_near, of_wide] = [&near, &wide].map(|scene| by_walls(scene, None));
    // With the smallest occluder, in metres.
    assert_eq!(of_wide.notes[0], of_near.notes[0]);
    assert!(of_wide.notes[0].contains(" m (--cells bsp:METRES)"), "{}", of_wide.notes[0]);
    let closed = |graph: &CellGraph| graph.cells.iter().filter(|c| !c.open).count();
    assert!(closed(&of_wide) > 50 && closed(&of_near) > 50, "{} {}", closed(&of_wide), closed(&of_near));
    assert!(closed(&of_wide) * 10 >= closed(&of_near) * 9, "{} {}", closed(&of_wide), closed(&of_near));
    assert_sealed(&of_wide, &wide, 1.0, 100_000);
}

#[test]
fn a_turned_house_is_as_sound() {
    let turn = glam::DQuat::from_rotation_y(0.5) * glam::DQuat::from_rotation_x(0.2);
    let scene = scene(&moved(&house(true), |p| turn * p));
    let graph = by_walls(&scene, None);
    assert_sealed(&graph, &scene, 1.0, 100_000);
    assert!(are_joined(&graph, &scene, turn * v(2., 1., 1.), turn * v(6., 1., 1.)));
}

/// A crate of 1 m in a hall parts nothing where occluders begin at 2 m, and stands in a cell.
#[test]
fn what_is_smaller_than_the_smallest_occluder_stands_in_a_cell() {
    let mut parts = house(true);
    parts.push(cuboid(v(1., 0., 1.), v(1.6, 0.6, 1.6)));
    let scene = scene(&parts);
    let inside = v(1.3, 0.3, 1.3) - scene.origin;
    let cell_in = |occluder: f64| {
        let graph = by_walls(&scene, Some(occluder));
        assert_sealed(&graph, &scene, 1.0, 100_000);
        Locator::new(&graph).locate(inside).is_some()
    };
    assert!(cell_in(2.0));
    assert!(!cell_in(0.2), "here it parts space, and nobody is in it");
}

#[test]
fn one_sided_walls_without_a_roof_are_split_and_sound() {
    // A yard of 12 x 12 m, a cross of one-sided walls with a gap in each arm, no ceiling.
    let sheet = |a: DVec3, b: DVec3| {
        let up = v(0., 3., 0.);
        vec![[a, b, b + up], [a, b + up, a + up]]
    };
    let mut parts =
        vec![vec![[v(0., 0., 0.), v(0., 0., 12.), v(12., 0., 12.)], [v(0., 0., 0.), v(12., 0., 12.), v(12., 0., 0.)]]];
    for (from, to) in [(0., 2.5), (3.5, 8.5), (9.5, 12.)] {
        parts.push(sheet(v(from, 0., 6.), v(to, 0., 6.)));
        parts.push(sheet(v(6., 0., from), v(6., 0., to)));
    }
    for (a, b) in [((0., 0.), (12., 0.)), ((12., 0.), (12., 12.)), ((12., 12.), (0., 12.)), ((0., 12.), (0., 0.))] {
        parts.push(sheet(v(a.0, 0., a.1), v(b.0, 0., b.1)));
    }
    let scene = scene(&parts);
    let graph = by_walls(&scene, None);
    assert_sealed(&graph, &scene, 1.0, 100_000);
    assert!(graph.cells.iter().filter(|cell| !cell.open).count() >= 4, "{} cells", graph.cells.len());
}

/// Squares that hang in the air at random hide nothing: no graph is made of them, and the file says so.
#[test]
fn a_soup_becomes_one_open_cell_and_says_so() {
    let mut random = Random::new(7);
    let part: Vec<Triangle> = (0..600)
        .flat_map(|_| {
            let middle = v(random.real(0., 40.), random.real(0., 15.), random.real(0., 40.));
            let mut any = || random.direction();
            let u = any();
            let w = u.cross(any()).normalize();
            let [a, b, c, d] = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(s, t)| middle + u * s + w * t);
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let scene = scene(&[part]);
    let baked = bake(&scene, with_rays(100_000), &Job::quiet()).unwrap();
    let (file, details) = (baked.file, baked.details);
    assert_eq!((file.cells.len(), file.portals.len(), file.cells[0].open), (1, 0, true));
    assert!(file.reason.contains("one open cell"), "{}", file.reason);
    assert!(details.iter().any(|detail| detail == "one open cell sees everything: 2000 rays were cast"), "{details:?}");
    assert!(file.object_rows.is_none());
}
