//! Both bounds, step by step: sampling, portal flow, occluders, and repairs between them.

use super::again::{Again, Hints};
use super::backfaces::Fronts;
use super::budget::Budget;
use super::flow::{FlowInput, FlowResult, flow};
use super::sampling::witness::{PLACEMENT_MARGIN, Witnessed};
use super::sampling::{self, Plan, Strategy, aimed};
use super::{Pvs, PvsOptions, PvsStats, Repair, SamplingEnd, Unseen, occluders, repair};
use crate::cells::{CellGraph, Placement, place_objects};
use crate::job::{Job, Stopped};
use crate::math::geom::Aabb;
use crate::scene::rays::RayScene;
use crate::scene::{Object, Scene};
use crate::types::bounds::percent;
use crate::types::note::Note;
use crate::{BitMatrix, ObjectId};

/// Most rounds of repair: a repaired hole may reveal the next one.
const MENDINGS: usize = 4;
/// Pairs that rays reached without a proof count as visible if they are fewer than this fraction of the upper set of objects. Larger: rows
/// grow by objects visible through cracks only. Smaller: more objects visible within the clearance of a surface are missing from the rows.
const MET: f64 = 0.01;

/// Computes both bounds for every cell.
///
/// # Errors
///
/// If it was stopped in a step from which no upper bound is left; otherwise [`Pvs::is_whole`] is `false`.
pub fn bake(scene: &Scene, graph: CellGraph, options: &PvsOptions, work: &Job<'_>) -> Result<Pvs, Stopped> {
    bake_by(&RayScene::with_closed_holes(scene, &graph.closed_holes), graph, options, None, work)
}

/// As [`bake`], with rays that end at the graph's closed holes, and with what the last bake tells.
pub(crate) fn bake_by(
    rays: &RayScene<'_>,
    graph: CellGraph,
    options: &PvsOptions,
    hints: Option<&Hints>,
    work: &Job<'_>,
) -> Result<Pvs, Stopped> {
    let mut bake = Bake::new(rays, graph, (options, hints), work);
    // 1. The lower bound: proofs by rays and cubes; and a bound of the unseen part.
    bake.sample()?;
    // 2. Holes in the graph, found by these proofs.
    work.tell("holes", 0.0);
    bake.mend();
    // 3. The upper bound: portal flow, which skips proven pairs.
    let mut upper = bake.flow()?;
    let is_whole = bake.refine(&mut upper)?;
    Ok(Pvs { is_whole, ..bake.close(upper) })
}

/// The state of a bake.
struct Bake<'a> {
    scene: &'a Scene,
    rays: &'a RayScene<'a>,
    options: &'a PvsOptions,
    /// What the last bake tells.
    hints: Option<&'a Hints>,
    budget: Budget,
    work: &'a Job<'a>,
    graph: CellGraph,
    /// The objects in each cell.
    placement: Placement,
    fronts: Fronts,
    object_bounds: Vec<Aabb>,
    lower: Witnessed,
    /// Cells x objects: pairs that occluders leave undecided down to the tolerance.
    unresolved: BitMatrix,
    repairs: Vec<Repair>,
    /// Numbers of witnesses and sights checked against the graph.
    followed: [usize; 2],
    /// The bound of the unseen part, and why sampling ended.
    sampled: (Option<Unseen>, SamplingEnd),
    again: Option<Again>,
}

impl<'a> Bake<'a> {
    fn new(
        rays: &'a RayScene<'a>,
        mut graph: CellGraph,
        (options, hints): (&'a PvsOptions, Option<&'a Hints>),
        work: &'a Job<'a>,
    ) -> Self {
        let scene = rays.scene();
        work.tell("placement", 0.0);
        graph.round(scene);
        let (cells, objects) = (graph.cells.len(), scene.objects.len());
        Self {
            placement: place_objects(scene, &graph, PLACEMENT_MARGIN * scene.tolerance().clearance),
            fronts: Fronts::new(scene, &graph),
            object_bounds: scene.objects.iter().map(Object::extent).collect(),
            lower: Witnessed { most_witnesses: options.most_witnesses, ..Witnessed::new(cells, objects) },
            unresolved: BitMatrix::new(cells, objects),
            repairs: Vec::new(),
            followed: [0, 0],
            sampled: (None, SamplingEnd::Rays),
            again: None,
            scene,
            rays,
            options,
            hints,
            budget: Budget::of_cells(options.ray_budget),
            work,
            graph,
        }
    }

