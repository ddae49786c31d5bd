//! A scene: triangles grouped into objects.

use super::hints::Hints;
use super::note::Note;
use crate::ObjectId;
use crate::math::geom::Aabb;
use crate::math::tolerance::Tolerance;
#[cfg(feature = "bake")]
use enfilade_tubes::Tubes;
use glam::DVec3;
use std::ops::Range;
use std::sync::Arc;

/// The role of an object in the split into cells.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum Role {
    /// Walls, slabs, roofs, ramps, columns: they bound rooms.
    Structure,
    /// Furniture, equipment: culled, but bounds no rooms.
    Furnishing,
    /// A door's leaf and frame: drawn, but open in the visibility computation.
    Door,
    /// A window's panes and frame.
    Window,
    /// Not stated by the format.
    Unknown,
    /// Stairs: they connect rooms, and bound none.
    Stair,
    /// Objects that engines do not draw: colliders, triggers, coarser levels of detail. They hide nothing and bound no room.
    Helper,
    /// The sky, or another backdrop around everything: it hides nothing, bounds no room, and its size does not matter.
    Sky,
}

/// The smallest unit of a visible set: a mesh primitive, or a cluster of a larger one.
#[derive(Clone, PartialEq, Debug)]
pub struct Object {
    /// The node's name, the OBJ group or the IFC GlobalId: traces a result back to its source.
    pub node: String,
    /// Its role.
    pub role: Role,
    /// Whether it is an occluder. Glass, and door leaves (which may open), are not.
    pub opaque: bool,
    /// Whether its material is transparent. Doors and windows are never opaque; this distinguishes glass from wood.
    pub glass: bool,
    /// Its triangles, as a range of [`Scene::triangles`]; never empty.
    pub triangles: Range<u32>,
    /// Segments of its tubes, as a range of the sections of [`Scene::tubes`]; empty for a mesh. For tubes, its triangles are bounding
    /// prisms.
    pub segments: Range<u32>,
    /// Box around its triangles, relative to the scene's origin, metres.
    pub bounds: Aabb,
    /// Box around all poses of a moving object, or around all levels of detail of its group, likewise; it contains [`Self::bounds`].
    /// `None`: the object is static. An object with a reach is visible if any part of this box is.
    pub reach: Option<Aabb>,
}

impl Object {
    /// Whether it is a part of tubes: [`Self::triangles`] are bounding prisms, and hide more than it does.
    pub fn is_tube(&self) -> bool {
        !self.segments.is_empty()
    }

    /// Its reach, or the box around its triangles.
    pub fn extent(&self) -> Aabb {
        self.reach.unwrap_or(self.bounds)
    }
}

/// The source of a scene, and the conversion of its coordinates.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Source {
    /// `glTF`, `OBJ`, `IFC4`, ...
    pub format: String,
    /// Metres per unit of the source.
    pub metres_per_unit: f64,
    /// The source's up axis: `+Y` or `+Z`.
    pub up: String,
    /// Omissions, repairs and assumptions of the importer.
    pub notes: Vec<Note>,
}

/// A whole model. Positions are relative to [`Scene::origin`]; triangles are ordered by object.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Scene {
    /// File stem or model name.
    pub name: String,
    /// Its source.
    pub source: Source,
    /// Added to every position to get the model's own coordinates (metres, +Y up).
    pub origin: DVec3,
    /// Corners, metres, finite.
    pub positions: Vec<DVec3>,
    /// Indices into `positions`, in object order. No triangle has zero area.
    pub triangles: Vec<[u32; 3]>,
    /// Objects, in the source's order.
    pub objects: Vec<Object>,
    /// Tubes whose parts are objects, in the order of these.
    #[cfg(feature = "bake")]
    pub tubes: Tubes,
    /// Groups of objects that are drawn or hidden together: levels of detail of one thing. Each list is ascending and has at least two
    /// objects.
    pub together: Vec<Vec<ObjectId>>,
    /// The author's hints.
    pub hints: Hints,
    /// Origin of the triangles; `None` unless [`ImportOptions::trace`](super::import::ImportOptions::trace) is set.
    pub trace: Option<Trace>,
}

