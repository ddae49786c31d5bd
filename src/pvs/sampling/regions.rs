//! The lower bound of view cells: regions that may cross cells.
//!
//! First, witnesses of cells that begin in a region; then visibility cubes at random points of it; then segments at the pairs that flow
//! left undecided, from random points of the region, and through random points of portals, with equal probability for small and large
//! portals: behind a keyhole, all lines pass the keyhole.

use super::aimed;
use super::confidence::{Bound, look};
use super::region::Region;
use super::sampler::{Random, mix};
use super::witness::Prover;
use crate::cells::{Piece, ViewCell};
use crate::job::{Job, Stopped};
use crate::math::geom::{Aabb, middle};
use crate::pvs::Pvs;
use crate::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, NONE, Raster, settle};
use crate::pvs::facets::{corners, facet};
use crate::scene::rays::Hit;
use crate::{BitMatrix, ObjectId};
use glam::{DMat3, DQuat, DVec3, EulerRot};
use serde::{Deserialize, Serialize};

/// Share of the rays for cubes.
const CUBES: f64 = 0.5;
/// Pixels along an edge of a cube's faces, and the cost of a cube in rays.
const PIXELS: u32 = 128;
const COST: u64 = 1_500;
/// One cube in this many is anywhere within its view cell, the others are on its boundary.
const WITHIN: u64 = 2;
/// Most random points until a view cell counts as empty.
const TRIES: usize = 256;
/// Attempts at a pair in the first round of aimed segments, and number of rounds; each has twice the attempts.
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
    /// Unseen part of each, and the mean.
    unseen: Vec<Bound>,
    mean: Bound,
    /// Tests so far.
    tests: u32,
}

/// Results of rays from one view cell: proofs, in order, and the number of rays.
#[derive(Default, Serialize, Deserialize)]
struct Shown {
    proofs: Vec<(u32, [DVec3; 2])>,
    rays: u64,
}

impl<'a> RegionSampler<'a> {
    /// A sampler for `views` over the cells of `pvs`, without proofs.
    pub fn new(prover: Prover<'a>, pvs: &'a Pvs, views: &'a [ViewCell], seed: u64) -> Self {
        Self {
            origins: views.iter().map(|view| Origins::new(view, prover.clearance)).collect(),
            lower: BitMatrix::new(views.len(), prover.rays.scene().objects.len()),
            proofs: Vec::new(),
            rays: 0,
            unseen: vec![Bound::NONE; views.len()],
            mean: Bound::NONE,
            tests: 0,
            prover,
            pvs,
            views,
            seed,
        }
    }

    /// Copies the witnesses of cells that begin in a view cell.
    pub fn take_from_cells(&mut self) {
        for witness in &self.pvs.witnesses {
            for (v, view) in self.views.iter().enumerate() {
                if view.pieces.iter().any(|piece| piece.contains(witness.from, 0.0)) {
                    self.add(v, witness.object.0, [witness.from, witness.to]);
                }
            }
        }
    }

    /// Casts rays from every view cell up to `budget` in all; aimed segments at pairs of `upper`.
    pub fn sample(&mut self, upper: &BitMatrix, budget: u64, work: &Job<'_>) -> Result<(), Stopped> {
        let all: Vec<usize> = (0..self.views.len()).collect();
        let (begin, spent) = (self.rays, budget.saturating_sub(self.rays));
        let cubes = (spent as f64 * CUBES) as u64 / COST / self.views.len().max(1) as u64;
        let scene = self.prover.rays.scene();
        let shown = {
            let tree = CubeScene::new(scene);
            let eyes = || (Raster::new(&tree), Cube::default());
            let look = |(engine, cube): &mut (Raster<'_>, Cube), &v: &usize| {
                let mut random = Random::new(mix(mix(self.seed, 0xb1 << 32 | v as u64), begin));
                self.look_around(v, cubes, engine, cube, &mut random)
            };
            work.map_with(&all, eyes, look, |_| ())?
        };
        self.take(shown);
        for round in 0..ROUNDS {
            let left: Vec<Vec<u32>> = all.iter().map(|&v| self.undecided(upper, v)).collect();
            let count: u64 = left.iter().map(|objects| objects.len() as u64).sum();
            let attempts = (FIRST << round).min(budget.saturating_sub(self.rays) / count.max(1));
            if count == 0 || attempts == 0 {
                break;
            }
            let shown = work.map(&all, |&v| {
                let mut random = Random::new(mix(mix(self.seed, u64::from(round) << 32 | 0xb2), mix(begin, v as u64)));
                self.aim(v, &left[v], attempts, &mut random)
            })?;
            self.take(shown);
            work.tell("view cells", self.rays as f64 / budget.max(1) as f64);
        }
        Ok(())
    }

