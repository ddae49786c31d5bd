//! Splits space along the shell's planes into convex leaves: every shell triangle ends up on faces of leaves.
//!
//! Based on: Fuchs, Kedem, Naylor, *On visible surface generation by a priori tree structures*, 1980; Teller, *Visibility computations in
//! densely occluded polyhedral environments*, 1992, for cells as the leaves of such a tree. The splitting plane minimizes the expected size
//! of both halves (n log n of the triangles in each; split triangles count twice). Candidates are the planes with the most area and a few
//! others; while there are many triangles, also three planes along the main axes, so that the work stays n log n.

use super::planes::{Shell, TOUCH};
use crate::job::Job;
use crate::math::geom::{Aabb, Plane, clip};
use crate::math::parallel;
use glam::DVec3;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

/// The node of a face on the domain's boundary.
pub const RIM: u32 = u32::MAX;

/// A face of a convex polyhedron.
#[derive(Clone, Debug)]
pub struct Face {
    /// Its plane, with identical bits for all faces of one plane.
    pub plane: Plane,
    /// The polyhedron lies on the side that the plane's normal points to.
    pub front: bool,
    /// The node that made it ([`RIM`]: none). While the tree is built, its depth.
    pub node: u32,
    /// Corners in order, either way round.
    pub points: Vec<DVec3>,
}

/// A convex polyhedron.
#[derive(Clone, Debug, Default)]
pub struct Poly {
    /// Its faces.
    pub faces: Vec<Face>,
}

/// The part of a shell triangle in a part of space.
#[derive(Clone, Debug)]
pub struct Fragment {
    /// Index into the shell's planes.
    pub plane: u32,
    /// Corners, convex.
    pub points: Vec<DVec3>,
}

/// A child of a node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Child {
    /// A node.
    Node(u32),
    /// A leaf.
    Leaf(u32),
}

/// An inner node.
#[derive(Clone, Debug)]
pub struct Node {
    /// The splitting plane.
    pub plane: Plane,
    /// Polygons of the shell triangles on the plane.
    pub covers: Vec<Vec<DVec3>>,
    /// The children behind (`n . p <= d`) and in front.
    pub children: [Child; 2],
}

/// A leaf.
#[derive(Clone, Debug)]
pub struct Leaf {
    /// Its shape.
    pub poly: Poly,
    /// Shell triangles that intersect it by less than the tolerance and lie on no node.
    pub stray: Vec<Vec<DVec3>>,
    /// The number of its tile.
    pub tile: u32,
}

/// The tree.
pub struct Bsp {
    /// The root.
    pub root: Child,
    /// Nodes.
    pub nodes: Vec<Node>,
    /// Leaves.
    pub leaves: Vec<Leaf>,
    /// Least thickness on each side of a split, metres.
    pub thin: f64,
}

impl Bsp {
    /// Whether each leaf lies at the rim.
    pub fn leaves_at_rim(&self) -> Vec<bool> {
        self.leaves.iter().map(|l| l.poly.faces.iter().any(|f| f.node == RIM)).collect()
    }
}

/// A splitting plane, with its index if it belongs to a triangle.
pub type Cut = (Plane, Option<u32>);

/// Chooses the cuts between tiles, from a part of space and its fragments; `None`: this is a tile.
pub type Tiling<'t> = &'t (dyn Fn(&Poly, &[Fragment]) -> Option<Cut> + Sync);

/// Limit on a tree's size, and the job that can stop it.
pub struct Limits<'w> {
    /// Leaves at most.
    pub leaves: usize,
    /// Asked at every cut.
    pub work: &'w Job<'w>,
}

enum Tree {
    Leaf(Poly, Vec<Vec<DVec3>>),
    Tile(Box<Tree>),
    Node(Plane, Vec<Vec<DVec3>>, Box<[Tree; 2]>),
}

/// Nodes with more triangles are built in parallel, and may be split along axes.
const MANY: usize = 400;
/// Sampled triangles for the cost of a cut.
const TRIED: usize = 200;
/// Cost of a split triangle, in triangles.
const CUT: f64 = 1.5;

/// Builds the tree in `domain`; `axes` are the main directions of walls, `coplanar` in metres. Without a tiling, all is one tile. `None` if
/// it has too many leaves or was stopped.
pub fn bsp(
    shell: &Shell,
    domain: Aabb,
    axes: [DVec3; 3],
    coplanar: f64,
    tiling: Option<Tiling<'_>>,
    limits: &Limits<'_>,
) -> Option<Bsp> {
    let may = AtomicUsize::new(limits.leaves);
    let builder = Builder { planes: &shell.planes, axes, touch: TOUCH * coplanar, may, work: limits.work };
    let tree = builder.build(Poly::cuboid(domain), fragments(shell), Vec::new(), 0, tiling)?;
    let mut out = Bsp { root: Child::Leaf(0), nodes: Vec::new(), leaves: Vec::new(), thin: builder.touch };
    out.root = out.flatten(tree, &mut Vec::new(), &mut 0);
    Some(out)
}

