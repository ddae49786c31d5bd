//! Buttons for all actions, made from their table.

use crate::commands::{Action, Command, Entry, TABLE, entry_of};
use crate::keymap::KeyMap;

/// Width of the buttons at most, points: about a third of the table in a row.
const WIDEST: f32 = 620.0;
/// Room between the buttons and the window's sides, points.
const MARGIN: f32 = 16.0;

/// Draws the button that opens the buttons.
pub fn closed(ui: &mut egui::Ui, keys: &KeyMap) -> Option<Command> {
    let entry = entry_of(Action::Menu)?;
    let area = egui::Area::new(egui::Id::unique("menu")).anchor(egui::Align2::CENTER_TOP, [0.0, 8.0]);
    area.show(ui.ctx(), |ui| clicked(ui, keys, entry, egui::Button::new(entry.label))).inner
}

/// Draws all buttons; the buttons of actions that are on are pressed in.
pub fn open(ui: &mut egui::Ui, keys: &KeyMap, is_on: &dyn Fn(&Entry) -> bool) -> Option<Command> {
    let mut command = None;
    let width = (ui.ctx().content_rect().width() - 2.0 * MARGIN).min(WIDEST);
    let area = egui::Area::new(egui::Id::unique("buttons")).anchor(egui::Align2::CENTER_TOP, [0.0, 8.0]);
    area.show(ui.ctx(), |ui| {
        egui::Frame::window(ui.style()).show(ui, |ui| {
            ui.set_width(width);
            ui.horizontal_wrapped(|ui| {
                for entry in &TABLE {
                    let button = egui::Button::selectable(is_on(entry), entry.label);
                    command = command.or(clicked(ui, keys, entry, button));
                }
            });
        });
    });
    command
}

fn clicked(ui: &mut egui::Ui, keys: &KeyMap, entry: &Entry, button: egui::Button<'_>) -> Option<Command> {
    let hint = format!("{}: {}", keys.name_of(entry.action), entry.help);
    ui.add(button).on_hover_text(hint).clicked().then_some(Command::Act(entry.action))
}
