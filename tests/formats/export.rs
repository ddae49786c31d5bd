//! `export`: what is read again is what was cut, object by object; attributes stay with their vertices; others' readers agree.

use crate::cli::{done, enfilade, folder, json as printed, refused, text};
use enfilade::BitMatrix;
use enfilade::file::{FileObject, Import, PvsFile};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::export::{ExportError, export};
use enfilade_formats::import;
use glam::DVec3;
use proptest::prelude::*;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use testing::data::data;
use testing::forge::sample;
use testing::glb::{Glb, pack, parts};
use testing::meshes::corners;

/// Options with so many triangles an object.
fn options(object_triangles: u32) -> ImportOptions {
    ImportOptions { object_triangles, ..ImportOptions::default() }
}

/// A file of two cells for a scene: every object is in the first, every third in the second, too.
fn file_of(scene: &Scene, options: &ImportOptions) -> PvsFile {
    let count = scene.objects.len();
    let mut placement = BitMatrix::new(2, count);
    (0..count).for_each(|object| _ = placement.set(0, object));
    (0..count).step_by(3).for_each(|object| _ = placement.set(1, object));
    let object = |o: &enfilade::scene::Object| FileObject {
        node: o.node.clone(),
        triangles: o.triangles.len() as u32,
        bounds: [o.bounds.min.as_vec3(), o.bounds.max.as_vec3()],
    };
    let mut file = sample();
    file.cells.truncate(2);
    file.model_hash = scene.hash();
    file.import = Import {
        object_triangles: options.object_triangles,
        metres_per_unit: options.metres_per_unit,
        z_up: options.z_up,
        tube_radius: None,
        tubes: true,
        smallest_hole: None,
    };
    file.objects = scene.objects.iter().map(object).collect();
    file.placement = placement;
    file
}

/// Exports a model. Returns the scene that it was cut into and the bytes.
fn exported(model: &Path, options: &ImportOptions) -> (Scene, Vec<u8>) {
    let scene = import(model, options).unwrap();
    let made = export(model, options, &file_of(&scene, options)).unwrap();
    (scene, made.glb)
}

/// Asserts that the exported bytes, read again, have each object of the scene as one of their own, with the same triangles in the same
/// order and the same properties, and that the extras say which it is and where.
#[track_caller]
fn assert_same(scene: &Scene, glb: &[u8]) {
    let again = enfilade_formats::gltf::from_slice(glb, "again", None, &options(u32::MAX)).unwrap();
    assert_eq!(again.objects.len(), scene.objects.len());
    let near = 1e-6 * scene.bounds().diagonal();
    let mut found = vec![false; scene.objects.len()];
    for object in &again.objects {
        let (name, id) = object.node.rsplit_once(" #").unwrap();
        let id: usize = id.parse().unwrap();
        let was = &scene.objects[id];
        assert!(!std::mem::replace(&mut found[id], true), "object {id} twice");
        assert_eq!((name, object.role, object.opaque), (was.node.as_str(), was.role, was.opaque), "object {id}");
        let (now, before) = (corners(&again, object), corners(scene, was));
        assert_eq!(now.len(), before.len(), "object {id}");
        for (a, b) in now.iter().flatten().zip(before.iter().flatten()) {
            assert!(a.distance(*b) <= near, "object {id}: {a} and {b}");
        }
    }
    let nodes = parts(glb).0["nodes"].as_array().unwrap().clone();
    let ours: Vec<&Value> = nodes.iter().map(|n| &n["extras"]["enfilade"]).filter(|e| e["object"].is_u64()).collect();
    assert_eq!(ours.len(), scene.objects.len());
    for (id, extras) in ours.into_iter().enumerate() {
        let cells = if id % 3 == 0 { json!([0, 1]) } else { json!([0]) };
        assert_eq!((&extras["object"], &extras["cells"]), (&json!(id), &cells));
    }
}

/// Columns of vertices of [`strip`].
const COLUMNS: u16 = 40;

