//! The hierarchy for both fast engines: eight children per node, eight triangles per block, as a structure of arrays.
//!
//! Based on: Dammertz, Hanika, Keller, *Shallow bounding volume hierarchies for fast SIMD ray tracing of incoherent rays*, 2008 (a binary
//! tree, here obvhs's, is collapsed into a wide one: the child with the largest surface is opened until all lanes are used). Deviation: a
//! subtree that fits a block becomes one leaf.
//!
//! Boxes are `f32`, rounded outward; corners stay `f64` for exact differences to an eye.

use crate::math::bvh;
use crate::math::geom::Aabb;
use crate::scene::Scene;
use obvhs::bvh2::Bvh2;
use std::ops::Range;

/// Children of a node, triangles of a block, pixels along a tile.
pub(super) const LANES: usize = 8;
/// Marks a child that is a leaf.
pub(super) const LEAF: u32 = 1 << 31;

/// Up to eight boxes with their children. Lanes without a child hold an empty box.
#[repr(align(64))]
pub(super) struct Node {
    /// Lesser corners by axis.
    pub min: [[f32; LANES]; 3],
    /// Greater corners by axis.
    pub max: [[f32; LANES]; 3],
    /// Index of a node, or [`LEAF`] plus the index of a leaf.
    pub child: [u32; LANES],
}

/// Up to eight triangles.
#[repr(align(64))]
pub(super) struct Block {
    /// By corner, axis and lane; lanes without a triangle repeat the first.
    pub corners: [[[f64; LANES]; 3]; 3],
    /// Indices into [`Scene::triangles`].
    pub triangles: [u32; LANES],
    /// Lanes with a triangle.
    pub len: usize,
}

/// A wide hierarchy.
#[derive(Default)]
pub(super) struct Tree {
    /// The first is the root; empty for an empty scene.
    pub nodes: Vec<Node>,
    /// Start of each leaf's blocks, and the end.
    starts: Vec<u32>,
    blocks: Vec<Block>,
}

impl Tree {
    /// A tree over triangles, at most a block per leaf.
    pub fn of_triangles(scene: &Scene, triangles: &[u32]) -> Self {
        let bounds = |&t: &u32| Aabb::of(scene.corners(t as usize));
        let bvh = binary(triangles.iter().map(bounds), LANES as u32);
        Self::fold(scene, &bvh, LANES as u32, |primitive| triangles[primitive]..triangles[primitive] + 1)
    }

    /// A tree over objects, one per leaf; and the object of each leaf.
    pub fn of_objects(scene: &Scene, objects: &[u32]) -> (Self, Vec<u32>) {
        let bvh = binary(objects.iter().map(|&o| scene.objects[o as usize].bounds), 1);
        let tree = Self::fold(scene, &bvh, 1, |primitive| scene.objects[objects[primitive] as usize].triangles.clone());
        let owner = |leaf: usize| scene.object_of(tree.blocks(leaf as u32)[0].triangles[0] as usize).0;
        let owners = (0..tree.starts.len().saturating_sub(1)).map(owner).collect();
        (tree, owners)
    }

    /// The triangles of a leaf.
    #[inline(always)]
    pub fn blocks(&self, leaf: u32) -> &[Block] {
        &self.blocks[self.starts[leaf as usize] as usize..self.starts[leaf as usize + 1] as usize]
    }

