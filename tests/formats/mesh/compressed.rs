//! What the tests of compressed models share: 45 boxes around a court, as gltfpack 1.3 wrote them without compression, and tools.

use super::glb::{pack, parts};
use super::{assert_sound, read_glb};
use enfilade::scene::{ImportOptions, Scene};
use glam::DVec3;
use serde_json::Value;

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
