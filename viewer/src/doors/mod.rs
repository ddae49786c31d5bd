//! Doors: leaves that swing or slide. A shut door stops walkers and shuts its portals.
//!
//! A door is the portals of one hole that can be shut, and the leaves that hang there: those of the model, with the hinge that their edge and
//! the jambs tell ([`hinge`]), or made ones. It begins as the model has it. Its portals are shut for the culling only while its leaves are at
//! rest in it and nothing of them is of glass. What gaps such leaves leave is filled ([`opening::Opening::tub`]), so that no line passes
//! portals that are shut. Leaves are drawn by themselves, wherever the cells that they can reach are seen, and aren't part of the scene's
//! mesh; so no row and no query decides about them.

pub mod hinge;
pub mod leaves;
pub mod opening;
pub mod pieces;
pub mod swings;

use crate::building::Building;
use crate::collision::{Face, NOBODY};
use crate::culling::Decision;
use enfilade::math::geom::{Aabb, Plane};
use enfilade::runtime::{Camera, Culler, View};
use enfilade::types::portal::PortalKind;
use enfilade::{CellId, ObjectId, PortalId};
use glam::{DVec3, Vec3, Vec3Swizzles};
use leaves::Leaf;
use opening::Opening;
use pieces::Piece;
use std::collections::BTreeSet;

/// How long a leaf takes from shut to open, seconds.
pub const SECONDS: f64 = 0.5;
/// How far from its portals a leaf may hang, metres. Larger: doors take their neighbours' leaves. Smaller: they lose their own.
const LEAF: f64 = 0.6;
/// Portals of one door without a name lie in one plane and touch, to this, metres.
const TOUCH: f64 = 0.02;
/// Portals of one door face one way, by the cosine between them.
const ONE_WAY: f64 = 0.99;
/// Gaps are filled this far beyond what the culling takes for a portal's rim, metres: more than rounding to `f32`.
const MARGIN: f64 = 2e-3;
/// A leaf does not shut on a walker nearer than this, metres; a person's height.
const BODY: f64 = 0.35;
/// See [`BODY`].
const TALL: f64 = 1.8;
/// Width of a frame, in widths of its hole: least and greatest. Wider bounds: a level's doors count as frames of holes beside them.
const FRAME: [f64; 2] = [0.8, 1.5];
/// Leaves are drawn where a cell is seen that they come this near to, metres.
const NEAR: f64 = 0.1;

/// One door.
#[derive(Clone, Debug)]
pub struct Door {
    /// Its portals.
    pub portals: Vec<PortalId>,
    /// Where it stands.
    pub opening: Opening,
    /// Its leaves.
    pub leaves: Vec<Leaf>,
    /// Nothing is seen through its leaves: its portals are shut with it.
    pub is_solid: bool,
    /// Around all that it may ever cover.
    bounds: Aabb,
    /// The cells that this reaches.
    cells: Vec<CellId>,
    /// Where the middle of its leaves is when they are shut, along the opening's normal.
    depth: f64,
    /// 0 shut, 1 open.
    share: f64,
    opens: bool,
}

/// The doors of a building.
#[derive(Debug)]
pub struct Doors {
    /// All of them.
    pub doors: Vec<Door>,
    /// By triangle of the scene: whether it is a leaf's.
    pub is_leaf: Vec<bool>,
    /// By object: whether it belongs to a door.
    pub is_hung: Vec<bool>,
    /// Portals of doors that are shut, ascending.
    pub shut: Vec<PortalId>,
    /// Doors whose leaves moved since [`Self::take_moved`].
    moved: Vec<usize>,
}