/// A strip of squares along x. A vertex has twice its number as its first texture coordinate, of `u16` that stand for 0 to 1, and its
/// number as its red and as the height that a morph target gives it.
fn strip(glb: &mut Glb) -> Value {
    let points: Vec<[f32; 3]> = (0..2 * COLUMNS).map(|v| [f32::from(v / 2), f32::from(v % 2), 0.0]).collect();
    let squares = (0..COLUMNS - 1).flat_map(|c| [2 * c, 2 * c + 2, 2 * c + 1, 2 * c + 1, 2 * c + 2, 2 * c + 3]);
    let squares: Vec<u16> = squares.collect();
    let coded: Vec<u8> = (0..2 * COLUMNS).flat_map(|v| [2 * v, 0].map(u16::to_le_bytes).concat()).collect();
    let coded = glb.accessor(&coded, None, 5123, "VEC2", points.len());
    glb.json["accessors"][coded]["normalized"] = true.into();
    let colours: Vec<u8> = (0..2 * COLUMNS).flat_map(|v| [v as u8, 7, 8, 255, 9, 9, 9, 9]).collect();
    let colours = glb.accessor(&colours, Some(8), 5121, "VEC4", points.len());
    glb.json["accessors"][colours]["normalized"] = true.into();
    let moved: Vec<[f32; 3]> = (0..2 * COLUMNS).map(|v| [0.0, 0.0, f32::from(v)]).collect();
    json!({
        "attributes": { "POSITION": glb.positions(&points), "TEXCOORD_0": coded, "COLOR_0": colours },
        "targets": [{ "POSITION": glb.positions(&moved) }], "indices": glb.indices(&squares), "material": 1,
    })
}

