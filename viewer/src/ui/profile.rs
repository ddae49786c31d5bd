//! The profile of a path: what each frame costs. A click on a frame goes there.

use crate::commands::Command;
use crate::profile::{Cost, Profile};
use crate::units::number;

/// Size of a graph, points.
const GRAPH: egui::Vec2 = egui::vec2(420.0, 64.0);
/// Room above the highest line for the words, points.
const WORDS: f32 = 14.0;

type Line = (&'static str, egui::Color32, fn(&Cost) -> f64);

/// The graphs: name, colour and value of each line.
const GRAPHS: [&[Line]; 3] = [
    &[
        ("ms a frame", egui::Color32::from_rgb(110, 190, 250), |cost| cost.ms),
        ("culling", egui::Color32::from_rgb(200, 150, 240), |cost| cost.cull_ms),
    ],
    &[
        ("triangles drawn", egui::Color32::from_rgb(250, 153, 33), |cost| cost.triangles as f64),
        ("seen", egui::Color32::from_rgb(107, 199, 102), |cost| cost.seen as f64),
    ],
    &[("missed pixels", egui::Color32::from_rgb(240, 90, 200), |cost| f64::from(cost.missed_pixels))],
];

/// Draws it; the frame at `here` is marked.
pub fn show(ui: &mut egui::Ui, profile: &Profile<'_>, here: Option<usize>) -> Option<Command> {
    let mut command = None;
    let window = egui::Window::new("Profile").id(egui::Id::unique("profile"));
    window.anchor(egui::Align2::LEFT_BOTTOM, [8.0, -8.0]).auto_sized().show(ui.ctx(), |ui| {
        let (done, all) = (profile.costs.len(), profile.path.frames.len());
        ui.label(format!("{}, culled by {}: {done} of {all} frames", profile.path.name, profile.mode));
        for lines in GRAPHS {
            command = command.or(graph(ui, profile, lines, here));
        }
        ui.horizontal(|ui| {
            for (label, words, asked) in [
                ("Again", "measure again in the current mode", Command::ProfileAgain),
                ("Save", "write it as JSON beside the model", Command::SaveProfile),
            ] {
                if ui.small_button(label).on_hover_text(words).clicked() {
                    command = Some(asked);
                }
            }
        });
    });
    command
}

fn graph(ui: &mut egui::Ui, profile: &Profile<'_>, lines: &[Line], here: Option<usize>) -> Option<Command> {
    let (rect, response) = ui.allocate_exact_size(GRAPH, egui::Sense::click());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, egui::Color32::from_black_alpha(90));
    let frames = profile.path.frames.len();
    let step = rect.width() / frames as f32;
    let values = lines.iter().flat_map(|line| profile.costs.iter().map(line.2));
    let most = values.fold(0.0, f64::max);
    let x = |frame: usize| rect.left() + (frame as f32 + 0.5) * step;
    let y = |value: f64| rect.bottom() - 1.0 - (value / most.max(1e-9)) as f32 * (rect.height() - WORDS);
    let hovered = response.hover_pos().map(|at| ((at.x - rect.left()) / step).max(0.0) as usize).filter(|f| *f < frames);
    for (frame, alpha) in [(here, 120), (hovered, 70)] {
        if let Some(frame) = frame {
            painter.vline(x(frame), rect.y_range(), egui::Stroke::new(1.0, egui::Color32::from_white_alpha(alpha)));
        }
    }
    let mut left = rect.left() + 2.0;
    for (name, colour, value) in lines {
        let points = profile.costs.iter().enumerate().map(|(frame, cost)| egui::pos2(x(frame), y(value(cost)))).collect();
        painter.line(points, egui::Stroke::new(1.2, *colour));
        let shown = hovered.or(here).and_then(|frame| profile.costs.get(frame));
        let text = match shown {
            Some(cost) => format!("{name} {}", number(value(cost))),
            None => format!("{name}, {} at most", number(profile.costs.iter().map(value).fold(0.0, f64::max))),
        };
        let at = egui::pos2(left, rect.top() + 1.0);
        left = painter.text(at, egui::Align2::LEFT_TOP, text, egui::FontId::proportional(11.0), *colour).right() + 10.0;
    }
    if let Some(frame) = hovered {
        response.clone().on_hover_text_at_pointer(format!("frame {frame}: click to go there"));
    }
    hovered.filter(|_| response.clicked()).map(Command::ProfileFrame)
}
