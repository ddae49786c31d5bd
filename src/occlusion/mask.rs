//! Some of a tree's objects, and the nodes that have one of them below: what is left to a culler after others have had their say.

use super::hierarchy::Hierarchy;
use super::view::Frustum;
use crate::ObjectId;

/// A set of a tree's objects. Setting it takes time with the number of its objects, and no memory.
#[derive(Clone, Debug)]
pub struct Mask {
    /// The leaf of each object.
    leaves: Vec<u32>,
    /// The last setting that had it.
    objects: Vec<u32>,
    nodes: Vec<u32>,
    setting: u32,
}

impl Mask {
    /// Of a tree, none of its objects.
    pub fn new(tree: &Hierarchy) -> Self {
        let mut leaves = vec![0; tree.object_count()];
        for node in (0..tree.nodes().len() as u32).filter(|&n| tree.nodes()[n as usize].is_leaf()) {
            tree.objects(node).iter().for_each(|o| leaves[o.index()] = node);
        }
        Self { objects: vec![0; leaves.len()], nodes: vec![0; tree.nodes().len()], leaves, setting: 1 }
    }

    /// Takes these objects and no others; the tree is that of [`Self::new`].
    pub fn set(&mut self, tree: &Hierarchy, objects: &[ObjectId]) {
        if self.setting == u32::MAX {
            self.setting = 0;
            self.objects.fill(0);
            self.nodes.fill(0);
        }
        self.setting += 1;
        for object in objects {
            self.objects[object.index()] = self.setting;
            let mut next = Some(self.leaves[object.index()]);
            while let Some(node) = next.filter(|&n| self.nodes[n as usize] != self.setting) {
                self.nodes[node as usize] = self.setting;
                next = tree.nodes()[node as usize].parent;
            }
        }
    }

    /// Whether it has an object.
    #[inline]
    pub fn has(&self, object: ObjectId) -> bool {
        self.objects[object.index()] == self.setting
    }

    /// Whether it has an object below a node.
    #[inline]
    pub fn has_below(&self, node: u32) -> bool {
        self.nodes[node as usize] == self.setting
    }
}

/// What is culled: of a tree, what is in a frustum and in a mask, if there is one.
#[derive(Clone, Copy, Debug)]
pub struct Scope<'t> {
    /// The tree.
    pub tree: &'t Hierarchy,
    /// What the camera sees of space.
    pub frustum: &'t Frustum,
    /// Of that tree. What isn't in it isn't drawn, and hides nothing.
    pub mask: Option<&'t Mask>,
}

#[cfg(test)]
mod tests {
    use super::super::hierarchy::HierarchyOptions;
    use super::super::scenes::crowd;
    use super::*;

    #[test]
    fn a_node_is_in_it_where_an_object_below_is() {
        let scene = crowd(40, 1);
        // Some leaves have several objects.
        let tree = Hierarchy::build(&scene, &HierarchyOptions { least_triangles: 30 });
        let mut mask = Mask::new(&tree);
        assert!((0..40).all(|o| !mask.has(ObjectId(o))), "none at first");
        for seed in 0..20u32 {
            let objects: Vec<ObjectId> = (0..40).filter(|o| (o * 7 + seed) % 11 < seed % 5).map(ObjectId).collect();
            mask.set(&tree, &objects);
            for node in 0..tree.nodes().len() as u32 {
                assert_eq!(mask.has_below(node), tree.objects(node).iter().any(|o| objects.contains(o)));
            }
            assert!((0..40).map(ObjectId).all(|o| mask.has(o) == objects.contains(&o)));
        }
    }
}
