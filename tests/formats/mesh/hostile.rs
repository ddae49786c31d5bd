//! Files that lie: an error or a sound scene, never a panic, never memory on a file's word.

use super::{TRIANGLE, assert_sound, read_glb, read_obj};
use crate::cli::folder;
use enfilade::scene::{ImportError, ImportOptions};
use enfilade_formats::import;
use serde_json::{Value, json};
use testing::glb::{Glb, pack};

/// Two nodes, one below the other, over an indexed mesh with a material; a room and a portal.
fn small() -> Glb {
    let mut glb = Glb::new();
    let position = glb.positions(&[TRIANGLE[0], TRIANGLE[1], TRIANGLE[2], [1.0, 1.0, 0.0]]);
    let indices = glb.indices(&[0, 1, 2, 1, 3, 2]);
    let material = glb.push("materials", json!({"alphaMode": "OPAQUE"}));
    let primitive = json!({"attributes": {"POSITION": position}, "indices": indices, "material": material});
    let mesh = glb.push("meshes", json!({"name": "m", "primitives": [primitive]}));
    glb.node(json!({"name": "a-room", "mesh": mesh, "children": [1], "translation": [1, 2, 3]}));
    glb.node(json!({"name": "b-portal", "mesh": mesh, "extras": {"enfilade": {"role": "door"}}}));
    glb.json["scenes"] = json!([{"nodes": [0]}]);
    glb.json["scene"] = 0.into();
    glb
}

