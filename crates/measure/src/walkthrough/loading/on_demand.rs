//! The plain way, to compare with: what a frame sees is loaded then, and what was seen longest ago leaves.

use enfilade::ObjectId;
use enfilade::runtime::prefetch::Step;
use std::collections::BTreeSet;

/// See the [module](self).
pub(super) struct OnDemand<'b> {
    bytes: &'b [u64],
    budget: u64,
    /// By object: the last frame that saw it.
    seen: Vec<u64>,
    loaded: Vec<bool>,
    under_way: Vec<bool>,
    /// What is loaded, that which was seen longest ago first.
    oldest: BTreeSet<(u64, ObjectId)>,
    frame: u64,
    /// Bytes of what is loaded or under way, of what is loaded, and of what of that may leave.
    used: u64,
    held: u64,
    idle: u64,
    /// What the frame sees and has not; the next is the last.
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
            idle: 0,
            missing: Vec::new(),
        }
    }

    pub fn frame(&mut self, visible: &[ObjectId]) {
        self.frame += 1;
        self.missing.clear();
        self.idle = self.held;
        for &object in visible.iter().rev() {
            let at = object.index();
            if self.loaded[at] {
                self.oldest.remove(&(self.seen[at], object));
                self.oldest.insert((self.frame, object));
                self.idle -= self.bytes[at];
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
                return Some(Step::Load { object, metres: 0.0 });
            }
            let fits = self.used - self.idle + bytes <= self.budget;
            match self.oldest.first().copied().filter(|(seen, _)| fits && *seen < self.frame) {
                Some((seen, leaver)) => {
                    self.oldest.remove(&(seen, leaver));
                    self.loaded[leaver.index()] = false;
                    self.used -= self.bytes[leaver.index()];
                    self.held -= self.bytes[leaver.index()];
                    self.idle -= self.bytes[leaver.index()];
                    return Some(Step::Evict(leaver));
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
            self.idle += self.bytes[at];
        }
    }
}
