//! Whether a door that is shut still lets something show: beside its leaf, under it, through its letter-box.
//!
//! Lines are tried, so a gap that is found is one, and a narrow crooked one may be overlooked. They reach from one end of the doorway to
//! the other ([`DOORWAY`]): to an eye within it the portal counts as open, and what is within it on the far side is drawn anyway. Half of
//! them cross the portal anywhere, half where no leaf is before it, mostly close to a rim, since gaps are narrow and run along one. Their
//! slopes are spread over all magnitudes, since a gap as deep as its leaf lets only steep lines through.

use crate::cells::Portal;
use crate::cells::complex::polygon::Shape;
use crate::geom::middle;
use crate::random::SplitMix;
use crate::scene::rays::{Hit, RayScene};
use crate::tolerance::DOORWAY;
use glam::{DVec2, DVec3};

/// Lines that are tried. A centimetre beside a leaf of 0.9 x 2.1 x 0.04 m lets about one in thirty through.
const LINES: usize = 2000;
/// Tangents of the angles between the lines and the portal's normal.
const SLOPES: [f64; 2] = [1e-3, 10.0];
/// The nearest that lines are aimed at a rim, in diagonals of the portal.
const RIM: f64 = 1e-4;

/// A portal's plane: its middle, and two directions in it.
pub(in crate::cells) struct Face {
    centre: DVec3,
    along: [DVec3; 2],
}

impl Face {
    pub(in crate::cells) fn new(portal: &Portal) -> Self {
        Self { centre: middle(&portal.winding), along: portal.plane.n.any_orthonormal_pair().into() }
    }

    pub(in crate::cells) fn flat(&self, p: DVec3) -> DVec2 {
        DVec2::new(self.along[0].dot(p - self.centre), self.along[1].dot(p - self.centre))
    }

    fn solid(&self, p: DVec2) -> DVec3 {
        self.centre + self.along[0] * p.x + self.along[1] * p.y
    }
}

/// Whether a line passes, with the scene's clearance, the convex `rim` of a portal, past every solid surface there; `uncovered` is what of it
/// no leaf stands before.
pub(in crate::cells) fn lets_through(
    rays: &RayScene<'_>,
    face: &Face,
    rim: &[DVec2],
    uncovered: &[Shape],
    seed: u64,
) -> bool {
    let rim = vec![rim.iter().map(|p| p.to_array()).collect::<Vec<_>>()];
    let diagonal = {
        let (low, high) = bounds(&rim);
        low.distance(high)
    };
    let normal = face.along[0].cross(face.along[1]) * (DOORWAY * diagonal);
    let clearance = rays.tolerance().clearance;
    let mut random = SplitMix::new(seed);
    let mut glass: Vec<Hit> = Vec::new();
    (0..LINES).any(|i| {
        let shape = if i.is_multiple_of(2) && !uncovered.is_empty() { &uncovered[i / 2 % uncovered.len()] } else { &rim };
        let Some(p) = (if i % 4 < 2 { near_an_edge(shape, diagonal, &mut random) } else { anywhere(shape, &mut random) })
        else {
            return false;
        };
        let slope = SLOPES[0] * (SLOPES[1] / SLOPES[0]).powf(random.unit()) * DOORWAY * diagonal;
        let (sin, cos) = (std::f64::consts::TAU * random.unit()).sin_cos();
        let half = normal + (face.along[0] * cos + face.along[1] * sin) * slope;
        let (from, way) = (face.solid(p) - half, 2.0 * half);
        // As wide as what the file promises anything about, and not a crack between a leaf and its frame.
        let (u, v) = way.normalize_or(DVec3::Z).any_orthonormal_pair();
        let mut is_clear = |from: DVec3| {
            glass.clear();
            rays.see_through(from, way, 1.0, &mut glass);
            glass.iter().all(|hit| rays.scene().objects[hit.object.index()].glass)
                && rays.first_opaque(from, way, 1.0).is_none()
        };
        [DVec3::ZERO, u, -u, v, -v].into_iter().all(|off| is_clear(from + off * clearance))
    })
}

fn bounds(shape: &Shape) -> (DVec2, DVec2) {
    shape
        .iter()
        .flatten()
        .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), &p| (low.min(DVec2::from(p)), high.max(DVec2::from(p))))
}

/// A point of the shape, if the first that is tried in its bounds is in it.
fn anywhere(shape: &Shape, random: &mut SplitMix) -> Option<DVec2> {
    let (low, high) = bounds(shape);
    let p = low + (high - low) * DVec2::new(random.unit(), random.unit());
    inside(shape, p).then_some(p)
}

/// A point of the shape beside one of its edges, as likely within a millimetre as within a centimetre.
fn near_an_edge(shape: &Shape, diagonal: f64, random: &mut SplitMix) -> Option<DVec2> {
    let contour = &shape[(random.bits() % shape.len() as u64) as usize];
    let k = (random.bits() % contour.len() as u64) as usize;
    let [a, b] = [contour[k], contour[(k + 1) % contour.len()]].map(DVec2::from);
    let off = diagonal * RIM.powf(random.unit());
    let p = a.lerp(b, random.unit())
        + (b - a).normalize_or_zero().perp() * if random.bits().is_multiple_of(2) { off } else { -off };
    inside(shape, p).then_some(p)
}

/// By the parity of the edges to the right of it.
fn inside(shape: &Shape, p: DVec2) -> bool {
    let crosses = |contour: &Vec<[f64; 2]>| {
        let edge = |k: usize| [contour[k], contour[(k + 1) % contour.len()]].map(DVec2::from);
        (0..contour.len())
            .map(edge)
            .filter(|&[a, b]| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y))
            .count()
    };
    shape.iter().map(crosses).sum::<usize>() % 2 == 1
}
