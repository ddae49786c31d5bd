//! A client's own tree or own division: an octree, a grid, an engine's scene graph.
//!
//! A tree is copied once. Its faults are reported and repaired, so that every visible object is drawn.

mod boxes;

#[cfg(feature = "bake")]
use super::Shapes;
use super::{Hierarchy, Node};
use crate::ObjectId;
#[cfg(feature = "bake")]
use crate::math::geom::Aabb;
use crate::occlusion::bounds::Bounds;
use boxes::{around, holding, is_box};
use glam::DVec3;
use std::collections::HashSet;
use std::fmt;
use std::hash::Hash;

/// Most nodes of a client's tree: a number per object, plus a base; beyond it the tree counts as endless. Lower: sparse octrees with many
/// empty nodes are cut. Higher: an endless tree takes more memory.
const MOST_NODES: [usize; 2] = [64, 4096];

/// Replaces an invalid box of an object: it contains every eye, so it is never queried. Larger: products of three lengths leave the range
/// of `f32`. Smaller: an eye may be outside.
const EVERYWHERE: Bounds = Bounds { centre: DVec3::ZERO, axes: DVec3::AXES, half: DVec3::splat(1e12) };

/// A client's tree of boxes over objects. Inner nodes may have objects, too.
pub trait Tree {
    /// Identifies a node uniquely.
    type Node: Copy + Eq + Hash;

    /// The root; `None` for an empty tree.
    fn root(&self) -> Option<Self::Node>;

    /// The box around everything below a node, metres. It may have any axes, and be larger than necessary.
    fn bounds(&self, node: Self::Node) -> Bounds;

    /// Appends the children of a node.
    fn children(&self, node: Self::Node, out: &mut Vec<Self::Node>);

    /// Appends the objects of a node, without those of its children.
    fn objects(&self, node: Self::Node, out: &mut Vec<ObjectId>);
}

/// A fault of a client's tree, and its repair.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TreeFault<N> {
    /// A node is reached twice: by a cycle, or from two parents. Its first place counts.
    Again(N),
    /// A box with non-finite numbers, or axes that are not orthonormal. It is recomputed.
    NoBox(N),
    /// An invalid box of an object. The object is always drawn, as a child of the root.
    NoObjectBox(ObjectId),
    /// A box that does not contain everything below the node. It is recomputed.
    Short(N),
    /// A node has an object that does not exist. It is left out.
    Unknown(N, ObjectId),
    /// A node has an object that another one has, too. Its first place counts.
    Twice(N, ObjectId),
    /// An object in no node. It becomes a child of the root.
    Missing(ObjectId),
    /// A node with too many nodes below. These count as missing.
    Endless(N),
}

impl<N: fmt::Debug> fmt::Display for TreeFault<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Again(node) => write!(f, "node {node:?} is reached twice; its first place counts"),
            Self::NoBox(node) => write!(f, "node {node:?} has an invalid box; it is computed again"),
            Self::NoObjectBox(object) => write!(f, "object {object} has an invalid box; it is always drawn"),
            Self::Short(node) => write!(f, "the box of node {node:?} doesn't hold its descendants; it is computed again"),
            Self::Unknown(node, object) => write!(f, "node {node:?} holds object {object}, which doesn't exist"),
            Self::Twice(node, object) => {
                write!(f, "node {node:?} holds object {object}, as does another node; the first one keeps it")
            }
            Self::Missing(object) => write!(f, "object {object} is in no node; it becomes a child of the root"),
            Self::Endless(node) => write!(f, "node {node:?} has too many descendants; the rest count as missing"),
        }
    }
}

/// A client's way to divide a node's objects.
pub trait Divide {
    /// Orders a node's objects, and returns the number of objects of each child, in that order; empty, or a single part, for a leaf. Empty
    /// parts are dropped, and the remaining objects are one more part.
    fn divide(&mut self, node: &Node, objects: &mut [ObjectId]) -> Vec<usize>;

    /// The box around at least one object: the axis-aligned box `aligned`, unless the client knows a tighter one. Parts of objects outside
    /// the box may be missing in frames.
    fn bounds(&mut self, _objects: &[ObjectId], aligned: Bounds) -> Bounds {
        aligned
    }
}

impl Hierarchy {
    /// A tree divided by a client, for objects given by their boxes (metres) and numbers of triangles: object `i` is the `i`th of both.
    /// Panics if `divide` changes the set of objects, or if the lists have different lengths.
    #[cfg(feature = "bake")]
    pub fn divided(boxes: &[Aabb], triangles: &[u32], divide: &mut impl Divide) -> Self {
        assert_eq!(boxes.len(), triangles.len(), "a box and a number of triangles for each object");
        let tree = Self::grow(&Shapes::new(boxes, triangles), divide);
        let mut held = tree.objects.clone();
        held.sort_unstable();
        let all = (0..boxes.len() as u32).map(ObjectId);
        assert!(held.into_iter().eq(all), "the division keeps the set of objects");
        tree
    }

