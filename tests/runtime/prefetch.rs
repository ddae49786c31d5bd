//! What a prefetcher asks for and lets go, against rows of rooms whose answers are known by hand.

use enfilade::file::PvsFile;
use enfilade::runtime::prefetch::{ChunkId, Chunks, Prefetcher, Step};
use enfilade::runtime::{Camera, Culler, Doors, Mode, Motion, View};
use enfilade::{CellId, ObjectId, PortalId};
use enfilade_measure::walkthrough::loading::{LoadingOptions, LoadingSummary, Method, object_bytes, walk_loading};
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};
use enfilade_measure::walkthrough::stroll::Stroll;
use glam::{DVec3, Vec3};
use std::sync::Arc;
use testing::boxes::{Building, block, p};
use testing::random::Random;

/// Rooms of 4 m in a row along x, one object in the middle of each; doors of 1 m in the middle of the walls between. Each room sees itself and the
/// next on both sides. The object of room `k` has the number `k`.
fn row(rooms: usize) -> (Building, usize) {
    let mut b = Building::default();
    for k in 0..rooms {
        let x = 4.0 * k as f64;
        b.cell(&format!("room {k}"), vec![block(p(x, 0., 0.), p(x + 4., 3., 4.))]);
        b.thing(&format!("thing {k}"), p(x + 1.5, 0.01, 0.5), p(x + 2.5, 1., 1.));
        if k > 0 {
            let kind = enfilade::cells::PortalKind::Door;
            b.portal(CellId(k as u32 - 1), CellId(k as u32), p(x, 0., 1.5), p(x, 2.1, 2.5), kind);
        }
    }
    (b, rooms)
}

fn finish((b, rooms): (Building, usize)) -> (PvsFile, Arc<Culler>) {
    let (_, file) = b.finish_with(|_, objects| {
        for cell in 0..rooms {
            for object in (0..rooms).filter(|object| object.abs_diff(cell) > 1) {
                objects.clear(cell, object);
            }
        }
    });
    let culler = Culler::new(&file);
    (file, culler)
}

fn eye(file: &PvsFile, x: f64) -> Vec3 {
    (p(x, 1.6, 2.0) - file.origin).as_vec3()
}

fn objects(numbers: &[u32]) -> Vec<ObjectId> {
    numbers.iter().copied().map(ObjectId).collect()
}

/// Takes all steps at once, as a loader without limits does: loads as `+ n`, evictions as `- n`.
fn settle(prefetcher: &mut Prefetcher) -> Vec<i32> {
    let mut steps = Vec::new();
    while let Some(step) = prefetcher.next_step() {
        match step {
            Step::Load { chunk, .. } => {
                prefetcher.loaded(chunk);
                steps.push(chunk.0 as i32 + 1);
            }
            Step::Evict(chunk) => steps.push(-(chunk.0 as i32) - 1),
        }
    }
    steps
}

#[test]
fn loads_come_in_the_order_in_which_an_eye_may_need_them() {
    let (file, culler) = finish(row(7));
    let mut prefetcher = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10; 7]), 1000);
    // In room 3, which is from 12 to 16 m, nearer to its door at 16: room 2 and 4 are in its row, then rooms 5, 1, 6 and 0 are added.
    assert_eq!(prefetcher.frame(eye(&file, 14.5), &Motion::default(), &objects(&[3])), 1);
    let mut told = Vec::new();
    while let Some(Step::Load { chunk, metres }) = prefetcher.next_step() {
        told.push((chunk.0, (metres * 10.0).round() as i32));
    }
    // To the doors at 16 and 12 m, and one room farther.
    assert_eq!(told, [(3, 0), (2, 0), (4, 0), (5, 15), (1, 25), (6, 55), (0, 65)]);
    assert_eq!((prefetcher.used(), prefetcher.is_loaded(ObjectId(3))), (70, false));

    // Of two doors at the same distance, the one to which the eye goes comes first; no door is said to be farther than it is.
    for (speed, first) in [(1.0, 5), (-1.0, 1)] {
        let mut motion = Motion::default();
        for (x, time) in [(14.0 - 0.1 * speed, 0.0), (14.0, 0.1)] {
            let eye = eye(&file, x).as_dvec3();
            motion.see(&Camera::look_at(eye, eye + DVec3::Z, 1.0, 1.0), time);
        }
        let mut prefetcher = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10; 7]), 1000);
        prefetcher.frame(eye(&file, 14.0), &motion, &[]);
        let mut added = Vec::new();
        while let Some(Step::Load { chunk, metres }) = prefetcher.next_step() {
            if metres > 0.0 {
                assert!(metres <= 6.0 && (metres <= 2.0 || ![1, 5].contains(&chunk.0)), "{chunk:?}: {metres}");
                added.push(chunk.0);
            }
        }
        assert_eq!((added[0], added.len()), (first, 4), "{speed}");
    }
}

