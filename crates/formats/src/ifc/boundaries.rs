//! Virtual space boundaries between two rooms without a wall.

use super::model::{Model, global_id, y_up};
use super::relations::{Boundary, Relations};
use super::spaces::Rooms;
use enfilade::math::geom::{self, Aabb, Plane};
use enfilade::scene::{OpeningHint, OpeningKind};
use enfilade::types::note::Note;
use glam::{DMat4, DVec2, DVec3};
use ifc_lite_core::{AttributeValue, DecodedEntity, EntityDecoder, IfcType};
use ifc_lite_geometry::GeometryRouter;
use std::collections::{HashMap, HashSet};

/// Tolerance of equal and of coplanar corners, metres.
const SAME: f64 = 1e-4;

/// Greatest distance between two rooms' surfaces of one boundary, metres.
const PAIR: f64 = 5e-3;

/// Smaller pieces, square metres, join no rooms.
const LEAST: f64 = 1e-3;

/// One room's surface of a boundary.
#[derive(Clone, Debug)]
struct Side {
    /// Its records; several after joining pieces.
    ids: Vec<u32>,
    room: usize,
    winding: Vec<DVec3>,
}

/// Reads the virtual boundaries. Each room has its own surface of a boundary, often in pieces that do not match those of the
/// other room. Pieces of a room that fit together are joined. The intersection of two rooms' surfaces becomes an opening between
/// them; surfaces without a partner become openings of one room. Surfaces that are not convex and flat are left out with a note.
pub(super) fn boundaries(
    model: &Model,
    decoder: &mut EntityDecoder<'_>,
    router: &GeometryRouter,
    relations: &Relations,
    rooms: &Rooms,
    notes: &mut Vec<Note>,
) -> Vec<OpeningHint> {
    let mut sides: Vec<Side> = Vec::new();
    let mut skipped = 0;
    for boundary in relations.boundaries.iter().filter(|b| b.is_virtual) {
        let Some(&room) = rooms.index.get(&boundary.space) else { continue };
        match (Reader { metres: model.metres, decoder }).winding(boundary, router).and_then(tidy) {
            Some(winding) => sides.push(Side { ids: vec![boundary.id], room, winding }),
            None => skipped += 1,
        }
    }
    if skipped > 0 {
        notes.push(Note::detail(format!("{skipped} virtual boundaries left out: not flat and convex")));
    }
    let mut used = HashSet::new();
    pair(&join(sides))
        .into_iter()
        .map(|(side, other)| {
            // Each record lends its name once, even if two rooms share it.
            let id = *side.ids.iter().find(|id| !used.contains(*id)).unwrap_or(&side.ids[0]);
            used.insert(id);
            OpeningHint {
                id: decoder.decode_by_id(id).map_or_else(|_| format!("#{id}"), |e| global_id(&e)),
                kind: OpeningKind::Virtual,
                winding: side.winding,
                thickness: 0.0,
                rooms: [Some(side.room), other],
            }
        })
        .collect()
}

/// Joins two pieces of a room as long as their union is convex; the first keeps its place.
fn join(sides: Vec<Side>) -> Vec<Side> {
    let mut rooms: HashMap<usize, Vec<(usize, Side)>> = HashMap::new();
    for (order, side) in sides.into_iter().enumerate() {
        rooms.entry(side.room).or_default().push((order, side));
    }
    for pieces in rooms.values_mut() {
        let mut at = 0;
        while at < pieces.len() {
            let winding = |i: usize| &pieces[i].1.winding;
            match (at + 1..pieces.len()).find_map(|j| Some((j, union(winding(at), winding(j))?))) {
                Some((j, both)) => {
                    let (_, other) = pieces.remove(j);
                    pieces[at].1.ids.extend(other.ids);
                    pieces[at].1.winding = both;
                    // Other pieces may fit now.
                    at = 0;
                }
                None => at += 1,
            }
        }
    }
    let mut joined: Vec<(usize, Side)> = rooms.into_values().flatten().collect();
    joined.sort_by_key(|&(order, _)| order);
    joined.into_iter().map(|(_, side)| side).collect()
}

