//! Curves of lines and arcs, and the sections of a tube along one.

use super::section::Tangent;
use glam::DVec3;
use std::f64::consts::PI;

/// A part of a curve.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Piece {
    /// A line from one point to another.
    Line([DVec3; 2]),
    /// An arc of a circle.
    Arc(Arc),
}

/// An arc: from `middle + x`, `angle` radians towards `y`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Arc {
    /// The circle's centre.
    pub middle: DVec3,
    /// From the centre to the first point; its length is the radius.
    pub x: DVec3,
    /// Perpendicular to `x`, of the same length: the direction in which the arc starts.
    pub y: DVec3,
    /// Radians: above 0, at most 2 pi.
    pub angle: f64,
}

impl Arc {
    /// The point after `angle` radians.
    pub fn at(&self, angle: f64) -> DVec3 {
        self.middle + self.x * angle.cos() + self.y * angle.sin()
    }

    /// Radius of the circle.
    pub fn radius(&self) -> f64 {
        self.x.length()
    }
}

impl Piece {
    /// The end points.
    pub fn ends(&self) -> [DVec3; 2] {
        match self {
            Self::Line(ends) => *ends,
            Self::Arc(arc) => [arc.at(0.0), arc.at(arc.angle)],
        }
    }

    /// The directions at both ends, unit vectors; zero for a line of zero length.
    fn directions(&self) -> [DVec3; 2] {
        match self {
            Self::Line([a, b]) => [(*b - *a).normalize_or_zero(); 2],
            Self::Arc(arc) => [0.0, arc.angle].map(|t| (arc.y * t.cos() - arc.x * t.sin()).normalize_or_zero()),
        }
    }
}

/// Faults of a curve's points.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Odd {
    /// Repeated points.
    pub twice: u64,
    /// Corners where the curve reverses: the tube ends there, and another begins.
    pub back: u64,
}

/// Cosine below which a turn is a reversal, 179.4 degrees. Closer to -1: arcs of zero radius. Farther: sharp bends are cut.
const BACK: f64 = -0.999_95;
/// Cosine above which a turn is no corner: 0.003 degrees. The ring there tilts by half of that.
const STRAIGHT: f64 = 1.0 - 1e-9;

/// Curves of lines through points, with corners rounded by arcs of radius `bend`, or less if lines are too short: an arc uses at
/// most half of each line. A tube with sharp corners would have no surface there. Returns several curves if the line reverses,
/// none for fewer than two different points.
pub fn polyline(points: &[DVec3], closed: bool, bend: f64, odd: &mut Odd) -> Vec<Vec<Piece>> {
    let (points, closed) = distinct(points, closed, odd);
    let count = points.len();
    if count < 2 {
        return Vec::new();
    }
    let corners = if closed { count } else { count - 2 };
    let first = if closed { 0 } else { 1 };
    let mut curves = vec![Vec::new()];
    let mut from = if closed { (points[count - 1] + points[0]) / 2.0 } else { points[0] };
    let start = from;
    for k in first..first + corners {
        let [a, p, b] = [points[(k + count - 1) % count], points[k % count], points[(k + 1) % count]];
        let [u, v] = [(p - a).normalize_or_zero(), (b - p).normalize_or_zero()];
        let cos = u.dot(v);
        if cos < BACK {
            odd.back += 1;
            line(&mut curves, from, p);
            curves.push(Vec::new());
            from = p;
        } else if cos < STRAIGHT {
            let half = ((1.0 - cos) / (1.0 + cos)).sqrt();
            let room = 0.5 * p.distance(a).min(b.distance(p));
            let cut = (bend * half).min(room);
            let arc = corner(p, [u, v], cut, cut / half);
            line(&mut curves, from, arc.at(0.0));
            from = arc.at(arc.angle);
            curves.last_mut().into_iter().for_each(|curve| curve.push(Piece::Arc(arc)));
        }
    }
    line(&mut curves, from, if closed { start } else { points[count - 1] });
    curves.retain(|curve| !curve.is_empty());
    curves
}

/// Points without repeated ones, and whether the curve is still closed (two points are not).
pub(super) fn distinct(points: &[DVec3], closed: bool, odd: &mut Odd) -> (Vec<DVec3>, bool) {
    let mut points = points.to_vec();
    let count = points.len();
    points.dedup();
    odd.twice += (count - points.len()) as u64;
    if closed && points.len() > 1 && points.first() == points.last() {
        points.pop();
    }
    let closed = closed && points.len() > 2;
    (points, closed)
}

