//! Trees of boxes over a scene's objects: binary ones built from the top down, and those that a scene graph gives.
//!
//! Based on: Ivson 2006, chapter 4.2: six places for the plane that divides a node's objects by their boxes' middles, across the longest
//! axis of the node's box; depth at most 1.2 log2 n + 2 (Havran 2001); SAH (MacDonald, Booth 1990) weighted by triangles,
//! with a stop factor of 0.85. Deviations: medians of objects and of triangles divide the sorted list and not space, so that objects with
//! one middle are parted, too; SAH takes the areas of boxes along the node's own axes, swept once along each of the three, where
//! Ivson fits every candidate's box anew (quadratic).

mod given;
mod parts;
#[path = "../../crates/studies/src/trees.rs"]
mod split;

#[cfg(feature = "bake")]
use super::bounds::Hull;
use super::bounds::{Bounds, Fit};
use crate::ObjectId;
use crate::geom::Aabb;
use crate::parallel;
use crate::types::scene::{Object, Scene};
use glam::DVec3;
use parts::Parts;
use std::ops::Range;

pub use given::{Divide, Tree, TreeFault};
pub use split::Split;

/// How to build a tree.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct HierarchyOptions {
    /// Boxes of objects and nodes.
    pub fit: Fit,
    /// Where nodes are divided.
    pub split: Split,
    /// A division that leaves a side with fewer triangles than this isn't made; 0 or 1 divide down to single objects. Higher:
    /// fewer queries, each about more. Ivson's tests have 1,000 vertices.
    pub least_triangles: u64,
}

impl Default for HierarchyOptions {
    /// Not SAH: one large object, such as the ground, makes a side as large as the whole, and the tree ends at its root.
    fn default() -> Self {
        Self { fit: Fit::Aligned, split: Split::ObjectMedian, least_triangles: 1 }
    }
}

/// A node; the root is node 0, children come after their parents.
#[derive(Clone, PartialEq, Debug)]
pub struct Node {
    /// Around all triangles of its objects. Of boxes that aren't aligned, a child's may reach out of its parent's.
    pub bounds: Bounds,
    /// `None` for the root.
    pub parent: Option<u32>,
    /// How far from the root, which is at 0.
    pub level: u32,
    /// Its objects' triangles.
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
    /// Of objects, where questions about leaves are to be about these.
    parts: Option<Parts>,
}

impl Hierarchy {
    /// A binary tree. The same scene and options give the same tree.
    pub fn build(scene: &Scene, options: &HierarchyOptions) -> Self {
        Self::binary(&Shapes::new(scene, options.fit), options)
    }

    /// A binary tree of boxes along the axes, over objects of which nothing is known but their boxes (metres) and how many triangles they
    /// have: object `i` is the `i`th of both. `options.fit` isn't looked at.
    pub fn of_boxes(boxes: &[Aabb], triangles: &[u32], options: &HierarchyOptions) -> Self {
        Self::binary(&Shapes::of_boxes(boxes, triangles), options)
    }

    fn binary(shapes: &Shapes, options: &HierarchyOptions) -> Self {
        let count = shapes.triangles.len();
        let most = most_levels(count);
        Self::grow(shapes, (0..count as u32).map(ObjectId).collect(), |node, objects| {
            if node.level >= most || objects.len() < 2 {
                return Vec::new();
            }
            let Some(left) = split::split(options.split, node, objects, shapes) else { return Vec::new() };
            let [a, b] = [&objects[..left], &objects[left..]].map(|o| shapes.triangles(o));
            if a.min(b) < options.least_triangles { Vec::new() } else { vec![left, objects.len() - left] }
        })
    }

    /// The tree of a scene graph: `levels[k][object]` names the group at level `k + 1` that holds an object, within that of the level
    /// above; below the last level every object is a leaf. So two lists make a graph of four levels. Panics where a list isn't as long as
    /// the scene's objects.
    pub fn from_levels(scene: &Scene, fit: Fit, levels: &[Vec<u32>]) -> Self {
        assert!(levels.iter().all(|l| l.len() == scene.objects.len()), "a group for every object");
        let mut objects: Vec<ObjectId> = (0..scene.objects.len() as u32).map(ObjectId).collect();
        objects.sort_by_key(|o| (levels.iter().map(|l| l[o.index()]).collect::<Vec<_>>(), *o));
        Self::grow(&Shapes::new(scene, fit), objects, |node, objects| match levels.get(node.level as usize) {
            Some(level) => objects.chunk_by(|a, b| level[a.index()] == level[b.index()]).map(<[_]>::len).collect(),
            None if node.level as usize == levels.len() => vec![1; objects.len()],
            None => Vec::new(),
        })
    }

