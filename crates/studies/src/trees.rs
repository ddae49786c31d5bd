//! Trees of two studies: binary ones with six places to divide and four kinds of boxes, and those of a scene graph.
//!
//! Based on: Ivson 2006, chapter 4.2: six places for the plane that divides a node's objects by their boxes' middles, across the longest
//! axis of the node's box; depth at most 1.2 log2 n + 2 (Havran 2001); SAH (MacDonald, Booth 1990) weighted by triangles,
//! with a stop factor of 0.85. Deviations: medians of objects and of triangles divide the sorted list and not space, so that objects with
//! one middle are parted, too; SAH takes the areas of boxes along the node's own axes, swept once along each of the three, where
//! Ivson fits every candidate's box anew (quadratic).

use crate::boxes::{Fit, Hull, fit};
use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::math::parallel;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::hierarchy::{Divide, Hierarchy, Node, Tree, most_levels};
use enfilade::scene::{Object, Scene};
use glam::DVec3;

/// Of the area of the whole, that of the larger side above which SAH had better not divide. Higher: deeper trees, whose upper boxes tell
/// little. Lower (Havran 2001 has 0.75, for rays): nodes that could be divided stay whole (Ivson 2006).
const STOP: f64 = 0.85;

/// What decides where the plane goes that parts objects by their boxes' middles.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Split {
    /// As many objects on both sides.
    ObjectMedian,
    /// The middle of the node's box.
    SpatialMedian,
    /// Halfway from the first middle to the last.
    CentreMedian,
    /// The mean of the middles (as in OBBTree, Gottschalk et al. 1996).
    CentreMean,
    /// As many triangles on both sides.
    EqualComplexity,
    /// The least sum of the sides' areas times triangles, of all places along all three axes.
    Sah,
}

impl Split {
    /// Every way.
    pub const ALL: [Self; 6] =
        [Self::ObjectMedian, Self::SpatialMedian, Self::CentreMedian, Self::CentreMean, Self::EqualComplexity, Self::Sah];
}

/// How to build a binary tree.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TreeOptions {
    /// Boxes of objects and nodes.
    pub fit: Fit,
    /// Where nodes are divided.
    pub split: Split,
    /// A division that leaves a side with fewer triangles than this isn't made; 0 or 1 divide down to single objects.
    pub least_triangles: u64,
}

/// A binary tree. The same scene and options give the same tree. Along the axes, at the median of objects, it is the library's.
pub fn binary(scene: &Scene, options: &TreeOptions) -> Hierarchy {
    let shapes = Shapes::new(scene, options.fit);
    let boxes: Vec<Aabb> = parallel::map(&scene.objects, |object| Aabb::of(corners(scene, object)));
    let mut rule = Binary { shapes: &shapes, options, most: most_levels(boxes.len()) };
    Hierarchy::divided(&boxes, &triangles(scene), &mut rule)
}

/// The tree of a scene graph, of boxes along the axes: `levels[k][object]` names the group at level `k + 1` that holds an object, within that
/// of the level above; below the last level every object is a leaf. So two lists make a graph of four levels. Panics where a list isn't as
/// long as the scene's objects.
pub fn graph(scene: &Scene, levels: &[Vec<u32>]) -> Hierarchy {
    assert!(levels.iter().all(|l| l.len() == scene.objects.len()), "a group for every object");
    let boxes: Vec<Aabb> = parallel::map(&scene.objects, |object| Aabb::of(corners(scene, object)));
    let mut objects: Vec<ObjectId> = (0..scene.objects.len() as u32).map(ObjectId).collect();
    objects.sort_by_key(|o| (levels.iter().map(|l| l[o.index()]).collect::<Vec<_>>(), *o));
    let bounds: Vec<Bounds> = boxes.iter().map(|&b| b.into()).collect();
    let (tree, faults) = Hierarchy::of_tree(&Graph { objects, boxes: &boxes, levels }, &bounds, &triangles(scene));
    assert!(faults.is_empty(), "{faults:?}");
    tree
}

fn corners(scene: &Scene, object: &Object) -> impl Iterator<Item = DVec3> {
    object.triangles.clone().flat_map(move |t| scene.corners(t as usize))
}

fn triangles(scene: &Scene) -> Vec<u32> {
    scene.objects.iter().map(|o| o.triangles.end - o.triangles.start).collect()
}

