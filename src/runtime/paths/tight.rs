//! The shortest line through a sequence of convex polygons, and a proof of how short any such line must be.
//!
//! The length `sum |p[i + 1] - p[i]|`, each `p[i]` in its polygon, is convex. It falls, one point at a time, to the best place between its
//! neighbours: where the straight line between them, unfolded about the polygon's plane or an edge, goes through. What is left is judged by the
//! dual: for any vectors `u[i]` of length 1 at most, `sum u[i] . (p[i + 1] - p[i])` is no longer than the line, and its least value over all
//! points of the polygons is that at corners, one polygon at a time. With `u` along the best line both are the same.
//!
//! Points that move together, as along the posts of doors on a climb, move slowly one at a time: Newton's method moves them all, each within
//! its portal or along the edge where it is. Both get stuck where portals touch. There a barrier method goes on ([`super::barrier`]).

use super::blocks::{Blocks, derivatives, mixed};
use super::facets::{Edge, Facets};
use glam::{DMat2, DVec2, DVec3};

/// Points nearer to each other than this are one, metres. Larger: proofs are weaker. Smaller: directions of rounding errors.
const SAME: f64 = 1e-9;
/// Rounds that change the length by less than this share are the last. Larger: longer lines are told. Smaller: more rounds.
const SETTLED: f64 = 1e-9;

/// A line through portals.
#[derive(Clone, Debug, Default)]
pub(super) struct Line {
    /// The portals.
    pub portals: Vec<u32>,
    /// The start, a point in each portal, and the end.
    pub points: Vec<DVec3>,
    /// By point: what it is on.
    places: Vec<Place>,
    blocks: Blocks,
    /// By segment: directions of a proof.
    directions: Vec<DVec3>,
}

/// Where a point of a line is in its portal.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Place {
    Inside,
    /// On the edge with this number.
    Edge(usize),
    /// At a corner, or in the plane of both neighbours.
    Fixed,
}

/// What a line through portals is at least.
#[derive(Clone, Copy, Debug)]
pub(super) struct Proof {
    /// Any line through all portals, metres.
    pub metres: f64,
    /// Any line up to a point `p` of the last portal is at least `constant + along . (p - start)`, metres.
    pub constant: f64,
    pub along: DVec3,
}

impl Proof {
    /// Of nothing.
    pub const NONE: Self = Self { metres: f64::NEG_INFINITY, constant: f64::NEG_INFINITY, along: DVec3::ZERO };

    /// The one that proves more.
    pub fn or(self, other: Self) -> Self {
        if other.metres > self.metres { other } else { self }
    }
}

impl Line {
    /// Its length, metres.
    pub fn metres(&self) -> f64 {
        self.points.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
    }

    /// Pulls it tight, in so many rounds at most.
    pub fn pull(&mut self, facets: &Facets, rounds: usize) {
        let last = self.points.len() - 1;
        self.places.clear();
        self.places.resize(last + 1, Place::Fixed);
        let mut before = f64::INFINITY;
        for round in 0..rounds {
            for step in 1..last {
                // Backwards and forwards by turns: the last portal is new.
                let i = if round.is_multiple_of(2) { last - step } else { step };
                let portal = self.portals[i - 1] as usize;
                (self.points[i], self.places[i]) = best(facets, portal, self.points[i - 1], self.points[i + 1]);
            }
            self.straighten(facets);
            let metres = self.metres();
            if before - metres <= SETTLED * metres {
                break;
            }
            before = metres;
        }
    }

    /// Where the line is free in several portals in a row, it is straight, if that fits.
    fn straighten(&mut self, facets: &Facets) {
        let last = self.points.len() - 1;
        let mut start = 0;
        while start < last {
            let end = (start + 1..=last).find(|&i| i == last || self.places[i] != Place::Inside).unwrap_or(last);
            let (a, b) = (self.points[start], self.points[end]);
            let crossing = |i: usize| crossing(facets, self.portals[i - 1] as usize, a, b);
            if end - start > 2 && (start + 1..end).all(|i| crossing(i).is_some()) {
                for i in start + 1..end {
                    self.points[i] = crossing(i).unwrap_or(self.points[i]);
                }
            }
            start = end;
        }
    }

    /// A step of Newton's method, after a pull: each point within its portal, or along its edge. Goes as far as all stay there.
    pub fn step(&mut self, facets: &Facets) {
        let Self { portals, points, places, blocks, .. } = self;
        let last = points.len() - 1;
        let axes = |i: usize| axes(facets, portals[i - 1], places[i]);
        let segment = |from: usize, to: usize| {
            let length = points[from].distance(points[to]).max(SAME);
            ((points[to] - points[from]) / length, length)
        };
        blocks.clear();
        for i in 1..last {
            let of_point = axes(i);
            // What can't move has a step of 0.
            let mut hessian = DMat2::from_diagonal(of_point.map(|axis| f64::from(u8::from(axis == DVec3::ZERO))).into());
            let mut down = DVec2::ZERO;
            for other in [i - 1, i + 1] {
                let (along, length) = segment(other, i);
                let (second, first) = derivatives(along, length, of_point);
                hessian += second;
                down += first;
            }
            let (along, length) = segment(i, i + 1);
            let beside = if i + 1 < last { mixed(along, length, of_point, axes(i + 1)) } else { DMat2::ZERO };
            blocks.push(hessian, beside, down);
        }
        blocks.solve();
        let step = |i: usize| axes(i)[0] * blocks.steps[i - 1].x + axes(i)[1] * blocks.steps[i - 1].y;
        let room = |i: usize| {
            let shares = facets.edges(portals[i - 1] as usize).iter().map(|edge| {
                let (inside, nears) = (edge.inwards.dot(points[i] - edge.start).max(0.0), -edge.inwards.dot(step(i)));
                if nears > SAME { inside / nears } else { f64::INFINITY }
            });
            shares.fold(1.0, f64::min)
        };
        let share = (1..last).map(room).fold(1.0, f64::min);
        (1..last).for_each(|i| points[i] += step(i) * share);
    }

