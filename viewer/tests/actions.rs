//! Every action of the table, every held key and every gesture of the mouse, done in a real window, each with a picture of what it comes to.
//!
//! Pictures are in `golden/actions`; `ENFILADE_GOLDEN=write` writes them anew. An action that has none fails by name. In the window, time
//! passes only where a key or a button goes down, so that pictures don't depend on how fast anything is.

#![cfg(target_os = "linux")]

#[allow(dead_code, reason = "other tests use the rest")]
mod common;

use common::display::{Display, Ends, can_run, until};
use common::{building, shipped};
use enfilade_viewer::args::Shown;
use enfilade_viewer::commands::{Action, Entry, HOLDS, HeldKey, Hold, TABLE};
use enfilade_viewer::culling::MODES;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;
use winit::keyboard::KeyCode;

/// Of the window, pixels.
const SIZE: [usize; 2] = [480, 300];
/// Colours that are nearer than this are the same, and so many pixels of a picture may be others: a field's cursor blinks, which is 24, and
/// drivers differ at edges. Every action changes more.
const NEAR: u8 = 12;
const MAY_DIFFER: usize = 200;
/// Where somebody stands, metres in the model, and looks, radians: before a door, with a wall beside it. Every action begins and ends there.
const EYE: DVec3 = DVec3::new(5.0, 4.6, -8.6);
const LOOK: [f64; 2] = [4.91, -0.05];
/// A key that does nothing, and so lets time pass.
const NOTHING: &str = "Insert";

/// Parts of a picture that clocks write: left, top, right and bottom, pixels.
type Rect = [usize; 4];
/// The counters' line of times, and where their panel ends: it is as wide as that line.
const TIMES: [Rect; 2] = [[8, 69, 206, 81], [140, 4, 206, 122]];
/// What the driver's queries decide: numbers, and the method of `auto`.
const QUERIES: [Rect; 2] = [[8, 33, 113, 69], [30, 9, 113, 21]];
/// Graphs of times.
const GRAPHS: Rect = [300, 157, 474, 259];

/// Graphs of a profile.
const PROFILE: [Rect; 1] = [[8, 134, 310, 278]];
/// The field of the window to find things in: whether a cursor stands in it depends on how busy the machine is.
const FIELD: Rect = [8, 42, 182, 68];

/// Something that a person does.
struct Deed {
    name: String,
    does: Vec<String>,
    /// What leads back to the view of before.
    undoes: Vec<String>,
    masks: Vec<Rect>,
    /// What is done leaves nothing to be seen.
    is_as_before: bool,
}

fn words(text: &str) -> Vec<String> {
    text.split("; ").filter(|word| !word.is_empty()).map(str::to_owned).collect()
}

impl Deed {
    /// Steps are arguments of xdotool, or keys alone; `; ` is between them.
    fn new(name: &str, does: &str, undoes: &str) -> Self {
        let name = name.to_lowercase().replace([' ', ',', '+'], "_");
        Self { name, does: words(does), undoes: words(undoes), masks: Vec::new(), is_as_before: false }
    }

    fn masked(self, masks: &[Rect]) -> Self {
        Self { masks: masks.to_vec(), ..self }
    }

    fn seen_as_before(self) -> Self {
        Self { is_as_before: true, ..self }
    }
}

/// A key as xdotool calls it.
fn key(code: KeyCode) -> String {
    let name = format!("{code:?}");
    match code {
        KeyCode::Open => "ctrl+o".to_owned(),
        KeyCode::Slash => "slash".to_owned(),
        KeyCode::PageUp => "Prior".to_owned(),
        KeyCode::PageDown => "Next".to_owned(),
        KeyCode::Space => "space".to_owned(),
        KeyCode::ControlLeft => "ctrl".to_owned(),
        KeyCode::ShiftLeft => "shift".to_owned(),
        _ => match ["Key", "Digit", "Arrow"].iter().find_map(|start| name.strip_prefix(start)) {
            Some(letter) if letter.len() == 1 => letter.to_lowercase(),
            Some(rest) => rest.to_owned(),
            None => name,
        },
    }
}

