//! Pictures referenced by a model: files beside it, or `data:` uris.

use super::data::load;
use enfilade::scene::ImportOptions;
use enfilade::scene::sidecar::Sidecars;
use std::path::Path;

/// Reads a model's pictures.
#[derive(Clone, Copy)]
pub(crate) struct Pictures<'a>(Sidecars<'a>);

impl<'a> Pictures<'a> {
    /// From the folder of a model, within the options.
    pub(crate) fn beside(folder: Option<&'a Path>, options: &'a ImportOptions) -> Self {
        Self(Sidecars { folder, under: options.files_under.as_deref() })
    }

    /// A picture and its media type, such as `image/png`.
    pub(crate) fn read(&self, uri: &str) -> Result<(&'static str, Vec<u8>), String> {
        let bytes = load(uri, self.0)?;
        let kind = kind(&bytes).ok_or_else(|| format!("`{uri:.100}` is not a picture type of glTF"))?;
        Ok((kind, bytes))
    }
}

/// Media type by the first bytes, for glTF and its extensions.
fn kind(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => Some("image/png"),
        [0xFF, 0xD8, 0xFF, ..] => Some("image/jpeg"),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some("image/webp"),
        [0xAB, b'K', b'T', b'X', b' ', b'2', b'0', ..] => Some("image/ktx2"),
        [b'D', b'D', b'S', b' ', ..] => Some("image/vnd-ms.dds"),
        _ => None,
    }
}
