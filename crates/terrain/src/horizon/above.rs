//! Tests whether the eye is above the ground.

use super::holes::height;
use super::order::{ends, tiles_from_corner};
use super::picture::{CORNERS, Footprint};
use crate::{Ground, GroundView, Key, Patch, Sample, drawn};
use glam::{DVec2, DVec3};

/// Whether the eye is over the raster, and the drawn surface is below it by more than the near plane can cut.
pub(super) fn is_above(ground: &Ground, view: &GroundView<'_>, near: f64, patches: &[Patch]) -> bool {
    let (header, eye) = (ground.header(), view.camera.eye.as_dvec3());
    let grid = &header.grid;
    let at = tiles_from_corner(header, eye);
    let ends = ends(header);
    // Greatest distance that the near plane cuts off.
    let slant = CORNERS.map(|at| (view.camera.unproject() * at.extend(1.0)).length()).into_iter().fold(1.0, f64::max);
    let cut = near * slant;
    let is_over = at.cmpge(DVec2::ZERO).all() && at.cmplt(ends).all();
    let is_narrow = cut < header.spacing[0].min(header.spacing[1]) * f64::from(grid.side() - 1);
    if !(is_over && is_narrow) {
        return false;
    }
    let key = Key { level: 0, x: at.x as u32, y: at.y as u32 };
    let Some(tile) = grid.tile(key).map(|tile| &ground.tiles()[tile as usize]) else { return false };
    let below = -cut;
    let mut covers = false;
    for patch in patches {
        let of = Footprint::new(header, patch.key, &ground.tiles()[patch.tile as usize], eye);
        let reaches = |far: f64| (0..2).all(|k| of.low[k] <= far && of.high[k] >= -far);
        covers |= reaches(0.0);
        if reaches(cut) && !is_below(ground, patch, eye, cut, below) {
            return false;
        }
    }
    covers || f64::from(tile.high) - eye.y < below
}

/// Whether a patch is lower than `below` (metres above the eye) within a square of `cut` to each side of the eye.
fn is_below(ground: &Ground, patch: &Patch, eye: DVec3, cut: f64, below: f64) -> bool {
    let header = ground.header();
    let Some(words) = ground.slot(patch.tile).map(|slot| ground.words(slot)) else { return false };
    let side = header.grid.side();
    let place = |[i, j]: Sample| {
        let [x, z] = header.plan(header.grid.column(patch.key, i), header.grid.row(patch.key, j));
        DVec3::new(x, height(header, words, (j * side + i) as usize).unwrap_or(f64::NAN), z) - eye
    };
    // Cells in the square, and their neighbours, which stitching draws into these.
    let range = |axis: usize| {
        let until = |far: f64| (0..side - 1).take_while(|&k| place([k, k]).to_array()[axis] <= far).count() as u32;
        until(-cut).saturating_sub(2)..(until(cut) + 1).min(side - 1)
    };
    let (columns, rows) = (range(0), range(2));
    let triangles = rows.flat_map(|j| columns.clone().flat_map(move |i| drawn(i, j, side, patch.coarser)));
    triangles.map(|triangle| triangle.map(place)).all(|triangle| is_lower(triangle, cut, below))
}

/// Whether a triangle, relative to the eye, is lower than `below` in the square of `cut` to each side of it.
fn is_lower([a, b, c]: [DVec3; 3], cut: f64, below: f64) -> bool {
    let normal = (b - a).cross(c - a);
    // Seen from above it is counter-clockwise: inside is to the left of an edge.
    let is_beside = |p: DVec3, q: DVec3| {
        let along = q - p;
        along.z * p.x - along.x * p.z > cut * (along.x.abs() + along.z.abs())
    };
    let greatest = if normal.y.is_nan() {
        // A triangle that closes a void may rise to its existing corners.
        [a, b, c].iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max)
    } else {
        (normal.dot(a) + cut * (normal.x.abs() + normal.z.abs())) / normal.y
    };
    is_beside(a, b) || is_beside(b, c) || is_beside(c, a) || greatest < below
}
