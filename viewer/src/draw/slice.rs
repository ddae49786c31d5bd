//! Where a plane cuts what is solid: oriented lines, and whether they close.

use glam::DVec3;
use std::collections::HashMap;

/// Ends of lines that are nearer than about this are one, metres: triangles of one edge have them where rounding puts them.
const SAME: f64 = 1e-4;
/// Ends that are left over are taken for one up to here, metres, where an edge of one triangle is two edges of others.
const NEAR: f64 = 1e-3;
/// More ends are not compared one by one: something with so many open ends is no solid.
const MOST: usize = 200;

/// The lines in which a plane cuts a thing, each from one end to the other, with the solid on one side all along.
#[derive(Clone, Default, Debug)]
pub struct Slice {
    lines: Vec<[DVec3; 2]>,
}

/// A plane; what is kept of the scene is where `n . p >= d`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Section {
    /// A unit vector.
    pub n: DVec3,
    /// Metres.
    pub d: f64,
}

impl Section {
    /// How far a point is on the side that is kept, metres.
    pub fn before(&self, p: DVec3) -> f64 {
        self.n.dot(p) - self.d
    }
}

impl Slice {
    /// Adds the line in which the plane cuts a triangle.
    pub fn add(&mut self, section: &Section, corners: [DVec3; 3]) {
        let before = corners.map(|p| section.before(p));
        let (mut from, mut to) = (None, None);
        for (i, k) in [(0, 1), (1, 2), (2, 0)] {
            match (before[i] >= 0.0, before[k] >= 0.0) {
                (true, false) => from = Some(crossing([(corners[i], before[i]), (corners[k], before[k])])),
                (false, true) => to = Some(crossing([(corners[k], before[k]), (corners[i], before[i])])),
                _ => {}
            }
        }
        self.lines.extend(from.zip(to).map(|(from, to)| [from, to]));
    }

    /// The lines of two things.
    pub fn append(&mut self, mut other: Self) {
        self.lines.append(&mut other.lines);
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Whether they are the outline of something: as many begin in each point as end there.
    pub fn is_closed(&self) -> bool {
        let mut ends: HashMap<[i64; 3], (i32, DVec3)> = HashMap::new();
        for (p, by) in self.lines.iter().flat_map(|&[from, to]| [(from, 1), (to, -1)]) {
            let key = (p / SAME).round().to_array().map(|x| x as i64);
            ends.entry(key).or_insert((0, p)).0 += by;
        }
        let mut rest: Vec<(i32, DVec3)> = ends.into_values().filter(|(n, _)| *n != 0).collect();
        if rest.len() > MOST {
            return false;
        }
        while let Some((n, p)) = rest.pop() {
            let near = |(m, q): &(i32, DVec3)| m.signum() == -n.signum() && p.distance(*q) < NEAR;
            let Some(other) = rest.iter_mut().find(|other| near(other)) else { return false };
            other.0 += n;
            rest.retain(|(n, _)| *n != 0);
        }
        true
    }

    /// Triangles that cover what is inside, once more than they uncover it, seen from one side; for lines that close.
    pub fn fan(&self, n: DVec3, out: &mut Vec<[DVec3; 3]>) {
        let Some(&[middle, _]) = self.lines.first() else { return };
        let turn: f64 = self.lines.iter().map(|[a, b]| n.dot((*a - middle).cross(*b - middle))).sum();
        // Models are wound both ways.
        out.extend(self.lines.iter().map(|&[a, b]| if turn < 0.0 { [middle, b, a] } else { [middle, a, b] }));
    }
}

/// Where an edge crosses the plane, to the bit the same for both triangles of an edge.
fn crossing([(a, x), (b, y)]: [(DVec3, f64); 2]) -> DVec3 {
    a + (b - a) * (x / (x - y))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: [[usize; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

    /// The lines of a cube from 0 to 1 less some faces; `inside_out` turns all faces around.
    fn cut(faces: usize, inside_out: bool, at: f64) -> Slice {
        let p = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        let mut slice = Slice::default();
        for [a, b, c, d] in CUBE.into_iter().take(faces) {
            for [a, b, c] in [[a, b, c], [a, c, d]] {
                let corners = if inside_out { [p(a), p(c), p(b)] } else { [p(a), p(b), p(c)] };
                slice.add(&Section { n: DVec3::NEG_Y, d: -at }, corners);
            }
        }
        slice
    }

    #[test]
    fn a_cube_is_capped_with_its_area_whichever_way_it_is_wound() {
        for inside_out in [false, true] {
            let slice = cut(6, inside_out, 0.3);
            assert!(slice.is_closed());
            let mut fan = Vec::new();
            slice.fan(DVec3::NEG_Y, &mut fan);
            let area: f64 = fan.iter().map(|[a, b, c]| 0.5 * DVec3::NEG_Y.dot((*b - *a).cross(*c - *a))).sum();
            assert!((area - 1.0).abs() < 1e-12, "{area}");
        }
        assert!(cut(6, false, 1.5).is_empty());
    }

    #[test]
    fn what_is_open_has_no_cap() {
        // The last two faces are sides.
        assert!(!cut(5, false, 0.3).is_closed() && !cut(4, false, 0.3).is_closed());
        // An edge of two parts beside one of one.
        let mut slice = cut(6, false, 0.3);
        slice.lines[0][1] += DVec3::new(4e-4, 0.0, 0.0);
        assert!(slice.is_closed());
        slice.lines[0][1] += DVec3::new(4e-3, 0.0, 0.0);
        assert!(!slice.is_closed());
    }
}