/// A hall of 36 m along x, nine objects in a row: all are in its row, and half of them fit into memory.
#[test]
fn where_a_row_is_more_than_the_budget_what_is_seen_comes_first() {
    let mut b = Building::default();
    b.cell("hall", vec![block(p(0., 0., 0.), p(36., 3., 4.))]);
    for k in 0..9 {
        let x = 4.0 * f64::from(k);
        b.thing(&format!("thing {k}"), p(x + 1.5, 0.01, 0.5), p(x + 2.5, 1., 1.));
    }
    let (file, culler) = finish((b, 1));
    let mut prefetcher = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10; 9]), 40);
    let mut motion = Motion::default();
    let mut look = |along: DVec3, time: f64| {
        // Between objects 3 and 4.
        let at = eye(&file, 16.0).as_dvec3();
        let camera = Camera::look_at(at, at + along, 1.0, 1.0);
        motion.see(&camera, time);
        prefetcher.frame(camera.eye, &motion, &[]);
        settle(&mut prefetcher);
        (0..9).filter(|&o| prefetcher.is_loaded(ObjectId(o))).collect::<Vec<u32>>()
    };
    // Five are ahead, of which four fit.
    let held = look(DVec3::X, 0.0);
    assert!(held.len() == 4 && held.iter().all(|&o| o >= 4), "{held:?}");
    // It stands still and looks back, a second later: the core of the plan, three of four, is what is seen there.
    let held = look(DVec3::NEG_X, 1.0);
    assert!(held.iter().filter(|o| **o < 4).count() >= 3, "{held:?}");
}

#[test]
fn what_leaves_is_what_was_planned_longest_ago() {
    let (file, culler) = finish(row(9));
    // Room for four; three are the core of a plan.
    let mut prefetcher = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10; 9]), 40);
    let mut at = |room: u32| {
        prefetcher.frame(eye(&file, 4.0 * f64::from(room) + 2.1), &Motion::default(), &objects(&[room]));
        let steps = settle(&mut prefetcher);
        let held: Vec<u32> = (0..9).filter(|&o| prefetcher.is_loaded(ObjectId(o))).collect();
        assert_eq!(prefetcher.used(), 10 * held.len() as u64);
        (steps, held)
    };
    assert_eq!(at(1), (vec![2, 1, 3, 4], vec![0, 1, 2, 3]));
    // The row of room 2 is there, and room 0 does not leave for room 4, which is not in the core.
    assert_eq!(at(2), (vec![], vec![0, 1, 2, 3]));
    // It leaves for the row of room 3.
    assert_eq!(at(3), (vec![-1, 5], vec![1, 2, 3, 4]));
    // A jump: what is seen first; all that was planned before leaves as it is needed.
    let (steps, held) = at(8);
    assert_eq!((&steps[..2], held), (&[-2, 9][..], vec![4, 6, 7, 8]));
}

