//! Both bounds of the PVS of view cells: regions that may cross cells and do not affect the portals.
//!
//! **Upper**: a line from a point of a region to an object outside it crosses the region's boundary a last time and continues through
//! cells. So the region becomes one more cell of the graph. Its portals are the facets of its pieces; they lead into every cell on their
//! far side. Flow searches from that cell only, through the PVS of these neighbours. Facets with no cell behind them lie on or in walls. As
//! everywhere, nothing is guaranteed within the clearance; windows are widened by it.
//!
//! **Lower**: witnesses of cells that start in the region, then rays from it (`sampling::regions`).

use super::beyond::{Beyond, Source};
use super::budget::Budget;
use super::facets::facet;
use super::options::PvsOptions;
use super::sampling::goal::{Rounds, reach};
use super::sampling::regions::RegionSampler;
use super::sampling::witness::{PLACEMENT_MARGIN, Prover};
use super::triangles::Triangles;
use super::{Guarantee, Pvs};
use crate::cells::{Cell, CellGraph, Locator, Portal, PortalKind, PortalState, ViewCell, place_objects};
use crate::job::{Job, Stopped};
use crate::math::geom::{Aabb, Plane, clip};
use crate::scene::Scene;
use crate::scene::rays::RayScene;
use crate::types::bounds::CONFIDENCE;
use crate::{BitMatrix, CellId};
use glam::DVec3;

/// With sampled rows and more view cells than this, sampling targets the upper bound of their cells; with fewer, the result of flow.
const MANY: usize = 32;
/// Number of view cells in the trial of whether view cells pay off; fewer for a large graph. More: the trial takes as long as the full run.
/// Fewer: the result is random.
const TRIED: [usize; 2] = [3, 12];
/// Budget of pairs of directed portals for all trials above the minimum.
const TRIED_PAIRS: usize = 250_000_000;
/// A facet that overlaps more pieces of a cell than this becomes one portal into it.
const WHOLE: usize = 8;

/// The PVS of each view cell. `lower` is a subset of `upper`.
#[derive(Clone, PartialEq, Debug)]
pub struct ViewRows {
    /// View cells x objects: pairs with a witness.
    pub lower: BitMatrix,
    /// View cells x objects: pairs not proven hidden.
    pub upper: BitMatrix,
    /// A segment for each pair of `lower`, from a point in the view cell to a point on the object, by view cell, then object.
    pub witnesses: Vec<[DVec3; 2]>,
    /// View cells outside all cells: they see only the objects that touch them.
    pub in_no_cell: Vec<usize>,
    /// Bound of the unseen part of each view cell, as [`Unseen::cells`](crate::types::bounds::Unseen::cells). 1 without rays.
    pub unseen: Vec<f64>,
    /// The bound of the mean over view cells.
    pub unseen_mean: f64,
    /// Rays cast.
    pub rays: u64,
    /// Source portals whose flow ran out of steps and kept all candidates.
    pub capped: u64,
    /// Pairs proven visible that flow had culled; they were added to `upper`.
    pub contradictions: u64,
}

/// View cells sampled towards a goal.
struct Regions<'r, 'a> {
    sampler: &'r mut RegionSampler<'a>,
    upper: &'r BitMatrix,
}

impl Rounds for Regions<'_, '_> {
    fn rays(&self) -> u64 {
        self.sampler.rays()
    }

    fn regions(&self) -> u64 {
        self.upper.rows() as u64
    }

    fn sample(&mut self, rays: u64, work: &Job<'_>) -> Result<bool, Stopped> {
        self.sampler.sample(self.upper, rays, work).map(|()| true)
    }

    fn test(&mut self, rays: u64, doubt: f64, work: &Job<'_>) -> Result<(), Stopped> {
        self.sampler.test(rays, doubt, work)
    }

    fn unseen(&self) -> f64 {
        self.sampler.mean()
    }
}

/// Computes both bounds of visibility from `views`, given the bake of the cells. Casts at most `options.ray_budget` rays.
///
/// # Errors
///
/// If it was stopped.
pub fn bake(
    scene: &Scene,
    pvs: &Pvs,
    views: &[ViewCell],
    options: &PvsOptions,
    work: &Job<'_>,
) -> Result<ViewRows, Stopped> {
    let graph = &pvs.graph;
    let clearance = scene.tolerance().clearance;
    // 1. Witnesses of cells that start in a region.
    let (rays, locator) = (RayScene::with_closed_holes(scene, &graph.closed_holes), Locator::new(graph));
    let prover = Prover { rays: &rays, locator: &locator, clearance };
    let mut sampler = RegionSampler::new(prover, pvs, views, options.seed);
    sampler.take_from_cells();
    // 2. Flow from each region.
    let uppers = RegionFlow::new(scene, pvs, &locator, views, options);
    let (mut upper, mut in_no_cell, mut capped) = (BitMatrix::new(views.len(), scene.objects.len()), Vec::new(), 0);
    let by_cells = options.rows_from == Guarantee::Sampled && views.len() > MANY;
    for (v, view) in views.iter().enumerate() {
        work.tell("view cells", v as f64 / views.len() as f64);
        if by_cells {
            let mut any = false;
            for piece in &view.pieces {
                locator.pieces_in_box(&piece.bounds.inflated(clearance), |cell, _| {
                    any = true;
                    let row = upper.row_mut(v).iter_mut().zip(pvs.objects_upper.row(cell.index()));
                    row.for_each(|(all, seen)| *all |= seen);
                });
            }
            if !any {
                in_no_cell.push(v);
            }
            continue;
        }
        match uppers.set(v, sampler.lower.row(v), upper.row_mut(v), work)? {
            Some(more) => capped += more,
            None => in_no_cell.push(v),
        }
    }
    // 3. Cubes and rays at the remaining pairs, and tests.
    let rays = options.ray_budget;
    match options.unseen {
        Some(goal) => _ = reach(goal, rays, &mut Regions { sampler: &mut sampler, upper: &upper }, work)?,
        None => {
            let tests = Budget::view_cell_tests(rays);
            sampler.sample(&upper, rays - tests, work)?;
            let each = tests / views.len().max(1) as u64;
            if each > 0 {
                sampler.test(each, 1.0 - CONFIDENCE, work)?;
            }
        }
    }
    let (unseen, mean) = (sampler.unseen(), sampler.mean());
    // 4. The lower set is a subset of the upper one.
    let (lower, witnesses, rays) = sampler.close();
    let before = upper.count_ones();
    upper.union_with(&lower);
    let contradictions = upper.count_ones() - before;
    Ok(ViewRows { lower, upper, witnesses, in_no_cell, unseen, unseen_mean: mean, rays, capped, contradictions })
}

