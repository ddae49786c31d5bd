//! Drawn parts of a tube, as shaders compute them: bands between two rings, with corners computed from their number.

use super::between::{Ring, STEPS};
use super::select::SIDES;
use super::tube::Tubes;
use glam::Vec3;
use std::f32::consts::TAU;

/// A band of triangles between two rings, in 16 bytes: the positions of both rings, as a section's number and 64ths of the way to
/// the next (6 bits); the tube (30 bits), the [`Wall`] (2), the object (24 bits), and each ring's index into [`SIDES`] (4).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(C)]
pub struct Band(pub [u32; 4]);

/// The rings of a band.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Wall {
    /// Outer rings, from the first to the second.
    Outer,
    /// Rings of the hole, from the second to the first.
    Inner,
    /// Cap at the first ring: from the hole or the centre outwards.
    First,
    /// Cap at the second ring: from outside to the hole or the centre.
    Last,
}

const WALLS: [Wall; 4] = [Wall::Outer, Wall::Inner, Wall::First, Wall::Last];
/// Corners of the two triangles of a side: the ring, and 1 for the side's second corner there.
const CORNERS: [(usize, u32); 6] = [(0, 0), (0, 1), (1, 0), (1, 0), (0, 1), (1, 1)];
const OBJECT_BITS: u32 = 24;
const TUBE_BITS: u32 = 30;
const SIDE_BITS: u32 = 4;

impl Band {
    pub(super) fn new(ends: [u32; 2], tube: u32, object: u32, wall: Wall, [a, b]: [u8; 2]) -> Self {
        let sides = u32::from(a) | u32::from(b) << SIDE_BITS;
        Self([ends[0], ends[1], tube | (wall as u32) << TUBE_BITS, object | sides << OBJECT_BITS])
    }

    /// The object's number.
    pub fn object(&self) -> u32 {
        self.0[3] & ((1 << OBJECT_BITS) - 1)
    }

    /// The tube's number.
    pub fn tube(&self) -> u32 {
        self.0[2] & ((1 << TUBE_BITS) - 1)
    }

    /// Positions of both rings along the tube: a section's number plus the fraction of the way to the next.
    pub fn ends(&self) -> [f64; 2] {
        [self.0[0], self.0[1]].map(|at| f64::from(at) / f64::from(STEPS))
    }

    /// The rings of the band.
    pub fn wall(&self) -> Wall {
        WALLS[(self.0[2] >> TUBE_BITS) as usize]
    }

    /// Number of sides of both rings.
    pub fn sides(&self) -> [u32; 2] {
        let sides = |k: u32| (self.0[3] >> (OBJECT_BITS + k * SIDE_BITS)) as usize % (1 << SIDE_BITS);
        [SIDES[sides(0)], SIDES[sides(1)]]
    }

    /// Number of corners, three per triangle.
    pub fn corners(&self) -> u32 {
        let [a, b] = self.sides();
        CORNERS.len() as u32 * a.max(b)
    }

    /// The first ring (0) or the second (1): its centre, metres relative to the tube's origin; its perpendicular unit axes, the
    /// first at angle 0; and the radius of the outer wall, metres.
    pub fn ring(&self, tubes: &Tubes, end: usize) -> (Vec3, [Vec3; 2], f32) {
        let Ring { place, x, y, radius } = Ring::at(tubes, &tubes.tubes[self.tube() as usize], self.0[end]);
        (place, [x, y], radius)
    }

    /// A corner by its number, metres relative to the tube's origin. Corners of the finer ring move to those of the coarser.
    pub fn corner(&self, tubes: &Tubes, number: u32) -> Vec3 {
        let ([from, to, ..], tube) = (self.0, &tubes.tubes[self.tube() as usize]);
        let (side, (ring, next)) = (number / CORNERS.len() as u32, CORNERS[number as usize % CORNERS.len()]);
        let (at, scale) = match (self.wall(), ring) {
            (Wall::Outer, 0) => (from, 1.0),
            (Wall::Outer, _) => (to, 1.0),
            (Wall::Inner, 0) => (to, tube.inner),
            (Wall::Inner, _) => (from, tube.inner),
            (Wall::First, 0) => (from, tube.inner),
            (Wall::First, _) => (from, 1.0),
            (Wall::Last, 0) => (to, 1.0),
            (Wall::Last, _) => (to, tube.inner),
        };
        let (of_ring, finer) = (self.sides()[ring], self.corners() / CORNERS.len() as u32);
        let k = (side + next) % finer * of_ring / finer;
        Ring::at(tubes, tube, at).point(TAU * k as f32 / of_ring as f32, scale)
    }

    /// The triangles, counter-clockwise from outside, metres relative to the tube's origin; includes those of zero area.
    pub fn triangles<'t>(&self, tubes: &'t Tubes) -> impl Iterator<Item = [Vec3; 3]> + use<'t> {
        let band = *self;
        (0..band.corners() / 3).map(move |t| [0, 1, 2].map(|k| band.corner(tubes, 3 * t + k)))
    }
}
