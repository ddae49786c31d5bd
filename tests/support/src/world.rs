//! The world of a published Quake level (bsp29), read by hand: its tree, its leaves and its faces, without the library's reader.
//!
//! What can be looked through is what [`enfilade_levels`] takes for open: air and liquids. Solid leaves and sky are not.

use crate::quake::lumps;
use enfilade::math::geom::{Aabb, Plane};
use glam::DVec3;

/// Lumps by their place in the directory.
const PLANES: usize = 1;
const TEXTURES: usize = 2;
const VERTICES: usize = 3;
const NODES: usize = 5;
const TEXTURE_INFOS: usize = 6;
const FACES: usize = 7;
const LEAVES: usize = 10;
const MARK_SURFACES: usize = 11;
const EDGES: usize = 12;
const SURFACE_EDGES: usize = 13;
const MODELS: usize = 14;

/// Contents of leaves that can be looked through: air, water, slime, lava.
const OPEN: [i32; 4] = [-1, -3, -4, -5];
/// Textures of faces that games never draw.
const UNDRAWN: [&str; 3] = ["clip", "trigger", "skip"];

#[derive(Clone, Copy)]
enum Child {
    Node(usize),
    Leaf(usize),
}

struct Node {
    plane: Plane,
    /// In front of the plane, and behind it.
    children: [Child; 2],
}

/// A leaf of the tree.
pub struct Leaf {
    pub open: bool,
    /// Rounded outwards.
    pub bounds: Aabb,
    /// The faces on its boundary.
    pub faces: Vec<usize>,
}

/// A face of the world.
pub struct Face {
    /// Counter-clockwise from where it is seen, into [`World::vertices`].
    pub corners: Vec<usize>,
    /// The normal points to where it is seen from.
    pub plane: Plane,
    /// Neither a liquid's nor one that games never draw.
    pub opaque: bool,
}

/// A level without what moves. Lengths are the level's units, +Z is up.
pub struct World {
    pub vertices: Vec<DVec3>,
    pub faces: Vec<Face>,
    /// Leaf 0 is solid; leaf `i + 1` is cell `i` of [`enfilade_levels`].
    pub leaves: Vec<Leaf>,
    nodes: Vec<Node>,
    root: Child,
}

/// Where a straight line leaves what is open.
#[derive(Clone, Copy)]
pub struct End {
    /// The last open leaf.
    pub leaf: usize,
    /// How far along the line, in lengths of its direction.
    pub t: f64,
}

impl World {
    /// Reads a file; panics where it isn't a sound bsp29.
    pub fn read(file: &[u8]) -> Self {
        assert_eq!(int(file, 0), 29, "a bsp29");
        let lumps = lumps(file);
        let entries = |lump: usize, size: usize| lumps[lump].chunks_exact(size);
        let model = &lumps[MODELS];
        let [root, first, count] = [36, 56, 60].map(|at| int(model, at));
        assert_eq!(first, 0, "the world's faces come first");

        // 1. Faces, each with its plane and the name of its texture.
        let planes: Vec<Plane> = entries(PLANES, 20).map(plane).collect();
        let names: Vec<String> = entries(TEXTURE_INFOS, 40).map(|e| texture(&lumps[TEXTURES], int(e, 32))).collect();
        let corner = |at: usize| {
            let edge = int(&lumps[SURFACE_EDGES], 4 * at);
            unsigned(&lumps[EDGES], 4 * edge.unsigned_abs() as usize + 2 * usize::from(edge < 0))
        };
        let face = |e: &[u8]| {
            let (first, count) = (int(e, 4) as usize, unsigned(e, 8));
            let plane = planes[unsigned(e, 0)];
            let name = names[unsigned(e, 10)].as_str();
            // Clockwise in the file.
            let corners = (first..first + count).rev().map(corner).collect();
            let opaque = !name.starts_with('*') && !UNDRAWN.contains(&name);
            Face { corners, plane: if unsigned(e, 2) == 0 { plane } else { plane.flipped() }, opaque }
        };
        let faces: Vec<Face> = entries(FACES, 20).take(count as usize).map(face).collect();

        // 2. The tree.
        let node = |e: &[u8]| Node { plane: planes[int(e, 0) as usize], children: [4, 6].map(|at| child(short(e, at))) };
        let leaf = |e: &[u8]| {
            let corner = |at: usize| DVec3::from_array([0, 2, 4].map(|k| f64::from(short(e, at + k))));
            let (first, count) = (unsigned(e, 20), unsigned(e, 22));
            let faces = (first..first + count).map(|at| unsigned(&lumps[MARK_SURFACES], 2 * at)).collect();
            Leaf { open: OPEN.contains(&int(e, 0)), bounds: Aabb { min: corner(8), max: corner(14) }, faces }
        };
        Self {
            vertices: entries(VERTICES, 12).map(point).collect(),
            faces,
            leaves: entries(LEAVES, 28).take(1 + int(model, 52) as usize).map(leaf).collect(),
            nodes: entries(NODES, 24).map(node).collect(),
            root: child(root),
        }
    }