/// Nodes below nodes, mirrored, turned and in instances; a mesh with lines; a room's surface; a hidden node; two scenes; an animation.
fn rich() -> Glb {
    let mut glb = Glb::new();
    glb.json["materials"] = json!([{ "name": "wall" }, { "name": "glass", "alphaMode": "BLEND" }]);
    let strip = strip(&mut glb);
    let line = json!({ "attributes": { "POSITION": glb.positions(&[[0.0; 3], [1.0; 3]]) }, "mode": 1 });
    let fan: Vec<[f32; 3]> = vec![[0.0; 3], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [-1.0, 1.0, 0.0]];
    let fan = json!({ "attributes": { "POSITION": glb.positions(&fan) }, "mode": 6, "material": 0 });
    let mixed = glb.push("meshes", json!({ "primitives": [strip, line, fan], "weights": [0.0], "name": "mixed" }));
    let plain = glb.mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    for accessor in glb.json["accessors"].as_array_mut().unwrap().iter_mut().filter(|a| a["type"] == "VEC3") {
        // Wide enough for all of them.
        (accessor["min"], accessor["max"]) =
            (json!([-1.0, 0.0, 0.0]), json!([f32::from(COLUMNS), 2.0, f32::from(2 * COLUMNS)]));
    }
    let places = glb.positions(&[[0.0, 0.0, 5.0], [0.0, 0.0, 7.0], [1.0, 2.0, 3.0]]);
    let sizes = glb.positions(&[[1.0; 3], [2.0; 3], [1.0, 1.0, 3.0]]);
    let instances = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": places, "SCALE": sizes } } });
    glb.json["nodes"] = json!([
        { "name": "building", "children": [1, 2, 5], "translation": [100.5, 0, -3], "rotation": [0, 0.6, 0, 0.8] },
        { "name": "hall", "mesh": mixed, "scale": [-1, 1, 1], "children": [3], "weights": [0.5],
          "extras": { "enfilade": { "role": "structure" }, "artist": "A" } },
        { "name": "trees", "mesh": mixed, "extensions": instances },
        { "name": "lamp", "mesh": plain, "matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 4, 5, 6, 1] },
        { "mesh": plain, "extensions": { "KHR_node_visibility": { "visible": false } } },
        { "name": "hall-room", "children": [6, 4] },
        { "name": "x-bound", "mesh": plain },
    ]);
    let times = glb.accessor(&[0, 0, 0, 0, 0, 0, 128, 63], None, 5126, "SCALAR", 2);
    let path = glb.positions(&[[0.0; 3], [1.0; 3]]);
    let channel = |node, path, sampler| json!({ "sampler": sampler, "target": { "node": node, "path": path } });
    glb.json["animations"] = json!([{
        "channels": [channel(3, "translation", 0), channel(1, "weights", 1)],
        "samplers": [{ "input": times, "output": path }, { "input": times, "output": times }],
    }]);
    glb.json["scenes"] = json!([{ "nodes": [3] }, { "nodes": [0], "name": "shown" }]);
    glb.json["scene"] = 1.into();
    glb.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing", "KHR_node_visibility"]);
    glb.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    glb
}

fn written(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn what_is_read_again_is_what_was_cut() {
    let folder = folder("again");
    let model = written(&folder, "rich.glb", &rich().bytes());
    for (triangles, unit, z_up) in
        [(256, None, false), (16, None, false), (1, None, true), (16, Some(0.0254), false), (16, Some(0.0254), true)]
    {
        let options = ImportOptions { metres_per_unit: unit, z_up, ..options(triangles) };
        let (scene, glb) = exported(&model, &options);
        assert!(triangles == 256 || scene.objects.len() > 20);
        assert_same(&scene, &glb);
        // The same again.
        assert_eq!(exported(&model, &options).1, glb);
    }
}

#[test]
fn what_is_no_object_stays() {
    let folder = folder("stays");
    let model = written(&folder, "rich.glb", &rich().bytes());
    let scene = import(&model, &options(16)).unwrap();
    let made = export(&model, &options(16), &file_of(&scene, &options(16))).unwrap();
    assert_eq!(made.notes, ["1 surfaces of rooms and portals are not drawn"]);
    let root = parts(&made.glb).0;
    let mesh = |node: usize| &root["meshes"][root["nodes"][node]["mesh"].as_u64().unwrap() as usize];
    // The lines of the mesh, once; no bound. The hidden node's mesh is an object, as any.
    assert_eq!(root["nodes"][1]["mesh"], root["nodes"][2]["mesh"]);
    assert_eq!(mesh(1)["primitives"].as_array().unwrap().len(), 1);
    assert_eq!(mesh(1)["primitives"][0]["mode"], 1);
    assert!([3, 4, 6].iter().all(|&node: &usize| root["nodes"][node].get("mesh").is_none()));
    assert_eq!(root["nodes"][1]["extras"]["artist"], "A");
    assert_eq!((&root["scenes"], &root["scene"]), (&json!([{ "nodes": [0], "name": "shown" }]), &json!(0)));
    // The lamp is moved as before; the morph targets of the hall are those of its parts.
    let channels = root["animations"][0]["channels"].as_array().unwrap();
    assert_eq!((&channels[0]["target"]["node"], &channels[0]["target"]["path"]), (&json!(3), &json!("translation")));
    let weights: Vec<&Value> = channels[1..].iter().map(|channel| &channel["target"]["node"]).collect();
    let parts = root["nodes"][1]["children"].as_array().unwrap().iter().filter(|&child| {
        let mesh = &root["nodes"][child.as_u64().unwrap() as usize]["mesh"];
        mesh.as_u64().is_some_and(|mesh| root["meshes"][mesh as usize]["primitives"][0].get("targets").is_some())
    });
    assert_eq!(weights, parts.collect::<Vec<_>>());
    assert!(weights.len() > 1);
    // Instances are nodes now; nobody needs their extension.
    assert_eq!(root["extensionsUsed"], json!(["KHR_node_visibility"]));
    assert!(root.get("extensionsRequired").is_none() && root["nodes"][2].get("extensions").is_none());
    // Whole strips and fans, of four nodes and instances, the lamp and what is hidden: three meshes.
    let scene = import(&model, &options(256)).unwrap();
    let made = export(&model, &options(256), &file_of(&scene, &options(256))).unwrap();
    assert_eq!((scene.objects.len(), made.meshes), (10, 3));
}

/// By the `gltf` crate.
#[test]
fn attributes_stay_with_their_vertices() {
    let folder = folder("attributes");
    let model = written(&folder, "rich.glb", &rich().bytes());
    let (scene, glb) = exported(&model, &options(16));
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&glb).unwrap();
    let blob = blob.unwrap();
    let (mut strips, mut vertices) = (0, 0);
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
        let reader = primitive.reader(|_| Some(&blob));
        let Some(coded) = reader.read_tex_coords(0) else { continue };
        assert_eq!(primitive.material().name(), Some("glass"));
        let numbers: Vec<u16> = coded.into_u16().map(|[u, _]| u / 2).collect();
        let points: Vec<[f32; 3]> = numbers.iter().map(|v| [f32::from(v / 2), f32::from(v % 2), 0.0]).collect();
        assert_eq!(reader.read_positions().unwrap().collect::<Vec<_>>(), points);
        let colours: Vec<[u8; 4]> = reader.read_colors(0).unwrap().into_rgba_u8().collect();
        assert_eq!(colours, numbers.iter().map(|&v| [v as u8, 7, 8, 255]).collect::<Vec<_>>());
        let moved: Vec<[f32; 3]> = reader.read_morph_targets().next().unwrap().0.unwrap().collect();
        assert_eq!(moved, numbers.iter().map(|&v| [0.0, 0.0, f32::from(v)]).collect::<Vec<_>>());
        let bounds = primitive.bounding_box();
        let reach = |k: usize| points.iter().fold([f32::MAX, f32::MIN], |[a, b], p| [a.min(p[k]), b.max(p[k])]);
        (0..3).for_each(|k| assert_eq!([bounds.min[k], bounds.max[k]], reach(k)));
        // No vertex that isn't used.
        let used: std::collections::BTreeSet<u32> = reader.read_indices().unwrap().into_u32().collect();
        assert!(used.into_iter().eq(0..numbers.len() as u32));
        (strips, vertices) = (strips + 1, vertices + numbers.len());
    }
    assert!(strips >= scene.objects.iter().filter(|o| o.node.starts_with("trees@0/0")).count());
    assert!(vertices < 4 * usize::from(2 * COLUMNS), "{vertices}");
}

