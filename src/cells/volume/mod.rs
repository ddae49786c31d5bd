//! The volume strategy: caves, ships, plants, levels with ramps; whatever isn't like a plan.
//!
//! Based on: Haumont, Debeir, Sillion, *Volumetric cell-and-portal generation*, 2003. Voxels say *where* rooms and their
//! narrowings are; they are too coarse to say where walls are. So they only label, and what is labelled is an exact partition of
//! space: the leaves of a tree that cuts along walls and along the planes of the narrowings. Portals are the open parts of the
//! leaves' faces between two labels, as in the column complex. The graph is sound by construction; a poor label costs
//! culling, never a missed pixel.
//!
//! In: a scene, and the edge of a voxel. Out: a whole [`CellGraph`].
//!
//! The steps, one file each: [`grid`] (sparse voxels), [`distance`] (to the nearest surface), [`basins`] ([`labels`] of voxels),
//! [`watershed`] (regions), [`shell`] (which triangles part space), [`bsp`] (the leaves), [`adjacency`] (what is open between them),
//! [`ridges`] (planes between regions), [`leaf_labels`] (labels of leaves), [`pieces`]. No file uses one that uses it.

mod adjacency;
mod basins;
mod bsp;
mod distance;
mod grid;
mod labels;
mod leaf_labels;
mod pieces;
mod ridges;
mod shell;
mod watershed;

use super::complex::assemble::{around, hulls};
use super::complex::coverage::Open;
use super::complex::polygon::{Shape, area, convex_hull, width};
use super::scale::HumanScale;
use super::{Cell, CellGraph, Piece, Portal, PortalKind, PortalState, Strategy};
use crate::CellId;
use crate::geom::{Aabb, Plane, newell};
use crate::parallel;
use crate::scene::{Role, Scene};
use adjacency::{Contact, Flat};
use glam::{DVec2, DVec3};
use grid::Grid;
use leaf_labels::Owners;
use ridges::Fitter;
use std::collections::BTreeMap;

/// A triangle is upright if its normal's cosine with the vertical is below this (84 degrees).
const UPRIGHT: f64 = 0.1;

/// A triangle of more square voxels than this votes at four places instead of one.
const LARGE: f64 = 16.0;

/// Most bricks of the grid, and most voxels that surfaces may touch: about 1 GiB.
const MOST_BRICKS: f64 = 24e6;
/// A voxel is this share of a person's metre, where the scene is large; smaller scenes afford finer ones.
const VOXEL: f64 = 0.15;
const FINEST: f64 = 0.1;
/// What hulls grow by on every side, in seals.
const GROWN: f64 = 1.5;
/// Voxels along the diagonal of a small scene.
const VOXELS_ALONG: f64 = 300.0;

/// Voxels along an edge of a brick of the grid.
pub(super) const VOXELS_A_BRICK: f64 = grid::SIDE as f64;