#[test]
fn a_glb_cut_off_anywhere_is_an_error() {
    let bytes = small().bytes();
    assert_eq!(read_glb(&bytes).unwrap().triangles.len(), 2);
    for length in 0..bytes.len() {
        assert!(read_glb(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
        // With a header that owns up to the length.
        let mut honest = bytes[..length].to_vec();
        if length >= 12 {
            honest[8..12].copy_from_slice(&(length as u32).to_le_bytes());
        }
        assert!(read_glb(&honest).is_err(), "{length} of {} bytes", bytes.len());
    }
}

/// A place in [`small`], what is said there, and what is wrong about it.
type Lie = (&'static str, Value, &'static str);

fn lies() -> Vec<Lie> {
    let huge = u64::MAX;
    vec![
        ("/accessors/0/count", json!(5), "5 elements of 12 bytes"),
        ("/accessors/0/count", json!(huge), "elements of 12 bytes"),
        ("/accessors/0/count", json!(huge / 12 + 2), "elements of 12 bytes"),
        ("/accessors/0/count", json!(3), "vertex index 3 of 3 vertices"),
        ("/accessors/0/byteOffset", json!(huge), "4 elements of 12 bytes"),
        ("/accessors/0/byteOffset", json!(1), "4 elements of 12 bytes"),
        ("/accessors/0/bufferView", json!(9), "bufferView 9 is used, there are 2"),
        ("/accessors/0/type", json!("VEC2"), "type VEC2 where VEC3 is expected"),
        ("/accessors/0/type", json!("SCALAR"), "type SCALAR where VEC3 is expected"),
        ("/accessors/0/componentType", json!(5127), "component type 5127"),
        ("/accessors/0/bufferView", json!(null), "no bufferView"),
        ("/accessors/1/count", json!(huge), "elements of 2 bytes"),
        ("/accessors/1/componentType", json!(5126), "elements of 4 bytes"),
        ("/accessors/1/componentType", json!(5122), "not unsigned integers"),
        // Bytes of the indices read as indices: 0 0 1, 0 2 0.
        ("/accessors/1/componentType", json!(5121), "no triangles in it"),
        ("/bufferViews/0/byteStride", json!(4), "byteStride 4 for elements of 12 bytes"),
        ("/bufferViews/0/byteStride", json!(0), "byteStride 0 for elements of 12 bytes"),
        ("/bufferViews/0/byteStride", json!(huge), "4 elements of 12 bytes"),
        ("/bufferViews/0/byteLength", json!(huge), "bufferView 0"),
        ("/bufferViews/0/byteOffset", json!(huge), "bufferView 0"),
        ("/bufferViews/0/byteOffset", json!(16), "48 bytes from 16 on, in a buffer of 60"),
        ("/bufferViews/0/buffer", json!(1), "buffer 1 is used, there are 1"),
        ("/buffers/0/byteLength", json!(61), "buffer 0 has 60 bytes, the document says 61"),
        ("/buffers/0/byteLength", json!(huge), "buffer 0 has 60 bytes"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(2), "accessor 2 is used, there are 2"),
        ("/meshes/0/primitives/0/indices", json!(2), "accessor 2 is used, there are 2"),
        ("/meshes/0/primitives/0/indices", json!(0), "type VEC3 where SCALAR is expected"),
        ("/meshes/0/primitives/0/material", json!(1), "material 1 is used, there are 1"),
        ("/meshes/0/primitives/0/mode", json!(7), "primitive mode 7"),
        ("/nodes/0/mesh", json!(1), "mesh 1 is used, there are 1"),
        ("/nodes/0/children", json!([2]), "node 0 has child 2, there are 2 nodes"),
        ("/nodes/0/children", json!([0]), "node 0 is in a cycle"),
        ("/nodes/0/children", json!([1, 1]), "node 1 has two parents"),
        ("/nodes/1/children", json!([0]), "node 0 is in a cycle"),
        ("/nodes/0/translation", json!([1e300, 0, 0]), "not a finite number"),
        ("/nodes/0/matrix", json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), "last row of its matrix"),
        ("/scene", json!(1), "scene 1 is used, there are 1"),
        ("/scenes/0/nodes", json!([7]), "the scene has node 7"),
        ("/scenes/0/nodes", json!([0, 0]), "node 0 is in the scene twice"),
        ("/scenes/0/nodes", json!([0, 1]), "node 1 is in the scene twice"),
        ("/scenes/0/nodes", json!([]), "no triangles in it"),
        ("/extensionsRequired", json!(["KHR_nothing_known"]), "KHR_nothing_known"),
        ("/extensionsRequired", json!(["KHR_materials_ior", "ACME_x"]), "ACME_x"),
        ("/asset/version", json!("1.0"), "glTF 1.0 is not supported"),
        ("/asset/minVersion", json!("3.0"), "glTF 3.0 is not supported"),
        ("/asset", json!(null), "not a glTF document"),
        ("/nodes", json!([{"mesh": -1}]), "not a glTF document"),
    ]
}

#[test]
fn lies_in_the_document_are_told_from_the_truth() {
    for (path, value, why) in lies() {
        let mut glb = small();
        let (parent, key) = path.rsplit_once('/').unwrap();
        glb.json.pointer_mut(parent).unwrap()[key] = value.clone();
        let error = read_glb(&glb.bytes()).expect_err(path).to_string();
        assert!(error.contains(why), "{path} = {value}: {error}");
    }
}

#[test]
fn lies_in_sparse_accessors_are_told_from_the_truth() {
    for (indices, count, index_type, why) in [
        ([2u8, 1], 3u64, 5121, "out of order or out of range"),
        ([1, 1], 3, 5121, "out of order or out of range"),
        ([1, 3], 3, 5121, "out of order or out of range"),
        ([1, 2], 3, 5126, "not unsigned integers"),
        ([1, 2], u64::MAX, 5121, "elements, but 2 are stored"),
        ([1, 2], 1_000_000, 5121, "elements, but 2 are stored"),
    ] {
        let mut glb = Glb::new();
        let indices = glb.view(&indices, None);
        let values = glb.view(&[0; 24], None);
        let sparse = json!({"count": 2, "values": {"bufferView": values},
            "indices": {"bufferView": indices, "componentType": index_type}});
        let position =
            glb.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": count, "sparse": sparse}));
        let mesh = glb.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}}]}));
        glb.node(json!({"mesh": mesh}));
        let error = read_glb(&glb.bytes()).unwrap_err().to_string();
        assert!(error.contains(why), "{error}");
    }
}

