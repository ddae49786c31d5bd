//! The hole that a door stands in, and what is made for it: a leaf where the model has none, and what closes the gaps around one.

use super::pieces::Facet;
use enfilade::math::geom::{Aabb, Plane, clip, newell};
use glam::{DVec2, DVec3};

/// Half of how thick a leaf is that is made, metres.
const HALF_THICK: f64 = 0.02;
/// A portal whose normal has a larger cosine with the vertical than this is a hatch.
const HATCH: f64 = 0.7;
/// Halves of a leaf overlap by this, metres, so that no pixel shows between them.
const OVERLAP: f64 = 1e-3;
/// The sharpest corner of a winding that grows as far as its sides do, as 1 + the cosine between them. Smaller: needles grow spikes.
const SHARPEST: f64 = 0.2;

/// One hole in a wall, of one portal or several.
#[derive(Clone, Debug)]
pub struct Opening {
    /// In its plane.
    pub middle: DVec3,
    /// Unit vectors: through it, along it (level where it is upright), and up.
    pub n: DVec3,
    /// See [`Self::n`].
    pub along: DVec3,
    /// See [`Self::n`].
    pub up: DVec3,
    /// Half of its size along and up, metres.
    pub half: DVec2,
    /// Convex, grown by a margin: a line that passes the portals passes these.
    pub windings: Vec<Vec<DVec3>>,
    /// False for a hatch.
    pub is_upright: bool,
}

impl Opening {
    /// Of the windings of portals in one plane. `margin`: how far lines may be taken to pass beside them, metres.
    pub fn new(windings: &[Vec<DVec3>], n: DVec3, margin: f64) -> Self {
        let is_upright = n.y.abs() <= HATCH;
        let first = &windings[0];
        let edge = (first[1] - first[0]).normalize_or(DVec3::X);
        let along = if is_upright { DVec3::Y.cross(n).normalize() } else { edge };
        let up = n.cross(along).normalize_or(DVec3::Y);
        let points = || windings.iter().flatten();
        let reach = |axis: DVec3| {
            points().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], p| [a.min(axis.dot(*p)), b.max(axis.dot(*p))])
        };
        let ([a0, a1], [u0, u1]) = (reach(along), reach(up));
        let middle = n * n.dot(first[0]) + along * (0.5 * (a0 + a1)) + up * (0.5 * (u0 + u1));
        let half = DVec2::new(0.5 * (a1 - a0), 0.5 * (u1 - u0));
        let windings = windings.iter().map(|w| grown(w, n, margin)).collect();
        Self { middle, n, along, up, half, windings, is_upright }
    }

    /// Around it.
    pub fn bounds(&self) -> Aabb {
        Aabb::of(self.windings.iter().flatten().copied())
    }

    /// A jamb at half its height: `side` is -1 or 1.
    pub fn jamb(&self, side: f64) -> DVec3 {
        self.middle + self.along * (side * self.half.x)
    }

    /// A leaf that fills it between two places along it, as shares of its half width.
    pub fn made_leaf(&self, [from, to]: [f64; 2]) -> Vec<Facet> {
        let at = |share: f64| self.along.dot(self.middle) + share * self.half.x;
        let ends = [
            Plane { n: -self.along, d: -at(from) + if from > -1.0 { OVERLAP } else { f64::INFINITY } },
            Plane { n: self.along, d: at(to) + if to < 1.0 { OVERLAP } else { f64::INFINITY } },
        ];
        let part =
            |w: &Vec<DVec3>| ends.iter().fold(w.clone(), |w, end| if end.d.is_finite() { clip(&w, end, 0.0) } else { w });
        let parts = self.windings.iter().map(part).filter(|w| w.len() > 2);
        let triangles = parts.flat_map(|w| prism(&w, self.n * -HALF_THICK, self.n * HALF_THICK, [true; 2]));
        triangles.map(|corners| Facet { corners, of: None, glass: false }).collect()
    }

    /// What closes the gaps around a leaf that stands `depth` metres off the portals along the normal: a tub, open towards the portals, whose
    /// bottom is inside the leaf. Whatever line passes the portals meets it.
    pub fn tub(&self, depth: f64) -> Vec<[DVec3; 3]> {
        self.windings.iter().flat_map(|w| prism(w, DVec3::ZERO, self.n * depth, [false, true])).collect()
    }

    /// The triangles that stop walkers while the door is shut.
    pub fn block(&self, depth: f64) -> Vec<[DVec3; 3]> {
        let (back, front) = (self.n * (depth - HALF_THICK), self.n * (depth + HALF_THICK));
        self.windings.iter().flat_map(|w| prism(w, back, front, [true; 2])).collect()
    }
}

