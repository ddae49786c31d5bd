//! Doors, one-way windows, mirrors and sets without a camera, by brute force on random buildings: rays are walked from box to box.

use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, Culler, Doors, MOST_REFLECTIONS, Mirror, Mode, Reflection, View};
use enfilade::{CellId, DirectedPortal, ObjectId, PortalId};
use glam::{DVec2, DVec3, Vec3, Vec4};
use std::collections::{BTreeMap, BTreeSet};
use testing::boxes::{A, B, CORRIDOR, flat, p};
use testing::maze::Grid;
use testing::random::Places;

/// A camera somewhere in the building, and the box that its eye is in.
fn camera(grid: &Grid, file: &PvsFile, random: &mut Places) -> (Camera, DVec3, usize) {
    let i = random.below(grid.faces.len());
    let (low, high) = grid.bounds(i);
    let eye = random.between(low.lerp(high, 0.01), high.lerp(low, 0.01));
    let eye = (eye - file.origin).as_vec3().as_dvec3() + file.origin;
    let target = eye + random.between(DVec3::NEG_ONE, DVec3::ONE);
    let fov = [20.0, 75.0, 120.0][random.below(3)];
    (Camera::look_at(eye - file.origin, target - file.origin, f64::to_radians(fov), 1.6), eye, i)
}

fn sorted(objects: &[ObjectId]) -> Vec<ObjectId> {
    let mut objects = objects.to_vec();
    objects.sort();
    objects
}

#[test]
fn a_shut_door_hides_what_is_behind_until_it_opens() {
    let (mut building, things) = flat();
    let leaf = building.thing("leaf in the doorway", p(1.0, 0.01, 4.3), p(2.0, 2.1, 4.34));
    let (_, file) = building.finish();
    let culler = Culler::new(&file);
    let (mut view, mut doors) = (View::new(&culler), Doors::open(&culler));
    let door = |c: CellId| file.portals.iter().position(|q| q.cells.contains(&c) && q.cells.contains(&CORRIDOR)).unwrap();
    let door = PortalId(door(A) as u32);
    let camera = |eye: DVec3, target: DVec3| Camera::look_at(eye - file.origin, target - file.origin, 1.3, 1.6);
    let out = camera(p(1.5, 1.6, 2.0), p(1.5, 1.6, 9.0));
    let into = camera(p(1.5, 1.6, 5.0), p(1.5, 1.6, 0.0));
    for mode in [Mode::Portals, Mode::PortalsAndPvs] {
        let mut sees = |doors: &Doors, camera: &Camera, object| {
            view.set_doors(doors);
            view.cull(camera, mode).objects.contains(&object)
        };
        assert!(sees(&doors, &out, things.in_corridor) && sees(&doors, &into, things.in_a));
        doors.set_open(door, false);
        assert!(!sees(&doors, &out, things.in_corridor) && !sees(&doors, &into, things.in_a));
        // From where its leaf may be behind the eye it counts as open; what is in the doorway is seen from anywhere.
        assert!(sees(&doors, &camera(p(1.5, 1.6, 3.5), p(0.75, 1.0, 5.5)), things.in_corridor));
        assert!(sees(&doors, &out, leaf));
        // Seen through from the room only.
        let leads_out = (0..2).map(|side| door.directed(side)).find(|d| file.portals[door.index()].cells[d.side()] == A);
        doors.set_see_through(leads_out.unwrap(), true);
        assert!(sees(&doors, &out, things.in_corridor) && !sees(&doors, &into, things.in_a));
        doors.set_open(door, true);
        assert!(sees(&doors, &out, things.in_corridor) && sees(&doors, &into, things.in_a));
    }
}

