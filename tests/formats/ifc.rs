//! IFC import against what others wrote down about the same files (`*.rooms.json`), and against a house small enough to know
//! every number of it.
#![cfg(feature = "ifc")]

mod damage;
mod real;
mod zipped;

use enfilade::math::geom::{area, middle, newell};
use enfilade::scene::{ImportOptions, OpeningKind, Role, Scene};
use enfilade_formats::ifc::import_bytes;
use glam::{DVec2, DVec3};
use testing::house;
use testing::house::{House, Schema};
use testing::meshes::area_of;

/// Horizontal and vertical extent of a winding in an upright plane; of others, of its first two sides.
fn size(winding: &[DVec3]) -> DVec2 {
    let height = winding.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max)
        - winding.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    if newell(winding).normalize().y.abs() > 0.1 {
        return DVec2::new(winding[0].distance(winding[1]), winding[1].distance(winding[2]));
    }
    DVec2::new(area(winding) / height, height)
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

/// What ifc-lite rounds the corners of cut shapes to, metres.
const GRID: f64 = 1.0 / 65536.0;

/// What is known of [`House`], in its own axes: metres, +Z up.
fn check_house(house: &House) {
    let text = house.text();
    let scene = import_bytes(text.into_bytes(), "house", &ImportOptions::default()).unwrap();
    let context = format!("{house:?}");
    assert_eq!(scene.name, "house");
    assert_eq!(scene.source.up, "+Z");
    assert_eq!(scene.source.format, house.schema.name());
    assert!((scene.source.metres_per_unit - 1.0 / house.units_per_metre).abs() < 1e-15, "{context}");
    check_rooms(house, &scene, &context);
    check_openings(house, &scene, &context);
    check_meshes(house, &scene, &context);
}

/// Georeferenced or not, all rounding happens within some metres of the building.
fn near(a: DVec3, b: DVec3) -> bool {
    a.distance(b) < GRID
}

/// The storey, the kitchen and the yard.
fn check_rooms(house: &House, scene: &Scene, context: &str) {
    let [storey] = &scene.hints.storeys[..] else { panic!("{context}") };
    assert_eq!(storey.name, "Ground");
    assert!((storey.elevation + scene.origin.y - house.at(DVec3::ZERO).y).abs() < 1e-6, "{context}");
    let [room, yard] = &scene.hints.rooms[..] else { panic!("{context}") };
    assert_eq!(
        (room.id.as_str(), room.name.as_str(), room.storey, room.outside),
        ("space-kitchen", "1 Küche", Some(0), false)
    );
    assert_eq!((yard.id.as_str(), yard.storey, yard.outside), ("space-yard", Some(0), true));
    let corners: Vec<DVec3> = room.surface.iter().flatten().map(|&p| scene.origin + p).collect();
    for (x, y, z) in [(0., 0.1, 0.), (6., 0.1, 0.), (6., 3.1, 0.), (0., 3.1, 0.), (0., 0.1, 2.5), (6., 3.1, 2.5)] {
        assert!(corners.iter().any(|&c| near(c, house.at(DVec3::new(x, y, z)))), "{context}: no corner {x} {y} {z}");
    }
    let surface: f64 = room.surface.iter().map(|t| area(t)).sum();
    assert!((surface - (2.0 * 18.0 + 2.0 * 9.0 * 2.5)).abs() < 1e-4, "{context}: {surface}");
}

/// The door, the hole, the window, and the open side of the kitchen.
fn check_openings(house: &House, scene: &Scene, context: &str) {
    let world = |p: DVec3| scene.origin + p;
    // Kind, centre, width, height.
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
}

/// The wall's surface is known to the last reveal.
fn check_meshes(house: &House, scene: &Scene, context: &str) {
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
    let wall: f64 = objects("wall").iter().map(|o| area_of(scene, o)).sum();
    let sides = 2.0 * (18.0 - 2.1 - 2.0 - 1.0);
    let edges = 6.0 * 0.2 + 4.0 * 0.2 + 2.0 * 3.0 * 0.2;
    let reveals = (2.0 * 2.1 + 1.0) * 0.2 + (2.0 * 2.0 + 1.0) * 0.2 + 4.0 * 0.2;
    assert!((wall - sides - edges - reveals).abs() < 1e-4, "{context}: {wall}");
    let box_of_all =
        enfilade::math::geom::Aabb::of((0..scene.triangles.len()).flat_map(|t| scene.corners(t)).map(|p| scene.origin + p));
    let built = [(0., -0.1, 0.), (6., 3.15, 3.)].map(|(x, y, z)| DVec3::new(x, y, z));
    let expected = enfilade::math::geom::Aabb::of(
        (0..8).map(|i| house.at(DVec3::new(built[i & 1].x, built[i >> 1 & 1].y, built[i >> 2].z))),
    );
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
        let what = "1 openings are cut into their walls as rectangles, since the geometry reader left them closed: door-1";
        assert!(whole.source.notes.is_empty() && cut.source.notes == [what], "{:?}", cut.source.notes);
        let wall = |scene: &Scene| area_of(scene, scene.objects.iter().find(|o| o.node == "wall").unwrap());
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
fn gross_areas_and_shapeless_spaces_are_no_rooms() {
    let text = House { schema: Schema::Ifc4, ..House::default() }.text().replace(".EXTERNAL.", ".GFA.");
    let scene = import_bytes(text.into_bytes(), "house", &ImportOptions::default()).unwrap();
    assert_eq!(scene.hints.rooms.len(), 1);
    assert_eq!(scene.source.notes, ["1 gross floor areas do not count as rooms"]);
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
