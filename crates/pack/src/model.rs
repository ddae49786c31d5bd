//! An exported model, read again: where each object stands, and the vertices of its mesh.

use crate::PackError;
use enfilade_formats::gltf::container::chunks;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use serde_json::Value;

/// An exported model.
pub(crate) struct Model {
    root: Value,
    binary: Vec<u8>,
    /// By id.
    pub(crate) objects: Vec<Placed>,
    /// Lines of what the folder lacks.
    pub(crate) notes: Vec<String>,
}

/// An object: a mesh, and the transform to the model's coordinates.
#[derive(Clone, Copy)]
pub(crate) struct Placed {
    pub(crate) mesh: usize,
    pub(crate) transform: DAffine3,
}

/// The triangles of a mesh.
pub(crate) struct Mesh {
    pub(crate) positions: Vec<DVec3>,
    /// Attributes besides positions, by name.
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) indices: Vec<u32>,
    /// In the list of the model.
    pub(crate) material: Option<usize>,
}

/// Numbers of each vertex.
pub(crate) struct Attribute {
    pub(crate) name: String,
    /// Numbers per vertex.
    pub(crate) width: usize,
    pub(crate) values: Vec<f32>,
    /// Whether the model has it in bytes.
    pub(crate) is_bytes: bool,
}

/// What chunks keep of vertices.
const KEPT: [&str; 4] = ["NORMAL", "TANGENT", "TEXCOORD_", "COLOR_"];

fn damaged(what: impl Into<String>) -> PackError {
    PackError::Export(what.into())
}

fn number(value: &Value, key: &str) -> usize {
    value[key].as_u64().unwrap_or_default() as usize
}

impl Model {
    /// Reads what `export` made of a model with so many objects.
    pub(crate) fn read(glb: &[u8], objects: usize) -> Result<Self, PackError> {
        let (text, binary) = chunks(glb).map_err(|e| damaged(e.to_string()))?;
        let root: Value = serde_json::from_slice(text).map_err(|e| damaged(e.to_string()))?;
        let binary = binary.unwrap_or_default().to_vec();
        let mut model = Self { root, binary, objects: Vec::new(), notes: Vec::new() };
        let mut found: Vec<Option<Placed>> = vec![None; objects];
        let (mut others, mut bent) = (0, 0);
        let roots = model.root["scenes"][number(&model.root, "scene")]["nodes"].as_array();
        let mut stack: Vec<(usize, DAffine3)> = children(roots).map(|node| (node, DAffine3::IDENTITY)).collect();
        while let Some((node, above)) = stack.pop() {
            let node = &model.root["nodes"][node];
            let transform = above * transform(node);
            stack.extend(children(node["children"].as_array()).map(|child| (child, transform)));
            let Some(mesh) = node["mesh"].as_u64() else { continue };
            match node["extras"]["enfilade"]["object"].as_u64().and_then(|id| found.get_mut(id as usize)) {
                Some(place) => *place = Some(Placed { mesh: mesh as usize, transform }),
                None => others += 1,
            }
            let is_morphed = !model.root["meshes"][mesh as usize]["primitives"][0]["targets"].is_null();
            bent += usize::from(node.get("skin").is_some() || is_morphed);
        }
        model.objects = found
            .into_iter()
            .enumerate()
            .map(|(id, at)| at.ok_or_else(|| damaged(format!("no object {id}"))))
            .collect::<Result<_, _>>()?;
        let count = |list: &str| model.root[list].as_array().map_or(0, Vec::len);
        model.notes = [
            (others, "meshes of points and lines are left out"),
            (bent, "objects with skins or morph targets stand as they were modelled, in no pose"),
            (count("animations"), "animations are left out"),
            (count("cameras"), "cameras are left out"),
        ]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
        Ok(model)
    }

    /// An entry of a list of the document.
    pub(crate) fn entry(&self, list: &str, number: usize) -> &Value {
        &self.root[list][number]
    }

    /// The material of a mesh.
    pub(crate) fn material(&self, mesh: usize) -> Option<usize> {
        self.root["meshes"][mesh]["primitives"][0]["material"].as_u64().map(|material| material as usize)
    }

    /// Bytes of a view.
    pub(crate) fn view(&self, view: usize) -> Option<&[u8]> {
        let view = self.root["bufferViews"].get(view)?;
        let begin = number(view, "byteOffset");
        self.binary.get(begin..begin.checked_add(number(view, "byteLength"))?)
    }

