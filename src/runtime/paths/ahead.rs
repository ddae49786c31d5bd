//! What a way still takes at least, known before any is asked for.
//!
//! * **Dead ends.** A cell all of whose portals lead into one other, such as an office at a corridor, is on a shortest way only if that
//!   starts or ends in it; so is what is left when such cells are taken away, again and again. Doors that shut make more of them.
//! * **A table** of least ways between portals of the other cells, all doors open ([`super::table`]).

use super::super::culler::{Culler, target};
use super::facets::Facets;
use super::table::{NONE, Table};
use crate::{CellId, DirectedPortal};
use glam::DVec3;

/// Of a culler.
#[derive(Clone, Debug)]
pub(super) struct Ahead {
    /// By cell: the cell that a dead end leads out into.
    out_of: Vec<Option<CellId>>,
    table: Table,
}

/// Where a way ends.
#[derive(Clone, Debug, Default)]
pub(super) struct Goal {
    pub at: DVec3,
    pub cells: Vec<CellId>,
    /// By cell: whether it is a cell of the goal, or on the way out of it.
    leads_there: Vec<bool>,
    marked: Vec<CellId>,
    /// Portals of the table into the cells that dead ends with the goal lead out to, and what remains from there at least, metres.
    entries: Vec<(u32, f64)>,
    /// By directed portal: what remains at least, metres; NaN: not known yet.
    remaining: Vec<f64>,
    known: Vec<DirectedPortal>,
}

impl Ahead {
    pub fn new(culler: &Culler, facets: &Facets) -> Self {
        let out_of = dead_ends(culler, facets);
        let is_core = |cell: CellId| out_of[cell.index()].is_none();
        let cells = (0..out_of.len() as u32).map(CellId).filter(|&cell| is_core(cell));
        let portals = cells.flat_map(|cell| facets.out(cell)).copied();
        // Those into one cell are beside each other.
        let core = portals.filter(|&p| is_core(target(culler, p))).map(reversed).collect();
        Self { table: Table::new(culler, facets, core), out_of }
    }

    /// Whether a shortest way may go from one cell into the next.
    pub fn may_enter(&self, from: CellId, into: CellId, goal: &Goal) -> bool {
        self.out_of[into.index()].is_none() || goal.leads_there[into.index()] || self.out_of[from.index()] == Some(into)
    }

    /// Takes a goal in some cells.
    pub fn aim(&self, culler: &Culler, facets: &Facets, at: DVec3, cells: &[CellId], goal: &mut Goal) {
        goal.at = at;
        goal.cells.clear();
        goal.cells.extend_from_slice(cells);
        goal.leads_there.resize(self.out_of.len(), false);
        goal.remaining.resize(2 * culler.portal_count(), f64::NAN);
        goal.marked.drain(..).for_each(|cell| goal.leads_there[cell.index()] = false);
        goal.known.drain(..).for_each(|portal| goal.remaining[portal.0 as usize] = f64::NAN);
        goal.entries.clear();
        for &cell in cells {
            let (mut cell, mut door) = (cell, None);
            self.mark(cell, goal);
            while let Some(out) = self.out_of[cell.index()] {
                door = Some((cell, out));
                cell = out;
                self.mark(cell, goal);
            }
            for &out in facets.out(cell) {
                let entry = self.table.place(reversed(out));
                if entry != NONE {
                    let entered = out.portal().index();
                    let inside = |(leaf, hall): (CellId, CellId)| {
                        let doors = facets.out(hall).iter().filter(|&&p| target(culler, p) == leaf);
                        let metres = |p: usize| facets.gap(entered, p) + facets.distance(p, at);
                        doors.map(|p| metres(p.portal().index())).fold(f64::INFINITY, f64::min)
                    };
                    goal.entries.push((entry, door.map_or_else(|| facets.distance(entered, at), inside)));
                }
            }
        }
    }

    fn mark(&self, cell: CellId, goal: &mut Goal) {
        goal.leads_there[cell.index()] = true;
        goal.marked.push(cell);
    }

    /// What remains at least, from any point of a portal, metres.
    pub fn remaining(&self, culler: &Culler, facets: &Facets, portal: DirectedPortal, goal: &mut Goal) -> f64 {
        let known = goal.remaining[portal.0 as usize];
        if !known.is_nan() {
            return known;
        }
        let straight = facets.distance(portal.portal().index(), goal.at);
        let cell = target(culler, portal);
        let metres = if goal.leads_there[cell.index()] || self.table.is_empty() {
            straight
        } else if self.table.place(portal) != NONE {
            straight.max(self.by_table(self.table.place(portal), goal))
        } else if self.out_of[cell.index()].is_none() {
            // Out of a dead end: by the next portal.
            let ways = facets.out(cell).iter().filter_map(|next| {
                let row = self.table.place(*next);
                let gap = facets.gap(portal.portal().index(), next.portal().index());
                (row != NONE).then(|| gap + self.by_table(row, goal))
            });
            straight.max(ways.fold(f64::INFINITY, f64::min))
        } else {
            straight
        };
        goal.remaining[portal.0 as usize] = metres;
        goal.known.push(portal);
        metres
    }

    fn by_table(&self, row: u32, goal: &Goal) -> f64 {
        let row = self.table.row(row);
        goal.entries.iter().map(|(entry, rest)| f64::from(row[*entry as usize]) + rest).fold(f64::INFINITY, f64::min)
    }
}

/// The same portal the other way.
pub(super) fn reversed(portal: DirectedPortal) -> DirectedPortal {
    DirectedPortal(portal.0 ^ 1)
}

/// By cell: the one that it leads out into, if it is a dead end.
fn dead_ends(culler: &Culler, facets: &Facets) -> Vec<Option<CellId>> {
    let mut out_of = vec![None; culler.cell_count()];
    let mut open: Vec<CellId> = (0..culler.cell_count() as u32).map(CellId).collect();
    while let Some(cell) = open.pop() {
        if out_of[cell.index()].is_none() {
            let beside = facets.out(cell).iter().map(|&portal| target(culler, portal));
            let mut beside = beside.filter(|next| out_of[next.index()] != Some(cell));
            if let Some(first) = beside.next()
                && beside.all(|next| next == first)
            {
                out_of[cell.index()] = Some(first);
                open.push(first);
            }
        }
    }
    out_of
}
