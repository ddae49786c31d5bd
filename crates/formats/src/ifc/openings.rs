//! Doors, windows and plain holes as windings in the middle of their walls.
//!
//! The opening element is the hole itself, so its section with the wall's middle plane is the outline. Its filling (a leaf, a
//! frame) may be larger or smaller and gives only the kind. The wall's direction comes from its own triangles beside the hole,
//! since placements are unreliable. Apart from reveals, which lie on the opening's surface, the sides are by far the largest
//! faces there.

use super::cuts::Cut;
use super::geometry::{Built, Geometry, Shape};
use super::model::{Model, global_id};
use super::rectangle::{Rectangle, smallest_rectangle};
use super::relations::Relations;
use super::roles::is_wall;
use super::spaces::Rooms;
use enfilade::math::geom::Aabb;
use enfilade::scene::{OpeningHint, OpeningKind};
use enfilade::types::note::Note;
use glam::{DVec2, DVec3};
use ifc_lite_core::{EntityDecoder, IfcType};
use std::collections::HashMap;

/// An opening is in a wall if its normal has a smaller cosine with the vertical than this (2.9 degrees).
const IN_A_WALL: f64 = 0.05;

/// A thinner wall, metres, does not give the depth of its hole.
const LEAST_THICKNESS: f64 = 1e-3;

/// Openings with a smaller outline, square metres, are ignored.
const LEAST_AREA: f64 = 1e-6;

/// Triangles within this distance of an opening, metres, are beside it. Larger: other walls of the same element join in. Smaller:
/// walls that end just before the opening are missed.
const BESIDE: f64 = 0.02;

/// An unfilled opening that ends farther than this from a wall's side, metres, is a niche.
const THROUGH: f64 = 2e-3;

/// Greatest distance of a wall's side from the end of an opening, metres: the wall behind a niche. Larger: a U-shaped wall around
/// the opening counts as one thick wall.
const BEHIND: f64 = 0.3;

/// Faces count as parallel if the cosine between their normals is above this: within 3 degrees.
const COS_PARALLEL: f64 = 0.9986;

/// Points per side tried in an opening whose middle is not open. Less: thin frames have none.
const GRID: usize = 8;

/// A flat layer of a wall or roof around an opening.
#[derive(Clone, Copy, Debug)]
struct Layer {
    /// Unit normal, horizontal for an upright wall.
    normal: DVec3,
    /// Range along the normal, metres.
    range: [f64; 2],
}

/// Data for reading openings.
struct Source<'s> {
    relations: &'s Relations,
    geometry: &'s Geometry,
    kinds: HashMap<u32, &'s IfcType>,
    /// The wall or roof with an opening element.
    host_of: HashMap<u32, u32>,
    /// The rooms that an element bounds, from space boundaries.
    bounded: HashMap<u32, Vec<usize>>,
}

/// Reads the openings: filled ones, and unfilled ones that go through walls. Openings still closed are added to `cuts`.
pub(super) fn openings(
    model: &Model,
    decoder: &mut EntityDecoder<'_>,
    relations: &Relations,
    geometry: &Geometry,
    rooms: &Rooms,
    (notes, cuts): (&mut Vec<Note>, &mut Vec<Cut>),
) -> Vec<OpeningHint> {
    let source = Source {
        relations,
        geometry,
        kinds: model.products.iter().map(|p| (p.id, &p.kind)).collect(),
        host_of: relations.voids.iter().rev().map(|&(host, opening)| (opening, host)).collect(),
        bounded: bounded(relations, rooms),
    };
    let (mut hints, mut uncut, mut shapeless) = (Vec::new(), Vec::new(), Vec::new());
    for product in &model.products {
        let Some(kind) = opening_kind(&product.kind) else { continue };
        let Ok(entity) = decoder.decode_by_id(product.id) else { continue };
        let Some(element) = source.element(product.id, kind) else { continue };
        let Some((winding, thickness)) = element.outline() else { continue };
        if winding.len() < 3 || enfilade::math::geom::area(&winding) < LEAST_AREA {
            shapeless.push(global_id(&entity));
            continue;
        }
        if let Some(cut) = element.cut(&winding) {
            cuts.push(cut);
            uncut.push(global_id(&entity));
        }
        let rooms = source.rooms([Some(product.id), element.opening]);
        hints.push(OpeningHint { id: global_id(&entity), kind, winding, thickness, rooms });
    }
    let what = "openings are cut into their walls as rectangles, since the geometry reader left them closed";
    super::reader::note_list(notes, Note::taken, &format!("{} {what}", uncut.len()), &uncut);
    super::reader::note_list(notes, Note::fault, "doors and windows without a shape", &shapeless);
    hints
}

