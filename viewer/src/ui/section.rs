//! The panel of a section.

use crate::commands::{Action, Command};
use crate::session::section::Cut;

/// Where it is, points from the middle of the right side: below the plan.
const PANEL: [f32; 2] = [-8.0, 60.0];

/// Draws it. `origin`: the height of the model's origin, metres.
pub fn show(ui: &mut egui::Ui, cut: &Cut, origin: f64) -> Option<Command> {
    let mut command = None;
    let window = egui::Window::new("Section").id(egui::Id::unique("section")).anchor(egui::Align2::RIGHT_CENTER, PANEL);
    window.collapsible(false).auto_sized().show(ui.ctx(), |ui| {
        ui.horizontal(|ui| {
            for (is_upright, name) in [(false, "Level"), (true, "Facing")] {
                if ui.selectable_label(cut.is_upright == is_upright, name).clicked() {
                    command = Some(Command::SetSection(is_upright));
                }
            }
            if ui.button("Off").clicked() {
                command = Some(Command::Act(Action::Section));
            }
        });
        let add = if cut.is_upright { 0.0 } else { origin };
        let mut offset = cut.offset() + add;
        ui.horizontal(|ui| {
            ui.label(if cut.is_upright { "At" } else { "Height" });
            let drag = egui::DragValue::new(&mut offset).speed(0.02).fixed_decimals(2).suffix(" m");
            let is_new = ui.add(drag).changed();
            if is_new && offset.is_finite() {
                command = Some(Command::MoveSection(offset - add));
            }
        });
        ui.small("Shift and the wheel move it. Shift+Z turns it.");
    });
    command
}
