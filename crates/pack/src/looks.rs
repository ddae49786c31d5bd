//! Materials of a chunk, and the pictures of all chunks, each once.

use crate::model::Model;
use serde_json::{Map, Value, json};
use std::collections::{BTreeSet, HashMap};

/// The pictures of a model.
pub(crate) struct Pictures {
    /// Name and bytes of each.
    pub(crate) files: Vec<(String, Vec<u8>)>,
    /// By image of the model; `None`: its bytes are not in the model.
    of_image: Vec<Option<usize>>,
}

impl Pictures {
    /// Of a model; equal bytes are one picture.
    pub(crate) fn of(model: &Model) -> Self {
        let mut files: Vec<(String, Vec<u8>)> = Vec::new();
        let mut known: HashMap<&[u8], usize> = HashMap::new();
        let mut of_image = Vec::new();
        for image in (0..).map(|i| model.entry("images", i)).take_while(|image| !image.is_null()) {
            let view = image["bufferView"].as_u64().and_then(|view| model.view(view as usize));
            of_image.push(view.map(|bytes| {
                *known.entry(bytes).or_insert_with(|| {
                    let kind = extension(image["mimeType"].as_str().unwrap_or_default());
                    files.push((format!("pictures/{}.{kind}", files.len()), bytes.to_vec()));
                    files.len() - 1
                })
            }));
        }
        Self { files, of_image }
    }

    /// The pictures of a material, ascending.
    pub(crate) fn of_material(&self, model: &Model, material: Option<usize>) -> BTreeSet<usize> {
        let mut found = BTreeSet::new();
        let mut material = material.map_or(Value::Null, |material| model.entry("materials", material).clone());
        each_texture(&mut material, &mut |info| {
            let texture = info["index"].as_u64().map(|texture| model.entry("textures", texture as usize));
            found.extend(
                texture.into_iter().flat_map(sources).filter_map(|(_, image)| self.of_image.get(image).copied().flatten()),
            );
            true
        });
        found
    }
}

fn extension(media_type: &str) -> &'static str {
    match media_type {
        "image/png" => "png",
        "image/jpeg" => "jpg",
        "image/webp" => "webp",
        "image/ktx2" => "ktx2",
        "image/vnd-ms.dds" => "dds",
        _ => "bin",
    }
}

/// The images of a texture: its own (`None`), and those of extensions.
fn sources(texture: &Value) -> Vec<(Option<&str>, usize)> {
    let own = texture["source"].as_u64().map(|image| (None, image as usize));
    let extensions = texture["extensions"].as_object().into_iter().flatten();
    let others = extensions.filter_map(|(name, e)| Some((Some(name.as_str()), e["source"].as_u64()? as usize)));
    own.into_iter().chain(others).collect()
}

/// Calls `keep` with each reference to a texture in a material, and removes those of which it says no.
fn each_texture(value: &mut Value, keep: &mut dyn FnMut(&mut Value) -> bool) {
    let Some(map) = value.as_object_mut() else { return };
    map.retain(|name, value| {
        if name.to_ascii_lowercase().ends_with("texture") && value["index"].is_u64() {
            return keep(value);
        }
        if name != "extras" {
            each_texture(value, keep);
        }
        true
    });
}

/// The materials of one file, and what they lead to.
#[derive(Default)]
pub(crate) struct Looks {
    materials: Vec<Value>,
    textures: Vec<Value>,
    samplers: Vec<Value>,
    images: Vec<Value>,
    /// By material of the model.
    numbers: HashMap<usize, usize>,
    texture_numbers: HashMap<usize, Option<usize>>,
    sampler_numbers: HashMap<u64, usize>,
    picture_numbers: HashMap<usize, usize>,
    /// Extensions that are used.
    extensions: BTreeSet<String>,
    /// Used pictures.
    pub(crate) pictures: BTreeSet<usize>,
}

impl Looks {
    /// The number of a material of the model in this file.
    pub(crate) fn number(&mut self, model: &Model, pictures: &Pictures, material: usize) -> usize {
        if let Some(&number) = self.numbers.get(&material) {
            return number;
        }
        let mut new = model.entry("materials", material).clone();
        each_texture(&mut new, &mut |info| {
            let texture = info["index"].as_u64().unwrap_or_default() as usize;
            let number = self.texture(model, pictures, texture);
            info["index"] = number.into();
            number.is_some()
        });
        if let Some(new) = new.as_object_mut() {
            // Clients name it by its number.
            new.remove("name");
            new.insert("extras".to_owned(), json!({ "enfilade": material }));
        }
        used_extensions(&new, &mut self.extensions);
        self.materials.push(new);
        self.numbers.insert(material, self.materials.len() - 1);
        self.materials.len() - 1
    }

    /// The number of a texture; `None` if none of its pictures is there.
    fn texture(&mut self, model: &Model, pictures: &Pictures, texture: usize) -> Option<usize> {
        if let Some(&number) = self.texture_numbers.get(&texture) {
            return number;
        }
        let old = model.entry("textures", texture);
        let mut new = Map::new();
        let mut extensions = Map::new();
        for (extension, image) in sources(old) {
            let Some(picture) = pictures.of_image.get(image).copied().flatten() else { continue };
            let image = self.image(pictures, picture);
            match extension {
                None => _ = new.insert("source".to_owned(), image.into()),
                Some(name) => _ = extensions.insert(name.to_owned(), json!({ "source": image })),
            }
        }
        let is_there = new.contains_key("source") || !extensions.is_empty();
        if !extensions.is_empty() {
            new.insert("extensions".to_owned(), extensions.into());
        }
        if let Some(sampler) = old["sampler"].as_u64().filter(|_| is_there) {
            let samplers = &mut self.samplers;
            let number = *self.sampler_numbers.entry(sampler).or_insert_with(|| {
                samplers.push(model.entry("samplers", sampler as usize).clone());
                samplers.len() - 1
            });
            new.insert("sampler".to_owned(), number.into());
        }
        let number = is_there.then(|| {
            let new = Value::Object(new);
            used_extensions(&new, &mut self.extensions);
            self.textures.push(new);
            self.textures.len() - 1
        });
        self.texture_numbers.insert(texture, number);
        number
    }

    fn image(&mut self, pictures: &Pictures, picture: usize) -> usize {
        let images = &mut self.images;
        self.pictures.insert(picture);
        *self.picture_numbers.entry(picture).or_insert_with(|| {
            images.push(json!({ "uri": format!("../{}", pictures.files[picture].0) }));
            images.len() - 1
        })
    }

    /// Writes the lists of the document. Returns the extensions that they use.
    pub(crate) fn write(self, root: &mut Value) -> BTreeSet<String> {
        let lists = [
            ("materials", self.materials),
            ("textures", self.textures),
            ("samplers", self.samplers),
            ("images", self.images),
        ];
        for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            root[name] = list.into();
        }
        self.extensions
    }
}

/// Names of the extensions of a value and of all below it.
fn used_extensions(value: &Value, into: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => {
            for (name, value) in map {
                if name == "extensions" {
                    into.extend(value.as_object().into_iter().flat_map(Map::keys).cloned());
                }
                used_extensions(value, into);
            }
        }
        Value::Array(list) => list.iter().for_each(|value| used_extensions(value, into)),
        _ => {}
    }
}
