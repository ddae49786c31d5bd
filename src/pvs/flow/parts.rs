//! Parts: flow over a graph in parts, if views are short.
//!
//! A part has its own cells, and everything that lines from these can reach (`reach`). A line from an own cell crosses only portals of the
//! part, so a pair that flow proves hidden there is hidden in the graph. Every cell belongs to exactly one part. A pair of cells of two
//! parts is decided in both, and is hidden if either proves it. Matrices are over the portals of a part, so time and memory are linear in
//! the number of cells instead of quadratic.

use super::might_see::{MANY, MightSee, from_rows, set};
use super::net::Net;
use super::reach::Reach;
use super::{FlowInput, FlowResult, cells::set_both, decide};
use crate::cells::{Cell, CellGraph, Strategy, flow_bytes};
use crate::job::{Job, Stopped};
use crate::math::parallel;
use crate::{BitMatrix, CellId};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// When and how a graph is divided.
#[derive(Clone, Copy)]
pub(super) struct Sizes {
    /// Least number of directed portals. Smaller: no gain over one matrix.
    many: usize,
    /// A source may visit at most one portal in this many; with more, its view is long.
    looks: usize,
    /// Directed portals out of a part's own cells. Fewer: parts overlap more. More: matrices are larger.
    own: usize,
    /// Least number of parts, if there are enough portals: as many machines can work on the graph at once.
    least: usize,
    /// The matrices of all parts together must be at most one in this many of those of the whole graph.
    worth: usize,
}

/// Parts assumed to be in memory at once, independent of the number of threads, so that merges of cells for lack of memory do not depend on
/// it.
const AT_ONCE: u64 = 16;

impl Default for Sizes {
    fn default() -> Self {
        Self { many: MANY, looks: 256, own: 2048, least: 64, worth: 4 }
    }
}

/// Cells and portals of a graph, ascending.
struct Part {
    cells: Vec<u32>,
    /// Whether each of `cells` is its own.
    own: Vec<bool>,
    portals: Vec<u32>,
}

/// A graph in parts.
pub(super) struct Parts {
    parts: Vec<Part>,
    /// For each `2 * portal + side`, the directed portals that lines through it may cross later, numbered likewise.
    reach: Vec<Vec<u32>>,
}

/// The result for a part's own cells, in the graph's numbers.
#[derive(Serialize, Deserialize)]
struct Found {
    cells: Vec<(u32, Vec<u32>)>,
    objects: Vec<(u32, Vec<u32>)>,
    steps: u64,
    /// `2 * portal + side`.
    capped: Vec<u32>,
}

