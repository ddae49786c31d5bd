//! Aimed witnesses: segments at the pairs that flow left undecided.
//!
//! Cubes look everywhere; the undecided pairs are a short list, so the remaining rays go there: from random points on the cell's portals
//! and in its pieces to random points on the object, and for an object in the cell itself also from random points in front of it. The
//! number of attempts grows from round to round, so that easy pairs do not wait for hopeless ones.

use super::sampler::{Random, mix};
use super::witness::{Found, Prover, Witnessed};
use crate::cells::{CellGraph, Locator};
use crate::job::{Job, Stopped};
use crate::math::geom::{self, Aabb};
use crate::math::parallel;
use crate::pvs::facets::corners;
use crate::scene::Scene;
use crate::scene::rays::{Hit, RayScene};
use crate::{BitMatrix, CellId, ObjectId};
use glam::DVec3;

/// Attempts at a pair in the first round; each round doubles them.
const FIRST: u64 = 4;
/// Most rounds.
const ROUNDS: u32 = 6;
/// Most pieces of a cell with starting points of segments.
const PIECES: usize = 16;

/// The upper set; pairs of the lower set are decided.
pub(in crate::pvs) struct Undecided<'a> {
    pub cells_upper: &'a BitMatrix,
    pub objects_upper: &'a BitMatrix,
    pub placement: &'a BitMatrix,
}

/// Tries pairs of `cells_upper` and `objects_upper` without a proof until the lower bound has cost `budget` rays.
pub(in crate::pvs) fn sample(
    rays: &RayScene<'_>,
    graph: &CellGraph,
    Undecided { cells_upper, objects_upper, placement }: Undecided<'_>,
    seed: u64,
    budget: u64,
    lower: &mut Witnessed,
    work: &Job<'_>,
) -> Result<(), Stopped> {
    let (scene, locator) = (rays.scene(), Locator::new(graph));
    let prover = Prover { rays, locator: &locator, clearance: scene.tolerance().clearance };
    let origins: Vec<Origins> = parallel::map_range(0..graph.cells.len(), |c| Origins::new(graph, rays, c));
    for round in 0..ROUNDS {
        let left = |c: usize| Left::new(c, [cells_upper, objects_upper], lower);
        let mut undecided: Vec<Left> = (0..graph.cells.len()).map(left).collect();
        undecided.retain(|left| left.pairs() > 0);
        let count: u64 = undecided.iter().map(Left::pairs).sum();
        let attempts = (FIRST << round).min(budget.saturating_sub(lower.rays) / count.max(1));
        if count == 0 || attempts == 0 {
            break;
        }
        let share = |done: usize| (f64::from(round) + done as f64 / undecided.len() as f64) / f64::from(ROUNDS);
        let done = |done: usize| work.tell("aimed rays", share(done));
        let from_cell = |(): &mut (), &Left { cell, ref objects, ref cells }: &Left| {
            let (c, mut found) = (cell.index(), Found::default());
            let mut random = Random::new(mix(mix(seed, u64::from(round) << 32 | 0xa1), c as u64));
            for &object in objects {
                for attempt in 0..attempts {
                    let (to, hit) = point_on(scene, object, &mut random);
                    let near = attempt % 2 == 0 && placement.get(c, object);
                    let from = if near { Some(before(rays, to, hit, &mut random)) } else { origins[c].draw(&mut random) };
                    let Some(from) = from else { break };
                    if prover.aim(cell, from, to, hit, &mut found) {
                        break;
                    }
                }
            }
            for &other in cells {
                for _ in 0..attempts {
                    let ends = (origins[c].draw(&mut random), origins[other].draw(&mut random));
                    let (Some(from), Some(to)) = ends else { break };
                    if prover.aim_sight([cell, CellId(other as u32)], [from, to], &mut found) {
                        break;
                    }
                }
            }
            found.close()
        };
        let results: Vec<Found> = work.map_with(&undecided, || (), from_cell, done)?;
        results.into_iter().for_each(|found| {
            lower.merge(found);
        });
    }
    Ok(())
}

/// Pairs of a cell without a proof.
struct Left {
    cell: CellId,
    objects: Vec<usize>,
    /// Cells with higher numbers.
    cells: Vec<usize>,
}

