//! The undecided pairs of a bake: their number, their kind and the worst cells. Files without both bounds have none.

use enfilade::file::{Bounds, Gap, PvsFile};
use enfilade::{BitMatrix, CellId, ObjectId};
use std::collections::BTreeSet;

/// Cell-object pairs of some cells.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Pairs {
    /// Cells.
    pub cells: u64,
    /// All pairs.
    pub total: u64,
    /// Pairs with a witness.
    pub lower: u64,
    /// Pairs not proven hidden.
    pub upper: u64,
}

impl Pairs {
    /// Undecided pairs.
    pub fn undecided(&self) -> u64 {
        self.upper - self.lower
    }

    /// Undecided pairs over those not proven hidden: the certified gap.
    pub fn gap(&self) -> f64 {
        self.undecided() as f64 / self.upper.max(1) as f64
    }

    /// The sum of both.
    pub fn with(self, other: Self) -> Self {
        Self {
            cells: self.cells + other.cells,
            total: self.total + other.total,
            lower: self.lower + other.lower,
            upper: self.upper + other.upper,
        }
    }
}

/// The pairs of one cell.
pub fn of_cell(file: &PvsFile, cell: CellId) -> Pairs {
    let count = |side: fn(&Bounds) -> &BitMatrix| file.bounds.as_ref().map_or(0, |b| side(b).count_row(cell.index()));
    let (lower, upper) = (count(|b| &b.objects_lower), count(|b| &b.objects_upper));
    Pairs { cells: 1, total: file.objects.len() as u64, lower, upper }
}

/// The pairs of closed cells, and those of open ones.
pub fn closed_and_open(file: &PvsFile) -> [Pairs; 2] {
    let mut both = [Pairs::default(); 2];
    for (c, cell) in file.cells.iter().enumerate() {
        let of = &mut both[usize::from(cell.open)];
        *of = of.with(of_cell(file, CellId(c as u32)));
    }
    both
}

/// Undecided pairs by kind, each with a description; the kinds add up to all.
pub fn kinds(file: &PvsFile) -> [(&'static str, u64); 4] {
    let Gap { tolerance, inside, budget, open, .. } = file.gap.unwrap_or_default();
    [
        ("in the closed cell itself, behind other objects or within a wall: no ray has hit them", inside),
        ("beyond a closed cell's portals: the budget ended before a witness or a proof was found", budget),
        ("hit by rays or narrowed down, but neither proven visible nor hidden within the tolerance", tolerance),
        ("from open cells, which are culled in each frame", open),
    ]
}

/// Undecided objects of a cell, ascending.
fn undecided(file: &PvsFile, cell: usize) -> impl Iterator<Item = usize> + '_ {
    let bounds = file.bounds.as_ref();
    bounds.into_iter().flat_map(move |b| b.objects_upper.ones(cell).filter(move |&o| !b.objects_lower.get(cell, o)))
}

/// The `count` most important undecided pairs: closed cells with most of them first, then open ones; of each the largest object
/// not named before.
pub fn hardest(file: &PvsFile, count: usize) -> Vec<(CellId, ObjectId)> {
    let size = |o: &usize| file.objects[*o].bounds[0].distance(file.objects[*o].bounds[1]);
    let mut cells: Vec<(CellId, Vec<usize>)> = Vec::new();
    for cell in 0..file.cells.len() {
        let mut objects: Vec<usize> = undecided(file, cell).collect();
        // Objects in the cell itself have no chain of portals, so they come last.
        objects.sort_by(|a, b| {
            let inside = |o: &usize| file.placement.get(cell, *o);
            inside(a).cmp(&inside(b)).then(size(b).total_cmp(&size(a))).then(a.cmp(b))
        });
        cells.push((CellId(cell as u32), objects));
    }
    cells.sort_by_key(|(cell, objects)| (file.cells[cell.index()].open, std::cmp::Reverse(objects.len()), *cell));
    let most = cells.iter().map(|c| c.1.len()).max().unwrap_or(0);
    let (mut found, mut named) = (Vec::new(), BTreeSet::new());
    for _ in 0..most.min(count) {
        for (cell, objects) in &mut cells {
            if found.len() == count || objects.is_empty() {
                continue;
            }
            let object = objects.remove(objects.iter().position(|o| !named.contains(o)).unwrap_or(0));
            named.insert(object);
            found.push((*cell, ObjectId(object as u32)));
        }
    }
    found
}
