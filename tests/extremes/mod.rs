//! Stiff and extreme scenes, each with a known answer: the bounds hold it, no pixel is missed, the bytes don't depend on threads, and
//! neither moving, turning nor scaling changes what is known. Ignored tests (`just torture`) are the large ones.

mod judge;
mod scenes;
mod windings;
mod world;

use self::judge::{Effort, Row, flowed, judge, settle, table};
use self::scenes::*;
use self::world::{Known, Motion, World};
use enfilade::BitMatrix;
use enfilade::bake::BakeOptions;
use enfilade::file::Bounds;
use glam::{DQuat, DVec3};
use std::io::Write;
use std::time::Instant;
use testing::bakes;

const SHORT: Effort = Effort { rays: 60_000, checked: 20_000, frames: 6, pixels: true, threads: true, memory: 8 << 30 };

/// Turned by odd angles, 10,000 km away, from sizes of 1e-4 m to 1e6 m and more.
fn motions() -> [Motion; 4] {
    let turn = DQuat::from_axis_angle(DVec3::new(0.36, 0.48, 0.8).normalize(), 0.7345);
    [
        Motion { name: "turned and moved", turn, scale: 1.0, shift: DVec3::new(123.4, -77.7, 987.6) },
        Motion { name: "1e7 m away", turn: DQuat::IDENTITY, scale: 1.0, shift: DVec3::new(1e7, 0.0, -1e7) },
        Motion { name: "a hundred thousand times", turn: DQuat::IDENTITY, scale: 1e5, shift: DVec3::ZERO },
        Motion { name: "a hundred thousandth, turned", turn, scale: 1e-5, shift: DVec3::ZERO },
    ]
}