impl Left {
    /// Of cell `c`, by the upper sets of cells and objects.
    fn new(c: usize, [cells_upper, objects_upper]: [&BitMatrix; 2], lower: &Witnessed) -> Self {
        let left = |upper: &BitMatrix, known: &BitMatrix| {
            let words: Vec<u64> = upper.row(c).iter().zip(known.row(c)).map(|(u, l)| u & !l).collect();
            crate::math::bits::ones(&words).collect::<Vec<_>>()
        };
        let cells: Vec<usize> = left(cells_upper, &lower.cells).into_iter().filter(|&other| other > c).collect();
        Self { cell: CellId(c as u32), objects: left(objects_upper, &lower.objects), cells }
    }

    fn pairs(&self) -> u64 {
        (self.objects.len() + self.cells.len()) as u64
    }
}

/// A random point on a random triangle of an object.
pub(in crate::pvs) fn point_on(scene: &Scene, object: usize, random: &mut Random) -> (DVec3, Hit) {
    let triangles = &scene.objects[object].triangles;
    let triangle = triangles.start + (random.bits() % u64::from(triangles.end - triangles.start)) as u32;
    let [a, b, c] = scene.corners(triangle as usize);
    let (mut x, mut y) = (random.unit(), random.unit());
    if x + y > 1.0 {
        (x, y) = (1.0 - x, 1.0 - y);
    }
    (a + (b - a) * x + (c - a) * y, Hit { t: 1.0, triangle, object: ObjectId(object as u32) })
}

/// A random point on the normal through a point of a triangle, on either side, with log-uniform distance.
fn before(rays: &RayScene<'_>, to: DVec3, hit: Hit, random: &mut Random) -> DVec3 {
    let [a, b, c] = rays.scene().corners(hit.triangle as usize);
    let (near, far) = (8.0 * rays.tolerance().clearance, 0.1 * rays.bounds().diagonal());
    let distance = near * (far / near).powf(random.unit());
    let side = if random.bits().is_multiple_of(2) { distance } else { -distance };
    to + (b - a).cross(c - a).normalize_or(DVec3::Y) * side
}

/// Convex sets with starting points of segments: the portals' windings, just inside the cell, and the largest pieces' corners.
struct Origins {
    portals: Vec<Vec<DVec3>>,
    pieces: Vec<Vec<DVec3>>,
}

impl Origins {
    fn new(graph: &CellGraph, rays: &RayScene<'_>, cell: usize) -> Self {
        let near = rays.bounds().inflated(0.1 * rays.bounds().diagonal());
        let nudge = 2.0 * rays.tolerance().clearance;
        let cell = &graph.cells[cell];
        let portals = cell.portals.iter().map(|&p| {
            let (winding, n) = (&graph.portals[p.portal().index()].winding, graph.plane(p).n);
            winding.iter().map(|&x| x - n * nudge).collect()
        });
        let size = |b: &Aabb| (b.max.min(near.max) - b.min.max(near.min)).max(DVec3::ZERO).element_product();
        let mut largest: Vec<usize> = (0..cell.pieces.len()).collect();
        let order = |&a: &usize, &b: &usize| size(&cell.pieces[b].bounds).total_cmp(&size(&cell.pieces[a].bounds));
        largest.sort_by(|a, b| order(a, b).then(a.cmp(b)));
        let pieces = largest.into_iter().take(PIECES).map(|i| corners(&cell.pieces[i], near));
        Self { portals: portals.collect(), pieces: pieces.filter(|p| p.len() >= 4).collect() }
    }

    /// A random point of one of them: two thirds are on portals.
    fn draw(&self, random: &mut Random) -> Option<DVec3> {
        let portals = self.pieces.is_empty() || (!self.portals.is_empty() && !random.bits().is_multiple_of(3));
        let sets = if portals { &self.portals } else { &self.pieces };
        let set = sets.get((random.bits() % sets.len().max(1) as u64) as usize)?;
        // A combination of three random corners and, with a small weight, the centre: never on the rim.
        let mut corner = || (set[(random.bits() % set.len() as u64) as usize], -(1.0 - random.unit()).ln());
        let chosen = [corner(), corner(), corner(), (geom::middle(set), 0.1)];
        let total: f64 = chosen.iter().map(|c| c.1).sum();
        Some(chosen.iter().map(|&(p, weight)| p * (weight / total)).sum())
    }
}
