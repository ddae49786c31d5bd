//! Cases of glTF and OBJ: a corridor with eight rooms, a statue and a desk in each, and what exporters make of such a building.

use super::{case, passes};
use enfilade::file::PvsFile;
use enfilade::scene::{ImportOptions, Role, Scene};
use enfilade_formats::import;
use std::collections::BTreeSet;
use std::path::Path;
use testing::bakes;

/// A model of a case.
fn read(path: &Path) -> Scene {
    import(path, &ImportOptions::default()).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Its file, by few rays, which passes the check.
#[track_caller]
fn baked(scene: &Scene) -> PvsFile {
    let file = bakes::baked(scene, bakes::with_rays(50_000));
    passes(&file, scene);
    file
}

/// Cells, those of them that are open, and portals.
fn counts(file: &PvsFile) -> [usize; 3] {
    [file.cells.len(), file.cells.iter().filter(|cell| cell.open).count(), file.portals.len()]
}

/// Names of what the closed cell sees that sees most.
fn corridor(file: &PvsFile) -> BTreeSet<&str> {
    let rows = file.object_rows.as_ref().unwrap();
    let closed = (0..file.cells.len()).filter(|&cell| !file.cells[cell].open);
    let cell = closed.max_by_key(|&cell| rows.count_row(cell)).unwrap();
    rows.ones(cell).map(|object| file.objects[object].node.as_str()).collect()
}

/// How many statues and desks there are among names.
fn statues(names: &BTreeSet<&str>) -> [usize; 2] {
    ["statue", "desk"].map(|what| names.iter().filter(|name| name.starts_with(what)).count())
}

/// The building that all others are made of, as every reading of it must be: ten cells and all statues in the corridor's row.
#[track_caller]
fn is_as_base(scene: &Scene) -> PvsFile {
    let file = baked(scene);
    assert_eq!(counts(&file), [10, 1, 9], "{}: {:?}", scene.name, scene.source.notes);
    assert_eq!(statues(&corridor(&file)), [8, 8], "{}: {:?}", scene.name, scene.source.notes);
    file
}

/// Cases that are read as if nothing were the matter with them.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn cases_that_are_as_the_base() {
    for (folder, models) in [
        ("00_base", &["base.glb", "base.obj"][..]),
        ("01_mirrored", &["mirrored.glb", "each.glb"]),
        ("02_utm", &["utm.obj", "utm_node.glb", "utm_f32.glb"]),
        ("04_turned", &["turned33.glb"]),
        // Walls as sheets, with triangles on both sides or on one.
        ("06_thin", &["thin_two.glb", "thin_one.glb", "thin_one.obj"]),
        ("12_obj", &["negative.obj", "continued.obj", "concave.obj", "crlf.obj", "bom.obj"]),
        ("17_hollow", &["hollow.glb"]),
        ("20_matrix", &["matrix.glb"]),
        ("22_quantised", &["quant.glb"]),
    ] {
        models.iter().for_each(|model| _ = is_as_base(&read(&case(folder).join(model))));
    }
}

/// Cases whose objects are others, and whose cells are those of the base.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn cases_with_the_cells_of_the_base() {
    // One object of all, without a name for any; copies of one mesh.
    for (folder, model) in
        [("12_obj", "merged.obj"), ("16_one_mesh", "one.glb"), ("16_one_mesh", "soup.glb"), ("21_instancing", "inst.glb")]
    {
        assert_eq!(counts(&baked(&read(&case(folder).join(model)))), [10, 1, 9], "{model}");
    }
}

fn has_note(scene: &Scene, text: &str) -> bool {
    scene.source.notes.iter().any(|note| note.contains(text))
}