/// Groups of groups of objects. A node is its level and its part of the objects.
struct Graph<'g> {
    /// Those of each group beside each other.
    objects: Vec<ObjectId>,
    boxes: &'g [Aabb],
    levels: &'g [Vec<u32>],
}

impl Tree for Graph<'_> {
    type Node = (usize, usize, usize);

    fn root(&self) -> Option<Self::Node> {
        (!self.objects.is_empty()).then_some((0, 0, self.objects.len()))
    }

    fn bounds(&self, (_, start, end): Self::Node) -> Bounds {
        let boxes = self.objects[start..end].iter().map(|o| self.boxes[o.index()]);
        boxes.fold(Aabb::EMPTY, Aabb::union).into()
    }

    fn children(&self, (level, start, end): Self::Node, out: &mut Vec<Self::Node>) {
        if level > self.levels.len() {
            return;
        }
        // Below the last level, everyone alone.
        let groups = self.levels.get(level);
        let is_together = |a: &ObjectId, b: &ObjectId| groups.is_some_and(|group| group[a.index()] == group[b.index()]);
        let mut next = start;
        for group in self.objects[start..end].chunk_by(is_together) {
            out.push((level + 1, next, next + group.len()));
            next += group.len();
        }
    }

    fn objects(&self, (level, start, end): Self::Node, out: &mut Vec<ObjectId>) {
        if level > self.levels.len() {
            out.extend(&self.objects[start..end]);
        }
    }
}

/// What boxes are fitted to, by object.
struct Shapes {
    fit: Fit,
    /// All corners of triangles (covariance), those of the convex hull (hull, minimum), or of the box (aligned).
    points: Vec<Vec<DVec3>>,
    /// The objects' own boxes.
    bounds: Vec<Bounds>,
    triangles: Vec<u64>,
}

impl Shapes {
    fn new(scene: &Scene, by: Fit) -> Self {
        let shape = |object: &Object| {
            let corners: Vec<DVec3> = corners(scene, object).collect();
            let points = match by {
                Fit::Aligned => {
                    let aabb = Aabb::of(corners);
                    vec![aabb.min, aabb.max]
                }
                Fit::Covariance => corners,
                Fit::Hull | Fit::Minimum => Hull::new(&corners).points,
            };
            let bounds = fit(&points, by).expect("an object has triangles");
            (points, bounds)
        };
        let shapes: Vec<(Vec<DVec3>, Bounds)> = parallel::map(&scene.objects, shape);
        let (points, bounds) = shapes.into_iter().unzip();
        Self { fit: by, points, bounds, triangles: triangles(scene).into_iter().map(u64::from).collect() }
    }

    /// Box around some objects.
    fn bounds(&self, objects: &[ObjectId]) -> Bounds {
        if let [object] = objects {
            return self.bounds[object.index()];
        }
        let points: Vec<DVec3> = objects.iter().flat_map(|o| &self.points[o.index()]).copied().collect();
        fit(&points, self.fit).expect("an object has triangles")
    }

    fn middle(&self, object: ObjectId) -> DVec3 {
        self.bounds[object.index()].centre
    }

    fn triangles(&self, objects: &[ObjectId]) -> u64 {
        objects.iter().map(|o| self.triangles[o.index()]).sum()
    }
}

/// Divides in two.
struct Binary<'s> {
    shapes: &'s Shapes,
    options: &'s TreeOptions,
    /// The deepest level.
    most: u32,
}

impl Divide for Binary<'_> {
    fn divide(&mut self, node: &Node, objects: &mut [ObjectId]) -> Vec<usize> {
        if node.level >= self.most || objects.len() < 2 {
            return Vec::new();
        }
        let Some(left) = split(self.options.split, node, objects, self.shapes) else { return Vec::new() };
        let [a, b] = [&objects[..left], &objects[left..]].map(|o| self.shapes.triangles(o));
        if a.min(b) < self.options.least_triangles { Vec::new() } else { vec![left, objects.len() - left] }
    }

    fn bounds(&mut self, objects: &[ObjectId], _: Bounds) -> Bounds {
        self.shapes.bounds(objects)
    }
}

