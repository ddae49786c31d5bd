//! Maps as scenes: brushes as triangles, leaves of a tree over them as cells, and what is inside.
#![cfg(feature = "quake")]

use enfilade::cells::{CellGraph, Locator, PortalKind, SplitError, SplitOptions, Strategy, split};
use enfilade::geom::Plane;
use enfilade::scene::{ImportError, ImportOptions, LeakHint, Role, Scene};
use enfilade_levels::quake::import_map_bytes;
use glam::DVec3;
use qbsp::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use testing::data::data;
use testing::map::{block, entity, shell, start, two_rooms};
use testing::random::Places;

use crate::cli::{folder, refused, run};

const LEVELS: [&str; 5] = ["dm4", "e1m1", "e1m3", "e2m2", "start"];

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
    let area: f64 = (0..scene.triangles.len()).map(|t| enfilade::geom::area(&scene.corners(t))).sum();
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
        let area = |s: &Scene| (0..s.triangles.len()).map(|t| enfilade::geom::area(&s.corners(t))).sum::<f64>();
        assert!((area(&scene) - area(&plain)).abs() < 1e-9);
        let graph = cells(&scene);
        let shutters: Vec<_> = graph.portals.iter().filter(|p| p.source.as_deref() == Some("func_areaportal 1")).collect();
        // They cover both faces, each once, and nothing else is a door.
        let unit = 1.0 / 32.0;
        for x in layers {
            let on = |w: &[DVec3]| w.iter().all(|p| (p.x - (x * unit - scene.origin.x)).abs() < 1e-9);
            let covered: f64 = shutters.iter().filter(|p| on(&p.winding)).map(|p| enfilade::geom::area(&p.winding)).sum();
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
                .any(|n| n.starts_with("the map leaks: the way out from info_player_start at (64 64 24)"))
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
        refused(&run(&["bake".as_ref(), path.as_path()]), &["bad.map", said]);
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

#[test]
fn the_way_out_goes_to_a_file_that_editors_load() {
    let folder = folder("leak");
    let [map, points, file] = ["leak.map", "leak.pts", "leak.pvs"].map(|name| folder.join(name));
    std::fs::write(&map, entity("worldspawn", "", &shell([0, 0, 0], [64, 64, 64], "brick")[1..]) + &start("32 32 8"))
        .unwrap();
    let output = run(&["bake".as_ref(), map.as_path()]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("the map leaks: the way out from info_player_start at (32 32 8) is"), "{said}");
    let text = std::fs::read_to_string(&points).unwrap();
    let lines: Vec<Vec<f64>> = text.lines().map(|l| l.split(' ').map(|w| w.parse().unwrap()).collect()).collect();
    assert!(lines.len() > 2 && lines.iter().all(|p| p.len() == 3) && lines[0] == [32.0, 32.0, 8.0]);
    assert!(file.exists());
}

/// A brush by its planes.
type Solid = Vec<Plane>;

/// The brushes of the world, and where point entities are; read anew, without the library.
fn solids(text: &str) -> (Vec<Solid>, Vec<DVec3>) {
    let (mut solids, mut origins, mut depth, mut class) = (Vec::new(), Vec::new(), 0, String::new());
    let mut brush: Option<(Solid, bool)> = None;
    for line in text.lines().map(str::trim) {
        let quoted: Vec<&str> = line.split('"').collect();
        match line.chars().next() {
            Some('{') => {
                depth += 1;
                brush = (depth == 2).then(|| (Vec::new(), true));
            }
            Some('}') => {
                depth -= 1;
                let is_world = matches!(class.as_str(), "worldspawn" | "func_group" | "func_illusionary_visblocker");
                if let Some((planes, true)) = brush.take().filter(|_| is_world) {
                    solids.push(planes);
                }
            }
            Some('"') if quoted[1] == "classname" => class = quoted[3].to_owned(),
            Some('"') if quoted[1] == "origin" => {
                let at: Vec<f64> = quoted[3].split(' ').map(|w| w.parse().unwrap()).collect();
                origins.push(DVec3::new(at[0], at[1], at[2]));
            }
            Some('(') => {
                let (planes, is_solid) = brush.as_mut().expect("within a brush");
                let numbers: Vec<f64> = line.split(['(', ')', ' ']).filter_map(|w| w.parse().ok()).collect();
                let [a, b, c] = [0, 3, 6].map(|k| DVec3::new(numbers[k], numbers[k + 1], numbers[k + 2]));
                planes.push(Plane::through(b, (a - b).cross(c - b).normalize()));
                let texture = line.split(')').nth(3).unwrap().split_whitespace().next().unwrap().to_lowercase();
                let texture = texture.rsplit('/').next().unwrap();
                let is_open = texture.starts_with(['*', '{']) && class != "func_illusionary_visblocker";
                *is_solid &= !is_open && !["clip", "trigger", "hint"].contains(&texture);
                // Detail, windows, liquids and areaportals of Quake 2 are not walls.
                let tail = line.rsplit(['(', ']']).next().unwrap().rsplit(')').next().unwrap();
                let numbers: Vec<f64> = tail.split_whitespace().filter_map(|w| w.parse().ok()).collect();
                let own = if line.contains(']') { 3 } else { 5 };
                let contents = numbers.get(own).map_or(0, |&n| n as u32);
                *is_solid &= contents & 0x1903_807a == 0;
            }
            _ => {}
        }
    }
    (solids, origins)
}

/// How far a ray goes before it meets a solid.
fn free_way(solids: &[Solid], from: DVec3, direction: DVec3) -> f64 {
    let into = |planes: &Solid| {
        let (mut near, mut far) = (0.0f64, f64::INFINITY);
        for plane in planes {
            let (distance, slope) = (plane.distance(from), plane.n.dot(direction));
            match slope {
                s if s < 0.0 => near = near.max(-distance / s),
                s if s > 0.0 => far = far.min(-distance / s),
                // Along a face is not inside.
                _ if distance > -1e-9 => return f64::INFINITY,
                _ => {}
            }
        }
        if near <= far { near } else { f64::INFINITY }
    };
    solids.iter().map(into).fold(f64::INFINITY, f64::min)
}

/// Whether a walk of random straight steps from an entity gets out of the map.
fn gets_out(solids: &[Solid], from: DVec3, seed: u64) -> bool {
    let mut random = Places::new(seed);
    let mut at = from;
    for _ in 0..20_000 {
        let direction = DVec3::from(std::array::from_fn(|_| 2.0 * random.unit() - 1.0)).normalize();
        let way = free_way(solids, at, direction);
        if way == f64::INFINITY {
            return true;
        }
        at += direction * way * random.unit() * 0.999;
    }
    false
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn maps_leak_where_a_random_walk_gets_out_of_them() {
    let folder = data();
    let folder = folder.join("ericw-testmaps-gpl");
    let (mut maps, mut leaks) = (0, 0);
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "map") {
            continue;
        }
        maps += 1;
        let text = std::fs::read_to_string(&path).unwrap();
        let (solids, origins) = solids(&text);
        let out = origins
            .iter()
            .enumerate()
            .any(|(i, &from)| free_way(&solids, from, DVec3::X) > 0.0 && gets_out(&solids, from, i as u64));
        let is_leak = imported(&text).unwrap().hints.leak.is_some();
        assert_eq!(is_leak, out, "{}", path.display());
        leaks += usize::from(is_leak);
    }
    assert_eq!((maps, leaks), (18, 0));
}