    /// Runs rays and cubes by schedule, and test rays; after an edit fewer, once the last bake's witnesses are held against the triangles of today.
    fn sample(&mut self) -> Result<(), Stopped> {
        let Self { rays, options, hints, budget, work, graph, lower, .. } = self;
        work.tell("sampling", 0.0);
        if let Some(hints) = hints {
            let found = hints.witnessed(rays, graph, work)?;
            found.into_iter().for_each(|found| _ = lower.merge(found));
            *budget = budget.again(hints.share_new());
        }
        let (goal, to_test) = (options.unseen, budget.tests);
        // Towards a goal, sampling and tests share their rays.
        let rays_of_plan = budget.sampling + if goal.is_some() { to_test } else { 0 };
        let plan = Plan { strategy: Strategy::Scheduled, seed: options.seed, budget: rays_of_plan, to_test, goal };
        let (unseen, end) = sampling::sample(rays, graph, plan, lower, work)?;
        let short = goal.is_some() && end == SamplingEnd::Rays && lower.left_out > 0;
        let end = if short { SamplingEnd::Memory } else { end };
        graph.notes.append(&mut lower.notes);
        graph.notes.extend(goal.zip(unseen.as_ref()).map(|(goal, unseen)| reached(goal, unseen, end, lower.rays)));
        if goal.is_some() {
            *budget = budget.after_goal(lower.rays);
        }
        self.sampled = (unseen, end);
        Ok(())
    }

    /// Adds missing portals according to new proofs; true if there were any.
    fn mend(&mut self) -> bool {
        let before = self.repairs.len();
        for _ in 0..MENDINGS {
            let found = repair::mend(self.scene, &mut self.graph, &self.lower, self.followed);
            if found.is_empty() {
                break;
            }
            self.graph.round(self.scene);
            self.repairs.extend(found);
        }
        self.followed = [self.lower.witnesses.len(), self.lower.sights.len()];
        self.repairs.len() > before
    }

    /// Portal flow, with back-face culling.
    fn flow(&self) -> Result<FlowResult, Stopped> {
        let lower = &self.lower;
        let known = self.hints.map(|hints| {
            let [mut cells, mut objects] = hints.assumed(&self.graph, &self.placement.matrix);
            cells.union_with(&lower.cells);
            objects.union_with(&lower.objects);
            [cells, objects]
        });
        let [cells_lower, objects_lower] = known.as_ref().map_or([&lower.cells, &lower.objects], |known| known.each_ref());
        let input = FlowInput {
            graph: &self.graph,
            placement: &self.placement.matrix,
            placed_boxes: self.placement.boxes.as_deref(),
            object_bounds: &self.object_bounds,
            cells_lower,
            objects_lower,
            max_steps: self.options.flow_steps,
            coplanar: self.scene.tolerance().coplanar,
            fronts: Some(&self.fronts),
        };
        let mut upper = flow(&input, self.work)?;
        let FlowResult { cells_upper, objects_upper, .. } = &mut upper;
        self.fronts.hide(&self.graph, &self.lower.objects, cells_upper, objects_upper);
        Ok(upper)
    }

    /// Decides more pairs. `false`: it was stopped, and both bounds are sound as far as they are.
    fn refine(&mut self, upper: &mut FlowResult) -> Result<bool, Stopped> {
        // 4. The remaining rays, aimed at undecided pairs; and holes found by them, through which flow has to go.
        if self.aim(upper).is_err() {
            return Ok(false);
        }
        if self.mend() {
            *upper = self.flow()?;
        }
        // 5. Undecided pairs tested against triangles; after a repair, flow and this step run again.
        for _ in 0..MENDINGS {
            if self.occlude(upper).is_err() {
                return Ok(false);
            }
            if !self.mend() {
                break;
            }
            *upper = self.flow()?;
        }
        Ok(true)
    }

    /// Aims rays at undecided pairs; after an edit, at those that the last bake does not know.
    fn aim(&mut self, upper: &FlowResult) -> Result<(), Stopped> {
        let Self { rays, options, hints, budget, work, graph, placement, lower, .. } = self;
        let FlowResult { cells_upper, objects_upper, .. } = upper;
        let (pairs, placement) = (hints.map(|hints| hints.to_aim_at(objects_upper)), &placement.matrix);
        let undecided = match &pairs {
            // No pairs of cells: nothing follows from them.
            Some(pairs) => aimed::Undecided { cells_upper: &lower.cells.clone(), objects_upper: pairs, placement },
            None => aimed::Undecided { cells_upper, objects_upper, placement },
        };
        aimed::sample(rays, graph, undecided, options.seed, budget.cells(), lower, work)
    }

    /// Removes pairs hidden by triangles from the upper set.
    fn occlude(&mut self, upper: &mut FlowResult) -> Result<(), Stopped> {
        let Self { rays, options, hints, budget, work, graph, placement, object_bounds, lower, unresolved, .. } = self;
        let FlowResult { cells_upper, objects_upper, .. } = upper;
        let placement = &placement.matrix;
        let anew = hints.map(|hints| hints.cells_anew(objects_upper));
        let leave = hints.zip(anew.as_ref()).map(|(hints, anew)| hints.to_leave(graph, objects_upper, anew, object_bounds));
        let hidden = |upper: &BitMatrix| hints.zip(anew.as_ref()).map_or(0, |(hints, anew)| hints.hidden(upper, anew));
        let before = hidden(objects_upper);
        let bounds = occluders::Bounds { placement, cells_upper, objects_upper, lower, unresolved, leave: leave.as_ref() };
        occluders::decide(rays, graph, (budget.shafts, options.seed), bounds, work)?;
        self.again = anew.as_ref().map(|anew| Again {
            cells: anew.len(),
            cells_anew: anew.iter().filter(|anew| **anew).count(),
            hidden: before,
            hidden_again: before - hidden(objects_upper),
        });
        Ok(())
    }

