//! What cullers by occlusion promise, over camera paths with jumps, kept by those of the studies, in trees of the studies.

use enfilade::ObjectId;
use enfilade::gpu::GpuError;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::chc::Chc;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::oracle::{OcclusionOracle, QueryId};
use enfilade::occlusion::queries::GpuQueries;
use enfilade::occlusion::stats::OnlineStats;
use enfilade::occlusion::view::{Frustum, View};
use enfilade::scene::Scene;
use enfilade_studies::boxes::Fit;
use enfilade_studies::levels::{C1_TO_C7, LevelCuller, LevelOptions};
use enfilade_studies::reductions::{ReducedChc, Reduction};
use enfilade_studies::trees::{Split, TreeOptions, binary, graph};
use glam::{DQuat, DVec3};
use testing::crowd::{Picture, all, crowd, path, scene, turned};
use testing::random::Places;

const SIZE: [usize; 2] = [48, 32];

/// Answers after being asked so many times; checks what it is told.
struct Late<'a, 's> {
    inner: &'a mut DepthBuffer<'s>,
    latency: u32,
    /// Times that each question has been asked for its answer; `None` once it was given.
    polls: Vec<Option<u32>>,
    drawn: Vec<ObjectId>,
}

impl<'a, 's> Late<'a, 's> {
    /// Begins a frame.
    fn new(inner: &'a mut DepthBuffer<'s>, latency: u32, view: &View) -> Self {
        inner.begin(view);
        Self { inner, latency, polls: Vec::new(), drawn: Vec::new() }
    }
}

impl OcclusionOracle for Late<'_, '_> {
    fn begin(&mut self, view: &View) {
        self.inner.begin(view);
    }

    fn issue(&mut self, boxes: &[Bounds]) -> QueryId {
        assert!(!boxes.is_empty());
        self.polls.push(Some(0));
        self.inner.issue(boxes)
    }

    fn poll(&mut self, query: QueryId) -> Option<bool> {
        let polls = self.polls[query.0 as usize].as_mut().expect("its answer was given");
        *polls += 1;
        if *polls <= self.latency {
            return None;
        }
        self.polls[query.0 as usize] = None;
        self.inner.poll(query)
    }

    fn draw(&mut self, object: ObjectId) {
        self.drawn.push(object);
        self.inner.draw(object);
    }
}

/// Any of the cullers of the studies.
#[derive(Clone)]
enum Any {
    Reduced(ReducedChc),
    Levels(LevelCuller),
}

impl Any {
    fn cull(&mut self, tree: &Hierarchy, view: &View, oracle: &mut impl OcclusionOracle) -> (Vec<ObjectId>, OnlineStats) {
        let frustum = &Frustum::new(view);
        match self {
            Self::Reduced(c) => (c.cull(tree, frustum, oracle).to_vec(), c.stats()),
            Self::Levels(c) => (c.cull(tree, frustum, oracle).to_vec(), c.stats()),
        }
    }

    fn reduced() -> Vec<(String, Self)> {
        let reductions = [Reduction::EveryNth(3), Reduction::AtRandom(0.5), Reduction::NotNearest(4)];
        reductions.map(|r| (format!("{r:?}"), Self::Reduced(ReducedChc::new(r, 1)))).to_vec()
    }

    fn every_kind() -> Vec<(String, Self)> {
        let levels = C1_TO_C7.map(|levels| {
            let least_triangles = u64::from(levels == C1_TO_C7[3]) * 40;
            let options = LevelOptions { least_triangles, ..LevelOptions::new(levels) };
            (format!("{options:?}"), Self::Levels(LevelCuller::new(options)))
        });
        Self::reduced().into_iter().chain(levels).collect()
    }
}

/// The scene's objects in groups of groups, by where they are.
fn four_levels(scene: &Scene) -> Hierarchy {
    let group = |cells: f64| {
        let of = |p: DVec3| ((p + 12.0) / 24.0 * cells).floor().dot(DVec3::new(1.0, 100.0, 10_000.0)) as u32;
        scene.objects.iter().map(|o| of(o.bounds.centre())).collect::<Vec<_>>()
    };
    graph(scene, &[group(2.0), group(4.0)])
}

/// Binary ones, and one of four levels at the end.
fn trees(scene: &Scene) -> Vec<Hierarchy> {
    let build = |fit, split| binary(scene, &TreeOptions { fit, split, least_triangles: 1 });
    vec![
        build(Fit::Aligned, Split::Sah),
        build(Fit::Minimum, Split::ObjectMedian),
        build(Fit::Covariance, Split::CentreMean),
        Hierarchy::build(scene, &HierarchyOptions::default()).with_parts(scene),
        four_levels(scene),
    ]
}

