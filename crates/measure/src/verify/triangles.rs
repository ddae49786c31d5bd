//! Rays against triangles, for `check` alone.
//!
//! Based on: T. Möller, B. Trumbore, *Fast, minimum storage ray-triangle intersection*, 1997, in `f64`, over two obvhs
//! hierarchies. Boxes are padded by the clearance and the rounding of `f32`, so that the hierarchy never loses a triangle that
//! the `f64` test would find.

use enfilade::ObjectId;
use enfilade::file::PvsFile;
use enfilade::math::bvh;
use enfilade::scene::Scene;
use glam::{DVec3, Vec3};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::ray::{Ray, RayHit};

/// A hierarchy over boxes; items keep their numbers.
pub(super) struct Tree(Bvh2);

impl Tree {
    /// `None` without boxes.
    pub(super) fn new(boxes: impl Iterator<Item = enfilade::math::geom::Aabb>, pad: f64) -> Option<Self> {
        let boxes: Vec<Aabb> = boxes.map(|b| Aabb::new((b.min - pad).as_vec3a(), (b.max + pad).as_vec3a())).collect();
        (!boxes.is_empty()).then(|| Self(bvh::over(boxes, None)))
    }

    /// Calls `visit` with items whose box a ray may enter before `limit`, in any order; it returns the new limit.
    pub(super) fn along(&self, origin: DVec3, direction: DVec3, limit: f64, mut visit: impl FnMut(usize) -> f64) {
        // Rounds up.
        let up = |t: f64| t as f32 * (1.0 + 1e-6);
        let ray = Ray::new(origin.as_vec3a(), direction.as_vec3a(), 0.0, up(limit));
        self.0.ray_traverse(ray, &mut RayHit::none(), |_, i| up(visit(self.0.primitive_indices[i] as usize)));
    }

    /// Calls `visit` with items whose box meets another, in any order.
    pub(super) fn in_box(&self, bounds: &enfilade::math::geom::Aabb, mut visit: impl FnMut(usize)) {
        self.0.aabb_traverse(Aabb::new(bounds.min.as_vec3a(), bounds.max.as_vec3a()), |bvh, node| {
            let node = &bvh.nodes[node as usize];
            for i in node.first_index..node.first_index + node.prim_count {
                visit(bvh.primitive_indices[i as usize] as usize);
            }
            true
        });
    }

    /// Calls `visit` with items whose box holds a point, until it returns false.
    pub(super) fn at(&self, p: DVec3, mut visit: impl FnMut(usize) -> bool) {
        self.0.point_traverse(p.as_vec3a(), |bvh, node| {
            let node = &bvh.nodes[node as usize];
            let items = node.first_index..node.first_index + node.prim_count;
            items.into_iter().all(|i| visit(bvh.primitive_indices[i as usize] as usize))
        });
    }
}

/// Triangles of one kind.
struct Layer {
    tree: Option<Tree>,
    corners: Vec<[DVec3; 3]>,
    objects: Vec<ObjectId>,
}

impl Layer {
    fn new(scene: &Scene, opaque: bool, pad: f64) -> Self {
        let (mut corners, mut objects) = (Vec::new(), Vec::new());
        for (i, object) in scene.objects.iter().enumerate().filter(|(_, o)| o.opaque == opaque) {
            for t in object.triangles.clone() {
                corners.push(scene.corners(t as usize));
                objects.push(ObjectId(i as u32));
            }
        }
        let tree = Tree::new(corners.iter().map(|c| enfilade::math::geom::Aabb::of(*c)), pad);
        Self { tree, corners, objects }
    }
}

/// A scene prepared for the check's rays.
pub(super) struct Tracer {
    opaque: Layer,
    see_through: Layer,
    /// Triangles of the file's closed holes, and a hierarchy over them.
    holes: (Option<Tree>, Vec<[DVec3; 3]>),
    clearance: f64,
}

