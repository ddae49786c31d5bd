//! View frustum culling of a tree.
//!
//! Based on: Assarsson, Möller, *Optimized view frustum culling algorithms for bounding boxes*, 2000: if a box is inside a plane, its
//! children skip that plane (plane masks); and a node outside a plane in the last frame is likely still outside, so that plane is tested
//! first (plane coherency). The result does not depend on either.

use super::hierarchy::Hierarchy;
use super::stats::OnlineStats;
use super::view::{ALL_PLANES, Frustum, PlaneMask, Side};
use crate::ObjectId;

/// Culls a tree; keeps the state of one camera between frames.
#[derive(Clone, Debug, Default)]
pub struct FrustumCuller {
    /// By node, the last plane that it was outside of.
    last: Vec<u8>,
    stack: Vec<(u32, PlaneMask)>,
    objects: Vec<ObjectId>,
    stats: OnlineStats,
}

impl FrustumCuller {
    /// The objects of all leaves that, like all their ancestors, are not certainly outside. Allocates nothing after the first frame of a
    /// tree; use it for one tree only.
    pub fn cull(&mut self, tree: &Hierarchy, frustum: &Frustum) -> &[ObjectId] {
        self.stats = OnlineStats::default();
        self.objects.clear();
        self.objects.reserve(tree.object_count());
        self.last.resize(tree.nodes().len(), 0);
        self.stack.reserve(tree.nodes().len());
        if !tree.nodes().is_empty() {
            self.stack.push((0, ALL_PLANES));
        }
        while let Some((n, mask)) = self.stack.pop() {
            let node = &tree.nodes()[n as usize];
            let last = &mut self.last[n as usize];
            self.stats.nodes += 1;
            match frustum.side(&node.bounds, mask, *last, &mut self.stats.plane_tests) {
                Side::Outside(plane) => *last = plane,
                // All below is inside.
                Side::Crosses(0) => self.objects.extend_from_slice(tree.objects(n)),
                Side::Crosses(_) if node.is_leaf() => self.objects.extend_from_slice(tree.objects(n)),
                Side::Crosses(mask) => self.stack.extend(node.children().rev().map(|child| (child, mask))),
            }
        }
        self.stats.objects = self.objects.len() as u64;
        &self.objects
    }

    /// Counters of the last frame.
    pub fn stats(&self) -> OnlineStats {
        self.stats
    }
}

#[cfg(test)]
mod tests {
    use super::super::hierarchy::HierarchyOptions;
    use super::super::scenes::{crowd, random_view, turned_tree};
    use super::super::view::View;
    use super::*;
    use crate::math::random::Prng;

    /// Brute force: every leaf and its ancestors against every plane; also the number of tests.
    fn brute(tree: &Hierarchy, frustum: &Frustum) -> (Vec<ObjectId>, u64) {
        let mut tests = 0;
        let mut inside = Vec::new();
        for node in tree.nodes() {
            let above = node.parent.is_none_or(|p| inside[p as usize]);
            inside.push(above && matches!(frustum.side(&node.bounds, ALL_PLANES, 0, &mut tests), Side::Crosses(_)));
        }
        let leaves = (0..tree.nodes().len()).filter(|&n| tree.nodes()[n].is_leaf() && inside[n]);
        let mut objects: Vec<ObjectId> = leaves.flat_map(|n| tree.objects(n as u32)).copied().collect();
        objects.sort_unstable();
        (objects, tests)
    }

    #[test]
    fn the_set_is_that_of_brute_force() {
        let scene = crowd(80, 1);
        let mut rng = Prng::new(5, 0);
        let aligned = Hierarchy::build(&scene, &HierarchyOptions::default());
        for (kind, tree) in [aligned, turned_tree(&scene)].iter().enumerate() {
            let mut culler = FrustumCuller::default();
            let mut drawn = 0;
            for _ in 0..100 {
                let view = View { far: rng.range(5.0, 40.0), ..random_view(&mut rng, 0.1) };
                let frustum = Frustum::new(&view);
                let mut objects = culler.cull(tree, &frustum).to_vec();
                objects.sort_unstable();
                assert_eq!(objects, brute(tree, &frustum).0, "tree {kind}");
                drawn += objects.len();
            }
            assert!((1000..7000).contains(&drawn), "{drawn} of 8000: a test of nothing");
        }
    }

    /// Axis-aligned boxes nest, so leaves alone decide.
    #[test]
    fn aligned_boxes_are_taken_one_by_one() {
        let scene = crowd(80, 2);
        let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
        let mut rng = Prng::new(6, 0);
        for _ in 0..100 {
            let frustum = Frustum::new(&random_view(&mut rng, 0.1));
            let mut want: Vec<ObjectId> = (0..80).map(ObjectId).collect();
            want.retain(|o| {
                let bounds = scene.objects[o.index()].bounds.into();
                matches!(frustum.side(&bounds, ALL_PLANES, 0, &mut 0), Side::Crosses(_))
            });
            let mut got = FrustumCuller::default().cull(&tree, &frustum).to_vec();
            got.sort_unstable();
            assert_eq!(got, want);
        }
    }

    #[test]
    fn masks_and_the_last_plane_save_tests() {
        let scene = crowd(80, 3);
        let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
        let mut rng = Prng::new(7, 0);
        let (mut first, mut again, mut brutal) = (0, 0, 0);
        for _ in 0..50 {
            let frustum = Frustum::new(&random_view(&mut rng, 0.1));
            let mut culler = FrustumCuller::default();
            culler.cull(&tree, &frustum);
            first += culler.stats().plane_tests;
            culler.cull(&tree, &frustum);
            again += culler.stats().plane_tests;
            brutal += brute(&tree, &frustum).1;
        }
        assert!(first < brutal && again < first, "{again}, {first} and {brutal}");
    }
}
