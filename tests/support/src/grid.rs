//! A world that can be walked exactly: a lattice of box rooms with doors in their walls, some rooms joined into one cell.
//!
//! Walls have no thickness, so a line is in one room or in the next, and crosses a wall inside its door or stops there. Joined
//! rooms have no wall between them: their cell is an L, a U, a ring.

use crate::meshes::flat_along;
use crate::random::Random;
use enfilade::cells::{Cell, CellGraph, Piece, Portal, PortalKind, PortalState, Strategy};
use enfilade::math::geom::{Aabb, Plane};
use enfilade::pvs::flow::FlowInput;
use enfilade::{BitMatrix, CellId};
use glam::DVec3;

/// Rooms of `room` metres in a lattice; a door is a rectangle in the wall between room and the next along an axis.
pub struct Grid {
    pub size: [usize; 3],
    pub room: DVec3,
    /// Cell of each room.
    pub cell: Vec<usize>,
    pub cells: usize,
    /// By axis and room: the doors to the next room along the axis, as boxes flat along the axis. Joined rooms have none.
    pub doors: [Vec<Vec<Aabb>>; 3],
    /// Boxes, and the room that each is in.
    pub objects: Vec<(Aabb, usize)>,
}

/// How a grid is made.
#[derive(Clone, Copy)]
pub struct Recipe {
    pub size: [usize; 3],
    /// Chance that a wall has a door.
    pub doors: f64,
    /// Chance that two rooms are one cell.
    pub joined: f64,
    /// All rooms of the border are one cell: the outside.
    pub outside: bool,
    pub objects: usize,
}

impl Grid {
    pub fn random(recipe: Recipe, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let Recipe { size, .. } = recipe;
        let rooms = size[0] * size[1] * size[2];
        let mut grid = Self {
            size,
            room: DVec3::new(5.0, 3.0, 4.0),
            cell: (0..rooms).collect(),
            cells: 0,
            doors: [(); 3].map(|()| vec![Vec::new(); rooms]),
            objects: Vec::new(),
        };
        grid.join_rooms(recipe, &mut random);
        grid.cut_doors(recipe, &mut random);
        grid.put_objects(recipe, &mut random);
        grid
    }

    /// Whether a room is at the border.
    fn is_outer(&self, room: usize) -> bool {
        let (size, at) = (self.size, self.at(room));
        (0..3).any(|axis| size[axis] > 1 && (at[axis] == 0 || at[axis] + 1 == size[axis]))
    }

    /// Makes some rooms one cell, and numbers cells from 0.
    fn join_rooms(&mut self, recipe: Recipe, random: &mut Random) {
        let rooms = self.cell.len();
        if recipe.outside {
            let ring: Vec<usize> = (0..rooms).filter(|&r| self.is_outer(r)).collect();
            ring.iter().for_each(|&r| self.cell[r] = ring[0]);
        }
        for axis in 0..3 {
            for room in 0..rooms {
                if let Some(next) = self.next(room, axis)
                    && !(recipe.outside && (self.is_outer(room) || self.is_outer(next)))
                    && random.chance(recipe.joined)
                {
                    let (from, to) = (self.cell[next], self.cell[room]);
                    self.cell.iter_mut().filter(|c| **c == from).for_each(|c| *c = to);
                }
            }
        }
        let mut names: Vec<usize> = self.cell.clone();
        names.sort_unstable();
        names.dedup();
        self.cells = names.len();
        for c in &mut self.cell {
            *c = names.binary_search(c).expect("every cell has a name");
        }
    }

    fn cut_doors(&mut self, recipe: Recipe, random: &mut Random) {
        for axis in 0..3 {
            for room in 0..self.cell.len() {
                let Some(next) = self.next(room, axis) else { continue };
                // Some walls have two doors, so that a line may leave a cell and come back.
                for _ in 0..1 + usize::from(random.chance(0.2)) {
                    if self.cell[room] != self.cell[next] && random.chance(recipe.doors) {
                        let mut door = self.bounds(room);
                        door.min[axis] = door.max[axis];
                        for k in (0..3).filter(|&k| k != axis) {
                            let (low, high) = (door.min[k], door.max[k]);
                            let width = random.real(0.05, 0.6) * (high - low);
                            door.min[k] = random.real(low, high - width);
                            door.max[k] = door.min[k] + width;
                        }
                        if !self.doors[axis][room].iter().any(|d| d.touches(&door)) {
                            self.doors[axis][room].push(door);
                        }
                    }
                }
            }
        }
    }

