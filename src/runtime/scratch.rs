//! The memory of one camera: marks, queues and results, all allocated at their final size.

use super::boxes::HalfSpaces;
use super::camera::Rect;
use super::culler::Culler;
use super::doors::Doors;
use super::locate::MOST_HOMES;
use super::small::MinPixels;
use super::visible::{CrossedPortal, FrameStats};
use crate::{CellId, DirectedPortal, ObjectId};

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
    /// Whether it leads into another module of a world.
    pub joined: bool,
}

impl PortalState {
    pub const UNSEEN: Self =
        Self { own: Rect::EMPTY, open: Rect::EMPTY, visits: 0, queued: false, shut: false, joined: false };

    /// Whether the view goes on in the cell behind.
    pub fn goes_on(&self) -> bool {
        !self.shut && !self.joined
    }
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
    /// For so many directed portals.
    pub fn of(portals: usize) -> Self {
        Self { ring: vec![DirectedPortal(0); portals], head: 0, len: 0 }
    }

    #[inline]
    pub fn push(&mut self, portal: DirectedPortal) {
        let at = (self.head + self.len) % self.ring.len();
        self.ring[at] = portal;
        self.len += 1;
    }

    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub fn clear(&mut self) {
        self.len = 0;
    }

    #[inline]
    pub fn pop(&mut self) -> Option<DirectedPortal> {
        self.len = self.len.checked_sub(1)?;
        let portal = self.ring[self.head];
        self.head = (self.head + 1) % self.ring.len();
        Some(portal)
    }
}

/// All state of frames.
#[derive(Clone, Debug)]
pub(super) struct Scratch {
    pub doors: Doors,
    /// Directed portals that lead into another module of a world, as bits; empty: none.
    pub joined: Vec<u64>,
    pub min_pixels: MinPixels,
    /// Frame counter; a mark is set if it equals this.
    pub frame: u32,
    /// By object: the last frame that took it.
    pub taken: Vec<u32>,
    pub cell_marks: Vec<u32>,
    /// By cell: its part of `ways`.
    pub cell_ways: Vec<Part>,
    /// Portals that the eye might see through.
    pub ways: Vec<DirectedPortal>,
    /// Target cells of crossed portals, and the portals by cell.
    pub reached: Vec<CellId>,
    pub ways_in: Vec<WaysIn>,
    /// By crossed portal: the next one into the same cell; invalid at the last.
    pub next_in: Vec<u32>,
    /// The half-spaces of each portal into one cell.
    pub spaces: Vec<HalfSpaces>,
    pub portal_states: Vec<PortalState>,
    pub queue: Queue,
    /// The rows of the eye's cells, joined.
    pub object_row: Vec<u64>,
    pub cell_row: Vec<u64>,
    /// The eye's piece in the last frame.
    pub last_piece: u32,
    pub objects: Vec<ObjectId>,
    pub cells: Vec<CellId>,
    /// The eye's cells; empty if there are none, or if the mode does not use cells.
    pub homes: Vec<CellId>,
    /// Cells and the number of portals to them.
    pub hops: Vec<(CellId, u32)>,
    pub crossed: Vec<CrossedPortal>,
    pub stats: FrameStats,
}

impl Scratch {
    /// Allocates all memory for frames of this culler.
    pub fn for_culler(culler: &Culler) -> Self {
        let (objects, cells, portals) = (culler.object_count(), culler.cell_count(), culler.portal_count() * 2);
        Self {
            doors: Doors::open(culler),
            joined: Vec::new(),
            min_pixels: MinPixels::default(),
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
            queue: Queue::of(portals),
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

    /// Starts a frame.
    #[inline]
    pub fn begin(&mut self) {
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

    /// Whether a directed portal leads into another module.
    #[inline]
    pub fn is_joined(&self, portal: DirectedPortal) -> bool {
        self.joined.get(portal.0 as usize / 64).is_some_and(|word| word >> (portal.0 % 64) & 1 != 0)
    }

    /// Opens a portal on one more part of the screen, and queues it if the view goes on behind it.
    #[inline]
    pub fn open(&mut self, portal: DirectedPortal, opened: Rect) {
        let state = &mut self.portal_states[portal.0 as usize];
        if state.open.is_empty() {
            self.crossed.push(CrossedPortal { portal, rect: opened });
        }
        state.open = state.open.union(opened);
        if !state.queued && state.goes_on() {
            state.queued = true;
            self.queue.push(portal);
        }
    }

    /// Marks a cell as reached, once per frame.
    #[inline]
    pub fn reach(&mut self, cell: CellId) {
        let mark = &mut self.cell_marks[cell.index()];
        if *mark != self.frame {
            *mark = self.frame;
            self.cells.push(cell);
        }
    }

    /// Ends a frame.
    pub fn finish(&mut self, culler: &Culler) {
        self.stats.objects = self.objects.len() as u64;
        self.stats.triangles = self.objects.iter().map(|&o| u64::from(culler.triangles(o))).sum();
    }
}
