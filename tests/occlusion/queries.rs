//! Occlusion queries of a graphics processor: nothing is called hidden that rays in `f64` see, and nearly all that the software depth
//! buffer calls hidden is. Needs an adapter, of software at least: with `CI` set, tests fail without one.

#![cfg(feature = "gpu")]

use enfilade::ObjectId;
use enfilade::gpu::GpuError;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::chc::Chc;
use enfilade::occlusion::chc_plus::{ChcPlus, ChcPlusOptions, Interval};
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::oracle::{OcclusionOracle, QueryId};
use enfilade::occlusion::queries::GpuQueries;
use enfilade::occlusion::stats::OnlineStats;
use enfilade::occlusion::view::{Frustum, View};
use enfilade::scene::Scene;
use glam::{DQuat, DVec2, DVec3};
use testing::crowd::{Picture, all, bounds, crowd as boxes, of_meshes, own_bounds, path, scene, turned};
use testing::random::Places;

/// Views of each crowd.
const ROUNDS: usize = 20;

/// The scene on the device, or `None` after saying that the test wasn't run.
fn on_gpu(test: &str, scene: &Scene, [width, height]: [usize; 2]) -> Option<GpuQueries> {
    match GpuQueries::new(scene, width, height) {
        Ok(gpu) => Some(gpu),
        Err(e @ GpuError::NoAdapter { .. }) => {
            assert!(std::env::var_os("CI").is_none(), "{test}: {e}");
            eprintln!("not run: {test}: {e}");
            None
        }
        Err(e) => panic!("{test}: {e}"),
    }
}

/// Asks one question and waits for the answer.
fn shows(oracle: &mut impl OcclusionOracle, boxes: &[Bounds]) -> bool {
    let query = oracle.issue(boxes);
    answer(oracle, query)
}

fn answer(oracle: &mut impl OcclusionOracle, query: QueryId) -> bool {
    // Who only polls is answered soon.
    (0..100).find_map(|_| oracle.poll(query)).expect("an answer")
}

/// A box for an object, along the axes or along its own, in turns; and boxes where nothing is.
fn asked(scene: &Scene, random: &mut Places) -> Vec<Bounds> {
    let of_object = |o: ObjectId| if o.index().is_multiple_of(2) { bounds(scene, o) } else { own_bounds(scene, o) };
    let mut asked: Vec<Bounds> = all(scene).into_iter().map(of_object).collect();
    asked.extend((0..20).map(|i| random.bounds(12.0, DVec3::splat([3.0, 0.3][i % 2]))));
    asked
}

#[test]
fn what_is_called_hidden_has_no_pixel_and_little_else_has_none() {
    let test = "what_is_called_hidden_has_no_pixel_and_little_else_has_none";
    let mut random = Places::new(2);
    let (mut hidden, mut called, mut shown) = (0, 0, 0);
    for size in [[64, 48], [75, 50], [64, 48], [200, 130]] {
        let scene = scene(&boxes(40, &mut random));
        let Some(mut gpu) = on_gpu(test, &scene, size) else { return };
        println!("{}", gpu.adapter());
        let mut buffer = DepthBuffer::new(&scene, size[0], size[1]);
        for round in 0..ROUNDS {
            // Often the eye is in the middle of it, with triangles all around.
            let view = random.view([0.01, 0.5][round % 2]);
            let occluders = &all(&scene)[..20];
            gpu.begin(&view);
            buffer.begin(&view);
            occluders.iter().for_each(|&o| gpu.draw(o));
            occluders.iter().for_each(|&o| buffer.draw(o));
            let picture = Picture::new(&scene, occluders, &view, size);
            let frustum = Frustum::new(&view);
            let asked = asked(&scene, &mut random);
            let queries: Vec<_> = asked.iter().map(|b| gpu.issue(std::slice::from_ref(b))).collect();
            for (i, (query, bounds)) in queries.into_iter().zip(&asked).enumerate() {
                let shows = answer(&mut gpu, query);
                if frustum.meets_near(bounds) {
                    assert!(shows, "what reaches the near plane can't be known");
                } else if picture.count(&view, bounds) > 0 {
                    shown += 1;
                    assert!(shows, "{size:?}, round {round}, box {i}");
                } else if !buffer.shows(bounds) {
                    hidden += 1;
                    called += usize::from(!shows);
                }
            }
        }
        assert_eq!(gpu.failure(), None);
    }
    println!("{called} of {hidden} hidden boxes are called so; {shown} show");
    assert!(called * 100 >= hidden * 95, "{called} of {hidden}");
    assert!(hidden > 500 && shown > 500, "{hidden} and {shown}: a test of nothing");
}

