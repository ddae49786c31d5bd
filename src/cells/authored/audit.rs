//! What is wrong in what a model's author wrote: rooms, doors and relations, held against the triangles and the finished graph.
//!
//! The graph is always what the triangles say; a finding says where the author says otherwise, one line each, by the author's own
//! ids. [`audit_rooms`] needs no graph and tells whether the author's rooms are worth labelling with; [`audit`] adds what only
//! the graph shows. New: exporters' faults are usually looked for in the relations (MVD checkers), not in the geometry.

mod doors;
mod finding;
mod solid;
mod walls;

use crate::cells::convex::Convex;
use crate::cells::scale::HumanScale;
use crate::cells::{CellGraph, Locator};
use crate::parallel;
use crate::scene::rays::RayScene;
use crate::scene::{Hints, OpeningKind, RoomHint, Scene};
use finding::called;
use glam::DVec3;
use solid::Solid;
use std::collections::BTreeMap;

pub use finding::{Finding, FindingKind};

/// All that is wrong, and how much of the author's word stands.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Audit {
    /// By kind, then in the author's order.
    pub findings: Vec<Finding>,
    /// Rooms that the author wrote.
    pub rooms: usize,
    /// Those without a fault that keeps them from naming space: they are closed, have a volume, lie in free space, and smaller
    /// rooms don't hold most of them.
    pub sound_rooms: usize,
    /// Of the free space indoors, the share in cells that a room gave its name to; 1 before there is a graph.
    pub claimed: f64,
}

impl Audit {
    /// `sound_rooms / rooms`; 1 where there are none.
    pub fn sound_share(&self) -> f64 {
        if self.rooms == 0 { 1.0 } else { self.sound_rooms as f64 / self.rooms as f64 }
    }

    fn of(rooms: usize, mut found: Vec<Finding>, unsound: &[bool]) -> Self {
        found.sort_by_key(|f| f.kind);
        Self { findings: found, rooms, sound_rooms: unsound.iter().filter(|u| !**u).count(), claimed: 1.0 }
    }
}

/// Rooms that share more than this part of the smaller one overlap; a room that smaller ones hold this much of names nothing.
const OVERLAP: f64 = 0.02;
const MOST: f64 = 0.5;
/// Cubic metres: less is no room, or no overlap worth a line.
const LEAST_VOLUME: f64 = 0.05;
/// Of lines that cross a room, those that cross it an odd number of times: more, and it is open.
const OPEN: f64 = 0.03;
/// Free space of less than this, cubic metres, needs no room: shafts, plenums.
const LEAST_UNCLAIMED: f64 = 10.0;

/// What can be told of the rooms before any split.
pub fn audit_rooms(scene: &Scene) -> Audit {
    let metre = HumanScale::of(&RayScene::new(scene)).metre;
    let (findings, unsound) = of_rooms(&scene.hints, metre);
    Audit::of(scene.hints.rooms.len(), findings, &unsound)
}

/// Which rooms are of no use to name space with, as far as can be told before any split.
pub(in crate::cells) fn unsound(hints: &Hints, metre: f64) -> Vec<bool> {
    of_rooms(hints, metre).1
}

/// What is wrong, given the graph that was made of it. Sound rooms are those of [`audit_rooms`] that name a cell.
pub fn audit(scene: &Scene, graph: &CellGraph) -> Audit {
    let hints = &scene.hints;
    let rays = RayScene::new(scene);
    let metre = HumanScale::of(&rays).metre;
    let (mut findings, mut unsound) = of_rooms(hints, metre);
    if hints.rooms.is_empty() {
        return Audit::of(0, findings, &unsound);
    }
    // The first room of an id is the one that its cell is named after.
    let mut number: BTreeMap<&str, usize> = BTreeMap::new();
    for (i, room) in hints.rooms.iter().enumerate() {
        number.entry(&room.id).or_insert(i);
    }
    let room_of: Vec<Option<usize>> =
        graph.cells.iter().map(|c| c.source.as_deref().and_then(|id| number.get(id).copied())).collect();
    for (i, room) in hints.rooms.iter().enumerate() {
        // Reported once, as what it is.
        if !unsound[i] && !room_of.contains(&Some(number[room.id.as_str()])) {
            unsound[i] = true;
            findings.push(one(FindingKind::NoFreeSpace, room, "holds no free space"));
        }
    }
    let locator = Locator::new(graph);
    findings.extend(doors::findings(hints, graph, &locator, &room_of, metre));
    findings.extend(walls::findings(&rays, &unsound, metre));
    let open_air = crate::cells::authored::open_air(scene);
    let outdoors = hints.rooms.iter().zip(open_air).zip(&unsound).filter(|((r, open), bad)| *open && !r.outside && !**bad);
    findings.extend(outdoors.map(|((room, _), _)| one(FindingKind::OpenAir, room, "lies under the open sky")));
    let (found, claimed) = unclaimed(graph, &room_of, scene.origin, metre);
    findings.extend(found);
    Audit { claimed, ..Audit::of(hints.rooms.len(), findings, &unsound) }
}

fn one(kind: FindingKind, room: &RoomHint, what: &str) -> Finding {
    Finding { kind, ids: vec![room.id.clone()], text: format!("{} {what}", called(room)) }
}