#[test]
fn special_cases_have_answers() {
    let (file, culler) = finish(row(5));
    let still = Motion::default();
    // No memory: all is missing, nothing is asked for.
    let mut none = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10; 5]), 0);
    assert_eq!((none.frame(eye(&file, 2.0), &still, &objects(&[0, 1])), none.next_step()), (2, None));
    // An object that never fits keeps nothing else out.
    let mut large = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10, 50, 10, 10, 10]), 40);
    assert_eq!(large.frame(eye(&file, 2.0), &still, &objects(&[1, 0])), 2);
    assert_eq!(settle(&mut large), [1, 3, 4, 5]);
    assert_eq!(large.frame(eye(&file, 2.0), &still, &objects(&[1, 0])), 1);
    // One that can't be loaded is not asked for again, and takes no bytes.
    let mut lost = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10; 5]), 10);
    lost.frame(eye(&file, 2.0), &still, &objects(&[0, 1]));
    assert_eq!(lost.next_step(), Some(Step::Load { chunk: ChunkId(0), metres: 0.0 }));
    // While it is under way there is no room.
    assert_eq!(lost.next_step(), None);
    lost.failed(ChunkId(0));
    lost.loaded(ChunkId(0));
    lost.loaded(ChunkId(4));
    lost.frame(eye(&file, 2.0), &still, &objects(&[0, 1]));
    assert_eq!((settle(&mut lost), lost.used(), lost.is_loaded(ObjectId(0))), (vec![2], 10, false));

    // No cell, or no place at all: the last plan goes on; far off, each door is as far as it is straight.
    let mut astray = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10; 5]), 1000);
    astray.frame(Vec3::NAN, &still, &[]);
    assert_eq!(astray.next_step(), None);
    astray.frame(eye(&file, 0.5), &still, &[]);
    for (place, told) in [(Vec3::NAN, 0.0), (Vec3::INFINITY, 0.0), (eye(&file, -1.0), 3.5)] {
        astray.frame(place, &still, &[]);
        let Some(Step::Load { chunk, metres }) = astray.next_step() else { panic!("the plan is there") };
        assert!((metres - told).abs() < 1e-3, "{chunk:?}: {metres}");
    }
    // From beyond the other end: 24 m to the door at 16, which leads to the last room.
    astray.frame(eye(&file, 40.0), &still, &[]);
    let Some(Step::Load { chunk, metres }) = astray.next_step() else { panic!("two are left") };
    assert_eq!((chunk, metres.round()), (ChunkId(4), 24.0));
}

#[test]
fn doors_bar_the_way_only_where_the_client_says_so() {
    let (file, culler) = finish(row(5));
    let mut doors = Doors::open(&culler);
    let added = |doors: &Doors, barred: &[u32]| {
        let mut prefetcher = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10; 5]), 1000);
        prefetcher.set_doors(doors);
        barred.iter().for_each(|&portal| prefetcher.bar(PortalId(portal), true));
        prefetcher.frame(eye(&file, 2.0), &Motion::default(), &[]);
        settle(&mut prefetcher)
    };
    let open = added(&doors, &[]);
    assert_eq!(open, [1, 2, 3, 4, 5]);
    // The doors stand in the order of their rooms: behind the second one is room 2, whose row has room 3.
    assert_eq!(added(&doors, &[1]), [1, 2, 3]);
    (0..4).for_each(|portal| doors.set_open(PortalId(portal), false));
    assert_eq!(added(&doors, &[]), open);
}

#[test]
fn without_a_row_an_object_comes_when_it_is_seen() {
    let (b, rooms) = row(4);
    let (_, file) = b.finish_with(|_, objects| (0..rooms).for_each(|cell| objects.clear(cell, 2)));
    let culler = Culler::new(&file);
    let mut prefetcher = Prefetcher::new(&file, &culler, Chunks::of_one(vec![10; 4]), 1000);
    prefetcher.frame(eye(&file, 2.0), &Motion::default(), &[]);
    assert_eq!(settle(&mut prefetcher), [1, 2, 4]);
    prefetcher.frame(eye(&file, 2.0), &Motion::default(), &objects(&[2]));
    assert_eq!(settle(&mut prefetcher), [3]);
    // A file without rows: what is in the rooms, one after the other.
    let bare = PvsFile { object_rows: None, ..file.clone() };
    let culler = Culler::new(&bare);
    let mut prefetcher = Prefetcher::new(&bare, &culler, Chunks::of_one(vec![10; 4]), 1000);
    prefetcher.frame(eye(&file, 9.0), &Motion::default(), &[]);
    assert_eq!(settle(&mut prefetcher), [3, 2, 4, 1]);
}

