//! A scene as it looks: the same picture in every mode, materials and pictures in their places.

use crate::common::{self, baked, differ, needs_device, path, shipped, villa};
use enfilade::runtime::{Camera, Mode};
use enfilade::scene::ImportOptions;
use enfilade_formats::{extensions, import};
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};
use enfilade_viewer::building::Building;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::frame::FrameRequest;
use enfilade_viewer::draw::mesh::{Mesh, Triangles};
use enfilade_viewer::draw::surfaces::Surfaces;
use enfilade_viewer::headless::Walk;
use enfilade_viewer::looks::{Detail, Looks, NO_PICTURE};
use enfilade_viewer::mode::ViewMode;
use enfilade_viewer::session::Session;
use enfilade_viewer::walker::Walker;
use glam::DVec3;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use testing::data::data;

const SIZE: [u32; 2] = [320, 180];

/// The picture of a frame.
fn drawn(walk: &mut Walk<'_, '_>, camera: Camera, mode: impl Into<ViewMode>) -> Vec<[u8; 3]> {
    walk.draw(FrameRequest::new(camera, mode)).unwrap();
    walk.picture().unwrap().pixels().to_vec()
}

#[test]
fn pictures_are_the_same_in_every_mode() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let ways = ViewMode::ALL.into_iter().map(|mode| (mode, Oracle::Software));
    let of_device = [Mode::Chc, Mode::Auto].map(|mode| (mode.into(), Oracle::Device));
    let ways: Vec<_> = ways.chain(of_device).collect();
    for detail in [Detail::Plain, Detail::Full, Detail::Smooth] {
        let mut whole = Walk::new(villa, &path, None, SIZE).unwrap();
        whole.renderer.set_detail(detail).unwrap();
        for (mode, oracle) in &ways {
            let mut walk = Walk::new(villa, &path, Some(*oracle), SIZE).unwrap();
            walk.renderer.set_detail(detail).unwrap();
            let mut least = u64::MAX;
            for frame in (0..path.frames.len()).step_by(9) {
                let camera = whole.camera(frame);
                let [expected, found] = [drawn(&mut whole, camera, Mode::None), drawn(&mut walk, camera, *mode)];
                assert_eq!(differ(&expected, &found), 0, "{detail:?}, {mode} by {oracle:?}, frame {frame}");
                least = least.min(walk.renderer.triangles());
            }
            // That something was culled at all is what makes it a test.
            let all = villa.scene.triangles.len() as u64;
            assert!(*mode == Mode::None.into() || least < all / 2, "{mode} by {oracle:?} drew {least} of {all} at least");
        }
    }
}

#[test]
fn the_alarm_counts_the_same_in_full() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let frame = path.frames.len() / 2;
    let mut sound = Walk::new(villa, &path, None, SIZE).unwrap();
    let camera = sound.camera(frame);
    let mut broken = villa.clone();
    sound.missed(camera, Mode::Pvs).unwrap();
    let home = sound.renderer.culling.last.as_ref().and_then(|d| d.home).unwrap();
    // Everything but what the eye stands in: walls that are seen across rooms, glass and doors among it.
    let rows = broken.file.object_rows.as_mut().unwrap();
    let seen: Vec<usize> = rows.ones(home.index()).collect();
    seen.iter().filter(|o| *o % 3 == 0).for_each(|&o| rows.clear(home.index(), o));
    let missed = |building: &Building, detail| {
        let mut walk = Walk::new(building, &path, None, SIZE).unwrap();
        walk.renderer.set_detail(detail).unwrap();
        walk.missed(camera, Mode::Pvs).unwrap().expect("counted").pixels
    };
    let details = [Detail::Plain, Detail::Full, Detail::Smooth];
    assert_eq!(details.map(|detail| missed(villa, detail)), [0; 3]);
    let [plain, full, smooth] = details.map(|detail| missed(&broken, detail));
    assert!(plain == full && plain == smooth && plain > 100, "{plain}, {full} and {smooth}");
}

