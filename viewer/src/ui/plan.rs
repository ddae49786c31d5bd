//! The plan of the storey that the eye is on: its cell, what that sees, and the way walked.

use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::pages::storeys::{Storey, storeys};
use enfilade::walkthrough::picture::Picture;
use enfilade::walkthrough::plan::PlanView;
use glam::{DVec2, DVec3};

/// Its size, pixels.
const SIZE: [usize; 2] = [300, 240];
const PAPER: [u8; 3] = [250, 249, 246];

/// The plan.
pub struct Plan {
    storeys: Vec<Storey>,
    /// What the picture is of, and it.
    shown: Option<(usize, Vec<CellId>)>,
    view: Option<PlanView>,
    texture: Option<egui::TextureHandle>,
}

impl Plan {
    /// Of a file.
    pub fn new(file: &PvsFile) -> Self {
        Self { storeys: storeys(file), shown: None, view: None, texture: None }
    }

    /// Draws it: `cells` are in colours, `way` is a line, the eye sees between `sides` (x, z).
    pub fn show(
        &mut self,
        ui: &mut egui::Ui,
        file: &PvsFile,
        cells: &[CellId],
        eye: DVec3,
        sides: [DVec2; 2],
        way: &[DVec3],
    ) {
        let feet = eye.y - crate::body::EYE;
        let nearest = |s: &Storey| (s.floor - feet).abs();
        let storey =
            (0..self.storeys.len()).min_by(|&a, &b| nearest(&self.storeys[a]).total_cmp(&nearest(&self.storeys[b])));
        let (y, title) = match storey.map(|s| &self.storeys[s]) {
            Some(s) => (s.floor + s.cut, format!("Plan at {:.1} m", s.floor + file.origin.y)),
            None => (eye.y, "Plan".to_owned()),
        };
        let what = (storey.unwrap_or(0), cells.to_vec());
        if self.shown.as_ref() != Some(&what) {
            let view = PlanView::fit(file, y, &[], 4.0, 4.0, SIZE[0] as f64 - 8.0, SIZE[1] as f64 - 8.0);
            let mut seen = vec![false; file.cells.len()];
            cells.iter().for_each(|c| seen[c.index()] = true);
            let mut picture = Picture::new(SIZE[0], SIZE[1], PAPER);
            view.draw(&mut picture, file, &|c| seen[c.index()]);
            let image = egui::ColorImage::from_rgb(SIZE, picture.pixels().as_flattened());
            match &mut self.texture {
                Some(texture) => texture.set(image, egui::TextureOptions::LINEAR),
                None => self.texture = Some(ui.ctx().load_texture("plan", image, egui::TextureOptions::LINEAR)),
            }
            (self.shown, self.view) = (Some(what), Some(view));
        }
        let (Some(view), Some(texture)) = (&self.view, &self.texture) else { return };
        let window = egui::Window::new(title).id(egui::Id::unique("plan")).anchor(egui::Align2::RIGHT_TOP, [-8.0, 8.0]);
        window.auto_sized().show(ui.ctx(), |ui| {
            let rect = ui.image(texture).rect;
            let painter = ui.painter_at(rect);
            let at = |p: DVec2| {
                let p = view.pixel(p);
                rect.left_top() + egui::vec2(p.x as f32, p.y as f32)
            };
            let flat = |p: &DVec3| DVec2::new(p.x, p.z);
            let line: Vec<egui::Pos2> = way.iter().map(|p| at(flat(p))).collect();
            painter.line(line, egui::Stroke::new(1.5, egui::Color32::from_rgb(200, 40, 40)));
            let here = at(flat(&eye));
            for side in sides {
                let tip = egui::vec2(side.x as f32, side.y as f32).normalized() * 40.0;
                painter.line_segment([here, here + tip], egui::Stroke::new(1.0, egui::Color32::RED));
            }
            painter.circle_filled(here, 3.5, egui::Color32::RED);
        });
    }
}