    /// A client's tree, for objects given by their boxes (metres) and numbers of triangles, and its faults. Panics if the lists have
    /// different lengths.
    pub fn of_tree<T: Tree>(tree: &T, boxes: &[Bounds], triangles: &[u32]) -> (Self, Vec<TreeFault<T::Node>>) {
        assert_eq!(boxes.len(), triangles.len(), "a box and a number of triangles for each object");
        let mut copy = Copied { nodes: Vec::new(), faults: Vec::new(), taken: vec![false; boxes.len()] };
        let boxes: Vec<Bounds> = boxes.iter().map(|&b| if is_box(&b) { b } else { EVERYWHERE }).collect();
        copy.read(tree, &boxes);
        copy.complete();
        copy.measure(&boxes, triangles);
        (copy.laid_out(), copy.faults)
    }
}

/// A node of the client's tree.
struct Given<N> {
    /// `None` for added nodes.
    name: Option<N>,
    bounds: Bounds,
    children: Vec<usize>,
    objects: Vec<ObjectId>,
    /// Objects and triangles below it, after `measure`.
    count: usize,
    triangles: u64,
}

impl<N> Given<N> {
    fn new(name: Option<N>, bounds: Bounds, objects: Vec<ObjectId>) -> Self {
        Self { name, bounds, children: Vec::new(), objects, count: 0, triangles: 0 }
    }
}

/// The copy of a client's tree. Children come after their parents.
struct Copied<N> {
    nodes: Vec<Given<N>>,
    faults: Vec<TreeFault<N>>,
    /// By object: whether a node has it.
    taken: Vec<bool>,
}

impl<N: Copy + Eq + Hash> Copied<N> {
    /// Reads each node once.
    fn read(&mut self, tree: &impl Tree<Node = N>, boxes: &[Bounds]) {
        let most = MOST_NODES[0] * self.taken.len() + MOST_NODES[1];
        let (mut known, mut children, mut objects) = (HashSet::new(), Vec::new(), Vec::new());
        let given = |name: N| Given::new(Some(name), tree.bounds(name), Vec::new());
        self.nodes.extend(tree.root().map(given));
        known.extend(tree.root());
        let mut at = 0;
        while let Some(name) = self.nodes.get(at).and_then(|node| node.name) {
            tree.objects(name, &mut objects);
            for object in objects.drain(..) {
                match self.taken.get_mut(object.index()) {
                    None => self.faults.push(TreeFault::Unknown(name, object)),
                    Some(true) => self.faults.push(TreeFault::Twice(name, object)),
                    // It would make the boxes of all its ancestors useless.
                    Some(_) if boxes[object.index()] == EVERYWHERE => {}
                    Some(taken) => {
                        *taken = true;
                        self.nodes[at].objects.push(object);
                    }
                }
            }
            tree.children(name, &mut children);
            if self.nodes.len() + children.len() > most {
                self.faults.push(TreeFault::Endless(name));
                children.clear();
            }
            for child in children.drain(..) {
                if known.insert(child) {
                    let number = self.nodes.len();
                    self.nodes.push(given(child));
                    self.nodes[at].children.push(number);
                } else {
                    self.faults.push(TreeFault::Again(child));
                }
            }
            at += 1;
        }
        let everywhere = boxes.iter().enumerate().filter(|(_, b)| **b == EVERYWHERE);
        self.faults.extend(everywhere.map(|(object, _)| TreeFault::NoObjectBox(ObjectId(object as u32))));
    }

    /// Puts every object into a leaf: objects in no node go below the root; those of inner nodes, below these.
    fn complete(&mut self) {
        let missing: Vec<ObjectId> =
            (0u32..).zip(&self.taken).filter(|(_, taken)| !**taken).map(|(o, _)| ObjectId(o)).collect();
        for &object in &missing {
            let is_named = self.faults.iter().any(|f| matches!(f, TreeFault::NoObjectBox(named) if *named == object));
            self.faults.extend((!is_named).then_some(TreeFault::Missing(object)));
        }
        if !missing.is_empty() && self.nodes.is_empty() {
            self.nodes.push(Given::new(None, EVERYWHERE, Vec::new()));
        }
        for object in missing {
            self.add(0, vec![object]);
        }
        for at in 0..self.nodes.len() {
            if !self.nodes[at].children.is_empty() && !self.nodes[at].objects.is_empty() {
                let objects = std::mem::take(&mut self.nodes[at].objects);
                self.add(at, objects);
            }
        }
    }

