//! Audit of the author's rooms, doors and relations against the triangles and the finished graph.
//!
//! The graph always follows the triangles. Each finding is one line that names a contradiction by the author's own ids. [`audit_rooms`]
//! needs no graph and tells whether the author's rooms are good enough to label cells; [`audit`] adds faults that need the graph. New: MVD
//! checkers look for exporters' faults in the relations, not in the geometry.

mod doors;
mod finding;
mod solid;
mod walls;

use crate::cells::convex::Convex;
use crate::cells::scale::HumanScale;
use crate::cells::{CellGraph, Locator};
use crate::math::parallel;
use crate::scene::rays::RayScene;
use crate::scene::{Hints, OpeningKind, RoomHint, Scene};
use finding::called;
use glam::DVec3;
use solid::Solid;
use std::collections::BTreeMap;

pub use finding::{Finding, FindingKind};

/// All findings, and how much of the author's description is correct.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Audit {
    /// Ordered by kind, then as in the model.
    pub findings: Vec<Finding>,
    /// Number of authored rooms.
    pub rooms: usize,
    /// Number of sound rooms: closed, with a volume, in free space, and not mostly inside smaller rooms.
    pub sound_rooms: usize,
    /// Share of the indoor free space that is in cells named by a room; 1 without a graph.
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

/// Two rooms overlap if they share more than this part of the smaller one. A room names no cell if smaller rooms cover `MOST` of it.
const OVERLAP: f64 = 0.02;
const MOST: f64 = 0.5;
/// Smallest volume of a room and of an overlap, cubic metres.
const LEAST_VOLUME: f64 = 0.05;
/// A room is not closed if more than this share of lines crosses its surface an odd number of times.
const OPEN: f64 = 0.03;
/// Smallest free space that is reported as unclaimed, cubic metres; smaller ones are shafts and plenums.
const LEAST_UNCLAIMED: f64 = 10.0;

/// The findings about rooms that need no graph.
pub fn audit_rooms(scene: &Scene) -> Audit {
    let metre = HumanScale::of(&RayScene::new(scene)).metre;
    let (findings, unsound) = of_rooms(&scene.hints, metre);
    Audit::of(scene.hints.rooms.len(), findings, &unsound)
}

/// Which rooms must not name cells, judged without a graph.
pub(in crate::cells) fn unsound(hints: &Hints, metre: f64) -> Vec<bool> {
    of_rooms(hints, metre).1
}

/// All findings, with the graph of the scene. A sound room is sound in [`audit_rooms`] and names a cell.
pub fn audit(scene: &Scene, graph: &CellGraph) -> Audit {
    let hints = &scene.hints;
    let rays = RayScene::new(scene);
    let metre = HumanScale::of(&rays).metre;
    let (mut findings, mut unsound) = of_rooms(hints, metre);
    if hints.rooms.is_empty() {
        return Audit::of(0, findings, &unsound);
    }
    // A cell is named after the first room with its id.
    let mut number: BTreeMap<&str, usize> = BTreeMap::new();
    for (i, room) in hints.rooms.iter().enumerate() {
        number.entry(&room.id).or_insert(i);
    }
    let room_of: Vec<Option<usize>> =
        graph.cells.iter().map(|c| c.source.as_deref().and_then(|id| number.get(id).copied())).collect();
    for (i, room) in hints.rooms.iter().enumerate() {
        // Other faults are reported already.
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

/// Findings about ids, surfaces and overlaps, and which rooms are unsound.
fn of_rooms(hints: &Hints, metre: f64) -> (Vec<Finding>, Vec<bool>) {
    let mut findings = duplicates(hints);
    let mut unsound = vec![false; hints.rooms.len()];
    let cubic = metre.powi(3);
    let solids: Vec<Solid> = parallel::map_range(0..hints.rooms.len(), |i| Solid::new(&hints.rooms[i]));
    for (i, (room, solid)) in hints.rooms.iter().zip(&solids).enumerate() {
        if solid.open_share > OPEN {
            unsound[i] = true;
            let what = format!("is not closed: {:.0} % of the lines that enter it never leave", 100.0 * solid.open_share);
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
        // Boxes around meshes are not authored, and overlap each other's walls.
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
    // Shared space belongs to the smaller room, or to the first of two equal ones. So copies and enclosing spaces are unsound.
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

/// Findings for closed cells without a room, and the share of the indoor free space in cells with one.
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
