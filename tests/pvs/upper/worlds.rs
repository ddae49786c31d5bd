//! The upper bound of random worlds, against lines through them.

use super::upper;
use enfilade::cells::CellGraph;
use enfilade::job::Job;
use enfilade::math::geom::{Aabb, Plane};
use enfilade::pvs::flow::by_cell::FlowByCell;
use enfilade::pvs::flow::{FlowResult, flow};
use enfilade::{BitMatrix, CellId};
use glam::{DAffine3, DQuat, DVec3};
use testing::bakes::on;
use testing::grid::{self, Grid, Recipe, input};
use testing::random::Random;

/// Flow over a grid and its objects, with nothing known.
fn grid_flow(grid: &Grid, max_steps: u64) -> FlowResult {
    let nothing = [&BitMatrix::new(grid.cells, grid.cells), &BitMatrix::new(grid.cells, grid.objects.len())];
    let (graph, placement, bounds) = (grid.graph(), grid.placement(), grid.object_bounds());
    flow(&input(&graph, &placement, &bounds, nothing, max_steps), &Job::quiet()).unwrap()
}

/// Recipes of random worlds: convex rooms, joined rooms, rooms inside a ring, storeys.
const RECIPES: [Recipe; 4] = [
    Recipe { size: [6, 1, 6], doors: 0.7, joined: 0.0, outside: false, objects: 60 },
    Recipe { size: [7, 1, 7], doors: 0.8, joined: 0.3, outside: false, objects: 60 },
    Recipe { size: [8, 1, 8], doors: 0.8, joined: 0.2, outside: true, objects: 80 },
    Recipe { size: [4, 3, 4], doors: 0.6, joined: 0.2, outside: false, objects: 60 },
];

#[test]
fn no_line_ever_reaches_beyond_the_upper_bound() {
    for (r, recipe) in RECIPES.into_iter().enumerate() {
        for seed in 0..6 {
            let grid = Grid::random(recipe, 100 * r as u64 + seed);
            let result = grid_flow(&grid, 1_000_000);
            assert_eq!(result.capped, 0);
            let [cells, objects] = grid.seen(200_000, seed);
            assert_eq!(cells.first_outside(&result.cells_upper), None, "recipe {r} seed {seed}: a line joins cells");
            assert_eq!(
                objects.first_outside(&result.objects_upper),
                None,
                "recipe {r} seed {seed}: a line leads to an object"
            );
        }
    }
}

/// The room that a point is in.
fn room_at(grid: &Grid, p: DVec3) -> Option<usize> {
    let at = (p / grid.room).floor();
    let inside = (0..3).all(|k| at[k] >= 0.0 && at[k] < grid.size[k] as f64);
    inside.then(|| at.x as usize + grid.size[0] * (at.y as usize + grid.size[1] * at.z as usize))
}

