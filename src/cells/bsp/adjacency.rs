//! The faces between leaves of the tree, and their open parts.
//!
//! Each face of a leaf behind a node's plane is pushed down the tree in front of it (as level compilers make portals). The parts without a
//! shell triangle on that plane are open (Teller 1992; for the proof of soundness see [`crate::cells::complex::coverage`]).

use super::tree::{Bsp, Child, Face, RIM, cut, reach};
use crate::cells::complex::coverage::{Open, open_part};
use crate::cells::complex::polygon::{area, convex_hull, points as corners, shape_area, width};
use crate::job::{Job, Stopped};
use crate::math::box_tree::BoxTree;
use crate::math::geom::{Aabb, Plane, clip};
use crate::math::parallel;
use crate::math::tolerance::Tolerance;
use glam::{DVec2, DVec3};
use std::borrow::Cow;

/// A plane is a wall if its normal's cosine with the vertical is below this.
const UPRIGHT: f64 = 0.9;

/// A face between two leaves.
pub struct Contact {
    /// The leaf behind the plane, the leaf in front of it.
    pub leaves: [u32; 2],
    /// The node whose plane it lies on.
    pub node: u32,
    /// The face in the plane's coordinates, counter-clockwise.
    pub polygon: Vec<DVec2>,
    /// Its open part.
    pub open: Open,
    /// Its area, and the area of the open part, square metres.
    pub area: f64,
    /// See `area`.
    pub open_area: f64,
    /// Whether an open part may belong to a hole that is certain to stay open; see [`smallest_hole`].
    pub wide: bool,
}

/// The narrowest opening that is certain to stay open, metres. Coverage shrinks it by a seal on every side, in any direction. The rest must
/// be wider than the crumbs where the planes of two adjacent triangles meet a third: if those stayed open, rock would be flooded through
/// the edges of its facets.
pub fn smallest_hole(tolerance: &Tolerance) -> f64 {
    tolerance.smallest_hole() + 8f64.sqrt() * tolerance.seal
}

/// Narrower openings get no portal, in seals. Larger than the rest of [`smallest_hole`]: guaranteed holes would get none. Smaller: each
/// crumb along the edges of facets gets one.
pub const CRUMB: f64 = 2.0;

/// Coordinates in a plane: `u x v` is its normal. On walls `v` points up.
#[derive(Clone, Copy, Debug)]
pub struct Flat {
    u: DVec3,
    v: DVec3,
    origin: DVec3,
}

impl Flat {
    /// `along` gives the first axis on floors, projected into the plane.
    pub fn new(plane: &Plane, along: DVec3) -> Self {
        let n = plane.n;
        let u = if n.y.abs() < UPRIGHT { DVec3::Y.cross(n) } else { along - n * along.dot(n) };
        let u = u.normalize();
        Self { u, v: n.cross(u), origin: n * plane.d }
    }

    /// World to plane.
    pub fn to(self, p: DVec3) -> DVec2 {
        DVec2::new(self.u.dot(p), self.v.dot(p))
    }

    /// Plane to world.
    pub fn from(self, q: DVec2) -> DVec3 {
        self.origin + self.u * q.x + self.v * q.y
    }
}

/// Spatial index of each node's covers, if there are many.
struct Covers<'b> {
    bsp: &'b Bsp,
    trees: Vec<Option<BoxTree>>,
}

/// Most covers of a node without a tree.
const FEW: usize = 12;
/// Sine of the angle between planes below which the distance of triangles from their plane matters: one degree. Smaller: slits between
/// nearly horizontal facets stay open. Larger: useless covers of other planes are tested.
const SHALLOW: f64 = 0.0175;

impl<'b> Covers<'b> {
    fn new(bsp: &'b Bsp) -> Self {
        let tree = |covers: &[Vec<DVec3>]| {
            let boxes: Vec<Aabb> = covers.iter().map(|c| Aabb::of(c.iter().copied())).collect();
            BoxTree::over(&boxes)
        };
        let trees = parallel::map(&bsp.nodes, |n| (n.covers.len() > FEW).then(|| tree(&n.covers)));
        Self { bsp, trees }
    }

    /// The polygons on a node's plane between two leaves, near a box: its own covers, the leaves' stray triangles, and the parts of other
    /// covers within `coplanar` of the plane. At a shallow angle between planes, the leaf between them extends beyond the edge of the
    /// triangles on one plane, because the planes are not exact, and so under those on the other.
    fn near(&self, node: u32, bounds: &Aabb, leaves: [u32; 2], coplanar: f64) -> Vec<Cow<'b, [DVec3]>> {
        let plane = self.bsp.nodes[node as usize].plane;
        let mut out: Vec<Cow<'b, [DVec3]>> = Vec::new();
        self.of_node(node, bounds, &mut |c| out.push(Cow::Borrowed(c)));
        let leaves = leaves.map(|l| &self.bsp.leaves[l as usize]);
        let lies = |c: &&Vec<DVec3>| c.iter().all(|&p| plane.distance(p).abs() <= coplanar);
        let stray =
            leaves.iter().flat_map(|l| &l.stray).filter(lies).filter(|c| Aabb::of(c.iter().copied()).touches(bounds));
        out.extend(stray.map(|c| Cow::Borrowed(c.as_slice())));
        let shallow = |f: &&Face| {
            let (low, high) = reach(&f.points, &plane);
            f.node != RIM && f.node != node && low <= coplanar && high >= -coplanar && {
                f.plane.n.cross(plane.n).length_squared() <= SHALLOW * SHALLOW
            }
        };
        let mut others: Vec<u32> = leaves.iter().flat_map(|l| &l.poly.faces).filter(shallow).map(|f| f.node).collect();
        others.sort_unstable();
        others.dedup();
        let (ahead, back) = (Plane { d: plane.d + coplanar, ..plane }, plane.flipped());
        let back = Plane { d: back.d + coplanar, ..back };
        for other in others {
            self.of_node(other, bounds, &mut |c| {
                let part = clip(&clip(c, &ahead, 0.0), &back, 0.0);
                out.extend((part.len() >= 3).then_some(Cow::Owned(part)));
            });
        }
        out
    }

    /// Visits covers of a node near a box, in order.
    fn of_node(&self, node: u32, bounds: &Aabb, visit: &mut impl FnMut(&'b [DVec3])) {
        let covers = &self.bsp.nodes[node as usize].covers;
        match &self.trees[node as usize] {
            Some(tree) => {
                let mut found = Vec::new();
                tree.in_box(bounds, &mut |i| found.push(i));
                found.sort_unstable();
                found.iter().for_each(|&i| visit(&covers[i as usize]));
            }
            None => covers.iter().filter(|c| Aabb::of(c.iter().copied()).touches(bounds)).for_each(|c| visit(c)),
        }
    }
}