/// Orders a node's objects (two or more) and says how many of them are on the first side; `None` where they can't be parted, or had better
/// not be.
fn split(split: Split, node: &Node, objects: &mut [ObjectId], shapes: &Shapes) -> Option<usize> {
    let axis = node.bounds.longest();
    let at = |o: &ObjectId| axis.dot(shapes.middle(*o));
    sort(objects, axis, shapes);
    let n = objects.len();
    let below = |plane: f64| objects.partition_point(|o| at(o) < plane);
    let left = match split {
        Split::ObjectMedian => n / 2,
        Split::SpatialMedian => below(axis.dot(node.bounds.centre)),
        Split::CentreMedian => below(0.5 * (at(&objects[0]) + at(&objects[n - 1]))),
        Split::CentreMean => below(objects.iter().map(at).sum::<f64>() / n as f64),
        Split::EqualComplexity => half_of_the_triangles(node, objects, shapes),
        Split::Sah => least_area(node, objects, shapes)?,
    };
    (1..n).contains(&left).then_some(left)
}

/// By middle along an axis, equals by number.
fn sort(objects: &mut [ObjectId], axis: DVec3, shapes: &Shapes) {
    let at = |o: &ObjectId| axis.dot(shapes.middle(*o));
    objects.sort_unstable_by(|a, b| at(a).total_cmp(&at(b)).then(a.cmp(b)));
}

/// Where both sides are the nearest to half of the triangles.
fn half_of_the_triangles(node: &Node, objects: &[ObjectId], shapes: &Shapes) -> usize {
    let mut before = 0;
    let uneven = |objects: &[ObjectId], before: &mut u64| {
        *before += shapes.triangles(objects);
        node.triangles.abs_diff(2 * *before)
    };
    let each = objects[..objects.len() - 1].chunks(1).map(|o| uneven(o, &mut before));
    each.enumerate().min_by_key(|e| e.1).map_or(0, |e| e.0 + 1)
}

/// The least areas times triangles along all axes; leaves the objects ordered along the best.
fn least_area(node: &Node, objects: &mut [ObjectId], shapes: &Shapes) -> Option<usize> {
    let axes = node.bounds.axes;
    let around = |o: &ObjectId| {
        let local = |&p: &DVec3| DVec3::from_array(axes.map(|axis| axis.dot(p)));
        Aabb::of(shapes.points[o.index()].iter().map(local))
    };
    let (mut best, mut whole) = (None::<(f64, usize, usize, f64)>, 0.0);
    let mut after = Vec::new();
    for (k, &axis) in axes.iter().enumerate() {
        sort(objects, axis, shapes);
        // Areas of what comes after each place, from the back.
        after.clear();
        let mut rest = Aabb::EMPTY;
        for o in objects.iter().rev() {
            rest = rest.union(around(o));
            after.push(area(&rest));
        }
        whole = after[objects.len() - 1];
        let (mut so_far, mut triangles) = (Aabb::EMPTY, 0);
        for left in 1..objects.len() {
            so_far = so_far.union(around(&objects[left - 1]));
            triangles += shapes.triangles(&objects[left - 1..left]);
            let areas = [area(&so_far), after[objects.len() - 1 - left]];
            let cost = areas[0] * triangles as f64 + areas[1] * (node.triangles - triangles) as f64;
            if best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, k, left, areas[0].max(areas[1])));
            }
        }
    }
    let (_, k, left, larger) = best?;
    sort(objects, axes[k], shapes);
    (larger <= STOP * whole).then_some(left)
}