#[test]
fn doors_as_found_are_shut_where_the_file_says_so() {
    let (building, _) = flat();
    let (_, mut file) = building.finish();
    let solid = (0..file.portals.len()).find(|&i| file.portals[i].cells.contains(&A)).unwrap();
    let glass = (0..file.portals.len()).find(|&i| file.portals[i].cells.contains(&B)).unwrap();
    file.portals.iter_mut().for_each(|q| (q.state.shut, q.state.see_through) = (false, false));
    file.portals[solid].state.shut = true;
    (file.portals[glass].state.shut, file.portals[glass].state.see_through) = (true, true);
    let culler = Culler::new(&file);
    let (open, doors) = (View::new(&culler).doors().clone(), Doors::as_found(&culler));
    assert!((0..2 * file.portals.len() as u32).all(|d| open.is_open(DirectedPortal(d))), "everything is open at first");
    assert!(doors.shut().eq([PortalId(solid as u32)]));
    let is_open = |i: usize| (0..2).map(|side| doors.is_open(PortalId(i as u32).directed(side))).collect::<Vec<_>>();
    assert_eq!((is_open(solid), is_open(glass)), (vec![false; 2], vec![true; 2]));
}

/// With doors shut at random, both ways or one: everything that a ray reaches is in the set, and much that it doesn't isn't.
#[test]
fn everything_that_a_ray_reaches_past_shut_doors_is_in_the_set() {
    let mut random = Places::new(5);
    let (mut found, mut kept, mut kept_open) = (0, 0, 0);
    for round in 0..60 {
        let mut grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let (mut open, mut view, mut doors) = (View::new(&culler), View::new(&culler), Doors::open(&culler));
        for (portal, (i, axis)) in grid.doors().into_iter().enumerate() {
            for side in 0..2 {
                if random.unit() < 0.4 {
                    grid.blocked.insert((i, axis, side == 0));
                    doors.set_see_through(PortalId(portal as u32).directed(side), false);
                }
            }
        }
        view.set_doors(&doors);
        for frame in 0..30 {
            let (camera, eye, i) = camera(&grid, &file, &mut random);
            let mut things = BTreeSet::new();
            for _ in 0..150 {
                let ndc = DVec2::new(random.unit(), random.unit()) * 2.0 - 1.0;
                grid.walk(i, eye, camera.ray(ndc), 0, &mut |_, _, thing| things.extend(thing));
            }
            found += things.len();
            for mode in [Mode::Portals, Mode::PortalsAndPvs] {
                let seen = view.cull(&camera, mode);
                kept += seen.cells.len();
                let set = sorted(seen.objects);
                let missing: Vec<_> = things.iter().filter(|t| set.binary_search(t).is_err()).collect();
                assert!(missing.is_empty(), "round {round}, frame {frame}, {mode}: {missing:?} seen from {eye}");
                kept_open += open.cull(&camera, mode).cells.len();
            }
        }
    }
    assert!(found > 1000 && kept * 20 < kept_open * 19, "{found} things found, {kept} of {kept_open} cells");
}

/// With doors shut at random: what is seen around an eye holds everything that the portals show it in any direction, is the same from
/// every eye that stands in an equal place, and leaves out much that open doors would show.
#[test]
fn what_is_seen_around_an_eye_is_what_it_sees_in_all_directions() {
    let mut random = Places::new(11);
    let (mut kept, mut kept_open, mut again) = (0, 0, 0);
    for round in 0..60 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let (mut open, mut view, mut doors) = (View::new(&culler), View::new(&culler), Doors::open(&culler));
        for side in (0..2 * file.portals.len() as u32).map(DirectedPortal) {
            doors.set_see_through(side, random.unit() < 0.4);
        }
        view.set_doors(&doors);
        type Place = (Vec<CellId>, Vec<PortalId>);
        let mut known: Vec<(Place, Vec<ObjectId>)> = Vec::new();
        let mut last = None;
        for _ in 0..30 {
            let (camera, eye, i) = camera(&grid, &file, &mut random);
            let mut frame = view.cull(&camera, Mode::PortalsAndPvs);
            let (mut homes, near) = (frame.homes.to_vec(), frame.near_doors().to_vec());
            homes.sort();
            assert!(homes.contains(&grid.cell_of[i]) && near.iter().all(|portal| doors.shut().any(|p| p == *portal)));
            let seen = view.around(camera.eye);
            let (around, place) = (sorted(seen.objects), (homes, near));
            assert_eq!(seen.is_new, last.as_ref() != Some(&place), "round {round}");
            last = Some(place.clone());
            for _ in 0..6 {
                let target = eye + random.between(DVec3::NEG_ONE, DVec3::ONE);
                let camera = Camera::look_at(eye - file.origin, target - file.origin, 2.0, 1.6);
                for object in view.cull(&camera, Mode::PortalsAndPvs).objects {
                    assert!(around.binary_search(object).is_ok(), "round {round}: object {object} is seen from {eye}");
                }
            }
            kept += around.len();
            match known.iter().find(|(p, _)| *p == place) {
                Some((_, before)) => {
                    assert_eq!(before, &around, "round {round}");
                    again += 1;
                }
                None => known.push((place.clone(), around)),
            }
            let row: BTreeSet<ObjectId> = place.0.iter().flat_map(|&cell| culler.objects_from(cell)).collect();
            assert_eq!(sorted(open.around(camera.eye).objects), Vec::from_iter(row), "with all doors open, the rows");
            kept_open += open.around(camera.eye).objects.len();
        }
    }
    assert!(again > 100 && kept * 10 < kept_open * 9, "{again} places again, {kept} of {kept_open} objects");
    // In no cell: everything.
    let (_, file) = flat().0.finish();
    let mut view = View::new(&Culler::new(&file));
    for (eye, is_new) in [((p(5.0, 1.0, 2.0) - file.origin).as_vec3(), true), (Vec3::NAN, false)] {
        let around = view.around(eye);
        assert_eq!((around.objects.len(), around.is_new), (file.objects.len(), is_new));
    }
}

