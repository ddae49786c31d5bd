//! glTF written by hand, with known triangles.

mod rooms;

use super::{TRIANGLE, assert_sound, assert_triangles, read_glb, world};
use crate::cli::folder;
use enfilade::scene::{ImportOptions, Role, Scene};
use enfilade_formats::import;
use glam::DVec3;
use serde_json::{Value, json};
use testing::glb::{Glb, pack};

fn scene(glb: &Glb) -> Scene {
    let scene = read_glb(&glb.bytes()).unwrap();
    assert_sound(&scene, &ImportOptions::default());
    scene
}

fn names(scene: &Scene) -> Vec<&str> {
    scene.objects.iter().map(|o| o.node.as_str()).collect()
}

#[test]
fn nested_transforms_apply_from_the_child_up() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&TRIANGLE);
    let half = 0.5f64.sqrt();
    // +X turns to -Z, +Z to +X.
    glb.node(json!({"children": [1], "translation": [10, 0, 0], "rotation": [0, half, 0, half], "scale": [2, 2, 2]}));
    glb.node(json!({"mesh": mesh, "translation": [1, 2, 3]}));
    // The same as one matrix, column by column.
    glb.node(json!({"mesh": mesh, "matrix": [0, 0, -2, 0, 0, 2, 0, 0, 2, 0, 0, 0, 16, 4, -2, 1]}));
    let scene = scene(&glb);
    let expected = [[[16.0, 4.0, -2.0], [16.0, 4.0, -4.0], [16.0, 6.0, -2.0]]];
    assert_triangles(&world(&scene, 0), &expected);
    assert_triangles(&world(&scene, 1), &expected);
    assert_eq!(names(&scene), ["node 1", "node 2"]);
}

#[test]
fn a_georeferenced_node_keeps_its_millimetres() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&TRIANGLE);
    glb.node(json!({"mesh": mesh, "translation": [4_500_000.123, 0.25, -650_000.456]}));
    let corner = world(&scene(&glb), 0)[0][0];
    assert!(corner.distance(DVec3::new(4_500_000.123, 0.25, -650_000.456)) < 1e-8);
}

#[test]
fn one_mesh_under_many_nodes_is_many_objects() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&TRIANGLE);
    for i in 0..3 {
        glb.node(json!({"name": format!("chair {i}"), "mesh": mesh, "translation": [10 * i, 0, 0]}));
    }
    let scene = scene(&glb);
    assert_eq!(names(&scene), ["chair 0", "chair 1", "chair 2"]);
    for i in 0..3 {
        let x = 10.0 * i as f64;
        assert_triangles(&world(&scene, i), &[[[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]]]);
    }
}

#[test]
fn gpu_instances_are_objects_and_hidden_nodes_hide_nothing() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&TRIANGLE);
    let translations = glb.positions(&[[0.0, 0.0, 5.0], [0.0, 0.0, 7.0]]);
    let scales = glb.positions(&[[1.0, 1.0, 1.0], [3.0, 3.0, 3.0]]);
    // A quarter turn about Z, as normalised i16.
    let turn: Vec<u8> = [[0i16, 0, 0, 32767], [0, 0, 23170, 23170]].iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let rotations = glb.accessor(&turn, None, 5122, "VEC4", 2);
    glb.json["accessors"][rotations]["normalized"] = true.into();
    let attributes = json!({"TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales});
    glb.node(json!({"name": "tree", "mesh": mesh, "translation": [1, 0, 0],
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}}}));
    glb.node(json!({"children": [2], "extensions": {"KHR_node_visibility": {"visible": false}}}));
    glb.node(json!({"mesh": mesh}));
    glb.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing", "KHR_node_visibility"]);
    let scene = scene(&glb);
    assert_eq!(names(&scene), ["tree@0", "tree@1", "node 2"]);
    assert_eq!(scene.objects.iter().map(|o| o.opaque).collect::<Vec<_>>(), [true, true, false]);
    assert_triangles(&world(&scene, 0), &[[[1.0, 0.0, 5.0], [2.0, 0.0, 5.0], [1.0, 1.0, 5.0]]]);
    assert_triangles(&world(&scene, 1), &[[[1.0, 0.0, 7.0], [1.0, 3.0, 7.0], [-2.0, 0.0, 7.0]]]);
}

#[test]
fn mirroring_turns_triangles_round() {
    // A tetrahedron that faces out: its signed volume is positive, and stays so.
    let [o, x, y, z] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let faces = [o, y, x, o, x, z, o, z, y, x, y, z];
    for (scale, volume) in [([1, 1, 1], 1.0), ([-1, 1, 1], 1.0), ([1, -2, 1], 2.0), ([-1, -1, 1], 1.0), ([-1, -1, -3], 3.0)]
    {
        let mut glb = Glb::new();
        let mesh = glb.mesh(&faces);
        glb.node(json!({"mesh": mesh, "scale": scale, "translation": [5, 5, 5]}));
        let triangles = world(&scene(&glb), 0);
        let six: f64 = triangles.iter().map(|[a, b, c]| a.cross(*b).dot(*c)).sum();
        assert!((six - volume).abs() < 1e-9, "{scale:?}: {six}");
    }
}

