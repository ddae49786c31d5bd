//! View cells by cost: walkable space is divided while that saves triangles.
//!
//! Based on: Mattausch, Bittner, Wimmer, *Adaptive visibility-driven view cell construction*, 2006: a partition by planes that are chosen
//! by the expected render cost, and Mattausch, Bittner, Wonka, Wimmer, *Optimized subdivisions for preprocessed visibility*, 2007: the
//! split that saves most comes first, and a partition may stop at any size. Deviations: visibility is sampled by cubes at eyes over floors,
//! so that no splits are wasted where nobody walks; and the cost of an eye is the intersection of the rows of its part and its cell, as in
//! the run time.

use super::cubes::{Cube, CubeEngine, CubeScene, CubeView, NONE, Raster};
use super::triangles::Triangles;
use super::{Guarantee, Pvs};
use crate::cells::{Locator, Piece, ViewCell, ViewCellName};
use crate::job::{Job, Stopped};
use crate::math::bits;
use crate::math::geom::{Aabb, Plane};
use crate::math::random::SplitMix;
use crate::scene::Scene;
use crate::scene::floors::Floors;
use crate::scene::rays::RayScene;
use glam::DVec3;
use std::fmt;

/// Eyes for the samples of cost.
const EYES: usize = 4096;
/// Least number of eyes in a part, for a reliable estimate.
const LEAST: usize = 8;
/// Candidate cuts of a part along each axis: at the quantiles 1/32, 2/32, ... of its eyes.
const CUTS: usize = 32;
/// Least saving of a split, as a share of all triangles.
const WORTH: f64 = 5e-4;
/// Margin of view cells beyond all eyes, as a share of their extent.
const AROUND: f64 = 0.01;
/// Vertical margin of a view cell above and below its eyes, as a share of their height range.
const SPARE: f64 = 0.25;
/// Pixels along an edge of a cube's faces.
const PIXELS: u32 = 64;
/// Size of a view cell in a file without its row, bytes.
const HEAD: u64 = 40;

/// A partition, with its history.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Partition {
    /// Boxes, disjoint.
    pub views: Vec<ViewCell>,
    /// After each split: the expected bytes of the view cells, and the visible triangles, in the mean over eyes. The first entry is without
    /// view cells.
    pub curve: Vec<(u64, f64)>,
    /// Whether it ended because of the limit on bytes.
    pub full: bool,
    /// For each view cell, the cells of its eyes.
    pub eyes: Vec<Vec<usize>>,
    /// Set if no view cell is kept, because a conservative file saves too little by them: the share of triangles that portals prove hidden,
    /// from 0 to 1.
    pub unproven: Option<f64>,
}

impl Partition {
    /// Drops all view cells, because portals prove only this share of the triangles hidden.
    pub(crate) fn reject(&mut self, saving: f64) {
        (self.views, self.eyes) = (Vec::new(), Vec::new());
        self.curve.truncate(1);
        (self.full, self.unproven) = (false, Some(saving));
    }
}

impl fmt::Display for Partition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, last) = (self.curve.first().map_or(0.0, |c| c.1), self.curve.last().map_or(0.0, |c| c.1));
        if let Some(saving) = self.unproven {
            let hidden = 100.0 * saving;
            return write!(
                f,
                "view cells by cost: none kept, since portals prove only {hidden:.1} % of a row hidden from them (--rows sampled keeps only visible objects)"
            );
        }
        let end = if self.full { "the bytes are used up" } else { "the next one would save too little" };
        write!(
            f,
            "{} view cells by cost: a row shrinks from {first:.0} to {last:.0} triangles, expected; {end}",
            self.views.len()
        )
    }
}

/// Divides space into view cells of about `bytes` in a file, while that saves triangles.
///
/// # Errors
///
/// If it was stopped.
pub fn partition(scene: &Scene, pvs: &Pvs, bytes: u64, seed: u64, work: &Job<'_>) -> Result<Partition, Stopped> {
    work.tell("view cells", 0.0);
    let eyes = eyes(scene, pvs, seed, work)?;
    let triangles = Triangles::of(scene);
    let rows = match pvs.guarantee {
        Guarantee::Conservative => &pvs.objects_upper,
        Guarantee::Sampled => &pvs.objects_lower,
    };
    let cost = Cost { eyes, triangles, rows: (0..pvs.graph.cells.len()).map(|c| rows.row(c)).collect() };
    let places = Aabb::of(cost.eyes.iter().map(|eye| eye.at));
    Ok(cost.divide(places.inflated(AROUND * places.diagonal()), bytes))
}

