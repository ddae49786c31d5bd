//! Sampling towards an accuracy goal: rounds of sampling and of tests follow each other until a test bounds what is unseen.

use super::confidence::doubt_of;
use crate::job::{Job, Stopped};
use crate::types::bounds::{SamplingEnd, percent};

/// The first round has this many rays; each has twice those of the one before.
const FIRST: u64 = 500_000;
/// A goal is tested with this many rays over it, or all of a round: so many without a hit prove half of it.
const PROVING: f64 = 16.0;
/// Of the rays of a round, this fraction tests what is known.
const TESTED: f64 = 0.1;

/// Regions that are sampled and tested: cells, or view cells.
pub(in crate::pvs) trait Rounds {
    /// Rays so far.
    fn rays(&self) -> u64;
    /// Regions with rows.
    fn regions(&self) -> u64;
    /// Samples until there were `rays` rays in all. False if no strategy finds anything more.
    fn sample(&mut self, rays: u64, work: &Job<'_>) -> Result<bool, Stopped>;
    /// Tests each row with `rays` rays; the test may be wrong with probability `doubt`.
    fn test(&mut self, rays: u64, doubt: f64, work: &Job<'_>) -> Result<(), Stopped>;
    /// The bound on what is unseen, in the mean over regions.
    fn unseen(&self) -> f64;
}

/// Rounds of sampling, each with a test at its end, until that bounds the mean by `goal` or `budget` rays are cast.
pub(in crate::pvs) fn reach(
    goal: f64,
    budget: u64,
    rounds: &mut dyn Rounds,
    work: &Job<'_>,
) -> Result<SamplingEnd, Stopped> {
    for number in 0.. {
        let round = FIRST << number.min(40);
        // If nothing finds anything more, only fresh rays are left.
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
