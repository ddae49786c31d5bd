//! What is known of each game's level file. A new game is a table here, over one reader and one writer.
//!
//! Numbers of lumps, sizes of records and places of fields are as found in files of each kind; docs/levels.md lists them.

use super::record::{Field, i16, i32, u16, u32};
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

/// Faces as chains of edges.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Face {
    pub size: usize,
    /// First surface edge and number of surface edges.
    pub edges: [Field; 2],
    pub texture_info: Field,
    /// Bytes of a texture info, which begins with two axes of four floats.
    pub info: usize,
    pub texture: Texture,
    /// The two vertices of an edge; its size is twice that of a field.
    pub ends: [Field; 2],
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
    /// Games whose faces are chains of edges.
    pub face: Option<Face>,
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

/// Solid, sky, and what is left of brushes that only players or tools meet. Games draw nothing behind sky.
const QUAKE_CLOSED: Closed = Closed::Contents(&[-2, -6, -7, -8]);

const QUAKE_LUMPS: &[(Lump, usize)] = &[
    (Lump::Entities, 0),
    (Lump::Planes, 1),
    (Lump::Textures, 2),
    (Lump::Vertices, 3),
    (Lump::Visibility, 4),
    (Lump::Nodes, 5),
    (Lump::TextureInfos, 6),
    (Lump::Faces, 7),
    (Lump::Leaves, 10),
    (Lump::MarkSurfaces, 11),
    (Lump::Edges, 12),
    (Lump::SurfaceEdges, 13),
    (Lump::Models, 14),
];

const QUAKE2_LUMPS: &[(Lump, usize)] = &[
    (Lump::Entities, 0),
    (Lump::Planes, 1),
    (Lump::Vertices, 2),
    (Lump::Visibility, 3),
    (Lump::Nodes, 4),
    (Lump::TextureInfos, 5),
    (Lump::Faces, 6),
    (Lump::Leaves, 8),
    (Lump::MarkSurfaces, 9),
    (Lump::LeafBrushes, 10),
    (Lump::Edges, 11),
    (Lump::SurfaceEdges, 12),
    (Lump::Models, 13),
    (Lump::Brushes, 14),
];

const QUAKE3_LUMPS: &[(Lump, usize)] = &[
    (Lump::Entities, 0),
    (Lump::Planes, 2),
    (Lump::Nodes, 3),
    (Lump::Leaves, 4),
    (Lump::MarkSurfaces, 5),
    (Lump::LeafBrushes, 6),
    (Lump::Models, 7),
    (Lump::Brushes, 8),
    (Lump::Vertices, 10),
    (Lump::Faces, 13),
    (Lump::Visibility, 16),
];

const SOURCE_LUMPS: &[(Lump, usize)] = &[
    (Lump::Entities, 0),
    (Lump::Planes, 1),
    (Lump::Vertices, 3),
    (Lump::Visibility, 4),
    (Lump::Nodes, 5),
    (Lump::TextureInfos, 6),
    (Lump::Faces, 7),
    (Lump::Leaves, 10),
    (Lump::Edges, 12),
    (Lump::SurfaceEdges, 13),
    (Lump::Models, 14),
    (Lump::MarkSurfaces, 16),
    (Lump::LeafBrushes, 17),
    (Lump::Brushes, 18),
];

/// A node as Quake has it: 16 bits for children, boxes and faces.
const NODE_16: Node = Node { size: 24, children: [u16(4), u16(6)] };
const QUAKE_LEAF: Leaf = Leaf { size: 28, row: i32(4), marks: [u16(20), u16(22)], brushes: None };
const QUAKE_MODEL: Model = Model { size: 64, head: Some(i32(36)), leaves: Some(i32(52)), faces: [i32(56), i32(60)] };
const FACE_16: Face = Face {
    size: 20,
    edges: [i32(4), u16(8)],
    texture_info: u16(10),
    info: 40,
    texture: Texture::Number(i32(32)),
    ends: [u16(0), u16(2)],
    mark: u16(0),
};
const FACE_32: Face = Face {
    size: 28,
    edges: [i32(8), i32(12)],
    texture_info: i32(16),
    info: 40,
    texture: Texture::Number(i32(32)),
    ends: [u32(0), u32(4)],
    mark: u32(0),
};

const QUAKE: Layout = Layout {
    name: "bsp29",
    magic: [29, 0, 0, 0],
    version: None,
    directory: Directory { at: 4, lumps: 15, entry: 8 },
    lumps: QUAKE_LUMPS,
    plane: 20,
    nodes: &[(0, NODE_16)],
    leaves: &[(0, QUAKE_LEAF)],
    model: QUAKE_MODEL,
    face: Some(FACE_16),
    closed: QUAKE_CLOSED,
    passes: Passes::All,
    has_fences: true,
    ambient: true,
    rows: Rows::ByLeaf,
};

