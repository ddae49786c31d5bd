//! Holes as lines to look at: the shortest way from inside a closed cell out of the model.
//!
//! Based on: the point file of Quake's level compilers (J. Carmack, qbsp, 1996), which draws a line from an entity to the void;
//! E. W. Dijkstra, *A note on two problems in connexion with graphs*, 1959, over the polygons between convex pieces; and
//! tightening of a line through a sequence of polygons, corner by corner (see [`super::tight`]).
//!
//! A *hole of the model* is an opening between a closed cell and the outside without a door or window: a missing wall, a cracked
//! corner, a missing roof. Openings that touch are one hole. A cell that the author placed in the open air does not count as
//! outside. A *hole of the cells* is a segment that left a cell other than through a portal; the segment is its line.

use super::Example;
use super::cells::Cells;
use super::tight::{closest, polish, tighten};
use super::triangles::Tracer;
use enfilade::file::PvsFile;
use enfilade::math::geom::{Aabb, Plane, clip, middle};
use enfilade::scene::Scene;
use enfilade::{CellId, PortalId};
use glam::DVec3;
use serde::Serialize;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Planes whose normals have a cosine of at least this (2.6 degrees) count as one.
const SAME_PLANE: f64 = 0.999;

/// Maximum drawn lines; further holes are only counted.
pub const MOST_LEAKS: usize = 64;

/// Kind of a leak.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LeakKind {
    /// An unobstructed segment left a cell other than through a portal.
    Segment,
    /// A closed cell is open to the outside through an opening without door or window.
    Opening,
    /// A room of the author lies outside: nothing closes it.
    Room,
}

/// A hole, and the shortest line found through it.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Leak {
    /// Its kind.
    pub kind: LeakKind,
    /// Length of the line, metres.
    pub length: f64,
    /// The cell that it starts in.
    pub from_cell: CellId,
    /// The portals of the hole.
    pub portals: Vec<PortalId>,
    /// From inside to beyond the model (for a segment: to where it left), in the model's own coordinates, metres.
    pub points: Vec<DVec3>,
}

/// All holes.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Leaks {
    /// A line for each of the first [`MOST_LEAKS`]: segments first, then by length.
    pub leaks: Vec<Leak>,
    /// Total number of holes.
    pub leak_count: usize,
}

/// Draws a line through every hole. `segments` are the violations found by rays.
pub(super) fn find(file: &PvsFile, scene: &Scene, cells: &Cells, tracer: &Tracer, segments: &[Example]) -> Leaks {
    let search = Search::new(file, scene, cells, tracer);
    let mut found: Vec<Leak> = segments.iter().filter_map(of_segment).collect();
    let holes = search.holes();
    let mut count = found.len() + holes.len();
    let mut opened: Vec<Leak> = holes.into_iter().filter_map(|(cell, portals)| search.through(cell, &portals)).collect();
    for room in scene.hints.rooms.iter().filter(|r| !r.outside) {
        if let Some(leak) = search.of_room(&room.surface) {
            opened.push(leak);
            count += 1;
        }
    }
    opened.sort_by(|a, b| a.length.total_cmp(&b.length).then(a.portals.cmp(&b.portals)));
    for leak in &mut opened {
        leak.points.iter_mut().for_each(|p| *p += scene.origin);
    }
    found.extend(opened);
    found.truncate(MOST_LEAKS);
    Leaks { leaks: found, leak_count: count }
}

fn of_segment(example: &Example) -> Option<Leak> {
    let (from_cell, points) = (example.cells[0]?, vec![example.from, example.at]);
    let length = example.from.distance(example.at);
    Some(Leak { kind: LeakKind::Segment, length, from_cell, portals: Vec::new(), points })
}

/// Maximum detours per neighbouring piece for a gate whose nearest point is behind a wall.
const MOST_ASIDE: usize = 64;

/// Marks the outside of the box around the model.
const OUTSIDE: usize = usize::MAX;

/// The polygon between two pieces, or between a piece and the box around the model.
struct Gate {
    polygon: Vec<DVec3>,
    plane: Plane,
    pieces: [usize; 2],
}

struct Search<'s> {
    file: &'s PvsFile,
    cells: &'s Cells,
    tracer: &'s Tracer,
    bounds: Aabb,
    /// Cells that extend beyond the model, and the courts joined to them.
    outside: Vec<bool>,
}