/// The reduction of potentially visible triangles by rows of view cells, from flow alone, estimated on some of them: a share in [0, 1].
/// `eyes`: for each view cell, the cells of the viewpoints in it.
///
/// # Errors
///
/// If it was stopped.
pub(crate) fn saving(
    scene: &Scene,
    pvs: &Pvs,
    views: &[ViewCell],
    eyes: &[Vec<usize>],
    options: &PvsOptions,
    work: &Job<'_>,
) -> Result<f64, Stopped> {
    let (locator, triangles) = (Locator::new(&pvs.graph), Triangles::of(scene));
    let uppers = RegionFlow::new(scene, pvs, &locator, views, options);
    let words = scene.objects.len().div_ceil(64);
    let [mut before, mut after] = [0; 2];
    let pairs = (2 * pvs.graph.portals.len()).pow(2).max(1);
    let tried = (TRIED_PAIRS / pairs).clamp(TRIED[0], TRIED[1]);
    for v in (0..views.len()).step_by(views.len().div_ceil(tried).max(1)) {
        work.tell("view cells: trial", v as f64 / views.len() as f64);
        let mut row = vec![0; words];
        uppers.set(v, &vec![0; words], &mut row, work)?;
        for &cell in &eyes[v] {
            let of_cell = pvs.objects_upper.row(cell);
            before += triangles.in_row(of_cell.iter().copied());
            after += triangles.in_row(of_cell.iter().zip(&row).map(|(a, b)| a & b));
        }
    }
    Ok(if before == 0 { 0.0 } else { 1.0 - after as f64 / before as f64 })
}

/// Computes the upper bound of regions.
struct RegionFlow<'a> {
    pvs: &'a Pvs,
    locator: &'a Locator<'a>,
    views: &'a [ViewCell],
    /// Views x objects: objects that touch the view cell.
    touching: BitMatrix,
    beyond: Beyond<'a>,
    clearance: f64,
}

impl<'a> RegionFlow<'a> {
    fn new(scene: &Scene, pvs: &'a Pvs, locator: &'a Locator<'a>, views: &'a [ViewCell], options: &'a PvsOptions) -> Self {
        let clearance = scene.tolerance().clearance;
        let region = |view: &ViewCell| Cell { pieces: view.pieces.clone(), ..Cell::default() };
        let regions = CellGraph { cells: views.iter().map(region).collect(), portals: Vec::new(), ..pvs.graph.clone() };
        let touching = place_objects(scene, &regions, PLACEMENT_MARGIN * clearance).matrix;
        Self { pvs, locator, views, touching, beyond: Beyond::new(scene, pvs, options), clearance }
    }

    /// Sets the upper row of a view cell; `known` is proven visible. Returns the number of searches that ran out of steps, or `None` if the
    /// view cell is outside all cells.
    fn set(&self, v: usize, known: &[u64], row: &mut [u64], work: &Job<'_>) -> Result<Option<u64>, Stopped> {
        let ways = ways_out(&self.pvs.graph, self.locator, &self.views[v], self.clearance);
        let source = Source { ways: &ways, touching: self.touching.row(v), known, without: None };
        let seen = self.beyond.see(&source, work)?;
        row.copy_from_slice(&seen.objects);
        Ok((!ways.is_empty()).then_some(seen.capped))
    }
}

/// The portals out of a region: the parts of its facets with a cell on the far side. They lead into that cell from cell
/// `graph.cells.len()`, which stands for the region.
fn ways_out(graph: &CellGraph, locator: &Locator<'_>, view: &ViewCell, clearance: f64) -> Vec<Portal> {
    let mut ways = Vec::new();
    for (k, piece) in view.pieces.iter().enumerate() {
        let within = piece.bounds.inflated(1.0 + piece.bounds.diagonal());
        for (i, &plane) in piece.planes.iter().enumerate() {
            // A cell is on the far side of a facet if it contains the facet's points moved outwards by a step.
            let step = plane.n * (2.0 * clearance);
            let beyond = |p: &Plane, wider: f64| Plane { d: p.d - p.n.dot(step) + wider, ..*p };
            // Parts of the facet that lead into another piece of the region are no exits.
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

/// The convex parts of a convex polygon outside a convex set.
fn outside(polygon: Vec<DVec3>, planes: &[Plane]) -> Vec<Vec<DVec3>> {
    let (mut parts, mut rest) = (Vec::new(), polygon.clone());
    for plane in planes {
        if rest.is_empty() {
            // It is entirely outside the set: returned whole, not in parts.
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
