//! Rows of single cells, worked out when somebody asks: by a thread of its own, for where a camera will be soon. A culler takes them while
//! frames go on ([`crate::runtime::Culler::learn_row`]).
//!
//! The search is that of [`super::flow`], which decides a pair of cells from the cheaper side and tells other searches what it has refuted. Here
//! each cell is asked alone: of the pairs that it is one of, those are decided, and nothing is known of others. So a row has all that the whole
//! flow leaves of it, and may have more.

use super::might_see::MightSee;
use super::net::Net;
use super::{FlowInput, decide};
use crate::CellId;
use crate::job::{Job, Stopped};

/// What may be seen from a cell.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct CellRow {
    /// Cells, as bits; the cell itself is one.
    pub cells: Vec<u64>,
    /// Objects, as bits.
    pub objects: Vec<u64>,
}

/// See the [module](self). Threads may share one.
pub struct FlowByCell<'a> {
    input: FlowInput<'a>,
    net: Net,
    might_see: MightSee,
}

impl<'a> FlowByCell<'a> {
    /// Finds out which portals might see each other: what every row starts from. Takes memory for about three bits a pair of directed portals.
    ///
    /// # Panics
    ///
    /// Where the matrices aren't of the graph's number of cells, or the boxes not of the matrices' number of objects.
    pub fn new(input: FlowInput<'a>) -> Self {
        let (cells, objects) = (input.graph.cells.len(), input.object_bounds.len());
        for (matrix, columns) in [(input.cells_lower, cells), (input.objects_lower, objects), (input.placement, objects)] {
            assert_eq!((matrix.rows(), matrix.columns()), (cells, columns), "rows of every cell, columns of every target");
        }
        let net = Net::of_graph(input.graph, input.coplanar);
        let might_see = MightSee::new(&net);
        Self { input, net, might_see }
    }

    /// The row of a cell. The same whatever was asked before, and for any number of threads.
    ///
    /// # Errors
    ///
    /// Where it was stopped.
    ///
    /// # Panics
    ///
    /// Where there is no such cell.
    pub fn row(&self, cell: CellId, work: &Job<'_>) -> Result<CellRow, Stopped> {
        assert!(cell.index() < self.net.cells, "{cell} of {} cells", self.net.cells);
        let own = |i: usize| i == cell.index();
        let (cells, objects, _) = decide(&self.input, &self.net, self.might_see.clone(), own, work)?;
        Ok(CellRow { cells: cells.row(cell.index()).to_vec(), objects: objects.row(cell.index()).to_vec() })
    }
}
