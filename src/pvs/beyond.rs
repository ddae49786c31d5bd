//! What is seen through some portals from anywhere before them, by flow.
//!
//! What is before the portals is one more cell of a graph of the PVS of the cells behind them: any line through one of the portals goes on
//! through the cell behind it, and crosses only cells that this cell sees.

use super::Pvs;
use super::flow::{FlowInput, flow};
use super::options::PvsOptions;
use crate::cells::{Cell, CellGraph, Placement, Portal};
use crate::job::{Job, Stopped};
use crate::math::bits;
use crate::math::geom::Aabb;
use crate::scene::{Object, Scene};
use crate::types::placed::PlacedBox;
use crate::{BitMatrix, CellId, PortalId};

/// Searches from portals of a bake's cells.
pub(super) struct Beyond<'a> {
    pvs: &'a Pvs,
    options: &'a PvsOptions,
    /// Bounds of the objects.
    bounds: Vec<Aabb>,
    coplanar: f64,
}

/// Where lines come from.
pub(super) struct Source<'s> {
    /// Portals into cells, from a cell with the number [`CellGraph::cells`] has.
    pub ways: &'s [Portal],
    /// Objects that are before the portals, too, as bits.
    pub touching: &'s [u64],
    /// Objects that are proven visible, as bits.
    pub known: &'s [u64],
    /// A portal that no line passes after the first one.
    pub without: Option<PortalId>,
}

/// What may be seen.
pub(super) struct Seen {
    /// Cells, as bits.
    pub cells: Vec<u64>,
    /// Objects, as bits.
    pub objects: Vec<u64>,
    /// Number of searches that ran out of steps.
    pub capped: u64,
}

impl<'a> Beyond<'a> {
    pub fn new(scene: &Scene, pvs: &'a Pvs, options: &'a PvsOptions) -> Self {
        let bounds = scene.objects.iter().map(Object::extent).collect();
        Self { pvs, options, bounds, coplanar: scene.tolerance().coplanar }
    }

    /// What may be seen through the portals of a source.
    pub fn see(&self, source: &Source<'_>, work: &Job<'_>) -> Result<Seen, Stopped> {
        let Pvs { graph: whole, placement, .. } = self.pvs;
        let bounds = self.bounds.as_slice();
        let mut next: Vec<usize> = source.ways.iter().map(|way| way.cells[1].index()).collect();
        next.sort_unstable();
        next.dedup();
        // The cells that may be on a line, by their new numbers.
        let mut on_lines = vec![0; whole.cells.len().div_ceil(64)];
        for &cell in &next {
            on_lines.iter_mut().zip(self.pvs.cells_upper.row(cell)).for_each(|(all, more)| *all |= more);
        }
        let old: Vec<usize> = bits::ones(&on_lines).collect();
        let here = old.len();
        let mut new = vec![None; whole.cells.len()];
        old.iter().enumerate().for_each(|(i, &cell)| new[cell] = Some(CellId(i as u32)));
        let kept = |portal: &Portal| {
            let [a, b] = portal.cells.map(|c| new.get(c.index()).copied().unwrap_or(Some(CellId(here as u32))));
            Some(Portal { cells: [a?, b?], ..portal.clone() })
        };
        let others = (0..).map(PortalId).zip(&whole.portals).filter(|(id, _)| source.without != Some(*id)).map(|(_, p)| p);
        let graph = of_portals(whole, here + 1, others.chain(source.ways).filter_map(kept).collect());
        // All pairs of the other cells count as known, so that flow does not search from them.
        let all = |columns: usize, known: usize| {
            let mut matrix = BitMatrix::new(here + 1, columns);
            for row in 0..here {
                (0..known).for_each(|column| {
                    matrix.set(row, column);
                });
            }
            matrix
        };
        let (cells_lower, mut objects_lower) = (all(here + 1, here), all(bounds.len(), bounds.len()));
        objects_lower.row_mut(here).copy_from_slice(source.known);
        let mut places = BitMatrix::new(here + 1, bounds.len());
        old.iter().enumerate().for_each(|(i, &cell)| places.row_mut(i).copy_from_slice(placement.matrix.row(cell)));
        places.row_mut(here).copy_from_slice(source.touching);
        let placed_boxes = placed_boxes(placement, |cell| new[cell].is_some()).map(|mut boxes| {
            // Objects that touch the region are always found.
            boxes.extend(places.ones(here).map(|_| PlacedBox::WHOLE));
            boxes
        });
        let input = FlowInput {
            graph: &graph,
            placement: &places,
            placed_boxes: placed_boxes.as_deref(),
            object_bounds: bounds,
            cells_lower: &cells_lower,
            objects_lower: &objects_lower,
            max_steps: self.options.flow_steps,
            coplanar: self.coplanar,
            fronts: None,
        };
        let flowed = flow(&input, work)?;
        let mut cells = vec![0; on_lines.len()];
        let seen = bits::ones(flowed.cells_upper.row(here)).filter_map(|cell| old.get(cell));
        seen.for_each(|cell| cells[cell / 64] |= 1 << (cell % 64));
        Ok(Seen { cells, objects: flowed.objects_upper.row(here).to_vec(), capped: flowed.capped })
    }
}

/// A graph with `like`'s settings and `cells` empty cells.
fn of_portals(like: &CellGraph, cells: usize, portals: Vec<Portal>) -> CellGraph {
    CellGraph {
        cells: vec![Cell::default(); cells],
        portals,
        strategy: like.strategy,
        smallest_hole: like.smallest_hole,
        reason: String::new(),
        closed_holes: Vec::new(),
        notes: Vec::new(),
    }
}

/// The placed boxes of some cells.
fn placed_boxes(placement: &Placement, is_kept: impl Fn(usize) -> bool) -> Option<Vec<PlacedBox>> {
    let mut boxes = placement.boxes.as_deref()?;
    let mut all = Vec::new();
    for cell in 0..placement.matrix.rows() {
        let (of_cell, rest) = boxes.split_at(placement.matrix.count_row(cell) as usize);
        boxes = rest;
        if is_kept(cell) {
            all.extend_from_slice(of_cell);
        }
    }
    Some(all)
}
