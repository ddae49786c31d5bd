//! Boxes around parts of objects, used in queries instead of the object's box: the box of a lamp, a tree or a teapot is mostly empty.
//!
//! Triangles of an object are divided at the median of their centres, across the longest axis of the box, until parts have few. Based on:
//! the tighter bounds of Mattausch, Bittner, Wimmer (2008), which end at objects, taken one step further.

use super::Hierarchy;
use crate::math::geom::Aabb;
use crate::math::parallel;
use crate::occlusion::bounds::Bounds;
use crate::occlusion::geometry::{Geometry, GeometryObject};
use glam::DVec3;

/// Least triangles of a part: drawing so many takes an oracle many times as long as testing one more box. Higher: looser boxes. Lower:
/// queries cost as much as they save.
const LEAST_TRIANGLES: usize = 128;
/// Most parts of an object. Higher: slightly more hidden objects are found, and queries of visible ones take longer.
const MOST_PARTS: usize = 16;
/// Parts are kept if their total volume is at most this share of the object's box. Higher: useless parts for solid blocks.
const EMPTIER: f64 = 0.8;

/// Parts of a tree's objects, in its order.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Parts {
    /// Start of the parts of each object in the tree's list; one more at the end.
    starts: Vec<u32>,
    boxes: Vec<Bounds>,
}

impl Hierarchy {
    /// Adds boxes around parts of objects with many triangles and much empty space; `model` is the tree's. Queries of leaves use these.
    /// Fewer useless draws, for memory of up to sixteen boxes per object. Panics if the tree has other objects.
    pub fn with_parts<'a>(mut self, model: impl Into<Geometry<'a>>) -> Self {
        let model = model.into();
        assert_eq!(self.object_count(), model.objects.len(), "a tree of the model's objects");
        let of_object: Vec<Vec<Aabb>> = parallel::map(&model.objects, |object| parts(&model, object));
        let (mut starts, mut boxes) = (vec![0], Vec::new());
        for object in &self.objects {
            boxes.extend(of_object[object.index()].iter().map(|&part| Bounds::from(part)));
            starts.push(boxes.len() as u32);
        }
        self.parts = Some(Parts { starts, boxes });
        self
    }

    /// Upper bound of the number of boxes in a query.
    pub(crate) fn boxes(&self) -> usize {
        self.nodes.len() + self.parts.as_ref().map_or(0, |parts| parts.boxes.len())
    }

    /// The boxes of a node's query, which contain all triangles below it.
    #[inline]
    pub(crate) fn asked(&self, node: u32) -> &[Bounds] {
        let of = &self.nodes[node as usize];
        match &self.parts {
            Some(parts) if of.is_leaf() => {
                let [start, end] = of.objects.map(|at| parts.starts[at as usize] as usize);
                &parts.boxes[start..end]
            }
            _ => std::slice::from_ref(&of.bounds),
        }
    }
}

/// The boxes around an object's parts; one if more gain little.
fn parts(model: &Geometry<'_>, object: &GeometryObject) -> Vec<Aabb> {
    let mut triangles: Vec<(DVec3, Aabb)> = object
        .triangles
        .clone()
        .map(|t| {
            let around = Aabb::of(model.corners(t as usize));
            (around.centre(), around)
        })
        .collect();
    let whole = around(&triangles);
    let mut parts = Vec::new();
    divide(&mut triangles, MOST_PARTS, &mut parts);
    let volume = |b: &Aabb| b.size().element_product();
    if parts.iter().map(volume).sum::<f64>() < EMPTIER * volume(&whole) { parts } else { vec![whole] }
}

/// Divides triangles into at most `most` parts.
fn divide(triangles: &mut [(DVec3, Aabb)], most: usize, parts: &mut Vec<Aabb>) {
    let around = around(triangles);
    if most < 2 || triangles.len() < 2 * LEAST_TRIANGLES {
        parts.push(around);
        return;
    }
    let size = around.size();
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    let middle = triangles.len() / 2;
    triangles.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]));
    let (low, high) = triangles.split_at_mut(middle);
    divide(low, most / 2, parts);
    divide(high, most / 2, parts);
}

fn around(triangles: &[(DVec3, Aabb)]) -> Aabb {
    triangles.iter().fold(Aabb::EMPTY, |all, (_, b)| all.union(*b))
}

#[cfg(test)]
mod tests {
    use super::super::HierarchyOptions;
    use super::*;
    use crate::ObjectId;
    use crate::occlusion::chc::Chc;
    use crate::occlusion::depth::DepthBuffer;
    use crate::occlusion::oracle::OcclusionOracle;
    use crate::occlusion::scenes::{add, row, turned};
    use crate::occlusion::view::{Frustum, View};
    use crate::types::scene::Scene;
    use glam::DQuat;

    /// Two cubes of half a metre, 360 triangles each, as one object.
    fn dumb_bell() -> Scene {
        let mut scene = row(&[(-2.0, 30), (2.0, 30)]);
        let other = scene.objects.pop().unwrap();
        let one = &mut scene.objects[0];
        one.triangles.end = other.triangles.end;
        one.bounds = one.bounds.union(other.bounds);
        scene
    }

    #[test]
    fn parts_are_boxes_around_what_there_is() {
        let tree = |scene: &Scene| Hierarchy::build(scene, &HierarchyOptions::default()).with_parts(scene);
        let asked = tree(&dumb_bell());
        assert_eq!(asked.asked(0).len(), 4);
        for part in asked.asked(0) {
            assert!((part.centre.x.abs() - 2.0).abs() < 1e-9 && part.half.max_element() < 0.26, "{part:?}");
        }
        // The parts of a block have the same volume as the whole, and few triangles are not divided.
        let scene = row(&[(0.0, 30), (1.0, 1)]);
        let asked = tree(&scene);
        for leaf in [1, 2] {
            assert_eq!(asked.asked(leaf), [asked.nodes()[leaf as usize].bounds]);
        }
        assert_eq!(asked.asked(0), [asked.nodes()[0].bounds]);
    }

    /// Behind two walls with a gap, in which the object has no triangles.
    #[test]
    fn what_shows_nothing_but_the_empty_part_of_its_box_is_hidden() {
        let mut scene = dumb_bell();
        for x in [-2.0, 2.0] {
            add(&mut scene, &turned(DVec3::new(x, 0.0, 3.0), DQuat::IDENTITY, DVec3::new(1.0, 1.0, 0.1)), 1);
        }
        let view = View::look_at(DVec3::Z * 30.0, DVec3::ZERO, 0.4, 1.5, 0.1);
        let mut buffer = DepthBuffer::new(&scene, 160, 120);
        let whole = Hierarchy::build(&scene, &HierarchyOptions::default());
        let in_parts = whole.clone().with_parts(&scene);
        for (tree, hidden) in [(whole, false), (in_parts, true)] {
            let mut culler = Chc::default();
            for frame in 0..3 {
                OcclusionOracle::begin(&mut buffer, &view);
                let drawn = culler.cull(&tree, &Frustum::new(&view), &mut buffer);
                assert_eq!(drawn.contains(&ObjectId(0)), !hidden, "frame {frame}");
            }
        }
    }
}
