//! Walks a camera through a model and reports the draws, the times and the misses of each culling mode.

mod lines;

use super::crowd::{Crowd, CrowdShown};
use super::exact_culler::{ExactCuller, Judged};
use super::lost::Witnesses;
use super::missed::{Missed, missed_pixels, objects_shown, with_holes};
use super::mode::WalkMode;
use super::overlay::Overlay;
use super::path::CameraPath;
use super::raster::{IdBuffer, View, draw};
use super::timed_culler::{Seen, TimedCuller, Times, nearer};
use crate::exact::ExactScene;
use enfilade::ObjectId;
use enfilade::file::PvsFile;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::runtime::{Culler, Doors, MinPixels, Mode};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{Role, Scene};
pub use lines::{FrameLine, Summary};
use lines::{caption, frame_line, summary};
use std::cell::OnceCell;
use std::io;
use std::path::{Path, PathBuf};

/// Options of a walk.
#[derive(Clone, PartialEq, Debug)]
pub struct WalkOptions {
    /// Modes, in the order of their lines.
    pub modes: Vec<WalkMode>,
    /// Width of the pictures, pixels, 1 to 16384.
    pub width: usize,
    /// Height of the pictures, pixels, 1 to 16384.
    pub height: usize,
    /// Whether to compare every frame with a picture of everything.
    pub verify_pixels: bool,
    /// Folder for a picture of every frame and mode; implies the comparison.
    pub pictures: Option<PathBuf>,
    /// Use every n-th frame of the path, 1 or more.
    pub every: usize,
    /// Whether doors that are shut in the model are shut; otherwise all are open.
    pub doors_as_found: bool,
    /// Objects with fewer pixels, by their boxes, are left out; 0 leaves none out. Each mode is walked with each limit.
    pub min_pixels: Vec<u32>,
    /// Number of movers that walk about; modes but the exact one see them, too.
    pub movers: usize,
}

/// A mode and a limit.
#[derive(Clone, Copy)]
struct Setting {
    mode: WalkMode,
    /// See [`WalkOptions::min_pixels`].
    min_pixels: u32,
}

impl Setting {
    /// Whether the mode keeps every visible object, however small.
    fn keeps_all(self) -> bool {
        self.mode != WalkMode::Exact && !self.mode.has_queries() && self.min_pixels == 0
    }
}

/// Each mode with each limit.
fn runs(options: &WalkOptions) -> Vec<Setting> {
    let of = |&mode| options.min_pixels.iter().map(move |&min_pixels| Setting { mode, min_pixels });
    options.modes.iter().flat_map(of).collect()
}

/// Walks along a path. Calls `line` with each frame, for each mode in order.
pub fn walk(
    scene: &Scene,
    file: &PvsFile,
    path: &CameraPath,
    options: &WalkOptions,
    line: &mut dyn FnMut(&FrameLine),
) -> io::Result<Vec<Summary>> {
    let culler = Culler::new(file);
    let doors = if options.doors_as_found { Doors::as_found(&culler) } else { Doors::open(&culler) };
    let solid = options.doors_as_found.then(|| with_solid_doors(scene));
    let scene = solid.as_ref().unwrap_or(scene);
    let views: Vec<(usize, View)> = (0..path.frames.len())
        .step_by(options.every.max(1))
        .map(|frame| (frame, view(file, path, frame, options)))
        .collect();

    let exact = OnceCell::new();
    let ready = || exact.get_or_init(|| ExactScene::new(scene));
    let in_parts = OnceCell::new();
    let tree = || Hierarchy::build(scene, &HierarchyOptions::default()).with_parts(scene);
    let runs = runs(options);
    let picture = [options.width, options.height].map(|side| side as u32);
    let walker = |run: &Setting| match run.mode {
        WalkMode::Culled(mode) => {
            let limit = MinPixels { pixels: run.min_pixels, picture };
            let tree = || in_parts.get_or_init(tree).clone();
            Walker::Culled(Box::new(TimedCuller::new(mode, &culler, &doors, limit, tree)))
        }
        WalkMode::Exact => Walker::Exact(Box::new(ExactCuller::new(scene, ready()))),
    };

    // 1. Times, undisturbed by comparisons.
    let has_queries_anywhere = options.modes.iter().any(|mode| mode.has_queries());
    let mut oracle = has_queries_anywhere.then(|| DepthBuffer::new(scene, options.width, options.height));
    let times: Vec<Vec<Times>> = runs.iter().map(|run| timed(&|| walker(run), *run, &views, oracle.as_mut())).collect();

    // 2. The same frames again: counters, and pixels on request.
    let walkers: Vec<Walker> = runs.iter().map(&walker).collect();
    let judges = options.modes.contains(&WalkMode::Exact);
    let witnesses = judges.then(|| Witnesses::new(ready(), RayScene::new(scene), file.clearance()));
    let crowd = (options.movers > 0).then(|| Crowd::new(file, &culler, options.movers, 0));
    Comparison { scene, file, options, walkers, witnesses, oracle, crowd }.all(&runs, &views, &times, line)
}

