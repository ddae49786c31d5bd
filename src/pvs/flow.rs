//! The upper bound: portal flow with separating planes.
mod goals;
mod might_see;
mod net;
mod search;
mod separators;
mod stab;
mod window;

use super::Progress;
use crate::cells::CellGraph;
use crate::geom::Aabb;
use crate::{BitMatrix, bits};
use goals::{Boxes, CellGoals, ObjectGoals};
use might_see::{MightSee, get, set};
use net::Net;
use rayon::prelude::*;
use search::Search;

/// What flow starts from.
#[derive(Clone, Copy)]
pub struct FlowInput<'a> {
    /// Cells and portals.
    pub graph: &'a CellGraph,
    /// Cells x objects: which objects are in which cell.
    pub placement: &'a BitMatrix,
    /// A box around each object, metres.
    pub object_bounds: &'a [Aabb],
    /// Cells x cells: pairs that are known to see each other.
    pub cells_lower: &'a BitMatrix,
    /// Cells x objects: pairs that are known to be visible.
    pub objects_lower: &'a BitMatrix,
    /// Most steps that the search from one directed portal may take; what it left undecided then counts as visible. A step
    /// is one portal tried, about 2 microseconds.
    pub max_steps: u64,
    /// Metres.
    pub coplanar: f64,
}

/// The upper bound, and what it took.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FlowResult {
    /// Cells x cells, symmetric, the diagonal set: pairs not proven hidden.
    pub cells_upper: BitMatrix,
    /// Cells x objects: pairs not proven hidden.
    pub objects_upper: BitMatrix,
    /// Steps taken.
    pub steps: u64,
    /// Directed portals whose search ran out of steps.
    pub capped: u64,
}

/// Searches out of one cell that follow each other and share what they find.
struct Task {
    cell: usize,
    portals: Vec<usize>,
}

/// Portals of one cell that one task searches from.
const TASK_PORTALS: usize = 16;

/// After each round what was found is shared. A number, not a time or a count of threads: it decides which steps are saved.
const ROUNDS: usize = 8;

/// Works out what may be seen from each cell.
///
/// # Panics
///
/// Where the matrices don't have the graph's number of cells, or the boxes not the matrices' number of objects.
pub fn flow(input: &FlowInput<'_>, progress: Progress<'_>) -> FlowResult {
    let net = Net::new(input.graph, input.coplanar);
    progress("flow: might-see", 0.0);
    let mut might_see = MightSee::by_planes(&net);
    for pass in 0..2 {
        progress("flow: might-see", (1 + pass) as f64 / 3.0);
        might_see.narrow(&net);
    }
    let mut run = Run { net: &net, input, capped: vec![0; net.portals().div_ceil(64)], steps: 0 };
    let cells_upper = run.cells(&mut might_see, progress);
    let objects_upper = run.objects(&might_see, &cells_upper, progress);
    let capped = bits::ones(&run.capped).count() as u64;
    FlowResult { cells_upper, objects_upper, steps: run.steps, capped }
}

struct Run<'a> {
    net: &'a Net,
    input: &'a FlowInput<'a>,
    capped: Vec<u64>,
    steps: u64,
}

/// What a task found.
struct Found {
    /// Bits of cells or objects.
    seen: Vec<u64>,
    steps: u64,
    capped: Vec<usize>,
    /// For a portal, the cells that no line through it reaches.
    refuted: Vec<(usize, Vec<u64>)>,
}

