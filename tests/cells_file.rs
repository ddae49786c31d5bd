//! Cells that come back: what `dump --json` writes goes into `bake --cells-file`, and edited by hand it is checked.

use crate::cli::{folder, refused, run};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A furnished office, its file, and its cells and portals as dumped.
fn office(test: &str) -> (PathBuf, PathBuf, Value) {
    let folder = folder(test);
    let (model, file) = (folder.join("office.glb"), folder.join("office.pvs"));
    let made = run(&[&["generate", "office", "--rooms", "6", "--furnished", "-o"].map(Path::new)[..], &[&model]].concat());
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    bake(&model, &file, &[]);
    let cells = dump(&file);
    (model, file, cells)
}

fn bake(model: &Path, file: &Path, more: &[&Path]) {
    let baked =
        run(&[&[Path::new("bake"), model, Path::new("-o"), file, Path::new("--rays"), Path::new("10k")], more].concat());
    assert!(baked.status.success(), "{}", String::from_utf8_lossy(&baked.stderr));
}

fn dump(file: &Path) -> Value {
    let out = run(&[Path::new("dump"), file, Path::new("--json")]);
    let whole: Value = serde_json::from_slice(&out.stdout).unwrap();
    json!({ "cells": whole["cells"], "portals": whole["portals"] })
}

#[test]
fn what_is_dumped_bakes_to_the_same_cells_and_portals() {
    let (model, file, cells) = office("same");
    assert!(cells["cells"].as_array().unwrap().len() > 6 && cells["portals"].as_array().unwrap().len() > 6);
    let (given, again) = (file.with_extension("json"), file.with_extension("again.pvs"));
    std::fs::write(&given, cells.to_string()).unwrap();
    bake(&model, &again, &[Path::new("--cells-file"), &given]);
    assert_eq!(dump(&again), cells);
}

#[test]
fn what_is_edited_wrongly_is_refused_by_its_field() {
    let (model, file, cells) = office("edited");
    let given = file.with_extension("json");
    let edits: [(&str, Value, &str); 7] = [
        ("/cells/2/id", json!(7), "cells[2].id: 7; ids count up from 0, so give 2"),
        ("/cells/1/pieces", json!([]), "cells[1].pieces: none"),
        ("/cells/1/pieces/0/planes/0", json!([0, 0, 0, 1]), "cells[1].pieces[0].planes[0]: no plane"),
        ("/cells/1/pieces/0/planes/0", json!([1, 0, 0]), "line 1 column"),
        ("/portals/0/cells/0", json!(99), "portals[0].cells: no cell 99"),
        ("/portals/0/winding", json!([[0, 0, 0], [1, 0, 0], [1, 0, 1]]), "portals[0]"),
        ("/portals/0/kind", json!("gate"), "unknown variant `gate`"),
    ];
    for (pointer, value, what) in edits {
        let mut edited = cells.clone();
        *edited.pointer_mut(pointer).unwrap() = value;
        std::fs::write(&given, edited.to_string()).unwrap();
        let out = run(&[Path::new("bake"), &model, Path::new("-o"), &file, Path::new("--cells-file"), &given]);
        refused(&out, &["office.json", what]);
    }
}
