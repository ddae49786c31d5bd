//! What is known of each game's level file. A new game is a table here, over one reader and one writer.
//!
//! Numbers of lumps, sizes of records and places of fields are as found in files of each kind; docs/levels.md lists them.

use super::layout::{
    Chain, Closed, Directory, Displacement, Faces, Flags, Layout, Leaf, Lump, Mesh, Model, Node, Passes, Rows, Texture,
};
use super::record::{POINT, i16, i32, u16, u32};

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
    (Lump::Textures, 1),
    (Lump::Planes, 2),
    (Lump::Nodes, 3),
    (Lump::Leaves, 4),
    (Lump::MarkSurfaces, 5),
    (Lump::LeafBrushes, 6),
    (Lump::Models, 7),
    (Lump::Brushes, 8),
    (Lump::Vertices, 10),
    (Lump::MeshVertices, 11),
    (Lump::Faces, 13),
    (Lump::Visibility, 16),
];

const SOURCE_LUMPS: &[(Lump, usize)] = &[
    (Lump::Entities, 0),
    (Lump::Planes, 1),
    (Lump::TextureData, 2),
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
    (Lump::Displacements, 26),
    (Lump::DisplacementVertices, 33),
    (Lump::GameLumps, 35),
    (Lump::Names, 43),
    (Lump::NameOffsets, 44),
    (Lump::HdrFaces, 58),
];

/// A node as Quake has it: 16 bits for children, boxes and faces.
const NODE_16: Node = Node { size: 24, children: [u16(4), u16(6)] };
const QUAKE_LEAF: Leaf = Leaf { size: 28, row: i32(4), marks: [u16(20), u16(22)], brushes: None };
const QUAKE_MODEL: Model = Model { size: 64, head: Some(i32(36)), leaves: Some(i32(52)), faces: [i32(56), i32(60)] };
const FACE_16: Chain = Chain {
    size: 20,
    edges: [i32(4), u16(8)],
    texture_info: u16(10),
    displacement: None,
    info: 40,
    texture: Texture::Number(i32(32)),
    ends: [u16(0), u16(2)],
    mark: u16(0),
};
const FACE_32: Chain = Chain {
    size: 28,
    edges: [i32(8), i32(12)],
    texture_info: i32(16),
    displacement: None,
    info: 40,
    texture: Texture::Number(i32(32)),
    ends: [u32(0), u32(4)],
    mark: u32(0),
};

const SOURCE_FACE: Chain = Chain {
    size: 56,
    displacement: Some(Displacement { of_face: i16(12), size: 176, first: i32(12), power: i32(20), drawn: 136, vertex: 20 }),
    info: 72,
    texture: Texture::Data { data: i32(68), flags: i32(64), size: 32, name: i32(12) },
    ..FACE_16
};
const SOURCE_FACE_32: Chain = Chain {
    size: 72,
    edges: [i32(8), i32(12)],
    texture_info: i32(16),
    displacement: Some(Displacement { of_face: i32(20), size: 232, first: i32(12), power: i32(20), drawn: 192, vertex: 20 }),
    ends: [u32(0), u32(4)],
    mark: u32(0),
    ..SOURCE_FACE
};
const QUAKE3_FACE: Mesh = Mesh {
    size: 104,
    texture: i32(0),
    kind: i32(8),
    vertices: [i32(12), i32(16)],
    corners: [i32(20), i32(24)],
    patch: [i32(96), i32(100)],
    info: 72,
    name: 64,
    flags: i32(64),
    contents: u32(68),
    mark: i32(0),
};

/// Metres per unit: players are 56 units tall.
pub(crate) const QUAKE_UNIT: f64 = 1.0 / 32.0;
/// 16 units are a foot.
const SOURCE_UNIT: f64 = 0.3048 / 16.0;

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
    vertex: POINT,
    faces: Faces::Chains(&[(0, FACE_16)]),
    flags: Flags { sky: 0, see_through: 0, undrawn: 0 },
    detail_is_wall: true,
    unit: QUAKE_UNIT,
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
    vertex: POINT,
    faces: Faces::Chains(&[(0, Chain { info: 76, texture: NAMED, ..FACE_16 })]),
    // Undrawn: no drawing, hint, skip.
    flags: Flags { sky: 0x4, see_through: 0x8 | 0x10 | 0x20, undrawn: 0x80 | 0x100 | 0x200 },
    detail_is_wall: true,
    unit: QUAKE_UNIT,
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
    vertex: POINT,
    faces: Faces::Chains(&[(0, SOURCE_FACE), (1, SOURCE_FACE), (2, SOURCE_FACE_32)]),
    // Sky: with and without rooms of its own. Undrawn: trigger, no drawing, hint, skip.
    flags: Flags { sky: 0x2 | 0x4, see_through: 0x8 | 0x10, undrawn: 0x40 | 0x80 | 0x100 | 0x200 },
    detail_is_wall: false,
    unit: SOURCE_UNIT,
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
        faces: Faces::Chains(&[(0, FACE_32)]),
        ..QUAKE
    },
    Layout {
        name: "2PSB",
        magic: *b"2PSB",
        nodes: &[(0, Node { size: 32, children: [i32(4), i32(8)] })],
        leaves: &[(0, Leaf { size: 32, marks: [u32(20), u32(24)], ..QUAKE_LEAF })],
        faces: Faces::Chains(&[(0, FACE_32)]),
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
        faces: Faces::Chains(&[(0, Chain { info: 76, texture: NAMED, ..FACE_32 })]),
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
        vertex: 44,
        faces: Faces::Meshes(QUAKE3_FACE),
        // See-through: lets light through in part, casts a shadow with holes; lava, slime, water, fog, translucent. Undrawn: no drawing,
        // hint, skip.
        flags: Flags {
            sky: 0x4,
            see_through: 0x8000 | 0x1_0000 | (0x8 | 0x10 | 0x20 | 0x40 | 0x2000_0000) << 32,
            undrawn: 0x80 | 0x100 | 0x200,
        },
        detail_is_wall: true,
        unit: QUAKE_UNIT,
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
