//! Portals whose corners coincide, lie on one line, run backwards, or enclose nothing: read as what they are, or refused with a word.

use super::world::{Motion, World, p};
use enfilade::bake::BakeOptions;
use enfilade::cells::{CellGraph, read_cells};
use enfilade::scene::Scene;
use glam::DVec3;
use serde_json::json;
use testing::bakes;

fn three_rooms() -> (World, Scene) {
    let mut w = World::new("three rooms");
    for k in 0..3 {
        let x = 4.0 * k as f64;
        w.room(p(x, 0.0, 0.0), p(x + 4.0, 3.0, 4.0));
        if k > 0 {
            w.door(k - 1, k, p(x, 0.0, 1.0), p(x, 2.0, 2.0));
        }
    }
    w.thing(p(10.0, 0.5, 1.2), p(10.5, 1.5, 1.8));
    let scene = w.scene(&Motion::NONE);
    (w, scene)
}

/// A cells file whose first door has these corners.
fn with(corners: &[[f64; 3]]) -> String {
    let cell = |k: u32| json!({"id": k, "min": [4 * k, 0, 0], "max": [4 * k + 4, 3, 4]});
    let second = [[8., 0., 1.], [8., 2., 1.], [8., 2., 2.], [8., 0., 2.]];
    json!({
        "cells": [cell(0), cell(1), cell(2)],
        "portals": [{"cells": [0, 1], "winding": corners}, {"cells": [1, 2], "winding": second}]
    })
    .to_string()
}

fn upper(scene: &Scene, graph: CellGraph) -> Vec<Vec<usize>> {
    let options = BakeOptions { keep_bounds: true, given: Some(graph), ..bakes::with_rays(0) };
    let bounds = bakes::baked(scene, options).bounds.unwrap();
    (0..3).map(|c| bounds.objects_upper.ones(c).collect()).collect()
}

const DOOR: [[f64; 3]; 4] = [[4., 0., 1.], [4., 2., 1.], [4., 2., 2.], [4., 0., 2.]];

#[test]
fn corners_that_say_the_same_door_give_the_same_rows() {
    let (_, scene) = three_rooms();
    let rows = |corners: &[[f64; 3]]| upper(&scene, read_cells(&with(corners), &scene).unwrap());
    let plain = rows(&DOOR);
    assert!(plain[0].contains(&3), "the thing is seen through both doors");
    let reversed: Vec<[f64; 3]> = DOOR.iter().rev().copied().collect();
    let twice = [DOOR[0], DOOR[0], DOOR[1], DOOR[2], DOOR[2], DOOR[3]];
    let collinear = [DOOR[0], [4., 1., 1.], [4., 1.5, 1.], DOOR[1], DOOR[2], DOOR[3]];
    let almost = [DOOR[0], [4., 1e-12, 1.], DOOR[1], DOOR[2], DOOR[3]];
    for (what, corners) in [
        ("reversed", &reversed[..]),
        ("coincident", &twice),
        ("collinear", &collinear),
        ("almost coincident", &almost),
        ("begun elsewhere", &[DOOR[2], DOOR[3], DOOR[0], DOOR[1]]),
    ] {
        assert_eq!(rows(corners), plain, "{what}");
    }
}

#[test]
fn windings_that_enclose_nothing_are_refused_with_their_place() {
    let (_, scene) = three_rooms();
    for (corners, what) in [
        (&[DOOR[0], DOOR[1]][..], "2 corners"),
        (&[DOOR[0], DOOR[1], [4., 1., 1.]], "no area"),
        (&[DOOR[0]; 5], "no area"),
        (&[DOOR[0], DOOR[1], DOOR[0], DOOR[1]], "no area"),
        (&[DOOR[0], DOOR[2], DOOR[1], DOOR[3]], "winding"),
        (&[DOOR[0], DOOR[1], [4.5, 2., 2.], DOOR[3]], "winding"),
    ] {
        let error = read_cells(&with(corners), &scene).expect_err(what).to_string();
        assert!(error.starts_with("portals[0].winding") && error.contains(what), "{what}: {error}");
    }
}

/// A graph may come from elsewhere than a file: portals without area are passed by nothing, and end nothing.
#[test]
fn portals_without_area_beside_others_lose_nothing() {
    let (world, scene) = three_rooms();
    let graph = world.graph(&scene, &Motion::NONE);
    let plain = upper(&scene, graph.clone());
    for corners in [vec![DOOR[0]; 3], vec![DOOR[0], DOOR[1], DOOR[0]], vec![DOOR[0], [4., 1., 1.], DOOR[1], [4., 1.5, 1.]]] {
        let mut graph = graph.clone();
        let winding = corners.iter().map(|&c| DVec3::from(c) - scene.origin).collect();
        graph.portals.push(enfilade::cells::Portal { winding, ..graph.portals[0].clone() });
        graph.link();
        let found = upper(&scene, graph);
        for (c, row) in plain.iter().enumerate() {
            assert!(row.iter().all(|o| found[c].contains(o)), "cell {c}: {row:?}, {:?}", found[c]);
        }
    }
}

/// What `f32` can't tell from a line is said in the file.
#[test]
fn a_portal_that_single_precision_cannot_hold_is_named_in_the_file() {
    let notes = |world: &World| {
        let scene = world.scene(&Motion::NONE);
        let given = Some(world.graph(&scene, &Motion::NONE));
        bakes::baked(&scene, BakeOptions { given, ..bakes::with_rays(0) }).notes
    };
    let said = |notes: Vec<String>| notes.into_iter().filter(|n| n.contains("f32")).collect::<Vec<_>>();
    assert_eq!(said(notes(&three_rooms().0)), [""; 0]);
    let fine = said(notes(&super::scenes::hole_and_gate()));
    assert!(fine.len() == 1 && fine[0].starts_with("2 portals are narrower than "), "{fine:?}");
}
