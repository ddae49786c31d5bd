//! Back-face culling: pairs that are hidden because the cell is behind all visible parts of the object.
//!
//! Based on: back-face culling from a region, as in Kumar, Manocha, Garrett, Lin, *Hierarchical back-face computation*, 1996; but the front
//! of a triangle does not follow from its winding, which is unreliable in models. A triangle in a plane that bounds a convex piece of a
//! cell has the whole piece on one side. So a line that ends on it in that piece comes from an eye on that side, through portals that
//! extend to that side.
//!
//! Flow cannot decide this: it tests the box of an object, and half of such a box may be behind a wall.

use super::sampling::witness::PLACEMENT_MARGIN;
use crate::cells::{CellGraph, Locator, Piece};
use crate::math::geom::{Aabb, Plane, clip, width};
use crate::math::tolerance::Tolerance;
use crate::math::{bits, parallel};
use crate::scene::Scene;
use crate::{BitMatrix, CellId, ObjectId};
use glam::DVec3;

/// Most planes of an object; with more, it counts as visible from everywhere. Larger: time for round objects. Smaller: objects with many
/// faces in one cell are never proven hidden.
const MOST_PLANES: usize = 16;

/// The part of a triangle in a piece is only its rim if it is no wider than this, in margins, and no deeper in than the clearance: the rest
/// is in another piece. Larger: a triangle slightly inclined out of a piece counts as a rim. Smaller: rounding of a rim counts as a
/// triangle.
const RIM: f64 = 4.0;

/// The region from which an object's part in a cell is visible.
#[derive(Clone, PartialEq, Debug)]
enum Front {
    /// Possibly everywhere.
    Unknown,
    /// Inside at least one of these planes.
    Inside(Vec<Plane>),
}

/// For each object, its cells, ascending, each with the front of its part.
pub struct Fronts {
    of_object: Vec<Vec<(u32, Front)>>,
    /// Corners at least this far inside a plane are in front of it, metres: see [`Tolerance::coplanar`].
    coplanar: f64,
}

impl Fronts {
    /// Computes the fronts of all objects from their triangles.
    pub fn new(scene: &Scene, graph: &CellGraph) -> Self {
        let (locator, tolerance) = (Locator::new(graph), scene.tolerance());
        let margin = PLACEMENT_MARGIN * tolerance.clearance;
        let of_object = parallel::map(&scene.objects, |object| {
            let mut fronts: Vec<(u32, Front)> = Vec::new();
            if let Some(reach) = object.reach {
                // A moving object's triangles may face any direction.
                locator.pieces_in_box(&reach.inflated(margin), |cell, _| fronts.push((cell.0, Front::Unknown)));
                fronts.sort_unstable_by_key(|&(cell, _)| cell);
                fronts.dedup_by_key(|(cell, _)| *cell);
                return fronts;
            }
            for triangle in object.triangles.clone() {
                let corners = scene.corners(triangle as usize);
                let (mut parts, mut rims) = (Vec::new(), Vec::new());
                locator.pieces_in_box(&Aabb::of(corners).inflated(margin), |cell, piece| {
                    let piece = &graph.cells[cell.index()].pieces[piece];
                    let is_outside = |plane: &Plane| corners.iter().all(|&p| plane.distance(p) > margin);
                    if piece.planes.iter().any(is_outside) {
                        return;
                    }
                    let Some(front) = front(&corners, piece, margin) else { return };
                    let is_rim = is_rim(&corners, piece, margin, &tolerance);
                    if is_rim { &mut rims } else { &mut parts }.push((cell.0, front));
                });
                // A triangle with only rims is itself that small.
                for (cell, found) in if parts.is_empty() { rims } else { parts } {
                    match fronts.iter_mut().find(|(c, _)| *c == cell) {
                        Some((_, front)) => front.join(found),
                        None => fronts.push((cell, found)),
                    }
                }
            }
            fronts.sort_unstable_by_key(|&(cell, _)| cell);
            fronts
        });
        Self { of_object, coplanar: tolerance.coplanar }
    }

    /// Removes the pairs that satisfy [`Self::is_behind`] from `objects_upper`. Pairs of `known` stay.
    pub fn hide(&self, graph: &CellGraph, known: &BitMatrix, cells_upper: &BitMatrix, objects_upper: &mut BitMatrix) {
        let rows = parallel::map_range(0..graph.cells.len(), |cell| {
            let (upper, known) = (objects_upper.row(cell), known.row(cell));
            let mut row: Vec<u64> = upper.iter().zip(known).map(|(upper, known)| upper & !known).collect();
            self.keep_shown(graph, cells_upper, cell, &mut row);
            row.iter_mut().zip(upper.iter().zip(known)).for_each(|(row, (upper, known))| *row |= upper & known);
            row
        });
        rows.iter().enumerate().for_each(|(cell, row)| objects_upper.assign_row(cell, row));
    }

    /// Removes from a row of objects, as bits, those that `cell` is behind.
    pub fn keep_shown(&self, graph: &CellGraph, cells_upper: &BitMatrix, cell: usize, row: &mut [u64]) {
        let exits = exits(graph, cell);
        let is_behind = |&object: &usize| !self.shows(cells_upper, cell, object, &exits);
        let hidden: Vec<usize> = bits::ones(row).filter(is_behind).collect();
        hidden.into_iter().for_each(|object| row[object / 64] &= !(1 << (object % 64)));
    }

