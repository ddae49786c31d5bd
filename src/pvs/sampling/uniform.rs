//! The baselines for the other strategies: random rays, and cubes at random points. Cells take turns; points are uniform in a cell.

use super::cast::{COST, Caster, Stand};
use super::region::Region;
use super::sampler::{Random, Sampler, Site, mix};
use super::source::{Part, Source};
use super::witness::{Found, Line, Witnessed};
use crate::CellId;
use crate::job::Stopped;
use crate::math::parallel;

/// Rays between two updates of the known pairs, and rays of one item; fixed, so that results do not depend on the number of threads.
const RAYS: u64 = 16_384;
const SHARE: u64 = 256;
/// Cubes between two updates.
const CUBES: u64 = 64;

/// The cells' regions, for eyes.
pub(super) fn regions(sampler: &Sampler<'_>) -> Vec<Region> {
    parallel::map(&sampler.graph.cells, |cell| Region::new(&cell.pieces, sampler.near))
}

/// Random rays: each is a line with both halves.
pub(super) struct Rays<'a> {
    sampler: &'a Sampler<'a>,
    regions: &'a [Region],
    count: u64,
}

impl<'a> Rays<'a> {
    pub fn new(sampler: &'a Sampler<'a>, regions: &'a [Region]) -> Self {
        Self { sampler, regions, count: 0 }
    }
}

impl Source for Rays<'_> {
    fn step(&mut self, lower: &mut Witnessed, part: &Part<'_>) -> Result<bool, Stopped> {
        let end = lower.rays + part.rays;
        while end - lower.rays >= 2 && !self.regions.is_empty() {
            let batch = RAYS.min((end - lower.rays) / 2);
            let known = &*lower;
            let share = |&i: &u64| {
                let (mut found, mut line, mut crossings) = (Found::default(), Line::default(), Vec::new());
                for n in self.count + i * SHARE..self.count + batch.min((i + 1) * SHARE) {
                    let mut random = Random::new(mix(mix(self.sampler.seed, 0xc1), n));
                    let cell = (n % self.regions.len() as u64) as usize;
                    found.rays += 2;
                    if let Some(at) = self.regions[cell].draw(&mut random) {
                        line.direction = random.direction();
                        self.sampler.trace(Site::inside(CellId(cell as u32), at), &mut line, &mut crossings);
                        self.sampler.prover.line(&line, known, &mut found);
                    }
                }
                found.close()
            };
            let found = part.work.map(&(0..batch.div_ceil(SHARE)).collect::<Vec<_>>(), share)?;
            self.count += batch;
            found.into_iter().for_each(|found| {
                lower.merge(found);
            });
        }
        Ok(!self.regions.is_empty())
    }
}

/// Cubes at random points.
pub(super) struct Uniform<'a, 'c> {
    sampler: &'a Sampler<'a>,
    caster: &'a Caster<'c>,
    regions: &'a [Region],
    count: u64,
}

impl<'a, 'c> Uniform<'a, 'c> {
    pub fn new(sampler: &'a Sampler<'a>, caster: &'a Caster<'c>, regions: &'a [Region]) -> Self {
        Self { sampler, caster, regions, count: 0 }
    }
}

impl Source for Uniform<'_, '_> {
    fn step(&mut self, lower: &mut Witnessed, part: &Part<'_>) -> Result<bool, Stopped> {
        let end = lower.rays + part.rays;
        let seats = self.regions.iter().filter(|r| r.volume() > 0.0).count();
        while end - lower.rays >= COST && seats > 0 {
            let batch = CUBES.min((end - lower.rays) / COST);
            let stand = |n: u64| {
                let seed = mix(mix(self.sampler.seed, 0xc2), n);
                let cell = (n % self.regions.len() as u64) as usize;
                let at = self.regions[cell].draw(&mut Random::new(mix(seed, 1)))?;
                Some(Stand { seed, site: Site::inside(CellId(cell as u32), at), tells: false })
            };
            let stands: Vec<Stand> = (self.count..self.count + batch).filter_map(stand).collect();
            self.count += batch;
            lower.cubes += stands.len() as u64;
            self.caster.cast(&stands, lower, part)?;
        }
        Ok(seats > 0)
    }
}