/// A wall with a hole around the middle of one pixel: what is behind shows where the hole's border leaves the middle free, by however
/// little, and is hidden where the wall covers it by a fiftieth of a pixel.
#[test]
fn a_hole_smaller_than_a_pixel_shows_what_is_behind() {
    let test = "a_hole_smaller_than_a_pixel_shows_what_is_behind";
    let size = [320usize, 200];
    let view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, 1.0, 1.6, 0.1);
    // A point 5 m ahead, so many pixels right of and below the picture's corner at the top left.
    let at = |x: f64, y: f64, distance: f64| {
        let ndc = DVec2::new(x * 2.0 / 320.0 - 1.0, 1.0 - y * 2.0 / 200.0) * distance;
        DVec3::new(ndc.x / view.x.x, ndc.y / view.y.y, -distance)
    };
    let mut random = Places::new(5);
    for round in 0..40 {
        let pixel = [(random.unit() * 300.0).floor() + 10.5, (random.unit() * 180.0).floor() + 10.5];
        // The hole ends so far from the middle on the left, on the right, above and below.
        let sides: [f64; 4] = std::array::from_fn(|_| 10f64.powf(-4.0 * random.unit()) * 0.4);
        for free in [true, false] {
            let [mut left, right, above, below] = sides;
            if !free {
                left = -0.02;
            }
            let [x, y] = pixel;
            let pane = |x: [f64; 2], y: [f64; 2]| {
                let corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])];
                (corners.map(|(x, y)| at(x, y, 5.0)).to_vec(), vec![[0, 1, 2], [0, 2, 3]])
            };
            let wall = of_meshes([
                pane([-500.0, x - left], [-300.0, 600.0]),
                pane([x + right, 900.0], [-300.0, 600.0]),
                pane([x - left, x + right], [-300.0, y - above]),
                pane([x - left, x + right], [y + below, 600.0]),
            ]);
            let Some(mut gpu) = on_gpu(test, &wall, size) else { return };
            gpu.begin(&view);
            all(&wall).into_iter().for_each(|o| gpu.draw(o));
            let behind = turned(at(x, y, 8.0), DQuat::IDENTITY, DVec3::splat(0.1));
            assert!((Picture::new(&wall, &all(&wall), &view, size).count(&view, &behind) > 0) == free);
            assert_eq!(shows(&mut gpu, &[behind]), free, "round {round}: {sides:?}");
        }
    }
}

/// Any of the cullers by occlusion.
enum Culler {
    Chc(Chc),
    Plus(ChcPlus),
}

impl Culler {
    fn every_kind() -> Vec<Self> {
        vec![
            Self::Chc(Chc::default()),
            Self::Plus(ChcPlus::new(ChcPlusOptions::default())),
            Self::Plus(ChcPlus::new(ChcPlusOptions { batch: 5, assumed: Interval::Frames(3), ..ChcPlusOptions::default() })),
        ]
    }

    fn cull(&mut self, tree: &Hierarchy, view: &View, oracle: &mut impl OcclusionOracle) -> (Vec<ObjectId>, OnlineStats) {
        let frustum = &Frustum::new(view);
        match self {
            Self::Chc(c) => (c.cull(tree, frustum, oracle).to_vec(), c.stats()),
            Self::Plus(c) => (c.cull(tree, frustum, oracle).to_vec(), c.stats()),
        }
    }
}