    /// Adds a leaf.
    fn add(&mut self, parent: usize, objects: Vec<ObjectId>) {
        let number = self.nodes.len();
        self.nodes.push(Given::new(None, EVERYWHERE, objects));
        self.nodes[parent].children.push(number);
    }

    /// From the leaves up: drops empty nodes, counts, and recomputes wrong boxes.
    fn measure(&mut self, objects: &[Bounds], triangles: &[u32]) {
        let mut parts = Vec::new();
        for at in (0..self.nodes.len()).rev() {
            let (above, below) = self.nodes.split_at_mut(at + 1);
            let (node, child) = (&mut above[at], |number: usize| &below[number - at - 1]);
            node.children.retain(|&number| child(number).count > 0);
            node.count = node.objects.len() + node.children.iter().map(|&n| child(n).count).sum::<usize>();
            let of_objects = node.objects.iter().map(|o| u64::from(triangles[o.index()]));
            node.triangles = of_objects.chain(node.children.iter().map(|&n| child(n).triangles)).sum();
            if node.count == 0 {
                continue;
            }
            parts.clear();
            parts.extend(node.objects.iter().map(|o| objects[o.index()]));
            parts.extend(node.children.iter().map(|&n| child(n).bounds));
            let Some(name) = node.name else {
                node.bounds = around(&parts);
                continue;
            };
            let is_box = is_box(&node.bounds);
            node.bounds = holding(node.bounds, &parts).filter(|_| is_box).unwrap_or_else(|| {
                self.faults.push(if is_box { TreeFault::Short(name) } else { TreeFault::NoBox(name) });
                around(&parts)
            });
        }
    }

