//! Tubes of OBJ lines and of glTF extras: where they are, what is refused, and that a model that is cut shows the same.

use enfilade::bake::without_rows;
use enfilade::math::geom::Aabb;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::export::export;
use enfilade_formats::{gltf, import, obj};
use enfilade_scenes::{Kind, generate};
use enfilade_tubes::usual_sides;
use glam::{DVec3, dvec3};
use serde_json::{Value, json};
use std::f64::consts::TAU;
use testing::glb::base64;
use testing::meshes::{area_of, area_of_all};

/// A document with lines: each a name, positions, a mode, and extras.
fn document(nodes: &[(&str, &[[f32; 3]], u32, Value)]) -> Vec<u8> {
    let mut bytes: Vec<u8> = Vec::new();
    let (mut accessors, mut meshes, mut all) = (Vec::new(), Vec::new(), Vec::new());
    for (k, (name, positions, mode, extras)) in nodes.iter().enumerate() {
        accessors.push(json!({"bufferView": 0, "byteOffset": bytes.len(), "componentType": 5126, "count": positions.len(), "type": "VEC3"}));
        bytes.extend(positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        meshes.push(json!({"primitives": [{"attributes": {"POSITION": k}, "mode": mode}]}));
        all.push(json!({"name": name, "mesh": k, "scale": [2, 2, 2], "extras": {"enfilade": extras}}));
    }
    let numbers: Vec<usize> = (0..nodes.len()).collect();
    let uri = format!("data:application/octet-stream;base64,{}", base64(&bytes));
    let whole = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": numbers}], "nodes": all, "meshes": meshes, "accessors": accessors,
        "bufferViews": [{"buffer": 0, "byteLength": bytes.len()}], "buffers": [{"byteLength": bytes.len(), "uri": uri}],
    });
    whole.to_string().into_bytes()
}

/// Lines, a ring and pairs of points, of nodes that are twice as large as their meshes.
#[test]
fn lines_of_gltf_with_a_radius_are_tubes() {
    let straight = [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]];
    let ring: Vec<[f32; 3]> =
        (0..64).map(|k| (TAU as f32 * k as f32 / 64.0).sin_cos()).map(|(s, c)| [3.0 * c, 0.0, 3.0 * s]).collect();
    let pairs = [[0.0, 5.0, 0.0], [1.0, 5.0, 0.0], [1.0, 5.0, 0.0], [1.0, 6.0, 0.0], [4.0, 6.0, 0.0], [4.0, 7.0, 0.0]];
    let file = document(&[
        ("pipe", &straight, 3, json!({"tube": {"radius": 0.05}})),
        ("ring", &ring, 2, json!({"tube": {"radius": 0.05, "smooth": true}})),
        ("pairs", &pairs, 1, json!({"tube": {"radius": 0.05, "open": true}})),
        ("left out", &straight, 3, json!({})),
    ]);
    let scene = gltf::from_slice(&file, "lines", None, &ImportOptions::default()).unwrap();
    let notes = &scene.source.notes;
    assert!(notes.iter().any(|note| note == "1 primitives of points or lines left out"), "{notes:?}");
    let of = |name: &str| {
        let objects = scene.objects.iter().filter(|o| o.node == name);
        let tubes: Vec<_> =
            objects.flat_map(|o| scene.tubes.parts(o.segments.clone())).map(|(tube, _)| tube.clone()).collect();
        tubes
    };
    assert!(of("pipe").iter().all(|tube| !tube.closed && tube.capped) && !of("pipe").is_empty());
    assert!(of("ring").iter().all(|tube| tube.closed));
    // The second pair goes on from the first, the third one doesn't.
    let mut pieces = of("pairs");
    pieces.dedup();
    assert!(pieces.len() == 2 && pieces.iter().all(|tube| !tube.capped), "{pieces:?}");
    // Twice as large: 10 m, 0.1 m; a ring of 6 m.
    let meshed = scene.clone().meshed(|_| 64);
    let boxed = |name: &str| {
        let corners = meshed.objects.iter().filter(|o| o.node == name).flat_map(|o| o.triangles.clone());
        Aabb::of(corners.flat_map(|t| meshed.corners(t as usize)).map(|p| p + meshed.origin))
    };
    let near = |a: DVec3, b: DVec3| a.distance(b) < 5e-3;
    let pipe = boxed("pipe");
    assert!(near(pipe.min, dvec3(0.0, -0.1, -0.1)) && near(pipe.max, dvec3(10.0, 0.1, 0.1)), "{pipe:?}");
    let ring = boxed("ring");
    assert!(near(ring.min, dvec3(-6.1, -0.1, -6.1)) && near(ring.max, dvec3(6.1, 0.1, 6.1)), "{ring:?}");

    // A radius for all, in metres: what was left out is there, and those of their own keep theirs.
    let all = ImportOptions { tube_radius: Some(0.3), ..ImportOptions::default() };
    let scene = gltf::from_slice(&file, "lines", None, &all).unwrap();
    let radius = |name: &str| {
        let object = scene.objects.iter().find(|o| o.node == name).unwrap();
        scene.tubes.sections[object.segments.start as usize].radius()
    };
    assert!((radius("left out") - 0.3).abs() < 1e-3 && (radius("pipe") - 0.1).abs() < 1e-3);
}

