//! Connected parts of a level. No line leads from one to another, so each is processed alone: time and memory follow the
//! reachable pairs, not the square of all cells.

use super::{Level, LevelPortal, Line, Vis, VisStats};
use enfilade::BitMatrix;

/// A connected set of cells with its portals; ascending.
pub(super) struct Part {
    /// Its cells, by the level's numbers.
    pub cells: Vec<u32>,
    /// Its portals, by the level's numbers.
    portals: Vec<u32>,
    /// The part as a separate level.
    pub level: Level,
}

/// The parts with portals, by their first cells. All cells of portals exist.
pub(super) fn parts(level: &Level) -> Vec<Part> {
    // 1. The least cell in each part.
    let mut least: Vec<u32> = (0..level.cells as u32).collect();
    for portal in &level.portals {
        let [a, b] = portal.cells.map(|cell| root(&mut least, cell));
        least[a.max(b) as usize] = a.min(b);
    }
    // 2. Cells and portals by part.
    let mut parts: Vec<Part> = Vec::new();
    let mut number = vec![None; level.cells];
    for (p, portal) in level.portals.iter().enumerate() {
        let first = root(&mut least, portal.cells[0]) as usize;
        let number = *number[first].get_or_insert_with(|| {
            parts.push(Part { cells: Vec::new(), portals: Vec::new(), level: Level::default() });
            parts.len() - 1
        });
        parts[number].portals.push(p as u32);
    }
    for cell in 0..level.cells as u32 {
        if let Some(number) = number[root(&mut least, cell) as usize] {
            parts[number].cells.push(cell);
        }
    }
    parts.sort_by_key(|part| part.cells[0]);
    // 3. The parts as levels.
    for part in &mut parts {
        let place = |cell: u32| part.cells.partition_point(|&c| c < cell) as u32;
        let portal = |&p: &u32| {
            let LevelPortal { cells, winding } = &level.portals[p as usize];
            LevelPortal { cells: cells.map(place), winding: winding.clone() }
        };
        let portals = part.portals.iter().map(portal).collect();
        part.level = Level { cells: part.cells.len(), portals, rounding: level.rounding };
    }
    parts
}

/// The least cell known to be connected with a cell.
fn root(least: &mut [u32], mut cell: u32) -> u32 {
    while least[cell as usize] != cell {
        let above = least[least[cell as usize] as usize];
        least[cell as usize] = above;
        cell = above;
    }
    cell
}

impl Part {
    /// A line of the part, in the level's numbers.
    fn line(&self, line: Line) -> Line {
        let cells = line.cells.map(|cell| self.cells[cell as usize]);
        let portals = line.portals.into_iter().map(|p| 2 * self.portals[p as usize / 2] + p % 2).collect();
        Line { cells, portals, ..line }
    }
}

impl Vis {
    /// The result for cells that see only themselves.
    pub(super) fn of_none(cells: usize) -> Self {
        let mut alone = BitMatrix::new(cells, cells);
        (0..cells).for_each(|cell| _ = alone.set(cell, cell));
        Self { lower: alone.clone(), upper: alone, lines: Vec::new(), stats: VisStats::default() }
    }

    /// Adds the result of a part.
    pub(super) fn take(&mut self, part: &Part, found: Vis) {
        for (all, found) in [(&mut self.lower, &found.lower), (&mut self.upper, &found.upper)] {
            for (row, &cell) in part.cells.iter().enumerate() {
                found.ones(row).for_each(|other| _ = all.set(cell as usize, part.cells[other] as usize));
            }
        }
        self.lines.extend(found.lines.into_iter().map(|line| part.line(line)));
        self.stats.add(&found.stats);
    }
}

impl VisStats {
    /// Adds other counters.
    pub fn add(&mut self, other: &Self) {
        let Self { lines, steps, capped, exact_asked, exact_refuted, exact_lines } = other;
        self.lines += lines;
        self.steps += steps;
        self.capped += capped;
        self.exact_asked += exact_asked;
        self.exact_refuted += exact_refuted;
        self.exact_lines += exact_lines;
    }
}
