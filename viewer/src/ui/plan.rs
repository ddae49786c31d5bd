//! The plan of a storey: its cells, what the eye's cell sees, names and areas of rooms, and the way walked. A click goes there.

use crate::commands::Command;
use crate::doors::swings::Swing;
use crate::start::rooms::Room;
use crate::units::Units;
use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::math::geom::{Plane, clip};
use enfilade::types::portal::PortalKind;
use enfilade_measure::pages::storeys::{Storey, storeys};
use enfilade_measure::walkthrough::picture::{hsv, hue};
use enfilade_measure::walkthrough::plan::portal_colour;
use glam::{DVec2, DVec3, Vec4};

/// Its size, points.
const SIZE: egui::Vec2 = egui::vec2(300.0, 240.0);
const PAPER: egui::Color32 = egui::Color32::from_rgb(250, 249, 246);
const UNSEEN: egui::Color32 = egui::Color32::from_rgb(228, 228, 224);
const OPEN: egui::Color32 = egui::Color32::from_rgb(214, 228, 214);
/// Margin around the cells, as a part of their longer side.
const MARGIN: f64 = 0.05;
/// How much nearer and farther than the whole it is looked at.
const ZOOMS: [f64; 2] = [0.5, 100.0];
/// A point that the wheel turns is this power of e.
const WHEEL: f64 = 0.005;
/// Size of labels, points, and how much is free beside them.
const LABEL: (f32, f32) = (11.0, 2.0);
/// Slices of a cell that are nearer than this, metres, touch.
const TOUCH: f64 = 0.02;

/// The visit on the plan.
pub struct Visit<'a> {
    /// Rooms with names.
    pub rooms: &'a [Room],
    /// Cells in colours.
    pub cells: &'a [CellId],
    /// The eye.
    pub eye: DVec3,
    /// The eye sees between these directions (x, z).
    pub sides: [DVec2; 2],
    /// The walked way.
    pub trail: &'a [DVec3],
}

/// Which part of a plan is on the screen.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct View {
    /// The point (x, z) in the middle, metres.
    pub middle: DVec2,
    /// Points of the screen a metre.
    pub scale: f64,
}

impl View {
    /// All of a box.
    fn whole([min, max]: [DVec2; 2]) -> Self {
        let size = (max - min).max(DVec2::splat(1e-6)) + 2.0 * MARGIN * (max - min).max_element();
        let scale = (f64::from(SIZE.x) / size.x).min(f64::from(SIZE.y) / size.y);
        Self { middle: (min + max) * 0.5, scale }
    }

    /// Where a point (x, z) is on the screen.
    pub fn to_screen(&self, rect: egui::Rect, p: DVec2) -> egui::Pos2 {
        let p = (p - self.middle) * self.scale;
        rect.center() + egui::vec2(p.x as f32, p.y as f32)
    }

    /// Which point (x, z) is there.
    pub fn to_plan(&self, rect: egui::Rect, at: egui::Pos2) -> DVec2 {
        let by = at - rect.center();
        self.middle + DVec2::new(f64::from(by.x), f64::from(by.y)) / self.scale
    }

    /// Looks from nearer; what is `at` a point of the screen stays there.
    pub fn zoom(&mut self, rect: egui::Rect, at: egui::Pos2, factor: f64) {
        let before = self.to_plan(rect, at);
        self.scale *= factor;
        self.middle += before - self.to_plan(rect, at);
    }
}

/// A room's name with its area.
#[derive(Clone, PartialEq, Debug)]
struct Label {
    text: String,
    /// In the largest slice.
    at: DVec2,
    slices: Vec<Vec<DVec2>>,
}

/// The plan of a storey.
struct Drawing {
    /// Slices of cells, open ones first.
    cells: Vec<(CellId, Vec<Vec<DVec2>>)>,
    /// Ends of portals where they are cut, and their numbers.
    portals: Vec<(usize, [DVec2; 2])>,
    labels: Vec<Label>,
}

