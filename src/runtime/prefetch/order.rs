//! The plan: chunks that an eye may need next, in order, within the memory budget.

use super::super::culler::{Culler, bit};
use super::super::motion::Motion;
use super::chunks::{ChunkId, Chunks};
use super::reach::{Reach, Walker};
use super::sight::Sight;
use crate::math::bits::ones;
use crate::{CellId, ObjectId};

/// A chunk of a plan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Planned {
    pub chunk: ChunkId,
    /// Lower bound of the eye's distance until it may need the object, metres.
    pub metres: f32,
}

/// One part in this many of the budget uses free memory only. Smaller: less of the plan is certain to be loaded. Larger: chunks at the end
/// of the plan are loaded and evicted with every step.
const LOOSE: u64 = 4;

/// Chunks ordered by the eye's distance until they may be visible: first those of the rows of its own cells, then those added by the row
/// of the next cell, and so on, until memory is full. Of the objects of a row, those in the cell come first. If the rows of its own cells
/// do not fit, the objects that the eye sees now and soon come first.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    reach: Reach,
    /// Budget of the plan, bytes.
    budget: u64,
    order: Vec<Planned>,
    /// Whether the eye's own rows did not fit.
    is_by_sight: bool,
    /// Number of these in the core.
    core: usize,
    /// Remaining bytes.
    left: u64,
    /// Chunks that are planned or never fit, as bits.
    seen: Vec<u64>,
    /// Objects of these that were met in a row, as bits.
    met: Vec<u64>,
}

impl Plan {
    pub fn new(chunks: &Chunks, reach: Reach, budget: u64) -> Self {
        let bits = |count: usize| vec![0; count.div_ceil(64)];
        let (seen, met) = (bits(chunks.bytes.len()), bits(chunks.of.len()));
        Self {
            reach,
            budget,
            is_by_sight: false,
            order: Vec::with_capacity(chunks.bytes.len()),
            core: 0,
            left: 0,
            seen,
            met,
        }
    }

    pub fn reach_mut(&mut self) -> &mut Reach {
        &mut self.reach
    }

    /// The planned chunks, most urgent first.
    pub fn order(&self) -> &[Planned] {
        &self.order
    }

    /// Size of the core, for which others may be evicted.
    pub fn core(&self) -> usize {
        self.core
    }

    /// Whether the plan depends on the view direction, so that it is outdated after a turn.
    pub fn is_by_sight(&self) -> bool {
        self.is_by_sight
    }

    /// Makes a new plan.
    pub fn make(
        &mut self,
        culler: &Culler,
        chunks: &Chunks,
        walker: Walker,
        homes: &[CellId],
        sight: &mut Sight,
        motion: &Motion,
    ) {
        self.clear();
        let mut fits = homes.iter().all(|&home| self.add_cell(culler, chunks, home, 0.0));
        self.is_by_sight = !fits;
        if self.is_by_sight {
            self.clear();
            sight.each(culler, motion, &mut |object| self.add(chunks, object, 0.0));
            for &home in homes {
                self.add_cell(culler, chunks, home, 0.0);
            }
        }
        self.reach.start(culler, walker, homes);
        while fits {
            let Some((cell, metres)) = self.reach.next(culler) else { break };
            fits = self.add_cell(culler, chunks, cell, metres);
        }
    }

    fn clear(&mut self) {
        self.order.clear();
        self.core = 0;
        self.seen.fill(0);
        self.met.fill(0);
        self.left = self.budget;
    }

    /// Adds the chunks of the objects of a cell's row; false if some did not fit.
    fn add_cell(&mut self, culler: &Culler, chunks: &Chunks, cell: CellId, metres: f32) -> bool {
        let row = culler.object_row(cell);
        let mut fits = true;
        for &object in culler.cell_objects.get(cell.index()) {
            if row.is_none_or(|row| bit(row, object.index())) {
                fits = fits && self.add(chunks, object, metres);
            }
        }
        for (word, &seen) in row.unwrap_or_default().iter().enumerate() {
            for i in ones(&[seen & !self.met[word]]) {
                fits = fits && self.add(chunks, ObjectId((64 * word + i) as u32), metres);
            }
        }
        fits
    }

    /// Adds an object's chunk, if it is not planned yet; false if it does not fit.
    fn add(&mut self, chunks: &Chunks, object: ObjectId, metres: f32) -> bool {
        let chunk = chunks.of(object);
        let (size, is_known) = (chunks.bytes[chunk.index()], bit(&self.seen, chunk.index()));
        // A chunk that never fits does not block others.
        if !is_known && size <= self.budget {
            if size > self.left {
                return false;
            }
            self.left -= size;
            self.order.push(Planned { chunk, metres });
            if self.left >= self.budget / LOOSE {
                self.core = self.order.len();
            }
        }
        self.seen[chunk.index() / 64] |= 1 << (chunk.index() % 64);
        self.met[object.index() / 64] |= 1 << (object.index() % 64);
        true
    }
}
