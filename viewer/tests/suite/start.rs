//! Where a visit begins, by hand and in real models: a person fits there, stands on a floor, in the room that anybody would choose. What
//! is free is measured here on every triangle, slice by slice; nothing of that is the viewer's.

use crate::common::body::{EYE, corners, free, free_and_on_a_floor, nearest_beside};
use crate::common::{building, made, quickly_baked};
use enfilade::file::FileCell;
use enfilade::scene::{Role, Scene};
use enfilade::{BitMatrix, CellId, cells::PortalKind};
use enfilade_viewer::building::Building;
use enfilade_viewer::collision::Solid;
use enfilade_viewer::start::start;
use glam::{DVec2, DVec3};
use testing::boxes::{self, block, p};
use testing::data::data;
use testing::meshes::cuboid;

/// Where a visit begins, in the model's own coordinates, and where it looks.
fn begun(building: &Building) -> (DVec3, DVec3) {
    let (eye, along) = start(building, &Solid::new(&building.scene));
    assert!(eye.is_finite() && (along.length() - 1.0).abs() < 1e-9, "{eye} {along}");
    (eye + building.scene.origin, along)
}

/// A room of slabs and walls, 0.2 m thick, around free space.
fn walls(house: &mut boxes::Building, min: DVec3, max: DVec3) {
    let (low, high) = (min - 0.2, max + 0.2);
    for axis in 0..3 {
        let (mut below, mut above) = (high, low);
        (below[axis], above[axis]) = (min[axis], max[axis]);
        house.mesh("wall", Role::Structure, true, cuboid(low, below));
        house.mesh("wall", Role::Structure, true, cuboid(above, high));
    }
}

/// Walls, and the cell that they are around.
fn room(house: &mut boxes::Building, name: &str, min: DVec3, max: DVec3) -> CellId {
    walls(house, min, max);
    house.cell(name, vec![block(min, max)])
}

#[test]
fn a_table_in_the_middle_is_walked_around() {
    let mut house = boxes::Building::default();
    room(&mut house, "room", p(0.0, 0.0, 0.0), p(6.0, 2.7, 5.0));
    house.thing("table", p(1.5, 0.0, 1.2), p(4.5, 0.75, 3.8));
    let house = made(house);
    let (eye, along) = begun(&house);
    assert!((eye.y - EYE).abs() < 1e-6, "{eye}");
    free_and_on_a_floor("table", &house.scene, eye);
    // On none of the sides is there room behind: who stands there looks over the table, or along it.
    let ahead = eye + along * 2.0;
    assert!((0.0..6.0).contains(&ahead.x) && (0.0..5.0).contains(&ahead.z), "{eye} looks at a wall: {along}");
    assert_eq!(begun(&house), (eye, along), "the same input, another place");
}

#[test]
fn a_kitchen_full_of_counters_leaves_its_floor() {
    let mut house = boxes::Building::default();
    room(&mut house, "kitchen", p(0.0, 0.0, 0.0), p(3.4, 2.5, 3.0));
    // Along three walls, and a block that is too large for anybody within to be near to its sides.
    house.thing("counter", p(0.0, 0.0, 0.0), p(3.4, 0.9, 0.6));
    house.thing("cupboard", p(0.0, 0.0, 0.6), p(0.6, 2.2, 3.0));
    house.thing("block", p(1.6, 0.0, 0.6), p(3.4, 0.9, 3.0));
    let house = made(house);
    let (eye, _) = begun(&house);
    free_and_on_a_floor("kitchen", &house.scene, eye);
    assert!((1.0..1.2).contains(&eye.x) && (1.0..=2.6).contains(&eye.z), "{eye}");
}

#[test]
fn nobody_begins_in_a_plenum() {
    let mut house = boxes::Building::default();
    let rooms = [(0.0, 5.0), (5.2, 10.0)].map(|(a, b)| room(&mut house, "room", p(a, 0.0, 0.0), p(b, 2.6, 4.0)));
    // Larger than each room, high enough to stand in, full of pipes.
    room(&mut house, "plenum", p(0.0, 2.8, 0.0), p(10.0, 4.9, 4.0));
    house.portal(rooms[0], rooms[1], p(5.1, 0.0, 1.0), p(5.1, 2.1, 2.0), PortalKind::Door);
    for i in 0..9 {
        let x = 0.5 + f64::from(i);
        house.solid("pipe", Role::Furnishing, true, p(x, 4.6, 0.0), p(x + 0.2, 4.8, 4.0));
    }
    let house = made(house);
    let (eye, _) = begun(&house);
    assert!(free_and_on_a_floor("plenum", &house.scene, eye).abs() < 1e-6, "{eye}");
}

