//! Goes somewhere at once: to a point of a plan, to a storey, before an object. A person fits there and stands on a floor; else they fly.

use crate::body::{EYE, Space};
use crate::building::Building;
use crate::collision::Solid;
use crate::start::places::{self, Place};
use crate::start::rooms::Room;
use crate::start::view::view;
use crate::walker::Walker;
use enfilade::geom::Aabb;
use enfilade::pages::storeys::Storey;
use enfilade::runtime::{Culler, Scratch};
use enfilade::scene::Role;
use enfilade::{CellId, ObjectId};
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Faces that are looked at, at most, for one way: some tenths of a second.
const MOST_LOOKS: usize = 12_000_000;
/// An object is looked at from so many of its diagonals away, and no nearer or farther than this, metres. Nearer: it overfills the picture.
/// Farther: it is a dot.
const AWAY: (f64, [f64; 2]) = (1.2, [1.5, 8.0]);
/// Points of an object that are looked for.
const POINTS: usize = 12;
/// Places that are compared, the best first. More: large halls take seconds.
const COMPARED: usize = 400;
/// A line of sight ends this near to its goal, metres: it meets the goal itself.
const TOUCH: f64 = 0.02;

/// Knows the way in a building.
pub struct Guide<'a> {
    /// It.
    pub building: &'a Building,
    /// What is in the way.
    pub solid: &'a Solid<'a>,
    /// Its closed cells.
    pub rooms: &'a [Room],
    /// Says where a point is.
    pub culler: &'a Culler,
}

impl Guide<'_> {
    /// To a point (x, z) of a storey's plan: on the floor of the cell that the plan shows there, where a person fits nearest to it.
    pub fn to_plan(&self, storey: &Storey, at: DVec2) -> Walker {
        let cut = DVec3::new(at.x, storey.floor + storey.cut, at.y);
        let cell = self.culler.cell_of(cut.as_vec3(), &mut Scratch::for_culler(self.culler));
        let (space, scene) = (Space::new(self.solid, &|_| false), &self.building.scene);
        let place = match self.rooms.iter().find(|room| Some(room.cell) == cell) {
            Some(room) => places::nearest(&space, scene, room, cut.with_y(storey.floor), MOST_LOOKS),
            None => places::outdoors(&space, scene, cut.with_y(storey.floor), storey.cut),
        };
        self.look_around(place, cut)
    }

    /// To a storey: near a point (x, z) of its plan.
    pub fn to_storey(&self, storey: &Storey, near: DVec2) -> Walker {
        let cut = DVec3::new(near.x, storey.floor + storey.cut, near.y);
        let space = Space::new(self.solid, &|_| false);
        let away = |room: &Room| {
            let bounds = bounds(room);
            near.distance_squared(near.clamp(bounds.min.xz(), bounds.max.xz()))
        };
        let mut rooms: Vec<&Room> =
            self.rooms.iter().filter(|room| storey.cells.binary_search(&room.cell).is_ok()).collect();
        rooms.sort_by(|a, b| away(a).total_cmp(&away(b)));
        let in_room = |room: &&Room| {
            let floor = cut.with_y(storey.floor);
            places::nearest(&space, &self.building.scene, room, floor, MOST_LOOKS)
        };
        let place = rooms.iter().find_map(in_room);
        self.look_around(place, cut)
    }

    /// Into a room, near its middle.
    pub fn into_room(&self, cell: CellId) -> Option<Walker> {
        let room = self.rooms.iter().find(|room| room.cell == cell)?;
        let middle = bounds(room).centre();
        let space = Space::new(self.solid, &|_| false);
        let floor = middle.with_y(bounds(room).min.y);
        Some(self.look_around(places::nearest(&space, &self.building.scene, room, floor, MOST_LOOKS), middle))
    }

    /// Before an object, looking at it: nearest to where it is seen whole, in a cell that sees it. `from`: the side to fly to, where
    /// there is no such place.
    pub fn before(&self, object: ObjectId, from: DVec3) -> Walker {
        let file = &self.building.file;
        let bounds = &self.building.scene.objects[object.index()].bounds;
        let (middle, [least, most]) = (bounds.centre(), AWAY.1);
        let wanted = (AWAY.0 * bounds.diagonal()).clamp(least, most);
        let holds = |room: &Room| file.placement.get(room.cell.index(), object.index());
        // Its own cell first, then the nearest of those that see it.
        let mut rooms: Vec<&Room> = self.rooms.iter().filter(|r| holds(r) || file.sees_object(r.cell, object)).collect();
        let away = |room: &Room| middle.distance_squared(middle.clamp(self::bounds(room).min, self::bounds(room).max));
        rooms.sort_by(|a, b| (!holds(a)).cmp(&!holds(b)).then(away(a).total_cmp(&away(b))));
        let space = Space::new(self.solid, &|_| false);
        for room in rooms {
            if space.cost() > MOST_LOOKS {
                break;
            }
            let mut places = places::of_room(&space, &self.building.scene, room, space.cost() + MOST_LOOKS);
            let off = |place: &Place| ((place.feet + DVec3::Y * EYE).distance(middle) - wanted).abs();
            places.sort_by(|a, b| off(a).total_cmp(&off(b)));
            let mut eyes = places.iter().take(COMPARED).map(|place| place.feet + DVec3::Y * EYE);
            if let Some(eye) = eyes.find(|&eye| self.sees(&space, eye, object)) {
                return Walker::new(eye, middle - eye, false);
            }
        }
        let eye = middle + (from - middle).normalize_or(DVec3::Z) * wanted;
        Walker::new(eye, middle - eye, true)
    }

    /// Whether a line from an eye meets an object first.
    fn sees(&self, space: &Space<'_>, eye: DVec3, object: ObjectId) -> bool {
        let scene = &self.building.scene;
        let triangles = scene.objects[object.index()].triangles.clone();
        let step = triangles.len().div_ceil(POINTS).max(1);
        triangles.step_by(step).any(|triangle| {
            let [a, b, c] = scene.corners(triangle as usize);
            let to = (a + b + c) / 3.0 - eye;
            space.first(eye, to.normalize_or(DVec3::X)).is_none_or(|t| t.object == object || t.t > to.length() - TOUCH)
        })
    }

    /// Stands at a place, or flies, and looks along the longest free line.
    fn look_around(&self, place: Option<Place>, else_at: DVec3) -> Walker {
        let scene = &self.building.scene;
        let is_open = |o: ObjectId| scene.objects.get(o.index()).is_none_or(|o| o.role == Role::Door && !o.glass);
        let sight = Space::new(self.solid, &is_open);
        let eye = place.map_or(else_at, |place| place.feet + DVec3::Y * EYE);
        Walker::new(eye, view(&sight, eye, &[]).along, place.is_none())
    }
}

/// Around a room.
pub fn bounds(room: &Room) -> Aabb {
    room.pieces.iter().fold(Aabb::EMPTY, |b, piece| b.union(piece.bounds))
}
