//! The glTF and OBJ importers against models written by hand, hostile files, and models that others made.

#[cfg(any(feature = "draco", feature = "meshopt"))]
mod compressed;
#[cfg(feature = "draco")]
pub mod draco;
mod gltf;
mod hostile;
mod looks;
#[cfg(feature = "meshopt")]
pub mod meshopt;
mod naming;
mod obj;
mod real;
mod scans;

use enfilade::scene::{ImportError, ImportOptions, Scene};
use glam::DVec3;
use std::path::PathBuf;
use testing::meshes::corners;
use testing::sound;

/// One triangle facing +Z.
const TRIANGLE: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

fn read_glb(bytes: &[u8]) -> Result<Scene, ImportError> {
    enfilade_formats::gltf::from_slice(bytes, "test", None, &ImportOptions::default())
}

fn read_obj(text: &str) -> Result<Scene, ImportError> {
    enfilade_formats::obj::from_slice(text.as_bytes(), "test", None, &ImportOptions::default())
}

/// The corners of an object's triangles in the model's own coordinates.
fn world(scene: &Scene, object: usize) -> Vec<[DVec3; 3]> {
    corners(scene, &scene.objects[object])
}

/// Asserts that both have the same triangles in the same order, each starting from any of its corners.
#[track_caller]
fn assert_triangles(found: &[[DVec3; 3]], expected: &[[[f64; 3]; 3]]) {
    let expected: Vec<[DVec3; 3]> = expected.iter().map(|t| t.map(DVec3::from)).collect();
    let same = |&[a, b, c]: &[DVec3; 3], t: &[DVec3; 3]| {
        [[a, b, c], [b, c, a], [c, a, b]].iter().any(|r| r.iter().zip(t).all(|(p, q)| p.distance(*q) < 1e-9))
    };
    let all = found.len() == expected.len() && found.iter().zip(&expected).all(|(f, e)| same(f, e));
    assert!(all, "found {found:?}\nexpected {expected:?}");
}

/// What a scene promises, whatever it was read from.
#[track_caller]
fn assert_sound(scene: &Scene, options: &ImportOptions) {
    sound::assert_sound(scene, options.object_triangles);
}

/// A file of the data folder.
fn data(file: &str) -> PathBuf {
    testing::data::data().join(file)
}
