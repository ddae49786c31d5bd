//! The viewer's command line, as far as it needs no window: one line and exit 2 for bad input; pictures; what the alarm exits with.

use crate::common::{folder, needs_device, shipped, villa};
use std::path::Path;
use std::process::{Command, Output};

fn viewer(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_enfilade-viewer")).args(args).output().unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn bad_input_is_one_line_that_names_it() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let broken = folder.join("viewer_broken.pvs");
    std::fs::write(&broken, "no pvs file").unwrap();
    let glb = shipped("office", "glb");
    let (text_file, short) = (folder.join("text.ground"), folder.join("short.ground"));
    std::fs::write(&text_file, "no ground").unwrap();
    let whole = std::fs::read(crate::ground::made("damaged", crate::ground::hills())).unwrap();
    std::fs::write(&short, &whole[..whole.len() - 7]).unwrap();
    let (broken, glb, out) = (text(&broken), text(&glb), folder.join("no.png"));
    let out = text(&out);
    let cases: [(&[&str], &str); 15] = [
        (&[glb, "--ground", text(&text_file), "--shot", out], "not a .ground file"),
        (&[glb, "--ground", text(&text_file), "--bench"], "not a .ground file"),
        (&[glb, "--ground", text(&short), "--shot", out], "cut off"),
        (&[glb, "--ground", text(&short), "--bench"], "cut off"),
        (&[glb, "--ground", "none.ground", "--shot", out], "none.ground: "),
        (&[glb, "--ground", "none.ground", "--bench"], "none.ground: "),
        (&["--shot", out], "give a FILE"),
        (&["--bench"], "give a FILE"),
        (&["--path", "missing.json"], "give a FILE"),
        (&["--model", glb], "give a FILE"),
        (&["missing.pvs", "--shot", out], "missing.pvs: "),
        (&["missing.glb", "--shot", out], "missing.glb: "),
        (&[broken, "--shot", out], "viewer_broken.pvs: "),
        (&[glb, "--model", glb, "--shot", out], "--model is for a .pvs file"),
        (&[glb, "--path", "missing.json"], "missing.json: "),
    ];
    for (args, expected) in cases {
        let output = viewer(args);
        let told = String::from_utf8(output.stderr).unwrap();
        let line = told.lines().last().unwrap_or_default();
        assert!(told.lines().count() == 1 || !args.contains(&"--ground"), "{args:?}: {told}");
        assert_eq!(output.status.code(), Some(2), "{args:?}: {told}");
        assert!(line.starts_with("enfilade-viewer: ") && line.contains(expected), "{args:?}: {told}");
    }
    // What clap refuses, too.
    for args in [
        &["x.pvs", "--shot", out, "--size", "0x9"][..],
        &["x.pvs", "--mode", "fast"],
        &["x.pvs", "--frame", "3"],
        &["x.pvs", "--start"],
        &["x.pvs", "--shot", out, "--start", "--frame", "3"],
    ] {
        assert_eq!(viewer(args).status.code(), Some(2), "{args:?}");
    }
}

#[test]
fn a_shot_is_a_picture_and_the_alarm_is_an_exit_code() {
    needs_device!();
    let folder = folder("viewer_shot");
    let (pvs, lying, png) = (folder.join("villa.pvs"), folder.join("lying.pvs"), folder.join("shot.png"));
    let mut villa = villa().clone();
    villa.file.save(&pvs).unwrap();
    let rows = villa.file.object_rows.as_mut().unwrap();
    (0..rows.rows()).for_each(|cell| (0..rows.columns()).for_each(|object| rows.clear(cell, object)));
    (villa.file.pairs.lower, villa.file.pairs.upper) = (0, 0);
    (villa.file.bounds, villa.file.gap) = (None, None);
    villa.file.save(&lying).unwrap();
    let (model, path) = (shipped("villa_rotonda", "glb"), shipped("villa_rotonda", "path.json"));
    let shot = |file: &Path, more: &[&str]| {
        let args = [text(file), "--model", text(&model), "--path", text(&path), "--shot", text(&png)];
        viewer(&[&args[..], &["--size", "320x180", "--mode", "pvs"], more].concat())
    };
    let output = shot(&pvs, &["--frame", "9", "--alarm"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("missed pixels: 0"), "{output:?}");
    assert_eq!(image::image_dimensions(&png).unwrap(), (320, 180));
    // Rows that leave everything out.
    let output = shot(&lying, &["--frame", "9", "--alarm"]);
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    let output = shot(&pvs, &["--frame", "100000"]);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(String::from_utf8_lossy(&output.stderr).contains("no frame 100000"), "{output:?}");
}

#[test]
fn a_shot_of_the_start_is_the_same_whoever_was_there() {
    needs_device!();
    let folder = folder("viewer_start");
    std::fs::create_dir_all(folder.join("enfilade")).unwrap();
    let pvs = folder.join("villa.pvs");
    let villa = villa();
    villa.file.save(&pvs).unwrap();
    let model = shipped("villa_rotonda", "glb");
    let shot = |name: &str, more: &[&str]| {
        let png = folder.join(name);
        let args = [text(&pvs), "--model", text(&model), "--size", "160x90", "--mode", "both"];
        let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade-viewer"));
        let output = command.args(args).args(["--shot", text(&png)]).args(more);
        let output = output.env("XDG_CONFIG_HOME", &folder).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        std::fs::read(png).unwrap()
    };
    let first = shot("first.png", &["--start"]);
    let place = format!(r#"{{"model": "{:032x}", "eye": [0, 0, 0], "yaw": 1, "pitch": 0.5}}"#, villa.file.model_hash);
    std::fs::write(folder.join("enfilade/viewer.json"), format!(r#"{{"places": [{place}]}}"#)).unwrap();
    assert!(first == shot("again.png", &["--start"]), "settings change a picture");
    assert!(first != shot("frame.png", &[]), "a start is no frame of the path");
}

#[test]
fn a_bench_is_a_line_a_mode() {
    needs_device!();
    let pvs = folder("viewer_bench").join("villa.pvs");
    villa().file.save(&pvs).unwrap();
    let (model, path) = (shipped("villa_rotonda", "glb"), shipped("villa_rotonda", "path.json"));
    let args = [text(&pvs), "--model", text(&model), "--path", text(&path)];
    let output = viewer(&[&args[..], &["--bench", "--size", "160x90", "--alarm"]].concat());
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<serde_json::Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let names: Vec<&str> = lines.iter().map(|line| line["mode"].as_str().unwrap()).collect();
    assert_eq!(names, ["none", "frustum", "portals", "pvs", "both", "chc", "chc++", "auto", "hiz"]);
    for line in &lines {
        assert!(line["fps"].as_f64().unwrap() > 0.0 && line["missed_pixels"] == 0, "{line}");
    }
    let triangles = |i: usize| lines[i]["triangles_mean"].as_f64().unwrap();
    assert!(triangles(0) > triangles(1) && triangles(1) > triangles(4), "{text}");
}