#[test]
fn a_hall_is_begun_on_its_floor_and_not_on_its_ceiling() {
    let mut house = boxes::Building::default();
    // The author drew one space from slab to slab; a hung ceiling divides it, and a pillar stands in the middle.
    room(&mut house, "hall", p(0.0, 0.0, 0.0), p(8.0, 6.0, 8.0));
    house.solid("ceiling", Role::Structure, true, p(0.0, 3.0, 0.0), p(8.0, 3.05, 8.0));
    house.solid("pillar", Role::Structure, true, p(3.7, 0.0, 3.7), p(4.3, 3.0, 4.3));
    let house = made(house);
    let (eye, _) = begun(&house);
    assert!(free_and_on_a_floor("hall", &house.scene, eye).abs() < 1e-6, "{eye}");
}

#[test]
fn a_room_with_a_name_comes_before_a_larger_one_without() {
    let mut house = boxes::Building::default();
    room(&mut house, "cell 0", p(0.0, 0.0, 0.0), p(12.0, 2.7, 9.0));
    room(&mut house, "office", p(12.4, 0.0, 0.0), p(15.0, 2.7, 3.0));
    let mut house = made(house);
    assert!(begun(&house).0.x < 12.0, "of two without a name, the larger");
    house.file.cells[1].source = Some("office-room".into());
    let (eye, _) = begun(&house);
    free_and_on_a_floor("named", &house.scene, eye);
    assert!((12.4..15.0).contains(&eye.x), "{eye}");
}

#[test]
fn a_furnished_room_comes_before_a_larger_bare_one() {
    let mut house = boxes::Building::default();
    room(&mut house, "bare", p(0.0, 0.0, 0.0), p(7.0, 2.7, 6.0));
    room(&mut house, "furnished", p(7.4, 0.0, 0.0), p(11.0, 2.7, 4.0));
    house.thing("desk", p(7.4, 0.0, 1.0), p(8.2, 0.75, 2.6));
    // Beams are no furniture; nor is what reaches from room to room.
    for i in 0..6 {
        let x = 0.5 + f64::from(i);
        house.mesh("beam", Role::Structure, true, cuboid(p(x, 2.5, 0.0), p(x + 0.2, 2.7, 6.0)));
    }
    house.solid("railing", Role::Furnishing, true, p(6.5, 0.9, 5.0), p(7.5, 1.0, 5.1));
    let house = made(house);
    let (eye, _) = begun(&house);
    free_and_on_a_floor("furnished", &house.scene, eye);
    assert!((7.4..11.0).contains(&eye.x), "{eye}");
}

#[test]
fn stairs_are_no_room_to_begin_in() {
    let mut house = boxes::Building::default();
    let stairs = room(&mut house, "stairs", p(0.0, 0.0, 0.0), p(3.0, 5.0, 6.0));
    let room = room(&mut house, "room", p(3.2, 0.0, 0.0), p(6.0, 2.7, 3.0));
    house.portal(stairs, room, p(3.1, 0.0, 1.0), p(3.1, 2.1, 2.0), PortalKind::Door);
    for i in 0..10 {
        let step = f64::from(i);
        house.solid(
            "flight",
            Role::Stair,
            true,
            p(0.0, 0.0, 1.5 + 0.3 * step),
            p(3.0, 0.18 * (step + 1.0), 1.8 + 0.3 * step),
        );
    }
    let mut house = made(house);
    house.file.cells.iter_mut().for_each(|cell| cell.source = Some(cell.name.clone()));
    let (eye, _) = begun(&house);
    free_and_on_a_floor("stairs", &house.scene, eye);
    assert!(eye.x > 3.2, "{eye}");
}

#[test]
fn a_visit_begins_within_a_level_whose_walls_show_one_side() {
    // A hall whose faces show their fronts to who is in it, and around it, within a larger shell, what shows backs only: rock.
    let (low, high) = (p(0.0, 0.0, 0.0), p(8.0, 4.0, 8.0));
    let (below, above) = (p(-20.0, -1.0, -20.0), p(20.0, 5.0, 20.0));
    let mut level = boxes::Building::default();
    level.mesh("hall", Role::Unknown, true, cuboid(low, high).into_iter().map(|[a, b, c]| [a, c, b]).collect());
    level.mesh("shell", Role::Unknown, true, cuboid(below, above));
    for i in 0..8 {
        level.thing("stone", p(-15.0, -1.0, -15.0 + f64::from(i)), p(-14.5, 0.0, -14.5 + f64::from(i)));
    }
    // Some splits take rock for a closed cell.
    level.cell("rock", vec![block(below, above.with_x(-0.01))]);
    level.cell("hall", vec![block(low, high)]);
    let level = made(level);
    let (eye, _) = begun(&level);
    free_and_on_a_floor("level", &level.scene, eye);
    assert!((0.0..8.0).contains(&eye.x) && (0.0..8.0).contains(&eye.z), "{eye}");
}