fn opening_kind(kind: &IfcType) -> Option<OpeningKind> {
    if kind.is_subtype_of(IfcType::IfcDoor) {
        Some(OpeningKind::Door)
    } else if kind.is_subtype_of(IfcType::IfcWindow) {
        Some(OpeningKind::Window)
    } else if kind.is_subtype_of(IfcType::IfcOpeningElement) {
        Some(OpeningKind::Opening)
    } else {
        None
    }
}

/// By element: the rooms that it bounds, from space boundaries.
fn bounded(relations: &Relations, rooms: &Rooms) -> HashMap<u32, Vec<usize>> {
    let mut bounded: HashMap<u32, Vec<usize>> = HashMap::new();
    for boundary in &relations.boundaries {
        if let (Some(element), Some(&room)) = (boundary.element, rooms.index.get(&boundary.space)) {
            let rooms = bounded.entry(element).or_default();
            if !rooms.contains(&room) {
                rooms.push(room);
            }
        }
    }
    bounded
}

impl Source<'_> {
    /// A door, a window or an opening; `None` if another element fills it or it is in no wall.
    fn element(&self, id: u32, kind: OpeningKind) -> Option<Element> {
        let Self { relations, geometry, .. } = self;
        let fillings = |opening: &u32| relations.fillings.get(opening).map_or(0, Vec::len);
        let opening = if kind == OpeningKind::Opening { Some(id) } else { relations.opening_of.get(&id).copied() };
        let host = opening.and_then(|o| self.host_of.get(&o).copied());
        let is_in_wall = || host.is_some_and(|h| self.kinds.get(&h).is_some_and(|k| is_wall(k)));
        if kind == OpeningKind::Opening && (fillings(&id) > 0 || !is_in_wall()) {
            return None;
        }
        let shape = |id: u32| geometry.get(id).map(Built::whole).filter(|s| !s.triangles.is_empty());
        let hole = opening.and_then(shape);
        let hosts = host.map(|h| with_parts(h, relations, geometry)).unwrap_or_default();
        let mut wall = Shape::default();
        hosts.iter().filter_map(|&h| geometry.get(h)).for_each(|built| wall.append(&built.whole()));
        let layer = hole.as_ref().and_then(|hole| layer_beside(&wall, hole));
        let shares_hole = opening.is_some_and(|o| fillings(&o) > 1);
        Some(Element { kind, opening, hole, filling: shape(id), hosts, wall, layer, shares_hole })
    }

    /// The rooms on both sides, from the first element with space boundaries.
    fn rooms(&self, elements: [Option<u32>; 2]) -> [Option<usize>; 2] {
        let known = elements.into_iter().flatten().find_map(|id| self.bounded.get(&id));
        match known.map(Vec::as_slice) {
            Some(&[a]) => [Some(a), None],
            Some(&[a, b]) => [Some(a), Some(b)],
            // More than two cannot all be on its sides; the partition decides.
            _ => [None, None],
        }
    }
}

/// A door, a window or an opening.
struct Element {
    kind: OpeningKind,
    /// The opening element: itself, or the one that it fills.
    opening: Option<u32>,
    hole: Option<Shape>,
    filling: Option<Shape>,
    /// The elements with the hole, and their shape.
    hosts: Vec<u32>,
    wall: Shape,
    /// Layer of the wall at the hole.
    layer: Option<Layer>,
    /// Whether another element fills the same hole.
    shares_hole: bool,
}

impl Element {
    /// The winding, empty without a shape, and the wall's thickness. `None` for a niche, and if no direction is found.
    fn outline(&self) -> Option<(Vec<DVec3>, f64)> {
        let through = |hole: &Shape, layer: Layer| (rectangle_in(hole, layer), layer.range[1] - layer.range[0]);
        Some(match (&self.hole, &self.filling, self.layer) {
            (Some(hole), _, Some(layer)) if self.kind == OpeningKind::Opening => {
                let [low, high] = extent(hole, layer.normal);
                if low > layer.range[0] + THROUGH || high < layer.range[1] - THROUGH {
                    return None;
                }
                through(hole, layer)
            }
            (Some(hole), Some(filling), Some(layer)) if self.shares_hole => {
                // A door and its side light in one hole: each gets its own part.
                let (winding, thickness) = through(hole, layer);
                (overlap(winding, &rectangle_in(filling, layer), layer), thickness)
            }
            (Some(hole), _, Some(layer)) => through(hole, layer),
            (Some(hole), filling, None) => {
                // No wall: the leaf is flatter than the hole.
                let flat = flattest(filling.as_ref().unwrap_or(hole))?;
                let [low, high] = extent(hole, flat.normal);
                (rectangle_in(hole, Layer { range: [low, high], ..flat }), 0.0)
            }
            (None, Some(filling), _) => (rectangle_in(filling, flattest(filling)?), 0.0),
            (None, None, _) => (Vec::new(), 0.0),
        })
    }

