//! The faces between pieces, and their open parts.

use super::arrange::Plan;
use super::bands::{Band, Cut};
use super::columns::{Columns, Slice};
use super::coverage::{Open, open_part};
use super::facets::{Facets, Matter, Wall};
use super::polygon::{area, counter_clockwise, shape_area, shared, shared_area, width};
use super::to_plan;
use crate::job::{Job, Stopped};
use crate::math::box_tree::BoxTree;
use crate::math::geom::Aabb;
use crate::math::parallel;
use crate::math::tolerance::Tolerance;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::ops::Range;

/// The plane of a face, and its coordinates.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub enum Surface {
    /// On a wall's line: coordinates are (metres along the wall, height).
    Wall(u32),
    /// On an edge of the plan without a wall: (metres from the edge's start, height).
    Edge {
        /// A triangle of the plan.
        triangle: u32,
        /// Its edge.
        edge: u32,
    },
    /// On a sheet or a level: plan coordinates.
    Cut(Cut),
}

impl Surface {
    /// A key that is equal only for faces of one plane; ordered.
    pub fn key(&self) -> [u32; 3] {
        match *self {
            Self::Wall(w) => [0, w, 0],
            Self::Edge { triangle, edge } => [1, triangle, edge],
            Self::Cut(Cut::Sheet(s)) => [2, s, 0],
            Self::Cut(Cut::Level(l)) => [3, l, 0],
            Self::Cut(Cut::Bottom) => [4, 0, 0],
            Self::Cut(Cut::Top) => [5, 0, 0],
        }
    }
}

/// The face between pieces `a` and `b`. On a wall or edge, `a`'s column has the lower number; on a cut, `a` is below.
#[derive(Clone, Debug)]
pub struct Face {
    /// One piece.
    pub a: u32,
    /// The other.
    pub b: u32,
    /// Its plane.
    pub surface: Surface,
    /// Its polygon, convex, counter-clockwise in the surface's coordinates.
    pub polygon: Vec<DVec2>,
    /// Its open part.
    pub open: Open,
    /// Area of the open part in the surface's coordinates, square metres (without a sheet's slope).
    pub open_area: f64,
    /// Area of the face.
    pub area: f64,
    /// On a wall or edge: whether `a` is to the left of the direction in which the first coordinate grows.
    pub a_is_left: bool,
    /// Area of opaque triangles on it that face `a`, and of those that face `b`.
    pub fronts: [f64; 2],
    /// Area of door leaves and panes on it.
    pub leaves: f64,
    /// On a wall or edge: whether it is within the error of heights, so that the two pieces may not really meet.
    pub is_thin: bool,
}

/// A wall lies on an edge of the plan within this distance, in coplanar tolerances. Larger: walls beside an edge close it. Smaller:
/// snapping to the plan's grid separates walls from their own edges.
const ON_LINE: f64 = 1.5;
/// Thinner faces are dropped, in seals: coverage would remove them.
const CRUMB: f64 = 1e-3;
/// Cuts snap to others within the coplanar tolerance, per column, so heights of two neighbours may differ by this many of those. Larger:
/// thin slits close. Smaller: portals between cells that do not meet.
const SNAPPED: f64 = 2.0;

/// All faces between pieces, in a fixed order: bands ascending; in each its columns, each with its cuts, then its edges; then the
/// faces to the next band.
pub fn faces(
    plan: &Plan,
    bands: &[Band],
    columns: &Columns,
    facets: &Facets,
    tolerance: &Tolerance,
    work: &Job<'_>,
) -> Result<Vec<Face>, Stopped> {
    let (coplanar, seal) = (tolerance.coplanar, tolerance.seal);
    let of_band = |k: usize| {
        let grid = WallGrid::new(facets, &bands[k].wall_facets);
        let around = Around { plan, columns, facets, grid, coplanar, seal, work };
        let mut out = around.faces(plan.bands[k].clone());
        if k + 1 < bands.len() {
            out.extend(around.between_bands([k, k + 1]));
        }
        out
    };
    let found = parallel::flat_map_range(0..bands.len(), of_band);
    work.go_on().map(|()| found)
}

