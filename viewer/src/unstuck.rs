//! Moves a walker out of a solid: a counter, a wall, a mass of rock.

use crate::body::{EYE, Passes, STEP, Space, around};
use crate::collision::Solid;
use glam::{DVec3, Vec3Swizzles};

/// Heights above the floor, metres, of the level rays that test whether a walker is in a solid: a table's, a counter's, the chest's.
const HEIGHTS: [f64; 3] = [0.6, 0.8, 1.3];
/// How many directions they go in.
const DIRECTIONS: usize = 16;
/// Within a solid, this share of the rays meets backs of faces. Less: walkers behind a one-sided screen are moved. All: one crack keeps a
/// walker in.
const BACKS: f64 = 0.85;
/// Faces this much nearer than the body's radius, metres, cross the body. Less: leaning on a wall counts as stuck.
const DEEP: f64 = 0.05;
/// Rings around, metres: how far apart they are, and the last one's radius. Farther: the next building.
const RINGS: (f64, f64) = (0.2, 6.0);
/// Places on a ring.
const ON_A_RING: usize = 24;
/// Cost of a metre of height, in metres of distance.
const OTHER_STOREY: f64 = 3.0;
/// Points along each side of a model that are looked at from above.
const FROM_ABOVE: usize = 8;

/// Tests whether a walker is in a solid.
struct Inside<'a> {
    space: Space<'a>,
    radius: f64,
    /// Whether fronts of faces point outwards. If faces show their backs from above, they do not.
    has_sides: bool,
}

impl<'a> Inside<'a> {
    fn new(solid: &'a Solid<'a>, radius: f64, passes: Passes<'a>) -> Self {
        let (space, bounds) = (Space::new(solid, passes), solid.scene().bounds());
        let point = |i: usize| {
            let share = DVec3::new((i % FROM_ABOVE) as f64 + 0.5, 0.0, (i / FROM_ABOVE) as f64 + 0.5) / FROM_ABOVE as f64;
            (bounds.min + bounds.size() * share).with_y(bounds.max.y + 1.0)
        };
        let touches = (0..FROM_ABOVE * FROM_ABOVE).filter_map(|i| space.first(point(i), DVec3::NEG_Y));
        let fronts = touches.fold(0, |sum, touch| sum + if touch.front { 1 } else { -1 });
        Self { space, radius, has_sides: fronts > 0 }
    }

    fn holds(&self, feet: DVec3) -> bool {
        let is_crossed = self.space.clearance(feet, self.radius) < self.radius - DEEP
            || self.space.first(feet + DVec3::Y * STEP, DVec3::Y).is_some_and(|touch| touch.t < EYE - STEP);
        let directions = around(DIRECTIONS);
        let is_closed_in = |&height: &f64| self.space.sides(feet + DVec3::Y * height, &directions)[1] >= BACKS;
        is_crossed || self.has_sides && HEIGHTS.iter().any(is_closed_in)
    }
}

/// The eye at the nearest place where a body of this radius fits. `None` if the walker is in no solid, and if there is no such place within
/// some metres.
pub fn way_out(solid: &Solid<'_>, eye: DVec3, radius: f64, passes: Passes<'_>) -> Option<DVec3> {
    let (inside, feet) = (Inside::new(solid, radius, passes), eye - DVec3::Y * EYE);
    if !inside.holds(feet) {
        return None;
    }
    let mut best: Option<(f64, DVec3)> = None;
    let rings = (RINGS.1 / RINGS.0) as usize;
    for ring in (1..=rings).map(|i| i as f64 * RINGS.0) {
        if best.is_some_and(|(cost, _)| cost <= ring) {
            break;
        }
        for at in around(ON_A_RING).into_iter().map(|way| feet + way * ring) {
            for floor in inside.space.floors(at.xz(), &|_| true) {
                let (place, cost) = (at.with_y(floor), ring + OTHER_STOREY * (floor - feet.y).abs());
                let is_nearer = cost <= RINGS.1 && best.is_none_or(|(least, _)| cost < least);
                if is_nearer && inside.space.clearance(place, radius) >= radius && !inside.holds(place) {
                    best = Some((cost, place));
                }
            }
        }
    }
    best.map(|(_, place)| place + DVec3::Y * EYE)
}
