//! Where a node's objects are divided in two.

use super::{Node, Shapes};
use crate::ObjectId;
use crate::geom::Aabb;
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

/// Orders a node's objects (two or more) and says how many of them are on the first side; `None` where they can't be parted, or had better
/// not be.
pub(super) fn split(split: Split, node: &Node, objects: &mut [ObjectId], shapes: &Shapes) -> Option<usize> {
    let axis = node.bounds.longest();
    let at = |o: &ObjectId| axis.dot(shapes.middles[o.index()]);
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
    let at = |o: &ObjectId| axis.dot(shapes.middles[o.index()]);
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