/// The mirrors of a grid, for its file.
fn mirrors(grid: &Grid, file: &PvsFile) -> Vec<Mirror> {
    let mirror = |&(i, axis, up, low, high): &(usize, usize, bool, DVec3, DVec3)| {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = |a: DVec3, b: DVec3| {
            let mut q = low;
            (q[u], q[v]) = (a[u], b[v]);
            (q - file.origin).as_vec3()
        };
        // Counter-clockwise seen from the tip of +axis; the room lies below an upper face.
        let mut corners = vec![corner(low, low), corner(high, low), corner(high, high), corner(low, high)];
        if up {
            corners.reverse();
        }
        Mirror::new(grid.cell_of[i], &corners).unwrap()
    };
    grid.mirrors.iter().map(mirror).collect()
}

/// With mirrors on the walls: everything that a ray reaches after some mirrors have turned it is in the set of the reflection in just
/// these mirrors, and the reflections leave something out.
#[test]
fn everything_that_a_ray_reaches_in_mirrors_is_in_their_sets() {
    const DEPTH: usize = 3;
    let mut random = Places::new(23);
    let (mut found, mut deep, mut kept, mut all) = (0, 0, 0, 0);
    for round in 0..60 {
        let mut grid = Grid::random(&mut random);
        grid.hang_mirrors(&mut random, 0.15);
        let (_, file) = grid.building();
        let (culler, mirrors) = (Culler::new(&file), mirrors(&grid, &file));
        let mut view = View::new(&culler);
        for frame in 0..30 {
            let (camera, eye, i) = camera(&grid, &file, &mut random);
            let mut things: BTreeMap<Vec<usize>, BTreeSet<ObjectId>> = BTreeMap::new();
            for _ in 0..200 {
                let ndc = DVec2::new(random.unit(), random.unit()) * 2.0 - 1.0;
                let mut visit = |turned: &[usize], _, thing| {
                    if !turned.is_empty() {
                        things.entry(turned.to_vec()).or_default().extend(thing);
                    }
                };
                grid.walk(i, eye, camera.ray(ndc), DEPTH, &mut visit);
            }
            for mode in [Mode::Frustum, Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs] {
                view.cull(&camera, mode);
                let out: Vec<Reflection<'_>> = view.mirrors(&mirrors, DEPTH as u32, None).collect();
                let capped = out.iter().any(|reflection| reflection.stats.capped > 0);
                let way = |mut view: usize| {
                    let mut turned = vec![out[view].mirror];
                    while let Some(parent) = out[view].parent {
                        turned.insert(0, out[parent].mirror);
                        view = parent;
                    }
                    turned
                };
                let sets: BTreeMap<Vec<usize>, Vec<ObjectId>> =
                    out.iter().enumerate().map(|(v, reflection)| (way(v), sorted(reflection.objects))).collect();
                for (turned, things) in things.iter().filter(|_| !capped) {
                    let Some(set) = sets.get(turned) else {
                        panic!("round {round}, frame {frame}, {mode}: no view by {turned:?}")
                    };
                    let missing: Vec<_> = things.iter().filter(|t| set.binary_search(t).is_err()).collect();
                    assert!(missing.is_empty(), "round {round}, frame {frame}, {mode}, {turned:?}: {missing:?} from {eye}");
                    found += things.len();
                    deep += if turned.len() > 1 { things.len() } else { 0 };
                }
                if mode == Mode::PortalsAndPvs {
                    kept += sets.values().map(Vec::len).sum::<usize>();
                    all += sets.len() * file.objects.len();
                }
            }
        }
    }
    assert!(found > 2000 && deep > 200, "{found} things in mirrors, {deep} of them in more than one");
    assert!(kept * 4 < all, "{kept} of {all} kept");
}

