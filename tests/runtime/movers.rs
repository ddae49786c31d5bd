//! Movers: hand-made buildings with known answers, and random ones by brute force.

use enfilade::file::PvsFile;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::runtime::{Camera, Culler, Doors, Mirror, Mode, MoverError, MoverId, Movers, Reflection, View};
use enfilade::{CellId, DirectedPortal, ObjectId, PortalId};
use glam::{DVec2, DVec3, Vec3, Vec4};
use std::collections::BTreeSet;
use testing::boxes::{A, B, CORRIDOR, OUTSIDE, flat, p};
use testing::maze::Grid;
use testing::random::Places;

/// A box by its corners in the model's own coordinates.
fn bounds(file: &PvsFile, min: DVec3, max: DVec3) -> [Vec3; 2] {
    [min, max].map(|q| (q - file.origin).as_vec3())
}

/// A person of 0.5 x 1.8 x 0.5 m at a place.
fn person(file: &PvsFile, x: f64, z: f64) -> [Vec3; 2] {
    bounds(file, p(x - 0.25, 0.05, z - 0.25), p(x + 0.25, 1.85, z + 0.25))
}

fn camera(file: &PvsFile, eye: DVec3, target: DVec3) -> Camera {
    Camera::look_at(eye - file.origin, target - file.origin, 75f64.to_radians(), 16.0 / 9.0)
}

/// Modes in which walls hide.
const HIDING: [Mode; 2] = [Mode::Portals, Mode::PortalsAndPvs];

#[test]
fn who_walks_is_seen_through_doors_and_not_through_walls() {
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
    assert_eq!(view.movers(&movers), [], "there is no frame yet");
    let walker = movers.insert(person(&file, 2.0, 1.0)).unwrap();
    assert_eq!(movers.cells(walker), Ok(&[A][..]));
    // From A towards its door, and along the corridor.
    let (out, along) =
        (camera(&file, p(1.5, 1.6, 2.0), p(1.5, 1.6, 9.0)), camera(&file, p(0.2, 1.6, 5.0), p(9.0, 1.6, 5.0)));
    let mut sees = |camera: &Camera, mode, movers: &Movers| {
        view.cull(camera, mode);
        view.movers(movers) == [walker]
    };
    for mode in HIDING {
        // Behind the eye in A; through the door; beside the door, behind the wall; in B, far along the corridor; outside, beyond the wall.
        let places = [
            (2.0, 1.0, &[A][..], [false, false]),
            (1.5, 5.0, &[CORRIDOR], [true, true]),
            (4.9, 5.3, &[CORRIDOR], [false, true]),
            (8.0, 2.0, &[B], [false, false]),
            (1.5, 12.0, &[OUTSIDE], [false, false]),
            (1.5, 4.0, &[A, CORRIDOR], [true, true]),
        ];
        for (x, z, cells, seen) in places {
            movers.set(walker, person(&file, x, z)).unwrap();
            let mut found = movers.cells(walker).unwrap().to_vec();
            found.sort();
            assert_eq!(found, cells, "{x} {z}");
            let now = [sees(&out, mode, &movers), sees(&along, mode, &movers)];
            assert_eq!(now, seen, "{mode}: {x} {z}");
        }
        movers.set(walker, person(&file, 8.0, 2.0)).unwrap();
    }
    // Rows of this file hide nothing, and walls don't hide from the frustum: in B, if B is in the picture.
    let towards_b = camera(&file, p(1.5, 1.6, 2.0), p(8.0, 1.0, 2.0));
    for (mode, seen) in [(Mode::None, [true; 2]), (Mode::Frustum, [true, false]), (Mode::Pvs, [true, false])] {
        assert_eq!([sees(&towards_b, mode, &movers), sees(&out, mode, &movers)], seen, "{mode}");
    }
}

