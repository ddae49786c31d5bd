//! Rooms in a grid: a gallery with works of art, a maze of small rooms, a hall of one room.
//!
//! Doorways form a random spanning tree, plus some more. The gallery's tree takes walls in random order (J. Kruskal, 1956), which
//! gives short branches; the maze's tree is a random depth-first search, which gives long paths. Doorways are mostly off each
//! other's axes, so views through many rooms exist but are rare.

use super::building::{Building, ground};
use super::facts::{Facts, Fill};
use super::furniture;
use super::model::{Material, Model, Placement};
use super::path::CameraPath;
use super::plan::{Hole, Plan, PlanRoom, Style, metres};
use enfilade::math::random::Prng;
use enfilade::scene::Role;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Random streams of the plan and of the exhibits.
const PLAN: u64 = 1;
const EXHIBITS: u64 = 2;

/// Rooms of a grid, row by row; the last row may be incomplete.
struct Grid {
    plan: Plan,
    columns: usize,
}

impl Grid {
    /// `count` rooms. Widths of columns and depths of rows are multiples of 100 mm within `size`.
    fn new(count: usize, size: [i32; 2], style: Style, rng: &mut Prng) -> Self {
        let columns = (1..).find(|c| c * c >= count).unwrap_or(1);
        let rows = count.div_ceil(columns);
        let mut lines = |n: usize| {
            let mut lines = vec![0];
            for i in 0..n {
                lines.push(lines[i] + rng.steps(size[0], size[1], 100));
            }
            lines
        };
        let (x, z) = (lines(columns), lines(rows));
        let rooms = (0..count)
            .map(|i| {
                let (c, r) = (i % columns, i / columns);
                PlanRoom { name: format!("Room {}", i + 1), x: [x[c], x[c + 1]], z: [z[r], z[r + 1]] }
            })
            .collect();
        Self { plan: Plan::new(style, rooms), columns }
    }

    /// The inner walls, each between two rooms.
    fn inner(&self) -> Vec<(usize, usize, usize)> {
        let walls = self.plan.walls.iter().enumerate();
        walls.filter_map(|(w, wall)| Some((w, wall.sides[0]?, wall.sides[1]?))).collect()
    }

    /// A spanning tree with short branches, as a list of walls.
    fn bushy(&self, rng: &mut Prng) -> Vec<usize> {
        let mut walls = self.inner();
        rng.shuffle(&mut walls);
        let mut group: Vec<usize> = (0..self.plan.rooms.len()).collect();
        let mut tree = Vec::new();
        for (wall, a, b) in walls {
            let find = |group: &mut Vec<usize>, mut i: usize| {
                while group[i] != i {
                    group[i] = group[group[i]];
                    i = group[i];
                }
                i
            };
            let (a, b) = (find(&mut group, a), find(&mut group, b));
            if a != b {
                group[a] = b;
                tree.push(wall);
            }
        }
        tree
    }

    /// A spanning tree with long paths, as a list of walls.
    fn winding(&self, rng: &mut Prng) -> Vec<usize> {
        let mut next: Vec<Vec<(usize, usize)>> = vec![Vec::new(); self.plan.rooms.len()];
        for (wall, a, b) in self.inner() {
            next[a].push((wall, b));
            next[b].push((wall, a));
        }
        let mut seen = vec![false; next.len()];
        let (mut stack, mut tree) = (vec![0], Vec::new());
        seen[0] = true;
        while let Some(&room) = stack.last() {
            let open: Vec<(usize, usize)> = next[room].iter().copied().filter(|&(_, r)| !seen[r]).collect();
            if open.is_empty() {
                stack.pop();
                continue;
            }
            let (wall, to) = open[rng.below(open.len())];
            seen[to] = true;
            tree.push(wall);
            stack.push(to);
        }
        tree
    }

    /// Cuts a doorway of `width` x `head` into each wall of `tree`, and into other inner walls with probability `extra`; a share
    /// `aligned` of the doorways is in the middle of the wall.
    fn cut(&mut self, tree: &[usize], [width, head]: [i32; 2], extra: f64, aligned: f64, rng: &mut Prng) {
        let mut tree = tree.to_vec();
        tree.sort_unstable();
        let walls = self.inner().into_iter().map(|w| w.0);
        for w in walls.filter(|w| tree.binary_search(w).is_ok() || rng.chance(extra)).collect::<Vec<_>>() {
            let [from, to] = self.plan.clear_span(w, 300 + width / 2);
            let at = if rng.chance(aligned) { (from + to) / 2 } else { rng.steps(from, to, 50) };
            self.plan.walls[w].holes.push(Hole { fill: Fill::Nothing, at, width, sill: 0, head, into: 1 });
        }
    }

    /// Cuts an entrance into the middle of a room's southern (+z) outer wall.
    fn entrance(&mut self, room: usize, [width, head]: [i32; 2]) {
        let outer = self.plan.between(room, None);
        let south = outer.into_iter().filter(|&w| self.plan.walls[w].along_x).max_by_key(|&w| self.plan.walls[w].line);
        if let Some(w) = south {
            let wall = &mut self.plan.walls[w];
            let at = (wall.span[0] + wall.span[1]) / 2;
            wall.holes.push(Hole { fill: Fill::Door, at, width, sill: 0, head, into: 0 });
        }
    }

