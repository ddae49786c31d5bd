//! Cuts a model into its objects: one node and one mesh per object, with the attributes, materials and pictures of the source.
//!
//! Nodes keep their numbers, transforms, animations, cameras and lights; the objects of a node become its children. The mesh of
//! an object has only the vertices of its triangles, and objects with the same triangles of one primitive share it, such as
//! instances. Compressed data is written uncompressed, and all buffers and pictures are in the single binary chunk.

mod output;
mod references;

use super::container::{ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER};
use super::data::{broken, entry, width};
use super::document::{self, Document, Primitive};
use super::pictures::Pictures;
use super::{Drawn, Placement, Reading, container, draco, read, roots};
use enfilade::scene::{ImportError, ImportOptions, Scene, Trace, whole_file};
use enfilade_tubes::{part, usual_sides};
use glam::{DQuat, DVec3};
use output::{Elements, Output, Slot, too_large};
use references::{each_accessor, each_mesh, each_view, is_plain, list, named, push, remove_extension, renumbered, taken};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

const DRACO: &str = "KHR_draco_mesh_compression";
const INSTANCING: &str = "EXT_mesh_gpu_instancing";
const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Limit of the output, as a multiple of the source. Decoding, and vertices shared by objects, seldom give more than four times.
/// More: a small file with many views of the same bytes takes much memory. Less: strongly compressed models are refused.
const MOST_GROWTH: usize = 256;

/// A model cut into its objects.
pub(crate) struct Cut {
    /// A `.glb`.
    pub glb: Vec<u8>,
    /// Number of meshes; shared ones count once.
    pub meshes: usize,
    /// Missing data, one line each.
    pub notes: Vec<String>,
}

/// Reads a model as [`super::import`], checks that it is the right one, and cuts it. `extras` gives the contents of
/// `extras.enfilade` for each object.
pub(crate) fn cut_file<E: From<ImportError>>(
    path: &Path,
    options: &ImportOptions,
    check: impl FnOnce(&Scene) -> Result<(), E>,
    extras: &dyn Fn(usize) -> Value,
) -> Result<Cut, E> {
    let source = &whole_file::model(path).map_err(ImportError::from)?;
    let folder = path.parent();
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let (document, bin) = document::read(source)?;
    let options = &ImportOptions { trace: true, ..options.clone() };
    let reading = read(&document, bin, None, &name, folder, options)?;
    check(&reading.scene)?;
    let root = serde_json::from_slice(document::text(source)?.0);
    let root: Value = root.map_err(|e| broken(format!("not a glTF document: {e}")))?;
    if !is_plain(&root) {
        return Err(broken("not a glTF document: arrays where objects are expected").into());
    }
    let most = MOST_GROWTH.saturating_mul(source.len().saturating_add(reading.buffers.size()));
    let output = Output { accessors: Vec::new(), views: Vec::new(), kept: Vec::new(), streams: Vec::new(), most };
    let metres_per_unit = options.metres_per_unit.unwrap_or(1.0);
    let (notes, tubes) = (Vec::new(), Vec::new());
    let mut cutter = Cutter { reading: &reading, document: &document, metres_per_unit, options, root, output, tubes, notes };
    let source_meshes = cutter.keep_the_rest()?;
    cutter.pictures(Pictures::beside(folder, options))?;
    let meshes = cutter.objects(&source_meshes, extras)?;
    cutter.scenes()?;
    Ok(Cut { glb: cutter.finish()?, meshes, notes: cutter.notes })
}

struct Cutter<'a> {
    reading: &'a Reading<'a>,
    document: &'a Document,
    /// The output document.
    root: Value,
    output: Output,
    metres_per_unit: f64,
    options: &'a ImportOptions,
    /// Nodes of tubes.
    tubes: Vec<usize>,
    notes: Vec<String>,
}

