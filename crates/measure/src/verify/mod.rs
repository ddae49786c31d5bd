//! Tests a `.pvs` file against its model, independently of the bake.
//!
//! The test uses only the triangles and the decoded file. It has its own code for rays, cells and portals, so that it does not
//! share faults of the sampler, the flow or the partition. Three things are tested on random rays from random points (anywhere in
//! a cell, near portals, near walls, outside), in random directions and towards portals and objects:
//!
//! 1. **Pairs**: the first opaque object on a ray, and every see-through object before it, must be in the row of the eye's cell;
//!    every cell that the ray reaches must be in that cell's row of cells. The object must be placed in the cell where it is met.
//! 2. **Segments**: the unobstructed segment must run inside cells, and pass from cell to cell only through portals between the
//!    two. This is the meaning of *sealed*.
//! 3. **Views**: in pictures from random eyes, the share of pixels whose object is not in the row of the eye's cell.
//!
//! The test also examines the structure of the file's cells and portals ([`Structure`]), free space inside that is in no cell
//! ([`FreeSpace`]) and, on request, every hole, as a line through it ([`Leaks`]).
//!
//! [`check_exact`] uses another judge: objects that [`crate::exact`] proves visible must be in the row of the eye's cell.
//!
//! # Which violations count
//!
//! A file promises nothing about openings narrower than its `smallest_hole`, and real meshes have hairline cracks. So a violation
//! counts only if the segment, up to the violation, keeps half of `smallest_hole` from every opaque triangle. The object at its
//! end is exempt, and so are other triangles within that distance of the end. An eye on a wall may be on either side of it within
//! rounding. The distance of segments and triangles is exact. Other violations are counted in [`CheckReport::crack_rays`] and
//! fail nothing. Listed closed holes count as opaque. Points within `smallest_hole` of a piece's boundary count as inside, and
//! portals grow by as much. Pixels of views are counted as they are, cracks included.
//!
//! [`CheckReport::passed`] is false if the structure has a fault, or if a segment or a row of a [`Guarantee::Conservative`] file
//! is violated. The rows of a [`Guarantee::Sampled`] file promise nothing; there, missed rays and pixels estimate the error. A
//! pass is not a proof: it says that none of these rays found a violation.

mod cells;
mod exact;
mod frames;
mod leaks;
pub mod level_lines;
mod rays;
pub mod rooms;
mod sample;
mod structure;
mod tight;
mod triangles;
mod views;
mod walks;

pub use exact::{ExactMiss, ExactReport, check_exact};
pub use frames::random_path;
pub use leaks::{Leak, LeakKind, Leaks, MOST_LEAKS};
pub use structure::{Fault, FaultKind, Structure};
pub use views::{Views, held_out};
pub use walks::{FreeSpace, Place};

use cells::Cells;
use enfilade::file::PvsFile;
use enfilade::scene::Scene;
use enfilade::types::guarantee::Guarantee;
use enfilade::{BitMatrix, CellId, ObjectId};
use glam::DVec3;
use rays::Test;
use sample::Sampler;
use serde::Serialize;
use std::time::Instant;
use triangles::Tracer;

/// Maximum described violations.
const EXAMPLES: usize = 10;

/// Sorts pairs and removes duplicates.
fn each_once<T: Ord>(pairs: &mut Vec<T>) {
    pairs.sort_unstable();
    pairs.dedup();
}

/// How much to test.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CheckOptions {
    /// Rays; each is tested as pairs and as a segment.
    pub rays: u64,
    /// Views of 96 x 54 rays.
    pub views: u32,
    /// Seed of every random choice.
    pub seed: u64,
    /// Whether to find a line through every hole.
    pub leaks: bool,
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self { rays: 1_000_000, views: 100, seed: 0, leaks: false }
    }
}

/// Why a file cannot be tested against a model.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckError {
    /// A different model, or one imported with other options.
    #[error("is not the file's model (hash {model:032x}, expected {file:032x}); give the file's model, or bake again")]
    OtherModel {
        /// The model's hash.
        model: u128,
        /// The hash in the file.
        file: u128,
    },
    /// The file's tables do not fit each other.
    #[error("{0}; bake again")]
    Inconsistent(String),
}

/// Fractions of a view.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct Fractions {
    /// Mean over the views.
    pub mean: f64,
    /// 95 of 100 views do not exceed this.
    pub p95: f64,
    /// The worst view.
    pub max: f64,
}

