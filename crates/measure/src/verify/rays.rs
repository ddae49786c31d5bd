//! Random rays and views, tested against the rows, the placement, and the cells and portals.

use super::cells::{Cells, Walk};
use super::sample::Sampler;
use super::triangles::Tracer;
use super::views::{Met, View};
use super::{EXAMPLES, Example, Violation, each_once};
use enfilade::file::PvsFile;
use enfilade::math::geom::Aabb;
use enfilade::math::parallel;
use enfilade::math::random::Prng;
use enfilade::scene::Scene;
use enfilade::types::placed::PlacedBox;
use enfilade::{CellId, ObjectId};
use glam::DVec3;

/// Rays of a task: fixed, so that results do not depend on the number of threads.
const CHUNK: u64 = 4096;

/// Results of a chunk of rays.
#[derive(Default)]
pub struct Tally {
    pub rays: u64,
    pub segments: u64,
    pub missed_rays: u64,
    pub missed_segments: u64,
    pub crack_rays: u64,
    pub pairs: Vec<(CellId, ObjectId)>,
    pub cell_pairs: Vec<(CellId, CellId)>,
    pub placements: Vec<(CellId, ObjectId)>,
    pub examples: Vec<Example>,
}

impl Tally {
    fn add(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.segments += other.segments;
        self.missed_rays += other.missed_rays;
        self.missed_segments += other.missed_segments;
        self.crack_rays += other.crack_rays;
        self.pairs.extend(other.pairs);
        self.cell_pairs.extend(other.cell_pairs);
        self.placements.extend(other.placements);
        for example in other.examples {
            self.example(example);
        }
        self
    }

    /// Each pair once.
    fn tidy(&mut self) {
        each_once(&mut self.pairs);
        each_once(&mut self.cell_pairs);
        each_once(&mut self.placements);
    }

    /// Keeps the first few of each kind.
    fn example(&mut self, example: Example) {
        let alike = self.examples.iter().filter(|e| e.violation == example.violation).count();
        if self.examples.len() < EXAMPLES && alike < EXAMPLES / 2 {
            self.examples.push(example);
        }
    }
}

/// The file, the model, and what rays need.
pub struct Test<'t> {
    pub file: &'t PvsFile,
    pub scene: &'t Scene,
    pub tracer: &'t Tracer,
    pub cells: &'t Cells,
    pub sampler: Sampler<'t>,
    /// Where each cell's objects begin in the list of all.
    pub starts: Vec<usize>,
}