    /// Bounds the unseen part of each row with `each` rays from its view cell, with the allowed error `doubt`; adds hits to the rows.
    pub fn test(&mut self, each: u64, doubt: f64, work: &Job<'_>) -> Result<(), Stopped> {
        let number = u64::from(self.tests);
        let from = |&(v, view): &(usize, &ViewCell)| {
            let region = region_of(view);
            let draw = |random: &mut Random| self.draw_free(&region, random);
            let mut random = Random::new(mix(mix(self.seed, 0xb3 | number << 32), v as u64));
            let (known, mut row) = (self.lower.row(v), self.lower.row(v).to_vec());
            let mut shown = Shown { rays: each, proofs: Vec::new() };
            let mut missed = |from: DVec3, direction: DVec3, hit: Hit| {
                shown.add(&self.prover, &mut row, [from, from + direction * hit.t], hit);
            };
            (look(self.prover.rays, &draw, known, each, &mut random, &mut missed), shown)
        };
        let views: Vec<(usize, &ViewCell)> = self.views.iter().enumerate().collect();
        let results: Vec<(Option<u64>, Shown)> = work.map(&views, from)?;
        let (hits, shown): (Vec<_>, Vec<_>) = results.into_iter().unzip();
        let (mut all, mut hit) = (0, 0);
        for (bound, hits) in self.unseen.iter_mut().zip(hits) {
            if let Some(hits) = hits {
                bound.look(hits, each, doubt);
                (all, hit) = (all + each, hit + hits);
            }
        }
        self.mean.look(hit, all, doubt);
        self.tests += 1;
        self.take(shown);
        Ok(())
    }

    /// The bound of the mean over all view cells.
    pub fn mean(&self) -> f64 {
        self.mean.0
    }

    /// Rays cast so far.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// The bound of each.
    pub fn unseen(&self) -> Vec<f64> {
        self.unseen.iter().map(|bound| bound.0).collect()
    }

    /// The lower set, a segment for each of its pairs, ordered by view cell, then object, and the number of rays.
    pub fn close(mut self) -> (BitMatrix, Vec<[DVec3; 2]>, u64) {
        self.proofs.sort_by_key(|&(view, object, _)| (view, object));
        (self.lower, self.proofs.into_iter().map(|(.., segment)| segment).collect(), self.rays)
    }

    fn add(&mut self, view: usize, object: u32, segment: [DVec3; 2]) {
        if self.lower.set(view, object as usize) {
            self.proofs.push((view as u32, object, segment));
        }
    }

    /// Merges the results of each view cell.
    fn take(&mut self, shown: Vec<Shown>) {
        for (v, shown) in shown.into_iter().enumerate() {
            self.rays += shown.rays;
            shown.proofs.into_iter().for_each(|(object, segment)| self.add(v, object, segment));
        }
    }

    /// Objects of `upper` without a proof.
    fn undecided(&self, upper: &BitMatrix, v: usize) -> Vec<u32> {
        let words: Vec<u64> = upper.row(v).iter().zip(self.lower.row(v)).map(|(u, l)| u & !l).collect();
        crate::math::bits::ones(&words).map(|object| object as u32).collect()
    }

    /// A random point of a view cell that is in a cell; `None` after `TRIES` attempts.
    fn draw_free(&self, region: &Region, random: &mut Random) -> Option<DVec3> {
        (0..TRIES).find_map(|_| region.draw(random).filter(|&p| self.prover.locator.locate(p).is_some()))
    }

