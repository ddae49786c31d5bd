//! The settings of a person, as a panel.

use super::rebind::{self, Rebind};
use crate::commands::Command;
use crate::keymap::KeyMap;
use crate::looks::Detail;
use crate::settings::{DEAD_ZONE, FIELD_OF_VIEW, Preferences, Range, SENSITIVITY, SPEED, STICK, TEXT};
use crate::units::Units;

/// How much larger or smaller a click makes text.
const STEP: f64 = 0.1;
/// Room for the title and around the panel, points.
const MARGIN: f32 = 80.0;

/// Values that the panel changes.
#[derive(Clone, Copy, PartialEq)]
struct Chosen {
    preferences: Preferences,
    /// Radians.
    fov_y: f64,
    detail: Detail,
}

/// Draws them. Returns a command for each that was changed.
pub fn show(
    ui: &mut egui::Ui,
    preferences: &Preferences,
    fov_y: f64,
    detail: Detail,
    keys: (&KeyMap, &Rebind),
) -> Vec<Command> {
    let before = Chosen { preferences: *preferences, fov_y, detail };
    let (mut chosen, mut commands) = (before, Vec::new());
    let window = egui::Window::new("Settings").anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).collapsible(false);
    let room = ui.ctx().content_rect().height() - MARGIN;
    window.resizable(false).show(ui.ctx(), |ui| {
        egui::ScrollArea::vertical().max_height(room).show(ui, |ui| {
            rows(ui, &mut chosen);
            commands.extend(rebind::show(ui, keys.0, keys.1));
            if ui.button("Defaults").clicked() {
                (chosen.preferences, chosen.fov_y) = (Preferences::default(), FIELD_OF_VIEW.usual.to_radians());
            }
        });
    });
    let Chosen { preferences, fov_y, detail } = chosen;
    commands.extend((preferences != before.preferences).then_some(Command::SetPreferences(preferences)));
    commands.extend((fov_y != before.fov_y).then_some(Command::SetFieldOfView(fov_y)));
    commands.extend((detail != before.detail).then_some(Command::SetDetail(detail)));
    commands
}

/// The settings, each in a row.
fn rows(ui: &mut egui::Ui, Chosen { preferences, fov_y, detail }: &mut Chosen) {
    egui::Grid::new("settings").num_columns(2).show(ui, |ui| {
        let mut slider = |label: &str, value: &mut f64, range: Range, unit: &str| {
            let name = ui.label(label).id;
            let slider = egui::Slider::new(value, range.least..=range.most).suffix(unit);
            ui.add(slider.logarithmic(range.is_factor).max_decimals(2)).labelled_by(name);
            ui.end_row();
        };
        slider("Mouse sensitivity", &mut preferences.sensitivity, SENSITIVITY, "");
        slider("Speed", &mut preferences.speed, SPEED, "");
        if cfg!(feature = "gamepad") {
            slider("Stick sensitivity", &mut preferences.stick, STICK, "");
            slider("Stick dead zone", &mut preferences.dead_zone, DEAD_ZONE, "");
        }
        let (before, mut degrees) = (fov_y.to_degrees(), fov_y.to_degrees());
        slider("Field of view", &mut degrees, FIELD_OF_VIEW, "°");
        if degrees != before {
            *fov_y = FIELD_OF_VIEW.clamp(degrees).to_radians();
        }
        ui.label("Look");
        ui.checkbox(&mut preferences.inverted, "up and down inverted");
        ui.end_row();
        ui.label("Detail");
        ui.horizontal(|ui| {
            ui.selectable_value(detail, Detail::Plain, "plain");
            ui.selectable_value(detail, Detail::Full, "full");
            ui.selectable_value(detail, Detail::Smooth, "smooth");
        });
        ui.end_row();
        ui.label("Units");
        ui.horizontal(|ui| {
            ui.selectable_value(&mut preferences.units, Units::Metres, "metres");
            ui.selectable_value(&mut preferences.units, Units::Feet, "feet and inches");
        });
        ui.end_row();
        // Buttons, since a slider would move under the pointer as its own text grows.
        ui.label("Text");
        ui.horizontal(|ui| {
            for (label, by) in [("-", -STEP), ("+", STEP)] {
                if ui.button(label).clicked() {
                    preferences.text = TEXT.clamp(preferences.text + by);
                }
            }
            ui.label(format!("{:.0} %", preferences.text * 100.0));
        });
        ui.end_row();
    });
}
