//! Where and when to ask: CHC and CHC++ beside three others who ask, and beside a map that answers in their place. An office of 165 furnished
//! rooms, two cities, teapots; 1024 x 768 pixels; the camera goes six stretches of 30 frames (3 among teapots) along the path of each scene.
//!
//! * A regular grid, so many of its cells asked about at a time, nothing kept from frame to frame (K. Hillesland, B. Salomon, A. Lastra,
//!   D. Manocha, *Fast and simple occlusion culling using hardware-based depth queries*, 2002).
//! * The late rule of OpenSceneGraph's query nodes: each leaf is drawn or not by its answer in an earlier frame. Things show late.
//! * Cost and benefit by measured costs (M. Guthe, A. Balazs, R. Klein, *Near optimal hierarchical culling*, 2006).
//! * An occupancy map (D. Staneker, D. Bartz, W. Strasser, *Occlusion culling in OpenSG PLUS*, 2004), which answers for the oracle where a box
//!   reaches a part of the screen on which nothing is drawn yet.
//!
//! First the answers are checked: in the middle frame of each stretch no object that a picture of everything shows is left out, but by the late
//! rule, whose misses are counted there. Then the times, each frame the fastest of three runs, mean over the frames, software depth buffer, one
//! thread. *Late answers*: the same buffer, which doesn't say that it answers at once, as a graphics processor's queries do: so what showed is
//! drawn before its answer comes. `--test` takes a small office alone.

mod grid;
mod late;
mod near_optimal;
mod occupancy;

use enfilade::ObjectId;
use enfilade::occlusion::bounds::Bounds;
use enfilade::occlusion::chc::Chc;
use enfilade::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::oracle::{OcclusionOracle, QueryId};
use enfilade::occlusion::view::{Frustum, View};
use enfilade::runtime::Camera;
use enfilade::scene::Scene;
use enfilade::scene::rays::RayScene;
use enfilade_measure::walkthrough::missed::{missed_pixels, objects_shown};
use enfilade_measure::walkthrough::raster;
use enfilade_scenes::Kind;
use grid::Grid;
use late::LateRule;
use near_optimal::{Costs, NearOptimal};
use occupancy::Occupancy;
use std::path::PathBuf;
use std::time::Instant;
use testing::stretches::{Stretches, scenes};

const SIZE: [usize; 2] = [1024, 768];
const RUNS: usize = 3;
/// Cells of the grid that are asked about at a time.
const AT_A_TIME: [usize; 3] = [1, 16, 256];

fn main() {
    println!("| scene | answers | method | queries | triangles | ms a frame | missed pixels |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    scenes(std::env::args().any(|a| a == "--test")).into_iter().for_each(|(name, kind)| measure(&name, kind));
}

/// An oracle that doesn't say that its answers are there at once.
struct Later<'o, 's>(&'o mut DepthBuffer<'s>);

impl OcclusionOracle for Later<'_, '_> {
    fn begin(&mut self, view: &View) {
        self.0.begin(view);
    }

    fn issue(&mut self, boxes: &[Bounds]) -> QueryId {
        self.0.issue(boxes)
    }

    fn poll(&mut self, query: QueryId) -> Option<bool> {
        self.0.poll(query)
    }

    fn draw(&mut self, object: ObjectId) {
        OcclusionOracle::draw(self.0, object);
    }
}

/// What a frame draws, and how many queries that took.
type Culled = (Vec<ObjectId>, u64);

/// A scene and its camera's frames.
struct Study<'s> {
    name: &'s str,
    scene: &'s Scene,
    tree: Hierarchy,
    cameras: Vec<Camera>,
    /// Frames of a stretch.
    stretch: usize,
    near: f64,
}

fn measure(name: &str, kind: Kind) {
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("queries.glb");
    let Stretches { scene, cameras, stretch, near } = Stretches::new(kind, &file, SIZE);
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let study = Study { name, scene: &scene, tree, cameras, stretch, near };
    study.frustum();
    study.at_once();
    study.late();
}

