//! The visibility matrix: which cell sees which, in the order in which one walks through the building. The wheel zooms, a drag moves, a
//! click asks why.

use crate::commands::Command;
use enfilade::file::PvsFile;
use enfilade::{BitMatrix, CellId};
use enfilade_measure::pages::matrix::{UNDECIDED, WITNESSED, matrix};
use enfilade_measure::pages::storeys::{along_a_walk, storeys};
use std::ops::Range;

/// Longest side on the screen, points.
const SIDE: f32 = 360.0;
/// How much a point of the wheel enlarges.
const WHEEL: f32 = 0.004;
/// Fewest cells a side: fewer would be nothing but squares.
const FEWEST: f32 = 8.0;
/// Of pairs that are proven hidden.
const HIDDEN: egui::Color32 = egui::Color32::from_gray(245);

/// The matrix.
pub struct Matrix {
    /// Cells as one walks through the building.
    order: Vec<CellId>,
    /// The place of each storey's first cell, the lowest storey first.
    storeys: Vec<usize>,
    /// Where each cell is in the order.
    places: Vec<usize>,
    /// First row and column, and how many of both are shown; may lie between cells.
    view: [f32; 3],
    texture: Option<(Part, egui::TextureHandle)>,
    /// Pairs that are witnessed, undecided, hidden.
    counts: Option<[u64; 3]>,
}

/// The rows and columns of a picture.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Part {
    rows: Range<usize>,
    columns: Range<usize>,
}

/// Both sides; where a file keeps one of them only, that stands for both.
fn sides(file: &PvsFile) -> Option<(&BitMatrix, &BitMatrix)> {
    let sides = file.bounds.as_ref().map(|b| (&b.cells_lower, &b.cells_upper));
    sides.or(file.cell_rows.as_ref().map(|rows| (rows, rows)))
}

/// The verdict of a file on a pair, in words.
pub fn verdict(file: &PvsFile, from: CellId, to: CellId) -> &'static str {
    let Some((lower, upper)) = sides(file) else { return "not kept in the file" };
    match (lower.get(from.index(), to.index()), upper.get(from.index(), to.index()), file.bounds.is_some()) {
        (true, _, true) => "visible, with a witness",
        (true, _, false) => "drawn: visible or undecided",
        (false, true, _) => "undecided: drawn, to be safe",
        (false, false, _) => "hidden, proven",
    }
}

impl Matrix {
    /// Of a file.
    pub fn new(file: &PvsFile) -> Self {
        let levels = storeys(file);
        let order = along_a_walk(file, &levels);
        let mut places = vec![0; order.len()];
        order.iter().enumerate().for_each(|(place, cell)| places[cell.index()] = place);
        let first = |cells: &[CellId]| cells.iter().map(|cell| places[cell.index()]).min();
        let storeys = levels.iter().filter_map(|storey| first(&storey.cells)).collect();
        Self { view: [0.0, 0.0, places.len() as f32], order, storeys, places, texture: None, counts: None }
    }

