//! The upper bound: portal flow with separating planes.
//!
//! Based on: Teller, *Visibility computations in densely occluded polyhedral environments*, 1992; the recursion over source, pass and
//! target portals of level compilers after Carmack, 1996. Stages, cheapest first; each passes a superset of the reachable targets to the
//! next:
//!
//! 1. `might_see`: pairs of directed portals allowed by their planes, by floods; for very many portals, by narrowing windows (`reach`). If
//!    views are short, all later stages run in `parts` of the graph.
//! 2. `cells`: for each undecided pair of cells, from the cheaper side, because a pair hidden from one side is hidden: first `shafts`, a
//!    flood through the portals inside the hull of both cells' portals, which decides most of them; then a search for a passable chain of
//!    portals among those that shafts leave. `search` narrows the source and the last portal of a chain, and floods inside its planes;
//!    `stab` tests the whole chain before it counts. A caller may use the line that `stab` finds as a proof (`goals::Prover`):
//!    `enfilade-levels` does, and aims lines where shafts leave a pair open; a bake has its own. It may also test chains that `stab` leaves
//!    open exactly, by their windings: `exact`.
//! 3. `objects`: the same search for the boxes of objects in the remaining cells.
//!
//! # Why nothing visible is missing
//!
//! The claim: cell j, or an object in it, stays in the row of cell i if a segment from a point of i to a point of j (on the object) goes
//! from cell to cell only through portals, and crosses each from its back to its front. A line that only touches a portal's plane, or is in
//! it, does not cross it; such lines have measure zero.
//!
//! * A segment crosses each portal at most once, because it crosses its plane at most once. It may cross a cell several times: cells are
//!   unions of convex pieces. But all tests of a chain are tests of its portals in pairs, so removing the loop between two visits to a cell
//!   only removes constraints: chains that visit each cell once are sufficient. See `search`.
//! * If it crosses a and later b, b has a point in front of the plane of a, and a has one behind the plane of b; only these parts of a and
//!   b matter. Flush portals (of cells without thickness) are crossed at one point and exempt. See `net`.
//! * If a plane has window a outside and window b inside, then all points beyond b on lines through a and then b are inside. Every plane is
//!   tested for that, independent of its construction. See `separators`.
//! * Between the first and the last portal that it crosses, a segment is in the convex hull of the two. So it crosses only portals that meet
//!   the hull of all portals out of cell i and into cell j. See `shafts`.
//! * Windows are clipped with a slack on the visible side that exceeds the rounding of all previous cuts; a window that cannot be clipped
//!   (no area, corners off its plane, NaN) is kept whole. See `window`.
//! * Pairs whose search runs out of steps stay visible, and are counted.
//!
//! Slacks are multiples of the rounding unit of coordinates relative to the centre of the graph (`window::Slack`), some 1e-14 of its size.
//! They are not lengths of the model, because even a thousandth of a building's tolerance in the wrong direction loses provable lines.
//! [`FlowInput::coplanar`] decides only whether corners are meant to be in one plane: two portals of one wall with opposite directions are
//! not visible through each other, whatever the rounding of their corners; a line between them would need a gap thinner than the tolerance
//! that closes walls.
//!
//! # The same bits for any number of threads
//!
//! Searches run in a fixed number of rounds. Within a round they share nothing; after it, results are merged in a fixed order.

pub(crate) mod bundle;
pub mod by_cell;
pub mod cells;
pub mod exact;
pub mod goals;
pub mod might_see;
pub mod net;
mod objects;
mod parts;
mod planes;
mod reach;
pub(crate) mod schedule;
pub mod search;
pub(crate) mod separators;
mod shafts;
pub(crate) mod stab;
pub(crate) mod window;

use super::backfaces::Fronts;
use crate::BitMatrix;
use crate::cells::CellGraph;
use crate::job::{Job, Stopped};
use crate::math::geom::Aabb;
use crate::types::placed::PlacedBox;
use cells::Cells;
use goals::NoProof;
use might_see::MightSee;
use net::Net;
use parts::{Parts, Sizes};
use schedule::Tally;

