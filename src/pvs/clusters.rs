//! Clusters: neighbouring cells share a row if that adds few triangles.
//!
//! Based on: Mattausch, Bittner, Wimmer, *Adaptive visibility-driven view cell construction*, 2006: the cost of a partition is the expected
//! number of triangles in a row, weighted by volume; and Mattausch, Bittner, Wonka, Wimmer, *Optimized subdivisions for preprocessed
//! visibility*, 2007: the cheapest merge comes first. Deviations: the cells are those of portal flow and not of a tree, and any two cells
//! with a common portal may merge. Rows are unions, so nothing visible is lost, and a bound that holds for each cell holds for all.

use super::Pvs;
use super::sampling::region::Region;
use super::triangles::Triangles;
use crate::cells::Placement;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::merge::merge;
use crate::math::parallel;
use crate::scene::Scene;
use crate::types::bounds::Unseen;
use crate::types::guarantee::Guarantee;
use crate::types::placed::PlacedBox;
use crate::types::portal::PortalKind;
use crate::{BitMatrix, CellId};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::fmt;

/// The result of joining.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Joined {
    /// Cells before.
    pub found: usize,
    /// Cells after.
    pub cells: usize,
    /// Triangles in a row, weighted by the cells' volumes, before and after.
    pub expected: [f64; 2],
}

impl fmt::Display for Joined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found, cells, expected: [before, after] } = self;
        write!(
            f,
            "clusters: {found} cells joined to {cells}; a row grows from {before:.1} to {after:.1} triangles, averaged by volume"
        )
    }
}

/// Joins cells until the expected number of triangles in a row would grow by more than `growth` (0.05: by 5 %). Open cells do not join
/// closed ones, and the two sides of a door do not join.
pub fn join(scene: &Scene, pvs: &mut Pvs, growth: f64) -> Joined {
    let mut parts = Parts::new(scene, pvs);
    let volume: f64 = parts.of.iter().map(|part| part.volume).sum();
    let [before, after] = parts.join(growth);
    let found = pvs.graph.cells.len();
    let ids = merge(&mut pvs.graph, &mut parts.groups);
    let cells = pvs.graph.cells.len();
    if cells < found {
        unite(pvs, &ids, cells);
    }
    Joined { found, cells, expected: [before, after].map(|cost| if volume > 0.0 { cost / volume } else { 0.0 }) }
}

/// Cells during joining; a joined part is stored at its lowest number.
struct Parts {
    triangles: Triangles,
    groups: DisjointSets,
    of: Vec<Part>,
    pairs: BinaryHeap<Reverse<Pair>>,
}

/// One or more cells.
struct Part {
    /// Objects in its row.
    row: Vec<u64>,
    triangles: u64,
    /// Cubic metres.
    volume: f64,
    open: bool,
    /// Adjacent parts by number; `true` if one of the common portals is a door.
    neighbours: BTreeMap<u32, bool>,
    /// Number of merges.
    version: u32,
}

impl Part {
    fn cost(&self) -> f64 {
        self.volume * self.triangles as f64
    }
}

/// A candidate merge, ordered by its added cost. Valid while neither part grows.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Pair {
    /// The bits of a non-negative number, which sort like the number.
    adds: u64,
    parts: [u32; 2],
    versions: [u32; 2],
}

impl Parts {
    fn new(scene: &Scene, pvs: &Pvs) -> Self {
        let rows = match pvs.guarantee {
            Guarantee::Conservative => &pvs.objects_upper,
            Guarantee::Sampled => &pvs.objects_lower,
        };
        let (graph, within, triangles) = (&pvs.graph, scene.bounds(), Triangles::of(scene));
        let part = |c: usize| {
            let (cell, row) = (&graph.cells[c], rows.row(c).to_vec());
            let mut neighbours = BTreeMap::new();
            for &portal in &cell.portals {
                let door = graph.portals[portal.portal().index()].kind == PortalKind::Door;
                *neighbours.entry(graph.target(portal).0).or_default() |= door;
            }
            let volume = Region::new(&cell.pieces, within).volume();
            Part { triangles: triangles.in_row(row.iter().copied()), row, volume, open: cell.open, neighbours, version: 0 }
        };
        let of = parallel::map_range(0..graph.cells.len(), part);
        let mut parts = Self { groups: DisjointSets::new(of.len()), triangles, of, pairs: BinaryHeap::new() };
        for a in 0..parts.of.len() as u32 {
            parts.offer(a, |b| b > a);
        }
        parts
    }

    /// Queues merges of a part with the neighbours selected by `to`.
    fn offer(&mut self, a: u32, to: impl Fn(u32) -> bool) {
        let part = &self.of[a as usize];
        for (&b, _) in part.neighbours.iter().filter(|&(&b, &door)| !door && to(b)) {
            let other = &self.of[b as usize];
            if part.open == other.open {
                let more = |to: &Part, from: &Part| {
                    self.triangles.in_row(from.row.iter().zip(&to.row).map(|(from, to)| from & !to)) as f64
                };
                let adds = part.volume * more(part, other) + other.volume * more(other, part);
                let versions = [part.version, other.version];
                self.pairs.push(Reverse(Pair { adds: adds.to_bits(), parts: [a, b], versions }));
            }
        }
    }

