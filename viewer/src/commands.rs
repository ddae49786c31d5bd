//! The commands of the viewer. [`TABLE`] has an entry for each action with its key, button, help and state: the list on F1, the buttons, the
//! settings and the table in docs/viewer.md are made from it. [`Session::execute`] does what a command says.

use crate::args::Shown;
use crate::colours::Tints;
use crate::draw::tubes::Look;
use crate::find::FindTarget;
use crate::gamepad;
use crate::keymap::{Bound, KeyMap};
use crate::looks::Detail;
use crate::session::Session;
use crate::settings::Preferences;
use enfilade::CellId;
use enfilade_terrain::Limit;
use glam::DVec2;
use winit::keyboard::KeyCode;

/// Something that a person wants: an action of the table, or what a panel asks for, with a value.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Command {
    /// An action.
    Act(Action),
    /// Go to a point (x, z) of the storey with this number.
    GoToPlan(usize, DVec2),
    /// Write the plan of the storey with this number.
    SavePlan(usize),
    /// Go to something that was found.
    GoTo(FindTarget),
    /// Ask whether the first cell sees the second.
    Why([CellId; 2]),
    /// Close the answer.
    CloseWhy,
    /// Fly along the line that the answer shows.
    FlyAlongSight,
    /// A level section (false) or an upright one, at its usual place.
    SetSection(bool),
    /// Move the section to this offset along its axis, metres relative to the origin.
    MoveSection(f64),
    /// Measure the profile again.
    ProfileAgain,
    /// Go to a frame of the profile.
    ProfileFrame(usize),
    /// Write the profile.
    SaveProfile,
    /// Save the recording and quit.
    SaveAndQuit,
    /// Quit.
    Quit,
    /// Do not quit.
    Stay,
    /// Other preferences.
    SetPreferences(Preferences),
    /// Another vertical opening angle, radians.
    SetFieldOfView(f64),
    /// Another detail.
    SetDetail(Detail),
    /// The next key that goes down is the key of this.
    WaitForKey(Bound),
    /// Every action has its usual key.
    UsualKeys,
    /// Another error limit of the ground.
    SetGroundLimit(Limit),
    /// Another look of tubes.
    SetTubeLook(Look),
}

impl From<Action> for Command {
    fn from(action: Action) -> Self {
        Self::Act(action)
    }
}

/// An action: done once when its key goes down.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Action {
    /// Culls by the mode with this number in [`crate::culling::MODES`].
    Mode(usize),
    /// Freezes the culling, or goes on.
    Freeze,
    /// See [`crate::colours::Tints`].
    Cells,
    /// Colours of triangles: seen, drawn in vain, culled.
    Waste,
    /// Culled objects over a frozen frame.
    Culled,
    /// Another mode beside the first.
    Split,
    /// Culls the other half by the mode with this number.
    OtherMode(usize),
    /// Measures a path.
    Profile,
    /// Colours of what a profile has found.
    Heat,
    /// See [`crate::looks::Detail`].
    Detail,
    /// Shows something over the picture, or no longer: none of cells, mirrors, sections, ground, tubes and `why`.
    Layer(Shown),
    /// The alarm.
    Alarm,
    /// Walks or flies.
    Fly,
    /// Opens or shuts the door ahead.
    Door,
    /// Hangs a mirror on the wall ahead; takes all down where there is no more room.
    Mirror,
    /// Picks what is ahead, for `why`.
    Pick,
    /// Counters.
    Hud,
    /// The buttons.
    Menu,
    /// The settings.
    Preferences,
    /// A picture of what is on the screen, as a file.
    Screenshot,
    /// Begins to record a path, or ends it and saves it.
    Record,
    /// Goes along the last path, or stops there.
    Play,
    /// The whole screen, or a window.
    FullScreen,
    /// The plan of the storey above (true) or below; a second time, goes there.
    Storey(bool),
    /// Opens or shuts the window to find things in.
    Find,
    /// Hides what was picked or found.
    Hide,
    /// Hides all else.
    Isolate,
    /// Shows all that was hidden.
    ShowAll,
    /// Writes the plan that is shown beside the model.
    SavePlan,
    /// Begins or ends a section.
    Section,
    /// A level section instead of an upright one, or the reverse.
    TurnSection,
    /// Begins to measure, or ends it.
    Measure,
    /// Asks which other file to open.
    Open,
    /// People that walk about.
    People,
    /// Tiles of the ground.
    Ground,
    /// Sides of tubes.
    Tubes,
}

