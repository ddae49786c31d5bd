//! What a way still takes at least, known before any is asked for.
//!
//! * **Dead ends.** A cell all of whose portals lead into one other, such as an office at a corridor, is on a shortest way only if that
//!   starts or ends in it; so is what is left when such cells are taken away, again and again. Doors that shut make more of them.
//! * **A table** of least ways between portals of the other cells, all doors open ([`super::table`]).

use super::super::culler::{Culler, target};
use super::facets::Facets;
use super::table::{NO_WAY, Strip, Table, gap, reversed, strips_of};
use crate::{CellId, DirectedPortal};
use glam::DVec3;

/// Sums at a time.
const LANES: usize = 8;

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
    /// Cells that dead ends with the goal lead out to, and how many portals of the table lead into each.
    halls: Vec<(CellId, usize)>,
    /// By portal into each: what remains from there at least, metres.
    rests: Vec<f32>,
    /// Strips of doors on the way in, and what remains from there at least, metres.
    doors: Vec<(Strip, f32)>,
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
        let core = portals.filter(|&p| is_core(target(culler, p))).collect();
        Self { table: Table::new(culler, core), out_of }
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
        goal.halls.clear();
        goal.rests.clear();
        for &cell in cells {
            let mut cell = cell;
            goal.doors.clear();
            goal.doors.push(([at.as_vec3(); 2], 0.0));
            self.mark(cell, goal);
            while let Some(out) = self.out_of[cell.index()] {
                self.come_in(culler, facets, [out, cell], goal);
                cell = out;
                self.mark(cell, goal);
            }
            let known = goal.rests.len();
            for &out in facets.out(cell).iter().filter(|&&out| self.table.has(out)) {
                let rests = self.table.strips(out).iter().map(|strip| rest(strip, &goal.doors));
                goal.rests.push(rests.fold(f32::INFINITY, f32::min));
            }
            goal.halls.push((cell, goal.rests.len() - known));
        }
    }

    /// Goes on from what remains from the doors of a dead end to those on the way into it: from the first of two cells to the second.
    fn come_in(&self, culler: &Culler, facets: &Facets, [out, cell]: [CellId; 2], goal: &mut Goal) {
        let inner = goal.doors.len();
        for &door in facets.out(out).iter().filter(|&&door| target(culler, door) == cell) {
            let first = goal.doors.len();
            for strip in strips_of(culler, door) {
                goal.doors.push((strip, rest(&strip, &goal.doors[..inner])));
            }
            let least = goal.doors[first..].iter().map(|(_, rest)| f64::from(*rest)).fold(f64::INFINITY, f64::min);
            let remaining = &mut goal.remaining[door.0 as usize];
            *remaining = remaining.min(least);
            goal.known.push(door);
        }
        goal.doors.drain(..inner);
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
        let metres = if goal.cells.contains(&cell) || self.table.is_empty() {
            straight
        } else if self.table.has(portal) {
            straight.max(self.by_table(portal, target(culler, reversed(portal)), goal))
        } else {
            // Out of a dead end: by the next portal.
            let mut least = f64::INFINITY;
            for &next in facets.out(cell) {
                let remaining = if self.table.has(next) {
                    self.by_table(next, cell, goal)
                } else if self.out_of[cell.index()] == Some(target(culler, next)) {
                    self.remaining(culler, facets, next, goal)
                } else {
                    // Into the goal's, or nowhere.
                    goal.remaining[next.0 as usize]
                };
                // Not less, if it is not known.
                least = least.min(remaining + facets.gap(portal.portal().index(), next.portal().index()));
            }
            straight.max(least)
        };
        goal.remaining[portal.0 as usize] = metres;
        goal.known.push(portal);
        metres
    }

    /// What remains from a portal of the table, out of a cell.
    fn by_table(&self, portal: DirectedPortal, cell: CellId, goal: &Goal) -> f64 {
        let (mut rests, mut least) = (&goal.rests[..], [f32::INFINITY; LANES]);
        for &(hall, count) in &goal.halls {
            let (ways, unit) = self.table.ways(portal, cell, hall);
            let (of_hall, later) = rests.split_at(count);
            for (ways, rests) in ways.chunks(LANES).zip(of_hall.chunks(LANES)) {
                for ((least, way), rest) in least.iter_mut().zip(ways).zip(rests) {
                    let metres = if *way == NO_WAY { f32::INFINITY } else { f32::from(*way) * unit + rest };
                    *least = if metres < *least { metres } else { *least };
                }
            }
            rests = later;
        }
        // Rounded down.
        f64::from(least.into_iter().fold(f32::INFINITY, f32::min) * (1.0 - 2.0 * f32::EPSILON))
    }
}

/// What remains from a strip by the nearest of some doors, metres.
fn rest(strip: &Strip, doors: &[(Strip, f32)]) -> f32 {
    doors.iter().map(|(door, rest)| (gap(strip, door) + rest) * (1.0 - f32::EPSILON)).fold(f32::INFINITY, f32::min)
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
