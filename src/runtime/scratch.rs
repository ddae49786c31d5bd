//! What one camera needs from frame to frame: marks, queues and results, all at their final size from the start.

use super::boxes::HalfSpaces;
use super::culler::Culler;
use super::frustum::Rect;
use super::locate::MOST_HOMES;
use crate::{CellId, DirectedPortal, ObjectId};
use std::ops::{Add, AddAssign};

/// What a frame cost and kept.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FrameStats {
    /// Cells reached (portals, both) or in the row (pvs); 0 where no cell was asked.
    pub cells: u64,
    /// Directed portals seen through.
    pub portals: u64,
    /// Objects in the set.
    pub objects: u64,
    /// Their triangles.
    pub triangles: u64,
    /// Objects left out because they are too small ([`Culler::set_min_pixels`]).
    pub small: u64,
    /// Questions to an occlusion oracle.
    pub queries: u64,
    /// Times that a bound on work was met and more was kept instead.
    pub capped: u64,
}

impl Add for FrameStats {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            cells: self.cells + other.cells,
            portals: self.portals + other.portals,
            objects: self.objects + other.objects,
            triangles: self.triangles + other.triangles,
            small: self.small + other.small,
            queries: self.queries + other.queries,
            capped: self.capped + other.capped,
        }
    }
}

impl AddAssign for FrameStats {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// A portal that the frame saw through.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CrossedPortal {
    /// Which way.
    pub portal: DirectedPortal,
    /// The part of the screen that it opens: covers every pixel that shows something beyond it.
    pub rect: Rect,
}

/// The answer, kept in the [`Scratch`] until the next frame.
#[derive(Clone, Copy, Debug)]
pub struct VisibleSet<'s> {
    /// What to draw: each object once; those of the eye's cell come first in the modes that go through portals.
    pub objects: &'s [ObjectId],
    /// The cells reached (portals, both), the eye's own first.
    pub cells: &'s [CellId],
    /// The portals seen through, nearest (in portals) first.
    pub portals: &'s [CrossedPortal],
    /// The eye's cell; `None` where it is in none, or where the mode doesn't ask.
    pub home: Option<CellId>,
    /// Counters.
    pub stats: FrameStats,
}

/// A cell's part of a list that is filled cell by cell as a frame gets to them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Part {
    /// The frame that the rest is of.
    pub frame: u32,
    /// Where it starts.
    pub start: u32,
    /// And ends, exclusively.
    pub end: u32,
}

/// A directed portal in the current frame; set when its cell is first looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct PortalState {
    /// Its own outline: the most that it can open. Empty where it can't be seen through.
    pub own: Rect,
    /// What it opens as far as is known.
    pub open: Rect,
    /// Times taken from the queue.
    pub visits: u32,
    /// Waiting in the queue.
    pub queued: bool,
    /// Something stands in it: what is in the doorway is seen, and nothing beyond.
    pub shut: bool,
}

impl PortalState {
    pub const UNSEEN: Self = Self { own: Rect::EMPTY, open: Rect::EMPTY, visits: 0, queued: false, shut: false };
}

/// The portals that a frame crossed into a cell, as a list linked by [`Scratch::next_in`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WaysIn {
    /// The frame that the rest is of.
    pub frame: u32,
    /// Indices into [`Scratch::crossed`].
    pub first: u32,
    pub last: u32,
}

/// A first-in-first-out queue of directed portals, each at most once, in a ring that never grows.
#[derive(Clone, Debug, Default)]
pub(super) struct Queue {
    ring: Vec<DirectedPortal>,
    head: usize,
    len: usize,
}

impl Queue {
    pub fn push(&mut self, portal: DirectedPortal) {
        let at = (self.head + self.len) % self.ring.len();
        self.ring[at] = portal;
        self.len += 1;
    }

    pub fn pop(&mut self) -> Option<DirectedPortal> {
        self.len = self.len.checked_sub(1)?;
        let portal = self.ring[self.head];
        self.head = (self.head + 1) % self.ring.len();
        Some(portal)
    }
}