    fn fold(scene: &Scene, bvh: &Bvh2, most: u32, triangles_of: impl Fn(usize) -> Range<u32>) -> Self {
        let mut tree = Self { starts: vec![0], ..Self::default() };
        if bvh.nodes.is_empty() {
            return Self::default();
        }
        let counts = counts(bvh);
        let is_leaf = |n: u32| counts[n as usize] <= most || bvh.nodes[n as usize].is_leaf();
        // Binary nodes to collapse, and the slot of their index.
        let mut open: Vec<(u32, Option<(u32, usize)>)> = vec![(0, None)];
        while let Some((root, parent)) = open.pop() {
            let index = tree.nodes.len() as u32;
            if let Some((node, lane)) = parent {
                tree.nodes[node as usize].child[lane] = index;
            }
            let (mut children, mut len) = ([root; LANES], 1);
            let surface = |n: u32| bvh.nodes[n as usize].aabb().half_area();
            while len < LANES {
                let inner = (0..len).filter(|&i| !is_leaf(children[i]));
                let Some(widest) = inner.max_by(|&a, &b| surface(children[a]).total_cmp(&surface(children[b]))) else {
                    break;
                };
                let first = bvh.nodes[children[widest] as usize].first_index;
                (children[widest], children[len]) = (first, first + 1);
                len += 1;
            }
            let nowhere = ([[f32::MAX; LANES]; 3], [[-f32::MAX; LANES]; 3]);
            let mut node = Node { min: nowhere.0, max: nowhere.1, child: [LEAF; LANES] };
            for (lane, &child) in children[..len].iter().enumerate() {
                let bounds = bvh.nodes[child as usize].aabb();
                for axis in 0..3 {
                    (node.min[axis][lane], node.max[axis][lane]) = (bounds.min[axis], bounds.max[axis]);
                }
                if is_leaf(child) {
                    node.child[lane] = LEAF | (tree.starts.len() - 1) as u32;
                    tree.add_leaf(scene, primitives(bvh, child).into_iter().flat_map(&triangles_of));
                } else {
                    open.push((child, Some((index, lane))));
                }
            }
            tree.nodes.push(node);
        }
        tree
    }

    fn add_leaf(&mut self, scene: &Scene, triangles: impl Iterator<Item = u32>) {
        let mut triangles: Vec<u32> = triangles.collect();
        triangles.sort_unstable();
        for some in triangles.chunks(LANES) {
            let mut block = Block { corners: [[[0.0; LANES]; 3]; 3], triangles: [some[0]; LANES], len: some.len() };
            block.triangles[..some.len()].copy_from_slice(some);
            for lane in 0..LANES {
                for (corner, p) in scene.corners(block.triangles[lane] as usize).iter().enumerate() {
                    for axis in 0..3 {
                        block.corners[corner][axis][lane] = p[axis];
                    }
                }
            }
            self.blocks.push(block);
        }
        self.starts.push(self.blocks.len() as u32);
    }
}

fn binary(bounds: impl Iterator<Item = Aabb>, most: u32) -> Bvh2 {
    let boxes: Vec<obvhs::aabb::Aabb> = bounds
        .map(|b| obvhs::aabb::Aabb::new(b.min.to_array().map(below).into(), b.max.to_array().map(above).into()))
        .collect();
    bvh::over(boxes, Some(most))
}

/// The greatest `f32` that is not above `x`.
fn below(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) > x { y.next_down() } else { y }
}

/// The least `f32` that is not below `x`.
fn above(x: f64) -> f32 {
    -below(-x)
}

/// Number of primitives below each node.
fn counts(bvh: &Bvh2) -> Vec<u32> {
    let (mut order, mut open) = (Vec::with_capacity(bvh.nodes.len()), vec![0u32]);
    while let Some(n) = open.pop() {
        order.push(n);
        let node = &bvh.nodes[n as usize];
        if !node.is_leaf() {
            open.extend([node.first_index, node.first_index + 1]);
        }
    }
    let mut counts = vec![0; bvh.nodes.len()];
    for n in order.into_iter().rev() {
        let node = &bvh.nodes[n as usize];
        let first = node.first_index as usize;
        counts[n as usize] = if node.is_leaf() { node.prim_count } else { counts[first] + counts[first + 1] };
    }
    counts
}

fn primitives(bvh: &Bvh2, root: u32) -> Vec<usize> {
    let (mut all, mut open) = (Vec::new(), vec![root]);
    while let Some(n) = open.pop() {
        let node = &bvh.nodes[n as usize];
        let first = node.first_index as usize;
        if node.is_leaf() {
            let slots = &bvh.primitive_indices[first..first + node.prim_count as usize];
            all.extend(slots.iter().map(|&i| i as usize));
        } else {
            open.extend([node.first_index, node.first_index + 1]);
        }
    }
    all
}
