//! Packed folders: what chunks draw is what the model has; which chunk has what; damaged manifests.

mod manifest;

use crate::cli::{building, done, enfilade, folder, run_words, text};
use enfilade::BitMatrix;
use enfilade::file::{FileObject, PvsFile};
use enfilade::math::tolerance::packed_step;
use enfilade::scene::{ImportOptions, Object, Scene};
use enfilade_formats::gltf::container::chunks;
use enfilade_formats::import;
use enfilade_pack::{Building, Needed, pack};
use glam::{DAffine3, DMat4, DQuat, DVec3};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use testing::bakes::on;
use testing::forge::sample;
use testing::glb::Glb;
use testing::meshes::corners;

type Triangle = [DVec3; 3];

/// Side of the squares' grid in [`sheet`].
const SIDE: u16 = 60;

/// A waved sheet with normals, texture coordinates that wrap, and colours; a mesh of 7,200 triangles.
fn sheet(glb: &mut Glb, material: usize) -> usize {
    let all = || (0..=SIDE).flat_map(|i| (0..=SIDE).map(move |j| [f32::from(i), f32::from(j)]));
    let points: Vec<[f32; 3]> = all().map(|[i, j]| [i * 0.05, (i * 0.7).sin() * (j * 1.3).cos() * 0.4, j * 0.05]).collect();
    let normals: Vec<[f32; 3]> = all().map(|[i, _]| [(i * 0.7).sin(), (i * 0.7).cos(), 0.0]).collect();
    let wrapped: Vec<u8> = all().flatten().flat_map(|x| (x * 0.25 - 1.0).to_le_bytes()).collect();
    let square = |i: u16, j: u16| {
        [i * (SIDE + 1) + j, i * (SIDE + 1) + j + 1, (i + 1) * (SIDE + 1) + j, (i + 1) * (SIDE + 1) + j + 1]
    };
    let squares = (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| square(i, j)));
    let triangles: Vec<u16> = squares.flat_map(|[a, b, c, d]| [a, b, c, c, b, d]).collect();
    let wrapped = glb.accessor(&wrapped, None, 5126, "VEC2", points.len());
    let attributes = json!({ "POSITION": glb.positions(&points), "NORMAL": glb.positions(&normals), "TEXCOORD_0": wrapped });
    let indices = glb.indices(&triangles);
    glb.push("meshes", json!({ "primitives": [{ "attributes": attributes, "indices": indices, "material": material }] }))
}

