//! A view of a world: everything that one camera changes from frame to frame, in all modules.

use super::super::camera::{Camera, Rect};
use super::super::culler::Culler;
use super::super::doors::Doors;
use super::super::locate::Homes;
use super::super::mode::Mode;
use super::super::movers::{Collected, How, MoverId, Movers};
use super::super::objects::Opened;
use super::super::portals::Eye;
use super::super::scratch::Scratch;
use super::super::visible::{Lists, VisibleSet};
use super::{Module, ModuleId, World, WorldError};
use crate::DirectedPortal;
use std::collections::VecDeque;
use std::sync::Arc;

/// One camera's culling of a [`World`]. Modes with queries give the result of portals and rows.
///
/// After a module's first frame, nothing allocates.
#[derive(Clone, Debug)]
pub struct WorldView {
    /// By slot.
    pub(super) visits: Vec<Option<Visit>>,
    /// The modules of the last frame, the eye's own first.
    pub(super) seen: Vec<ModuleId>,
    /// Slots whose portals have opened further.
    pub(super) queue: VecDeque<u32>,
    /// What modules show of the outside: their slot, and a part of the screen.
    pub(super) outdoors: Vec<(u32, Rect)>,
    /// Whether a module shows more of the outside than the others were opened for.
    pub(super) shows_more: bool,
    /// The modules that are on a part of the screen, as bits by slot.
    pub(super) on_screen: Vec<u64>,
    /// The slot of a module that the eye was inside.
    pub(super) home: Option<u32>,
    /// How the last frame saw.
    how: Option<How>,
}

/// A module's part of a frame.
#[derive(Clone, Debug)]
pub(super) struct Visit {
    pub id: ModuleId,
    pub culler: Arc<Culler>,
    pub scratch: Scratch,
    lists: Lists,
    movers: Collected,
    /// In the module's coordinates.
    pub camera: Camera,
    /// Largest error of its place, metres.
    pub off: f64,
    pub eye: Eye,
    /// Whether the last frame shows it.
    pub is_seen: bool,
    /// The cells that the eye is in.
    pub homes: Homes,
    /// Whether the rows of these cells are all that the module shows.
    pub has_all_rows: bool,
    /// Whether it has no outside, and is seen from outdoors: then all of it that is on the screen counts.
    pub is_whole: bool,
    /// The part of the screen on which other modules show its outside.
    pub outdoors: Rect,
    /// Ways in through joins, with the part of the screen that each opens, and whether a door in it is shut.
    pub ways_in: Vec<(DirectedPortal, Rect, bool)>,
    /// By crossed portal: what was passed on to other modules.
    pub passed_on: Vec<Rect>,
    pub is_queued: bool,
}

impl Visit {
    fn new(id: ModuleId, module: &Module) -> Self {
        let culler = module.culler.clone();
        let camera = Camera::look_at(glam::DVec3::ZERO, glam::DVec3::X, 1.0, 1.0);
        Self {
            id,
            scratch: Scratch { joined: module.joined.clone(), ..Scratch::for_culler(&culler) },
            lists: Lists::for_culler(&culler),
            movers: Collected::default(),
            camera,
            off: 0.0,
            eye: Eye::new(&camera, &culler, None),
            is_seen: false,
            homes: Homes::none(),
            has_all_rows: false,
            is_whole: false,
            outdoors: Rect::EMPTY,
            ways_in: Vec::with_capacity(culler.portal_count()),
            passed_on: Vec::with_capacity(2 * culler.portal_count()),
            is_queued: false,
            culler,
        }
    }
}

impl Default for WorldView {
    fn default() -> Self {
        Self::new()
    }
}

impl WorldView {
    /// A view with all doors open.
    pub fn new() -> Self {
        let (visits, seen, queue, outdoors, on_screen) = Default::default();
        Self { visits, seen, queue, outdoors, shows_more: false, on_screen, home: None, how: None }
    }

