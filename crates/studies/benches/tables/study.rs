//! A scene, a camera that goes six stretches of its path and jumps between them, and what culled frames cost.

use enfilade::ObjectId;
use enfilade::occlusion::chc::Chc;
use enfilade::occlusion::chc_plus::{ChcPlus, ChcPlusOptions};
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::Hierarchy;
use enfilade::occlusion::oracle::OcclusionOracle;
use enfilade::occlusion::view::Frustum;
use enfilade::scene::{ImportOptions, Scene};
use enfilade_formats::import;
use enfilade_measure::walkthrough::missed::objects_shown;
use enfilade_measure::walkthrough::path::CameraPath;
use enfilade_measure::walkthrough::raster::{View, draw};
use enfilade_scenes::{Kind, generate};
use glam::DVec3;
use std::cell::RefCell;
use std::path::PathBuf;
use std::time::Instant;

pub const SIZE: [usize; 2] = [1024, 768];
pub const STRETCHES: usize = 6;

/// Frames of a stretch, and runs.
pub fn frames(is_test: bool, frames: [usize; 2]) -> [usize; 2] {
    if is_test { [2, 1] } else { frames }
}

/// What was generated, an object a node.
pub fn imported(kind: Kind, name: &str) -> (Scene, CameraPath) {
    let made = generate(kind, 0).expect("a scene");
    let file = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.glb"));
    std::fs::write(&file, &made.glb).expect("a folder to write to");
    let options = ImportOptions { object_triangles: u32::MAX, ..ImportOptions::default() };
    (import(&file, &options).expect("what was generated"), CameraPath::from_json(&made.path.to_string()).expect("a path"))
}

/// A scene, its camera's frames, and the objects that show in the middle frame of each stretch.
pub struct Study {
    pub scene: &'static Scene,
    buffer: RefCell<DepthBuffer<'static>>,
    pub frames: Vec<View>,
    /// Frames of a stretch.
    stretch: usize,
    /// Of so many runs, each frame's fastest counts.
    runs: usize,
    shown: Vec<Vec<ObjectId>>,
}

/// What frames cost, in seconds: the mean of all, the slowest, the standard deviation, the mean of the middle ones;
/// triangles and queries a frame, and triangles in the middle ones.
#[derive(Clone, Copy, Default)]
pub struct Cost {
    pub mean: f64,
    pub slowest: f64,
    pub deviation: f64,
    pub middle: f64,
    pub triangles: f64,
    pub queries: f64,
    pub middle_triangles: f64,
}

/// Draws a frame; says what it drew and how many queries it took.
pub type Culler<'c> = Box<dyn FnMut(&Frustum, &mut DepthBuffer<'_>) -> (Vec<ObjectId>, u64) + 'c>;

/// Makes a culler that remembers nothing yet.
pub type Start<'c> = Box<dyn Fn() -> Culler<'c> + 'c>;

impl Study {
    /// `change` is done to the scene first.
    pub fn new(kind: Kind, name: &str, [stretch, runs]: [usize; 2], change: impl FnOnce(Scene) -> Scene) -> Self {
        let (scene, path) = imported(kind, name);
        // For as long as the program runs: a handful.
        let scene: &'static Scene = Box::leak(Box::new(change(scene)));
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
        let study = Self { scene, buffer, frames, stretch, runs, shown };
        // The first has the page faults.
        study.known();
        study
    }

    pub fn triangles(&self, objects: &[ObjectId]) -> f64 {
        objects.iter().map(|o| self.scene.objects[o.index()].triangles.len() as f64).sum()
    }

    fn middle(&self, stretch: usize) -> usize {
        stretch * self.stretch + self.stretch / 2
    }

