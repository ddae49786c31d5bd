//! A level's tree of planes; checks that it is a tree. Open leaves belong to cells: the leaves or clusters that have rows.

use super::error::{BspError, entry, lump as fault};
use super::file::LevelFile;
use super::layout::{Closed, Leaf as LeafRecord, Lump, Passes};
use super::record::{Field, Kind, Records, i32, u16, u32};
use crate::{FARTHEST, MOST_CLUSTERS};
use enfilade::math::geom::{Aabb, Plane};
use glam::DVec3;

/// The child of a node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Child {
    Node(usize),
    Leaf(usize),
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub plane: Plane,
    /// The child before the plane (in the direction of its normal), and the one behind.
    pub children: [Child; 2],
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Leaf {
    /// The cell that it belongs to, if sight passes it: air, a liquid, a fence, or matter that counts as detail.
    pub cell: Option<u32>,
    /// Whether it is no solid matter: what a scene of the level's faces has air in.
    pub is_open: bool,
    /// Its contents, in games whose portals depend on them; else 0.
    pub contents: i64,
    /// Offset of its row in the visibility lump, in games that keep rows by leaf; negative for none.
    pub row: i64,
}

/// The world's tree: every node is reached once, every open leaf at most once.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    pub nodes: Vec<Node>,
    pub leaves: Vec<Leaf>,
    pub root: Child,
    /// Leaves or clusters with rows.
    pub cells: usize,
    /// Bounds of the world.
    pub bounds: Aabb,
    /// What sight passes between two leaves.
    pub passes: Passes,
}

impl Tree {
    pub fn read(file: &LevelFile) -> Result<Self, BspError> {
        let layout = file.layout;
        // 1. Nodes with their planes.
        let bytes = file.lump(Lump::Planes)?;
        let planes = file.records(Lump::Planes, &bytes, layout.plane)?;
        let planes = (0..planes.len()).map(|i| plane(i, &planes)).collect::<Result<Vec<_>, _>>()?;
        let record = file.of_version(Lump::Nodes, layout.nodes)?;
        let bytes = file.lump(Lump::Nodes)?;
        let records = file.records(Lump::Nodes, &bytes, record.size)?;
        let nodes =
            (0..records.len()).map(|i| node(i, &records, record.children, &planes)).collect::<Result<Vec<_>, _>>()?;

        // 2. The world.
        let bytes = file.lump(Lump::Models)?;
        let models = file.records(Lump::Models, &bytes, layout.model.size)?;
        if models.len() == 0 {
            return Err(fault(Lump::Models, "is empty"));
        }
        let root = layout.model.head.map_or(Child::Node(0), |head| child(models.int(0, head), head.kind, nodes.len()));
        let own_leaves = layout.model.leaves.map(|field| models.index(0, field));
        let bounds = bounds(file, &models)?;

        // 3. Leaves.
        let record = file.of_version(Lump::Leaves, layout.leaves)?;
        let bytes = file.lump(Lump::Leaves)?;
        let records = file.records(Lump::Leaves, &bytes, record.size)?;
        if records.len() == 0 {
            return Err(fault(Lump::Leaves, "is empty"));
        }
        let (leaves, cells) = match own_leaves {
            Some(count) => by_leaf(file, &records, &record, count)?,
            None => by_cluster(file, &records, &record)?,
        };
        if cells as u64 > MOST_CLUSTERS {
            return Err(fault(
                Lump::Leaves,
                format!("has {cells} leaves or clusters in the world, more than {MOST_CLUSTERS}"),
            ));
        }

        let mut tree = Self { nodes, leaves, root, cells, bounds, passes: layout.passes };
        let reached = tree.reached(own_leaves.is_some())?;
        // Leaves of doors and other models name a cluster, too.
        for (leaf, _) in tree.leaves.iter_mut().zip(reached).filter(|(_, reached)| !reached) {
            leaf.cell = None;
        }
        if let Some(brushes) = record.brushes {
            tree.open_detail(&detail(file, &records, brushes)?);
            tree.join_contents();
        }
        Ok(tree)
    }

