//! Storeys of a baked building.

use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::math::geom::Aabb;

/// Height above the floor at which plans are cut, metres: above sills, below heads of doors. If cells are so high that the
/// model's unit cannot be the metre, it is `CUT_PART` of their height.
const CUT: f64 = 1.2;
const CUT_PART: f64 = 0.15;
/// Floors that differ by less than this part of the usual cell height are one storey.
const STOREY: f64 = 0.45;
/// Cells on one level.
#[derive(Clone, PartialEq, Debug)]
pub struct Storey {
    /// The height of its floor, metres relative to the file's origin.
    pub floor: f64,
    /// Height of its cut above that, metres.
    pub cut: f64,
    /// Its cells, ascending; open cells are on no storey.
    pub cells: Vec<CellId>,
}

/// The storeys of a file's closed cells, from the lowest up.
///
/// Floors are grouped by falling area, so that a landing or a step joins its nearest storey.
pub fn storeys(file: &PvsFile) -> Vec<Storey> {
    let graph = file.graph();
    // For each cell: floor, area, height.
    let mut floors: Vec<(CellId, [f64; 3])> = Vec::new();
    for (c, cell) in graph.cells.iter().enumerate().filter(|(_, cell)| !cell.open) {
        let boxes: Vec<Aabb> = cell.pieces.iter().map(|p| p.bounds).collect();
        floors.extend(floor(boxes).map(|f| (CellId(c as u32), f)));
    }
    let mut by_height: Vec<[f64; 2]> = floors.iter().map(|(_, [_, area, height])| [*height, *area]).collect();
    by_height.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let half = by_height.iter().map(|h| h[1]).sum::<f64>() / 2.0;
    let mut sum = 0.0;
    let usual = by_height.iter().find(|h| {
        sum += h[1];
        sum >= half
    });
    let usual = usual.map_or(1.0, |h| h[0]);
    let (reach, cut) = (STOREY * usual, CUT.max(CUT_PART * usual));

    let mut found: Vec<Storey> = Vec::new();
    let mut by_area = floors.clone();
    by_area.sort_by(|(a, x), (b, y)| y[1].total_cmp(&x[1]).then(a.cmp(b)));
    for (_, [floor, ..]) in &by_area {
        if found.iter().all(|s| (s.floor - floor).abs() > reach) {
            found.push(Storey { floor: *floor, cut, cells: Vec::new() });
        }
    }
    found.sort_by(|a, b| a.floor.total_cmp(&b.floor));
    for (cell, [floor, ..]) in floors {
        let nearest = found.iter_mut().min_by(|a, b| (a.floor - floor).abs().total_cmp(&(b.floor - floor).abs()));
        nearest.into_iter().for_each(|s| s.cells.push(cell));
    }
    found
}

/// Whether a cell has a name of its own.
pub(super) fn is_named(name: &str, cell: CellId) -> bool {
    !name.is_empty() && name != format!("cell {cell}")
}

/// The storey that a cell is on.
pub(super) fn on(storeys: &[Storey], cell: CellId) -> Option<usize> {
    storeys.iter().position(|s| s.cells.binary_search(&cell).is_ok())
}

/// All cells in an order that keeps neighbours together: open cells, then storey by storey, each along a breadth-first walk
/// through its portals.
pub fn along_a_walk(file: &PvsFile, storeys: &[Storey]) -> Vec<CellId> {
    let mut next = vec![Vec::new(); file.cells.len()];
    for [a, b] in file.portals.iter().map(|p| p.cells) {
        next[a.index()].push(b);
        next[b.index()].push(a);
    }
    next.iter_mut().for_each(|cells| cells.sort_unstable());
    let mut order: Vec<CellId> = Vec::new();
    let mut is_there = vec![false; file.cells.len()];
    let mut walk = |among: &[CellId]| {
        for &start in among {
            let mut at = order.len();
            if !std::mem::replace(&mut is_there[start.index()], true) {
                order.push(start);
            }
            while let Some(&cell) = order.get(at) {
                at += 1;
                for &c in &next[cell.index()] {
                    if among.binary_search(&c).is_ok() && !std::mem::replace(&mut is_there[c.index()], true) {
                        order.push(c);
                    }
                }
            }
        }
    };
    let open: Vec<CellId> = ids(file).filter(|c| file.cells[c.index()].open).collect();
    walk(&open);
    storeys.iter().for_each(|s| walk(&s.cells));
    // Cells without a volume are on no storey.
    walk(&ids(file).collect::<Vec<_>>());
    order
}

fn ids(file: &PvsFile) -> impl Iterator<Item = CellId> {
    (0..file.cells.len() as u32).map(CellId)
}

/// The height of a cell's floor, its area and its height. The floor is the lowest level below a third of the area.
fn floor(mut boxes: Vec<Aabb>) -> Option<[f64; 3]> {
    boxes.retain(|b| b.min.is_finite() && b.max.is_finite());
    boxes.sort_by(|a, b| a.min.y.total_cmp(&b.min.y));
    let area = |b: &Aabb| b.size().x * b.size().z;
    let all: f64 = boxes.iter().map(area).sum();
    let top = boxes.iter().map(|b| b.max.y).fold(f64::NEG_INFINITY, f64::max);
    let mut sum = 0.0;
    let lowest = boxes.iter().find(|b| {
        sum += area(b);
        sum >= all / 3.0
    })?;
    Some([lowest.min.y, all, top - lowest.min.y])
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn cuboid(min: [f64; 3], max: [f64; 3]) -> Aabb {
        Aabb { min: min.into(), max: max.into() }
    }

    #[test]
    fn a_floor_is_what_lies_under_most_of_a_cell() {
        // A room with a pit under a tenth of it.
        let room = vec![cuboid([0., 0., 0.], [9., 3., 10.]), cuboid([9., -1., 0.], [10., 3., 10.])];
        assert_eq!(floor(room), Some([0.0, 100.0, 3.0]));
        assert_eq!(floor(vec![Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY }]), None);
    }
}
