//! Where is a point: against looking at every piece of every cell of buildings that were split.

use crate::cli::building;
use enfilade::CellId;
use enfilade::cells::{CellGraph, Locator, SplitOptions, Strategy, split};
use enfilade::math::geom::{Aabb, middle};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use glam::DVec3;
use proptest::prelude::*;
use std::sync::OnceLock;

/// The villa and the gallery, split by their walls.
fn buildings() -> &'static [(Scene, CellGraph)] {
    static BUILDINGS: OnceLock<Vec<(Scene, CellGraph)>> = OnceLock::new();
    BUILDINGS.get_or_init(|| {
        let split_one = |name: &str| {
            let scene = import(&building(name).with_extension("glb"), &ImportOptions::default()).unwrap();
            let graph = split(&scene, &SplitOptions { strategy: Some(Strategy::Plan), ..SplitOptions::default() }).unwrap();
            (scene, graph)
        };
        ["villa_rotonda", "gallery100"].map(split_one).into()
    })
}

/// How far a point is outside a piece, metres; 0 inside. By its planes and by its box: a piece as thin as a blade ends where its box
/// does, and its planes go on.
fn off(graph: &CellGraph, (cell, piece): (CellId, usize), p: DVec3) -> f64 {
    let piece = &graph.cells[cell.index()].pieces[piece];
    let far = piece.bounds.gap(&Aabb { min: p, max: p });
    let off = piece.planes.iter().map(|plane| plane.distance(p)).fold(0.0, f64::max);
    if far > Locator::SLACK * graph.smallest_hole { far.max(off) } else { off }
}

/// What looking at every piece says: the least distance to one.
fn least_off(graph: &CellGraph, p: DVec3) -> f64 {
    let pieces = (0..graph.cells.len()).flat_map(|c| (0..graph.cells[c].pieces.len()).map(move |i| (CellId(c as u32), i)));
    pieces.map(|at| off(graph, at, p)).fold(f64::INFINITY, f64::min)
}

/// The answer fits the definition.
fn right(graph: &CellGraph, locator: &Locator<'_>, p: DVec3) -> Result<(), TestCaseError> {
    let (slack, rounding) = (Locator::SLACK * graph.smallest_hole, 1e-12 * (1.0 + p.abs().max_element()));
    let least = least_off(graph, p);
    match locator.locate(p) {
        Some(at) => prop_assert!(off(graph, at, p) <= least + rounding, "{at:?} is not the nearest to {p}"),
        None => prop_assert!(least > slack - rounding, "{p} is {least} m from a piece"),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    #[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
    fn as_looking_at_every_piece_says(
        which in 0..2usize, kind in 0..5usize, a in any::<prop::sample::Index>(), b in any::<prop::sample::Index>(),
        t in 0.0..=1.0f64, u in [-0.2..1.2f64, -0.2..1.2, -0.2..1.2],
    ) {
        let (scene, graph) = &buildings()[which];
        let locator = Locator::new(graph);
        let bounds = scene.bounds();
        let portal = &graph.portals[a.index(graph.portals.len())];
        let corner = portal.winding[b.index(portal.winding.len())];
        let cell = CellId(b.index(graph.cells.len()) as u32);
        let piece = &graph.cells[cell.index()].pieces[a.index(graph.cells[cell.index()].pieces.len())];
        let p = match kind {
            // Anywhere, also around the building; on a portal, its edges and its corners.
            0 => bounds.min + bounds.size() * DVec3::from_array(u),
            1 => middle(&portal.winding).lerp(corner, t),
            2 => corner,
            // A corner of a piece's box, and a point on one of its planes.
            3 => piece.bounds.min.clamp(bounds.min, bounds.max),
            _ => {
                let p = bounds.min + bounds.size() * DVec3::from_array(u);
                let plane = piece.planes[b.index(piece.planes.len())];
                p - plane.n * plane.distance(p)
            }
        };
        right(graph, &locator, p)?;
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn a_portals_middle_is_in_one_of_its_two_cells() {
    for (_, graph) in buildings() {
        let locator = Locator::new(graph);
        let mut inside = 0;
        for portal in &graph.portals {
            let p = middle(&portal.winding);
            if let Some((cell, _)) = locator.locate(p) {
                assert!(portal.cells.contains(&cell), "{cell} at {p} of {:?}", portal.cells);
                inside += 1;
            }
        }
        assert!(inside * 100 >= graph.portals.len() * 95, "{inside} of {}", graph.portals.len());
    }
}

#[test]
fn what_is_no_point_is_in_no_cell_and_what_is_far_is_outside() {
    for (_, graph) in buildings() {
        let locator = Locator::new(graph);
        for p in [DVec3::NAN, DVec3::INFINITY, DVec3::new(0.0, f64::NEG_INFINITY, 1.0), DVec3::new(f64::NAN, 0.0, 0.0)] {
            assert_eq!(locator.locate(p), None);
        }
        for p in [DVec3::new(1e9, 3.0, 0.0), DVec3::splat(-1e15), DVec3::new(0.0, 1e300, 0.0)] {
            let (cell, _) = locator.locate(p).expect("the outside goes on");
            assert!(graph.cells[cell.index()].open);
        }
    }
}
