//! Both sides of what can be seen from view cells: regions that may lie across cells, and that bound nothing.
//!
//! **Upper**: a line from a point of a region to an object that doesn't touch the region leaves it for the last time through its
//! boundary, and goes on through cells from there. So the region is laid out as one more cell, from which portals, the facets of
//! its pieces, lead into every cell that goes on beyond them; and flow searches from that cell alone. Facets beyond which no cell
//! goes on lie on walls or in them. What is nearer than the clearance is promised nothing, as everywhere; windows are widened by
//! it.
//!
//! **Lower**: witnesses of cells that begin in the region; rays from it in random directions; then segments tried at the pairs
//! that flow left undecided, from random points of the region, and through random points of portals, where the small are as
//! likely as the large: behind a keyhole, a line through the keyhole is the only one.

use super::Pvs;
use super::facets::{corners, facet};
use super::flow::{FlowInput, flow};
use super::options::PvsOptions;
use super::sampling::aimed;
use super::sampling::confidence::{Bound, look, looks};
use super::sampling::region::Region;
use super::sampling::sampler::{Random, mix};
use super::sampling::witness::{PLACEMENT_MARGIN, Prover};
use crate::cells::{Cell, CellGraph, Locator, Piece, Portal, PortalKind, PortalState, ViewCell, place_objects};
use crate::geom::{Aabb, Plane, clip, middle};
use crate::job::{Job, Stopped};
use crate::scene::Scene;
use crate::scene::rays::{Hit, RayScene};
use crate::{BitMatrix, CellId, ObjectId};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// The sampling of view cells may cost this fraction of a bake's rays, on top of them.
const SHARE: f64 = 0.25;
/// Of that, this fraction goes in random directions.
const ANYWHERE: f64 = 0.25;
/// And this fraction tests what the others found.
const TESTED: f64 = 0.2;
/// Attempts at a pair in the first round of aimed segments, and rounds, each of twice the attempts.
const FIRST: u64 = 8;
const ROUNDS: u32 = 16;
/// A facet that lies in more pieces of a cell than this leads into it as a whole.
const WHOLE: usize = 8;

/// What can be seen from each view cell. `lower` is a subset of `upper`.
#[derive(Clone, PartialEq, Debug)]
pub struct ViewRows {
    /// View cells x objects: pairs with a witness.
    pub lower: BitMatrix,
    /// View cells x objects: pairs not proven hidden.
    pub upper: BitMatrix,
    /// A segment for each pair of `lower`, from a point in the view cell to a point on the object, by view cell, then object.
    pub witnesses: Vec<[DVec3; 2]>,
    /// View cells that lie in no cell: nothing but what touches them is seen from there.
    pub in_no_cell: Vec<usize>,
    /// How much of what there is to see from each nobody has seen, at most: [`Unseen::cells`](crate::types::bounds::Unseen::cells), of
    /// view cells. 1 where no rays were cast to tell.
    pub unseen: Vec<f64>,
    /// Rays cast.
    pub rays: u64,
    /// Source portals whose flow ran out of steps and kept what might be seen.
    pub capped: u64,
    /// Pairs that were proven visible and that flow took for hidden; they were added to `upper`.
    pub contradictions: u64,
}

