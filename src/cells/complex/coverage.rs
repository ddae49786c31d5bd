//! The open part of a face: the face minus all opaque triangles on it.
//!
//! Soundness: triangles grow by a square of half-width `seal` before subtraction, so a point that counts as closed is within `sqrt(2) *
//! seal` of a triangle's projection (and half a `seal` more in a sliver), and that triangle is within the coplanar tolerance of the face.
//! No segment with more clearance than the sum passes a closed point ([`crate::math::tolerance`]). Polygon booleans use integers (i_overlay), at
//! a resolution of 2^-30 of the face.

use super::polygon::{Shape, area, convex_hull, counter_clockwise, points, width};
use super::tiling::{joined, shared};
use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::single::SingleFloatOverlay;

/// A closed contour.
type Contour = Vec<[f64; 2]>;

/// The open part of a face.
#[derive(Clone, Debug)]
pub enum Open {
    /// All of it.
    Whole,
    /// These parts; empty where the face is closed.
    Parts(Vec<Shape>),
}

/// Narrower parts are rounding, in seals. This adds to the largest distance of a closed point from its triangle, so it is part of the
/// nesting of tolerances.
const CRUMB: f64 = 0.5;

/// The open part of a convex `face` under triangles in the same coordinates, in any winding.
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
    let over = over(face, triangles, seal);
    match at_a_glance(face, &over, seal) {
        Some(true) => return Open::Whole,
        Some(false) => return Open::Parts(Vec::new()),
        None => {}
    }
    let subject: Vec<[f64; 2]> = face.iter().map(|p| p.to_array()).collect();
    let grown = united(over.iter().map(|polygon| grown(polygon, seal)).collect());
    let mut parts = subject.overlay(&grown, OverlayRule::Difference, FillRule::NonZero);
    // Slivers along a triangle are rounding, unless the face is as thin itself.
    let least = (CRUMB * seal).min(0.9 * width(face));
    parts.retain(|shape| shape.first().is_some_and(|outer| width(&convex_hull(points(outer))) >= least));
    Open::Parts(parts)
}

/// The triangles that may cover part of a face, counter-clockwise. If they are many, they are clipped to the surroundings of the face, and
/// adjacent ones are joined.
fn over(face: &[DVec2], triangles: &[[DVec2; 3]], seal: f64) -> Vec<Vec<DVec2>> {
    let ends =
        |points: &[DVec2]| points.iter().fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[a, b], p| [a.min(*p), b.max(*p)]);
    let [low, high] = ends(face);
    let (low, high) = (low - AROUND * seal, high + AROUND * seal);
    let is_near = |t: &&[DVec2; 3]| {
        let [least, most] = ends(*t);
        least.cmple(high).all() && most.cmpge(low).all()
    };
    let near: Vec<Vec<DVec2>> = triangles.iter().filter(is_near).map(|t| counter_clockwise(*t).to_vec()).collect();
    if near.len() <= AT_ONCE {
        return near;
    }
    let corners = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
    joined(near.iter().map(|t| shared(t, &corners)), (SLIP * seal).powi(2))
}

/// Triangles farther than this from a face cover none of it, in seals: they grow by one seal, or by sqrt(2) along a diagonal.
const AROUND: f64 = 2.0;
/// Most contours subtracted at once, and most united at once. Grown triangles narrower than a seal all overlap, and the time is at least
/// quadratic. More: a curved wall of ten thousand faces takes minutes. Fewer: unnecessary booleans.
const AT_ONCE: usize = 48;
const TOGETHER: usize = 16;
/// If triangles are many, adjacent ones are joined first, if the extra area is at most the square of this, in seals. Larger: points beside
/// a triangle count as closed. Smaller: rounding prevents joining.
const SLIP: f64 = 0.1;

/// A convex polygon grown by `seal`.
fn grown(polygon: &[DVec2], seal: f64) -> Contour {
    let corners = polygon
        .iter()
        .flat_map(|p| [(-seal, -seal), (seal, -seal), (seal, seal), (-seal, seal)].map(|(x, y)| *p + DVec2::new(x, y)));
    convex_hull(corners.collect()).iter().map(|p| p.to_array()).collect()
}

