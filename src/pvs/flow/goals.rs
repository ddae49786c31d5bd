//! Goals of a search: the pairs that are still undecided.
//!
//! Based on: goal culling, from *two-sided flow* as measured for this project.
//!
//! A search ends as soon as it can reach no more goals. It needs three things: the portals into cells with goals, whether planes cut off a
//! goal, and what an arrival decides.

use super::might_see::{get, set};
use super::net::Net;
use super::shafts::Ways;
use super::stab::Passage;
use crate::BitMatrix;
use crate::cells::CellGraph;
use crate::math::bits;
use crate::math::geom::{Aabb, Plane};
use crate::types::placed::PlacedBox;
use glam::DVec3;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The undecided targets of one source.
pub trait Goals {
    /// Directed portals into cells with goals, as bits.
    fn portals(&self) -> &[u64];

    /// True if no goal of the cell has a point inside.
    fn is_cut_off(&self, net: &Net, cell: usize, inside: &Inside<'_>) -> bool;

    /// Portals that lines to portal `goal` may cross, as bits. `None`: all that might see it.
    fn ways(&self, _net: &Net, _goal: usize) -> Option<&[u64]> {
        None
    }

    /// True if an arrival in `cell` would decide a goal.
    fn would_decide(&self, net: &Net, cell: usize, inside: &Inside<'_>) -> bool;

    /// True if these goals accept the line through two points, which seems to pass `chain`.
    fn accepts(&mut self, chain: &[u32], line: [DVec3; 2]) -> bool;

    /// Tests `chain` exactly, if windows leave it open. Adds the work to `steps`.
    fn settle(&mut self, _chain: &[u32], _steps: &mut u64) -> Passage {
        Passage::Unknown
    }

    /// A line may enter `cell`; `passage` is the result of the chain's test, if there was one. Decides the goals that follow. Returns the
    /// work in steps of the search.
    fn arrive(&mut self, net: &Net, cell: usize, inside: &Inside<'_>, passage: Passage) -> u64;
}

/// Turns a line that passes a chain into a proof.
pub trait Prover: Sync {
    /// The type of a proof.
    type Proof: Serialize + DeserializeOwned + Send;

    /// Follows a line that seems to pass `chain`; appends the cells that it provably passes. `None` if it proves nothing.
    fn prove(&self, chain: &[u32], line: [DVec3; 2], cells: &mut Vec<u32>) -> Option<Self::Proof>;

    /// Random lines that are worth a try, if a shaft leaves a pair of cells open.
    fn tries(&self) -> u64 {
        0
    }

    /// Follows random line number `k` from one portal to another, likewise. `None` if it does not arrive.
    fn aim(&self, _from: usize, _to: usize, _k: u64, _cells: &mut Vec<u32>) -> Option<Self::Proof> {
        None
    }

    /// Tests a chain exactly, if windows leave it open. `None`: not supported. Appends the cells along a line that is found.
    fn settle(&self, _chain: &[u32], _cells: &mut Vec<u32>) -> Option<Settled<Self::Proof>> {
        None
    }
}

/// The result of an exact test.
pub enum Settled<P> {
    /// No line passes.
    Refuted,
    /// The line through these two points passes.
    Proven([DVec3; 2], P),
    /// Still unknown.
    Open,
}

/// Counters of exact tests.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Exact {
    /// Chains tested.
    pub asked: u64,
    /// Chains that no line passes.
    pub refuted: u64,
    /// Chains that a line passes.
    pub lines: u64,
}

impl Exact {
    /// Adds other counters.
    pub fn add(&mut self, other: &Self) {
        self.asked += other.asked;
        self.refuted += other.refuted;
        self.lines += other.lines;
    }
}

/// Cost of an exact test, in steps of the search.
const SETTLING: u64 = 128;

/// Keeps no proofs: a passable chain is enough.
pub(crate) struct NoProof;

impl Prover for NoProof {
    type Proof = ();

    fn prove(&self, _chain: &[u32], _line: [DVec3; 2], _cells: &mut Vec<u32>) -> Option<()> {
        Some(())
    }
}

/// Undecided chains into a cell, after which the cell is given up as undecided.
const DOUBTS: u32 = 8;

/// Goals for cells.
pub struct CellGoals<'a, P: Prover> {
    prover: &'a P,
    wanted: Vec<u64>,
    portals: Vec<u64>,
    /// For each cell, the number of undecided chains that lead to it.
    doubts: BTreeMap<usize, u32>,
    ways: Option<&'a Ways>,
    proofs: Vec<P::Proof>,
    /// The last line's cells.
    cells: Vec<u32>,
    exact: Exact,
}

impl<'a, P: Prover> CellGoals<'a, P> {
    /// Goals for the cells whose bit is set.
    pub fn new(net: &Net, prover: &'a P, wanted: Vec<u64>) -> Self {
        let mut portals = vec![0; net.portals().div_ceil(64)];
        for cell in bits::ones(&wanted) {
            net.out(cell).for_each(|p| set(&mut portals, net.twin[p] as usize));
        }
        Self {
            prover,
            wanted,
            portals,
            doubts: BTreeMap::new(),
            ways: None,
            proofs: Vec::new(),
            cells: Vec::new(),
            exact: Exact::default(),
        }
    }

