//! docs/cli.md names every key that `--json` prints.

use crate::cli::{LEVEL, done, folder, maze, run_words, text};
use serde_json::{Deserializer, Value};
use std::collections::BTreeSet;

/// The keys of every object in a value.
fn keys(value: &Value, all: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| {
            all.insert(key.clone());
            keys(value, all);
        }),
        Value::Array(list) => list.iter().for_each(|value| keys(value, all)),
        _ => {}
    }
}

/// The words of the page's section on a command.
fn words<'p>(page: &'p str, command: &str) -> BTreeSet<&'p str> {
    let (_, rest) = page.split_once(&format!("\n## `{command}`\n")).unwrap_or_else(|| panic!("no section on {command}"));
    let section = rest.split_once("\n## `").map_or(rest, |(section, _)| section);
    section.split(|c: char| !(c.is_ascii_alphanumeric() || "_-".contains(c))).collect()
}

/// Of commands that refer to `bake` and `info` for some keys, these sections count, too.
#[test]
fn every_key_of_every_command_is_in_the_page() {
    let folder = folder("keys");
    let (model, file) = maze(&folder);
    let [level, rows, path] = ["level.prt", "rows.txt", "page.html"].map(|name| folder.join(name));
    std::fs::write(&level, LEVEL).unwrap();
    // They show 0 3, which is hidden.
    std::fs::write(&rows, "0 4: 0 1 2 3\n1 4: 0 1 2 3\n2 4: 0 1 2 3\n3 4: 0 1 2 3\n").unwrap();
    let [model, file, level, rows, path] = [&model, &file, &level, &rows, &path].map(|p| text(p));
    let out = text(&folder).to_owned() + "/out.pvs";
    let glb = text(&folder).to_owned() + "/out.glb";
    let packed = text(&folder).to_owned() + "/packed";
    let walk = text(&folder).to_owned() + "/walk.json";
    let frame = r#"{"eye": [0, 1.6, 0], "target": [1, 1.6, 0]}"#;
    std::fs::write(&walk, format!(r#"{{"name": "w", "fov_y_degrees": 60, "near": 0.1, "frames": [{frame}]}}"#)).unwrap();
    let runs: [&[&str]; 13] = [
        &["bake", model, "-o", &out, "--rays", "100k", "--rows", "both", "--view-cells", "auto", "--fresh"],
        &["info", &out],
        &["dump", &out],
        &["export", &out, "--model", model, "-o", &glb],
        &["pack", &out, "--model", model, "-o", &packed, "--path", &walk],
        &["check", &out, "--model", model, "--rays", "1k", "--exact", "2"],
        &["walk", file, "--model", model, "--mode", "all", "--every", "50", "--verify-pixels", "--size", "64x64"],
        &["walk", file, "--model", model, "--mode", "exact", "--path", "random:3", "--size", "64x64"],
        &["walk", file, "--model", model, "--path", "random:3", "--min-pixels", "2", "--movers", "3"],
        &["why", &out, "--model", model, "0", "1"],
        &["vis", level, "--against", rows],
        &["report", model, "-o", path, "--rays", "20k"],
        &["generate", "maze", "--rooms", "4", "-o", &glb],
    ];
    let page = include_str!("../../docs/cli.md");
    for run in runs {
        let out = run_words(&[run, &["--json"]].concat());
        done(&out);
        let mut all = BTreeSet::new();
        for value in Deserializer::from_slice(&out.stdout).into_iter::<Value>() {
            keys(&value.unwrap(), &mut all);
        }
        assert!(!all.is_empty(), "{run:?}");
        let known: BTreeSet<&str> = [run[0], "bake", "info"].into_iter().flat_map(|command| words(page, command)).collect();
        let missing: Vec<&String> = all.iter().filter(|key| !known.contains(key.as_str())).collect();
        assert!(missing.is_empty(), "docs/cli.md, {}: {missing:?}", run[0]);
    }
}
