//! The scorer of `check --rooms`, on cells whose overlap with the rooms is known by hand, and on generated buildings, whose plan is.

use enfilade::bake::BakeOptions;
use enfilade::cells::{PortalKind, SplitOptions, Strategy};
use enfilade::file::PvsFile;
use enfilade::scene::{Role, Scene};
use enfilade_measure::verify::rooms::{RoomScore, RoomsFile};
use enfilade_measure::verify::score_rooms;
use enfilade_scenes::Kind;
use serde_json::{Value, json};

use testing::bakes;
use testing::boxes::{Building, block, p};

const DEEP: f64 = 5.0;
const HIGH: f64 = 3.0;

/// Cells in a row along x, parted at `cuts`, 5 m deep and 3 m high, and the outside. A doorway from z = 2 to 3 in each cut between
/// two cells, a window in the last one's far end.
fn row(cuts: &[f64]) -> (Scene, PvsFile) {
    let mut building = Building::default();
    let ends = (cuts[0], cuts[cuts.len() - 1]);
    let cells: Vec<_> = (cuts.windows(2).enumerate())
        .map(|(i, x)| building.cell(&format!("cell {i}"), vec![block(p(x[0], 0., 0.), p(x[1], HIGH, DEEP))]))
        .collect();
    let outside = building.outside(p(ends.0, 0., 0.), p(ends.1, HIGH, DEEP));
    for (pair, &x) in cells.windows(2).zip(&cuts[1..]) {
        building.portal(pair[0], pair[1], p(x, 0., 2.), p(x, 2.1, 3.), PortalKind::Door);
    }
    building.portal(cells[cells.len() - 1], outside, p(ends.1, 1., 2.), p(ends.1, 2., 3.), PortalKind::Window);
    building.solid("ground", Role::Structure, true, p(-50., -1., -50.), p(50., 0., 50.));
    building.solid("roof", Role::Structure, true, p(-50., HIGH, -50.), p(50., HIGH + 1., 50.));
    building.finish()
}

fn rectangle(x: [f64; 2], z: [f64; 2]) -> Value {
    json!([[x[0], z[0]], [x[1], z[0]], [x[1], z[1]], [x[0], z[1]]])
}

fn room(id: &str, x: [f64; 2]) -> Value {
    json!({"id": id, "name": id, "floor_y": 0.0, "ceiling_y": HIGH, "footprint": [[rectangle(x, [0.0, DEEP])]]})
}

fn door(kind: &str, x: f64, rooms: [Option<&str>; 2]) -> Value {
    json!({"id": format!("{kind} at {x}"), "kind": kind, "centre": [x, 1.05, 2.5], "rooms": rooms})
}

fn score((scene, file): &(Scene, PvsFile), rooms: &[Value], doors: &[Value]) -> RoomScore {
    let written: RoomsFile = serde_json::from_value(json!({"rooms": rooms, "doors": doors})).unwrap();
    score_rooms(file, scene, &written).unwrap()
}

/// Rooms found of rooms, cells right of cells in rooms.
fn found(score: &RoomScore) -> [usize; 4] {
    [score.rooms_found, score.rooms, score.cells_right, score.cells]
}

fn assert_near(found: f64, expected: f64) {
    // Rooms are measured on a grid of at least 20 points along each edge here, so that a layer more or less is no matter.
    assert!((found - expected).abs() < 0.02, "{found}, known to be {expected}");
}

