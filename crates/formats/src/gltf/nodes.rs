//! What the nodes of a document say before they are added: which ones show, their levels of detail, and their instances.

use super::data::{self, Buffers, broken, entry};
use super::document::{Document, Instancing};
use super::placement::Placement;
use crate::lod::{self, Level};
use enfilade::scene::ImportError;
use glam::{DQuat, DVec3};
use std::collections::HashSet;

/// The roots to show: of the default scene, else of the first, else every node without a parent. Checks the node graph: children
/// exist, no node has two parents, and none is its own ancestor.
pub(super) fn roots(document: &Document) -> Result<Vec<usize>, ImportError> {
    let n = document.node_count();
    let mut has_parent = vec![false; n];
    for i in 0..n {
        for &child in &document.node(i).children {
            match has_parent.get_mut(child) {
                None => return Err(broken(format!("node {i} has child {child}, there are {n} nodes"))),
                Some(true) => return Err(broken(format!("node {child} has two parents"))),
                Some(has) => *has = true,
            }
        }
    }
    let orphans: Vec<usize> = (0..n).filter(|&i| !has_parent[i]).collect();
    // With at most one parent per node, every node not reached from an orphan is in or below a cycle.
    let mut reached = vec![false; n];
    let mut stack = orphans.clone();
    while let Some(node) = stack.pop() {
        reached[node] = true;
        stack.extend(&document.node(node).children);
    }
    if let Some(node) = reached.iter().position(|r| !r) {
        return Err(broken(format!("node {node} is in a cycle of nodes, or below one")));
    }
    let scene = match document.scene {
        Some(scene) => Some(entry(&document.scenes, scene, "scene")?),
        None => document.scenes.first(),
    };
    let Some(scene) = scene else { return Ok(orphans) };
    match scene.nodes.iter().find(|&&node| node >= n) {
        Some(node) => Err(broken(format!("the scene has node {node}, there are {n} nodes"))),
        None => Ok(scene.nodes.clone()),
    }
}

/// Lower-case names of all nodes with a mesh.
pub(super) fn names(document: &Document) -> HashSet<String> {
    let nodes = (0..document.node_count()).map(|i| document.node(i)).filter(|node| node.mesh.is_some());
    nodes.filter_map(|node| node.name.as_deref()).map(str::to_lowercase).collect()
}

/// Levels of detail by node: from MSFT_lod, else from names.
pub(super) fn levels(document: &Document) -> Vec<Option<Level>> {
    let count = document.node_count();
    let mut parents = vec![None; count];
    for i in 0..count {
        let children = document.node(i).children.iter().filter(|&&child| child < count);
        children.for_each(|&child| parents[child] = Some(i));
    }
    let name = |i: usize| {
        let node = document.node(i);
        let of_mesh = || document.meshes.get(node.mesh?)?.name.as_deref();
        node.name.as_deref().or_else(of_mesh).unwrap_or_default()
    };
    let nodes: Vec<(Option<usize>, &str)> = (0..count).map(|i| (parents[i], name(i))).collect();
    let mut levels = lod::levels(&nodes);
    let mut next = levels.iter().flatten().map(|level| level.group + 1).max().unwrap_or(0);
    for i in 0..count {
        let coarser = document.node(i).extensions().ok().and_then(|e| e.levels).map(|levels| levels.ids).unwrap_or_default();
        let coarser: Vec<usize> = coarser.into_iter().filter(|&id| id < count && id != i).collect();
        if !coarser.is_empty() {
            levels[i] = Some(Level { group: next, is_finest: true });
            coarser.into_iter().for_each(|id| levels[id] = Some(Level { group: next, is_finest: false }));
            next += 1;
        }
    }
    levels
}

/// Whether physics moves a node: by Godot's names or by an extension.
pub(super) fn is_body(name: &str, extensions: &serde_json::Value) -> bool {
    let name = name.to_lowercase();
    let by_name = ["rigid", "vehicle", "wheel"].iter().any(|kind| {
        let name = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.');
        name.strip_suffix(kind).is_some_and(|rest| rest.ends_with(['-', '$']))
    });
    let motions = [extensions.pointer("/KHR_physics_rigid_bodies/motion"), extensions.pointer("/OMI_physics_body/motion")];
    let is_static = |motion: &serde_json::Value| motion["type"] == "static";
    by_name || motions.into_iter().flatten().any(|motion| !is_static(motion))
}

/// The transforms of EXT_mesh_gpu_instancing.
pub(super) fn instances(buffers: &Buffers, instancing: &Instancing) -> Result<Vec<Placement>, ImportError> {
    let open = |index: Option<usize>, kind| index.map(|i| buffers.accessor(i, &[kind])).transpose();
    let attributes = &instancing.attributes;
    let translations = open(attributes.translation, "VEC3")?;
    let rotations = open(attributes.rotation, "VEC4")?;
    let scales = open(attributes.scale, "VEC3")?;
    let mut counts = [&translations, &rotations, &scales].into_iter().flatten().map(|a| a.count());
    let count = counts.next().unwrap_or(0);
    if counts.any(|c| c != count) {
        return Err(broken("EXT_mesh_gpu_instancing: attributes of different counts"));
    }
    let instance = |i| {
        let get = |a: &Option<data::Accessor>, default| a.as_ref().and_then(|a| a.get(i)).unwrap_or(default);
        let [tx, ty, tz, _] = get(&translations, [0.0; 4]);
        let [sx, sy, sz, _] = get(&scales, [1.0; 4]);
        let rotation = DQuat::from_array(get(&rotations, [0.0, 0.0, 0.0, 1.0]));
        Placement::new(DVec3::new(sx, sy, sz), rotation, DVec3::new(tx, ty, tz))
    };
    Ok((0..count).map(instance).collect())
}
