//! Threads, interruptions, limits and parts: the result is the same, or hides nothing.

use super::{OPTIONS, check_shape, level, run, run_with};
use crate::cli::folder;
use enfilade::BitMatrix;
use enfilade::job::{Job, Journal};
use enfilade_levels::{Level, LevelPortal, VisError, VisOptions, digest, vis, vis_rows};
use glam::DVec3;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use testing::bakes::on;
use testing::grid::{Grid, Recipe};

#[test]
fn one_thread_two_threads_and_again_give_the_same() {
    let grid = Grid::random(Recipe { size: [6, 2, 6], doors: 0.6, joined: 0.0, outside: false, objects: 0 }, 3);
    let level = level(&grid.graph());
    let [one, two, again] = [1, 2, 1].map(|threads| on(threads, || run(&level)));
    assert!(one == two && one == again);
    let other = run_with(&level, &VisOptions { seed: 2, ..OPTIONS }).expect("a result");
    assert_eq!(one.lower.first_outside(&other.upper), None, "another seed");
}

#[test]
fn an_interrupted_run_goes_on_to_the_same_result() {
    let grid = Grid::random(Recipe { size: [5, 2, 5], doors: 0.6, joined: 0.0, outside: false, objects: 0 }, 4);
    let level = level(&grid.graph());
    let whole = run(&level);
    let path = folder("state").join("vis_flow.state");
    let _ = std::fs::remove_file(&path);
    let journal = || Journal::open(&path, digest(&level, &OPTIONS)).expect("a state");
    // Each run is stopped a few searches after it has begun with new ones, until one isn't.
    let mut runs = 0;
    let result = loop {
        let (stop, told) = (AtomicBool::new(false), Mutex::new(0));
        let progress = |stage: &str, _: f64| {
            let mut told = told.lock().unwrap();
            *told += u32::from(stage == "flow");
            stop.fetch_or(*told == 7 * (runs + 1), Relaxed);
        };
        let journal = journal();
        let result = vis(&level, &OPTIONS, None, &Job::new(&progress).until(&stop).kept_in(&journal));
        journal.flush().expect("room on the disk");
        match result {
            Err(VisError::Stopped(_)) => runs += 1,
            result => break result,
        }
    };
    assert!(runs > 3, "stopped {runs} times");
    assert!(result == Ok(whole.clone()));
    // What is there is not worked out again.
    let size = std::fs::metadata(&path).unwrap().len();
    let journal = journal();
    assert!(vis(&level, &OPTIONS, None, &Job::quiet().kept_in(&journal)) == Ok(whole));
    journal.flush().expect("nothing to write");
    assert_eq!(std::fs::metadata(&path).unwrap().len(), size);
    // Another level, or other options: another state.
    let mut other = level.clone();
    other.portals[0].winding[0].x += 1e-9;
    assert_ne!(digest(&other, &OPTIONS), digest(&level, &OPTIONS));
    assert_ne!(digest(&level, &VisOptions { steps: 7, ..OPTIONS }), digest(&level, &OPTIONS));
}

#[test]
fn a_run_out_of_steps_hides_nothing() {
    let grid = Grid::random(Recipe { size: [5, 1, 5], doors: 0.7, joined: 0.0, outside: false, objects: 0 }, 6);
    let level = level(&grid.graph());
    let full = run(&level);
    for steps in [0, 1, 10, 100] {
        let result = run_with(&level, &VisOptions { steps, ..OPTIONS }).expect("a result");
        check_shape(&level, &result);
        assert_eq!(full.lower.first_outside(&result.upper), None);
        assert!(steps > 1 || result.stats.capped > 0);
    }
}

/// Copies of a level far from each other, their cells in turns, and a cell that nothing leads to at the end.
fn copies(level: &Level, count: usize) -> Level {
    let mut portals = Vec::new();
    for copy in 0..count {
        let aside = DVec3::X * 1000.0 * copy as f64;
        portals.extend(level.portals.iter().map(|p| LevelPortal {
            cells: p.cells.map(|cell| cell * count as u32 + copy as u32),
            winding: p.winding.iter().map(|corner| *corner + aside).collect(),
        }));
    }
    Level { cells: level.cells * count + 1, portals, rounding: level.rounding }
}

#[test]
fn parts_that_no_portal_joins_are_worked_out_by_themselves() {
    for seed in 0..4 {
        let recipe = Recipe { size: [4, 1, 4], doors: 0.6, joined: 0.2, outside: false, objects: 0 };
        let level = level(&Grid::random(recipe, seed).graph());
        let (one, count) = (run(&level), 3);
        let all = copies(&level, count);
        let found = run(&all);
        check_shape(&all, &found);
        for (whole, part) in [(&found.upper, &one.upper), (&found.lower, &one.lower)] {
            let mut expected = BitMatrix::new(all.cells, all.cells);
            expected.set(all.cells - 1, all.cells - 1);
            for copy in 0..count {
                for i in 0..level.cells {
                    part.ones(i).for_each(|j| _ = expected.set(i * count + copy, j * count + copy));
                }
            }
            assert_eq!(*whole, expected);
        }
        // Rows alone are the same.
        let rows = vis_rows(&all, &OPTIONS, &Job::quiet()).unwrap();
        let lists: Vec<Vec<u32>> = (0..all.cells).map(|i| found.upper.ones(i).map(|j| j as u32).collect()).collect();
        assert_eq!(rows.rows, lists);
        assert_eq!((rows.lower_pairs, rows.upper_pairs), (found.lower.count_ones(), found.upper.count_ones()));
        assert_eq!((rows.lines, rows.stats), (found.lines.len(), found.stats));
    }
}

/// One part and a cell beside it: what was kept of one is good for the other.
#[test]
fn rows_alone_go_on_from_what_was_kept_of_the_whole() {
    let recipe = Recipe { size: [6, 2, 6], doors: 0.6, joined: 0.0, outside: false, objects: 0 };
    let level = level(&Grid::random(recipe, 3).graph());
    // The cell that nothing leads to comes first: numbers in the part are others than in the level.
    let portal = |p: &LevelPortal| LevelPortal { cells: p.cells.map(|cell| cell + 1), winding: p.winding.clone() };
    let level = Level { cells: level.cells + 1, portals: level.portals.iter().map(portal).collect(), ..level };
    let path = folder("rows_alone").join("level.vis-state");
    let kept = || Journal::open(&path, digest(&level, &OPTIONS)).expect("a state");
    let journal = kept();
    let whole = vis(&level, &OPTIONS, None, &Job::quiet().kept_in(&journal)).unwrap();
    journal.flush().expect("room on the disk");
    drop(journal);
    assert!(whole.stats.steps > 0, "flow found something");
    let size = std::fs::metadata(&path).unwrap().len();
    let journal = kept();
    let rows = vis_rows(&level, &OPTIONS, &Job::quiet().kept_in(&journal)).unwrap();
    journal.flush().expect("nothing to write");
    assert_eq!(std::fs::metadata(&path).unwrap().len(), size, "nothing was worked out again");
    let lists: Vec<Vec<u32>> = (0..level.cells).map(|i| whole.upper.ones(i).map(|j| j as u32).collect()).collect();
    assert_eq!(rows.rows, lists);
    assert_eq!((rows.lower_pairs, rows.lines, rows.stats), (whole.lower.count_ones(), whole.lines.len(), whole.stats));
    check_shape(&level, &whole);
}
