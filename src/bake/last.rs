//! A bake after an edit: what the file of the last bake tells of the new model.
//!
//! Nothing of it is believed. It only guesses: which strategy finds the cells, which pairs were not hidden, so that no search for a proof is
//! worth its time, and where rays hit. Everything that the new file says is proven on the new model (docs/theory.md, *A bake after an edit*).

use super::choose_cells::{choose, split_as};
use crate::cells::{Cell, CellGraph, Locator, SplitError, SplitOptions};
use crate::file::{FileError, Guarantee, PvsFile};
use crate::job::Job;
use crate::math::geom::Aabb;
use crate::math::tolerance::single_precision;
use crate::pvs::again::{Again, Hints};
use crate::scene::Scene;
use crate::scene::rays::RayScene;
use crate::types::proof::Witness;
use crate::{BitMatrix, CellId, ObjectId};
use glam::DVec3;
use serde::Serialize;
use std::collections::HashMap;
use xxhash_rust::xxh3::xxh3_128;

/// The last bake's file is of use if at least this share of the objects are as they were. Smaller: a bake that proves again what is another
/// model's. Larger: a storey that was added makes all anew.
const IN_COMMON: f64 = 0.25;
/// Most pieces of a cell that are looked up in the last bake's cells.
const PIECES: usize = 64;

/// The file of the last bake, and a hash of its bytes.
#[derive(Clone, PartialEq, Debug)]
pub struct Last {
    file: PvsFile,
    hash: u128,
}

/// What changed in the objects of a model since its last bake.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct Changes {
    /// Objects of the same name, size and place.
    pub same: usize,
    /// Of the same name and size, elsewhere.
    pub moved: usize,
    /// Of the same name.
    pub changed: usize,
    /// Of a name that there was not.
    pub new: usize,
    /// That are no more.
    pub gone: usize,
}

/// What a bake took from the last one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct Since {
    /// The objects.
    #[serde(flatten)]
    pub objects: Changes,
    /// What became of the pairs.
    #[serde(flatten)]
    pub pairs: Again,
}

impl std::fmt::Display for Since {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Changes { same, moved, changed, new, gone } = self.objects;
        let Again { cells, cells_anew, hidden, hidden_again } = self.pairs;
        let counts = [(moved, "moved"), (changed, "changed"), (new, "new"), (gone, "gone")];
        let counts = counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}"));
        let counts = counts.collect::<Vec<_>>().join(", ");
        let counts = if counts.is_empty() { "no object moved".to_owned() } else { format!("objects {counts}") };
        write!(
            f,
            "since the last bake: {counts}, {same} as they were; {} of {cells} cells see no change; of {hidden} pairs that it hid, {hidden_again} are \
             hidden again, and the others drawn (--fresh bakes all)",
            cells - cells_anew
        )
    }
}

impl Last {
    /// The file of the last bake, from its bytes.
    ///
    /// # Errors
    ///
    /// [`FileError`].
    pub fn read(bytes: &[u8]) -> Result<Self, FileError> {
        Ok(Self { file: PvsFile::read(bytes)?, hash: xxh3_128(bytes) })
    }

    /// The file.
    pub fn file(&self) -> &PvsFile {
        &self.file
    }

    /// A hash of the file's bytes.
    pub(super) fn hash(&self) -> u128 {
        self.hash
    }