impl Doors {
    /// Of a building, as the model has them.
    pub fn new(building: &Building, culler: &Culler) -> Self {
        let groups = groups(building);
        let margin = 2.0 * culler.tolerance() + MARGIN;
        let openings: Vec<Opening> = groups.iter().map(|group| opening(building, group, margin)).collect();
        let pieces = pieces::pieces(&building.scene);
        let mut hung: Vec<Vec<&Piece>> = vec![Vec::new(); groups.len()];
        for piece in &pieces {
            if let Some(door) = nearest(building, &groups, &openings, piece) {
                hung[door].push(piece);
            }
        }
        let mut is_leaf = vec![false; building.scene.triangles.len()];
        let node = |piece: &Piece| building.scene.objects[piece.object.index()].node.as_str();
        let named: BTreeSet<&str> = hung.iter().flatten().map(|&piece| node(piece)).collect();
        let source = |door: &Door| building.file.portals[door.portals[0].index()].source.as_deref();
        // Where the model's leaf hangs in another hole, or lies across this one, as in levels, none is made: it is no door of its own.
        let is_one = |(door, pieces): &(Door, &Vec<&Piece>)| {
            let is_elsewhere = || source(door).is_some_and(|name| named.contains(name));
            door.first_object().is_some() || if pieces.is_empty() { !is_elsewhere() } else { door.is_framed_by(pieces) }
        };
        let (doors, hung): (Vec<Door>, Vec<&Vec<&Piece>>) = groups
            .into_iter()
            .zip(openings)
            .zip(&hung)
            .map(|((portals, opening), pieces)| (Door::new(building, portals, opening, pieces), pieces))
            .filter(is_one)
            .unzip();
        let mut is_hung = vec![false; building.scene.objects.len()];
        hung.into_iter().flatten().for_each(|piece| is_hung[piece.object.index()] = true);
        let facets = doors.iter().flat_map(|d| &d.leaves).flat_map(|leaf| &leaf.facets);
        facets.filter_map(|f| f.of).for_each(|(_, triangle)| is_leaf[triangle as usize] = true);
        let moved = (0..doors.len()).collect();
        let mut all = Self { doors, is_leaf, is_hung, shut: Vec::new(), moved };
        all.list_shut();
        all
    }

    /// Opens a door that is shut or shuts itself, and shuts others; an opening leaf swings away from `eye`.
    pub fn use_door(&mut self, number: usize, eye: DVec3) {
        let door = &mut self.doors[number];
        door.opens = !door.opens;
        if door.opens && door.is_shut() {
            let is_forward = door.opening.n.dot(eye - door.opening.middle) < 0.0;
            door.leaves.iter_mut().for_each(|leaf| leaf.motion.open_to(is_forward));
            // From now on it is open.
            door.share = f64::MIN_POSITIVE;
            self.moved.push(number);
        }
        self.list_shut();
    }

    /// Opens all doors at once, or shuts them.
    pub fn set_all(&mut self, open: bool) {
        for door in &mut self.doors {
            (door.opens, door.share) = (open, f64::from(u8::from(open)));
        }
        self.moved = (0..self.doors.len()).collect();
        self.list_shut();
    }

    /// Moves leaves for some seconds. No leaf shuts on a walker, whose eye is given. Returns whether any moved.
    pub fn step(&mut self, seconds: f64, walks: Option<DVec3>) -> bool {
        let mut any = false;
        for (i, door) in self.doors.iter_mut().enumerate() {
            let goal = f64::from(u8::from(door.opens));
            let is_held = !door.opens && walks.is_some_and(|eye| door.is_in_the_way(eye));
            if door.share != goal && !is_held {
                let by = seconds / SECONDS;
                door.share = if door.opens { (door.share + by).min(1.0) } else { (door.share - by).max(0.0) };
                self.moved.push(i);
                any = true;
            }
        }
        if any {
            self.list_shut();
        }
        any
    }

    /// The doors whose leaves moved since the last call.
    pub fn take_moved(&mut self) -> Vec<usize> {
        self.moved.sort_unstable();
        self.moved.dedup();
        std::mem::take(&mut self.moved)
    }

    fn list_shut(&mut self) {
        self.shut.clear();
        self.shut.extend(self.doors.iter().filter(|d| d.is_shut()).flat_map(|d| &d.portals));
        self.shut.sort_unstable();
    }

