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

    /// What shows of the movers in a picture of everything.
    pub fn shown<'v>(&self, view: &'v View, full: &'v IdBuffer) -> CrowdShown<'v> {
        let sight = Sight { view, unproject: view.camera.unproject(), full, far: Far::of(full) };
        let eye = view.camera.eye.as_dvec3();
        let relative = |bounds: &[Vec3; 2]| bounds.map(|p| p.as_dvec3() - eye);
        let shown = self.boxes.iter().map(|bounds| sight.pixels(&relative(bounds)).next().is_some()).collect();
        CrowdShown { sight, shown }
    }

    /// Compares the movers of a set with what shows.
    pub fn compare(&self, rays: &RayScene<'_>, CrowdShown { sight, shown }: &CrowdShown<'_>, set: &[MoverId]) -> CrowdSeen {
        let mut kept = vec![false; self.movers.slots()];
        set.iter().for_each(|id| kept[id.slot as usize] = true);
        let count = |is: &dyn Fn(usize) -> bool| (0..shown.len()).filter(|&k| is(k)).count() as u64;
        let mut seen = CrowdSeen { movers: set.len() as u64, movers_shown: count(&|k| shown[k]), ..CrowdSeen::default() };
        for k in (0..shown.len()).filter(|&k| shown[k] && !kept[self.ids[k].slot as usize]) {
            let bounds = self.boxes[k].map(|p| p.as_dvec3() - sight.view.camera.eye.as_dvec3());
            for pixel in sight.pixels(&bounds) {
                let is_missed = sight.is_missed(&bounds, rays, pixel);
                *if is_missed { &mut seen.missed_mover_pixels } else { &mut seen.crack_mover_pixels } += 1;
            }
        }
        seen
    }
}

/// What shows of movers in a picture.
pub struct CrowdShown<'v> {
    sight: Sight<'v>,
    /// By number: whether a pixel shows it.
    shown: Vec<bool>,
}

/// Side of a tile of [`Far`], pixels.
const TILE: usize = 16;

/// The largest depth in each tile of a picture: a box beyond it shows in none of its pixels.
struct Far {
    across: usize,
    depths: Vec<f32>,
}

impl Far {
    fn of(full: &IdBuffer) -> Self {
        let across = full.width.div_ceil(TILE);
        let mut depths = vec![0.0f32; across * full.height.div_ceil(TILE)];
        for pixel in 0..full.width * full.height {
            let tile = pixel / full.width / TILE * across + pixel % full.width / TILE;
            depths[tile] = depths[tile].max(full.depth(pixel));
        }
        Self { across, depths }
    }
}

/// Rays through the pixels of a view, and a picture of everything in it.
struct Sight<'v> {
    view: &'v View,
    unproject: DMat3,
    full: &'v IdBuffer,
    far: Far,
}

