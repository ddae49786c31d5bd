//! `enfilade walk`, from the command line: what it prints, and what it refuses.

use crate::cli::{done, folder, json, maze, refused, run_words, text};
use serde_json::Value;

/// Lines of JSON that a command prints.
#[track_caller]
fn lines(words: &[&str]) -> Vec<Value> {
    let out = run_words(words);
    done(&out);
    String::from_utf8(out.stdout).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Their summaries.
fn summaries(lines: Vec<Value>) -> Vec<Value> {
    lines.into_iter().filter_map(|mut line| line.get_mut("summary").map(Value::take)).collect()
}

fn keys(value: &Value) -> String {
    value.as_object().unwrap().keys().cloned().collect::<Vec<_>>().join(" ")
}

#[test]
fn a_walk_prints_a_line_a_frame_and_a_summary_a_mode() {
    let folder = folder("lines");
    let (model, file) = maze(&folder);
    let common = ["walk", text(&file), "--model", text(&model), "--size", "96x54", "--every", "10"];
    let lines = lines(&[&common[..], &["--mode", "all", "--verify-pixels", "--json"]].concat());
    let (summaries, frames): (Vec<&Value>, Vec<&Value>) = lines.iter().partition(|l| l.get("summary").is_some());
    for frame in &frames {
        let method = if frame["mode"] == "auto" { "method " } else { "" };
        let expected = format!(
            "frame mode cells portals objects triangles queries us frame_us {method}missed_pixels crack_pixels most_missed_pixels"
        );
        assert_eq!(keys(frame), expected);
        assert_eq!(frame["frame"].as_u64().unwrap() % 10, 0);
    }
    for (mode, asks) in [("both", false), ("chc", true), ("chc++", true)] {
        let queries: u64 = frames.iter().filter(|f| f["mode"] == mode).map(|f| f["queries"].as_u64().unwrap()).sum();
        assert_eq!(queries > 0, asks, "{mode}");
    }
    assert_eq!(summaries.len(), 8);
    for (summary, mode) in summaries.iter().zip(["none", "frustum", "portals", "pvs", "both", "chc", "chc++", "auto"]) {
        let summary = &summary["summary"];
        let expected = "frames mode triangles_mean objects_mean us_median us_p99 frame_us_median queries_mean missed_pixels crack_pixels \
                        worst_missed_pixels most_missed_pixels exact_triangles_mean capped_frames";
        assert_eq!((keys(summary).as_str(), summary["mode"].as_str()), (expected, Some(mode)));
        assert_eq!(summary["frames"].as_u64(), Some(frames.len() as u64 / 8));
        assert_eq!(summary["missed_pixels"].as_u64(), Some(0), "{mode}");
    }

    // Pictures, and prose on stdout without --json.
    let pictures = folder.join("pictures");
    let _ = std::fs::remove_dir_all(&pictures);
    let out = run_words(&[&common[..], &["--frames", text(&pictures)]].concat());
    let told = String::from_utf8(out.stdout).unwrap();
    assert!(out.status.success() && told.contains("missed pixels") && out.stderr.is_empty(), "{told}");
    assert_eq!(std::fs::read_dir(&pictures).unwrap().count(), frames.len() / 8);
    assert!(std::fs::read(pictures.join("frame_00000_both.png")).unwrap().starts_with(b"\x89PNG"));
}

/// The exact judge misses no pixel, although it draws none; it keeps no more than portals and rows do, and no less than pixels show.
#[test]
fn an_exact_walk_keeps_what_shows_and_no_more_than_others() {
    let folder = folder("exact");
    let (model, file) = maze(&folder);
    let words = ["walk", text(&file), "--model", text(&model), "--size", "96x54", "--every", "5", "--mode", "both"];
    let lines = lines(&[&words[..], &["--mode", "exact", "--verify-pixels", "--json"]].concat());
    let (frames, summaries) = lines.split_at(lines.len() - 2);
    let number = |line: &Value, key: &str| line[key].as_u64().unwrap_or_else(|| panic!("no {key} in {line}"));
    let mut fewer = 0;
    for pair in frames.chunks(2) {
        let [both, exact] = pair else { panic!("a line a mode") };
        assert_eq!((&both["mode"], &exact["mode"]), (&"both".into(), &"exact".into()));
        assert!(number(exact, "triangles") <= number(both, "triangles") && number(exact, "visible_triangles") > 0);
        assert!(number(exact, "visible_triangles") + number(exact, "undecided_triangles") <= number(exact, "triangles"));
        assert_eq!((number(exact, "missed_pixels"), both.get("visible_triangles")), (0, None));
        assert_eq!((number(both, "lost_objects"), exact.get("lost_objects")), (0, None));
        fewer += usize::from(number(exact, "triangles") < number(both, "triangles"));
    }
    assert!(fewer > 0, "rows promise more than what is visible from one eye");
    let [both, exact] = [&summaries[0]["summary"], &summaries[1]["summary"]];
    let mean = |summary: &Value, key: &str| summary[key].as_f64().unwrap();
    assert!(mean(exact, "triangles_mean") >= mean(exact, "exact_triangles_mean"));
    assert!(mean(exact, "triangles_mean") < mean(both, "triangles_mean"));
    assert!(mean(exact, "visible_triangles_mean") > 0.0);
}

/// What `bake` and `info` expect is what `walk` then draws.
#[test]
fn the_expected_draw_is_that_of_the_walk() {
    let folder = folder("expected");
    // A row is what shows from anywhere in a cell: of four rooms that is nearly all.
    let (model, file) = (folder.join("maze.glb"), folder.join("maze.pvs"));
    done(&run_words(&["generate", "maze", "--rooms", "12", "-o", text(&model)]));
    done(&run_words(&["bake", text(&model), "-o", text(&file), "--rays", "100k"]));
    let walk = ["walk", text(&file), "--model", text(&model), "--size", "160x90", "--mode", "all", "--json"];
    let walked = summaries(lines(&walk));
    let triangles = |mode: &str| {
        let of_mode = walked.iter().find(|s| s["mode"] == mode).unwrap_or_else(|| panic!("no summary of {mode}"));
        (of_mode["triangles_mean"].as_f64().unwrap(), of_mode["frames"].as_u64())
    };
    let (frustum, frames) = triangles("frustum");
    let again = folder.join("again.pvs");
    let info = json(&run_words(&["info", text(&file), "--json"]));
    let bake = json(&run_words(&["bake", text(&model), "-o", text(&again), "--json"]));
    for expected in [&info["expected_draw"], &bake["expected_draw"]] {
        assert_eq!(expected["frames"].as_u64(), frames);
        assert!((expected["frustum_triangles"].as_f64().unwrap() - frustum).abs() < 1e-6 * frustum);
    }
    for mode in ["portals", "pvs", "both"] {
        let share = info["expected_draw"][mode].as_f64().unwrap();
        assert!((share - triangles(mode).0 / frustum).abs() < 1e-9, "{mode}: {share}");
        assert!(share < 0.9, "a maze hides most of itself, and {mode} draws {share}");
    }
    // A slab closes nothing, and the user is told so.
    let slab = folder.join("slab.obj");
    std::fs::write(&slab, "v 0 0 0\nv 9 0 0\nv 9 0 9\nv 0 0 9\nf 4 3 2 1\n").unwrap();
    let out = run_words(&["bake", text(&slab), "-o", text(&again)]);
    let told = String::from_utf8(out.stdout).unwrap();
    assert!(
        told.contains("draw 100 % of the triangles in the frustum")
            && told.contains("no cell is closed")
            && told.contains("occlusion queries"),
        "{told}"
    );
}

#[test]
fn bad_input_is_one_line_and_exit_2() {
    let folder = folder("refuses");
    let (model, file) = maze(&folder);
    let other = folder.join("other.glb");
    done(&run_words(&["generate", "maze", "--rooms", "4", "--seed", "1", "-o", text(&other)]));
    let path = folder.join("path.json");
    let frame = r#"{"eye": [0, 1, 0], "target": [0, 1, 0]}"#;
    std::fs::write(&path, format!(r#"{{"name": "p", "fov_y_degrees": 60, "near": 0.1, "frames": [{frame}]}}"#)).unwrap();
    let (m, f) = (text(&model), text(&file));
    let pictures = folder.join("pictures");
    let cases: [(&[&str], &str); 8] = [
        (&["walk", f, "--model", text(&other)], "is not the model of"),
        (&["walk", f, "--model", m, "--path", text(&path)], "path.json: frame 0: eye and target are the same point"),
        (&["walk", f, "--model", m, "--mode", "CHC"], "no mode \"CHC\""),
        (&["walk", f, "--model", m, "--size", "0x10"], "--size"),
        (&["walk", f, "--model", m, "--min-pixels", "few"], "--min-pixels"),
        (&["walk", f, "--model", m, "--min-pixels", "0,4", "--frames", text(&pictures)], "give one --min-pixels"),
        (&["walk", m, "--model", m], "maze.glb: not a .pvs file"),
        (&["walk", f, "--model", f], "maze.pvs: no importer"),
    ];
    for (arguments, expected) in cases {
        refused(&run_words(arguments), &[expected]);
    }
}

/// No mode leaves out a pixel of a furnished office, wherever the eye jumps to from one frame to the next; and the more is asked, the less is
/// drawn.
#[test]
fn random_views_miss_no_pixel_in_any_mode() {
    let folder = folder("random");
    let (model, file) = (folder.join("office.glb"), folder.join("office.pvs"));
    done(&run_words(&["generate", "office", "--rooms", "6", "--furnished", "-o", text(&model)]));
    done(&run_words(&["bake", text(&model), "-o", text(&file), "--rays", "200k"]));
    let common = ["walk", text(&file), "--model", text(&model), "--size", "64x36", "--path", "random:60", "--seed", "3"];
    let walk =
        |more: &[&str]| summaries(lines(&[&common[..], more, &["--mode", "all", "--verify-pixels", "--json"]].concat()));
    let summaries = walk(&[]);
    assert!(summaries.iter().all(|s| s["missed_pixels"] == 0 && s["frames"] == 60), "{summaries:?}");
    let triangles = |mode: &str| summaries.iter().find(|s| s["mode"] == mode).unwrap()["triangles_mean"].as_f64().unwrap();
    let exact = summaries[0]["exact_triangles_mean"].as_f64().unwrap();
    for (more, less) in
        [("none", "frustum"), ("frustum", "pvs"), ("pvs", "both"), ("portals", "both"), ("both", "chc"), ("both", "chc++")]
    {
        assert!(triangles(less) <= triangles(more), "{less} and {more}");
    }
    assert!(triangles("chc") < 0.9 * triangles("both") && triangles("chc") >= exact);

    let out = run_words(&[&common[..], &["--path", "x.json"]].concat());
    assert_eq!(out.status.code(), Some(2));

    // What is smaller than a limit is left out, and nothing else: in each mode, and more with each limit.
    let limits = [0u32, 1, 4, 16, 64];
    let small = walk(&["--min-pixels", "0,1,4,16,64"]);
    assert_eq!(small.len(), 5 * summaries.len());
    for (m, of_mode) in small.chunks(5).enumerate() {
        let number = |i: usize, key: &str| of_mode[i][key].as_f64().unwrap();
        for (i, &limit) in limits.iter().enumerate() {
            assert!(number(i, "most_missed_pixels") < f64::from(limit.max(1)), "{}", of_mode[i]);
            assert_eq!(of_mode[i]["min_pixels"].as_u64().unwrap_or(0), u64::from(limit));
        }
        assert_eq!(number(1, "missed_pixels"), 0.0);
        // `auto` takes other modes from run to run, and queries aren't asked about what is left out.
        match of_mode[0]["mode"].as_str().unwrap() {
            "none" => assert_eq!(number(4, "objects_mean"), number(0, "objects_mean")),
            "frustum" | "portals" | "pvs" | "both" => {
                assert_eq!(of_mode[0]["objects_mean"], summaries[m]["objects_mean"]);
                for (i, line) in of_mode.iter().enumerate().skip(1) {
                    assert!(number(i, "objects_mean") < number(i - 1, "objects_mean"), "{line}");
                    let all = number(i, "objects_mean") + number(i, "small_mean");
                    assert!((all - number(0, "objects_mean")).abs() < 1e-9, "{line}");
                }
                assert!(number(4, "missed_pixels") > 0.0 && number(4, "worst_missed_pixels") <= number(4, "missed_pixels"));
            }
            _ => {}
        }
    }
}

/// A walk with loads: a line a method; nothing is missing where all fits and comes soon; what it cannot be joined with is refused.
#[test]
fn a_walk_with_a_budget_tells_what_is_missing() {
    let folder = folder("budget");
    let (model, file) = maze(&folder);
    let common = ["walk", text(&file), "--model", text(&model)];
    let walk = |more: &[&str]| run_words(&[&common[..], more].concat());
    let lines = |more: &[&str]| lines(&[&common[..], more, &["--json"]].concat());
    let all = lines(&["--budget", "100%", "--disk", "100G,0"]);
    assert_eq!(all.len(), 2);
    for (line, method) in all.iter().zip(["rows", "on-demand"]) {
        assert_eq!(keys(line), "loading budget bytes_all");
        let loading = &line["loading"];
        let expected =
            "method frames frames_missing objects_missing after_jumps jumps frames_over_budget bytes_loaded bytes_most us";
        assert_eq!((keys(loading).as_str(), loading["method"].as_str()), (expected, Some(method)));
        // What is loaded on demand comes a frame late at best.
        assert_eq!(loading["frames_missing"].as_u64() == Some(0), method == "rows");
        assert_eq!(loading["frames_over_budget"].as_u64(), Some(0));
        assert!(loading["frames"].as_u64() > Some(100) && line["budget"] == line["bytes_all"]);
    }
    // Nothing in memory: every frame that sees something misses it, and none settles.
    let none = lines(&["--budget", "0%", "--doors", "as-found"]);
    for line in &none {
        assert_eq!((line["loading"]["bytes_loaded"].as_u64(), line["loading"]["bytes_most"].as_u64()), (Some(0), Some(0)));
        assert!(line["loading"]["after_jumps"].as_u64() > Some(0));
    }
    let prose = walk(&["--budget", "50K"]);
    assert!(prose.status.success() && prose.stderr.is_empty());
    assert!(String::from_utf8(prose.stdout).unwrap().contains("with missing objects"));
    for bad in [
        &["--budget", "x"][..],
        &["--budget", "-5%"],
        &["--disk", "1M,1"],
        &["--budget", "1M", "--disk", "0,1"],
        &["--budget", "1M", "--verify-pixels"],
        &["--budget", "1M", "--path", "random:5"],
        &["--budget", "1M", "--mode", "pvs"],
    ] {
        assert_eq!(walk(bad).status.code(), Some(2), "{bad:?}");
    }
}
