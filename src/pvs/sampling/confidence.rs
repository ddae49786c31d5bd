//! Confidence bound of the unseen part, by rays that had no part in building the rows.
//!
//! The unseen part of a region is the probability that a ray from a random point, in a random direction, shows an object that is not in the
//! region's row: the mean, over its points, of the solid angle (fraction of the sphere) of missing objects. Fresh rays are independent of
//! the row, so the number of hits on missing objects has a binomial distribution, and the bound of Clopper and Pearson holds (*The use of
//! confidence or fiducial limits illustrated in the case of the binomial*, 1934), however the row was found; after *n* rays without a hit
//! it is about 3 / *n*. Hits are then added to the row, which lowers the unseen part; so the next test, with twice the rays, may give a
//! better bound. Each test takes its share of the allowed error (Bonferroni), and the least bound counts. The Good-Turing estimate needs no
//! extra rays, but holds only for rows found by independent rays, which guided and adaptive samples are not.
//!
//! The bound of a mean over regions with equally many rays each follows from the same formula: the sum then has no larger variance than a
//! binomial one with the same mean (Hoeffding, *On the distribution of the number of successes in independent trials*, 1956).

use super::region::Region;
use super::sampler::{Random, Sampler, Site, mix};
use super::witness::{Found, Line, Witnessed};
use crate::CellId;
use crate::job::{Job, Stopped};
use crate::scene::rays::{Hit, RayScene};
use crate::types::bounds::{CONFIDENCE, Unseen};
use glam::DVec3;

/// Relative accuracy of a bound.
const CLOSE: f64 = 1e-9;

/// Relative size below which a term no longer changes a sum.
const NOTHING: f64 = 1e-17;

/// Number of tests with a fixed total of rays; each has twice the rays of the previous one.
const LOOKS: u32 = 3;

/// Allowed error of one of [`LOOKS`] tests.
pub(in crate::pvs) const DOUBT: f64 = (1.0 - CONFIDENCE) / LOOKS as f64;

/// The least bound over several tests.
#[derive(Clone, Copy)]
pub(in crate::pvs) struct Bound(pub f64);

impl Bound {
    /// No test yet.
    pub const NONE: Self = Self(1.0);

    /// Adds one test, which may be wrong with probability `doubt`.
    pub fn look(&mut self, hits: u64, rays: u64, doubt: f64) {
        self.0 = self.0.min(upper_bound(hits, rays, doubt));
    }
}

/// Allowed error of test `number` of an unknown number of tests: 1/2, 1/6, 1/12, ... of the total, which add up to one.
pub(in crate::pvs) fn doubt_of(number: u32) -> f64 {
    (1.0 - CONFIDENCE) / (f64::from(number + 1) * f64::from(number + 2))
}

/// Rays of each test, of `rays` in all.
pub(in crate::pvs) fn looks(rays: u64) -> impl Iterator<Item = u64> {
    (0..LOOKS).map(move |look| (rays << look) / ((1 << LOOKS) - 1)).filter(|&rays| rays > 0)
}

/// Casts `count` rays from random points of a region; counts those that show an object not in `row`, and passes them to `missed` with their
/// hits. `None` if the region is empty.
pub(in crate::pvs) fn look(
    rays: &RayScene<'_>,
    draw: &dyn Fn(&mut Random) -> Option<DVec3>,
    row: &[u64],
    count: u64,
    random: &mut Random,
    missed: &mut dyn FnMut(DVec3, DVec3, Hit),
) -> Option<u64> {
    let bounds = rays.bounds();
    let (mut hits, mut passes) = (0, Vec::new());
    for _ in 0..count {
        let from = draw(random)?;
        let direction = random.direction();
        let reach = bounds.with(from).diagonal();
        let end = rays.first_opaque(from, direction, reach);
        passes.clear();
        rays.see_through(from, direction, end.map_or(reach, |hit| hit.t), &mut passes);
        let unknown = |hit: &Hit| row[hit.object.index() / 64] >> (hit.object.index() % 64) & 1 == 0;
        let mut shown = passes.iter().copied().chain(end).filter(unknown).peekable();
        hits += u64::from(shown.peek().is_some());
        shown.for_each(|hit| missed(from, direction, hit));
    }
    Some(hits)
}

/// Bounds of the unseen parts, test by test.
pub(super) struct Test<'a> {
    sampler: &'a Sampler<'a>,
    regions: &'a [Region],
    mean: Bound,
    cells: Vec<Bound>,
    /// Tests so far.
    looks: u32,
}

impl<'a> Test<'a> {
    /// No test yet.
    pub fn new(sampler: &'a Sampler<'a>, regions: &'a [Region]) -> Self {
        Self { sampler, regions, mean: Bound::NONE, cells: vec![Bound::NONE; regions.len()], looks: 0 }
    }

    /// Tests `lower` three times, with about `budget` rays in all.
    pub fn look_thrice(&mut self, budget: u64, lower: &mut Witnessed, work: &Job<'_>) -> Result<(), Stopped> {
        for count in looks(budget / self.regions.len().max(1) as u64) {
            self.look(count, DOUBT, lower, work)?;
            work.tell("unseen", f64::from(self.looks) / f64::from(LOOKS));
        }
        Ok(())
    }

