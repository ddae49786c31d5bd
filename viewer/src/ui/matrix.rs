//! The visibility matrix: which cell sees which. A click asks why.

use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::pages::matrix::{MatrixPicture, matrix};

/// Longest side on the screen, points.
const SIDE: f32 = 360.0;

/// The matrix.
pub struct Matrix {
    picture: Option<MatrixPicture>,
    texture: Option<egui::TextureHandle>,
}

impl Matrix {
    /// Of a file. Where it keeps one side of the truth only, that stands for both.
    pub fn new(file: &PvsFile) -> Self {
        let sides = file.bounds.as_ref().map(|b| (&b.cells_lower, &b.cells_upper));
        let sides = sides.or(file.cell_rows.as_ref().map(|rows| (rows, rows)));
        Self { picture: sides.map(|(lower, upper)| matrix(lower, upper)), texture: None }
    }

    /// Draws it; returns the pair that was clicked. `home` and `pair` are marked.
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        home: Option<CellId>,
        pair: Option<(CellId, CellId)>,
    ) -> Option<(CellId, CellId)> {
        let mut clicked = None;
        let window = egui::Window::new("Which cell (down) sees which (across)").id(egui::Id::unique("matrix"));
        window.anchor(egui::Align2::LEFT_BOTTOM, [8.0, -8.0]).auto_sized().show(ui.ctx(), |ui| {
            let Some(picture) = &self.picture else {
                ui.label("Every cell sees every cell, or there is only one: the file keeps no rows.");
                return;
            };
            let texture = self.texture.get_or_insert_with(|| {
                let bytes = picture.pixels.as_flattened();
                let image = egui::ColorImage::from_rgba_unmultiplied([picture.side; 2], bytes);
                ui.ctx().load_texture("matrix", image, egui::TextureOptions::NEAREST)
            });
            let image = egui::Image::new((texture.id(), egui::Vec2::splat(SIDE))).sense(egui::Sense::click());
            let shown = ui.add(image.bg_fill(egui::Color32::from_gray(245)));
            let cell = SIDE / (picture.side * picture.block) as f32;
            let painter = ui.painter_at(shown.rect);
            let mark = |row: Option<CellId>, column: Option<CellId>, colour| {
                let line = |c: CellId| (c.0 as f32 + 0.5) * cell;
                let stroke = egui::Stroke::new(1.0, colour);
                row.map(|c| painter.hline(shown.rect.x_range(), shown.rect.top() + line(c), stroke));
                column.map(|c| painter.vline(shown.rect.left() + line(c), shown.rect.y_range(), stroke));
            };
            mark(home, home, egui::Color32::from_rgba_unmultiplied(200, 40, 40, 120));
            mark(pair.map(|p| p.0), pair.map(|p| p.1), egui::Color32::BLACK);
            if let Some(at) = shown.interact_pointer_pos().filter(|_| shown.clicked()) {
                let [row, column] =
                    [at.y - shown.rect.top(), at.x - shown.rect.left()].map(|p| CellId((p / cell).max(0.0) as u32));
                clicked = Some((row, column));
            }
        });
        clicked
    }
}