impl<'s> Search<'s> {
    fn new(file: &'s PvsFile, scene: &Scene, cells: &'s Cells, tracer: &'s Tracer) -> Self {
        let bounds = scene.bounds();
        let mut outside = vec![false; file.cells.len()];
        for piece in cells.pieces() {
            let beyond =
                !(bounds.inflated(1.0).contains(piece.bounds.min) && bounds.inflated(1.0).contains(piece.bounds.max));
            outside[piece.cell.index()] |= file.cells[piece.cell.index()].open && beyond;
        }
        // Courts: open, joined to the outside, and not a room of the author.
        let joins = |a: CellId, b: CellId| {
            let court = &file.cells[b.index()];
            (outside[a.index()] && court.open && court.source.is_none()).then_some(b)
        };
        let courts = file.portals.iter().flat_map(|p| [joins(p.cells[0], p.cells[1]), joins(p.cells[1], p.cells[0])]);
        let courts: Vec<CellId> = courts.flatten().collect();
        courts.into_iter().for_each(|court| outside[court.index()] = true);
        Self { file, cells, tracer, bounds, outside }
    }

    /// Openings from a closed cell to the outside, in the order of their first portal; those that touch are one hole.
    fn holes(&self) -> Vec<(CellId, Vec<usize>)> {
        let near = 4.0 * self.cells.tolerance();
        let mut holes: Vec<(CellId, CellId, Vec<usize>, Aabb)> = Vec::new();
        for (i, portal) in self.file.portals.iter().enumerate() {
            let [a, b] = portal.cells;
            let (from, to) = if self.outside[a.index()] { (b, a) } else { (a, b) };
            if portal.state.closable || !self.outside[to.index()] || self.file.cells[from.index()].open {
                continue;
            }
            let (mut members, mut bounds) = (vec![i], Aabb::of(portal.winding.iter().map(|p| p.as_dvec3())));
            // Merges with every hole that it touches.
            while let Some(k) = holes.iter().position(|h| (h.0, h.1) == (from, to) && h.3.gap(&bounds) <= near) {
                let (.., more, around) = holes.swap_remove(k);
                members.extend(more);
                bounds = bounds.union(around);
            }
            members.sort_unstable();
            holes.push((from, to, members, bounds));
        }
        holes.sort_by(|a, b| a.2.cmp(&b.2));
        holes.into_iter().map(|(from, _, members, _)| (from, members)).collect()
    }

    /// The line from the middle of a cell through a hole of it.
    fn through(&self, from: CellId, portals: &[usize]) -> Option<Leak> {
        let &(largest, _) = self.cells.pieces_of(from).iter().max_by(|a, b| {
            let volume = |p: usize| self.cells.pieces()[p].volume();
            volume(a.0).total_cmp(&volume(b.0)).then(b.0.cmp(&a.0))
        })?;
        let start = self.cells.pieces()[largest].middle();
        let line = self.line(start, largest, Some(from), portals)?;
        let portals = portals.iter().map(|&p| PortalId(p as u32)).collect();
        Some(Leak { kind: LeakKind::Opening, length: length(&line), from_cell: from, portals, points: line })
    }

    /// The line out of a room of the author, if its middle is outside.
    fn of_room(&self, surface: &[[DVec3; 3]]) -> Option<Leak> {
        let bounds = Aabb::of(surface.iter().flatten().copied());
        let start = bounds.centre();
        let within = |d: DVec3| surface.iter().filter(|t| super::triangles::crosses(start, d, t)).count() % 2 == 1;
        // Oblique directions, so that no edge is met.
        let inside = within(DVec3::new(0.0123, 1.0, 0.0377)) && within(DVec3::new(1.0, 0.0213, -0.0311));
        let piece = self.cells.piece_at(start)?;
        let cell = self.cells.pieces()[piece].cell;
        if !inside || !self.outside[cell.index()] || self.tracer.in_solid(start) {
            return None;
        }
        let line = self.line(start, piece, None, &[])?;
        Some(Leak { kind: LeakKind::Room, length: length(&line), from_cell: cell, portals: Vec::new(), points: line })
    }

    /// The shortest line from a point in a piece to the box around the model, through pieces of `from`, the hole's portals and
    /// the outside.
    fn line(&self, start: DVec3, piece: usize, from: Option<CellId>, portals: &[usize]) -> Option<Vec<DVec3>> {
        let mut ways = Ways {
            search: self,
            from,
            portals,
            gates: Vec::new(),
            of_piece: BTreeMap::new(),
            entered: BTreeSet::new(),
            settled: BTreeMap::new(),
            open: BinaryHeap::new(),
            candidates: Vec::new(),
        };
        let mut from_point = (start, 0.0, None, vec![piece]);
        loop {
            let (point, cost, before, pieces) = from_point;
            pieces.into_iter().for_each(|piece| ways.leave(piece, point, cost, before));
            let (gate, cost) = ways.settle_nearest()?;
            let (point, _) = ways.settled[&gate];
            if ways.gates[gate].pieces[1] == OUTSIDE {
                return Some(self.pulled(start, gate, &ways.gates, &ways.settled));
            }
            from_point = (point, cost, Some(gate), ways.gates[gate].pieces.to_vec());
        }
    }

