//! How far each free voxel is from the nearest occupied one.
//!
//! Based on: Saito, Toriwaki, *New algorithms for Euclidean distance transformation*, 1994 (one axis after the other), within
//! eight voxels of a surface; farther off, bricks keep the nearest brick that something touches (Felzenszwalb, Huttenlocher,
//! *Distance transforms of sampled functions*, 2012), and of what is touched in those nearby the nearest counts.
//!
//! Distances are held as levels on a logarithmic scale, [`PER_OCTAVE`] steps for each doubling: the watershed asks for ratios.

use super::grid::{CELLS, Grid, SIDE, place_of};
use crate::parallel;
use glam::DVec3;
use std::ops::Range;

/// Steps of a level for each doubling of the distance: 2.2 % each.
pub const PER_OCTAVE: f64 = 31.75;

/// What levels are computed from, and those of bricks.
pub struct Distance<'g> {
    grid: &'g Grid,
    /// The least and greatest place of the occupied voxels of each detailed brick.
    boxes: Vec<[[u8; 3]; 2]>,
    /// For each brick the nearest that something touches.
    nearest: Vec<u32>,
    /// Of squares up to [`REACH`].
    scale: [u8; REACH as usize + 1],
    /// Of each brick that isn't detailed, the greatest in it; 0 where it is.
    pub bricks: Vec<u8>,
}

/// Levels within some of the detailed bricks; those of all take 512 bytes for each.
pub struct Levels<'d> {
    bricks: &'d [u8],
    first: usize,
    voxels: Vec<[u8; CELLS]>,
}

impl Levels<'_> {
    /// The level of a voxel, or of an undivided brick; 0 is occupied.
    #[inline]
    pub fn get(&self, brick: usize, detail: Option<usize>, voxel: usize) -> u8 {
        detail.map_or_else(|| self.bricks[brick], |d| self.voxels[d - self.first][voxel])
    }
}

/// The level of a distance between the middles of two voxels, in voxels; 256 voxels and more are one level.
pub fn level(distance: f64) -> u8 {
    1 + (PER_OCTAVE * distance.max(1.0).log2()).round().min(254.0) as u8
}

/// The distance of a level, in voxels.
pub fn voxels_of(level: u8) -> f64 {
    ((f64::from(level) - 1.0) / PER_OCTAVE).exp2()
}

/// Farther than this, in voxels, half a brick matters little.
const WIDE: f64 = 48.0;
/// No surface anywhere.
const NONE: u32 = u32::MAX;
/// Squares above this are too far for the near field.
const REACH: u16 = (SIDE * SIDE) as u16;

impl<'g> Distance<'g> {
    /// Of a grid.
    pub fn new(grid: &'g Grid) -> Self {
        let boxes = parallel::map_range(0..grid.occupied.len(), |d| touched_box(grid, d));
        let scale = std::array::from_fn(|square| level((square as f64).sqrt()));
        let mut out = Self { grid, boxes, nearest: nearest_bricks(grid), scale, bricks: Vec::new() };
        out.bricks = parallel::map_range(0..grid.len(), |brick| out.of_brick(brick));
        out
    }

    /// Levels within detailed bricks, given by their places in [`Grid::occupied`].
    pub fn levels(&self, details: Range<usize>) -> Levels<'_> {
        let first = details.start;
        Levels { bricks: &self.bricks, first, voxels: parallel::map_range(details, |d| self.of_voxels(d)) }
    }

    fn of_voxels(&self, detail: usize) -> [u8; CELLS] {
        let brick = self.grid.brick_of[detail] as usize;
        let squares = near(self.grid, brick);
        let mut around: Option<Vec<u32>> = None;
        let corner = self.grid.corner(brick);
        std::array::from_fn(|v| {
            if squares[v] == 0 {
                return 0;
            }
            if squares[v] <= REACH {
                return self.scale[squares[v] as usize];
            }
            let [x, y, z] = place_of(v).map(|c| c as f64 + 0.5);
            let found = self.far(around.get_or_insert_with(|| self.features(brick)), corner + DVec3::new(x, y, z));
            level(found.max(SIDE as f64))
        })
    }

    fn of_brick(&self, brick: usize) -> u8 {
        if self.grid.detail(brick).is_some() {
            return 0;
        }
        // The most of it, so that a brick beside the middle of a passage doesn't narrow it.
        let (features, half) = (self.features(brick), 0.5 * SIDE as f64);
        let at = |x: f64, y: f64, z: f64| self.far(&features, self.grid.corner(brick) + half + DVec3::new(x, y, z));
        let middle = at(0.0, 0.0, 0.0);
        if middle > WIDE {
            return level(middle + half);
        }
        let steps = [-3.0, 0.0, 3.0];
        let most = |x: f64| steps.iter().flat_map(|&y| steps.map(|z| at(x, y, z))).fold(0.0, f64::max);
        level(steps.map(most).into_iter().fold(0.0, f64::max))
    }

    /// Touched bricks of which one has the surface nearest to what is in a brick, the nearest first.
    fn features(&self, brick: usize) -> Vec<u32> {
        let mut out: Vec<u32> = Vec::with_capacity(27);
        for k in 0..27i64 {
            if let Some(n) = self.grid.beside(brick, [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1])
                && self.nearest[n] != NONE
                && !out.contains(&self.nearest[n])
            {
                out.push(self.nearest[n]);
            }
        }
        let here = self.grid.place(brick);
        let square = |f: u32| -> usize { (0..3).map(|a| self.grid.place(f as usize)[a].abs_diff(here[a]).pow(2)).sum() };
        out.sort_by_key(|&f| (square(f), f));
        out
    }

    /// How far the nearest surface in some bricks is from a point, in voxels.
    fn far(&self, features: &[u32], p: DVec3) -> f64 {
        let mut best = f64::INFINITY;
        for &f in features {
            let d = self.grid.detail(f as usize).unwrap_or_default();
            let to = self.grid.corner(f as usize) + 0.5 - p;
            // No middle of a touched voxel is nearer than the box of them all.
            let [low, high] = self.boxes[d].map(|c| to + DVec3::from_array(c.map(f64::from)));
            if low.max(-high).max(DVec3::ZERO).length_squared() >= best {
                continue;
            }
            // Squares along each axis, so that a voxel is two sums; those of a layer that is too far are none.
            let squares = to.to_array().map(|c| std::array::from_fn::<f64, SIDE, _>(|k| (c + k as f64).powi(2)));
            for (layer, dz) in self.grid.occupied[d].iter().zip(squares[2]).filter(|(layer, _)| **layer != 0) {
                let mut bits = if dz < best { *layer } else { 0 };
                while bits != 0 {
                    let v = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    best = best.min(dz + squares[1][v / SIDE] + squares[0][v % SIDE]);
                }
            }
        }
        best.sqrt()
    }
}