#[test]
fn rows_hide_movers_in_cells_that_they_leave_out() {
    let (building, _) = flat();
    let (_, file) = building.finish_with(|cells, _| {
        cells.clear(A.index(), B.index());
        cells.clear(B.index(), A.index());
    });
    let culler = Culler::new(&file);
    let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
    let in_b = movers.insert(person(&file, 8.0, 2.0)).unwrap();
    let out_there = movers.insert(person(&file, 30.0, 2.0)).unwrap();
    view.cull(&camera(&file, p(1.5, 1.6, 2.0), p(8.0, 1.0, 2.0)), Mode::Pvs);
    assert_eq!(view.movers(&movers), [out_there]);
    // From the corridor both rooms are in the row.
    view.cull(&camera(&file, p(1.5, 1.6, 5.0), p(8.0, 1.0, 2.0)), Mode::Pvs);
    assert!(view.movers(&movers).contains(&in_b));
    // The shadow of what is in B doesn't fall into A; that of what is in no row's way does.
    assert_eq!(view.movers_in_volume(&movers, &[Vec4::new(0.0, 1.0, 0.0, 1e3)], &[A]), [out_there]);
    let mut all = view.movers_in_volume(&movers, &[Vec4::new(0.0, 1.0, 0.0, 1e3)], &[]).to_vec();
    all.sort();
    assert_eq!(all, [in_b, out_there]);
    // East of the house.
    let east = Vec4::new(-1.0, 0.0, 0.0, -(20.0 - file.origin.x) as f32);
    assert_eq!(view.movers_in_volume(&movers, &[east], &[]), [out_there]);
}

#[test]
fn a_shut_door_hides_who_is_behind_and_shows_who_stands_in_it() {
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    let (mut view, mut movers, mut doors) = (View::new(&culler), Movers::new(&culler), Doors::open(&culler));
    let door = file.portals.iter().position(|q| q.cells.contains(&A) && q.cells.contains(&CORRIDOR)).unwrap();
    doors.set_open(PortalId(door as u32), false);
    let behind = movers.insert(person(&file, 1.5, 5.5)).unwrap();
    let within = movers.insert(bounds(&file, p(1.2, 0.1, 4.1), p(1.8, 1.5, 4.2))).unwrap();
    let out = camera(&file, p(1.5, 1.6, 1.0), p(1.5, 1.6, 9.0));
    for mode in HIDING {
        view.set_doors(&Doors::open(&culler));
        view.cull(&out, mode);
        let mut seen = view.movers(&movers).to_vec();
        seen.sort();
        assert_eq!(seen, [behind, within]);
        view.set_doors(&doors);
        view.cull(&out, mode);
        assert_eq!(view.movers(&movers), [within]);
    }
}

/// Inside a wall, around everything, without end, far away: seen when in the picture, and only then.
#[test]
fn movers_that_are_nowhere_or_everywhere_are_seen_when_in_the_frustum() {
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    let mut view = View::new(&culler);
    let wall = bounds(&file, p(4.95, 0.5, 1.9), p(5.05, 1.0, 2.1));
    let sky = [Vec3::splat(-1e4), Vec3::splat(1e4)];
    let endless = [Vec3::NEG_INFINITY, Vec3::INFINITY];
    let far = [Vec3::new(1e30, -1e28, -1e28), Vec3::new(1.1e30, 1e28, 1e28)];
    let (east, west) = (p(9.0, 1.6, 2.0), p(-9.0, 1.6, 2.0));
    for (name, corners, seen) in [
        ("wall", wall, [true, false]),
        ("sky", sky, [true; 2]),
        ("endless", endless, [true; 2]),
        ("far", far, [true, false]),
    ] {
        let mut movers = Movers::new(&culler);
        let mover = movers.insert(corners).unwrap();
        let cells: &[CellId] = match name {
            "wall" => &[],
            "far" => &[OUTSIDE],
            _ => &[A, B, CORRIDOR, OUTSIDE],
        };
        assert_eq!(movers.cells(mover), Ok(cells), "{name}");
        for mode in [Mode::Frustum, Mode::Pvs].into_iter().chain(HIDING.into_iter().filter(|_| name != "far")) {
            let now = [east, west].map(|target| {
                view.cull(&camera(&file, p(1.5, 1.6, 2.0), target), mode);
                view.movers(&movers) == [mover]
            });
            assert_eq!(now, seen, "{name}, {mode}");
        }
        // An eye in no cell sees by the frustum, too.
        view.cull(&camera(&file, p(5.0, 1.0, 2.4), p(5.0, 1.0, -9.0)), Mode::PortalsAndPvs);
        assert_eq!(view.movers(&movers) == [mover], name != "far", "{name}");
    }
}