    /// The path back from the last gate, tightened as far as it stays unobstructed.
    fn pulled(
        &self,
        start: DVec3,
        last: usize,
        gates: &[Gate],
        settled: &BTreeMap<usize, (DVec3, Option<usize>)>,
    ) -> Vec<DVec3> {
        let (mut points, mut through): (Vec<DVec3>, Vec<(&[DVec3], Plane)>) = (Vec::new(), Vec::new());
        let mut at = Some(last);
        while let Some(gate) = at {
            let (point, before) = settled[&gate];
            points.push(point);
            through.push((gates[gate].polygon.as_slice(), gates[gate].plane));
            at = before;
        }
        points.push(start);
        points.reverse();
        through.reverse();
        let is_open = |a: DVec3, b: DVec3| self.tracer.is_open(a, b);
        let mut tight = points.clone();
        tighten(&mut tight, &through);
        let line = if tight.windows(2).all(|w| is_open(w[0], w[1])) {
            tight
        } else {
            polish(&mut points, &through, &is_open);
            points
        };
        // Drops corners that a straight unobstructed line can skip.
        let mut out = vec![line[0]];
        let mut i = 0;
        while i + 1 < line.len() {
            let j = (i + 1..line.len()).rev().find(|&j| j == i + 1 || is_open(line[i], line[j])).unwrap_or(i + 1);
            out.push(line[j]);
            i = j;
        }
        out
    }

    /// Lower bound of the distance from a point to the box around the model.
    fn to_rim(&self, p: DVec3) -> f64 {
        (p - self.bounds.min).min(self.bounds.max - p).min_element().max(0.0)
    }

    /// The gates of a piece: to pieces of its cell, to the hole and to the box around the model.
    fn gates(&self, piece: usize, from: Option<CellId>, portals: &[usize]) -> Vec<Gate> {
        let tolerance = self.cells.tolerance();
        let all = self.cells.pieces();
        let own = &all[piece];
        let mut out = Vec::new();
        if self.outside[own.cell.index()] {
            for axis in 0..3 {
                for n in [DVec3::AXES[axis], -DVec3::AXES[axis]] {
                    let plane = Plane::through(if n[axis] > 0.0 { self.bounds.max } else { self.bounds.min }, n);
                    let polygon = own.planes.iter().fold(face(&self.bounds, &plane), |w, p| clip(&w, p, 0.0));
                    out.extend(shrunk(polygon, &plane, tolerance).map(|polygon| Gate {
                        polygon,
                        plane,
                        pieces: [piece, OUTSIDE],
                    }));
                }
            }
        }
        for other in self.cells.beside(piece) {
            let next = &all[other];
            let same = next.cell == own.cell;
            let hole = !same && (Some(own.cell) == from || Some(next.cell) == from);
            if !same && !hole {
                continue;
            }
            for (plane, polygon) in own.planes.iter().zip(&own.faces) {
                let shared = next.planes.iter().fold(polygon.clone(), |w, p| clip(&w, p, tolerance));
                if shared.len() < 3 {
                    continue;
                }
                let pieces = [piece, other];
                if same {
                    out.extend(shrunk(shared, plane, tolerance).map(|polygon| Gate { polygon, plane: *plane, pieces }));
                    continue;
                }
                for portal in portals.iter().map(|&p| &self.cells.portals()[p]) {
                    if portal.plane.n.dot(plane.n).abs() < SAME_PLANE {
                        continue;
                    }
                    let rim = super::tight::rim(&portal.winding, &portal.plane);
                    let open = rim.iter().fold(shared.clone(), |w, p| clip(&w, p, 0.0));
                    out.extend(shrunk(open, plane, tolerance).map(|polygon| Gate { polygon, plane: *plane, pieces }));
                }
            }
        }
        out
    }
}

/// Ways from a point to gates, shortest first.
struct Ways<'w, 's> {
    search: &'w Search<'s>,
    /// See [`Search::line`].
    from: Option<CellId>,
    portals: &'w [usize],
    gates: Vec<Gate>,
    /// By piece that was entered or is beside one: its gates.
    of_piece: BTreeMap<usize, Vec<usize>>,
    entered: BTreeSet<usize>,
    /// Settled gates: point, previous gate.
    settled: BTreeMap<usize, (DVec3, Option<usize>)>,
    /// Gates and candidates, by the least length of a line through them.
    open: BinaryHeap<Reverse<(Cost, usize, usize)>>,
    candidates: Vec<Try>,
}

