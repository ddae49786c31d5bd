//! Which triangles part space, and the planes that they lie in.
//!
//! A closed thing that stands free in one region (a pipe, a tank, a column) parts nothing: its inside may count as the region's,
//! and nothing is lost but a few convex pieces fewer. The rest is the *shell*.

use super::grid::Grid;
use super::labels::{Labels, NONE, VOID};
use crate::cells::disjoint_sets::DisjointSets;
use crate::geom::{Aabb, Plane, newell};
use crate::parallel;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// What is nearer than this share of the coplanar tolerance to a cut isn't cut. Where surfaces meet at an angle, that leaves a
/// slit as much wider as the angle is shallow; down to half a degree the seal still closes it. Less would cut along rounding.
pub const TOUCH: f64 = 0.02;

/// Triangles and their planes.
pub struct Shell {
    /// Planes, the one with the largest triangle first.
    pub planes: Vec<Plane>,
    /// Triangles, each with the index of a plane that it lies in to within [`TOUCH`] of the coplanar tolerance.
    pub triangles: Vec<([DVec3; 3], u32)>,
    /// Triangles left out.
    pub free_standing: usize,
}

/// The shell of all `triangles`; `coplanar` in metres.
pub fn shell(triangles: &[[DVec3; 3]], grid: &Grid, labels: &Labels, coplanar: f64) -> Shell {
    let parts = parts(triangles, coplanar);
    let parting: Vec<[DVec3; 3]> = parallel::flat_map(&parts, |part| {
        let part: Vec<[DVec3; 3]> = part.iter().map(|&i| triangles[i as usize]).collect();
        if stands_free(&part, grid, labels, coplanar) { Vec::new() } else { part }
    });
    let free_standing = triangles.len() - parting.len();
    // Planes that meet at a shallow angle must not be a tolerance off, or they meet elsewhere than their triangles.
    let mut shell = planes(parting, TOUCH * coplanar);
    shell.free_standing = free_standing;
    shell
}

/// A corner, to a fraction of the tolerance.
fn key(p: DVec3, coplanar: f64) -> [i64; 3] {
    (p / (0.25 * coplanar)).round().to_array().map(|x| x as i64)
}

