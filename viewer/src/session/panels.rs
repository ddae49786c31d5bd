//! Panels of a frame: collects what they show, and executes what they return.

use super::Session;
use crate::commands::{Action, Entry, TABLE};
use crate::ui::plan::Visit;
use crate::ui::{self, PanelData};
use enfilade::CellId;
use glam::DVec2;

impl Session<'_> {
    /// Runs the panels. Returns requests to the window.
    pub(super) fn run_panels(&mut self, mut input: egui::RawInput) -> egui::PlatformOutput {
        let size = self.size();
        input.screen_rect.get_or_insert_with(|| self.screen());
        if self.view.layers.plan {
            self.panels.plan.tell_in(self.user.preferences.units);
        }
        self.interface.context.set_zoom_factor(self.user.preferences.text as f32);
        let (home, cells) = self.reached();
        let (counters, beside, labels) = (self.lines(), self.lines_beside(), self.labels(&cells));
        let (facts, kinds) = (self.told().0, self.kinds());
        let on: Vec<Action> = TABLE.iter().filter(|entry| (entry.is_on)(self)).map(|entry| entry.action).collect();
        let camera = self.motion.frozen.map_or(self.camera(), |frozen| frozen.0);
        let sides = [-1.0, 1.0].map(|x| camera.ray(DVec2::new(x, 0.0))).map(|ray| DVec2::new(ray.x, ray.z));
        let frame = self.frame_of_profile();
        let Self { interface, panels, document, renderer, view, user, motion, insight, selection, .. } = self;
        let data = PanelData {
            building: document.building,
            view,
            preferences: &user.preferences,
            keys: &user.keys,
            is_frozen: motion.frozen.is_some(),
            is_on: &|entry: &Entry| on.contains(&entry.action),
            counters: &counters,
            counters_beside: beside.as_deref(),
            labels: &labels,
            decision: renderer.culling.last.as_ref(),
            kinds,
            profile: insight.profile.as_ref().map(|profile| (profile, frame)),
            shows_profile: insight.shows_profile,
            opening: self.opening.as_ref(),
            visit: Visit {
                rooms: if view.layers.plan { document.rooms() } else { &[] },
                cells: &cells,
                eye: motion.walker.eye,
                sides,
                trail: &motion.trail,
            },
            home,
            pair: selection.pair,
            section: Some(&self.section).filter(|cut| cut.is_on),
            terrain: renderer.terrain.as_ref().filter(|terrain| terrain.land.shows_tiles),
            tubes: renderer.tubes.as_ref().filter(|tubes| tubes.look.shows_sides),
            note: self.note.as_ref().map(|(line, _)| line.as_str()),
            facts: &facts,
            sheets: &selection.sheets,
            why: selection.why.as_ref(),
        };
        let mut commands = Vec::new();
        let output = interface.run(input, size, |ui| {
            let asked = ui::show(ui, &data, panels);
            // egui may run panels twice in a frame.
            if commands.is_empty() {
                commands = asked;
            }
        });
        commands.into_iter().for_each(|command| self.execute(command));
        output
    }

    /// What panels have of the screen, where the window does not say it.
    fn screen(&self) -> egui::Rect {
        let [width, height] = self.size().map(|s| s as f32 / self.user.preferences.text as f32);
        egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(width, height))
    }

    /// The cell of the eye, and the cells that the frame reaches; in modes without portals, those that the row of the eye's cell has.
    fn reached(&self) -> (Option<CellId>, Vec<CellId>) {
        let culling = &self.renderer.culling;
        let (home, cells) = culling.last.as_ref().map_or((None, &[][..]), |d| (d.home, &d.cells[..]));
        let home = home.or(culling.culler.cell_of(self.motion.walker.eye.as_vec3()));
        let cells = match home {
            Some(home) if cells.is_empty() => self.document.building.file.cells_seen(home).collect(),
            _ => cells.to_vec(),
        };
        (home, cells)
    }

    /// Triangles and pixels of the last frame that was told apart, by kind.
    fn kinds(&self) -> Option<([u64; 3], [u64; 3])> {
        self.renderer.kinds().zip(self.renderer.readback.marked.as_ref().map(|marked| marked.pixels))
    }
}
