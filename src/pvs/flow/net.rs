//! A cell graph laid out for flow: directed portals in an array, grouped by cell.

use super::bundle::{Bounds, Side};
use super::might_see::set;
use super::window::{Slack, Window};
use crate::cells::{CellGraph, Portal};
use crate::math::geom::{Aabb, Plane};
use crate::math::simd::{Vectorize, vectorized};
use glam::DVec3;
use std::ops::Range;

/// A window is flat if its corners are within this many coplanar tolerances of its plane.
const FLAT: f64 = 4.0;

/// Tolerance of a unit normal's squared length.
const UNIT: f64 = 1e-9;

/// Largest coordinate: squares beyond it are not exact enough to compare.
const FARTHEST: f64 = 1e100;

/// Two unit normals are opposite if their dot product is below this (an angle of about 0.08 degrees).
const OPPOSITE: f64 = -1.0 + 1e-6;

/// A portal as input of [`Net::new`].
#[derive(Clone, Copy)]
pub struct NetPortal<'a> {
    /// The cells behind and in front of the plane.
    pub cells: [u32; 2],
    /// Normal from `cells[0]` into `cells[1]`.
    pub plane: Plane,
    /// Corners, counter-clockwise seen from the tip of the normal.
    pub winding: &'a [DVec3],
}

impl<'a> From<&'a Portal> for NetPortal<'a> {
    fn from(portal: &'a Portal) -> Self {
        Self { cells: portal.cells.map(|c| c.0), plane: portal.plane, winding: &portal.winding }
    }
}

/// Portals in one group of outlines.
const LANES: usize = 4;

/// Planes of directed portals and spheres around their windows, one after the other for each number: x, y and z of the normal, distance
/// from the origin, x, y and z of a point of the window, radius. Unknown values are NaN, so that comparisons are false. Padded to whole
/// groups from any portal on.
#[derive(Default)]
struct Outlines([Vec<f64>; 8]);

impl Outlines {
    fn push(&mut self, plane: Plane, middle: DVec3, radius: f64) {
        let values = [plane.n.x, plane.n.y, plane.n.z, plane.d, middle.x, middle.y, middle.z, radius];
        self.0.iter_mut().zip(values).for_each(|(all, value)| all.push(value));
    }

    /// Those of four portals, from one on.
    #[inline(always)]
    fn group(&self, first: usize) -> [[f64; LANES]; 8] {
        let mut group = [[f64::NAN; LANES]; 8];
        for (to, from) in group.iter_mut().zip(&self.0) {
            if let Some(from) = from.get(first..first + LANES) {
                to.copy_from_slice(from);
            }
        }
        group
    }
}

/// The plane test of one portal against those that lead out of a cell.
struct Follow<'n, 'r> {
    net: &'n Net,
    first: usize,
    cell: usize,
    row: &'r mut [u64],
}

impl Vectorize for Follow<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        let Self { net, first, cell, row } = self;
        let from = net.outlines.group(first).map(|values| values[0]);
        let strict = net.slack.strict;
        let out = net.out(cell);
        for start in out.clone().step_by(LANES) {
            let to = net.outlines.group(start);
            let (mut yes, mut no) = ([false; LANES], [false; LANES]);
            for k in 0..LANES {
                let ahead = from[0] * to[4][k] + from[1] * to[5][k] + from[2] * to[6][k] - from[3];
                let behind = to[3][k] - (to[0][k] * from[4] + to[1][k] * from[5] + to[2][k] * from[6]);
                let along = from[0] * to[0][k] + from[1] * to[1][k] + from[2] * to[2][k];
                yes[k] = (ahead > strict) & (behind > strict) & (along >= OPPOSITE);
                no[k] = (ahead + to[7][k] <= strict) | (behind + from[7] <= strict);
            }
            for k in 0..LANES.min(out.end - start) {
                let p = start + k;
                if p != first && p != net.twin[first] as usize && (yes[k] || net.follows(first, p, no[k])) {
                    set(row, p);
                }
            }
        }
    }
}

