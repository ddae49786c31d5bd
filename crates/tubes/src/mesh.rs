//! The triangles of a tube.
//!
//! Based on: Bloomenthal 1990 (rings in the plane across the curve).

use super::frame::{across, tangent};
use super::tube::{Tube, Tubes};
use glam::Vec3;
use std::f32::consts::TAU;
use std::ops::Range;

/// Fewest and most sides of a ring.
const FEWEST: f64 = 6.0;
const MOST: f64 = 64.0;

/// Largest error of an imported tube's triangles, metres, limited to these shares of the radius: at most the first and at least
/// the second. Less: more triangles. More: visible sides.
const ERROR: f64 = 1e-3;
const SHARES: [f64; 2] = [0.02, 0.002];

impl Tube {
    /// Number of triangles that [`mesh`] makes with rings of `sides` sides.
    pub fn triangles(&self, sides: u32) -> u64 {
        let (sides, segments) = (u64::from(sides), self.segments().len() as u64);
        let is_hollow = self.inner > 0.0;
        let has_caps = self.capped && !self.closed;
        let cap = if is_hollow { 2 * sides } else { sides - 2 };
        2 * sides * segments * (1 + u64::from(is_hollow)) + 2 * cap * u64::from(has_caps)
    }
}

/// Triangles of a tube.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Mesh {
    /// Corners, metres relative to the tube's origin.
    pub positions: Vec<Vec3>,
    /// Counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Default error of a tube's triangles, metres: 1 mm, within 0.2 % to 2 % of its radius.
pub fn usual_error(radius: f64) -> f64 {
    ERROR.min(SHARES[0] * radius).max(SHARES[1] * radius)
}

/// The fewest sides, 6 to 64, whose ring of a radius stays within `error` of its circle, metres.
pub fn sides(radius: f64, error: f64) -> u32 {
    let sides = if error < radius { std::f64::consts::PI / (1.0 - error / radius).acos() } else { FEWEST };
    sides.ceil().clamp(FEWEST, MOST) as u32
}

/// Default number of sides of a ring of a radius (metres).
pub fn usual_sides(radius: f64) -> u32 {
    sides(radius, usual_error(radius))
}

/// A tube with rings of `sides` sides, 3 or more. Corners lie on the tube's surface.
pub fn mesh(tubes: &Tubes, tube: &Tube, sides: u32) -> Mesh {
    part(tubes, tube, tube.segments(), sides)
}

/// The mesh of some segments of a tube; cut ends are open.
pub fn part(tubes: &Tubes, tube: &Tube, segments: Range<u32>, sides: u32) -> Mesh {
    let sections = tubes.of(tube);
    let (first, count) = ((segments.start - tube.sections.start) as usize, segments.len() as u32);
    let is_ring = tube.closed && segments == tube.segments();
    let rings = if is_ring { count } else { count + 1 };
    let mut mesh = Mesh::default();
    let is_hollow = tube.inner > 0.0;
    for scale in [Some(1.0), is_hollow.then_some(tube.inner)].into_iter().flatten() {
        for i in (first..).take(rings as usize).map(|i| i % sections.len()) {
            let (section, [x, y]) = (&sections[i], across(tangent(sections, i, tube.closed)));
            let corner = |k: u32| {
                let (sin, cos) = (section.roll() + TAU * k as f32 / sides as f32).sin_cos();
                Vec3::from(section.place) + scale * tube.radius(section) * (cos * x + sin * y)
            };
            mesh.positions.extend((0..sides).map(corner));
        }
    }
    let corner = |ring: u32, k: u32| ring * sides + k % sides;
    let inner = |ring: u32, k: u32| (rings + ring) * sides + k % sides;
    let triangles = &mut mesh.triangles;
    for ring in 0..count {
        let next = (ring + 1) % rings;
        for k in 0..sides {
            triangles.extend(face([corner(ring, k), corner(ring, k + 1)], [corner(next, k), corner(next, k + 1)]));
            if is_hollow {
                triangles.extend(face([inner(ring, k + 1), inner(ring, k)], [inner(next, k + 1), inner(next, k)]));
            }
        }
    }
    let has_caps = tube.capped && !tube.closed;
    let last = rings - 1;
    if has_caps && segments.start == tube.segments().start {
        for k in 0..sides {
            if is_hollow {
                triangles.extend(face([inner(0, k), inner(0, k + 1)], [corner(0, k), corner(0, k + 1)]));
            } else if k > 0 && k + 1 < sides {
                triangles.push([corner(0, 0), corner(0, k + 1), corner(0, k)]);
            }
        }
    }
    if has_caps && segments.end == tube.segments().end {
        for k in 0..sides {
            if is_hollow {
                triangles.extend(face([corner(last, k), corner(last, k + 1)], [inner(last, k), inner(last, k + 1)]));
            } else if k > 0 && k + 1 < sides {
                triangles.push([corner(last, 0), corner(last, k), corner(last, k + 1)]);
            }
        }
    }
    mesh
}

/// A face between two rings, from the side of the first.
fn face([a, b]: [u32; 2], [c, d]: [u32; 2]) -> [[u32; 3]; 2] {
    [[a, b, c], [c, b, d]]
}