/// Whether there are `enough` tiles with viewers; other arguments as for [`bsp`].
pub fn has_tiles(
    shell: &Shell,
    domain: Aabb,
    axes: [DVec3; 3],
    coplanar: f64,
    tiling: Tiling<'_>,
    counts: &(dyn Fn(&Poly) -> bool + Sync),
    enough: usize,
) -> bool {
    let may = AtomicUsize::new(usize::MAX);
    let builder = Builder { planes: &shell.planes, axes, touch: TOUCH * coplanar, may, work: &Job::quiet() };
    let missing = AtomicUsize::new(enough);
    builder.take_tiles(Poly::cuboid(domain), fragments(shell), tiling, counts, &missing);
    missing.into_inner() == 0
}

fn fragments(shell: &Shell) -> Vec<Fragment> {
    parallel::map(&shell.triangles, |(t, plane)| Fragment { plane: *plane, points: t.to_vec() })
}

struct Builder<'s> {
    planes: &'s [Plane],
    axes: [DVec3; 3],
    /// Points within this distance of a plane touch it, metres.
    touch: f64,
    /// Leaves left within the limit.
    may: AtomicUsize,
    work: &'s Job<'s>,
}

impl Builder<'_> {
    fn build(
        &self,
        poly: Poly,
        mut fragments: Vec<Fragment>,
        mut stray: Vec<Vec<DVec3>>,
        depth: u32,
        tiling: Option<Tiling<'_>>,
    ) -> Option<Tree> {
        if self.may.load(Relaxed) == 0 || self.work.is_stopped() {
            return None;
        }
        let first = tiling.and_then(|tiling| tiling(&poly, &fragments));
        let halves = first.and_then(|(plane, id)| Some((plane, id, poly.split(&plane, depth, self.touch)?)));
        if tiling.is_some() && halves.is_none() {
            return Some(Tree::Tile(Box::new(self.build(poly, fragments, stray, depth, None)?)));
        }
        let Some((plane, id, [back, front])) = halves.or_else(|| self.best_halves(&poly, &mut fragments, &mut stray, depth))
        else {
            // The result does not depend on the number of threads: it fails exactly if the total exceeds the limit.
            self.may.fetch_update(Relaxed, Relaxed, |n| n.checked_sub(1)).ok()?;
            return Some(Tree::Leaf(poly, stray));
        };
        let (covers, sides) = self.divide(fragments, &plane, id);
        // Stray triangles of the whole may lie on a face of either half.
        let (mut stray_behind, mut stray_before) = (Vec::new(), Vec::new());
        for points in stray {
            let (low, high) = reach(&points, &plane);
            if high >= -self.touch {
                stray_before.push(points.clone());
            }
            if low <= self.touch {
                stray_behind.push(points);
            }
        }
        let many = sides[0].len() + sides[1].len() > MANY;
        let [behind, before] = sides;
        let a = || self.build(back, behind, stray_behind, depth + 1, tiling);
        let b = || self.build(front, before, stray_before, depth + 1, tiling);
        let (a, b) = if many { parallel::join(a, b) } else { (a(), b()) };
        Some(Tree::Node(plane, covers, Box::new([a?, b?])))
    }

    /// Divides fragments into those on a plane, behind it, and in front of it; `id` is the plane's index if it belongs to a triangle.
    fn divide(&self, fragments: Vec<Fragment>, plane: &Plane, id: Option<u32>) -> (Vec<Vec<DVec3>>, [Vec<Fragment>; 2]) {
        let mut covers = Vec::new();
        let mut sides: [Vec<Fragment>; 2] = [Vec::new(), Vec::new()];
        for f in fragments {
            let (low, high) = reach(&f.points, plane);
            if Some(f.plane) == id || (low >= -self.touch && high <= self.touch) {
                covers.push(f.points);
            } else if high <= self.touch {
                sides[0].push(f);
            } else if low >= -self.touch {
                sides[1].push(f);
            } else {
                let halves = cut(&f.points, plane, 0.0);
                for (side, points) in sides.iter_mut().zip(halves) {
                    if points.len() >= 3 {
                        side.push(Fragment { plane: f.plane, points });
                    }
                }
            }
        }
        (covers, sides)
    }

    /// Decrements `missing` for each tile, until it is 0.
    fn take_tiles(
        &self,
        poly: Poly,
        fragments: Vec<Fragment>,
        tiling: Tiling<'_>,
        counts: &(dyn Fn(&Poly) -> bool + Sync),
        missing: &AtomicUsize,
    ) {
        if missing.load(Relaxed) == 0 {
            return;
        }
        let first = tiling(&poly, &fragments);
        let halves = first.and_then(|(plane, id)| Some((plane, id, poly.split(&plane, 0, self.touch)?)));
        let Some((plane, id, [back, front])) = halves else {
            if counts(&poly) {
                _ = missing.fetch_update(Relaxed, Relaxed, |n| n.checked_sub(1));
            }
            return;
        };
        let (_, [behind, before]) = self.divide(fragments, &plane, id);
        let many = behind.len() + before.len() > MANY;
        let a = || self.take_tiles(back, behind, tiling, counts, missing);
        let b = || self.take_tiles(front, before, tiling, counts, missing);
        if many {
            parallel::join(a, b);
        } else {
            a();
            b();
        }
    }

    /// The halves of the best cut; fragments that only graze this part of space go to `stray`.
    fn best_halves(
        &self,
        poly: &Poly,
        fragments: &mut Vec<Fragment>,
        stray: &mut Vec<Vec<DVec3>>,
        depth: u32,
    ) -> Option<(Plane, Option<u32>, [Poly; 2])> {
        let mut along_axes = fragments.len() > MANY;
        loop {
            let (plane, id) = self.choose(fragments, along_axes)?;
            if let Some(halves) = poly.split(&plane, depth, self.touch) {
                return Some((plane, id, halves));
            }
            along_axes &= id.is_some();
            fragments.retain_mut(|f| {
                let keep = Some(f.plane) != id;
                if !keep {
                    stray.push(std::mem::take(&mut f.points));
                }
                keep
            });
        }
    }

    /// The best cut, with the index of its plane if it belongs to a triangle.
    fn choose(&self, fragments: &[Fragment], along_axes: bool) -> Option<Cut> {
        if fragments.is_empty() {
            return None;
        }
        let mut areas: Vec<(u32, f64)> = fragments.iter().map(|f| (f.plane, crate::math::geom::area(&f.points))).collect();
        areas.sort_by_key(|a| a.0);
        areas.dedup_by(|b, a| {
            let same = a.0 == b.0;
            if same {
                a.1 += b.1;
            }
            same
        });
        if let [only] = areas[..] {
            return Some((self.planes[only.0 as usize], Some(only.0)));
        }
        let some: Vec<u32> = areas.iter().step_by(areas.len().div_ceil(6)).map(|a| a.0).collect();
        areas.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut candidates: Vec<Cut> =
            areas.iter().take(12).map(|a| a.0).chain(some).map(|i| (self.planes[i as usize], Some(i))).collect();
        let sample: Vec<&Fragment> = fragments.iter().step_by(fragments.len().div_ceil(TRIED)).collect();
        if along_axes {
            for n in self.axes {
                let mut at: Vec<f64> = sample.iter().map(|f| n.dot(f.points[0])).collect();
                let middle = at.len() / 2;
                let (_, d, _) = at.select_nth_unstable_by(middle, f64::total_cmp);
                candidates.push((Plane { n, d: *d }, None));
            }
        }
        let size = |n: f64| n * (n + 1.0).ln();
        let scale = fragments.len() as f64 / sample.len() as f64;
        let cost = |(plane, id): &Cut| {
            let (mut back, mut front, mut cut) = (0.0, 0.0, 0.0);
            for f in &sample {
                if Some(f.plane) == *id {
                    continue;
                }
                let (low, high) = reach(&f.points, plane);
                match (low < -self.touch, high > self.touch) {
                    (true, true) => cut += 1.0,
                    (true, false) => back += 1.0,
                    (false, true) => front += 1.0,
                    (false, false) => {}
                }
            }
            // An axis plane that separates nothing would be tried for ever.
            if id.is_none() && (back == 0.0 || front == 0.0) {
                return f64::INFINITY;
            }
            size((back + CUT * cut) * scale) + size((front + CUT * cut) * scale)
        };
        let best = candidates.iter().map(|c| (cost(c), c)).min_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, c)| *c)
    }
}

