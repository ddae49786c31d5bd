//! A box of about the least volume around a convex hull.
//!
//! Based on: Barequet, Har-Peled, *Efficiently approximating the minimum-volume bounding box of a point set in three dimensions*, 2001,
//! and the local step of Chang, Gorissen, Michel, *Fast oriented bounding box optimization on the rotation group SO(3)*, 2011: a given
//! direction has an exactly least box (Toussaint 1983, rotating calipers around the hull as seen along it); each axis of the best box so
//! far is such a direction, until none makes it smaller. Deviation: directions to begin with are the hull's largest faces (a least box
//! often lies on one), its principal axes and the aligned ones, instead of a grid's or of a random population.

use super::hull::{Hull, ring};
use super::principal;
use enfilade::occlusion::bounds::Bounds;
use glam::{DMat3, DVec2, DVec3};

/// Most faces whose normals are tried. More: slower, for some tenths of a percent. Fewer: boxes of round things with one flat side miss it.
const FACES: usize = 24;
/// Most rounds over three axes. They end by themselves, mostly within five; a bound on work all the same.
const ROUNDS: usize = 20;
/// Of the volume, what a round must gain to be followed by another. Larger: coarser boxes. Smaller: rounds that gain nothing that shows.
const GAIN: f64 = 1e-4;
/// Of the cube of the size, volumes that differ by less are equal, and the lesser area counts: all boxes of flat things are.
const FLAT: f64 = 1e-9;

/// The box of about the least volume around a hull, never of more than the aligned one's.
pub fn minimum(hull: &Hull) -> Bounds {
    let points = &hull.points;
    let aligned = Bounds::along(points, DMat3::IDENTITY.to_cols_array_2d().map(DVec3::from));
    let equal = FLAT * aligned.half.max_element().powi(3);
    let mut best = aligned;
    let mut offer = |new: Bounds| {
        let gain = best.volume() - new.volume();
        if gain > equal || (gain.abs() <= equal && new.area() < best.area()) {
            best = new;
        }
        best
    };
    // 1. Where to begin.
    let axes = principal(hull.spread());
    offer(Bounds::along(points, axes));
    for direction in normals(hull).into_iter().chain(axes) {
        offer(around(points, direction));
    }
    // 2. Downhill.
    for _ in 0..ROUNDS {
        let before = offer(aligned);
        let mut now = before;
        for axis in before.axes {
            now = offer(around(points, axis));
        }
        if now.volume() >= before.volume() * (1.0 - GAIN) {
            break;
        }
    }
    offer(aligned)
}

/// Normals of the largest faces, no two along the same line.
fn normals(hull: &Hull) -> Vec<DVec3> {
    /// Cosine of a quarter of a degree: triangles of one flat side, as rounded.
    const SAME: f64 = 0.99999;
    let normal = |t: usize| {
        let [a, b, c] = hull.corners(t);
        (b - a).cross(c - a)
    };
    let mut all: Vec<DVec3> = (0..hull.triangles.len()).map(normal).collect();
    all.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    let mut kept: Vec<DVec3> = Vec::new();
    for normal in all.into_iter().filter_map(DVec3::try_normalize) {
        if kept.len() < FACES && kept.iter().all(|k| k.dot(normal).abs() < SAME) {
            kept.push(normal);
        }
    }
    kept
}

/// The least box with one axis along `direction` (a unit vector): of all rectangles around the points as seen along it, the least has a
/// side on an edge of their hull (Freeman, Shapira 1975).
fn around(points: &[DVec3], direction: DVec3) -> Bounds {
    let u = direction.any_orthonormal_vector();
    let v = direction.cross(u);
    let ring: Vec<DVec2> =
        ring(points, u, v).iter().map(|&i| points[i as usize]).map(|p| DVec2::new(u.dot(p), v.dot(p))).collect();
    let n = ring.len();
    let (mut least, mut side) = (f64::INFINITY, DVec2::X);
    // Farthest along the edge, away from it, and back: each only goes on around the ring as the edge does.
    let (mut ahead, mut across, mut behind) = (1, 1, 1);
    for i in 0..n {
        let Some(edge) = (ring[(i + 1) % n] - ring[i]).try_normalize() else { continue };
        let advance = |from: usize, along: DVec2| {
            let mut at = from;
            while at < from + n && along.dot(ring[(at + 1) % n]) > along.dot(ring[at % n]) {
                at += 1;
            }
            at
        };
        ahead = advance(ahead.max(i + 1), edge);
        across = advance(across.max(ahead), edge.perp());
        behind = advance(behind.max(across), -edge);
        let length = edge.dot(ring[ahead % n] - ring[behind % n]);
        let area = length * edge.perp().dot(ring[across % n] - ring[i]);
        // Of flat things all areas are zero.
        let size = area + f64::EPSILON * length * length;
        if size < least {
            (least, side) = (size, edge);
        }
    }
    let x = u * side.x + v * side.y;
    Bounds::along(points, [x, direction.cross(x), direction])
}
