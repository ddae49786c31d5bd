//! What commands tell the person whose model it is, and what they tell only on demand.

use crate::cli::{building, done, folder, json, run_words, text};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Most lines of `bake`.
const LINES: usize = 8;

/// A wall of 4 x 3 m, seen from both sides, and in it what is odd in `more`.
fn obj(folder: &Path, name: &str, more: &str) -> PathBuf {
    let path = folder.join(name);
    let wall = "o wall\nv 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nf 1 2 3 4\n";
    std::fs::write(&path, format!("{wall}{more}")).unwrap();
    path
}

/// A model with more to say than fits: a library that is missing, lines, a free form, doors, helpers, a corner that is no number.
fn odd(folder: &Path) -> PathBuf {
    let mesh = |name: &str| format!("o {name}\nf 1 2 3\n");
    let meshes: String = ["Door.001", "Window.001", "UCX_wall"].map(mesh).concat();
    let more = "mtllib none.mtl\nmtllib gone.mtl\nl 1 2\nsurf 0 1 0 1 1 2\nv nan 0 0\no broken\nf 1 2 5\nf 1 1 2\n";
    obj(folder, "odd.obj", &format!("{more}{meshes}"))
}

fn said(words: &[&str]) -> Vec<String> {
    let out = run_words(words);
    done(&out);
    String::from_utf8(out.stdout).unwrap().lines().map(str::to_owned).collect()
}

fn lines_of(report: &Value, key: &str) -> Vec<String> {
    report[key].as_array().unwrap().iter().map(|line| line.as_str().unwrap().to_owned()).collect()
}

/// A bake prints the most important notes; JSON has all of them, and figures of the method besides.
#[test]
fn a_bake_prints_eight_lines_and_counts_the_notes_beyond() {
    let folder = folder("bake");
    let (out, hall) = (folder.join("out.pvs"), folder.join("hall.glb"));
    done(&run_words(&["generate", "hall", "-o", text(&hall)]));
    let models = [odd(&folder), obj(&folder, "wall.obj", ""), hall, building("villa_rotonda.glb")];
    for model in models {
        let bake = ["bake", text(&model), "-o", text(&out), "--rays", "10k"];
        let brief = said(&bake);
        assert!(brief.len() <= LINES, "{}: {brief:?}", model.display());
        assert!(brief.last().unwrap().starts_with(text(&out)), "{brief:?}");
        for words in [
            "sheets split space",
            "triangles split space",
            "leaves in tiles",
            "left out: bounds",
            "witnessed",
            "stands upright",
        ] {
            assert!(!brief.iter().any(|line| line.contains(words)), "{words}: {brief:?}");
        }
        let report = json(&run_words(&[&bake[..], &["--json", "--fresh"]].concat()));
        let (notes, details) = (lines_of(&report, "notes"), lines_of(&report, "details"));
        assert!(!details.is_empty() && !brief.iter().any(|line| details.iter().any(|d| line.contains(d))), "{details:?}");
        let shown = brief.iter().filter(|line| line.starts_with("note: ")).count();
        let rest = format!(" more notes: `enfilade info {}` shows them", text(&out));
        let more = brief.iter().find_map(|line| line.strip_prefix("and ")?.strip_suffix(&rest));
        assert_eq!(shown + more.map_or(0, |more| more.parse::<usize>().unwrap()), notes.len(), "{brief:?}");
    }
}

/// What is missing comes before what was taken for something; `info` has the notes in the same order, and no details.
#[test]
fn what_is_wrong_is_told_first() {
    let folder = folder("order");
    let (model, out) = (odd(&folder), folder.join("odd.pvs"));
    let bake = ["bake", text(&model), "-o", text(&out), "--rays", "10k"];
    let report = json(&run_words(&[&bake[..], &["--json"]].concat()));
    let (notes, details) = (lines_of(&report, "notes"), lines_of(&report, "details"));
    let place = |words: &str| {
        let found = notes.iter().position(|note| note.contains(words));
        found.unwrap_or_else(|| panic!("no {words}: {notes:?}"))
    };
    let faults = ["not a finite number", "`none.mtl`", "`gone.mtl`", "lines left out", "free-form"].map(place);
    let taken = ["doors", "not drawn by engines"].map(place);
    assert!(faults.iter().max() < taken.iter().min(), "{notes:?}");
    assert!(details.iter().any(|detail| detail == "1 triangles without area dropped"), "{details:?}");
    assert!(!notes.iter().any(|note| details.contains(note)), "{notes:?} {details:?}");
    let brief = said(&[&bake[..], &["--fresh"]].concat());
    assert!(brief.len() == LINES && brief.iter().any(|line| line.ends_with("` shows them")), "{brief:?}");
    let shown: Vec<&str> = brief.iter().filter_map(|line| line.strip_prefix("note: ")).collect();
    assert_eq!(shown, notes[..shown.len()]);

    let info = json(&run_words(&["info", text(&out), "--json"]));
    assert_eq!(lines_of(&info, "notes"), notes);
    let all = said(&["info", text(&out)]);
    assert!(notes.iter().all(|note| all.iter().any(|line| line.ends_with(note.as_str()))), "{all:?}");
    assert!(!all.iter().any(|line| details.iter().any(|detail| line.ends_with(detail.as_str()))), "{all:?}");
    for words in ["bits a pair", "sections", "repairs"] {
        assert!(all.iter().any(|line| line.contains(words)), "{words}");
    }
}

#[test]
fn check_and_vis_print_little() {
    let folder = folder("others");
    let (model, out) = crate::cli::maze(&folder);
    let brief = said(&["check", text(&out), "--model", text(&model), "--rays", "10k", "--views", "3"]);
    assert!(brief.len() <= LINES && brief.last().unwrap().starts_with("passed in "), "{brief:?}");
    let level = folder.join("level.prt");
    std::fs::write(&level, crate::cli::LEVEL).unwrap();
    // Four rooms of which the first and the last don't see each other: 14 of 16 pairs.
    let brief = said(&["vis", text(&level)]);
    assert!(brief.iter().any(|line| line == "88 % of the pairs of clusters are kept: 3.5 clusters per row on average"));
}
