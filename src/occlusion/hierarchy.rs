//! Bounding volume hierarchies over a scene's objects: binary ones built top down, and those given or divided by a client.
//!
//! Based on: Ivson 2006, chapter 4.2: a node's objects are divided by their boxes' centres, across the longest axis of the node's box;
//! depth at most 1.2 log2 n + 2 (Havran 2001). Of his six split positions, only the object median is here: `crates/studies` has the others.
//! Deviation: the median divides the sorted list and not space, so that objects with equal centres are divided, too.

mod given;
mod parts;

use super::bounds::Bounds;
use super::geometry::{Geometry, GeometryObject};
use crate::ObjectId;
use crate::math::geom::Aabb;
use crate::math::parallel;
use parts::Parts;
use std::ops::Range;

#[cfg(feature = "bake")]
pub use given::Divide;
#[cfg(not(feature = "bake"))]
use given::Divide;
pub use given::{Tree, TreeFault};

/// Options of a tree.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct HierarchyOptions {
    /// Least triangles on each side of a split; 0 or 1 split down to single objects. Higher: fewer queries, each for more objects. Ivson's
    /// tests have 1,000 vertices.
    pub least_triangles: u64,
}

impl Default for HierarchyOptions {
    fn default() -> Self {
        Self { least_triangles: 1 }
    }
}

/// A node; the root is node 0, children come after their parents.
#[derive(Clone, PartialEq, Debug)]
pub struct Node {
    /// Box around all triangles of its objects. If boxes are not axis-aligned, a child's may extend beyond its parent's.
    pub bounds: Bounds,
    /// `None` for the root.
    pub parent: Option<u32>,
    /// Depth; the root has 0.
    pub level: u32,
    /// Number of its objects' triangles.
    pub triangles: u64,
    children: [u32; 2],
    objects: [u32; 2],
}

impl Node {
    /// Numbers of its children; empty for a leaf.
    #[inline]
    pub fn children(&self) -> Range<u32> {
        self.children[0]..self.children[1]
    }

    /// Whether it has no children.
    #[inline]
    pub fn is_leaf(&self) -> bool {
        self.children[0] == self.children[1]
    }
}

/// A tree over a scene's objects.
#[derive(Clone, PartialEq, Debug)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    objects: Vec<ObjectId>,
    /// Boxes of parts of objects, if queries of leaves use these.
    parts: Option<Parts>,
}

impl Hierarchy {
    /// A binary tree of axis-aligned boxes: each node's objects are divided at their median. The same model gives the same tree.
    pub fn build<'a>(model: impl Into<Geometry<'a>>, options: &HierarchyOptions) -> Self {
        let model = model.into();
        let around = |o: &GeometryObject| Aabb::of(o.triangles.clone().flat_map(|t| model.corners(t as usize)));
        let triangles = model.objects.iter().map(|o| u64::from(o.triangles.end - o.triangles.start)).collect();
        Self::binary(&Shapes { boxes: parallel::map(&model.objects, around), triangles }, options)
    }

    /// The same for objects given by their boxes (metres) and numbers of triangles: object `i` is the `i`th of both.
    pub fn of_boxes(boxes: &[Aabb], triangles: &[u32], options: &HierarchyOptions) -> Self {
        Self::binary(&Shapes::new(boxes, triangles), options)
    }

    fn binary(shapes: &Shapes, options: &HierarchyOptions) -> Self {
        let most = levels(shapes.boxes.len());
        Self::grow(shapes, &mut Halves { shapes, most, least_triangles: options.least_triangles })
    }

    /// Builds the tree from the root down, level by level, with `divide`.
    fn grow(shapes: &Shapes, divide: &mut impl Divide) -> Self {
        let mut objects: Vec<ObjectId> = (0..shapes.boxes.len() as u32).map(ObjectId).collect();
        let mut nodes = Vec::new();
        if !objects.is_empty() {
            nodes.push(shapes.node(divide, &objects, 0, None));
        }
        let mut at = 0;
        while at < nodes.len() {
            let [mut start, end] = nodes[at].objects;
            let parts = parts_of(divide, &nodes[at], &mut objects[start as usize..end as usize]);
            let first = nodes.len() as u32;
            for part in parts {
                let of_part = &objects[start as usize..start as usize + part];
                nodes.push(shapes.node(divide, of_part, start, Some((at as u32, nodes[at].level))));
                start += part as u32;
            }
            nodes[at].children = [first, nodes.len() as u32];
            at += 1;
        }
        Self { nodes, objects, parts: None }
    }

    /// Its nodes, the root first; none for a scene without objects.
    #[inline]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The objects below a node.
    #[inline]
    pub fn objects(&self, node: u32) -> &[ObjectId] {
        let [start, end] = self.nodes[node as usize].objects;
        &self.objects[start as usize..end as usize]
    }

    /// Number of objects.
    pub fn object_count(&self) -> usize {
        self.objects.len()
    }

    /// The level of the deepest node; 0 for a single one.
    pub fn depth(&self) -> u32 {
        self.nodes.iter().map(|n| n.level).max().unwrap_or(0)
    }
}

/// The largest depth of a tree over this many objects.
#[cfg(feature = "bake")]
pub fn most_levels(objects: usize) -> u32 {
    levels(objects)
}

fn levels(objects: usize) -> u32 {
    (1.2 * (objects.max(1) as f64).log2() + 2.0) as u32
}

/// Number of objects of each child of a node: at least two non-empty parts; empty for a leaf.
fn parts_of(divide: &mut impl Divide, node: &Node, objects: &mut [ObjectId]) -> Vec<usize> {
    let (mut rest, mut parts) = (objects.len(), Vec::new());
    for part in divide.divide(node, objects) {
        let part = part.min(rest);
        rest -= part;
        parts.extend((part > 0).then_some(part));
    }
    parts.extend((rest > 0).then_some(rest));
    if parts.len() > 1 { parts } else { Vec::new() }
}