    /// The tree in the layout for cullers: the root first, children contiguous.
    fn laid_out(&self) -> Hierarchy {
        let mut tree = Hierarchy { nodes: Vec::new(), objects: Vec::new(), parts: None };
        let Some(root) = self.nodes.first().filter(|root| root.count > 0) else { return tree };
        let node = |given: &Given<N>, parent: Option<u32>, level: u32, start: u32| {
            let objects = [start, start + given.count as u32];
            Node { bounds: given.bounds, parent, level, triangles: given.triangles, children: [0; 2], objects }
        };
        tree.objects = vec![ObjectId(0); root.count];
        tree.nodes.push(node(root, None, 0, 0));
        let mut copied = vec![0];
        let mut at = 0;
        while at < copied.len() {
            let (given, level, mut start) = (&self.nodes[copied[at]], tree.nodes[at].level, tree.nodes[at].objects[0]);
            let first = tree.nodes.len() as u32;
            for &child in &given.children {
                copied.push(child);
                tree.nodes.push(node(&self.nodes[child], Some(at as u32), level + 1, start));
                start += self.nodes[child].count as u32;
            }
            tree.objects[start as usize..start as usize + given.objects.len()].copy_from_slice(&given.objects);
            tree.nodes[at].children = [first, tree.nodes.len() as u32];
            at += 1;
        }
        tree
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::scenes::{crowd, row, turned_tree};
    use super::super::HierarchyOptions;
    use super::*;
    use crate::types::scene::Scene;

    /// A tree as lists: for each node its box, its children, its objects.
    struct Lists(Vec<(Aabb, Vec<u32>, Vec<u32>)>);

    impl Tree for Lists {
        type Node = u32;

        fn root(&self) -> Option<u32> {
            (!self.0.is_empty()).then_some(0)
        }

        fn bounds(&self, node: u32) -> Bounds {
            self.0[node as usize].0.into()
        }

        fn children(&self, node: u32, out: &mut Vec<u32>) {
            out.extend(&self.0[node as usize].1);
        }

        fn objects(&self, node: u32, out: &mut Vec<ObjectId>) {
            out.extend(self.0[node as usize].2.iter().copied().map(ObjectId));
        }
    }

    fn boxes(scene: &Scene) -> (Vec<Bounds>, Vec<u32>) {
        let triangles = scene.objects.iter().map(|o| o.triangles.len() as u32).collect();
        (scene.objects.iter().map(|o| o.bounds.into()).collect(), triangles)
    }

    /// Cubes of half a metre at 0, 1, 2, 3 along x.
    fn four() -> Scene {
        row(&[(0.0, 1), (1.0, 2), (2.0, 3), (3.0, 4)])
    }

    fn between(from: f64, to: f64) -> Aabb {
        Aabb { min: DVec3::new(from, -0.25, -0.25), max: DVec3::new(to, 0.25, 0.25) }
    }

    /// Returns the objects of each leaf, and checks that every box contains everything below.
    fn check(tree: &Hierarchy, scene: &Scene) -> Vec<Vec<u32>> {
        let mut found = Vec::new();
        for (n, node) in tree.nodes().iter().enumerate() {
            let objects = tree.objects(n as u32);
            assert!(!objects.is_empty());
            for object in objects {
                let corners = Bounds::from(scene.objects[object.index()].bounds).corners();
                assert!(corners.iter().all(|&p| node.bounds.distance(p) < 1e-9), "node {n}");
            }
            let below: Vec<ObjectId> = node.children().flat_map(|c| tree.objects(c)).copied().collect();
            assert!(node.is_leaf() || below == objects, "node {n}");
            for child in node.children() {
                let child = &tree.nodes()[child as usize];
                assert_eq!((child.parent, child.level), (Some(n as u32), node.level + 1));
            }
            let triangles = objects.iter().map(|o| scene.objects[o.index()].triangles.len() as u64);
            assert_eq!(node.triangles, triangles.sum::<u64>());
            if node.is_leaf() {
                found.push(objects.iter().map(|o| o.0).collect());
            }
        }
        let mut all: Vec<u32> = found.iter().flatten().copied().collect();
        all.sort_unstable();
        assert_eq!(all, (0..scene.objects.len() as u32).collect::<Vec<_>>(), "each object once");
        found
    }

    #[test]
    fn a_good_tree_is_taken_as_it_is() {
        let scene = four();
        let (boxes, triangles) = boxes(&scene);
        // An inner node with an object of its own, an empty branch, and boxes larger than necessary.
        let lists = Lists(vec![
            (between(-1.0, 4.0), vec![1, 2, 3], vec![3]),
            (between(-0.5, 1.5), vec![], vec![0, 1]),
            (between(0.0, 0.0), vec![], vec![]),
            (between(1.75, 2.25), vec![], vec![2]),
        ]);
        let (tree, faults) = Hierarchy::of_tree(&lists, &boxes, &triangles);
        assert_eq!(faults, []);
        assert_eq!(check(&tree, &scene), [vec![0, 1], vec![2], vec![3]]);
        assert_eq!(tree.nodes()[0].bounds, between(-1.0, 4.0).into());
        assert_eq!(tree.nodes()[1].bounds, between(-0.5, 1.5).into());
        assert_eq!(tree.nodes()[3].bounds, boxes[3], "its own objects' box");
        let (none, faults) = Hierarchy::of_tree(&Lists(vec![]), &[], &[]);
        assert!(none.nodes().is_empty() && faults.is_empty());
    }

    #[test]
    fn whatever_is_wrong_is_named_and_made_good() {
        let scene = four();
        let (mut boxes, triangles) = boxes(&scene);
        let all = between(-0.25, 3.25);
        let not_a_number = Aabb { min: DVec3::NAN, max: DVec3::ONE };
        let lists = Lists(vec![
            (all, vec![1, 2], vec![9]),
            // A cycle, and a child of two parents.
            (not_a_number, vec![0, 2], vec![0]),
            (between(0.75, 1.25), vec![], vec![1, 2, 0]),
        ]);
        let (tree, mut faults) = Hierarchy::of_tree(&lists, &boxes, &triangles);
        faults.sort_by_key(|fault| format!("{fault:?}"));
        let o = ObjectId;
        use TreeFault::*;
        let expected = [Again(0), Again(2), Missing(o(3)), NoBox(1), Short(2), Twice(2, o(0)), Unknown(0, o(9))];
        assert_eq!(faults, expected);
        let told: Vec<String> = faults.iter().map(ToString::to_string).collect();
        assert_eq!(told[2], "object 3 is in no node; it becomes a child of the root");
        assert!(told.iter().all(|line| line.lines().count() == 1));
        assert_eq!(check(&tree, &scene), [vec![0], vec![1, 2], vec![3]]);
        // An object with an invalid box is always drawn, and affects no box except the root's.
        boxes[1].centre.x = f64::NAN;
        let lists =
            Lists(vec![(all, vec![1, 2], vec![]), (between(-0.25, 1.25), vec![], vec![0, 1]), (all, vec![], vec![2, 3])]);
        let (tree, faults) = Hierarchy::of_tree(&lists, &boxes, &triangles);
        assert_eq!(faults, [NoObjectBox(o(1)), Short(0)]);
        assert_eq!(tree.nodes()[1].bounds, between(-0.25, 1.25).into());
        let leaf = tree.nodes().iter().position(|n| n.is_leaf() && n.triangles == 24).unwrap();
        assert_eq!((tree.objects(leaf as u32), tree.nodes()[leaf].bounds), (&[o(1)][..], EVERYWHERE));
        assert_eq!(tree.nodes()[leaf].parent, Some(0));
    }

    /// An endless tree, and a chain of a million nodes.
    #[test]
    fn depth_is_no_matter_and_trees_without_end_are_cut() {
        struct Chain(u64, Aabb);
        impl Tree for Chain {
            type Node = u64;
            fn root(&self) -> Option<u64> {
                Some(0)
            }
            fn bounds(&self, _: u64) -> Bounds {
                self.1.into()
            }
            fn children(&self, node: u64, out: &mut Vec<u64>) {
                out.extend((node < self.0).then_some(node + 1));
            }
            fn objects(&self, node: u64, out: &mut Vec<ObjectId>) {
                out.extend((node == self.0).then_some(ObjectId(0)));
            }
        }
        let scene = row(&[(0.0, 1)]);
        let (boxes, triangles) = boxes(&scene);
        let (tree, faults) = Hierarchy::of_tree(&Chain(4000, between(-1.0, 1.0)), &boxes, &triangles);
        assert_eq!((faults.len(), tree.depth(), tree.nodes().len()), (0, 4000, 4001));
        let (tree, faults) = Hierarchy::of_tree(&Chain(u64::MAX, between(-1.0, 1.0)), &boxes, &triangles);
        let end = (MOST_NODES[0] + MOST_NODES[1]) as u64 - 1;
        assert_eq!(faults, [TreeFault::Endless(end), TreeFault::Missing(ObjectId(0))]);
        assert_eq!(check(&tree, &scene), [[0]]);
    }

    /// Eight parts by the centre of the box; empty parts, and too many.
    #[test]
    fn objects_are_divided_as_the_client_says() {
        struct Octants<'a>(&'a [Aabb]);
        impl Divide for Octants<'_> {
            fn divide(&mut self, node: &Node, objects: &mut [ObjectId]) -> Vec<usize> {
                let octant = |o: &ObjectId| {
                    let side = self.0[o.index()].centre().cmpgt(node.bounds.centre);
                    side.bitmask()
                };
                objects.sort_by_key(octant);
                (0..8).map(|k| objects.iter().filter(|o| octant(o) == k).count()).collect()
            }
        }
        let scene = crowd(60, 3);
        let boxes: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();
        let triangles: Vec<u32> = scene.objects.iter().map(|o| o.triangles.len() as u32).collect();
        let tree = Hierarchy::divided(&boxes, &triangles, &mut Octants(&boxes));
        assert!(check(&tree, &scene).iter().all(|leaf| leaf.len() == 1));
        assert!(tree.nodes().iter().any(|n| n.children().len() > 4) && tree.depth() < 6);
        // Like the library's binary trees.
        let binary = Hierarchy::of_boxes(&boxes, &triangles, &HierarchyOptions::default());
        assert_eq!(tree.nodes()[0].bounds, binary.nodes()[0].bounds);