fn line(curves: &mut [Vec<Piece>], from: DVec3, to: DVec3) {
    if let Some(curve) = curves.last_mut().filter(|_| from != to) {
        curve.push(Piece::Line([from, to]));
    }
}

/// The arc that touches two lines through a corner, `cut` metres from it.
fn corner(p: DVec3, [u, v]: [DVec3; 2], cut: f64, radius: f64) -> Arc {
    let inward = (v - u).normalize_or_zero();
    let x = -(inward - u * inward.dot(u)).normalize_or_zero() * radius;
    let begin = p - u * cut;
    Arc { middle: begin - x, x, y: u * radius, angle: u.angle_between(v) }
}

/// A point of a curve with a section of the tube.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stop {
    /// The point, metres.
    pub place: DVec3,
    /// Source of its tangent.
    pub tangent: Tangent,
}

/// Points of a curve for a tube of `radius` that is nowhere farther than `error` from the tube along the curve (metres). A line
/// has two points. The first point of a `closed` curve is not repeated.
pub fn stops(pieces: &[Piece], closed: bool, radius: f64, error: f64) -> Vec<Stop> {
    let mut stops: Vec<Stop> = Vec::new();
    let count = pieces.len();
    for (k, piece) in pieces.iter().enumerate() {
        let before = if k > 0 { Some(k - 1) } else { closed.then(|| count - 1) };
        let is_line = |piece: &Piece| matches!(piece, Piece::Line(_));
        let tangent = match (before.map(|b| &pieces[b]), piece) {
            (_, Piece::Line(_)) => Tangent::After,
            (Some(b), _) if is_line(b) => Tangent::Before,
            _ => Tangent::Circle,
        };
        stops.push(Stop { place: piece.ends()[0], tangent });
        if let Piece::Arc(arc) = piece {
            let after = pieces.get(k + 1).or(if closed { pieces.first() } else { None });
            let beside = [before.map(|b| &pieces[b]), after].map(|piece| piece.map(is_line));
            let place = |angle| Stop { place: arc.at(angle), tangent: Tangent::Circle };
            stops.extend(angles(arc, radius, error, beside).into_iter().map(place));
        }
    }
    if let Some(last) = pieces.last().filter(|_| !closed) {
        let tangent = if matches!(last, Piece::Line(_)) { Tangent::Before } else { Tangent::Circle };
        stops.push(Stop { place: last.ends()[1], tangent });
    }
    stops
}

/// Angles of sections inside an arc. `beside`: whether the pieces before and after are lines. Next to another arc, a section lies
/// close to that end: its chord gives the tangent of the ring there.
fn angles(arc: &Arc, radius: f64, error: f64, beside: [Option<bool>; 2]) -> Vec<f64> {
    // The tube's outer side is farthest from its chords.
    let outer = arc.radius() + radius;
    let step = if error < outer { 2.0 * (1.0 - error / outer).acos() } else { PI };
    let count = (arc.angle / step.min(LARGEST_STEP)).ceil().clamp(1.0, MOST_STEPS) as u32;
    let even = arc.angle / f64::from(count);
    let close = (error / radius).min(even / 2.0);
    let mut angles: Vec<f64> = (1..count).map(|k| even * f64::from(k)).collect();
    let meets = beside.map(|beside| beside == Some(false));
    if count == 1 && beside.contains(&None) && meets == [false; 2] {
        // An open end needs a third point on the circle.
        angles.push(arc.angle / 2.0);
    }
    if meets[0] {
        angles.insert(0, close);
    }
    if meets[1] {
        angles.push(arc.angle - close);
    }
    angles
}

/// Most radians between sections of an arc: wider steps make a poor circle of three points.
const LARGEST_STEP: f64 = PI / 4.0;
/// Most sections of an arc. Fewer: a huge arc exceeds the error. More: a tiny error fills the memory.
const MOST_STEPS: f64 = 4096.0;

/// The sharpest angle between neighbouring pieces, radians; 0 for a smooth curve.
pub fn sharpest(pieces: &[Piece], closed: bool) -> f64 {
    let next = |k: usize| pieces.get(k + 1).or(if closed { pieces.first() } else { None });
    let joints = (0..pieces.len()).filter_map(|k| Some((pieces[k].directions()[1], next(k)?.directions()[0])));
    joints.map(|(u, v)| if u == DVec3::ZERO || v == DVec3::ZERO { 0.0 } else { u.angle_between(v) }).fold(0.0, f64::max)
}