/// Compares frames with what is visible.
struct Comparison<'c> {
    scene: &'c Scene,
    file: &'c PvsFile,
    options: &'c WalkOptions,
    /// One a run.
    walkers: Vec<Walker<'c>>,
    /// What is exactly visible, if a mode of the walk asks for it.
    witnesses: Option<Witnesses<'c>>,
    oracle: Option<DepthBuffer<'c>>,
    crowd: Option<Crowd>,
}

impl Comparison<'_> {
    /// All frames in all runs.
    fn all(
        mut self,
        runs: &[Setting],
        views: &[(usize, View)],
        times: &[Vec<Times>],
        line: &mut dyn FnMut(&FrameLine),
    ) -> io::Result<Vec<Summary>> {
        let compare = self.options.verify_pixels || self.options.pictures.is_some() || self.crowd.is_some();
        let rays = compare.then(|| with_holes(self.scene, self.file));
        let mut lines: Vec<Vec<FrameLine>> = vec![Vec::new(); runs.len()];
        let (mut exact_triangles, mut capped) = (0u64, vec![0u64; runs.len()]);
        for (i, (frame, view)) in views.iter().enumerate() {
            self.crowd.iter_mut().for_each(Crowd::go_on);
            let truth = rays.as_ref().map(|rays| Truth::new(rays, view));
            let shown = truth.as_ref().zip(self.crowd.as_ref()).map(|(truth, crowd)| crowd.shown(&truth.view, &truth.full));
            self.witnesses.iter_mut().for_each(|witnesses| witnesses.look(view));
            exact_triangles += truth.as_ref().map_or(0, |truth| truth.triangles(self.file));
            for (m, run) in runs.iter().enumerate() {
                let (frame_line, is_capped) =
                    self.one(m, *run, (*frame, view), times[m][i], truth.as_ref(), shown.as_ref())?;
                capped[m] += u64::from(is_capped);
                line(&frame_line);
                lines[m].push(frame_line);
            }
        }
        let exact_mean = compare.then(|| exact_triangles as f64 / views.len().max(1) as f64);
        Ok((0..runs.len()).map(|m| summary(runs[m], &lines[m], exact_mean, capped[m])).collect())
    }

    /// One frame in a run, with its picture if there are some; and whether a limit of work was met.
    fn one(
        &mut self,
        m: usize,
        run: Setting,
        (frame, view): (usize, &View),
        times: Times,
        truth: Option<&Truth<'_>>,
        shown: Option<&CrowdShown<'_>>,
    ) -> io::Result<(FrameLine, bool)> {
        let Self { scene, file, options, walkers, witnesses, oracle, crowd } = self;
        oracle.iter_mut().for_each(|oracle| oracle.set_min_pixels(run.min_pixels));
        let CulledFrame { visible, method, judged, .. } =
            walkers[m].cull(view, oracle.as_mut().filter(|_| run.mode.has_queries()));
        let is_capped = visible.stats.capped > 0;
        let missed = truth.map(|truth| truth.missed(visible.objects));
        let mut line = frame_line(frame, run, &visible.stats, times, missed.as_ref());
        line.method = (run.mode == Mode::Auto.into()).then(|| method.name());
        line.lost_objects = witnesses.as_ref().filter(|_| run.keeps_all()).map(|witnesses| witnesses.lost(visible.objects));
        line.visible_triangles = judged.map(|judged| judged.visible);
        line.undecided_triangles = judged.map(|judged| judged.undecided);
        if let (Some(folder), Some(missed)) = (&options.pictures, &missed) {
            let text = caption(&line, file.objects.iter().map(|o| u64::from(o.triangles)).sum());
            let overlay = Overlay { scene, file, view: *view, mode: method, visible, missed, text };
            overlay.picture().save(&picture_path(folder, frame, run.mode))?;
        }
        if let (Some(crowd), Some(truth), Some(shown), Walker::Culled(walker)) = (crowd, truth, shown, &mut walkers[m]) {
            let set = walker.movers(&crowd.movers, oracle.as_mut().filter(|_| run.mode.has_queries()));
            line.movers = Some(crowd.compare(truth.rays, shown, set));
        }
        Ok((line, is_capped))
    }
}