/// Works out what can be seen from `views`, with the cells' own bake at hand.
///
/// # Errors
///
/// Where it was stopped.
pub fn bake(
    scene: &Scene,
    pvs: &Pvs,
    views: &[ViewCell],
    options: &PvsOptions,
    work: &Job<'_>,
) -> Result<ViewRows, Stopped> {
    let graph = &pvs.graph;
    let objects = scene.objects.len();
    let clearance = scene.tolerance().clearance;
    let mut rows = ViewRows {
        lower: BitMatrix::new(views.len(), objects),
        upper: BitMatrix::new(views.len(), objects),
        witnesses: Vec::new(),
        in_no_cell: Vec::new(),
        unseen: Vec::new(),
        rays: 0,
        capped: 0,
        contradictions: 0,
    };
    // 1. Witnesses of cells that begin in a region.
    let mut proofs: Vec<(u32, u32, [DVec3; 2])> = Vec::new();
    for witness in &pvs.witnesses {
        for (v, view) in views.iter().enumerate() {
            let begins_here = view.pieces.iter().any(|piece| piece.contains(witness.from, 0.0));
            if begins_here && rows.lower.set(v, witness.object.index()) {
                proofs.push((v as u32, witness.object.0, [witness.from, witness.to]));
            }
        }
    }
    // 2. Flow from each region.
    let region = |view: &ViewCell| Cell { pieces: view.pieces.clone(), ..Cell::default() };
    let regions = CellGraph { cells: views.iter().map(region).collect(), portals: Vec::new(), ..graph.clone() };
    let touching = place_objects(scene, &regions, PLACEMENT_MARGIN * clearance);
    let bounds: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();
    let locator = Locator::new(graph);
    for (v, view) in views.iter().enumerate() {
        work.tell("view cells", v as f64 / views.len() as f64);
        let ways = ways_out(graph, &locator, view, clearance);
        if ways.is_empty() {
            rows.in_no_cell.push(v);
        }
        let upper = Inserted { graph, ways, touching: touching.row(v), known: rows.lower.row(v) };
        let coplanar = scene.tolerance().coplanar;
        rows.capped += upper.flow(&pvs.placement, &bounds, options, coplanar, rows.upper.row_mut(v), work)?;
    }
    // 3. Rays at what is left.
    let rays = RayScene::new(scene);
    let prover = Prover { rays: &rays, locator: &locator, clearance };
    let budget = (options.ray_budget as f64 * SHARE) as u64;
    let to_test = (budget as f64 * TESTED) as u64;
    sample(&prover, graph, pvs, views, options.seed, budget - to_test, &mut rows, &mut proofs, work)?;
    rows.unseen = test(&prover, views, options.seed, to_test / views.len().max(1) as u64, &mut rows, &mut proofs, work)?;
    // 4. The lower set is a subset of the upper one.
    let before = rows.upper.count_ones();
    rows.upper.union_with(&rows.lower);
    rows.contradictions = rows.upper.count_ones() - before;
    proofs.sort_by_key(|&(view, object, _)| (view, object));
    rows.witnesses = proofs.into_iter().map(|(.., segment)| segment).collect();
    Ok(rows)
}

/// The portals that lead out of a region: its facets as far as cells go on beyond them, leading into those from cell
/// `graph.cells.len()`, which stands for the region.
fn ways_out(graph: &CellGraph, locator: &Locator<'_>, view: &ViewCell, clearance: f64) -> Vec<Portal> {
    let mut ways = Vec::new();
    for (k, piece) in view.pieces.iter().enumerate() {
        let within = piece.bounds.inflated(1.0 + piece.bounds.diagonal());
        for (i, &plane) in piece.planes.iter().enumerate() {
            // What goes on beyond a facet is what holds its points a step further out.
            let step = plane.n * (2.0 * clearance);
            let beyond = |p: &Plane, wider: f64| Plane { d: p.d - p.n.dot(step) + wider, ..*p };
            // Where that is another piece of the region, nothing leaves it.
            let mut left = vec![facet(piece, i, within)];
            for (_, other) in view.pieces.iter().enumerate().filter(|&(other, _)| other != k) {
                if other.bounds.inflated(clearance).touches(&piece.bounds) {
                    let planes: Vec<Plane> = other.planes.iter().map(|p| beyond(p, 0.0)).collect();
                    left = left.into_iter().flat_map(|part| outside(part, &planes)).collect();
                }
            }
            for whole in left.into_iter().filter(|part| part.len() >= 3) {
                // The windows in each cell, in a fixed order.
                let mut windows: Vec<(CellId, Vec<DVec3>)> = Vec::new();
                locator.pieces_in_box(&Aabb::of(whole.iter().copied()).inflated(4.0 * clearance), |cell, piece| {
                    let planes = graph.cells[cell.index()].pieces[piece].planes.iter();
                    let clipped = |w: Vec<DVec3>, p: &Plane| if w.is_empty() { w } else { clip(&w, p, 0.0) };
                    let window = planes.fold(whole.clone(), |w, p| clipped(w, &beyond(p, clearance)));
                    if window.len() >= 3 {
                        windows.push((cell, window));
                    }
                });
                windows.sort_by_key(|(cell, _)| *cell);
                for of_cell in windows.chunk_by(|a, b| a.0 == b.0) {
                    let window = |winding: &Vec<DVec3>| Portal {
                        cells: [CellId(graph.cells.len() as u32), of_cell[0].0],
                        plane,
                        winding: winding.clone(),
                        kind: PortalKind::Opening,
                        state: PortalState::default(),
                        source: None,
                    };
                    if of_cell.len() > WHOLE {
                        ways.push(window(&whole));
                    } else {
                        ways.extend(of_cell.iter().map(|(_, winding)| window(winding)));
                    }
                }
            }
        }
    }
    ways
}

