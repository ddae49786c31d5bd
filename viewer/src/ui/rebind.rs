//! The part of the settings that gives actions other keys: a click on a key, and the next key that goes down takes its place.

use crate::commands::Command;
use crate::keymap::{Bound, KeyMap, all};
use winit::keyboard::KeyCode;

/// The action whose key is being changed.
#[derive(Default)]
pub struct Rebind {
    waiting: Option<Bound>,
    /// Why a key wasn't taken.
    said: Option<String>,
}

impl Rebind {
    /// Waits for no key any more.
    pub fn stop(&mut self) {
        *self = Self::default();
    }

    /// A key went down. Returns whether it was waited for.
    pub fn take(&mut self, keys: &mut KeyMap, code: KeyCode) -> bool {
        let Some(bound) = self.waiting.take() else { return false };
        self.said = match code {
            // Nothing is changed.
            KeyCode::Escape => None,
            code => keys.give(bound, code).err(),
        };
        true
    }

    /// Waits for the key of something.
    pub fn wait_for(&mut self, bound: Bound) {
        *self = Self { waiting: Some(bound), said: None };
    }
}

/// Draws the list of actions with their keys.
pub fn show(ui: &mut egui::Ui, keys: &KeyMap, rebind: &Rebind) -> Option<Command> {
    let mut command = None;
    ui.collapsing("Keys of actions", |ui| {
        ui.weak(rebind.said.as_deref().unwrap_or("Click a key, then press another. Esc: no."));
        if ui.add_enabled(!keys.is_usual(), egui::Button::new("Usual keys")).clicked() {
            command = Some(Command::UsualKeys);
        }
        egui::Grid::new("key map").num_columns(2).striped(true).show(ui, |ui| {
            for (bound, _, _, label) in all() {
                let is_waiting = rebind.waiting == Some(bound);
                let name = if is_waiting { "press a key".to_owned() } else { keys.name(bound) };
                ui.label(label);
                if ui.selectable_label(is_waiting, name).clicked() {
                    command = Some(Command::WaitForKey(bound));
                }
                ui.end_row();
            }
        });
    });
    command
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::Action;

    #[test]
    fn the_next_key_is_taken_and_no_more() {
        let (mut keys, mut rebind) = (KeyMap::default(), Rebind::default());
        assert!(!rebind.take(&mut keys, KeyCode::F20));
        rebind.wait_for(Bound::Act(Action::Fly));
        assert!(rebind.take(&mut keys, KeyCode::KeyF) && keys.is_usual());
        assert_eq!(rebind.said.as_deref(), Some("F is for Freeze already"));
        rebind.wait_for(Bound::Act(Action::Fly));
        assert!(rebind.take(&mut keys, KeyCode::Escape) && keys.is_usual() && rebind.said.is_none());
        rebind.wait_for(Bound::Act(Action::Fly));
        assert!(rebind.take(&mut keys, KeyCode::F20) && !rebind.take(&mut keys, KeyCode::F19));
        assert_eq!(keys.action(KeyCode::F20, [false; 2]), Some(Action::Fly));
    }
}