    /// Why nothing can be taken from it, whatever the model.
    pub fn is_of_no_use(&self) -> Option<&'static str> {
        if self.file.is_cut_short() {
            Some("its bake was stopped")
        } else if self.file.guarantee != Guarantee::Conservative {
            Some("its rows are sampled")
        } else {
            None
        }
    }

    /// Whether enough of the objects are as they were, for a scene that was split as the file's.
    pub(super) fn has_in_common(&self, scene: &Scene) -> bool {
        let same = Matching::new(&self.file, scene).changes.same;
        same as f64 >= IN_COMMON * scene.objects.len().max(1) as f64
    }

    /// Cells as the last bake chose them.
    pub(super) fn cells(
        &self,
        rays: &RayScene<'_>,
        options: &SplitOptions,
        work: &Job<'_>,
    ) -> Result<CellGraph, SplitError> {
        let is_undivided = matches!(&self.file.cells[..], [only] if only.open);
        match split_as(rays, (self.file.strategy, is_undivided), options, work)? {
            Some(graph) => Ok(CellGraph { reason: self.file.reason.clone(), ..graph }),
            None => choose(rays, options, work),
        }
    }

    /// The changes, and guesses for a scene and its cells.
    pub(super) fn hints(&self, scene: &Scene, graph: &CellGraph) -> (Changes, Hints) {
        let file = &self.file;
        let matching = Matching::new(file, scene);
        let old_graph = file.graph();
        let locator = Locator::new(&old_graph);
        let to_old = scene.origin - file.origin;
        let now_at = |cell: &Cell| {
            let places = cell.pieces.iter().map(|piece| piece.bounds.centre()).filter(|p| p.is_finite());
            let mut old: Vec<CellId> =
                places.take(PIECES).filter_map(|p| locator.locate(p + to_old)).map(|(cell, _)| cell).collect();
            old.sort_unstable();
            old.dedup();
            old
        };
        let count = graph.cells.len();
        // The last bake's cells where each cell is; and the other way round.
        let were: Vec<Vec<CellId>> = graph.cells.iter().map(now_at).collect();
        let mut are: Vec<Vec<usize>> = vec![Vec::new(); file.cells.len()];
        were.iter().enumerate().for_each(|(c, were)| were.iter().for_each(|old| are[old.index()].push(c)));
        let (mut seen, mut cells_seen) = (BitMatrix::new(count, scene.objects.len()), BitMatrix::new(count, count));
        let mut saw_change = vec![false; count];
        for (c, were) in were.iter().enumerate() {
            for &old in were {
                for object in file.objects_seen(old) {
                    match matching.now[object.index()] {
                        Some(object) => _ = seen.set(c, object as usize),
                        None => saw_change[c] = true,
                    }
                }
                for other in file.cells_seen(old).flat_map(|other| &are[other.index()]) {
                    cells_seen.set(c, *other);
                    cells_seen.set(*other, c);
                }
            }
        }
        let mut objects = vec![0; seen.columns().div_ceil(64)];
        matching.now.iter().flatten().for_each(|&object| objects[object as usize / 64] |= 1 << (object % 64));
        let segment = |[a, b]: [DVec3; 2]| [a - to_old, b - to_old];
        let witnesses = file.bounds.iter().flat_map(|bounds| &bounds.witnesses).filter_map(|witness| {
            let object = ObjectId(matching.now[witness.object.index()]?);
            let [from, to] = segment([witness.from, witness.to]);
            Some(Witness { object, from, to, ..*witness })
        });
        let hints = Hints {
            witnesses: witnesses.collect(),
            through_holes: file.repairs.iter().map(|repair| segment(repair.segment)).collect(),
            cells: were.iter().map(|were| !were.is_empty()).collect(),
            objects,
            seen,
            cells_seen,
            saw_change,
        };
        (matching.changes, hints)
    }
}

/// The objects of a file in a scene.
struct Matching {
    /// For each object of the file, the one that is as it was.
    now: Vec<Option<u32>>,
    changes: Changes,
}

impl Matching {
    fn new(file: &PvsFile, scene: &Scene) -> Self {
        let shift = file.origin - scene.origin;
        let old: Vec<Aabb> = file.object_bounds().map(|b| Aabb { min: b.min + shift, max: b.max + shift }).collect();
        let extent = scene.bounds().min.abs().max(scene.bounds().max.abs()).max_element();
        let near = single_precision(extent + shift.abs().max_element());
        // By name and number of triangles, then by name alone.
        let mut by_form: HashMap<(&str, u32), Vec<u32>> = HashMap::new();
        let mut by_name: HashMap<&str, usize> = HashMap::new();
        for (o, object) in file.objects.iter().enumerate() {
            by_form.entry((&object.node, object.triangles)).or_default().push(o as u32);
            *by_name.entry(&object.node).or_default() += 1;
        }
        let mut now = vec![None; file.objects.len()];
        let mut rest = Vec::new();
        for (o, object) in scene.objects.iter().enumerate() {
            let bounds = object.extent();
            let is_here = |&i: &u32| is_near(&old[i as usize], &bounds, near);
            let alike = by_form.get_mut(&(object.node.as_str(), object.triangles.len() as u32));
            let found = alike.and_then(|alike| alike.iter().position(is_here).map(|at| alike.remove(at)));
            match found {
                Some(i) => {
                    now[i as usize] = Some(o as u32);
                    *by_name.get_mut(object.node.as_str()).expect("it has this name") -= 1;
                }
                None => rest.push(o),
            }
        }
        let mut changes = Changes { same: scene.objects.len() - rest.len(), ..Changes::default() };
        for object in rest.into_iter().map(|o| &scene.objects[o]) {
            let (name, size) = (object.node.as_str(), object.extent().size());
            let has_size = |&i: &u32| (old[i as usize].size() - size).abs().max_element() <= 2.0 * near;
            let alike = by_form.get_mut(&(name, object.triangles.len() as u32));
            let moved = alike.and_then(|alike| alike.iter().position(has_size).map(|at| alike.remove(at))).is_some();
            let left = by_name.get_mut(name).filter(|left| **left > 0);
            let is_known = left.map(|left| *left -= 1).is_some();
            let count = match (moved, is_known) {
                (true, true) => &mut changes.moved,
                (_, true) => &mut changes.changed,
                (_, false) => &mut changes.new,
            };
            *count += 1;
        }
        changes.gone = by_name.values().sum();
        Self { now, changes }
    }
}

/// Whether two boxes are the same to within the rounding of a file.
fn is_near(a: &Aabb, b: &Aabb, near: f64) -> bool {
    (a.min - b.min).abs().max((a.max - b.max).abs()).max_element() <= near
}
