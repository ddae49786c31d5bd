//! The bsp strategy: for game levels, and other scenes with walls but without a plan.
//!
//! Based on: Airey, Rohlf, Brooks, *Towards image realism with interactive update rates in complex virtual building environments*, 1990,
//! and Teller, Séquin, *Visibility preprocessing for interactive walkthroughs*, 1991: space is split along the walls that cover most of a
//! cut, until cells contain few occluders. Deviations: a part that is still large is halved; surfaces smaller than the smallest occluder do
//! not split space, and may stand in a cell; a cell is a connected component within such a part, not the part itself. All other walls split
//! below that, so that faces are open exactly where nothing covers them, and the graph is sound.
//!
//! The steps, one file each: [`planes`] (the splitting triangles), [`tree`] (the leaves), [`bounded`] (the limit on leaves), [`adjacency`]
//! (open faces), [`tiles`] (the first cuts; leaves to cells), [`solid`] and [`void`] (space without viewers), [`pieces`] and [`graph`]
//! (cells and portals).

pub mod adjacency;
pub mod bounded;
pub mod facing;
pub mod graph;
pub mod pieces;
pub mod planes;
mod solid;
mod tiles;
pub mod tree;
mod void;

use super::scale::HumanScale;
use super::{Cell, CellGraph, SplitOptions, Strategy};
use crate::job::{Job, Stopped};
use crate::math::geom::Aabb;
use crate::scene::bulk::bulk;
use crate::scene::rays::RayScene;
use crate::types::note::Note;
use adjacency::Contact;
use facing::Facing;
use glam::DVec3;
use planes::Shell;
use tiles::Tiles;

/// Largest edge of a tile, in smallest occluders. Larger: few cells, which see much. Smaller: portals across empty halls, which cost time
/// and narrow nothing.
const TILE: f64 = 4.0;
/// Tiles per object for the default smallest occluder, with a minimum and a maximum. More: cells that differ by less than an object. Fewer:
/// cells that see most objects.
const TILES_AN_OBJECT: f64 = 1.5;
const TILES: [f64; 2] = [256.0, 2048.0];
/// With a given smallest occluder, tiles take at most one in this many of the allowed leaves. Larger: the requested size is not reached.
/// Smaller: no leaves are left for walls.
const TILES_OF_LEAVES: usize = 4;
/// Trial sizes of the smallest occluder: the first, as a share of the model's diagonal; the factor between trials; their number.
const LARGEST: f64 = 0.1;
const SMALLER: f64 = 0.84;
const TRIALS: u32 = 31;
/// A leaf is a sliver below this thickness, in smallest holes. Larger: thin rooms join others. Smaller: openings are lost between nearly
/// coplanar planes.
const SLIVER: f64 = 2.0;
/// A cell is open if its border with the outside has this share of the largest side of its box. Larger: yards are closed. Smaller: rooms
/// with a large window are open.
const OPEN_SHARE: f64 = 0.5;