/// All faces between leaves, by the leaf behind, ascending. `along` as for [`Flat::new`].
pub fn contacts(bsp: &Bsp, along: DVec3, tolerance: &Tolerance, work: &Job<'_>) -> Result<Vec<Contact>, Stopped> {
    let (coplanar, seal, least) = (tolerance.coplanar, tolerance.seal, tolerance.smallest_hole());
    let covers = Covers::new(bsp);
    let of_leaf = |leaf: u32| {
        let mut out = Vec::new();
        for face in &bsp.leaves[leaf as usize].poly.faces {
            if face.front || face.node == RIM || work.is_stopped() {
                continue;
            }
            let node = &bsp.nodes[face.node as usize];
            let flat = Flat::new(&node.plane, along);
            let mut found = Vec::new();
            push(bsp, node.children[1], face.points.clone(), node.plane.n, bsp.thin, &mut found);
            for (other, points) in found {
                let mut polygon: Vec<DVec2> = points.iter().map(|&p| flat.to(p)).collect();
                let mut whole = area(&polygon);
                if whole < 0.0 {
                    polygon.reverse();
                    whole = -whole;
                }
                if whole <= 0.0 {
                    continue;
                }
                let bounds = Aabb::of(points.iter().copied()).inflated(2.0 * seal);
                let near = covers.near(face.node, &bounds, [leaf, other], coplanar);
                let open = open(&polygon, &near, flat, seal);
                let open_area = match &open {
                    Open::Whole => whole,
                    Open::Parts(parts) => parts.iter().map(shape_area).sum(),
                };
                let wide = match &open {
                    Open::Whole => width(&convex_hull(polygon.clone())) >= least,
                    Open::Parts(parts) => {
                        let outer = parts.iter().filter_map(|s| s.first());
                        outer.into_iter().any(|o| width(&convex_hull(corners(o))) >= least)
                    }
                };
                out.push(Contact { leaves: [leaf, other], node: face.node, polygon, open, area: whole, open_area, wide });
            }
        }
        out
    };
    let found = parallel::flat_map_range(0..bsp.leaves.len(), |leaf| of_leaf(leaf as u32));
    work.go_on().map(|()| found)
}

/// Splits a polygon among the adjacent leaves below a child, on the side of `ahead`.
pub fn push(bsp: &Bsp, child: Child, points: Vec<DVec3>, ahead: DVec3, thin: f64, out: &mut Vec<(u32, Vec<DVec3>)>) {
    match child {
        Child::Leaf(leaf) => out.push((leaf, points)),
        Child::Node(node) => {
            let node = &bsp.nodes[node as usize];
            let (low, high) = reach(&points, &node.plane);
            // On the plane itself: the child ahead.
            let eps = 1e-3 * thin;
            if low >= -eps && high <= eps {
                let side = usize::from(node.plane.n.dot(ahead) > 0.0);
                return push(bsp, node.children[side], points, ahead, thin, out);
            }
            let [back, front] = cut(&points, &node.plane, eps);
            if back.len() >= 3 {
                push(bsp, node.children[0], back, ahead, thin, out);
            }
            if front.len() >= 3 {
                push(bsp, node.children[1], front, ahead, thin, out);
            }
        }
    }
}

fn open(polygon: &[DVec2], covers: &[Cow<'_, [DVec3]>], flat: Flat, seal: f64) -> Open {
    if covers.is_empty() {
        return Open::Whole;
    }
    let mut triangles: Vec<[DVec2; 3]> = Vec::new();
    for cover in covers {
        let q: Vec<DVec2> = cover.iter().map(|&p| flat.to(p)).collect();
        let sign = area(&q).signum();
        // Most faces are covered by one triangle.
        let inside = |p: &DVec2| {
            (0..q.len()).all(|i| {
                let e = q[(i + 1) % q.len()] - q[i];
                sign * e.perp_dot(*p - q[i]) >= -0.5 * seal * e.length()
            })
        };
        if polygon.iter().all(inside) {
            return Open::Parts(Vec::new());
        }
        triangles.extend((2..q.len()).map(|i| [q[0], q[i - 1], q[i]]));
    }
    open_part(polygon, &triangles, seal)
}
