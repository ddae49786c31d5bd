//! A scene: triangles grouped into objects.

use super::hints::Hints;
use super::note::Note;
use crate::ObjectId;
use crate::geom::Aabb;
use crate::tolerance::Tolerance;
#[cfg(feature = "bake")]
use enfilade_tubes::Tubes;
use glam::DVec3;
use std::ops::Range;
use std::sync::Arc;

/// What an object is to the split into cells.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
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
    /// What engines don't draw: colliders, triggers, coarser levels of detail. It hides nothing and bounds no room.
    Helper,
    /// The sky, or another backdrop around everything: it hides nothing, bounds no room and has no size in metres.
    Sky,
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
    /// Segments of its tubes, as a range of the sections of [`Scene::tubes`]; empty for a mesh. Then its triangles are prisms around them.
    pub segments: Range<u32>,
    /// Box around its triangles, relative to the scene's origin, metres.
    pub bounds: Aabb,
    /// Box around all poses of what moves, or around all levels of detail of its group, likewise; it holds [`Self::bounds`]. `None`: the
    /// object is where its triangles are. With a reach, it is seen where any of the box is.
    pub reach: Option<Aabb>,
}

impl Object {
    /// Whether it is a part of tubes: [`Self::triangles`] are prisms around it, and hide more than it does.
    pub fn is_tube(&self) -> bool {
        !self.segments.is_empty()
    }

    /// Where it may be: its reach, or the box around its triangles.
    pub fn extent(&self) -> Aabb {
        self.reach.unwrap_or(self.bounds)
    }
}

/// Where a scene came from and what was done to its coordinates.
#[derive(Clone, PartialEq, Debug, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Source {
    /// `glTF`, `OBJ`, `IFC4`, ...
    pub format: String,
    /// Metres per unit of the source.
    pub metres_per_unit: f64,
    /// The source's up axis: `+Y` or `+Z`.
    pub up: String,
    /// What the importer left out, mended or took for something.
    pub notes: Vec<Note>,
}

/// A whole model. Positions are relative to [`Scene::origin`]; triangles are ordered by object.
#[derive(Clone, PartialEq, Debug, Default)]
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
    /// Tubes, of which objects are parts, in the order of these.
    #[cfg(feature = "bake")]
    pub tubes: Tubes,
    /// Objects that are drawn or hidden together: levels of detail of one thing. Each list is ascending and has two objects or more.
    pub together: Vec<Vec<ObjectId>>,
    /// What the author said.
    pub hints: Hints,
    /// Where the triangles come from; `None` unless [`ImportOptions::trace`](super::import::ImportOptions::trace) asks for it.
    pub trace: Option<Trace>,
}

/// Where the triangles of a scene come from in its source, and what they are drawn with. Meshes count from 0, in the order in which the
/// importer found them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Trace {
    /// By object: its mesh.
    pub meshes: Vec<u32>,
    /// By triangle of the scene: its number in its mesh, those without area counted.
    pub triangles: Vec<u32>,
    /// By mesh: how it looks.
    pub looks: Vec<Look>,
    /// Materials of the source, as far as the importer tells them.
    pub materials: Vec<Material>,
}

/// How a mesh looks.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Look {
    /// Index into [`Trace::materials`].
    pub material: Option<u32>,
    /// By triangle of the mesh: texture coordinates of its corners, from the top left of the picture, as in glTF; empty where there are none.
    pub texture_coordinates: Vec<[[f32; 2]; 3]>,
}

/// A material of a source: metallic and rough, as glTF 2.0 has them. Others give their matt colour.
#[derive(Clone, PartialEq, Debug)]
pub struct Material {
    /// As the source has it; made different where materials of one name differ.
    pub name: String,
    /// Red, green, blue and opacity, linear, 0 to 1.
    pub colour: [f32; 4],
    /// 0 (not a metal) to 1.
    pub metallic: f32,
    /// 0 (smooth) to 1 (matt).
    pub roughness: f32,
    /// Red, green and blue that it shines with, linear, 0 or more.
    pub emissive: [f32; 3],
    /// Whether no light changes it.
    pub unlit: bool,
    /// Where the opacity of the picture is below this, 0 to 1, nothing is drawn.
    pub cutoff: Option<f32>,
    /// Its picture (sRGB), which [`Self::colour`] is multiplied by.
    pub texture: Option<Picture>,
    /// How its normals lean: x, y and z as red, green and blue, from -1 to 1, in the texture coordinates of [`Self::texture`].
    pub normals: Option<Picture>,
    /// By how much x and y of these are multiplied.
    pub normal_scale: f32,
    /// What [`Self::roughness`] (green) and [`Self::metallic`] (blue) are multiplied by.
    pub roughness_and_metallic: Option<Picture>,
    /// What [`Self::emissive`] is multiplied by (sRGB).
    pub emissive_texture: Option<Picture>,
}

/// A picture of a material.
#[derive(Clone, PartialEq, Debug)]
pub enum Picture {
    /// A file beside the model, or a `data:` uri, as the source spells it.
    Named(String),
    /// A PNG, JPEG or other file that is in the model's own; empty where a texture leads to none.
    Within(Arc<[u8]>),
}

impl Material {
    /// Of one colour, matt, without a picture.
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

    /// Its pictures: colours, normals, roughness and metal, emission.
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
