//! What the tests of compressed models share: 45 boxes around a court, as gltfpack 1.3 wrote them without compression, and tools.

use super::{assert_sound, read_glb};
use enfilade::scene::{ImportOptions, Scene};
use glam::DVec3;
use serde_json::Value;
use testing::glb::{pack, parts};

pub const PLAIN: &[u8] = include_bytes!("meshopt/plain.glb");

/// Its triangles in an order of their own, each from its least corner on.
pub fn triangles(scene: &Scene) -> Vec<[DVec3; 3]> {
    let key = |p: DVec3| p.to_array().map(|x| (x * 1e3).round() as i64);
    let mut all: Vec<[DVec3; 3]> = (0..scene.triangles.len()).map(|t| scene.corners(t).map(|p| p + scene.origin)).collect();
    for t in &mut all {
        let least = (0..3).min_by_key(|&i| key(t[i])).unwrap();
        t.rotate_left(least);
    }
    all.sort_by_key(|t| t.map(key));
    all
}

/// A file of both.
pub fn glb(document: &Value, bin: &[u8]) -> Vec<u8> {
    pack(&serde_json::to_vec(document).unwrap(), Some(bin))
}

/// The triangles of a sound model.
pub fn read(bytes: &[u8]) -> Vec<[DVec3; 3]> {
    let scene = read_glb(bytes).unwrap();
    assert_sound(&scene, &ImportOptions::default());
    triangles(&scene)
}

/// How far the corners of two models are apart at most.
pub fn farthest(found: &[[DVec3; 3]], plain: &[[DVec3; 3]]) -> f64 {
    assert_eq!(found.len(), plain.len());
    found.iter().flatten().zip(plain.iter().flatten()).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max)
}

/// What is said of a model in whose document something else stands at a place.
pub fn told_of(file: &[u8], place: &str, lie: &Value) -> String {
    let (mut document, bin) = parts(file);
    let (parent, key) = place.rsplit_once('/').unwrap();
    document.pointer_mut(parent).unwrap()[key] = lie.clone();
    read_glb(&glb(&document, &bin)).map_or_else(|e| e.to_string(), |s| format!("read: {}", s.triangles.len()))
}

/// Flips bits of each byte of the chunk in turn.
pub fn assert_survives_flips(file: &[u8]) {
    let (document, bin) = parts(file);
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