/// Of `count` random points in the levels' boxes, those that the map and the compiled level do not both call free or both solid,
/// and whether the map calls them free.
fn disagreements(folder: &Path, name: &str, count: usize) -> Vec<(DVec3, bool)> {
    let read = |kind: &str| std::fs::read(folder.join(format!("quake-id-gpl/{name}.{kind}"))).unwrap();
    let bsp = read("bsp");
    let level = BspData::parse(BspParseInput { bsp: &bsp, lit: None, settings: BspParseSettings::default() }).unwrap();
    let scene = import_map_bytes(&read("map"), name, &ImportOptions::default()).unwrap();
    let graph = cells(&scene);
    let locator = Locator::new(&graph);
    let bounds = level.models[0].bound;
    let [min, max] = [bounds.min, bounds.max].map(|p| DVec3::from_array(p.to_array().map(f64::from)));
    let mut random = Places::new(11);
    let mut found = Vec::new();
    for _ in 0..count {
        let p = DVec3::from(std::array::from_fn(|k| min[k] + (max[k] - min[k]) * random.unit()));
        let leaf = level.leaf_at_point(0, p.as_vec3());
        let is_free = !level.leaves[leaf].contents.0.contains(qbsp::data::nodes::BspLeafContentFlags::SOLID);
        let in_cell = locator.locate(DVec3::new(p.x, p.z, -p.y) / 32.0 - scene.origin).is_some();
        if in_cell != is_free {
            found.push((p, in_cell));
        }
    }
    found
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn a_map_and_its_compiled_level_agree_on_what_is_solid() {
    let folder = data();
    for name in LEVELS {
        let found = disagreements(&folder, name, 100_000);
        assert!(found.len() < 100, "{name}: {} {:?}", found.len(), &found[..found.len().min(8)]);
    }
}

#[test]
#[ignore = "a million points; run by `just torture`"]
fn a_map_and_its_compiled_level_agree_in_a_million_points() {
    let folder = data();
    for name in LEVELS {
        let found = disagreements(&folder, name, 1_000_000);
        let text = std::fs::read(folder.join(format!("quake-id-gpl/{name}.map"))).unwrap();
        let (solids, _) = solids(&text.iter().map(|&b| char::from(b)).collect::<String>());
        let depth = |p: DVec3, solid: &Solid| solid.iter().map(|plane| plane.distance(p)).fold(f64::MIN, f64::max);
        // What is in no brush and not free is a pocket that no entity reaches, which the compiler kept.
        let (mut near, mut pockets) = (0, 0);
        for &(p, is_free) in &found {
            let nearest = solids.iter().map(|solid| depth(p, solid)).min_by(|a, b| a.abs().total_cmp(&b.abs()));
            let is_near = nearest.is_some_and(|d| d.abs() < 0.1);
            near += usize::from(is_near);
            pockets += usize::from(!is_near && !is_free && solids.iter().all(|solid| depth(p, solid) > 0.0));
        }
        println!("{name}: {} of 1,000,000, {near} within 0.1 of a face, {pockets} in closed pockets", found.len());
        assert!(found.len() - near - pockets < 10, "{name}");
        assert!(found.len() < 1000, "{name}: {}", found.len());
    }
}

/// A WAD of the textures that a level has within.
fn wad_of(bsp: &[u8]) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(bsp[at..at + 4].try_into().unwrap()) as usize;
    let [lump, length] = [word(4 + 8 * 2), word(8 + 8 * 2)];
    let mut wad = b"WAD2".to_vec();
    wad.extend((word(lump) as u32).to_le_bytes());
    wad.extend((12 + length as u32).to_le_bytes());
    wad.extend(&bsp[lump..lump + length]);
    for texture in 0..word(lump) {
        let at = word(lump + 4 + 4 * texture);
        // A lump ends where the file does, at the latest.
        wad.extend([12 + at as u32, 0, 0].map(u32::to_le_bytes).concat());
        wad.extend([0x44, 0, 0, 0]);
        wad.extend(&bsp[lump + at..lump + at + 16]);
    }
    wad
}

