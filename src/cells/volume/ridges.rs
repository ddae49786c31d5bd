//! Portals' places: the ridges between two regions of voxels, each a connected patch with a plane fitted to it.
//!
//! The sum of the normals of a patch's voxel faces is the area vector of its rim, whatever way the staircase takes between; so
//! it is the normal of the best plane without a fit. A plane that is nearly upright, level or parallel to a wall is made so,
//! and one that lies within a voxel and a half of a wall's plane becomes that: doorways get portals that are flush with walls.

use super::contacts::Flat;
use super::grid::{Grid, SIDE};
use super::shell::Shell;
use super::watershed::{Contact, Labels, Union, VOID};
use crate::cells::locate::BoxTree;
use crate::geom::{Aabb, Plane, area};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// A plane that parts two regions near a patch.
pub struct Ridge {
    /// The regions, behind the plane and in front of it.
    pub regions: [u32; 2],
    /// The plane.
    pub plane: Plane,
    /// Where on the plane, as a rectangle.
    pub corners: [DVec3; 4],
    /// How far off the plane the patch strays, metres.
    pub depth: f64,
}

/// A patch of fewer faces is none.
const LEAST_FACES: usize = 3;
/// Normals nearer than this to an axis or a wall are made parallel: cosine of 20 degrees.
const PARALLEL: f64 = 0.94;
/// Planes of walls within this many voxels are taken.
const FLUSH: f64 = 1.5;
/// Most voxels that labels are straightened off a plane.
const DEEPEST: f64 = 4.0;

/// A face of a patch: its middle, metres, and its normal from the lower region to the higher.
type Step = (DVec3, DVec3);

/// All ridges, ordered by regions.
pub fn ridges(grid: &Grid, labels: &Labels, shell: &Shell) -> Vec<Ridge> {
    const CHUNK: usize = 1024;
    let chunk = |c: usize| {
        let mut out: Vec<([u32; 2], DVec3, DVec3)> = Vec::new();
        for brick in c * CHUNK..((c + 1) * CHUNK).min(grid.len()) {
            labels.contacts(grid, None, brick, &mut |Contact { labels: [a, b], at, axis, .. }| {
                if a < VOID && b < VOID {
                    out.push(([a.min(b), a.max(b)], at, DVec3::AXES[axis] * if a < b { 1.0 } else { -1.0 }));
                }
            });
        }
        out
    };
    let mut by_pair: BTreeMap<[u32; 2], Vec<(DVec3, DVec3)>> = BTreeMap::new();
    for (pair, at, n) in (0..grid.len().div_ceil(CHUNK)).into_par_iter().flat_map_iter(chunk).collect::<Vec<_>>() {
        by_pair.entry(pair).or_default().push((at, n));
    }
    let boxes: Vec<Aabb> = shell.triangles.iter().map(|(t, _)| Aabb::of(*t)).collect();
    let tree = BoxTree::new(&boxes, (0..boxes.len() as u32).collect());
    let patches: Vec<([u32; 2], Vec<Step>)> =
        by_pair.into_iter().flat_map(|(pair, steps)| patches(steps).into_iter().map(move |p| (pair, p))).collect();
    patches.par_iter().filter_map(|(pair, steps)| fit(*pair, steps, grid, shell, &tree)).collect()
}

/// Faces that touch or nearly touch, together.
fn patches(steps: Vec<Step>) -> Vec<Vec<Step>> {
    let cell = |p: DVec3| (p / 2.0).floor().to_array().map(|x| x as i64);
    let mut cells: HashMap<[i64; 3], u32> = HashMap::new();
    for (at, _) in &steps {
        let next = cells.len() as u32;
        cells.entry(cell(*at)).or_insert(next);
    }
    let mut set = Union::new(cells.len());
    for (c, &i) in &cells {
        for k in 0..27 {
            if let Some(&j) = cells.get(&[c[0] + k % 3 - 1, c[1] + k / 3 % 3 - 1, c[2] + k / 9 - 1]) {
                set.join(i, j);
            }
        }
    }
    let mut out: BTreeMap<u32, Vec<Step>> = BTreeMap::new();
    for step in steps {
        out.entry(set.find(cells[&cell(step.0)])).or_default().push(step);
    }
    out.into_values().collect()
}

