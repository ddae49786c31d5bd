//! Which triangles part space, and the planes that they lie in.
//!
//! A closed thing that stands free in one region (a pipe, a tank, a column) parts nothing: its inside may count as the region's,
//! and nothing is lost but a few convex pieces fewer. The rest is the *shell*.

use super::grid::Grid;
use super::labels::{Labels, NONE, VOID};
use crate::cells::bsp::planes::{Shell, TOUCH, key, parts, planes};
use crate::parallel;
use glam::DVec3;
use std::collections::HashMap;

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
