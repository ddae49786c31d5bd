//! Planar polygons with holes.

use crate::math::geom::{Plane, middle, newell};
use glam::DVec3;

/// A planar polygon; rings after the first are holes, and all may have any winding.
#[derive(Clone, PartialEq, Debug)]
pub struct Polygon {
    /// Its plane, in either orientation.
    pub plane: Plane,
    /// Rings without a repeated last corner.
    pub rings: Vec<Vec<DVec3>>,
}

impl Polygon {
    /// A polygon from its rings; `None` if the outer one has no area.
    pub fn new(rings: Vec<Vec<DVec3>>) -> Option<Self> {
        let outer = rings.first().filter(|r| r.len() >= 3)?;
        let centre = middle(outer);
        let n = newell(&outer.iter().map(|&p| p - centre).collect::<Vec<_>>()).try_normalize()?;
        Some(Self { plane: Plane::through(centre, n), rings })
    }

    /// Largest distance of a corner from the plane, metres.
    pub fn off_plane(&self) -> f64 {
        self.rings.iter().flatten().map(|&p| self.plane.distance(p).abs()).fold(0.0, f64::max)
    }

    /// Whether a point of the plane is inside, by the even-odd rule over all rings.
    pub fn holds(&self, p: DVec3) -> bool {
        let n = self.plane.n.abs();
        // The two axes of the largest projection.
        let (u, v) = if n.x >= n.y && n.x >= n.z {
            (1, 2)
        } else if n.y >= n.z {
            (0, 2)
        } else {
            (0, 1)
        };
        let crosses = |a: DVec3, b: DVec3| {
            (a[v] > p[v]) != (b[v] > p[v]) && p[u] < a[u] + (b[u] - a[u]) * ((p[v] - a[v]) / (b[v] - a[v]))
        };
        let edges = self.rings.iter().flat_map(|r| r.iter().zip(r.iter().cycle().skip(1)));
        edges.filter(|(a, b)| crosses(**a, **b)).count() % 2 == 1
    }
}
