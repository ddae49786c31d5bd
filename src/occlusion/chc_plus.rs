//! CHC++: coherent hierarchical culling with fewer queries, in batches.
//!
//! Based on: Mattausch, Bittner, Wimmer, *CHC++: coherent hierarchical culling revisited*, 2008. Previously hidden nodes wait for a batch
//! of queries (i-queue). Nodes hidden for a long time share a query (multiquery), and are queried one by one only if it finds a visible
//! pixel. Visible leaves are queried at intervals, first after a random part of one, so that queries do not come in waves; these queries
//! wait until there is no other work (v-queue). The query of an inner node uses the boxes of nodes below it if those are tighter.
//!
//! Deviations: a query of one node costs one query, whatever the answer (the paper's cost counts two), so nodes of unknown behaviour are
//! queried alone. An oracle that answers immediately is queried immediately, because a node that waits for a batch is drawn after the
//! objects that it would hide: a hidden node when its turn comes; a visible leaf before it is drawn, in every frame if it has many
//! triangles. While answers are pending, the walk continues where possible. The answers for visible leaves are awaited at the end of the
//! frame and not in the next.
//!
//! Nothing appears late: a leaf is skipped only if an answer of this frame says that it, or a node above it, is hidden.

use super::bounds::Bounds;
use super::hierarchy::Hierarchy;
use super::mask::Scope;
use super::oracle::{OcclusionOracle, QueryId};
use super::stats::OnlineStats;
use super::view::Frustum;
use super::walk::{Open, Walk};
use crate::ObjectId;
use crate::math::random::Prng;
use std::collections::VecDeque;

/// Most boxes of one node's query: three levels of a binary tree, as in the paper. More: the boxes cost more than they gain. Fewer: boxes
/// of large nodes are mostly empty.
const MOST_BOXES: usize = 8;

/// Least triangles of a visible leaf for a query before drawing in every frame, with an oracle that answers immediately: one such leaf not
/// drawn pays for some fifty queries. Higher: more useless draws. Lower: queries cost more than they save.
const WORTH_ASKING: u64 = 256;

/// Options of the queries.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ChcPlusOptions {
    /// Size of a batch of hidden nodes; 1 or more. Higher: fewer state changes on a graphics processor, and more nodes per multiquery; but
    /// answers, and the nodes below, come later.
    pub batch: usize,
    /// How long a visible leaf is assumed visible. Longer: fewer queries, more useless draws.
    pub assumed: Interval,
    /// A query uses boxes below a node while the sum of their areas is at most this times the area of its own box; 0: never.
    pub tighter: f64,
    /// Seed of the random choices.
    pub seed: u64,
}

/// The interval between two queries of a visible leaf.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Interval {
    /// Frames; 0 and 1: every frame.
    Frames(u32),
    /// Seconds of the clock set by [`ChcPlus::set_time`]: the same number of queries per second at any frame rate. Ten frames at 60 per
    /// second are 0.167 s.
    Seconds(f64),
}

impl Interval {
    /// The wait after an answer: the whole interval, or a random part.
    fn wait(self, whole: bool, random: &mut Prng) -> f64 {
        match self {
            Self::Frames(frames) if whole => f64::from(frames.max(1)),
            Self::Frames(frames) => 1.0 + random.below(frames.max(1) as usize) as f64,
            Self::Seconds(seconds) => seconds * if whole { 1.0 } else { random.unit() },
        }
    }
}

impl Default for ChcPlusOptions {
    /// The paper's values.
    fn default() -> Self {
        Self { batch: 20, assumed: Interval::Frames(8), tighter: 1.4, seed: 0 }
    }
}

/// The state of a node.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Whether it, or a leaf below it, was visible at its last visit.
    visible: bool,
    /// The frame of its last visit.
    visited: u64,
    /// Number of visits in a row in which it was hidden.
    hidden: u32,
    /// Time of the next query of a visible leaf.
    next: f64,
}

/// A query without an answer.
#[derive(Clone, Copy, Debug)]
struct Query {
    id: QueryId,
    /// Its part of `asked`.
    start: u32,
    end: u32,
    of: Of,
}

