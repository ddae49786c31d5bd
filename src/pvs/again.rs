//! Guesses from the last bake of a model that has changed since, and what becomes of them.
//!
//! A pair that the last bake hid is tried again, with all that a search may cost; one that it left is not, unless the cell may see what
//! changed. So a guess that is wrong, by a change or by a forger, costs time or a pair too many, and hides nothing.

use super::sampling::witness::{Found, Prover};
use crate::BitMatrix;
use crate::cells::{CellGraph, Locator};
use crate::job::{Job, Stopped};
use crate::math::bits;
use crate::math::geom::Aabb;
use crate::scene::Scene;
use crate::scene::rays::{Hit, RayScene};
use crate::types::proof::Witness;
use glam::DVec3;
use serde::Serialize;

/// Witnesses of one item of work.
const BATCH: usize = 256;

/// What the last bake says of the cells and objects of this one.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Hints {
    /// Cells x objects: pairs in its rows.
    pub seen: BitMatrix,
    /// The cells that are where it had some.
    pub cells: Vec<bool>,
    /// The objects that are as they were, a bit each.
    pub objects: Vec<u64>,
    /// Cells x cells, symmetric: pairs in its rows.
    pub cells_seen: BitMatrix,
    /// The cells that saw an object which is not as it was.
    pub saw_change: Vec<bool>,
    /// Its witnesses of these objects, if it kept them; their cells are its own.
    pub witnesses: Vec<Witness>,
    /// Segments that went through holes of its graph.
    pub through_holes: Vec<[DVec3; 2]>,
}

/// What became of the last bake's pairs.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct Again {
    /// Cells.
    pub cells: usize,
    /// Cells that are new, or may see an object that is not as it was.
    pub cells_anew: usize,
    /// Pairs of the other cells that the last bake hid and flow does not hide.
    pub hidden: u64,
    /// Those of them that occluders hide again.
    pub hidden_again: u64,
}

impl Hints {
    /// A word of the objects that the last bake knew, as seen from a cell.
    fn known(&self, cell: usize, word: usize) -> u64 {
        if self.cells[cell] { self.objects[word] } else { 0 }
    }

    /// The share of the cells that are new.
    pub(in crate::pvs) fn share_new(&self) -> f64 {
        let new = self.cells.iter().filter(|known| !**known).count();
        new as f64 / self.cells.len().max(1) as f64
    }

    /// The cells that are new, or that may see an object which is not as it was, by the upper set.
    pub(in crate::pvs) fn cells_anew(&self, upper: &BitMatrix) -> Vec<bool> {
        let sees_change = |c: usize| upper.row(c).iter().zip(&self.objects).any(|(seen, same)| seen & !same != 0);
        (0..upper.rows()).map(|c| !self.cells[c] || sees_change(c)).collect()
    }

    /// The pairs that rays are aimed at: those of the upper set that the last bake does not know.
    pub(in crate::pvs) fn to_aim_at(&self, upper: &BitMatrix) -> BitMatrix {
        self.rows(upper, |c, word, upper, _| upper & !self.known(c, word))
    }

    /// Pairs of cells, and of cells and objects, that count as visible without a search: those in the last bake's rows, of cells that by these
    /// rows see no place where something changed. `placement`: the objects in each cell, today.
    pub(in crate::pvs) fn assumed(&self, graph: &CellGraph, placement: &BitMatrix) -> [BitMatrix; 2] {
        let count = graph.cells.len();
        let mut places = vec![0; count.div_ceil(64)];
        for (c, cell) in graph.cells.iter().enumerate() {
            let is_beside_new = cell.portals.iter().any(|&portal| !self.cells[graph.target(portal).index()]);
            let has_change = placement.row(c).iter().zip(&self.objects).any(|(here, same)| here & !same != 0);
            if !self.cells[c] || is_beside_new || has_change {
                places[c / 64] |= 1 << (c % 64);
            }
        }
        let sees_place = |c: usize| self.cells_seen.row(c).iter().zip(&places).any(|(seen, place)| seen & place != 0);
        let is_same: Vec<bool> = (0..count)
            .map(|c| self.cells[c] && !self.saw_change[c] && places[c / 64] >> (c % 64) & 1 == 0 && !sees_place(c))
            .collect();
        let objects = self.rows(&self.seen, |c, word, _, seen| if is_same[c] { seen & self.known(c, word) } else { 0 });
        let mut cells = BitMatrix::new(count, count);
        for c in (0..count).filter(|&c| is_same[c]) {
            self.cells_seen.ones(c).filter(|&d| is_same[d]).for_each(|d| _ = cells.set(c, d));
        }
        [cells, objects]
    }