    /// A mesh of the model.
    pub(crate) fn mesh(&self, mesh: usize) -> Result<Mesh, PackError> {
        let primitive = &self.root["meshes"][mesh]["primitives"][0];
        let fault = |what: &str| damaged(format!("mesh {mesh}: {what}"));
        let of = |accessor: &Value| {
            accessor.as_u64().and_then(|accessor| self.numbers(accessor as usize)).ok_or_else(|| fault("its vertices"))
        };
        let positions = of(&primitive["attributes"]["POSITION"])?.values;
        let positions: Vec<DVec3> = positions.chunks_exact(3).map(|p| DVec3::new(p[0], p[1], p[2])).collect();
        let mut attributes = Vec::new();
        for (name, accessor) in primitive["attributes"].as_object().into_iter().flatten() {
            if KEPT.iter().any(|kept| name.starts_with(kept)) {
                let Numbers { width, values, is_bytes } = of(accessor)?;
                if values.len() != width * positions.len() {
                    return Err(fault("attributes of different counts"));
                }
                let values = values.into_iter().map(|value| value as f32).collect();
                attributes.push(Attribute { name: name.clone(), width, values, is_bytes });
            }
        }
        attributes.sort_by(|a, b| a.name.cmp(&b.name));
        let indices: Vec<u32> = of(&primitive["indices"])?.values.into_iter().map(|index| index as u32).collect();
        if !indices.len().is_multiple_of(3) || indices.iter().any(|&index| index as usize >= positions.len()) {
            return Err(fault("its triangles"));
        }
        Ok(Mesh { positions, attributes, indices, material: self.material(mesh) })
    }

    /// All numbers of an accessor; normalised integers as what they stand for.
    fn numbers(&self, accessor: usize) -> Option<Numbers> {
        let accessor = self.root["accessors"].get(accessor)?;
        let bytes = self.view(number(accessor, "bufferView"))?;
        let (size, most, read): (usize, f64, Read) = match number(accessor, "componentType") {
            5120 => (1, 127.0, |b| f64::from(b[0] as i8)),
            5121 => (1, 255.0, |b| f64::from(b[0])),
            5122 => (2, 32767.0, |b| f64::from(i16::from_le_bytes([b[0], b[1]]))),
            5123 => (2, 65535.0, |b| f64::from(u16::from_le_bytes([b[0], b[1]]))),
            5125 => (4, f64::from(u32::MAX), |b| f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
            5126 => (4, 1.0, |b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
            _ => return None,
        };
        let width = match accessor["type"].as_str()? {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => return None,
        };
        let share = if accessor["normalized"] == true { most.recip() } else { 1.0 };
        let stride = number(&self.root["bufferViews"][number(accessor, "bufferView")], "byteStride").max(size * width);
        let (first, count) = (number(accessor, "byteOffset"), number(accessor, "count"));
        let mut values = Vec::new();
        for vertex in 0..count {
            let begin = first.checked_add(vertex.checked_mul(stride)?)?;
            let element = bytes.get(begin..begin.checked_add(size * width)?)?;
            // The least signed integer stands for -1, too.
            let stands_for = |b| if share < 1.0 { (read(b) * share).max(-1.0) } else { read(b) };
            values.extend(element.chunks_exact(size).map(stands_for));
        }
        Some(Numbers { width, values, is_bytes: size == 1 })
    }
}

/// Reads a number of a component type.
type Read = fn(&[u8]) -> f64;

/// The numbers of an accessor.
struct Numbers {
    /// Numbers per element.
    width: usize,
    values: Vec<f64>,
    is_bytes: bool,
}

fn children(list: Option<&Vec<Value>>) -> impl Iterator<Item = usize> + '_ {
    list.into_iter().flatten().filter_map(Value::as_u64).map(|node| node as usize)
}

/// A node's own transform.
fn transform(node: &Value) -> DAffine3 {
    let list = |key: &str| -> Option<Vec<f64>> { node[key].as_array()?.iter().map(Value::as_f64).collect() };
    if let Some(matrix) = list("matrix").and_then(|m| <[f64; 16]>::try_from(m).ok()) {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix));
    }
    let vector =
        |key: &str, default: DVec3| list(key).and_then(|v| <[f64; 3]>::try_from(v).ok()).map_or(default, DVec3::from_array);
    let rotation = list("rotation").and_then(|r| <[f64; 4]>::try_from(r).ok()).map(DQuat::from_array);
    let rotation = rotation.filter(|r| r.length_squared() > 0.0).map_or(DQuat::IDENTITY, DQuat::normalize);
    DAffine3::from_scale_rotation_translation(vector("scale", DVec3::ONE), rotation, vector("translation", DVec3::ZERO))
}