/// The input of flow.
#[derive(Clone, Copy)]
pub struct FlowInput<'a> {
    /// Cells and portals. Only the portals and the number of cells are used.
    pub graph: &'a CellGraph,
    /// Cells x objects: the objects in each cell.
    pub placement: &'a BitMatrix,
    /// The part of each object in each of its cells, by cell, then object; `None`: the intersection of the object's box and the cell's.
    pub placed_boxes: Option<&'a [PlacedBox]>,
    /// A box around each object, metres. An invalid box (not finite, inverted) is never hidden.
    pub object_bounds: &'a [Aabb],
    /// Cells x cells: pairs known to see each other, one way or both. They are in the result without a search.
    pub cells_lower: &'a BitMatrix,
    /// Cells x objects: pairs known to be visible. Likewise.
    pub objects_lower: &'a BitMatrix,
    /// Most steps of the search from one directed portal in each of the two stages; pairs undecided then count as visible. A step is one
    /// portal tried, 2 to 4 microseconds. If most searches are expensive, they get less: about 125 times this for a whole stage, or
    /// for each directed portal 1000 if that is more. 200,000 ends in two minutes on two cores; 0 gives the answer of might-see.
    pub max_steps: u64,
    /// Tolerance of corners from their plane, metres: [`crate::math::tolerance::Tolerance::coplanar`].
    pub coplanar: f64,
    /// Fronts of objects, for back-face culling: a cell behind all visible parts of an object does not search for it. Not used if `None`,
    /// or in a graph that is searched in parts.
    pub fronts: Option<&'a Fronts>,
}

/// The upper bound, and counters.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FlowResult {
    /// Cells x cells, symmetric, the diagonal set: pairs not proven hidden.
    pub cells_upper: BitMatrix,
    /// Cells x objects: pairs not proven hidden.
    pub objects_upper: BitMatrix,
    /// Steps taken.
    pub steps: u64,
    /// Directed portals whose search ran out of steps.
    pub capped: u64,
}

/// Computes the upper bound of each cell. Takes about three bits of memory per pair of directed portals; for very many portals with short
/// views, per pair within a part of the graph.
///
/// # Errors
///
/// If it was stopped.
///
/// # Panics
///
/// If the size of a matrix does not match the graph's cells or the number of boxes.
pub fn flow(input: &FlowInput<'_>, work: &Job<'_>) -> Result<FlowResult, Stopped> {
    let (cells, objects) = (input.graph.cells.len(), input.object_bounds.len());
    for (matrix, columns) in [(input.cells_lower, cells), (input.objects_lower, objects), (input.placement, objects)] {
        assert_eq!((matrix.rows(), matrix.columns()), (cells, columns), "a row per cell, a column per target");
    }
    work.tell("flow: might-see", 0.0);
    let net = Net::of_graph(input.graph, input.coplanar);
    if let Some(parts) = Parts::new(&net, Sizes::default()) {
        return parts.flow(input, work);
    }
    let (cells_upper, objects_upper, tally) = decide(input, &net, MightSee::new(&net), |_| true, work)?;
    Ok(FlowResult { cells_upper, objects_upper, steps: tally.steps, capped: tally.capped.len() as u64 })
}

/// Upper bound of flow's memory, bytes, if it divides the graph into parts; otherwise `None`, and it takes [`crate::cells::flow_bytes`].
pub fn parts_bytes(graph: &CellGraph, coplanar: f64) -> Option<u64> {
    Parts::new(&Net::of_graph(graph, coplanar), Sizes::default()).map(|parts| parts.bytes())
}

/// Limit on the pairs of portals of a cell, over all cells: a minute.
const MOST_CROSSINGS: u64 = 1 << 31;

/// True if flow would take minutes before its first step, which [`FlowInput::max_steps`] does not bound: few cells with tens of thousands
/// of portals.
pub(crate) fn is_over_budget(graph: &CellGraph, coplanar: f64) -> bool {
    let crossings: u64 = graph.cells.iter().map(|cell| (cell.portals.len() as u64).pow(2)).sum();
    let is_over_budget = || might_see::is_over_budget(&Net::of_graph(graph, coplanar));
    2 * graph.portals.len() >= might_see::MANY && (crossings > MOST_CROSSINGS || is_over_budget())
}

/// Decides every pair of which a cell is `own`.
fn decide(
    input: &FlowInput<'_>,
    net: &Net,
    might_see: MightSee,
    own: impl Fn(usize) -> bool + Sync,
    work: &Job<'_>,
) -> Result<(BitMatrix, BitMatrix, Tally), Stopped> {
    let mut pairs = Cells::new(net, might_see, input.cells_lower, input.max_steps, &own);
    while let Some(found) = pairs.next(&NoProof, "flow: cells", work)? {
        pairs.merge(&found);
    }
    let Cells { might_see, settled: cells_upper, mut tally, .. } = pairs;
    let objects_upper = objects::decide(input, net, &might_see, &cells_upper, own, &mut tally, work)?;
    Ok((cells_upper, objects_upper, tally))
}