    /// The leaves that the tree reaches.
    fn reached(&self, by_leaf: bool) -> Result<Vec<bool>, BspError> {
        let (mut nodes, mut leaves) = (vec![false; self.nodes.len()], vec![false; self.leaves.len()]);
        let mut open = vec![self.root];
        while let Some(next) = open.pop() {
            match next {
                Child::Node(n) => match nodes.get_mut(n) {
                    None => return Err(entry(Lump::Nodes, n, "doesn't exist, but the tree leads to it")),
                    Some(true) => return Err(entry(Lump::Nodes, n, "is reached twice")),
                    Some(reached) => {
                        *reached = true;
                        open.extend(self.nodes[n].children);
                    }
                },
                Child::Leaf(l) => match self.leaves.get(l) {
                    None => return Err(entry(Lump::Leaves, l, "doesn't exist, but the tree leads to it")),
                    Some(leaf) if by_leaf && leaf.cell.is_some_and(|cell| cell as usize >= self.cells) => {
                        let what = format!("is in the world's tree, but only the first {} have rows", self.cells);
                        return Err(entry(Lump::Leaves, l, what));
                    }
                    Some(leaf) if leaf.cell.is_some() && leaves[l] => {
                        return Err(entry(Lump::Leaves, l, "is reached twice"));
                    }
                    Some(_) => leaves[l] = true,
                },
            }
        }
        Ok(leaves)
    }

    /// Gives leaves of solid detail to the cluster around them. Compilers split space by structure first, so a cluster is all that
    /// lies below a node; detail splits it further and hides nothing.
    fn open_detail(&mut self, is_detail: &[bool]) {
        // What lies below each node: nothing but detail, one cluster with detail, or more.
        #[derive(Clone, Copy, PartialEq)]
        enum Below {
            Detail,
            One(u32),
            More,
        }
        let mut order = Vec::new();
        let mut open = vec![self.root];
        while let Some(next) = open.pop() {
            if let Child::Node(n) = next {
                order.push(n);
                open.extend(self.nodes[n].children);
            }
        }
        let mut below = vec![Below::More; self.nodes.len()];
        let of = |child: Child, below: &[Below], leaves: &[Leaf]| match child {
            Child::Node(n) => below[n],
            Child::Leaf(l) => match leaves[l].cell {
                Some(cell) => Below::One(cell),
                None if is_detail[l] => Below::Detail,
                None => Below::More,
            },
        };
        for &n in order.iter().rev() {
            below[n] = match self.nodes[n].children.map(|child| of(child, &below, &self.leaves)) {
                [a, Below::Detail] | [Below::Detail, a] => a,
                [a, b] if a == b => a,
                _ => Below::More,
            };
        }
        // From the top: below a node of one cluster, all is that cluster's.
        let mut open = vec![(self.root, None)];
        while let Some((next, cluster)) = open.pop() {
            match next {
                Child::Leaf(l) => self.leaves[l].cell = self.leaves[l].cell.or(cluster.filter(|_| is_detail[l])),
                Child::Node(n) => {
                    let cluster = cluster.or(if let Below::One(cell) = below[n] { Some(cell) } else { None });
                    open.extend(self.nodes[n].children.map(|child| (child, cluster)));
                }
            }
        }
    }

    /// A cluster has the contents of all its leaves: its border is looked through if it is anywhere.
    fn join_contents(&mut self) {
        let mut all = vec![0; self.cells];
        for leaf in &self.leaves {
            if let Some(cell) = leaf.cell {
                all[cell as usize] |= leaf.contents & !SOLID_BIT;
            }
        }
        for leaf in &mut self.leaves {
            leaf.contents = leaf.cell.map_or(leaf.contents, |cell| all[cell as usize]);
        }
    }

    /// The tree for a scene of the level's faces: each leaf is a cell, leaf `i + 1` cell `i`. Liquids are looked through, and
    /// so is solid detail unless it is a wall ([`super::layout::Layout::detail_is_wall`]).
    pub fn of_faces(&self, detail_is_wall: bool) -> Self {
        let mut tree = Self { passes: Passes::All, ..self.clone() };
        for (l, leaf) in tree.leaves.iter_mut().enumerate() {
            leaf.cell = (l as u32).checked_sub(1).filter(|_| (leaf.is_open || !detail_is_wall) && leaf.cell.is_some());
        }
        let last = tree.leaves.iter().filter_map(|leaf| leaf.cell).max();
        tree.cells = self.cells.max(last.map_or(0, |last| last as usize + 1));
        tree
    }

