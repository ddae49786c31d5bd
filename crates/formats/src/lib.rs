//! Readers and writers of models: a file goes in, a [`Scene`] comes out.
//!
//! There is one module per format. Every importer passes its meshes to [`enfilade::scene::SceneBuilder`], which checks numbers,
//! splits meshes above the object limit into clusters, picks the origin and orders triangles by object. [`mod@export`] writes a
//! model with a node per object.

pub mod elements;
pub mod export;
pub mod geojson;
pub mod gltf;
mod helpers;
#[cfg(feature = "ifc")]
pub mod ifc;
pub mod indoorgml;
mod known;
mod lines;
mod lod;
pub mod obj;
pub mod ply;
pub mod stl;
mod textures;

pub use known::{FORMATS, Format, all_extensions, extensions, format_of};

use elements::Elements;
use enfilade::scene::{ImportError, ImportOptions, Picture, Scene, up};
use std::borrow::Cow;
use std::path::Path;

/// Reads a scene; the file's extension selects one of [`FORMATS`].
///
/// # Errors
///
/// If no format has the extension, this build lacks the format's feature, or its importer fails.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let format = known(path)?;
    let mut scene = format.read.ok_or_else(|| missing(format))?(path, options)?;
    if format.is_up_open && scene.source.up == "+Y" {
        scene.source.notes.extend(up::note(&scene));
    }
    Ok(scene)
}

/// Reads names, types and properties of a model's elements. Only IFC has them.
///
/// # Errors
///
/// As of [`import`].
pub fn elements(path: &Path) -> Result<Elements, ImportError> {
    let format = known(path)?;
    match format.read_elements {
        Some(read) => read(path),
        None if format.is_built() => Ok(Elements::default()),
        None => Err(missing(format)),
    }
}

fn known(path: &Path) -> Result<&'static Format, ImportError> {
    let extension = || path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    format_of(path).ok_or_else(|| ImportError::UnknownFormat { extension: extension(), known: all_extensions() })
}

fn missing(format: &'static Format) -> ImportError {
    ImportError::MissingFeature { format: format.name, feature: format.feature.unwrap_or_default() }
}

/// The bytes of a material's picture (PNG, JPEG, WebP, KTX2 or DDS), for a model read from `path` with `options`. Errors have one
/// line.
pub fn picture<'p>(picture: &'p Picture, path: &Path, options: &ImportOptions) -> Result<Cow<'p, [u8]>, String> {
    match picture {
        Picture::Within(bytes) if bytes.is_empty() => Err("a texture has no image of a supported type".to_owned()),
        Picture::Within(bytes) => Ok(Cow::Borrowed(bytes)),
        Picture::Named(uri) => Ok(Cow::Owned(gltf::pictures::Pictures::beside(path.parent(), options).read(uri)?.1)),
    }
}
