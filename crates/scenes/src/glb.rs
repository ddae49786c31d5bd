//! Writes a [`Model`] as binary glTF 2.0 (Khronos Group, *glTF 2.0 Specification*, 2021).
//!
//! One buffer with two views (positions, indices); positions are `f32`, indices `u16` if they fit. Normals are left out: surfaces
//! are flat, and readers derive flat normals if there are none (section 3.7.2.1). Every node has `extras.enfilade.role`, which
//! tells the importer walls from furniture; pipes also have `tube`. Groups are nodes after all others.

use super::model::{Material, Model, Node};
use super::solid::Solid;
use enfilade::scene::Role;
use enfilade_formats::gltf::container::{ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, U16, U32, glb, pad, positions_accessor};
use glam::{DMat3, DVec3};
use serde_json::{Value, json};

/// The mode of a polyline.
const LINE_STRIP: u32 = 3;

fn role_name(role: Role) -> &'static str {
    match role {
        Role::Structure => "structure",
        Role::Furnishing => "furnishing",
        Role::Door => "door",
        Role::Window => "window",
        Role::Unknown => "unknown",
        Role::Stair => "stair",
        Role::Helper => "helper",
        Role::Sky => "sky",
    }
}

/// The bytes of a `.glb` file.
pub(super) fn write(model: &Model, name: &str) -> Vec<u8> {
    let mut used: Vec<Material> = model.meshes.iter().map(|m| m.1).collect();
    used.sort();
    used.dedup();
    let mut buffers = Buffers::default();
    let meshes: Vec<Value> = model
        .meshes
        .iter()
        .enumerate()
        .map(|(mesh, (solid, material))| {
            let place = used.binary_search(material).unwrap_or_default();
            if let Some(pipe) = model.pipes.get(&mesh).filter(|_| solid.triangles.is_empty()) {
                let positions = buffers.positions(&pipe.points);
                let line = json!({ "attributes": { "POSITION": positions }, "mode": LINE_STRIP, "material": place });
                return json!({ "primitives": [line] });
            }
            let [positions, indices] = buffers.add(solid);
            json!({ "primitives": [{ "attributes": { "POSITION": positions }, "indices": indices, "material": place }] })
        })
        .collect();
    let (nodes, roots) = nodes(model);
    let Buffers { positions, indices, accessors } = buffers;
    let header = json!({
        "asset": { "version": "2.0", "generator": "enfilade generate" },
        "scene": 0,
        "scenes": [{ "name": name, "nodes": roots }],
        "nodes": nodes,
        "meshes": meshes,
        "materials": used.iter().map(material).collect::<Vec<_>>(),
        "accessors": accessors,
        "bufferViews": [
            { "buffer": 0, "byteLength": positions.len(), "target": ARRAY_BUFFER },
            { "buffer": 0, "byteOffset": positions.len(), "byteLength": indices.len(), "target": ELEMENT_ARRAY_BUFFER },
        ],
        "buffers": [{ "byteLength": positions.len() + indices.len() }],
    });
    // Generated scenes are far below the container's limits.
    glb(&header, [positions, indices].concat()).unwrap_or_default()
}

/// Contents of the buffer's views, with their accessors.
#[derive(Default)]
struct Buffers {
    positions: Vec<u8>,
    indices: Vec<u8>,
    accessors: Vec<Value>,
}

impl Buffers {
    /// Adds positions. Returns their accessor.
    fn positions(&mut self, positions: &[DVec3]) -> usize {
        let corners: Vec<[f32; 3]> = positions.iter().map(|p| p.as_vec3().to_array()).collect();
        self.accessors.push(positions_accessor(0, self.positions.len(), &corners));
        self.positions.extend(corners.iter().flatten().flat_map(|x| x.to_le_bytes()));
        self.accessors.len() - 1
    }

    /// Adds a mesh. Returns the accessors of its positions and of its indices.
    fn add(&mut self, solid: &Solid) -> [usize; 2] {
        let positions = self.positions(&solid.positions);
        let narrow = solid.positions.len() <= usize::from(u16::MAX);
        self.accessors.push(json!({
            "bufferView": 1, "byteOffset": self.indices.len(), "componentType": if narrow { U16 } else { U32 },
            "count": solid.triangles.len() * 3, "type": "SCALAR",
        }));
        for &i in solid.triangles.iter().flatten() {
            if narrow {
                self.indices.extend((i as u16).to_le_bytes());
            } else {
                self.indices.extend(i.to_le_bytes());
            }
        }
        pad(&mut self.indices, 0);
        [positions, self.accessors.len() - 1]
    }
}

/// The nodes, with groups after all others, and the indices of the roots.
fn nodes(model: &Model) -> (Vec<Value>, Vec<usize>) {
    let mut nodes: Vec<Value> = model.nodes.iter().map(|of| node(of, model)).collect();
    let mut roots = Vec::new();
    let mut children = vec![Vec::new(); model.groups.len()];
    let parents = model.nodes.iter().map(|node| node.group).chain(model.groups.iter().map(|group| group.parent));
    for (node, parent) in parents.enumerate() {
        parent.map_or(&mut roots, |group| &mut children[group]).push(node);
    }
    nodes.extend(
        model.groups.iter().zip(children).map(|(group, children)| json!({ "name": group.name, "children": children })),
    );
    (nodes, roots)
}

/// A node with a mesh.
fn node(node: &Node, model: &Model) -> Value {
    let mut value = json!({
        "name": node.name, "mesh": node.mesh, "extras": { "enfilade": { "role": role_name(node.role) } },
    });
    if let Some(pipe) = model.pipes.get(&node.mesh) {
        let tube = &mut value["extras"]["enfilade"]["tube"];
        *tube = json!({ "radius": pipe.radius });
        if pipe.smooth {
            tube["smooth"] = true.into();
        }
        if !model.meshes[node.mesh].0.triangles.is_empty() {
            tube["points"] = pipe.points.iter().map(|p| json!(p.to_array())).collect();
        }
    }
    if let Some(p) = node.placement {
        let (m, at) = (p.matrix3, p.translation);
        if m == DMat3::IDENTITY {
            value["translation"] = json!(at.to_array());
        } else {
            let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
            value["matrix"] = json!([x.x, x.y, x.z, 0.0, y.x, y.y, y.z, 0.0, z.x, z.y, z.z, 0.0, at.x, at.y, at.z, 1.0]);
        }
    }
    value
}

fn material(material: &Material) -> Value {
    let (name, colour) = material.look();
    let mut value = json!({
        "name": name,
        "pbrMetallicRoughness": { "baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.9 },
    });
    if colour[3] < 1.0 {
        value["alphaMode"] = json!("BLEND");
    }
    value
}
