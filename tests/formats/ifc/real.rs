//! Real buildings, against what others wrote down about them.

use super::{GRID, size};
use enfilade::math::geom::{Aabb, area, middle, newell};
use enfilade::scene::{ImportOptions, OpeningHint, OpeningKind, Role, RoomHint, Scene};
use enfilade_formats::ifc::import_bytes;
use glam::{DVec2, DVec3};
use serde_json::Value;
use std::collections::BTreeMap;
use testing::bakes;
use testing::data::data;
use testing::house;

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

fn bounds(room: &RoomHint) -> enfilade::math::geom::Aabb {
    enfilade::math::geom::Aabb::of(room.surface.iter().flatten().copied())
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
            let plan = enfilade::math::geom::Aabb::of(
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
        let on = |threads| bakes::on(threads, || enfilade_formats::import(&path, &ImportOptions::default()).unwrap());
        assert!(on(1) == on(5), "{file}");
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
