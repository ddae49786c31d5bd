//! IFC import against what others wrote down about the same files (`*.rooms.json`), and against a house small enough to know
//! every number of it.
#![cfg(feature = "ifc")]

use enfilade::geom::{Aabb, area, middle, newell};
use enfilade::scene::{ImportError, ImportOptions, OpeningHint, OpeningKind, Role, RoomHint, Scene};
use enfilade_formats::ifc::import_bytes;
use glam::{DVec2, DVec3};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::Write;
use std::time::{Duration, Instant};
use testing::data::data;
use testing::house;
use testing::house::{House, Schema};

/// Real buildings: path, storeys, spaces, doors, windows as counted in the files' text.
const FILES: [(&str, [usize; 4]); 7] = [
    ("duplex/Duplex_A_20110907", [4, 21, 14, 24]),
    ("kit-apache/AC11-FZK-Haus", [2, 7, 5, 11]),
    ("kit-apache/AC11-Smiley-West", [5, 70, 85, 40]),
    ("webifc-mpl/AC20-FZK-Haus", [2, 7, 5, 11]),
    ("webifc-mpl/Office_A_20110811", [3, 99, 102, 69]),
    ("bimwhale-mit/LargeBuilding", [2, 8, 18, 42]),
    ("bimwhale-mit/TallBuilding", [5, 3, 5, 21]),
];

/// Every real building with what others wrote down about it.
fn buildings() -> Vec<(&'static str, [usize; 4], Scene, Value)> {
    let folder = data();
    let read = |&(file, counts): &(&'static str, [usize; 4])| {
        let scene = enfilade_formats::import(&folder.join(format!("{file}.ifc")), &ImportOptions::default()).unwrap();
        let rooms = std::fs::read(folder.join(format!("{file}.rooms.json"))).unwrap();
        (file, counts, scene, serde_json::from_slice(&rooms).unwrap())
    };
    FILES.iter().map(read).collect()
}

fn list<'v>(value: &'v Value, key: &str) -> &'v [Value] {
    value[key].as_array().unwrap()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap()
}

fn point(value: &Value) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|i| value[i].as_f64().unwrap()))
}

/// Horizontal and vertical extent of a winding in an upright plane; of others, of its first two sides.
fn size(winding: &[DVec3]) -> DVec2 {
    let height = winding.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max)
        - winding.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    if newell(winding).normalize().y.abs() > 0.1 {
        return DVec2::new(winding[0].distance(winding[1]), winding[1].distance(winding[2]));
    }
    DVec2::new(area(winding) / height, height)
}

