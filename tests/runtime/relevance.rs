//! Who may see whom: hand-made buildings with known answers, and bodies that walk.

use enfilade::file::{FileRelevance, PvsFile};
use enfilade::runtime::{Culler, Doors, Movers, Relevance, View};
use enfilade::{BitMatrix, CellId, ObjectId, PortalId};
use glam::Vec3;
use std::collections::BTreeSet;
use testing::boxes::{A, B, CORRIDOR, OUTSIDE, flat, p};
use testing::maze::Grid;
use testing::random::Places;

/// The flat, with rows in which each cell sees itself alone.
fn blind_flat() -> PvsFile {
    let (building, things) = flat();
    let own = [(A, things.in_a), (B, things.in_b), (CORRIDOR, things.in_corridor), (OUTSIDE, things.tree)];
    let (_, file) = building.finish_with(|cells, objects| {
        for row in 0..cells.rows() {
            cells.row_mut(row).fill(0);
            cells.set(row, row);
            objects.row_mut(row).fill(0);
        }
        for (cell, object) in own {
            objects.set(cell.index(), object.index());
        }
    });
    file
}

fn seen(relevance: &Relevance, from: CellId) -> Vec<CellId> {
    relevance.cells().ones(from.index()).map(|cell| CellId(cell as u32)).collect()
}

#[test]
fn rows_are_those_of_all_cells_within_the_way() {
    let file = blind_flat();
    let culler = Culler::new(&file);
    let open = Doors::passable(&culler);
    let at = |metres: f64| Relevance::new(&culler, metres, &open);
    // From the door of A at x 1..2 to that of B at x 8..9 it is 6 m.
    for metres in [0.0, 1.0, 5.9] {
        assert_eq!(seen(&at(metres), A), [A, CORRIDOR], "{metres}");
        assert_eq!(seen(&at(metres), CORRIDOR), [A, B, CORRIDOR]);
    }
    for metres in [6.01, 100.0, f64::INFINITY] {
        assert_eq!(seen(&at(metres), A), [A, B, CORRIDOR], "{metres}");
        assert_eq!(seen(&at(metres), OUTSIDE), [OUTSIDE], "through a window");
    }
    let through_windows = Relevance::new(&culler, 0.0, &Doors::open(&culler));
    assert_eq!(seen(&through_windows, A), [A, CORRIDOR, OUTSIDE]);
    let (near, objects) = (at(2.0), flat().1);
    assert!(near.may_see_object(&[A], objects.in_a) && near.may_see_object(&[A], objects.in_corridor));
    assert!(!near.may_see_object(&[A], objects.in_b) && near.may_see_object(&[], objects.in_b));
    // A door that is shut.
    let mut shut = open.clone();
    let door = file.portals.iter().position(|q| q.cells.contains(&A) && q.cells.contains(&CORRIDOR)).unwrap();
    shut.set_open(PortalId(door as u32), false);
    let by_shut = Relevance::new(&culler, 100.0, &shut);
    assert_eq!((seen(&by_shut, A), seen(&by_shut, CORRIDOR)), (vec![A], vec![B, CORRIDOR]));
}

#[test]
fn boxes_may_see_what_their_cells_do_and_those_that_are_anywhere_everything() {
    let file = blind_flat();
    let culler = Culler::new(&file);
    let relevance = Relevance::new(&culler, 2.0, &Doors::passable(&culler));
    let mut movers = Movers::new(&culler);
    let mut person = |x: f64, z: f64| {
        let feet = p(x, 0.1, z) - file.origin;
        movers.insert([feet.as_vec3(), (feet + p(0.5, 1.8, 0.5)).as_vec3()]).unwrap()
    };
    let [in_a, in_b, in_corridor, in_wall] = [person(1.0, 1.0), person(8.0, 1.0), person(4.0, 5.0), person(4.8, 2.0)];
    let in_doorway = person(8.2, 3.8);
    let may_see = |a, b| relevance.may_see(movers.cells(a).unwrap(), movers.cells(b).unwrap());
    assert!(may_see(in_a, in_corridor) && may_see(in_corridor, in_a) && may_see(in_corridor, in_b));
    assert!(!may_see(in_a, in_b) && !may_see(in_b, in_a));
    // A part of the box is in the corridor.
    assert!(may_see(in_a, in_doorway) && may_see(in_doorway, in_a) && may_see(in_doorway, in_b));
    assert!(may_see(in_wall, in_a) && may_see(in_a, in_wall), "in no cell");
}