/// The surroundings of a band's faces.
struct Around<'a> {
    plan: &'a Plan,
    columns: &'a Columns,
    facets: &'a Facets,
    /// The walls of the band.
    grid: WallGrid,
    /// Metres, as in [`crate::math::tolerance::Tolerance`].
    coplanar: f64,
    seal: f64,
    work: &'a Job<'a>,
}

/// An edge of the plan under vertical faces, with its coordinates and walls.
struct Line<'l> {
    /// The ends of the edge of the plan.
    ends: [DVec2; 2],
    /// Coordinates of the ends, along the first wall's line, so that faces of one wall share coordinates.
    at: [f64; 2],
    /// Its walls, each with its triangles.
    walls: &'l [(u32, Vec<u32>)],
}

impl Around<'_> {
    fn faces(&self, triangles: Range<usize>) -> Vec<Face> {
        let of_column = |t: usize| {
            let mut out = Vec::new();
            if self.work.is_stopped() {
                return out;
            }
            self.cuts(t, &mut out);
            for e in 0..3 {
                if let Some(n) = self.plan.neighbours[t][e]
                    && (n as usize) > t
                {
                    self.sides(t, e, n as usize, &mut out);
                }
            }
            out
        };
        parallel::flat_map_range(triangles, of_column)
    }

    /// The faces between the uppermost pieces of a band and the lowest of the next: the intersections of all pairs of triangles.
    fn between_bands(&self, [low, high]: [usize; 2]) -> Vec<Face> {
        let Self { plan, columns, facets, seal, .. } = self;
        let corners = |t: usize| plan.triangles[t].map(|i| plan.points[i as usize]);
        let reach = |t: usize| {
            let q = corners(t);
            (q[0].min(q[1]).min(q[2]), q[0].max(q[1]).max(q[2]))
        };
        let flat = |p: DVec2| DVec3::new(p.x, p.y, 0.0);
        let boxes: Vec<Aabb> =
            plan.bands[high].clone().map(reach).map(|(a, b)| Aabb { min: flat(a), max: flat(b) }).collect();
        let tree = BoxTree::over(&boxes);
        let of_column = |t: usize| {
            let (a, b) = reach(t);
            let mut above = Vec::new();
            tree.in_box(&Aabb { min: flat(a), max: flat(b) }, &mut |i| above.push(plan.bands[high].start + i as usize));
            above.sort_unstable();
            let mut out = Vec::new();
            for n in above.into_iter().filter(|_| !self.work.is_stopped()) {
                let polygon = shared(corners(n), &corners(t));
                let whole = area(&polygon);
                // Coverage would remove it.
                if polygon.len() < 3 || width(&polygon) <= CRUMB * seal {
                    continue;
                }
                let (rim, floor) = (&columns.slices[t][columns.slices[t].len() - 1], &columns.slices[n][0]);
                let mut on = [rim.facets.as_slice(), floor.facets.as_slice()].concat();
                on.sort_unstable();
                on.dedup();
                let mut fronts = [0.0; 2];
                let mut triangles = Vec::new();
                let mut sheet = None;
                for facet in on.iter().map(|&f| &facets.sheet_facets[f as usize]) {
                    let q = counter_clockwise(facet.corners.map(to_plan));
                    let over = shared_area(q, &polygon);
                    if over > 0.0 {
                        sheet = sheet.or(Some(facet.owner));
                    }
                    if facet.matter == Matter::Opaque {
                        fronts[usize::from(facet.front)] += over;
                        triangles.push(q);
                    }
                }
                let a = columns.first_piece[t] + columns.slices[t].len() as u32 - 2;
                let surface = Surface::Cut(sheet.map_or(floor.cut, Cut::Sheet));
                let open = open_part(&polygon, &triangles, *seal);
                out.push(Face::new([a, columns.first_piece[n]], surface, true, polygon, whole, open, fronts));
            }
            out
        };
        parallel::flat_map_range(plan.bands[low].clone(), of_column)
    }

    /// The face between the pieces below and above each cut of column `t`.
    fn cuts(&self, t: usize, out: &mut Vec<Face>) {
        let Self { plan, columns, facets, seal, .. } = self;
        let polygon: Vec<DVec2> = plan.triangles[t].iter().map(|&i| plan.points[i as usize]).collect();
        let whole = area(&polygon);
        let slices = &columns.slices[t];
        for (k, slice) in slices.iter().enumerate().skip(1).take(slices.len().saturating_sub(2)) {
            let mut fronts = [0.0; 2];
            let mut triangles = Vec::new();
            for facet in
                slice.facets.iter().map(|&f| &facets.sheet_facets[f as usize]).filter(|f| f.matter == Matter::Opaque)
            {
                let q = counter_clockwise(facet.corners.map(to_plan));
                fronts[usize::from(facet.front)] += shared_area(q, &polygon);
                triangles.push(q);
            }
            let a = columns.first_piece[t] + k as u32 - 1;
            let open = open_part(&polygon, &triangles, *seal);
            out.push(Face::new([a, a + 1], Surface::Cut(slice.cut), true, polygon.clone(), whole, open, fronts));
        }
    }

    /// The faces between the pieces of two columns, `t` and `n`, that share edge `e` of the first.
    fn sides(&self, t: usize, e: usize, n: usize, out: &mut Vec<Face>) {
        let Self { plan, columns, facets, .. } = self;
        let (ia, ib) = (plan.triangles[t][e], plan.triangles[t][(e + 1) % 3]);
        let (pa, pb) = (plan.points[ia as usize], plan.points[ib as usize]);
        let corner = |c: usize, i: u32| (0..3).find(|&k| plan.triangles[c][k] == i).unwrap_or(0);
        let (ta, tb, na, nb) = (corner(t, ia), corner(t, ib), corner(n, ia), corner(n, ib));
        let tolerance = self.coplanar * ON_LINE;
        let walls = if plan.constrained[t][e] { self.grid.along(pa, pb, facets, tolerance) } else { Vec::new() };
        let (ua, ub, surface) = match walls.first().map(|&(w, _)| (w, &facets.walls[w as usize])) {
            Some((w, wall)) => (wall.along().dot(pa), wall.along().dot(pb), Surface::Wall(w)),
            None => (0.0, pa.distance(pb), Surface::Edge { triangle: t as u32, edge: e as u32 }),
        };
        let line = Line { ends: [pa, pb], at: [ua, ub], walls: &walls };
        let (lower, upper) = (&columns.slices[t], &columns.slices[n]);
        let ends = |slice: &Slice, a: usize, b: usize| [slice.heights[a], slice.heights[b]];
        let apart = |floor: [f64; 2], ceiling: [f64; 2]| floor[0] >= ceiling[0] && floor[1] >= ceiling[1];
        for i in 0..lower.len() - 1 {
            let (floor_t, ceiling_t) = (ends(&lower[i], ta, tb), ends(&lower[i + 1], ta, tb));
            for j in 0..upper.len() - 1 {
                let (floor_n, ceiling_n) = (ends(&upper[j], na, nb), ends(&upper[j + 1], na, nb));
                if apart(floor_t, ceiling_n) || apart(floor_n, ceiling_t) {
                    continue;
                }
                let polygon = between(ua, ub, &[floor_t, floor_n], &[ceiling_t, ceiling_n]);
                let pieces = [columns.first_piece[t] + i as u32, columns.first_piece[n] + j as u32];
                out.extend(self.side(&line, pieces, surface, polygon));
            }
        }
    }

    /// The face between two pieces on an edge of the plan; `None` without area.
    fn side(&self, line: &Line<'_>, pieces: [u32; 2], surface: Surface, polygon: Vec<DVec2>) -> Option<Face> {
        let (facets, seal) = (self.facets, self.seal);
        let ([pa, pb], [ua, ub]) = (line.ends, line.at);
        let whole = area(&polygon);
        if polygon.len() < 3 || whole <= 0.0 {
            return None;
        }
        let first = line.walls.first().map(|&(w, _)| &facets.walls[w as usize]);
        let mut triangles = Vec::new();
        let (mut fronts, mut leaves) = ([0.0; 2], 0.0);
        let (lo, hi) = polygon.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |a, p| (a.0.min(*p), a.1.max(*p)));
        let thin = SNAPPED * self.coplanar;
        let is_upright = hi.x - lo.x <= thin && hi.y - lo.y > thin;
        let is_thin = !is_upright && width(&polygon) <= thin;
        for (w, list) in line.walls {
            let wall = &facets.walls[*w as usize];
            // Another wall on the same line may have the opposite direction.
            let sign = first.map_or(1.0, |f| f.along().dot(wall.along()).signum());
            let shift = ua - sign * wall.along().dot(pa);
            // Left of a -> b is the first piece; the wall's normal is left of its `along`.
            let normal_into_first = (pb - pa).dot(wall.along()) > 0.0;
            for facet in list.iter().map(|&f| &facets.wall_facets[f as usize]) {
                let q = facet.corners.map(|p| DVec2::new(sign * wall.along().dot(to_plan(p)) + shift, p.y));
                let (a, b) = (q[0].min(q[1]).min(q[2]) - seal, q[0].max(q[1]).max(q[2]) + seal);
                if a.cmple(hi).all() && lo.cmple(b).all() {
                    let q = counter_clockwise(q);
                    let shared = shared_area(q, &polygon);
                    if facet.matter == Matter::Leaf {
                        leaves += shared;
                    } else {
                        fronts[usize::from(facet.front != normal_into_first)] += shared;
                        triangles.push(q);
                    }
                }
            }
        }
        let open = open_part(&polygon, &triangles, seal);
        Some(Face { leaves, is_thin, ..Face::new(pieces, surface, ua <= ub, polygon, whole, open, fronts) })
    }
}