impl Bsp {
    fn flatten(&mut self, tree: Tree, path: &mut Vec<u32>, tile: &mut u32) -> Child {
        match tree {
            Tree::Tile(tree) => {
                *tile += 1;
                self.flatten(*tree, path, tile)
            }
            Tree::Leaf(mut poly, stray) => {
                for f in poly.faces.iter_mut().filter(|f| f.node != RIM) {
                    f.node = path[f.node as usize];
                }
                self.leaves.push(Leaf { poly, stray, tile: *tile });
                Child::Leaf(self.leaves.len() as u32 - 1)
            }
            Tree::Node(plane, covers, children) => {
                let id = self.nodes.len() as u32;
                self.nodes.push(Node { plane, covers, children: [Child::Leaf(0); 2] });
                path.push(id);
                for (side, child) in children.into_iter().enumerate() {
                    self.nodes[id as usize].children[side] = self.flatten(child, path, tile);
                }
                path.pop();
                Child::Node(id)
            }
        }
    }
}

impl Poly {
    /// A box.
    pub fn cuboid(b: Aabb) -> Self {
        let corner =
            |i: usize| DVec3::from_array(std::array::from_fn(|k| if i >> k & 1 == 0 { b.min[k] } else { b.max[k] }));
        let sides = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let faces = sides.iter().enumerate().map(|(i, s)| {
            let n = DVec3::AXES[i / 2] * if i % 2 == 0 { -1.0 } else { 1.0 };
            let points = s.map(corner).to_vec();
            Face { plane: Plane::through(points[0], n), front: false, node: RIM, points }
        });
        Self { faces: faces.collect() }
    }

