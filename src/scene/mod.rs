//! A scene: triangles grouped into objects, and what its author said about rooms and doors.
//!
//! One file a format ([`gltf`], [`obj`], [`ifc`], [`indoorgml`]); every importer hands its meshes to [`SceneBuilder`], which checks numbers,
//! splits meshes above the object limit into clusters, picks the origin and orders triangles by object.

mod beside;
mod builder;
mod cluster;
mod error;
pub mod gltf;
mod hints;
pub mod ifc;
pub mod indoorgml;
pub mod obj;
pub mod rays;

pub use builder::{Mesh, SceneBuilder};
pub use error::{ImportError, Place};
pub use hints::{Hints, OpeningHint, OpeningKind, RoomHint, StoreyHint};

use crate::geom::Aabb;
use crate::tolerance::Tolerance;
use crate::{ObjectId, geom};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// What an object is to the split into cells.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Walls, slabs, roofs, ramps, columns: what bounds rooms.
    Structure,
    /// Furniture, equipment: seen and hidden, but makes no rooms.
    Furnishing,
    /// A door's leaf and frame: drawn, but taken as open when visibility is worked out.
    Door,
    /// A window's panes and frame.
    Window,
    /// The format doesn't say.
    Unknown,
    /// Stairs: they lead from room to room, and bound none.
    Stair,
}

/// The smallest thing that a visible set decides about: a mesh primitive, or a cluster of a larger one.
#[derive(Clone, PartialEq, Debug)]
pub struct Object {
    /// The node's name, the OBJ group or the IFC GlobalId: traces a result back to its source.
    pub node: String,
    /// What it is.
    pub role: Role,
    /// Whether it hides what is behind it. Glass, and door leaves (which may open), don't.
    pub opaque: bool,
    /// Whether it is of a material that lets light through. Doors and windows are never opaque; this tells glass from wood.
    pub glass: bool,
    /// Its triangles, as a range of [`Scene::triangles`]; never empty.
    pub triangles: Range<u32>,
    /// Box around its triangles, relative to the scene's origin, metres.
    pub bounds: Aabb,
}

/// Where a scene came from and what was done to its coordinates.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Source {
    /// `glTF`, `OBJ`, `IFC4`, ...
    pub format: String,
    /// Metres per unit of the source.
    pub metres_per_unit: f64,
    /// The source's up axis: `+Y` or `+Z`.
    pub up: String,
    /// What the importer left out or mended, one line each, for the report.
    pub notes: Vec<String>,
}

/// A whole model. Positions are relative to [`Scene::origin`]; triangles are ordered by object.
#[derive(Clone, PartialEq, Debug)]
pub struct Scene {
    /// File stem or model name.
    pub name: String,
    /// Where it came from.
    pub source: Source,
    /// Added to every position to get the model's own coordinates (metres, +Y up).
    pub origin: DVec3,
    /// Corners, metres, finite.
    pub positions: Vec<DVec3>,
    /// Indices into `positions`, in object order. No triangle is of zero area.
    pub triangles: Vec<[u32; 3]>,
    /// Objects, in the source's order.
    pub objects: Vec<Object>,
    /// What the author said.
    pub hints: Hints,
}

impl Scene {
    /// The corners of a triangle.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|i| self.positions[i as usize])
    }

    /// The object that owns a triangle.
    pub fn object_of(&self, triangle: usize) -> ObjectId {
        ObjectId(self.objects.partition_point(|o| o.triangles.end as usize <= triangle) as u32)
    }

    /// Box around everything.
    pub fn bounds(&self) -> Aabb {
        self.objects.iter().fold(Aabb::EMPTY, |b, o| b.union(o.bounds))
    }

    /// The tolerances that fit this scene's size.
    pub fn tolerance(&self) -> Tolerance {
        Tolerance::for_extent(self.bounds().diagonal())
    }

    /// A hash of what visibility depends on (positions, triangles, objects, opacity): a `.pvs` file names the model that it
    /// was baked for.
    pub fn hash(&self) -> u128 {
        let mut h = xxhash_rust::xxh3::Xxh3::new();
        for x in self.positions.iter().chain([&self.origin]).flat_map(|p| p.to_array()) {
            h.update(&x.to_bits().to_le_bytes());
        }
        for i in self.triangles.iter().flatten() {
            h.update(&i.to_le_bytes());
        }
        for o in &self.objects {
            h.update(&o.triangles.start.to_le_bytes());
            h.update(&[u8::from(o.opaque), o.role as u8]);
        }
        h.digest128()
    }
}

/// How to import.
#[derive(Clone, PartialEq, Debug)]
pub struct ImportOptions {
    /// Most triangles an object may have before its mesh is split into clusters; 1 or more.
    pub object_triangles: u32,
    /// Metres per unit of the source; `None` takes the format's own (glTF and OBJ: 1; IFC: its unit).
    pub metres_per_unit: Option<f64>,
    /// Most triangles a scene may have: a file's word is never taken for more than this.
    pub max_triangles: usize,
    /// Where files that the model names may lie, with all below it; `None`: in the model's own folder.
    pub files_under: Option<PathBuf>,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self { object_triangles: 256, metres_per_unit: None, max_triangles: 50_000_000, files_under: None }
    }
}

/// Reads a scene; the format is taken from the extension (`.glb`, `.gltf`, `.obj`, `.ifc`, `.gml`).
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "glb" | "gltf" => gltf::import(path, options),
        "obj" => obj::import(path, options),
        "ifc" => ifc::import(path, options),
        "gml" => indoorgml::import(path, options),
        _ => Err(ImportError::UnknownFormat { extension }),
    }
}

/// Area of a triangle, square metres.
pub(crate) fn triangle_area([a, b, c]: [DVec3; 3]) -> f64 {
    geom::area(&[a, b, c])
}
