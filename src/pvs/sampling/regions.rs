//! The lower bound of view cells: regions that may lie across cells.
//!
//! First the witnesses of cells that begin in a region; then rays from it in random directions; then segments tried at the pairs that flow
//! left undecided, from random points of the region, and through random points of portals, where the small are as likely as the large:
//! behind a keyhole, a line through the keyhole is the only one.

use super::aimed;
use super::confidence::{Bound, DOUBT, look, looks};
use super::region::Region;
use super::sampler::{Random, mix};
use super::witness::Prover;
use crate::cells::{Piece, ViewCell};
use crate::geom::{Aabb, middle};
use crate::job::{Job, Stopped};
use crate::pvs::Pvs;
use crate::pvs::facets::{corners, facet};
use crate::scene::rays::Hit;
use crate::{BitMatrix, ObjectId};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Of the rays, this fraction goes in random directions.
const ANYWHERE: f64 = 0.25;
/// Attempts at a pair in the first round of aimed segments, and rounds, each of twice the attempts.
const FIRST: u64 = 8;
const ROUNDS: u32 = 16;

/// Samples view cells.
pub(in crate::pvs) struct RegionSampler<'a> {
    prover: Prover<'a>,
    pvs: &'a Pvs,
    views: &'a [ViewCell],
    seed: u64,
    origins: Vec<Origins<'a>>,
    /// View cells x objects: pairs with a proof.
    pub lower: BitMatrix,
    /// One for each pair of `lower`: view cell, object, segment.
    proofs: Vec<(u32, u32, [DVec3; 2])>,
    /// Rays cast.
    rays: u64,
}

/// What rays show from one view cell: proofs, in order, and their number.
#[derive(Default, Serialize, Deserialize)]
struct Shown {
    proofs: Vec<(u32, [DVec3; 2])>,
    rays: u64,
}

impl<'a> RegionSampler<'a> {
    /// Nothing proven yet from `views`, across the cells of `pvs`.
    pub fn new(prover: Prover<'a>, pvs: &'a Pvs, views: &'a [ViewCell], seed: u64) -> Self {
        Self {
            origins: views.iter().map(|view| Origins::new(view, prover.clearance)).collect(),
            lower: BitMatrix::new(views.len(), prover.rays.scene().objects.len()),
            proofs: Vec::new(),
            rays: 0,
            prover,
            pvs,
            views,
            seed,
        }
    }

    /// Takes over the witnesses of cells that begin in a view cell.
    pub fn take_from_cells(&mut self) {
        for witness in &self.pvs.witnesses {
            for (v, view) in self.views.iter().enumerate() {
                if view.pieces.iter().any(|piece| piece.contains(witness.from, 0.0)) {
                    self.add(v, witness.object.0, [witness.from, witness.to]);
                }
            }
        }
    }

    /// Tries rays from every view cell until all together have cost `budget`; aimed ones at pairs of `upper`.
    pub fn sample(&mut self, upper: &BitMatrix, budget: u64, work: &Job<'_>) -> Result<(), Stopped> {
        let all: Vec<usize> = (0..self.views.len()).collect();
        let each = (budget as f64 * ANYWHERE) as u64 / self.views.len().max(1) as u64;
        let shown = work.map(&all, |&v| {
            let mut random = Random::new(mix(self.seed, 0xb1 << 32 | v as u64));
            self.origins[v].anywhere(&self.prover, self.lower.row(v), each, &mut random)
        })?;
        self.take(shown);
        for round in 0..ROUNDS {
            let left: Vec<Vec<u32>> = all.iter().map(|&v| self.undecided(upper, v)).collect();
            let count: u64 = left.iter().map(|objects| objects.len() as u64).sum();
            let attempts = (FIRST << round).min(budget.saturating_sub(self.rays) / count.max(1));
            if count == 0 || attempts == 0 {
                break;
            }
            let shown = work.map(&all, |&v| {
                let mut random = Random::new(mix(mix(self.seed, u64::from(round) << 32 | 0xb2), v as u64));
                self.aim(v, &left[v], attempts, &mut random)
            })?;
            self.take(shown);
            work.tell("view cells", self.rays as f64 / budget.max(1) as f64);
        }
        Ok(())
    }

