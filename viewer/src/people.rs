//! People that walk about: what moves, culled by [`enfilade::runtime::View::movers`].

use crate::culling::Culling;
use crate::draw::lines::{Overlay, Tint};
use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, MoverId, Movers};
use enfilade_measure::walkthrough::path::PathFrame;
use enfilade_measure::walkthrough::stroll::Stroll;
use glam::{DVec3, Vec3};
use std::f32::consts::TAU;
use std::sync::Arc;

/// How many.
const COUNT: usize = 100;
/// Metres a second.
const SPEED: f64 = 1.3;
/// Between places of a way, metres.
const STEP: f64 = 0.25;
/// Height of an eye over the feet on a way, metres.
const EYE: f64 = 1.6;
/// A body: heights over the feet and radii, metres.
const RINGS: [[f32; 2]; 8] =
    [[0.0, 0.12], [0.8, 0.19], [1.1, 0.17], [1.4, 0.23], [1.48, 0.08], [1.53, 0.09], [1.63, 0.12], [1.75, 0.05]];
/// Corners of a ring.
const SIDES: usize = 8;
const COLOURS: [[f32; 3]; 4] = [[214.0, 92.0, 60.0], [66.0, 120.0, 190.0], [226.0, 178.0, 62.0], [98.0, 156.0, 92.0]];
/// Where light comes from.
const LIGHT: Vec3 = Vec3::new(0.4, 0.8, 0.45);

/// People on their ways through all rooms, to and fro. They pass through shut doors.
pub struct People {
    movers: Movers,
    /// In the order of their slots.
    ids: Vec<MoverId>,
    /// Feet, relative to the file's origin, metres.
    feet: Vec<DVec3>,
    /// Feet along each way, a step apart; and the place on it, in steps, where each person began, with that person's way.
    ways: Vec<Vec<DVec3>>,
    starts: Vec<(usize, f64)>,
    /// By each, metres.
    walked: f64,
    /// Those that the culling draws.
    seen: Vec<MoverId>,
    /// Their bodies.
    pub bodies: Overlay,
}

impl People {
    /// Spread over the ways; none where nobody can walk.
    pub fn new(file: &PvsFile, culler: &Arc<Culler>) -> Self {
        let legs = Stroll::through(file, 0, STEP).legs;
        let feet = |leg: &Vec<_>| leg.iter().map(|at: &PathFrame| at.eye - file.origin - DVec3::Y * EYE).collect();
        let ways: Vec<Vec<DVec3>> = legs.iter().map(feet).filter(|way: &Vec<_>| way.len() > 1).collect();
        let steps: usize = ways.iter().map(Vec::len).sum();
        let start = |k: usize| {
            let mut at = (k * steps) as f64 / COUNT as f64;
            let way = ways.iter().position(|way| {
                let is_here = at < way.len() as f64;
                at -= if is_here { 0.0 } else { way.len() as f64 };
                is_here
            });
            way.map(|way| (way, at))
        };
        let starts: Vec<(usize, f64)> = (0..COUNT).filter_map(start).collect();
        let mut people = Self {
            movers: Movers::new(culler),
            ids: Vec::new(),
            feet: Vec::new(),
            ways,
            starts,
            walked: 0.0,
            seen: Vec::new(),
            bodies: Overlay::new(),
        };
        people.feet = (0..people.starts.len()).map(|k| people.place(k)).collect();
        let insert = |feet: &DVec3| people.movers.insert(bounds(*feet)).ok();
        people.ids = people.feet.iter().filter_map(insert).collect();
        people
    }

    /// Walks on.
    pub fn go(&mut self, seconds: f64) {
        self.walked += SPEED * seconds;
        for k in 0..self.ids.len() {
            self.feet[k] = self.place(k);
            // Places are finite, and nobody leaves.
            let _ = self.movers.set(self.ids[k], bounds(self.feet[k]));
        }
    }

    /// Where a person is: every other one began the other way.
    fn place(&self, k: usize) -> DVec3 {
        let (way, start) = self.starts[k];
        let way = &self.ways[way];
        let last = (way.len() - 1) as f64;
        let along = self.walked / STEP * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let at = (start + along).rem_euclid(2.0 * last);
        let at = if at > last { 2.0 * last - at } else { at };
        let from = (at as usize).min(way.len() - 2);
        way[from].lerp(way[from + 1], at - from as f64)
    }

    /// Draws those that the last frame may show.
    pub fn see(&mut self, culling: &mut Culling<'_>) {
        self.seen.clear();
        self.seen.extend_from_slice(culling.movers(&self.movers));
        self.bodies.clear();
        for id in &self.seen {
            body(&mut self.bodies, self.feet[id.slot as usize].as_vec3(), COLOURS[id.slot as usize % COLOURS.len()]);
        }
    }

    /// Who is drawn, in a line.
    pub fn line(&self) -> String {
        format!("{} of {} people", self.seen.len(), self.ids.len())
    }
}

/// The box of a body.
fn bounds(feet: DVec3) -> [Vec3; 2] {
    let feet = feet.as_vec3();
    let radius = RINGS.iter().map(|[_, radius]| *radius).fold(0.0, f32::max);
    let across = Vec3::new(radius, 0.0, radius);
    [feet - across, feet + across + Vec3::Y * RINGS[RINGS.len() - 1][0]]
}

fn body(bodies: &mut Overlay, feet: Vec3, colour: [f32; 3]) {
    let corner = |[height, radius]: [f32; 2], side: usize| {
        let (sin, cos) = (TAU * (side % SIDES) as f32 / SIDES as f32).sin_cos();
        feet + Vec3::new(cos * radius, height, sin * radius)
    };
    let lit = |[a, b, c]: [Vec3; 3]| -> Tint {
        let n = (b - a).cross(c - a).normalize_or_zero();
        let light = 0.65 + 0.35 * n.dot(LIGHT.normalize());
        let [r, g, b] = colour.map(|part| (part * light) as u8);
        [r, g, b, 255]
    };
    for pair in RINGS.windows(2) {
        for side in 0..SIDES {
            let face = [corner(pair[0], side), corner(pair[1], side), corner(pair[1], side + 1), corner(pair[0], side + 1)];
            bodies.solid(&face, lit([face[0], face[1], face[2]]));
        }
    }
    let top: [Vec3; SIDES] = std::array::from_fn(|side| corner(RINGS[RINGS.len() - 1], SIDES - side));
    bodies.solid(&top, lit([top[0], top[1], top[2]]));
}
