//! The tables of two studies again, with the software oracle on one thread, 1024 x 768 pixels: frustum culling and occlusion culling in
//! Teapots(500, 30), (5000, 3) and (5000, 20) by six trees and three boxes (P. Ivson, *Técnicas de Otimização para Visualização de Modelos
//! Massivos*, PUC-Rio, 2006, section 6.4), and seven choices of levels in a dense and a sparse city (V. Cunha, M. Leitão, *Exploração da
//! Remoção Hierárquica por Oclusão em Simulações em Tempo Real*, ISEP, table 2).
//!
//! The camera goes six stretches of its path, 10 frames each among teapots, 30 in cities; between them it jumps. First the answers are checked: in the middle frame of each
//! stretch, no culler leaves out an object that a picture of everything shows. Times are of whole frames, culling and all drawing,
//! added up, each city's also with as many triangles as the study's has, and of several runs the fastest counts; *plain* (everything is drawn) and *known* (the exactly visible objects are drawn, and nobody is asked) are measured in
//! the middle frames and compared there. `--test` takes one small scene, `--cities` the cities alone,
//! `--teapots COUNT,SCALE` one scene of teapots alone.

use enfilade::generate::{Kind, generate};
use enfilade::occlusion::bounds::Fit;
use enfilade::occlusion::chc::{Chc, Reduction};
use enfilade::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions, Split};
use enfilade::occlusion::levels::{C1_TO_C7, LevelCuller, LevelOptions};
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::view::Frustum;
use enfilade::runtime::{Auto, FrameMode, Mode};
use enfilade::scene::{ImportOptions, Object, Scene, import};
use enfilade::walkthrough::missed::objects_shown;
use enfilade::walkthrough::path::CameraPath;
use enfilade::walkthrough::raster::{View, draw};
use enfilade::{CellId, ObjectId};
use glam::DVec3;
use std::cell::RefCell;
use std::path::PathBuf;
use std::time::Instant;

const SIZE: [usize; 2] = [1024, 768];
const STRETCHES: usize = 6;
/// Runs of which the fastest counts.
const RUNS: usize = 3;
/// How often a building's triangles are divided in four, so that they are as many as in the study: 45 million in the dense city.
const DETAIL: u32 = 3;
/// A teapot is one object.
const TEAPOT: u32 = 2712;

fn main() {
    let has = |flag: &str| std::env::args().any(|a| a == flag);
    if has("--test") {
        teapots(50, 20, &[Split::ObjectMedian]);
        return;
    }
    if let Some(at) = std::env::args().position(|a| a == "--teapots") {
        let scene = std::env::args().nth(at + 1).unwrap_or_default();
        let [count, scale] = scene.split(',').map(|n| n.parse().expect("a number")).collect::<Vec<_>>()[..] else {
            panic!("--teapots COUNT,SCALE")
        };
        teapots(count, scale, &Split::ALL);
        return;
    }
    let teapot_scenes = if has("--cities") { &[][..] } else { &[(500, 30), (5000, 3), (5000, 20)] };
    for &(count, scale) in teapot_scenes {
        teapots(count, scale, &Split::ALL);
    }
    for detail in [0, DETAIL] {
        city(true, detail);
        city(false, detail);
    }
}

/// A scene, its camera's frames, and the objects that show in the middle frame of each stretch.
struct Study {
    scene: &'static Scene,
    buffer: RefCell<DepthBuffer<'static>>,
    frames: Vec<View>,
    /// Frames of a stretch.
    stretch: usize,
    shown: Vec<Vec<ObjectId>>,
}

/// What frames cost, all and the middle ones, in seconds; triangles and queries a frame.
#[derive(Clone, Copy, Default)]
struct Cost {
    all: f64,
    middle: f64,
    slowest: f64,
    triangles: f64,
    queries: f64,
}

