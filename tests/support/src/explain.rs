//! What the stated tolerance of cubes explains, worked out in `f64` from triangles and directions of pixels alone.

use enfilade::pvs::cubes::{Cube, CubeView, DEPTH, EDGE, NONE, SeeThrough, UNDERFOOT};
use enfilade::scene::Scene;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// What an engine may be off by.
#[derive(Clone, Copy)]
pub struct Allowed {
    /// Pixels between a pixel's middle and an edge.
    pub edge: f64,
    /// Of the distance of a triangle's farthest corner: how far off its corners may be.
    pub corners: f64,
    /// Metres along a face's axis: what is nearer may be left out.
    pub near: f64,
}

/// The engines that agree to the bit.
pub const EXACT: Allowed = Allowed { edge: EDGE, corners: 0.0, near: 0.0 };

/// A triangle on the face of a pixel, as its corners' x, y and w.
pub struct Seen<'v> {
    view: &'v CubeView,
    corners: [DVec3; 3],
    /// The pixel's middle.
    at: DVec2,
    allowed: Allowed,
}

impl<'v> Seen<'v> {
    pub fn new(scene: &Scene, view: &'v CubeView, pixel: usize, triangle: u32, allowed: Allowed) -> Self {
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
        Self { view, corners, at: DVec2::new(d.dot(x), d.dot(y)), allowed }
    }

    /// Pixels in a step of the tangent.
    fn pixels(&self) -> f64 {
        f64::from(self.view.size) / 2.0
    }

    /// How far off corners may be, metres.
    fn off(&self) -> f64 {
        self.corners.iter().map(|p| p.length()).fold(0.0, f64::max) * self.allowed.corners
    }

    /// Whether the pixel's middle is within the tolerance of an edge's line, and within a tile of the edge.
    fn is_at_an_edge(&self) -> bool {
        (0..3).any(|i| {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % 3]);
            let plane = a.cross(b);
            // How much of it corners that are off make up: either moves, square to the ray and to the other.
            let moved = self.off() * (a.length() + b.length()) * self.at.extend(1.0).length();
            let off = (plane.dot(self.at.extend(1.0)).abs() - moved) / plane.truncate().length() * self.pixels();
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
            off <= self.allowed.edge && away * self.pixels() <= 8.0
        })
    }

    /// The range of 1/w of its plane within the tolerance of the pixel's middle.
    fn depth(&self) -> [f64; 2] {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a);
        let plane = normal / normal.dot(a);
        let (depth, step) = (plane.dot(self.at.extend(1.0)), plane.truncate().abs().element_sum() * EDGE / self.pixels());
        // A plane that is off by a part of its distance puts depths off by as much of themselves.
        let part = DEPTH + self.off() * normal.length() / normal.dot(a).abs();
        [depth - step - depth.abs() * part, depth + step + depth.abs() * part]
    }

    /// Whether it is so near there that it may be left out.
    fn is_too_near(&self) -> bool {
        self.is_met() && self.depth()[1] * self.allowed.near >= 1.0
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
pub fn is_explained(scene: &Scene, view: &CubeView, pixel: usize, a: u32, b: u32, allowed: Allowed) -> bool {
    let shown = [a, b].into_iter().filter(|&t| t != NONE);
    let seen: Vec<Seen> = shown.map(|t| Seen::new(scene, view, pixel, t, allowed)).collect();
    seen.iter().any(|s| s.is_at_an_edge() || s.is_underfoot() || s.is_too_near())
        || (seen.len() == 2 && seen[0].is_as_deep_as(&seen[1]))
}

/// How many pixels of a cube differ from the truth and how many hits of what is seen through, all of them explained.
pub fn compare(scene: &Scene, view: &CubeView, got: &Cube, want: &Cube, allowed: Allowed) -> usize {
    let differ: Vec<usize> = (0..view.pixels()).filter(|&p| got.triangles[p] != want.triangles[p]).collect();
    for &pixel in &differ {
        let (a, b) = (got.triangles[pixel], want.triangles[pixel]);
        assert!(is_explained(scene, view, pixel, a, b, allowed), "{view:?}, pixel {pixel}: {a} for {b}");
    }
    // What is seen through: one triangle for a pixel and an object.
    let by_object = |hits: &[SeeThrough]| {
        let of = |h: &SeeThrough| ((h.pixel, scene.object_of(h.triangle as usize)), h.triangle);
        let map: BTreeMap<_, _> = hits.iter().map(of).collect();
        assert_eq!(map.len(), hits.len(), "an object twice at a pixel");
        map
    };
    let (got_hits, want_hits) = (by_object(&got.see_through), by_object(&want.see_through));
    let mut seen_through = 0;
    for (key, &a) in got_hits.iter().chain(&want_hits) {
        let pixel = key.0 as usize;
        let other = |hits: &BTreeMap<_, u32>| hits.get(key).copied().unwrap_or(NONE);
        let (got_one, want_one) = (other(&got_hits), other(&want_hits));
        if got_one == want_one {
            continue;
        }
        seen_through += 1;
        let behind = [got.triangles[pixel], want.triangles[pixel]];
        let seen = |t: u32| Seen::new(scene, view, pixel, t, allowed);
        let level = |&t: &u32| t != NONE && seen(a).is_as_deep_as(&seen(t));
        let explained = behind[0] != behind[1]
            || behind.iter().any(level)
            || is_explained(scene, view, pixel, got_one, want_one, allowed);
        assert!(explained, "{view:?}, pixel {pixel}: {got_one} for {want_one}, seen through");
    }
    differ.len() + seen_through
}
