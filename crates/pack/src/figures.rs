//! What cells fetch of a packed folder, against what their rows ask for.

use crate::cluster::FIXED;
use crate::manifest::{FileEntry, Manifest};
use enfilade::file::PvsFile;
use enfilade::{CellId, ObjectId};
use serde::Serialize;
use std::collections::BTreeSet;

/// Sizes of a packed folder, and what its cells need of it.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Figures {
    /// Of all files but those of a page, with the manifest.
    pub bytes: u64,
    /// Of the manifest.
    pub manifest_bytes: u64,
    /// Of the `.pvs` file.
    pub pvs_bytes: u64,
    /// Of the chunks.
    pub chunk_bytes: u64,
    /// Of the shared meshes.
    pub mesh_bytes: u64,
    /// Of the pictures.
    pub picture_bytes: u64,
    /// Number of objects.
    pub objects: usize,
    /// Number of chunks.
    pub chunks: usize,
    /// Number of files of shared meshes.
    pub mesh_files: usize,
    /// Number of shared meshes.
    pub meshes: usize,
    /// Number of pictures.
    pub pictures: usize,
    /// Over all cells that see something.
    pub cells: Cells,
}

/// Over cells, each weighing the same.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Cells {
    /// Number of cells that see an object.
    pub cells: usize,
    /// Mean share of the bytes of chunks, meshes and pictures that a cell fetches.
    pub share_mean: f64,
    /// That of the cell with the greatest.
    pub share_worst: f64,
    /// Mean of the bytes of objects, meshes and pictures that are fetched and that the row doesn't ask for, as a share of all others.
    pub extra_mean: f64,
    /// That of the cell with the greatest.
    pub extra_worst: f64,
    /// Mean number of files that a cell fetches.
    pub requests_mean: f64,
    /// That of the cell with most.
    pub requests_worst: usize,
}

/// What an object is made of.
pub(crate) struct Made {
    /// About its bytes in its chunk.
    pub(crate) weight: u64,
    /// The shared mesh that it needs.
    pub(crate) mesh: Option<u32>,
    /// Its pictures.
    pub(crate) pictures: Vec<usize>,
}

/// Files to fetch.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Needed {
    /// Indices of chunks.
    pub chunks: BTreeSet<u32>,
    /// Indices of files of meshes.
    pub meshes: BTreeSet<u32>,
    /// Indices of pictures.
    pub pictures: BTreeSet<u32>,
}

impl Needed {
    /// The files with these chunks.
    pub fn of(manifest: &Manifest, chunks: impl IntoIterator<Item = u32>) -> Self {
        let mut needed = Self { chunks: chunks.into_iter().collect(), ..Self::default() };
        for chunk in needed.chunks.iter().map(|&chunk| &manifest.chunks[chunk as usize]) {
            needed.meshes.extend(&chunk.meshes);
            needed.pictures.extend(&chunk.pictures);
        }
        let pictures = needed.meshes.iter().flat_map(|&file| &manifest.meshes[file as usize].pictures);
        needed.pictures.extend(pictures);
        needed
    }

    /// Number of files.
    pub fn files(&self) -> usize {
        self.chunks.len() + self.meshes.len() + self.pictures.len()
    }

    /// Their bytes.
    pub fn bytes(&self, manifest: &Manifest) -> u64 {
        let of = |list: &BTreeSet<u32>, bytes: &dyn Fn(usize) -> u64| list.iter().map(|&i| bytes(i as usize)).sum::<u64>();
        of(&self.chunks, &|i| manifest.chunks[i].file.bytes)
            + of(&self.meshes, &|i| manifest.meshes[i].file.bytes)
            + of(&self.pictures, &|i| manifest.pictures[i].bytes)
    }
}

impl Figures {
    /// Of a folder with a manifest of so many bytes. `mesh_weights`: about the bytes of each shared mesh in its file.
    pub(crate) fn of(manifest: &Manifest, manifest_bytes: u64, file: &PvsFile, made: &[Made], mesh_weights: &[u64]) -> Self {
        let sum = |entries: &mut dyn Iterator<Item = &FileEntry>| entries.map(|entry| entry.bytes).sum::<u64>();
        let bytes = manifest_bytes + sum(&mut manifest.files());
        Self {
            bytes,
            manifest_bytes,
            pvs_bytes: manifest.pvs.bytes,
            chunk_bytes: sum(&mut manifest.chunks.iter().map(|chunk| &chunk.file)),
            mesh_bytes: sum(&mut manifest.meshes.iter().map(|meshes| &meshes.file)),
            picture_bytes: sum(&mut manifest.pictures.iter()),
            objects: made.len(),
            chunks: manifest.chunks.len(),
            mesh_files: manifest.meshes.len(),
            meshes: mesh_weights.len(),
            pictures: manifest.pictures.len(),
            cells: Cells::of(&Row::new(manifest, made, mesh_weights), file, bytes - manifest_bytes - manifest.pvs.bytes),
        }
    }
}