/// Ids, surfaces and overlaps, and which rooms are of no use.
fn of_rooms(hints: &Hints, metre: f64) -> (Vec<Finding>, Vec<bool>) {
    let mut findings = duplicates(hints);
    let mut unsound = vec![false; hints.rooms.len()];
    let cubic = metre.powi(3);
    let solids: Vec<Solid> = parallel::map_range(0..hints.rooms.len(), |i| Solid::new(&hints.rooms[i]));
    for (i, (room, solid)) in hints.rooms.iter().zip(&solids).enumerate() {
        if solid.open_share > OPEN {
            unsound[i] = true;
            let what =
                format!("is not closed: {:.0} % of the lines through it come in and never leave", 100.0 * solid.open_share);
            findings.push(one(FindingKind::NotClosed, room, &what));
        } else if solid.volume < LEAST_VOLUME * cubic {
            unsound[i] = true;
            findings.push(one(FindingKind::NoVolume, room, &format!("encloses {:.3} m3", solid.volume)));
        }
    }
    let overlaps = solid::overlaps(&solids);
    for &(i, j, shared) in &overlaps {
        let (a, b) = if solids[j].volume <= solids[i].volume { (j, i) } else { (i, j) };
        let share = shared / solids[a].volume;
        // Boxes around meshes reach into each other's walls: nobody drew them.
        let drawn = hints.rooms[a].drawn && hints.rooms[b].drawn;
        if unsound[a] || unsound[b] || share < OVERLAP || shared < LEAST_VOLUME * cubic || !(drawn || share > MOST) {
            continue;
        }
        let (small, large) = (&hints.rooms[a], &hints.rooms[b]);
        findings.push(Finding {
            kind: FindingKind::Overlap,
            ids: vec![small.id.clone(), large.id.clone()],
            text: format!(
                "{} and {} share {shared:.2} m3, {:.0} % of the first",
                called(small),
                called(large),
                100.0 * share
            ),
        });
    }
    // Shared space is the smaller room's, of equal ones the first's: a copy, and a space drawn around others, name nothing.
    let mut order: Vec<usize> = (0..solids.len()).collect();
    order.sort_by(|&a, &b| solids[a].volume.total_cmp(&solids[b].volume).then(a.cmp(&b)));
    let mut taken = vec![0.0; solids.len()];
    for large in order {
        unsound[large] |= taken[large] > MOST * solids[large].volume;
        for &(i, j, shared) in overlaps.iter().filter(|(i, j, _)| !unsound[large] && (*i == large || *j == large)) {
            taken[i + j - large] += shared;
        }
    }
    (findings, unsound)
}

/// Closed cells that no room gave its name to, and the share of the free space indoors that isn't in one of them.
fn unclaimed(graph: &CellGraph, room_of: &[Option<usize>], origin: DVec3, metre: f64) -> (Vec<Finding>, f64) {
    let mut findings = Vec::new();
    let [mut whole, mut claimed] = [0.0; 2];
    for (cell, room) in graph.cells.iter().zip(room_of).filter(|(cell, _)| !cell.open) {
        let pieces = cell.pieces.iter().filter_map(|p| Convex::inside(p.bounds, &p.planes, 0.0));
        let parts: Vec<(f64, DVec3)> = pieces.map(|p| (p.volume(), p.centre())).collect();
        let volume: f64 = parts.iter().map(|p| p.0).sum();
        let Some(largest) = parts.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a }) else { continue };
        if room.is_some() {
            (whole, claimed) = (whole + volume, claimed + volume);
            continue;
        }
        if volume < LEAST_UNCLAIMED * metre.powi(3) {
            continue;
        }
        whole += volume;
        let doors = cell.portals.iter().filter_map(|p| graph.portals[p.portal().index()].source.clone());
        let mut ids: Vec<String> = doors.collect();
        ids.sort();
        ids.dedup();
        let reached = match ids.first() {
            Some(first) if ids.len() > 1 => format!(", reached by {first} and {} more", ids.len() - 1),
            Some(first) => format!(", reached by {first}"),
            None => String::new(),
        };
        let at = largest.1 + origin;
        let text = format!("{} ({volume:.1} m3 around {:.1} {:.1} {:.1}) is no room{reached}", cell.name, at.x, at.y, at.z);
        findings.push(Finding { kind: FindingKind::Unclaimed, ids, text });
    }
    (findings, if whole > 0.0 { claimed / whole } else { 1.0 })
}

/// Ids of several rooms, or of several openings.
fn duplicates(hints: &Hints) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (what, ids) in [
        ("rooms", hints.rooms.iter().map(|r| &r.id).collect::<Vec<_>>()),
        ("openings", hints.openings.iter().filter(|o| o.kind != OpeningKind::Virtual).map(|o| &o.id).collect()),
    ] {
        let mut count: BTreeMap<&String, usize> = BTreeMap::new();
        ids.into_iter().for_each(|id| *count.entry(id).or_default() += 1);
        findings.extend(count.into_iter().filter(|c| c.1 > 1).map(|(id, n)| Finding {
            kind: FindingKind::DuplicateId,
            ids: vec![id.clone()],
            text: format!("{n} {what} have the id {id}"),
        }));
    }
    findings
}
