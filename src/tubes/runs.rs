//! Runs of segments that one chord may replace, with how far the surface is from the chord's: worked out once, so that what is far away costs
//! little to choose.

use super::frame::{across, tangent};
use super::section::{Section, Tangent};
use super::tube::{Tube, Tubes};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Errors are kept in single precision: by this much more.
const ROUNDING: f64 = 1.0 + 1e-6;

/// Runs of the segments of some objects. Those of a level are of twice as many segments as those of the level below, from the first segment
/// of an object in a tube on; the last one is of what is left.
#[derive(Clone, Debug, Default)]
pub struct Runs {
    /// In the order of their segments.
    pub(super) parts: Vec<Part>,
    /// Of runs of two segments or more, metres: how far the curve's surface is from the chord's.
    errors: Vec<f32>,
}

/// An object's segments in a tube.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Part {
    /// The tube's number.
    pub tube: u32,
    /// As a range of [`Tubes::sections`].
    pub segments: Range<u32>,
    /// Where its errors begin.
    first: u32,
}

/// A run: its level and its number there.
pub(super) type Run = (u32, u32);

impl Part {
    /// The level at which one run is all of it.
    pub fn top(&self) -> u32 {
        (self.segments.len() as u32).next_power_of_two().trailing_zeros()
    }

    /// Sections at a run's ends; the second one of a closed tube's last run is past its last section.
    pub fn ends(&self, (level, i): Run) -> [u32; 2] {
        let Range { start, end } = self.segments;
        [start + (i << level), end.min(start.saturating_add((i + 1) << level))]
    }

    /// The runs that a run is of, first and last, which may be one.
    pub fn halves(&self, (level, i): Run) -> [Run; 2] {
        let below = level - 1;
        [(below, 2 * i), (below, (2 * i + 1).min(self.count(below) - 1))]
    }

    fn count(&self, level: u32) -> u32 {
        (self.segments.len() as u32).div_ceil(1 << level)
    }
}

impl Runs {
    /// Of objects, each a range of segments.
    pub fn new(tubes: &Tubes, objects: impl Iterator<Item = Range<u32>>) -> Self {
        let mut runs = Self::default();
        for segments in objects.filter(|segments| !segments.is_empty()) {
            let tube = |segment: u32| tubes.tubes.partition_point(|tube| tube.sections.end <= segment) as u32;
            let parts = tubes.parts(segments);
            runs.parts.extend(parts.map(|(_, segments)| Part { tube: tube(segments.start), segments, first: 0 }));
        }
        runs.parts.sort_by_key(|part| part.segments.start);
        for k in 0..runs.parts.len() {
            runs.parts[k].first = runs.errors.len() as u32;
            runs.measure(tubes, k);
        }
        runs
    }

    /// Bytes that they take.
    pub fn bytes(&self) -> usize {
        4 * self.errors.len() + size_of::<Part>() * self.parts.len()
    }

    /// The parts of an object.
    pub(super) fn of(&self, segments: Range<u32>) -> &[Part] {
        let at = |section: u32| self.parts.partition_point(|part| part.segments.start < section);
        &self.parts[at(segments.start)..at(segments.end)]
    }

    /// The part that begins with a segment.
    pub(super) fn beginning(&self, segment: u32) -> Option<&Part> {
        self.of(segment..segment + 1).first()
    }

    /// The part that ends before a segment.
    pub(super) fn ending(&self, segment: u32) -> Option<&Part> {
        let before = self.parts.partition_point(|part| part.segments.start < segment).checked_sub(1)?;
        self.parts.get(before).filter(|part| part.segments.end == segment)
    }

    /// How far the curve's surface is from that of a run, metres.
    pub(super) fn error(&self, tubes: &Tubes, part: &Part, (level, i): Run) -> f64 {
        if level == 0 {
            return of_segment(tubes, &tubes.tubes[part.tube as usize], part.segments.start + i);
        }
        let before: u32 = (1..level).map(|level| part.count(level)).sum();
        f64::from(self.errors[(part.first + before + i) as usize])
    }

    /// Adds the errors of a part: a run is as far off as the worse of its halves, and their middle ring is from the run's surface.
    fn measure(&mut self, tubes: &Tubes, part: usize) {
        let part = self.parts[part].clone();
        let tube = &tubes.tubes[part.tube as usize];
        for level in 1..=part.top() {
            for run in (0..part.count(level)).map(|i| (level, i)) {
                let [first, last] = part.halves(run);
                let worse = self.error(tubes, &part, first).max(self.error(tubes, &part, last));
                let [from, to] = part.ends(run);
                let rings = [from, part.ends(first)[1], to].map(|section| Ring::of(tubes, tube, section));
                let error = if first == last { worse } else { worse + off(&rings) };
                self.errors.push(if error.is_finite() { (error * ROUNDING) as f32 } else { f32::INFINITY });
            }
        }
    }
}

/// How far the curve's surface is from that of a segment, metres. Where the curve is a line, they are the same.
fn of_segment(tubes: &Tubes, tube: &Tube, segment: u32) -> f64 {
    if tubes.sections[segment as usize].tangent() == Tangent::After { 0.0 } else { f64::from(tube.error) }
}

/// The number of the section at the end of a segment: that of a closed tube's last one is its first.
pub(super) fn section(tube: &Tube, number: u32) -> u32 {
    if number == tube.sections.end { tube.sections.start } else { number }
}

/// A ring: its middle, and where its points lead from there at no angle and at a right one.
struct Ring {
    place: DVec3,
    x: DVec3,
    y: DVec3,
}

impl Ring {
    fn of(tubes: &Tubes, tube: &Tube, number: u32) -> Self {
        let (sections, i) = (tubes.of(tube), (section(tube, number) - tube.sections.start) as usize);
        let (section, [x, y]) = (&sections[i], across(tangent(sections, i, tube.closed)));
        let (sin, cos) = section.roll().sin_cos();
        let axis = |v: Vec3| (section.radius() * v).as_dvec3();
        Self { place: place(section), x: axis(cos * x + sin * y), y: axis(cos * y - sin * x) }
    }
}

/// Where a section is, relative to the tube's origin.
pub(super) fn place(section: &Section) -> DVec3 {
    Vec3::from(section.place).as_dvec3()
}

/// How far points of the second ring are, at most, from those of the same angle on lines from the first ring to the third.
fn off([a, b, c]: &[Ring; 3]) -> f64 {
    let along = c.place - a.place;
    let share = ((b.place - a.place).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    let share = if share.is_nan() { 0.5 } else { share };
    let [place, x, y] =
        [[a.place, b.place, c.place], [a.x, b.x, c.x], [a.y, b.y, c.y]].map(|[a, b, c]| b - a.lerp(c, share));
    // The largest singular value of two columns.
    let [xx, yy, xy] = [x.length_squared(), y.length_squared(), x.dot(y)];
    let largest = (xx + yy) / 2.0 + ((xx - yy) / 2.0).hypot(xy);
    place.length() + largest.max(0.0).sqrt()
}
