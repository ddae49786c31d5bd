//! Which cells does an object touch.
//!
//! Based on: Sutherland, Hodgman, *Reentrant polygon clipping*, 1974: a triangle touches a piece where something of it is left
//! after clipping to every plane of the piece. Planes are moved out by the margin first, so nothing near is missed.

use super::{CellGraph, Locator, Piece};
use crate::BitMatrix;
use crate::geom::Aabb;
use crate::parallel;
use crate::scene::Scene;
use glam::DVec3;

/// A matrix of cells x objects: set where a triangle of the object comes within `margin` metres of a piece of the cell.
/// Never misses one; triangles are clipped to the pieces, so boxes that only nearly touch don't count.
pub fn place_objects(scene: &Scene, graph: &CellGraph, margin: f64) -> BitMatrix {
    let locator = Locator::new(graph);
    let rows: Vec<Vec<u32>> = parallel::map_init(scene.objects.len(), Clipper::default, |clipper, object| {
        let object = &scene.objects[object];
        let mut cells = Vec::new();
        let mut candidates = Vec::new();
        locator.pieces_in_box(&object.bounds.inflated(margin), |cell, piece| candidates.push((cell.0, piece as u32)));
        // Where an object is all over the place, each triangle asks the tree; else all share the object's candidates.
        let share = candidates.len() <= 64;
        for triangle in object.triangles.clone() {
            let corners = scene.corners(triangle as usize);
            let bounds = Aabb::of(corners).inflated(margin);
            let mut touch = |cell: u32, piece: u32| {
                let piece = &graph.cells[cell as usize].pieces[piece as usize];
                if !cells.contains(&cell) && piece.bounds.touches(&bounds) && clipper.touches(&corners, piece, margin) {
                    cells.push(cell);
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
    let mut placement = BitMatrix::new(graph.cells.len(), scene.objects.len());
    for (object, cells) in rows.iter().enumerate() {
        for &cell in cells {
            placement.set(cell as usize, object);
        }
    }
    placement
}

/// Two buffers that a polygon is clipped back and forth between.
#[derive(Default)]
struct Clipper {
    polygon: Vec<DVec3>,
    rest: Vec<DVec3>,
}

impl Clipper {
    /// True where a triangle comes within `margin` of a piece; touching counts.
    fn touches(&mut self, corners: &[DVec3; 3], piece: &Piece, margin: f64) -> bool {
        // The cheap answers first: all outside of one plane; one corner inside of all.
        let outside = |p: DVec3| piece.planes.iter().any(|plane| plane.distance(p) > margin);
        if piece.planes.iter().any(|plane| corners.iter().all(|&p| plane.distance(p) > margin)) {
            return false;
        }
        if corners.iter().any(|&p| !outside(p)) {
            return true;
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
                return false;
            }
        }
        true
    }
}