impl Study {
    fn new(kind: Kind, name: &str, stretch: usize, detail: u32) -> Self {
        let made = generate(kind, 0).expect("a scene");
        let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.glb"));
        std::fs::write(&file, &made.glb).expect("a folder to write to");
        let options = ImportOptions { object_triangles: TEAPOT, ..ImportOptions::default() };
        // For as long as the program runs: a handful.
        let scene: &'static Scene =
            Box::leak(Box::new(detailed(import(&file, &options).expect("what was generated"), detail)));
        let path = CameraPath::from_json(&made.path.to_string()).expect("a path");
        let frames: Vec<View> = (0..STRETCHES * stretch)
            .map(|i| {
                let start = (path.frames.len() - stretch) * (i / stretch) / (STRETCHES - 1);
                let camera = path.camera(start + i % stretch, scene.origin, SIZE[0] as f64 / SIZE[1] as f64);
                View { camera, near: path.near, width: SIZE[0], height: SIZE[1] }
            })
            .collect();
        let shown = (0..STRETCHES)
            .map(|s| objects_shown(scene, &draw(scene, &frames[s * stretch + stretch / 2], &|_| true)))
            .collect();
        println!("\n{name}: {} objects, {} triangles", scene.objects.len(), scene.triangles.len());
        let buffer = RefCell::new(DepthBuffer::new(scene, SIZE[0], SIZE[1]));
        Self { scene, buffer, frames, stretch, shown }
    }

    fn triangles(&self, objects: &[ObjectId]) -> f64 {
        objects.iter().map(|o| self.scene.objects[o.index()].triangles.len() as f64).sum()
    }

    fn middle(&self, stretch: usize) -> usize {
        stretch * self.stretch + self.stretch / 2
    }

    /// Runs all frames; `culler` makes what draws one and says what, and how many queries it took.
    fn run<C>(&self, culler: impl Fn() -> C) -> Cost
    where
        C: FnMut(&Frustum, &mut DepthBuffer<'_>) -> (Vec<ObjectId>, u64),
    {
        let mut buffer = self.buffer.borrow_mut();
        let runs = (0..RUNS).map(|_| self.run_once(&mut culler(), &mut buffer));
        runs.min_by(|a, b| a.all.total_cmp(&b.all)).expect("a run")
    }

    fn run_once(
        &self,
        cull: &mut impl FnMut(&Frustum, &mut DepthBuffer<'_>) -> (Vec<ObjectId>, u64),
        buffer: &mut DepthBuffer<'_>,
    ) -> Cost {
        let mut cost = Cost::default();
        for (i, view) in self.frames.iter().enumerate() {
            let view = view.camera.view(view.near);
            let start = Instant::now();
            buffer.begin(&view);
            let (mut drawn, queries) = cull(&Frustum::new(&view), buffer);
            let seconds = start.elapsed().as_secs_f64();
            cost.all += seconds;
            cost.slowest = cost.slowest.max(seconds);
            cost.triangles += self.triangles(&drawn) / self.frames.len() as f64;
            cost.queries += queries as f64 / self.frames.len() as f64;
            if i == self.middle(i / self.stretch) {
                cost.middle += seconds;
                drawn.sort_unstable();
                let shown = &self.shown[i / self.stretch];
                assert!(shown.iter().all(|o| drawn.binary_search(o).is_ok()), "frame {i}: an object that shows isn't drawn");
            }
        }
        cost
    }

    /// Draws the middle frames alone, for who keeps nothing from frame to frame.
    fn middles(&self, mut objects: impl FnMut(usize, &Frustum) -> Vec<ObjectId>) -> Cost {
        let mut buffer = self.buffer.borrow_mut();
        let mut cost = Cost::default();
        for stretch in 0..STRETCHES {
            let view = self.frames[self.middle(stretch)];
            let view = view.camera.view(view.near);
            let frustum = Frustum::new(&view);
            let mut least = f64::INFINITY;
            for _ in 0..RUNS {
                let start = Instant::now();
                buffer.begin(&view);
                objects(stretch, &frustum).into_iter().for_each(|o| buffer.draw(o));
                least = least.min(start.elapsed().as_secs_f64());
            }
            cost.middle += least;
            cost.triangles += self.triangles(&objects(stretch, &frustum)) / STRETCHES as f64;
        }
        cost
    }

    fn everything(&self) -> Vec<ObjectId> {
        (0..self.scene.objects.len() as u32).map(ObjectId).collect()
    }

    /// The visible objects, the nearest first.
    fn known(&self, stretch: usize) -> Vec<ObjectId> {
        let eye: DVec3 = self.frames[self.middle(stretch)].camera.eye.as_dvec3();
        let mut shown = self.shown[stretch].clone();
        shown.sort_by(|a, b| {
            let at = |o: &ObjectId| self.scene.objects[o.index()].bounds.centre().distance_squared(eye);
            at(a).total_cmp(&at(b))
        });
        shown
    }

    /// Of whoever knows what shows.
    fn known_cost(&self) -> Cost {
        let known: Vec<_> = (0..STRETCHES).map(|s| self.known(s)).collect();
        self.middles(|stretch, _| known[stretch].clone())
    }

    fn frustum(&self, tree: &Hierarchy) -> Cost {
        self.run(|| {
            let mut culler = FrustumCuller::default();
            move |frustum: &Frustum, buffer: &mut DepthBuffer<'_>| {
                let objects = culler.cull(tree, frustum).to_vec();
                objects.iter().for_each(|&o| buffer.draw(o));
                (objects, 0)
            }
        })
    }

    fn chc(&self, tree: &Hierarchy) -> Cost {
        self.run(|| {
            let mut culler = Chc::new(Reduction::None, 0);
            move |frustum: &Frustum, buffer: &mut DepthBuffer<'_>| {
                (culler.cull(tree, frustum, buffer).to_vec(), culler.stats().queries)
            }
        })
    }

