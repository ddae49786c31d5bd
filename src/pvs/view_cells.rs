//! Both sides of what can be seen from view cells: regions that may lie across cells, and that bound nothing.
//!
//! **Upper**: a line from a point of a region to an object that doesn't touch the region leaves it for the last time through its
//! boundary, and goes on through cells from there. So the region is laid out as one more cell, from which portals, the facets of
//! its pieces, lead into every cell that goes on beyond them; and flow searches from that cell alone. Facets beyond which no cell
//! goes on lie on walls or in them. What is nearer than the clearance is promised nothing, as everywhere; windows are widened by
//! it.
//!
//! **Lower**: witnesses of cells that begin in the region, then rays from it (`sampling::regions`).

use super::facets::facet;
use super::flow::{FlowInput, flow};
use super::options::PvsOptions;
use super::sampling::confidence::doubt_of;
use super::sampling::regions::RegionSampler;
use super::sampling::witness::{PLACEMENT_MARGIN, Prover};
use super::{Guarantee, Pvs};
use crate::cells::{Cell, CellGraph, Locator, Placement, Portal, PortalKind, PortalState, ViewCell, place_objects};
use crate::geom::{Aabb, Plane, clip};
use crate::job::{Job, Stopped};
use crate::scene::Scene;
use crate::scene::rays::RayScene;
use crate::types::bounds::{CONFIDENCE, percent};
use crate::types::placed::PlacedBox;
use crate::{BitMatrix, CellId};
use glam::DVec3;

/// The sampling of view cells may cost this fraction of a bake's rays, on top of them.
const SHARE: f64 = 0.5;
/// Towards a goal the first round has this many rays; each has twice those of the one before.
const FIRST: u64 = 1_000_000;
/// Rows of more view cells than this, where what was witnessed is shipped, aim at what their cells may see; of fewer, at what flow leaves.
const MANY: usize = 32;
/// Of that, this fraction tests what the others found.
const TESTED: f64 = 0.2;
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
    /// Of the mean over view cells.
    pub unseen_mean: f64,
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
    let clearance = scene.tolerance().clearance;
    // 1. Witnesses of cells that begin in a region.
    let (rays, locator) = (RayScene::with_closed_holes(scene, &graph.closed_holes), Locator::new(graph));
    let prover = Prover { rays: &rays, locator: &locator, clearance };
    let mut sampler = RegionSampler::new(prover, pvs, views, options.seed);
    sampler.take_from_cells();
    // 2. Flow from each region.
    let region = |view: &ViewCell| Cell { pieces: view.pieces.clone(), ..Cell::default() };
    let regions = CellGraph { cells: views.iter().map(region).collect(), portals: Vec::new(), ..graph.clone() };
    let touching = place_objects(scene, &regions, PLACEMENT_MARGIN * clearance).matrix;
    let bounds: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();
    let (mut upper, mut in_no_cell, mut capped) = (BitMatrix::new(views.len(), scene.objects.len()), Vec::new(), 0);
    let by_cells = options.ship == Guarantee::Sampled && views.len() > MANY;
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
        let ways = ways_out(graph, &locator, view, clearance);
        if ways.is_empty() {
            in_no_cell.push(v);
        }
        let inserted = Inserted { graph, ways, touching: touching.row(v), known: sampler.lower.row(v) };
        let coplanar = scene.tolerance().coplanar;
        capped += inserted.flow(&pvs.placement, &bounds, options, coplanar, upper.row_mut(v), work)?;
    }
    // 3. Cubes and rays at what is left, and tests, until the goal is reached or all rays are cast.
    let budget = (options.ray_budget as f64 * SHARE) as u64;
    let count = views.len().max(1) as u64;
    for number in 0.. {
        let left = budget.saturating_sub(sampler.rays());
        let round = if options.unseen.is_some() { left.min(FIRST << number.min(40)) } else { left };
        let to_test = (round as f64 * TESTED) as u64;
        sampler.sample(&upper, sampler.rays() + round - to_test, work)?;
        if to_test < count {
            break;
        }
        let doubt = if options.unseen.is_some() { doubt_of(number) } else { 1.0 - CONFIDENCE };
        sampler.test(to_test / count, doubt, work)?;
        work.tell(&format!("unseen from view cells {}", percent(sampler.mean())), (number + 1) as f64 / 8.0);
        if options.unseen.is_none_or(|goal| sampler.mean() <= goal) {
            break;
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
        placement: &Placement,
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
        (0..here).for_each(|cell| places.row_mut(cell).copy_from_slice(placement.matrix.row(cell)));
        places.row_mut(here).copy_from_slice(self.touching);
        // What touches the region is met wherever it is.
        let touching = places.ones(here).map(|_| PlacedBox::WHOLE);
        let placed_boxes = placement.boxes.as_ref().map(|boxes| boxes.iter().copied().chain(touching).collect::<Vec<_>>());
        let input = FlowInput {
            graph: &graph,
            placement: &places,
            placed_boxes: placed_boxes.as_deref(),
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
