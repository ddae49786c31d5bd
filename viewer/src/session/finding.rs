//! What was picked or found, and what is hidden by hand.

use super::Session;
use crate::go::bounds;
use crate::ui::find::{What, objects};
use enfilade::{CellId, ObjectId};
use glam::Vec3;

/// What a person has chosen.
#[derive(Default)]
pub(super) struct Selected {
    /// Its objects.
    pub objects: Vec<ObjectId>,
    /// What is outlined.
    pub boxes: Vec<[Vec3; 2]>,
    /// What is told of, and in which cell.
    pub told: Option<(ObjectId, CellId)>,
}

impl Session<'_> {
    /// The objects that were picked or found last.
    pub fn selected(&self) -> &[ObjectId] {
        &self.selected.objects
    }

    /// Selects an object that was picked in a cell.
    pub(super) fn select(&mut self, object: ObjectId, cell: CellId) {
        self.selected = Selected { objects: vec![object], boxes: Vec::new(), told: Some((object, cell)) };
    }

    /// Goes to what was found, looks at it, and outlines it. Of several objects, the nearest is gone to.
    pub fn go_to_found(&mut self, what: What) {
        self.picked.clear();
        self.told = None;
        self.selected = Selected::default();
        let eye = self.walker.eye;
        if let What::Room(cell) = what {
            let to = self.guide().into_room(cell);
            let room = self.rooms().iter().find(|room| room.cell == cell).map(bounds);
            self.selected.boxes = room.map(|b| [b.min.as_vec3(), b.max.as_vec3()]).into_iter().collect();
            to.into_iter().for_each(|to| self.be(to));
            return;
        }
        let objects = objects(self.building, what);
        let scene = &self.building.scene;
        let away = |o: &&ObjectId| {
            let bounds = &scene.objects[o.index()].bounds;
            eye.distance_squared(eye.clamp(bounds.min, bounds.max))
        };
        let Some(&nearest) = objects.iter().min_by(|a, b| away(a).total_cmp(&away(b))) else { return };
        // A node is one thing; things of one material are many.
        let to = match what {
            What::Node(_) => self.guide().before(&objects, eye),
            _ => self.guide().before(&[nearest], eye),
        };
        self.be(to);
        let placement = &self.building.file.placement;
        let cell = (0..self.building.file.cells.len()).find(|&c| placement.get(c, nearest.index()));
        let told = cell.map(|cell| (nearest, CellId(cell as u32)));
        let boxes = objects.iter().map(|o| self.building.file.objects[o.index()].bounds).collect();
        self.selected = Selected { objects, boxes, told };
    }

    /// Hides what is selected, or all else; with nothing selected, nothing.
    pub(super) fn hide(&mut self, all_else: bool) {
        let mut chosen = vec![false; self.building.scene.objects.len()];
        self.selected.objects.iter().for_each(|o| chosen[o.index()] = true);
        if self.selected.objects.is_empty() {
            return;
        }
        // A leaf is one thing, whatever it is made of.
        for door in &self.stage.doors.doors {
            if door.objects().any(|o| chosen[o.index()]) {
                door.objects().for_each(|o| chosen[o.index()] = true);
            }
        }
        let is_hidden = chosen.iter().enumerate().map(|(o, &is_chosen)| match all_else {
            true => !is_chosen,
            false => is_chosen || self.stage.is_hidden(ObjectId(o as u32)),
        });
        let is_hidden = is_hidden.collect();
        self.stage.hide(is_hidden, all_else);
        if !all_else {
            self.picked.clear();
            self.told = None;
            self.selected = Selected::default();
        }
    }

    /// Shows all again.
    pub(super) fn show_all(&mut self) {
        self.stage.hide(vec![false; self.building.scene.objects.len()], false);
    }
}
