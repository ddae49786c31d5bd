//! Doors, windows and plain holes as windings in the middle of the walls that they go through.
//!
//! The opening element is the hole itself, so its section with the wall's middle plane is the outline, and what fills it (a
//! leaf that may stick out, a frame that may be let in) only says what it is. The wall's direction is read from its own
//! triangles beside the hole rather than from placements, which exporters turn as they like: the sides are by far the largest
//! faces there once the reveals, which lie on the opening's surface, are left out.

use super::geometry::{Built, Geometry, Shape};
use super::model::{Model, global_id};
use super::plan::{Rectangle, smallest_rectangle};
use super::relations::Relations;
use super::roles::is_wall;
use super::spaces::Rooms;
use crate::geom::Aabb;
use crate::scene::{OpeningHint, OpeningKind};
use glam::{DVec2, DVec3};
use ifc_lite_core::{EntityDecoder, IfcType};
use std::collections::HashMap;

/// Triangles this near to an opening, metres, are beside it. Larger: other walls of the same element join in. Smaller: walls
/// whose sides stop a hair before the opening are missed.
const BESIDE: f64 = 0.02;

/// Cosine of the angle (3 degrees) within which faces count as parallel.
const PARALLEL: f64 = 0.9986;

/// A flat slice of a wall or roof around an opening.
#[derive(Clone, Copy, Debug)]
struct Layer {
    /// Unit normal, horizontal where the wall is upright.
    normal: DVec3,
    /// Range along the normal, metres.
    range: [f64; 2],
}

/// Reads the openings: every filled one, and unfilled ones that go through walls.
pub(super) fn openings(
    model: &Model,
    decoder: &mut EntityDecoder<'_>,
    relations: &Relations,
    geometry: &Geometry,
    rooms: &Rooms,
    notes: &mut Vec<String>,
) -> Vec<OpeningHint> {
    let kinds: HashMap<u32, &IfcType> = model.products.iter().map(|p| (p.id, &p.kind)).collect();
    let host_of: HashMap<u32, u32> = relations.voids.iter().rev().map(|&(host, opening)| (opening, host)).collect();
    let mut bounded: HashMap<u32, Vec<usize>> = HashMap::new();
    for boundary in &relations.boundaries {
        if let (Some(element), Some(&room)) = (boundary.element, rooms.index.get(&boundary.space)) {
            let rooms = bounded.entry(element).or_default();
            if !rooms.contains(&room) {
                rooms.push(room);
            }
        }
    }
    let (mut hints, mut uncut, mut shapeless) = (Vec::new(), Vec::new(), Vec::new());
    for product in &model.products {
        let kind = if product.kind.is_subtype_of(IfcType::IfcDoor) {
            OpeningKind::Door
        } else if product.kind.is_subtype_of(IfcType::IfcWindow) {
            OpeningKind::Window
        } else if product.kind.is_subtype_of(IfcType::IfcOpeningElement) {
            OpeningKind::Opening
        } else {
            continue;
        };
        let Ok(entity) = decoder.decode_by_id(product.id) else { continue };
        let filled = relations.fillings.get(&product.id).is_some_and(|f| !f.is_empty());
        let opening = if kind == OpeningKind::Opening { Some(product.id) } else { relations.opening_of.get(&product.id).copied() };
        let host = opening.and_then(|o| host_of.get(&o).copied());
        if kind == OpeningKind::Opening && (filled || !host.is_some_and(|h| kinds.get(&h).is_some_and(|k| is_wall(k)))) {
            continue;
        }
        let hole = opening.and_then(|o| geometry.get(o)).map(Built::whole).filter(|s| !s.triangles.is_empty());
        let filling = geometry.get(product.id).map(Built::whole).filter(|s| !s.triangles.is_empty());
        let wall = host.map(|h| shape_with_parts(h, relations, geometry)).unwrap_or_default();
        let layer = hole.as_ref().and_then(|hole| layer_beside(&wall, hole));
        let (winding, thickness) = match (&hole, &filling, layer) {
            (Some(hole), _, Some(layer)) if kind == OpeningKind::Opening => {
                let [low, high] = extent(hole, layer.normal);
                if low > layer.range[0] + BESIDE || high < layer.range[1] - BESIDE {
                    // A niche.
                    continue;
                }
                (rectangle_in(hole, layer), layer.range[1] - layer.range[0])
            }
            (Some(hole), Some(filling), Some(layer)) if relations.fillings[&opening.unwrap_or_default()].len() > 1 => {
                // A door beside its side light in one hole: each takes its own share of it.
                let both = overlap(rectangle_in(hole, layer), &rectangle_in(filling, layer), layer);
                (both, layer.range[1] - layer.range[0])
            }
            (Some(hole), _, Some(layer)) => (rectangle_in(hole, layer), layer.range[1] - layer.range[0]),
            (Some(hole), filling, None) => {
                // No wall to look at: the leaf is flatter than the hole is.
                let Some(flat) = flattest(filling.as_ref().unwrap_or(hole)) else { continue };
                let [low, high] = extent(hole, flat.normal);
                (rectangle_in(hole, Layer { range: [low, high], ..flat }), 0.0)
            }
            (None, Some(filling), _) => {
                let Some(flat) = flattest(filling) else { continue };
                (rectangle_in(filling, flat), 0.0)
            }
            (None, None, _) => {
                shapeless.push(global_id(&entity));
                continue;
            }
        };
        if winding.len() < 3 || crate::geom::area(&winding) < 1e-6 {
            shapeless.push(global_id(&entity));
            continue;
        }
        if layer.is_some_and(|layer| is_blocked(&wall, &winding, layer)) {
            uncut.push(global_id(&entity));
        }
        let known = [Some(product.id), opening].into_iter().flatten().find_map(|id| bounded.get(&id));
        let rooms = match known.map(Vec::as_slice) {
            Some(&[a]) => [Some(a), None],
            Some(&[a, b]) => [Some(a), Some(b)],
            // More than two can't all be on its sides; the split finds out.
            _ => [None, None],
        };
        hints.push(OpeningHint { id: global_id(&entity), kind, winding, thickness, rooms });
    }
    super::reader::note_list(notes, "walls aren't cut open at", &uncut);
    super::reader::note_list(notes, "doors and windows without a shape", &shapeless);
    hints
}