/// The intersections of two rooms' surfaces, once each, then surfaces without a partner.
fn pair(sides: &[Side]) -> Vec<(Side, Option<usize>)> {
    let boxes: Vec<Aabb> = sides.iter().map(|s| Aabb::of(s.winding.iter().copied()).inflated(PAIR)).collect();
    // Sweep along x, so that only neighbours are compared.
    let mut order: Vec<usize> = (0..sides.len()).collect();
    order.sort_by(|&a, &b| boxes[a].min.x.total_cmp(&boxes[b].min.x).then(a.cmp(&b)));
    let mut found = Vec::new();
    for (place, &i) in order.iter().enumerate() {
        for &j in order[place + 1..].iter().take_while(|&&j| boxes[j].min.x <= boxes[i].max.x) {
            if sides[i].room != sides[j].room && boxes[i].touches(&boxes[j]) {
                found.push((i.min(j), i.max(j)));
            }
        }
    }
    found.sort_unstable();
    let mut pairs: Vec<(Side, Option<usize>)> = Vec::new();
    let mut partnered = vec![false; sides.len()];
    for (i, j) in found {
        let (a, b) = (&sides[i], &sides[j]);
        if let Some(winding) = shared(&a.winding, &b.winding) {
            let ids = a.ids.iter().chain(&b.ids).copied().collect();
            pairs.push((Side { ids, room: a.room, winding }, Some(b.room)));
            (partnered[i], partnered[j]) = (true, true);
        }
    }
    pairs.extend(sides.iter().zip(partnered).filter(|(_, partnered)| !partnered).map(|(side, _)| (side.clone(), None)));
    pairs
}

/// Whether two windings lie in one plane.
fn coplanar(a: &[DVec3], b: &[DVec3]) -> bool {
    let Some(normal) = geom::newell(&centred(a)).try_normalize() else { return false };
    let plane = Plane::through(geom::middle(a), normal);
    b.iter().all(|&p| plane.distance(p).abs() < PAIR)
}

/// The part of `a` that `b` covers; `None` if they lie in different planes or hardly touch.
fn shared(a: &[DVec3], b: &[DVec3]) -> Option<Vec<DVec3>> {
    if !coplanar(a, b) {
        return None;
    }
    let normal = geom::newell(&centred(b)).try_normalize()?;
    let mut rest = a.to_vec();
    for (i, &p) in b.iter().enumerate() {
        let out = (b[(i + 1) % b.len()] - p).cross(normal).try_normalize()?;
        rest = geom::clip(&rest, &Plane::through(p, out), SAME);
    }
    tidy(rest).filter(|w| geom::area(&centred(w)) > LEAST)
}

/// The union of two windings if it is convex.
fn union(a: &[DVec3], b: &[DVec3]) -> Option<Vec<DVec3>> {
    if !coplanar(a, b) {
        return None;
    }
    let area = |w: &[DVec3]| geom::area(&centred(w));
    let normal = geom::newell(&centred(a)).try_normalize()?;
    let right = (a[1] - a[0]).try_normalize()?;
    let up = normal.cross(right);
    let flat = a.iter().chain(b).map(|&p| DVec2::new((p - a[0]).dot(right), (p - a[0]).dot(up)));
    let hull: Vec<DVec3> =
        super::rectangle::hull(flat.collect()).into_iter().map(|q| a[0] + right * q.x + up * q.y).collect();
    let covered = area(a) + area(b) - shared(a, b).map_or(0.0, |w| area(&w));
    (area(&hull) <= covered * (1.0 + 1e-3)).then(|| tidy(hull)).flatten()
}

/// Removes collinear and duplicate corners; `None` if the rest is not planar and convex.
fn tidy(mut winding: Vec<DVec3>) -> Option<Vec<DVec3>> {
    winding.dedup_by(|b, a| a.distance(*b) < SAME);
    while winding.len() > 1 && winding[0].distance(winding[winding.len() - 1]) < SAME {
        winding.pop();
    }
    let normal = geom::newell(&centred(&winding)).try_normalize()?;
    let mut i = 0;
    while winding.len() >= 3 && i < winding.len() {
        let n = winding.len();
        let (a, b, c) = (winding[(i + n - 1) % n], winding[i], winding[(i + 1) % n]);
        let height = (c - a).normalize_or_zero().cross(b - a).dot(normal);
        // Positive: a reflex corner.
        if height > SAME {
            return None;
        }
        if height > -SAME {
            winding.remove(i);
            i = 0;
        } else {
            i += 1;
        }
    }
    let plane = Plane::through(*winding.first()?, normal);
    let flat = winding.iter().all(|&p| plane.distance(p).abs() < SAME);
    (winding.len() >= 3 && flat && geom::area(&centred(&winding)) > SAME).then_some(winding)
}

