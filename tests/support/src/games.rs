//! Levels of other games than Quake, written by hand, byte by byte: the three rooms of [`crate::quake::three_rooms`].

pub mod drawn;
pub mod files;
pub mod lines;
pub mod trees;

use crate::quake::{AIR, SOLID, Tree, three_rooms};

/// A kind of file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Game {
    TwoPsb,
    HalfLife,
    /// Half-Life with the second directory of Xash.
    Xash,
    Quake2,
    Qbism,
    Quake3,
    Source(i32),
    /// The directory of Left 4 Dead 2.
    Source21VersionFirst,
    /// Big-endian.
    Console,
}

/// All kinds.
pub const GAMES: [Game; 12] = [
    Game::TwoPsb,
    Game::HalfLife,
    Game::Xash,
    Game::Quake2,
    Game::Qbism,
    Game::Quake3,
    Game::Source(19),
    Game::Source(20),
    Game::Source(21),
    Game::Source(25),
    Game::Source21VersionFirst,
    Game::Console,
];

/// Five cells in a row, rooms and doors.
pub const CELLS: usize = 5;

impl Game {
    fn is_source(self) -> bool {
        matches!(self, Self::Source(_) | Self::Source21VersionFirst | Self::Console)
    }

    fn is_by_leaf(self) -> bool {
        matches!(self, Self::TwoPsb | Self::HalfLife | Self::Xash)
    }

    /// Numbers of lumps: planes, nodes, leaves, models, visibility, and how many there are.
    fn lumps(self) -> [usize; 6] {
        match self {
            Self::TwoPsb | Self::HalfLife | Self::Xash => [1, 5, 10, 14, 4, 15],
            Self::Quake2 | Self::Qbism => [1, 4, 8, 13, 3, 19],
            Self::Quake3 => [2, 3, 4, 7, 16, 17],
            _ => [1, 5, 10, 14, 4, 64],
        }
    }
}

struct Writer {
    game: Game,
    planes: Vec<u8>,
    nodes: Vec<Vec<u8>>,
    leaves: Vec<u8>,
    clusters: i32,
}

impl Writer {
    fn int(&self, value: i32) -> [u8; 4] {
        if self.game == Game::Console { value.to_be_bytes() } else { value.to_le_bytes() }
    }

    fn short(&self, value: i32) -> [u8; 2] {
        let value = value as i16;
        if self.game == Game::Console { value.to_be_bytes() } else { value.to_le_bytes() }
    }

    fn ints(&self, values: &[i32]) -> Vec<u8> {
        values.iter().flat_map(|&v| self.int(v)).collect()
    }

    fn shorts(&self, values: &[i32]) -> Vec<u8> {
        values.iter().flat_map(|&v| self.short(v)).collect()
    }

    fn floats(&self, values: &[f32]) -> Vec<u8> {
        values.iter().flat_map(|v| self.int(v.to_bits() as i32)).collect()
    }

    /// A leaf of a kind: solid has no cluster.
    fn leaf(&mut self, contents: i32, cluster: i32) {
        let later = i32::from(contents == SOLID);
        let bytes = match self.game {
            Game::HalfLife | Game::Xash => [self.ints(&[contents, -1]), self.shorts(&[0; 8]), vec![0; 4]].concat(),
            Game::TwoPsb => [self.ints(&[contents, -1]), self.shorts(&[0; 6]), self.ints(&[0; 2]), vec![0; 4]].concat(),
            Game::Quake2 => [self.ints(&[later]), self.shorts(&[cluster, 0]), self.shorts(&[0; 10])].concat(),
            Game::Qbism => self.ints(&[&[later, cluster, 0][..], &[0; 10]].concat()),
            Game::Quake3 => self.ints(&[&[cluster, 0][..], &[0; 10]].concat()),
            Game::Source(25) => self.ints(&[&[later, cluster, 0][..], &[0; 11]].concat()),
            _ => {
                let light = if self.game == Game::Source(19) { 24 } else { 0 };
                [self.ints(&[later]), self.shorts(&[cluster, 0]), self.shorts(&[0; 10]), vec![0; 4 + light]].concat()
            }
        };
        self.leaves.extend(bytes);
    }

    fn leaf_count(&self) -> i32 {
        let size = match self.game {
            Game::HalfLife | Game::Xash | Game::Quake2 => 28,
            Game::TwoPsb => 32,
            Game::Qbism => 52,
            Game::Quake3 => 48,
            Game::Source(19 | 25) => 56,
            _ => 32,
        };
        (self.leaves.len() / size) as i32
    }

