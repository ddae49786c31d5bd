//! Error at voids: the distance of the rim of a coarse surface from the raster's rim.
//!
//! The raster's surface consists of its finest triangles with three heights; a tile's surface of its own such triangles. Each
//! sample on only one of the surfaces counts with its distance, in three dimensions, to a sample on the other. Distances come
//! from two sweeps (Danielsson, *Euclidean distance mapping*, 1980) over existing samples, so they are never too short.

use super::band::Band;
use super::deviation::each_sample;
use crate::grid::{Grid, Key};
use crate::mesh;
use std::ops::Range;

/// A part of a tile, by sample.
struct Part<'a> {
    band: &'a Band,
    /// First column and row.
    first: [u32; 2],
    /// Samples across and down.
    size: [usize; 2],
    spacing: [f64; 2],
}

/// A surface over a part: heights, NaN outside; and twice its area in cells.
struct Surface {
    heights: Vec<f64>,
    area: i64,
}

/// The greatest distance in the cells `rows` of a tile, metres: 0 if the surfaces are equal, infinite if one is empty there.
/// Other bands do not count.
pub fn of_cells(band: &Band, grid: &Grid, spacing: [f64; 2], key: Key, rows: Range<u32>) -> f64 {
    let last = grid.side() - 1;
    let first = [grid.column(key, 0), grid.row(key, rows.start)];
    let end = [grid.column(key, last), grid.row(key, rows.end)];
    let size = [0, 1].map(|k| (end[k] - first[k]) as usize + 1);
    let part = Part { band, first, size, spacing };
    let has_voids = (first[1]..=end[1]).any(|r| band.true_row(r, first[0], end[0]).iter().any(|h| h.is_nan()));
    // At level 0 they are equal.
    if !has_voids || key.level == 0 {
        return 0.0;
    }
    let raster = part.raster();
    let nearest = part.nearest(&raster);
    let mut worst = 0f64;
    for coarser in masks(band, grid, key, &rows) {
        worst = worst.max(part.distance((&raster, &nearest), &part.tile(grid, key, rows.clone(), coarser)));
    }
    worst
}

/// Sets of coarser neighbours that suffice: none and all; or every set, if there are voids in a corner of the tile.
fn masks(band: &Band, grid: &Grid, key: Key, rows: &Range<u32>) -> Vec<u8> {
    if key.level == grid.top() {
        return vec![0];
    }
    let last = grid.side() - 2;
    let has_voids = |i: u32, j: u32| {
        let [from, to] = [grid.column(key, i), grid.column(key, i + 1)];
        let mut of = grid.row(key, j)..=grid.row(key, j + 1);
        of.any(|row| band.true_row(row, from, to).iter().any(|h| h.is_nan()))
    };
    let corners = [[0, 0], [last, 0], [0, last], [last, last]];
    let in_a_corner = corners.into_iter().any(|[i, j]| rows.contains(&j) && has_voids(i, j));
    if in_a_corner { (0..16).collect() } else { vec![0, 15] }
}

