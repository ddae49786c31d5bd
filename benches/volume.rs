//! The volume strategy over the size of a plant. Each graph is checked before it is timed: every bay of every shed is a cell of
//! its own, its neighbours are joined by one portal of the gate's size, and nothing leaks.

use criterion::{Criterion, criterion_group, criterion_main};
use enfilade::cells::{Locator, SplitOptions, Strategy, split, validate};
use enfilade::generate::{Generated, Kind, generate};
use enfilade::geom::area;
use enfilade::scene::gltf::from_slice;
use enfilade::scene::rays::RayScene;
use enfilade::scene::{ImportOptions, Scene};
use glam::DVec3;
use serde_json::Value;
use std::hint::black_box;

const OPTIONS: SplitOptions = SplitOptions {
    strategy: Some(Strategy::Volume),
    voxel: Some(0.2),
    smallest_occluder: None,
    in_metres: false,
    memory: 1 << 30,
};

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_default()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map(Vec::as_slice).unwrap_or_default()
}

/// What the generator's plan says must be found.
fn check(made: &Generated, scene: &Scene) {
    let graph = split(scene, &OPTIONS).unwrap();
    let locator = Locator::new(&graph);
    let at = |p: DVec3| locator.locate(p - scene.origin).expect("free space is in a cell").0;
    let outside = at(DVec3::new(0.5, 25.0, 0.5));
    let middle = |room: &Value| {
        let ring = list(&room["footprint"][0][0]);
        let sum = ring.iter().fold((0.0, 0.0), |a, p| (a.0 + number(&p[0]), a.1 + number(&p[1])));
        DVec3::new(sum.0 / ring.len() as f64, 0.7 * number(&room["ceiling_y"]), sum.1 / ring.len() as f64)
    };
    let rooms = list(&made.rooms["rooms"]);
    let cells: Vec<_> = rooms.iter().map(|r| at(middle(r))).collect();
    let mut known = cells.clone();
    known.extend([outside]);
    known.sort_unstable();
    known.dedup();
    assert_eq!(known.len(), rooms.len() + 1, "each bay is a cell");
    for door in list(&made.rooms["doors"]) {
        let of = |side: &Value| rooms.iter().position(|r| r["id"] == *side).map_or(outside, |i| cells[i]);
        let pair = [of(&door["rooms"][0]), of(&door["rooms"][1])];
        let size = number(&door["width"]) * number(&door["height"]);
        let joining = graph.portals.iter().filter(|p| p.cells == pair || p.cells == [pair[1], pair[0]]);
        assert!(joining.map(|p| area(&p.winding)).any(|a| (a - size).abs() < 0.02 * size), "a gate of {size} m2");
    }
    let sealing = validate::sealing(&graph, &RayScene::new(scene), 20_000, 1);
    assert!(sealing.leaks.is_empty() && sealing.segments > 2_000);
    println!(
        "{} triangles, {} cells, {} portals; {}",
        scene.triangles.len(),
        graph.cells.len(),
        graph.portals.len(),
        graph.notes.iter().map(|note| note.text.as_str()).collect::<Vec<_>>().join("; ")
    );
}

fn plants(c: &mut Criterion) {
    let mut group = c.benchmark_group("plant");
    group.sample_size(10);
    for size in [60, 120, 240] {
        let made = generate(Kind::Plant { size }, 1).unwrap();
        let scene =
            from_slice(&made.glb, "plant", None, &ImportOptions { tubes: false, ..ImportOptions::default() }).unwrap();
        check(&made, &scene);
        group.bench_function(format!("{size} m"), |b| b.iter(|| black_box(split(&scene, &OPTIONS).unwrap())));
    }
    group.finish();
}

criterion_group!(benches, plants);
criterion_main!(benches);
