//! Polygons in a plane: areas, hulls, widths, and intersections of a triangle with a convex polygon.

use crate::math::geom::{Plane, clip};
use glam::{DVec2, DVec3};

/// A polygon: an outer contour, then holes.
pub type Shape = Vec<Vec<[f64; 2]>>;

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

/// Area of a shape without its holes.
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

/// The width of a convex polygon: the least distance of two parallel lines that enclose it.
pub fn width(hull: &[DVec2]) -> f64 {
    if hull.len() < 3 {
        return 0.0;
    }
    // A duplicate corner gives no edge and no direction. A nearly duplicate corner gives an edge of random direction, with the rest of the
    // hull on either side: so the extent counts both sides.
    let span = |i: usize| {
        let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
        let n = (b - a).perp().try_normalize()?;
        let across = hull.iter().map(|p| n.dot(*p - a));
        Some(across.clone().fold(0.0, f64::max) - across.fold(0.0, f64::min))
    };
    (0..hull.len()).filter_map(span).reduce(f64::min).unwrap_or(0.0)
}

/// The intersection of a triangle and a convex polygon, both counter-clockwise.
pub fn shared(triangle: [DVec2; 3], polygon: &[DVec2]) -> Vec<DVec2> {
    shared_part(triangle, polygon).iter().map(|p| p.truncate()).collect()
}

/// The area of the intersection of a triangle and a convex polygon.
pub fn shared_area(triangle: [DVec2; 3], polygon: &[DVec2]) -> f64 {
    crate::math::geom::area(&shared_part(triangle, polygon))
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
