//! Tubes, with all their sections in one list.

use super::curve::{Odd, Piece, Stop, distinct, polyline, stops};
use super::frame;
use super::section::Section;
use super::spline::spline;
use glam::DVec3;
use std::fmt;
use std::ops::Range;

/// Coordinates beyond this, metres, are treated as damage.
const FARTHEST: f64 = 1e12;

/// Cross-section and ends of tubes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Shape {
    /// Radius, metres.
    pub radius: f64,
    /// Radius of the hole, metres; 0 for none.
    pub inner: f64,
    /// Whether the ends are closed by a face.
    pub capped: bool,
}

/// A tube.
#[derive(Clone, PartialEq, Debug)]
pub struct Tube {
    /// Added to the sections' coordinates, metres.
    pub origin: DVec3,
    /// Its sections, as a range of [`Tubes::sections`]: two or more.
    pub sections: Range<u32>,
    /// Whether the last section is followed by the first.
    pub closed: bool,
    /// Whether the ends are closed by a face.
    pub capped: bool,
    /// Radius of the hole over the outer radius: 0 for none, below 1.
    pub inner: f32,
    /// Factor for the sections' radii, which have half precision: within 2^-11 of 1, except for radii below 6e-5 m.
    pub scale: f32,
    /// Largest distance of the curve's surface from straight lines between the rings of two sections, metres.
    pub error: f32,
}

impl Tube {
    /// Its segments, each named by its first section, as a range of [`Tubes::sections`].
    pub fn segments(&self) -> Range<u32> {
        self.sections.start..self.sections.end - u32::from(!self.closed)
    }

    /// The radius at one of its sections, metres.
    pub fn radius(&self, section: &Section) -> f32 {
        section.radius() * self.scale
    }
}

/// Some tubes.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Tubes {
    /// Sections, in the order of the tubes.
    pub sections: Vec<Section>,
    /// The tubes.
    pub tubes: Vec<Tube>,
}

/// Faults of curves: counted, not refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts {
    /// Repeated points and reversals.
    pub odd: Odd,
    /// Bends tighter than the tube's radius, whose inner side intersects itself.
    pub tight: u64,
}

/// Error of a curve that makes no tube.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum TubeError {
    /// Not finite, not above the hole's radius, or 0 or infinite in half precision (below 3e-8 m, above 65,504 m).
    Radius(f64),
    /// Fewer than two different points.
    Points,
    /// A coordinate that is not finite or beyond 1e12 m.
    Coordinate,
}

impl fmt::Display for TubeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Radius(radius) => {
                write!(
                    f,
                    "a radius of {radius} m: it must be above 0 and below 65,504 m (half precision), and above the hole's"
                )
            }
            Self::Points => write!(f, "fewer than two different points"),
            Self::Coordinate => write!(f, "a coordinate that is not finite, or beyond 1e12 m"),
        }
    }
}

impl std::error::Error for TubeError {}

impl Tubes {
    /// Adds tubes along a polyline: its corners become arcs of the tube's radius, or less if lines are too short. Adds several if
    /// the line reverses. Surfaces are within `error` metres of those of the curve.
    pub fn line(
        &mut self,
        points: &[DVec3],
        closed: bool,
        shape: Shape,
        error: f64,
        counts: &mut Counts,
    ) -> Result<(), TubeError> {
        check(points.iter().copied(), shape)?;
        let curves = polyline(points, closed, shape.radius, &mut counts.odd);
        if curves.is_empty() {
            return Err(TubeError::Points);
        }
        let is_whole = closed && curves.len() == 1;
        curves.iter().try_for_each(|pieces| self.curve(pieces, is_whole, shape, error, counts))
    }

    /// Adds a tube along lines and arcs; each piece continues the one before it, in the same direction.
    pub fn curve(
        &mut self,
        pieces: &[Piece],
        closed: bool,
        shape: Shape,
        error: f64,
        counts: &mut Counts,
    ) -> Result<(), TubeError> {
        check(pieces.iter().flat_map(Piece::ends), shape)?;
        let is_tight = |piece: &&Piece| matches!(piece, Piece::Arc(arc) if arc.radius() < shape.radius * (1.0 - TIGHT));
        counts.tight += pieces.iter().filter(is_tight).count() as u64;
        self.push(&stops(pieces, closed, shape.radius, error), closed, shape, error)
    }

