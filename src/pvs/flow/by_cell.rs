//! Rows of single cells, computed on demand in a thread of their own, for the cells ahead of a camera. A culler takes them between frames
//! ([`crate::runtime::Culler::learn_row`]).
//!
//! The search is that of [`super::flow`], which decides a pair of cells from the cheaper side and shares refutations between searches. Here
//! each cell is searched alone, without results for other pairs. So a row is a superset of the row of the whole flow.

use super::might_see::MightSee;
use super::net::Net;
use super::{FlowInput, decide};
use crate::CellId;
use crate::job::{Job, Stopped};

/// The upper bound of one cell.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CellRow {
    /// Cells, as bits, including the cell itself.
    pub cells: Vec<u64>,
    /// Objects, as bits.
    pub objects: Vec<u64>,
}

/// See the [module](self). It may be shared by threads.
pub struct FlowByCell<'a> {
    input: FlowInput<'a>,
    net: Net,
    might_see: MightSee,
}

impl<'a> FlowByCell<'a> {
    /// Computes which portals might see each other, the input of every row. Takes about three bits of memory per pair of directed portals.
    ///
    /// # Panics
    ///
    /// If the size of a matrix does not match the graph's cells or the number of boxes.
    pub fn new(input: FlowInput<'a>) -> Self {
        let (cells, objects) = (input.graph.cells.len(), input.object_bounds.len());
        for (matrix, columns) in [(input.cells_lower, cells), (input.objects_lower, objects), (input.placement, objects)] {
            assert_eq!((matrix.rows(), matrix.columns()), (cells, columns), "a row per cell, a column per target");
        }
        let net = Net::of_graph(input.graph, input.coplanar);
        let might_see = MightSee::new(&net);
        Self { input, net, might_see }
    }

    /// The row of a cell. It does not depend on previous calls or on the number of threads.
    ///
    /// # Errors
    ///
    /// If it was stopped.
    ///
    /// # Panics
    ///
    /// If there is no such cell.
    pub fn row(&self, cell: CellId, work: &Job<'_>) -> Result<CellRow, Stopped> {
        assert!(cell.index() < self.net.cells, "{cell} of {} cells", self.net.cells);
        let own = |i: usize| i == cell.index();
        let (cells, objects, _) = decide(&self.input, &self.net, self.might_see.clone(), own, work)?;
        Ok(CellRow { cells: cells.row(cell.index()).to_vec(), objects: objects.row(cell.index()).to_vec() })
    }
}
