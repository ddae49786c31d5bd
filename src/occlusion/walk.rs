//! A walk through a tree from near to far, within a frustum: what all cullers by occlusion share.
//!
//! Based on: Bittner et al. 2004 and Ivson 2006: nodes wait in a priority queue, the nearest first, whatever the tree. Deviation: a node is
//! held against the frustum before it is put into the queue, not when its turn comes.

use super::bounds::Bounds;
use super::hierarchy::Hierarchy;
use super::mask::Mask;
use super::oracle::{OcclusionOracle, QueryId};
use super::stats::OnlineStats;
use super::view::{ALL_PLANES, Frustum, PlaneMask, Side};
use crate::ObjectId;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A node in the frustum whose turn comes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Open {
    /// From the eye, metres.
    distance: f64,
    pub node: u32,
    /// Planes that it crosses.
    mask: PlaneMask,
}

impl Ord for Open {
    /// The nearest is the greatest; of equals, the first node.
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

/// What is walked: of a tree, what is in a frustum and in a mask, if there is one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scope<'t> {
    pub tree: &'t Hierarchy,
    pub frustum: &'t Frustum,
    pub mask: Option<&'t Mask>,
}

/// The walk of a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Walk {
    /// Counts from 1.
    pub frame: u64,
    /// What is drawn, in that order.
    pub objects: Vec<ObjectId>,
    pub stats: OnlineStats,
    waiting: BinaryHeap<Open>,
    /// By node, the plane that it was last outside of.
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

    /// Whether there is nobody left.
    pub fn is_done(&self) -> bool {
        self.waiting.is_empty()
    }

    /// The nearest.
    pub fn next(&mut self) -> Option<Open> {
        self.waiting.pop()
    }

    /// Draws a leaf's objects; of another node, puts the children into the queue.
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

    /// Asks the oracle.
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
