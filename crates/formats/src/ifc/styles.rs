//! Surface styles: colours and transparency of representation items, and of materials for items without a style.

use super::model::Model;
use super::relations::Relations;
use enfilade::scene::builder::short_name;
use ifc_lite_core::{DecodedEntity, EntityDecoder, IfcType};
use std::collections::HashMap;
use std::sync::Arc;

/// Transparency, 0 (opaque) to 1, above which a surface is see-through: glass has 0.4 to 0.9. Larger: tinted glass hides rooms.
/// Smaller: materials that a renderer's template left at a few per cent hide nothing.
const SEE_THROUGH: f64 = 0.1;

/// How deep representations may nest.
const DEPTH: usize = 16;

/// A surface style.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Surface {
    /// Made unique if styles with one name differ.
    pub(super) name: String,
    /// Red, green, blue and opacity, linear, 0 to 1.
    pub(super) colour: [f32; 4],
    /// Whether it is see-through.
    is_clear: bool,
}

/// The surfaces of items and materials.
#[derive(Debug, Default)]
pub(super) struct Styles {
    items: HashMap<u32, Arc<Surface>>,
    materials: HashMap<u32, Arc<Surface>>,
}

impl Styles {
    /// Reads the styles of a model.
    pub(super) fn read(model: &Model, decoder: &mut EntityDecoder<'_>) -> Self {
        let mut styles = Self::default();
        let mut reader = Reader::default();
        for &id in model.records("IFCSTYLEDITEM") {
            let Ok(styled) = decoder.decode_by_id(id) else { continue };
            let Some(item) = styled.get_ref(0) else { continue };
            if let Some(surface) = reader.of_styled(decoder, &styled) {
                // Of several styles, a see-through one decides.
                let first = styles.items.remove(&item);
                styles.items.insert(item, clearest([first, Some(surface.clone())].into_iter().flatten()).unwrap_or(surface));
            }
        }
        for &id in model.records("IFCMATERIALDEFINITIONREPRESENTATION") {
            let Ok(definition) = decoder.decode_by_id(id) else { continue };
            let Some(material) = definition.get_ref(3) else { continue };
            for representation in definition.get_refs(2).unwrap_or_default() {
                let items = decoder.decode_by_id(representation).ok().and_then(|r| r.get_refs(3)).unwrap_or_default();
                let surfaces = items.into_iter().filter_map(|item| {
                    let styled = decoder.decode_by_id(item).ok()?;
                    reader.of_styled(decoder, &styled)
                });
                let found = clearest(styles.materials.remove(&material).into_iter().chain(surfaces));
                styles.materials.extend(found.map(|surface| (material, surface)));
            }
        }
        styles
    }

    /// The surfaces of a product's items.
    pub(super) fn of(&self, product: &DecodedEntity, relations: &Relations, decoder: &mut EntityDecoder<'_>) -> Items {
        let material = relations.material(product.id);
        let unstyled_is_clear = material.is_some_and(|m| self.material_is_clear(m, decoder, 0));
        let unstyled = material.and_then(|m| self.of_material(m, decoder, 0));
        let mut items = Items { items: HashMap::new(), unstyled_is_clear, solid: None, clear: None };
        let shapes = product.get_ref(6).and_then(|d| decoder.decode_by_id(d).ok()).and_then(|d| d.get_refs(2));
        for shape in shapes.unwrap_or_default() {
            self.walk(shape, None, decoder, &mut items, 0);
        }
        let (solid, clear) = (&mut items.solid, &mut items.clear);
        let rest = if unstyled_is_clear { clear } else { solid };
        *rest = rest.take().or(unstyled);
        items
    }

    /// Marks the items of a representation; an item without its own style inherits that of its parent.
    fn walk(
        &self,
        representation: u32,
        inherited: Option<&Arc<Surface>>,
        decoder: &mut EntityDecoder<'_>,
        found: &mut Items,
        depth: usize,
    ) {
        let items = decoder.decode_by_id(representation).ok().and_then(|r| r.get_refs(3)).unwrap_or_default();
        for id in items {
            // Stops at known items, which also ends cycles.
            if found.items.contains_key(&id) || depth > DEPTH {
                continue;
            }
            let style = self.style_of(id, decoder).or(inherited);
            found.items.insert(id, style.map_or(found.unstyled_is_clear, |style| style.is_clear));
            if let Some(style) = style {
                let first = if style.is_clear { &mut found.clear } else { &mut found.solid };
                first.get_or_insert_with(|| style.clone());
            }
            let Ok(item) = decoder.decode_by_id(id) else { continue };
            if item.ifc_type == IfcType::IfcMappedItem {
                let source = item.get_ref(0).and_then(|s| decoder.decode_by_id(s).ok()).and_then(|s| s.get_ref(1));
                if let Some(source) = source {
                    self.walk(source, style, decoder, found, depth + 1);
                }
            }
        }
    }

    /// The style of an item; the result of a boolean operation has the style of its first operand.
    fn style_of(&self, item: u32, decoder: &mut EntityDecoder<'_>) -> Option<&Arc<Surface>> {
        let mut at = item;
        for _ in 0..DEPTH {
            if let Some(style) = self.items.get(&at) {
                return Some(style);
            }
            let entity = decoder.decode_by_id(at).ok()?;
            if !entity.ifc_type.is_subtype_of(IfcType::IfcBooleanResult) {
                return None;
            }
            at = entity.get_ref(1)?;
        }
        None
    }

    /// Whether a material is see-through: itself, or all its layers, constituents or profiles.
    fn material_is_clear(&self, material: u32, decoder: &mut EntityDecoder<'_>, depth: usize) -> bool {
        if self.materials.is_empty() || depth > 3 {
            return false;
        }
        if let Some(surface) = self.materials.get(&material) {
            return surface.is_clear;
        }
        let members = members(material, decoder);
        !members.is_empty() && members.into_iter().all(|m| self.material_is_clear(m, decoder, depth + 1))
    }

