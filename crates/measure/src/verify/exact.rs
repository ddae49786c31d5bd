//! Compares rows with the exact judge from a point ([`crate::exact`]).

use super::cells::Cells;
use super::sample::Sampler;
use super::triangles::Tracer;
use super::views::Met;
use super::{CheckError, consistent, scales};
use crate::exact::{ExactScene, Judge, MOST_SPLITS, Witness};
use enfilade::file::PvsFile;
use enfilade::math::parallel;
use enfilade::math::random::Prng;
use enfilade::scene::Scene;
use enfilade::types::guarantee::Guarantee;
use enfilade::{CellId, ObjectId};
use glam::DVec3;
use serde::Serialize;
use std::time::Instant;

/// First random stream of eyes, beyond those of rays and views.
const STREAMS: u64 = 1 << 48;
/// Maximum described misses.
const MOST: usize = 10;

/// A visible object that the row lacks; in the model's own coordinates, metres.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct ExactMiss {
    /// The eye.
    pub from: DVec3,
    /// Its cell.
    pub cell: CellId,
    /// The object that the row lacks.
    pub object: ObjectId,
    /// Direction from the eye to the object; of length 1.
    pub direction: DVec3,
}

/// Result of the test.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct ExactReport {
    /// Eyes that were tested.
    pub eyes: u32,
    /// Distinct cell-object pairs that are visible and not in the rows.
    pub missed_pairs: u64,
    /// Further distinct pairs that the rows lack: visible only past triangles nearer than the guarantee covers.
    pub crack_pairs: u64,
    /// Up to ten missed pairs, each once.
    pub misses: Vec<ExactMiss>,
    /// Mean number of visible triangles.
    pub visible_mean: f64,
    /// Mean number of undecided triangles.
    pub undecided_mean: f64,
    /// Wall-clock time.
    pub seconds: f64,
    /// Whether no pair is missed or the file is only sampled.
    pub passed: bool,
}

/// Result of one eye.
#[derive(Default)]
struct FromEye {
    missed: Vec<ExactMiss>,
    cracks: Vec<(CellId, ObjectId)>,
    visible: usize,
    undecided: usize,
}

/// Tests rows from random eyes in cells, anywhere and near portals and walls: every object with a witness must be in the row of
/// the eye's cell. As in [`super::check`], a miss counts if a separate ray meets the object along the witness and keeps half of
/// the smallest hole from everything else. The result does not depend on the number of threads.
pub fn check_exact(file: &PvsFile, scene: &Scene, eyes: u32, seed: u64) -> Result<ExactReport, CheckError> {
    let start = Instant::now();
    consistent(file, scene)?;
    let (tracer, cells, tolerance) = scales(scene, file);
    let sampler = Sampler::new(scene, &tracer, &cells, tolerance);
    let ready = ExactScene::new(scene);
    let test = Test { file, scene, tracer: &tracer, cells: &cells };
    let look = |judge: &mut Judge<'_>, number: usize| {
        let (cell, eye, _) = sampler.ray(&mut Prng::new(seed, STREAMS + number as u64))?;
        let seen = judge.around(eye, MOST_SPLITS);
        let mut found = FromEye { visible: seen.visible.len(), undecided: seen.undecided.len(), ..FromEye::default() };
        test.rows(cell, eye, &seen.visible, &mut found);
        Some(found)
    };
    let found = parallel::map_init(eyes as usize, || Judge::new(&ready), look);
    let found: Vec<FromEye> = found.into_iter().flatten().collect();
    let mut missed: Vec<ExactMiss> = found.iter().flat_map(|f| f.missed.iter().cloned()).collect();
    missed.sort_by_key(|m| (m.cell, m.object));
    missed.dedup_by_key(|m| (m.cell, m.object));
    let mut cracks: Vec<(CellId, ObjectId)> = found.iter().flat_map(|f| f.cracks.iter().copied()).collect();
    super::each_once(&mut cracks);
    cracks.retain(|&pair| missed.binary_search_by_key(&pair, |m| (m.cell, m.object)).is_err());
    let mean = |of: fn(&FromEye) -> usize| found.iter().map(of).sum::<usize>() as f64 / found.len().max(1) as f64;
    Ok(ExactReport {
        eyes: found.len() as u32,
        missed_pairs: missed.len() as u64,
        crack_pairs: cracks.len() as u64,
        passed: missed.is_empty() || file.guarantee == Guarantee::Sampled,
        misses: missed.into_iter().take(MOST).collect(),
        visible_mean: mean(|f| f.visible),
        undecided_mean: mean(|f| f.undecided),
        seconds: start.elapsed().as_secs_f64(),
    })
}

struct Test<'t> {
    file: &'t PvsFile,
    scene: &'t Scene,
    tracer: &'t Tracer,
    cells: &'t Cells,
}

impl Test<'_> {
    /// Compares witnesses, sorted by triangle, with the row of a cell.
    fn rows(&self, cell: CellId, eye: DVec3, visible: &[Witness], found: &mut FromEye) {
        let Some(rows) = &self.file.object_rows else { return };
        for of_object in visible.chunk_by(|a, b| self.object(a) == self.object(b)) {
            let object = self.object(&of_object[0]);
            if rows.get(cell.index(), object.index()) {
                continue;
            }
            match of_object.iter().find(|w| self.is_clear(eye, w.direction, object)) {
                Some(w) => {
                    found.missed.push(ExactMiss { from: eye + self.scene.origin, cell, object, direction: w.direction });
                }
                None => found.cracks.push((cell, object)),
            }
        }
    }

    fn object(&self, witness: &Witness) -> ObjectId {
        self.scene.object_of(witness.triangle as usize)
    }

    /// Whether a ray meets an object and keeps clear of all other triangles.
    fn is_clear(&self, eye: DVec3, direction: DVec3, object: ObjectId) -> bool {
        let met = Met::new(self.tracer, self.cells, eye, direction);
        let hit = met.objects.into_iter().find(|&(_, o)| o == object);
        hit.is_some_and(|(t, _)| self.tracer.is_clear(eye, eye + direction * t, Some(object)))
    }
}