/// An element's shape, or those of its parts where it has none of its own.
fn shape_with_parts(element: u32, relations: &Relations, geometry: &Geometry) -> Shape {
    let mut shape = geometry.get(element).map(Built::whole).unwrap_or_default();
    if shape.triangles.is_empty() {
        for part in relations.parts.get(&element).into_iter().flatten().filter_map(|&p| geometry.get(p)) {
            shape.append(&part.whole());
        }
    }
    shape
}

fn bounds(shape: &Shape) -> Aabb {
    Aabb::of(shape.corners().flatten())
}

fn extent(shape: &Shape, normal: DVec3) -> [f64; 2] {
    shape.corners().flatten().map(|p| p.dot(normal)).fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], d| [l.min(d), h.max(d)])
}

/// The layer of `wall` that `hole` goes through.
fn layer_beside(wall: &Shape, hole: &Shape) -> Option<Layer> {
    let near = bounds(hole).inflated(BESIDE);
    let hull = HoleBox::of(hole)?;
    // Directions of faces, each with its area, opposite ones counted as one.
    let mut directions: Vec<(DVec3, f64)> = Vec::new();
    let mut beside = Vec::new();
    for t in wall.corners() {
        if !Aabb::of(t).touches(&near) || hull.contains((t[0] + t[1] + t[2]) / 3.0) {
            continue;
        }
        let doubled = (t[1] - t[0]).cross(t[2] - t[0]);
        let Some(n) = doubled.try_normalize() else { continue };
        let n = canonical(n);
        match directions.iter_mut().find(|(d, _)| d.dot(n).abs() > PARALLEL) {
            Some((_, area)) => *area += doubled.length(),
            None => directions.push((n, doubled.length())),
        }
        beside.push((t, n));
    }
    // Of equal areas, the first in the wall's own order.
    let mut best: Option<(DVec3, f64)> = None;
    for &(n, area) in &directions {
        if best.is_none_or(|(_, most)| area > most * (1.0 + 1e-9)) {
            best = Some((n, area));
        }
    }
    let (raw, _) = best?;
    let normal = upright(raw);
    let mut range = [f64::INFINITY, f64::NEG_INFINITY];
    for d in beside.iter().filter(|(_, n)| n.dot(raw).abs() > PARALLEL).flat_map(|(t, _)| t.map(|p| p.dot(normal))) {
        range = [range[0].min(d), range[1].max(d)];
    }
    // One side only, as of a sheet: the hole's own depth.
    if range[1] - range[0] < 1e-3 {
        range = extent(hole, normal);
    }
    Some(Layer { normal, range })
}

/// The box around a hole, turned in plan: what lies on its surface are reveals.
struct HoleBox {
    plan: Rectangle,
    y: [f64; 2],
}

impl HoleBox {
    fn of(hole: &Shape) -> Option<Self> {
        let plan = smallest_rectangle(hole.corners().flatten().map(|p| DVec2::new(p.x, p.z)))?;
        Some(Self { plan, y: extent(hole, DVec3::Y) })
    }

    fn contains(&self, p: DVec3) -> bool {
        let margin = BESIDE / 2.0;
        let q = DVec2::new(p.x, p.z);
        let q = DVec2::new(q.dot(self.plan.axes[0]), q.dot(self.plan.axes[1]));
        q.cmpge(self.plan.low - margin).all()
            && q.cmple(self.plan.high + margin).all()
            && (self.y[0] - margin..=self.y[1] + margin).contains(&p.y)
    }
}

