//! Portal flow: every chain of portals that a line from one source portal may cross, as far as goals lie along it.
//!
//! Based on: Teller, *Visibility computations in densely occluded polyhedral environments*, 1992; the recursion over source,
//! pass and target portals of level compilers after Carmack, 1996. Deviates: goals that the planes of (source, pass) cut off
//! are dropped from the branch, and a branch without goals ends (goal culling: four to ten times fewer steps on game levels);
//! so are goals that no way through portals leads to inside those planes, which a flood tells at each step (three times
//! fewer again, because most goals that lie in view lie behind a wall); the source is cut by every window of the chain and
//! not only by the last one (1.4 to 2.7 times fewer), through edges that are a portal's own and not made by a cut, because the
//! others tell nothing new; the stack is explicit, because a chain may be thousands of portals long; and cells needn't be
//! convex. A line may cross one cell several times, but a chain that comes back into one of its cells needn't be followed:
//! without the loop it is a chain too, it asks less of a line, and it leads to the same places.

use super::bundle::{Bundle, Side};
use super::goals::{Goals, Inside};
use super::might_see::{MightSee, get, set};
use super::net::Net;
use super::separators::{Cut, Separators, Way};
use super::stab::{Passage, Question, Stab};
use super::window::Window;
use crate::geom::Plane;
use glam::DVec3;

/// Frames whose planes a portal is clipped by: the last one's alone let through windows that the one before had cut. Larger:
/// slower by a few per cent, and hardly any chain more is cut.
const ANCESTORS: usize = 4;

/// Windows of a chain that cut the source: so many of the last ones, and as many of all others. Fewer: searches of long chains follow more
/// of them. More: a step takes as long as its chain is.
const NEAR: usize = 32;

/// Goals and portals that a step may look at for nothing; so many more count as one step. More: where there are tens of thousands, a step
/// takes as long as hundreds elsewhere. Fewer: buildings of a thousand rooms get fewer steps than they are promised.
const LOOKS: usize = 4096;
const LOOKS_A_STEP: usize = 64;

/// Up to so many goals, what leads to none of them is left out of the way. Larger: it takes longer than it saves.
const FEW: usize = 32;

/// How a search went.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Outcome {
    /// Steps taken.
    pub steps: u64,
    /// It ran out of steps: what is still wanted stays undecided.
    pub capped: bool,
}

/// Where a search ended, for those who want to know why.
#[derive(Clone, PartialEq, Debug)]
pub struct End {
    /// Directed portals of the chain, from the source on.
    pub chain: Vec<u32>,
    /// Everything that lines through the chain meet beyond it is inside these, and no goal can be reached inside them. Empty:
    /// no line passes the chain.
    pub planes: Vec<Plane>,
}

/// What so many looks count on top of a step.
fn more(looks: usize) -> u64 {
    (looks.saturating_sub(LOOKS) / LOOKS_A_STEP) as u64
}

/// A chain of portals, as it stands when it has entered a cell.
#[derive(Default)]
struct Frame {
    /// What is left of the source portal.
    source: Window,
    /// What is left of the portal that led in here.
    pass: Window,
    /// Everything that lines through both can meet from here on is inside these: first the half-spaces that the two portals
    /// lead into, then separating planes.
    planes: Vec<Plane>,
    separators: usize,
    /// The separating planes once more, for boxes.
    bundle: Bundle,
    /// Where the goals of this frame begin and end in the list of all frames: portals that lead into a cell that wants
    /// something and that no plane has cut off.
    goals: [usize; 2],
    /// Portals that can be reached inside the planes, as bits. None that the chain has crossed is among them.
    live: Vec<u64>,
    /// The next portal to try and the end of the cell's portals.
    next: usize,
    end: usize,
}

/// A search, to be compiled for the vector units that the machine turns out to have: the same operations in the same order,
/// so the same bits on every machine.
struct Run<'s, 'a, G> {
    search: &'s mut Search<'a>,
    first: usize,
    goals: &'s mut G,
}

impl<G: Goals> pulp::WithSimd for Run<'_, '_, G> {
    type Output = Outcome;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _simd: S) -> Outcome {
        self.search.follow(self.first, self.goals)
    }
}