/// KHR_mesh_quantization: one corner at the type's least, the others told in its units.
#[test]
fn quantised_positions_are_decoded() {
    let i16s = |values: [i16; 12]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let i8s = |values: [i8; 12]| values.map(|x| x as u8).to_vec();
    let u16s = |values: [u16; 12]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    // Three numbers and a filler for each vertex.
    let i16_bytes = i16s([-32768, 0, 0, 9, 32767, 0, 0, 9, 0, 32767, 0, 9]);
    let i8_bytes = i8s([-128, 0, 0, 9, 127, 0, 0, 9, 0, 127, 0, 9]);
    let u16_bytes = u16s([0, 0, 0, 9, 65535, 0, 0, 9, 0, 13107, 0, 9]);
    let u8_bytes = vec![0, 0, 0, 9, 255, 0, 0, 9, 0, 51, 0, 9];
    for (component, bytes, normalized, [a, b, c]) in [
        (5122, &i16_bytes, false, [[-32768.0, 0.0], [32767.0, 0.0], [0.0, 32767.0]]),
        (5122, &i16_bytes, true, [[-1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        (5120, &i8_bytes, false, [[-128.0, 0.0], [127.0, 0.0], [0.0, 127.0]]),
        (5120, &i8_bytes, true, [[-1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        (5123, &u16_bytes, false, [[0.0, 0.0], [65535.0, 0.0], [0.0, 13107.0]]),
        (5123, &u16_bytes, true, [[0.0, 0.0], [1.0, 0.0], [0.0, 0.2]]),
        (5121, &u8_bytes, false, [[0.0, 0.0], [255.0, 0.0], [0.0, 51.0]]),
        (5121, &u8_bytes, true, [[0.0, 0.0], [1.0, 0.0], [0.0, 0.2]]),
    ] {
        let mut glb = Glb::new();
        let position = glb.accessor(bytes, Some(bytes.len() / 3), component, "VEC3", 3);
        glb.json["accessors"][position]["normalized"] = normalized.into();
        glb.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let mesh = glb.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}}]}));
        glb.node(json!({"mesh": mesh}));
        assert_triangles(&world(&scene(&glb), 0), &[[a, b, c].map(|[x, y]| [x, y, 0.0])]);
    }
}

#[test]
fn sparse_accessors_replace_values() {
    let mut glb = Glb::new();
    let indices = glb.view(&[1, 2], None);
    let values = glb.view(&[5f32, 0.0, 0.0, 0.0, 6.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>(), None);
    let sparse =
        json!({"count": 2, "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
    let base = glb.positions(&[[-1.0, 0.0, 0.0], [9.0; 3], [9.0; 3]]);
    glb.json["accessors"][base]["sparse"] = sparse.clone();
    let zeros = glb.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 3, "sparse": sparse}));
    for position in [base, zeros] {
        let mesh = glb.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}}]}));
        glb.node(json!({"mesh": mesh}));
    }
    let scene = scene(&glb);
    assert_triangles(&world(&scene, 0), &[[[-1.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 6.0, 0.0]]]);
    assert_triangles(&world(&scene, 1), &[[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 6.0, 0.0]]]);
}

