//! Straight lines through a level's tree of planes, and the pairs of cells that they show to each other. Portals are unknown here: a line
//! is followed from leaf to leaf, so that rows which were made from portals can be compared with what is open.

use crate::random::Random;
use enfilade::BitMatrix;
use glam::DVec3;

/// Lines nearer to a plane than this are on both of its sides, in units. Less: corners that compilers move (by up to 0.005) decide.
pub const NEAR: f64 = 0.02;
/// Steps of a search for the line that shows a pair.
const STEPS: usize = 12;
/// Points that leaves are first looked for with.
const FIRST_POINTS: usize = 100_000;
/// Points kept of a leaf.
const MOST_POINTS: usize = 24;

/// The child of a node: another node, or a leaf.
#[derive(Clone, Copy, Debug)]
pub enum Child {
    Node(usize),
    Leaf(usize),
}

/// Before the plane: `normal . p >= distance`.
#[derive(Clone, Debug)]
pub struct Node {
    pub normal: DVec3,
    pub distance: f64,
    /// Before, behind.
    pub children: [Child; 2],
}

/// What sight passes: none, or matter of a kind. Between two kinds it ends.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    pub cell: Option<u32>,
    pub kind: Option<u32>,
}

impl Leaf {
    fn opened(&self) -> Option<(u32, u32)> {
        self.cell.zip(self.kind)
    }
}

/// The world of a level.
pub struct PlaneTree {
    pub nodes: Vec<Node>,
    pub leaves: Vec<Leaf>,
    pub root: Child,
    pub bounds: [DVec3; 2],
    pub cells: usize,
    /// As [`NEAR`], or more: then narrow gaps are never passed.
    pub near: f64,
}

/// A leaf that a line touches, with places along the line, 0 to 1.
#[derive(Clone, Copy, Debug)]
pub struct Passed {
    pub leaf: usize,
    /// Where it is no farther than [`PlaneTree::near`] from the leaf.
    pub touched: [f64; 2],
    /// The middle of where it is at least as far within.
    pub within: Option<f64>,
}

/// The part of an interval where `ends[0] + t * (ends[1] - ends[0]) >= least`.
fn cut([from, to]: [f64; 2], ends: [f64; 2], least: f64) -> [f64; 2] {
    let rise = ends[1] - ends[0];
    let at = (least - ends[0]) / rise;
    match rise.total_cmp(&0.0) {
        std::cmp::Ordering::Greater => [from.max(at), to],
        std::cmp::Ordering::Less => [from, to.min(at)],
        std::cmp::Ordering::Equal => [from, if ends[0] >= least { to } else { f64::NEG_INFINITY }],
    }
}

impl PlaneTree {
    pub fn leaf_at(&self, p: DVec3) -> usize {
        let mut child = self.root;
        loop {
            match child {
                Child::Leaf(leaf) => return leaf,
                Child::Node(n) => {
                    let node = &self.nodes[n];
                    child = node.children[usize::from(node.normal.dot(p) < node.distance)];
                }
            }
        }
    }

    /// Leads past nodes with nothing on one side, because a node above has the same plane, or one beyond it: what is there would be
    /// touched by lines that it does not stop.
    pub fn cut_empty(&mut self) {
        self.root = self.whole(self.root, &mut Vec::new());
    }

    /// The child, or the one below that has all of it; `way`: half-spaces that it lies in.
    fn whole(&mut self, mut child: Child, way: &mut Vec<(DVec3, f64)>) -> Child {
        while let Child::Node(n) = child {
            let node = self.nodes[n].clone();
            let sides = [(node.normal, node.distance), (-node.normal, -node.distance)];
            let is_all = |side: &(DVec3, f64)| way.iter().any(|(normal, least)| *normal == side.0 && *least >= side.1);
            match sides.iter().position(is_all) {
                Some(side) => child = node.children[side],
                None => {
                    self.nodes[n].children = [0, 1].map(|side| {
                        way.push(sides[side]);
                        let whole = self.whole(node.children[side], way);
                        way.pop();
                        whole
                    });
                    return child;
                }
            }
        }
        child
    }