#[test]
fn one_looks_along_a_corridor_and_not_at_its_side() {
    let mut house = boxes::Building::default();
    room(&mut house, "corridor", p(0.0, 0.0, 0.0), p(2.0, 2.7, 20.0));
    let house = made(house);
    let (eye, along) = begun(&house);
    let ahead = if along.z > 0.0 { 20.0 - eye.z } else { eye.z };
    // From one end, all of it is ahead; from the middle, half.
    assert!(along.z.abs() > 0.95 && ahead > 14.0, "{eye} {along}");
}

#[test]
fn models_without_any_place_to_stand_begin_somewhere() {
    // 1. Walls, and no floor: in the middle between them; with a name, where the author drew the floor.
    let mut house = boxes::Building::default();
    for x in [0.0, 6.0] {
        house.wall("wall", p(x, 0.0, 0.0), p(x, 3.0, 6.0), &[]);
    }
    for z in [0.0, 6.0] {
        house.wall("wall", p(0.0, 0.0, z), p(6.0, 3.0, z), &[]);
    }
    house.cell("yard", vec![block(p(0.0, 0.0, 0.0), p(6.0, 3.0, 6.0))]);
    let mut house = made(house);
    let (eye, _) = begun(&house);
    assert!(nearest_beside(&house.scene, eye, 0.0, 3.0) > 2.0, "{eye}");
    house.file.cells[0].source = Some("yard-room".into());
    let (eye, _) = begun(&house);
    free("a room without a slab", &house.scene, eye);
    assert!((eye.y - EYE).abs() < 1e-3, "{eye}");

    // 2. A doll's house, with its cell and without.
    let mut dolls = boxes::Building::default();
    room(&mut dolls, "room", p(0.0, 0.0, 0.0), p(0.6, 0.27, 0.5));
    let mut dolls = made(dolls);
    let (eye, _) = begun(&dolls);
    assert!((0.1..0.5).contains(&eye.x) && (0.1..0.2).contains(&eye.y) && (0.1..0.4).contains(&eye.z), "{eye}");
    dolls.file.cells.clear();
    dolls.file.placement = BitMatrix::new(0, dolls.scene.objects.len());
    let (eye, along) = begun(&dolls);
    let middle = dolls.scene.bounds().centre() + dolls.scene.origin;
    assert!((middle - eye).normalize().dot(along) > 0.999 && middle.distance(eye) > 0.5, "{eye} {along}");
}

#[test]
fn open_ground_is_stood_on() {
    let mut field = boxes::Building::default();
    field.wall("field", p(0.0, 0.0, 0.0), p(50.0, 0.0, 40.0), &[]);
    field.solid("hut", Role::Unknown, true, p(20.0, 0.0, 10.0), p(24.0, 3.0, 14.0));
    field.outside(p(20.0, 0.0, 10.0), p(24.0, 3.0, 14.0));
    let field = made(field);
    let (eye, along) = begun(&field);
    assert!(free_and_on_a_floor("field", &field.scene, eye) < 0.01, "{eye}");
    let to_hut = (p(22.0, EYE, 12.0) - eye).normalize();
    assert!(along.dot(to_hut) > 0.7, "{eye} looks away from all there is: {along}");
}

#[test]
fn nothing_at_all_is_no_reason_to_fall() {
    let mut house = boxes::Building::default();
    house.wall("field", p(0.0, 0.0, 0.0), p(5.0, 0.0, 4.0), &[]);
    let mut empty = made(house);
    let scene = std::sync::Arc::make_mut(&mut empty.scene);
    (scene.objects, scene.triangles, scene.positions) = Default::default();
    empty.file.objects.clear();
    empty.file.placement = BitMatrix::new(0, 0);
    begun(&empty);
}

#[test]
fn shipped_buildings_begin_in_a_closed_cell_on_a_floor() {
    for name in ["villa_rotonda", "office", "gallery100"] {
        let building = building(name);
        let (eye, _) = begun(&building);
        free_and_on_a_floor(name, &building.scene, eye);
        assert!(cells_at(&building, eye).any(|cell| !cell.open), "{name}: {eye}");
    }
}

