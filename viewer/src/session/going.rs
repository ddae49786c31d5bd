//! What takes a person somewhere at once: the plan, storeys, what was found.

use super::Session;
use crate::go::Guide;
use crate::plan_file;
use crate::plan_picture;
use crate::start::rooms::{Room, rooms};
use crate::ui::plan::Wish;
use crate::walker::Walker;
use glam::Vec3Swizzles;

impl Session<'_> {
    /// The closed cells as rooms.
    pub fn rooms(&self) -> &[Room] {
        self.rooms.get_or_init(|| rooms(&self.building.file, &self.building.scene))
    }

    /// Does what the plan is asked for.
    pub fn do_wish(&mut self, wish: Wish) {
        match wish {
            Wish::Go(storey, at) => {
                let to = self.guide().to_plan(&self.plan.storeys[storey], at);
                self.be(to);
            }
            Wish::Save(storey) => self.save_plan(storey),
        }
    }

    /// One storey up or down: the plan shows it; a second time, it is gone to.
    pub(super) fn turn_storey(&mut self, up: bool) {
        self.show.layers.plan = true;
        if let Some(storey) = self.plan.turn(up, self.walker.eye.y) {
            let to = self.guide().to_storey(&self.plan.storeys[storey], self.walker.eye.xz());
            self.be(to);
        }
    }

    /// Writes the plan that is shown beside the model.
    pub(super) fn save_shown_plan(&mut self) {
        self.show.layers.plan = true;
        self.save_plan(self.plan.shown(self.walker.eye.y));
    }

    fn save_plan(&mut self, storey: usize) {
        let text = plan_file::svg(self.building, &self.plan.storeys, &self.plan.swings, storey);
        let saved = self.kept.save("plan.svg", &|to| to.write_all(text.as_bytes()));
        if saved.is_err() {
            return self.tell_saved(saved);
        }
        let painted = plan_picture::picture(&self.stage.gpu, &text);
        let painted = painted
            .and_then(|picture| self.kept.save("plan.png", &|to| picture.write_png(to).map_err(std::io::Error::other)));
        match (saved, painted) {
            (Ok(svg), Ok(png)) => self.tell(format!("saved: {}, {}", svg.display(), png.display())),
            (_, painted) => self.tell_saved(painted),
        }
    }

    pub(super) fn guide(&self) -> Guide<'_> {
        let (rooms, culler) = (self.rooms(), &self.stage.culling.culler);
        Guide { building: self.building, solid: &self.solid, rooms, culler }
    }

    /// Is somewhere else; who looks at a frozen culling flies on.
    pub(super) fn be(&mut self, to: Walker) {
        self.walker = to;
        self.walker.flies |= self.is_frozen();
        self.plan.follow(to.eye.xz());
        // Nobody walked there.
        self.way.clear();
    }
}
