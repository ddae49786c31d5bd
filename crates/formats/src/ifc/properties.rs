//! Reads [`Elements`]: the types of elements, and their sets of properties and quantities.
//!
//! Memory is bounded by the size of the file: sets and types are shared, long texts are cut, and [`Reader::left`] limits what a
//! hostile file repeats.

use super::model::{global_id, settle_envelope, text};
use super::reader::{time_limit, watched};
use super::roles::role;
use crate::elements::{Element, ElementType, Elements, Property, PropertySet, Value};
use enfilade::scene::ImportError;
use ifc_lite_core::{
    AttributeValue, DecodedEntity, EntityDecoder, EntityIndex, EntityScanner, IfcType, ProjectUnits, build_entity_index,
    geometry_flags_by_name, ifc_type_from_keyword, resolve_unit_by_ref, set_report_sink,
};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

/// Longer texts are cut to this many letters: a property is a row of a table.
const LONGEST: usize = 400;
/// Maximum values of a list.
const MOST_VALUES: usize = 50;
/// Maximum nesting of complex properties; also ends cycles.
const DEPTH: usize = 3;
/// Limit of kept bytes for each byte of the file, beside [`LEAST`]. Real files need less than one: they write each value once.
const KEPT: usize = 4;
/// See [`KEPT`].
const LEAST: usize = 1 << 20;
/// Approximate bytes of a property, a set or an element without its texts.
const EACH: usize = 64;
/// Bytes of a reference.
const REFERENCE: usize = 8;

/// Reads the bytes of an IFC file; as [`super::elements`].
pub fn elements_of_bytes(bytes: Vec<u8>) -> Result<Elements, ImportError> {
    let mut bytes = bytes;
    settle_envelope(&mut bytes)?;
    // Library code on unchecked data: it gets a deadline, and panics are caught.
    let deadline = Instant::now() + time_limit(bytes.len());
    watched(deadline, bytes, |bytes| {
        set_report_sink(|_| ());
        let records = Records::scan(&bytes);
        Reader::new(&bytes, &records).read(&records)
    })
}

/// The relevant records, in file order.
#[derive(Default)]
struct Records {
    index: Arc<EntityIndex>,
    products: Vec<(u32, IfcType)>,
    by_type: Vec<u32>,
    by_properties: Vec<u32>,
    project: Option<u32>,
}

impl Records {
    fn scan(bytes: &[u8]) -> Self {
        let mut records = Self { index: Arc::new(build_entity_index(bytes)), ..Self::default() };
        let mut scanner = EntityScanner::new(bytes);
        while let Some((id, keyword, start, end)) = scanner.next_entity() {
            // As in an import, the last record of a number counts.
            if records.index.get(&id) != Some(&(start, end)) {
                continue;
            }
            let (geometry, spatial) = geometry_flags_by_name(keyword);
            if geometry || spatial {
                let kind = ifc_type_from_keyword(keyword);
                if role(&kind).is_some() || kind.is_subtype_of(IfcType::IfcSpace) {
                    records.products.push((id, kind));
                }
            } else if keyword.eq_ignore_ascii_case("IFCRELDEFINESBYPROPERTIES") {
                records.by_properties.push(id);
            } else if keyword.eq_ignore_ascii_case("IFCRELDEFINESBYTYPE") {
                records.by_type.push(id);
            } else if keyword.eq_ignore_ascii_case("IFCPROJECT") {
                records.project.get_or_insert(id);
            }
        }
        records
    }
}

/// State of reading.
struct Reader<'b> {
    decoder: EntityDecoder<'b>,
    units: ProjectUnits,
    sets: HashMap<u32, Option<Arc<PropertySet>>>,
    types: HashMap<u32, Option<Arc<ElementType>>>,
    /// Bytes that may still be kept.
    left: usize,
    /// Dangling references.
    dangling: usize,
}

impl<'b> Reader<'b> {
    fn new(bytes: &'b [u8], records: &Records) -> Self {
        let mut decoder = EntityDecoder::with_arc_index(bytes, records.index.clone()).with_strict_reals();
        let units = records.project.map(|project| ProjectUnits::resolve(&mut decoder, project)).unwrap_or_default();
        let left = bytes.len().saturating_mul(KEPT).saturating_add(LEAST);
        Self { decoder, units, sets: HashMap::new(), types: HashMap::new(), left, dangling: 0 }
    }

