//! The plan: objects that an eye may need next, in order, within the memory budget.

use super::super::culler::{Culler, bit};
use super::super::motion::Motion;
use super::reach::{Reach, Walker};
use super::sight::Sight;
use crate::math::bits::ones;
use crate::{CellId, ObjectId};

/// An object of a plan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Planned {
    pub object: ObjectId,
    /// Lower bound of the eye's distance until it may need the object, metres.
    pub metres: f32,
}

/// One part in this many of the budget uses free memory only. Smaller: less of the plan is certain to be loaded. Larger: objects at the end
/// of the plan are loaded and evicted with every step.
const LOOSE: u64 = 4;

/// Objects ordered by the eye's distance until they may be visible: first those of the rows of its own cells, then those added by the row
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
    /// Objects that are planned or never fit, as bits.
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

    /// The planned objects, most urgent first.
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

    /// Adds the objects of a cell's row; false if some did not fit.
    fn add_cell(&mut self, culler: &Culler, bytes: &[u64], cell: CellId, metres: f32) -> bool {
        let row = culler.object_row(cell);
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

    /// Adds an object that is not planned yet; false if it does not fit.
    fn add(&mut self, bytes: &[u64], planned: Planned) -> bool {
        let object = planned.object.index();
        if bit(&self.seen, object) {
            return true;
        }
        let size = bytes[object];
        // An object that never fits does not block others.
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