#[test]
fn what_dense_lines_dont_witness_is_little() {
    let (mut bound, mut witnessed) = ([0, 0], [0, 0]);
    for seed in 0..4 {
        let (joined, outside) = if seed < 2 { (0.0, false) } else { (0.15, true) };
        let grid = Grid::random(Recipe { size: [8, 1, 8], doors: 0.7, joined, outside, objects: 150 }, seed);
        let (g, result) = (grid.graph(), grid_flow(&grid, 1_000_000));
        let (mut cells, mut objects) = (BitMatrix::new(grid.cells, grid.cells), grid.placement());
        let (mut random, mut path) = (Random::new(seed), Vec::new());
        let on_portal = |cell: usize, random: &mut Random| {
            let out = &g.cells[cell].portals;
            (!out.is_empty()).then(|| {
                let portal = &g.portals[out[random.below(out.len())].portal().index()];
                grid::inside(&Aabb::of(portal.winding.iter().copied()), random)
            })
        };
        // Aimed at each pair of the bound until it is witnessed: from portal to portal, from object to portal.
        for (a, b) in (0..grid.cells).flat_map(|a| result.cells_upper.ones(a).map(move |b| (a, b))) {
            cells.set(a, a);
            for _ in 0..100_000 {
                let (Some(p), Some(q)) = (on_portal(a, &mut random), on_portal(b, &mut random)) else { break };
                let start = p - (q - p) * 1e-6;
                if let Some(room) = room_at(&grid, start) {
                    grid.walk(room, start, q - p, &mut path);
                    path.iter().for_each(|&c| {
                        cells.set(path[0], c);
                        cells.set(c, path[0]);
                    });
                }
                if cells.get(a, b) {
                    break;
                }
            }
        }
        for (a, o) in (0..grid.cells).flat_map(|a| result.objects_upper.ones(a).map(move |o| (a, o))) {
            for _ in 0..50_000 {
                if objects.get(a, o) {
                    break;
                }
                let (bounds, room) = grid.objects[o];
                let (p, Some(q)) = (grid::inside(&bounds, &mut random), on_portal(a, &mut random)) else { break };
                grid.walk(room, p, q - p, &mut path);
                path.iter().for_each(|&c| {
                    objects.set(c, o);
                });
            }
        }
        for (k, (u, l)) in [(&result.cells_upper, &cells), (&result.objects_upper, &objects)].into_iter().enumerate() {
            assert_eq!(l.first_outside(u), None);
            bound[k] += u.count_ones();
            witnessed[k] += l.count_ones();
        }
    }
    let ratio = |k: usize| bound[k] as f64 / witnessed[k] as f64;
    println!("bound to witnessed: cells {:.4}, objects {:.4}", ratio(0), ratio(1));
    assert!(ratio(0) < 1.02 && ratio(1) < 1.03, "cells {}, objects {}", ratio(0), ratio(1));
}

/// The same portals somewhere else: `transform` is a rotation, a uniform scale and a shift.
fn moved(graph: &CellGraph, transform: DAffine3) -> CellGraph {
    let mut graph = graph.clone();
    for portal in &mut graph.portals {
        portal.winding.iter_mut().for_each(|p| *p = transform.transform_point3(*p));
        let n = transform.transform_vector3(portal.plane.n).normalize();
        portal.plane = Plane::through(portal.winding[0], n);
    }
    graph
}

#[test]
fn the_answer_moves_with_the_building() {
    for (r, recipe) in RECIPES.into_iter().enumerate() {
        let g = Grid::random(recipe, 7 + r as u64).graph();
        let here = upper(&g);
        let turn = DQuat::from_euler(glam::EulerRot::YXZ, 0.3, 1.1, -0.7);
        for (name, transform) in [
            ("turned", DAffine3::from_quat(turn)),
            ("moved", DAffine3::from_translation(DVec3::new(1e6, -1e6, 1e6))),
            ("turned and moved", DAffine3::from_rotation_translation(turn, DVec3::splat(1e4))),
            ("grown", DAffine3::from_scale(DVec3::splat(1024.0))),
            ("shrunk", DAffine3::from_scale_rotation_translation(DVec3::splat(1e-3), turn, DVec3::X)),
        ] {
            let there = upper(&moved(&g, transform));
            assert_eq!(here.first_outside(&there), None, "recipe {r}: {name} hides a pair");
            assert_eq!(there.first_outside(&here), None, "recipe {r}: {name} shows a pair");
        }
    }
}

#[test]
fn cells_see_each_other_or_neither_does() {
    for (r, recipe) in RECIPES.into_iter().enumerate() {
        let u = grid_flow(&Grid::random(recipe, 40 + r as u64), 1_000_000).cells_upper;
        for a in 0..u.rows() {
            assert!(u.get(a, a));
            u.ones(a).for_each(|b| assert!(u.get(b, a), "recipe {r}: {a} sees {b}"));
        }
    }
}

