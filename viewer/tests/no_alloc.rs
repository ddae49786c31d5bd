//! Deciding a frame and listing what is drawn of it take no memory once warm: in a binary of its own, since the counter is the allocator of
//! all of it. No device is needed. What the device's library and the panels take is theirs.

#[allow(dead_code, reason = "other tests use the rest")]
#[path = "suite/common/mod.rs"]
mod common;

use allocation_counter::measure;
use common::{building, path};
use enfilade::runtime::{Camera, Mode};
use enfilade_terrain::{Ground, Placement};
use enfilade_viewer::culling::{Culling, Oracle};
use enfilade_viewer::doors::Doors;
use enfilade_viewer::draw::mesh::{Mesh, Runs};
use enfilade_viewer::ground::{Land, Shown};
use enfilade_viewer::mode::ViewMode;
use glam::DVec3;
use testing::ground::{Raster, Scripted, written};

#[test]
fn a_frame_that_is_decided_and_listed_allocates_nothing_once_warm() {
    let (building, path) = (building("villa_rotonda"), path("villa_rotonda"));
    let is_transparent: Vec<bool> = building.scene.objects.iter().map(|o| o.glass).collect();
    for (oracle, mode) in [Oracle::Software, Oracle::Device].into_iter().flat_map(|o| ViewMode::ALL.map(|mode| (o, mode))) {
        let mut culling = Culling::new(&building, oracle, [160, 90]);
        let mut doors = Doors::new(&building, &culling.culler);
        doors.set_all(true);
        doors.tell(&mut culling.view);
        let (mesh, _) = Mesh::new(&building.scene, &doors.is_leaf).unwrap();
        let (mut runs, mut cells, mut seen) = (Runs::default(), Vec::new(), Vec::new());
        let mut number = 0;
        let mut walk = || {
            let mut drawn = 0;
            for frame in 0..path.frames.len() {
                number += 1;
                let camera = path.camera(frame, building.file.origin, 16.0 / 9.0);
                let decision = culling.decide(number, &camera, 0.01, mode);
                runs.set(&mesh, &decision.objects, &is_transparent, Some(camera.eye));
                doors.seen(decision, &mut cells, &mut seen);
                drawn += runs.solid.len() + culling.delayed.conditional.len();
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

/// From rooms with and without a window in view, and from outside, while tiles come.
#[test]
fn ground_that_is_chosen_and_loaded_allocates_nothing_once_warm() {
    const SIZE: [u32; 2] = [320, 180];
    let (building, path) = (building("villa_rotonda"), path("villa_rotonda"));
    let at = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("no-alloc.ground");
    let mut raster = Raster::of([513, 513], |c, r| f64::from(c * 31 % 57) + f64::from(r * 17 % 91));
    written(&mut raster, &at);
    let whole = Ground::open(&at, u64::MAX).unwrap();
    // A tile a frame: a walk is over before all have come.
    let late = Ground::from_disk(&whole, Box::new(Scripted::new(&at, &whole, 4, 1)), whole.cache_bytes());
    let mut land = Land::new(late, Some(Placement { at: DVec3::new(0.0, 150.0, 0.0), degrees: 0.0 }));
    land.enter(&building.file);
    let mut culling = Culling::new(&building, Oracle::Software, SIZE);
    let (mut shown, mut number) = (Shown::default(), 0);
    let mut walk = || {
        let [mut drawn, mut expected, mut loaded] = [0; 3];
        // Other tiles each time.
        land.place.degrees += 90.0;
        for frame in 0..path.frames.len() {
            number += 1;
            let ahead = path.camera(frame, building.file.origin, 16.0 / 9.0);
            // Now and then at the floor, where no window is in view.
            let floor = Camera::look_at(ahead.eye.into(), ahead.eye.as_dvec3() - DVec3::new(0.0, 1.0, 0.1), 0.5, 1.0);
            let camera = if frame % 4 == 0 { floor } else { ahead };
            culling.decide(number, &camera, 0.01, Mode::PortalsAndPvs);
            let decision = culling.last.as_mut().unwrap();
            land.select(decision, &building.file, SIZE, &mut shown);
            land.load_at(number as f64 / 60.0, SIZE, &mut shown);
            drawn += shown.patches().len();
            expected += usize::from(shown.is_expected);
            loaded += shown.loading.loaded as usize;
        }
        [drawn, expected, loaded]
    };
    walk();
    let mut counts = [0; 3];
    let taken = measure(|| counts = walk());
    assert_eq!(taken.count_total, 0);
    assert!(
        counts.iter().all(|&count| count > 0),
        "a test of nothing: {counts:?} tiles drawn, frames before a window, tiles loaded"
    );
}
