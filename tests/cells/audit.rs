//! What an author wrote wrongly is found, by its name, and what is right is left alone.

use enfilade::cells::{Audit, FindingKind, Locator, SplitOptions, Strategy, audit, audit_rooms, split};
use enfilade::scene::{OpeningHint, OpeningKind, RoomHint, Scene};
use glam::{DVec3, dvec3 as v};
use testing::meshes::cuboid;
use testing::walls::Building;

/// Height of the rooms, the door's height, where it begins and ends along z.
const HEIGHT: f64 = 2.8;
const HEAD: f64 = 2.1;
const JAMBS: [f64; 2] = [2.0, 2.9];

/// Two rooms, x 0..4 and 4.2..8.2, z 0..5, with a door between them and a door from the first to the outside at -x; as its author
/// should have written it.
struct House {
    roof: bool,
    inner_door: bool,
    rooms: Vec<RoomHint>,
    openings: Vec<OpeningHint>,
}

fn room(id: &str, min: DVec3, max: DVec3) -> RoomHint {
    let surface = cuboid(min, max);
    RoomHint { id: id.into(), name: format!("the {id}"), storey: None, surface, outside: false, drawn: true }
}

/// A door in a wall whose middle is at `x`.
fn door(id: &str, x: f64, thickness: f64, rooms: [Option<usize>; 2]) -> OpeningHint {
    let [a, b] = JAMBS;
    let winding = vec![v(x, 0., a), v(x, HEAD, a), v(x, HEAD, b), v(x, 0., b)];
    OpeningHint { id: id.into(), kind: OpeningKind::Door, winding, thickness, rooms }
}

fn built(mut building: Building, rooms: &[RoomHint], openings: &[OpeningHint]) -> Scene {
    building.builder.hints.rooms = rooms.to_vec();
    building.builder.hints.openings = openings.to_vec();
    building.finish()
}

impl House {
    fn new() -> Self {
        Self {
            roof: true,
            inner_door: true,
            rooms: vec![room("hall", v(0., 0., 0.), v(4., HEIGHT, 5.)), room("den", v(4.2, 0., 0.), v(8.2, HEIGHT, 5.))],
            openings: vec![door("way", 4.1, 0.2, [Some(0), Some(1)]), door("front", -0.1, 0.2, [Some(0), None])],
        }
    }

    fn scene(&self) -> Scene {
        let way = |x: f64| [v(x - 0.3, 0., JAMBS[0]), v(x + 0.3, HEAD, JAMBS[1])];
        let outer = [way(-0.1), [v(-1., HEIGHT, -1.), v(9., 9., 6.)]];
        let mut b = Building::default();
        b.shell(DVec3::ZERO, v(8.2, HEIGHT, 5.), &outer[..if self.roof { 1 } else { 2 }]);
        b.holed(v(4., 0., 0.), v(4.2, HEIGHT, 5.), &[way(4.1)][..usize::from(self.inner_door)]);
        built(b, &self.rooms, &self.openings)
    }

    fn audit(&self) -> Audit {
        let scene = self.scene();
        let options = SplitOptions { strategy: Some(Strategy::Authored), ..SplitOptions::default() };
        audit(&scene, &split(&scene, &options).unwrap())
    }

    /// The author's rooms that cells are named after, ascending.
    fn named(&self) -> Vec<String> {
        let options = SplitOptions { strategy: Some(Strategy::Authored), ..SplitOptions::default() };
        let mut named: Vec<String> =
            split(&self.scene(), &options).unwrap().cells.into_iter().filter_map(|c| c.source).collect();
        named.sort();
        named
    }

    /// What is found, as kind and ids.
    #[track_caller]
    fn finds(&self, expected: &[(FindingKind, &[&str])]) -> Audit {
        let audit = self.audit();
        let found: Vec<(FindingKind, Vec<&str>)> =
            audit.findings.iter().map(|f| (f.kind, f.ids.iter().map(String::as_str).collect())).collect();
        let expected: Vec<(FindingKind, Vec<&str>)> = expected.iter().map(|(kind, ids)| (*kind, ids.to_vec())).collect();
        assert_eq!(found, expected, "{:#?}", audit.findings);
        for finding in &audit.findings {
            assert!(
                !finding.text.contains('\n') && finding.ids.iter().all(|id| finding.text.contains(id.as_str())),
                "{finding:?}"
            );
        }
        audit
    }
}

#[test]
fn a_house_written_rightly_has_no_findings() {
    let audit = House::new().finds(&[]);
    assert_eq!((audit.rooms, audit.sound_rooms, audit.sound_share(), audit.claimed), (2, 2, 1.0, 1.0));
}

#[test]
fn rooms_that_are_no_rooms_are_found() {
    let mut house = House::new();
    // A sheet; a box without a lid; a box in the open, far from the house.
    let mut open = room("open", v(1., 0.5, 1.), v(2., 1.5, 2.));
    open.surface.truncate(10);
    house.rooms.push(room("flat", v(1., 1., 1.), v(2., 1., 2.)));
    house.rooms.push(open);
    house.rooms.push(room("remote", v(50., 0., 1.), v(53., 2., 3.)));
    let audit = house.finds(&[
        (FindingKind::NoVolume, &["flat"]),
        (FindingKind::NotClosed, &["open"]),
        (FindingKind::OpenAir, &["remote"]),
    ]);
    assert_eq!((audit.rooms, audit.sound_rooms), (5, 3));
    assert_eq!(audit_rooms(&house.scene()).sound_rooms, 3);
    // Unsound rooms name nothing: the box without a lid stands in the hall, which keeps all of itself.
    assert_eq!(house.named(), ["den", "hall", "remote"]);
}