    /// The surface of a material, else the first of its layers, constituents or profiles.
    fn of_material(&self, material: u32, decoder: &mut EntityDecoder<'_>, depth: usize) -> Option<Arc<Surface>> {
        if self.materials.is_empty() || depth > 3 {
            return None;
        }
        let own = self.materials.get(&material).cloned();
        own.or_else(|| members(material, decoder).into_iter().find_map(|m| self.of_material(m, decoder, depth + 1)))
    }
}

/// The parts of a set of materials.
fn members(material: u32, decoder: &mut EntityDecoder<'_>) -> Vec<u32> {
    let Ok(entity) = decoder.decode_by_id(material) else { return Vec::new() };
    let members = match entity.ifc_type {
        IfcType::IfcMaterialList | IfcType::IfcMaterialLayerSet => entity.get_refs(0),
        IfcType::IfcMaterialLayerSetUsage | IfcType::IfcMaterialLayer => entity.get_ref(0).map(|m| vec![m]),
        IfcType::IfcMaterialConstituentSet | IfcType::IfcMaterialProfileSet => entity.get_refs(2),
        IfcType::IfcMaterialConstituent | IfcType::IfcMaterialProfile => entity.get_ref(2).map(|m| vec![m]),
        IfcType::IfcMaterialProfileSetUsage => entity.get_ref(0).map(|m| vec![m]),
        _ => None,
    };
    members.unwrap_or_default()
}

/// The surfaces of one product's items.
#[derive(Debug)]
pub(super) struct Items {
    /// Whether each item is see-through.
    items: HashMap<u32, bool>,
    /// Whether items without a style are see-through.
    unstyled_is_clear: bool,
    /// The first opaque surface.
    pub(super) solid: Option<Arc<Surface>>,
    /// The first see-through surface.
    pub(super) clear: Option<Arc<Surface>>,
}

impl Items {
    /// Whether any item is see-through.
    pub(super) fn have_clear(&self) -> bool {
        self.unstyled_is_clear || self.items.values().any(|&clear| clear)
    }

    /// Whether an item is see-through.
    pub(super) fn is_clear(&self, item: u32) -> bool {
        self.items.get(&item).copied().unwrap_or(self.unstyled_is_clear)
    }
}

/// Reads surface styles, each once.
#[derive(Default)]
struct Reader {
    known: HashMap<u32, Option<Arc<Surface>>>,
    names: HashMap<String, Arc<Surface>>,
}

impl Reader {
    /// The surface of a styled item.
    fn of_styled(&mut self, decoder: &mut EntityDecoder<'_>, styled: &DecodedEntity) -> Option<Arc<Surface>> {
        let styles = styled.get_refs(1).unwrap_or_default();
        clearest(styles.into_iter().filter_map(|style| self.of_style(decoder, style, 0)))
    }

    fn of_style(&mut self, decoder: &mut EntityDecoder<'_>, style: u32, depth: usize) -> Option<Arc<Surface>> {
        if let Some(known) = self.known.get(&style) {
            return known.clone();
        }
        if depth > 4 {
            return None;
        }
        let entity = decoder.decode_by_id(style).ok()?;
        let mut of_all = |styles: Option<Vec<u32>>| {
            clearest(styles.unwrap_or_default().into_iter().filter_map(|s| self.of_style(decoder, s, depth + 1)))
        };
        let surface = match entity.ifc_type {
            IfcType::IfcSurfaceStyleRendering | IfcType::IfcSurfaceStyleShading => Some(Arc::new(shading(decoder, &entity))),
            IfcType::IfcPresentationStyleAssignment => of_all(entity.get_refs(0)),
            IfcType::IfcSurfaceStyle => of_all(entity.get_refs(2)).map(|surface| self.named(&surface, style, &entity)),
            _ => None,
        };
        self.known.insert(style, surface.clone());
        surface
    }

    /// A surface with the name of its style.
    fn named(&mut self, surface: &Surface, style: u32, entity: &DecodedEntity) -> Arc<Surface> {
        let name = short_name(entity.get_string(0).filter(|name| !name.is_empty()).unwrap_or("style"));
        let named = |name: String| Arc::new(Surface { name, ..surface.clone() });
        let first = self.names.entry(name.clone()).or_insert_with(|| named(name.clone()));
        if **first == *named(name.clone()) { first.clone() } else { named(format!("{name} #{style}")) }
    }
}

/// The first see-through surface, else the first.
fn clearest(surfaces: impl Iterator<Item = Arc<Surface>>) -> Option<Arc<Surface>> {
    surfaces.reduce(|a, b| if b.is_clear && !a.is_clear { b } else { a })
}

/// The surface of IfcSurfaceStyleShading or IfcSurfaceStyleRendering.
fn shading(decoder: &mut EntityDecoder<'_>, entity: &DecodedEntity) -> Surface {
    let transparency = entity.get_float(1).unwrap_or(0.0);
    let rgb = entity.get_ref(0).and_then(|colour| decoder.decode_by_id(colour).ok());
    // The file has sRGB values.
    let linear = |part: usize| {
        let given = rgb.as_ref().and_then(|rgb| rgb.get_float(part)).unwrap_or(0.6);
        given.clamp(0.0, 1.0).powf(2.2) as f32
    };
    let colour = [linear(1), linear(2), linear(3), (1.0 - transparency).clamp(0.0, 1.0) as f32];
    Surface { name: String::new(), colour, is_clear: transparency > SEE_THROUGH }
}
