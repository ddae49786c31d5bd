//! Rooms, doors and things, anywhere, at any size: scenes and cell graphs with known answers.

use enfilade::CellId;
use enfilade::cells::{Cell, CellGraph, Piece, Portal, PortalKind, PortalState};
use enfilade::math::geom::{Aabb, Plane, middle, newell};
use enfilade::scene::{Role, Scene};
use glam::{DQuat, DVec3};
use testing::grid;
use testing::meshes::{Quad, builder, flat, quads};
use testing::solids::Box3;

/// A point.
pub use glam::dvec3 as p;

/// What is known of a room and a thing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Known {
    /// Some point of the room sees it.
    Visible,
    /// No point of the room does.
    Hidden,
    /// Some does, past triangles that are nearer than the file's promise: either answer may be given.
    Narrow,
}

/// Where a world stands: turned, then scaled, then moved.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    pub name: &'static str,
    pub turn: DQuat,
    pub scale: f64,
    pub shift: DVec3,
}

impl Motion {
    pub const NONE: Self = Self { name: "as it is", turn: DQuat::IDENTITY, scale: 1.0, shift: DVec3::ZERO };

    pub fn of(&self, p: DVec3) -> DVec3 {
        self.turn * p * self.scale + self.shift
    }
}

/// A room: its boxes, which don't overlap, and that are one cell.
pub struct Room {
    pub boxes: Vec<Box3>,
    /// Parts of the boxes' faces that are open to the room's other boxes.
    pub inner: Vec<Box3>,
}

/// A hole in the wall between two rooms, flat along an axis; the first room is on the lesser side.
pub struct Door {
    pub rooms: [usize; 2],
    pub corners: Vec<DVec3>,
}

#[derive(Default)]
pub struct World {
    pub name: &'static str,
    pub rooms: Vec<Room>,
    pub doors: Vec<Door>,
    pub things: Vec<(String, Box3)>,
    pub known: Vec<(usize, usize, Known)>,
    /// Eyes and targets to look along besides a tour of the cells.
    pub views: Vec<[DVec3; 2]>,
    /// Rooms' walls stand twice in the model.
    pub doubled: bool,
    /// Walls end this far before their edges, metres.
    pub crack: f64,
    /// Walls of rooms with even numbers are cut into twice as many parts along each edge.
    pub junctions: bool,
    /// Degrees from the lower to the upper edge of views; 65 where it is 0.
    pub fov: f64,
    /// Of views, metres; 0.05 where it is 0.
    pub near: f64,
    /// Splits that find cells by themselves find a sound graph, too.
    pub auto: bool,
}

impl World {
    pub fn new(name: &'static str) -> Self {
        Self { name, ..Self::default() }
    }

    pub fn room(&mut self, min: DVec3, max: DVec3) -> usize {
        self.rooms.push(Room { boxes: vec![[min, max]], inner: Vec::new() });
        self.rooms.len() - 1
    }

    /// A door between two rooms: a rectangle, flat along an axis.
    pub fn door(&mut self, low: usize, high: usize, min: DVec3, max: DVec3) {
        self.doors.push(Door { rooms: [low, high], corners: flat(min, max).to_vec() });
    }

    /// A box in a room; its number.
    pub fn thing(&mut self, min: DVec3, max: DVec3) -> usize {
        self.things.push((format!("thing {}", self.things.len()), [min, max]));
        self.things.len() - 1
    }

    pub fn knows(&mut self, room: usize, thing: usize, known: Known) {
        self.known.push((room, thing, known));
    }

    pub fn scene(&self, motion: &Motion) -> Scene {
        let mut builder = builder();
        let mut add = |node: String, role, polygons: Vec<Quad>| {
            let moved: Vec<Quad> = polygons.iter().map(|q| q.map(|p| motion.of(p))).collect();
            builder.add(quads(&node, role, true, &moved)).unwrap();
        };
        for (i, room) in self.rooms.iter().enumerate() {
            let mut holes: Vec<Box3> = self
                .doors
                .iter()
                .filter(|d| d.rooms.contains(&i))
                .map(|d| Aabb::of(d.corners.iter().copied()))
                .map(ends)
                .collect();
            holes.extend(&room.inner);
            let parts = if self.junctions && i % 2 == 0 { 2 } else { 1 };
            let faces = room.boxes.iter().flat_map(|b| faces(*b));
            let walls: Vec<[DVec3; 4]> = faces.flat_map(|face| sheet(face, &holes, parts, self.crack)).collect();
            for copy in 0..1 + usize::from(self.doubled) {
                add(format!("room {i} {copy}"), Role::Structure, walls.clone());
            }
        }
        for (name, thing) in &self.things {
            add(name.clone(), Role::Furnishing, faces(*thing).iter().flat_map(|f| sheet(*f, &[], 1, 0.0)).collect());
        }
        builder.finish(self.name).unwrap()
    }