    /// The leaves along a line.
    pub fn pass(&self, line: [DVec3; 2]) -> Vec<Passed> {
        let mut passed = Vec::new();
        let mut stack = vec![(self.root, [0.0, 1.0], [0.0, 1.0])];
        while let Some((child, touched, within)) = stack.pop() {
            match child {
                Child::Leaf(leaf) => {
                    let within = (within[0] < within[1]).then(|| 0.5 * (within[0] + within[1]));
                    passed.push(Passed { leaf, touched, within });
                }
                Child::Node(n) => {
                    let node = &self.nodes[n];
                    let ends = line.map(|p| node.normal.dot(p) - node.distance);
                    for (child, ends) in node.children.into_iter().zip([ends, ends.map(|d| -d)]) {
                        let touched = cut(touched, ends, -self.near);
                        if touched[0] <= touched[1] {
                            stack.push((child, touched, cut(within, ends, self.near)));
                        }
                    }
                }
            }
        }
        passed
    }

    /// Groups of open leaves along a line that see each other: nothing that the line touches between them is opaque, or of another
    /// kind. Each with its place along the line.
    pub fn open(&self, passed: &[Passed]) -> Vec<Vec<(u32, f64)>> {
        let kind = |p: &Passed| self.leaves[p.leaf].opened().map(|(_, kind)| kind);
        let mut kinds: Vec<u32> = passed.iter().filter_map(kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let mut groups = Vec::new();
        for own in kinds {
            let mut walls: Vec<f64> = passed.iter().filter(|p| kind(p) != Some(own)).map(|p| p.touched[0]).collect();
            walls.sort_by(f64::total_cmp);
            let own = passed.iter().filter(|p| kind(p) == Some(own));
            let mut places: Vec<(usize, u32, f64)> = own
                .filter_map(|p| Some((p.within?, self.leaves[p.leaf].cell?)))
                .map(|(at, cell)| (walls.partition_point(|&wall| wall < at), cell, at))
                .collect();
            places.sort_by_key(|&(walls, ..)| walls);
            let same = places.chunk_by(|a, b| a.0 == b.0);
            groups.extend(same.map(|group| group.iter().map(|&(_, cell, at)| (cell, at)).collect()));
        }
        groups
    }

    /// How much of a line, of its length, is in matter that sight does not pass from its beginning on.
    fn blocked(&self, passed: &[Passed], start: usize) -> f64 {
        let kind = self.leaves[start].kind;
        let walls = passed.iter().filter(|p| self.leaves[p.leaf].cell.is_none() || self.leaves[p.leaf].kind != kind);
        walls.map(|p| p.touched[1] - p.touched[0]).sum()
    }
}

/// What lines have shown.
pub struct Shown {
    pub lines: u64,
    /// Lines that show one cell another.
    pub open: u64,
    /// Ordered pairs.
    pub pairs: BitMatrix,
    /// Pairs that the rows lack, with the two places that see each other; a line for each.
    pub lost: Vec<([u32; 2], [DVec3; 2])>,
}

/// A search for open lines.
pub struct Search<'t> {
    tree: &'t PlaneTree,
    rows: &'t BitMatrix,
    random: Random,
    /// By leaf, and the leaves that have some.
    points: Vec<Vec<DVec3>>,
    known: Vec<usize>,
    shown: Shown,
}

impl<'t> Search<'t> {
    /// Lines between random leaves, and lines that search a way between cells that the rows hide from each other.
    pub fn run(tree: &'t PlaneTree, rows: &'t BitMatrix, lines: u64, seed: u64) -> Shown {
        let shown = Shown { lines: 0, open: 0, pairs: BitMatrix::new(tree.cells, tree.cells), lost: Vec::new() };
        let points = vec![Vec::new(); tree.leaves.len()];
        let mut search = Self { tree, rows, random: Random::new(seed), points, known: Vec::new(), shown };
        let size = tree.bounds[1] - tree.bounds[0];
        for _ in 0..FIRST_POINTS.max(50 * tree.leaves.len()) {
            let part = DVec3::from_array([(); 3].map(|()| search.random.real(0.0, 1.0)));
            search.keep(tree.bounds[0] + size * part);
        }
        assert!(search.known.len() > 1, "no leaf is open");
        while search.shown.lines < lines {
            let [a, b] = [search.any(), search.any()];
            search.long(a, b);
            if let Some([a, b]) = search.hidden() {
                search.climb(a, b);
            }
        }
        search.shown
    }