#[test]
fn bad_input_is_an_error_with_a_name_and_changes_nothing() {
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
    let nan = [Vec3::NAN, Vec3::ONE];
    let turned = [Vec3::ONE, Vec3::ZERO];
    assert_eq!(movers.insert(turned), Err(MoverError::NotABox(turned)));
    assert!(movers.insert(nan).unwrap_err().to_string().contains("not a box"));
    let first = movers.insert(person(&file, 2.0, 1.0)).unwrap();
    assert!(movers.set(first, nan).is_err() && movers.cells(first) == Ok(&[A]));
    movers.remove(first).unwrap();
    let second = movers.insert(person(&file, 2.0, 1.0)).unwrap();
    assert_eq!((first.slot, second.slot, movers.slots()), (0, 0, 1), "its slot is used again");
    let gone = MoverError::Removed(first);
    assert_eq!((movers.remove(first), movers.set(first, turned), movers.cells(first)), (Err(gone), Err(gone), Err(gone)));
    assert!(gone.to_string().contains("removed"), "{gone}");
    let never = MoverId { slot: 7, life: 0 };
    assert_eq!(movers.remove(never), Err(MoverError::Removed(never)));
    view.cull(&camera(&file, p(1.5, 1.6, 3.0), p(2.0, 1.0, 1.0)), Mode::PortalsAndPvs);
    assert_eq!(view.movers(&movers), [second]);
    movers.remove(second).unwrap();
    assert_eq!(view.movers(&movers), []);
}

/// A cupboard between the eye and a mover: portals and rows see the mover, an oracle doesn't.
#[test]
fn an_oracle_decides_about_movers_that_portals_leave() {
    let (mut building, _) = flat();
    building.thing("cupboard", p(2.0, 0.0, 1.0), p(2.2, 2.9, 3.0));
    let (scene, file) = building.finish();
    let culler = Culler::new(&file);
    let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
    let mut oracle = DepthBuffer::new(&scene, 320, 180);
    let eye = camera(&file, p(0.5, 1.6, 2.0), p(9.0, 1.6, 2.0));
    let behind = movers.insert(person(&file, 2.7, 2.0)).unwrap();
    let before = movers.insert(person(&file, 1.5, 2.2)).unwrap();
    let around = movers.insert(person(&file, 0.5, 2.0)).unwrap();
    for mode in Mode::ALL {
        view.cull_with(&eye, mode, 0.05, &mut oracle);
        let mut seen = view.movers_with(&movers, &mut oracle).to_vec();
        seen.sort();
        let all = [behind, before, around];
        let asks = matches!(mode, Mode::Chc | Mode::ChcPlus);
        assert_eq!(seen, all[usize::from(asks)..], "{mode}");
        // Without the oracle, what portals and rows leave.
        assert_eq!(view.movers(&movers).len(), 3, "{mode}");
    }
}

#[test]
fn a_mirror_shows_who_stands_behind_the_eye() {
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
    // On the wall at z = 0.1, seen from greater z; the eye looks into it.
    let corners = [(0.5, 0.5), (2.5, 0.5), (2.5, 2.0), (0.5, 2.0)].map(|(x, y)| (p(x, y, 0.1) - file.origin).as_vec3());
    let mirrors = [Mirror::new(A, &corners).unwrap()];
    let behind = movers.insert(person(&file, 1.5, 3.5)).unwrap();
    let next_door = movers.insert(person(&file, 8.0, 2.0)).unwrap();
    let eye = camera(&file, p(1.5, 1.6, 2.5), p(1.5, 1.6, 0.0));
    for mode in [Mode::Frustum, Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs] {
        view.cull(&eye, mode);
        assert!(!view.movers(&movers).contains(&behind), "{mode}");
        let shown: Vec<Reflection<'_>> = view.mirrors(&mirrors, 1, Some(&movers)).collect();
        assert!(shown.len() == 1 && shown[0].movers.contains(&behind), "{mode}");
        assert!(!HIDING.contains(&mode) || !shown[0].movers.contains(&next_door), "{mode}");
        assert_eq!(view.mirrors(&mirrors, 1, None).map(|shown| shown.movers.len()).sum::<usize>(), 0);
    }
}

/// A box anywhere around the building, of any size.
fn random_box(grid: &Grid, file: &PvsFile, random: &mut Places) -> [Vec3; 2] {
    let (low, high) = grid.bounds(random.below(grid.faces.len()));
    let at = random.between(low, high);
    let half = DVec3::splat([0.01, 0.3, 1.0, 9.0][random.below(4)]) * random.between(DVec3::splat(0.2), DVec3::ONE);
    bounds(file, at - half, at + half)
}