/// Frames along a path; every object that rays see is drawn. Returns how many were drawn, how many are with the software depth buffer, and
/// the least that can be.
fn walk(test: &str, scene: &Scene, views: &[View], size: [usize; 2]) -> Option<[usize; 3]> {
    let tree = Hierarchy::build(scene, &HierarchyOptions::default());
    let opaque: Vec<ObjectId> = all(scene).into_iter().filter(|o| scene.objects[o.index()].opaque).collect();
    let truth: Vec<Vec<ObjectId>> = views
        .iter()
        .map(|view| {
            let mut seen = Picture::new(scene, &opaque, view, size).objects();
            // Of what is see-through, what shows before all that isn't.
            for object in all(scene).into_iter().filter(|o| !opaque.contains(o)) {
                let with = [&opaque[..], &[object]].concat();
                seen.extend(Picture::new(scene, &with, view, size).objects().into_iter().filter(|o| *o == object));
            }
            seen
        })
        .collect();
    let (mut gpu, mut buffer) = (on_gpu(test, scene, size)?, DepthBuffer::new(scene, size[0], size[1]));
    let mut sums = [0; 3];
    for (kind, (mut culler, mut other)) in Culler::every_kind().into_iter().zip(Culler::every_kind()).enumerate() {
        for (frame, (view, truth)) in views.iter().zip(&truth).enumerate() {
            gpu.begin(view);
            let (mut drawn, stats) = culler.cull(&tree, view, &mut gpu);
            assert_eq!(gpu.failure(), None);
            assert!(gpu.batches() <= stats.queries, "{stats:?}");
            sums[0] += drawn.len();
            buffer.begin(view);
            sums[1] += other.cull(&tree, view, &mut buffer).0.len();
            sums[2] += truth.len();
            drawn.sort_unstable();
            assert!(drawn.is_sorted_by(|a, b| a < b), "culler {kind}, frame {frame}: an object is drawn twice");
            for object in truth {
                assert!(drawn.contains(object), "culler {kind}, frame {frame}: object {object} is missing");
            }
        }
    }
    Some(sums)
}

/// However late answers come, and whatever the camera did before.
#[test]
fn whatever_has_a_pixel_is_drawn_in_the_same_frame() {
    let mut random = Places::new(3);
    let mut scene = scene(&boxes(120, &mut random));
    // Glass shows what is behind it.
    scene.objects[4].opaque = false;
    let views = path(&mut random, 25);
    let sums = walk("whatever_has_a_pixel_is_drawn_in_the_same_frame", &scene, &views, [96, 64]);
    let Some([drawn, by_software, seen]) = sums else { return };
    println!("{drawn} drawn, {by_software} with answers at once, {seen} seen");
    // Answers that come late hide less.
    assert!(drawn * 10 < by_software * 11, "{drawn} and {by_software}");
}

/// The same crowd at the origin and 1,048,576 m from it, along each axis: the same promise, and the same share is called hidden.
#[test]
fn far_from_the_origin_is_as_good_as_near() {
    let test = "far_from_the_origin_is_as_good_as_near";
    let mut random = Places::new(7);
    let size = [120, 80];
    // To numbers that are the same far away.
    let whole = |v: DVec3| (v * 1048576.0).round() / 1048576.0;
    let crowd = boxes(60, &mut random);
    let mesh = |b: &Bounds, by: f64| {
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        (b.corners().map(|p| whole(p) + by).to_vec(), triangles)
    };
    let moved = |by: f64| of_meshes(crowd.iter().map(|b| mesh(b, by)));
    let (near, far) = (moved(0.0), moved(1048576.0));
    let (Some(mut at_home), Some(mut away)) = (on_gpu(test, &near, size), on_gpu(test, &far, size)) else { return };
    let (mut hidden, mut called) = (0, [0, 0]);
    for round in 0..30 {
        let view = random.view([0.01, 0.2][round % 2]);
        let view = View { eye: whole(view.eye), ..view };
        let there = View { eye: view.eye + 1048576.0, ..view };
        at_home.begin(&view);
        away.begin(&there);
        let occluders = &all(&near)[..30];
        occluders.iter().for_each(|&o| at_home.draw(o));
        occluders.iter().for_each(|&o| away.draw(o));
        let picture = Picture::new(&far, occluders, &there, size);
        for object in all(&near) {
            let [here, bounds] = [bounds(&near, object), bounds(&far, object)];
            let answers = [shows(&mut at_home, &[here]), shows(&mut away, &[bounds])];
            if Frustum::new(&there).meets_near(&bounds) || picture.count(&there, &bounds) > 0 {
                assert!(answers[1], "round {round}, {object}");
            } else {
                hidden += 1;
                called[0] += usize::from(!answers[0]);
                called[1] += usize::from(!answers[1]);
            }
        }
    }
    println!("of {hidden} hidden boxes {called:?} are called so");
    assert!(hidden > 300 && called.iter().all(|c| c * 100 >= hidden * 95), "{called:?} of {hidden}");
    let views: Vec<View> = path(&mut random, 5).into_iter().map(|v| View { eye: whole(v.eye) + 1048576.0, ..v }).collect();
    walk(test, &far, &views, size);
}

