//! A level's tree of planes; checks that it is a tree.

use super::layout::{
    BspError, LEAVES, LUMPS, MARK_SURFACES, MODELS, NODES, PLANES, Source, TEXTURE_INFOS, TEXTURES, VERTICES, countable,
    entry,
};
use crate::FARTHEST;
use enfilade::math::geom::{Aabb, Plane};
use glam::DVec3;
use qbsp::data::nodes::BspLeafContentFlags;
use qbsp::data::util::UBspValue;
use qbsp::data::visdata::VisDataRef;
use qbsp::data::{BspLeaf, BspModel, BspNode, BspNodeRef, BspPlane, BspTexInfo};

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
    /// Air, a liquid, or a see-through solid: a fence.
    pub open: bool,
    /// Offset of its row in the visibility lump; negative for none.
    pub vis_offset: i32,
}

/// The world's tree: every node is reached once, every open leaf at most once.
#[derive(Clone, Debug)]
pub(crate) struct Tree {
    pub nodes: Vec<Node>,
    pub leaves: Vec<Leaf>,
    pub root: Child,
    /// Leaves 1 to this have rows.
    pub vis_leaves: usize,
    /// Bounds of the world.
    pub bounds: Aabb,
}

impl Tree {
    pub fn read(source: &Source<'_>) -> Result<Self, BspError> {
        // 1. Leaves, and the number of the world's.
        let mut leaves: Vec<Leaf> = source.entries::<BspLeaf>(LEAVES)?.iter().map(leaf).collect();
        let models: Vec<BspModel> = source.entries(MODELS)?;
        let world = models.first().ok_or_else(|| missing(MODELS))?;
        let vis_leaves = world.visleafs.0.unwrap_or_default() as usize;
        if leaves.first().ok_or_else(|| missing(LEAVES))?.open {
            return Err(entry(LEAVES, 0, "isn't solid"));
        }
        if vis_leaves >= leaves.len() {
            return Err(entry(
                MODELS,
                0,
                format!("has {vis_leaves} leaves, the file {} besides the solid one", leaves.len() - 1),
            ));
        }
        countable(vis_leaves)?;
        // Compilers write one leaf, 0, for all solid space. A solid leaf with a row is see-through (ericw-tools'
        // `func_detail_fence`).
        let size = source.lump(LEAVES).len() / leaves.len();
        let entries = source.lump(LEAVES).chunks_exact(size);
        for (leaf, entry) in leaves.iter_mut().zip(entries).take(vis_leaves + 1).skip(1) {
            leaf.open |= entry.starts_with(&SOLID);
        }

        // 2. Nodes with their planes.
        let planes = source.entries::<BspPlane>(PLANES)?;
        let planes = planes.iter().enumerate().map(|(i, p)| plane(i, p)).collect::<Result<Vec<_>, _>>()?;
        let nodes = source.entries::<BspNode>(NODES)?;
        let nodes = nodes.iter().enumerate().map(|(i, n)| node(i, n, &planes)).collect::<Result<Vec<_>, _>>()?;

        // 3. Extent.
        let corners = [world.bound.min, world.bound.max].into_iter().chain(source.entries(VERTICES)?);
        let bounds = Aabb::of(corners.map(point));
        let farthest = bounds.min.abs().max_element().max(bounds.max.abs().max_element());
        if !(0.0..=FARTHEST).contains(&farthest) {
            return Err(entry(MODELS, 0, "has no finite extent"));
        }

        let tree = Self { nodes, leaves, root: child(world.hulls.root), vis_leaves, bounds };
        tree.is_a_tree()?;
        Ok(tree)
    }

