//! What part of a face is open: the face less every opaque triangle that lies on it.
//!
//! Soundness: triangles grow by a square of half-width `seal` before they are taken away, so a point that counts as closed is
//! within `sqrt(2) * seal` of a triangle's projection (and half a `seal` more in a sliver), and that triangle is within the
//! coplanar tolerance of the face. No segment with more clearance than the sum gets through ([`crate::tolerance`]). Polygon
//! booleans are done on integers (i_overlay), at a resolution of 2^-30 of the face.

use crate::geom::Plane;
use crate::geom::clip;
use glam::{DVec2, DVec3};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;

/// A polygon: an outer contour, then holes.
pub type Shape = Vec<Vec<[f64; 2]>>;

/// What is open of a face.
#[derive(Clone, Debug)]
pub enum Open {
    /// Nothing lies on it.
    Whole,
    /// These parts; empty where the face is closed.
    Parts(Vec<Shape>),
}

/// What is narrower than this, in seals, is left over from rounding. It adds to the distance at which a closed point may be from
/// its triangle, so it counts in the nesting of tolerances.
const CRUMB: f64 = 0.5;

/// The open part of a convex `face` under triangles in the same coordinates, all of either winding.
pub fn open_part(face: &[DVec2], triangles: &[[DVec2; 3]], seal: f64) -> Open {
    if triangles.is_empty() {
        return Open::Whole;
    }
    let turned: Vec<DVec2>;
    let face = if area(face) < 0.0 {
        turned = face.iter().rev().copied().collect();
        &turned
    } else {
        face
    };
    match at_a_glance(face, triangles, seal) {
        Some(true) => return Open::Whole,
        Some(false) => return Open::Parts(Vec::new()),
        None => {}
    }
    let subject: Vec<[f64; 2]> = face.iter().map(|p| p.to_array()).collect();
    let grown: Vec<Vec<[f64; 2]>> = triangles
        .iter()
        .map(|t| {
            let corners = t.iter().flat_map(|p| {
                [(-seal, -seal), (seal, -seal), (seal, seal), (-seal, seal)].map(|(x, y)| *p + DVec2::new(x, y))
            });
            convex_hull(corners.collect()).iter().map(|p| p.to_array()).collect()
        })
        .collect();
    let mut parts = subject.overlay(&grown, OverlayRule::Difference, FillRule::NonZero);
    // Slivers along a triangle are rounding; a face that is itself no wider closes nothing.
    let least = (CRUMB * seal).min(0.9 * width(face));
    parts.retain(|shape| shape.first().is_some_and(|outer| width(&convex_hull(points(outer))) >= least));
    Open::Parts(parts)
}

/// Faces wider than this many seals don't change by more than a fiftieth where triangles that only touch them are left out.
const WIDE: f64 = 100.0;
/// Faces narrower than this many seals are left to the booleans: a crumb would be much of them.
const NARROW: f64 = 4.0;
/// Most convex parts that are kept on the way; what falls into more is left to the booleans.
const MOST_PARTS: usize = 12;

/// What most faces are: wholly open, because every triangle passes them by (`true`), or wholly closed (`false`).
///
/// Closed is told by cutting the triangles out of the face, one after the other, into convex parts. Where parts are left that
/// are together no wider than a crumb, no point of them is farther than that from a triangle.
fn at_a_glance(face: &[DVec2], triangles: &[[DVec2; 3]], seal: f64) -> Option<bool> {
    let wide = width(face);
    if wide <= NARROW * seal {
        return None;
    }
    let over: Vec<[DVec2; 3]> = triangles.iter().map(|&t| counter_clockwise(t)).filter(|t| meet(face, t)).collect();
    if over.is_empty() {
        return (wide > WIDE * seal).then_some(true);
    }
    let mut parts = vec![face.to_vec()];
    for t in &over {
        let mut rest = Vec::new();
        for part in parts {
            if meet(&part, t) {
                less(part, t, &mut rest);
            } else {
                rest.push(part);
            }
        }
        parts = rest;
        if parts.len() > MOST_PARTS {
            return None;
        }
    }
    (parts.iter().map(|p| width(p)).sum::<f64>() <= CRUMB * seal).then_some(false)
}

/// False only where an edge of one of two convex polygons, both counter-clockwise, has all of the other beyond it.
fn meet(a: &[DVec2], b: &[DVec2]) -> bool {
    let parts = |a: &[DVec2], b: &[DVec2]| {
        (0..a.len()).any(|i| {
            let (p, edge) = (a[i], a[(i + 1) % a.len()] - a[i]);
            b.iter().all(|&q| edge.perp_dot(q - p) <= 0.0)
        })
    };
    !parts(a, b) && !parts(b, a)
}

