//! Quake levels written by hand, byte by byte, from a tree of axis-aligned planes.

/// Contents, as in the file.
pub const AIR: i32 = -1;
pub const SOLID: i32 = -2;
/// Solid, but a leaf of its own, as compilers write what is behind a fence.
pub const FENCE: i32 = -2 - 1000;
pub const WATER: i32 = -3;
pub const SKY: i32 = -6;

/// A tree: what is before a plane (along its axis), and what is behind it.
pub enum Tree {
    Leaf(i32),
    Node(usize, f32, Box<Tree>, Box<Tree>),
}

/// Shorthand.
pub fn leaf(contents: i32) -> Tree {
    Tree::Leaf(contents)
}

/// Shorthand: `front` is where the coordinate is greater.
pub fn node(axis: usize, at: f32, front: Tree, back: Tree) -> Tree {
    Tree::Node(axis, at, Box::new(front), Box::new(back))
}

/// A box of `inside`, solid around it.
pub fn hollow(min: [f32; 3], max: [f32; 3], inside: Tree) -> Tree {
    (0..3).fold(inside, |inside, axis| {
        let above = node(axis, max[axis], leaf(SOLID), inside);
        node(axis, min[axis], above, leaf(SOLID))
    })
}

/// Three rooms in a row along x, each 4 deep, joined by doors of 2 x 2 through walls that are 1 thick; the doors' passages are
/// leaves, too. `last` is what fills the third room.
pub fn three_rooms(last: i32) -> Tree {
    let door = |from: f32, to: f32| hollow([from, -1.0, -1.0], [to, 1.0, 1.0], leaf(AIR));
    let third = node(0, 10.0, leaf(last), door(9.0, 10.0));
    let second = node(0, 5.0, node(0, 9.0, third, leaf(AIR)), door(4.0, 5.0));
    hollow([0.0, -2.0, -2.0], [14.0, 2.0, 2.0], node(0, 4.0, second, leaf(AIR)))
}

/// A room with a partition of `behind` from x = 4 to 5, whose two faces are gratings. Before it, at x = 2, two leaves of air meet: leaves 1
/// (east), 2 (the partition, unless it is [`SOLID`]) and the two before it.
pub fn grated_room(behind: i32) -> Vec<u8> {
    let east = node(0, 5.0, leaf(AIR), leaf(behind));
    let west = node(0, 2.0, leaf(AIR), leaf(AIR));
    let tree = hollow([0.0, -2.0, -2.0], [9.0, 2.0, 2.0], node(0, 4.0, east, west));
    let across = |x: f32, turned: bool, leaf: usize| {
        let mut corners = vec![[x, -2.0, -2.0], [x, 2.0, -2.0], [x, 2.0, 2.0], [x, -2.0, 2.0]];
        if turned {
            corners.reverse();
        }
        Face { corners, texture: "{grate", leaf }
    };
    let before = if behind == SOLID { 2 } else { 3 };
    let entities = "{\n\"classname\" \"worldspawn\"\n}\n";
    with_faces(&bsp(&tree, Layout::default()), &[vec![across(5.0, false, 1), across(4.0, true, before)]], entities)
}

/// How a file is laid out.
#[derive(Clone, Copy, Default)]
pub struct Layout {
    pub bsp2: bool,
    /// Rows' bytes; leaves have no offset into them.
    pub vis: &'static [u8],
    /// The visibility lump comes last, not in the middle.
    pub vis_last: bool,
    /// Extension lumps after the others.
    pub extended: bool,
    /// Bytes after everything.
    pub tail: &'static [u8],
}

struct Writer {
    bsp2: bool,
    planes: Vec<u8>,
    nodes: Vec<u8>,
    node_count: i32,
    leaves: Vec<u8>,
    leaf_count: i32,
}

impl Writer {
    fn short(&self, to: &mut Vec<u8>, value: i32) {
        if self.bsp2 { to.extend(value.to_le_bytes()) } else { to.extend((value as i16).to_le_bytes()) }
    }

    fn bounds(&self, to: &mut Vec<u8>) {
        for value in [-32, -32, -32, 32, 32, 32] {
            if self.bsp2 { to.extend((value as f32).to_le_bytes()) } else { to.extend((value as i16).to_le_bytes()) }
        }
    }

    fn leaf(&mut self, contents: i32) {
        let mut entry = Vec::new();
        entry.extend(contents.to_le_bytes());
        entry.extend((-1i32).to_le_bytes());
        self.bounds(&mut entry);
        self.short(&mut entry, 0);
        self.short(&mut entry, 0);
        // Ambient sounds, to be left alone.
        entry.extend([1, 2, 3, self.leaf_count as u8]);
        self.leaves.extend(entry);
        self.leaf_count += 1;
    }

