//! Virtual space boundaries: where two rooms meet without a wall.

use super::model::{Model, global_id, y_up};
use super::relations::{Boundary, Relations};
use super::spaces::Rooms;
use crate::geom::{self, Plane};
use crate::scene::{OpeningHint, OpeningKind};
use glam::{DMat4, DVec2, DVec3};
use ifc_lite_core::{AttributeValue, DecodedEntity, EntityDecoder, IfcType};
use ifc_lite_geometry::GeometryRouter;

/// Corners this near to each other, metres, are one; corners this near to a plane lie in it.
const SAME: f64 = 1e-4;

/// Two rooms' drawings of one boundary may differ by this much, metres.
const PAIR: f64 = 0.02;

/// Reads the virtual boundaries. Each side of one is drawn by its own room; the two are joined into one opening. Boundaries
/// that aren't bounded plane surfaces, or aren't convex, are left out with a note.
pub(super) fn boundaries(
    model: &Model,
    decoder: &mut EntityDecoder<'_>,
    router: &GeometryRouter,
    relations: &Relations,
    rooms: &Rooms,
    notes: &mut Vec<String>,
) -> Vec<OpeningHint> {
    let mut hints: Vec<OpeningHint> = Vec::new();
    let mut skipped = 0;
    for boundary in relations.boundaries.iter().filter(|b| b.is_virtual) {
        let Some(&room) = rooms.index.get(&boundary.space) else { continue };
        let Some(winding) = Reader { metres: model.metres, decoder }.winding(boundary, router).and_then(tidy) else {
            skipped += 1;
            continue;
        };
        match hints.iter_mut().find(|h| is_same(&h.winding, &winding)) {
            Some(hint) if hint.rooms.contains(&Some(room)) => {}
            Some(hint) if hint.rooms[1].is_none() => hint.rooms[1] = Some(room),
            _ => {
                let id = decoder.decode_by_id(boundary.id).map_or_else(|_| format!("#{}", boundary.id), |e| global_id(&e));
                let rooms = [Some(room), None];
                hints.push(OpeningHint { id, kind: OpeningKind::Virtual, winding, thickness: 0.0, rooms });
            }
        }
    }
    if skipped > 0 {
        notes.push(format!("{skipped} virtual boundaries left out: not convex pieces of a plane"));
    }
    hints
}

/// Corners on a line or on each other dropped; `None` unless what is left is planar and convex.
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
        // Positive: left of the way from a to c, so the corner is bent inwards.
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

/// Whether two windings are the same piece of the same plane.
fn is_same(a: &[DVec3], b: &[DVec3]) -> bool {
    let near = |from: &[DVec3], to: &[DVec3]| from.iter().all(|p| to.iter().any(|q| p.distance(*q) < PAIR));
    near(a, b) && near(b, a)
}

struct Reader<'r, 'm> {
    metres: f64,
    decoder: &'r mut EntityDecoder<'m>,
}

impl Reader<'_, '_> {
    /// The outline in the model's coordinates, metres, +Y up. Surfaces are drawn in the room's own frame.
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

    /// The corners of a curve made of straight pieces.
    fn curve(&mut self, id: u32, depth: usize) -> Option<Vec<DVec3>> {
        let curve = self.entity(id)?;
        match curve.ifc_type {
            IfcType::IfcPolyline => curve.get_refs(0)?.into_iter().map(|p| self.point(p)).collect(),
            IfcType::IfcCompositeCurve if depth < 4 => {
                let mut corners = Vec::new();
                for segment in curve.get_refs(0)? {
                    let segment = self.entity(segment)?;
                    let mut piece = self.curve(segment.get_ref(2)?, depth + 1)?;
                    // Of a single closed piece the sense only says which way round.
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

    /// An IfcAxis2Placement3D: Z as given, X made perpendicular to it.
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
}
