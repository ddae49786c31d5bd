//! Finds materials that are marked as blended or masked but have no alpha: some exporters mark all materials so.
//!
//! Alpha is the product of the base colour's factor, the picture and the corners' colour (glTF 2.0 specification, 3.9). A picture
//! has none if it is a JPEG, or a grey or RGB PNG without a transparent colour. For pictures in files the name decides.
//! Animations that fade materials are in [`super::motion`].

use super::data::Buffers;
use super::document::{Document, Material};
use serde_json::Value;

/// Materials of a document by alpha.
pub(super) struct Alpha {
    /// For each material: whether alpha is 1 wherever that of the corners is.
    is_one: Vec<bool>,
}

impl Alpha {
    /// Reads a document; invalid entries may have alpha.
    pub fn read(document: &Document, buffers: &Buffers<'_>) -> Self {
        let pictures = Pictures { textures: document.textures(), images: document.images(), buffers };
        let is_one = |material: &Material| material.has_alpha_mode() && pictures.leave_opaque(material);
        Self { is_one: document.materials.iter().map(is_one).collect() }
    }

    /// Whether only the colours of corners can let light through.
    pub fn is_one(&self, material: usize) -> bool {
        self.is_one.get(material).copied().unwrap_or(false)
    }
}

struct Pictures<'a, 'b> {
    textures: Value,
    images: Value,
    buffers: &'a Buffers<'b>,
}

impl Pictures<'_, '_> {
    fn leave_opaque(&self, material: &Material) -> bool {
        let Some(base) = material.base() else { return false };
        let factor = match &base["baseColorFactor"] {
            Value::Null => 1.0,
            factor => factor[3].as_f64().unwrap_or(0.0),
        };
        let texture = &base["baseColorTexture"];
        factor >= 1.0 && (texture.is_null() || self.has_no_alpha(texture).unwrap_or(false))
    }

    fn has_no_alpha(&self, texture: &Value) -> Option<bool> {
        let texture = &self.textures[texture["index"].as_u64()? as usize];
        // The picture of an extension (WebP, Basis Universal) takes precedence.
        let source = texture["source"].as_u64().filter(|_| texture["extensions"].is_null())?;
        let image = &self.images[source as usize];
        if let Some(uri) = image["uri"].as_str() {
            let name = uri.to_ascii_lowercase();
            return Some(name.starts_with("data:image/jpeg") || !name.starts_with("data:") && is_named_jpeg(&name));
        }
        let view = image["bufferView"].as_u64()?;
        Some(is_without_alpha(self.buffers.view(view as usize).ok()?))
    }
}

fn is_named_jpeg(name: &str) -> bool {
    [".jpg", ".jpeg"].iter().any(|end| name.ends_with(end))
}

/// Whether a picture has no alpha, by its first bytes.
fn is_without_alpha(bytes: &[u8]) -> bool {
    const JPEG: &[u8] = b"\xff\xd8\xff";
    const PNG: &[u8] = b"\x89PNG\r\n\x1a\n";
    /// Offset of the header's colour type, and of the chunk after the header.
    const COLOUR_TYPE: usize = 25;
    const AFTER_HEADER: usize = 33;
    if bytes.starts_with(JPEG) {
        return true;
    }
    if !bytes.starts_with(PNG) || !matches!(bytes.get(COLOUR_TYPE), Some(0 | 2)) {
        return false;
    }
    // A transparent colour comes before the pixels.
    let mut at = AFTER_HEADER;
    while let Some(head) = bytes.get(at..).and_then(|rest| rest.first_chunk::<8>()) {
        match &head[4..] {
            b"tRNS" => return false,
            b"IDAT" => return true,
            _ => {}
        }
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]);
        at = at.saturating_add(length as usize).saturating_add(12);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A PNG of one pixel.
    fn png(colour: png::ColorType, transparent: Option<&[u8]>, pixel: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, 1, 1);
        encoder.set_color(colour);
        if let Some(transparent) = transparent {
            encoder.set_trns(transparent.to_vec());
        }
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(pixel).unwrap();
        writer.finish().unwrap();
        out
    }

    #[test]
    fn pictures_without_alpha_are_told_by_their_headers() {
        use png::ColorType::{Grayscale, GrayscaleAlpha, Rgb, Rgba};
        for (bytes, without) in [
            (png(Grayscale, None, &[7]), true),
            (png(Rgb, None, &[1, 2, 3]), true),
            (png(Rgb, Some(&[0, 1, 0, 2, 0, 3]), &[1, 2, 3]), false),
            (png(GrayscaleAlpha, None, &[7, 255]), false),
            (png(Rgba, None, &[1, 2, 3, 255]), false),
            (b"\xff\xd8\xff\xe0".to_vec(), true),
            (b"RIFF\0\0\0\0WEBP".to_vec(), false),
            (Vec::new(), false),
        ] {
            assert_eq!(is_without_alpha(&bytes), without, "{bytes:?}");
            // At every length: nothing is read beyond the end, and a picture with alpha never counts as opaque.
            for end in 0..bytes.len() {
                assert!(without || !is_without_alpha(&bytes[..end]), "{bytes:?} to {end}");
            }
        }
    }
}
