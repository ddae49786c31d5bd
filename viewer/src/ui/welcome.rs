//! The start screen: files that were opened before, and how another one is opened.

use std::path::PathBuf;

/// Width of the list, points.
const WIDTH: f32 = 440.0;
/// Room around the panel and for what isn't the list, points.
const MARGIN: f32 = 170.0;
/// The list is no lower than this, points.
const LOWEST: f32 = 60.0;

/// What is shown.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Welcome {
    /// Files that were opened, the latest first, and whether they are there still.
    pub recent: Vec<(PathBuf, bool)>,
    /// Why nothing else is shown.
    pub line: Option<String>,
}

/// What was clicked.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Chosen {
    /// A file to open.
    File(PathBuf),
    /// A dialog to choose one in.
    Dialog,
}

impl Welcome {
    /// Of the files that were opened, as they are now.
    pub fn new(recent: &[String]) -> Self {
        let file = |name: &String| (PathBuf::from(name), PathBuf::from(name).exists());
        Self { recent: recent.iter().map(file).collect(), line: None }
    }

    /// Draws it; `kinds` are extensions that can be read. Returns what was clicked.
    pub fn show(&self, ui: &mut egui::Ui, kinds: &[&str]) -> Option<Chosen> {
        let mut chosen = None;
        let window = egui::Window::new("Enfilade").id(egui::Id::unique("welcome")).collapsible(false).resizable(false);
        window.anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).show(ui.ctx(), |ui| {
            let room = ui.ctx().content_rect().size();
            ui.set_width((room.x - 2.0 * ui.spacing().window_margin.sum().x).clamp(1.0, WIDTH));
            if let Some(line) = &self.line {
                ui.colored_label(ui.visuals().warn_fg_color, line);
            }
            ui.horizontal(|ui| {
                if ui.button("Open…").on_hover_text("Ctrl+O").clicked() {
                    chosen = Some(Chosen::Dialog);
                }
                ui.label("or drop a file on this window");
            });
            ui.weak(format!("This build reads {}.", kinds.join(", ")));
            if !self.recent.is_empty() {
                ui.separator();
                ui.label("Recent files");
            }
            egui::ScrollArea::vertical().max_height((room.y - MARGIN).max(LOWEST)).show(ui, |ui| {
                for (file, is_there) in &self.recent {
                    let name = file.file_name().map_or_else(|| file.display().to_string(), |n| n.display().to_string());
                    let name = if *is_there { name } else { format!("{name} (missing)") };
                    let button = ui.add_enabled(*is_there, egui::Button::new(name).frame_when_inactive(false));
                    let whole = file.display().to_string();
                    if button.on_hover_text(&whole).on_disabled_hover_text(&whole).clicked() {
                        chosen = Some(Chosen::File(file.clone()));
                    }
                }
            });
        });
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Event, Modifiers, PointerButton, Pos2, RawInput, Rect, Shape};

    fn texts(shapes: &[egui::epaint::ClippedShape]) -> Vec<(String, Pos2)> {
        let text = |clipped: &egui::epaint::ClippedShape| match &clipped.shape {
            Shape::Text(text) => Some((text.galley.text().to_owned(), text.visual_bounding_rect().center())),
            _ => None,
        };
        shapes.iter().filter_map(text).collect()
    }

    #[test]
    fn a_click_opens_a_recent_file_or_the_dialog_and_a_missing_one_is_told() {
        let (there, gone) = (PathBuf::from("/houses/there.glb"), PathBuf::from("/houses/gone.glb"));
        let recent = vec![(there.clone(), true), (gone, false)];
        let welcome = Welcome { recent, line: Some("bad.pvs: no pvs file".into()) };
        let context = egui::Context::default();
        let frame = |events: Vec<Event>| {
            let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, egui::vec2(640.0, 480.0)));
            let mut chosen = None;
            let input = RawInput { screen_rect, events, ..Default::default() };
            let output = context.run_ui(input, |ui| chosen = chosen.take().or(welcome.show(ui, &["pvs", "glb"])));
            (texts(&output.shapes), chosen)
        };
        (0..3).for_each(|_| drop(frame(Vec::new())));
        let click = |label: &str| {
            let (texts, _) = frame(Vec::new());
            let pos = texts.iter().find(|(text, _)| text == label).unwrap_or_else(|| panic!("no {label}: {texts:?}")).1;
            let press = |pressed| {
                vec![Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE }]
            };
            frame(vec![Event::PointerMoved(pos)]);
            let down = frame(press(true)).1;
            down.or(frame(press(false)).1)
        };
        assert_eq!(click("there.glb"), Some(Chosen::File(there)));
        assert_eq!(click("Open…"), Some(Chosen::Dialog));
        assert_eq!(click("gone.glb (missing)"), None);
        assert_eq!(click("bad.pvs: no pvs file"), None);
        assert_eq!(click("This build reads pvs, glb."), None);
    }
}
