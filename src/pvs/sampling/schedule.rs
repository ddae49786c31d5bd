//! The distribution of rays: two thirds to cubes, and one third to the strategy that proved most with its latest rays. With an accuracy
//! goal, rounds of sampling and tests alternate until a test bounds the unseen part.

use super::adaptive::Adaptive;
use super::batch;
use super::cast::Caster;
use super::confidence::Test;
use super::goal::{Rounds, reach};
use super::guided::Guided;
use super::sampler::Sampler;
use super::source::{Part, Source};
use super::uniform::{Rays, Uniform, regions};
use super::witness::Witnessed;
use crate::BitMatrix;
use crate::cells::{CellGraph, Locator};
use crate::job::{Job, Stopped};
use crate::pvs::cubes::CubeScene;
use crate::scene::Scene;
use crate::scene::rays::RayScene;
use crate::types::bounds::{SamplingEnd, Unseen};

/// A strategy ends if one in this many of all rays, and at least `LEAST_PATIENCE`, found nothing in a row.
const PATIENCE: u64 = 20;
const LEAST_PATIENCE: u64 = 100_000;

/// A strategy for the lower bound.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Strategy {
    /// Rays from random points of cells in random directions.
    Rays,
    /// Cubes at random points of cells.
    UniformCubes,
    /// Cubes on portals, in quadtrees that split where cubes show new objects, and inside cells (after Nirenstein, Blake, 2004).
    AdaptiveCubes,
    /// Random rays, and rays at the borders of found objects (Wonka et al., *Guided visibility sampling*, 2006).
    Guided,
    /// Adaptive cubes and guided rays: the first step of a bake.
    Scheduled,
}

impl Strategy {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Rays, Self::UniformCubes, Self::AdaptiveCubes, Self::Guided, Self::Scheduled];

    /// The name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rays => "random rays",
            Self::UniformCubes => "uniform cubes",
            Self::AdaptiveCubes => "adaptive cubes",
            Self::Guided => "guided",
            Self::Scheduled => "scheduled",
        }
    }
}

/// The plan of sampling.
#[derive(Clone, Copy)]
pub(in crate::pvs) struct Plan {
    pub strategy: Strategy,
    pub seed: u64,
    /// Most rays.
    pub budget: u64,
    /// Additional rays for tests; with a `goal` they are part of the budget.
    pub to_test: u64,
    /// Accuracy goal: the unseen part in the mean over cells at which sampling ends.
    pub goal: Option<f64>,
}

/// Samples until the plan's rays are spent, its goal is reached, or no strategy finds anything; bounds the unseen part.
pub(in crate::pvs) fn sample(
    rays: &RayScene<'_>,
    graph: &CellGraph,
    plan: Plan,
    lower: &mut Witnessed,
    work: &Job<'_>,
) -> Result<(Option<Unseen>, SamplingEnd), Stopped> {
    let Plan { strategy, seed, budget, to_test, goal } = plan;
    let locator = Locator::new(graph);
    let sampler = Sampler::new(rays, graph, &locator, seed);
    let regions = regions(&sampler);
    // Without a budget no cubes are necessary.
    let by_cubes = budget > 0 && !matches!(strategy, Strategy::Rays | Strategy::Guided);
    let scene = by_cubes.then(|| CubeScene::new(rays.scene()));
    let caster = scene.as_ref().map(|scene| Caster::new(&sampler, scene));
    let mut sources: Vec<Box<dyn Source + '_>> = Vec::new();
    match (&caster, strategy) {
        (Some(caster), Strategy::UniformCubes) => sources.push(Box::new(Uniform::new(&sampler, caster, &regions))),
        (Some(caster), _) => sources.push(Box::new(Adaptive::new(&sampler, caster, &regions))),
        (None, _) => sources.push(Box::new(Rays::new(&sampler, &regions))),
    }
    if matches!(strategy, Strategy::Guided | Strategy::Scheduled) {
        sources.push(Box::new(Guided::new(&sampler)));
    }
    let (mut turns, mut test) = (Turns::new(sources), Test::new(&sampler, &regions));
    let end = match goal {
        Some(goal) => reach(goal, budget, &mut Cells { turns: &mut turns, test: &mut test, lower }, work)?,
        None => {
            turns.spend(budget, lower, work)?;
            test.look_thrice(to_test, lower, work)?;
            SamplingEnd::Rays
        }
    };
    drop(turns);
    Ok((test.close(), end))
}