/// Scratch memory of searches over one net.
pub struct Search<'a> {
    net: &'a Net,
    might_see: &'a MightSee,
    max_steps: u64,
    /// Where searches ended, if that is to be kept.
    pub ends: Option<Vec<End>>,
    frames: Vec<Frame>,
    /// The portal through which each frame was entered.
    chain: Vec<u32>,
    goals: Vec<u32>,
    /// Cells of the chain, as bits.
    on_chain: Vec<u64>,
    waist: Window,
    stab: Stab,
    /// A line that passes the chain as it was, and how long it was.
    line: Option<([DVec3; 2], usize)>,
    spare: Window,
    separators: Separators,
    /// Portals that a flood has not asked yet, as bits.
    allowed: Vec<u64>,
    /// Portals that lead to a goal, as bits.
    leads: Vec<u64>,
    queue: Vec<u32>,
}

impl<'a> Search<'a> {
    /// A search that takes at most `max_steps` steps a source portal.
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

    /// Follows every line out through directed portal `first` that may lead to a goal.
    ///
    /// The cell that it leads out of counts as one of the chain: without the loop through `first`, what is seen is seen
    /// through another of the cell's portals. So nothing is refuted for `first` alone where chains lead back into its cell.
    pub fn run(&mut self, first: usize, goals: &mut impl Goals) -> Outcome {
        pulp::Arch::new().dispatch(Run { search: self, first, goals })
    }

