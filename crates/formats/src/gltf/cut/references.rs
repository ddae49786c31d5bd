//! References between the lists of a document: found, renumbered, removed.

use super::{INSTANCING, broken};
use enfilade::scene::ImportError;
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

/// Whether the document has no arrays in place of objects. The importer accepts both.
pub fn is_plain(root: &Value) -> bool {
    let each = |value: &Value, name: &str, is_so: &dyn Fn(&Value) -> bool| {
        value.get(name).is_none_or(|list| list.as_array().is_some_and(|list| list.iter().all(is_so)))
    };
    let is_primitive = |primitive: &Value| {
        primitive.get("attributes").is_some_and(Value::is_object) && each(primitive, "targets", &Value::is_object)
    };
    let is_mesh = |mesh: &Value| mesh.is_object() && each(mesh, "primitives", &is_primitive);
    let lists = ["scenes", "nodes", "images"].iter().all(|name| each(root, name, &Value::is_object));
    root.is_object() && root.get("asset").is_some_and(Value::is_object) && lists && each(root, "meshes", &is_mesh)
}

/// Removes entries from one of the document's lists and returns them.
pub fn taken(root: &mut Value, name: &str, numbers: &[usize]) -> Result<Vec<Value>, ImportError> {
    let mut list = root.get_mut(name).map(Value::take).and_then(|list| list.as_array().cloned()).unwrap_or_default();
    let count = list.len();
    let take = |&number: &usize| {
        let entry = list.get_mut(number).map(Value::take);
        entry.ok_or_else(|| broken(format!("{name}: {number} is used, there are {count}")))
    };
    numbers.iter().map(take).collect()
}

/// The entries of one of the document's lists.
pub fn list<'v>(root: &'v mut Value, name: &str) -> std::slice::IterMut<'v, Value> {
    root.get_mut(name).and_then(Value::as_array_mut).map_or(&mut [][..], Vec::as_mut_slice).iter_mut()
}

/// Calls its second argument with every number of one kind in a document.
type Each = fn(&mut Value, &mut dyn FnMut(&mut Value));

/// Renumbers the references that `each` finds to a list of the used entries, and returns these entries in order.
pub fn renumbered(root: &mut Value, each: Each) -> Vec<usize> {
    let mut used = BTreeSet::new();
    each(root, &mut |number| used.extend(number.as_u64().map(|n| n as usize)));
    let used: Vec<usize> = used.into_iter().collect();
    each(root, &mut |number| {
        if let Some(place) = number.as_u64().and_then(|n| used.binary_search(&(n as usize)).ok()) {
            *number = place.into();
        }
    });
    used
}

/// The meshes of nodes.
pub fn each_mesh(root: &mut Value, found: &mut dyn FnMut(&mut Value)) {
    list(root, "nodes").filter_map(|node| node.get_mut("mesh")).for_each(found);
}

/// The references to accessors.
pub fn each_accessor(root: &mut Value, found: &mut dyn FnMut(&mut Value)) {
    let mut all = |values: Option<&mut Value>| {
        values.and_then(Value::as_object_mut).into_iter().flat_map(Map::values_mut).for_each(&mut *found);
    };
    for primitive in list(root, "meshes").flat_map(|mesh| list(mesh, "primitives")) {
        all(primitive.get_mut("attributes"));
        list(primitive, "targets").for_each(|target| all(Some(target)));
    }
    let instances = format!("/extensions/{INSTANCING}/attributes");
    list(root, "nodes").for_each(|node| all(node.pointer_mut(&instances)));
    list(root, "meshes").flat_map(|m| list(m, "primitives")).filter_map(|p| p.get_mut("indices")).for_each(&mut *found);
    list(root, "skins").filter_map(|skin| skin.get_mut("inverseBindMatrices")).for_each(&mut *found);
    for sampler in list(root, "animations").flat_map(|animation| list(animation, "samplers")) {
        ["input", "output"].iter().for_each(|key| sampler.get_mut(key).into_iter().for_each(&mut *found));
    }
}

/// The references to buffer views, by accessors, pictures and extensions.
pub fn each_view(value: &mut Value, found: &mut dyn FnMut(&mut Value)) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                if key == "bufferView" && value.is_u64() { found(value) } else { each_view(value, found) }
            }
        }
        Value::Array(values) => values.iter_mut().for_each(|value| each_view(value, found)),
        _ => {}
    }
}

/// Removes an extension, and `extensions` if it is then empty.
pub fn remove_extension(value: &mut Value, name: &str) -> Option<Value> {
    let extensions = value.get_mut("extensions")?.as_object_mut()?;
    let removed = extensions.remove(name);
    if extensions.is_empty() {
        value.as_object_mut()?.remove("extensions");
    }
    removed
}

/// Appends to a list of a document. Returns the number of the new entry.
pub fn push(root: &mut Value, name: &str, value: Value) -> usize {
    if !root[name].is_array() {
        root[name] = json!([]);
    }
    root[name].as_array_mut().map_or(0, |values| {
        values.push(value);
        values.len() - 1
    })
}

/// Numbers by name; other values are ignored.
pub fn named(attributes: Option<&Value>) -> Vec<(&str, usize)> {
    let all = attributes.and_then(Value::as_object).into_iter().flatten();
    all.filter_map(|(name, number)| Some((name.as_str(), number.as_u64()? as usize))).collect()
}