/// A convex polygon less a triangle, as convex polygons: what is beyond each edge of the triangle, and not beyond those before.
fn less(mut part: Vec<DVec2>, t: &[DVec2; 3], out: &mut Vec<Vec<DVec2>>) {
    for i in 0..3 {
        let (p, edge) = (t[i], t[(i + 1) % 3] - t[i]);
        let side = |q: DVec2| edge.perp_dot(q - p);
        let (mut inside, mut beyond) = (Vec::with_capacity(part.len() + 1), Vec::with_capacity(part.len() + 1));
        for (k, &a) in part.iter().enumerate() {
            let b = part[(k + 1) % part.len()];
            let (da, db) = (side(a), side(b));
            if da >= 0.0 {
                inside.push(a);
            }
            if da <= 0.0 {
                beyond.push(a);
            }
            if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
                let cross = a + (b - a) * (da / (da - db));
                inside.push(cross);
                beyond.push(cross);
            }
        }
        if beyond.len() >= 3 {
            out.push(beyond);
        }
        if inside.len() < 3 {
            return;
        }
        part = inside;
    }
}

/// A contour as points.
pub fn points(contour: &[[f64; 2]]) -> Vec<DVec2> {
    contour.iter().map(|&p| DVec2::from_array(p)).collect()
}

/// Signed area, positive for counter-clockwise.
pub fn area(contour: &[DVec2]) -> f64 {
    let o = contour.first().copied().unwrap_or_default();
    let next = contour.iter().cycle().skip(1);
    contour.iter().zip(next).map(|(a, b)| (*a - o).perp_dot(*b - o)).sum::<f64>() * 0.5
}

/// The triangle, counter-clockwise.
pub fn counter_clockwise(q: [DVec2; 3]) -> [DVec2; 3] {
    if (q[1] - q[0]).perp_dot(q[2] - q[0]) < 0.0 { [q[0], q[2], q[1]] } else { q }
}

/// Area of a shape less its holes.
pub fn shape_area(shape: &Shape) -> f64 {
    let areas: Vec<f64> = shape.iter().map(|c| area(&points(c)).abs()).collect();
    areas.first().map_or(0.0, |outer| outer - areas[1..].iter().sum::<f64>())
}

/// Convex hull, counter-clockwise, no three corners in line (Andrew 1979); signs by robust predicates.
pub fn convex_hull(mut p: Vec<DVec2>) -> Vec<DVec2> {
    p.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    p.dedup();
    if p.len() < 3 {
        return p;
    }
    let left = |a: DVec2, b: DVec2, c: DVec2| {
        let coord = |q: DVec2| robust::Coord { x: q.x, y: q.y };
        robust::orient2d(coord(a), coord(b), coord(c)) > 0.0
    };
    let mut hull: Vec<DVec2> = Vec::with_capacity(p.len() + 1);
    for half in 0..2 {
        let floor = hull.len();
        let order: Box<dyn Iterator<Item = &DVec2>> = if half == 0 { Box::new(p.iter()) } else { Box::new(p.iter().rev()) };
        for &q in order {
            while hull.len() >= floor + 2 && !left(hull[hull.len() - 2], hull[hull.len() - 1], q) {
                hull.pop();
            }
            hull.push(q);
        }
        hull.pop();
    }
    hull
}

/// The least distance between two parallel lines that hold a convex polygon.
pub fn width(hull: &[DVec2]) -> f64 {
    if hull.len() < 3 {
        return 0.0;
    }
    // A corner that is there twice has no edge, and no direction to measure across. Of one that is there almost twice the edge runs
    // anywhere, and the rest of the hull may be on either side of it: across is from one end to the other.
    let span = |i: usize| {
        let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
        let n = (b - a).perp().try_normalize()?;
        let across = hull.iter().map(|p| n.dot(*p - a));
        Some(across.clone().fold(0.0, f64::max) - across.fold(0.0, f64::min))
    };
    (0..hull.len()).filter_map(span).reduce(f64::min).unwrap_or(0.0)
}

/// What a triangle and a convex polygon, both counter-clockwise, share.
pub fn shared(triangle: [DVec2; 3], polygon: &[DVec2]) -> Vec<DVec2> {
    shared_part(triangle, polygon).iter().map(|p| p.truncate()).collect()
}

