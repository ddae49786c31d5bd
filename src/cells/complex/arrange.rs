//! The plan: a triangulation with every wall and outline as constraints, crossings resolved.
//!
//! Corners live on a grid finer than the coplanar tolerance, so two of them are equal or clearly distinct. A segment that ends just short
//! of another is extended to it: a line too long costs a triangle, a line too short leaves a slit open.

use super::bands::Band;
use super::limits::{Count, Limits};
use super::snap::{Corner, snap_round};
use crate::math::geom::Aabb;
use crate::math::parallel;
use glam::DVec2;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

/// A corner lies on a line within this share of the reach.
const ON_LINE: f64 = 0.05;

/// Lines with at most this sine of their angle have no crossing.
const NEARLY_PARALLEL: f64 = 1e-7;

/// The triangles of the plan and their adjacency.
#[derive(Debug, Default)]
pub struct Plan {
    /// Corners.
    pub points: Vec<DVec2>,
    /// Corners of each triangle, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
    /// Edge `i` of a triangle runs from its corner `i` to the next; the triangle beyond it, except at the rim.
    pub neighbours: Vec<[Option<u32>; 3]>,
    /// Whether that edge lies on a wall or an outline.
    pub constrained: Vec<[bool; 3]>,
    /// The triangles of each band.
    pub bands: Vec<Range<usize>>,
}

impl Plan {
    /// Area of a triangle, square metres.
    pub fn area(&self, triangle: usize) -> f64 {
        super::polygon::area(&self.triangles[triangle].map(|i| self.points[i as usize]))
    }
}

/// Triangulates the rectangle of `domain` along the lines of each band; `None` if there are more crossings than `limits` allow.
pub fn arrange(bands: &[Band], domain: Aabb, coplanar: f64, reach: f64, limits: &Limits<'_>) -> Option<Plan> {
    let count = limits.count();
    let plans: Vec<Option<Plan>> = parallel::map(bands, |band| arrange_band(band, domain, coplanar, reach, &count));
    let plans: Vec<Plan> = plans.into_iter().collect::<Option<_>>()?;
    let mut all = Plan::default();
    for plan in plans {
        let (points, triangles) = (all.points.len() as u32, all.triangles.len() as u32);
        all.points.extend(plan.points);
        all.triangles.extend(plan.triangles.into_iter().map(|t| t.map(|p| p + points)));
        all.neighbours.extend(plan.neighbours.into_iter().map(|n| n.map(|n| n.map(|n| n + triangles))));
        all.constrained.extend(plan.constrained);
        all.bands.push(triangles as usize..all.triangles.len());
    }
    Some(all)
}

fn arrange_band(band: &Band, domain: Aabb, coplanar: f64, reach: f64, count: &Count<'_>) -> Option<Plan> {
    // A power of two keeps grid coordinates exact.
    let grid = (coplanar * 0.5).log2().floor().exp2();
    let snap = |q: DVec2| ((q.x / grid).round() as i64, (q.y / grid).round() as i64);
    let mut segments = band.segments.clone();
    segments.retain(|(a, b)| snap(*a) != snap(*b));

    let mut points: HashMap<Corner, usize> = HashMap::new();
    let mut corners: Vec<Corner> = Vec::new();
    let mut vertex = |q: DVec2| {
        let key = snap(q);
        *points.entry(key).or_insert_with(|| {
            corners.push(key);
            corners.len() - 1
        })
    };
    let (x0, x1, y0, y1) = (domain.min.x, domain.max.x, -domain.max.z, -domain.min.z);
    let rim = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| vertex(DVec2::new(x, y)));
    let mut edges: BTreeSet<[usize; 2]> = BTreeSet::new();
    let mut edge = |a: usize, b: usize| {
        if a != b {
            edges.insert([a.min(b), a.max(b)]);
        }
    };
    for i in 0..4 {
        edge(rim[i], rim[(i + 1) % 4]);
    }
    let crossings = crossings(&segments, reach, count);
    if count.is_over() {
        return None;
    }
    for (&(a, b), mut at) in segments.iter().zip(crossings) {
        at.extend([0.0, 1.0]);
        at.sort_by(f64::total_cmp);
        let ids: Vec<usize> = at.iter().map(|t| vertex(a + (b - a) * *t)).collect();
        for pair in ids.windows(2) {
            edge(pair[0], pair[1]);
        }
    }
    Some(triangulate(corners, edges.into_iter().collect(), grid))
}

