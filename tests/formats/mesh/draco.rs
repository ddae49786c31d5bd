//! Compressed models that glTF-Transform 4.5 made with Google's encoder of the boxes in `meshopt/plain.glb`.

use super::compressed::{PLAIN, assert_survives_flips, farthest, glb, read, told_of, triangles};
use super::read_glb;
use serde_json::{Value, json};
use testing::glb::parts;

/// EdgeBreaker, 16 bits a coordinate.
pub const EDGEBREAKER: &[u8] = include_bytes!("draco/edgebreaker.glb");
/// Sequential, 16 bits a coordinate.
pub const SEQUENTIAL: &[u8] = include_bytes!("draco/sequential.glb");

#[test]
fn compressed_models_are_those_that_were_compressed() {
    for bytes in [EDGEBREAKER, SEQUENTIAL] {
        let farthest = farthest(&read(bytes), &read(PLAIN));
        assert!(farthest < 1e-3, "{farthest}");
    }
}

/// Readers without the codec find the same in plain accessors; those come first.
#[test]
fn plain_accessors_beside_the_compressed_ones_are_read() {
    let (compressed, mut bin) = parts(EDGEBREAKER);
    let (mut document, plain) = parts(PLAIN);
    let from = plain.len();
    bin.splice(0..0, plain);
    document["buffers"][0]["byteLength"] = json!(bin.len());
    let mut view = compressed["bufferViews"][0].clone();
    view["byteOffset"] = json!(from);
    document["bufferViews"].as_array_mut().unwrap().push(view);
    let draco = json!({ "KHR_draco_mesh_compression": { "bufferView": 2, "attributes": { "POSITION": 77 } } });
    document["meshes"][0]["primitives"][0]["extensions"] = draco;
    let scene = read_glb(&glb(&document, &bin)).unwrap();
    assert_eq!(triangles(&scene), triangles(&read_glb(PLAIN).unwrap()));
}

#[test]
fn lies_about_compressed_bytes_are_refused() {
    let draco = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    let lies: [(&str, Value, &str); 9] = [
        ("/accessors/0/count", json!(u64::MAX), "triangles can't be in 1320 compressed bytes"),
        ("/accessors/0/count", json!(1000), "it holds more than the 333 triangles of its accessor"),
        ("/accessors/0/count", json!(0), "it holds more than the 0 triangles of its accessor"),
        ("/accessors/1/normalized", json!(true), "normalized positions in Draco compression"),
        ("/bufferViews/0/byteLength", json!(1200), "Draco compression"),
        ("/bufferViews/0/byteLength", json!(1u64 << 40), "in a buffer of"),
        ("/bufferViews/0/byteOffset", json!(1), "in a buffer of"),
        (draco, json!({ "bufferView": 0, "attributes": { "POSITION": 3 } }), "attribute 3 is not a position"),
        (draco, json!({ "bufferView": 0, "attributes": {} }), "without positions"),
    ];
    for (path, lie, expected) in lies {
        let told = told_of(EDGEBREAKER, path, &lie);
        assert!(told.contains(expected), "{path} {lie}: {told}");
    }
}

/// A file whose primitives share one compressed view is read; views that name the same bytes would take memory without end.
#[test]
fn views_that_repeat_compressed_bytes_are_refused() {
    let repeated = |view: usize| {
        let (mut document, bin) = parts(EDGEBREAKER);
        let copy = document["bufferViews"][0].clone();
        document["bufferViews"].as_array_mut().unwrap().push(copy);
        let mut primitive = document["meshes"][0]["primitives"][0].clone();
        primitive["extensions"]["KHR_draco_mesh_compression"]["bufferView"] = json!(view);
        document["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
        read_glb(&glb(&document, &bin)).map(|s| s.triangles.len()).map_err(|e| e.to_string())
    };
    assert_eq!(repeated(0), Ok(792));
    let told = repeated(1).unwrap_err();
    assert!(told.contains("repeat its bytes"), "{told}");
}

#[test]
fn damaged_streams_are_errors_or_sound_scenes() {
    [EDGEBREAKER, SEQUENTIAL].into_iter().for_each(assert_survives_flips);
}
