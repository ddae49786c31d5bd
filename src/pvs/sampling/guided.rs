//! Rays at the borders of what was found.
//!
//! Based on: Wonka, Wimmer, Zhou, Maierhofer, Hesina, Reshetov, *Guided visibility sampling*, 2006: where a ray found something, the
//! next thing is likely beside it, so rays go to the corners of the triangle that it met, moved out a little (border samples); and where such
//! a ray is stopped short, a line past the edge of what stopped it shows what can be seen from somewhere else in the cell (reverse
//! samples). Deviations: only proofs are followed up, not every triangle, since the sets are of objects; how far corners are
//! moved out is drawn anew each time, over three orders of magnitude, since the distance to the next thing has no scale; and a reverse
//! sample is the whole line, which serves whatever cells it comes through.

use super::sampler::{Random, Sampler, Site, mix};
use super::source::{Part, Source};
use super::witness::{Found, Line, Witnessed};
use crate::PortalId;
use crate::job::Stopped;
use crate::scene::rays::Hit;
use crate::types::proof::Witness;
use glam::DVec3;

/// Proofs followed up between two looks at what is known, at least.
const LEAST: u64 = 256;
/// Items of a map at most: more proofs are followed up some at a time, since a proof takes no more than some ten microseconds.
const MOST_ITEMS: usize = 1 << 14;
/// Rays that following up a proof takes at most: the triangle, three borders, and three edges of whatever is before each.
const COST: u64 = 1 + 3 * (2 + 3 * 2);
/// Times that a proof is followed up.
const PASSES: u64 = 64;
/// Corners are moved out by this fraction of their distance from the triangle's middle, at least and at most.
const OUT: [f64; 2] = [1e-3, 1.0];
/// A ray stopped before this fraction of the way is stopped short.
const SHORT: f64 = 0.98;

pub(super) struct Guided<'a> {
    sampler: &'a Sampler<'a>,
    /// The first proof that nobody has followed up yet.
    fresh: usize,
    /// The next proof to follow up again, and how often all before it were.
    next: usize,
    pass: u64,
    /// Proofs followed up, and the rays that this took.
    followed: u64,
    spent: u64,
}

impl<'a> Guided<'a> {
    pub fn new(sampler: &'a Sampler<'a>) -> Self {
        Self { sampler, fresh: 0, next: 0, pass: 1, followed: 0, spent: 0 }
    }

    /// Border and reverse samples of one proof.
    fn follow(&self, witness: &Witness, seed: u64, known: &Witnessed) -> Found {
        let (mut random, mut found) = (Random::new(seed), Found::default());
        let rays = self.sampler.prover.rays;
        let (mut line, mut crossings) = (Line::default(), Vec::new());
        let way = witness.to - witness.from;
        let length = way.length();
        found.rays = 1;
        let met =
            rays.first_opaque(witness.from, way / length, length * (1.0 + 1e-9)).filter(|hit| hit.object == witness.object);
        let Some(Hit { triangle, .. }) = met else { return found.close() };
        let site = Site::inside(witness.cell, witness.from);
        for border in self.borders(triangle, &mut random) {
            let Some(direction) = (border - witness.from).try_normalize() else { continue };
            self.line(site, direction, known, &mut line, &mut crossings, &mut found);
            let distance = border.distance(witness.from);
            let Some(stop) = line.ends[1].filter(|hit| hit.t < SHORT * distance) else { continue };
            for past in self.borders(stop.triangle, &mut random) {
                let Some((cell, _)) = self.sampler.prover.locator.locate(past) else { continue };
                let Some(direction) = (border - past).try_normalize() else { continue };
                self.line(Site::inside(cell, past), direction, known, &mut line, &mut crossings, &mut found);
            }
        }
        found.close()
    }

    /// The next proofs to follow up, each with its pass, at most so many: those that nobody has, and then the others in
    /// turn. None where each had all its passes.
    fn next_proofs(&mut self, count: usize, known: &Witnessed) -> Vec<(usize, u64)> {
        let fresh = self.fresh..known.witnesses.len().min(self.fresh + count);
        self.fresh = fresh.end;
        let mut proofs: Vec<(usize, u64)> = fresh.map(|i| (i, 0)).collect();
        while proofs.len() < count && self.fresh > 0 {
            if self.next >= self.fresh {
                (self.next, self.pass) = (0, self.pass + 1);
            }
            if self.pass > PASSES {
                break;
            }
            proofs.push((self.next, self.pass));
            self.next += 1;
        }
        proofs
    }

    /// The corners of a triangle, moved out.
    fn borders(&self, triangle: u32, random: &mut Random) -> [DVec3; 3] {
        let corners = self.sampler.prover.rays.scene().corners(triangle as usize);
        let middle = corners.iter().sum::<DVec3>() / 3.0;
        corners.map(|corner| {
            // By any angle in the triangle's plane between two corners, so that edges are passed as well as corners.
            let along = corners[(random.bits() % 3) as usize];
            let on_edge = corner.lerp(along, random.unit());
            on_edge + (on_edge - middle) * (OUT[0] * (OUT[1] / OUT[0]).powf(random.unit()))
        })
    }

    fn line(
        &self,
        site: Site,
        direction: DVec3,
        known: &Witnessed,
        line: &mut Line,
        crossings: &mut Vec<(f64, PortalId)>,
        found: &mut Found,
    ) {
        line.direction = direction;
        self.sampler.trace(site, line, crossings);
        found.rays += 2;
        self.sampler.prover.line(line, known, found);
    }
}

impl Source for Guided<'_> {
    fn step(&mut self, lower: &mut Witnessed, part: &Part<'_>) -> Result<bool, Stopped> {
        let (begin, mut is_first) = (lower.rays, true);
        loop {
            // What a proof took so far, in the mean; one may take more.
            let cost = self.spent.checked_div(self.followed).map_or(COST, |cost| cost.clamp(1, COST));
            let (left, known) = (part.rays.saturating_sub(lower.rays - begin), &*lower);
            let proofs = (left / cost).min((begin + part.most - lower.rays) / COST);
            // A rest of a part isn't worth a map.
            if proofs == 0 || (!is_first && left < (LEAST * cost).max(part.rays / 2)) {
                return Ok(true);
            }
            let todo = self.next_proofs(proofs as usize, known);
            if todo.is_empty() {
                return Ok(false);
            }
            let seed = |i: usize, pass: u64| mix(mix(mix(self.sampler.seed, 0xc3), i as u64), pass);
            let follow = |&(i, pass): &(usize, u64)| self.follow(&known.witnesses[i], seed(i, pass), known);
            let items: Vec<&[(usize, u64)]> = todo.chunks(todo.len().div_ceil(MOST_ITEMS)).collect();
            let done = |count: usize| part.tell(count as f64 / items.len() as f64);
            let follow = |(): &mut (), some: &&[(usize, u64)]| some.iter().map(follow).collect();
            let found: Vec<Vec<Found>> = part.work.map_with(&items, || (), follow, done)?;
            let before = lower.rays;
            found.into_iter().flatten().for_each(|found| {
                lower.merge(found);
            });
            self.followed += todo.len() as u64;
            self.spent += lower.rays - before;
            is_first = false;
        }
    }
}
