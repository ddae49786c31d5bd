//! Counters in a corner, lines and questions, and the progress of a bake.

use crate::commands::Command;
use crate::explain::Explanation;
use crate::opening::Share;

/// Room for a button above, points.
const BELOW: f32 = 28.0;

/// Answers to the question whether to quit.
const ANSWERS: [(&str, Command); 3] =
    [("Save and quit", Command::SaveAndQuit), ("Quit", Command::Quit), ("Stay", Command::Stay)];

/// Draws lines of text in the upper left corner, of the right half where they are of what is `beside`; the first is a heading.
pub fn show(ui: &mut egui::Ui, lines: &[String], beside: bool) {
    // Beside, below the button of the menu.
    let corner = if beside { egui::pos2(ui.ctx().content_rect().center().x, BELOW) } else { egui::Pos2::ZERO };
    let area =
        egui::Area::new(egui::Id::unique(("hud", beside))).fixed_pos(corner + egui::vec2(8.0, 8.0)).interactable(false);
    area.show(ui.ctx(), |ui| {
        egui::Frame::new().fill(egui::Color32::from_black_alpha(150)).inner_margin(6.0).corner_radius(3.0).show(ui, |ui| {
            ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
            for (i, line) in lines.iter().enumerate() {
                let text = egui::RichText::new(line).color(egui::Color32::WHITE);
                ui.label(if i == 0 { text.strong() } else { text.size(12.0) });
            }
        });
    });
}

/// Draws how far a bake is, in the middle: there is nothing else yet.
pub fn progress(ui: &mut egui::Ui, name: &str, share: Option<&Share>) {
    let window = egui::Window::new(name).id(egui::Id::unique("progress")).collapsible(false).resizable(false);
    window.anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).show(ui.ctx(), |ui| bar(ui, share, 360.0));
}

/// Draws how far a bake is, at the lower edge: one walks meanwhile.
pub fn meanwhile(ui: &mut egui::Ui, share: &Share) {
    let area = egui::Area::new(egui::Id::unique("meanwhile")).anchor(egui::Align2::CENTER_BOTTOM, [0.0, -8.0]);
    area.interactable(false).show(ui.ctx(), |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| bar(ui, Some(share), 240.0));
    });
}

/// Draws a line of text at the bottom.
pub fn note(ui: &mut egui::Ui, line: &str) {
    let area = egui::Area::new(egui::Id::unique("note")).anchor(egui::Align2::CENTER_BOTTOM, [0.0, -64.0]);
    area.interactable(false).show(ui.ctx(), |ui| {
        egui::Frame::new().fill(egui::Color32::from_black_alpha(180)).inner_margin(6.0).corner_radius(3.0).show(ui, |ui| {
            ui.style_mut().wrap_mode = Some(egui::TextWrapMode::Extend);
            ui.label(egui::RichText::new(line).color(egui::Color32::WHITE));
        });
    });
}

/// Asks whether to quit.
pub fn question(ui: &mut egui::Ui) -> Option<Command> {
    let mut clicked = None;
    let window = egui::Window::new("Quit?").collapsible(false).resizable(false);
    window.anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).show(ui.ctx(), |ui| {
        ui.label("A recorded path isn't saved.");
        ui.horizontal(|ui| {
            for (answer, command) in ANSWERS {
                if ui.button(answer).clicked() {
                    clicked = Some(command);
                }
            }
        });
    });
    clicked
}

/// Draws the answer to `why`.
pub fn why(ui: &mut egui::Ui, answer: &Explanation) -> Option<Command> {
    let mut flies = false;
    let window = egui::Window::new("Why").anchor(egui::Align2::CENTER_BOTTOM, [0.0, -8.0]);
    window.collapsible(false).resizable(false).show(ui.ctx(), |ui| {
        ui.set_max_width(460.0);
        ui.label(&answer.text);
        flies = answer.sight.is_some() && ui.button("Fly along the line").clicked();
    });
    flies.then_some(Command::FlyAlongSight)
}

fn bar(ui: &mut egui::Ui, share: Option<&Share>, width: f32) {
    ui.label(share.map_or_else(|| "read".to_owned(), Share::say));
    let done = share.map_or(0.0, |share| share.done as f32);
    ui.add(egui::ProgressBar::new(done).desired_width(width).show_percentage());
}