    fn read(mut self, records: &Records) -> Elements {
        // 1. The elements.
        let (mut all, mut places) = (Vec::new(), HashMap::new());
        for (id, kind) in &records.products {
            let Some(element) = self.element(*id, kind) else { continue };
            places.insert(*id, all.len());
            all.push(element);
        }
        // 2. Their types; the first one counts.
        for &id in &records.by_type {
            let Some((elements, related)) = self.relation(id) else { continue };
            let Some(kind) = related.first().and_then(|&kind| self.kind(kind)) else { continue };
            for place in elements.iter().filter_map(|id| places.get(id)) {
                all[*place].kind.get_or_insert_with(|| kind.clone());
            }
        }
        // 3. Their sets.
        for &id in &records.by_properties {
            let Some((elements, related)) = self.relation(id) else { continue };
            let sets: Vec<Arc<PropertySet>> = related.into_iter().filter_map(|set| self.set(set)).collect();
            for place in elements.iter().filter_map(|id| places.get(id)) {
                let room = sets.len().min(self.left / REFERENCE);
                self.keep(REFERENCE * room);
                all[*place].sets.extend(sets[..room].iter().cloned());
            }
        }
        let mut notes = Vec::new();
        if self.dangling > 0 {
            notes.push(format!("{} references to types, sets and properties have no target", self.dangling));
        }
        if self.left < EACH {
            notes.push("some properties are left out: the file repeats them too often".into());
        }
        Elements::new(all, notes)
    }

    /// Whether this many more bytes fit; takes them.
    fn keep(&mut self, bytes: usize) -> bool {
        let fits = bytes <= self.left;
        // The first that does not fit ends reading.
        self.left = if fits { self.left - bytes } else { 0 };
        fits
    }

    /// A record; counts dangling references.
    fn record(&mut self, id: u32) -> Option<DecodedEntity> {
        let found = self.decoder.decode_by_id(id).ok();
        self.dangling += usize::from(found.is_none());
        found
    }

    /// A text of a record, cut to [`LONGEST`].
    fn text(&mut self, entity: &DecodedEntity, slot: usize) -> Option<String> {
        let found = cut(text(entity, slot)?);
        self.keep(found.len()).then_some(found)
    }

    fn element(&mut self, id: u32, kind: &IfcType) -> Option<Element> {
        let entity = self.record(id)?;
        let is_space = kind.is_subtype_of(IfcType::IfcSpatialElement);
        let last = self.text(&entity, 7);
        let (long_name, tag) = if is_space { (last, None) } else { (None, last) };
        self.keep(EACH).then(|| Element {
            global_id: global_id(&entity),
            class: kind.name().to_owned(),
            name: self.text(&entity, 2),
            long_name,
            tag,
            object_type: self.text(&entity, 4),
            kind: None,
            sets: Vec::new(),
        })
    }

    /// The elements of a relation, and what it relates them to.
    fn relation(&mut self, id: u32) -> Option<(Vec<u32>, Vec<u32>)> {
        let entity = self.record(id)?;
        let related = match entity.get(5)? {
            AttributeValue::EntityRef(id) => vec![*id],
            // IfcPropertySetDefinitionSet.
            many => references(many.unwrap_typed()),
        };
        Some((entity.get_refs(4).unwrap_or_default(), related))
    }

    fn kind(&mut self, id: u32) -> Option<Arc<ElementType>> {
        if let Some(known) = self.types.get(&id) {
            return known.clone();
        }
        let found = self.record(id).filter(|entity| entity.ifc_type.is_subtype_of(IfcType::IfcTypeObject)).map(|entity| {
            let sets = entity.get_refs(5).unwrap_or_default();
            let sets: Vec<_> = sets.into_iter().filter_map(|set| self.set(set)).collect();
            let name = self.text(&entity, 2);
            Arc::new(ElementType { global_id: global_id(&entity), class: entity.ifc_type.name().to_owned(), name, sets })
        });
        self.types.insert(id, found.clone());
        found
    }

    /// A set of properties or quantities; other sets, such as the measures of a door's panel, are skipped.
    fn set(&mut self, id: u32) -> Option<Arc<PropertySet>> {
        if let Some(known) = self.sets.get(&id) {
            let known = known.clone();
            return known.filter(|_| self.keep(REFERENCE));
        }
        let found = self.record(id).and_then(|entity| {
            let (slot, is_quantities) = match entity.ifc_type {
                IfcType::IfcPropertySet => (4, false),
                IfcType::IfcElementQuantity => (5, true),
                _ => return None,
            };
            let name = self.text(&entity, 2).unwrap_or_else(|| "properties".into());
            let mut properties = Vec::new();
            for property in entity.get_refs(slot).unwrap_or_default() {
                self.property(property, "", &mut properties, 0);
            }
            self.keep(EACH).then(|| Arc::new(PropertySet { name, is_quantities, properties }))
        });
        self.sets.insert(id, found.clone());
        found
    }

