//! Portals between the leaves of a tree.
//!
//! Based on: level compilers since J. Carmack's qbsp (1996). A node's plane, clipped to the convex region that the node splits,
//! is the boundary of its two sides; pushed down both subtrees, it splits into the faces between leaves.
//!
//! Deviations: windings are cut from the planes above a node each time, in `f64`, not split and passed on, so that rounding does
//! not add up. No cut treats points within 0.1 units as on the plane, nor drops a face for its short edges. Only faces that the
//! file cannot represent are left out: planes are written in `f32`, so leaves that met in an edge in the compiler overlap by a
//! rounding. Narrower faces ([`super::Bsp::rounding`], 0.001 units in a level of 4096) are such slivers, and are counted.

use super::tree::{Child, Tree};
use enfilade::math::geom::{Aabb, Plane, clip};
use enfilade::types::level::LevelPortal;
use glam::DVec3;

/// Space around the level, in its units: the outside of a leaking level is as open as its inside.
const MARGIN: f64 = 64.0;
/// Points within this distance of a plane lie in it, as a fraction of the extent: a thousand times the rounding of `f64`, a
/// hundred thousandth of that of `f32`.
const ON_PLANE: f64 = 1e-12;

/// A winding in a leaf.
pub(crate) struct Piece {
    pub leaf: usize,
    /// `None` for a closed leaf.
    pub cell: Option<u32>,
    pub winding: Vec<DVec3>,
}

/// Faces between the leaves of a tree.
pub(crate) struct Between {
    /// Between open leaves of two cells.
    pub portals: Vec<LevelPortal>,
    /// Between open and solid leaves, counter-clockwise seen from the open one.
    pub walls: Vec<Vec<DVec3>>,
    /// Number of skipped slivers.
    pub slivers: usize,
}

/// The portals of a tree's open leaves, and with `with_walls` the walls.
pub(crate) fn derive(tree: &Tree, with_walls: bool) -> Between {
    let bounds = tree.bounds.inflated(MARGIN);
    let (eps, narrow) = (bounds.diagonal() * ON_PLANE, tree.rounding());
    let contents = |leaf: usize| tree.leaves[leaf].contents;
    let mut out = Between { portals: Vec::new(), walls: Vec::new(), slivers: 0 };
    // Half-spaces on the path from the root, and the depth that the next child shares.
    let mut way: Vec<Plane> = Vec::new();
    let mut stack = vec![(tree.root, None, 0)];
    while let Some((child, half_space, depth)) = stack.pop() {
        way.truncate(depth);
        way.extend(half_space);
        let Child::Node(n) = child else { continue };
        let node = &tree.nodes[n];
        let below = way.len();
        // The back first, so that the front is on top. Inside is below a plane, so the front has the flipped half-space.
        stack.push((node.children[1], Some(node.plane), below));
        stack.push((node.children[0], Some(node.plane.flipped()), below));

        let Some(face) = face(&node.plane, &bounds, &way, eps) else { continue };
        for front in sink(tree, node.children[0], face, &node.plane.flipped(), eps, with_walls) {
            for back in sink(tree, node.children[1], front.winding, &node.plane, eps, with_walls && front.cell.is_some()) {
                let is_sliver = width(&back.winding, node.plane.n) < narrow;
                match back.cell.zip(front.cell) {
                    // Parts of one cluster.
                    Some((back, front)) if back == front => {}
                    Some(_) if !tree.passes.between(contents(back.leaf), contents(front.leaf)) => {}
                    Some(_) if is_sliver => out.slivers += 1,
                    Some((back_cell, front_cell)) => {
                        out.portals.push(LevelPortal { cells: [back_cell, front_cell], winding: back.winding });
                    }
                    None if is_sliver => {}
                    None if back.cell.is_some() => out.walls.push(back.winding.into_iter().rev().collect()),
                    None => out.walls.push(back.winding),
                }
            }
        }
    }
    out
}