#[test]
fn running_out_of_steps_only_adds() {
    for (r, recipe) in RECIPES.into_iter().enumerate() {
        let grid = Grid::random(recipe, 60 + r as u64);
        let full = grid_flow(&grid, 1_000_000);
        let mut last = u64::MAX;
        for steps in [0, 3, 30] {
            let cut = grid_flow(&grid, steps);
            assert!(cut.capped > 0 || steps > 0);
            assert_eq!(full.cells_upper.first_outside(&cut.cells_upper), None, "recipe {r}, {steps} steps");
            assert_eq!(full.objects_upper.first_outside(&cut.objects_upper), None, "recipe {r}, {steps} steps");
            assert!(cut.cells_upper.count_ones() <= last, "more steps, more pairs");
            last = cut.cells_upper.count_ones();
        }
    }
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let grid = Grid::random(RECIPES[2], 5);
    assert_eq!(on(1, || grid_flow(&grid, 300)), on(2, || grid_flow(&grid, 300)));
}

/// Rows that are asked for one by one, in any order: they have what the whole flow has, little more, and no more than planes allow.
#[test]
fn rows_of_single_cells_hold_those_of_all() {
    let (mut whole, mut single, mut allowed) = (0, 0, 0);
    for (recipe, seed) in RECIPES.into_iter().zip(40..) {
        let grid = Grid::random(recipe, seed);
        let (g, placement, bounds) = (grid.graph(), grid.placement(), grid.object_bounds());
        let (all, most) = (grid_flow(&grid, 1_000_000), grid_flow(&grid, 0));
        let (no_cells, no_objects) =
            (BitMatrix::new(grid.cells, grid.cells), BitMatrix::new(grid.cells, grid.objects.len()));
        let by_cell = FlowByCell::new(input(&g, &placement, &bounds, [&no_cells, &no_objects], 1_000_000));
        for cell in (0..grid.cells).rev() {
            let row = by_cell.row(CellId(cell as u32), &Job::quiet()).unwrap();
            let within = |a: &[u64], b: &[u64]| a.iter().zip(b).all(|(a, b)| a & !b == 0);
            assert!(within(all.cells_upper.row(cell), &row.cells) && within(&row.cells, most.cells_upper.row(cell)));
            assert!(within(all.objects_upper.row(cell), &row.objects) && within(&row.objects, most.objects_upper.row(cell)));
            single += row.objects.iter().map(|word| word.count_ones()).sum::<u32>();
        }
        whole += all.objects_upper.count_ones() as u32;
        allowed += most.objects_upper.count_ones() as u32;
    }
    assert!(whole <= single && single - whole < (allowed - whole) / 4, "{whole}, {single}, {allowed}");
}

#[test]
fn what_is_known_to_be_visible_is_in_the_bound_and_saves_steps() {
    let grid = Grid::random(RECIPES[1], 11);
    let (g, placement, bounds) = (grid.graph(), grid.placement(), grid.object_bounds());
    let run = |cells_lower: &BitMatrix, objects_lower: &BitMatrix| {
        flow(&input(&g, &placement, &bounds, [cells_lower, objects_lower], 1_000_000), &Job::quiet()).unwrap()
    };
    let (no_cells, no_objects) = (BitMatrix::new(grid.cells, grid.cells), BitMatrix::new(grid.cells, grid.objects.len()));
    let blind = run(&no_cells, &no_objects);
    // Told everything that it will find, it has only the hidden pairs left to refute.
    let told = run(&blind.cells_upper, &blind.objects_upper);
    assert_eq!((&told.cells_upper, &told.objects_upper), (&blind.cells_upper, &blind.objects_upper));
    assert!(told.steps < blind.steps, "{} steps told, {} blind", told.steps, blind.steps);
    // Told something it would refute, it believes it.
    let (mut odd_cells, mut odd_objects) = (no_cells, no_objects);
    let hidden =
        |m: &BitMatrix| (0..m.rows()).flat_map(|r| (0..m.columns()).map(move |c| (r, c))).find(|&(r, c)| !m.get(r, c));
    let (cell, object) = (hidden(&blind.cells_upper).expect("a pair"), hidden(&blind.objects_upper).expect("a pair"));
    odd_cells.set(cell.0, cell.1);
    odd_objects.set(object.0, object.1);
    let odd = run(&odd_cells, &odd_objects);
    assert!(
        odd.cells_upper.get(cell.0, cell.1)
            && odd.cells_upper.get(cell.1, cell.0)
            && odd.objects_upper.get(object.0, object.1)
    );
}
