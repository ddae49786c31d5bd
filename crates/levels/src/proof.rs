//! Why a pair is in the rows or not: the line, or the chains of portals and the proof that ends each.

use super::lines::{Walk, Walker};
use super::{Level, Line, Vis, VisError, VisOptions, check, net};
use enfilade::math::geom::Plane;
use enfilade::pvs::flow::exact::{Answer, Term, passes};
use enfilade::pvs::flow::goals::{CellGoals, Prover, Settled};
use enfilade::pvs::flow::might_see::{MightSee, set};
use enfilade::pvs::flow::net::Net;
use enfilade::pvs::flow::search::{End, Search};
use glam::DVec3;
use std::collections::BTreeMap;
use std::sync::Mutex;

/// The reason why a pair is in the rows or not.
#[derive(Clone, PartialEq, Debug)]
pub enum PairProof {
    /// They see each other: a line from one to the other. For neighbours it is a point of their portal; for a cell and itself it
    /// has no portals.
    Witnessed(Line),
    /// No line passes: each chain of portals from the first cell to the second ends in one of these. Empty: the planes of the
    /// portals alone leave no chain.
    Separated(Vec<ChainProof>),
    /// Undecided: a chain of portals (`2 * portal + side`) that may let a line through. Empty if the search ran out of steps.
    Undecided(Vec<u32>),
}

/// The proof that no line reaches the goal beyond a chain of portals.
#[derive(Clone, PartialEq, Debug)]
pub struct ChainProof {
    /// Portals, as `2 * portal + side`, from the first cell on.
    pub chain: Vec<u32>,
    /// All points that lines through the chain reach beyond it are inside these planes, and no path through portals inside them
    /// leads to the goal. Empty: no line passes the chain at all.
    pub planes: Vec<Plane>,
    /// If an exact test proved that no line passes the chain: sums, one for each part of the lines; the parts differ by the side
    /// on which lines pass edges that belong to no winding. Each sum is zero for every line, but a line of its part that passes
    /// the chain would make every term positive. Corners are rounded within the rounding of the file.
    pub sums: Vec<Vec<Term>>,
}

/// Why cells `a` and `b` are in the rows of `vis`, or not. Proofs of separation are searched again, from `a` and if necessary
/// from `b`; chains start at the cell from which they were found.
///
/// # Errors
///
/// [`VisError::NoSuchCell`], for a portal of the level or, with the number of portals, for `a` or `b`.
pub fn why(level: &Level, options: &VisOptions, vis: &Vis, a: u32, b: u32) -> Result<PairProof, VisError> {
    check(level)?;
    if let Some(&cell) = [a, b].iter().find(|&&c| c as usize >= level.cells) {
        return Err(VisError::NoSuchCell { portal: level.portals.len(), cell, cells: level.cells });
    }
    let net = net(level);
    if let Some(line) = witness(level, &net, vis, a, b) {
        return Ok(PairProof::Witnessed(line));
    }
    let might_see = MightSee::new(&net);
    let from_a = search(level, &net, &might_see, options, a, b);
    Ok(match from_a {
        PairProof::Undecided(_) => match search(level, &net, &might_see, options, b, a) {
            PairProof::Undecided(_) => from_a,
            from_b => from_b,
        },
        _ => from_a,
    })
}

/// The line of `vis` that joins two cells, cut to them.
fn witness(level: &Level, net: &Net, vis: &Vis, a: u32, b: u32) -> Option<Line> {
    let at = |portal: u32| enfilade::math::geom::middle(&level.portals[portal as usize].winding);
    let line = |p: DVec3, portals| Line { cells: [a, b], from: p, to: p, portals };
    if a == b {
        return Some(line(net.out(a as usize).next().map_or(DVec3::ZERO, |p| at(net.ids[p] / 2)), Vec::new()));
    }
    if let Some(p) = net.out(a as usize).find(|&p| net.target[p] == b) {
        return Some(line(at(net.ids[p] / 2), vec![net.ids[p]]));
    }
    vis.lines.iter().find_map(|line| line.between(level, a, b))
}

impl Line {
    /// Its direction, of length 1. Where it is a point of a portal, that goes straight through the portal.
    pub fn direction(&self, level: &Level) -> DVec3 {
        let across =
            || self.portals.first().and_then(|&portal| enfilade::math::geom::newell(&level.winding(portal)).try_normalize());
        let along = (self.to - self.from).try_normalize();
        along.or_else(across).unwrap_or(DVec3::X)
    }

