//! The search for a way: sequences of portals, the most promising first.

use super::super::culler::{Culler, target};
use super::super::doors::Doors;
use super::ahead::{Ahead, Goal};
use super::barrier::Barrier;
use super::facets::Facets;
use super::table::reversed;
use super::tight::{Line, Proof};
use crate::{CellId, DirectedPortal};
use glam::{DVec3, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A way longer than its proof by less than this, and this share, is the shortest, metres. Larger: longer ways. Smaller: more rounds.
const EXACT: f64 = 1e-4;
const EXACT_SHARE: f64 = 1e-6;
/// Rounds of a line that is only a bound. More: slower. Fewer: weaker bounds, and more lines.
const FEW: usize = 3;
/// Rounds of a way before each step of Newton's method, before the barrier goes on. More: slower. Fewer: the barrier, which is slower still.
const ROUNDS: [usize; 6] = [4, 2, 2, 2, 4, 8];
/// Sequences that are followed before each portal is left by one alone. More: ways through open country take longer. Fewer: they are not
/// the shortest.
const MOST_FOLLOWED: usize = 4096;

/// Sequences that are followed before it is looked whether there is any way. More: slower where there is none. Fewer: slower where there is one.
const SOON: usize = 64;

/// No sequence.
const NONE: u32 = u32::MAX;

/// A sequence of portals: those of its parent, and one more.
#[derive(Clone, Copy, Debug)]
struct Sequence {
    portal: DirectedPortal,
    parent: u32,
    /// No way through it to the goal is shorter, metres.
    key: f64,
    /// No way through it to its last portal is shorter, metres.
    to_last: f64,
    /// Where its line passes the last portal.
    at: DVec3,
    /// Once it is pulled: no way through it to a point `p` is shorter than `constant + along . (p - start)`, metres.
    constant: f64,
    along: DVec3,
    is_pulled: bool,
}

/// The first sequence to a portal that was followed.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Label {
    None,
    Followed(u32),
    /// Its lengths to the portal's corners are known.
    Measured,
}

/// Cells that the goal is reached from.
#[derive(Clone, Debug, Default)]
struct Flood {
    reached: Vec<bool>,
    cells: Vec<CellId>,
}

/// All memory of ways.
#[derive(Clone, Debug)]
pub(super) struct Search {
    facets: Facets,
    ahead: Ahead,
    goal: Goal,
    from: DVec3,
    sequences: Vec<Sequence>,
    /// Bits of a key, which sort like it, and the sequence.
    queue: BinaryHeap<Reverse<(u64, u32)>>,
    /// By directed portal.
    labels: Vec<Label>,
    labelled: Vec<DirectedPortal>,
    /// By edge of a portal, in either direction: the length of the label's line to the corner where it starts, metres.
    to_corners: [Vec<f64>; 2],
    /// A line beside the one that is pulled.
    other: Line,
    followed: usize,
    /// The least key of a sequence that was left out without a proof.
    left_out: f64,
    line: Line,
    barrier: Barrier,
    flood: Flood,
    pub metres: f64,
    pub points: Vec<Vec3>,
    pub passed: Vec<DirectedPortal>,
}

impl Search {
    pub fn new(culler: &Culler, passable: &Doors) -> Self {
        let facets = Facets::new(culler, passable);
        Self {
            ahead: Ahead::new(culler, &facets),
            goal: Goal::default(),
            from: DVec3::ZERO,
            sequences: Vec::new(),
            queue: BinaryHeap::new(),
            labels: vec![Label::None; 2 * culler.portal_count()],
            labelled: Vec::new(),
            to_corners: [0, 1].map(|_| vec![0.0; facets.edge_count()]),
            other: Line::default(),
            followed: 0,
            left_out: f64::INFINITY,
            line: Line::default(),
            barrier: Barrier::default(),
            flood: Flood::default(),
            metres: 0.0,
            points: Vec::new(),
            passed: Vec::new(),
            facets,
        }
    }

