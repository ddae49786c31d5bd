//! A camera path through every cell of a file, for walks without a path.
//!
//! Cells are visited in the depth-first order of a spanning tree over portals that uses windows only if nothing else leads to a
//! cell. Within a cell the path goes from piece to piece where they touch. Cells may reach into walls: the path leaves thin
//! pieces by the shortest step into a thick one, and keeps away from the sides of thick ones. The eye is 1.6 m above the floor of
//! its piece, lower in low pieces; all lengths are a person's, in whatever unit the model is. Cells no wider than twice the
//! clearance are left out. In a file of one open cell the eye jumps from object to object.

mod way;

use super::path::{CameraPath, PathFrame};
use enfilade::file::{FileObject, PvsFile};
use enfilade::math::geom::{Aabb, Plane, clip};
use enfilade::math::random::mixed;
use enfilade::types::person::{EYE_HEIGHT, by_extent, hall, metric};
use enfilade::types::portal::PortalKind;
use glam::DVec3;
use std::cell::RefCell;
use std::collections::{HashMap, VecDeque};
use std::rc::Rc;
use way::{Way, at, direction, lengths};

/// A plane whose normal has at most this cosine with the vertical is a wall.
const UPRIGHT: f64 = 1e-6;

/// Maximum places in a file of one open cell.
const PLACES: usize = 24;
/// The same file and seed give the same path.
pub fn tour(file: &PvsFile, seed: u64) -> CameraPath {
    let rooms = Rooms::of(file);
    let way = rooms.way(file, seed);
    let near = (rooms.bounds.diagonal() * 1e-3).min(0.05) * rooms.metre;
    let frames = way.frames().into_iter().map(|(eye, along)| {
        let eye = eye * rooms.metre + file.origin;
        PathFrame { eye, target: eye + along }
    });
    CameraPath { name: format!("tour {seed}"), fov_y_degrees: 65.0, near, frames: frames.collect() }
}

/// The same path in even steps, with nothing left out: a frame every `step` metres of a person, above 0, in separate legs.
pub fn even_tour(file: &PvsFile, seed: u64, step: f64) -> Vec<Vec<PathFrame>> {
    let rooms = Rooms::of(file);
    let mut way = rooms.way(file, seed);
    way.end_in_last_cells();
    let even = |leg: &Vec<DVec3>| {
        let along = lengths(leg);
        let steps = (along.last().copied().unwrap_or(0.0) / step) as usize;
        let frames = (0..=steps).filter(|_| leg.len() > 1).map(|k| {
            let s = k as f64 * step;
            let eye = at(leg, &along, s) * rooms.metre + file.origin;
            PathFrame { eye, target: eye + direction(leg, &along, s) }
        });
        frames.collect::<Vec<_>>()
    };
    way.legs.iter().map(even).filter(|leg| !leg.is_empty()).collect()
}

/// A convex piece within the surroundings of the model.
struct Room {
    planes: Vec<Plane>,
    bounds: Aabb,
    /// A point inside at eye height.
    stand: DVec3,
    /// Distance from there to the nearest side, metres.
    breadth: f64,
    /// By plane: distance that a walk keeps from it, metres. Less than a third of the width, so that three sides leave room.
    off: Vec<f64>,
}

impl Room {
    /// `None` if the planes enclose nothing.
    fn new(planes: Vec<Plane>) -> Option<Self> {
        let corners = corners(&planes);
        let bounds = Aabb::of(corners.iter().copied());
        if corners.is_empty() {
            return None;
        }
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let (mut low, mut high) = (bounds.min.y, bounds.max.y);
        for plane in planes.iter().filter(|plane| plane.n.y.abs() > UPRIGHT) {
            let y = (plane.d - plane.n.x * middle.x - plane.n.z * middle.z) / plane.n.y;
            if plane.n.y > 0.0 { high = high.min(y) } else { low = low.max(y) }
        }
        let stand = middle.with_y(low + EYE_HEIGHT.min(0.8 * (high - low)));
        let sides = planes.iter().filter(|plane| plane.n.y.abs() < 0.5).map(|plane| -plane.distance(stand));
        let breadth = sides.fold(f64::INFINITY, f64::min).max(0.0);
        let across = |plane: &Plane| corners.iter().map(|&p| -plane.distance(p)).fold(0.0, f64::max);
        let off = |plane: &Plane| if plane.n.y.abs() < 0.5 { (0.3 * across(plane)).min(0.5) } else { 0.0 };
        let off = planes.iter().map(off).collect();
        Some(Self { planes, bounds, stand, breadth, off })
    }

