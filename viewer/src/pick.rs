//! Picking: the first surface on a ray.

use enfilade::scene::rays::{Hit, RayScene};
use glam::DVec3;

/// A ray goes on this far beyond a surface that it passes, metres. More: surfaces that lie on it are passed, too.
const BEYOND: f64 = 1e-4;

/// The first thing that a ray meets that isn't passed by.
pub fn pick(rays: &RayScene<'_>, origin: DVec3, direction: DVec3, passes: &dyn Fn(&Hit) -> bool) -> Option<Hit> {
    let mut wall = rays.first_opaque(origin, direction, f64::INFINITY);
    while let Some(hit) = wall.filter(passes) {
        let passed = hit.t + BEYOND;
        let next = rays.first_opaque(origin + direction * passed, direction, f64::INFINITY);
        wall = next.map(|next| Hit { t: next.t + passed, ..next });
    }
    let mut others = Vec::new();
    rays.see_through(origin, direction, wall.map_or(f64::INFINITY, |hit| hit.t), &mut others);
    let before = others.into_iter().filter(|hit| !passes(hit)).min_by(|a, b| a.t.total_cmp(&b.t));
    before.or(wall)
}
