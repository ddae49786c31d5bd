//! Windings: their corners, edges and normals.

use super::Edge;
use glam::DVec3;
use robust::{Coord, orient2d};

/// The corners that turn left in the projection along the normal's main axis; others are removed one by one.
pub fn hull(winding: &[DVec3]) -> Vec<DVec3> {
    let n = normal(winding);
    let (size, mut hull) = (n.abs(), winding.to_vec());
    let flat = |p: DVec3| match size.max_element() {
        s if s == size.x => Coord { x: p.y * n.x.signum(), y: p.z },
        s if s == size.y => Coord { x: p.z * n.y.signum(), y: p.x },
        _ => Coord { x: p.x * n.z.signum(), y: p.y },
    };
    let turns = |h: &[DVec3], i: usize| {
        let k = h.len();
        orient2d(flat(h[(i + k - 1) % k]), flat(h[i]), flat(h[(i + 1) % k])) > 0.0
    };
    while let Some(i) = (0..hull.len()).find(|&i| !turns(&hull, i)) {
        hull.remove(i);
    }
    hull
}

pub fn around(winding: &[DVec3]) -> impl Iterator<Item = Edge> {
    winding.iter().zip(winding.iter().cycle().skip(1)).map(|(&a, &b)| [a, b])
}

pub fn normal(winding: &[DVec3]) -> DVec3 {
    crate::math::geom::newell(&winding.iter().map(|&p| p - winding[0]).collect::<Vec<_>>())
}