impl Face {
    fn new(
        [a, b]: [u32; 2],
        surface: Surface,
        a_is_left: bool,
        polygon: Vec<DVec2>,
        area: f64,
        open: Open,
        fronts: [f64; 2],
    ) -> Self {
        let open_area = match &open {
            Open::Whole => area,
            Open::Parts(parts) => parts.iter().map(shape_area).sum(),
        };
        Self { a, b, surface, polygon, open, open_area, area, a_is_left, fronts, leaves: 0.0, is_thin: false }
    }
}

/// The polygon over `ua..ub` above both floors and below both ceilings, counter-clockwise.
fn between(ua: f64, ub: f64, floors: &[[f64; 2]], ceilings: &[[f64; 2]]) -> Vec<DVec2> {
    let (lo, hi) = (
        floors.iter().flatten().fold(f64::INFINITY, |a, &b| a.min(b)),
        ceilings.iter().flatten().fold(f64::NEG_INFINITY, |a, &b| a.max(b)),
    );
    let mut polygon = vec![DVec2::new(0.0, lo), DVec2::new(1.0, lo), DVec2::new(1.0, hi), DVec2::new(0.0, hi)];
    let mut cut = |line: &[f64; 2], above: bool| {
        let side = |p: &DVec2| {
            let d = p.y - (line[0] + (line[1] - line[0]) * p.x);
            if above { d } else { -d }
        };
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, p) in polygon.iter().enumerate() {
            let q = &polygon[(i + 1) % polygon.len()];
            let (dp, dq) = (side(p), side(q));
            if dp >= 0.0 {
                kept.push(*p);
            }
            if (dp > 0.0 && dq < 0.0) || (dp < 0.0 && dq > 0.0) {
                kept.push(*p + (*q - *p) * (dp / (dp - dq)));
            }
        }
        polygon = kept;
    };
    floors.iter().for_each(|f| cut(f, true));
    ceilings.iter().for_each(|c| cut(c, false));
    let mut polygon: Vec<DVec2> = polygon.iter().map(|p| DVec2::new(ua + (ub - ua) * p.x, p.y)).collect();
    if ub < ua {
        polygon.reverse();
    }
    polygon
}

