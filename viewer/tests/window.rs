//! A real window: opened on a display of its own, keys pressed, pixels read. Needs Xvfb, xdotool and an adapter; fails without them where
//! `CI` is set.

#![cfg(target_os = "linux")]

#[allow(dead_code, reason = "other tests use the rest")]
mod common;

use common::building;
use common::display::{Display, Ends, can_run, until};
use enfilade_measure::walkthrough::path::CameraPath;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

fn viewer(display: &Display, home: &Path, args: &[&str]) -> Ends {
    let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade-viewer"));
    command.args(args).env("DISPLAY", &display.name).env("XDG_CONFIG_HOME", home).env_remove("WAYLAND_DISPLAY");
    Ends(command.spawn().expect("the viewer starts"))
}

#[test]
#[expect(clippy::too_many_lines, reason = "one window, opened once, pressed key by key")]
fn a_window_opens_keys_are_pressed_and_pixels_change() {
    if !can_run("a_window_opens_keys_are_pressed_and_pixels_change") {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("viewer_window");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let (model, pvs) = (folder.join("villa.glb"), folder.join("villa.pvs"));
    std::fs::copy(common::shipped("villa_rotonda", "glb"), &model).unwrap();
    building("villa_rotonda").file.save(&pvs).unwrap();

    let display = Display::open();
    let mut running = viewer(&display, &folder, &[pvs.to_str().unwrap(), "--size", "640x360"]);
    let find = || {
        let found = display.run("xdotool", &["search", "--name", "villa.* - Enfilade"]);
        String::from_utf8(found).ok().and_then(|ids| ids.lines().next().map(str::to_owned)).filter(|id| !id.is_empty())
    };
    let window = until("window", find);
    display.run("xdotool", &["windowfocus", &window]);
    // 1. A picture of the villa: many colours, not one.
    let picture = |window: &str| {
        let pixels = display.pixels(window);
        let mut colours: Vec<[u8; 3]> = pixels.colours.clone();
        colours.sort_unstable();
        colours.dedup();
        (colours.len() > 30 && pixels.count(|[r, g, b]| r > 150 && g > 150 && b > 130) > 20_000).then_some(())
    };
    until("picture", || picture(&window));
    // Nobody falls any more: two pictures are the same.
    let first = until("rest", || {
        std::thread::sleep(Duration::from_millis(400));
        let next = display.pixels(&window);
        std::thread::sleep(Duration::from_millis(400));
        (next.differ(&display.pixels(&window)) < 0.05).then_some(next)
    });
    // 2. A key that changes colours, and back.
    let press = |key: &str| drop(display.run("xdotool", &["key", "--window", "0", key]));
    press("c");
    until("cells in colours", || (display.pixels(&window).differ(&first) > 0.2).then_some(()));
    press("c");
    until("the colours of before", || (display.pixels(&window).differ(&first) < 0.1).then_some(()));
    // 3. The list of keys.
    press("F1");
    until("list of keys", || (display.pixels(&window).differ(&first) > 0.2).then_some(()));
    press("F1");
    until("no list", || (display.pixels(&window).differ(&first) < 0.1).then_some(()));
    // 4. Somebody walks: the picture is another.
    display.run("xdotool", &["keydown", "d", "sleep", "0.7", "keyup", "d"]);
    until("another view", || (display.pixels(&window).differ(&first) > 0.1).then_some(()));
    std::thread::sleep(Duration::from_millis(500));
    let left = display.pixels(&window);
    // 5. A mode and the alarm, then the window is shut; settings are there.
    press("3");
    press("k");
    std::thread::sleep(Duration::from_millis(500));
    let magenta = display.pixels(&window).count(|p| p == [255, 0, 255]);
    assert_eq!(magenta, 0, "the alarm rings");
    // A picture is saved, and the wheel makes faster.
    press("F2");
    until("screenshot", || folder.join("villa-1.png").exists().then_some(()));
    display.run("xdotool", &["mousemove", "--window", &window, "150", "250", "sleep", "0.3", "click", "4"]);
    // Whoever records a path is asked first; Escape is no.
    let recorded = folder.join("villa-1.path.json");
    press("F5");
    press("Escape");
    std::thread::sleep(Duration::from_millis(500));
    press("Escape");
    press("F5");
    until("recorded path", || recorded.exists().then_some(()));
    assert!(running.0.try_wait().unwrap().is_none(), "the recording was lost");
    press("Escape");
    let status = until("end", || running.0.try_wait().unwrap());
    assert!(status.success(), "{status}");
    let settings = std::fs::read_to_string(folder.join("enfilade/viewer.json")).unwrap();
    assert!(settings.contains(r#""mode": "portals""#) && settings.contains(r#""alarm": true"#), "{settings}");
    let settings: serde_json::Value = serde_json::from_str(&settings).unwrap();
    assert!(settings["speed"].as_f64().is_some_and(|speed| speed > 1.0), "{settings}");
    CameraPath::load(&recorded).unwrap();
    // 6. Who comes again is where they left.
    let mut again = viewer(&display, &folder, &[pvs.to_str().unwrap(), "--size", "640x360"]);
    let window = until("window again", find);
    until("the view that was left", || (display.pixels(&window).differ(&left) < 0.1).then_some(()));
    display.run("xdotool", &["windowfocus", &window, "key", "Escape"]);
    let status = until("end again", || again.0.try_wait().unwrap());
    assert!(status.success(), "{status}");
    // 7. Who comes with a path is where it ends.
    let path = common::path("villa_rotonda");
    let frame = path.frames[path.frames.len() / 2];
    let file = folder.join("given.path.json");
    let path = CameraPath { frames: vec![frame; 2], ..path };
    std::fs::write(&file, serde_json::to_string(&path).unwrap()).unwrap();
    let args = [pvs.to_str().unwrap(), "--size", "640x360", "--path", file.to_str().unwrap()];
    let mut played = viewer(&display, &folder, &args);
    let window = until("window with a path", find);
    until("picture of a path", || picture(&window));
    std::thread::sleep(Duration::from_millis(500));
    display.run("xdotool", &["windowfocus", &window, "key", "Escape"]);
    let status = until("end of the path", || played.0.try_wait().unwrap());
    assert!(status.success(), "{status}");
    let settings: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("enfilade/viewer.json")).unwrap()).unwrap();
    let eye = frame.eye - building("villa_rotonda").file.origin;
    let left = &settings["places"][0]["eye"];
    let off = [0, 2].map(|axis| (left[axis].as_f64().unwrap() - eye[axis]).abs());
    assert!(off.iter().all(|off| *off < 1e-6), "{left} is not {eye}");
}

#[test]
fn a_bad_file_is_told_on_the_screen_and_in_the_terminal() {
    if !can_run("a_bad_file_is_told_on_the_screen_and_in_the_terminal") {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("viewer_bad");
    std::fs::create_dir_all(&folder).unwrap();
    let bad = folder.join("bad.pvs");
    std::fs::write(&bad, "no pvs file").unwrap();
    let display = Display::open();
    let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade-viewer"));
    let log = folder.join("stderr.txt");
    command.arg(&bad).env("DISPLAY", &display.name).env("XDG_CONFIG_HOME", &folder).env_remove("WAYLAND_DISPLAY");
    let mut running = Ends(command.stderr(std::fs::File::create(&log).unwrap()).spawn().unwrap());
    let find = || {
        let ended = running.0.try_wait().unwrap();
        assert!(ended.is_none(), "the viewer ended: {ended:?}: {}", std::fs::read_to_string(&log).unwrap());
        let found = display.run("xdotool", &["search", "--name", "Enfilade: .*bad.pvs"]);
        String::from_utf8(found).ok().and_then(|ids| ids.lines().next().map(str::to_owned)).filter(|id| !id.is_empty())
    };
    let window = until("title that says so", find);
    // Text and a frame on grey.
    until("message", || (display.pixels(&window).count(|p| p.iter().all(|c| *c > 120)) > 100).then_some(()));
    display.run("xdotool", &["windowfocus", &window, "key", "Escape"]);
    let status = until("end", || running.0.try_wait().unwrap());
    assert_eq!(status.code(), Some(2));
    let told = std::fs::read_to_string(&log).unwrap();
    assert!(told.contains("bad.pvs"), "{told}");
}
