//! Portal flow over the number of rooms. Each world's answer is checked before it is timed.
//!
//! `grid`: rooms in a lattice inside an outside ring, 60 % of the walls with a door, a tenth of the rooms joined to a
//! neighbour, ten objects a room; the check is that no random line reaches beyond the upper bound. `street`: two facades of ten storeys that face each other across one outside cell, a
//! window a room; the check is that rooms on opposite sides see each other and that nothing on a side sees its own facade but
//! through doors.

use criterion::{Criterion, criterion_group, criterion_main};
use enfilade::cells::{Cell, CellGraph};
use enfilade::job::Job;
use enfilade::math::geom::Aabb;
use enfilade::pvs::flow::{FlowInput, FlowResult, flow};
use enfilade::{BitMatrix, CellId};
use glam::DVec3;
use std::hint::black_box;

use testing::grid::{Grid, Recipe, graph, input, rectangle};
use testing::random::Random;

struct World {
    graph: CellGraph,
    placement: BitMatrix,
    bounds: Vec<Aabb>,
}

impl World {
    fn flow(&self) -> FlowResult {
        let (cells, objects) = (self.graph.cells.len(), self.bounds.len());
        let nothing = [&BitMatrix::new(cells, cells), &BitMatrix::new(cells, objects)];
        let input = FlowInput { coplanar: 1e-4, ..input(&self.graph, &self.placement, &self.bounds, nothing, 200_000) };
        flow(&input, &Job::quiet()).expect("nobody stops it")
    }

    fn describe(&self, name: &str, result: &FlowResult) {
        println!(
            "{name}: {} cells, {} portals, {} objects, {} steps, {} capped, {:.1} cells and {:.1} objects visible from a cell",
            self.graph.cells.len(),
            self.graph.portals.len(),
            self.bounds.len(),
            result.steps,
            result.capped,
            result.cells_upper.count_ones() as f64 / self.graph.cells.len() as f64,
            result.objects_upper.count_ones() as f64 / self.graph.cells.len() as f64,
        );
    }
}

/// A grid of about `rooms` rooms, checked.
fn grid_world(rooms: usize) -> World {
    let side = (rooms as f64).sqrt().round() as usize;
    let recipe = Recipe { size: [side, 1, side], doors: 0.6, joined: 0.1, outside: true, objects: 10 * rooms };
    let grid = Grid::random(recipe, 1);
    let world = World { graph: grid.graph(), placement: grid.placement(), bounds: grid.object_bounds() };
    let result = world.flow();
    world.describe(&format!("grid {rooms}"), &result);
    let [cells, objects] = grid.seen(4_000 * rooms, 1);
    assert_eq!(cells.first_outside(&result.cells_upper), None, "a line reaches a cell outside the bound");
    assert_eq!(objects.first_outside(&result.objects_upper), None, "a line reaches an object outside the bound");
    world
}

/// Two facades, `rooms` rooms in all, checked. Cell 0 is the street.
fn street_world(rooms: usize) -> World {
    let (storeys, mut random) = (10, Random::new(2));
    let along = rooms / 2 / storeys;
    let id = |side: usize, storey: usize, k: usize| (1 + (side * storeys + storey) * along + k) as u32;
    let (mut portals, mut bounds, mut home) = (Vec::new(), Vec::new(), Vec::new());
    for (side, storey, k) in (0..2).flat_map(|a| (0..storeys).flat_map(move |b| (0..along).map(move |c| (a, b, c)))) {
        let room = id(side, storey, k);
        let at = DVec3::new(if side == 0 { -6.0 } else { 20.0 }, 3.0 * storey as f64, 5.0 * k as f64);
        let wall = if side == 0 { 0.0 } else { 20.0 };
        let z = at.z + random.real(0.5, 3.0);
        let window = Aabb { min: DVec3::new(wall, at.y + 1.0, z), max: DVec3::new(wall, at.y + 2.2, z + 1.5) };
        portals.push(rectangle(if side == 0 { [CellId(room), CellId(0)] } else { [CellId(0), CellId(room)] }, 0, &window));
        if k + 1 < along && random.chance(0.5) {
            let x = at.x + random.real(0.5, 4.0);
            let door = Aabb { min: DVec3::new(x, at.y, at.z + 5.0), max: DVec3::new(x + 1.0, at.y + 2.0, at.z + 5.0) };
            portals.push(rectangle([CellId(room), CellId(id(side, storey, k + 1))], 2, &door));
        }
        for _ in 0..10 {
            let p = at + DVec3::new(random.real(0.0, 5.5), random.real(0.0, 2.5), random.real(0.0, 4.5));
            bounds.push(Aabb { min: p, max: p + 0.5 });
            home.push(room as usize);
        }
    }
    let mut placement = BitMatrix::new(2 * storeys * along + 1, bounds.len());
    home.iter().enumerate().for_each(|(o, &cell)| {
        placement.set(cell, o);
    });
    let world = World { graph: graph(vec![Cell::default(); placement.rows()], portals), placement, bounds };
    let result = world.flow();
    world.describe(&format!("street {rooms}"), &result);
    for (storey, k) in (0..storeys).flat_map(|s| (0..along).map(move |k| (s, k))) {
        let here = id(0, storey, k) as usize;
        assert!(
            (0..storeys).all(|s| (0..along).all(|k| result.cells_upper.get(here, id(1, s, k) as usize))),
            "across the street"
        );
        let above = |s: usize| (0..along).any(|k| result.cells_upper.get(here, id(0, s, k) as usize));
        assert!((0..storeys).all(|s| s == storey || !above(s)), "another storey of one facade");
    }
    world
}

fn flow_over_rooms(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("flow");
    group.sample_size(10);
    for rooms in [25, 100, 400, 1000] {
        let world = grid_world(rooms);
        group.bench_function(format!("grid/{rooms}"), |b| b.iter(|| black_box(world.flow())));
    }
    for rooms in [100, 400, 1000] {
        let world = street_world(rooms);
        group.bench_function(format!("street/{rooms}"), |b| b.iter(|| black_box(world.flow())));
    }
}

criterion_group!(benches, flow_over_rooms);
criterion_main!(benches);
