//! Cells joined for lack of memory.

use enfilade::CellId;
use enfilade::cells::{CellGraph, Portal, PortalKind, coarsen, flow_bytes, matrix_bytes};
use glam::DVec3;
use testing::rooms::{box_piece, graph, portal};

/// Rooms of 1 m in a row along x; every door is larger than the one before it.
fn row(n: usize) -> CellGraph {
    let pieces = (0..n).map(|i| i as f64).map(|x| vec![box_piece([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0], DVec3::ZERO)]);
    let door = |i: usize| {
        let (x, side) = (i as f64 + 1.0, 0.5 + 0.4 * i as f64 / n as f64);
        let cells = [i as u32, i as u32 + 1];
        Portal { kind: PortalKind::Door, ..portal(cells, 0, [x, 0.0, 0.0], [x, side, side], DVec3::ZERO) }
    };
    graph(pieces.collect(), (0..n - 1).map(door).collect())
}

#[test]
fn what_fits_stays_as_it_is() {
    let mut graph = row(10);
    let before = graph.clone();
    assert_eq!(coarsen(&mut graph, 5, matrix_bytes(10, 5, 9), |_| None), None);
    assert_eq!(graph, before);
    // Nor is anything joined where flow has a way to take less.
    let needed = matrix_bytes(10, 5, 9);
    let less = needed - flow_bytes(10, 9) / 2;
    assert_eq!(coarsen(&mut graph, 5, less, |_| Some(flow_bytes(10, 9) / 2)), None);
    assert_eq!(graph, before);
    assert_eq!(coarsen(&mut graph, 5, less, |_| Some(flow_bytes(10, 9))), Some(10));
}

#[test]
fn a_row_becomes_neighbours_of_equal_size_joined_by_the_doors_between_them() {
    let mut graph = row(1000);
    let limit = matrix_bytes(1000, 50, 999) / 10;
    assert_eq!(coarsen(&mut graph, 50, limit, |_| None), Some(1000));
    assert!(matrix_bytes(graph.cells.len(), 50, graph.portals.len()) <= limit);
    assert_eq!(graph.portals.len(), graph.cells.len() - 1);
    assert_eq!(graph.cells.iter().map(|c| c.pieces.len()).sum::<usize>(), 1000);
    let sizes: Vec<usize> = graph.cells.iter().map(|c| c.pieces.len()).collect();
    assert!(sizes.iter().max().unwrap() <= &4 && graph.cells.len() >= 250, "{sizes:?}");
    for portal in &graph.portals {
        let x = portal.winding[0].x;
        let touches =
            |c: CellId| graph.cells[c.index()].pieces.iter().any(|p| (p.bounds.min.x..=p.bounds.max.x).contains(&x));
        assert!(portal.cells.iter().all(|&c| touches(c)), "at {x}");
    }
    assert!(graph.notes[0].starts_with("memory: 1000 cells joined to "), "{:?}", graph.notes);
}

#[test]
fn open_cells_stay_apart_and_cells_without_portals_are_joined_too() {
    let mut graph = row(64);
    graph.cells[20].open = true;
    graph.portals.retain(|p| p.cells[0].index() < 30);
    graph.link();
    assert_eq!(coarsen(&mut graph, 0, 0, |_| None), Some(64));
    assert_eq!(graph.cells.iter().filter(|c| c.open).map(|c| c.pieces.len()).collect::<Vec<_>>(), [1]);
    assert!(graph.cells.len() <= 4, "{}", graph.cells.len());
}
