//! Guarantees of all occlusion cullers, over camera paths with jumps.

use super::bounds::Bounds;
use super::chc::Chc;
use super::chc_plus::{ChcPlus, ChcPlusOptions, Interval};
use super::depth::DepthBuffer;
use super::frustum::FrustumCuller;
use super::hierarchy::{Divide, Hierarchy, HierarchyOptions, Node};
use super::oracle::{OcclusionOracle, QueryId};
use super::scenes::{Picture, crowd, random_view, turned_tree};
use super::stats::OnlineStats;
use super::view::{Frustum, View};
use crate::ObjectId;
use crate::math::geom::Aabb;
use crate::math::random::Prng;
use crate::types::scene::Scene;
use glam::DVec3;

const SIZE: [usize; 2] = [48, 32];

/// An oracle that answers after `latency` polls, and checks its calls.
struct Late<'a, 's> {
    inner: &'a mut DepthBuffer<'s>,
    latency: u32,
    /// Polls of each query; `None` after its answer.
    polls: Vec<Option<u32>>,
    drawn: Vec<ObjectId>,
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

/// Any of the occlusion cullers.
#[derive(Clone)]
enum Any {
    Chc(Chc),
    Plus(ChcPlus),
}

impl Any {
    fn cull(
        &mut self,
        tree: &Hierarchy,
        frustum: &Frustum,
        oracle: &mut impl OcclusionOracle,
    ) -> (Vec<ObjectId>, OnlineStats) {
        match self {
            Self::Chc(c) => (c.cull(tree, frustum, oracle).to_vec(), c.stats()),
            Self::Plus(c) => (c.cull(tree, frustum, oracle).to_vec(), c.stats()),
        }
    }

    fn every_kind() -> Vec<(String, Self)> {
        let plus = [(20, 8, 1.4), (1, 1, 0.0), (5, 3, 1.4)].map(|(batch, frames, tighter)| {
            let assumed = Interval::Frames(frames);
            let options = ChcPlusOptions { batch, assumed, tighter, seed: 2 };
            (format!("{options:?}"), Self::Plus(ChcPlus::new(options)))
        });
        [("CHC".to_owned(), Self::Chc(Chc::default()))].into_iter().chain(plus).collect()
    }
}

/// The scene's objects in nested groups, by position.
fn four_levels(scene: &Scene) -> Hierarchy {
    struct Grid<'s>(&'s [Aabb]);
    impl Divide for Grid<'_> {
        fn divide(&mut self, node: &Node, objects: &mut [ObjectId]) -> Vec<usize> {
            let cells = [2.0, 4.0, f64::INFINITY][node.level.min(2) as usize];
            if cells.is_infinite() {
                return vec![1; objects.len()];
            }
            let of = |o: &ObjectId| {
                let cell = ((self.0[o.index()].centre() + 12.0) / 24.0 * cells).floor();
                cell.dot(DVec3::new(1.0, 100.0, 10_000.0)) as u32
            };
            objects.sort_by_key(of);
            objects.chunk_by(|a, b| of(a) == of(b)).map(<[_]>::len).collect()
        }
    }
    let boxes: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();
    let triangles: Vec<u32> = scene.objects.iter().map(|o| o.triangles.len() as u32).collect();
    Hierarchy::divided(&boxes, &triangles, &mut Grid(&boxes))
}

fn trees(scene: &Scene) -> Vec<Hierarchy> {
    let binary = Hierarchy::build(scene, &HierarchyOptions::default());
    vec![binary.clone(), turned_tree(scene), binary.with_parts(scene), four_levels(scene)]
}

/// A walk with a jump every fifth frame, a look back, and stops.
fn path(seed: u64, frames: usize) -> Vec<View> {
    let mut rng = Prng::new(seed, 0);
    let mut views: Vec<View> = Vec::new();
    for frame in 0..frames {
        let next = match (views.last(), frame % 5) {
            (Some(view), 1) => *view,
            (Some(view), 2) => View { eye: view.eye + view.w * 0.3, ..*view },
            (Some(view), 3) => View { x: -view.x, w: -view.w, ..*view },
            (Some(view), 4) => View { x: -view.x, w: -view.w, ..*view },
            _ => random_view(&mut rng, 0.05),
        };
        views.push(next);
    }
    views
}

fn objects(scene: &Scene) -> Vec<ObjectId> {
    (0..scene.objects.len() as u32).map(ObjectId).collect()
}

