//! Models that others made, against counts that don't come from these importers: the `gltf` crate's reader, and the OBJ files'
//! own face lines.

use super::{assert_sound, data};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use glam::{DVec3, Vec3};
use std::path::Path;
use testing::bakes::on;

fn scene(path: &Path) -> Scene {
    let options = ImportOptions::default();
    let scene = import(path, &options).unwrap();
    assert_sound(&scene, &options);
    // The same again, and whatever the number of threads.
    assert_eq!(on(1, || import(path, &options)).unwrap(), scene);
    scene
}

/// All triangles as sorted corners in sorted order, rounded to a hundredth of a millimetre.
fn sorted(triangles: impl Iterator<Item = [DVec3; 3]>) -> Vec<[[i64; 3]; 3]> {
    let rounded = |p: DVec3| (p * 1e5).round().to_array().map(|x| x as i64);
    let mut all: Vec<_> = triangles.map(|t| t.map(rounded)).collect();
    all.iter_mut().for_each(|t| t.sort_unstable());
    all.sort_unstable();
    all
}

fn triangles(scene: &Scene) -> impl Iterator<Item = [DVec3; 3]> {
    (0..scene.triangles.len()).map(|t| scene.corners(t).map(|p| p + scene.origin))
}

/// Asserts that the file, read with one object a mesh, has these triangles in this order, to the precision of `f32` transforms.
#[track_caller]
fn assert_in_order(path: &Path, expected: &[[DVec3; 3]]) {
    let whole = import(path, &ImportOptions { object_triangles: u32::MAX, ..ImportOptions::default() }).unwrap();
    assert_eq!(whole.triangles.len(), expected.len());
    let near = |(a, b): (&DVec3, &DVec3)| a.distance(*b) < 1e-6 * whole.bounds().diagonal();
    assert!(triangles(&whole).zip(expected).all(|(found, expected)| found.iter().zip(expected).all(near)));
}

/// Without area in exact arithmetic: differences of `f32` numbers of like size, and products of two of them, fit `f64`.
fn is_degenerate(&[a, b, c]: &[DVec3; 3]) -> bool {
    (b - a).cross(c - a) == DVec3::ZERO
}

/// Every triangle of a `.glb` as the `gltf` crate reads it.
fn by_the_gltf_crate(path: &Path) -> Vec<[DVec3; 3]> {
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let blob = blob.unwrap();
    let mut out = Vec::new();
    for node in document.default_scene().unwrap().nodes() {
        assert_eq!(node.children().count(), 0);
        let matrix = glam::Mat4::from_cols_array_2d(&node.transform().matrix()).as_dmat4();
        for primitive in node.mesh().unwrap().primitives() {
            let reader = primitive.reader(|_| Some(&blob));
            let at = |p: [f32; 3]| matrix.transform_point3(Vec3::from(p).as_dvec3());
            let positions: Vec<DVec3> = reader.read_positions().unwrap().map(at).collect();
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            out.extend(indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]].map(|i| positions[i as usize])));
        }
    }
    out
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn zdm2_has_the_triangles_that_the_gltf_crate_finds() {
    let path = data("godot-demos/zdm2.glb");
    let scene = scene(&path);
    let mut others = by_the_gltf_crate(&path);
    assert_eq!(others.len(), 58_772);
    others.retain(|t| !is_degenerate(t));
    assert_eq!(scene.source.notes, [format!("{} triangles without area dropped", 58_772 - others.len())]);
    assert_in_order(&path, &others);
    assert!(scene.objects.iter().all(|o| o.node == "zdm2"));
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn room_has_seventeen_nodes_and_every_triangle() {
    let path = data("godot-demos/room.glb");
    let scene = scene(&path);
    let others = by_the_gltf_crate(&path);
    assert_eq!(others.len(), 63_720);
    assert_in_order(&path, &others);
    assert_eq!(scene.triangles.len(), 63_720);
    let mut nodes: Vec<&str> = scene.objects.iter().map(|o| o.node.as_str()).collect();
    nodes.dedup();
    assert_eq!(nodes.len(), 17);
    assert_eq!(nodes[..2], ["Cube", "Sphere"]);
    assert!(scene.hints.rooms.is_empty() && scene.hints.openings.is_empty());
}

/// Faces of an OBJ file, cut into fans, by nothing but splitting its lines.
fn fans(path: &Path) -> Vec<[DVec3; 3]> {
    let text = std::fs::read_to_string(path).unwrap();
    let words =
        |key: &'static str| text.lines().map(str::split_whitespace).filter_map(move |mut w| (w.next()? == key).then_some(w));
    let points: Vec<DVec3> =
        words("v").map(|w| w.map(|x| x.parse().unwrap()).collect::<Vec<f64>>()).map(|v| DVec3::from_slice(&v)).collect();
    let mut out = Vec::new();
    for face in words("f") {
        let corners: Vec<DVec3> = face.map(|c| points[c.split('/').next().unwrap().parse::<usize>().unwrap() - 1]).collect();
        out.extend((1..corners.len() - 1).map(|i| [corners[0], corners[i], corners[i + 1]]));
    }
    out
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn obj_levels_have_the_triangles_of_their_face_lines() {
    for (file, faces) in [
        ("game-maps-obj/pandora.obj", 60_810),
        ("game-maps-obj/zdm2.obj", 70_754),
        ("godot-demos/level_mesh.obj", 138),
        ("exact/rooms3x3/scene.obj", 540),
    ] {
        let path = data(file);
        let scene = scene(&path);
        let mut others = fans(&path);
        assert_eq!(others.len(), faces);
        others.retain(|t| !is_degenerate(t));
        assert_eq!(scene.triangles.len(), others.len(), "{file}");
        assert!(sorted(triangles(&scene)) == sorted(others.into_iter()), "{file}");
    }
}

/// `exact.json` speaks of `object_<id>`: objects must come out whole and in order.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn the_exact_scenes_keep_their_objects() {
    for (scene_name, objects) in [
        ("two_rooms", 18),
        ("rooms3x3", 27),
        ("keyhole", 27),
        ("random_boxes", 60),
        ("slit_possible", 13),
        ("l_corridors", 23),
    ] {
        let path = data(&format!("exact/{scene_name}/scene.obj"));
        let scene = scene(&path);
        let nodes: Vec<String> = scene.objects.iter().map(|o| o.node.clone()).collect();
        assert_eq!(nodes, (0..objects).map(|i| format!("object_{i}")).collect::<Vec<_>>());
    }
}
