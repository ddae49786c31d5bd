//! Portals, rows and occlusion queries together: queries run on a tree of the objects that portals and rows leave.
//!
//! Based on: Bittner et al. 2004 and Mattausch et al. 2008 ([`crate::occlusion::chc`], [`crate::occlusion::chc_plus`]) within the result of
//! Luebke and Georges' traversal. In an open cell, where a portal leads to half of the scene, queries do most of the work; in a room,
//! portals do, and few nodes need a query. An object is in the walk only if it is within a portal's rectangle, so queries never go beyond
//! the portals' frusta.

use super::culler::Culler;
use super::mode::Mode;
use super::scratch::Scratch;
use crate::ObjectId;
use crate::math::geom::Aabb;
use crate::occlusion::chc::Chc;
use crate::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
use crate::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use crate::occlusion::mask::{Mask, Scope};
use crate::occlusion::oracle::OcclusionOracle;
use crate::occlusion::view::{Frustum, View};

/// Culls with an oracle; keeps the state of one camera between frames.
#[derive(Clone, Debug)]
pub(super) struct OnlineCuller {
    tree: Hierarchy,
    mask: Mask,
    chc: Chc,
    plus: ChcPlus,
}

impl OnlineCuller {
    /// Builds a tree of all objects' boxes.
    pub fn new(culler: &Culler) -> Self {
        let objects = 0..culler.object_count();
        let aabb = |i: usize| {
            let (centre, half) = culler.boxes.get(i);
            let (centre, half) = (centre.as_dvec3(), half.as_dvec3());
            Aabb { min: centre - half, max: centre + half }
        };
        let boxes: Vec<Aabb> = objects.clone().map(aabb).collect();
        let triangles: Vec<u32> = objects.map(|i| culler.triangles(ObjectId(i as u32))).collect();
        Self::with_tree(culler, Hierarchy::of_boxes(&boxes, &triangles, &HierarchyOptions::default()))
    }

    /// Uses a given tree of all objects.
    pub fn with_tree(culler: &Culler, tree: Hierarchy) -> Self {
        assert_eq!(tree.object_count(), culler.object_count(), "a tree of the culler's objects");
        Self { mask: Mask::new(&tree), tree, chc: Chc::default(), plus: ChcPlus::new(ChcPlusOptions::default()) }
    }

    /// Its tree.
    pub fn into_tree(self) -> Hierarchy {
        self.tree
    }

    /// Draws the frame in `scratch` by [`Mode::Chc`] or [`Mode::ChcPlus`], with an oracle that has just begun it with `view`, and leaves its
    /// objects that are drawn there: all that have a pixel at the oracle's size beyond the near plane. Allocates nothing after the first
    /// frame of each mode.
    pub fn cull(
        &mut self,
        culler: &Culler,
        view: &View,
        mode: Mode,
        oracle: &mut impl OcclusionOracle,
        scratch: &mut Scratch,
    ) {
        self.mask.set(&self.tree, &scratch.objects);
        let scope = Scope { tree: &self.tree, frustum: &Frustum::new(view), mask: Some(&self.mask) };
        let (objects, asked) = if mode == Mode::ChcPlus {
            self.plus.cull_of(&scope, oracle);
            (self.plus.objects(), self.plus.stats())
        } else {
            self.chc.cull_of(&scope, oracle);
            (self.chc.objects(), self.chc.stats())
        };
        scratch.objects.clear();
        scratch.objects.extend_from_slice(objects);
        scratch.stats.queries = asked.queries;
        scratch.finish(culler);
    }
}
