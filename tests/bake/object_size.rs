//! How large objects are: splitting afterwards is importing with a limit, and what is chosen costs least.

use crate::cli::{building, done, enfilade, folder, text};
use enfilade::bake::{BakeOptions, DRAW_CALL, ObjectSizes, size_objects};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::scene::{ImportOptions, Role, Scene, SceneBuilder, Source, split_objects};
use enfilade_formats::import;
use glam::dvec3 as v;
use std::path::Path;
use testing::meshes::{Triangle, cuboid, soup};
use testing::rooms;

/// So many stools of 12 triangles, in both rooms by turns.
fn stools(count: usize) -> Vec<Triangle> {
    let stool = |i: usize| {
        let (room, place) = (i % 2, i / 2);
        let at = v(0.3 + 4.2 * room as f64 + 0.3 * (place % 10) as f64, 0.0, 0.3 + 0.3 * (place / 10) as f64);
        cuboid(at, at + v(0.2, 0.4, 0.2))
    };
    (0..count).flat_map(stool).collect()
}

/// The two rooms, with so many stools that are one mesh.
fn house(count: usize) -> Scene {
    let options = ImportOptions { object_triangles: u32::MAX, ..ImportOptions::default() };
    let mut builder = SceneBuilder::new(&options, Source::default());
    for (i, wall) in rooms::house().iter().enumerate() {
        builder.add(soup(&format!("wall {i}"), Role::Structure, true, wall)).unwrap();
    }
    if count > 0 {
        builder.add(soup("stools", Role::Furnishing, true, &stools(count))).unwrap();
    }
    builder.finish("house").unwrap()
}

#[test]
fn splitting_afterwards_is_importing_with_a_limit() {
    for model in ["villa_rotonda.glb", "office.glb"] {
        let read = |object_triangles: u32| {
            let options = ImportOptions { object_triangles, trace: true, ..ImportOptions::default() };
            import(&building(model), &options).unwrap()
        };
        let whole = read(u32::MAX);
        for limit in [1, 16, 100, 256] {
            assert!(split_objects(whole.clone(), limit) == read(limit), "{model}: {limit}");
        }
        assert!(split_objects(whole.clone(), u32::MAX) == whole);
    }
}

/// A scene with objects of the chosen size, and the sizes tried.
fn sized(scene: Scene, options: &mut BakeOptions, keep_whole: bool) -> (Scene, ObjectSizes) {
    let (scene, sizes) = size_objects(scene, options, keep_whole, &Job::quiet()).unwrap();
    (scene, sizes.expect("sizes are tried"))
}

#[test]
fn a_mesh_that_fills_two_rooms_is_split_and_small_ones_are_not() {
    let mut options = BakeOptions::default();
    let (scene, sizes) = sized(house(120), &mut options, false);
    let limit = sizes.best.most_triangles.expect("stools of the other room needn't be drawn");
    assert_eq!((options.import.object_triangles, scene.objects.len()), (limit, sizes.best.objects));
    assert!(scene.objects.iter().all(|object| object.triangles.len() <= limit as usize));
    let cost = |triangles: f64, calls: f64| triangles + DRAW_CALL * calls;
    assert!(sizes.best.cost() < sizes.whole.cost());
    assert_eq!(sizes.best.cost(), cost(sizes.best.triangles, sizes.best.draw_calls));
    // From wherever one sees a stool, all 1440 triangles of them are drawn.
    assert!(sizes.best.triangles < 0.5 * sizes.whole.triangles, "{sizes:?}");
    let graph = options.given.as_ref().unwrap();
    assert!(
        graph.notes.iter().any(|note| note.contains(&format!("split to at most {limit} triangles"))),
        "{:?}",
        graph.notes
    );
    // They stay whole, where that is asked for; what it costs is told.
    let mut options = BakeOptions::default();
    let (kept, told) = sized(house(120), &mut options, true);
    assert!(kept == house(120) && told == sizes && options.import.object_triangles == u32::MAX);
    assert!(options.given.unwrap().notes.iter().any(|note| note.contains("--object-triangles whole")));
    // Nothing larger than a wall of twelve triangles.
    let mut options = BakeOptions::default();
    let (scene, sizes) = sized(house(0), &mut options, false);
    assert!(scene == house(0) && sizes.best.most_triangles.is_none());
}

/// Whoever draws a whole house wherever he sees a corner of it finds that its walls hide nothing.
#[test]
fn a_house_that_is_one_mesh_has_its_rooms() {
    let options = ImportOptions { object_triangles: u32::MAX, ..ImportOptions::default() };
    let mut builder = SceneBuilder::new(&options, Source::default());
    let mut all: Vec<Triangle> = rooms::house().concat();
    all.extend(stools(60));
    builder.add(soup("house", Role::Unknown, true, &all)).unwrap();
    let scene = builder.finish("house").unwrap();
    let mut options = BakeOptions::default();
    let (_, sizes) = sized(scene, &mut options, false);
    let graph = options.given.as_ref().unwrap();
    let closed = graph.cells.iter().filter(|cell| !cell.open).count();
    assert!(closed == 2 && graph.portals.len() == 1, "{closed} rooms, {} portals: {}", graph.portals.len(), graph.reason);
    assert!(sizes.best.triangles < 0.8 * sizes.whole.triangles, "{sizes:?}");
}

#[test]
fn a_bake_chooses_and_its_file_says_how_its_model_is_read() {
    let folder = folder("chosen");
    let model = building("villa_rotonda.glb");
    let bake = |name: &str, flags: &[&str]| {
        let file = folder.join(name);
        let mut words = vec!["bake", text(&model), "-o", text(&file), "--rays", "20k"];
        words.extend(flags);
        done(&crate::cli::run_words(&words));
        PvsFile::load(&file).unwrap()
    };
    let [chosen, whole, given] =
        [bake("a.pvs", &[]), bake("b.pvs", &["--object-triangles", "whole"]), bake("c.pvs", &["--object-triangles", "100"])];
    assert_eq!((whole.import.object_triangles, given.import.object_triangles), (u32::MAX, 100));
    for file in [&chosen, &whole, &given] {
        let options = file.import.options();
        assert_eq!(import(&model, &options).unwrap().hash(), file.model_hash);
    }
    done(&enfilade!("check", &folder.join("a.pvs"), "--model", &model, "--rays", "50k"));
    let refused = enfilade!("bake", &model, "--object-triangles", Path::new("0"));
    assert_eq!(refused.status.code(), Some(2));
}