/// True for a closed surface with but one region around it, which lies outside of it.
fn stands_free(part: &[[DVec3; 3]], grid: &Grid, labels: &Labels, coplanar: f64) -> bool {
    let mut edges: HashMap<[[i64; 3]; 2], u32> = HashMap::new();
    for t in part {
        let k = t.map(|p| key(p, coplanar));
        for (a, b) in [(k[0], k[1]), (k[1], k[2]), (k[2], k[0])] {
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    if edges.values().any(|n| n % 2 == 1) {
        return false;
    }
    let mut known = [NONE; 2];
    let mut from = None;
    for t in part {
        beside(t, grid, labels, &mut known, &mut from);
        if known[1] != NONE {
            return false;
        }
    }
    let Some(from) = from else { return false };
    // A line from the region to far away crosses a surface around which it lies an even number of times.
    let from = grid.frame.to_world(from);
    let direction = DVec3::new(0.754_877_666, 0.569_840_291, 0.324_717_957).normalize();
    let crossed = part.iter().filter(|t| crosses(from, direction, t)).count();
    crossed % 2 == 0
}

/// Whether a ray meets a triangle (Moller, Trumbore 1997).
fn crosses(from: DVec3, direction: DVec3, [a, b, c]: &[DVec3; 3]) -> bool {
    let (e1, e2) = (*b - *a, *c - *a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    if determinant == 0.0 {
        return false;
    }
    let s = from - *a;
    let q = s.cross(e1);
    let (u, v, t) = (s.dot(p) / determinant, direction.dot(q) / determinant, e2.dot(q) / determinant);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0
}

/// Keeps the first two different regions.
fn note(known: &mut [u32; 2], region: u32) {
    if region == NONE || known.contains(&region) {
        return;
    }
    if known[0] == NONE {
        known[0] = region;
    } else if known[1] == NONE {
        known[1] = region;
    }
}

/// Triangles that hang together over shared corners, ascending.
fn parts(triangles: &[[DVec3; 3]], coplanar: f64) -> Vec<Vec<u32>> {
    let mut first: HashMap<[i64; 3], u32> = HashMap::new();
    let mut set = DisjointSets::new(triangles.len());
    for (i, t) in triangles.iter().enumerate() {
        for &p in t {
            let other = *first.entry(key(p, coplanar)).or_insert(i as u32);
            set.join(other, i as u32);
        }
    }
    let mut out: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for i in 0..triangles.len() as u32 {
        out.entry(set.find(i)).or_default().push(i);
    }
    out.into_values().collect()
}

/// Notes the regions on either side of a triangle, a voxel and a half off it, and the first point in one, in voxels.
fn beside(t: &[DVec3; 3], grid: &Grid, labels: &Labels, known: &mut [u32; 2], from: &mut Option<DVec3>) {
    let q = t.map(|p| grid.frame.to_grid(p));
    let n = (q[1] - q[0]).cross(q[2] - q[0]).normalize_or_zero();
    let longest = (0..3).map(|i| q[i].distance(q[(i + 1) % 3])).fold(0.0, f64::max);
    let steps = (longest / 4.0).ceil().clamp(1.0, 4096.0) as usize;
    for i in 0..=steps {
        for j in 0..=steps - i {
            let p = q[0] + (q[1] - q[0]) * (i as f64 / steps as f64) + (q[2] - q[0]) * (j as f64 / steps as f64);
            for p in [p + n * 1.5, p - n * 1.5] {
                if let Some((brick, voxel)) = grid.locate(p) {
                    let label = labels.get(grid, brick, voxel);
                    note(known, label);
                    if label < VOID {
                        from.get_or_insert(p);
                    }
                }
            }
            if known[1] != NONE {
                return;
            }
        }
    }
}

/// Groups triangles into planes, larger triangles first, so that a plane is the one of its largest member.
fn planes(mut triangles: Vec<[DVec3; 3]>, coplanar: f64) -> Shell {
    let size = |t: &[DVec3; 3]| newell(&t.map(|p| p - t[0])).length_squared();
    triangles.retain(|t| size(t) > 0.0);
    triangles.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let bounds = Aabb::of(triangles.iter().flatten().copied());
    let (centre, step) = (bounds.centre(), (bounds.diagonal() / 512.0).max(8.0 * coplanar));
    /// Buckets of normals are about 2 degrees wide.
    const NORMALS: f64 = 32.0;
    let mut out = Shell { planes: Vec::new(), triangles: Vec::with_capacity(triangles.len()), free_standing: 0 };
    let mut buckets: HashMap<[i64; 4], Vec<u32>> = HashMap::new();
    for t in triangles {
        let n = newell(&t.map(|p| p - t[0])).normalize();
        let at = |n: DVec3| [n.x * NORMALS, n.y * NORMALS, n.z * NORMALS, n.dot(t[0] - centre) / step];
        let fits = |&i: &u32| t.iter().all(|&p| out.planes[i as usize].distance(p).abs() <= coplanar);
        let mut found: Option<u32> = None;
        for n in [n, -n] {
            // The buckets that a little noise may have moved it to.
            let range = at(n).map(|x| ((x - 0.2).floor() as i64, (x + 0.2).floor() as i64));
            for a in range[0].0..=range[0].1 {
                for b in range[1].0..=range[1].1 {
                    for c in range[2].0..=range[2].1 {
                        for d in range[3].0..=range[3].1 {
                            let of_bucket = buckets.get(&[a, b, c, d]).into_iter().flatten().copied();
                            found = of_bucket.filter(|i| fits(i)).chain(found).min();
                        }
                    }
                }
            }
        }
        let plane = found.unwrap_or_else(|| {
            let id = out.planes.len() as u32;
            out.planes.push(Plane::through((t[0] + t[1] + t[2]) / 3.0, n));
            buckets.entry(at(n).map(|x| x.floor() as i64)).or_default().push(id);
            id
        });
        out.triangles.push((t, plane));
    }
    out
}