/// The least and the greatest place of the occupied voxels of a brick.
fn touched_box(grid: &Grid, detail: usize) -> [[u8; 3]; 2] {
    let touched = (0..CELLS).filter(|&v| grid.is_occupied(detail, v)).map(|v| place_of(v).map(|c| c as u8));
    touched.fold([[u8::MAX; 3], [0; 3]], |[low, high], p| {
        [std::array::from_fn(|a| low[a].min(p[a])), std::array::from_fn(|a| high[a].max(p[a]))]
    })
}

/// Squares of the distances, in voxels, within [`SIDE`] voxels; more where there is nothing so near.
fn near(grid: &Grid, brick: usize) -> [u16; CELLS] {
    const WINDOW: usize = 3 * SIDE;
    const FAR: u16 = 4 * REACH;
    // Along x: rows of three bricks as bits.
    let mut along = [[[FAR; SIDE]; WINDOW]; WINDOW];
    for bz in 0..3 {
        for by in 0..3 {
            let words: [Option<&[u64; SIDE]>; 3] = std::array::from_fn(|bx| {
                let found = grid.beside(brick, [bx as i64 - 1, by as i64 - 1, bz as i64 - 1]);
                found.and_then(|b| grid.detail(b)).map(|d| &grid.occupied[d])
            });
            if words.iter().all(Option::is_none) {
                continue;
            }
            for z in 0..SIDE {
                for y in 0..SIDE {
                    let byte = |w: Option<&[u64; SIDE]>| w.map_or(0, |w| (w[z] >> (y * SIDE)) as u32 & 0xff);
                    let row = byte(words[0]) | byte(words[1]) << 8 | byte(words[2]) << 16;
                    if row == 0 {
                        continue;
                    }
                    for (x, out) in along[bz * SIDE + z][by * SIDE + y].iter_mut().enumerate() {
                        let up = (row >> (x + SIDE)).trailing_zeros();
                        let down = (row << (31 - x - SIDE)).leading_zeros();
                        let steps = up.min(down) as u16;
                        if steps as usize <= SIDE {
                            *out = steps * steps;
                        }
                    }
                }
            }
        }
    }
    // Along y, then z.
    let reduce = |rows: &[[u16; SIDE]], out: &mut [u16; SIDE], at: usize| {
        for (i, row) in rows[at..=at + 2 * SIDE].iter().enumerate() {
            let steps = (i as i32 - SIDE as i32).unsigned_abs() as u16;
            for x in 0..SIDE {
                out[x] = out[x].min(row[x] + steps * steps);
            }
        }
    };
    let mut across = [[[FAR; SIDE]; WINDOW]; SIDE];
    for z in 0..WINDOW {
        for (y, plane) in across.iter_mut().enumerate() {
            reduce(&along[z], &mut plane[z], y);
        }
    }
    let mut out = [FAR; CELLS];
    for z in 0..SIDE {
        for (y, plane) in across.iter().enumerate() {
            let mut row = [FAR; SIDE];
            reduce(plane, &mut row, z);
            out[(z * SIDE + y) * SIDE..][..SIDE].copy_from_slice(&row);
        }
    }
    out
}

