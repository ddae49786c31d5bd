//! The plan strategy over the size of office towers: 700, 1,900 and 5,000 offices, about 60 rooms a storey;
//! and of a maze of 5,000 rooms on one storey.
//!
//! Each split is checked against what the generator knows before its time counts: every room's middle is in a closed cell, of
//! its own but for the stairs and lifts that go through storeys. Printed are seconds and the exponent of growth between
//! neighbours: 1 is linear, n log n is 1.1 at these sizes. `--test` takes the smallest alone.

use enfilade::cells::{CellGraph, Locator, SplitOptions, Strategy, split};
use enfilade::scene::Scene;
use enfilade_scenes::{Generated, Kind};
use glam::DVec3;
use testing::bakes;
use testing::times::{growth, is_told, timed};

const SIZES: [usize; 3] = [700, 1900, 5000];

fn main() {
    let is_test = is_told("--test");
    let sizes = if is_test { &SIZES[..1] } else { &SIZES[..] };
    let mut before = None;
    for &offices in sizes {
        measure(Kind::Office { rooms: offices, storeys: None, furnished: false }, &mut before);
    }
    if !is_test {
        measure(Kind::Maze { rooms: SIZES[2] }, &mut None);
    }
}

/// Splits a building; `before` is that of the last one.
fn measure(kind: Kind, before: &mut Option<(f64, f64)>) {
    let (building, scene) = bakes::generated(kind, 0);
    let options = SplitOptions { strategy: Some(Strategy::Plan), ..SplitOptions::default() };
    let (graph, time) = timed(|| split(&scene, &options).expect("a split"));
    let (rooms, seconds) = (assert_rooms(&building, &scene, &graph), time.as_secs_f64());
    let growth = growth(before, rooms as f64, seconds);
    println!("{rooms} rooms, {} cells, {} portals: {seconds:.1} s{growth}", graph.cells.len(), graph.portals.len());
}

/// The rooms that the generator knows of, each found.
fn assert_rooms(building: &Generated, scene: &Scene, graph: &CellGraph) -> usize {
    let locator = Locator::new(graph);
    let rooms = building.rooms["rooms"].as_array().expect("rooms");
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let mut cells = Vec::new();
    for room in rooms {
        let ring = room["footprint"][0][0].as_array().expect("a ring");
        let mean = |k: usize| ring.iter().map(|p| number(&p[k])).sum::<f64>() / ring.len() as f64;
        let eye = DVec3::new(mean(0), number(&room["floor_y"]) + 1.5, mean(1));
        let (cell, _) = locator.locate(eye - scene.origin).expect("a room's middle is in a cell");
        assert!(!graph.cells[cell.index()].open, "{} is outside", room["name"]);
        cells.push(cell);
    }
    cells.sort_unstable();
    cells.dedup();
    assert!(cells.len() * 100 >= rooms.len() * 95, "{} cells for {} rooms", cells.len(), rooms.len());
    // Nor is much else a cell: the outside, what a stair's flight or a shaft parts.
    assert!(graph.cells.len() * 10 <= rooms.len() * 11 + 10, "{} cells for {} rooms", graph.cells.len(), rooms.len());
    rooms.len()
}
