//! What is known about a scene, against what the plan strategy finds.

use enfilade::CellId;
use enfilade::cells::{CellGraph, Locator, SplitOptions, Strategy, split};
use enfilade::math::geom::Plane;
use enfilade::scene::Scene;
use enfilade::scene::rays::RayScene;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use testing::sound::assert_sealed;

/// What is open is called so.
pub const OPEN: [&str; 3] = ["outside", "west court", "east court"];

/// What is known about a scene.
#[derive(Default)]
pub struct Known {
    /// Every cell by a name, with points in it.
    pub cells: Vec<(&'static str, Vec<DVec3>)>,
    /// Lines of sight from one cell straight into another, through a portal between the two; no other two are joined.
    pub sights: Vec<(&'static str, &'static str, [DVec3; 2])>,
    /// Lines of sight that stay in one cell.
    pub within: Vec<[DVec3; 2]>,
}

fn plan(scene: &Scene) -> CellGraph {
    split(scene, &SplitOptions { strategy: Some(Strategy::Plan), ..SplitOptions::default() }).unwrap()
}

fn inside(winding: &[DVec3], normal: DVec3, p: DVec3) -> bool {
    let edges = winding.iter().zip(winding.iter().cycle().skip(1));
    edges.into_iter().all(|(&a, &b)| normal.cross(b - a).normalize_or_zero().dot(p - a) >= -1e-6)
}

/// True where the segment goes through a portal between the two cells.
fn goes_through(graph: &CellGraph, a: CellId, b: CellId, [from, to]: [DVec3; 2]) -> bool {
    let between = graph.portals.iter().filter(|p| p.cells == [a, b] || p.cells == [b, a]);
    let crosses = |plane: &Plane| {
        let (s, t) = (plane.distance(from), plane.distance(to));
        (s * t < 0.0).then(|| from.lerp(to, s / (s - t)))
    };
    between.into_iter().any(|p| crosses(&p.plane).is_some_and(|at| inside(&p.winding, p.plane.n, at)))
}

/// Everything that is known holds, and the graph is sound. Returns the graph and the cells by name.
pub fn assert_known(scene: &Scene, known: &Known) -> (CellGraph, BTreeMap<&'static str, CellId>) {
    let graph = plan(scene);
    let locator = Locator::new(&graph);
    let mut of: BTreeMap<&str, CellId> = BTreeMap::new();
    for (name, points) in &known.cells {
        for &p in points {
            let Some((cell, _)) = locator.locate(p - scene.origin) else { panic!("{name}: {p} is in no cell") };
            let first = *of.entry(name).or_insert(cell);
            assert_eq!(cell, first, "{name}: {p} and {} are in two cells: {}", points[0], told(&graph, scene));
        }
    }
    let different: BTreeSet<CellId> = of.values().copied().collect();
    assert_eq!(different.len(), of.len(), "some are one: {of:?}, {}", told(&graph, scene));
    assert_eq!(graph.cells.len(), of.len(), "cells: {of:?}, {}", told(&graph, scene));
    for (name, cell) in &of {
        assert_eq!(graph.cells[cell.index()].open, OPEN.contains(name), "{name}: {}", told(&graph, scene));
    }
    let pair = |a: CellId, b: CellId| if a < b { [a, b] } else { [b, a] };
    let joined: BTreeSet<[CellId; 2]> = graph.portals.iter().map(|p| pair(p.cells[0], p.cells[1])).collect();
    let expected: BTreeSet<[CellId; 2]> = known.sights.iter().map(|(a, b, _)| pair(of[a], of[b])).collect();
    assert_eq!(joined, expected, "joined: {of:?}, {}", told(&graph, scene));
    let rays = RayScene::new(scene);
    let free = |[from, to]: [DVec3; 2]| rays.first_opaque(from, (to - from).normalize(), from.distance(to)).is_none();
    for &(a, b, line) in &known.sights {
        let line = line.map(|p| p - scene.origin);
        assert!(free(line), "{a} to {b}: something stands in the way");
        assert_eq!([0, 1].map(|k| locator.locate(line[k]).map(|f| f.0)), [Some(of[a]), Some(of[b])], "{a} to {b}");
        assert!(goes_through(&graph, of[a], of[b], line), "{a} to {b}: through no portal: {}", told(&graph, scene));
    }
    for line in &known.within {
        let line = line.map(|p| p - scene.origin);
        assert!(free(line), "something stands in the way");
        let found: BTreeSet<Option<CellId>> =
            (0..=100).map(|k| locator.locate(line[0].lerp(line[1], f64::from(k) / 100.0)).map(|f| f.0)).collect();
        assert_eq!(found.len(), 1, "{line:?} goes through {found:?}: {}", told(&graph, scene));
    }
    assert_sealed(&graph, scene, 1.0, 100_000);
    (graph, of)
}

/// Cells by volume and middle of their largest piece, portals by place and size, for messages.
fn told(graph: &CellGraph, scene: &Scene) -> String {
    let cell = |(i, c): (usize, &enfilade::cells::Cell)| {
        let size = |p: &enfilade::cells::Piece| p.bounds.size().element_product();
        let bounded = c.pieces.iter().filter(|p| size(p).is_finite());
        let largest = bounded.max_by(|a, b| size(a).total_cmp(&size(b))).map(|p| p.bounds.centre() + scene.origin);
        format!("\n  cell {i} {} of {} pieces around {largest:.2?}", if c.open { "open" } else { "closed" }, c.pieces.len())
    };
    let portal = |p: &enfilade::cells::Portal| {
        let at = enfilade::math::geom::middle(&p.winding) + scene.origin;
        format!(
            "\n  portal {:?} {:?} {:.2} m2 at {at:.2}",
            p.cells.map(|c| c.0),
            p.kind,
            enfilade::math::geom::area(&p.winding)
        )
    };
    let cells: String = graph.cells.iter().enumerate().map(cell).collect();
    cells + &graph.portals.iter().map(portal).collect::<String>()
}