impl Fractions {
    /// Of views, in any order; 0 without views.
    fn of(mut views: Vec<f64>) -> Self {
        views.sort_by(f64::total_cmp);
        Self {
            mean: views.iter().fold(0.0, |sum, x| sum + x) / views.len().max(1) as f64,
            p95: views.get((views.len() * 95).div_ceil(100).saturating_sub(1)).copied().unwrap_or_default(),
            max: views.last().copied().unwrap_or_default(),
        }
    }
}

/// Kind of a violation.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Violation {
    /// A visible object is not in the row.
    Object,
    /// A visible cell is not in the row.
    Cell,
    /// A segment left a cell other than through a portal.
    Segment,
    /// An object is met in a cell in which it is not placed.
    Placement,
}

/// A violation, for people to look at; positions in the model's own coordinates, metres.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Example {
    /// Its kind.
    pub violation: Violation,
    /// The eye.
    pub from: DVec3,
    /// The point where the ray hits the object, reaches the cell, or leaves its cell.
    pub at: DVec3,
    /// For objects and cells: the eye's cell and the cell reached. For segments: the cell left, and the cell entered without a
    /// portal. `None`: space in no cell.
    pub cells: [Option<CellId>; 2],
    /// The object that was missed, or that stopped the segment.
    pub object: Option<ObjectId>,
}

/// Result of the test.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct CheckReport {
    /// The file's guarantee.
    pub guarantee: Guarantee,
    /// Rays cast, without those of views.
    pub rays: u64,
    /// Unobstructed segments followed through cells and portals.
    pub segments: u64,
    /// Rays, including those of views, that met an object outside the row.
    pub missed_rays: u64,
    /// Distinct cell-object pairs among them.
    pub missed_pairs: u64,
    /// Distinct cell-cell pairs that a segment proved and the row lacks.
    pub missed_cell_pairs: u64,
    /// Segments that left a cell other than through a portal.
    pub missed_segments: u64,
    /// Distinct cell-object pairs that a ray met and the file's placement lacks.
    pub missed_placements: u64,
    /// Violations whose segment does not keep clear of opaque triangles: cracks and grazing rays, which the guarantee excludes.
    pub crack_rays: u64,
    /// Views.
    pub views: u32,
    /// Pixels of views whose object is not in the row.
    pub false_pixels: Fractions,
    /// Cells without a point safely inside: no ray starts there.
    pub empty_cells: u32,
    /// Faults of cells and portals, found without rays.
    pub structure: Structure,
    /// Free space inside that is in no cell.
    pub free_outside_cells: FreeSpace,
    /// Every hole, if [`CheckOptions::leaks`] is set.
    #[serde(flatten)]
    pub leaks: Option<Leaks>,
    /// Up to ten violations.
    pub examples: Vec<Example>,
    /// Wall-clock time.
    pub seconds: f64,
    /// Whether these rays found no violation of the guarantee.
    pub passed: bool,
}

/// Tests a file against its model.
pub fn check(file: &PvsFile, scene: &Scene, options: &CheckOptions) -> Result<CheckReport, CheckError> {
    let start = Instant::now();
    // 1. Checks the model's hash and the file's tables.
    consistent(file, scene)?;
    // 2. Builds the structures for rays.
    let (tracer, cells, tolerance) = scales(scene, file);
    let mut starts = vec![0];
    (0..file.cells.len()).for_each(|cell| starts.push(starts[cell] + file.placement.ones(cell).count()));
    let sampler = Sampler::new(scene, &tracer, &cells, tolerance);
    let test = Test { file, scene, tracer: &tracer, cells: &cells, sampler, starts };
    // 3. Rays, in chunks with a random stream each.
    let mut tally = test.rays(options.rays, options.seed);
    // 4. Views.
    let fractions = test.views(options.views, options.seed, &mut tally);
    // 5. Tests without rows.
    let structure = structure::structure(file, &cells);
    let free_outside_cells = walks::walks(scene, &cells, &tracer, options.rays, options.seed);
    let segments: Vec<Example> = tally.examples.iter().filter(|e| e.violation == Violation::Segment).cloned().collect();
    let leaks = options.leaks.then(|| leaks::find(file, scene, &cells, &tracer, &segments));
    // 6. The report.
    let is_whole = structure.count == 0;
    let rows_kept = tally.pairs.is_empty() && tally.cell_pairs.is_empty();
    Ok(CheckReport {
        guarantee: file.guarantee,
        rays: tally.rays,
        segments: tally.segments,
        missed_rays: tally.missed_rays,
        missed_pairs: tally.pairs.len() as u64,
        missed_cell_pairs: tally.cell_pairs.len() as u64,
        missed_segments: tally.missed_segments,
        missed_placements: tally.placements.len() as u64,
        crack_rays: tally.crack_rays,
        views: fractions.len() as u32,
        false_pixels: Fractions::of(fractions),
        empty_cells: cells.empty_cells(),
        structure,
        free_outside_cells,
        leaks,
        examples: tally.examples,
        seconds: start.elapsed().as_secs_f64(),
        passed: tally.missed_segments == 0
            && tally.placements.is_empty()
            && is_whole
            && (rows_kept || file.guarantee == Guarantee::Sampled),
    })
}

