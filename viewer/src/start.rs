//! Where a visit begins: in a room, on its floor, with space on all sides, looking along the longest free line.
//!
//! Closed cells are gone through as rooms, the best first ([`mod@rooms`]), until one has a place where a person fits ([`places`]) that is
//! indoors: the rays that go out from there meet the fronts of faces. In a solid thing, and outside a level of one-sided walls, they meet
//! backs; under the sky, nothing. Where no room has any place, floors anywhere do, then the freest point of the fullest cell, then a point
//! before the model.

pub mod places;
pub mod rooms;
pub mod view;

use crate::body::{EYE, Space, TALL};
use crate::building::Building;
use crate::collision::Solid;
use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::scene::{Role, Scene};
use glam::{DVec3, Vec3Swizzles};
use places::Place;
use rooms::{Room, holds, rooms};
use view::view;

/// Faces that are looked at, at most, for a start: some tenths of a second. Each next resort may look at as many again.
const MOST_LOOKS: usize = 12_000_000;
/// Places of a room that are compared.
const COMPARED: usize = 24;
/// Of the places anywhere in a model.
const COMPARED_ANYWHERE: usize = 96;
/// Directions of the rays that tell indoors from elsewhere.
const RAYS: usize = 32;
/// Indoors, at least this share of the rays meets fronts. More: windows without panes make a room none. Less: a wall makes a yard a room.
const INDOORS: f64 = 0.7;
/// A ceiling higher than this, metres, is that of a shaft or a hall: of rooms with names, others are better.
const HIGHEST: f64 = 6.0;
/// Benefit of a metre of free space beside a place, in logarithms of the length of the view.
const SPACIOUS: f64 = 0.5;
/// Shares of rays are compared in steps of one over this.
const STEPS: f64 = 10.0;
/// Points along each side of the box of a cell that is too small to stand in.
const POINTS: usize = 8;
/// How far before a model one stands to see all of it, and how far above its middle, in its diagonals.
const BEFORE: (f64, f64) = (1.0, 0.3);

/// The eye and where it looks, metres relative to the origin.
pub fn start(building: &Building, solid: &Solid<'_>) -> (DVec3, DVec3) {
    let (scene, file) = (&building.scene, &building.file);
    let bounds = scene.bounds();
    if bounds.is_empty() {
        return (DVec3::ZERO, DVec3::NEG_Z);
    }
    // Views pass doors. Panes end views, since outside is often nothing.
    let is_open = |o: ObjectId| scene.objects.get(o.index()).is_none_or(|o| o.role == Role::Door && !o.glass);
    let (space, sight) = (Space::new(solid, &|_| false), Space::new(solid, &is_open));
    let chooser = Chooser { scene, space, sight, rays: sphere(RAYS) };
    let rooms = rooms(file, scene);
    // A doll's house is entered, and not stood on.
    let is_for_people = bounds.size().max_element() >= TALL;
    let stands = chooser.indoors(&rooms).or_else(|| is_for_people.then(|| chooser.anywhere()).flatten());
    let fullest = || rooms.iter().max_by_key(|room| file.placement.ones(room.cell.index()).count());
    let eye = stands.map(|feet| feet + DVec3::Y * EYE).or_else(|| chooser.afloat(fullest()?));
    let Some(eye) = eye else { return before(&bounds) };
    let home = rooms.iter().find(|room| holds(&room.pieces, eye - DVec3::Y * EYE));
    let inside = home.into_iter().flat_map(|room| file.placement.ones(room.cell.index()));
    let furniture = inside.filter_map(|o| scene.objects.get(o)).filter(|o| o.role == Role::Furnishing);
    let furniture: Vec<DVec3> = furniture.map(|o| o.bounds.centre()).collect();
    let view = view(&chooser.sight, eye, &furniture);
    let middle = (bounds.centre() - eye).with_y(0.0).normalize_or(DVec3::NEG_Z);
    (eye, if view.depth > 0.0 { view.along } else { middle })
}

/// From outside, looking at the middle.
fn before(bounds: &Aabb) -> (DVec3, DVec3) {
    let eye = bounds.centre() + DVec3::new(0.0, BEFORE.1, BEFORE.0) * bounds.diagonal();
    (eye, (bounds.centre() - eye).normalize_or(DVec3::NEG_Z))
}