    /// Adds a tube along a smooth curve through points.
    pub fn through(
        &mut self,
        points: &[DVec3],
        closed: bool,
        shape: Shape,
        error: f64,
        counts: &mut Counts,
    ) -> Result<(), TubeError> {
        check(points.iter().copied(), shape)?;
        let (points, closed) = distinct(points, closed, &mut counts.odd);
        self.push(&spline(&points, closed, shape.radius, error), closed, shape, error)
    }

    /// Adds a tube with sections at some points.
    fn push(&mut self, stops: &[Stop], closed: bool, shape: Shape, error: f64) -> Result<(), TubeError> {
        let start = self.sections.len();
        let radius = shape.radius as f32;
        let origin = stops.first().map_or(DVec3::ZERO, |stop| stop.place);
        for stop in stops {
            let section = Section::new((stop.place - origin).as_vec3().to_array(), radius, stop.tangent, 0.0);
            // Points that coincide in single precision are left out.
            if self.sections.len() == start || self.sections.last().is_some_and(|last| last.place != section.place) {
                self.sections.push(section);
            }
        }
        if self.sections.len() < start + 2 {
            self.sections.truncate(start);
            return Err(TubeError::Points);
        }
        let closed = closed && self.sections.len() > start + 2;
        frame::roll(&mut self.sections[start..], closed);
        let sections = start as u32..self.sections.len() as u32;
        let inner = (shape.inner / shape.radius) as f32;
        let scale = (shape.radius / f64::from(self.sections[start].radius())) as f32;
        self.tubes.push(Tube { origin, sections, closed, capped: shape.capped, inner, scale, error: error as f32 });
        Ok(())
    }

    /// Appends the tubes of another list, moved. Returns the offset of their section numbers.
    pub fn append(&mut self, other: Self, by: DVec3) -> u32 {
        let start = self.sections.len() as u32;
        self.sections.extend(other.sections);
        self.tubes.extend(other.tubes.into_iter().map(|tube| {
            let sections = tube.sections.start + start..tube.sections.end + start;
            Tube { origin: tube.origin + by, sections, ..tube }
        }));
        start
    }

    /// Adds the tubes to a hash.
    pub fn hash_into(&self, h: &mut xxhash_rust::xxh3::Xxh3) {
        for section in &self.sections {
            h.update(&section.bytes());
        }
        for tube in &self.tubes {
            for x in tube.origin.to_array().into_iter().chain([tube.inner, tube.scale, tube.error].map(f64::from)) {
                h.update(&x.to_bits().to_le_bytes());
            }
            h.update(&tube.sections.start.to_le_bytes());
            h.update(&[u8::from(tube.closed), u8::from(tube.capped)]);
        }
    }

    /// Each tube with segments in a range of [`Self::sections`], and those segments.
    pub fn parts(&self, segments: Range<u32>) -> impl Iterator<Item = (&Tube, Range<u32>)> {
        let first = self.tubes.partition_point(|tube| tube.sections.end <= segments.start);
        let reached = self.tubes[first..].iter().take_while(move |tube| tube.sections.start < segments.end);
        let part = move |tube: &Tube| tube.segments().start.max(segments.start)..tube.segments().end.min(segments.end);
        reached.map(move |tube| (tube, part(tube))).filter(|(_, part)| !part.is_empty())
    }

    /// The sections of a tube.
    pub fn of(&self, tube: &Tube) -> &[Section] {
        &self.sections[tube.sections.start as usize..tube.sections.end as usize]
    }
}

/// An arc is tight if its radius is below the tube's by more than this share, to allow for rounding.
const TIGHT: f64 = 1e-9;

fn check(places: impl IntoIterator<Item = DVec3>, shape: Shape) -> Result<(), TubeError> {
    let Shape { radius, inner, .. } = shape;
    let kept = half::f16::from_f64(radius);
    if !(kept > half::f16::ZERO && kept.is_finite() && (0.0..radius).contains(&inner)) {
        return Err(TubeError::Radius(radius));
    }
    // A NaN fails the comparison too.
    let is_sound = |p: DVec3| p.abs().cmple(DVec3::splat(FARTHEST)).all();
    if places.into_iter().all(is_sound) { Ok(()) } else { Err(TubeError::Coordinate) }
}