    /// Restricts the ways to goals.
    pub(super) fn along(self, ways: &'a Ways) -> Self {
        Self { ways: Some(ways), ..self }
    }

    /// Cells that are still wanted, as bits.
    pub fn wanted(&self) -> &[u64] {
        &self.wanted
    }

    /// Cells that may be visible without a known line.
    pub fn doubtful(&self) -> impl Iterator<Item = usize> + '_ {
        self.doubts.keys().copied()
    }

    /// Counters of exact tests.
    pub fn exact(&self) -> Exact {
        self.exact
    }

    /// The lines that were found.
    pub fn into_proofs(self) -> Vec<P::Proof> {
        self.proofs
    }

    /// Marks a cell as possibly visible, or gives it up.
    pub fn see(&mut self, net: &Net, cell: usize) {
        if get(&self.wanted, cell) {
            self.wanted[cell / 64] &= !(1 << (cell % 64));
            forget(&mut self.portals, net, cell);
        }
    }

    /// Leaves a cell undecided.
    pub fn doubt(&mut self, net: &Net, cell: usize) {
        self.doubts.insert(cell, DOUBTS);
        self.see(net, cell);
    }
}

impl<P: Prover> Goals for CellGoals<'_, P> {
    fn portals(&self) -> &[u64] {
        &self.portals
    }

    fn is_cut_off(&self, _net: &Net, _cell: usize, _inside: &Inside<'_>) -> bool {
        false // its portals decide
    }

    #[inline(always)]
    fn ways(&self, net: &Net, goal: usize) -> Option<&[u64]> {
        self.ways?.of(net.target[goal] as usize)
    }

    fn would_decide(&self, _net: &Net, cell: usize, _inside: &Inside<'_>) -> bool {
        get(&self.wanted, cell)
    }

    fn accepts(&mut self, chain: &[u32], line: [DVec3; 2]) -> bool {
        self.cells.clear();
        match self.prover.prove(chain, line, &mut self.cells) {
            Some(proof) => {
                self.proofs.push(proof);
                true
            }
            None => false,
        }
    }

    fn settle(&mut self, chain: &[u32], steps: &mut u64) -> Passage {
        self.cells.clear();
        let Some(settled) = self.prover.settle(chain, &mut self.cells) else { return Passage::Unknown };
        *steps += SETTLING;
        self.exact.asked += 1;
        match settled {
            Settled::Refuted => {
                self.exact.refuted += 1;
                Passage::Refuted
            }
            Settled::Proven(line, proof) => {
                self.exact.lines += 1;
                self.proofs.push(proof);
                Passage::Line(line)
            }
            Settled::Open => Passage::Unknown,
        }
    }

    fn arrive(&mut self, net: &Net, cell: usize, _inside: &Inside<'_>, passage: Passage) -> u64 {
        if !get(&self.wanted, cell) {
            return 0;
        }
        if let Passage::Line(_) = passage {
            self.doubts.remove(&cell);
            self.see(net, cell);
            for other in std::mem::take(&mut self.cells) {
                self.doubts.remove(&(other as usize));
                self.see(net, other as usize);
            }
        } else {
            let doubts = self.doubts.entry(cell).or_default();
            *doubts += 1;
            if *doubts >= DOUBTS {
                self.see(net, cell);
            }
        }
        0
    }
}

/// Objects in flow: boxes, and their cells.
pub(crate) struct Boxes {
    /// Centre and half size; infinite half size if the box is unusable.
    boxes: Vec<(DVec3, DVec3)>,
    /// Objects of each cell, ascending, each with the box of its part in the cell.
    in_cell: Vec<Vec<(u32, (DVec3, DVec3))>>,
    /// Cells of each object, ascending.
    cells_of: Vec<Vec<u32>>,
}

