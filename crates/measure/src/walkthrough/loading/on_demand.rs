//! Loading on demand, for comparison: a frame loads its missing objects, and the least recently seen ones are evicted.

use enfilade::ObjectId;
use enfilade::runtime::prefetch::{ChunkId, Step};
use std::collections::BTreeSet;

/// See the [module](self).
pub(super) struct OnDemand<'b> {
    bytes: &'b [u64],
    budget: u64,
    /// By object: the last frame that saw it.
    seen: Vec<u64>,
    loaded: Vec<bool>,
    under_way: Vec<bool>,
    /// Loaded objects, the least recently seen first.
    oldest: BTreeSet<(u64, ObjectId)>,
    frame: u64,
    /// Bytes loaded or under way, bytes loaded, and bytes that may be evicted.
    used: u64,
    held: u64,
    evictable: u64,
    /// Objects that the frame sees and lacks, in reverse order of loading.
    missing: Vec<ObjectId>,
}

impl<'b> OnDemand<'b> {
    pub fn new(bytes: &'b [u64], budget: u64) -> Self {
        let objects = bytes.len();
        Self {
            bytes,
            budget,
            seen: vec![0; objects],
            loaded: vec![false; objects],
            under_way: vec![false; objects],
            oldest: BTreeSet::new(),
            frame: 0,
            used: 0,
            held: 0,
            evictable: 0,
            missing: Vec::new(),
        }
    }

    pub fn frame(&mut self, visible: &[ObjectId]) {
        self.frame += 1;
        self.missing.clear();
        self.evictable = self.held;
        for &object in visible.iter().rev() {
            let at = object.index();
            if self.loaded[at] {
                self.oldest.remove(&(self.seen[at], object));
                self.oldest.insert((self.frame, object));
                self.evictable -= self.bytes[at];
            } else if !self.under_way[at] {
                self.missing.push(object);
            }
            self.seen[at] = self.frame;
        }
    }

    pub fn next_step(&mut self) -> Option<Step> {
        while let Some(&object) = self.missing.last() {
            let bytes = self.bytes[object.index()];
            if self.used + bytes <= self.budget {
                self.missing.pop();
                self.under_way[object.index()] = true;
                self.used += bytes;
                return Some(Step::Load { chunk: ChunkId(object.0), metres: 0.0 });
            }
            let fits = self.used - self.evictable + bytes <= self.budget;
            match self.oldest.first().copied().filter(|(seen, _)| fits && *seen < self.frame) {
                Some((seen, evicted)) => {
                    self.oldest.remove(&(seen, evicted));
                    self.loaded[evicted.index()] = false;
                    self.used -= self.bytes[evicted.index()];
                    self.held -= self.bytes[evicted.index()];
                    self.evictable -= self.bytes[evicted.index()];
                    return Some(Step::Evict(ChunkId(evicted.0)));
                }
                None => drop(self.missing.pop()),
            }
        }
        None
    }

    pub fn loaded(&mut self, object: ObjectId) {
        let at = object.index();
        self.under_way[at] = false;
        self.loaded[at] = true;
        self.held += self.bytes[at];
        self.oldest.insert((self.seen[at], object));
        if self.seen[at] < self.frame {
            self.evictable += self.bytes[at];
        }
    }
}
