//! Proofs for single pairs, by flow and then occluders. A bake does not keep its proofs.
//!
//! Portals are used as given. Those of a file are rounded to `f32`, so a result may differ from the bake's by that; the file's rows stay
//! proven.

pub(crate) use super::backfaces::Fronts;
use super::budget::Budget;
use super::flow::goals::{Boxes, CellGoals, Goals, Inside, NoProof, ObjectGoals};
use super::flow::might_see::{MightSee, set};
use super::flow::net::Net;
use super::flow::search::{End, Search};
use super::flow::stab::Passage;
use super::options::PvsOptions;
use super::sampling::witness::Witnessed;
use super::{flow, occluders};
use crate::cells::CellGraph;
use crate::job::Job;
use crate::math::geom::{Aabb, Plane};
use crate::scene::rays::RayScene;
use crate::types::placed::PlacedBox;
use crate::{BitMatrix, CellId, DirectedPortal, ObjectId};
use glam::DVec3;

/// Most steps per portal in the search for one pair: fifty times a bake's.
const STEPS: u64 = 1_000_000;

/// The result of flow for a pair.
#[derive(Clone, PartialEq, Debug)]
pub enum Flowed {
    /// No line passes: each chain of portals from the cell ends in one of these. Empty: the planes of the portals already refute all
    /// chains.
    Separated(Vec<Separation>),
    /// A line may pass these portals, in order; portals do not refute it.
    Open(Vec<DirectedPortal>),
    /// The search ran out of steps.
    OutOfSteps,
}

/// The proof that no line continues from a chain of portals to the goal.
#[derive(Clone, PartialEq, Debug)]
pub struct Separation {
    /// The chain from the first cell.
    pub chain: Vec<DirectedPortal>,
    /// All points that lines through the chain reach beyond it are inside these planes, and the goal is not reachable inside them. Empty:
    /// no line passes the chain.
    pub planes: Vec<Plane>,
}

/// A graph laid out for queries of pairs.
pub struct PairFlow {
    net: Net,
    might_see: MightSee,
    boxes: Boxes,
}

impl PairFlow {
    /// Lays out portals and objects. `placement`, `placed_boxes` and `object_bounds` as in [`flow::FlowInput`]; `coplanar`: likewise, metres.
    pub fn new(
        graph: &CellGraph,
        placement: &BitMatrix,
        placed_boxes: Option<&[PlacedBox]>,
        object_bounds: &[Aabb],
        coplanar: f64,
    ) -> Self {
        let net = Net::of_graph(graph, coplanar);
        let boxes = Boxes::new(&net, graph, placement, placed_boxes, object_bounds);
        let might_see = MightSee::new(&net);
        Self { net, might_see, boxes }
    }

    /// Whether a line may pass from one cell to another. Tested from both sides, because a pair hidden from one is hidden; chains start at
    /// the first cell unless only the other side is separated.
    pub fn cell(&self, from: CellId, to: CellId) -> Flowed {
        let first = self.cell_from(from, to);
        match &first {
            Flowed::Separated(_) => first,
            _ => match self.cell_from(to, from) {
                Flowed::Separated(found) => Flowed::Separated(found),
                _ => first,
            },
        }
    }

    fn cell_from(&self, from: CellId, to: CellId) -> Flowed {
        let mut wanted = vec![0; self.net.cells.div_ceil(64)];
        set(&mut wanted, to.index());
        let mut goals = Recorder { goals: CellGoals::new(&self.net, &NoProof, wanted), open: Vec::new() };
        let mut search = self.search();
        for portal in self.net.out(from.index()) {
            if search.run(portal, &mut goals).capped {
                return Flowed::OutOfSteps;
            }
        }
        let Recorder { goals, open } = goals;
        if goals.doubtful().next().is_some() || !goals.into_proofs().is_empty() {
            return Flowed::Open(self.ids(&open));
        }
        self.separated(search)
    }

