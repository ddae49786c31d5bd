//! Guided rays, at the borders of found objects.
//!
//! Based on: Wonka, Wimmer, Zhou, Maierhofer, Hesina, Reshetov, *Guided visibility sampling*, 2006: the next new object is likely beside
//! the last one, so rays go past the corners of the triangle that was hit (border samples); if a blocker stops such a ray early, a line
//! past the blocker's edge shows what is visible from elsewhere in the cell (reverse samples). Deviations: only proofs are followed up, not
//! every triangle, because sets are of objects; the offset of corners is random over three orders of magnitude, because the distance to the
//! next object has no scale; and a reverse sample is the whole line, which serves all cells along it.

use super::sampler::{Random, Sampler, Site, mix};
use super::source::{Part, Source};
use super::witness::{Found, Line, Witnessed};
use crate::PortalId;
use crate::job::Stopped;
use crate::scene::rays::Hit;
use crate::types::proof::Witness;
use glam::DVec3;

/// Least number of proofs per update of the known pairs.
const LEAST: u64 = 256;
/// Most items of a map: with more proofs, an item has several, because a proof takes only some ten microseconds.
const MOST_ITEMS: usize = 1 << 14;
/// Most rays to follow up a proof: the triangle, three borders, and three edges of each blocker.
const COST: u64 = 1 + 3 * (2 + 3 * 2);
/// Most times that a proof is followed up.
const PASSES: u64 = 64;
/// Smallest and largest offset of corners, as a fraction of their distance from the triangle's centre.
const OUT: [f64; 2] = [1e-3, 1.0];
/// A ray is blocked if it ends before this fraction of its length.
const SHORT: f64 = 0.98;

pub(super) struct Guided<'a> {
    sampler: &'a Sampler<'a>,
    /// The first proof without a follow-up.
    fresh: usize,
    /// The next proof to follow up again, and the number of passes.
    next: usize,
    pass: u64,
    /// Number of follow-ups, and their rays.
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

    /// At most `count` next proofs to follow up, each with its pass: first new ones, then the others in turn. Empty if all had all their
    /// passes.
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
            // In any direction in the triangle's plane, so that rays pass edges as well as corners.
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
            // Mean cost of a follow-up so far; one may cost more.
            let cost = self.spent.checked_div(self.followed).map_or(COST, |cost| cost.clamp(1, COST));
            let (left, known) = (part.rays.saturating_sub(lower.rays - begin), &*lower);
            let proofs = (left / cost).min((begin + part.most - lower.rays) / COST);
            // A small rest is not worth a map.
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
