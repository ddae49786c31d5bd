//! Leaves that are drawn or not by their last answer, from whatever frame that is.

use super::Culled;
use enfilade::ObjectId;
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::view::Frustum;

/// Frames between two questions about one that showed: OpenSceneGraph's.
const INTERVAL: u64 = 5;

#[derive(Default)]
pub struct LateRule {
    frame: u64,
    culler: FrustumCuller,
    /// By object: its leaf.
    leaves: Vec<u32>,
    /// By object: whether its last answer was that it is hidden, and the last frame in which it was in the frustum.
    states: Vec<(bool, u64)>,
}

impl LateRule {
    pub fn cull(&mut self, tree: &Hierarchy, frustum: &Frustum, oracle: &mut impl OcclusionOracle) -> Culled {
        self.frame += 1;
        if self.leaves.is_empty() {
            self.states.resize(tree.object_count(), (false, 0));
            self.leaves.resize(tree.object_count(), 0);
            for node in (0..tree.nodes().len() as u32).filter(|&n| tree.nodes()[n as usize].is_leaf()) {
                tree.objects(node).iter().for_each(|o| self.leaves[o.index()] = node);
            }
        }
        let mut objects: Vec<ObjectId> = self.culler.cull(tree, frustum).to_vec();
        let distance = |o: &ObjectId| tree.nodes()[self.leaves[o.index()] as usize].bounds.distance(frustum.eye());
        objects.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let (mut drawn, mut asked) = (Vec::new(), Vec::new());
        for object in objects {
            let (leaf, (is_hidden, seen)) = (self.leaves[object.index()], &mut self.states[object.index()]);
            // What comes into the frustum is drawn.
            *is_hidden &= *seen + 1 == self.frame;
            *seen = self.frame;
            let is_near = frustum.meets_near(&tree.nodes()[leaf as usize].bounds);
            if !*is_hidden || is_near {
                oracle.draw(object);
                drawn.push(object);
            }
            if !is_near && (*is_hidden || (self.frame + u64::from(object.0)).is_multiple_of(INTERVAL)) {
                asked.push((object, oracle.issue(std::slice::from_ref(&tree.nodes()[leaf as usize].bounds))));
            }
        }
        let queries = asked.len() as u64;
        for (object, query) in asked {
            self.states[object.index()].0 = !oracle.poll(query).expect("an answer at once");
        }
        (drawn, queries)
    }
}
