//! Compares our rows with those of another tool: its pairs that are proven hidden, and the proven pairs that it lacks.

use super::{Level, Line, Vis};
use enfilade::BitMatrix;
use enfilade::math::geom::middle;
use std::cmp::Reverse;

/// Two sets of rows for one level. All pairs are ordered and include each cell with itself.
#[derive(Clone, PartialEq, Debug)]
pub struct Against {
    /// Pairs in the other tool's rows.
    pub theirs: u64,
    /// Pairs in our rows: not proven hidden.
    pub ours: u64,
    /// Pairs in both.
    pub both: u64,
    /// Pairs only in the other tool's rows. Each is proven hidden.
    pub refuted: u64,
    /// These pairs.
    pub refuted_rows: BitMatrix,
    /// Pairs that the other tool has in one direction only: a sees b, b does not see a.
    pub one_way: u64,
    /// Pairs of `one_way` that are proven hidden. For the rest the other tool lacks the reverse pair.
    pub one_way_refuted: u64,
    /// Pairs that the other tool lacks and that may be visible: neither proven hidden nor on a known line.
    pub undecided: u64,
    /// Pairs that the other tool lacks and a line proves, ascending, each with that line from its first cell to its second. For
    /// neighbours it is a point of their portal.
    pub lost: Vec<Line>,
}

/// What the other tool has wrong in the row of a cell.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CellFaults {
    /// The cell.
    pub cell: u32,
    /// Pairs of `lost` that begin in it.
    pub lost: usize,
    /// Pairs of `refuted_rows` that begin in it.
    pub refuted: usize,
}

impl Against {
    /// Cells with faults in their rows; those that lack most come first.
    pub fn by_cell(&self) -> Vec<CellFaults> {
        let refuted = |cell: usize| self.refuted_rows.ones(cell).count();
        let faults = |cell: usize| CellFaults { cell: cell as u32, lost: 0, refuted: refuted(cell) };
        let mut all: Vec<CellFaults> = (0..self.refuted_rows.rows()).map(faults).collect();
        self.lost.iter().for_each(|line| all[line.cells[0] as usize].lost += 1);
        all.retain(|faults| faults.lost + faults.refuted > 0);
        all.sort_by_key(|faults| (Reverse((faults.lost, faults.refuted)), faults.cell));
        all
    }

    /// Lines of `lost` that begin in a cell.
    pub fn lost_from(&self, cell: u32) -> &[Line] {
        let begin = self.lost.partition_point(|line| line.cells[0] < cell);
        &self.lost[begin..self.lost.partition_point(|line| line.cells[0] <= cell)]
    }
}

/// Compares rows of another tool with a result for the same level.
///
/// # Panics
///
/// If `theirs` is not square with a row for each cell.
pub fn against(level: &Level, vis: &Vis, theirs: &BitMatrix) -> Against {
    let n = level.cells;
    assert_eq!((theirs.rows(), theirs.columns()), (n, n), "a row and a column for each cell");
    let count = |rows: &BitMatrix, keep: &dyn Fn(usize, usize) -> bool| -> u64 {
        (0..n).map(|a| rows.ones(a).filter(|&b| keep(a, b)).count() as u64).sum()
    };
    let both = count(theirs, &|a, b| vis.upper.get(a, b));
    let mut refuted_rows = BitMatrix::new(n, n);
    for a in 0..n {
        theirs.ones(a).filter(|&b| !vis.upper.get(a, b)).for_each(|b| _ = refuted_rows.set(a, b));
    }
    Against {
        theirs: theirs.count_ones(),
        ours: vis.upper.count_ones(),
        both,
        refuted: refuted_rows.count_ones(),
        refuted_rows,
        one_way: count(theirs, &|a, b| !theirs.get(b, a)),
        one_way_refuted: count(theirs, &|a, b| !theirs.get(b, a) && !vis.upper.get(a, b)),
        undecided: count(&vis.upper, &|a, b| !theirs.get(a, b) && !vis.lower.get(a, b)),
        lost: lost(level, vis, theirs),
    }
}

/// The witnessed pairs that `theirs` lacks, each with the first line that passes both cells.
fn lost(level: &Level, vis: &Vis, theirs: &BitMatrix) -> Vec<Line> {
    let mut wanted = BitMatrix::new(level.cells, level.cells);
    for a in 0..level.cells {
        vis.lower.ones(a).filter(|&b| !theirs.get(a, b)).for_each(|b| _ = wanted.set(a, b));
    }
    let mut found: Vec<Line> = Vec::new();
    // 1. Neighbours; one portal between two of them is enough.
    for (portal, p) in (0u32..).zip(&level.portals) {
        for side in 0..2 {
            let [a, b] = [p.cells[side as usize], p.cells[1 - side as usize]];
            if wanted.get(a as usize, b as usize) {
                wanted.clear(a as usize, b as usize);
                let at = middle(&p.winding);
                found.push(Line { cells: [a, b], from: at, to: at, portals: vec![2 * portal + side] });
            }
        }
    }
    // 2. The others lie along lines.
    for line in &vis.lines {
        let cells = line.cells_along(level);
        for &a in &cells {
            for &b in &cells {
                if wanted.get(a as usize, b as usize)
                    && let Some(part) = line.between(level, a, b)
                {
                    wanted.clear(a as usize, b as usize);
                    found.push(part);
                }
            }
        }
    }
    found.sort_by_key(|line| line.cells);
    found
}
