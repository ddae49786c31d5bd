//! Walks a camera through a model and reports the draws, the times and the misses of each culling mode.

use super::exact_culler::{ExactCuller, Judged};
use super::lost::Witnesses;
use super::missed::{Missed, missed_pixels, objects_shown, with_holes};
use super::mode::WalkMode;
use super::overlay::Overlay;
use super::path::CameraPath;
use super::raster::{IdBuffer, View, draw};
use super::timed_culler::{TimedCuller, Times, nearer};
use crate::exact::ExactScene;
use enfilade::ObjectId;
use enfilade::file::PvsFile;
use enfilade::occlusion::depth::DepthBuffer;
use enfilade::occlusion::hierarchy::{Hierarchy, HierarchyOptions};
use enfilade::runtime::{Culler, FrameStats, MinPixels, Mode, VisibleSet};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{Role, Scene};
use serde::Serialize;
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
}

/// One frame in one mode.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct FrameLine {
    /// Its number in the path, from 0.
    pub frame: usize,
    /// The mode's name.
    pub mode: &'static str,
    /// The limit below which objects are left out; absent without a limit.
    #[serde(skip_serializing_if = "is_none")]
    pub min_pixels: u32,
    /// [`FrameStats::cells`].
    pub cells: u64,
    /// [`FrameStats::portals`].
    pub portals: u64,
    /// [`FrameStats::objects`].
    pub objects: u64,
    /// [`FrameStats::triangles`].
    pub triangles: u64,
    /// [`FrameStats::small`]; absent without a limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub small: Option<u64>,
    /// Occlusion queries.
    pub queries: u64,
    /// Microseconds of one cull after the previous frame; in modes with queries, including the triangles that the oracle draws.
    pub us: f64,
    /// The same plus drawing all remaining objects into the software oracle, at the pictures' size, microseconds; absent if no
    /// mode of the walk has queries.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_us: Option<f64>,
    /// The method that `auto` chose; absent in other modes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<&'static str>,
    /// In the mode `exact`: visible triangles; absent in others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible_triangles: Option<u64>,
    /// In the mode `exact`: undecided triangles; absent in others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undecided_triangles: Option<u64>,
    /// Objects with an exact witness that the set leaves out. Present only if the walk has the mode `exact`, in other modes
    /// without queries and without a limit: those leave out objects without pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_objects: Option<u64>,
    /// Pixels with an object that the set leaves out; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed_pixels: Option<u64>,
    /// Such pixels seen only through a crack between triangles ([`super::missed`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crack_pixels: Option<u64>,
    /// Such pixels seen only through a hole that counts as opaque; absent if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_pixels: Option<u64>,
    /// Missed pixels of the object with most of them; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_missed_pixels: Option<u64>,
}

/// Whether there is no limit.
fn is_none(min_pixels: &u32) -> bool {
    *min_pixels == 0
}

/// Results of all frames in one mode.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Summary {
    /// Number of frames.
    pub frames: usize,
    /// The mode's name.
    pub mode: &'static str,
    /// The limit below which objects are left out; absent without a limit.
    #[serde(skip_serializing_if = "is_none")]
    pub min_pixels: u32,
    /// Mean of kept triangles.
    pub triangles_mean: f64,
    /// Mean of kept objects.
    pub objects_mean: f64,
    /// Mean of [`FrameLine::small`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub small_mean: Option<f64>,
    /// Median time, microseconds.
    pub us_median: f64,
    /// 99th percentile of times, microseconds.
    pub us_p99: f64,
    /// Median of [`FrameLine::frame_us`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_us_median: Option<f64>,
    /// Mean number of occlusion queries.
    pub queries_mean: f64,
    /// Sum of [`FrameLine::lost_objects`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_objects: Option<u64>,
    /// Sum over frames; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed_pixels: Option<u64>,
    /// Sum over frames; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crack_pixels: Option<u64>,
    /// Sum of [`FrameLine::closed_pixels`]; absent if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_pixels: Option<u64>,
    /// Missed pixels of the worst frame; absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_missed_pixels: Option<u64>,
    /// Greatest [`FrameLine::most_missed_pixels`]. Conservative rows keep it at 0, or below the limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_missed_pixels: Option<u64>,
    /// Mean triangles of the objects that show in the pictures: the set of a perfect culler. Absent if pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact_triangles_mean: Option<f64>,
    /// Mean of [`FrameLine::visible_triangles`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible_triangles_mean: Option<f64>,
    /// Mean of [`FrameLine::undecided_triangles`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undecided_triangles_mean: Option<f64>,
    /// Frames that met a limit of work and therefore kept more.
    pub capped_frames: u64,
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