/// Times of the frames in a mode, in order.
fn timed<'s>(
    walker: &dyn Fn() -> Walker<'s>,
    run: Setting,
    views: &[(usize, View)],
    oracle: Option<&mut DepthBuffer<'_>>,
) -> Vec<Times> {
    let has_queries = run.mode.has_queries();
    let mut times = vec![Times::default(); views.len()];
    // Drawing would evict the culler from the caches, so modes without queries are timed first without drawing.
    if !has_queries {
        let mut walker = walker();
        for (times, (_, view)) in times.iter_mut().zip(views) {
            *times = walker.cull(view, None).times;
        }
    }
    if let Some(oracle) = oracle {
        oracle.set_min_pixels(run.min_pixels);
        let mut walker = walker();
        for (times, (_, view)) in times.iter_mut().zip(views) {
            let with = walker.cull(view, Some(oracle)).times;
            *times = Times { cull: if has_queries { with.cull } else { times.cull }, ..with };
        }
    }
    times
}

/// Culls the frames of a mode.
enum Walker<'s> {
    Culled(Box<TimedCuller>),
    Exact(Box<ExactCuller<'s>>),
}

/// A culled frame.
struct CulledFrame<'w> {
    visible: Seen<'w>,
    /// The mode that was used; `none` for the exact judge.
    method: Mode,
    judged: Option<Judged>,
    times: Times,
}

impl Walker<'_> {
    fn cull(&mut self, view: &View, oracle: Option<&mut DepthBuffer<'_>>) -> CulledFrame<'_> {
        match self {
            Self::Culled(walker) => {
                let (visible, method, times) = walker.cull(view, oracle);
                CulledFrame { visible, method, judged: None, times }
            }
            Self::Exact(walker) => {
                let (visible, judged, times) = walker.cull(view, oracle);
                CulledFrame { visible, method: Mode::None, judged: Some(judged), times }
            }
        }
    }
}

/// The scene with solid doors: all but glass ones are opaque. Elsewhere doors hide nothing, since they may open.
fn with_solid_doors(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.objects.iter_mut().filter(|o| o.role == Role::Door && !o.glass).for_each(|o| o.opaque = true);
    scene
}

/// Path of a frame's picture.
pub fn picture_path(folder: &Path, frame: usize, mode: WalkMode) -> PathBuf {
    folder.join(format!("frame_{frame:05}_{mode}.png"))
}

fn view(file: &PvsFile, path: &CameraPath, frame: usize, options: &WalkOptions) -> View {
    let (width, height) = (options.width, options.height);
    let camera = path.camera(frame, file.origin, width as f64 / height as f64);
    View { camera, near: path.near, width, height }
}

/// A picture of everything, and its objects.
pub(super) struct Truth<'r> {
    rays: &'r RayScene<'r>,
    /// See [`nearer`].
    view: View,
    full: IdBuffer,
    shown: Vec<ObjectId>,
}

impl<'r> Truth<'r> {
    pub fn new(rays: &'r RayScene<'r>, view: &View) -> Self {
        let view = nearer(view);
        let full = draw(rays.scene(), &view, &|_| true);
        Self { rays, view, shown: objects_shown(rays.scene(), &full), full }
    }

    /// Triangles of its objects as a file counts them; tubes of the scene have more sides.
    pub fn triangles(&self, file: &PvsFile) -> u64 {
        self.shown.iter().map(|o| u64::from(file.objects[o.index()].triangles)).sum()
    }

    pub fn missed(&self, objects: &[ObjectId]) -> Missed {
        let mut kept = vec![false; self.rays.scene().objects.len()];
        objects.iter().for_each(|o| kept[o.index()] = true);
        missed_pixels(self.rays, &self.view, &self.full, &self.shown, &|o: ObjectId| kept[o.index()])
    }
}
