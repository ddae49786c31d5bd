//! What can be seen from each cell: both sides of it.
//!
//! [`bake`] is the main path. The lower bound: [`sampling`], with the engines of [`cubes`]. The upper bound: `flow`, then `occluders`. Where
//! the two contradict each other: `repair`. Both for regions across cells: `view_cells`.
//! Single pairs once more, with the reason: `pair_proof`.

pub mod cubes;
mod facets;
pub mod flow;
mod occluders;
mod options;
pub mod pair_proof;
mod repair;
pub mod sampling;
pub mod view_cells;

pub use crate::types::bounds::{CONFIDENCE, Unseen};
pub use crate::types::guarantee::Guarantee;
pub use crate::types::proof::{Repair, Witness};
pub use crate::types::stats::PvsStats;
pub use options::PvsOptions;

use crate::BitMatrix;
use crate::cells::{CellGraph, place_objects};
use crate::geom::Aabb;
use crate::job::{Job, Stopped};
use crate::scene::Scene;
use crate::scene::rays::RayScene;
use flow::{FlowInput, FlowResult, flow};
use glam::DVec3;
use sampling::confidence;
use sampling::witness::{Lower, PLACEMENT_MARGIN};
use sampling::{Plan, Strategy, aimed};

/// The result of a bake: lower and upper sets over cells and over objects. `lower` is a subset of `upper`.
#[derive(Clone, PartialEq, Debug)]
pub struct Pvs {
    /// Cells x cells; the diagonal is set.
    pub cells_lower: BitMatrix,
    /// Cells x cells; the diagonal is set.
    pub cells_upper: BitMatrix,
    /// Cells x objects.
    pub objects_lower: BitMatrix,
    /// Cells x objects.
    pub objects_upper: BitMatrix,
    /// Cells x objects: which objects are in which cell.
    pub placement: BitMatrix,
    /// Cells x objects: pairs that rays reached or shafts closed in on, but nothing clears or shuts down to the tolerance.
    pub narrow: BitMatrix,
    /// One for each pair of `objects_lower`, ordered by cell, then object.
    pub witnesses: Vec<Witness>,
    /// How much there is to see that nobody has seen, at most; `None` where no rays were cast to tell.
    pub unseen: Option<Unseen>,
    /// Which side to ship.
    pub guarantee: Guarantee,
    /// Holes found and mended.
    pub repairs: Vec<Repair>,
    /// Counters.
    pub stats: PvsStats,
}

/// Of the rays of a bake, this fraction is kept for the pairs that flow leaves undecided.
const AIMED: f64 = 0.15;
/// Of the rays of a bake, this fraction tests what the others found.
const TESTED: f64 = 0.05;
/// Rounds of mending, at most: a mended hole may show the next one.
const MENDINGS: usize = 4;

/// What a witness takes while it is worked with, bytes.
pub const WITNESS_BYTES: u64 = (size_of::<Witness>() + size_of::<DVec3>()) as u64;

