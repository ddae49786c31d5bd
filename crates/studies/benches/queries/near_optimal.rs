//! Whoever asks only where the answer is worth more than it costs.
//!
//! Based on: Guthe, Balazs, Klein 2006. Deviations: how probable it is that something is hidden isn't taken from how much of the screen is covered,
//! but learnt from answers, as is how long that lasts.

use super::Culled;
use enfilade::ObjectId;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::view::{ALL_PLANES, Frustum, PlaneMask, Side};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// How fast shares are learnt: each answer counts so much.
const LEARNING: f64 = 1.0 / 256.0;

/// In seconds.
#[derive(Clone, Copy)]
pub struct Costs {
    pub query: f64,
    pub triangle: f64,
}

#[derive(Clone, Copy, Default)]
struct State {
    is_visible: bool,
    visited: u64,
    /// Frames in which it was drawn since it was asked about.
    unasked: u32,
}

pub struct NearOptimal {
    costs: Costs,
    frame: u64,
    states: Vec<State>,
    /// Of nodes that come into the frustum, the share that is hidden.
    new_hidden: f64,
    /// Of leaves that showed, the share that is hidden a frame later; and the other way round.
    hides: f64,
    appears: f64,
}

struct Turn<'t, O> {
    tree: &'t Hierarchy,
    frustum: &'t Frustum,
    oracle: &'t mut O,
    waiting: BinaryHeap<(Reverse<u64>, Reverse<u32>, PlaneMask)>,
    drawn: Vec<ObjectId>,
    queries: u64,
}

impl NearOptimal {
    pub fn new(costs: Costs) -> Self {
        Self { costs, frame: 0, states: Vec::new(), new_hidden: 0.5, hides: 0.05, appears: 0.05 }
    }

    pub fn cull<O: OcclusionOracle>(&mut self, tree: &Hierarchy, frustum: &Frustum, oracle: &mut O) -> Culled {
        self.frame += 1;
        self.states.resize(tree.nodes().len(), State::default());
        let mut turn = Turn { tree, frustum, oracle, waiting: BinaryHeap::new(), drawn: Vec::new(), queries: 0 };
        turn.put(0, ALL_PLANES);
        while let Some((_, Reverse(node), mask)) = turn.waiting.pop() {
            if self.shows(node, &mut turn) {
                turn.go_on(node, mask);
            }
        }
        self.pull_up(tree);
        (turn.drawn, turn.queries)
    }

    /// Whether a node is gone on with.
    fn shows(&mut self, number: u32, turn: &mut Turn<'_, impl OcclusionOracle>) -> bool {
        let node = &turn.tree.nodes()[number as usize];
        let state = &mut self.states[number as usize];
        let (was_visited, was_visible) = (state.visited + 1 == self.frame, state.is_visible);
        state.visited = self.frame;
        state.is_visible = true;
        if turn.frustum.meets_near(&node.bounds) {
            return true;
        }
        state.unasked = if was_visited && was_visible { state.unasked + 1 } else { 0 };
        let draws = self.costs.triangle * node.triangles as f64;
        // The frames for which an answer is good.
        let lasts = 1.0 / self.appears;
        let hides = 1.0 - (1.0 - self.hides).powf(f64::from(state.unasked));
        let is_asked = match (was_visited, was_visible) {
            (true, false) => true,
            (true, true) => node.is_leaf() && hides * draws * lasts > self.costs.query,
            (false, _) => self.new_hidden * draws > self.costs.query,
        };
        if !is_asked {
            return true;
        }
        let query = turn.oracle.issue(std::slice::from_ref(&node.bounds));
        turn.queries += 1;
        let shows = turn.oracle.poll(query).expect("an answer at once");
        let learn = |share: &mut f64, is: bool| *share += LEARNING * (f64::from(u8::from(is)) - *share);
        match (was_visited, was_visible) {
            (true, false) => learn(&mut self.appears, shows),
            (true, true) => learn(&mut self.hides, !shows),
            (false, _) => learn(&mut self.new_hidden, !shows),
        }
        let state = &mut self.states[number as usize];
        (state.is_visible, state.unasked) = (shows, 0);
        shows
    }

    /// What has nothing visible below it is asked about as a whole in the next frame.
    fn pull_up(&mut self, tree: &Hierarchy) {
        for number in (0..tree.nodes().len()).rev() {
            let node = &tree.nodes()[number];
            if self.states[number].visited == self.frame && !node.is_leaf() && self.states[number].is_visible {
                let shows = |child: u32| {
                    let child = self.states[child as usize];
                    child.visited == self.frame && child.is_visible
                };
                self.states[number].is_visible = node.children().any(shows);
            }
        }
    }
}

impl<O: OcclusionOracle> Turn<'_, O> {
    fn put(&mut self, node: u32, mask: PlaneMask) {
        let bounds = &self.tree.nodes()[node as usize].bounds;
        if let Side::Crosses(mask) = self.frustum.side(bounds, mask, 0, &mut 0) {
            // Distances are not negative: their bits are in their order.
            self.waiting.push((Reverse(bounds.distance(self.frustum.eye()).to_bits()), Reverse(node), mask));
        }
    }

    fn go_on(&mut self, node: u32, mask: PlaneMask) {
        if self.tree.nodes()[node as usize].is_leaf() {
            for &object in self.tree.objects(node) {
                self.oracle.draw(object);
                self.drawn.push(object);
            }
        } else {
            self.tree.nodes()[node as usize].children().for_each(|child| self.put(child, mask));
        }
    }
}