    fn chc_plus(&self, tree: &Hierarchy) -> Cost {
        self.run(|| {
            let mut culler = ChcPlus::new(ChcPlusOptions::default());
            move |frustum: &Frustum, buffer: &mut DepthBuffer<'_>| {
                (culler.cull(tree, frustum, buffer).to_vec(), culler.stats().queries)
            }
        })
    }
}

/// The same scene with the triangles of its buildings divided in four, so many times.
fn detailed(scene: Scene, times: u32) -> Scene {
    if times == 0 {
        return scene;
    }
    let mut new = Scene { positions: Vec::new(), triangles: Vec::new(), objects: Vec::new(), ..scene.clone() };
    for object in &scene.objects {
        let start = new.triangles.len() as u32;
        let is_building = object.node.split('/').nth(2).is_some_and(|name| name.starts_with('b'));
        for t in object.triangles.clone() {
            divide(scene.corners(t as usize), if is_building { times } else { 0 }, &mut new);
        }
        new.objects.push(Object { triangles: start..new.triangles.len() as u32, ..object.clone() });
    }
    new
}

fn divide([a, b, c]: [DVec3; 3], times: u32, scene: &mut Scene) {
    if times == 0 {
        let first = scene.positions.len() as u32;
        scene.positions.extend([a, b, c]);
        scene.triangles.push([first, first + 1, first + 2]);
        return;
    }
    // The same point from either end, so that neighbours meet.
    let [ab, bc, ca] = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
    for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
        divide(part, times - 1, scene);
    }
}

fn row(name: &str, frames: usize, cost: &Cost, frustum: &Cost) {
    let frames = frames as f64;
    println!(
        "| {name} | {:.2} | {:.2} | {:.0} | {:.0} | {:.3} | {:.3} |",
        cost.all / frames * 1e3,
        cost.slowest * 1e3,
        cost.triangles,
        cost.queries,
        frustum.triangles / cost.triangles,
        frustum.all / cost.all
    );
}

const HEAD: &str =
    "| culler | ms a frame | slowest | triangles | queries | frustum's triangles over its | frustum's time over its |
| --- | --- | --- | --- | --- | --- | --- |";

