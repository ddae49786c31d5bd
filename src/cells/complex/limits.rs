//! Limits on the size of a column complex.
//!
//! If lines of the plan and sheets are as dense as in rubble, crossings grow with the square of their number. Counts are sums over all
//! items, so the result does not depend on the number of threads.

use crate::job::Job;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

/// Most pieces of a small scene: a base, plus a number per triangle. Small buildings have 1 to 20 per triangle. More: time and memory go
/// into useless pieces. Fewer: small scenes of large walls lose some.
const PIECES: usize = 50_000;
const PIECES_A_TRIANGLE: usize = 20;
/// Most pieces of a large scene: a base, plus a number per triangle: offices of a thousand and of five thousand rooms have one, a maze of
/// five thousand has two. More: soups of a hundred thousand triangles take more than a gigabyte. Fewer: large buildings are unnecessarily
/// coarse.
const PIECES_OF_MANY: usize = 250_000;
const PIECES_A_TRIANGLE_OF_MANY: usize = 2;
/// Memory per piece, with its faces and all data made from them, bytes. More: large buildings are unnecessarily coarse. Less: a split
/// exceeds its memory limit.
const PIECE_BYTES: u64 = 2 << 10;

/// Limit on pieces, or on crossings of lines, and the job that can stop the work.
pub struct Limits<'w> {
    /// The limit.
    pub most: usize,
    /// Asked in every loop.
    pub work: &'w Job<'w>,
}

impl<'w> Limits<'w> {
    /// For a scene of so many triangles, in `memory` bytes.
    pub fn new(triangles: usize, memory: u64, work: &'w Job<'w>) -> Self {
        let affordable = usize::try_from(memory / PIECE_BYTES).unwrap_or(usize::MAX).max(PIECES);
        let few = PIECES.saturating_add(PIECES_A_TRIANGLE.saturating_mul(triangles));
        let many = PIECES_OF_MANY.saturating_add(PIECES_A_TRIANGLE_OF_MANY.saturating_mul(triangles));
        Self { most: few.min(many).min(affordable), work }
    }

    /// A count from 0.
    pub fn count(&self) -> Count<'_> {
        Count { limits: self, counted: AtomicUsize::new(0) }
    }
}

/// The number made so far.
pub struct Count<'l> {
    limits: &'l Limits<'l>,
    counted: AtomicUsize,
}

impl Count<'_> {
    /// Adds to the count.
    pub fn add(&self, some: usize) {
        self.counted.fetch_add(some, Relaxed);
    }

    /// True if the limit is exceeded or the job stopped.
    pub fn is_over(&self) -> bool {
        self.counted.load(Relaxed) > self.limits.most || self.limits.work.is_stopped()
    }
}
