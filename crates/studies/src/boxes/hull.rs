//! The convex hull of points, without errors: which side of a plane a point is on is decided exactly.
//!
//! Based on: Barber, Dobkin, Huhdanpaa, *The quickhull algorithm for convex hulls*, 1996. Deviation: with exact predicates (Shewchuk
//! 1997) there are no thick facets to merge; a point in a face's plane counts as not seeing it. Points that are all in a plane, to the
//! last bit, have a flat hull; on a line, none.

use super::outer;
use glam::{DMat3, DVec2, DVec3};
use robust::{Coord, Coord3D, orient2d, orient3d};
use std::collections::HashMap;

/// A convex hull.
#[derive(Clone, PartialEq, Debug)]
pub struct Hull {
    /// Its corners; all points, where they are on a line.
    pub points: Vec<DVec3>,
    /// Its surface, counter-clockwise from outside, as corners in `points`; of a flat hull, one side; of a line, nothing.
    pub triangles: Vec<[u32; 3]>,
}

impl Hull {
    /// Of one point or more.
    pub fn new(points: &[DVec3]) -> Self {
        let triangles = solid(points).or_else(|| flat(points)).unwrap_or_default();
        if triangles.is_empty() {
            return Self { points: points.to_vec(), triangles };
        }
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let place = |i: u32| used.partition_point(|&u| u < i) as u32;
        Self {
            points: used.iter().map(|&i| points[i as usize]).collect(),
            triangles: triangles.iter().map(|t| t.map(place)).collect(),
        }
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|i| self.points[i as usize])
    }

    /// Covariance of its surface, each part weighted by its area; of its points, where it has none.
    pub(super) fn spread(&self) -> DMat3 {
        let (mut area, mut mean) = (0.0, DVec3::ZERO);
        let origin = self.points[0];
        let parts = || {
            (0..self.triangles.len()).map(|t| {
                let [a, b, c] = self.corners(t).map(|p| p - origin);
                ((b - a).cross(c - a).length(), a, b, c)
            })
        };
        for (twice, a, b, c) in parts() {
            area += twice;
            mean += (a + b + c) * (twice / 3.0);
        }
        if area <= 0.0 {
            return super::spread(&self.points);
        }
        mean /= area;
        let integral = parts().fold(DMat3::ZERO, |sum, (twice, a, b, c)| {
            let [a, b, c] = [a - mean, b - mean, c - mean];
            sum + (outer(a + b + c) + outer(a) + outer(b) + outer(c)) * (twice / 12.0)
        });
        integral * (1.0 / area)
    }
}

/// A face yet to be finished, with the points that see it.
struct Face {
    corners: [u32; 3],
    outside: Vec<u32>,
    alive: bool,
}

/// The faces of a hull with volume.
fn solid(points: &[DVec3]) -> Option<Vec<[u32; 3]>> {
    let start = simplex(points)?;
    let mut faces: Vec<Face> = Vec::new();
    // By directed edge, the face that it is of.
    let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
    let all: Vec<u32> = (0..points.len() as u32).collect();
    let [a, b, c, d] = start;
    add(points, [[a, b, c], [a, d, b], [b, d, c], [c, d, a]], all, &mut faces, &mut edges);
    let mut next = 0;
    let (mut seen, mut horizon) = (Vec::new(), Vec::new());
    while next < faces.len() {
        if !faces[next].alive || faces[next].outside.is_empty() {
            next += 1;
            continue;
        }
        // 1. Of the points that see this face, the farthest.
        let [a, b, c] = faces[next].corners.map(|i| points[i as usize]);
        let normal = (b - a).cross(c - a);
        let height = |&i: &u32| normal.dot(points[i as usize] - a);
        let &apex = faces[next].outside.iter().max_by(|x, y| height(x).total_cmp(&height(y)).then(y.cmp(x)))?;
        // 2. All faces that it sees, and the edges around them.
        seen.clear();
        horizon.clear();
        faces[next].alive = false;
        seen.push(next as u32);
        let mut at = 0;
        while at < seen.len() {
            let corners = faces[seen[at] as usize].corners;
            at += 1;
            for k in 0..3 {
                let edge = [corners[k], corners[(k + 1) % 3]];
                let beside = edges[&[edge[1], edge[0]]];
                if !faces[beside as usize].alive {
                    continue;
                }
                if sees(points, apex, faces[beside as usize].corners) {
                    faces[beside as usize].alive = false;
                    seen.push(beside);
                } else {
                    horizon.push(edge);
                }
            }
        }
        // 3. A cone from there instead.
        let mut orphans = Vec::new();
        for &face in &seen {
            orphans.append(&mut faces[face as usize].outside);
        }
        orphans.retain(|&i| i != apex);
        add(points, horizon.iter().map(|&[a, b]| [a, b, apex]), orphans, &mut faces, &mut edges);
    }
    Some(faces.iter().filter(|f| f.alive).map(|f| f.corners).collect())
}