/// The convex parts of a convex polygon that are outside of a convex set.
fn outside(polygon: Vec<DVec3>, planes: &[Plane]) -> Vec<Vec<DVec3>> {
    let (mut parts, mut rest) = (Vec::new(), polygon.clone());
    for plane in planes {
        if rest.is_empty() {
            // It lies nowhere in the set: whole, rather than in parts.
            return vec![polygon];
        }
        parts.push(clip(&rest, &plane.flipped(), 0.0));
        rest = clip(&rest, plane, 0.0);
    }
    if rest.is_empty() {
        return vec![polygon];
    }
    parts.retain(|part| part.len() >= 3);
    parts
}

/// A region as one more cell of a graph.
struct Inserted<'a> {
    graph: &'a CellGraph,
    ways: Vec<Portal>,
    /// Objects that touch it.
    touching: &'a [u64],
    /// Objects known to be visible.
    known: &'a [u64],
}

impl Inserted<'_> {
    /// Sets what may be seen from the region; gives the number of searches that ran out of steps.
    fn flow(
        self,
        placement: &BitMatrix,
        bounds: &[Aabb],
        options: &PvsOptions,
        coplanar: f64,
        row: &mut [u64],
        work: &Job<'_>,
    ) -> Result<u64, Stopped> {
        let here = self.graph.cells.len();
        let mut graph = self.graph.clone();
        graph.cells.push(Cell::default());
        graph.portals.extend(self.ways);
        // Of the cells everything is taken as known, so that nothing is searched for from there.
        let all = |columns: usize, known: usize| {
            let mut matrix = BitMatrix::new(here + 1, columns);
            for row in 0..here {
                (0..known).for_each(|column| {
                    matrix.set(row, column);
                });
            }
            matrix
        };
        let (cells_lower, mut objects_lower) = (all(here + 1, here), all(bounds.len(), bounds.len()));
        objects_lower.row_mut(here).copy_from_slice(self.known);
        let mut places = BitMatrix::new(here + 1, bounds.len());
        (0..here).for_each(|cell| places.row_mut(cell).copy_from_slice(placement.row(cell)));
        places.row_mut(here).copy_from_slice(self.touching);
        let input = FlowInput {
            graph: &graph,
            placement: &places,
            object_bounds: bounds,
            cells_lower: &cells_lower,
            objects_lower: &objects_lower,
            max_steps: options.flow_steps,
            coplanar,
        };
        let flowed = flow(&input, work)?;
        row.copy_from_slice(flowed.objects_upper.row(here));
        Ok(flowed.capped)
    }
}

/// What rays show from one view cell: proofs, in order, and their number.
#[derive(Default, Serialize, Deserialize)]
struct Shown {
    proofs: Vec<(u32, [DVec3; 2])>,
    rays: u64,
}