    fn is_a_tree(&self) -> Result<(), BspError> {
        let (mut nodes, mut leaves) = (vec![false; self.nodes.len()], vec![false; self.leaves.len()]);
        let mut open = vec![self.root];
        while let Some(next) = open.pop() {
            match next {
                Child::Node(n) => match nodes.get_mut(n) {
                    None => return Err(entry(NODES, n, "doesn't exist, but the tree leads to it")),
                    Some(true) => return Err(entry(NODES, n, "is reached twice")),
                    Some(reached) => {
                        *reached = true;
                        open.extend(self.nodes[n].children);
                    }
                },
                Child::Leaf(l) => match self.leaves.get(l) {
                    None => return Err(entry(LEAVES, l, "doesn't exist, but the tree leads to it")),
                    Some(leaf) if leaf.open && l > self.vis_leaves => {
                        let what = format!("is in the world's tree, but only the first {} have rows", self.vis_leaves);
                        return Err(entry(LEAVES, l, what));
                    }
                    Some(leaf) if leaf.open && leaves[l] => return Err(entry(LEAVES, l, "is reached twice")),
                    Some(_) => leaves[l] = true,
                },
            }
        }
        Ok(())
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

/// For each texture info, the value of `told` for its texture's lower-case name; the default without a name.
pub(crate) fn infos_with<T: Default>(source: &Source<'_>, value_of: impl Fn(&str) -> T) -> Result<Vec<T>, BspError> {
    let infos = source.entries::<BspTexInfo>(TEXTURE_INFOS)?;
    let name = |info: &BspTexInfo| info.texture_idx.0.and_then(|texture| texture_name(source, texture));
    Ok(infos.iter().map(|info| name(info).map(|name| value_of(&name)).unwrap_or_default()).collect())
}

/// Visits the faces of each leaf, leaf by leaf; `faces` is their number.
pub(crate) fn marked_faces(source: &Source<'_>, faces: usize, mut visit: impl FnMut(usize, usize)) -> Result<(), BspError> {
    let marks: Vec<UBspValue> = source.entries(MARK_SURFACES)?;
    let mut all = 0usize;
    for (i, leaf) in source.entries::<BspLeaf>(LEAVES)?.iter().enumerate() {
        let (from, count) = (leaf.face_idx.0 as usize, leaf.face_num.0 as usize);
        all = all.saturating_add(count);
        let named = marks.get(from..from.saturating_add(count)).filter(|_| all <= marks.len());
        for mark in
            named.ok_or_else(|| entry(LEAVES, i, format!("its mark surfaces go beyond the {} of the file", marks.len())))?
        {
            let face = mark.0 as usize;
            if face >= faces {
                return Err(entry(LEAVES, i, format!("its face {face} doesn't exist")));
            }
            visit(i, face);
        }
    }
    Ok(())
}

/// Maximum length of a texture's name.
const NAME: usize = 16;

/// A texture's name in lower case; `None` if it is missing.
pub(crate) fn texture_name(source: &Source<'_>, texture: u32) -> Option<String> {
    let name = texture_entry(source, texture)?.iter().take(NAME).take_while(|&&b| b != 0);
    Some(name.map(|&b| char::from(b.to_ascii_lowercase())).collect())
}

/// A texture's width and height, texels; `None` if it is missing or has no texels.
pub(super) fn texture_size(source: &Source<'_>, texture: u32) -> Option<[u32; 2]> {
    let entry = texture_entry(source, texture)?;
    let size = [word(entry, NAME)?, word(entry, NAME + 4)?];
    (!size.contains(&0)).then_some(size)
}

/// The number of textures, limited by the size of the lump.
pub(super) fn texture_names(source: &Source<'_>) -> u32 {
    let textures = source.lump(TEXTURES);
    word(textures, 0).unwrap_or(0).min(textures.len() as u32 / 4)
}

/// The lump of textures from the start of one of them.
pub(super) fn texture_entry<'a>(source: &Source<'a>, texture: u32) -> Option<&'a [u8]> {
    let textures = source.lump(TEXTURES);
    let count = word(textures, 0)?;
    let offset = word(textures, 4 + 4 * texture as usize).filter(|_| texture < count)?;
    textures.get(offset as usize..)
}

/// The number in four bytes.
pub(super) fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at.checked_add(4)?).map(|b| b.iter().rev().fold(0u32, |n, &b| n << 8 | u32::from(b)))
}

/// Contents of a solid leaf, the first bytes of its entry: -2. The `qbsp` crate also counts sky and player clips as solid.
const SOLID: [u8; 4] = (-2i32).to_le_bytes();

fn leaf(leaf: &BspLeaf) -> Leaf {
    let vis_offset = match leaf.visdata {
        VisDataRef::Offset(offset) => offset,
        VisDataRef::Cluster(_) => -1,
    };
    Leaf { open: !leaf.contents.0.contains(BspLeafContentFlags::SOLID), vis_offset }
}

/// The reader's vectors may be of another release of `glam`.
pub(crate) fn point(p: qbsp::glam::Vec3) -> DVec3 {
    DVec3::from_array(p.to_array().map(f64::from))
}

fn plane(index: usize, plane: &BspPlane) -> Result<Plane, BspError> {
    let (n, d) = (point(plane.normal), f64::from(plane.dist));
    let length = n.length();
    if !((0.9..1.1).contains(&length) && d.abs() <= FARTHEST) {
        return Err(entry(PLANES, index, "is not a plane with a unit normal"));
    }
    Ok(Plane { n: n / length, d: d / length })
}

fn node(index: usize, node: &BspNode, planes: &[Plane]) -> Result<Node, BspError> {
    let plane = planes.get(node.plane_idx as usize);
    let plane = plane.ok_or_else(|| entry(NODES, index, format!("its plane {} doesn't exist", node.plane_idx)))?;
    Ok(Node { plane: *plane, children: [child(*node.front), child(*node.back)] })
}

fn child(reference: BspNodeRef) -> Child {
    match reference {
        BspNodeRef::Node(n) => Child::Node(n as usize),
        BspNodeRef::Leaf(l) => Child::Leaf(l as usize),
    }
}

fn missing(lump: usize) -> BspError {
    BspError::Lump { lump: LUMPS[lump], what: "is empty".into() }
}
