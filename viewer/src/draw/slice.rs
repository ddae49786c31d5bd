//! Where a plane cuts what is solid: oriented lines, and whether they close.

use glam::{DVec2, DVec3};
use std::borrow::Cow;
use std::collections::HashMap;

/// Ends of lines that are nearer than about this are one, metres: triangles of one edge have them where rounding puts them.
const SAME: f64 = 1e-4;
/// Ends that are left over are taken for one up to here, metres, where an edge of one triangle is two edges of others.
const NEAR: f64 = 1e-3;
/// More open ends are not compared: a mesh with more is not closed.
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

    /// Whether they are the outline of something as they go: as many begin in each point as end there.
    fn is_closed(&self) -> bool {
        let mut ends: HashMap<[i64; 3], (i32, DVec3)> = HashMap::new();
        for (p, by) in self.lines.iter().flat_map(|&[from, to]| [(from, 1), (to, -1)]) {
            ends.entry(key(p)).or_insert((0, p)).0 += by;
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

    /// Triangles that cover what is inside once more than they uncover it, seen from one side. Returns false where the lines don't close.
    pub fn fan(&self, n: DVec3, out: &mut Vec<[DVec3; 3]>) -> bool {
        let lines = if self.is_closed() { Some(Cow::Borrowed(&self.lines)) } else { self.turned(n).map(Cow::Owned) };
        let Some(lines) = lines else { return false };
        let Some(&[middle, _]) = lines.first() else { return true };
        let turn: f64 = lines.iter().map(|[a, b]| n.dot((*a - middle).cross(*b - middle))).sum();
        // Models are wound both ways.
        out.extend(lines.iter().map(|&[a, b]| if turn < 0.0 { [middle, b, a] } else { [middle, a, b] }));
        true
    }

    /// The lines turned around so that they bound what is inside of an odd number of loops: of a thing whose faces are wound at random.
    fn turned(&self, n: DVec3) -> Option<Vec<[DVec3; 2]>> {
        let loops = self.loops()?;
        let (u, v) = (n.any_orthonormal_vector(), n.cross(n.any_orthonormal_vector()));
        let flat = |p: &DVec3| DVec2::new(u.dot(*p), v.dot(*p));
        let flats: Vec<Vec<DVec2>> = loops.iter().map(|ring| ring.iter().map(flat).collect()).collect();
        let mut lines = Vec::new();
        for (i, ring) in loops.iter().enumerate() {
            let around = (0..loops.len()).filter(|&k| k != i && holds(&flats[k], flats[i][0])).count();
            let is_hole = around % 2 == 1;
            let sides = || ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| [*a, *b]);
            let area: f64 = flats[i].iter().zip(flats[i].iter().cycle().skip(1)).map(|(a, b)| a.perp_dot(*b)).sum();
            lines.extend(sides().map(|[a, b]| if (area < 0.0) == is_hole { [a, b] } else { [b, a] }));
        }
        Some(lines)
    }

    /// The lines as loops of points, whichever way each of them goes; `None` where some end.
    fn loops(&self) -> Option<Vec<Vec<DVec3>>> {
        let lines: Vec<[DVec3; 2]> = self.lines.iter().copied().filter(|&[a, b]| key(a) != key(b)).collect();
        let mut at: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for (i, line) in lines.iter().enumerate() {
            line.iter().for_each(|p| at.entry(key(*p)).or_default().push(i));
        }
        let (mut loops, mut is_used) = (Vec::new(), vec![false; lines.len()]);
        for first in 0..lines.len() {
            if std::mem::replace(&mut is_used[first], true) {
                continue;
            }
            let [start, mut end] = lines[first];
            let mut ring = vec![start];
            while key(end) != key(start) {
                ring.push(end);
                let next = at[&key(end)].iter().copied().find(|&i| !is_used[i])?;
                is_used[next] = true;
                let [a, b] = lines[next];
                end = if key(a) == key(end) { b } else { a };
            }
            loops.push(ring);
        }
        Some(loops)
    }
}

fn key(p: DVec3) -> [i64; 3] {
    (p / SAME).round().to_array().map(|x| x as i64)
}

/// Whether a point is inside of a ring.
fn holds(ring: &[DVec2], p: DVec2) -> bool {
    let sides = ring.iter().zip(ring.iter().cycle().skip(1));
    let crosses =
        |(a, b): &(&DVec2, &DVec2)| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * ((p.y - a.y) / (b.y - a.y));
    sides.filter(crosses).count() % 2 == 1
}

/// Where an edge crosses the plane, to the bit the same for both triangles of an edge.
fn crossing([(a, x), (b, y)]: [(DVec3, f64); 2]) -> DVec3 {
    a + (b - a) * (x / (x - y))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: [[usize; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

    /// The lines of a cube from 0 to 1 less some faces; some are turned around.
    fn cut(faces: usize, turns: fn(usize) -> bool, at: f64) -> Slice {
        let p = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64);
        let mut slice = Slice::default();
        for (i, [a, b, c, d]) in CUBE.into_iter().take(faces).enumerate() {
            for [a, b, c] in [[a, b, c], [a, c, d]] {
                let corners = if turns(i) { [p(a), p(c), p(b)] } else { [p(a), p(b), p(c)] };
                slice.add(&Section { n: DVec3::NEG_Y, d: -at }, corners);
            }
        }
        slice
    }

    /// The area of its cap.
    fn capped(slice: &Slice) -> Option<f64> {
        let mut fan = Vec::new();
        let is_closed = slice.fan(DVec3::NEG_Y, &mut fan);
        is_closed.then(|| fan.iter().map(|[a, b, c]| 0.5 * DVec3::NEG_Y.dot((*b - *a).cross(*c - *a))).sum())
    }

    #[test]
    fn a_cube_is_capped_with_its_area_whichever_way_it_is_wound() {
        let ways: [fn(usize) -> bool; 3] = [|_| false, |_| true, |i| i % 2 == 0];
        for turns in ways {
            let area = capped(&cut(6, turns, 0.3)).unwrap();
            assert!((area - 1.0).abs() < 1e-12, "{area}");
        }
        assert_eq!(capped(&cut(6, |_| false, 1.5)), Some(0.0));
    }

    #[test]
    fn a_box_in_a_box_is_a_hole_where_faces_are_wound_at_random() {
        let mut slice = cut(6, |i| i % 2 == 0, 0.3);
        for [a, b] in cut(6, |i| i % 3 == 0, 0.3).lines {
            slice.lines.push([a, b].map(|p| DVec3::new(0.25 + 0.5 * p.x, p.y, 0.25 + 0.5 * p.z)));
        }
        assert!((capped(&slice).unwrap() - 0.75).abs() < 1e-12);
    }

    #[test]
    fn what_is_open_has_no_cap() {
        // The last two faces are sides.
        for faces in [4, 5] {
            assert_eq!(capped(&cut(faces, |_| false, 0.3)), None);
        }
        // An edge of one triangle beside one that is a little off.
        let mut slice = cut(6, |_| false, 0.3);
        slice.lines[0][1] += DVec3::new(0.0, 4e-4, 0.0);
        assert!(slice.is_closed());
        slice.lines[0][1] += DVec3::new(0.0, 4e-3, 0.0);
        assert_eq!(capped(&slice), None);
    }
}
