//! Coherent hierarchical culling: nodes visible in the last frame are drawn at once, and hidden ones are queried meanwhile.
//!
//! Based on: Bittner, Wimmer, Piringer, Purgathofer, *Coherent hierarchical culling: hardware occlusion queries made useful*, 2004.
//! Deviation: the query for a visible leaf uses its box and not its triangles, because an oracle knows boxes only.
//!
//! If the oracle answers immediately, a visible leaf is queried before it is drawn, which saves a useless draw.
//!
//! Nothing appears late: a leaf is skipped only if an answer of this frame says that it, or a node above it, is hidden.

use super::hierarchy::Hierarchy;
use super::mask::Scope;
use super::oracle::OcclusionOracle;
use super::stats::OnlineStats;
use super::view::Frustum;
use super::walk::{AskingWalk, Open, Policy};
use crate::ObjectId;

/// The state of a node.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Whether it, or a leaf below it, was visible at its last visit.
    visible: bool,
    /// The frame of its last visit.
    visited: u64,
}

/// Culls a tree; keeps the state of one camera between frames.
#[derive(Clone, Debug, Default)]
pub struct Chc {
    memory: Memory,
    walk: AskingWalk,
}

/// State by node.
#[derive(Clone, Debug, Default)]
struct Memory {
    states: Vec<State>,
}

impl Chc {
    /// Draws a frame with an oracle that has just begun it. Returns the drawn objects: all objects of the tree that have a pixel. Allocates
    /// nothing after the first frame of a tree; use it for one tree only.
    pub fn cull(&mut self, tree: &Hierarchy, frustum: &Frustum, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        self.cull_of(&Scope { tree, frustum, mask: None }, oracle)
    }

    /// The same for a part of a tree.
    pub(crate) fn cull_of(&mut self, scope: &Scope<'_>, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        self.memory.states.resize(scope.tree.nodes().len(), State::default());
        self.walk.run(scope, &mut self.memory, oracle)
    }

    /// The objects drawn in the last frame.
    pub fn objects(&self) -> &[ObjectId] {
        self.walk.objects()
    }

    /// Counters of the last frame.
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
        *state = State { visible: false, visited: walk.frame() };
        if frustum.meets_near(&node.bounds) {
            self.pull_up(tree, open.node);
            walk.go_on(scope, open, oracle);
        } else if !was_visible {
            // The walk ended here in the last frame: hidden, or outside the frustum.
            walk.ask(tree, open, false, oracle);
        } else {
            // Leaves are queried; inner nodes are opened.
            let is_drawn_first = !node.is_leaf() || !oracle.answers_at_once();
            if node.is_leaf() {
                walk.ask(tree, open, is_drawn_first, oracle);
            }
            if is_drawn_first {
                walk.go_on(scope, open, oracle);
            }
        }
    }

    fn learn(&mut self, tree: &Hierarchy, node: u32, shows: bool) {
        if shows {
            self.pull_up(tree, node);
        }
    }
}

impl Memory {
    /// Marks a node and all its ancestors as visible.
    fn pull_up(&mut self, tree: &Hierarchy, node: u32) {
        let mut next = Some(node);
        while let Some(n) = next.filter(|&n| !self.states[n as usize].visible) {
            self.states[n as usize].visible = true;
            next = tree.nodes()[n as usize].parent;
        }
    }
}