/// Eyes anywhere, sets of any kind, answers in any order, an object a chunk or several: a memory that is kept beside it never holds more than the
/// budget, loses nothing that the frame sees, and the steps are the same again.
#[test]
fn the_budget_holds_whatever_happens() {
    let (file, culler) = finish(row(40));
    let mut random = Random::new(1);
    let mut sizes = |count: usize| -> Vec<u64> { (0..count).map(|_| random.below(30) as u64).collect() };
    let pairs = (0..40).map(|object| ChunkId(object / 2)).collect();
    let far_apart = (0..40).map(|object| ChunkId(object % 13)).collect();
    let cases: [(Vec<ChunkId>, Vec<u64>); 3] =
        [((0..40).map(ChunkId).collect(), sizes(40)), (pairs, sizes(20)), (far_apart, sizes(13))];
    for (of, bytes) in &cases {
        let chunks = Chunks::new(of.clone(), bytes.clone()).unwrap();
        let steps = budget_holds(&file, &culler, &chunks, (of, bytes));
        let evicted = steps.iter().filter(|step| matches!(step, Step::Evict(_))).count();
        assert!(evicted > 100, "{evicted} of {} chunks", bytes.len());
        assert!(steps == budget_holds(&file, &culler, &chunks, (of, bytes)));
    }
    let one_by_one = budget_holds(&file, &culler, &Chunks::of_one(cases[0].1.clone()), (&cases[0].0, &cases[0].1));
    let named = Chunks::new(cases[0].0.clone(), cases[0].1.clone()).unwrap();
    assert!(one_by_one == budget_holds(&file, &culler, &named, (&cases[0].0, &cases[0].1)));
    assert!(Chunks::new(vec![ChunkId(0), ChunkId(2)], vec![1, 1]).is_none());
}

fn budget_holds(file: &PvsFile, culler: &Arc<Culler>, chunks: &Chunks, (of, bytes): (&[ChunkId], &[u64])) -> Vec<Step> {
    let mut random = Random::new(7);
    let mut prefetcher = Prefetcher::new(file, culler, chunks.clone(), 150);
    let (mut held, mut under_way, mut steps) = (vec![false; bytes.len()], Vec::new(), Vec::new());
    for frame in 0..3000u32 {
        let x = if frame % 50 == 0 { random.below(170) as f64 - 5.0 } else { f64::from(frame % 50) * 0.3 };
        let seen: Vec<ObjectId> = (0..40).filter(|_| random.below(12) == 0).map(ObjectId).collect();
        let missing = prefetcher.frame(eye(file, x), &Motion::default(), &seen);
        assert_eq!(missing, seen.iter().filter(|object| !held[of[object.index()].index()]).count());
        for _ in 0..random.below(6) {
            let Some(step) = prefetcher.next_step() else { break };
            steps.push(step);
            match step {
                Step::Evict(chunk) => {
                    let is_seen = seen.iter().any(|object| of[object.index()] == chunk);
                    assert!(std::mem::take(&mut held[chunk.index()]) && !is_seen, "{chunk:?}");
                }
                Step::Load { chunk, .. } => {
                    assert!(!held[chunk.index()] && !under_way.contains(&chunk), "{chunk:?}");
                    under_way.push(chunk);
                }
            }
            let all = (0..bytes.len() as u32).map(ChunkId);
            let sum: u64 = all.filter(|c| held[c.index()] || under_way.contains(c)).map(|c| bytes[c.index()]).sum();
            assert!(sum <= 150 && sum == prefetcher.used(), "{sum}");
        }
        while !under_way.is_empty() && random.below(3) == 0 {
            let chunk: ChunkId = under_way.swap_remove(random.below(under_way.len()));
            prefetcher.loaded(chunk);
            held[chunk.index()] = true;
        }
    }
    steps
}

