//! Who gets the rays: cubes two parts of three, and the strategy that proved most for its last ones the third.

use super::adaptive::Adaptive;
use super::cast::Caster;
use super::guided::Guided;
use super::sampler::Sampler;
use super::source::Source;
use super::uniform::{Rays, Uniform, regions};
use super::witness::Lower;
use crate::BitMatrix;
use crate::cells::{CellGraph, Locator};
use crate::job::{Job, Stopped};
use crate::pvs::cubes::{Choice, CubeScene};
use crate::scene::Scene;
use crate::scene::rays::RayScene;

/// The rays are given away in this many parts, or in fewer of this many rays.
const PARTS: u64 = 64;
const LEAST: u64 = 32_000;
/// A strategy that found nothing in so many of them in a row gets no more.
const PATIENCE: u32 = 3;

/// How the lower bound is found.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Strategy {
    /// Rays from random points of cells in random directions.
    Rays,
    /// Cubes at random points of cells.
    UniformCubes,
    /// Cubes on portals, in quadtrees that split where cubes show what isn't known, and inside cells (after Nirenstein, Blake, 2004).
    AdaptiveCubes,
    /// Random rays, and rays at the borders of what was found (Wonka et al., *Guided visibility sampling*, 2006).
    Guided,
    /// Adaptive cubes and rays at the borders: what a bake does first.
    Scheduled,
}

impl Strategy {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Rays, Self::UniformCubes, Self::AdaptiveCubes, Self::Guided, Self::Scheduled];

    /// In words.
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

/// What to sample with.
#[derive(Clone, Copy)]
pub(in crate::pvs) struct Plan {
    pub strategy: Strategy,
    pub cubes: Choice,
    pub seed: u64,
    /// Rays, at most.
    pub budget: u64,
}

/// Samples until the plan's rays are spent, or nothing finds anything.
pub(in crate::pvs) fn sample(
    rays: &RayScene<'_>,
    graph: &CellGraph,
    plan: Plan,
    lower: &mut Lower,
    work: &Job<'_>,
) -> Result<(), Stopped> {
    let Plan { strategy, cubes, seed, budget } = plan;
    let locator = Locator::new(graph);
    let sampler = Sampler::new(rays, graph, &locator, seed);
    let regions = regions(&sampler);
    let by_cubes = !matches!(strategy, Strategy::Rays | Strategy::Guided);
    let scene = by_cubes.then(|| CubeScene::new(rays.scene()));
    let caster = scene.as_ref().map(|scene| Caster::new(&sampler, scene, cubes));
    let mut sources: Vec<Box<dyn Source + '_>> = Vec::new();
    match (&caster, strategy) {
        (Some(caster), Strategy::UniformCubes) => sources.push(Box::new(Uniform::new(&sampler, caster, &regions))),
        (Some(caster), _) => sources.push(Box::new(Adaptive::new(&sampler, caster, &regions))),
        (None, _) => sources.push(Box::new(Rays::new(&sampler, &regions))),
    }
    if matches!(strategy, Strategy::Guided | Strategy::Scheduled) {
        sources.push(Box::new(Guided::new(&sampler)));
    }
    run(sources, budget, lower, work)?;
    lower.notes.extend(caster.and_then(|caster| caster.note(lower.cubes)));
    Ok(())
}

/// A strategy, and what it gave for the last rays that it got.
struct Turn<'a> {
    source: Box<dyn Source + 'a>,
    /// Proofs a ray.
    rate: f64,
    /// Parts in a row that gave nothing.
    barren: u32,
}

/// Two parts of three go to the first strategy, cubes where there are any, since proofs are not all that counts: what borders
/// prove is many and small, what cubes prove is few and large.
fn run(sources: Vec<Box<dyn Source + '_>>, budget: u64, lower: &mut Lower, work: &Job<'_>) -> Result<(), Stopped> {
    let turn = |source| Turn { source, rate: f64::INFINITY, barren: 0 };
    let mut turns: Vec<Turn<'_>> = sources.into_iter().map(turn).collect();
    let proofs = |lower: &Lower| lower.witnesses.len() + lower.sights.len();
    let alone = turns.len() == 1;
    for part in 0.. {
        let better = |a: usize, b: usize| if turns[b].rate > turns[a].rate { b } else { a };
        let next = if part % 3 < 2 { (!turns.is_empty()).then_some(0) } else { (0..turns.len()).reduce(better) };
        let Some(next) = next.filter(|_| lower.rays < budget) else { break };
        let turn = &mut turns[next];
        let (before, rays) = (proofs(lower), lower.rays);
        let more = turn.source.step(lower, (budget / PARTS).max(LEAST).min(budget - lower.rays), work)?;
        let (found, spent) = (proofs(lower) - before, (lower.rays - rays).max(1));
        turn.rate = found as f64 / spent as f64;
        turn.barren = if found == 0 { turn.barren + 1 } else { 0 };
        if !more || lower.rays == rays || (turn.barren == PATIENCE && !alone) {
            turns.remove(next);
        }
        work.tell("sampling", lower.rays as f64 / budget as f64);
    }
    Ok(())
}

/// What one strategy finds alone.
#[derive(Clone, PartialEq, Debug)]
pub struct Spent {
    /// Cells x objects: what it proved to be visible.
    pub objects: BitMatrix,
    /// What it cost, in rays; cubes are priced in rays.
    pub rays: u64,
}

/// Runs one strategy alone, without the upper bound's help: to compare strategies. `graph` is taken as it is.
pub fn sample_alone(scene: &Scene, graph: &CellGraph, strategy: Strategy, seed: u64, budget: u64) -> Spent {
    let rays = RayScene::new(scene);
    let mut lower = Lower::new(graph.cells.len(), scene.objects.len());
    let plan = Plan { strategy, cubes: Choice::default(), seed, budget };
    let done = sample(&rays, graph, plan, &mut lower, &Job::quiet());
    debug_assert_eq!(done, Ok(()), "nobody stops it");
    Spent { objects: lower.objects, rays: lower.rays }
}
