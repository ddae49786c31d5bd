//! Compressed models that gltfpack 1.3 made of 45 boxes around a court; `plain.glb` is the same without compression.

use super::compressed::{PLAIN, assert_survives_flips, farthest, glb, read, told_of};
use super::read_glb;
use serde_json::{Value, json};
use testing::glb::parts;

/// Vertex codec 0, EXT_meshopt_compression.
pub const EXT: &[u8] = include_bytes!("meshopt/ext.glb");
/// Vertex codec 1, KHR_meshopt_compression.
pub const KHR: &[u8] = include_bytes!("meshopt/khr.glb");
/// Floats behind the exponential filter, which keeps 15 bits or so of them.
pub const FLOAT: &[u8] = include_bytes!("meshopt/float.glb");

#[test]
fn compressed_models_are_those_that_were_compressed() {
    let plain = read(PLAIN);
    assert_eq!(plain.len(), 396, "gltfpack's own count");
    assert_eq!(read(EXT), plain);
    assert_eq!(read(KHR), plain);
    // Quantised positions and filtered floats are each within a millimetre of the model, which is 17 m wide.
    let farthest = farthest(&read(FLOAT), &plain);
    assert!(farthest < 2e-3, "{farthest}");
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
        ("filter", json!("OCTAHEDRAL"), "do not support this meshopt filter"),
        ("mode", json!("SOMEHOW"), "unknown variant `SOMEHOW`"),
    ];
    for (key, lie, expected) in lies {
        let told = told_of(EXT, &format!("{view}/{key}"), &lie);
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
    [EXT, KHR, FLOAT].into_iter().for_each(assert_survives_flips);
}