    /// The cut needed if wall is left in the opening.
    fn cut(&self, winding: &[DVec3]) -> Option<Cut> {
        let (layer, hole) = (self.layer?, self.hole.as_ref()?);
        let reach = (layer.range[1] - layer.range[0]) / 2.0 + BESIDE;
        let Self { hosts, wall, .. } = self;
        is_blocked(wall, hole, winding, layer.normal * reach).then(|| {
            let (hosts, winding) = (hosts.clone(), winding.to_vec());
            Cut { hosts, winding, normal: layer.normal, reach }
        })
    }
}

/// An element, or its parts if it has no shape of its own.
fn with_parts(element: u32, relations: &Relations, geometry: &Geometry) -> Vec<u32> {
    let has_shape = |built: &Built| !(built.solid.triangles.is_empty() && built.clear.triangles.is_empty());
    match geometry.get(element).is_some_and(has_shape) {
        true => vec![element],
        false => relations.parts.get(&element).cloned().unwrap_or_default(),
    }
}

fn extent(shape: &Shape, normal: DVec3) -> [f64; 2] {
    shape
        .corners()
        .flatten()
        .map(|p| p.dot(normal))
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], d| [l.min(d), h.max(d)])
}

/// The layer of `wall` around `hole`.
fn layer_beside(wall: &Shape, hole: &Shape) -> Option<Layer> {
    let hole_box = HoleBox::of(hole)?;
    // Directions of faces as sums of doubled areas, opposite ones merged: larger faces have more reliable directions.
    let mut directions: Vec<DVec3> = Vec::new();
    for t in wall.corners().filter(|t| hole_box.is_near(t, DVec3::ZERO) && !hole_box.holds_middle(t)) {
        let n = (t[1] - t[0]).cross(t[2] - t[0]);
        match directions.iter_mut().find(|d| d.dot(n).abs() > COS_PARALLEL * d.length() * n.length()) {
            Some(sum) => *sum += n * n.dot(*sum).signum(),
            None if n.length() > 0.0 => directions.push(n),
            None => {}
        }
    }
    // Of equal areas, the first in the wall's order.
    let largest = directions.into_iter().reduce(|a, b| if b.length() > a.length() * (1.0 + 1e-9) { b } else { a });
    let raw = canonical(largest?.try_normalize()?);
    let normal = upright(raw);
    // The sides, including one that a niche does not reach.
    let is_side = |t: &[DVec3; 3]| {
        let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize_or_zero();
        n.dot(raw).abs() > COS_PARALLEL && hole_box.is_near(t, normal * BEHIND)
    };
    let offsets = wall.corners().filter(is_side).flatten().map(|p| p.dot(normal));
    let range = offsets.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], d| [l.min(d), h.max(d)]);
    // One side only, as of a sheet: use the depth of the hole.
    let range = if range[1] - range[0] < LEAST_THICKNESS { extent(hole, normal) } else { range };
    Some(Layer { normal, range })
}

/// The box around a hole, rotated in plan; faces on its surface are reveals.
struct HoleBox {
    plan: Rectangle,
    y: [f64; 2],
}

impl HoleBox {
    fn of(hole: &Shape) -> Option<Self> {
        let plan = smallest_rectangle(hole.corners().flatten().map(|p| DVec2::new(p.x, p.z)))?;
        Some(Self { plan, y: extent(hole, DVec3::Y) })
    }

    /// In the box's axes: along the sides of the rectangle, then up.
    fn local(&self, p: DVec3) -> DVec3 {
        let plan = DVec2::new(p.x, p.z);
        DVec3::new(plan.dot(self.plan.axes[0]), plan.dot(self.plan.axes[1]), p.y)
    }

    fn around(&self, margin: DVec3) -> Aabb {
        let (low, high) = (self.plan.low, self.plan.high);
        Aabb { min: low.extend(self.y[0]) - margin, max: high.extend(self.y[1]) + margin }
    }