    /// What its parent calls it.
    fn tree(&mut self, tree: &Tree) -> i32 {
        match tree {
            Tree::Leaf(SOLID) => -1,
            Tree::Leaf(contents) => {
                self.leaf(*contents, self.clusters);
                self.clusters += 1;
                -self.leaf_count()
            }
            Tree::Node(axis, at, front, back) => {
                let number = self.nodes.len();
                let mut normal = [0.0f32; 3];
                normal[*axis] = 1.0;
                self.planes.extend(self.floats(&[&normal[..], &[*at]].concat()));
                if self.game != Game::Quake3 {
                    self.planes.extend(self.int(*axis as i32));
                }
                self.nodes.push(Vec::new());
                let children = [self.tree(front), self.tree(back)];
                let head = self.int(number as i32).to_vec();
                let rest = match self.game {
                    Game::HalfLife | Game::Xash => [self.shorts(&children), vec![0; 16]].concat(),
                    Game::TwoPsb | Game::Source(19..=21) | Game::Source21VersionFirst | Game::Console => {
                        [self.ints(&children), vec![0; 20]].concat()
                    }
                    Game::Quake2 => [self.ints(&children), vec![0; 16]].concat(),
                    Game::Qbism => [self.ints(&children), vec![0; 32]].concat(),
                    Game::Quake3 => [self.ints(&children), vec![0; 24]].concat(),
                    Game::Source(_) => [self.ints(&children), vec![0; 36]].concat(),
                };
                self.nodes[number] = [head, rest].concat();
                number as i32
            }
        }
    }
}

/// A level of three rooms, without rows and faces.
pub fn level(game: Game) -> Vec<u8> {
    let (w, lumps) = built(game);
    laid_out(&w, &lumps)
}

/// Its lumps.
fn built(game: Game) -> (Writer, Vec<Vec<u8>>) {
    let mut w = Writer { game, planes: vec![], nodes: vec![], leaves: vec![], clusters: 0 };
    // As id's compilers have it: the solid leaf names cluster 0. Quake 3 knows solid by its cluster alone.
    w.leaf(SOLID, if game == Game::Quake3 { -1 } else { 0 });
    let root = w.tree(&three_rooms(AIR));
    let leaves = w.leaf_count() - 1;
    // A leaf of a door, which is no part of the world.
    w.leaf(AIR, 0);
    let bounds = w.floats(&[-32., -32., -32., 32., 32., 32.]);
    let model = match game {
        _ if game.is_by_leaf() => [bounds, vec![0; 12], w.ints(&[root, 0, 0, 0, leaves, 0, 0])].concat(),
        Game::Quake3 => [bounds, vec![0; 16]].concat(),
        _ => [bounds, vec![0; 12], w.ints(&[root, 0, 0])].concat(),
    };
    assert!(root == 0 && leaves == CELLS as i32);

    let [planes, nodes, of_leaves, models, _, count] = game.lumps();
    let mut lumps = vec![Vec::new(); count];
    lumps[0] = b"{\"classname\" \"worldspawn\"}\n\0".to_vec();
    (lumps[planes], lumps[nodes]) = (w.planes.clone(), w.nodes.concat());
    (lumps[of_leaves], lumps[models]) = (w.leaves.clone(), model);
    (w, lumps)
}

/// The order of lumps in the file; the empty visibility lump points where it will be.
fn laid_out(w: &Writer, lumps: &[Vec<u8>]) -> Vec<u8> {
    let game = w.game;
    let visibility = game.lumps()[4];
    let version = match game {
        Game::Quake2 | Game::Qbism => 38,
        Game::Quake3 => 46,
        Game::Source(version) => version,
        Game::Source21VersionFirst => 21,
        _ => 20,
    };
    let magic: &[u8] = match game {
        Game::TwoPsb => b"2PSB",
        Game::HalfLife | Game::Xash => &[30, 0, 0, 0],
        Game::Quake2 | Game::Quake3 => b"IBSP",
        Game::Qbism => b"QBSP",
        Game::Console => b"PSBV",
        _ => b"VBSP",
    };
    let mut out = magic.to_vec();
    if !game.is_by_leaf() {
        out.extend(w.int(version));
    }
    let entry = if game.is_source() { 16 } else { 8 };
    let directory = out.len();
    out.resize(directory + entry * lumps.len() + if game.is_source() { 4 } else { 0 }, 0);
    if game == Game::Xash {
        out.extend([&b"XASH\x04\0\0\0"[..], &[0; 96]].concat());
    }
    // Entities last, as compilers have it: they move.
    let mut order: Vec<usize> = (1..lumps.len()).filter(|&lump| lump != visibility).collect();
    order.extend([visibility, 0]);
    for lump in order {
        let offset = out.len() as i32;
        let version = match (game, lump) {
            (Game::Source(19), 10) => 0,
            (Game::Source(25), 10) => 2,
            (Game::Source(25), 7 | 58) => 2,
            (Game::Source(25), 5 | 12 | 16 | 26) => 1,
            (_, 7 | 10 | 58) => 1,
            _ => 0,
        };
        let length = lumps[lump].len() as i32;
        let bytes = match game {
            Game::Source21VersionFirst => w.ints(&[version, offset, length, 0]),
            _ if game.is_source() => w.ints(&[offset, length, version, 0]),
            _ => w.ints(&[offset, length]),
        };
        out[directory + entry * lump..][..entry].copy_from_slice(&bytes);
        out.extend(&lumps[lump]);
        out.resize(out.len().next_multiple_of(4), 0);
    }
    if game == Game::Xash {
        // A lump of its own behind all others.
        let at = out.len() as i32;
        out[132..140].copy_from_slice(&w.ints(&[at, 4]));
        out.extend(b"more");
    }
    out
}
