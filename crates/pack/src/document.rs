//! A binary glTF of compressed vertices: one stream of vertices and one of triangles for all primitives with the same attributes.
//!
//! Based on: Khronos Group, *EXT_meshopt_compression*, 2021, and *KHR_mesh_quantization*, 2019. Deviation: primitives share accessors of
//! vertices, since each accessor takes 100 bytes and many objects have fewer. The vertices of a primitive are consecutive.

use crate::PackError;
use crate::geometry::{F32, Layout, Shape, U16, U32};
use crate::gzip::gzip;
use crate::looks::Looks;
use enfilade_formats::gltf::container::{glb, pad};
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::codec::{IndexEncoding, VertexEncoding, encode_index_buffer, encode_vertex_buffer};
use serde_json::{Value, json};
use std::collections::BTreeMap;

const MESHOPT: &str = "EXT_meshopt_compression";
const QUANTIZATION: &str = "KHR_mesh_quantization";

/// A shape and where its positions count from.
pub(crate) struct Part<'s> {
    pub(crate) shape: &'s Shape,
    /// Multiples of the step.
    pub(crate) base: [i64; 3],
    /// Whether positions fit into 16 bits; else they are lengths in `f32`.
    pub(crate) is_short: bool,
    pub(crate) step: f64,
}

/// Whether steps from `least` to `greatest` fit into 16 bits.
pub(crate) fn is_short([least, greatest]: [[i64; 3]; 2]) -> bool {
    (0..3).all(|k| greatest[k] - least[k] <= i64::from(u16::MAX))
}

/// The document that is written.
pub(crate) struct Document {
    root: Value,
    accessors: Vec<Value>,
    views: Vec<Value>,
    /// Compressed.
    binary: Vec<u8>,
    /// Bytes of all views without compression.
    plain: usize,
    has_short: bool,
}

impl Document {
    pub(crate) fn new() -> Self {
        let root = json!({ "asset": { "version": "2.0" } });
        Self { root, accessors: Vec::new(), views: Vec::new(), binary: Vec::new(), plain: 0, has_short: false }
    }

