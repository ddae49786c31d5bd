//! Order of searches, and exchange of results between them.
//!
//! Portals of a cell are searched in ascending order of the number of portals that they might see: cheap searches decide many goals of
//! expensive ones; the reverse order takes three times as long. A task has a few portals, which share results. Tasks are spread over a
//! fixed number of rounds; all results are shared between rounds.

use super::might_see::MightSee;
use super::net::Net;
use crate::job::{Job, Stopped};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Portals of one task. Larger: more sharing, less parallelism.
const TASK_PORTALS: usize = 16;

/// Number of rounds. Larger: more sharing, more time for it.
pub(crate) const ROUNDS: usize = 16;

/// Target for the total steps of a stage: a multiple of the limit of one search, or a number per portal, whichever is more.
const STAGE_STEPS: u64 = 125;
const PORTAL_STEPS: u64 = 1000;

/// Limit of one search, as a multiple of the mean of the remaining steps: most searches take almost none.
const DEAR: u64 = 32;

/// Consecutive searches out of one cell.
#[derive(Clone)]
pub(crate) struct Task {
    /// The cell.
    pub cell: usize,
    /// Directed portals out of it.
    pub portals: Vec<usize>,
    /// Whether no later round has portals of this cell.
    pub last: bool,
}

/// Counters.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Tally {
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

/// Search cost of each cell: the total number of portals that its portals might see.
pub(crate) fn costs(net: &Net, might_see: &MightSee) -> Vec<u64> {
    (0..net.cells).map(|c| net.out(c).map(|p| might_see.count(p)).sum()).collect()
}

/// Tasks for `cells`, by round.
pub(crate) fn rounds(net: &Net, might_see: &MightSee, cells: impl Iterator<Item = usize>) -> Vec<Vec<Task>> {
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

/// Step limit of one search in round `k`, after `spent` steps in this stage. If every search reaches its limit (thousands of portals in the
/// open, all in sight of each other), the limit shrinks, so that the stage ends in time.
fn limit(max_steps: u64, rounds: &[Vec<Task>], k: usize, spent: u64) -> u64 {
    let portals = |rounds: &[Vec<Task>]| rounds.iter().flatten().map(|task| task.portals.len() as u64).sum::<u64>();
    let all = max_steps.saturating_mul(STAGE_STEPS).max(portals(rounds).saturating_mul(PORTAL_STEPS.min(max_steps)));
    let left = all.saturating_sub(spent);
    (left / portals(&rounds[k..]).max(1)).saturating_mul(DEAR).min(max_steps)
}

/// A round of a stage.
pub(crate) struct Round<'r> {
    /// The stage's name, for progress.
    pub stage: &'r str,
    /// Number of rounds that come before, for progress.
    pub before: usize,
    /// All rounds, and the index of this one.
    pub rounds: &'r [Vec<Task>],
    pub k: usize,
    /// Steps of earlier rounds of the stage, and the step limit of one search.
    pub spent: u64,
    pub max_steps: u64,
}

/// Runs the tasks of a round in parallel; results are in the order of the tasks. Reports the fraction of all rounds done.
///
/// `scratch`: makes a thread's memory, for searches with a limit of steps.
pub(crate) fn run<S: Send, F: Serialize + DeserializeOwned + Send>(
    Round { stage, before, rounds, k, spent, max_steps }: Round<'_>,
    scratch: impl Fn(u64) -> S + Sync,
    search: impl Fn(&mut S, &Task) -> F + Sync,
    work: &Job<'_>,
) -> Result<Vec<F>, Stopped> {
    let round = &rounds[k];
    let max_steps = limit(max_steps, rounds, k, spent);
    let scratch = || scratch(max_steps);
    // The most expensive first, so that threads finish together.
    let tasks: Vec<&Task> = round.iter().rev().collect();
    let share = |done: usize| ((before + k) as f64 + done as f64 / tasks.len() as f64) / (before + rounds.len()) as f64;
    let search = |memory: &mut S, task: &&Task| search(memory, task);
    let mut found = work.map_with(&tasks, scratch, search, |done| work.tell(stage, share(done)))?;
    found.reverse();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_shrink_only_where_all_searches_are_dear() {
        let task = |portals| Task { cell: 0, portals: (0..portals).collect(), last: true };
        let few = [vec![task(16)], vec![task(16)]];
        assert_eq!((limit(1000, &few, 0, 0), limit(1000, &few, 1, 16_000), limit(0, &few, 0, 0)), (1000, 1000, 0));
        let many = [vec![task(6000)], vec![task(6000)]];
        assert_eq!(limit(200_000, &many, 0, 0), 32 * (125 * 200_000 / 12_000));
        assert_eq!(limit(200_000, &many, 1, 25_000_000), 0, "nothing left: what might be seen stays");
        // A thousand steps for each of 12,000 portals.
        assert_eq!((limit(40_000, &many, 0, 0), limit(40_000, &many, 1, 11_625_000)), (32 * 1000, 32 * 62));
    }
}