/// The cells whose boxes a box meets, and those that it comes within a centimetre of.
fn met(grid: &Grid, file: &PvsFile, [min, max]: [Vec3; 2]) -> [BTreeSet<CellId>; 2] {
    [-1e-2, 1e-2].map(|by| {
        let meets = |i: &usize| {
            let (low, high) = grid.bounds(*i);
            let (low, high) = (low - file.origin - by, high - file.origin + by);
            low.cmple(max.as_dvec3()).all() && min.as_dvec3().cmple(high).all()
        };
        (0..grid.faces.len()).filter(meets).map(|i| grid.cell_of[i]).collect()
    })
}

/// Wherever they came from, in small steps and in jumps: the cells of movers are those that their boxes meet, and views see what they would
/// see of movers that were put there at once.
#[test]
fn movers_are_in_the_cells_that_their_boxes_meet_wherever_they_came_from() {
    let mut random = Places::new(41);
    let (mut in_several, mut anywhere, mut seen_of, mut all) = (0, 0, 0, 0);
    for round in 0..40 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let mut movers = Movers::new(&culler);
        let mut boxes: Vec<[Vec3; 2]> = (0..60).map(|_| random_box(&grid, &file, &mut random)).collect();
        let ids: Vec<MoverId> = boxes.iter().map(|b| movers.insert(*b).unwrap()).collect();
        let mut views = [View::new(&culler), View::new(&culler)];
        for _ in 0..12 {
            for (k, id) in ids.iter().enumerate() {
                let by = random.between(DVec3::splat(-0.2), DVec3::splat(0.2)).as_vec3();
                boxes[k] = if k % 5 == 0 { random_box(&grid, &file, &mut random) } else { boxes[k].map(|q| q + by) };
                movers.set(*id, boxes[k]).unwrap();
                let [inner, outer] = met(&grid, &file, boxes[k]);
                let found: BTreeSet<CellId> = movers.cells(*id).unwrap().iter().copied().collect();
                if found.is_empty() {
                    assert!(inner.is_empty() || outer.len() > 8, "round {round}: {inner:?}");
                    anywhere += 1;
                } else {
                    assert!(
                        inner.is_subset(&found) && found.is_subset(&outer),
                        "round {round}: {inner:?} {found:?} {outer:?}"
                    );
                    in_several += usize::from(found.len() > 1);
                }
            }
            let mut fresh = Movers::new(&culler);
            boxes.iter().for_each(|b| _ = fresh.insert(*b).unwrap());
            let (low, high) = grid.bounds(random.below(grid.faces.len()));
            let eye = random.between(low, high);
            let target = eye + random.between(DVec3::NEG_ONE, DVec3::ONE);
            let camera = camera(&file, eye, target);
            for mode in Mode::WITHOUT_QUERIES {
                let sets = [(&movers, 0), (&fresh, 1)].map(|(movers, k)| {
                    views[k].cull(&camera, mode);
                    let mut set = views[k].movers(movers).to_vec();
                    set.sort();
                    assert!(set.is_sorted_by(|a, b| a < b), "each once");
                    set
                });
                assert_eq!(sets[0], sets[1], "round {round}, {mode}");
                seen_of += sets[0].len();
                all += ids.len();
            }
        }
    }
    assert!(in_several > 2000 && anywhere > 20 && seen_of * 3 < all * 2, "{in_several} {anywhere}, {seen_of} of {all}");
}