/// Grid index of wall triangles in plan.
struct WallGrid {
    cell: f64,
    buckets: HashMap<(i64, i64), Vec<u32>>,
}

impl WallGrid {
    /// A grid of the given wall triangles.
    fn new(facets: &Facets, some: &[u32]) -> Self {
        let spans = some.iter().map(|&f| {
            let q = facets.wall_facets[f as usize].corners.map(to_plan);
            (q[0].min(q[1]).min(q[2]), q[0].max(q[1]).max(q[2]))
        });
        let spans: Vec<_> = spans.collect();
        let mean = spans.iter().map(|(a, b)| a.distance(*b)).sum::<f64>() / spans.len().max(1) as f64;
        let mut grid = Self { cell: mean.max(1e-6), buckets: HashMap::new() };
        for &i in some {
            let f = &facets.wall_facets[i as usize];
            let wall = &facets.walls[f.owner as usize];
            let u = f.corners.map(|p| wall.along().dot(to_plan(p)));
            let (u0, u1) = (u[0].min(u[1]).min(u[2]), u[0].max(u[1]).max(u[2]));
            for c in grid.cells(wall.at(u0), wall.at(u1)) {
                grid.buckets.entry(c).or_default().push(i);
            }
        }
        grid
    }

    /// The grid cells along a segment, and their neighbours.
    fn cells(&self, a: DVec2, b: DVec2) -> Vec<(i64, i64)> {
        let steps = (a.distance(b) / self.cell).ceil().max(1.0) as usize;
        let mut out: Vec<(i64, i64)> = Vec::new();
        for s in 0..=steps {
            let p = (a.lerp(b, s as f64 / steps as f64) / self.cell).floor();
            for i in -1..=1 {
                for j in -1..=1 {
                    out.push((p.x as i64 + i, p.y as i64 + j));
                }
            }
        }
        out.sort_unstable();
        out.dedup();
        out
    }

