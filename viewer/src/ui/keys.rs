//! The keys: one table, for who presses them and for the list on F1.

use crate::args::Shown;
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
    /// See [`crate::looks::Detail`].
    Detail,
    /// Shows something over the picture, or no longer: none of cells, mirrors and `why`.
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
}

/// A key, its name, what it does, and that in words.
pub type Key = (KeyCode, &'static str, Action, &'static str);

/// All of them.
pub const KEYS: [Key; 28] = [
    (KeyCode::Digit1, "1", Action::Mode(0), "cull nothing"),
    (KeyCode::Digit2, "2", Action::Mode(1), "cull by the view frustum"),
    (KeyCode::Digit3, "3", Action::Mode(2), "cull through portals"),
    (KeyCode::Digit4, "4", Action::Mode(3), "cull by rows (PVS)"),
    (KeyCode::Digit5, "5", Action::Mode(4), "cull by both"),
    (KeyCode::Digit6, "6", Action::Mode(5), "both, and occlusion queries (CHC)"),
    (KeyCode::Digit7, "7", Action::Mode(6), "whatever costs the least here (auto)"),
    (KeyCode::KeyF, "F", Action::Freeze, "freeze the culling and fly out, or go on"),
    (KeyCode::KeyC, "C", Action::Cells, "colours of cells"),
    (KeyCode::KeyL, "L", Action::Detail, "as it looks, or in flat colours"),
    (KeyCode::KeyP, "P", Action::Layer(Shown::Portals), "outlines of portals"),
    (KeyCode::KeyR, "R", Action::Layer(Shown::Rectangles), "portals' rectangles on the screen"),
    (KeyCode::KeyM, "M", Action::Layer(Shown::Plan), "plan of the storey; click to go there, wheel and drag to look closer"),
    (KeyCode::PageUp, "Page Up", Action::Storey(true), "plan of the storey above; once more: go there"),
    (KeyCode::PageDown, "Page Down", Action::Storey(false), "plan of the storey below; once more: go there"),
    (KeyCode::KeyB, "B", Action::SavePlan, "write the plan beside the model, as SVG"),
    (KeyCode::KeyX, "X", Action::Layer(Shown::Matrix), "visibility matrix; click a pair for why"),
    (KeyCode::KeyG, "G", Action::Layer(Shown::Graphs), "graphs"),
    (KeyCode::KeyK, "K", Action::Alarm, "missed-pixel alarm"),
    (KeyCode::KeyV, "V", Action::Fly, "walk or fly"),
    (KeyCode::KeyE, "E", Action::Door, "open or shut the door ahead (or click it)"),
    (KeyCode::KeyT, "T", Action::Mirror, "hang a mirror on the wall ahead"),
    (KeyCode::KeyY, "Y", Action::Pick, "pick what is ahead (or click it); a second pick: why does one see the other?"),
    (KeyCode::Slash, "/, Ctrl+F", Action::Find, "find a room, a node or a material"),
    (KeyCode::Delete, "Delete", Action::Hide, "hide what was picked or found (Shift+Delete: show all again)"),
    (KeyCode::KeyI, "I", Action::Isolate, "show only what was picked or found"),
    (KeyCode::KeyH, "H", Action::Hud, "counters"),
    (KeyCode::F1, "F1", Action::Layer(Shown::Keys), "this list"),
];

/// What is held down, in words.
const HELD: [(&str, &str); 5] = [
    ("W A S D", "walk; arrow keys turn"),
    ("Space, Ctrl", "up and down, flying"),
    ("Shift", "faster"),
    ("Mouse", "drag to look; Tab: look without dragging"),
    ("Esc", "let go of the mouse; quit"),
];

/// What a key does while Ctrl or Shift is held.
pub fn action(code: KeyCode, [ctrl, shift]: [bool; 2]) -> Option<Action> {
    match code {
        KeyCode::KeyF if ctrl => return Some(Action::Find),
        KeyCode::Delete if shift => return Some(Action::ShowAll),
        _ => {}
    }
    KEYS.iter().find(|key| key.0 == code).map(|key| key.2)
}

/// The list on the screen.
pub fn show(ui: &mut egui::Ui) {
    egui::Window::new("Keys").anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).collapsible(false).resizable(false).show(
        ui.ctx(),
        |ui| {
            egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
                let pressed = KEYS.iter().map(|(_, name, _, words)| (*name, *words));
                for (name, words) in HELD.into_iter().chain(pressed) {
                    ui.strong(name);
                    ui.label(words);
                    ui.end_row();
                }
            });
        },
    );
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
        assert_eq!(action(KeyCode::KeyF, [false, true]), Some(Action::Freeze));
        assert_eq!(action(KeyCode::KeyF, [true, false]), Some(Action::Find));
        assert_eq!(action(KeyCode::Delete, [false, false]), Some(Action::Hide));
        assert_eq!(action(KeyCode::Delete, [false, true]), Some(Action::ShowAll));
        assert!(!KEYS.iter().any(|k| matches!(k.0, KeyCode::KeyW | KeyCode::KeyA | KeyCode::KeyS | KeyCode::KeyD)));
    }
}
