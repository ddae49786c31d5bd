//! The upper bound: portal flow with separating planes.
//!
//! Based on: Teller, *Visibility computations in densely occluded polyhedral environments*, 1992; the recursion over source,
//! pass and target portals of level compilers after Carmack, 1996. Stages, cheapest first; each keeps a superset of what a
//! line can reach and hands it to the next:
//!
//! 1. `might_see`: pairs of directed portals that their planes allow, flooded; of very many portals, those that windows which
//!    narrow on the way lead to (`reach`). Where those lead nowhere far, all that follows is done in `parts` of the graph.
//! 2. `cells`: for each undecided pair of cells, a search for a chain of portals that a line may pass, from the side where
//!    that is cheaper: a pair hidden from one side is hidden. `search` narrows the source and the last portal of a chain, and
//!    floods inside its planes; `stab` asks the whole chain before it is believed. A caller may take the line that `stab`
//!    finds for a proof (`goals::Prover`): `enfilade-levels` does, a bake has its own. It may also have what `stab` leaves open
//!    asked once more, of the windings and without rounding: `exact`.
//! 3. `objects`: the same search for the boxes of objects in the cells that are left.
//!
//! # Why nothing visible is missing
//!
//! What has to be kept: cell j, or an object in it, for cell i wherever a segment from a point of i to a point of j (on the
//! object) goes from cell to cell only through portals, crossing each from its back to its front. A line that only touches a
//! portal's plane, or runs in it, doesn't cross it; such lines have measure zero.
//!
//! * A segment crosses each portal at most once, because it crosses its plane at most once. It may cross a cell several times:
//!   cells are unions of convex pieces. But what is asked of a chain is asked of its portals, pair by pair, so leaving out the
//!   loop between two visits to a cell only asks less: chains that visit each cell once find everything. See `search`.
//! * If it crosses a and later b, b has a point before the plane of a, and a has one behind the plane of b; and only the parts
//!   of a and b there matter. Portals that lie flush one on the other (cells without thickness) are crossed in one point and
//!   exempt. See `net`.
//! * A plane that has window a on its outside and window b on its inside has everything beyond b, on lines through a and then
//!   b, on its inside. Every plane is tested for that, however it was made. See `separators`.
//! * Windows are cut with a slack on the visible side that exceeds the rounding of all cuts before; a window that can't be cut
//!   (no area, corners off its plane, not numbers) is kept whole. See `window`.
//! * What runs out of steps stays visible, and is counted.
//!
//! Slacks are multiples of the last place of the coordinates relative to the middle of the graph (`window::Slack`), some
//! 1e-14 of its size: not lengths in the model, because even a thousandth of a building's tolerance, read the wrong way, loses
//! lines that can be proven. [`FlowInput::coplanar`] is used where the question is whether corners are meant to lie in one
//! plane: two portals of one wall, leading opposite ways, are not seen through each other, however their corners were rounded;
//! what a line would need there is thinner than the tolerance that closes walls.
//!
//! # The same bits on any number of threads
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
pub(crate) mod stab;
pub(crate) mod window;

use super::backfaces::Fronts;
use crate::BitMatrix;
use crate::cells::CellGraph;
use crate::geom::Aabb;
use crate::job::{Job, Stopped};
use crate::types::placed::PlacedBox;
use cells::Cells;
use goals::NoProof;
use might_see::MightSee;
use net::Net;
use parts::{Parts, Sizes};
use schedule::Tally;

/// What flow starts from.
#[derive(Clone, Copy)]
pub struct FlowInput<'a> {
    /// Cells and portals. Only portals are read, and the number of cells.
    pub graph: &'a CellGraph,
    /// Cells x objects: which objects are in which cell.
    pub placement: &'a BitMatrix,
    /// The part of each object in each of its cells, by cell, then object; `None`: what of the object's box is in the cell's.
    pub placed_boxes: Option<&'a [PlacedBox]>,
    /// A box around each object, metres. One that isn't a box (not finite, turned inside out) hides nowhere.
    pub object_bounds: &'a [Aabb],
    /// Cells x cells: pairs known to see each other, one way or both. They are in the result, and nothing is spent on them.
    pub cells_lower: &'a BitMatrix,
    /// Cells x objects: pairs known to be visible. Likewise.
    pub objects_lower: &'a BitMatrix,
    /// Most steps that the search from one directed portal may take in each of the two stages; what it has not decided then
    /// counts as visible. A step is one portal tried, 2 to 4 microseconds. Where most searches are dear they get less: about
    /// 125 times this for a whole stage, or a thousand for each portal if that is more. 200,000 ends in two minutes on two cores; 0 gives the answer of might-see.
    pub max_steps: u64,
    /// How far from a plane corners may lie that are meant to lie in it, metres: [`crate::tolerance::Tolerance::coplanar`].
    pub coplanar: f64,
    /// From where objects are seen, where that is known: what is behind all that it could see of an object is hidden from it, and not
    /// searched for. `None`, or in a graph that is searched in parts: not asked.
    pub fronts: Option<&'a Fronts>,
}

/// The upper bound, and what it took.
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

/// Works out what may be seen from each cell. Takes memory for about three bits a pair of directed portals, or, of very many portals that
/// come to few each, of those within a part of the graph.
///
/// # Errors
///
/// Where it was stopped.
///
/// # Panics
///
/// Where the matrices aren't of the graph's number of cells, or the boxes not of the matrices' number of objects.
pub fn flow(input: &FlowInput<'_>, work: &Job<'_>) -> Result<FlowResult, Stopped> {
    let (cells, objects) = (input.graph.cells.len(), input.object_bounds.len());
    for (matrix, columns) in [(input.cells_lower, cells), (input.objects_lower, objects), (input.placement, objects)] {
        assert_eq!((matrix.rows(), matrix.columns()), (cells, columns), "rows of every cell, columns of every target");
    }
    work.tell("flow: might-see", 0.0);
    let net = Net::of_graph(input.graph, input.coplanar);
    if let Some(parts) = Parts::new(&net, Sizes::default()) {
        return parts.flow(input, work);
    }
    let (cells_upper, objects_upper, tally) = decide(input, &net, MightSee::new(&net), |_| true, work)?;
    Ok(FlowResult { cells_upper, objects_upper, steps: tally.steps, capped: tally.capped.len() as u64 })
}

/// What flow takes at most, bytes, where it goes through a graph in parts; `None` where it doesn't, which takes [`crate::cells::flow_bytes`].
pub fn parts_bytes(graph: &CellGraph, coplanar: f64) -> Option<u64> {
    Parts::new(&Net::of_graph(graph, coplanar), Sizes::default()).map(|parts| parts.bytes())
}

/// Crossings of a cell, from one of its portals to another, of all cells of a graph at most: a minute.
const MOST_CROSSINGS: u64 = 1 << 31;

/// True where flow would take minutes before its first step, which [`FlowInput::max_steps`] doesn't bound: where few cells have portals by the
/// ten thousand.
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
    for k in 0..pairs.rounds() {
        let found = pairs.search(k, &NoProof, "flow: cells", work)?;
        pairs.merge(k, &found);
    }
    let Cells { might_see, settled: cells_upper, mut tally, .. } = pairs;
    let objects_upper = objects::decide(input, net, &might_see, &cells_upper, own, &mut tally, work)?;
    Ok((cells_upper, objects_upper, tally))
}
