//! Which cells does an object touch.

use super::CellGraph;
use crate::BitMatrix;
use crate::scene::Scene;

/// A matrix of cells x objects: set where a triangle of the object comes within `margin` metres of a piece of the cell.
/// Never misses one; triangles are clipped to the pieces, so boxes that only nearly touch don't count.
pub fn place_objects(_scene: &Scene, _graph: &CellGraph, _margin: f64) -> BitMatrix {
    todo!()
}
