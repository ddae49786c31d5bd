//! Modules that are placed and joined: rooms by hand, and random buildings that are cut. What an eye sees is told by pictures of everything.

use enfilade::bake::BakeOptions;
use enfilade::cells::{PortalKind, SplitOptions};
use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, Culler, Doors, Mode, ModuleId, Movers, Placement, View, World, WorldError, WorldView};
use enfilade::scene::{ImportOptions, Role, Scene, SceneBuilder, Source};
use enfilade::{CellId, ObjectId, PortalId};
use enfilade_measure::walkthrough::missed::{missed_pixels, objects_shown};
use enfilade_measure::walkthrough::raster;
use glam::{DQuat, DVec3};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::sync::Arc;
use testing::bakes::{baked, with_rays};
use testing::boxes::{Building, block, p};
use testing::maze::Grid;
use testing::meshes::{corners, solid, soup};
use testing::modules::{Module, cut, groups, joined, single};
use testing::random::Places;

const WEST: PortalId = PortalId(0);
const EAST: PortalId = PortalId(1);
const ROOM: CellId = CellId(0);

/// A room of 4 x 3 x 4 m with a doorway of 1 x 2 m in its west and its east, a thing in the corner beside each, and a chimney on the roof.
fn room() -> (Scene, PvsFile) {
    let mut building = Building::default();
    let room = building.cell("room", vec![block(p(0.0, 0.0, 0.0), p(4.0, 3.0, 4.0))]);
    let outside = building.outside(p(0.0, 0.0, 0.0), p(4.0, 3.0, 4.0));
    for (x, low, high) in [(0.0, outside, room), (4.0, room, outside)] {
        let door = (p(x, 0.0, 1.5), p(x, 2.0, 2.5));
        building.portal(low, high, door.0, door.1, PortalKind::Door);
        building.wall("wall", p(x, 0.0, 0.0), p(x, 3.0, 4.0), &[door]);
    }
    for (low, high) in [
        (p(0.0, 0.0, 0.0), p(4.0, 3.0, 0.0)),
        (p(0.0, 0.0, 4.0), p(4.0, 3.0, 4.0)),
        (p(0.0, 0.0, 0.0), p(4.0, 0.0, 4.0)),
        (p(0.0, 3.0, 0.0), p(4.0, 3.0, 4.0)),
    ] {
        building.wall("side", low, high, &[]);
    }
    building.thing("west", p(0.1, 0.1, 0.1), p(0.4, 0.4, 0.4));
    building.thing("east", p(3.6, 0.1, 0.1), p(3.9, 0.4, 0.4));
    building.thing("chimney", p(1.0, 3.0, 1.0), p(1.5, 4.0, 1.5));
    building.finish()
}

/// Where the room is turned about its middle and moved.
fn place(file: &PvsFile, angle: f64, to: DVec3) -> Placement {
    let (turn, middle) = (DQuat::from_rotation_y(angle), p(2.0, 0.0, 2.0) - file.origin);
    Placement::new(turn, to + p(2.0, 0.0, 2.0) - turn * middle).unwrap()
}

/// Modules in one scene, and the module and object of each of its objects.
fn together(parts: &[(&Scene, Placement)]) -> (Scene, Vec<(usize, ObjectId)>) {
    let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
    let mut of = Vec::new();
    for (module, (scene, placement)) in parts.iter().enumerate() {
        for (i, object) in (0..).zip(&scene.objects) {
            let moved = |t: [DVec3; 3]| t.map(|p| placement.to_world(p - scene.origin));
            let triangles: Vec<_> = corners(scene, object).into_iter().map(moved).collect();
            builder.add(soup("", Role::Unknown, object.opaque, &triangles)).unwrap();
            of.push((module, ObjectId(i)));
        }
    }
    (builder.finish("together").unwrap(), of)
}