    /// What its parent calls it.
    fn tree(&mut self, tree: &Tree) -> i32 {
        match tree {
            Tree::Leaf(SOLID) => -1,
            Tree::Leaf(contents) => {
                self.leaf(if *contents == FENCE { SOLID } else { *contents });
                -self.leaf_count
            }
            Tree::Node(axis, at, front, back) => {
                let number = self.node_count;
                self.node_count += 1;
                for k in 0..3 {
                    self.planes.extend(f32::from(u8::from(k == *axis)).to_le_bytes());
                }
                self.planes.extend(at.to_le_bytes());
                self.planes.extend((*axis as i32).to_le_bytes());
                let size = if self.bsp2 { 44 } else { 24 };
                let place = number as usize * size;
                self.nodes.resize(self.nodes.len().max(place + size), 0);
                let children = [self.tree(front), self.tree(back)];
                let mut entry = Vec::new();
                entry.extend(number.to_le_bytes());
                children.iter().for_each(|&c| self.short(&mut entry, c));
                self.bounds(&mut entry);
                self.short(&mut entry, 0);
                self.short(&mut entry, 0);
                self.nodes[place..place + size].copy_from_slice(&entry);
                number
            }
        }
    }
}

/// A level's file.
pub fn bsp(tree: &Tree, layout: Layout) -> Vec<u8> {
    let mut w = Writer { bsp2: layout.bsp2, planes: vec![], nodes: vec![], node_count: 0, leaves: vec![], leaf_count: 0 };
    w.leaf(SOLID);
    let root = w.tree(tree);
    let vis_leaves = w.leaf_count - 1;
    // A leaf of a door or a lift, after the world's.
    w.leaf(AIR);

    let mut model: Vec<u8> = [-32f32, -32., -32., 32., 32., 32., 0., 0., 0.].iter().flat_map(|x| x.to_le_bytes()).collect();
    model.extend([root, 0, 0, 0, vis_leaves, 0, 1].iter().flat_map(|x| x.to_le_bytes()));
    let mut face = Vec::new();
    w.short(&mut face, 0);
    w.short(&mut face, 0);
    face.extend(0i32.to_le_bytes());
    w.short(&mut face, 0);
    w.short(&mut face, 0);
    face.extend([0, 255, 255, 255]);
    face.extend((-1i32).to_le_bytes());
    let mut info = vec![0; 32];
    info.extend([0i32, 0].iter().flat_map(|x| x.to_le_bytes()));
    let mut texture: Vec<u8> = [1i32, 8].iter().flat_map(|x| x.to_le_bytes()).collect();
    texture.extend(*b"ab\0");
    texture.extend([0; 37]);

    let mut lumps: [Vec<u8>; 15] = Default::default();
    lumps[0] = b"{\"classname\" \"worldspawn\"}\n\0".to_vec();
    lumps[1] = w.planes;
    lumps[2] = texture;
    lumps[3] = vec![0; 12];
    lumps[4] = layout.vis.to_vec();
    lumps[5] = w.nodes;
    lumps[6] = info;
    lumps[7] = face;
    lumps[8] = vec![7; 33];
    lumps[10] = w.leaves;
    lumps[11] = vec![0; 4];
    lumps[14] = model;

    let mut order: Vec<usize> = (0..15).collect();
    if layout.vis_last {
        order.remove(4);
        order.push(4);
    }
    let mut out = laid_out(if layout.bsp2 { b"BSP2" } else { &[29, 0, 0, 0] }, &lumps, &order);
    if layout.extended {
        out.resize(out.len().next_multiple_of(4), 0);
        let at = out.len() as u32 + 8 + 2 * 32;
        out.extend(b"BSPX\x02\0\0\0");
        for (name, offset, length) in [(b"RGBLIGHTING", at, 5u32), (b"LMSHIFT\0\0\0\0", at + 8, 3)] {
            out.extend(name);
            out.extend([0; 13]);
            out.extend([offset, length].map(u32::to_le_bytes).concat());
        }
        out.extend(b"color\0\0\0abc");
    }
    out.extend(layout.tail);
    out
}

/// Lumps in some order, behind their directory.
fn laid_out(magic: &[u8], lumps: &[Vec<u8>], order: &[usize]) -> Vec<u8> {
    let mut out = vec![0; 124];
    out[..4].copy_from_slice(magic);
    for &lump in order {
        out.resize(out.len().next_multiple_of(4), 0);
        let entry = [out.len() as u32, lumps[lump].len() as u32];
        out[4 + 8 * lump..12 + 8 * lump].copy_from_slice(&entry.map(u32::to_le_bytes).concat());
        out.extend(&lumps[lump]);
    }
    out
}

