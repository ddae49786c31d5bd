//! Holes of hand-made houses, as lines of known length; houses without any.

use enfilade::CellId;
use enfilade::bake::BakeOptions;
use enfilade::cells::{SplitOptions, Strategy, read_cells};
use enfilade::file::PvsFile;
use enfilade::scene::{ImportOptions, Role, RoomHint, Scene};
use enfilade_formats::import;
use enfilade_measure::verify::{CheckOptions, CheckReport, Leak, LeakKind, check};
use glam::{DVec3, dvec3 as v};
use serde_json::Value;
use testing::bakes;
use testing::meshes::{builder, cuboid, obj, quads, sides};
use testing::solids::{Box3, less};

use crate::cli::{done, enfilade, folder, run_words, text};

const LONG: f64 = 8.15;
const DEEP: f64 = 5.0;
const HIGH: f64 = 2.8;
const WALL: f64 = 0.3;

/// Two rooms of 4 x 5 m along x, 2.8 m high, with a doorway between; outer walls of 0.3 m, slabs of 0.2 m. `holes` are cut out of
/// every box that they meet.
fn house(holes: &[Box3], roof: bool) -> Vec<Box3> {
    let (x, z) = (LONG, DEEP);
    let mut boxes = vec![
        [v(-WALL, 0., -WALL), v(0., HIGH, z + WALL)],
        [v(x, 0., -WALL), v(x + WALL, HIGH, z + WALL)],
        [v(0., 0., -WALL), v(x, HIGH, 0.)],
        [v(0., 0., z), v(x, HIGH, z + WALL)],
        [v(-WALL, -0.2, -WALL), v(x + WALL, 0., z + WALL)],
        [v(4., 0., 0.), v(4.15, HIGH, 2.)],
        [v(4., 0., 2.9), v(4.15, HIGH, z)],
        [v(4., 2.1, 2.), v(4.15, HIGH, 2.9)],
    ];
    if roof {
        boxes.push([v(-WALL, HIGH, -WALL), v(x + WALL, HIGH + 0.2, z + WALL)]);
    }
    holes.iter().fold(boxes, |boxes, &hole| boxes.into_iter().flat_map(|s| less(s, hole)).collect())
}

fn scene(boxes: &[Box3], rooms: Vec<RoomHint>) -> Scene {
    let mut builder = builder();
    for (i, &[min, max]) in boxes.iter().enumerate() {
        builder.add(quads(&format!("box {i}"), Role::Structure, true, &sides(min, max))).unwrap();
    }
    builder.hints.rooms = rooms;
    builder.finish("house").unwrap()
}

fn checked(scene: &Scene, strategy: Strategy) -> (PvsFile, CheckReport) {
    let split = SplitOptions { strategy: Some(strategy), ..SplitOptions::default() };
    checked_as(scene, BakeOptions { split, ..bakes::with_rays(0) })
}

fn checked_as(scene: &Scene, options: BakeOptions) -> (PvsFile, CheckReport) {
    let file = bakes::baked(scene, options);
    let report =
        check(&file, scene, &CheckOptions { rays: 20_000, views: 0, leaks: true, ..CheckOptions::default() }).unwrap();
    assert_eq!((report.missed_segments, report.structure.count), (0, 0), "{:?}", report.structure);
    assert_eq!(report.free_outside_cells.outside, 0, "{:?}", report.free_outside_cells);
    (file, report)
}

/// The only leak.
fn leak(report: &CheckReport) -> &Leak {
    let leaks = report.leaks.as_ref().expect("asked for");
    assert_eq!((leaks.leaks.len(), leaks.leak_count), (1, 1), "{leaks:?}");
    &leaks.leaks[0]
}

fn assert_length(leak: &Leak, expected: f64) {
    let sum: f64 = leak.points.windows(2).map(|w| w[0].distance(w[1])).sum();
    assert!((sum - leak.length).abs() < 1e-9 * sum, "{} for points {sum} long", leak.length);
    assert!((leak.length - expected).abs() <= 0.01 * expected, "{} m, known to be {expected} m: {leak:?}", leak.length);
}

