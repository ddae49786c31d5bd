//! Splitting hand-made buildings, whose rooms and openings are known, and a generated one, whose plan is.

use super::plan::between;
use crate::cli::building;
use enfilade::cells::{CellGraph, Locator, Portal, PortalKind, SplitOptions, split};
use enfilade::math::geom::{Aabb, area};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use glam::{DMat3, DVec2, DVec3, dvec3 as v};
use serde_json::Value;
use testing::meshes::changed;
use testing::sound::assert_sealed;
use testing::walls::Building;

/// A door of 0.9 x 2.1 m, a window of 1.5 x 1.2 m.
const DOOR: DVec2 = DVec2::new(0.9, 2.1);
const WINDOW: DVec2 = DVec2::new(1.5, 1.2);
/// Storey height and the middle of a person.
const HEIGHT: f64 = 2.8;
const EYE: f64 = 1.5;

/// A turn about +Y and a move.
#[derive(Clone, Copy)]
struct Place {
    turn: DMat3,
    shift: DVec3,
}

const HERE: Place = Place { turn: DMat3::IDENTITY, shift: DVec3::ZERO };

impl Place {
    /// A point of the model in the scene's coordinates.
    fn of(&self, scene: &Scene, p: DVec3) -> DVec3 {
        self.turn * p + self.shift - scene.origin
    }
}

const LONG: f64 = 8.15;
const DEEP: f64 = 5.0;

/// Two rooms of 4 x 5 m along x; a door in the wall between them from z = 2, a window to the outside at +x from z = 1.5.
fn two_rooms(thickness: f64) -> Scene {
    let window = [v(LONG - 0.1, 0.9, 1.5), v(LONG + 0.5, 0.9 + WINDOW.y, 1.5 + WINDOW.x)];
    let door = [v(3.9, 0.0, 2.0), v(4.3, DOOR.y, 2.0 + DOOR.x)];
    let mut b = Building::default();
    b.shell(DVec3::ZERO, v(LONG, HEIGHT, DEEP), &[window]);
    let (from, to) = (v(4.0, 0.0, 0.0), v(4.0 + thickness, HEIGHT, DEEP));
    if thickness > 0.0 {
        b.holed(from, to, &[door])
    } else {
        b.sheet(from, to, &[door])
    }
    b.finish()
}

fn split_scene(scene: &Scene) -> CellGraph {
    split(scene, &SplitOptions::default()).unwrap()
}

fn sound(graph: &CellGraph, scene: &Scene, segments: u64) {
    assert!(assert_sealed(graph, scene, 1.0, segments) > segments / 5);
}

/// All portals between two cells together are one rectangle of this size, to a centimetre.
fn assert_opening(portals: &[&Portal], size: DVec2) {
    assert_eq!(portals.len(), 1, "{portals:?}");
    let total: f64 = portals.iter().map(|p| area(&p.winding)).sum();
    // A centimetre on either side.
    assert!((total - size.x * size.y).abs() <= 0.01 * (size.x + size.y), "{total} m2 for {size} m");
    let bounds = Aabb::of(portals.iter().flat_map(|p| p.winding.iter().copied())).size();
    let found = DVec2::new(bounds.x.hypot(bounds.z), bounds.y);
    assert!((found - size).abs().max_element() <= 0.01, "{found} m for {size} m");
}

/// The three cells of the two rooms, told apart by where they are.
fn check_two_rooms(thickness: f64, place: Place) {
    let scene = changed(&two_rooms(thickness), |t| t.map(|p| place.turn * p + place.shift));
    let graph = split_scene(&scene);
    let locator = Locator::new(&graph);
    let at = |x: f64, y: f64, z: f64| locator.locate(place.of(&scene, v(x, y, z))).expect("free space is in a cell").0;
    let (first, second, outside) = (at(2.0, EYE, 2.5), at(6.0, EYE, 2.5), at(12.0, EYE, 2.5));
    assert!(first != second && second != outside && first != outside, "rooms {first}, {second}, outside {outside}");
    assert_eq!(graph.cells.len(), 3, "two rooms and the outside");
    // Corners of rooms belong to them as their middles do; the roof is outside.
    for (x, z) in [(0.05, 0.05), (3.9, 0.05), (3.9, 4.95), (0.05, 4.95)] {
        assert_eq!(at(x, 0.05, z), first);
        assert_eq!(at(x, HEIGHT - 0.05, z), first);
        assert_eq!(at(x + 4.2, EYE, z), second);
    }
    assert_eq!(at(4.0, HEIGHT + 1.0, 2.5), outside);
    assert_eq!([first, second, outside].map(|c| graph.cells[c.index()].open), [false, false, true]);
    assert_opening(&between(&graph, first, second), DOOR);
    assert_opening(&between(&graph, second, outside), WINDOW);
    assert_eq!(graph.portals.len(), 2, "nothing else is open");
    sound(&graph, &scene, 200_000);
}