    /// Makes the lower set a subset of the upper one: contradictions become visible, and are counted.
    fn close(mut self, upper: FlowResult) -> Pvs {
        let FlowResult { mut cells_upper, mut objects_upper, steps, capped } = upper;
        let mut stats = PvsStats {
            rays: self.lower.rays,
            cubes: self.lower.cubes,
            flow_steps: steps,
            flow_over_budget: capped,
            ..PvsStats::default()
        };
        let pairs = |cells: &BitMatrix, objects: &BitMatrix| cells.count_ones() + objects.count_ones();
        let before = pairs(&cells_upper, &objects_upper);
        cells_upper.union_with(&self.lower.cells);
        objects_upper.union_with(&self.lower.objects);
        stats.contradictions = pairs(&cells_upper, &objects_upper) - before;
        debug_assert_eq!(self.lower.objects.first_outside(&objects_upper), None);
        debug_assert_eq!(self.lower.cells.first_outside(&cells_upper), None);
        [stats.kept_unproven, stats.left_out_unproven] = keep_met(&self.lower, &mut objects_upper);
        join_groups(&self.scene.together, &mut objects_upper);
        self.lower.failed.keys().for_each(|&(cell, object)| _ = self.unresolved.set(cell as usize, object as usize));

        if self.lower.left_out > 0 {
            let note = format!("memory: {} proofs left out; their pairs count as undecided (--memory)", self.lower.left_out);
            self.graph.notes.push(Note::cost(note));
        }
        let Witnessed { cells: cells_lower, objects: objects_lower, mut witnesses, .. } = self.lower;
        witnesses.sort_by_key(|w| (w.cell, w.object));
        Pvs {
            graph: self.graph,
            cells_lower,
            cells_upper,
            objects_lower,
            objects_upper,
            placement: self.placement,
            unresolved: self.unresolved,
            witnesses,
            unseen: self.sampled.0,
            sampling_end: self.sampled.1,
            is_whole: true,
            guarantee: self.options.rows_from,
            clusters: Vec::new(),
            repairs: self.repairs,
            stats,
            again: self.again,
        }
    }
}

/// A note on the accuracy goal and the result.
fn reached(goal: f64, unseen: &Unseen, end: SamplingEnd, rays: u64) -> Note {
    let (goal, bound) = (percent(goal), percent(unseen.mean));
    let kind: fn(String) -> Note = if end == SamplingEnd::Unseen { Note::taken } else { Note::fault };
    kind(match end {
        SamplingEnd::Unseen => format!("unseen: at most {bound} after {rays} rays; the goal was {goal}"),
        SamplingEnd::Rays => {
            format!("unseen: at most {bound}; the goal of {goal} was not reached with all {rays} rays (--rays)")
        }
        SamplingEnd::Memory => {
            format!(
                "unseen: at most {bound}; the goal of {goal} was not reached before memory ran out, after {rays} rays (--memory)"
            )
        }
    })
}

/// Adds all pairs outside the upper set that rays reached without a proof, if they are fewer than [`MET`] of it. Returns the numbers of
/// added and omitted pairs.
fn keep_met(lower: &Witnessed, objects_upper: &mut BitMatrix) -> [u64; 2] {
    let pairs = lower.failed.keys().map(|&(cell, object)| (cell as usize, object as usize));
    let met: Vec<(usize, usize)> = pairs.filter(|&(cell, object)| !objects_upper.get(cell, object)).collect();
    let count = met.len() as u64;
    if count as f64 >= MET * objects_upper.count_ones() as f64 {
        return [0, count];
    }
    met.into_iter().for_each(|(cell, object)| _ = objects_upper.set(cell, object));
    [count, 0]
}

/// A group that is drawn or hidden together is visible if any of its objects is.
fn join_groups(groups: &[Vec<ObjectId>], objects_upper: &mut BitMatrix) {
    for group in groups {
        for cell in 0..objects_upper.rows() {
            if group.iter().any(|o| objects_upper.get(cell, o.index())) {
                group.iter().for_each(|o| _ = objects_upper.set(cell, o.index()));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rays_met_is_kept_where_it_costs_less_than_a_hundredth() {
        let mut lower = Witnessed::new(3, 400);
        lower.failed = [((1, 7), 12), ((2, 9), 1), ((0, 5), 3)].into_iter().collect();
        // The first of the three is already in the upper set.
        let upper_of = |pairs: usize| {
            let mut upper = BitMatrix::new(3, 400);
            (0..pairs).for_each(|object| _ = upper.set(1, object));
            upper
        };
        let (mut few, mut many) = (upper_of(200), upper_of(201));
        assert_eq!((keep_met(&lower, &mut few), few.count_ones()), ([0, 2], 200));
        assert_eq!((keep_met(&lower, &mut many), many.count_ones()), ([2, 0], 203));
        assert!(many.get(2, 9) && many.get(0, 5));
    }
}
