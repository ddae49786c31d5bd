//! The leaves of a level's own BSP tree as cells: convex and exact, without a split.

use super::complex::coverage::open_pieces;
use super::opaque::Opaque;
use super::{Cell, CellGraph, Piece, Portal, PortalKind, PortalState, Strategy};
use crate::CellId;
use crate::math::geom::{Aabb, Plane, area, newell};
use crate::math::parallel;
use crate::math::polyhedron::faces;
use crate::math::tolerance::Tolerance;
use crate::scene::{Leaves, Scene};
use crate::types::level::LevelPortal;
use crate::types::note::Note;
use glam::{DVec2, DVec3};

/// Margin around the level, metres: a leaf that reaches its end is unbounded.
const MARGIN: f64 = 1.0;

/// Further margin, metres, plus the level's diagonal, in which unbounded leaves stay disjoint. Smaller: eyes beside a level are in two
/// pieces at once. Larger: planes that separate nothing but air.
const FAR: f64 = 10.0;

/// A graph of leaves. Unbounded leaves are one open cell: the outside of a level that leaks.
pub(super) fn leaves(scene: &Scene, found: &Leaves, reason: String) -> CellGraph {
    // Walls without triangles may reach beyond the drawn geometry.
    let walls = Aabb::of(found.walls.iter().flatten().copied());
    let within = scene.bounds().union(walls).inflated(MARGIN);
    let beyond = within.inflated(FAR + within.diagonal());
    let eps = scene.tolerance().coplanar;
    // 1. The bounding planes of each leaf, and whether it is bounded.
    let bounded = parallel::map(&found.leaves, |planes| {
        // The face of a plane that only touches the leaf has no area.
        let bounds = |face: &Vec<DVec3>| !face.is_empty() && area(face) > eps * eps;
        let near = faces(planes, &within);
        // Leaves far from the level are outside, too. Two unbounded leaves may be separated only there.
        let is_endless = near[planes.len()..].iter().any(bounds) || !near.iter().any(bounds);
        let faces = if is_endless { faces(planes, &beyond) } else { near };
        let mut bounding: Vec<Plane> = Vec::new();
        for (plane, face) in planes.iter().zip(&faces) {
            // A tree may split along one plane more than once.
            if bounds(face) && !bounding.contains(plane) {
                bounding.push(*plane);
            }
        }
        let is_there = !planes.is_empty() && faces.iter().any(bounds);
        let piece = if is_there { Piece::new(bounding, eps) } else { None };
        (piece, is_endless)
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
        let what = format!("the level leaks: its {} unbounded leaves are one open cell", outside.len());
        notes.push(Note::fault(what));
        cells[0].pieces = outside;
    }

    // 3. Portals.
    let portal = |(i, p)| portal(i, p, &cell_of, found, eps);
    let portals = found.portals.iter().enumerate().filter_map(portal).collect();

    // 4. Undrawn walls: solid in the tree, but without triangles.
    let (opaque, tolerance) = (Opaque::new(scene), scene.tolerance());
    let bare = parallel::map(&found.walls, |wall| bare_parts(wall, &opaque, &tolerance));
    let bare_walls = bare.iter().filter(|parts| !parts.is_empty()).count();
    if bare_walls > 0 {
        notes.push(Note::taken(format!("{bare_walls} walls are not drawn, in part or whole; they count as opaque")));
    }
    let (smallest_hole, closed_holes) = (tolerance.smallest_hole(), bare.into_iter().flatten().collect());
    CellGraph { strategy: Strategy::Leaves, reason, cells, portals, smallest_hole, closed_holes, notes }
}

/// A winding without corners within `eps` metres of the previous one: in the `f32` of a file, the edge between them would have a random
/// direction.
fn apart(winding: &[DVec3], eps: f64) -> Vec<DVec3> {
    let mut kept: Vec<DVec3> = Vec::with_capacity(winding.len());
    for &p in winding {
        if kept.last().is_none_or(|last| last.distance(p) > eps) && kept.first().is_none_or(|first| first.distance(p) > eps)
        {
            kept.push(p);
        }
    }
    kept
}

/// The parts of a wall without opaque triangles that face its leaf, as convex polygons.
fn bare_parts(wall: &[DVec3], opaque: &Opaque, tolerance: &Tolerance) -> Vec<Vec<DVec3>> {
    let n = newell(wall).normalize();
    let plane = Plane::through(wall[0], n);
    let (u, v) = (n.any_orthonormal_vector(), n.cross(n.any_orthonormal_vector()));
    let flat = |p: DVec3| DVec2::new((p - wall[0]).dot(u), (p - wall[0]).dot(v));
    // Vertices of levels are rounded, too. What faces the other way is the far wall of a narrow gap.
    let lies_on =
        |t: &[DVec3; 3]| newell(t).dot(n) > 0.0 && t.iter().all(|&p| plane.distance(p).abs() <= tolerance.clearance);
    let bounds = Aabb::of(wall.iter().copied()).inflated(tolerance.clearance);
    let drawn: Vec<[DVec2; 3]> = opaque.in_box(&bounds).into_iter().filter(lies_on).map(|t| t.map(flat)).collect();
    let face: Vec<DVec2> = wall.iter().map(|&p| flat(p)).collect();
    let solid = |part: Vec<DVec2>| part.into_iter().map(|p| wall[0] + u * p.x + v * p.y).collect();
    open_pieces(&face, &drawn, tolerance.smallest_hole()).into_iter().map(solid).collect()
}

/// Portal `i` of a level, if it joins two cells; `eps` in metres.
fn portal(i: usize, p: &LevelPortal, cell_of: &[Option<CellId>], found: &Leaves, eps: f64) -> Option<Portal> {
    let [a, b] = p.cells.map(|leaf| cell_of[leaf as usize]);
    let (a, b) = a.zip(b).filter(|(a, b)| a != b)?;
    let plane = Plane::through(p.winding[0], newell(&p.winding).normalize());
    let winding = apart(&p.winding, eps);
    let shutter = found.shutters.binary_search_by_key(&(i as u32), |(portal, _)| *portal).ok();
    let source = shutter.map(|shutter| found.shutters[shutter].1.clone());
    let kind = if source.is_some() { PortalKind::Door } else { PortalKind::Opening };
    (winding.len() >= 3).then_some(Portal { cells: [a, b], plane, winding, kind, state: PortalState::default(), source })
}