/// A picture of two texels.
fn two_texels(texels: [[u8; 4]; 2]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::RgbaImage::from_raw(2, 1, texels.as_flattened().to_vec()).unwrap();
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// Pictures of two texels: red, and blue with an opacity of 0; normals that lean up and down, and to the right and the left, with a cosine
/// of 0.8; what is rough and no metal, and what is a smooth metal; one that isn't there.
const PICTURES: [(&str, Option<[[u8; 4]; 2]>); 5] = [
    ("two.png", Some([[255, 0, 0, 255], [0, 0, 255, 0]])),
    ("gone.png", None),
    ("up_down.png", Some([[128, 204, 230, 255], [128, 51, 230, 255]])),
    ("right_left.png", Some([[204, 128, 230, 255], [51, 128, 230, 255]])),
    ("rough_metal.png", Some([[0, 255, 0, 255], [0, 102, 255, 255]])),
];

/// Walls across z, 2 x 2 m about x = y = 0, each of a material of its own; texture coordinates as a picture hangs.
fn walls(name: &str, walls: &[(f32, Value)]) -> (PathBuf, Building) {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    for (name, texels) in PICTURES {
        texels.into_iter().for_each(|texels| std::fs::write(folder.join(name), two_texels(texels)).unwrap());
    }
    let (mut bin, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    let (mut meshes, mut nodes, mut materials) = (Vec::new(), Vec::new(), Vec::new());
    for (z, material) in walls {
        let corners = [[-1.0, -1.0, *z], [1.0, -1.0, *z], [1.0, 1.0, *z], [-1.0, -1.0, *z], [1.0, 1.0, *z], [-1.0, 1.0, *z]];
        let mut numbers = |floats: Vec<f32>, kind: &str| {
            let bytes: Vec<u8> = floats.iter().flat_map(|x| x.to_le_bytes()).collect();
            views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len()}));
            bin.extend(bytes);
            accessors.push(json!({"bufferView": views.len() - 1, "componentType": 5126, "type": kind, "count": 6}));
            accessors.len() - 1
        };
        let position = numbers(corners.concat(), "VEC3");
        let texture = numbers(corners.iter().flat_map(|p| [(p[0] + 1.0) * 0.5, (1.0 - p[1]) * 0.5]).collect(), "VEC2");
        let attributes = json!({"POSITION": position, "TEXCOORD_0": texture});
        materials.push(material.clone());
        meshes.push(json!({"primitives": [{"attributes": attributes, "material": materials.len() - 1}]}));
        nodes.push(json!({"mesh": meshes.len() - 1}));
    }
    std::fs::write(folder.join("walls.bin"), &bin).unwrap();
    let document = json!({
        "asset": {"version": "2.0"}, "buffers": [{"byteLength": bin.len(), "uri": "walls.bin"}], "bufferViews": views,
        "accessors": accessors, "meshes": meshes, "nodes": nodes, "materials": materials,
        "images": PICTURES.map(|(name, _)| json!({"uri": name})),
        "textures": (0..PICTURES.len()).map(|image| json!({"source": image})).collect::<Vec<_>>(),
    });
    let model = folder.join("walls.gltf");
    std::fs::write(&model, document.to_string()).unwrap();
    let scene = import(&model, &ImportOptions { trace: true, ..ImportOptions::default() }).unwrap();
    (model.clone(), baked(scene, &model))
}

/// A path of one frame, from an eye to the origin.
fn before(eye: DVec3) -> CameraPath {
    let frames = vec![PathFrame { eye, target: DVec3::ZERO }];
    CameraPath { name: "before".into(), fov_y_degrees: 60.0, near: 0.1, frames }
}

/// What is seen on the walls at x = -0.8 and 0.8, from before them.
fn seen(building: &Building) -> [[u8; 3]; 2] {
    let path = before(DVec3::new(0.0, 0.0, 3.0));
    let mut walk = Walk::new(building, &path, None, [192, 108]).unwrap();
    walk.renderer.set_detail(Detail::Full).unwrap();
    let camera = walk.camera(0);
    let pixels = drawn(&mut walk, camera, Mode::None);
    // A metre is 54 / (3 tan 30 degrees) pixels.
    let half = (54.0 / (3.0 * 30f64.to_radians().tan()) * 0.8) as usize;
    [96 - half, 96 + half].map(|x| pixels[54 * 192 + x])
}

fn unlit(base: Value) -> Value {
    json!({"pbrMetallicRoughness": base, "extensions": {"KHR_materials_unlit": {}}})
}