/// A crowd with glass in it, a path, and what shows in its frames.
fn walk(size: [usize; 2]) -> (Scene, Vec<View>, Vec<Vec<ObjectId>>) {
    let mut random = Places::new(3);
    let mut scene = scene(&crowd(120, &mut random));
    // Glass shows what is behind it.
    scene.objects[4].opaque = false;
    let views = path(&mut random, 25);
    let opaque: Vec<ObjectId> = all(&scene).into_iter().filter(|o| scene.objects[o.index()].opaque).collect();
    let shown = |view: &View| {
        let mut shown = Picture::new(&scene, &opaque, view, size).objects();
        if Picture::new(&scene, &all(&scene), view, size).objects().contains(&ObjectId(4)) {
            shown.push(ObjectId(4));
        }
        shown
    };
    let truth = views.iter().map(shown).collect();
    (scene, views, truth)
}

/// The promise: from the first frame on, jump or not, however late the oracle answers, what has a pixel is drawn.
#[test]
fn whatever_has_a_pixel_is_drawn_in_the_same_frame() {
    let (scene, views, truth) = walk(SIZE);
    let mut buffer = DepthBuffer::new(&scene, SIZE[0], SIZE[1]);
    let trees = trees(&scene);
    for (t, tree) in trees.iter().enumerate() {
        let in_frustum: usize = views.iter().map(|v| FrustumCuller::default().cull(tree, &Frustum::new(v)).len()).sum();
        for (name, culler) in Any::every_kind() {
            for latency in [0, 1, 7] {
                let mut culler = culler.clone();
                let mut count = 0;
                for (frame, (view, truth)) in views.iter().zip(&truth).enumerate() {
                    let mut oracle = Late::new(&mut buffer, latency, view);
                    let (mut drawn, stats) = culler.cull(tree, view, &mut oracle);
                    let place = format!("tree {t}, {name}, latency {latency}, frame {frame}");
                    assert_eq!(drawn, oracle.drawn, "{place}");
                    assert!(oracle.polls.iter().all(Option::is_none), "{place}: an answer isn't awaited");
                    assert_eq!(stats.queries, oracle.polls.len() as u64, "{place}");
                    assert_eq!(stats.objects, drawn.len() as u64, "{place}");
                    count += drawn.len();
                    drawn.sort_unstable();
                    assert!(drawn.is_sorted_by(|a, b| a < b), "{place}: an object is drawn twice");
                    for object in truth {
                        assert!(drawn.contains(object), "{place}: object {object} is missing");
                    }
                }
                match &culler {
                    Any::Levels(_) if name.contains("levels: 0,") => assert_eq!(count, in_frustum, "tree {t}, {name}"),
                    // Of the binary trees' levels, the upper ones never hide a whole.
                    Any::Levels(_) if t + 1 < trees.len() => assert!(count <= in_frustum, "tree {t}, {name}"),
                    _ => assert!(count < in_frustum, "tree {t}, {name}: {count} of {in_frustum}"),
                }
            }
        }
    }
}

/// The same by occlusion queries of a graphics processor. Answers that come late hide less.
#[test]
fn whatever_has_a_pixel_is_drawn_with_a_device() {
    let size = [96, 64];
    let (scene, views, truth) = walk(size);
    let mut gpu = match GpuQueries::new(&scene, size[0], size[1]) {
        Ok(gpu) => gpu,
        Err(e @ GpuError::NoAdapter { .. }) => {
            assert!(std::env::var_os("CI").is_none(), "{e}");
            return eprintln!("not run: whatever_has_a_pixel_is_drawn_with_a_device: {e}");
        }
        Err(e) => panic!("{e}"),
    };
    let mut buffer = DepthBuffer::new(&scene, size[0], size[1]);
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let (mut by_device, mut by_software) = (0, 0);
    let levels = Any::Levels(LevelCuller::new(LevelOptions::new(C1_TO_C7[6] << 2)));
    for mut culler in [Any::Reduced(ReducedChc::new(Reduction::AtRandom(0.5), 1)), levels] {
        let mut other = culler.clone();
        for (frame, (view, truth)) in views.iter().zip(&truth).enumerate() {
            gpu.begin(view);
            let (drawn, stats) = culler.cull(&tree, view, &mut gpu);
            assert_eq!(gpu.failure(), None);
            assert!(gpu.batches() <= stats.queries, "{stats:?}");
            assert!(truth.iter().all(|o| drawn.contains(o)), "frame {frame}: an object is missing");
            by_device += drawn.len();
            buffer.begin(view);
            by_software += other.cull(&tree, view, &mut buffer).0.len();
        }
    }
    println!("{by_device} drawn, {by_software} with answers at once");
    assert!(by_device * 10 < by_software * 11, "{by_device} and {by_software}");
}

