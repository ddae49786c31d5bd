//! How far the rows of a mesh's bake are from the exact rows of the level that the mesh is the faces of.
//!
//! Both are asked about the same places: points drawn by lot in each leaf of the level, so that all leaves count the same. A
//! point is in a leaf by the level's tree, and in cells of the bake by the run time's locator. An object is exactly visible from
//! a leaf where one of its faces is on the boundary of a leaf that is.

use crate::level_mesh::{LevelMesh, metres};
use crate::random::Random;
use crate::world::World;
use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, Culler, Mode, View};
use enfilade::{BitMatrix, CellId, ObjectId};
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};
use glam::DVec3;

/// Tries to find a point of a leaf in its box, for each point that is wanted: leaves that are thin and askew may get fewer.
const TRIES: usize = 64;

/// A level, its mesh, its exact rows, and points to ask at.
pub struct Truth<'l> {
    pub world: &'l World,
    pub mesh: &'l LevelMesh,
    /// Leaves x leaves: leaf `i + 1` of the world is row `i`.
    pub rows: &'l BitMatrix,
    /// Leaves x objects: what is exactly visible from each leaf.
    pub objects: BitMatrix,
    /// Leaves, counted as rows are, each with a point of it in units of the level.
    pub points: Vec<(usize, DVec3)>,
}

/// What rows keep of pairs of a place and something to see.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Kept {
    /// Pairs that are exactly visible.
    pub visible: u64,
    /// Pairs that are kept and exactly hidden.
    pub hidden: u64,
    /// Of those, the ones that the bake's lower rows keep, too: another part of the cell sees what this place doesn't.
    pub witnessed: u64,
    /// Pairs that are exactly visible from the leaf and not kept: the cell is a part of the leaf.
    pub left_out: u64,
}

impl Kept {
    /// Hidden pairs that are kept, for each visible one.
    pub fn excess(&self) -> f64 {
        self.hidden as f64 / self.visible as f64
    }

    /// The same of the bake's lower rows: what no better proof takes away, but smaller cells might.
    pub fn witnessed_excess(&self) -> f64 {
        self.witnessed as f64 / self.visible as f64
    }

    /// Counts one place: what its upper and lower rows keep, and what is visible from it.
    fn add(&mut self, [upper, lower]: [&[u64]; 2], visible: &[u64]) {
        self.visible += count(visible, |v, _| v, upper);
        self.hidden += count(upper, |u, v| u & !v, visible);
        self.witnessed += count(lower, |l, v| l & !v, visible);
        self.left_out += count(visible, |v, u| v & !u, upper);
    }
}

/// Of objects and of leaves.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Figures {
    /// A point, and an object that it may see.
    pub objects: Kept,
    /// Ordered pairs of leaves; kept where a cell that a point of one is in sees a cell that a point of the other is in.
    pub leaves: Kept,
    /// Leaves that have a point.
    pub asked: usize,
    /// Points in no cell, from which everything counts as seen.
    pub nowhere: u64,
}

impl<'l> Truth<'l> {
    /// Draws up to `count` points in each leaf that has a way out.
    pub fn new(world: &'l World, mesh: &'l LevelMesh, rows: &'l BitMatrix, count: usize, seed: u64) -> Self {
        // 1. Which objects are on the boundary of each leaf, and which of those are visible.
        let (n, all) = (rows.rows(), mesh.scene.objects.len());
        let mut on_boundary = BitMatrix::new(n, all);
        for leaf in 0..n {
            let faces = world.leaves[leaf + 1].faces.iter().filter_map(|&f| mesh.objects.get(f));
            faces.flatten().for_each(|o| _ = on_boundary.set(leaf, o.index()));
        }
        let objects = product(rows, &on_boundary);

        // 2. Points.
        let (mut random, mut points) = (Random::new(seed), Vec::new());
        for leaf in (0..n).filter(|&leaf| world.leaves[leaf + 1].open && rows.count_row(leaf) > 1) {
            let bounds = world.leaves[leaf + 1].bounds;
            let mut tries = (0..count * TRIES)
                .map(|_| DVec3::from_array([0, 1, 2].map(|axis| random.real(bounds.min[axis], bounds.max[axis]))));
            points.extend(tries.by_ref().filter(|&p| world.leaf_at(p) == leaf + 1).take(count).map(|p| (leaf, p)));
        }
        Self { world, mesh, rows, objects, points }
    }

