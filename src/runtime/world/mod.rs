//! A world of modules: cullers that stand several times, each in its place, joined where their portals lie on each other.
//!
//! A module is a file of its own, baked alone: a room, a corridor, a house. Its *ways in* are the portals between its cells and its outside,
//! the cells without an end. Where a way in of one module lies on that of another, [`World::join`] makes one opening of both: a view goes on
//! in the other module, instead of outside. What is not joined leads outdoors, which all modules share.
//!
//! Modules must not overlap: beyond a way in that is joined, only the other module is drawn, until the view leaves it. So a leaf that stands in
//! the other's room is a mover of it. And joined portals count as the same opening: through a crack between them, which is as wide as
//! [`World::join`] allows, nothing is promised.
//!
//! **Rows**: a row of the eye's own module holds there, wherever lines of sight go in between, since with the module alone they go the same
//! way, and less is in it. In another module, lines come in through ways in, from anywhere beyond. So what they show is in the rows of these
//! ways in (`bake --module`), or in the row of its outside.

mod joins;
mod placement;
mod reach;
mod view;

pub use joins::WorldError;
pub use placement::{NotRigid, Placement};
pub use view::WorldView;

use super::boxes::Boxes;
use super::culler::Culler;
use crate::math::geom::Aabb;
use crate::{DirectedPortal, PortalId};
use glam::Vec3;
use joins::Join;
use std::fmt;
use std::sync::Arc;

/// A module in a world. Its slot is a small number for lists of the client's; a later module may get the slot, and never the id.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[repr(C)]
#[cfg_attr(feature = "bytemuck", derive(bytemuck::Pod, bytemuck::Zeroable))]
pub struct ModuleId {
    /// Its index; slots are used again.
    pub slot: u32,
    /// Number of modules that had the slot before.
    pub life: u32,
}

impl fmt::Display for ModuleId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.slot, self.life)
    }
}

/// A culler in its place.
#[derive(Clone, Debug)]
struct Module {
    culler: Arc<Culler>,
    placement: Placement,
    /// The box around its cells but the outside, in the world, metres.
    inside: Aabb,
    /// By portal.
    joins: Vec<Option<Join>>,
    /// Directed portals that lead out through a join, as bits.
    joined: Vec<u64>,
}

#[derive(Clone, Debug, Default)]
struct Slot {
    life: u32,
    module: Option<Module>,
}

/// Modules and their joins, for any number of views ([`WorldView`]).
#[derive(Clone, Debug, Default)]
pub struct World {
    slots: Vec<Slot>,
    free: Vec<u32>,
    /// By slot: the box around the module's cells but the outside, and its objects.
    boxes: Boxes,
    /// The largest tolerance of a module, metres.
    tolerance: f64,
}

impl World {
    /// Without modules.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a module, joined to none.
    pub fn place(&mut self, culler: &Arc<Culler>, placement: Placement) -> ModuleId {
        let slot = self.free.pop().unwrap_or_else(|| {
            self.slots.push(Slot::default());
            self.slots.len() as u32 - 1
        });
        let portals = culler.portal_count();
        let (joins, joined) = (vec![None; portals], vec![0; (2 * portals).div_ceil(64)]);
        let around = |bounds: Option<[Vec3; 2]>| {
            let corner = |i: u32, [low, high]: [Vec3; 2]| {
                let end = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
                placement.to_world(Vec3::new(end(0), end(1), end(2)).as_dvec3())
            };
            let all = bounds.map_or(Aabb::EMPTY, |bounds| Aabb::of((0..8).map(|i| corner(i, bounds))));
            all.inflated(4.0 * culler.tolerance)
        };
        self.tolerance = self.tolerance.max(culler.tolerance);
        let (inside, whole) = (around(culler.inside), around(culler.whole));
        self.boxes.resize(self.slots.len());
        self.boxes.set(slot as usize, [whole.min.as_vec3(), whole.max.as_vec3()]);
        let entry = &mut self.slots[slot as usize];
        entry.module = Some(Module { culler: culler.clone(), placement, inside, joins, joined });
        ModuleId { slot, life: entry.life }
    }

    /// Parts all joins of a module, and removes it.
    ///
    /// # Errors
    ///
    /// If it was removed before.
    pub fn remove(&mut self, module: ModuleId) -> Result<(), WorldError> {
        self.part_all(module)?;
        let slot = &mut self.slots[module.slot as usize];
        slot.module = None;
        slot.life = slot.life.wrapping_add(1);
        self.free.push(module.slot);
        Ok(())
    }

    /// The modules, by slot.
    pub fn modules(&self) -> impl Iterator<Item = ModuleId> + '_ {
        self.known().map(|(id, _)| id)
    }

    /// The culler of a module.
    ///
    /// # Errors
    ///
    /// If it was removed.
    pub fn culler(&self, module: ModuleId) -> Result<&Arc<Culler>, WorldError> {
        self.module(module).map(|module| &module.culler)
    }

    /// The place of a module.
    ///
    /// # Errors
    ///
    /// If it was removed.
    pub fn placement(&self, module: ModuleId) -> Result<Placement, WorldError> {
        self.module(module).map(|module| module.placement)
    }

    fn known(&self) -> impl Iterator<Item = (ModuleId, &Module)> {
        (0..).zip(&self.slots).filter_map(|(slot, s)| Some((ModuleId { slot, life: s.life }, s.module.as_ref()?)))
    }

    fn module(&self, id: ModuleId) -> Result<&Module, WorldError> {
        let slot = self.slots.get(id.slot as usize).filter(|slot| slot.life == id.life);
        slot.and_then(|slot| slot.module.as_ref()).ok_or(WorldError::Removed(id))
    }

    fn module_mut(&mut self, id: ModuleId) -> Result<&mut Module, WorldError> {
        let slot = self.slots.get_mut(id.slot as usize).filter(|slot| slot.life == id.life);
        slot.and_then(|slot| slot.module.as_mut()).ok_or(WorldError::Removed(id))
    }
}

impl Culler {
    /// The directed portal that leads in from outside, if a portal leads outside: exactly one of its cells has no end.
    pub fn way_in(&self, portal: PortalId) -> Option<DirectedPortal> {
        let cells = self.portal_cells.get(portal.index())?;
        match cells.map(|cell| self.is_outside(cell)) {
            [true, false] => Some(portal.directed(0)),
            [false, true] => Some(portal.directed(1)),
            _ => None,
        }
    }

    /// The portals that lead outside, ascending.
    pub fn ways_in(&self) -> impl Iterator<Item = PortalId> + '_ {
        (0..self.portal_count() as u32).map(PortalId).filter(|&portal| self.way_in(portal).is_some())
    }
}
