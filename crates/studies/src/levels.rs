//! Fixed levels of queries: the nodes of some levels of a scene graph are asked about, the others never.
//!
//! Based on: Cunha, Leitão, *Exploração da remoção hierárquica por oclusão em simulações em tempo real*, who compare seven choices of levels
//! in a scene graph of four, with OpenSceneGraph's query nodes. Deviations: nodes that were hidden are asked about in every frame, and wait for
//! the answer (their own proposal goes as far as the first half), so that nothing shows late; nodes that showed are asked about
//! at intervals, but not all in the same frame: whose turn it is goes around by their numbers.

use enfilade::ObjectId;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::occlusion::mask::Scope;
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::stats::OnlineStats;
use enfilade::occlusion::view::Frustum;
use enfilade::occlusion::walk::{AskingWalk, Open, Policy};

/// The choices C1 to C7 of a graph whose root is at level 0, groups of areas at 1, areas at 2 and objects at 3, as sets of levels (bit `k`
/// for level `k`). C1, none, is frustum culling alone. The study shows them in a figure; these are what its text says of them.
pub const C1_TO_C7: [u32; 7] = [0b0000, 0b1000, 0b1100, 0b0100, 0b0110, 0b1010, 0b1110];

/// What to ask about.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LevelOptions {
    /// Bit `k` for level `k`; nodes at levels from 32 on are never asked about.
    pub levels: u32,
    /// A node that showed is asked about in one of so many frames; 0 and 1 are all. Higher: fewer questions, more is drawn for nothing.
    pub interval: u32,
    /// Nodes of fewer triangles aren't asked about: the study leaves out small objects. More than the box's own 12 is reasonable.
    pub least_triangles: u64,
}

impl LevelOptions {
    /// With OpenSceneGraph's interval.
    pub const fn new(levels: u32) -> Self {
        Self { levels, interval: 5, least_triangles: 0 }
    }
}

/// What is known of a node.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Whether the last answer was that it shows.
    visible: bool,
    /// The last frame that came to it.
    visited: u64,
}

/// Culls a tree; keeps what one camera needs from frame to frame.
#[derive(Clone, Debug)]
pub struct LevelCuller {
    memory: Memory,
    walk: AskingWalk,
}

#[derive(Clone, Debug)]
struct Memory {
    options: LevelOptions,
    states: Vec<State>,
}

impl LevelCuller {
    /// With empty memory: the first frame asks about everything that it may.
    pub fn new(options: LevelOptions) -> Self {
        Self { memory: Memory { options, states: Vec::new() }, walk: AskingWalk::default() }
    }

    /// Draws a frame with an oracle that has just begun one. Returns what was drawn: every object of the tree that has a pixel. Allocates
    /// nothing after the first frame of a tree; to be used for one tree only.
    pub fn cull(&mut self, tree: &Hierarchy, frustum: &Frustum, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        self.memory.states.resize(tree.nodes().len(), State::default());
        self.walk.run(&Scope { tree, frustum, mask: None }, &mut self.memory, oracle)
    }

    /// Of the last frame.
    pub fn stats(&self) -> OnlineStats {
        self.walk.stats()
    }
}

impl Policy for Memory {
    fn visit(&mut self, scope: &Scope<'_>, open: Open, walk: &mut AskingWalk, oracle: &mut impl OcclusionOracle) {
        let Memory { options, states } = self;
        let (node, frame) = (&scope.tree.nodes()[open.node as usize], walk.frame());
        let state = &mut states[open.node as usize];
        let was_visible = state.visible && state.visited + 1 == frame;
        state.visited = frame;
        let has_level = node.level < 32 && options.levels >> node.level & 1 != 0;
        let mut is_in_sight = was_visible;
        if !has_level || node.triangles < options.least_triangles || scope.frustum.meets_near(&node.bounds) {
            state.visible = true;
            is_in_sight = true;
        } else if !was_visible || (frame + u64::from(open.node)).is_multiple_of(u64::from(options.interval.max(1))) {
            walk.ask(scope.tree, open, was_visible, oracle);
        }
        if is_in_sight {
            walk.go_on(scope, open, oracle);
        }
    }

    fn learn(&mut self, _: &Hierarchy, node: u32, shows: bool) {
        self.states[node as usize].visible = shows;
    }
}