const NAMED: Texture = Texture::Named { name: 40, flags: i32(32) };

const QUAKE2: Layout = Layout {
    name: "Quake 2's IBSP 38",
    magic: *b"IBSP",
    version: Some(38),
    directory: Directory { at: 8, lumps: 19, entry: 8 },
    lumps: QUAKE2_LUMPS,
    plane: 20,
    nodes: &[(0, Node { size: 28, children: [i32(4), i32(8)] })],
    leaves: &[(0, Leaf { size: 28, row: i16(4), marks: [u16(20), u16(22)], brushes: Some([u16(24), u16(26)]) })],
    model: Model { size: 48, head: Some(i32(36)), leaves: None, faces: [i32(40), i32(44)] },
    face: Some(Face { info: 76, texture: NAMED, ..FACE_16 }),
    closed: Closed::SolidBit,
    // Mist.
    passes: Passes::EqualBits(0x40),
    has_fences: false,
    ambient: false,
    rows: Rows::ByCluster("PHS"),
};

const SOURCE: Layout = Layout {
    name: "Source's VBSP 20",
    magic: *b"VBSP",
    version: Some(20),
    directory: Directory { at: 8, lumps: 64, entry: 16 },
    lumps: SOURCE_LUMPS,
    plane: 20,
    nodes: &[
        (0, Node { size: 32, children: [i32(4), i32(8)] }),
        // Boxes in floats.
        (1, Node { size: 48, children: [i32(4), i32(8)] }),
    ],
    leaves: &[
        // With samples of light.
        (0, Leaf { size: 56, ..SOURCE_LEAF }),
        (1, SOURCE_LEAF),
        (2, Leaf { size: 56, row: i32(4), marks: [u32(36), u32(40)], brushes: Some([u32(44), u32(48)]) }),
    ],
    model: Model { size: 48, head: Some(i32(36)), leaves: None, faces: [i32(40), i32(44)] },
    face: None,
    closed: Closed::SolidBit,
    // Opaque matter.
    passes: Passes::EqualBits(0x80),
    has_fences: false,
    ambient: false,
    rows: Rows::ByCluster("PAS"),
};
const SOURCE_LEAF: Leaf = Leaf { size: 32, row: i16(4), marks: [u16(20), u16(22)], brushes: Some([u16(24), u16(26)]) };

/// Every kind of file that is read.
pub(crate) const LAYOUTS: &[Layout] = &[
    QUAKE,
    Layout {
        name: "BSP2",
        magic: *b"BSP2",
        nodes: &[(0, Node { size: 44, children: [i32(4), i32(8)] })],
        leaves: &[(0, Leaf { size: 44, marks: [u32(32), u32(36)], ..QUAKE_LEAF })],
        face: Some(FACE_32),
        ..QUAKE
    },
    Layout {
        name: "2PSB",
        magic: *b"2PSB",
        nodes: &[(0, Node { size: 32, children: [i32(4), i32(8)] })],
        leaves: &[(0, Leaf { size: 32, marks: [u32(20), u32(24)], ..QUAKE_LEAF })],
        face: Some(FACE_32),
        ..QUAKE
    },
    Layout {
        name: "Half-Life's bsp30",
        magic: [30, 0, 0, 0],
        closed: Closed::Contents(&[-2]),
        passes: Passes::Equal,
        has_fences: false,
        ambient: false,
        ..QUAKE
    },
    QUAKE2,
    Layout {
        name: "Qbism's QBSP 38",
        magic: *b"QBSP",
        nodes: &[(0, Node { size: 44, children: [i32(4), i32(8)] })],
        leaves: &[(0, Leaf { size: 52, row: i32(4), marks: [u32(36), u32(40)], brushes: Some([u32(44), u32(48)]) })],
        face: Some(Face { info: 76, texture: NAMED, ..FACE_32 }),
        ..QUAKE2
    },
    Layout {
        name: "Quake 3's IBSP 46",
        magic: *b"IBSP",
        version: Some(46),
        directory: Directory { at: 8, lumps: 17, entry: 8 },
        lumps: QUAKE3_LUMPS,
        plane: 16,
        nodes: &[(0, Node { size: 36, children: [i32(4), i32(8)] })],
        // Detail is no part of the tree.
        leaves: &[(0, Leaf { size: 48, row: i32(0), marks: [i32(32), i32(36)], brushes: None })],
        model: Model { size: 40, head: None, leaves: None, faces: [i32(24), i32(28)] },
        face: None,
        closed: Closed::NoCluster,
        passes: Passes::All,
        has_fences: false,
        ambient: false,
        rows: Rows::Plain,
    },
    Layout { name: "Source's VBSP 19", version: Some(19), ..SOURCE },
    SOURCE,
    Layout { name: "Source's VBSP 21", version: Some(21), ..SOURCE },
    Layout { name: "Source's VBSP 25", version: Some(25), ..SOURCE },
];