#[test]
fn a_picture_hangs_the_right_way_and_no_light_changes_what_is_unlit() {
    needs_device!();
    let near = |found: [u8; 3], expected: [u8; 3]| {
        assert!(found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 3), "{found:?} is not {expected:?}");
    };
    let (_, picture) = walls("looks_picture", &[(0.0, unlit(json!({"baseColorTexture": {"index": 0}})))]);
    let [left, right] = seen(&picture);
    near(left, [255, 0, 0]);
    near(right, [0, 0, 255]);
    // Half the light is 188 of 255 on a screen (a curve of 2.2: 186).
    let (_, grey) = walls("looks_grey", &[(0.0, unlit(json!({"baseColorFactor": [0.5, 0.5, 0.5, 1.0]})))]);
    near(seen(&grey)[0], [186; 3]);
    // A picture that isn't there is told, and the colour stays.
    let base = json!({"baseColorTexture": {"index": 1}, "baseColorFactor": [0.5, 0.5, 0.5, 1.0]});
    let (_, gone) = walls("looks_gone", &[(0.0, unlit(base))]);
    assert!(gone.looks.notes.len() == 1 && gone.looks.notes[0].contains("gone.png"), "{:?}", gone.looks.notes);
    assert_eq!(gone.looks.surfaces[0].picture, NO_PICTURE);
    near(seen(&gone)[0], [186; 3]);
}

#[test]
fn glass_is_blended_far_ones_first_and_holes_are_holes() {
    needs_device!();
    let of = |colour: [f32; 4], mode: &str| {
        let mut material = unlit(json!({"baseColorFactor": colour, "roughnessFactor": 1.0}));
        material["alphaMode"] = mode.into();
        material
    };
    let white = || of([1.0; 4], "OPAQUE");
    // Whatever the order in the file: red before green before white, each half.
    let panes = [(0.5, of([1.0, 0.0, 0.0, 0.5], "BLEND")), (0.2, of([0.0, 1.0, 0.0, 0.5], "BLEND")), (0.0, white())];
    for turn in 0..3 {
        let mut turned = panes.to_vec();
        turned.rotate_left(turn);
        let (_, building) = walls(&format!("looks_panes_{turn}"), &turned);
        // On the screen: (white + green) / 2, then half of that with red.
        let found = seen(&building)[0];
        let expected = [191, 128, 64];
        assert!(found.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= 4), "{turn}: {found:?}");
    }
    // Where its picture has no opacity, there is none of it.
    let picture = |mode: &str| {
        let mut material = unlit(json!({"baseColorTexture": {"index": 0}}));
        material["alphaMode"] = mode.into();
        seen(&walls(&format!("looks_{mode}"), &[(0.5, material), (0.0, white())]).1)
    };
    assert_eq!(picture("MASK"), [[255, 0, 0], [255, 255, 255]]);
    assert_eq!(picture("OPAQUE")[0], [255, 0, 0]);
}

