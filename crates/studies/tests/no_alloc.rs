//! A frame takes no memory: in a binary of its own, since the counter is the allocator of all of it.

use allocation_counter::measure;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::view::{Frustum, View};
use enfilade_studies::levels::{LevelCuller, LevelOptions};
use enfilade_studies::reductions::{ReducedChc, Reduction};
use glam::DVec3;
use testing::boxes;

#[test]
fn online_culling_allocates_nothing_after_its_first_frame() {
    let (scene, file) = boxes::flat().0.finish();
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let mut buffer = DepthBuffer::new(&scene, 160, 90);
    let mut reduced = ReducedChc::new(Reduction::AtRandom(0.5), 0);
    let mut levels = LevelCuller::new(LevelOptions::new(!0));
    let mut frame = |turn: u32| {
        // Back and forth, in and out of the building: what is asked about differs from frame to frame.
        let (sin, cos) = (f64::from(turn) * 0.7).sin_cos();
        let eye = boxes::p(1.5 + f64::from(turn % 9), 1.6, 4.0 + sin * 9.0) - file.origin;
        let view = View::look_at(eye, eye + DVec3::new(cos, 0.0, sin), 1.2, 1.6, 0.05);
        let frustum = Frustum::new(&view);
        buffer.begin(&view);
        let drawn = reduced.cull(&tree, &frustum, &mut buffer).len();
        buffer.begin(&view);
        drawn + levels.cull(&tree, &frustum, &mut buffer).len()
    };
    frame(0);
    let mut drawn = 0;
    let taken = measure(|| drawn = (1..200).map(&mut frame).sum());
    assert_eq!(taken.count_total, 0);
    assert!(drawn > 200, "{drawn} objects: a test of nothing");
}