    /// A point inside near `p`, at eye height, away from the sides if there is room.
    fn step_from(&self, p: DVec3) -> DVec3 {
        let mut q = p.with_y(self.stand.y);
        // Alternating projections onto convex sets (Bregman 1965), which end near the nearest point.
        for _ in 0..64 {
            for (plane, off) in self.planes.iter().zip(&self.off) {
                q -= plane.n * (plane.distance(q) + off).max(0.0);
            }
        }
        q
    }

    /// Probably inside a wall.
    fn is_thin(&self) -> bool {
        self.breadth < 0.2
    }

    /// Distance of `p` outside, metres; negative inside.
    fn outside(&self, p: DVec3) -> f64 {
        self.planes.iter().map(|plane| plane.distance(p)).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// The corners of the region inside `planes`, which must be bounded.
fn corners(planes: &[Plane]) -> Vec<DVec3> {
    let far = planes.iter().map(|plane| plane.d.abs()).fold(1.0, f64::max) * 16.0;
    let mut out = Vec::new();
    for (i, plane) in planes.iter().enumerate() {
        let (u, v) = plane.n.any_orthonormal_pair();
        let middle = plane.n * plane.d;
        let mut face = vec![middle - (u + v) * far, middle + (u - v) * far, middle + (u + v) * far, middle + (v - u) * far];
        for (_, other) in planes.iter().enumerate().filter(|&(j, _)| j != i) {
            if face.is_empty() {
                break;
            }
            face = clip(&face, other, far * 1e-12);
        }
        out.extend(face);
    }
    out
}

/// Pieces and how they touch, in a person's metres.
struct Rooms {
    /// A person's metre in units of the model.
    metre: f64,
    bounds: Aabb,
    rooms: Vec<Room>,
    /// By cell: its pieces, as indices into `rooms`.
    cells: Vec<Vec<usize>>,
    /// By room: the rooms of the same cell whose boxes its box touches, ascending.
    beside: Vec<Vec<usize>>,
    /// Tolerance of touching, metres.
    touch: f64,
    /// The file's clearance.
    clearance: f64,
    /// Intersections of two rooms, the lower number first, as far as computed; `None` if they do not touch.
    passages: RefCell<HashMap<[usize; 2], Option<Rc<Room>>>>,
}

impl Rooms {
    fn of(file: &PvsFile) -> Self {
        let rooms = Self::new(file, 1.0);
        match rooms.person(file) {
            1.0 => rooms,
            metre => Self::new(file, metre),
        }
    }

    /// A person's metre, from the height of the median cubic metre in closed cells.
    fn person(&self, file: &PvsFile) -> f64 {
        let closed = self.cells.iter().zip(&file.cells).filter(|(_, cell)| !cell.open).flat_map(|(rooms, _)| rooms);
        let mut sizes: Vec<DVec3> = closed.map(|&room| self.rooms[room].bounds.size()).collect();
        sizes.sort_by(|a, b| a.y.total_cmp(&b.y));
        let half = 0.5 * sizes.iter().map(|size| size.element_product()).sum::<f64>();
        let mut sum = 0.0;
        let middle = sizes.into_iter().find(|size| {
            sum += size.element_product();
            sum >= half
        });
        let across = Aabb::of(file.objects.iter().flat_map(|o| o.bounds).map(|p| p.as_dvec3())).diagonal();
        let middle = middle.filter(|size| size.y > 0.0);
        middle.map_or_else(|| by_extent(across), |size| metric(size.y, across).unwrap_or(hall(size.y)))
    }

    fn new(file: &PvsFile, metre: f64) -> Self {
        let objects = file.objects.iter().flat_map(|o| o.bounds).map(|p| p.as_dvec3() / metre);
        let corners = file.portals.iter().flat_map(|p| &p.winding).map(|p| p.as_dvec3() / metre);
        let all = Aabb::of(objects.chain(corners));
        let all = if all.is_empty() { Aabb { min: DVec3::NEG_ONE, max: DVec3::ONE } } else { all };
        // Extends around the model, so that a walk outside sees it; not below it.
        let around = (all.size().max_element() * 0.25).max(1e-3);
        let bounds = Aabb { min: all.min - DVec3::new(around, 0.0, around), max: all.max + around };
        let edge = (0..3).flat_map(|axis| {
            let n = DVec3::AXES[axis];
            [Plane { n, d: bounds.max[axis] }, Plane { n: -n, d: -bounds.min[axis] }]
        });
        let edge: Vec<Plane> = edge.collect();
        let (mut rooms, mut cells) = (Vec::new(), Vec::new());
        for cell in &file.cells {
            let start = rooms.len();
            rooms.extend(cell.pieces.iter().filter_map(|piece| {
                let planes = piece.iter().map(|p| Plane { n: p.truncate().as_dvec3(), d: f64::from(p.w) / metre });
                Room::new(planes.chain(edge.iter().copied()).collect())
            }));
            cells.push((start..rooms.len()).collect::<Vec<_>>());
        }
        let touch = bounds.diagonal() * 1e-4;
        let boxes: Vec<Aabb> = rooms.iter().map(|room| room.bounds.inflated(touch)).collect();
        let beside = beside(&cells, &boxes);
        let clearance = file.clearance() / metre;
        Self { metre, bounds, rooms, cells, beside, touch, clearance, passages: RefCell::default() }
    }

    /// The intersection of two rooms that touch.
    fn passage(&self, a: usize, b: usize) -> Option<Rc<Room>> {
        let key = [a.min(b), a.max(b)];
        let find = || between(&self.rooms[key[0]], &self.rooms[key[1]], self.touch).map(Rc::new);
        self.passages.borrow_mut().entry(key).or_insert_with(find).clone()
    }

    /// The largest piece of a cell, where a walk stands. `None` if the clearance does not fit: the guarantee excludes such cells.
    fn main(&self, cell: usize) -> Option<usize> {
        let size = |&r: &usize| self.rooms[r].bounds.size().element_product();
        let wide = self.cells[cell].iter().copied().filter(|&r| self.rooms[r].breadth > self.clearance);
        wide.max_by(|a, b| size(a).total_cmp(&size(b)).then(b.cmp(a)))
    }

    /// The piece of a cell that is nearest to a point.
    fn nearest(&self, cell: usize, p: DVec3) -> Option<usize> {
        let far = |&r: &usize| self.rooms[r].outside(p);
        self.cells[cell].iter().copied().min_by(|a, b| far(a).total_cmp(&far(b)).then(a.cmp(b)))
    }

    /// The path from `start` in piece `from` to `end` in piece `to` of the same cell, with both ends.
    fn within(&self, (start, from): (DVec3, usize), (end, to): (DVec3, usize)) -> Vec<DVec3> {
        // Leaves thin pieces at both ends by the shortest step.
        let (mut first, mut last) = (vec![start], vec![end]);
        let (from, to) = (self.leave_thin(from, &mut first), self.leave_thin(to, &mut last));
        let mut before: HashMap<usize, (usize, Rc<Room>)> = HashMap::new();
        let mut queue = VecDeque::from([to]);
        // Backwards, so that following `before` leads forwards.
        while let Some(room) = queue.pop_front().filter(|_| from != to && !before.contains_key(&from)) {
            for &next in &self.beside[room] {
                let is_new = next != to && !before.contains_key(&next);
                if let Some(passage) = is_new.then(|| self.passage(room, next)).flatten() {
                    before.insert(next, (room, passage));
                    queue.push_back(next);
                }
            }
        }
        let mut at = from;
        while let Some((next, passage)) = before.get(&at).filter(|_| at != to) {
            self.step(*next, passage, &mut first);
            at = *next;
        }
        first.extend(last.into_iter().rev());
        first
    }

    /// Steps from a thin piece into the largest thick one that it touches. Returns the piece reached.
    fn leave_thin(&self, room: usize, points: &mut Vec<DVec3>) -> usize {
        let size = |r: usize| self.rooms[r].bounds.size().element_product();
        if !self.rooms[room].is_thin() {
            return room;
        }
        let mut thick: Vec<usize> = self.beside[room].iter().copied().filter(|&next| !self.rooms[next].is_thin()).collect();
        thick.sort_by(|&a, &b| size(b).total_cmp(&size(a)).then(a.cmp(&b)));
        match thick.into_iter().find_map(|next| Some((next, self.passage(room, next)?))) {
            Some((next, passage)) => {
                self.step(next, &passage, points);
                next
            }
            None => room,
        }
    }

    /// Steps through a passage into a piece.
    fn step(&self, room: usize, passage: &Room, points: &mut Vec<DVec3>) {
        let between = passage.step_from(points[points.len() - 1]);
        points.extend([between, self.rooms[room].step_from(between)]);
    }

    /// The whole path: every cell with a piece, in the order of the tree.
    fn way(&self, file: &PvsFile, seed: u64) -> Way {
        let tree = spanning_tree(file, seed);
        let mut visited = vec![false; self.cells.len()];
        let mut way = Way::default();
        if let [only] = &file.cells[..]
            && only.open
            && !file.objects.is_empty()
        {
            places(&file.objects, self.metre).into_iter().for_each(|place| way.jump(place));
            return way;
        }
        let n = self.cells.len();
        let start = if n == 0 { 0 } else { (mixed(seed) % n as u64) as usize };
        for first in (0..n).map(|i| (start + i) % n) {
            let Some(main) = self.main(first).filter(|_| !visited[first]) else { continue };
            visited[first] = true;
            way.jump(self.rooms[main].stand);
            // The cell, its next tree edge, and the portal through which it was entered.
            let mut stack = vec![(first, 0, None)];
            let mut at = main;
            while let Some((cell, next, back)) = stack.last_mut() {
                let (cell, from) = (*cell, at);
                let through = match tree[cell].get(*next) {
                    Some(&(portal, target)) => {
                        *next += 1;
                        if visited[target] || self.main(target).is_none() {
                            continue;
                        }
                        stack.push((target, 0, Some((portal, cell))));
                        (portal, target)
                    }
                    None => {
                        let back = *back;
                        stack.pop();
                        let Some(back) = back else { continue };
                        back
                    }
                };
                let (portal, target) = through;
                let door = stand_in(&file.portals[portal].winding, self.metre);
                let (Some(leave), Some(enter)) = (self.nearest(cell, door), self.nearest(target, door)) else { continue };
                // From the end of the path so far to the portal.
                let start = way.last().unwrap_or(door);
                way.points(&self.within((start, from), (door, leave)));
                at = enter;
                if !visited[target] {
                    visited[target] = true;
                    if let Some(main) = self.main(target) {
                        let stand = self.rooms[main].stand;
                        way.points(&self.within((door, enter), (stand, main)));
                        way.keep(stand);
                        at = main;
                    }
                }
            }
        }
        way
    }
}

/// Eyes at objects, spread evenly by triangles: above flat objects, in the middle of high ones.
fn places(objects: &[FileObject], metre: f64) -> Vec<DVec3> {
    let mut all = 0;
    let ends: Vec<u128> = objects.iter().map(|o| (all += u128::from(o.triangles), all).1).collect();
    let count = PLACES.min(objects.len());
    let place = |k: usize| {
        let at = (2 * k as u128 + 1) * all / (2 * count as u128);
        let [min, max] =
            objects[ends.partition_point(|&end| end <= at).min(objects.len() - 1)].bounds.map(|p| p.as_dvec3() / metre);
        let floor = if max.y - min.y < EYE_HEIGHT { max.y } else { min.y };
        min.midpoint(max).with_y(floor + EYE_HEIGHT)
    };
    (0..count).map(place).collect()
}

/// By room: the rooms of the same cell whose boxes touch its own, ascending; by a sweep along x.
fn beside(cells: &[Vec<usize>], boxes: &[Aabb]) -> Vec<Vec<usize>> {
    let mut beside = vec![Vec::new(); boxes.len()];
    for cell in cells {
        let mut order = cell.clone();
        order.sort_by(|&a, &b| boxes[a].min.x.total_cmp(&boxes[b].min.x));
        for (i, &a) in order.iter().enumerate() {
            for &b in order[i + 1..].iter().take_while(|&&b| boxes[b].min.x <= boxes[a].max.x) {
                if boxes[a].touches(&boxes[b]) {
                    beside[a].push(b);
                    beside[b].push(a);
                }
            }
        }
    }
    beside.iter_mut().for_each(|rooms| rooms.sort_unstable());
    beside
}

/// The intersection of two pieces that touch within `touch` metres.
fn between(a: &Room, b: &Room, touch: f64) -> Option<Room> {
    let both = a.planes.iter().chain(&b.planes).map(|plane| Plane { d: plane.d + touch, ..*plane }).collect();
    Room::new(both)
}

/// A point at eye height in a portal.
fn stand_in(winding: &[glam::Vec3], metre: f64) -> DVec3 {
    let corners: Vec<DVec3> = winding.iter().map(|p| p.as_dvec3() / metre).collect();
    let bounds = Aabb::of(corners.iter().copied());
    let height = bounds.max.y - bounds.min.y;
    enfilade::math::geom::middle(&corners).with_y(bounds.min.y + EYE_HEIGHT.min(0.8 * height))
}

/// By cell: portals of a spanning tree and their other cells. Kruskal's algorithm, windows last.
fn spanning_tree(file: &PvsFile, seed: u64) -> Vec<Vec<(usize, usize)>> {
    let mut order: Vec<usize> = (0..file.portals.len()).collect();
    order.sort_by_key(|&p| (file.portals[p].kind == PortalKind::Window, mixed(seed ^ mixed(p as u64)), p));
    let mut group: Vec<usize> = (0..file.cells.len()).collect();
    let root = |group: &mut Vec<usize>, mut cell: usize| {
        while group[cell] != cell {
            group[cell] = group[group[cell]];
            cell = group[cell];
        }
        cell
    };
    let mut tree = vec![Vec::new(); file.cells.len()];
    for p in order {
        let [a, b] = file.portals[p].cells.map(|c| c.index());
        let (ra, rb) = (root(&mut group, a), root(&mut group, b));
        if ra != rb {
            group[ra] = rb;
            tree[a].push((p, b));
            tree[b].push((p, a));
        }
    }
    tree
}
