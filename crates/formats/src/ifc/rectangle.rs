//! The smallest rectangle around points in plan, at any angle.

use glam::DVec2;

/// A rectangle: `axes[0]` and `axes[1]` are unit vectors, the second a quarter turn left of the first; it covers
/// `low <= p . axis <= high` for both.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Rectangle {
    /// Directions of the sides.
    pub(super) axes: [DVec2; 2],
    /// Least coordinates along the axes.
    pub(super) low: DVec2,
    /// Greatest coordinates along the axes.
    pub(super) high: DVec2,
}

impl Rectangle {
    /// Lengths of the sides.
    pub(super) fn size(&self) -> DVec2 {
        self.high - self.low
    }
}

/// The rectangle of least area around `points`; one side lies along an edge of their hull (Freeman, Shapira 1975). `None` for
/// fewer than two distinct points. Of equal areas, the first in the order of the hull.
pub(super) fn smallest_rectangle(points: impl IntoIterator<Item = DVec2>) -> Option<Rectangle> {
    let hull = hull(points.into_iter().collect());
    let mut best: Option<(f64, Rectangle)> = None;
    for (i, &a) in hull.iter().enumerate() {
        let Some(x) = (hull[(i + 1) % hull.len()] - a).try_normalize() else { continue };
        let axes = [x, x.perp()];
        let project = |p: &DVec2| DVec2::new(p.dot(axes[0]), p.dot(axes[1]));
        let low = hull.iter().map(project).fold(DVec2::INFINITY, DVec2::min);
        let high = hull.iter().map(project).fold(DVec2::NEG_INFINITY, DVec2::max);
        let area = (high - low).element_product();
        if best.as_ref().is_none_or(|(least, _)| area < least * (1.0 - 1e-9)) {
            best = Some((area, Rectangle { axes, low, high }));
        }
    }
    best.map(|(_, rectangle)| rectangle)
}

/// The convex hull, counter-clockwise (Andrew 1979).
pub(super) fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut hull: Vec<DVec2> = Vec::with_capacity(points.len() + 1);
    for upper in [false, true] {
        let start = hull.len();
        let mut add = |p: DVec2| {
            while hull.len() >= start + 2
                && (hull[hull.len() - 1] - hull[hull.len() - 2]).perp_dot(p - hull[hull.len() - 2]) <= 0.0
            {
                hull.pop();
            }
            hull.push(p);
        };
        if upper {
            points.iter().rev().for_each(|&p| add(p));
        } else {
            points.iter().for_each(|&p| add(p));
        }
        // The last point begins the other chain.
        hull.pop();
    }
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_rectangle_is_found_again() {
        let turn = DVec2::from_angle(0.6);
        let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.5), (0.0, 1.5), (2.0, 0.7), (1.0, 0.0)];
        let found = smallest_rectangle(corners.map(|(x, y)| turn.rotate(DVec2::new(x, y)))).unwrap();
        let mut size = found.size().to_array();
        size.sort_by(f64::total_cmp);
        assert!((size[0] - 1.5).abs() < 1e-12 && (size[1] - 4.0).abs() < 1e-12, "{found:?}");
        assert!(found.axes.iter().any(|a| a.perp_dot(turn).abs() < 1e-12));
    }

    #[test]
    fn points_on_a_line_or_fewer_than_two_are_no_trouble() {
        assert_eq!(smallest_rectangle([]), None);
        assert_eq!(smallest_rectangle([DVec2::ONE; 3]), None);
        let line = smallest_rectangle([DVec2::ZERO, DVec2::X, DVec2::X * 3.0]).unwrap();
        assert_eq!(line.size(), DVec2::new(3.0, 0.0));
    }
}
