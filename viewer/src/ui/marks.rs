//! Text at points of the scene.

use glam::DVec2;

/// What is written.
#[derive(Clone, PartialEq, Debug)]
pub struct Mark {
    /// Its middle, pixels of the picture.
    pub at: DVec2,
    /// It.
    pub text: String,
    /// Size of text, points.
    pub size: f32,
    /// 0 (not seen) to 1.
    pub opacity: f32,
    /// Whether it isn't written where it would lie on another one before it.
    pub yields: bool,
}

/// What doesn't yield is written so many of its sizes above its point, so that what it tells of shows.
const ABOVE: f32 = -2.2;
/// Around text, points.
const AIR: f32 = 3.0;

/// Writes marks under all panels. `scale`: points a pixel.
pub fn show(ui: &egui::Ui, marks: &[Mark], scale: f64) {
    let layer = egui::LayerId::new(egui::Order::Background, egui::Id::unique("marks"));
    let painter = ui.ctx().layer_painter(layer);
    let mut taken: Vec<egui::Rect> = Vec::new();
    for mark in marks {
        let [ink, paper] = [egui::Color32::WHITE, egui::Color32::from_black_alpha(150)];
        let [ink, paper] = [ink, paper].map(|colour| colour.gamma_multiply(mark.opacity));
        let at = mark.at * scale;
        let middle = egui::pos2(at.x as f32, at.y as f32 + if mark.yields { 0.0 } else { mark.size * ABOVE });
        let mut job =
            egui::text::LayoutJob::simple(mark.text.clone(), egui::FontId::proportional(mark.size), ink, f32::INFINITY);
        job.halign = egui::Align::Center;
        let text = painter.layout_job(job);
        let size = text.size();
        let rect = egui::Rect::from_center_size(middle, size).expand(AIR);
        if mark.yields && taken.iter().any(|other| other.intersects(rect)) {
            continue;
        }
        taken.push(rect);
        painter.rect_filled(rect, AIR, paper);
        painter.galley(egui::pos2(middle.x, middle.y - 0.5 * size.y), text, ink);
    }
}
