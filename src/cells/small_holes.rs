//! Closes portals that are narrower than the user's smallest hole.
//!
//! Level editors have the same parameter ("smallest hole"): cracks between blocks, gaps under doors and grilles cost portals, and nobody
//! misses the view through them. Width is measured in the plane of the portal: a point is wide if a disc of that diameter contains it and
//! meets no opaque triangle. So a strip along the floor of a doorway is as wide as the doorway. A portal is narrow if most of its area is.
//! Door leaves are not opaque: a door is as wide as its frame.

use super::opaque::Opaque;
use super::{CellGraph, Portal, PortalKind};
use crate::math::geom::{Aabb, Plane, clip};
use crate::math::parallel;
use crate::scene::Scene;
use crate::types::note::Note;
use glam::{DVec2, DVec3};
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// A part of a portal with corners this near to its centre, in smallest holes, is not subdivided. Larger: coarse steps, up to half of a
/// portal. Smaller: cracks cost more.
const FINEST: f64 = 0.125;

/// Relative tolerance of the disc's diameter. Larger: holes narrower by that much stay open. Smaller: tightly fitting discs are not found.
const SLACK: f64 = 0.01;

/// Most parts of one portal. More: long rims of large portals cost more. Fewer: some of their cracks stay open.
const MOST_PARTS: usize = 1 << 14;

/// Search for a disc: centres per ring, rings, then refinement steps from the best. More: slower. Fewer: tightly fitting discs are not
/// found.
const MIDDLES: (usize, usize, usize) = (16, 4, 12);

/// Removes narrow portals from a graph; their windings become [`CellGraph::closed_holes`].
///
/// `smallest_hole` is in metres, and applied to within 2 %. Objects visible only through a closed hole are culled.
pub fn close(scene: &Scene, graph: &mut CellGraph, smallest_hole: f64) {
    let (opaque, near) = (Opaque::new(scene), scene.tolerance().clearance);
    let narrow = parallel::map(&graph.portals, |portal| is_narrow(portal, &opaque, near, smallest_hole));
    let before = graph.portals.len();
    let (mut kept, mut closed, mut doors) = (Vec::new(), Vec::new(), 0);
    for (portal, narrow) in std::mem::take(&mut graph.portals).into_iter().zip(narrow) {
        if narrow {
            doors += usize::from(portal.kind == PortalKind::Door);
            closed.push(portal.winding);
        } else {
            kept.push(portal);
        }
    }
    graph.portals = kept;
    graph.link();
    graph.notes.push(Note::taken(match closed.len() {
        0 => format!("no portal is narrower than {smallest_hole} m (--smallest-hole)"),
        closed => format!(
            "{closed} of {before} portals are narrower than {smallest_hole} m (--smallest-hole) and are closed, including {doors} doors: \
             objects visible only through them are culled"
        ),
    }));
    graph.closed_holes.append(&mut closed);
}

/// Whether most of a portal is narrower than `hole` metres. Triangles within `near` metres of its plane count as obstacles.
fn is_narrow(portal: &Portal, opaque: &Opaque, near: f64, hole: f64) -> bool {
    let (plane, corners) = (portal.plane, &portal.winding);
    let (u, v) = plane.n.any_orthonormal_pair();
    let flat = |p: DVec3| DVec2::new(p.dot(u), p.dot(v));
    let sides = [Plane { d: plane.d + near, ..plane }, Plane { d: near - plane.d, n: -plane.n }];
    let obstacle = |triangle: [DVec3; 3]| {
        let cut = clip(&clip(&triangle, &sides[0], 0.0), &sides[1], 0.0);
        (!cut.is_empty()).then(|| Obstacle::new(cut.into_iter().map(flat).collect()))
    };
    let bounds = Aabb::of(corners.iter().copied()).inflated(2.0 * hole + near);
    let around: Vec<Obstacle> = opaque.in_box(&bounds).into_iter().filter_map(obstacle).collect();
    let corners: Vec<DVec2> = corners.iter().map(|&p| flat(p)).collect();
    let fan = (1..corners.len() - 1).map(|i| [corners[0], corners[i], corners[i + 1]]);
    is_mostly_narrow(fan.collect(), &around, hole)
}

/// A convex polygon in the plane that discs must avoid.
struct Obstacle {
    corners: Vec<DVec2>,
    /// Its bounding circle.
    middle: DVec2,
    reach: f64,
}

