//! The upper bound: nothing that a line can reach is ever missing, and what is known to be hidden is.

mod worlds;

use enfilade::cells::{Cell, CellGraph, Portal};
use enfilade::job::Job;
use enfilade::math::geom::{Aabb, Plane};
use enfilade::pvs::flow::flow;
use enfilade::{BitMatrix, CellId};
use glam::DVec3;
use testing::grid::{graph, input, rectangle};

/// Flow over cells alone.
fn upper(graph: &CellGraph) -> BitMatrix {
    let n = graph.cells.len();
    let none = BitMatrix::new(n, 0);
    let result = flow(&input(graph, &none, &[], [&BitMatrix::new(n, n), &none], 1_000_000), &Job::quiet()).unwrap();
    assert_eq!((result.capped, result.objects_upper.count_ones()), (0, 0));
    result.cells_upper
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
    let nothing = [&BitMatrix::new(3, 3), &BitMatrix::new(3, 4)];
    let result = flow(&input(&g, &placement, &bounds, nothing, 1000), &Job::quiet()).unwrap();
    // A line from room 0 through both doors rises at most 1 m in 4: z <= 2 + 0.15 / 4 at x = 8.15.
    assert_eq!(lists(&result.objects_upper), [vec![0, 1, 2], vec![0, 1, 2, 3], vec![0, 1, 2, 3]]);
}
