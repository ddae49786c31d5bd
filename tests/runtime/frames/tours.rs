//! Tours, and walks along them: whether a picture misses a pixel.

use enfilade::file::{FileCell, PvsFile};
use enfilade::runtime::{Culler, Mode, View};
use enfilade::scene::{Role, Scene};
use enfilade_measure::walkthrough::mode::WalkMode;
use enfilade_measure::walkthrough::path::{CameraPath, PathFrame};
use enfilade_measure::walkthrough::tour::tour;
use enfilade_measure::walkthrough::walk::{Summary, WalkOptions, walk};
use glam::DVec3;
use testing::bakes;
use testing::boxes::{A, Building, CORRIDOR, flat, p};

fn options(modes: &[Mode]) -> WalkOptions {
    bakes::walk(modes.iter().copied(), [160, 90])
}

fn summaries(scene: &Scene, file: &PvsFile, path: &CameraPath, modes: &[Mode]) -> Vec<Summary> {
    walk(scene, file, path, &options(modes), &mut |_| {}).unwrap()
}

#[test]
fn a_tour_enters_every_cell_and_misses_no_pixel() {
    let (building, _) = flat();
    let (scene, file) = building.finish();
    for seed in 0..4 {
        let path = tour(&file, seed);
        path.validate().unwrap();
        assert_eq!(path, tour(&file, seed));
        let mut view = View::new(&Culler::new(&file));
        let mut entered = vec![false; file.cells.len()];
        for frame in 0..path.frames.len() {
            let home = view.cull(&path.camera(frame, file.origin, 1.6), Mode::Portals).homes.first().copied();
            entered[home.expect("a tour stays in cells").index()] = true;
        }
        assert!(entered.iter().all(|&e| e), "seed {seed}: {entered:?}");
    }
    let path = tour(&file, 0);
    let all = summaries(&scene, &file, &path, &Mode::WITHOUT_QUERIES);
    for s in &all {
        assert_eq!((s.missed_pixels, s.frames), (Some(0), path.frames.len()), "{}", s.mode);
        assert!(s.triangles_mean >= s.exact_triangles_mean.unwrap(), "{}", s.mode);
    }
    assert!(all[4].triangles_mean < all[1].triangles_mean && all[1].triangles_mean < all[0].triangles_mean);
}

/// A chink in a wall is no place to stand in: who is in it has surfaces within the clearance.
#[test]
fn a_tour_leaves_chinks_out() {
    let (_, file) = flat().0.finish();
    let corners = || file.objects.iter().flat_map(|o| o.bounds).map(|p| p.as_dvec3());
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    // Beside the house, where a tour may go.
    let (from, to) = (DVec3::new(high.x + 0.2, low.y, low.z), high);
    let slab = |thick: f64| {
        let to = to.with_x(from.x + thick);
        DVec3::AXES.map(|n| [(n, n.dot(to)), (-n, -n.dot(from))]).concat()
    };
    let enters = |thick: f64| {
        let mut with = file.clone();
        let pieces = vec![slab(thick).iter().map(|&(n, d)| n.as_vec3().extend(d as f32)).collect()];
        with.cells.push(FileCell { name: "slab".into(), source: None, open: false, pieces });
        let is_inside = |eye: DVec3| slab(thick).iter().all(|(n, d)| n.dot(eye - file.origin) <= d + 1e-6);
        tour(&with, 0).frames.iter().any(|frame| is_inside(frame.eye))
    };
    assert!(enters(1.0) && enters(4.0 * file.clearance()));
    assert!(!enters(file.clearance()));
}

/// The flat in millimetres, and in units of a game (its rooms are 96 high): the same tour, so many times as large.
#[test]
fn a_tour_is_a_persons_in_any_unit() {
    let (_, file) = flat().0.finish();
    let path = tour(&file, 0);
    // Metres of a person are halls of 4.5 m there, and rooms of 3 m here.
    for (units, metre) in [(1000.0, 1000.0), (32.0, 96.0 / 4.5)] {
        let mut large = file.clone();
        large.origin *= units;
        large.cells.iter_mut().flat_map(|c| &mut c.pieces).flatten().for_each(|plane| plane.w *= units as f32);
        large.portals.iter_mut().flat_map(|q| &mut q.winding).for_each(|corner| *corner *= units as f32);
        large.objects.iter_mut().flat_map(|o| &mut o.bounds).for_each(|corner| *corner *= units as f32);
        let of_large = tour(&large, 0);
        // Only in the window is the eye higher.
        let least = of_large.frames.iter().map(|frame| frame.eye.y / metre).fold(f64::INFINITY, f64::min);
        assert!((least - 1.6).abs() < 1e-3, "{units}: {least}");
        if metre == units {
            assert_eq!(path.frames.len(), of_large.frames.len());
            for (a, b) in path.frames.iter().zip(&of_large.frames) {
                assert!((a.eye * units).distance(b.eye) < 1e-3 * units, "{} {}", a.eye, b.eye);
            }
        }
    }
}