#[test]
fn pictures_lean_normals_and_say_what_shines_and_what_is_metal() {
    needs_device!();
    let light = |[r, g, b]: [u8; 3]| u32::from(r) + u32::from(g) + u32::from(b);
    let rough = json!({"baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0});
    let leaning = |texture: Value| {
        let material = json!({"pbrMetallicRoughness": rough, "normalTexture": texture});
        seen(&walls("looks_normals", &[(0.0, material)]).1).map(light)
    };
    let [flat, same] = seen(&walls("looks_flat", &[(0.0, json!({"pbrMetallicRoughness": rough}))]).1).map(light);
    assert_eq!(flat, same);
    // The sun stands high, to the right and before the wall.
    let [up, down] = leaning(json!({"index": 2}));
    assert!(up > flat + 30 && down + 30 < flat, "{up} {flat} {down}");
    let [right, left] = leaning(json!({"index": 3}));
    assert!(right > flat + 10 && left + 10 < flat, "{right} {flat} {left}");
    assert_eq!(leaning(json!({"index": 2, "scale": 0.0})), [flat; 2]);
    // Pictures with other coordinates than the first are left out.
    let moved = json!({"index": 0, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.0]}}});
    let black = |emissive: Value| {
        let material = json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0.0, "roughnessFactor": 1.0},
            "emissiveFactor": [1, 1, 1], "emissiveTexture": emissive, "normalTexture": {"index": 2, "scale": 0.0}});
        seen(&walls("looks_emissive", &[(0.0, material)]).1)
    };
    let [[r, _, b], [r2, _, b2]] = black(json!({"index": 0}));
    assert!(r > 200 && b < 80 && r2 < 80 && b2 > 200, "{r} {b}, {r2} {b2}");
    assert!(black(moved).iter().flatten().all(|x| *x < 80));
    // A red metal reflects red, and what is no metal shines white: green and blue are of what is no metal.
    let red = json!({"baseColorFactor": [0.8, 0.0, 0.0, 1.0], "metallicRoughnessTexture": {"index": 4}});
    let (_, building) = walls("looks_metal", &[(0.0, json!({"pbrMetallicRoughness": red}))]);
    let surface = building.looks.surfaces[0];
    assert_eq!((surface.metallic, surface.emissive_and_roughness[3]), (1.0, 1.0));
    let [cloth, metal] = seen(&building);
    assert!(cloth[0] > 100 && metal[0] > 100 && cloth != metal, "{cloth:?} {metal:?}");
    let plain = json!({"baseColorFactor": [0.8, 0.0, 0.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0});
    assert_eq!(seen(&walls("looks_cloth", &[(0.0, json!({"pbrMetallicRoughness": plain}))]).1)[0], cloth);
    let plain = json!({"baseColorFactor": [0.8, 0.0, 0.0, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.4});
    assert_eq!(seen(&walls("looks_steel", &[(0.0, json!({"pbrMetallicRoughness": plain}))]).1)[1], metal);
}

#[test]
fn four_samples_change_edges_and_nothing_else() {
    needs_device!();
    let (_, wall) = walls("looks_smooth", &[(0.0, unlit(json!({"baseColorFactor": [0.0, 0.0, 0.0, 1.0]})))]);
    // A little to the side, so that edges fall anywhere between pixels.
    let path = before(DVec3::new(0.13, 0.07, 3.0));
    let mut walk = Walk::new(&wall, &path, None, [192, 108]).unwrap();
    let camera = walk.camera(0);
    let [full, smooth] = [Detail::Full, Detail::Smooth].map(|detail| {
        walk.renderer.set_detail(detail).unwrap();
        drawn(&mut walk, camera, Mode::None)
    });
    let is_black = |x: usize, y: usize| full[y * 192 + x] == [0; 3];
    let (mut at_edges, mut between) = (0, 0);
    for (y, x) in (2..106).flat_map(|y| (2..190).map(move |x| (y, x))) {
        let i = y * 192 + x;
        // A pixel that is covered in part has lines around it.
        let mut around = (y - 2..=y + 2).flat_map(|b| (x - 2..=x + 2).map(move |a| (a, b)));
        let is_edge = around.any(|(a, b)| is_black(a, b) != is_black(x, y));
        at_edges += usize::from(is_edge);
        if full[i] != smooth[i] {
            assert!(is_edge, "{x} {y}: {:?} is {:?}", full[i], smooth[i]);
            between += 1;
        }
    }
    // Four sides of 62 pixels, with four pixels at each.
    assert!((900..1100).contains(&at_edges) && between * 5 > at_edges, "{between} of {at_edges} pixels at edges");
}

/// What a device holds of a model, over its triangles: places, corners, words, what they are made of, and texture coordinates.
fn bytes_a_triangle(model: &Path) -> f64 {
    let options = ImportOptions { trace: true, ..ImportOptions::default() };
    let scene = import(model, &options).unwrap();
    let looks = Looks::read(&scene, model, &options, &|_| {});
    let is_leaf = vec![false; scene.triangles.len()];
    let (mesh, Triangles { places, corners, words }) = Mesh::new(&scene, &is_leaf).unwrap();
    let Surfaces { of_triangles, coordinates, first } = Surfaces::new(&scene, &mesh, &looks, &is_leaf);
    let sums = [places.len() * 3, corners.len(), words.len(), of_triangles.len(), coordinates.len(), first.len()];
    (sums.iter().sum::<usize>() * 4 + size_of_val(&looks.surfaces[..])) as f64 / f64::from(mesh.triangles)
}

#[test]
fn triangles_take_forty_bytes_with_their_materials() {
    let mut models: Vec<PathBuf> =
        ["villa_rotonda", "office", "gallery100"].iter().map(|name| shipped(name, "glb")).collect();
    models.push(data().join("game-maps-obj/pandora.obj"));
    if extensions().any(|extension| extension == "bsp") {
        models.push(data().join("quake-id-gpl/e1m1.bsp"));
    }
    let told: Vec<(&PathBuf, f64)> = models.iter().map(|model| (model, bytes_a_triangle(model))).collect();
    println!("{told:.1?}");
    assert!(told.iter().all(|(_, bytes)| *bytes <= 40.0), "{told:.1?}");
}

#[test]
fn a_mirror_shows_what_is_behind_the_eye_as_it_looks() {
    needs_device!();
    let picture = unlit(json!({"baseColorTexture": {"index": 0}}));
    let white = unlit(json!({"baseColorFactor": [1.0, 1.0, 1.0, 1.0]}));
    let (_, hall) = walls("looks_mirror", &[(0.0, white), (6.0, picture)]);
    let (canvas, mut session) = common::visit(&hall, Oracle::Software, [192, 108]);
    (session.view.hud, session.view.mode) = (false, Mode::None.into());
    session.motion.walker = Walker::new(DVec3::new(0.0, 0.0, 3.0) - hall.file.origin, DVec3::NEG_Z, true);
    // Half a metre to either side on a wall that seems to be 9 m away.
    let off = (54.0 / (9.0 * (session.view.fov_y / 2.0).tan()) * 0.5) as usize;
    let seen = |session: &mut Session<'_>, detail: Detail| {
        session.view.detail = detail;
        for _ in 0..2 {
            session.draw(&canvas.view, egui::RawInput::default(), 0.0).unwrap();
        }
        let picture = canvas.read(&session.renderer.gpu).unwrap();
        [96 - off, 96 + off].map(|x| picture.pixels()[50 * 192 + x])
    };
    assert_eq!(seen(&mut session, Detail::Full), [[255; 3]; 2], "no mirror hangs yet");
    session.act(Action::Mirror);
    // What is to the left behind is to the left in the mirror.
    for detail in [Detail::Full, Detail::Smooth] {
        let [left, right] = seen(&mut session, detail);
        assert!(left[0] > 2 * left[2] && right[2] > 2 * right[0], "{detail:?}: {left:?} {right:?}");
    }
    let [left, right] = seen(&mut session, Detail::Plain);
    assert_eq!(left, right, "of one colour");
}