    /// Its volume, cubic metres.
    pub fn volume(&self) -> f64 {
        let apex = self.middle();
        let height = |f: &Face| if f.front { -f.plane.distance(apex) } else { f.plane.distance(apex) };
        self.faces.iter().map(|f| -height(f) * crate::math::geom::area(&f.points) / 3.0).sum()
    }

    /// Box around it.
    pub fn bounds(&self) -> Aabb {
        Aabb::of(self.faces.iter().flat_map(|f| f.points.iter().copied()))
    }

    /// The mean of its faces' corners: inside it.
    pub fn middle(&self) -> DVec3 {
        let all = self.faces.iter().flat_map(|f| &f.points);
        all.clone().sum::<DVec3>() / all.count().max(1) as f64
    }

    /// The section with a plane, corners counter-clockwise seen from the tip of the normal.
    pub fn section(&self, plane: &Plane) -> Vec<DVec3> {
        let b = self.bounds();
        let centre = b.centre() - plane.n * plane.distance(b.centre());
        let (u, v) = plane.n.any_orthonormal_pair();
        let (u, v) = (u * b.diagonal(), v * b.diagonal());
        let mut section = vec![centre - u - v, centre + u - v, centre + u + v, centre - u + v];
        for f in &self.faces {
            let inside = if f.front { f.plane.flipped() } else { f.plane };
            section = clip(&section, &inside, 0.0);
        }
        section
    }

    /// The halves behind and in front of a plane; `None` if one would be thinner than `thin`.
    pub fn split(&self, plane: &Plane, node: u32, thin: f64) -> Option<[Self; 2]> {
        let (low, high) =
            self.faces.iter().map(|f| reach(&f.points, plane)).fold((0.0f64, 0.0f64), |a, r| (a.0.min(r.0), a.1.max(r.1)));
        if low > -thin || high < thin {
            return None;
        }
        let section = self.section(plane);
        if section.len() < 3 {
            return None;
        }
        let mut halves = [Self::default(), Self::default()];
        for f in &self.faces {
            // Rounding must not make a face of a side that only touches.
            for (half, points) in halves.iter_mut().zip(cut(&f.points, plane, 1e-3 * thin)) {
                if points.len() >= 3 {
                    half.faces.push(Face { points, ..*f });
                }
            }
        }
        halves[0].faces.push(Face { plane: *plane, front: false, node, points: section.clone() });
        halves[1].faces.push(Face { plane: *plane, front: true, node, points: section });
        halves.iter().all(|h| h.faces.len() >= 4).then_some(halves)
    }
}

/// The least and the greatest distance of points from a plane.
pub fn reach(points: &[DVec3], plane: &Plane) -> (f64, f64) {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for &p in points {
        let d = plane.distance(p);
        (low, high) = (low.min(d), high.max(d));
    }
    (low, high)
}

/// The parts of a convex polygon behind and in front of a plane. Corners within `eps` metres are on the plane, and belong to both parts,
/// except to a part with no other corner.
pub fn cut(points: &[DVec3], plane: &Plane, eps: f64) -> [Vec<DVec3>; 2] {
    let (low, high) = reach(points, plane);
    if high <= eps {
        return [points.to_vec(), Vec::new()];
    }
    if low >= -eps {
        return [Vec::new(), points.to_vec()];
    }
    let mut halves = [Vec::with_capacity(points.len() + 1), Vec::with_capacity(points.len() + 1)];
    for (i, &a) in points.iter().enumerate() {
        let b = points[(i + 1) % points.len()];
        let (da, db) = (plane.distance(a), plane.distance(b));
        if da <= eps {
            halves[0].push(a);
        }
        if da >= -eps {
            halves[1].push(a);
        }
        if (da > eps && db < -eps) || (da < -eps && db > eps) {
            let p = a + (b - a) * (da / (da - db));
            halves[0].push(p);
            halves[1].push(p);
        }
    }
    halves
}