    fn put_objects(&mut self, recipe: Recipe, random: &mut Random) {
        for _ in 0..recipe.objects {
            let room = random.below(self.cell.len());
            let b = self.bounds(room);
            let corner = |random: &mut Random| b.min + b.size() * DVec3::from([(); 3].map(|()| random.real(0.0, 1.0)));
            let (p, q) = (corner(random), corner(random));
            self.objects.push((Aabb::of([p, p.lerp(q, 0.2)]), room));
        }
    }

    pub fn at(&self, room: usize) -> [usize; 3] {
        [room % self.size[0], room / self.size[0] % self.size[1], room / self.size[0] / self.size[1]]
    }

    /// The next room along an axis.
    pub fn next(&self, room: usize, axis: usize) -> Option<usize> {
        let stride = [1, self.size[0], self.size[0] * self.size[1]][axis];
        (self.at(room)[axis] + 1 < self.size[axis]).then_some(room + stride)
    }

    pub fn bounds(&self, room: usize) -> Aabb {
        let at = self.at(room).map(|x| x as f64);
        let min = DVec3::from(at) * self.room;
        Aabb { min, max: min + self.room }
    }

    pub fn graph(&self) -> CellGraph {
        let mut portals = Vec::new();
        for axis in 0..3 {
            for (room, doors) in self.doors[axis].iter().enumerate() {
                for door in doors {
                    let next = self.next(room, axis).expect("a door leads somewhere");
                    let cells = [self.cell[room], self.cell[next]].map(|c| CellId(c as u32));
                    portals.push(rectangle(cells, axis, door));
                }
            }
        }
        let mut cells = vec![Cell::default(); self.cells];
        for room in 0..self.cell.len() {
            let bounds = self.bounds(room);
            let planes =
                DVec3::AXES.iter().flat_map(|&n| [Plane::through(bounds.max, n), Plane::through(bounds.min, -n)]).collect();
            cells[self.cell[room]].pieces.push(Piece { planes, bounds });
        }
        graph(cells, portals)
    }

    pub fn placement(&self) -> BitMatrix {
        let mut m = BitMatrix::new(self.cells, self.objects.len());
        for (o, &(_, room)) in self.objects.iter().enumerate() {
            m.set(self.cell[room], o);
        }
        m
    }

    pub fn object_bounds(&self) -> Vec<Aabb> {
        self.objects.iter().map(|&(b, _)| b).collect()
    }

    /// Follows the ray from `p`, in `room`, until it meets a wall: the cells on the way, the first one included.
    pub fn walk(&self, mut room: usize, p: DVec3, direction: DVec3, cells: &mut Vec<usize>) {
        cells.clear();
        cells.push(self.cell[room]);
        loop {
            let bounds = self.bounds(room);
            let wall = |k: usize| if direction[k] > 0.0 { bounds.max[k] } else { bounds.min[k] };
            let time = |k: usize| if direction[k] == 0.0 { f64::INFINITY } else { (wall(k) - p[k]) / direction[k] };
            let axis = (0..3).min_by(|&a, &b| time(a).total_cmp(&time(b))).expect("three axes");
            let at = p + direction * time(axis);
            let next = if direction[axis] > 0.0 {
                self.next(room, axis)
            } else {
                let stride = [1, self.size[0], self.size[0] * self.size[1]][axis];
                (self.at(room)[axis] > 0).then(|| room - stride)
            };
            let Some(next) = next else { return };
            let doors = &self.doors[axis][room.min(next)];
            let through = |d: &Aabb| (0..3).all(|k| k == axis || d.min[k] < at[k] && at[k] < d.max[k]);
            if self.cell[room] != self.cell[next] && !doors.iter().any(through) {
                return;
            }
            room = next;
            if self.cell[room] != *cells.last().expect("not empty") {
                cells.push(self.cell[room]);
            }
        }
    }

