//! The part of the JSON document that geometry needs.
//!
//! Based on: Khronos Group, *glTF 2.0 Specification*, 2021 (section 3). Own types instead of those of the `gltf` crate, which
//! keeps node transforms in `f32` (walls of georeferenced buildings move by decimetres) and refuses KHR_mesh_quantization.

mod material;

use super::container::{JSON_START, chunks};
use enfilade::scene::{ImportError, Place, whole_file};
pub(super) use material::Material;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::RawValue;

/// Supported names in `extensionsRequired`: read, or without effect on the position and opacity of triangles.
const KNOWN: [&str; 12] = [
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "KHR_node_visibility",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_xmp_json_ld",
    "MSFT_texture_dds",
];
/// The same, for whole families.
const KNOWN_PREFIXES: [&str; 3] = ["KHR_materials_", "KHR_texture_", "EXT_texture_"];

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    pub asset: Asset,
    #[serde(default)]
    pub extensions_required: Vec<String>,
    pub scene: Option<usize>,
    #[serde(default)]
    pub scenes: Vec<SceneRoots>,
    #[serde(default)]
    nodes: Vec<Slot>,
    #[serde(default)]
    pub meshes: Vec<MeshEntry>,
    #[serde(default)]
    pub accessors: Vec<AccessorEntry>,
    #[serde(default)]
    pub buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    pub materials: Vec<Material>,
    /// Invalid ones are skipped: motion never makes an import fail.
    #[serde(default)]
    animations: Vec<Box<RawValue>>,
    #[serde(default)]
    pub skins: Vec<Skin>,
    /// Read on demand: appearance never makes an import fail.
    images: Option<Box<RawValue>>,
    textures: Option<Box<RawValue>>,
}

#[derive(Deserialize)]
struct Image {
    uri: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Asset {
    pub version: String,
    pub min_version: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct SceneRoots {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

impl Document {
    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Node `index`, which must be below [`Document::node_count`].
    pub fn node(&self, index: usize) -> &Node {
        static EMPTY: Node = Node::EMPTY;
        self.nodes[index].0.as_deref().unwrap_or(&EMPTY)
    }

    /// Its images as JSON; null if the list is invalid.
    pub fn images(&self) -> serde_json::Value {
        written(&self.images)
    }

    /// Its animations; `None` for an invalid one.
    pub fn animations(&self) -> impl Iterator<Item = Option<Animation>> {
        self.animations.iter().map(|raw| serde_json::from_str(raw.get()).ok())
    }

    /// Its textures as JSON; null if the list is invalid.
    pub fn textures(&self) -> serde_json::Value {
        written(&self.textures)
    }

    /// The uris of its images; none if the list is invalid.
    pub fn image_uris(&self) -> impl Iterator<Item = String> {
        let images: Option<Vec<Image>> = self.images.as_ref().and_then(|raw| serde_json::from_str(raw.get()).ok());
        images.into_iter().flatten().filter_map(|image| image.uri)
    }
}

fn written(raw: &Option<Box<RawValue>>) -> serde_json::Value {
    raw.as_ref().and_then(|raw| serde_json::from_str(raw.get()).ok()).unwrap_or_default()
}

/// A node; `None` if it is empty, since `{}` takes only three bytes in a file.
#[derive(Deserialize)]
#[serde(from = "Node")]
struct Slot(Option<Box<Node>>);

impl From<Node> for Slot {
    fn from(node: Node) -> Self {
        Self((!node.is_empty()).then(|| Box::new(node)))
    }
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub name: Option<Box<str>>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    #[serde(default)]
    pub children: Vec<usize>,
    // Boxed: few nodes have all of these.
    pub matrix: Option<Box<[f64; 16]>>,
    pub translation: Option<Box<[f64; 3]>>,
    pub rotation: Option<Box<[f64; 4]>>,
    pub scale: Option<Box<[f64; 3]>>,
    pub weights: Option<Box<[f64]>>,
    pub extras: Option<Box<RawValue>>,
    extensions: Option<Box<RawValue>>,
}

impl Node {
    const EMPTY: Self = Self {
        name: None,
        mesh: None,
        skin: None,
        children: Vec::new(),
        matrix: None,
        translation: None,
        rotation: None,
        scale: None,
        weights: None,
        extras: None,
        extensions: None,
    };

    fn is_empty(&self) -> bool {
        let Self { name, mesh, skin: _, children, matrix, translation, rotation, scale, weights: _, extras, extensions } =
            self;
        let placed = matrix.is_some() || translation.is_some() || rotation.is_some() || scale.is_some();
        !placed && name.is_none() && mesh.is_none() && children.is_empty() && extras.is_none() && extensions.is_none()
    }

    /// Its supported extensions.
    pub fn extensions(&self) -> Result<NodeExtensions, serde_json::Error> {
        self.extensions.as_ref().map_or(Ok(NodeExtensions::default()), |raw| serde_json::from_str(raw.get()))
    }

    /// Its extras and extensions as JSON; null if they are nested too deeply.
    pub fn written(&self) -> [serde_json::Value; 2] {
        [written(&self.extras), written(&self.extensions)]
    }
}

#[derive(Deserialize, Default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<Instancing>,
    #[serde(rename = "MSFT_lod")]
    pub levels: Option<Levels>,
}

/// Coarser levels of detail of a node.
#[derive(Deserialize)]
pub(super) struct Levels {
    pub ids: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Instancing {
    pub attributes: InstanceAttributes,
}

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) struct InstanceAttributes {
    pub translation: Option<usize>,
    pub rotation: Option<usize>,
    pub scale: Option<usize>,
}

/// Joints that bend a mesh.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub joints: Vec<usize>,
    pub inverse_bind_matrices: Option<usize>,
}

#[derive(Deserialize)]
pub(super) struct Animation {
    #[serde(default)]
    pub channels: Vec<Channel>,
    #[serde(default)]
    pub samplers: Vec<Sampler>,
}

#[derive(Deserialize)]
pub(super) struct Channel {
    pub sampler: usize,
    pub target: Target,
}

/// The target of a channel: a path of a node, or a pointer.
#[derive(Deserialize)]
pub(super) struct Target {
    pub node: Option<usize>,
    pub path: String,
    #[serde(default)]
    pub extensions: TargetExtensions,
}

#[derive(Deserialize, Default)]
pub(super) struct TargetExtensions {
    #[serde(rename = "KHR_animation_pointer")]
    pub pointer: Option<Pointer>,
}

#[derive(Deserialize)]
pub(super) struct Pointer {
    pub pointer: String,
}

#[derive(Deserialize)]
pub(super) struct Sampler {
    pub input: usize,
    pub output: usize,
    pub interpolation: Option<String>,
}

#[derive(Deserialize)]
pub(super) struct MeshEntry {
    pub name: Option<String>,
    pub primitives: Vec<Primitive>,
    /// Of its morph targets.
    #[serde(default)]
    pub weights: Vec<f64>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    pub mode: Option<u64>,
    #[serde(default)]
    pub targets: Vec<MorphTarget>,
    #[serde(default)]
    pub extensions: PrimitiveExtensions,
}

#[derive(Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub position: Option<usize>,
    /// Joints and weights of a vertex: four, and four more.
    #[serde(rename = "JOINTS_0")]
    pub joints: Option<usize>,
    #[serde(rename = "WEIGHTS_0")]
    pub weights: Option<usize>,
    #[serde(rename = "JOINTS_1")]
    pub more_joints: Option<usize>,
    #[serde(rename = "WEIGHTS_1")]
    pub more_weights: Option<usize>,
    /// Colours of corners, possibly with alpha.
    #[serde(rename = "COLOR_0")]
    pub colour: Option<IgnoredAny>,
}