fn teapots(count: usize, scale: usize, splits: &[Split]) {
    let study = Study::new(Kind::Teapots { count, scale }, &format!("teapots{count}x{scale}"), 10, 0);
    // The first has the page faults.
    study.known_cost();
    let (plain, known) = (study.middles(|_, _| study.everything()).middle, study.known_cost());
    let each = 1e3 / STRETCHES as f64;
    println!(
        "plain: {:.2} ms a frame; known: {:.2} ms, {:.0} triangles\n",
        plain * each,
        known.middle * each,
        known.triangles
    );
    println!(
        "| tree | box | tree, s | frustum, ms | chc, ms | triangles: plain over frustum | plain over chc | time: plain over frustum | plain over chc |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    let all = study.scene.triangles.len() as f64;
    for &split in splits {
        // Boxes of about the least volume take minutes a tree of 5,000 teapots: two trees have them.
        let fits = [Fit::Aligned, Fit::Covariance, Fit::Minimum];
        let slow = count > 500 && !matches!(split, Split::ObjectMedian | Split::Sah);
        for &fit in &fits[..if slow { 2 } else { 3 }] {
            let start = Instant::now();
            let tree = Hierarchy::build(study.scene, &HierarchyOptions { fit, split, least_triangles: 1 });
            let built = start.elapsed().as_secs_f64();
            let mut culler = FrustumCuller::default();
            let frustum = study.middles(|_, frustum| culler.cull(&tree, frustum).to_vec());
            let chc = study.chc(&tree);
            println!(
                "| {split:?} | {fit:?} | {built:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
                frustum.middle * each,
                chc.middle * each,
                all / frustum.triangles,
                all / chc.triangles,
                plain / frustum.middle,
                plain / chc.middle
            );
        }
    }
    let tree = Hierarchy::build(study.scene, &HierarchyOptions::default());
    let parts = tree.clone().with_parts(study.scene);
    println!();
    for (name, tree) in [("chc++", &tree), ("chc++ with parts", &parts)] {
        let plus = study.chc_plus(tree);
        println!(
            "{name}: {:.2} ms, {:.0} triangles, {:.3} of known's time",
            plus.middle * each,
            plus.triangles,
            plus.middle / known.middle
        );
    }
}

fn city(dense: bool, detail: u32) {
    let study = Study::new(Kind::City { dense }, if dense { "city-dense" } else { "city-sparse" }, 30, detail);
    // Objects are named after where they stand: `g00/a0000/b00`; the ground is in no group.
    let part = |object: &enfilade::scene::Object, at: usize| {
        let number = object.node.split('/').nth(at).and_then(|p| p[1..].parse().ok());
        number.unwrap_or(u32::MAX)
    };
    let levels: Vec<Vec<u32>> = (0..2).map(|at| study.scene.objects.iter().map(|o| part(o, at)).collect()).collect();
    let graph = Hierarchy::from_levels(study.scene, Fit::Aligned, &levels);
    let tree = Hierarchy::build(study.scene, &HierarchyOptions::default());
    study.known_cost();
    let known = study.known_cost();
    let (frames, frustum) = (study.frames.len(), study.frustum(&graph));
    println!("{HEAD}");
    for (i, &levels) in C1_TO_C7.iter().enumerate() {
        let cost = study.run(|| {
            let mut culler = LevelCuller::new(LevelOptions::new(levels));
            let graph = &graph;
            move |frustum: &Frustum, buffer: &mut DepthBuffer<'_>| {
                (culler.cull(graph, frustum, buffer).to_vec(), culler.stats().queries)
            }
        });
        row(&format!("C{}", i + 1), frames, &cost, &frustum);
    }
    row("frustum, binary tree", frames, &study.frustum(&tree), &frustum);
    let parts = tree.clone().with_parts(study.scene);
    row("chc", frames, &study.chc(&tree), &frustum);
    row("chc++", frames, &study.chc_plus(&tree), &frustum);
    row("chc, with parts", frames, &study.chc(&parts), &frustum);
    let plus = study.chc_plus(&parts);
    row("chc++, with parts", frames, &plus, &frustum);
    row("auto", frames, &auto(&study, &tree), &frustum);
    println!(
        "in the middle frames: known {:.2} ms, {:.0} triangles; chc++ with parts takes {:.3} of its time",
        known.middle * 1e3 / STRETCHES as f64,
        known.triangles,
        plus.middle / known.middle
    );
}

/// By what frames cost: the frustum, CHC or CHC++.
fn auto(study: &Study, tree: &Hierarchy) -> Cost {
    study.run(|| {
        let mut auto = Auto::new(1, &[FrameMode::Frustum, FrameMode::Chc, FrameMode::ChcPlus]);
        let mut frustum_culler = FrustumCuller::default();
        let (mut chc, mut plus) = (Chc::new(Reduction::None, 0), ChcPlus::new(ChcPlusOptions::default()));
        move |frustum: &Frustum, buffer: &mut DepthBuffer<'_>| {
            let start = Instant::now();
            let count = |_: Mode| study.triangles(frustum_culler.cull(tree, frustum)) as u64;
            let done = match auto.choose(Some(CellId(0)), count) {
                FrameMode::Chc => (chc.cull(tree, frustum, buffer).to_vec(), chc.stats().queries),
                FrameMode::ChcPlus => (plus.cull(tree, frustum, buffer).to_vec(), plus.stats().queries),
                _ => {
                    let objects = frustum_culler.cull(tree, frustum).to_vec();
                    objects.iter().for_each(|&o| buffer.draw(o));
                    (objects, 0)
                }
            };
            auto.learn(start.elapsed().as_secs_f64(), study.triangles(&done.0) as u64);
            done
        }
    })
}
