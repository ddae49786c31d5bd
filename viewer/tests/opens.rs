//! How the window comes to a file: the start screen, a dialog, a file while another is opened; and what is no building, or hardly a window.

#![cfg(target_os = "linux")]

#[allow(dead_code, reason = "other tests use the rest")]
mod common;

use common::display::{Display, Ends, can_run, until};
use common::{building, shipped};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// A test's folder, with the villa in it.
fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("opens").join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("enfilade")).unwrap();
    std::fs::copy(shipped("villa_rotonda", "glb"), folder.join("villa.glb")).unwrap();
    building("villa_rotonda").file.save(&folder.join("villa.pvs")).unwrap();
    folder
}

/// The viewer in a folder, with programs of that folder only, and no portal.
fn viewer(display: &Display, folder: &Path, args: &[&str]) -> Ends {
    let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade-viewer"));
    command.current_dir(folder).args(args).args(["--size", "480x300"]).env("PATH", folder.join("bin"));
    command.env("DISPLAY", &display.name).env("XDG_CONFIG_HOME", folder).env_remove("WAYLAND_DISPLAY");
    command.env("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nowhere");
    command.stderr(std::fs::File::create(folder.join("stderr.txt")).unwrap());
    Ends(command.spawn().expect("the viewer starts"))
}

/// A program called `zenity`, which the dialog falls back to.
fn zenity(folder: &Path, lines: &str) {
    let path = folder.join("bin/zenity");
    std::fs::create_dir_all(folder.join("bin")).unwrap();
    std::fs::write(&path, format!("#!/bin/sh\n{lines}\n")).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
}

fn focused(display: &Display, title: &str) -> String {
    let window = until(title, || display.find(title));
    display.run("xdotool", &["windowfocus", &window]);
    window
}

/// The window's picture has many colours, as that of a building has.
fn shows_a_building(display: &Display, window: &str) {
    until("picture of a building", || {
        let mut colours = display.pixels(window).colours;
        colours.sort_unstable();
        colours.dedup();
        (colours.len() > 60).then_some(())
    });
}

fn end(display: &Display, mut running: Ends) -> Option<i32> {
    focused(display, "Enfilade");
    // Panels are closed first.
    let ended = until("end", || {
        display.run("xdotool", &["key", "Escape", "sleep", "0.3"]);
        running.0.try_wait().unwrap()
    });
    ended.code()
}

fn told(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("stderr.txt")).unwrap()
}