#[test]
fn tubes_of_gltf_that_make_no_sense_are_refused() {
    let line = [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]];
    for (tube, expected) in [
        (json!({"radius": -1.0}), "node pipe: extras.enfilade.tube: a radius of -2 m"),
        (json!({"radius": 0.1, "inner": 0.2}), "a radius of 0.2 m"),
        (json!({"radius": 1e5}), "below 65,504 m"),
        (json!({"radius": 1e-9}), "a radius of 0.000000002 m"),
        (json!({"radius": 0.1, "colour": 1}), "unknown field `colour`"),
        (json!({}), "missing field `radius`"),
    ] {
        let file = document(&[("pipe", &line, 3, json!({"tube": tube}))]);
        let error = gltf::from_slice(&file, "lines", None, &ImportOptions::default()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}, not {expected}");
    }
    let point = document(&[("pipe", &line[..1], 3, json!({"tube": {"radius": 0.1}}))]);
    let error = gltf::from_slice(&point, "lines", None, &ImportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("fewer than two different points"), "{error}");
}

#[test]
fn lines_of_obj_are_tubes_where_a_radius_is_given() {
    let text = "v 0 0 0\nv 10 0 0\nv 10 0 10\no mains\nl 1 2 3\nl 1 3\n";
    let read = |radius: Option<f64>| {
        let options = ImportOptions { tube_radius: radius, ..ImportOptions::default() };
        obj::from_slice(text.as_bytes(), "mains", None, &options)
    };
    assert!(read(None).is_err(), "nothing but lines");
    let scene = read(Some(0.25)).unwrap();
    // Few: they are meshes.
    assert!(scene.objects.iter().all(|o| o.node == "mains" && !o.is_tube()) && scene.tubes.tubes.is_empty());
    let expected = TAU * 0.25 * (9.75 + 9.75 + 0.25 * TAU / 4.0 + 200f64.sqrt()) + 2.0 * TAU * 0.0625;
    assert!((area_of_all(&scene) / expected - 1.0).abs() < 0.02, "{} m2, not {expected}", area_of_all(&scene));
    let bad = obj::from_slice(
        b"v 0 0 0\nl 1 7\n",
        "m",
        None,
        &ImportOptions { tube_radius: Some(1.0), ..ImportOptions::default() },
    );
    assert!(bad.unwrap_err().to_string().contains("line 2"));
    // A line of one point is left out, unless there is no other.
    let options = ImportOptions { tube_radius: Some(0.25), ..ImportOptions::default() };
    let dots = format!("{text}v 10 0 0\nl 4\nl 2 4 2\n");
    let scene = obj::from_slice(dots.as_bytes(), "mains", None, &options).unwrap();
    assert!((area_of_all(&scene) / expected - 1.0).abs() < 0.02, "{} m2, not {expected}", area_of_all(&scene));
    assert!(
        scene.source.notes.iter().any(|note| note == "2 lines without two distinct points left out"),
        "{:?}",
        scene.source.notes
    );
    let refused = obj::from_slice(b"v 0 0 0\nv 0 0 0\nl 1 2\n", "m", None, &options).unwrap_err().to_string();
    assert_eq!(refused, "line 3: fewer than two different points");
    // It refuses no model that has a mesh.
    let scene = obj::from_slice(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 1\n", "m", None, &options).unwrap();
    let notes = &scene.source.notes;
    assert!(scene.triangles.len() == 1 && notes.iter().any(|n| n == "1 lines without two distinct points left out"));
}

/// A plant's pipes are tubes; whoever wants meshes has those of the file. Cut into objects, it shows the same.
#[test]
fn pipes_of_a_plant_are_tubes_and_cut_again() {
    let made = generate(Kind::Plant { size: 160 }, 1).unwrap();
    let at = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("plant_of_tubes.glb");
    std::fs::write(&at, &made.glb).unwrap();
    let options = ImportOptions::default();
    let tubes = import(&at, &options).unwrap();
    let meshes = import(&at, &ImportOptions { tubes: false, ..options.clone() }).unwrap();
    assert_eq!(meshes.triangles.len() as u64, made.expected["triangles"].as_u64().unwrap());
    assert!(meshes.tubes.tubes.is_empty() && tubes.tubes.tubes.len() > 100, "{} tubes", tubes.tubes.tubes.len());
    let is_pipe = |name: &str| name.starts_with("pipe ");
    assert!(tubes.objects.iter().all(|o| o.is_tube() == is_pipe(&o.node)));
    // A circle of 12 sides is smaller than the pipe by 1.1 %.
    let of_pipes =
        |scene: &Scene| -> f64 { scene.objects.iter().filter(|o| is_pipe(&o.node)).map(|o| area_of(scene, o)).sum() };
    let drawn = tubes.clone().meshed(usual_sides);
    let share = of_pipes(&meshes) / of_pipes(&drawn);
    assert!((0.985..0.999).contains(&share), "{share}");

    let file = without_rows(&tubes, &options);
    let cut = export(&at, &options, &file).unwrap();
    let again = gltf::from_slice(&cut.glb, "cut", None, &options).unwrap();
    assert!(again.tubes.tubes.is_empty() && again.objects.len() == tubes.objects.len(), "{} objects", again.objects.len());
    let roles = |scene: &Scene| scene.objects.iter().filter(|o| is_pipe(&o.node)).map(|o| o.role).collect::<Vec<_>>();
    assert_eq!(roles(&again), roles(&tubes));
    assert!(
        (area_of_all(&again) / area_of_all(&drawn) - 1.0).abs() < 1e-4,
        "{} of {}",
        area_of_all(&again),
        area_of_all(&drawn)
    );
    let [a, b] = [&again, &drawn].map(|scene| Aabb::of(scene.positions.iter().map(|p| *p + scene.origin)));
    assert!(a.min.distance(b.min) + a.max.distance(b.max) < 1e-3, "{a:?}, not {b:?}");
}

/// What is counted is what a reader finds, and no pipe is lost.
#[test]
fn as_many_sections_are_made_as_were_asked_for() {
    for sections in [1, 2_000, 50_000] {
        let made = generate(Kind::Pipes { sections }, 1).unwrap();
        let scene = gltf::from_slice(&made.glb, "pipes", None, &ImportOptions::default()).unwrap();
        let [counted, pipes] = ["sections", "pipes"].map(|key| made.expected[key].as_u64().unwrap() as usize);
        assert!((sections..sections + 1_000).contains(&counted), "{counted} for {sections}");
        // Rounding of places may make a bend one section more.
        let found = scene.tubes.sections.len();
        assert!(
            (sections == 1 || scene.tubes.tubes.len() == pipes) && found.abs_diff(counted) <= 1 + counted / 1000,
            "{found}, not {counted}"
        );
    }
    assert!(generate(Kind::Pipes { sections: 0 }, 1).is_err());
}

/// A radius for all says nothing of boxes, however they are scaled.
#[test]
fn a_radius_for_all_leaves_meshes_alone() {
    let triangle = [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 5.0, 0.0]];
    let file = document(&[("box", &triangle, 4, json!({})), ("line", &triangle[..2], 3, json!({}))]);
    let uneven = String::from_utf8(file).unwrap().replace("[2,2,2]", "[1,2,1]").into_bytes();
    let options = ImportOptions { tube_radius: Some(0.1), ..ImportOptions::default() };
    let scene = gltf::from_slice(&uneven, "box", None, &options).unwrap();
    assert_eq!(scene.objects.iter().map(|o| o.node.as_str()).collect::<Vec<_>>(), ["box"]);
    let notes = &scene.source.notes;
    assert!(notes.iter().any(|note| note == "1 primitives of points or lines left out"), "{notes:?}");
}

