//! The window to find things in, and the facts of what was picked or found.

use crate::building::Building;
use crate::commands::{Action, Command};
use crate::elements::Sheet;
use crate::find::{FindTarget, Found, MOST, find};
use crate::keymap::KeyMap;

/// Height of the list, points.
const LIST: f32 = 180.0;
/// Height of the facts at most, as a part of the window.
const TOLD: f32 = 0.45;

/// The window to find things in.
#[derive(Default)]
pub struct Find {
    /// Whether it is there.
    pub is_open: bool,
    text: String,
    found: Vec<Found>,
    /// It was opened just now: what is typed goes to it.
    is_new: bool,
}

impl Find {
    /// Opens or shuts it.
    pub fn toggle(&mut self) {
        self.is_open ^= true;
        self.is_new = self.is_open;
    }

    /// Draws it, if it is open. Returns a command for the hit that was clicked.
    pub fn show(&mut self, ui: &mut egui::Ui, building: &Building) -> Option<Command> {
        if !self.is_open {
            return None;
        }
        let mut chosen = None;
        let window =
            egui::Window::new("Find").id(egui::Id::unique("find")).default_pos([8.0, 180.0]).open(&mut self.is_open);
        window.resizable(false).show(ui.ctx(), |ui| {
            let hint = "room, node, type, property or material";
            let field = ui.add(egui::TextEdit::singleline(&mut self.text).hint_text(hint).desired_width(240.0));
            if std::mem::take(&mut self.is_new) {
                field.request_focus();
            }
            if field.changed() {
                self.found = find(building, &self.text);
            }
            let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
            if let Some(first) = self.found.first().filter(|_| is_entered) {
                chosen = Some(Command::GoTo(first.what));
            }
            egui::ScrollArea::vertical().max_height(LIST).auto_shrink([false, true]).show(ui, |ui| {
                for found in &self.found {
                    let kind = match found.what {
                        FindTarget::Room(cell) => format!("room, cell {cell}"),
                        FindTarget::Node(_) => "node".to_owned(),
                        FindTarget::Type(_) => "all of this type".to_owned(),
                        FindTarget::Class(_) => "all of this class".to_owned(),
                        FindTarget::Property(..) => "all with this property".to_owned(),
                        FindTarget::Material(_) => "material".to_owned(),
                    };
                    let hit = ui.selectable_label(false, &found.name).on_hover_text(&kind);
                    if hit.clicked() {
                        chosen = Some(Command::GoTo(found.what));
                    }
                }
            });
            if !self.text.trim().is_empty() {
                match self.found.len() {
                    MOST => ui.small(format!("the first {MOST}")),
                    n => ui.small(format!("{n} found")),
                };
            }
        });
        chosen
    }
}

/// Draws the facts of what was picked or found, if there are any.
pub fn facts(ui: &mut egui::Ui, keys: &KeyMap, facts: &[(&'static str, String)], sheets: &[Sheet]) {
    if facts.is_empty() {
        return;
    }
    let window = egui::Window::new("Picked").id(egui::Id::unique("picked")).anchor(egui::Align2::LEFT_BOTTOM, [8.0, -8.0]);
    let most = TOLD * ui.ctx().content_rect().height();
    window.collapsible(false).resizable(false).show(ui.ctx(), |ui| {
        egui::ScrollArea::vertical().max_height(most).auto_shrink([false, true]).show(ui, |ui| {
            grid(ui, "facts", facts.iter().map(|(name, value)| (*name, value.as_str())));
            for (i, sheet) in sheets.iter().enumerate() {
                ui.strong(&sheet.title);
                grid(ui, ("sheet", i), sheet.rows.iter().map(|(name, value)| (name.as_str(), value.as_str())));
            }
        });
        let (hide, only) = (keys.name_of(Action::Hide), keys.name_of(Action::Isolate));
        ui.small(format!("{hide}: hide it. {only}: show only it. Shift+{hide}: show all."));
    });
}

/// Names and values.
fn grid<'r>(ui: &mut egui::Ui, id: impl std::hash::Hash + std::fmt::Debug, rows: impl Iterator<Item = (&'r str, &'r str)>) {
    egui::Grid::new(id).num_columns(2).striped(true).show(ui, |ui| {
        for (name, value) in rows {
            ui.weak(name);
            ui.label(value);
            ui.end_row();
        }
    });
}
