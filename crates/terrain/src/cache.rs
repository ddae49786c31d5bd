//! Tiles in memory: a limited number, with the oldest and deepest evicted first.
//!
//! Based on: the thesis' queue, which ranks a tile by the frame that last used it, weighted by its depth. The rank is computed
//! when a tile is loaded, and again only when it would be evicted. Deviation: a tile stays while its children are there, so that
//! a coarser one can always be drawn instead.

use super::format::{Header, Width};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// No tile or no slot.
const NONE: u32 = u32::MAX;
/// Frames for which a tile stays after its last use: the device may still draw it, and it is likely to return.
const IN_USE: u32 = 60;
/// Frames by which a tile ages faster than one of the next coarser level.
const OLDER_BY_LEVEL: u64 = 30;
/// Tiles tested for one that may be evicted.
const TRIES: usize = 64;

/// Tiles in memory, each in its own slot.
#[derive(Debug)]
pub(super) struct Cache {
    /// Heights by slot, row after row: two per word, or one of four bytes.
    words: Vec<u32>,
    words_a_tile: usize,
    /// By tile.
    slots: Vec<u32>,
    /// By tile, the number of its children in memory.
    quarters: Vec<u8>,
    /// By slot.
    tiles: Vec<u32>,
    used: Vec<u32>,
    free: Vec<u32>,
    queue: BinaryHeap<Reverse<(u64, u32)>>,
}

impl Cache {
    /// As many slots as fit into `bytes`, at least two, at most one per tile.
    pub fn new(header: &Header, bytes: u64) -> Self {
        let words_a_tile = header.slot_words();
        let tiles = header.grid.tiles();
        let count = (bytes / (4 * words_a_tile as u64)).clamp(2, u64::from(tiles).max(2)) as usize;
        Self {
            words: vec![0; count * words_a_tile],
            words_a_tile,
            slots: vec![NONE; tiles as usize],
            quarters: vec![0; tiles as usize],
            tiles: vec![NONE; count],
            used: vec![0; count],
            free: (0..count as u32).rev().collect(),
            queue: BinaryHeap::with_capacity(count + TRIES),
        }
    }

    pub fn slot(&self, tile: u32) -> Option<u32> {
        Some(self.slots[tile as usize]).filter(|&slot| slot != NONE)
    }

    pub fn has(&self, tile: u32) -> bool {
        self.slots[tile as usize] != NONE
    }

    pub fn slots(&self) -> usize {
        self.tiles.len()
    }

    /// Bytes of all slots.
    pub fn bytes(&self) -> u64 {
        4 * self.words.len() as u64
    }

    pub fn words(&self, slot: u32) -> &[u32] {
        let at = slot as usize * self.words_a_tile;
        &self.words[at..at + self.words_a_tile]
    }

    /// The stored number of a slot's sample.
    pub fn number(&self, header: &Header, slot: u32, [i, j]: [u32; 2]) -> u32 {
        let at = (j * header.grid.side() + i) as usize;
        let words = self.words(slot);
        match header.width {
            Width::Two => words[at / 2] >> (16 * (at % 2)) & 0xffff,
            Width::Four => words[at],
        }
    }

    /// Fills a slot: the tile's own samples, and those of its parent.
    pub fn fill(&mut self, header: &Header, tile: u32, slot: u32, bytes: &[u8]) {
        let first = slot as usize * self.words_a_tile;
        self.words[first..first + self.words_a_tile].fill(0);
        let width = header.width.bytes();
        for (sample, bytes) in header.own_samples(tile).zip(bytes.chunks_exact(width)) {
            let mut number = [0; 4];
            number[..width].copy_from_slice(bytes);
            self.put(header, first, sample, u32::from_le_bytes(number));
        }
        let Some(parent) = header.parent(tile).and_then(|parent| self.slot(parent)) else { return };
        for [here, there] in header.parents_samples(tile) {
            self.put(header, first, here, self.number(header, parent, there));
        }
    }

    /// Writes a number over zeros.
    fn put(&mut self, header: &Header, first: usize, [i, j]: [u32; 2], number: u32) {
        let at = (j * header.grid.side() + i) as usize;
        match header.width {
            Width::Two => self.words[first + at / 2] |= number << (16 * (at % 2)),
            Width::Four => self.words[first + at] = number,
        }
    }

    /// Marks a tile as used in a frame.
    pub fn touch(&mut self, tile: u32, frame: u32) {
        if let Some(slot) = self.slot(tile) {
            self.used[slot as usize] = frame;
        }
    }

    /// A slot for a tile whose parent is in memory (or that has none); `None` if all tiles are in use.
    pub fn admit(&mut self, header: &Header, tile: u32, frame: u32) -> Option<u32> {
        let parent = header.parent(tile);
        if parent.is_some_and(|p| !self.has(p)) || self.has(tile) {
            return None;
        }
        // The parent must not be evicted for it.
        if let Some(parent) = parent {
            self.quarters[parent as usize] += 1;
        }
        let Some(slot) = self.free.pop().or_else(|| self.evict(header, frame)) else {
            if let Some(parent) = parent {
                self.quarters[parent as usize] -= 1;
            }
            return None;
        };
        self.slots[tile as usize] = slot;
        self.tiles[slot as usize] = tile;
        self.used[slot as usize] = frame;
        self.queue.push(Reverse((rank(header, tile, frame), slot)));
        Some(slot)
    }

    /// Frees the slot of an old, deep tile that is not needed.
    fn evict(&mut self, header: &Header, frame: u32) -> Option<u32> {
        for _ in 0..TRIES.min(self.queue.len()) {
            let Reverse((_, slot)) = self.queue.pop()?;
            let tile = self.tiles[slot as usize];
            let used = self.used[slot as usize];
            let parent = header.parent(tile);
            if parent.is_some() && self.quarters[tile as usize] == 0 && frame.saturating_sub(used) > IN_USE {
                self.slots[tile as usize] = NONE;
                self.tiles[slot as usize] = NONE;
                if let Some(parent) = parent {
                    self.quarters[parent as usize] -= 1;
                }
                return Some(slot);
            }
            self.queue.push(Reverse((rank(header, tile, used.max(frame.saturating_sub(IN_USE))) + OLDER_BY_LEVEL, slot)));
        }
        None
    }
}

impl Header {
    /// Words of a tile in memory: two samples of two bytes, or one of four, per word.
    pub(super) fn slot_words(&self) -> usize {
        ((self.grid.side() * self.grid.side()) as usize * self.width.bytes()).div_ceil(4)
    }
}

/// Rank of a tile: lower ranks are evicted earlier.
fn rank(header: &Header, tile: u32, used: u32) -> u64 {
    u64::from(used) + OLDER_BY_LEVEL * u64::from(header.grid.key(tile).level)
}
