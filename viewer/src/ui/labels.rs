//! Labels on the scene, under all panels: names and lengths, rectangles of portals, a cross in the middle.

use crate::culling::Decision;
use crate::measure::Label;
use glam::Vec2;

/// Lengths are written this many text sizes above their point, so that the point shows.
const ABOVE: f32 = -2.2;
/// Around text, points.
const AIR: f32 = 3.0;

/// Writes labels. `scale`: points a pixel.
pub fn show(ui: &egui::Ui, labels: &[Label], scale: f64) {
    let layer = egui::LayerId::new(egui::Order::Background, egui::Id::unique("marks"));
    let painter = ui.ctx().layer_painter(layer);
    let mut taken: Vec<egui::Rect> = Vec::new();
    for label in labels {
        let [ink, paper] = [egui::Color32::WHITE, egui::Color32::from_black_alpha(150)];
        let [ink, paper] = [ink, paper].map(|colour| colour.gamma_multiply(label.opacity));
        let at = label.at * scale;
        let middle = egui::pos2(at.x as f32, at.y as f32 + if label.yields { 0.0 } else { label.size * ABOVE });
        let mut job =
            egui::text::LayoutJob::simple(label.text.clone(), egui::FontId::proportional(label.size), ink, f32::INFINITY);
        job.halign = egui::Align::Center;
        let text = painter.layout_job(job);
        let size = text.size();
        let rect = egui::Rect::from_center_size(middle, size).expand(AIR);
        if label.yields && taken.iter().any(|other| other.intersects(rect)) {
            continue;
        }
        taken.push(rect);
        painter.rect_filled(rect, AIR, paper);
        painter.galley(egui::pos2(middle.x, middle.y - 0.5 * size.y), text, ink);
    }
}

/// Rectangles of the portals that were seen through, on the screen.
pub fn rectangles(ui: &egui::Ui, last: Option<&Decision>) {
    let screen = ui.ctx().content_rect();
    let painter = ui.ctx().layer_painter(egui::LayerId::background());
    let at = |p: Vec2| {
        let part = egui::vec2(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y);
        screen.min + part * screen.size()
    };
    for crossed in last.into_iter().flat_map(|d| &d.portals) {
        let rect = egui::Rect::from_two_pos(at(crossed.rect.min.max(-Vec2::ONE)), at(crossed.rect.max.min(Vec2::ONE)));
        let stroke = egui::Stroke::new(1.5, egui::Color32::from_rgb(255, 150, 30));
        painter.rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Inside);
    }
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
