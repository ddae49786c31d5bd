//! A GLB written by hand: a document, and a BIN chunk that grows as accessors are added.

use serde_json::{Value, json};

/// A model in the making.
#[derive(Clone)]
pub struct Glb {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Default for Glb {
    fn default() -> Self {
        Self::new()
    }
}

impl Glb {
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
            "buffers": [{"byteLength": 0}], "materials": []
        });
        Self { json, bin: Vec::new() }
    }

    /// Appends to one of the document's tables; the index of what was appended.
    pub fn push(&mut self, table: &str, value: Value) -> usize {
        let table = self.json[table].as_array_mut().unwrap();
        table.push(value);
        table.len() - 1
    }

    /// A buffer view over these bytes.
    pub fn view(&mut self, bytes: &[u8], stride: Option<usize>) -> usize {
        let mut view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        if let Some(stride) = stride {
            view["byteStride"] = stride.into();
        }
        self.bin.extend_from_slice(bytes);
        while !self.bin.len().is_multiple_of(4) {
            self.bin.push(0);
        }
        self.json["buffers"][0]["byteLength"] = self.bin.len().into();
        self.push("bufferViews", view)
    }

    pub fn accessor(&mut self, bytes: &[u8], stride: Option<usize>, component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes, stride);
        self.push("accessors", json!({"bufferView": view, "componentType": component, "type": kind, "count": count}))
    }

    /// Positions as `f32`.
    pub fn positions(&mut self, points: &[[f32; 3]]) -> usize {
        let bytes: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, None, 5126, "VEC3", points.len())
    }

    /// Vertex indices as `u16`.
    pub fn indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(&bytes, None, 5123, "SCALAR", indices.len())
    }

    /// A mesh of one primitive without indices.
    pub fn mesh(&mut self, points: &[[f32; 3]]) -> usize {
        let position = self.positions(points);
        self.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}}]}))
    }

    pub fn node(&mut self, node: Value) -> usize {
        self.push("nodes", node)
    }

    /// The file's bytes.
    pub fn bytes(&self) -> Vec<u8> {
        pack(self.json.to_string().as_bytes(), Some(&self.bin))
    }
}

/// A `.glb` of these two chunks.
pub fn pack(json: &[u8], bin: Option<&[u8]>) -> Vec<u8> {
    let mut out = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    let mut chunk = |kind: &[u8; 4], bytes: &[u8], filler: u8| {
        let length = bytes.len().next_multiple_of(4);
        out.extend((length as u32).to_le_bytes());
        out.extend(kind);
        out.extend(bytes);
        out.resize(out.len() + length - bytes.len(), filler);
    };
    chunk(b"JSON", json, b' ');
    if let Some(bin) = bin {
        chunk(b"BIN\0", bin, 0);
    }
    let length = out.len() as u32;
    out[8..12].copy_from_slice(&length.to_le_bytes());
    out
}

/// The document of a `.glb` and the chunk behind it.
pub fn parts(glb: &[u8]) -> (Value, Vec<u8>) {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    (serde_json::from_slice(&glb[20..20 + length]).unwrap(), glb[28 + length..].to_vec())
}

/// As URIs have it.
pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let of = |three: &[u8]| {
        let word = (0..3).fold(0, |word, k| word << 8 | u32::from(three.get(k).copied().unwrap_or(0)));
        let letter =
            |k: usize| if k > three.len() { '=' } else { char::from(LETTERS[(word >> (18 - 6 * k) & 63) as usize]) };
        (0..4).map(letter).collect::<String>()
    };
    bytes.chunks(3).map(of).collect()
}