/// Tries rays from every view cell until all together have cost `budget`.
#[allow(clippy::too_many_arguments)]
fn sample(
    prover: &Prover<'_>,
    graph: &CellGraph,
    pvs: &Pvs,
    views: &[ViewCell],
    seed: u64,
    budget: u64,
    rows: &mut ViewRows,
    proofs: &mut Vec<(u32, u32, [DVec3; 2])>,
    work: &Job<'_>,
) -> Result<(), Stopped> {
    let all: Vec<usize> = (0..views.len()).collect();
    let (scene, clearance) = (prover.rays.scene(), prover.clearance);
    let origins: Vec<Origins> = views.iter().map(|view| Origins::new(view, clearance)).collect();
    let mut take = |rows: &mut ViewRows, shown: Vec<Shown>| {
        for (v, shown) in shown.into_iter().enumerate() {
            rows.rays += shown.rays;
            for (object, segment) in shown.proofs {
                if rows.lower.set(v, object as usize) {
                    proofs.push((v as u32, object, segment));
                }
            }
        }
    };
    // Anywhere.
    let each = (budget as f64 * ANYWHERE) as u64 / views.len().max(1) as u64;
    let anywhere = |v: usize, rows: &ViewRows| {
        let mut random = Random::new(mix(seed, 0xb1 << 32 | v as u64));
        origins[v].anywhere(prover, rows.lower.row(v), each, &mut random)
    };
    let shown = work.map(&all, |&v| anywhere(v, rows))?;
    take(rows, shown);
    // Aimed.
    let portals_of = |object: u32| -> Vec<u32> {
        let cells = (0..graph.cells.len()).filter(|&c| pvs.placement.get(c, object as usize));
        cells.flat_map(|c| graph.cells[c].portals.iter().map(|p| p.portal().0)).collect()
    };
    for round in 0..ROUNDS {
        let left: Vec<Vec<u32>> = (0..views.len())
            .map(|v| {
                let words: Vec<u64> = rows.upper.row(v).iter().zip(rows.lower.row(v)).map(|(u, l)| u & !l).collect();
                crate::bits::ones(&words).map(|object| object as u32).collect()
            })
            .collect();
        let count: u64 = left.iter().map(|objects| objects.len() as u64).sum();
        let attempts = (FIRST << round).min(budget.saturating_sub(rows.rays) / count.max(1));
        if count == 0 || attempts == 0 {
            break;
        }
        let aimed = |&v: &usize| {
            let mut random = Random::new(mix(mix(seed, u64::from(round) << 32 | 0xb2), v as u64));
            let mut shown = Shown::default();
            for &object in &left[v] {
                let near = portals_of(object);
                let any = |random: &mut Random, of: &[u32]| {
                    let portal = match of.len() as u64 {
                        0 => graph.portals.get((random.bits() % graph.portals.len().max(1) as u64) as usize),
                        n => Some(&graph.portals[of[(random.bits() % n) as usize] as usize]),
                    };
                    portal.map(|portal| between(&portal.winding, random))
                };
                for attempt in 0..attempts {
                    shown.rays += 1;
                    let (mut to, mut hit) = aimed::point_on(scene, object as usize, &mut random);
                    let from = match attempt % 4 {
                        0 => origins[v].draw(&mut random),
                        1 => any(&mut random, &[]).and_then(|by| origins[v].through(to, by, &mut random)),
                        2 => any(&mut random, &near).and_then(|by| origins[v].through(to, by, &mut random)),
                        _ => {
                            // Through two portals, to what is hit beyond.
                            let two = (any(&mut random, &near), any(&mut random, &[]));
                            let (Some(far), Some(by)) = two else { continue };
                            let Some(from) = origins[v].through(far, by, &mut random) else { continue };
                            let direction = (far - from).normalize_or(DVec3::X);
                            let reach = prover.rays.bounds().with(from).diagonal();
                            let met = prover.rays.first_opaque(from, direction, reach);
                            let Some(met) = met.filter(|met| met.object.0 == object) else { continue };
                            (to, hit) = (from + direction * met.t, met);
                            Some(from)
                        }
                    };
                    if let Some(from) = from.filter(|&from| prover.proves(from, to, hit).is_some()) {
                        shown.proofs.push((object, [from, to]));
                        break;
                    }
                }
            }
            shown
        };
        let shown = work.map(&all, aimed)?;
        take(rows, shown);
        work.tell("view cells", rows.rays as f64 / budget.max(1) as f64);
    }
    Ok(())
}

/// Bounds what each row misses with `each` rays from its view cell, and adds what those show.
fn test(
    prover: &Prover<'_>,
    views: &[ViewCell],
    seed: u64,
    each: u64,
    rows: &mut ViewRows,
    proofs: &mut Vec<(u32, u32, [DVec3; 2])>,
    work: &Job<'_>,
) -> Result<Vec<f64>, Stopped> {
    let from = |&(v, view): &(usize, &ViewCell)| {
        let region = Region::new(&view.pieces, view.pieces.iter().fold(Aabb::EMPTY, |b, piece| b.union(piece.bounds)));
        let mut random = Random::new(mix(mix(seed, 0xb3), v as u64));
        let (mut row, mut bound) = (rows.lower.row(v).to_vec(), Bound::NONE);
        let mut shown = Shown { rays: each, proofs: Vec::new() };
        for count in looks(each) {
            let known = row.clone();
            let mut missed = |from: DVec3, direction: DVec3, hit: Hit| {
                let (word, mask) = (hit.object.index() / 64, 1 << (hit.object.index() % 64));
                let to = from + direction * hit.t;
                if row[word] & mask == 0 && prover.proves(from, to, hit).is_some() {
                    row[word] |= mask;
                    shown.proofs.push((hit.object.0, [from, to]));
                }
            };
            if let Some(hits) = look(prover.rays, &region, &known, count, &mut random, &mut missed) {
                bound.look(hits, count);
            }
        }
        (bound.0, shown)
    };
    let results: Vec<(f64, Shown)> = work.map(&views.iter().enumerate().collect::<Vec<_>>(), from)?;
    let taken = results.into_iter().enumerate().map(|(v, (bound, shown))| {
        rows.rays += shown.rays;
        for (object, segment) in shown.proofs {
            if rows.lower.set(v, object as usize) {
                proofs.push((v as u32, object, segment));
            }
        }
        bound
    });
    Ok(taken.collect())
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
            let Hit { object: ObjectId(object), .. } = hit;
            let (word, mask) = (object as usize / 64, 1 << (object % 64));
            let to = from + direction * hit.t;
            if known[word] & mask == 0 && prover.proves(from, to, hit).is_some() {
                known[word] |= mask;
                shown.proofs.push((object, [from, to]));
            }
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
