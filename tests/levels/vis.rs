//! `vis`: both bounds hold, every line is one, and results don't depend on threads or interruptions.

mod rounding;
mod runs;

use enfilade::BitMatrix;
use enfilade::cells::CellGraph;
use enfilade::job::Job;
use enfilade_levels::{Level, LevelPortal, Line, PairProof, Vis, VisError, VisOptions, vis, why};
use glam::DVec3;
use testing::data::data;
use testing::grid::{Grid, Recipe};
use testing::prt;
use testing::random::Random;

const OPTIONS: VisOptions = VisOptions { seed: 1, steps: 1_000_000, lines: 4, fast: false };

fn run(level: &Level) -> Vis {
    run_with(level, &OPTIONS).expect("a result")
}

fn run_with(level: &Level, options: &VisOptions) -> Result<Vis, VisError> {
    vis(level, options, None, &Job::quiet())
}

/// What holds for every result.
fn check_shape(level: &Level, vis: &Vis) {
    for m in [&vis.lower, &vis.upper] {
        assert_eq!((m.rows(), m.columns()), (level.cells, level.cells));
        for i in 0..level.cells {
            assert!(m.get(i, i));
            assert!(m.ones(i).all(|j| m.get(j, i)), "symmetric");
        }
    }
    assert_eq!(vis.lower.first_outside(&vis.upper), None, "lower within upper");
    for p in &level.portals {
        assert!(vis.lower.get(p.cells[0] as usize, p.cells[1] as usize), "neighbours");
    }
    // Lines prove the lower set.
    let mut proven = BitMatrix::new(level.cells, level.cells);
    for i in 0..level.cells {
        proven.set(i, i);
    }
    for p in &level.portals {
        let [a, b] = p.cells.map(|c| c as usize);
        proven.set(a, b);
        proven.set(b, a);
    }
    for line in &vis.lines {
        check_line(level, line);
        let cells = line.cells_along(level);
        for &a in &cells {
            cells.iter().for_each(|&b| _ = proven.set(a as usize, b as usize));
        }
    }
    assert_eq!(vis.lower.first_outside(&proven), None, "a pair without a line");
    assert_eq!(proven.first_outside(&vis.lower), None, "a line that was not made use of");
}

/// That a line crosses the windows that it names, in order, the way that they lead: by the signs of the volumes that it spans
/// with their edges.
fn check_line(level: &Level, line: &Line) {
    let (from, to) = (line.from, line.to);
    let mut cell = line.cells[0];
    if from == to {
        assert_eq!(line.portals.len(), 1);
        return;
    }
    let mut last = f64::NEG_INFINITY;
    for &id in &line.portals {
        let portal = &level.portals[id as usize / 2];
        let mut winding = portal.winding.clone();
        assert_eq!(portal.cells[id as usize % 2], cell, "the chain hangs together");
        cell = portal.cells[1 - id as usize % 2];
        if id % 2 == 1 {
            winding.reverse();
        }
        for (i, &a) in winding.iter().enumerate() {
            let b = winding[(i + 1) % winding.len()];
            // Counter-clockwise seen from where the line goes. The sign is exact: lines may be as thin as rounding.
            let coord = |p: DVec3| robust::Coord3D { x: p.x, y: p.y, z: p.z };
            let volume = robust::orient3d(coord(a), coord(b), coord(to), coord(from));
            assert!(a == b || volume > 0.0, "passes inside edge {i} of {id}");
        }
        let n = (winding[1] - winding[0]).cross(winding[2] - winding[0]);
        let t = n.dot(winding[0] - from) / n.dot((to - from).normalize());
        assert!(t >= last - 1e-6, "in order");
        last = t;
    }
    assert_eq!(cell, line.cells[1]);
}

/// Rooms in a row along x: door k, at x = `x[k]`, has the corners `winding[k]` as (y, z), counter-clockwise seen from +x.
fn row(doors: &[(f64, Vec<(f64, f64)>)]) -> Level {
    let portals = doors.iter().zip(0u32..).map(|((x, corners), k)| LevelPortal {
        cells: [k, k + 1],
        winding: corners.iter().map(|&(y, z)| DVec3::new(*x, y, z)).collect(),
    });
    Level { cells: doors.len() + 1, portals: portals.collect(), rounding: 0.0 }
}

fn rectangle(y: [f64; 2], z: [f64; 2]) -> Vec<(f64, f64)> {
    vec![(y[0], z[0]), (y[1], z[0]), (y[1], z[1]), (y[0], z[1])]
}

