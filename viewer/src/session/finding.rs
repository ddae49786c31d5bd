//! What was picked or found, and what is hidden by hand.

use super::Session;
use crate::building::Building;
use crate::elements::{self, Sheet};
use crate::go::bounds;
use crate::ui::find::{What, facts, objects};
use crate::units::Units;
use enfilade::{CellId, ObjectId};
use glam::Vec3;

/// What a person has chosen.
#[derive(Default)]
pub(super) struct Selected {
    /// Its objects.
    pub objects: Vec<ObjectId>,
    /// What is outlined.
    pub boxes: Vec<[Vec3; 2]>,
    /// What is told of.
    pub told: Option<Of>,
    /// What its author tells of it, by set.
    pub sheets: Vec<Sheet>,
}

/// What is told of.
#[derive(Clone, Copy)]
pub(super) enum Of {
    /// An object, and the cell that it is in.
    Object(ObjectId, CellId),
    /// A room.
    Room(CellId),
}

impl Selected {
    /// What is told of it: names and values.
    pub fn facts(&self, building: &Building, units: Units) -> Vec<(&'static str, String)> {
        let (object, cell) = match self.told {
            Some(Of::Object(object, cell)) => (object, cell),
            Some(Of::Room(cell)) => return elements::of_cell(building, cell).map(elements::facts).unwrap_or_default(),
            None => return Vec::new(),
        };
        let element = elements::of_object(building, object);
        let mut told = element.map(elements::facts).unwrap_or_default();
        // The node of an element is its GlobalId.
        let own = facts(building, object, cell, units);
        told.extend(own.into_iter().filter(|(name, _)| element.is_none() || *name != "Node"));
        told
    }
}

impl Session<'_> {
    /// The objects that were picked or found last.
    pub fn selected(&self) -> &[ObjectId] {
        &self.selected.objects
    }

    /// Selects an object that was picked in a cell.
    pub(super) fn select(&mut self, object: ObjectId, cell: CellId) {
        let (told, sheets) = (Some(Of::Object(object, cell)), self.sheets(object));
        self.selected = Selected { objects: vec![object], boxes: Vec::new(), told, sheets };
    }

    /// What the author tells of an object.
    fn sheets(&self, object: ObjectId) -> Vec<Sheet> {
        elements::of_object(self.building, object).map(elements::sheets).unwrap_or_default()
    }

    /// What is told of what was picked or found: names and values, then sets of properties.
    pub fn told(&self) -> (Vec<(&'static str, String)>, &[Sheet]) {
        (self.selected.facts(self.building, self.preferences.units), &self.selected.sheets)
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
            let space = elements::of_cell(self.building, cell);
            self.selected.told = space.map(|_| Of::Room(cell));
            self.selected.sheets = space.map(elements::sheets).unwrap_or_default();
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
        let told = cell.map(|cell| Of::Object(nearest, CellId(cell as u32)));
        let sheets = cell.map(|_| self.sheets(nearest)).unwrap_or_default();
        let boxes = objects.iter().map(|o| self.building.file.objects[o.index()].bounds).collect();
        self.selected = Selected { objects, boxes, told, sheets };
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