#[test]
fn a_box_behind_a_wall_is_hidden_until_the_next_frame_and_glass_hides_nothing() {
    let test = "a_box_behind_a_wall_is_hidden_until_the_next_frame_and_glass_hides_nothing";
    let size = [160, 120];
    let wall = scene(&[turned(DVec3::ZERO, DQuat::IDENTITY, DVec3::new(0.1, 2.0, 2.0))]);
    let Some(mut gpu) = on_gpu(test, &wall, size) else { return };
    let view = View::look_at(DVec3::NEG_X * 5.0, DVec3::ZERO, 1.0, 1.5, 0.1);
    let at = |x: f64, y: f64| turned(DVec3::new(x, y, 0.0), DQuat::IDENTITY, DVec3::splat(0.5));
    gpu.begin(&view);
    assert!(shows(&mut gpu, &[at(3.0, 0.0)]), "nothing is drawn yet");
    gpu.draw(ObjectId(0));
    assert!(!shows(&mut gpu, &[at(3.0, 0.0)]));
    assert!(shows(&mut gpu, &[at(-2.0, 0.0)]), "before the wall");
    assert!(shows(&mut gpu, &[at(3.0, 3.2)]), "above it");
    assert!(shows(&mut gpu, &[at(-5.0, 0.0)]), "around the eye");
    assert!(!shows(&mut gpu, &[at(3.0, 90.0)]), "far above the picture");
    // Several boxes in one question: hidden where all are.
    assert!(!shows(&mut gpu, &[at(3.0, 0.0), at(4.0, 0.5), at(3.0, 90.0)]));
    assert!(shows(&mut gpu, &[at(3.0, 0.0), at(3.0, 3.2)]));
    assert!(shows(&mut gpu, &[at(3.0, 0.0), at(-5.0, 0.0)]));
    assert!(!shows(&mut gpu, &[]));
    gpu.begin(&view);
    assert!(shows(&mut gpu, &[at(3.0, 0.0)]));
    // A wall nearer than the near plane isn't drawn.
    gpu.begin(&View { near: 5.2, ..view });
    gpu.draw(ObjectId(0));
    assert!(shows(&mut gpu, &[at(3.0, 0.0)]));
    let mut glass = wall.clone();
    glass.objects[0].opaque = false;
    let Some(mut gpu) = on_gpu(test, &glass, size) else { return };
    gpu.begin(&view);
    gpu.draw(ObjectId(0));
    assert!(shows(&mut gpu, &[at(3.0, 0.0)]));
}

