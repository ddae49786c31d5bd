//! What is to be known of a game's level file; [`super::games`] has a table for each.

use super::record::Field;
use std::fmt;

/// What a lump holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Lump {
    Entities,
    Planes,
    Textures,
    Vertices,
    Visibility,
    Nodes,
    TextureInfos,
    Faces,
    Leaves,
    /// Faces by leaf.
    MarkSurfaces,
    Edges,
    SurfaceEdges,
    Models,
    /// Brushes by leaf.
    LeafBrushes,
    Brushes,
    /// Of triangles, indices of vertices from a face's first one.
    MeshVertices,
    /// Reflectivity of textures, and numbers of their names.
    TextureData,
    /// Where each name begins.
    NameOffsets,
    Names,
    Displacements,
    DisplacementVertices,
    /// Faces with other light, where a level has no others.
    HdrFaces,
    /// What a game adds: static props among others.
    GameLumps,
}

impl fmt::Display for Lump {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Entities => "entities",
            Self::Planes => "planes",
            Self::Textures => "textures",
            Self::Vertices => "vertices",
            Self::Visibility => "visibility",
            Self::Nodes => "nodes",
            Self::TextureInfos => "texture infos",
            Self::Faces => "faces",
            Self::Leaves => "leaves",
            Self::MarkSurfaces => "mark surfaces",
            Self::Edges => "edges",
            Self::SurfaceEdges => "surface edges",
            Self::Models => "models",
            Self::LeafBrushes => "leaf brushes",
            Self::Brushes => "brushes",
            Self::MeshVertices => "mesh vertices",
            Self::TextureData => "texture data",
            Self::NameOffsets => "name offsets",
            Self::Names => "names",
            Self::Displacements => "displacements",
            Self::DisplacementVertices => "displacement vertices",
            Self::HdrFaces => "HDR faces",
            Self::GameLumps => "game lumps",
        })
    }
}

/// The directory of lumps.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Directory {
    /// First byte.
    pub at: usize,
    /// Number of lumps.
    pub lumps: usize,
    /// Bytes of an entry: 8 (offset, length), or 16 (offset, length, version, size of a packed lump).
    pub entry: usize,
}

/// A node: a plane's index, and two children. A child is a node's index, or `-1 - leaf`; of an unsigned field of 16 bits,
/// `65535 - leaf` if there is no such node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Node {
    pub size: usize,
    pub children: [Field; 2],
}

/// A leaf.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Leaf {
    pub size: usize,
    /// Offset of its row ([`Rows::ByLeaf`]), or its cluster.
    pub row: Field,
    /// First entry and number of entries in [`Lump::MarkSurfaces`].
    pub marks: [Field; 2],
    /// Likewise in [`Lump::LeafBrushes`], where the tree has detail.
    pub brushes: Option<[Field; 2]>,
}

/// A model; the first is the world. It begins with the least and greatest corner of its box.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Model {
    pub size: usize,
    /// The root of its tree; `None`: node 0.
    pub head: Option<Field>,
    /// Number of leaves with a row ([`Rows::ByLeaf`]).
    pub leaves: Option<Field>,
    /// First face and number of faces.
    pub faces: [Field; 2],
}

/// How faces are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Faces {
    /// By the lump's version.
    Chains(&'static [(i32, Chain)]),
    Meshes(Mesh),
}

/// Faces as chains of edges.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Chain {
    pub size: usize,
    /// First surface edge and number of surface edges.
    pub edges: [Field; 2],
    pub texture_info: Field,
    /// Its displacement; negative for none.
    pub displacement: Option<Displacement>,
    /// Bytes of a texture info, which begins with two axes of four floats.
    pub info: usize,
    pub texture: Texture,
    /// The two vertices of an edge; its size is twice that of a field.
    pub ends: [Field; 2],
    /// An entry of [`Lump::MarkSurfaces`].
    pub mark: Field,
}

/// A displacement: it begins with the corner that its grid begins at, and ends with a bit for each vertex that is drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Displacement {
    /// Of a face: its displacement.
    pub of_face: Field,
    pub size: usize,
    /// First entry in [`Lump::DisplacementVertices`].
    pub first: Field,
    /// A side of its grid has 2 to this power of squares.
    pub power: Field,
    /// First of the bits.
    pub drawn: usize,
    /// Bytes of a vertex: a direction, a distance, and an opacity.
    pub vertex: usize,
}

