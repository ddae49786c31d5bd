//! CHC++: coherent hierarchical culling with fewer questions, asked together.
//!
//! Based on: Mattausch, Bittner, Wimmer, *CHC++: coherent hierarchical culling revisited*, 2008. Nodes that were hidden wait until a batch of
//! them is asked about (i-queue); those that have been hidden for long share a question (multiquery), and are asked one by one only where
//! it says that something shows. Leaves that showed are asked about at intervals, at first after a random part of one, so that they
//! don't come in waves; and their questions wait until there is nothing better to do (v-queue). An inner node is asked about by the boxes
//! of nodes below it where those are tighter.
//!
//! Deviations: a question about one node costs one query, whatever the answer (the paper's cost has it asked twice), so nodes of unknown
//! behaviour are asked alone; an oracle that answers at once is asked at once, since what waits for a batch is drawn later, behind what it would
//! hide: about a node that was hidden when its turn comes, and about a leaf that showed before that is drawn, where it has many triangles in every
//! frame; while answers are due, the walk goes on where it can; the answers about leaves that showed are awaited at the
//! end of the frame and not in the next.
//!
//! Nothing shows late: a leaf isn't drawn only where an answer of this very frame says that it, or a node above it, is hidden.

use super::bounds::Bounds;
use super::hierarchy::Hierarchy;
use super::mask::Scope;
use super::oracle::{OcclusionOracle, QueryId};
use super::stats::OnlineStats;
use super::view::Frustum;
use super::walk::{Open, Walk};
use crate::ObjectId;
use crate::random::Prng;
use std::collections::VecDeque;

/// Boxes below a node that its question may be about: three levels of a binary tree, as in the paper. More: the boxes cost more than what
/// they tell. Fewer: boxes of large nodes are mostly empty.
const MOST_BOXES: usize = 8;

/// Triangles of a leaf from which on an oracle that answers at once is asked about it in every frame, before it is drawn: of so many, one leaf
/// that isn't drawn pays for some fifty questions. Higher: more is drawn in vain. Lower: questions cost more than they save.
const WORTH_ASKING: u64 = 256;

/// How to ask.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ChcPlusOptions {
    /// Nodes that were hidden are asked about once there are so many; 1 or more. Higher: fewer changes of state on a graphics processor,
    /// and more nodes to share a question among; but answers, and what they open, come later.
    pub batch: usize,
    /// A leaf that showed counts as in sight for so long. Longer: fewer questions, more is drawn for nothing.
    pub assumed: Interval,
    /// Boxes below a node are asked about instead of its own while the sum of their areas is at most this times its own's; 0 never does.
    pub tighter: f64,
    /// Decides the random choices.
    pub seed: u64,
}

/// Between two questions about a leaf that shows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Interval {
    /// Frames; 0 and 1 ask in every one.
    Frames(u32),
    /// Seconds of the clock that [`ChcPlus::set_time`] tells: as many questions a second at any rate of frames. Ten frames of 60 a second are
    /// 0.167 s.
    Seconds(f64),
}

impl Interval {
    /// How long to wait after an answer: all of it, or a random part.
    fn wait(self, whole: bool, random: &mut Prng) -> f64 {
        match self {
            Self::Frames(frames) if whole => f64::from(frames.max(1)),
            Self::Frames(frames) => 1.0 + random.below(frames.max(1) as usize) as f64,
            Self::Seconds(seconds) => seconds * if whole { 1.0 } else { random.unit() },
        }
    }
}

impl Default for ChcPlusOptions {
    /// The paper's.
    fn default() -> Self {
        Self { batch: 20, assumed: Interval::Frames(8), tighter: 1.4, seed: 0 }
    }
}

/// What is known of a node.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    /// Whether it, or a leaf below it, showed when it was last visited.
    visible: bool,
    /// The last frame that came to it.
    visited: u64,
    /// For how many visits it has been hidden.
    hidden: u32,
    /// A leaf that shows isn't asked about before the clock says this.
    next: f64,
}

/// A question without an answer.
#[derive(Clone, Copy, Debug)]
struct Query {
    id: QueryId,
    /// Its part of `asked`.
    start: u32,
    end: u32,
    of: Of,
}

