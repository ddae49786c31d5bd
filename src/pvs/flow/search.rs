//! Portal flow: every chain of portals that a line from one source portal may cross, as far as goals lie along it.
//!
//! Based on: Teller, *Visibility computations in densely occluded polyhedral environments*, 1992; the recursion over source,
//! pass and target portals of level compilers after Carmack, 1996. Deviates: goals that the planes of (source, pass) cut off
//! are dropped from the branch, and a branch without goals ends (goal culling: four to ten times fewer steps on game levels);
//! the stack is explicit, because a chain may be thousands of portals long; and cells needn't be convex. A line may cross one
//! cell several times, but a chain that comes back into one of its cells needn't be followed: without the loop it is a chain
//! too, it asks less of a line, and it leads to the same places.

use super::goals::Goals;
use super::might_see::{MightSee, get, set};
use super::net::Net;
use super::separators::separators;
use super::stab::Stab;
use super::window::Window;
use crate::bits;
use crate::geom::Plane;
use glam::DVec3;

/// How a search went.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Outcome {
    /// Steps taken.
    pub steps: u64,
    /// It ran out of steps: what is still wanted stays undecided.
    pub capped: bool,
}

/// A chain of portals, as it stands when it has entered a cell.
#[derive(Default)]
struct Frame {
    /// What is left of the source portal.
    source: Window,
    /// What is left of the portal that led in here, and which it is.
    pass: Window,
    entered: usize,
    /// Everything that lines through both can meet from here on is inside these: first the half-spaces that the two portals
    /// lead into, then separating planes.
    planes: Vec<Plane>,
    separators: usize,
    /// Portals that may still be crossed, as bits. None that the chain has crossed is among them.
    live: Vec<u64>,
    /// Those of them that lead into a cell that wants something.
    goals: Vec<u64>,
    /// The next portal to try and the end of the cell's portals.
    next: usize,
    end: usize,
}

/// Scratch memory of searches over one net.
pub(super) struct Search<'a> {
    net: &'a Net,
    might_see: &'a MightSee,
    max_steps: u64,
    frames: Vec<Frame>,
    /// Cells of the chain, as bits.
    on_chain: Vec<u64>,
    waist: Window,
    stab: Stab,
    planes: Vec<Plane>,
    spare: Vec<DVec3>,
}

impl<'a> Search<'a> {
    /// A search that takes at most `max_steps` steps a source portal.
    pub fn new(net: &'a Net, might_see: &'a MightSee, max_steps: u64) -> Self {
        let (frames, on_chain, waist, stab, planes, spare) = Default::default();
        Self { net, might_see, max_steps, frames, on_chain, waist, stab, planes, spare }
    }

