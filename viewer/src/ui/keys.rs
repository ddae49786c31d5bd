//! The list of keys.

use crate::commands::lines;
use crate::keymap::KeyMap;

/// Two columns of the list are less wide than this, points; one is, in a window that is narrower.
const WIDE: f32 = 860.0;
/// Room around the list, points: its title, and a bit of the picture.
const MARGIN: egui::Vec2 = egui::vec2(32.0, 80.0);

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
                        for line in lines {
                            ui.strong(&line.keys);
                            ui.label(line.help);
                            ui.end_row();
                        }
                    });
                }
            });
        });
    });
}
