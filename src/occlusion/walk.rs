//! The traversal of a tree from near to far, within a frustum: common to all occlusion cullers. A [`Policy`] decides which nodes to query,
//! and when.
//!
//! Based on: Bittner et al. 2004 and Ivson 2006: nodes wait in a priority queue, the nearest first. Deviation: a node is tested against the
//! frustum before it enters the queue, not when it leaves it.

use super::bounds::Bounds;
use super::hierarchy::Hierarchy;
use super::mask::Scope;
use super::oracle::{OcclusionOracle, QueryId};
use super::stats::OnlineStats;
use super::view::{ALL_PLANES, PlaneMask, Side};
use crate::ObjectId;
use std::cmp::Ordering;
use std::collections::{BinaryHeap, VecDeque};

/// A queued node in the frustum.
#[derive(Clone, Copy, Debug)]
pub struct Open {
    /// Distance from the eye, metres.
    distance: f64,
    /// Its number.
    pub node: u32,
    /// Planes that it crosses.
    mask: PlaneMask,
}

impl Ord for Open {
    /// The nearest is the greatest; ties go to the first node.
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}

/// The walk of a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Walk {
    /// Counts from 1.
    pub frame: u64,
    /// The drawn objects, in order.
    pub objects: Vec<ObjectId>,
    pub stats: OnlineStats,
    waiting: BinaryHeap<Open>,
    /// By node, the last plane that it was outside of.
    last: Vec<u8>,
}

impl Walk {
    /// Starts a frame at the root.
    pub fn begin(&mut self, scope: &Scope<'_>) {
        let tree = scope.tree;
        self.frame += 1;
        self.stats = OnlineStats::default();
        self.objects.clear();
        self.objects.reserve(tree.object_count());
        self.waiting.reserve(tree.nodes().len());
        self.last.resize(tree.nodes().len(), 0);
        if !tree.nodes().is_empty() {
            self.put(scope, 0, ALL_PLANES);
        }
    }

    /// Whether the queue is empty.
    pub fn is_done(&self) -> bool {
        self.waiting.is_empty()
    }

    /// The nearest node.
    pub fn next(&mut self) -> Option<Open> {
        self.waiting.pop()
    }

    /// Draws a leaf's objects, or queues the children of an inner node.
    pub fn go_on(&mut self, scope: &Scope<'_>, open: Open, oracle: &mut impl OcclusionOracle) {
        let node = &scope.tree.nodes()[open.node as usize];
        if !node.is_leaf() {
            node.children().for_each(|child| self.put(scope, child, open.mask));
            return;
        }
        for &object in scope.tree.objects(open.node).iter().filter(|&&o| scope.mask.is_none_or(|m| m.has(o))) {
            oracle.draw(object);
            self.objects.push(object);
        }
        self.stats.objects = self.objects.len() as u64;
    }

    /// Issues a query.
    pub fn ask(&mut self, oracle: &mut impl OcclusionOracle, boxes: &[Bounds]) -> QueryId {
        self.stats.queries += 1;
        self.stats.boxes += boxes.len() as u64;
        oracle.issue(boxes)
    }

    fn put(&mut self, scope: &Scope<'_>, node: u32, mask: PlaneMask) {
        if !scope.mask.is_none_or(|m| m.has_below(node)) {
            return;
        }
        let bounds = &scope.tree.nodes()[node as usize].bounds;
        let last = &mut self.last[node as usize];
        self.stats.nodes += 1;
        match scope.frustum.side(bounds, mask, *last, &mut self.stats.plane_tests) {
            Side::Outside(plane) => *last = plane,
            Side::Crosses(mask) => self.waiting.push(Open { distance: bounds.distance(scope.frustum.eye()), node, mask }),
        }
    }
}

/// A walk with one node per query.
#[derive(Clone, Debug, Default)]
pub struct AskingWalk {
    walk: Walk,
    /// Pending queries, the oldest first, and whether the walk has continued below the node already.
    queries: VecDeque<(QueryId, Open, bool)>,
}

/// Decides which nodes to query, and when.
pub trait Policy {
    /// Visits a node. Nothing appears late if this calls [`AskingWalk::go_on`] or [`AskingWalk::ask`], or both, for each node.
    fn visit(&mut self, scope: &Scope<'_>, open: Open, walk: &mut AskingWalk, oracle: &mut impl OcclusionOracle);

    /// Receives an answer.
    fn learn(&mut self, tree: &Hierarchy, node: u32, shows: bool);
}

impl AskingWalk {
    /// Draws a frame with an oracle that has just begun it. Returns the drawn objects. Allocates nothing after the first frame of a tree;
    /// use it for one tree only.
    pub fn run(&mut self, scope: &Scope<'_>, policy: &mut impl Policy, oracle: &mut impl OcclusionOracle) -> &[ObjectId] {
        self.queries.reserve(scope.tree.nodes().len());
        self.walk.begin(scope);
        loop {
            // 1. Available answers; without other work, all of them.
            while let Some(&(query, open, gone_on)) = self.queries.front() {
                match oracle.poll(query) {
                    Some(shows) => {
                        self.queries.pop_front();
                        policy.learn(scope.tree, open.node, shows);
                        if shows && !gone_on {
                            self.go_on(scope, open, oracle);
                        }
                    }
                    None if self.walk.is_done() => self.walk.stats.waits += 1,
                    None => break,
                }
            }
            // 2. The next node.
            match self.walk.next() {
                Some(open) => policy.visit(scope, open, self, oracle),
                None if self.queries.is_empty() => return &self.walk.objects,
                None => {}
            }
        }
    }

    /// Queries a node. If it is visible, the walk continues below it, unless it has `gone_on` already.
    pub fn ask(&mut self, tree: &Hierarchy, open: Open, gone_on: bool, oracle: &mut impl OcclusionOracle) {
        let query = self.walk.ask(oracle, tree.asked(open.node));
        self.queries.push_back((query, open, gone_on));
    }

    /// Draws a leaf's objects, or queues the children of an inner node.
    pub fn go_on(&mut self, scope: &Scope<'_>, open: Open, oracle: &mut impl OcclusionOracle) {
        self.walk.go_on(scope, open, oracle);
    }

    /// The number of the frame; the first is 1.
    pub fn frame(&self) -> u64 {
        self.walk.frame
    }

    /// The objects drawn in the last frame, in order.
    pub fn objects(&self) -> &[ObjectId] {
        &self.walk.objects
    }

    /// Counters of the last frame.
    pub fn stats(&self) -> OnlineStats {
        self.walk.stats
    }
}
