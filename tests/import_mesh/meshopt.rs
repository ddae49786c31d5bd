//! Compressed models that gltfpack 1.3 made of 45 boxes around a court; `plain.glb` is the same without compression.

use super::glb::pack;
use super::{assert_sound, read_glb};
use enfilade::scene::{ImportOptions, Scene};
use glam::DVec3;
use serde_json::{Value, json};

const PLAIN: &[u8] = include_bytes!("meshopt/plain.glb");
/// Vertex codec 0, EXT_meshopt_compression.
const EXT: &[u8] = include_bytes!("meshopt/ext.glb");
/// Vertex codec 1, KHR_meshopt_compression.
const KHR: &[u8] = include_bytes!("meshopt/khr.glb");
/// Floats behind the exponential filter, which keeps 15 bits or so of them.
const FLOAT: &[u8] = include_bytes!("meshopt/float.glb");

/// Its triangles in an order of their own, each from its least corner on.
fn triangles(scene: &Scene) -> Vec<[DVec3; 3]> {
    let key = |p: DVec3| p.to_array().map(|x| (x * 1e3).round() as i64);
    let mut all: Vec<[DVec3; 3]> = (0..scene.triangles.len()).map(|t| scene.corners(t).map(|p| p + scene.origin)).collect();
    for t in &mut all {
        let least = (0..3).min_by_key(|&i| key(t[i])).unwrap();
        t.rotate_left(least);
    }
    all.sort_by_key(|t| t.map(key));
    all
}

#[test]
fn compressed_models_are_those_that_were_compressed() {
    let read = |bytes: &[u8]| {
        let scene = read_glb(bytes).unwrap();
        assert_sound(&scene, &ImportOptions::default());
        triangles(&scene)
    };
    let plain = read(PLAIN);
    assert_eq!(plain.len(), 396, "gltfpack's own count");
    assert_eq!(read(EXT), plain);
    assert_eq!(read(KHR), plain);
    // Quantised positions and filtered floats are each within a millimetre of the model, which is 17 m wide.
    let float = read(FLOAT);
    assert_eq!(float.len(), plain.len());
    let farthest = float.iter().flatten().zip(plain.iter().flatten()).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max);
    assert!(farthest < 2e-3, "{farthest}");
}

/// The document and the chunk behind it.
fn parts(glb: &[u8]) -> (Value, Vec<u8>) {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    (serde_json::from_slice(&glb[20..20 + length]).unwrap(), glb[28 + length..].to_vec())
}

/// A file of both.
fn glb(document: &Value, bin: &[u8]) -> Vec<u8> {
    pack(&serde_json::to_vec(document).unwrap(), Some(bin))
}

#[test]
fn lies_about_compressed_bytes_are_refused() {
    let view = "/bufferViews/0/extensions/EXT_meshopt_compression";
    let lies: [(&str, Value, &str); 9] = [
        ("count", json!(u64::MAX), "can't be in 891 compressed bytes"),
        ("count", json!(100_000), "can't be in 891 compressed bytes"),
        ("count", json!(213), "1696 bytes, 1704 when decoded"),
        ("count", json!(600), "meshopt compression"),
        ("byteStride", json!(12), "meshopt compression"),
        ("byteLength", json!(890), "meshopt compression"),
        ("byteLength", json!(1u64 << 40), "in a buffer of"),
        ("filter", json!("OCTAHEDRAL"), "no such meshopt filter"),
        ("mode", json!("SOMEHOW"), "unknown variant `SOMEHOW`"),
    ];
    for (key, lie, expected) in lies {
        let (mut document, bin) = parts(EXT);
        document.pointer_mut(view).unwrap()[key] = lie.clone();
        let told =
            read_glb(&glb(&document, &bin)).map_or_else(|e| e.to_string(), |s| format!("read: {}", s.triangles.len()));
        assert!(told.contains(expected), "{key} {lie}: {told}");
    }
}

/// A small file whose views all name the same compressed bytes would take memory without end.
#[test]
fn views_that_repeat_compressed_bytes_are_refused() {
    let (mut document, bin) = parts(EXT);
    let [views, accessors] = ["bufferViews", "accessors"].map(|table| document[table].as_array().unwrap().clone());
    let copies = 400;
    for i in 0..copies {
        document["bufferViews"].as_array_mut().unwrap().push(views[0].clone());
        let position = accessors.iter().position(|a| a["bufferView"] == 0).unwrap();
        let mut accessor = accessors[position].clone();
        accessor["bufferView"] = json!(views.len() + i);
        document["accessors"].as_array_mut().unwrap().push(accessor);
        let mut mesh = document["meshes"][0].clone();
        mesh["primitives"][0]["attributes"]["POSITION"] = json!(accessors.len() + i);
        document["meshes"].as_array_mut().unwrap().push(mesh);
        let number = document["meshes"].as_array().unwrap().len() - 1;
        document["nodes"].as_array_mut().unwrap().push(json!({ "mesh": number }));
        let node = document["nodes"].as_array().unwrap().len() - 1;
        document["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(node));
    }
    let told = read_glb(&glb(&document, &bin)).map(|s| s.triangles.len()).unwrap_err().to_string();
    assert!(told.contains("repeat its bytes"), "{told}");
}

#[test]
fn damaged_streams_are_errors_or_sound_scenes() {
    for bytes in [EXT, KHR, FLOAT] {
        let (document, bin) = parts(bytes);
        for at in 0..bin.len() {
            for flip in [0x01, 0x10, 0xFF] {
                let mut damaged = bin.clone();
                damaged[at] ^= flip;
                if let Ok(scene) = read_glb(&glb(&document, &damaged)) {
                    assert_sound(&scene, &ImportOptions::default());
                }
            }
        }
    }
}