#[test]
fn lists_strips_and_fans_with_and_without_indices() {
    let strip = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 2.0, 0.0]];
    let fan = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let at = |points: &[[f32; 3]; 5], t: [[usize; 3]; 3]| t.map(|t| t.map(|i| points[i].map(f64::from)));
    let of_strip = at(&strip, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    let of_fan = at(&fan, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    let list: Vec<u16> = vec![0, 1, 2, 1, 3, 2, 2, 3, 4];
    for (mode, points, indices, expected) in [
        (Some(5), strip, None, of_strip),
        (Some(5), strip, Some(vec![0, 1, 2, 3, 4]), of_strip),
        (Some(6), fan, None, of_fan),
        (Some(6), fan, Some(vec![0, 1, 2, 3, 4]), of_fan),
        (Some(4), strip, Some(list.clone()), of_strip),
        (None, strip, Some(list), of_strip),
    ] {
        for component in [5121u32, 5123, 5125] {
            let mut glb = Glb::new();
            let mut primitive = json!({"attributes": {"POSITION": glb.positions(&points)}});
            if let Some(mode) = mode {
                primitive["mode"] = mode.into();
            }
            if let Some(indices) = &indices {
                let bytes: Vec<u8> = match component {
                    5121 => indices.iter().map(|&i| i as u8).collect(),
                    5123 => indices.iter().flat_map(|&i| i.to_le_bytes()).collect(),
                    _ => indices.iter().flat_map(|&i| u32::from(i).to_le_bytes()).collect(),
                };
                primitive["indices"] = glb.accessor(&bytes, None, component, "SCALAR", indices.len()).into();
            }
            let mesh = glb.push("meshes", json!({"primitives": [primitive]}));
            glb.node(json!({"mesh": mesh}));
            assert_triangles(&world(&scene(&glb), 0), &expected);
        }
    }
}

#[test]
fn what_is_no_triangle_is_left_out_with_a_note() {
    let mut glb = Glb::new();
    let position = glb.positions(&[TRIANGLE[0], TRIANGLE[1], TRIANGLE[2], TRIANGLE[0]]);
    let flat = glb.indices(&[0, 1, 1, 0, 1, 2]);
    let primitive = |mode: u32| json!({"attributes": {"POSITION": position}, "mode": mode});
    let mut primitives: Vec<Value> = (0..=4).map(primitive).collect();
    primitives.push(json!({"attributes": {}}));
    primitives.push(json!({"attributes": {"POSITION": position}, "indices": flat}));
    let mesh = glb.push("meshes", json!({"name": "thing", "primitives": primitives}));
    glb.node(json!({"mesh": mesh}));
    let scene = scene(&glb);
    assert_eq!(names(&scene), ["thing/4", "thing/6"]);
    assert_eq!(
        scene.source.notes,
        [
            "4 primitives of points or lines left out",
            "1 primitives without positions left out",
            "1 incomplete triangles at the end of triangle lists left out (corners)",
            "1 triangles without area dropped",
        ]
    );
}

#[test]
fn materials_that_let_light_through_are_not_opaque() {
    let transmission = |factor: f64| json!({"extensions": {"KHR_materials_transmission": {"transmissionFactor": factor}}});
    for (material, opaque) in [
        (json!({}), true),
        (json!({"alphaMode": "OPAQUE"}), true),
        // Alpha is 1 everywhere.
        (json!({"alphaMode": "MASK"}), true),
        (json!({"alphaMode": "BLEND"}), true),
        (json!({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}}), false),
        (transmission(0.0), true),
        (transmission(0.9), false),
    ] {
        let mut glb = Glb::new();
        let position = glb.positions(&TRIANGLE);
        glb.push("materials", json!({"name": "first"}));
        let material = glb.push("materials", material);
        let mesh = glb.push("meshes", json!({"primitives": [{"attributes": {"POSITION": position}, "material": material}]}));
        glb.node(json!({"mesh": mesh}));
        assert_eq!(scene(&glb).objects[0].opaque, opaque, "{}", glb.json["materials"]);
    }
}

/// What blends with a picture that has no alpha hides what is behind it, unless the factor or the corners' colours have one.
#[test]
fn a_picture_without_alpha_lets_nothing_through() {
    let blend = |base: Value| json!({"alphaMode": "BLEND", "pbrMetallicRoughness": base});
    let textured = || json!({"baseColorTexture": {"index": 0}});
    let faded = json!({"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 1, 1, 0.5]});
    let other = json!({"baseColorTexture": {"index": 1}});
    for (material, image, colours, opaque) in [
        (blend(textured()), json!({"uri": "wall.JPG"}), false, true),
        (blend(textured()), json!({"uri": "data:image/jpeg;base64,/9j/"}), false, true),
        (blend(textured()), json!({"uri": "wall.png"}), false, false),
        (blend(textured()), json!({"uri": "wall.jpg"}), true, false),
        (blend(faded), json!({"uri": "wall.jpg"}), false, false),
        (json!({"alphaMode": "MASK", "pbrMetallicRoughness": textured()}), json!({"uri": "wall.jpg"}), false, true),
        (blend(json!({"baseColorTexture": {"index": 7}})), json!({"uri": "wall.jpg"}), false, false),
        (blend(textured()), json!("no image"), false, false),
        (blend(other), json!({"uri": "wall.jpg"}), false, false),
    ] {
        let mut glb = Glb::new();
        let position = glb.positions(&TRIANGLE);
        glb.json["images"] = json!([image]);
        glb.json["textures"] = json!([{"source": 0}, {"source": 0, "extensions": {"EXT_texture_webp": {"source": 0}}}]);
        let material = glb.push("materials", material);
        let mut attributes = json!({"POSITION": position});
        if colours {
            attributes["COLOR_0"] = position.into();
        }
        let mesh = glb.push("meshes", json!({"primitives": [{"attributes": attributes, "material": material}]}));
        glb.node(json!({"mesh": mesh}));
        assert_eq!(scene(&glb).objects[0].opaque, opaque, "{} {}", glb.json["materials"], glb.json["images"]);
    }
}

#[test]
fn roles_come_from_extras_and_are_inherited() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&TRIANGLE);
    let role = |role: &str| json!({"enfilade": {"role": role}, "other tool": 7});
    glb.node(json!({"name": "furniture", "mesh": mesh, "children": [1, 2], "extras": role("furnishing")}));
    glb.node(json!({"name": "table", "mesh": mesh}));
    glb.node(json!({"name": "door", "mesh": mesh, "extras": role("door")}));
    glb.node(json!({"name": "window", "mesh": mesh, "extras": role("window")}));
    glb.node(json!({"name": "wall", "mesh": mesh, "extras": role("structure")}));
    glb.node(json!({"name": "thing", "mesh": mesh, "extras": [1, 2]}));
    let scene = scene(&glb);
    let found: Vec<_> = scene.objects.iter().map(|o| (o.node.as_str(), o.role, o.opaque)).collect();
    assert_eq!(
        found,
        [
            ("furniture", Role::Furnishing, true),
            ("table", Role::Furnishing, true),
            ("door", Role::Door, false),
            ("window", Role::Window, false),
            ("wall", Role::Structure, true),
            ("thing", Role::Unknown, true),
        ]
    );
    for bad in [json!({"role": "dor"}), json!({"rolle": "door"}), json!({"portal": ["a"]}), json!(3)] {
        let mut glb = Glb::new();
        let mesh = glb.mesh(&TRIANGLE);
        glb.node(json!({"name": "leaf", "mesh": mesh, "extras": {"enfilade": bad}}));
        let error = read_glb(&glb.bytes()).unwrap_err().to_string();
        assert!(error.starts_with("node leaf: extras.enfilade: "), "{error}");
    }
}

