//! Portal flow: every chain of portals that a line from one source portal may cross, while it leads to goals.
//!
//! Based on: Teller, *Visibility computations in densely occluded polyhedral environments*, 1992; the recursion over source, pass and
//! target portals of level compilers after Carmack, 1996. Deviations: goals that the planes of (source, pass) cut off are dropped from the
//! branch, and a branch without goals ends (goal culling: four to ten times fewer steps on game levels). So are goals that a flood through
//! portals inside those planes does not reach (three times fewer again, because most goals in view are behind a wall). The source is
//! clipped by every window of the chain and not only by the last one (1.4 to 2.7 times fewer), through original edges of portals only,
//! because edges made by clipping give nothing new. The stack is explicit, because a chain may have thousands of portals. Cells need not be
//! convex. A line may cross one cell several times, but a chain that returns to one of its cells need not be followed: the chain without
//! the loop constrains a line less, and leads to the same places.

use super::bundle::{Bundle, Side};
use super::goals::{Goals, Inside};
use super::might_see::{MightSee, get, set};
use super::net::Net;
use super::separators::{Cut, Separators, Way};
use super::stab::{Passage, Question, Stab};
use super::window::Window;
use crate::math::geom::Plane;
use crate::math::simd::dispatch;
use glam::DVec3;
use pulp::Simd;

/// Frames whose planes clip a portal: the last one alone would pass windows that the previous one had cut. Larger: slower by a few per
/// cent, and hardly any further chain is cut.
const ANCESTORS: usize = 4;

/// Windows of a chain that clip the source: this many of the last ones, and as many of all others. Fewer: more long chains are followed.
/// More: the time of a step grows with the length of its chain.
const NEAR: usize = 8;

/// Portals after which a chain without branches is not flooded. Fewer: more goals that a flood would drop are carried along. More: the time
/// of a corridor of rooms grows with the square of its length.
const LONG: usize = 32;

/// Goals and portals that a step may visit; each further `LOOKS_A_STEP` count as one step. More: with tens of thousands, a step takes as
/// long as hundreds elsewhere. Fewer: buildings of a thousand rooms get fewer steps than specified.
const LOOKS: usize = 4096;
const LOOKS_A_STEP: usize = 64;

/// With at most this many goals, the flood skips portals that lead to none of them. Larger: it costs more than it saves.
const FEW: usize = 32;

/// The result of a search.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Outcome {
    /// Steps taken.
    pub steps: u64,
    /// Whether it ran out of steps: remaining goals stay undecided.
    pub capped: bool,
}

/// The end of a chain, as a proof.
#[derive(Clone, PartialEq, Debug)]
pub struct End {
    /// Directed portals of the chain, from the source.
    pub chain: Vec<u32>,
    /// All points that lines through the chain reach beyond it are inside these planes, and no goal is reachable inside them. Empty: no
    /// line passes the chain.
    pub planes: Vec<Plane>,
}

/// Extra steps for this many visits.
fn more(looks: usize) -> u64 {
    (looks.saturating_sub(LOOKS) / LOOKS_A_STEP) as u64
}

/// The state of a chain after it has entered a cell.
#[derive(Default)]
struct Frame {
    /// The rest of the source portal.
    source: Window,
    /// The rest of the last portal.
    pass: Window,
    /// All points that lines through both can reach from here are inside these planes: first the planes of the two portals, then separating
    /// planes.
    planes: Vec<Plane>,
    separators: usize,
    /// The separating planes again, for box tests.
    bundle: Bundle,
    /// Range of this frame's goals in the list of all frames: portals into cells with goals that no plane has cut off.
    goals: [usize; 2],
    /// Portals reachable inside the planes, as bits, without those of the chain.
    live: Vec<u64>,
    /// The next portal to try and the end of the cell's portals.
    next: usize,
    end: usize,
}

/// A search, compiled for several vector units and dispatched at run time: the same operations in the same order, so the same bits on every
/// machine.
struct Run<'s, 'a, G> {
    search: &'s mut Search<'a>,
    first: usize,
    goals: &'s mut G,
}

