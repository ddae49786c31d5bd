//! What the stated tolerance of cubes explains, worked out in `f64` from triangles and directions of pixels alone.

use enfilade::pvs::cube::{CubeView, DEPTH, EDGE, NONE, UNDERFOOT};
use enfilade::scene::Scene;
use glam::{DVec2, DVec3};

/// A triangle on the face of a pixel, as its corners' x, y and w.
pub struct Seen<'v> {
    view: &'v CubeView,
    corners: [DVec3; 3],
    /// The pixel's middle.
    at: DVec2,
}

impl<'v> Seen<'v> {
    pub fn new(scene: &Scene, view: &'v CubeView, pixel: usize, triangle: u32) -> Self {
        // The face's axes, from nothing but directions of pixels: the middle of a face and steps along it.
        let size = view.size as usize;
        let first = pixel / (size * size) * size * size;
        let at = |column: usize, row: usize| view.direction(first + row * size + column);
        let into = (at(0, 0) + at(size - 1, size - 1)) / 2.0;
        let along = |d: DVec3| if size > 1 { d / d.length() } else { DVec3::ZERO };
        let (x, y) = (along(at(size - 1, 0) - at(0, 0)), along(at(0, size - 1) - at(0, 0)));
        let d = view.direction(pixel);
        let corners = scene.corners(triangle as usize).map(|p| {
            let v = p - view.eye;
            DVec3::new(v.dot(x), v.dot(y), v.dot(into))
        });
        Self { view, corners, at: DVec2::new(d.dot(x), d.dot(y)) }
    }

    /// Pixels in a step of the tangent.
    fn pixels(&self) -> f64 {
        f64::from(self.view.size) / 2.0
    }

    /// Whether the pixel's middle is within the tolerance of an edge's line, and within a tile of the edge.
    fn is_at_an_edge(&self) -> bool {
        (0..3).any(|i| {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % 3]);
            let plane = a.cross(b);
            let off = plane.dot(self.at.extend(1.0)).abs() / plane.truncate().length() * self.pixels();
            // The part of the edge that is before the eye.
            let least = 1e-12 * a.abs().max(b.abs()).max_element();
            let cut = |p: DVec3, q: DVec3| if p.z >= least { p } else { p + (q - p) * ((least - p.z) / (q.z - p.z)) };
            if a.z < least && b.z < least {
                return false;
            }
            let (p, q) = (cut(a, b), cut(b, a));
            let (p, q) = (p.truncate() / p.z, q.truncate() / q.z);
            let along = ((self.at - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
            let away = if along.is_finite() { self.at.distance(p + (q - p) * along) } else { self.at.distance(p) };
            off <= EDGE && away * self.pixels() <= 8.0
        })
    }

    /// The range of 1/w of its plane within the tolerance of the pixel's middle.
    fn depth(&self) -> [f64; 2] {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let plane = normal / normal.dot(a);
        let (depth, step) = (plane.dot(self.at.extend(1.0)), plane.truncate().abs().element_sum() * EDGE / self.pixels());
        [depth - step - depth.abs() * DEPTH, depth + step + depth.abs() * DEPTH]
    }

    /// Whether the ray through the pixel's middle meets it.
    fn is_met(&self) -> bool {
        let [a, b, c] = self.corners;
        let side = a.dot(b.cross(c));
        [a.cross(b), b.cross(c), c.cross(a)].iter().all(|plane| plane.dot(self.at.extend(1.0)) * side >= 0.0)
    }

    /// Whether the eye is as good as on it.
    fn is_underfoot(&self) -> bool {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let (altitude, off) = (normal.length() / longest, (normal.dot(a) / normal.length()).abs());
        let farthest = a.length().max(b.length()).max(c.length());
        off * altitude <= UNDERFOOT * farthest * longest
    }

    /// Whether the pixel's ray meets both at what may be the same depth.
    pub fn is_as_deep_as(&self, other: &Self) -> bool {
        let ([a, b], [c, d]) = (self.depth(), other.depth());
        self.is_met() && other.is_met() && a <= d && c <= b
    }
}

/// Whether the tolerance explains that one says `a` and the other `b`.
pub fn is_explained(scene: &Scene, view: &CubeView, pixel: usize, a: u32, b: u32) -> bool {
    let seen: Vec<Seen> = [a, b].into_iter().filter(|&t| t != NONE).map(|t| Seen::new(scene, view, pixel, t)).collect();
    seen.iter().any(|s| s.is_at_an_edge() || s.is_underfoot()) || (seen.len() == 2 && seen[0].is_as_deep_as(&seen[1]))
}