/// Area of a box's faces, halved.
fn area(aabb: &Aabb) -> f64 {
    let s = aabb.size();
    s.x * s.y + s.y * s.z + s.z * s.x
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade::occlusion::hierarchy::HierarchyOptions;
    use glam::DQuat;
    use testing::crowd::{crowd, scene, turned};
    use testing::random::Places;

    fn tree(scene: &Scene, fit: Fit, split: Split) -> Hierarchy {
        binary(scene, &TreeOptions { fit, split, least_triangles: 1 })
    }

    fn of_crowd(count: usize, seed: u64) -> Scene {
        scene(&crowd(count, &mut Places::new(seed)))
    }

    /// Cubes of half a metre along x, each of 12 triangles a copy.
    fn row(cubes: &[(f64, u32)]) -> Scene {
        let cube = |x: f64| turned(DVec3::X * x, DQuat::IDENTITY, DVec3::splat(0.25));
        let mut scene = scene(&cubes.iter().map(|c| cube(c.0)).collect::<Vec<_>>());
        let mut triangles = Vec::new();
        for (object, &(_, copies)) in scene.objects.iter_mut().zip(cubes) {
            let (own, start) = (object.triangles.clone(), triangles.len() as u32);
            (0..copies).for_each(|_| triangles.extend(own.clone().map(|t| scene.triangles[t as usize])));
            object.triangles = start..triangles.len() as u32;
        }
        scene.triangles = triangles;
        scene
    }

    fn ids(tree: &Hierarchy, node: u32) -> Vec<u32> {
        tree.objects(node).iter().map(|o| o.0).collect()
    }

    /// Every object is in one leaf; parents' objects are their children's; boxes hold all that is below.
    fn check(tree: &Hierarchy, scene: &Scene) {
        let mut found = vec![0; scene.objects.len()];
        for (n, node) in (0u32..).zip(tree.nodes()) {
            let below: Vec<ObjectId> = node.children().flat_map(|c| tree.objects(c)).copied().collect();
            if node.is_leaf() {
                tree.objects(n).iter().for_each(|o| found[o.index()] += 1);
            } else {
                assert_eq!(tree.objects(n), below);
            }
            for object in tree.objects(n).iter().map(|o| &scene.objects[o.index()]) {
                assert!(corners(scene, object).all(|p| node.bounds.distance(p) < 1e-9), "node {n}");
            }
            let all = tree.objects(n).iter().map(|o| scene.objects[o.index()].triangles.len() as u64);
            assert_eq!(node.triangles, all.sum::<u64>());
        }
        assert!(found.iter().all(|&f| f == 1));
    }

    #[test]
    fn every_tree_holds_every_object_once_within_the_depth() {
        for (seed, count) in [(0, 1), (1, 2), (2, 7), (3, 60)] {
            let scene = of_crowd(count, seed);
            for fit in Fit::ALL {
                for split in Split::ALL {
                    let built = tree(&scene, fit, split);
                    check(&built, &scene);
                    assert!(built.depth() <= most_levels(count), "{fit:?} {split:?}: {}", built.depth());
                    assert_eq!(built, tree(&scene, fit, split));
                }
            }
        }
    }

    /// Node for node.
    #[test]
    fn the_median_of_objects_along_the_axes_is_the_library_s_tree() {
        for least_triangles in [1, 100] {
            let scene = of_crowd(70, 5);
            let options = TreeOptions { fit: Fit::Aligned, split: Split::ObjectMedian, least_triangles };
            assert_eq!(binary(&scene, &options), Hierarchy::build(&scene, &HierarchyOptions { least_triangles }));
        }
    }

    /// Cubes at 0, 1, 2 and 10 along x, of half a metre: where each plane goes is known.
    #[test]
    fn the_first_division_of_a_known_row() {
        let first = |split, scene: &Scene| ids(&tree(scene, Fit::Aligned, split), 1);
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
        assert_eq!(tree(&scene, Fit::Aligned, Split::Sah).nodes().len(), 1);
        assert_eq!(tree(&scene, Fit::Aligned, Split::ObjectMedian).nodes().len(), 3);
    }

    #[test]
    fn given_levels_are_the_tree() {
        let scene = row(&[(0.0, 1), (1.0, 1), (2.0, 1), (3.0, 1), (4.0, 1)]);
        // Group 1 of the first level and group 1 of the second aren't the same.
        let tree = graph(&scene, &[vec![1, 0, 1, 0, 0], vec![1, 1, 2, 1, 2]]);
        check(&tree, &scene);
        assert_eq!(tree.depth(), 3);
        let groups = |level| {
            let of_level = (0u32..).zip(tree.nodes()).filter(move |n| n.1.level == level);
            of_level.map(|(n, _)| ids(&tree, n)).collect::<Vec<_>>()
        };
        assert_eq!(groups(1), [vec![1, 3, 4], vec![0, 2]]);
        assert_eq!(groups(2), [vec![1, 3], vec![4], vec![0], vec![2]]);
        assert_eq!(groups(3), [[1], [3], [4], [0], [2]]);
    }
}