    /// Writes the vertices and triangles of all parts. Returns their primitives, without materials.
    pub(crate) fn primitives(&mut self, parts: &[Part<'_>]) -> Result<Vec<Value>, PackError> {
        let mut batches: BTreeMap<(bool, &[Layout]), Vec<usize>> = BTreeMap::new();
        for (number, part) in parts.iter().enumerate() {
            batches.entry((part.is_short, &part.shape.layouts)).or_default().push(number);
        }
        let mut primitives = vec![Value::Null; parts.len()];
        for ((is_short, layouts), numbers) in batches {
            self.has_short |= is_short || layouts.iter().any(|layout| layout.component != F32);
            let vertices = numbers.iter().map(|&n| parts[n].shape.cells.len()).sum();
            let attributes = self.vertices(parts, &numbers, is_short, layouts, vertices)?;
            let indices = self.triangles(parts, &numbers, vertices)?;
            for (number, indices) in numbers.into_iter().zip(indices) {
                primitives[number] = json!({ "attributes": attributes, "indices": indices });
            }
        }
        Ok(primitives)
    }

    /// Writes the vertices of a batch. Returns its attributes.
    fn vertices(
        &mut self,
        parts: &[Part<'_>],
        numbers: &[usize],
        is_short: bool,
        layouts: &[Layout],
        count: usize,
    ) -> Result<Value, PackError> {
        let of_others: usize = layouts.iter().map(Layout::stride).sum();
        let stride = of_others + if is_short { 8 } else { 12 };
        let mut bytes = Vec::with_capacity(stride * count);
        let (mut least, mut greatest) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for Part { shape, base, step, .. } in numbers.iter().map(|&n| &parts[n]) {
            for (vertex, cell) in shape.cells.iter().enumerate() {
                let steps: [i64; 3] = std::array::from_fn(|k| cell[k] - base[k]);
                let at = steps.map(|x| if is_short { x as f64 } else { f64::from((x as f64 * step) as f32) });
                least = std::array::from_fn(|k| least[k].min(at[k]));
                greatest = std::array::from_fn(|k| greatest[k].max(at[k]));
                if is_short {
                    at.iter().for_each(|x| bytes.extend((*x as u16).to_le_bytes()));
                    bytes.extend([0; 2]);
                } else {
                    at.iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes()));
                }
                bytes.extend(&shape.bytes[vertex * of_others..(vertex + 1) * of_others]);
            }
        }
        let encoded = encode_vertex_buffer(&bytes, count, stride, VertexEncoding::new(0, 0)?, &mut Workspace::default())?;
        let view = self.view(&encoded, "ATTRIBUTES", count, stride);
        self.views[view]["byteStride"] = stride.into();
        let mut offset = stride - of_others;
        let component = if is_short { U16 } else { F32 };
        let position = json!({
            "bufferView": view, "componentType": component, "count": count, "type": "VEC3",
            "min": least.map(exact), "max": greatest.map(exact),
        });
        let mut attributes = json!({ "POSITION": self.accessor(position) });
        for layout in layouts {
            let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][layout.width.clamp(1, 4) - 1];
            let mut accessor = json!({
                "bufferView": view, "byteOffset": offset, "componentType": layout.component, "count": count, "type": kind,
            });
            if layout.normalized {
                accessor["normalized"] = true.into();
            }
            attributes[&layout.name] = self.accessor(accessor).into();
            offset += layout.stride();
        }
        Ok(attributes)
    }

    /// Writes the triangles of a batch with so many vertices. Returns an accessor for each part.
    fn triangles(&mut self, parts: &[Part<'_>], numbers: &[usize], vertices: usize) -> Result<Vec<usize>, PackError> {
        let (component, size) = if vertices <= usize::from(u16::MAX) { (U16, 2) } else { (U32, 4) };
        let (mut indices, mut first) = (Vec::new(), 0);
        for shape in numbers.iter().map(|&n| parts[n].shape) {
            indices.extend(shape.indices.iter().map(|index| index + first));
            first += shape.cells.len() as u32;
        }
        let encoded = encode_index_buffer(&indices, IndexEncoding::DEFAULT, &mut Workspace::default())?;
        let view = self.view(&encoded, "TRIANGLES", indices.len(), size);
        let mut offset = 0;
        let of_part = |&number: &usize| {
            let count = parts[number].shape.indices.len();
            let mut accessor = json!({ "bufferView": view, "componentType": component, "count": count, "type": "SCALAR" });
            if offset > 0 {
                accessor["byteOffset"] = offset.into();
            }
            offset += count * size;
            self.accessor(accessor)
        };
        Ok(numbers.iter().map(of_part).collect())
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds a compressed view.
    fn view(&mut self, encoded: &[u8], mode: &str, count: usize, stride: usize) -> usize {
        let length = count * stride;
        let mut source =
            json!({ "buffer": 0, "byteLength": encoded.len(), "byteStride": stride, "mode": mode, "count": count });
        let mut view = json!({ "buffer": 1, "byteLength": length });
        if self.plain > 0 {
            (source["byteOffset"], view["byteOffset"]) = (self.binary.len().into(), self.plain.into());
        }
        view["extensions"] = json!({ MESHOPT: source });
        self.views.push(view);
        self.plain += length.next_multiple_of(4);
        self.binary.extend(encoded);
        pad(&mut self.binary, 0);
        self.views.len() - 1
    }

    /// The file with these nodes, of which the scene has `shown`, compressed.
    pub(crate) fn finish(
        self,
        meshes: Vec<Value>,
        nodes: Vec<Value>,
        shown: Vec<usize>,
        looks: Looks,
    ) -> Result<Vec<u8>, PackError> {
        let Self { mut root, accessors, views, mut binary, plain, has_short } = self;
        let mut used = looks.write(&mut root);
        root["scene"] = 0.into();
        root["scenes"] = json!([{ "nodes": shown }]);
        root["nodes"] = nodes.into();
        if !meshes.is_empty() {
            pad(&mut binary, 0);
            root["meshes"] = meshes.into();
            root["accessors"] = accessors.into();
            root["bufferViews"] = views.into();
            let fallback = json!({ MESHOPT: { "fallback": true } });
            root["buffers"] = json!([{ "byteLength": binary.len() }, { "byteLength": plain, "extensions": fallback }]);
            used.insert(MESHOPT.to_owned());
            used.extend(has_short.then(|| QUANTIZATION.to_owned()));
        }
        let is_required = |name: &&String| REQUIRED.contains(&name.as_str());
        let required: Vec<&String> = used.iter().filter(is_required).collect();
        if !required.is_empty() {
            root["extensionsRequired"] = json!(required);
        }
        if !used.is_empty() {
            root["extensionsUsed"] = json!(used);
        }
        glb(&root, binary).map(|bytes| gzip(&bytes)).ok_or(PackError::TooLarge)
    }
}

/// Extensions without which a reader can't show a chunk.
const REQUIRED: [&str; 3] = [MESHOPT, QUANTIZATION, "KHR_texture_basisu"];

/// A whole number without a point, which takes two bytes.
pub(crate) fn exact(number: f64) -> Value {
    let whole = number as i64;
    if whole as f64 == number { whole.into() } else { number.into() }
}