    /// Finds the way between two points in some cells each: fills in its length, points and portals. Gives what any way takes at least,
    /// metres.
    pub fn find(
        &mut self,
        culler: &Culler,
        doors: &Doors,
        [from, to]: [DVec3; 2],
        [starts, ends]: [&[CellId]; 2],
    ) -> Option<f64> {
        doors.assert_of(culler);
        if starts.is_empty() || ends.is_empty() {
            return None;
        }
        self.begin(from);
        if starts.iter().any(|cell| ends.contains(cell)) {
            Self::set_line(&mut self.line, &[], NONE, [from, to]);
            return Some(self.finish(NONE, from.distance(to)));
        }
        self.ahead.aim(culler, &self.facets, to, ends, &mut self.goal);
        for &start in starts {
            self.offer(culler, doors, NONE, start, starts);
        }
        while let Some(Reverse((_, at))) = self.queue.pop() {
            let Sequence { portal, is_pulled, .. } = self.sequences[at as usize];
            let is_there = ends.contains(&target(culler, portal));
            if self.is_left_out(at) || !is_pulled && !self.pull(culler, at, is_there) {
                continue;
            }
            let key = self.sequences[at as usize].key;
            if !is_pulled && self.queue.peek().is_some_and(|Reverse((least, _))| *least < key.to_bits()) {
                self.queue.push(Reverse((key.to_bits(), at)));
            } else if is_there {
                if is_pulled {
                    self.take_line(at);
                    self.tighten();
                }
                return Some(self.finish(at, key));
            } else {
                self.follow(culler, doors, at, starts);
                if self.followed == SOON && !self.is_reachable(culler, doors, starts) {
                    return None;
                }
            }
        }
        None
    }

    fn begin(&mut self, from: DVec3) {
        self.from = from;
        self.sequences.clear();
        self.queue.clear();
        self.labelled.drain(..).for_each(|portal| self.labels[portal.0 as usize] = Label::None);
        self.followed = 0;
        self.left_out = f64::INFINITY;
    }

    /// Whether there is any way: by a flood, backwards from the goal.
    fn is_reachable(&mut self, culler: &Culler, doors: &Doors, starts: &[CellId]) -> bool {
        let Self { flood, facets, goal, .. } = self;
        flood.reached.clear();
        flood.reached.resize(culler.cell_count(), false);
        flood.cells.clear();
        flood.cells.extend_from_slice(&goal.cells);
        while let Some(cell) = flood.cells.pop() {
            if !std::mem::replace(&mut flood.reached[cell.index()], true) {
                let into = facets.out(cell).iter().filter(|&&out| doors.is_open(reversed(out)));
                flood.cells.extend(into.map(|&out| target(culler, out)));
            }
        }
        starts.iter().any(|start| flood.reached[start.index()])
    }

    /// Goes on from a sequence, or from the start, by each portal out of a cell.
    fn offer(&mut self, culler: &Culler, doors: &Doors, parent: u32, cell: CellId, starts: &[CellId]) {
        for i in 0..self.facets.out(cell).len() {
            let portal = self.facets.out(cell)[i];
            let into = target(culler, portal);
            let is_new = || !starts.contains(&into) && !self.chain(parent).any(|s| target(culler, s.portal) == into);
            if !doors.is_open(portal) || !self.ahead.may_enter(cell, into, &self.goal) || !is_new() {
                continue;
            }
            let next = portal.portal().index();
            let (to_last, key) = match self.sequences.get(parent as usize) {
                None => (self.facets.distance(next, self.from), 0.0),
                Some(s) => {
                    let corners = self.facets.edges(next).iter().map(|edge| s.along.dot(edge.start - self.from));
                    let by_proof = s.constant + corners.fold(f64::INFINITY, f64::min);
                    ((s.to_last + self.facets.gap(s.portal.portal().index(), next)).max(by_proof), s.key)
                }
            };
            let remaining = self.ahead.remaining(culler, &self.facets, portal, &mut self.goal);
            let key = key.max(to_last + remaining);
            if key.is_finite() {
                let at = self.facets.edges(next)[0].start;
                self.queue.push(Reverse((key.to_bits(), self.sequences.len() as u32)));
                self.sequences.push(Sequence {
                    portal,
                    parent,
                    key,
                    to_last,
                    at,
                    constant: 0.0,
                    along: DVec3::ZERO,
                    is_pulled: false,
                });
            }
        }
    }

    /// A sequence, its parent, and so on.
    fn chain(&self, at: u32) -> impl Iterator<Item = &Sequence> {
        std::iter::successors(self.sequences.get(at as usize), |sequence| self.sequences.get(sequence.parent as usize))
    }

    /// Whether a sequence is given up for the work that there was.
    fn is_left_out(&mut self, at: u32) -> bool {
        let Sequence { portal, key, .. } = self.sequences[at as usize];
        let leave = self.followed >= MOST_FOLLOWED && self.labels[portal.0 as usize] != Label::None;
        if leave {
            self.left_out = self.left_out.min(key);
        }
        leave
    }

    /// Sets the line to a sequence, from the start to the goal.
    fn take_line(&mut self, at: u32) {
        let Self { line, sequences, from, goal, .. } = self;
        Self::set_line(line, sequences, at, [*from, goal.at]);
    }