#[test]
fn real_buildings_begin_in_a_room_that_their_authors_named() {
    let test = "real_buildings_begin_in_a_room_that_their_authors_named";
    let folder = data();
    let models = [
        "duplex/Duplex_A_20110907",
        "webifc-mpl/Office_A_20110811",
        "kit-apache/AC11-FZK-Haus",
        "kit-apache/AC11-Smiley-West",
    ];
    for model in models {
        let Some(building) = quickly_baked(test, &folder.join(model).with_extension("ifc")) else { return };
        let (eye, _) = begun(&building);
        let cell = cells_at(&building, eye).find(|cell| cell.source.is_some());
        let cell = cell.unwrap_or_else(|| panic!("{model}: {eye} is in no room"));
        // What the authors wrote, read by other means.
        let rooms = std::fs::read(folder.join(model).with_extension("rooms.json")).unwrap();
        let rooms: serde_json::Value = serde_json::from_slice(&rooms).unwrap();
        let room = rooms["rooms"].as_array().unwrap().iter().find(|room| room["id"].as_str() == cell.source.as_deref());
        let room = room.unwrap_or_else(|| panic!("{model}: no room {:?}", cell.source));
        let floor = room["clear_floor_y"].as_f64().or(room["floor_y"].as_f64()).unwrap();
        assert!((eye.y - EYE - floor).abs() < 0.05, "{model}: {eye} in {} on {floor}", cell.name);
        if room["floored"].as_f64() == Some(0.0) {
            // This model has no slab there.
            free(model, &building.scene, eye);
        } else {
            free_and_on_a_floor(model, &building.scene, eye);
        }
    }
}

#[test]
fn real_levels_begin_within() {
    let test = "real_levels_begin_within";
    let folder = data();
    for model in ["godot-demos/zdm2.glb", "quake-id-gpl/dm4.bsp"] {
        let Some(building) = quickly_baked(test, &folder.join(model)) else { return };
        let (eye, _) = begun(&building);
        free_and_on_a_floor(model, &building.scene, eye);
        assert!(cells_at(&building, eye).any(|cell| !cell.open), "{model}: {eye}");
        // Outside a level, its walls show their backs, or nothing is in the way.
        let ways = (0..24).map(|i| DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 24.0));
        let fronts = ways.filter(|way| shows_its_front(&building.scene, eye, DVec3::new(way.x, 0.013, way.y)));
        let fronts = fronts.count();
        assert!(fronts >= 18, "{model}: {eye}: {fronts} of 24 lines meet fronts");
    }
}

/// Whether the first triangle that a line meets is met from its front.
fn shows_its_front(scene: &Scene, from: DVec3, way: DVec3) -> bool {
    let met = corners(scene).filter_map(|[a, b, c]| {
        let n = (b - a).cross(c - a);
        let t = n.dot(a - from) / n.dot(way);
        let at = from + way * t;
        let is_within = [(a, b), (b, c), (c, a)].iter().all(|(p, q)| (*q - *p).cross(at - *p).dot(n) >= 0.0);
        (t > 0.0 && is_within).then_some((t, n.dot(way) < 0.0))
    });
    met.min_by(|a, b| a.0.total_cmp(&b.0)).is_some_and(|(_, front)| front)
}

fn cells_at(building: &Building, eye: DVec3) -> impl Iterator<Item = &FileCell> {
    let at = (eye - building.scene.origin).as_vec3();
    let holds = move |piece: &Vec<glam::Vec4>| piece.iter().all(|plane| plane.truncate().dot(at) <= plane.w + 1e-4);
    building.file.cells.iter().filter(move |cell| cell.pieces.iter().any(holds))
}

/// Leaves of shut doors are in the way, and of no object: nobody stands on them.
#[test]
fn what_is_put_in_the_way_is_no_floor() {
    let building = building("villa_rotonda");
    let mut solid = Solid::new(&building.scene);
    let alone = start(&building, &solid);
    // Over everything.
    let bounds = building.scene.bounds();
    let y = bounds.max.y + 1.0;
    let [a, b, c, d] = [[0, 0], [1, 0], [1, 1], [0, 1]]
        .map(|[i, k]| DVec3::new([bounds.min, bounds.max][i].x, y, [bounds.min, bounds.max][k].z));
    solid.put_in_the_way(&[[a, b, c], [a, c, d]]);
    assert_eq!(start(&building, &solid), alone);
}