struct Chooser<'a> {
    scene: &'a Scene,
    /// For the body: all is solid.
    space: Space<'a>,
    /// For the eye: doors are open.
    sight: Space<'a>,
    rays: Vec<DVec3>,
}

impl Chooser<'_> {
    /// A place in the first room that has one indoors, below a ceiling of a room; else in the one that lacks least of that.
    fn indoors(&self, rooms: &[Room]) -> Option<DVec3> {
        let mut best: Option<((f64, bool), bool, DVec3)> = None;
        for room in rooms {
            let is_done = best.is_some_and(|(good, is_named, _)| good == (INDOORS, true) || is_named && !room.is_named);
            if is_done || self.cost() > MOST_LOOKS {
                break;
            }
            let places = places::of_room(&self.space, self.scene, room, MOST_LOOKS);
            let Some((shelter, feet)) = self.best(&places, COMPARED, room.is_named) else { continue };
            let is_low = !room.is_named || EYE + self.space.height_over(feet + DVec3::Y * EYE) <= HIGHEST;
            let good = (shelter, is_low);
            if best.is_none_or(|(most, ..)| good > most) {
                best = Some((good, room.is_named, feet));
            }
        }
        best.map(|(.., feet)| feet)
    }

    /// A place on any floor, with as much around and above it as there is.
    fn anywhere(&self) -> Option<DVec3> {
        let places = places::anywhere(&self.space, self.scene, self.cost() + MOST_LOOKS);
        self.best(&places, COMPARED_ANYWHERE, false).map(|(_, feet)| feet)
    }

    /// The best of some places, evenly chosen: the most indoors (up to [`INDOORS`], returned with it), then the deepest view and the most
    /// space. In a room that the author named, backs of faces count as walls, too.
    fn best(&self, places: &[Place], most: usize, is_named: bool) -> Option<(f64, DVec3)> {
        let compared = places.len().min(most);
        let mut best: Option<([f64; 2], DVec3)> = None;
        for place in (0..compared).map(|i| places[(2 * i + 1) * places.len() / (2 * compared)]) {
            let eye = place.feet + DVec3::Y * EYE;
            let depth = view(&self.sight, eye, &[]).depth;
            let [fronts, backs] = self.space.sides(eye, &self.rays);
            let walls = if is_named { fronts + backs } else { fronts };
            let shelter = if walls >= INDOORS { INDOORS } else { (walls * STEPS).floor() / STEPS };
            let worth = [shelter, depth.ln_1p() + SPACIOUS * place.clearance];
            if best.is_none_or(|(most, _)| worth > most) {
                best = Some((worth, place.feet));
            }
        }
        best.map(|(worth, feet)| (worth[0], feet))
    }

    /// The point of a cell that is farthest from all faces, for a model without a place to stand.
    fn afloat(&self, room: &Room) -> Option<DVec3> {
        let (mut best, limit): (Option<(f64, DVec3)>, _) = (None, self.cost() + MOST_LOOKS);
        for piece in &room.pieces {
            let point = |i: usize| {
                let share = [i % POINTS, i / POINTS % POINTS, i / POINTS / POINTS].map(|k| (k as f64 + 0.5) / POINTS as f64);
                piece.bounds.min + piece.bounds.size() * DVec3::from(share)
            };
            for p in (0..POINTS.pow(3)).map(point) {
                let is_within = piece.heights(p.xz()).is_some_and(|[low, high]| (low..=high).contains(&p.y));
                if !is_within || self.cost() > limit {
                    continue;
                }
                let reach = room.pieces.iter().fold(Aabb::EMPTY, |b, piece| b.union(piece.bounds)).diagonal();
                let free = self.space.distance(p, reach);
                if best.is_none_or(|(most, _)| free > most) {
                    best = Some((free, p));
                }
            }
        }
        best.map(|(_, p)| p)
    }

    fn cost(&self) -> usize {
        self.space.cost() + self.sight.cost()
    }
}

/// Unit vectors in all directions, on a spiral (Gonzalez, *Measurement of areas on a sphere using Fibonacci and latitude-longitude
/// lattices*, 2010).
fn sphere(count: usize) -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (5f64.sqrt() - 1.0);
    let point = |i: usize| {
        let y = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (golden * i as f64).sin_cos();
        let flat = (1.0 - y * y).sqrt();
        DVec3::new(flat * cos, y, flat * sin)
    };
    (0..count).map(point).collect()
}