    /// Runs all frames by each method. They take turns, run by run, so that what else the machine does falls on all of them.
    pub fn compare(&self, methods: &[Start<'_>]) -> Vec<Cost> {
        let mut buffer = self.buffer.borrow_mut();
        let mut times = vec![vec![f64::INFINITY; self.frames.len()]; methods.len()];
        let mut costs = vec![Cost::default(); methods.len()];
        for _ in 0..self.runs {
            for ((start, times), cost) in methods.iter().zip(&mut times).zip(&mut costs) {
                *cost = self.run_once(&mut start(), &mut buffer, times);
            }
        }
        let count = self.frames.len() as f64;
        for (cost, times) in costs.iter_mut().zip(&times) {
            cost.mean = times.iter().sum::<f64>() / count;
            cost.slowest = times.iter().copied().fold(0.0, f64::max);
            cost.deviation = (times.iter().map(|t| (t - cost.mean).powi(2)).sum::<f64>() / count).sqrt();
            cost.middle = (0..STRETCHES).map(|s| times[self.middle(s)]).sum::<f64>() / STRETCHES as f64;
        }
        costs
    }

    fn run_once(&self, cull: &mut Culler<'_>, buffer: &mut DepthBuffer<'_>, times: &mut [f64]) -> Cost {
        let mut cost = Cost::default();
        for (i, view) in self.frames.iter().enumerate() {
            let view = view.camera.view(view.near);
            let start = Instant::now();
            buffer.begin(&view);
            let (mut drawn, queries) = cull(&Frustum::new(&view), buffer);
            times[i] = times[i].min(start.elapsed().as_secs_f64());
            cost.triangles += self.triangles(&drawn) / self.frames.len() as f64;
            cost.queries += queries as f64 / self.frames.len() as f64;
            if i == self.middle(i / self.stretch) {
                cost.middle_triangles += self.triangles(&drawn) / STRETCHES as f64;
                drawn.sort_unstable();
                let shown = &self.shown[i / self.stretch];
                assert!(shown.iter().all(|o| drawn.binary_search(o).is_ok()), "frame {i}: an object that shows isn't drawn");
            }
        }
        cost
    }

    /// Draws the middle frames alone, for who keeps nothing from frame to frame.
    pub fn middles(&self, mut objects: impl FnMut(usize, &Frustum) -> Vec<ObjectId>) -> Cost {
        let mut buffer = self.buffer.borrow_mut();
        let mut cost = Cost::default();
        for stretch in 0..STRETCHES {
            let view = self.frames[self.middle(stretch)];
            let view = view.camera.view(view.near);
            let frustum = Frustum::new(&view);
            let mut least = f64::INFINITY;
            for _ in 0..self.runs {
                let start = Instant::now();
                buffer.begin(&view);
                objects(stretch, &frustum).into_iter().for_each(|o| buffer.draw(o));
                least = least.min(start.elapsed().as_secs_f64());
            }
            cost.middle += least / STRETCHES as f64;
            cost.triangles += self.triangles(&objects(stretch, &frustum)) / STRETCHES as f64;
        }
        cost
    }

    /// Of the middle frames with everything drawn.
    pub fn plain(&self) -> Cost {
        self.middles(|_, _| (0..self.scene.objects.len() as u32).map(ObjectId).collect())
    }

    /// Of the middle frames, of whoever knows what shows and draws the nearest first.
    pub fn known(&self) -> Cost {
        let known: Vec<_> = (0..STRETCHES).map(|s| self.nearest_first(self.middle(s), &self.shown[s])).collect();
        self.middles(|stretch, _| known[stretch].clone())
    }

    /// The same beside others: it draws the frame before each middle one, too, so that memory is as warm as theirs, and nothing in the rest.
    pub fn knowing(&self) -> Start<'_> {
        let mut told = vec![Vec::new(); self.frames.len()];
        for i in (0..STRETCHES).flat_map(|s| [self.middle(s) - 1, self.middle(s)]) {
            let shown = objects_shown(self.scene, &draw(self.scene, &self.frames[i], &|_| true));
            told[i] = self.nearest_first(i, &shown);
        }
        Box::new(move || {
            let mut frames = told.clone().into_iter();
            Box::new(move |_, buffer| {
                let objects = frames.next().unwrap_or_default();
                objects.iter().for_each(|&o| buffer.draw(o));
                (objects, 0)
            })
        })
    }

    fn nearest_first(&self, frame: usize, shown: &[ObjectId]) -> Vec<ObjectId> {
        let eye: DVec3 = self.frames[frame].camera.eye.as_dvec3();
        let mut shown = shown.to_vec();
        let at = |o: &ObjectId| self.scene.objects[o.index()].bounds.centre().distance_squared(eye);
        shown.sort_by(|a, b| at(a).total_cmp(&at(b)));
        shown
    }
}

pub fn chc(tree: &Hierarchy) -> Start<'_> {
    Box::new(move || {
        let mut culler = Chc::default();
        Box::new(move |frustum, buffer| (culler.cull(tree, frustum, buffer).to_vec(), culler.stats().queries))
    })
}

pub fn chc_plus(tree: &Hierarchy) -> Start<'_> {
    Box::new(move || {
        let mut culler = ChcPlus::new(ChcPlusOptions::default());
        Box::new(move |frustum, buffer| (culler.cull(tree, frustum, buffer).to_vec(), culler.stats().queries))
    })
}
