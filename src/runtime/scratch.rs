//! The memory of one camera: marks, queues and results, all allocated at their final size.

use super::boxes::HalfSpaces;
use super::culler::Culler;
use super::frustum::Rect;
use super::locate::MOST_HOMES;
use crate::{CellId, DirectedPortal, ObjectId};
use std::ops::{Add, AddAssign};

/// Counters of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FrameStats {
    /// Cells reached (portals, both) or in the row (pvs); 0 in other modes.
    pub cells: u64,
    /// Directed portals crossed.
    pub portals: u64,
    /// Objects in the set.
    pub objects: u64,
    /// Their triangles.
    pub triangles: u64,
    /// Small objects left out ([`Culler::set_min_pixels`]).
    pub small: u64,
    /// Occlusion queries.
    pub queries: u64,
    /// Times that a limit on work was reached, so that more was kept.
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

/// A portal crossed in the frame.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CrossedPortal {
    /// The directed portal.
    pub portal: DirectedPortal,
    /// Its rectangle on the screen: covers every pixel that shows something beyond it.
    pub rect: Rect,
}

/// The result of a frame, kept in the [`Scratch`] until the next one.
#[derive(Clone, Copy, Debug)]
pub struct VisibleSet<'s> {
    /// The objects to draw, each once; in modes with portals, those of the eye's cell come first.
    pub objects: &'s [ObjectId],
    /// The cells reached (portals, both), the eye's own first.
    pub cells: &'s [CellId],
    /// The crossed portals, nearest (in portals) first.
    pub portals: &'s [CrossedPortal],
    /// The eye's cell; `None` if it is in none, or if the mode does not use cells.
    pub home: Option<CellId>,
    /// Counters.
    pub stats: FrameStats,
}

/// A cell's part of a list that is filled cell by cell during a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Part {
    /// The frame for which the other fields are valid.
    pub frame: u32,
    /// Start.
    pub start: u32,
    /// End, exclusive.
    pub end: u32,
}

/// State of a directed portal in the current frame; set at the first visit of its cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct PortalState {
    /// Its own outline: the largest rectangle that it can open. Empty if nothing is visible through it.
    pub own: Rect,
    /// The rectangle that it opens so far.
    pub open: Rect,
    /// Number of visits.
    pub visits: u32,
    /// Whether it is in the queue.
    pub queued: bool,
    /// Whether it is shut: objects in the doorway are visible, and nothing beyond.
    pub shut: bool,
}

impl PortalState {
    pub const UNSEEN: Self = Self { own: Rect::EMPTY, open: Rect::EMPTY, visits: 0, queued: false, shut: false };
}

/// The crossed portals into a cell, as a list linked by [`Scratch::next_in`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WaysIn {
    /// The frame for which the other fields are valid.
    pub frame: u32,
    /// Indices into [`Scratch::crossed`].
    pub first: u32,
    pub last: u32,
}

/// A first-in-first-out queue of directed portals, each at most once, in a ring of fixed size.
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

/// All state of frames; one per camera.
#[derive(Clone, Debug)]
pub struct Scratch {
    /// Frame counter; a mark is set if it equals this.
    pub(super) frame: u32,
    /// By object: the last frame that took it.
    pub(super) taken: Vec<u32>,
    pub(super) cell_marks: Vec<u32>,
    /// By cell: its part of `ways`.
    pub(super) cell_ways: Vec<Part>,
    /// Portals that the eye might see through.
    pub(super) ways: Vec<DirectedPortal>,
    /// Target cells of crossed portals, and the portals by cell.
    pub(super) reached: Vec<CellId>,
    pub(super) ways_in: Vec<WaysIn>,
    /// By crossed portal: the next one into the same cell; invalid at the last.
    pub(super) next_in: Vec<u32>,
    /// The half-spaces of each portal into one cell.
    pub(super) spaces: Vec<HalfSpaces>,
    pub(super) portal_states: Vec<PortalState>,
    pub(super) queue: Queue,
    /// The rows of the eye's cells, joined.
    pub(super) object_row: Vec<u64>,
    pub(super) cell_row: Vec<u64>,
    /// The eye's piece in the last frame.
    pub(super) last_piece: u32,
    pub(super) objects: Vec<ObjectId>,
    pub(super) cells: Vec<CellId>,
    /// The eye's cells; empty if there are none, or if the mode does not use cells.
    pub(super) homes: Vec<CellId>,
    /// Cells and the number of portals to them.
    pub(super) hops: Vec<(CellId, u32)>,
    pub(super) crossed: Vec<CrossedPortal>,
    pub(super) stats: FrameStats,
}

impl Scratch {
    /// Allocates all memory for frames of this culler.
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

    /// Starts a frame. A scratch of another culler is reallocated.
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

    /// Marks a cell as reached, once per frame.
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