/// What is done for an action of the table, and undone: most are toggles.
fn deed(&Entry { key: (code, _), action, label, .. }: &Entry) -> Deed {
    let key = key(code);
    let clear = "Delete; shift+Delete";
    match action {
        Action::Mode(mode) => {
            let is_asked = MODES[mode].has_queries();
            let masks = TIMES.into_iter().chain(QUERIES.into_iter().filter(|_| is_asked));
            Deed::new(label, &format!("h; {key}"), "5; h").masked(&masks.collect::<Vec<_>>())
        }
        Action::Layer(Shown::Graphs) => Deed::new(label, &key, &key).masked(&[GRAPHS]),
        Action::Freeze => Deed::new(label, "f; s; s; s", "f"),
        Action::Alarm => Deed::new(label, "h; k", "k; h").masked(&TIMES),
        Action::Culled => Deed::new(label, "f; s; s; s; o", "o; f"),
        Action::Profile => Deed::new(label, &format!("F5; w; F5; F7; {NOTHING}"), "F7; s").masked(&PROFILE),
        // Of the path of before; its line has the colours of times.
        Action::Heat => Deed::new(label, "q", "q; q"),
        Action::Measure => {
            let click = |at: &str| format!("mousemove --window W {at} sleep 0.3 click 1 sleep 0.3");
            Deed::new(label, &format!("u; {}; {}", click("200 60"), click("300 60")), "u")
        }
        // Without a ground or tubes, a line says so.
        Action::Ground | Action::Tubes => Deed::new(label, &key, "w; s"),
        // No room of the villa has a name.
        Action::Layer(Shown::Names) => Deed::new(label, "n", "n").seen_as_before(),
        Action::Fly => Deed::new(label, "v; w", "s; v"),
        Action::Mirror => Deed::new(label, "Right; t", "t; t; t; t; Left"),
        Action::Pick => Deed::new(label, "y", clear),
        Action::Hide => Deed::new(label, "y; Delete", "shift+Delete"),
        Action::Isolate => Deed::new(label, "y; i", &format!("shift+Delete; {clear}")),
        Action::Hud => Deed::new(label, "h", "h").masked(&TIMES),
        Action::Storey(up) => Deed::new(label, &key, if up { "Next; m" } else { "Prior; m" }),
        // A picture of the plan takes a moment.
        Action::SavePlan => Deed::new(label, "b; sleep 3", "m"),
        Action::Screenshot | Action::Open => Deed::new(label, &key, ""),
        Action::Record => Deed::new(label, "h; F5", "F5; h").masked(&TIMES),
        Action::Play => Deed::new(label, &format!("F5; w; F5; h; F6; {NOTHING}"), "F6; F6; F6; h").masked(&TIMES),
        Action::Find => Deed::new(label, &key, "Escape").masked(&[FIELD]),
        // Nobody here manages windows.
        Action::FullScreen => Deed::new(label, "F11", "F11").seen_as_before(),
        _ => Deed::new(label, &key, &key),
    }
}

/// What is done for a held key: the key, and the one that leads back.
fn held(&HeldKey { key: (code, _), hold, label, .. }: &HeldKey) -> Deed {
    let back = match hold {
        Hold::Forward => "s",
        Hold::Back => "w",
        Hold::Left => "d",
        Hold::Right => "a",
        Hold::TurnLeft => "Right",
        Hold::TurnRight => "Left",
        Hold::LookUp => "Down",
        Hold::LookDown => "Up",
        Hold::Up => return Deed::new(label, "v; space", "ctrl; v"),
        Hold::Down => return Deed::new(label, "v; ctrl", "space; v"),
        Hold::Faster => return Deed::new(label, "shift+w", "shift+s"),
    };
    Deed::new(label, &key(code), back)
}

/// What else is done: by the mouse, and by keys with others.
fn others() -> Vec<Deed> {
    let drag = |from: [usize; 2], to: [usize; 2]| {
        let [[a, b], [c, d]] = [from, to];
        format!("mousemove --window W {a} {b} mousedown 1 sleep 0.2 mousemove --window W {c} {d} sleep 0.2 mouseup 1")
    };
    let wheel = |button: u32, keys: [&str; 2]| {
        let [down, up] = keys;
        format!("mousemove --window W 240 250 sleep 0.2 {down} click {button} sleep 0.2 {up}")
    };
    let click = |[x, y]: [usize; 2]| format!("mousemove --window W {x} {y} sleep 0.3 click 1 sleep 0.3");
    let ctrl = ["keydown ctrl", "keyup ctrl"];
    vec![
        Deed::new("drag to look", &drag([240, 200], [320, 180]), &drag([320, 180], [240, 200])),
        Deed::new("wheel for speed", &format!("h; {}", wheel(4, [""; 2])), &format!("{}; h", wheel(5, [""; 2])))
            .masked(&TIMES),
        Deed::new("ctrl and wheel to zoom", &wheel(4, ctrl), &wheel(5, ctrl)),
        Deed::new("click to open a door", &click([240, 150]), &click([240, 150])),
        Deed::new(
            "Tab to look without dragging",
            "Tab; sleep 0.3 mousemove_relative 60 0",
            "mousemove_relative -- -60 0; Tab",
        ),
        Deed::new("Ctrl+F", "ctrl+f", "Escape").masked(&[FIELD]),
        Deed::new("show all", "y; Delete; shift+Delete", "").seen_as_before(),
        Deed::new("Escape", "F1; Escape", "").seen_as_before(),
        Deed::new("Shift+Z", "z; shift+z", "shift+z; z"),
        Deed::new("Shift+2", "j; shift+2", "j"),
        Deed::new("why", "y; y", "Escape; Delete; shift+Delete"),
        // The list of keys in the settings, a key of it, another key for that; it walks; and it is a key that others can't have.
        Deed::new("another key", &format!("F10; {}; {}; F12", click([188, 210]), click([205, 204])), "F10"),
        Deed::new("walk by another key", "F12", "s"),
        Deed::new("a key that is taken", &format!("F10; {}; v", click([205, 204])), &format!("{}; F10", click([165, 188]))),
        Deed::new(
            "feet and inches",
            &format!("F10; {}; F10; m; y", click([285, 128])),
            &format!("m; Delete; shift+Delete; F10; {}; F10", click([221, 128])),
        ),
    ]
}