impl Sight<'_> {
    fn along(&self, at: DVec2) -> DVec3 {
        self.unproject * self.view.ndc(at).extend(1.0)
    }

    /// The pixels that show a box, relative to the eye, tile by tile.
    fn pixels<'s>(&'s self, bounds: &'s [DVec3; 2]) -> impl Iterator<Item = usize> + 's {
        let ([left, top, right, bottom], nearest) = self.around(bounds);
        let tiles = (top / TILE..bottom.div_ceil(TILE))
            .flat_map(move |y| (left / TILE..right.div_ceil(TILE)).map(move |x| [x, y]))
            .filter(move |[x, y]| nearest <= f64::from(self.far.depths[y * self.far.across + x]));
        let all = tiles.flat_map(move |[x, y]| {
            let (x, y) = (x * TILE, y * TILE);
            (y.max(top)..(y + TILE).min(bottom)).flat_map(move |y| (x.max(left)..(x + TILE).min(right)).map(move |x| [x, y]))
        });
        let is_shown = |[x, y]: [usize; 2]| {
            let pixel = y * self.view.width + x;
            let t = enter(bounds, self.along(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)), self.view.near)?;
            (t < f64::from(self.full.depth(pixel))).then_some(pixel)
        };
        all.filter_map(is_shown)
    }

    /// The pixels around a box: left, top, and right and bottom beyond them; and its least depth.
    fn around(&self, bounds: &[DVec3; 2]) -> ([usize; 4], f64) {
        let (camera, view) = (&self.view.camera, self.view);
        let (mut low, mut high, mut behind, mut nearest) = (DVec2::INFINITY, DVec2::NEG_INFINITY, 0, f64::INFINITY);
        // Corners beyond each side of the picture, behind the eye, too.
        let mut beside = [0; 4];
        for corner in 0..8 {
            let p = DVec3::from_array([0, 1, 2].map(|axis| bounds[corner >> axis & 1][axis]));
            let w = camera.w.as_dvec3().dot(p);
            behind += usize::from(w <= view.near);
            nearest = nearest.min(w);
            let clip = DVec2::new(camera.x.as_dvec3().dot(p), camera.y.as_dvec3().dot(p));
            let sides = [clip.x > w, -clip.x > w, clip.y > w, -clip.y > w];
            (0..4).for_each(|side| beside[side] += usize::from(sides[side]));
            let at = view.pixel(clip / w);
            (low, high) = (low.min(at), high.max(at));
        }
        match behind {
            _ if behind == 8 || beside.contains(&8) => return ([0; 4], nearest),
            0 => {}
            _ => return ([0, 0, view.width, view.height], nearest),
        }
        let size = DVec2::new(view.width as f64, view.height as f64);
        let (low, high) = (low.floor().clamp(DVec2::ZERO, size), high.ceil().clamp(DVec2::ZERO, size));
        // Below what rounding adds.
        ([low.x as usize, low.y as usize, high.x as usize, high.y as usize], nearest * (1.0 - 1e-6))
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

#[cfg(test)]
mod tests {
    use super::super::raster::draw;
    use super::*;
    use enfilade::runtime::Camera;
    use enfilade::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};

    /// Boxes before, behind and across a wall, around the eye, behind it and beside the picture: each shows in the pixels whose rays it stops
    /// before the wall.
    #[test]
    fn boxes_show_in_the_pixels_whose_rays_meet_them_first() {
        let positions = [(-3.0, -3.0), (2.0, -3.0), (2.0, 2.0), (-3.0, 2.0)].map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        let wall = Mesh {
            node: "wall".into(),
            role: Role::Structure,
            opaque: true,
            positions,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        builder.add(wall).unwrap();
        let scene = builder.finish("wall").unwrap();
        let eye = DVec3::new(0.3, 0.2, 4.0) - scene.origin;
        let camera = Camera::look_at(eye, eye + DVec3::new(0.1, 0.05, -1.0), 1.0, 1.3);
        let view = View { camera, near: 0.05, width: 83, height: 61 };
        let full = draw(&scene, &view, &|_| true);
        let sight = Sight { view: &view, unproject: camera.unproject(), full: &full, far: Far::of(&full) };
        let (mut shown, mut hidden) = (0, 0);
        for k in 0..400 {
            let [x, y, z] = [0, 1, 2].map(|axis| golden_turn(k * 3 + axis));
            let middle = DVec3::new(x * 12.0 - 6.0, y * 12.0 - 6.0, z * 9.0 - 7.0);
            let half = DVec3::splat([0.05, 0.4, 1.5, 4.0][k % 4]);
            let bounds = [middle - half, middle + half];
            let stops = |pixel: &usize| {
                let at = DVec2::new((pixel % view.width) as f64 + 0.5, (pixel / view.width) as f64 + 0.5);
                let t = enter(&bounds, camera.ray(view.ndc(at)), view.near);
                t.is_some_and(|t| t < f64::from(full.depth(*pixel)))
            };
            let all: Vec<usize> = (0..view.width * view.height).filter(stops).collect();
            let mut found: Vec<usize> = sight.pixels(&bounds).collect();
            found.sort_unstable();
            assert_eq!(found, all, "{bounds:?}");
            *if all.is_empty() { &mut hidden } else { &mut shown } += 1;
        }
        assert!(shown > 60 && hidden > 60, "{shown} {hidden}");
    }
}
