//! Cells that come back: what `dump --json` writes goes into `bake --cells FILE`, and edited by hand it is checked.

use crate::cli::{self, building, done, enfilade, folder, refused, run};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use testing::data::data;

/// A furnished office, its file, and its cells and portals as dumped.
fn office(test: &str) -> (PathBuf, PathBuf, Value) {
    let folder = folder(test);
    let (model, file) = (folder.join("office.glb"), folder.join("office.pvs"));
    done(&enfilade!("generate", "office", "--rooms", "6", "--furnished", "-o", &model));
    bake(&model, &file, &[]);
    let cells = dump(&file);
    (model, file, cells)
}

fn bake(model: &Path, file: &Path, more: &[&Path]) {
    bake_with(model, file, "10k", more);
}

fn bake_with(model: &Path, file: &Path, rays: &str, more: &[&Path]) {
    // The same objects, whatever cells there are.
    let words = ["--object-triangles", "256", "--rays", rays].map(Path::new);
    done(&run(&[&[Path::new("bake"), model, Path::new("-o"), file], &words[..], more].concat()));
}

fn dump(file: &Path) -> Value {
    let whole = all(file);
    json!({ "cells": whole["cells"], "portals": whole["portals"] })
}

/// Everything that `dump` says of a file.
fn all(file: &Path) -> Value {
    cli::json(&enfilade!("dump", file, "--json"))
}

#[test]
fn what_is_dumped_bakes_to_the_same_cells_and_portals() {
    let (model, file, cells) = office("same");
    assert!(cells["cells"].as_array().unwrap().len() > 6 && cells["portals"].as_array().unwrap().len() > 6);
    let (given, again) = (file.with_extension("json"), file.with_extension("again.pvs"));
    std::fs::write(&given, cells.to_string()).unwrap();
    bake(&model, &again, &[Path::new("--cells"), &given]);
    assert_eq!(dump(&again), cells);
}

/// A file holds single precision. What portals let through is the same for what was dumped: domes of slivers, openings far smaller than
/// their portals, portals narrower than the smallest hole, rooms of an author, storeys whose walls stand in the
/// plane of an opening. Rays, which start elsewhere by a rounding, are left out.
#[test]
fn what_is_dumped_bakes_to_the_same_rows() {
    let mut models = vec![building("villa_rotonda.glb")];
    if cfg!(feature = "full") {
        let of_data = ["indoorgml-apache/201.gml", "bimwhale-mit/TallBuilding.ifc", "webifc-mpl/Office_A_20110811.ifc"];
        models.extend(of_data.map(|model| data().join(model)));
    }
    let folder = folder("rows");
    for model in models {
        let file = folder.join(model.file_name().unwrap()).with_extension("pvs");
        let (given, again) = (file.with_extension("json"), file.with_extension("again.pvs"));
        bake_with(&model, &file, "0", &[]);
        let first = all(&file);
        assert!(first["portals"].as_array().unwrap().len() > 20 && first.get("repairs").is_none(), "{}", model.display());
        std::fs::write(&given, first.to_string()).unwrap();
        bake_with(&model, &again, "0", &[Path::new("--cells"), &given]);
        let second = all(&again);
        for key in ["cells", "portals", "strategy", "smallest_hole", "closed_holes", "objects", "rows"] {
            assert!(first.get(key) == second.get(key), "{}: {key}", model.display());
        }
    }
}

/// What came from a cells file holds no more than a file does: so rays come back, too, and all that is found by them.
#[test]
fn what_was_given_comes_back_with_its_rays() {
    let (model, file, cells) = office("rays");
    let given = file.with_extension("json");
    let mut dumps = Vec::new();
    std::fs::write(&given, cells.to_string()).unwrap();
    for _ in 0..2 {
        bake(&model, &file, &[Path::new("--cells"), &given, Path::new("--rows"), Path::new("both")]);
        dumps.push(all(&file));
        std::fs::write(&given, dumps[dumps.len() - 1].to_string()).unwrap();
    }
    let proven = &dumps[0]["bounds"]["lower"]["objects"];
    assert!(proven.as_array().unwrap().iter().any(|row| row.as_array().unwrap().len() > 5), "{proven}");
    assert!(dumps[0] == dumps[1]);
}

/// Portals that are closed for being small come back closed.
#[test]
fn holes_that_were_closed_stay_closed() {
    let (model, file, _) = office("closed");
    let close = [Path::new("--smallest-hole"), Path::new("1.5")];
    bake_with(&model, &file, "0", &close);
    let first = all(&file);
    assert!(!first["closed_holes"].as_array().expect("doors of an office are narrower").is_empty());
    let (given, again) = (file.with_extension("json"), file.with_extension("again.pvs"));
    std::fs::write(&given, first.to_string()).unwrap();
    bake_with(&model, &again, "0", &[Path::new("--cells"), &given]);
    let second = all(&again);
    assert_eq!((&first["closed_holes"], &first["rows"]), (&second["closed_holes"], &second["rows"]));
}

#[test]
fn what_is_edited_wrongly_is_refused_by_its_field() {
    let (model, file, cells) = office("edited");
    let given = file.with_extension("json");
    let edits: [(&str, Value, &str); 10] = [
        ("/cells/2/id", json!(7), "cells[2].id: 7; ids are consecutive from 0, so give 2"),
        ("/cells/1/pieces", json!([]), "cells[1].pieces: none"),
        ("/cells/1/pieces/0/planes/0", json!([0, 0, 0, 1]), "cells[1].pieces[0].planes[0]: no plane"),
        ("/cells/1/pieces/0/planes/0", json!([1, 0, 0]), "line 1 column"),
        ("/portals/0/cells/0", json!(99), "portals[0].cells: no cell 99"),
        ("/portals/0/winding", json!([[0, 0, 0], [1, 0, 0], [1, 0, 1]]), "portals[0]"),
        ("/portals/0/plane", json!([0.6, 0.8, 0, 100]), "portals[0].winding: corner 0 is"),
        ("/portals/0/cells", json!([cells["portals"][0]["cells"][1], cells["portals"][0]["cells"][0]]), "normal must lead"),
        ("/smallest_hole", json!(-1), "smallest_hole: -1; give metres"),
        ("/portals/0/kind", json!("gate"), "unknown variant `gate`"),
    ];
    for (pointer, value, what) in edits {
        let mut edited = cells.clone();
        match edited.pointer_mut(pointer) {
            Some(place) => *place = value,
            None => edited[&pointer[1..]] = value,
        }
        std::fs::write(&given, edited.to_string()).unwrap();
        let out = enfilade!("bake", &model, "-o", &file, "--cells", &given);
        refused(&out, &["office.json", what]);
    }
}