/// Cells on the way to a goal.
struct Cells<'c, 's> {
    turns: &'c mut Turns<'s>,
    test: &'c mut Test<'s>,
    lower: &'c mut Witnessed,
}

impl Rounds for Cells<'_, '_> {
    fn rays(&self) -> u64 {
        self.lower.rays
    }

    fn regions(&self) -> u64 {
        self.test.regions() as u64
    }

    fn sample(&mut self, rays: u64, work: &Job<'_>) -> Result<bool, Stopped> {
        self.turns.spend(rays, self.lower, work)?;
        Ok(!self.turns.is_empty())
    }

    fn test(&mut self, rays: u64, doubt: f64, work: &Job<'_>) -> Result<(), Stopped> {
        self.test.look(rays, doubt, self.lower, work)
    }

    fn unseen(&self) -> f64 {
        self.test.mean()
    }
}

/// A strategy, and the yield of its latest rays.
struct Turn<'a> {
    source: Box<dyn Source + 'a>,
    /// Proofs a ray.
    rate: f64,
    /// Number of latest rays in a row without a proof.
    barren: u64,
}

/// Strategies that take turns. Two thirds of the rays go to the first one, cubes if there are any, because the number of proofs is not all:
/// guided rays prove many small objects, cubes prove few large ones.
struct Turns<'a> {
    turns: Vec<Turn<'a>>,
    /// Whether there was more than one at the start.
    in_turn: bool,
    /// Parts distributed so far.
    part: u64,
}

impl<'a> Turns<'a> {
    fn new(sources: Vec<Box<dyn Source + 'a>>) -> Self {
        let turn = |source| Turn { source, rate: f64::INFINITY, barren: 0 };
        let turns: Vec<Turn<'a>> = sources.into_iter().map(turn).collect();
        Self { in_turn: turns.len() > 1, turns, part: 0 }
    }

    /// True if no strategy finds anything more.
    fn is_empty(&self) -> bool {
        self.turns.is_empty()
    }

    /// Continues until `lower` has cost `budget`, or no strategy finds anything.
    fn spend(&mut self, budget: u64, lower: &mut Witnessed, work: &Job<'_>) -> Result<(), Stopped> {
        let (turns, begin) = (&mut self.turns, lower.rays);
        let whole = budget.saturating_sub(begin).max(1);
        let proofs = |lower: &Witnessed| lower.witnesses.len() + lower.sights.len();
        while lower.rays < budget {
            let better = |a: usize, b: usize| if turns[b].rate > turns[a].rate { b } else { a };
            let next = if self.part % 3 < 2 { (!turns.is_empty()).then_some(0) } else { (0..turns.len()).reduce(better) };
            let Some(next) = next else { break };
            let turn = &mut turns[next];
            let (before, rays, left) = (proofs(lower), lower.rays, budget - lower.rays);
            let part = Part { rays: batch::after(rays).min(left), most: left, work, before: rays - begin, whole };
            let more = turn.source.step(lower, &part)?;
            let (found, spent) = (proofs(lower) - before, (lower.rays - rays).max(1));
            turn.rate = found as f64 / spent as f64;
            turn.barren = if found == 0 { turn.barren + spent } else { 0 };
            let is_barren = turn.barren >= (whole / PATIENCE).max(LEAST_PATIENCE);
            if !more || lower.rays == rays || (is_barren && self.in_turn) {
                turns.remove(next);
            }
            self.part += 1;
            part.tell(1.0);
        }
        Ok(())
    }
}

/// The result of one strategy alone.
#[derive(Clone, PartialEq, Debug)]
pub struct Spent {
    /// Cells x objects: pairs proven visible.
    pub objects: BitMatrix,
    /// Its cost in rays, including cubes.
    pub rays: u64,
}

/// Runs one strategy alone, without the upper bound, to compare strategies. `graph` stays unchanged.
pub fn sample_alone(scene: &Scene, graph: &CellGraph, strategy: Strategy, seed: u64, budget: u64) -> Spent {
    let rays = RayScene::new(scene);
    let mut lower = Witnessed::new(graph.cells.len(), scene.objects.len());
    let plan = Plan { strategy, seed, budget, to_test: 0, goal: None };
    let done = sample(&rays, graph, plan, &mut lower, &Job::quiet());
    debug_assert!(done.is_ok(), "nobody stops it");
    Spent { objects: lower.objects, rays: lower.rays }
}