/// Adds faces and hands each of the points to the first that it sees.
fn add(
    points: &[DVec3],
    new: impl IntoIterator<Item = [u32; 3]>,
    orphans: Vec<u32>,
    faces: &mut Vec<Face>,
    edges: &mut HashMap<[u32; 2], u32>,
) {
    let first = faces.len();
    for corners in new {
        for k in 0..3 {
            edges.insert([corners[k], corners[(k + 1) % 3]], faces.len() as u32);
        }
        faces.push(Face { corners, outside: Vec::new(), alive: true });
    }
    for orphan in orphans {
        if let Some(face) = faces[first..].iter_mut().find(|f| sees(points, orphan, f.corners)) {
            face.outside.push(orphan);
        }
    }
}

/// Whether a point is strictly in front of a face.
fn sees(points: &[DVec3], point: u32, corners: [u32; 3]) -> bool {
    let [a, b, c] = corners.map(|i| coord(points[i as usize]));
    // Above zero where the last lies below, seen with the others counter-clockwise.
    orient3d(a, b, c, coord(points[point as usize])) < 0.0
}

fn coord(p: DVec3) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// Three points that aren't on a line, as far apart as a greedy choice makes them.
fn triangle(points: &[DVec3]) -> Option<[u32; 3]> {
    let a = 0;
    let farthest = |of: &dyn Fn(DVec3) -> f64| {
        let best = points.iter().map(|&p| of(p)).enumerate().max_by(|x, y| x.1.total_cmp(&y.1).then(y.0.cmp(&x.0)));
        best.filter(|b| b.1 > 0.0).map(|b| b.0)
    };
    let b = farthest(&|p| p.distance_squared(points[a]))?;
    let along = points[b] - points[a];
    let c = farthest(&|p| along.cross(p - points[a]).length_squared())?;
    Some([a, b, c].map(|i| i as u32))
}

/// Four points that aren't in a plane, so ordered that the first three are counter-clockwise from outside.
fn simplex(points: &[DVec3]) -> Option<[u32; 4]> {
    let [a, b, c] = triangle(points)?;
    let [pa, pb, pc] = [a, b, c].map(|i| coord(points[i as usize]));
    let side = |p: DVec3| orient3d(pa, pb, pc, coord(p));
    let far = points.iter().map(|&p| side(p)).enumerate().max_by(|x, y| x.1.abs().total_cmp(&y.1.abs()).then(y.0.cmp(&x.0)));
    let (d, height) = far.filter(|f| f.1 != 0.0)?;
    Some(if height > 0.0 { [a, b, c, d as u32] } else { [a, c, b, d as u32] })
}

/// The hull of points in a plane as a fan.
fn flat(points: &[DVec3]) -> Option<Vec<[u32; 3]>> {
    let [a, b, c] = triangle(points)?.map(|i| points[i as usize]);
    let u = (b - a).try_normalize()?;
    let v = (b - a).cross(c - a).try_normalize()?.cross(u);
    let ring = ring(points, u, v);
    Some((2..ring.len()).map(|i| [ring[0], ring[i - 1], ring[i]]).collect())
}

