//! Places where a person can stand, looked for over a grid of the plan.

use super::rooms::{Room, holds};
use crate::body::{DEEPEST, STEP, Space, around};
use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::scene::{Role, Scene};
use glam::{DVec2, DVec3, Vec3Swizzles};

/// Free space on all sides of the start of a visit, metres.
pub const FREE: f64 = 0.4;
/// More room than this, metres, makes no place better.
const AMPLE: f64 = 1.0;
/// Number of points of the grid over a room's floor, and over a whole model.
const OVER_A_ROOM: f64 = 300.0;
const OVER_A_MODEL: f64 = 2500.0;
/// Least distance between points of the grid, metres. Less: more are looked at. More: a strip between furniture is missed.
const FINEST: f64 = 0.15;
/// A room's box may be larger than the room; so much more points are looked at, at most.
const SPARSE: f64 = 8.0;
/// Floors with heights that differ by less than this, metres, are at one height.
const LEVEL: f64 = 0.1;
/// Points around a place where the floor must go on.
const AROUND: usize = 8;

/// Somewhere to stand.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The point of the floor.
    pub feet: DVec3,
    /// How much is free on all sides, metres, as far as it matters.
    pub clearance: f64,
}

/// Places of a room on its floor, from the grid's first corner on; on other heights where its floor has none. No more is looked at once
/// it has cost `limit`.
pub fn of_room(space: &Space<'_>, scene: &Scene, room: &Room, limit: usize) -> Vec<Place> {
    let bounds = room.pieces.iter().fold(Aabb::EMPTY, |b, piece| b.union(piece.bounds));
    let size = bounds.size().xz();
    let spacing = (room.area / OVER_A_ROOM).max(size.x * size.y / (SPARSE * OVER_A_ROOM)).sqrt().max(FINEST);
    let mut feet: Vec<DVec3> = Vec::new();
    for at in grid(&bounds, spacing) {
        if space.cost() > limit || !room.pieces.iter().any(|piece| piece.heights(at).is_some()) {
            continue;
        }
        // The lowest: what is higher is a cupboard's top, or a ceiling's.
        let floors = floors(space, scene, Some(room), at).into_iter();
        feet.extend(floors.map(|y| DVec3::new(at.x, y, at.y)).find(|&feet| holds(&room.pieces, feet)));
    }
    let usual = usual_height(&feet);
    let (on_it, off_it): (Vec<DVec3>, Vec<DVec3>) = feet.into_iter().partition(|p| (p.y - usual).abs() <= STEP);
    let places = free(space, scene, Some(room), &on_it, limit);
    if places.is_empty() { free(space, scene, Some(room), &off_it, limit) } else { places }
}

/// Places anywhere in a model, on any floor.
pub fn anywhere(space: &Space<'_>, scene: &Scene, limit: usize) -> Vec<Place> {
    let bounds = scene.bounds();
    let size = bounds.size().xz();
    let spacing = (size.x * size.y / OVER_A_MODEL).sqrt().max(FINEST);
    let mut feet = Vec::new();
    for at in grid(&bounds, spacing) {
        if space.cost() <= limit {
            feet.extend(floors(space, scene, None, at).into_iter().map(|y| DVec3::new(at.x, y, at.y)));
        }
    }
    free(space, scene, None, &feet, limit)
}

/// The place of a room that is nearest to a point on the plan: there, on the floor whose height is nearest to the point's, where a person
/// fits; else on the grid.
pub fn nearest(space: &Space<'_>, scene: &Scene, room: &Room, at: DVec3, limit: usize) -> Option<Place> {
    let limit = space.cost() + limit;
    let here = floors(space, scene, Some(room), at.xz()).into_iter().map(|y| at.with_y(y));
    let here = here.filter(|&feet| holds(&room.pieces, feet));
    let here = here.min_by(|a, b| (a.y - at.y).abs().total_cmp(&(b.y - at.y).abs()));
    let there = here.and_then(|feet| free(space, scene, Some(room), &[feet], limit).pop());
    there.or_else(|| {
        let away = |place: &Place| place.feet.distance_squared(at);
        of_room(space, scene, room, limit).into_iter().min_by(|a, b| away(a).total_cmp(&away(b)))
    })
}

/// A place of no room over a point of the plan, on a floor that is no farther above or below than `reach`.
pub fn outdoors(space: &Space<'_>, scene: &Scene, at: DVec3, reach: f64) -> Option<Place> {
    let floors = floors(space, scene, None, at.xz()).into_iter().filter(|y| (y - at.y).abs() <= reach);
    let feet = floors.map(|y| at.with_y(y)).min_by(|a, b| (a.y - at.y).abs().total_cmp(&(b.y - at.y).abs()))?;
    free(space, scene, None, &[feet], usize::MAX).pop()
}

/// Points of the plan over a box, from one corner on.
fn grid(bounds: &Aabb, spacing: f64) -> impl Iterator<Item = DVec2> + use<> {
    let (min, size) = (bounds.min.xz(), bounds.size().xz());
    let [across, along] = size.to_array().map(|s| (s / spacing).floor().max(0.0) as usize + 1);
    // Not on its sides: there are walls.
    let step = DVec2::new(size.x / across as f64, size.y / along as f64);
    (0..along).flat_map(move |z| (0..across).map(move |x| min + step * (DVec2::new(x as f64, z as f64) + 0.5)))
}

/// The height that most have.
fn usual_height(feet: &[DVec3]) -> f64 {
    let mut heights: Vec<f64> = feet.iter().map(|p| p.y).collect();
    heights.sort_by(f64::total_cmp);
    let within = |first: usize| heights.partition_point(|y| *y <= heights[first] + LEVEL) - first;
    let most = (0..heights.len()).rev().max_by_key(|&first| within(first));
    most.map_or(0.0, |first| heights[first])
}

/// Heights of floors over a point of the plan, ascending. In models without slabs, the bottom of a room that the author drew is a floor.
fn floors(space: &Space<'_>, scene: &Scene, room: Option<&Room>, at: DVec2) -> Vec<f64> {
    // Furniture, doors and windows are no floors; leaves of doors belong to no object.
    let is_floor = |role: Role| !matches!(role, Role::Furnishing | Role::Door | Role::Window);
    let is_ground = |o: ObjectId| scene.objects.get(o.index()).is_some_and(|object| is_floor(object.role));
    let mut floors = space.floors(at, &is_ground);
    let heights = room.filter(|room| room.is_named).into_iter().flat_map(|room| &room.pieces);
    let bottom = heights.filter_map(|piece| piece.heights(at)).map(|[low, _]| low).min_by(f64::total_cmp);
    if let Some(bottom) = bottom.filter(|low| !floors.iter().any(|y| (low - DEEPEST..=low + STEP).contains(y))) {
        floors.insert(floors.partition_point(|y| *y < bottom), bottom);
    }
    floors
}

/// Those of some points of floors where a person fits and the floor goes on around.
fn free(space: &Space<'_>, scene: &Scene, room: Option<&Room>, feet: &[DVec3], limit: usize) -> Vec<Place> {
    let goes_on = |feet: DVec3| {
        let mut points = around(AROUND).into_iter().map(|way| (feet + way * FREE).xz());
        points.all(|at| floors(space, scene, room, at).into_iter().any(|y| (y - feet.y).abs() <= STEP))
    };
    let mut places = Vec::new();
    for &feet in feet {
        if space.cost() > limit {
            break;
        }
        let clearance = space.clearance(feet, AMPLE);
        if clearance >= FREE && goes_on(feet) {
            places.push(Place { feet, clearance });
        }
    }
    places
}