impl<'a> Cutter<'a> {
    /// Removes the meshes that objects replace, and then unused entries of the lists. Returns the original meshes.
    fn keep_the_rest(&mut self) -> Result<Vec<Value>, ImportError> {
        let source_meshes: Vec<Value> = list(&mut self.root, "meshes").map(|mesh| mesh.clone()).collect();

        // 1. Meshes: points and lines of drawn meshes stay.
        let of_tubes = |d: &&Drawn| d.is_tube;
        let lines = self.reading.drawn.iter().filter(of_tubes).map(|d| (d.mesh, d.primitive)).collect();
        let mut rests: BTreeMap<usize, Option<usize>> = BTreeMap::new();
        for &Drawn { node, mesh, .. } in &self.reading.drawn {
            let rest = *rests.entry(mesh).or_insert_with(|| self.rest_of(mesh, &lines));
            let node = &mut self.root["nodes"][node];
            remove_extension(node, INSTANCING);
            // The node is no longer a tube.
            let ours = node.pointer_mut("/extras/enfilade").and_then(Value::as_object_mut);
            ours.and_then(|ours| ours.remove("tube"));
            node["mesh"] = json!(rest);
        }
        self.undraw();
        let kept = renumbered(&mut self.root, each_mesh);
        self.root["meshes"] = taken(&mut self.root, "meshes", &kept)?.into();

        // 2. Accessors.
        let kept = renumbered(&mut self.root, each_accessor);
        self.root["accessors"] = taken(&mut self.root, "accessors", &kept)?.into();

        // 3. Views.
        self.root["bufferViews"].take();
        let kept = renumbered(&mut self.root, each_view);
        for view in kept {
            let bytes = self.reading.buffers.view(view)?;
            let stride = entry(&self.document.buffer_views, view, "bufferView")?.byte_stride;
            let number = self.output.view(bytes)?;
            if let Some(stride) = stride {
                self.output.views[number]["byteStride"] = stride.into();
            }
        }
        let count = list(&mut self.root, "accessors").len();
        self.output.accessors = taken(&mut self.root, "accessors", &(0..count).collect::<Vec<_>>())?;
        Ok(source_meshes)
    }

    /// A new mesh of the primitives that are neither triangles nor tubes (`lines`: mesh and primitive), if there are any.
    fn rest_of(&mut self, mesh: usize, lines: &HashSet<(usize, usize)>) -> Option<usize> {
        let parts = self.reading.parts[mesh].as_ref()?;
        let mut rest = self.root["meshes"][mesh].clone();
        let mut is_rest = parts.iter().enumerate().map(|(i, part)| part.is_none() && !lines.contains(&(mesh, i)));
        rest["primitives"].as_array_mut()?.retain(|_| is_rest.next().unwrap_or(false));
        let meshes = self.root["meshes"].as_array_mut().filter(|_| rest["primitives"] != json!([]))?;
        meshes.push(rest);
        Some(meshes.len() - 1)
    }

    /// Removes meshes from the nodes of room surfaces and portals, and from nodes that objects replaced entirely.
    fn undraw(&mut self) {
        for &node in &self.reading.undrawn {
            self.root["nodes"][node]["mesh"].take();
        }
        if !self.reading.undrawn.is_empty() {
            self.notes.push(format!("{} surfaces of rooms and portals are not drawn", self.reading.undrawn.len()));
        }
        for node in list(&mut self.root, "nodes").filter(|node| node.get("mesh").is_some_and(Value::is_null)) {
            node.as_object_mut().map(|node| node.remove("mesh"));
        }
    }

