//! The glTF and OBJ importers against models written by hand, hostile files, and models that others made.

#[cfg(any(feature = "draco", feature = "meshopt"))]
mod compressed;
#[cfg(feature = "draco")]
pub mod draco;
pub mod glb;
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
    let range = scene.objects[object].triangles.clone();
    range.map(|t| scene.corners(t as usize).map(|p| p + scene.origin)).collect()
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
    let mut next = 0;
    for object in &scene.objects {
        assert!(object.triangles.start == next && object.triangles.end > next);
        assert!(object.triangles.len() <= options.object_triangles as usize);
        next = object.triangles.end;
        for corner in object.triangles.clone().flat_map(|t| scene.corners(t as usize)) {
            assert!(corner.is_finite() && object.bounds.contains(corner));
        }
    }
    assert_eq!(next as usize, scene.triangles.len());
    assert!(scene.origin.is_finite() && !scene.triangles.is_empty());
    let mut hints = scene.hints.rooms.iter().flat_map(|r| r.surface.iter().flatten());
    assert!(hints.all(|p| p.is_finite()));
    for opening in &scene.hints.openings {
        assert!(opening.winding.len() >= 3 && opening.winding.iter().all(|p| p.is_finite()));
        assert!(opening.rooms.iter().flatten().all(|&room| room < scene.hints.rooms.len()));
    }
}

/// A file of the data folder.
fn data(file: &str) -> PathBuf {
    testing::data::data().join(file)
}