impl Parts {
    /// Parts of a graph; `None` if there are few portals, or lines reach too many.
    pub fn new(net: &Net, sizes: Sizes) -> Option<Self> {
        let n = net.portals();
        if n < sizes.many {
            return None;
        }
        let most = n / sizes.looks;
        // One source with a long view ends it.
        let far = AtomicBool::new(false);
        let from = |reach: &mut Reach<'_>, first| {
            let mut found = Vec::new();
            let near = !far.load(Relaxed) && reach.from(first, most, &mut found);
            far.fetch_or(!near, Relaxed);
            found
        };
        // A sample finds most graphs with long views.
        let few = n.div_ceil(sizes.looks);
        parallel::map_init(few, || Reach::new(net), |reach, i| from(reach, i * sizes.looks));
        let rows: Vec<Vec<u32>> = parallel::map_init(n, || Reach::new(net), from);
        if far.load(Relaxed) {
            return None;
        }
        let (mut reach, mut sources) = (vec![Vec::new(); n], vec![0; n]);
        for (p, mut row) in rows.into_iter().enumerate() {
            row.iter_mut().for_each(|q| *q = net.ids[*q as usize]);
            reach[net.ids[p] as usize] = row;
            sources[net.ids[p] as usize] = net.source[p];
        }
        let part = |own| part(net, &reach, &sources, own);
        let parts: Vec<Part> = own_cells(net, sizes.own.min(n.div_ceil(sizes.least))).into_iter().map(part).collect();
        let pairs: usize = parts.iter().map(|part| (2 * part.portals.len()).pow(2)).sum();
        (sizes.worth * pairs <= n * n).then_some(Self { parts, reach })
    }

    /// Upper bound of flow's memory, bytes: the reach of all portals, and matrices for `AT_ONCE` times the largest part.
    pub fn bytes(&self) -> u64 {
        let largest = self.parts.iter().map(|part| flow_bytes(part.cells.len(), part.portals.len())).max();
        let reach: usize = self.reach.iter().map(|row| size_of_val(row) + size_of_val(row.as_slice())).sum();
        reach as u64 + largest.unwrap_or(0) * AT_ONCE
    }

    /// Runs flow for all parts.
    pub fn flow(&self, input: &FlowInput<'_>, work: &Job<'_>) -> Result<FlowResult, Stopped> {
        let one = |(): &mut (), part: &Part| self.flow_in(part, input, &work.within());
        let done = |done: usize| work.tell("flow: parts", done as f64 / self.parts.len() as f64);
        let found = work.map_with(&self.parts, || (), one, done)?;
        let cells = input.graph.cells.len();
        let mut all = FlowResult {
            cells_upper: BitMatrix::new(cells, cells),
            objects_upper: input.placement.clone(),
            steps: 0,
            capped: 0,
        };
        all.objects_upper.union_with(input.objects_lower);
        let mut capped = vec![false; 2 * input.graph.portals.len()];
        for found in found.into_iter().collect::<Option<Vec<Found>>>().ok_or(Stopped)? {
            for (cell, seen) in found.cells {
                seen.into_iter().for_each(|other| _ = all.cells_upper.set(cell as usize, other as usize));
            }
            for (cell, seen) in found.objects {
                seen.into_iter().for_each(|object| _ = all.objects_upper.set(cell as usize, object as usize));
            }
            all.steps += found.steps;
            found.capped.into_iter().for_each(|portal| capped[portal as usize] = true);
        }
        all.capped = capped.into_iter().filter(|&is| is).count() as u64;
        for i in 0..cells {
            let seen: Vec<usize> = all.cells_upper.ones(i).filter(|&j| !all.cells_upper.get(j, i)).collect();
            seen.into_iter().for_each(|j| all.cells_upper.clear(i, j));
        }
        for i in 0..cells {
            input.cells_lower.ones(i).for_each(|j| set_both(&mut all.cells_upper, i, j));
        }
        Ok(all)
    }

    /// Runs flow within a part; `None` if it was stopped.
    fn flow_in(&self, part: &Part, input: &FlowInput<'_>, work: &Job<'_>) -> Option<Found> {
        // 1. The part as a graph of its own.
        let graph = part.graph(input.graph);
        let net = Net::of_graph(&graph, input.coplanar);
        let mut place = vec![0; net.portals()];
        net.ids.iter().enumerate().for_each(|(p, &id)| place[id as usize] = p);
        let here = |id: u32| part.portals.binary_search(&(id / 2)).ok().map(|k| place[2 * k + id as usize % 2]);
        let there = |id: u32| 2 * part.portals[id as usize / 2] + id % 2;
        let fill = |(): &mut (), p: usize, row: &mut [u64]| {
            self.reach[there(net.ids[p]) as usize].iter().filter_map(|&q| here(q)).for_each(|q| set(row, q));
        };
        let might_see = MightSee::of(&net, from_rows(net.portals(), net.portals(), || (), fill));
        // 2. Its objects, and the known pairs.
        let mut objects: Vec<u32> =
            part.cells.iter().flat_map(|&c| input.placement.ones(c as usize)).map(|o| o as u32).collect();
        objects.sort_unstable();
        objects.dedup();
        let of_part = |matrix: &BitMatrix, columns: &[u32]| {
            let mut result = BitMatrix::new(part.cells.len(), columns.len());
            for (row, &cell) in part.cells.iter().enumerate() {
                let known = matrix.ones(cell as usize).filter_map(|column| columns.binary_search(&(column as u32)).ok());
                known.for_each(|column| _ = result.set(row, column));
            }
            result
        };
        let placed_boxes = input.placed_boxes.map(|boxes| {
            let mut starts = vec![0];
            for cell in 0..input.placement.rows() {
                starts.push(starts[cell] + input.placement.ones(cell).count());
            }
            let own = part.cells.iter().flat_map(|&c| &boxes[starts[c as usize]..starts[c as usize + 1]]);
            own.copied().collect::<Vec<_>>()
        });
        let bounds: Vec<_> = objects.iter().map(|&o| input.object_bounds[o as usize]).collect();
        let within = FlowInput {
            graph: &graph,
            placement: &of_part(input.placement, &objects),
            placed_boxes: placed_boxes.as_deref(),
            object_bounds: &bounds,
            cells_lower: &of_part(input.cells_lower, &part.cells),
            objects_lower: &of_part(input.objects_lower, &objects),
            // Fronts use the whole graph's numbers.
            fronts: None,
            ..*input
        };
        // 3. The result for its own cells, in the graph's numbers.
        let (cells_upper, objects_upper, tally) = decide(&within, &net, might_see, |c| part.own[c], work).ok()?;
        let own = |matrix: &BitMatrix, names: &[u32]| -> Vec<(u32, Vec<u32>)> {
            let own = (0..part.cells.len()).filter(|&c| part.own[c]);
            own.map(|c| (part.cells[c], matrix.ones(c).map(|column| names[column]).collect())).collect()
        };
        Some(Found {
            cells: own(&cells_upper, &part.cells),
            objects: own(&objects_upper, &objects),
            steps: tally.steps,
            capped: tally.capped.iter().map(|&p| there(net.ids[p])).collect(),
        })
    }
}