impl Study<'_> {
    fn frustum(&self) {
        self.row("none", "frustum", || {
            let mut culler = FrustumCuller::default();
            move |view: &View, buffer: &mut DepthBuffer<'_>| {
                let objects = culler.cull(&self.tree, &Frustum::new(view)).to_vec();
                objects.iter().for_each(|&o| buffer.draw(o));
                (objects, 0)
            }
        });
    }

    /// Those who ask an oracle that answers at once.
    fn at_once(&self) {
        let (tree, answers) = (&self.tree, "at once");
        self.row(answers, "chc", || {
            let mut culler = Chc::default();
            move |view: &View, buffer: &mut DepthBuffer<'_>| {
                (culler.cull(tree, &Frustum::new(view), buffer).to_vec(), culler.stats().queries)
            }
        });
        self.row(answers, "chc++", || {
            let mut culler = ChcPlus::new(ChcPlusOptions::default());
            move |view: &View, buffer: &mut DepthBuffer<'_>| {
                (culler.cull(tree, &Frustum::new(view), buffer).to_vec(), culler.stats().queries)
            }
        });
        let costs = self.costs();
        self.row(answers, "cost and benefit", || {
            let mut culler = NearOptimal::new(costs);
            move |view: &View, buffer: &mut DepthBuffer<'_>| culler.cull(tree, &Frustum::new(view), buffer)
        });
        for count in AT_A_TIME {
            self.row(answers, &format!("grid, {count} at a time"), || {
                let mut grid = Grid::new(self.scene, count);
                move |view: &View, buffer: &mut DepthBuffer<'_>| grid.cull(&Frustum::new(view), buffer)
            });
        }
        self.row(answers, "late rule", || {
            let mut rule = LateRule::default();
            move |view: &View, buffer: &mut DepthBuffer<'_>| rule.cull(tree, &Frustum::new(view), buffer)
        });
    }

    /// Those who ask one whose answers come late, and what a map of what is occupied spares them.
    fn late(&self) {
        let (tree, answers) = (&self.tree, "late");
        self.row(answers, "chc", || {
            let mut culler = Chc::default();
            move |view: &View, buffer: &mut DepthBuffer<'_>| {
                let objects = culler.cull(tree, &Frustum::new(view), &mut Later(buffer)).to_vec();
                (objects, culler.stats().queries)
            }
        });
        self.row(answers, "chc, occupancy map", || {
            let (mut culler, mut map) = (Chc::default(), Occupancy::new(self.scene, SIZE));
            move |view: &View, buffer: &mut DepthBuffer<'_>| {
                let mut oracle = map.before(Later(buffer), view);
                let objects = culler.cull(tree, &Frustum::new(view), &mut oracle).to_vec();
                (objects, culler.stats().queries - oracle.spared())
            }
        });
        self.row(answers, "chc++", || {
            let mut culler = ChcPlus::new(ChcPlusOptions::default());
            move |view: &View, buffer: &mut DepthBuffer<'_>| {
                let objects = culler.cull(tree, &Frustum::new(view), &mut Later(buffer)).to_vec();
                (objects, culler.stats().queries)
            }
        });
        self.row(answers, "chc++, occupancy map", || {
            let (mut culler, mut map) = (ChcPlus::new(ChcPlusOptions::default()), Occupancy::new(self.scene, SIZE));
            move |view: &View, buffer: &mut DepthBuffer<'_>| {
                let mut oracle = map.before(Later(buffer), view);
                let objects = culler.cull(tree, &Frustum::new(view), &mut oracle).to_vec();
                (objects, culler.stats().queries - oracle.spared())
            }
        });
        let costs = self.costs();
        self.row(answers, "cost and benefit", || {
            let mut culler = NearOptimal::new(costs);
            move |view: &View, buffer: &mut DepthBuffer<'_>| culler.cull(tree, &Frustum::new(view), &mut Later(buffer))
        });
    }

    /// What a query and a triangle cost here, in seconds: in the frames in the middle of each stretch, all in the frustum drawn, then the box
    /// of each leaf asked about.
    fn costs(&self) -> Costs {
        let (mut buffer, mut culler) = (DepthBuffer::new(self.scene, SIZE[0], SIZE[1]), FrustumCuller::default());
        let (mut costs, mut triangles, mut queries) = (Costs { query: 0.0, triangle: 0.0 }, 0.0, 0.0);
        for camera in self.cameras.iter().skip(self.stretch / 2).step_by(self.stretch) {
            let view = camera.view(self.near);
            let objects = culler.cull(&self.tree, &Frustum::new(&view));
            let start = Instant::now();
            buffer.begin(&view);
            objects.iter().for_each(|&o| buffer.draw(o));
            costs.triangle += start.elapsed().as_secs_f64();
            triangles += self.triangles(objects);
            let leaves: Vec<&Bounds> = self.tree.nodes().iter().filter(|n| n.is_leaf()).map(|n| &n.bounds).collect();
            let start = Instant::now();
            for bounds in &leaves {
                let query = buffer.issue(std::slice::from_ref(bounds));
                assert!(buffer.poll(query).is_some());
            }
            costs.query += start.elapsed().as_secs_f64();
            queries += leaves.len() as f64;
        }
        Costs { query: costs.query / queries, triangle: costs.triangle / f64::max(triangles, 1.0) }
    }

    fn triangles(&self, objects: &[ObjectId]) -> f64 {
        objects.iter().map(|o| self.scene.objects[o.index()].triangles.len() as f64).sum()
    }

    /// Runs all frames some times, and prints what they came to. `culler` makes what draws one.
    fn row<C>(&self, answers: &str, method: &str, culler: impl Fn() -> C)
    where
        C: FnMut(&View, &mut DepthBuffer<'_>) -> Culled,
    {
        let mut buffer = DepthBuffer::new(self.scene, SIZE[0], SIZE[1]);
        let missed = self.missed(&mut culler(), &mut buffer);
        assert!(missed == 0 || method == "late rule", "{}, {method}: {missed} pixels are missed", self.name);
        let (mut best, mut queries, mut triangles) = (vec![f64::INFINITY; self.cameras.len()], 0, 0.0);
        for _ in 0..RUNS {
            let mut cull = culler();
            for (camera, best) in self.cameras.iter().zip(&mut best) {
                let (view, start) = (camera.view(self.near), Instant::now());
                buffer.begin(&view);
                let (objects, asked) = cull(&view, &mut buffer);
                *best = best.min(start.elapsed().as_secs_f64());
                queries += asked;
                triangles += self.triangles(&objects);
            }
        }
        let frames = self.cameras.len() as f64;
        println!(
            "| {} | {answers} | {method} | {:.0} | {:.0} | {:.3} | {missed} |",
            self.name,
            queries as f64 / frames / RUNS as f64,
            triangles / frames / RUNS as f64,
            best.iter().sum::<f64>() / frames * 1e3
        );
    }

    /// In the middle frames, after those before.
    fn missed<C>(&self, cull: &mut C, buffer: &mut DepthBuffer<'_>) -> usize
    where
        C: FnMut(&View, &mut DepthBuffer<'_>) -> Culled,
    {
        let rays = RayScene::new(self.scene);
        let mut missed = 0;
        for (i, camera) in self.cameras.iter().enumerate() {
            let view = camera.view(self.near);
            buffer.begin(&view);
            let mut drawn = cull(&view, buffer).0;
            if i % self.stretch == self.stretch / 2 {
                drawn.sort_unstable();
                let picture = raster::View { camera: *camera, near: self.near, width: SIZE[0], height: SIZE[1] };
                let full = raster::draw(self.scene, &picture, &|_| true);
                let kept = |object: ObjectId| drawn.binary_search(&object).is_ok();
                missed += missed_pixels(&rays, &picture, &full, &objects_shown(self.scene, &full), &kept).pixels.len();
            }
        }
        missed
    }
}
