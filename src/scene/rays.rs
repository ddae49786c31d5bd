//! Ray queries on a scene's triangles.
//!
//! Based on: Woop, Benthin, Wald, *Watertight ray/triangle intersection*, 2013 (the sheared edge functions, here in `f64`, so
//! that a ray at an edge or corner shared by triangles with the same vertices hits one of them); Ericson, *Real-time collision
//! detection*, 2005 (closest points of points, segments and triangles).
//!
//! [`RayScene`] keeps two hierarchies (obvhs): opaque triangles, which stop a ray, and see-through ones, which it passes and reports. Box
//! tests use `f32`, with padding above the rounding error; hits are computed in `f64` on the original triangles, so a result depends on the
//! triangles alone, not on the hierarchy. The traversal of the binary tree is our own: the capsule query of [`RayScene::is_clear`] needs
//! grown boxes and a stack that cannot overflow.

mod distance;

use super::Scene;
use crate::ObjectId;
use crate::math::bvh;
use crate::math::geom::Aabb;
use crate::math::tolerance::Tolerance;
pub use distance::closest_on_triangle;
use distance::comes_within;
use glam::{DVec3, Vec3A};
use obvhs::bvh2::Bvh2;
use obvhs::ray::Ray;
use std::sync::OnceLock;

/// A hit of a ray.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit {
    /// Distance along the ray in units of its direction's length.
    pub t: f64,
    /// Index into [`Scene::triangles`].
    pub triangle: u32,
    /// The triangle's object.
    pub object: ObjectId,
}

/// A scene prepared for ray queries.
pub struct RayScene<'s> {
    scene: &'s Scene,
    /// The scene's box, cached because it visits every object.
    bounds: Aabb,
    holes: Vec<Vec<DVec3>>,
    /// Includes triangles of closed holes, numbered after the scene's last. Both trees are built at the first ray, because that takes
    /// seconds for a large scene.
    opaque: OnceLock<Tree>,
    glass: OnceLock<Tree>,
}

impl<'s> RayScene<'s> {
    /// The hierarchies are built at the first ray; the same scene gives the same results.
    pub fn new(scene: &'s Scene) -> Self {
        Self::with_closed_holes(scene, &[])
    }

    /// As [`RayScene::new`], with additional opaque convex polygons. They belong to no object: rays end there without a hit.
    pub fn with_closed_holes(scene: &'s Scene, holes: &[Vec<DVec3>]) -> Self {
        Self { scene, bounds: scene.bounds(), holes: holes.to_vec(), opaque: OnceLock::new(), glass: OnceLock::new() }
    }

    fn opaque(&self) -> &Tree {
        self.opaque.get_or_init(|| Tree::new(self.scene, true, &self.holes))
    }

    fn glass(&self) -> &Tree {
        self.glass.get_or_init(|| Tree::new(self.scene, false, &[]))
    }

    /// The scene.
    pub fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// Box around everything.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The tolerances that fit the scene's size.
    pub fn tolerance(&self) -> Tolerance {
        Tolerance::for_extent(self.bounds.diagonal())
    }