/// Whatever the unit: ten cells, and a note that names it where it isn't a metre.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_03_units() {
    let folder = case("03_units");
    for (model, name, unit) in [
        ("cm.glb", "centimetres", "cm"),
        ("inch.glb", "inches", "inch"),
        ("mm.glb", "millimetres", "mm"),
        ("tiny.glb", "kilometres", "km"),
    ] {
        let file = is_as_base(&read(&folder.join(model)));
        assert!(
            file.notes.iter().any(|note| note.contains(name) && note.contains(&format!("--unit {unit}"))),
            "{model}: {:?}",
            file.notes
        );
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_04_turned() {
    let folder = case("04_turned");
    let file = is_as_base(&read(&folder.join("lean1.glb")));
    assert!(file.notes.iter().any(|note| note.contains("tilted by 1.00 degrees")), "{:?}", file.notes);
    let lying = folder.join("zup.obj");
    assert!(has_note(&read(&lying), "--up z"));
    let upright = import(&lying, &ImportOptions { z_up: true, ..ImportOptions::default() }).unwrap();
    is_as_base(&upright);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_05_duplicates() {
    let folder = case("05_duplicates");
    let file = baked(&read(&folder.join("dup.glb")));
    assert_eq!((counts(&file), statues(&corridor(&file))), ([10, 1, 9], [16, 16]), "everything is there twice");
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_07_broken() {
    let folder = case("07_broken");
    is_as_base(&read(&folder.join("degenerate.glb")));
    let scene = read(&folder.join("nan.glb"));
    assert!(has_note(&scene, "not a finite number"), "{:?}", scene.source.notes);
    baked(&scene);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_08_skinned() {
    let folder = case("08_skinned");
    let scene = read(&folder.join("skinned.glb"));
    let body = scene.objects.iter().find(|o| o.node == "Body").unwrap();
    let height = body.bounds.size().y;
    assert!((1.7..=1.9).contains(&height) && !body.opaque, "{height} m");
    is_as_base(&scene);
    // Engines draw this banner ten metres and more outside, wherever its node is.
    let scene = read(&folder.join("banner.glb"));
    let banner = scene.objects.iter().find(|o| o.node == "Banner").unwrap();
    let house = scene.objects.iter().find(|o| o.node == "floor").unwrap();
    assert!(!banner.bounds.touches(&house.bounds), "{:?}", banner.bounds);
    is_as_base(&scene);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_09_animated_door() {
    let folder = case("09_animated_door");
    let scene = read(&folder.join("animated.glb"));
    let leaves: Vec<_> = scene.objects.iter().filter(|o| o.node.starts_with("Cube.")).collect();
    assert_eq!(leaves.len(), 8);
    for leaf in leaves {
        let reach = leaf.reach.unwrap();
        assert!(!leaf.opaque && reach.size().z > leaf.bounds.size().z + 0.5, "{reach:?}: it swings into a room");
    }
    assert!(has_note(&scene, "8 meshes are animated"), "{:?}", scene.source.notes);
    is_as_base(&scene);
    let file = baked(&read(&folder.join("named.glb")));
    assert_eq!(statues(&corridor(&file)), [8, 8]);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_10_colliders() {
    let folder = case("10_colliders");
    for (model, name) in [("decentraland.glb", "doorway0_collider"), ("godot.glb", "blocker0-colonly")] {
        let scene = read(&folder.join(model));
        assert!(has_note(&scene, &format!("8 meshes are not drawn by engines, by name or extras ({name}, ")));
        let file = is_as_base(&scene);
        // They stay objects that rows list.
        assert!(corridor(&file).contains(name));
        assert!(scene.objects.iter().all(|o| !o.node.starts_with(&name[..7]) || o.role == Role::Helper && !o.opaque));
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_11_names() {
    let folder = case("11_names");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "gltf" || e == "obj") {
            let file = baked(&read(&path));
            // In Latin 1 the statues have another name.
            assert_eq!((counts(&file), statues(&corridor(&file))[1]), ([10, 1, 9], 8), "{}", path.display());
            count += 1;
        }
    }
    assert_eq!(count, 8);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_13_lod() {
    let folder = case("13_lod");
    is_as_base(&read(&folder.join("msft.glb")));
    let scene = read(&folder.join("lod_solid.glb"));
    let file = is_as_base(&scene);
    // The coarse walls have no doorways; they hide nothing, and are drawn wherever the fine ones are.
    let id = |name: &str| scene.objects.iter().position(|o| o.node == name).unwrap();
    let (fine, coarse) = (id("corr_s.0_LOD0"), id("corr_s_LOD2"));
    assert!(scene.objects[fine].opaque && !scene.objects[coarse].opaque);
    let rows = file.object_rows.as_ref().unwrap();
    assert!((0..file.cells.len()).all(|cell| rows.get(cell, fine) == rows.get(cell, coarse)));
    baked(&read(&folder.join("lod.glb")));
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_14_alpha() {
    let folder = case("14_alpha");
    is_as_base(&read(&folder.join("babylon3155.glb")));
    let scene = read(&folder.join("alpha.glb"));
    assert!(scene.objects.iter().any(|o| o.opaque));
    baked(&scene);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_15_gaps() {
    let folder = case("15_gaps");
    for model in ["gap2mm.glb", "gap20mm.glb", "gap120mm.glb"] {
        let file = baked(&read(&folder.join(model)));
        // Gaps are portals, too.
        assert_eq!((&counts(&file)[..2], statues(&corridor(&file))), (&[10, 1][..], [8, 8]), "{model}");
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_18_sky() {
    let folder = case("18_sky");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "glb") {
            let scene = read(&path);
            let file = baked(&scene);
            assert_eq!(counts(&file)[0], 10, "{}: {:?}", path.display(), scene.source.notes);
            // Notes of the scene are among those of the file.
            assert!(!file.notes.iter().any(|note| note.contains("metres")), "{:?}", file.notes);
        }
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_19_names_room() {
    let folder = case("19_names_room");
    let scene = read(&folder.join("names.glb"));
    assert_eq!(scene.objects.iter().filter(|o| o.node.ends_with("-portal")).count(), 8, "statues are drawn");
    assert!(
        scene.hints.openings.is_empty() && has_note(&scene, "8 meshes are named as portals"),
        "{:?}",
        scene.source.notes
    );
    baked(&scene);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_23_stair() {
    let folder = case("23_stair");
    assert_eq!(counts(&baked(&read(&folder.join("stair.glb"))))[..2], [21, 1]);
}