/// Origin of a scene's triangles in its source, and their materials. Meshes count from 0, in the importer's order.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Trace {
    /// By object: its mesh.
    pub meshes: Vec<u32>,
    /// By triangle of the scene: its number in its mesh, counting those without area.
    pub triangles: Vec<u32>,
    /// By mesh: its look.
    pub looks: Vec<Look>,
    /// Materials of the source, as far as the importer supports them.
    pub materials: Vec<Material>,
}

/// The look of a mesh.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Look {
    /// Index into [`Trace::materials`].
    pub material: Option<u32>,
    /// By triangle of the mesh: texture coordinates of its corners, from the top left of the picture, as in glTF; empty if there are none.
    pub texture_coordinates: Vec<[[f32; 2]; 3]>,
}

/// A material of a source, in the metallic-roughness model of glTF 2.0. Other models give their diffuse colour.
#[derive(Clone, PartialEq, Debug)]
pub struct Material {
    /// The name in the source; made unique if materials with one name differ.
    pub name: String,
    /// Red, green, blue and opacity, linear, 0 to 1.
    pub colour: [f32; 4],
    /// 0 (not a metal) to 1.
    pub metallic: f32,
    /// 0 (smooth) to 1 (matt).
    pub roughness: f32,
    /// Emission in red, green and blue, linear, 0 or more.
    pub emissive: [f32; 3],
    /// Whether it is unlit.
    pub unlit: bool,
    /// Alpha cutoff, 0 to 1: pixels with a lower opacity are not drawn.
    pub cutoff: Option<f32>,
    /// Its colour texture (sRGB), a factor on [`Self::colour`].
    pub texture: Option<Picture>,
    /// Its normal map: x, y and z as red, green and blue, from -1 to 1, in the texture coordinates of [`Self::texture`].
    pub normals: Option<Picture>,
    /// Factor on x and y of the normal map.
    pub normal_scale: f32,
    /// Factors on [`Self::roughness`] (green) and [`Self::metallic`] (blue).
    pub roughness_and_metallic: Option<Picture>,
    /// Factor on [`Self::emissive`] (sRGB).
    pub emissive_texture: Option<Picture>,
}

/// A picture of a material.
#[derive(Clone, PartialEq, Debug)]
pub enum Picture {
    /// A file beside the model, or a `data:` uri, as the source spells it.
    Named(String),
    /// An embedded PNG, JPEG or other file; empty if a texture has no image.
    Within(Arc<[u8]>),
}

impl Material {
    /// A matt material of one colour, without textures.
    pub fn matt(name: impl Into<String>, colour: [f32; 4]) -> Self {
        Self {
            name: name.into(),
            colour,
            metallic: 0.0,
            roughness: 1.0,
            emissive: [0.0; 3],
            unlit: false,
            cutoff: None,
            texture: None,
            normals: None,
            normal_scale: 1.0,
            roughness_and_metallic: None,
            emissive_texture: None,
        }
    }

    /// Its textures: colour, normals, roughness and metalness, emission.
    pub fn pictures(&self) -> [Option<&Picture>; 4] {
        [&self.texture, &self.normals, &self.roughness_and_metallic, &self.emissive_texture].map(Option::as_ref)
    }
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

    /// A hash of the inputs of visibility (positions, triangles, objects, opacity), by which a `.pvs` file identifies its model.
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
            for x in o.reach.iter().flat_map(|b| [b.min, b.max]).flat_map(|p| p.to_array()) {
                h.update(&x.to_bits().to_le_bytes());
            }
        }
        for group in &self.together {
            group.iter().for_each(|o| h.update(&o.0.to_le_bytes()));
        }
        #[cfg(feature = "bake")]
        self.tubes.hash_into(&mut h);
        h.digest128()
    }
}