    /// First opaque triangle hit by `origin + t * direction` for `0 < t <= limit`, from either side; of several at one place, the first of
    /// the scene. `limit` may be infinite. A ray in a triangle's plane misses it.
    pub fn first_opaque(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<Hit> {
        let (t, triangle) = self.nearest(origin, direction, limit).filter(|&(_, triangle)| !self.is_hole(triangle))?;
        Some(Hit { t, triangle, object: self.opaque().owner(self.scene, triangle) })
    }

    /// True if the ray first hits a closed hole.
    pub fn ends_at_hole(&self, origin: DVec3, direction: DVec3, limit: f64) -> bool {
        !self.holes.is_empty() && self.nearest(origin, direction, limit).is_some_and(|(_, triangle)| self.is_hole(triangle))
    }

    fn is_hole(&self, triangle: u32) -> bool {
        triangle as usize >= self.scene.triangles.len()
    }

    /// The first hit on a triangle of the scene or of a closed hole.
    fn nearest(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<(f64, u32)> {
        let tree = self.opaque();
        let (ray, start, length) = tree.enter(origin, direction, limit, 0.0)?;
        let sheared = Sheared::new(origin, direction);
        let mut best: Option<(f64, u32)> = None;
        tree.walk(ray, 0.0, |slots, far| {
            for slot in slots {
                let id = tree.triangles[slot];
                let Some(t) = sheared.hit(&tree.corners[slot]) else { continue };
                if t > 0.0 && t <= limit && best.is_none_or(|(bt, bid)| t < bt || (t == bt && id < bid)) {
                    best = Some((t, id));
                    // Boxes are padded by more than this rounding.
                    *far = ((t * length - start) as f32).max(0.0) + tree.pad as f32;
                }
            }
            true
        });
        best
    }

    /// Intersection of `origin + t * direction` with this triangle for `t > 0`, from either side, ignoring all others.
    pub fn meets(&self, origin: DVec3, direction: DVec3, triangle: u32) -> Option<Hit> {
        let t = meets_triangle(origin, direction, &self.scene.corners(triangle as usize))?;
        Some(Hit { t, triangle, object: self.scene.object_of(triangle as usize) })
    }

    /// Appends every see-through object that the ray hits for `0 < t <= limit`, before a closed hole, to `out`; each once, nearest first.
    pub fn see_through(&self, origin: DVec3, direction: DVec3, limit: f64, out: &mut Vec<Hit>) {
        let tree = self.glass();
        let hole = if !self.holes.is_empty() {
            self.nearest(origin, direction, limit).filter(|&(_, id)| self.is_hole(id))
        } else {
            None
        };
        let limit = hole.map_or(limit, |(t, _)| t);
        let Some((ray, ..)) = tree.enter(origin, direction, limit, 0.0) else { return };
        let sheared = Sheared::new(origin, direction);
        let first = out.len();
        tree.walk(ray, 0.0, |slots, _| {
            for slot in slots {
                let triangle = tree.triangles[slot];
                match sheared.hit(&tree.corners[slot]) {
                    Some(t) if t > 0.0 && t <= limit => {
                        out.push(Hit { t, triangle, object: tree.owner(self.scene, triangle) });
                    }
                    _ => {}
                }
            }
            true
        });
        out[first..].sort_by(|a, b| a.object.cmp(&b.object).then(a.t.total_cmp(&b.t)).then(a.triangle.cmp(&b.triangle)));
        let mut last = None;
        let mut kept = first;
        for i in first..out.len() {
            if last.replace(out[i].object) != Some(out[i].object) {
                out[kept] = out[i];
                kept += 1;
            }
        }
        out.truncate(kept);
        out[first..].sort_by(|a, b| a.t.total_cmp(&b.t).then(a.object.cmp(&b.object)));
    }

    /// True if the segment from `a` to `b` is clear of every opaque triangle except those of `target`:
    ///
    /// * the segment without `2 * clearance` metres at each end keeps more than `clearance` metres from all of them, and
    /// * the segment without `clearance` metres at the end `b` crosses none of them.
    ///
    /// So a segment may start beside a wall and end on a surface, but no ray through a crack between two triangles of a closed wall passes.
    /// `target`'s own triangles never count: an object does not hide itself. False if a number is not finite.
    pub fn is_clear(&self, a: DVec3, b: DVec3, clearance: f64, target: Option<ObjectId>) -> bool {
        let length = a.distance(b);
        if length <= clearance || !length.is_finite() {
            return length.is_finite();
        }
        let unit = (b - a) / length;
        let skip = |tree: &Tree, slot: usize| target.is_some_and(|o| self.owns(o, tree.triangles[slot]));
        let before = b - unit * clearance;
        let (from, to) = (a + unit * (2.0 * clearance), b - unit * (2.0 * clearance));
        let core = length > 4.0 * clearance;
        let sheared = Sheared::new(a, before - a);
        let tree = self.opaque();
        let Some((ray, ..)) = tree.enter(a, unit, length, clearance) else { return true };
        tree.walk(ray, clearance, |slots, _| {
            for slot in slots {
                let corners = &tree.corners[slot];
                let blocks = (core && comes_within(from, to, corners, clearance))
                    || sheared.hit(corners).is_some_and(|t| t > 0.0 && t <= 1.0);
                if blocks && !skip(tree, slot) {
                    return false;
                }
            }
            true
        })
    }

    /// True if every point of the closed segment from `a` to `b` is more than `clearance` metres from every opaque triangle. In a sound
    /// [`crate::cells::CellGraph`], such a segment stays in cells and goes from cell to cell through portals only. False if a number is not
    /// finite.
    pub fn keeps_clearance(&self, a: DVec3, b: DVec3, clearance: f64) -> bool {
        let length = a.distance(b);
        if !length.is_finite() {
            return false;
        }
        let tree = self.opaque();
        let unit = if length > 0.0 { (b - a) / length } else { DVec3::X };
        let Some((ray, ..)) = tree.enter(a, unit, length, clearance) else { return true };
        tree.walk(ray, clearance, |mut slots, _| !slots.any(|slot| comes_within(a, b, &tree.corners[slot], clearance)))
    }

    /// True if `p` is within `distance` metres of a triangle of `object`.
    pub fn is_near(&self, p: DVec3, object: ObjectId, distance: f64) -> bool {
        let object = &self.scene.objects[object.index()];
        object.bounds.inflated(distance).contains(p)
            && object.triangles.clone().any(|t| {
                let corners = self.scene.corners(t as usize);
                (p - closest_on_triangle(p, &corners)).length_squared() <= distance * distance
            })
    }

    /// True if `p` is within `distance` metres of a triangle of an opaque object that `counts`.
    pub fn is_near_opaque(&self, p: DVec3, distance: f64, counts: impl Fn(ObjectId) -> bool) -> bool {
        let tree = self.opaque();
        let mut found = false;
        let mut look = |slot: usize| {
            let triangle = tree.triangles[slot];
            let is_near = || (p - closest_on_triangle(p, &tree.corners[slot])).length_squared() <= distance * distance;
            found |= !self.is_hole(triangle) && counts(tree.owner(self.scene, triangle)) && is_near();
            !found
        };
        if !tree.triangles.is_empty() {
            // The tree's boxes are padded by more than this rounding.
            let around = obvhs::aabb::Aabb::new((p - distance).as_vec3a(), (p + distance).as_vec3a());
            tree.bvh.aabb_traverse(around, |bvh, node| {
                let node = &bvh.nodes[node as usize];
                (node.first_index..node.first_index + node.prim_count).all(|slot| look(slot as usize))
            });
        }
        found
    }

    fn owns(&self, object: ObjectId, triangle: u32) -> bool {
        self.scene.objects[object.index()].triangles.contains(&triangle)
    }
}

/// Intersection of `origin + t * direction` with a triangle for `t > 0`, from either side.
pub(crate) fn meets_triangle(origin: DVec3, direction: DVec3, corners: &[DVec3; 3]) -> Option<f64> {
    Sheared::new(origin, direction).hit(corners).filter(|&t| t > 0.0)
}

/// A hierarchy over some of a scene's triangles.
struct Tree {
    bvh: Bvh2,
    /// Corners in the order of the hierarchy's leaves.
    corners: Vec<[DVec3; 3]>,
    /// Scene triangles in that order.
    triangles: Vec<u32>,
    /// Object of each scene triangle; empty if the tree is.
    owners: Vec<u32>,
    /// Box around the padded boxes.
    bounds: Aabb,
    /// Every box is larger than its triangles by this many metres on each side.
    pad: f64,
}

impl Tree {
    /// Triangles of `holes` are numbered after the scene's last.
    fn new(scene: &Scene, opaque: bool, holes: &[Vec<DVec3>]) -> Self {
        let fan = |hole: &Vec<DVec3>| hole[1..].windows(2).map(|p| [hole[0], p[0], p[1]]).collect::<Vec<_>>();
        let of_holes: Vec<[DVec3; 3]> = holes.iter().flat_map(fan).collect();
        let first = scene.triangles.len() as u32;
        let corners_of = |t: u32| match t.checked_sub(first) {
            Some(hole) => of_holes[hole as usize],
            None => scene.corners(t as usize),
        };
        let objects = scene.objects.iter().filter(|o| o.opaque == opaque);
        let chosen = objects.flat_map(|o| o.triangles.clone()).chain(first..first + of_holes.len() as u32);
        let chosen: Vec<u32> = chosen.collect();
        let bounds = Aabb::of(chosen.iter().flat_map(|&t| corners_of(t)));
        if chosen.is_empty() {
            let (bvh, corners, triangles, owners) = (Bvh2::default(), Vec::new(), Vec::new(), Vec::new());
            return Self { bvh, corners, triangles, owners, bounds, pad: 0.0 };
        }
        // Positions, origins, directions and slab distances each have an error below 1e-7 of the largest coordinate or length (f32: 2^-24);
        // a dozen such errors add up to less than this.
        let scale = bounds.diagonal().max(bounds.min.abs().max(bounds.max.abs()).max_element());
        let pad = scale * 2e-6 + f64::from(f32::MIN_POSITIVE);
        let boxes: Vec<obvhs::aabb::Aabb> = chosen
            .iter()
            .map(|&t| {
                let b = Aabb::of(corners_of(t)).inflated(pad);
                obvhs::aabb::Aabb::new(b.min.as_vec3a(), b.max.as_vec3a())
            })
            .collect();
        let bvh = bvh::over(boxes, None);
        let triangles: Vec<u32> = bvh.primitive_indices.iter().map(|&i| chosen[i as usize]).collect();
        let corners = triangles.iter().map(|&t| corners_of(t)).collect();
        let mut owners = vec![0; scene.triangles.len()];
        for (i, object) in scene.objects.iter().enumerate() {
            owners[object.triangles.start as usize..object.triangles.end as usize].fill(i as u32);
        }
        Self { bvh, corners, triangles, owners, bounds: bounds.inflated(pad), pad }
    }

    fn owner(&self, scene: &Scene, triangle: u32) -> ObjectId {
        self.owners.get(triangle as usize).map_or_else(|| scene.object_of(triangle as usize), |&o| ObjectId(o))
    }

    /// The ray in `f32` with a unit direction, clipped to the tree's box grown by `grow` metres, so that far origins lose no precision; the
    /// distance (metres) to its start; and the direction's length. `None` if it misses the box.
    fn enter(&self, origin: DVec3, direction: DVec3, limit: f64, grow: f64) -> Option<(Ray, f64, f64)> {
        let length = direction.length();
        if self.triangles.is_empty() || !(length > 0.0 && length.is_finite() && origin.is_finite()) {
            return None;
        }
        let unit = direction / length;
        let (mut near, mut far) = (0.0f64, limit * length);
        let bounds = self.bounds.inflated(grow + self.pad);
        for axis in 0..3 {
            let (o, d) = (origin[axis], unit[axis]);
            let (mut t0, mut t1) = ((bounds.min[axis] - o) / d, (bounds.max[axis] - o) / d);
            if d == 0.0 {
                let inside = bounds.min[axis] <= o && o <= bounds.max[axis];
                (t0, t1) = if inside { (f64::NEG_INFINITY, f64::INFINITY) } else { (f64::INFINITY, f64::NEG_INFINITY) };
            }
            near = near.max(t0.min(t1));
            far = far.min(t0.max(t1));
        }
        if near > far {
            return None;
        }
        let tmax = (far - near) as f32 + (grow + self.pad) as f32;
        let ray = Ray::new((origin + unit * near).as_vec3a(), unit.as_vec3a(), 0.0, tmax);
        Some((ray, near, length))
    }

    /// Calls `leaf` with the slots of every leaf that the ray hits, near ones first, boxes grown by `grow` metres. `leaf` may shorten the
    /// ray (metres from its start), and stops the traversal by returning `false`; then this returns `false`.
    #[inline(always)]
    fn walk(&self, mut ray: Ray, grow: f64, mut leaf: impl FnMut(std::ops::Range<usize>, &mut f32) -> bool) -> bool {
        let grow = Vec3A::splat((grow * (1.0 + 1e-6)) as f32);
        let entry = |index: usize, ray: &Ray| {
            let node = &self.bvh.nodes[index];
            let bounds = obvhs::aabb::Aabb::new(node.aabb().min - grow, node.aabb().max + grow);
            (bounds.intersect_ray(ray), node.first_index as usize, node.prim_count as usize)
        };
        let mut stack = Stack::default();
        let (t, mut first, mut count) = entry(0, &ray);
        if t > ray.tmax || t == f32::INFINITY {
            return true;
        }
        loop {
            if count > 0 {
                if !leaf(first..first + count, &mut ray.tmax) {
                    return false;
                }
            } else {
                let (mut a, mut b) = (entry(first, &ray), entry(first + 1, &ray));
                if b.0 < a.0 {
                    std::mem::swap(&mut a, &mut b);
                }
                if b.0 <= ray.tmax && b.0 < f32::INFINITY {
                    stack.push((b.0, b.1 as u32, b.2 as u32));
                }
                if a.0 <= ray.tmax && a.0 < f32::INFINITY {
                    (first, count) = (a.1, a.2);
                    continue;
                }
            }
            loop {
                let Some(next) = stack.pop() else { return true };
                if next.0 <= ray.tmax {
                    (first, count) = (next.1 as usize, next.2 as usize);
                    break;
                }
            }
        }
    }
}

/// A stack with a fixed part for normal depths, and a growing part beyond.
struct Stack {
    near: [(f32, u32, u32); 64],
    len: usize,
    deep: Vec<(f32, u32, u32)>,
}

impl Default for Stack {
    #[inline(always)]
    fn default() -> Self {
        Self { near: [(0.0, 0, 0); 64], len: 0, deep: Vec::new() }
    }
}

impl Stack {
    #[inline(always)]
    fn push(&mut self, item: (f32, u32, u32)) {
        match self.near.get_mut(self.len) {
            Some(slot) => {
                *slot = item;
                self.len += 1;
            }
            None => self.deep.push(item),
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(f32, u32, u32)> {
        if !self.deep.is_empty() {
            return self.deep.pop();
        }
        self.len = self.len.checked_sub(1)?;
        Some(self.near[self.len])
    }
}

/// A ray in the sheared frame where it is the z axis.
struct Sheared {
    origin: DVec3,
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Sheared {
    #[inline]
    fn new(origin: DVec3, direction: DVec3) -> Self {
        let d = direction.abs();
        let z = if d.x >= d.y && d.x >= d.z {
            0
        } else if d.y >= d.z {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let shear = [direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]];
        Self { origin, axes: [x, y, z], shear }
    }

    /// Intersection of the line with the triangle, in units of the direction; edges and corners count.
    #[inline(always)]
    fn hit(&self, corners: &[DVec3; 3]) -> Option<f64> {
        let [x, y, z] = self.axes;
        let [sx, sy, sz] = self.shear;
        let place = |p: DVec3| {
            let q = (p - self.origin).to_array();
            (q[x] - sx * q[z], q[y] - sy * q[z], q[z])
        };
        let (a, b, c) = (place(corners[0]), place(corners[1]), place(corners[2]));
        let u = c.0 * b.1 - c.1 * b.0;
        let v = a.0 * c.1 - a.1 * c.0;
        let w = b.0 * a.1 - b.1 * a.0;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let t = sz * (u * a.2 + v * b.2 + w * c.2) / det;
        t.is_finite().then_some(t)
    }
}