/// Whom a question is about.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Of {
    /// Nodes that were hidden.
    Hidden,
    /// A leaf that showed, which isn't drawn before the answer.
    Shown,
    /// A leaf that showed and is drawn already.
    Drawn,
}

/// Culls a tree; keeps what one camera needs from frame to frame.
#[derive(Clone, Debug)]
pub struct ChcPlus {
    options: ChcPlusOptions,
    /// In what intervals are in.
    clock: f64,
    random: Prng,
    states: Vec<State>,
    walk: Walk,
    /// The oldest first.
    queries: VecDeque<Query>,
    /// Nodes of all questions of the frame, one after the other.
    asked: Vec<Open>,
    /// Nodes that were hidden.
    hidden: Vec<Open>,
    /// Leaves that showed, drawn already.
    shown: VecDeque<Open>,
    boxes: Vec<Bounds>,
}

impl ChcPlus {
    /// With empty memory: the first frame asks about everything.
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

    /// Tells the time of the frames from now on, seconds from any beginning. Without it, or where it isn't a number, intervals in seconds
    /// don't end; it means nothing to others.
    pub fn set_time(&mut self, seconds: f64) {
        if matches!(self.options.assumed, Interval::Seconds(_)) && seconds.is_finite() {
            self.clock = seconds;
        }
    }

    /// Draws a frame, as [`Chc::cull`](super::chc::Chc::cull) does; all questions have their answer when it returns.
    pub fn cull(&mut self, tree: &Hierarchy, frustum: &Frustum, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        self.cull_of(&Scope { tree, frustum, mask: None }, oracle)
    }

    /// The same, of a part of a tree.
    pub fn cull_of(&mut self, scope: &Scope<'_>, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        let tree = scope.tree;
        self.begin(tree);
        self.walk.begin(scope);
        if matches!(self.options.assumed, Interval::Frames(_)) {
            self.clock = self.walk.frame as f64;
        }
        loop {
            // 1. Answers; while the oldest isn't there, questions that can wait for theirs.
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
            // 3. A batch, or what there is of it when nothing else can go on.
            if self.hidden.len() >= self.options.batch || self.walk.is_done() {
                self.ask_hidden(tree, oracle);
            }
            // 4. The rest of the questions that could wait.
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

    /// Takes all the memory that frames of this tree need: a node is asked about with others once, and alone once more.
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

    /// Asks about the nodes that were hidden: those that have been for long first, and together.
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

    /// Asks one question about some nodes.
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

    /// A node shows, and so do all above it.
    fn pull_up(&mut self, tree: &Hierarchy, node: u32) {
        let mut next = Some(node);
        while let Some(n) = next.filter(|&n| !self.states[n as usize].visible) {
            let state = &mut self.states[n as usize];
            state.visible = true;
            state.hidden = 0;
            next = tree.nodes()[n as usize].parent;
        }
    }

    /// What the last frame drew.
    pub fn objects(&self) -> &[ObjectId] {
        &self.walk.objects
    }

    /// Of the last frame.
    pub fn stats(&self) -> OnlineStats {
        self.walk.stats
    }
}

/// How probable it is that a node that was hidden for so many visits stays so: the paper's fit to what was measured.
fn stays(hidden: u32) -> f64 {
    0.99 - 0.7 * (-f64::from(hidden)).exp()
}

/// Of nodes, those hidden for the longest first, how many had best share a question: the most nodes a query. 1 or more.
fn share(hidden: impl Iterator<Item = u32>) -> usize {
    let (mut all_stay, mut best, mut best_value) = (1.0, 1, 1.0);
    for (i, hidden) in hidden.enumerate() {
        all_stay *= stays(hidden);
        let count = (i + 1) as f64;
        // Where one shows, all are asked about again.
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

/// Adds the box of a node, or those of nodes below it that together hold as much, where they are tighter.
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

    /// A cube in plain sight for a second, at several rates of frames, with an oracle that answers late.
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
        // Once at first, once within the first interval, then one each 0.1 s: by frames of 60 and 240 a second.
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