    /// The walls whose line contains both ends of an edge, with nearby triangles of walls and door leaves; ordered by wall.
    fn along(&self, a: DVec2, b: DVec2, facets: &Facets, tolerance: f64) -> Vec<(u32, Vec<u32>)> {
        if self.buckets.is_empty() {
            return Vec::new();
        }
        let on = |w: &Wall, p: DVec2| (w.normal.dot(p) - w.offset).abs() <= tolerance;
        let mut found: Vec<u32> = self.cells(a, b).iter().filter_map(|c| self.buckets.get(c)).flatten().copied().collect();
        found.sort_unstable();
        found.dedup();
        let mut out: Vec<(u32, Vec<u32>)> = Vec::new();
        for f in found {
            let facet = &facets.wall_facets[f as usize];
            let wall = &facets.walls[facet.owner as usize];
            if !on(wall, a) || !on(wall, b) {
                continue;
            }
            // A very short edge also lies on perpendicular lines; those close nothing.
            if (b - a).dot(wall.along()).abs() < 0.5 * a.distance(b) {
                continue;
            }
            let place = out.binary_search_by_key(&facet.owner, |&(w, _)| w);
            let place = place.unwrap_or_else(|at| {
                out.insert(at, (facet.owner, Vec::new()));
                at
            });
            if facet.matter != Matter::Drawing {
                out[place].1.push(f);
            }
        }
        out
    }
}