/// Faces as triangles, and grids of control points.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Mesh {
    pub size: usize,
    pub texture: Field,
    /// 1: polygon, 2: patch, 3: mesh, 4: billboard.
    pub kind: Field,
    /// First vertex and number of vertices.
    pub vertices: [Field; 2],
    /// Likewise in [`Lump::MeshVertices`], of which each has 4 bytes.
    pub corners: [Field; 2],
    /// Control points of a patch along both sides.
    pub patch: [Field; 2],
    /// Bytes of a texture: a name, the surface's flags and the contents.
    pub info: usize,
    /// Bytes of the name.
    pub name: usize,
    pub flags: Field,
    pub contents: Field,
    /// An entry of [`Lump::MarkSurfaces`].
    pub mark: Field,
}

/// Where a texture info has its texture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Texture {
    /// A number in [`Lump::Textures`], which has the names.
    Number(Field),
    /// A name of 32 bytes, and flags of the surface.
    Named { name: usize, flags: Field },
    /// A number in [`Lump::TextureData`], and flags of the surface. An entry there begins with the reflectivity, three floats.
    Data { data: Field, flags: Field, size: usize, name: Field },
}

/// Which flags of a surface tell its use. Where textures have contents, these are the upper 32 bits.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Flags {
    /// Sky, which is opaque.
    pub sky: i64,
    /// Liquids, fog, translucent surfaces, and those with holes.
    pub see_through: i64,
    /// Never drawn: hints among them.
    pub undrawn: i64,
}

/// What closes a leaf.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Closed {
    /// Any of these contents, in a leaf's first field.
    Contents(&'static [i64]),
    /// The lowest bit of the contents; also, no cluster.
    SolidBit,
    /// No cluster.
    NoCluster,
}

/// Which leaves sight passes between, as the game's compiler has it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Passes {
    /// All open ones.
    All,
    /// Those with equal contents: water's surface hides, and so does sky.
    Equal,
    /// Those whose contents do not differ in a bit up to the given one, where neither translucent matter nor detail counts.
    EqualBits(i64),
}

impl Passes {
    /// Translucent matter, and detail.
    const NEITHER: i64 = 0x1800_0000;

    pub fn between(self, a: i64, b: i64) -> bool {
        let seen = |contents: i64| if contents & Self::NEITHER != 0 { 0 } else { contents };
        match self {
            Self::All => true,
            Self::Equal => a == b,
            Self::EqualBits(last) => (seen(a) ^ seen(b)) & (2 * last - 1) == 0,
        }
    }
}

/// How rows are kept.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Rows {
    /// A leaf has the offset of its run-length coded row, with a bit for each leaf but the first.
    ByLeaf,
    /// The number of clusters, and two offsets for each; run-length coded rows of clusters. The second set is the union of the
    /// rows that a cluster sees; its name.
    ByCluster(&'static str),
    /// The number of clusters, the bytes of a row, and the rows as they are.
    Plain,
}

/// A game's level file.
#[derive(Debug)]
pub(crate) struct Layout {
    /// As in messages.
    pub name: &'static str,
    /// The first four bytes.
    pub magic: [u8; 4],
    /// The number behind them; `None` if `magic` is the version itself.
    pub version: Option<i32>,
    pub directory: Directory,
    pub lumps: &'static [(Lump, usize)],
    /// Bytes of a plane: a normal, a distance, and a type in most games.
    pub plane: usize,
    /// By the lump's version.
    pub nodes: &'static [(i32, Node)],
    pub leaves: &'static [(i32, Leaf)],
    pub model: Model,
    /// Bytes of a vertex, which begins with its place.
    pub vertex: usize,
    pub faces: Faces,
    pub flags: Flags,
    /// Whether solid detail ends the leaves of a scene. If not, its faces alone hide: some of them are not drawn.
    pub detail_is_wall: bool,
    /// Metres per unit.
    pub unit: f64,
    pub closed: Closed,
    pub passes: Passes,
    /// Faces with names that begin with `{` have holes.
    pub has_fences: bool,
    /// A leaf ends with the loudness of water, sky, slime and lava.
    pub ambient: bool,
    pub rows: Rows,
}

impl Layout {
    /// The number of a lump, if the game has it.
    pub fn number(&self, lump: Lump) -> Option<usize> {
        self.lumps.iter().find(|(of, _)| *of == lump).map(|&(_, number)| number)
    }

    pub fn header(&self) -> usize {
        self.directory.at + self.directory.lumps * self.directory.entry
    }
}