impl Obstacle {
    fn new(corners: Vec<DVec2>) -> Self {
        let middle = corners.iter().sum::<DVec2>() / corners.len() as f64;
        let reach = corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
        Self { corners, middle, reach }
    }

    fn distance(&self, p: DVec2) -> f64 {
        let edges = || self.corners.iter().zip(self.corners.iter().cycle().skip(1));
        let turns = || edges().map(|(&a, &b)| (b - a).perp_dot(p - a));
        if turns().all(|t| t > 0.0) || turns().all(|t| t < 0.0) {
            return 0.0;
        }
        let to_edge = |(&a, &b): (&DVec2, &DVec2)| {
            let (along, squared) = ((p - a).dot(b - a), a.distance_squared(b));
            let at = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
            p.distance(a.lerp(b, at))
        };
        edges().map(to_edge).fold(f64::INFINITY, f64::min)
    }
}

/// Whether at least half of the triangles' area is narrow.
fn is_mostly_narrow(triangles: Vec<[DVec2; 3]>, around: &[Obstacle], hole: f64) -> bool {
    let area = |[a, b, c]: &[DVec2; 3]| 0.5 * (*b - *a).perp_dot(*c - *a).abs();
    let half = 0.5 * triangles.iter().map(area).sum::<f64>();
    let all: Vec<u32> = (0..around.len() as u32).collect();
    let mut parts: VecDeque<_> = triangles.into_iter().map(|t| (t, all.clone())).collect();
    let (mut wide, mut narrow) = (0.0, 0.0);
    // Large parts first, so that a wide portal is decided quickly.
    for _ in 0..MOST_PARTS {
        let Some((part @ [a, b, c], near)) = parts.pop_front() else { break };
        let middle = (a + b + c) / 3.0;
        let reach = part.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
        let of_interest = |&i: &u32| {
            let obstacle = &around[i as usize];
            obstacle.middle.distance(middle) <= obstacle.reach + reach + hole
        };
        let near: Vec<u32> = near.into_iter().filter(of_interest).collect();
        let distance = |p: DVec2| near.iter().map(|&i| around[i as usize].distance(p)).fold(f64::INFINITY, f64::min);
        let free = distance(middle);
        if free >= 0.5 * hole && free >= reach {
            wide += area(&part);
        } else if reach <= FINEST * hole {
            *(if is_held(middle, 0.5 * hole, distance) { &mut wide } else { &mut narrow }) += area(&part);
        } else {
            let lengths = [a.distance(b), b.distance(c), c.distance(a)];
            let longest = (0..3).max_by(|&i, &j| lengths[i].total_cmp(&lengths[j])).unwrap_or_default();
            let [p, q, r] = [part[longest], part[(longest + 1) % 3], part[(longest + 2) % 3]];
            let between = p.midpoint(q);
            parts.push_back(([p, between, r], near.clone()));
            parts.push_back(([between, q, r], near));
        }
        if wide > half || narrow >= half {
            return narrow >= half;
        }
    }
    false
}

/// Whether some disc of a radius contains `p` and avoids all obstacles; `distance` is the distance to the nearest one.
fn is_held(p: DVec2, radius: f64, distance: impl Fn(DVec2) -> f64) -> bool {
    let (turns, rings, steps) = MIDDLES;
    let on_ring = |ring: usize| {
        let length = radius * ring as f64 / rings as f64;
        (0..turns).map(move |turn| p + length * DVec2::from_angle(TAU * turn as f64 / turns as f64))
    };
    let enough = radius * (1.0 - SLACK);
    let mut best = (distance(p), p);
    let better = |best: (f64, DVec2), middle: DVec2| {
        let free = if middle.distance(p) <= radius { distance(middle) } else { 0.0 };
        if free > best.0 { (free, middle) } else { best }
    };
    best = (1..=rings).flat_map(on_ring).fold(best, better);
    let mut step = radius / rings as f64;
    for _ in 0..steps {
        let from = best.1;
        best = (0..turns).map(|turn| from + step * DVec2::from_angle(TAU * turn as f64 / turns as f64)).fold(best, better);
        if best.1 == from {
            step *= 0.5;
        }
        if best.0 >= enough {
            return true;
        }
    }
    best.0 >= enough
}
