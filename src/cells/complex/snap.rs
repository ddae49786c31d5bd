//! Snap rounding: edges between corners of a grid become edges that meet at corners only.
//!
//! Every corner and every crossing makes its grid square hot, and an edge is routed through the centres of the hot squares that it passes.
//! No edge moves by more than one square, and none cross afterwards, however nearly parallel they are. (Hobby 1999; Guibas and Marimont
//! 1998.)

use std::collections::{BTreeSet, HashMap};

/// A corner, in steps of the grid.
pub type Corner = (i64, i64);

/// Replaces `edges` between `corners` by edges that meet only in corners; crossings are appended to `corners`.
pub fn snap_round(corners: &mut Vec<Corner>, edges: &[[usize; 2]]) -> Vec<[usize; 2]> {
    let size = tile_size(corners, edges);
    let mut number: HashMap<Corner, usize> = corners.iter().enumerate().map(|(i, c)| (*c, i)).collect();
    let mut beside: HashMap<Corner, Vec<u32>> = HashMap::new();
    for (i, [a, b]) in edges.iter().enumerate() {
        for tile in tiles(corners[*a], corners[*b], size) {
            beside.entry(tile).or_default().push(i as u32);
        }
    }
    let mut crossings = BTreeSet::new();
    for near in beside.values() {
        for (k, &i) in near.iter().enumerate() {
            for &j in &near[k + 1..] {
                crossings.extend(crossing(edges[i as usize].map(|c| corners[c]), edges[j as usize].map(|c| corners[c])));
            }
        }
    }
    for at in crossings {
        number.entry(at).or_insert_with(|| {
            corners.push(at);
            corners.len() - 1
        });
    }
    let mut hot: HashMap<Corner, Vec<usize>> = HashMap::new();
    for (i, c) in corners.iter().enumerate() {
        hot.entry((c.0.div_euclid(size), c.1.div_euclid(size))).or_default().push(i);
    }
    let mut rounded = BTreeSet::new();
    let mut path: Vec<usize> = Vec::new();
    for [a, b] in edges {
        let (from, to) = (corners[*a], corners[*b]);
        path.clear();
        let near = tiles(from, to, size).filter_map(|tile| hot.get(&tile)).flatten();
        path.extend(near.copied().filter(|&i| passes(from, to, corners[i])));
        // A straight line is monotone in both coordinates, and so are the squares that it passes.
        let (dx, dy) = ((to.0 - from.0).signum(), (to.1 - from.1).signum());
        path.sort_by_key(|&i| (dx * corners[i].0, dy * corners[i].1));
        rounded.extend(path.windows(2).map(|w| [w[0].min(w[1]), w[0].max(w[1])]));
    }
    rounded.into_iter().collect()
}

/// Side of the hash tiles for edges and corners: near the mean extent of an edge.
fn tile_size(corners: &[Corner], edges: &[[usize; 2]]) -> i64 {
    let extent = |[a, b]: &[usize; 2]| {
        let (a, b) = (corners[*a], corners[*b]);
        i128::from((a.0 - b.0).abs().max((a.1 - b.1).abs()))
    };
    let total: i128 = edges.iter().map(extent).sum();
    (total / edges.len().max(1) as i128) as i64 + 2
}

/// The tiles within one square of a line from `a` to `b`.
fn tiles(a: Corner, b: Corner, size: i64) -> impl Iterator<Item = Corner> {
    let tile = move |v: i64| v.div_euclid(size);
    // Height of the line at `x`, or at its nearer end; any point if the line is vertical.
    let height = move |x: i64| {
        let x = x.clamp(a.0.min(b.0), a.0.max(b.0));
        let rise = i128::from(x - a.0) * i128::from(b.1 - a.1);
        a.1 + rise.div_euclid(i128::from(b.0 - a.0)) as i64
    };
    (tile(a.0.min(b.0) - 1)..=tile(a.0.max(b.0) + 1)).flat_map(move |i| {
        let [y, z] = if a.0 == b.0 { [a.1, b.1] } else { [i * size - 1, (i + 1) * size + 1].map(height) };
        (tile(y.min(z) - 2)..=tile(y.max(z) + 2)).map(move |j| (i, j))
    })
}

/// Twice the area of the triangle of `a`, `b` and `c`; its sign says on which side of the line `c` is.
fn side(a: Corner, b: Corner, c: Corner) -> i128 {
    let wide = |v: i64, w: i64| i128::from(v) - i128::from(w);
    wide(b.0, a.0) * wide(c.1, a.1) - wide(b.1, a.1) * wide(c.0, a.0)
}