/// The greatest margin of a line `c + s x` over intervals: every candidate through two of their ends, and more at their edges
/// moved in by the margin, is tried by bisection. Negative: by how much it misses.
fn margin(intervals: &[(f64, [f64; 2])]) -> f64 {
    let feasible = |m: f64| {
        let ends: Vec<(f64, f64)> = intervals.iter().flat_map(|&(x, [a, b])| [(x, a + m), (x, b - m)]).collect();
        // A line by its height at one place and its slope.
        let holds = |x: f64, y: f64, s: f64| {
            intervals.iter().all(|&(u, [a, b])| (a + m - 1e-9..=b - m + 1e-9).contains(&(y + s * (u - x))))
        };
        ends.iter().any(|&(x, y)| holds(x, y, 0.0) || ends.iter().any(|&(u, v)| u != x && holds(x, y, (v - y) / (u - x))))
    };
    let (mut low, mut high) = (-100.0, 100.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        // A negative margin widens the intervals.
        if feasible(middle) { low = middle } else { high = middle }
    }
    low
}

#[test]
fn rows_of_doors_are_decided_exactly() {
    let mut random = Random::new(5);
    let (mut seen, mut hidden, mut close) = (0, 0, 0);
    for _ in 0..400 {
        let n = 3 + random.below(6);
        let mut x = 0.0;
        let doors: Vec<(f64, [[f64; 2]; 2])> = (0..n)
            .map(|_| {
                x += [0.001, 1.0, 5.0][random.below(3)];
                let mut side = || {
                    let (low, size) = (random.real(0.0, 3.0), [0.01, 0.3, 1.5][random.below(3)]);
                    [low, low + size]
                };
                (x, [side(), side()])
            })
            .collect();
        let level = row(&doors.iter().map(|&(x, [y, z])| (x, rectangle(y, z))).collect::<Vec<_>>());
        let result = run(&level);
        check_shape(&level, &result);
        for i in 0..n {
            for k in i + 1..n {
                let axis = |a: usize| margin(&doors[i..=k].iter().map(|&(x, d)| (x, d[a])).collect::<Vec<_>>());
                let margin = axis(0).min(axis(1));
                let (lower, upper) = (result.lower.get(i, k + 1), result.upper.get(i, k + 1));
                if margin > 1e-6 {
                    assert!(lower, "cells {i} and {} of {doors:?}: margin {margin}", k + 1);
                    seen += 1;
                } else if margin < -1e-6 {
                    assert!(!upper, "cells {i} and {} of {doors:?}: margin {margin}", k + 1);
                    hidden += 1;
                } else {
                    close += 1;
                }
            }
        }
    }
    assert!(seen > 1000 && hidden > 1000 && close < 10, "{seen} {hidden} {close}");
}

#[test]
fn grids_agree_with_a_walker_both_ways() {
    for seed in 0..12 {
        let recipe = Recipe { size: [5, 2, 5], doors: 0.5, joined: 0.0, outside: false, objects: 0 };
        let grid = Grid::random(recipe, seed);
        let level = level(&grid.graph());
        let result = run(&level);
        check_shape(&level, &result);
        assert_eq!(
            grid.seen(100_000, seed)[0].first_outside(&result.upper),
            None,
            "seed {seed}: a ray leaves the upper set"
        );
        // And every line is followed by the grid's own walker.
        let mut path = Vec::new();
        for line in result.lines.iter().filter(|l| l.from != l.to) {
            let d = line.to - line.from;
            let first = line.cells[0] as usize;
            let start = line.from - d.normalize() * 1e-7;
            grid.walk(grid.cell.iter().position(|&c| c == first).expect("a room"), start, d, &mut path);
            let cells: Vec<usize> = line.cells_along(&level).iter().map(|&c| c as usize).collect();
            assert!(path.starts_with(&cells), "seed {seed}: {cells:?} walked as {path:?}");
        }
        let undecided = result.upper.count_ones() - result.lower.count_ones();
        assert!(undecided * 200 <= result.upper.count_ones(), "seed {seed}: {undecided} pairs undecided");
    }
}

#[test]
fn cells_that_are_not_convex_lose_nothing() {
    for seed in 0..8 {
        let recipe = Recipe { size: [6, 1, 6], doors: 0.6, joined: 0.2, outside: seed % 2 == 0, objects: 0 };
        let grid = Grid::random(recipe, seed);
        let result = run(&level(&grid.graph()));
        assert_eq!(
            grid.seen(100_000, seed)[0].first_outside(&result.upper),
            None,
            "seed {seed}: a ray leaves the upper set"
        );
    }
}

