//! Online culling with the software depth buffer on one thread, in generated furnished offices of 60,000 to a million triangles: ten eyes in
//! rooms and corridors, a picture of 1920 x 1080 each.
//!
//! First the answers are checked: in the six faces of a cube around each eye, whatever a visibility cube of the same size shows is drawn by
//! CHC and by CHC++. Then the times, each the least of several, mean over the eyes: 1,000 boxes of objects asked about when all of the
//! frame's visible objects are drawn; drawing those; and whole frames of a camera that turns, beside frustum culling and drawing
//! everything in it; with the feature `gpu`, whole frames by occlusion queries, too. `--test` takes the smallest office alone.

use enfilade::ObjectId;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::chc::Chc;
use enfilade::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::stats::OnlineStats;
use enfilade::occlusion::view::{Frustum, View};
use enfilade::pvs::cubes::{Cube, CubeEngine, CubeScene, CubeView, Raster};
use enfilade::scene::Scene;
use glam::DVec3;
use testing::bakes::office;
use testing::cube_times::face;
use testing::times::{is_told, least, timed, us};

const SIZE: [usize; 2] = [1920, 1080];
const NEAR: f64 = 0.05;
const BOXES: usize = 1000;
const REPEATS: usize = 7;
const FRAMES: usize = 60;
/// Offices: 60,000, 250,000 and a million triangles.
const ROOMS: [usize; 3] = [40, 165, 660];

fn main() {
    let rooms = if is_told("--test") { &ROOMS[..1] } else { &ROOMS[..] };
    for &rooms in rooms {
        let (office, scene) = office(rooms, true);
        measure(&scene, &eyes(&office.rooms, &scene));
    }
}

/// In the middle of ten rooms and corridors, 1.5 m above the floor.
fn eyes(rooms: &serde_json::Value, scene: &Scene) -> Vec<DVec3> {
    let number = |value: &serde_json::Value| value.as_f64().expect("a number");
    let rooms = rooms["rooms"].as_array().expect("a list");
    let middle = |room: &serde_json::Value| {
        let ring = room["footprint"][0][0].as_array().expect("a ring");
        let mean = |k: usize| ring.iter().map(|p| number(&p[k])).sum::<f64>() / ring.len() as f64;
        DVec3::new(mean(0) + 0.0137, number(&room["floor_y"]) + 1.5, mean(1) + 0.0213)
    };
    (0..10).map(|i| middle(&rooms[i * rooms.len() / 10]) - scene.origin).collect()
}

fn measure(scene: &Scene, eyes: &[DVec3]) {
    let (tree, built) = timed(|| Hierarchy::build(scene, &HierarchyOptions::default()));
    check(scene, &tree, eyes);
    println!("\n{} triangles, {} objects, tree in {:.2} s", scene.triangles.len(), scene.objects.len(), built.as_secs_f64());
    boxes(scene, &tree, eyes);
    frames(scene, &tree, eyes);
    #[cfg(feature = "gpu")]
    queries(scene, &tree, eyes);
}

/// Whatever a visibility cube shows is drawn.
fn check(scene: &Scene, tree: &Hierarchy, eyes: &[DVec3]) {
    const SIDE: u32 = 200;
    let mut opaque = scene.clone();
    opaque.objects.iter_mut().for_each(|o| o.opaque = true);
    let ready = CubeScene::new(&opaque);
    let (mut chc, mut plus) = (Chc::default(), ChcPlus::new(ChcPlusOptions::default()));
    let mut buffer = DepthBuffer::new(&opaque, SIDE as usize, SIDE as usize);
    let mut cube = Cube::default();
    for &eye in eyes {
        let cube_view = CubeView::new(eye, SIDE);
        Raster::new(&ready).cube(&cube_view, &mut cube);
        for side in 0..6 {
            let ([x, y, w], seen) = face(scene, &cube_view, &cube, side);
            let view = View { eye, x, y, w, near: 1e-3, far: f64::INFINITY };
            let frustum = Frustum::new(&view);
            buffer.begin(&view);
            let mut drawn = vec![chc.cull(tree, &frustum, &mut buffer).to_vec()];
            buffer.begin(&view);
            drawn.push(plus.cull(tree, &frustum, &mut buffer).to_vec());
            for drawn in &mut drawn {
                drawn.sort_unstable();
                assert!(seen.iter().all(|o| drawn.binary_search(o).is_ok()), "an object that shows isn't drawn");
            }
        }
    }
}

