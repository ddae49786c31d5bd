//! What goes wrong around a bake: no space, no right to write, an input that vanishes, two bakes at one output, too little memory. Each
//! ends with one line and exit 2 or with the right file, leaves what stood there before, and no litter. (Kills: `resume.rs`.)

#[cfg(target_os = "linux")]
use crate::cli::limited;
use crate::cli::{command, done, enfilade, folder, json, names, refused, wait_for};
use enfilade::bake::{BakeOptions, bake};
use enfilade::cells::matrix_bytes;
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::pvs::{PvsOptions, SamplingEnd};
use enfilade::scene::Scene;
use enfilade_measure::verify::{CheckOptions, check};
use enfilade_scenes::{Kind, generate};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, SystemTime};
use testing::bakes;

/// A gallery of 36 rooms.
fn scene() -> Scene {
    bakes::generated(Kind::Gallery { rooms: 36 }, 1).1
}

/// A gallery of nine rooms, quick to bake.
fn gallery() -> PathBuf {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    MADE.get_or_init(|| {
        let path = folder("model").join("gallery.glb");
        std::fs::write(&path, generate(Kind::Gallery { rooms: 9 }, 1).unwrap().glb).unwrap();
        path
    })
    .clone()
}

/// `bake MODEL -o OUT --rays 100k` and more.
fn bake_command(model: &Path, out: &Path, more: &[&str]) -> Command {
    let rays = ["--rays", "100k"].map(Path::new);
    let mut command = command(&[Path::new("bake"), model, Path::new("-o"), out, rays[0], rays[1]]);
    command.args(more);
    command
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_old_file_and_nothing_else() {
    let folder = folder("full");
    let out = folder.join("gallery.pvs");
    // Room for the head of a state, and for nothing more.
    std::fs::write(&out, "the old file").unwrap();
    let error = limited(&bake_command(&gallery(), &out, &[]), 1);
    refused(&error, &["gallery.pvs: File too large"]);
    assert_eq!(std::fs::read_to_string(&out).unwrap(), "the old file");
    // The state is what the next bake goes on from, once there is room.
    assert_eq!(names(&folder), ["gallery.bake-state", "gallery.pvs"]);
    done(&bake_command(&gallery(), &out, &[]).output().unwrap());
    let whole = folder.join("whole.pvs");
    done(&bake_command(&gallery(), &whole, &[]).output().unwrap());
    assert!(std::fs::read(&out).unwrap() == std::fs::read(&whole).unwrap());
    assert_eq!(names(&folder), ["gallery.pvs", "whole.pvs"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_device_without_room_is_an_error() {
    let folder = folder("device");
    let error = bake_command(&gallery(), Path::new("/dev/full"), &[]).output().unwrap();
    refused(&error, &["/dev/full: No space left on device"]);
    assert_eq!(names(&folder), [""; 0]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_where_nobody_may_write_is_an_error() {
    let folder = folder("readonly");
    // Nobody, root included, makes files here: neither the state nor the file, and that is told before the work.
    let out = Path::new("/proc/self/gallery.pvs");
    refused(&bake_command(&gallery(), out, &[]).output().unwrap(), &["/proc/self/gallery.bake-state: "]);
    assert_eq!(names(&folder), [""; 0]);
}

#[test]
fn an_input_that_is_gone_is_an_error_and_one_that_vanishes_is_not_missed() {
    let folder = folder("vanished");
    let (model, out) = (folder.join("gallery.glb"), folder.join("gallery.pvs"));
    refused(&enfilade!("bake", &model), &["gallery.glb: "]);
    assert_eq!(names(&folder), [""; 0]);
    // Once its state is there the model has been read.
    std::fs::copy(gallery(), &model).unwrap();
    let mut child = bake_command(&model, &out, &[]).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for(&mut child, &folder.join("gallery.bake-state"), 1);
    std::fs::remove_file(&model).unwrap();
    done(&child.wait_with_output().unwrap());
    assert_eq!(names(&folder), ["gallery.pvs"]);
    // What a vanished model's file was baked for can't be checked, and says so; the file stays.
    let before = std::fs::read(&out).unwrap();
    refused(&enfilade!("check", &out, "--model", &model), &["gallery.glb: "]);
    refused(&enfilade!("bake", &model, "-o", &out), &["gallery.glb: "]);
    assert!(std::fs::read(&out).unwrap() == before);
    assert_eq!(names(&folder), ["gallery.pvs"]);
}

/// A run that is killed while it writes its file leaves a temporary one; the next takes it away, and nobody else's.
#[test]
fn what_a_killed_write_left_behind_is_taken_away() {
    let folder = folder("litter");
    let out = folder.join("gallery.pvs");
    let old = |name: &str| {
        let file = std::fs::File::create(folder.join(name)).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(3600)).unwrap();
        file
    };
    drop(old("gallery.pvs.999999.pvs.tmp"));
    // One that somebody is at work on, one of another output, and ones that only look alike.
    let held = old("gallery.pvs.999998.pvs.tmp");
    held.lock().unwrap();
    drop(old("other.pvs.999999.pvs.tmp"));
    drop(old("gallery.pvs.mine.pvs.tmp"));
    drop(std::fs::File::create(folder.join("gallery.pvs.999997.pvs.tmp")).unwrap());
    done(&bake_command(&gallery(), &out, &[]).output().unwrap());
    let left = [
        "gallery.pvs",
        "gallery.pvs.999997.pvs.tmp",
        "gallery.pvs.999998.pvs.tmp",
        "gallery.pvs.mine.pvs.tmp",
        "other.pvs.999999.pvs.tmp",
    ];
    assert_eq!(names(&folder), left);
}

/// With less memory cells are joined: every cell's row holds what the cells in it saw, and nothing visible is missed.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn too_little_memory_gives_coarser_rows_that_miss_nothing() {
    let scene = scene();
    let baked = |memory: u64| {
        let options = BakeOptions { keep_bounds: true, memory, ..bakes::with_rays(100_000) };
        bake(&scene, options, &Job::quiet()).unwrap()
    };
    let whole = baked(8 << 30);
    assert_eq!(whole.cells_found, None);
    let cells = whole.file.cells.len();
    // A third of what matrices over all cells take.
    let room = matrix_bytes(cells, scene.objects.len(), whole.file.portals.len());
    let coarse = baked(2 * room / 3);
    assert_eq!(coarse.cells_found, Some(cells));
    let after = coarse.file.cells.len();
    assert!(after < cells && matrix_bytes(after, scene.objects.len(), coarse.file.portals.len()) <= room / 3);
    assert!(coarse.file.notes.iter().any(|n| n.starts_with(&format!("memory: {cells} cells joined to {after}"))));
    let share = |b: &PvsFile| b.pairs.upper as f64 / (b.cells.len() * b.objects.len()) as f64;
    assert!(share(&coarse.file) > share(&whole.file), "rows are coarser");
    let report = check(&coarse.file, &scene, &CheckOptions { rays: 100_000, views: 20, seed: 3, leaks: false }).unwrap();
    assert!(report.passed && report.missed_pairs == 0, "{:?}", report.examples);
    let bounds = coarse.file.bounds.as_ref().unwrap();
    assert_eq!(bounds.objects_lower.first_outside(&bounds.objects_upper), None);
}

/// Proofs that there is no room for are left out: their pairs are undecided, never hidden.
#[test]
fn proofs_beyond_their_share_leave_pairs_undecided() {
    let scene = scene();
    let baked = |most_witnesses: usize| {
        let pvs = PvsOptions { ray_budget: 100_000, most_witnesses, ..PvsOptions::default() };
        bakes::baked(&scene, BakeOptions { pvs, keep_bounds: true, ..BakeOptions::default() })
    };
    let (whole, few) = (baked(usize::MAX), baked(100));
    assert!(whole.pairs.lower > 500 && few.pairs.lower == 100, "{} {}", whole.pairs.lower, few.pairs.lower);
    assert!(few.notes.iter().any(|n| n.contains("proofs left out")), "{:?}", few.notes);
    let upper = |f: &PvsFile| f.bounds.as_ref().unwrap().objects_upper.clone();
    let lower = whole.bounds.as_ref().unwrap().objects_lower.clone();
    assert_eq!(lower.first_outside(&upper(&few)), None, "what is visible is not hidden for it");
    // A bound that takes more proofs can't be reached, and the bake says why.
    let pvs = PvsOptions { ray_budget: 1_000_000, most_witnesses: 100, unseen: Some(1e-3), ..PvsOptions::default() };
    let asked = bake(&scene, BakeOptions { pvs, ..BakeOptions::default() }, &Job::quiet()).unwrap();
    assert_eq!(asked.sampling_end, SamplingEnd::Memory);
    assert!(asked.file.notes.iter().any(|n| n.contains("was not reached before memory ran out")), "{:?}", asked.file.notes);
}

#[test]
fn memory_is_an_option_and_counted() {
    let folder = folder("memory");
    let out = folder.join("gallery.pvs");
    let json = json(&bake_command(&gallery(), &out, &["--memory", "1K", "--json"]).output().unwrap());
    let [found, kept] = ["cells_found", "cells"].map(|k| json[k].as_u64().unwrap());
    assert!(found > kept, "{found} cells found, {kept} kept");
    for bad in ["", "0", "1.5G", "12T", "M", "99999999999999G"] {
        let error = bake_command(&gallery(), &out, &["--memory", bad]).output().unwrap();
        let text = String::from_utf8(error.stderr).unwrap();
        assert!(error.status.code() == Some(2) && text.contains("--memory"), "{bad}: {text}");
    }
}