    #[inline(always)]
    fn follow(&mut self, first: usize, goals: &mut impl Goals) -> Outcome {
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
            if !self.cross(depth, target) {
                self.end(target, None);
            } else if self.enter(depth, target, goals, &mut outcome.steps) {
                depth += 1;
                set(&mut self.on_chain, cell);
            }
        }
    }

    /// Sets up the frame behind the source portal. False where nothing is wanted beyond.
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
            self.goals.extend(crate::bits::ones(&[a & b]).map(|bit| (i * 64 + bit) as u32));
        }
        self.goals.retain(|&g| !goals.is_cut_off(net, net.target[g as usize] as usize, &inside));
        frame.goals = [0, self.goals.len()];
        !self.goals.is_empty()
    }

    /// True where `target` leads to a goal: itself, or one that may come after it. Lists those after the goals of the frame.
    #[inline(always)]
    fn wanted(&mut self, depth: usize, target: usize, goals: &impl Goals) -> bool {
        let (row, wanted) = (self.might_see.row(target), goals.portals());
        let [start, end] = self.frames[depth].goals;
        self.goals.truncate(end);
        let mut is_goal = false;
        for i in start..end {
            let goal = self.goals[i] as usize;
            if get(wanted, goal) {
                if get(row, goal) {
                    self.goals.push(goal as u32);
                }
                is_goal |= goal == target;
            }
        }
        is_goal || self.goals.len() > end
    }

    /// Tries to lead the lines of the frame at `depth` through `target`: fills the windows of the frame above.
    /// False where no line passes.
    #[inline(always)]
    fn cross(&mut self, depth: usize, target: usize) -> bool {
        if self.frames.len() == depth + 1 {
            self.frames.push(Frame::default());
        }
        self.clip_pass(depth, target) && self.clip_source(depth, target)
    }

    /// What is left of `target` inside the planes of the last frames.
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

    /// What is left of the source for lines that go on through what is left of `target`.
    #[inline(always)]
    fn clip_source(&mut self, depth: usize, target: usize) -> bool {
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
        // Lines from the target back through each window of the chain end in part of the source.
        self.waist.assign(&frame.pass);
        if !net.behind(entered, target).is_none_or(|plane| self.waist.cut(&plane, &net.slack, &mut self.spare)) {
            return false;
        }
        let mut cut = Cut { window: &mut child.source, passes: true, slack: &net.slack, spare: &mut self.spare };
        // Of a long chain the last windows, and as many of those before them.
        let (near, far) = (depth.saturating_sub(NEAR).max(1), depth.saturating_sub(NEAR).div_ceil(NEAR).max(1));
        let passes = below[near..depth].iter().rev().chain(below[1..near].iter().rev().step_by(far));
        let passes = std::iter::once(&self.waist).chain(passes.map(|frame| &frame.pass));
        for pass in passes {
            self.separators.through_second(&child.pass, pass, Way::Against, &mut cut);
            if !cut.passes {
                return false;
            }
        }
        true
    }

    /// Works out what the frame above `depth`, which has just crossed `target`, decides and may still reach. False where
    /// there is no such line or nothing beyond that is wanted.
    #[inline(always)]
    fn enter(&mut self, depth: usize, target: usize, goals: &mut impl Goals, steps: &mut u64) -> bool {
        let net = self.net;
        let cell = net.target[target] as usize;
        // What passed another portal than this one.
        self.line.take_if(|(_, length)| *length > depth + 1);
        self.spread(depth, target);
        let ends = [self.chain[0] as usize, target];
        if goals.would_decide(net, cell, &Inside { planes: &self.frames[depth + 1].planes, ends }) {
            self.chain.push(target as u32);
            let passage = self.stab(depth, goals, steps);
            self.chain.pop();
            if passage == Passage::Refuted {
                self.end(target, None);
                return false;
            }
            *steps += goals.arrive(net, cell, &Inside { planes: &self.frames[depth + 1].planes, ends }, passage);
        }
        if !self.cull(depth, target, goals, steps) {
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
    fn spread(&mut self, depth: usize, target: usize) {
        let net = self.net;
        let child = &mut self.frames[depth + 1];
        child.planes.clear();
        child.planes.extend(net.plane(self.chain[0] as usize).map(|p| p.flipped()));
        child.planes.extend(net.plane(target).map(|p| p.flipped()));
        child.separators = child.planes.len();
        self.separators.list(&child.source, &child.pass, Way::Along, &mut child.planes);
        child.bundle.assign(&child.planes[child.separators..]);
    }

    /// Goal culling: floods inside the planes of the frame above `depth`, and keeps the goals that are reached. False where
    /// none is left.
    #[inline(always)]
    #[expect(clippy::too_many_lines, reason = "the innermost loop, whose parts share borrows of the frames")]
    fn cull(&mut self, depth: usize, target: usize, goals: &impl Goals, steps: &mut u64) -> bool {
        let net = self.net;
        let start = self.frames[depth].goals[1];
        let wanted = goals.portals();
        let (below, above) = self.frames.split_at_mut(depth + 1);
        let (frame, child) = (&below[depth], &mut above[0]);
        // A long chain that doesn't branch: its next portal tells as much as a flood of all that may come.
        if depth >= NEAR && net.out(net.target[target] as usize).len() <= 2 {
            child.live.clear();
            child.live.extend(frame.live.iter().zip(self.might_see.row(target)).map(|(a, b)| a & b));
            child.goals = [start, self.goals.len()];
            return self.goals.len() > start;
        }
        // First the goals alone, because that often is the end of it.
        let mut kept = start;
        for i in start..self.goals.len() {
            let goal = self.goals[i] as usize;
            if get(wanted, goal) && !child.bundle.cuts_off(net.bounds(goal), net.window(goal)) {
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
            // What leads to none of the goals that are left is no part of the way to them.
            self.leads.clear();
            self.leads.resize(row.len(), 0);
            for &goal in &self.goals[start..] {
                set(&mut self.leads, goal as usize);
                for (a, b) in self.leads.iter_mut().zip(self.might_see.before(goal as usize)) {
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
                    if !child.bundle.cuts_off(net.bounds(p), net.window(p)) {
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

    /// Notes that the chain ends with `target`, because of the planes of a frame or as such.
    fn end(&mut self, target: usize, frame: Option<usize>) {
        if let Some(ends) = &mut self.ends {
            let chain = self.chain.iter().copied().chain([target as u32]).collect();
            ends.push(End { chain, planes: frame.map_or(Vec::new(), |f| self.frames[f].planes.clone()) });
        }
    }

    /// Asks whether a line passes the chain of which the frame above `depth` is the last.
    fn stab(&mut self, depth: usize, goals: &mut impl Goals, steps: &mut u64) -> Passage {
        let net = self.net;
        let top = &self.frames[depth + 1];
        // A line that passes the chain up to here may go on straight.
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
        match self.stab.ask(windows, &mut question, steps) {
            Passage::Unknown => goals.settle(chain, steps),
            Passage::Line(line) => {
                self.line = Some((line, depth + 2));
                Passage::Line(line)
            }
            Passage::Refuted => Passage::Refuted,
        }
    }
}