#[test]
fn a_body_gets_from_its_box_no_farther_than_its_metres() {
    let file = blind_flat();
    let culler = Culler::new(&file);
    let mut view = View::new(&culler);
    view.set_doors(&Doors::passable(&culler));
    let feet = |x: f64, z: f64| [(p(x, 0.1, z) - file.origin).as_vec3(), (p(x + 0.5, 1.8, z + 0.5) - file.origin).as_vec3()];
    // 2 m before the door of A, in its middle; and 6 m on from there to the door of B.
    for (metres, cells) in
        [(0.0, &[A][..]), (1.9, &[A]), (2.01, &[A, CORRIDOR]), (7.9, &[A, CORRIDOR]), (8.1, &[A, CORRIDOR, B])]
    {
        assert_eq!(view.within_metres(feet(1.2, 1.5), metres), cells, "{metres}");
    }
    assert_eq!(view.within_metres(feet(4.8, 2.0), 100.0), [], "in no cell");
    let mut from = |x: f64, z: f64, metres: f64| view.within_metres(feet(x, z), metres).to_vec();
    let [in_a, in_b] = [from(1.2, 1.5, 1.0), from(8.2, 1.5, 1.0)];
    assert!(!culler.may_see(&in_a, &in_b) && culler.may_see(&in_a, &from(1.2, 1.5, 3.0)));
    assert!(culler.may_see(&from(1.2, 1.5, 3.0), &from(8.2, 1.5, 3.0)), "both in the corridor");
    assert!(culler.may_see(&in_a, &[]) && culler.may_see(&[], &in_b));
}

/// Rows of a file in which nothing is hidden, and of one whose rows are only sampled.
#[test]
fn without_certain_rows_everybody_may_see_everybody() {
    let mut file = blind_flat();
    file.guarantee = enfilade::file::Guarantee::Sampled;
    let culler = Culler::new(&file);
    assert_eq!(seen(&Relevance::new(&culler, 0.0, &Doors::open(&culler)), OUTSIDE), [A, B, CORRIDOR, OUTSIDE]);
    (file.cell_rows, file.object_rows) = (None, None);
    let culler = Culler::new(&file);
    assert!(culler.may_see(&[OUTSIDE], &[A]));
    let all = Relevance::new(&culler, 0.0, &Doors::open(&culler));
    assert_eq!(all.cells().count_ones(), 16);
    assert_eq!(all.objects().count_ones(), 4 * file.objects.len() as u64);
}

#[test]
fn a_file_keeps_them() {
    let mut file = blind_flat();
    assert_eq!(Relevance::of_file(&file), None);
    let culler = Culler::new(&file);
    let made = Relevance::new(&culler, 2.5, &Doors::passable(&culler));
    let (metres, cells, objects) = (made.metres(), made.cells().clone(), made.objects().clone());
    file.relevance = Some(FileRelevance { metres, cells, objects });
    let read = PvsFile::read(&file.write()).unwrap();
    assert_eq!(read, file);
    assert_eq!(Relevance::of_file(&read), Some(made));
}

/// The cells within some metres of a cell: from each of its portals by gaps between boxes around portals, none less than the straight gap, until no
/// way gets shorter.
fn reached(file: &PvsFile, start: CellId, metres: f64) -> Vec<usize> {
    let bounds = |q: usize| {
        let corners = file.portals[q].winding.iter();
        corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[low, high], &c| [low.min(c), high.max(c)])
    };
    let gap = |a: usize, b: usize| {
        let (a, b) = (bounds(a), bounds(b));
        f64::from((a[0] - b[1]).max(b[0] - a[1]).max(Vec3::ZERO).length())
    };
    let sides = || (0..file.portals.len()).flat_map(|q| [(q, 0), (q, 1)]);
    let from = |(q, side): (usize, usize)| file.portals[q].cells[side];
    let mut within = vec![start.index()];
    for first in sides().filter(|&first| from(first) == start) {
        let mut ways: Vec<f64> = sides().map(|way| if way == first { 0.0 } else { f64::INFINITY }).collect();
        loop {
            let before = ways.clone();
            for ((i, a), (j, b)) in sides().enumerate().flat_map(|a| sides().enumerate().map(move |b| (a, b))) {
                if file.portals[a.0].cells[1 - a.1] == from(b) {
                    ways[j] = ways[j].min((ways[i] + gap(a.0, b.0)).max(gap(first.0, b.0)));
                }
            }
            if ways == before {
                break;
            }
        }
        let near = sides().zip(ways).filter(|(_, way)| *way <= metres);
        within.extend(near.map(|((q, side), _)| file.portals[q].cells[1 - side].index()));
    }
    within
}

