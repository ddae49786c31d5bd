//! The start screen: files that were opened before, and how another one is opened.

use std::path::PathBuf;

/// Width of the list, points.
const WIDTH: f32 = 440.0;
/// Room around the panel and for what isn't the list, points.
const MARGIN: f32 = 170.0;
/// The list is no lower than this, points.
const LOWEST: f32 = 60.0;

/// The start screen.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Welcome {
    /// Files that were opened, the latest first, and whether they are there still.
    pub recent: Vec<(PathBuf, bool)>,
    /// Why nothing else is shown.
    pub line: Option<String>,
}

/// A click on the start screen.
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
