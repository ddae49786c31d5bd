//! A frame of a world: from module to module, through portals that are joined and outdoors, until no part of the screen grows.
//!
//! Each module has its own frame, in its own coordinates ([`super::super::portals`]), and the screen is the same for all. A portal that is
//! joined passes on the rectangle that it opens; the way in that it is joined to opens what its own outline has of that. A portal that leads
//! outdoors passes on its rectangle to the outside of all other modules. Rectangles only grow, and their sides come from a finite set.

use super::super::boxes::{Boxes, HalfSpaces, LANES};
use super::super::camera::{Camera, Rect};
use super::super::culler::{Culler, all_ones, bit};
use super::super::locate::Homes;
use super::super::mode::Mode;
use super::super::objects::{CollectObjects, Opened};
use super::super::portals::{self, Eye, Lens};
use super::super::scratch::PortalState;
use super::joins::Join;
use super::view::{Visit, WorldView};
use super::{Module, World};
use crate::math::simd::{Vectorize, vectorized};
use crate::{CellId, DirectedPortal, PortalId};

/// A frame that is asked for.
#[derive(Clone, Copy)]
struct Frame<'f> {
    world: &'f World,
    camera: &'f Camera,
    mode: Mode,
    /// The same in all modules.
    lens: Lens,
}

impl Frame<'_> {
    fn module(&self, slot: u32) -> Option<&Module> {
        self.world.slots.get(slot as usize)?.module.as_ref()
    }

    fn has_rows(&self) -> bool {
        matches!(self.mode, Mode::Pvs | Mode::PortalsAndPvs)
    }

    fn has_portals(&self) -> bool {
        matches!(self.mode, Mode::Portals | Mode::PortalsAndPvs)
    }
}

impl WorldView {
    /// Finds the modules of a frame, and their objects. Gives the mode that it was done in: an eye in no cell sees what is on the screen.
    pub(super) fn find(&mut self, world: &World, camera: &Camera, mode: Mode) -> Mode {
        self.seen.clear();
        self.queue.clear();
        self.outdoors.clear();
        self.shows_more = false;
        self.visits.iter_mut().flatten().for_each(|visit| visit.is_seen = false);
        let mut frame = Frame { world, camera, mode, lens: Lens::of(camera) };
        let culls = frame.has_rows() || frame.has_portals();
        if !culls || !self.place_eye(&frame) {
            frame.mode = if mode == Mode::None { mode } else { Mode::Frustum };
            self.seen.clear();
            self.visits.iter_mut().flatten().for_each(|visit| visit.is_seen = false);
            for id in world.modules() {
                self.begin(&frame, id.slot);
            }
        }
        loop {
            while let Some(slot) = self.queue.pop_front() {
                self.spread(&frame, slot);
            }
            self.go_outdoors(&frame);
            if self.queue.is_empty() {
                break;
            }
        }
        for id in &self.seen {
            if let Some(visit) = &mut self.visits[id.slot as usize] {
                visit.finish(frame.mode);
            }
        }
        let visits = &self.visits;
        let is_drawn = |visit: &Visit| {
            !visit.scratch.objects.is_empty() || !visit.scratch.homes.is_empty() || !visit.scratch.crossed.is_empty()
        };
        self.seen.retain(|id| visits[id.slot as usize].as_ref().is_some_and(is_drawn));
        frame.mode
    }

    /// Begins at the cells that the eye is in. False: it is in none, or in too many.
    fn place_eye(&mut self, frame: &Frame<'_>) -> bool {
        if let Some((slot, cell)) = self.home.and_then(|slot| Some((slot, self.still_in(frame, slot)?))) {
            let visit = self.begin(frame, slot);
            (visit.homes, visit.has_all_rows) = (Homes::one(cell), true);
            visit.start(frame);
            self.enqueue(slot);
            return true;
        }
        self.home = None;
        let eye = frame.camera.eye.as_dvec3();
        let is_near = |module: &Module| module.inside.contains(eye);
        let (mut inside, mut is_outdoors) = (0, true);
        for (id, module) in frame.world.known().filter(|(_, module)| is_near(module)) {
            let Some(homes) = self.locate(frame, id.slot) else { return false };
            let is_outside = |cell: &&CellId| module.culler.is_outside(**cell);
            if homes.as_slice().iter().any(|cell| !is_outside(&cell)) {
                inside += 1;
                is_outdoors &= homes.as_slice().iter().any(|cell| is_outside(&cell));
                self.home = Some(id.slot);
                self.begin(frame, id.slot).homes = homes;
            }
        }
        if is_outdoors {
            for (id, _) in frame.world.known() {
                if self.visits[id.slot as usize].as_ref().is_some_and(|visit| visit.is_seen) {
                    continue;
                }
                let homes = self.locate(frame, id.slot).unwrap_or(Homes::none());
                if !homes.as_slice().is_empty() {
                    self.begin(frame, id.slot).homes = homes;
                } else if inside == 0 {
                    return false;
                }
            }
        }
        for i in 0..self.seen.len() {
            let slot = self.seen[i].slot;
            if let Some(visit) = &mut self.visits[slot as usize] {
                visit.has_all_rows = inside == 1 && !is_outdoors;
                visit.start(frame);
                self.enqueue(slot);
            }
        }
        !self.seen.is_empty()
    }

