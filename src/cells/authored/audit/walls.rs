//! Distances of rooms' sides from their walls, floors and ceilings.

use super::finding::{Finding, FindingKind, called};
use crate::math::parallel;
use crate::scene::rays::RayScene;
use crate::scene::{Role, RoomHint};
use glam::DVec3;

/// Walls farther than this from a side are not the side's, metres.
const REACH: f64 = 0.6;
/// A side within this distance lies on its wall, metres: plaster, rounding to centimetres.
const ON_WALL: f64 = 0.03;
/// Smaller sides are reveals and niches, square metres.
const LEAST_SIDE: f64 = 0.5;
/// Sample points a square metre of a side.
const POINTS: f64 = 3.0;
const MOST_POINTS: usize = 48;
/// A side has a wall if at least this share of its sample points has one near.
const BOUNDED: f64 = 0.6;
/// Triangles belong to one side within this cosine of its normal and this distance from its plane (metres).
const SAME_SIDE_COSINE: f64 = 0.9995;
const SAME_SIDE_OFFSET: f64 = 0.01;

/// Coplanar triangles of a room's surface.
struct Side {
    n: DVec3,
    d: f64,
    area: f64,
    triangles: Vec<[DVec3; 3]>,
}

/// Sound rooms whose sides do not lie on their walls.
pub(super) fn findings(rays: &RayScene<'_>, unsound: &[bool], metre: f64) -> Vec<Finding> {
    let rooms = rays.scene().hints.rooms.iter().zip(unsound).filter(|(r, unsound)| r.drawn && !**unsound);
    let rooms: Vec<&RoomHint> = rooms.map(|(room, _)| room).collect();
    parallel::flat_map(&rooms, |room| finding(room, rays, metre))
}

fn finding(room: &RoomHint, rays: &RayScene<'_>, metre: f64) -> Option<Finding> {
    let sides = sides(room, metre);
    let offsets: Vec<f64> = sides.iter().filter_map(|side| offset(side, rays, metre)).collect();
    let off = offsets.iter().filter(|o| **o > ON_WALL * metre).count();
    let farthest = offsets.iter().copied().fold(0.0, f64::max);
    (off > 0).then(|| Finding {
        kind: FindingKind::Shifted,
        ids: vec![room.id.clone()],
        text: format!("{}: {off} of its {} sides are off their walls, by up to {farthest:.2} m", called(room), sides.len()),
    })
}

fn sides(room: &RoomHint, metre: f64) -> Vec<Side> {
    let mut sides: Vec<Side> = Vec::new();
    for t in &room.surface {
        let cross = (t[1] - t[0]).cross(t[2] - t[0]);
        let Some(n) = cross.try_normalize() else { continue };
        let (d, area) = (n.dot(t[0]), 0.5 * cross.length());
        let fits = |s: &&mut Side| {
            let along = s.n.dot(n);
            along.abs() > SAME_SIDE_COSINE && (s.d - d * along.signum()).abs() < SAME_SIDE_OFFSET * metre
        };
        match sides.iter_mut().find(fits) {
            Some(side) => {
                side.area += area;
                side.triangles.push(*t);
            }
            None => sides.push(Side { n, d, area, triangles: vec![*t] }),
        }
    }
    sides.retain(|s| s.area >= LEAST_SIDE * metre * metre);
    sides
}

/// Distance of a side from its wall, metres: the median over its sample points. `None` without a wall.
fn offset(side: &Side, rays: &RayScene<'_>, metre: f64) -> Option<f64> {
    let wanted = ((side.area / (metre * metre) * POINTS) as usize).clamp(4, MOST_POINTS);
    let (mut count, mut found) = (0usize, Vec::new());
    for t in &side.triangles {
        let area = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).length();
        let points = (area / side.area * wanted as f64).round() as usize;
        for k in 0..points {
            // The R2 sequence (Roberts, *The unreasonable effectiveness of quasirandom sequences*, 2018), folded into a triangle.
            let (a, b) = ((0.5 + 0.754_877_666 * k as f64).fract(), (0.5 + 0.569_840_291 * k as f64).fract());
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            let p = t[0] + (t[1] - t[0]) * a + (t[2] - t[0]) * b;
            count += 1;
            // Starts a little before the side, so that a wall in its plane is hit.
            let before = SAME_SIDE_OFFSET * metre;
            let nearest = [side.n, -side.n].into_iter().filter_map(|way| {
                let hit = rays.first_opaque(p - way * before, way, REACH * metre + before)?;
                let role = rays.scene().objects[hit.object.index()].role;
                matches!(role, Role::Structure | Role::Stair | Role::Unknown).then(|| (hit.t - before).abs())
            });
            found.extend(nearest.min_by(f64::total_cmp));
        }
    }
    if count == 0 || (found.len() as f64) < BOUNDED * count as f64 {
        return None;
    }
    found.sort_by(f64::total_cmp);
    Some(found[found.len() / 2])
}
