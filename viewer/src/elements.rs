//! Elements of an IFC model with their properties: read from the model at the first pick or search.

use crate::building::Building;
use enfilade::{CellId, ObjectId};
use enfilade_formats::elements;
use enfilade_formats::elements::{Element, Elements};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Elements of a model, read at the first use.
#[derive(Clone, Default)]
pub struct Author {
    model: Option<PathBuf>,
    read: Arc<OnceLock<Elements>>,
}

/// A set of properties or quantities: its title, and names and values.
#[derive(Clone, PartialEq, Debug)]
pub struct Sheet {
    /// The set's name.
    pub title: String,
    /// Names and values.
    pub rows: Vec<(String, String)>,
}

impl Author {
    /// Of a model.
    pub fn of(model: &Path) -> Self {
        Self { model: Some(model.to_owned()), read: Arc::default() }
    }

    /// Its elements; the first call reads them. What can't be read is told in the terminal, once, and is nothing.
    pub fn elements(&self) -> &Elements {
        self.read.get_or_init(|| {
            let Some(model) = &self.model else { return Elements::default() };
            let read = elements(model).unwrap_or_else(|e| {
                eprintln!("{}: {e}", model.display());
                Elements::default()
            });
            read.notes.iter().for_each(|note| eprintln!("{}: {note}", model.display()));
            read
        })
    }
}

/// The element of an object.
pub fn of_object(building: &Building, object: ObjectId) -> Option<&Element> {
    building.author.elements().get(&building.scene.objects[object.index()].node)
}

/// The space of a cell.
pub fn of_cell(building: &Building, cell: CellId) -> Option<&Element> {
    building.author.elements().get(building.file.cells[cell.index()].source.as_deref()?)
}

/// Name, class, type and ids of an element.
pub fn facts(element: &Element) -> Vec<(&'static str, String)> {
    let told = |name: &'static str, value: Option<&str>| value.map(|value| (name, value.to_owned()));
    [
        told("Name", element.name.as_deref()),
        told("Long name", element.long_name.as_deref()),
        told("Class", Some(&element.class)),
        told("Type", element.type_name()),
        told("GlobalId", Some(&element.global_id)),
        told("Tag", element.tag.as_deref()),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Its properties and quantities by set; those of its type last.
pub fn sheets(element: &Element) -> Vec<Sheet> {
    let own = element.sets.len();
    let sheet = |(i, set): (usize, &Arc<enfilade_formats::elements::PropertySet>)| Sheet {
        title: if i < own { set.name.clone() } else { format!("{} (of the type)", set.name) },
        rows: set.properties.iter().map(|p| (p.name.clone(), p.value.to_string())).collect(),
    };
    element.all_sets().enumerate().map(sheet).filter(|sheet| !sheet.rows.is_empty()).collect()
}

/// Whether two objects are of elements with one type.
pub fn share_type(building: &Building, a: ObjectId, b: ObjectId) -> bool {
    let name = |o| of_object(building, o).and_then(Element::type_name);
    name(a).is_some() && name(a) == name(b)
}

/// Whether they are of elements of one class.
pub fn share_class(building: &Building, a: ObjectId, b: ObjectId) -> bool {
    let class = |o| of_object(building, o).map(|element| &element.class);
    class(a).is_some() && class(a) == class(b)
}

/// A property of an object's element, by the numbers of its set and in that: its name and value.
fn property(building: &Building, object: ObjectId, [set, number]: [u32; 2]) -> Option<(&str, String)> {
    let set = of_object(building, object)?.all_sets().nth(set as usize)?;
    let property = set.properties.get(number as usize)?;
    Some((&property.name, property.value.to_string()))
}

/// The objects whose elements have a property of this name and value.
pub fn with_property(building: &Building, object: ObjectId, at: [u32; 2]) -> Vec<ObjectId> {
    let Some((name, value)) = property(building, object, at) else { return Vec::new() };
    let has = |o: &ObjectId| {
        let sets = of_object(building, *o).into_iter().flat_map(Element::all_sets);
        sets.flat_map(|set| &set.properties).any(|p| p.name == name && p.value.to_string() == value)
    };
    (0..building.scene.objects.len() as u32).map(ObjectId).filter(has).collect()
}

/// Finds values of properties, each once: `NAME: VALUE`, an object that has it, and where. Ends after `most`.
pub fn find_properties(
    building: &Building,
    is_hit: &dyn Fn(&str) -> bool,
    most: usize,
) -> Vec<(String, ObjectId, [u32; 2])> {
    let (mut found, mut told, mut sets) = (Vec::new(), HashSet::new(), HashSet::new());
    for object in (0..building.scene.objects.len() as u32).map(ObjectId) {
        let all = of_object(building, object).into_iter().flat_map(Element::all_sets);
        // A set that many elements share is looked at once.
        for (i, set) in all.enumerate().filter(|(_, set)| !set.is_quantities) {
            if !sets.insert(Arc::as_ptr(set)) {
                continue;
            }
            for (k, property) in set.properties.iter().enumerate() {
                let line = format!("{}: {}", property.name, property.value);
                if is_hit(&line) && told.insert(line.clone()) {
                    found.push((line, object, [i as u32, k as u32]));
                }
                if found.len() == most {
                    return found;
                }
            }
        }
    }
    found
}
