//! Voxels in bricks of 8 x 8 x 8: a brick that no triangle touches is one value.
//!
//! Based on: Schwarz, Seidel, *Fast parallel surface and solid voxelization on GPUs*, 2010, for which voxels a triangle touches
//! (the same answer as the separating axes of Akenine-Moller, *Fast 3D triangle-box overlap testing*, 2001, as a few linear
//! functions). Every touched voxel is occupied, so two free neighbours, across a face, an edge or a corner, have no triangle
//! between their middles: whatever is free and hangs together in voxels does so in space.

use crate::geom::Aabb;
use crate::parallel;
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Voxels along a brick's edge.
pub const SIDE: usize = 8;
/// Voxels of a brick.
pub const CELLS: usize = SIDE * SIDE * SIDE;

/// Coordinates turned about +Y and moved, in voxels: walls of most buildings run along the axes then.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Cosine and sine of the turn.
    turn: DVec2,
    /// What lies at (0, 0, 0), turned but not scaled, metres.
    origin: DVec3,
    /// Edge of a voxel, metres.
    pub voxel: f64,
}

impl Frame {
    fn turned(turn: DVec2, p: DVec3) -> DVec3 {
        DVec3::new(turn.x * p.x + turn.y * p.z, p.y, turn.x * p.z - turn.y * p.x)
    }

    /// A point in voxels.
    pub fn to_grid(self, p: DVec3) -> DVec3 {
        (Self::turned(self.turn, p) - self.origin) / self.voxel
    }

    /// A point in metres.
    pub fn to_world(self, q: DVec3) -> DVec3 {
        self.direction(q * self.voxel + self.origin)
    }

    /// A direction of the grid in the scene's coordinates.
    pub fn direction(&self, q: DVec3) -> DVec3 {
        Self::turned(DVec2::new(self.turn.x, -self.turn.y), q)
    }
}

/// Which voxels are touched.
pub struct Grid {
    /// Where the grid lies.
    pub frame: Frame,
    /// Bricks along each axis.
    pub bricks: [usize; 3],
    /// For each brick, one more than its place in `occupied`; 0 where nothing touches it.
    index: Vec<u32>,
    /// A bit a voxel: word `z`, bit `8 y + x`.
    pub occupied: Vec<[u64; SIDE]>,
    /// The brick of each entry of `occupied`, ascending.
    pub brick_of: Vec<u32>,
}

impl Grid {
    /// The grid around `triangles`; nothing touches the bricks on its rim. `axis` (unit, in plan: x and z) becomes the grid's
    /// first axis; `voxel` in metres.
    pub fn new(triangles: &[[DVec3; 3]], axis: DVec2, voxel: f64) -> Self {
        let bounds = Aabb::of(triangles.iter().flatten().map(|&p| Frame::turned(axis, p)));
        let margin = voxel * (SIDE + 1) as f64;
        let size = (bounds.size() + 2.0 * margin) / (voxel * SIDE as f64);
        let bricks = size.to_array().map(|x| x.ceil().max(1.0) as usize);
        let whole = DVec3::from_array(bricks.map(|n| (n * SIDE) as f64 * voxel));
        // A little off, so that walls at round numbers don't lie between two voxels and touch both.
        let off = DVec3::new(0.31, 0.37, 0.29) * voxel;
        let frame = Frame { turn: axis, origin: bounds.centre() - whole * 0.5 + off, voxel };

        let mut touched: Vec<(u32, u32)> = parallel::flat_map_range(0..triangles.len(), |i| {
            let cover = Cover::new(&triangles[i].map(|p| frame.to_grid(p)), SIDE as f64);
            let [lo, hi] = cover.range(bricks);
            let mut of_triangle = Vec::new();
            for z in lo[2]..hi[2] {
                for y in lo[1]..hi[1] {
                    for x in lo[0]..hi[0] {
                        if cover.touches(DVec3::new(x as f64, y as f64, z as f64)) {
                            of_triangle.push((((z * bricks[1] + y) * bricks[0] + x) as u32, i as u32));
                        }
                    }
                }
            }
            of_triangle
        });
        parallel::sort(&mut touched);
        let groups: Vec<&[(u32, u32)]> = touched.chunk_by(|a, b| a.0 == b.0).collect();
        let fill = |group: &&[(u32, u32)]| {
            let mut bits = [0u64; SIDE];
            let low = corner_of(group[0].0, bricks);
            for &(_, t) in *group {
                let corners = triangles[t as usize].map(|p| frame.to_grid(p) - low);
                Cover::new(&corners, 1.0).fill(&mut bits);
            }
            bits
        };
        let occupied: Vec<[u64; SIDE]> = parallel::map(&groups, fill);
        let brick_of: Vec<u32> = groups.iter().map(|g| g[0].0).collect();
        let mut grid = Self { frame, bricks, index: vec![0; bricks.iter().product()], occupied, brick_of };
        for (i, &b) in grid.brick_of.iter().enumerate() {
            grid.index[b as usize] = i as u32 + 1;
        }
        grid
    }

