//! Fewer, larger cells, if a bake would exceed its memory limit.
//!
//! A cell is any union of convex pieces, so any two cells can be merged. Portals between them vanish, and the merged cell sees what either
//! saw. Rows get coarser, and nothing visible is lost. Cells with a large common portal are merged first, and sizes stay balanced. Open
//! cells do not merge with closed ones.

use super::CellGraph;
use super::merge::merge;
use crate::CellId;
use crate::cells::disjoint_sets::DisjointSets;
use crate::math::geom::area;
use crate::types::note::Note;

/// Upper bound of the memory for a bake's matrices, bytes: both bounds over cells and objects, and flow's matrices over directed portals.
/// The scene itself is not included.
pub fn matrix_bytes(cells: usize, objects: usize, portals: usize) -> u64 {
    row_bytes(cells, objects).saturating_add(flow_bytes(cells, portals))
}

/// The share of both bounds.
fn row_bytes(cells: usize, objects: usize) -> u64 {
    let [cells, objects] = [cells, objects].map(|n| n as u128);
    u64::try_from((5 * cells * cells + 7 * cells * objects) / 8).unwrap_or(u64::MAX)
}

/// The share of flow.
pub fn flow_bytes(cells: usize, portals: usize) -> u64 {
    let [cells, directed] = [cells, 2 * portals].map(|n| n as u128);
    u64::try_from((4 * directed * directed + 2 * cells * directed) / 8).unwrap_or(u64::MAX)
}

/// Merges cells until their matrices, with this many objects, take at most `limit` bytes. Returns the previous number of cells if it
/// changed, and adds a note to the graph. `flow`: flow's memory if it needs less than [`flow_bytes`]; called once, before any merge.
pub fn coarsen(
    graph: &mut CellGraph,
    objects: usize,
    limit: u64,
    flow: impl FnOnce(&CellGraph) -> Option<u64>,
) -> Option<usize> {
    let before = graph.cells.len();
    let needed = matrix_bytes(before, objects, graph.portals.len());
    if needed <= limit {
        return None;
    }
    let rows = row_bytes(before, objects);
    if rows <= limit && flow(graph).is_some_and(|bytes| bytes <= limit - rows) {
        return None;
    }
    let mut order: Vec<(f64, usize)> = graph.portals.iter().enumerate().map(|(i, p)| (area(&p.winding), i)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut groups = Groups::new(before);
    let mut most = 1;
    while most < before && !groups.fits(graph, objects, limit) {
        most *= 2;
        for &(_, portal) in &order {
            let [a, b] = graph.portals[portal].cells.map(CellId::index);
            groups.join(a, b, most, graph);
        }
        // Also cells without portals between them: rooms without a known entrance.
        for pair in groups.roots().chunks(2) {
            if let &[a, b] = pair {
                groups.join(a, b, most / 2, graph);
            }
        }
    }
    merge(graph, &mut groups.union);
    let after = graph.cells.len();
    graph.notes.push(Note::cost(format!(
        "memory: {before} cells joined to {after}, since their matrices would take {} MiB; so more is drawn (--memory)",
        needed >> 20
    )));
    Some(before)
}

/// Disjoint sets of cells, and the size of each at its representative.
struct Groups {
    union: DisjointSets,
    size: Vec<usize>,
}

impl Groups {
    fn new(n: usize) -> Self {
        Self { union: DisjointSets::new(n), size: vec![1; n] }
    }

    fn root(&mut self, cell: usize) -> usize {
        self.union.find(cell as u32) as usize
    }

    /// Merges two groups, unless the result has more than `most` cells, or one is open and the other closed.
    fn join(&mut self, a: usize, b: usize, most: usize, graph: &CellGraph) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b && self.size[a] + self.size[b] <= most && graph.cells[a].open == graph.cells[b].open {
            let joined = self.size[a] + self.size[b];
            let root = self.union.join(a as u32, b as u32) as usize;
            self.size[root] = joined;
        }
    }

    fn roots(&mut self) -> Vec<usize> {
        (0..self.size.len()).filter(|&c| self.root(c) == c).collect()
    }

    fn fits(&mut self, graph: &CellGraph, objects: usize, limit: u64) -> bool {
        let mut apart = |c: [CellId; 2]| self.root(c[0].index()) != self.root(c[1].index());
        let portals = graph.portals.iter().map(|p| p.cells).filter(|&c| apart(c)).count();
        matrix_bytes(self.roots().len(), objects, portals) <= limit
    }
}
