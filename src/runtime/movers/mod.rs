//! Things that move: characters, props, shots, by their boxes.
//!
//! Each is in the cells that its box meets. A view's movers ([`View::movers`](super::View::movers)) are those in reached cells whose box
//! meets what a portal into the cell opens; with rows alone, those in cells of the row; with an oracle, it decides the rest. A point of a
//! mover that an eye sees is in a reached cell, on the part of the screen that a portal opens, and beyond that portal. So is a part of its
//! box, and the mover is in the set.
//!
//! A mover that meets no cell, or more than eight, such as a sky, is seen wherever it is in the frustum.

mod collect;
mod locate;

pub(super) use collect::{Collected, How};

use super::boxes::{Boxes, rounded};
use super::culler::Culler;
use crate::CellId;
use glam::Vec3;
use std::fmt;
use std::sync::Arc;

/// Most cells that a mover is in; with more, it is taken to be anywhere. Larger: memory for each mover. Smaller: movers in a nook of many
/// small cells are seen through walls.
const MOST_CELLS: usize = 8;

/// No entry.
const NONE: u32 = u32::MAX;

/// A mover. Its slot is a small number for lists of the client's; a later mover may get the slot, and never the id.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[repr(C)]
#[cfg_attr(feature = "bytemuck", derive(bytemuck::Pod, bytemuck::Zeroable))]
pub struct MoverId {
    /// Its index; slots are used again.
    pub slot: u32,
    /// Number of movers that had the slot before.
    pub life: u32,
}

impl fmt::Display for MoverId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.slot, self.life)
    }
}

/// An error of [`Movers`]; nothing is changed then.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum MoverError {
    /// The box has a corner that is NaN, or the first corner is above the second.
    NotABox([Vec3; 2]),
    /// The mover was removed, or never was.
    Removed(MoverId),
}

impl fmt::Display for MoverError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotABox([min, max]) => write!(f, "not a box: from {min} to {max}"),
            Self::Removed(id) => write!(f, "mover {id} is removed"),
        }
    }
}

impl std::error::Error for MoverError {}

/// The movers of a world, for any number of views. Moving and removing allocates nothing; inserting does where there were never as many.
#[derive(Clone, Debug)]
pub struct Movers {
    culler: Arc<Culler>,
    slots: Vec<Slot>,
    free: Vec<u32>,
    /// Slots in use, as bits.
    used: Vec<u64>,
    /// By slot.
    boxes: Boxes,
    /// [`MOST_CELLS`] for each slot, one for each of its cells.
    entries: Vec<Entry>,
    /// By cell: its first entry. The last list is of movers that are anywhere.
    heads: Vec<u32>,
}

/// A mover, or the place of one.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    life: u32,
    is_used: bool,
    /// The piece that held the whole box, or a part of it, when it was last looked for.
    piece: u32,
    /// Its lists: cells, or that of movers that are anywhere.
    lists: [CellId; MOST_CELLS],
    count: usize,
}

impl Slot {
    fn lists(&self) -> &[CellId] {
        &self.lists[..self.count]
    }
}

/// A mover in a cell: an item of the cell's list.
#[derive(Clone, Copy, Debug)]
struct Entry {
    next: u32,
    before: u32,
    /// Centre and half size of the box's part in the box around the cell.
    part: [Vec3; 2],
}

impl Movers {
    /// None yet.
    pub fn new(culler: &Arc<Culler>) -> Self {
        Self {
            culler: culler.clone(),
            slots: Vec::new(),
            free: Vec::new(),
            used: Vec::new(),
            boxes: Boxes::default(),
            entries: Vec::new(),
            heads: vec![NONE; culler.cell_count() + 1],
        }
    }

    /// Adds a mover with a box: its least and its greatest corner, metres, relative to the file's origin. Infinite ones will do.
    ///
    /// # Errors
    ///
    /// [`MoverError::NotABox`].
    pub fn insert(&mut self, bounds: [Vec3; 2]) -> Result<MoverId, MoverError> {
        check(bounds)?;
        let slot = self.free.pop().unwrap_or_else(|| {
            let slot = self.slots.len();
            self.slots.push(Slot::default());
            self.used.resize(slot / 64 + 1, 0);
            self.boxes.resize(slot + 1);
            self.entries.resize((slot + 1) * MOST_CELLS, Entry { next: NONE, before: NONE, part: [Vec3::ZERO; 2] });
            // Each slot may be free one day.
            self.free.reserve(slot + 1);
            slot as u32
        });
        self.used[slot as usize / 64] |= 1 << (slot % 64);
        let place = &mut self.slots[slot as usize];
        (place.is_used, place.piece, place.count) = (true, u32::MAX, 0);
        self.place(slot, bounds);
        Ok(MoverId { slot, life: self.slots[slot as usize].life })
    }