#[test]
fn a_click_on_the_start_screen_opens_a_recent_file_and_a_bad_one_leads_back() {
    if !can_run("a_click_on_the_start_screen_opens_a_recent_file_and_a_bad_one_leads_back") {
        return;
    }
    let folder = folder("start");
    std::fs::write(folder.join("bad.pvs"), "no pvs file").unwrap();
    let names = ["bad.pvs", "villa.pvs"].map(|name| folder.join(name).to_str().unwrap().to_owned());
    let settings = serde_json::json!({ "recent": names, "plan": false, "keys": { "Jump": "KeyQ" } });
    std::fs::write(folder.join("enfilade/viewer.json"), settings.to_string()).unwrap();
    let display = Display::open();
    let running = viewer(&display, &folder, &[]);
    let window = focused(&display, "^Enfilade$");
    until("start screen", || (display.pixels(&window).count(|p| p.iter().all(|c| *c > 120)) > 100).then_some(()));
    // 1. The first of the two can't be read: the start screen again, with a line.
    let click = |window: &str, y: u32| {
        let y = y.to_string();
        display.run("xdotool", &["mousemove", "--window", window, "60", &y, "sleep", "0.3", "click", "1", "sleep", "0.3"]);
    };
    click(&window, FIRST);
    let window = focused(&display, "^Enfilade: .*bad.pvs");
    let orange = |p: [u8; 3]| p[0] > 180 && p[2] < 60;
    until("line", || (display.pixels(&window).count(orange) > 30).then_some(()));
    // 2. The second one is a building, and the latest file from now on.
    let mut heights = (100..270).rev().step_by(12);
    until("villa", || {
        // From below: it is the last one, under a line that is as long as the folder's name.
        heights.next().into_iter().for_each(|y| click(&window, y));
        display.find("villa.* - Enfilade")
    });
    let window = focused(&display, "villa.* - Enfilade");
    shows_a_building(&display, &window);
    assert_eq!(end(&display, running), Some(0));
    let told = told(&folder);
    assert!(told.contains("bad.pvs: ") && told.contains(r#"ignored: "Jump" (no such action)"#), "{told}");
    let settings = std::fs::read_to_string(folder.join("enfilade/viewer.json")).unwrap();
    let settings: serde_json::Value = serde_json::from_str(&settings).unwrap();
    assert_eq!(settings["recent"], serde_json::json!([names[1], names[0]]));
}

/// Where the first of two recent files is, pixels from the top.
const FIRST: u32 = 190;

#[test]
fn text_is_as_large_as_the_display_says() {
    if !can_run("text_is_as_large_as_the_display_says") {
        return;
    }
    let folder = folder("scale");
    let display = Display::open();
    let bright = |scale: &str, text: f64| {
        std::fs::write(folder.join("enfilade/viewer.json"), format!(r#"{{"text": {text}, "size": [640, 480]}}"#)).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade-viewer"));
        command.env("DISPLAY", &display.name).env("XDG_CONFIG_HOME", &folder).env_remove("WAYLAND_DISPLAY");
        let mut running = Ends(command.env("WINIT_X11_SCALE_FACTOR", scale).spawn().expect("the viewer starts"));
        let window = focused(&display, "^Enfilade$");
        let count = || display.pixels(&window).count(|p| p.iter().all(|c| *c > 120));
        let shown = until("start screen", || {
            let before = count();
            std::thread::sleep(Duration::from_millis(500));
            (before > 100 && count() == before).then_some(before)
        });
        display.run("xdotool", &["key", "Escape"]);
        until("end", || running.0.try_wait().unwrap());
        shown as f64
    };
    let (usual, display_s, own) = (bright("1", 1.0), bright("1.5", 1.0), bright("1", 1.5));
    // Letters are half as high and half as wide again, and their lines about half as thick again.
    assert!(display_s > 1.3 * usual && own > 1.3 * usual, "{usual}, {display_s}, {own}");
}

#[test]
fn the_dialog_opens_another_file_and_frames_go_on_meanwhile() {
    if !can_run("the_dialog_opens_another_file_and_frames_go_on_meanwhile") {
        return;
    }
    let folder = folder("dialog");
    let display = Display::open();
    let running = viewer(&display, &folder, &["villa.pvs"]);
    let window = focused(&display, "villa.* - Enfilade");
    shows_a_building(&display, &window);
    // 1. Nobody chooses anything.
    zenity(&folder, "echo asked >> asked.txt; exit 1");
    display.run("xdotool", &["key", "ctrl+o"]);
    until("dialog", || folder.join("asked.txt").exists().then_some(()));
    // 2. A dialog that stays: keys do what they do.
    zenity(
        &folder,
        "echo again >> asked.txt; while [ ! -e chosen.txt ]; do read -t 1 line < /dev/null; done; echo $PWD/other.pvs",
    );
    std::fs::copy(folder.join("villa.glb"), folder.join("other.glb")).unwrap();
    std::fs::copy(folder.join("villa.pvs"), folder.join("other.pvs")).unwrap();
    until("second dialog", || {
        display.run("xdotool", &["key", "ctrl+o"]);
        std::fs::read_to_string(folder.join("asked.txt")).is_ok_and(|text| text.contains("again")).then_some(())
    });
    let before = display.pixels(&window);
    display.run("xdotool", &["key", "c"]);
    until("cells in colours", || (display.pixels(&window).differ(&before) > 0.2).then_some(()));
    std::fs::write(folder.join("chosen.txt"), "").unwrap();
    let window = focused(&display, "other.* - Enfilade");
    shows_a_building(&display, &window);
    assert_eq!(end(&display, running), Some(0));
}

#[test]
fn another_file_is_opened_while_one_is_baked() {
    if !can_run("another_file_is_opened_while_one_is_baked") {
        return;
    }
    let folder = folder("while");
    // Without a `.pvs` file, it is baked; that takes longer than the rest here.
    std::fs::copy(shipped("office", "glb"), folder.join("office.glb")).unwrap();
    zenity(&folder, "echo $PWD/villa.pvs");
    let display = Display::open();
    let running = viewer(&display, &folder, &["office.glb"]);
    focused(&display, "office.* - Enfilade");
    display.run("xdotool", &["key", "ctrl+o"]);
    let window = focused(&display, "villa.* - Enfilade");
    shows_a_building(&display, &window);
    assert_eq!(end(&display, running), Some(0));
}

#[test]
fn a_window_of_one_pixel_is_no_reason_to_end() {
    if !can_run("a_window_of_one_pixel_is_no_reason_to_end") {
        return;
    }
    let folder = folder("small");
    let display = Display::open();
    let running = viewer(&display, &folder, &["villa.pvs"]);
    let window = focused(&display, "villa.* - Enfilade");
    shows_a_building(&display, &window);
    // With all panels there are, in a window that has no room for any.
    display.run("xdotool", &["key", "m", "x", "g", "k", "F1", "F3", "F10", "slash"]);
    for size in [["1", "1"], ["1", "200"], ["300", "1"], ["2", "2"]] {
        display.run("xdotool", &["windowsize", "--sync", &window, size[0], size[1]]);
        std::thread::sleep(Duration::from_millis(700));
    }
    display.run("xdotool", &["key", "Escape", "Escape", "Escape", "windowsize", "--sync", &window, "480", "300"]);
    until("window as it was", || (display.pixels(&window).width == 480).then_some(()));
    shows_a_building(&display, &window);
    assert_eq!(end(&display, running), Some(0), "{}", told(&folder));
    // And from the first on.
    let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade-viewer"));
    command.current_dir(&folder).args(["villa.pvs", "--size", "1x1"]).env("DISPLAY", &display.name);
    command.env("XDG_CONFIG_HOME", &folder).env_remove("WAYLAND_DISPLAY");
    let running = Ends(command.spawn().unwrap());
    let window = focused(&display, "villa.* - Enfilade");
    display.run("xdotool", &["windowsize", "--sync", &window, "480", "300"]);
    shows_a_building(&display, &window);
    assert_eq!(end(&display, running), Some(0));
}

#[test]
fn a_wall_without_a_floor_is_shown_and_numbers_that_are_none_are_told() {
    if !can_run("a_wall_without_a_floor_is_shown_and_numbers_that_are_none_are_told") {
        return;
    }
    let folder = folder("hardly");
    std::fs::write(folder.join("wall.obj"), "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nf 1 2 3\nf 1 3 4\n").unwrap();
    std::fs::write(folder.join("nan.obj"), "v 0 0 0\nv 4 nan 0\nv 4 3 0\nf 1 2 3\n").unwrap();
    let display = Display::open();
    let running = viewer(&display, &folder, &["wall.obj"]);
    let window = focused(&display, "wall.* - Enfilade");
    // A walk where nothing is to walk on, and all that is shown of nothing.
    let keys =
        ["w", "v", "space", "v", "e", "y", "y", "t", "m", "x", "g", "k", "f", "f", "Prior", "Prior", "Next", "7", "3", "c"];
    for key in keys {
        display.run("xdotool", &["key", key, "sleep", "0.1"]);
    }
    std::thread::sleep(Duration::from_millis(500));
    assert!(display.pixels(&window).width == 480);
    assert_eq!(end(&display, running), Some(0), "{}", told(&folder));
    let running = viewer(&display, &folder, &["nan.obj"]);
    focused(&display, "Enfilade: .*nan.obj");
    assert_eq!(end(&display, running), Some(2));
    let told = told(&folder);
    assert!(told.lines().any(|line| line.starts_with("enfilade-viewer: nan.obj: ")) && !told.contains("panicked"), "{told}");
}