const BRICK: Box3 = [DVec3::new(LONG - 0.1, 1.0, 2.0), DVec3::new(LONG + 0.4, 1.1, 2.25)];

#[test]
fn a_closed_house_has_no_leak() {
    let (file, report) = checked(&scene(&house(&[], true), Vec::new()), Strategy::Plan);
    assert_eq!(file.cells.len(), 3, "two rooms and the outside");
    assert_eq!(report.leaks.map(|l| l.leak_count), Some(0));
}

#[test]
fn the_line_goes_through_the_missing_brick() {
    let scene = scene(&house(&[BRICK], true), Vec::new());
    let (file, report) = checked(&scene, Strategy::Plan);
    let leak = leak(&report);
    assert_eq!((leak.kind, leak.portals.is_empty()), (LeakKind::Opening, false));
    assert!(!file.cells[leak.from_cell.index()].open);
    let start = leak.points[0];
    assert!(start.x > 4.15 && start.x < LONG, "it begins in the second room: {start}");
    // Straight to the near end of the brick, then straight out.
    let (a, b) = (BRICK[0].with_x(LONG), BRICK[1].with_x(LONG));
    assert_length(leak, start.distance(start.clamp(a, b)) + WALL);
    let end = leak.points[leak.points.len() - 1];
    assert!((end.x - (LONG + WALL)).abs() < 1e-3, "beyond the wall: {end}");
    for w in leak.points.windows(2).filter(|w| w[0].x.min(w[1].x) < LONG + 0.1 && w[0].x.max(w[1].x) > LONG) {
        let at = w[0].lerp(w[1], ((LONG + 0.1 - w[0].x) / (w[1].x - w[0].x)).clamp(0.0, 1.0));
        assert!(at.cmpge(BRICK[0]).all() && at.cmple(BRICK[1]).all(), "through the brick: {at}");
    }
}

#[test]
fn the_line_goes_up_the_chimney() {
    // A flue of 0.4 m square in the roof, 2 m high, walls of 0.1 m.
    let (a, b, top) = (v(5.8, HIGH - 0.1, 0.8), v(6.2, HIGH + 3.0, 1.2), HIGH + 0.2 + 2.0);
    let mut boxes = house(&[], true);
    boxes.push([v(5.7, HIGH + 0.2, 0.7), v(6.3, top, 1.3)]);
    let hole = [a, b];
    let boxes: Vec<Box3> = boxes.into_iter().flat_map(|s| less(s, hole)).collect();
    let (_, report) = checked(&scene(&boxes, Vec::new()), Strategy::Plan);
    let leak = leak(&report);
    let start = leak.points[0];
    let foot = start.clamp(hole[0], hole[1]).with_y(HIGH);
    assert_length(leak, start.distance(foot) + top - HIGH);
}

/// A room's surface as its author drew it.
fn room(name: &str, solid: Box3, outside: bool) -> RoomHint {
    let surface = cuboid(solid[0], solid[1]);
    RoomHint { id: name.into(), name: name.into(), storey: None, surface, outside, drawn: true }
}