#[test]
fn rooms_that_share_space_or_an_id_are_found() {
    let mut house = House::new();
    house.rooms[1] = room("den", v(3.5, 0., 0.), v(8.2, HEIGHT, 5.));
    house.finds(&[(FindingKind::Overlap, &["hall", "den"]), (FindingKind::Shifted, &["den"])]);

    // A copy: the first of the two stands.
    let mut house = House::new();
    house.rooms.push(RoomHint { id: "copy".into(), ..house.rooms[1].clone() });
    let audit = house.finds(&[(FindingKind::Overlap, &["copy", "den"])]);
    assert_eq!((audit.rooms, audit.sound_rooms), (3, 2));

    // A cupboard drawn inside the hall: both stand. A zone drawn around both rooms: it names nothing of its own.
    let mut house = House::new();
    house.rooms.push(room("cupboard", v(0., 0., 0.), v(1., HEIGHT, 1.)));
    assert_eq!(audit_rooms(&house.scene()).sound_rooms, 3);
    house.rooms.push(room("zone", v(0., 0., 0.), v(8.2, HEIGHT, 5.)));
    assert_eq!(audit_rooms(&house.scene()).sound_rooms, 3);
    assert_eq!(house.named(), ["cupboard", "den", "hall"]);

    let mut house = House::new();
    house.openings[1].id = "way".into();
    house.finds(&[(FindingKind::DuplicateId, &["way"])]);
}

#[test]
fn rooms_without_a_door_and_doors_walled_up_are_found() {
    let mut house = House::new();
    house.inner_door = false;
    house.finds(&[(FindingKind::NoDoor, &["den"]), (FindingKind::DoorWalledUp, &["way", "hall", "den"])]);
}

#[test]
fn rooms_off_their_walls_are_found_with_how_far() {
    let mut house = House::new();
    house.rooms[1] = room("den", v(4.35, 0., 0.), v(8.2, HEIGHT, 5.));
    let audit = house.finds(&[(FindingKind::Shifted, &["den"])]);
    assert!(audit.findings[0].text.ends_with("1 of its 6 sides are off their walls, by up to 0.15 m"));
}

#[test]
fn doors_whose_relations_are_wrong_are_found() {
    let mut house = House::new();
    house.openings[0].rooms = [Some(1), None];
    house.openings[1].rooms = [Some(1), None];
    house.openings.push(door("stray", 15., 0.1, [None, None]));
    house.openings.push(door("screen", 2., 0.1, [None, None]));
    house.finds(&[
        (FindingKind::DoorWithoutRooms, &["stray"]),
        (FindingKind::DoorWithoutRooms, &["screen", "hall"]),
        (FindingKind::DoorElsewhere, &["way", "hall", "den"]),
        (FindingKind::DoorElsewhere, &["front", "hall", "den"]),
    ]);
}

#[test]
fn space_that_nobody_named_and_rooms_without_a_roof_are_found() {
    let mut house = House::new();
    house.rooms.truncate(1);
    house.openings[0].rooms = [Some(0), None];
    let audit = house.finds(&[(FindingKind::Unclaimed, &["way"])]);
    assert!((audit.claimed - 0.5).abs() < 0.02, "{}", audit.claimed);

    let mut house = House::new();
    house.roof = false;
    let scene = house.scene();
    let graph = split(&scene, &SplitOptions { strategy: Some(Strategy::Authored), ..SplitOptions::default() }).unwrap();
    let found = enfilade::cells::audit(&scene, &graph);
    let open: Vec<&str> =
        found.findings.iter().filter(|f| f.kind == FindingKind::OpenAir).map(|f| f.ids[0].as_str()).collect();
    assert_eq!(open, ["hall", "den"]);
    assert!(graph.cells.iter().all(|c| c.open), "there is no room indoors");
}

#[test]
fn a_room_drawn_lower_than_its_hall_stays_as_low_but_for_a_ceilings_void() {
    // A hall of 5 x 6 m and 9 m high, of which the author drew 3 m; and a room whose slab lies 0.4 m over what he drew.
    let hall = |height: f64| {
        let (x, z) = (5.0, 6.0);
        let mut b = Building::default();
        b.shell(DVec3::ZERO, v(x, height, z), &[]);
        let scene = built(b, &[room("stage", v(0., 0., 0.), v(x, 3., z))], &[]);
        let options = SplitOptions { strategy: Some(Strategy::Authored), ..SplitOptions::default() };
        let graph = split(&scene, &options).unwrap();
        let locator = Locator::new(&graph);
        let source = |y: f64| {
            let (cell, _) = locator.locate(v(2., y, 3.) - scene.origin).expect("free space is in a cell");
            graph.cells[cell.index()].source.clone()
        };
        [1.5, height - 0.1].map(source)
    };
    let stage = || Some("stage".to_owned());
    assert_eq!(hall(9.0), [stage(), None]);
    assert_eq!(hall(3.4), [stage(), stage()]);
}
