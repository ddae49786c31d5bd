//! Counters in a corner, what went wrong, and how far a bake is.

use crate::opening::Share;

/// Room for a button above, points.
const BELOW: f32 = 28.0;

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

/// Draws a message in the middle.
pub fn message(ui: &mut egui::Ui, title: &str, text: &str) {
    let window = egui::Window::new(title).id(egui::Id::unique("message")).collapsible(false).resizable(false);
    window.anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).show(ui.ctx(), |ui| {
        ui.set_max_width(520.0);
        ui.label(text);
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

/// Draws a small cross in the middle, light on dark, so that it is seen on anything.
pub fn crosshair(ui: &egui::Ui) {
    let layer = egui::LayerId::new(egui::Order::Background, egui::Id::unique("crosshair"));
    let (painter, middle) = (ui.ctx().layer_painter(layer), ui.ctx().content_rect().center());
    for (width, colour) in [(3.0, egui::Color32::from_black_alpha(150)), (1.0, egui::Color32::WHITE)] {
        for arm in [egui::vec2(6.0, 0.0), egui::vec2(0.0, 6.0)] {
            painter.line_segment([middle - arm, middle + arm], egui::Stroke::new(width, colour));
        }
    }
}

/// Draws a question with its answers, in the middle. Returns which one was clicked.
pub fn question(ui: &mut egui::Ui, text: &str, answers: &[&str]) -> Option<usize> {
    let mut clicked = None;
    let window = egui::Window::new("Quit?").collapsible(false).resizable(false);
    window.anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).show(ui.ctx(), |ui| {
        ui.label(text);
        ui.horizontal(|ui| {
            for (i, answer) in answers.iter().enumerate() {
                if ui.button(*answer).clicked() {
                    clicked = Some(i);
                }
            }
        });
    });
    clicked
}

fn bar(ui: &mut egui::Ui, share: Option<&Share>, width: f32) {
    ui.label(share.map_or_else(|| "read".to_owned(), Share::say));
    let done = share.map_or(0.0, |share| share.done as f32);
    ui.add(egui::ProgressBar::new(done).desired_width(width).show_percentage());
}
