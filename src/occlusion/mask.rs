//! A subset of a tree's objects, with the nodes above them: the objects that earlier stages of culling left.

use super::hierarchy::Hierarchy;
use super::view::Frustum;
use crate::ObjectId;

/// A set of a tree's objects. Setting it is linear in the number of its objects, and allocates nothing.
#[derive(Clone, Debug)]
pub struct Mask {
    /// The leaf of each object.
    leaves: Vec<u32>,
    /// The last setting that contains each object.
    objects: Vec<u32>,
    nodes: Vec<u32>,
    setting: u32,
}

impl Mask {
    /// An empty set for a tree.
    pub fn new(tree: &Hierarchy) -> Self {
        let mut leaves = vec![0; tree.object_count()];
        for node in (0..tree.nodes().len() as u32).filter(|&n| tree.nodes()[n as usize].is_leaf()) {
            tree.objects(node).iter().for_each(|o| leaves[o.index()] = node);
        }
        Self { objects: vec![0; leaves.len()], nodes: vec![0; tree.nodes().len()], leaves, setting: 1 }
    }

    /// Sets exactly these objects; the tree is that of [`Self::new`].
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

    /// Whether it contains an object.
    #[inline]
    pub fn has(&self, object: ObjectId) -> bool {
        self.objects[object.index()] == self.setting
    }

    /// Whether it contains an object below a node.
    #[inline]
    pub fn has_below(&self, node: u32) -> bool {
        self.nodes[node as usize] == self.setting
    }
}

/// The input of culling: a tree, a frustum, and an optional mask.
#[derive(Clone, Copy, Debug)]
pub struct Scope<'t> {
    /// The tree.
    pub tree: &'t Hierarchy,
    /// The camera's frustum.
    pub frustum: &'t Frustum,
    /// A mask of that tree. Other objects are not drawn, and hide nothing.
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
