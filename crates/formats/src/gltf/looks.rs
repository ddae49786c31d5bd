//! Appearance of primitives: metallic-roughness materials, their pictures, and texture coordinates.
//!
//! Read on demand only ([`ImportOptions::trace`](super::ImportOptions::trace)). Invalid values become the defaults of the
//! specification: appearance never makes an import fail. KHR_texture_transform, KHR_materials_unlit,
//! KHR_materials_emissive_strength, KHR_materials_transmission, the older KHR_materials_pbrSpecularGlossiness (its diffuse part)
//! and EXT_texture_webp are read.

use super::data::Buffers;
use super::draco;
use super::primitive::Part;
use enfilade::scene::{Material, Picture};
use glam::{DMat2, DVec2};
use serde_json::Value;
use std::collections::HashMap;
use std::sync::Arc;

/// The materials of a document.
pub(super) struct Looks {
    root: Value,
    materials: Vec<Textured>,
}

/// A material, and the set and transform of its texture coordinates.
struct Textured {
    material: Material,
    set: u64,
    transform: Transform,
}

/// KHR_texture_transform: rotated and scaled, then moved.
#[derive(Clone, Copy, PartialEq)]
struct Transform {
    matrix: DMat2,
    offset: DVec2,
}

impl Looks {
    /// Reads a document with the text `json`.
    pub fn read(json: &[u8], buffers: &Buffers<'_>) -> Self {
        let root: Value = serde_json::from_slice(json).unwrap_or_default();
        let pictures: Vec<Option<Picture>> = list(&root["images"]).map(|image| picture(image, buffers)).collect();
        let mut names: HashMap<String, usize> = HashMap::new();
        let materials = list(&root["materials"]).enumerate().map(|(i, entry)| {
            let given = entry["name"].as_str().filter(|name| !name.is_empty());
            let name = super::short_name(given.unwrap_or(&format!("material {i}")));
            let copies = names.entry(name.clone()).or_default();
            *copies += 1;
            let name = if *copies > 1 { format!("{name} ({i})") } else { name };
            Textured::read(name, entry, &root["textures"], &pictures)
        });
        let materials = materials.collect();
        Self { root, materials }
    }

    /// The material of a primitive, and texture coordinates by triangle of `part`; no coordinates without a picture.
    pub fn of(
        &self,
        buffers: &Buffers<'_>,
        [mesh, primitive]: [usize; 2],
        part: &Part,
    ) -> Option<(Material, Vec<[[f32; 2]; 3]>)> {
        let entry = &self.root["meshes"][mesh]["primitives"][primitive];
        let textured = self.materials.get(entry["material"].as_u64()? as usize)?;
        let coordinates = || {
            textured.material.pictures().into_iter().flatten().next()?;
            let at = self.coordinates(buffers, entry, &format!("TEXCOORD_{}", textured.set))?;
            let at = |corner: u32| {
                let [u, v] = at(part.vertices[corner as usize] as usize).unwrap_or_default();
                textured.transform.apply(u, v)
            };
            Some(part.triangles.iter().map(|t| t.map(at)).collect())
        };
        Some((textured.material.clone(), coordinates().unwrap_or_default()))
    }
}

impl Looks {
    /// Texture coordinates by vertex of a primitive.
    fn coordinates<'b>(&self, buffers: &'b Buffers<'_>, primitive: &Value, name: &str) -> Option<Box<Coordinates<'b>>> {
        let attribute = primitive["attributes"][name].as_u64()?;
        if let Ok(accessor) = buffers.accessor(attribute as usize, &["VEC2"]) {
            return Some(Box::new(move |vertex| accessor.get(vertex).map(|[u, v, ..]| [u, v])));
        }
        let compressed = &primitive["extensions"]["KHR_draco_mesh_compression"];
        let id = compressed["attributes"][name].as_u64()?;
        let view = buffers.view(compressed["bufferView"].as_u64()? as usize).ok()?;
        let corners = self.root["accessors"][primitive["indices"].as_u64()? as usize]["count"].as_u64()?;
        let (bytes, size) = draco::attributes(view, &[id as usize], corners as usize).ok()?.pop()?;
        // Pairs of floats, as encoders write them.
        let is_pair = size == 2 * size_of::<f32>();
        let pair = move |vertex: usize| {
            let numbers = bytes.as_chunks::<4>().0.get(2 * vertex..2 * vertex + 2)?;
            Some([0, 1].map(|k| f64::from(f32::from_le_bytes(numbers[k]))))
        };
        if is_pair { Some(Box::new(pair)) } else { None }
    }
}

/// Texture coordinates of a vertex.
type Coordinates<'b> = dyn Fn(usize) -> Option<[f64; 2]> + 'b;

