//! Relations of elements, openings and spaces: IfcRel records as maps.

use super::model::{Model, enumeration};
use ifc_lite_core::EntityDecoder;
use std::collections::HashMap;

/// A space boundary.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boundary {
    /// Its record.
    pub(super) id: u32,
    /// The IfcSpace.
    pub(super) space: u32,
    /// The element that bounds it.
    pub(super) element: Option<u32>,
    /// IfcConnectionGeometry.
    pub(super) geometry: Option<u32>,
    /// Whether no element is there.
    pub(super) is_virtual: bool,
}

/// The relations of a model; vectors in file order.
#[derive(Debug, Default)]
pub(super) struct Relations {
    /// Host and opening.
    pub(super) voids: Vec<(u32, u32)>,
    /// The elements that fill an opening.
    pub(super) fillings: HashMap<u32, Vec<u32>>,
    /// The opening that an element fills.
    pub(super) opening_of: HashMap<u32, u32>,
    /// The whole of a part, or the spatial container of an element.
    pub(super) parent: HashMap<u32, u32>,
    /// The parts of a whole.
    pub(super) parts: HashMap<u32, Vec<u32>>,
    /// Space boundaries.
    pub(super) boundaries: Vec<Boundary>,
    /// The type of an element.
    pub(super) type_of: HashMap<u32, u32>,
    /// The material of an element or type.
    pub(super) material_of: HashMap<u32, u32>,
}

impl Relations {
    /// Reads the relations; broken records are skipped.
    pub(super) fn read(model: &Model, decoder: &mut EntityDecoder<'_>) -> Self {
        let mut relations = Self::default();
        let r = &mut relations;
        for_each(model, decoder, "IFCRELVOIDSELEMENT", |e| {
            if let (Some(host), Some(opening)) = (e.get_ref(4), e.get_ref(5)) {
                r.voids.push((host, opening));
            }
        });
        for_each(model, decoder, "IFCRELFILLSELEMENT", |e| {
            if let (Some(opening), Some(filling)) = (e.get_ref(4), e.get_ref(5)) {
                r.fillings.entry(opening).or_default().push(filling);
                r.opening_of.entry(filling).or_insert(opening);
            }
        });
        for_each(model, decoder, "IFCRELAGGREGATES", |e| {
            let Some(whole) = e.get_ref(4) else { return };
            for part in e.get_refs(5).unwrap_or_default() {
                r.parent.entry(part).or_insert(whole);
                r.parts.entry(whole).or_default().push(part);
            }
        });
        for_each(model, decoder, "IFCRELCONTAINEDINSPATIALSTRUCTURE", |e| {
            let Some(place) = e.get_ref(5) else { return };
            for element in e.get_refs(4).unwrap_or_default() {
                r.parent.entry(element).or_insert(place);
            }
        });
        for kind in ["IFCRELSPACEBOUNDARY", "IFCRELSPACEBOUNDARY1STLEVEL", "IFCRELSPACEBOUNDARY2NDLEVEL"] {
            for_each(model, decoder, kind, |e| {
                let Some(space) = e.get_ref(4) else { return };
                let is_virtual = enumeration(e, 7) == Some("VIRTUAL");
                r.boundaries.push(Boundary { id: e.id, space, element: e.get_ref(5), geometry: e.get_ref(6), is_virtual });
            });
        }
        for_each(model, decoder, "IFCRELDEFINESBYTYPE", |e| {
            let Some(kind) = e.get_ref(5) else { return };
            for element in e.get_refs(4).unwrap_or_default() {
                r.type_of.entry(element).or_insert(kind);
            }
        });
        for_each(model, decoder, "IFCRELASSOCIATESMATERIAL", |e| {
            let Some(material) = e.get_ref(5) else { return };
            for element in e.get_refs(4).unwrap_or_default() {
                r.material_of.entry(element).or_insert(material);
            }
        });
        relations
    }

    /// The material of an element or of its type.
    pub(super) fn material(&self, element: u32) -> Option<u32> {
        self.material_of.get(&element).or_else(|| self.material_of.get(self.type_of.get(&element)?)).copied()
    }

    /// The first of `element` and its containers, outwards, that `is` accepts.
    pub(super) fn climb<T>(&self, element: u32, is: impl Fn(u32) -> Option<T>) -> Option<T> {
        let mut at = element;
        // Deeper than any building is nested; also ends cycles.
        for _ in 0..64 {
            if let Some(found) = is(at) {
                return Some(found);
            }
            at = *self.parent.get(&at)?;
        }
        None
    }
}

fn for_each(
    model: &Model,
    decoder: &mut EntityDecoder<'_>,
    kind: &'static str,
    mut f: impl FnMut(&ifc_lite_core::DecodedEntity),
) {
    for &id in model.records(kind) {
        if let Ok(entity) = decoder.decode_by_id(id) {
            f(&entity);
        }
    }
}