impl Ways<'_, '_> {
    /// The gates of a piece.
    fn reach(&mut self, piece: usize) -> Vec<usize> {
        if self.entered.insert(piece) {
            for gate in self.search.gates(piece, self.from, self.portals) {
                // The neighbour may have found it already.
                let known = gate.pieces[1] != OUTSIDE && self.entered.contains(&gate.pieces[1]);
                if !known {
                    for side in gate.pieces.into_iter().filter(|&p| p != OUTSIDE) {
                        self.of_piece.entry(side).or_default().push(self.gates.len());
                    }
                    self.gates.push(gate);
                }
            }
        }
        self.of_piece.get(&piece).cloned().unwrap_or_default()
    }

    fn add(&mut self, gate: usize, candidate: Try) {
        let least = candidate.cost + self.search.to_rim(candidate.point);
        self.open.push(Reverse((Cost(least), gate, self.candidates.len())));
        self.candidates.push(candidate);
    }

    /// Adds the ways from a point, at the end of a line of length `cost` through the gate `before`, to the gates of a piece.
    fn leave(&mut self, piece: usize, point: DVec3, cost: f64, before: Option<usize>) {
        for gate in self.reach(piece) {
            if !self.settled.contains_key(&gate) {
                let to = closest(&self.gates[gate].polygon, &self.gates[gate].plane, point);
                let cost = cost + point.distance(to);
                self.add(gate, Try { point: to, from: point, before, cost, first: true });
            }
        }
    }

    /// Settles the nearest gate with an unobstructed way. Returns it and the length of the line.
    fn settle_nearest(&mut self) -> Option<(usize, f64)> {
        loop {
            let Reverse((_, gate, k)) = self.open.pop()?;
            if self.settled.contains_key(&gate) {
                continue;
            }
            let t = self.candidates[k];
            if self.search.tracer.is_open(t.from, t.point) {
                self.settled.insert(gate, (t.point, t.before));
                return Some((gate, t.cost));
            }
            if t.first {
                self.add_detours(gate, t);
            }
        }
    }

    /// A wall may cover the nearest point of a gate: adds the middle, the corners and the points nearest to gates beyond.
    fn add_detours(&mut self, gate: usize, Try { from, before, cost, point, .. }: Try) {
        let base = cost - from.distance(point);
        let (centre, plane) = (middle(&self.gates[gate].polygon), self.gates[gate].plane);
        let mut others: Vec<DVec3> = self.gates[gate].polygon.iter().map(|&c| centre.lerp(c, 0.75)).collect();
        others.push(centre);
        for piece in self.gates[gate].pieces.into_iter().filter(|&p| p != OUTSIDE) {
            for beyond in self.reach(piece).into_iter().take(MOST_ASIDE) {
                others.push(closest(&self.gates[gate].polygon, &plane, middle(&self.gates[beyond].polygon)));
            }
        }
        for point in others {
            self.add(gate, Try { point, from, before, cost: base + from.distance(point), first: false });
        }
    }
}

/// A candidate path to a gate.
#[derive(Clone, Copy)]
struct Try {
    point: DVec3,
    from: DVec3,
    before: Option<usize>,
    cost: f64,
    /// Whether this is the nearest point of the gate; others are tried if it is obstructed.
    first: bool,
}

/// Metres, with an order.
#[derive(Clone, Copy, PartialEq)]
struct Cost(f64);

impl Eq for Cost {}

impl Ord for Cost {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// The side of a box in a plane, in either orientation.
fn face(bounds: &Aabb, plane: &Plane) -> Vec<DVec3> {
    let axis = plane.n.abs().max_position();
    let at = if plane.n[axis] > 0.0 { bounds.max } else { bounds.min };
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let corner = |a: DVec3, b: DVec3| {
        let mut p = at;
        (p[u], p[v]) = (a[u], b[v]);
        p
    };
    let (min, max) = (bounds.min, bounds.max);
    vec![corner(min, min), corner(max, min), corner(max, max), corner(min, max)]
}

/// A polygon inset by four times the tolerance, so that lines through it clear the edges. `None` if nothing remains.
fn shrunk(polygon: Vec<DVec3>, plane: &Plane, tolerance: f64) -> Option<Vec<DVec3>> {
    if polygon.len() < 3 {
        return None;
    }
    let rim = super::tight::rim(&polygon, plane);
    let inner = rim.iter().fold(polygon, |w, p| clip(&w, &Plane { d: p.d - 4.0 * tolerance, ..*p }, 0.0));
    (inner.len() >= 3).then_some(inner)
}

fn length(line: &[DVec3]) -> f64 {
    line.windows(2).map(|w| w[0].distance(w[1])).sum()
}