    /// Moves a mover. One that stays within its piece of a cell is not looked for.
    ///
    /// # Errors
    ///
    /// [`MoverError`].
    pub fn set(&mut self, id: MoverId, bounds: [Vec3; 2]) -> Result<(), MoverError> {
        self.slot(id)?;
        check(bounds)?;
        self.place(id.slot, bounds);
        Ok(())
    }

    /// Removes a mover.
    ///
    /// # Errors
    ///
    /// [`MoverError::Removed`].
    pub fn remove(&mut self, id: MoverId) -> Result<(), MoverError> {
        self.slot(id)?;
        self.unlink(id.slot);
        self.used[id.slot as usize / 64] &= !(1 << (id.slot % 64));
        let slot = &mut self.slots[id.slot as usize];
        (slot.is_used, slot.life) = (false, slot.life.wrapping_add(1));
        self.free.push(id.slot);
        Ok(())
    }

    /// The cells that a mover's box meets, for a server that sends what is there: empty if it is in none, or in more than eight, so that it
    /// may be seen from anywhere.
    ///
    /// # Errors
    ///
    /// [`MoverError::Removed`].
    pub fn cells(&self, id: MoverId) -> Result<&[CellId], MoverError> {
        let lists = self.slot(id)?.lists();
        Ok(if lists == [self.anywhere()] { &[] } else { lists })
    }

    /// Number of slots: above those of all movers.
    pub fn slots(&self) -> usize {
        self.slots.len()
    }

    fn slot(&self, id: MoverId) -> Result<&Slot, MoverError> {
        let slot = self.slots.get(id.slot as usize).filter(|slot| slot.is_used && slot.life == id.life);
        slot.ok_or(MoverError::Removed(id))
    }

    fn id(&self, slot: u32) -> MoverId {
        MoverId { slot, life: self.slots[slot as usize].life }
    }

    /// The list of movers that are anywhere.
    fn anywhere(&self) -> CellId {
        CellId(self.heads.len() as u32 - 1)
    }

    /// Puts a box into its cells' lists.
    fn place(&mut self, slot: u32, bounds: [Vec3; 2]) {
        self.boxes.set(slot as usize, bounds);
        let now = &self.slots[slot as usize];
        let mut found = locate::Found::new(&self.culler, bounds, now.piece);
        if found.is_anywhere() {
            found.set_only(self.anywhere());
        }
        if found.cells() != now.lists() {
            self.unlink(slot);
            self.link(slot, found.cells());
        }
        self.slots[slot as usize].piece = found.piece;
        for (k, &cell) in found.cells().iter().enumerate() {
            let around = self.culler.cell_boxes.get(cell.index()).copied().flatten();
            self.entries[slot as usize * MOST_CELLS + k].part = rounded(super::culler::part(bounds, around));
        }
    }

    fn link(&mut self, slot: u32, cells: &[CellId]) {
        for (k, &cell) in cells.iter().enumerate() {
            let entry = slot * MOST_CELLS as u32 + k as u32;
            let head = &mut self.heads[cell.index()];
            let next = std::mem::replace(head, entry);
            (self.entries[entry as usize].next, self.entries[entry as usize].before) = (next, NONE);
            if next != NONE {
                self.entries[next as usize].before = entry;
            }
        }
        let place = &mut self.slots[slot as usize];
        place.lists[..cells.len()].copy_from_slice(cells);
        place.count = cells.len();
    }

    fn unlink(&mut self, slot: u32) {
        let place = self.slots[slot as usize];
        for (k, cell) in place.lists().iter().enumerate() {
            let Entry { next, before, .. } = self.entries[slot as usize * MOST_CELLS + k];
            match before {
                NONE => self.heads[cell.index()] = next,
                before => self.entries[before as usize].next = next,
            }
            if next != NONE {
                self.entries[next as usize].before = before;
            }
        }
        self.slots[slot as usize].count = 0;
    }
}

fn check(bounds: [Vec3; 2]) -> Result<(), MoverError> {
    // False for NaN.
    let is_a_box = bounds[0].cmple(bounds[1]).all();
    if is_a_box { Ok(()) } else { Err(MoverError::NotABox(bounds)) }
}
