//! The keys: one table, for who presses them, for the list on F1, and for the buttons of [`super::toolbar`].

use crate::args::Shown;
use crate::gamepad;
use crate::keymap::{Bound, KeyMap};
use winit::keyboard::KeyCode;

/// What a key does, once, when it goes down.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Action {
    /// Culls by the mode with this number in [`crate::culling::MODES`].
    Mode(usize),
    /// Freezes the culling, or goes on.
    Freeze,
    /// See [`crate::colours::Tints`].
    Cells,
    /// What is seen, drawn in vain and culled, in colours.
    Waste,
    /// What was culled, over a frozen frame.
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
    /// Records where somebody goes; once more, and the path is a file.
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
    /// Tiles of the ground.
    Ground,
    /// Sides of tubes.
    Tubes,
}

/// What a key does while it is held.
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

/// A key, its name, what it does, its button, and what it does in words.
pub type Key = (KeyCode, &'static str, Action, &'static str, &'static str);

/// All of them.
pub const KEYS: [Key; 45] = [
    (KeyCode::Digit1, "1", Action::Mode(0), "None", "cull nothing"),
    (KeyCode::Digit2, "2", Action::Mode(1), "Frustum", "cull by the view frustum"),
    (KeyCode::Digit3, "3", Action::Mode(2), "Portals", "cull through portals"),
    (KeyCode::Digit4, "4", Action::Mode(3), "PVS", "cull by rows (PVS)"),
    (KeyCode::Digit5, "5", Action::Mode(4), "Both", "cull by both"),
    (KeyCode::Digit6, "6", Action::Mode(5), "CHC", "both, and occlusion queries (CHC)"),
    (KeyCode::Digit7, "7", Action::Mode(6), "Auto", "whatever costs the least here (auto)"),
    (KeyCode::KeyF, "F", Action::Freeze, "Freeze", "freeze the culling and fly out, or go on"),
    (KeyCode::KeyC, "C", Action::Cells, "Cells", "colours of cells"),
    (KeyCode::Digit8, "8", Action::Waste, "Waste", "colours: seen, drawn in vain, culled, with their shares"),
    (KeyCode::KeyO, "O", Action::Culled, "Culled", "while frozen, show what was culled as grey glass"),
    (KeyCode::KeyJ, "J", Action::Split, "Split", "another mode in the right half; Shift+1 to 7 choose it"),
    (KeyCode::F7, "F7", Action::Profile, "Profile", "measure the last path frame by frame: time, triangles, missed pixels"),
    (KeyCode::KeyQ, "Q", Action::Heat, "Heat", "colours from the profile: how often seen; what is drawn in vain; off"),
    (KeyCode::KeyL, "L", Action::Detail, "Detail", "as it looks, or in flat colours"),
    (KeyCode::KeyP, "P", Action::Layer(Shown::Portals), "Outlines", "outlines of portals"),
    (KeyCode::KeyR, "R", Action::Layer(Shown::Rectangles), "Rectangles", "portals' rectangles on the screen"),
    (
        KeyCode::KeyM,
        "M",
        Action::Layer(Shown::Plan),
        "Plan",
        "plan of the storey; click to go there, wheel and drag to look closer",
    ),
    (KeyCode::PageUp, "Page Up", Action::Storey(true), "Storey up", "plan of the storey above; once more: go there"),
    (KeyCode::PageDown, "Page Down", Action::Storey(false), "Storey down", "plan of the storey below; once more: go there"),
    (KeyCode::KeyB, "B", Action::SavePlan, "Save plan", "write the plan beside the model, as SVG and PNG"),
    (KeyCode::KeyX, "X", Action::Layer(Shown::Matrix), "Matrix", "visibility matrix; click a pair for why"),
    (KeyCode::KeyG, "G", Action::Layer(Shown::Graphs), "Graphs", "graphs"),
    (KeyCode::KeyK, "K", Action::Alarm, "Alarm", "missed-pixel alarm"),
    (KeyCode::KeyV, "V", Action::Fly, "Fly", "walk or fly"),
    (KeyCode::KeyE, "E", Action::Door, "Door", "open or shut the door ahead (or click it)"),
    (KeyCode::KeyT, "T", Action::Mirror, "Mirror", "hang a mirror on the wall ahead"),
    (
        KeyCode::KeyY,
        "Y",
        Action::Pick,
        "Pick",
        "pick what is ahead (or click it); a second pick: why does one see the other?",
    ),
    (KeyCode::Slash, "/, Ctrl+F", Action::Find, "Find", "find a room, a node, a type, a property or a material"),
    (
        KeyCode::KeyZ,
        "Z",
        Action::Section,
        "Section",
        "cut the building (Shift+Z: level or facing; Shift and the wheel move the cut)",
    ),
    (KeyCode::KeyU, "U", Action::Measure, "Measure", "measure between two clicks"),
    (KeyCode::KeyN, "N", Action::Layer(Shown::Names), "Names", "names and areas of rooms"),
    (KeyCode::Digit9, "9", Action::Ground, "Ground", "tiles of the ground by level, and how fine they are"),
    (KeyCode::Digit0, "0", Action::Tubes, "Tubes", "sides of tubes as colours, and how fine they are"),
    (KeyCode::Delete, "Delete", Action::Hide, "Hide", "hide what was picked or found (Shift+Delete: show all again)"),
    (KeyCode::KeyI, "I", Action::Isolate, "Isolate", "show only what was picked or found"),
    (KeyCode::KeyH, "H", Action::Hud, "Counters", "counters"),
    (KeyCode::F1, "F1", Action::Layer(Shown::Keys), "Keys", "this list"),
    (KeyCode::F2, "F2", Action::Screenshot, "Screenshot", "save a picture without the panels"),
    (KeyCode::F3, "F3", Action::Menu, "Menu", "buttons for all of these"),
    (KeyCode::F5, "F5", Action::Record, "Record", "record a path, or stop and save it"),
    (KeyCode::F6, "F6", Action::Play, "Play", "play the last path, or stop"),
    (KeyCode::F10, "F10", Action::Preferences, "Settings", "settings"),
    (KeyCode::F11, "F11", Action::FullScreen, "Full screen", "full screen, or a window"),
    (KeyCode::Open, "Ctrl+O", Action::Open, "Open", "open another file (or drop it on the window)"),
];

/// What keys do with Ctrl, whatever they do without: keys, actions, and their names.
pub const CHORDS: [(KeyCode, Action, &str); 2] =
    [(KeyCode::KeyF, Action::Find, "Ctrl+F"), (KeyCode::KeyO, Action::Open, "Ctrl+O")];

/// A key that is held, its name, what it does, a label, and what it does in words; what is done by several keys has the same words.
pub type HeldKey = (KeyCode, &'static str, Hold, &'static str, &'static str);

/// All of them.
pub const HOLDS: [HeldKey; 11] = [
    (KeyCode::KeyW, "W", Hold::Forward, "forward", "walk"),
    (KeyCode::KeyA, "A", Hold::Left, "to the left", "walk"),
    (KeyCode::KeyS, "S", Hold::Back, "back", "walk"),
    (KeyCode::KeyD, "D", Hold::Right, "to the right", "walk"),
    (KeyCode::ArrowLeft, "Left", Hold::TurnLeft, "turn left", "turn"),
    (KeyCode::ArrowRight, "Right", Hold::TurnRight, "turn right", "turn"),
    (KeyCode::ArrowUp, "Up", Hold::LookUp, "look up", "turn"),
    (KeyCode::ArrowDown, "Down", Hold::LookDown, "look down", "turn"),
    (KeyCode::Space, "Space", Hold::Up, "up, flying", "up and down, flying"),
    (KeyCode::ControlLeft, "Ctrl", Hold::Down, "down, flying", "up and down, flying"),
    (KeyCode::ShiftLeft, "Shift", Hold::Faster, "faster", "faster"),
];

/// What else there is, in words.
const OTHER: [(&str, &str); 3] = [
    ("Mouse", "drag to look; Tab: look without dragging"),
    ("Wheel", "speed; with Ctrl: zoom; with Shift: the section"),
    ("Esc", "let go of the mouse; close a panel; quit"),
];

/// Two columns of the list are less wide than this, points; one is, in a window that is narrower.
const WIDE: f32 = 860.0;
/// Room around the list, points: its title, and a bit of the picture.
const MARGIN: egui::Vec2 = egui::vec2(32.0, 80.0);

/// The lines of the list: what is pressed, and what it does.
pub fn lines(keys: &KeyMap) -> Vec<(String, &'static str)> {
    let mut lines: Vec<(String, &'static str)> = Vec::new();
    for (_, _, hold, _, words) in HOLDS {
        let name = keys.name(Bound::Hold(hold));
        match lines.last_mut().filter(|last| last.1 == words) {
            Some((names, _)) => *names += &format!(" {name}"),
            None => lines.push((name, words)),
        }
    }
    lines.extend(OTHER.map(|(name, words)| (name.to_owned(), words)));
    if cfg!(feature = "gamepad") {
        lines.extend(gamepad::HELP.map(|(name, words)| (name.to_owned(), words)));
    }
    lines.extend(KEYS.iter().map(|(_, _, action, _, words)| (keys.name_of(*action), *words)));
    lines
}

/// The list on the screen.
pub fn show(ui: &mut egui::Ui, keys: &KeyMap) {
    let window = egui::Window::new("Keys").anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).collapsible(false);
    let room = ui.ctx().content_rect().size() - MARGIN;
    window.resizable(false).default_height(room.y).show(ui.ctx(), |ui| {
        let lines = lines(keys);
        // Side by side where they fit; below each other they are higher than a small window.
        let columns = if room.x > WIDE { 2 } else { 1 };
        egui::ScrollArea::vertical().max_height(room.y).show(ui, |ui| {
            ui.horizontal_top(|ui| {
                for (column, lines) in lines.chunks(lines.len().div_ceil(columns)).enumerate() {
                    egui::Grid::new(("keys", column)).num_columns(2).striped(true).show(ui, |ui| {
                        for (name, words) in lines {
                            ui.strong(name);
                            ui.label(*words);
                            ui.end_row();
                        }
                    });
                }
            });
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things_and_every_mode_has_one() {
        for (i, key) in KEYS.iter().enumerate() {
            assert!(KEYS[..i].iter().all(|other| other.0 != key.0 && other.2 != key.2), "{key:?}");
        }
        let modes = KEYS.iter().filter(|key| matches!(key.2, Action::Mode(_))).count();
        assert_eq!(modes, crate::culling::MODES.len());
        let keys = KeyMap::default();
        assert_eq!(keys.action(KeyCode::KeyF, [false, true]), Some(Action::Freeze));
        assert_eq!(keys.action(KeyCode::KeyF, [true, false]), Some(Action::Find));
        assert_eq!(keys.action(KeyCode::KeyO, [true, false]), Some(Action::Open));
        assert_eq!(keys.action(KeyCode::Delete, [false, false]), Some(Action::Hide));
        assert_eq!(keys.action(KeyCode::Delete, [false, true]), Some(Action::ShowAll));
        let codes: Vec<KeyCode> = KEYS.iter().map(|key| key.0).chain(HOLDS.iter().map(|key| key.0)).collect();
        assert!((1..codes.len()).all(|i| !codes[..i].contains(&codes[i])));
        // Labels tell actions apart in the settings.
        let labels: Vec<&str> = KEYS.iter().map(|key| key.3).chain(HOLDS.iter().map(|key| key.3)).collect();
        assert!((1..labels.len()).all(|i| !labels[..i].contains(&labels[i])));
    }

    #[test]
    fn every_action_is_in_the_list_with_its_key() {
        for (_, name, action, label, words) in KEYS {
            assert!(!label.is_empty() && !words.is_empty(), "{action:?}");
            let lines = lines(&KeyMap::default());
            assert_eq!(lines.iter().filter(|line| (line.0.as_str(), line.1) == (name, words)).count(), 1, "{action:?}");
        }
        let mut keys = KeyMap::default();
        keys.give(Bound::Act(Action::Fly), KeyCode::F20).unwrap();
        keys.give(Bound::Hold(Hold::Back), KeyCode::F19).unwrap();
        let lines = lines(&keys);
        assert!(lines.contains(&("F20".to_owned(), "walk or fly")) && lines.contains(&("W A F19 D".to_owned(), "walk")));
    }
}