/// Splits a scene; `voxel` in metres, `None` takes what fits, but no less than `least`.
pub(super) fn volume(scene: &Scene, human: HumanScale, voxel: Option<f64>, least: f64, reason: String) -> CellGraph {
    let tolerance = scene.tolerance();
    let bounds = scene.bounds();
    let triangles: Vec<[DVec3; 3]> = opaque_structure(scene).collect();
    let fitting = (bounds.diagonal() / VOXELS_ALONG).clamp(FINEST * human.metre, VOXEL * human.metre);
    let size = bounds.size() / VOXELS_A_BRICK;
    let affordable = (size.x.max(1e-9) * size.y.max(1e-9) * size.z.max(1e-9) / MOST_BRICKS).cbrt();
    let voxel = voxel.unwrap_or(fitting.max(least)).max(affordable).max(bounds.diagonal() * 1e-5);

    // 1. Voxels, their distances, their regions.
    let grid = Grid::new(&triangles, main_axis(&triangles), voxel);
    let (labels, regions) = watershed::watershed(&grid, human, &|visit| fronts(&triangles, &grid, visit));
    // 2. What parts space, and where regions meet.
    let shell = shell::shell(&triangles, &grid, &labels, tolerance.coplanar);
    let fitter = Fitter::new(&shell, &grid);
    let ridges = fitter.ridges(&grid, &labels);
    // 3. The leaves and their labels.
    let domain = human.domain(bounds);
    let axes = DVec3::AXES.map(|a| grid.frame.direction(a));
    let mut bsp = bsp::bsp(&shell, domain, axes, tolerance.coplanar);
    leaf_labels::cut_along(&mut bsp, &ridges, |_, _| ());
    leaf_labels::refine(&mut bsp, &grid, &labels, &ridges);
    let counts = leaf_labels::counts(&bsp, &grid, &labels);
    let contacts = adjacency::contacts(&bsp, axes[0], &tolerance);
    let outside = regions.iter().position(|r| r.outside).map(|r| r as u32);
    let Owners { leaves: mut of_leaf, beyond } = leaf_labels::assign(&bsp, &counts, &contacts, outside, tolerance.coplanar);
    ridges::straighten(&bsp, &contacts, &ridges, &mut of_leaf);
    leaf_labels::smooth(&bsp, &counts, &contacts, voxel * voxel, &mut of_leaf);
    // Once more, along planes through what is ragged still.
    let ragged = fitter.between_leaves(&bsp, &contacts, &of_leaf);
    leaf_labels::cut_along(&mut bsp, &ragged, |leaf, _| of_leaf.push(of_leaf[leaf as usize]));
    let counts = leaf_labels::counts(&bsp, &grid, &labels);
    let contacts = adjacency::contacts(&bsp, axes[0], &tolerance);
    ridges::straighten(&bsp, &contacts, &ragged, &mut of_leaf);
    leaf_labels::smooth(&bsp, &counts, &contacts, voxel * voxel, &mut of_leaf);
    pieces::fill(&contacts, &bsp, &mut of_leaf);
    // 4. The graph.
    let pieces = pieces::pieces(&bsp, &contacts, &of_leaf, regions.len(), 0.1 * tolerance.coplanar);
    let (cells, number) = cells(pieces, beyond, domain);
    let of_leaf: Vec<Option<u32>> = of_leaf.iter().map(|l| l.and_then(|l| number[l as usize])).collect();
    let portals = portals(&bsp, &contacts, &of_leaf, axes[0], tolerance.seal);
    let count = cells.iter().map(|c| c.pieces.len()).sum::<usize>();
    let mut notes = vec![
        format!("voxels of {voxel:.3} m: {} bricks, {} of them touched by surfaces", grid.len(), grid.occupied.len()),
        format!(
            "{} planes of {} triangles part space, {} triangles stand free in it",
            shell.planes.len(),
            shell.triangles.len(),
            shell.free_standing
        ),
        format!(
            "{} leaves make {count} convex pieces; {} narrowings, {} of them ragged",
            bsp.leaves.len(),
            ridges.len(),
            ragged.len()
        ),
    ];
    notes.extend(human.note());
    CellGraph {
        strategy: Strategy::Volume,
        reason,
        cells,
        portals,
        smallest_hole: adjacency::smallest_hole(&tolerance),
        notes,
    }
}

/// Triangles that may part space: what is opaque, and a part of the building for all that is known.
pub(super) fn opaque_structure(scene: &Scene) -> impl Iterator<Item = [DVec3; 3]> {
    let objects = scene.objects.iter().filter(|o| o.opaque && matches!(o.role, Role::Structure | Role::Unknown));
    objects.flat_map(|o| o.triangles.clone()).map(|t| scene.corners(t as usize))
}

/// Cells of the regions that have pieces, and the cell of each region; `beyond` is the one beyond the rim of the domain.
fn cells(pieces: Vec<Vec<Piece>>, beyond: Option<u32>, domain: Aabb) -> (Vec<Cell>, Vec<Option<u32>>) {
    let mut cells: Vec<Cell> = Vec::new();
    let mut number: Vec<Option<u32>> = vec![None; pieces.len()];
    for (r, mut pieces) in pieces.into_iter().enumerate() {
        if pieces.is_empty() {
            continue;
        }
        let outside = beyond == Some(r as u32);
        if outside {
            pieces.extend(around(domain));
        }
        let name = if outside { "outside".to_owned() } else { format!("cell {}", cells.len()) };
        number[r] = Some(cells.len() as u32);
        cells.push(Cell { name, source: None, open: outside, pieces, portals: Vec::new() });
    }
    if cells.is_empty() {
        // Nothing is wider than a voxel: what can't be told apart is one cell.
        let mut pieces = around(domain);
        let planes = DVec3::AXES.iter().flat_map(|&n| [Plane::through(domain.max, n), Plane::through(domain.min, -n)]);
        pieces.push(Piece { planes: planes.collect(), bounds: domain });
        cells.push(Cell { name: "everything".to_owned(), source: None, open: true, pieces, portals: Vec::new() });
    }
    (cells, number)
}

/// The direction in plan (x and z) that most wall area runs along or across.
fn main_axis(triangles: &[[DVec3; 3]]) -> DVec2 {
    const STEPS: usize = 360;
    let mut votes = vec![(0.0f64, DVec2::ZERO); STEPS];
    for t in triangles {
        let n = newell(&t.map(|p| p - t[0]));
        let flat = DVec2::new(n.x, n.z);
        if n.y.abs() < UPRIGHT * n.length() && n.length() > 0.0 {
            // Four times the angle is the same for all four directions at right angles.
            let four = |z: DVec2| {
                let two = z.rotate(z);
                two.rotate(two)
            };
            let q = four(flat.normalize());
            let step = ((q.y.atan2(q.x) / std::f64::consts::TAU).rem_euclid(1.0) * STEPS as f64) as usize % STEPS;
            votes[step].0 += n.length();
            votes[step].1 += q * n.length();
        }
    }
    let window = |i: usize| [i + STEPS - 1, i, i + 1].map(|k| votes[k % STEPS]);
    let weight = |i: usize| window(i).iter().map(|v| v.0).sum::<f64>();
    let best = (0..STEPS).max_by(|&a, &b| weight(a).total_cmp(&weight(b)).then(b.cmp(&a))).unwrap_or(0);
    let sum: DVec2 = window(best).iter().map(|v| v.1).sum();
    if sum == DVec2::ZERO { DVec2::X } else { DVec2::from_angle(sum.to_angle() / 4.0) }
}

