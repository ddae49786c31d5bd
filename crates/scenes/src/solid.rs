//! Closed meshes: boxes with rectangular holes, extrusions, surfaces of revolution.
//!
//! Every function returns a watertight mesh, counter-clockwise from outside and without T-junctions: neighbouring faces share
//! whole edges. Sines are computed by a polynomial, not by the platform, so that generated files have the same bytes everywhere.

use enfilade::math::geom::Aabb;
use glam::{DVec2, DVec3};

/// A closed mesh, metres.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Solid {
    /// Corners.
    pub(super) positions: Vec<DVec3>,
    /// Indices into them.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Solid {
    fn vertex(&mut self, p: DVec3) -> u32 {
        self.positions.push(p);
        self.positions.len() as u32 - 1
    }

    fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// Adds another solid's surface.
    pub(super) fn append(&mut self, other: &Self) {
        let base = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
    }

    /// Several solids as one mesh.
    pub(super) fn of(parts: &[Self]) -> Self {
        parts.iter().fold(Self::default(), |mut all, part| {
            all.append(part);
            all
        })
    }

    /// The solid, moved.
    pub(super) fn at(mut self, by: DVec3) -> Self {
        for p in &mut self.positions {
            *p += by;
        }
        self
    }

    /// The enclosed volume, cubic metres: positive if the faces point outwards.
    #[cfg(test)]
    pub(super) fn volume(&self) -> f64 {
        let corner = |i: u32| self.positions[i as usize];
        self.triangles.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c)))).sum::<f64>() / 6.0
    }
}

/// Cosine and sine of an angle in turns, from the Taylor series on an eighth of a turn: basic operations only, exact at quarter
/// turns.
pub(super) fn turn(turns: f64) -> (f64, f64) {
    let quarter = (turns * 4.0).round();
    let x = (turns - quarter / 4.0) * std::f64::consts::TAU;
    let (mut cos, mut sin, mut term) = (0.0, 0.0, 1.0);
    for k in 1..=18 {
        match k % 4 {
            1 => cos += term,
            2 => sin += term,
            3 => cos -= term,
            _ => sin -= term,
        }
        term *= x / f64::from(k);
    }
    match quarter.rem_euclid(4.0) as u32 {
        0 => (cos, sin),
        1 => (-sin, cos),
        2 => (-cos, -sin),
        _ => (sin, -cos),
    }
}

/// A box.
pub(super) fn cuboid(min: DVec3, max: DVec3) -> Solid {
    perforated(min, max, 1, &[])
}

/// A box with rectangular holes through it along one axis (0, 1, 2 for x, y, z). A hole's extent along that axis is ignored;
/// holes at the box's rim are open there.
pub(super) fn perforated(min: DVec3, max: DVec3, axis: usize, holes: &[Aabb]) -> Solid {
    let (ua, va) = ((axis + 1) % 3, (axis + 2) % 3);
    let cuts = |a: usize| {
        let mut cuts: Vec<f64> =
            holes.iter().flat_map(|h| [h.min[a], h.max[a]]).filter(|c| (min[a]..max[a]).contains(c)).collect();
        cuts.extend([min[a], max[a]]);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        cuts
    };
    let (us, vs) = (cuts(ua), cuts(va));
    let (nu, nv) = (us.len() - 1, vs.len() - 1);
    let filled = |i: usize, j: usize| {
        // Wraps past the lower rim to a number past the upper one.
        i < nu && j < nv && {
            let (u, v) = ((us[i] + us[i + 1]) / 2.0, (vs[j] + vs[j + 1]) / 2.0);
            !holes.iter().any(|h| h.min[ua] < u && u < h.max[ua] && h.min[va] < v && v < h.max[va])
        }
    };
    let mut solid = Solid::default();
    let mut known = vec![None; 2 * us.len() * vs.len()];
    let mut corner = |solid: &mut Solid, i: usize, j: usize, side: usize| {
        *known[(i * vs.len() + j) * 2 + side].get_or_insert_with(|| {
            let mut p = DVec3::ZERO;
            (p[ua], p[va], p[axis]) = (us[i], vs[j], if side == 0 { min[axis] } else { max[axis] });
            solid.vertex(p)
        })
    };
    for i in 0..nu {
        for j in (0..nv).filter(|&j| filled(i, j)) {
            let (i1, j1) = (i + 1, j + 1);
            let mut face = |corners: [(usize, usize, usize); 4]| {
                let quad = corners.map(|(i, j, side)| corner(&mut solid, i, j, side));
                solid.quad(quad);
            };
            face([(i, j, 1), (i1, j, 1), (i1, j1, 1), (i, j1, 1)]);
            face([(i, j, 0), (i, j1, 0), (i1, j1, 0), (i1, j, 0)]);
            if !filled(i.wrapping_sub(1), j) {
                face([(i, j, 0), (i, j, 1), (i, j1, 1), (i, j1, 0)]);
            }
            if !filled(i1, j) {
                face([(i1, j, 0), (i1, j1, 0), (i1, j1, 1), (i1, j, 1)]);
            }
            if !filled(i, j.wrapping_sub(1)) {
                face([(i, j, 0), (i1, j, 0), (i1, j, 1), (i, j, 1)]);
            }
            if !filled(i, j1) {
                face([(i, j1, 0), (i, j1, 1), (i1, j1, 1), (i1, j1, 0)]);
            }
        }
    }
    solid
}