    /// Bounds what each row misses with `each` rays from its view cell, and adds what those show.
    pub fn test(&mut self, each: u64, work: &Job<'_>) -> Result<Vec<f64>, Stopped> {
        let from = |&(v, view): &(usize, &ViewCell)| {
            let region = Region::new(&view.pieces, view.pieces.iter().fold(Aabb::EMPTY, |b, piece| b.union(piece.bounds)));
            let mut random = Random::new(mix(mix(self.seed, 0xb3), v as u64));
            let (mut row, mut bound) = (self.lower.row(v).to_vec(), Bound::NONE);
            let mut shown = Shown { rays: each, proofs: Vec::new() };
            for count in looks(each) {
                let known = row.clone();
                let mut missed = |from: DVec3, direction: DVec3, hit: Hit| {
                    shown.add(&self.prover, &mut row, [from, from + direction * hit.t], hit);
                };
                if let Some(hits) = look(self.prover.rays, &region, &known, count, &mut random, &mut missed) {
                    bound.look(hits, count, DOUBT);
                }
            }
            (bound.0, shown)
        };
        let views: Vec<(usize, &ViewCell)> = self.views.iter().enumerate().collect();
        let results: Vec<(f64, Shown)> = work.map(&views, from)?;
        let (bounds, shown) = results.into_iter().unzip();
        self.take(shown);
        Ok(bounds)
    }

    /// The lower set, a segment for each of its pairs by view cell, then object, and the number of rays.
    pub fn close(mut self) -> (BitMatrix, Vec<[DVec3; 2]>, u64) {
        self.proofs.sort_by_key(|&(view, object, _)| (view, object));
        (self.lower, self.proofs.into_iter().map(|(.., segment)| segment).collect(), self.rays)
    }

    fn add(&mut self, view: usize, object: u32, segment: [DVec3; 2]) {
        if self.lower.set(view, object as usize) {
            self.proofs.push((view as u32, object, segment));
        }
    }

    /// Takes in what each view cell's rays showed.
    fn take(&mut self, shown: Vec<Shown>) {
        for (v, shown) in shown.into_iter().enumerate() {
            self.rays += shown.rays;
            shown.proofs.into_iter().for_each(|(object, segment)| self.add(v, object, segment));
        }
    }

    /// Objects of `upper` that have no proof.
    fn undecided(&self, upper: &BitMatrix, v: usize) -> Vec<u32> {
        let words: Vec<u64> = upper.row(v).iter().zip(self.lower.row(v)).map(|(u, l)| u & !l).collect();
        crate::bits::ones(&words).map(|object| object as u32).collect()
    }

    /// Up to `attempts` segments from view cell `v` at each of `objects`.
    fn aim(&self, v: usize, objects: &[u32], attempts: u64, random: &mut Random) -> Shown {
        let mut shown = Shown::default();
        for &object in objects {
            let near = self.portals_of(object);
            for attempt in 0..attempts {
                shown.rays += 1;
                let Some(([from, to], hit)) = self.segment(v, object, attempt, &near, random) else { continue };
                if self.prover.proves(from, to, hit).is_some() {
                    shown.proofs.push((object, [from, to]));
                    break;
                }
            }
        }
        shown
    }

    /// A segment from view cell `v` to `object`, and what it ends on: straight, through any portal, through one of those `near` the object,
    /// and through two, in turns.
    fn segment(&self, v: usize, object: u32, turn: u64, near: &[u32], random: &mut Random) -> Option<([DVec3; 2], Hit)> {
        let origins = &self.origins[v];
        let (to, hit) = aimed::point_on(self.prover.rays.scene(), object as usize, random);
        let from = match turn % 4 {
            0 => origins.draw(random),
            1 => self.in_portal(&[], random).and_then(|by| origins.through(to, by, random)),
            2 => self.in_portal(near, random).and_then(|by| origins.through(to, by, random)),
            _ => {
                // Through two portals, to what is hit beyond.
                let (far, by) = (self.in_portal(near, random), self.in_portal(&[], random));
                let (far, by) = (far?, by?);
                let from = origins.through(far, by, random)?;
                let direction = (far - from).normalize_or(DVec3::X);
                let reach = self.prover.rays.bounds().with(from).diagonal();
                let met = self.prover.rays.first_opaque(from, direction, reach).filter(|met| met.object.0 == object)?;
                return Some(([from, from + direction * met.t], met));
            }
        };
        from.map(|from| ([from, to], hit))
    }

    /// The portals of the cells that an object is in.
    fn portals_of(&self, object: u32) -> Vec<u32> {
        let Pvs { graph, placement, .. } = self.pvs;
        let cells = (0..graph.cells.len()).filter(|&c| placement.matrix.get(c, object as usize));
        cells.flat_map(|c| graph.cells[c].portals.iter().map(|p| p.portal().0)).collect()
    }

