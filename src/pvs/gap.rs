//! The gap between the two bounds, and the proven pairs.

use super::{Pvs, Witness};
use crate::types::gap::Gap;
use crate::{BitMatrix, CellId, ObjectId};

impl Pvs {
    /// The lower set of objects and a witness for each of its pairs, by cell, then object. Pairs without a witness and witnesses without a
    /// pair are left out.
    pub fn witnessed(&self) -> (BitMatrix, Vec<Witness>) {
        let mut sorted: Vec<&Witness> = self.witnesses.iter().collect();
        sorted.sort_by_key(|w| (w.cell, w.object));
        let (mut lower, mut witnesses) =
            (BitMatrix::new(self.objects_lower.rows(), self.objects_lower.columns()), Vec::new());
        for cell in 0..lower.rows() {
            for object in self.objects_lower.ones(cell) {
                let pair = (CellId(cell as u32), ObjectId(object as u32));
                if let Ok(at) = sorted.binary_search_by_key(&pair, |w| (w.cell, w.object)) {
                    lower.set(cell, object);
                    witnesses.push(*sorted[at]);
                }
            }
        }
        (lower, witnesses)
    }

    /// Pairs of the upper set that are not in `lower`, counted by the reason.
    pub fn gap(&self, lower: &BitMatrix) -> Gap {
        let mut gap = Gap::default();
        for (c, cell) in self.graph.cells.iter().enumerate() {
            for object in self.objects_upper.ones(c) {
                gap.closed_upper += u64::from(!cell.open);
                if lower.get(c, object) {
                    continue;
                }
                let kind = match (cell.open, self.unresolved.get(c, object), self.placement.matrix.get(c, object)) {
                    (true, ..) => &mut gap.open,
                    (_, true, _) => &mut gap.tolerance,
                    (.., true) => &mut gap.inside,
                    _ => &mut gap.budget,
                };
                *kind += 1;
            }
        }
        gap
    }
}
