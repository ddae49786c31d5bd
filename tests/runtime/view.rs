//! What a view tells beside its objects: runs, homes, doors; keys of portals; and cameras whose lines of sight are parallel.

use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, Culler, Doors, Mode, View};
use enfilade::{CellId, ObjectId, PortalId};
use glam::{DVec3, Vec3};
use std::collections::BTreeSet;
use testing::boxes::{A, B, CORRIDOR, flat, p};
use testing::maze::Grid;
use testing::random::Places;

fn camera(file: &PvsFile, eye: DVec3, target: DVec3) -> Camera {
    Camera::look_at(eye - file.origin, target - file.origin, 1.3, 1.6)
}

/// The portal between two cells.
fn portal(file: &PvsFile, a: CellId, b: CellId) -> PortalId {
    let joins = |q: &enfilade::file::FilePortal| q.cells.contains(&a) && q.cells.contains(&b);
    PortalId(file.portals.iter().position(joins).unwrap() as u32)
}

/// Each index of an object in the set is in one run, no other is, and no two runs touch.
#[test]
fn runs_are_the_index_ranges_of_the_objects_with_neighbours_joined() {
    let mut random = Places::new(7);
    let (mut runs_of, mut objects_of) = (0, 0);
    for _ in 0..30 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let mut view = View::new(&culler);
        for _ in 0..20 {
            let (low, high) = grid.bounds(random.below(grid.faces.len()));
            let eye = random.between(low, high);
            let camera = camera(&file, eye, eye + random.between(DVec3::NEG_ONE, DVec3::ONE));
            for mode in Mode::WITHOUT_QUERIES {
                let mut set = view.cull(&camera, mode);
                let (objects, runs) = (set.objects.to_vec(), set.runs().to_vec());
                let mut starts = vec![0u32];
                file.objects.iter().for_each(|o| starts.push(starts[starts.len() - 1] + 3 * o.triangles));
                let expected: BTreeSet<u32> =
                    objects.iter().flat_map(|o| starts[o.index()]..starts[o.index() + 1]).collect();
                assert!(runs.iter().cloned().flatten().eq(expected), "{mode}: ascending, each once");
                assert!(runs.windows(2).all(|pair| pair[0].end < pair[1].start), "{mode}: {runs:?}");
                assert!(objects.iter().all(|o| culler.indices(*o) == (starts[o.index()]..starts[o.index() + 1])));
                (runs_of, objects_of) = (runs_of + runs.len(), objects_of + objects.len());
            }
        }
    }
    assert!(runs_of * 2 < objects_of, "{runs_of} runs of {objects_of} objects: nothing is joined");
}

#[test]
fn an_eye_on_a_border_is_told_all_its_cells_and_one_in_a_doorway_its_door() {
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    let (mut view, mut doors) = (View::new(&culler), Doors::open(&culler));
    let door = portal(&file, A, CORRIDOR);
    let homes_and_doors = |view: &mut View, z: f64| {
        let mut set = view.cull(&camera(&file, p(1.5, 1.6, z), p(1.5, 1.6, 9.0)), Mode::PortalsAndPvs);
        let mut homes = set.homes.to_vec();
        homes.sort();
        (homes, set.near_doors().to_vec())
    };
    assert_eq!(homes_and_doors(&mut view, 4.0), (vec![A, CORRIDOR], vec![]), "an open door is none that counts as open");
    doors.set_open(door, false);
    doors.set_open(portal(&file, B, CORRIDOR), false);
    view.set_doors(&doors);
    assert!(doors.shut().eq([door, portal(&file, B, CORRIDOR)]) && view.doors() == &doors);
    for (z, homes, near) in
        [(4.0, vec![A, CORRIDOR], true), (3.5, vec![A], true), (4.5, vec![CORRIDOR], true), (2.0, vec![A], false)]
    {
        let near = if near { vec![door] } else { vec![] };
        assert_eq!(homes_and_doors(&mut view, z), (homes, near), "{z}");
    }
}