/// What the frame of a world has: module and object.
fn set(view: &mut WorldView, world: &World, ids: &[ModuleId], camera: &Camera, mode: Mode) -> BTreeSet<(usize, ObjectId)> {
    let mut all = BTreeSet::new();
    for id in view.cull(world, camera, mode).to_vec() {
        let module = ids.iter().position(|known| *known == id).unwrap();
        let objects = view.visible(id).unwrap().objects;
        all.extend(objects.iter().map(|o| (module, *o)));
        assert_eq!(all.iter().filter(|(m, _)| *m == module).count(), objects.len(), "{mode}: each once");
    }
    all
}

fn camera(eye: DVec3, along: DVec3) -> Camera {
    Camera::look_at(eye, eye + along, 1.3, 1.6)
}

/// Three rooms in a row, the middle one turned round, and one across, behind a corner that only its own doors lead around.
#[test]
fn a_view_goes_through_joined_doors_and_around_as_pictures_show() {
    let (scene, file) = room();
    let culler = Culler::new(&file);
    let mut world = World::new();
    let places =
        [place(&file, 0.0, p(0.0, 0.0, 0.0)), place(&file, PI, p(4.0, 0.0, 0.0)), place(&file, 0.0, p(8.0, 0.0, 0.0))];
    let ids = places.map(|at| world.place(&culler, at));
    world.join(ids[0], EAST, ids[1], EAST).unwrap();
    world.join(ids[1], WEST, ids[2], WEST).unwrap();
    assert_eq!(world.joined(ids[2], WEST), Ok(Some((ids[1], WEST))));
    let (all, of) = together(&places.map(|at| (&scene, at)));
    let rays = enfilade::scene::rays::RayScene::new(&all);
    let (mut view, mut random) = (WorldView::new(), Places::new(3));
    let (mut seen_of, mut shown_of, mut far) = (0, 0, 0);
    for round in 0..200 {
        // In one of the rooms, or outdoors.
        let eye = match round % 4 {
            3 => random.between(p(-6.0, 0.5, -6.0), p(18.0, 6.0, -1.0)),
            room => random.between(p(0.01, 0.01, 0.01), p(3.99, 2.99, 3.99)) + p(4.0 * room as f64, 0.0, 0.0),
        };
        let camera = camera(eye, random.between(DVec3::NEG_ONE, DVec3::ONE));
        let relative = Camera { eye: (eye - all.origin).as_vec3(), ..camera };
        let picture = raster::View { camera: relative, near: 1e-3, width: 96, height: 60 };
        let full = raster::draw(&all, &picture, &|_| true);
        let shown = objects_shown(&all, &full);
        for mode in Mode::WITHOUT_QUERIES {
            let set = set(&mut view, &world, &ids, &camera, mode);
            let missed = missed_pixels(&rays, &picture, &full, &shown, &|o| set.contains(&of[o.index()]));
            assert_eq!(missed.pixels.len(), 0, "{mode}: from {eye} along {}", camera.w);
            if mode == Mode::Portals && round % 4 == 0 {
                far += usize::from(set.iter().any(|(module, _)| *module == 2));
                (seen_of, shown_of) = (seen_of + set.len(), shown_of + shown.len());
            }
        }
    }
    assert!(far > 3 && far < 40, "the last room is seen from the first in {far} of 50 views");
    assert!(seen_of < 2 * shown_of, "{seen_of} objects for {shown_of}");
    // Through both doors straight ahead, and nothing beside.
    let ahead = set(&mut view, &world, &ids, &camera(p(1.0, 1.0, 2.0), DVec3::X), Mode::Portals);
    assert!((0..3).all(|module| ahead.iter().any(|(m, _)| *m == module)), "{ahead:?}");
    let back = set(&mut view, &world, &ids, &camera(p(3.0, 1.0, 3.5), DVec3::Z), Mode::Portals);
    assert!(back.iter().all(|(module, _)| *module == 0), "{back:?}");
    assert_eq!(view.visible(ids[0]).unwrap().homes, [ROOM]);
    assert!(view.visible(ids[1]).is_none());
}