impl Run<'_> {
    fn cells(&mut self, might_see: &mut MightSee, progress: Progress<'_>) -> BitMatrix {
        let net = self.net;
        let n = net.cells;
        let mut upper = BitMatrix::new(n, n);
        for i in 0..n {
            upper.set(i, i);
            for j in self.input.cells_lower.ones(i).chain(net.out(i).map(|p| net.target[p] as usize)) {
                upper.set(i, j);
                upper.set(j, i);
            }
        }
        // Reachable, undecided.
        let mut hidden = BitMatrix::new(n, n);
        for i in 0..n {
            let reach = self.reached(might_see, net.out(i));
            (0..n).filter(|&j| !upper.get(i, j) && !get(&reach, j)).for_each(|j| {
                hidden.set(i, j);
                hidden.set(j, i);
            });
        }
        might_see.drop_hidden(net, &hidden);
        let cost: Vec<u64> = (0..n).map(|c| net.out(c).map(|p| might_see.count(p)).sum()).collect();
        let mut wanted = BitMatrix::new(n, n);
        for i in 0..n {
            for j in (0..n).filter(|&j| !upper.get(i, j) && !hidden.get(i, j)) {
                if (cost[i], i) < (cost[j], j) {
                    wanted.set(i, j);
                }
            }
        }
        let rounds = self.rounds(might_see, &cost, |c| wanted.count_row(c) > 0);
        let count = rounds.len();
        for (r, round) in rounds.iter().enumerate() {
            progress("flow: cells", r as f64 / count as f64);
            let found: Vec<Found> = {
                let might = &*might_see;
                round
                    .par_iter()
                    .with_max_len(1)
                    .map_init(|| Search::new(net, might, self.input.max_steps), |s, t| self.cell_task(s, might, t, &wanted))
                    .collect()
            };
            for (task, found) in round.iter().zip(&found) {
                for j in bits::ones(&found.seen) {
                    upper.set(task.cell, j);
                    upper.set(j, task.cell);
                    wanted.clear(task.cell, j);
                }
                self.add(found);
                for (p, cells) in &found.refuted {
                    might_see.drop_into(net, *p, cells);
                }
            }
            let later = |c: usize| rounds[r + 1..].iter().flatten().any(|t| t.cell == c);
            for task in round.iter().filter(|t| !later(t.cell)) {
                for j in bits::ones(wanted.row(task.cell)) {
                    hidden.set(task.cell, j);
                    hidden.set(j, task.cell);
                }
            }
            might_see.drop_hidden(net, &hidden);
        }
        upper
    }

    fn add(&mut self, found: &Found) {
        self.steps += found.steps;
        found.capped.iter().for_each(|&p| set(&mut self.capped, p));
    }

    fn reached(&self, might_see: &MightSee, portals: impl Iterator<Item = usize>) -> Vec<u64> {
        let mut cells = vec![0; self.net.cells.div_ceil(64)];
        for p in portals {
            set(&mut cells, self.net.target[p] as usize);
            bits::ones(might_see.row(p)).for_each(|q| set(&mut cells, self.net.target[q] as usize));
        }
        cells
    }

    fn cell_task(&self, search: &mut Search<'_>, might_see: &MightSee, task: &Task, wanted: &BitMatrix) -> Found {
        let mut found = Found { seen: vec![0; self.net.cells.div_ceil(64)], steps: 0, capped: vec![], refuted: vec![] };
        let mut goals = CellGoals::new(self.net, wanted.row(task.cell).to_vec());
        for &p in &task.portals {
            let before = goals.wanted.clone();
            let outcome = search.run(p, &mut goals);
            found.steps += outcome.steps;
            if outcome.capped {
                found.capped.push(p);
                let reach = self.reached(might_see, std::iter::once(p));
                for j in bits::ones(&reach) {
                    use goals::Goals;
                    goals.arrive(self.net, j, &[]);
                }
            } else {
                let home = self.net.out(task.cell).any(|q| get(might_see.row(p), self.net.twin[q] as usize));
                if !home {
                    found.refuted.push((p, goals.wanted.clone()));
                }
            }
            for (s, (a, b)) in found.seen.iter_mut().zip(before.iter().zip(&goals.wanted)) {
                *s |= a & !b;
            }
        }
        found
    }

    fn objects(&mut self, might_see: &MightSee, cells_upper: &BitMatrix, progress: Progress<'_>) -> BitMatrix {
        let net = self.net;
        let mut upper = self.input.placement.clone();
        upper.union_with(self.input.objects_lower);
        let boxes = Boxes::new(net, self.input.placement, self.input.object_bounds);
        let cost: Vec<u64> = (0..net.cells).map(|c| net.out(c).map(|p| might_see.count(p)).sum()).collect();
        let rounds = self.rounds(might_see, &cost, |_| self.input.placement.columns() > 0);
        let count = rounds.len();
        for (r, round) in rounds.iter().enumerate() {
            progress("flow: objects", r as f64 / count as f64);
            let found: Vec<Found> = round
                .par_iter()
                .with_max_len(1)
                .map_init(
                    || Search::new(net, might_see, self.input.max_steps),
                    |s, t| self.object_task(s, might_see, t, &boxes, cells_upper, &upper),
                )
                .collect();
            for (task, found) in round.iter().zip(&found) {
                bits::ones(&found.seen).for_each(|o| {
                    upper.set(task.cell, o);
                });
                self.add(found);
            }
        }
        upper
    }

    fn object_task(
        &self,
        search: &mut Search<'_>,
        might_see: &MightSee,
        task: &Task,
        boxes: &Boxes,
        cells_upper: &BitMatrix,
        upper: &BitMatrix,
    ) -> Found {
        let mut undecided: Vec<u64> = vec![0; upper.columns().div_ceil(64)];
        for j in cells_upper.ones(task.cell) {
            for ((u, p), known) in undecided.iter_mut().zip(self.input.placement.row(j)).zip(upper.row(task.cell)) {
                *u |= p & !known;
            }
        }
        let mut found = Found { seen: vec![0; undecided.len()], steps: 0, capped: vec![], refuted: vec![] };
        for &p in &task.portals {
            let mut cells = self.reached(might_see, std::iter::once(p));
            for (c, u) in cells.iter_mut().zip(cells_upper.row(task.cell)) {
                *c &= u;
            }
            let front = self.net.plane(p).map(|p| p.flipped());
            let mut goals = ObjectGoals::new(self.net, boxes, &undecided, &cells, front);
            let outcome = search.run(p, &mut goals);
            found.steps += outcome.steps;
            let mut seen: Vec<usize> = goals.found.iter().map(|&o| o as usize).collect();
            if outcome.capped {
                found.capped.push(p);
                seen.extend(bits::ones(&goals.wanted));
            }
            for o in seen {
                set(&mut found.seen, o);
                undecided[o / 64] &= !(1 << (o % 64));
            }
        }
        found
    }

    fn rounds(&self, might_see: &MightSee, cost: &[u64], active: impl Fn(usize) -> bool) -> Vec<Vec<Task>> {
        let mut order: Vec<usize> = (0..self.net.cells).filter(|&c| active(c)).collect();
        order.sort_by_key(|&c| (cost[c], c));
        let mut rounds: Vec<Vec<Task>> = (0..ROUNDS).map(|_| Vec::new()).collect();
        for (rank, &cell) in order.iter().enumerate() {
            let mut portals: Vec<usize> = self.net.out(cell).collect();
            portals.sort_by_key(|&p| (might_see.count(p), p));
            let chunks = portals.len().div_ceil(TASK_PORTALS);
            for (k, chunk) in portals.chunks(TASK_PORTALS).enumerate() {
                let r = if chunks == 1 { rank * ROUNDS / order.len() } else { k * ROUNDS / chunks };
                rounds[r].push(Task { cell, portals: chunk.to_vec() });
            }
        }
        rounds
    }
}