/// Everything that changes from frame to frame; one for each camera.
#[derive(Clone, Debug)]
pub struct Scratch {
    /// Counts frames; a mark is set where it equals this.
    pub(super) frame: u32,
    /// By object: the last frame that took it.
    pub(super) taken: Vec<u32>,
    pub(super) cell_marks: Vec<u32>,
    /// By cell: its part of `ways`.
    pub(super) cell_ways: Vec<Part>,
    /// Portals that the eye might see through.
    pub(super) ways: Vec<DirectedPortal>,
    /// Cells that a crossed portal leads into, and by cell which do.
    pub(super) reached: Vec<CellId>,
    pub(super) ways_in: Vec<WaysIn>,
    /// By crossed portal: the next into the same cell; none there is at the last.
    pub(super) next_in: Vec<u32>,
    /// What each portal shows of one cell.
    pub(super) spaces: Vec<HalfSpaces>,
    pub(super) portal_states: Vec<PortalState>,
    pub(super) queue: Queue,
    /// The rows of the eye's cells, joined.
    pub(super) object_row: Vec<u64>,
    pub(super) cell_row: Vec<u64>,
    /// Where the eye was in the last frame.
    pub(super) last_piece: u32,
    pub(super) objects: Vec<ObjectId>,
    pub(super) cells: Vec<CellId>,
    /// The cells that the eye is in; none where it is in none, or where the mode doesn't ask.
    pub(super) homes: Vec<CellId>,
    /// Cells and how many portals lead to them.
    pub(super) hops: Vec<(CellId, u32)>,
    pub(super) crossed: Vec<CrossedPortal>,
    pub(super) stats: FrameStats,
}

impl Scratch {
    /// Takes all the memory that frames of this culler need.
    pub fn for_culler(culler: &Culler) -> Self {
        let (objects, cells, portals) = (culler.object_count(), culler.cell_count(), culler.portal_count() * 2);
        Self {
            frame: 0,
            taken: vec![0; objects],
            cell_marks: vec![0; cells],
            cell_ways: vec![Part::default(); cells],
            ways: Vec::with_capacity(portals),
            reached: Vec::with_capacity(cells),
            ways_in: vec![WaysIn::default(); cells],
            next_in: Vec::with_capacity(portals),
            spaces: Vec::with_capacity((0..cells).map(|c| culler.cell_portals.get(c).len()).max().unwrap_or(0).max(1)),
            portal_states: vec![PortalState::UNSEEN; portals],
            queue: Queue { ring: vec![DirectedPortal(0); portals], head: 0, len: 0 },
            object_row: vec![0; objects.div_ceil(64)],
            cell_row: vec![0; cells.div_ceil(64)],
            last_piece: 0,
            objects: Vec::with_capacity(objects),
            cells: Vec::with_capacity(cells),
            homes: Vec::with_capacity(MOST_HOMES),
            hops: Vec::with_capacity(cells),
            crossed: Vec::with_capacity(portals),
            stats: FrameStats::default(),
        }
    }

    /// Starts a frame. A scratch that was made for another culler is made anew.
    pub(super) fn begin(&mut self, culler: &Culler) {
        let fits = self.taken.len() == culler.object_count()
            && self.cell_marks.len() == culler.cell_count()
            && self.portal_states.len() == culler.portal_count() * 2;
        if !fits {
            *self = Self::for_culler(culler);
        }
        if self.frame == u32::MAX {
            self.frame = 0;
            self.taken.fill(0);
            self.cell_marks.fill(0);
            self.cell_ways.fill(Part::default());
            self.ways_in.fill(WaysIn::default());
        }
        self.frame += 1;
        self.objects.clear();
        self.cells.clear();
        self.homes.clear();
        self.crossed.clear();
        self.ways.clear();
        self.stats = FrameStats::default();
    }

    /// Marks a cell as reached, once a frame.
    pub(super) fn reach(&mut self, cell: CellId) {
        let mark = &mut self.cell_marks[cell.index()];
        if *mark != self.frame {
            *mark = self.frame;
            self.cells.push(cell);
        }
    }

    /// Ends a frame.
    pub(super) fn finish(&mut self, culler: &Culler, home: Option<CellId>) -> VisibleSet<'_> {
        self.stats.objects = self.objects.len() as u64;
        self.stats.triangles = self.objects.iter().map(|&o| u64::from(culler.triangles(o))).sum();
        VisibleSet { objects: &self.objects, cells: &self.cells, portals: &self.crossed, home, stats: self.stats }
    }
}