#[test]
fn the_default_scene_else_the_first_else_all_roots_are_shown() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&TRIANGLE);
    for name in ["a", "b", "c"] {
        glb.node(json!({"name": name, "mesh": mesh}));
    }
    assert_eq!(names(&scene(&glb)), ["a", "b", "c"]);
    glb.json["scenes"] = json!([{"nodes": [1]}, {"nodes": [2, 0]}]);
    assert_eq!(names(&scene(&glb)), ["b"]);
    glb.json["scene"] = 1.into();
    assert_eq!(names(&scene(&glb)), ["c", "a"]);
}

/// The same model as `.glb`, with a `data:` uri, and with a file beside it.
#[test]
fn buffers_come_from_the_chunk_from_the_uri_or_from_a_file_beside_it() {
    let mut glb = Glb::new();
    let mesh = glb.mesh(&TRIANGLE);
    glb.node(json!({"mesh": mesh}));
    let expected = read_glb(&glb.bytes()).unwrap();

    let mut inline = glb.clone();
    // The three corners: 0.0 is four zero bytes, 1.0 is 00 00 80 3F; the ones lie at bytes 12 and 28.
    inline.json["buffers"][0]["uri"] =
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA".into();
    assert_eq!(read_glb(inline.json.to_string().as_bytes()).unwrap(), expected);
    assert_eq!(read_glb(&pack(inline.json.to_string().as_bytes(), None)).unwrap(), expected);

    let folder = folder("buffers_come_from");
    std::fs::create_dir(folder.join("sub")).unwrap();
    std::fs::write(folder.join("sub/my hall.bin"), &glb.bin).unwrap();
    let mut beside = glb.clone();
    let mut read = |uri: &str| {
        beside.json["buffers"][0]["uri"] = uri.into();
        std::fs::write(folder.join("test.gltf"), beside.json.to_string()).unwrap();
        import(&folder.join("test.gltf"), &ImportOptions::default())
    };
    assert_eq!(read("sub/my%20hall.bin").unwrap(), expected);
    for (uri, why) in [
        ("../sub/my hall.bin", "leads out of the model's folder"),
        ("sub/../../x.bin", "leads out of the model's folder"),
        ("%2E%2E/x.bin", "leads out of the model's folder"),
        ("/etc/hostname", "leads out of the model's folder"),
        ("C:\\x.bin", "leads out of the model's folder"),
        ("https://example.org/x.bin", "is a URL"),
        ("file:///etc/hostname", "is a URL"),
        ("none.bin", "`none.bin` is missing"),
        ("sub", "not a regular file"),
        ("data:application/octet-stream;base64,AAA*", "broken base64"),
        ("data:text/plain,AAAA", "not in base64"),
        ("data:;base64,AAAA", "buffer 0 has 3 bytes, the document says 36"),
    ] {
        let error = read(uri).unwrap_err().to_string();
        assert!(error.starts_with("buffer 0") && error.contains(why), "{uri}: {error}");
    }
}