/// A field of 2 km with sheds on one corner of it, all one open cell: the eye is among the sheds.
#[test]
fn a_tour_of_one_open_cell_is_where_its_objects_are() {
    let mut building = Building::default();
    building.outside(p(-1000., -1., -1000.), p(1000., 50., 1000.));
    for k in 0..6 {
        let x = 700. + 4. * f64::from(k);
        building.thing(&format!("shed {k}"), p(x, 0., 800.), p(x + 3., 2.5, 804.));
    }
    let (_, file) = building.finish();
    let path = tour(&file, 0);
    let mut from: Vec<i64> = path.frames.iter().map(|frame| (frame.eye.x - 700.) as i64 / 4).collect();
    from.dedup();
    assert_eq!(from, [0, 1, 2, 3, 4, 5], "each is stood at once");
    assert!(path.frames.iter().all(|frame| (frame.eye - p(712., 1.6, 802.)).abs().cmple(p(12., 1e-3, 2.)).all()));
    assert_eq!(path.frames.len(), 96, "16 looks from each");
    // Who takes a look from each shed still looks around: no two of six within a twelfth of a turn.
    let turn = |i: usize| {
        let along = path.frames[16 * i].target - path.frames[16 * i].eye;
        along.z.atan2(along.x) / std::f64::consts::TAU
    };
    for (i, j) in (0..6).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let between = (turn(i) - turn(j)).rem_euclid(1.0);
        assert!(between.min(1.0 - between) > 1.0 / 12.0, "sheds {i} and {j} look the same way");
    }
}

/// A door that the model has shut: nothing that shows is missing from a picture in which its leaf hides what is behind, and less is drawn
/// than with the door open. The leaf is larger than the opening, so that nothing shows beside it.
#[test]
fn a_tour_past_a_shut_door_misses_no_pixel() {
    let (mut building, _) = flat();
    building.solid("leaf", Role::Door, false, p(0.9, 0.0, 4.0), p(2.1, 2.2, 4.04));
    let (scene, mut file) = building.finish();
    let door = file.portals.iter().position(|q| q.cells == [A, CORRIDOR]).unwrap();
    file.portals[door].state.shut = true;
    let path = tour(&file, 0);
    let walked = |doors_as_found: bool| {
        let options = WalkOptions { doors_as_found, ..options(&[Mode::Portals, Mode::PortalsAndPvs]) };
        walk(&scene, &file, &path, &options, &mut |_| {}).unwrap()
    };
    for (open, shut) in walked(false).iter().zip(walked(true)) {
        assert_eq!((open.missed_pixels, shut.missed_pixels), (Some(0), Some(0)), "{}", shut.mode);
        assert!(shut.triangles_mean < open.triangles_mean, "{} {}", shut.triangles_mean, open.triangles_mean);
        assert!(shut.exact_triangles_mean < open.exact_triangles_mean);
    }
}

/// A row that lacks what is in plain view: the alarm rings, in the modes that use rows only, by pixels and by the exact judge.
#[test]
fn a_faulty_row_shows_as_missed_pixels() {
    let (building, things) = flat();
    let (scene, file) = building.finish_with(|_, objects| objects.clear(A.index(), things.in_a.index()));
    let frame = PathFrame { eye: p(0.5, 1.6, 3.0), target: p(3.0, 0.5, 1.0) };
    let path = CameraPath { name: "chair".into(), fov_y_degrees: 60.0, near: 0.01, frames: vec![frame] };
    let s = summaries(&scene, &file, &path, &Mode::WITHOUT_QUERIES);
    assert_eq!([0, 1, 2].map(|m| s[m].missed_pixels), [Some(0); 3]);
    assert!(s[3].missed_pixels > Some(100) && s[4].missed_pixels == s[3].missed_pixels);
    let mut judged = options(&Mode::WITHOUT_QUERIES);
    judged.modes.push(WalkMode::Exact);
    let lost = |file: &PvsFile, min_pixels| {
        let judged = WalkOptions { min_pixels: vec![min_pixels], ..judged.clone() };
        walk(&scene, file, &path, &judged, &mut |_| {}).unwrap().iter().map(|s| s.lost_objects).collect::<Vec<_>>()
    };
    assert_eq!(lost(&file, 0), [Some(0), Some(0), Some(0), Some(1), Some(1), None]);
    assert_eq!(lost(&file, 1), [None; 6], "a limit leaves out what is visible");
    assert_eq!(s[0].lost_objects, None, "nobody asked the judge");
    // The same for glass, which hides nothing but is seen.
    let (building, things) = flat();
    let (scene, file) = building.finish_with(|_, objects| objects.clear(A.index(), things.glass.index()));
    let frame = PathFrame { eye: p(2.0, 1.5, 2.0), target: p(0.0, 1.5, 2.0) };
    let path = CameraPath { frames: vec![frame], ..path };
    assert!(summaries(&scene, &file, &path, &[Mode::PortalsAndPvs])[0].missed_pixels > Some(100));
}
