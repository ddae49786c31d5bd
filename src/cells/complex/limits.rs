//! How large a column complex may be.
//!
//! Where lines of the plan and sheets over it are as dense as in rubble, what they cut of one another grows with the square of their number.
//! Counts are sums over all items, so that the same complex is too large for any number of threads.

use crate::job::Job;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

/// Pieces that a scene may have, and so many more for each of its triangles. Small buildings have 1 to 20 a triangle. More: time and memory go
/// into pieces that no room is made of. Less: small scenes of large walls lose some.
const PIECES: usize = 50_000;
const PIECES_A_TRIANGLE: usize = 20;
/// What a large scene may have, and so many more for each of its triangles: offices of a thousand and of five thousand rooms have one, a maze of
/// five thousand has two. More: soups of a hundred thousand triangles take more than a gigabyte. Less: large buildings are coarser than they
/// need be.
const PIECES_OF_MANY: usize = 250_000;
const PIECES_A_TRIANGLE_OF_MANY: usize = 2;
/// What a piece takes, with its faces and all that is made of them until the graph is there, bytes. More: large buildings are coarser than
/// they need be. Less: a split takes more memory than it may.
const PIECE_BYTES: u64 = 2 << 10;

/// Most pieces, or crossings of lines; and what stops the work.
pub struct Limits<'w> {
    /// At most.
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

    /// Counts from 0.
    pub fn count(&self) -> Count<'_> {
        Count { limits: self, counted: AtomicUsize::new(0) }
    }
}

/// What has been made so far.
pub struct Count<'l> {
    limits: &'l Limits<'l>,
    counted: AtomicUsize,
}

impl Count<'_> {
    /// Counts some more.
    pub fn add(&self, some: usize) {
        self.counted.fetch_add(some, Relaxed);
    }

    /// True where the rest is in vain.
    pub fn is_over(&self) -> bool {
        self.counted.load(Relaxed) > self.limits.most || self.limits.work.is_stopped()
    }
}
