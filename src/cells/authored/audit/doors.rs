//! Findings about doors, windows and passages: whether their relations match the rooms on both sides.

use super::finding::{Finding, FindingKind, called};
use crate::CellId;
use crate::cells::{CellGraph, Locator, PortalKind};
use crate::math::geom::{Aabb, area, middle, newell};
use crate::scene::{Hints, OpeningHint, OpeningKind, RoomHint};
use glam::DVec3;
use std::collections::BTreeSet;

/// Distances from a wall to a sample point in the adjacent room, metres, in the order of attempts. They pass a sill, but not the next wall.
const STEPS: [f64; 4] = [0.3, 0.5, 0.15, 0.05];
/// A portal within this distance of a door belongs to it, metres.
const PORTAL_NEAR: f64 = 0.35;
/// Smallest width (metres) and area (square metres) that a person can pass.
const PASSABLE: (f64, f64) = (0.4, 0.5);

/// A hatch has a larger vertical component of its unit normal than this (45 degrees); otherwise it is a door.
const LYING: f64 = 0.7;

/// Findings about openings, and rooms without an exit.
pub(super) fn findings(
    hints: &Hints,
    graph: &CellGraph,
    locator: &Locator<'_>,
    room_of: &[Option<usize>],
    metre: f64,
) -> Vec<Finding> {
    let boxes = graph.portals.iter().map(|p| Aabb::of(p.winding.iter().copied())).collect();
    let audit = Doors { hints, graph, locator, room_of, metre, boxes };
    let mut findings: Vec<Finding> = hints.openings.iter().flat_map(|opening| audit.of_opening(opening)).collect();
    findings.extend(audit.closed_rooms());
    findings
}

/// The data that openings are compared with.
struct Doors<'d> {
    hints: &'d Hints,
    graph: &'d CellGraph,
    locator: &'d Locator<'d>,
    /// The author's room of each cell.
    room_of: &'d [Option<usize>],
    metre: f64,
    /// Box of each portal.
    boxes: Vec<Aabb>,
}

impl Doors<'_> {
    fn room(&self, cell: Option<CellId>) -> Option<usize> {
        cell.and_then(|c| self.room_of[c.index()])
    }

    fn name(&self, cell: Option<CellId>) -> String {
        match (self.room(cell), cell) {
            (Some(r), _) => called(&self.hints.rooms[r]),
            (None, Some(c)) if self.is_open(c) => "the outside".to_owned(),
            (None, Some(c)) => self.graph.cells[c.index()].name.clone(),
            (None, None) => "solid matter".to_owned(),
        }
    }

    fn is_open(&self, cell: CellId) -> bool {
        self.graph.cells[cell.index()].open
    }

    /// Findings about one opening.
    fn of_opening(&self, opening: &OpeningHint) -> Vec<Finding> {
        let what = match opening.kind {
            OpeningKind::Door => "door",
            OpeningKind::Window => "window",
            OpeningKind::Opening => "opening",
            // Virtual openings follow the triangles.
            OpeningKind::Virtual => return Vec::new(),
        };
        let sides = sides(opening, self.locator, self.metre);
        let names = || sides.map(|side| self.name(side));
        let tell = |kind, rooms: &[usize], text: String| {
            let rooms = rooms.iter().map(|&r| self.hints.rooms[r].id.clone());
            let ids = std::iter::once(opening.id.clone()).chain(rooms).collect();
            Finding { kind, ids, text: format!("{what} {} {text}", opening.id) }
        };
        let said: BTreeSet<usize> = opening.rooms.into_iter().flatten().collect();
        let is: BTreeSet<usize> = sides.into_iter().filter_map(|side| self.room(side)).collect();
        let rooms: Vec<usize> = is.iter().copied().collect();
        // 1. Does it lead anywhere? An opening that ends in a wall is a niche.
        if opening.kind == OpeningKind::Opening && sides.contains(&None) {
            return Vec::new();
        }
        if let ([Some(a), Some(b)], false) = (sides, said == is && !is.is_empty())
            && a == b
            && !self.is_open(a)
        {
            return vec![tell(FindingKind::DoorWithoutRooms, &rooms, format!("stands inside {}", self.name(sides[0])))];
        }
        if is.is_empty() {
            // Space without a room is reported once, with its doors.
            let outside = sides.iter().flatten().all(|&c| self.is_open(c));
            let [one, other] = names();
            let text = format!("has no room on either side: {one} and {other}");
            return if outside { vec![tell(FindingKind::DoorWithoutRooms, &[], text)] } else { Vec::new() };
        }
        let mut findings = Vec::new();
        if sides[0] != sides[1] && !self.has_portal(opening, sides) {
            let [one, other] = names();
            let text = format!("is walled up: there is no opening between {one} and {other}");
            findings.push(tell(FindingKind::DoorWalledUp, &rooms, text));
        }
        // 2. Do the relations agree?
        if !said.is_empty() && said != is {
            let list: Vec<String> = said.iter().map(|&r| called(&self.hints.rooms[r])).collect();
            let all: Vec<usize> = is.union(&said).copied().collect();
            let [one, other] = names();
            let text = format!("joins {one} and {other}; its relations say {}", list.join(" and "));
            findings.push(tell(FindingKind::DoorElsewhere, &all, text));
        }
        findings
    }

    /// True if a portal of either side's cell is near. The opening may lead to a third cell: a reveal, or the space over a skylight.
    fn has_portal(&self, opening: &OpeningHint, sides: [Option<CellId>; 2]) -> bool {
        let reach = 0.5 * opening.thickness + PORTAL_NEAR * self.metre;
        let around = Aabb::of(opening.winding.iter().copied()).inflated(reach);
        self.boxes
            .iter()
            .zip(&self.graph.portals)
            .any(|(near, portal)| near.touches(&around) && sides.iter().flatten().any(|c| portal.cells.contains(c)))
    }

    /// Rooms without an entrance.
    fn closed_rooms(&self) -> Vec<Finding> {
        let (hints, metre) = (self.hints, self.metre);
        let mut reached = vec![false; hints.rooms.len()];
        for portal in self.graph.portals.iter().filter(|p| p.kind != PortalKind::Window) {
            let size = Aabb::of(portal.winding.iter().copied()).size();
            let lies = portal.plane.n.y.abs() > LYING;
            let wide = if lies { size.x.min(size.z) } else { size.x.hypot(size.z) };
            if wide >= PASSABLE.0 * metre && area(&portal.winding) >= PASSABLE.1 * metre * metre {
                portal.cells.iter().filter_map(|&c| self.room(Some(c))).for_each(|r| reached[r] = true);
            }
        }
        let closed = hints.rooms.iter().enumerate().filter(|(i, _)| !reached[*i] && self.room_of.contains(&Some(*i)));
        let of_room = |(_, hint): (usize, &RoomHint)| {
            let text = format!("{}: no door, passage or open side leads out of it", called(hint));
            Finding { kind: FindingKind::NoDoor, ids: vec![hint.id.clone()], text }
        };
        closed.map(of_room).collect()
    }
}

/// The cells on the side of an opening's normal and on the other.
fn sides(opening: &OpeningHint, locator: &Locator<'_>, metre: f64) -> [Option<CellId>; 2] {
    let centre = middle(&opening.winding);
    let local: Vec<DVec3> = opening.winding.iter().map(|&p| p - centre).collect();
    let n = newell(&local).normalize_or_zero();
    [n, -n].map(|way| {
        let at = |step: &f64| locator.locate(centre + way * (0.5 * opening.thickness + step * metre)).map(|found| found.0);
        STEPS.iter().find_map(at)
    })
}