    /// What random lines, and lines from random points of objects, join: cells x cells, cells x objects.
    pub fn seen(&self, lines: usize, seed: u64) -> [BitMatrix; 2] {
        let (mut random, mut path) = (Random::new(seed), Vec::new());
        let mut cells = BitMatrix::new(self.cells, self.cells);
        let mut objects = BitMatrix::new(self.cells, self.objects.len());
        for k in 0..lines {
            let (room, p, direction) = if k % 2 == 0 { self.random_ray(&mut random) } else { self.aimed_ray(&mut random) };
            self.walk(room, p, direction, &mut path);
            for &a in &path {
                path.iter().for_each(|&b| _ = cells.set(a, b));
            }
            if let Some(&(bounds, room)) = self.objects.get(k % self.objects.len().max(1)) {
                let (p, direction) = (inside(&bounds, &mut random), self.random_ray(&mut random).2);
                self.walk(room, p, direction, &mut path);
                path.iter().for_each(|&cell| _ = objects.set(cell, k % self.objects.len()));
            }
        }
        [cells, objects]
    }

    /// A ray from a random point.
    pub fn random_ray(&self, random: &mut Random) -> (usize, DVec3, DVec3) {
        let room = random.below(self.cell.len());
        let b = self.bounds(room);
        (room, b.min + b.size() * unit_cube(random), (unit_cube(random) - 0.5) * DVec3::new(1.0, 0.3, 1.0))
    }

    /// A ray from the wall of a door through another door of a room behind it: these go far.
    pub fn aimed_ray(&self, random: &mut Random) -> (usize, DVec3, DVec3) {
        let (room, p, direction) = self.random_ray(random);
        let axis = random.below(3);
        let (a, b) = (random.below(self.cell.len()), random.below(self.cell.len()));
        match (self.doors[axis][a].first(), self.doors[random.below(3)][b].first()) {
            (Some(from), Some(to)) => {
                let (from, to) = (inside(from, random), inside(to, random));
                // A point just before the first door, in the room on this side of it.
                let before = from - (to - from) * 1e-6;
                let room = if to[axis] >= from[axis] { a } else { self.next(a, axis).expect("a door") };
                if self.bounds(room).contains(before) { (room, before, to - from) } else { (room, p, direction) }
            }
            _ => (room, p, direction),
        }
    }
}

fn unit_cube(random: &mut Random) -> DVec3 {
    DVec3::new(random.real(0.0, 1.0), random.real(0.0, 1.0), random.real(0.0, 1.0))
}

/// A random point of a box.
pub fn inside(b: &Aabb, random: &mut Random) -> DVec3 {
    b.min + b.size() * unit_cube(random)
}

/// A rectangular portal: a box flat along `axis`, leading up that axis.
pub fn rectangle(cells: [CellId; 2], axis: usize, b: &Aabb) -> Portal {
    let winding = flat_along(axis, b.min, b.max).to_vec();
    let plane = Plane::through(b.min, DVec3::AXES[axis]);
    let kind = PortalKind::Door;
    Portal { cells, plane, winding, kind, state: PortalState::of_kind(kind), source: None }
}

pub fn graph(cells: Vec<Cell>, portals: Vec<Portal>) -> CellGraph {
    let (reason, notes) = (String::new(), Vec::new());
    let mut graph =
        CellGraph { strategy: Strategy::Given, reason, cells, portals, smallest_hole: 0.0, closed_holes: Vec::new(), notes };
    graph.link();
    graph
}

/// What flow takes: nothing is known of cells and objects but `lower`.
pub fn input<'a>(
    graph: &'a CellGraph,
    placement: &'a BitMatrix,
    object_bounds: &'a [Aabb],
    lower: [&'a BitMatrix; 2],
    max_steps: u64,
) -> FlowInput<'a> {
    let [cells_lower, objects_lower] = lower;
    let (placed_boxes, coplanar, fronts) = (None, 1e-5, None);
    FlowInput { graph, placement, placed_boxes, object_bounds, cells_lower, objects_lower, max_steps, coplanar, fronts }
}