/// The convex hull of points as seen along `u x v`: counter-clockwise, without points on its edges (Andrew 1979).
pub(super) fn ring(points: &[DVec3], u: DVec3, v: DVec3) -> Vec<u32> {
    let at: Vec<DVec2> = points.iter().map(|p| DVec2::new(u.dot(*p), v.dot(*p))).collect();
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    let key = |i: u32| at[i as usize];
    order.sort_unstable_by(|&i, &j| key(i).x.total_cmp(&key(j).x).then(key(i).y.total_cmp(&key(j).y)).then(i.cmp(&j)));
    order.dedup_by(|i, j| key(*i) == key(*j));
    let coord = |i: u32| Coord { x: key(i).x, y: key(i).y };
    let mut ring: Vec<u32> = Vec::with_capacity(order.len() + 1);
    let half = |ring: &mut Vec<u32>, indices: &mut dyn Iterator<Item = u32>| {
        let start = ring.len();
        for i in indices {
            while ring.len() >= start + 2
                && orient2d(coord(ring[ring.len() - 2]), coord(ring[ring.len() - 1]), coord(i)) <= 0.0
            {
                ring.pop();
            }
            ring.push(i);
        }
        ring.pop();
    };
    half(&mut ring, &mut order.iter().copied());
    half(&mut ring, &mut order.iter().rev().copied());
    ring
}

#[cfg(test)]
mod tests {
    use super::super::tests::{point, turn};
    use super::*;
    use enfilade::math::random::Prng;

    fn volume(hull: &Hull) -> f64 {
        (0..hull.triangles.len())
            .map(|t| {
                let [a, b, c] = hull.corners(t);
                a.dot(b.cross(c)) / 6.0
            })
            .sum()
    }

    #[test]
    fn the_hull_of_a_grid_is_its_eight_corners() {
        let axis = [-1.0, -0.5, 0.0, 0.25, 1.0];
        let points: Vec<DVec3> =
            axis.iter().flat_map(|&x| axis.map(|y| axis.map(|z| DVec3::new(x, y, z)))).flatten().collect();
        let hull = Hull::new(&points);
        assert!((volume(&hull) - 8.0).abs() < 1e-12);
        // Points on edges and in faces may be corners of triangles; the real corners are.
        assert!(hull.points.iter().all(|p| p.abs().max_element() == 1.0));
        assert_eq!(hull.points.iter().filter(|p| p.abs() == DVec3::ONE).count(), 8);
    }

    #[test]
    fn no_point_is_outside_and_the_surface_is_closed() {
        let mut rng = Prng::new(7, 0);
        for round in 0..60 {
            let turn = turn(&mut rng);
            let points: Vec<DVec3> = (0..4 + round * 4)
                .map(|_| {
                    let p = point(&mut rng);
                    let p = if round % 3 == 0 { p.normalize_or_zero() } else { p };
                    turn * if round % 3 == 1 { (p * 2.0).round() } else { p }
                })
                .collect();
            let hull = Hull::new(&points);
            assert!(hull.triangles.len() >= 4, "round {round}");
            // Euler: a closed surface without handles.
            assert_eq!(hull.triangles.len(), 2 * hull.points.len() - 4, "round {round}");
            for t in 0..hull.triangles.len() {
                let [a, b, c] = hull.corners(t).map(coord);
                assert!(points.iter().all(|&p| orient3d(a, b, c, coord(p)) >= 0.0), "round {round}");
            }
        }
    }

    #[test]
    fn flat_points_have_a_flat_hull_and_points_on_a_line_none() {
        let square = [(0., 0.), (2., 0.), (1., 1.), (2., 2.), (0., 2.), (1., 0.)].map(|(x, z)| DVec3::new(x, 5.0, z));
        let hull = Hull::new(&square);
        assert_eq!((hull.points.len(), hull.triangles.len()), (4, 2));
        let line: Vec<DVec3> = (0..5).map(|i| DVec3::X * f64::from(i)).collect();
        assert_eq!(Hull::new(&line).triangles.len(), 0);
    }
}