    /// Counts what the rows of a bake of the mesh keep. The file must have both bounds.
    pub fn figures(&self, file: &PvsFile) -> Figures {
        let (leaves, cells) = (self.rows.rows(), file.cells.len());
        // 1. The cells of each point; the one after the last is nowhere.
        let mut homes = Homes::new(file);
        let places: Vec<Vec<usize>> = self.points.iter().map(|&(_, p)| homes.cells(p)).collect();
        let mut cells_of_leaf = BitMatrix::new(leaves, cells + 1);
        let mut leaves_of_cell = BitMatrix::new(cells + 1, leaves);
        for ((leaf, _), place) in self.points.iter().zip(&places) {
            for &cell in place {
                cells_of_leaf.set(*leaf, cell);
                leaves_of_cell.set(cell, *leaf);
            }
        }

        // 2. Rows of both bounds, with all that is seen from nowhere.
        let bounds = file.bounds.as_ref().expect("both bounds");
        let rows = |columns: usize, sees: &dyn Fn(usize, usize) -> bool| {
            let mut rows = BitMatrix::new(cells + 1, columns);
            for cell in 0..=cells {
                (0..columns).filter(|&to| cell == cells || sees(cell, to)).for_each(|to| _ = rows.set(cell, to));
            }
            rows
        };
        let all = self.mesh.scene.objects.len();
        let of_objects = [
            rows(all, &|a, o| file.sees_object(CellId(a as u32), ObjectId(o as u32))),
            rows(all, &|a, o| bounds.objects_lower.get(a, o)),
        ];
        let of_cells = [
            rows(cells + 1, &|a, b| b == cells || file.sees_cell(CellId(a as u32), CellId(b as u32))),
            rows(cells + 1, &|a, b| b == cells || a == b || bounds.cells_lower.get(a, b)),
        ];
        let of_leaves = of_cells.map(|rows| product(&rows, &leaves_of_cell));

        // 3. Points and objects; leaves and leaves, of those that have points.
        let nowhere = places.iter().filter(|place| place[0] == cells).count() as u64;
        let mut figures = Figures { nowhere, ..Figures::default() };
        for ((leaf, _), place) in self.points.iter().zip(&places) {
            let [upper, lower] = [0, 1].map(|bound| union(&of_objects[bound], place.iter().copied()));
            figures.objects.add([&upper, &lower], self.objects.row(*leaf));
        }
        let mut asked = BitMatrix::new(1, leaves);
        self.points.iter().for_each(|&(leaf, _)| _ = asked.set(0, leaf));
        for leaf in asked.ones(0) {
            let [upper, lower] = [0, 1].map(|bound| union(&of_leaves[bound], cells_of_leaf.ones(leaf)));
            let visible: Vec<u64> = self.rows.row(leaf).iter().zip(asked.row(0)).map(|(a, b)| a & b).collect();
            figures.leaves.add([&upper, &lower], &visible);
        }
        figures.asked = asked.ones(0).count();
        figures
    }

    /// A camera path of `count` eyes at points drawn by lot, each looking level and any way: the eyes of a tour through all cells
    /// may be behind the faces.
    pub fn path(&self, count: usize, seed: u64) -> CameraPath {
        let mut random = Random::new(seed);
        let frames = (0..count).map(|_| {
            let eye = metres(self.points[random.below(self.points.len())].1);
            let (sin, cos) = random.real(0.0, std::f64::consts::TAU).sin_cos();
            PathFrame { eye, target: eye + DVec3::new(cos, 0.0, sin) }
        });
        CameraPath { name: "points of leaves".into(), fov_y_degrees: 65.0, near: 0.05, frames: frames.collect() }
    }
}

/// Finds the cells of points of the level.
pub struct Homes<'f> {
    file: &'f PvsFile,
    view: View,
}

impl<'f> Homes<'f> {
    pub fn new(file: &'f PvsFile) -> Self {
        Self { file, view: View::new(&Culler::new(file)) }
    }

    /// The cells that a point in units of the level is in; where it is in none, the number of cells.
    pub fn cells(&mut self, p: DVec3) -> Vec<usize> {
        let eye = metres(p) - self.file.origin;
        let mut cells = self.view.cull(&Camera::look_at(eye, eye + DVec3::X, 1.0, 1.0), Mode::Pvs).homes.to_vec();
        cells.sort_unstable();
        if cells.is_empty() { vec![self.file.cells.len()] } else { cells.iter().map(|c| c.index()).collect() }
    }
}

/// The union of rows.
fn union(rows: &BitMatrix, of: impl IntoIterator<Item = usize>) -> Vec<u64> {
    let mut all = vec![0; rows.columns().div_ceil(64)];
    for row in of {
        all.iter_mut().zip(rows.row(row)).for_each(|(a, b)| *a |= b);
    }
    all
}

/// The Boolean product: row `i` is the union of the rows of `b` that row `i` of `a` names.
fn product(a: &BitMatrix, b: &BitMatrix) -> BitMatrix {
    let mut out = BitMatrix::new(a.rows(), b.columns());
    for i in 0..a.rows() {
        out.row_mut(i).copy_from_slice(&union(b, a.ones(i)));
    }
    out
}

fn count(a: &[u64], of: impl Fn(u64, u64) -> u64, b: &[u64]) -> u64 {
    a.iter().zip(b).map(|(&a, &b)| u64::from(of(a, b).count_ones())).sum()
}