impl<G: Goals> pulp::WithSimd for Run<'_, '_, G> {
    type Output = Outcome;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Outcome {
        self.search.follow(simd, self.first, self.goals)
    }
}

/// Scratch memory of searches over one net.
pub struct Search<'a> {
    net: &'a Net,
    might_see: &'a MightSee,
    max_steps: u64,
    /// The ends of chains, if they are recorded.
    pub ends: Option<Vec<End>>,
    frames: Vec<Frame>,
    /// The portal through which each frame was entered.
    chain: Vec<u32>,
    goals: Vec<u32>,
    /// Cells of the chain, as bits.
    on_chain: Vec<u64>,
    waist: Window,
    stab: Stab,
    /// The last stabbing line, and the length of its chain.
    line: Option<([DVec3; 2], usize)>,
    spare: Window,
    separators: Separators,
    /// Portals that a flood has not tested yet, as bits.
    allowed: Vec<u64>,
    /// Portals that lead to a goal, as bits.
    leads: Vec<u64>,
    queue: Vec<u32>,
}

impl<'a> Search<'a> {
    /// A search with at most `max_steps` steps per source portal.
    pub fn new(net: &'a Net, might_see: &'a MightSee, max_steps: u64) -> Self {
        let (frames, chain, goals, on_chain, waist, stab, line, spare, allowed, leads, queue) = Default::default();
        let separators = Separators::new(net.rounding);
        Self {
            net,
            might_see,
            max_steps,
            ends: None,
            frames,
            chain,
            goals,
            on_chain,
            waist,
            stab,
            line,
            spare,
            separators,
            allowed,
            leads,
            queue,
        }
    }

    /// Follows all lines out through directed portal `first` that may lead to a goal.
    ///
    /// Its source cell counts as part of the chain: a target seen over a loop through the cell is seen through another of the cell's
    /// portals. So nothing is refuted for `first` alone if chains lead back into its cell.
    pub fn run(&mut self, first: usize, goals: &mut impl Goals) -> Outcome {
        dispatch(Run { search: self, first, goals })
    }

    #[inline(always)]
    fn follow<S: Simd>(&mut self, simd: S, first: usize, goals: &mut impl Goals) -> Outcome {
        let (net, home) = (self.net, self.net.source[first]);
        let mut outcome = Outcome { steps: 0, capped: false };
        if net.target[first] == home || !self.start(first, goals) {
            return outcome;
        }
        self.on_chain.clear();
        self.on_chain.resize(net.cells.div_ceil(64), 0);
        set(&mut self.on_chain, home as usize);
        set(&mut self.on_chain, net.target[first] as usize);
        let mut depth = 0;
        loop {
            let frame = &mut self.frames[depth];
            if frame.next == frame.end {
                if depth == 0 {
                    return outcome;
                }
                let cell = net.target[self.chain[depth] as usize] as usize;
                self.on_chain[cell / 64] &= !(1 << (cell % 64));
                self.chain.pop();
                depth -= 1;
                continue;
            }
            let target = frame.next;
            frame.next += 1;
            let cell = net.target[target] as usize;
            if get(&self.on_chain, cell) || !get(&self.frames[depth].live, target) || !self.wanted(depth, target, goals) {
                continue;
            }
            let [start, end] = self.frames[depth].goals;
            outcome.steps += 1 + more(end - start);
            if outcome.steps > self.max_steps {
                outcome.capped = true;
                return outcome;
            }
            if !self.cross(simd, depth, target) {
                self.end(target, None);
            } else if self.enter(simd, depth, target, goals, &mut outcome.steps) {
                depth += 1;
                set(&mut self.on_chain, cell);
            }
        }
    }