/// One of `n` and `-n`, always the same.
fn canonical(n: DVec3) -> DVec3 {
    let decisive = [n.x, n.z, n.y].into_iter().find(|c| c.abs() > 1e-6).unwrap_or(1.0);
    if decisive < 0.0 { -n } else { n }
}

/// Made exactly horizontal or vertical where it nearly is.
fn upright(n: DVec3) -> DVec3 {
    if n.y.abs() < 0.05 {
        DVec3::new(n.x, 0.0, n.z).normalize_or(DVec3::X)
    } else if n.y.abs() > PARALLEL {
        DVec3::Y
    } else {
        n
    }
}

/// The plane that a leaf lies in, from its box turned in plan: its least side is its thickness.
fn flattest(shape: &Shape) -> Option<Layer> {
    let HoleBox { plan, y } = HoleBox::of(shape)?;
    let size = plan.size();
    let side = usize::from(size.y < size.x);
    if y[1] - y[0] < size[side] {
        return Some(Layer { normal: DVec3::Y, range: y });
    }
    let axis = plan.axes[side];
    let normal = canonical(DVec3::new(axis.x, 0.0, axis.y));
    Some(Layer { normal, range: extent(shape, normal) })
}

/// Directions right and up within a layer: right x up = normal.
fn frame(shape: &Shape, normal: DVec3) -> [DVec3; 2] {
    let right = match DVec3::Y.cross(normal).try_normalize().filter(|_| normal.y.abs() <= PARALLEL) {
        Some(right) => right,
        None => {
            // A skylight: along its own sides.
            let plan = smallest_rectangle(shape.corners().flatten().map(|p| DVec2::new(p.x, p.z)));
            plan.map_or(DVec3::X, |r| DVec3::new(r.axes[0].x, 0.0, r.axes[0].y))
        }
    };
    [right, normal.cross(right)]
}

/// The rectangle around a shape's section with a layer's middle plane, counter-clockwise about the normal; around its outline
/// where it doesn't reach the plane.
fn rectangle_in(shape: &Shape, layer: Layer) -> Vec<DVec3> {
    let middle = (layer.range[0] + layer.range[1]) / 2.0;
    let mut section = Vec::new();
    for t in shape.corners() {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let (da, db) = (a.dot(layer.normal) - middle, b.dot(layer.normal) - middle);
            if (da <= 0.0) != (db <= 0.0) {
                section.push(a + (b - a) * (da / (da - db)));
            }
        }
    }
    if section.len() < 3 {
        section = shape.corners().flatten().collect();
    }
    let axes = frame(shape, layer.normal);
    let project = |p: &DVec3| DVec2::new(p.dot(axes[0]), p.dot(axes[1]));
    let low = section.iter().map(project).fold(DVec2::INFINITY, DVec2::min);
    let high = section.iter().map(project).fold(DVec2::NEG_INFINITY, DVec2::max);
    let at = |x: f64, y: f64| layer.normal * middle + axes[0] * x + axes[1] * y;
    vec![at(low.x, low.y), at(high.x, low.y), at(high.x, high.y), at(low.x, high.y)]
}

/// What two windings in the same layer share; the first if nothing.
fn overlap(winding: Vec<DVec3>, other: &[DVec3], layer: Layer) -> Vec<DVec3> {
    let mut shared = winding.clone();
    for (i, &a) in other.iter().enumerate() {
        let edge = other[(i + 1) % other.len()] - a;
        let Some(out) = edge.cross(layer.normal).try_normalize() else { continue };
        shared = crate::geom::clip(&shared, &crate::geom::Plane::through(a, out), 1e-6);
    }
    if shared.is_empty() { winding } else { shared }
}

/// True where wall is left in the middle of an opening: a segment through it from side to side is stopped.
fn is_blocked(wall: &Shape, winding: &[DVec3], layer: Layer) -> bool {
    let centre = crate::geom::middle(winding);
    let reach = layer.normal * ((layer.range[1] - layer.range[0]) / 2.0 + BESIDE);
    wall.corners().any(|t| crosses(centre - reach, centre + reach, t))
}

/// Whether the segment from `a` to `b` crosses a triangle (Möller, Trumbore 1997).
fn crosses(a: DVec3, b: DVec3, t: [DVec3; 3]) -> bool {
    let (d, e, f) = (b - a, t[1] - t[0], t[2] - t[0]);
    let p = d.cross(f);
    let det = e.dot(p);
    if det == 0.0 {
        return false;
    }
    let s = a - t[0];
    let u = s.dot(p) / det;
    let q = s.cross(e);
    let (v, w) = (d.dot(q) / det, f.dot(q) / det);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&w)
}