    /// Number of bricks.
    pub fn len(&self) -> usize {
        self.index.len()
    }

    /// The place of a brick's voxels in `occupied`, where it has some.
    #[inline]
    pub fn detail(&self, brick: usize) -> Option<usize> {
        (self.index[brick] as usize).checked_sub(1)
    }

    /// A brick's place along each axis.
    #[inline]
    pub fn place(&self, brick: usize) -> [usize; 3] {
        let [nx, ny, _] = self.bricks;
        [brick % nx, brick / nx % ny, brick / (nx * ny)]
    }

    /// The brick at a place, where there is one.
    #[inline]
    pub fn brick_at(&self, place: [i64; 3]) -> Option<usize> {
        let [nx, ny, nz] = self.bricks;
        let inside = (0..3).all(|a| place[a] >= 0 && place[a] < [nx, ny, nz][a] as i64);
        inside.then(|| (place[2] as usize * ny + place[1] as usize) * nx + place[0] as usize)
    }

    /// The brick beside `brick`.
    #[inline]
    pub fn beside(&self, brick: usize, by: [i64; 3]) -> Option<usize> {
        let place = self.place(brick);
        self.brick_at(std::array::from_fn(|a| place[a] as i64 + by[a]))
    }

    /// The least corner of a brick, in voxels.
    pub fn corner(&self, brick: usize) -> DVec3 {
        corner_of(brick as u32, self.bricks)
    }

    /// The brick and the voxel in it that hold a point given in voxels.
    pub fn locate(&self, q: DVec3) -> Option<(usize, usize)> {
        let [x, y, z] = q.floor().to_array().map(|x| x as i64);
        let brick = self.brick_at([x, y, z].map(|c| c.div_euclid(SIDE as i64)))?;
        let [x, y, z] = [x, y, z].map(|c| c.rem_euclid(SIDE as i64) as usize);
        Some((brick, voxel(x, y, z)))
    }

    /// Whether a voxel of a detailed brick is touched.
    #[inline]
    pub fn is_occupied(&self, detail: usize, voxel: usize) -> bool {
        self.occupied[detail][voxel / 64] >> (voxel % 64) & 1 != 0
    }

    /// The bricks of some layers along the third axis.
    pub fn layers(&self, layers: Range<usize>) -> Range<usize> {
        let layer = self.bricks[0] * self.bricks[1];
        layers.start * layer..layers.end * layer
    }

    /// The places in `occupied` of the detailed ones among consecutive bricks.
    pub fn details(&self, bricks: Range<usize>) -> Range<usize> {
        let at = |brick: usize| self.brick_of.partition_point(|&b| (b as usize) < brick);
        at(bricks.start)..at(bricks.end)
    }

    /// True for bricks on the grid's rim.
    pub fn at_rim(&self, brick: usize) -> bool {
        let place = self.place(brick);
        (0..3).any(|a| place[a] == 0 || place[a] + 1 == self.bricks[a])
    }
}

/// The number of a voxel in its brick.
#[inline]
pub const fn voxel(x: usize, y: usize, z: usize) -> usize {
    (z * SIDE + y) * SIDE + x
}

/// A voxel's place in its brick.
#[inline]
pub const fn place_of(voxel: usize) -> [usize; 3] {
    [voxel % SIDE, voxel / SIDE % SIDE, voxel / (SIDE * SIDE)]
}

fn corner_of(brick: u32, [nx, ny, _]: [usize; 3]) -> DVec3 {
    let b = brick as usize;
    DVec3::new((b % nx) as f64, (b / nx % ny) as f64, (b / (nx * ny)) as f64) * SIDE as f64
}

/// Which boxes of a lattice a triangle touches.
struct Cover {
    size: f64,
    bounds: Aabb,
    /// The plane: `n . p` at the box's least corner must lie within this range.
    normal: DVec3,
    slab: [f64; 2],
    /// For each axis that is looked along, the edges' inward normals and the least value at the box's least corner.
    edges: [[(DVec2, f64); 3]; 3],
}

/// Boxes grow by this share of their edge, so that rounding loses no touch.
const SLACK: f64 = 1e-6;