/// A place, its cell, and the objects visible from it.
struct Eye {
    at: DVec3,
    cell: usize,
    seen: Vec<u64>,
}

/// Eyes over floors, with the visible objects by cubes.
fn eyes(scene: &Scene, pvs: &Pvs, seed: u64, work: &Job<'_>) -> Result<Vec<Eye>, Stopped> {
    let places = Floors::of(scene).eyes(&RayScene::new(scene), EYES, &mut SplitMix::new(seed));
    let locator = Locator::new(&pvs.graph);
    let places: Vec<(DVec3, usize)> =
        places.into_iter().filter_map(|at| Some((at, locator.locate(at)?.0.index()))).collect();
    let cubes = CubeScene::new(scene);
    let look = |(engine, cube): &mut (Raster<'_>, Cube), &(at, _): &(DVec3, usize)| {
        engine.cube(&CubeView::new(at, PIXELS), cube);
        let mut seen: Vec<u32> = cube.triangles.chunk_by(|a, b| a == b).map(|run| run[0]).collect();
        seen.extend(cube.see_through.iter().map(|clear| clear.triangle));
        seen.retain(|&triangle| triangle != NONE);
        seen.iter_mut().for_each(|triangle| *triangle = scene.object_of(*triangle as usize).0);
        seen.sort_unstable();
        seen.dedup();
        seen
    };
    let seen: Vec<Vec<u32>> = work.map_with(&places, || (Raster::new(&cubes), Cube::default()), look, |_| ())?;
    let words = scene.objects.len().div_ceil(64);
    let eye = |((at, cell), objects): ((DVec3, usize), Vec<u32>)| {
        let mut seen = vec![0; words];
        objects.into_iter().for_each(|o| seen[o as usize / 64] |= 1 << (o % 64));
        Eye { at, cell, seen }
    };
    Ok(places.into_iter().zip(seen).map(eye).collect())
}

/// The cost of eyes.
struct Cost<'a> {
    eyes: Vec<Eye>,
    triangles: Triangles,
    /// The row of each cell.
    rows: Vec<&'a [u64]>,
}

/// A part of space.
struct Part {
    bounds: Aabb,
    /// Numbers of its eyes.
    eyes: Vec<usize>,
    /// Triangles, summed over its eyes.
    cost: u64,
    /// Number of set bits in its row.
    bits: u64,
    /// Its best cut.
    split: Option<Split>,
}

struct Split {
    axis: usize,
    at: f64,
    saves: u64,
}