    /// Draws it; a click on a pair asks why. `home` and `pair` are marked.
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        file: &PvsFile,
        home: Option<CellId>,
        pair: Option<[CellId; 2]>,
    ) -> Option<Command> {
        let mut clicked = None;
        let window = egui::Window::new("Visibility from cells (down) to cells (across)").id(egui::Id::unique("matrix"));
        window.anchor(egui::Align2::LEFT_BOTTOM, [8.0, -8.0]).auto_sized().show(ui.ctx(), |ui| {
            let Some((lower, upper)) = sides(file) else {
                ui.label("Every cell sees every cell, or there is only one: the file keeps no rows.");
                return;
            };
            self.legend(ui, file, lower, upper);
            let (rect, response) = ui.allocate_exact_size(egui::Vec2::splat(SIDE), egui::Sense::click_and_drag());
            self.look(ui, rect, &response);
            let painter = ui.painter_at(rect);
            painter.rect_filled(rect, 0.0, HIDDEN);
            self.paint(ui, &painter, rect, lower, upper);
            self.mark(&painter, rect, [home, home], egui::Color32::from_rgba_unmultiplied(200, 40, 40, 120));
            self.mark(&painter, rect, [0, 1].map(|side| pair.map(|pair| pair[side])), egui::Color32::BLACK);
            let under = response.hover_pos().and_then(|at| self.pair_at(rect, at));
            if let Some((from, to)) = under {
                let name = |cell: CellId| match &file.cells[cell.index()] {
                    named if named.source.is_some() => format!("{} (cell {cell})", named.name),
                    _ => format!("cell {cell}"),
                };
                let words = format!("{}\nsees {}?\n{}", name(from), name(to), verdict(file, from, to));
                response.clone().on_hover_text_at_pointer(words);
            }
            clicked = under.map(|(from, to)| [from, to]).filter(|_| response.clicked());
        });
        clicked.map(Command::Why)
    }

    /// Colours, what they stand for, and how many pairs there are of each.
    fn legend(&mut self, ui: &mut egui::Ui, file: &PvsFile, lower: &BitMatrix, upper: &BitMatrix) {
        let [witnessed, undecided, hidden] = *self.counts.get_or_insert_with(|| {
            let all = (upper.rows() * upper.rows()) as u64;
            let ones = |m: &BitMatrix| (0..m.rows()).map(|row| m.ones(row).count() as u64).sum::<u64>();
            let [lower, upper] = [ones(lower), ones(upper)];
            [lower, upper.saturating_sub(lower), all - upper.max(lower)]
        });
        let colour = |[r, g, b]: [u8; 3]| egui::Color32::from_rgb(r, g, b);
        let seen = if file.bounds.is_some() { "witnessed" } else { "not hidden" };
        ui.horizontal(|ui| {
            for (colour, name, count) in [
                (colour(WITNESSED), seen, witnessed),
                (colour(UNDECIDED), "undecided", undecided),
                (HIDDEN, "hidden", hidden),
            ] {
                super::legend::swatch(ui, colour);
                ui.small(format!("{name} {count}"));
            }
        });
        ui.small("Cells in walking order, storey by storey. Wheel: zoom. Drag: move. Click: why?");
    }

    /// The wheel zooms about the pointer, a drag moves.
    fn look(&mut self, ui: &egui::Ui, rect: egui::Rect, response: &egui::Response) {
        let all = self.places.len() as f32;
        let [row, column, count] = self.view;
        if response.dragged() {
            let by = response.drag_delta() / rect.height() * count;
            self.view = [row - by.y, column - by.x, count];
        }
        let turned = ui.input(|input| input.smooth_scroll_delta.y);
        if let Some(at) = response.hover_pos().filter(|_| turned != 0.0) {
            let closer = (count * (-turned * WHEEL).exp()).clamp(FEWEST.min(all), all);
            let part = (at - rect.min) / rect.height();
            self.view = [row + part.y * (count - closer), column + part.x * (count - closer), closer];
        }
        let [row, column, count] = self.view;
        self.view = [row.clamp(0.0, all - count), column.clamp(0.0, all - count), count];
    }

    fn paint(&mut self, ui: &egui::Ui, painter: &egui::Painter, rect: egui::Rect, lower: &BitMatrix, upper: &BitMatrix) {
        let all = self.places.len();
        let [row, column, count] = self.view;
        // Whole cells, as many down as across.
        let len = (count.ceil() as usize + 1).min(all);
        let part = |first: f32| {
            let first = (first as usize).min(all - len);
            first..first + len
        };
        let part = Part { rows: part(row), columns: part(column) };
        if self.texture.as_ref().is_none_or(|(shown, _)| *shown != part) {
            let picture = matrix(&self.part(&part, lower), &self.part(&part, upper));
            let image = egui::ColorImage::from_rgba_unmultiplied([picture.side; 2], picture.pixels.as_flattened());
            let texture = ui.ctx().load_texture("matrix", image, egui::TextureOptions::NEAREST);
            self.texture = Some((part.clone(), texture));
        }
        let Some((part, texture)) = &self.texture else { return };
        // The last pixel may stand for fewer pairs than the others, so that the picture ends beyond the last cell.
        let block = len.div_ceil(texture.size()[0]);
        let side = (texture.size()[0] * block) as f32 * rect.height() / count;
        let offset = egui::vec2(part.columns.start as f32 - column, part.rows.start as f32 - row) * rect.height() / count;
        let to = egui::Rect::from_min_size(rect.min + offset, egui::Vec2::splat(side));
        let whole = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
        painter.image(texture.id(), to, whole, egui::Color32::WHITE);
        // Where storeys begin.
        let stroke = egui::Stroke::new(1.0, egui::Color32::from_black_alpha(60));
        for first in &self.storeys {
            let at = |view: f32| (*first as f32 - view) * rect.height() / count;
            painter.hline(rect.x_range(), rect.top() + at(row), stroke);
            painter.vline(rect.left() + at(column), rect.y_range(), stroke);
        }
    }

    /// Some rows and columns of a matrix, in order.
    fn part(&self, part: &Part, of: &BitMatrix) -> BitMatrix {
        let mut shown = BitMatrix::new(part.rows.len(), part.columns.len());
        for (row, from) in self.order[part.rows.clone()].iter().enumerate() {
            for to in of.ones(from.index()) {
                let place = self.places[to];
                if part.columns.contains(&place) {
                    shown.set(row, place - part.columns.start);
                }
            }
        }
        shown
    }

    /// Lines through the middle of a row and of a column.
    fn mark(&self, painter: &egui::Painter, rect: egui::Rect, [from, to]: [Option<CellId>; 2], colour: egui::Color32) {
        let [row, column, count] = self.view;
        let at = |cell: CellId, view: f32| (self.places[cell.index()] as f32 + 0.5 - view) * rect.height() / count;
        let stroke = egui::Stroke::new(1.0, colour);
        from.map(|c| painter.hline(rect.x_range(), rect.top() + at(c, row), stroke));
        to.map(|c| painter.vline(rect.left() + at(c, column), rect.y_range(), stroke));
    }

    /// The pair under a point of the screen.
    fn pair_at(&self, rect: egui::Rect, at: egui::Pos2) -> Option<(CellId, CellId)> {
        let [row, column, count] = self.view;
        let part = (at - rect.min) / rect.height() * count;
        let cell = |place: f32| self.order.get(place.max(0.0) as usize).copied();
        Some((cell(row + part.y)?, cell(column + part.x)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(count: usize) -> Matrix {
        // Every place holds the cell that is as far from the other end.
        let order = (0..count as u32).rev().map(CellId).collect();
        let places = (0..count).rev().collect();
        Matrix { order, places, storeys: vec![0], view: [0.0, 0.0, count as f32], texture: None, counts: None }
    }

    #[test]
    fn a_point_is_of_the_pair_that_is_drawn_there() {
        let mut matrix = of(10);
        let rect = egui::Rect::from_min_size(egui::pos2(100.0, 50.0), egui::Vec2::splat(200.0));
        let pair =
            |matrix: &Matrix, x: f32, y: f32| matrix.pair_at(rect, egui::pos2(100.0 + x, 50.0 + y)).map(|(a, b)| (a.0, b.0));
        assert_eq!(pair(&matrix, 1.0, 1.0), Some((9, 9)));
        assert_eq!(pair(&matrix, 199.0, 21.0), Some((8, 0)));
        // Closer: four cells a side, from the third row and the second column.
        matrix.view = [2.0, 1.0, 4.0];
        assert_eq!([pair(&matrix, 10.0, 10.0), pair(&matrix, 190.0, 60.0)], [Some((7, 8)), Some((6, 5))]);
    }

    #[test]
    fn a_part_has_the_bits_of_its_cells() {
        let matrix = of(6);
        let mut bits = BitMatrix::new(6, 6);
        bits.set(5, 3);
        bits.set(4, 4);
        bits.set(0, 0);
        // Places 0 to 2 hold cells 5, 4 and 3; places 1 to 3 hold 4, 3 and 2.
        let part = matrix.part(&Part { rows: 0..3, columns: 1..4 }, &bits);
        let ones: Vec<(usize, usize)> =
            (0..3).flat_map(|row| part.ones(row).map(move |c| (row, c)).collect::<Vec<_>>()).collect();
        assert_eq!(ones, [(0, 1), (1, 0)]);
    }
}
