//! The plan: going to its points and storeys, and writing it.

use super::Session;
use crate::plan_file;
use crate::plan_picture;
use glam::{DVec2, Vec3Swizzles};

impl Session<'_> {
    /// Goes to a point (x, z) of a storey's plan.
    pub(super) fn go_to_plan(&mut self, storey: usize, at: DVec2) {
        let to = self.document.guide(&self.renderer.culling.culler).to_plan(&self.panels.plan.storeys[storey], at);
        self.be(to);
    }

    /// One storey up or down: the plan shows it; a second time, it is gone to.
    pub(super) fn turn_storey(&mut self, up: bool) {
        self.view.layers.plan = true;
        if let Some(storey) = self.panels.plan.turn(up, self.motion.walker.eye.y) {
            let to = self
                .document
                .guide(&self.renderer.culling.culler)
                .to_storey(&self.panels.plan.storeys[storey], self.motion.walker.eye.xz());
            self.be(to);
        }
    }

    /// Writes the plan that is shown beside the model.
    pub(super) fn save_shown_plan(&mut self) {
        self.view.layers.plan = true;
        self.save_plan(self.panels.plan.shown(self.motion.walker.eye.y));
    }

    pub(super) fn save_plan(&mut self, storey: usize) {
        let text = plan_file::svg(self.document.building, &self.panels.plan.storeys, &self.panels.plan.swings, storey);
        let saved = self.document.output.save("plan.svg", &|to| to.write_all(text.as_bytes()));
        if saved.is_err() {
            return self.tell_saved(saved);
        }
        let painted = plan_picture::picture(&text);
        let painted = painted.and_then(|picture| {
            self.document.output.save("plan.png", &|to| picture.write_png(to).map_err(std::io::Error::other))
        });
        match (saved, painted) {
            (Ok(svg), Ok(png)) => self.tell(format!("saved: {}, {}", svg.display(), png.display())),
            (_, painted) => self.tell_saved(painted),
        }
    }
}
