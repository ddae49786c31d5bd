//! What an eye may need next, in order, as much as fits into memory.

use super::super::culler::{Culler, bit};
use super::super::motion::Motion;
use super::reach::{Reach, Walker};
use super::sight::Sight;
use crate::bits::ones;
use crate::{CellId, ObjectId};

/// An object of a plan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Planned {
    pub object: ObjectId,
    /// How far the eye has to go before it may need it, metres, at least.
    pub metres: f32,
}

/// One part in so many of the budget takes what is free and no more. Fewer: less of the plan comes surely. More: what is at the
/// end of the plan comes and goes with every step.
const LOOSE: u64 = 4;

/// Objects by how far the eye has to go before it may see them: those of the rows of its own cells, then those that the row of the next cell
/// adds, and so on, until the next one would not fit into memory. Of those that a row adds, what is in the cell comes first. Where the rows of
/// its own cells alone don't fit, what the eye sees now and will see soon comes before all.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    reach: Reach,
    /// Bytes of what may be planned.
    budget: u64,
    order: Vec<Planned>,
    /// The eye's own rows did not fit.
    is_by_sight: bool,
    /// How many of these are the core.
    core: usize,
    /// Bytes that are left.
    left: u64,
    /// Objects that are planned, or that never fit, as bits.
    seen: Vec<u64>,
}

impl Plan {
    pub fn new(culler: &Culler, reach: Reach, budget: u64) -> Self {
        let objects = culler.object_count();
        let order = Vec::with_capacity(objects);
        Self { reach, budget, is_by_sight: false, order, core: 0, left: 0, seen: vec![0; objects.div_ceil(64)] }
    }

    pub fn reach_mut(&mut self) -> &mut Reach {
        &mut self.reach
    }

    /// What is planned, the most urgent first.
    pub fn order(&self) -> &[Planned] {
        &self.order
    }

    /// How many of them are worth that others leave for them.
    pub fn core(&self) -> usize {
        self.core
    }

    /// Whether what the eye sees decides, so that a plan is old as soon as it turns.
    pub fn is_by_sight(&self) -> bool {
        self.is_by_sight
    }

    /// Plans anew.
    pub fn make(
        &mut self,
        culler: &Culler,
        bytes: &[u64],
        walker: Walker,
        homes: &[CellId],
        sight: &mut Sight,
        motion: &Motion,
    ) {
        self.clear();
        let mut fits = homes.iter().all(|&home| self.add_cell(culler, bytes, home, 0.0));
        self.is_by_sight = !fits;
        if self.is_by_sight {
            self.clear();
            sight.each(culler, motion, &mut |object| self.add(bytes, Planned { object, metres: 0.0 }));
            for &home in homes {
                self.add_cell(culler, bytes, home, 0.0);
            }
        }
        self.reach.start(culler, walker, homes);
        while fits {
            let Some((cell, metres)) = self.reach.next(culler) else { break };
            fits = self.add_cell(culler, bytes, cell, metres);
        }
    }

    fn clear(&mut self) {
        self.order.clear();
        self.core = 0;
        self.seen.fill(0);
        self.left = self.budget;
    }

    /// Adds what a cell's row has; false where something of it did not fit.
    fn add_cell(&mut self, culler: &Culler, bytes: &[u64], cell: CellId, metres: f32) -> bool {
        let row = culler.object_rows.as_ref().map(|rows| rows.row(cell.index()));
        let mut fits = true;
        for &object in culler.cell_objects.get(cell.index()) {
            if row.is_none_or(|row| bit(row, object.index())) {
                fits = fits && self.add(bytes, Planned { object, metres });
            }
        }
        for (word, &seen) in row.unwrap_or_default().iter().enumerate() {
            for i in ones(&[seen & !self.seen[word]]) {
                fits = fits && self.add(bytes, Planned { object: ObjectId((64 * word + i) as u32), metres });
            }
        }
        fits
    }

    /// Adds an object that isn't planned yet; false where it does not fit.
    fn add(&mut self, bytes: &[u64], planned: Planned) -> bool {
        let object = planned.object.index();
        if bit(&self.seen, object) {
            return true;
        }
        let size = bytes[object];
        // What never fits keeps nothing else out.
        if size <= self.budget {
            if size > self.left {
                return false;
            }
            self.left -= size;
            self.order.push(planned);
            if self.left >= self.budget / LOOSE {
                self.core = self.order.len();
            }
        }
        self.seen[object / 64] |= 1 << (object % 64);
        true
    }
}
