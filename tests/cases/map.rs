//! Cases of maps and levels.

use super::{case, passes};
use crate::cli::{done, enfilade, folder, json};
use enfilade::cells::{CellGraph, SplitOptions, Strategy, split};
use enfilade::file::PvsFile;
use enfilade::math::geom::Plane;
use enfilade::scene::{ImportError, ImportOptions, Leaves, Mesh, Role, Scene, SceneBuilder, Source};
use enfilade_formats::import;
use enfilade_levels::prt::read_prt;
use enfilade_levels::quake::import_map_bytes;
use glam::DVec3;
use serde_json::Value;
use std::path::{Path, PathBuf};
use testing::bakes;
use testing::map::{block, entity, shell, start, two_rooms};
use testing::meshes::area_of_all;

/// What a map of a case becomes.
fn imported(path: &Path) -> Result<Scene, ImportError> {
    import(path, &ImportOptions::default())
}

/// Its cells, before any are joined.
fn cells(scene: &Scene) -> CellGraph {
    split(scene, &SplitOptions::default()).unwrap()
}

/// Cells and portals of a map, and that its leaves are the cells.
#[track_caller]
fn closed(path: &Path) -> [usize; 2] {
    let graph = cells(&imported(path).unwrap());
    assert_eq!(graph.strategy, Strategy::Leaves, "{}", path.display());
    assert!(graph.cells.iter().all(|cell| !cell.open), "{}", path.display());
    [graph.cells.len(), graph.portals.len()]
}

/// A file of few rays.
fn baked(scene: &Scene) -> PvsFile {
    bakes::baked(scene, bakes::with_rays(20_000))
}

