//! The distance of drawn tubes from their exact surface, and the time of selection, by limit in pixels.
//!
//! The exact surface between two sections is a tube along the arc with their tangents: exact for lines and arcs, and within the
//! importers' tolerance for splines.

use super::tube_weights::weight_error;
use enfilade::math::random::Prng;
use enfilade::scene::Scene;
use enfilade::scene::rays::closest_on_triangle;
use enfilade_tubes::{Band, Runs, SIDES, Selection, Tube, Tubes, View, Wall, part};
use glam::DVec3;
use serde::Serialize;
use std::f64::consts::TAU;
use std::time::Instant;

/// Limits of error in pixels, ascending.
const LIMITS: [f64; 6] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0];
/// Sampled points of surfaces per view.
const SAMPLES: usize = 500;
/// Selections per view; the fastest counts.
const REPEATS: usize = 3;
/// An arc of fewer radians counts as a line: the handles are equal within rounding.
const STRAIGHT: f64 = 1e-4;

/// A camera, relative to the scene's origin.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TubeView {
    /// Metres.
    pub eye: DVec3,
    /// Rows whose dot products with the vector from the eye are clip-space x, y and w.
    pub rows: [DVec3; 3],
    /// Metres to the near plane along the view.
    pub near: f64,
    /// Size of the picture, pixels.
    pub size: [f64; 2],
}

/// Results for a limit: means per view, apart from the errors.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct TubeErrors {
    /// Limit of error, pixels.
    pub limit_px: f64,
    /// Drawn chords.
    pub segments: f64,
    /// Drawn triangles.
    pub triangles: f64,
    /// Chords that exceed the limit.
    pub over: f64,
    /// Error of the worst point, pixels.
    pub greatest_px: f64,
    /// Mean error of points, pixels.
    pub mean_px: f64,
    /// Sampled points, of tubes on the screen, including hidden ones.
    pub samples: u64,
    /// Weight error of the worst point: drawn over true coverage, less 1, of tubes thinner than a pixel that are drawn a pixel
    /// wide.
    pub greatest_weight: f64,
    /// Mean of its absolute value over such points.
    pub mean_weight: f64,
    /// Number of such points.
    pub thin_samples: u64,
    /// Seconds of selection.
    pub seconds: f64,
}

/// Selects with each limit from each view, and measures random points of the surfaces (by seed).
pub fn measure(scene: &Scene, views: &[TubeView], seed: u64) -> Vec<TubeErrors> {
    let tubes = &scene.tubes;
    let segments = || scene.objects.iter().map(|object| object.segments.clone());
    let runs = Runs::new(tubes, segments());
    let objects = || (0..).zip(segments()).filter(|(_, segments)| !segments.is_empty());
    let mut selection = Selection::default();
    let count = views.len().max(1) as f64;
    let of = |limit: f64| {
        let mut random = Prng::new(seed, 0);
        let mut found = TubeErrors {
            limit_px: limit,
            segments: 0.0,
            triangles: 0.0,
            over: 0.0,
            greatest_px: 0.0,
            mean_px: 0.0,
            samples: 0,
            greatest_weight: 0.0,
            mean_weight: 0.0,
            thin_samples: 0,
            seconds: 0.0,
        };
        for view in views {
            let chooses = View::new(view.eye, view.rows, view.near, view.size, limit);
            let mut run = |_| {
                let start = Instant::now();
                selection.select(tubes, &runs, &chooses, objects());
                start.elapsed().as_secs_f64()
            };
            found.seconds += (0..REPEATS).map(&mut run).fold(f64::INFINITY, f64::min) / count;
            let chosen = selection.chosen();
            found.segments += chosen.segments as f64 / count;
            found.triangles += chosen.triangles as f64 / count;
            found.over += chosen.over as f64 / count;
            for (pixels, weight) in errors(tubes, view, &selection, &mut random) {
                found.greatest_px = found.greatest_px.max(pixels);
                found.mean_px += pixels;
                found.samples += 1;
                if let Some(weight) = weight {
                    if weight.abs() > found.greatest_weight.abs() {
                        found.greatest_weight = weight;
                    }
                    found.mean_weight += weight.abs();
                    found.thin_samples += 1;
                }
            }
        }
        found.mean_weight /= (found.thin_samples as f64).max(1.0);
        found.mean_px /= (found.samples as f64).max(1.0);
        found
    };
    LIMITS.map(of).to_vec()
}

