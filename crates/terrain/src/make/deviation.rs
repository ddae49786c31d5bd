//! The vertical distance of a coarse tile's surface from the raster's samples.
//!
//! A coarse triangle is a union of finest ones, so the greatest distance is at a sample of the raster: the error there is exact.
//! Beside a coarser neighbour the triangles differ and cross finest ones; there it is exact at the samples, too.

use super::band::Band;
use crate::grid::{Grid, Key};
use crate::mesh;
use std::ops::Range;

/// All four neighbours are coarser.
const ALL: u8 = 15;

/// The greatest distance within the cells `rows` of a tile, with any coarser neighbours: metres. All rows lie in the band.
pub fn of_cells(band: &Band, grid: &Grid, key: Key, rows: Range<u32>) -> f64 {
    let cells = grid.side() - 1;
    let mut worst = 0f64;
    for j in rows {
        for i in 0..cells {
            worst = worst.max(of_cell(band, corners(grid, key, i, j)));
            // At level 0 the coarse neighbour includes this, and the top has no coarser neighbour.
            if key.level > 0 && key.level < grid.top() {
                worst = worst.max(of_rim_cell(band, grid, key, [i, j]));
            }
        }
    }
    worst
}

/// A cell at the tile's rim, with coarser neighbours.
fn of_rim_cell(band: &Band, grid: &Grid, key: Key, [i, j]: [u32; 2]) -> f64 {
    let side = grid.side();
    let ends = [0, side - 2];
    // Two neighbours matter in a corner of the tile, one elsewhere.
    let masks = match (ends.contains(&i), ends.contains(&j)) {
        (true, true) => 1..=ALL,
        (true, false) | (false, true) => ALL..=ALL,
        (false, false) => return 0.0,
    };
    let mut worst = 0f64;
    for triangle in masks.flat_map(|mask| mesh::drawn(i, j, side, mask)) {
        let at = triangle.map(|[i, j]| [grid.column(key, i), grid.row(key, j)]);
        worst = worst.max(of_triangle(band, at));
    }
    worst
}

/// Columns and rows of a cell's first and last samples.
fn corners(grid: &Grid, key: Key, i: u32, j: u32) -> [[u32; 2]; 2] {
    [[grid.column(key, i), grid.row(key, j)], [grid.column(key, i + 1), grid.row(key, j + 1)]]
}

/// The two triangles of a cell.
fn of_cell(band: &Band, [[c0, r0], [c1, r1]]: [[u32; 2]; 2]) -> f64 {
    if c0 == c1 || r0 == r1 {
        return 0.0;
    }
    let [a, b, c, d] = [band.drawn(c0, r0), band.drawn(c1, r0), band.drawn(c0, r1), band.drawn(c1, r1)];
    let (across, down) = (f64::from(c1 - c0), f64::from(r1 - r0));
    let mut worst = 0f64;
    for r in r0..=r1 {
        let q = f64::from(r - r0) / down;
        let row = band.true_row(r, c0, c1);
        // Samples up to the diagonal belong to the first triangle, and from it on to the second.
        let split = c1 - c0 - ((u64::from(c1 - c0) * u64::from(r - r0)).div_ceil(u64::from(r1 - r0))) as u32;
        let (from, slope) = (a + q * (c - a), (b - a) / across);
        worst = line(&row[..=split as usize], from, slope, worst);
        let (from, slope) = (d + (1.0 - q) * (b - d) + (c - d), (d - c) / across);
        let start = (u64::from(c1 - c0) * u64::from(r1 - r)).div_ceil(u64::from(r1 - r0)) as usize;
        worst = line(&row[start..], from + slope * start as f64, slope, worst);
    }
    worst
}

/// Greatest distance of heights from a straight line; NaN is ignored.
fn line(heights: &[f64], from: f64, slope: f64, mut worst: f64) -> f64 {
    for (k, &h) in heights.iter().enumerate() {
        let distance = (h - (from + slope * k as f64)).abs();
        if distance > worst {
            worst = distance;
        }
    }
    worst
}

/// For any triangle with its corners on samples.
fn of_triangle(band: &Band, corners: [[u32; 2]; 3]) -> f64 {
    let mut worst = 0f64;
    each_sample(corners, |column, row, weights| {
        let drawn: f64 = corners.iter().zip(weights).map(|(&[c, r], w)| w * band.drawn(c, r)).sum();
        let distance = (band.true_height(column, row) - drawn).abs();
        if distance > worst {
            worst = distance;
        }
    });
    worst
}

/// The samples in a triangle and on its edges, each with the weights of the corners.
pub fn each_sample(corners: [[u32; 2]; 3], mut found: impl FnMut(u32, u32, [f64; 3])) {
    let [a, b, c] = corners.map(|p| p.map(i64::from));
    let doubled = |[px, py]: [i64; 2], [qx, qy]: [i64; 2], [rx, ry]: [i64; 2]| (qx - px) * (ry - py) - (qy - py) * (rx - px);
    let whole = doubled(a, b, c);
    if whole == 0 {
        return;
    }
    let range = |k: usize| {
        let of = corners.map(|p| p[k]);
        of.into_iter().min().unwrap_or(0)..=of.into_iter().max().unwrap_or(0)
    };
    for row in range(1) {
        for column in range(0) {
            let p = [i64::from(column), i64::from(row)];
            let parts = [doubled(p, b, c), doubled(a, p, c), doubled(a, b, p)];
            if parts.iter().all(|&part| part * whole.signum() >= 0) {
                found(column, row, parts.map(|part| part as f64 / whole as f64));
            }
        }
    }
}