/// Bodies walk from portal to portal. What their cell sees was in the row of the cell that they were in some metres ago, whatever the rows are.
#[test]
fn nobody_comes_into_sight_unannounced() {
    let mut random = Places::new(3);
    let (mut steps, mut surprises_of_none, mut kept_back) = (0, 0, 0);
    for round in 0..60 {
        let grid = Grid::random(&mut random);
        let (_, mut file) = grid.building();
        let (n, m) = (file.cells.len(), file.objects.len());
        let [mut cells, mut objects] = [BitMatrix::new(n, n), BitMatrix::new(n, m)];
        (0..n).for_each(|i| _ = cells.set(i, i));
        (0..n).for_each(|i| _ = (cells.set(i, random.below(n)), objects.set(i, random.below(m))));
        (file.cell_rows, file.object_rows) = (Some(cells.clone()), Some(objects.clone()));
        let culler = Culler::new(&file);
        let metres = [0.5, 2.0, 5.0][round % 3];
        let relevance = Relevance::new(&culler, metres, &Doors::open(&culler));
        let none = Relevance::new(&culler, 0.0, &Doors::open(&culler));
        for from in (0..n).map(|from| CellId(from as u32)) {
            let near = reached(&file, from, metres);
            let by_cells: BTreeSet<usize> = near.iter().flat_map(|&cell| cells.ones(cell)).collect();
            assert!(by_cells.into_iter().eq(relevance.cells().ones(from.index())), "round {round}: {from}");
            let by_objects = near.iter().flat_map(|&cell| objects.ones(cell));
            assert!(by_objects.into_iter().all(|seen| relevance.may_see_object(&[from], ObjectId(seen as u32))));
        }
        kept_back += (n * n) as u64 - relevance.cells().count_ones();
        if file.portals.is_empty() {
            continue;
        }
        // The metres walked, the place and the cell.
        let mut view = View::new(&culler);
        let mut walk: Vec<(f64, Vec3, CellId)> = Vec::new();
        let (mut at, mut walked, mut portal) = (None::<Vec3>, 0.0, random.below(file.portals.len()));
        let mut cell = file.portals[portal].cells[0];
        for _ in 0..200 {
            let corners = &file.portals[portal].winding;
            let through = corners[0].lerp(corners[2], random.unit() as f32);
            walked += at.map_or(0.0, |at| f64::from(at.distance(through)));
            walk.push((walked, through, cell));
            cell = file.portals[portal].cells[usize::from(file.portals[portal].cells[0] == cell)];
            walk.push((walked, through, cell));
            at = Some(through);
            let out: Vec<usize> = (0..file.portals.len()).filter(|&q| file.portals[q].cells.contains(&cell)).collect();
            portal = out[random.below(out.len())];
        }
        for (i, &(now, _, cell)) in walk.iter().enumerate() {
            for &(_, place, before) in walk[..i].iter().rev().take_while(|(then, ..)| now - then <= metres) {
                steps += 1;
                assert!(view.within_metres([place - 0.1, place + 0.1], metres).contains(&cell));
                for seen in cells.ones(cell.index()).map(|seen| [CellId(seen as u32)]) {
                    assert!(relevance.may_see(&[before], &seen), "round {round}: {before} to {cell}");
                    surprises_of_none += usize::from(!none.may_see(&[before], &seen));
                }
            }
        }
    }
    assert!(steps > 5000 && surprises_of_none > 50 && kept_back > 1000, "{steps} steps, {surprises_of_none}, {kept_back}");
}
