//! Quake levels as scenes: faces as triangles, leaves as cells.

use enfilade::bake::BakeOptions;
use enfilade::cells::{PortalKind, SplitOptions, Strategy, split};
use enfilade::file::PvsFile;
use enfilade::scene::{ImportOptions, Role, Scene};
use enfilade_formats::import;
use enfilade_levels::quake::import_bytes;
use enfilade_measure::verify::{CheckOptions, check};
use glam::DVec3;
use testing::bakes::{self, with_rays};
use testing::quake::{AIR, FENCE, Face, Layout, SOLID, WATER, bsp, grated_room, leaf, node, three_rooms, with_faces};

use crate::cli::{done, enfilade, folder, refused};

/// A rectangle across an axis, seen from its greater side or from its smaller one.
fn rectangle(axis: usize, at: f32, min: [f32; 2], max: [f32; 2], from_above: bool) -> Vec<[f32; 3]> {
    let corner = |u: f32, v: f32| {
        let mut p = [at; 3];
        (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
        p
    };
    let mut corners = vec![corner(min[0], min[1]), corner(max[0], min[1]), corner(max[0], max[1]), corner(min[0], max[1])];
    if !from_above {
        corners.reverse();
    }
    corners
}

/// The inside of a box, but for its two ends along x.
fn tube(leaf: usize, min: [f32; 3], max: [f32; 3], texture: &'static str) -> Vec<Face> {
    let side = |axis: usize, at: f32, from_above: bool| {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        Face { corners: rectangle(axis, at, [min[u], min[v]], [max[u], max[v]], from_above), texture, leaf }
    };
    vec![side(1, min[1], true), side(1, max[1], false), side(2, min[2], true), side(2, max[2], false)]
}

/// The end of a room: a wall across x, with a hole of 2 x 2 in its middle where there is a door.
fn end(leaf: usize, x: f32, faces_east: bool, door: bool, texture: &'static str) -> Vec<Face> {
    let part = |min: [f32; 2], max: [f32; 2]| Face { corners: rectangle(0, x, min, max, faces_east), texture, leaf };
    match door {
        false => vec![part([-2.0, -2.0], [2.0, 2.0])],
        true => vec![
            part([-2.0, -2.0], [-1.0, 2.0]),
            part([1.0, -2.0], [2.0, 2.0]),
            part([-1.0, -2.0], [1.0, -1.0]),
            part([-1.0, 1.0], [1.0, 2.0]),
        ],
    }
}

/// The outside of a box.
pub(super) fn block(min: [f32; 3], max: [f32; 3], texture: &'static str) -> Vec<Face> {
    let sides = (0..3).flat_map(|axis| [(axis, false), (axis, true)]);
    let side = |(axis, above): (usize, bool)| {
        let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        let at = if above { max[axis] } else { min[axis] };
        Face { corners: rectangle(axis, at, [min[u], min[v]], [max[u], max[v]], above), texture, leaf: 0 }
    };
    sides.map(side).collect()
}

/// The inside of three rooms in a row along x, and of the passages between; the first room's end is sky.
pub(super) fn the_inside() -> Vec<Face> {
    let passage = |leaf: usize, x: f32| tube(leaf, [x, -1.0, -1.0], [x + 1.0, 1.0, 1.0], "metal");
    let room = |leaf: usize, from: f32, to: f32| tube(leaf, [from, -2.0, -2.0], [to, 2.0, 2.0], "brick");
    let parts = [
        room(5, 0.0, 4.0),
        room(3, 5.0, 9.0),
        room(1, 10.0, 14.0),
        passage(4, 4.0),
        passage(2, 9.0),
        end(5, 0.0, true, false, "Sky1"),
        end(5, 4.0, false, true, "brick"),
        end(3, 5.0, true, true, "brick"),
        end(3, 9.0, false, true, "brick"),
        end(1, 10.0, true, true, "brick"),
        end(1, 14.0, false, false, "brick"),
    ];
    parts.into_iter().flatten().collect()
}

/// A door stands in the first passage, a crate that may move in the second room, a trigger in the second passage.
fn rooms(last: i32) -> Vec<u8> {
    let models = vec![
        the_inside(),
        block([4.25, -1.0, -1.0], [4.75, 1.0, 1.0], "wood"),
        block([6.0, -2.0, -2.0], [7.0, -1.0, -1.0], "crate"),
        block([9.0, -1.0, -1.0], [10.0, 1.0, 1.0], "trigger"),
    ];
    let entities = "{\n\"classname\" \"worldspawn\"\n}\n{\n\"classname\" \"func_door\"\n\"model\" \"*1\"\n}\n\
                    {\n\"model\" \"*2\"\n\"classname\" \"func_wall\"\n}\n{\n\"classname\" \"trigger_once\"\n\"model\" \"*3\"\n}\n";
    with_faces(&bsp(&three_rooms(last), Layout::default()), &models, entities)
}

fn scene(file: Vec<u8>) -> Scene {
    import_bytes(file, "level", &ImportOptions::default()).unwrap()
}

fn baked(scene: &Scene, rays: u64) -> PvsFile {
    bakes::baked(scene, with_rays(rays))
}

#[test]
fn faces_are_objects_by_leaf_and_texture() {
    let scene = scene(rooms(AIR));
    let of = |node: &str| scene.objects.iter().filter(|o| o.node == node).collect::<Vec<_>>();
    // Four sides and an end with a hole, two triangles a rectangle.
    let brick = of("leaf 5/brick");
    assert_eq!((brick.len(), brick[0].triangles.len(), brick[0].role, brick[0].opaque), (1, 16, Role::Structure, true));
    let sky = of("leaf 5/sky1");
    assert_eq!((sky[0].triangles.len(), sky[0].opaque), (2, true));
    let (door, crate_) = (of("func_door *1"), of("func_wall *2"));
    assert_eq!((door[0].triangles.len(), door[0].role, door[0].opaque, door[0].glass), (12, Role::Door, false, false));
    assert_eq!((crate_[0].role, crate_[0].opaque, crate_[0].glass), (Role::Furnishing, false, false));
    assert!(scene.objects.iter().all(|o| !o.node.contains("trigger")));
    // (x, y, z) of 1/32 m is (x, z, -y): the crate stands at y = -2..-1, z = -2..-1.
    let least = crate_[0].bounds.min + scene.origin;
    assert_eq!(least * 32.0, DVec3::new(6.0, -2.0, 1.0));
    // Normals point to where a face is seen from: the floor's up, the sky's into the room.
    let normal = |t: u32| {
        let [a, b, c] = scene.corners(t as usize);
        (b - a).cross(c - a).normalize()
    };
    assert_eq!(normal(sky[0].triangles.start), DVec3::X);
    assert!(brick[0].triangles.clone().any(|t| normal(t) == DVec3::Y && scene.corners(t as usize)[0].y < 0.0));
    let units = ImportOptions { metres_per_unit: Some(1.0), ..ImportOptions::default() };
    let large = import_bytes(rooms(AIR), "level", &units).unwrap();
    assert!((large.bounds().size() / scene.bounds().size() - 32.0).abs().max_element() < 1e-9);
}

#[test]
fn leaves_are_cells_and_doors_are_shut() {
    // A unit is a metre, so that the door is as large as doors are.
    let options = ImportOptions { metres_per_unit: Some(1.0), ..ImportOptions::default() };
    for last in [AIR, WATER] {
        let scene = import_bytes(rooms(last), "level", &options).unwrap();
        let graph = split(&scene, &SplitOptions::default()).unwrap();
        assert_eq!((graph.strategy, graph.cells.len(), graph.portals.len()), (Strategy::Leaves, 5, 4));
        let names: Vec<&str> = graph.cells.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["leaf 1", "leaf 2", "leaf 3", "leaf 4", "leaf 5"]);
        // A cuboid has six planes.
        assert!(graph.cells.iter().all(|c| !c.open && c.pieces.len() == 1 && c.pieces[0].planes.len() == 6));
        let doors: Vec<_> = graph.portals.iter().filter(|p| p.kind == PortalKind::Door).collect();
        assert!(!doors.is_empty() && doors.iter().all(|p| p.cells.contains(&enfilade::CellId(3))));
        assert!(doors.iter().all(|p| p.state.shut && p.state.closable && p.source.as_deref() == Some("func_door *1")));
        // The doorways are in line: with all doors open, every room sees every room; the crate hides nothing.
        let file = baked(&scene, 200_000);
        let options = CheckOptions { rays: 100_000, views: 4, ..CheckOptions::default() };
        let report = check(&file, &scene, &options).unwrap();
        assert!(report.passed, "{report:?}");
        assert!(file.cell_rows.is_none());
    }
}