    /// The cell of a module that the eye is in if it is well inside the piece of the last frame: then it is in no other module.
    fn still_in(&self, frame: &Frame<'_>, slot: u32) -> Option<CellId> {
        let (module, visit) = (frame.module(slot)?, self.visits.get(slot as usize)?.as_ref()?);
        let eye = module.placement.to_module(frame.camera.eye.as_dvec3());
        let margin = 2.0 * (module.culler.tolerance + frame.world.tolerance);
        let cell = module.culler.locator.well_inside(visit.scratch.last_piece, eye, margin);
        cell.filter(|cell| !module.culler.is_outside(*cell))
    }

    /// The cells of a module that the eye is in; `None`: too many.
    fn locate(&mut self, frame: &Frame<'_>, slot: u32) -> Option<Homes> {
        let (module, visit) = (frame.module(slot)?, self.visits[slot as usize].as_mut()?);
        let eye = module.placement.to_module(frame.camera.eye.as_dvec3()).as_vec3();
        let homes = module.culler.locate(eye, &mut visit.scratch.last_piece);
        (!homes.overflow).then_some(homes)
    }

    /// Begins the frame of a module, if it has not begun.
    fn begin(&mut self, frame: &Frame<'_>, slot: u32) -> &mut Visit {
        let visit = self.visits[slot as usize].as_mut().expect("memory for each module");
        if !visit.is_seen {
            self.seen.push(visit.id);
            if let Some(module) = frame.module(slot) {
                visit.begin(module, frame);
            }
        }
        visit
    }

    fn enqueue(&mut self, slot: u32) {
        if let Some(visit) = self.visits[slot as usize].as_mut().filter(|visit| !visit.is_queued) {
            visit.is_queued = true;
            self.queue.push_back(slot);
        }
    }

    /// Goes on in a module, and passes on what its portals open.
    fn spread(&mut self, frame: &Frame<'_>, slot: u32) {
        let (Some(module), Some(visit)) = (frame.module(slot), &mut self.visits[slot as usize]) else { return };
        visit.is_queued = false;
        if !frame.has_portals() {
            return self.spread_rows(frame, slot, module);
        }
        portals::spread(&visit.culler, &visit.eye, &mut visit.scratch);
        visit.passed_on.resize(visit.scratch.crossed.len(), Rect::EMPTY);
        for i in 0..visit.scratch.crossed.len() {
            let Some(visit) = &mut self.visits[slot as usize] else { return };
            let (Some(passed_on), Some(crossed)) = (visit.passed_on.get_mut(i), visit.scratch.crossed.get(i)) else {
                return;
            };
            let (portal, state) = (crossed.portal, visit.scratch.portal_states[crossed.portal.0 as usize]);
            if passed_on.covers(&state.open) {
                continue;
            }
            *passed_on = state.open;
            match module.joins[portal.portal().index()] {
                Some(join) if state.joined => self.enter(frame, join, state.open, state.shut),
                _ if !state.shut && leads_out(&module.culler, portal) => self.show_outdoors(slot, state.open),
                _ => {}
            }
        }
    }

    /// The same by rows alone: what a module's row has beyond its ways out.
    fn spread_rows(&mut self, frame: &Frame<'_>, slot: u32, module: &Module) {
        let culler = &module.culler;
        for portal in (0..culler.portal_count() as u32).map(PortalId) {
            let (Some(_), Some(visit)) = (culler.way_in(portal), &self.visits[slot as usize]) else { continue };
            let sees = |cell: CellId| !culler.cell_rows_prune || bit(&visit.scratch.cell_row, cell.index());
            if !culler.portal_cells[portal.index()].into_iter().all(sees) {
                continue;
            }
            match module.joins[portal.index()] {
                Some(join) => self.enter(frame, join, Rect::FULL, false),
                None => self.show_outdoors(slot, Rect::FULL),
            }
        }
    }