/// Frames of a camera that stands before a wall, and what they cost.
fn before_a_wall(culler: &mut Any, frames: usize, latency: u32) -> Vec<OnlineStats> {
    let mut boxes = crowd(200, &mut Places::new(11));
    boxes.push(turned(DVec3::X * 11.0, DQuat::IDENTITY, DVec3::new(0.1, 30.0, 30.0)));
    let scene = scene(&boxes);
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let view = View::look_at(DVec3::X * 14.0, DVec3::ZERO, 1.2, 1.5, 0.05);
    let mut buffer = DepthBuffer::new(&scene, SIZE[0], SIZE[1]);
    (0..frames).map(|_| culler.cull(&tree, &view, &mut Late::new(&mut buffer, latency, &view)).1).collect()
}

#[test]
fn behind_a_wall_nothing_is_drawn_and_little_is_asked() {
    for (name, mut culler) in Any::reduced() {
        let stats = before_a_wall(&mut culler, 24, 0);
        // By then whatever was drawn before the wall, in the first frame, and counted as in sight since, has been asked about.
        for (frame, of_frame) in stats.iter().enumerate().skip(16) {
            // The wall itself; a tree of 201 has some 400 nodes.
            assert!(of_frame.objects <= 3, "{name}, frame {frame}: {of_frame:?}");
            assert!(of_frame.queries <= 20, "{name}, frame {frame}: {of_frame:?}");
        }
    }
}

/// A late oracle costs waits, not objects that are missing; while others are to be visited nobody waits.
#[test]
fn waits_come_from_latency_alone() {
    for (name, culler) in Any::reduced() {
        let waits = |latency| before_a_wall(&mut culler.clone(), 3, latency).iter().map(|s| s.waits).sum::<u64>();
        assert_eq!(waits(0), 0, "{name}");
        assert!(waits(5) > 0, "{name}");
    }
}

#[test]
fn reductions_ask_less() {
    let scene = scene(&crowd(150, &mut Places::new(12)));
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let mut buffer = DepthBuffer::new(&scene, SIZE[0], SIZE[1]);
    let view = View::look_at(DVec3::new(14.0, 2.0, 1.0), DVec3::ZERO, 1.0, 1.5, 0.05);
    let mut queries = |reduction| {
        let mut culler = ReducedChc::new(reduction, 1);
        let mut sum = 0;
        for _ in 0..24 {
            buffer.begin(&view);
            culler.cull(&tree, &Frustum::new(&view), &mut buffer);
            sum += culler.stats().queries;
        }
        sum
    };
    let all = queries(Reduction::None);
    for reduction in [Reduction::EveryNth(3), Reduction::AtRandom(0.5), Reduction::NotNearest(10)] {
        let fewer = queries(reduction);
        assert!(fewer < all, "{reduction:?}: {fewer} of {all}");
    }
}

/// Without a reduction: the same objects in the same order for the same questions, with answers at once and later.
#[test]
fn without_a_reduction_it_is_the_library_s_chc() {
    let (scene, views, _) = walk(SIZE);
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let mut buffer = DepthBuffer::new(&scene, SIZE[0], SIZE[1]);
    for latency in [None, Some(0), Some(3)] {
        let (mut chc, mut same) = (Chc::default(), ReducedChc::new(Reduction::None, 1));
        for view in &views {
            let frustum = Frustum::new(view);
            let Some(latency) = latency else {
                buffer.begin(view);
                let drawn = chc.cull(&tree, &frustum, &mut buffer).to_vec();
                buffer.begin(view);
                assert_eq!(same.cull(&tree, &frustum, &mut buffer), drawn);
                assert_eq!(same.stats(), chc.stats());
                continue;
            };
            let drawn = chc.cull(&tree, &frustum, &mut Late::new(&mut buffer, latency, view)).to_vec();
            assert_eq!(same.cull(&tree, &frustum, &mut Late::new(&mut buffer, latency, view)), drawn);
            assert_eq!(same.stats(), chc.stats());
        }
    }
}

#[test]
fn a_scene_without_objects_has_nothing_to_draw() {
    let scene = scene(&[]);
    let view = View::look_at(DVec3::ZERO, DVec3::X, 1.0, 1.0, 0.1);
    let mut buffer = DepthBuffer::new(&scene, 8, 8);
    for tree in [Hierarchy::build(&scene, &HierarchyOptions::default()), four_levels(&scene)] {
        for (name, mut culler) in Any::every_kind() {
            buffer.begin(&view);
            let (drawn, stats) = culler.cull(&tree, &view, &mut buffer);
            assert_eq!((drawn.len(), stats), (0, OnlineStats::default()), "{name}");
        }
    }
}
