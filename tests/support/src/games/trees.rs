//! Trees and rows of Quake 3's and Source's levels, read by hand.

use super::lines::{Child, Leaf, NEAR, Node, PlaneTree};
use enfilade::BitMatrix;
use glam::DVec3;

/// Sizes of records, and where fields of a leaf and a model are.
struct Sizes {
    /// Of a plane, a node, and a leaf.
    plane: usize,
    node: usize,
    leaf: usize,
    /// Lumps: planes, nodes, leaves, models, visibility.
    lumps: [[usize; 2]; 5],
}

fn int(bytes: &[u8], at: usize) -> i32 {
    i32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn point(bytes: &[u8], at: usize) -> DVec3 {
    DVec3::from_array([0, 4, 8].map(|k| f64::from(f32::from_bits(int(bytes, at + k) as u32))))
}

/// Where a lump is, and how long; for Source, with the number of its layout.
fn sizes(file: &[u8]) -> Sizes {
    let lump = |at: usize| [at, at + 4].map(|at| int(file, at) as usize);
    if file.starts_with(b"IBSP") {
        return Sizes { plane: 16, node: 36, leaf: 48, lumps: [2, 3, 4, 7, 16].map(|n| lump(8 + 8 * n)) };
    }
    assert!(file.starts_with(b"VBSP"));
    let layout = |n: usize| int(file, 8 + 16 * n + 8);
    let node = if layout(5) == 0 { 32 } else { 48 };
    let leaf = if layout(10) == 1 { 32 } else { 56 };
    Sizes { plane: 20, node, leaf, lumps: [1, 5, 10, 14, 4].map(|n| lump(8 + 16 * n)) }
}

/// The world of a level of Quake 3 or Source (little-endian, unpacked), and its rows if it has some.
pub fn read(file: &[u8]) -> (PlaneTree, Option<BitMatrix>) {
    let sizes = sizes(file);
    let [planes, nodes, leaves, models, seen] = sizes.lumps.map(|[at, length]| &file[at..at + length]);
    let is_quake = file.starts_with(b"IBSP");
    let child = |n: i32| if n < 0 { Child::Leaf(!n as usize) } else { Child::Node(n as usize) };
    let node = |node: &[u8]| {
        let plane = &planes[sizes.plane * int(node, 0) as usize..];
        let distance = f64::from(f32::from_bits(int(plane, 12) as u32));
        Node { normal: point(plane, 0), distance, children: [4, 8].map(|at| child(int(node, at))) }
    };
    let is_wide = sizes.leaf == 56 && int(file, 4) == 25;
    let leaf = |leaf: &[u8]| {
        let short = i32::from(i16::from_le_bytes([leaf[4], leaf[5]]));
        let (contents, cluster) = match (is_quake, is_wide) {
            (true, _) => (0, int(leaf, 0)),
            (false, true) => (int(leaf, 0), int(leaf, 4)),
            (false, false) => (int(leaf, 0), short),
        };
        Leaf { cell: u32::try_from(cluster).ok(), kind: kind(contents as u32, 0xff) }
    };
    let root = if is_quake { Child::Node(0) } else { child(int(models, 36)) };
    let nodes: Vec<Node> = nodes.chunks_exact(sizes.node).map(node).collect();
    let leaves: Vec<Leaf> = leaves.chunks_exact(sizes.leaf).map(leaf).collect();
    let bounds = [0, 12].map(|at| point(models, at));
    let mut tree = PlaneTree { nodes, leaves, root, bounds, cells: 0, near: NEAR };
    tree.forget_other_models();
    tree.cut_empty();
    let rows = (!seen.is_empty()).then(|| if is_quake { plain(seen) } else { packed(seen) });
    (tree, rows)
}

/// The kind of matter, where it is not solid, of contents in bits (Quake 2, Source): what is translucent, or detail, counts as air, and so
/// do bits beyond those of matter that can be seen.
pub fn kind(contents: u32, matter: u32) -> Option<u32> {
    const SOLID: u32 = 1;
    const DETAIL: u32 = 0x0800_0000;
    const TRANSLUCENT: u32 = 0x1000_0000;
    match contents {
        _ if contents & SOLID != 0 => None,
        _ if contents & (DETAIL | TRANSLUCENT) != 0 => Some(0),
        _ => Some(contents & matter),
    }
}

impl PlaneTree {
    /// Counts cells, and takes them from leaves that the tree does not reach: those of doors name cell 0.
    pub fn forget_other_models(&mut self) {
        let mut reached = vec![false; self.leaves.len()];
        let mut stack = vec![self.root];
        while let Some(child) = stack.pop() {
            match child {
                Child::Node(n) => stack.extend(self.nodes[n].children),
                Child::Leaf(leaf) => reached[leaf] = true,
            }
        }
        for (leaf, reached) in self.leaves.iter_mut().zip(reached) {
            leaf.cell = leaf.cell.filter(|_| reached && leaf.kind.is_some());
        }
        self.cells = self.leaves.iter().filter_map(|leaf| leaf.cell).max().map_or(0, |last| last as usize + 1);
    }
}

fn bits(rows: &mut BitMatrix, row: usize, bytes: impl Iterator<Item = u8>) {
    for (k, byte) in bytes.enumerate() {
        (0..8).filter(|bit| byte >> bit & 1 == 1).for_each(|bit| _ = rows.set(row, 8 * k + bit));
    }
}

/// Quake 3: a number of rows, their bytes, and the rows.
fn plain(lump: &[u8]) -> BitMatrix {
    let [count, width] = [0, 4].map(|at| int(lump, at) as usize);
    let mut rows = BitMatrix::new(count, count);
    lump[8..]
        .chunks_exact(width)
        .take(count)
        .enumerate()
        .for_each(|(row, bytes)| bits(&mut rows, row, bytes.iter().copied()));
    rows
}

/// Source: a number of rows, two offsets for each, and rows where a zero is followed by how many there are.
fn packed(lump: &[u8]) -> BitMatrix {
    let count = int(lump, 0) as usize;
    let mut rows = BitMatrix::new(count, count);
    for row in 0..count {
        let mut code = lump[int(lump, 4 + 8 * row) as usize..].iter();
        let mut bytes = Vec::new();
        while bytes.len() < count.div_ceil(8) {
            match *code.next().unwrap() {
                0 => bytes.resize(bytes.len() + usize::from(*code.next().unwrap()), 0),
                byte => bytes.push(byte),
            }
        }
        bits(&mut rows, row, bytes.into_iter());
    }
    rows
}