/// The nodes of a query.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Of {
    /// Previously hidden nodes.
    Hidden,
    /// A visible leaf that is drawn after the answer.
    Shown,
    /// A visible leaf that is drawn already.
    Drawn,
}

/// Culls a tree; keeps the state of one camera between frames.
#[derive(Clone, Debug)]
pub struct ChcPlus {
    options: ChcPlusOptions,
    /// In the unit of intervals.
    clock: f64,
    random: Prng,
    states: Vec<State>,
    walk: Walk,
    /// The oldest first.
    queries: VecDeque<Query>,
    /// Nodes of all queries of the frame, concatenated.
    asked: Vec<Open>,
    /// Previously hidden nodes.
    hidden: Vec<Open>,
    /// Visible leaves, drawn already.
    shown: VecDeque<Open>,
    boxes: Vec<Bounds>,
}

impl ChcPlus {
    /// A culler without state: the first frame queries everything.
    pub fn new(options: ChcPlusOptions) -> Self {
        Self {
            options,
            clock: 0.0,
            random: Prng::new(options.seed, 0),
            states: Vec::new(),
            walk: Walk::default(),
            queries: VecDeque::new(),
            asked: Vec::new(),
            hidden: Vec::new(),
            shown: VecDeque::new(),
            boxes: Vec::new(),
        }
    }

    /// Sets the time of the next frames, seconds from any origin. Without it, or if it is not finite, intervals in seconds never end; it
    /// does not affect intervals in frames.
    pub fn set_time(&mut self, seconds: f64) {
        if matches!(self.options.assumed, Interval::Seconds(_)) && seconds.is_finite() {
            self.clock = seconds;
        }
    }

    /// Draws a frame, as [`Chc::cull`](super::chc::Chc::cull) does; all queries are answered when it returns.
    pub fn cull(&mut self, tree: &Hierarchy, frustum: &Frustum, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        self.cull_of(&Scope { tree, frustum, mask: None }, oracle)
    }

    /// The same for a part of a tree.
    pub(crate) fn cull_of(&mut self, scope: &Scope<'_>, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        let tree = scope.tree;
        self.begin(tree);
        self.walk.begin(scope);
        if matches!(self.options.assumed, Interval::Frames(_)) {
            self.clock = self.walk.frame as f64;
        }
        loop {
            // 1. Answers; while the oldest is pending, low-priority queries.
            while let Some(&query) = self.queries.front() {
                match oracle.poll(query.id) {
                    Some(shows) => {
                        self.queries.pop_front();
                        self.answered(scope, query, shows, oracle);
                    }
                    None if !self.walk.is_done() => break,
                    None => match self.shown.pop_front() {
                        Some(open) => self.ask(tree, &[open], Of::Drawn, oracle),
                        None => self.walk.stats.waits += 1,
                    },
                }
            }
            // 2. The next node.
            if let Some(open) = self.walk.next() {
                self.visit(scope, open, oracle);
            }
            // 3. A batch, or a partial one if there is no other work.
            if self.hidden.len() >= self.options.batch || self.walk.is_done() {
                self.ask_hidden(tree, oracle);
            }
            // 4. The remaining low-priority queries.
            if self.walk.is_done() && self.queries.is_empty() {
                if self.shown.is_empty() {
                    return &self.walk.objects;
                }
                while let Some(open) = self.shown.pop_front() {
                    self.ask(tree, &[open], Of::Drawn, oracle);
                }
            }
        }
    }

    /// Allocates all memory for frames of this tree: a node is queried at most once with others and once alone.
    fn begin(&mut self, tree: &Hierarchy) {
        let nodes = tree.nodes().len();
        self.states.resize(nodes, State::default());
        self.asked.clear();
        self.asked.reserve(2 * nodes);
        self.queries.reserve(2 * nodes);
        self.hidden.reserve(nodes);
        self.shown.reserve(nodes);
        self.boxes.clear();
        self.boxes.reserve(tree.boxes().max(MOST_BOXES));
    }