/// Structures for rays, and the distance from a piece's boundary within which points count as inside, metres.
fn scales(scene: &Scene, file: &PvsFile) -> (Tracer, Cells, f64) {
    // Planes and windings are rounded to f32 in the file.
    let rounding = scene.bounds().diagonal() * 1e-6;
    let tolerance = file.smallest_hole.max(rounding);
    let tracer = Tracer::new(file, scene, file.smallest_hole / 2.0, rounding);
    (tracer, Cells::new(file, scene.bounds(), tolerance, rounding), tolerance)
}

/// Scores a file's cells and portals against annotated rooms and doors.
pub fn score_rooms(file: &PvsFile, scene: &Scene, written: &rooms::RoomsFile) -> Result<rooms::RoomScore, CheckError> {
    consistent(file, scene)?;
    let rounding = scene.bounds().diagonal() * 1e-6;
    let cells = Cells::new(file, scene.bounds(), file.smallest_hole.max(rounding), rounding);
    Ok(rooms::score(file, &cells, written))
}

fn consistent(file: &PvsFile, scene: &Scene) -> Result<(), CheckError> {
    let model = scene.hash();
    if model != file.model_hash {
        return Err(CheckError::OtherModel { model, file: file.model_hash });
    }
    let bad = |what: String| Err(CheckError::Inconsistent(what));
    if file.objects.len() != scene.objects.len() {
        return bad(format!("{} objects in the file, {} in the model", file.objects.len(), scene.objects.len()));
    }
    let cells = file.cells.len();
    if cells == 0 {
        return bad("there are no cells".into());
    }
    let shape =
        |rows: &Option<BitMatrix>, columns: usize| rows.as_ref().is_none_or(|r| r.rows() == cells && r.columns() == columns);
    if !shape(&file.cell_rows, cells) || !shape(&file.object_rows, scene.objects.len()) {
        return bad("the rows have the wrong shape".into());
    }
    if (file.placement.rows(), file.placement.columns()) != (cells, scene.objects.len()) {
        return bad("the placement of objects has the wrong shape".into());
    }
    let (pairs, boxes) = (file.placement.count_ones(), file.placed.as_ref().map(Vec::len));
    if let Some(boxes) = boxes.filter(|&boxes| boxes as u64 != pairs) {
        return bad(format!("{boxes} boxes of objects in cells for {pairs} objects in cells"));
    }
    if file.origin != scene.origin {
        return bad(format!("the origin is {}, the model's is {}", file.origin, scene.origin));
    }
    let damaged = file.objects.iter().zip(&scene.objects).position(|(kept, object)| {
        let [min, max] = kept.bounds.map(|p| p.as_dvec3());
        let holds = |p: DVec3| p.cmpge(min).all() && p.cmple(max).all();
        kept.triangles as usize != object.triangles.len()
            || !object.triangles.clone().flat_map(|t| scene.corners(t as usize)).all(holds)
    });
    if let Some(object) = damaged {
        return bad(format!(
            "object {object} has a different number of triangles in the model, or its box does not hold them"
        ));
    }
    match file.portals.iter().position(|p| p.winding.len() < 3 || p.cells.iter().any(|c| c.index() >= cells)) {
        Some(portal) => bad(format!("portal {portal} joins cells that do not exist, or has fewer than three corners")),
        None => Ok(()),
    }
}
