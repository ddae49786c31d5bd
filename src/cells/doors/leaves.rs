//! Splits an object into door leaves: exports often merge all doors of a building by material.
//!
//! Based on: Nagy, Seth, *Hierarchical representation of optically scanned documents*, 1984 (the recursive X-Y cut: cut at gaps, along
//! alternating axes). Deviation: in three dimensions, with the boxes of triangles.

use crate::math::geom::Aabb;

/// Largest gap within one leaf or one window, metres: bars between panes are up to 0.08 m wide, piers between two doors 0.1 m and more.
const APART: f64 = 0.1;
/// Depth of the recursion. Doors along corridors take three.
const DEPTH: usize = 16;

/// Indices of the boxes of each leaf, ascending. O(n log n) for each of the [`DEPTH`]. `metre`: length of a metre.
pub(super) fn leaves(boxes: &[Aabb], metre: f64) -> Vec<Vec<usize>> {
    let mut out = Vec::new();
    if !boxes.is_empty() {
        cut(boxes, (0..boxes.len()).collect(), APART * metre, DEPTH, &mut out);
    }
    out
}

fn cut(boxes: &[Aabb], mut part: Vec<usize>, apart: f64, depth: usize, out: &mut Vec<Vec<usize>>) {
    for axis in if depth == 0 { 0..0 } else { 0..3 } {
        part.sort_by(|&a, &b| boxes[a].min[axis].total_cmp(&boxes[b].min[axis]).then(a.cmp(&b)));
        let mut end = f64::NEG_INFINITY;
        let parts = part.chunk_by(|&a, &b| {
            end = end.max(boxes[a].max[axis]);
            boxes[b].min[axis] - end <= apart
        });
        let parts: Vec<Vec<usize>> = parts.map(<[usize]>::to_vec).collect();
        if parts.len() > 1 {
            parts.into_iter().for_each(|part| cut(boxes, part, apart, depth - 1, out));
            return;
        }
    }
    part.sort_unstable();
    out.push(part);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn leaf(x: f64, y: f64, z: f64) -> Aabb {
        let min = DVec3::new(x, y, z);
        Aabb { min, max: min + DVec3::new(0.9, 2.1, 0.04) }
    }

    #[test]
    fn a_double_door_is_one_and_its_neighbours_are_not() {
        // Two leaves of a double door, one beside them behind a pier, one across the corridor, one above; and a handle of the first.
        let handle = Aabb { min: DVec3::new(0.8, 1.0, -0.05), max: DVec3::new(0.85, 1.1, 0.09) };
        let at = [[0.0, 0.0, 0.0], [0.91, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.5, 3.0, 0.0]];
        let boxes: Vec<Aabb> = at.map(|[x, y, z]| leaf(x, y, z)).into_iter().chain([handle]).collect();
        let mut found = leaves(&boxes, 1.0);
        found.sort();
        assert_eq!(found, [vec![0, 1, 5], vec![2], vec![3], vec![4]]);
        // In another unit.
        let feet: Vec<Aabb> = boxes.iter().map(|b| Aabb { min: b.min / 0.3048, max: b.max / 0.3048 }).collect();
        assert_eq!(leaves(&feet, 1.0 / 0.3048).len(), 4);
        assert!(leaves(&[], 1.0).is_empty());
    }
}