#[cfg(all(feature = "draco", feature = "meshopt"))]
#[test]
fn compressed_models_are_written_plainly() {
    use crate::formats::mesh::{draco, meshopt};
    let folder = folder("compressed");
    for (i, bytes) in
        [meshopt::EXT, meshopt::KHR, meshopt::FLOAT, draco::EDGEBREAKER, draco::SEQUENTIAL].into_iter().enumerate()
    {
        let model = written(&folder, "model.glb", bytes);
        let (scene, glb) = exported(&model, &options(20));
        assert!(scene.objects.len() > 10, "{i}");
        assert_same(&scene, &glb);
        let text = parts(&glb).0.to_string();
        assert!(!text.contains("compression"), "{i}: {text}");
        // All attributes of the source are there.
        let names = |bytes: &[u8]| {
            let attributes = parts(bytes).0["meshes"][0]["primitives"][0]["attributes"].clone();
            attributes.as_object().unwrap().keys().cloned().collect::<Vec<_>>()
        };
        assert_eq!(names(&glb), names(bytes));
    }
}

#[test]
fn pictures_come_with_the_model() {
    let folder = folder("pictures");
    let png = b"\x89PNG\r\n\x1a\nnot much of a picture";
    written(&folder, "a.png", png);
    written(&folder, "b.tga", b"something else");
    let mut glb = rich();
    glb.json["images"] = json!([{ "uri": "a.png" }, { "uri": "b.tga" }, { "uri": "gone.jpg" }, { "uri": "data:image/png;base64,iVBORw0K" }, { "uri": "a.png" }]);
    let model = written(&folder, "rich.glb", &glb.bytes());
    let scene = import(&model, &options(16)).unwrap();
    let made = export(&model, &options(16), &file_of(&scene, &options(16))).unwrap();
    let (root, bin) = parts(&made.glb);
    let bytes = |image: usize| {
        let view = &root["bufferViews"][root["images"][image]["bufferView"].as_u64().unwrap() as usize];
        let [at, length] = ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
        &bin[at..at + length]
    };
    assert_eq!((bytes(0), &root["images"][0]["mimeType"]), (&png[..], &json!("image/png")));
    assert_eq!(bytes(3), &png[..6]);
    assert_eq!(root["images"][4]["bufferView"], root["images"][0]["bufferView"], "each file once");
    assert_eq!((&root["images"][1]["uri"], &root["images"][2]["uri"]), (&json!("b.tga"), &json!("gone.jpg")));
    let told = made.notes.join("\n");
    assert!(told.contains("picture 1 stays outside: `b.tga` is not a picture type of glTF"), "{told}");
    assert!(told.contains("picture 2 stays outside: `gone.jpg`"), "{told}");

    let obj = "mtllib a.mtl\nvt 0 0\nvt 1 0\nvt 1 0.25\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nusemtl wall\nf 1/1 2/2 3/3 4/-3\n\
               usemtl air\nf 1 2 3\n";
    let library = "newmtl wall\nKd 0 0 0\nmap_Kd a.png\nnewmtl air\nKd 1 0.5 0\nd 0.25\nmap_Kd b.tga\n";
    written(&folder, "a.mtl", library.as_bytes());
    let model = written(&folder, "a.obj", obj.as_bytes());
    let (scene, glb) = exported(&model, &options(256));
    assert_same(&scene, &glb);
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&glb).unwrap();
    let blob = blob.unwrap();
    let [wall, air] = [0, 1].map(|i| document.meshes().nth(i).unwrap().primitives().next().unwrap());
    let reader = wall.reader(|_| Some(&blob));
    let pairs: Vec<_> = reader.read_positions().unwrap().zip(reader.read_tex_coords(0).unwrap().into_f32()).collect();
    // From the lower left in OBJ, from the upper left in glTF; positions from the scene's origin on.
    let at = |x: f64, z: f64| (DVec3::new(x, 0.0, z) - scene.origin).as_vec3().to_array();
    let expected =
        [(at(0.0, 0.0), [0.0, 1.0]), (at(1.0, 0.0), [1.0, 1.0]), (at(1.0, 1.0), [1.0, 0.75]), (at(0.0, 1.0), [0.0, 1.0])];
    assert_eq!(pairs, expected);
    assert_eq!(wall.material().name(), Some("wall"));
    let look = wall.material().pbr_metallic_roughness();
    assert!(look.base_color_texture().is_some() && look.base_color_factor() == [1.0; 4]);
    let look = air.material().pbr_metallic_roughness();
    let colour = look.base_color_factor();
    assert!(look.base_color_texture().is_none() && colour[0] == 1.0 && colour[2] == 0.0 && colour[3] == 0.25, "{colour:?}");
    assert_eq!(air.material().alpha_mode(), gltf::material::AlphaMode::Blend);
}