/// Splits a scene; `smallest_occluder` in metres; `None`: the size that gives three tiles for two objects.
pub(super) fn bsp(
    rays: &RayScene<'_>,
    human: HumanScale,
    options: &SplitOptions,
    reason: String,
    work: &Job<'_>,
) -> Result<CellGraph, Stopped> {
    let scene = rays.scene();
    let tolerance = scene.tolerance();
    let (around, domain) = (bulk(scene).unwrap_or(scene.bounds()), human.domain(scene.bounds()));
    // 1. The splitting planes.
    let triangles: Vec<[DVec3; 3]> = planes::opaque_structure(scene).collect();
    let main = planes::main_axis(&triangles);
    let axes = [DVec3::new(main.x, 0.0, main.y), DVec3::Y, DVec3::new(-main.y, 0.0, main.x)];
    let all = planes::planes(triangles, planes::TOUCH * tolerance.coplanar);
    let limits = bounded::limits(all.triangles.len(), options.memory, work);
    let corners: Vec<[DVec3; 3]> = all.triangles.iter().map(|t| t.0).collect();
    let extents = planes::extents(&corners, tolerance.coplanar);
    let is_far: Vec<bool> = corners.iter().map(|c| !Aabb::of(*c).touches(&around)).collect();
    let shell = |occluder: f64| {
        let told = all.triangles.iter().zip(&extents).zip(&is_far);
        let large = told.filter(|((_, extent), is_far)| **extent >= occluder && !**is_far).map(|((t, _), _)| *t);
        Shell { triangles: large.collect(), planes: all.planes.clone(), left_out: 0 }
    };
    let facing = Facing::new(rays);
    let tiles = |occluder: f64| Tiles { planes: &all.planes, axes, around, edge: TILE * occluder, occluder };
    let enough = (TILES_AN_OBJECT * scene.objects.len() as f64).clamp(TILES[0], TILES[1]) as usize;
    let size = |k: u32| LARGEST * around.diagonal() * SMALLER.powi(k as i32);
    let has_tiles = |occluder: f64, enough: usize| {
        let tiles = tiles(occluder);
        let cut: tree::Tiling<'_> = &|poly, inside| tiles.cut(poly, inside).filter(|_| !work.is_stopped());
        let counts = |tile: &tree::Poly| void::counts(&facing, tile);
        tree::has_tiles(&shell(occluder), domain, axes, tolerance.coplanar, cut, &counts, enough)
    };
    let mut occluder = options.smallest_occluder.unwrap_or_else(|| size(first(TRIALS, |k| has_tiles(size(k), enough))));
    while options.smallest_occluder.is_some() && has_tiles(occluder, limits.leaves / TILES_OF_LEAVES) {
        occluder *= 2.0;
    }
    let (mut shell, tiles) = (shell(occluder), tiles(occluder));
    // 2. The leaves, and the open faces between them.
    let cut: tree::Tiling<'_> = &|poly, inside| tiles.cut(poly, inside);
    let bsp = bounded::tree(&mut shell, domain, axes, tolerance.coplanar, Some(cut), &limits)?;
    let contacts = adjacency::contacts(&bsp, axes[0], &tolerance, work)?;
    // 3. Leaves to cells.
    let slivers = tiles::slivers(&bsp, &contacts, SLIVER * adjacency::smallest_hole(&tolerance));
    let mut parts = tiles.parts(&bsp, &contacts, &slivers);
    let solid = solid::solid(&facing, &bsp, &contacts, &slivers, around, occluder);
    parts.labels.iter_mut().zip(&solid).filter(|(_, solid)| **solid).for_each(|(label, _)| *label = None);
    void::join_outside(&facing, &bsp, &mut parts.labels);
    // 4. The graph.
    work.go_on()?;
    let pieces = pieces::pieces(&bsp, &contacts, &parts.labels, parts.count, 0.1 * tolerance.coplanar, work)?;
    let (mut cells, number) = graph::cells(pieces, Some(tiles::OUTSIDE), domain);
    let labels: Vec<Option<u32>> = parts.labels.iter().map(|l| l.and_then(|l| number[l as usize])).collect();
    open_to_the_sky(&mut cells, &contacts, &labels);
    let portals = graph::portals(&bsp, &contacts, &labels, axes[0], tolerance.seal, work)?;
    let far = is_far.iter().filter(|far| **far).count();
    let small = all.triangles.len() - shell.triangles.len() - shell.left_out - far;
    let mut notes = notes(human, [occluder, tiles.edge], (&shell, bsp.leaves.len()), [small, far], around);
    notes.extend(bounded::note(&shell, &limits));
    notes.extend(human.note());
    let smallest_hole = adjacency::smallest_hole(&tolerance);
    Ok(CellGraph { strategy: Strategy::Bsp, reason, cells, portals, smallest_hole, closed_holes: Vec::new(), notes })
}

/// Marks cells with a wide border to the outside as open; `labels` are the cells of leaves.
fn open_to_the_sky(cells: &mut [Cell], contacts: &[Contact], labels: &[Option<u32>]) {
    let mut area = vec![0.0; cells.len()];
    for c in contacts.iter().filter(|c| c.wide) {
        if let [Some(a), Some(b)] = c.leaves.map(|l| labels[l as usize]) {
            for (cell, other) in [(a, b), (b, a)] {
                area[cell as usize] += if cell != other && cells[other as usize].open { c.open_area } else { 0.0 };
            }
        }
    }
    for (cell, area) in cells.iter_mut().zip(area) {
        let size = cell.pieces.iter().fold(Aabb::EMPTY, |b, p| b.union(p.bounds)).size();
        cell.open |= area >= OPEN_SHARE * (size.x * size.y).max(size.y * size.z).max(size.z * size.x);
    }
}

/// Binary search: the first number for which a monotone condition holds; `last` if there is none.
fn first(last: u32, holds: impl Fn(u32) -> bool) -> u32 {
    let (mut low, mut high) = (0, last);
    while low < high {
        let middle = (low + high) / 2;
        if holds(middle) { high = middle } else { low = middle + 1 }
    }
    low
}

/// Notes on a split: lengths of the smallest occluder and of tiles, numbers of leaves, and of triangles that are small or far away.
fn notes(
    human: HumanScale,
    [occluder, edge]: [f64; 2],
    (shell, leaves): (&Shell, usize),
    [small, far]: [usize; 2],
    around: Aabb,
) -> Vec<Note> {
    let mut notes = vec![
        format!("surfaces smaller than {} (--cells bsp:METRES) do not split space: {small} triangles", human.told(occluder)),
        format!("{} planes of {} triangles split space", shell.planes.len(), shell.triangles.len()),
        format!("{leaves} leaves in tiles of at most {}", human.told(edge)),
    ];
    let [x, _, z] = around.size().to_array().map(|length| human.told(length));
    let beyond = || format!("triangles outside the walls ({x} x {z} with a margin) do not split space: {far}");
    notes.extend((far > 0).then(beyond));
    notes.into_iter().map(Note::detail).collect()
}

#[cfg(test)]
mod tests {
    use super::first;

    #[test]
    fn the_first_is_found_wherever_it_is() {
        for at in 0..=31 {
            assert_eq!(first(31, |k| k >= at), at);
        }
        assert_eq!(first(31, |_| false), 31);
    }
}