    /// Repeats the cheapest merge until the cost would exceed `1 + growth` times that of the cells. Returns both costs.
    fn join(&mut self, growth: f64) -> [f64; 2] {
        let before: f64 = self.of.iter().map(Part::cost).sum();
        let mut after = before;
        while let Some(Reverse(pair)) = self.pairs.pop() {
            let Pair { parts: [a, b], versions, .. } = pair;
            if [a, b].map(|part| self.of[part as usize].version) != versions {
                continue;
            }
            let adds = f64::from_bits(pair.adds);
            if after + adds > (1.0 + growth) * before {
                break;
            }
            after += adds;
            self.grow(a.min(b), a.max(b));
        }
        [before, after]
    }

    /// Merges `b` into `a`.
    fn grow(&mut self, a: u32, b: u32) {
        self.groups.join(a, b);
        let other = &mut self.of[b as usize];
        other.version += 1;
        let (row, neighbours, volume) =
            (std::mem::take(&mut other.row), std::mem::take(&mut other.neighbours), other.volume);
        let part = &mut self.of[a as usize];
        part.row.iter_mut().zip(&row).for_each(|(all, more)| *all |= more);
        part.triangles = self.triangles.in_row(part.row.iter().copied());
        part.volume += volume;
        part.version += 1;
        part.neighbours.remove(&b);
        for (c, door) in neighbours.into_iter().filter(|&(c, _)| c != a) {
            *self.of[a as usize].neighbours.entry(c).or_default() |= door;
            let theirs = &mut self.of[c as usize].neighbours;
            theirs.remove(&b);
            *theirs.entry(a).or_default() |= door;
        }
        self.offer(a, |_| true);
    }
}

/// Converts sets and proofs of cells to clusters: `ids`, by cell.
fn unite(pvs: &mut Pvs, ids: &[CellId], clusters: usize) {
    pvs.clusters = vec![0; clusters];
    ids.iter().for_each(|id| pvs.clusters[id.index()] += 1);
    for matrix in [&mut pvs.cells_lower, &mut pvs.cells_upper] {
        let mut united = BitMatrix::new(clusters, clusters);
        for (cell, id) in ids.iter().enumerate() {
            matrix.ones(cell).for_each(|other| _ = united.set(id.index(), ids[other].index()));
        }
        *matrix = united;
    }
    let rows = |matrix: &BitMatrix| {
        let mut united = BitMatrix::new(clusters, matrix.columns());
        for (cell, id) in ids.iter().enumerate() {
            united.row_mut(id.index()).iter_mut().zip(matrix.row(cell)).for_each(|(all, more)| *all |= more);
        }
        united
    };
    pvs.objects_lower = rows(&pvs.objects_lower);
    pvs.objects_upper = rows(&pvs.objects_upper);
    pvs.unresolved = rows(&pvs.unresolved);
    let boxes = pvs.placement.boxes.take().map(|boxes| united_boxes(&pvs.placement.matrix, &boxes, ids, clusters));
    pvs.placement = Placement { matrix: rows(&pvs.placement.matrix), boxes };
    pvs.witnesses.iter_mut().for_each(|w| w.cell = ids[w.cell.index()]);
    pvs.witnesses.sort_by_key(|w| (w.cell, w.object));
    pvs.witnesses.dedup_by_key(|w| (w.cell, w.object));
    pvs.repairs.iter_mut().for_each(|repair| repair.cells = repair.cells.map(|c| ids[c.index()]));
    pvs.repairs.retain(|repair| repair.cells[0] != repair.cells[1]);
    if let Some(unseen) = &mut pvs.unseen {
        // The unseen part of a cluster is a mean over its cells, so at most their maximum.
        let mut most = vec![0.0f32; clusters];
        ids.iter().zip(&unseen.cells).for_each(|(id, bound)| most[id.index()] = most[id.index()].max(*bound));
        *unseen = Unseen { mean: unseen.mean, cells: most };
    }
}

/// The box of each object in each cluster.
fn united_boxes(placement: &BitMatrix, boxes: &[PlacedBox], ids: &[CellId], clusters: usize) -> Vec<PlacedBox> {
    let mut united: Vec<BTreeMap<usize, PlacedBox>> = vec![BTreeMap::new(); clusters];
    let placed = ids.iter().enumerate().flat_map(|(cell, id)| placement.ones(cell).map(move |object| (id.index(), object)));
    for ((cluster, object), &part) in placed.zip(boxes) {
        united[cluster].entry(object).and_modify(|whole| *whole = whole.union(part)).or_insert(part);
    }
    united.into_iter().flat_map(BTreeMap::into_values).collect()
}