/// The input of a tree, by object.
struct Shapes {
    boxes: Vec<Aabb>,
    triangles: Vec<u64>,
}

impl Shapes {
    fn new(boxes: &[Aabb], triangles: &[u32]) -> Self {
        Self { boxes: boxes.to_vec(), triangles: triangles.iter().map(|&t| u64::from(t)).collect() }
    }

    /// A node of objects from `start`, without children; its parent and the parent's level.
    fn node(&self, divide: &mut impl Divide, objects: &[ObjectId], start: u32, parent: Option<(u32, u32)>) -> Node {
        Node {
            bounds: divide.bounds(objects, self.around(objects)),
            parent: parent.map(|p| p.0),
            level: parent.map_or(0, |p| p.1 + 1),
            triangles: self.triangles(objects),
            children: [0; 2],
            objects: [start, start + objects.len() as u32],
        }
    }

    /// Axis-aligned box around objects.
    fn around(&self, objects: &[ObjectId]) -> Bounds {
        if let [object] = objects {
            return Bounds::from(self.boxes[object.index()]);
        }
        let corners = |o: &ObjectId| [self.boxes[o.index()].min, self.boxes[o.index()].max];
        Bounds::from(Aabb::of(objects.iter().flat_map(corners)))
    }

    fn triangles(&self, objects: &[ObjectId]) -> u64 {
        objects.iter().map(|o| self.triangles[o.index()]).sum()
    }
}

/// Divides into halves with equal numbers of objects, across the longest axis of the node's box.
struct Halves<'s> {
    shapes: &'s Shapes,
    /// The deepest level.
    most: u32,
    least_triangles: u64,
}

impl Divide for Halves<'_> {
    fn divide(&mut self, node: &Node, objects: &mut [ObjectId]) -> Vec<usize> {
        if node.level >= self.most || objects.len() < 2 {
            return Vec::new();
        }
        let axis = node.bounds.longest();
        let at = |o: &ObjectId| axis.dot(self.shapes.boxes[o.index()].centre());
        // Ties by number.
        objects.sort_unstable_by(|a, b| at(a).total_cmp(&at(b)).then(a.cmp(b)));
        let (left, right) = objects.split_at(objects.len() / 2);
        let fewest = self.shapes.triangles(left).min(self.shapes.triangles(right));
        if fewest < self.least_triangles { Vec::new() } else { vec![left.len(), right.len()] }
    }
}

#[cfg(test)]
mod tests {
    use super::super::scenes::{crowd, row};
    use super::*;
    use crate::types::scene::Scene;

    /// Every object is in one leaf; parents' objects are their children's; boxes contain everything below.
    fn check(tree: &Hierarchy, scene: &Scene) {
        let mut found = vec![0; scene.objects.len()];
        for (n, node) in tree.nodes().iter().enumerate() {
            let objects = tree.objects(n as u32);
            assert!(!objects.is_empty());
            if node.is_leaf() {
                objects.iter().for_each(|o| found[o.index()] += 1);
            } else {
                let below: Vec<ObjectId> = node.children().flat_map(|c| tree.objects(c)).copied().collect();
                assert_eq!(objects, below);
            }
            for child in node.children() {
                assert_eq!(tree.nodes()[child as usize].parent, Some(n as u32));
                assert_eq!(tree.nodes()[child as usize].level, node.level + 1);
            }
            for object in objects {
                for t in scene.objects[object.index()].triangles.clone() {
                    assert!(scene.corners(t as usize).iter().all(|&p| node.bounds.distance(p) < 1e-9), "node {n}");
                }
            }
            let triangles =
                |o: &ObjectId| u64::from(scene.objects[o.index()].triangles.end - scene.objects[o.index()].triangles.start);
            assert_eq!(node.triangles, objects.iter().map(triangles).sum::<u64>());
        }
        assert!(found.iter().all(|&f| f == 1));
    }

    #[test]
    fn every_tree_holds_every_object_once_within_the_depth() {
        for (seed, count) in [(0, 1), (1, 2), (2, 7), (3, 60)] {
            let scene = crowd(count, seed);
            let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
            check(&tree, &scene);
            assert!(tree.depth() <= most_levels(count), "{}", tree.depth());
            assert_eq!(tree, Hierarchy::build(&scene, &HierarchyOptions::default()));
        }
    }

    #[test]
    fn the_median_of_objects_is_balanced() {
        let scene = crowd(64, 5);
        let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
        assert_eq!((tree.nodes().len(), tree.depth()), (127, 6));
    }

    /// Cubes at 0, 1, 2 and 10 along x, of half a metre; and two with one centre.
    #[test]
    fn the_first_division_of_a_known_row() {
        let tree = |scene: &Scene| Hierarchy::build(scene, &HierarchyOptions::default());
        let even = tree(&row(&[(0.0, 1), (1.0, 1), (2.0, 1), (10.0, 1)]));
        assert_eq!(even.objects(1).iter().map(|o| o.0).collect::<Vec<_>>(), [0, 1]);
        let mut scene = row(&[(0.0, 1), (0.0, 1)]);
        scene.positions[..8].iter_mut().for_each(|p| *p *= 10.0);
        assert_eq!(tree(&scene).nodes().len(), 3);
    }

    #[test]
    fn leaves_have_the_least_triangles_asked_for() {
        let scene = crowd(60, 4);
        let tree = Hierarchy::build(&scene, &HierarchyOptions { least_triangles: 100 });
        check(&tree, &scene);
        assert!(tree.nodes().len() > 3 && tree.nodes().iter().all(|n| n.triangles >= 100));
    }
}