fn centred(winding: &[DVec3]) -> Vec<DVec3> {
    let middle = geom::middle(winding);
    winding.iter().map(|&p| p - middle).collect()
}

struct Reader<'r, 'm> {
    metres: f64,
    decoder: &'r mut EntityDecoder<'m>,
}

impl Reader<'_, '_> {
    /// The outline in the model's coordinates, metres, +Y up. Surfaces are in the room's own frame.
    fn winding(&mut self, boundary: &Boundary, router: &GeometryRouter) -> Option<Vec<DVec3>> {
        let connection = self.entity(boundary.geometry?)?;
        if connection.ifc_type != IfcType::IfcConnectionSurfaceGeometry {
            return None;
        }
        let surface = self.entity(connection.get_ref(0)?)?;
        let space = self.entity(boundary.space)?;
        let frame = DMat4::from_cols_array(&router.resolve_scaled_placement(&space, self.decoder).ok()?);
        let corners = self.surface(&surface)?;
        let corners: Vec<DVec3> = corners.into_iter().map(|p| y_up(frame.transform_point3(p * self.metres))).collect();
        corners.iter().all(|p| p.is_finite()).then_some(corners)
    }

    fn entity(&mut self, id: u32) -> Option<DecodedEntity> {
        self.decoder.decode_by_id(id).ok()
    }

    /// The outline of a surface in the room's frame, in the file's unit.
    fn surface(&mut self, surface: &DecodedEntity) -> Option<Vec<DVec3>> {
        match surface.ifc_type {
            IfcType::IfcCurveBoundedPlane => {
                if surface.get(2).and_then(AttributeValue::as_list).is_some_and(|holes| !holes.is_empty()) {
                    return None;
                }
                let plane = self.entity(surface.get_ref(0)?)?;
                let frame = self.placement(plane.get_ref(0)?)?;
                let outline = self.curve(surface.get_ref(1)?, 0)?;
                Some(outline.into_iter().map(|p| frame.transform_point3(p)).collect())
            }
            IfcType::IfcSurfaceOfLinearExtrusion => {
                let profile = self.entity(surface.get_ref(0)?)?;
                if !profile.ifc_type.is_subtype_of(IfcType::IfcArbitraryOpenProfileDef) {
                    return None;
                }
                let line = self.curve(profile.get_ref(2)?, 0)?;
                let frame = self.optional_placement(surface, 1)?;
                let direction = self.direction(surface.get_ref(2)?)?;
                let up = direction * surface.get_float(3)?;
                let bottom = line.iter().map(|&p| frame.transform_point3(p));
                let top = line.iter().rev().map(|&p| frame.transform_point3(p + up));
                Some(bottom.chain(top).collect())
            }
            IfcType::IfcFaceSurface => {
                let [bound] = surface.get_refs(0)?[..] else { return None };
                let bound = self.entity(bound)?;
                let outline = self.entity(bound.get_ref(0)?)?;
                outline.get_refs(0)?.into_iter().map(|p| self.point(p)).collect()
            }
            _ => None,
        }
    }

    /// The corners of a curve of straight segments.
    fn curve(&mut self, id: u32, depth: usize) -> Option<Vec<DVec3>> {
        let curve = self.entity(id)?;
        match curve.ifc_type {
            IfcType::IfcPolyline => curve.get_refs(0)?.into_iter().map(|p| self.point(p)).collect(),
            IfcType::IfcCompositeCurve if depth < 4 => {
                let mut corners = Vec::new();
                for segment in curve.get_refs(0)? {
                    let segment = self.entity(segment)?;
                    let mut piece = self.curve(segment.get_ref(2)?, depth + 1)?;
                    // For a single closed segment the sense is only its direction.
                    if super::model::enumeration(&segment, 1) == Some("F") {
                        piece.reverse();
                    }
                    corners.extend(piece);
                }
                Some(corners)
            }
            IfcType::IfcIndexedPolyCurve => {
                let straight = curve.get(1).and_then(AttributeValue::as_list).is_none_or(|segments| {
                    segments.iter().all(|s| matches!(s, AttributeValue::Typed { name, .. } if &**name == "IFCLINEINDEX"))
                });
                if !straight {
                    return None;
                }
                let points = self.entity(curve.get_ref(0)?)?;
                points.get(0)?.as_list()?.iter().map(|p| coordinates(p.as_list()?)).collect()
            }
            _ => None,
        }
    }

    fn point(&mut self, id: u32) -> Option<DVec3> {
        let point = self.entity(id)?;
        (point.ifc_type == IfcType::IfcCartesianPoint).then_some(())?;
        coordinates(point.get(0)?.as_list()?)
    }

