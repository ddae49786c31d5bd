//! What was picked or found, what is asked about it, and what is hidden by hand.

use super::Session;
use crate::building::Building;
use crate::elements::{self, Sheet};
use crate::explain::Explanation;
use crate::find::{FindTarget, facts, objects};
use crate::go::bounds;
use crate::units::Units;
use enfilade::proof::Goal;
use enfilade::scene::rays::Hit;
use enfilade::{CellId, ObjectId};
use glam::{DVec2, DVec3, Vec3};

/// A point this far before a surface, metres, is in the cell from which the surface is seen.
const BEFORE: f64 = 0.02;

/// The selection.
#[derive(Default)]
pub struct Selection {
    /// Objects that were picked or found last.
    pub objects: Vec<ObjectId>,
    /// Boxes that are outlined.
    pub(super) boxes: Vec<[Vec3; 2]>,
    /// Facts are told of this.
    subject: Option<Subject>,
    /// Its sets of properties.
    pub(super) sheets: Vec<Sheet>,
    /// The last picks, two at most: the cell before the surface, and the surface.
    pub(super) picked: Vec<(CellId, Hit)>,
    /// The pair of cells that was asked about.
    pub(super) pair: Option<[CellId; 2]>,
    /// The answer to `why`.
    pub(super) why: Option<Explanation>,
}

/// Something that facts are told of.
#[derive(Clone, Copy)]
enum Subject {
    /// An object, and the cell that it is in.
    Object(ObjectId, CellId),
    /// A room.
    Room(CellId),
}

impl Selection {
    /// Facts: names and values.
    pub(super) fn facts(&self, building: &Building, units: Units) -> Vec<(&'static str, String)> {
        let (object, cell) = match self.subject {
            Some(Subject::Object(object, cell)) => (object, cell),
            Some(Subject::Room(cell)) => return elements::of_cell(building, cell).map(elements::facts).unwrap_or_default(),
            None => return Vec::new(),
        };
        let element = elements::of_object(building, object);
        let mut told = element.map(elements::facts).unwrap_or_default();
        // The node of an element is its GlobalId.
        let own = facts(building, object, cell, units);
        told.extend(own.into_iter().filter(|(name, _)| element.is_none() || *name != "Node"));
        told
    }

    /// The line that answers `why`: from, to, metres relative to the origin.
    pub fn sight(&self) -> Option<[DVec3; 2]> {
        self.why.as_ref()?.sight
    }

    /// Selects objects, and tells facts of one of them in a cell.
    fn select(
        &mut self,
        building: &Building,
        objects: Vec<ObjectId>,
        boxes: Vec<[Vec3; 2]>,
        told: Option<(ObjectId, CellId)>,
    ) {
        let element = told.and_then(|(object, _)| elements::of_object(building, object));
        self.sheets = element.map(elements::sheets).unwrap_or_default();
        self.subject = told.map(|(object, cell)| Subject::Object(object, cell));
        (self.objects, self.boxes) = (objects, boxes);
    }

    fn select_room(&mut self, building: &Building, cell: CellId, boxes: Vec<[Vec3; 2]>) {
        let space = elements::of_cell(building, cell);
        self.subject = space.map(|_| Subject::Room(cell));
        self.sheets = space.map(elements::sheets).unwrap_or_default();
        (self.objects, self.boxes) = (Vec::new(), boxes);
    }

    /// Nothing is selected; the pair stays marked.
    fn clear(&mut self) {
        *self = Self { pair: self.pair, ..Self::default() };
    }

    /// Closes the answer to `why`.
    pub(super) fn close_why(&mut self) {
        (self.why, self.pair) = (None, None);
        self.picked.clear();
    }
}