    /// Takes the states of a module's doors, for the next frame and later ones.
    ///
    /// # Errors
    ///
    /// If the module was removed.
    ///
    /// # Panics
    ///
    /// If they are of a culler with another number of portals.
    pub fn set_doors(&mut self, world: &World, module: ModuleId, doors: &Doors) -> Result<(), WorldError> {
        world.module(module)?;
        self.follow(world);
        if let Some(visit) = self.visit(module) {
            visit.scratch.doors.assign(doors);
        }
        Ok(())
    }

    /// Culls a frame: gives the modules that it may show, those of the eye first. The camera is in the world's coordinates.
    pub fn cull(&mut self, world: &World, camera: &Camera, mode: Mode) -> &[ModuleId] {
        self.follow(world);
        let mode = mode.without_queries();
        let mode = if camera.is_orthographic() && mode != Mode::None { Mode::Frustum } else { mode };
        self.how = Some(How::of(self.find(world, camera, mode)));
        &self.seen
    }

    /// The modules that the last frame may show, those of the eye first.
    pub fn modules(&self) -> &[ModuleId] {
        &self.seen
    }

    /// The culler of a module that the last frame may show.
    pub fn culler(&self, module: ModuleId) -> Option<&Arc<Culler>> {
        let visit = self.visits.get(module.slot as usize)?.as_ref();
        visit.filter(|visit| visit.id == module && visit.is_seen).map(|visit| &visit.culler)
    }

    /// What the last frame shows of a module; `None`: nothing.
    pub fn visible(&mut self, module: ModuleId) -> Option<VisibleSet<'_>> {
        let Visit { culler, scratch, lists, camera, .. } = self.visit(module).filter(|visit| visit.is_seen)?;
        let Scratch { objects, cells, crossed, homes, stats, doors, .. } = &*scratch;
        Some(VisibleSet { objects, cells, portals: crossed, homes, stats: *stats, eye: camera.eye, culler, doors, lists })
    }

    /// The movers of a module that the last frame may show, each once; their boxes are in the module's coordinates.
    ///
    /// # Panics
    ///
    /// If they are of another culler.
    pub fn movers(&mut self, module: ModuleId, movers: &Movers) -> &[MoverId] {
        let how = self.how;
        let visit = self.visit(module).filter(|visit| visit.is_seen);
        let (Some(how), Some(Visit { culler, scratch, movers: out, camera, off, outdoors, .. })) = (how, visit) else {
            return &[];
        };
        out.ids.clear();
        let homes = scratch.homes.len();
        let mut open = Rect::FULL;
        if how == How::Portals && !outdoors.is_empty() {
            // The outside counts as the eye's own.
            if homes == 0 {
                open = *outdoors;
            }
            scratch.homes.extend_from_slice(&culler.outside);
        }
        let seen = Opened { culler, camera, front: None, open: &open, off: *off as f32 };
        out.add(movers, culler, how, &seen, scratch);
        scratch.homes.truncate(homes);
        &out.ids
    }

    fn visit(&mut self, module: ModuleId) -> Option<&mut Visit> {
        self.visits.get_mut(module.slot as usize)?.as_mut().filter(|visit| visit.id == module)
    }

    /// Keeps memory for each module of the world.
    fn follow(&mut self, world: &World) {
        self.visits.resize_with(world.slots.len(), || None);
        for ((slot, visit), entry) in (0..).zip(&mut self.visits).zip(&world.slots) {
            let id = ModuleId { slot, life: entry.life };
            match (visit.as_mut(), &entry.module) {
                (_, None) => *visit = None,
                (Some(known), Some(module)) if known.id == id && Arc::ptr_eq(&known.culler, &module.culler) => {}
                (Some(known), Some(module)) if Arc::ptr_eq(&known.culler, &module.culler) => {
                    known.id = id;
                    known.scratch.doors = Doors::open(&known.culler);
                }
                (_, Some(module)) => *visit = Some(Visit::new(id, module)),
            }
        }
        let modules = self.visits.len();
        self.seen.reserve(modules.saturating_sub(self.seen.len()));
        self.queue.reserve(modules.saturating_sub(self.queue.len()));
        self.outdoors.reserve(modules.saturating_sub(self.outdoors.len()));
        self.on_screen.reserve(modules.div_ceil(64).saturating_sub(self.on_screen.len()));
    }
}