fn bounds(room: &RoomHint) -> enfilade::geom::Aabb {
    enfilade::geom::Aabb::of(room.surface.iter().flatten().copied())
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn counts_are_those_of_the_files() {
    for (file, [storeys, spaces, doors, windows], scene, _) in buildings() {
        let count = |kind| scene.hints.openings.iter().filter(|o| o.kind == kind).count();
        assert_eq!(scene.hints.storeys.len(), storeys, "{file}");
        assert_eq!(scene.hints.rooms.len(), spaces, "{file}");
        assert_eq!(count(OpeningKind::Door), doors, "{file}");
        assert_eq!(count(OpeningKind::Window), windows, "{file}");
        assert!(scene.hints.storeys.is_sorted_by(|a, b| a.elevation <= b.elevation), "{file}");
        // Nothing that a user would have to know about; Smiley-West has three boundaries that aren't convex.
        let expected = usize::from(file.ends_with("Smiley-West"));
        assert_eq!(scene.source.notes.len(), expected, "{file}: {:?}", scene.source.notes);
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn rooms_are_where_others_found_them() {
    for (file, _, scene, known) in buildings() {
        for room in list(&known, "rooms") {
            let id = room["id"].as_str().unwrap();
            let hint = scene.hints.rooms.iter().find(|h| h.id == id).unwrap_or_else(|| panic!("{file}: no room {id}"));
            let name = hint.name.as_str();
            assert!(name.starts_with(room["name"].as_str().unwrap()), "{file}: {name}");
            assert!(name.ends_with(room["long_name"].as_str().unwrap()), "{file}: {name}");
            assert_eq!(hint.storey.map(|s| scene.hints.storeys[s].name.as_str()), room["storey"].as_str(), "{file}: {name}");
            let found = bounds(hint);
            let (floor, ceiling) = (found.min.y + scene.origin.y, found.max.y + scene.origin.y);
            assert!((floor - number(room, "floor_y")).abs() < 2e-3, "{file}: {name}: floor at {floor}");
            assert!((ceiling - number(room, "ceiling_y")).abs() < 2e-3, "{file}: {name}: ceiling at {ceiling}");
            let corners = list(room, "footprint").iter().flat_map(|polygon| polygon[0].as_array().unwrap());
            let plan = enfilade::geom::Aabb::of(
                corners.map(|c| DVec3::new(c[0].as_f64().unwrap(), floor, c[1].as_f64().unwrap()) - scene.origin),
            );
            // A footprint is cut at one height; rooms under slopes reach farther elsewhere.
            let outwards = if room.get("solid").is_some() { f64::INFINITY } else { 0.01 };
            for reach in [plan.min - found.min, found.max - plan.max] {
                for reach in [reach.x, reach.z] {
                    assert!((-0.01..=outwards).contains(&reach), "{file}: {name}: {plan:?} {found:?}");
                }
            }
        }
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn doors_and_windows_are_where_others_found_them() {
    for (file, _, scene, known) in buildings() {
        for kind in ["door", "window", "opening"] {
            let (mut wrong, mut all) = (Vec::new(), 0);
            for opening in list(&known, "doors").iter().filter(|d| d["kind"] == kind) {
                all += 1;
                let id = opening["id"].as_str().unwrap();
                let hint =
                    scene.hints.openings.iter().find(|h| h.id == id).unwrap_or_else(|| panic!("{file}: no {kind} {id}"));
                let off = (middle(&hint.winding) + scene.origin).distance(point(&opening["centre"]));
                let size = size(&hint.winding) - DVec2::new(number(opening, "width"), number(opening, "height"));
                let turned = newell(&hint.winding).normalize().dot(point(&opening["normal"])).abs();
                let thickness = hint.thickness - number(opening, "thickness");
                if off > 0.15 || size.abs().max_element() > 0.1 || turned < 0.999 || thickness.abs() > 0.02 {
                    wrong.push(id);
                }
            }
            // Every one but Duplex's two skylights, whose frames others measured and not the holes below them.
            let excused = if (file, kind) == ("duplex/Duplex_A_20110907", "window") { 2 } else { 0 };
            assert!(wrong.len() <= excused, "{file}: {} of {all} {kind}s are elsewhere: {wrong:?}", wrong.len());
        }
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn virtual_boundaries_are_where_others_found_them() {
    let buildings = buildings();
    let (mut joined, run) = (0, !buildings.is_empty());
    for (file, _, scene, known) in buildings {
        let hints: Vec<&OpeningHint> = scene.hints.openings.iter().filter(|h| h.kind == OpeningKind::Virtual).collect();
        let pair = |h: &OpeningHint| h.rooms.map(|r| r.map(|r| scene.hints.rooms[r].id.clone()));
        for hint in &hints {
            assert!(hint.rooms[0].is_some() && hint.rooms[0] != hint.rooms[1], "{file}: {}", hint.id);
        }
        // Those that others found by rays and not in the file have made-up ids.
        for known in list(&known, "doors").iter().filter(|d| d["kind"] == "virtual") {
            let id = known["id"].as_str().unwrap();
            if id.starts_with("geom_") {
                continue;
            }
            let mut rooms: Vec<_> = list(known, "rooms").iter().map(|r| r.as_str().map(str::to_owned)).collect();
            rooms.sort();
            let found = hints.iter().find(|h| {
                let mut pair = pair(h).to_vec();
                pair.sort();
                pair == rooms && (middle(&h.winding) + scene.origin).distance(point(&known["centre"])) < 0.2
            });
            let found = found.unwrap_or_else(|| panic!("{file}: no virtual boundary near {id} between {rooms:?}"));
            let turned = newell(&found.winding).normalize().dot(point(&known["normal"])).abs();
            assert!(turned > 0.999, "{file}: {id}");
            joined += 1;
        }
    }
    // Ten in Duplex, three in each FZK house, twelve in Office_A.
    assert!(joined == 28 || !run, "{joined}");
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn rooms_of_doors_agree_with_rays() {
    for (file, _, scene, known) in buildings() {
        for door in list(&known, "doors").iter().filter(|d| d["kind"] == "door") {
            let id = door["id"].as_str().unwrap();
            let hint = scene.hints.openings.iter().find(|h| h.id == id).unwrap();
            for room in hint.rooms.into_iter().flatten() {
                let room = &scene.hints.rooms[room].id;
                assert!(list(door, "rooms").iter().any(|r| r == room), "{file}: door {id} doesn't lead to {room}");
            }
        }
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn no_wall_is_left_in_a_doorway() {
    for (file, _, scene, _) in buildings() {
        // Of the real files' structure only the doors' own hosts reach into them, so a few crossings (a ceiling, a stair) may be
        // real; a wall left uncut would stop every ray.
        let mut blocked = 0;
        let doors: Vec<_> = scene.hints.openings.iter().filter(|h| h.kind == OpeningKind::Door).collect();
        for door in &doors {
            let reach = newell(&door.winding).normalize() * (door.thickness / 2.0 + 0.01);
            let (a, b) = (middle(&door.winding) - reach, middle(&door.winding) + reach);
            blocked += usize::from(house::crossings(&scene, Role::Structure, a, b) > 0);
        }
        assert_eq!(blocked, 0, "{file}: of {} doors", doors.len());
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn glass_lets_light_through_and_walls_do_not() {
    for (file, _, scene, _) in buildings() {
        for object in &scene.objects {
            let leaf = matches!(object.role, Role::Door | Role::Window);
            assert!(!(leaf && object.opaque), "{file}: {}", object.node);
        }
        let clear = scene.objects.iter().filter(|o| o.role == Role::Structure && !o.opaque).count();
        // Smiley-West's five canopies are of glass.
        assert_eq!(clear, if file.ends_with("Smiley-West") { 5 } else { 0 }, "{file}");
    }
}

/// Colours are sRGB in the file, and linear here.
#[test]
fn surface_styles_are_materials() {
    for schema in [Schema::Ifc2x3, Schema::Ifc4] {
        let options = ImportOptions { trace: true, ..ImportOptions::default() };
        let house = House { schema, ..House::default() };
        let scene = import_bytes(house.text().into_bytes(), "house", &options).unwrap();
        let trace = scene.trace.unwrap();
        let [glass] = &trace.materials[..] else { panic!("{:?}", trace.materials) };
        let linear = [0.5f32, 0.6, 0.7].map(|x| x.powf(2.2));
        let off = glass.colour.iter().zip([linear[0], linear[1], linear[2], 0.1]).map(|(a, b)| (a - b).abs());
        assert!(glass.name == "Glass" && off.fold(0.0, f32::max) < 1e-6, "{glass:?}");
        // The pane has it, and nothing else.
        for (object, mesh) in scene.objects.iter().zip(&trace.meshes) {
            assert_eq!(trace.looks[*mesh as usize].material.is_some(), object.glass, "{}", object.node);
        }
        assert!(scene.objects.iter().any(|o| o.glass));
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn materials_of_buildings_are_told_apart() {
    let folder = data();
    let options = ImportOptions { trace: true, ..ImportOptions::default() };
    for file in ["webifc-mpl/Office_A_20110811", "duplex/Duplex_A_20110907"] {
        let scene = enfilade_formats::import(&folder.join(format!("{file}.ifc")), &options).unwrap();
        let trace = scene.trace.unwrap();
        let has_look = |mesh: &u32| trace.looks[*mesh as usize].material.is_some();
        let told = trace.meshes.iter().filter(|mesh| has_look(mesh)).count();
        // Most furnishing of the duplex has neither a style nor a material.
        assert!(told * 3 >= 2 * trace.meshes.len(), "{file}: {told} of {} objects", trace.meshes.len());
        let mut colours: Vec<[u32; 4]> = trace.materials.iter().map(|m| m.colour.map(f32::to_bits)).collect();
        colours.sort_unstable();
        colours.dedup();
        println!("{file}: {told} of {} objects have a material, in {} colours", trace.meshes.len(), colours.len());
        assert!(colours.len() >= 8, "{file}: {} colours", colours.len());
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn the_same_on_any_number_of_threads() {
    let folder = data();
    for file in ["webifc-mpl/Office_A_20110811", "duplex/Duplex_A_20110907"] {
        let path = folder.join(format!("{file}.ifc"));
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| enfilade_formats::import(&path, &ImportOptions::default()).unwrap())
        };
        assert!(on(1) == on(5), "{file}");
    }
}

/// What ifc-lite rounds the corners of cut shapes to, metres.
const GRID: f64 = 1.0 / 65536.0;

/// What is known of [`House`], in its own axes: metres, +Z up.
fn check_house(house: &House) {
    let text = house.text();
    let scene = import_bytes(text.into_bytes(), "house", &ImportOptions::default()).unwrap();
    let context = format!("{house:?}");
    // Georeferenced or not, all rounding happens within some metres of the building.
    let near = |a: DVec3, b: DVec3| a.distance(b) < GRID;
    let world = |p: DVec3| scene.origin + p;
    assert_eq!(scene.name, "house");
    assert_eq!(scene.source.up, "+Z");
    assert_eq!(scene.source.format, house.schema.name());
    assert!((scene.source.metres_per_unit - 1.0 / house.units_per_metre).abs() < 1e-15, "{context}");

    // Storey, room.
    let [storey] = &scene.hints.storeys[..] else { panic!("{context}") };
    assert_eq!(storey.name, "Ground");
    assert!((storey.elevation + scene.origin.y - house.at(DVec3::ZERO).y).abs() < 1e-6, "{context}");
    let [room, yard] = &scene.hints.rooms[..] else { panic!("{context}") };
    assert_eq!(
        (room.id.as_str(), room.name.as_str(), room.storey, room.outside),
        ("space-kitchen", "1 Küche", Some(0), false)
    );
    assert_eq!((yard.id.as_str(), yard.storey, yard.outside), ("space-yard", Some(0), true));
    let corners: Vec<DVec3> = room.surface.iter().flatten().map(|&p| world(p)).collect();
    for (x, y, z) in [(0., 0.1, 0.), (6., 0.1, 0.), (6., 3.1, 0.), (0., 3.1, 0.), (0., 0.1, 2.5), (6., 3.1, 2.5)] {
        assert!(corners.iter().any(|&c| near(c, house.at(DVec3::new(x, y, z)))), "{context}: no corner {x} {y} {z}");
    }
    let surface: f64 = room.surface.iter().map(|t| area(t)).sum();
    assert!((surface - (2.0 * 18.0 + 2.0 * 9.0 * 2.5)).abs() < 1e-4, "{context}: {surface}");

    // Openings: kind, centre, width, height.
    let expected = [
        ("door-1", OpeningKind::Door, DVec3::new(1.5, 0., 1.05), 1.0, 2.1),
        ("hole-2", OpeningKind::Opening, DVec3::new(3.0, 0., 1.0), 1.0, 2.0),
        ("window-3", OpeningKind::Window, DVec3::new(4.5, 0., 1.5), 1.0, 1.0),
    ];
    let through: Vec<_> = scene.hints.openings.iter().filter(|o| o.kind != OpeningKind::Virtual).collect();
    assert_eq!(through.len(), expected.len(), "{context}: {through:?}");
    for (id, kind, centre, width, height) in expected {
        let hint = through.iter().find(|h| h.id == id).unwrap_or_else(|| panic!("{context}: no {id}"));
        assert_eq!(hint.kind, kind);
        assert!(near(world(middle(&hint.winding)), house.at(centre)), "{context}: {id}");
        assert!((size(&hint.winding) - DVec2::new(width, height)).abs().max_element() < GRID, "{context}: {id}");
        // ifc-lite rounds the corners of what it cuts to 2^-16 m; a thickness has two sides.
        assert!((hint.thickness - 0.2).abs() < 2.0 * GRID, "{context}: {id} is {} thick", hint.thickness);
        let normal = house.at(DVec3::Y) - house.at(DVec3::ZERO);
        let turned = newell(&hint.winding).normalize().cross(normal).length();
        assert!(turned < GRID, "{context}: {id} is turned by {turned}");
    }
    let door = through.iter().find(|h| h.kind == OpeningKind::Door).unwrap();
    assert_eq!(door.rooms, [Some(0), Some(1)], "{context}");
    // The far side of the kitchen is open towards the yard: drawn by both, wider by the yard.
    let mut open = scene.hints.openings.iter().filter(|o| o.kind == OpeningKind::Virtual);
    let (Some(open), None) = (open.next(), open.next()) else { panic!("{context}") };
    assert_eq!(open.rooms, [Some(0), Some(1)], "{context}");
    assert!(near(world(middle(&open.winding)), house.at(DVec3::new(3., 3.1, 1.25))), "{context}: {open:?}");
    assert!((size(&open.winding) - DVec2::new(6., 2.5)).abs().max_element() < 1e-6, "{context}");

    // Meshes: the wall's surface is known to the last reveal.
    let objects = |node: &str| scene.objects.iter().filter(|o| o.node == node).collect::<Vec<_>>();
    for (node, role, opaque) in [
        ("wall", Role::Structure, true),
        ("door-1", Role::Door, false),
        ("window-3", Role::Window, false),
        ("pane", Role::Window, false),
        ("chair", Role::Furnishing, true),
    ] {
        let found = objects(node);
        assert!(
            !found.is_empty() && found.iter().all(|o| o.role == role && o.opaque == opaque),
            "{context}: {node}: {found:?}"
        );
    }
    assert_eq!(scene.objects.len(), 5, "{context}");
    let wall: f64 = objects("wall").iter().flat_map(|o| o.triangles.clone()).map(|t| area(&scene.corners(t as usize))).sum();
    let sides = 2.0 * (18.0 - 2.1 - 2.0 - 1.0);
    let edges = 6.0 * 0.2 + 4.0 * 0.2 + 2.0 * 3.0 * 0.2;
    let reveals = (2.0 * 2.1 + 1.0) * 0.2 + (2.0 * 2.0 + 1.0) * 0.2 + 4.0 * 0.2;
    assert!((wall - sides - edges - reveals).abs() < 1e-4, "{context}: {wall}");
    let box_of_all = enfilade::geom::Aabb::of((0..scene.triangles.len()).flat_map(|t| scene.corners(t)).map(world));
    let built = [(0., -0.1, 0.), (6., 3.15, 3.)].map(|(x, y, z)| DVec3::new(x, y, z));
    let expected =
        enfilade::geom::Aabb::of((0..8).map(|i| house.at(DVec3::new(built[i & 1].x, built[i >> 1 & 1].y, built[i >> 2].z))));
    // Turned, the corners of the whole needn't be taken by any element.
    if house.degrees == 0.0 {
        assert!(near(box_of_all.min, expected.min) && near(box_of_all.max, expected.max), "{context}: {box_of_all:?}");
    }
}

#[test]
fn the_house_is_read_to_the_number() {
    for schema in [Schema::Ifc2x3, Schema::Ifc4] {
        for units_per_metre in [1.0, 1000.0] {
            for degrees in [0.0, 30.0, 90.0, 217.0] {
                for offset in [DVec3::ZERO, DVec3::new(-3.25, 12.5, 0.75), DVec3::new(3_000_000.25, 4_000_000.5, 120.0)] {
                    check_house(&House { schema, units_per_metre, degrees, offset, ..House::default() });
                }
            }
        }
    }
}

#[test]
fn a_unit_given_by_the_user_overrides_the_files() {
    let house = House { units_per_metre: 1000.0, ..House::default() };
    let options = ImportOptions { metres_per_unit: Some(0.01), ..ImportOptions::default() };
    let scene = import_bytes(house.text().into_bytes(), "house", &options).unwrap();
    assert!((scene.bounds().size() - DVec3::new(60.0, 30.0, 32.5)).abs().max_element() < 1e-4, "{:?}", scene.bounds());
    for bad in [0.0, -1.0, f64::NAN] {
        let options = ImportOptions { metres_per_unit: Some(bad), ..ImportOptions::default() };
        assert!(import_bytes(house.text().into_bytes(), "house", &options).is_err());
    }
}

/// As Revit writes feet: a unit by its name, or by how many of another it is.
#[test]
fn units_that_are_told_by_others_are_read() {
    let metres = House::default();
    let upright = import_bytes(metres.text().into_bytes(), "house", &ImportOptions::default()).unwrap();
    for (name, factor) in [("FOOT", 0.3048), ("Klafter", 1.8965)] {
        let house = House { units_per_metre: 1.0 / factor, ..House::default() };
        let unit = format!(
            "#6=IFCCONVERSIONBASEDUNIT(#8,.LENGTHUNIT.,'{name}',#9);\n#8=IFCDIMENSIONALEXPONENTS(1,0,0,0,0,0,0);\n\
             #9=IFCMEASUREWITHUNIT(IFCLENGTHMEASURE({factor:?}),#16);\n#16=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n"
        );
        let text = house.text().replace("#6=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);\n", &unit);
        let scene = import_bytes(text.into_bytes(), "house", &ImportOptions::default()).unwrap();
        assert_eq!((scene.source.metres_per_unit, &scene.source.notes[..]), (factor, &[][..]), "{name}");
        assert!((scene.bounds().size() - upright.bounds().size()).abs().max_element() < GRID, "{name}");
    }
}

#[test]
fn old_names_of_shapes_are_read() {
    let text = House::default().text();
    let read = |text: String| import_bytes(text.into_bytes(), "house", &ImportOptions::default()).unwrap();
    let old = text.replace("'SweptSolid'", "'FacetedBrep'");
    assert_ne!(old, text);
    assert_eq!(read(old).hash(), read(text).hash());
}

/// Exporters turn depths round, and then an opening stands beside its wall. There is a door for all that, which others may draw open.
#[test]
fn a_door_whose_opening_misses_its_wall_is_cut_and_told() {
    for degrees in [0.0, 30.0] {
        let house = House { degrees, ..House::default() };
        let (sound, turned) = ("#408=IFCCARTESIANPOINT((1.5,0.0,0.0));", "#408=IFCCARTESIANPOINT((1.5,-0.2,0.0));");
        let text = house.text();
        assert!(text.contains(sound));
        let read = |text: String| import_bytes(text.into_bytes(), "house", &ImportOptions::default()).unwrap();
        let (whole, cut) = (read(text.clone()), read(text.replace(sound, turned)));
        let what = "1 openings that the geometry reader left closed are cut into their walls as rectangles: door-1";
        assert!(whole.source.notes.is_empty() && cut.source.notes == [what], "{:?}", cut.source.notes);
        let wall = |scene: &Scene| {
            let wall = scene.objects.iter().find(|o| o.node == "wall").unwrap();
            wall.triangles.clone().map(|t| area(&scene.corners(t as usize))).sum::<f64>()
        };
        // All reveals are there; the foot of the wall stays under the door, and its reveal on that.
        assert!((wall(&cut) - wall(&whole) - 2.0 * 0.2).abs() < 1e-3, "{} {}", wall(&whole), wall(&cut));
        for (x, z) in [(1.05, 0.05), (1.5, 1.0), (1.95, 2.05)] {
            let [a, b] = [-0.2, 0.2].map(|y| house.at(DVec3::new(x, y, z)) - cut.origin);
            assert_eq!(house::crossings(&cut, Role::Structure, a, b), 0, "{degrees}: {x} {z}");
        }
        for (x, z) in [(0.95, 1.0), (2.05, 1.0), (1.5, 2.15)] {
            let [a, b] = [-0.2, 0.2].map(|y| house.at(DVec3::new(x, y, z)) - cut.origin);
            assert_eq!(house::crossings(&cut, Role::Structure, a, b), 2, "{degrees}: {x} {z}");
        }
    }
}

#[test]
fn a_missing_unit_is_noted() {
    let text = House::default().text();
    let without = text.replace("(#6,#7)", "(#6)");
    let scene = import_bytes(without.into_bytes(), "house", &ImportOptions::default()).unwrap();
    assert_eq!(scene.source.notes, ["no unit of angle is given; degrees are assumed"]);
    let without = text.replace("(#6,#7)", "(#7)");
    let scene = import_bytes(without.into_bytes(), "house", &ImportOptions::default()).unwrap();
    assert_eq!(scene.source.notes, ["no unit of length is given; metres are assumed"]);
}

#[test]
fn damage_to_one_element_costs_that_element() {
    let text = House::default().text();
    let whole = import_bytes(text.clone().into_bytes(), "house", &ImportOptions::default()).unwrap();
    assert_eq!(whole.source.notes, Vec::<String>::new());
    let nodes = |s: &Scene| s.objects.iter().map(|o| o.node.clone()).collect::<Vec<_>>();
    // The chair's profile gone, and the chair put beyond the Earth: the rest is as before.
    for (from, to) in [("/*chair*/", "/*chair*/#"), ("/*chair at*/", "/*chair at*/1.E30+")] {
        let damaged = text.replace(from, to);
        assert_ne!(damaged, text);
        let scene = import_bytes(damaged.into_bytes(), "house", &ImportOptions::default()).unwrap();
        assert_eq!(nodes(&scene), ["wall", "door-1", "window-3", "pane"], "{to}");
        assert!(!scene.source.notes.is_empty(), "{to}");
    }
}

#[test]
fn a_data_section_given_twice_adds_nothing() {
    let text = House::default().text();
    let data = &text[text.find("DATA;").unwrap()..text.find("END-ISO").unwrap()];
    let twice = text.replace("END-ISO", &format!("{data}END-ISO"));
    let once = import_bytes(text.clone().into_bytes(), "house", &ImportOptions::default()).unwrap();
    let twice = import_bytes(twice.into_bytes(), "house", &ImportOptions::default()).unwrap();
    assert_eq!(once.hash(), twice.hash());
    assert_eq!(once.hints, twice.hints);
    assert_eq!(twice.source.notes.len(), 1, "{:?}", twice.source.notes);
}

#[test]
fn gross_areas_and_shapeless_spaces_are_no_rooms() {
    let text = House { schema: Schema::Ifc4, ..House::default() }.text().replace(".EXTERNAL.", ".GFA.");
    let scene = import_bytes(text.into_bytes(), "house", &ImportOptions::default()).unwrap();
    assert_eq!(scene.hints.rooms.len(), 1);
    assert_eq!(scene.source.notes, ["1 gross floor areas do not count as rooms"]);
}

#[test]
fn circles_and_chains_end() {
    let text = House::default().text();
    let chain = |from: usize, links: usize, link: &dyn Fn(usize) -> String| -> String {
        (from..from + links).map(|i| format!("#{i}={};\n", link(i + 1))).collect()
    };
    let shape = "IFCSHAPEREPRESENTATION(#10,'Body','SweptSolid',(#703))";
    let map = "#5000=IFCMAPPEDITEM(#5001,#5002);\n#5001=IFCREPRESENTATIONMAP(#11,#702);\n\
               #5002=IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$,#12,$,$);\n";
    let cut = |operand: usize| format!("IFCBOOLEANRESULT(.DIFFERENCE.,#{operand},#803)");
    let cases = [
        // A storey in itself, a solid cut from itself, a map of itself.
        ("'agg-1',$,$,$,#20,(#40)", "'agg-1',$,$,$,#40,(#40)", String::new()),
        (shape, "IFCSHAPEREPRESENTATION(#10,'Body','CSG',(#5000))", format!("#5000={};\n", cut(5000))),
        (shape, "IFCSHAPEREPRESENTATION(#10,'Body','MappedRepresentation',(#5000))", map.to_owned()),
        // A placement and a solid that only end after 50,000 links.
        (
            "#41=IFCLOCALPLACEMENT(#21,",
            "#41=IFCLOCALPLACEMENT(#5000,",
            chain(5000, 50_000, &|next| format!("IFCLOCALPLACEMENT(#{next},#11)")) + "#55000=IFCLOCALPLACEMENT($,#11);\n",
        ),
        (
            shape,
            "IFCSHAPEREPRESENTATION(#10,'Body','CSG',(#5000))",
            chain(5000, 50_000, &cut) + "#55000=IFCBLOCK(#707,1.,1.,1.);\n",
        ),
        ("'Ground'", &format!("{}'Ground'{}", "(".repeat(100_000), ")".repeat(100_000)), String::new()),
    ];
    // A placement relative to itself: nothing has a place, which is an error.
    let circle = text.replace("#41=IFCLOCALPLACEMENT(#21,", "#41=IFCLOCALPLACEMENT(#41,");
    let error = import_bytes(circle.into_bytes(), "house", &ImportOptions::default()).unwrap_err();
    assert!(error.to_string().starts_with("no element's geometry can be read; the first is wall"), "{error}");
    for (from, to, more) in cases {
        assert!(text.contains(from), "{from}");
        let start = Instant::now();
        let text = text.replace(from, to).replace("ENDSEC;\nEND-ISO", &format!("{more}ENDSEC;\nEND-ISO"));
        let scene = import_bytes(text.into_bytes(), "house", &ImportOptions::default());
        let to = &to[..to.len().min(60)];
        // The wall is still there, whatever became of the rest.
        assert!(scene.is_ok_and(|s| s.objects.iter().any(|o| o.node == "wall")), "{to}");
        assert!(start.elapsed() < Duration::from_secs(20), "{to}");
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn a_georeferenced_building_loses_nothing() {
    let folder = data();
    let path = folder.join("duplex/Duplex_A_20110907.ifc");
    let home = enfilade_formats::import(&path, &ImportOptions::default()).unwrap();
    // Every root placement is hung from one that lies 5,000 km away.
    let text: String = std::fs::read(&path).unwrap().into_iter().map(char::from).collect();
    let mut moved = text.replace("IFCLOCALPLACEMENT($,", "IFCLOCALPLACEMENT(#99999990,");
    let end = moved.rfind("ENDSEC;").unwrap();
    moved.insert_str(
        end,
        "#99999990=IFCLOCALPLACEMENT($,#99999991);\n#99999991=IFCAXIS2PLACEMENT3D(#99999992,$,$);\n\
         #99999992=IFCCARTESIANPOINT((3000000.,4000000.,500.));\n",
    );
    assert!(moved.contains("(#99999990,"));
    let bytes = moved.chars().map(|c| c as u8).collect();
    let away = import_bytes(bytes, "Duplex_A_20110907", &ImportOptions::default()).unwrap();
    let by = DVec3::new(3_000_000., 500., -4_000_000.);
    let close = |a: DVec3, b: DVec3| (a + home.origin + by).distance(b + away.origin) < 2.0 * GRID;
    // By element: where a large mesh is cut into objects, rounding moves the cuts. By area: it also decides which triangles have
    // none.
    let elements = |scene: &Scene| {
        let mut elements = BTreeMap::<_, (Aabb, f64, f64)>::new();
        for o in &scene.objects {
            let of = elements.entry((o.node.clone(), format!("{:?}", o.role), o.opaque)).or_insert((Aabb::EMPTY, 0.0, 0.0));
            of.0 = of.0.union(o.bounds);
            for t in o.triangles.clone() {
                let [a, b, c] = scene.corners(t as usize);
                of.1 += area(&[a, b, c]);
                of.2 += a.distance(b) + b.distance(c) + c.distance(a);
            }
        }
        elements
    };
    let (here, there) = (elements(&home), elements(&away));
    assert!(here.keys().eq(there.keys()));
    for (key, (a, here, rims)) in here {
        let (b, there, _) = there[&key];
        assert!((here - there).abs() < GRID * rims, "{key:?}: {here} and {there} square metres");
        assert!(close(a.min, b.min) && close(a.max, b.max), "{key:?}");
    }
    assert_eq!(home.hints.openings.len(), away.hints.openings.len());
    for (a, b) in home.hints.openings.iter().zip(&away.hints.openings) {
        assert_eq!((&a.id, a.kind, a.rooms), (&b.id, b.kind, b.rooms));
        assert!(close(middle(&a.winding), middle(&b.winding)), "{}", a.id);
    }
}

/// As people cut them out of models to show a fault: there are walls, and nobody says in which unit.
#[test]
fn a_part_of_a_model_without_its_project_is_read() {
    let text = House::default().text();
    let whole = import_bytes(text.clone().into_bytes(), "x", &ImportOptions::default()).unwrap();
    let part =
        import_bytes(text.replace("IFCPROJECT(", "IFCPROJEKT(").into_bytes(), "x", &ImportOptions::default()).unwrap();
    assert_eq!((part.triangles.len(), part.bounds()), (whole.triangles.len(), whole.bounds()));
    assert!(part.source.notes.iter().any(|n| n.starts_with("no IFCPROJECT")), "{:?}", part.source.notes);
}

#[test]
fn foreign_cut_and_empty_files_are_refused_with_a_reason() {
    let options = ImportOptions::default();
    let message = |bytes: &[u8]| import_bytes(bytes.to_vec(), "x", &options).unwrap_err().to_string();
    assert_eq!(message(b""), "the file is empty");
    assert!(message(b"glTF\x02\0\0\0").contains("not an IFC file"));
    let text = House::default().text();
    let cut = &text.as_bytes()[..text.len() / 2];
    let lines = cut.iter().filter(|&&b| b == b'\n').count() + 1;
    assert!(message(cut).starts_with(&format!("line {lines}: the file ends before")), "{}", message(cut));
    let header = &text[..text.find("#1=").unwrap()];
    let point = format!("{header}#1=IFCCARTESIANPOINT((0.,0.,0.));\nENDSEC;\nEND-ISO-10303-21;\n");
    assert!(message(point.as_bytes()).contains("no IFCPROJECT and no product"), "{}", message(point.as_bytes()));
    assert!(message(format!("{header}ENDSEC;\nEND-ISO-10303-21;\n").as_bytes()).contains("no records"));
    let bare = text.lines().filter(|l| !l.contains("IFCSHAPEREPRESENTATION(")).collect::<Vec<_>>().join("\n");
    assert!(message(bare.as_bytes()).contains("element"), "{}", message(bare.as_bytes()));
    let small = ImportOptions { max_triangles: 10, ..ImportOptions::default() };
    let refused = import_bytes(text.into_bytes(), "x", &small);
    assert!(matches!(refused, Err(ImportError::TooLarge { limit: 10 })), "{refused:?}");
}

#[test]
fn mutants_neither_panic_nor_hang() {
    let text = House::default().text().into_bytes();
    let body = text.windows(5).position(|w| w == b"DATA;").unwrap();
    let lines: Vec<&[u8]> = text.split_inclusive(|&b| b == b'\n').collect();
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |n: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    let mut mutants: Vec<Vec<u8>> = Vec::new();
    for _ in 0..150 {
        let mut flipped = text.clone();
        for _ in 0..1 + random(3) {
            let at = body + random(text.len() - body);
            flipped[at] = b"0123456789#(),;'.$*=-E\0\xff"[random(24)];
        }
        mutants.push(flipped);
    }
    for skip in 0..lines.len() {
        mutants.push(lines.iter().enumerate().filter(|&(i, _)| i != skip).flat_map(|(_, l)| l.to_vec()).collect());
    }
    for _ in 0..60 {
        // Two lines' tails swapped: references to records of the wrong kind.
        let (a, b) = (random(lines.len()), random(lines.len()));
        let number = |l: &[u8]| l.iter().position(|&c| c == b'=').map_or(0, |p| p + 1);
        let swapped = lines.iter().enumerate().flat_map(|(i, l)| match i {
            _ if i == a => [&lines[a][..number(lines[a])], &lines[b][number(lines[b])..]].concat(),
            _ if i == b => [&lines[b][..number(lines[b])], &lines[a][number(lines[a])..]].concat(),
            _ => l.to_vec(),
        });
        mutants.push(swapped.collect());
    }
    let (mut read, mut refused) = (0, 0);
    for mutant in mutants {
        let start = Instant::now();
        match import_bytes(mutant.clone(), "mutant", &ImportOptions::default()) {
            Ok(_) => read += 1,
            Err(_) => refused += 1,
        }
        assert!(start.elapsed() < Duration::from_secs(40), "{}", String::from_utf8_lossy(&mutant));
    }
    assert!(read > 100 && refused > 5, "{read} read, {refused} refused");
}

/// A zip archive with these files, deflated, as its specification (APPNOTE) lays it out.
fn archive(files: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in files {
        let mut deflated = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::best());
        deflated.write_all(bytes).unwrap();
        let (deflated, mut crc) = (deflated.finish().unwrap(), flate2::Crc::new());
        crc.update(bytes);
        let word = |n: usize| (n as u32).to_le_bytes();
        // Version, flags, method, time, date; checksum, sizes, length of the name, of what is extra.
        let sizes = [crc.sum().to_le_bytes(), word(deflated.len()), word(bytes.len()), word(name.len())].concat();
        let head = [&[20, 0, 0, 0, 8, 0, 0, 0, 0x21, 0][..], &sizes].concat();
        directory.extend([&b"PK\x01\x02\x14\0"[..], &head, &[0; 10], &word(out.len()), name.as_bytes()].concat());
        out.extend([&b"PK\x03\x04"[..], &head, name.as_bytes(), &deflated].concat());
    }
    let (start, count) = (out.len() as u32, files.len() as u8);
    out.extend(&directory);
    out.extend([&b"PK\x05\x06\0\0\0\0"[..], &[count, 0, count, 0], &(directory.len() as u32).to_le_bytes()].concat());
    out.extend([&start.to_le_bytes()[..], &[0; 2]].concat());
    out
}

#[test]
fn zipped_files_are_read_as_what_is_in_them() {
    let folder = crate::cli::folder("ifczip");
    let text = House::default().text();
    let (plain, zipped) = (folder.join("house.ifc"), folder.join("house.ifcZIP"));
    std::fs::write(&plain, &text).unwrap();
    let options = ImportOptions::default();
    let of_zip = |bytes: &[u8]| {
        std::fs::write(&zipped, bytes).unwrap();
        enfilade_formats::import(&zipped, &options)
    };
    let scene = of_zip(&archive(&[("read me.txt", b"a house"), ("model/House.IFC", text.as_bytes())])).unwrap();
    assert_eq!(scene, enfilade_formats::import(&plain, &options).unwrap());

    let good = archive(&[("house.ifc", text.as_bytes())]);
    let mut other = good.clone();
    other[40] ^= 0x55;
    for (bytes, why) in [
        (text.as_bytes(), "not a zip archive"),
        (&archive(&[("house.txt", text.as_bytes())]), "no .ifc file in the archive"),
        (&other, "archive"),
        (
            &archive(&[("house.ifc", &vec![b' '; 10_000_000])]),
            "its .ifc file is more than 200 times larger than the archive",
        ),
    ] {
        let error = of_zip(bytes).unwrap_err().to_string();
        assert!(error.contains(why) && !error.contains('\n'), "{error}");
    }
}