    /// Whether a triangle comes within [`BESIDE`] of the box grown by `reach` on both sides.
    fn is_near(&self, t: &[DVec3; 3], reach: DVec3) -> bool {
        self.around(self.local(reach).abs() + BESIDE).touches(&Aabb::of(t.map(|p| self.local(p))))
    }

    /// Whether a triangle is a reveal: its middle is in the box or on its surface.
    fn holds_middle(&self, t: &[DVec3; 3]) -> bool {
        self.around(DVec3::splat(BESIDE / 2.0)).contains(self.local((t[0] + t[1] + t[2]) / 3.0))
    }
}

/// Either `n` or `-n`, the same for both.
fn canonical(n: DVec3) -> DVec3 {
    let decisive = [n.x, n.z, n.y].into_iter().find(|c| c.abs() > 1e-6).unwrap_or(1.0);
    if decisive < 0.0 { -n } else { n }
}

/// Snaps nearly horizontal and vertical normals.
fn upright(n: DVec3) -> DVec3 {
    if n.y.abs() < IN_A_WALL {
        DVec3::new(n.x, 0.0, n.z).normalize_or(DVec3::X)
    } else if n.y.abs() > COS_PARALLEL {
        DVec3::Y
    } else {
        n
    }
}

/// The plane of a leaf, from its box rotated in plan: the shortest side is its thickness.
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
    let right = match DVec3::Y.cross(normal).try_normalize().filter(|_| normal.y.abs() <= COS_PARALLEL) {
        Some(right) => right,
        None => {
            // A skylight: along its own sides.
            let plan = smallest_rectangle(shape.corners().flatten().map(|p| DVec2::new(p.x, p.z)));
            plan.map_or(DVec3::X, |r| DVec3::new(r.axes[0].x, 0.0, r.axes[0].y))
        }
    };
    [right, normal.cross(right)]
}

/// The rectangle around a shape's section with a layer's middle plane, counter-clockwise about the normal; around its outline if
/// it does not reach the plane.
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

/// The intersection of two windings in one layer; the first if it is empty.
fn overlap(winding: Vec<DVec3>, other: &[DVec3], layer: Layer) -> Vec<DVec3> {
    let mut shared = winding.clone();
    for (i, &a) in other.iter().enumerate() {
        let edge = other[(i + 1) % other.len()] - a;
        let Some(out) = edge.cross(layer.normal).try_normalize() else { continue };
        shared = enfilade::math::geom::clip(&shared, &enfilade::math::geom::Plane::through(a, out), 1e-6);
    }
    if shared.is_empty() { winding } else { shared }
}

/// Whether wall is left in an opening: a segment through it, `reach` on both sides, is blocked. The segment goes through the
/// middle, or through the first point of a grid that is inside the hole.
fn is_blocked(wall: &Shape, hole: &Shape, winding: &[DVec3], reach: DVec3) -> bool {
    let (corner, u, v) = (winding[0], winding[1] - winding[0], winding[winding.len() - 1] - winding[0]);
    let share = |k: usize| (k as f64 + 0.5) / GRID as f64;
    let grid = (0..GRID * GRID).map(|k| corner + u * share(k % GRID) + v * share(k / GRID));
    let far = reach.normalize_or_zero() * (hole_size(hole) + reach.length());
    let is_in = |p: &DVec3| hole.corners().any(|t| crosses(*p - far, *p + far, t));
    let through = std::iter::once(enfilade::math::geom::middle(winding)).chain(grid).find(is_in);
    through.is_some_and(|p| wall.corners().any(|t| crosses(p - reach, p + reach, t)))
}

