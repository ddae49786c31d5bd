//! The accessors, views and bytes of the model that is written.

use super::super::data::{Accessor, broken, numbers};
use super::container::{self, U16, U32};
use enfilade::scene::ImportError;
use serde_json::{Value, json};

/// The output: first the kept data of the source, then streams of new elements, one view each.
pub struct Output {
    pub accessors: Vec<Value>,
    pub views: Vec<Value>,
    /// The bytes of `views`.
    pub kept: Vec<u8>,
    /// Bytes from element to element (0: indices), and the elements.
    pub streams: Vec<(usize, Vec<u8>)>,
    /// Limit of all bytes.
    pub most: usize,
}

pub fn too_large() -> ImportError {
    ImportError::Unsupported {
        what: "a model that grows more than 256 times on export".to_owned(),
        hint: "export it in parts",
    }
}

/// An attribute of a primitive, or of a morph target.
pub struct Slot<'b> {
    pub target: Option<usize>,
    pub name: String,
    pub elements: Elements<'b>,
    /// Common entries of its accessors.
    pub like: Value,
    /// Component type and width, if accessors need bounds.
    pub bounds: Option<(u64, usize)>,
}

/// The elements of an attribute, by vertex.
pub enum Elements<'b> {
    Stored(Accessor<'b>),
    /// Bytes, and bytes per vertex.
    Decoded(Vec<u8>, usize),
}

impl Elements<'_> {
    pub fn size(&self) -> usize {
        match self {
            Self::Stored(accessor) => accessor.size(),
            Self::Decoded(_, size) => *size,
        }
    }

    /// Appends the element of a vertex; false if there is none.
    pub fn append(&self, vertex: usize, out: &mut Vec<u8>) -> bool {
        let size = self.size();
        let bytes = match self {
            Self::Stored(accessor) => accessor.bytes(vertex).map(|bytes| &bytes[..size]),
            Self::Decoded(bytes, _) => bytes.get(vertex * size..(vertex + 1) * size),
        };
        match (bytes, self) {
            (Some(bytes), _) => out.extend(bytes),
            // A sparse accessor without a view has zeros.
            (None, Self::Stored(accessor)) if vertex < accessor.count() => out.resize(out.len() + size, 0),
            (None, _) => return false,
        }
        true
    }
}

impl Output {
    pub const NONE: Self = Self { accessors: Vec::new(), views: Vec::new(), kept: Vec::new(), streams: Vec::new(), most: 0 };

    /// Fails if this many more bytes exceed the limit.
    pub fn room(&self, bytes: usize) -> Result<(), ImportError> {
        let now: usize = self.kept.len() + self.streams.iter().map(|(_, stream)| stream.len()).sum::<usize>();
        if now.saturating_add(bytes) > self.most { Err(too_large()) } else { Ok(()) }
    }

    /// Appends a view. Returns its number.
    pub fn view(&mut self, bytes: &[u8]) -> Result<usize, ImportError> {
        self.room(bytes.len())?;
        self.views.push(json!({ "buffer": 0, "byteOffset": self.kept.len(), "byteLength": bytes.len() }));
        self.kept.extend(bytes);
        container::pad(&mut self.kept, 0);
        Ok(self.views.len() - 1)
    }

    /// The stream of elements with this stride, and the number of its view.
    pub fn stream(&mut self, stride: usize) -> (usize, &mut Vec<u8>) {
        let place = self.streams.iter().position(|s| s.0 == stride).unwrap_or_else(|| {
            self.streams.push((stride, Vec::new()));
            self.streams.len() - 1
        });
        (self.views.len() + place, &mut self.streams[place].1)
    }

    /// Appends indices into `vertices` vertices. Returns their accessor.
    pub fn indices(&mut self, indices: &[u32], vertices: usize) -> Result<usize, ImportError> {
        self.room(4 * indices.len())?;
        let (view, bytes) = self.stream(0);
        let (offset, narrow) = (bytes.len(), vertices <= usize::from(u16::MAX));
        for &i in indices {
            if narrow {
                bytes.extend((i as u16).to_le_bytes());
            } else {
                bytes.extend(i.to_le_bytes());
            }
        }
        container::pad(bytes, 0);
        self.accessors.push(json!({
            "bufferView": view, "byteOffset": offset, "componentType": if narrow { U16 } else { U32 },
            "count": indices.len(), "type": "SCALAR",
        }));
        Ok(self.accessors.len() - 1)
    }

    /// Appends positions. Returns their accessor.
    pub fn positions(&mut self, positions: &[[f32; 3]]) -> Result<usize, ImportError> {
        let bytes = positions.as_flattened().iter().flat_map(|x| x.to_le_bytes());
        self.room(size_of_val(positions))?;
        let (view, stream) = self.stream(size_of::<[f32; 3]>());
        let offset = stream.len();
        stream.extend(bytes);
        self.accessors.push(container::positions_accessor(view, offset, positions));
        Ok(self.accessors.len() - 1)
    }

    /// Appends the elements of vertices. Returns their accessor.
    pub fn elements(&mut self, slot: &Slot<'_>, vertices: &[u32]) -> Result<usize, ImportError> {
        let stride = slot.elements.size().next_multiple_of(4);
        self.room(stride.saturating_mul(vertices.len()))?;
        let (view, bytes) = self.stream(stride);
        let offset = bytes.len();
        for &vertex in vertices {
            if !slot.elements.append(vertex as usize, bytes) {
                return Err(broken(format!("attribute {} ends before vertex {vertex}", slot.name)));
            }
            container::pad(bytes, 0);
        }
        let mut accessor = slot.like.clone();
        if let Some((component_type, width)) = slot.bounds {
            let elements = bytes[offset..].chunks_exact(stride).map(|b| numbers(&b[..slot.elements.size()], component_type));
            let (mut least, mut most) = (vec![f64::INFINITY; width], vec![f64::NEG_INFINITY; width]);
            for element in elements {
                for ((x, least), most) in element.zip(&mut least).zip(&mut most) {
                    (*least, *most) = (least.min(x), most.max(x));
                }
            }
            accessor["min"] = json!(least);
            accessor["max"] = json!(most);
        }
        accessor["bufferView"] = view.into();
        accessor["byteOffset"] = offset.into();
        accessor["count"] = vertices.len().into();
        self.accessors.push(accessor);
        Ok(self.accessors.len() - 1)
    }
}
