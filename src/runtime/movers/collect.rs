//! Collects the movers of a frame: those in the lists of reached cells whose boxes are within the rectangles of portals, in blocks of boxes.

use super::super::around::Surroundings;
use super::super::boxes::{HalfSpaces, LANES};
use super::super::culler::Culler;
use super::super::mode::Mode;
use super::super::objects::Opened;
use super::super::scratch::Scratch;
use super::{MoverId, Movers};
use crate::CellId;
use crate::math::bits::ones;
use crate::math::geom::Aabb;
use crate::math::simd::{Vectorize, vectorized};
use crate::occlusion::oracle::{OcclusionOracle, QueryId};
use crate::occlusion::view::{Frustum, View};
use glam::Vec3;

/// How a frame sees.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(in super::super) enum How {
    /// Everything.
    All,
    /// What is on the screen.
    Screen,
    /// What is on the screen and in the cells of the joined row.
    Row,
    /// Through portals, from the eye's cells.
    Portals,
}

impl How {
    /// A frame in a mode without queries, with an eye in a cell.
    pub fn of(mode: Mode) -> Self {
        match mode {
            Mode::None => Self::All,
            Mode::Frustum => Self::Screen,
            Mode::Pvs => Self::Row,
            _ => Self::Portals,
        }
    }
}

/// The movers of frames, in memory for as many as there are.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct Collected {
    /// By slot: the last collection that took it.
    taken: Vec<u32>,
    collection: u32,
    pub ids: Vec<MoverId>,
    queries: Vec<Option<QueryId>>,
}

impl Collected {
    /// Begins a collection; keeps the ids of earlier ones.
    fn begin(&mut self, movers: &Movers) {
        let slots = movers.slots();
        if self.taken.len() < slots {
            self.taken.resize(slots, 0);
            self.ids.reserve(slots);
            self.queries.reserve(slots);
        }
        if self.collection == u32::MAX {
            self.collection = 0;
            self.taken.fill(0);
        }
        self.collection += 1;
    }

    /// Adds the movers of a frame, whose cells, rows and portals are in `scratch`; each once.
    pub fn add(&mut self, movers: &Movers, culler: &Culler, how: How, seen: &Opened<'_>, scratch: &mut Scratch) {
        assert!(std::ptr::eq(culler, &*movers.culler), "movers of another culler");
        self.begin(movers);
        match how {
            How::All => self.ids.extend(ones(&movers.used).map(|slot| movers.id(slot as u32))),
            How::Screen => vectorized(OnScreen { movers, screen: seen.around(), ids: &mut self.ids }),
            How::Row if !culler.cell_rows_prune => {
                vectorized(OnScreen { movers, screen: seen.around(), ids: &mut self.ids });
            }
            How::Row | How::Portals => vectorized(InCells { movers, how, seen, scratch, out: self }),
        }
    }

    /// Adds the movers whose box meets a convex volume and that are in the cells of the joined row.
    pub fn add_in_volume(
        &mut self,
        movers: &Movers,
        culler: &Culler,
        is_in_row: impl Fn(CellId) -> bool,
        is_outside: impl Fn(Vec3, Vec3) -> bool,
    ) {
        assert!(std::ptr::eq(culler, &*movers.culler), "movers of another culler");
        self.begin(movers);
        for slot in ones(&movers.used) {
            let (centre, half) = movers.boxes.get(slot);
            let cells = movers.slots[slot].cells();
            let is_lit = cells == [movers.anywhere()] || cells.iter().any(|&cell| is_in_row(cell));
            if is_lit && !is_outside(centre, half) {
                self.ids.push(movers.id(slot as u32));
            }
        }
    }

    /// Adds the movers around an eye: those in its surroundings' cells and doorways; all, if it is in no cell.
    pub fn add_around(&mut self, movers: &Movers, culler: &Culler, around: &Surroundings) {
        assert!(std::ptr::eq(culler, &*movers.culler), "movers of another culler");
        self.begin(movers);
        if around.cells.is_empty() {
            return self.ids.extend(ones(&movers.used).map(|slot| movers.id(slot as u32)));
        }
        for list in [movers.anywhere()].iter().chain(&around.cells) {
            self.take_in_list(movers, *list, |_| true);
        }
        for &(cell, doorway) in &around.doorways {
            self.take_in_list(movers, cell, |place| culler.is_in(doorway, movers.lists.boxes.get(place)));
        }
    }

