//! Sampling towards an accuracy goal: rounds of sampling and tests alternate until a test bounds the unseen part.

use super::confidence::doubt_of;
use crate::job::{Job, Stopped};
use crate::types::bounds::{SamplingEnd, percent};

/// Rays of the first round; each round has twice those of the previous one.
const FIRST: u64 = 500_000;
/// Rays of a test, as a multiple of 1 / goal, at most those of a round: this many without a hit prove half of the goal.
const PROVING: f64 = 16.0;
/// Share of a round's rays for its test.
const TESTED: f64 = 0.1;

/// Sampled and tested regions: cells, or view cells.
pub(in crate::pvs) trait Rounds {
    /// Rays so far.
    fn rays(&self) -> u64;
    /// Regions with rows.
    fn regions(&self) -> u64;
    /// Samples until `rays` rays in all. False if no strategy finds anything more.
    fn sample(&mut self, rays: u64, work: &Job<'_>) -> Result<bool, Stopped>;
    /// Tests each row with `rays` rays, with the allowed error `doubt`.
    fn test(&mut self, rays: u64, doubt: f64, work: &Job<'_>) -> Result<(), Stopped>;
    /// The bound of the unseen part, in the mean over regions.
    fn unseen(&self) -> f64;
}

/// Runs rounds of sampling, each with a test at its end, until the test bounds the mean by `goal` or `budget` rays are cast.
pub(in crate::pvs) fn reach(
    goal: f64,
    budget: u64,
    rounds: &mut dyn Rounds,
    work: &Job<'_>,
) -> Result<SamplingEnd, Stopped> {
    for number in 0.. {
        let round = FIRST << number.min(40);
        // If no strategy finds anything more, all rays test.
        let part = if rounds.sample((rounds.rays() + round).min(budget), work)? { TESTED } else { 1.0 };
        let proving = (PROVING / goal).min(round as f64);
        let rays = ((round as f64 * part).max(proving) as u64).min(budget.saturating_sub(rounds.rays()));
        let each = rays / rounds.regions().max(1);
        if each > 0 {
            rounds.test(each, doubt_of(number), work)?;
        }
        let unseen = rounds.unseen();
        work.tell(&format!("unseen {}", percent(unseen)), (goal / unseen).min(1.0));
        if unseen <= goal {
            return Ok(SamplingEnd::Unseen);
        }
        if each == 0 || rounds.regions() == 0 {
            break;
        }
    }
    Ok(SamplingEnd::Rays)
}