#[test]
fn what_is_no_gltf_is_refused() {
    let word = |at: usize, value: u32| {
        let mut bytes = small().bytes();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    let message = |bytes: &[u8]| read_glb(bytes).unwrap_err().to_string();
    assert!(message(b"").starts_with("not glTF, neither text nor binary"));
    assert!(message(b"solid cube\n").ends_with("it is STL: rename it to .stl"));
    assert!(message(b"{\n\"asset\": 7}").starts_with("line 2: not a glTF document"));
    assert!(message(b"Kaydara FBX Binary").ends_with("it is FBX: export it as glTF"));
    assert!(message(b"The model goes here").ends_with("it begins with the text `The model goes here`"));
    assert!(message(&word(4, 1)).contains("GLB version 1 is not supported"));
    assert!(message(&word(8, u32::MAX)).starts_with("byte 8: the header says 4294967295 bytes"));
    assert!(message(&word(8, 0)).starts_with("byte 8: "));
    assert!(message(&word(12, u32::MAX)).starts_with("byte 12: a chunk ends"));
    assert!(message(&word(16, 7)).starts_with("byte 16: no JSON chunk"));
    assert!(message(&pack(b"{}", None)).starts_with("byte 20: not a glTF document"));
    assert!(message(&pack(br#"{"asset":{"version":"2.0"}}"#, None)).contains("no triangles"));
}

#[test]
fn a_document_without_its_chunk_says_so() {
    let glb = small();
    let error = read_glb(&pack(glb.json.to_string().as_bytes(), None)).unwrap_err().to_string();
    assert_eq!(error, "buffer 0 has neither a uri nor a BIN chunk");
}

#[test]
fn vertices_that_are_not_finite_are_refused_by_name() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e13] {
        let mut glb = Glb::new();
        let mesh = glb.mesh(&[TRIANGLE[0], TRIANGLE[1], [0.0, bad, 0.0]]);
        glb.node(json!({"name": "wall", "mesh": mesh}));
        assert!(matches!(read_glb(&glb.bytes()), Err(ImportError::NotFinite { node }) if node == "wall"));
    }
    let mut glb = small();
    glb.bin[44..48].copy_from_slice(&f32::NAN.to_le_bytes());
    glb.json["nodes"][0]["name"] = "x-bound".into();
    assert!(read_glb(&glb.bytes()).unwrap_err().to_string().contains("that isn't finite"));
}

#[test]
fn triangles_without_area_make_an_empty_scene() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&[[0.1, 0.1, 0.1], [0.2, 0.2, 0.2], [0.3, 0.3, 0.3]]);
    glb.node(json!({"mesh": mesh}));
    assert!(matches!(read_glb(&glb.bytes()), Err(ImportError::Empty)));
}

/// A small file that stands for millions of triangles is refused at the limit, and a chain of a hundred thousand nodes is
/// walked without recursion.
#[test]
fn instances_long_names_and_deep_trees_stay_within_bounds() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&TRIANGLE.repeat(1000));
    let nodes: Vec<Value> = (0..100_000u32).map(|i| json!({"mesh": mesh, "translation": [i, 0, 0]})).collect();
    glb.json["nodes"] = nodes.into();
    let options = ImportOptions { max_triangles: 50_000, ..ImportOptions::default() };
    let read = enfilade_formats::gltf::from_slice(&glb.bytes(), "test", None, &options);
    assert!(matches!(read, Err(ImportError::TooLarge { limit: 50_000 })));

    // Nodes that say nothing.
    let mut empty = small();
    empty.json["nodes"].as_array_mut().unwrap().extend(vec![json!({}); 100_000]);
    assert_eq!(read_glb(&empty.bytes()).unwrap(), read_glb(&small().bytes()).unwrap());

    // A name that every object would repeat.
    let mut named = Glb::new();
    let mesh = named.mesh(&TRIANGLE);
    named.node(json!({"name": "ä".repeat(100_000), "mesh": mesh}));
    assert_eq!(read_glb(&named.bytes()).unwrap().objects[0].node.chars().count(), 203);

    let mut deep = Glb::new();
    let mesh = deep.mesh(&TRIANGLE);
    let mut nodes: Vec<Value> = (1..100_000u32).map(|i| json!({"children": [i], "translation": [0, 0.5, 0]})).collect();
    nodes.push(json!({"mesh": mesh}));
    deep.json["nodes"] = nodes.into();
    let scene = read_glb(&deep.bytes()).unwrap();
    assert_eq!((scene.corners(0)[0] + scene.origin).y, 0.5 * 99_999.0);
}

const OBJ: &str = "mtllib a.mtl\no one\ng left\nusemtl red\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n\
                   f 1/1/1 2/1/1 3/1/1 4/1/1\no two\nv 5 5 5.5e0 1.0\nf -1 -2 \\\n -5 # done\nf 1//1 3//1 5//1\n";