fn level(graph: &CellGraph) -> Level {
    let portal = |p: &enfilade::cells::Portal| LevelPortal { cells: p.cells.map(|c| c.0), winding: p.winding.clone() };
    Level { cells: graph.cells.len(), portals: graph.portals.iter().map(portal).collect(), rounding: 0.0 }
}

#[test]
fn thin_leaves_are_seen_through() {
    // Cells of a thousandth, a billionth, and of no thickness at all.
    for gap in [1e-3, 1e-9, 0.0] {
        let door = rectangle([0.0, 1.0], [0.0, 1.0]);
        let x = [0.0, gap, 5.0, 5.0 + gap, 5.0 + 2.0 * gap, 9.0];
        let level = row(&x.map(|x| (x, door.clone())));
        let result = run(&level);
        check_shape(&level, &result);
        assert_eq!(result.lower.count_ones(), 49, "gap {gap}");
    }
}

#[test]
fn slivers_are_windows() {
    for width in [1e-2, 1e-4, 1e-6] {
        let wide = rectangle([0.0, 8.0], [0.0, 8.0]);
        let level = row(&[
            (0.0, wide.clone()),
            (1.0, rectangle([3.0, 3.0 + width], [0.0, 8.0])),
            (2.0, rectangle([0.0, 8.0], [5.0, 5.0 + width])),
            (30.0, wide),
        ]);
        let result = run(&level);
        check_shape(&level, &result);
        assert!(result.lower.get(0, 4), "width {width}");
        // A second upright sliver beside the first lets nothing straight through, but lines at an angle.
        let level = row(&[
            (0.0, rectangle([0.0, 0.1], [0.0, 8.0])),
            (1.0, rectangle([3.0, 3.0 + width], [0.0, 8.0])),
            (2.0, rectangle([6.2, 6.3], [0.0, 8.0])),
        ]);
        assert!(!run(&level).upper.get(0, 3), "width {width}: past the sliver lies 5.9 to 6.0");
    }
}

#[test]
fn the_eye_of_a_needle() {
    let eye = |x: f64, y: f64| (x, rectangle([y, y + 1e-3], [y, y + 1e-3]));
    let along = |bend: f64| row(&[eye(0.0, 0.0), eye(10.0, 1.0), eye(20.0, 2.0 + bend), eye(30.0, 3.0)]);
    let straight = run(&along(0.0));
    assert!(straight.lower.get(0, 4));
    // The third eye may be off by no more than 1e-3 / 2 * (20 / 10 + ...): 2e-3 is too much, 5e-4 is not.
    assert!(run(&along(5e-4)).lower.get(0, 4));
    assert!(!run(&along(2.1e-3)).upper.get(0, 4));
}

#[test]
fn portals_of_nearly_one_plane_are_not_seen_through_each_other_and_hide_nothing_else() {
    // A room with two windows in one wall, a hair off its plane, and one in the far wall.
    for off in [0.0, 1e-10, 1e-5, -1e-5] {
        let window = |y: f64, x: f64| {
            vec![DVec3::new(0.0, y, 0.0), DVec3::new(0.0, y + 1.0, 0.0), DVec3::new(x, y + 1.0, 1.0), DVec3::new(x, y, 1.0)]
        };
        let far = |y: f64| {
            vec![
                DVec3::new(4.0, y, 0.0),
                DVec3::new(4.0, y + 1.0, 0.0),
                DVec3::new(4.0, y + 1.0, 1.0),
                DVec3::new(4.0, y, 1.0),
            ]
        };
        let level = Level {
            cells: 4,
            portals: vec![
                LevelPortal { cells: [1, 0], winding: window(0.0, off) },
                LevelPortal { cells: [2, 0], winding: window(2.0, -off) },
                LevelPortal { cells: [0, 3], winding: far(1.0) },
            ],
            rounding: 0.0,
        };
        let result = run(&level);
        check_shape(&level, &result);
        assert!(result.lower.get(1, 3) && result.lower.get(2, 3), "off {off}");
        if off == 0.0 {
            assert!(!result.upper.get(1, 2), "two windows of one wall");
        }
    }
}