/// Unites many contours, a few at a time, then the results, until one union is left.
fn united(contours: Vec<Contour>) -> Vec<Contour> {
    if contours.len() <= AT_ONCE {
        return contours;
    }
    let nothing: Vec<Contour> = Vec::new();
    let mut parts: Vec<Vec<Contour>> = contours.into_iter().map(|contour| vec![contour]).collect();
    while parts.len() > 1 {
        let union =
            |some: &[Vec<Contour>]| some.concat().overlay(&nothing, OverlayRule::Subject, FillRule::NonZero).concat();
        parts = parts.chunks(TOGETHER).map(union).collect();
    }
    parts.concat()
}

/// Width in seals from which triangles that only touch a face change it by at most a fiftieth, so that they are ignored.
const WIDE: f64 = 100.0;
/// Narrower faces go to the booleans, in seals: a crumb would be much of them.
const NARROW: f64 = 4.0;
/// Most convex parts on the way; faces with more go to the booleans.
const MOST_PARTS: usize = 12;

/// The fast path for most faces: entirely open, because no triangle meets them (`true`), or entirely closed (`false`).
///
/// To prove that a face is closed, triangles are subtracted one after the other, which leaves convex parts. If all parts together are no
/// wider than a crumb, no point of them is farther than that from a triangle.
fn at_a_glance(face: &[DVec2], polygons: &[Vec<DVec2>], seal: f64) -> Option<bool> {
    let wide = width(face);
    if wide <= NARROW * seal {
        return None;
    }
    let over: Vec<&Vec<DVec2>> = polygons.iter().filter(|polygon| meet(face, polygon)).collect();
    if over.is_empty() {
        return (wide > WIDE * seal).then_some(true);
    }
    let mut parts = vec![face.to_vec()];
    for polygon in over {
        parts = without(parts, polygon);
        if parts.len() > MOST_PARTS {
            return None;
        }
    }
    (parts.iter().map(|p| width(p)).sum::<f64>() <= CRUMB * seal).then_some(false)
}

/// Distance within which a corner duplicates the previous one, in least widths of a part: the edge between them has a random direction, and
/// would separate polygons that overlap. Larger: parts change. Smaller: nothing is subtracted from faces with duplicate corners.
const SAME_CORNER: f64 = 1e-3;

/// The open part of a convex `face`, counter-clockwise, as convex polygons; parts no wider than `least` are left out.
pub fn open_pieces(face: &[DVec2], triangles: &[[DVec2; 3]], least: f64) -> Vec<Vec<DVec2>> {
    let tidy = |mut part: Vec<DVec2>| {
        let is_same = |a: DVec2, b: DVec2| a.distance(b) <= SAME_CORNER * least;
        part.dedup_by(|b, a| is_same(*a, *b));
        while part.len() > 1 && is_same(part[0], part[part.len() - 1]) {
            part.pop();
        }
        Some(part).filter(|part| width(part) > least)
    };
    let mut parts: Vec<Vec<DVec2>> = tidy(face.to_vec()).into_iter().collect();
    for t in triangles {
        parts = without(parts, &counter_clockwise(*t)).into_iter().filter_map(tidy).collect();
    }
    parts
}

/// Convex polygons minus another, all counter-clockwise.
fn without(parts: Vec<Vec<DVec2>>, t: &[DVec2]) -> Vec<Vec<DVec2>> {
    let mut rest = Vec::new();
    for part in parts {
        if meet(&part, t) { less(part, t, &mut rest) } else { rest.push(part) }
    }
    rest
}

/// False only if an edge of one of two convex polygons, both counter-clockwise, separates them.
fn meet(a: &[DVec2], b: &[DVec2]) -> bool {
    let parts = |a: &[DVec2], b: &[DVec2]| {
        (0..a.len()).any(|i| {
            let (p, edge) = (a[i], a[(i + 1) % a.len()] - a[i]);
            b.iter().all(|&q| edge.perp_dot(q - p) <= 0.0)
        })
    };
    !parts(a, b) && !parts(b, a)
}