/// The camera of a frame: it turns about the eye once.
fn view(eye: DVec3, frame: usize) -> View {
    let (sin, cos) = (frame as f64 / FRAMES as f64 * std::f64::consts::TAU).sin_cos();
    View::look_at(eye, eye + DVec3::new(cos, -0.1, sin), 60f64.to_radians(), 16.0 / 9.0, NEAR)
}

/// Questions about the nearest objects that are in the frustum, once everything visible is drawn.
fn boxes(scene: &Scene, tree: &Hierarchy, eyes: &[DVec3]) {
    let mut buffer = DepthBuffer::new(scene, SIZE[0], SIZE[1]);
    let (mut all, mut drawing, mut count, mut shown, mut triangles) = (0.0, 0.0, 0, 0, 0);
    for &eye in eyes {
        let view = view(eye, 7);
        let frustum = Frustum::new(&view);
        let mut inside = FrustumCuller::default().cull(tree, &frustum).to_vec();
        let bounds = |o: &ObjectId| Bounds::from(scene.objects[o.index()].bounds);
        inside.sort_by(|a, b| bounds(a).distance(eye).total_cmp(&bounds(b).distance(eye)));
        inside.truncate(BOXES);
        let asked: Vec<Bounds> = inside.iter().map(bounds).filter(|b| !frustum.meets_near(b)).collect();
        buffer.begin(&view);
        let visible = Chc::default().cull(tree, &frustum, &mut buffer).to_vec();
        drawing += least(REPEATS, || {
            buffer.begin(&view);
            visible.iter().for_each(|&o| buffer.draw(o));
        })
        .as_secs_f64();
        triangles += visible.iter().map(|o| scene.objects[o.index()].triangles.len()).sum::<usize>();
        shown += asked.iter().filter(|b| buffer.shows(b)).count();
        all += least(REPEATS, || asked.iter().filter(|b| buffer.shows(b)).count()).as_secs_f64();
        count += asked.len();
    }
    let a_thousand = all / count as f64 * 1e6;
    println!("1,000 boxes: {a_thousand:.4} ms ({count} asked, {shown} show)");
    let eyes = eyes.len() as f64;
    println!("drawing what is visible: {:.3} ms, {:.0} triangles", drawing / eyes * 1e3, triangles as f64 / eyes);
}

