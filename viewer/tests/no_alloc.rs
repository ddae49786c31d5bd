//! Deciding a frame and listing what is drawn of it take no memory once warm: in a binary of its own, since the counter is the allocator of
//! all of it. No device is needed. What the device's library and the panels take is theirs.

#[allow(dead_code, reason = "other tests use the rest")]
mod common;

use allocation_counter::measure;
use common::{building, path};
use enfilade::runtime::FrameMode;
use enfilade_viewer::culling::{Culling, Oracle};
use enfilade_viewer::doors::Doors;
use enfilade_viewer::draw::mesh::{Mesh, Runs};

#[test]
fn a_frame_that_is_decided_and_listed_allocates_nothing_once_warm() {
    let (building, path) = (building("villa_rotonda"), path("villa_rotonda"));
    let is_ghost: Vec<bool> = building.scene.objects.iter().map(|o| o.glass).collect();
    for (oracle, mode) in [Oracle::Software, Oracle::Device].into_iter().flat_map(|o| FrameMode::ALL.map(|mode| (o, mode))) {
        let mut culling = Culling::new(&building, oracle, [160, 90]);
        let mut doors = Doors::new(&building, &culling.culler);
        doors.set_all(true);
        doors.tell(&mut culling.culler);
        let (mesh, _) = Mesh::new(&building.scene, &doors.is_leaf).unwrap();
        let (mut runs, mut cells, mut seen) = (Runs::default(), Vec::new(), Vec::new());
        let mut number = 0;
        let mut walk = || {
            let mut drawn = 0;
            for frame in 0..path.frames.len() {
                number += 1;
                let camera = path.camera(frame, building.file.origin, 16.0 / 9.0);
                let decision = culling.decide(number, &camera, 0.01, mode);
                runs.set(&mesh, &decision.objects, &is_ghost, Some(camera.eye));
                doors.seen(decision, &mut cells, &mut seen);
                drawn += runs.solid.len() + culling.late.conditional.len();
                culling.frames.learn(number, 1.0, drawn as u64);
            }
            drawn
        };
        // Lists grow to what the longest frame takes, and `auto` tries every method.
        (0..3).for_each(|_| _ = walk());
        let mut drawn = 0;
        let taken = measure(|| drawn = walk());
        assert_eq!(taken.count_total, 0, "{oracle:?} {mode:?}");
        assert!(drawn > path.frames.len(), "{mode:?}: {drawn} runs: a test of nothing");
    }
    // The alarm works.
    assert_eq!(measure(|| drop(std::hint::black_box(vec![0u8; 100]))).bytes_max, 100);
}
