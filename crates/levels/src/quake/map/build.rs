//! The tree of a map: planes of the visible faces of structural brushes, down to leaves that are entirely open or solid.
//!
//! Based on: Fuchs, Kedem, Naylor, *On visible surface generation by a priori tree structures*, 1980. Planes are chosen as in
//! level compilers since Carmack, 1996: those that cut few faces, and axial planes before slanted ones.
//!
//! A leaf is solid if its centre is inside a brush. Every face of the brushes' union is on a plane of the tree, so no face
//! crosses a leaf, and all its points are alike.

use super::brush::{Brush, ON};
use super::union::{Part, reach};
use crate::bsp::layout::Passes;
use crate::bsp::portals::region_faces;
use crate::bsp::tree::{Child, Leaf, Node, Tree};
use enfilade::math::geom::{Aabb, Plane, clip};
use glam::DVec3;
use std::collections::HashMap;

/// Maximum depth. Deeper: a hostile file takes memory squared in its size. Less: large levels are refused.
const DEEPEST: usize = 1000;
/// Maximum nodes. More: intersecting slanted brushes exceed the memory. Fewer: large levels are refused.
const MOST_NODES: usize = 1 << 20;
/// Cost of a cut face, in faces of imbalance.
const CUT: usize = 8;
/// Cost of a slanted plane, in cut faces.
const SLANTED: usize = 2;
/// Limit of planes times faces tested at a node. More: the top nodes of a large map take minutes. Fewer: more faces are cut.
const TRIED: usize = 1 << 22;

/// A part of a face, and the number of its plane, shared by both orientations.
struct Face {
    plane: usize,
    winding: Vec<DVec3>,
}

/// A subtree to build.
struct Work {
    faces: Vec<Face>,
    /// Half-spaces from the root down.
    way: Vec<Plane>,
    /// The parent node, and the index of this child.
    parent: Option<(usize, usize)>,
}

/// Builds the tree of `parts`, the visible faces of `brushes`, and of faces that must lie between leaves. Open leaves are
/// numbered from 1; leaf 0 is all solid space.
pub(super) fn tree(parts: &[Part], between: &[Part], brushes: &[Brush], bounds: Aabb) -> Result<Tree, String> {
    let (planes, faces) = numbered(parts.iter().chain(between));
    let solid = Leaf { cell: None, is_open: false, contents: 0, row: -1 };
    let mut tree =
        Tree { nodes: Vec::new(), leaves: vec![solid], root: Child::Leaf(0), cells: 0, bounds, passes: Passes::All };
    let mut stack = vec![Work { faces, way: Vec::new(), parent: None }];
    while let Some(Work { faces, way, parent }) = stack.pop() {
        let child = match choose(&faces, &planes) {
            None => Child::Leaf(leaf(&mut tree, brushes, &way)),
            Some(chosen) => {
                if way.len() >= DEEPEST || tree.nodes.len() >= MOST_NODES {
                    return Err(format!("needs a tree of more than {MOST_NODES} nodes, or deeper than {DEEPEST}"));
                }
                let plane = planes[chosen];
                let node = tree.nodes.len();
                tree.nodes.push(Node { plane, children: [Child::Leaf(0); 2] });
                let [front, back] = divided(faces, chosen, &plane);
                let beyond = |half_space: Plane| way.iter().copied().chain([half_space]).collect();
                stack.push(Work { faces: back, way: beyond(plane), parent: Some((node, 1)) });
                stack.push(Work { faces: front, way: beyond(plane.flipped()), parent: Some((node, 0)) });
                Child::Node(node)
            }
        };
        match parent {
            Some((node, side)) => tree.nodes[node].children[side] = child,
            None => tree.root = child,
        }
    }
    tree.cells = tree.leaves.len() - 1;
    Ok(tree)
}

/// The planes of all parts, each once in either orientation.
fn numbered<'p>(parts: impl Iterator<Item = &'p Part>) -> (Vec<Plane>, Vec<Face>) {
    let (mut planes, mut known): (Vec<Plane>, HashMap<[i64; 4], usize>) = (Vec::new(), HashMap::new());
    let face = |part: &Part| {
        let plane = upright(part.plane);
        let key = [plane.n.x * 1e6, plane.n.y * 1e6, plane.n.z * 1e6, plane.d / ON].map(|x| x.round() as i64);
        let number = *known.entry(key).or_insert_with(|| {
            planes.push(plane);
            planes.len() - 1
        });
        Face { plane: number, winding: part.winding.clone() }
    };
    let faces = parts.map(face).collect();
    (planes, faces)
}

/// The orientation of a plane in which the largest component of its normal is positive.
fn upright(plane: Plane) -> Plane {
    let n = plane.n.to_array();
    let greatest = n.iter().fold(0.0f64, |a, &b| if b.abs() > a.abs() { b } else { a });
    if greatest < 0.0 { plane.flipped() } else { plane }
}

/// The number of the best splitting plane; `None` without faces.
fn choose(faces: &[Face], planes: &[Plane]) -> Option<usize> {
    let mut numbers: Vec<usize> = faces.iter().map(|face| face.plane).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let step = (numbers.len() * faces.len()).div_ceil(TRIED).max(1);
    let cost = |&number: &usize| {
        let plane = &planes[number];
        let (mut front, mut back, mut cut) = (0usize, 0, 0);
        for face in faces.iter().filter(|face| face.plane != number) {
            let (least, most) = reach(&face.winding, plane);
            match (least < -ON, most > ON) {
                (true, true) => cut += 1,
                (true, false) => back += 1,
                (false, _) => front += 1,
            }
        }
        let is_slanted = plane.n.abs().max_element() < 1.0;
        (CUT * (cut + usize::from(is_slanted) * SLANTED) + front.abs_diff(back), number)
    };
    numbers.iter().step_by(step).min_by_key(|number| cost(number)).copied()
}

/// The parts of faces before and behind a plane; faces in the plane are dropped.
fn divided(faces: Vec<Face>, chosen: usize, plane: &Plane) -> [Vec<Face>; 2] {
    let [mut front, mut back] = [Vec::new(), Vec::new()];
    for face in faces {
        let (least, most) = reach(&face.winding, plane);
        match (least < -ON, most > ON) {
            _ if face.plane == chosen => {}
            (true, true) => {
                back.push(Face { winding: clip(&face.winding, plane, 0.0), ..face });
                front.push(Face { winding: clip(&face.winding, &plane.flipped(), 0.0), ..face });
            }
            (true, false) => back.push(face),
            (false, true) => front.push(face),
            (false, false) => {}
        }
    }
    [front, back]
}

/// The number of the leaf inside `way`.
fn leaf(tree: &mut Tree, brushes: &[Brush], way: &[Plane]) -> usize {
    let corners: Vec<DVec3> = region_faces(way, &tree.bounds).concat();
    let middle = enfilade::math::geom::middle(&corners);
    // A region without volume counts as solid.
    if corners.is_empty() || brushes.iter().any(|brush| brush.holds(middle)) {
        return 0;
    }
    let leaf = tree.leaves.len();
    tree.leaves.push(Leaf { cell: Some(leaf as u32 - 1), is_open: true, contents: 0, row: -1 });
    leaf
}
