//! Cases of commands and of whole files.

use super::case;
use crate::cli::{done, folder, json, maze, run_words, text};
use enfilade::file::PvsFile;

/// Maps without closed space: no file of no cells, and whatever file there is can be read by every command.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_60_no_cells() {
    let case = case("60_no_cells");
    for name in ["door.map", "detail.map"] {
        let (model, out) = (case.join(name), folder(name).join("x.pvs"));
        let baked = run_words(&["bake", text(&model), "-o", text(&out), "--rays", "10k"]);
        if baked.status.code() == Some(2) {
            let said = String::from_utf8(baked.stderr).unwrap();
            assert!(said.lines().count() == 1 && said.contains("no closed space") && !out.exists(), "{said}");
            assert!(!out.with_extension("bake-state").exists());
            continue;
        }
        done(&baked);
        assert!(!PvsFile::load(&out).unwrap().cells.is_empty());
        let (model, out) = (text(&model), text(&out));
        for words in
            [&["check", out, "--model", model, "--rays", "10k"][..], &["walk", out, "--model", model, "--path", "random:5"]]
        {
            done(&run_words(words));
        }
    }
}

/// A file of one cell has no rows of objects: nothing can be missing in them.
#[test]
fn case_65_exact_one_cell() {
    let folder = folder("65");
    let (model, out) = (folder.join("hall.glb"), folder.join("hall.pvs"));
    done(&run_words(&["generate", "hall", "-o", text(&model)]));
    done(&run_words(&["bake", text(&model), "-o", text(&out), "--rays", "10k"]));
    assert!(PvsFile::load(&out).unwrap().object_rows.is_none());
    let check = ["check", text(&out), "--model", text(&model), "--rays", "10k", "--exact", "20", "--json"];
    let report = json(&run_words(&check));
    assert_eq!((&report["passed"], &report["exact"]["missed_pairs"]), (&true.into(), &0.into()));
    assert!(report["exact"]["eyes"].as_u64() > Some(0) && report["exact"]["visible_mean"].as_f64() > Some(0.0));
    let prose = run_words(&check[..check.len() - 1]);
    done(&prose);
    assert!(String::from_utf8(prose.stdout).unwrap().lines().last().unwrap().starts_with("passed in "));
}

/// The last line of `check` says how it ends, holes included.
#[test]
fn words_and_exit_code_of_a_check_agree() {
    let folder = folder("words");
    let (model, out) = (folder.join("open.obj"), folder.join("open.pvs"));
    // A box without one of its walls.
    let corner = |k: usize| format!("v {} {} {}\n", 4 * (k & 1), 3 * (k >> 1 & 1), 4 * (k >> 2));
    let faces = "f 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\nf 1 5 7 3\n";
    std::fs::write(&model, (0..8).map(corner).collect::<String>() + faces).unwrap();
    done(&run_words(&["bake", text(&model), "-o", text(&out), "--rays", "10k", "--cells", "plan"]));
    for (model, out) in [(model, out), maze(&folder)] {
        let leak = folder.join("leak.lines");
        let _ = std::fs::remove_file(&leak);
        let check = ["check", text(&out), "--model", text(&model), "--rays", "10k", "--views", "1", "--leak", text(&leak)];
        let ended = run_words(&check);
        let (code, said) = (ended.status.code(), String::from_utf8(ended.stdout).unwrap());
        assert!(ended.stderr.is_empty() && matches!(code, Some(0 | 1)), "{said}");
        let verdict = if code == Some(0) { "passed in " } else { "failed in " };
        assert!(said.lines().last().unwrap().starts_with(verdict), "{code:?}: {said}");
        assert_eq!(said.matches("passed").count() + said.matches("failed").count(), 1, "{said}");
        let with_json = run_words(&[&check[..], &["--json"]].concat());
        let report: serde_json::Value = serde_json::from_slice(&with_json.stdout).unwrap();
        assert_eq!((with_json.status.code(), report["passed"].as_bool()), (code, Some(code == Some(0))));
    }
}

/// Cameras where it is hard: in the plane of a portal, on a jamb, in a wall, outside, of any opening angle and near plane, straight down.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn case_27_cameras() {
    let case = case("27_cameras");
    let (model, out) = (case.with_file_name("00_base").join("base.glb"), folder("27").join("base.pvs"));
    done(&run_words(&["bake", text(&model), "-o", text(&out), "--rays", "100k"]));
    let mut walked = 0;
    for path in std::fs::read_dir(&case).unwrap().map(|entry| entry.unwrap().path()) {
        if path.extension().is_none_or(|e| e != "json") {
            continue;
        }
        let (model, out, path) = (text(&model), text(&out), text(&path));
        let words = [
            "walk",
            out,
            "--model",
            model,
            "--path",
            path,
            "--mode",
            "all",
            "--verify-pixels",
            "--size",
            "160x90",
            "--json",
        ];
        let output = run_words(&words);
        done(&output);
        for line in String::from_utf8(output.stdout).unwrap().lines() {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            if let Some(summary) = line.get("summary") {
                assert_eq!(summary["missed_pixels"], 0, "{path}: {summary}");
                walked += 1;
            }
        }
    }
    assert!(walked >= 13 * 5, "{walked}");
}