impl Part {
    /// Its cells and portals, numbered from 0.
    fn graph(&self, whole: &CellGraph) -> CellGraph {
        let place = |cell: CellId| CellId(self.cells.partition_point(|&c| c < cell.0) as u32);
        let portal = |&p: &u32| {
            let mut portal = whole.portals[p as usize].clone();
            portal.cells = portal.cells.map(place);
            portal
        };
        let mut graph = CellGraph {
            strategy: Strategy::Given,
            reason: String::new(),
            cells: vec![Cell::default(); self.cells.len()],
            portals: self.portals.iter().map(portal).collect(),
            smallest_hole: whole.smallest_hole,
            closed_holes: Vec::new(),
            notes: Vec::new(),
        };
        graph.link();
        graph
    }
}

/// The own cells of each part: a flood from the first unassigned cell, until `most` portals lead out of them.
fn own_cells(net: &Net, most: usize) -> Vec<Vec<u32>> {
    let mut taken = vec![false; net.cells];
    let mut parts = Vec::new();
    let (mut own, mut portals) = (Vec::new(), 0);
    for first in 0..net.cells {
        if std::mem::replace(&mut taken[first], true) {
            continue;
        }
        let mut queue = VecDeque::from([first]);
        while let Some(cell) = queue.pop_front() {
            own.push(cell as u32);
            portals += net.out(cell).len();
            if portals >= most {
                // Queued cells that are not in this part stay unassigned.
                queue.drain(..).for_each(|cell| taken[cell] = false);
                parts.push(std::mem::take(&mut own));
                portals = 0;
                break;
            }
            for next in net.out(cell).map(|p| net.target[p] as usize) {
                if !std::mem::replace(&mut taken[next], true) {
                    queue.push_back(next);
                }
            }
        }
    }
    parts.extend((!own.is_empty()).then_some(own));
    parts
}

/// A part with everything that lines from its `own` cells reach. `sources`: the source cell of each `2 * portal + side`.
fn part(net: &Net, reach: &[Vec<u32>], sources: &[u32], mut own: Vec<u32>) -> Part {
    own.sort_unstable();
    let out = || own.iter().flat_map(|&cell| net.out(cell as usize));
    let ids = out().flat_map(|p| std::iter::once(net.ids[p]).chain(reach[net.ids[p] as usize].iter().copied()));
    let mut portals: Vec<u32> = ids.map(|id| id / 2).collect();
    portals.sort_unstable();
    portals.dedup();
    let ends = portals.iter().flat_map(|&p| [2 * p, 2 * p + 1]).map(|id| sources[id as usize]);
    let mut cells: Vec<u32> = ends.chain(own.iter().copied()).collect();
    cells.sort_unstable();
    cells.dedup();
    let own = cells.iter().map(|cell| own.binary_search(cell).is_ok()).collect();
    Part { cells, own, portals }
}