impl Part<'_> {
    fn at(&self, column: u32, row: u32) -> usize {
        (row - self.first[1]) as usize * self.size[0] + (column - self.first[0]) as usize
    }

    fn empty(&self) -> Surface {
        Surface { heights: vec![f64::NAN; self.size[0] * self.size[1]], area: 0 }
    }

    /// The finest triangles.
    fn raster(&self) -> Surface {
        let mut surface = self.empty();
        for r in 0..self.size[1] as u32 - 1 {
            for c in 0..self.size[0] as u32 - 1 {
                for triangle in mesh::of_cell(c + self.first[0], r + self.first[1]) {
                    if triangle.iter().all(|&[c, r]| !self.band.true_height(c, r).is_nan()) {
                        triangle.iter().for_each(|&[c, r]| surface.heights[self.at(c, r)] = self.band.true_height(c, r));
                        surface.area += 1;
                    }
                }
            }
        }
        surface
    }

    /// A tile's triangles.
    fn tile(&self, grid: &Grid, key: Key, rows: Range<u32>, coarser: u8) -> Surface {
        let mut surface = self.empty();
        let cells = rows.flat_map(|j| (0..grid.side() - 1).map(move |i| (i, j)));
        for triangle in cells.flat_map(|(i, j)| mesh::drawn(i, j, grid.side(), coarser)) {
            let corners = triangle.map(|[i, j]| [grid.column(key, i), grid.row(key, j)]);
            let heights = corners.map(|[c, r]| self.band.drawn(c, r));
            if heights.iter().any(|h| h.is_nan()) {
                continue;
            }
            let [[ax, ay], [bx, by], [cx, cy]] = corners.map(|p| p.map(i64::from));
            surface.area += ((bx - ax) * (cy - ay) - (by - ay) * (cx - ax)).abs();
            each_sample(corners, |c, r, weights| {
                surface.heights[self.at(c, r)] = heights.iter().zip(weights).map(|(h, w)| h * w).sum();
            });
        }
        surface
    }

    /// The greatest distance of samples on one surface only from the other.
    fn distance(&self, (a, nearest): (&Surface, &[Option<u32>]), b: &Surface) -> f64 {
        let differ = a.heights.iter().zip(&b.heights).any(|(a, b)| a.is_nan() != b.is_nan());
        if !differ && a.area == b.area {
            return 0.0;
        }
        let apart = if differ { self.farthest(a, b, &self.nearest(b)).max(self.farthest(b, a, nearest)) } else { 0.0 };
        // Inside a triangle, at most its longest side is added.
        apart + self.spacing[0].hypot(self.spacing[1])
    }

    /// The greatest distance of samples of `from` that are not on `to`; `nearest` are samples of `to`.
    fn farthest(&self, from: &Surface, to: &Surface, nearest: &[Option<u32>]) -> f64 {
        let mut worst = 0f64;
        for (at, &height) in from.heights.iter().enumerate() {
            if height.is_nan() || !to.heights[at].is_nan() {
                continue;
            }
            let Some(target) = nearest[at] else { return f64::INFINITY };
            let flat = self.flat(at, target as usize);
            worst = worst.max(flat.hypot(height - to.heights[target as usize]));
        }
        worst
    }

    /// Metres between two samples in the plan.
    fn flat(&self, a: usize, b: usize) -> f64 {
        let width = self.size[0];
        let [across, down] = [(a % width).abs_diff(b % width), (a / width).abs_diff(b / width)];
        (across as f64 * self.spacing[0]).hypot(down as f64 * self.spacing[1])
    }

    /// For each sample, a near sample of a surface.
    fn nearest(&self, surface: &Surface) -> Vec<Option<u32>> {
        let on = |(at, h): (usize, &f64)| (!h.is_nan()).then_some(at as u32);
        let mut nearest: Vec<Option<u32>> = surface.heights.iter().enumerate().map(on).collect();
        let [width, height] = self.size;
        let offer = |nearest: &mut Vec<Option<u32>>, at: usize, from: usize| {
            let Some(offered) = nearest[from] else { return };
            let better = |has: u32| self.flat(at, offered as usize) < self.flat(at, has as usize);
            if nearest[at].is_none_or(better) {
                nearest[at] = Some(offered);
            }
        };
        // Down, then up; in each row from the previous row, then east and west.
        for sweep in 0..2 {
            for k in 0..height {
                let row = if sweep == 0 { k } else { height - 1 - k };
                let before = if sweep == 0 { row.checked_sub(1) } else { Some(row + 1).filter(|&r| r < height) };
                for c in 0..width {
                    let at = row * width + c;
                    if let Some(before) = before {
                        let columns = c.saturating_sub(1)..=(c + 1).min(width - 1);
                        columns.for_each(|c| offer(&mut nearest, at, before * width + c));
                    }
                }
                (1..width).for_each(|c| offer(&mut nearest, row * width + c, row * width + c - 1));
                (1..width).rev().for_each(|c| offer(&mut nearest, row * width + c - 1, row * width + c));
            }
        }
        nearest
    }
}