/// The sides between a winding moved by one vector and by another, and its ends.
fn prism(winding: &[DVec3], from: DVec3, to: DVec3, ends: [bool; 2]) -> Vec<[DVec3; 3]> {
    let count = winding.len();
    let mut triangles = Vec::new();
    for i in 0..count {
        let (a, b) = (winding[i], winding[(i + 1) % count]);
        if from != to {
            triangles.extend([[a + from, b + from, b + to], [a + from, b + to, a + to]]);
        }
    }
    for (by, _) in [from, to].into_iter().zip(ends).filter(|(_, is_there)| *is_there) {
        triangles.extend((2..count).map(|i| [winding[0], winding[i - 1], winding[i]].map(|p| p + by)));
    }
    triangles
}

/// A convex winding with its sides moved out.
fn grown(winding: &[DVec3], n: DVec3, by: f64) -> Vec<DVec3> {
    let count = winding.len();
    let turn = newell(winding).dot(n).signum();
    // The normal of the side that begins at a corner, outwards.
    let out = |i: usize| (winding[(i + 1) % count] - winding[i % count]).cross(n).normalize_or_zero() * turn;
    let corner = |i: usize| {
        let (a, b) = (out(i + count - 1), out(i));
        winding[i] + (a + b) * (by / (1.0 + a.dot(b)).max(SHARPEST))
    };
    (0..count).map(corner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(n: DVec3) -> Opening {
        let winding = [(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 5.0)).to_vec();
        Opening::new(&[winding], n, 0.01)
    }

    /// Whether a segment meets one of some triangles.
    fn meets(triangles: &[[DVec3; 3]], from: DVec3, to: DVec3) -> bool {
        triangles.iter().any(|&corners| super::super::met(corners, from, to - from).is_some_and(|t| t <= 1.0))
    }

    #[test]
    fn a_winding_grows_on_all_sides_whichever_way_it_goes_round() {
        for n in [DVec3::Z, DVec3::NEG_Z] {
            let bounds = square(n).bounds();
            let wanted = [DVec3::new(-0.01, -0.01, 5.0), DVec3::new(1.01, 2.01, 5.0)];
            assert!(bounds.min.distance(wanted[0]) < 1e-9 && bounds.max.distance(wanted[1]) < 1e-9, "{bounds:?}");
        }
    }

    #[test]
    fn no_line_through_a_portal_passes_its_tub_or_its_made_leaf() {
        let opening = square(DVec3::Z);
        let leaf: Vec<[DVec3; 3]> = opening.made_leaf([-1.0, 1.0]).iter().map(|f| f.corners).collect();
        let halves: Vec<[DVec3; 3]> =
            [[-1.0, 0.0], [0.0, 1.0]].iter().flat_map(|&part| opening.made_leaf(part)).map(|f| f.corners).collect();
        let shapes = [opening.tub(0.3), opening.tub(-0.3), opening.tub(0.0), leaf, halves];
        // Points of a grid over the portal, its rim among them, and slopes to all sides.
        for i in 0..=20 * 20 {
            let p = DVec3::new(f64::from(i % 21) / 20.0, f64::from(i / 21) / 10.0, 5.0);
            for slope in [(0.0, 0.0), (4.0, 1.0), (-4.0, 0.5), (0.3, 3.0), (-0.7, -4.0)].map(|(x, y)| DVec3::new(x, y, 1.0))
            {
                for (i, shape) in shapes.iter().enumerate() {
                    assert!(meets(shape, p - slope, p + slope), "shape {i} at {p} along {slope}");
                }
            }
        }
        // And a line beside it does.
        assert!(!meets(&shapes[0], DVec3::new(1.5, 1.0, 4.0), DVec3::new(1.5, 1.0, 6.0)));
    }
}