    /// Whether a line may pass from a cell to an object's box in any other cell.
    pub fn object(&self, from: CellId, object: ObjectId, placement: &BitMatrix) -> Flowed {
        let mut wanted = vec![0; placement.columns().div_ceil(64)];
        set(&mut wanted, object.index());
        let mut search = self.search();
        for portal in self.net.out(from.index()) {
            let cells = flow::cells::reached(&self.net, &self.might_see, [portal]);
            let goals = ObjectGoals::new(&self.net, &self.boxes, &wanted, &cells, portal);
            let mut goals = Recorder { goals, open: Vec::new() };
            if search.run(portal, &mut goals).capped {
                return Flowed::OutOfSteps;
            }
            if !goals.goals.found().is_empty() {
                // Objects directly behind the portal are found before any chain is tested.
                let chain = if goals.open.is_empty() { vec![portal as u32] } else { goals.open };
                return Flowed::Open(self.ids(&chain));
            }
        }
        self.separated(search)
    }

    fn search(&self) -> Search<'_> {
        let mut search = Search::new(&self.net, &self.might_see, STEPS);
        search.ends = Some(Vec::new());
        search
    }

    fn ids(&self, chain: &[u32]) -> Vec<DirectedPortal> {
        chain.iter().map(|&p| DirectedPortal(self.net.ids[p as usize])).collect()
    }

    fn separated(&self, mut search: Search<'_>) -> Flowed {
        let moved = |p: Plane| Plane { n: p.n, d: p.d + p.n.dot(self.net.origin) };
        let ends = search.ends.take().unwrap_or_default();
        let separation = |End { chain, planes }: End| Separation {
            chain: self.ids(&chain),
            planes: planes.into_iter().map(moved).collect(),
        };
        Flowed::Separated(ends.into_iter().map(separation).collect())
    }
}

/// Goals that record the last chain to them.
struct Recorder<G> {
    goals: G,
    open: Vec<u32>,
}

impl<G: Goals> Goals for Recorder<G> {
    fn portals(&self) -> &[u64] {
        self.goals.portals()
    }

    fn is_cut_off(&self, net: &Net, cell: usize, inside: &Inside<'_>) -> bool {
        self.goals.is_cut_off(net, cell, inside)
    }

    fn would_decide(&self, net: &Net, cell: usize, inside: &Inside<'_>) -> bool {
        self.goals.would_decide(net, cell, inside)
    }

    fn accepts(&mut self, chain: &[u32], line: [DVec3; 2]) -> bool {
        chain.clone_into(&mut self.open);
        self.goals.accepts(chain, line)
    }

    fn settle(&mut self, chain: &[u32], steps: &mut u64) -> Passage {
        chain.clone_into(&mut self.open);
        self.goals.settle(chain, steps)
    }

    fn arrive(&mut self, net: &Net, cell: usize, inside: &Inside<'_>, passage: Passage) -> u64 {
        self.goals.arrive(net, cell, inside, passage)
    }
}

/// Whether triangles hide an object in another cell from all portals of a closed cell: the last stage of a bake, for one pair.
/// `cells_upper` is flow's result for pairs of cells.
pub fn is_occluded(
    rays: &RayScene<'_>,
    graph: &CellGraph,
    placement: &BitMatrix,
    cells_upper: &BitMatrix,
    [cell, object]: [usize; 2],
) -> bool {
    // All other pairs count as visible.
    let (rows, columns) = (placement.rows(), placement.columns());
    let (mut upper, mut lower) = (BitMatrix::new(rows, columns), Witnessed::new(rows, columns));
    (0..rows).for_each(|c| (0..columns).for_each(|o| _ = upper.set(c, o)));
    lower.objects = upper.clone();
    lower.objects.clear(cell, object);
    let options = PvsOptions::default();
    let budget = (Budget::of_cells(options.ray_budget).shafts, options.seed);
    let unresolved = &mut BitMatrix::new(rows, columns);
    let bounds =
        occluders::Bounds { placement, cells_upper, objects_upper: &mut upper, lower: &mut lower, unresolved, leave: None };
    let asked = occluders::decide(rays, graph, budget, bounds, &Job::quiet());
    debug_assert_eq!(asked, Ok(()), "nobody stops it");
    !upper.get(cell, object)
}
