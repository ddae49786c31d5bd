//! Coherent hierarchical culling: what showed in the last frame is drawn at once, what was hidden is asked about while that goes on.
//!
//! Based on: Bittner, Wimmer, Piringer, Purgathofer, *Coherent hierarchical culling: hardware occlusion queries made useful*, 2004. Deviation:
//! of a leaf that showed, the box is asked about and not its triangles, since an oracle knows boxes only.
//!
//! An oracle that answers at once is asked about a leaf that showed before the leaf is drawn: so it isn't drawn once more in vain.
//!
//! Nothing shows late: a leaf isn't drawn only where an answer of this very frame says that it, or a node above it, is hidden.

use super::hierarchy::Hierarchy;
use super::mask::Scope;
use super::oracle::OcclusionOracle;
use super::stats::OnlineStats;
use super::view::Frustum;
use super::walk::{AskingWalk, Open, Policy};
use crate::ObjectId;

/// What is known of a node.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Whether it, or a leaf below it, showed when it was last visited.
    visible: bool,
    /// The last frame that came to it.
    visited: u64,
}

/// Culls a tree; keeps what one camera needs from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct Chc {
    memory: Memory,
    walk: AskingWalk,
}

/// By node.
#[derive(Clone, Debug, Default)]
struct Memory {
    states: Vec<State>,
}

impl Chc {
    /// Draws a frame with an oracle that has just begun one. Returns what was drawn: every object of the tree that has a pixel. Allocates
    /// nothing after the first frame of a tree; to be used for one tree only.
    pub fn cull(&mut self, tree: &Hierarchy, frustum: &Frustum, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        self.cull_of(&Scope { tree, frustum, mask: None }, oracle)
    }

    /// The same, of a part of a tree.
    pub fn cull_of(&mut self, scope: &Scope<'_>, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        self.memory.states.resize(scope.tree.nodes().len(), State::default());
        self.walk.run(scope, &mut self.memory, oracle)
    }

    /// What the last frame drew.
    pub fn objects(&self) -> &[ObjectId] {
        self.walk.objects()
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
        *state = State { visible: false, visited: walk.frame() };
        if frustum.meets_near(&node.bounds) {
            self.pull_up(tree, open.node);
            walk.go_on(scope, open, oracle);
        } else if !was_visible {
            // It ended the walk before: hidden, or out of the frustum.
            walk.ask(tree, open, false, oracle);
        } else {
            // Leaves are asked whether they show; other nodes are opened.
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
    /// A node shows, and so do all above it.
    fn pull_up(&mut self, tree: &Hierarchy, node: u32) {
        let mut next = Some(node);
        while let Some(n) = next.filter(|&n| !self.states[n as usize].visible) {
            self.states[n as usize].visible = true;
            next = tree.nodes()[n as usize].parent;
        }
    }
}
