//! Generated scenes against their own plans: closed solids, sealed rooms, walks that go through doors, the committed files;
//! teapots, cities and decks against the studies that they are made after.

mod cities;
mod crowds;
mod landscape;
mod shown;

use crate::cli::{building, folder, run_words, text};
use enfilade::scene::{ImportOptions, Role, Scene};
use enfilade_formats::gltf::from_slice;
use enfilade_scenes::{DECK_OBJECTS, Generated, Kind, MAX_ROOMS, MAX_TEAPOTS, generate, pretty};
use glam::{DVec2, DVec3};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use testing::plain::{meets, open_edges};
use testing::random::Random;

/// The committed buildings: file name, options, seed.
const COMMITTED: [(&str, Kind, u64); 3] = [
    ("villa_rotonda", Kind::House, 0),
    ("office", Kind::Office { rooms: 48, storeys: Some(3), furnished: true }, 1),
    ("gallery100", Kind::Gallery { rooms: 100 }, 1),
];

fn make(kind: Kind, seed: u64) -> Generated {
    generate(kind, seed).unwrap()
}

fn scene(made: &Generated) -> Scene {
    from_slice(&made.glb, "test", None, &ImportOptions { object_triangles: u32::MAX, ..ImportOptions::default() }).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn point(value: &Value) -> DVec3 {
    DVec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

#[test]
fn committed_buildings_are_made_again_byte_for_byte() {
    for (name, kind, seed) in COMMITTED {
        let made = make(kind, seed);
        let texts = [("path", &made.path), ("rooms", &made.rooms), ("expected", &made.expected)];
        let mut files = vec![("glb".to_owned(), made.glb.clone())];
        files.extend(texts.map(|(what, value)| (format!("{what}.json"), pretty(value).into_bytes())));
        for (extension, bytes) in files {
            let path = building(&format!("{name}.{extension}"));
            let there = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            assert!(there == bytes, "{}: differs from what the generator makes", path.display());
            assert!(bytes.len() < 1_500_000, "{name}");
        }
    }
}

#[test]
fn the_counts_are_those_of_the_file_as_another_reader_sees_it() {
    for kind in [
        Kind::Office { rooms: 60, storeys: None, furnished: true },
        Kind::Gallery { rooms: 23 },
        Kind::Maze { rooms: 30 },
        Kind::House,
        Kind::Hall,
        Kind::Plant { size: 120 },
    ] {
        let made = make(kind, 5);
        let file = gltf::Gltf::from_slice(&made.glb).unwrap();
        let triangles = |node: &gltf::Node| {
            let mesh = node.mesh().unwrap();
            mesh.primitives().map(|p| p.indices().unwrap().count() / 3).sum::<usize>()
        };
        let scene = scene(&made);
        let names: BTreeSet<&str> = scene.objects.iter().map(|o| o.node.as_str()).collect();
        assert_eq!(names.len(), file.nodes().len(), "{kind:?}: names are unique");
        assert_eq!(made.expected["triangles"], file.nodes().map(|n| triangles(&n)).sum::<usize>(), "{kind:?}");
        assert_eq!(made.expected["nodes"], file.nodes().len());
        let kinds = |kind: &str| list(&made.rooms["doors"]).iter().filter(|d| d["kind"] == kind).count();
        assert_eq!(made.expected["doors"], kinds("door"));
        assert_eq!(made.expected["openings"], kinds("opening"));
        assert_eq!(made.expected["windows"], kinds("window"));
        assert_eq!(made.expected["rooms"], list(&made.rooms["rooms"]).len());
        assert_eq!(made.expected["frames"], list(&made.path["frames"]).len());
        let glass = file.materials().filter(|m| m.alpha_mode() == gltf::material::AlphaMode::Blend).count();
        assert_eq!(glass, usize::from(kinds("window") > 0), "{kind:?}");
    }
}

#[test]
fn every_object_is_closed_and_has_its_role() {
    for (name, kind, seed) in COMMITTED {
        let made = make(kind, seed);
        let scene = scene(&made);
        for object in &scene.objects {
            // Corners are shared by position here: the file's own rounding must not open a seam.
            let key = |i: u32| scene.positions[i as usize].to_array().map(f64::to_bits);
            let of_object = &scene.triangles[object.triangles.start as usize..object.triangles.end as usize];
            assert_eq!(open_edges(of_object.iter().map(|t| t.map(key))), 0, "{name}: {} is not closed", object.node);
            assert_eq!(object.opaque, !matches!(object.role, Role::Door | Role::Window), "{name}: {}", object.node);
        }
        let count = |role: Role| scene.objects.iter().filter(|o| o.role == role).count();
        assert_eq!(made.expected["doors"], count(Role::Door), "{name}");
        assert_eq!(made.expected["windows"], count(Role::Window), "{name}");
        assert!(count(Role::Structure) > 10 && count(Role::Furnishing) > 10 && count(Role::Unknown) == 0, "{name}");
    }
}

/// From inside every room, rays meet walls, floor and ceiling unless they leave through a hole that the plan knows.
#[test]
fn rooms_are_sealed_but_for_the_openings_that_the_plan_names() {
    for (name, kind, seed, reach) in [
        ("office", Kind::Office { rooms: 17, storeys: Some(3), furnished: false }, 3, 0.4),
        ("campus", Kind::Office { rooms: 61, storeys: Some(1), furnished: false }, 4, 0.4),
        ("gallery", Kind::Gallery { rooms: 14 }, 3, 0.4),
        ("maze", Kind::Maze { rooms: 15 }, 3, 0.4),
        ("hall", Kind::Hall, 3, 0.4),
        // Its masonry is up to 1.3 m thick.
        ("villa", Kind::House, 0, 1.4),
    ] {
        let made = make(kind, seed);
        let scene = scene(&made);
        let structure: Vec<[DVec3; 3]> = (scene.objects.iter().filter(|o| o.role == Role::Structure))
            .flat_map(|o| o.triangles.clone())
            .map(|t| scene.corners(t as usize).map(|p| p + scene.origin))
            .collect();
        let mut numbers = Random::new(seed);
        let (mut stopped, mut left) = (0, 0);
        for room in list(&made.rooms["rooms"]) {
            let ring: Vec<DVec2> =
                list(&room["footprint"][0][0]).iter().map(|p| DVec2::new(number(&p[0]), number(&p[1]))).collect();
            let fold = |f: fn(DVec2, DVec2) -> DVec2| ring.iter().copied().reduce(f).unwrap();
            let (low, high) = (fold(DVec2::min), fold(DVec2::max));
            let (min, max) =
                (DVec3::new(low.x, number(&room["floor_y"]), low.y), DVec3::new(high.x, number(&room["ceiling_y"]), high.y));
            let holes = holes(&made.rooms, room, min, max);
            let near: Vec<[DVec3; 3]> = (structure.iter().copied())
                .filter(|t| {
                    (0..3).all(|k| t.iter().any(|p| p[k] >= min[k] - reach) && t.iter().any(|p| p[k] <= max[k] + reach))
                })
                .collect();
            for _ in 0..400 {
                // The hall's footprint is round: stay away from its bounds' corners.
                let eye = min
                    + (max - min)
                        * DVec3::new(
                            0.2 + 0.6 * numbers.real(0.0, 1.0),
                            0.05 + 0.9 * numbers.real(0.0, 1.0),
                            0.2 + 0.6 * numbers.real(0.0, 1.0),
                        );
                let direction = numbers.direction();
                let exit = ((min - reach - eye) / direction).max((max + reach - eye) / direction).min_element();
                if near.iter().any(|t| meets(eye, direction, *t).is_some_and(|t| t < exit)) {
                    stopped += 1;
                    continue;
                }
                left += 1;
                let through = holes.iter().any(|(centre, half, normal)| {
                    let t = (centre - eye).dot(*normal) / direction.dot(*normal);
                    t > 0.0 && t <= exit && (eye + direction * t - centre).abs().cmple(half + 1e-6).all()
                });
                assert!(through, "{name}: {} leaks from {eye} along {direction}", room["name"]);
            }
        }
        assert!(stopped > 10 * left && (left > 0) == (name != "hall"), "{name}: {stopped} stopped, {left} left");
    }
}

/// Centre, half size and normal of each hole of a room: in its walls, in its floor, in its ceiling.
fn holes(facts: &Value, room: &Value, min: DVec3, max: DVec3) -> Vec<(DVec3, DVec3, DVec3)> {
    let mut holes = Vec::new();
    for door in list(&facts["doors"]).iter().filter(|d| list(&d["rooms"]).contains(&room["id"])) {
        let normal = point(&door["normal"]);
        let half = DVec3::new(number(&door["width"]), number(&door["height"]), number(&door["width"])) / 2.0;
        holes.push((point(&door["centre"]), half * (DVec3::ONE - normal), normal));
    }
    for void in list(&facts["voids"]) {
        let (a, b) = (point(&void["bbox"]), DVec3::from_array([3, 4, 5].map(|i| number(&void["bbox"][i]))));
        if (a - 0.1).cmple(max).all() && (b + 0.1).cmpge(min).all() {
            holes.push(((a + b) / 2.0, (b - a) / 2.0 * (DVec3::ONE - DVec3::Y), DVec3::Y));
        }
    }
    holes
}

#[test]
fn walks_go_through_doors_and_never_through_walls_windows_or_furniture() {
    let more = [
        ("maze", Kind::Maze { rooms: 50 }, 2),
        ("hall", Kind::Hall, 2),
        ("tower", Kind::Office { rooms: 30, storeys: Some(5), furnished: true }, 9),
    ];
    for (name, kind, seed) in COMMITTED.into_iter().chain(more) {
        let made = make(kind, seed);
        let scene = scene(&made);
        let eyes: Vec<DVec3> = list(&made.path["frames"]).iter().map(|f| point(&f["eye"])).collect();
        for frame in list(&made.path["frames"]) {
            assert!(point(&frame["eye"]).distance(point(&frame["target"])) > 0.1, "{name}: {frame}");
        }
        for (i, leg) in eyes.windows(2).enumerate() {
            let direction = leg[1] - leg[0];
            for object in scene.objects.iter().filter(|o| o.role != Role::Door) {
                for t in object.triangles.clone() {
                    let corners = scene.corners(t as usize).map(|p| p + scene.origin);
                    let through = meets(leg[0], direction, corners).is_some_and(|t| t <= 1.0);
                    assert!(!through, "{name}: frame {i} goes through {}", object.node);
                }
            }
        }
        if name != "hall" {
            assert!((60..=200).contains(&eyes.len()), "{name}: {} frames", eyes.len());
            assert!(rooms_entered(&made.rooms, &eyes) >= 8, "{name}: enters {} rooms", rooms_entered(&made.rooms, &eyes));
        }
    }
}

/// How many rooms' footprints a walk enters, at eye height over their floor.
fn rooms_entered(facts: &Value, eyes: &[DVec3]) -> usize {
    let entered = |room: &&Value| {
        let ring = list(&room["footprint"][0][0]);
        let at = |i: usize| DVec2::new(number(&ring[i % ring.len()][0]), number(&ring[i % ring.len()][1]));
        eyes.iter().any(|eye| {
            let p = DVec2::new(eye.x, eye.z);
            let crossings = (0..ring.len()).filter(|&i| {
                let (a, b) = (at(i), at(i + 1));
                (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)
            });
            crossings.count() % 2 == 1 && (number(&room["floor_y"])..number(&room["ceiling_y"])).contains(&eye.y)
        })
    };
    list(&facts["rooms"]).iter().filter(entered).count()
}

#[test]
fn every_room_can_be_reached_on_foot_from_outside() {
    for kind in [
        Kind::Office { rooms: 1, storeys: None, furnished: true },
        Kind::Office { rooms: 137, storeys: None, furnished: false },
        Kind::Gallery { rooms: 1 },
        Kind::Gallery { rooms: 77 },
        Kind::Maze { rooms: 61 },
        Kind::House,
    ] {
        let made = make(kind, 11);
        let mut next: BTreeMap<Option<&str>, Vec<Option<&str>>> = BTreeMap::new();
        for door in list(&made.rooms["doors"]).iter().filter(|d| d["kind"] != "window") {
            let [a, b] = [0, 1].map(|i| door["rooms"][i].as_str());
            next.entry(a).or_default().push(b);
            next.entry(b).or_default().push(a);
        }
        // A stair well's rooms lie over each other: joined by the hole in the slab between them.
        let wells: Vec<&Value> =
            list(&made.rooms["rooms"]).iter().filter(|r| r["name"].as_str().unwrap().starts_with("Stairs")).collect();
        for (a, b) in wells.iter().flat_map(|a| wells.iter().map(move |b| (a, b))) {
            if a["footprint"] == b["footprint"] && (number(&b["floor_y"]) - number(&a["ceiling_y"]) - 0.3).abs() < 1e-6 {
                next.entry(a["id"].as_str()).or_default().push(b["id"].as_str());
            }
        }
        let (mut seen, mut queue) = (BTreeSet::from([None]), vec![None]);
        while let Some(room) = queue.pop() {
            queue.extend(next.get(&room).into_iter().flatten().filter(|&&r| seen.insert(r)));
        }
        assert_eq!(seen.len(), 1 + list(&made.rooms["rooms"]).len(), "{kind:?}");
    }
}

#[test]
fn an_office_building_has_the_offices_asked_for_each_with_one_door_to_its_corridor() {
    for (rooms, storeys) in [(1, 1), (48, 3), (130, 2), (500, 10)] {
        let made = make(Kind::Office { rooms, storeys: Some(storeys), furnished: false }, 1);
        let name = |id: &Value| {
            list(&made.rooms["rooms"]).iter().find(|r| &r["id"] == id).map_or("", |r| r["name"].as_str().unwrap())
        };
        let offices =
            list(&made.rooms["rooms"]).iter().filter(|r| r["name"].as_str().unwrap().starts_with("Office")).count();
        let mut joined = BTreeMap::new();
        for door in list(&made.rooms["doors"]).iter().filter(|d| d["kind"] == "door") {
            for i in 0..2 {
                let (id, other) = (&door["rooms"][i], &door["rooms"][1 - i]);
                if name(id).starts_with("Office") && name(other).starts_with("Corridor") {
                    *joined.entry(id.to_string()).or_insert(0) += 1;
                }
            }
        }
        assert_eq!((offices, joined.len(), joined.values().all(|&n| n == 1)), (rooms, rooms, true));
        assert_eq!(made.expected["storeys"], storeys);
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn a_thousand_furnished_offices_are_about_a_million_triangles_and_ten_thousand_rooms_are_made() {
    let triangles = |kind| number(&make(kind, 0).expected["triangles"]);
    let thousand = triangles(Kind::Office { rooms: 1000, storeys: None, furnished: true });
    assert!((0.8e6..1.8e6).contains(&thousand), "{thousand}");
    let hundred = triangles(Kind::Gallery { rooms: 100 });
    assert!((2e4..6e4).contains(&hundred), "{hundred}");
    assert_eq!(make(Kind::Maze { rooms: 10_000 }, 0).expected["rooms"], 10_000);
}

#[test]
fn the_seed_decides_and_nothing_else() {
    for kind in [
        Kind::Office { rooms: 20, storeys: None, furnished: true },
        Kind::Gallery { rooms: 9 },
        Kind::Maze { rooms: 9 },
        Kind::Hall,
        Kind::Teapots { count: 20, scale: 3 },
        Kind::City { dense: false },
        Kind::Deck { objects: 1_000 },
    ] {
        assert!(make(kind, 3) == make(kind, 3));
        assert!(make(kind, 3).glb != make(kind, 4).glb, "{kind:?}");
    }
}

#[test]
fn what_cannot_be_made_is_refused() {
    let refused = |kind: Kind, said: &str| {
        let error = generate(kind, 0).unwrap_err().to_string();
        assert!(error.starts_with(said), "{error}, not {said}");
    };
    for rooms in [0, MAX_ROOMS + 1] {
        for kind in [Kind::Gallery { rooms }, Kind::Maze { rooms }, Kind::Office { rooms, storeys: None, furnished: false }]
        {
            refused(kind, &format!("{rooms} rooms requested"));
        }
    }
    for storeys in [0, 11] {
        let office = Kind::Office { rooms: 10, storeys: Some(storeys), furnished: false };
        refused(office, &format!("{storeys} storeys requested for 10 offices"));
    }
    for count in [0, MAX_TEAPOTS + 1] {
        refused(Kind::Teapots { count, scale: 10 }, &format!("{count} teapots requested; give 1 to 18000"));
    }
    for scale in [0, 101] {
        refused(Kind::Teapots { count: 1, scale }, &format!("teapots at a scale of {scale} requested; give 1 to 100"));
    }
    for objects in [0, DECK_OBJECTS.start() - 1, DECK_OBJECTS.end() + 1] {
        refused(Kind::Deck { objects }, &format!("a deck of {objects} objects requested; give 1000 to 400000"));
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn the_command_line_makes_a_dense_city_unless_told_and_says_what_is_out_of_range() {
    let folder = folder("command");
    let run = |arguments: &[&str], output: &Path| {
        let out = run_words(&[&["generate"], arguments, &["-o", text(output)]].concat());
        (out.status.code(), String::from_utf8(out.stderr).unwrap())
    };
    for (flags, dense) in [(&[][..], true), (&["--sparse"], false)] {
        let output = folder.join("city.glb");
        let (code, said) = run(&[&["city", "--seed", "2"], flags].concat(), &output);
        assert!(code == Some(0) && std::fs::read(&output).unwrap() == make(Kind::City { dense }, 2).glb, "{said}");
    }
    let output = folder.join("teapots.glb");
    let (code, said) = run(&["teapots", "--count", "4"], &output);
    let made = make(Kind::Teapots { count: 4, scale: 10 }, 0);
    assert!(code == Some(0) && std::fs::read(&output).unwrap() == made.glb, "{said}");

    let output = folder.join("not-made.glb");
    let (code, said) = run(&["deck", "--objects", "999"], &output);
    assert!(code == Some(2) && said.contains("a deck of 999 objects requested") && !output.exists(), "{said}");
    assert!(said.lines().count() == 1, "{said}");
}