/// A movement: done while its key is held.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[expect(missing_docs, reason = "their names say it")]
pub enum Hold {
    Forward,
    Left,
    Back,
    Right,
    TurnLeft,
    TurnRight,
    LookUp,
    LookDown,
    Up,
    Down,
    Faster,
}

/// An action in the table.
pub struct Entry {
    /// The action.
    pub action: Action,
    /// Its usual key, and the key's name.
    pub key: (KeyCode, &'static str),
    /// With Ctrl, this key does it too; and the name of both keys.
    pub chord: Option<(KeyCode, &'static str)>,
    /// With Shift, its key does this instead.
    pub shifted: Option<Action>,
    /// Its button, and its name in the settings.
    pub label: &'static str,
    /// What it does.
    pub help: &'static str,
    /// Whether it is on.
    pub is_on: fn(&Session<'_>) -> bool,
}

impl Entry {
    const fn with_ctrl(self, key: KeyCode, name: &'static str) -> Self {
        Self { chord: Some((key, name)), ..self }
    }

    const fn with_shift(self, action: Action) -> Self {
        Self { shifted: Some(action), ..self }
    }
}

const fn entry(
    key: (KeyCode, &'static str),
    action: Action,
    label: &'static str,
    help: &'static str,
    is_on: fn(&Session<'_>) -> bool,
) -> Entry {
    Entry { action, key, chord: None, shifted: None, label, help, is_on }
}

/// The state of an action that is done at once.
const NEVER: fn(&Session<'_>) -> bool = |_| false;

/// All actions that have a key.
pub static TABLE: [Entry; 46] = [
    entry((KeyCode::Digit1, "1"), Action::Mode(0), "None", "cull nothing", |s| s.has_mode(0))
        .with_shift(Action::OtherMode(0)),
    entry((KeyCode::Digit2, "2"), Action::Mode(1), "Frustum", "cull by the view frustum", |s| s.has_mode(1))
        .with_shift(Action::OtherMode(1)),
    entry((KeyCode::Digit3, "3"), Action::Mode(2), "Portals", "cull through portals", |s| s.has_mode(2))
        .with_shift(Action::OtherMode(2)),
    entry((KeyCode::Digit4, "4"), Action::Mode(3), "PVS", "cull by rows (PVS)", |s| s.has_mode(3))
        .with_shift(Action::OtherMode(3)),
    entry((KeyCode::Digit5, "5"), Action::Mode(4), "Both", "cull by both", |s| s.has_mode(4))
        .with_shift(Action::OtherMode(4)),
    entry((KeyCode::Digit6, "6"), Action::Mode(5), "CHC", "both, and occlusion queries (CHC)", |s| s.has_mode(5))
        .with_shift(Action::OtherMode(5)),
    entry((KeyCode::Digit7, "7"), Action::Mode(6), "Auto", "CHC in open cells, portals and rows elsewhere (auto)", |s| {
        s.has_mode(6)
    })
    .with_shift(Action::OtherMode(6)),
    entry((KeyCode::KeyF, "F"), Action::Freeze, "Freeze", "freeze the culling and fly out, or resume", |s| s.is_frozen()),
    entry((KeyCode::KeyC, "C"), Action::Cells, "Cells", "colours of cells", |s| s.view.tints == Tints::Cells),
    entry((KeyCode::Digit8, "8"), Action::Waste, "Waste", "colours: seen, drawn in vain, culled, with their shares", |s| {
        s.view.tints == Tints::Waste
    }),
    entry((KeyCode::KeyO, "O"), Action::Culled, "Culled", "while frozen, show culled objects as grey glass", |s| {
        s.view.culled
    }),
    entry((KeyCode::KeyJ, "J"), Action::Split, "Split", "a second mode in the right half; Shift+1 to 7 choose it", |s| {
        s.insight.split.is_some()
    }),
    entry(
        (KeyCode::F7, "F7"),
        Action::Profile,
        "Profile",
        "measure the last path frame by frame: time, triangles, missed pixels",
        |s| s.insight.shows_profile,
    ),
    entry(
        (KeyCode::KeyQ, "Q"),
        Action::Heat,
        "Heat",
        "colours from the profile: frames seen; triangles drawn in vain; off",
        |s| matches!(s.view.tints, Tints::Seen | Tints::InVain),
    ),
    entry((KeyCode::KeyL, "L"), Action::Detail, "Detail", "materials, or flat colours", |s| s.view.detail != Detail::Plain),
    entry((KeyCode::KeyP, "P"), Action::Layer(Shown::Portals), "Outlines", "outlines of portals", |s| s.view.layers.portals),
    entry((KeyCode::KeyR, "R"), Action::Layer(Shown::Rectangles), "Rectangles", "portals' rectangles on the screen", |s| {
        s.view.layers.rectangles
    }),
    entry(
        (KeyCode::KeyM, "M"),
        Action::Layer(Shown::Plan),
        "Plan",
        "plan of the storey; click to go there, wheel to zoom, drag to move",
        |s| s.view.layers.plan,
    ),
    entry(
        (KeyCode::PageUp, "Page Up"),
        Action::Storey(true),
        "Storey up",
        "plan of the storey above; again: go there",
        NEVER,
    ),
    entry(
        (KeyCode::PageDown, "Page Down"),
        Action::Storey(false),
        "Storey down",
        "plan of the storey below; again: go there",
        NEVER,
    ),
    entry((KeyCode::KeyB, "B"), Action::SavePlan, "Save plan", "write the plan beside the model, as SVG and PNG", NEVER),
    entry((KeyCode::KeyX, "X"), Action::Layer(Shown::Matrix), "Matrix", "visibility matrix; click a pair for why", |s| {
        s.view.layers.matrix
    }),
    entry((KeyCode::KeyG, "G"), Action::Layer(Shown::Graphs), "Graphs", "graphs", |s| s.view.layers.graphs),
    entry((KeyCode::KeyK, "K"), Action::Alarm, "Alarm", "missed-pixel alarm", |s| s.view.layers.alarm),
    entry((KeyCode::KeyV, "V"), Action::Fly, "Fly", "walk or fly", |s| s.motion.walker.flies),
    entry((KeyCode::KeyE, "E"), Action::Door, "Door", "open or shut the door ahead (or click it)", NEVER),
    entry((KeyCode::KeyT, "T"), Action::Mirror, "Mirror", "hang a mirror on the wall ahead", NEVER),
    entry(
        (KeyCode::KeyY, "Y"),
        Action::Pick,
        "Pick",
        "pick the object ahead (or click it); a second pick explains whether one sees the other",
        NEVER,
    ),
    entry(
        (KeyCode::Slash, "/, Ctrl+F"),
        Action::Find,
        "Find",
        "find a room, a node, a type, a property or a material",
        |s| s.panels.find.is_open,
    )
    .with_ctrl(KeyCode::KeyF, "Ctrl+F"),
    entry(
        (KeyCode::KeyZ, "Z"),
        Action::Section,
        "Section",
        "cut the building (Shift+Z: level or facing; Shift and the wheel move the cut)",
        |s| s.section.is_on,
    )
    .with_shift(Action::TurnSection),
    entry((KeyCode::KeyU, "U"), Action::Measure, "Measure", "measure between two clicks", |s| s.measure.is_on),
    entry((KeyCode::KeyN, "N"), Action::Layer(Shown::Names), "Names", "names and areas of rooms", |s| s.view.layers.names),
    entry((KeyCode::Digit9, "9"), Action::Ground, "Ground", "tiles of the ground by level, and their error limit", |s| {
        s.shows_tiles()
    }),
    entry((KeyCode::Digit0, "0"), Action::Tubes, "Tubes", "sides of tubes as colours, and their error limit", |s| {
        s.shows_sides()
    }),
    entry(
        (KeyCode::Delete, "Delete"),
        Action::Hide,
        "Hide",
        "hide the picked or found objects (Shift+Delete: show all)",
        NEVER,
    )
    .with_shift(Action::ShowAll),
    entry((KeyCode::KeyI, "I"), Action::Isolate, "Isolate", "show only the picked or found objects", NEVER),
    entry((KeyCode::KeyH, "H"), Action::Hud, "Counters", "counters", |s| s.view.hud),
    entry((KeyCode::F1, "F1"), Action::Layer(Shown::Keys), "Keys", "this list", |s| s.view.keys),
    entry((KeyCode::F2, "F2"), Action::Screenshot, "Screenshot", "save a picture without the panels", NEVER),
    entry((KeyCode::F3, "F3"), Action::Menu, "Menu", "buttons for all these actions", |s| s.view.menu),
    entry((KeyCode::F4, "F4"), Action::People, "People", "people that walk about", |s| s.view.people),
    entry((KeyCode::F5, "F5"), Action::Record, "Record", "record a path, or stop and save it", |s| {
        s.motion.paths.is_recording()
    }),
    entry((KeyCode::F6, "F6"), Action::Play, "Play", "play the last path, or stop", |s| s.motion.paths.is_playing()),
    entry((KeyCode::F10, "F10"), Action::Preferences, "Settings", "settings", |s| s.view.preferences),
    entry((KeyCode::F11, "F11"), Action::FullScreen, "Full screen", "full screen, or a window", NEVER),
    entry((KeyCode::Open, "Ctrl+O"), Action::Open, "Open", "open another file (or drop it on the window)", NEVER)
        .with_ctrl(KeyCode::KeyO, "Ctrl+O"),
];

/// The entry of an action; `None` if it has no key of its own.
pub fn entry_of(action: Action) -> Option<&'static Entry> {
    TABLE.iter().find(|entry| entry.action == action)
}

/// A key that is held.
pub struct HeldKey {
    /// The usual key, and its name.
    pub key: (KeyCode, &'static str),
    /// What it does.
    pub hold: Hold,
    /// Its name in the settings.
    pub label: &'static str,
    /// Help; several keys may share it.
    pub help: &'static str,
}

const fn held(key: KeyCode, name: &'static str, hold: Hold, label: &'static str, help: &'static str) -> HeldKey {
    HeldKey { key: (key, name), hold, label, help }
}

/// All keys that are held.
pub static HOLDS: [HeldKey; 11] = [
    held(KeyCode::KeyW, "W", Hold::Forward, "forward", "walk"),
    held(KeyCode::KeyA, "A", Hold::Left, "to the left", "walk"),
    held(KeyCode::KeyS, "S", Hold::Back, "back", "walk"),
    held(KeyCode::KeyD, "D", Hold::Right, "to the right", "walk"),
    held(KeyCode::ArrowLeft, "Left", Hold::TurnLeft, "turn left", "turn"),
    held(KeyCode::ArrowRight, "Right", Hold::TurnRight, "turn right", "turn"),
    held(KeyCode::ArrowUp, "Up", Hold::LookUp, "look up", "turn"),
    held(KeyCode::ArrowDown, "Down", Hold::LookDown, "look down", "turn"),
    held(KeyCode::Space, "Space", Hold::Up, "up, flying", "up and down, flying"),
    held(KeyCode::ControlLeft, "Ctrl", Hold::Down, "down, flying", "up and down, flying"),
    held(KeyCode::ShiftLeft, "Shift", Hold::Faster, "faster", "faster"),
];

/// Help for what has no key.
const OTHER: [(&str, &str); 3] = [
    ("Mouse", "drag to look; Tab: look without dragging"),
    ("Wheel", "speed; with Ctrl: zoom; with Shift: the section"),
    ("Esc", "let go of the mouse; close a panel; quit"),
];

/// A line of the list of keys.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Line {
    /// The key, or several.
    pub keys: String,
    /// The button, if there is one.
    pub label: &'static str,
    /// What it does.
    pub help: &'static str,
}

/// The list of keys: those that are held, then others, then all actions.
pub fn lines(keys: &KeyMap) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    for &HeldKey { hold, help, .. } in &HOLDS {
        let name = keys.name(Bound::Hold(hold));
        match lines.last_mut().filter(|last| last.help == help) {
            Some(last) => last.keys += &format!(" {name}"),
            None => lines.push(Line { keys: name, label: "", help }),
        }
    }
    let line = |(keys, help): (&str, _)| Line { keys: keys.to_owned(), label: "", help };
    lines.extend(OTHER.map(line));
    if cfg!(feature = "gamepad") {
        lines.extend(gamepad::HELP.map(line));
    }
    lines.extend(TABLE.iter().map(|e| Line { keys: keys.name_of(e.action), label: e.label, help: e.help }));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things_and_every_mode_has_one() {
        let codes: Vec<KeyCode> = TABLE.iter().map(|e| e.key.0).chain(HOLDS.iter().map(|e| e.key.0)).collect();
        assert!((1..codes.len()).all(|i| !codes[..i].contains(&codes[i])));
        // Labels tell actions apart in the settings.
        let labels: Vec<&str> = TABLE.iter().map(|e| e.label).chain(HOLDS.iter().map(|e| e.label)).collect();
        assert!((1..labels.len()).all(|i| !labels[..i].contains(&labels[i])));
        let modes = TABLE.iter().filter(|entry| matches!(entry.action, Action::Mode(_))).count();
        assert_eq!(modes, crate::culling::MODES.len());
        let keys = KeyMap::default();
        assert_eq!(keys.action(KeyCode::KeyF, [false, true]), Some(Action::Freeze));
        assert_eq!(keys.action(KeyCode::KeyF, [true, false]), Some(Action::Find));
        assert_eq!(keys.action(KeyCode::KeyO, [true, false]), Some(Action::Open));
        assert_eq!(keys.action(KeyCode::Delete, [false, false]), Some(Action::Hide));
        assert_eq!(keys.action(KeyCode::Delete, [false, true]), Some(Action::ShowAll));
    }

    #[test]
    fn the_list_has_the_keys_that_a_person_chose() {
        let mut keys = KeyMap::default();
        keys.give(Bound::Act(Action::Fly), KeyCode::F20).unwrap();
        keys.give(Bound::Hold(Hold::Back), KeyCode::F19).unwrap();
        let lines = lines(&keys);
        let has = |keys: &str, help: &str| lines.iter().any(|line| line.keys == keys && line.help == help);
        assert!(has("F20", "walk or fly") && has("W A F19 D", "walk"));
    }

    /// `ENFILADE_GOLDEN=write` writes the table anew.
    #[test]
    fn the_manual_has_this_table() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/viewer.md");
        let manual = std::fs::read_to_string(&path).unwrap();
        let row = |Line { keys, label, help }: Line| format!("| {keys} | {label} | {help} |\n");
        let rows: String = lines(&KeyMap::default())
            .into_iter()
            .filter(|line| !gamepad::HELP.contains(&(&line.keys, line.help)))
            .map(row)
            .collect();
        let table = format!("| key | button | |\n| --- | --- | --- |\n{rows}");
        if std::env::var_os("ENFILADE_GOLDEN").is_some_and(|v| v == "write") {
            let start = manual.find("| key | button | |\n").expect("a table of keys");
            let end = start + manual[start..].find("\n\n").expect("its end") + 1;
            std::fs::write(&path, [&manual[..start], &table, &manual[end..]].concat()).unwrap();
        } else {
            assert!(manual.contains(&table), "docs/viewer.md lacks this table; ENFILADE_GOLDEN=write writes it:\n{table}");
        }
    }
}
