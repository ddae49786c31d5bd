//! What every way of finding free lines offers to the schedule.

use super::witness::Lower;
use crate::job::{Job, Stopped};

/// A way of finding free lines.
pub(super) trait Source {
    /// Spends about `rays`, and never more than `most`, which may be too few to do anything with; false where nothing is
    /// left to try.
    fn step(&mut self, lower: &mut Lower, rays: u64, most: u64, work: &Job<'_>) -> Result<bool, Stopped>;
}