/// A door of either module shuts the opening, and each view of a world has its own doors.
#[test]
fn a_shut_door_on_either_side_of_a_join_shuts_it() {
    let (_, file) = room();
    let culler = Culler::new(&file);
    let mut world = World::new();
    let a = world.place(&culler, place(&file, 0.0, DVec3::ZERO));
    let b = world.place(&culler, place(&file, PI, p(4.0, 0.0, 0.0)));
    world.join(a, EAST, b, EAST).unwrap();
    let mut shut = Doors::open(&culler);
    shut.set_open(EAST, false);
    let ahead = camera(p(0.5, 1.0, 2.0), DVec3::X);
    let [near, far] = [camera(p(3.7, 1.0, 2.0), DVec3::X), ahead];
    // The wall with the door on the far side is in the far half of the room: not in the doorway of the near one.
    let far_wall = ObjectId(0);
    for (module, mode) in [(a, Mode::Portals), (b, Mode::Portals), (a, Mode::PortalsAndPvs)] {
        let (mut open_view, mut shut_view) = (WorldView::new(), WorldView::new());
        shut_view.set_doors(&world, module, &shut).unwrap();
        let sees = |view: &mut WorldView, camera: &Camera| {
            view.cull(&world, camera, mode);
            view.visible(b).is_some_and(|set| set.objects.contains(&far_wall))
        };
        assert!(sees(&mut open_view, &far) && !sees(&mut shut_view, &far), "{mode}");
        // An eye in the doorway may be on either side of the leaf.
        assert!(sees(&mut shut_view, &near), "{mode}");
    }
}

/// A mast of the first room's file, behind both rooms: it is seen through the window of the second alone.
#[test]
fn outdoors_of_a_module_is_seen_through_the_windows_of_another() {
    let mut near = Building::default();
    let (room, outside) = (
        near.cell("room", vec![block(p(0.0, 0.0, 0.0), p(4.0, 3.0, 4.0))]),
        near.outside(p(0.0, 0.0, 0.0), p(4.0, 3.0, 4.0)),
    );
    for [low, high] in [[1.5, 2.5], [0.2, 0.8], [3.2, 3.8]] {
        near.portal(room, outside, p(4.0, 0.5, low), p(4.0, 2.0, high), PortalKind::Window);
    }
    let mast = near.thing("mast", p(20.0, 0.0, 1.9), p(20.2, 3.0, 2.1));
    let (_, near) = near.finish();
    let mut next = Building::default();
    let (porch, outside) = (
        next.cell("porch", vec![block(p(4.0, 0.0, 1.0), p(6.0, 3.0, 3.0))]),
        next.outside(p(4.0, 0.0, 1.0), p(6.0, 3.0, 3.0)),
    );
    next.portal(outside, porch, p(4.0, 0.5, 1.5), p(4.0, 2.0, 2.5), PortalKind::Window);
    next.portal(porch, outside, p(6.0, 0.5, 1.5), p(6.0, 2.0, 2.5), PortalKind::Door);
    next.thing("chest", p(4.1, 0.0, 1.1), p(4.4, 0.3, 1.4));
    let (_, next) = next.finish();
    let cullers = [&near, &next].map(Culler::new);
    let mut world = World::new();
    let at = |file: &PvsFile| Placement::new(DQuat::IDENTITY, file.origin).unwrap();
    let ids = [world.place(&cullers[0], at(&near)), world.place(&cullers[1], at(&next))];
    world.join(ids[0], PortalId(0), ids[1], PortalId(0)).unwrap();
    let mut shut = Doors::open(&cullers[1]);
    shut.set_open(PortalId(1), false);
    let ahead = camera(p(1.0, 1.5, 2.0), DVec3::X);
    for mode in Mode::WITHOUT_QUERIES {
        assert!(set(&mut WorldView::new(), &world, &ids, &ahead, mode).contains(&(0, mast)), "{mode}");
    }
    let mut behind_a_leaf = WorldView::new();
    behind_a_leaf.set_doors(&world, ids[1], &shut).unwrap();
    assert!(!set(&mut behind_a_leaf, &world, &ids, &ahead, Mode::Portals).contains(&(0, mast)));
}