/// A window, and what is done in it.
struct Hands<'d> {
    display: &'d Display,
    window: String,
}

impl Hands<'_> {
    fn do_step(&self, step: &str) {
        let step = step.replace(" W ", &format!(" {} ", self.window));
        let args: Vec<&str> = step.split_whitespace().collect();
        if args.len() == 1 {
            self.display.run("xdotool", &["key", "--window", "0", args[0]]);
        } else {
            self.display.run("xdotool", &args);
        }
    }

    fn picture(&self) -> Vec<[u8; 3]> {
        self.display.pixels(&self.window).colours
    }
}

/// How many pixels differ, beside those under masks.
fn differing(a: &[[u8; 3]], b: &[[u8; 3]], masks: &[Rect]) -> usize {
    assert_eq!((a.len(), b.len()), (SIZE[0] * SIZE[1], SIZE[0] * SIZE[1]));
    let is_masked = |i: usize| {
        let (x, y) = (i % SIZE[0], i / SIZE[0]);
        masks.iter().any(|&[left, top, right, bottom]| (left..right).contains(&x) && (top..bottom).contains(&y))
    };
    let differs = |i: usize| a[i].iter().zip(b[i]).any(|(a, b)| a.abs_diff(b) > NEAR);
    (0..a.len()).filter(|&i| differs(i) && !is_masked(i)).count()
}

fn writes() -> bool {
    std::env::var_os("ENFILADE_GOLDEN").is_some_and(|v| v == "write")
}

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/actions").join(name).with_extension("png")
}

fn read(path: &Path) -> Option<Vec<[u8; 3]>> {
    path.exists().then(|| common::read(path))
}

fn write(path: &Path, picture: &[[u8; 3]]) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let [width, height] = SIZE.map(|side| side as u32);
    image::save_buffer(path, picture.as_flattened(), width, height, image::ColorType::Rgb8).unwrap();
}

/// The picture once it stands still.
fn still(hands: &Hands<'_>, masks: &[Rect]) -> Vec<[u8; 3]> {
    let mut last = hands.picture();
    until("picture that stands still", || {
        std::thread::sleep(Duration::from_millis(400));
        let next = hands.picture();
        let stands = differing(&last, &next, masks) == 0;
        last = next;
        stands.then(|| last.clone())
    })
}

