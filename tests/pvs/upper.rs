//! The upper bound: nothing that a line can reach is ever missing, and what is known to be hidden is.

use enfilade::cells::{Cell, CellGraph, Portal};
use enfilade::geom::{Aabb, Plane};
use enfilade::job::Job;
use enfilade::pvs::flow::by_cell::FlowByCell;
use enfilade::pvs::flow::{FlowInput, FlowResult, flow};
use enfilade::{BitMatrix, CellId};
use glam::{DAffine3, DQuat, DVec3};
use testing::grid;
use testing::grid::{Grid, Recipe, graph, rectangle};
use testing::random::Random;

/// Flow over cells alone.
fn upper(graph: &CellGraph) -> BitMatrix {
    let n = graph.cells.len();
    let none = BitMatrix::new(n, 0);
    let input = FlowInput {
        graph,
        placement: &none,
        placed_boxes: None,
        object_bounds: &[],
        cells_lower: &BitMatrix::new(n, n),
        objects_lower: &none,
        max_steps: 1_000_000,
        coplanar: 1e-5,
        fronts: None,
    };
    let result = flow(&input, &Job::quiet()).unwrap();
    assert_eq!((result.capped, result.objects_upper.count_ones()), (0, 0));
    result.cells_upper
}

/// Flow over a grid and its objects, with nothing known.
fn grid_flow(grid: &Grid, max_steps: u64) -> FlowResult {
    let placement = grid.placement();
    let input = FlowInput {
        graph: &grid.graph(),
        placement: &placement,
        placed_boxes: None,
        object_bounds: &grid.object_bounds(),
        cells_lower: &BitMatrix::new(grid.cells, grid.cells),
        objects_lower: &BitMatrix::new(grid.cells, grid.objects.len()),
        max_steps,
        coplanar: 1e-5,
        fronts: None,
    };
    flow(&input, &Job::quiet()).unwrap()
}

/// Cells without pieces: flow reads portals only.
fn cells(n: usize) -> Vec<Cell> {
    vec![Cell::default(); n]
}

fn portal(from: u32, to: u32, axis: usize, min: [f64; 3], max: [f64; 3]) -> Portal {
    rectangle([CellId(from), CellId(to)], axis, &Aabb { min: min.into(), max: max.into() })
}

/// Rooms in a row along x, 4 m each; door k is `z` wide, from floor to 2 m.
fn row(doors: &[(f64, f64)]) -> CellGraph {
    let portals = doors
        .iter()
        .enumerate()
        .map(|(k, &(low, high))| {
            let x = 4.0 * (k + 1) as f64;
            portal(k as u32, k as u32 + 1, 0, [x, 0.0, low], [x, 2.0, high])
        })
        .collect();
    graph(cells(doors.len() + 1), portals)
}

/// The rows of a matrix as lists.
fn lists(m: &BitMatrix) -> Vec<Vec<usize>> {
    (0..m.rows()).map(|r| m.ones(r).collect()).collect()
}

fn everything(n: usize) -> Vec<Vec<usize>> {
    vec![(0..n).collect(); n]
}

#[test]
fn through_doors_in_line_everything_sees_everything() {
    assert_eq!(lists(&upper(&row(&[(1.0, 2.0); 9]))), everything(10));
}

#[test]
fn doors_out_of_line_stop_the_view() {
    // Up by 0.4 m at least from the first door to the second, so past the third.
    let u = upper(&row(&[(0.2, 0.8), (1.2, 1.8), (0.2, 0.8)]));
    assert_eq!(lists(&u), [vec![0, 1, 2], vec![0, 1, 2, 3], vec![0, 1, 2, 3], vec![1, 2, 3]]);
}