    /// True if a cell is behind all visible parts of an object; `cells_upper`: pairs of cells that may see each other.
    pub fn is_behind(&self, graph: &CellGraph, cells_upper: &BitMatrix, cell: CellId, object: ObjectId) -> bool {
        !self.shows(cells_upper, cell.index(), object.index(), &exits(graph, cell.index()))
    }

    /// True if an eye in `from` may see the object: in its own cell, or through one of `exits` in another.
    fn shows(&self, cells_upper: &BitMatrix, from: usize, object: usize, exits: &[DVec3]) -> bool {
        let is_before = |plane: &Plane| exits.iter().any(|&p| plane.distance(p) < -self.coplanar);
        self.of_object[object].iter().any(|(cell, front)| match front {
            _ if *cell as usize == from => true,
            _ if !cells_upper.get(from, *cell as usize) => false,
            Front::Unknown => true,
            Front::Inside(planes) => planes.iter().any(is_before),
        })
    }
}

impl Front {
    fn join(&mut self, other: Self) {
        match (&mut *self, other) {
            (Self::Inside(planes), Self::Inside(more)) if planes.len() <= MOST_PLANES => {
                more.into_iter().for_each(|plane| {
                    if !planes.contains(&plane) {
                        planes.push(plane)
                    }
                });
            }
            _ => *self = Self::Unknown,
        }
    }
}

/// The corners of the portals of a cell.
fn exits(graph: &CellGraph, cell: usize) -> Vec<DVec3> {
    let portals = graph.cells[cell].portals.iter();
    portals.flat_map(|p| graph.portals[p.portal().index()].winding.iter().copied()).collect()
}

/// The front of a triangle's part in a piece; `None` if the piece has no part of it.
fn front(corners: &[DVec3; 3], piece: &Piece, margin: f64) -> Option<Front> {
    if cut(corners, &piece.planes, margin).is_empty() {
        return None;
    }
    let own: Vec<Plane> = piece.planes.iter().filter(|plane| lies_in(corners, plane, margin)).copied().collect();
    Some(if own.is_empty() { Front::Unknown } else { Front::Inside(own) })
}

/// Whether a piece contains only a rim of a triangle.
fn is_rim(corners: &[DVec3; 3], piece: &Piece, margin: f64, tolerance: &Tolerance) -> bool {
    let others: Vec<Plane> = piece.planes.iter().filter(|plane| !lies_in(corners, plane, margin)).copied().collect();
    let part = cut(corners, &piece.planes, margin);
    width(&part) <= RIM * margin && cut(corners, &others, -tolerance.clearance).is_empty()
}

/// Whether a triangle lies in a plane.
fn lies_in(corners: &[DVec3; 3], plane: &Plane, margin: f64) -> bool {
    corners.iter().all(|&p| plane.distance(p).abs() <= margin)
}

/// The part of a triangle inside planes, each moved out by a distance, metres.
fn cut(corners: &[DVec3; 3], planes: &[Plane], by: f64) -> Vec<DVec3> {
    // Most planes have all of it inside.
    let cuts = planes.iter().filter(|plane| corners.iter().any(|&p| plane.distance(p) > by));
    let moved = cuts.map(|plane| Plane { d: plane.d + by, ..*plane });
    moved.fold(corners.to_vec(), |polygon, plane| clip(&polygon, &plane, 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::Cell;
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};

    /// A hall of 100 m with a triangle on its floor, in the corner of two walls, entirely within the clearance of both.
    #[test]
    fn a_triangle_that_is_no_more_than_a_rim_is_seen_all_the_same() {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let mut add = |node: &str, corners: [[f64; 3]; 3]| {
            let positions = corners.map(DVec3::from).to_vec();
            let (node, triangles) = (node.to_owned(), vec![[0, 1, 2]]);
            builder.add(Mesh { node, role: Role::Structure, opaque: true, positions, triangles }).expect("a triangle");
        };
        add("wall", [[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [0.0, 100.0, 0.0]]);
        add("floor", [[0.0, 0.0, 0.0], [100.0, 0.0, 100.0], [100.0, 0.0, 0.0]]);
        let narrow = 0.9 * Tolerance::for_extent(170.0).clearance;
        add("in the corner", [[0.0, 0.0, 0.0], [0.0, 0.0, narrow], [0.05, 0.0, 0.0]]);
        let scene = builder.finish("hall").expect("a scene");
        let bounds = scene.bounds();
        let planes = DVec3::AXES.iter().flat_map(|&n| [Plane::through(bounds.max, n), Plane::through(bounds.min, -n)]);
        let piece = Piece::new(planes.collect(), 1e-6).expect("a box");
        let graph = CellGraph::given(vec![Cell { pieces: vec![piece], ..Cell::default() }], Vec::new());
        let fronts = Fronts::new(&scene, &graph);
        for (object, found) in scene.objects.iter().zip(&fronts.of_object) {
            assert!(matches!(found.as_slice(), [(0, Front::Inside(_))]), "{}: {found:?}", object.node);
        }
    }
}