/// The square that contains the crossing of two edges between their ends.
fn crossing([a, b]: [Corner; 2], [c, d]: [Corner; 2]) -> Option<Corner> {
    let (at_c, at_d) = (side(a, b, c), side(a, b, d));
    let (at_a, at_b) = (side(c, d, a), side(c, d, b));
    if at_c.signum() * at_d.signum() >= 0 || at_a.signum() * at_b.signum() >= 0 {
        return None;
    }
    // `a` moved by at_a / (at_a - at_b) of the edge, rounded down from the half.
    let (over, under) = if at_a > at_b { (at_a, at_a - at_b) } else { (-at_a, at_b - at_a) };
    let round = |from: i64, to: i64| {
        let step = 2 * over * (i128::from(to) - i128::from(from)) + under;
        from + step.div_euclid(2 * under) as i64
    };
    Some((round(a.0, b.0), round(a.1, b.1)))
}

/// Whether the line from `a` to `b` passes the square around `c`. Squares include their lower and left rim (symbolic perturbation: an
/// infinitesimal shift left, and a smaller one down), so that no line touches a square's corner.
fn passes(a: Corner, b: Corner, c: Corner) -> bool {
    let within = |v: i64, p: i64, q: i64| p.min(q) <= v && v <= p.max(q);
    if !within(c.0, a.0, b.0) || !within(c.1, a.1, b.1) {
        return false;
    }
    let (dx, dy) = (i128::from(b.0) - i128::from(a.0), i128::from(b.1) - i128::from(a.1));
    let middle = 2 * side(a, b, c);
    let corner = |x: i128, y: i128| match middle + dx * y - dy * x {
        0 if dy != 0 => dy.signum(),
        0 => -dx.signum(),
        side => side.signum(),
    };
    let first = corner(-1, -1);
    [(1, -1), (1, 1), (-1, 1)].iter().any(|&(x, y)| corner(x, y) != first)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Prng;

    /// No corner lies within an edge, no two edges cross.
    fn is_planar(corners: &[Corner], edges: &[[usize; 2]]) -> bool {
        let ends = |e: &[usize; 2]| e.map(|c| corners[c]);
        let within = |c: &Corner, [a, b]: [Corner; 2]| {
            let between = |v: i64, p: i64, q: i64| p.min(q) <= v && v <= p.max(q);
            side(a, b, *c) == 0 && between(c.0, a.0, b.0) && between(c.1, a.1, b.1) && *c != a && *c != b
        };
        edges.iter().enumerate().all(|(i, e)| {
            corners.iter().all(|c| !within(c, ends(e)))
                && edges[i + 1..].iter().all(|f| crossing(ends(e), ends(f)).is_none())
        })
    }

    #[test]
    fn two_edges_that_cross_meet_in_the_square_of_their_crossing() {
        let mut corners = vec![(0, 0), (10, 4), (0, 5), (10, 0)];
        let edges = snap_round(&mut corners, &[[0, 1], [2, 3]]);
        // At (50 / 9, 20 / 9).
        assert_eq!(corners[4], (6, 2));
        assert_eq!(edges, [[0, 4], [1, 4], [2, 4], [3, 4]]);
    }

    #[test]
    fn a_corner_that_an_edge_passes_by_less_than_half_a_square_divides_it() {
        let mut corners = vec![(0, 0), (100, 1), (30, 0), (70, 1)];
        let edges = snap_round(&mut corners, &[[0, 1]]);
        assert_eq!(edges, [[0, 2], [1, 3], [2, 3]]);
    }

    /// Many nearly parallel lines, on a grid so coarse that most crossings coincide.
    #[test]
    fn bundles_of_nearly_parallel_lines_become_planar() {
        let mut random = Prng::new(57, 0);
        let mut below = |n: usize| random.below(n) as i64;
        for (lines, width, height) in [(40, 2000, 6), (60, 30, 30), (30, 1_000_000_000, 3), (25, 1, 40)] {
            let mut corners = Vec::new();
            let mut number = HashMap::new();
            let mut edges = BTreeSet::new();
            for _ in 0..lines {
                let [a, b] = [(below(width), below(height)), (below(width), below(height))].map(|c| {
                    *number.entry(c).or_insert_with(|| {
                        corners.push(c);
                        corners.len() - 1
                    })
                });
                if a != b {
                    edges.insert([a.min(b), a.max(b)]);
                }
            }
            let edges: Vec<_> = edges.into_iter().collect();
            let rounded = snap_round(&mut corners, &edges);
            assert!(is_planar(&corners, &rounded), "{lines} lines of {width} x {height}");
        }
    }
}