#[test]
fn an_office_is_cut_and_keeps_its_materials() {
    let model = crate::cli::building("office.glb");
    let (scene, glb) = exported(&model, &options(64));
    assert_same(&scene, &glb);
    let materials = |bytes: &[u8]| parts(bytes).0["materials"].clone();
    assert_eq!(materials(&glb), materials(&std::fs::read(&model).unwrap()));
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn real_models_are_cut() {
    for file in ["godot-demos/zdm2.glb", "classics/sponza.obj", "quake-id-gpl/dm4.map"] {
        let model = data().join(file);
        let (scene, glb) = exported(&model, &options(256));
        assert_same(&scene, &glb);
        gltf::Gltf::from_slice(&glb).unwrap();
    }
}

/// Where each face of a level has its texture, by the reader of the crate `qbsp`.
#[cfg(feature = "full")]
#[test]
fn faces_of_a_level_have_the_texture_coordinates_of_the_file() {
    use qbsp::prelude::*;
    let data = data();
    let model = data.join("quake-id-gpl/dm4.bsp");
    let (scene, glb) = exported(&model, &options(256));
    assert_same(&scene, &glb);

    let bytes = std::fs::read(&model).unwrap();
    let level = BspData::parse(BspParseInput { bsp: &bytes, lit: None, settings: Default::default() }).unwrap();
    let rounded = |x: f64| (x * 1e3).round() as i64;
    let mut expected: std::collections::BTreeMap<(String, [i64; 3]), Vec<[f64; 2]>> = std::collections::BTreeMap::new();
    for face in &level.faces {
        let info = &level.tex_info[face.texture_info_idx.0 as usize];
        let texture = level.textures[info.texture_idx.0.unwrap() as usize].as_ref().unwrap();
        let name = texture.header.name.to_string().to_lowercase();
        for p in face.vertices(&level) {
            let [u, v] = info.projection.project(p).to_array();
            let uv = [f64::from(u) / f64::from(texture.header.width), f64::from(v) / f64::from(texture.header.height)];
            let p = [f64::from(p.x) / 32.0, f64::from(p.z) / 32.0, -f64::from(p.y) / 32.0];
            expected.entry((name.clone(), p.map(rounded))).or_default().push(uv);
        }
    }
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&glb).unwrap();
    let blob = blob.unwrap();
    let mut compared = 0;
    for primitive in document.meshes().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>()) {
        let reader = primitive.reader(|_| Some(&blob));
        let coordinates: Vec<[f32; 2]> = reader.read_tex_coords(0).unwrap().into_f32().collect();
        for (p, uv) in reader.read_positions().unwrap().zip(coordinates) {
            let p = (glam::Vec3::from(p).as_dvec3() + scene.origin).to_array().map(rounded);
            let name = primitive.material().name().unwrap().to_owned();
            let near = |e: &[f64; 2]| (0..2).all(|k| (e[k] - f64::from(uv[k])).abs() < 1e-3);
            let found = expected.get(&(name.clone(), p)).is_some_and(|all| all.iter().any(near));
            assert!(found, "{name} at {p:?}: {uv:?}");
            compared += 1;
        }
    }
    assert!(compared > 5_000, "{compared}");
}

