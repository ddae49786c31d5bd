//! The check sees every kind of damage: a good file of a real bake, and the same with one thing wrong, each named. Damage to single bits, portals and
//! tables is in `check.rs`, by hand.

use enfilade::CellId;
use enfilade::bake::BakeOptions;
use enfilade::file::PvsFile;
use enfilade::scene::Scene;
use enfilade::types::placed::PlacedBox;
use enfilade_measure::verify::{CheckOptions, FaultKind, Violation, check};
use enfilade_scenes::Kind;
use glam::Vec3;
use testing::bakes;

/// What shows that a file is damaged.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Seen {
    /// The check fails with a violation of this kind.
    By(Violation),
    /// The structure is faulty.
    Fault(FaultKind),
    /// The check doesn't begin; the error says this.
    Refused(&'static str),
}

/// A kind of damage: its name, what is done, what shows it.
type Damage = (&'static str, fn(&mut PvsFile), Seen);

/// The portal with the largest box, between two closed cells.
fn largest(file: &PvsFile) -> usize {
    let closed = |c: CellId| !file.cells[c.index()].open;
    let size = |i: usize| {
        let w = &file.portals[i].winding;
        let (low, high) = (w.iter().copied().reduce(Vec3::min).unwrap(), w.iter().copied().reduce(Vec3::max).unwrap());
        (high - low).length()
    };
    let inner = (0..file.portals.len()).filter(|&i| file.portals[i].cells.iter().all(|&c| closed(c)));
    inner.max_by(|&a, &b| size(a).total_cmp(&size(b))).expect("rooms are joined")
}

/// A pair that is surely visible: the longest witness from a closed cell to an object that isn't in it.
fn seen_pair(file: &PvsFile) -> (usize, usize) {
    let witnesses = &file.bounds.as_ref().expect("kept").witnesses;
    let apart = witnesses.iter().filter(|w| !file.placement.get(w.cell.index(), w.object.index()));
    // Seen through a window twice as well as once: of many witnesses of a cell the object with the largest box.
    let size = |o: usize| file.objects[o].bounds[0].distance(file.objects[o].bounds[1]);
    let large =
        apart.max_by(|a, b| size(a.object.index()).total_cmp(&size(b.object.index()))).expect("rooms see into rooms");
    (large.cell.index(), large.object.index())
}

const DAMAGES: [Damage; 11] = [
    (
        "a row is another cell's",
        |f| {
            let [a, _] = f.portals[largest(f)].cells.map(CellId::index);
            let rows = f.object_rows.as_mut().expect("rows");
            let least = (0..rows.rows()).min_by_key(|&r| rows.count_row(r)).expect("cells");
            let other = rows.row(least).to_vec();
            rows.row_mut(a).copy_from_slice(&other);
        },
        Seen::By(Violation::Object),
    ),
    (
        "a cell is dropped",
        |f| {
            let [a, _] = f.portals[largest(f)].cells.map(CellId::index);
            f.cells[a].pieces.clear();
        },
        Seen::By(Violation::Segment),
    ),
    (
        "a cell is dropped and the others' numbers move up",
        |f| {
            f.cells.remove(0);
        },
        Seen::Refused("wrong shape"),
    ),
    (
        "a winding is shifted by half a metre",
        |f| {
            let portal = largest(f);
            let portal = &mut f.portals[portal];
            let along = Vec3::Y.cross(portal.plane.truncate()).normalize_or(Vec3::X) * 0.5;
            portal.winding.iter_mut().for_each(|p| *p += along);
        },
        Seen::By(Violation::Segment),
    ),
    (
        "a portal's plane is flipped",
        |f| {
            let portal = largest(f);
            f.portals[portal].plane *= -1.0;
        },
        Seen::Fault(FaultKind::Clockwise),
    ),
    (
        "a piece's plane is flipped",
        |f| {
            let [a, _] = f.portals[largest(f)].cells.map(CellId::index);
            f.cells[a].pieces.iter_mut().for_each(|piece| piece[0] *= -1.0);
        },
        Seen::By(Violation::Segment),
    ),
    (
        "an object isn't where it is",
        |f| {
            let (_, object) = seen_pair(f);
            (0..f.placement.rows()).for_each(|cell| f.placement.clear(cell, object));
            f.placed = None;
        },
        Seen::By(Violation::Placement),
    ),
    (
        "an object's box in its cell is too small",
        |f| {
            let (_, object) = seen_pair(f);
            let objects = (0..f.placement.rows()).flat_map(|cell| f.placement.ones(cell));
            let placed = objects.map(|o| if o == object { PlacedBox([0; 6]) } else { PlacedBox::WHOLE });
            f.placed = Some(placed.collect());
        },
        Seen::By(Violation::Placement),
    ),
    (
        "a box of an object in a cell is missing",
        |f| f.placed = Some(vec![PlacedBox::WHOLE; f.placement.count_ones() as usize - 1]),
        Seen::Refused("boxes of objects in cells"),
    ),
    (
        "an object's box is too small",
        |f| {
            let (_, object) = seen_pair(f);
            f.objects[object].bounds[1] = f.objects[object].bounds[0];
        },
        Seen::Refused("its box does not hold them"),
    ),
    ("the origin has moved", |f| f.origin.x += 0.5, Seen::Refused("the origin is")),
];

fn baked() -> (Scene, PvsFile) {
    let (_, scene) = bakes::generated(Kind::Gallery { rooms: 9 }, 1);
    let file = bakes::baked(&scene, BakeOptions { keep_bounds: true, ..bakes::with_rays(200_000) });
    (scene, file)
}

const OPTIONS: CheckOptions = CheckOptions { rays: 80_000, views: 0, seed: 5, leaks: false };

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn every_kind_of_damage_is_seen_and_named() {
    let (scene, good) = baked();
    let report = check(&good, &scene, &OPTIONS).unwrap();
    assert!(report.passed && report.structure.count == 0, "{:?} {:?}", report.examples, report.structure.faults);
    let mut unseen = Vec::new();
    for (name, damage, by) in DAMAGES {
        let mut file = good.clone();
        damage(&mut file);
        assert!(file != good, "{name}: nothing was damaged");
        let seen = match (check(&file, &scene, &OPTIONS), by) {
            (Err(e), Seen::Refused(why)) => e.to_string().contains(why),
            (Ok(report), Seen::By(kind)) => !report.passed && report.examples.iter().any(|e| e.violation == kind),
            (Ok(report), Seen::Fault(kind)) => !report.passed && report.structure.faults.iter().any(|f| f.fault == kind),
            _ => false,
        };
        if !seen {
            unseen.push(name);
        }
    }
    assert!(unseen.is_empty(), "not seen: {unseen:?}");
}