    /// Opens a way in of a module on a part of the screen.
    fn enter(&mut self, frame: &Frame<'_>, join: Join, open: Rect, is_shut: bool) {
        let slot = join.module.slot;
        if self.begin(frame, slot).enter(frame, join.portal, open, is_shut) {
            self.enqueue(slot);
        }
    }

    /// A module's portals show the outside on one more part of the screen.
    fn show_outdoors(&mut self, slot: u32, open: Rect) {
        match self.outdoors.iter_mut().find(|(from, _)| *from == slot) {
            Some((_, known)) if known.covers(&open) => return,
            Some((_, known)) => *known = known.union(open),
            None => self.outdoors.push((slot, open)),
        }
        self.shows_more = true;
    }

    /// Opens the outside of each module on the parts of the screen where other modules show it.
    fn go_outdoors(&mut self, frame: &Frame<'_>) {
        if !std::mem::take(&mut self.shows_more) {
            return;
        }
        let all = self.outdoors.iter().fold(Rect::EMPTY, |all, (_, open)| all.union(*open));
        self.on_screen.clear();
        let (boxes, screen) = (&frame.world.boxes, HalfSpaces::of(frame.camera, &all));
        vectorized(OnScreen { boxes, screen, bits: &mut self.on_screen });
        for (id, _) in frame.world.known() {
            if !bit(&self.on_screen, id.slot as usize) {
                continue;
            }
            let others = self.outdoors.iter().filter(|(from, _)| *from != id.slot);
            let open = others.fold(Rect::EMPTY, |all, (_, open)| all.union(*open));
            let known = self.visits[id.slot as usize].as_ref().filter(|visit| visit.is_seen);
            if open.is_empty() || known.is_some_and(|visit| visit.outdoors.covers(&open)) {
                continue;
            }
            if self.begin(frame, id.slot).open_outside(frame, open) {
                self.enqueue(id.slot);
            }
        }
    }
}

/// Whether a directed portal leads outside.
fn leads_out(culler: &Culler, portal: DirectedPortal) -> bool {
    culler.way_in(portal.portal()) == Some(portal.reversed())
}

/// Tells which of some boxes are on a part of the screen, for dispatch.
struct OnScreen<'a> {
    boxes: &'a Boxes,
    screen: HalfSpaces,
    bits: &'a mut Vec<u64>,
}

impl Vectorize for OnScreen<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        for start in (0..self.boxes.len()).step_by(LANES) {
            if start % 64 == 0 {
                self.bits.push(0);
            }
            self.bits[start / 64] |= u64::from(self.screen.meet(self.boxes, start)) << (start % 64);
        }
    }
}

impl Visit {
    fn begin(&mut self, module: &Module, frame: &Frame<'_>) {
        let Self { culler, scratch, .. } = self;
        (self.camera, self.off) = module.placement.camera(frame.camera, culler.extent);
        self.eye = Eye::of(&self.camera, culler, None, self.off, &frame.lens);
        (self.is_seen, self.is_queued, self.has_all_rows, self.is_whole) = (true, false, false, false);
        (self.homes, self.outdoors) = (Homes::none(), Rect::EMPTY);
        self.ways_in.clear();
        self.passed_on.clear();
        scratch.begin();
        scratch.queue.clear();
        scratch.joined.copy_from_slice(&module.joined);
        if frame.has_rows() {
            scratch.object_row.fill(0);
            scratch.cell_row.fill(0);
        } else {
            culler.join_rows(&[], scratch);
        }
    }

    /// Starts from the eye's cells.
    fn start(&mut self, frame: &Frame<'_>) {
        let Self { culler, scratch, homes, .. } = self;
        if frame.has_rows() {
            culler.join_rows(homes.as_slice(), scratch);
            culler.narrow_row(self.camera.eye, scratch);
        }
        if frame.has_portals() {
            portals::start(culler, &self.eye, homes.as_slice(), &Rect::FULL, scratch);
        }
    }

