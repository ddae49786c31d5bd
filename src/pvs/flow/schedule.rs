//! Which searches run side by side, and what they may know of each other.
//!
//! Portals of a cell are searched in ascending order of what they might see (cheap ones decide much of what dear ones would
//! search for; the other way round takes three times as long), in tasks of a few portals that share what they find. Tasks are
//! spread over a fixed number of rounds; between rounds everything is shared.

use super::might_see::MightSee;
use super::net::Net;
use super::search::Search;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Portals that one task searches from. Larger: more is shared at once, less runs side by side.
const TASK_PORTALS: usize = 16;

/// Number of rounds. Larger: more is shared, more time goes to sharing.
const ROUNDS: usize = 8;

/// Searches out of one cell, one after the other.
pub(super) struct Task {
    /// The cell.
    pub cell: usize,
    /// Directed portals out of it.
    pub portals: Vec<usize>,
    /// No later round has portals of this cell.
    pub last: bool,
}

/// What a task found.
pub(super) struct Found {
    /// Cells or objects that may be seen, as bits.
    pub seen: Vec<u64>,
    /// For a portal, cells that no line through it reaches, as bits.
    pub refuted: Vec<(usize, Vec<u64>)>,
    /// What it took.
    pub tally: Tally,
}

/// Counters.
#[derive(Default)]
pub(super) struct Tally {
    /// Steps of searches.
    pub steps: u64,
    /// Directed portals whose search ran out of steps.
    pub capped: BTreeSet<usize>,
}

impl Tally {
    /// Adds another's.
    pub fn add(&mut self, other: &Self) {
        self.steps += other.steps;
        self.capped.extend(&other.capped);
    }
}

/// What all portals of a cell might see together: the cost of searching from it.
pub(super) fn costs(net: &Net, might_see: &MightSee) -> Vec<u64> {
    (0..net.cells).map(|c| net.out(c).map(|p| might_see.count(p)).sum()).collect()
}

/// Tasks for `cells`, by round.
pub(super) fn rounds(net: &Net, might_see: &MightSee, cells: impl Iterator<Item = usize>) -> Vec<Vec<Task>> {
    let costs = costs(net, might_see);
    let mut order: Vec<usize> = cells.filter(|&c| !net.out(c).is_empty()).collect();
    order.sort_by_key(|&c| (costs[c], c));
    let mut rounds: Vec<Vec<Task>> = (0..ROUNDS).map(|_| Vec::new()).collect();
    for (rank, &cell) in order.iter().enumerate() {
        let mut portals: Vec<usize> = net.out(cell).collect();
        portals.sort_by_key(|&p| (might_see.count(p), p));
        let tasks = portals.len().div_ceil(TASK_PORTALS);
        for (k, portals) in portals.chunks(TASK_PORTALS).enumerate() {
            let round = |k: usize| if tasks == 1 { rank * ROUNDS / order.len() } else { k * ROUNDS / tasks };
            rounds[round(k)].push(Task { cell, portals: portals.to_vec(), last: round(k) == round(tasks - 1) });
        }
    }
    rounds.retain(|round| !round.is_empty());
    rounds
}

/// Runs the tasks of one round side by side; results are in the order of the tasks.
pub(super) fn run(
    round: &[Task],
    net: &Net,
    might_see: &MightSee,
    max_steps: u64,
    search: impl Fn(&mut Search<'_>, &Task) -> Found + Sync,
) -> Vec<Found> {
    let scratch = || Search::new(net, might_see, max_steps);
    round.par_iter().with_max_len(1).map_init(scratch, |scratch, task| search(scratch, task)).collect()
}