#[test]
fn a_mirror_shows_the_room_on_the_pixels_of_a_camera_behind_it() {
    let corners = [(0.0, 0.0), (0.0, 2.0), (2.0, 2.0), (2.0, 0.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
    assert!(Mirror::new(A, &corners[..2]).is_none() && Mirror::new(A, &[Vec3::NAN; 3]).is_none());
    // Clockwise in x and y: the room lies at negative z.
    let mirror = Mirror::new(A, &corners).unwrap();
    let camera = Camera::look_at(DVec3::new(1.0, 1.0, -3.0), DVec3::new(1.0, 1.5, 0.0), 1.0, 1.5);
    let behind = mirror.reflect(&camera);
    assert_eq!(behind.eye, Vec3::new(1.0, 1.0, 3.0));
    let project = |camera: &Camera, q: Vec3| {
        let v = q - camera.eye;
        glam::Vec2::new(camera.x.dot(v), camera.y.dot(v)) / camera.w.dot(v)
    };
    // A point in the room, by its image behind the mirror, and by the other camera.
    let (point, image) = (Vec3::new(0.3, 1.7, -1.0), Vec3::new(0.3, 1.7, 1.0));
    assert!(project(&camera, image).distance(project(&behind, point)) < 1e-6);
    assert!(project(&camera, Vec3::new(1.0, 1.0, 0.0)).distance(project(&behind, Vec3::new(1.0, 1.0, 0.0))) < 1e-6);
}

#[test]
fn two_facing_mirrors_are_bounded_and_say_so() {
    let (building, things) = flat();
    let (_, file) = building.finish();
    let culler = Culler::new(&file);
    let quad = |z: f64, turned: bool| {
        let mut c =
            [(0.5, 0.5), (2.5, 0.5), (2.5, 2.0), (0.5, 2.0)].map(|(x, y)| (p(x, y, z) - file.origin).as_vec3()).to_vec();
        if turned {
            c.reverse();
        }
        Mirror::new(A, &c).unwrap()
    };
    let facing = [quad(0.5, false), quad(3.5, true)];
    let eye = p(1.5, 1.3, 2.0) - file.origin;
    let camera = Camera::look_at(eye, eye - DVec3::Z, 1.2, 1.0);
    let mut view = View::new(&culler);
    assert_eq!(view.mirrors(&facing, 5, None).len(), 0, "there is no frame yet");
    view.cull(&camera, Mode::PortalsAndPvs);
    for depth in [0, 1, 5] {
        let out: Vec<Reflection<'_>> = view.mirrors(&facing, depth, None).collect();
        // One wall is behind the eye: there is one way to each depth, the mirrors in turn.
        let seen: Vec<(usize, u32)> = out.iter().map(|v| (v.mirror, v.depth)).collect();
        assert_eq!(seen, (1..=depth).map(|d| ((d as usize + 1) % 2, d)).collect::<Vec<_>>());
        assert!(out.iter().all(|view| view.objects.contains(&things.in_a) && !view.objects.contains(&things.in_b)));
    }
    let out: Vec<Reflection<'_>> = view.mirrors(&facing, 1000, None).collect();
    assert!(out.len() <= MOST_REFLECTIONS);
    assert!(out.len() < MOST_REFLECTIONS || out.iter().any(|view| view.stats.capped > 0));
}

/// What is so many portals away from a cell, against distances that are relaxed until nothing changes.
fn check_hops(view: &mut View, file: &PvsFile, shut: &[PortalId], c: CellId) {
    let mut away: Vec<u32> = vec![u32::MAX; file.cells.len()];
    away[c.index()] = 0;
    for _ in 0..file.cells.len() {
        for (_, portal) in file.portals.iter().enumerate().filter(|(i, _)| !shut.contains(&PortalId(*i as u32))) {
            let [a, b] = portal.cells.map(CellId::index);
            away[a] = away[a].min(away[b].saturating_add(1));
            away[b] = away[b].min(away[a].saturating_add(1));
        }
    }
    for hops in [0, 1, 2, u32::MAX - 1] {
        let mut found = view.within_hops(c, hops).to_vec();
        assert!(found.is_sorted_by_key(|f| f.1) && found[0] == (c, 0));
        found.sort();
        let near = (0..file.cells.len() as u32).map(|k| (CellId(k), away[k as usize]));
        let expected: Vec<(CellId, u32)> = near.filter(|f| f.1 <= hops).collect();
        assert_eq!(found, expected);
    }
}

/// What is in a random volume, against every box.
fn check_volume(view: &mut View, file: &PvsFile, random: &mut Places) {
    let planes: Vec<Vec4> = (0..1 + random.below(6))
        .map(|_| {
            let n = random.between(DVec3::NEG_ONE, DVec3::ONE) * 10f64.powf(random.unit() * 6.0 - 3.0);
            let through = random.between(DVec3::splat(-10.0), DVec3::splat(10.0));
            n.extend(n.dot(through)).as_vec4()
        })
        .collect();
    let meets = |o: &enfilade::file::FileObject| {
        let [min, max] = o.bounds.map(|q| q.as_dvec3());
        planes.iter().all(|q| {
            let n = q.truncate().as_dvec3();
            let lowest = DVec3::select(n.cmpgt(DVec3::ZERO), min, max);
            n.dot(lowest) <= f64::from(q.w)
        })
    };
    let inside: Vec<ObjectId> = (0u32..).zip(&file.objects).filter(|(_, o)| meets(o)).map(|(i, _)| ObjectId(i)).collect();
    let found = view.in_volume(&planes, &[]).to_vec();
    assert!(inside.iter().all(|o| found.binary_search(o).is_ok()), "nothing that meets it is left out");
    assert!(found.len() <= inside.len() + 1, "{} of {}", found.len(), inside.len());
    let from = [CellId(random.below(file.cells.len()) as u32)];
    let lit = view.in_volume(&planes, &from).to_vec();
    let in_row = |o: &ObjectId| file.object_rows.as_ref().is_none_or(|rows| rows.get(from[0].index(), o.index()));
    assert!(lit.iter().eq(found.iter().filter(|o| in_row(o))));
}

/// Hops by a search of its own, rows as the file has them, and volumes against every box.
#[test]
fn sets_without_a_camera_are_what_they_are_called() {
    let (mut random, mut with_rows) = (Places::new(77), 0);
    for _ in 0..40 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let (mut view, mut doors) = (View::new(&culler), Doors::open(&culler));
        let shut: Vec<PortalId> = (0..file.portals.len() as u32).map(PortalId).filter(|_| random.unit() < 0.2).collect();
        shut.iter().for_each(|&portal| doors.set_open(portal, false));
        view.set_doors(&doors);
        for c in (0..file.cells.len() as u32).map(CellId) {
            check_hops(&mut view, &file, &shut, c);
            let (objects, cells) = (culler.objects_from(c).map(|o| o.index()), culler.visible_from(c).map(|o| o.index()));
            match (&file.object_rows, &file.cell_rows) {
                (Some(of_objects), Some(of_cells)) => {
                    with_rows += 1;
                    assert!(objects.eq(of_objects.ones(c.index())) && cells.eq(of_cells.ones(c.index())));
                }
                _ => assert!(objects.eq(0..file.objects.len()) && cells.eq(0..file.cells.len())),
            }
        }
        (0..20).for_each(|_| check_volume(&mut view, &file, &mut random));
    }
    assert!(with_rows > 50, "{with_rows} cells with rows");
}
