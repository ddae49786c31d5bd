//! The convex hull of a room's bound, for bounds that are not closed: Godot always uses the hull.
//!
//! Based on: the incremental construction of Clarkson, Shor, *Applications of random sampling in computational geometry*, 1989,
//! without its conflict graph: bounds have tens of corners.

use glam::DVec3;
use robust::{Coord3D, orient3d};
use std::collections::{HashMap, HashSet};

/// Maximum distinct corners of a hull.
const MOST: usize = 2_000;

/// Whether every edge is shared by an even number of triangles.
pub(super) fn is_closed(surface: &[[DVec3; 3]]) -> bool {
    // Adding zero makes -0.0 and 0.0 one.
    let key = |p: DVec3| (p + 0.0).to_array().map(f64::to_bits);
    let mut odd: HashSet<[[u64; 3]; 2]> = HashSet::new();
    for t in surface {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let (a, b) = (key(a), key(b));
            let edge = [a.min(b), a.max(b)];
            if a != b && !odd.remove(&edge) {
                odd.insert(edge);
            }
        }
    }
    odd.is_empty()
}

/// The hull's triangles, facing out; `None` if the corners lie in a plane or are too many.
pub(super) fn convex_hull(surface: &[[DVec3; 3]]) -> Option<Vec<[DVec3; 3]>> {
    let mut points: Vec<DVec3> = surface.iter().flatten().copied().collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    points.dedup();
    if points.len() < 4 || points.len() > MOST {
        return None;
    }
    let coord = |i: usize| Coord3D { x: points[i].x, y: points[i].y, z: points[i].z };
    // Positive where `d` is behind the triangle: it faces away from `d`.
    let behind = |[a, b, c]: [usize; 3], d: usize| orient3d(coord(a), coord(b), coord(c), coord(d));
    // The first tetrahedron: distant corners, not flat.
    let farthest = |measure: &dyn Fn(usize) -> f64| {
        (0..points.len()).map(|i| (measure(i), i)).reduce(|a, b| if b.0 > a.0 { b } else { a }).filter(|m| m.0 > 0.0)
    };
    let (a, b) = (0, farthest(&|i| points[i].distance(points[0]))?.1);
    let line = points[b] - points[a];
    let c = farthest(&|i| line.cross(points[i] - points[a]).length())?.1;
    let d = farthest(&|i| behind([a, b, c], i).abs())?.1;
    let mut faces: Vec<[usize; 3]> = [([a, b, c], d), ([a, b, d], c), ([a, c, d], b), ([b, c, d], a)]
        .map(|([p, q, r], inner)| if behind([p, q, r], inner) > 0.0 { [p, q, r] } else { [p, r, q] })
        .to_vec();
    for p in 0..points.len() {
        let (seen, kept): (Vec<_>, Vec<_>) = faces.into_iter().partition(|&f| behind(f, p) < 0.0);
        faces = kept;
        // The horizon: edges between faces that `p` sees and faces that it does not.
        let mut horizon: HashMap<[usize; 2], [usize; 2]> = HashMap::new();
        for [i, j, k] in seen {
            for [from, to] in [[i, j], [j, k], [k, i]] {
                if horizon.remove(&[to, from]).is_none() {
                    horizon.insert([from, to], [from, to]);
                }
            }
        }
        let mut edges: Vec<[usize; 2]> = horizon.into_values().collect();
        edges.sort_unstable();
        faces.extend(edges.into_iter().map(|[from, to]| [from, to, p]));
    }
    Some(faces.into_iter().map(|f| f.map(|i| points[i])).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(surface: &[[DVec3; 3]]) -> f64 {
        surface.iter().map(|[a, b, c]| a.cross(*b).dot(*c) / 6.0).sum()
    }

    #[test]
    fn the_hull_of_a_box_without_a_lid_is_the_box() {
        let c = |i: usize| DVec3::new((i & 1) as f64 * 4.0, (i >> 1 & 1) as f64 * 3.0, (i >> 2 & 1) as f64 * 5.0);
        let sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [0, 2, 6, 4], [1, 5, 7, 3]];
        let mut open: Vec<[DVec3; 3]> =
            sides.iter().flat_map(|q| [[c(q[0]), c(q[1]), c(q[2])], [c(q[0]), c(q[2]), c(q[3])]]).collect();
        assert!(!is_closed(&open));
        // A corner inside, and one in the middle of a side, change nothing.
        open.push([DVec3::new(1., 1., 1.), DVec3::new(2., 0., 2.5), c(0)]);
        let hull = convex_hull(&open).unwrap();
        assert!(is_closed(&hull) && (volume(&hull) - 60.0).abs() < 1e-9, "{}", volume(&hull));
        assert_eq!(convex_hull(&open[..2]), None);
    }
}