/// Margin of a cell's box, to which objects' boxes are clipped, in coplanar tolerances. Smaller than the margin of placement, 12: objects
/// placed in a cell from outside would have no part there.
const CELL_MARGIN: f64 = 16.0;

/// Box tests per step of the search.
const BOXES_A_STEP: u64 = 64;

impl Boxes {
    /// Converts boxes to coordinates relative to the net's origin.
    pub fn new(net: &Net, graph: &CellGraph, placement: &BitMatrix, placed: Option<&[PlacedBox]>, bounds: &[Aabb]) -> Self {
        let laid_out = |b: &Aabb| {
            let (middle, half) = (b.centre() - net.origin, b.size() * 0.5);
            let usable = middle.is_finite() && half.is_finite() && half.min_element() >= 0.0;
            if usable { (middle, half) } else { (DVec3::ZERO, DVec3::INFINITY) }
        };
        let margin = CELL_MARGIN * net.slack.coplanar;
        let mut placed = placed.map(|placed| placed.iter());
        let mut in_cell = |c: usize| {
            let around = graph.cells[c].pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.bounds)).inflated(margin);
            let part = |o: usize| {
                let whole = bounds[o];
                // An object without a finite box has no part.
                let placed = placed.as_mut().and_then(Iterator::next).filter(|_| whole.size().is_finite());
                let b = placed.map_or(whole, |placed| placed.of_box(whole));
                let part = Aabb { min: b.min.max(around.min), max: b.max.min(around.max) };
                (o as u32, laid_out(if part.is_empty() { &b } else { &part }))
            };
            placement.ones(c).map(part).collect::<Vec<_>>()
        };
        let boxes = bounds.iter().map(laid_out).collect();
        let in_cell: Vec<Vec<_>> = (0..placement.rows()).map(&mut in_cell).collect();
        let mut cells_of = vec![Vec::new(); placement.columns()];
        for (cell, objects) in in_cell.iter().enumerate() {
            objects.iter().for_each(|&(o, _)| cells_of[o as usize].push(cell as u32));
        }
        Self { boxes, in_cell, cells_of }
    }
}

/// The space that lines through a chain of portals can reach.
#[derive(Clone, Copy)]
pub struct Inside<'p> {
    /// It is inside these planes.
    pub planes: &'p [Plane],
    /// The first and the last portal of the chain.
    pub ends: [usize; 2],
}

impl Inside<'_> {
    /// True if no line reaches a box, given by its centre and half size. A box that only touches a plane is reached if it is in one of the
    /// portals, as a door leaf is, to within the caller's tolerance. Elsewhere only lines in the plane would reach it, and these cross no
    /// portal.
    #[inline]
    fn cut_off(&self, net: &Net, (middle, half): (DVec3, DVec3)) -> bool {
        let hangs = self.ends.iter().any(|&portal| net.bounds(portal).meets(middle, half, net.slack.coplanar));
        let limit = if hangs { net.slack.coplanar } else { -net.single };
        self.planes.iter().any(|plane| plane.distance(middle) - plane.n.abs().dot(half) > limit)
    }
}

/// Goals for objects, from one source portal.
pub(crate) struct ObjectGoals<'a> {
    boxes: &'a Boxes,
    wanted: Vec<u64>,
    found: Vec<usize>,
    /// Number of goals in each cell.
    left: Vec<u32>,
    /// Box around the initial goals of each cell.
    around: Vec<Aabb>,
    portals: Vec<u64>,
}

impl<'a> ObjectGoals<'a> {
    /// Goals for the objects of `undecided` in `cells` and in the half-space in front of the source portal.
    pub fn new(net: &Net, boxes: &'a Boxes, undecided: &[u64], cells: &[u64], portal: usize) -> Self {
        let front = net.plane(portal).map(|plane| plane.flipped());
        let front = Inside { planes: front.as_slice(), ends: [portal; 2] };
        let mut goals = Self {
            boxes,
            wanted: vec![0; undecided.len()],
            found: Vec::new(),
            left: vec![0; net.cells],
            around: vec![Aabb::EMPTY; net.cells],
            portals: vec![0; net.portals().div_ceil(64)],
        };
        for cell in bits::ones(cells) {
            for &(o, (middle, half)) in &boxes.in_cell[cell] {
                let o = o as usize;
                if get(undecided, o) && !front.cut_off(net, boxes.boxes[o]) {
                    set(&mut goals.wanted, o);
                    goals.left[cell] += 1;
                    goals.around[cell] = goals.around[cell].union(Aabb { min: middle - half, max: middle + half });
                }
            }
            if goals.left[cell] > 0 {
                net.out(cell).for_each(|p| set(&mut goals.portals, net.twin[p] as usize));
            }
        }
        goals
    }
}