    /// The leaf that holds a point.
    pub fn leaf_at(&self, p: DVec3) -> usize {
        let mut at = self.root;
        loop {
            match at {
                Child::Leaf(leaf) => return leaf,
                Child::Node(n) => at = self.nodes[n].children[usize::from(self.nodes[n].plane.distance(p) < 0.0)],
            }
        }
    }

    /// Where a line from an open point comes upon what is not open; `None` where it doesn't for `0 < t < limit`.
    pub fn end_of_line(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<End> {
        let mut last = self.leaf_at(origin);
        // What is left of the line, the part nearest to its origin on top.
        let mut stack = vec![(self.root, 0.0, limit)];
        while let Some((at, from, to)) = stack.pop() {
            match at {
                Child::Leaf(leaf) if self.leaves[leaf].open => last = leaf,
                Child::Leaf(_) => return Some(End { leaf: last, t: from }),
                Child::Node(n) => {
                    let node = &self.nodes[n];
                    let (start, slope) = (node.plane.distance(origin), node.plane.n.dot(direction));
                    let behind = start + slope * (from + to) * 0.5 < 0.0;
                    let crossing = -start / slope;
                    if crossing > from && crossing < to {
                        let near = usize::from(slope > 0.0);
                        stack.push((node.children[1 - near], crossing, to));
                        stack.push((node.children[near], from, crossing));
                    } else {
                        stack.push((node.children[usize::from(behind)], from, to));
                    }
                }
            }
        }
        None
    }
}

fn child(reference: i32) -> Child {
    usize::try_from(reference).map_or(Child::Leaf(!reference as usize), Child::Node)
}

fn plane(entry: &[u8]) -> Plane {
    let (n, d) = (point(entry), f64::from(real(entry, 12)));
    Plane { n: n / n.length(), d: d / n.length() }
}

/// The name of a texture; empty where the file has none.
fn texture(lump: &[u8], index: i32) -> String {
    let Ok(offset) = usize::try_from(int(lump, 4 + 4 * index as usize)) else { return String::new() };
    lump[offset..offset + 16].iter().take_while(|&&b| b != 0).map(|&b| b.to_ascii_lowercase() as char).collect()
}

fn point(entry: &[u8]) -> DVec3 {
    DVec3::from_array([0, 4, 8].map(|at| f64::from(real(entry, at))))
}

fn bytes<const N: usize>(entry: &[u8], at: usize) -> [u8; N] {
    entry[at..at + N].try_into().expect("as many bytes")
}

fn int(entry: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(bytes(entry, at))
}

fn short(entry: &[u8], at: usize) -> i32 {
    i32::from(i16::from_le_bytes(bytes(entry, at)))
}

fn unsigned(entry: &[u8], at: usize) -> usize {
    usize::from(u16::from_le_bytes(bytes(entry, at)))
}

fn real(entry: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes(entry, at))
}
