//! Models read and written: a file goes in, a [`Scene`] comes out.
//!
//! A module a format; every importer hands its meshes to [`enfilade::scene::SceneBuilder`], which checks numbers, splits meshes above the object
//! limit into clusters, picks the origin and orders triangles by object. [`mod@export`] writes a model with a node per object.

pub mod export;
pub mod geojson;
pub mod gltf;
mod helpers;
pub mod ifc;
pub mod indoorgml;
mod lines;
mod lod;
pub mod obj;
pub mod ply;
pub mod stl;
mod textures;

use enfilade::scene::{ImportError, ImportOptions, Picture, Scene, up};
use enfilade_levels::quake;
use std::borrow::Cow;
use std::path::Path;

/// Reads a scene; the format is taken from the extension (`.glb`, `.gltf`, `.obj`, `.ply`, `.stl`, `.ifc`, `.ifczip`, `.gml`, `.geojson`, `.bsp`, `.map`).
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "glb" | "gltf" => gltf::import(path, options).map(with_note),
        "obj" => obj::import(path, options).map(with_note),
        "ply" => ply::import(path, options).map(with_note),
        "stl" => stl::import(path, options).map(with_note),
        "ifc" | "ifczip" => ifc::import(path, options),
        "gml" => indoorgml::import(path, options),
        "geojson" => geojson::import(path, options),
        "bsp" => quake::import(path, options),
        "map" => quake::import_map(path, options),
        _ => Err(ImportError::UnknownFormat { extension }),
    }
}

/// Of a format that doesn't say what is up.
fn with_note(mut scene: Scene) -> Scene {
    if scene.source.up == "+Y" {
        scene.source.notes.extend(up::note(&scene));
    }
    scene
}

/// The extensions that [`import`] reads in this build, in small letters.
pub fn extensions() -> impl Iterator<Item = &'static str> {
    let (ifc, quake) = (cfg!(feature = "ifc"), cfg!(feature = "quake"));
    let all = [
        ("glb", true),
        ("gltf", true),
        ("obj", true),
        ("ply", true),
        ("stl", true),
        ("ifc", ifc),
        ("ifczip", ifc),
        ("gml", true),
        ("geojson", true),
        ("bsp", quake),
        ("map", quake),
    ];
    all.into_iter().filter(|(_, is_read)| *is_read).map(|(extension, _)| extension)
}

/// The file of a material's picture (PNG, JPEG, WebP, KTX2 or DDS), for a model read from `path` with `options`. The error is one line.
pub fn picture<'p>(picture: &'p Picture, path: &Path, options: &ImportOptions) -> Result<Cow<'p, [u8]>, String> {
    match picture {
        Picture::Within(bytes) if bytes.is_empty() => Err("a texture leads to no image that is read".to_owned()),
        Picture::Within(bytes) => Ok(Cow::Borrowed(bytes)),
        Picture::Named(uri) => Ok(Cow::Owned(gltf::pictures::Pictures::beside(path.parent(), options).read(uri)?.1)),
    }
}
