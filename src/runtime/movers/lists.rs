//! Boxes in lists, in blocks: a list is a chain of blocks of [`LANES`] boxes, of which only the first has room. So all boxes of a list are tested
//! against planes together, and adding and removing touch one block.

use super::super::boxes::{Boxes, LANES};
use super::NONE;
use glam::Vec3;

/// Whose a box in a list is: the mover's slot, and the number of the list among those of the mover.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Owner {
    pub slot: u32,
    pub number: u32,
}

/// Lists of boxes. A box's place is `LANES` times the number of its block, plus its lane.
#[derive(Clone, Debug)]
pub(super) struct BoxLists {
    /// By list: its first block.
    heads: Vec<u32>,
    blocks: Vec<Block>,
    /// Blocks in no list.
    free: Vec<u32>,
    /// By place.
    pub boxes: Boxes,
    owners: Vec<Owner>,
}

#[derive(Clone, Copy, Debug)]
struct Block {
    next: u32,
    /// Boxes in it.
    count: u32,
}

impl BoxLists {
    /// So many empty lists.
    pub fn new(lists: usize) -> Self {
        let boxes = Boxes::default();
        Self { heads: vec![NONE; lists], blocks: Vec::new(), free: Vec::new(), boxes, owners: Vec::new() }
    }

    /// Number of lists.
    pub fn len(&self) -> usize {
        self.heads.len()
    }

    /// Makes room for so many boxes in all, wherever they are: a block for each list that isn't empty has room left.
    pub fn reserve(&mut self, boxes: usize) {
        let blocks = boxes.min(boxes / LANES + self.heads.len());
        let known = self.blocks.len();
        if blocks > known {
            self.blocks.resize(blocks, Block { next: NONE, count: 0 });
            self.boxes.resize(blocks * LANES);
            self.owners.resize(blocks * LANES, Owner::default());
            self.free.reserve(blocks - self.free.len());
            self.free.extend((known as u32..blocks as u32).rev());
        }
    }

    /// Whether a list is empty.
    #[inline]
    pub fn is_empty(&self, list: usize) -> bool {
        self.heads[list] == NONE
    }

    /// The blocks of a list: their first place, and the owners of their boxes.
    #[inline]
    pub fn blocks(&self, list: usize) -> impl Iterator<Item = (usize, &[Owner])> {
        let mut next = self.heads[list];
        std::iter::from_fn(move || {
            let block = self.blocks.get(next as usize)?;
            let start = next as usize * LANES;
            next = block.next;
            Some((start, &self.owners[start..start + block.count as usize]))
        })
    }

    /// Adds a box, given by centre and half size, and gives its place.
    pub fn add(&mut self, list: usize, owner: Owner, part: [Vec3; 2]) -> u32 {
        let head = self.heads[list];
        if self.blocks.get(head as usize).is_none_or(|block| block.count as usize == LANES) {
            let first = self.free.pop().expect("room for as many");
            self.blocks[first as usize] = Block { next: head, count: 0 };
            self.heads[list] = first;
        }
        let block = self.heads[list];
        let place = block * LANES as u32 + self.blocks[block as usize].count;
        self.blocks[block as usize].count += 1;
        self.owners[place as usize] = owner;
        self.boxes.put(place as usize, part);
        place
    }

    /// Removes a box. Gives the owner of the box that takes its place, if one does.
    pub fn remove(&mut self, list: usize, place: u32) -> Option<Owner> {
        let head = self.heads[list];
        let block = &mut self.blocks[head as usize];
        block.count -= 1;
        let last = head as usize * LANES + block.count as usize;
        if block.count == 0 {
            self.heads[list] = block.next;
            self.free.push(head);
        }
        (last != place as usize).then(|| {
            let (centre, half) = self.boxes.get(last);
            self.boxes.put(place as usize, [centre, half]);
            self.owners[place as usize] = self.owners[last];
            self.owners[last]
        })
    }
}