#[test]
fn the_same_rooms_and_doors_score_one() {
    let rooms = [room("a", [0., 4.]), room("b", [4., 9.]), room("c", [9., 12.])];
    let doors = [
        door("door", 4., [Some("a"), Some("b")]),
        door("opening", 9., [Some("c"), Some("b")]),
        json!({"id": "w", "kind": "window", "centre": [12.0, 1.5, 2.5], "rooms": [null, "c"]}),
    ];
    let score = score(&row(&[0., 4., 9., 12.]), &rooms, &doors);
    assert_eq!((found(&score), score.recall, score.precision), ([3, 3, 3, 3], 1.0, 1.0));
    assert_near(score.mean_iou, 1.0);
    assert_eq!((score.over_segmented, score.under_segmented, score.unlisted), (0, 0, 0));
    assert_eq!((score.doors.count, score.doors.located, score.doors.joining), (2, 2, 2));
    assert_eq!((score.windows.count, score.windows.located, score.windows.joining), (1, 1, 1));
    assert!(score.lost.is_empty() && score.wrong.is_empty());
}

#[test]
fn rooms_that_are_elsewhere_score_nothing() {
    let rooms = [room("a", [50., 54.]), room("b", [54., 59.]), room("c", [59., 62.])];
    let doors = [door("door", 54., [Some("a"), Some("b")]), door("door", 59., [Some("b"), Some("c")])];
    let score = score(&row(&[0., 4., 9., 12.]), &rooms, &doors);
    assert_eq!((found(&score), score.unlisted), ([0, 3, 0, 0], 3));
    assert_eq!((score.recall, score.precision, score.mean_iou), (0.0, 0.0, 0.0));
    assert_eq!((score.doors.count, score.doors.located_share, score.doors.joining_share), (2, 0.0, 0.0));
    assert_eq!(score.lost.len(), 3);
}

#[test]
fn the_intersection_over_union_is_what_it_is() {
    // 4 m of cell and 4 m of room, 3 m of them shared: 3 of 5 m.
    let score = score(&row(&[0., 4.]), &[room("a", [1., 5.])], &[]);
    assert_eq!(found(&score), [1, 1, 1, 1]);
    assert_near(score.mean_iou, 0.6);
    // 2 m shared of 6: not found, though half of the cell lies in the room.
    let other = self::score(&row(&[0., 4.]), &[room("a", [2., 6.])], &[]);
    assert_eq!((found(&other), other.lost[0].cell.is_some()), ([0, 1, 0, 1], true));
    assert_near(other.lost[0].iou, 1.0 / 3.0);
}

#[test]
fn a_room_that_cells_cut_up_is_over_segmented() {
    let score = score(&row(&[0., 4., 8., 12.]), &[room("all", [0., 12.])], &[]);
    assert_eq!((found(&score), score.over_segmented, score.under_segmented), ([0, 1, 0, 3], 1, 0));
    assert_near(score.mean_iou, 1.0 / 3.0);
    let halves: Vec<f64> = score.wrong.iter().map(|w| w.rooms[0].1).collect();
    assert_eq!(halves.len(), 3);
    halves.into_iter().for_each(|share| assert_near(share, 1.0 / 3.0));
    // One of two is large enough to find it; the other is a cell too many.
    let score = self::score(&row(&[0., 4., 10.]), &[room("all", [0., 10.])], &[]);
    assert_eq!((found(&score), score.recall, score.precision), ([1, 1, 1, 2], 1.0, 0.5));
}

#[test]
fn a_cell_over_several_rooms_is_under_segmented() {
    let parts = [room("a", [0., 4.]), room("b", [4., 8.]), room("c", [8., 12.])];
    let between = [door("door", 4., [Some("a"), Some("b")])];
    let score = score(&row(&[0., 12.]), &parts, &between);
    assert_eq!((found(&score), score.over_segmented, score.under_segmented), ([0, 3, 0, 1], 0, 1));
    // Nothing joins two cells where there is one.
    assert_eq!((score.doors.count, score.doors.located, score.doors.joining), (1, 0, 0));
    // 5 of 9 m: that room is found, the other is lost.
    let score = self::score(&row(&[0., 9.]), &[room("a", [0., 4.]), room("b", [4., 9.])], &[]);
    assert_eq!((found(&score), score.under_segmented, score.lost[0].id.as_str()), ([1, 2, 1, 1], 1, "a"));
}