    /// What any line through these portals is at least.
    pub fn proof(&mut self, facets: &Facets) -> Proof {
        let unit = |pair: &[DVec3]| {
            let step = pair[1] - pair[0];
            let length = step.length();
            if length > SAME { step / length } else { DVec3::ZERO }
        };
        self.directions.clear();
        self.directions.extend(self.points.windows(2).map(unit));
        // Between points that are one, any direction will do: one between its neighbours.
        for i in 0..self.directions.len() {
            if self.directions[i] == DVec3::ZERO {
                let before = i.checked_sub(1).map_or(DVec3::ZERO, |before| self.directions[before]);
                let after = self.directions[i..].iter().copied().find(|u| *u != DVec3::ZERO).unwrap_or(before);
                self.directions[i] = if i == 0 { after } else { (before + after) * 0.5 };
            }
        }
        prove(facets, &self.portals, [self.points[0], self.points[self.points.len() - 1]], &self.directions)
    }
}

/// The proof that some directions give, one for each segment.
pub(super) fn prove(facets: &Facets, portals: &[u32], [start, end]: [DVec3; 2], directions: &[DVec3]) -> Proof {
    let (mut constant, mut before_last) = (0.0, 0.0);
    for (i, &portal) in portals.iter().enumerate() {
        let turn = directions[i] - directions[i + 1];
        before_last = constant;
        let corners = facets.edges(portal as usize).iter();
        constant += corners.map(|edge| turn.dot(edge.start - start)).fold(f64::INFINITY, f64::min);
    }
    let last = directions[directions.len() - 1];
    let along = if portals.is_empty() { last } else { directions[directions.len() - 2] };
    Proof { metres: constant + last.dot(end - start), constant: before_last, along }
}

/// The directions in which a point moves without leaving its place, of length 1; zero where there is none.
fn axes(facets: &Facets, portal: u32, place: Place) -> [DVec3; 2] {
    let edges = facets.edges(portal as usize);
    match place {
        Place::Inside => [edges[0].along, edges[0].inwards],
        Place::Edge(edge) => [edges[edge].along, DVec3::ZERO],
        Place::Fixed => [DVec3::ZERO; 2],
    }
}

/// The point of a portal with the least sum of distances from `a` and `b`, and where it is.
fn best(facets: &Facets, portal: usize, a: DVec3, b: DVec3) -> (DVec3, Place) {
    let (plane, edges) = (facets.plane(portal), facets.edges(portal));
    let (above_a, above_b) = (plane.n.dot(a) - plane.d, plane.n.dot(b) - plane.d);
    let all = above_a.abs() + above_b.abs();
    if all > SAME {
        // The straight line, if need be unfolded about the plane.
        let share = above_a.abs() / all;
        let x = (a - plane.n * above_a).lerp(b - plane.n * above_b, share);
        let mut found: Option<(f64, DVec3, Place)> = None;
        for (k, edge) in edges.iter().enumerate().filter(|(_, edge)| edge.inwards.dot(x - edge.start) < 0.0) {
            let (p, is_end) = on_edge(edge, a, b);
            let metres = a.distance(p) + p.distance(b);
            if found.is_none_or(|(least, ..)| metres < least) {
                found = Some((metres, p, if is_end { Place::Fixed } else { Place::Edge(k) }));
            }
        }
        return found.map_or((x, Place::Inside), |(_, p, place)| (p, place));
    }
    // All in the plane.
    let is_inside = |p: DVec3| edges.iter().all(|edge| edge.inwards.dot(p - edge.start) >= 0.0);
    if let Some(p) = [a, b].into_iter().find(|&p| is_inside(p)) {
        return (p, Place::Fixed);
    }
    let sum = |p: DVec3| a.distance(p) + p.distance(b);
    let on_edges = edges.iter().map(|edge| on_edge(edge, a, b).0);
    (on_edges.min_by(|&p, &q| sum(p).total_cmp(&sum(q))).unwrap_or(a), Place::Fixed)
}

/// The point of an edge with the least sum of distances from `a` and `b`, and whether it is an end.
fn on_edge(edge: &Edge, a: DVec3, b: DVec3) -> (DVec3, bool) {
    let (to_a, to_b) = (a - edge.start, b - edge.start);
    let (along_a, along_b) = (edge.along.dot(to_a), edge.along.dot(to_b));
    let off_a = (to_a - edge.along * along_a).length();
    let off_b = (to_b - edge.along * along_b).length();
    let all = off_a + off_b;
    let at = if all > SAME { (along_a * off_b + along_b * off_a) / all } else { along_a };
    // `clamp` panics with numbers in its text, and what writes them is 20 kB.
    let within = at.max(0.0).min(edge.length);
    (edge.start + edge.along * within, within != at)
}

/// Where a straight line goes through a portal, if it does.
fn crossing(facets: &Facets, portal: usize, a: DVec3, b: DVec3) -> Option<DVec3> {
    let plane = facets.plane(portal);
    let (above_a, above_b) = (plane.n.dot(a) - plane.d, plane.n.dot(b) - plane.d);
    if above_a * above_b >= 0.0 {
        return None;
    }
    let x = a.lerp(b, above_a / (above_a - above_b));
    facets.edges(portal).iter().all(|edge| edge.inwards.dot(x - edge.start) >= 0.0).then_some(x)
}