impl Test<'_> {
    fn sees_object(&self, cell: CellId, object: ObjectId) -> bool {
        self.file.object_rows.as_ref().is_none_or(|rows| rows.get(cell.index(), object.index()))
    }

    fn sees_cell(&self, cell: CellId, other: CellId) -> bool {
        self.file.cell_rows.as_ref().is_none_or(|rows| rows.get(cell.index(), other.index()))
    }

    fn example(
        &self,
        violation: Violation,
        from: DVec3,
        at: DVec3,
        cells: [Option<CellId>; 2],
        object: Option<ObjectId>,
    ) -> Example {
        let origin = self.scene.origin;
        Example { violation, from: from + origin, at: at + origin, cells, object }
    }

    /// Casts random rays.
    pub fn rays(&self, count: u64, seed: u64) -> Tally {
        let tallies = parallel::map_range(0..count.div_ceil(CHUNK) as usize, |chunk| {
            let chunk = chunk as u64;
            let rng = &mut Prng::new(seed, 2 * chunk);
            let mut tally = Tally::default();
            for _ in 0..CHUNK.min(count - chunk * CHUNK) {
                if let Some((cell, eye, direction)) = self.sampler.ray(rng) {
                    tally.rays += 1;
                    self.ray(cell, eye, direction, true, &mut tally);
                }
            }
            tally.tidy();
            tally
        });
        tallies.into_iter().fold(Tally::default(), Tally::add)
    }

    /// Casts the rays of random views and adds them up. Returns the share of false pixels of each.
    pub fn views(&self, count: u32, seed: u64, tally: &mut Tally) -> Vec<f64> {
        let views: Vec<(f64, Tally)> = parallel::flat_map_range(0..count as usize, |number| {
            Some(self.view(&View::new(&self.sampler, seed, number as u64)?))
        });
        let fractions: Vec<f64> = views.iter().map(|v| v.0).collect();
        *tally = views.into_iter().map(|v| v.1).fold(std::mem::take(tally), Tally::add);
        tally.tidy();
        fractions
    }

    /// Casts a ray from a point in a cell. Returns true if it meets an object outside the row.
    fn ray(&self, cell: CellId, eye: DVec3, direction: DVec3, follow: bool, tally: &mut Tally) -> bool {
        let Met { objects, length, opaque } = Met::new(self.tracer, self.cells, eye, direction);
        objects.iter().for_each(|&(t, object)| self.placed(eye, direction, t, object, tally));
        let mut missed = objects.into_iter().filter(|&(_, object)| !self.sees_object(cell, object)).peekable();
        let is_missed = missed.peek().is_some();
        let (mut counted, mut crack) = (false, false);
        for (t, object) in missed {
            let at = eye + direction * t;
            if self.tracer.is_clear(eye, at, Some(object)) {
                counted = true;
                tally.pairs.push((cell, object));
                tally.example(self.example(Violation::Object, eye, at, [Some(cell), self.cells.locate(at)], Some(object)));
            } else {
                crack = true;
            }
        }
        tally.missed_rays += u64::from(counted);
        tally.crack_rays += u64::from(crack);
        if follow {
            self.segment(cell, eye, direction, length, opaque, tally);
        }
        is_missed
    }

    /// An object must be placed in the cell of the point just before it, and its box there must hold that point. The distance of
    /// that point is less than the margin of placement.
    fn placed(&self, eye: DVec3, direction: DVec3, t: f64, object: ObjectId, tally: &mut Tally) {
        let at = eye + direction * (t - 0.25 * self.file.smallest_hole).max(0.0);
        let Some(cell) = self.cells.locate(at) else { return };
        if !self.is_placed(cell, object, at) && self.tracer.is_clear(eye, at, Some(object)) {
            tally.placements.push((cell, object));
            tally.example(self.example(Violation::Placement, eye, at, [None, Some(cell)], Some(object)));
        }
    }

    fn is_placed(&self, cell: CellId, object: ObjectId, at: DVec3) -> bool {
        let (placement, o) = (&self.file.placement, object.index());
        let holds = |boxes: &Vec<PlacedBox>| {
            let (words, rest) = (&placement.row(cell.index())[..=o / 64], (1u64 << (o % 64)) - 1);
            let whole: usize = words[..o / 64].iter().map(|w| w.count_ones() as usize).sum();
            let before = whole + (words[o / 64] & rest).count_ones() as usize;
            let bounds = Aabb::of(self.file.objects[o].bounds.map(|p| p.as_dvec3()));
            boxes[self.starts[cell.index()] + before].of_box(bounds).inflated(self.file.smallest_hole).contains(at)
        };
        placement.get(cell.index(), o) && self.file.placed.as_ref().is_none_or(holds)
    }

    /// Follows an unobstructed segment through cells and portals.
    fn segment(&self, cell: CellId, eye: DVec3, direction: DVec3, length: f64, object: Option<ObjectId>, tally: &mut Tally) {
        tally.segments += 1;
        let Walk { reached, stuck } = self.cells.walk(cell, eye, direction, length);
        if let Some((t, from, to)) = stuck {
            // A little further, so that the wall at the end is part of the test.
            let beyond = (t + 4.0 * self.cells.tolerance()).min(length);
            let target = if beyond == length { object } else { None };
            // The guarantee excludes the clearance of every wall, also of the one at the segment's end: a grazing segment is near
            // that wall long before its end. So no object is exempt up to the exit, and the exempt end lies beyond it.
            let there = (t + self.file.smallest_hole / 2.0).min(length);
            let is_clear = |end: f64, target| self.tracer.is_clear(eye, eye + direction * end, target);
            if is_clear(there, None) && is_clear(beyond, target) {
                tally.missed_segments += 1;
                tally.example(self.example(Violation::Segment, eye, eye + direction * t, [Some(from), to], object));
            } else {
                tally.crack_rays += 1;
            }
        }
        for (other, t) in reached {
            let at = eye + direction * t;
            if !self.sees_cell(cell, other) && self.cells.is_inside(other, at) && self.tracer.is_clear(eye, at, None) {
                tally.cell_pairs.push((cell, other));
                tally.example(self.example(Violation::Cell, eye, at, [Some(cell), Some(other)], None));
            }
        }
    }

    /// The share of false pixels in a view.
    fn view(&self, view: &View) -> (f64, Tally) {
        let (mut tally, mut wrong) = (Tally::default(), 0);
        for direction in view.directions() {
            wrong += u32::from(self.ray(view.cell, view.eye, direction, false, &mut tally));
        }
        tally.tidy();
        (f64::from(wrong) / View::pixels(), tally)
    }
}
