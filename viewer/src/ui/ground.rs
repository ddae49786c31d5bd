//! The panel of the ground: how fine it is, and how many tiles there are.

use crate::commands::Command;
use crate::draw::ground::Terrain;
use crate::settings::Range;
use crate::units::number;
use enfilade_terrain::Limit;

/// Pixels that a tile may be wrong: less is finer than a picture, more is visible when it changes.
const PIXELS: Range = Range { least: 0.25, usual: 1.0, most: 16.0, is_factor: true };
/// Triangles of a picture: fewer are no ground, more are slow without need.
const TRIANGLES: Range = Range { least: 5e3, usual: 5e4, most: 5e5, is_factor: true };
/// Where it is, points from the middle of the left side.
const PANEL: [f32; 2] = [8.0, 40.0];

/// Draws it.
pub fn show(ui: &mut egui::Ui, terrain: &Terrain) -> Option<Command> {
    let mut command = None;
    let window = egui::Window::new("Ground").id(egui::Id::unique("ground")).anchor(egui::Align2::LEFT_CENTER, PANEL);
    window.collapsible(false).auto_sized().show(ui.ctx(), |ui| {
        command = limit(ui, terrain.land.limit);
        let (shown, ground) = (&terrain.shown, &terrain.land.ground);
        let (patches, loading) = (shown.patches().len(), shown.loading);
        let hits = if loading.wanted == 0 { 1.0 } else { f64::from(loading.present) / f64::from(loading.wanted) };
        ui.label(format!("{patches} tiles, {} triangles", number(shown.triangles() as f64)));
        ui.label(format!("{:.2} pixels wrong at most", shown.scratch.worst()));
        ui.label(format!("{} of {} wanted tiles loaded ({:.0} %)", loading.present, loading.wanted, hits * 1e2));
        ui.label(format!("{} loaded, {} under way", loading.loaded, loading.under_way));
        if let Some(fault) = ground.faults().last() {
            ui.label(fault.to_string());
        }
        ui.small("White: drawn. Red: wanted, but not loaded. Blue to red: fine to coarse.");
    });
    command
}

/// How fine it is: by pixels or by triangles.
fn limit(ui: &mut egui::Ui, limit: Limit) -> Option<Command> {
    let mut chosen = None;
    let by_triangles = matches!(limit, Limit::Triangles(_));
    ui.horizontal(|ui| {
        if ui.selectable_label(!by_triangles, "Pixels").clicked() && by_triangles {
            chosen = Some(Limit::Pixels(PIXELS.usual));
        }
        if ui.selectable_label(by_triangles, "Triangles").clicked() && !by_triangles {
            chosen = Some(Limit::Triangles(TRIANGLES.usual as u32));
        }
    });
    let (range, mut value) = match limit {
        Limit::Pixels(pixels) | Limit::Distance(pixels) => (PIXELS, pixels),
        Limit::Triangles(triangles) => (TRIANGLES, f64::from(triangles)),
    };
    let slider = egui::Slider::new(&mut value, range.least..=range.most).logarithmic(true).max_decimals(2);
    if ui.add(slider).changed() {
        let value = range.clamp(value);
        chosen = Some(if by_triangles { Limit::Triangles(value as u32) } else { Limit::Pixels(value) });
    }
    chosen.map(Command::SetGroundLimit)
}