    /// Walls, floors, a flat roof, and the ground around them.
    fn build(&self) -> (Model, Facts) {
        let (mut model, mut facts) = (Model::default(), Facts::default());
        facts.storeys.push(("Ground floor".into(), 0.0));
        self.plan.describe(&mut facts, 0, 0, &BTreeMap::new());
        let rooms = self.plan.rooms.len();
        // Door leaves stand open, so that a walk can use every door.
        self.plan.build(&mut model, 0, 0, &vec![Vec::new(); rooms], &vec![true; rooms], &mut || false);
        ground(&mut model, &self.plan, 15.0);
        (model, facts)
    }
}

/// A gallery: rooms of 7 to 10 m, 4 m high, doorways of 1.6 x 2.6 m, one entrance.
pub(super) fn gallery(count: usize, seed: u64) -> Building {
    let rng = &mut Prng::new(seed, PLAN);
    let style = Style { outer: 300, inner: 300, clear: 4000, slab: 300 };
    let mut grid = Grid::new(count, [7000, 10000], style, rng);
    let tree = grid.bushy(rng);
    grid.cut(&tree, [1600, 2600], 0.25, 0.25, rng);
    let front = (count - 1) / grid.columns * grid.columns;
    let entry = front + (count - front) / 2;
    grid.entrance(entry, [1600, 2600]);
    let (mut model, facts) = grid.build();
    let rng = &mut Prng::new(seed, EXHIBITS);
    for room in 0..count {
        exhibits(&mut model, &grid.plan, room, &[], rng);
    }

    let path = wander(&facts, entry, 20);
    Building { name: format!("gallery{count}"), seed, counted: vec![("exhibition_rooms", count)], model, facts, path }
}

/// A maze: rooms of 2.6 to 3.4 m, 2.6 m high, doorways of 0.9 x 2.1 m, one entrance, long paths.
pub(super) fn maze(count: usize, seed: u64) -> Building {
    let rng = &mut Prng::new(seed, PLAN);
    let style = Style { outer: 200, inner: 150, clear: 2600, slab: 200 };
    let mut grid = Grid::new(count, [2600, 3400], style, rng);
    let tree = grid.winding(rng);
    grid.cut(&tree, [900, 2100], 0.05, 0.2, rng);
    let entry = (count - 1) / grid.columns * grid.columns;
    grid.entrance(entry, [900, 2100]);
    let (model, facts) = grid.build();
    let path = wander(&facts, entry, 40);
    Building { name: format!("maze{count}"), seed, counted: vec![("maze_rooms", count)], model, facts, path }
}

/// A hall: one closed room of 24 x 16 x 8 m with works of art, without doors and windows.
pub(super) fn hall(seed: u64) -> Building {
    let style = Style { outer: 300, inner: 300, clear: 8000, slab: 300 };
    let room = PlanRoom { name: "Hall".into(), x: [0, 24_000], z: [0, 16_000] };
    let grid = Grid { plan: Plan::new(style, vec![room]), columns: 1 };
    let rng = &mut Prng::new(seed, EXHIBITS);
    let (mut model, facts) = grid.build();
    let ring = [(3., 3.), (21., 3.), (21., 13.), (3., 13.), (3., 3.)];
    exhibits(&mut model, &grid.plan, 0, &ring.map(|(x, z)| DVec2::new(x, z)), rng);
    let path = CameraPath::along(&ring.map(|(x, z)| DVec3::new(x, 0.0, z)), 0.5);
    Building { name: "hall".into(), seed, counted: vec![("halls", 1)], model, facts, path }
}

/// A walk from outside to the far end of the grid and onwards, through at most `limit` rooms.
fn wander(facts: &Facts, entry: usize, limit: usize) -> CameraPath {
    let farthest = |from: usize| {
        let reach = |to: usize| facts.rooms[from].middle().distance(facts.rooms[to].middle());
        (0..facts.rooms.len()).max_by(|&a, &b| reach(a).total_cmp(&reach(b)).then(b.cmp(&a))).unwrap_or(from)
    };
    let first = farthest(entry);
    let mut rooms = facts.tour(&[entry, first, farthest(first)]);
    rooms.truncate(limit + 1);
    CameraPath::along(&facts.way(&rooms), 1.6)
}

/// The floor of a room, and what stands on it.
struct Floor {
    x: [f64; 2],
    z: [f64; 2],
    /// Things stand clear of the lines between these.
    stops: Vec<DVec2>,
    /// Places and radii of things.
    taken: Vec<(DVec2, f64)>,
}