#[test]
fn a_corridor_that_turns_back_hides_its_end() {
    let turn = |last: Portal| {
        graph(
            cells(5),
            vec![
                portal(0, 1, 0, [10., 0., 0.], [10., 2., 1.]),
                portal(1, 2, 2, [10., 0., 1.], [11., 2., 1.]),
                portal(2, 3, 2, [10., 0., 10.], [11., 2., 10.]),
                last,
            ],
        )
    };
    // A U: along +x, then +z, then back along -x. A line that has once gone towards +x never comes back.
    let u = upper(&turn(portal(4, 3, 0, [10., 0., 10.], [10., 2., 11.])));
    assert_eq!(lists(&u)[0], [0, 1, 2, 3]);
    assert_eq!(lists(&u)[4], [1, 2, 3, 4]);
    // A Z: on along +x. The diagonal of the middle part passes.
    assert_eq!(lists(&upper(&turn(portal(3, 4, 0, [11., 0., 10.], [11., 2., 11.])))), everything(5));
}

#[test]
fn three_slits_pass_a_line_or_not_by_a_tenth_of_a_millimetre() {
    // Slits 1 cm wide: from the first two the third is met at z from 0.99 to 1.02.
    let slits = |low: f64| row(&[(0.0, 0.01), (0.5, 0.51), (low, low + 0.01)]);
    assert!(upper(&slits(1.0199)).get(0, 3), "barely passes");
    assert!(!upper(&slits(1.0201)).get(0, 3), "nothing passes");
    assert!(upper(&slits(0.9801)).get(0, 3), "barely passes");
    assert!(!upper(&slits(0.9799)).get(0, 3), "nothing passes");
}

#[test]
fn slits_turned_against_each_other_pass_lines() {
    // A horizontal slit, then an upright one: a line through any point of both.
    let u = upper(&graph(
        cells(4),
        vec![
            portal(0, 1, 0, [0., 1., 0.], [0., 1.001, 2.]),
            portal(1, 2, 0, [4., 0., 1.], [4., 2., 1.001]),
            portal(2, 3, 0, [8., 1., 0.], [8., 1.001, 2.]),
        ],
    ));
    assert_eq!(lists(&u), everything(4));
}

/// A slit across a wall at `x`, from `a` to `b` (y, z), 1 cm wide.
fn slit(from: u32, x: f64, a: (f64, f64), b: (f64, f64)) -> Portal {
    let (a, b) = (DVec3::new(x, a.0, a.1), DVec3::new(x, b.0, b.1));
    let across = DVec3::X.cross((b - a).normalize()) * 0.01;
    let winding = vec![a, b, b + across, a + across];
    Portal { plane: Plane { n: DVec3::X, d: x }, winding, ..rectangle([CellId(from), CellId(from + 1)], 0, &Aabb::EMPTY) }
}

#[test]
fn four_slits_that_only_together_stop_every_line() {
    // A line from (0, a, 0) through (1, s, s) to (2, 0, b) has a = b = 2 s, and is at (3, -s, 3 s) in the last wall: on the
    // line z = -3 y. Any two slits, and any three, pass lines to all of the next.
    let chain = |shift: f64| {
        let portals = vec![
            slit(0, 0.0, (-1.0, 0.0), (1.0, 0.0)),
            slit(1, 1.0, (-0.5, -0.5), (0.5, 0.5)),
            slit(2, 2.0, (0.0, -1.0), (0.0, 1.0)),
            slit(3, 3.0, (-0.3, 0.9 + shift), (0.3, -0.9 + shift)),
        ];
        upper(&graph(cells(5), portals))
    };
    assert_eq!(lists(&chain(0.0)), everything(5));
    let u = chain(0.5);
    assert_eq!(lists(&u)[0], [0, 1, 2, 3]);
    assert_eq!(lists(&u)[1], [0, 1, 2, 3, 4]);
}

#[test]
fn thin_cells_and_hairline_portals_are_seen_through() {
    for thickness in [1e-3, 1e-6, 1e-9, 0.0] {
        let x = |k: usize| 4.0 + k as f64 * thickness;
        let mut portals: Vec<_> =
            (0..4).map(|k| portal(k as u32, k as u32 + 1, 0, [x(k), 0., 0.], [x(k), 2., 1.])).collect();
        portals.push(portal(4, 5, 2, [5., 0., 2.], [6., 2., 2.])); // off to the side, behind the stack
        assert_eq!(lists(&upper(&graph(cells(6), portals))), everything(6), "thickness {thickness}");
    }
    for width in [1e-2, 1e-6, 1e-9] {
        let mut far = row(&[(1.0, 1.0 + width), (0.5, 2.0)]);
        far.portals[1].winding.iter_mut().for_each(|p| *p = DVec3::new(100.0, p.y * 50.0, p.z * 50.0 - 75.0));
        far.portals[1].plane = Plane { n: DVec3::X, d: 100.0 };
        assert_eq!(lists(&upper(&far)), everything(3), "width {width}");
    }
}