/// A few pipes are meshes: cut into objects, these are there, once, whatever the source has for them.
#[test]
fn a_few_pipes_are_cut_too() {
    let line = [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 3.0, 0.0]];
    let flat = [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 5.0, 0.0]];
    let points = json!({"radius": 0.1, "points": [[0, 0, 9], [5, 0, 9]]});
    let file = document(&[
        ("nothing", &line[..1], 3, json!({"tube": {"radius": 0.1}})),
        ("line", &line, 3, json!({"tube": {"radius": 0.1}})),
        ("mesh", &flat, 4, json!({"tube": points})),
        ("plate", &flat, 4, json!({})),
    ]);
    let at = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("few_tubes.glb");
    std::fs::write(at.with_extension("gltf"), &file).unwrap();
    let at = at.with_extension("gltf");
    for tubes in [true, false] {
        let options = ImportOptions { tubes, ..ImportOptions::default() };
        let scene = import(&at, &options).unwrap();
        assert!(scene.tubes.tubes.is_empty() && scene.objects.len() >= 3, "{} objects", scene.objects.len());
        let cut = export(&at, &options, &without_rows(&scene, &options)).unwrap();
        for tube_radius in [None, Some(0.3)] {
            let again = gltf::from_slice(&cut.glb, "cut", None, &ImportOptions { tube_radius, ..options.clone() }).unwrap();
            let names = |scene: &Scene| {
                let name = |node: &str| node.split(" #").next().unwrap_or_default().to_owned();
                let mut names: Vec<String> = scene.objects.iter().map(|o| name(&o.node)).collect();
                names.sort();
                names
            };
            assert_eq!(names(&again), names(&scene));
            assert!(
                (area_of_all(&again) / area_of_all(&scene) - 1.0).abs() < 1e-4,
                "{} of {}",
                area_of_all(&again),
                area_of_all(&scene)
            );
        }
    }
}