/// In a grid of rooms, no walk from door to door is shorter than what a load was told with.
#[test]
fn no_walk_is_shorter_than_told() {
    const SIDE: u32 = 6;
    let room = |i: u32, j: u32| CellId(j * SIDE + i);
    let middle = |cell: u32| p(4.0 * f64::from(cell % SIDE) + 2.0, 1.6, 4.0 * f64::from(cell / SIDE) + 2.0);
    let mut b = Building::default();
    for cell in 0..SIDE * SIDE {
        let m = middle(cell);
        b.cell("", vec![block(m.with_y(0.0) - p(2., 0., 2.), m.with_y(3.0) + p(2., 0., 2.))]);
        b.thing("", m.with_y(0.01) - p(0.2, 0., 0.2), m.with_y(0.5) + p(0.2, 0., 0.2));
    }
    let kind = enfilade::cells::PortalKind::Door;
    for i in 1..SIDE {
        for j in 0..SIDE {
            let (x, z) = (4.0 * f64::from(i), 4.0 * f64::from(j));
            b.portal(room(i - 1, j), room(i, j), p(x, 0., z + 0.5), p(x, 2.1, z + 1.5), kind);
            b.portal(room(j, i - 1), room(j, i), p(z + 2.5, 0., x), p(z + 3.5, 2.1, x), kind);
        }
    }
    let (_, file) = b.finish_with(|_, objects| {
        for cell in 0..(SIDE * SIDE) as usize {
            (0..(SIDE * SIDE) as usize).filter(|&object| object != cell).for_each(|object| objects.clear(cell, object));
        }
    });
    let culler = Culler::new(&file);
    let all = [1; (SIDE * SIDE) as usize];
    let mut random = Random::new(3);
    for _ in 0..200 {
        let mut cell = random.below(all.len()) as u32;
        let start = middle(cell) + p(1.8 * random.signed(), 0.0, 1.8 * random.signed());
        let mut prefetcher = Prefetcher::new(&file, &culler, Chunks::of_one(all.to_vec()), 1000);
        prefetcher.frame((start - file.origin).as_vec3(), &Motion::default(), &[]);
        let mut metres = [f32::NAN; (SIDE * SIDE) as usize];
        while let Some(Step::Load { chunk, metres: told }) = prefetcher.next_step() {
            metres[chunk.index()] = told;
        }
        let (mut at, mut walked) = (start, 0.0);
        for _ in 0..30 {
            let doors: Vec<_> = file.portals.iter().filter(|portal| portal.cells.contains(&CellId(cell))).collect();
            let door = doors[random.below(doors.len())];
            let through = door.winding.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / 4.0 + file.origin;
            let through = through.with_y(1.6);
            walked += at.distance(through);
            (at, cell) = (through, door.cells.iter().find(|c| c.0 != cell).expect("another").0);
            assert!(f64::from(metres[cell as usize]) <= walked + 1e-3, "{cell}: {} m for {walked}", metres[cell as usize]);
        }
    }
}

#[test]
fn a_walk_by_rows_misses_nothing_and_one_on_demand_does() {
    let (file, culler) = finish(row(30));
    let bytes = object_bytes(&file);
    let all: u64 = bytes.iter().sum();
    let there = (20..1180).map(|k| 0.1 * f64::from(k)).map(|x| (x, DVec3::X));
    let back = (20..1180).rev().map(|k| 0.1 * f64::from(k)).map(|x| (x, -DVec3::X));
    let frames = there.chain(back).map(|(x, looks)| PathFrame { eye: p(x, 1.6, 2.0), target: p(x, 1.6, 2.0) + looks });
    let path = CameraPath { name: String::new(), fov_y_degrees: 60.0, near: 0.1, frames: frames.collect() };
    let stroll = Stroll::along(&path, 1.4 / 60.0);
    let walk = |method, budget, bandwidth, latency| -> LoadingSummary {
        let options = LoadingOptions { budget, bandwidth, latency, aspect: 1.6 };
        let (mut frames, mut view) = (0, View::new(&culler));
        let summary =
            walk_loading(&file, (&culler, &Doors::open(&culler)), &bytes, &stroll, (method, &options), &mut |frame| {
                let drawn = frame.visible.iter().filter(|object| frame.in_memory[object.index()]).count() as u64;
                assert_eq!(drawn + frame.missing, frame.visible.len() as u64);
                assert_eq!(view.cull(&frame.camera, Mode::PortalsAndPvs).objects, frame.visible);
                let held: u64 = (0..bytes.len()).filter(|&o| frame.in_memory[o]).map(|o| bytes[o]).sum();
                assert!(held <= budget);
                frames += 1;
            });
        assert!(summary.bytes_most <= budget && summary.frames + summary.after_jumps == frames && frames > 9000);
        summary
    };
    for method in [Method::Rows, Method::OnDemand] {
        let instant = walk(method, all, f64::INFINITY, 0.0);
        assert_eq!((instant.frames_missing, instant.after_jumps, instant.jumps), (0, 0, 1), "{instant:?}");
    }
    // A fifth of it in memory, and a quarter of a second for each object: from door to door it is 2.9 s, and 1.4 s to the first.
    let slow = 4.0 * bytes[0] as f64;
    let rows = walk(Method::Rows, all / 5, slow, 0.05);
    assert_eq!((rows.frames_missing, rows.frames_over_budget), (0, 0), "{rows:?}");
    let on_demand = walk(Method::OnDemand, all / 5, slow, 0.05);
    assert!(on_demand.frames_missing > 500 && on_demand.after_jumps >= 15, "{on_demand:?}");
}
