//! The upper bound of pairs of cells.

use super::goals::{CellGoals, Exact, Prover};
use super::might_see::{MightSee, from_rows, get, set, words_of};
use super::net::Net;
use super::schedule::{ROUNDS, Round, Tally, Task, costs, rounds, run};
use super::search::Search;
use super::shafts::{Shafts, Ways, before_cells};
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
    /// Tasks by round: first of shafts, then of searches.
    shafts: Vec<Vec<Task>>,
    searches: Vec<Vec<Task>>,
    /// Rounds done.
    done: usize,
    /// Counters.
    pub tally: Tally,
    /// Counters of exact tests.
    pub exact: Exact,
}

/// Rounds of shafts. Larger: more sharing of lines and hidden pairs, more time for it.
const SHAFT_ROUNDS: usize = 8;

/// The result of one task.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Found<P> {
    /// Cells that the task's cell may see, or that are given up.
    pub settled: Vec<u32>,
    /// Cells that it does not see, by a shaft.
    pub hidden: Vec<u32>,
    /// For each portal, cells that no line through it reaches.
    pub refuted: Vec<(u32, Vec<u32>)>,
    /// Lines.
    pub proofs: Vec<P>,
    /// Counters.
    pub tally: Tally,
    /// Counters of exact tests.
    pub exact: Exact,
}

impl<P> Found<P> {
    fn new() -> Self {
        let (settled, hidden, refuted, proofs, tally, exact) = Default::default();
        Self { settled, hidden, refuted, proofs, tally, exact }
    }
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
            shafts: Vec::new(),
            searches: Vec::new(),
            done: 0,
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
        let mut cells: Vec<usize> = (0..n).filter(|&c| all.wanted.count_row(c) > 0).collect();
        cells.sort_by_key(|&c| (costs[c], c));
        let task = |&cell: &usize| Task { cell, portals: Vec::new(), last: false };
        let chunk = cells.len().div_ceil(SHAFT_ROUNDS).max(1);
        all.shafts = cells.chunks(chunk).map(|cells| cells.iter().map(task).collect()).collect();
        all.plan();
        all
    }

    /// Orders the searches, once shafts are done.
    fn plan(&mut self) {
        if self.done == self.shafts.len() {
            let cells = (0..self.net.cells).filter(|&c| self.wanted.ones(c).any(|j| self.is_open(c, j)));
            self.searches = rounds(self.net, &self.might_see, cells);
        }
    }

    /// True if a pair is undecided.
    fn is_open(&self, i: usize, j: usize) -> bool {
        !self.settled.get(i, j) && !self.hidden.get(i, j)
    }

    /// Runs the tasks of the next round in parallel. Results are in the order of the tasks. `None` after the last round.
    pub fn next<P: Prover>(&self, prover: &P, stage: &str, work: &Job<'_>) -> Result<Option<Vec<Found<P::Proof>>>, Stopped> {
        let before = before_cells(self.net, &self.might_see, &self.goals_of_round());
        let shafts = || Shafts::new(self.net, &self.might_see, &before);
        if let Some(round) = self.shafts.get(self.done) {
            let rounds = (self.shafts.len() + ROUNDS) as f64;
            let tell = |done: usize| work.tell(stage, (self.done as f64 + done as f64 / round.len() as f64) / rounds);
            let ask = |shafts: &mut Shafts<'_>, task: &Task| self.ask_shafts(shafts, task.cell, prover, work);
            return work.map_with(round, shafts, ask, tell).map(Some);
        }
        let k = self.done - self.shafts.len();
        if k >= self.searches.len() {
            return Ok(None);
        }
        let round = Round {
            stage,
            before: self.shafts.len(),
            rounds: &self.searches,
            k,
            spent: self.tally.steps,
            max_steps: self.max_steps,
        };
        let scratch = |max_steps| (Search::new(self.net, &self.might_see, max_steps), shafts(), Ways::default());
        run(round, scratch, |memory, task| self.search_from(memory, task, prover, work), work).map(Some)
    }

    /// The cells that the next round asks about, as bits.
    fn goals_of_round(&self) -> Vec<u64> {
        let mut goals = vec![0; self.net.cells.div_ceil(64)];
        for cell in self.round().iter().map(|task| task.cell) {
            let rows = [&self.wanted, &self.settled, &self.hidden].map(|matrix| matrix.row(cell));
            for (i, goal) in goals.iter_mut().enumerate() {
                *goal |= rows[0][i] & !(rows[1][i] | rows[2][i]);
            }
        }
        goals
    }

    /// The tasks of the next round; none after the last.
    fn round(&self) -> &[Task] {
        self.shafts.iter().chain(&self.searches).nth(self.done).map_or(&[], |round| round)
    }

    /// Merges the results of the round.
    pub fn merge<P>(&mut self, found: &[Found<P>]) {
        let round = self.round().to_vec();
        self.done += 1;
        for (task, found) in round.iter().zip(found) {
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
        for (task, found) in round.iter().zip(found) {
            let i = task.cell;
            fresh.extend(found.hidden.iter().map(|&j| (i, j as usize)));
            if task.last {
                fresh.extend(self.wanted.ones(i).filter(|&j| self.is_open(i, j)).map(|j| (i, j)));
            }
        }
        for &(i, j) in &fresh {
            set_both(&mut self.hidden, i, j);
        }
        self.might_see.drop_hidden(self.net, &fresh);
        self.plan();
    }

    /// Asks shafts from a cell, and aims lines where they leave a pair open.
    fn ask_shafts<P: Prover>(&self, shafts: &mut Shafts<'_>, cell: usize, prover: &P, work: &Job<'_>) -> Found<P::Proof> {
        let mut found = Found::new();
        let mut seen = vec![0; self.net.cells.div_ceil(64)];
        let mut cells = Vec::new();
        shafts.start(cell);
        for goal in self.wanted.ones(cell) {
            if work.is_stopped() {
                break;
            }
            if get(&seen, goal) || !self.is_open(cell, goal) {
                continue;
            }
            if !shafts.reach(goal) {
                found.hidden.push(goal as u32);
                continue;
            }
            let [from, to] = &shafts.ends;
            for k in 0..prover.tries() {
                let p = from[k as usize % from.len()] as usize;
                let q = to[(k as usize / from.len()) % to.len()] as usize;
                if p != q && !get(self.might_see.row(p), q) {
                    continue;
                }
                cells.clear();
                if let Some(proof) = prover.aim(p, q, k, &mut cells) {
                    cells.iter().for_each(|&c| set(&mut seen, c as usize));
                    found.proofs.push(proof);
                    break;
                }
            }
        }
        found
    }

    /// Searches from the portals of a task, for cells to which shafts leave ways.
    fn search_from<P: Prover>(
        &self,
        (search, shafts, ways): &mut (Search<'_>, Shafts<'_>, Ways),
        task: &Task,
        prover: &P,
        work: &Job<'_>,
    ) -> Found<P::Proof> {
        let net = self.net;
        let mut found = Found::new();
        let mut wanted = vec![0; net.cells.div_ceil(64)];
        shafts.start(task.cell);
        ways.clear();
        for goal in self.wanted.ones(task.cell).filter(|&goal| self.is_open(task.cell, goal)) {
            if shafts.reach(goal) {
                ways.add(shafts, goal);
                set(&mut wanted, goal);
            } else {
                found.hidden.push(goal as u32);
            }
        }
        let mut goals = CellGoals::new(net, prover, wanted.clone()).along(ways);
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