/// Corners of a triangle, metres in the model, and their texture coordinates.
type Textured = ([DVec3; 3], [[f32; 2]; 3]);

/// What the compiler wrote into the level is what is worked out of the map, to a texel's hundredth.
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn textures_lie_in_a_map_as_its_compiler_laid_them() {
    let data = data();
    let level = data.join("quake-id-gpl/e1m1.bsp");
    let folder = folder("map_textures");
    std::fs::write(folder.join("base.wad"), wad_of(&std::fs::read(&level).unwrap())).unwrap();
    std::fs::copy(level.with_extension("map"), folder.join("e1m1.map")).unwrap();
    let options = ImportOptions { trace: true, ..ImportOptions::default() };
    let scenes = [folder.join("e1m1.map"), level].map(|path| enfilade_formats::import(&path, &options).unwrap());
    // By texture: corners in the model's own coordinates, with their texture coordinates.
    let [map, bsp] = scenes.map(|scene| {
        let trace = scene.trace.as_ref().unwrap();
        let mut of: BTreeMap<String, Vec<Textured>> = BTreeMap::new();
        for (o, object) in scene.objects.iter().enumerate() {
            let look = &trace.looks[trace.meshes[o] as usize];
            let material = &trace.materials[look.material.unwrap() as usize];
            for t in object.triangles.clone().filter(|_| material.texture.is_some()) {
                let at = look.texture_coordinates[trace.triangles[t as usize] as usize];
                of.entry(material.name.clone()).or_default().push((scene.corners(t as usize).map(|p| p + scene.origin), at));
            }
        }
        of
    });
    // Texture coordinates of a point of a triangle; `None` off it.
    let at = |(corners, at): &Textured, p: DVec3| {
        let [a, b, c] = *corners;
        let n = (b - a).cross(c - a);
        let weights = [(b, c), (c, a), (a, b)].map(|(q, r)| (q - p).cross(r - p).dot(n) / n.dot(n));
        let is_on = (p - a).dot(n.normalize()).abs() < 1e-3 && weights.iter().all(|w| *w > 1e-3);
        is_on.then(|| [0, 1].map(|k| (0..3).map(|i| weights[i] * f64::from(at[i][k])).sum::<f64>()))
    };
    let (mut compared, mut off) = (0, 0);
    for (texture, triangles) in &map {
        for (corners, coordinates) in triangles {
            let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
            let here = at(&(*corners, *coordinates), middle);
            let there = bsp.get(texture).and_then(|all| all.iter().find_map(|other| at(other, middle)));
            if let (Some(here), Some(there)) = (here, there) {
                compared += 1;
                // Pictures repeat.
                let apart = [0, 1].map(|k| (here[k] - there[k]) - (here[k] - there[k]).round());
                off += usize::from(apart.iter().any(|x| x.abs() > 1e-4));
            }
        }
    }
    assert!(compared > 3000, "{compared} triangles are in both");
    // One face, of two triangles, is of two brushes that the mapper offset differently.
    assert_eq!(off, 2, "of {compared} triangles");
}
