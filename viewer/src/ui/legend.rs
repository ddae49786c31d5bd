//! Legends of colours.

use crate::colours::Tints;
use crate::draw::marks::KINDS;
use crate::heat;
use crate::profile::Profile;
use crate::units::number;

/// Of the kinds of triangles, in their order: as the shader draws what is seen and what is drawn in vain, and as what was culled shows.
const COLOURS: [egui::Color32; 3] =
    [egui::Color32::from_rgb(107, 199, 102), egui::Color32::from_rgb(250, 153, 33), egui::Color32::from_rgb(130, 146, 170)];
/// Size of a swatch, points; of a scale of heat.
const SWATCH: egui::Vec2 = egui::vec2(12.0, 12.0);
const SCALE: egui::Vec2 = egui::vec2(160.0, 10.0);

/// A square of a colour.
pub fn swatch(ui: &mut egui::Ui, colour: egui::Color32) {
    let (_, rect) = ui.allocate_space(SWATCH);
    ui.painter().rect_filled(rect, 2.0, colour);
}

/// A panel above the lower edge.
fn panel(ui: &egui::Ui, name: &str, add: impl FnOnce(&mut egui::Ui)) {
    let area = egui::Area::new(egui::Id::unique(name)).anchor(egui::Align2::CENTER_BOTTOM, [0.0, -8.0]);
    area.interactable(false).show(ui.ctx(), |ui| {
        egui::Frame::window(ui.style()).show(ui, add);
    });
}

/// Triangles and pixels of each kind, with their shares.
pub fn kinds(ui: &egui::Ui, triangles: [u64; 3], pixels: [u64; 3]) {
    let share = |of: [u64; 3], kind: usize| 100.0 * of[kind] as f64 / of.iter().sum::<u64>().max(1) as f64;
    panel(ui, "kinds", |ui| {
        egui::Grid::new("kinds").num_columns(4).show(ui, |ui| {
            ui.label("");
            ui.small("triangles").on_hover_text("of the whole model");
            ui.small("pixels filled").on_hover_text("by everything in the frustum, also if hidden");
            ui.end_row();
            for (kind, name) in KINDS.into_iter().enumerate() {
                ui.horizontal(|ui| {
                    swatch(ui, COLOURS[kind]);
                    ui.label(name);
                });
                for of in [triangles, pixels] {
                    ui.label(format!("{}, {:.1} %", number(of[kind] as f64), share(of, kind)));
                }
                ui.end_row();
            }
        });
    });
}

/// The scale of the heat of a profile, with what its ends stand for, if objects are in its colours.
pub fn profile(ui: &egui::Ui, profile: &Profile<'_>, tints: Tints) {
    let title = match tints {
        Tints::Seen => "how often each object is seen on the path",
        Tints::InVain => "triangles of each object drawn in vain on the path",
        _ => return,
    };
    let ends = heat::ends(profile, tints);
    panel(ui, "heat", |ui| {
        ui.label(title);
        ui.small("the line of the path: time of its frames, from none to the most");
        ui.horizontal(|ui| {
            let [r, g, b] = heat::NEVER;
            swatch(ui, egui::Color32::from_rgb(r, g, b));
            ui.small("never");
            ui.small(&ends[0]);
            let (_, rect) = ui.allocate_space(SCALE);
            let steps = rect.width() as usize;
            for step in 0..steps {
                let [r, g, b] = heat::colour(step as f64 / steps as f64);
                let left = rect.min + egui::vec2(step as f32, 0.0);
                let part = egui::Rect::from_min_size(left, egui::vec2(1.0, rect.height()));
                ui.painter().rect_filled(part, 0.0, egui::Color32::from_rgb(r, g, b));
            }
            ui.small(&ends[1]);
        });
    });
}