    /// Opens and shuts the portals of a view as the doors stand.
    pub fn tell(&self, view: &mut View) {
        let mut states = view.doors().clone();
        for door in &self.doors {
            door.portals.iter().for_each(|&portal| states.set_open(portal, !(door.is_shut() && door.is_solid)));
        }
        view.set_doors(&states);
    }

    /// Triangles of shut doors, which stop walkers.
    pub fn blocks(&self) -> Vec<[DVec3; 3]> {
        let shut = self.doors.iter().filter(|d| d.is_shut());
        shut.flat_map(|d| d.opening.block(d.depth)).collect()
    }

    /// The door that a ray meets first, by a leaf or by its hole, within `limit` times its length.
    pub fn aimed_at(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<usize> {
        let of_door = |(i, door): (usize, &Door)| {
            let hole = door.opening.block(0.0);
            let leaf = door.drawn().map(|(corners, _)| corners);
            let t = hole.into_iter().chain(leaf).filter_map(|corners| met(corners, origin, direction));
            t.min_by(f64::total_cmp).map(|t| (t, i))
        };
        let met = self.doors.iter().enumerate().filter_map(of_door).filter(|(t, _)| *t <= limit);
        met.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
    }

    /// The leaf that a ray meets first, where it is now, except those of doors that it passes: how far off, and whose triangle, if the model has it.
    pub fn first_leaf(
        &self,
        origin: DVec3,
        direction: DVec3,
        passes: &dyn Fn(usize) -> bool,
    ) -> Option<(f64, Option<(ObjectId, u32)>)> {
        let drawn = self.doors.iter().enumerate().filter(|(i, _)| !passes(*i)).flat_map(|(_, door)| door.drawn());
        let met = drawn.filter_map(|(corners, facet)| Some((met(corners, origin, direction)?, facet.and_then(|f| f.of))));
        met.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The doors that a frame shows, by what was decided for it.
    pub fn seen(&self, decision: &Decision, cells: &mut Vec<CellId>, out: &mut Vec<usize>) {
        cells.clear();
        cells.extend_from_slice(&decision.cells);
        cells.sort_unstable();
        // Modes without portals tell no cells.
        let is_reached = |door: &Door| cells.is_empty() || door.cells.iter().any(|cell| cells.binary_search(cell).is_ok());
        out.clear();
        let seen = self.doors.iter().enumerate().filter(|(_, d)| d.is_before(&decision.camera) && is_reached(d));
        out.extend(seen.map(|(i, _)| i));
    }

    /// The doors on the screen of a camera.
    pub fn before(&self, camera: &Camera, out: &mut Vec<usize>) {
        out.clear();
        out.extend((0..self.doors.len()).filter(|&i| self.doors[i].is_before(camera)));
    }
}

impl Door {
    fn new(building: &Building, portals: Vec<PortalId>, opening: Opening, pieces: &[&Piece]) -> Self {
        let states = || portals.iter().map(|p| building.file.portals[p.index()].state);
        let is_shut = states().any(|s| s.shut);
        let leaves = leaves::leaves(&opening, pieces, is_shut);
        let facets = || leaves.iter().flat_map(|leaf| &leaf.facets);
        let is_solid = !states().any(|s| s.see_through) && !facets().any(|f| f.glass);
        let share = f64::from(u8::from(!is_shut));
        let mut door = Self {
            bounds: opening.bounds(),
            depth: 0.0,
            cells: Vec::new(),
            opens: !is_shut,
            portals,
            opening,
            leaves,
            is_solid,
            share,
        };
        let off = |p: DVec3| door.opening.n.dot(p - door.opening.middle);
        let shut = || {
            door.leaves.iter().flat_map(|leaf| leaf.facets.iter().flat_map(|f| f.corners.map(|p| leaf.motion.place(p, 0.0))))
        };
        let [back, front] = shut().map(off).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
        let depth = 0.5 * (back + front);
        door.depth = if depth.abs() <= LEAF { depth } else { 0.0 };
        door.bounds = door.leaves.iter().fold(door.bounds.inflated(door.depth.abs()), |b, leaf| b.union(swept(leaf)));
        door.cells = cells(building, &door.portals, &door.bounds.inflated(NEAR));
        door
    }

    /// Whether pieces that are no leaf are about as wide as its hole: its frame.
    fn is_framed_by(&self, pieces: &[&Piece]) -> bool {
        let [low, high] = pieces::range(pieces.iter().flat_map(|p| &p.facets), self.opening.along);
        let times = (high - low) / (2.0 * self.opening.half.x);
        times > FRAME[0] && times < FRAME[1]
    }

    /// Whether its leaves are at rest in it.
    pub fn is_shut(&self) -> bool {
        self.share == 0.0
    }

    /// Whether it is open, or will be.
    pub fn opens(&self) -> bool {
        self.opens
    }

    /// All triangles of it as they are now, always as many: those of its leaves, and what fills the gaps around them.
    pub fn drawn(&self) -> impl Iterator<Item = ([DVec3; 3], Option<&pieces::Facet>)> {
        // Slowly at both ends.
        let share = self.share * self.share * (3.0 - 2.0 * self.share);
        let leaves = self.leaves.iter().flat_map(move |leaf| {
            leaf.facets.iter().map(move |f| (f.corners.map(|p| leaf.motion.place(p, share)), Some(f)))
        });
        let fills = self.is_shut() && self.is_solid;
        // Where nothing is filled, triangles of no area.
        let tub = self.opening.tub(self.depth).into_iter().map(move |t| (if fills { t } else { [t[0]; 3] }, None));
        leaves.chain(tub)
    }

    /// The object whose colour the filled gaps have.
    pub fn first_object(&self) -> Option<ObjectId> {
        self.leaves.iter().flat_map(|leaf| &leaf.facets).find_map(|f| f.of).map(|(object, _)| object)
    }

    /// The objects that its leaves are of.
    pub fn objects(&self) -> impl Iterator<Item = ObjectId> {
        self.leaves.iter().flat_map(|leaf| &leaf.facets).filter_map(|f| f.of).map(|(object, _)| object)
    }

    fn is_before(&self, camera: &Camera) -> bool {
        let corners = corners(&self.bounds).map(|p| {
            let v = p - camera.eye.as_dvec3();
            let [x, y, w] = [camera.x, camera.y, camera.w].map(|row| row.as_dvec3().dot(v));
            [w + x, w - x, w + y, w - y, w]
        });
        (0..5).all(|side| corners.iter().any(|c| c[side] >= 0.0))
    }

    /// Whether a walker with this eye stands where the leaf shuts.
    fn is_in_the_way(&self, eye: DVec3) -> bool {
        let Opening { middle, n, along, half, .. } = self.opening;
        let off = eye.with_y(middle.y) - middle;
        let level = Aabb { min: eye - DVec3::Y * TALL, max: eye };
        let bounds = self.opening.bounds();
        (n.dot(off) - self.depth).abs() < BODY
            && along.dot(off).abs() < half.x + BODY
            && level.max.y > bounds.min.y
            && level.min.y < bounds.max.y
    }
}

/// Portals that can be shut, by door: of one name, or of none and beside each other in one plane.
fn groups(building: &Building) -> Vec<Vec<PortalId>> {
    let file = &building.file;
    let doors = (0u32..).zip(&file.portals).filter(|(_, p)| p.kind == PortalKind::Door && p.state.closable);
    let bounds = |p: PortalId| Aabb::of(file.portals[p.index()].winding.iter().map(|p| p.as_dvec3()));
    let is_one = |a: PortalId, b: PortalId| {
        let [p, q] = [a, b].map(|p| &file.portals[p.index()]);
        let n = p.plane.truncate();
        let middle = middle(&q.winding);
        let apart = (f64::from(n.dot(middle) - p.plane.w)).abs();
        n.dot(q.plane.truncate()).abs() > ONE_WAY as f32
            && p.source == q.source
            && apart <= if p.source.is_some() { LEAF } else { TOUCH }
            && bounds(a).gap(&bounds(b)) <= if p.source.is_some() { LEAF } else { TOUCH }
    };
    let mut groups: Vec<Vec<PortalId>> = Vec::new();
    for (i, _) in doors {
        let portal = PortalId(i);
        let joins = |group: &Vec<PortalId>| group.iter().any(|&other| is_one(other, portal));
        let mut group = vec![portal];
        while let Some(place) = groups.iter().position(joins) {
            group.append(&mut groups.remove(place));
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups.sort();
    groups
}

/// The middle of some corners.
pub fn middle(corners: &[Vec3]) -> Vec3 {
    corners.iter().sum::<Vec3>() / corners.len().max(1) as f32
}

fn opening(building: &Building, group: &[PortalId], margin: f64) -> Opening {
    let portals = group.iter().map(|p| &building.file.portals[p.index()]);
    let windings: Vec<Vec<DVec3>> = portals.map(|p| p.winding.iter().map(|p| p.as_dvec3()).collect()).collect();
    let n = building.file.portals[group[0].index()].plane.truncate().as_dvec3().normalize();
    Opening::new(&windings, n, margin)
}

/// The door that a piece hangs in: of its name, or the nearest.
fn nearest(building: &Building, groups: &[Vec<PortalId>], openings: &[Opening], piece: &Piece) -> Option<usize> {
    let node = building.scene.objects[piece.object.index()].node.as_str();
    let centre = piece.bounds.centre();
    let cost = |door: usize| {
        let bounds = openings[door].bounds();
        let gap = piece.bounds.gap(&bounds);
        let is_named = building.file.portals[groups[door][0].index()].source.as_deref() == Some(node);
        (gap <= LEAF).then(|| (!is_named, gap + 0.1 * centre.distance(bounds.centre()), door))
    };
    let near = (0..groups.len()).filter_map(cost);
    near.min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))).map(|(.., door)| door)
}

/// Around a leaf wherever it may be.
fn swept(leaf: &Leaf) -> Aabb {
    let corners = || leaf.facets.iter().flat_map(|f| f.corners);
    match leaf.motion {
        hinge::Motion::Swing { axis, .. } => {
            let reach = corners().map(|p| p.xz().distance(axis.xz())).fold(0.0, f64::max);
            let rim = [DVec3::new(reach, 0.0, reach), DVec3::new(-reach, 0.0, -reach)];
            corners().fold(Aabb::EMPTY, |b, p| b.with((axis + rim[0]).with_y(p.y)).with((axis + rim[1]).with_y(p.y)))
        }
        hinge::Motion::Slide { .. } => {
            let ends = corners().flat_map(|p| [0.0, 1.0].map(|share| leaf.motion.place(p, share)));
            Aabb::of(ends)
        }
    }
}

/// The cells that a box may reach into, and those of some portals.
fn cells(building: &Building, portals: &[PortalId], bounds: &Aabb) -> Vec<CellId> {
    let file = &building.file;
    let corners = corners(bounds);
    let meets = |piece: &Vec<glam::Vec4>| {
        piece.iter().all(|p| {
            let plane = Plane { n: p.truncate().as_dvec3(), d: f64::from(p.w) };
            corners.iter().any(|&corner| plane.distance(corner) <= 0.0)
        })
    };
    let reached = (0u32..).zip(&file.cells).filter(|(_, cell)| cell.pieces.iter().any(meets)).map(|(i, _)| CellId(i));
    let mut cells: Vec<CellId> = portals.iter().flat_map(|p| file.portals[p.index()].cells).chain(reached).collect();
    cells.sort_unstable();
    cells.dedup();
    cells
}

fn corners(b: &Aabb) -> [DVec3; 8] {
    std::array::from_fn(|i| DVec3::new([b.min, b.max][i & 1].x, [b.min, b.max][i >> 1 & 1].y, [b.min, b.max][i >> 2].z))
}

/// Where a ray meets a triangle, in lengths of its direction.
fn met(corners: [DVec3; 3], origin: DVec3, direction: DVec3) -> Option<f64> {
    Face { corners, object: NOBODY }.meets(origin, direction)
}
