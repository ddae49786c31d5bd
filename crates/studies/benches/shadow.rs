//! Shadow frusta beside frustum culling, CHC++ and, indoors, portals: an office of generated rooms, two cities, teapots; the
//! software depth buffer draws, one thread, 1024 x 768 pixels. The camera goes six stretches of 30 frames (3 among teapots)
//! along the path of each scene.
//!
//! First the answers are checked, in the middle frame of each stretch: with any number of occluders, no object is left out
//! that a picture of everything shows, or that has a witness of the exact judge. Then the times, each frame the fastest of
//! three runs, mean over the frames: culling alone, and with drawing what is left. CHC++ draws while it culls. `--test`
//! takes a small office alone.

use enfilade::ObjectId;
use enfilade::bake::{BakeOptions, bake};
use enfilade::job::Job;
use enfilade::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::frustum::FrustumCuller;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::view::{Frustum, View};
use enfilade::pvs::PvsOptions;
use enfilade::runtime::{self, Camera, Culler, Mode};
use enfilade::scene::Scene;
use enfilade_measure::exact::{ExactScene, Judge, MOST_SPLITS};
use enfilade_measure::walkthrough::missed::objects_shown;
use enfilade_measure::walkthrough::raster;
use enfilade_scenes::Kind;
use enfilade_studies::shadow_frusta::{Occluders, ShadowCuller};
use std::path::PathBuf;
use std::time::Instant;
use testing::stretches::{Stretches, scenes};

const SIZE: [usize; 2] = [1024, 768];
const RUNS: usize = 3;
/// Occluders a frame.
const COUNTS: [usize; 5] = [4, 8, 16, 32, 64];

fn main() {
    println!("| scene | method | occluders | triangles | of the frustum's, % | culling, us | frame, us |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    scenes(std::env::args().any(|a| a == "--test")).into_iter().for_each(|(name, kind)| measure(&name, kind));
}

/// A scene and its camera's frames.
struct Study<'s> {
    name: &'s str,
    scene: &'s Scene,
    cameras: Vec<Camera>,
    /// Frames of a stretch.
    stretch: usize,
    near: f64,
}

/// Of one method: means over the frames, seconds.
struct Row {
    occluders: f64,
    triangles: f64,
    /// `None` where culling and drawing take turns.
    culling: Option<f64>,
    frame: f64,
}

fn measure(name: &str, kind: Kind) {
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("shadow.glb");
    let Stretches { scene, cameras, stretch, near } = Stretches::new(kind, &file, SIZE);
    let study = Study { name, scene: &scene, cameras, stretch, near };
    let tree = Hierarchy::build(&scene, &HierarchyOptions::default());
    let start = Instant::now();
    let occluders = Occluders::find(&scene);
    eprintln!(
        "{name}: {} triangles, {} occluders in {:.2} s",
        scene.triangles.len(),
        occluders.count(),
        start.elapsed().as_secs_f64()
    );
    study.check(&tree, &occluders);
    let mut frustum = FrustumCuller::default();
    let base = study.run(|view, _| (frustum.cull(&tree, &Frustum::new(view)).to_vec(), 0));
    study.print("frustum", &base, &base);
    for most in COUNTS {
        let mut culler = ShadowCuller::new(most);
        let row = study.run(|view, _| (culler.cull(&tree, &occluders, view).to_vec(), culler.shadows()));
        study.print("shadow frusta", &row, &base);
    }
    if matches!(kind, Kind::Office { .. }) {
        study.portals(&tree, &occluders, &base);
    }
    study.print("chc++", &study.chc_plus(&tree), &base);
}

