//! Bakes that are cut off go on to the bytes of an undisturbed one: stopped, killed, with a state that is damaged or another's.

use crate::cli::{building, command, enfilade, folder, names, refused, run, signalled, wait_for};
use enfilade::bake::{BakeError, BakeOptions, bake, digest};
use enfilade::job::{Job, Journal, JournalError};
use enfilade::pvs::PvsOptions;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use std::time::{Duration, Instant};
use testing::bakes;
use testing::random::Random;

fn villa() -> (Scene, BakeOptions) {
    let scene = import(&building("villa_rotonda.glb"), &ImportOptions::default()).unwrap();
    (scene, BakeOptions { keep_bounds: true, ..bakes::with_rays(100_000) })
}

/// A bake on some threads that is stopped when it has told `most` times how far it is; the file's bytes where it came to an end.
fn baked(scene: &Scene, options: &BakeOptions, journal: &Journal, threads: usize, most: u32) -> Option<Vec<u8>> {
    let (stop, told) = (AtomicBool::new(false), AtomicU32::new(0));
    let progress = |_: &str, _: f64| stop.store(told.fetch_add(1, Relaxed) >= most, Relaxed);
    let result = bakes::on(threads, || {
        bake(scene, options.clone(), &Job::new(&progress).until(&stop).kept_in(journal)).map(|baked| baked.file.write())
    });
    journal.flush().unwrap();
    match result {
        Ok(bytes) => Some(bytes),
        Err(BakeError::Stopped(_)) => None,
        Err(e) => panic!("{e}"),
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn a_bake_stopped_again_and_again_gives_the_same_bytes() {
    let (scene, options) = villa();
    let whole = bake(&scene, options.clone(), &Job::quiet()).unwrap().file.write();
    let path = folder("stopped").join("state");
    let open = || Journal::open(&path, digest(&scene, &options)).unwrap();
    let (mut stops, mut size) = (0, 0);
    let bytes = loop {
        let journal = open();
        assert_eq!(journal.is_resumed(), size > 56, "{size} bytes");
        // On one and on two threads in turn, each time a little farther.
        let bytes = baked(&scene, &options, &journal, 1 + stops as usize % 2, 4 + 25 * stops);
        let before = std::mem::replace(&mut size, std::fs::metadata(&path).unwrap().len());
        assert!(size >= before, "a state only grows");
        if let Some(bytes) = bytes {
            break bytes;
        }
        stops += 1;
    };
    assert!(stops > 5, "stopped {stops} times");
    assert!(bytes == whole, "other bytes after {stops} stops");

    // All of it is there by now: nothing is worked out again.
    assert!(baked(&scene, &options, &open(), 2, u32::MAX).as_ref() == Some(&whole));
    assert_eq!(std::fs::metadata(&path).unwrap().len(), size);

    // Damaged, it is worth less, and no harm comes of it.
    let state = std::fs::read(&path).unwrap();
    for (k, part) in [0.05, 0.4, 0.8, 0.999].into_iter().enumerate() {
        let at = (state.len() as f64 * part) as usize;
        let mut damaged = state.clone();
        if k % 2 == 0 {
            damaged.truncate(at.max(56));
        } else {
            damaged[at] ^= 0x10;
        }
        std::fs::write(&path, &damaged).unwrap();
        assert!(baked(&scene, &options, &open(), 2, u32::MAX).as_ref() == Some(&whole), "damaged at {at}");
        assert!(std::fs::metadata(&path).unwrap().len() > size / 2, "and mended");
    }
    let short = [&[][..], &state[..5], &state[..20]];
    short.iter().for_each(|head| {
        std::fs::write(&path, head).unwrap();
        assert!(!open().is_resumed(), "killed while it was begun");
    });

    // Another's is refused, and left as it is.
    let seed = BakeOptions { pvs: PvsOptions { seed: 1, ..options.pvs.clone() }, ..options.clone() };
    std::fs::write(&path, &state).unwrap();
    assert!(matches!(Journal::open(&path, digest(&scene, &seed)), Err(JournalError::Other(_))));
    let journal = open();
    assert!(matches!(Journal::open(&path, digest(&scene, &options)), Err(JournalError::InUse)));
    drop(journal);
    assert!(std::fs::read(&path).unwrap() == state);
    std::fs::write(&path, "Something else altogether").unwrap();
    assert!(matches!(Journal::open(&path, digest(&scene, &options)), Err(JournalError::NotAJournal)));
}

/// A state whose blocks have the right checksums may still hold anything.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn results_of_another_shape_count_as_none() {
    let (scene, options) = villa();
    let whole = bake(&scene, options.clone(), &Job::quiet()).unwrap().file.write();
    let path = folder("shape").join("state");
    let digest = digest(&scene, &options);
    // Every map's first items, as empty, as a number that is too long, and as a list of four billion entries.
    let payloads: [&[u8]; 3] = [&[], &[0xff; 11], &[0xff, 0xff, 0xff, 0xff, 0x0f]];
    for payload in payloads {
        let mut entries = Vec::new();
        for map in 0..60u8 {
            for item in 0..4 {
                entries.extend([map, item, payload.len() as u8]);
                entries.extend(payload);
            }
        }
        // 240 as a postcard varint.
        let block = zstd::encode_all([&[0xf0, 0x01], entries.as_slice()].concat().as_slice(), 1).unwrap();
        let sum = xxhash_rust::xxh3::xxh3_64(&block);
        let parts: [&[u8]; 5] =
            [b"EnfWork\n", &digest.to_bytes(), &(block.len() as u32).to_le_bytes(), &sum.to_le_bytes(), &block];
        std::fs::write(&path, parts.concat()).unwrap();
        let journal = Journal::open(&path, digest).unwrap();
        assert!(journal.is_resumed());
        assert!(baked(&scene, &options, &journal, 2, u32::MAX).as_ref() == Some(&whole));
    }
}

fn spawn(model: &Path, out: &Path) -> Child {
    let arguments = [Path::new("bake"), model, Path::new("-o"), out, Path::new("--rays"), Path::new("1M")];
    command(&arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

#[cfg(unix)]
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn a_killed_bake_goes_on_and_leaves_nothing_behind() {
    let folder = folder("killed");
    let (model, whole, out) = (building("office.glb"), folder.join("whole.pvs"), folder.join("office.pvs"));
    let begin = Instant::now();
    assert_eq!(signalled(spawn(&model, &whole), "-KILL", Duration::MAX).1, Some(0));
    let took = begin.elapsed();
    let wanted = std::env::var("ENFILADE_KILLS").map_or(5, |n| n.parse::<u32>().expect("ENFILADE_KILLS is a number"));
    let (mut kills, mut resumed, mut bakes) = (0u32, 0u32, 0u32);
    let mut random = Random::new(1);
    while kills < wanted {
        // Killed after a time between nothing and half of what a whole one takes; longer and longer.
        for attempt in 0u32.. {
            let share = random.real(0.0, 1.0);
            let after = if kills < wanted { took.mul_f64(0.5 * share + 0.05 * f64::from(attempt)) } else { Duration::MAX };
            let (said, code) = signalled(spawn(&model, &out), "-KILL", after);
            resumed += u32::from(said.contains("resumes from"));
            match code {
                None => kills += 1,
                Some(0) => break,
                Some(code) => panic!("exit {code}: {said}"),
            }
            assert!(
                !out.exists() || std::fs::read(&out).unwrap() == std::fs::read(&whole).unwrap(),
                "not there before it is whole"
            );
        }
        bakes += 1;
        assert!(std::fs::read(&out).unwrap() == std::fs::read(&whole).unwrap(), "other bytes after {kills} kills");
        // The next one starts anew; a write that was cut off may have left its temporary file, for a minute.
        std::fs::remove_file(&out).unwrap();
    }
    assert!(resumed >= 1, "killed {kills} times, went on {resumed} times");
    let table = format!(
        "| kills | bakes | went on from a state | other bytes |\n| --- | --- | --- | --- |\n| {kills} | {bakes} | {resumed} | 0 |\n"
    );
    std::io::Write::write_all(&mut std::io::stderr(), table.as_bytes()).unwrap();
    let is_kept = |name: &String| name != "whole.pvs" && !name.ends_with(".pvs.tmp");
    let left: Vec<String> = names(&folder).into_iter().filter(is_kept).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[cfg(unix)]
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn ctrl_c_stops_a_bake_and_nobody_else_writes_to_its_output() {
    let folder = folder("stop");
    let (model, out, state) = (building("office.glb"), folder.join("o.pvs"), folder.join("o.bake-state"));
    let mut first = spawn(&model, &out);
    // The head is written as soon as the file is locked.
    wait_for(&mut first, &state, 56);
    let second = enfilade!("bake", &model, "-o", &out);
    refused(&second, &["o.bake-state: another run with the same output is in progress"]);
    wait_for(&mut first, &state, 57);
    let (said, code) = signalled(first, "-INT", Duration::ZERO);
    assert!(code == Some(1) && said.contains("stopped; the same command resumes from") && state.exists(), "{said}");
    refused(
        &enfilade!("bake", &model, "-o", &out, "--seed", "7"),
        &["o.bake-state: belongs to other options; an interrupted run left it. --fresh deletes it"],
    );
    assert!(state.exists(), "it isn't lost");
    // A copy of it, for what drops it.
    let (kept, fresh) = (folder.join("kept.bake-state"), folder.join("kept.pvs"));
    std::fs::copy(&state, &kept).unwrap();
    let others = ["--seed", "7", "--rays", "100k"].map(Path::new);
    let other = [&[Path::new("bake"), &model, Path::new("-o"), &fresh][..], &others].concat();
    refused(&run(&other), &["kept.bake-state: belongs to other options", "--fresh"]);
    assert!(std::fs::read(&kept).unwrap() == std::fs::read(&state).unwrap(), "without --fresh nothing of it is lost");
    let anew = run(&[&other[..], &[Path::new("--fresh")]].concat());
    let said = String::from_utf8_lossy(&anew.stderr);
    assert!(anew.status.success() && fresh.exists() && !kept.exists() && !said.contains("goes on"), "{said}");
    let (said, code) = signalled(spawn(&model, &out), "-INT", Duration::MAX);
    assert!(code == Some(0) && said.contains("resumes from") && !state.exists() && out.exists(), "{said}");
}

/// What a report has worked out is kept, as that of a bake.
#[cfg(unix)]
#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn ctrl_c_in_a_report_keeps_what_it_has() {
    let folder = folder("report");
    let (model, page, state) = (building("office.glb"), folder.join("o.html"), folder.join("o.report-state"));
    let flags = ["--views", "2", "--rays", "300k", "-o"].map(Path::new);
    let words: Vec<&Path> = [&[Path::new("report"), &model][..], &flags, &[page.as_path()]].concat();
    let mut first = command(&words).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for(&mut first, &state, 57);
    let (said, code) = signalled(first, "-INT", Duration::ZERO);
    assert!(code == Some(1) && said.contains("o.report-state") && state.exists() && !page.exists(), "{said}");
    let again = run(&words);
    let said = String::from_utf8_lossy(&again.stderr);
    assert!(again.status.success() && said.contains("resumes from") && page.exists() && !state.exists(), "{said}");
}

/// A split is no map: nothing of it is kept, and nothing of it is waited for.
#[cfg(unix)]
#[test]
fn a_signal_stops_a_split_and_leaves_nothing() {
    let folder = folder("split");
    let (model, out, state) = (folder.join("m.obj"), folder.join("m.pvs"), folder.join("m.bake-state"));
    // Triangles all through one another, which are split for longer than a signal takes.
    let mut random = Random::new(3);
    let mut text = String::new();
    for i in 0..6000 {
        (0..3).for_each(|_| text += &format!("v {} {} {}\n", random.real(0., 9.), random.real(0., 9.), random.real(0., 9.)));
        text += &format!("f {} {} {}\n", 3 * i + 1, 3 * i + 2, 3 * i + 3);
    }
    std::fs::write(&model, text).unwrap();
    for signal in ["-INT", "-TERM"] {
        let mut child = spawn(&model, &out);
        // The head of the state is written when the model is there, before it is split.
        wait_for(&mut child, &state, 56);
        let (said, code) = signalled(child, signal, Duration::ZERO);
        assert!(code == Some(1) && said.contains("no results to keep yet"), "{signal}: {said}");
        assert!(!state.exists() && !out.exists(), "{signal}");
    }
}

#[test]
fn what_cannot_be_written_is_said_before_the_work() {
    let folder = folder("place");
    let model = building("office.glb");
    let begin = Instant::now();
    let nowhere = folder.join("no/such/folder/o.pvs");
    refused(&enfilade!("bake", &model, "-o", &nowhere), &["no/such/folder: there is no such folder"]);
    assert!(begin.elapsed() < Duration::from_secs(20));
    let state = folder.join("o.bake-state");
    std::fs::write(&state, "my own text, of more than a head's length").unwrap();
    let out = folder.join("o.pvs");
    refused(
        &enfilade!("bake", &model, "-o", &out),
        &["o.bake-state: is not a state of an interrupted run, so it isn't replaced; move it"],
    );
    assert_eq!(std::fs::read_to_string(&state).unwrap(), "my own text, of more than a head's length");
    // What can't be baked leaves no state.
    let empty = folder.join("empty.obj");
    std::fs::write(&empty, "").unwrap();
    assert_eq!(enfilade!("bake", &empty).status.code(), Some(2));
    assert!(!folder.join("empty.bake-state").exists());
}
