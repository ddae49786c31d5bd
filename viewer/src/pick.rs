//! What a ray meets.

use enfilade::scene::rays::{Hit, RayScene};
use glam::DVec3;

/// The first thing that a ray meets that isn't passed by.
pub fn pick(rays: &RayScene<'_>, origin: DVec3, direction: DVec3, passes: &dyn Fn(&Hit) -> bool) -> Option<Hit> {
    let wall = rays.first_opaque(origin, direction, f64::INFINITY);
    let mut others = Vec::new();
    rays.see_through(origin, direction, wall.map_or(f64::INFINITY, |hit| hit.t), &mut others);
    let before = others.into_iter().filter(|hit| !passes(hit)).min_by(|a, b| a.t.total_cmp(&b.t));
    before.or(wall)
}
