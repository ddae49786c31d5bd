//! Declared portals that whoever passes them comes nearer to a surface than the clearance that occluders keep: keyholes, slits.
//!
//! Occluders promise nothing about lines that graze a surface, and every line through such a portal does. So each gets rows of its own, by
//! shafts that take no such liberty (`Task::count_grazing_lines`): what it may show on either side. A pair that one of them may join, its cell
//! on one side and its object in the row of the other, is not for occluders to decide.
//!
//! What a split finds in triangles alone is another matter: holes as narrow may be cracks, and a file says below which width it promises
//! nothing ([`CellGraph::smallest_hole`]).

use super::mesh::Mesh;
use crate::cells::{CellGraph, Strategy};
use crate::{BitMatrix, DirectedPortal, geom};

/// Portals that were given, through which no line keeps the clearance.
fn portals(graph: &CellGraph, clearance: f64) -> impl Iterator<Item = usize> + '_ {
    let narrow = move |i: &usize| geom::width(&graph.portals[*i].winding) < 2.0 * clearance;
    (0..graph.portals.len()).filter(move |i| graph.strategy == Strategy::Given && narrow(i))
}

/// What is asked of one side of a narrow portal.
pub(super) struct Side {
    /// Out of the cell behind it.
    pub portal: DirectedPortal,
    /// Objects that may matter there, ascending.
    pub objects: Vec<u32>,
    /// Cells whose lines may lead to it.
    pub cells: Vec<u32>,
    /// False where it is so narrow that surfaces meet across it.
    pub can_be_asked: bool,
}

/// Both sides of narrow portals, as far as undecided pairs (`open`: cells x objects) may need them.
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
        // Who sees whom is symmetric, and a cell sees itself.
        let sees_both = |&c: &usize| c == behind || cells_upper.get(ahead, c);
        let cells: Vec<u32> = cells_upper.ones(behind).filter(sees_both).map(|c| c as u32).collect();
        let matters = |&o: &usize| cells.iter().any(|&c| open.get(c as usize, o));
        let objects: Vec<u32> = objects_upper.ones(ahead).filter(matters).map(|o| o as u32).collect();
        let can_be_asked = geom::width(&p.winding) >= 4.0 * mesh.gap;
        (!objects.is_empty()).then_some(Side { portal, objects, cells, can_be_asked })
    };
    directed.filter_map(side).collect()
}
