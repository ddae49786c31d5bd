//! A limit of distance: pairs of cells that are farther apart than a game draws.

use crate::{Level, Vis};
use enfilade::BitMatrix;
use enfilade::math::geom::Aabb;

/// Takes out pairs of cells whose boxes, around their portals, are farther apart than `units`, of the level's own. Returns the number
/// of ordered pairs of `upper` that went.
pub fn limit(level: &Level, vis: &mut Vis, units: f64) -> u64 {
    let boxes = boxes(level);
    let cut = |rows: &mut BitMatrix| {
        let before = rows.count_ones();
        for a in 0..rows.rows() {
            let far: Vec<usize> = rows.ones(a).filter(|&b| are_apart(&boxes, a, b, units)).collect();
            far.into_iter().for_each(|b| rows.clear(a, b));
        }
        before - rows.count_ones()
    };
    cut(&mut vis.lower);
    cut(&mut vis.upper)
}

/// The box around the portals of each cell.
fn boxes(level: &Level) -> Vec<Aabb> {
    let mut boxes = vec![Aabb::EMPTY; level.cells];
    for portal in &level.portals {
        let around = Aabb::of(portal.winding.iter().copied());
        portal.cells.iter().for_each(|&cell| boxes[cell as usize] = boxes[cell as usize].union(around));
    }
    boxes
}

/// Sight from one to the other passes a portal of each, so it is at least as long as the gap between their boxes.
fn are_apart(boxes: &[Aabb], a: usize, b: usize, units: f64) -> bool {
    let gap = (boxes[b].min - boxes[a].max).max(boxes[a].min - boxes[b].max).max(glam::DVec3::ZERO);
    a != b && gap.length() > units
}
