//! The check sees every kind of damage: a good file of a real bake, and the same with one thing wrong, each named.

use enfilade::CellId;
use enfilade::bake::{BakeOptions, bake};
use enfilade::file::PvsFile;
use enfilade::job::Job;
use enfilade::pvs::PvsOptions;
use enfilade::scene::{ImportOptions, Scene};
use enfilade::types::placed::PlacedBox;
use enfilade_formats::gltf;
use enfilade_measure::verify::{CheckOptions, FaultKind, Violation, check};
use enfilade_scenes::{Kind, generate};
use glam::Vec3;

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

const DAMAGES: [Damage; 18] = [
    (
        "a bit of an object's row is cleared",
        |f| {
            let (cell, object) = seen_pair(f);
            f.object_rows.as_mut().expect("rows").clear(cell, object);
        },
        Seen::By(Violation::Object),
    ),
    (
        "a bit of a cell's row is cleared",
        |f| {
            let [a, b] = f.portals[largest(f)].cells.map(CellId::index);
            f.cell_rows.as_mut().expect("rows").clear(a, b);
        },
        Seen::By(Violation::Cell),
    ),
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
    ("an object is dropped", |f| drop(f.objects.pop()), Seen::Refused("objects in the file")),
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
        "a portal is dropped",
        |f| {
            let portal = largest(f);
            f.portals.remove(portal);
        },
        Seen::By(Violation::Segment),
    ),
    (
        "a portal joins a cell that isn't there",
        |f| f.portals[0].cells[1] = CellId(f.cells.len() as u32),
        Seen::Refused("portal 0"),
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
        "a winding runs backwards",
        |f| {
            let portal = largest(f);
            f.portals[portal].winding.reverse();
        },
        Seen::Fault(FaultKind::Clockwise),
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
    ("the model's hash is stale", |f| f.model_hash ^= 1, Seen::Refused("is not the file's model")),
];

fn baked() -> (Scene, PvsFile) {
    let glb = generate(Kind::Gallery { rooms: 9 }, 1).unwrap().glb;
    let scene = gltf::from_slice(&glb, "gallery", None, &ImportOptions::default()).unwrap();
    let pvs = PvsOptions { ray_budget: 200_000, ..PvsOptions::default() };
    let options = BakeOptions { pvs, keep_bounds: true, ..BakeOptions::default() };
    let file = bake(&scene, options, &Job::quiet()).unwrap().file;
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