/// A convex polygon minus another, as convex polygons: the part beyond each edge of the other and inside all previous edges.
fn less(mut part: Vec<DVec2>, t: &[DVec2], out: &mut Vec<Vec<DVec2>>) {
    for i in 0..t.len() {
        let (p, edge) = (t[i], t[(i + 1) % t.len()] - t[i]);
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

#[cfg(test)]
mod tests {
    use super::super::polygon::shape_area;
    use super::*;

    fn square(x0: f64, y0: f64, x1: f64, y1: f64) -> Vec<DVec2> {
        [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| DVec2::new(x, y)).to_vec()
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

    /// A wall with a door, of more and narrower strips, down to half a seal.
    #[test]
    fn walls_of_many_triangles_leave_the_door_too() {
        let (face, seal) = (square(0.0, 0.0, 5.0, 3.0), 1e-3);
        for strips in [30, 300, 6_000] {
            let step = 3.0 / f64::from(strips);
            let strip = |i: i32| {
                let (low, high) = (step * f64::from(i), step * f64::from(i + 1));
                let whole = [square(0.0, low, 2.0, high), square(3.0, low, 5.0, high)];
                let above = (low >= 2.1 - 0.5 * step).then(|| square(2.0, low, 3.0, high));
                whole.into_iter().chain(above).flat_map(|s| halves(&s)).collect::<Vec<_>>()
            };
            let wall: Vec<_> = (0..strips).flat_map(strip).collect();
            let open = open_part(&face, &wall, seal);
            assert!((open_area(&open, 15.0) - 2.1).abs() < 0.01, "{strips}: {}", open_area(&open, 15.0));
            assert!(matches!(&open, Open::Parts(parts) if parts.len() == 1), "{strips}: {open:?}");
        }
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
        // One that contains all of it, in either winding.
        let mut large = [DVec2::new(-1.0, -1.0), DVec2::new(4.0, -1.0), DVec2::new(-1.0, 4.0)];
        for _ in 0..2 {
            assert_eq!(open_area(&open_part(&face, &[large], 1e-6), 1.0), 0.0);
            large.reverse();
        }
    }

    #[test]
    fn pieces_are_what_triangles_leave() {
        let p = DVec2::new;
        // A square with a duplicate corner, covered by two triangles, by one of them, and by none.
        let square = [p(0.0, 0.0), p(4.0, 0.0), p(4.0, 4.0), p(4.0, 4.0 - 1e-16), p(0.0, 4.0)];
        let halves = [[p(0.0, 0.0), p(4.0, 0.0), p(4.0, 4.0)], [p(0.0, 0.0), p(0.0, 4.0), p(4.0, 4.0)]];
        for (covers, open) in [(0, 16.0), (1, 8.0), (2, 0.0)] {
            let pieces = open_pieces(&square, &halves[..covers], 1e-3);
            assert!((pieces.iter().map(|piece| area(piece)).sum::<f64>() - open).abs() < 1e-9, "{pieces:?}");
        }
        // A hole of 1 x 1 in a frame of four rectangles.
        let rectangle = |a: DVec2, b: DVec2| [[a, p(b.x, a.y), b], [a, b, p(a.x, b.y)]];
        let frame = [(p(0., 0.), p(4., 1.)), (p(0., 2.), p(4., 4.)), (p(0., 1.), p(1., 2.)), (p(2., 1.), p(4., 2.))];
        let frame: Vec<[DVec2; 3]> = frame.iter().flat_map(|&(a, b)| rectangle(a, b)).collect();
        let pieces = open_pieces(&square, &frame, 1e-3);
        assert!((pieces.iter().map(|piece| area(piece)).sum::<f64>() - 1.0).abs() < 1e-9, "{pieces:?}");
    }
}
