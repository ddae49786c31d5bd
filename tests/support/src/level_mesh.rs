//! The faces of a level as a plain mesh, without its tree and without portals.
//!
//! Sky stays, as an opaque surface: leaves of sky are closed to the exact rows. Faces of liquids go: leaves of liquids are open
//! to the exact rows, so both sides look through water. What moves (doors, lifts) is in neither.

use crate::world::World;
use enfilade::ObjectId;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::obj;
use glam::DVec3;
use std::collections::HashMap;
use std::fmt::Write;

/// Units of a level in a metre: a door of 64 units is 2 m wide.
pub const UNITS_PER_METRE: f64 = 32.0;

/// A point of a level in metres, +Y up.
pub fn metres(p: DVec3) -> DVec3 {
    DVec3::new(p.x, p.z, -p.y) / UNITS_PER_METRE
}

/// A point in metres in units of a level, +Z up.
pub fn units(p: DVec3) -> DVec3 {
    DVec3::new(p.x, -p.z, p.y) * UNITS_PER_METRE
}

/// Fans of triangles, of the faces that are drawn and opaque.
fn triangles(world: &World) -> impl Iterator<Item = (usize, [usize; 3])> {
    let opaque = world.faces.iter().enumerate().filter(|(_, face)| face.opaque);
    opaque.flat_map(|(f, face)| face.corners[1..].windows(2).map(move |w| (f, [face.corners[0], w[0], w[1]])))
}

/// The mesh as an OBJ file: one object, which the import cuts into clusters.
pub fn obj_text(world: &World) -> String {
    let mut text = String::from("o world\n");
    for p in world.vertices.iter().map(|&p| metres(p)) {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).expect("a string takes all");
    }
    for (_, corners) in triangles(world) {
        let [a, b, c] = corners.map(|c| c + 1);
        writeln!(text, "f {a} {b} {c}").expect("a string takes all");
    }
    text
}

/// A level as a scene, and which object each face belongs to.
pub struct LevelMesh {
    pub scene: Scene,
    /// By face: the objects that its triangles are in; none for faces that are left out.
    pub objects: Vec<Vec<ObjectId>>,
}

impl LevelMesh {
    /// The scene of the OBJ file.
    pub fn new(world: &World, name: &str) -> Self {
        let scene =
            obj::from_slice(obj_text(world).as_bytes(), name, None, &ImportOptions::default()).expect("its own text");
        // The import sorts triangles by cluster; their corners tell which face they are of.
        let mut faces: HashMap<[[u32; 3]; 3], Vec<usize>> = HashMap::new();
        for (face, corners) in triangles(world) {
            faces.entry(key(corners.map(|c| world.vertices[c]))).or_default().push(face);
        }
        let mut objects = vec![Vec::new(); world.faces.len()];
        for triangle in 0..scene.triangles.len() {
            let corners = scene.corners(triangle).map(|p| units(p + scene.origin));
            for &face in &faces[&key(corners)] {
                objects[face].push(scene.object_of(triangle));
            }
        }
        objects.iter_mut().for_each(|of| of.dedup());
        Self { scene, objects }
    }
}

/// Corners in any order, as the file has them: in `f32`.
fn key(corners: [DVec3; 3]) -> [[u32; 3]; 3] {
    // Negative zero is zero.
    let mut key = corners.map(|p| p.to_array().map(|x| (x as f32 + 0.0).to_bits()));
    key.sort_unstable();
    key
}
