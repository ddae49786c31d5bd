//! Stand-in for portal flow: what the graph connects.

use super::Progress;
use crate::BitMatrix;
use crate::cells::CellGraph;
use crate::geom::Aabb;

/// What flow starts from.
pub struct FlowInput<'a> {
    /// Cells and portals.
    pub graph: &'a CellGraph,
    /// Cells x objects.
    pub placement: &'a BitMatrix,
    /// Boxes of the objects.
    pub object_bounds: &'a [Aabb],
    /// Cells x cells.
    pub cells_lower: &'a BitMatrix,
    /// Cells x objects.
    pub objects_lower: &'a BitMatrix,
    /// Steps that one source portal may take.
    pub max_steps: u64,
    /// Metres.
    pub coplanar: f64,
}

/// What flow found.
pub struct FlowResult {
    /// Cells x cells.
    pub cells_upper: BitMatrix,
    /// Cells x objects.
    pub objects_upper: BitMatrix,
    /// Steps taken.
    pub steps: u64,
    /// Source portals that ran out of steps.
    pub capped: u64,
}

/// Reachability.
pub fn flow(input: &FlowInput<'_>, _progress: Progress<'_>) -> FlowResult {
    let n = input.graph.cells.len();
    let mut cells_upper = BitMatrix::new(n, n);
    let mut objects_upper = BitMatrix::new(n, input.object_bounds.len());
    for cell in 0..n {
        let mut stack = vec![cell];
        while let Some(c) = stack.pop() {
            if cells_upper.set(cell, c) {
                objects_upper.row_mut(cell).iter_mut().zip(input.placement.row(c)).for_each(|(a, b)| *a |= b);
                stack.extend(input.graph.cells[c].portals.iter().map(|&p| input.graph.target(p).index()));
            }
        }
    }
    FlowResult { cells_upper, objects_upper, steps: 0, capped: 0 }
}