    fn set_line(line: &mut Line, sequences: &[Sequence], at: u32, [from, to]: [DVec3; 2]) {
        line.portals.clear();
        line.points.clear();
        line.points.push(to);
        let mut next = at;
        while let Some(sequence) = sequences.get(next as usize) {
            line.portals.push(sequence.portal.portal().0);
            line.points.push(sequence.at);
            next = sequence.parent;
        }
        line.points.push(from);
        line.portals.reverse();
        line.points.reverse();
    }

    /// Pulls the line as tight as can be, and tells what any line through its portals is at least.
    fn tighten(&mut self) -> Proof {
        let mut proof = Proof::NONE;
        for rounds in ROUNDS {
            self.line.pull(&self.facets, rounds);
            proof = proof.or(self.line.proof(&self.facets));
            let metres = self.line.metres();
            if metres - proof.metres <= EXACT + EXACT_SHARE * metres {
                return proof;
            }
            self.line.step(&self.facets);
        }
        proof.or(self.barrier.pull(&self.facets, &mut self.line))
    }

    /// Pulls the line of a sequence and bounds it; false: it can be given up.
    fn pull(&mut self, culler: &Culler, at: u32, is_there: bool) -> bool {
        self.take_line(at);
        let proof = if is_there {
            self.tighten()
        } else {
            self.line.pull(&self.facets, FEW);
            self.line.proof(&self.facets)
        };
        let portal = self.sequences[at as usize].portal;
        if self.is_beaten(portal, &proof) {
            return false;
        }
        let corners = self.facets.edges(portal.portal().index()).iter();
        let least = corners.map(|edge| proof.along.dot(edge.start - self.from)).fold(f64::INFINITY, f64::min);
        let remaining = self.ahead.remaining(culler, &self.facets, portal, &mut self.goal);
        let passed = self.line.points[self.line.points.len() - 2];
        let sequence = &mut self.sequences[at as usize];
        sequence.to_last = sequence.to_last.max(proof.constant + least);
        sequence.key = sequence.key.max(proof.metres).max(sequence.to_last + remaining);
        sequence.at = passed;
        (sequence.constant, sequence.along) = (proof.constant, proof.along);
        sequence.is_pulled = true;
        true
    }

    /// Whether a sequence that was followed leads to each point of a portal in no more metres than any line of the proof's sequence.
    fn is_beaten(&mut self, portal: DirectedPortal, proof: &Proof) -> bool {
        match self.labels[portal.0 as usize] {
            Label::None => return false,
            Label::Followed(sequence) => self.measure(portal, sequence),
            Label::Measured => {}
        }
        let by_proof = |p: DVec3| proof.constant + proof.along.dot(p - self.from);
        let corners = self.facets.edges(portal.portal().index()).iter();
        let known = &self.to_corners[portal.side()][self.facets.edge_range(portal.portal().index())];
        corners.zip(known).all(|(edge, metres)| *metres <= by_proof(edge.start))
    }

    /// Measures a sequence's lengths to the corners of its last portal.
    fn measure(&mut self, portal: DirectedPortal, sequence: u32) {
        let parent = self.sequences[sequence as usize].parent;
        for edge in self.facets.edge_range(portal.portal().index()) {
            let corner = self.facets.corner(edge);
            Self::set_line(&mut self.other, &self.sequences, parent, [self.from, corner]);
            self.other.pull(&self.facets, FEW);
            self.to_corners[portal.side()][edge] = self.other.metres();
        }
        self.labels[portal.0 as usize] = Label::Measured;
    }

    /// Follows a sequence through its last portal.
    fn follow(&mut self, culler: &Culler, doors: &Doors, at: u32, starts: &[CellId]) {
        self.followed += 1;
        let portal = self.sequences[at as usize].portal;
        if self.labels[portal.0 as usize] == Label::None {
            self.labels[portal.0 as usize] = Label::Followed(at);
            self.labelled.push(portal);
        }
        self.offer(culler, doors, at, target(culler, portal), starts);
    }

    /// Writes down the line, which is that of a sequence. Gives what any way takes at least.
    fn finish(&mut self, at: u32, key: f64) -> f64 {
        self.metres = self.line.metres();
        self.passed.clear();
        let mut next = at;
        while let Some(sequence) = self.sequences.get(next as usize) {
            self.passed.push(sequence.portal);
            next = sequence.parent;
        }
        self.passed.reverse();
        self.points.clear();
        self.points.extend(self.line.points.iter().map(|p| p.as_vec3()));
        key.min(self.left_out).min(self.metres)
    }
}
