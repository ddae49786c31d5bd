//! Maps as scenes: brushes as triangles, leaves of a tree over them as cells, and what is inside.

mod compiled;
mod solids;

use crate::cli::{enfilade, folder, refused};
use enfilade::cells::{CellGraph, Locator, PortalKind, SplitError, SplitOptions, Strategy, split};
use enfilade::scene::{ImportError, ImportOptions, LeakHint, Role, Scene};
use enfilade_levels::quake::import_map_bytes;
use glam::DVec3;
use solids::{free_way, solids};
use testing::data::data;
use testing::map::{block, entity, shell, start, two_rooms};
use testing::meshes::area_of_all;
use testing::random::Places;

fn imported(text: &str) -> Result<Scene, ImportError> {
    import_map_bytes(text.as_bytes(), "map", &ImportOptions::default())
}

fn cells(scene: &Scene) -> CellGraph {
    split(scene, &SplitOptions::default()).unwrap()
}

#[test]
fn two_rooms_are_cells_joined_by_their_doorway() {
    let scene = imported(&(entity("worldspawn", "", &two_rooms()) + &start("64 64 24"))).unwrap();
    let graph = cells(&scene);
    assert_eq!((graph.strategy, graph.closed_holes.len()), (Strategy::Leaves, 0));
    let unit = 1.0 / 32.0;
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, z, -y) * unit - scene.origin;
    let locator = Locator::new(&graph);
    let cell = |p: DVec3| locator.locate(p).map(|(cell, _)| cell);
    // Inside, in the doorway, in the lintel, in a wall, outside.
    let inside = [at(64., 64., 64.), at(200., 64., 64.), at(132., 64., 32.)];
    let solid = [at(132., 64., 100.), at(-4., 64., 64.), at(-100., 64., 64.)];
    assert!(inside.iter().all(|&p| cell(p).is_some()) && solid.iter().all(|&p| cell(p).is_none()));
    assert_ne!(cell(inside[0]), cell(inside[1]));
    // Volumes of the cells are those of the rooms and the doorway: nothing is lost, nothing twice.
    let mut random = Places::new(3);
    let mut point =
        |from: [f64; 3], to: [f64; 3]| DVec3::from(std::array::from_fn(|k| from[k] + (to[k] - from[k]) * random.unit()));
    for _ in 0..20_000 {
        let p = point([-16., -16., -16.], [280., 144., 144.]);
        let within = |p: DVec3, min: [f64; 3], max: [f64; 3]| (0..3).all(|k| min[k] < p[k] && p[k] < max[k]);
        let free = within(p, [0.; 3], [128.; 3])
            || within(p, [136., 0., 0.], [264., 128., 128.])
            || within(p, [127., 32., 0.], [137., 96., 64.]);
        assert_eq!(cell(at(p.x, p.y, p.z)).is_some(), free, "{p}");
    }
    // What is drawn: the insides of both rooms and of the doorway, in square metres.
    let area = area_of_all(&scene);
    let rooms = 2.0 * 6.0 * 128.0 * 128.0 - 2.0 * 64.0 * 64.0 + 8.0 * 4.0 * 64.0;
    assert!((area - rooms * unit * unit).abs() < 1e-9, "{area}");
    assert!(scene.objects.iter().all(|o| o.opaque && o.role == Role::Structure && o.node.starts_with("leaf ")));
    assert!(scene.objects.iter().any(|o| o.node.ends_with("/lintel")));
}

/// The parts of a graph that hang together without the portals that an area portal shuts.
fn parts_without_shutters(graph: &CellGraph) -> Vec<usize> {
    let mut part: Vec<usize> = (0..graph.cells.len()).collect();
    for _ in 0..graph.cells.len() {
        for portal in graph.portals.iter().filter(|p| !p.source.as_ref().is_some_and(|s| s.starts_with("func_areaportal"))) {
            let [a, b] = portal.cells.map(|cell| cell.index());
            (part[a], part[b]) = (part[a].min(part[b]), part[a].min(part[b]));
        }
    }
    part
}

