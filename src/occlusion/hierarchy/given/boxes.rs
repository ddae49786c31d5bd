//! Boxes of a client's tree: whether they are valid, and whether they contain others.

use crate::math::geom::Aabb;
use crate::occlusion::bounds::Bounds;
use glam::DVec3;

/// Tolerance of a box that does not contain its contents, relative to its coordinates: the rounding of a client with `f32`. Larger: wrong
/// boxes pass. Smaller: good boxes are recomputed.
const SHORT: f64 = 1e-6;

/// Whether a box is valid: finite, with orthonormal axes.
pub fn is_box(b: &Bounds) -> bool {
    let [x, y, z] = b.axes;
    let units = [x.dot(x) - 1.0, y.dot(y) - 1.0, z.dot(z) - 1.0, x.dot(y), y.dot(z), z.dot(x)];
    units.iter().all(|off| off.abs() <= SHORT) && b.centre.is_finite() && b.half.is_finite() && b.half.min_element() >= 0.0
}

/// A box, grown by rounding, if it contains the others; otherwise `None`.
pub fn holding(b: Bounds, parts: &[Bounds]) -> Option<Bounds> {
    let corners = parts.iter().flat_map(Bounds::corners);
    let short = corners.fold(DVec3::ZERO, |short, p| short.max(b.local(p).abs() - b.half));
    let size = b.centre.abs().max_element() + b.half.max_element();
    (short.max_element() <= SHORT * size).then_some(Bounds { half: b.half + short, ..b })
}

/// The axis-aligned box around others; a single one stays unchanged.
pub fn around(parts: &[Bounds]) -> Bounds {
    match parts {
        [one] => *one,
        _ => Bounds::from(Aabb::of(parts.iter().flat_map(Bounds::corners))),
    }
}