    /// From the root down, level by level; `divide` orders a node's objects and says how many of them each child gets.
    fn grow(
        shapes: &Shapes,
        mut objects: Vec<ObjectId>,
        mut divide: impl FnMut(&Node, &mut [ObjectId]) -> Vec<usize>,
    ) -> Self {
        let node = |objects: &[ObjectId], start: u32, parent: Option<u32>, level: u32| Node {
            bounds: shapes.bounds(objects),
            parent,
            level,
            triangles: shapes.triangles(objects),
            children: [0; 2],
            objects: [start, start + objects.len() as u32],
        };
        let mut nodes = Vec::new();
        if !objects.is_empty() {
            nodes.push(node(&objects, 0, None, 0));
        }
        let mut at = 0;
        while at < nodes.len() {
            let [mut start, end] = nodes[at].objects;
            let parts = divide(&nodes[at], &mut objects[start as usize..end as usize]);
            let first = nodes.len() as u32;
            for part in parts {
                let of_part = &objects[start as usize..start as usize + part];
                nodes.push(node(of_part, start, Some(at as u32), nodes[at].level + 1));
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

    /// How many objects there are.
    pub fn object_count(&self) -> usize {
        self.objects.len()
    }

    /// The level of the deepest node; 0 for a single one.
    pub fn depth(&self) -> u32 {
        self.nodes.iter().map(|n| n.level).max().unwrap_or(0)
    }
}

/// The deepest level that a tree over so many objects may have.
pub fn most_levels(objects: usize) -> u32 {
    (1.2 * (objects.max(1) as f64).log2() + 2.0) as u32
}

/// What boxes are fitted to, by object.
struct Shapes {
    fit: Fit,
    /// All corners of triangles (covariance), those of the convex hull (hull, minimum), or of the box (aligned).
    points: Vec<Vec<DVec3>>,
    /// The objects' own boxes.
    bounds: Vec<Bounds>,
    middles: Vec<DVec3>,
    triangles: Vec<u64>,
}

impl Shapes {
    fn new(scene: &Scene, fit: Fit) -> Self {
        let shape = |object: &Object| {
            let corners: Vec<DVec3> = object.triangles.clone().flat_map(|t| scene.corners(t as usize)).collect();
            match fit {
                Fit::Aligned => {
                    let aabb = Aabb::of(corners);
                    (vec![aabb.min, aabb.max], Bounds::from(aabb))
                }
                Fit::Covariance => {
                    let bounds = Bounds::fit(&corners, fit).expect("an object has triangles");
                    (corners, bounds)
                }
                #[cfg(feature = "bake")]
                Fit::Hull | Fit::Minimum => {
                    let points = Hull::new(&corners).points;
                    let bounds = Bounds::fit(&points, fit).expect("an object has triangles");
                    (points, bounds)
                }
            }
        };
        let shapes: Vec<(Vec<DVec3>, Bounds)> = parallel::map(&scene.objects, shape);
        let (points, bounds): (Vec<_>, Vec<_>) = shapes.into_iter().unzip();
        Self {
            fit,
            middles: bounds.iter().map(|b| b.centre).collect(),
            points,
            bounds,
            triangles: scene.objects.iter().map(|o| u64::from(o.triangles.end - o.triangles.start)).collect(),
        }
    }

    fn of_boxes(boxes: &[Aabb], triangles: &[u32]) -> Self {
        Self {
            fit: Fit::Aligned,
            points: boxes.iter().map(|b| vec![b.min, b.max]).collect(),
            bounds: boxes.iter().map(|&b| Bounds::from(b)).collect(),
            middles: boxes.iter().map(Aabb::centre).collect(),
            triangles: triangles.iter().map(|&t| u64::from(t)).collect(),
        }
    }

    /// Box around some objects.
    fn bounds(&self, objects: &[ObjectId]) -> Bounds {
        if let [object] = objects {
            return self.bounds[object.index()];
        }
        let points: Vec<DVec3> = objects.iter().flat_map(|o| &self.points[o.index()]).copied().collect();
        Bounds::fit(&points, self.fit).expect("an object has triangles")
    }

    fn triangles(&self, objects: &[ObjectId]) -> u64 {
        objects.iter().map(|o| self.triangles[o.index()]).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::scenes::{crowd, row};
    use super::*;

    fn options(fit: Fit, split: Split) -> HierarchyOptions {
        HierarchyOptions { fit, split, ..HierarchyOptions::default() }
    }

    /// Every object is in one leaf; parents' objects are their children's; boxes hold all that is below.
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
            for fit in Fit::ALL {
                for split in Split::ALL {
                    let tree = Hierarchy::build(&scene, &options(fit, split));
                    check(&tree, &scene);
                    assert!(tree.depth() <= most_levels(count), "{fit:?} {split:?}: {}", tree.depth());
                    assert_eq!(tree, Hierarchy::build(&scene, &options(fit, split)));
                }
            }
        }
    }

    #[test]
    fn the_median_of_objects_is_balanced() {
        let scene = crowd(64, 5);
        let tree = Hierarchy::build(&scene, &options(Fit::Aligned, Split::ObjectMedian));
        assert_eq!((tree.nodes().len(), tree.depth()), (127, 6));
    }

    /// Cubes at 0, 1, 2 and 10 along x, of half a metre: where each plane goes is known.
    #[test]
    fn the_first_division_of_a_known_row() {
        let first = |split, scene: &Scene| {
            let tree = Hierarchy::build(scene, &options(Fit::Aligned, split));
            tree.objects(1).iter().map(|o| o.0).collect::<Vec<_>>()
        };
        let even = row(&[(0.0, 1), (1.0, 1), (2.0, 1), (10.0, 1)]);
        assert_eq!(first(Split::ObjectMedian, &even), [0, 1]);
        // Middle of the box and of the outermost middles: 5.
        assert_eq!(first(Split::SpatialMedian, &even), [0, 1, 2]);
        assert_eq!(first(Split::CentreMedian, &even), [0, 1, 2]);
        // Mean of the middles: 3.25.
        assert_eq!(first(Split::CentreMean, &even), [0, 1, 2]);
        assert_eq!(first(Split::EqualComplexity, &even), [0, 1]);
        // Areas times triangles: far less where the three are together.
        assert_eq!(first(Split::Sah, &even), [0, 1, 2]);
        // The first has as many triangles as the others together.
        let heavy = row(&[(0.0, 3), (1.0, 1), (2.0, 1), (10.0, 1)]);
        assert_eq!(first(Split::EqualComplexity, &heavy), [0]);
        // The mean moves with the crowd, the middle of the box doesn't.
        let crowded = row(&[(0.0, 1), (6.0, 1), (9.0, 1), (10.0, 1), (10.5, 1)]);
        assert_eq!(first(Split::CentreMean, &crowded), [0, 1]);
        assert_eq!(first(Split::CentreMedian, &crowded), [0]);
    }

    #[test]
    fn sah_stops_where_a_side_is_nearly_as_large_as_the_whole() {
        // One inside the other: whatever is parted, a side is as large as the whole.
        let mut scene = row(&[(0.0, 1), (0.0, 1)]);
        scene.positions[..8].iter_mut().for_each(|p| *p *= 10.0);
        assert_eq!(Hierarchy::build(&scene, &options(Fit::Aligned, Split::Sah)).nodes().len(), 1);
        assert_eq!(Hierarchy::build(&scene, &options(Fit::Aligned, Split::ObjectMedian)).nodes().len(), 3);
    }

    #[test]
    fn leaves_have_the_least_triangles_asked_for() {
        let scene = crowd(60, 4);
        let asked = HierarchyOptions { least_triangles: 100, ..HierarchyOptions::default() };
        let tree = Hierarchy::build(&scene, &asked);
        check(&tree, &scene);
        assert!(tree.nodes().len() > 3 && tree.nodes().iter().all(|n| n.triangles >= 100));
    }

    #[test]
    fn given_levels_are_the_tree() {
        let scene = row(&[(0.0, 1), (1.0, 1), (2.0, 1), (3.0, 1), (4.0, 1)]);
        // Group 1 of the first level and group 1 of the second aren't the same.
        let tree = Hierarchy::from_levels(&scene, Fit::Aligned, &[vec![1, 0, 1, 0, 0], vec![1, 1, 2, 1, 2]]);
        check(&tree, &scene);
        assert_eq!(tree.depth(), 3);
        let groups = |level| {
            let of_level = tree.nodes().iter().enumerate().filter(move |n| n.1.level == level);
            of_level.map(|(n, _)| tree.objects(n as u32).iter().map(|o| o.0).collect::<Vec<_>>()).collect::<Vec<_>>()
        };
        assert_eq!(groups(1), [vec![1, 3, 4], vec![0, 2]]);
        assert_eq!(groups(2), [vec![1, 3], vec![4], vec![0], vec![2]]);
        assert_eq!(groups(3), [[1], [3], [4], [0], [2]]);
    }
}
