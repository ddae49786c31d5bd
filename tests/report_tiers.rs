//! `enfilade report --tiers` and `--view-cells auto`: figures are those that `bake` and `walk` give on their own.

use crate::cli::{self, LEVEL, done, enfilade, folder, json, refused, run_words, text};
use serde_json::Value;
use std::path::{Path, PathBuf};
use testing::page::check_page;

/// A file as lines of fields, the heading first.
fn table(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// Nine exhibition rooms.
fn gallery(folder: &Path) -> PathBuf {
    let model = folder.join("gallery.glb");
    done(&enfilade!("generate", "gallery", "--rooms", "9", "-o", &model));
    model
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn report(model: &Path, page: &Path, flags: &[&str]) -> Value {
    json(&run_words(&[&["report", text(model), "-o", text(page), "--json"], flags].concat()))
}

/// Summaries of `walk` in the views of tiers, by mode.
fn walked(model: &Path, file: &Path, tiers: &Value) -> [Value; 2] {
    let (views, seed) = (tiers["views"].to_string(), tiers["views_seed"].to_string());
    let out = run_words(&[
        "walk",
        text(file),
        "--model",
        text(model),
        "--random",
        &views,
        "--seed",
        &seed,
        "--mode",
        "pvs",
        "--mode",
        "both",
        "--verify-pixels",
        "--json",
    ]);
    done(&out);
    let lines: Vec<Value> =
        String::from_utf8(out.stdout).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let summaries: Vec<Value> = lines.iter().filter_map(|line| line.get("summary").cloned()).collect();
    summaries.try_into().expect("two modes")
}

/// What `bake` writes for a tier, and says.
fn baked(model: &Path, file: &Path, tier: &Value, flags: &[&str]) -> Value {
    let percent = tier["unseen_asked"].as_f64().map(|asked| format!("{}%", 100.0 * asked));
    let asked = percent.as_deref().map_or(Vec::new(), |percent| vec!["--ship", "sampled", "--unseen", percent]);
    json(&run_words(&[&["bake", text(model), "-o", text(file), "--json"], &asked[..], flags].concat()))
}

/// Rows of a table, or tiers, without their times.
fn without_times(report: &Value, csv: &Path) -> (Value, Vec<Vec<String>>) {
    let mut tiers = report["tiers"].clone();
    tiers["rows"].as_array_mut().unwrap().iter_mut().for_each(|tier| tier["cpu_seconds"] = Value::Null);
    let mut rows = table(csv);
    rows.iter_mut().for_each(|row| row[3].clear());
    (tiers, rows)
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn tiers_are_what_bake_writes_and_walk_counts() {
    let folder = folder("gallery");
    let (model, page) = (gallery(&folder), folder.join("page.html"));
    let limits = ["--rays", "3M", "--seed", "3"];
    let flags = [&limits[..], &["--tiers", "--views", "25", "--threads", "1"]].concat();
    let told = report(&model, &page, &flags);
    let (tiers, rows) = (&told["tiers"], told["tiers"]["rows"].as_array().unwrap());
    assert_eq!((tiers["views"].as_u64(), tiers["views_seed"].as_u64(), rows.len()), (Some(25), Some(4), 4));
    assert_eq!(
        rows.iter().map(|t| t["unseen_asked"].as_f64()).collect::<Vec<_>>(),
        [None, Some(1e-3), Some(1e-4), Some(1e-5)]
    );
    let file = folder.join("tier.pvs");
    let mut baked_tiers = 0;
    for (k, tier) in rows.iter().enumerate() {
        let outcome = tier["outcome"].as_str().unwrap();
        if outcome == "as_before" {
            // The tier before has reached this bound, and is shipped for it.
            assert!(k > 1 && number(&rows[k - 1]["unseen"]) <= number(&tier["unseen_asked"]), "{tier}");
            for key in ["file_bytes", "rays", "unseen", "cpu_seconds", "pvs", "both"] {
                assert_eq!(tier[key], rows[k - 1][key], "{key}");
            }
            continue;
        }
        baked_tiers += 1;
        let bake = baked(&model, &file, tier, &limits);
        assert_eq!([&tier["file_bytes"], &tier["rays"]], [&bake["file_bytes"], &bake["pvs"]["rays"]], "{tier}");
        let ends = match outcome {
            "reached" => "unseen",
            "proven" => "rays",
            other => other,
        };
        assert_eq!(bake["sampling_ended_by"], ends);
        if k > 0 {
            assert_eq!(tier["unseen"], bake["pvs"]["unseen"]["mean"]);
            assert_eq!(outcome == "reached", number(&tier["unseen"]) <= number(&tier["unseen_asked"]), "{tier}");
        }
        for (mode, summary) in ["pvs", "both"].into_iter().zip(walked(&model, &file, tiers)) {
            for key in ["triangles_mean", "missed_pixels", "crack_pixels"] {
                assert_eq!(tier[mode][key], summary[key], "{mode} {key} of {tier}");
            }
            assert_eq!(tiers["exact_triangles_mean"], summary["exact_triangles_mean"]);
            // What is witnessed is not proven hidden.
            assert!(number(&tier[mode]["triangles_mean"]) <= number(&rows[0][mode]["triangles_mean"]), "{mode} {tier}");
        }
    }
    assert!(baked_tiers > 1 && rows[1]["outcome"] == "reached", "{tiers}");
    assert_eq!((rows[0]["both"]["missed_pixels"].as_u64(), rows[0]["pvs"]["missed_pixels"].as_u64()), (Some(0), Some(0)));
    assert!(number(&tiers["exact_triangles_mean"]) > 0.0);

    // The page and the table say the same.
    let html = std::fs::read_to_string(&page).unwrap();
    check_page(&html);
    assert!(html.contains("<h2>Which rows to ship</h2>") && html.contains("<code>enfilade report gallery.glb --rays 3M"));
    assert!(html.contains(" --tiers --seed 3 --threads 1</code>"));
    let csv = page.with_extension("tiers.csv");
    let lines = table(&csv);
    let column = |name: &str| lines[0].iter().position(|heading| heading == name).unwrap();
    assert_eq!(lines.len(), 5);
    for (line, tier) in lines[1..].iter().zip(rows) {
        assert!(line.len() == lines[0].len() && html.contains(&format!("<td>{}</td>", line[0])), "{line:?}");
        for key in ["outcome", "file_bytes", "rays", "unseen_asked", "unseen"] {
            let value = tier[key].as_str().map_or_else(|| tier[key].to_string(), str::to_owned);
            let of_line = &line[column(key)];
            let same = match of_line.parse::<f64>() {
                Ok(number) => tier[key].as_f64() == Some(number),
                Err(_) => *of_line == value || (of_line.is_empty() && tier[key].is_null()),
            };
            assert!(same, "{key}: {of_line} and {value}");
        }
        assert_eq!(line[column("both_missed_pixels")], tier["both"]["missed_pixels"].to_string());
    }

    // The same on two threads.
    let again = folder.join("again.html");
    let flags = [&limits[..], &["--tiers", "--views", "25", "--threads", "2"]].concat();
    let other = report(&model, &again, &flags);
    assert!(without_times(&told, &csv) == without_times(&other, &again.with_extension("tiers.csv")));
}

#[test]
fn a_bound_that_is_not_reached_is_said_in_words() {
    let folder = folder("unreached");
    let (model, page) = (gallery(&folder), folder.join("page.html"));
    let few = ["--rays", "20k", "--tiers", "--views", "2"];
    for (more, outcome, words) in [
        (&[][..], "rays", "not reached, since all rays were cast (--rays)"),
        (&["--time", "1e-9"][..], "time", "not reached, since time was over (--time)"),
    ] {
        let told = report(&model, &page, &[&few[..], more].concat());
        let outcomes: Vec<&str> =
            told["tiers"]["rows"].as_array().unwrap().iter().map(|tier| tier["outcome"].as_str().unwrap()).collect();
        assert_eq!(outcomes, ["proven", outcome, outcome, outcome]);
        let html = std::fs::read_to_string(&page).unwrap();
        check_page(&html);
        assert_eq!(html.matches(words).count(), 3);
    }
    // Without the flag there is nothing of it.
    let told = report(&model, &page, &["--rays", "20k", "--views", "2"]);
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(told["tiers"].is_null() && told["view_cell_splits"].is_null() && !html.contains("Which rows to ship"));
}

/// Three yards of 20 x 20 m under one sky, walls of 12 m between them, stones in each.
fn yards(folder: &Path) -> PathBuf {
    let (mut obj, mut corners) = (String::new(), 0);
    let mut solid = |name: &str, min: [f64; 3], max: [f64; 3]| {
        obj += &format!("o {name}\n");
        for corner in 0..8usize {
            let [x, y, z] = [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] });
            obj += &format!("v {x} {y} {z}\n");
        }
        for [a, b, c, d] in [[1, 5, 7, 3], [2, 4, 8, 6], [1, 2, 6, 5], [3, 7, 8, 4], [1, 3, 4, 2], [5, 6, 8, 7]] {
            let [a, b, c, d] = [a, b, c, d].map(|i| i + corners);
            obj += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
        corners += 8;
    };
    solid("ground", [0.0, -0.2, 0.0], [60.0, 0.0, 20.0]);
    for k in 0..4 {
        let x = 20.0 * f64::from(k);
        solid("wall", [x - 0.1, -0.1, 0.0], [x + 0.1, 12.0, 20.0]);
    }
    for yard in 0..3 {
        for i in 0..20 {
            let (x, z) = (f64::from(20 * yard + 4 * (i % 4) + 3), f64::from(3 * (i / 4) + 3));
            solid(&format!("stone {yard} {i}"), [x, 0.0, z], [x + 0.3, 0.3, z + 0.3]);
        }
    }
    let path = folder.join("yards.obj");
    std::fs::write(&path, obj).unwrap();
    path
}

#[test]
fn view_cells_are_drawn_split_by_split_until_the_bake_stopped() {
    let folder = folder("splits");
    let (model, page, file) = (yards(&folder), folder.join("page.html"), folder.join("yards.pvs"));
    let limits = ["--rays", "300k", "--seed", "2"];
    let flags = [&limits[..], &["--tiers", "--views", "5", "--view-cells", "auto:2K"]].concat();
    let told = report(&model, &page, &flags);
    let splits = told["view_cell_splits"].as_array().unwrap();
    let tiers: Vec<&Value> = told["tiers"]["rows"].as_array().unwrap().iter().collect();
    let of_tiers: Vec<&Value> = tiers.iter().filter(|tier| tier["outcome"] != "as_before").copied().collect();
    assert!(splits.len() == of_tiers.len() && splits.len() > 1, "{splits:?}");
    let mut lines = vec![["tier", "view_cells", "bytes", "triangles"].map(str::to_owned).to_vec()];
    let html = std::fs::read_to_string(&page).unwrap();
    check_page(&html);
    let mut most = 0;
    for (of, tier) in splits.iter().zip(of_tiers) {
        let points = of["points"].as_array().unwrap();
        assert_eq!((of["bytes_allowed"].as_u64(), points[0]["bytes"].as_u64()), (Some(2048), Some(0)));
        for pair in points.windows(2) {
            assert!(number(&pair[0]["bytes"]) < number(&pair[1]["bytes"]), "{pair:?}");
            assert!(number(&pair[0]["triangles"]) >= number(&pair[1]["triangles"]), "{pair:?}");
            assert!(number(&pair[1]["bytes"]) <= 2048.0);
        }
        // It ends where the bake says that it ends.
        let bake = baked(&model, &file, tier, &[&limits[..], &["--view-cells", "auto:2K"]].concat());
        let (last, of_bake) = (points.last().unwrap(), &bake["view_cells"]);
        let count = of_bake["count"].as_u64().unwrap_or(0);
        assert_eq!(last["view_cells"].as_u64(), Some(count));
        assert_eq!(tier["file_bytes"], bake["file_bytes"]);
        assert_eq!(number(&tier["rays"]), number(&bake["pvs"]["rays"]) + of_bake["rays"].as_f64().unwrap_or(0.0));
        if count > 0 {
            let curve: Vec<Value> = points.iter().map(|p| serde_json::json!([p["bytes"], p["triangles"]])).collect();
            assert_eq!(of_bake["curve"], Value::from(curve));
        }
        most = most.max(count);
        let spent = of["ended_by"] == "bytes";
        let note = bake["notes"].as_array().unwrap().iter().filter_map(Value::as_str).find(|n| n.contains("by cost"));
        assert_eq!(note.map(|note| note.ends_with("their bytes were spent")), Some(spent));
        // Over one sky portals prove nothing: a file that promises to hold all keeps no view cell, and says so.
        let kept = of["tier"] != "conservative";
        assert_eq!((note.map(|note| note.contains("none is kept")), count > 0), (Some(!kept), kept));
        let mark = format!("stopped at {count} view cells, ");
        assert!(html.contains(&mark), "{mark}");
        lines.extend(points.iter().map(|p| {
            let of_point = ["view_cells", "bytes", "triangles"].map(|key| number(&p[key]).to_string());
            [of["tier"].as_str().unwrap().to_owned()].into_iter().chain(of_point).collect()
        }));
    }
    assert!(most > 2, "walls between yards are worth view cells");
    assert_eq!(table(&page.with_extension("view-cells.csv")), lines);
    assert!(html.contains(" --tiers --view-cells auto:2048 --seed 2</code>"));
}

#[test]
fn bad_use_is_one_line_and_exit_2() {
    let folder = folder("bad");
    let (level, villa) = (folder.join("level.prt"), cli::building("villa_rotonda.glb"));
    std::fs::write(&level, LEVEL).unwrap();
    refused(&enfilade!("report", &level, "--tiers"), &["level.prt: is a level; --tiers is for buildings"]);
    refused(&enfilade!("report", &level, "--view-cells", "auto"), &["is a level; --view-cells is for buildings"]);
    refused(&enfilade!("report", &villa, "--tiers", "--views", "0"), &["--tiers compares in views; --views 0 leaves none"]);
    refused(&enfilade!("report", &villa, "--tiers", "--rays", "0"), &["--tiers compares rows", "--rays 0 casts none"]);
    refused(&enfilade!("report", &villa, "--time", "3"), &["--tiers"]);
    refused(&enfilade!("report", &villa, "--tiers", "--time", "0"), &["takes seconds, above 0"]);
    refused(&enfilade!("report", &villa, "--view-cells", "auto:0"), &["takes bytes, above 0"]);
    refused(&enfilade!("report", &villa, "--view-cells", &folder.join("none.json")), &["none.json"]);
}
