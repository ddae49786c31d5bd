//! What every way of finding free lines offers to the schedule.

use super::witness::Witnessed;
use crate::job::{Job, Stopped};

/// A part of the rays.
pub(super) struct Part<'a> {
    /// About so many rays.
    pub rays: u64,
    /// Never more than these, which may be too few to do anything with.
    pub most: u64,
    /// What the maps are made by.
    pub work: &'a Job<'a>,
    /// Rays before it, and of all parts.
    pub before: u64,
    pub whole: u64,
}

impl Part<'_> {
    /// Says how far it is, of one.
    pub fn tell(&self, done: f64) {
        self.work.tell("sampling", (self.before as f64 + done * self.rays as f64) / self.whole as f64);
    }
}

/// A way of finding free lines.
pub(super) trait Source {
    /// Spends a part of the rays; false where nothing is left to try.
    fn step(&mut self, lower: &mut Witnessed, part: &Part<'_>) -> Result<bool, Stopped>;
}
