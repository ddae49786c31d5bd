//! The upper bound of pairs of cells.

use super::goals::{CellGoals, Exact, Prover};
use super::might_see::{MightSee, from_rows, get, set, words_of};
use super::net::Net;
use super::schedule::{Round, Tally, Task, costs, rounds, run};
use super::search::Search;
use crate::BitMatrix;
use crate::job::{Job, Stopped};
use crate::math::bits;
use serde::{Deserialize, Serialize};

/// Pairs of cells and their state. All matrices are cells x cells.
pub struct Cells<'a> {
    net: &'a Net,
    max_steps: u64,
    /// Pairs of directed portals that are still possible.
    pub might_see: MightSee,
    /// Symmetric: pairs that see each other or are given up.
    pub settled: BitMatrix,
    /// Symmetric: pairs that don't see each other.
    pub hidden: BitMatrix,
    /// Pairs to search, each from one side.
    wanted: BitMatrix,
    rounds: Vec<Vec<Task>>,
    /// Counters.
    pub tally: Tally,
    /// Counters of exact tests.
    pub exact: Exact,
}

/// The result of one task.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Found<P> {
    /// Cells that the task's cell may see, or that are given up.
    pub settled: Vec<u32>,
    /// For each portal, cells that no line through it reaches.
    pub refuted: Vec<(u32, Vec<u32>)>,
    /// Lines.
    pub proofs: Vec<P>,
    /// Counters.
    pub tally: Tally,
    /// Counters of exact tests.
    pub exact: Exact,
}

impl<'a> Cells<'a> {
    /// Starts from might-see, and from pairs known to see each other, one way or both. Only pairs with at least one `own` cell are decided.
    pub fn new(
        net: &'a Net,
        might_see: MightSee,
        known: &BitMatrix,
        max_steps: u64,
        own: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let n = net.cells;
        let mut settled = BitMatrix::new(n, n);
        for i in 0..n {
            settled.set(i, i);
            let neighbours = net.out(i).map(|p| net.target[p] as usize);
            known.ones(i).chain(neighbours).for_each(|j| set_both(&mut settled, i, j));
        }
        // A pair is hidden if one cell cannot reach the other.
        let there = from_rows(n, n, || (), |(), i, row| row.copy_from_slice(&reached(net, &might_see, net.out(i))));
        let back = there.transposed();
        let hide = |i: usize, row: &mut [u64]| {
            for (word, mask) in words_of(0..n) {
                row[word] = mask & !(there.row(i)[word] & back.row(i)[word] | settled.row(i)[word]);
            }
        };
        let hidden = from_rows(n, n, || (), |(), i, row| hide(i, row));
        let mut all = Self {
            net,
            max_steps,
            might_see,
            settled,
            hidden,
            wanted: BitMatrix::new(n, n),
            rounds: Vec::new(),
            tally: Tally::default(),
            exact: Exact::default(),
        };
        all.might_see.drop_all_hidden(net, &all.hidden);
        let costs = costs(net, &all.might_see);
        let want = |i: usize, row: &mut [u64]| {
            let undecided = |j: &usize| !all.settled.get(i, *j) && !all.hidden.get(i, *j);
            let asked = |&j: &usize| (costs[i], i) < (costs[j], j) && (own(i) || own(j));
            (0..n).filter(asked).filter(undecided).for_each(|j| set(row, j));
        };
        all.wanted = from_rows(n, n, || (), |(), i, row| want(i, row));
        all.rounds = rounds(net, &all.might_see, (0..n).filter(|&c| all.wanted.count_row(c) > 0));
        all
    }

    /// Number of rounds.
    pub fn rounds(&self) -> usize {
        self.rounds.len()
    }