impl Tracer {
    /// `clearance`: see [`Tracer::is_clear`]; `rounding`: error of a position in `f32`; both in metres.
    pub(super) fn new(file: &PvsFile, scene: &Scene, clearance: f64, rounding: f64) -> Self {
        let pad = clearance + rounding;
        let corner = |p: Vec3| p.as_dvec3();
        let fan = |hole: &Vec<Vec3>| hole[1..].windows(2).map(|p| [hole[0], p[0], p[1]].map(corner)).collect::<Vec<_>>();
        let holes: Vec<[DVec3; 3]> = file.closed_holes.iter().flat_map(fan).collect();
        let tree = Tree::new(holes.iter().map(|c| enfilade::math::geom::Aabb::of(*c)), pad);
        Self {
            opaque: Layer::new(scene, true, pad),
            see_through: Layer::new(scene, false, pad),
            holes: (tree, holes),
            clearance,
        }
    }

    /// The distance and object of the first opaque triangle on a ray (`direction` of length 1) before `limit`, from either side.
    /// At equal distance, the lower number wins.
    pub(super) fn first_opaque(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<(f64, ObjectId)> {
        self.nearest(origin, direction, limit).map(|(t, i)| (t, self.opaque.objects[i]))
    }

    /// As [`Tracer::first_opaque`], with the triangle's number.
    fn nearest(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<(f64, usize)> {
        let mut best: Option<(f64, usize)> = None;
        let layer = &self.opaque;
        layer.tree.as_ref()?.along(origin, direction, limit, |i| match intersect(origin, direction, &layer.corners[i]) {
            Some(t) if t <= limit && best.is_none_or(|b| (t, i) < b) => {
                best = Some((t, i));
                t
            }
            _ => f64::INFINITY,
        });
        best
    }

    /// Whether neither an opaque triangle nor a closed hole lies between two points.
    pub(super) fn is_open(&self, a: DVec3, b: DVec3) -> bool {
        let length = a.distance(b);
        length == 0.0 || (self.nearest(a, (b - a) / length, length).is_none() && !self.passes_closed_hole(a, b, 0.0))
    }

    /// Whether a segment comes within `limit` metres of a closed hole.
    fn passes_closed_hole(&self, a: DVec3, b: DVec3, limit: f64) -> bool {
        let (Some(tree), triangles) = &self.holes else { return false };
        let length = a.distance(b);
        let mut passes = false;
        tree.along(a, (b - a) / length, length, |i| {
            passes |= distance_at_most(a, b, &triangles[i], limit);
            if passes { 0.0 } else { f64::INFINITY }
        });
        passes
    }

    /// Whether most surfaces around a point show their backs: it is inside a column or a wall. Unreliable for models with mixed
    /// winding.
    pub(super) fn in_solid(&self, p: DVec3) -> bool {
        let directions = (0..27).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3 % 3), f64::from(i / 9)) - 1.0);
        let (mut fronts, mut backs) = (0, 0);
        for d in directions.filter_map(|d| (d + DVec3::new(0.011, 0.017, 0.023)).try_normalize()) {
            if let Some((_, i)) = self.nearest(p, d, f64::INFINITY) {
                let [a, b, c] = self.opaque.corners[i];
                if (b - a).cross(c - a).dot(d) > 0.0 { backs += 1 } else { fronts += 1 }
            }
        }
        backs > fronts
    }

    /// Every see-through object on a ray before `limit`, once, nearest first.
    pub(super) fn see_through(&self, origin: DVec3, direction: DVec3, limit: f64) -> Vec<(f64, ObjectId)> {
        let mut met = Vec::new();
        let layer = &self.see_through;
        if let Some(tree) = &layer.tree {
            tree.along(origin, direction, limit, |i| {
                met.extend(
                    intersect(origin, direction, &layer.corners[i]).filter(|&t| t < limit).map(|t| (t, layer.objects[i])),
                );
                f64::INFINITY
            });
        }
        met.sort_by(|a, b| a.1.cmp(&b.1).then(a.0.total_cmp(&b.0)));
        met.dedup_by_key(|m| m.1);
        met.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        met
    }

    /// Whether a segment keeps the clearance from every closed hole and every opaque triangle, from its start at `a`. Triangles
    /// of `target` and the end at `b`, up to the clearance, are exempt.
    pub(super) fn is_clear(&self, a: DVec3, b: DVec3, target: Option<ObjectId>) -> bool {
        let length = a.distance(b);
        if length == 0.0 {
            return false;
        }
        let direction = (b - a) / length;
        let (p, q) = (a, b - direction * self.clearance.min(0.5 * length));
        if self.passes_closed_hole(p, q, self.clearance) {
            return false;
        }
        let layer = &self.opaque;
        let mut clear = true;
        if let Some(tree) = &layer.tree {
            tree.along(p, direction, p.distance(q), |i| {
                let near = Some(layer.objects[i]) != target && distance_at_most(p, q, &layer.corners[i], self.clearance);
                clear &= !near;
                // Ends the search: the limit is the start.
                if near { 0.0 } else { f64::INFINITY }
            });
        }
        clear
    }
}