/// The plan.
pub struct Plan {
    /// From the lowest up.
    pub storeys: Vec<Storey>,
    /// Which part is on the screen; all of it at first.
    pub view: View,
    /// Where on the screen it was last.
    pub rect: egui::Rect,
    /// How doors swing.
    pub swings: Vec<Swing>,
    /// Another storey than the one that the eye is on.
    chosen: Option<usize>,
    bounds: [DVec2; 2],
    drawings: Vec<Option<Drawing>>,
    units: Units,
}

impl Plan {
    /// Of a file.
    pub fn new(file: &PvsFile) -> Self {
        let mut storeys = storeys(file);
        if storeys.is_empty() {
            // No closed cell: the plan is cut through the middle.
            let heights = file.objects.iter().flat_map(|o| o.bounds).map(|p| f64::from(p.y));
            let (low, high) = heights.fold((0f64, 0f64), |(a, b), y| (a.min(y), b.max(y)));
            storeys.push(Storey { floor: low, cut: 0.5 * (high - low), cells: Vec::new() });
        }
        let all = file.objects.iter().flat_map(|o| o.bounds).map(|p| DVec2::new(p.x.into(), p.z.into()));
        let everything = around(all).unwrap_or([DVec2::ZERO, DVec2::ONE]);
        let closed = |s: &Storey| {
            let pieces = s.cells.iter().flat_map(|c| &file.cells[c.index()].pieces);
            pieces.flat_map(|piece| slice(piece, s.floor + s.cut, everything)).collect::<Vec<_>>()
        };
        let bounds = around(storeys.iter().flat_map(closed)).unwrap_or(everything);
        let drawings = storeys.iter().map(|_| None).collect();
        let view = View::whole(bounds);
        Self {
            storeys,
            view,
            rect: egui::Rect::NOTHING,
            chosen: None,
            swings: Vec::new(),
            bounds,
            drawings,
            units: Units::default(),
        }
    }

    /// Tells heights and areas in these from now on.
    pub fn tell_in(&mut self, units: Units) {
        if std::mem::replace(&mut self.units, units) != units {
            self.drawings.fill_with(|| None);
        }
    }

    /// The storey for a height of the eye.
    pub fn here(&self, eye: f64) -> usize {
        let off = |s: &Storey| (s.floor + crate::body::EYE - eye).abs();
        (0..self.storeys.len()).min_by(|&a, &b| off(&self.storeys[a]).total_cmp(&off(&self.storeys[b]))).unwrap_or(0)
    }

    /// The storey that is shown.
    pub fn shown(&self, eye: f64) -> usize {
        self.chosen.unwrap_or(self.here(eye))
    }

    /// Shows another storey, or that of the eye again.
    pub fn choose(&mut self, storey: usize, eye: f64) {
        self.chosen = (storey != self.here(eye)).then_some(storey);
    }

    /// Shows the storey of the eye again, and the eye in the middle where it isn't to be seen.
    pub fn follow(&mut self, eye: DVec2) {
        self.chosen = None;
        if !self.rect.contains(self.view.to_screen(self.rect, eye)) {
            self.view.middle = eye;
        }
    }

    /// Shows one storey up or down. If it is shown already, it is returned, to go there.
    pub fn turn(&mut self, up: bool, eye: f64) -> Option<usize> {
        let (here, shown) = (self.here(eye), self.shown(eye));
        if if up { shown > here } else { shown < here } {
            self.chosen = None;
            return Some(shown);
        }
        let next = if up { shown + 1 } else { shown.checked_sub(1)? };
        if next < self.storeys.len() {
            self.choose(next, eye);
        }
        None
    }

    /// Names and areas of a storey's rooms, as they are written where there is room.
    pub fn names(&mut self, file: &PvsFile, rooms: &[Room], storey: usize) -> Vec<String> {
        self.drawing(file, rooms, storey).labels.iter().map(|label| label.text.clone()).collect()
    }

    fn drawing(&mut self, file: &PvsFile, rooms: &[Room], storey: usize) -> &Drawing {
        let (s, [min, max], units) = (&self.storeys[storey], self.bounds, self.units);
        let air = DVec2::splat(MARGIN * (max - min).max_element());
        self.drawings[storey].get_or_insert_with(|| Drawing::new(file, rooms, s, [min - air, max + air], units))
    }