/// The faces of a region within bounds.
pub(crate) fn region_faces(way: &[Plane], bounds: &Aabb) -> Vec<Vec<DVec3>> {
    let bounds = bounds.inflated(MARGIN);
    let eps = bounds.diagonal() * ON_PLANE;
    let sides = box_planes(&bounds);
    let all: Vec<Plane> = way.iter().copied().chain(sides).collect();
    let others = |i: usize| all.iter().enumerate().filter(move |&(j, _)| j != i).map(|(_, plane)| *plane);
    let faces = all.iter().enumerate().map(|(i, plane)| others(i).fold(square(plane, &bounds), |w, p| clip(&w, &p, eps)));
    faces.filter(|face| !face.is_empty()).collect()
}

fn box_planes(bounds: &Aabb) -> [Plane; 6] {
    let [x, y, z] = DVec3::AXES.map(|n| [Plane { n, d: n.dot(bounds.max) }, Plane { n: -n, d: -n.dot(bounds.min) }]);
    [x[0], x[1], y[0], y[1], z[0], z[1]]
}

/// The part of a plane within a region; `None` if it only touches it. Counter-clockwise as seen from the tip of its normal.
fn face(plane: &Plane, bounds: &Aabb, way: &[Plane], eps: f64) -> Option<Vec<DVec3>> {
    let mut winding = square(plane, bounds);
    for half_space in box_planes(bounds).into_iter().chain(way.iter().copied()) {
        winding = clip(&winding, &half_space, eps);
        if winding.iter().all(|&p| half_space.distance(p) >= -eps) {
            return None;
        }
    }
    Some(winding)
}

/// A square of a plane that extends beyond the bounds.
pub(crate) fn square(plane: &Plane, bounds: &Aabb) -> Vec<DVec3> {
    let centre = bounds.centre();
    let middle = centre - plane.n * plane.distance(centre);
    let u = plane.n.any_orthonormal_vector();
    let v = plane.n.cross(u);
    let reach = bounds.diagonal();
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| middle + u * (a * reach) + v * (b * reach)).into()
}

/// Pushes a winding down a subtree. `inside` is its plane: the subtree is on the inner side, which decides at an equal plane.
/// With `with_solid`, pieces in solid leaves are kept, too.
pub(crate) fn sink(tree: &Tree, from: Child, winding: Vec<DVec3>, inside: &Plane, eps: f64, with_solid: bool) -> Vec<Piece> {
    let (mut pieces, mut stack) = (Vec::new(), vec![(from, winding)]);
    while let Some((child, winding)) = stack.pop() {
        let node = match child {
            Child::Node(n) => &tree.nodes[n],
            Child::Leaf(leaf) => {
                let cell = tree.leaves[leaf].cell;
                if cell.is_some() || with_solid {
                    pieces.push(Piece { leaf, cell, winding });
                }
                continue;
            }
        };
        let [front, back] = node.children;
        let (least, most) =
            winding.iter().map(|&p| node.plane.distance(p)).fold((f64::MAX, f64::MIN), |(a, b), d| (a.min(d), b.max(d)));
        if least >= -eps && most <= eps {
            // The same plane. The subtree is below `inside`.
            stack.push((if node.plane.n.dot(inside.n) < 0.0 { front } else { back }, winding));
        } else if least >= -eps {
            stack.push((front, winding));
        } else if most <= eps {
            stack.push((back, winding));
        } else {
            stack.push((back, clip(&winding, &node.plane, eps)));
            stack.push((front, clip(&winding, &node.plane.flipped(), eps)));
        }
    }
    pieces
}

/// The least distance of two parallel lines around a convex winding.
pub(crate) fn width(winding: &[DVec3], normal: DVec3) -> f64 {
    let edges = winding.iter().zip(winding.iter().cycle().skip(1));
    let across = edges.filter_map(|(&a, &b)| {
        let inwards = normal.cross(b - a).try_normalize()?;
        Some(winding.iter().map(|p| inwards.dot(*p - a)).fold(0.0, f64::max))
    });
    across.fold(f64::MAX, f64::min)
}
