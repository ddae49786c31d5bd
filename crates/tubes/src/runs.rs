//! Runs of segments that one chord may replace, with the error of that chord. They are computed once, so that selecting distant
//! tubes is cheap. Near segments are divided further into parts.

use super::between::{self, BITS, Ring};
use super::tube::Tubes;
use glam::DVec3;
use std::ops::Range;

/// Factor for rounding errors to single precision.
const ROUNDING: f64 = 1.0 + 1e-6;

/// A cubic with more than this factor of the tube's error does not follow the curve. Less: rounding would exclude arcs.
const STRAYS: f64 = 1.01;

/// Runs of the segments of some objects. Each level has runs twice as long as the level below, starting at the first segment of
/// an object in a tube; the last run may be shorter. At level 6 runs are segments, below they are parts of segments.
#[derive(Clone, Debug, Default)]
pub struct Runs {
    /// Sorted by segment.
    pub(super) parts: Vec<Part>,
    /// Errors of runs of a segment or more: from the curve's surface to the chord's, metres. Negative for undivided segments.
    errors: Vec<f32>,
}

/// An object's segments in a tube.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Part {
    /// The tube's number.
    pub tube: u32,
    /// Range of [`Tubes::sections`].
    pub segments: Range<u32>,
    /// Index of its first error.
    first: u32,
}

/// A run: its level and its index there.
pub(super) type Run = (u32, u32);

impl Part {
    /// The level with a single run.
    pub fn top(&self) -> u32 {
        BITS + (self.segments.len() as u32).next_power_of_two().trailing_zeros()
    }

    /// Positions of a run's ends along the tube; the end of a closed tube's last run is past its last section.
    pub fn ends(&self, (level, i): Run) -> [u32; 2] {
        let [start, end] = self.all();
        let at = |i: u32| u64::from(end).min(u64::from(start) + (u64::from(i) << level)) as u32;
        [at(i), at(i + 1)]
    }

    /// Positions of the part's ends along the tube.
    pub fn all(&self) -> [u32; 2] {
        [self.segments.start, self.segments.end].map(|section| section << BITS)
    }

    /// The first and last half of a run, which may be the same.
    pub fn halves(&self, (level, i): Run) -> [Run; 2] {
        let below = level - 1;
        [(below, 2 * i), (below, (2 * i + 1).min(self.count(below) - 1))]
    }

    fn count(&self, level: u32) -> u32 {
        let [start, end] = self.all();
        u64::from(end - start).div_ceil(1 << level) as u32
    }
}

impl Runs {
    /// Computes the runs of objects, each a range of segments.
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

    /// Memory in bytes.
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

    /// Distance of the curve's surface from that of a run, metres.
    pub(super) fn error(&self, part: &Part, (level, i): Run) -> f64 {
        if level < BITS {
            let times = BITS - level;
            return between::of_halved(self.error(part, (BITS, i >> times)), times);
        }
        let before: u32 = (BITS..level).map(|level| part.count(level)).sum();
        f64::from(self.errors[(part.first + before + i) as usize].abs())
    }

    /// Whether a run can be divided into shorter ones: it has several segments, or is part of a segment that can be divided.
    pub(super) fn is_divided(&self, part: &Part, (level, i): Run) -> bool {
        let is_smooth = || self.errors[(part.first + (i >> (BITS - level))) as usize].is_sign_positive();
        level > BITS || (level > 0 && is_smooth())
    }

    /// Adds the errors of a part: the larger error of a run's halves plus the distance of their common ring from its surface.
    fn measure(&mut self, tubes: &Tubes, part: usize) {
        let part = self.parts[part].clone();
        let tube = &tubes.tubes[part.tube as usize];
        for segment in part.segments.clone() {
            // Between uneven sections of a spline the cubic may stray from the curve; then the chord is the curve.
            let (cubic, most) = (between::error(tubes, tube, segment), f64::from(tube.error));
            let is_stray = cubic.is_nan() || cubic > most * STRAYS;
            self.keep(if is_stray { most } else { cubic });
            self.errors.last_mut().filter(|_| is_stray).into_iter().for_each(|error| *error = -*error);
        }
        for level in BITS + 1..=part.top() {
            for run in (0..part.count(level)).map(|i| (level, i)) {
                let [first, last] = part.halves(run);
                let worse = self.error(&part, first).max(self.error(&part, last));
                let [from, to] = part.ends(run);
                let rings = [from, part.ends(first)[1], to].map(|number| Ring::at(tubes, tube, number));
                self.keep(if first == last { worse } else { worse + off(&rings) });
            }
        }
    }

    fn keep(&mut self, error: f64) {
        self.errors.push(if error.is_finite() { (error * ROUNDING) as f32 } else { f32::INFINITY });
    }
}

/// Largest distance of the second ring's points from the lines between points of the first and the third at the same angle.
fn off(rings: &[Ring; 3]) -> f64 {
    let of = |v: fn(&Ring) -> glam::Vec3| rings.each_ref().map(|ring| v(ring).as_dvec3());
    let places = of(|ring| ring.place);
    let [a, b, c] = places;
    let along = c - a;
    let share = ((b - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    let share = if share.is_nan() { 0.5 } else { share };
    let away = |[a, b, c]: [DVec3; 3]| b - a.lerp(c, share);
    let [place, x, y] = [places, of(|ring| ring.radius * ring.x), of(|ring| ring.radius * ring.y)].map(away);
    // The largest singular value of two columns.
    let [xx, yy, xy] = [x.length_squared(), y.length_squared(), x.dot(y)];
    let largest = (xx + yy) / 2.0 + ((xx - yy) / 2.0).hypot(xy);
    place.length() + largest.max(0.0).sqrt()
}