fn frames(scene: &Scene, tree: &Hierarchy, eyes: &[DVec3]) {
    println!("| culler | us a frame, median | slowest | objects | triangles | queries | nodes |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let mut frustum_culler = FrustumCuller::default();
    row("frustum, nothing drawn", scene, eyes, |_, frustum, _| {
        (frustum_culler.cull(tree, frustum).to_vec(), frustum_culler.stats())
    });
    row("frustum", scene, eyes, |_, frustum, buffer| {
        let objects = frustum_culler.cull(tree, frustum).to_vec();
        objects.iter().for_each(|&o| buffer.draw(o));
        (objects, frustum_culler.stats())
    });
    let mut chc = Chc::default();
    row("chc", scene, eyes, |_, frustum, buffer| (chc.cull(tree, frustum, buffer).to_vec(), chc.stats()));
    let mut plus = ChcPlus::new(ChcPlusOptions::default());
    row("chc++", scene, eyes, |_, frustum, buffer| (plus.cull(tree, frustum, buffer).to_vec(), plus.stats()));
}

/// Some whole frames (software drivers take long) by a graphics processor's occlusion queries: beside what other rows show, how often the
/// device is given work, how often an answer isn't there when there is nothing else to do, and how many objects the software depth buffer,
/// which answers at once, has drawn in the same frames.
#[cfg(feature = "gpu")]
fn queries(scene: &Scene, tree: &Hierarchy, eyes: &[DVec3]) {
    use enfilade::occlusion::queries::GpuQueries;
    let mut gpu = match GpuQueries::new(scene, SIZE[0], SIZE[1]) {
        Ok(gpu) => gpu,
        Err(e) => return println!("not run: occlusion queries: {e}"),
    };
    println!("\n{}", gpu.adapter());
    println!("| culler | us a frame, median | slowest | objects | by software | queries | batches | waits |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let mut buffer = DepthBuffer::new(scene, SIZE[0], SIZE[1]);
    let (mut chc, mut plus) = (Chc::default(), ChcPlus::new(ChcPlusOptions::default()));
    let (mut other_chc, mut other_plus) = (chc.clone(), plus.clone());
    for name in ["chc", "chc++"] {
        let (mut times, mut sum, mut batches, mut by_software) = (Vec::new(), OnlineStats::default(), 0, 0);
        for (eye, frame) in eyes.iter().flat_map(|eye| (0..FRAMES / 10).map(move |frame| (*eye, frame))) {
            let view = view(eye, frame);
            let frustum = Frustum::new(&view);
            let (stats, time) = timed(|| {
                gpu.begin(&view);
                if name == "chc" {
                    chc.cull(tree, &frustum, &mut gpu);
                    chc.stats()
                } else {
                    plus.cull(tree, &frustum, &mut gpu);
                    plus.stats()
                }
            });
            times.push(time);
            sum += stats;
            batches += gpu.batches();
            buffer.begin(&view);
            by_software += match name {
                "chc" => other_chc.cull(tree, &frustum, &mut buffer).len() as u64,
                _ => other_plus.cull(tree, &frustum, &mut buffer).len() as u64,
            };
        }
        times.sort_unstable();
        let [median, slowest] = [50, 100].map(|percent| us(&times, percent));
        let mean = |n: u64| n as f64 / times.len() as f64;
        let [objects, by_software, queries, batches] = [sum.objects, by_software, sum.queries, batches].map(mean);
        print!("| {name} | {median:.0} | {slowest:.0} | {objects:.0} | {by_software:.0} ");
        println!("| {queries:.0} | {batches:.1} | {:.0} |", mean(sum.waits));
    }
    assert_eq!(gpu.failure(), None);
}

/// One row of the table; the objects are copied in the time that is taken, which is little beside the rest.
fn row(
    name: &str,
    scene: &Scene,
    eyes: &[DVec3],
    mut cull: impl FnMut(&View, &Frustum, &mut DepthBuffer<'_>) -> (Vec<ObjectId>, OnlineStats),
) {
    let mut buffer = DepthBuffer::new(scene, SIZE[0], SIZE[1]);
    let (mut times, mut sum, mut triangles) = (Vec::new(), OnlineStats::default(), 0);
    for &eye in eyes {
        for frame in 0..FRAMES {
            let view = view(eye, frame);
            let ((objects, stats), time) = timed(|| {
                buffer.begin(&view);
                cull(&view, &Frustum::new(&view), &mut buffer)
            });
            times.push(time);
            sum += stats;
            triangles += objects.iter().map(|o| scene.objects[o.index()].triangles.len()).sum::<usize>();
        }
    }
    times.sort_unstable();
    let [median, slowest] = [50, 100].map(|percent| us(&times, percent));
    let mean = |n: u64| n / times.len() as u64;
    let OnlineStats { objects, queries, nodes, .. } = sum;
    println!(
        "| {name} | {median:.0} | {slowest:.0} | {} | {} | {} | {} |",
        mean(objects),
        mean(triangles as u64),
        mean(queries),
        mean(nodes)
    );
}