    /// Runs the tasks of round `k` in parallel. Results are in the order of the tasks.
    pub fn search<P: Prover>(
        &self,
        k: usize,
        prover: &P,
        stage: &str,
        work: &Job<'_>,
    ) -> Result<Vec<Found<P::Proof>>, Stopped> {
        let round = Round { stage, rounds: &self.rounds, k, spent: self.tally.steps, max_steps: self.max_steps };
        run(round, (self.net, &self.might_see), |search, task| self.search_from(search, task, prover, work), work)
    }

    /// Merges the results of round `k`.
    pub fn merge<P>(&mut self, k: usize, found: &[Found<P>]) {
        for (task, found) in self.rounds[k].iter().zip(found) {
            found.settled.iter().for_each(|&j| set_both(&mut self.settled, task.cell, j as usize));
            for (portal, cells) in &found.refuted {
                let mut row = vec![0; self.net.cells.div_ceil(64)];
                cells.iter().for_each(|&c| set(&mut row, c as usize));
                self.might_see.drop_into(self.net, *portal as usize, &row);
            }
            self.tally.add(&found.tally);
            self.exact.add(&found.exact);
        }
        let mut fresh = Vec::new();
        for i in self.rounds[k].iter().filter(|task| task.last).map(|task| task.cell) {
            for j in self.wanted.ones(i).filter(|&j| !self.settled.get(i, j)) {
                set_both(&mut self.hidden, i, j);
                fresh.push((i, j));
            }
        }
        self.might_see.drop_hidden(self.net, &fresh);
    }

    /// Searches from the portals of a task.
    fn search_from<P: Prover>(&self, search: &mut Search<'_>, task: &Task, prover: &P, work: &Job<'_>) -> Found<P::Proof> {
        let net = self.net;
        let rows = self.wanted.row(task.cell).iter().zip(self.settled.row(task.cell));
        let wanted: Vec<u64> = rows.map(|(wanted, settled)| wanted & !settled).collect();
        let (settled, refuted, proofs, tally, exact) = Default::default();
        let mut found = Found { settled, refuted, proofs, tally, exact };
        let mut goals = CellGoals::new(net, prover, wanted.clone());
        for &portal in &task.portals {
            if work.is_stopped() {
                break;
            }
            let outcome = search.run(portal, &mut goals);
            found.tally.steps += outcome.steps;
            if outcome.capped {
                found.tally.capped.insert(portal);
                bits::ones(&reached(net, &self.might_see, [portal])).for_each(|cell| goals.doubt(net, cell));
            } else if !net.out(task.cell).any(|back| get(self.might_see.row(portal), net.twin[back] as usize)) {
                // Chains that loop through the cell itself are not searched from this portal, so its refutation is complete only without
                // such loops.
                let mut cells = goals.wanted().to_vec();
                goals.doubtful().for_each(|c| cells[c / 64] &= !(1 << (c % 64)));
                found.refuted.push((portal as u32, bits::ones(&cells).map(|c| c as u32).collect()));
            }
        }
        let mut left = goals.wanted().to_vec();
        goals.doubtful().for_each(|c| left[c / 64] &= !(1 << (c % 64)));
        let settled: Vec<u64> = wanted.iter().zip(&left).map(|(a, b)| a & !b).collect();
        found.settled = bits::ones(&settled).map(|c| c as u32).collect();
        found.exact = goals.exact();
        found.proofs = goals.into_proofs();
        found
    }
}

/// Cells that lines through the given portals might reach, as bits.
pub fn reached(net: &Net, might_see: &MightSee, portals: impl IntoIterator<Item = usize>) -> Vec<u64> {
    let mut cells = vec![0; net.cells.div_ceil(64)];
    for portal in portals {
        set(&mut cells, net.target[portal] as usize);
        bits::ones(might_see.row(portal)).for_each(|q| set(&mut cells, net.target[q] as usize));
    }
    cells
}

/// Sets a pair in both directions.
pub(crate) fn set_both(matrix: &mut BitMatrix, i: usize, j: usize) {
    matrix.set(i, j);
    matrix.set(j, i);
}