#[test]
fn joins_that_do_not_fit_are_errors_with_a_name() {
    let (_, file) = room();
    let culler = Culler::new(&file);
    let mut world = World::new();
    let a = world.place(&culler, place(&file, 0.0, DVec3::ZERO));
    let off = world.place(&culler, place(&file, 0.0, p(4.0, 0.0, 0.03)));
    let same = world.place(&culler, place(&file, PI, DVec3::ZERO));
    let Err(WorldError::Apart { metres, most }) = world.join(a, EAST, off, WEST) else { panic!("joined") };
    assert!((metres - 0.03).abs() < 1e-5 && (most - 2.0 * culler.tolerance()).abs() < 1e-12, "{metres} {most}");
    // A door of a room in its own place, turned round, lies on the other door, and both rooms are on one side.
    assert_eq!(world.join(a, EAST, same, WEST), Err(WorldError::SameSide));
    assert_eq!(world.join(a, PortalId(7), off, WEST), Err(WorldError::NoPortal(a, PortalId(7))));
    assert_eq!(world.part(a, EAST), Err(WorldError::Open(a, EAST)));
    let b = world.place(&culler, place(&file, 0.0, p(4.0, 0.0, 0.0)));
    world.join(a, EAST, b, WEST).unwrap();
    assert_eq!(world.join(b, WEST, a, EAST), Err(WorldError::Joined(b, WEST)));
    world.part(b, WEST).unwrap();
    assert_eq!(world.joined(a, EAST), Ok(None));
    world.join(a, EAST, b, WEST).unwrap();
    world.remove(b).unwrap();
    assert_eq!(world.joined(a, EAST), Ok(None), "what is removed is parted");
    assert_eq!(world.remove(b), Err(WorldError::Removed(b)));
    let again = world.place(&culler, place(&file, 0.0, p(4.0, 0.0, 0.0)));
    assert!(again.slot == b.slot && again != b);
    assert_eq!(world.join(a, EAST, b, WEST), Err(WorldError::Removed(b)));
    // Within the building.
    let (_, flat) = testing::boxes::flat().0.finish();
    let whole = world.place(&Culler::new(&flat), Placement::IDENTITY);
    let within = |p: &PortalId| Culler::new(&flat).way_in(*p).is_none();
    let portal = (0..flat.portals.len() as u32).map(PortalId).find(within).unwrap();
    assert_eq!(world.join(whole, portal, a, WEST), Err(WorldError::Within(whole, portal)));
}

/// A world of one module is what its culler shows, and all is seen by an eye in no cell.
#[test]
fn a_world_of_one_module_is_its_culler() {
    let mut random = Places::new(11);
    let mut more = [0, 0];
    for _ in 0..10 {
        let (_, file) = Grid::random(&mut random).building();
        let culler = Culler::new(&file);
        let (mut world, mut view, mut alone) = (World::new(), WorldView::new(), View::new(&culler));
        let turned = Placement::new(DQuat::from_rotation_y(random.unit() * 6.0), random.point() * 1e3).unwrap();
        let id = world.place(&culler, turned);
        for _ in 0..40 {
            let bounds = file.objects[random.below(file.objects.len())].bounds.map(|p| p.as_dvec3());
            let (eye, along) =
                (random.between(bounds[0] - 1.0, bounds[1] + 1.0), random.between(DVec3::NEG_ONE, DVec3::ONE));
            let camera = camera(eye, along);
            let Camera { eye, x, y, w } = camera;
            let turn = |v: glam::Vec3| (turned.to_world(v.as_dvec3()) - turned.to_world(DVec3::ZERO)).as_vec3();
            let placed = Camera { eye: turned.to_world(eye.as_dvec3()).as_vec3(), x: turn(x), y: turn(y), w: turn(w) };
            for mode in Mode::WITHOUT_QUERIES {
                let objects: BTreeSet<ObjectId> = alone.cull(&camera, mode).objects.iter().copied().collect();
                let in_world = set(&mut view, &world, &[id], &placed, mode);
                let in_world: BTreeSet<ObjectId> = in_world.into_iter().map(|(_, object)| object).collect();
                // The camera's place is rounded a kilometre from the origin, to a sixteenth of a millimetre.
                more[0] += objects.symmetric_difference(&in_world).count();
                more[1] += objects.len();
            }
        }
    }
    assert!(more[0] * 200 < more[1], "{} of {} differ", more[0], more[1]);
}

