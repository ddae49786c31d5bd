//! Goes somewhere at once: to a point of a plan, to a storey, before an object. A person fits there and stands on a floor; else they fly.

use crate::body::{EYE, Space};
use crate::building::Building;
use crate::collision::Solid;
use crate::start::places::{self, Place};
use crate::start::rooms::Room;
use crate::start::view::view;
use crate::walker::Walker;
use enfilade::math::geom::Aabb;
use enfilade::runtime::Culler;
use enfilade::scene::Role;
use enfilade::{CellId, ObjectId};
use enfilade_measure::pages::storeys::Storey;
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Faces that are looked at, at most, for one way: some tenths of a second.
const MOST_LOOKS: usize = 12_000_000;
/// Distance of a view of an object, in its diagonals; and its least and greatest value, metres. Nearer: objects overfill the picture.
/// Farther: they are dots.
const AWAY: (f64, [f64; 2]) = (1.6, [2.2, 10.0]);
/// A place from which so much of a thing is seen is taken at once. More: the eye goes far for the last corner. Less: a desk stands before
/// it.
const WELL: f64 = 0.75;
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
    /// Collision.
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
        let cell = self.culler.cell_of(cut.as_vec3());
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

    /// Before a thing of some objects, looking at it: nearest to where it is seen whole, in a cell that sees it. `from`: the side to fly
    /// to, where there is no such place.
    pub fn before(&self, objects: &[ObjectId], from: DVec3) -> Walker {
        let file = &self.building.file;
        let of = |o: &ObjectId| self.building.scene.objects[o.index()].bounds;
        let bounds = objects.iter().fold(Aabb::EMPTY, |b, o| b.union(of(o)));
        let (middle, [least, most]) = (bounds.centre(), AWAY.1);
        let wanted = (AWAY.0 * bounds.diagonal()).clamp(least, most);
        let holds = |room: &Room| objects.iter().any(|o| file.placement.get(room.cell.index(), o.index()));
        let may_see = |room: &Room| objects.iter().any(|o| file.sees_object(room.cell, *o));
        // Its own cell first, then the nearest of those that see it.
        let mut rooms: Vec<&Room> = self.rooms.iter().filter(|room| holds(room) || may_see(room)).collect();
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
            let mut best: Option<(f64, DVec3)> = None;
            for eye in places.iter().take(COMPARED).map(|place| place.feet + DVec3::Y * EYE) {
                let seen = self.seen(&space, eye, objects);
                if seen > best.map_or(0.0, |(most, _)| most) {
                    best = Some((seen, eye));
                }
                if seen >= WELL {
                    break;
                }
            }
            if let Some((_, eye)) = best {
                return Walker::new(eye, middle - eye, false);
            }
        }
        let eye = middle + (from - middle).normalize_or(DVec3::Z) * wanted;
        Walker::new(eye, middle - eye, true)
    }

    /// Of points of some objects, the share that lines from an eye reach. What an object hides of itself counts as seen.
    fn seen(&self, space: &Space<'_>, eye: DVec3, objects: &[ObjectId]) -> f64 {
        let scene = &self.building.scene;
        let is_seen = |triangle: u32| {
            let [a, b, c] = scene.corners(triangle as usize);
            let to = (a + b + c) / 3.0 - eye;
            let touch = space.first(eye, to.normalize_or(DVec3::X));
            touch.is_none_or(|touch| objects.contains(&touch.object) || touch.t > to.length() - TOUCH)
        };
        let points = objects.iter().flat_map(|o| {
            let triangles = scene.objects[o.index()].triangles.clone();
            let step = triangles.len().div_ceil(POINTS).max(1);
            triangles.step_by(step)
        });
        let (seen, all) = points.fold((0, 0), |(seen, all), triangle| (seen + usize::from(is_seen(triangle)), all + 1));
        seen as f64 / all.max(1) as f64
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