/// The diagonal of a shape's box, metres.
fn hole_size(hole: &Shape) -> f64 {
    Aabb::of(hole.corners().flatten()).diagonal()
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A box turned about the vertical, in metres.
    fn block(low: DVec3, high: DVec3, degrees: f64) -> Shape {
        let turn = glam::DMat3::from_rotation_y(degrees.to_radians());
        let positions =
            (0..8).map(|i| turn * DVec3::new([low.x, high.x][i & 1], [low.y, high.y][i >> 1 & 1], [low.z, high.z][i >> 2]));
        let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Shape { positions: positions.collect(), triangles }
    }

    #[test]
    fn a_leaf_without_a_wall_is_its_own_middle() {
        for degrees in [0.0, 20.0, 90.0, 135.0] {
            let leaf = block(DVec3::new(2.0, 0.0, 1.0), DVec3::new(2.9, 2.1, 1.04), degrees);
            let layer = flattest(&leaf).unwrap();
            let winding = rectangle_in(&leaf, layer);
            let normal = glam::DMat3::from_rotation_y(f64::to_radians(degrees)) * DVec3::Z;
            assert!(layer.normal.dot(normal).abs() > 1.0 - 1e-12);
            assert!((enfilade::math::geom::area(&winding) - 0.9 * 2.1).abs() < 1e-9);
            assert!(enfilade::math::geom::newell(&winding).dot(layer.normal) > 0.0);
            let centre = glam::DMat3::from_rotation_y(f64::to_radians(degrees)) * DVec3::new(2.45, 1.05, 1.02);
            assert!(enfilade::math::geom::middle(&winding).distance(centre) < 1e-9);
        }
        let hatch = flattest(&block(DVec3::ZERO, DVec3::new(0.8, 0.05, 1.2), 33.0)).unwrap();
        assert_eq!(hatch.normal, DVec3::Y);
        let winding = rectangle_in(&block(DVec3::ZERO, DVec3::new(0.8, 0.05, 1.2), 33.0), hatch);
        assert!((enfilade::math::geom::area(&winding) - 0.96).abs() < 1e-9);
    }

    #[test]
    fn a_wall_narrower_than_it_is_thick_beside_its_door_keeps_its_direction() {
        // A pier of 5 cm beside the door in a wall of 60 cm: the reveal is larger than the pier's sides.
        for degrees in [0.0, 40.0] {
            let hole = block(DVec3::new(0.05, 0.0, 0.0), DVec3::new(1.05, 2.0, 0.6), degrees);
            let mut wall = block(DVec3::ZERO, DVec3::new(0.05, 2.0, 0.6), degrees);
            wall.append(&block(DVec3::new(0.0, 2.0, 0.0), DVec3::new(1.05, 2.4, 0.6), degrees));
            let layer = layer_beside(&wall, &hole).unwrap();
            let normal = glam::DMat3::from_rotation_y(f64::to_radians(degrees)) * DVec3::Z;
            assert!(layer.normal.dot(normal).abs() > 1.0 - 1e-12, "{layer:?}");
            assert!((layer.range[1] - layer.range[0] - 0.6).abs() < 1e-9, "{layer:?}");
            let (winding, reach) = (rectangle_in(&hole, layer), layer.normal * 0.32);
            assert!(!is_blocked(&wall, &hole, &winding, reach));
            assert!(is_blocked(&hole, &hole, &winding, reach));
        }
    }

    #[test]
    fn wall_in_the_middle_of_a_hole_that_goes_around_it_does_not_block_it() {
        // An L: a pier stands in the middle of its rectangle.
        let mut hole = block(DVec3::ZERO, DVec3::new(0.5, 2.0, 0.2), 0.0);
        hole.append(&block(DVec3::ZERO, DVec3::new(2.0, 0.5, 0.2), 0.0));
        let pier = block(DVec3::new(0.5, 0.5, 0.0), DVec3::new(2.0, 2.0, 0.2), 0.0);
        let layer = Layer { normal: DVec3::Z, range: [0.0, 0.2] };
        let (winding, reach) = (rectangle_in(&hole, layer), layer.normal * 0.12);
        assert!(!is_blocked(&pier, &hole, &winding, reach));
        let wall = block(DVec3::ZERO, DVec3::new(2.0, 2.0, 0.2), 0.0);
        assert!(is_blocked(&wall, &hole, &winding, reach));
        // Beside the wall: some exporters reverse the depth.
        let beside = block(DVec3::new(0.0, 0.0, 0.2), DVec3::new(2.0, 2.0, 0.6), 0.0);
        assert!(is_blocked(&wall, &beside, &winding, reach));
    }

    #[test]
    fn a_hole_shared_by_a_door_and_its_side_light_is_shared_out() {
        let layer = Layer { normal: DVec3::Z, range: [0.0, 0.2] };
        let hole = block(DVec3::ZERO, DVec3::new(2.0, 2.1, 0.2), 0.0);
        let leaf = block(DVec3::new(-0.1, 0.0, 0.05), DVec3::new(0.9, 2.2, 0.1), 0.0);
        let share = overlap(rectangle_in(&hole, layer), &rectangle_in(&leaf, layer), layer);
        assert!((enfilade::math::geom::area(&share) - 0.9 * 2.1).abs() < 1e-9, "{share:?}");
    }
}
