//! A baked building as a folder of files that a client loads as it walks: the `.pvs` file, chunks of objects, and a manifest that says which
//! chunk has which objects. docs/format.md describes the folder.
//!
//! A chunk is a set of objects that the same cells see, or nearly the same, so that few requests bring little too much. What a cell needs
//! follows from its row and the manifest.

mod chunk;
mod cluster;
mod columns;
mod document;
mod figures;
pub mod folder;
mod geometry;
mod gzip;
mod lean;
mod looks;
mod manifest;
mod model;

pub use figures::{Cells, Figures, Needed};
pub use folder::Packed;
pub use gzip::gunzip;
pub use manifest::{Chunk, FileEntry, MANIFEST, Manifest, ManifestError, MeshFile, VERSION};

use chunk::{Thing, Written, placement};
use cluster::{MESHES, OBJECTS, chunks};
use columns::{Item, columns, homes, needs, neighbours};
use enfilade::file::PvsFile;
use enfilade::math::tolerance::packed_step;
use enfilade::scene::ImportOptions;
use enfilade_formats::export::{ExportError, export};
use figures::Made;
use geometry::Shape;
use glam::{DAffine3, DVec3};
use lean::lean;
use looks::Pictures;
use model::{Mesh, Model};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Why a building cannot be packed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PackError {
    /// The model cannot be cut into the objects of the file.
    #[error(transparent)]
    Model(#[from] ExportError),
    /// The cut model is not as expected.
    #[error("the model can't be packed: {0}")]
    Export(String),
    /// Vertices or triangles could not be compressed.
    #[error("the model can't be compressed: {0}")]
    Codec(#[from] meshoptimizer_rs::Error),
    /// One object is too large.
    #[error("a chunk of more than 4 GiB; bake the model with smaller objects")]
    TooLarge,
}

/// A packed building.
pub struct Building {
    /// What the folder has.
    pub manifest: Manifest,
    /// All its files, the manifest last.
    pub files: Vec<Packed>,
    /// Sizes.
    pub figures: Figures,
    /// What is missing, one line each.
    pub notes: Vec<String>,
}

impl Building {
    /// Adds a page that walks in the folder.
    pub fn add_page(&mut self, page: Vec<Packed>) {
        self.manifest.page = page.iter().map(|file| FileEntry::of(&file.name, &file.bytes)).collect();
        self.files.pop();
        self.files.extend(page);
        self.files.push(self.manifest.packed());
    }
}

/// Name of the `.pvs` file.
const PVS: &str = "building.pvs";
/// Bytes of the JSON of an object with its own triangles: a node, a mesh and an accessor.
const OWN_JSON: u64 = 40;
/// Bytes of the JSON of an object that shares a mesh: a node with its transform.
const SHARED_JSON: u64 = 30;

/// Packs the model of a file. The result does not depend on the number of threads.
///
/// # Errors
///
/// If the model cannot be read or is not the file's.
pub fn pack(file: &PvsFile, model: &Path, options: &ImportOptions) -> Result<Building, PackError> {
    let exported = export(model, options, file)?;
    let model = Model::read(&exported.glb, file.objects.len())?;
    let pictures = Pictures::of(&model);
    let plan = Plan::of(&model, file, &pictures)?;
    let step = packed_step(file.clearance());
    let meshes: Vec<Written> =
        plan.mesh_files.par_iter().map(|file| plan.meshes(&model, &pictures, file, step)).collect::<Result<_, _>>()?;
    let written = plan.chunks.par_iter().map(|chunk| plan.objects(&model, &pictures, chunk, file.origin, step));
    let written: Vec<Written> = written.collect::<Result<_, _>>()?;

    let pvs = lean(file).write();
    let manifest = Manifest {
        pvs: FileEntry::of(PVS, &pvs),
        model: file.model_hash,
        origin: file.origin,
        objects: file.objects.len() as u32,
        chunks: plan
            .chunks
            .iter()
            .zip(&written)
            .enumerate()
            .map(|(i, (chunk, file))| plan.chunk_entry(i, chunk, file))
            .collect(),
        meshes: plan.mesh_files.iter().zip(&meshes).enumerate().map(|(i, (of, file))| mesh_entry(i, of, file)).collect(),
        pictures: pictures.files.iter().map(|(name, bytes)| FileEntry::of(name, bytes)).collect(),
        page: Vec::new(),
    };
    let mut files = vec![Packed { name: PVS.to_owned(), bytes: pvs }];
    let names = manifest.chunks.iter().map(|chunk| &chunk.file).chain(manifest.meshes.iter().map(|meshes| &meshes.file));
    let contents = written.into_iter().chain(meshes).map(|written| written.bytes);
    files.extend(names.zip(contents).map(|(entry, bytes)| Packed { name: entry.file.clone(), bytes }));
    files.extend(pictures.files.into_iter().map(|(name, bytes)| Packed { name, bytes }));
    let last = manifest.packed();
    let figures = Figures::of(&manifest, last.bytes.len() as u64, file, &plan.made, &plan.mesh_weights);
    files.push(last);
    let notes = exported.notes.into_iter().chain(model.notes).collect();
    Ok(Building { manifest, files, figures, notes })
}

/// Which file has what.
struct Plan {
    /// By object.
    made: Vec<Made>,
    /// By shared mesh: its number in the model.
    shared: Vec<usize>,
    /// By shared mesh.
    mesh_weights: Vec<u64>,
    /// Shared meshes by file.
    mesh_files: Vec<Vec<u32>>,
    /// By shared mesh: the greatest factor by which an object enlarges it.
    scales: Vec<f64>,
    /// Objects by chunk.
    chunks: Vec<Vec<u32>>,
}

impl Plan {
    fn of(model: &Model, file: &PvsFile, pictures: &Pictures) -> Result<Self, PackError> {
        let mut users: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (object, placed) in model.objects.iter().enumerate() {
            users.entry(placed.mesh).or_default().push(object);
        }
        let (columns, homes, neighbours) = (columns(file), homes(file), neighbours(file));
        let weigh = |mesh: usize| model.mesh(mesh).map(|mesh| weight(&mesh));
        let weights: BTreeMap<usize, u64> = users
            .keys()
            .copied()
            .collect::<Vec<_>>()
            .into_par_iter()
            .map(|mesh| Ok((mesh, weigh(mesh)?)))
            .collect::<Result<_, PackError>>()?;

        let item = |(object, column): (usize, &Vec<u64>)| {
            let placed = &model.objects[object];
            let is_shared = users[&placed.mesh].len() > 1;
            let weight = if is_shared { SHARED_JSON } else { weights[&placed.mesh] };
            Item { column: column.clone(), weight, home: homes[object] }
        };
        let objects: Vec<Item> = columns.iter().enumerate().map(item).collect();
        let shared: Vec<usize> = users.iter().filter(|(_, users)| users.len() > 1).map(|(&mesh, _)| mesh).collect();
        let item = |&mesh: &usize| {
            let mut column = vec![0; file.cells.len().div_ceil(64)];
            users[&mesh].iter().for_each(|&user| column.iter_mut().zip(&columns[user]).for_each(|(a, b)| *a |= b));
            Item { column, weight: weights[&mesh], home: homes[users[&mesh][0]] }
        };
        let meshes: Vec<Item> = shared.iter().map(item).collect();
        let asked: Vec<u64> = needs(objects.iter().chain(&meshes), file.cells.len());

        // Shared meshes are numbered file by file.
        let groups = chunks(&meshes, &neighbours, &asked, MESHES);
        let shared: Vec<usize> = groups.iter().flatten().map(|&item| shared[item as usize]).collect();
        let mut next = 0u32..;
        let mesh_files = groups.iter().map(|group| next.by_ref().take(group.len()).collect()).collect();
        let numbers: BTreeMap<usize, u32> = shared.iter().copied().zip(0..).collect();

        let made = |(placed, item): (&model::Placed, &Item)| Made {
            weight: item.weight,
            mesh: numbers.get(&placed.mesh).copied(),
            pictures: pictures.of_material(model, model.material(placed.mesh)).into_iter().collect(),
        };
        let scale = |mesh: &usize| users[mesh].iter().map(|&user| scale(&model.objects[user].transform)).fold(0.0, f64::max);
        Ok(Self {
            made: model.objects.iter().zip(&objects).map(made).collect(),
            chunks: chunks(&objects, &neighbours, &asked, OBJECTS),
            mesh_weights: shared.iter().map(|mesh| weights[mesh]).collect(),
            scales: shared.iter().map(scale).collect(),
            shared,
            mesh_files,
        })
    }

    /// Writes a file of shared meshes. Half of the error of positions is left to the transforms of objects.
    fn meshes(&self, model: &Model, pictures: &Pictures, numbers: &[u32], step: f64) -> Result<Written, PackError> {
        let shape = |&number: &u32| {
            let scale = Some(self.scales[number as usize]).filter(|scale| *scale > 0.0).unwrap_or(1.0);
            let step = (step / 2.0 / scale).log2().floor().exp2();
            let mesh = model.mesh(self.shared[number as usize])?;
            Ok((number, Shape::of(&mesh, &DAffine3::IDENTITY, step)?, step))
        };
        let shapes = numbers.iter().map(shape).collect::<Result<Vec<_>, PackError>>()?;
        chunk::shared(model, pictures, &shapes)
    }

    /// Writes a chunk.
    fn objects(
        &self,
        model: &Model,
        pictures: &Pictures,
        ids: &[u32],
        origin: DVec3,
        step: f64,
    ) -> Result<Written, PackError> {
        let thing = |&id: &u32| {
            let placed = model.objects[id as usize];
            let transform = DAffine3::from_translation(-origin) * placed.transform;
            let mesh = model.mesh(placed.mesh)?;
            Ok(match self.made[id as usize].mesh {
                None => Thing::Own(id, Shape::of(&mesh, &transform, step)?),
                Some(number) => Thing::Shared(id, number, placement(&transform, corners(&mesh), step / 2.0)),
            })
        };
        let things = ids.iter().map(thing).collect::<Result<Vec<_>, PackError>>()?;
        chunk::objects(model, pictures, &things, step)
    }

    fn chunk_entry(&self, number: usize, ids: &[u32], written: &Written) -> Chunk {
        let needed = ids.iter().filter_map(|&id| self.made[id as usize].mesh);
        let file_of =
            |mesh: u32| self.mesh_files.partition_point(|file| file.last().is_some_and(|last| *last < mesh)) as u32;
        let mut meshes: Vec<u32> = needed.map(file_of).collect();
        meshes.sort_unstable();
        meshes.dedup();
        let runs = ids.chunk_by(|a, b| a + 1 == *b).map(|run| run[0]..run[0] + run.len() as u32);
        Chunk {
            file: FileEntry::of(format!("chunks/{number}.glbz"), &written.bytes),
            objects: runs.collect(),
            meshes,
            pictures: written.pictures.iter().map(|&picture| picture as u32).collect(),
        }
    }
}

fn mesh_entry(number: usize, meshes: &[u32], written: &Written) -> MeshFile {
    let first = meshes.first().copied().unwrap_or_default();
    MeshFile {
        file: FileEntry::of(format!("meshes/{number}.glbz"), &written.bytes),
        meshes: first..first + meshes.len() as u32,
        pictures: written.pictures.iter().map(|&picture| picture as u32).collect(),
    }
}

/// About the bytes of a mesh in a file: its JSON; two fifths of a vertex's bytes, and a byte and a half a triangle.
fn weight(mesh: &Mesh) -> u64 {
    let of_others: usize =
        mesh.attributes.iter().map(|attribute| if attribute.width > 2 { 4 } else { 2 * attribute.width }).sum();
    OWN_JSON + (mesh.positions.len() * (8 + of_others) * 2 / 5 + mesh.indices.len() / 2) as u64
}

/// The least and the greatest coordinates.
fn corners(mesh: &Mesh) -> [DVec3; 2] {
    let all = || mesh.positions.iter().copied();
    [all().reduce(DVec3::min).unwrap_or_default(), all().reduce(DVec3::max).unwrap_or_default()]
}

/// A factor by which a transform enlarges no length beyond.
fn scale(transform: &DAffine3) -> f64 {
    let columns = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
    let [x, y, z] = columns.map(DVec3::length);
    let shear = [(0, 1), (1, 2), (2, 0)]
        .map(|(a, b)| columns[a].dot(columns[b]).abs() / (columns[a].length() * columns[b].length()));
    // Without shear, the longest; with it, the norm of all.
    let is_square = shear.iter().all(|shear| *shear < 1e-6);
    if is_square { x.max(y).max(z) } else { (x * x + y * y + z * z).sqrt() }
}