impl Session<'_> {
    /// The first surface at a point of the screen.
    pub(super) fn ahead(&self, at: DVec2) -> Option<Hit> {
        self.document.ahead(&self.renderer, self.motion.walker.eye, self.camera().ray(at).normalize())
    }

    /// Facts of what was picked or found, and its sets of properties.
    pub fn told(&self) -> (Vec<(&'static str, String)>, &[Sheet]) {
        (self.selection.facts(self.document.building, self.user.preferences.units), &self.selection.sheets)
    }

    /// Picks what a ray meets. After a second pick: does the cell of the first see it?
    pub(super) fn pick(&mut self, at: DVec2) {
        let Some(hit) = self.ahead(at) else { return self.selection.clear() };
        let place = self.motion.walker.eye + self.camera().ray(at).normalize() * (hit.t - BEFORE).max(0.0);
        let Some(cell) = self.renderer.culling.culler.cell_of(place.as_vec3()) else { return };
        if self.selection.picked.len() == 2 {
            self.selection.picked.clear();
            self.selection.why = None;
        }
        self.selection.picked.push((cell, hit));
        self.selection.select(self.document.building, vec![hit.object], Vec::new(), Some((hit.object, cell)));
        if let [(cell, _), (_, hit)] = self.selection.picked[..] {
            self.ask(cell, Goal::Object(hit.object));
        }
    }

    /// Does the walker's cell see what is ahead?
    pub(super) fn ask_ahead(&mut self) {
        let home = self.renderer.culling.culler.cell_of(self.motion.walker.eye.as_vec3());
        if let (Some(home), Some(hit)) = (home, self.ahead(DVec2::ZERO)) {
            self.selection.picked = vec![(home, hit)];
            self.selection.select(self.document.building, vec![hit.object], Vec::new(), Some((hit.object, home)));
            self.ask(home, Goal::Object(hit.object));
        }
    }

    /// Does the first cell see the second?
    pub(super) fn ask_pair(&mut self, pair: [CellId; 2]) {
        let cells = self.document.building.file.cells.len();
        if pair.iter().all(|cell| cell.index() < cells) {
            self.selection.pair = Some(pair);
            self.selection.picked.clear();
            self.ask(pair[0], Goal::Cell(pair[1]));
        }
    }

    fn ask(&mut self, cell: CellId, goal: Goal) {
        self.selection.why = self.document.explain(cell, goal, self.user.preferences.units);
    }

    /// Goes to what was found, looks at it, and outlines it. Of several objects, it goes to the nearest.
    pub fn go_to_found(&mut self, target: FindTarget) {
        self.selection.clear();
        let (building, culler, eye) = (self.document.building, &self.renderer.culling.culler, self.motion.walker.eye);
        if let FindTarget::Room(cell) = target {
            let to = self.document.guide(culler).into_room(cell);
            let room = self.document.rooms().iter().find(|room| room.cell == cell).map(bounds);
            let boxes = room.map(|b| [b.min.as_vec3(), b.max.as_vec3()]).into_iter().collect();
            self.selection.select_room(building, cell, boxes);
            to.into_iter().for_each(|to| self.be(to));
            return;
        }
        let objects = objects(building, target);
        let away = |o: &&ObjectId| {
            let bounds = &building.scene.objects[o.index()].bounds;
            eye.distance_squared(eye.clamp(bounds.min, bounds.max))
        };
        let Some(&nearest) = objects.iter().min_by(|a, b| away(a).total_cmp(&away(b))) else { return };
        // A node is one thing; a material is on many.
        let to = match target {
            FindTarget::Node(_) => self.document.guide(culler).before(&objects, eye),
            _ => self.document.guide(culler).before(&[nearest], eye),
        };
        self.be(to);
        let cell = (0..building.file.cells.len()).find(|&c| building.file.placement.get(c, nearest.index()));
        let boxes = objects.iter().map(|o| building.file.objects[o.index()].bounds).collect();
        self.selection.select(building, objects, boxes, cell.map(|cell| (nearest, CellId(cell as u32))));
    }

    /// Hides what is selected, or everything else; nothing without a selection.
    pub(super) fn hide(&mut self, all_else: bool) {
        if self.selection.objects.is_empty() {
            return;
        }
        let mut chosen = vec![false; self.document.building.scene.objects.len()];
        self.selection.objects.iter().for_each(|o| chosen[o.index()] = true);
        // A leaf is hidden as a whole.
        for door in &self.renderer.doors.doors {
            if door.objects().any(|o| chosen[o.index()]) {
                door.objects().for_each(|o| chosen[o.index()] = true);
            }
        }
        let is_hidden = chosen.iter().enumerate().map(|(o, &is_chosen)| match all_else {
            true => !is_chosen,
            false => is_chosen || self.renderer.is_hidden(ObjectId(o as u32)),
        });
        let is_hidden = is_hidden.collect();
        self.renderer.hide(is_hidden, all_else);
        if !all_else {
            self.selection.clear();
        }
    }

    /// Shows everything again.
    pub(super) fn show_all(&mut self) {
        self.renderer.hide(vec![false; self.document.building.scene.objects.len()], false);
    }
}