#[test]
fn looks_that_make_no_sense_are_told_or_tamed() {
    needs_device!();
    let grey = [0.5, 0.5, 0.5, 1.0];
    // A texture that isn't there is told once, and the colour stays.
    let base = json!({"baseColorTexture": {"index": 99}, "baseColorFactor": grey});
    let mut nowhere = unlit(base);
    nowhere["normalTexture"] = json!({"index": 99});
    let (_, nowhere) = walls("looks_nowhere", &[(0.0, nowhere)]);
    assert!(nowhere.looks.notes.len() == 1 && nowhere.looks.notes[0].contains("no image"), "{:?}", nowhere.looks.notes);
    assert!(seen(&nowhere)[0].iter().all(|x| x.abs_diff(186) <= 3));
    // Where a picture says what shines and what is a metal, and isn't there, nothing does and nothing is.
    let lost = json!({"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 1}, "pbrMetallicRoughness":
        {"baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicRoughnessTexture": {"index": 1}}});
    let (_, lost) = walls("looks_lost", &[(0.0, lost)]);
    let matt = json!({"baseColorFactor": grey, "metallicFactor": 0.0, "roughnessFactor": 1.0});
    let (_, matt) = walls("looks_matt", &[(0.0, json!({"pbrMetallicRoughness": matt}))]);
    assert_eq!((lost.looks.notes.len(), seen(&lost)), (1, seen(&matt)));
    // A picture that repeats beyond all numbers, and normals that lean so: something is seen.
    let moved = json!({"index": 0, "extensions": {"KHR_texture_transform": {"scale": [1e30, -1e30]}}});
    let rough = json!({"baseColorFactor": grey, "metallicFactor": 0.0, "roughnessFactor": 1.0});
    let far = unlit(json!({"baseColorTexture": moved}));
    let lean = json!({"pbrMetallicRoughness": rough, "normalTexture": {"index": 2, "scale": 1e38}});
    let shine = json!({"pbrMetallicRoughness": rough, "emissiveFactor": [3e38, 3e38, 0.0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3e38}}});
    for (name, material) in [("far", far), ("lean", lean), ("shine", shine)] {
        let (_, building) = walls(&format!("looks_{name}"), &[(0.0, material)]);
        assert!(seen(&building)[0].iter().map(|x| u32::from(*x)).sum::<u32>() > 30, "{name}: {:?}", seen(&building));
    }
}