    pub fn graph(&self, scene: &Scene, motion: &Motion) -> CellGraph {
        let at = |q: DVec3| motion.of(q) - scene.origin;
        let piece = |&[min, max]: &Box3| {
            let planes = DVec3::AXES.iter().flat_map(|&n| {
                let plane = |through: DVec3, n: DVec3| Plane::through(at(through), motion.turn * n);
                [plane(max, n), plane(min, -n)]
            });
            let corners = (0..8)
                .map(|i| at(DVec3::from_array(std::array::from_fn(|k| if i >> k & 1 == 0 { min[k] } else { max[k] }))));
            Piece { planes: planes.collect(), bounds: Aabb::of(corners) }
        };
        let cell = |room: &Room| Cell { pieces: room.boxes.iter().map(piece).collect(), ..Cell::default() };
        let portal = |door: &Door| {
            let winding: Vec<DVec3> = door.corners.iter().map(|&q| at(q)).collect();
            let centre = middle(&winding);
            let relative: Vec<DVec3> = winding.iter().map(|&q| q - centre).collect();
            let size = Aabb::of(door.corners.iter().copied()).size();
            let axis = (0..3).find(|&k| size[k] == 0.0).expect("flat along an axis");
            let plane = Plane::through(centre, motion.turn * DVec3::AXES[axis]);
            assert!(newell(&relative).dot(plane.n) >= 0.0, "{}: counter-clockwise", self.name);
            let state = PortalState::default();
            Portal {
                cells: door.rooms.map(|r| CellId(r as u32)),
                plane,
                winding,
                kind: PortalKind::Opening,
                state,
                source: None,
            }
        };
        let cells = self.rooms.iter().map(cell).collect();
        let graph = grid::graph(cells, self.doors.iter().map(portal).collect());
        CellGraph { smallest_hole: scene.tolerance().smallest_hole(), ..graph }
    }
}

fn ends(b: Aabb) -> Box3 {
    [b.min, b.max]
}

/// The six sides of a box, each flat along an axis.
pub fn faces([min, max]: Box3) -> Vec<Box3> {
    (0..3)
        .flat_map(|axis| {
            [min[axis], max[axis]].map(|at| {
                let (mut a, mut b) = (min, max);
                (a[axis], b[axis]) = (at, at);
                [a, b]
            })
        })
        .collect()
}

/// What of a flat rectangle is in no hole: rectangles along the holes' edges, each ending `crack` before its own.
fn sheet([min, max]: Box3, holes: &[Box3], parts: usize, crack: f64) -> Vec<[DVec3; 4]> {
    let axis = (0..3).find(|&a| min[a] == max[a]).expect("flat along an axis");
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let here: Vec<&Box3> = holes.iter().filter(|h| h[0][axis] == min[axis] && h[1][axis] == min[axis]).collect();
    let cuts = |k: usize| {
        let mut cuts: Vec<f64> = here.iter().flat_map(|h| [h[0][k], h[1][k]]).collect();
        cuts.extend((0..=parts).map(|i| min[k] + (max[k] - min[k]) * i as f64 / parts as f64));
        cuts.retain(|&x| (min[k]..=max[k]).contains(&x));
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        cuts
    };
    let mut out = Vec::new();
    for us in cuts(u).windows(2) {
        for vs in cuts(v).windows(2) {
            let within = |h: &&Box3| {
                let (a, b) = ((us[0] + us[1]) * 0.5, (vs[0] + vs[1]) * 0.5);
                h[0][u] < a && a < h[1][u] && h[0][v] < b && b < h[1][v]
            };
            if !here.iter().any(within) {
                let (mut a, mut b) = (min, max);
                (a[u], a[v], b[u], b[v]) = (us[0] + crack, vs[0] + crack, us[1] - crack, vs[1] - crack);
                out.push(flat(a, b));
            }
        }
    }
    out
}