    /// Tests `lower` with `count` rays from each cell, with the allowed error `doubt`; adds hits to the rows.
    pub fn look(&mut self, count: u64, doubt: f64, lower: &mut Witnessed, work: &Job<'_>) -> Result<(), Stopped> {
        let (sampler, regions, number, known) = (self.sampler, self.regions, self.looks, &*lower);
        let from_cell = |&c: &usize| {
            let (mut found, mut line, mut crossings) = (Found::default(), Line::default(), Vec::new());
            let mut random = Random::new(mix(mix(sampler.seed, 0xd1 << 8 | u64::from(number)), c as u64));
            let mut missed = |from: DVec3, direction: DVec3, _: Hit| {
                line.direction = direction;
                sampler.trace(Site::inside(CellId(c as u32), from), &mut line, &mut crossings);
                sampler.prover.line(&line, known, &mut found);
            };
            let hits = look(
                sampler.prover.rays,
                &|random| regions[c].draw(random),
                known.objects.row(c),
                count,
                &mut random,
                &mut missed,
            );
            found.rays = count;
            (hits, found.close())
        };
        let results = work.map(&(0..regions.len()).collect::<Vec<_>>(), from_cell)?;
        let (mut all, mut hit) = (0, 0);
        for ((hits, found), bound) in results.into_iter().zip(&mut self.cells) {
            lower.merge(found);
            if let Some(hits) = hits {
                bound.look(hits, count, doubt);
                (all, hit) = (all + count, hit + hits);
            }
        }
        self.mean.look(hit, all, doubt);
        self.looks += 1;
        Ok(())
    }

    /// Number of cells.
    pub fn regions(&self) -> usize {
        self.regions.len()
    }

    /// The bound of the mean over all cells.
    pub fn mean(&self) -> f64 {
        self.mean.0
    }

    /// All bounds; `None` before the first test.
    pub fn close(self) -> Option<Unseen> {
        let cells = self.cells.into_iter().map(|bound| (bound.0 as f32).next_up().min(1.0)).collect();
        (self.looks > 0).then_some(Unseen { mean: self.mean.0, cells })
    }
}

/// The upper end of the Clopper-Pearson interval: the greatest success probability at which `hits` or fewer of `rays` independent trials
/// succeed with probability `alpha` or more. 1 without trials.
pub fn upper_bound(hits: u64, rays: u64, alpha: f64) -> f64 {
    if hits >= rays {
        return 1.0;
    }
    // The logarithm of the probability of `hits` or fewer: the last term, times the sum of all terms relative to it.
    let (n, k) = (rays as f64, hits as f64);
    let choose: f64 = (1..=hits).map(|i| ((n - k + i as f64) / i as f64).ln()).sum();
    let log_chance = |p: f64| {
        let (mut term, mut sum) = (1.0, 1.0);
        for i in (1..=hits).rev() {
            let i = i as f64;
            term *= i * (1.0 - p) / ((n - i + 1.0) * p);
            sum += term;
            if term < NOTHING * sum {
                break;
            }
        }
        choose + k * p.ln() + (n - k) * (-p).ln_1p() + f64::ln(sum)
    };
    // It decreases with `p`; the upper end of the last interval is conservative.
    let (mut low, mut high) = (k / n, 1.0);
    while high - low > CLOSE * high {
        let middle = 0.5 * (low + high);
        if log_chance(middle) >= alpha.ln() { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_those_of_the_binomial_distribution() {
        // No success in n trials: 1 - alpha^(1/n). All but one: (1 - alpha)^(1/n) of the lower end, mirrored.
        for n in [1u64, 2, 10, 1000, 1_000_000] {
            let exact = 1.0 - 0.05f64.powf(1.0 / n as f64);
            assert!((upper_bound(0, n, 0.05) / exact - 1.0).abs() < 1e-7, "{n}");
        }
        for n in [2u64, 10, 50] {
            let exact = 0.95f64.powf(1.0 / n as f64);
            assert!((upper_bound(n - 1, n, 0.05) - exact).abs() < 1e-7, "{n}");
        }
        // Compared with direct sums of the terms.
        for (k, n) in [(1u64, 10u64), (3, 20), (7, 200), (40, 100)] {
            let p = upper_bound(k, n, 0.05);
            let mut term = (1.0 - p).powi(n as i32);
            let mut sum = term;
            for i in 1..=k {
                term *= (n - i + 1) as f64 / i as f64 * p / (1.0 - p);
                sum += term;
            }
            assert!((sum - 0.05).abs() < 1e-6, "{k} of {n}: {sum}");
        }
        assert_eq!((upper_bound(0, 0, 0.05), upper_bound(5, 5, 0.05)), (1.0, 1.0));
        assert!(upper_bound(100_000, 1_000_000, 0.05) > 0.1 && upper_bound(100_000, 1_000_000, 0.05) < 0.101);
    }

    #[test]
    fn looks_share_the_rays() {
        assert_eq!(looks(700).collect::<Vec<_>>(), [100, 200, 400]);
        assert_eq!(looks(1).collect::<Vec<_>>(), [] as [u64; 0]);
        assert_eq!(looks(2).collect::<Vec<_>>(), [1]);
    }
}
