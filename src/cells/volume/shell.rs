//! Which triangles part space, and the planes that they lie in.
//!
//! A closed thing that stands free in one region (a pipe, a tank, a column) parts nothing: its inside may count as the region's,
//! and nothing is lost but a few convex pieces fewer. The rest is the *shell*.

use super::grid::Grid;
use super::watershed::{Labels, NONE, Union};
use crate::geom::{Aabb, Plane, newell};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Triangles and their planes.
pub struct Shell {
    /// Planes, the one with the largest triangle first.
    pub planes: Vec<Plane>,
    /// Triangles, each with the index of a plane that it lies in to within the coplanar tolerance.
    pub triangles: Vec<([DVec3; 3], u32)>,
    /// Triangles left out.
    pub free_standing: usize,
}

/// The shell of all `triangles`; `coplanar` in metres.
pub fn shell(triangles: &[[DVec3; 3]], grid: &Grid, labels: &Labels, coplanar: f64) -> Shell {
    let parts = parts(triangles);
    let regions: Vec<[u32; 2]> = triangles.par_iter().map(|t| regions_beside(t, grid, labels)).collect();
    let mut beside: Vec<[u32; 2]> = vec![[NONE; 2]; triangles.len()];
    for (&part, found) in parts.iter().zip(&regions) {
        found.iter().for_each(|&r| note(&mut beside[part as usize], r));
    }
    let parting: Vec<[DVec3; 3]> =
        triangles.iter().zip(&parts).filter(|(_, p)| beside[**p as usize][1] != NONE).map(|(t, _)| *t).collect();
    let free_standing = triangles.len() - parting.len();
    let mut shell = planes(parting, coplanar);
    shell.free_standing = free_standing;
    shell
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

/// For each triangle, the least number of those that it hangs together with over shared corners.
fn parts(triangles: &[[DVec3; 3]]) -> Vec<u32> {
    let mut first: HashMap<[u64; 3], u32> = HashMap::new();
    let mut set = Union::new(triangles.len());
    for (i, t) in triangles.iter().enumerate() {
        for p in t {
            // Adding 0 makes -0 the same as 0.
            let key = (*p + 0.0).to_array().map(f64::to_bits);
            let other = *first.entry(key).or_insert(i as u32);
            set.join(other, i as u32);
        }
    }
    (0..triangles.len() as u32).map(|i| set.find(i)).collect()
}

/// Up to two regions on either side of a triangle, a voxel and a half off it.
fn regions_beside(t: &[DVec3; 3], grid: &Grid, labels: &Labels) -> [u32; 2] {
    let mut out = [NONE; 2];
    let q = t.map(|p| grid.frame.to_grid(p));
    let n = (q[1] - q[0]).cross(q[2] - q[0]).normalize_or_zero();
    let longest = (0..3).map(|i| q[i].distance(q[(i + 1) % 3])).fold(0.0, f64::max);
    let steps = (longest / 4.0).ceil().clamp(1.0, 4096.0) as usize;
    for i in 0..=steps {
        for j in 0..=steps - i {
            let p = q[0] + (q[1] - q[0]) * (i as f64 / steps as f64) + (q[2] - q[0]) * (j as f64 / steps as f64);
            for side in [1.5, -1.5] {
                if let Some((brick, voxel)) = grid.locate(p + n * side) {
                    note(&mut out, labels.get(grid, brick, voxel));
                }
            }
            if out[1] != NONE {
                return out;
            }
        }
    }
    out
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