#[test]
fn rooms_parted_by_a_virtual_boundary_are_one_cell_or_several() {
    let rooms = [room("a", [0., 4.]), room("b", [4., 8.]), room("c", [8., 12.])];
    let doors = [door("virtual", 4., [Some("a"), Some("b")]), door("door", 8., [Some("b"), Some("c")])];
    for (cuts, cells) in [(&[0., 8., 12.][..], 2), (&[0., 4., 8., 12.][..], 3)] {
        let score = score(&row(cuts), &rooms, &doors);
        assert_eq!((found(&score), score.over_segmented, score.under_segmented), ([3, 3, cells, cells], 0, 0), "{cuts:?}");
        assert_near(score.mean_iou, 1.0);
        assert_eq!((score.doors.count, score.doors.joining), (1, 1), "{cuts:?}: a virtual boundary is no door");
    }
    // A door drawn on the boundary itself asks for a portal only where there are two cells.
    let doors = [door("virtual", 4., [Some("a"), Some("b")]), door("opening", 4., [Some("a"), Some("b")])];
    assert_eq!(score(&row(&[0., 8., 12.]), &rooms, &doors).doors.count, 0);
    let two = score(&row(&[0., 4., 8., 12.]), &rooms, &doors).doors;
    assert_eq!((two.count, two.joining), (1, 1));
    // It parts a and b only: a cell over all three merges c with them, and finds them (8 of 12 m).
    let all = score(&row(&[0., 12.]), &rooms, &doors);
    assert_eq!((found(&all), all.under_segmented, all.lost[0].id.as_str()), ([2, 3, 1, 1], 1, "c"));
}

#[test]
fn rooms_over_each_other_may_be_one_cell_too() {
    let mut building = Building::default();
    building.cell("hall", vec![block(p(0., 0., 0.), p(4., 6., 5.))]);
    building.outside(p(0., 0., 0.), p(4., 6., 5.));
    building.solid("ground", Role::Structure, true, p(-10., -1., -10.), p(10., 0., 10.));
    building.solid("roof", Role::Structure, true, p(-10., 6., -10.), p(10., 7., 10.));
    let made = building.finish();
    let mut upper = room("upper", [0., 4.]);
    (upper["floor_y"], upper["ceiling_y"]) = (json!(3.0), json!(6.0));
    let rooms = json!([room("lower", [0., 4.]), upper]);
    let void = |kind: &str| json!([{"kind": kind, "bbox": [1.0, 2.9, 1.0, 3.0, 3.1, 4.0]}]);
    let score = |kind| {
        let written = serde_json::from_value(json!({"rooms": rooms, "voids": void(kind)})).unwrap();
        score_rooms(&made.1, &made.0, &written).unwrap()
    };
    let parted = score("virtual_boundary");
    assert_eq!((found(&parted), parted.under_segmented), ([2, 2, 1, 1], 0));
    assert_near(parted.mean_iou, 1.0);
    // A hole in a slab for a stair leaves two rooms.
    assert_eq!(score("stair").under_segmented, 1);
}

#[test]
fn a_door_is_located_within_60_cm_and_joins_the_cells_of_its_rooms() {
    let rooms = [room("a", [0., 4.]), room("b", [4., 9.]), room("c", [9., 12.])];
    let one = |at: [f64; 3], kind: &str, sides: [Option<&str>; 2]| {
        let door = json!({"id": "d", "kind": kind, "centre": at, "rooms": sides});
        let score = score(&row(&[0., 4., 9., 12.]), &rooms, &[door]);
        let all = if kind == "window" { score.windows } else { score.doors };
        (all.count, all.located, all.joining)
    };
    let (a, b, c) = (Some("a"), Some("b"), Some("c"));
    assert_eq!(one([4.0, 1.05, 3.09], "door", [a, b]), (1, 1, 1));
    assert_eq!(one([4.0, 1.05, 3.11], "door", [a, b]), (1, 0, 0));
    assert_eq!(one([4.0, 1.05, 2.5], "door", [b, a]), (1, 1, 1), "either way round");
    assert_eq!(one([4.0, 1.05, 2.5], "door", [a, c]), (1, 1, 0));
    assert_eq!(one([9.0, 1.05, 2.5], "door", [None, a]), (1, 1, 0));
    assert_eq!(one([9.0, 1.05, 2.5], "door", [None, b]), (1, 1, 1));
    assert_eq!(one([12.0, 1.5, 2.5], "window", [c, None]), (1, 1, 1));
    assert_eq!(one([12.0, 1.5, 2.5], "window", [None, None]), (0, 0, 0), "of no room that was written down");
}