    /// Sets up the frame behind the source portal. False if there is no goal beyond.
    #[inline(always)]
    fn start(&mut self, first: usize, goals: &mut impl Goals) -> bool {
        let net = self.net;
        if self.frames.is_empty() {
            self.frames.push(Frame::default());
        }
        self.chain.clear();
        self.line = None;
        self.chain.push(first as u32);
        let frame = &mut self.frames[0];
        frame.source.assign(net.window(first));
        frame.planes.clear();
        frame.bundle.assign(&[]);
        frame.planes.extend(net.plane(first).map(|p| p.flipped()));
        frame.separators = frame.planes.len();
        let inside = Inside { planes: &frame.planes, ends: [first; 2] };
        goals.arrive(net, net.target[first] as usize, &inside, Passage::Unknown);
        let cell = net.out(net.target[first] as usize);
        (frame.next, frame.end) = (cell.start, cell.end);
        frame.live.clear();
        frame.live.extend_from_slice(self.might_see.row(first));
        self.goals.clear();
        for (i, (a, b)) in self.might_see.row(first).iter().zip(goals.portals()).enumerate() {
            self.goals.extend(crate::math::bits::ones(&[a & b]).map(|bit| (i * 64 + bit) as u32));
        }
        self.goals.retain(|&g| !goals.is_cut_off(net, net.target[g as usize] as usize, &inside));
        frame.goals = [0, self.goals.len()];
        !self.goals.is_empty()
    }

    /// True if `target` leads to a goal: itself, or a portal that may follow. Lists these after the goals of the frame.
    #[inline(always)]
    fn wanted(&mut self, depth: usize, target: usize, goals: &impl Goals) -> bool {
        let (row, wanted) = (self.might_see.row(target), goals.portals());
        let [start, end] = self.frames[depth].goals;
        self.goals.truncate(end);
        let mut is_goal = false;
        for i in start..end {
            let goal = self.goals[i] as usize;
            if get(wanted, goal) && goals.ways(self.net, goal).is_none_or(|ways| get(ways, target)) {
                if get(row, goal) {
                    self.goals.push(goal as u32);
                }
                is_goal |= goal == target;
            }
        }
        is_goal || self.goals.len() > end
    }

    /// Extends the chain of the frame at `depth` through `target`: fills the windows of the frame above. False if no line passes.
    #[inline(always)]
    fn cross<S: Simd>(&mut self, simd: S, depth: usize, target: usize) -> bool {
        if self.frames.len() == depth + 1 {
            self.frames.push(Frame::default());
        }
        self.clip_pass(depth, target) && self.clip_source(simd, depth, target)
    }

    /// Clips `target` to the planes of the last frames.
    #[inline(always)]
    fn clip_pass(&mut self, depth: usize, target: usize) -> bool {
        let net = self.net;
        let (first, entered) = (self.chain[0] as usize, self.chain[depth] as usize);
        let (below, above) = self.frames.split_at_mut(depth + 1);
        let pass = &mut above[0].pass;
        pass.assign(net.window(target));
        let fronts = [net.front(first, target), net.front(entered, target)];
        let (bounds, slack, spare) = (net.bounds(target), &net.slack, &mut self.spare);
        for plane in fronts.iter().flatten() {
            match bounds.side(plane) {
                Side::Inside => {}
                Side::Outside => return false,
                Side::Unknown => {
                    if !pass.cut(plane, slack, spare) {
                        return false;
                    }
                }
            }
        }
        for frame in below.iter().rev().take(ANCESTORS) {
            if !frame.bundle.cut(pass, bounds, slack, spare) {
                return false;
            }
        }
        true
    }