    /// Keeps a point, if its leaf is open.
    fn keep(&mut self, p: DVec3) {
        let leaf = self.tree.leaf_at(p);
        if self.tree.leaves[leaf].opened().is_none() {
            return;
        }
        let points = &mut self.points[leaf];
        if points.is_empty() {
            self.known.push(leaf);
        }
        if points.len() < MOST_POINTS { points.push(p) } else { points[self.random.below(MOST_POINTS)] = p }
    }

    fn any(&mut self) -> DVec3 {
        let leaf = self.known[self.random.below(self.known.len())];
        self.of(leaf)
    }

    fn of(&mut self, leaf: usize) -> DVec3 {
        self.points[leaf][self.random.below(self.points[leaf].len())]
    }

    /// Two leaves that the rows hide from each other; those that a third one sees, more often than not.
    fn hidden(&mut self) -> Option<[usize; 2]> {
        let cell = |leaf: usize| self.tree.leaves[leaf].cell.unwrap() as usize;
        let first = self.known[self.random.below(self.known.len())];
        let between: Vec<usize> = self.rows.ones(cell(first)).collect();
        for _ in 0..64 {
            let second = self.known[self.random.below(self.known.len())];
            let third = between.get(self.random.below(between.len())).copied();
            let is_near = third.is_none_or(|third| self.rows.get(third, cell(second)));
            if !self.rows.get(cell(first), cell(second)) && (is_near || self.random.chance(0.1)) {
                return Some([first, second]);
            }
        }
        None
    }

    /// Follows the line through two points, beyond both.
    fn long(&mut self, a: DVec3, b: DVec3) {
        let size = self.tree.bounds[0].distance(self.tree.bounds[1]);
        if let Some(way) = (b - a).try_normalize() {
            _ = self.follow([a - way * size, b + way * size]);
        }
    }

    fn follow(&mut self, line: [DVec3; 2]) -> Vec<Passed> {
        let passed = self.tree.pass(line);
        let at = |t: f64| line[0].lerp(line[1], t);
        self.shown.lines += 1;
        let mut is_open = false;
        for group in self.tree.open(&passed) {
            for &(a, from) in &group {
                self.keep(at(from));
                for &(b, to) in &group {
                    is_open |= a != b;
                    let is_new = self.shown.pairs.set(a as usize, b as usize);
                    if is_new && !self.rows.get(a as usize, b as usize) {
                        self.shown.lost.push(([a, b], [at(from), at(to)]));
                    }
                }
            }
        }
        self.shown.open += u64::from(is_open);
        passed
    }

    /// Moves the ends of a line within their leaves so that less of it is in walls.
    fn climb(&mut self, a: usize, b: usize) {
        let mut best = [self.of(a), self.of(b)];
        let mut least = f64::INFINITY;
        for step in 0..STEPS {
            let mut line = best;
            if step > 0 {
                let end = self.random.below(2);
                let leaf = [a, b][end];
                line[end] = if self.random.chance(0.3) {
                    self.of(leaf)
                } else {
                    best[end] + self.random.direction() * self.random.real(0.0, 1.0).powi(3) * 128.0
                };
                if self.tree.leaf_at(line[end]) != leaf {
                    continue;
                }
            }
            let passed = self.follow(line);
            let blocked = self.tree.blocked(&passed, a) * line[0].distance(line[1]);
            if blocked < least {
                (least, best) = (blocked, line);
            }
        }
    }
}
