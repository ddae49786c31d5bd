//! Curves that touch points: centripetal Catmull-Rom splines.
//!
//! Based on: Catmull and Rom 1974; Barry and Goldman 1988 (how a point is found); Yuksel, Schaefer, Keyser 2011 (steps by the root of the
//! distance: no loops, no cusps between points).

use super::curve::Stop;
use super::section::Tangent;
use glam::DVec3;

/// Halvings of a part between two points, at most: 512 sections. More: points that are far apart fill the memory.
const DEEPEST: u32 = 9;
/// Radians that a curve turns between sections, at most.
const LARGEST_TURN: f64 = std::f64::consts::FRAC_PI_4;

/// Points of the curve through `points`, of which no two that follow each other are the same, so that a tube of `radius` between them is no
/// farther than about `error` from the tube along the curve: metres, judged in the middle and the quarters of each part.
pub fn spline(points: &[DVec3], closed: bool, radius: f64, error: f64) -> Vec<Stop> {
    let count = points.len();
    let parts = if closed { count } else { count.saturating_sub(1) };
    let at = |k: usize| Stop { place: points[k % count], tangent: Tangent::Circle };
    let mut stops = Vec::new();
    for k in 0..parts {
        stops.push(at(k));
        let (b, c) = (points[k], points[(k + 1) % count]);
        // Beyond an open end, the curve goes on as it came.
        let a = if k > 0 || closed { points[(k + count - 1) % count] } else { 2.0 * b - c };
        let d = if k + 2 < count || closed { points[(k + 2) % count] } else { 2.0 * c - b };
        let part = Part::new([a, b, c, d]);
        part.divide([0.0, 1.0], [b, c], radius, error, DEEPEST, &mut stops);
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
}

impl Part {
    fn new(points: [DVec3; 4]) -> Self {
        let mut knots = [0.0; 4];
        for k in 1..4 {
            knots[k] = knots[k - 1] + points[k].distance(points[k - 1]).sqrt();
        }
        Self { points, knots }
    }

    /// The point at a share of the way, 0 to 1.
    fn at(&self, share: f64) -> DVec3 {
        let knots = &self.knots;
        let t = knots[1] + share * (knots[2] - knots[1]);
        let between = |p: DVec3, q: DVec3, from: usize, to: usize| {
            let whole = knots[to] - knots[from];
            if whole == 0.0 { p } else { (p * (knots[to] - t) + q * (t - knots[from])) / whole }
        };
        let [a, b, c, d] = self.points;
        let (ab, bc, cd) = (between(a, b, 0, 1), between(b, c, 1, 2), between(c, d, 2, 3));
        between(between(ab, bc, 0, 2), between(bc, cd, 1, 3), 1, 2)
    }

    fn divide(&self, [from, to]: [f64; 2], ends: [DVec3; 2], radius: f64, error: f64, deepest: u32, stops: &mut Vec<Stop>) {
        let quarters = [0.25, 0.5, 0.75].map(|share| self.at(from + share * (to - from)));
        let chord = ends[1] - ends[0];
        let along = chord.normalize_or_zero();
        let off = quarters.map(|p| (p - ends[0]).reject_from(if along == DVec3::ZERO { DVec3::X } else { along }).length());
        let [first, last] = [quarters[0] - ends[0], ends[1] - quarters[2]].map(DVec3::normalize_or_zero);
        // Directions of the outer quarters are those of three quarters of the turn.
        let turn = if first == DVec3::ZERO || last == DVec3::ZERO { 0.0 } else { first.angle_between(last) * 4.0 / 3.0 };
        let farthest = off.into_iter().fold(0.0, f64::max) + radius * (1.0 - (turn / 2.0).cos());
        if deepest == 0 || (farthest <= error && turn <= LARGEST_TURN) {
            return;
        }
        let (half, middle) = ((from + to) / 2.0, quarters[1]);
        self.divide([from, half], [ends[0], middle], radius, error, deepest - 1, stops);
        stops.push(Stop { place: middle, tangent: Tangent::Circle });
        self.divide([half, to], [middle, ends[1]], radius, error, deepest - 1, stops);
    }
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
        // A hundredth of the error takes ten times the sections, but parts are halved.
        let finer = spline(&circle, true, 0.1, 1e-6);
        assert!((5..=20).contains(&(finer.len() / closed.len())), "{} and {}", closed.len(), finer.len());
    }
}