/// Offsets of a morph target.
#[derive(Deserialize)]
pub(super) struct MorphTarget {
    #[serde(rename = "POSITION")]
    pub position: Option<usize>,
}

#[derive(Deserialize, Default)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub draco: Option<Draco>,
}

/// A primitive whose corners and vertices are in one view; attributes are ids in it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Draco {
    pub buffer_view: usize,
    pub attributes: Attributes,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct AccessorEntry {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u64,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<SparseEntry>,
}

#[derive(Deserialize)]
pub(super) struct SparseEntry {
    pub count: usize,
    pub indices: SparsePart,
    pub values: SparsePart,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparsePart {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
    /// Of the indices; values have the accessor's own.
    pub component_type: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
    #[serde(default)]
    extensions: ViewExtensions,
}

impl BufferView {
    /// Its compressed source, if any.
    pub fn compressed(&self) -> Option<&Compressed> {
        self.extensions.khr.as_ref().or(self.extensions.ext.as_ref())
    }
}

#[derive(Deserialize, Default)]
struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    ext: Option<Compressed>,
    #[serde(rename = "KHR_meshopt_compression")]
    khr: Option<Compressed>,
}

/// A view whose bytes are compressed: `count` elements of `byte_stride` bytes.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Compressed {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: usize,
    pub count: usize,
    pub mode: Mode,
    #[serde(default)]
    pub filter: Filter,
}

/// Codec of a view.
#[derive(Deserialize, Clone, Copy, Debug)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// Filter after decompression.
#[derive(Deserialize, Clone, Copy, PartialEq, Eq, Default)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: usize,
}

/// Whether it is a `.glb`, told by its magic.
fn is_glb(bytes: &[u8]) -> bool {
    bytes.starts_with(b"glTF")
}

/// The document's text, and the BIN chunk where there is one.
pub(super) fn text(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ImportError> {
    if is_glb(bytes) { chunks(bytes) } else { Ok((bytes.strip_prefix(whole_file::BYTE_ORDER_MARK).unwrap_or(bytes), None)) }
}

/// Reads a `.glb` or `.gltf`: the document, and the BIN chunk where there is one.
pub(super) fn read(bytes: &[u8]) -> Result<(Document, Option<&[u8]>), ImportError> {
    if !is_glb(bytes) && !whole_file::text_of(bytes).starts_with(b"{") {
        let what = format!("not glTF, neither text nor binary: {}", whole_file::nature(bytes));
        return Err(ImportError::malformed(Place::File, what));
    }
    let (json, bin) = text(bytes)?;
    let document: Document = serde_json::from_slice(json).map_err(|e| {
        let place = if is_glb(bytes) { Place::Byte(JSON_START) } else { Place::Line(e.line()) };
        ImportError::malformed(place, format!("not a glTF document: {e}"))
    })?;
    let version = document.asset.min_version.as_ref().unwrap_or(&document.asset.version);
    if !version.starts_with("2.") {
        return Err(ImportError::Unsupported { what: format!("glTF {version}"), hint: "export it as glTF 2.0" });
    }
    let is_known = |name: &&String| KNOWN.contains(&name.as_str()) || KNOWN_PREFIXES.iter().any(|p| name.starts_with(p));
    if let Some(name) = document.extensions_required.iter().find(|name| !is_known(name)) {
        let what = format!("the glTF extension {name}, which the file requires,");
        return Err(ImportError::Unsupported { what, hint: "export without it" });
    }
    Ok((document, bin))
}