    /// Clips the source to lines that go on through the rest of `target`.
    #[inline(always)]
    fn clip_source<S: Simd>(&mut self, simd: S, depth: usize, target: usize) -> bool {
        let net = self.net;
        let (first, entered) = (self.chain[0] as usize, self.chain[depth] as usize);
        let (below, above) = self.frames.split_at_mut(depth + 1);
        let (frame, child) = (&below[depth], &mut above[0]);
        child.source.assign(&frame.source);
        if !net.behind(first, target).is_none_or(|plane| child.source.cut(&plane, &net.slack, &mut self.spare)) {
            return false;
        }
        if depth == 0 {
            return true;
        }
        // Lines from the target back through each window of the chain reach only part of the source.
        self.waist.assign(&frame.pass);
        if !net.behind(entered, target).is_none_or(|plane| self.waist.cut(&plane, &net.slack, &mut self.spare)) {
            return false;
        }
        let mut cut = Cut { window: &mut child.source, passes: true, slack: &net.slack, spare: &mut self.spare };
        // In a long chain, the last windows, and as many of the earlier ones.
        let (near, far) = (depth.saturating_sub(NEAR).max(1), depth.saturating_sub(NEAR).div_ceil(NEAR).max(1));
        let passes = below[near..depth].iter().rev().chain(below[1..near].iter().rev().step_by(far));
        let passes = std::iter::once(&self.waist).chain(passes.map(|frame| &frame.pass));
        for pass in passes {
            self.separators.through_second(simd, [&child.pass, pass], Way::Against, &mut cut);
            if !cut.passes {
                return false;
            }
        }
        true
    }

    /// Computes what the frame above `depth`, which has just crossed `target`, decides and may still reach. False if no line passes or no
    /// goal remains.
    #[inline(always)]
    fn enter<S: Simd>(&mut self, simd: S, depth: usize, target: usize, goals: &mut impl Goals, steps: &mut u64) -> bool {
        let net = self.net;
        let cell = net.target[target] as usize;
        // Drops a line of another branch.
        self.line.take_if(|(_, length)| *length > depth + 1);
        self.spread(simd, depth, target);
        let ends = [self.chain[0] as usize, target];
        if goals.would_decide(net, cell, &Inside { planes: &self.frames[depth + 1].planes, ends }) {
            self.chain.push(target as u32);
            let passage = self.stab(simd, depth, goals, steps);
            self.chain.pop();
            if passage == Passage::Refuted {
                self.end(target, None);
                return false;
            }
            *steps += goals.arrive(net, cell, &Inside { planes: &self.frames[depth + 1].planes, ends }, passage);
        }
        if !self.cull(simd, depth, target, goals, steps) {
            self.end(target, Some(depth + 1));
            return false;
        }
        let child = &mut self.frames[depth + 1];
        let out = net.out(cell);
        (child.next, child.end) = (out.start, out.end);
        self.chain.push(target as u32);
        true
    }

    /// The planes of the frame above `depth`.
    #[inline(always)]
    fn spread<S: Simd>(&mut self, simd: S, depth: usize, target: usize) {
        let net = self.net;
        let child = &mut self.frames[depth + 1];
        child.planes.clear();
        child.planes.extend(net.plane(self.chain[0] as usize).map(|p| p.flipped()));
        child.planes.extend(net.plane(target).map(|p| p.flipped()));
        child.separators = child.planes.len();
        self.separators.list(simd, [&child.source, &child.pass], Way::Along, &mut child.planes);
        child.bundle.assign(&child.planes[child.separators..]);
    }