    /// Opens a way in on one more part of the screen. True if the view goes on from there.
    fn enter(&mut self, frame: &Frame<'_>, way_in: DirectedPortal, open: Rect, is_shut: bool) -> bool {
        let known = self.ways_in.iter().position(|(portal, ..)| *portal == way_in);
        let at = known.unwrap_or(self.ways_in.len());
        if known.is_none() {
            let is_shut = is_shut || self.eye.is_shut(&self.culler, way_in, &self.scratch.doors);
            self.ways_in.push((way_in, Rect::EMPTY, is_shut));
            self.prepare(at);
        }
        self.ways_in[at].1 = self.ways_in[at].1.union(open);
        let culler = self.culler.clone();
        let grew = known.is_none() && frame.has_rows() && self.allow(culler.way_in_rows(way_in));
        if !frame.has_portals() {
            return known.is_none();
        }
        if grew {
            self.again()
        } else {
            self.open_way_in(at)
        }
        !self.scratch.queue.is_empty()
    }

    /// Opens the outside on one more part of the screen. True if the view goes on from there.
    fn open_outside(&mut self, frame: &Frame<'_>, open: Rect) -> bool {
        let is_first = self.outdoors.is_empty();
        self.outdoors = self.outdoors.union(open);
        let culler = self.culler.clone();
        let mut grew = false;
        if is_first && frame.has_rows() {
            for &cell in &culler.outside {
                grew |= self.allow([culler.object_row(cell), culler.cell_row(cell)]);
            }
        }
        if culler.outside.is_empty() {
            self.is_whole = true;
            culler.join_rows(&[], &mut self.scratch);
            return false;
        }
        if !frame.has_portals() {
            return is_first;
        }
        if grew {
            self.again();
        } else {
            portals::start(&culler, &self.eye, &culler.outside, &self.outdoors, &mut self.scratch);
        }
        true
    }

    /// Adds rows of objects and cells (`None`: all), where the eye's own are not all. True if there are more cells than before.
    fn allow(&mut self, [objects, cells]: [Option<&[u64]>; 2]) -> bool {
        if self.has_all_rows {
            return false;
        }
        add(&mut self.scratch.object_row, objects, self.culler.object_count());
        add(&mut self.scratch.cell_row, cells, self.culler.cell_count())
    }

    /// The state of a way in, before it opens.
    fn prepare(&mut self, at: usize) {
        let (way_in, _, shut) = self.ways_in[at];
        let own = self.eye.own_outline(&self.culler, way_in);
        self.scratch.portal_states[way_in.0 as usize] = PortalState { own, shut, ..PortalState::UNSEEN };
    }

    fn open_way_in(&mut self, at: usize) {
        let (way_in, open, _) = self.ways_in[at];
        let state = &self.scratch.portal_states[way_in.0 as usize];
        let opened = open.intersection(state.own);
        if !opened.is_empty() && !state.open.covers(&opened) {
            self.scratch.open(way_in, opened);
        }
    }

    /// Begins again, since more cells may be entered.
    fn again(&mut self) {
        self.scratch.begin();
        self.scratch.queue.clear();
        self.passed_on.clear();
        let Self { culler, eye, homes, outdoors, scratch, .. } = self;
        portals::start(culler, eye, homes.as_slice(), &Rect::FULL, scratch);
        if !outdoors.is_empty() {
            portals::start(culler, eye, &culler.outside, outdoors, scratch);
        }
        for at in 0..self.ways_in.len() {
            self.prepare(at);
            self.open_way_in(at);
        }
    }

    /// Adds the objects.
    fn finish(&mut self, mode: Mode) {
        let Self { culler, scratch, camera, homes, outdoors, off, is_whole, .. } = self;
        let (culler, off) = (&**culler, *off as f32);
        match mode {
            Mode::None => culler.take_every(scratch),
            Mode::Portals | Mode::PortalsAndPvs if !*is_whole => {
                let seen = Opened { culler, camera, front: None, open: &Rect::FULL, off };
                let beside = (!outdoors.is_empty()).then_some((&culler.outside[..], *outdoors));
                portals::collect(CollectObjects { seen, homes: homes.as_slice(), beside, scratch });
            }
            _ => culler.take_in_row(camera, off, scratch),
        }
        scratch.homes.extend_from_slice(homes.as_slice());
        scratch.finish(culler);
    }
}

/// Adds a row (`None`: all ones). True if there are more ones than before.
fn add(out: &mut [u64], row: Option<&[u64]>, columns: usize) -> bool {
    let mut grew = 0;
    for (word, out) in out.iter_mut().enumerate() {
        let more = row.map_or_else(|| all_ones(columns, word), |row| row[word]);
        grew |= more & !*out;
        *out |= more;
    }
    grew != 0
}