    /// Draws it.
    pub fn show(&mut self, ui: &mut egui::Ui, file: &PvsFile, visit: &Visit<'_>) -> Option<Command> {
        let &Visit { rooms, cells, eye, sides, trail } = visit;
        let storey = self.shown(eye.y);
        let title = format!("Plan at {}", self.units.length(self.storeys[storey].floor + file.origin.y));
        let mut command = None;
        let window = egui::Window::new(title).id(egui::Id::unique("plan")).anchor(egui::Align2::RIGHT_TOP, [-8.0, 8.0]);
        window.auto_sized().show(ui.ctx(), |ui| {
            ui.set_max_width(SIZE.x);
            self.list(ui, file, eye.y);
            let (rect, response) = ui.allocate_exact_size(SIZE, egui::Sense::click_and_drag());
            self.rect = rect;
            self.look(ui, rect, &response);
            if let Some(at) = response.interact_pointer_pos().filter(|_| response.clicked()) {
                command = Some(Command::GoToPlan(storey, self.view.to_plan(rect, at)));
            }
            let painter = ui.painter_at(rect);
            painter.rect_filled(rect, 0.0, PAPER);
            let view = self.view;
            self.drawing(file, rooms, storey).paint(&painter, rect, &view, file, cells);
            self.draw_swings(&painter, rect, storey);
            if storey == self.here(eye.y) {
                draw_eye(&painter, rect, &view, (eye, sides), trail);
            }
            ui.horizontal(|ui| {
                if ui.small_button("Whole").on_hover_text("show the whole plan").clicked() {
                    self.view = View::whole(self.bounds);
                }
                if ui.small_button("Save").on_hover_text("write this plan beside the model, as SVG and PNG").clicked() {
                    command = Some(Command::SavePlan(storey));
                }
            });
        });
        command
    }

    /// How the doors of a storey swing.
    fn draw_swings(&self, painter: &egui::Painter, rect: egui::Rect, storey: usize) {
        let [r, g, b] = portal_colour(PortalKind::Door);
        let stroke = egui::Stroke::new(0.8, egui::Color32::from_rgb(r, g, b));
        for swing in self.swings.iter().filter(|swing| swing.is_on(&self.storeys[storey])) {
            painter.line(swing.line.iter().map(|p| self.view.to_screen(rect, *p)).collect(), stroke);
        }
    }

    /// The storeys, to choose from; the eye's own in bold.
    fn list(&mut self, ui: &mut egui::Ui, file: &PvsFile, eye: f64) {
        if self.storeys.len() < 2 {
            return;
        }
        let (here, shown) = (self.here(eye), self.shown(eye));
        ui.horizontal_wrapped(|ui| {
            for i in 0..self.storeys.len() {
                let text = egui::RichText::new(self.units.length(self.storeys[i].floor + file.origin.y));
                let text = if i == here { text.strong() } else { text };
                if ui.selectable_label(i == shown, text).clicked() {
                    self.choose(i, eye);
                }
            }
        });
    }

    /// The wheel zooms, a drag moves.
    fn look(&mut self, ui: &egui::Ui, rect: egui::Rect, response: &egui::Response) {
        if response.dragged() {
            let by = response.drag_delta();
            self.view.middle -= DVec2::new(f64::from(by.x), f64::from(by.y)) / self.view.scale;
        }
        let turned = f64::from(ui.input(|input| input.smooth_scroll_delta.y));
        if let Some(at) = response.hover_pos().filter(|_| turned != 0.0) {
            let whole = View::whole(self.bounds).scale;
            let scale = (self.view.scale * (turned * WHEEL).exp()).clamp(whole * ZOOMS[0], whole * ZOOMS[1]);
            self.view.zoom(rect, at, scale / self.view.scale);
        }
    }
}