#[test]
fn an_area_portal_is_a_door_that_is_not_drawn() {
    let world = entity("worldspawn", "", &two_rooms());
    // In the doorway, thinner than the wall; and in the midst of the second room, from wall to wall.
    for (at, layers) in [([130, 134], [130.0, 134.0]), ([190, 200], [190.0, 200.0])] {
        let [y, z] = if at[0] < 136 { [[32, 96], [0, 64]] } else { [[0, 128], [0, 128]] };
        let brush = block([at[0], y[0], z[0]], [at[1], y[1], z[1]], "trigger");
        let text = world.clone() + &entity("func_areaportal", "", &[brush]) + &start("64 64 24");
        let scene = imported(&text).unwrap();
        let plain = imported(&(world.clone() + &start("64 64 24"))).unwrap();
        assert!((area_of_all(&scene) - area_of_all(&plain)).abs() < 1e-9);
        let graph = cells(&scene);
        let shutters: Vec<_> = graph.portals.iter().filter(|p| p.source.as_deref() == Some("func_areaportal 1")).collect();
        // They cover both faces, each once, and nothing else is a door.
        let unit = 1.0 / 32.0;
        for x in layers {
            let on = |w: &[DVec3]| w.iter().all(|p| (p.x - (x * unit - scene.origin.x)).abs() < 1e-9);
            let covered: f64 =
                shutters.iter().filter(|p| on(&p.winding)).map(|p| enfilade::math::geom::area(&p.winding)).sum();
            let face = f64::from((y[1] - y[0]) * (z[1] - z[0])) * unit * unit;
            assert!((covered - face).abs() < 1e-9, "{x}: {covered} of {face}");
        }
        let doors = graph.portals.iter().filter(|p| p.kind == PortalKind::Door).count();
        assert_eq!(doors, shutters.len());
        assert!(shutters.iter().all(|p| p.state.closable && !p.state.shut));
        // Without them, the start does not hang together with what is beyond.
        let part = parts_without_shutters(&graph);
        let locator = Locator::new(&graph);
        let at = |x: f64| locator.locate(DVec3::new(x, 64.0, -64.0) * unit - scene.origin).unwrap().0.index();
        assert_ne!(part[at(64.0)], part[at(240.0)]);
    }
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn area_portals_of_other_maps_shut_off_what_is_in_them() {
    let data = data();
    let maps =
        ["q2_areaportal", "q2_areaportals", "q2_areaportal_with_detail", "q2_double_areaportal", "q2_areaportal_split"];
    for map in maps {
        let text = std::fs::read_to_string(data.join(format!("ericw-testmaps-gpl/{map}.map"))).unwrap();
        let scene = imported(&text).unwrap();
        let graph = cells(&scene);
        // Beside them, doors are doors.
        let named = graph.portals.iter().filter_map(|p| p.source.as_deref());
        let mut shutters: Vec<&str> = named.filter(|name| name.starts_with("func_areaportal")).collect();
        shutters.sort_unstable();
        shutters.dedup();
        assert_eq!(shutters.len(), text.matches("\"func_areaportal\"").count(), "{map}: {shutters:?}");
        let part = parts_without_shutters(&graph);
        for name in shutters {
            // A cell that a shutter leads to is on another side than the one it leads from.
            let of_name = graph.portals.iter().filter(|p| p.source.as_deref() == Some(name));
            let crosses = of_name.map(|p| p.cells.map(|cell| part[cell.index()])).collect::<Vec<_>>();
            assert!(crosses.iter().all(|[a, b]| a != b), "{map}: {name} leads round itself");
        }
    }
}

#[test]
fn a_map_leaks_if_any_of_its_walls_is_missing() {
    let walls = shell([0, 0, 0], [128, 128, 128], "brick");
    let map = |walls: &[String]| entity("worldspawn", "", walls) + &start("64 64 24");
    assert_eq!(cells(&imported(&map(&walls)).unwrap()).cells.len(), 1);
    for missing in 0..6 {
        let mut left = walls.clone();
        left.remove(missing);
        let text = map(&left);
        let scene = imported(&text).unwrap();
        let LeakHint { entity, from, way } = scene.hints.leak.clone().expect("a leak");
        assert_eq!((entity.as_str(), from), ("info_player_start", DVec3::new(64., 64., 24.)));
        assert!(
            scene
                .source
                .notes
                .iter()
                .any(|n| n.starts_with("the map leaks: the path out from info_player_start at (64 64 24)"))
        );
        // The way meets no wall, and ends beyond all of them.
        let (solids, _) = solids(&text);
        let mut at = from;
        for next in way {
            assert!(free_way(&solids, at, (next - at).normalize()) > at.distance(next), "{missing}: {at} {next}");
            at = next;
        }
        assert!(at.min_element() > 128.0);
    }
    // Without entities, what isn't closed has no way out that could be told.
    let scene = imported(&entity("worldspawn", "", &walls[1..])).unwrap();
    assert!(scene.hints.leak.is_none() && scene.hints.leaves.is_none());
    assert!(scene.source.notes.iter().any(|n| n.starts_with("no point entities and no closed space")));
    // An entity in a wall, or outside of all, is in no room; without one inside, what is closed is kept.
    let inside_out = entity("worldspawn", "", &walls) + &start("-4 64 24");
    assert_eq!(cells(&imported(&inside_out).unwrap()).cells.len(), 1);
    let scene = imported(&entity("worldspawn", "", &walls)).unwrap();
    assert!(scene.source.notes.iter().any(|n| n.starts_with("no point entities")) && cells(&scene).cells.len() == 1);
}

/// A map that isn't closed is a model as an OBJ of its brushes is: all that shows of them is there, and cells are found likewise.
#[test]
fn a_map_that_leaks_is_a_model_of_its_brushes() {
    let mut open = two_rooms();
    open.remove(5);
    let scene = imported(&(entity("worldspawn", "", &open) + &start("64 64 24"))).unwrap();
    assert!(scene.hints.leak.is_some() && scene.hints.leaves.is_none());
    // Rays from outside and from inside meet what the brushes are.
    let unit = 1.0 / 32.0;
    let turned = |p: DVec3| DVec3::new(p.x, p.z, -p.y);
    let rays = enfilade::scene::rays::RayScene::new(&scene);
    let (solids, _) = solids(&(entity("worldspawn", "", &open)));
    let mut random = Places::new(5);
    for _ in 0..2_000 {
        let from = DVec3::from(std::array::from_fn(|_| 400.0 * random.unit() - 100.0));
        let direction = DVec3::from(std::array::from_fn(|_| 2.0 * random.unit() - 1.0)).normalize();
        let way = free_way(&solids, from, direction);
        if way == 0.0 {
            continue;
        }
        let far = 2_000.0;
        let hit = rays.first_opaque(turned(from) * unit - scene.origin, turned(direction), far * unit);
        let met = hit.map(|hit| hit.t / unit);
        match met {
            Some(met) => assert!((met - way).abs() < 1e-2, "{from} {direction}: {met} {way}"),
            None => assert!(way > far, "{from} {direction}: {way}"),
        }
    }
    for strategy in [Strategy::Plan, Strategy::Bsp] {
        let options = SplitOptions { strategy: Some(strategy), ..SplitOptions::default() };
        assert_eq!(split(&scene, &options).unwrap().strategy, strategy);
    }
    let leaves = SplitOptions { strategy: Some(Strategy::Leaves), ..SplitOptions::default() };
    assert_eq!(split(&scene, &leaves).unwrap_err(), SplitError::NoLeaves);
}

#[test]
fn rooms_that_no_entity_is_in_are_no_cells() {
    let mut brushes = shell([0, 0, 0], [128, 128, 128], "brick");
    brushes.extend(shell([256, 0, 0], [384, 128, 128], "brick"));
    let map = |starts: &str| cells(&imported(&(entity("worldspawn", "", &brushes) + starts)).unwrap()).cells.len();
    assert_eq!([map(&start("64 64 24")), map(&(start("64 64 24") + &start("300 64 24"))), map("")], [1, 2, 2]);
}

#[test]
fn what_a_brush_does_follows_from_its_class_and_its_textures() {
    let inner = |x: i32, texture: &str| block([x, 32, 0], [x + 16, 48, 32], texture);
    let mut world = two_rooms();
    world.extend([inner(16, "*water0"), inner(40, "{grate"), inner(64, "clip"), inner(88, "trigger")]);
    let door = block([128, 32, 0], [136, 96, 64], "wood");
    let text = entity("worldspawn", "", &world)
        + &entity("func_detail", "", &[inner(144, "rock")])
        + &entity("func_illusionary", "", &[inner(168, "fog")])
        + &entity("func_door", "\"angle\" \"-1\"\n", &[door])
        + &entity("func_wall", "", &[inner(192, "glass")])
        + &entity("trigger_once", "", &[inner(216, "metal")])
        + &start("64 64 24");
    let scene = imported(&text).unwrap();
    let of = |texture: &str| -> Vec<(Role, bool, bool)> {
        let named = scene.objects.iter().filter(|o| o.node.ends_with(&format!("/{texture}")));
        named.map(|o| (o.role, o.opaque, o.glass)).collect()
    };
    assert_eq!(of("*water0"), [(Role::Structure, false, true)]);
    assert_eq!(of("{grate"), [(Role::Structure, false, true)]);
    assert_eq!(of("rock"), [(Role::Structure, true, false)]);
    assert_eq!(of("fog"), [(Role::Furnishing, false, true)]);
    assert_eq!(of("wood"), [(Role::Door, false, false)]);
    assert_eq!(of("glass"), [(Role::Furnishing, false, false)]);
    assert_eq!([of("clip"), of("trigger"), of("metal")], [const { Vec::new() }; 3]);
    // None of them divides space; the door is one, and shut.
    let bare = cells(&imported(&(entity("worldspawn", "", &two_rooms()) + &start("64 64 24"))).unwrap());
    let graph = cells(&scene);
    assert_eq!((graph.cells.len(), graph.portals.len()), (bare.cells.len(), bare.portals.len()));
    let doors = graph.portals.iter().filter(|p| p.kind == PortalKind::Door);
    assert!(doors.clone().count() > 0 && doors.clone().any(|p| p.state.shut && p.state.closable));
}

#[test]
fn brushes_of_quake_2_say_what_they_are_themselves() {
    let flagged = |brush: String, contents: u32| brush.replace(" 0 0 0 1 1\n", &format!(" 0 0 0 1 1 {contents} 0 0\n"));
    let inner = || block([48, 48, 0], [80, 80, 128], "e1u1/pillar");
    let objects = |contents: u32| {
        let mut world = shell([0, 0, 0], [128, 128, 128], "e1u1/wall");
        world.push(flagged(inner(), contents));
        let scene = imported(&(entity("worldspawn", "", &world) + &start("16 16 24"))).unwrap();
        let pillar: Vec<bool> = scene.objects.iter().filter(|o| o.node.ends_with("/pillar")).map(|o| o.opaque).collect();
        (cells(&scene).cells.len() > 1, pillar.first().copied())
    };
    // Solid divides, detail hides and does not divide, a window does neither, a clip is not there.
    assert_eq!(objects(0x1), (true, Some(true)));
    assert_eq!(objects(0x800_0001), (false, Some(true)));
    assert_eq!(objects(0x2), (false, Some(false)));
    assert_eq!(objects(0x1_0000), (false, None));
}

#[test]
fn bad_maps_get_one_line() {
    let folder = folder("bad");
    let path = folder.join("bad.map");
    let good = entity("worldspawn", "", &shell([0, 0, 0], [64, 64, 64], "brick"));
    let with = |from: &str, to: &str| good.replacen(from, to, 1);
    for (text, said) in [
        (with("( -8 ", "( x "), "Line 4: "),
        (with("( -8 ", "( -1e9 "), "entity 0, brush 0, side 1: a number that is not within 1e7 of the origin"),
        (with("( -8 ", "( nan "), "entity 0, brush 0, side 1: a number that is not"),
        (with("{\n( ", "{\npatchDef2\n( "), "line 4: patchDef is of Quake 3 and not supported"),
        (good[..good.len() - 3].to_owned(), "end-of-file"),
        (String::new(), "the file is empty"),
        (start("0 0 0"), "no triangles in it"),
    ] {
        std::fs::write(&path, &text).unwrap();
        refused(&enfilade!("bake", &path), &["bad.map", said]);
    }
    // A brush that is none is left out and named.
    let flat = block([8, 8, 8], [16, 16, 8], "brick");
    let mut walls = shell([0, 0, 0], [64, 64, 64], "brick");
    walls.push(flat);
    let notes = imported(&(entity("worldspawn", "", &walls) + &start("32 32 8"))).unwrap().source.notes;
    assert!(notes.iter().any(|n| n == "1 brushes without a volume left out: entity 0 brush 6"), "{notes:?}");
    // A byte-order mark is not part of the map.
    assert!(imported(&format!("\u{feff}{}{}", entity("worldspawn", "", &walls), start("32 32 8"))).is_ok());
}