/// A wall of many triangles has no crack along their edges that shows what is behind.
#[test]
fn there_is_no_crack_within_an_object() {
    let size = [400, 300];
    let place =
        |x: u32, y: u32| DVec3::new(f64::from(x) * 0.37 - 9.0, f64::from(y) * 0.41 - 9.0, f64::from(x * y % 3) * 0.05);
    let positions: Vec<DVec3> = (0..50).flat_map(|y| (0..50).map(move |x| place(x, y))).collect();
    let cell = |x: u32, y: u32| [[0, 1, 51], [0, 51, 50]].map(|t| t.map(|i| y * 50 + x + i));
    let triangles = (0..49).flat_map(|y| (0..49).flat_map(move |x| cell(x, y))).collect();
    let wall = of_meshes([(positions, triangles)]);
    let Some(mut gpu) = on_gpu("there_is_no_crack_within_an_object", &wall, size) else { return };
    for eye in [DVec3::new(0.0, 0.0, 9.0), DVec3::new(2.0, 1.0, 4.0), DVec3::new(-6.0, 3.0, 5.0)] {
        let view = View::look_at(eye, DVec3::new(0.1, 0.2, 0.0), 0.8, 4.0 / 3.0, 0.1);
        gpu.begin(&view);
        gpu.draw(ObjectId(0));
        let behind = turned(DVec3::new(0.0, 0.0, -2.0), DQuat::IDENTITY, DVec3::new(6.0, 6.0, 0.5));
        assert!(!shows(&mut gpu, &[behind]), "from {eye}");
    }
}

/// Without polls, many questions, more boxes than a batch holds, and a frame that is given up.
#[test]
fn answers_come_in_any_number_and_not_from_an_earlier_frame() {
    let test = "answers_come_in_any_number_and_not_from_an_earlier_frame";
    let wall = scene(&[turned(DVec3::ZERO, DQuat::IDENTITY, DVec3::new(0.1, 2.0, 2.0))]);
    let Some(mut gpu) = on_gpu(test, &wall, [64, 48]) else { return };
    let view = View::look_at(DVec3::NEG_X * 5.0, DVec3::ZERO, 1.0, 1.5, 0.1);
    let at = |i: usize, y: f64| turned(DVec3::new(3.0 + i as f64 * 0.01, y, 0.0), DQuat::IDENTITY, DVec3::splat(0.3));
    let y = |i: usize| if i % 7 == 3 { 3.4 } else { 0.0 };
    gpu.begin(&view);
    gpu.draw(ObjectId(0));
    let queries: Vec<_> = (0..1500).map(|i| gpu.issue(&[at(i % 50, y(i)), at(i % 50, y(i))])).collect();
    for (i, query) in queries.into_iter().enumerate().rev() {
        assert_eq!(answer(&mut gpu, query), i % 7 == 3, "question {i}");
    }
    // Hidden, but too many to ask about.
    assert!(shows(&mut gpu, &[at(0, 0.0); 5000]));
    let many = vec![at(0, 0.0); 4000];
    assert!(!shows(&mut gpu, &many));
    let given_up = gpu.issue(&many);
    gpu.poll(given_up);
    gpu.begin(&view);
    assert!(shows(&mut gpu, &[at(0, 0.0)]), "nothing is drawn yet");
}

#[test]
fn what_the_device_cannot_do_shows() {
    let test = "what_the_device_cannot_do_shows";
    let mut random = Places::new(1);
    let scene = scene(&boxes(60, &mut random));
    let Some(mut gpu) = on_gpu(test, &scene, [64, 48]) else { return };
    assert!(matches!(GpuQueries::new(&scene, 1 << 20, 4), Err(GpuError::TooLarge { .. })));
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let view = random.view(0.05);
    let mut in_frustum = FrustumCuller::default().cull(&tree, &Frustum::new(&view)).to_vec();
    in_frustum.sort_unstable();
    // Given up within a frame, and before one.
    gpu.begin(&view);
    gpu.draw(in_frustum[0]);
    let query = gpu.issue(&[bounds(&scene, in_frustum[1])]);
    gpu.close();
    assert!(answer(&mut gpu, query));
    for mut culler in Culler::every_kind() {
        gpu.begin(&view);
        let mut drawn = culler.cull(&tree, &view, &mut gpu).0;
        drawn.sort_unstable();
        assert_eq!(drawn, in_frustum);
    }
    assert!(matches!(gpu.failure(), Some(GpuError::Failed { .. })), "{:?}", gpu.failure());
}