    /// The leaf at a point.
    pub fn leaf_at(&self, p: DVec3) -> usize {
        let mut at = self.root;
        loop {
            match at {
                Child::Leaf(leaf) => return leaf,
                Child::Node(n) => {
                    let node = &self.nodes[n];
                    at = node.children[usize::from(node.plane.distance(p) < 0.0)];
                }
            }
        }
    }

    /// Error of `f32` planes within the level: half a unit in the last place of a distance as large as the extent, and as much
    /// for each of the three components of a normal.
    pub fn rounding(&self) -> f64 {
        let extent = self.bounds.min.abs().max_element().max(self.bounds.max.abs().max_element());
        4.0 * extent * f64::from(f32::EPSILON) * 0.5
    }
}

/// Contents of a solid leaf in games that keep rows by leaf.
const SOLID: i64 = -2;
/// And of sky, behind which nothing is drawn.
const SKY: i64 = -6;
/// The lowest bit of contents: solid; and the bit of detail, in later games.
const SOLID_BIT: i64 = 1;
const DETAIL_BIT: i64 = 0x800_0000;

/// Leaves of games that keep rows by leaf: leaf `i + 1` is cell `i`.
fn by_leaf(
    file: &LevelFile,
    records: &Records<'_>,
    record: &LeafRecord,
    count: usize,
) -> Result<(Vec<Leaf>, usize), BspError> {
    let Closed::Contents(closed) = file.layout.closed else { return Err(fault(Lump::Leaves, "has no contents")) };
    let contents = |leaf: usize| records.int(leaf, i32(0));
    if !closed.contains(&contents(0)) {
        return Err(entry(Lump::Leaves, 0, "isn't solid"));
    }
    if count >= records.len() {
        let what = format!("has {count} leaves, the file {} besides the solid one", records.len() - 1);
        return Err(entry(Lump::Models, 0, what));
    }
    let leaf = |l: usize| {
        // Compilers write one leaf, 0, for all solid space. A solid leaf with a row is see-through (ericw-tools'
        // `func_detail_fence`).
        let is_fence = contents(l) == SOLID && (1..=count).contains(&l);
        let is_open = !closed.contains(&contents(l)) || is_fence;
        let cell = is_open.then(|| (l as u32).wrapping_sub(1));
        Leaf { cell, is_open: is_open && contents(l) != SKY, contents: contents(l), row: records.int(l, record.row) }
    };
    Ok(((0..records.len()).map(leaf).collect(), count))
}

/// Leaves of games that keep rows by cluster.
fn by_cluster(file: &LevelFile, records: &Records<'_>, record: &LeafRecord) -> Result<(Vec<Leaf>, usize), BspError> {
    let leaf = |l: usize| {
        let cluster = u32::try_from(records.int(l, record.row)).ok();
        let is_solid = file.layout.closed == Closed::SolidBit && records.int(l, i32(0)) & SOLID_BIT != 0;
        let contents = if file.layout.closed == Closed::SolidBit { records.int(l, i32(0)) } else { 0 };
        Leaf { cell: cluster.filter(|_| !is_solid), is_open: cluster.is_some() && !is_solid, contents, row: -1 }
    };
    let leaves: Vec<Leaf> = (0..records.len()).map(leaf).collect();
    // Before vis the lump is empty, and the leaves alone tell.
    let vis = file.lump(Lump::Visibility)?;
    let named = leaves.iter().filter_map(|leaf| leaf.cell).max().map_or(0, |last| last as usize + 1);
    let cells = if vis.len() < 4 { named } else { file.records(Lump::Visibility, &vis[..4], 4)?.index(0, u32(0)) };
    if let Some(l) = leaves.iter().position(|leaf| leaf.cell.is_some_and(|cell| cell as usize >= cells)) {
        return Err(entry(Lump::Leaves, l, format!("is in cluster {}, but the level has {cells}", named - 1)));
    }
    // Each cluster has a leaf.
    if cells > leaves.len() {
        return Err(fault(Lump::Leaves, format!("has {} leaves, too few for {cells} clusters", leaves.len())));
    }
    Ok((leaves, cells))
}