        struct Odd;
        impl Divide for Odd {
            fn divide(&mut self, node: &Node, _: &mut [ObjectId]) -> Vec<usize> {
                if node.level == 0 { vec![0, 10, 0, 20] } else { vec![1000, 7] }
            }
        }
        let tree = Hierarchy::divided(&boxes, &triangles, &mut Odd);
        let parts: Vec<usize> = (1..tree.nodes().len() as u32).map(|n| tree.objects(n).len()).collect();
        assert_eq!(parts, [10, 20, 30]);
    }

    /// Tighter boxes from a client.
    #[test]
    fn nodes_have_the_boxes_that_the_client_says() {
        let scene = crowd(60, 3);
        let tree = turned_tree(&scene);
        let mut tighter = 0;
        for (n, node) in tree.nodes().iter().enumerate() {
            let of_node = || tree.objects(n as u32).iter().map(|o| &scene.objects[o.index()]);
            let mut corners = of_node().flat_map(|o| o.triangles.clone()).flat_map(|t| scene.corners(t as usize));
            assert!(corners.all(|p| node.bounds.distance(p) < 1e-9), "node {n}");
            let aligned = of_node().fold(Aabb::EMPTY, |all, o| all.union(o.bounds));
            tighter += usize::from(node.is_leaf() && node.bounds.volume() < 0.9 * Bounds::from(aligned).volume());
        }
        assert_eq!(tree.nodes().len(), 119);
        assert!(tighter > 30, "{tighter} of 60");
    }
}