    fn direction(&mut self, id: u32) -> Option<DVec3> {
        let direction = self.entity(id)?;
        (direction.ifc_type == IfcType::IfcDirection).then_some(())?;
        coordinates(direction.get(0)?.as_list()?)?.try_normalize()
    }

    fn optional_placement(&mut self, entity: &DecodedEntity, slot: usize) -> Option<DMat4> {
        match entity.get_ref(slot) {
            Some(id) => self.placement(id),
            None => Some(DMat4::IDENTITY),
        }
    }

    /// An IfcAxis2Placement3D: Z as given, X perpendicular to it.
    fn placement(&mut self, id: u32) -> Option<DMat4> {
        let placement = self.entity(id)?;
        (placement.ifc_type == IfcType::IfcAxis2Placement3D).then_some(())?;
        let at = self.point(placement.get_ref(0)?)?;
        let z = placement.get_ref(1).map_or(Some(DVec3::Z), |d| self.direction(d))?;
        let x = placement.get_ref(2).map_or(Some(DVec3::X), |d| self.direction(d))?;
        let x = x.reject_from_normalized(z).try_normalize()?;
        Some(DMat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), at.extend(1.0)))
    }
}

/// Two or three numbers.
fn coordinates(list: &[AttributeValue]) -> Option<DVec3> {
    let number = |i: usize| list.get(i).and_then(AttributeValue::as_float).filter(|x| x.is_finite());
    let plan = DVec2::new(number(0)?, number(1)?);
    Some(plan.extend(if list.len() > 2 { number(2)? } else { 0.0 }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(flat: &[(f64, f64)]) -> Vec<DVec3> {
        flat.iter().map(|&(x, z)| DVec3::new(x, 1.0, z)).collect()
    }

    #[test]
    fn windings_are_tidied_and_bent_ones_refused() {
        let square = points(&[(0., 0.), (0., 2.), (1., 2.), (2., 2.), (2., 0.), (0., 0.)]);
        assert_eq!(tidy(square), Some(points(&[(0., 0.), (0., 2.), (2., 2.), (2., 0.)])));
        let arrow = points(&[(0., 0.), (0., 2.), (0.5, 0.5), (2., 0.)]);
        assert_eq!(tidy(arrow.clone()), None);
        assert_eq!(tidy(arrow.into_iter().rev().collect()), None);
        assert_eq!(tidy(points(&[(0., 0.), (1., 1.)])), None);
        let mut bent = points(&[(0., 0.), (0., 2.), (2., 2.), (2., 0.)]);
        bent[0].y = 1.5;
        assert_eq!(tidy(bent), None);
    }

    #[test]
    fn pieces_of_a_room_are_joined_and_shared_with_the_room_behind() {
        let piece = |id, room, from: f64, to: f64| Side {
            ids: vec![id],
            room,
            winding: points(&[(from, 0.), (from, 2.), (to, 2.), (to, 0.)]),
        };
        // Room 0 has 0..1 and 1..5, room 1 has 0.5..6 reversed, room 2 has a separate surface.
        let mut back = piece(3, 1, 0.5, 6.0);
        back.winding.reverse();
        let pairs = pair(&join(vec![piece(1, 0, 0., 1.), piece(2, 0, 1., 5.), back, piece(4, 2, 7., 8.)]));
        assert_eq!(pairs.len(), 2);
        assert_eq!((&pairs[0].0.ids, pairs[0].0.room, pairs[0].1), (&vec![1, 2, 3], 0, Some(1)));
        let x = pairs[0].0.winding.iter().map(|p| p.x);
        let (low, high) = x.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        assert!((low - 0.5).abs() < 1e-9 && (high - 5.0).abs() < 1e-9 && pairs[0].0.winding.len() == 4);
        assert_eq!((&pairs[1].0.ids, pairs[1].1), (&vec![4], None));
    }

    #[test]
    fn pieces_that_make_a_corner_stay_apart() {
        let tall = points(&[(0., 0.), (0., 3.), (1., 3.), (1., 0.)]);
        let low = points(&[(1., 0.), (1., 2.), (4., 2.), (4., 0.)]);
        assert_eq!(union(&tall, &low), None);
        let level = points(&[(1., 0.), (1., 3.), (4., 3.), (4., 0.)]);
        assert_eq!(union(&tall, &level).map(|w| geom::area(&w)), Some(12.0));
    }
}
