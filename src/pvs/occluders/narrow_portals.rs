//! Given portals narrower than twice the clearance: keyholes, slits.
//!
//! Occluders ignore lines within the clearance of a surface, which are all lines through such a portal. So each of these portals gets rows
//! of its own for both sides, by shafts that count all lines (`Task::count_grazing_lines`). Occluders do not decide a pair that such a
//! portal may connect: its cell on one side, and its object in the row of the other.
//!
//! Portals found by a split are different: such narrow holes may be cracks, and the file states the width below which it guarantees nothing
//! ([`CellGraph::smallest_hole`]).

use super::mesh::Mesh;
use crate::cells::{CellGraph, Strategy};
use crate::math::geom;
use crate::{BitMatrix, DirectedPortal};

/// Given portals through which no line keeps the clearance.
fn portals(graph: &CellGraph, clearance: f64) -> impl Iterator<Item = usize> + '_ {
    let narrow = move |i: &usize| geom::width(&graph.portals[*i].winding) < 2.0 * clearance;
    (0..graph.portals.len()).filter(move |i| graph.strategy == Strategy::Given && narrow(i))
}

/// One side of a narrow portal.
pub(super) struct Side {
    /// The portal, out of the cell behind it.
    pub portal: DirectedPortal,
    /// Candidate objects, ascending.
    pub objects: Vec<u32>,
    /// Cells with lines to it.
    pub cells: Vec<u32>,
    /// False if it is so narrow that surfaces are connected across it.
    pub can_be_asked: bool,
}

/// Both sides of narrow portals that undecided pairs (`open`: cells x objects) may need.
pub(super) fn sides(
    graph: &CellGraph,
    open: &BitMatrix,
    [cells_upper, objects_upper]: [&BitMatrix; 2],
    mesh: &Mesh,
) -> Vec<Side> {
    let directed = portals(graph, mesh.clearance).flat_map(|p| [0, 1].map(|side| DirectedPortal(2 * p as u32 + side)));
    let side = |portal: DirectedPortal| {
        let p = &graph.portals[portal.portal().index()];
        let (behind, ahead) = (p.cells[portal.side()].index(), p.cells[1 - portal.side()].index());
        // Visibility of cells is symmetric and reflexive.
        let sees_both = |&c: &usize| c == behind || cells_upper.get(ahead, c);
        let cells: Vec<u32> = cells_upper.ones(behind).filter(sees_both).map(|c| c as u32).collect();
        let matters = |&o: &usize| cells.iter().any(|&c| open.get(c as usize, o));
        let objects: Vec<u32> = objects_upper.ones(ahead).filter(matters).map(|o| o as u32).collect();
        let can_be_asked = geom::width(&p.winding) >= 4.0 * mesh.gap;
        (!objects.is_empty()).then_some(Side { portal, objects, cells, can_be_asked })
    };
    directed.filter_map(side).collect()
}