/// The files of a folder with an extension, by name.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.retain(|path| path.extension().is_some_and(|e| e == extension));
    found.sort();
    assert!(!found.is_empty());
    found
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_30_map_dialects() {
    let folder = case("30_map_dialects");
    let base = imported(&folder.join("base.map")).unwrap();
    let graph = cells(&base);
    for path in files(&folder, "map") {
        let scene = imported(&path).unwrap();
        let of = cells(&scene);
        let counts = [(&of, &scene), (&graph, &base)].map(|(g, s)| (g.cells.len(), g.portals.len(), s.triangles.len()));
        assert_eq!(counts[0], counts[1], "{}", path.display());
        assert!((area_of_all(&scene) - area_of_all(&base)).abs() < 1e-9, "{}", path.display());
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_31_map_tb_omit() {
    let folder = case("31_map_tb_omit");
    assert_eq!(closed(&folder.join("omit.map")), [1, 0]);
    assert_eq!(closed(&folder.join("omit_detail.map"))[0], 7);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_32_map_origin() {
    let folder = case("32_map_origin");
    for map in ["origin", "func_wall", "start_in_wall", "start_on_floor"] {
        assert_eq!(closed(&folder.join(map).with_extension("map"))[0], 7, "{map}");
    }
    // A light outside of all walls is a way out, to compilers, too.
    let scene = imported(&folder.join("light_outside.map")).unwrap();
    assert_eq!(scene.hints.leak.as_ref().map(|leak| leak.entity.as_str()), Some("light"));
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_33_map_door_and_case_36_map_far() {
    for map in ["33_map_door", "36_map_far"].iter().flat_map(|folder| files(&case(folder), "map")) {
        assert_eq!(closed(&map)[0], 7, "{}", map.display());
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_34_map_fence() {
    let folder = case("34_map_fence");
    for map in files(&folder, "map") {
        assert_eq!(closed(&map)[0], 7, "{}", map.display());
        let scene = imported(&map).unwrap();
        assert!(
            scene.objects.iter().any(|object| object.glass || !object.opaque),
            "{}: nothing is seen through",
            map.display()
        );
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_35_map_broken() {
    let folder = case("35_map_broken");
    for (map, left_out) in
        [("inside_out", true), ("zero_volume", true), ("tiny", true), ("dup_plane", false), ("hairgap", false)]
    {
        let path = folder.join(map).with_extension("map");
        closed(&path);
        let notes = imported(&path).unwrap().source.notes;
        assert_eq!(notes.iter().any(|note| note.contains("without a volume left out")), left_out, "{map}: {notes:?}");
    }
    // Gaps that level compilers close; narrower holes leak where somebody says so.
    for (map, narrower) in [("gap001", 1e-4), ("gap02", 1e-3)] {
        let path = folder.join(map).with_extension("map");
        closed(&path);
        let scene = imported(&path).unwrap();
        let told = scene.source.notes.iter().any(|note| note.contains("lead outside and are closed (--smallest-hole)"));
        assert!(told, "{map}: {:?}", scene.source.notes);
        passes(&baked(&scene), &scene);
        let strict = ImportOptions { smallest_hole: Some(narrower), ..ImportOptions::default() };
        assert!(import(&path, &strict).unwrap().hints.leak.is_some(), "{map}");
    }
}

/// What is wider than a compiler's portal leaks unless somebody says that it is none, and a file says how its map was read.
#[test]
fn a_gap_of_a_unit_is_closed_if_asked_for() {
    // A wall at x 0 that stops a unit short of the ceiling.
    let mut walls = shell([0, 0, 0], [128, 128, 128], "brick").split_off(1);
    walls.push(block([-8, -8, -8], [0, 136, 127], "brick"));
    walls.push(block([-8, -8, 128], [0, 136, 136], "brick"));
    let text = entity("worldspawn", "", &walls) + &start("64 64 24");
    let leaks = |smallest_hole: Option<f64>| {
        let options = ImportOptions { smallest_hole, ..ImportOptions::default() };
        import_map_bytes(text.as_bytes(), "map", &options).unwrap().hints.leak.is_some()
    };
    assert_eq!([leaks(None), leaks(Some(0.9 / 32.0)), leaks(Some(1.0 / 32.0))], [true, true, false]);
    let folder = folder("gap");
    let [map, file] = ["gap.map", "gap.pvs"].map(|name| folder.join(name));
    std::fs::write(&map, &text).unwrap();
    done(&enfilade!("bake", "--smallest-hole", "0.04", "--rays", "20k", "-o", &file, &map));
    done(&enfilade!("check", "--rays", "20k", "--model", &map, &file));
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_37_map_q3() {
    let folder = case("37_map_q3");
    let error = imported(&folder.join("brushdef.map")).unwrap_err().to_string();
    assert!(error.contains("brushDef is of Quake 3 and not supported"), "{error}");
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_38_map_sky() {
    let folder = case("38_map_sky");
    for map in files(&folder, "map") {
        let scene = imported(&map).unwrap();
        let file = baked(&scene);
        let [cells, portals] = [file.cells.len(), file.portals.len()];
        assert_eq!([cells, portals], [2, 0], "{}", map.display());
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_40_prt() {
    let folder = case("40_prt");
    let refused = ["count_less", "count_more", "degenerate", "hl", "leaf_out", "nan", "self", "two_points"];
    let all = files(&folder, "prt");
    for path in &all {
        let found = read_prt(&std::fs::read(path).unwrap());
        assert_eq!(
            found.is_err(),
            refused.iter().any(|name| path.file_stem().is_some_and(|stem| stem == *name)),
            "{}",
            path.display()
        );
    }
    assert_eq!(all.len(), 9 + refused.len());
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_62_rim() {
    let folder = case("62_rim");
    for path in files(&folder, "map").into_iter().take(2) {
        let scene = imported(&path).unwrap();
        passes(&baked(&scene), &scene);
    }
}

/// Leaves without end are parted by their planes also where nothing is drawn any more: here two metres above a floor.
#[test]
fn case_63_tiny_bsp() {
    let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
    let positions = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, z)| DVec3::new(x, 0.0, z)).to_vec();
    let (node, triangles) = ("floor".into(), vec![[0, 2, 1], [0, 3, 2]]);
    builder.add(Mesh { node, role: Role::Structure, opaque: true, positions, triangles }).unwrap();
    let plane = |n: DVec3, d: f64| Plane { n, d };
    let floor = plane(-DVec3::Y, 0.0);
    let leaves = vec![vec![floor, plane(DVec3::Y, 2.0)], vec![floor, plane(-DVec3::Y, -2.0)], vec![floor.flipped()]];
    builder.hints.leaves = Some(Leaves { leaves, portals: Vec::new(), walls: Vec::new(), shutters: Vec::new() });
    let scene = builder.finish("floor").unwrap();
    let graph = cells(&scene);
    assert_eq!((graph.cells.len(), graph.cells[0].pieces.len(), graph.cells[0].open), (1, 3, true));
    passes(&baked(&scene), &scene);
}

/// A gap of 4 mm between two walls, of which one is drawn, as seen from the gap: the other one is bare, though triangles lie that near to it.
#[test]
fn the_far_wall_of_a_gap_is_not_the_near_one() {
    let wall = |x: f64| [(0., 0.), (0., 500.), (500., 500.), (500., 0.)].map(|(z, y)| DVec3::new(x, y, z)).to_vec();
    let backwards = |mut wall: Vec<DVec3>| {
        wall.reverse();
        wall
    };
    let [left, right] = [backwards(wall(0.0)), wall(0.004)];
    for (drawn, bare) in [(vec![left.clone()], 1), (vec![right.clone()], 1), (vec![left.clone(), right.clone()], 0)] {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        for positions in drawn.iter().cloned() {
            let triangles = vec![[0, 1, 2], [0, 2, 3]];
            builder.add(Mesh { node: "wall".into(), role: Role::Structure, opaque: true, positions, triangles }).unwrap();
        }
        let far = [(DVec3::NEG_Y, 0.0), (DVec3::Y, 500.0), (DVec3::NEG_Z, 0.0), (DVec3::Z, 500.0)];
        let gap = far.into_iter().chain([(DVec3::NEG_X, 0.0), (DVec3::X, 0.004)]).map(|(n, d)| Plane { n, d }).collect();
        let walls = vec![left.clone(), right.clone()];
        builder.hints.leaves = Some(Leaves { leaves: vec![gap], portals: Vec::new(), walls, shutters: Vec::new() });
        let scene = builder.finish("gap").unwrap();
        assert!(scene.tolerance().clearance > 0.004, "{}", scene.tolerance().clearance);
        assert_eq!(cells(&scene).closed_holes.len(), bare, "{} drawn", drawn.len());
    }
}

#[test]
fn case_64_unsealed_map() {
    let folder = folder("unsealed");
    let [map, points, file] = ["open.map", "open.pts", "open.pvs"].map(|name| folder.join(name));
    // Two rooms without a roof, as maps of engines that close nothing.
    let mut walls = two_rooms();
    walls.remove(5);
    std::fs::write(&map, entity("worldspawn", "", &walls) + &start("64 64 24")).unwrap();
    for cells in ["auto", "plan", "bsp"] {
        let report = json(&enfilade!("bake", "--cells", cells, "--rays", "20k", "--json", "-o", &file, &map));
        assert!(report["open_cells"].as_u64() >= Some(1), "{cells}: {report}");
        let is_told = |note: &Value| {
            note.as_str()
                .is_some_and(|n| n.starts_with("the map leaks: the path out from info_player_start at (64 64 24) is"))
        };
        assert!(report["notes"].as_array().unwrap().iter().any(is_told), "{cells}: {report}");
        // The way out, as editors load it.
        let text = std::fs::read_to_string(&points).unwrap();
        let lines: Vec<Vec<f64>> = text.lines().map(|l| l.split(' ').map(|w| w.parse().unwrap()).collect()).collect();
        assert!(
            lines.len() > 2
                && lines.iter().all(|p| p.len() == 3)
                && text.starts_with(
                    "64 64 24
"
                )
        );
        done(&enfilade!("check", "--rays", "20k", "--model", &map, &file));
        [&file, &points].into_iter().for_each(|path| std::fs::remove_file(path).unwrap());
    }
}
