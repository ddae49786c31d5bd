//! What a ray meets: objects by their triangles, doors by their portals.

use crate::building::Building;
use enfilade::scene::rays::{Hit, RayScene};
use enfilade::{ObjectId, PortalId};
use glam::DVec3;

/// How far from a portal its leaves may hang, metres, when a door is opened by clicking on one.
const LEAF: f64 = 0.6;

/// The first thing that a ray meets that isn't passed by.
pub fn pick(rays: &RayScene<'_>, origin: DVec3, direction: DVec3, passes: &dyn Fn(ObjectId) -> bool) -> Option<Hit> {
    let wall = rays.first_opaque(origin, direction, f64::INFINITY);
    let mut others = Vec::new();
    rays.see_through(origin, direction, wall.map_or(f64::INFINITY, |hit| hit.t), &mut others);
    let before = others.into_iter().filter(|hit| !passes(hit.object)).min_by(|a, b| a.t.total_cmp(&b.t));
    before.or(wall)
}

/// The closable portal that a ray passes within `limit`, the nearest first.
pub fn door(building: &Building, origin: DVec3, direction: DVec3, limit: f64) -> Option<PortalId> {
    let mut best: Option<(f64, PortalId)> = None;
    for (i, portal) in (0u32..).zip(&building.file.portals).filter(|(_, p)| p.state.closable) {
        let (n, d) = (portal.plane.truncate().as_dvec3(), f64::from(portal.plane.w));
        let across = n.dot(direction);
        let t = (d - n.dot(origin)) / across;
        if !t.is_finite() || t <= 0.0 || t > limit + LEAF || best.is_some_and(|(nearest, _)| nearest <= t) {
            continue;
        }
        let at = origin + direction * t;
        let corners: Vec<DVec3> = portal.winding.iter().map(|p| p.as_dvec3()).collect();
        let next = corners.iter().cycle().skip(1);
        if corners.iter().zip(next).all(|(a, b)| (*b - *a).cross(at - *a).dot(n) >= 0.0) {
            best = Some((t, PortalId(i)));
        }
    }
    best.map(|(_, portal)| portal)
}

/// The leaves of a door: objects whose role says so, and that reach near to the portal's middle.
pub fn leaves(building: &Building, portal: PortalId) -> Vec<ObjectId> {
    let winding: Vec<DVec3> = building.file.portals[portal.index()].winding.iter().map(|p| p.as_dvec3()).collect();
    let middle = winding.iter().sum::<DVec3>() / winding.len().max(1) as f64;
    let objects = (0u32..).zip(&building.scene.objects);
    let doors = objects.filter(|(_, o)| o.role == enfilade::scene::Role::Door && o.bounds.inflated(LEAF).contains(middle));
    doors.map(|(i, _)| ObjectId(i)).collect()
}