    /// Adds the movers of a list whose place in it is wanted, if they are not taken yet.
    fn take_in_list(&mut self, movers: &Movers, list: CellId, is_wanted: impl Fn(usize) -> bool) {
        for (start, owners) in movers.lists.blocks(list.index()) {
            for (lane, owner) in owners.iter().enumerate() {
                if is_wanted(start + lane) {
                    self.take(movers, owner.slot);
                }
            }
        }
    }

    /// Adds a mover, if it is not taken yet.
    #[inline(always)]
    fn take(&mut self, movers: &Movers, slot: u32) {
        let taken = &mut self.taken[slot as usize];
        if *taken != self.collection {
            *taken = self.collection;
            self.ids.push(movers.id(slot));
        }
    }

    /// Removes those that an oracle, which has drawn the frame, sees nothing of.
    pub fn ask(&mut self, movers: &Movers, view: &View, oracle: &mut dyn OcclusionOracle) {
        let frustum = Frustum::new(view);
        self.queries.clear();
        for id in &self.ids {
            let (centre, half) = movers.boxes.get(id.slot as usize);
            let (centre, half) = (centre.as_dvec3(), half.as_dvec3());
            let bounds = Aabb { min: centre - half, max: centre + half }.into();
            let is_asked = centre.is_finite() && half.is_finite() && !frustum.meets_near(&bounds);
            self.queries.push(is_asked.then(|| oracle.issue(&[bounds])));
        }
        let mut kept = 0;
        for (i, query) in self.queries.iter().enumerate() {
            let is_seen = query.is_none_or(|query| {
                loop {
                    if let Some(answer) = oracle.poll(query) {
                        break answer;
                    }
                }
            });
            if is_seen {
                self.ids[kept] = self.ids[i];
                kept += 1;
            }
        }
        self.ids.truncate(kept);
    }
}

/// Adds the movers that are on the screen, for dispatch.
struct OnScreen<'a> {
    movers: &'a Movers,
    screen: HalfSpaces,
    ids: &'a mut Vec<MoverId>,
}

impl Vectorize for OnScreen<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        for (word, &used) in self.movers.used.iter().enumerate() {
            for first in (0..64).step_by(LANES) {
                let used = (used >> first) as u32 & ((1 << LANES) - 1);
                if used != 0 {
                    let start = word * 64 + first;
                    for i in ones(&[u64::from(used & self.screen.meet(&self.movers.boxes, start))]) {
                        self.ids.push(self.movers.id((start + i) as u32));
                    }
                }
            }
        }
    }
}

/// Adds the movers in the lists of some cells, for dispatch.
struct InCells<'a> {
    movers: &'a Movers,
    how: How,
    seen: &'a Opened<'a>,
    scratch: &'a mut Scratch,
    out: &'a mut Collected,
}

impl Vectorize for InCells<'_> {
    type Output = ();

    #[inline(always)]
    fn work(mut self) {
        let screen = self.seen.around();
        self.scratch.spaces.clear();
        self.take(self.movers.anywhere(), screen);
        if self.how == How::Row {
            for word in 0..self.scratch.cell_row.len() {
                for bit in ones(&[self.scratch.cell_row[word]]) {
                    self.take(CellId((64 * word + bit) as u32), screen);
                }
            }
            return;
        }
        for i in 0..self.scratch.homes.len() {
            self.take(self.scratch.homes[i], screen);
        }
        for i in 0..self.scratch.reached.len() {
            let cell = self.scratch.reached[i];
            let is_empty = self.movers.lists.is_empty(cell.index());
            // The eye's own cell is complete on the screen.
            if !is_empty && (self.seen.front.is_some() || !self.scratch.homes.contains(&cell)) {
                let around = self.seen.open(cell, self.scratch);
                self.take(cell, around);
            }
        }
    }
}

impl InCells<'_> {
    /// Adds the movers of a list that are within `around`, and in one of the spaces of the scratch, if there are several.
    #[cfg_attr(feature = "simd", inline(always))]
    fn take(&mut self, list: CellId, around: HalfSpaces) {
        let Self { movers, scratch, out, .. } = self;
        for (start, owners) in movers.lists.blocks(list.index()) {
            let mut wanted = around.meet(&movers.lists.boxes, start) & (u32::MAX >> (32 - owners.len()));
            if scratch.spaces.len() > 1 && wanted != 0 {
                let meet = |seen: u32, space: &HalfSpaces| {
                    let is_all = wanted & !seen == 0;
                    if is_all { seen } else { seen | space.meet(&movers.lists.boxes, start) }
                };
                wanted &= scratch.spaces.iter().fold(0, meet);
            }
            for i in ones(&[u64::from(wanted)]) {
                out.take(movers, owners[i].slot);
            }
        }
    }
}