impl Drawing {
    fn new(file: &PvsFile, rooms: &[Room], storey: &Storey, within: [DVec2; 2], units: Units) -> Self {
        let y = storey.floor + storey.cut;
        let slices = |pieces: &[Vec<Vec4>]| {
            pieces.iter().map(|piece| slice(piece, y, within)).filter(|s| s.len() > 2).collect::<Vec<_>>()
        };
        let ids = (0..file.cells.len() as u32).map(CellId);
        let cells = ids.map(|c| (c, slices(&file.cells[c.index()].pieces))).filter(|(_, slices)| !slices.is_empty());
        let mut cells: Vec<(CellId, Vec<Vec<DVec2>>)> = cells.collect();
        cells.sort_by_key(|(c, _)| !file.cells[c.index()].open);
        let portals = file.portals.iter().enumerate().filter_map(|(i, p)| Some((i, cut(&p.winding, y)?))).collect();
        let label = |room: &Room| {
            let (_, slices) = cells.iter().find(|(cell, _)| *cell == room.cell)?;
            let largest = slices.iter().max_by(|a, b| area(a).total_cmp(&area(b)))?;
            Some(Label {
                text: format!("{}\n{}", file.cells[room.cell.index()].name, units.area(room.area)),
                at: largest.iter().sum::<DVec2>() / largest.len() as f64,
                slices: slices.clone(),
            })
        };
        let labels = rooms.iter().filter(|room| room.is_named).filter_map(label).collect();
        Self { cells, portals, labels }
    }

    fn paint(&self, painter: &egui::Painter, rect: egui::Rect, view: &View, file: &PvsFile, seen: &[CellId]) {
        // 1. Cells. One mesh without soft edges, so that no seams show between the pieces of a cell.
        let mut mesh = egui::Mesh::default();
        for (cell, slices) in &self.cells {
            let [r, g, b] = hsv(hue(cell.index()), 0.38, 0.95);
            let colour = match (file.cells[cell.index()].open, seen.contains(cell)) {
                (_, false) => UNSEEN,
                (true, true) => OPEN,
                (false, true) => egui::Color32::from_rgb(r, g, b),
            };
            for slice in slices {
                let first = mesh.vertices.len() as u32;
                slice.iter().for_each(|p| mesh.colored_vertex(view.to_screen(rect, *p), colour));
                (1..slice.len() as u32 - 1).for_each(|i| mesh.add_triangle(first, first + i, first + i + 1));
            }
        }
        painter.add(mesh);
        // 2. Portals: doors, windows and openings, each in its colour.
        for (i, ends) in &self.portals {
            let portal = &file.portals[*i];
            let [r, g, b] = portal_colour(portal.kind);
            let is_seen = portal.cells.iter().any(|cell| seen.contains(cell));
            let colour = if is_seen { egui::Color32::from_rgb(r, g, b) } else { egui::Color32::from_rgb(190, 190, 186) };
            painter.line_segment(ends.map(|p| view.to_screen(rect, p)), egui::Stroke::new(1.5, colour));
        }
        // 3. Names, where there is room.
        for label in &self.labels {
            let font = egui::FontId::proportional(LABEL.0);
            let text = painter.layout_no_wrap(label.text.clone(), font, egui::Color32::from_gray(30));
            let half = (text.size() * 0.5 + egui::Vec2::splat(LABEL.1)) / view.scale as f32;
            let rows = [-1.0, 0.0, 1.0].map(|k| label.at + DVec2::new(0.0, k * f64::from(half.y)));
            if rows.into_iter().all(|row| free_across(&label.slices, row) >= f64::from(half.x)) {
                let at = view.to_screen(rect, label.at);
                painter.galley(at - text.size() * 0.5, text, egui::Color32::PLACEHOLDER);
            }
        }
    }
}

/// The way walked, and what the eye looks at.
fn draw_eye(painter: &egui::Painter, rect: egui::Rect, view: &View, (eye, sides): (DVec3, [DVec2; 2]), trail: &[DVec3]) {
    let at = |p: &DVec3| view.to_screen(rect, DVec2::new(p.x, p.z));
    painter.line(trail.iter().map(at).collect(), egui::Stroke::new(1.5, egui::Color32::from_rgb(200, 40, 40)));
    let here = at(&eye);
    for side in sides {
        let tip = egui::vec2(side.x as f32, side.y as f32).normalized() * 40.0;
        painter.line_segment([here, here + tip], egui::Stroke::new(1.0, egui::Color32::RED));
    }
    painter.circle_filled(here, 3.5, egui::Color32::RED);
}

/// The box around some points.
fn around(points: impl Iterator<Item = DVec2>) -> Option<[DVec2; 2]> {
    points.fold(None, |found: Option<[DVec2; 2]>, p| Some(found.map_or([p, p], |[min, max]| [min.min(p), max.max(p)])))
}