#[test]
fn a_line_may_leave_a_room_and_come_back() {
    // Room 0 is a U around room 1. From room 2 a line passes one leg, crosses room 1, and goes on through the other leg into
    // room 3: it is in room 0 twice.
    let u = upper(&graph(
        cells(4),
        vec![
            portal(2, 0, 0, [0., 0., 1.], [0., 2., 2.]),
            portal(0, 1, 0, [2., 0., 1.], [2., 2., 2.]),
            portal(1, 0, 0, [4., 0., 1.], [4., 2., 2.]),
            portal(0, 3, 0, [6., 0., 1.], [6., 2., 2.]),
        ],
    ));
    assert_eq!(lists(&u), everything(4));
}

#[test]
fn windows_of_one_wall_dont_see_each_other() {
    // Three rooms behind one facade, the outside (0) before it; corners off their plane by rounding to single precision.
    for rounding in [0.0, 1e-7, -1e-7] {
        let mut portals: Vec<_> = (1..4u32)
            .map(|room| {
                let z = 3.0 * f64::from(room);
                portal(room, 0, 0, [0., 0., z], [0., 2., z + 1.])
            })
            .collect();
        portals[1].winding[2].x += rounding;
        portals[2].winding.iter_mut().for_each(|p| p.x += rounding);
        portals[2].plane.d += rounding;
        let u = upper(&graph(cells(4), portals));
        assert_eq!(lists(&u), [vec![0, 1, 2, 3], vec![0, 1], vec![0, 2], vec![0, 3]], "{rounding}");
    }
}

#[test]
fn an_opening_cut_into_coplanar_portals_is_one_opening() {
    // The opening from room 0 to room 1 is cut in four; the door behind lies across all of them.
    let mut portals: Vec<_> =
        (0..4).map(|k| portal(0, 1, 0, [0., 0., f64::from(k) * 0.25], [0., 2., f64::from(k) * 0.25 + 0.25])).collect();
    portals.push(portal(1, 2, 0, [4., 0., 0.], [4., 2., 1.]));
    assert_eq!(lists(&upper(&graph(cells(3), portals))), everything(3));
}

#[test]
fn degenerate_portals_hide_nothing() {
    let clean = row(&[(0.2, 0.8), (1.2, 1.8), (0.2, 0.8)]);
    // Corners doubled, and a corner in the middle of each edge: the same portals, the same answer.
    let mut doubled = clean.clone();
    for p in &mut doubled.portals {
        let w = p.winding.clone();
        p.winding = (0..4).flat_map(|k| [w[k], w[k], (w[k] + w[(k + 1) % 4]) * 0.5]).collect();
    }
    assert_eq!(lists(&upper(&doubled)), lists(&upper(&clean)));
    // Windings of no area, of no corners, of no number, with no normal: each in the middle of a row, seen through.
    let bad: [fn(&mut Portal); 6] = [
        |p| p.winding.iter_mut().for_each(|q| q.z = 1.5),
        |p| p.winding = vec![DVec3::new(8.0, 1.0, 1.5); 4],
        |p| p.winding.clear(),
        |p| p.winding[1].y = f64::NAN,
        |p| p.winding[3].z = f64::INFINITY,
        |p| p.plane.n = DVec3::ZERO,
    ];
    for (i, spoil) in bad.iter().enumerate() {
        let mut g = row(&[(1.0, 2.0); 3]);
        spoil(&mut g.portals[1]);
        assert_eq!(lists(&upper(&g)), everything(4), "bad portal {i}");
    }
}