    fn visit(&mut self, scope: &Scope<'_>, open: Open, oracle: &mut impl OcclusionOracle) {
        let Scope { tree, frustum, .. } = *scope;
        let (node, at_once) = (&tree.nodes()[open.node as usize], oracle.answers_at_once());
        let state = &mut self.states[open.node as usize];
        let was_visited = state.visited + 1 == self.walk.frame;
        let was_visible = state.visible && was_visited;
        state.visible = false;
        state.visited = self.walk.frame;
        if !was_visited {
            state.hidden = 0;
        }
        if frustum.meets_near(&node.bounds) {
            self.pull_up(tree, open.node);
            self.walk.go_on(scope, open, oracle);
        } else if !was_visible {
            if at_once {
                return self.ask(tree, &[open], Of::Hidden, oracle);
            }
            self.hidden.push(open);
        } else {
            if node.is_leaf() {
                if at_once && (state.next <= self.clock || node.triangles >= WORTH_ASKING) {
                    return self.ask(tree, &[open], Of::Shown, oracle);
                }
                if state.next <= self.clock {
                    self.shown.push_back(open);
                } else {
                    self.pull_up(tree, open.node);
                }
            }
            self.walk.go_on(scope, open, oracle);
        }
    }

    /// Queries the previously hidden nodes: those hidden longest first, in multiqueries.
    fn ask_hidden(&mut self, tree: &Hierarchy, oracle: &mut impl OcclusionOracle) {
        let mut hidden = std::mem::take(&mut self.hidden);
        hidden.sort_unstable_by_key(|open| (std::cmp::Reverse(self.states[open.node as usize].hidden), open.node));
        let mut rest = &hidden[..];
        while !rest.is_empty() {
            let together = share(rest.iter().map(|open| self.states[open.node as usize].hidden));
            let (first, others) = rest.split_at(together);
            self.ask(tree, first, Of::Hidden, oracle);
            rest = others;
        }
        hidden.clear();
        self.hidden = hidden;
    }

    /// Issues one query for some nodes.
    fn ask(&mut self, tree: &Hierarchy, nodes: &[Open], of: Of, oracle: &mut impl OcclusionOracle) {
        self.boxes.clear();
        for open in nodes {
            tighter(tree, open.node, self.options.tighter, &mut self.boxes);
        }
        let start = self.asked.len() as u32;
        self.asked.extend_from_slice(nodes);
        let id = self.walk.ask(oracle, &self.boxes);
        self.queries.push_back(Query { id, start, end: self.asked.len() as u32, of });
    }

    fn answered(&mut self, scope: &Scope<'_>, query: Query, shows: bool, oracle: &mut impl OcclusionOracle) {
        let tree = scope.tree;
        let several = query.end - query.start > 1;
        for i in query.start..query.end {
            let open = self.asked[i as usize];
            let state = &mut self.states[open.node as usize];
            if !shows {
                state.hidden = state.hidden.saturating_add(1);
            } else if several {
                self.ask(tree, &[open], Of::Hidden, oracle);
            } else {
                state.next = self.clock + self.options.assumed.wait(query.of != Of::Hidden, &mut self.random);
                self.pull_up(tree, open.node);
                if query.of != Of::Drawn {
                    self.walk.go_on(scope, open, oracle);
                }
            }
        }
    }

    /// Marks a node and all its ancestors as visible.
    fn pull_up(&mut self, tree: &Hierarchy, node: u32) {
        let mut next = Some(node);
        while let Some(n) = next.filter(|&n| !self.states[n as usize].visible) {
            let state = &mut self.states[n as usize];
            state.visible = true;
            state.hidden = 0;
            next = tree.nodes()[n as usize].parent;
        }
    }

    /// The objects drawn in the last frame.
    pub fn objects(&self) -> &[ObjectId] {
        &self.walk.objects
    }

    /// Counters of the last frame.
    pub fn stats(&self) -> OnlineStats {
        self.walk.stats
    }
}

/// Probability that a node stays hidden after this many hidden visits: the paper's fit to measurements.
fn stays(hidden: u32) -> f64 {
    0.99 - 0.7 * (-f64::from(hidden)).exp()
}

/// The best size of a multiquery for nodes sorted by hidden visits: the most nodes per query. 1 or more.
fn share(hidden: impl Iterator<Item = u32>) -> usize {
    let (mut all_stay, mut best, mut best_value) = (1.0, 1, 1.0);
    for (i, hidden) in hidden.enumerate() {
        all_stay *= stays(hidden);
        let count = (i + 1) as f64;
        // If one is visible, all are queried again.
        let value = count / (1.0 + (1.0 - all_stay) * count);
        if i > 0 && value <= best_value {
            break;
        }
        if i > 0 {
            (best, best_value) = (i + 1, value);
        }
    }
    best
}

