//! Prisms around tubes: the tubes' shape in a bake.
//!
//! A prism of six sides follows straight lines between some of a tube's sections and contains the whole tube between them. Two
//! lines meet in the plane that bisects their angle, and share their corners there.

use super::frame::{across, tangent};
use super::tube::{Tube, Tubes};
use glam::{DVec3, Vec3};
use std::f64::consts::{FRAC_PI_3, FRAC_PI_6};
use std::ops::Range;

const SIDES: usize = 6;
/// Largest distance of sections from their line, as a share of the radius. Larger: fewer triangles, thicker prisms.
const BULGE: f64 = 0.125;
/// Most sections that one line replaces.
const LONGEST_RUN: usize = 64;
/// Cosine of a turn above which two prisms meet. Less: long tips at sharp corners.
const BLUNT: f64 = 0.5;
/// Rounding of single-precision corners, as a share of the radius.
const ROUNDING: f64 = 1.0 / 1_048_576.0;
/// Least distance of a prism's sides, as a share of the coordinates: thinner prisms have triangles of zero area.
const LEAST: f64 = 64.0 * f64::EPSILON;
/// Least length beyond the ends and between two turns, as a share of the sides' distance.
const SHORTEST: f64 = 1e-3;

/// One or several closed surfaces around some segments of a tube.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Prism {
    /// Corners, metres relative to the tube's origin.
    pub positions: Vec<DVec3>,
    /// Counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The prism around some segments of a tube. It fills the tube's hole.
pub fn prism(tubes: &Tubes, tube: &Tube, segments: Range<u32>) -> Prism {
    let sections = tubes.of(tube);
    let first = (segments.start - tube.sections.start) as usize;
    let stops: Vec<usize> = (first..=first + segments.len()).map(|i| i % sections.len()).collect();
    let places: Vec<DVec3> = stops.iter().map(|&i| Vec3::from(sections[i].place).as_dvec3()).collect();
    let radius = stops.iter().map(|&i| f64::from(tube.radius(&sections[i]))).fold(0.0, f64::max);
    let lines = lines(&places, BULGE * radius);
    let bulge = lines.windows(2).map(|ends| bulge(&places[ends[0]..=ends[1]])).fold(0.0, f64::max);
    let farthest = places.iter().map(|p| (p + tube.origin).abs().max_element()).fold(0.0, f64::max);
    let reach = (radius * (1.0 + ROUNDING) + bulge + f64::from(tube.error)).max(LEAST * farthest);
    let points: Vec<DVec3> = lines.iter().map(|&k| places[k]).collect();
    // Rings tilt, so those near an end may reach beyond it.
    let sine = |k: usize, along: DVec3| tangent(sections, stops[k], tube.closed).as_dvec3().cross(along).length();
    let beyond = |end: DVec3, along: DVec3| {
        let near = (0..places.len()).filter(|&k| places[k].distance(end) < 2.0 * reach);
        let farthest = near.map(|k| (places[k] - end).dot(along) + reach * sine(k, along)).fold(0.0, f64::max);
        farthest.clamp(SHORTEST * reach, reach)
    };
    let directions: Vec<DVec3> = points.windows(2).map(|p| (p[1] - p[0]).normalize_or(DVec3::X)).collect();
    let [first, last] = [-directions[0], directions[directions.len() - 1]];
    let ends = [beyond(places[0], first), beyond(places[places.len() - 1], last)];
    around(&points, &directions, reach, ends)
}

/// Sections that remain as ends of lines: the first, the last, and some between, so that the lines stay near the others.
fn lines(places: &[DVec3], most: f64) -> Vec<usize> {
    let (mut kept, mut from) = (vec![0], 0);
    while from + 1 < places.len() {
        let last = places.len().min(from + LONGEST_RUN) - 1;
        let is_near = |&to: &usize| bulge(&places[from..=to]) <= most;
        let to = (from + 2..=last).take_while(is_near).last().unwrap_or(from + 1);
        kept.push(to);
        from = to;
    }
    kept
}

/// Largest distance of points from the line between the first and the last; infinite if they go back along it.
fn bulge(places: &[DVec3]) -> f64 {
    let (from, to) = (places[0], places[places.len() - 1]);
    let Some(along) = (to - from).try_normalize() else { return if places.len() > 2 { f64::INFINITY } else { 0.0 } };
    let goes_on = places.windows(2).all(|pair| (pair[1] - pair[0]).dot(along) >= BLUNT * pair[0].distance(pair[1]));
    let off = places.iter().map(|p| (p - from).reject_from_normalized(along).length()).fold(0.0, f64::max);
    if goes_on { off } else { f64::INFINITY }
}

/// Prisms around lines, at least `reach` metres from them. `ends`: metres beyond the first and the last point.
fn around(points: &[DVec3], directions: &[DVec3], reach: f64, ends: [f64; 2]) -> Prism {
    let mut prism = Prism::default();
    let mut begin = ends[0];
    let mut ring: Option<[DVec3; SIDES]> = None;
    for (k, &along) in directions.iter().enumerate() {
        let from = *ring.get_or_insert_with(|| prism.open(hexagon(points[k] - along * begin, along, reach)));
        let next = directions.get(k + 1);
        let bisector = next.filter(|next| next.dot(along) >= BLUNT).map(|next| along + next);
        let slide = |plane: DVec3| from.map(|p| p + along * ((points[k + 1] - p).dot(plane) / along.dot(plane)));
        // If the line is too short for its turns, a prism ends and another begins.
        let goes_on = |to: &[DVec3; SIDES]| from.iter().zip(to).all(|(from, to)| (to - from).dot(along) > SHORTEST * reach);
        if let Some(to) = bisector.map(slide).filter(goes_on) {
            prism.sides(to);
            ring = Some(to);
        } else {
            begin = if next.is_some() { reach } else { ends[1] };
            let past = along * begin;
            prism.sides(slide(along).map(|p| p + past));
            prism.close();
            ring = None;
        }
    }
    prism
}

/// Six corners around a point, perpendicular to a direction; the sides are `reach` away from the point.
fn hexagon(at: DVec3, along: DVec3, reach: f64) -> [DVec3; SIDES] {
    let [x, y] = across(along.as_vec3()).map(|v| v.as_dvec3());
    let x = x.reject_from_normalized(along).normalize();
    let y = along.cross(x) * y.dot(along.cross(x)).signum();
    std::array::from_fn(|k| {
        let (sin, cos) = (k as f64 * FRAC_PI_3).sin_cos();
        at + reach / FRAC_PI_6.cos() * (cos * x + sin * y)
    })
}

impl Prism {
    /// Starts with a cap.
    fn open(&mut self, ring: [DVec3; SIDES]) -> [DVec3; SIDES] {
        let start = self.positions.len() as u32;
        self.positions.extend(ring);
        self.triangles.extend((1..SIDES as u32 - 1).map(|k| [start, start + k + 1, start + k]));
        ring
    }

    /// Adds sides from the last ring to another.
    fn sides(&mut self, ring: [DVec3; SIDES]) {
        let start = self.positions.len() as u32;
        let before = start - SIDES as u32;
        self.positions.extend(ring);
        for k in 0..SIDES as u32 {
            let next = (k + 1) % SIDES as u32;
            let [a, b, c, d] = [before + k, before + next, start + k, start + next];
            self.triangles.extend([[a, b, c], [c, b, d]]);
        }
    }

    /// Ends with a cap.
    fn close(&mut self) {
        let start = (self.positions.len() - SIDES) as u32;
        self.triangles.extend((1..SIDES as u32 - 1).map(|k| [start, start + k, start + k + 1]));
    }
}