/// Compares the window with a frozen picture, or freezes it. Returns what is wrong.
fn compare(hands: &Hands<'_>, name: &str, masks: &[Rect], writes: bool) -> Result<Vec<[u8; 3]>, String> {
    if writes {
        let mut picture = still(hands, masks);
        // What clocks write is in no picture.
        for &[left, top, right, bottom] in masks {
            (top..bottom).for_each(|y| picture[y * SIZE[0]..][left..right].fill([0; 3]));
        }
        write(&golden(name), &picture);
        return Ok(picture);
    }
    let Some(wanted) = read(&golden(name)) else {
        return Err(format!("{name}: no picture; ENFILADE_GOLDEN=write makes one"));
    };
    let mut off = 0;
    for _ in 0..TRIES {
        off = differing(&hands.picture(), &wanted, masks);
        if off <= MAY_DIFFER {
            return Ok(wanted);
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("actions").join(name).with_extension("png");
    write(&out, &hands.picture());
    Err(format!("{name}: {off} pixels differ; see {}", out.display()))
}

/// So many pictures, tenths of a second apart, are looked at before one is wrong.
const TRIES: usize = 300;

/// The view of before, once more. A line at the bottom goes by and by.
fn is_back(hands: &Hands<'_>, base: &[[u8; 3]]) -> bool {
    (0..TRIES).any(|_| {
        std::thread::sleep(Duration::from_millis(80));
        let off = differing(&hands.picture(), base, &[]);
        if off > MAY_DIFFER {
            hands.do_step(NOTHING);
        }
        off <= MAY_DIFFER
    })
}

fn deeds() -> Vec<Deed> {
    let keys = TABLE.iter().map(deed);
    keys.chain(HOLDS.iter().map(held)).chain(others()).collect()
}

#[test]
fn every_action_has_a_picture_and_no_picture_is_left_over() {
    if writes() {
        return;
    }
    let wanted: Vec<PathBuf> = deeds().iter().map(|deed| golden(&deed.name)).chain([golden("before")]).collect();
    let missing: Vec<_> = wanted.iter().filter(|path| !path.exists()).collect();
    assert!(missing.is_empty(), "no pictures of these; ENFILADE_GOLDEN=write makes them: {missing:?}");
    let there = std::fs::read_dir(golden("before").parent().unwrap()).unwrap().map(|entry| entry.unwrap().path());
    let left: Vec<_> = there.filter(|path| !wanted.contains(path)).collect();
    assert!(left.is_empty(), "pictures of no action: {left:?}");
    assert!(wanted.len() > TABLE.len() + HOLDS.len());
}

#[test]
fn every_action_does_in_a_window_what_its_picture_shows() {
    if cfg!(feature = "gamepad") {
        eprintln!("not run: pictures are of a build without gamepads, which add lines to the settings and the list of keys");
        return;
    }
    if !can_run("every_action_does_in_a_window_what_its_picture_shows") {
        return;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("viewer_actions");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("enfilade")).unwrap();
    std::fs::copy(shipped("villa_rotonda", "glb"), folder.join("villa.glb")).unwrap();
    let file = building("villa_rotonda").file;
    file.save(&folder.join("villa.pvs")).unwrap();
    let settings = format!(
        r#"{{"text": 0.7, "plan": false, "detail": "plain", "mode": "both",
        "places": [{{"model": "{:032x}", "eye": {:?}, "yaw": {}, "pitch": {}}}]}}"#,
        file.model_hash,
        (EYE - file.origin).to_array(),
        LOOK[0],
        LOOK[1]
    );
    std::fs::write(folder.join("enfilade/viewer.json"), settings).unwrap();
    let display = Display::open();
    let mut command = Command::new(env!("CARGO_BIN_EXE_enfilade-viewer"));
    // Names of files are told, so they are short; and no dialog of this machine's opens.
    command.current_dir(&folder).args(["villa.pvs", "--steps", "--size", &format!("{}x{}", SIZE[0], SIZE[1])]);
    command.env("DISPLAY", &display.name).env("XDG_CONFIG_HOME", &folder).env_remove("WAYLAND_DISPLAY");
    command.env("PATH", "").env("DBUS_SESSION_BUS_ADDRESS", "unix:path=/nowhere");
    let _running = Ends(command.spawn().expect("the viewer starts"));
    let window = until("window", || display.find("villa.* - Enfilade"));
    display.run("xdotool", &["windowfocus", &window]);
    let hands = Hands { display: &display, window };
    let colours = |picture: &[[u8; 3]]| picture.iter().collect::<std::collections::BTreeSet<_>>().len();
    until("picture", || (colours(&hands.picture()) > 30).then_some(()));
    hands.do_step("h");

    let writes = writes();
    let base = compare(&hands, "before", &[], writes).unwrap();
    let mut wrong = Vec::new();
    for deed in deeds() {
        deed.does.iter().for_each(|step| hands.do_step(step));
        match compare(&hands, &deed.name, &deed.masks, writes) {
            Ok(picture) => {
                let changed = differing(&picture, &base, &deed.masks) > MAY_DIFFER;
                if changed == deed.is_as_before {
                    wrong.push(format!("{}: the picture is {}that of before", deed.name, if changed { "not " } else { "" }));
                }
            }
            Err(line) => wrong.push(line),
        }
        deed.undoes.iter().for_each(|step| hands.do_step(step));
        if !is_back(&hands, &base) {
            let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("actions").join(format!("{}.after.png", deed.name));
            write(&out, &hands.picture());
            wrong.push(format!("{}: the view of before doesn't come back; see {}", deed.name, out.display()));
            break;
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