/// Adds the box of a node, or tighter boxes of nodes below it that contain the same objects.
fn tighter(tree: &Hierarchy, node: u32, most: f64, boxes: &mut Vec<Bounds>) {
    let of = |n: u32| &tree.nodes()[n as usize];
    let (mut nodes, mut count) = ([node; MOST_BOXES], 1);
    let most_area = most * of(node).bounds.area();
    loop {
        let (mut below, mut area, mut next) = ([0; MOST_BOXES], 0.0, 0);
        let mut is_deeper = false;
        for &n in &nodes[..count] {
            let children = of(n).children();
            is_deeper |= !of(n).is_leaf();
            for child in if of(n).is_leaf() { n..n + 1 } else { children } {
                area += of(child).bounds.area();
                if next < MOST_BOXES {
                    below[next] = child;
                }
                next += 1;
            }
        }
        if !is_deeper || next > MOST_BOXES || area > most_area {
            break;
        }
        (nodes, count) = (below, next);
    }
    nodes[..count].iter().for_each(|&n| boxes.extend_from_slice(tree.asked(n)));
}

#[cfg(test)]
mod tests {
    use super::super::depth::DepthBuffer;
    use super::super::hierarchy::HierarchyOptions;
    use super::super::scenes::row;
    use super::super::view::View;
    use super::*;
    use glam::DVec3;

    #[test]
    fn nodes_of_unknown_behaviour_are_asked_alone_and_old_ones_together() {
        assert_eq!(share([0, 0, 0].into_iter()), 1);
        assert_eq!(share([100, 0].into_iter()), 1);
        // n / (1 + n (1 - 0.99^n)): 5.112 at 10, 5.113 at 11, 5.098 at 12.
        assert_eq!(share([100; 30].into_iter()), 11);
        assert_eq!(share([100, 100, 100, 0, 0].into_iter()), 3);
    }

    /// A visible cube for a second, at several frame rates, with an oracle that answers late.
    #[test]
    fn intervals_in_seconds_ask_as_often_at_any_rate() {
        let scene = row(&[(0.0, 1)]);
        let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
        let view = View::look_at(DVec3::Z * 5.0, DVec3::ZERO, 1.0, 1.5, 0.1);
        let mut buffer = DepthBuffer::new(&scene, 64, 48);
        let mut asked = |assumed: Interval, rate: u32| {
            let mut culler = ChcPlus::new(ChcPlusOptions { assumed, ..ChcPlusOptions::default() });
            let mut queries = 0;
            for frame in 0..rate {
                culler.set_time(f64::from(frame) / f64::from(rate));
                OcclusionOracle::begin(&mut buffer, &view);
                assert_eq!(culler.cull(&tree, &Frustum::new(&view), &mut buffer).len(), 1);
                queries += culler.stats().queries;
            }
            queries
        };
        // Once at first, once within the first interval, then once each 0.1 s, at 60 and 240 frames per second.
        for rate in [60, 240] {
            let queries = asked(Interval::Seconds(0.1), rate);
            assert!((10..=12).contains(&queries), "{rate} frames: {queries}");
        }
        let [slow, fast] = [60, 240].map(|rate| asked(Interval::Frames(8), rate));
        assert!((8..=9).contains(&slow) && (30..=32).contains(&fast), "{slow}, {fast}");
    }

    #[test]
    fn far_apart_children_are_asked_about_instead_of_what_is_between() {
        let scene = row(&[(0.0, 1), (1.0, 1), (50.0, 1), (51.0, 1)]);
        let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
        let count = |most: f64| {
            let mut boxes = Vec::new();
            tighter(&tree, 0, most, &mut boxes);
            boxes.len()
        };
        // The pairs' boxes have areas of 3.5 each, the root's has 103.5; the four cubes' have 1.5 each.
        assert_eq!((count(0.0), count(0.06), count(0.07), count(1.4)), (1, 1, 4, 4));
    }
}