/// An office of sixteen rooms, cut anywhere and baked in parts: no pixel is missed in any mode, and rows of ways in hide what the outside's row
/// shows.
#[test]
fn buildings_that_are_cut_and_joined_show_what_the_whole_shows() {
    let mut random = Places::new(5);
    let (mut joins, mut drawn) = (0, [0; 5]);
    let (scene, graph) = testing::rooms::office(4, 6);
    let single = single(&scene);
    for count in [2, 3, 5, 16] {
        let cuts = cut(&scene, &single, &graph, &groups(&graph, count));
        let files: Vec<PvsFile> = cuts.iter().map(baked_module).collect();
        let modules: Vec<(&Module, Arc<Culler>)> = cuts.iter().zip(files.iter().map(Culler::new)).collect();
        let (world, ids) = joined(&modules);
        joins += modules
            .iter()
            .zip(&ids)
            .flat_map(|((m, _), id)| (0..m.portals.len()).map(|p| (*id, p)))
            .fold(0, |n, (id, p)| n + usize::from(world.joined(id, PortalId(p as u32)).unwrap().is_some()));
        let rays = enfilade::scene::rays::RayScene::new(&single);
        let mut view = WorldView::new();
        for _ in 0..30 {
            let cell = &graph.cells[random.below(graph.cells.len())];
            let bounds = cell.pieces[random.below(cell.pieces.len())].bounds;
            let eye = random.between(bounds.min.lerp(bounds.max, 0.01), bounds.max.lerp(bounds.min, 0.01));
            let camera = camera(eye, random.between(DVec3::NEG_ONE, DVec3::ONE));
            let picture = raster::View { camera, near: 1e-3, width: 64, height: 40 };
            let full = raster::draw(&single, &picture, &|_| true);
            let shown = objects_shown(&single, &full);
            for (mode, drawn) in Mode::WITHOUT_QUERIES.into_iter().zip(&mut drawn) {
                let mut kept = vec![false; single.objects.len()];
                for (module, object) in set(&mut view, &world, &ids, &camera, mode) {
                    cuts[module].triangles[object.index()].iter().for_each(|&t| kept[t as usize] = true);
                }
                let missed = missed_pixels(&rays, &picture, &full, &shown, &|object| kept[object.index()]);
                assert_eq!(missed.pixels.len(), 0, "{count} modules, {mode}: from {eye} along {}", camera.w);
                *drawn += kept.iter().filter(|kept| **kept).count();
            }
        }
    }
    let [all, frustum, portals, rows, both] = drawn;
    assert!(joins > 10 && all > frustum && frustum > portals && frustum > rows && portals >= both, "{joins} {drawn:?}");
}

fn baked_module(module: &Module) -> PvsFile {
    let given = Some(module.graph.clone());
    let split = SplitOptions { module: true, ..SplitOptions::default() };
    let file = baked(&module.scene, BakeOptions { given, split, ..with_rays(5000) });
    // What a way in shows is in the row of the outside, and not all of it.
    let ways = file.ways_in.as_ref().unwrap();
    for (row, portal) in ways.portals.iter().enumerate() {
        let before = file.portals[portal.portal().index()].cells[portal.side()];
        assert!(ways.objects.ones(row).all(|o| file.sees_object(before, ObjectId(o as u32))));
    }
    assert_eq!(PvsFile::read(&file.write()).unwrap(), file);
    file
}