/// Whether a ray crosses a triangle.
pub(super) fn crosses(origin: DVec3, direction: DVec3, triangle: &[DVec3; 3]) -> bool {
    intersect(origin, direction, triangle).is_some()
}

/// Distance along a ray to a triangle, from either side.
fn intersect(origin: DVec3, direction: DVec3, [a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let (e1, e2) = (*b - *a, *c - *a);
    let p = direction.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    // A ray through a shared edge meets both triangles instead of none.
    const EDGE: f64 = -1e-12;
    let s = origin - *a;
    let u = s.dot(p) / det;
    let q = s.cross(e1);
    let v = direction.dot(q) / det;
    let t = e2.dot(q) / det;
    (u >= EDGE && v >= EDGE && u + v <= 1.0 - EDGE && t > 0.0).then_some(t)
}

/// Whether a segment and a triangle come within `limit` of each other.
fn distance_at_most(p: DVec3, q: DVec3, triangle: &[DVec3; 3], limit: f64) -> bool {
    let [a, b, c] = *triangle;
    let near = |d: DVec3| d.length_squared() <= limit * limit;
    let length = p.distance(q);
    // The nearest points lie where the segment crosses the triangle, at an end of the segment, or on an edge.
    intersect(p, (q - p) / length, triangle).is_some_and(|t| t <= length)
        || [p, q].into_iter().any(|e| above(e, triangle).is_some_and(|h| h.abs() <= limit))
        || [(a, b), (b, c), (c, a)].into_iter().any(|(s, e)| near(between_segments(p, q, s, e)))
}

/// The height of a point over a triangle, if it projects into it.
fn above(p: DVec3, [a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let n = (*b - *a).cross(*c - *a).try_normalize()?;
    let inside = [(a, b), (b, c), (c, a)].into_iter().all(|(s, e)| n.dot((*e - *s).cross(p - *s)) >= 0.0);
    inside.then(|| n.dot(p - *a))
}

/// The shortest vector between two segments (C. Ericson, *Real-time collision detection*, 2005, section 5.1.9).
fn between_segments(p1: DVec3, q1: DVec3, p2: DVec3, q2: DVec3) -> DVec3 {
    let (d1, d2, r) = (q1 - p1, q2 - p2, p1 - p2);
    let (a, e, f, b, c) = (d1.length_squared(), d2.length_squared(), d2.dot(r), d1.dot(d2), d1.dot(r));
    let det = a * e - b * b;
    let clamp = |x: f64| x.clamp(0.0, 1.0);
    let s = if det > 0.0 { clamp((b * f - c * e) / det) } else { 0.0 };
    let t = if e > 0.0 { (b * s + f) / e } else { 0.0 };
    let s = if (0.0..=1.0).contains(&t) || a == 0.0 { s } else { clamp((b * clamp(t) - c) / a) };
    (p1 + d1 * s) - (p2 + d2 * clamp(t))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_to_a_triangle_is_found_over_it_beside_it_and_through_it() {
        let triangle = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Z * 2.0];
        let v = DVec3::new;
        for (p, q, distance) in [
            // Through it, over its middle, past its edge, past its corner.
            (v(0.5, -1.0, 0.5), v(0.5, 1.0, 0.5), 0.0),
            (v(0.4, 0.3, 0.4), v(0.5, 0.5, 0.5), 0.3),
            (v(-5.0, 0.0, -0.25), v(5.0, 0.0, -0.25), 0.25),
            (v(-3.0, 4.0, -1.0), v(-3.0, 4.0, 1.0), 5.0),
            (v(0.5, 1.0, 0.5), v(0.5, 0.125, 0.5), 0.125),
        ] {
            assert!(distance_at_most(p, q, &triangle, distance + 1e-9), "{p} {q}");
            assert!(distance == 0.0 || !distance_at_most(p, q, &triangle, distance - 1e-9), "{p} {q}");
        }
    }
}