#[test]
fn walls_that_are_not_drawn_end_a_leaf() {
    // The third room's far end is of a texture that isn't drawn: no triangle, and nothing is seen through it.
    let file = rooms(AIR);
    let skipped = |file: Vec<u8>| {
        let at = file.windows(5).position(|w| w == b"Sky1\0").unwrap();
        let mut file = file;
        file[at..at + 5].copy_from_slice(b"skip\0");
        file
    };
    let scene = scene(skipped(file));
    assert!(scene.objects.iter().all(|o| !o.node.contains("skip") && !o.node.contains("sky")));
    let file = baked(&scene, 200_000);
    assert_eq!(file.closed_holes.len(), 1);
    let report = check(&file, &scene, &CheckOptions { rays: 100_000, views: 0, ..CheckOptions::default() }).unwrap();
    assert_eq!((report.missed_rays, report.missed_segments, report.structure.count), (0, 0, 0));
    // The notes tell it from what the user closes.
    let notes = bakes::baked(&scene, BakeOptions { smallest_hole: Some(1e-6), ..with_rays(0) }).notes;
    assert!(notes.iter().any(|n| n == "1 walls are not drawn, in part or whole; they count as opaque"), "{notes:?}");
    assert!(notes.iter().any(|n| n.starts_with("no portal is narrower")), "{notes:?}");
}