/// Directed portals, numbered in the order of the cells that they lead out of. Coordinates are relative to [`Net::origin`],
/// the middle of all windings, so that rounding follows the size of the graph and not its distance from zero.
pub struct Net {
    /// Subtracted from every position.
    pub origin: DVec3,
    /// Tolerances.
    pub slack: Slack,
    /// Rounding error of a distance between two corners, metres.
    pub rounding: f64,
    /// Largest rounding error of a corner in `f32`, the precision of models and files, metres. An object that reaches beyond a plane by
    /// less only touches it. Larger: true slivers of objects are lost. Smaller: rounding makes storeys visible from under their floor.
    pub single: f64,
    /// Number of cells.
    pub cells: usize,
    /// The plane of each directed portal, normal in its direction; `None` if the winding is not in the given plane or is no polygon. Such
    /// portals hide nothing by themselves.
    planes: Vec<Option<Plane>>,
    /// The whole window of each; without corners if they are unusable.
    windows: Vec<Window>,
    /// Box around each winding.
    bounds: Vec<Bounds>,
    /// The data used most often, contiguous in memory.
    outlines: Outlines,
    /// Source cell of each.
    pub source: Vec<u32>,
    /// Target cell of each.
    pub target: Vec<u32>,
    /// The same portal in the opposite direction.
    pub twin: Vec<u32>,
    /// `2 * portal + side` of each.
    pub ids: Vec<u32>,
    /// For each portal, those that a line can cross at the same point, ascending; usually none. See [`Net::find_flush`].
    flush: Vec<Vec<u32>>,
    /// Start of each cell's portals.
    first_out: Vec<u32>,
    /// Portals that may follow each directly, as words of a row of bits, and the start of each list.
    next: Vec<(u32, u64)>,
    first_next: Vec<u32>,
}

impl Net {
    /// Lays out the portals of `graph`. `coplanar`: tolerance of corners from their plane, metres.
    pub fn of_graph(graph: &CellGraph, coplanar: f64) -> Self {
        let portals: Vec<NetPortal<'_>> = graph.portals.iter().map(NetPortal::from).collect();
        Self::new(graph.cells.len(), &portals, coplanar)
    }