    /// A random point of a random portal: one of these, or where there are none, any.
    fn in_portal(&self, of: &[u32], random: &mut Random) -> Option<DVec3> {
        let portals = &self.pvs.graph.portals;
        let portal = match of.len() as u64 {
            0 => portals.get((random.bits() % portals.len().max(1) as u64) as usize),
            n => Some(&portals[of[(random.bits() % n) as usize] as usize]),
        };
        portal.map(|portal| between(&portal.winding, random))
    }
}

impl Shown {
    /// Adds the segment's proof if there is one and its object isn't in `known`; adds the object there.
    fn add(&mut self, prover: &Prover<'_>, known: &mut [u64], [from, to]: [DVec3; 2], hit: Hit) {
        let ObjectId(object) = hit.object;
        let (word, mask) = (object as usize / 64, 1 << (object % 64));
        if known[word] & mask == 0 && prover.proves(from, to, hit).is_some() {
            known[word] |= mask;
            self.proofs.push((object, [from, to]));
        }
    }
}

/// Where segments start in a view cell.
struct Origins<'a> {
    pieces: &'a [Piece],
    /// Convex sets: the corners of each piece, then its facets, just inside.
    sets: Vec<Vec<DVec3>>,
}

impl<'a> Origins<'a> {
    fn new(view: &'a ViewCell, clearance: f64) -> Self {
        let mut sets = Vec::new();
        for piece in &view.pieces {
            let within = piece.bounds.inflated(1.0 + piece.bounds.diagonal());
            sets.push(corners(piece, within));
            for (i, plane) in piece.planes.iter().enumerate() {
                sets.push(facet(piece, i, within).into_iter().map(|p| p - plane.n * clearance).collect());
            }
        }
        sets.retain(|set| set.len() >= 3);
        Self { pieces: &view.pieces, sets }
    }

    /// True for a point of the view cell.
    fn holds(&self, p: DVec3) -> bool {
        self.pieces.iter().any(|piece| piece.contains(p, 0.0))
    }

    /// A random point of the view cell, most often on its boundary; `None` where it is thinner than the clearance there.
    fn draw(&self, random: &mut Random) -> Option<DVec3> {
        let set = self.sets.get((random.bits() % self.sets.len().max(1) as u64) as usize)?;
        Some(between(set, random)).filter(|&p| self.holds(p))
    }

    /// A random point of the view cell on the line from `to` through `by`, on the side of `by`.
    fn through(&self, to: DVec3, by: DVec3, random: &mut Random) -> Option<DVec3> {
        let piece = &self.pieces[(random.bits() % self.pieces.len() as u64) as usize];
        let (mut near, mut far) = (0.0f64, f64::INFINITY);
        for plane in &piece.planes {
            let (at, step) = (plane.distance(to), plane.n.dot(by - to));
            if step > 0.0 {
                far = far.min(-at / step);
            } else if step < 0.0 {
                near = near.max(-at / step);
            } else if at > 0.0 {
                return None;
            }
        }
        let from = to + (by - to) * (near + (far - near) * random.unit());
        (near < far && self.holds(from)).then_some(from)
    }

    /// Rays in random directions; proves what they hit, as far as that isn't `known`.
    fn anywhere(&self, prover: &Prover<'_>, known: &[u64], rays: u64, random: &mut Random) -> Shown {
        let (mut known, mut shown) = (known.to_vec(), Shown { rays, ..Shown::default() });
        let bounds = prover.rays.bounds();
        for _ in 0..rays {
            let Some(from) = self.draw(random) else { continue };
            let (z, turn) = (2.0 * random.unit() - 1.0, std::f64::consts::TAU * random.unit());
            let r = (1.0 - z * z).sqrt();
            let direction = DVec3::new(r * turn.cos(), z, r * turn.sin());
            let Some(hit) = prover.rays.first_opaque(from, direction, bounds.with(from).diagonal()) else { continue };
            shown.add(prover, &mut known, [from, from + direction * hit.t], hit);
        }
        shown
    }
}

/// A random point between the corners of a convex set, never on its rim.
fn between(set: &[DVec3], random: &mut Random) -> DVec3 {
    let mut corner = || (set[(random.bits() % set.len() as u64) as usize], -(1.0 - random.unit()).ln());
    let chosen = [corner(), corner(), corner(), (middle(set), 0.1)];
    let total: f64 = chosen.iter().map(|c| c.1).sum();
    chosen.iter().map(|&(p, weight)| p * (weight / total)).sum()
}
