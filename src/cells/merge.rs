//! Merges cells: a cell is any union of convex pieces.

use super::disjoint_sets::DisjointSets;
use super::{Cell, CellGraph};
use crate::CellId;

/// Makes one cell of each group, in the order of their first cells. Portals within a group vanish. Returns the new cell of each old one.
pub fn merge(graph: &mut CellGraph, groups: &mut DisjointSets) -> Vec<CellId> {
    let mut ids: Vec<CellId> = Vec::with_capacity(graph.cells.len());
    let mut cells: Vec<(Cell, usize)> = Vec::new();
    for (c, mut cell) in std::mem::take(&mut graph.cells).into_iter().enumerate() {
        let first = groups.find(c as u32) as usize;
        if first == c {
            ids.push(CellId(cells.len() as u32));
            cells.push((cell, 0));
        } else {
            let id = ids[first];
            ids.push(id);
            let (whole, others) = &mut cells[id.index()];
            whole.pieces.append(&mut cell.pieces);
            *others += 1;
        }
    }
    let named = |(mut cell, others): (Cell, usize)| {
        if others > 0 {
            cell.name = format!("{} and {others} more", cell.name);
            cell.source = None;
        }
        cell
    };
    graph.cells = cells.into_iter().map(named).collect();
    for portal in &mut graph.portals {
        portal.cells = portal.cells.map(|c| ids[c.index()]);
    }
    graph.portals.retain(|p| p.cells[0] != p.cells[1]);
    graph.link();
    ids
}
