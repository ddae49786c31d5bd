//! The window itself: it opens on a display of its own, keys are pressed, and its pixels are looked at.

#![cfg(target_os = "linux")]

#[allow(dead_code, reason = "other tests use the rest")]
#[path = "../suite/common/mod.rs"]
mod common;
mod display;

use common::{building, shipped};
use display::{Display, Ends, Pixels, can_run, until};
use enfilade_measure::walkthrough::path::CameraPath;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// A folder with the villa and its file, and no settings.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("viewer_window").join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("bin")).unwrap();
    std::fs::copy(shipped("villa_rotonda", "glb"), folder.join("villa.glb")).unwrap();
    building("villa_rotonda").file.save(&folder.join("villa.pvs")).unwrap();
    folder
}

/// The viewer in a folder, where `bin` has the only programs that it can start.
fn viewer(display: &Display, folder: &Path, args: &[&str]) -> Ends {
    let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade-viewer"));
    command.current_dir(folder).args(args).args(["--size", "640x360"]);
    command.env("DISPLAY", &display.name).env("XDG_CONFIG_HOME", folder).env_remove("WAYLAND_DISPLAY");
    command.env("PATH", folder.join("bin")).env("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nowhere");
    command.stderr(std::fs::File::create(folder.join("stderr.txt")).unwrap());
    Ends(command.spawn().expect("the viewer starts"))
}

fn focused(display: &Display, title: &str) -> String {
    let window = until(title, || display.find(title));
    display.run("xdotool", &["windowfocus", &window]);
    window
}

/// Waits until the window shows a building, which has many colours.
fn shows_a_building(display: &Display, window: &str) {
    until("picture of a building", || {
        let mut colours = display.pixels(window).colours;
        colours.sort_unstable();
        colours.dedup();
        (colours.len() > 30).then_some(())
    });
}

/// Waits until two pictures are the same.
fn at_rest(display: &Display, window: &str) -> Pixels {
    until("rest", || {
        std::thread::sleep(Duration::from_millis(400));
        let next = display.pixels(window);
        std::thread::sleep(Duration::from_millis(400));
        (next.differ(&display.pixels(window)) < 0.05).then_some(next)
    })
}

#[test]
fn a_window_opens_keys_are_pressed_and_pixels_change() {
    if !can_run("a_window_opens_keys_are_pressed_and_pixels_change") {
        return;
    }
    let (folder, display) = (folder("keys"), Display::open());
    let mut running = viewer(&display, &folder, &["villa.pvs"]);
    let window = focused(&display, "villa.* - Enfilade");
    shows_a_building(&display, &window);
    let first = at_rest(&display, &window);
    let press = |key: &str| drop(display.run("xdotool", &["key", "--window", "0", key]));
    let differs = |what: &str, least: f64| {
        until(what, || (display.pixels(&window).differ(&first) > least).then_some(()));
    };
    // 1. Keys that change the picture, and back.
    for (key, what) in [("c", "cells in colours"), ("F1", "list of keys")] {
        press(key);
        differs(what, 0.2);
        press(key);
        until("the view of before", || (display.pixels(&window).differ(&first) < 0.1).then_some(()));
    }
    // 2. A held key walks.
    display.run("xdotool", &["keydown", "d", "sleep", "0.7", "keyup", "d"]);
    differs("another view", 0.1);
    let left = at_rest(&display, &window);
    // 3. A mode and the alarm; a picture is saved, and the wheel makes faster.
    ["3", "k", "F2"].into_iter().for_each(press);
    until("screenshot", || folder.join("villa-1.png").exists().then_some(()));
    assert_eq!(display.pixels(&window).count(|p| p == [255, 0, 255]), 0, "the alarm rings");
    display.run("xdotool", &["mousemove", "--window", &window, "150", "250", "sleep", "0.3", "click", "4"]);
    // 4. Escape asks before a recording is lost; Escape again is no.
    let recorded = folder.join("villa-1.path.json");
    ["F5", "Escape"].into_iter().for_each(press);
    std::thread::sleep(Duration::from_millis(500));
    ["Escape", "F5"].into_iter().for_each(press);
    until("recorded path", || recorded.exists().then_some(()));
    assert!(running.0.try_wait().unwrap().is_none(), "the recording was lost");
    press("Escape");
    assert!(until("end", || running.0.try_wait().unwrap()).success());
    CameraPath::load(&recorded).unwrap();
    // 5. Settings are kept, and the next visit begins where this one ended.
    let settings = std::fs::read_to_string(folder.join("enfilade/viewer.json")).unwrap();
    let settings: serde_json::Value = serde_json::from_str(&settings).unwrap();
    assert!(settings["mode"] == "portals" && settings["alarm"] == true, "{settings}");
    assert!(settings["speed"].as_f64().is_some_and(|speed| speed > 1.0), "{settings}");
    let mut again = viewer(&display, &folder, &["villa.pvs"]);
    let window = focused(&display, "villa.* - Enfilade");
    until("the view that was left", || (display.pixels(&window).differ(&left) < 0.1).then_some(()));
    display.run("xdotool", &["key", "Escape"]);
    assert!(until("end again", || again.0.try_wait().unwrap()).success());
}

#[test]
fn the_dialog_opens_another_file_and_a_bad_one_is_told() {
    if !can_run("the_dialog_opens_another_file_and_a_bad_one_is_told") {
        return;
    }
    let (folder, display) = (folder("dialog"), Display::open());
    std::fs::copy(folder.join("villa.glb"), folder.join("other.glb")).unwrap();
    std::fs::copy(folder.join("villa.pvs"), folder.join("other.pvs")).unwrap();
    std::fs::write(folder.join("bad.pvs"), "no pvs file").unwrap();
    // The dialog falls back to a program of this name. Frames go on until it answers.
    let zenity = folder.join("bin/zenity");
    let waits = "while [ ! -e chosen.txt ]; do read -t 1 line < /dev/null; done";
    std::fs::write(&zenity, format!("#!/bin/bash\necho > asked.txt; {waits}; echo $PWD/$(<chosen.txt)\n")).unwrap();
    std::fs::set_permissions(&zenity, std::fs::Permissions::from_mode(0o755)).unwrap();
    let mut running = viewer(&display, &folder, &["villa.pvs"]);
    let window = focused(&display, "villa.* - Enfilade");
    shows_a_building(&display, &window);
    display.run("xdotool", &["key", "ctrl+o"]);
    until("dialog", || folder.join("asked.txt").exists().then_some(()));
    let before = at_rest(&display, &window);
    display.run("xdotool", &["key", "c"]);
    until("cells in colours", || (display.pixels(&window).differ(&before) > 0.2).then_some(()));
    std::fs::write(folder.join("chosen.txt"), "other.pvs").unwrap();
    let window = focused(&display, "other.* - Enfilade");
    shows_a_building(&display, &window);
    // A file that cannot be read leads to the start screen, with a line.
    std::fs::write(folder.join("chosen.txt"), "bad.pvs").unwrap();
    display.run("xdotool", &["key", "ctrl+o"]);
    let window = focused(&display, "Enfilade: .*bad.pvs");
    let orange = |p: [u8; 3]| p[0] > 180 && p[2] < 60;
    until("line", || (display.pixels(&window).count(orange) > 30).then_some(()));
    display.run("xdotool", &["key", "Escape"]);
    assert_eq!(until("end", || running.0.try_wait().unwrap()).code(), Some(2));
    let told = std::fs::read_to_string(folder.join("stderr.txt")).unwrap();
    assert!(told.contains("bad.pvs: ") && !told.contains("panicked"), "{told}");
}