    /// Goal culling: floods inside the planes of the frame above `depth`, and keeps the goals that are reached. False if none is left.
    #[inline(always)]
    #[expect(clippy::too_many_lines, reason = "the innermost loop, whose parts share borrows of the frames")]
    fn cull<S: Simd>(&mut self, simd: S, depth: usize, target: usize, goals: &impl Goals, steps: &mut u64) -> bool {
        let net = self.net;
        let start = self.frames[depth].goals[1];
        let wanted = goals.portals();
        let (below, above) = self.frames.split_at_mut(depth + 1);
        let (frame, child) = (&below[depth], &mut above[0]);
        // A long chain without branches: its next portal decides as well as a flood.
        if depth >= LONG && net.out(net.target[target] as usize).len() <= 2 {
            child.live.clear();
            child.live.extend(frame.live.iter().zip(self.might_see.row(target)).map(|(a, b)| a & b));
            child.goals = [start, self.goals.len()];
            return self.goals.len() > start;
        }
        // First the goals alone, because often none is left.
        let mut kept = start;
        for i in start..self.goals.len() {
            let goal = self.goals[i] as usize;
            if get(wanted, goal) && !child.bundle.cuts_off(simd, net.bounds(goal), net.window(goal)) {
                self.goals[kept] = goal as u32;
                kept += 1;
            }
        }
        self.goals.truncate(kept);
        if kept == start {
            return false;
        }
        self.allowed.clear();
        let row = self.might_see.row(target);
        for (a, b) in frame.live.iter().zip(row) {
            self.allowed.push(a & b);
        }
        if kept - start <= FEW {
            // Portals that lead to none of the remaining goals are skipped.
            self.leads.clear();
            self.leads.resize(row.len(), 0);
            for &goal in &self.goals[start..] {
                set(&mut self.leads, goal as usize);
                let ways = goals.ways(net, goal as usize).unwrap_or_else(|| self.might_see.before(goal as usize));
                for (a, b) in self.leads.iter_mut().zip(ways) {
                    *a |= b;
                }
            }
            for (a, b) in self.allowed.iter_mut().zip(&self.leads) {
                *a &= b;
            }
        }
        child.live.clear();
        child.live.resize(frame.live.len(), 0);
        let mut looks = 0;
        self.queue.push(target as u32);
        while let Some(last) = self.queue.pop() {
            for &(word, mask) in net.next(last as usize) {
                let word = word as usize;
                let mut ways = self.allowed[word] & mask;
                self.allowed[word] &= !mask; // once is enough
                while ways != 0 {
                    let p = word * 64 + ways.trailing_zeros() as usize;
                    ways &= ways - 1;
                    looks += 1;
                    if !child.bundle.cuts_off(simd, net.bounds(p), net.window(p)) {
                        set(&mut child.live, p);
                        self.queue.push(p as u32);
                    }
                }
            }
        }
        *steps += more(looks);
        kept = start;
        let inside = Inside { planes: &child.planes, ends: [self.chain[0] as usize, target] };
        for i in start..self.goals.len() {
            let goal = self.goals[i] as usize;
            if get(&child.live, goal) && !goals.is_cut_off(net, net.target[goal] as usize, &inside) {
                self.goals[kept] = goal as u32;
                kept += 1;
            }
        }
        self.goals.truncate(kept);
        child.goals = [start, kept];
        kept > start
    }

    /// Records that the chain ends with `target`, because of the planes of a frame or because no line passes.
    fn end(&mut self, target: usize, frame: Option<usize>) {
        if let Some(ends) = &mut self.ends {
            let chain = self.chain.iter().copied().chain([target as u32]).collect();
            ends.push(End { chain, planes: frame.map_or(Vec::new(), |f| self.frames[f].planes.clone()) });
        }
    }

    /// Tests whether a line passes the chain up to the frame above `depth`.
    #[inline(always)]
    fn stab<S: Simd>(&mut self, simd: S, depth: usize, goals: &mut impl Goals, steps: &mut u64) -> Passage {
        let net = self.net;
        let top = &self.frames[depth + 1];
        // The last stabbing line may also pass the new portal.
        if let Some((line, length)) = self.line {
            let on = self.frames[length..=depth + 1].iter().try_fold(line[1], |_, f| f.pass.met_by(line));
            if let Some(on) = on.filter(|&on| goals.accepts(&self.chain, [line[0], on])) {
                self.line = Some(([line[0], on], depth + 2));
                return Passage::Line([line[0], on]);
            }
        }
        let windows = std::iter::once(top.source.clone()).chain(self.frames[1..=depth + 1].iter().map(|f| f.pass.clone()));
        let chain = &self.chain;
        let mut question =
            Question { slack: &net.slack, separators: &mut self.separators, accept: &mut |line| goals.accepts(chain, line) };
        match self.stab.ask(simd, windows, &mut question, steps) {
            Passage::Unknown => goals.settle(chain, steps),
            Passage::Line(line) => {
                self.line = Some((line, depth + 2));
                Passage::Line(line)
            }
            Passage::Refuted => Passage::Refuted,
        }
    }
}
