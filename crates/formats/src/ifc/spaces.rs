//! Storeys and rooms: IfcBuildingStorey and IfcSpace.

use super::geometry::Geometry;
use super::model::{Model, enumeration, global_id, text};
use super::relations::Relations;
use enfilade::scene::{RoomHint, StoreyHint};
use enfilade::types::note::Note;
use ifc_lite_core::{DecodedEntity, EntityDecoder, IfcType};
use ifc_lite_geometry::GeometryRouter;
use std::collections::HashMap;

/// Storeys as hints, ascending, with an index by record.
#[derive(Debug, Default)]
pub(super) struct Storeys {
    /// The hints.
    pub(super) hints: Vec<StoreyHint>,
    index: HashMap<u32, usize>,
}

/// Rooms as hints, in file order, with an index by record.
#[derive(Debug, Default)]
pub(super) struct Rooms {
    /// The hints.
    pub(super) hints: Vec<RoomHint>,
    /// Index into `hints` by record.
    pub(super) index: HashMap<u32, usize>,
}

/// Reads the storeys. The floor of a storey is its placement; if an exporter leaves all placements at one height, it is
/// `Elevation`.
pub(super) fn storeys(model: &Model, decoder: &mut EntityDecoder<'_>, router: &GeometryRouter) -> Storeys {
    let mut found = Vec::new();
    for product in model.products.iter().filter(|p| p.kind.is_subtype_of(IfcType::IfcBuildingStorey)) {
        let Ok(entity) = decoder.decode_by_id(product.id) else { continue };
        let placed = router.resolve_scaled_placement(&entity, decoder).ok().map(|m| m[14]).filter(|z| z.is_finite());
        let written = entity.get_float(9).map(|e| e * model.metres).filter(|z| z.is_finite());
        let name = text(&entity, 2).or_else(|| text(&entity, 7)).unwrap_or("storey").to_owned();
        found.push((product.id, name, placed, written));
    }
    let spread = |heights: &mut dyn Iterator<Item = f64>| {
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        high - low > 1e-3
    };
    let flat = !spread(&mut found.iter().filter_map(|f| f.2)) && spread(&mut found.iter().filter_map(|f| f.3));
    let mut storeys: Vec<(u32, StoreyHint)> = found
        .into_iter()
        .map(|(id, name, placed, written)| {
            let elevation = if flat { written.or(placed) } else { placed.or(written) }.unwrap_or(0.0);
            (id, StoreyHint { name, elevation })
        })
        .collect();
    storeys.sort_by(|a, b| a.1.elevation.total_cmp(&b.1.elevation));
    let index = storeys.iter().enumerate().map(|(i, s)| (s.0, i)).collect();
    Storeys { hints: storeys.into_iter().map(|s| s.1).collect(), index }
}

/// Reads the rooms. Spaces without a shape, and gross floor areas, which overlap rooms, are left out with a note.
pub(super) fn rooms(
    model: &Model,
    decoder: &mut EntityDecoder<'_>,
    relations: &Relations,
    geometry: &Geometry,
    storeys: &Storeys,
    notes: &mut Vec<Note>,
) -> Rooms {
    let mut rooms = Rooms::default();
    let (mut gross, mut shapeless) = (0, 0);
    for product in model.products.iter().filter(|p| p.kind.is_subtype_of(IfcType::IfcSpace)) {
        let Ok(entity) = decoder.decode_by_id(product.id) else { continue };
        if enumeration(&entity, 9) == Some("GFA") {
            gross += 1;
            continue;
        }
        let surface: Vec<_> = geometry.get(product.id).map(|b| b.whole().corners().collect()).unwrap_or_default();
        if surface.is_empty() {
            shapeless += 1;
            continue;
        }
        rooms.index.insert(product.id, rooms.hints.len());
        rooms.hints.push(RoomHint {
            id: global_id(&entity),
            name: room_name(&entity),
            storey: relations.climb(product.id, |id| storeys.index.get(&id).copied()),
            surface,
            outside: is_outside(&entity),
            drawn: true,
        });
    }
    if gross > 0 {
        notes.push(Note::detail(format!("{gross} gross floor areas do not count as rooms")));
    }
    if shapeless > 0 {
        notes.push(Note::fault(format!("{shapeless} spaces without a shape left out")));
    }
    rooms
}

/// Number and name, as on a plan: `A102 Living Room`.
fn room_name(space: &DecodedEntity) -> String {
    match (text(space, 2), text(space, 7)) {
        (Some(number), Some(name)) if number != name => format!("{number} {name}"),
        (Some(name), _) | (None, Some(name)) => name.to_owned(),
        (None, None) => format!("#{}", space.id),
    }
}

/// IFC2x3 has `InteriorOrExteriorSpace`, IFC4 `PredefinedType`; otherwise `ObjectType` may name it.
fn is_outside(space: &DecodedEntity) -> bool {
    enumeration(space, 9) == Some("EXTERNAL")
        || text(space, 4).is_some_and(|t| {
            let t = t.to_ascii_lowercase();
            ["external", "exterior", "outside", "outdoor"].iter().any(|word| t.contains(word))
        })
}