    /// Lays out `portals` between `cells` cells; all cell numbers must be valid.
    pub fn new(cells: usize, portals: &[NetPortal<'_>], coplanar: f64) -> Self {
        let usable = |p: &DVec3| p.abs().max_element() < FARTHEST;
        let bounds = Aabb::of(portals.iter().flat_map(|p| p.winding).copied().filter(usable));
        let origin = if bounds.is_empty() { DVec3::ZERO } else { bounds.centre() };
        let far = bounds.min.abs().max(bounds.max.abs()).max_element();
        let far = if far.is_finite() { far } else { 0.0 };
        // Rounding: of the input (its distance from zero) and of cuts (the graph's size).
        let ulp = f64::EPSILON * (far + bounds.diagonal());
        let coplanar = if coplanar.is_finite() { coplanar.max(0.0) } else { 0.0 };
        let slack = Slack { reach: 16.0 * ulp, strict: 64.0 * ulp, coplanar: coplanar.max(256.0 * ulp) };

        let mut order: Vec<(u32, u32)> = (0..2 * portals.len()).map(|d| (portals[d / 2].cells[d % 2], d as u32)).collect();
        order.sort_unstable();
        let mut place = vec![0u32; order.len()];
        for (i, &(_, d)) in order.iter().enumerate() {
            place[d as usize] = i as u32;
        }
        let mut net = Self {
            origin,
            slack,
            rounding: 16.0 * f64::EPSILON * bounds.diagonal(),
            single: (f64::from(f32::EPSILON) * far).max(slack.strict),
            cells,
            planes: Vec::with_capacity(order.len()),
            windows: Vec::with_capacity(order.len()),
            bounds: Vec::with_capacity(order.len()),
            outlines: Outlines::default(),
            source: order.iter().map(|&(c, _)| c).collect(),
            target: order.iter().map(|&(_, d)| portals[d as usize / 2].cells[1 - d as usize % 2]).collect(),
            flush: Vec::new(),
            twin: order.iter().map(|&(_, d)| place[d as usize ^ 1]).collect(),
            ids: order.iter().map(|&(_, d)| d).collect(),
            first_out: (0..=cells as u32).map(|c| order.partition_point(|&(s, _)| s < c) as u32).collect(),
            next: Vec::new(),
            first_next: vec![0],
        };
        for &(_, d) in &order {
            let portal = &portals[d as usize / 2];
            let plane = Plane { n: portal.plane.n, d: portal.plane.d - portal.plane.n.dot(origin) };
            net.push(portal.winding, plane, d % 2 == 1);
        }
        for _ in 0..LANES {
            net.outlines.push(Plane { n: DVec3::NAN, d: f64::NAN }, DVec3::NAN, f64::NAN);
        }
        net.flush = net.find_flush();
        for p in 0..net.portals() {
            let start = net.next.len();
            for q in net.out(net.target[p] as usize) {
                if net.may_follow(p, q) {
                    let word = q as u32 / 64;
                    if net.next[start..].last().is_none_or(|&(last, _)| last != word) {
                        net.next.push((word, 0));
                    }
                    net.next.last_mut().into_iter().for_each(|(_, mask)| *mask |= 1 << (q % 64));
                }
            }
            net.first_next.push(net.next.len() as u32);
        }
        net
    }

    /// Appends the winding and the plane of the next directed portal, against the plane if `back` is set.
    fn push(&mut self, winding: &[DVec3], plane: Plane, back: bool) {
        let mut corners = Vec::new();
        if winding.iter().all(|p| p.abs().max_element() < FARTHEST) {
            corners.extend(winding.iter().map(|&p| p - self.origin));
        }
        let off = corners.iter().map(|&p| plane.distance(p).abs()).fold(0.0, f64::max);
        let wide = crate::math::geom::area(&corners) > self.slack.strict * self.slack.strict;
        let flat = wide && (plane.n.length_squared() - 1.0).abs() < UNIT && off <= FLAT * self.slack.coplanar;
        if flat {
            // Corners are projected onto the plane.
            for p in corners.iter_mut() {
                *p -= plane.n * plane.distance(*p);
            }
        }
        let plane = if back { plane.flipped() } else { plane };
        if back {
            corners.reverse();
        }
        let middle = crate::math::geom::middle(&corners);
        let radius = corners.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
        self.planes.push(flat.then_some(plane));
        let nowhere = Plane { n: DVec3::NAN, d: f64::NAN };
        let (known, middle) = if flat { (plane, middle) } else { (nowhere, DVec3::NAN) };
        self.outlines.push(known, middle, radius);
        self.bounds.push(Bounds::new(corners.iter().copied(), flat, &self.slack));
        self.windows.push(Window::new(&corners, plane.n, flat));
    }

    /// Finds successive portals that are coplanar to within rounding, overlap and have the same direction: the cells between them have no
    /// thickness, and a line may cross all of them at one point. So their planes do not constrain each other.
    fn find_flush(&self) -> Vec<Vec<u32>> {
        let near = 4.0 * self.slack.strict;
        let in_plane = |p: Plane, b: usize| self.windows[b].iter().all(|q| p.distance(q).abs() <= near);
        let flush = |a: usize, b: usize| match (self.planes[a], self.planes[b]) {
            (Some(pa), Some(pb)) => pa.n.dot(pb.n) > -OPPOSITE && in_plane(pa, b) && in_plane(pb, a),
            _ => false,
        };
        let boxes: Vec<Aabb> = self.windows.iter().map(|w| Aabb::of(w.iter()).inflated(near)).collect();
        let follow = |a: usize| {
            // Cells without thickness may be stacked: continue while portals are flush.
            let (mut found, mut queue) = (Vec::new(), vec![a]);
            while let Some(last) = queue.pop() {
                for b in self.out(self.target[last] as usize) {
                    if b != a && boxes[a].touches(&boxes[b]) && flush(a, b) && !found.contains(&(b as u32)) {
                        found.push(b as u32);
                        queue.push(b);
                    }
                }
            }
            found.sort_unstable();
            found
        };
        (0..self.portals()).map(follow).collect()
    }

    /// The plane of `a` flipped, if it constrains lines that go on through `b`.
    #[inline]
    pub fn front(&self, a: usize, b: usize) -> Option<Plane> {
        self.planes[a].filter(|_| !self.is_flush(a, b)).map(|p| p.flipped())
    }

    /// The plane of `b`, if it constrains lines that come from `a`.
    #[inline]
    pub fn behind(&self, a: usize, b: usize) -> Option<Plane> {
        self.planes[b].filter(|_| !self.is_flush(a, b))
    }

    #[inline]
    fn is_flush(&self, a: usize, b: usize) -> bool {
        !self.flush[a].is_empty() && self.flush[a].binary_search(&(b as u32)).is_ok()
    }

    /// Number of directed portals.
    pub fn portals(&self) -> usize {
        self.source.len()
    }

    /// The plane of a directed portal, if it has one; its direction is outside.
    #[inline]
    pub fn plane(&self, portal: usize) -> Option<Plane> {
        self.planes[portal]
    }

    /// The whole window of a portal.
    #[inline]
    pub fn window(&self, portal: usize) -> &Window {
        &self.windows[portal]
    }

    /// The directed portals that lead out of a cell.
    #[inline]
    pub fn out(&self, cell: usize) -> Range<usize> {
        self.first_out[cell] as usize..self.first_out[cell + 1] as usize
    }

    /// The portals that may follow a portal directly, by their planes: words of a row of bits.
    #[inline]
    pub fn next(&self, portal: usize) -> &[(u32, u64)] {
        &self.next[self.first_next[portal] as usize..self.first_next[portal + 1] as usize]
    }

    /// The box around a portal's whole window.
    #[inline]
    pub fn bounds(&self, portal: usize) -> &Bounds {
        &self.bounds[portal]
    }

    /// False if the planes prove that no line crosses directed portal `a` and later directed portal `b`.
    pub fn may_follow(&self, a: usize, b: usize) -> bool {
        if a == b || a == self.twin[b] as usize {
            return false;
        }
        let (from, to) = (self.outlines.group(a).map(|v| v[0]), self.outlines.group(b).map(|v| v[0]));
        let strict = self.slack.strict;
        let ahead = from[0] * to[4] + from[1] * to[5] + from[2] * to[6] - from[3];
        let behind = to[3] - (to[0] * from[4] + to[1] * from[5] + to[2] * from[6]);
        let along = from[0] * to[0] + from[1] * to[1] + from[2] * to[2];
        ahead > strict && behind > strict && along >= OPPOSITE
            || self.follows(a, b, ahead + to[7] <= strict || behind + from[7] <= strict)
    }

    /// Sets the portals out of `cell` that [may follow](Self::may_follow) `first`.
    pub fn all_that_follow(&self, first: usize, cell: usize, row: &mut [u64]) {
        vectorized(Follow { net: self, first, cell, row });
    }

    /// As [`Net::may_follow`], for portals whose spheres do not decide, or, if `apart`, are on the wrong side of the other's plane.
    fn follows(&self, a: usize, b: usize, apart: bool) -> bool {
        if apart {
            return self.is_flush(a, b);
        }
        let (pa, pb) = (self.planes[a], self.planes[b]);
        let is_cut_off = |portal: usize, plane: Plane| match self.bounds[portal].side(&plane) {
            Side::Inside => false,
            Side::Outside => true,
            Side::Unknown => self.windows[portal].is_cut_off(&plane, &self.slack),
        };
        if pa.is_some_and(|p| is_cut_off(b, p.flipped())) || pb.is_some_and(|p| is_cut_off(a, p)) {
            return self.is_flush(a, b);
        }
        // Two windows of one wall: no line leaves through one and enters through the other, whatever the rounding.
        let in_one_wall = |pa: Plane, pb: Plane| {
            pa.n.dot(pb.n) < OPPOSITE
                && self.windows[b].iter().all(|p| pa.distance(p) <= self.slack.coplanar)
                && self.windows[a].iter().all(|p| pb.distance(p) >= -self.slack.coplanar)
        };
        !matches!((pa, pb), (Some(pa), Some(pb)) if in_one_wall(pa, pb))
    }
}
