//! Places buildings that are simple enough to walk a ray through.
use crate::boxes::{Building, block};
use crate::random::Places;
use enfilade::cells::PortalKind;
use enfilade::file::PvsFile;
use enfilade::scene::Scene;
use enfilade::{CellId, ObjectId};
use glam::DVec3;
use std::collections::BTreeSet;

/// Is told the mirrors that turned a ray so far, the cell that it is in, and what it meets there.
pub type Visit<'v> = dyn FnMut(&[usize], CellId, Option<ObjectId>) + 'v;

/// What is between a box and the next along an axis.
#[derive(Clone, Copy, PartialEq)]
pub enum Face {
    Wall,
    /// Nothing: both boxes belong to one cell.
    Open,
    /// A rectangle.
    Door(DVec3, DVec3),
}

/// A grid of boxes, some joined into cells that are not convex, with doors anywhere: simple enough to walk a ray through.
pub struct Grid {
    size: [usize; 3],
    /// Coordinates of the box faces.
    lines: [Vec<f64>; 3],
    /// By box and axis: what is between it and the next.
    pub faces: Vec<[Face; 3]>,
    pub cell_of: Vec<CellId>,
    things: Vec<(usize, DVec3, DVec3)>,
    /// Doors that nothing is seen through: box, axis, and whether upwards.
    pub blocked: BTreeSet<(usize, usize, bool)>,
    /// Mirrors on walls: the box that they are seen from, the axis, whether it is the box's upper face, and two corners.
    pub mirrors: Vec<(usize, usize, bool, DVec3, DVec3)>,
}

impl Grid {
    pub fn random(random: &mut Places) -> Self {
        let size = [2 + random.below(4), 1 + random.below(2), 2 + random.below(4)];
        let lines = size.map(|n| {
            let mut at = random.unit() * 50.0;
            (0..=n)
                .map(|_| {
                    at += 1.0 + random.unit() * 4.0;
                    at
                })
                .collect::<Vec<f64>>()
        });
        let n = size[0] * size[1] * size[2];
        let mut grid = Self {
            size,
            lines,
            faces: vec![[Face::Wall; 3]; n],
            cell_of: Vec::new(),
            things: Vec::new(),
            blocked: BTreeSet::new(),
            mirrors: Vec::new(),
        };
        let group = grid.open_walls(random);
        let mut names: Vec<usize> = group.clone();
        names.sort();
        names.dedup();
        grid.cell_of = group.iter().map(|g| CellId(names.binary_search(g).unwrap() as u32)).collect();
        grid.put_things(random);
        grid
    }

    /// Opens some walls and puts doors into others. Returns a number of each box that those of one cell share.
    fn open_walls(&mut self, random: &mut Places) -> Vec<usize> {
        let n = self.faces.len();
        let mut group: Vec<usize> = (0..n).collect();
        for i in 0..n {
            for axis in 0..3 {
                let Some(next) = self.next(i, axis, true) else { continue };
                let ((a, b), choice) = (self.bounds(i), random.unit());
                if choice < 0.25 {
                    self.faces[i][axis] = Face::Open;
                    let (from, to) = (group[next], group[i]);
                    group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
                } else if choice < 0.75 {
                    let (u, v) = (random.between(a, b), random.between(a, b));
                    let (mut low, mut high) = (u.min(v), u.max(v));
                    (low[axis], high[axis]) = (b[axis], b[axis]);
                    self.faces[i][axis] = Face::Door(low, high);
                }
            }
        }
        // A door within one cell would be a hole in its own wall: walled up.
        for i in 0..n {
            for axis in 0..3 {
                if let (Face::Door(..), Some(next)) = (self.faces[i][axis], self.next(i, axis, true))
                    && group[i] == group[next]
                {
                    self.faces[i][axis] = Face::Wall;
                }
            }
        }
        group
    }

    fn put_things(&mut self, random: &mut Places) {
        for _ in 0..60 {
            let i = random.below(self.faces.len());
            let (a, b) = self.bounds(i);
            let (a, b) = (a.lerp(b, 0.01), a.lerp(b, 0.99));
            let (u, v) = (random.between(a, b), random.between(a, b));
            self.things.push((i, u, u.lerp(v, 0.3)));
        }
        self.things.iter_mut().for_each(|t| (t.1, t.2) = (t.1.min(t.2), t.1.max(t.2)));
    }

    fn place(&self, i: usize) -> [usize; 3] {
        [i % self.size[0], i / self.size[0] % self.size[1], i / self.size[0] / self.size[1]]
    }

    fn next(&self, i: usize, axis: usize, up: bool) -> Option<usize> {
        let stride = [1, self.size[0], self.size[0] * self.size[1]][axis];
        match (self.place(i)[axis], up) {
            (at, true) => (at + 1 < self.size[axis]).then_some(i + stride),
            (at, false) => (at > 0).then(|| i - stride),
        }
    }

