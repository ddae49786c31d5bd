//! The panel of tubes: how fine they are, and what they cost.

use crate::commands::Command;
use crate::draw::tubes::{THIN, TubeRenderer};
use crate::settings::{Range, TUBE_PIXELS};
use crate::units::number;

/// How much wider than they are thin tubes may be drawn: 1 is not at all. No tube is so far away that it needs more than the most.
const WIDER: Range = Range { least: 1.0, usual: 1e3, most: 1e3, is_factor: true };
/// Where it is, points from the middle of the left side.
const PANEL: [f32; 2] = [8.0, 90.0];
/// Bytes of a megabyte.
const MEGA: f64 = 1e6;

/// Draws it. `sections`: how many there are.
pub fn show(ui: &mut egui::Ui, tubes: &TubeRenderer, sections: usize) -> Option<Command> {
    let mut look = tubes.look;
    let window = egui::Window::new("Tubes").id(egui::Id::unique("tubes")).anchor(egui::Align2::LEFT_CENTER, PANEL);
    window.collapsible(false).auto_sized().show(ui.ctx(), |ui| {
        let slider = |ui: &mut egui::Ui, value: &mut f64, range: &Range, text: &str| {
            ui.add(egui::Slider::new(value, range.least..=range.most).logarithmic(true).max_decimals(2).text(text));
        };
        slider(ui, &mut look.limit, &TUBE_PIXELS, "pixels off at most");
        ui.label("Thinner than a pixel:");
        ui.horizontal(|ui| THIN.map(|(thin, name)| ui.selectable_value(&mut look.thin, thin, name)));
        slider(ui, &mut look.most, &WIDER, "times wider at most");
        ui.label(tubes.say_drawn());
        let over = tubes.drawn.chosen().over;
        if over > 0 {
            ui.label(format!("{over} chords exceed this at the finest level"));
        }
        let [bytes, of_mesh] = [tubes.bytes, tubes.bytes_of_mesh].map(|bytes| bytes as f64 / MEGA);
        ui.label(format!("{} sections, {bytes:.2} MB; as a mesh {of_mesh:.2} MB", number(sections as f64)));
        ui.small("Blue to red: 4, 8, 16, 32, and 64 sides or more. Lines: drawn rings.");
    });
    (look != tubes.look).then_some(Command::SetTubeLook(look))
}
