//! Finds rooms, nodes, types, properties and materials by a part of their names, and tells facts of objects.

use crate::building::Building;
use crate::elements;
use crate::units::Units;
use enfilade::file::FileCell;
use enfilade::scene::Role;
use enfilade::{CellId, ObjectId};
use std::collections::HashSet;

/// Most hits: a longer list is narrowed by another letter.
pub const MOST: usize = 50;
/// Something that has a name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FindTarget {
    /// A cell that the author named.
    Room(CellId),
    /// All objects of the node of this one.
    Node(ObjectId),
    /// All objects whose elements have the type of this one's.
    Type(ObjectId),
    /// All objects whose elements are of the class of this one's.
    Class(ObjectId),
    /// All objects with the value of a property of this one's element: the numbers of its set, and in that.
    Property(ObjectId, [u32; 2]),
    /// The material with this number in the scene's trace.
    Material(u32),
}

/// A hit.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Found {
    /// It.
    pub what: FindTarget,
    /// Its name.
    pub name: String,
}

/// Everything that has a text in its name, in capitals or not: rooms first, then nodes, types and classes, GlobalIds, values of properties, and
/// materials that something is made of.
pub fn find(building: &Building, text: &str) -> Vec<Found> {
    let text = text.trim().to_lowercase();
    if text.is_empty() {
        return Vec::new();
    }
    let is_hit = |name: &str| name.to_lowercase().contains(&text);
    let mut found = rooms(building, &|cell| is_hit(&cell.name));
    // Models with elements name their nodes by ids.
    let [mut named, mut numbered] = nodes(building, &is_hit);
    found.append(&mut named);
    found.append(&mut kinds(building, &is_hit));
    numbered.extend(rooms(building, &|cell| !is_hit(&cell.name) && cell.source.as_deref().is_some_and(is_hit)));
    found.append(&mut numbered);
    if found.len() < MOST {
        let properties = elements::find_properties(building, &is_hit, MOST - found.len());
        found
            .extend(properties.into_iter().map(|(name, object, at)| Found { what: FindTarget::Property(object, at), name }));
    }
    let materials = building.scene.trace.iter().flat_map(|trace| trace.materials.iter().enumerate());
    for (i, material) in materials.filter(|(_, material)| is_hit(&material.name)) {
        let what = FindTarget::Material(i as u32);
        if !objects(building, what).is_empty() {
            found.push(Found { what, name: material.name.clone() });
        }
    }
    found.truncate(MOST);
    found
}

/// Cells that the author named.
fn rooms(building: &Building, is_hit: &dyn Fn(&FileCell) -> bool) -> Vec<Found> {
    let named = (0u32..).zip(&building.file.cells).filter(|(_, cell)| cell.source.is_some() && is_hit(cell));
    named.map(|(i, cell)| Found { what: FindTarget::Room(CellId(i)), name: cell.name.clone() }).collect()
}

/// Nodes and elements by their names, then elements by their GlobalIds.
fn nodes(building: &Building, is_hit: &dyn Fn(&str) -> bool) -> [Vec<Found>; 2] {
    let (mut found, mut seen) = ([const { Vec::new() }; 2], HashSet::new());
    for (i, object) in (0u32..).zip(&building.scene.objects) {
        if !seen.insert(&object.node) {
            continue;
        }
        let what = FindTarget::Node(ObjectId(i));
        match elements::of_object(building, ObjectId(i)).map(|element| element.name.as_deref().unwrap_or(&element.class)) {
            Some(name) if is_hit(name) => found[0].push(Found { what, name: name.to_owned() }),
            Some(name) if is_hit(&object.node) => found[1].push(Found { what, name: format!("{} {name}", object.node) }),
            None if is_hit(&object.node) => found[0].push(Found { what, name: object.node.clone() }),
            _ => {}
        }
    }
    found
}

/// Types and classes of elements.
fn kinds(building: &Building, is_hit: &dyn Fn(&str) -> bool) -> Vec<Found> {
    let (mut found, mut seen) = ([const { Vec::new() }; 2], HashSet::new());
    for object in (0..building.scene.objects.len() as u32).map(ObjectId) {
        let Some(element) = elements::of_object(building, object) else { continue };
        let class = Some(element.class.as_str());
        for (k, name, what) in [(0, element.type_name(), FindTarget::Type(object)), (1, class, FindTarget::Class(object))] {
            let Some(name) = name.filter(|name| is_hit(name)) else { continue };
            if seen.insert((k, name)) {
                found[k].push(Found { what, name: name.to_owned() });
            }
        }
    }
    found.into_iter().flatten().collect()
}

/// The objects of what was found; of a room, none.
pub fn objects(building: &Building, what: FindTarget) -> Vec<ObjectId> {
    let scene = &building.scene;
    let ids = (0..scene.objects.len() as u32).map(ObjectId);
    match what {
        FindTarget::Room(_) => Vec::new(),
        FindTarget::Node(first) => {
            ids.filter(|o| scene.objects[o.index()].node == scene.objects[first.index()].node).collect()
        }
        FindTarget::Type(first) => ids.filter(|o| elements::share_type(building, first, *o)).collect(),
        FindTarget::Class(first) => ids.filter(|o| elements::share_class(building, first, *o)).collect(),
        FindTarget::Property(first, at) => elements::with_property(building, first, at),
        FindTarget::Material(number) => ids.filter(|o| material(building, *o) == Some(number)).collect(),
    }
}

/// The number of an object's material.
fn material(building: &Building, object: ObjectId) -> Option<u32> {
    let trace = building.scene.trace.as_ref()?;
    trace.looks[trace.meshes[object.index()] as usize].material
}

/// Facts of an object in a cell: names and values.
pub fn facts(building: &Building, object: ObjectId, cell: CellId, units: Units) -> Vec<(&'static str, String)> {
    let (scene, home) = (&building.scene, &building.file.cells[cell.index()]);
    let of = &scene.objects[object.index()];
    let role = match of.role {
        Role::Structure => "structure",
        Role::Furnishing => "furnishing",
        Role::Door => "door",
        Role::Window => "window",
        Role::Unknown => "not told",
        Role::Stair => "stair",
        Role::Helper => "not drawn by engines",
        Role::Sky => "sky",
    };
    let size = of.bounds.size();
    let named = if home.source.is_some() { format!("{cell} ({})", home.name) } else { cell.to_string() };
    let mut facts = vec![
        ("Node", of.node.clone()),
        ("Object", object.to_string()),
        ("Role", role.to_owned()),
        ("Cell", named),
        ("Triangles", of.triangles.len().to_string()),
        ("Size", size.to_array().map(|side| units.length(side)).join(" x ")),
    ];
    let material = material(building, object).zip(scene.trace.as_ref()).map(|(i, trace)| &trace.materials[i as usize]);
    facts.extend(material.map(|material| ("Material", material.name.clone())));
    let file = &building.file;
    let by = (0..file.cells.len() as u32).filter(|&c| file.sees_object(CellId(c), object)).count();
    let seen = file.objects_seen(cell).count();
    facts.push((
        "Seen",
        format!("from {by} of {} cells; its own sees {seen} of {} objects", file.cells.len(), file.objects.len()),
    ));
    facts
}
