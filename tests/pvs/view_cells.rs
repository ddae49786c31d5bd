//! View cells: against exact answers (`exact/` in the data folder; its README says how they were found), against the cells of a
//! building, and on the command line.

use crate::cli::{self, enfilade};
use enfilade::BitMatrix;
use enfilade::bake::{BakeOptions, Baked, bake};
use enfilade::cells::{ViewCell, read_view_cells, undivided};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::math::geom::Aabb;
use enfilade::pvs::view_cells::ViewRows;
use enfilade::pvs::{Guarantee, PvsOptions};
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use glam::DVec3;
use serde_json::Value;
use std::path::Path;
use testing::bakes::{self, with_rays};
use testing::data;
use testing::meshes::{obj, scene, solid};
use testing::rooms::three_yards;

fn baked(scene: &Scene, view_cells: Vec<ViewCell>, rays: u64) -> (Baked, ViewRows) {
    let options = BakeOptions { keep_bounds: true, view_cells, ..with_rays(rays) };
    let baked = bake(scene, options, &Job::quiet()).unwrap();
    let views = baked.views.clone().expect("view cells were given");
    assert_eq!(views.lower.first_outside(&views.upper), None);
    assert_eq!(views.contradictions, 0);
    (baked, views)
}

/// Every witness begins in its view cell and ends on its object, give or take a rounding.
fn assert_witnesses(scene: &Scene, views: &[ViewCell], rows: &ViewRows) {
    let pairs = (0..rows.lower.rows()).flat_map(|v| rows.lower.ones(v).map(move |object| (v, object)));
    let mut count = 0;
    for ((v, object), [from, to]) in pairs.zip(&rows.witnesses) {
        assert!(views[v].pieces.iter().any(|piece| piece.contains(*from, 1e-9)), "view cell {v}, object {object}");
        assert!(scene.objects[object].bounds.inflated(1e-9).contains(*to), "view cell {v}, object {object}");
        count += 1;
    }
    assert_eq!((count, rows.witnesses.len() as u64), (rows.witnesses.len(), rows.lower.count_ones()));
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn both_bounds_hold_on_every_scene_with_an_exact_answer() {
    let data = data::data();
    let scenes = ["two_rooms", "rooms3x3", "keyhole", "random_boxes", "slit_possible", "slit_barely_visible", "l_corridors"];
    for name in scenes {
        let folder = data.join("exact").join(name);
        let text = |file: &str| std::fs::read_to_string(folder.join(file)).unwrap();
        let scene = import(&folder.join("scene.obj"), &ImportOptions::default()).unwrap();
        let views = read_view_cells(&text("cells.json"), &scene).unwrap();
        let (_, rows) = baked(&scene, views.clone(), 2_000_000);
        assert_witnesses(&scene, &views, &rows);
        // An object of the scene may have been imported as several.
        let of = |matrix: &BitMatrix, view: usize, object: u64| {
            let node = format!("object_{object}");
            let mut ids = (0..scene.objects.len()).filter(|&o| scene.objects[o].node == node).peekable();
            assert!(ids.peek().is_some(), "{name}: no {node}");
            ids.any(|o| matrix.get(view, o))
        };
        let exact: Value = serde_json::from_str(&text("exact.json")).unwrap();
        let (mut pairs, mut undecided, mut visible) = (0, 0, 0);
        for pair in exact["pairs"].as_array().unwrap() {
            let [cell, object] = ["cell", "object"].map(|key| pair[key].as_u64().unwrap());
            let view = views.iter().position(|v| v.id == cell.into()).unwrap();
            let (lower, upper) = (of(&rows.lower, view, object), of(&rows.upper, view, object));
            match pair["visible"].as_bool() {
                Some(false) => assert!(!lower, "{name}: view cell {cell}, object {object} is hidden"),
                Some(true) if pair["marginal"] != true => {
                    assert!(upper, "{name}: view cell {cell}, object {object} is visible");
                }
                _ => {}
            }
            (pairs, undecided) = (pairs + 1, undecided + u32::from(upper && !lower));
            visible += u32::from(upper && !lower && pair["visible"] == true);
        }
        assert!(undecided * 2 < pairs, "{name}: {undecided} of {pairs} pairs are undecided");
        eprintln!("{name}: {undecided} of {pairs} pairs undecided, {visible} of them visible");
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn a_cell_given_as_a_view_cell_sees_what_the_cell_sees() {
    let model = cli::building("villa_rotonda.glb");
    let scene = import(&model, &ImportOptions::default()).unwrap();
    let cells = bakes::baked(&scene, with_rays(0)).cells;
    // The first three closed ones, as the file has them.
    let plane = |n: glam::DVec3, d: f64| serde_json::json!([n.x, n.y, n.z, d + n.dot(scene.origin)]);
    let closed: Vec<usize> = (0..cells.len()).filter(|&c| !cells[c].open).take(3).collect();
    let given = closed.iter().map(|&c| {
        let pieces: Vec<Value> = cells[c]
            .pieces
            .iter()
            .map(|planes| planes.iter().map(|p| plane(p.truncate().as_dvec3(), f64::from(p.w))).collect::<Vec<_>>())
            .map(|planes| serde_json::json!({ "planes": planes }))
            .collect();
        serde_json::json!({ "id": c, "pieces": pieces })
    });
    let json = serde_json::json!({ "cells": given.collect::<Vec<_>>() }).to_string();
    let views = read_view_cells(&json, &scene).unwrap();
    let (baked, rows) = baked(&scene, views.clone(), 2_000_000);
    assert_witnesses(&scene, &views, &rows);
    assert!(rows.in_no_cell.is_empty());
    let bounds = baked.file.bounds.unwrap();
    for (v, &c) in closed.iter().enumerate() {
        // One truth lies between both: what one side proves visible, the other can't have proven hidden.
        let outside = |a: &[u64], b: &[u64]| a.iter().zip(b).any(|(a, b)| a & !b != 0);
        assert!(!outside(rows.lower.row(v), bounds.objects_upper.row(c)), "view cell of cell {c}");
        assert!(!outside(bounds.objects_lower.row(c), rows.upper.row(v)), "cell {c}");
        assert!(rows.lower.count_row(v) > 0 && rows.upper.count_row(v) < scene.objects.len() as u64, "cell {c}");
    }
}

#[test]
fn view_cells_by_cost_part_three_yards_under_one_sky() {
    let scene = scene(three_yards().iter().map(|(name, min, max)| solid(name, *min, *max)));
    let options = |bytes: u64| BakeOptions {
        given: Some(undivided(&scene)),
        view_cell_bytes: Some(bytes),
        pvs: PvsOptions { rows_from: Guarantee::Sampled, ray_budget: 4_000_000, ..PvsOptions::default() },
        ..BakeOptions::default()
    };
    let baked = bake(&scene, options(64 << 10), &Job::quiet()).unwrap();
    let found = baked.partition.unwrap();
    assert!(!found.full && found.views.len() >= 3, "{found}");
    // Disjoint, and who walks is in one of them.
    let boxes: Vec<Aabb> = found.views.iter().map(|view| view.pieces[0].bounds).collect();
    for (x, z) in (0..60).flat_map(|x| (0..20).map(move |z| (f64::from(x) + 0.5, f64::from(z) + 0.5))) {
        assert!(boxes.iter().any(|b| b.contains(DVec3::new(x, 0.8, z) - scene.origin)), "({x}, {z})");
    }
    for (i, a) in boxes.iter().enumerate() {
        let apart = |b: &Aabb| a.min.max(b.min).cmpge(a.max.min(b.max)).any();
        assert!(boxes[..i].iter().all(apart), "view cell {i} overlaps another");
    }
    // Each split saves triangles and costs bytes; the walls are where it pays.
    assert!(found.curve.windows(2).all(|w| w[0].0 < w[1].0 && w[0].1 > w[1].1), "{:?}", found.curve);
    let all: u64 = scene.objects.iter().map(|o| o.triangles.len() as u64).sum();
    let (first, last) = (found.curve[0].1, found.curve.last().unwrap().1);
    assert!(first > 0.95 * all as f64 && last < 0.5 * all as f64, "{first} and {last} of {all}");
    // Who stands in a yard, under its walls, sees the pebbles of that yard: his row holds them, and none from behind two walls.
    let pebbles = |yard: usize| -> Vec<usize> {
        (0..scene.objects.len()).filter(|&o| scene.objects[o].node == format!("pebble of yard {yard}")).collect()
    };
    for yard in 0..3 {
        let eye = DVec3::new(20.0 * yard as f64 + 10.0, 0.8, 10.0) - scene.origin;
        let view = boxes.iter().position(|b| b.contains(eye)).unwrap();
        let row = baked.file.view_row(view).unwrap();
        assert!(pebbles(yard).iter().all(|o| row[o / 64] >> (o % 64) & 1 == 1), "yard {yard}");
        let beyond = (0..3usize).filter(|other| other.abs_diff(yard) == 2).flat_map(pebbles);
        assert_eq!(beyond.filter(|o| row[o / 64] >> (o % 64) & 1 == 1).count(), 0, "two walls from yard {yard}");
    }
    // With fewer bytes there are fewer, and the note says why.
    let few = bake(&scene, options(200), &Job::quiet()).unwrap();
    assert!(few.partition.as_ref().is_some_and(|few| few.full && few.views.len() < found.views.len()));
    assert!(few.file.notes.iter().any(|note| note.ends_with("the bytes are used up")), "{:?}", few.file.notes);
}

/// A box of 6 x 3 x 4 m with a wall at x = 3 that has no door, its outside 0.2 m off, as an OBJ file.
fn two_closed_rooms(folder: &Path) -> std::path::PathBuf {
    let boxes = [
        ("floor", [-0.2, -0.2, -0.2], [6.2, 0.0, 4.2]),
        ("ceiling", [-0.2, 3.0, -0.2], [6.2, 3.2, 4.2]),
        ("west", [-0.2, -0.1, -0.2], [0.0, 3.1, 4.2]),
        ("east", [6.0, -0.1, -0.2], [6.2, 3.1, 4.2]),
        ("south", [-0.1, -0.1, -0.2], [6.1, 3.1, 0.0]),
        ("north", [-0.1, -0.1, 4.0], [6.1, 3.1, 4.2]),
        ("middle", [2.9, -0.1, -0.1], [3.1, 3.1, 4.1]),
        ("chair", [1.0, 0.0, 1.0], [1.4, 0.4, 1.4]),
        ("table", [4.5, 0.0, 1.0], [5.0, 0.7, 1.6]),
    ];
    let path = folder.join("rooms.obj");
    std::fs::write(&path, obj(&boxes.map(|(name, min, max)| (name.to_owned(), min, max)))).unwrap();
    path
}

#[test]
fn the_command_keeps_view_cells_and_lists_them() {
    let folder = cli::folder("keeps");
    let model = two_closed_rooms(&folder);
    let views = folder.join("views.json");
    let other =
        r#"{"id": 7, "min": [3.5, 1, 1], "max": [4, 2, 3]}, {"id": "stone", "min": [2.95, 1, 1], "max": [3.05, 2, 2]}"#;
    std::fs::write(&views, format!(r#"{{"cells": [{WEST}, {other}]}}"#)).unwrap();
    let out = folder.join("rooms.pvs");
    let bake = |threads: &str| {
        let report = cli::json(&enfilade!(
            "bake",
            "--view-cells",
            &views,
            "--rays",
            "500k",
            "--rows",
            "both",
            "--json",
            "--threads",
            threads,
            "-o",
            &out,
            &model
        ));
        (report, std::fs::read(&out).unwrap())
    };
    let ((report, one), (_, two)) = (bake("1"), bake("2"));
    assert!(one == two, "one and two threads give different bytes");
    assert_eq!((&report["view_cells"]["count"], &report["view_cells"]["in_no_cell"]), (&3.into(), &1.into()));

    let dump = cli::json(&enfilade!("dump", &out, "--json"));
    let ids: Vec<&Value> = dump["view_cells"].as_array().unwrap().iter().map(|v| &v["id"]).collect();
    assert_eq!(serde_json::json!(ids), serde_json::json!(["west room", 7, "stone"]));
    assert_eq!(dump["view_cells"][0]["pieces"][0]["planes"].as_array().unwrap().len(), 6);
    let names = |rows: &Value, view: usize| -> Vec<String> {
        let ids = rows["view_cells"][view].as_array().unwrap().iter().map(|id| id.as_u64().unwrap() as usize);
        ids.map(|id| dump["objects"][id]["node"].as_str().unwrap().to_owned()).collect()
    };
    // Each sees its room, and nothing of the other one.
    for rows in [&dump["rows"], &dump["bounds"]["lower"], &dump["bounds"]["upper"]] {
        let (west, east) = (names(rows, 0), names(rows, 1));
        assert!(west.contains(&"chair".into()) && !west.contains(&"table".into()), "{west:?}");
        assert!(east.contains(&"table".into()) && !east.contains(&"chair".into()), "{east:?}");
        assert!(west.contains(&"middle".into()) && east.contains(&"middle".into()) && west.contains(&"west".into()));
    }
    let only = cli::json(&enfilade!("dump", "--rows", "view-cells", &out, "--json"));
    assert_eq!(only["rows"].as_object().unwrap().keys().collect::<Vec<_>>(), ["view_cells"]);
    assert_eq!(cli::json(&enfilade!("info", &out, "--json"))["view_cells"]["count"], 3);
    let file = PvsFile::load(&out).unwrap();
    let east = file.view_cell(&7.into()).unwrap();
    let seen: Vec<u64> = file.objects_seen_from_view(east).map(|o| u64::from(o.0)).collect();
    assert_eq!(serde_json::json!(seen), dump["rows"]["view_cells"][1]);
    assert!(file.notes.iter().any(|note| note.starts_with("view cell \"stone\" lies in no cell")));
}

/// Camera volumes for [`two_closed_rooms`].
const WEST: &str = r#"{"id": "west room", "min": [0.5, 1, 1], "max": [2.5, 2, 3]}"#;

#[test]
fn view_cells_that_make_no_sense_are_refused() {
    let folder = cli::folder("refuses");
    let model = two_closed_rooms(&folder);
    let (views, out) = (folder.join("views.json"), folder.join("rooms.pvs"));
    std::fs::write(&views, format!(r#"{{"cells": [{WEST}, {WEST}]}}"#)).unwrap();
    let refused = enfilade!("bake", &model, "--view-cells", &views, "-o", &out);
    cli::refused(&refused, &["views.json", "cells[1].id", "is a duplicate"]);
    for wrong in ["auto:0", "auto:many"] {
        cli::refused(&enfilade!("bake", &model, "--view-cells", wrong, "-o", &out), &["takes bytes, above 0"]);
    }
    cli::refused(&enfilade!("bake", &model, "--view-cells", &folder.join("none.json"), "-o", &out), &["none.json"]);
}
