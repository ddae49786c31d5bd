//! Whether a shut door still has a gap: beside its leaf, under it, through its letter-box.
//!
//! The test samples lines, so a gap that it finds is real, and a narrow crooked one may be overlooked. Lines reach from one end of the
//! doorway to the other ([`DOORWAY`]): for an eye within the doorway the portal counts as open, and objects within it on the far side are
//! drawn anyway. Half of the lines cross the portal anywhere, half where no leaf covers it, mostly close to a rim, because gaps are narrow
//! and run along one. Slopes are spread over all magnitudes, because a gap as deep as its leaf passes only steep lines.

use crate::cells::Portal;
use crate::cells::complex::polygon::Shape;
use crate::math::geom::middle;
use crate::math::random::SplitMix;
use crate::math::tolerance::DOORWAY;
use crate::scene::rays::{Hit, RayScene};
use glam::{DVec2, DVec3};

/// Sampled lines. A gap of a centimetre beside a leaf of 0.9 x 2.1 x 0.04 m passes about one in thirty.
const LINES: usize = 2000;
/// Tangents of the angles between the lines and the portal's normal.
const SLOPES: [f64; 2] = [1e-3, 10.0];
/// Smallest distance of a line from a rim, in diagonals of the portal.
const RIM: f64 = 1e-4;

/// A portal's plane: its centre, and two directions in it.
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

/// Whether an unobstructed line with the scene's clearance passes the convex `rim` of a portal; `uncovered` is the part without a leaf.
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
        // As wide as the smallest guaranteed opening, so that a crack between a leaf and its frame does not count.
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

/// A random point in the bounds, if it is in the shape.
fn anywhere(shape: &Shape, random: &mut SplitMix) -> Option<DVec2> {
    let (low, high) = bounds(shape);
    let p = low + (high - low) * DVec2::new(random.unit(), random.unit());
    inside(shape, p).then_some(p)
}

/// A random point of the shape beside one of its edges, with a log-uniform distance.
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