    /// Follows every line out through directed portal `first` that may lead to a goal.
    ///
    /// The cell that it leads out of counts as one of the chain: without the loop through `first`, what is seen is seen
    /// through another of the cell's portals. So nothing is refuted for `first` alone where chains lead back into its cell.
    pub fn run(&mut self, first: usize, goals: &mut impl Goals) -> Outcome {
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
                let cell = net.target[frame.entered] as usize;
                self.on_chain[cell / 64] &= !(1 << (cell % 64));
                depth -= 1;
                continue;
            }
            let target = frame.next;
            frame.next += 1;
            let cell = net.target[target] as usize;
            if !get(&frame.live, target) || get(&self.on_chain, cell) || !self.wanted(depth, target, goals) {
                continue;
            }
            outcome.steps += 1;
            if outcome.steps > self.max_steps {
                outcome.capped = true;
                return outcome;
            }
            if self.cross(depth, first, target) && self.stabs(depth, target, goals, &mut outcome.steps) {
                outcome.steps += goals.arrive(net, cell, &self.frames[depth + 1].planes);
                if self.aim(depth, target, goals) {
                    depth += 1;
                    set(&mut self.on_chain, cell);
                }
            }
        }
    }

    /// Sets up the frame behind the source portal. False where nothing is wanted beyond.
    fn start(&mut self, first: usize, goals: &mut impl Goals) -> bool {
        let net = self.net;
        if self.frames.is_empty() {
            self.frames.push(Frame::default());
        }
        let frame = &mut self.frames[0];
        frame.source.assign(net.corners(first), net.plane(first).is_some());
        frame.planes.clear();
        frame.planes.extend(net.plane(first).map(|p| p.flipped()));
        (frame.entered, frame.separators) = (first, frame.planes.len());
        goals.arrive(net, net.target[first] as usize, &frame.planes);
        frame.live.clear();
        frame.live.extend_from_slice(self.might_see.row(first));
        frame.goals.clear();
        frame.goals.extend(frame.live.iter().zip(goals.portals()).map(|(a, b)| a & b));
        let cell = net.out(net.target[first] as usize);
        (frame.next, frame.end) = (cell.start, cell.end);
        drop_cut_off(net, frame, goals)
    }

    /// True where `target` leads to a goal: itself, or one that may come after it.
    fn wanted(&self, depth: usize, target: usize, goals: &impl Goals) -> bool {
        let frame = &self.frames[depth];
        let (row, wanted) = (self.might_see.row(target), goals.portals());
        get(&frame.goals, target) && get(wanted, target)
            || frame.goals.iter().zip(row).zip(wanted).any(|((a, b), c)| a & b & c != 0)
    }

    /// Tries to lead the lines of the frame at `depth` through `target`: fills windows and planes of the frame above.
    /// False where no line passes.
    fn cross(&mut self, depth: usize, first: usize, target: usize) -> bool {
        let net = self.net;
        if self.frames.len() == depth + 1 {
            self.frames.push(Frame::default());
        }
        let (below, above) = self.frames.split_at_mut(depth + 1);
        let (frame, child) = (&below[depth], &mut above[0]);
        child.pass.assign(net.corners(target), net.plane(target).is_some());
        let fronts = [net.front(first, target), net.front(frame.entered, target)];
        let separators_below = &frame.planes[frame.separators..];
        if !fronts.iter().flatten().chain(separators_below).all(|plane| child.pass.cut(plane, &net.slack, &mut self.spare)) {
            return false;
        }
        child.source.assign(&frame.source.corners, frame.source.flat);
        if !net.behind(first, target).is_none_or(|plane| child.source.cut(&plane, &net.slack, &mut self.spare)) {
            return false;
        }
        if depth > 0 {
            // The same backwards: lines from the target through the last window end in part of the source.
            self.waist.assign(&frame.pass.corners, frame.pass.flat);
            if !net.behind(frame.entered, target).is_none_or(|plane| self.waist.cut(&plane, &net.slack, &mut self.spare)) {
                return false;
            }
            self.planes.clear();
            separators(&child.pass.corners, &self.waist.corners, &mut self.planes);
            if !self.planes.iter().all(|plane| child.source.cut(plane, &net.slack, &mut self.spare)) {
                return false;
            }
        }
        child.planes.clear();
        child.planes.extend(net.plane(first).map(|p| p.flipped()));
        child.planes.extend(net.plane(target).map(|p| p.flipped()));
        (child.entered, child.separators) = (target, child.planes.len());
        separators(&child.source.corners, &child.pass.corners, &mut child.planes);
        true
    }

    /// False where the line that has just crossed `target` would decide something, but is none.
    fn stabs(&mut self, depth: usize, target: usize, goals: &impl Goals, steps: &mut u64) -> bool {
        let net = self.net;
        let top = &self.frames[depth + 1];
        if !goals.would_decide(net, net.target[target] as usize, &top.planes) {
            return true;
        }
        let chain = std::iter::once(top.source.clone()).chain(self.frames[1..=depth + 1].iter().map(|f| f.pass.clone()));
        self.stab.may_pass(chain, &net.slack, steps)
    }

    /// Works out what the frame above `depth`, which has just crossed `target`, may still reach. False where that is nothing
    /// that is wanted.
    fn aim(&mut self, depth: usize, target: usize, goals: &impl Goals) -> bool {
        let net = self.net;
        let (below, above) = self.frames.split_at_mut(depth + 1);
        let (frame, child) = (&below[depth], &mut above[0]);
        let row = self.might_see.row(target);
        child.goals.clear();
        child.goals.extend(frame.goals.iter().zip(row).zip(goals.portals()).map(|((a, b), c)| a & b & c));
        if !drop_cut_off(net, child, goals) {
            return false;
        }
        child.live.clear();
        child.live.extend(frame.live.iter().zip(row).map(|(a, b)| a & b));
        let cell = net.out(net.target[target] as usize);
        (child.next, child.end) = (cell.start, cell.end);
        true
    }
}

/// Goal culling: drops the goals of a frame that its planes cut off. False where none is left.
fn drop_cut_off(net: &Net, frame: &mut Frame, goals: &impl Goals) -> bool {
    let mut any = false;
    for (i, word) in frame.goals.iter_mut().enumerate() {
        for bit in bits::ones(&[*word]) {
            let portal = i * 64 + bit;
            // Half-spaces of portals need no test here: might-see rows hold them.
            if frame.planes[frame.separators..].iter().any(|plane| net.is_cut_off(portal, plane))
                || goals.is_cut_off(net, net.target[portal] as usize, &frame.planes)
            {
                *word &= !(1 << bit);
            }
        }
        any |= *word != 0;
    }
    any
}
