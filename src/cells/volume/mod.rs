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
//! [`watershed`] (regions), [`shell`] (which triangles part space), [`ridges`] (planes between regions), [`leaf_labels`] (labels of leaves).
//! No file uses one that uses it. Leaves, what is open between them, and their pieces: [`super::bsp`].

mod basins;
mod distance;
mod grid;
mod labels;
mod leaf_labels;
mod ridges;
mod shell;
mod watershed;

use super::bsp::graph::{cells, portals};
use super::bsp::planes::{main_axis, opaque_structure};
use super::bsp::{adjacency, bounded, pieces};
use super::scale::HumanScale;
use super::{CellGraph, SplitOptions, Strategy};
use crate::geom::newell;
use crate::job::{Job, Stopped};
use crate::scene::Scene;
use crate::types::note::Note;
use glam::DVec3;
use grid::Grid;
use leaf_labels::Owners;
use ridges::Fitter;

/// A triangle of more square voxels than this votes at four places instead of one.
const LARGE: f64 = 16.0;

/// Most bricks of the grid, and most voxels that surfaces may touch: about 1 GiB.
const MOST_BRICKS: f64 = 24e6;
/// A voxel is this share of a person's metre, where the scene is large; smaller scenes afford finer ones.
const VOXEL: f64 = 0.15;
const FINEST: f64 = 0.1;
/// Voxels along the diagonal of a small scene.
const VOXELS_ALONG: f64 = 300.0;

/// Splits a scene; `voxel` in metres, `None` takes what fits.
pub(super) fn volume(
    scene: &Scene,
    human: HumanScale,
    options: &SplitOptions,
    reason: String,
    work: &Job<'_>,
) -> Result<CellGraph, Stopped> {
    let tolerance = scene.tolerance();
    let bounds = scene.bounds();
    let triangles: Vec<[DVec3; 3]> = opaque_structure(scene).collect();
    let fitting = (bounds.diagonal() / VOXELS_ALONG).clamp(FINEST * human.metre, VOXEL * human.metre);
    let size = bounds.size() / grid::SIDE as f64;
    let affordable = (size.x.max(1e-9) * size.y.max(1e-9) * size.z.max(1e-9) / MOST_BRICKS).cbrt();
    let voxel = options.voxel.unwrap_or(fitting).max(affordable).max(bounds.diagonal() * 1e-5);

    // 1. Voxels, their distances, their regions.
    let grid = Grid::new(&triangles, main_axis(&triangles), voxel);
    work.go_on()?;
    let (labels, regions) = watershed::watershed(&grid, human, &|visit| fronts(&triangles, &grid, visit));
    // 2. What parts space, and where regions meet.
    work.go_on()?;
    let mut shell = shell::shell(&triangles, &grid, &labels, tolerance.coplanar);
    let domain = human.domain(bounds);
    let axes = DVec3::AXES.map(|a| grid.frame.direction(a));
    let limits = bounded::limits(triangles.len(), options.memory, work);
    let mut bsp = bounded::tree(&mut shell, domain, axes, tolerance.coplanar, None, &limits)?;
    let fitter = Fitter::new(&shell, &grid);
    let ridges = fitter.ridges(&grid, &labels);
    work.go_on()?;
    // 3. The leaves and their labels.
    leaf_labels::cut_along(&mut bsp, &ridges, |_, _| ());
    leaf_labels::refine(&mut bsp, &grid, &labels, &ridges);
    let counts = leaf_labels::counts(&bsp, &grid, &labels);
    let contacts = adjacency::contacts(&bsp, axes[0], &tolerance, work)?;
    let outside = regions.iter().position(|r| r.outside).map(|r| r as u32);
    let Owners { leaves: mut of_leaf, beyond } = leaf_labels::assign(&bsp, &counts, &contacts, outside, tolerance.coplanar);
    ridges::straighten(&bsp, &contacts, &ridges, &mut of_leaf);
    leaf_labels::smooth(&bsp, &counts, &contacts, voxel * voxel, &mut of_leaf);
    work.go_on()?;
    // Once more, along planes through what is ragged still.
    let ragged = fitter.between_leaves(&bsp, &contacts, &of_leaf);
    leaf_labels::cut_along(&mut bsp, &ragged, |leaf, _| of_leaf.push(of_leaf[leaf as usize]));
    let counts = leaf_labels::counts(&bsp, &grid, &labels);
    let contacts = adjacency::contacts(&bsp, axes[0], &tolerance, work)?;
    ridges::straighten(&bsp, &contacts, &ragged, &mut of_leaf);
    leaf_labels::smooth(&bsp, &counts, &contacts, voxel * voxel, &mut of_leaf);
    pieces::fill(&contacts, &bsp, &mut of_leaf);
    // 4. The graph.
    let pieces = pieces::pieces(&bsp, &contacts, &of_leaf, regions.len(), 0.1 * tolerance.coplanar, work)?;
    let (cells, number) = cells(pieces, beyond, domain);
    let of_leaf: Vec<Option<u32>> = of_leaf.iter().map(|l| l.and_then(|l| number[l as usize])).collect();
    let portals = portals(&bsp, &contacts, &of_leaf, axes[0], tolerance.seal, work)?;
    let count = cells.iter().map(|c| c.pieces.len()).sum::<usize>();
    let notes = [
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
    let mut notes: Vec<Note> = notes.into_iter().map(Note::detail).collect();
    notes.extend(bounded::note(&shell, &limits));
    notes.extend(human.note());
    Ok(CellGraph {
        strategy: Strategy::Volume,
        reason,
        cells,
        portals,
        smallest_hole: adjacency::smallest_hole(&tolerance),
        closed_holes: Vec::new(),
        notes,
    })
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