/// Extrudes a simple polygon along `u x v` by `depth` metres. The outline lies in the plane of `u` and `v` (perpendicular unit
/// vectors) at `origin`, in either orientation, without three consecutive collinear corners.
pub(super) fn extrude(outline: &[DVec2], origin: DVec3, u: DVec3, v: DVec3, depth: f64) -> Solid {
    let n = outline.len() as u32;
    let twice: f64 = (0..outline.len()).map(|i| outline[i].perp_dot(outline[(i + 1) % outline.len()])).sum();
    let turned: Vec<DVec2>;
    let outline = if twice < 0.0 {
        turned = outline.iter().rev().copied().collect();
        &turned[..]
    } else {
        outline
    };
    let mut solid = Solid::default();
    for lift in [DVec3::ZERO, u.cross(v) * depth] {
        for p in outline {
            solid.vertex(origin + u * p.x + v * p.y + lift);
        }
    }
    for [a, b, c] in ears(outline) {
        solid.triangles.extend([[c, b, a], [a + n, b + n, c + n]]);
    }
    for a in 0..n {
        let b = (a + 1) % n;
        solid.quad([a, b, b + n, a + n]);
    }
    solid
}

/// Triangulates a simple counter-clockwise polygon by ear clipping (G. Meisters, *Polygons have ears*, 1975).
fn ears(outline: &[DVec2]) -> Vec<[u32; 3]> {
    let mut left: Vec<u32> = (0..outline.len() as u32).collect();
    let mut out = Vec::with_capacity(outline.len().saturating_sub(2));
    let turn = |a: u32, b: u32, c: u32| {
        let [a, b, c] = [a, b, c].map(|i| outline[i as usize]);
        (b - a).perp_dot(c - a)
    };
    while left.len() > 3 {
        let n = left.len();
        let ear = (0..n).find(|&i| {
            let (a, b, c) = (left[(i + n - 1) % n], left[i], left[(i + 1) % n]);
            turn(a, b, c) > 0.0
                && left.iter().all(|&p| {
                    [a, b, c].contains(&p) || !(turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0)
                })
        });
        let i = ear.expect("a simple polygon has an ear");
        out.push([left[(i + n - 1) % n], left[i], left[(i + 1) % n]]);
        left.remove(i);
    }
    out.push([left[0], left[1], left[2]]);
    out
}

/// Joins rings of points, each a single point or all of one length, into a closed surface. Seen from outside, rings go upwards if
/// their points are anticlockwise seen from below. The first and last rings are single points, or else the last is joined to the
/// first.
pub(super) fn loft(rings: &[Vec<DVec3>]) -> Solid {
    let n = rings.iter().map(Vec::len).max().unwrap_or(0) as u32;
    let mut solid = Solid::default();
    let starts: Vec<u32> = rings
        .iter()
        .map(|ring| {
            let start = solid.positions.len() as u32;
            solid.positions.extend(ring);
            start
        })
        .collect();
    let joined = rings.first().is_some_and(|r| r.len() > 1);
    for i in 0..rings.len() - usize::from(!joined) {
        let j = (i + 1) % rings.len();
        let at = |ring: usize, k: u32| starts[ring] + if rings[ring].len() == 1 { 0 } else { k % n };
        for k in 0..n {
            let quad = [at(i, k), at(j, k), at(j, k + 1), at(i, k + 1)];
            if quad[1] == quad[2] {
                solid.triangles.push([quad[0], quad[1], quad[3]]);
            } else if quad[0] == quad[3] {
                solid.triangles.push([quad[0], quad[1], quad[2]]);
            } else {
                solid.quad(quad);
            }
        }
    }
    solid
}