impl Textured {
    fn read(name: String, entry: &Value, textures: &Value, pictures: &[Option<Picture>]) -> Self {
        let extensions = &entry["extensions"];
        let older = &extensions["KHR_materials_pbrSpecularGlossiness"];
        let pbr = if older.is_object() { older } else { &entry["pbrMetallicRoughness"] };
        let [colour, texture] =
            if older.is_object() { ["diffuseFactor", "diffuseTexture"] } else { ["baseColorFactor", "baseColorTexture"] };
        let (mut colour, texture) = (numbers(&pbr[colour], [1.0; 4]), &pbr[texture]);
        // Coordinates are those of the first picture; pictures with other coordinates are left out.
        let others = [&entry["normalTexture"], &pbr["metallicRoughnessTexture"], &entry["emissiveTexture"]];
        let image = |texture: &Value| self::image(texture, textures, pictures);
        let first = [texture].into_iter().chain(others).find(|texture| image(texture).is_some());
        let coordinates = first.map_or((0, Transform::read(&Value::Null)), coordinates);
        let image = |texture: &Value| image(texture).filter(|_| self::coordinates(texture) == coordinates);
        let [normals, roughness_and_metallic, emissive_texture] = others.map(image);
        if entry["alphaMode"].as_str() != Some("BLEND") {
            // Transmitted light is tinted; even the clearest glass stays slightly visible.
            let transmission = &extensions["KHR_materials_transmission"]["transmissionFactor"];
            colour[3] = 1.0 - 0.7 * number(transmission, 0.0).clamp(0.0, 1.0);
        }
        let is_left_out = others[1].is_object() && roughness_and_metallic.is_none();
        let [metallic, roughness] = match (older.is_object(), is_left_out) {
            (true, _) => [0.0, 1.0 - number(&pbr["glossinessFactor"], 1.0)],
            // Materials with such a picture are mostly matt.
            (_, true) => [0.0, number(&pbr["roughnessFactor"], 1.0).max(0.7)],
            _ => [number(&pbr["metallicFactor"], 1.0), number(&pbr["roughnessFactor"], 1.0)],
        };
        // A texture without an image becomes an empty picture, so that its reader reports it.
        let leads_nowhere = |texture: &Value| texture.is_object() && self::image(texture, textures, pictures).is_none();
        let or_empty = |image: Option<Picture>, texture| {
            image.or_else(|| leads_nowhere(texture).then(|| Picture::Within(Arc::from([]))))
        };
        // A missing picture tells where it emits light, so it emits none.
        let emits = if others[2].is_object() && emissive_texture.is_none() { 0.0 } else { 1.0 };
        let strength = emits * number(&extensions["KHR_materials_emissive_strength"]["emissiveStrength"], 1.0);
        let is_masked = entry["alphaMode"].as_str() == Some("MASK");
        let material = Material {
            metallic: metallic.clamp(0.0, 1.0),
            roughness: roughness.clamp(0.0, 1.0),
            emissive: numbers(&entry["emissiveFactor"], [0.0; 3]).map(|x| (x * strength).max(0.0)),
            unlit: extensions["KHR_materials_unlit"].is_object(),
            cutoff: is_masked.then(|| number(&entry["alphaCutoff"], 0.5)),
            texture: or_empty(image(texture), texture),
            normals: or_empty(normals, others[0]),
            normal_scale: number(&entry["normalTexture"]["scale"], 1.0),
            roughness_and_metallic: or_empty(roughness_and_metallic, others[1]),
            emissive_texture: or_empty(emissive_texture, others[2]),
            ..Material::matt(name, colour.map(|x| x.clamp(0.0, 1.0)))
        };
        Self { material, set: coordinates.0, transform: coordinates.1 }
    }
}

/// The set of a texture's coordinates, and their transform.
fn coordinates(texture: &Value) -> (u64, Transform) {
    let transform = &texture["extensions"]["KHR_texture_transform"];
    let set = transform["texCoord"].as_u64().or(texture["texCoord"].as_u64()).unwrap_or(0);
    (set, Transform::read(transform))
}

impl Transform {
    fn read(extension: &Value) -> Self {
        let [x, y] = numbers(&extension["scale"], [1.0; 2]).map(f64::from);
        let [u, v] = numbers(&extension["offset"], [0.0; 2]).map(f64::from);
        let (sin, cos) = f64::from(number(&extension["rotation"], 0.0)).sin_cos();
        // Counter-clockwise about the top left corner, with v downwards.
        let rotation = DMat2::from_cols(DVec2::new(cos, -sin), DVec2::new(sin, cos));
        Self { matrix: rotation * DMat2::from_diagonal(DVec2::new(x, y)), offset: DVec2::new(u, v) }
    }

    fn apply(&self, u: f64, v: f64) -> [f32; 2] {
        (self.matrix * DVec2::new(u, v) + self.offset).as_vec2().to_array()
    }
}

/// The image of a texture.
fn source(texture: &Value) -> Option<u64> {
    texture["source"].as_u64().or(texture["extensions"]["EXT_texture_webp"]["source"].as_u64())
}

/// The picture of a material's texture.
fn image(texture: &Value, textures: &Value, pictures: &[Option<Picture>]) -> Option<Picture> {
    let source = source(&textures[texture["index"].as_u64()? as usize])?;
    pictures.get(source as usize)?.clone()
}

fn picture(image: &Value, buffers: &Buffers<'_>) -> Option<Picture> {
    if let Some(uri) = image["uri"].as_str() {
        return Some(Picture::Named(uri.to_owned()));
    }
    let view = image["bufferView"].as_u64()?;
    buffers.view(view as usize).ok().map(|bytes| Picture::Within(Arc::from(bytes)))
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn number(value: &Value, default: f32) -> f32 {
    value.as_f64().map(|x| x as f32).filter(|x| x.is_finite()).unwrap_or(default)
}

fn numbers<const N: usize>(value: &Value, default: [f32; N]) -> [f32; N] {
    let mut out = default;
    out.iter_mut().enumerate().for_each(|(i, x)| *x = number(&value[i], *x));
    out
}