#[test]
fn two_rooms_a_door_and_a_window() {
    check_two_rooms(0.15, HERE);
}

#[test]
fn turned_and_far_from_the_origin() {
    let turn = DMat3::from_rotation_y(30f64.to_radians());
    check_two_rooms(0.15, Place { turn, shift: v(1000.0, 0.0, 0.0) });
    check_two_rooms(0.15, Place { turn, shift: v(-600.0, 20.0, 800.0) });
}

#[test]
fn a_wall_without_thickness_parts_rooms() {
    check_two_rooms(0.0, HERE);
    check_two_rooms(0.0, Place { turn: DMat3::from_rotation_y(30f64.to_radians()), shift: v(1000.0, 0.0, 0.0) });
}

#[test]
fn a_stair_hole_in_a_slab_is_a_horizontal_portal() {
    const STAIR: DVec2 = DVec2::new(1.2, 2.5);
    let (x, z, upper) = (6.0, DEEP, HEIGHT + 0.2);
    let hole = [v(4.0, HEIGHT - 0.1, 1.0), v(4.0 + STAIR.x, upper + 0.1, 1.0 + STAIR.y)];
    let mut b = Building::default();
    b.shell(DVec3::ZERO, v(x, HEIGHT, z), &[hole]);
    b.shell(v(0.0, upper, 0.0), v(x, upper + HEIGHT, z), &[hole]);
    let scene = b.finish();
    let graph = split_scene(&scene);
    assert_eq!(graph.cells.len(), 3, "two storeys and the outside");
    let locator = Locator::new(&graph);
    let at = |y: f64| locator.locate(HERE.of(&scene, v(2.0, y, 2.5))).unwrap().0;
    let (below, above, outside) = (at(EYE), at(upper + EYE), at(upper + HEIGHT + 1.2));
    assert!(below != above && above != outside && below != outside);
    let portals = between(&graph, below, above);
    assert_eq!((portals.len(), graph.portals.len()), (1, 1));
    assert!(portals[0].plane.n.y.abs() > 0.999, "{:?}", portals[0].plane);
    let size = Aabb::of(portals[0].winding.iter().copied()).size();
    assert!((size.x - STAIR.x).abs() <= 0.01 && (size.z - STAIR.y).abs() <= 0.01, "{size}");
    assert!((area(&portals[0].winding) - STAIR.x * STAIR.y).abs() <= 0.01 * (STAIR.x + STAIR.y));
    sound(&graph, &scene, 200_000);
}

#[test]
fn the_villa_has_its_rooms() {
    let known: Value = serde_json::from_slice(&std::fs::read(building("villa_rotonda.rooms.json")).unwrap()).unwrap();
    let scene = import(&building("villa_rotonda.glb"), &ImportOptions::default()).unwrap();
    let graph = split_scene(&scene);
    let locator = Locator::new(&graph);
    let mut found = Vec::new();
    for room in known["rooms"].as_array().unwrap() {
        let ring = room["footprint"][0][0].as_array().unwrap();
        let middle = |k: usize| ring.iter().map(|p| p[k].as_f64().unwrap()).sum::<f64>() / ring.len() as f64;
        let eye = v(middle(0), room["floor_y"].as_f64().unwrap() + EYE, middle(1));
        let (cell, _) = locator.locate(eye - scene.origin).unwrap();
        assert!(!graph.cells[cell.index()].open, "{} is outside", room["name"]);
        found.push(cell);
    }
    found.sort_unstable();
    found.dedup();
    assert_eq!(found.len(), 13, "one cell a room, the round hall among them");
}

#[test]
fn the_gallery_has_its_rooms_and_doors() {
    let expected: Value = serde_json::from_slice(&std::fs::read(building("gallery100.expected.json")).unwrap()).unwrap();
    let number = |key: &str| expected[key].as_u64().unwrap() as usize;
    let scene = import(&building("gallery100.glb"), &ImportOptions::default()).unwrap();
    let graph = split_scene(&scene);
    assert_eq!((graph.cells.len(), graph.portals.len()), (101, 123));
    assert_eq!(graph.cells.iter().filter(|c| !c.open).count(), number("rooms"));
    let count = |kind| graph.portals.iter().filter(|p| p.kind == kind).count();
    let kinds = [PortalKind::Door, PortalKind::Opening, PortalKind::Window].map(count);
    assert_eq!(kinds, ["doors", "openings", "windows"].map(number));
    sound(&graph, &scene, 500_000);
}