/// Error in pixels and the [`weight_error`] of random points.
fn errors(tubes: &Tubes, view: &TubeView, selection: &Selection, random: &mut Prng) -> Vec<(f64, Option<f64>)> {
    let outer = |band: &&Band| band.wall() == Wall::Outer;
    let mut bands: Vec<Band> = (0..SIDES.len()).flat_map(|sides| selection.bands(sides)).filter(outer).copied().collect();
    bands.sort_by_key(|band| band.0[0]);
    let samples = if bands.is_empty() { 0 } else { SAMPLES };
    let sample = |_| {
        let chosen = random.below(bands.len());
        let ([from, to], number) = (bands[chosen].ends(), bands[chosen].tube());
        let tube = &tubes.tubes[number as usize];
        let end = if to > from { to } else { f64::from(tube.sections.end) };
        let along = from + (end - from) * random.unit();
        let ring = ring(tubes, tube, along as u32, along.fract());
        let p = ring.point(TAU * random.unit());
        let at = pixel(view, p)?;
        // Near a chord's end, the next chord may be nearer.
        let around = &bands[chosen.saturating_sub(1)..(chosen + 2).min(bands.len())];
        let drawn = around.iter().filter(|band| band.tube() == number).flat_map(|band| band.triangles(tubes));
        let near = drawn.map(|t| closest_on_triangle(p, &t.map(|p| tube.origin + p.as_dvec3())));
        let near = near.min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p)))?;
        let [x, y] = project(view, near)?;
        let weight = weight_error(tubes, view, &bands[chosen], (ring.place, ring.radius));
        Some(((x - at[0]).hypot(y - at[1]), weight))
    };
    (0..samples).filter_map(sample).collect()
}

/// A ring of the exact surface, metres relative to the scene's origin.
struct ExactRing {
    place: DVec3,
    axes: [DVec3; 2],
    radius: f64,
}

impl ExactRing {
    /// The point at an angle, radians.
    fn point(&self, angle: f64) -> DVec3 {
        self.place + self.radius * (angle.cos() * self.axes[0] + angle.sin() * self.axes[1])
    }
}

/// The exact ring of a tube's segment at a share of its length.
fn ring(tubes: &Tubes, tube: &Tube, segment: u32, share: f64) -> ExactRing {
    let rings = part(tubes, &Tube { capped: false, inner: 0.0, ..tube.clone() }, segment..segment + 1, 4);
    let ring = |first: usize| {
        let corner = |k: usize| tube.origin + rings.positions[first + k].as_dvec3();
        let [x, y] = [(corner(0) - corner(2)) / 2.0, (corner(1) - corner(3)) / 2.0];
        ((corner(0) + corner(2)) / 2.0, x, x.cross(y).normalize_or_zero())
    };
    let ((a, x, from), (b, _, to)) = (ring(0), ring(4));
    let turn = from.angle_between(to);
    // Cubic handles of an arc (Goldapp 1991): within 4e-6 of the radius for an eighth of a circle.
    let handle = if turn > STRAIGHT { 2.0 / 3.0 * (turn / 4.0).tan() / (turn / 2.0).sin() } else { 1.0 / 3.0 };
    let handle = handle * a.distance(b);
    let points = [a, a + handle * from, b - handle * to, b];
    let step = |points: &[DVec3]| points.windows(2).map(|pair| pair[0].lerp(pair[1], share)).collect::<Vec<_>>();
    let last = step(&step(&points));
    let (place, along) = (last[0].lerp(last[1], share), (last[1] - last[0]).normalize_or(from));
    let radius = x.length();
    let x = x.reject_from_normalized(along).normalize_or_zero();
    ExactRing { place, axes: [x, along.cross(x)], radius }
}

/// Position of a point before the near plane, pixels from the picture's centre.
fn project(view: &TubeView, p: DVec3) -> Option<[f64; 2]> {
    let [x, y, w] = view.rows.map(|row| (p - view.eye).dot(row));
    let [width, height] = view.size.map(|size| size / 2.0);
    (w >= view.near).then(|| [x / w * width, y / w * height])
}

/// The same, if it is in the picture.
fn pixel(view: &TubeView, p: DVec3) -> Option<[f64; 2]> {
    project(view, p).filter(|at| (0..2).all(|k| at[k].abs() <= view.size[k] / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use enfilade_tubes::curve::{Arc, Piece};
    use enfilade_tubes::{Counts, Shape};

    /// Points are on the torus, and on the cylinder before it.
    #[test]
    fn surfaces_of_lines_and_arcs_are_exact() {
        let arc = Arc { middle: DVec3::new(2.0, 0.0, -0.5), x: 0.5 * DVec3::Z, y: 0.5 * DVec3::X, angle: TAU / 4.0 };
        let pieces = [Piece::Line([DVec3::ZERO, arc.at(0.0)]), Piece::Arc(arc)];
        let mut tubes = Tubes::default();
        let shape = Shape { radius: 0.125, inner: 0.0, capped: true };
        tubes.curve(&pieces, false, shape, 1e-2, &mut Counts::default()).unwrap();
        let (tube, mut random) = (&tubes.tubes[0], Prng::new(1, 0));
        for k in 0..600u32 {
            let ring = ring(&tubes, tube, k % tube.segments().len() as u32, random.unit());
            let p = ring.point(TAU * random.unit());
            let off = if p.x < 2.0 { p.y.hypot(p.z) } else { ((p - arc.middle).with_y(0.0).length() - 0.5).hypot(p.y) };
            assert!((off - 0.125).abs() < 1e-5, "{p} is {off} m from the curve");
        }
    }
}
