//! Two passes against a pyramid of depth: nothing is missed, with a past or without one; what is hidden is left out, and counted.

use crate::common::{self, needs_device, path, villa};
use enfilade::runtime::{Camera, Mode};
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_viewer::building::Building;
use enfilade_viewer::culling::ByDevice;
use enfilade_viewer::draw::alarm::Missed;
use enfilade_viewer::draw::frame::FrameRequest;
use enfilade_viewer::draw::marks::Marking;
use enfilade_viewer::headless::Walk;
use enfilade_viewer::mode::ViewMode;
use glam::DVec3;
use testing::boxes::p;
use testing::random::Random;

/// A hall with a wall, two things behind it and one beside; twelve triangles each.
fn hall() -> Building {
    let things = [
        ("wall", p(-3.0, -3.0, -4.0), p(3.0, 3.0, -3.0)),
        ("behind it", p(-1.0, -1.0, -6.0), p(1.0, 1.0, -5.0)),
        ("behind it", p(-0.5, 1.2, -6.0), p(0.5, 1.8, -5.0)),
        ("beside it", p(6.0, -1.0, -6.0), p(7.0, 1.0, -5.0)),
    ];
    common::hall(20.0, &things)
}

/// From the other side of the wall than most things, or from theirs.
fn look(building: &Building, z: f64, size: [u32; 2]) -> Camera {
    let (eye, to) = (p(0.0, 0.0, z), p(0.0, 0.0, 0.0));
    let origin = building.file.origin;
    Camera::look_at(eye - origin, to - origin, 60f64.to_radians(), f64::from(size[0]) / f64::from(size[1]))
}

fn still() -> CameraPath {
    CameraPath { frames: Vec::new(), ..path("villa_rotonda") }
}

/// Pixels that the next frame misses.
fn missed(walk: &mut Walk<'_, '_>, camera: Camera) -> u32 {
    walk.missed(camera, ViewMode::Hiz).unwrap().expect("counted").pixels
}

/// What is missed where a camera looks at the last frame, which stays as it was decided.
fn missed_frozen(walk: &mut Walk<'_, '_>, camera: Camera) -> Missed {
    walk.draw(FrameRequest { culled_by: None, alarm: true, ..FrameRequest::new(camera, ViewMode::Hiz) }).unwrap();
    walk.renderer.settle().unwrap();
    walk.renderer.readback.missed.clone().expect("counted")
}

#[test]
fn a_wall_hides_what_is_behind_it_from_the_third_frame_on() {
    needs_device!();
    let (hall, path) = (hall(), still());
    // Upright pictures have no room for what is beside the wall.
    for (size, all, shown) in [([320, 180], 4, 2), ([333, 187], 4, 2), ([37, 21], 4, 2), ([21, 37], 3, 1), ([1, 1], 3, 1)] {
        let mut walk = Walk::new(&hall, &path, None, size).unwrap();
        walk.renderer.set_marking(Marking::Counted).unwrap();
        for round in 0..2 {
            // Nothing is drawn yet that could hide anything; then all that is in the frustum showed in the frame before.
            for objects in [all, all, shown, shown] {
                assert_eq!(missed(&mut walk, look(&hall, 4.0, size)), 0, "{size:?}");
                assert_eq!(walk.renderer.drawn(), ByDevice { objects, triangles: 12 * objects }, "{size:?}, round {round}");
                assert_eq!(walk.renderer.culling.last.as_ref().unwrap().stats.queries, all, "all in the frustum are tested");
                let [seen, in_vain, _] = walk.renderer.kinds().expect("told apart");
                assert_eq!(seen + in_vain, 12 * objects, "{size:?}: as many are drawn as are counted");
            }
            // From behind, at once.
            assert_eq!(missed(&mut walk, look(&hall, -14.0, size)), 0, "{size:?}");
            assert!(walk.renderer.drawn().objects >= all - 1, "{size:?}");
            // As if it had not been.
            walk.renderer.restart();
        }
    }
}