#[test]
fn windings_may_have_any_number_of_corners() {
    let ring = |n: usize, r: f64| -> Vec<(f64, f64)> {
        (0..n).map(|k| (std::f64::consts::TAU * k as f64 / n as f64).sin_cos()).map(|(s, c)| (r * c, r * s)).collect()
    };
    for n in [3, 12, 13, 40, 200] {
        let side = |n: usize, y: f64| ring(n, 1.0).iter().map(|&(a, b)| (a + y, b)).collect::<Vec<_>>();
        let through = row(&[(0.0, side(n, 0.0)), (1.0, ring(n, 0.5)), (2.0, side(n, 0.0)), (3.0, ring(n, 1.0))]);
        let result = run(&through);
        check_shape(&through, &result);
        assert_eq!(result.lower.count_ones(), 25, "{n} corners");
        // Three rings of radius 1: from -1 through 2.9 a line comes to 6.8, and the last ring begins at 7.
        let bent = row(&[(0.0, side(n, 0.0)), (1.0, side(n, 1.9)), (2.0, side(n, 8.0))]);
        assert!(!run(&bent).upper.get(0, 3), "{n} corners");
    }
}

#[test]
fn why_tells_a_line_or_what_ends_each_chain() {
    let grid = Grid::random(Recipe { size: [4, 1, 4], doors: 0.7, joined: 0.0, outside: false, objects: 0 }, 8);
    let level = level(&grid.graph());
    let result = run(&level);
    let mut told = [0; 3];
    for a in 0..level.cells as u32 {
        for b in 0..level.cells as u32 {
            let (lower, upper) = [&result.lower, &result.upper].map(|m| m.get(a as usize, b as usize)).into();
            match why(&level, &OPTIONS, &result, a, b).expect("cells that are there") {
                PairProof::Witnessed(line) => {
                    assert!(lower && line.cells == [a, b]);
                    if a != b {
                        check_line(&level, &line);
                    }
                    told[0] += 1;
                }
                PairProof::Separated(ends) => {
                    assert!(!upper);
                    ends.iter().for_each(|end| check_separation(&level, &end.chain, &end.planes, [a, b]));
                    assert!(ends.iter().all(|end| end.sums.is_empty() || end.planes.is_empty()));
                    told[1] += 1;
                }
                PairProof::Undecided(_) => told[2] += 1,
            }
        }
    }
    assert!(told[0] > 16 && told[1] > 16 && told[2] * 50 < told[1], "{told:?}");
    let nowhere = why(&level, &OPTIONS, &result, 0, 99);
    assert!(matches!(nowhere, Err(VisError::NoSuchCell { cell: 99, .. })));
}

/// That a chain leads out of one of the two cells, and that random lines through its first and last window keep to what is
/// said of them: they pass no chain that is called impassable, and beyond others they stay inside the planes.
fn check_separation(level: &Level, chain: &[u32], planes: &[enfilade::math::geom::Plane], pair: [u32; 2]) {
    let target = |d: u32| level.portals[d as usize / 2].cells[1 - d as usize % 2];
    let source = |d: u32| level.portals[d as usize / 2].cells[d as usize % 2];
    assert!(pair.contains(&source(chain[0])));
    assert!(chain.windows(2).all(|w| target(w[0]) == source(w[1])));
    let mut random = Random::new(1);
    let mut point = |d: u32| within(&level.portals[d as usize / 2].winding, &mut random);
    for _ in 0..50 {
        let (from, to) = (point(chain[0]), point(chain[chain.len() - 1]));
        if !chain.iter().all(|&d| passes(level, d, from, to - from)) {
            continue;
        }
        assert!(!planes.is_empty(), "a line passes {chain:?} of {pair:?}");
        for far in [0.0, 0.5, 100.0] {
            let p = to + (to - from) * far;
            assert!(planes.iter().all(|plane| plane.distance(p) < 1e-6), "a line leaves the planes beyond {chain:?}");
        }
    }
}

/// A point of a convex polygon, off its edges.
fn within(winding: &[DVec3], random: &mut Random) -> DVec3 {
    let weights: Vec<f64> = winding.iter().map(|_| random.real(0.01, 1.0)).collect();
    winding.iter().zip(&weights).map(|(&p, &w)| p * w).sum::<DVec3>() / weights.iter().sum::<f64>()
}