impl Floor {
    /// Of a room, with walks from door to door, to the middle, and between the points of `ways`.
    fn new(plan: &Plan, room: usize, ways: &[DVec2]) -> Self {
        let [x, z] = plan.clear(room).map(|ends| ends.map(metres));
        let mut stops = vec![DVec2::new((x[0] + x[1]) / 2.0, (z[0] + z[1]) / 2.0)];
        stops.extend(ways);
        let walls = plan.around(room).iter().map(|&w| &plan.walls[w]);
        for (wall, hole) in walls.flat_map(|wall| wall.holes.iter().map(move |hole| (wall, hole))) {
            let inwards = if wall.sides[0] == Some(room) { -1.2 } else { 1.2 };
            let (along, across) = (metres(hole.at), metres(wall.line));
            let point = |c| if wall.along_x { DVec2::new(along, c) } else { DVec2::new(c, along) };
            stops.extend([across, across + inwards].map(point));
        }
        Self { x, z, stops, taken: Vec::new() }
    }

    fn area(&self) -> f64 {
        (self.x[1] - self.x[0]) * (self.z[1] - self.z[0])
    }

    /// A random free place for a thing of this radius, which it takes; `None` if none was found.
    fn spot(&mut self, radius: f64, rng: &mut Prng) -> Option<DVec3> {
        let Self { x, z, ref stops, ref taken } = *self;
        let margin = radius + 0.5;
        let clear_of_ways = |p: DVec2| {
            let ways = stops.iter().enumerate().flat_map(|(i, &a)| stops[..i].iter().map(move |&b| (a, b)));
            ways.into_iter().all(|(a, b)| distance_to_segment(p, a, b) > radius + 0.6)
        };
        let free = (0..40)
            .map(|_| DVec2::new(rng.range(x[0] + margin, x[1] - margin), rng.range(z[0] + margin, z[1] - margin)))
            .find(|&p| clear_of_ways(p) && taken.iter().all(|&(q, r)| p.distance(q) > radius + r + 0.5))?;
        self.taken.push((free, radius));
        Some(DVec3::new(free.x, 0.0, free.y))
    }
}

/// Sculptures on plinths, a bench and pictures, clear of walks from door to door, to the middle, or between the points of `ways`.
fn exhibits(model: &mut Model, plan: &Plan, room: usize, ways: &[DVec2], rng: &mut Prng) {
    let mut floor = Floor::new(plan, room, ways);
    for i in 0..(floor.area() / 60.0).round().clamp(1.0, 12.0) as usize {
        if let Some(at) = floor.spot(0.55, rng) {
            let kind = rng.below(8);
            let turned = Placement { at: at + DVec3::Y, turns: rng.unit() };
            model.place(
                format!("plinth {room}.{i}"),
                Role::Furnishing,
                Placement { at, turns: 0.0 },
                "plinth",
                Material::Stone,
                furniture::plinth,
            );
            model.place(
                format!("sculpture {room}.{i}"),
                Role::Furnishing,
                turned,
                &format!("sculpture {kind}"),
                Material::Bronze,
                || furniture::sculpture(&mut Prng::new(kind as u64, EXHIBITS)),
            );
        }
    }
    if let Some(at) = floor.spot(0.9, rng) {
        let turns = f64::from(rng.steps(0, 1, 1)) / 4.0;
        model.place(
            format!("bench {room}"),
            Role::Furnishing,
            Placement { at, turns },
            "bench",
            Material::Wood,
            furniture::bench,
        );
    }
    for &w in plan.around(room) {
        pictures(model, plan, room, w, rng);
    }
}

/// Pictures on one wall, beside its doorways.
fn pictures(model: &mut Model, plan: &Plan, room: usize, w: usize, rng: &mut Prng) {
    let wall = &plan.walls[w];
    let [from, to] = plan.clear_span(w, 200);
    let side = usize::from(wall.sides[1] == Some(room));
    let half = metres(if wall.is_outer() { plan.style.outer } else { plan.style.inner }) / 2.0;
    let face = metres(wall.line) + if side == 1 { half } else { -half };
    let (mut at, mut number) = (from, 0);
    while at < to {
        let kind = rng.below(4);
        let (width, height) = [(900, 1200), (1400, 900), (1800, 1200), (700, 700)][kind];
        let free = wall.holes.iter().all(|h| at + width + 200 < h.at - h.width / 2 || at - 200 > h.at + h.width / 2);
        if free && at + width <= to && rng.chance(0.2) {
            let along = metres(at) + metres(width) / 2.0;
            let (p, turns) = match (wall.along_x, side) {
                (true, 1) => (DVec3::new(along, 1.6, face), 0.0),
                (true, _) => (DVec3::new(along, 1.6, face), 0.5),
                (false, 1) => (DVec3::new(face, 1.6, along), 0.25),
                (false, _) => (DVec3::new(face, 1.6, along), 0.75),
            };
            let key = format!("picture {kind}");
            let name = format!("picture {room}.{w}.{number}");
            let make = || furniture::picture(metres(width), metres(height));
            model.place(name, Role::Furnishing, Placement { at: p, turns }, &key, Material::Picture, make);
            number += 1;
        }
        at += width + 600;
    }
}

fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let ab = b - a;
    let t = ((p - a).dot(ab) / ab.length_squared().max(1e-12)).clamp(0.0, 1.0);
    p.distance(a + ab * t)
}