/// Works out what can be seen from every cell. `graph` is changed only where a witness proves that a portal is missing, and in its notes.
///
/// # Errors
///
/// Where it was stopped; the graph may have been mended by then.
pub fn bake(scene: &Scene, graph: &mut CellGraph, options: &PvsOptions, work: &Job<'_>) -> Result<Pvs, Stopped> {
    // 1. Which objects are in which cell.
    work.tell("placement", 0.0);
    let tolerance = scene.tolerance();
    let placement = place_objects(scene, graph, PLACEMENT_MARGIN * tolerance.clearance);
    let object_bounds: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();

    // 2. The lower bound: what rays and cubes show, with proofs; and how much that misses.
    work.tell("sampling", 0.0);
    let rays = RayScene::new(scene);
    let mut lower = Lower { most_witnesses: options.most_witnesses, ..Lower::new(graph.cells.len(), scene.objects.len()) };
    let share = |part: f64| (options.ray_budget as f64 * part) as u64;
    let first = options.ray_budget - share(AIMED) - share(TESTED);
    let plan = Plan { strategy: Strategy::Scheduled, cubes: options.cubes, seed: options.seed, budget: first };
    sampling::sample(&rays, graph, plan, &mut lower, work)?;
    graph.notes.append(&mut lower.notes);

    let to_test = share(TESTED);
    let mut test = || confidence::test(&rays, graph, options.seed, to_test, &mut lower, work);
    let unseen = (to_test > 0).then(&mut test).transpose()?;

    // 3. Holes that the proofs show in the graph.
    let mut repairs = Vec::new();
    let mut mend = |graph: &mut CellGraph, lower: &Lower, known: [usize; 2]| {
        let found = (0..MENDINGS).map_while(|_| Some(repair::mend(scene, graph, lower, known)).filter(|r| !r.is_empty()));
        let before = repairs.len();
        repairs.extend(found.flatten());
        repairs.len() > before
    };
    work.tell("holes", 0.0);
    mend(graph, &lower, [0, 0]);

    // 4. The upper bound: portal flow, which need not look for what is proven.
    let upper = |graph: &CellGraph, lower: &Lower| {
        let (cells_lower, objects_lower, max_steps) = (&lower.cells, &lower.objects, options.flow_steps);
        let (placement, object_bounds, coplanar) = (&placement, object_bounds.as_slice(), tolerance.coplanar);
        flow(&FlowInput { graph, placement, object_bounds, cells_lower, objects_lower, max_steps, coplanar }, work)
    };
    let mut flowed = upper(graph, &lower)?;

    // 5. The rays that are left, aimed at what is undecided; and what holes those show.
    let known = [lower.witnesses.len(), lower.sights.len()];
    let FlowResult { cells_upper, objects_upper, .. } = &flowed;
    let undecided = aimed::Undecided { cells_upper, objects_upper, placement: &placement };
    aimed::sample(&rays, graph, undecided, options, options.ray_budget, &mut lower, work)?;
    if mend(graph, &lower, known) {
        flowed = upper(graph, &lower)?;
    }

    // 6. What portals can't tell is asked of the triangles; where that shows a hole, everything before it is asked anew.
    let mut narrow = BitMatrix::new(graph.cells.len(), scene.objects.len());
    for _ in 0..MENDINGS {
        let known = [lower.witnesses.len(), lower.sights.len()];
        let FlowResult { cells_upper, objects_upper, .. } = &mut flowed;
        occluders::decide(&rays, graph, &placement, options, cells_upper, objects_upper, &mut lower, &mut narrow, work)?;
        if !mend(graph, &lower, known) {
            break;
        }
        flowed = upper(graph, &lower)?;
    }

    // 7. The lower set is a subset of the upper one: what still contradicts it is called visible, and counted.
    let FlowResult { mut cells_upper, mut objects_upper, steps, capped } = flowed;
    lower.failed.keys().for_each(|&(cell, object)| _ = narrow.set(cell as usize, object as usize));
    let outside = lower.failed.keys().filter(|&&(cell, object)| !objects_upper.get(cell as usize, object as usize));
    let mut stats =
        PvsStats { rays: lower.rays, cubes: lower.cubes, flow_steps: steps, flow_capped: capped, ..PvsStats::default() };
    stats.cracks = outside.count() as u64;
    let pairs = |cells: &BitMatrix, objects: &BitMatrix| cells.count_ones() + objects.count_ones();
    let before = pairs(&cells_upper, &objects_upper);
    cells_upper.union_with(&lower.cells);
    objects_upper.union_with(&lower.objects);
    stats.contradictions = pairs(&cells_upper, &objects_upper) - before;
    debug_assert_eq!((lower.objects.first_outside(&objects_upper), lower.cells.first_outside(&cells_upper)), (None, None));

    if lower.left_out > 0 {
        graph.notes.push(format!("memory: {} proofs left out; their pairs count as undecided", lower.left_out));
    }
    let Lower { cells: cells_lower, objects: objects_lower, mut witnesses, .. } = lower;
    witnesses.sort_by_key(|w| (w.cell, w.object));
    let guarantee = options.ship;
    Ok(Pvs {
        cells_lower,
        cells_upper,
        objects_lower,
        objects_upper,
        placement,
        narrow,
        witnesses,
        unseen,
        guarantee,
        repairs,
        stats,
    })
}
