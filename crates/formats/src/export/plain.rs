//! Exports scenes of formats other than glTF: positions, texture coordinates and the importer's materials.

use super::Exported;
use crate::gltf::container::{ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, FLOAT, U32, glb, pad, positions_accessor};
use crate::gltf::pictures::Pictures;
use enfilade::scene::{ImportError, ImportOptions, Look, Material, Object, Picture, Role, Scene, Trace};
use glam::DVec3;
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// The scene as a `.glb`.
pub(super) fn cut(
    scene: &Scene,
    folder: Option<&Path>,
    options: &ImportOptions,
    extras: &dyn Fn(usize) -> Value,
) -> Result<Exported, ImportError> {
    let mut materials = Materials::default();
    let is_textured = scene.trace.iter().flat_map(|trace| &trace.looks).any(|look| !look.texture_coordinates.is_empty());
    let mut buffers = Buffers { is_textured, ..Buffers::default() };
    let (mut nodes, mut meshes) = (Vec::new(), Vec::new());
    for (id, object) in scene.objects.iter().enumerate() {
        let (look, material) = look(scene, id);
        let mut attributes = json!({});
        let corners = corners(scene, object, look);
        attributes["POSITION"] = buffers.positions(&corners).into();
        if corners.texture_coordinates.len() == corners.positions.len() {
            attributes["TEXCOORD_0"] = buffers.texture_coordinates(&corners.texture_coordinates).into();
        }
        let indices = buffers.indices(&corners.indices);
        let material = materials.number(material, object.glass);
        meshes.push(json!({ "primitives": [{ "attributes": attributes, "indices": indices, "material": material }] }));
        let mut extras = extras(id);
        if object.role != Role::Unknown {
            extras["role"] = json!(object.role);
        }
        nodes.push(json!({ "name": format!("{} #{id}", object.node), "mesh": id, "extras": { "enfilade": extras } }));
    }
    // Corners are near zero below this one, so `f32` holds them well.
    let all: Vec<usize> = (0..nodes.len()).collect();
    nodes.push(json!({ "name": scene.name, "translation": scene.origin.to_array(), "children": all }));
    let mut root = json!({
        "asset": { "version": "2.0", "generator": "enfilade export" },
        "scene": 0,
        "scenes": [{ "name": scene.name, "nodes": [nodes.len() - 1] }],
        "nodes": nodes,
        "meshes": meshes,
    });
    let notes = materials.write(&mut root, &mut buffers, &Pictures::beside(folder, options));
    let binary = buffers.write(&mut root);
    let glb = glb(&root, binary);
    let what = "a model of more than 4 GiB".to_owned();
    let glb = glb.ok_or(ImportError::Unsupported { what, hint: "export it in parts" })?;
    Ok(Exported { glb, meshes: scene.objects.len(), notes })
}

/// The material of an object, if the importer knows it.
fn look(scene: &Scene, id: usize) -> (Option<&Look>, Option<&Material>) {
    let Some(Trace { meshes, looks, materials, .. }) = &scene.trace else { return (None, None) };
    let look = &looks[meshes[id] as usize];
    (Some(look), look.material.map(|m| &materials[m as usize]))
}

/// The corners of an object; equal positions with equal texture coordinates are merged.
#[derive(Default)]
struct Corners {
    positions: Vec<DVec3>,
    texture_coordinates: Vec<[f32; 2]>,
    indices: Vec<u32>,
}

fn corners(scene: &Scene, object: &Object, look: Option<&Look>) -> Corners {
    let mut out = Corners::default();
    let mut known = HashMap::new();
    let in_mesh = scene.trace.as_ref().map(|trace| &trace.triangles);
    for triangle in object.triangles.start as usize..object.triangles.end as usize {
        let coordinates =
            look.zip(in_mesh).and_then(|(look, in_mesh)| look.texture_coordinates.get(in_mesh[triangle] as usize));
        for (k, &position) in scene.triangles[triangle].iter().enumerate() {
            let at = coordinates.map(|c| c[k]);
            let number = *known.entry((position, at.map(|at| at.map(f32::to_bits)))).or_insert_with(|| {
                out.positions.push(scene.positions[position as usize]);
                out.texture_coordinates.extend(at);
                out.positions.len() as u32 - 1
            });
            out.indices.push(number);
        }
    }
    out
}

/// The materials of all objects.
#[derive(Default)]
struct Materials {
    /// Name, colour and picture.
    all: Vec<(String, [f32; 4], Option<String>)>,
    numbers: BTreeMap<String, usize>,
}