    /// Moves animations of morph targets to the nodes of the objects.
    fn morph(&mut self, objects_of: &BTreeMap<usize, Vec<usize>>) {
        for animation in list(&mut self.root, "animations") {
            let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) else { continue };
            let passed_on = |channel: Value| {
                let target = &channel["target"];
                let node = target["node"].as_u64().filter(|_| target["path"] == "weights").map(|node| node as usize);
                let Some(objects) = node.and_then(|node| objects_of.get(&node)) else { return vec![channel] };
                let of_object = |&object: &usize| {
                    let mut own = channel.clone();
                    own["target"]["node"] = object.into();
                    own
                };
                objects.iter().map(of_object).collect()
            };
            *channels = std::mem::take(channels).into_iter().flat_map(passed_on).collect();
        }
        // glTF forbids empty lists.
        if let Some(animations) = self.root.get_mut("animations").and_then(Value::as_array_mut) {
            animations.retain(|animation| animation["channels"] != json!([]));
            if animations.is_empty() {
                self.root.as_object_mut().map(|root| root.remove("animations"));
            }
        }
    }

    /// Embeds the pictures beside the model, each once.
    fn pictures(&mut self, pictures: Pictures<'_>) -> Result<(), ImportError> {
        let mut known: HashMap<String, (&str, usize)> = HashMap::new();
        for i in 0..list(&mut self.root, "images").len() {
            let Some(uri) = self.root["images"][i]["uri"].as_str().map(str::to_owned) else { continue };
            if !known.contains_key(&uri) {
                match pictures.read(&uri) {
                    Ok((kind, bytes)) => {
                        // Existing bytes do not count as growth.
                        self.output.most = self.output.most.saturating_add(bytes.len());
                        known.insert(uri.clone(), (kind, self.output.view(&bytes)?));
                    }
                    Err(why) => self.notes.push(format!("picture {i} stays outside: {why}")),
                }
            }
            if let Some(&(kind, view)) = known.get(&uri) {
                let image = &mut self.root["images"][i];
                image["mimeType"] = kind.into();
                image["bufferView"] = view.into();
                image.as_object_mut().map(|image| image.remove("uri"));
            }
        }
        Ok(())
    }

    /// Adds a node for each object, below its original node. Returns the number of their meshes.
    fn objects(&mut self, source: &[Value], extras: &dyn Fn(usize) -> Value) -> Result<usize, ImportError> {
        let Reading { scene, drawn, .. } = self.reading;
        let Some(Trace { meshes: mesh_of, triangles: triangle_of, .. }) = &scene.trace else { return Ok(0) };
        let mut known: HashMap<(usize, usize, &[u32]), usize> = HashMap::new();
        let mut objects_of: BTreeMap<usize, Vec<usize>> = drawn.iter().map(|d| (d.node, Vec::new())).collect();
        let mut opened = None;
        let before = list(&mut self.root, "meshes").len();
        for (id, object) in scene.objects.iter().enumerate() {
            let Drawn { node, mesh, primitive, is_tube, instance } = drawn[mesh_of[id] as usize];
            if is_tube {
                self.tube(id, &source[mesh]["primitives"][primitive], extras(id))?;
                continue;
            }
            let triangles = &triangle_of[object.triangles.start as usize..object.triangles.end as usize];
            let number = match known.get(&(mesh, primitive, triangles)) {
                Some(&number) => number,
                None => {
                    if opened.as_ref().is_none_or(|(key, _)| *key != (mesh, primitive)) {
                        let source = &source[mesh]["primitives"][primitive];
                        opened =
                            Some(((mesh, primitive), self.open(source, &self.document.meshes[mesh].primitives[primitive])?));
                    }
                    let slots = opened.as_ref().map_or(&[][..], |(_, slots)| slots);
                    let mut new = source[mesh].clone();
                    let mut cut = new["primitives"][primitive].take();
                    self.write(&mut cut, slots, &self.corners(mesh, primitive, triangles))?;
                    new["primitives"] = json!([cut]);
                    let number = push(&mut self.root, "meshes", new);
                    known.insert((mesh, primitive, triangles), number);
                    number
                }
            };
            let mut new = json!({
                "name": format!("{} #{id}", object.node), "mesh": number, "extras": { "enfilade": extras(id) },
            });
            for key in ["skin", "weights"] {
                if let Some(value) = self.root["nodes"][node].get(key) {
                    new[key] = value.clone();
                }
            }
            place(&mut new, instance);
            let child = push(&mut self.root, "nodes", new);
            push(&mut self.root["nodes"][node], "children", child.into());
            if !self.document.meshes[mesh].primitives[primitive].targets.is_empty() {
                objects_of.entry(node).or_default().push(child);
            }
        }
        self.morph(&objects_of);
        // Skinned meshes are below it now.
        for node in drawn.iter().map(|d| d.node).collect::<BTreeSet<_>>() {
            if let Some(node) = self.root["nodes"][node].as_object_mut().filter(|node| !node.contains_key("mesh")) {
                node.remove("skin");
                node.remove("weights");
            }
        }
        Ok(list(&mut self.root, "meshes").len() - before)
    }

    /// Adds a node for a part of tubes, or of their mesh, at the root without rotation or scale.
    fn tube(&mut self, id: usize, source: &Value, mut extras: Value) -> Result<(), ImportError> {
        let scene = &self.reading.scene;
        let object = &scene.objects[id];
        let middle = object.bounds.centre();
        let (mut corners, mut indices): (Vec<[f32; 3]>, Vec<u32>) = (Vec::new(), Vec::new());
        let at = |p: DVec3| (self.options.as_in_source(p - middle) / self.metres_per_unit).as_vec3().to_array();
        for (tube, segments) in scene.tubes.parts(object.segments.clone()) {
            let radius = scene.tubes.sections[segments.start as usize].radius();
            let mesh = part(&scene.tubes, tube, segments, usual_sides(f64::from(radius)));
            let base = corners.len() as u32;
            corners.extend(mesh.positions.iter().map(|p| at(p.as_dvec3() + tube.origin)));
            indices.extend(mesh.triangles.as_flattened().iter().map(|i| i + base));
        }
        if !object.is_tube() {
            let mut numbers = HashMap::new();
            for &i in scene.triangles[object.triangles.start as usize..object.triangles.end as usize].as_flattened() {
                indices.push(*numbers.entry(i).or_insert_with(|| {
                    corners.push(at(scene.positions[i as usize]));
                    corners.len() as u32 - 1
                }));
            }
        }
        extras["role"] = json!(object.role);
        let positions = self.output.positions(&corners)?;
        let mut primitive = json!({ "attributes": { "POSITION": positions } });
        primitive["indices"] = self.output.indices(&indices, corners.len())?.into();
        if let Some(material) = source.get("material") {
            primitive["material"] = material.clone();
        }
        let mesh = push(&mut self.root, "meshes", json!({ "primitives": [primitive] }));
        let at = self.options.as_in_source(middle + scene.origin) / self.metres_per_unit;
        let node = json!({
            "name": format!("{} #{id}", object.node), "mesh": mesh, "translation": at.to_array(), "extras": { "enfilade": extras },
        });
        let node = push(&mut self.root, "nodes", node);
        self.tubes.push(node);
        Ok(())
    }

    /// The vertices of triangles, three each, by the numbers of the primitive.
    fn corners(&self, mesh: usize, primitive: usize, triangles: &[u32]) -> Vec<u32> {
        let part = self.reading.parts[mesh].as_ref().and_then(|parts| parts[primitive].as_ref());
        part.map_or_else(Vec::new, |part| {
            triangles.iter().flat_map(|&t| part.triangles[t as usize].map(|v| part.vertices[v as usize])).collect()
        })
    }

    /// The attributes of a primitive and of its morph targets.
    fn open(&self, source: &Value, primitive: &Primitive) -> Result<Vec<Slot<'a>>, ImportError> {
        let attributes = named(source.get("attributes")).into_iter().map(|(name, accessor)| (None, name, accessor));
        let targets = source.get("targets").and_then(Value::as_array).into_iter().flatten().enumerate();
        let targets =
            targets.flat_map(|(t, target)| named(Some(target)).into_iter().map(move |(name, n)| (Some(t), name, n)));
        let slots: Vec<_> = attributes.chain(targets).collect();
        let mut decoded = self.decode(source, primitive)?;
        slots
            .into_iter()
            .map(|(target, name, accessor)| {
                let claimed = self.reading.buffers.claimed(accessor)?;
                let elements = match decoded.remove(name).filter(|_| target.is_none()) {
                    Some((bytes, size)) => Elements::Decoded(bytes, size),
                    None => Elements::Stored(self.reading.buffers.accessor(accessor, &["SCALAR", "VEC2", "VEC3", "VEC4"])?),
                };
                let mut like = json!({ "componentType": claimed.component_type, "type": claimed.kind });
                if claimed.normalized {
                    like["normalized"] = true.into();
                }
                let bounds = (name == "POSITION").then(|| (claimed.component_type, width(&claimed.kind)));
                Ok(Slot { target, name: name.to_owned(), elements, like, bounds })
            })
            .collect()
    }

    /// The attributes of a primitive in Draco compression, by name.
    fn decode(&self, source: &Value, primitive: &Primitive) -> Result<HashMap<String, (Vec<u8>, usize)>, ImportError> {
        let buffers = &self.reading.buffers;
        let position = primitive.attributes.position.map(|accessor| buffers.claimed(accessor)).transpose()?;
        // The same choice as in the import.
        let is_compressed = position.is_none_or(|p| p.buffer_view.is_none());
        let Some(draco) = primitive.extensions.draco.as_ref().filter(|_| is_compressed) else { return Ok(HashMap::new()) };
        let (names, ids): (Vec<&str>, Vec<usize>) = named(source["extensions"][DRACO].get("attributes")).into_iter().unzip();
        let bytes = buffers.view(draco.buffer_view)?;
        let corners = primitive.indices.map_or(Ok(0), |indices| buffers.claimed(indices).map(|a| a.count))?;
        let decoded = draco::attributes(bytes, &ids, corners).map_err(broken)?;
        Ok(names.into_iter().map(str::to_owned).zip(decoded).collect())
    }

    /// Writes the vertices and triangles of an object and sets the accessors of its primitive.
    fn write(&mut self, primitive: &mut Value, slots: &[Slot<'_>], corners: &[u32]) -> Result<(), ImportError> {
        let (mut order, mut places) = (Vec::new(), HashMap::new());
        let indices: Vec<u32> = corners
            .iter()
            .map(|&vertex| {
                *places.entry(vertex).or_insert_with(|| {
                    order.push(vertex);
                    order.len() as u32 - 1
                })
            })
            .collect();
        primitive["indices"] = self.output.indices(&indices, order.len())?.into();
        for slot in slots {
            let accessor = self.output.elements(slot, &order)?;
            match slot.target {
                None => primitive["attributes"][&slot.name] = accessor.into(),
                Some(target) => primitive["targets"][target][&slot.name] = accessor.into(),
            }
        }
        remove_extension(primitive, DRACO);
        primitive.as_object_mut().map(|primitive| primitive.remove("mode"));
        Ok(())
    }

    /// One scene, in metres, +Y up.
    fn scenes(&mut self) -> Result<(), ImportError> {
        let mut nodes = roots(self.document)?;
        nodes.extend(&self.tubes);
        if self.metres_per_unit != 1.0 || self.options.z_up {
            let scale = [self.metres_per_unit; 3];
            let mut metres = json!({ "name": "metres", "scale": scale, "children": nodes });
            if self.options.z_up {
                metres["rotation"] = json!(DQuat::from_rotation_x(-FRAC_PI_2).to_array());
            }
            nodes = vec![push(&mut self.root, "nodes", metres)];
        }
        let shown = self.root["scene"].as_u64().unwrap_or(0) as usize;
        let mut scene = self.root["scenes"].get_mut(shown).map_or_else(|| json!({}), Value::take);
        scene["nodes"] = nodes.into();
        self.root["scenes"] = json!([scene]);
        self.root["scene"] = 0.into();
        Ok(())
    }

    /// The bytes of the file.
    fn finish(&mut self) -> Result<Vec<u8>, ImportError> {
        let Output { accessors, mut views, kept: mut binary, streams, .. } =
            std::mem::replace(&mut self.output, Output::NONE);
        for (stride, stream) in streams {
            let mut view = json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": stream.len() });
            if stride > 0 {
                view["byteStride"] = stride.into();
            }
            view["target"] = if stride > 0 { ARRAY_BUFFER } else { ELEMENT_ARRAY_BUFFER }.into();
            views.push(view);
            binary.extend(stream);
            container::pad(&mut binary, 0);
        }
        let has_draco = self.root["meshes"].to_string().contains(DRACO);
        let has_instances = list(&mut self.root, "nodes").any(|node| node["extensions"].get(INSTANCING).is_some());
        for list in ["extensionsUsed", "extensionsRequired"] {
            let Some(names) = self.root.get_mut(list).and_then(Value::as_array_mut) else { continue };
            names.retain(|name| match name.as_str() {
                Some(DRACO) => has_draco,
                Some(INSTANCING) => has_instances,
                Some(name) => !MESHOPT.contains(&name),
                None => false,
            });
            if names.is_empty() {
                self.root.as_object_mut().map(|root| root.remove(list));
            }
        }
        self.root["asset"]["generator"] = "enfilade export".into();
        self.root["accessors"] = accessors.into();
        self.root["bufferViews"] = views.into();
        self.root["buffers"] = json!([{ "byteLength": binary.len() }]);
        container::glb(&self.root, binary).ok_or_else(too_large)
    }
}

/// Sets the transform of a node to that of an instance.
fn place(node: &mut Value, instance: Option<Placement>) {
    if let Some(Placement { scale, rotation, translation }) = instance {
        node["translation"] = json!(translation.to_array());
        node["rotation"] = json!(rotation.to_array());
        if scale != DVec3::ONE {
            node["scale"] = json!(scale.to_array());
        }
    }
}
