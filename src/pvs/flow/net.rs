//! A cell graph laid out for flow: directed portals in an array, grouped by cell.

use super::bundle::{Bounds, Side};
use super::window::{Slack, Window};
use crate::cells::{CellGraph, Portal};
use crate::math::geom::{Aabb, Plane};
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

/// The plane of a directed portal and a sphere around its window. Unknown values are NaN, so that comparisons are false.
#[derive(Clone, Copy)]
struct Outline {
    plane: Plane,
    /// A point of the window.
    middle: DVec3,
    radius: f64,
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
    outlines: Vec<Outline>,
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
            outlines: Vec::with_capacity(order.len()),
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
        self.outlines.push(Outline { plane: known, middle, radius });
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
        let (from, to) = (&self.outlines[a], &self.outlines[b]);
        let (ahead, behind) = (from.plane.distance(to.middle), -to.plane.distance(from.middle));
        let strict = self.slack.strict;
        if ahead > strict && behind > strict && from.plane.n.dot(to.plane.n) >= OPPOSITE {
            return true;
        }
        if ahead + to.radius <= strict || behind + from.radius <= strict {
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
