//! Things that move: characters, props, shots, by their boxes.
//!
//! Each is in the cells that its box meets. A view's movers ([`View::movers`](super::View::movers)) are those in reached cells whose box
//! meets what a portal into the cell opens; with rows alone, those in cells of the row; with an oracle, it decides the rest. A point of a
//! mover that an eye sees is in a reached cell, on the part of the screen that a portal opens, and beyond that portal. So is a part of its
//! box, and the mover is in the set.
//!
//! A mover that meets no cell, or more than eight, such as a sky, is seen wherever it is in the frustum.

mod collect;
mod lists;
mod locate;

pub(super) use collect::{Collected, How};

use super::boxes::{Boxes, rounded};
use super::culler::Culler;
use crate::CellId;
use glam::Vec3;
use lists::{BoxLists, Owner};
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
            // Without the numbers: the code that writes them is as much as all movers.
            Self::NotABox(_) => write!(f, "not a box: a corner is NaN, or the first is above the second"),
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
    /// By slot: the number of movers that had it before.
    lives: Vec<u32>,
    free: Vec<u32>,
    /// Slots in use, as bits.
    used: Vec<u64>,
    /// By slot.
    boxes: Boxes,
    /// By cell: the movers in it, each by the part of its box in the box around the cell. The last list is of movers that are anywhere.
    lists: BoxLists,
}

/// A mover, or the place of one.
#[derive(Clone, Copy, Debug)]
struct Slot {
    /// The piece that held the whole box, or a part of it, when it was last looked for.
    piece: u32,
    count: u32,
    /// Its cells, or [`Movers::anywhere`].
    cells: [CellId; MOST_CELLS],
    /// Its place in the list of each.
    places: [u32; MOST_CELLS],
}

impl Slot {
    const FREE: Self = Self { piece: u32::MAX, count: 0, cells: [CellId(0); MOST_CELLS], places: [NONE; MOST_CELLS] };

    fn cells(&self) -> &[CellId] {
        &self.cells[..self.count as usize]
    }
}

impl Movers {
    /// None yet.
    pub fn new(culler: &Arc<Culler>) -> Self {
        Self {
            culler: culler.clone(),
            slots: Vec::new(),
            lives: Vec::new(),
            free: Vec::new(),
            used: Vec::new(),
            boxes: Boxes::default(),
            lists: BoxLists::new(culler.cell_count() + 1),
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
            self.slots.push(Slot::FREE);
            self.lives.push(0);
            self.used.resize(slot / 64 + 1, 0);
            self.boxes.resize(slot + 1);
            self.lists.reserve((slot + 1) * MOST_CELLS);
            // Each slot may be free one day.
            self.free.reserve(slot + 1);
            slot as u32
        });
        self.used[slot as usize / 64] |= 1 << (slot % 64);
        self.place(slot, bounds);
        Ok(self.id(slot))
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
        self.slots[id.slot as usize].piece = u32::MAX;
        let life = &mut self.lives[id.slot as usize];
        *life = life.wrapping_add(1);
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
        let cells = self.slot(id)?.cells();
        Ok(if cells == [self.anywhere()] { &[] } else { cells })
    }

    /// Number of slots: above those of all movers.
    pub fn slots(&self) -> usize {
        self.slots.len()
    }

    fn slot(&self, id: MoverId) -> Result<&Slot, MoverError> {
        let slot = id.slot as usize;
        let is_there = self.lives.get(slot) == Some(&id.life) && self.used[slot / 64] >> (slot % 64) & 1 != 0;
        if is_there { Ok(&self.slots[slot]) } else { Err(MoverError::Removed(id)) }
    }

    #[inline]
    fn id(&self, slot: u32) -> MoverId {
        MoverId { slot, life: self.lives[slot as usize] }
    }

    /// The list of movers that are anywhere.
    fn anywhere(&self) -> CellId {
        CellId(self.lists.len() as u32 - 1)
    }

    /// Puts a box into its cells' lists.
    fn place(&mut self, slot: u32, bounds: [Vec3; 2]) {
        self.boxes.set(slot as usize, bounds);
        let now = &self.slots[slot as usize];
        let mut found = locate::Found::new(&self.culler, bounds, now.piece);
        if found.is_anywhere() {
            found.set_only(self.anywhere());
        }
        let stays = found.cells() == now.cells();
        if !stays {
            self.unlink(slot);
        }
        let Self { culler, slots, lists, .. } = self;
        let now = &mut slots[slot as usize];
        for (k, &cell) in found.cells().iter().enumerate() {
            let around = culler.cell_boxes.get(cell.index()).copied().flatten();
            let part = rounded(super::culler::part(bounds, around));
            if stays {
                lists.boxes.put(now.places[k] as usize, part);
            } else {
                now.cells[k] = cell;
                now.places[k] = lists.add(cell.index(), Owner { slot, number: k as u32 }, part);
            }
        }
        (now.piece, now.count) = (found.piece, found.cells().len() as u32);
    }

    fn unlink(&mut self, slot: u32) {
        let Slot { cells, places, count, .. } = self.slots[slot as usize];
        for k in 0..count as usize {
            if let Some(Owner { slot, number }) = self.lists.remove(cells[k].index(), places[k]) {
                self.slots[slot as usize].places[number as usize] = places[k];
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