#[test]
fn from_inside_the_box_of_an_object_it_is_drawn_and_hides_the_rest() {
    needs_device!();
    let around = ("around the eye", p(-1.0, -1.0, 3.0), p(1.0, 1.0, 5.0));
    let hall = common::hall(20.0, &[around, ("outside", p(-1.0, -1.0, -6.0), p(1.0, 1.0, -5.0))]);
    let (path, size) = (still(), [333, 187]);
    let mut walk = Walk::new(&hall, &path, None, size).unwrap();
    for objects in [2, 2, 1] {
        assert_eq!(missed(&mut walk, look(&hall, 4.0, size)), 0);
        assert_eq!(walk.renderer.drawn().objects, objects);
    }
}

#[test]
fn a_frozen_frame_is_what_was_drawn_of_it() {
    needs_device!();
    let (hall, path, size) = (hall(), still(), [320, 180]);
    let mut walk = Walk::new(&hall, &path, None, size).unwrap();
    let [here, there] = [4.0, -14.0].map(|z| look(&hall, z, size));
    (0..3).for_each(|_| assert_eq!(missed(&mut walk, here), 0));
    let picture = walk.picture().unwrap();
    assert_eq!(missed_frozen(&mut walk, here).pixels, 0);
    assert!(walk.picture().unwrap().pixels() == picture.pixels(), "the same eye sees something else");
    // The two things behind the wall were left out, and nothing else was.
    let missed_there = missed_frozen(&mut walk, there);
    assert_eq!(missed_there.objects.iter().filter(|(_, pixels)| *pixels > 20).count(), 2, "{missed_there:?}");
    // The frame after goes on from there.
    assert_eq!(missed(&mut walk, here), 0);
    assert_eq!(walk.renderer.drawn().objects, 2);
}

#[test]
fn nothing_is_missed_after_jumps_at_any_size() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let bounds = villa.scene.bounds();
    for size in [[333, 187], [187, 333], [1, 1], [3, 200]] {
        let mut walk = Walk::new(villa, &path, None, size).unwrap();
        let mut random = Random::new(u64::from(size[0]));
        let (mut drawn, mut in_frustum) = (0, 0);
        for jump in 0..40 {
            let within = DVec3::from_array([0; 3].map(|_| random.real(0.0, 1.0)));
            let eye = bounds.min + within * (bounds.max - bounds.min);
            let to = eye + random.direction();
            let fov_y = random.real(0.3, 2.3);
            let camera = Camera::look_at(eye, to, fov_y, f64::from(size[0]) / f64::from(size[1]));
            if jump % 4 == 0 {
                walk.renderer.restart();
            }
            // Once without a past, or with that of another place; then as it goes on.
            for _ in 0..3 {
                assert_eq!(missed(&mut walk, camera), 0, "{size:?}, jump {jump}, from {eye} to {to}");
            }
            drawn += walk.renderer.triangles();
            walk.missed(camera, Mode::Frustum).unwrap();
            in_frustum += walk.renderer.triangles();
        }
        assert!(0 < drawn && 3 * drawn < 2 * in_frustum, "{size:?}: {drawn} of {in_frustum} triangles");
    }
}

#[test]
fn objects_that_a_buffer_does_not_hold_are_one_line() {
    needs_device!();
    let (hall, path, size) = (hall(), still(), [32, 18]);
    let mut walk = Walk::new(&hall, &path, None, size).unwrap();
    walk.renderer.gpu.limits.max_storage_buffer_binding_size = 64;
    let line = walk.missed(look(&hall, 4.0, size), ViewMode::Hiz).unwrap_err();
    assert!(line.starts_with("objects take ") && line.lines().count() == 1, "{line}");
    // Other modes go on.
    assert_eq!(walk.missed(look(&hall, 4.0, size), Mode::Frustum).unwrap().expect("counted").pixels, 0);
}