/// A cut-off OBJ may well be a whole one; it must not be anything worse.
#[test]
fn an_obj_cut_off_anywhere_is_an_error_or_a_part_of_it() {
    let whole = read_obj(OBJ).unwrap();
    assert_eq!(whole.triangles.len(), 4);
    for length in 0..OBJ.len() {
        if let Ok(scene) = read_obj(&OBJ[..length]) {
            assert_sound(&scene, &ImportOptions::default());
            assert!(scene.triangles.len() <= 4);
        }
    }
}

/// A checkout has pointers in place of large files until `git lfs pull`; a download from the wrong address is a page; a template has a
/// sentence. Each reader says what it got, in one line.
#[test]
fn what_stands_in_the_place_of_a_file_is_named() {
    let folder = folder("what_stands_in_the_place_of_a_file");
    let told = |name: &str| {
        let told = import(&folder.join(name), &ImportOptions::default()).unwrap_err().to_string();
        assert!(!told.contains('\n'), "{name}: {told}");
        told
    };
    let pointer =
        "version https://git-lfs.github.com/spec/v1\noid sha256:5891b5b522d5df086d0ff0b110fbd9d21bb4fc7163af34d0\nsize 6\n";
    let page = "\u{feff}\n<!DOCTYPE HTML>\n<html><body>Sign in</body></html>\n";
    for (text, what, every) in [
        (pointer, "a Git LFS pointer", true),
        (page, "a web page (HTML), not the file itself", true),
        ("<html lang=\"en\"><head>", "a web page (HTML), not the file itself", true),
        ("", "the file is empty", true),
        ("Put your model here.\n", "it begins with the text `Put your model here.`", false),
        ("PK\x03\x04 and more", "it is a zip archive: unpack it", false),
    ] {
        for kind in ["glb", "gltf", "obj", "ply", "stl", "gml"] {
            let name = format!("test.{kind}");
            std::fs::write(folder.join(&name), text).unwrap();
            assert!(told(&name).contains(what) || (kind == "gml" && !every), "{name}: {}", told(&name));
        }
    }
    #[cfg(feature = "ifc")]
    for (text, what) in [(pointer, "a Git LFS pointer"), (page, "a web page"), ("Put it here.", "the text `Put it here.`")] {
        std::fs::write(folder.join("test.ifc"), text).unwrap();
        assert!(told("test.ifc").contains(what), "{}", told("test.ifc"));
    }
    for (text, what) in
        [(pointer, "buffer 0: `test.bin`: a Git LFS pointer"), (page, "buffer 0: `test.bin`: a web page (HTML)")]
    {
        let mut beside = small();
        beside.json["buffers"][0]["uri"] = "test.bin".into();
        std::fs::write(folder.join("test.bin"), text).unwrap();
        std::fs::write(folder.join("beside.gltf"), beside.json.to_string()).unwrap();
        assert!(told("beside.gltf").contains(what), "{}", told("beside.gltf"));
    }
}

/// The content counts, not the name.
#[test]
fn binary_and_text_gltf_are_read_by_either_name() {
    let folder = folder("binary_and_text_gltf_by_either_name");
    let mut beside = small();
    beside.json["buffers"][0]["uri"] = "test.bin".into();
    std::fs::write(folder.join("test.bin"), &beside.bin).unwrap();
    std::fs::write(folder.join("text.glb"), format!("\u{feff}\n{}", beside.json)).unwrap();
    std::fs::write(folder.join("binary.gltf"), small().bytes()).unwrap();
    for name in ["text.glb", "binary.gltf"] {
        assert_eq!(import(&folder.join(name), &ImportOptions::default()).unwrap().triangles.len(), 2, "{name}");
    }
}

/// The mark of an editor before the first statement is no part of it.
#[test]
fn a_byte_order_mark_costs_no_statement() {
    let folder = folder("a_byte_order_mark");
    std::fs::write(folder.join("a.mtl"), "\u{feff}newmtl pane\nd 0.2\n").unwrap();
    let text = "\u{feff}v 0 0 0\nv 1 0 0\nv 0 1 0\nmtllib a.mtl\nusemtl pane\nf 1 2 3\n";
    std::fs::write(folder.join("a.obj"), text).unwrap();
    let scene = import(&folder.join("a.obj"), &ImportOptions::default()).unwrap();
    assert_eq!((scene.triangles.len(), scene.objects[0].opaque), (1, false));
}