/// A mode and a limit with their culler.
struct Run {
    setting: Setting,
    culler: Culler,
}

/// Each mode with each limit.
fn runs(culler: &Culler, options: &WalkOptions) -> Vec<Run> {
    let picture = [options.width, options.height].map(|side| side as u32);
    let run = |setting: Setting| {
        let mut culler = culler.clone();
        culler.set_min_pixels(MinPixels { pixels: setting.min_pixels, picture });
        Run { setting, culler }
    };
    let of = |&mode| options.min_pixels.iter().map(move |&min_pixels| Setting { mode, min_pixels });
    options.modes.iter().flat_map(of).map(run).collect()
}

/// Walks along a path. Calls `line` with each frame, for each mode in order.
pub fn walk(
    scene: &Scene,
    file: &PvsFile,
    path: &CameraPath,
    options: &WalkOptions,
    line: &mut dyn FnMut(&FrameLine),
) -> io::Result<Vec<Summary>> {
    let mut culler = Culler::new(file);
    let solid;
    let scene = if options.doors_as_found {
        culler.shut_as_found();
        solid = with_solid_doors(scene);
        &solid
    } else {
        scene
    };
    let views: Vec<(usize, View)> = (0..path.frames.len())
        .step_by(options.every.max(1))
        .map(|frame| (frame, view(file, path, frame, options)))
        .collect();

    let exact = OnceCell::new();
    let ready = || exact.get_or_init(|| ExactScene::new(scene));
    let in_parts = OnceCell::new();
    let tree = || Hierarchy::build(scene, &HierarchyOptions::default()).with_parts(scene);
    let runs = runs(&culler, options);
    let walker = |run: &Run| match run.setting.mode {
        WalkMode::Culled(mode) => {
            Walker::Culled(Box::new(TimedCuller::new(mode, &run.culler, || in_parts.get_or_init(tree).clone())))
        }
        WalkMode::Exact => Walker::Exact(Box::new(ExactCuller::new(scene, ready()))),
    };

    // 1. Times, undisturbed by comparisons.
    let has_queries_anywhere = options.modes.iter().any(|mode| mode.has_queries());
    let mut oracle = has_queries_anywhere.then(|| DepthBuffer::new(scene, options.width, options.height));
    let times: Vec<Vec<Times>> = runs.iter().map(|run| timed(&|| walker(run), run, &views, oracle.as_mut())).collect();

    // 2. The same frames again: counters, and pixels on request.
    let compare = options.verify_pixels || options.pictures.is_some();
    let rays = compare.then(|| with_holes(scene, file));
    let mut walkers: Vec<Walker> = runs.iter().map(&walker).collect();
    let mut lines: Vec<Vec<FrameLine>> = vec![Vec::new(); runs.len()];
    let judges = options.modes.contains(&WalkMode::Exact);
    let mut witnesses = judges.then(|| Witnesses::new(ready(), RayScene::new(scene), file.clearance()));
    let (mut exact_triangles, mut capped) = (0u64, vec![0u64; runs.len()]);
    for (i, (frame, view)) in views.iter().enumerate() {
        let truth = rays.as_ref().map(|rays| Truth::new(rays, view));
        witnesses.iter_mut().for_each(|witnesses| witnesses.look(view));
        exact_triangles += truth.as_ref().map_or(0, |truth| truth.triangles(file));
        for (m, run) in runs.iter().enumerate() {
            oracle.iter_mut().for_each(|oracle| oracle.set_min_pixels(run.setting.min_pixels));
            let CulledFrame { visible, method, judged, .. } =
                walkers[m].cull(&run.culler, view, oracle.as_mut().filter(|_| run.setting.mode.has_queries()));
            capped[m] += u64::from(visible.stats.capped > 0);
            let missed = truth.as_ref().map(|truth| truth.missed(visible.objects));
            let times = times[m][i];
            let mut frame_line = frame_line(*frame, run.setting, &visible.stats, times, missed.as_ref());
            frame_line.method = (run.setting.mode == Mode::Auto.into()).then(|| method.name());
            frame_line.lost_objects =
                witnesses.as_ref().filter(|_| run.setting.keeps_all()).map(|witnesses| witnesses.lost(visible.objects));
            frame_line.visible_triangles = judged.map(|judged| judged.visible);
            frame_line.undecided_triangles = judged.map(|judged| judged.undecided);
            if let (Some(folder), Some(missed)) = (&options.pictures, &missed) {
                let text = caption(&frame_line, file.objects.iter().map(|o| u64::from(o.triangles)).sum());
                let overlay = Overlay { scene, file, view: *view, mode: method, visible, missed, text };
                overlay.picture().save(&picture_path(folder, *frame, run.setting.mode))?;
            }
            line(&frame_line);
            lines[m].push(frame_line);
        }
    }
    let exact_mean = compare.then(|| exact_triangles as f64 / views.len().max(1) as f64);
    Ok((0..runs.len()).map(|m| summary(runs[m].setting, &lines[m], exact_mean, capped[m])).collect())
}

