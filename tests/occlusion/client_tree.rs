//! The example `octree`: cullers walk a client's tree as they do their own, and nothing that shows is lost.

#[path = "../../examples/octree.rs"]
#[allow(dead_code, reason = "its main")]
mod program;

use crate::cli::folder;
use enfilade::ObjectId;
use enfilade::bake::without_rows;
use enfilade::math::geom::Aabb;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::runtime::{self, Culler, Mode};
use enfilade::scene::ImportOptions;
use enfilade_formats::import;
use enfilade_measure::walkthrough::missed::objects_shown;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::raster::{View, draw};
use enfilade_scenes::{Kind, generate};

#[test]
fn an_octree_of_the_clients_loses_nothing_that_shows() {
    let model = folder("own_tree").join("office.glb");
    let office = generate(Kind::Office { rooms: 12, storeys: Some(2), furnished: true }, 5).unwrap();
    std::fs::write(&model, &office.glb).unwrap();
    let (scene, path) =
        (import(&model, &ImportOptions::default()).unwrap(), CameraPath::from_json(&office.path.to_string()).unwrap());
    let boxes: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();
    let bounds: Vec<Bounds> = boxes.iter().map(|&b| b.into()).collect();
    let triangles: Vec<u32> = scene.objects.iter().map(|o| o.triangles.len() as u32).collect();
    let (tree, faults) = Hierarchy::of_tree(&program::Octree::new(&boxes), &bounds, &triangles);
    assert_eq!(faults, []);
    assert!(tree.nodes().iter().any(|n| n.children().len() > 2), "it is no binary tree");
    let culler = Culler::new(&without_rows(&scene, &ImportOptions::default()));
    let mut oracle = DepthBuffer::new(&scene, 160, 90);
    for mode in [Mode::Chc, Mode::ChcPlus] {
        let (mut frames, mut frustum) = (runtime::View::new(&culler), runtime::View::new(&culler));
        frames.prepare_queries(Some(tree.clone()));
        let (mut drawn, mut in_frustum) = (0, 0);
        for frame in (0..path.frames.len()).step_by(path.frames.len() / 30) {
            let camera = path.camera(frame, scene.origin, 16.0 / 9.0);
            let view = View { camera, near: path.near, width: 160, height: 90 };
            let set = frames.cull_with(&camera, mode, path.near, &mut oracle);
            let shown: Vec<ObjectId> = objects_shown(&scene, &draw(&scene, &view, &|_| true));
            let lost: Vec<_> = shown.iter().filter(|o| !set.objects.contains(o)).collect();
            assert!(lost.is_empty(), "{mode}, frame {frame}: {lost:?}");
            drawn += set.objects.len();
            in_frustum += frustum.cull(&camera, Mode::Frustum).objects.len();
        }
        assert!(drawn * 2 < in_frustum, "{mode}: {drawn} of {in_frustum}");
    }
}