#[test]
fn graphs_without_portals_cells_or_lines_are_answered() {
    assert_eq!(lists(&upper(&graph(cells(3), vec![]))), [[0], [1], [2]]);
    assert_eq!(upper(&graph(vec![], vec![])).rows(), 0);
    // A portal from a cell to itself.
    let own =
        graph(cells(2), vec![portal(0, 0, 0, [0., 0., 0.], [0., 2., 1.]), portal(0, 1, 0, [4., 0., 0.], [4., 2., 1.])]);
    assert_eq!(lists(&upper(&own)), everything(2));
}

#[test]
fn a_chain_of_three_hundred_rooms_is_followed_to_its_end() {
    let u = upper(&row(&[(1.0, 2.0); 300]));
    assert_eq!(u.count_ones(), 301 * 301);
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
            let (u, mut random, mut path) = (&result.cells_upper, Random::new(seed), Vec::new());
            for k in 0..200_000 {
                let (room, p, direction) =
                    if k % 2 == 0 { grid.random_ray(&mut random) } else { grid.aimed_ray(&mut random) };
                grid.walk(room, p, direction, &mut path);
                for (i, &a) in path.iter().enumerate() {
                    for &b in &path[i..] {
                        assert!(
                            u.get(a, b) && u.get(b, a),
                            "recipe {r} seed {seed}: {a} sees {b} from {p} along {direction}"
                        );
                    }
                }
            }
            for k in 0..100_000 {
                let o = k % grid.objects.len();
                let (bounds, room) = grid.objects[o];
                let p = grid::inside(&bounds, &mut random);
                let direction = grid.random_ray(&mut random).2;
                grid.walk(room, p, direction, &mut path);
                for &a in &path {
                    assert!(
                        result.objects_upper.get(a, o),
                        "recipe {r} seed {seed}: {a} sees object {o} at {p} along {direction}"
                    );
                }
            }
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
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| grid_flow(&grid, 300))
    };
    assert_eq!(on(1), on(2));
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
        let by_cell = FlowByCell::new(FlowInput {
            graph: &g,
            placement: &placement,
            placed_boxes: None,
            object_bounds: &bounds,
            cells_lower: &no_cells,
            objects_lower: &no_objects,
            max_steps: 1_000_000,
            coplanar: 1e-5,
            fronts: None,
        });
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
        let input = FlowInput {
            graph: &g,
            placement: &placement,
            placed_boxes: None,
            object_bounds: &bounds,
            cells_lower,
            objects_lower,
            max_steps: 1_000_000,
            coplanar: 1e-5,
            fronts: None,
        };
        flow(&input, &Job::quiet()).unwrap()
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

#[test]
fn objects_behind_the_door_frame_are_hidden_in_a_cell_that_is_seen() {
    // Room 0 looks through a door at x = 4, z in 1..2 into room 1, 4 m deep. From anywhere in room 0, nothing beside the
    // door on the near wall of room 1 is seen.
    let g = row(&[(1.0, 2.0), (1.0, 2.0)]);
    let at = |x: f64, z: f64| Aabb { min: DVec3::new(x, 0.5, z), max: DVec3::new(x + 0.1, 0.6, z + 0.1) };
    // In room 1: straight ahead; far aside (seen at a slant). In room 2: straight ahead; behind the wall beside the door.
    let bounds = [at(6.0, 1.5), at(4.05, 3.5), at(10.0, 1.5), at(8.05, 3.9)];
    let mut placement = BitMatrix::new(3, 4);
    [(1, 0), (1, 1), (2, 2), (2, 3)].iter().for_each(|&(c, o)| {
        placement.set(c, o);
    });
    let input = FlowInput {
        graph: &g,
        placement: &placement,
        placed_boxes: None,
        object_bounds: &bounds,
        cells_lower: &BitMatrix::new(3, 3),
        objects_lower: &BitMatrix::new(3, 4),
        max_steps: 1000,
        coplanar: 1e-5,
        fronts: None,
    };
    let result = flow(&input, &Job::quiet()).unwrap();
    // A line from room 0 through both doors rises at most 1 m in 4: z <= 2 + 0.15 / 4 at x = 8.15.
    assert_eq!(lists(&result.objects_upper), [vec![0, 1, 2], vec![0, 1, 2, 3], vec![0, 1, 2, 3]]);
}