/// Times of the frames in a mode, in order.
fn timed<'s>(
    walker: &dyn Fn() -> Walker<'s>,
    run: &Run,
    views: &[(usize, View)],
    oracle: Option<&mut DepthBuffer<'_>>,
) -> Vec<Times> {
    let (culler, has_queries) = (&run.culler, run.setting.mode.has_queries());
    let mut times = vec![Times::default(); views.len()];
    // Drawing would evict the culler from the caches, so modes without queries are timed first without drawing.
    if !has_queries {
        let mut walker = walker();
        for (times, (_, view)) in times.iter_mut().zip(views) {
            *times = walker.cull(culler, view, None).times;
        }
    }
    if let Some(oracle) = oracle {
        oracle.set_min_pixels(run.setting.min_pixels);
        let mut walker = walker();
        for (times, (_, view)) in times.iter_mut().zip(views) {
            let with = walker.cull(culler, view, Some(oracle)).times;
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
    visible: VisibleSet<'w>,
    /// The mode that was used; `none` for the exact judge.
    method: Mode,
    judged: Option<Judged>,
    times: Times,
}

impl Walker<'_> {
    fn cull(&mut self, culler: &Culler, view: &View, oracle: Option<&mut DepthBuffer<'_>>) -> CulledFrame<'_> {
        match self {
            Self::Culled(walker) => {
                let (visible, method, times) = walker.cull(culler, view, oracle);
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

fn frame_line(frame: usize, setting: Setting, stats: &FrameStats, times: Times, missed: Option<&Missed>) -> FrameLine {
    let tenths = |us: f64| (us * 10.0).round() / 10.0;
    FrameLine {
        frame,
        mode: setting.mode.name(),
        min_pixels: setting.min_pixels,
        cells: stats.cells,
        portals: stats.portals,
        objects: stats.objects,
        triangles: stats.triangles,
        small: (setting.min_pixels > 0).then_some(stats.small),
        queries: stats.queries,
        us: tenths(times.cull),
        frame_us: times.frame.map(tenths),
        method: None,
        visible_triangles: None,
        undecided_triangles: None,
        lost_objects: None,
        missed_pixels: missed.map(|m| m.pixels.len() as u64),
        crack_pixels: missed.map(|m| m.cracks),
        closed_pixels: missed.map(|m| m.closed).filter(|&closed| closed > 0),
        most_missed_pixels: missed.map(|m| m.most_of_one),
    }
}

fn caption(line: &FrameLine, all_triangles: u64) -> String {
    let FrameLine { frame, mode, cells, portals, objects, triangles, us, .. } = line;
    format!(
        "frame {frame} {mode}: {cells} cells {portals} portals {objects} objects {triangles}/{all_triangles} triangles {us:.0} us"
    )
}

fn summary(setting: Setting, lines: &[FrameLine], exact_triangles_mean: Option<f64>, capped_frames: u64) -> Summary {
    let mean = |f: fn(&FrameLine) -> u64| lines.iter().map(f).sum::<u64>() as f64 / lines.len().max(1) as f64;
    let total = |f: fn(&FrameLine) -> Option<u64>| lines.iter().map(f).sum::<Option<u64>>();
    let greatest = |f: fn(&FrameLine) -> Option<u64>| lines.iter().map(f).try_fold(0, |most, of| Some(most.max(of?)));
    let is_exact = setting.mode == WalkMode::Exact;
    let judged = |f: fn(&FrameLine) -> Option<u64>| total(f).map(|sum| sum as f64 / lines.len().max(1) as f64);
    let sorted = |f: fn(&FrameLine) -> Option<f64>| {
        let mut times = lines.iter().map(f).collect::<Option<Vec<f64>>>()?;
        times.sort_by(f64::total_cmp);
        Some(times)
    };
    // The least time that this share of the frames does not exceed.
    let percentile =
        |times: &[f64], p: usize| times.get((times.len() * p).div_ceil(100).saturating_sub(1)).copied().unwrap_or(0.0);
    let times = sorted(|l| Some(l.us)).unwrap_or_default();
    Summary {
        frames: lines.len(),
        mode: setting.mode.name(),
        min_pixels: setting.min_pixels,
        triangles_mean: mean(|l| l.triangles),
        objects_mean: mean(|l| l.objects),
        small_mean: judged(|l| l.small),
        us_median: percentile(&times, 50),
        us_p99: percentile(&times, 99),
        frame_us_median: sorted(|l| l.frame_us).map(|times| percentile(&times, 50)),
        queries_mean: mean(|l| l.queries),
        lost_objects: total(|l| l.lost_objects),
        missed_pixels: total(|l| l.missed_pixels),
        crack_pixels: total(|l| l.crack_pixels),
        closed_pixels: Some(lines.iter().filter_map(|l| l.closed_pixels).sum()).filter(|&closed| closed > 0),
        worst_missed_pixels: greatest(|l| l.missed_pixels),
        most_missed_pixels: greatest(|l| l.most_missed_pixels),
        exact_triangles_mean,
        visible_triangles_mean: judged(|l| l.visible_triangles).filter(|_| is_exact),
        undecided_triangles_mean: judged(|l| l.undecided_triangles).filter(|_| is_exact),
        capped_frames,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: Setting = Setting { mode: WalkMode::Culled(Mode::PortalsAndPvs), min_pixels: 0 };

    #[test]
    fn a_summary_is_of_its_lines() {
        let setting = Setting { min_pixels: 4, ..BOTH };
        let lines: Vec<FrameLine> = (1..=200)
            .map(|i| {
                let stats = FrameStats { objects: i, triangles: 2 * i, small: 3, ..FrameStats::default() };
                let missed = i / 100 % 2;
                let missed = Missed { pixels: vec![0; 5 * missed as usize], cracks: 1, closed: 0, most_of_one: 3 * missed };
                frame_line(i as usize, setting, &stats, Times { cull: i as f64, frame: None }, Some(&missed))
            })
            .collect();
        let s = summary(setting, &lines, Some(3.0), 0);
        assert_eq!((s.frames, s.objects_mean, s.triangles_mean), (200, 100.5, 201.0));
        assert_eq!((s.us_median, s.us_p99, s.missed_pixels, s.crack_pixels), (100.0, 198.0, Some(500), Some(200)));
        assert_eq!((s.worst_missed_pixels, s.most_missed_pixels, s.small_mean), (Some(5), Some(3), Some(3.0)));
        let line = frame_line(0, BOTH, &FrameStats::default(), Times { cull: 1.0, frame: None }, None);
        let none = serde_json::to_string(&summary(BOTH, &[line], None, 0)).unwrap();
        assert!(["missed_pixels", "frame_us", "small", "min_pixels"].iter().all(|absent| !none.contains(absent)), "{none}");
    }
}
