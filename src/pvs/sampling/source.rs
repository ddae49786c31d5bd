//! The interface between sampling methods and the schedule.

use super::witness::Witnessed;
use crate::job::{Job, Stopped};

/// A part of the rays.
pub(super) struct Part<'a> {
    /// About this many rays.
    pub rays: u64,
    /// Hard limit on the rays, which may be too few for any work.
    pub most: u64,
    /// The job that runs the maps.
    pub work: &'a Job<'a>,
    /// Rays before this part, and of all parts.
    pub before: u64,
    pub whole: u64,
}

impl Part<'_> {
    /// Reports progress within the part, from 0 to 1.
    pub fn tell(&self, done: f64) {
        self.work.tell("sampling", (self.before as f64 + done * self.rays as f64) / self.whole as f64);
    }
}

/// A method of finding free lines.
pub(super) trait Source {
    /// Spends a part of the rays; false if nothing is left to try.
    fn step(&mut self, lower: &mut Witnessed, part: &Part<'_>) -> Result<bool, Stopped>;
}