#[test]
fn the_command_writes_what_was_baked_and_no_other() {
    let folder = folder("command");
    let (model, file) = crate::cli::maze(&folder);
    let out = folder.join("cut.glb");
    let told = printed(&enfilade!("export", &file, "--model", &model, "-o", &out, "--json"));
    let bytes = std::fs::read(&out).unwrap();
    let pvs = PvsFile::load(&file).unwrap();
    assert_eq!(told["bytes"], bytes.len());
    assert_eq!(told["objects"], pvs.objects.len());
    let root = parts(&bytes).0;
    let nodes = root["nodes"].as_array().unwrap();
    let ours: Vec<&Value> = nodes.iter().map(|n| &n["extras"]["enfilade"]).filter(|e| e["object"].is_u64()).collect();
    assert_eq!(ours.len(), pvs.objects.len());
    for (id, extras) in ours.iter().enumerate() {
        let cells: Vec<usize> = (0..pvs.cells.len()).filter(|&cell| pvs.placement.get(cell, id)).collect();
        assert_eq!(extras["cells"], json!(cells));
    }
    done(&enfilade!("bake", &out, "-o", &folder.join("again.pvs"), "--rays", "100k"));

    let other = written(&folder, "other.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let refused_with = |model: &Path, out: &str, parts: &[&str]| {
        refused(&enfilade!("export", &file, "--model", model, "-o", &folder.join(out)), parts);
        assert!(!folder.join(out).exists());
    };
    refused_with(&other, "no.glb", &["not the file's model", text(&file)]);
    refused_with(&model, "no.gltf", &["a name that ends in .glb"]);
    refused_with(&folder.join("gone.obj"), "no.glb", &["gone.obj"]);
    // A file that names the model but has another number of objects.
    let mut lying = pvs.clone();
    lying.placement = BitMatrix::new(pvs.cells.len(), pvs.objects.len() - 1);
    let options = lying.import.options();
    assert!(matches!(export(&model, &options, &lying), Err(ExportError::OtherObjects { .. })));
}

/// Bytes at a place, as the fuzzers of the readers have them.
fn mutate(bytes: &mut [u8], mutations: &[(prop::sample::Index, u8)]) {
    for (at, byte) in mutations {
        *at.get_mut(bytes) = *byte;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    /// What can be read can be cut, or is refused in a line; and then it is the same.
    #[test]
    fn a_mutated_model_is_refused_or_cut_as_it_was_read(
        json in prop::collection::vec((any::<prop::sample::Index>(), b'0'..=b'9'), 0..3),
        bin in prop::collection::vec(any::<(prop::sample::Index, u8)>(), 0..3),
    ) {
        static NUMBER: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);
        let glb = rich();
        let mut text = glb.json.to_string().into_bytes();
        let mut chunk = glb.bin.clone();
        // Only digits become other digits: the document stays one, and lies.
        let mut digits: Vec<usize> = (0..text.len()).filter(|&i| text[i].is_ascii_digit()).collect();
        for (at, digit) in &json {
            text[*at.get_mut(&mut digits)] = *digit;
        }
        mutate(&mut chunk, &bin);
        let number = NUMBER.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("export_mutated_{}.glb", number % 4));
        std::fs::write(&path, pack(&text, Some(&chunk))).unwrap();
        if let Ok(scene) = import(&path, &options(16)) {
            match export(&path, &options(16), &file_of(&scene, &options(16))) {
                Ok(made) => assert_same(&scene, &made.glb),
                Err(error) => prop_assert!(!error.to_string().is_empty()),
            }
        }
    }
}