#[test]
fn a_face_that_is_missing_hides_as_the_tree_says() {
    // Without one of the four parts of a wall of the second room: 2 x 1 units.
    let mut faces = the_inside();
    let part = faces.iter().rposition(|f| f.leaf == 3 && f.corners.iter().all(|c| c[0] == 9.0)).unwrap();
    faces.remove(part);
    let entities = "{\n\"classname\" \"worldspawn\"\n}\n";
    let scene = scene(with_faces(&bsp(&three_rooms(AIR), Layout::default()), &[faces], entities));
    let file = baked(&scene, 200_000);
    let area =
        |w: &Vec<glam::Vec3>| enfilade::math::geom::area(&w.iter().map(|p| p.as_dvec3()).collect::<Vec<_>>()) * 32.0 * 32.0;
    let bare: f64 = file.closed_holes.iter().map(area).sum();
    assert!((bare - 2.0).abs() < 1e-3, "{bare}");
    let report = check(&file, &scene, &CheckOptions { rays: 100_000, views: 0, ..CheckOptions::default() }).unwrap();
    assert_eq!((report.missed_rays, report.missed_segments, report.structure.count), (0, 0, 0));
}

#[test]
fn what_is_no_face_is_left_out_and_what_is_too_deep_is_refused() {
    // Faces of none, two and three corners, the last on one line: nothing of them is drawn, and nothing is missing.
    let line = [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
    let mut faces: Vec<Face> =
        [0, 2, 3].into_iter().map(|n| Face { corners: line[..n].to_vec(), texture: "brick", leaf: 1 }).collect();
    faces.extend(the_inside());
    let entities = "{\n\"classname\" \"worldspawn\"\n}\n";
    let scene = scene(with_faces(&bsp(&three_rooms(AIR), Layout::default()), &[faces], entities));
    assert!(baked(&scene, 1000).closed_holes.is_empty());

    let deep = (0..1100).fold(leaf(AIR), |below, i| node(0, i as f32 * 0.01, leaf(SOLID), below));
    let said = import_bytes(bsp(&deep, Layout::default()), "level", &ImportOptions::default()).unwrap_err().to_string();
    assert_eq!(said, "lump nodes, entry 1025: is more than 1024 deep in the tree");
}

#[test]
fn damage_is_named_by_lump_and_entry() {
    let file = rooms(AIR);
    let offset = |lump: usize| u32::from_le_bytes(file[4 + 8 * lump..8 + 8 * lump].try_into().unwrap()) as usize;
    let fault = |at: usize, bytes: &[u8]| {
        let mut file = file.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        import_bytes(file, "level", &ImportOptions::default()).unwrap_err().to_string()
    };
    let model = file.windows(2).position(|w| w == b"*3").unwrap();
    for (at, bytes, what) in [
        (offset(7) + 8, &[255, 255][..], "lump faces, entry 0: ends beyond the "),
        (offset(7) + 10, &[9, 0], "lump faces, entry 0: its texture info 9 doesn't exist"),
        (offset(6) + 32, &[99, 0], "lump texture infos, entry 0: its texture 99 doesn't exist"),
        (offset(13), &[255, 255, 0, 0], "lump faces, entry 0: its edge 65535 doesn't exist"),
        (offset(12) + 4, &[255, 255, 255, 255], "lump faces, entry 0: its vertex 65535 doesn't exist"),
        (offset(14) + 60, &[255, 255, 0, 0], "lump models, entry 0: its faces end at 65535, but there are "),
        (offset(10) + 28 + 22, &[255, 255], "lump leaves, entry 1: its mark surfaces go beyond the "),
        (offset(11), &[255, 255], "lump leaves, entry 1: its face 65535 doesn't exist"),
        (model, b"*9", "lump entities, entry 3: its model *9 doesn't exist"),
        (offset(3) + 4, &f32::NAN.to_le_bytes(), "lump vertices, entry 0: is not within 1e7 of the origin"),
        (offset(0), b"x", "lump entities, entry 0: doesn't begin with {"),
    ] {
        let said = fault(at, bytes);
        assert!(said.starts_with(what) && !said.contains('\n'), "{said} / {what}");
    }
}

#[test]
fn commands_take_levels_and_refuse_what_is_none() {
    let folder = folder("level_scene");
    let level = folder.join("rooms.bsp");
    std::fs::write(&level, rooms(AIR)).unwrap();
    let file = level.with_extension("pvs");
    let baked = enfilade!("bake", &level, "--rays", "10k");
    done(&baked);
    let said = String::from_utf8_lossy(&baked.stdout).into_owned();
    assert!(said.contains("5 cells (0 open), 4 portals, by leaves: the level's own"), "{said}");
    for command in ["check", "walk"] {
        done(&enfilade!(command, &file, "--model", &level));
    }
    let office = folder.join("office.glb");
    done(&enfilade!("generate", "office", "--rooms", "4", "-o", &office));
    refused(&enfilade!("bake", &office, "--cells", "leaves"), &["has no leaves, only a .bsp"]);
}

/// What a grating on a solid brush hides, the `.prt` beside the level tells.
#[test]
fn gratings_hide_what_they_hid_from_the_compiler() {
    let folder = folder("level_gratings");
    let (level, prt, file) = (folder.join("grate.bsp"), folder.join("grate.prt"), folder.join("grate.pvs"));
    std::fs::write(&level, grated_room(SOLID)).unwrap();
    let bake = || enfilade!("bake", &level, "-o", &file);
    refused(&bake(), &["grate.bsp: 2 faces", "{...", ".prt"]);
    // Of another level: its portal is elsewhere.
    let portal_at = |x: &str| format!("PRT1\n3\n1\n4 1 2 ({x} -2 -2) ({x} -2 2) ({x} 2 2) ({x} 2 -2)\n");
    std::fs::write(&prt, portal_at("7")).unwrap();
    refused(&bake(), &["grate.bsp: 2 faces"]);
    std::fs::write(&prt, portal_at("2")).unwrap();
    done(&bake());

    let scene = import(&level, &ImportOptions::default()).unwrap();
    assert!(scene.objects.iter().all(|o| o.opaque) && scene.source.notes.iter().any(|n| n.starts_with("2 faces")));
    let graph = split(&scene, &SplitOptions::default()).unwrap();
    assert_eq!((graph.cells.len(), graph.portals.len()), (3, 1));

    // With a leaf behind it nothing needs to be told, and nothing is hidden.
    std::fs::remove_file(&prt).unwrap();
    let scene = import_bytes(grated_room(FENCE), "fence", &ImportOptions::default()).unwrap();
    assert!(scene.objects.iter().all(|o| !o.opaque) && scene.source.notes.is_empty());
    let graph = split(&scene, &SplitOptions::default()).unwrap();
    assert_eq!((graph.cells.len(), graph.portals.len()), (4, 3));
}

/// Rows of leaves, against the exact rows of the same portals.
#[test]
#[cfg(feature = "full")]
fn rows_of_a_real_level_hold_what_is_seen_and_little_more() {
    use enfilade::job::Job;
    use enfilade_levels::bsp::Bsp;
    use enfilade_levels::{VisOptions, vis};
    use qbsp::prelude::*;
    use testing::data::data;

    let folder = data();
    let bytes = std::fs::read(folder.join("quake-id-gpl/dm4.bsp")).unwrap();
    let theirs = BspData::parse(BspParseInput { bsp: &bytes, lit: None, settings: BspParseSettings::default() }).unwrap();
    let level = Bsp::read(bytes.clone()).unwrap();
    let exact = vis(&level.level().unwrap().level, &VisOptions::default(), None, &Job::quiet()).unwrap();
    let scene = scene(bytes);
    // The world's faces have the area that another reader gives them, whatever corners on their edges add to the fans.
    let world = &theirs.models[0];
    let faces = &theirs.faces[world.first_face as usize..(world.first_face + world.num_faces) as usize];
    let area = |f: &qbsp::data::BspFace| {
        let edges = &theirs.surface_edges[f.first_edge as usize..][..f.num_edges.0 as usize];
        let vertex = |&e: &i32| {
            let edge = theirs.edges[e.unsigned_abs() as usize];
            theirs.vertices[if e < 0 { edge.b.0 } else { edge.a.0 } as usize].to_array().map(f64::from)
        };
        enfilade::math::geom::area(&edges.iter().map(|e| DVec3::from_array(vertex(e))).collect::<Vec<_>>())
    };
    let expected: f64 = faces.iter().map(area).sum();
    let structure = scene.objects.iter().filter(|o| o.role == Role::Structure);
    let triangles = structure.flat_map(|o| o.triangles.clone());
    let found: f64 = triangles.map(|t| enfilade::math::geom::area(&scene.corners(t as usize))).sum::<f64>() * 32.0 * 32.0;
    assert!((found - expected).abs() < 1e-4 * expected, "{found} of {expected}");

    // Each leaf a cell.
    let file = bakes::baked(&scene, BakeOptions { clusters: Some(0.0), ..with_rays(500_000) });
    let leaf = |cell: usize| file.cells[cell].name.strip_prefix("leaf ").unwrap().parse::<usize>().unwrap() - 1;
    let rows = file.cell_rows.as_ref().unwrap();
    let (mut seen, mut hidden_but_kept) = (0, 0);
    for a in 0..file.cells.len() {
        for b in 0..file.cells.len() {
            if exact.lower.get(leaf(a), leaf(b)) {
                seen += 1;
                assert!(rows.get(a, b), "leaf {} sees leaf {}", leaf(a), leaf(b));
            } else {
                hidden_but_kept += usize::from(rows.get(a, b));
            }
        }
    }
    assert!(20 * hidden_but_kept <= seen, "{hidden_but_kept} hidden pairs beside {seen}");
    let report = check(&file, &scene, &CheckOptions { rays: 300_000, views: 4, ..CheckOptions::default() }).unwrap();
    assert!(report.passed, "{report:?}");
    assert_eq!((report.missed_rays, report.missed_segments, report.structure.count), (0, 0, 0));
}