/// Movers in the boxes of things: whatever a ray meets first is in the set, the modes nest, and through portals alone the movers are those
/// of the things in the set, and the few more whose box comes near to a cell.
#[test]
fn whoever_a_ray_reaches_is_among_the_movers() {
    let mut random = Places::new(17);
    let (mut met, mut kept, mut objects) = (0, 0, 0);
    for round in 0..60 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
        for object in &file.objects {
            movers.insert(object.bounds).unwrap();
        }
        let as_objects = |set: &[MoverId]| set.iter().map(|id| ObjectId(id.slot)).collect::<BTreeSet<ObjectId>>();
        for frame in 0..30 {
            let i = random.below(grid.faces.len());
            let (low, high) = grid.bounds(i);
            let eye = random.between(low.lerp(high, 0.01), high.lerp(low, 0.01));
            let eye = (eye - file.origin).as_vec3().as_dvec3() + file.origin;
            let camera = camera(&file, eye, eye + random.between(DVec3::NEG_ONE, DVec3::ONE));
            let mut things = BTreeSet::new();
            for _ in 0..150 {
                let ndc = DVec2::new(random.unit(), random.unit()) * 2.0 - 1.0;
                grid.walk(i, eye, camera.ray(ndc), 0, &mut |_, _, thing| things.extend(thing));
            }
            met += things.len();
            let sets = [Mode::PortalsAndPvs, Mode::Portals, Mode::Frustum, Mode::None].map(|mode| {
                let drawn: BTreeSet<ObjectId> = view.cull(&camera, mode).objects.iter().copied().collect();
                let set = as_objects(view.movers(&movers));
                assert!(things.is_subset(&set), "round {round}, frame {frame}, {mode}");
                if mode != Mode::PortalsAndPvs {
                    assert!(drawn.is_subset(&set), "round {round}, frame {frame}, {mode}");
                }
                if mode == Mode::Portals {
                    (kept, objects) = (kept + set.len(), objects + drawn.len());
                }
                set
            });
            assert!(sets.is_sorted_by(|a, b| a.is_subset(b)), "round {round}, frame {frame}");
            view.cull(&camera, Mode::Pvs);
            let by_row = as_objects(view.movers(&movers));
            assert!(sets[0].is_subset(&by_row) && by_row.is_subset(&sets[2]));
        }
    }
    assert!(met > 1000 && kept < objects + objects / 20, "{met} met, {kept} movers for {objects} objects");
}

/// With doors that are open, shut, or shut one way: the movers around an eye are those of all its views, and more than its objects.
#[test]
fn movers_around_an_eye_are_those_that_it_sees_in_any_direction() {
    let mut random = Places::new(29);
    let (mut kept, mut all, mut in_views) = (0, 0, 0);
    for round in 0..60 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let (mut view, mut movers, mut doors) = (View::new(&culler), Movers::new(&culler), Doors::open(&culler));
        for side in (0..2 * file.portals.len() as u32).map(DirectedPortal) {
            doors.set_see_through(side, random.unit() < 0.4);
        }
        view.set_doors(&doors);
        for object in &file.objects {
            movers.insert(object.bounds).unwrap();
        }
        for _ in 0..20 {
            let (low, high) = grid.bounds(random.below(grid.faces.len()));
            let eye = random.between(low.lerp(high, 0.01), high.lerp(low, 0.01));
            let at = (eye - file.origin).as_vec3();
            let around: BTreeSet<ObjectId> = view.movers_around(&movers, at).iter().map(|id| ObjectId(id.slot)).collect();
            let seen = view.around(at);
            assert!(seen.objects.iter().all(|object| around.contains(object)), "round {round}: from {eye}");
            for _ in 0..6 {
                view.cull(&camera(&file, eye, eye + random.between(DVec3::NEG_ONE, DVec3::ONE)), Mode::PortalsAndPvs);
                let seen = view.movers(&movers);
                assert!(seen.iter().all(|id| around.contains(&ObjectId(id.slot))), "round {round}: from {eye}");
                in_views += seen.len();
            }
            (kept, all) = (kept + around.len(), all + file.objects.len());
        }
    }
    assert!(in_views > 1000 && kept * 10 < all * 9, "{in_views}; {kept} of {all}");
    // In no cell: everything.
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    let (mut view, mut movers) = (View::new(&culler), Movers::new(&culler));
    let walker = movers.insert(person(&file, 8.0, 2.0)).unwrap();
    let [nowhere, in_a] = [p(5.0, 1.0, 2.0), p(1.5, 1.6, 2.0)].map(|q| (q - file.origin).as_vec3());
    assert_eq!(view.movers_around(&movers, nowhere), [walker]);
    // Asking for movers does not tell the objects.
    assert!(view.around(in_a).is_new);
    assert_eq!(view.movers_around(&movers, nowhere), [walker]);
    assert_eq!(view.movers_around(&movers, in_a), [walker], "through two doors");
    assert_eq!([view.around(in_a).is_new, view.around(in_a).is_new], [true, false]);
}