/// A face of a level.
pub struct Face {
    /// Counter-clockwise from where it is seen.
    pub corners: Vec<[f32; 3]>,
    pub texture: &'static str,
    /// The leaf that names it; 0 for none.
    pub leaf: usize,
}

fn number(n: usize) -> [u8; 4] {
    (n as i32).to_le_bytes()
}

/// Textures of these names, and a plain alignment of each.
fn put_textures(lumps: &mut [Vec<u8>], names: &[&str]) {
    lumps[2] = number(names.len()).to_vec();
    (0..names.len()).for_each(|i| lumps[2].extend(number(4 + 4 * names.len() + 40 * i)));
    lumps[6].clear();
    for (i, name) in names.iter().enumerate() {
        let mut texture = name.as_bytes().to_vec();
        texture.resize(40, 0);
        lumps[2].extend(texture);
        lumps[6].extend([&[0; 32][..], &number(i), &number(0)].concat());
    }
}

/// A bsp29 as [`bsp`] writes it, with other faces (of the world, then of each brush model) and entities.
pub fn with_faces(file: &[u8], models: &[Vec<Face>], entities: &str) -> Vec<u8> {
    let mut lumps = lumps(file);
    let short = |n: usize| (n as u16).to_le_bytes();
    let names: Vec<&str> = models.iter().flatten().map(|f| f.texture).collect();
    let mut textures = names.clone();
    textures.sort_unstable();
    textures.dedup();

    lumps[0] = [entities.as_bytes(), &[0]].concat();
    put_textures(&mut lumps, &textures);
    let mut named = vec![Vec::new(); lumps[10].len() / 28];
    (lumps[3], lumps[7], lumps[11], lumps[12], lumps[13]) = (vec![], vec![], vec![], vec![0; 4], vec![]);
    let (mut vertices, mut faces) = (0, 0);
    let world = lumps[14].clone();
    lumps[14].clear();
    for (i, model) in models.iter().enumerate() {
        lumps[14].extend(&world[..36]);
        if i == 0 {
            lumps[14].extend(&world[36..56])
        } else {
            lumps[14].extend([0; 20])
        }
        lumps[14].extend([number(faces), number(model.len())].concat());
        for face in model {
            let n = face.corners.len();
            let texture = textures.binary_search(&face.texture).unwrap();
            lumps[7].extend([short(0), short(0)].concat());
            let first = number(lumps[13].len() / 4);
            lumps[7].extend(first);
            lumps[7].extend([short(n), short(texture)].concat());
            lumps[7].extend([0, 255, 255, 255, 255, 255, 255, 255]);
            // Clockwise in the file; every other edge is taken backwards.
            for (k, corner) in face.corners.iter().rev().enumerate() {
                let (this, next) = (vertices + k, vertices + (k + 1) % n);
                let backwards = k % 2 == 1;
                let edge = (lumps[12].len() / 4) as i32;
                lumps[13].extend((if backwards { -edge } else { edge }).to_le_bytes());
                let ends = if backwards { [next, this] } else { [this, next] };
                lumps[12].extend(ends.map(short).concat());
                lumps[3].extend(corner.map(f32::to_le_bytes).concat());
            }
            named[face.leaf].push(faces);
            (vertices, faces) = (vertices + n, faces + 1);
        }
    }
    for (leaf, named) in named.iter().enumerate().skip(1) {
        let at = [short(lumps[11].len() / 2), short(named.len())].concat();
        lumps[10][28 * leaf + 20..28 * leaf + 24].copy_from_slice(&at);
        named.iter().for_each(|&face| lumps[11].extend(short(face)));
    }
    laid_out(&file[..4], &lumps, &(0..15).collect::<Vec<_>>())
}

/// The lumps of a file, by the directory.
pub fn lumps(file: &[u8]) -> Vec<Vec<u8>> {
    (0..15).map(|k| at_entry(file, 4 + 8 * k)).collect()
}

/// The lumps of its extension; none where it has none.
pub fn extension(file: &[u8]) -> Vec<Vec<u8>> {
    let end = (0..15).map(|k| word(file, 4 + 8 * k) + word(file, 8 + 8 * k)).max().unwrap().next_multiple_of(4);
    if file.get(end..end + 4) != Some(b"BSPX") {
        return Vec::new();
    }
    (0..word(file, end + 4)).map(|k| at_entry(file, end + 8 + 32 * k + 24)).collect()
}

fn at_entry(file: &[u8], entry: usize) -> Vec<u8> {
    let (offset, length) = (word(file, entry), word(file, entry + 4));
    file[offset..offset + length].to_vec()
}

fn word(file: &[u8], at: usize) -> usize {
    u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize
}