impl Study<'_> {
    fn triangles(&self, objects: &[ObjectId]) -> f64 {
        objects.iter().map(|o| self.scene.objects[o.index()].triangles.len() as f64).sum()
    }

    /// Nothing is left out that shows.
    fn check(&self, tree: &Hierarchy, occluders: &Occluders) {
        let ready = ExactScene::new(self.scene);
        let mut judge = Judge::new(&ready);
        for camera in self.cameras.iter().skip(self.stretch / 2).step_by(self.stretch) {
            let picture = raster::View { camera: *camera, near: self.near, width: SIZE[0], height: SIZE[1] };
            let mut shown = objects_shown(self.scene, &raster::draw(self.scene, &picture, &|_| true));
            let view = camera.view(self.near);
            let seen = judge.through(view.eye, [view.x, view.y, view.w], MOST_SPLITS);
            shown.extend(seen.visible.iter().map(|w| self.scene.object_of(w.triangle as usize)));
            assert!(shown.len() > 1, "{}: a test of nothing", self.name);
            for most in COUNTS {
                let mut taken = ShadowCuller::new(most).cull(tree, occluders, &view).to_vec();
                taken.sort_unstable();
                let missing = shown.iter().find(|o| taken.binary_search(o).is_err());
                assert_eq!(missing, None, "{}, {most} occluders: an object that shows isn't taken", self.name);
            }
        }
    }

    /// `cull` gives objects to draw and how many occluders there were; the objects are copied in the time that is taken.
    fn run(&self, mut cull: impl FnMut(&View, &Camera) -> (Vec<ObjectId>, usize)) -> Row {
        let mut buffer = DepthBuffer::new(self.scene, SIZE[0], SIZE[1]);
        let mut row = Row { occluders: 0.0, triangles: 0.0, culling: None, frame: 0.0 };
        let each = 1.0 / self.cameras.len() as f64;
        let mut best = vec![[f64::INFINITY; 2]; self.cameras.len()];
        for _ in 0..RUNS {
            for (camera, best) in self.cameras.iter().zip(&mut best) {
                let (view, start) = (camera.view(self.near), Instant::now());
                let (objects, occluders) = cull(&view, camera);
                best[0] = best[0].min(start.elapsed().as_secs_f64());
                buffer.begin(&view);
                objects.iter().for_each(|&o| buffer.draw(o));
                best[1] = best[1].min(start.elapsed().as_secs_f64());
                row.occluders += occluders as f64 * each / RUNS as f64;
                row.triangles += self.triangles(&objects) * each / RUNS as f64;
            }
        }
        row.culling = Some(best.iter().map(|b| b[0]).sum::<f64>() * each);
        row.frame = best.iter().map(|b| b[1]).sum::<f64>() * each;
        row
    }

    fn chc_plus(&self, tree: &Hierarchy) -> Row {
        let mut buffer = DepthBuffer::new(self.scene, SIZE[0], SIZE[1]);
        let mut culler = ChcPlus::new(ChcPlusOptions::default());
        let (mut best, mut triangles) = (vec![f64::INFINITY; self.cameras.len()], 0.0);
        for _ in 0..RUNS {
            for (camera, best) in self.cameras.iter().zip(&mut best) {
                let (view, start) = (camera.view(self.near), Instant::now());
                buffer.begin(&view);
                culler.cull(tree, &Frustum::new(&view), &mut buffer);
                *best = best.min(start.elapsed().as_secs_f64());
                triangles += self.triangles(culler.objects());
            }
        }
        let each = 1.0 / best.len() as f64;
        let frame = best.iter().sum::<f64>() * each;
        Row { occluders: 0.0, triangles: triangles * each / RUNS as f64, culling: None, frame }
    }

    /// Portals and rows together, and what shadows would take from that.
    fn portals(&self, tree: &Hierarchy, occluders: &Occluders, base: &Row) {
        let pvs = PvsOptions { ray_budget: 2_000_000, ..PvsOptions::default() };
        let file = bake(self.scene, BakeOptions { pvs, ..BakeOptions::default() }, &Job::quiet()).expect("a bake").file;
        let mut eyes = runtime::View::new(&Culler::new(&file));
        let row = self.run(|_, camera| (eyes.cull(camera, Mode::PortalsAndPvs).objects.to_vec(), 0));
        self.print("both", &row, base);
        let mut shadows = ShadowCuller::new(32);
        let row = self.run(|view, camera| {
            let mut objects = eyes.cull(camera, Mode::PortalsAndPvs).objects.to_vec();
            let mut lit = shadows.cull(tree, occluders, view).to_vec();
            lit.sort_unstable();
            objects.retain(|o| lit.binary_search(o).is_ok());
            (objects, shadows.shadows())
        });
        self.print("both, shadow frusta", &row, base);
    }

    fn print(&self, method: &str, row: &Row, base: &Row) {
        let culling = row.culling.map_or("-".to_owned(), |seconds| format!("{:.0}", seconds * 1e6));
        println!(
            "| {} | {method} | {:.0} | {:.0} | {:.1} | {culling} | {:.0} |",
            self.name,
            row.occluders,
            row.triangles,
            100.0 * row.triangles / base.triangles,
            row.frame * 1e6
        );
    }
}