/// Visits points a little off both sides of triangles, in voxels, with the area that shows them its front, and its back.
fn fronts(triangles: &[[DVec3; 3]], grid: &Grid, visit: &mut dyn FnMut(DVec3, [f64; 2])) {
    for t in triangles {
        let q = t.map(|p| grid.frame.to_grid(p));
        let n = newell(&q.map(|p| p - q[0]));
        let (area, n) = (0.5 * n.length(), n.normalize_or_zero());
        let middle = (q[0] + q[1] + q[2]) / 3.0;
        let more = if area > LARGE { 3 } else { 0 };
        let share = area / f64::from(1 + more);
        for p in (0..more as usize).map(|i| (middle + q[i]) * 0.5).chain([middle]) {
            visit(p + n * 1.5, [share, 0.0]);
            visit(p - n * 1.5, [0.0, share]);
        }
    }
}

/// Portals between different cells, in a fixed order; see [`super::complex::assemble::portals`].
fn portals(bsp: &bsp::Bsp, contacts: &[Contact], labels: &[Option<u32>], along: DVec3, seal: f64) -> Vec<Portal> {
    /// Cells in order, the plane's bits, whether the lower cell is behind it.
    type Key = (u32, u32, [u64; 4], bool);
    let mut groups: BTreeMap<Key, (Plane, Vec<Shape>)> = BTreeMap::new();
    for c in contacts {
        let [Some(a), Some(b)] = c.leaves.map(|l| labels[l as usize]) else { continue };
        if a == b || c.open_area <= 0.0 {
            continue;
        }
        let plane = bsp.nodes[c.node as usize].plane;
        let bits = [plane.n.x, plane.n.y, plane.n.z, plane.d].map(|x| (x + 0.0).to_bits());
        let parts = &mut groups.entry((a.min(b), a.max(b), bits, a < b)).or_insert((plane, Vec::new())).1;
        match &c.open {
            Open::Whole => parts.push(vec![c.polygon.iter().map(|p| p.to_array()).collect()]),
            Open::Parts(p) => parts.extend(p.iter().cloned()),
        }
    }
    let groups: Vec<(Key, (Plane, Vec<Shape>))> = groups.into_iter().collect();
    let of_group = |&((low, high, _, forward), (plane, ref parts)): &(Key, (Plane, Vec<Shape>))| {
        let flat = Flat::new(&plane, along);
        let facing = if forward { plane } else { plane.flipped() };
        let winding = move |hull: Vec<DVec2>| {
            let mut winding: Vec<DVec3> = hull.iter().map(|&q| flat.from(q)).collect();
            if !forward {
                winding.reverse();
            }
            let cells = [CellId(low), CellId(high)];
            let sound = width(&hull) >= (2.0 * GROWN + adjacency::CRUMB) * seal
                && winding.len() >= 3
                && newell(&winding.iter().map(|&p| p - winding[0]).collect::<Vec<_>>()).length() > 0.0;
            let kind = PortalKind::Opening;
            sound.then(|| Portal { cells, plane: facing, winding, kind, state: PortalState::of_kind(kind), source: None })
        };
        joined(hulls(parts.clone(), seal)).into_iter().filter_map(winding).collect::<Vec<_>>()
    };
    parallel::flat_map(&groups, of_group)
}

/// Hulls whose common hull holds little else are one: what a narrow ledge parts from an opening.
fn joined(mut hulls: Vec<Vec<DVec2>>) -> Vec<Vec<DVec2>> {
    /// A common hull may be larger than both by this factor.
    const LOOSE: f64 = 1.02;
    hulls.sort_by(|a, b| area(b).total_cmp(&area(a)));
    let mut out: Vec<Vec<DVec2>> = Vec::new();
    for hull in hulls {
        let most = |kept: &[DVec2]| LOOSE * (area(kept) + area(&hull));
        let fits = |kept: &Vec<DVec2>| {
            Some(convex_hull(kept.iter().chain(&hull).copied().collect())).filter(|both| area(both) <= most(kept))
        };
        match out.iter().enumerate().find_map(|(i, kept)| Some((i, fits(kept)?))) {
            Some((i, both)) => out[i] = both,
            None => out.push(hull),
        }
    }
    out
}
