//! A frame of a walk as a picture: visible objects, crossed portals, missed pixels, a plan and counters.

use super::missed::Missed;
use super::picture::{CHARACTER, Picture};
use super::plan::{PlanView, portal_colour};
use super::raster::{View, draw};
use super::shade::{MAGENTA, shade};
use super::timed_culler::Seen;
use enfilade::file::PvsFile;
use enfilade::runtime::{Mode, Rect};
use enfilade::scene::Scene;
use enfilade::{CellId, ObjectId};
use glam::DVec2;

/// The contents of the picture.
pub(super) struct Overlay<'a> {
    /// The model.
    pub scene: &'a Scene,
    /// Its file.
    pub file: &'a PvsFile,
    /// The camera and the size of the picture.
    pub view: View,
    /// How it was culled.
    pub mode: Mode,
    /// The visible set.
    pub visible: Seen<'a>,
    /// Missed pixels.
    pub missed: &'a Missed,
    /// The line at the bottom.
    pub text: String,
}

impl Overlay<'_> {
    /// Draws it.
    pub fn picture(&self) -> Picture {
        let mut kept = vec![false; self.scene.objects.len()];
        self.visible.objects.iter().for_each(|o| kept[o.index()] = true);
        let ids = draw(self.scene, &self.view, &|o: ObjectId| kept[o.index()]);
        let mut picture = shade(self.scene, &self.view, &ids);
        self.draw_portals(&mut picture);
        let scale = (picture.width() / 640).max(1);
        self.draw_plan(&mut picture, scale);
        let bar = CHARACTER * scale + 6 * scale;
        let top = picture.height() as i64 - bar as i64;
        picture.fill(0, top, picture.width() as i64, bar as i64, [30, 34, 42], 0.80);
        picture.text(4 * scale as i64, top + 3 * scale as i64, scale, &self.text, [244, 244, 240]);
        // Last, so that nothing hides them.
        for &pixel in &self.missed.pixels {
            picture.pixels_mut()[pixel as usize] = MAGENTA;
        }
        picture
    }

    fn draw_portals(&self, picture: &mut Picture) {
        for crossed in self.visible.portals.iter().filter(|crossed| crossed.rect != Rect::FULL) {
            let kind = self.file.portals[crossed.portal.portal().index()].kind;
            let (a, b) = (crossed.rect.min.as_dvec2(), crossed.rect.max.as_dvec2());
            let low = self.view.pixel(DVec2::new(a.x, b.y)).floor();
            let size = self.view.pixel(DVec2::new(b.x, a.y)).ceil() - low;
            picture.frame(low.x as i64, low.y as i64, size.x as i64, size.y as i64, portal_colour(kind), 0.75);
        }
    }

    /// The plan in the upper right corner: visible cells are strong, others pale.
    fn draw_plan(&self, picture: &mut Picture, scale: usize) {
        let (width, height) = (picture.width() as f64 * 0.30, picture.height() as f64 * 0.40);
        let (left, top) = (picture.width() as f64 - width - 6.0 * scale as f64, 6.0 * scale as f64);
        let mut plan_picture = Picture::new(width as usize, height as usize, [250, 249, 246]);
        if plan_picture.pixels().is_empty() {
            return;
        }
        let mut seen = vec![false; self.file.cells.len()];
        match (self.mode, self.visible.home) {
            (Mode::Portals | Mode::PortalsAndPvs | Mode::Chc | Mode::ChcPlus, Some(_)) => {
                self.visible.cells.iter().for_each(|c| seen[c.index()] = true)
            }
            (Mode::Pvs, Some(home)) => self.file.cells_seen(home).for_each(|c| seen[c.index()] = true),
            _ => seen.fill(true),
        }
        let eye = self.view.camera.eye.as_dvec3();
        let plan = PlanView::fit(self.file, eye.y, &[DVec2::new(eye.x, eye.z)], 3.0, 3.0, width - 6.0, height - 6.0);
        plan.draw(&mut plan_picture, self.file, &|cell: CellId| seen[cell.index()]);
        let side = |x: f64| {
            let ray = self.view.camera.ray(DVec2::new(x, 0.0));
            DVec2::new(ray.x, ray.z)
        };
        plan.draw_eye(&mut plan_picture, DVec2::new(eye.x, eye.z), side(-1.0), side(1.0));
        picture.paste(left as i64, top as i64, &plan_picture, 0.94);
        picture.frame(
            left as i64 - 1,
            top as i64 - 1,
            plan_picture.width() as i64 + 2,
            plan_picture.height() as i64 + 2,
            [52, 56, 64],
            0.8,
        );
    }
}
