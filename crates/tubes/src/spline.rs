//! Interpolating curves: centripetal Catmull-Rom splines.
//!
//! Based on: Catmull and Rom 1974; Barry and Goldman 1988 (evaluation); Yuksel, Schaefer, Keyser 2011 (knots by the root of the
//! distance: no loops or cusps between points).

use super::curve::Stop;
use super::section::Tangent;
use glam::DVec3;

/// Most halvings of a part between two points: 512 sections. More: points that are far apart fill the memory.
const DEEPEST: u32 = 9;
/// Cosine of three quarters of the largest turn between sections, 45 degrees.
const LEAST_COSINE: f64 = 0.831_469_612_302_545_2;

/// Points of the curve through `points` for a tube of `radius` that is no farther than about `error` from the tube along the
/// curve (metres), estimated at the middle and the quarters of each part. Neighbouring `points` must differ.
pub fn spline(points: &[DVec3], closed: bool, radius: f64, error: f64) -> Vec<Stop> {
    let count = points.len();
    let parts = if closed { count } else { count.saturating_sub(1) };
    let at = |k: usize| Stop { place: points[k % count], tangent: Tangent::Circle };
    let mut stops = Vec::new();
    for k in 0..parts {
        stops.push(at(k));
        let (b, c) = (points[k], points[(k + 1) % count]);
        // Beyond an open end the curve continues straight.
        let a = if k > 0 || closed { points[(k + count - 1) % count] } else { 2.0 * b - c };
        let d = if k + 2 < count || closed { points[(k + 2) % count] } else { 2.0 * c - b };
        let part = Part::new([a, b, c, d]);
        part.divide([0.0, 1.0], [b, part.at(0.5), c], [radius, error], DEEPEST, &mut stops);
    }
    if !closed && count > 0 {
        stops.push(at(count - 1));
    }
    stops
}

/// The curve between the second and the third of four points.
struct Part {
    points: [DVec3; 4],
    knots: [f64; 4],
    /// Inverse knot differences, by the first knot and the distance (one or two knots); 0 for equal knots.
    inverse: [[f64; 2]; 3],
}

impl Part {
    fn new(points: [DVec3; 4]) -> Self {
        let mut knots = [0.0; 4];
        for k in 1..4 {
            knots[k] = knots[k - 1] + points[k].distance(points[k - 1]).sqrt();
        }
        let over = |from: usize, on: usize| {
            let whole = knots.get(from + on).map_or(0.0, |to| to - knots[from]);
            if whole == 0.0 { 0.0 } else { 1.0 / whole }
        };
        let inverse = std::array::from_fn(|from| [over(from, 1), over(from, 2)]);
        Self { points, knots, inverse }
    }

    /// The point at a parameter, 0 to 1.
    fn at(&self, share: f64) -> DVec3 {
        let knots = &self.knots;
        let t = knots[1] + share * (knots[2] - knots[1]);
        let between = |p: DVec3, q: DVec3, from: usize, on: usize| {
            let inverse = self.inverse[from][on - 1];
            if inverse == 0.0 { p } else { p + (q - p) * ((t - knots[from]) * inverse) }
        };
        let [a, b, c, d] = self.points;
        let (ab, bc, cd) = (between(a, b, 0, 1), between(b, c, 1, 1), between(c, d, 2, 1));
        between(between(ab, bc, 0, 2), between(bc, cd, 1, 2), 1, 1)
    }

    /// Adds the points between two parameters. `three`: the points there and half-way.
    fn divide(
        &self,
        [from, to]: [f64; 2],
        three: [DVec3; 3],
        [radius, error]: [f64; 2],
        deepest: u32,
        stops: &mut Vec<Stop>,
    ) {
        let [start, middle, end] = three;
        let quarters = [0.25, 0.75].map(|share| self.at(from + share * (to - from)));
        let along = (end - start).try_normalize().unwrap_or(DVec3::X);
        let off = [quarters[0], middle, quarters[1]].map(|p| (p - start).reject_from_normalized(along).length_squared());
        let farthest = off.into_iter().fold(0.0, f64::max).sqrt() + radius * inside(start, quarters, end);
        if deepest == 0 || farthest <= error {
            return;
        }
        let half = (from + to) / 2.0;
        self.divide([from, half], [start, quarters[0], middle], [radius, error], deepest - 1, stops);
        stops.push(Stop { place: middle, tangent: Tangent::Circle });
        self.divide([half, to], [middle, quarters[1], end], [radius, error], deepest - 1, stops);
    }
}

/// Distance of a chord's tube inside the curve's, over its radius, from the curve's turn; infinite if the turn is too large.
fn inside(start: DVec3, quarters: [DVec3; 2], end: DVec3) -> f64 {
    let [first, last] = [quarters[0] - start, end - quarters[1]].map(DVec3::normalize_or_zero);
    if first == DVec3::ZERO || last == DVec3::ZERO {
        return 0.0;
    }
    if first.dot(last) < LEAST_COSINE {
        return f64::INFINITY;
    }
    // The outer quarters' directions differ by three quarters of the turn. Series give this angle from its chord, and 1 - cos of
    // half the turn, with an error below a thousandth up to the largest turn.
    let chord = first.distance_squared(last);
    let square = chord * (1.0 + chord / 12.0 * (1.0 + chord * (2.0 / 15.0)));
    let half_turn = square * (4.0 / 9.0);
    half_turn / 2.0 * (1.0 - half_turn / 12.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_touches_its_points_and_stays_with_a_line() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [4.0, 0.0, 0.0], [5.0, 0.0, 0.0]].map(DVec3::from);
        let line = spline(&points, false, 0.1, 1e-4);
        assert_eq!(
            line.iter().map(|stop| stop.place).collect::<Vec<_>>(),
            points,
            "a line has the points that it was given"
        );
        let circle: Vec<DVec3> =
            (0..8).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4).map(|a| DVec3::new(a.cos(), 0.0, a.sin())).collect();
        let closed = spline(&circle, true, 0.1, 1e-4);
        assert!(circle.iter().all(|p| closed.iter().any(|stop| stop.place == *p)));
        // Through eight points of a circle, the curve stays within 1 % of it.
        assert!(closed.iter().all(|stop| (stop.place.length() - 1.0).abs() < 0.01) && closed.len() > 40);
        // A hundredth of the error takes ten times as many sections, but parts are halved.
        let finer = spline(&circle, true, 0.1, 1e-6);
        assert!((5..=20).contains(&(finer.len() / closed.len())), "{} and {}", closed.len(), finer.len());
    }
}
