//! What is see-through: surface styles of representation items, and of materials where an item has none.

use super::model::Model;
use super::relations::Relations;
use ifc_lite_core::{DecodedEntity, EntityDecoder, IfcType};
use std::collections::{HashMap, HashSet};

/// Transparency above which one sees what is behind, 0 (opaque) to 1: glass is given as 0.4 to 0.9. Larger: tinted glass
/// would hide rooms. Smaller: materials that a renderer's template left at a few per cent would let everything through.
const SEE_THROUGH: f64 = 0.1;

/// How deep representations may nest.
const DEPTH: usize = 16;

/// Which items and materials are see-through.
#[derive(Debug, Default)]
pub(super) struct Styles {
    items: HashMap<u32, bool>,
    materials: HashSet<u32>,
}

impl Styles {
    /// Reads the styles of a model.
    pub(super) fn read(model: &Model, decoder: &mut EntityDecoder<'_>) -> Self {
        let mut styles = Self::default();
        let mut known = HashMap::new();
        for &id in model.records("IFCSTYLEDITEM") {
            let Ok(styled) = decoder.decode_by_id(id) else { continue };
            let Some(item) = styled.get_ref(0) else { continue };
            let clear = is_clear(decoder, &styled, &mut known);
            // Of several styles, one that lets light through decides.
            *styles.items.entry(item).or_default() |= clear;
        }
        for &id in model.records("IFCMATERIALDEFINITIONREPRESENTATION") {
            let Ok(definition) = decoder.decode_by_id(id) else { continue };
            let Some(material) = definition.get_ref(3) else { continue };
            for representation in definition.get_refs(2).unwrap_or_default() {
                let items = decoder.decode_by_id(representation).ok().and_then(|r| r.get_refs(3)).unwrap_or_default();
                for item in items {
                    if decoder.decode_by_id(item).is_ok_and(|styled| is_clear(decoder, &styled, &mut known)) {
                        styles.materials.insert(material);
                    }
                }
            }
        }
        styles
    }

    /// The see-through items of a product, and whether items without a style are: `None` if nothing of it is see-through.
    pub(super) fn clear_items(
        &self,
        product: &DecodedEntity,
        relations: &Relations,
        decoder: &mut EntityDecoder<'_>,
    ) -> Option<ClearItems> {
        let unstyled = relations.material(product.id).is_some_and(|m| self.material_is_clear(m, decoder, 0));
        let mut clear = ClearItems { items: HashMap::new(), unstyled };
        let shapes = product.get_ref(6).and_then(|d| decoder.decode_by_id(d).ok()).and_then(|d| d.get_refs(2));
        for shape in shapes.unwrap_or_default() {
            self.walk(shape, None, decoder, &mut clear, 0);
        }
        (clear.unstyled || clear.items.values().any(|&c| c)).then_some(clear)
    }

    /// Marks the items of a representation; an item without a style of its own takes that of the item that holds it.
    fn walk(
        &self,
        representation: u32,
        inherited: Option<bool>,
        decoder: &mut EntityDecoder<'_>,
        clear: &mut ClearItems,
        depth: usize,
    ) {
        let items = decoder.decode_by_id(representation).ok().and_then(|r| r.get_refs(3)).unwrap_or_default();
        for id in items {
            // Whatever was seen before ends here, so circles do too.
            if clear.items.contains_key(&id) || depth > DEPTH {
                continue;
            }
            let style = self.style_of(id, decoder).or(inherited);
            clear.items.insert(id, style.unwrap_or(clear.unstyled));
            let Ok(item) = decoder.decode_by_id(id) else { continue };
            if item.ifc_type == IfcType::IfcMappedItem {
                let source = item.get_ref(0).and_then(|s| decoder.decode_by_id(s).ok()).and_then(|s| s.get_ref(1));
                if let Some(source) = source {
                    self.walk(source, style, decoder, clear, depth + 1);
                }
            }
        }
    }

    /// The style of an item; what a boolean operation leaves of its first operand keeps that operand's style.
    fn style_of(&self, item: u32, decoder: &mut EntityDecoder<'_>) -> Option<bool> {
        let mut at = item;
        for _ in 0..DEPTH {
            if let Some(&clear) = self.items.get(&at) {
                return Some(clear);
            }
            let entity = decoder.decode_by_id(at).ok()?;
            if !entity.ifc_type.is_subtype_of(IfcType::IfcBooleanResult) {
                return None;
            }
            at = entity.get_ref(1)?;
        }
        None
    }

    /// A material, or a set of layers, constituents, profiles all of which are see-through.
    fn material_is_clear(&self, material: u32, decoder: &mut EntityDecoder<'_>, depth: usize) -> bool {
        if self.materials.is_empty() || depth > 3 {
            return false;
        }
        if self.materials.contains(&material) {
            return true;
        }
        let Ok(entity) = decoder.decode_by_id(material) else { return false };
        let members = match entity.ifc_type {
            IfcType::IfcMaterialList | IfcType::IfcMaterialLayerSet => entity.get_refs(0),
            IfcType::IfcMaterialLayerSetUsage | IfcType::IfcMaterialLayer => entity.get_ref(0).map(|m| vec![m]),
            IfcType::IfcMaterialConstituentSet | IfcType::IfcMaterialProfileSet => entity.get_refs(2),
            IfcType::IfcMaterialConstituent | IfcType::IfcMaterialProfile => entity.get_ref(2).map(|m| vec![m]),
            IfcType::IfcMaterialProfileSetUsage => entity.get_ref(0).map(|m| vec![m]),
            _ => None,
        };
        let members = members.unwrap_or_default();
        !members.is_empty() && members.into_iter().all(|m| self.material_is_clear(m, decoder, depth + 1))
    }
}

/// Which representation items of one product are see-through.
#[derive(Debug)]
pub(super) struct ClearItems {
    items: HashMap<u32, bool>,
    unstyled: bool,
}

impl ClearItems {
    /// Whether an item is.
    pub(super) fn contains(&self, item: u32) -> bool {
        self.items.get(&item).copied().unwrap_or(self.unstyled)
    }
}

/// Whether a styled item's styles let light through. `known` holds the answer for styles seen before.
fn is_clear(decoder: &mut EntityDecoder<'_>, styled: &DecodedEntity, known: &mut HashMap<u32, bool>) -> bool {
    styled.get_refs(1).unwrap_or_default().into_iter().any(|style| style_is_clear(decoder, style, known, 0))
}

fn style_is_clear(decoder: &mut EntityDecoder<'_>, style: u32, known: &mut HashMap<u32, bool>, depth: usize) -> bool {
    if let Some(&clear) = known.get(&style) {
        return clear;
    }
    if depth > 4 {
        return false;
    }
    let Ok(entity) = decoder.decode_by_id(style) else { return false };
    let clear = match entity.ifc_type {
        IfcType::IfcSurfaceStyleRendering | IfcType::IfcSurfaceStyleShading => {
            entity.get_float(1).is_some_and(|transparency| transparency > SEE_THROUGH)
        }
        IfcType::IfcPresentationStyleAssignment => {
            entity.get_refs(0).unwrap_or_default().into_iter().any(|s| style_is_clear(decoder, s, known, depth + 1))
        }
        IfcType::IfcSurfaceStyle => {
            entity.get_refs(2).unwrap_or_default().into_iter().any(|s| style_is_clear(decoder, s, known, depth + 1))
        }
        _ => false,
    };
    known.insert(style, clear);
    clear
}
