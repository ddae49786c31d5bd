//! The triangles of a tile, by its samples.
//!
//! Sample `(i, j)` is `i` to the east and `j` to the south. All diagonals have one direction, from `(i + 1, j)` to `(i, j + 1)`,
//! so a triangle of a coarser level is a union of triangles of each finer one. Along a side with a coarser neighbour, each second
//! sample moves onto one beside it: this leaves the neighbour's own corners and no gap. On the northern and western sides it
//! moves to the one before, on the others to the one after; else the south-eastern corner would have a sample on the middle of an
//! edge. (Losasso, Hoppe, 2004, have the same degenerate triangles; the thesis with these tiles uses index lists for equal ones.)

use super::grid::Side;

/// A sample of a tile: to the east, to the south.
pub type Sample = [u32; 2];

/// The drawn place of a sample, with `coarser` (bits of [`Side`]) neighbours.
pub fn snapped([i, j]: Sample, side: u32, coarser: u8) -> Sample {
    let last = side - 1;
    let is_coarser = |side: Side| coarser & side.bit() != 0;
    // Corners of the tile are even, and do not move.
    let along = |k: u32, across: u32, first: Side, second: Side| {
        if across == 0 && is_coarser(first) {
            k & !1
        } else if across == last && is_coarser(second) {
            k + (k & 1)
        } else {
            k
        }
    };
    [along(i, j, Side::North, Side::South), along(j, i, Side::West, Side::East)]
}

/// The two triangles of a cell, counter-clockwise from above.
pub fn of_cell(i: u32, j: u32) -> [[Sample; 3]; 2] {
    let [a, b, c, d] = [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]];
    [[a, c, b], [b, c, d]]
}

/// The triangles of a cell as drawn, without degenerate ones.
pub fn drawn(i: u32, j: u32, side: u32, coarser: u8) -> impl Iterator<Item = [Sample; 3]> {
    let moved = move |triangle: [Sample; 3]| triangle.map(|s| snapped(s, side, coarser));
    of_cell(i, j).into_iter().map(moved).filter(|[a, b, c]| a != b && b != c && c != a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Twice the area, positive if counter-clockwise from above (south is to the right of east).
    fn area([a, b, c]: [Sample; 3]) -> i64 {
        let [ax, ay, bx, by, cx, cy] = [a[0], a[1], b[0], b[1], c[0], c[1]].map(i64::from);
        (by - ay) * (cx - ax) - (bx - ax) * (cy - ay)
    }

    /// With any coarser neighbours, the triangles cover the square once, and inner edges belong to two of them.
    #[test]
    fn a_tile_is_covered_once_whatever_its_neighbours() {
        let side = 9;
        for coarser in 0..16u8 {
            let cells = (0..side - 1).flat_map(|j| (0..side - 1).map(move |i| (i, j)));
            let triangles: Vec<_> = cells.flat_map(|(i, j)| drawn(i, j, side, coarser)).collect();
            assert!(triangles.iter().all(|&t| area(t) > 0), "a triangle is turned over");
            assert_eq!(triangles.iter().map(|&t| area(t)).sum::<i64>(), 2 * 64);
            let mut edges: HashMap<_, i32> = HashMap::new();
            for [a, b, c] in triangles {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    *edges.entry((from, to)).or_default() += 1;
                }
            }
            let on_rim = |[i, j]: Sample, [k, l]: Sample| (i == k && (i == 0 || i == 8)) || (j == l && (j == 0 || j == 8));
            for (&(from, to), &count) in &edges {
                assert_eq!(count, 1);
                assert!(on_rim(from, to) || edges.contains_key(&(to, from)), "{from:?} to {to:?} with {coarser:04b}");
            }
        }
    }
}