#[cfg(test)]
mod tests {
    use super::super::reach::tests::{Numbers, rooms, walk};
    use super::*;
    use crate::math::geom::Aabb;
    use crate::pvs::flow::flow;
    use glam::DVec3;

    const SIDE: usize = 12;

    /// A square of rooms of a metre with holes between them, and an object in each.
    fn campus(numbers: &mut Numbers) -> (CellGraph, Vec<Aabb>, BitMatrix) {
        let portals = rooms(numbers, SIDE);
        let n = SIDE * SIDE;
        let part = Part { cells: (0..n as u32).collect(), own: Vec::new(), portals: (0..portals.len() as u32).collect() };
        let whole = CellGraph::given(vec![Cell::default(); n], portals);
        let graph = part.graph(&whole);
        let mut placement = BitMatrix::new(n, n);
        let object = |cell: usize| {
            let min = DVec3::new((cell % SIDE) as f64, (cell / SIDE) as f64, 0.0) + 0.4;
            Aabb { min, max: min + 0.2 }
        };
        (0..n).for_each(|c| _ = placement.set(c, c));
        (graph, (0..n).map(object).collect(), placement)
    }

    #[test]
    fn parts_keep_what_lines_meet_and_hide_what_the_whole_hides() {
        let mut numbers = Numbers(11);
        let (mut met, mut pairs, mut more) = (0, 0, 0);
        for round in 0..12 {
            let (graph, bounds, placement) = campus(&mut numbers);
            let n = graph.cells.len();
            let mut known = BitMatrix::new(n, n);
            if round % 2 == 1 {
                known.set(0, n - 1);
            }
            let input = FlowInput {
                graph: &graph,
                placement: &placement,
                placed_boxes: None,
                object_bounds: &bounds,
                cells_lower: &known,
                objects_lower: &known,
                max_steps: 1_000_000,
                coplanar: 1e-6,
                fronts: None,
            };
            let net = Net::of_graph(&graph, 1e-6);
            let sizes = Sizes { many: 0, looks: 1, own: 60, least: 1, worth: 0 };
            let parts = Parts::new(&net, sizes).expect("few enough");
            assert!(parts.parts.len() > 4);
            let owners = parts.parts.iter().flat_map(|part| part.cells.iter().zip(&part.own).filter(|(_, own)| **own));
            let mut owned: Vec<u32> = owners.map(|(&cell, _)| cell).collect();
            owned.sort_unstable();
            assert!(owned.into_iter().eq(0..n as u32), "each cell is one part's own");
            let by_parts = parts.flow(&input, &Job::quiet()).unwrap();
            let whole = flow(&input, &Job::quiet()).unwrap();
            assert_eq!((whole.capped, by_parts.capped), (0, 0));
            for _ in 0..2000 {
                let from = DVec3::new(numbers.next(), numbers.next(), numbers.next() / SIDE as f64) * SIDE as f64;
                let turn = std::f64::consts::TAU * numbers.next();
                let direction = DVec3::new(turn.cos(), turn.sin(), 0.1 * (numbers.next() - 0.5));
                let home = from.x as usize + SIDE * from.y as usize;
                for p in walk(&net, SIDE, from, direction) {
                    met += 1;
                    assert!(
                        by_parts.cells_upper.get(home, net.target[p] as usize)
                            && by_parts.cells_upper.get(net.target[p] as usize, home)
                    );
                }
            }
            assert!(by_parts.cells_upper == by_parts.cells_upper.transposed());
            assert_eq!(
                (known.first_outside(&by_parts.cells_upper), known.first_outside(&by_parts.objects_upper)),
                (None, None)
            );
            for (a, b) in [(&by_parts.cells_upper, &whole.cells_upper), (&by_parts.objects_upper, &whole.objects_upper)] {
                pairs += b.count_ones();
                more += (0..n).flat_map(|i| a.ones(i).filter(move |&j| !b.get(i, j))).count();
            }
        }
        assert!(met > 5_000, "{met} cells met");
        assert!(more == 0, "{more} more than {pairs}");
    }
}
