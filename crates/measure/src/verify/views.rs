//! Views for tests: `check` counts their false pixels, and [`held_out`] draws them once to compare many rows.

use super::cells::Cells;
use super::sample::{Sampler, direction};
use super::triangles::Tracer;
use super::{Fractions, scales};
use enfilade::file::PvsFile;
use enfilade::math::parallel;
use enfilade::math::random::Prng;
use enfilade::scene::Scene;
use enfilade::{BitMatrix, CellId, ObjectId};
use glam::DVec3;
use std::collections::BTreeMap;

/// Rays of a view, across and up.
const VIEW: [u32; 2] = [96, 54];

/// An eye and its direction.
pub(super) struct View {
    pub(super) cell: CellId,
    pub(super) eye: DVec3,
    forward: DVec3,
}

impl View {
    /// The `number`-th view of a seed; `None` if no cell has room for an eye.
    pub(super) fn new(sampler: &Sampler<'_>, seed: u64, number: u64) -> Option<Self> {
        let rng = &mut Prng::new(seed, 2 * number + 1);
        let (cell, eye) = sampler.viewpoint(rng)?;
        let flat = direction(rng).with_y(0.0).normalize_or(DVec3::X);
        Some(Self { cell, eye, forward: (flat + DVec3::Y * rng.range(-0.35, 0.35)).normalize() })
    }

    /// Its rays, row by row; 60 degrees from top to bottom.
    pub(super) fn directions(&self) -> impl Iterator<Item = DVec3> {
        let forward = self.forward;
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let [columns, rows] = VIEW.map(f64::from);
        let (tall, wide) = (1.0 / 3f64.sqrt(), columns / rows / 3f64.sqrt());
        (0..VIEW[1]).flat_map(move |y| (0..VIEW[0]).map(move |x| (x, y))).map(move |(x, y)| {
            let (u, v) = ((f64::from(x) + 0.5) / columns * 2.0 - 1.0, (f64::from(y) + 0.5) / rows * 2.0 - 1.0);
            (forward + right * (u * wide) + up * (v * tall)).normalize()
        })
    }

    /// Number of its rays.
    pub(super) fn pixels() -> f64 {
        f64::from(VIEW[0] * VIEW[1])
    }
}

/// Objects on a ray: the see-through ones before the first opaque one, and that one.
pub(super) struct Met {
    /// Objects, by metres from the eye.
    pub(super) objects: Vec<(f64, ObjectId)>,
    /// Length of the ray: to the first opaque object or to the end of the tested space.
    pub(super) length: f64,
    /// The first opaque object.
    pub(super) opaque: Option<ObjectId>,
}

impl Met {
    pub(super) fn new(tracer: &Tracer, cells: &Cells, eye: DVec3, direction: DVec3) -> Self {
        let end = cells.exit(eye, direction);
        let hit = tracer.first_opaque(eye, direction, end);
        let length = hit.map_or(end, |h| h.0);
        let mut objects = tracer.see_through(eye, direction, length);
        objects.extend(hit);
        Self { objects, length, opaque: hit.map(|h| h.1) }
    }
}

/// Views of a scene, drawn once: the cell of each eye, and the objects of its pixels.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Views(Vec<(CellId, Vec<Pixels>)>);

/// Pixels of a view with the same objects.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Pixels {
    /// The first opaque object and the see-through ones before it, ascending.
    objects: Vec<ObjectId>,
    count: u32,
}

/// Draws views from eyes in the cells of `file`, which was baked for `scene`: those of [`super`] for this seed, 96 x 54 pixels
/// each. There are fewer than `count` if no cell has room for an eye.
pub fn held_out(scene: &Scene, file: &PvsFile, seed: u64, count: u32) -> Views {
    let (tracer, cells, tolerance) = scales(scene, file);
    let sampler = Sampler::new(scene, &tracer, &cells, tolerance);
    let draw = |number: usize| {
        let view = View::new(&sampler, seed, number as u64)?;
        let mut shown: BTreeMap<Vec<ObjectId>, u32> = BTreeMap::new();
        for direction in view.directions() {
            let met = Met::new(&tracer, &cells, view.eye, direction);
            let mut objects: Vec<ObjectId> = met.objects.iter().map(|o| o.1).collect();
            objects.sort_unstable();
            objects.dedup();
            *shown.entry(objects).or_default() += 1;
        }
        Some((view.cell, shown.into_iter().map(|(objects, count)| Pixels { objects, count }).collect()))
    };
    Views(parallel::flat_map_range(0..count as usize, draw))
}

impl Views {
    /// Number of views.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The share of each view's pixels with an object that is not in the row (cells x objects) of the eye's cell: mean, 95th
    /// percentile, maximum.
    pub fn false_pixels(&self, rows: &BitMatrix) -> [f64; 3] {
        let wrong = |view: &(CellId, Vec<Pixels>)| f64::from(missed(view, rows)) / View::pixels();
        let Fractions { mean, p95, max } = Fractions::of(parallel::map(&self.0, wrong));
        [mean, p95, max]
    }

    /// The pixels of all views with an object that is not in the row (cells x objects) of the eye's cell.
    pub fn missed_pixels(&self, rows: &BitMatrix) -> u64 {
        self.0.iter().map(|view| u64::from(missed(view, rows))).sum()
    }
}

/// Pixels of a view with an object that is not in the row of the eye's cell.
fn missed((cell, shown): &(CellId, Vec<Pixels>), rows: &BitMatrix) -> u32 {
    let is_missed = |p: &&Pixels| p.objects.iter().any(|o| !rows.get(cell.index(), o.index()));
    shown.iter().filter(is_missed).map(|p| p.count).sum()
}