/// The guarantee: from the first frame, with jumps, and with any latency, every object with a pixel is drawn.
#[test]
fn whatever_has_a_pixel_is_drawn_in_the_same_frame() {
    let mut scene = crowd(120, 9);
    // Glass hides nothing.
    scene.objects[4].opaque = false;
    let views = path(3, 25);
    let opaque: Vec<ObjectId> = objects(&scene).into_iter().filter(|o| scene.objects[o.index()].opaque).collect();
    let truth: Vec<Vec<ObjectId>> = views
        .iter()
        .map(|view| {
            let mut seen = Picture::new(&scene, &opaque, view, SIZE).objects();
            if Picture::new(&scene, &objects(&scene), view, SIZE).objects().contains(&ObjectId(4)) {
                seen.push(ObjectId(4));
            }
            seen
        })
        .collect();
    let mut buffer = DepthBuffer::new(&scene, SIZE[0], SIZE[1]);
    for (t, tree) in trees(&scene).iter().enumerate() {
        let in_frustum: usize = views.iter().map(|v| FrustumCuller::default().cull(tree, &Frustum::new(v)).len()).sum();
        for (name, culler) in Any::every_kind() {
            for latency in [0, 1, 7] {
                let mut culler = culler.clone();
                let mut count = 0;
                for (frame, (view, truth)) in views.iter().zip(&truth).enumerate() {
                    buffer.begin(view);
                    let mut oracle = Late { inner: &mut buffer, latency, polls: Vec::new(), drawn: Vec::new() };
                    let (mut drawn, stats) = culler.cull(tree, &Frustum::new(view), &mut oracle);
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
                assert!(count < in_frustum, "tree {t}, {name}: {count} of {in_frustum}");
            }
        }
    }
}

/// Frames of a camera in front of a wall, with their counters.
fn before_a_wall(culler: &mut Any, frames: usize, latency: u32) -> Vec<OnlineStats> {
    let mut scene = crowd(200, 11);
    let wall = super::scenes::turned(DVec3::X * 11.0, glam::DQuat::IDENTITY, DVec3::new(0.1, 30.0, 30.0));
    super::scenes::add(&mut scene, &wall, 1);
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let view = View::look_at(DVec3::X * 14.0, DVec3::ZERO, 1.2, 1.5, 0.05);
    let mut buffer = DepthBuffer::new(&scene, SIZE[0], SIZE[1]);
    let mut one = |_| {
        buffer.begin(&view);
        let mut oracle = Late { inner: &mut buffer, latency, polls: Vec::new(), drawn: Vec::new() };
        culler.cull(&tree, &Frustum::new(&view), &mut oracle).1
    };
    (0..frames).map(&mut one).collect()
}

#[test]
fn behind_a_wall_nothing_is_drawn_and_little_is_asked() {
    for (name, mut culler) in Any::every_kind() {
        let stats = before_a_wall(&mut culler, 24, 0);
        // By then all objects drawn before the wall in the first frame, and assumed visible since, have been queried.
        for (frame, of_frame) in stats.iter().enumerate().skip(16) {
            // The wall itself; a tree of 201 has some 400 nodes.
            assert!(of_frame.objects <= 3, "{name}, frame {frame}: {of_frame:?}");
            assert!(of_frame.queries <= 20, "{name}, frame {frame}: {of_frame:?}");
        }
    }
}

/// CHC++ issues fewer queries for a static view than CHC.
#[test]
fn chc_plus_asks_less() {
    let scene = crowd(150, 12);
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let mut buffer = DepthBuffer::new(&scene, SIZE[0], SIZE[1]);
    let view = View::look_at(DVec3::new(14.0, 2.0, 1.0), DVec3::ZERO, 1.0, 1.5, 0.05);
    let mut queries = |mut culler: Any| {
        let mut sum = 0;
        for _ in 0..24 {
            buffer.begin(&view);
            sum += culler.cull(&tree, &Frustum::new(&view), &mut buffer).1.queries;
        }
        sum
    };
    let [all, plus] = [Any::Chc(Chc::default()), Any::Plus(ChcPlus::new(ChcPlusOptions::default()))].map(&mut queries);
    assert!(plus * 2 < all, "{plus} and {all}");
}

/// A late oracle costs waits, but loses no objects; there is no wait while other nodes are left.
#[test]
fn waits_come_from_latency_alone() {
    for (name, culler) in Any::every_kind() {
        let waits = |latency| before_a_wall(&mut culler.clone(), 3, latency).iter().map(|s| s.waits).sum::<u64>();
        assert_eq!(waits(0), 0, "{name}");
        assert!(waits(5) > 0, "{name}");
    }
}

#[test]
fn a_scene_without_objects_has_nothing_to_draw() {
    let scene = crowd(0, 0);
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let view = View::look_at(DVec3::ZERO, DVec3::X, 1.0, 1.0, 0.1);
    let mut buffer = DepthBuffer::new(&scene, 8, 8);
    for (name, mut culler) in Any::every_kind() {
        buffer.begin(&view);
        let (drawn, stats) = culler.cull(&tree, &Frustum::new(&view), &mut buffer);
        assert_eq!((drawn.len(), stats), (0, OnlineStats::default()), "{name}");
    }
    assert!(FrustumCuller::default().cull(&tree, &Frustum::new(&view)).is_empty());
}
