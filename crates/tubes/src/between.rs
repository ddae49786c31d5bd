//! Rings of a tube at its sections and between them: the curve between two sections, and its distance from the chord.
//!
//! Between two sections the curve is a cubic with their tangents, of the length of an arc's at both ends. It deviates from an arc
//! by 5e-6 of the radius (at 45 degrees, the most between two sections).

use super::frame::{across, tangent};
use super::section::{Section, Tangent};
use super::tube::{Tube, Tubes};
use glam::{DVec3, Vec3};

/// Low bits of a position along a tube: the step from a section towards the next. The bits above are the section's number.
pub(super) const BITS: u32 = 6;
/// Steps from one section to the next.
pub(super) const STEPS: u32 = 1 << BITS;
/// Most sections that 32-bit positions can address.
pub const MOST_SECTIONS: usize = 1 << (u32::BITS - BITS);
/// Halving a curve reduces its distance from the chord by this factor: 1/4, a little more for arcs of up to 90 degrees.
const NEARER: f64 = 0.27;

/// A ring: its centre, two perpendicular unit axes (`x` at angle 0) and its radius.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    pub place: Vec3,
    pub x: Vec3,
    pub y: Vec3,
    pub radius: f32,
}

/// A part of a curve, from one section to the next.
struct Cubic {
    /// Metres, relative to the tube's origin.
    points: [Vec3; 4],
    tangents: [Vec3; 2],
    /// Indices of the sections in the tube.
    ends: [usize; 2],
}

/// The section at the end of a segment; in a closed tube, the last segment ends at the first section.
pub(super) fn section(tube: &Tube, number: u32) -> u32 {
    if number == tube.sections.end { tube.sections.start } else { number }
}

/// The curve's point at a position, metres relative to the tube's origin.
pub(super) fn place_at(tubes: &Tubes, tube: &Tube, number: u32) -> DVec3 {
    let step = number % STEPS;
    let place = if step == 0 {
        tubes.sections[section(tube, number / STEPS) as usize].place.into()
    } else {
        Cubic::new(tubes, tube, number / STEPS).at(step as f32 / STEPS as f32).0
    };
    place.as_dvec3()
}

impl Ring {
    /// The ring at a position along a tube: [`STEPS`] times the section's number, plus steps towards the next.
    pub fn at(tubes: &Tubes, tube: &Tube, number: u32) -> Self {
        let (sections, step) = (tubes.of(tube), number % STEPS);
        let i = (section(tube, number / STEPS) - tube.sections.start) as usize;
        if step == 0 {
            return Self::of(tube, &sections[i], tangent(sections, i, tube.closed));
        }
        let cubic = Cubic::new(tubes, tube, number / STEPS);
        let share = step as f32 / STEPS as f32;
        let (place, tangent) = cubic.at(share);
        let rings = [0, 1].map(|k| Self::of(tube, &sections[cubic.ends[k]], cubic.tangents[k]));
        let [a, b] = [0, 1].map(|k| transported(rings[k].x, cubic.tangents[k], tangent));
        let x = (a.lerp(b, share)).try_normalize().unwrap_or(a);
        let radius = rings[0].radius + (rings[1].radius - rings[0].radius) * share;
        Self { place, x, y: tangent.cross(x), radius }
    }

    fn of(tube: &Tube, section: &Section, tangent: Vec3) -> Self {
        let ([x, y], (sin, cos)) = (across(tangent), section.roll().sin_cos());
        Self { place: section.place.into(), x: cos * x + sin * y, y: cos * y - sin * x, radius: tube.radius(section) }
    }

    /// The ring's point at an angle (radians), `scale` radii from the centre.
    pub fn point(&self, angle: f32, scale: f32) -> Vec3 {
        let (sin, cos) = angle.sin_cos();
        self.place + scale * self.radius * (cos * self.x + sin * self.y)
    }
}

impl Cubic {
    fn new(tubes: &Tubes, tube: &Tube, number: u32) -> Self {
        let sections = tubes.of(tube);
        let ends = [number, section(tube, number + 1)].map(|number| (number - tube.sections.start) as usize);
        let [from, to] = ends.map(|i| Vec3::from(sections[i].place));
        let tangents = ends.map(|i| tangent(sections, i, tube.closed));
        let chord = to - from;
        let along = chord.try_normalize().unwrap_or(tangents[0]);
        // Length of an arc's tangents: 2/3 of the chord over 1 + cos of half its angle.
        let [a, b] = tangents.map(|t| t * (chord.length() * 2.0 / 3.0 / (1.0 + t.dot(along).max(0.0))));
        Self { points: [from, from + a, to - b, to], tangents, ends }
    }

    /// Point and direction at a parameter, 0 to 1.
    fn at(&self, t: f32) -> (Vec3, Vec3) {
        let [a, b, c, d] = self.points;
        let (ab, bc, cd) = (a.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
        let (abc, bcd) = (ab.lerp(bc, t), bc.lerp(cd, t));
        (abc.lerp(bcd, t), (bcd - abc).try_normalize().unwrap_or(self.tangents[0]))
    }
}

/// Upper bound of the distance between the curve's surface and the straight lines between the rings of a segment, metres.
pub(super) fn error(tubes: &Tubes, tube: &Tube, segment: u32) -> f64 {
    let sections = &tubes.sections;
    if sections[segment as usize].tangent() == Tangent::After {
        return 0.0;
    }
    let Cubic { points, tangents, .. } = Cubic::new(tubes, tube, segment);
    let [a, b, c, d] = points.map(|p| p.as_dvec3());
    let along = (d - a).normalize_or_zero();
    // The second differences of a cubic bound its distance from the chord.
    let bend = [a - 2.0 * b + c, b - 2.0 * c + d].map(|v| (v - along * v.dot(along)).length());
    let leg = (c - b).normalize_or(along);
    let turn = tangents.map(|t| t.as_dvec3().dot(leg).clamp(-1.0, 1.0));
    let radius = f64::from(tube.radius(&sections[segment as usize]));
    0.75 * bend[0].max(bend[1]) + radius * (1.0 - turn[0].min(turn[1]))
}

/// The error of a part of a segment that was halved `times` times.
pub(super) fn of_halved(error: f64, times: u32) -> f64 {
    error * NEARER.powi(times as i32)
}

/// A vector perpendicular to one tangent, rotated to another one the shortest way.
fn transported(v: Vec3, from: Vec3, to: Vec3) -> Vec3 {
    let sum = from + to;
    let half = 1.0 + from.dot(to);
    if half > 0.0 { v - sum * (v.dot(to) / half) } else { v }
}
