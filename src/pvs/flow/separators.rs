//! Separating planes of two windows: how far the lines through both can spread beyond the second.
//!
//! Based on: Teller, *Visibility computations in densely occluded polyhedral environments*, 1992 (antipenumbra); the planes
//! through an edge of one window and a corner of the other are the ones that portal flow in level compilers takes, after an
//! idea of Carmack, 1996. Deviates in how a plane is accepted: not by the way it was made, but by testing that the first
//! window lies wholly on its outside and the second wholly on its inside. That alone makes a plane valid, for any two sets
//! of points: a line from `s` to `w` that has not gone inwards by `w` never comes back out beyond it. So bad input
//! (collinear corners, edges of length zero, windings that aren't quite flat) can make planes fail the test, never pass it
//! wrongly.

use crate::geom::Plane;
use glam::DVec3;

/// A window must reach this many times the rounding error of the test away from a plane that it touches. Rounding can then
/// lose lines only within that fraction of the window's width from its edge. Larger: narrower slits go without planes.
const DEPTH: f64 = 1024.0;

/// Appends planes whose inside holds everything that lines through `first` and then `second` can meet beyond `second`.
///
/// The planes of the windows themselves are not among them. Where a window is empty (nothing is known about it) there are none.
pub(super) fn separators(first: &[DVec3], second: &[DVec3], planes: &mut Vec<Plane>) {
    let start = planes.len();
    through_edges(first, second, |plane| add(planes, start, plane));
    through_edges(second, first, |plane| {
        // The second window is now outside of the plane and the first inside: turn it round.
        add(planes, start, plane.flipped());
    });
}

/// Leaves out planes that are there already: an edge of one window is often parallel to one of the other.
fn add(planes: &mut Vec<Plane>, start: usize, plane: Plane) {
    let same = |p: &Plane| (p.n - plane.n).abs().max_element() < 1e-12 && p.d == plane.d;
    if !planes[start..].iter().any(same) {
        planes.push(plane);
    }
}

/// Calls `found` with every plane through an edge of `edges` and a corner of `others` that has `edges` outside and `others`
/// inside.
fn through_edges(edges: &[DVec3], others: &[DVec3], mut found: impl FnMut(Plane)) {
    let Some(&first) = others.first() else { return };
    for (i, &a) in edges.iter().enumerate() {
        let along = edges[(i + 1) % edges.len()] - a;
        for sign in [1.0, -1.0] {
            // Turn the plane about the edge until `others` lies on its inside. One round is enough where that can be done.
            let mut normal = along.cross(first - a) * sign;
            for &p in &others[1..] {
                if normal.dot(p - a) > 0.0 || normal == DVec3::ZERO {
                    normal = along.cross(p - a) * sign;
                }
            }
            if let Some(n) = normal.try_normalize()
                && let Some(plane) = accept(n, a, edges, others)
            {
                found(plane);
            }
        }
    }
}

/// The plane through `a` with normal `n`, if `outer` lies outside of it and `inner` inside.
///
/// Distances are taken from `a`, so that their error scales with the size of the windows and not with their coordinates.
fn accept(n: DVec3, a: DVec3, outer: &[DVec3], inner: &[DVec3]) -> Option<Plane> {
    let range = |points: &[DVec3]| {
        points.iter().fold((f64::INFINITY, f64::NEG_INFINITY, 0.0f64), |(low, high, size), &p| {
            let (q, d) = (p - a, n.dot(p - a));
            (low.min(d), high.max(d), size.max(q.length_squared()))
        })
    };
    let (outer_low, outer_high, outer_size) = range(outer);
    let (inner_low, inner_high, inner_size) = range(inner);
    let rounding = 8.0 * f64::EPSILON * outer_size.max(inner_size).sqrt();
    let apart = outer_low >= -rounding && inner_high <= rounding;
    let deep = outer_high > DEPTH * rounding && inner_low < -DEPTH * rounding;
    // `inner_high` is 0 but for rounding, which may only move the plane outwards.
    (apart && deep).then(|| Plane { n, d: n.dot(a) + inner_high.max(0.0) })
}