#[test]
fn the_open_air_is_not_scored() {
    let mut yard = room("yard", [12., 20.]);
    yard["covered"] = json!(0.3);
    let rooms = [room("a", [0., 4.]), room("b", [4., 9.]), room("c", [9., 12.]), yard.clone()];
    let built = row(&[0., 4., 9., 12.]);
    assert_eq!(found(&score(&built, &rooms, &[])), [3, 3, 3, 3]);
    yard["covered"] = json!(0.6);
    assert_eq!(found(&score(&built, &[yard], &[])), [0, 1, 0, 0]);
}

#[test]
fn a_footprint_has_holes_and_a_solid_stands_for_what_is_no_prism() {
    // A yard of 2 x 3 m in a room of 4 x 5 m: 14 of the cell's 20 m2 are the room's.
    let mut ring = room("ring", [0., 4.]);
    ring["footprint"] = json!([[rectangle([0., 4.], [0., DEEP]), rectangle([1., 3.], [1., 4.])]]);
    assert_near(score(&row(&[0., 4.]), &[ring], &[]).mean_iou, 0.7);
    // A tent: half of the box.
    let mut tent = room("tent", [0., 4.]);
    tent["solid"] = json!({
        "v": [[0, 0, 0], [4, 0, 0], [4, 0, 5], [0, 0, 5], [2, 3, 0], [2, 3, 5]],
        "t": [[0, 1, 2], [0, 2, 3], [0, 4, 1], [3, 2, 5], [0, 3, 5], [0, 5, 4], [1, 4, 5], [1, 5, 2]],
    });
    assert_near(score(&row(&[0., 4.]), &[tent], &[]).mean_iou, 0.5);
}

/// Cells found by walls alone, scored against the plan that the building was made from.
fn generated(kind: Kind) -> RoomScore {
    let (made, scene) = bakes::generated(kind, 3);
    let split = SplitOptions { strategy: Some(Strategy::Plan), ..SplitOptions::default() };
    let file = bakes::baked(&scene, BakeOptions { split, ..bakes::with_rays(0) });
    score_rooms(&file, &scene, &serde_json::from_value(made.rooms).unwrap()).unwrap()
}

/// Every room and every door, and no cell but those of rooms.
fn assert_perfect(kind: Kind) {
    let score = generated(kind);
    assert!(score.rooms > 3 && score.doors.count > 3, "{kind:?}: {score:?}");
    assert_eq!((score.recall, score.precision), (1.0, 1.0), "{kind:?}: {score:#?}");
    assert_eq!((score.over_segmented, score.under_segmented, score.unlisted), (0, 0, 0), "{kind:?}: {score:#?}");
    let shares = [&score.doors, &score.windows].map(|o| (o.located_share, o.joining_share));
    assert_eq!(shares, [(1.0, 1.0); 2], "{kind:?}: {score:#?}");
    assert!(score.mean_iou > 0.9, "{kind:?}: {}", score.mean_iou);
}

#[test]
fn generated_buildings_have_their_rooms_and_doors() {
    for kind in [
        Kind::Office { rooms: 24, storeys: Some(1), furnished: false },
        Kind::Office { rooms: 40, storeys: Some(3), furnished: true },
        Kind::Gallery { rooms: 20 },
        Kind::Maze { rooms: 30 },
    ] {
        assert_perfect(kind);
    }
}
