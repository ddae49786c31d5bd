//! Ways to ask less in CHC: of the leaves that showed in the last frame, some aren't asked about again.
//!
//! Based on: Ivson 2006, chapter 6.5, who compares three. What is not left out is asked about as in [`enfilade::occlusion::chc`].

use enfilade::ObjectId;
use enfilade::math::random::Prng;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::occlusion::mask::Scope;
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::stats::OnlineStats;
use enfilade::occlusion::view::Frustum;
use enfilade::occlusion::walk::{AskingWalk, Open, Policy};

/// Of the leaves that showed in the last frame, which are asked about again. One that isn't counts as still in sight: less is asked, more is
/// drawn.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Reduction {
    /// All: CHC itself.
    None,
    /// Each in every `n`th frame that it shows in; 0 and 1 are all. Leaves that came into sight together are asked about together.
    EveryNth(u32),
    /// Each with this probability, 0 to 1.
    AtRandom(f64),
    /// All but the `n` nearest.
    NotNearest(u32),
}

/// What is known of a node.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Whether it, or a leaf below it, showed when it was last visited.
    visible: bool,
    /// The last frame that came to it.
    visited: u64,
    /// Frames since it was asked about.
    unasked: u32,
}

/// Culls a tree; keeps what one camera needs from frame to frame.
#[derive(Clone, Debug)]
pub struct ReducedChc {
    memory: Memory,
    walk: AskingWalk,
}

#[derive(Clone, Debug)]
struct Memory {
    reduction: Reduction,
    random: Prng,
    states: Vec<State>,
    /// Leaves of this frame that showed in the last.
    nearest: u32,
}

impl ReducedChc {
    /// `seed` decides the random choices.
    pub fn new(reduction: Reduction, seed: u64) -> Self {
        let memory = Memory { reduction, random: Prng::new(seed, 0), states: Vec::new(), nearest: 0 };
        Self { memory, walk: AskingWalk::default() }
    }

    /// Draws a frame with an oracle that has just begun one. Returns what was drawn: every object of the tree that has a pixel. Allocates
    /// nothing after the first frame of a tree; to be used for one tree only.
    pub fn cull(&mut self, tree: &Hierarchy, frustum: &Frustum, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        self.memory.states.resize(tree.nodes().len(), State::default());
        self.memory.nearest = 0;
        self.walk.run(&Scope { tree, frustum, mask: None }, &mut self.memory, oracle)
    }

    /// Of the last frame.
    pub fn stats(&self) -> OnlineStats {
        self.walk.stats()
    }
}

impl Policy for Memory {
    fn visit(&mut self, scope: &Scope<'_>, open: Open, walk: &mut AskingWalk, oracle: &mut impl OcclusionOracle) {
        let Scope { tree, frustum, .. } = *scope;
        let node = &tree.nodes()[open.node as usize];
        let state = &mut self.states[open.node as usize];
        let was_visible = state.visible && state.visited + 1 == walk.frame();
        (state.visible, state.visited) = (false, walk.frame());
        if frustum.meets_near(&node.bounds) {
            self.pull_up(tree, open.node);
            walk.go_on(scope, open, oracle);
        } else if !was_visible {
            // It ended the walk before: hidden, or out of the frustum.
            state.unasked = 0;
            walk.ask(tree, open, false, oracle);
        } else {
            if node.is_leaf() {
                if self.is_asked(open.node) {
                    self.states[open.node as usize].unasked = 0;
                    let is_drawn_first = !oracle.answers_at_once();
                    walk.ask(tree, open, is_drawn_first, oracle);
                    if !is_drawn_first {
                        return;
                    }
                } else {
                    self.pull_up(tree, open.node);
                }
            }
            // Other nodes are opened: their leaves say whether they show.
            walk.go_on(scope, open, oracle);
        }
    }

    fn learn(&mut self, tree: &Hierarchy, node: u32, shows: bool) {
        if shows {
            self.pull_up(tree, node);
        }
    }
}

impl Memory {
    /// Whether a leaf that showed is asked about.
    fn is_asked(&mut self, node: u32) -> bool {
        let state = &mut self.states[node as usize];
        state.unasked += 1;
        self.nearest += 1;
        match self.reduction {
            Reduction::None => true,
            Reduction::EveryNth(n) => state.unasked >= n,
            Reduction::AtRandom(probability) => self.random.unit() < probability,
            Reduction::NotNearest(n) => self.nearest > n,
        }
    }

    /// A node shows, and so do all above it.
    fn pull_up(&mut self, tree: &Hierarchy, node: u32) {
        let mut next = Some(node);
        while let Some(n) = next.filter(|&n| !self.states[n as usize].visible) {
            self.states[n as usize].visible = true;
            next = tree.nodes()[n as usize].parent;
        }
    }
}
