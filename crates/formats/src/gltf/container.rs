//! The container of a `.glb`: two chunks, JSON and binary; and shared code for writing one.
//!
//! Based on: Khronos Group, *glTF 2.0 Specification*, 2021, section 4.4.

use enfilade::scene::{ImportError, Place};
use serde_json::{Value, json};

/// A component type of accessors.
pub const U16: u32 = 5123;
/// A component type of accessors.
pub const U32: u32 = 5125;
pub(crate) const FLOAT: u32 = 5126;
/// A target of buffer views.
pub const ARRAY_BUFFER: u32 = 34962;
/// A target of buffer views.
pub const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Start of the JSON chunk's text.
pub(super) const JSON_START: usize = 20;

/// The JSON and BIN chunks of a `.glb`.
pub fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ImportError> {
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
        word.ok_or_else(|| ImportError::malformed(Place::Byte(bytes.len()), "the file ends within a GLB header"))
    };
    let version = word(4)?;
    if version != 2 {
        return Err(ImportError::Unsupported { what: format!("GLB version {version}"), hint: "export it as glTF 2.0" });
    }
    let length = word(8)? as usize;
    if length > bytes.len() || length < JSON_START {
        let what = format!("the header says {length} bytes, the file has {}", bytes.len());
        return Err(ImportError::malformed(Place::Byte(8), what));
    }
    let chunk = |at: usize, kind: &[u8; 4]| -> Result<&[u8], ImportError> {
        let end = at + 8 + word(at)? as usize;
        if end > length {
            let what = format!("a chunk ends at byte {end}, the file at {length}");
            return Err(ImportError::malformed(Place::Byte(at), what));
        }
        if word(at + 4)? != u32::from_le_bytes(*kind) {
            let what = format!("no {} chunk here", kind.escape_ascii().to_string().trim_end_matches("\\x00"));
            return Err(ImportError::malformed(Place::Byte(at + 4), what));
        }
        Ok(&bytes[at + 8..end])
    };
    let json = chunk(12, b"JSON")?;
    let next = JSON_START + json.len();
    // Chunks of other kinds may follow and are ignored.
    let bin = if next + 8 <= length && word(next + 4)? == u32::from_le_bytes(*b"BIN\0") {
        Some(chunk(next, b"BIN\0")?)
    } else {
        None
    };
    Ok((json, bin))
}

/// The bytes of a `.glb`, without a binary chunk if that is empty; `None` if it exceeds the 4 GiB that its header can count.
pub fn glb(document: &Value, mut binary: Vec<u8>) -> Option<Vec<u8>> {
    let mut text = document.to_string().into_bytes();
    pad(&mut text, b' ');
    pad(&mut binary, 0);
    let chunks = [(b"JSON", &text), (b"BIN\0", &binary)].into_iter().filter(|(_, chunk)| !chunk.is_empty());
    let total = u32::try_from(12 + chunks.clone().map(|(_, chunk)| 8 + chunk.len()).sum::<usize>()).ok()?;
    let mut out = Vec::with_capacity(total as usize);
    out.extend(b"glTF");
    out.extend(2u32.to_le_bytes());
    out.extend(total.to_le_bytes());
    for (kind, chunk) in chunks {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    Some(out)
}

/// An accessor of positions from an offset in a view, with their bounds.
pub fn positions_accessor(view: usize, offset: usize, positions: &[[f32; 3]]) -> Value {
    let bound = |pick: fn(f32, f32) -> f32| -> Value {
        (0..3).map(|k| json!(positions.iter().map(|p| p[k]).reduce(pick))).collect()
    };
    json!({
        "bufferView": view, "byteOffset": offset, "componentType": FLOAT, "count": positions.len(), "type": "VEC3",
        "min": bound(f32::min), "max": bound(f32::max),
    })
}

/// Pads to a multiple of four bytes, as chunks and views require.
pub fn pad(bytes: &mut Vec<u8>, with: u8) {
    bytes.resize(bytes.len().next_multiple_of(4), with);
}