/// Three rooms: two sheets in the first, one in the second, two in the third, of which one is mirrored; a lamp in the first, and stools of one
/// mesh in the first and the third. Far from the model's origin.
fn rooms() -> Glb {
    let mut glb = Glb::new();
    let picture = [b"\x89PNG\r\n\x1a\n".as_slice(), &[7; 100]].concat();
    let view = glb.view(&picture, None);
    glb.json["images"] =
        json!([{ "bufferView": view, "mimeType": "image/png" }, { "bufferView": view, "mimeType": "image/png" }]);
    glb.json["samplers"] = json!([{ "wrapS": 33071 }, { "wrapS": 10497 }]);
    glb.json["textures"] = json!([{ "source": 0 }, { "source": 1, "sampler": 1 }]);
    let texture = json!({ "index": 1, "texCoord": 0 });
    glb.json["materials"] = json!([
        { "name": "plain", "doubleSided": true },
        { "pbrMetallicRoughness": { "baseColorTexture": texture } },
    ]);
    let sheets: Vec<usize> = [0, 0, 1, 0, 0].iter().map(|&material| sheet(&mut glb, material)).collect();
    let lamp = glb.mesh(&[[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]);
    let stool = sheet(&mut glb, 1);
    let at = |x: f64, z: f64| json!([1000.0 + x, 20.0, z - 500.0]);
    glb.json["nodes"] = json!([
        { "name": "a0", "mesh": sheets[0], "translation": at(0.0, 0.0) },
        { "name": "a1", "mesh": sheets[1], "translation": at(0.0, 4.0) },
        { "name": "b", "mesh": sheets[2], "translation": at(10.0, 0.0), "rotation": [0, 0.6, 0, 0.8] },
        { "name": "c0", "mesh": sheets[3], "translation": at(20.0, 0.0), "scale": [-1, 1, 2] },
        { "name": "c1", "mesh": sheets[4], "matrix": [1, 0, 0, 0, 0.3, 1, 0, 0, 0, 0, 1, 0, 1020, 20, -496, 1] },
        { "name": "lamp", "mesh": lamp, "translation": at(1.0, 1.0) },
        { "name": "stool0", "mesh": stool, "translation": at(2.0, 2.0), "rotation": [0.1, 0.2, 0.3, 0.9] },
        { "name": "stool1", "mesh": stool, "translation": at(22.0, 2.0), "scale": [0.5, 0.25, 0.5] },
        { "name": "stool2", "mesh": stool, "matrix": [1, 0, 0, 0, 0.3, 1, 0, 0, 0, 0, 1, 0, 1022, 20, -494, 1] },
    ]);
    glb.json["scenes"] = json!([{ "nodes": (0..9).collect::<Vec<_>>() }]);
    glb
}

/// The cells that see each object of [`rooms`], and those that it is in.
const SEEN: [(&[usize], usize); 9] = [
    (&[0, 1], 0),
    (&[0, 1], 0),
    (&[0, 1, 2], 1),
    (&[1, 2], 2),
    (&[1, 2], 2),
    (&[0], 0),
    (&[0, 1], 0),
    (&[1, 2], 2),
    (&[1, 2], 2),
];

fn options() -> ImportOptions {
    ImportOptions { object_triangles: u32::MAX, ..ImportOptions::default() }
}

/// The model of [`rooms`] and its file.
fn packed_rooms(folder: &Path) -> (PathBuf, Scene, PvsFile) {
    let model = folder.join("rooms.glb");
    std::fs::write(&model, rooms().bytes()).unwrap();
    let scene = import(&model, &options()).unwrap();
    let mut file = sample();
    assert_eq!((scene.objects.len(), file.cells.len()), (SEEN.len(), 3));
    (file.model_hash, file.origin) = (scene.hash(), scene.origin);
    file.portals.clear();
    let object = |o: &Object| FileObject {
        node: o.node.clone(),
        triangles: o.triangles.len() as u32,
        bounds: [o.bounds.min.as_vec3(), o.bounds.max.as_vec3()],
    };
    file.objects = scene.objects.iter().map(object).collect();
    file.placement = BitMatrix::new(3, SEEN.len());
    let mut rows = BitMatrix::new(3, SEEN.len());
    for (object, (cells, home)) in SEEN.iter().enumerate() {
        file.placement.set(*home, object);
        cells.iter().for_each(|&cell| _ = rows.set(cell, object));
    }
    file.object_rows = Some(rows);
    (model, scene, file)
}

/// A file of the folder, decompressed if its name says that it is compressed.
fn bytes_of(building: &Building, name: &str) -> Vec<u8> {
    let mut found = building.files.iter().filter(|file| file.name == name);
    let first = found.next().unwrap_or_else(|| panic!("no {name}"));
    assert!(found.next().is_none(), "{name} twice");
    if !name.ends_with('z') {
        return first.bytes.clone();
    }
    let mut plain = Vec::new();
    flate2::read::GzDecoder::new(&first.bytes[..]).read_to_end(&mut plain).unwrap();
    plain
}

fn document(glb: &[u8]) -> Value {
    serde_json::from_slice(chunks(glb).unwrap().0).unwrap()
}

/// The triangles of each node with a mesh, by the library's reader.
fn drawn(glb: &[u8]) -> BTreeMap<usize, Vec<Triangle>> {
    // Ids are no roles.
    let mut root = document(glb);
    root["nodes"].as_array_mut().unwrap().iter_mut().for_each(|node| _ = node.as_object_mut().unwrap().remove("extras"));
    let bytes = testing::glb::pack(root.to_string().as_bytes(), chunks(glb).unwrap().1);
    let scene = enfilade_formats::gltf::from_slice(&bytes, "chunk", None, &options()).unwrap();
    let number = |object: &Object| object.node.rsplit(' ').next().unwrap().parse().unwrap();
    scene.objects.iter().map(|o| (number(o), corners(&scene, o))).collect()
}

/// A node's transform, as glTF has it.
fn transform(node: &Value) -> DAffine3 {
    let list = |key: &str| node[key].as_array().map(|list| list.iter().map(|x| x.as_f64().unwrap()).collect::<Vec<_>>());
    if let Some(matrix) = list("matrix") {
        return DAffine3::from_mat4(DMat4::from_cols_slice(&matrix));
    }
    let of = |key: &str, default: DVec3| list(key).map_or(default, |v| DVec3::from_slice(&v));
    let rotation = list("rotation").map_or(DQuat::IDENTITY, |r| DQuat::from_slice(&r));
    DAffine3::from_scale_rotation_translation(of("scale", DVec3::ONE), rotation, of("translation", DVec3::ZERO))
}

/// The triangles of all objects of a folder, in the coordinates of the model. Each object is in one chunk: the one that the manifest says.
fn read_again(building: &Building) -> Vec<Vec<Triangle>> {
    let manifest = &building.manifest;
    let mut shared = Vec::new();
    for file in &manifest.meshes {
        let bytes = &bytes_of(building, &file.file.file);
        let nodes = document(bytes)["nodes"].as_array().unwrap().clone();
        let numbers: Vec<u64> = nodes.iter().map(|node| node["extras"]["mesh"].as_u64().unwrap()).collect();
        assert!(numbers.iter().copied().eq(file.meshes.clone().map(u64::from)));
        shared.extend(drawn(bytes).into_values());
    }
    let mut objects = vec![Vec::new(); manifest.objects as usize];
    for chunk in &manifest.chunks {
        let bytes = &bytes_of(building, &chunk.file.file);
        let document = document(bytes);
        gltf::Gltf::from_slice_without_validation(bytes).unwrap();
        let own = if document["meshes"].is_array() { drawn(bytes) } else { BTreeMap::new() };
        let mut ids = Vec::new();
        for (number, node) in document["nodes"].as_array().unwrap().iter().enumerate() {
            let Some(id) = node["extras"]["enfilade"].as_u64() else { continue };
            ids.push(id as u32);
            objects[id as usize] = match node["extras"]["mesh"].as_u64() {
                None => own[&number].clone(),
                Some(mesh) => {
                    let file = manifest.meshes.iter().position(|file| file.meshes.contains(&(mesh as u32))).unwrap();
                    assert!(chunk.meshes.contains(&(file as u32)), "{}: file of meshes {file}", chunk.file.file);
                    let transform = transform(node);
                    let moved = |t: &Triangle| t.map(|p| transform.transform_point3(p));
                    let turned =
                        |[a, b, c]: Triangle| if transform.matrix3.determinant() < 0.0 { [a, c, b] } else { [a, b, c] };
                    shared[mesh as usize].iter().map(moved).map(turned).collect()
                }
            };
        }
        ids.sort_unstable();
        assert_eq!(ids, chunk.objects.iter().cloned().flatten().collect::<Vec<_>>(), "{}", chunk.file.file);
    }
    objects.iter_mut().flatten().flatten().for_each(|p| *p += manifest.origin);
    objects
}

/// Asserts that each object has the triangles of the scene, within a distance.
#[track_caller]
fn assert_same(scene: &Scene, objects: &[Vec<Triangle>], most: f64) {
    assert_eq!(objects.len(), scene.objects.len());
    for (id, (found, object)) in objects.iter().zip(&scene.objects).enumerate() {
        let expected = corners(scene, object);
        assert_eq!(found.len(), expected.len(), "object {id}");
        let mut found: Vec<Triangle> = found.clone();
        for triangle in &expected {
            let is_near =
                |other: &Triangle| (0..3).any(|turn| (0..3).all(|k| other[(k + turn) % 3].distance(triangle[k]) <= most));
            let place = found.iter().position(is_near).unwrap_or_else(|| panic!("object {id} lacks {triangle:?}"));
            found.swap_remove(place);
        }
    }
}

#[test]
fn rooms_are_the_chunks_that_they_are_seen_as() {
    let folder = folder("rooms");
    let (model, scene, file) = packed_rooms(&folder);
    let made = pack(&file, &model, &options()).unwrap();
    let ids = |chunk: &enfilade_pack::Chunk| chunk.objects.iter().cloned().flatten().collect::<Vec<u32>>();
    let manifest = &made.manifest;
    // The lamp and the stools are small: they go with the sheets of their room, although fewer cells see the lamp.
    assert_eq!(manifest.chunks.iter().map(ids).collect::<Vec<_>>(), [vec![0, 1, 5, 6], vec![2], vec![3, 4, 7, 8]]);
    assert_eq!(manifest.meshes.len(), 1, "a mesh of three stools");
    assert_eq!(manifest.chunks.iter().map(|chunk| chunk.meshes.len()).collect::<Vec<_>>(), [1, 0, 1]);
    // The picture of the second room and of the stools.
    assert_eq!(manifest.pictures.len(), 1, "equal pictures are one");
    assert_eq!((&manifest.chunks[1].pictures[..], &manifest.meshes[0].pictures[..]), (&[0][..], &[0][..]));
    assert!(manifest.chunks[0].pictures.is_empty());
    let second = document(&bytes_of(&made, "chunks/1.glbz"));
    assert_eq!(second["images"], json!([{ "uri": "../pictures/0.png" }]));
    assert_eq!(
        (&second["textures"], &second["samplers"]),
        (&json!([{ "source": 0, "sampler": 0 }]), &json!([{ "wrapS": 10497 }]))
    );
    assert_eq!((manifest.model, manifest.origin), (scene.hash(), scene.origin));
    assert_same(&scene, &read_again(&made), file.clearance());
    // What a cell needs, by hand.
    let needed = Needed::of(manifest, [1]);
    assert_eq!((needed.files(), needed.bytes(manifest)), (2, manifest.chunks[1].file.bytes + 108));
    assert_eq!((made.figures.chunks, made.figures.meshes, made.figures.cells.cells), (3, 1, 3));
    // The first cell fetches all but the last chunk, the others all but the first, or all.
    let all: u64 = manifest.files().skip(1).map(|entry| entry.bytes).sum();
    let [first, last] = [0, 2].map(|chunk: usize| manifest.chunks[chunk].file.bytes as f64 / all as f64);
    assert!((made.figures.cells.share_mean - (3.0 - first - last) / 3.0).abs() < 1e-12);
    assert_eq!((made.figures.cells.share_worst, made.figures.cells.requests_worst), (1.0, 5));
    assert!(
        made.figures.cells.extra_mean > 0.0 && made.figures.cells.extra_mean < 0.02,
        "the lamp, which the second doesn't see"
    );
}

/// All that the run time reads is there, and nothing else.
#[test]
fn the_pvs_file_has_what_a_walk_needs() {
    let (model, pvs) = (building("office.glb"), folder("lean").join("office.pvs"));
    let more = ["--rays", "20k", "--rows", "both", "--view-cells", "auto", "--relevance", "2m"];
    done(&run_words(&[&["bake", text(&model), "-o", text(&pvs)], &more[..]].concat()));
    let file = PvsFile::load(&pvs).unwrap();
    assert!(file.bounds.is_some() && file.views.bounds.is_some() && file.relevance.is_some() && file.bake.is_some());
    let made = pack(&file, &model, &file.import.options()).unwrap();
    let packed = PvsFile::read(&bytes_of(&made, "building.pvs")).unwrap();
    assert_eq!((packed.model_hash, packed.origin, packed.guarantee), (file.model_hash, file.origin, file.guarantee));
    assert_eq!((&packed.cells, &packed.portals, &packed.objects), (&file.cells, &file.portals, &file.objects));
    assert_eq!((&packed.placement, &packed.placed), (&file.placement, &file.placed));
    assert_eq!((&packed.cell_rows, &packed.object_rows), (&file.cell_rows, &file.object_rows));
    assert_eq!((&packed.views.cells, &packed.views.rows), (&file.views.cells, &file.views.rows));
    assert_eq!((&packed.relevance, &packed.ways_in, packed.pairs), (&file.relevance, &file.ways_in, file.pairs));
    assert_eq!((packed.bounds, packed.views.bounds, packed.unseen, packed.gap), (None, None, None, None));
    assert!(packed.notes.is_empty() && packed.repairs.is_empty() && packed.bake.is_none());
}

/// Without the quantisation of positions, in the bits of the accessors.
#[test]
fn attributes_are_those_of_the_model_within_their_bits() {
    let folder = folder("attributes");
    let (model, _, file) = packed_rooms(&folder);
    let made = pack(&file, &model, &options()).unwrap();
    let bytes = &bytes_of(&made, "chunks/1.glbz");
    let root = document(bytes);
    let view = &root["bufferViews"][0];
    let source = &view["extensions"]["EXT_meshopt_compression"];
    let [count, stride, length] = ["count", "byteStride", "byteLength"].map(|key| source[key].as_u64().unwrap() as usize);
    let decoded = meshoptimizer_rs::codec::decode_vertex_buffer(
        count,
        stride,
        &chunks(bytes).unwrap().1.unwrap()[..length],
        &mut meshoptimizer_rs::Workspace::default(),
    );
    let decoded = decoded.unwrap();
    // 8 bytes of positions, 4 of normals, 8 of texture coordinates.
    assert_eq!((count, stride), (usize::from(SIDE + 1).pow(2), 20));
    let attributes = &root["meshes"][0]["primitives"][0]["attributes"];
    let offset =
        |name: &str| root["accessors"][attributes[name].as_u64().unwrap() as usize]["byteOffset"].as_u64().unwrap() as usize;
    let (normals, coordinates) = (offset("NORMAL"), offset("TEXCOORD_0"));
    let turn = DQuat::from_xyzw(0.0, 0.6, 0.0, 0.8);
    for vertex in decoded.chunks_exact(stride) {
        let [u, v] = [0, 4].map(|k| f32::from_le_bytes(vertex[coordinates + k..][..4].try_into().unwrap()));
        let [i, j] = [u, v].map(|x| (x + 1.0) * 4.0);
        assert!((i - i.round()).abs() < 1e-3 && (j - j.round()).abs() < 1e-3, "{u} {v}");
        let expected = turn * DVec3::new(f64::from(i * 0.7).sin(), f64::from(i * 0.7).cos(), 0.0);
        let found = DVec3::from_array(std::array::from_fn(|k| f64::from(vertex[normals + k] as i8) / 127.0));
        assert!(found.distance(expected) < 0.01, "{found} {expected}");
    }
}

#[test]
fn an_office_is_read_again_and_the_same_on_any_number_of_threads() {
    let folder = folder("office");
    let (model, pvs) = (building("office.glb"), folder.join("office.pvs"));
    done(&enfilade!("bake", &model, "-o", &pvs, "--rays", "100k"));
    let file = PvsFile::load(&pvs).unwrap();
    let options = file.import.options();
    let scene = import(&model, &options).unwrap();
    let made = [1, 3].map(|threads| on(threads, || pack(&file, &model, &options).unwrap()));
    let contents =
        |made: &Building| made.files.iter().map(|file| (file.name.clone(), file.bytes.clone())).collect::<Vec<_>>();
    assert!(contents(&made[0]) == contents(&made[1]));
    assert_same(&scene, &read_again(&made[0]), file.clearance());
    let cells = &made[0].figures.cells;
    assert!(cells.extra_mean <= 0.15, "{cells:?}");
    // By brute force: what the rows ask for is in the files that cells fetch, and nobody fetches a chunk of which it sees nothing.
    let chunk_of = made[0].manifest.chunk_of_object();
    let mut requests = 0;
    for cell in 0..file.cells.len() {
        let seen: Vec<bool> =
            (0..scene.objects.len()).map(|object| file.object_rows.as_ref().is_none_or(|r| r.get(cell, object))).collect();
        let asked = (0..scene.objects.len()).filter(|&object| seen[object]).map(|object| chunk_of[object]);
        let needed = Needed::of(&made[0].manifest, asked);
        for chunk in &needed.chunks {
            assert!(made[0].manifest.chunks[*chunk as usize].objects.iter().cloned().flatten().any(|o| seen[o as usize]));
        }
        requests += needed.files();
    }
    assert!((requests as f64 / cells.cells as f64 - cells.requests_mean).abs() < 1e-9);
}

#[test]
fn the_grid_is_within_the_clearance() {
    for clearance in [1e-6, 1.2e-5, 3.3e-4, 1.0, 77.0] {
        let step = packed_step(clearance);
        assert!(step * 3f64.sqrt() / 2.0 <= clearance && step * 3f64.sqrt() > clearance, "{step}");
    }
}