/// Things that move are in the sets of the modules that they are inserted in.
#[test]
fn movers_of_a_module_are_seen_through_its_joins() {
    let (_, file) = room();
    let culler = Culler::new(&file);
    let mut world = World::new();
    let a = world.place(&culler, place(&file, 0.0, DVec3::ZERO));
    let b = world.place(&culler, place(&file, 0.0, p(4.0, 0.0, 0.0)));
    world.join(a, EAST, b, WEST).unwrap();
    let mut movers = Movers::new(&culler);
    let boxed = |at: DVec3| [(at - 0.1 - file.origin).as_vec3(), (at + 0.1 - file.origin).as_vec3()];
    let ahead = movers.insert(boxed(p(2.0, 1.0, 2.0))).unwrap();
    let beside = movers.insert(boxed(p(0.2, 1.0, 0.2))).unwrap();
    let above = movers.insert(boxed(p(2.0, 5.0, 2.0))).unwrap();
    let mut view = WorldView::new();
    let mut seen = |eye: DVec3, along: DVec3, mode: Mode| {
        view.cull(&world, &camera(eye, along), mode);
        let mut found = view.movers(b, &movers).to_vec();
        found.sort();
        found
    };
    assert_eq!(seen(p(0.5, 1.0, 2.0), DVec3::X, Mode::Portals), [ahead]);
    assert_eq!(seen(p(5.0, 1.0, 0.2), DVec3::NEG_X, Mode::Portals), [beside]);
    assert_eq!(seen(p(6.0, 5.0, -5.0), DVec3::Z, Mode::Portals), [above]);
    assert_eq!(seen(p(0.5, 1.0, 2.0), DVec3::X, Mode::None), [ahead, beside, above]);
}

/// A room with walls of 0.2 m and a doorway in one, as an author models it: its way in stands where its walls end.
#[test]
fn rooms_that_are_baked_alone_join_at_their_doorways() {
    let scene = testing::meshes::scene([
        solid("floor", [-0.2, -0.2, -0.2], [4.2, 0.0, 4.2]),
        solid("ceiling", [-0.2, 3.0, -0.2], [4.2, 3.2, 4.2]),
        solid("west", [-0.2, 0.0, -0.2], [0.0, 3.0, 4.2]),
        solid("south", [0.0, 0.0, -0.2], [4.0, 3.0, 0.0]),
        solid("north", [0.0, 0.0, 4.0], [4.0, 3.0, 4.2]),
        solid("east", [4.0, 0.0, -0.2], [4.2, 3.0, 1.5]),
        solid("east", [4.0, 0.0, 2.5], [4.2, 3.0, 4.2]),
        solid("lintel", [4.0, 2.1, 1.5], [4.2, 3.0, 2.5]),
        solid("table", [0.5, 0.0, 1.6], [1.5, 0.8, 2.4]),
        solid("chest", [3.5, 0.0, 0.1], [3.9, 0.8, 0.9]),
    ]);
    let [table, chest] = ["table", "chest"].map(|name| scene.objects.iter().position(|o| o.node == name).unwrap());
    let split = SplitOptions { module: true, ..SplitOptions::default() };
    let file = baked(&scene, BakeOptions { split, ..with_rays(20_000) });
    let culler = Culler::new(&file);
    let [door] = culler.ways_in().collect::<Vec<_>>()[..] else { panic!("one way in: {:?}", file.portals) };
    let mut world = World::new();
    let at = |angle: f64| Placement::new(DQuat::from_rotation_y(angle), DVec3::ZERO).unwrap();
    let a = world.place(&culler, at(0.0));
    // Turned half round about the middle of the doorway's outer edge.
    let (turn, hinge) = (DQuat::from_rotation_y(PI), p(4.2, 0.0, 2.0) - file.origin);
    let b = world.place(&culler, Placement::new(turn, hinge - turn * hinge).unwrap());
    world.join(a, door, b, door).unwrap();
    let mut view = WorldView::new();
    let mut sees = |eye: DVec3, object: usize| {
        view.cull(&world, &camera(eye - file.origin, DVec3::X), Mode::PortalsAndPvs);
        view.visible(b).is_some_and(|set| set.objects.contains(&ObjectId(object as u32)))
    };
    assert!(sees(p(2.0, 1.6, 2.0), table) && !sees(p(2.0, 1.6, 2.0), chest));
    assert!(!sees(p(3.9, 1.6, 3.9), table), "past the doorway's edge");
}
