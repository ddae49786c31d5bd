//! Materials, pictures and texture coordinates, where somebody asks how a model looks.

use super::TRIANGLE;
use crate::cli::folder;
use enfilade::scene::{ImportOptions, Material, Picture, Scene};
use enfilade_formats::{import, obj, picture};
use serde_json::json;
use testing::glb::Glb;

fn traced() -> ImportOptions {
    ImportOptions { trace: true, ..ImportOptions::default() }
}

/// A red PNG of one texel.
const PNG: &str = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mP8z8BQDwAEhQGAhKmMIQAAAABJRU5ErkJggg==";

/// A triangle of a material, with texture coordinates.
fn textured(material: serde_json::Value) -> Glb {
    let mut glb = Glb::new();
    let position = glb.positions(&TRIANGLE);
    let bytes: Vec<u8> = [[0.25f32, 0.0], [1.0, 0.5], [0.0, 1.0]].iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let coordinates = glb.accessor(&bytes, None, 5126, "VEC2", 3);
    let material = glb.push("materials", material);
    let attributes = json!({"POSITION": position, "TEXCOORD_0": coordinates});
    let mesh = glb.push("meshes", json!({"primitives": [{"attributes": attributes, "material": material}]}));
    glb.node(json!({"mesh": mesh}));
    glb.json["images"] = json!([{"uri": format!("data:image/png;base64,{PNG}")}]);
    glb.json["textures"] = json!([{"source": 0}]);
    glb
}

fn scene(glb: &Glb) -> Scene {
    enfilade_formats::gltf::from_slice(&glb.bytes(), "test", None, &traced()).unwrap()
}

fn material(material: serde_json::Value) -> Material {
    scene(&textured(material)).trace.unwrap().materials.remove(0)
}

/// Texture coordinates of the one triangle.
fn coordinates(scene: Scene) -> [[f32; 2]; 3] {
    let trace = scene.trace.unwrap();
    assert_eq!(trace.looks[0].material, Some(0));
    trace.looks[0].texture_coordinates[0]
}