/// The area that a triangle and a convex polygon share.
pub fn shared_area(triangle: [DVec2; 3], polygon: &[DVec2]) -> f64 {
    crate::geom::area(&shared_part(triangle, polygon))
}

fn shared_part(triangle: [DVec2; 3], polygon: &[DVec2]) -> Vec<DVec3> {
    let mut left: Vec<DVec3> = triangle.iter().map(|p| p.extend(0.0)).collect();
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let out = -(b - *a).perp().normalize_or_zero();
        left = clip(&left, &Plane { n: out.extend(0.0), d: out.dot(*a) }, 0.0);
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x0: f64, y0: f64, x1: f64, y1: f64) -> Vec<DVec2> {
        [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| DVec2::new(x, y)).to_vec()
    }

    #[test]
    fn a_corner_that_is_there_almost_twice_leaves_a_polygon_as_wide_as_it_is() {
        let triangle = [(0.0, 0.0), (0.4, 0.3), (0.0, 0.8)].map(|(x, y)| DVec2::new(x, y));
        let known = width(&triangle);
        // The least altitude: twice the area over the longest side.
        assert!((known - 0.4).abs() < 1e-12, "{known}");
        for k in 0..16 {
            for i in 0..3 {
                let mut twice = triangle.to_vec();
                twice.insert(i + 1, triangle[i] + DVec2::from_angle(f64::from(k) * 0.4) * 1e-15);
                assert!((width(&twice) - known).abs() < 1e-12, "{twice:?}: {}", width(&twice));
            }
        }
    }

    fn halves(s: &[DVec2]) -> [[DVec2; 3]; 2] {
        [[s[0], s[1], s[2]], [s[0], s[2], s[3]]]
    }

    fn open_area(open: &Open, whole: f64) -> f64 {
        match open {
            Open::Whole => whole,
            Open::Parts(parts) => parts.iter().map(shape_area).sum(),
        }
    }

    #[test]
    fn a_wall_with_a_door_leaves_the_door() {
        let face = square(0.0, 0.0, 5.0, 3.0);
        let wall: Vec<_> = [square(0.0, 0.0, 2.0, 3.0), square(3.0, 0.0, 5.0, 3.0), square(2.0, 2.1, 3.0, 3.0)]
            .iter()
            .flat_map(|s| halves(s))
            .collect();
        let open = open_part(&face, &wall, 1e-4);
        assert!((open_area(&open, 15.0) - 2.1).abs() < 1e-3);
    }

    #[test]
    fn cracks_close_and_slits_stay() {
        let face = square(0.0, 0.0, 2.0, 2.0);
        for (gap, open) in [(1e-7, false), (1e-4, false), (4e-3, true)] {
            let wall: Vec<_> =
                [square(0.0, 0.0, 1.0, 2.0), square(1.0 + gap, 0.0, 2.0, 2.0)].iter().flat_map(|s| halves(s)).collect();
            assert_eq!(open_area(&open_part(&face, &wall, 1e-3), 4.0) > 0.0, open, "gap {gap}");
        }
    }

    #[test]
    fn triangles_of_either_winding_close_a_face() {
        let face = square(0.0, 0.0, 1.0, 1.0);
        let [mut a, b] = halves(&face);
        a.reverse();
        assert_eq!(open_area(&open_part(&face, &[a, b], 1e-6), 1.0), 0.0);
        // One that holds all of it, either way round.
        let mut large = [DVec2::new(-1.0, -1.0), DVec2::new(4.0, -1.0), DVec2::new(-1.0, 4.0)];
        for _ in 0..2 {
            assert_eq!(open_area(&open_part(&face, &[large], 1e-6), 1.0), 0.0);
            large.reverse();
        }
    }

    #[test]
    fn a_corner_that_is_there_twice_takes_no_width_away() {
        let mut p = square(0.0, 0.0, 2.0, 1.0);
        p.insert(1, p[0]);
        p.push(p[4]);
        assert!((width(&p) - 1.0).abs() < 1e-12);
        assert_eq!(width(&[p[0]; 4]), 0.0);
    }

    #[test]
    fn hull_and_width_of_a_square_with_a_point_inside() {
        let mut p = square(0.0, 0.0, 2.0, 1.0);
        p.push(DVec2::new(0.5, 0.5));
        p.push(DVec2::new(1.0, 0.0));
        let hull = convex_hull(p);
        assert_eq!(hull.len(), 4);
        assert!((area(&hull) - 2.0).abs() < 1e-12 && (width(&hull) - 1.0).abs() < 1e-12);
    }
}
