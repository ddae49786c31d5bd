//! Unnamed meshes that fill a doorway: evident doors that a split treats as walls.

use crate::ObjectId;
use crate::cells::scale::HumanScale;
use crate::math::geom::{Aabb, newell};
use crate::scene::rays::RayScene;
use crate::scene::{Object, Role, Scene};
use crate::types::note::Note;
use glam::{DVec2, DVec3};
use std::collections::BTreeSet;
use std::ops::RangeInclusive;

/// Size of a doorway, metres.
const HEIGHT: RangeInclusive<f64> = 1.5..=3.2;
const WIDTH: RangeInclusive<f64> = 0.4..=3.0;
/// Largest thickness of a mesh that fills one, metres.
const THICK: f64 = 0.5;
/// Largest gap at its sides, metres, and largest distance of its foot from a floor. Larger: cupboards between walls count. Smaller: doors
/// with wide gaps do not.
const GAP: f64 = 0.12;
const STEP: f64 = 0.3;
/// Least height of the wall above it, metres: a wall panel has none.
const LINTEL: f64 = 0.2;
/// Free depth in front of it and behind it, metres: a cupboard in a niche has none.
const FREE: f64 = 0.6;
/// A triangle is vertical if the vertical component of its unit normal is at most this.
const UPRIGHT: f64 = 0.1;
/// Most names in a note.
const NAMED: usize = 3;

/// A note about meshes that fill doorways, if there are any.
pub(crate) fn note(rays: &RayScene<'_>, human: HumanScale) -> Option<Note> {
    let scene = rays.scene();
    let stops = |&i: &usize| {
        let object = &scene.objects[i];
        let says_nothing = object.role == Role::Unknown && object.opaque && object.reach.is_none() && !object.is_tube();
        says_nothing && fills_a_doorway(rays, ObjectId(i as u32), human)
    };
    let found = (0..scene.objects.len()).filter(stops);
    let names: BTreeSet<&str> = found.map(|i| scene.objects[i].node.as_str()).collect();
    if names.is_empty() {
        return None;
    }
    let first = names.iter().take(NAMED).map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let more = if names.len() > NAMED { format!(" and {} more", names.len() - NAMED) } else { String::new() };
    let [stand, close] =
        if names.len() == 1 { ["stands in a doorway", "closes it"] } else { ["stand in doorways", "close them"] };
    Some(Note::fault(format!(
        "{first}{more} {stand} and {close}, without a door's name: if it opens, or isn't drawn, set its role in MODEL.roles.json"
    )))
}

/// Whether a mesh has the size of a door, and is between jambs, below a lintel, on a floor, with free space on both sides.
fn fills_a_doorway(rays: &RayScene<'_>, id: ObjectId, human: HumanScale) -> bool {
    let scene = rays.scene();
    let object = &scene.objects[id.index()];
    let size = object.bounds.size();
    let is = |range: &RangeInclusive<f64>, length: f64| range.contains(&(length / human.metre));
    if !is(&HEIGHT, size.y) || size.x.max(size.z) > human.metres(*WIDTH.end() + THICK) {
        return false;
    }
    let Some(n) = facing(scene, object) else { return false };
    let u = DVec3::new(-n.z, 0.0, n.x);
    let [across, along] = [n, u].map(|axis| span(scene, object, axis));
    if across[1] - across[0] > human.metres(THICK) || !is(&WIDTH, along[1] - along[0]) {
        return false;
    }
    let (low, high) = (object.bounds.min.y, object.bounds.max.y);
    let at = |across: f64, along: f64, y: f64| n * across + u * along + DVec3::Y * y;
    let [thick, wide] = [across, along].map(|[from, to]| 0.5 * (from + to));
    let middle = 0.5 * (low + high);
    let beside = |p: DVec3, gap: f64, counts: &dyn Fn(&Object) -> bool| {
        rays.is_near_opaque(p, human.metres(gap), |o| o != id && counts(&scene.objects[o.index()]))
    };
    let goes_on = |o: &Object| o.bounds.max.y >= high + human.metres(LINTEL);
    let in_wall = along.iter().all(|&end| beside(at(thick, end, middle), GAP, &goes_on))
        && beside(at(thick, wide, high), GAP, &goes_on)
        && beside(at(thick, wide, low), STEP, &|_| true);
    let is_free = |end: f64, way: DVec3| {
        let from = at(end, wide, middle) + way * (4.0 * scene.tolerance().clearance);
        rays.first_opaque(from, way, human.metres(FREE)).is_none()
    };
    in_wall && is_free(across[0], -n) && is_free(across[1], n)
}

/// The horizontal direction that most of a mesh's vertical area faces, up to sign.
fn facing(scene: &Scene, object: &Object) -> Option<DVec3> {
    let mut sum = DVec2::ZERO;
    for t in object.triangles.clone() {
        let c = scene.corners(t as usize);
        let n = newell(&c.map(|p| p - c[0]));
        let flat = DVec2::new(n.x, n.z);
        if n.y.abs() <= UPRIGHT * n.length() && flat.length() > 0.0 {
            // Twice the angle: both sides of a leaf count as one direction.
            sum += DVec2::from_angle(2.0 * flat.to_angle()) * flat.length();
        }
    }
    let way = DVec2::from_angle(0.5 * sum.try_normalize()?.to_angle());
    Some(DVec3::new(way.x, 0.0, way.y))
}

/// The extent of a mesh along an axis.
fn span(scene: &Scene, object: &Object, axis: DVec3) -> [f64; 2] {
    let corners = object.triangles.clone().flat_map(|t| scene.corners(t as usize));
    let along = Aabb::of(corners.map(|p| DVec3::splat(axis.dot(p))));
    [along.min.x, along.max.x]
}