impl Cost<'_> {
    /// Repeatedly cuts the part with the largest saving.
    fn divide(&self, bounds: Aabb, bytes: u64) -> Partition {
        let count = self.eyes.len().max(1) as f64;
        let mean = |parts: &[Part]| parts.iter().map(|part| part.cost).sum::<u64>() as f64 / count;
        let size = |parts: &[Part]| parts.iter().map(|part| self.bytes(part)).sum::<u64>();
        let without = self.eyes.iter().map(|eye| self.triangles.in_row(self.rows[eye.cell].iter().copied())).sum::<u64>();
        let mut parts = vec![self.part(bounds, (0..self.eyes.len()).collect())];
        let mut found = Partition { curve: vec![(0, without as f64 / count)], ..Partition::default() };
        let least = (WORTH * without as f64) as u64;
        loop {
            let saves = |part: &Part| part.split.as_ref().map_or(0, |split| split.saves);
            let Some(best) = (0..parts.len()).max_by_key(|&i| (saves(&parts[i]), std::cmp::Reverse(i))) else { break };
            if saves(&parts[best]) <= least {
                break;
            }
            let halves = self.halves(&parts[best]);
            let more: u64 = halves.iter().map(|half| self.bytes(half)).sum();
            if size(&parts) - self.bytes(&parts[best]) + more > bytes {
                found.full = true;
                break;
            }
            parts.swap_remove(best);
            parts.extend(halves);
            found.curve.push((size(&parts), mean(&parts)));
        }
        if parts.len() > 1 {
            let view = |(i, part): (usize, &Part)| ViewCell {
                id: ViewCellName::Name(format!("auto {i}")),
                pieces: vec![piece(self.low(part))],
            };
            found.views = parts.iter().enumerate().map(view).collect();
            found.eyes = parts.iter().map(|part| part.eyes.iter().map(|&eye| self.eyes[eye].cell).collect()).collect();
        }
        found
    }

    fn part(&self, bounds: Aabb, eyes: Vec<usize>) -> Part {
        let row = self.row(&eyes);
        let cost = self.of(&eyes, &row);
        let split = self.split(&eyes, cost);
        Part { bounds, cost, bits: bits::ones(&row).count() as u64, split, eyes }
    }

    /// A part without the sky above its eyes, where all roofs are visible.
    fn low(&self, part: &Part) -> Aabb {
        let heights = part.eyes.iter().map(|&eye| self.eyes[eye].at.y);
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
        let (spare, mut bounds) = (SPARE * (high - low), part.bounds);
        bounds.max.y = bounds.max.y.min(high + spare);
        bounds.min.y = bounds.min.y.max(low - spare);
        bounds
    }

    /// Estimated size of its row and box in a file: a byte for each set bit, or a bit for each object.
    fn bytes(&self, part: &Part) -> u64 {
        HEAD + part.bits.min(self.triangles.objects() as u64 / 8)
    }

    fn halves(&self, part: &Part) -> [Part; 2] {
        let split = part.split.as_ref().expect("it saves something");
        let (mut low, mut high) = (part.bounds, part.bounds);
        low.max[split.axis] = split.at;
        high.min[split.axis] = split.at;
        let (left, right) = part.eyes.iter().partition(|&&eye| self.eyes[eye].at[split.axis] < split.at);
        [self.part(low, left), self.part(high, right)]
    }

    /// The cut with the largest saving of `cost`.
    fn split(&self, eyes: &[usize], cost: u64) -> Option<Split> {
        let mut best: Option<Split> = None;
        for axis in 0..3 {
            let (mut sorted, place) = (eyes.to_vec(), |eye: usize| self.eyes[eye].at[axis]);
            sorted.sort_by(|&a, &b| place(a).total_cmp(&place(b)));
            let cuts = (1..CUTS).map(|k| k * sorted.len() / CUTS);
            for cut in cuts.filter(|&cut| cut >= LEAST && sorted.len() - cut >= LEAST) {
                let (below, above) = (place(sorted[cut - 1]), place(sorted[cut]));
                let at = 0.5 * (below + above);
                if !(below < at && at <= above) {
                    continue;
                }
                let (left, right) = sorted.split_at(cut);
                let after = self.of(left, &self.row(left)) + self.of(right, &self.row(right));
                let saves = cost.saturating_sub(after);
                if saves > best.as_ref().map_or(0, |split| split.saves) {
                    best = Some(Split { axis, at, saves });
                }
            }
        }
        best
    }

    /// The union of the eyes' visible objects.
    fn row(&self, eyes: &[usize]) -> Vec<u64> {
        let mut row = vec![0; self.triangles.objects().div_ceil(64)];
        for &eye in eyes {
            row.iter_mut().zip(&self.eyes[eye].seen).for_each(|(all, seen)| *all |= seen);
        }
        row
    }

    /// Triangles drawn for these eyes with one row, summed.
    fn of(&self, eyes: &[usize], row: &[u64]) -> u64 {
        let mut cells: Vec<usize> = eyes.iter().map(|&eye| self.eyes[eye].cell).collect();
        cells.sort_unstable();
        let both = |cell: usize| row.iter().zip(self.rows[cell]).map(|(a, b)| a & b);
        cells.chunk_by(|a, b| a == b).map(|same| self.triangles.in_row(both(same[0])) * same.len() as u64).sum()
    }
}

fn piece(bounds: Aabb) -> Piece {
    let sides = [(DVec3::X, 0), (DVec3::Y, 1), (DVec3::Z, 2)];
    let planes =
        sides.into_iter().flat_map(|(n, axis)| [Plane { n, d: bounds.max[axis] }, Plane { n: -n, d: -bounds.min[axis] }]);
    Piece { planes: planes.collect(), bounds }
}