    pub fn bounds(&self, i: usize) -> (DVec3, DVec3) {
        let at = self.place(i);
        let corner = |d: usize| DVec3::new(self.lines[0][at[0] + d], self.lines[1][at[1] + d], self.lines[2][at[2] + d]);
        (corner(0), corner(1))
    }

    pub fn building(&self) -> (Scene, PvsFile) {
        let mut b = Building::default();
        let cells = self.cell_of.iter().map(|c| c.0).max().unwrap() + 1;
        for c in 0..cells {
            let pieces = (0..self.cell_of.len()).filter(|&i| self.cell_of[i] == CellId(c));
            b.cell(
                "",
                pieces
                    .map(|i| {
                        let (a, b) = self.bounds(i);
                        block(a, b)
                    })
                    .collect(),
            );
        }
        for i in 0..self.faces.len() {
            for axis in 0..3 {
                if let (Face::Door(low, high), Some(next)) = (self.faces[i][axis], self.next(i, axis, true)) {
                    b.portal(self.cell_of[i], self.cell_of[next], low, high, PortalKind::Opening);
                }
            }
        }
        for (_, low, high) in &self.things {
            b.thing("", *low, *high);
        }
        b.finish()
    }

    /// The doors, in the order of the file's portals: box and axis.
    pub fn doors(&self) -> Vec<(usize, usize)> {
        let all = (0..self.faces.len()).flat_map(|i| (0..3).map(move |axis| (i, axis)));
        all.filter(|&(i, axis)| matches!(self.faces[i][axis], Face::Door(..))).collect()
    }

    /// Hangs mirrors on some of the walls, whole or in part.
    pub fn hang_mirrors(&mut self, random: &mut Places, share: f64) {
        for i in 0..self.faces.len() {
            for (axis, up) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
                let wall = match self.next(i, axis, up) {
                    None => true,
                    Some(next) => self.faces[if up { i } else { next }][axis] == Face::Wall,
                };
                if wall && random.unit() < share {
                    let (a, b) = self.bounds(i);
                    let (u, v) = (random.between(a, b), random.between(a, b));
                    let (mut low, mut high) = if random.unit() < 0.5 { (a, b) } else { (u.min(v), u.max(v)) };
                    let at = if up { b[axis] } else { a[axis] };
                    (low[axis], high[axis]) = (at, at);
                    self.mirrors.push((i, axis, up, low, high));
                }
            }
        }
    }

    /// Walks a ray from box to box, and off at most `depth` mirrors: `visit` is told the mirrors that turned it so far, each cell that it
    /// enters, and each thing that it meets on its way.
    pub fn walk(&self, mut i: usize, mut eye: DVec3, mut along: DVec3, depth: usize, visit: &mut Visit<'_>) {
        let (mut entered, mut turned) = (0.0, Vec::new());
        for _ in 0..100 {
            visit(&turned, self.cell_of[i], None);
            let (low, high) = self.bounds(i);
            let exit = |axis: usize| {
                let side = if along[axis] > 0.0 { high[axis] } else { low[axis] };
                if along[axis] == 0.0 { f64::INFINITY } else { (side - eye[axis]) / along[axis] }
            };
            let axis = (0..3).min_by(|&a, &b| exit(a).total_cmp(&exit(b))).unwrap();
            let leaves = exit(axis);
            for (t, thing) in self.things.iter().enumerate().filter(|(_, thing)| thing.0 == i) {
                let (mut from, mut to) = (entered, leaves);
                for a in 0..3 {
                    let (x, y) = ((thing.1[a] - eye[a]) / along[a], (thing.2[a] - eye[a]) / along[a]);
                    (from, to) = (x.min(y).max(from), x.max(y).min(to));
                }
                if from <= to {
                    visit(&turned, self.cell_of[i], Some(ObjectId(t as u32)));
                }
            }
            let (up, at) = (along[axis] > 0.0, eye + along * leaves);
            let within = |low: DVec3, high: DVec3| (0..3).all(|a| a == axis || (low[a] <= at[a] && at[a] <= high[a]));
            let hit = self.mirrors.iter().position(|m| (m.0, m.1, m.2) == (i, axis, up) && within(m.3, m.4));
            if let Some(mirror) = hit
                && turned.len() < depth
            {
                // Reflected in the mirror's plane, the ray is at the same place after the same way.
                turned.push(mirror);
                eye[axis] = 2.0 * at[axis] - eye[axis];
                along[axis] = -along[axis];
                entered = leaves;
                continue;
            }
            let Some(next) = self.next(i, axis, up) else { return };
            let face = if up { i } else { next };
            let passes = match self.faces[face][axis] {
                Face::Wall => false,
                Face::Open => true,
                Face::Door(low, high) => within(low, high) && !self.blocked.contains(&(face, axis, up)),
            };
            if !passes {
                return;
            }
            (i, entered) = (next, leaves);
        }
    }
}