/// For each brick the nearest one that something touches, by their middles.
fn nearest_bricks(grid: &Grid) -> Vec<u32> {
    let [nx, ny, nz] = grid.bricks;
    let mut nearest: Vec<u32> = vec![NONE; grid.len()];
    let square = |from: usize, to: u32, axes: usize| -> i64 {
        let (a, b) = (grid.place(from), grid.place(to as usize));
        (0..axes).map(|k| (a[k] as i64 - b[k] as i64).pow(2)).sum()
    };
    // Along x: the last one seen from either end.
    parallel::for_each_chunk(&mut nearest, nx, |row, line| {
        let mut take = |order: &mut dyn Iterator<Item = usize>| {
            let mut last = NONE;
            for x in order {
                let brick = row * nx + x;
                if grid.detail(brick).is_some() {
                    last = brick as u32;
                }
                if last != NONE && (line[x] == NONE || square(brick, last, 1) < square(brick, line[x], 1)) {
                    line[x] = last;
                }
            }
        };
        take(&mut (0..nx));
        take(&mut (0..nx).rev());
    });
    // Along y and z: the lower envelope of parabolas.
    for (axis, length, stride) in [(1, ny, nx), (2, nz, nx * ny)] {
        let starts: Vec<usize> = if axis == 1 {
            (0..nz).flat_map(|z| (0..nx).map(move |x| z * nx * ny + x)).collect()
        } else {
            (0..nx * ny).collect()
        };
        let mut next: Vec<u32> = vec![NONE; grid.len()];
        let lines: Vec<(usize, Vec<u32>)> = parallel::map(&starts, |&start| {
            let at = |i: usize| nearest[start + i * stride];
            // Height of each parabola at its own place: the distance along the axes done before.
            let height = |i: usize| square(start + i * stride, at(i), axis);
            let mut hull: Vec<(usize, f64)> = Vec::new();
            for i in (0..length).filter(|&i| at(i) != NONE) {
                let meet = |j: usize| {
                    let (a, b) = (height(i) + (i * i) as i64, height(j) + (j * j) as i64);
                    (a - b) as f64 / (2.0 * (i - j) as f64)
                };
                while hull.last().is_some_and(|&(j, from)| meet(j) <= from) {
                    hull.pop();
                }
                let from = hull.last().map_or(f64::NEG_INFINITY, |&(j, _)| meet(j));
                hull.push((i, from));
            }
            let mut k = 0;
            let line = (0..length).map(|i| {
                while k + 1 < hull.len() && hull[k + 1].1 < i as f64 {
                    k += 1;
                }
                hull.get(k).map_or(NONE, |&(j, _)| at(j))
            });
            (start, line.collect::<Vec<u32>>())
        });
        for (start, line) in lines {
            for (i, found) in line.into_iter().enumerate() {
                next[start + i * stride] = found;
            }
        }
        nearest = next;
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    /// Against every occupied voxel, to a step of the scale near surfaces and to a voxel and a half far from them.
    #[test]
    fn distances_are_those_to_the_nearest_occupied_voxel() {
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let triangles = [
            [corner(0., 0., 0.), corner(9., 0., 0.), corner(0., 0., 7.)],
            [corner(1., 0., 1.), corner(1., 6., 2.), corner(3., 0., 6.)],
            [corner(20., 9., 3.), corner(21., 8., 3.), corner(20., 8., 6.)],
        ];
        let grid = Grid::new(&triangles, DVec2::X, 0.4);
        let found = Distance::new(&grid);
        let levels = found.levels(0..grid.occupied.len());
        let middle = |brick: usize, v: usize| grid.corner(brick) + DVec3::from_array(place_of(v).map(|c| c as f64 + 0.5));
        let mut occupied = Vec::new();
        for d in 0..grid.occupied.len() {
            let touched = (0..CELLS).filter(|&v| grid.is_occupied(d, v));
            occupied.extend(touched.map(|v| middle(grid.brick_of[d] as usize, v)));
        }
        let exact = |p: DVec3| occupied.iter().map(|o| o.distance(p)).fold(f64::INFINITY, f64::min);
        for brick in (0..grid.len()).step_by(3) {
            match grid.detail(brick) {
                Some(d) => {
                    for v in (0..CELLS).step_by(7).filter(|&v| !grid.is_occupied(d, v)) {
                        let (e, f) = (exact(middle(brick, v)), voxels_of(levels.get(brick, Some(d), v)));
                        let slack = if e < 7.9 { 0.02 * e + 1e-9 } else { 1.5 };
                        assert!((e - f).abs() <= slack, "{e} {f}");
                    }
                }
                None => {
                    let steps = [-3.5, -1.5, 0.5, 2.5];
                    let all =
                        steps.iter().flat_map(|&x| steps.iter().flat_map(move |&y| steps.map(|z| DVec3::new(x, y, z))));
                    let most = all.map(|d| exact(grid.corner(brick) + 4.0 + d)).fold(0.0, f64::max);
                    let f = voxels_of(found.bricks[brick]);
                    assert!((most - f).abs() <= 2.5 + 0.05 * most, "{most} {f}");
                }
            }
        }
    }
}