    /// Adds a property; parts of a complex one get both names.
    fn property(&mut self, id: u32, within: &str, out: &mut Vec<Property>, depth: usize) {
        if depth > DEPTH || !self.keep(REFERENCE) {
            return;
        }
        let Some(entity) = self.record(id) else { return };
        let own = text(&entity, 0).map_or_else(|| "?".to_owned(), cut);
        let name = if within.is_empty() { own } else { cut(&format!("{within}: {own}")) };
        let inner = match entity.ifc_type {
            IfcType::IfcComplexProperty => Some(3),
            IfcType::IfcPhysicalComplexQuantity => Some(2),
            _ => None,
        };
        if let Some(slot) = inner {
            for part in entity.get_refs(slot).unwrap_or_default() {
                self.property(part, &name, out, depth + 1);
            }
            return;
        }
        let Some(value) = self.value(&entity) else { return };
        let bytes = match &value {
            Value::Text(text) => text.len(),
            Value::Number(..) => 0,
        };
        if self.keep(EACH + name.len() + bytes) {
            out.push(Property { name, value });
        }
    }

    fn value(&mut self, entity: &DecodedEntity) -> Option<Value> {
        let quantity = match entity.ifc_type {
            IfcType::IfcPropertySingleValue => return self.simple(entity.get(2)?, entity.get_ref(3)),
            IfcType::IfcPropertyEnumeratedValue => return self.list(entity.get(2)?, None),
            IfcType::IfcPropertyListValue => return self.list(entity.get(2)?, entity.get_ref(3)),
            IfcType::IfcPropertyBoundedValue => return self.bounds(entity),
            IfcType::IfcQuantityLength => "IFCLENGTHMEASURE",
            IfcType::IfcQuantityArea => "IFCAREAMEASURE",
            IfcType::IfcQuantityVolume => "IFCVOLUMEMEASURE",
            IfcType::IfcQuantityWeight => "IFCMASSMEASURE",
            IfcType::IfcQuantityTime => "IFCTIMEMEASURE",
            IfcType::IfcQuantityCount => "IFCCOUNTMEASURE",
            _ => return None,
        };
        let number = entity.get_float(3).filter(|x| x.is_finite())?;
        Some(Value::Number(number, self.unit(Some(quantity), entity.get_ref(2))))
    }

    /// A single value, with its own unit or that of the project.
    fn simple(&mut self, value: &AttributeValue, unit: Option<u32>) -> Option<Value> {
        let measure = value.as_typed().map(|(name, _)| name);
        match value.unwrap_typed() {
            AttributeValue::String(text) => Some(Value::Text(cut(text.trim()))).filter(|v| *v != Value::Text(String::new())),
            AttributeValue::Integer(number) => Some(Value::Number(*number as f64, self.unit(measure, unit))),
            AttributeValue::Float(number) if number.is_finite() => Some(Value::Number(*number, self.unit(measure, unit))),
            AttributeValue::Enum(word) => Some(Value::Text(match value.as_logical() {
                None => cut(word),
                Some(logical) => logical.to_bool().map_or("unknown".to_owned(), |is| is.to_string()),
            })),
            _ => None,
        }
    }

    fn list(&mut self, values: &AttributeValue, unit: Option<u32>) -> Option<Value> {
        let values = values.as_list()?;
        let shown: Vec<Value> = values.iter().take(MOST_VALUES).filter_map(|value| self.simple(value, unit)).collect();
        match &shown[..] {
            [] => None,
            [one] => Some(one.clone()),
            many => {
                let many: Vec<String> = many.iter().map(Value::to_string).collect();
                Some(Value::Text(cut(&many.join(", "))))
            }
        }
    }

    fn bounds(&mut self, entity: &DecodedEntity) -> Option<Value> {
        let unit = entity.get_ref(4);
        let [upper, lower, set] = [2, 3, 5].map(|slot| entity.get(slot).and_then(|value| self.simple(value, unit)));
        let range = match (lower, upper) {
            (Some(lower), Some(upper)) => format!("{lower} to {upper}"),
            (Some(lower), None) => format!("{lower} or more"),
            (None, Some(upper)) => format!("{upper} or less"),
            (None, None) => return set,
        };
        Some(Value::Text(cut(&set.map_or(range.clone(), |set| format!("{set} ({range})")))))
    }

    fn unit(&mut self, measure: Option<&str>, unit: Option<u32>) -> Option<String> {
        let given = unit.and_then(|unit| resolve_unit_by_ref(&mut self.decoder, unit)).map(|(_, unit, _)| unit);
        let unit = given.or_else(|| self.units.unit_for_measure(measure?))?;
        Some(cut(&unit.symbol)).filter(|symbol| !symbol.is_empty())
    }
}

fn references(list: &AttributeValue) -> Vec<u32> {
    list.as_list().unwrap_or_default().iter().filter_map(AttributeValue::as_entity_ref).collect()
}

/// Cuts a text to [`LONGEST`].
fn cut(text: &str) -> String {
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