/// Revolves a profile of (radius, height) about the y axis. The profile goes up the outside; it starts and ends on the axis
/// (radius 0) or is closed.
pub(super) fn lathe(profile: &[(f64, f64)], segments: u32) -> Solid {
    let rings: Vec<Vec<DVec3>> = profile
        .iter()
        .map(|&(r, y)| {
            if r == 0.0 {
                return vec![DVec3::new(0.0, y, 0.0)];
            }
            (0..segments)
                .map(|k| {
                    let (cos, sin) = turn(f64::from(k) / f64::from(segments));
                    DVec3::new(r * cos, y, r * sin)
                })
                .collect()
        })
        .collect();
    loft(&rings)
}

/// A closed pipe along +x from the origin.
pub(super) fn pipe(length: f64, radius: f64, sides: u32) -> Solid {
    let ring = |x: f64| -> Vec<DVec3> {
        let corner = |k: u32| {
            let (cos, sin) = turn(f64::from(k) / f64::from(sides));
            DVec3::new(x, radius * sin, radius * cos)
        };
        (0..sides).map(corner).collect()
    };
    loft(&[vec![DVec3::ZERO], ring(0.0), ring(length), vec![DVec3::new(length, 0.0, 0.0)]])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// Every directed edge has its opposite exactly once: closed and consistently oriented.
    pub(crate) fn assert_closed(solid: &Solid, what: &str) {
        let mut edges = BTreeMap::new();
        for t in &solid.triangles {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                *edges.entry((a, b)).or_insert(0) += 1;
            }
        }
        for (&(a, b), &count) in &edges {
            assert_eq!((count, edges.get(&(b, a))), (1, Some(&1)), "{what}: edge {a} {b}");
        }
        assert!(solid.volume() > 0.0, "{what}: wound inwards");
    }

    #[test]
    fn turn_is_the_sine_and_cosine_and_exact_at_quarters() {
        for k in -40..40 {
            let t = f64::from(k) * 0.037;
            let (c, s) = turn(t);
            let a = t * std::f64::consts::TAU;
            assert!((c - a.cos()).abs() < 1e-14 && (s - a.sin()).abs() < 1e-14, "{t}");
        }
        assert_eq!([turn(0.0), turn(0.25), turn(0.5), turn(0.75)], [(1., 0.), (-0., 1.), (-1., -0.), (0., -1.)]);
    }

    #[test]
    fn a_wall_with_a_door_and_a_window_is_closed_and_of_the_right_volume() {
        for axis in 0..3 {
            let size = DVec3::new(5.0, 4.0, 3.0);
            let hole = |a: f64, b: f64, c: f64, d: f64| {
                let (mut min, mut max) = (DVec3::ZERO, DVec3::ZERO);
                (min[(axis + 1) % 3], max[(axis + 1) % 3], min[(axis + 2) % 3], max[(axis + 2) % 3]) = (a, b, c, d);
                Aabb { min, max }
            };
            let solid = perforated(DVec3::ZERO, size, axis, &[hole(0.0, 2.0, 0.5, 1.0), hole(1.0, 1.5, 1.5, 2.5)]);
            assert_closed(&solid, "wall");
            assert!((solid.volume() - (60.0 - 1.5 * size[axis])).abs() < 1e-12);
        }
    }

    #[test]
    fn extrusions_and_revolutions_are_closed_and_of_the_right_volume() {
        let l = [(0., 0.), (2., 0.), (2., 1.), (1., 1.), (1., 3.), (0., 3.)].map(|(x, y)| DVec2::new(x, y));
        let solid = extrude(&l, DVec3::ONE, DVec3::X, DVec3::Y, 0.5);
        assert_closed(&solid, "L");
        assert!((solid.volume() - 2.0).abs() < 1e-12);

        let (r, h, n) = (0.5, 2.0, 24);
        let cylinder = lathe(&[(0.0, 0.0), (r, 0.0), (r, h), (0.0, h)], n);
        assert_closed(&cylinder, "cylinder");
        let area = f64::from(n) / 2.0 * r * r * (std::f64::consts::TAU / f64::from(n)).sin();
        assert!((cylinder.volume() - area * h).abs() < 1e-12);

        let ring = lathe(&[(1.0, 0.0), (1.0, 1.0), (0.5, 1.0), (0.5, 0.0)], n);
        assert_closed(&ring, "ring");
        assert!((ring.volume() - 3.0 * area).abs() < 1e-12);
    }

    #[test]
    fn pipes_are_closed_and_of_the_right_volume() {
        let solid = pipe(3.0, 0.5, 24);
        assert_closed(&solid, "pipe");
        let area = 12.0 * 0.25 * (std::f64::consts::TAU / 24.0).sin();
        assert!((solid.volume() - 3.0 * area).abs() < 1e-12);
    }
}
