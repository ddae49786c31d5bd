//! Boxes that a client gives: whether they are some, and whether they hold others.

use crate::geom::Aabb;
use crate::occlusion::bounds::Bounds;
use glam::DVec3;

/// By how much a box may fall short of what is in it, of the size of its coordinates: the rounding of a client that keeps `f32`. Larger:
/// boxes that lose something pass. Smaller: good boxes are made anew.
const SHORT: f64 = 1e-6;

/// Whether it is one: of numbers, its axes of length 1 and at right angles.
pub fn is_box(b: &Bounds) -> bool {
    let [x, y, z] = b.axes;
    let units = [x.dot(x) - 1.0, y.dot(y) - 1.0, z.dot(z) - 1.0, x.dot(y), y.dot(z), z.dot(x)];
    units.iter().all(|off| off.abs() <= SHORT) && b.centre.is_finite() && b.half.is_finite() && b.half.min_element() >= 0.0
}

/// A box, grown by rounding, if it holds the others; `None` otherwise.
pub fn holding(b: Bounds, parts: &[Bounds]) -> Option<Bounds> {
    let corners = parts.iter().flat_map(Bounds::corners);
    let short = corners.fold(DVec3::ZERO, |short, p| short.max(b.local(p).abs() - b.half));
    let size = b.centre.abs().max_element() + b.half.max_element();
    (short.max_element() <= SHORT * size).then_some(Bounds { half: b.half + short, ..b })
}

/// The box along the axes around some others; one of them alone is its own.
pub fn around(parts: &[Bounds]) -> Bounds {
    match parts {
        [one] => *one,
        _ => Bounds::from(Aabb::of(parts.iter().flat_map(Bounds::corners))),
    }
}
