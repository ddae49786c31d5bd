//! Graphs of the cost of the last frames.

use crate::units::number;
use std::collections::VecDeque;

/// Frames that are shown.
const FRAMES: usize = 300;

/// The cost of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Triangles, objects, the milliseconds of culling, of all else on the processor and of the device, queries.
    pub values: [f64; 6],
}

/// Names of the values of a [`Sample`].
const NAMES: [&str; 6] = ["triangles", "objects", "culling ms", "rest of CPU ms", "GPU ms", "queries"];
const COLOURS: [egui::Color32; 6] = [
    egui::Color32::from_rgb(240, 200, 90),
    egui::Color32::from_rgb(140, 210, 120),
    egui::Color32::from_rgb(110, 190, 250),
    egui::Color32::from_rgb(120, 220, 210),
    egui::Color32::from_rgb(240, 130, 110),
    egui::Color32::from_rgb(200, 150, 240),
];

/// The last frames.
#[derive(Default)]
pub struct Graphs {
    samples: VecDeque<Sample>,
}

impl Graphs {
    /// Another frame.
    pub fn add(&mut self, sample: Sample) {
        self.samples.truncate(FRAMES - 1);
        self.samples.push_front(sample);
    }

    /// Draws them, the newest at the right.
    pub fn show(&self, ui: &mut egui::Ui) {
        let window = egui::Window::new("Graphs").anchor(egui::Align2::RIGHT_BOTTOM, [-8.0, -8.0]).auto_sized();
        window.show(ui.ctx(), |ui| {
            for (i, name) in NAMES.into_iter().enumerate() {
                self.graph(ui, i, name);
            }
        });
    }

    fn graph(&self, ui: &mut egui::Ui, value: usize, name: &str) {
        let values = self.samples.iter().map(|s| s.values[value]);
        let (now, most) = (values.clone().next().unwrap_or(0.0), values.clone().fold(0.0, f64::max));
        let (_, rect) = ui.allocate_space(egui::vec2(240.0, 44.0));
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 2.0, egui::Color32::from_black_alpha(90));
        let at = |(i, v): (usize, f64)| {
            let x = rect.right() - i as f32 * rect.width() / FRAMES as f32;
            egui::pos2(x, rect.bottom() - 1.0 - (v / most.max(1e-9)) as f32 * (rect.height() - 14.0))
        };
        let line: Vec<egui::Pos2> = values.enumerate().map(at).collect();
        painter.line(line, egui::Stroke::new(1.2, COLOURS[value]));
        let text = format!("{name} {} (most {})", number(now), number(most));
        painter.text(rect.left_top(), egui::Align2::LEFT_TOP, text, egui::FontId::proportional(11.0), COLOURS[value]);
    }
}