    /// Renders cubes at random points of view cell `v`; proves the new objects that they show.
    fn look_around(&self, v: usize, cubes: u64, engine: &mut Raster<'_>, cube: &mut Cube, random: &mut Random) -> Shown {
        let rays = self.prover.rays;
        let (mut known, mut shown) = (self.lower.row(v).to_vec(), Shown { rays: cubes * COST, ..Shown::default() });
        let region = region_of(&self.views[v]);
        for number in 0..cubes {
            let within = number % WITHIN == 0;
            let from = if within { self.draw_free(&region, random) } else { self.origins[v].draw(random) };
            let Some(at) = from.filter(|&at| within || self.prover.locator.locate(at).is_some()) else { continue };
            let view = CubeView { eye: at, frame: random_frame(random), size: PIXELS };
            engine.cube(&view, cube);
            let mut first = 0;
            let runs = cube.triangles.chunk_by(|a, b| a == b).map(|run| {
                first += run.len();
                (first - 1 - run.len() / 2, run[0])
            });
            let clear = cube.see_through.iter().map(|clear| (clear.pixel as usize, clear.triangle));
            for (pixel, triangle) in runs.chain(clear).filter(|&(_, triangle)| triangle != NONE) {
                if let Some(hit) = settle(rays, &view, pixel, triangle) {
                    shown.add(&self.prover, &mut known, [at, at + view.direction(pixel) * hit.t], hit);
                }
            }
        }
        shown
    }

    /// Up to `attempts` segments from view cell `v` at each of `objects`.
    fn aim(&self, v: usize, objects: &[u32], attempts: u64, random: &mut Random) -> Shown {
        let mut shown = Shown::default();
        for &object in objects {
            let near = self.portals_of(object);
            for attempt in 0..attempts {
                shown.rays += 1;
                let Some(([from, to], hit)) = self.segment(v, object, attempt, &near, random) else { continue };
                if let Some([to, _]) = self.prover.proves(from, to, hit) {
                    shown.proofs.push((object, [from, to]));
                    break;
                }
            }
        }
        shown
    }

    /// A segment from view cell `v` to `object`, and its hit: straight, through any portal, through one of those `near` the object, and
    /// through two, in turn.
    fn segment(&self, v: usize, object: u32, turn: u64, near: &[u32], random: &mut Random) -> Option<([DVec3; 2], Hit)> {
        let origins = &self.origins[v];
        let (to, hit) = aimed::point_on(self.prover.rays.scene(), object as usize, random);
        let from = match turn % 4 {
            0 => origins.draw(random),
            1 => self.in_portal(&[], random).and_then(|by| origins.through(to, by, random)),
            2 => self.in_portal(near, random).and_then(|by| origins.through(to, by, random)),
            _ => {
                // Through two portals, to the hit beyond.
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

    /// A random point of a random portal: of `of`, or of all if that is empty.
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
    /// Adds the segment's proof, if there is one and its object is not in `known`; adds the object to `known`.
    fn add(&mut self, prover: &Prover<'_>, known: &mut [u64], [from, to]: [DVec3; 2], hit: Hit) {
        let ObjectId(object) = hit.object;
        let (word, mask) = (object as usize / 64, 1 << (object % 64));
        if known[word] & mask == 0
            && let Some([to, _]) = prover.proves(from, to, hit)
        {
            known[word] |= mask;
            self.proofs.push((object, [from, to]));
        }
    }
}

/// Starting points of segments in a view cell.
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

    /// True if the view cell contains a point.
    fn holds(&self, p: DVec3) -> bool {
        self.pieces.iter().any(|piece| piece.contains(p, 0.0))
    }

    /// A random point of the view cell, usually on its boundary; `None` if the view cell is thinner than the clearance there.
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
}

/// The region of a whole view cell.
fn region_of(view: &ViewCell) -> Region {
    Region::new(&view.pieces, view.pieces.iter().fold(Aabb::EMPTY, |b, piece| b.union(piece.bounds)))
}

/// A random rotation, so that pixels of neighbouring cubes do not coincide.
fn random_frame(random: &mut Random) -> DMat3 {
    let mut turn = || random.unit() * std::f64::consts::TAU;
    DMat3::from_quat(DQuat::from_euler(EulerRot::XYZ, turn(), turn(), turn()))
}

/// A random point between the corners of a convex set, never on its rim.
fn between(set: &[DVec3], random: &mut Random) -> DVec3 {
    let mut corner = || (set[(random.bits() % set.len() as u64) as usize], -(1.0 - random.unit()).ln());
    let chosen = [corner(), corner(), corner(), (middle(set), 0.1)];
    let total: f64 = chosen.iter().map(|c| c.1).sum();
    chosen.iter().map(|&(p, weight)| p * (weight / total)).sum()
}