#[test]
fn two_views_of_one_culler_have_doors_of_their_own() {
    let (building, things) = flat();
    let (_, file) = building.finish();
    let culler = Culler::new(&file);
    let mut views = [View::new(&culler), View::new(&culler)];
    let mut doors = Doors::open(&culler);
    doors.set_open(portal(&file, A, CORRIDOR), false);
    views[1].set_doors(&doors);
    let out = camera(&file, p(1.5, 1.6, 2.0), p(1.5, 1.6, 9.0));
    // On a thread of its own, too.
    let seen = std::thread::scope(|threads| {
        let see = |view: &mut View| view.cull(&out, Mode::Portals).objects.contains(&things.in_corridor);
        views.each_mut().map(|view| threads.spawn(move || see(view))).map(|thread| thread.join().unwrap())
    });
    assert_eq!(seen, [true, false]);
}

/// Of portals in any order: unique keys, the same for the same portal, and each leads back to its portal.
#[test]
fn keys_of_portals_are_unique_and_outlive_another_order() {
    let (_, mut file) = flat().0.finish();
    let [a, b, window] = [portal(&file, A, CORRIDOR), portal(&file, B, CORRIDOR), PortalId(2)];
    assert_eq!(Culler::new(&file).portal_key(a), "A | corridor");
    assert_eq!(Culler::new(&file).portal("outside | A"), None, "names in order");
    assert_eq!(Culler::new(&file).portal("A | outside"), Some(window));
    // One GlobalId for both doors, and a window whose own is like a made one.
    for (portal, source) in [(a, "door"), (b, "door"), (window, "door #2")] {
        file.portals[portal.index()].source = Some(source.into());
    }
    // By their places: A is at lesser x.
    let expected = [(a, "door"), (b, "door #3"), (window, "door #2")];
    let mut turned = file.clone();
    turned.portals.reverse();
    let last = file.portals.len() as u32 - 1;
    for (file, number) in [(&file, 0), (&turned, last)] {
        let culler = Culler::new(file);
        for (portal, key) in expected {
            let portal = PortalId(portal.0.abs_diff(number));
            assert_eq!((culler.portal_key(portal), culler.portal(key)), (key, Some(portal)));
        }
        assert_eq!(culler.portal("no such door"), None);
    }
}

/// All that is in the column, whatever the mode, wherever the camera stands: nothing is known of lines that start anywhere.
#[test]
fn an_orthographic_camera_sees_its_column() {
    let mut random = Places::new(9);
    let (mut kept, mut all) = (0, 0);
    for _ in 0..40 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let mut view = View::new(&Culler::new(&file));
        let (low, high) = grid.bounds(random.below(grid.faces.len()));
        let eye = random.between(low, high) - file.origin;
        let (width, height) = (1.0 + 5.0 * random.unit(), 1.0 + 5.0 * random.unit());
        // Downwards: y on the screen is along -z or z, x along x.
        let camera = Camera::orthographic(eye, eye - DVec3::Y, width, height);
        let meets = |[min, max]: [Vec3; 2], by: f64| {
            let (half, eye) = (DVec3::new(width, 1e9, height) * 0.5 + by, eye.as_vec3().as_dvec3());
            (min.as_dvec3() - eye).cmple(half).all() && (max.as_dvec3() - eye).cmpge(-half).all()
        };
        let within = |by: f64| {
            let ids = (0u32..).map(ObjectId).zip(&file.objects);
            ids.filter(|(_, o)| meets(o.bounds, by)).map(|(id, _)| id).collect::<BTreeSet<ObjectId>>()
        };
        for mode in Mode::ALL.into_iter().filter(|&mode| mode != Mode::None) {
            let set: BTreeSet<ObjectId> = view.cull(&camera, mode).objects.iter().copied().collect();
            assert!(within(-1e-4).is_subset(&set) && set.is_subset(&within(1e-4)), "{mode}");
            (kept, all) = (kept + set.len(), all + file.objects.len());
        }
        assert_eq!(view.cull(&camera, Mode::None).objects.len(), file.objects.len());
    }
    assert!(kept > 1000 && kept * 2 < all, "{kept} of {all}");
}

#[test]
fn ids_are_their_number_in_memory() {
    assert_eq!([size_of::<ObjectId>(), size_of::<CellId>(), size_of::<PortalId>()], [4; 3]);
    #[cfg(feature = "gpu")]
    assert_eq!(bytemuck::cast_slice::<ObjectId, u32>(&[ObjectId(7), ObjectId(9)]), [7, 9]);
}