impl Cover {
    fn new(t: &[DVec3; 3], size: f64) -> Self {
        let grown = size * (1.0 + 2.0 * SLACK);
        // The least corner of the grown box.
        let t = t.map(|p| p + size * SLACK);
        let n = (t[1] - t[0]).cross(t[2] - t[0]);
        let reach = |x: f64| (x * grown).min(0.0)..=(x * grown).max(0.0);
        let sum =
            |end: fn(&std::ops::RangeInclusive<f64>) -> f64| [n.x, n.y, n.z].map(|x| end(&reach(x))).iter().sum::<f64>();
        let at = n.dot(t[0]);
        let edges = std::array::from_fn(|axis| {
            let flat = t.map(|p| flat(p, axis));
            let turn = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
            let sign = if turn < 0.0 { -1.0 } else { 1.0 };
            std::array::from_fn(|i| {
                let e = flat[(i + 1) % 3] - flat[i];
                // Seen edge on, there is no inside: every edge passes.
                let inward = if turn == 0.0 { DVec2::ZERO } else { DVec2::new(-e.y, e.x) * sign };
                (inward, inward.dot(flat[i]) - (inward.x * grown).max(0.0) - (inward.y * grown).max(0.0))
            })
        });
        let slab = [at - sum(|r| *r.end()), at - sum(|r| *r.start())];
        Self { size, bounds: Aabb::of(t.map(|p| p - 2.0 * size * SLACK)).union(Aabb::of(t)), normal: n, slab, edges }
    }

    /// The box at a lattice place.
    fn touches(&self, place: DVec3) -> bool {
        let p = place * self.size;
        let at = self.normal.dot(p);
        at >= self.slab[0]
            && at <= self.slab[1]
            && (0..3).all(|axis| self.edges[axis].iter().all(|&(n, least)| n.dot(flat(p, axis)) >= least))
    }

    /// Lattice places that the triangle's own box touches, from and up to (exclusive).
    fn range(&self, most: [usize; 3]) -> [[usize; 3]; 2] {
        let at = |p: DVec3, more: f64, a: usize| ((p[a] / self.size).floor() + more).clamp(0.0, most[a] as f64) as usize;
        [std::array::from_fn(|a| at(self.bounds.min, 0.0, a)), std::array::from_fn(|a| at(self.bounds.max, 1.0, a))]
    }

    /// Sets the bits of one brick.
    fn fill(&self, bits: &mut [u64; SIDE]) {
        let [lo, hi] = self.range([SIDE; 3]);
        for (z, word) in bits.iter_mut().enumerate().take(hi[2]).skip(lo[2]) {
            for y in lo[1]..hi[1] {
                for x in lo[0]..hi[0] {
                    let bit = 1u64 << (y * SIDE + x);
                    if *word & bit == 0 && self.touches(DVec3::new(x as f64, y as f64, z as f64)) {
                        *word |= bit;
                    }
                }
            }
        }
    }
}

/// The two coordinates across an axis.
#[inline]
fn flat(p: DVec3, axis: usize) -> DVec2 {
    match axis {
        0 => DVec2::new(p.y, p.z),
        1 => DVec2::new(p.z, p.x),
        _ => DVec2::new(p.x, p.y),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points all over triangles of any shape lie in occupied voxels, and no voxel farther from them than its own half-diagonal
    /// is occupied.
    #[test]
    fn a_triangle_occupies_the_voxels_that_it_touches() {
        let mut state = 7u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for _ in 0..60 {
            let t: [DVec3; 3] = std::array::from_fn(|_| DVec3::new(random(), random(), random()) * 6.0);
            let angle = random();
            let grid = Grid::new(&[t], DVec2::new(angle.cos(), angle.sin()), 0.3);
            let mut near = std::collections::BTreeSet::new();
            for i in 0..=200 {
                for j in 0..=200 - i {
                    let p = t[0] + (t[1] - t[0]) * (f64::from(i) / 200.0) + (t[2] - t[0]) * (f64::from(j) / 200.0);
                    let (brick, voxel) = grid.locate(grid.frame.to_grid(p)).unwrap();
                    let detail = grid.detail(brick).expect("a touched brick has voxels");
                    assert!(grid.is_occupied(detail, voxel));
                    near.insert((brick, voxel));
                }
            }
            let occupied: u32 = grid.occupied.iter().flatten().map(|w| w.count_ones()).sum();
            // Sampled at 3 cm and less, at most a few touches of corners are missed.
            assert!(
                occupied as usize >= near.len() && (occupied as usize) < near.len() * 13 / 10 + 8,
                "{occupied} {}",
                near.len()
            );
        }
    }

    #[test]
    fn to_world_undoes_to_grid() {
        let t = [DVec3::ZERO, DVec3::new(3.0, 1.0, 0.0), DVec3::new(1.0, 2.0, 5.0)];
        let grid = Grid::new(&[t], DVec2::new(0.8, 0.6), 0.2);
        for p in t {
            assert!(grid.frame.to_world(grid.frame.to_grid(p)).distance(p) < 1e-12);
        }
    }
}