/// Crossings on each segment, as fractions of its length; beyond 0 or 1 if it ends short by up to `reach`. Incomplete if the count is over
/// the limit.
fn crossings(segments: &[(DVec2, DVec2)], reach: f64, count: &Count<'_>) -> Vec<Vec<f64>> {
    let cell = segments.iter().map(|(a, b)| a.distance(*b)).sum::<f64>() / (segments.len().max(1)) as f64 + 4.0 * reach;
    let cells_of = |&(a, b): &(DVec2, DVec2)| {
        let (lo, hi) = ((a.min(b) - reach) / cell, (a.max(b) + reach) / cell);
        let n = (b - a).perp().normalize_or_zero();
        (lo.x.floor() as i64..=hi.x.floor() as i64)
            .flat_map(move |i| (lo.y.floor() as i64..=hi.y.floor() as i64).map(move |j| (i, j)))
            .filter(move |&(i, j)| {
                let middle = (DVec2::new(i as f64, j as f64) + 0.5) * cell;
                n.dot(middle - a).abs() <= cell * 0.75 + reach
            })
    };
    let mut buckets: HashMap<(i64, i64), Vec<u32>> = HashMap::new();
    for (i, s) in segments.iter().enumerate() {
        for c in cells_of(s) {
            buckets.entry(c).or_default().push(i as u32);
        }
    }
    parallel::map_range(0..segments.len(), |i| {
        let s = &segments[i];
        if count.is_over() {
            return Vec::new();
        }
        let mut others: Vec<u32> = cells_of(s).filter_map(|c| buckets.get(&c)).flatten().copied().collect();
        others.sort_unstable();
        others.dedup();
        let (a, b) = *s;
        let length = a.distance(b);
        let mut at: Vec<f64> = Vec::new();
        let (mut before, mut after) = (f64::NEG_INFINITY, f64::INFINITY);
        for j in others.into_iter().filter(|&j| j as usize != i) {
            let (c, d) = segments[j as usize];
            let (r, q) = (b - a, d - c);
            let cross = r.perp_dot(q);
            // Nearly parallel lines have no crossing: their ends become corners of each other instead.
            if cross.abs() <= NEARLY_PARALLEL * length * q.length() {
                at.extend([c, d].into_iter().filter_map(|end| corner_at(*s, end, reach)));
                continue;
            }
            let t = (c - a).perp_dot(q) / cross;
            let u = (c - a).perp_dot(r) / cross;
            let (slack, other) = (reach / length, reach / q.length());
            if u < -other || u > 1.0 + other || t < -slack || t > 1.0 + slack {
                continue;
            }
            if t < 0.0 {
                before = before.max(t);
            } else if t > 1.0 {
                after = after.min(t);
            } else {
                at.push(t);
            }
        }
        at.extend([before, after].into_iter().filter(|t| t.is_finite()));
        count.add(corners_within(&at, length, reach));
        at
    })
}

/// Number of corners that crossings add within a line: lines that cross at one point add one corner.
fn corners_within(at: &[f64], length: f64, reach: f64) -> usize {
    let mut along: Vec<f64> = at.iter().map(|t| t * length).filter(|&u| u > reach && length - u > reach).collect();
    along.sort_by(f64::total_cmp);
    along.dedup_by(|u, before| *u - *before <= reach * ON_LINE);
    along.len()
}

fn triangulate(mut corners: Vec<Corner>, edges: Vec<[usize; 2]>, grid: f64) -> Plan {
    let triangles = |corners: &[Corner], edges: Vec<[usize; 2]>| {
        let at = corners.iter().map(|&(x, y)| Point2::new(x as f64 * grid, y as f64 * grid)).collect();
        let mut conflicts = 0;
        let cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(at, edges, |_| conflicts += 1)
            .expect("grid coordinates are finite and of moderate size");
        (cdt, conflicts)
    };
    let (mut cdt, conflicts) = triangles(&corners, edges.clone());
    // After snapping to the grid, two neighbours can cross slightly.
    if conflicts > 0 {
        let edges = snap_round(&mut corners, &edges);
        cdt = triangles(&corners, edges).0;
    }
    let number: HashMap<usize, u32> = cdt.inner_faces().enumerate().map(|(i, f)| (f.fix().index(), i as u32)).collect();
    let mut plan =
        Plan { points: cdt.vertices().map(|v| DVec2::new(v.position().x, v.position().y)).collect(), ..Plan::default() };
    for face in cdt.inner_faces() {
        let edges = face.adjacent_edges();
        plan.triangles.push(edges.map(|e| e.from().fix().index() as u32));
        plan.neighbours.push(edges.map(|e| e.rev().face().as_inner().map(|f| number[&f.fix().index()])));
        plan.constrained.push(edges.map(|e| e.is_constraint_edge()));
    }
    plan
}

/// Where a point is a corner of a segment, as a fraction of its length; `None` if it does not lie on it.
fn corner_at((a, b): (DVec2, DVec2), end: DVec2, reach: f64) -> Option<f64> {
    let (along, length) = (b - a, a.distance(b));
    let t = (end - a).dot(along) / (length * length);
    let off = (a + along * t).distance(end);
    (off < reach * ON_LINE && t > 0.0 && t < 1.0).then_some(t)
}

#[cfg(test)]
mod tests {
    use super::super::limits::Limits;
    use super::*;
    use crate::job::Job;

    /// Walls of stacked storeys lie on one line: any number of crossings at one point adds one corner.
    #[test]
    fn crossings_in_one_place_count_once() {
        let job = Job::quiet();
        let is_over = |walls: usize, apart: f64, most: usize| {
            let along = |k: usize| {
                let y = k as f64 * apart;
                (DVec2::new(0.0, y), DVec2::new(20.0, y))
            };
            let across = |k: usize| (DVec2::new(k as f64, -10.0), DVec2::new(k as f64, 10.0));
            let segments: Vec<_> = (0..walls).map(along).chain((1..11).map(across)).collect();
            let limits = Limits { most, work: &job };
            let count = limits.count();
            crossings(&segments, 0.03, &count);
            count.is_over()
        };
        // Ten lines across 60 coincident ones: 600 corners on the 60, and one on each of the ten.
        assert!(!is_over(60, 0.0, 610) && is_over(60, 0.0, 609));
        // Side by side: 600 on each set.
        assert!(!is_over(60, 0.1, 1200) && is_over(60, 0.1, 1199));
    }
}
