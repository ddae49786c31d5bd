//! How much of a scene's walls is vertical: plans find rooms between vertical walls.

use super::bsp::planes::opaque_structure;
use crate::math::geom::{Aabb, newell};
use crate::scene::Scene;
use crate::scene::bulk::bulk;
use glam::DVec3;

/// Largest vertical component of a wall's unit normal; a floor's is at least `FLOOR_NORMAL`.
const WALL_NORMAL: f64 = 0.05;
const FLOOR_NORMAL: f64 = 0.98;

/// The vertical share of the non-horizontal area; 1 if all is horizontal.
pub(crate) fn upright_share(scene: &Scene) -> f64 {
    let (mut upright, mut steep) = (0.0, 0.0);
    let part = bulk(scene);
    let is_near = |c: &[DVec3; 3]| part.is_none_or(|part| part.touches(&Aabb::of(*c)));
    for c in opaque_structure(scene).filter(is_near) {
        let n = newell(&c.map(|p| p - c[0]));
        let (area, up) = (n.length(), n.y.abs());
        if up <= FLOOR_NORMAL * area {
            steep += area;
            upright += if up <= WALL_NORMAL * area { area } else { 0.0 };
        }
    }
    if steep > 0.0 { upright / steep } else { 1.0 }
}
