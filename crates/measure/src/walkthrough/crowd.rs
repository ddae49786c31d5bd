//! Movers of a walk: boxes that walk through doors along a tour of all cells, and which of them the pixels of a frame show.
//!
//! A pixel shows a mover if the ray through its middle meets the box before any opaque surface; movers do not hide each other. A pixel of a
//! mover that a set leaves out is judged as those of objects: see [`super::missed`].

use super::golden_turn;
use super::missed::{AROUND, SPREAD, stands_on_a_surface};
use super::raster::{IdBuffer, View};
use super::stroll::Stroll;
use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, MoverId, Movers};
use enfilade::scene::rays::RayScene;
use glam::{DMat3, DVec2, DVec3, Vec3};
use serde::Serialize;
use std::iter::Sum;
use std::sync::Arc;

/// Metres that a mover walks from frame to frame.
const STEP: f64 = 0.25;
/// Height of an eye over the feet, metres.
const EYE: f64 = 1.6;
/// Sizes of boxes, metres: a person, a shot, a cart, a person, a table.
const SIZES: [[f64; 3]; 5] = [[0.6, 1.8, 0.6], [0.15, 0.15, 0.15], [1.0, 1.0, 1.6], [0.6, 1.8, 0.6], [2.0, 0.8, 1.0]];

/// Movers on their ways.
pub struct Crowd {
    /// The culler's.
    pub movers: Movers,
    /// In the order of their numbers.
    pub ids: Vec<MoverId>,
    /// By number, relative to the file's origin, metres.
    pub boxes: Vec<[Vec3; 2]>,
    /// Eyes along the tour.
    places: Vec<DVec3>,
    /// By number: steps walked so far.
    steps: Vec<usize>,
    turn: usize,
}

/// What the pixels of a frame say of movers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct CrowdSeen {
    /// Movers in the set.
    pub movers: u64,
    /// Movers with a pixel.
    pub movers_shown: u64,
    /// Pixels of movers outside the set.
    pub missed_mover_pixels: u64,
    /// Such pixels seen only through a crack.
    pub crack_mover_pixels: u64,
}

impl Sum for CrowdSeen {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |a, b| Self {
            movers: a.movers + b.movers,
            movers_shown: a.movers_shown + b.movers_shown,
            missed_mover_pixels: a.missed_mover_pixels + b.missed_mover_pixels,
            crack_mover_pixels: a.crack_mover_pixels + b.crack_mover_pixels,
        })
    }
}

impl Crowd {
    /// So many movers, spread over a tour; none where there is nothing to walk in.
    pub fn new(file: &PvsFile, culler: &Arc<Culler>, count: usize, seed: u64) -> Self {
        let stroll = Stroll::through(file, seed, STEP);
        let places: Vec<DVec3> = stroll.legs.iter().flatten().map(|frame| frame.eye - file.origin).collect();
        let count = if places.is_empty() { 0 } else { count };
        let (movers, steps) = (Movers::new(culler), vec![0; count]);
        let mut crowd = Self { movers, ids: Vec::new(), boxes: Vec::new(), places, steps, turn: 0 };
        if !crowd.places.is_empty() {
            crowd.boxes = (0..count).map(|k| crowd.bounds(k)).collect();
            crowd.ids = crowd.boxes.iter().map(|b| crowd.movers.insert(*b).expect("a box of finite places")).collect();
        }
        crowd
    }

    /// The box of a mover.
    fn bounds(&self, k: usize) -> [Vec3; 2] {
        let start = (golden_turn(k) * self.places.len() as f64) as usize;
        // Every other one goes the other way.
        let steps = self.steps[k] % self.places.len();
        let at = if k.is_multiple_of(2) { start + steps } else { start + self.places.len() - steps };
        let size = DVec3::from(SIZES[k % SIZES.len()]);
        let feet = self.places[at % self.places.len()] - DVec3::Y * EYE;
        let half = DVec3::new(0.5 * size.x, 0.0, 0.5 * size.z);
        [(feet - half).as_vec3(), (feet + half + DVec3::Y * size.y).as_vec3()]
    }

    /// One in `parts` movers goes on by a step, in turns. Gives their boxes, which are still to be set.
    pub fn step(&mut self, parts: usize) -> Vec<(MoverId, [Vec3; 2])> {
        let first = self.turn % parts;
        self.turn += 1;
        let moved = (first..self.ids.len()).step_by(parts);
        moved
            .map(|k| {
                self.steps[k] += 1;
                self.boxes[k] = self.bounds(k);
                (self.ids[k], self.boxes[k])
            })
            .collect()
    }