impl ObjectGoals<'_> {
    /// Objects that may be visible, in the order of discovery.
    pub fn found(&self) -> &[usize] {
        &self.found
    }

    /// Marks all remaining goals as possibly visible.
    pub fn see_all(&mut self) {
        self.found.extend(bits::ones(&self.wanted));
        self.wanted.fill(0);
    }

    /// True if an object is a goal and its part with this box is not cut off.
    fn finds(&self, net: &Net, object: usize, part: (DVec3, DVec3), inside: &Inside<'_>) -> bool {
        get(&self.wanted, object) && !inside.cut_off(net, part)
    }
}

impl Goals for ObjectGoals<'_> {
    fn portals(&self) -> &[u64] {
        &self.portals
    }

    fn is_cut_off(&self, net: &Net, cell: usize, inside: &Inside<'_>) -> bool {
        inside.cut_off(net, (self.around[cell].centre(), self.around[cell].size() * 0.5))
    }

    fn would_decide(&self, net: &Net, cell: usize, inside: &Inside<'_>) -> bool {
        self.left[cell] > 0
            && !self.is_cut_off(net, cell, inside)
            && self.boxes.in_cell[cell].iter().any(|&(o, part)| self.finds(net, o as usize, part, inside))
    }

    fn accepts(&mut self, _chain: &[u32], _line: [DVec3; 2]) -> bool {
        true
    }

    fn arrive(&mut self, net: &Net, cell: usize, inside: &Inside<'_>, _passage: Passage) -> u64 {
        if self.left[cell] == 0 || self.is_cut_off(net, cell, inside) {
            return 0;
        }
        let boxes = self.boxes;
        for &(o, part) in &boxes.in_cell[cell] {
            let index = o as usize;
            if !self.finds(net, index, part, inside) {
                continue;
            }
            self.wanted[index / 64] &= !(1 << (index % 64));
            self.found.push(index);
            for &c in &boxes.cells_of[index] {
                let c = c as usize;
                // Cells that the search can't reach were never counted.
                if self.left[c] > 0 {
                    self.left[c] -= 1;
                    if self.left[c] == 0 {
                        forget(&mut self.portals, net, c);
                    }
                }
            }
        }
        boxes.in_cell[cell].len() as u64 / BOXES_A_STEP
    }
}

/// Removes the portals into a cell from the goals.
fn forget(portals: &mut [u64], net: &Net, cell: usize) {
    for p in net.out(cell) {
        let into = net.twin[p] as usize;
        portals[into / 64] &= !(1 << (into % 64));
    }
}

#[cfg(test)]
mod tests {
    use super::super::net::NetPortal;
    use super::*;

    /// A view down through a hole in the slab at 3.3 m: walls on the slab are not reached, although rounding to `f32` puts their feet below
    /// it; objects that hang through the hole or lie in it are.
    #[test]
    fn what_stands_on_the_plane_of_a_hole_is_not_met_from_above() {
        let level = 3.3;
        let winding = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0)].map(|(x, z)| DVec3::new(x, level, z));
        let far = [(30.0, 0.0), (30.0, 1.0), (31.0, 1.0), (31.0, 0.0)].map(|(x, z)| DVec3::new(x, level, z));
        let plane = Plane { n: DVec3::Y, d: level };
        let portals = [&winding, &far].map(|w| NetPortal { cells: [1, 0], plane, winding: w });
        let net = Net::new(2, &portals, 1e-4);
        let down = net.out(0).find(|&p| net.ids[p] < 2).unwrap();
        let below = net.plane(down).unwrap();
        assert!(below.n.y < -0.9, "leads down");
        let planes = [below.flipped()];
        let met = |x: f64, foot: f64| {
            let (min, max) = (DVec3::new(x, foot, 0.2), DVec3::new(x + 0.5, foot + 2.5, 0.4));
            let inside = Inside { planes: &planes, ends: [down; 2] };
            !inside.cut_off(&net, ((min + max) * 0.5 - net.origin, (max - min) * 0.5))
        };
        let rounded = f64::from(level as f32).min(level - 1e-6);
        assert!(!met(9.0, level) && !met(9.0, rounded) && !met(9.0, level + 1e-6));
        assert!(met(9.0, level - 1e-4) && met(9.0, 0.0));
        // In the hole.
        assert!(met(0.25, level) && met(0.25, rounded));
        assert!(!met(0.25, level + 1e-3));
    }
}