/// True where a line passes a window the way that it leads, well inside.
fn passes(level: &Level, id: u32, o: DVec3, d: DVec3) -> bool {
    let w = &level.portals[id as usize / 2].winding;
    let sign = if id.is_multiple_of(2) { 1.0 } else { -1.0 };
    // All corners turn the same way round the line, as seen along it.
    (0..w.len()).all(|i| sign * (w[i] - o).cross(w[(i + 1) % w.len()] - o).dot(d) > 1e-9 * w[i].distance(o))
}

#[test]
fn input_that_makes_no_sense_is_refused_or_hides_nothing() {
    let door = rectangle([0.0, 1.0], [0.0, 1.0]);
    let good = row(&[(0.0, door.clone()), (1.0, door.clone()), (2.0, door)]);
    let mut bad = good.clone();
    bad.portals[1].cells[0] = 9;
    assert_eq!(run_with(&bad, &OPTIONS), Err(VisError::NoSuchCell { portal: 1, cell: 9, cells: 4 }));
    let empty = Level::default();
    assert_eq!(run(&empty).upper.count_ones(), 0);
    for winding in
        [vec![], vec![DVec3::ZERO; 4], vec![DVec3::NAN; 3], vec![DVec3::X, DVec3::Y], vec![DVec3::splat(1e300); 4]]
    {
        let mut odd = good.clone();
        odd.portals[1].winding = winding;
        let result = run(&odd);
        assert!(result.upper.get(0, 3), "nothing is known of the portal between");
    }
}

/// A second implementation of the walk through a level, for real ones: projects windings and crosses them by winding number.
fn walk(level: &Level, out: &[Vec<u32>], first: u32, o: DVec3, d: DVec3, cells: &mut Vec<usize>) {
    let target = |id: u32| level.portals[id as usize / 2].cells[1 - id as usize % 2] as usize;
    let mut last = first;
    for _ in 0..level.portals.len() {
        let cell = target(last);
        cells.push(cell);
        let inside = |id: u32| passes(level, id, o, d);
        match out[cell].iter().find(|&&id| id != last ^ 1 && inside(id)) {
            Some(&next) => last = next,
            None => return,
        }
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn rays_through_real_levels_stay_in_the_rows() {
    let folder = data();
    // More with ENFILADE_RAYS; the release check takes 100 million a level.
    let rays: usize = std::env::var("ENFILADE_RAYS").ok().and_then(|n| n.parse().ok()).unwrap_or(200_000);
    let mut settled = 0;
    for name in ["lqdm12", "id_dm4", "lq_e0m1"] {
        let level = prt::level(&folder.join(format!("prt/{name}.prt")));
        let reference = prt::rows(&folder.join(format!("prt/{name}.vis.txt.gz")), level.cells);
        let result = run_with(&level, &VisOptions::default()).expect("a result");
        check_shape(&level, &result);
        assert!(result.upper.count_ones() < reference.count_ones(), "{name}: fewer than the reference's");
        let undecided = result.upper.count_ones() - result.lower.count_ones();
        assert!(undecided * 1000 <= result.upper.count_ones(), "{name}: {undecided} undecided");
        settled += result.stats.exact_refuted;
        let only_ours = (0..level.cells).flat_map(|i| result.upper.ones(i).map(move |j| (i, j)));
        let unproven = only_ours.filter(|&(i, j)| !reference.get(i, j) && !result.lower.get(i, j)).count();
        assert_eq!(unproven, 0, "{name}: pairs that the reference refutes and nothing proves");
        let mut out = vec![Vec::new(); level.cells];
        for id in 0..2 * level.portals.len() as u32 {
            out[level.portals[id as usize / 2].cells[id as usize % 2] as usize].push(id);
        }
        let (mut random, mut cells) = (Random::new(9), Vec::new());
        for _ in 0..rays {
            let id = random.below(2 * level.portals.len()) as u32;
            let winding = &level.portals[id as usize / 2].winding;
            let o = within(winding, &mut random);
            let d = DVec3::from([(); 3].map(|()| random.real(-1.0, 1.0)));
            let n = (winding[1] - winding[0]).cross(winding[2] - winding[0]) * if id.is_multiple_of(2) { 1.0 } else { -1.0 };
            let d = if n.dot(d) < 0.0 { -d } else { d };
            cells.clear();
            cells.push(level.portals[id as usize / 2].cells[id as usize % 2] as usize);
            walk(&level, &out, id, o, d, &mut cells);
            for &a in &cells {
                assert!(cells.iter().all(|&b| result.upper.get(a, b)), "{name}: {cells:?}");
            }
        }
    }
    assert!(settled > 0, "chains that only the exact question settles");
}