/// Leaves whose brushes are all detail.
fn detail(file: &LevelFile, leaves: &Records<'_>, of_leaf: [Field; 2]) -> Result<Vec<bool>, BspError> {
    let bytes = file.lump(Lump::Brushes)?;
    let brushes = file.records(Lump::Brushes, &bytes, 12)?;
    let is_detail: Vec<bool> = (0..brushes.len()).map(|b| brushes.int(b, i32(8)) & DETAIL_BIT != 0).collect();
    let bytes = file.lump(Lump::LeafBrushes)?;
    let field = if of_leaf[0].kind == Kind::U16 { u16(0) } else { u32(0) };
    let list = file.records(Lump::LeafBrushes, &bytes, field.size())?;
    // How many of the first entries are detail, so that a leaf asks for two numbers.
    let mut before = vec![0usize];
    for at in 0..list.len() {
        let more = is_detail.get(list.index(at, field)) == Some(&true);
        before.push(before[at] + usize::from(more));
    }
    if list.len() == 0 {
        // A file without brushes tells of no detail.
        return Ok(vec![false; leaves.len()]);
    }
    let all_detail = |leaf: usize| {
        let (first, count) = (leaves.index(leaf, of_leaf[0]), leaves.index(leaf, of_leaf[1]));
        let end = first.saturating_add(count);
        if end > list.len() {
            return Err(entry(Lump::Leaves, leaf, format!("its brushes go beyond the {} of the file", list.len())));
        }
        Ok(count > 0 && before[end] - before[first] == count)
    };
    (0..leaves.len()).map(all_detail).collect()
}

/// The world's extent: its box, and the vertices of faces.
fn bounds(file: &LevelFile, models: &Records<'_>) -> Result<Aabb, BspError> {
    let bytes = file.lump(Lump::Vertices)?;
    let vertices = file.records(Lump::Vertices, &bytes, file.layout.vertex)?;
    let mut corners = vec![models.point(0, 0), models.point(0, 12)];
    corners.extend((0..vertices.len()).map(|v| vertices.point(v, 0)));
    let bounds = Aabb::of(corners);
    let farthest = bounds.min.abs().max_element().max(bounds.max.abs().max_element());
    if !(0.0..=FARTHEST).contains(&farthest) {
        return Err(entry(Lump::Models, 0, "has no finite extent"));
    }
    Ok(bounds)
}

fn plane(index: usize, planes: &Records<'_>) -> Result<Plane, BspError> {
    let (n, d) = (planes.point(index, 0), planes.float(index, 12));
    let length = n.length();
    if !((0.9..1.1).contains(&length) && d.abs() <= FARTHEST) {
        return Err(entry(Lump::Planes, index, "is not a plane with a unit normal"));
    }
    Ok(Plane { n: n / length, d: d / length })
}

fn node(index: usize, nodes: &Records<'_>, children: [Field; 2], planes: &[Plane]) -> Result<Node, BspError> {
    let number = nodes.int(index, i32(0));
    let plane = usize::try_from(number).ok().and_then(|n| planes.get(n));
    let plane = plane.ok_or_else(|| entry(Lump::Nodes, index, format!("its plane {number} doesn't exist")))?;
    let children = children.map(|field| child(nodes.int(index, field), field.kind, nodes.len()));
    Ok(Node { plane: *plane, children })
}

/// See [`super::layout::Node`].
fn child(value: i64, kind: Kind, nodes: usize) -> Child {
    let is_node = if kind == Kind::U16 { (value as usize) < nodes.max(0x8000) } else { value >= 0 };
    match (is_node, kind) {
        (true, _) => Child::Node(value as usize),
        (false, Kind::U16) => Child::Leaf((0xffff - value) as usize),
        (false, _) => Child::Leaf((-1 - value) as usize),
    }
}
