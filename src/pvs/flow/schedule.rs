//! Which searches run side by side, and what they may know of each other.
//!
//! Portals of a cell are searched in ascending order of what they might see (cheap ones decide much of what dear ones would
//! search for; the other way round takes three times as long), in tasks of a few portals that share what they find. Tasks are
//! spread over a fixed number of rounds; between rounds everything is shared.

use super::might_see::MightSee;
use super::net::Net;
use super::search::Search;
use crate::job::{Job, Stopped};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Portals that one task searches from. Larger: more is shared at once, less runs side by side.
const TASK_PORTALS: usize = 16;

/// Number of rounds. Larger: more is shared, more time goes to sharing.
const ROUNDS: usize = 16;

/// Steps that all searches of a stage together are meant to take: so many times the most that one may take, or so many for each
/// portal, whichever is more.
const STAGE_STEPS: u64 = 125;
const PORTAL_STEPS: u64 = 1000;

/// Dear searches may take this many times the mean of what is left: most take next to nothing.
const DEAR: u64 = 32;

/// Searches out of one cell, one after the other.
pub(crate) struct Task {
    /// The cell.
    pub cell: usize,
    /// Directed portals out of it.
    pub portals: Vec<usize>,
    /// No later round has portals of this cell.
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

/// What all portals of a cell might see together: the cost of searching from it.
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

/// Steps that one search of round `k` may take, after `spent` steps in this stage. Where every search runs into its limit
/// (thousands of portals in the open, all in sight of each other) the limit shrinks, so that the stage ends in time.
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
    /// All rounds, and which of them this is.
    pub rounds: &'r [Vec<Task>],
    pub k: usize,
    /// Steps that earlier rounds of the stage took, and the most that one search may take.
    pub spent: u64,
    pub max_steps: u64,
}

/// Runs the tasks of a round side by side; results are in the order of the tasks. Tells the fraction of all rounds that is done.
pub(crate) fn run<F: Serialize + DeserializeOwned + Send>(
    Round { stage, rounds, k, spent, max_steps }: Round<'_>,
    (net, might_see): (&Net, &MightSee),
    search: impl Fn(&mut Search<'_>, &Task) -> F + Sync,
    work: &Job<'_>,
) -> Result<Vec<F>, Stopped> {
    let round = &rounds[k];
    let max_steps = limit(max_steps, rounds, k, spent);
    let scratch = || Search::new(net, might_see, max_steps);
    // The dearest first, so that no thread is left with one of them at the end.
    let tasks: Vec<&Task> = round.iter().rev().collect();
    let share = |done: usize| (k as f64 + done as f64 / tasks.len() as f64) / rounds.len() as f64;
    let search = |memory: &mut Search<'_>, task: &&Task| search(memory, task);
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
        assert_eq!((limit(20_000, &many, 0, 0), limit(20_000, &many, 1, 11_625_000)), (20_000, 32 * 62));
    }
}
