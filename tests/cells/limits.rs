//! A split takes time and memory by the size of its input: beyond that its cells are coarser, and it says so. It can be stopped anywhere.

use enfilade::bake::{BakeError, BakeOptions, bake, find_cells};
use enfilade::cells::validate::structure;
use enfilade::cells::{CellGraph, SplitError, SplitOptions, Strategy, split};
use enfilade::job::{Job, Stopped};
use enfilade::scene::Scene;
use glam::DVec3;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Duration;
use testing::bakes::on;
use testing::meshes::parts;
use testing::random::Random;
use testing::rooms::house;

/// Long triangles through one another in a box of 12 m, each in a plane of its own: `count` of them cut space into many more leaves.
fn splinters(count: usize) -> Scene {
    let mut random = Random::new(1);
    let mut point = |low: f64, high: f64| DVec3::from_array(std::array::from_fn(|_| random.real(low, high)));
    let triangles: Vec<[DVec3; 3]> = (0..count)
        .map(|_| {
            let (from, along) = (point(0.0, 12.0), point(-8.0, 8.0));
            [from, from + along, from + 0.5 * along + point(-0.3, 0.3)]
        })
        .collect();
    parts(&triangles.chunks(20).map(<[_]>::to_vec).collect::<Vec<_>>())
}

/// Level triangles one above the other, 2 cm apart: every edge is a line of the plan and crosses many others, and over each place of it is one
/// triangle in thirteen, so that pieces grow with the cube of their number.
fn papers(count: usize) -> Scene {
    let mut random = Random::new(2);
    let mut at = |y: f64| DVec3::new(random.real(0.0, 12.0), y, random.real(0.0, 12.0));
    let triangles: Vec<[DVec3; 3]> = (0..count).map(|i| [0.02 * i as f64; 3].map(&mut at)).collect();
    parts(&triangles.chunks(20).map(<[_]>::to_vec).collect::<Vec<_>>())
}

fn by(strategy: Strategy, memory: u64) -> SplitOptions {
    SplitOptions { strategy: Some(strategy), memory, ..SplitOptions::default() }
}

fn pieces(graph: &CellGraph) -> usize {
    graph.cells.iter().map(|cell| cell.pieces.len()).sum()
}

fn says_bound(graph: &CellGraph) -> bool {
    graph.notes.iter().any(|note| note.starts_with("bound: "))
}

/// On one thread and on two.
fn on_threads(scene: &Scene, options: &SplitOptions) -> CellGraph {
    let [one, two] = [1, 2].map(|threads| on(threads, || split(scene, options).unwrap()));
    assert_eq!(one, two);
    one
}

#[test]
fn a_soup_is_split_as_far_as_its_size_allows_and_says_so() {
    // Without memory it gets the least that any scene gets: 20,000 leaves.
    let (soup, most) = (splinters(2500), 20_000);
    let bounded = on_threads(&soup, &by(Strategy::Bsp, 0));
    assert!(says_bound(&bounded), "{:?}", bounded.notes);
    // Six pieces are around the model.
    let (cells, portals, pieces) = (bounded.cells.len(), bounded.portals.len(), pieces(&bounded));
    assert!(pieces <= most + 6, "{pieces} pieces");
    assert!(portals <= most, "{portals} portals between {cells} cells");
    assert_eq!(structure(&bounded, soup.tolerance().coplanar), []);
}

#[test]
fn a_plan_has_as_many_pieces_as_its_size_allows_and_says_so() {
    let bounded = on_threads(&papers(160), &SplitOptions { in_metres: true, ..by(Strategy::Plan, 0) });
    assert!(says_bound(&bounded), "{:?}", bounded.notes);
    assert!(pieces(&bounded) <= 50_006, "{} pieces", pieces(&bounded));
}

#[test]
fn what_fits_is_split_as_before_and_says_nothing() {
    let house = parts(&house());
    for strategy in [Strategy::Bsp, Strategy::Plan] {
        let [none, much] = [0, 1 << 40].map(|memory| split(&house, &by(strategy, memory)).unwrap());
        assert!(none == much && !says_bound(&none), "{strategy:?}: {:?}", none.notes);
        assert!(none.cells.len() > 1, "{strategy:?}: {} cells", none.cells.len());
    }
}

#[test]
fn tiles_of_any_size_may_be_asked_for() {
    // A thousandth of a millimetre: 10^21 tiles.
    let options = SplitOptions { smallest_occluder: Some(1e-6), ..by(Strategy::Bsp, 0) };
    let graph = split(&parts(&house()), &options).unwrap();
    assert!(pieces(&graph) <= 20_006, "{} pieces", pieces(&graph));
}

#[test]
fn a_split_that_is_stopped_makes_nothing() {
    let (soup, stop) = (splinters(300), AtomicBool::new(true));
    let work = Job::new(&|_, _| ()).until(&stop);
    for strategy in [None, Some(Strategy::Bsp), Some(Strategy::Plan)] {
        let found = find_cells(&soup, &SplitOptions { strategy, ..SplitOptions::default() }, &work);
        assert_eq!(found, Err(SplitError::Stopped(Stopped)), "{strategy:?}");
    }
    assert!(matches!(bake(&soup, BakeOptions::default(), &work), Err(BakeError::Stopped(_))));
}

/// What loops have cut short is never taken for a result, wherever they were.
#[test]
fn a_split_is_whole_or_not_at_all() {
    let soup = splinters(400);
    for strategy in [Strategy::Bsp, Strategy::Plan] {
        let options = by(strategy, 1 << 30);
        let whole = split(&soup, &options).unwrap();
        let (mut stops, mut after) = (0, Duration::from_micros(500));
        loop {
            let stop = AtomicBool::new(false);
            let found = std::thread::scope(|threads| {
                threads.spawn(|| {
                    std::thread::sleep(after);
                    stop.store(true, Relaxed);
                });
                find_cells(&soup, &options, &Job::new(&|_, _| ()).until(&stop))
            });
            match found {
                Err(error) => assert_eq!(error, SplitError::Stopped(Stopped)),
                Ok(graph) => {
                    assert!(graph == whole, "{strategy:?}: another graph after {after:?}");
                    break;
                }
            }
            (stops, after) = (stops + 1, after * 3 / 2);
        }
        assert!(stops > 2, "{strategy:?}: stopped {stops} times");
    }
}