#[test]
fn materials_are_as_the_specification_has_them() {
    let given = material(json!({
        "name": "oak", "alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [0.5, 0.0, 0.25],
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.75, "roughnessFactor": 0.5},
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4.0}},
    }));
    let expected = Material {
        metallic: 0.75,
        roughness: 0.5,
        emissive: [2.0, 0.0, 1.0],
        cutoff: Some(0.25),
        // Only what blends is see-through by its colour.
        ..Material::matt("oak", [0.1, 0.2, 0.3, 1.0])
    };
    assert_eq!(given, expected);
    // What isn't given: white, a rough metal.
    assert_eq!(material(json!({})), Material { metallic: 1.0, ..Material::matt("material 0", [1.0; 4]) });
    let blends = material(json!({"alphaMode": "BLEND", "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.5]}}));
    assert_eq!(blends.colour[3], 0.5);
    assert!(material(json!({"extensions": {"KHR_materials_unlit": {}}})).unlit);
    let older = json!({"diffuseFactor": [0.5, 0.25, 0.125, 1.0], "glossinessFactor": 0.75});
    let older = material(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": older}}));
    assert_eq!((older.colour, older.metallic, older.roughness), ([0.5, 0.25, 0.125, 1.0], 0.0, 0.25));
    // Numbers that are none are left at what is given for nothing.
    let odd = material(json!({"name": 7, "pbrMetallicRoughness": {"baseColorFactor": "red", "metallicFactor": [1]}}));
    assert_eq!(odd, material(json!({})));
}

/// Nothing of a bake depends on pictures, so that a model comes through without them; but it says so, once.
#[test]
fn textures_that_are_missing_are_told_in_one_note() {
    let folder = folder("textures_that_are_missing");
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 6\n";
    for (name, text) in [("a wall.png", "some"), ("empty.png", ""), ("pointer.png", pointer)] {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let textures = |scene: Scene| -> Vec<String> {
        scene.source.notes.into_iter().map(|note| note.text).filter(|note| note.contains("textures")).collect()
    };
    let notes = |name: &str| textures(import(&folder.join(name), &ImportOptions::default()).unwrap());
    let told = |count: &str, names: &str| {
        vec![format!("{count} textures are missing: {names}; the bake does not need them: materials define transparency")]
    };
    let mut glb = textured(json!({"alphaMode": "MASK"}));
    std::fs::write(folder.join("within.glb"), glb.bytes()).unwrap();
    assert_eq!(notes("within.glb"), [""; 0]);
    let images = ["a%20wall.png", "empty.png", "pointer.png", "leaf.png", "leaf.png", "../out.png"];
    glb.json["images"] = images.map(|uri| json!({"uri": uri})).to_vec().into();
    std::fs::write(folder.join("beside.glb"), glb.bytes()).unwrap();
    assert_eq!(notes("beside.glb"), told("4 of 5", "`empty.png`, `pointer.png`, `leaf.png` and 1 more"));
    // In memory nothing is beside it, and a list that is none is no reason to refuse a model.
    assert_eq!(textures(scene(&glb)), [""; 0]);
    glb.json["images"] = json!("none");
    std::fs::write(folder.join("odd.glb"), glb.bytes()).unwrap();
    assert_eq!(notes("odd.glb"), [""; 0]);
    // Of a library, what the model uses counts.
    let library =
        "newmtl wall\nmap_Kd -s 2 2 1 a.tga\nnewmtl leaf\nmap_d leaf.tga\nmap_Kd a wall.png\nnewmtl unused\nmap_Kd no.png\n";
    std::fs::write(folder.join("a.mtl"), library).unwrap();
    let text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl leaf\nf 1 2 3\nusemtl wall\nf 1 2 4\n";
    std::fs::write(folder.join("a.obj"), text).unwrap();
    assert_eq!(notes("a.obj"), told("2 of 3", "`leaf.tga`, `a.tga`"));
}

#[test]
fn texture_coordinates_follow_their_transform() {
    let with = |extension: serde_json::Value| {
        let texture = json!({"index": 0, "extensions": {"KHR_texture_transform": extension}});
        coordinates(scene(&textured(json!({"pbrMetallicRoughness": {"baseColorTexture": texture}}))))
    };
    assert_eq!(with(json!({})), [[0.25, 0.0], [1.0, 0.5], [0.0, 1.0]]);
    assert_eq!(with(json!({"offset": [1.0, 2.0], "scale": [2.0, 4.0]})), [[1.5, 2.0], [3.0, 4.0], [1.0, 6.0]]);
    // A quarter turn, counter-clockwise on the picture, whose v leads down: right becomes up, down becomes right.
    let turned = with(json!({"rotation": std::f64::consts::FRAC_PI_2}));
    for (found, expected) in turned.iter().flatten().zip([0.0, -0.25, 0.5, -1.0, 1.0, 0.0]) {
        assert!((found - expected).abs() < 1e-6, "{turned:?}");
    }
}

#[test]
fn pictures_of_normals_roughness_and_emission_come_along_where_coordinates_agree() {
    let text = format!("data:image/png;base64,{PNG}");
    let named = Some(Picture::Named(text));
    let turned = json!({"KHR_texture_transform": {"rotation": 1.0}});
    let all = material(json!({
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0},
            "metallicFactor": 0.5, "roughnessFactor": 0.25,
        },
        "normalTexture": {"index": 0, "scale": 2.0}, "emissiveTexture": {"index": 0}, "emissiveFactor": [1, 1, 1],
    }));
    assert_eq!(all.pictures(), [&named, &named, &named, &named].map(Option::as_ref));
    assert_eq!((all.normal_scale, all.metallic, all.roughness, all.emissive), (2.0, 0.5, 0.25, [1.0; 3]));
    // Without a picture of its colour, the first of the others has the say.
    let alone = textured(json!({"normalTexture": {"index": 0, "extensions": turned}}));
    assert!(coordinates(scene(&alone))[0][0] < 0.24);
    // What has other coordinates is left out: what shines where is not known then, so nothing does.
    let apart = material(json!({
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": {"index": 0, "texCoord": 1}},
        "normalTexture": {"index": 0, "extensions": turned}, "emissiveTexture": {"index": 9}, "emissiveFactor": [1, 1, 1],
    }));
    let nowhere = Picture::Within([].into());
    assert_eq!(apart.pictures(), [named.as_ref(), None, None, Some(&nowhere)]);
    assert_eq!((apart.metallic, apart.emissive), (0.0, [0.0; 3]));
}

/// A mirrored node's triangles are turned round, and their texture coordinates with them.
#[test]
fn texture_coordinates_stay_at_their_corners() {
    let mut glb = textured(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    glb.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    let scene = scene(&glb);
    let corners = scene.corners(0).map(|p| p + scene.origin);
    let at = coordinates(scene);
    for (corner, at) in corners.iter().zip(at) {
        let k =
            TRIANGLE.iter().position(|p| (f64::from(-p[0]) - corner.x).abs() + (f64::from(p[1]) - corner.y).abs() < 1e-6);
        assert_eq!(at, [[0.25, 0.0], [1.0, 0.5], [0.0, 1.0]][k.unwrap()]);
    }
}

#[test]
fn pictures_are_beside_the_model_within_it_or_in_its_text() {
    let folder = folder("looks_pictures");
    let mut glb = textured(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}));
    let file = |glb: &Glb, name: &str| {
        let path = folder.join(name);
        std::fs::write(&path, glb.bytes()).unwrap();
        let material = import(&path, &traced()).unwrap().trace.unwrap().materials.remove(0);
        let texture = material.texture.unwrap();
        picture(&texture, &path, &traced()).map(|bytes| bytes.into_owned())
    };
    let text = file(&glb, "text.glb").unwrap();
    assert!(text.starts_with(b"\x89PNG") && text.len() == 70);
    let view = glb.view(&text, None);
    glb.json["images"][0] = json!({"bufferView": view, "mimeType": "image/png"});
    assert_eq!(file(&glb, "within.glb").unwrap(), text);
    glb.json["images"][0] = json!({"uri": "red%20dot.png"});
    assert!(file(&glb, "beside.glb").unwrap_err().contains("red dot.png"));
    std::fs::write(folder.join("red dot.png"), &text).unwrap();
    assert_eq!(file(&glb, "beside.glb").unwrap(), text);
    std::fs::write(folder.join("red dot.png"), "no picture").unwrap();
    assert!(file(&glb, "beside.glb").unwrap_err().contains("is not a picture type"));
    // An image that isn't there can't be read, and that is said.
    glb.json["images"] = json!([]);
    assert!(file(&glb, "gone.glb").unwrap_err().contains("no image"));
}

#[test]
fn materials_of_one_name_stay_apart_and_nobody_pays_who_does_not_ask() {
    let mut glb = textured(json!({"name": "paint", "pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}));
    let blue = glb.push("materials", json!({"name": "paint", "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 1, 1]}}));
    let mesh = glb.mesh(&TRIANGLE);
    glb.json["meshes"][mesh]["primitives"][0]["material"] = blue.into();
    glb.node(json!({"mesh": mesh}));
    let with = scene(&glb);
    let trace = with.trace.clone().unwrap();
    let colours: Vec<[f32; 4]> = trace.materials.iter().map(|m| m.colour).collect();
    assert_eq!(colours, [[1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]]);
    assert_eq!(trace.looks.iter().map(|look| look.material).collect::<Vec<_>>(), [Some(0), Some(1)]);
    let without = super::read_glb(&glb.bytes()).unwrap();
    assert_eq!((without.trace.is_none(), without.hash()), (true, with.hash()));
}

#[test]
fn libraries_of_obj_give_colours_and_pictures() {
    let folder = folder("looks_obj");
    let library = "newmtl red\nKd 1 0 0\nd 0.5\nnewmtl brick\nKd 0 0 0\nmap_Kd -s 2 2 2 brick.png\n";
    std::fs::write(folder.join("m.mtl"), library).unwrap();
    let text = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0.25\nvt 0 1\nusemtl red\nf 1 2 3\nusemtl brick\nf 1/1 2/2 3/3\n";
    let scene = obj::from_slice(text.as_bytes(), "t", Some(&folder), &traced()).unwrap();
    let trace = scene.trace.unwrap();
    // The colour of a material with a picture is often left black: the picture counts.
    let brick = Material { texture: Some(Picture::Named("brick.png".into())), ..Material::matt("brick", [1.0; 4]) };
    assert_eq!(trace.materials, [Material::matt("red", [1.0, 0.0, 0.0, 0.5]), brick]);
    // OBJ's v leads up.
    assert_eq!(trace.looks[1].texture_coordinates, [[[0.0, 1.0], [1.0, 0.75], [0.0, 0.0]]]);
    assert!(trace.looks[0].texture_coordinates.is_empty());
}
