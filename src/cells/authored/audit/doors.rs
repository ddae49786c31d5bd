//! Doors, windows and passages: what is on their two sides, and whether their relations say so.

use super::{Finding, FindingKind, called};
use crate::CellId;
use crate::cells::{CellGraph, Locator, PortalKind};
use crate::geom::{Aabb, area, middle, newell};
use crate::scene::{Hints, OpeningHint, OpeningKind};
use glam::DVec3;
use std::collections::BTreeSet;

/// Steps from a wall's side into the room before it, metres, in the order in which they are tried: past a threshold or a sill, and
/// not through the next wall.
const STEPS: [f64; 4] = [0.3, 0.5, 0.15, 0.05];
/// A portal this near to a door is the door's, metres.
const NEAR: f64 = 0.35;
/// What one can go through is at least so wide, metres, and so large, square metres.
const PASSABLE: (f64, f64) = (0.4, 0.5);

/// What is wrong with openings, and rooms that none leads out of.
pub(super) fn findings(
    hints: &Hints,
    graph: &CellGraph,
    locator: &Locator<'_>,
    room_of: &[Option<usize>],
    metre: f64,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    let near: Vec<Aabb> = graph.portals.iter().map(|p| Aabb::of(p.winding.iter().copied())).collect();
    let room = |cell: Option<CellId>| cell.and_then(|c| room_of[c.index()]);
    let name = |cell: Option<CellId>| match (room(cell), cell) {
        (Some(r), _) => called(&hints.rooms[r]),
        (None, Some(c)) if graph.cells[c.index()].open => "the outside".to_owned(),
        (None, Some(c)) => graph.cells[c.index()].name.clone(),
        (None, None) => "solid matter".to_owned(),
    };
    for opening in &hints.openings {
        let what = match opening.kind {
            OpeningKind::Door => "door",
            OpeningKind::Window => "window",
            OpeningKind::Opening => "opening",
            // Drawn by rooms, and open wherever the triangles say so.
            OpeningKind::Virtual => continue,
        };
        let sides = sides(opening, locator, metre);
        let found = sides.map(room);
        let mut tell = |kind, rooms: &[usize], text: String| {
            let rooms = rooms.iter().map(|&r| hints.rooms[r].id.clone());
            let ids = std::iter::once(opening.id.clone()).chain(rooms).collect();
            findings.push(Finding { kind, ids, text: format!("{what} {} {text}", opening.id) });
        };
        let said: BTreeSet<usize> = opening.rooms.into_iter().flatten().collect();
        let is: BTreeSet<usize> = found.into_iter().flatten().collect();
        let rooms: Vec<usize> = is.iter().copied().collect();
        // 1. Is anything there? Holes that end in a wall are niches.
        if opening.kind == OpeningKind::Opening && sides.contains(&None) {
            continue;
        }
        if let ([Some(a), Some(b)], false) = (sides, said == is && !is.is_empty())
            && a == b
            && !graph.cells[a.index()].open
        {
            tell(FindingKind::DoorWithoutRooms, &rooms, format!("stands inside {}", name(sides[0])));
            continue;
        }
        if is.is_empty() {
            // Space without a room is told once, with the doors that lead there.
            if sides.iter().flatten().all(|c| graph.cells[c.index()].open) {
                let text = format!("has no room on either side: {} and {}", name(sides[0]), name(sides[1]));
                tell(FindingKind::DoorWithoutRooms, &[], text);
            }
            continue;
        }
        // What is open there may belong to a third cell: a reveal, the space over a skylight.
        let around = Aabb::of(opening.winding.iter().copied()).inflated(0.5 * opening.thickness + NEAR * metre);
        let is_there = |i: &usize| {
            let cells = graph.portals[*i].cells;
            near[*i].touches(&around) && sides.iter().flatten().any(|c| cells.contains(c))
        };
        if sides[0] != sides[1] && !(0..graph.portals.len()).any(|i| is_there(&i)) {
            let text = format!("is walled up: nothing is open between {} and {}", name(sides[0]), name(sides[1]));
            tell(FindingKind::DoorWalledUp, &rooms, text);
        }
        // 2. Do the relations say so?
        if !said.is_empty() && said != is {
            let list =
                |set: &BTreeSet<usize>| set.iter().map(|&r| called(&hints.rooms[r])).collect::<Vec<_>>().join(" and ");
            let all: Vec<usize> = is.union(&said).copied().collect();
            let text = format!("joins {} and {}; its relations say {}", name(sides[0]), name(sides[1]), list(&said));
            tell(FindingKind::DoorElsewhere, &all, text);
        }
    }
    // 3. Rooms that one can't go into.
    let mut reached = vec![false; hints.rooms.len()];
    for portal in graph.portals.iter().filter(|p| p.kind != PortalKind::Window) {
        let size = Aabb::of(portal.winding.iter().copied()).size();
        let wide = if portal.plane.n.y.abs() > 0.7 { size.x.min(size.z) } else { size.x.hypot(size.z) };
        if wide >= PASSABLE.0 * metre && area(&portal.winding) >= PASSABLE.1 * metre * metre {
            portal.cells.iter().filter_map(|&c| room(Some(c))).for_each(|r| reached[r] = true);
        }
    }
    for (i, hint) in hints.rooms.iter().enumerate() {
        if !reached[i] && room_of.contains(&Some(i)) {
            let text = format!("{}: no door, passage or open side leads out of it", called(hint));
            findings.push(Finding { kind: FindingKind::NoDoor, ids: vec![hint.id.clone()], text });
        }
    }
    findings
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