    /// The cells along the line, in order.
    pub fn cells_along(&self, level: &Level) -> Vec<u32> {
        let target = |&d: &u32| level.portals[d as usize / 2].cells[1 - d as usize % 2];
        [self.cells[0]].into_iter().chain(self.portals.iter().map(target)).collect()
    }

    /// The part of the line from cell `a` to cell `b`, if it passes both.
    pub fn between(&self, level: &Level, a: u32, b: u32) -> Option<Self> {
        let cells = self.cells_along(level);
        let place = |c: u32| cells.iter().position(|&d| d == c);
        let (i, k) = (place(a)?, place(b)?);
        if i == k {
            return None;
        }
        let hit = |portal: u32| {
            let winding = &level.portals[portal as usize / 2].winding;
            let middle = enfilade::math::geom::middle(winding);
            let n = enfilade::math::geom::newell(&winding.iter().map(|&p| p - middle).collect::<Vec<_>>());
            let d = self.to - self.from;
            let t = n.dot(middle - self.from) / n.dot(d);
            if t.is_finite() { self.from + d * t } else { self.from }
        };
        let mut portals = self.portals[i.min(k)..i.max(k)].to_vec();
        if i > k {
            portals.reverse();
            portals.iter_mut().for_each(|p| *p ^= 1);
        }
        let (mut from, mut to) = (hit(portals[0]), hit(portals[portals.len() - 1]));
        if portals.len() > 1 && !portals.iter().all(|&p| passes(&[from, to], &level.winding(p))) {
            (from, to) = if i < k { (self.from, self.to) } else { (self.to, self.from) };
        }
        Some(Self { cells: [a, b], from, to, portals })
    }
}

/// Searches for `goal` from `cell`.
fn search(level: &Level, net: &Net, might_see: &MightSee, options: &VisOptions, cell: u32, goal: u32) -> PairProof {
    let walker = Recorder { walker: Walker::new(level, net, options.seed), open: Mutex::default(), sums: Mutex::default() };
    let mut wanted = vec![0; net.cells.div_ceil(64)];
    set(&mut wanted, goal as usize);
    let mut goals = CellGoals::new(net, &walker, wanted);
    let mut search = Search::new(net, might_see, options.steps);
    search.ends = Some(Vec::new());
    let ids = |chain: &[u32]| chain.iter().map(|&p| net.ids[p as usize]).collect::<Vec<u32>>();
    for portal in net.out(cell as usize) {
        if search.run(portal, &mut goals).capped {
            return PairProof::Undecided(Vec::new());
        }
    }
    if goals.doubtful().next().is_some() {
        let open = walker.open.into_inner().unwrap_or_default();
        return PairProof::Undecided(ids(&open));
    }
    if let Some(walk) = goals.into_proofs().first() {
        // Only if the rows were made with other lines.
        let line = walker.walker.line(walk);
        return PairProof::Witnessed(line);
    }
    let moved = |p: Plane| Plane { n: p.n, d: p.d + p.n.dot(net.origin) };
    let mut sums = walker.sums.into_inner().unwrap_or_default();
    let separation = |end: End| ChainProof {
        chain: ids(&end.chain),
        planes: end.planes.into_iter().map(moved).collect(),
        sums: sums.remove(&end.chain).unwrap_or_default(),
    };
    PairProof::Separated(search.ends.take().unwrap_or_default().into_iter().map(separation).collect())
}

/// Keeps the results of exact tests.
struct Recorder<'n> {
    walker: Walker<'n>,
    /// The last chain that stayed open.
    open: Mutex<Vec<u32>>,
    /// Sums that refute chains.
    sums: Mutex<BTreeMap<Vec<u32>, Vec<Vec<Term>>>>,
}

impl Prover for Recorder<'_> {
    type Proof = Walk;

    fn prove(&self, chain: &[u32], line: [DVec3; 2], cells: &mut Vec<u32>) -> Option<Walk> {
        self.walker.prove(chain, line, cells)
    }

    fn settle(&self, chain: &[u32], cells: &mut Vec<u32>) -> Option<Settled<Walk>> {
        match self.walker.ask(chain) {
            Answer::Open => chain.clone_into(&mut *self.open.lock().ok()?),
            Answer::Refuted(found) => _ = self.sums.lock().ok()?.insert(chain.to_vec(), found),
            Answer::Line(_) => {}
        }
        self.walker.settle(chain, cells)
    }
}
