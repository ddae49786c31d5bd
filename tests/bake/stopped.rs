//! What a bake leaves when it is stopped, and what it does where its result is there already.

use crate::cli::{building, command, done, enfilade, folder, json, maze, run_words, signalled, text};
use enfilade::bake::{BakeError, BakeOptions, Baked, bake};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use std::path::Path;
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};
use testing::bakes;
use testing::files::rows;

/// What a run that succeeds says.
fn said(words: &[&str]) -> String {
    let out = run_words(words);
    done(&out);
    String::from_utf8(out.stdout).unwrap()
}

/// What a bake leaves that is stopped once it tells that so much of a stage is done.
fn stopped(scene: &Scene, options: &BakeOptions, (stage, share): (&str, f64)) -> Result<Baked, BakeError> {
    let stop = AtomicBool::new(false);
    let progress = |told: &str, done: f64| _ = stop.fetch_or(told == stage && done >= share, Relaxed);
    bake(scene, options.clone(), &Job::new(&progress).until(&stop))
}

/// Stages in order; the upper bound is known from `KNOWN` on.
const STAGES: [(&str, f64); 8] = [
    ("cells", 0.0),
    ("sampling", 0.0),
    ("flow: might-see", 0.0),
    ("flow: cells", 0.0),
    ("aimed rays", 0.0),
    ("occluders", 0.0),
    ("occluders", 0.1),
    ("occluders", 0.2),
];
const KNOWN: usize = 4;

/// A bake, and what it leaves at each of the stages.
fn stops(options: &BakeOptions) -> (PvsFile, Vec<Option<Box<PvsFile>>>) {
    let scene = import(&building("office.glb"), &ImportOptions::default()).unwrap();
    let whole = bake(&scene, options.clone(), &Job::quiet()).unwrap().file;
    let left = STAGES.map(|at| match stopped(&scene, options, at) {
        Err(BakeError::Stopped(left)) => left,
        Ok(_) => panic!("it was not stopped at {at:?}"),
        Err(e) => panic!("{e}"),
    });
    (whole, left.into())
}

/// Wherever it is stopped: nothing, or from the upper bound on a file that lacks nothing of the whole one, and has less and less too much.
#[test]
fn what_is_left_has_all_that_the_whole_has() {
    let (whole, left) = stops(&bakes::with_rays(100_000));
    assert!(!whole.is_cut_short() && whole.repairs.is_empty());
    let (needed, mut pairs) = (rows(&whole), Vec::new());
    for (i, file) in left.iter().enumerate() {
        assert_eq!(file.is_some(), i >= KNOWN, "{:?}", STAGES[i]);
        let Some(file) = file else { continue };
        assert!(file.is_cut_short());
        assert_eq!(PvsFile::read(&file.write()).unwrap(), **file);
        assert_eq!(file.cells, whole.cells);
        assert_eq!(needed.first_outside(&rows(file)), None, "stopped at {:?}", STAGES[i]);
        pairs.push(rows(file).count_ones());
    }
    assert!(pairs.is_sorted_by(|a, b| a >= b) && pairs[0] > needed.count_ones(), "{pairs:?}");
}

/// Rows of bodies can't be made of it.
#[test]
fn what_is_asked_for_besides_rows_is_not_left_out_in_silence() {
    let (whole, left) = stops(&BakeOptions { relevance: Some(2.0), ..bakes::with_rays(100_000) });
    assert!(whole.relevance.is_some() && left.iter().all(Option::is_none));
}

#[cfg(unix)]
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn ctrl_c_leaves_what_is_known_unless_there_is_better() {
    let folder = folder("left");
    let (model, out) = (building("office.glb"), folder.join("o.pvs"));
    let with_seed = |seed: &str| {
        let words = ["bake", text(&model), "-o", text(&out), "--rays", "4M", "--seed", seed].map(Path::new);
        command(&words).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let spawn = || with_seed("0");
    let begin = Instant::now();
    assert_eq!(signalled(spawn(), "-INT", Duration::MAX).1, Some(0));
    let (took, whole) = (begin.elapsed(), std::fs::read(&out).unwrap());
    let state = out.with_extension("bake-state");
    // Later and later, until a file is left.
    let left = (2..40).find_map(|twentieth| {
        let _ = std::fs::remove_file(&out);
        let _ = std::fs::remove_file(&state);
        let (said, code) = signalled(spawn(), "-INT", took * twentieth / 20);
        (code == Some(1) && out.exists()).then_some((said, took * twentieth / 20))
    });
    let (told, after) = left.expect("no file was left");
    assert!(told.contains("o.pvs: what was known so far") && told.contains("resumes from"), "{told}");
    assert!(PvsFile::load(&out).unwrap().is_cut_short());
    assert!(said(&["info", text(&out)]).contains("the bake was stopped"));
    // The same command goes on from the state to the bytes of the whole.
    let (told, code) = signalled(spawn(), "-INT", Duration::MAX);
    assert!(code == Some(0) && told.contains("resumes from") && std::fs::read(&out).unwrap() == whole, "{told}");
    // A whole file stays.
    let (told, code) = signalled(with_seed("1"), "-INT", after);
    assert!(code == Some(0) || !told.contains("known so far") && std::fs::read(&out).unwrap() == whole, "{told}");
}

#[test]
fn the_same_bake_again_is_told_and_not_done() {
    let folder = folder("again");
    let (model, _) = maze(&folder);
    let out = folder.join("out.pvs");
    let bake = |more: &[&str]| said(&[&["bake", text(&model), "-o", text(&out), "--rays", "10k"], more].concat());
    assert!(!bake(&[]).contains("unchanged"));
    let first = std::fs::read(&out).unwrap();
    assert!(bake(&[]).contains("out.pvs: unchanged"));
    let told = json(&run_words(&["bake", text(&model), "-o", text(&out), "--rays", "10k", "--json"]));
    assert_eq!(told, serde_json::json!({ "unchanged": true }));
    // On other threads the result is the same; of other options, models and damaged files nothing is said.
    assert!(bake(&["--threads", "1"]).contains("unchanged"));
    assert!(!bake(&["--fresh"]).contains("unchanged"));
    assert_eq!(std::fs::read(&out).unwrap(), first);
    assert!(!bake(&["--seed", "5"]).contains("unchanged"));
    assert!(!bake(&[]).contains("unchanged"));
    let mut damaged = first.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 1;
    std::fs::write(&out, damaged).unwrap();
    assert!(!bake(&[]).contains("unchanged"));
    assert_eq!(std::fs::read(&out).unwrap(), first);
}
