//! Quads, boxes and triangles as meshes, and scenes of them.

use enfilade::math::geom::area;
use enfilade::scene::{ImportOptions, Mesh, Object, Role, Scene, SceneBuilder, Source};
use glam::DVec3;

pub type Triangle = [DVec3; 3];
pub type Quad = [DVec3; 4];

/// The corners of each side of a box, counter-clockwise from outside; of corner `i`, bit `k` says whether it is at the greater end of axis `k`.
const SIDES: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// The same as triangles.
pub const TRIANGLES: [[u32; 3]; 12] = {
    let (mut out, mut i) = ([[0; 3]; 12], 0);
    while i < 12 {
        let [a, b, c, d] = SIDES[i / 2];
        out[i] = if i % 2 == 0 { [a, b, c] } else { [a, c, d] };
        i += 1;
    }
    out
};

fn corner(min: DVec3, max: DVec3, i: u32) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|k| if i >> k & 1 == 0 { min[k] } else { max[k] }))
}

/// The six sides of a box, counter-clockwise from outside.
pub fn sides(min: DVec3, max: DVec3) -> Vec<Quad> {
    SIDES.map(|side| side.map(|i| corner(min, max, i))).to_vec()
}

/// A box that is flat along an axis, counter-clockwise seen from that axis' far end.
pub fn flat(min: DVec3, max: DVec3) -> Quad {
    let axis = (0..3).find(|&k| min[k] == max[k]).expect("flat along an axis");
    flat_along(axis, min, max)
}

pub fn flat_along(axis: usize, min: DVec3, max: DVec3) -> Quad {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    [[min, min], [max, min], [max, max], [min, max]].map(|[of_u, of_v]| {
        let mut corner = min;
        (corner[u], corner[v]) = (of_u[u], of_v[v]);
        corner
    })
}

/// Two triangles for each quad.
pub fn halves(quads: &[Quad]) -> Vec<Triangle> {
    quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

/// A box as triangles.
pub fn cuboid(min: DVec3, max: DVec3) -> Vec<Triangle> {
    halves(&sides(min, max))
}

/// A mesh of triangles that share no corner.
pub fn soup(node: &str, role: Role, opaque: bool, corners: &[Triangle]) -> Mesh {
    let triangles = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { node: node.into(), role, opaque, positions: corners.concat(), triangles }
}

/// A mesh of quads; those of one share its corners.
pub fn quads(node: &str, role: Role, opaque: bool, quads: &[Quad]) -> Mesh {
    let triangles = (0..quads.len() as u32).flat_map(|q| [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| 4 * q + k))).collect();
    Mesh { node: node.into(), role, opaque, positions: quads.concat(), triangles }
}

/// A closed box whose sides share its eight corners.
pub fn solid(node: &str, min: [f64; 3], max: [f64; 3]) -> Mesh {
    let positions = (0..8).map(|i| corner(DVec3::from(min), DVec3::from(max), i)).collect();
    Mesh { node: node.into(), role: Role::Unknown, opaque: true, positions, triangles: TRIANGLES.to_vec() }
}

/// A scene that grows by hand.
pub fn builder() -> SceneBuilder {
    SceneBuilder::new(&ImportOptions::default(), Source::default())
}

/// A scene of meshes.
pub fn scene(meshes: impl IntoIterator<Item = Mesh>) -> Scene {
    let mut builder = builder();
    meshes.into_iter().for_each(|m| builder.add(m).expect("a sound mesh"));
    builder.finish("hand-made").expect("a scene")
}

/// A scene of parts, each an opaque object.
pub fn parts(parts: &[Vec<Triangle>]) -> Scene {
    scene(parts.iter().enumerate().map(|(i, part)| soup(&format!("part {i}"), Role::Structure, true, part)))
}

/// Triangles of an object, in the coordinates of the model.
pub fn corners(scene: &Scene, object: &Object) -> Vec<Triangle> {
    object.triangles.clone().map(|t| scene.corners(t as usize).map(|p| p + scene.origin)).collect()
}

/// Square metres of an object.
pub fn area_of(scene: &Scene, object: &Object) -> f64 {
    object.triangles.clone().map(|t| area(&scene.corners(t as usize))).sum()
}

/// Square metres of all objects.
pub fn area_of_all(scene: &Scene) -> f64 {
    scene.objects.iter().map(|object| area_of(scene, object)).sum()
}

/// The same scene after each triangle has been changed.
pub fn changed(of: &Scene, change: impl Fn(Triangle) -> Triangle) -> Scene {
    let triangles = |object: &Object| corners(of, object).into_iter().map(&change).collect::<Vec<_>>();
    scene(of.objects.iter().map(|object| soup(&object.node, object.role, object.opaque, &triangles(object))))
}

/// Named boxes as the text of an OBJ file.
pub fn obj(boxes: &[(String, [f64; 3], [f64; 3])]) -> String {
    let mut text = String::new();
    for (i, (name, min, max)) in boxes.iter().enumerate() {
        text += &format!("o {name}\n");
        for p in (0..8).map(|i| corner(DVec3::from(*min), DVec3::from(*max), i)) {
            text += &format!("v {} {} {}\n", p.x, p.y, p.z);
        }
        for [a, b, c, d] in SIDES.map(|side| side.map(|k| 8 * i as u32 + k + 1)) {
            text += &format!("f {a} {b} {c} {d}\n");
        }
    }
    text
}