impl Materials {
    /// The number of a material; without one, that of glass or of opaque surfaces.
    fn number(&mut self, material: Option<&Material>, glass: bool) -> usize {
        let (name, colour, texture) = match material {
            Some(Material { name, colour, texture: Some(Picture::Named(uri)), .. }) => {
                (name.as_str(), *colour, Some(uri.clone()))
            }
            Some(Material { name, colour, .. }) => (name.as_str(), *colour, None),
            None if glass => ("glass", [0.6, 0.7, 0.8, 0.3], None),
            None => ("opaque", [0.6, 0.6, 0.6, 1.0], None),
        };
        *self.numbers.entry(name.to_owned()).or_insert_with(|| {
            self.all.push((name.to_owned(), colour, texture));
            self.all.len() - 1
        })
    }

    /// Writes materials, textures and pictures. Returns notes on missing pictures.
    fn write(self, root: &mut Value, buffers: &mut Buffers, beside: &Pictures<'_>) -> Vec<String> {
        let (mut notes, mut materials, mut images) = (Vec::new(), Vec::new(), Vec::new());
        let mut number_of_image: BTreeMap<String, Option<usize>> = BTreeMap::new();
        for (name, colour, picture) in self.all {
            let image = picture.and_then(|picture| {
                *number_of_image.entry(picture.clone()).or_insert_with(|| match beside.read(&picture) {
                    Ok((kind, bytes)) => {
                        images.push(json!({ "name": picture, "mimeType": kind, "bufferView": buffers.picture(bytes) }));
                        Some(images.len() - 1)
                    }
                    Err(why) => {
                        notes.push(format!("picture left out: {why}"));
                        None
                    }
                })
            });
            let mut look = json!({ "baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.9 });
            if let Some(image) = image {
                look["baseColorTexture"] = json!({ "index": image });
            }
            let mut material = json!({ "name": name, "pbrMetallicRoughness": look, "doubleSided": true });
            if colour[3] < 1.0 {
                material["alphaMode"] = "BLEND".into();
            }
            materials.push(material);
        }
        root["materials"] = materials.into();
        if !images.is_empty() {
            root["textures"] = (0..images.len()).map(|image| json!({ "source": image })).collect();
            root["images"] = images.into();
        }
        notes
    }
}

/// Contents of the single buffer: positions, indices and, if any, texture coordinates, one view each; then pictures.
#[derive(Default)]
struct Buffers {
    is_textured: bool,
    positions: Vec<u8>,
    texture_coordinates: Vec<u8>,
    indices: Vec<u8>,
    pictures: Vec<Vec<u8>>,
    accessors: Vec<Value>,
}

/// Numbers of the views.
const POSITIONS: usize = 0;
const INDICES: usize = 1;
const TEXTURE_COORDINATES: usize = 2;

impl Buffers {
    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn positions(&mut self, corners: &Corners) -> usize {
        let all: Vec<[f32; 3]> = corners.positions.iter().map(|p| p.as_vec3().to_array()).collect();
        let accessor = positions_accessor(POSITIONS, self.positions.len(), &all);
        self.positions.extend(all.iter().flatten().flat_map(|x| x.to_le_bytes()));
        self.accessor(accessor)
    }

    fn texture_coordinates(&mut self, all: &[[f32; 2]]) -> usize {
        let accessor = json!({
            "bufferView": TEXTURE_COORDINATES, "byteOffset": self.texture_coordinates.len(), "componentType": FLOAT,
            "count": all.len(), "type": "VEC2",
        });
        self.texture_coordinates.extend(all.iter().flatten().flat_map(|x| x.to_le_bytes()));
        self.accessor(accessor)
    }

    fn indices(&mut self, all: &[u32]) -> usize {
        let accessor = json!({
            "bufferView": INDICES, "byteOffset": self.indices.len(), "componentType": U32, "count": all.len(), "type": "SCALAR",
        });
        self.indices.extend(all.iter().flat_map(|i| i.to_le_bytes()));
        self.accessor(accessor)
    }

    fn picture(&mut self, bytes: Vec<u8>) -> usize {
        self.pictures.push(bytes);
        TEXTURE_COORDINATES + usize::from(self.is_textured) + self.pictures.len() - 1
    }

    /// Writes accessors, views and the buffer. Returns its bytes.
    fn write(self, root: &mut Value) -> Vec<u8> {
        let (mut binary, mut views) = (Vec::new(), Vec::new());
        let elements = [(self.positions, 12), (self.indices, 0), (self.texture_coordinates, 8)];
        for (bytes, stride) in elements.into_iter().take(2 + usize::from(self.is_textured)) {
            let mut view = json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() });
            view["target"] = if stride > 0 { ARRAY_BUFFER } else { ELEMENT_ARRAY_BUFFER }.into();
            if stride > 0 {
                view["byteStride"] = stride.into();
            }
            views.push(view);
            binary.extend(bytes);
        }
        for bytes in self.pictures {
            views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
            binary.extend(bytes);
            pad(&mut binary, 0);
        }
        root["accessors"] = self.accessors.into();
        root["bufferViews"] = views.into();
        root["buffers"] = json!([{ "byteLength": binary.len() }]);
        binary
    }
}