#[test]
fn a_room_without_a_roof_leaks_upwards() {
    let boxes = house(&[], false);
    let drawn = || {
        let rooms = [("west", 0.0, 4.0), ("east", 4.15, LONG)];
        rooms.map(|(name, x0, x1)| room(name, [v(x0, 0., 0.), v(x1, HIGH, DEEP)], false)).to_vec()
    };
    // With the author's rooms, both are open cells, as a room under the sky is: the audit says so.
    let (file, report) = checked(&scene(&boxes, drawn()), Strategy::Authored);
    assert!(file.cells.len() == 3 && file.cells.iter().all(|c| c.open), "{:?}", report.leaks);
    assert!(report.leaks.unwrap().leaks.is_empty());
    // By walls alone each of them leaks, straight up from where its line begins.
    let (_, report) = checked(&scene(&boxes, drawn()), Strategy::Plan);
    let leaks = report.leaks.unwrap().leaks;
    assert_eq!(leaks.len(), 2, "{leaks:?}");
    for leak in &leaks {
        let start = leak.points[0];
        assert!(start.y > 0.0 && start.y < HIGH, "it begins in a room: {leak:?}");
        assert_length(leak, HIGH - start.y);
    }
    let in_west = |leak: &&Leak| leak.points[0].x > 0.0 && leak.points[0].x < 4.0;
    assert_eq!(leaks.iter().filter(in_west).count(), 1, "one of each room: {leaks:?}");
    // In cells that leave them to the outside, the rooms that the author drew tell of it.
    let scene = scene(&boxes, drawn());
    let sky = read_cells(r#"{"cells": [{"id": 0, "open": true, "pieces": [{"planes": [[0, 1, 0, 1000]]}]}]}"#, &scene);
    let (file, report) = checked_as(&scene, BakeOptions { given: Some(sky.unwrap()), ..bakes::with_rays(0) });
    let leaks = report.leaks.unwrap().leaks;
    assert_eq!((file.cells.len(), leaks.len()), (1, 2), "{leaks:?}");
    assert!(leaks.iter().all(|l| l.kind == LeakKind::Room && l.from_cell == CellId(0)));
    leaks.iter().for_each(|leak| assert_length(leak, HIGH / 2.0));
}

#[test]
fn an_authors_open_air_is_no_leak() {
    let boxes = house(&[], false);
    let rooms = vec![
        room("west", [v(0., 0., 0.), v(4., HIGH, DEEP)], true),
        room("east", [v(4.15, 0., 0.), v(LONG, HIGH, DEEP)], true),
    ];
    let (_, report) = checked(&scene(&boxes, rooms), Strategy::Authored);
    assert_eq!(report.leaks.map(|l| l.leak_count), Some(0));
}

#[test]
fn the_command_writes_lines_and_fails_where_there_are_any() {
    let folder = folder("leaks");
    for (name, holes, exit) in [("whole", &[][..], 0), ("brick", &[BRICK][..], 1)] {
        let at = |extension: &str| folder.join(name).with_extension(extension);
        let boxes = house(holes, true).into_iter().enumerate();
        let named = boxes.map(|(i, [min, max])| (format!("box {i}"), min.into(), max.into()));
        std::fs::write(at("obj"), obj(&named.collect::<Vec<_>>())).unwrap();
        assert!(import(&at("obj"), &ImportOptions::default()).is_ok());
        done(&enfilade!("bake", &at("obj"), "--rays", "0"));
        let lines = folder.join(format!("{name}-leaks.obj"));
        let (model, file) = (at("obj"), at("pvs"));
        let few = ["--rays", "10000", "--views", "0"];
        let words = ["check", text(&file), "--model", text(&model), "--json", "--leak", text(&lines)];
        let out = run_words(&[&words[..], &few].concat());
        assert_eq!(out.status.code(), Some(exit), "{}", String::from_utf8_lossy(&out.stderr));
        let report: Value = serde_json::from_slice(&out.stdout).unwrap();
        let leaks = report["leaks"].as_array().unwrap();
        assert_eq!(leaks.len() as i32, exit);
        let written = std::fs::read_to_string(&lines).unwrap();
        let points: Vec<&str> = written.lines().filter(|l| l.starts_with("v ")).collect();
        let expected: usize = leaks.iter().map(|l| l["points"].as_array().unwrap().len()).sum();
        assert_eq!(points.len(), expected);
        if let Some(leak) = leaks.first() {
            for key in ["kind", "length", "from_cell", "portals", "points"] {
                assert!(!leak[key].is_null(), "{key}");
            }
            assert_eq!((leak["kind"].as_str(), written.lines().next()), (Some("opening"), Some("o leak_0")));
            let numbers: Vec<String> = (1..=expected).map(|i| i.to_string()).collect();
            assert_eq!(written.lines().last(), Some(format!("l {}", numbers.join(" ")).as_str()));
            let first = leak["points"][0].as_array().unwrap();
            assert_eq!(points[0], format!("v {} {} {}", first[0], first[1], first[2]));
        }
    }
}