fn short() -> Vec<World> {
    let cracked = World { crack: 1e-7, name: "cracks of 1e-7 m", auto: true, ..cycle("") };
    let doubled = World { doubled: true, name: "doubled walls", auto: true, ..cycle("") };
    let junctions = World { junctions: true, name: "T-junctions", auto: true, ..cycle("") };
    let thin = World { fov: 1e-5, name: "a field of view of 1e-5 degrees", auto: false, ..on_the_threshold() };
    let wide = World { fov: 179.9, name: "a field of view of 179.9 degrees", auto: false, ..on_the_threshold() };
    let near = World { near: 50.0, name: "a near plane beyond the walls", auto: false, ..on_the_threshold() };
    vec![
        keyhole(1000.0, 0.005),
        keyhole_and_a_way_round("a keyhole into 1 km and a way round", 1000.0),
        keyhole_and_a_way_round("a keyhole into 300 m and a way round", 300.0),
        row("40 doors in line", 40, 0.8, true),
        row("40 doors out of line", 40, 0.8, false),
        slits("slits that pass a line by 1 mm", 1.019, Known::Visible),
        slits("slits that pass a line by 0.1 mm, less than is promised", 1.0199, Known::Narrow),
        slits("slits that pass none by 0.1 mm", 1.0201, Known::Hidden),
        turned_slits(),
        hole_and_gate(),
        on_the_threshold(),
        thin,
        wide,
        near,
        cycle("a cycle of walls without thickness"),
        cracked,
        doubled,
        junctions,
        spiral(3),
        cell_in_a_cell(),
        doors(40),
    ]
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn every_extreme_scene_keeps_its_answers() {
    let mut rows: Vec<Row> = Vec::new();
    for (i, world) in short().into_iter().enumerate() {
        rows.push(judge(&world, &Motion::NONE, true, SHORT));
        // All motions of all worlds take a minute; here each world has one of them.
        let motion = &motions()[i % 4];
        rows.push(judge(&world, motion, true, Effort { threads: false, ..SHORT }));
        if world.auto {
            rows.push(judge(&world, &Motion::NONE, false, SHORT));
        }
    }
    table(&rows);
    settle(&rows);
    assert!(rows.iter().map(|r| r.known).sum::<usize>() > 100 && rows.iter().all(|r| r.frames > 0));
}

/// Portals know of no axes. Objects are boxes along them, so that their rows stay the same where nothing is turned.
#[test]
fn what_portals_leave_is_the_same_wherever_a_scene_stands() {
    for world in short() {
        let before = flowed(&world, &Motion::NONE);
        for motion in motions() {
            let after = flowed(&world, &motion);
            let what = format!("{}, {}", world.name, motion.name);
            assert_eq!(differ(&before.cells_upper, &after.cells_upper), [], "{what}: cells");
            if motion.turn == DQuat::IDENTITY {
                assert_eq!(differ(&before.objects_upper, &after.objects_upper), [], "{what}: objects");
            }
        }
    }
}

fn differ(a: &BitMatrix, b: &BitMatrix) -> Vec<(usize, usize)> {
    let pairs = (0..a.rows()).flat_map(|r| (0..a.columns()).map(move |c| (r, c)));
    pairs.filter(|&(r, c)| a.get(r, c) != b.get(r, c)).collect()
}

#[test]
#[ignore = "long; `just torture` runs it"]
fn every_extreme_scene_in_every_place() {
    let worlds = short();
    let places =
        |world| motions().map(|motion| judge(world, &motion, true, Effort { rays: 1_000_000, checked: 200_000, ..SHORT }));
    let rows: Vec<Row> = worlds.iter().flat_map(places).collect();
    table(&rows);
    settle(&rows);
}

/// What is undecided, by how long was looked. What one bake witnesses no other proves hidden.
#[test]
#[ignore = "long; `just torture` runs it"]
fn error_against_run_time() {
    let mut text = String::from("| scene | undecided of not hidden, after seconds |\n| --- | --- |\n");
    for world in short() {
        let scene = world.scene(&Motion::NONE);
        let mut known: Vec<Bounds> = Vec::new();
        text += &format!("| {} |", world.name);
        for rays in [0, 3_000, 30_000, 300_000, 3_000_000] {
            let given = Some(world.graph(&scene, &Motion::NONE));
            let begin = Instant::now();
            let file = bakes::baked(&scene, BakeOptions { keep_bounds: true, given, ..bakes::with_rays(rays) });
            let seconds = begin.elapsed().as_secs_f64();
            let undecided = file.pairs.upper - file.pairs.lower;
            text += &format!(" {undecided} of {}, {seconds:.2} s;", file.pairs.upper);
            known.push(file.bounds.expect("kept"));
        }
        text += " |\n";
        for (a, b) in known.iter().flat_map(|a| known.iter().map(move |b| (a, b))) {
            assert_eq!(a.objects_lower.first_outside(&b.objects_upper), None, "{}", world.name);
            assert_eq!(a.cells_lower.first_outside(&b.cells_upper), None, "{}", world.name);
        }
    }
    std::io::stderr().write_all(text.as_bytes()).unwrap();
}

#[test]
#[ignore = "long; `just torture` runs it"]
fn long_rows_and_many_doors_stay_bounded() {
    let long = Effort { rays: 300_000, checked: 200_000, frames: 4, ..SHORT };
    // Matrices over 100,000 cells count as 15 GiB, of which little is ever written to.
    let huge = Effort { pixels: false, threads: false, memory: 32 << 30, ..long };
    let of = |world: World, effort| {
        let row = judge(&world, &Motion::NONE, true, effort);
        table(std::slice::from_ref(&row));
        row
    };
    let rows = [
        of(row("a mile of 2,000 doors", 2001, 0.8, true), Effort { threads: false, ..long }),
        of(row("a mile of 2,000 doors out of line", 2001, 0.8, false), long),
        of(doors(5000), Effort { threads: false, ..long }),
        of(row("100,000 cells in a row", 100_000, 4.0, false), huge),
    ];
    settle(&rows);
}
