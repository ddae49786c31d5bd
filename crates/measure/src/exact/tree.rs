//! The judge's hierarchy: two children a node, boxes as tight as `f32` allows.

use enfilade::math::bvh;
use enfilade::math::geom::Aabb;
use enfilade::types::scene::Scene;
use glam::DVec3;
use obvhs::bvh2::Bvh2;

/// Maximum triangles of a leaf.
const LEAF: u32 = 4;

/// A box and its contents.
pub(super) struct Node {
    /// Lesser corner.
    pub min: [f32; 3],
    /// Greater corner.
    pub max: [f32; 3],
    /// The first of two children, or the leaf's first triangle.
    pub first: u32,
    /// Triangles of a leaf; 0 for other nodes.
    pub count: u32,
}

/// The triangles of a scene in the order of leaves.
#[derive(Default)]
pub(super) struct Tree {
    /// The first is the root; empty without triangles.
    pub nodes: Vec<Node>,
    /// Corners of the triangle at each place.
    pub corners: Vec<[DVec3; 3]>,
    /// Index into [`Scene::triangles`] of each place.
    pub triangles: Vec<u32>,
    /// Whether the triangle at each place is opaque.
    pub opaque: Vec<bool>,
}

impl Tree {
    pub fn new(scene: &Scene) -> Self {
        let bounds = |t: usize| Aabb::of(scene.corners(t));
        let boxes = (0..scene.triangles.len()).map(|t| {
            let b = bounds(t);
            obvhs::aabb::Aabb::new(b.min.to_array().map(below).into(), b.max.to_array().map(above).into())
        });
        let bvh = bvh::over(boxes.collect(), Some(LEAF));
        if bvh.nodes.is_empty() {
            return Self::default();
        }
        let mut of_objects = vec![false; scene.triangles.len()];
        for object in scene.objects.iter().filter(|o| o.opaque) {
            of_objects[object.triangles.start as usize..object.triangles.end as usize].fill(true);
        }
        let triangles = bvh.primitive_indices.clone();
        let corners: Vec<_> = triangles.iter().map(|&t| scene.corners(t as usize)).collect();
        let opaque = triangles.iter().map(|&t| of_objects[t as usize]).collect();
        Self { nodes: fitted(&bvh, &corners), corners, triangles, opaque }
    }
}

/// The nodes with tight boxes; those of the builder have grown.
fn fitted(bvh: &Bvh2, corners: &[[DVec3; 3]]) -> Vec<Node> {
    let (mut order, mut open) = (Vec::with_capacity(bvh.nodes.len()), vec![0u32]);
    while let Some(n) = open.pop() {
        order.push(n);
        let node = &bvh.nodes[n as usize];
        if !node.is_leaf() {
            open.extend([node.first_index, node.first_index + 1]);
        }
    }
    let copy = |node: &obvhs::bvh2::node::Bvh2Node| Node {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
        first: node.first_index,
        count: node.prim_count,
    };
    let mut nodes: Vec<Node> = bvh.nodes.iter().map(copy).collect();
    for n in order.into_iter().rev() {
        let (first, count) = (nodes[n as usize].first as usize, nodes[n as usize].count as usize);
        let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        let mut grow = |low: [f32; 3], high: [f32; 3]| {
            for k in 0..3 {
                (min[k], max[k]) = (min[k].min(low[k]), max[k].max(high[k]));
            }
        };
        if count == 0 {
            nodes[first..first + 2].iter().for_each(|child| grow(child.min, child.max));
        } else {
            let points = corners[first..first + count].iter().flatten();
            points.for_each(|p| grow(p.to_array().map(below), p.to_array().map(above)));
        }
        (nodes[n as usize].min, nodes[n as usize].max) = (min, max);
    }
    nodes
}

/// The greatest `f32` that is not greater.
fn below(x: f64) -> f32 {
    let y = x as f32;
    if f64::from(y) > x { y.next_down() } else { y }
}

/// The least `f32` that is not less.
fn above(x: f64) -> f32 {
    -below(-x)
}
