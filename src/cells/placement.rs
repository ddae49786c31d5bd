//! The cells that each object touches, and its part in each of them.
//!
//! Based on: Sutherland, Hodgman, *Reentrant polygon clipping*, 1974: a triangle touches a piece if clipping to all planes of the piece
//! leaves something. Planes are first moved out by the margin.

use super::{CellGraph, Locator, Piece};
use crate::BitMatrix;
use crate::math::geom::Aabb;
use crate::math::parallel;
use crate::scene::Scene;
use crate::types::placed::PlacedBox;
use glam::DVec3;

/// The objects in each cell.
#[derive(Clone, PartialEq, Debug)]
pub struct Placement {
    /// Cells x objects.
    pub matrix: BitMatrix,
    /// Box of each object's part in each of its cells, by cell, then object; `None` if these boxes hardly differ from the intersections of
    /// objects' boxes and cells' boxes.
    pub boxes: Option<Vec<PlacedBox>>,
}

/// Boxes of parts are kept if their total surface is below this share of that of the box intersections. Larger: six bytes per pair without
/// a benefit. Smaller: useful boxes are discarded.
const WORTH: f64 = 0.9;

/// Places each object in the cells with a piece within `margin` metres of one of its triangles. Conservative: it never misses a cell.
/// Triangles are clipped to the pieces, so overlapping boxes alone do not count.
pub fn place_objects(scene: &Scene, graph: &CellGraph, margin: f64) -> Placement {
    let locator = Locator::new(graph);
    let rows: Vec<Vec<(u32, Aabb)>> = parallel::map_init(scene.objects.len(), Clipper::default, |clipper, object| {
        let object = &scene.objects[object];
        if let Some(reach) = object.reach {
            return reached(&locator, graph, reach, margin);
        }
        let mut cells: Vec<(u32, Aabb)> = Vec::new();
        let mut candidates = Vec::new();
        locator.pieces_in_box(&object.bounds.inflated(margin), |cell, piece| candidates.push((cell.0, piece as u32)));
        // Triangles share the object's candidate pieces, unless there are many: then each triangle queries the tree.
        let share = candidates.len() <= 64;
        for triangle in object.triangles.clone() {
            let corners = scene.corners(triangle as usize);
            let bounds = Aabb::of(corners).inflated(margin);
            let mut touch = |cell: u32, piece: u32| {
                let piece = &graph.cells[cell as usize].pieces[piece as usize];
                let part = if piece.bounds.touches(&bounds) { clipper.part(&corners, piece, margin) } else { None };
                if let Some(part) = part {
                    match cells.iter_mut().find(|(c, _)| *c == cell) {
                        Some((_, whole)) => *whole = whole.union(part),
                        None => cells.push((cell, part)),
                    }
                }
            };
            if share {
                candidates.iter().for_each(|&(cell, piece)| touch(cell, piece));
            } else {
                locator.pieces_in_box(&bounds, |cell, piece| touch(cell.0, piece as u32));
            }
        }
        cells
    });
    let mut matrix = BitMatrix::new(graph.cells.len(), scene.objects.len());
    let mut of_cell: Vec<Vec<PlacedBox>> = vec![Vec::new(); graph.cells.len()];
    let (mut all, mut kept) = (0.0, 0.0);
    for (object, cells) in rows.iter().enumerate() {
        let bounds = scene.objects[object].extent();
        for &(cell, part) in cells {
            matrix.set(cell as usize, object);
            let placed = PlacedBox::of(part.inflated(0.25 * margin), bounds);
            let around =
                graph.cells[cell as usize].pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.bounds)).inflated(margin);
            all += half_surface(cut(bounds, around));
            kept += half_surface(cut(placed.of_box(bounds), around));
            of_cell[cell as usize].push(placed);
        }
    }
    Placement { matrix, boxes: (kept < WORTH * all).then(|| of_cell.concat()) }
}

/// The cells within `margin` of a box, each with the part of the box that may be there.
fn reached(locator: &Locator<'_>, graph: &CellGraph, reach: Aabb, margin: f64) -> Vec<(u32, Aabb)> {
    let mut cells: Vec<(u32, Aabb)> = Vec::new();
    let (middle, half) = (reach.centre(), reach.size() * 0.5);
    locator.pieces_in_box(&reach.inflated(margin), |cell, piece| {
        let piece = &graph.cells[cell.index()].pieces[piece];
        if piece.planes.iter().any(|plane| plane.distance(middle) - plane.n.abs().dot(half) > margin) {
            return;
        }
        let part = cut(reach, piece.bounds.inflated(margin));
        match cells.iter_mut().find(|(c, _)| *c == cell.0) {
            Some((_, whole)) => *whole = whole.union(part),
            None => cells.push((cell.0, part)),
        }
    });
    cells
}

fn cut(a: Aabb, b: Aabb) -> Aabb {
    Aabb { min: a.min.max(b.min), max: a.max.min(b.max) }
}

fn half_surface(b: Aabb) -> f64 {
    let size = b.size().max(DVec3::ZERO);
    size.x * size.y + size.y * size.z + size.z * size.x
}

/// Two buffers for alternating clipping.
#[derive(Default)]
struct Clipper {
    polygon: Vec<DVec3>,
    rest: Vec<DVec3>,
}

impl Clipper {
    /// Box of a triangle's part within `margin` of a piece; touching counts. `None` if there is none.
    fn part(&mut self, corners: &[DVec3; 3], piece: &Piece, margin: f64) -> Option<Aabb> {
        // Cheap cases first: all corners outside one plane, or inside all planes.
        let outside = |p: DVec3| piece.planes.iter().any(|plane| plane.distance(p) > margin);
        if piece.planes.iter().any(|plane| corners.iter().all(|&p| plane.distance(p) > margin)) {
            return None;
        }
        if !corners.iter().any(|&p| outside(p)) {
            return Some(Aabb::of(*corners));
        }
        self.polygon.clear();
        self.polygon.extend(corners);
        for plane in &piece.planes {
            self.rest.clear();
            for (i, &a) in self.polygon.iter().enumerate() {
                let b = self.polygon[(i + 1) % self.polygon.len()];
                let (da, db) = (plane.distance(a) - margin, plane.distance(b) - margin);
                if da <= 0.0 {
                    self.rest.push(a);
                }
                if (da > 0.0) != (db > 0.0) {
                    self.rest.push(a + (b - a) * (da / (da - db)));
                }
            }
            std::mem::swap(&mut self.polygon, &mut self.rest);
            if self.polygon.is_empty() {
                // A corner inside all planes touches, whatever rounding does to the rest.
                return corners.iter().any(|&p| !outside(p)).then(|| Aabb::of(*corners));
            }
        }
        Some(Aabb::of(self.polygon.iter().copied()))
    }
}
