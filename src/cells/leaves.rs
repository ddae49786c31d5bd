//! The leaves of a level's own tree as cells: convex and exact, nothing is split.

use super::polyhedron::faces;
use super::{Cell, CellGraph, Piece, Portal, PortalKind, PortalState, Strategy};
use crate::CellId;
use crate::geom::{Plane, area, newell};
use crate::parallel;
use crate::scene::{Leaves, Scene};
use crate::types::level::LevelPortal;
use glam::DVec3;

/// Space around the level, metres, in which leaves are looked at: one that reaches its end goes on without end.
const MARGIN: f64 = 1.0;

/// A graph of leaves. Those that go on without end are one open cell: the outside of a level that leaks.
pub(super) fn leaves(scene: &Scene, found: &Leaves, reason: String) -> CellGraph {
    let within = scene.bounds().inflated(MARGIN);
    let eps = scene.tolerance().coplanar;
    // 1. The planes that bound each leaf, and whether they bound it on all sides.
    let bounded = parallel::map(&found.leaves, |planes| {
        let faces = faces(planes, &within);
        // A plane that only touches the leaf has a face without area.
        let bounds = |face: &Vec<DVec3>| !face.is_empty() && area(face) > eps * eps;
        let mut bounding: Vec<Plane> = Vec::new();
        for (plane, face) in planes.iter().zip(&faces) {
            // Trees cut along one plane more than once.
            if bounds(face) && !bounding.contains(plane) {
                bounding.push(*plane);
            }
        }
        let piece = if planes.is_empty() { None } else { Piece::new(bounding, eps) };
        (piece, faces[planes.len()..].iter().any(bounds))
    });

    // 2. Cells, in the leaves' order; the outside is the first of them.
    let (mut cells, mut cell_of, mut outside) = (Vec::new(), Vec::new(), Vec::new());
    if bounded.iter().any(|(piece, endless)| piece.is_some() && *endless) {
        cells.push(Cell { name: "outside".into(), open: true, ..Cell::default() });
    }
    for (i, (piece, endless)) in bounded.into_iter().enumerate() {
        cell_of.push(piece.as_ref().map(|_| CellId(if endless { 0 } else { cells.len() as u32 })));
        match piece {
            Some(piece) if endless => outside.push(piece),
            Some(piece) => cells.push(Cell { name: format!("leaf {}", i + 1), pieces: vec![piece], ..Cell::default() }),
            None => {}
        }
    }
    let mut notes = Vec::new();
    if !outside.is_empty() {
        notes.push(format!("the level leaks: {} leaves go on without end, and are one open cell", outside.len()));
        cells[0].pieces = outside;
    }

    // 3. Portals.
    let portal = |p: &LevelPortal| {
        let [a, b] = p.cells.map(|leaf| cell_of[leaf as usize]);
        let (a, b) = a.zip(b).filter(|(a, b)| a != b)?;
        let plane = Plane::through(p.winding[0], newell(&p.winding).normalize());
        let (kind, state) = (PortalKind::Opening, PortalState::default());
        Some(Portal { cells: [a, b], plane, winding: p.winding.clone(), kind, state, source: None })
    };
    let portals = found.portals.iter().filter_map(portal).collect();
    let (smallest_hole, closed_holes) = (scene.tolerance().smallest_hole(), found.walls.clone());
    CellGraph { strategy: Strategy::Leaves, reason, cells, portals, smallest_hole, closed_holes, notes }
}