    /// The pairs that occluders are not asked about: those in the last bake's rows, unless something that changed is between. `upper`: the
    /// upper set; `bounds`: the objects' boxes.
    pub(in crate::pvs) fn to_leave(
        &self,
        graph: &CellGraph,
        upper: &BitMatrix,
        anew: &[bool],
        bounds: &[Aabb],
    ) -> BitMatrix {
        self.rows(&self.seen, |c, word, _, seen| {
            let left = seen & self.known(c, word);
            if !anew[c] || left == 0 {
                return left;
            }
            // What changed may hide what is behind it.
            let changed = bits::ones(upper.row(c)).filter(|o| self.objects[o / 64] >> (o % 64) & 1 == 0);
            let changed: Vec<Aabb> = changed.map(|o| bounds[o]).collect();
            let exits = graph.cells[c].portals.iter().flat_map(|p| &graph.portals[p.portal().index()].winding);
            let exits = Aabb::of(exits.copied());
            let may_be_behind = |bit: &usize| {
                let between = exits.union(bounds[64 * word + bit]);
                changed.iter().any(|b| b.touches(&between))
            };
            bits::ones(&[left]).filter(may_be_behind).fold(left, |left, bit| left & !(1 << bit))
        })
    }

    /// The pairs of the upper set that the last bake hid, of cells that see no change.
    pub(in crate::pvs) fn hidden(&self, upper: &BitMatrix, anew: &[bool]) -> u64 {
        self.rows(upper, |c, word, upper, seen| if anew[c] { 0 } else { upper & !seen & self.known(c, word) }).count_ones()
    }

    /// Rows, word by word, of a matrix and of those seen.
    fn rows(&self, of: &BitMatrix, word: impl Fn(usize, usize, u64, u64) -> u64) -> BitMatrix {
        let mut rows = BitMatrix::new(of.rows(), of.columns());
        for c in 0..of.rows() {
            let words = of.row(c).iter().zip(self.seen.row(c)).enumerate();
            let row: Vec<u64> = words.map(|(i, (&of, &seen))| word(c, i, of, seen)).collect();
            rows.assign_row(c, &row);
        }
        rows
    }

    /// Holds witnesses, and segments through holes, against the triangles of today: a ray each.
    pub(in crate::pvs) fn witnessed(
        &self,
        rays: &RayScene<'_>,
        graph: &CellGraph,
        work: &Job<'_>,
    ) -> Result<Vec<Found>, Stopped> {
        let locator = Locator::new(graph);
        let prover = Prover { rays, locator: &locator, clearance: rays.tolerance().clearance };
        let batches: Vec<&[Witness]> = self.witnesses.chunks(BATCH).collect();
        let hold = |(): &mut (), batch: &&[Witness]| {
            let mut found = Found::default();
            for &Witness { object, from, to, .. } in *batch {
                let (Some((cell, _)), Some(triangle)) = (locator.locate(from), nearest(rays.scene(), object.index(), to))
                else {
                    continue;
                };
                prover.aim(cell, from, to, Hit { t: 1.0, triangle, object }, &mut found);
            }
            found.close()
        };
        let tell = |done: usize| work.tell("witnesses", done as f64 / batches.len() as f64);
        let mut all = work.map_with(&batches, || (), hold, tell)?;
        let mut found = Found::default();
        for &[a, b] in &self.through_holes {
            if let (Some((first, _)), Some((last, _))) = (locator.locate(a), locator.locate(b)) {
                let (cells, ends) = if first <= last { ([first, last], [a, b]) } else { ([last, first], [b, a]) };
                prover.aim_sight(cells, ends, &mut found);
            }
        }
        all.push(found.close());
        Ok(all)
    }
}

/// The triangle of an object whose box is nearest to a point.
fn nearest(scene: &Scene, object: usize, p: DVec3) -> Option<u32> {
    let off = |t: &u32| {
        let [a, b, c] = scene.corners(*t as usize);
        let to_plane = (b - a).cross(c - a).try_normalize().map_or(0.0, |n| n.dot(p - a).abs());
        let bounds = Aabb::of([a, b, c]);
        to_plane.max((bounds.min - p).max(p - bounds.max).max_element())
    };
    scene.objects[object].triangles.clone().min_by(|a, b| off(a).total_cmp(&off(b)))
}