fn fit(regions: [u32; 2], steps: &[Step], grid: &Grid, shell: &Shell, tree: &BoxTree) -> Option<Ridge> {
    let (frame, voxel) = (&grid.frame, grid.frame.voxel);
    let sum = steps.iter().map(|s| s.1).sum::<DVec3>();
    if steps.len() < LEAST_FACES || sum.length() < 1.0 {
        return None;
    }
    let mut n = sum.normalize();
    for axis in DVec3::AXES {
        if n.dot(axis).abs() > PARALLEL {
            n = axis * n.dot(axis).signum();
        }
    }
    // Upright, where nearly so.
    if n.y.abs() < (1.0 - PARALLEL * PARALLEL).sqrt() {
        n = n.with_y(0.0).normalize();
    }
    let n = frame.direction(n);
    let points: Vec<DVec3> = steps.iter().map(|s| frame.to_world(s.0)).collect();
    let centre = points.iter().sum::<DVec3>() / points.len() as f64;
    let mut plane = Plane::through(centre, n);
    // Flush with a wall.
    let near = Aabb::of(points.iter().copied()).inflated(2.0 * voxel);
    let mut walls: BTreeMap<u32, f64> = BTreeMap::new();
    tree.in_box(&near, &mut |i| {
        let (t, p) = &shell.triangles[i as usize];
        let wall = &shell.planes[*p as usize];
        if wall.n.dot(n).abs() > PARALLEL && wall.distance(centre).abs() <= FLUSH * voxel {
            *walls.entry(*p).or_default() += area(t);
        }
    });
    let best = walls.into_iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
    let mut flipped = false;
    if let Some((wall, _)) = best.filter(|w| w.1 >= (0.5 * voxel).powi(2)) {
        plane = shell.planes[wall as usize];
        flipped = plane.n.dot(n) < 0.0;
    }
    let flat = Flat::new(&plane, frame.direction(DVec3::X));
    let (mut low, mut high, mut depth) = (DVec2::INFINITY, DVec2::NEG_INFINITY, 0.0f64);
    for &p in &points {
        let q = flat.to(p);
        (low, high, depth) = (low.min(q), high.max(q), depth.max(plane.distance(p).abs()));
    }
    (low, high) = (low - voxel, high + voxel);
    let corners = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)].map(|q| flat.from(q));
    let regions = if flipped { [regions[1], regions[0]] } else { regions };
    Some(Ridge { regions, plane, corners, depth: (depth + voxel).min(DEEPEST * voxel) })
}

/// Voxels near each ridge go to the side of its plane that they are on.
pub fn straighten(grid: &mut Grid, labels: &mut Labels, ridges: &[Ridge]) {
    let voxel = grid.frame.voxel;
    for ridge in ridges {
        let n = ridge.plane.n * ridge.depth;
        let around = ridge.corners.iter().flat_map(|&c| [c - n, c + n]).map(|p| grid.frame.to_grid(p));
        let around = Aabb::of(around);
        let place = |p: DVec3| (p / SIDE as f64).floor().to_array().map(|x| x as i64);
        let (lo, hi) = (place(around.min), place(around.max));
        let [a, b, _, d] = ridge.corners;
        let (u, v) = (b - a, d - a);
        let within = |p: DVec3| {
            let (x, y) = ((p - a).dot(u) / u.length_squared(), (p - a).dot(v) / v.length_squared());
            (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y) && ridge.plane.distance(p).abs() <= ridge.depth
        };
        for z in lo[2]..=hi[2] {
            for y in lo[1]..=hi[1] {
                for x in lo[0]..=hi[0] {
                    let Some(brick) = grid.brick_at([x, y, z]) else { continue };
                    if labels.whole(grid, brick).is_some_and(|l| !ridge.regions.contains(&l)) {
                        continue;
                    }
                    // An undivided brick clear of the plane stays so.
                    let middle = grid.frame.to_world(grid.corner(brick) + 0.5 * SIDE as f64);
                    if ridge.plane.distance(middle).abs() > ridge.depth + SIDE as f64 * voxel {
                        continue;
                    }
                    for i in 0..super::grid::CELLS {
                        let label = labels.get(grid, brick, i);
                        let at = super::grid::place_of(i).map(|c| c as f64 + 0.5);
                        let p = grid.frame.to_world(grid.corner(brick) + DVec3::from_array(at));
                        let side = ridge.regions[usize::from(ridge.plane.distance(p) > 0.0)];
                        if label != side && ridge.regions.contains(&label) && within(p) {
                            labels.set(grid, brick, i, side);
                        }
                    }
                }
            }
        }
    }
}