    /// All movers go on by a step.
    pub fn go_on(&mut self) {
        for (id, bounds) in self.step(1) {
            self.movers.set(id, bounds).expect("a finite box of a mover that is there");
        }
    }

    /// Compares the movers of a set with the pixels of a picture of everything.
    pub fn compare(&self, rays: &RayScene<'_>, view: &View, full: &IdBuffer, set: &[MoverId]) -> CrowdSeen {
        let mut kept = vec![false; self.movers.slots()];
        set.iter().for_each(|id| kept[id.slot as usize] = true);
        let mut seen = CrowdSeen { movers: set.len() as u64, ..CrowdSeen::default() };
        let sight = Sight { view, unproject: view.camera.unproject() };
        for (id, bounds) in self.ids.iter().zip(&self.boxes) {
            let bounds = bounds.map(|p| p.as_dvec3() - view.camera.eye.as_dvec3());
            let mut pixels = sight.pixels(&bounds, full).peekable();
            seen.movers_shown += u64::from(pixels.peek().is_some());
            if !kept[id.slot as usize] {
                for pixel in pixels {
                    let is_missed = sight.is_missed(&bounds, rays, pixel);
                    *if is_missed { &mut seen.missed_mover_pixels } else { &mut seen.crack_mover_pixels } += 1;
                }
            }
        }
        seen
    }
}

/// Rays through the pixels of a view.
struct Sight<'v> {
    view: &'v View,
    unproject: DMat3,
}

impl Sight<'_> {
    fn along(&self, at: DVec2) -> DVec3 {
        self.unproject * self.view.ndc(at).extend(1.0)
    }

    /// The pixels that show a box, relative to the eye.
    fn pixels<'s>(&'s self, bounds: &'s [DVec3; 2], full: &'s IdBuffer) -> impl Iterator<Item = usize> + 's {
        let [left, top, right, bottom] = self.around(bounds);
        let all = (top..bottom).flat_map(move |y| (left..right).map(move |x| [x, y]));
        let is_shown = |[x, y]: [usize; 2]| {
            let pixel = y * self.view.width + x;
            let t = enter(bounds, self.along(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)), self.view.near)?;
            (t < f64::from(full.depth(pixel))).then_some(pixel)
        };
        all.filter_map(is_shown)
    }

    /// The pixels around a box: left, top, and right and bottom beyond them.
    fn around(&self, bounds: &[DVec3; 2]) -> [usize; 4] {
        let (camera, view) = (&self.view.camera, self.view);
        let (mut low, mut high, mut behind) = (DVec2::INFINITY, DVec2::NEG_INFINITY, 0);
        for corner in 0..8 {
            let p = DVec3::from_array([0, 1, 2].map(|axis| bounds[corner >> axis & 1][axis]));
            let w = camera.w.as_dvec3().dot(p);
            behind += usize::from(w <= view.near);
            let at = view.pixel(DVec2::new(camera.x.as_dvec3().dot(p), camera.y.as_dvec3().dot(p)) / w);
            (low, high) = (low.min(at), high.max(at));
        }
        match behind {
            0 => {}
            8 => return [0; 4],
            _ => return [0, 0, view.width, view.height],
        }
        let size = DVec2::new(view.width as f64, view.height as f64);
        let (low, high) = (low.floor().clamp(DVec2::ZERO, size), high.ceil().clamp(DVec2::ZERO, size));
        [low.x as usize, low.y as usize, high.x as usize, high.y as usize]
    }

    /// Whether all rays around a pixel's middle meet the box first.
    fn is_missed(&self, bounds: &[DVec3; 2], rays: &RayScene<'_>, pixel: usize) -> bool {
        let middle = DVec2::new((pixel % self.view.width) as f64 + 0.5, (pixel / self.view.width) as f64 + 0.5);
        let eye = self.view.camera.eye.as_dvec3();
        AROUND.iter().all(|offset| {
            let along = self.along(middle + *offset * SPREAD);
            let Some(t) = enter(bounds, along, 0.0) else { return false };
            let is_clear = rays.first_opaque(eye, along, t).is_none() && !rays.ends_at_hole(eye, along, t);
            is_clear && !stands_on_a_surface(rays, eye, along)
        })
    }
}

/// Where a ray from the eye comes into a box, relative to the eye, beyond `near`.
fn enter(bounds: &[DVec3; 2], along: DVec3, near: f64) -> Option<f64> {
    let (mut from, mut to) = (near, f64::INFINITY);
    for axis in 0..3 {
        let ends = [bounds[0][axis] / along[axis], bounds[1][axis] / along[axis]];
        from = from.max(ends[0].min(ends[1]));
        to = to.min(ends[0].max(ends[1]));
    }
    (from <= to).then_some(from)
}
