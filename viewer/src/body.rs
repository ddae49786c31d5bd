//! The space that a person takes up: from the height of a step to above the head.

use crate::collision::{Face, Solid};
use enfilade::ObjectId;
use enfilade::math::geom::{Plane, clip};
use glam::{DVec2, DVec3, Vec3Swizzles};
use std::cell::Cell;
use std::f64::consts::TAU;

/// Height of the eye above the floor, metres.
pub const EYE: f64 = 1.6;
/// Height that a person steps onto, metres: two steps of stairs. Higher: chairs are climbed. Lower: steep stairs stop people.
pub const STEP: f64 = 0.45;
/// Height of a person, metres. Higher: low cellars have no place. Lower: heads touch ceilings.
pub const TALL: f64 = 1.9;
/// A floor farther down than this, metres, is ignored: without a floor, a walker does not fall. Some models have no slabs.
pub const DEEPEST: f64 = 30.0;

/// The vertical part of a floor's unit normal is larger than this. More: ramps are no floors. Less: people stand on walls that lean.
const SLOPE: f64 = 0.7;
/// Surfaces nearer together than this, metres, are one: carpets on slabs.
const SAME: f64 = 1e-3;

/// Whether an object is gone through.
pub type Passes<'p> = &'p dyn Fn(ObjectId) -> bool;

/// Asks a model about the space for a person, and counts what that costs.
pub struct Space<'a> {
    solid: &'a Solid<'a>,
    passes: Passes<'a>,
    cost: Cell<usize>,
}

impl<'a> Space<'a> {
    /// In a model, of which some objects are gone through.
    pub fn new(solid: &'a Solid<'a>, passes: Passes<'a>) -> Self {
        Self { solid, passes, cost: Cell::new(0) }
    }

    /// How many faces were asked for so far. The same questions cost the same, on any machine.
    pub fn cost(&self) -> usize {
        self.cost.get()
    }

    /// The first surface on a ray; `along` is a unit vector.
    pub fn first(&self, from: DVec3, along: DVec3) -> Option<crate::collision::Touch> {
        let (touch, cost) = self.solid.first(from, along, f64::INFINITY, self.passes);
        self.cost.set(self.cost.get() + cost);
        touch
    }

    fn near(&self, p: DVec3, reach: f64, heights: [f64; 2], mut look: impl FnMut(Face)) {
        let cost = self.solid.near(p, reach, heights, |face| {
            if !(self.passes)(face.object) {
                look(face);
            }
        });
        self.cost.set(self.cost.get() + cost);
    }

    /// Heights over a point of the plan (x, z) where a person could stand, ascending: surfaces that aren't steep, of objects that are
    /// `ground`, with nothing above them for the height of a person.
    pub fn floors(&self, at: DVec2, ground: &dyn Fn(ObjectId) -> bool) -> Vec<f64> {
        let mut surfaces = Vec::new();
        self.near(DVec3::new(at.x, 0.0, at.y), 0.0, [f64::NEG_INFINITY, f64::INFINITY], |face| {
            if let Some(y) = face.height_at(at) {
                surfaces.push((y, face.normal().normalize_or_zero().y.abs() > SLOPE && ground(face.object)));
            }
        });
        surfaces.sort_by(|a, b| a.0.total_cmp(&b.0));
        let above = |y: f64| surfaces.iter().map(|s| s.0).find(|next| *next > y + SAME);
        let is_floor = |&&(y, fits): &&(f64, bool)| fits && above(y).is_none_or(|next| next - y >= TALL);
        surfaces.iter().filter(is_floor).map(|s| s.0).collect()
    }

    /// How far a person's axis is from the nearest face beside it, metres, at most `reach`. Faces lower than a step don't count.
    pub fn clearance(&self, feet: DVec3, reach: f64) -> f64 {
        let (low, high) = (feet.y + STEP, feet.y + TALL);
        let (floor, ceiling) = (Plane { n: DVec3::NEG_Y, d: -low }, Plane { n: DVec3::Y, d: high });
        let mut least = reach;
        self.near(feet, reach, [low, high], |face| {
            let corners = face.corners.map(|p| p.xz());
            let (min, max) = (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
            // The box of the triangle is nearer than the triangle.
            if feet.xz().distance(feet.xz().clamp(min, max)) < least {
                let part = clip(&clip(&face.corners, &floor, 0.0), &ceiling, 0.0);
                least = least.min(distance(feet.xz(), &part));
            }
        });
        least
    }

    /// How far a point is from the nearest face, metres, at most `reach`.
    pub fn distance(&self, p: DVec3, reach: f64) -> f64 {
        let mut least = reach;
        self.near(p, reach, [p.y - reach, p.y + reach], |face| least = least.min(face.closest(p).distance(p)));
        least
    }

    /// How far up it is clear over a point, metres.
    pub fn height_over(&self, p: DVec3) -> f64 {
        self.first(p, DVec3::Y).map_or(f64::INFINITY, |touch| touch.t)
    }

    /// Of rays that go out from a point in some directions, the share that meets a front, and the share that meets a back.
    pub fn sides(&self, p: DVec3, directions: &[DVec3]) -> [f64; 2] {
        let touches: Vec<bool> = directions.iter().filter_map(|&d| self.first(p, d)).map(|touch| touch.front).collect();
        let share = |front: bool| touches.iter().filter(|f| **f == front).count() as f64 / directions.len().max(1) as f64;
        [share(true), share(false)]
    }
}

/// Unit vectors around a level circle, evenly.
pub fn around(count: usize) -> Vec<DVec3> {
    let angle = |i: usize| TAU * i as f64 / count as f64;
    (0..count).map(|i| DVec3::new(angle(i).sin(), 0.0, -angle(i).cos())).collect()
}

/// How far a point of the plan is from a convex polygon's shadow on it; infinity where there is none.
fn distance(p: DVec2, polygon: &[DVec3]) -> f64 {
    let corners: Vec<DVec2> = polygon.iter().map(|p| p.xz()).collect();
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let side = |(a, b): (&DVec2, &DVec2)| (*b - *a).perp_dot(p - *a);
    let (least, most) = edges.clone().map(side).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), s| (l.min(s), m.max(s)));
    // Of an upright polygon the shadow is a line: then all sides are zero for points along it, also beyond its ends.
    if (least > 0.0 || most < 0.0) && !corners.is_empty() {
        return 0.0;
    }
    let from_edge = |(a, b): (&DVec2, &DVec2)| {
        let along = *b - *a;
        let t = ((p - *a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        p.distance(*a + along * t)
    };
    edges.map(from_edge).fold(f64::INFINITY, f64::min)
}
