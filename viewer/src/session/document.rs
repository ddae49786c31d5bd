//! The open building, with what is worked out of it once: collision, rooms, rays, proofs.

use crate::building::Building;
use crate::collision::Solid;
use crate::doors::Doors;
use crate::draw::renderer::Renderer;
use crate::explain::{self, Explanation};
use crate::go::Guide;
use crate::output_files::OutputFiles;
use crate::pick;
use crate::start::rooms::{Room, rooms};
use crate::units::Units;
use enfilade::CellId;
use enfilade::proof::{Asker, Goal};
use enfilade::runtime::Culler;
use enfilade::scene::rays::{Hit, RayScene};
use glam::DVec3;
use std::cell::OnceCell;

/// An open building.
pub struct Document<'b> {
    /// The model, its file and its materials.
    pub building: &'b Building,
    /// Where pictures and paths are saved.
    pub output: OutputFiles,
    pub(super) solid: Solid<'b>,
    // Made when they are first needed.
    rooms: OnceCell<Vec<Room>>,
    rays: OnceCell<RayScene<'b>>,
    asker: OnceCell<Option<Asker<'b>>>,
}

impl<'b> Document<'b> {
    /// Of a building with its doors.
    pub(super) fn new(building: &'b Building, doors: &Doors) -> Self {
        let mut document = Self {
            building,
            output: OutputFiles::here(&building.scene.name),
            solid: Solid::without(&building.scene, &|t| doors.is_leaf[t]),
            rooms: OnceCell::new(),
            rays: OnceCell::new(),
            asker: OnceCell::new(),
        };
        document.doors_changed(doors);
        document
    }

    /// Doors were opened, shut or moved.
    pub(super) fn doors_changed(&mut self, doors: &Doors) {
        self.solid.put_in_the_way(&doors.blocks());
    }

    /// The closed cells as rooms.
    pub fn rooms(&self) -> &[Room] {
        self.rooms.get_or_init(|| rooms(&self.building.file, &self.building.scene))
    }

    /// Finds ways for a person.
    pub(super) fn guide<'d>(&'d self, culler: &'d Culler) -> Guide<'d> {
        Guide { building: self.building, solid: &self.solid, rooms: self.rooms(), culler }
    }

    /// The first surface on a ray, with leaves where they are now. A leaf that the viewer made gives nothing.
    pub(super) fn ahead(&self, renderer: &Renderer<'_>, eye: DVec3, direction: DVec3) -> Option<Hit> {
        let rays = self.rays.get_or_init(|| RayScene::new(&self.building.scene));
        let wall = pick::pick(rays, eye, direction, &|hit| {
            let is_passed = renderer.is_transparent[hit.object.index()] || renderer.doors.is_leaf[hit.triangle as usize];
            is_passed || renderer.is_hidden(hit.object) || renderer.is_cut_away(eye + direction * hit.t)
        });
        match renderer.doors.first_leaf(eye, direction, &|door| renderer.is_door_hidden(door)) {
            Some((t, of)) if wall.is_none_or(|wall| t < wall.t) && !renderer.is_cut_away(eye + direction * t) => {
                of.map(|(object, triangle)| Hit { t, object, triangle })
            }
            _ => wall,
        }
    }

    /// Whether a cell sees something, and why; `None` if the file keeps no rows.
    pub(super) fn explain(&self, cell: CellId, goal: Goal, units: Units) -> Option<Explanation> {
        let Building { scene, file, .. } = self.building;
        let asker = self.asker.get_or_init(|| Asker::new(file, Some(scene)).ok()).as_ref()?;
        Some(explain::tell(asker, file, cell, goal, units))
    }
}