/// The part of a convex piece at a height, (x, z), within a box.
fn slice(planes: &[Vec4], y: f64, [min, max]: [DVec2; 2]) -> Vec<DVec2> {
    let corners = [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)];
    let mut polygon: Vec<DVec3> = corners.iter().map(|p| DVec3::new(p.x, y, p.y)).collect();
    for plane in planes {
        let plane = Plane { n: plane.truncate().as_dvec3(), d: f64::from(plane.w) };
        polygon = clip(&polygon, &plane, 1e-9);
        if polygon.is_empty() {
            break;
        }
    }
    polygon.into_iter().map(|p| DVec2::new(p.x, p.z)).collect()
}

/// Where a winding crosses a height, (x, z).
fn cut(winding: &[glam::Vec3], y: f64) -> Option<[DVec2; 2]> {
    let corners = || winding.iter().map(|p| p.as_dvec3());
    let mut ends = corners().zip(corners().cycle().skip(1)).filter(|(a, b)| (a.y <= y) != (b.y <= y)).map(|(a, b)| {
        let p = a + (b - a) * ((y - a.y) / (b.y - a.y));
        DVec2::new(p.x, p.z)
    });
    Some([ends.next()?, ends.next()?])
}

fn area(polygon: &[DVec2]) -> f64 {
    let sides = polygon.iter().zip(polygon.iter().cycle().skip(1));
    sides.map(|(a, b)| a.perp_dot(*b)).sum::<f64>().abs() * 0.5
}

/// How far it is from a point to the left and to the right within some convex polygons that touch; the less of both.
fn free_across(slices: &[Vec<DVec2>], p: DVec2) -> f64 {
    let across = |slice: &Vec<DVec2>| {
        let sides = slice.iter().zip(slice.iter().cycle().skip(1)).filter(|(a, b)| (a.y > p.y) != (b.y > p.y));
        let at = sides.map(|(a, b)| a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y)));
        at.fold(None, |found: Option<[f64; 2]>, x| Some(found.map_or([x, x], |[l, h]| [l.min(x), h.max(x)])))
    };
    let mut spans: Vec<[f64; 2]> = slices.iter().filter_map(across).collect();
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut joined: Vec<[f64; 2]> = Vec::new();
    for span in spans {
        match joined.last_mut() {
            Some(last) if span[0] <= last[1] + TOUCH => last[1] = last[1].max(span[1]),
            _ => joined.push(span),
        }
    }
    joined.iter().map(|[low, high]| (p.x - low).min(high - p.x)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_under_the_pointer_stays_there_when_the_wheel_turns() {
        let rect = egui::Rect::from_min_size(egui::pos2(100.0, 50.0), SIZE);
        let mut view = View::whole([DVec2::new(-3.0, 2.0), DVec2::new(9.0, 8.0)]);
        assert_eq!(view.to_plan(rect, rect.center()), DVec2::new(3.0, 5.0));
        let (at, scale) = (egui::pos2(130.0, 200.0), view.scale);
        let before = view.to_plan(rect, at);
        view.zoom(rect, at, 4.0);
        assert!(view.to_plan(rect, at).distance(before) < 1e-9 && view.scale == 4.0 * scale);
        assert!((view.to_screen(rect, before) - at).length() < 1e-3);
    }

    #[test]
    fn a_label_has_room_across_slices_that_touch() {
        let block = |a: f64, b: f64| [(a, 0.0), (b, 0.0), (b, 3.0), (a, 3.0)].map(DVec2::from).to_vec();
        let slices = [block(0.0, 2.0), block(2.01, 6.0), block(7.0, 9.0)];
        assert!((free_across(&slices, DVec2::new(1.0, 1.0)) - 1.0).abs() < 1e-9);
        assert!((free_across(&slices, DVec2::new(3.0, 1.0)) - 3.0).abs() < 1e-9);
        assert_eq!(free_across(&slices, DVec2::new(6.5, 1.0)), 0.0);
        assert_eq!(free_across(&slices, DVec2::new(3.0, 4.0)), 0.0);
    }
}