impl Cells {
    fn of(row: &Row<'_>, file: &PvsFile, all: u64) -> Self {
        let mut sums = Self::default();
        for cell in 0..file.cells.len() {
            let objects: Vec<usize> = file.objects_seen(CellId(cell as u32)).map(ObjectId::index).collect();
            if objects.is_empty() {
                continue;
            }
            let needed = Needed::of(row.manifest, objects.iter().map(|&object| row.chunk_of[object]));
            let fetched = needed.bytes(row.manifest) as f64;
            let (share, extra) = (fetched / all as f64, row.extra(&needed, &objects) / fetched);
            let extra = extra / (1.0 - extra);
            sums.cells += 1;
            sums.share_mean += share;
            sums.share_worst = sums.share_worst.max(share);
            sums.extra_mean += extra;
            sums.extra_worst = sums.extra_worst.max(extra);
            sums.requests_mean += needed.files() as f64;
            sums.requests_worst = sums.requests_worst.max(needed.files());
        }
        let cells = sums.cells.max(1) as f64;
        [&mut sums.share_mean, &mut sums.extra_mean, &mut sums.requests_mean].into_iter().for_each(|mean| *mean /= cells);
        sums
    }
}

/// The bytes of objects and meshes: those of their files without [`FIXED`], shared out by weight.
struct Row<'m> {
    manifest: &'m Manifest,
    made: &'m [Made],
    chunk_of: Vec<u32>,
    /// By object.
    bytes: Vec<f64>,
    /// By shared mesh.
    mesh_bytes: Vec<f64>,
}

impl<'m> Row<'m> {
    fn new(manifest: &'m Manifest, made: &'m [Made], mesh_weights: &[u64]) -> Self {
        let (mut bytes, mut mesh_bytes) = (vec![0.0; made.len()], vec![0.0; mesh_weights.len()]);
        for chunk in &manifest.chunks {
            let objects = || chunk.objects.iter().cloned().flatten().map(|object| object as usize);
            let weight: u64 = objects().map(|object| made[object].weight).sum();
            let scale = chunk.file.bytes as f64 / (weight + FIXED) as f64;
            objects().for_each(|object| bytes[object] = made[object].weight as f64 * scale);
        }
        for file in &manifest.meshes {
            let meshes = || file.meshes.clone().map(|mesh| mesh as usize);
            let weight: u64 = meshes().map(|mesh| mesh_weights[mesh]).sum();
            let scale = file.file.bytes as f64 / (weight + FIXED) as f64;
            meshes().for_each(|mesh| mesh_bytes[mesh] = mesh_weights[mesh] as f64 * scale);
        }
        Self { manifest, made, chunk_of: manifest.chunk_of_object(), bytes, mesh_bytes }
    }

    /// The bytes of objects, meshes and pictures among these files that none of these objects needs.
    fn extra(&self, needed: &Needed, objects: &[usize]) -> f64 {
        let Needed { chunks, meshes, pictures } = needed;
        let asked: f64 = objects.iter().map(|&object| self.bytes[object]).sum();
        let own: BTreeSet<u32> = objects.iter().filter_map(|&object| self.made[object].mesh).collect();
        let asked = asked + own.iter().map(|&mesh| self.mesh_bytes[mesh as usize]).sum::<f64>();
        let fetched =
            chunks.iter().flat_map(|&chunk| self.manifest.chunks[chunk as usize].objects.iter().cloned().flatten());
        let fetched: f64 = fetched.map(|object| self.bytes[object as usize]).sum();
        let of_meshes = meshes.iter().flat_map(|&file| self.manifest.meshes[file as usize].meshes.clone());
        let fetched = fetched + of_meshes.map(|mesh| self.mesh_bytes[mesh as usize]).sum::<f64>();
        let own: BTreeSet<usize> = objects.iter().flat_map(|&object| &self.made[object].pictures).copied().collect();
        let others = pictures.iter().map(|&picture| picture as usize).filter(|picture| !own.contains(picture));
        fetched - asked + others.map(|picture| self.manifest.pictures[picture].bytes as f64).sum::<f64>()
    }
}
