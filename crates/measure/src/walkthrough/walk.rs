//! Walks a camera through a model and says what each culling mode draws, how long it takes, and what it misses.

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
use enfilade::runtime::{Culler, FrameMode, FrameStats, MinPixels, VisibleSet};
use enfilade::scene::rays::RayScene;
use enfilade::scene::{Role, Scene};
use serde::Serialize;
use std::cell::OnceCell;
use std::io;
use std::path::{Path, PathBuf};

/// What to do along the way.
#[derive(Clone, PartialEq, Debug)]
pub struct WalkOptions {
    /// Modes, in the order of their lines.
    pub modes: Vec<WalkMode>,
    /// Width of the pictures, pixels, 1 to 16384.
    pub width: usize,
    /// Height of the pictures, pixels, 1 to 16384.
    pub height: usize,
    /// Compare every frame with a picture of everything.
    pub verify_pixels: bool,
    /// Where to put a picture of every frame and mode; frames are compared as well then.
    pub pictures: Option<PathBuf>,
    /// Take every n-th frame of the path, 1 or more.
    pub every: usize,
    /// Shut the doors that the model has shut; all are open otherwise.
    pub doors_as_found: bool,
    /// Objects with fewer pixels are left out, as far as their boxes tell; 0 leaves none out. Each mode is walked with each of these limits.
    pub min_pixels: Vec<u32>,
}

/// One frame in one mode.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct FrameLine {
    /// Its number in the path, from 0.
    pub frame: usize,
    /// The mode's name.
    pub mode: &'static str,
    /// The limit below which objects are left out; absent where there is none.
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
    /// [`FrameStats::small`]; absent where there is no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub small: Option<u64>,
    /// Occlusion queries.
    pub queries: u64,
    /// Microseconds of one cull, as it came, after the frame before it; in a mode that asks an oracle, with what that draws.
    pub us: f64,
    /// Microseconds of that and of drawing all that is left into the software oracle, at the pictures' size; absent where no mode of the
    /// walk asks one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_us: Option<f64>,
    /// How `auto` culled it; absent in other modes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<&'static str>,
    /// In the mode `exact`: triangles that are visible; absent in others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible_triangles: Option<u64>,
    /// In the mode `exact`: triangles of which it isn't known; absent in others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undecided_triangles: Option<u64>,
    /// Objects that the exact judge has a witness of and the set leaves out; only where the walk has the mode `exact`, and this is a mode
    /// without it, without queries and without a limit: these leave out what has no pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_objects: Option<u64>,
    /// Pixels that show something that the set leaves out; absent where pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed_pixels: Option<u64>,
    /// Pixels that do so through a crack between triangles only ([`super::missed`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crack_pixels: Option<u64>,
    /// Pixels that do so through a hole that counts as opaque only; absent where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_pixels: Option<u64>,
    /// Missed pixels of the object that has most of them; absent where pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_missed_pixels: Option<u64>,
}

/// Whether a limit leaves nothing out.
fn is_none(min_pixels: &u32) -> bool {
    *min_pixels == 0
}

/// All frames in one mode.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Summary {
    /// Number of frames.
    pub frames: usize,
    /// The mode's name.
    pub mode: &'static str,
    /// The limit below which objects are left out; absent where there is none.
    #[serde(skip_serializing_if = "is_none")]
    pub min_pixels: u32,
    /// Mean of the triangles kept.
    pub triangles_mean: f64,
    /// Mean of the objects kept.
    pub objects_mean: f64,
    /// Mean of [`FrameLine::small`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub small_mean: Option<f64>,
    /// Median of the times, microseconds.
    pub us_median: f64,
    /// 99th percentile of the times, microseconds.
    pub us_p99: f64,
    /// Median of [`FrameLine::frame_us`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_us_median: Option<f64>,
    /// Mean of the occlusion queries.
    pub queries_mean: f64,
    /// Sum of [`FrameLine::lost_objects`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lost_objects: Option<u64>,
    /// Sum over frames; absent where pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed_pixels: Option<u64>,
    /// Sum over frames; absent where pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crack_pixels: Option<u64>,
    /// Sum of [`FrameLine::closed_pixels`]; absent where there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_pixels: Option<u64>,
    /// Missed pixels of the frame that has most of them; absent where pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_missed_pixels: Option<u64>,
    /// Greatest of [`FrameLine::most_missed_pixels`]. Rows that promise all keep it at 0, or below the limit where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_missed_pixels: Option<u64>,
    /// Mean of the triangles of objects that really show in the pictures: what a perfect culler would keep. Absent where
    /// pixels were not compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact_triangles_mean: Option<f64>,
    /// Mean of [`FrameLine::visible_triangles`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub visible_triangles_mean: Option<f64>,
    /// Mean of [`FrameLine::undecided_triangles`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undecided_triangles_mean: Option<f64>,
    /// Frames in which a bound on work was met and more was kept instead.
    pub capped_frames: u64,
}

/// What is walked at a time.
#[derive(Clone, Copy)]
struct How {
    mode: WalkMode,
    /// See [`WalkOptions::min_pixels`].
    min_pixels: u32,
}

impl How {
    /// Whether the mode promises to keep what is visible, however small.
    fn keeps_all(self) -> bool {
        self.mode != WalkMode::Exact && !self.mode.has_queries() && self.min_pixels == 0
    }
}

/// The same with a culler that knows it.
struct Way {
    how: How,
    culler: Culler,
}

/// Each mode with each limit.
fn ways(culler: &Culler, options: &WalkOptions) -> Vec<Way> {
    let picture = [options.width, options.height].map(|side| side as u32);
    let way = |how: How| {
        let mut culler = culler.clone();
        culler.set_min_pixels(MinPixels { pixels: how.min_pixels, picture });
        Way { how, culler }
    };
    let of = |&mode| options.min_pixels.iter().map(move |&min_pixels| How { mode, min_pixels });
    options.modes.iter().flat_map(of).map(way).collect()
}

/// Walks along a path. `line` gets each frame as it is done, for each mode in order.
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
    let ways = ways(&culler, options);
    let walker = |way: &Way| match way.how.mode {
        WalkMode::Culled(mode) => {
            Walker::Culled(Box::new(TimedCuller::new(mode, &way.culler, || in_parts.get_or_init(tree).clone())))
        }
        WalkMode::Exact => Walker::Exact(Box::new(ExactCuller::new(scene, ready()))),
    };

    // 1. Times, undisturbed by comparing.
    let asks = options.modes.iter().any(|mode| mode.has_queries());
    let mut oracle = asks.then(|| DepthBuffer::new(scene, options.width, options.height));
    let times: Vec<Vec<Times>> = ways.iter().map(|way| timed(&|| walker(way), way, &views, oracle.as_mut())).collect();

    // 2. The same frames again: counters, and pixels where they are asked for.
    let compare = options.verify_pixels || options.pictures.is_some();
    let rays = compare.then(|| with_holes(scene, file));
    let mut walkers: Vec<Walker> = ways.iter().map(&walker).collect();
    let mut lines: Vec<Vec<FrameLine>> = vec![Vec::new(); ways.len()];
    let judges = options.modes.contains(&WalkMode::Exact);
    let mut witnesses = judges.then(|| Witnesses::new(ready(), RayScene::new(scene), file.clearance()));
    let (mut exact_triangles, mut capped) = (0u64, vec![0u64; ways.len()]);
    for (i, (frame, view)) in views.iter().enumerate() {
        let truth = rays.as_ref().map(|rays| Truth::new(rays, view));
        witnesses.iter_mut().for_each(|witnesses| witnesses.look(view));
        exact_triangles += truth.as_ref().map_or(0, |truth| truth.triangles(file));
        for (m, way) in ways.iter().enumerate() {
            oracle.iter_mut().for_each(|oracle| oracle.set_min_pixels(way.how.min_pixels));
            let Walked { visible, method, judged, .. } =
                walkers[m].cull(&way.culler, view, oracle.as_mut().filter(|_| way.how.mode.has_queries()));
            capped[m] += u64::from(visible.stats.capped > 0);
            let missed = truth.as_ref().map(|truth| truth.missed(visible.objects));
            let times = times[m][i];
            let mut frame_line = frame_line(*frame, way.how, &visible.stats, times, missed.as_ref());
            frame_line.method = (way.how.mode == FrameMode::Auto.into()).then(|| method.name());
            frame_line.lost_objects =
                witnesses.as_ref().filter(|_| way.how.keeps_all()).map(|witnesses| witnesses.lost(visible.objects));
            frame_line.visible_triangles = judged.map(|judged| judged.visible);
            frame_line.undecided_triangles = judged.map(|judged| judged.undecided);
            if let (Some(folder), Some(missed)) = (&options.pictures, &missed) {
                let text = caption(&frame_line, file.objects.iter().map(|o| u64::from(o.triangles)).sum());
                let overlay = Overlay { scene, file, view: *view, mode: method, visible, missed, text };
                overlay.picture().save(&picture_path(folder, *frame, way.how.mode))?;
            }
            line(&frame_line);
            lines[m].push(frame_line);
        }
    }
    let exact_mean = compare.then(|| exact_triangles as f64 / views.len().max(1) as f64);
    Ok((0..ways.len()).map(|m| summary(ways[m].how, &lines[m], exact_mean, capped[m])).collect())
}

/// What frames take in a mode, in order.
fn timed<'s>(
    walker: &dyn Fn() -> Walker<'s>,
    way: &Way,
    views: &[(usize, View)],
    oracle: Option<&mut DepthBuffer<'_>>,
) -> Vec<Times> {
    let (culler, has_queries) = (&way.culler, way.how.mode.has_queries());
    let mut times = vec![Times::default(); views.len()];
    // Drawing would push the culler out of the caches, so modes without queries are timed without it first.
    if !has_queries {
        let mut walker = walker();
        for (times, (_, view)) in times.iter_mut().zip(views) {
            *times = walker.cull(culler, view, None).times;
        }
    }
    if let Some(oracle) = oracle {
        oracle.set_min_pixels(way.how.min_pixels);
        let mut walker = walker();
        for (times, (_, view)) in times.iter_mut().zip(views) {
            let with = walker.cull(culler, view, Some(oracle)).times;
            *times = Times { cull: if has_queries { with.cull } else { times.cull }, ..with };
        }
    }
    times
}

/// Walks in a mode.
enum Walker<'s> {
    Culled(Box<TimedCuller>),
    Exact(Box<ExactCuller<'s>>),
}

/// A frame.
struct Walked<'w> {
    visible: VisibleSet<'w>,
    /// How it was culled; `none` where the judge says.
    method: FrameMode,
    judged: Option<Judged>,
    times: Times,
}

impl Walker<'_> {
    fn cull(&mut self, culler: &Culler, view: &View, oracle: Option<&mut DepthBuffer<'_>>) -> Walked<'_> {
        match self {
            Self::Culled(walker) => {
                let (visible, method, times) = walker.cull(culler, view, oracle);
                Walked { visible, method, judged: None, times }
            }
            Self::Exact(walker) => {
                let (visible, judged, times) = walker.cull(view, oracle);
                Walked { visible, method: FrameMode::None, judged: Some(judged), times }
            }
        }
    }
}

/// The scene with its doors as they stand: what isn't of glass hides what is behind. Elsewhere doors hide nothing, since they may open.
fn with_solid_doors(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.objects.iter_mut().filter(|o| o.role == Role::Door && !o.glass).for_each(|o| o.opaque = true);
    scene
}

/// Where the picture of a frame goes.
pub fn picture_path(folder: &Path, frame: usize, mode: WalkMode) -> PathBuf {
    folder.join(format!("frame_{frame:05}_{mode}.png"))
}

fn view(file: &PvsFile, path: &CameraPath, frame: usize, options: &WalkOptions) -> View {
    let (width, height) = (options.width, options.height);
    let camera = path.camera(frame, file.origin, width as f64 / height as f64);
    View { camera, near: path.near, width, height }
}

/// A picture of everything, and what it shows.
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

    /// Triangles of the objects that it shows, as a file counts them: tubes of the scene have more sides.
    pub fn triangles(&self, file: &PvsFile) -> u64 {
        self.shown.iter().map(|o| u64::from(file.objects[o.index()].triangles)).sum()
    }

    pub fn missed(&self, objects: &[ObjectId]) -> Missed {
        let mut kept = vec![false; self.rays.scene().objects.len()];
        objects.iter().for_each(|o| kept[o.index()] = true);
        missed_pixels(self.rays, &self.view, &self.full, &self.shown, &|o: ObjectId| kept[o.index()])
    }
}

fn frame_line(frame: usize, how: How, stats: &FrameStats, times: Times, missed: Option<&Missed>) -> FrameLine {
    let tenths = |us: f64| (us * 10.0).round() / 10.0;
    FrameLine {
        frame,
        mode: how.mode.name(),
        min_pixels: how.min_pixels,
        cells: stats.cells,
        portals: stats.portals,
        objects: stats.objects,
        triangles: stats.triangles,
        small: (how.min_pixels > 0).then_some(stats.small),
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

fn summary(how: How, lines: &[FrameLine], exact_triangles_mean: Option<f64>, capped_frames: u64) -> Summary {
    let mean = |f: fn(&FrameLine) -> u64| lines.iter().map(f).sum::<u64>() as f64 / lines.len().max(1) as f64;
    let total = |f: fn(&FrameLine) -> Option<u64>| lines.iter().map(f).sum::<Option<u64>>();
    let greatest = |f: fn(&FrameLine) -> Option<u64>| lines.iter().map(f).try_fold(0, |most, of| Some(most.max(of?)));
    let is_exact = how.mode == WalkMode::Exact;
    let judged = |f: fn(&FrameLine) -> Option<u64>| total(f).map(|sum| sum as f64 / lines.len().max(1) as f64);
    let sorted = |f: fn(&FrameLine) -> Option<f64>| {
        let mut times = lines.iter().map(f).collect::<Option<Vec<f64>>>()?;
        times.sort_by(f64::total_cmp);
        Some(times)
    };
    // The smallest time that this share of the frames doesn't exceed.
    let percentile =
        |times: &[f64], p: usize| times.get((times.len() * p).div_ceil(100).saturating_sub(1)).copied().unwrap_or(0.0);
    let times = sorted(|l| Some(l.us)).unwrap_or_default();
    Summary {
        frames: lines.len(),
        mode: how.mode.name(),
        min_pixels: how.min_pixels,
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

    const BOTH: How = How { mode: WalkMode::Culled(FrameMode::Both), min_pixels: 0 };

    #[test]
    fn a_summary_is_of_its_lines() {
        let how = How { min_pixels: 4, ..BOTH };
        let lines: Vec<FrameLine> = (1..=200)
            .map(|i| {
                let stats = FrameStats { objects: i, triangles: 2 * i, small: 3, ..FrameStats::default() };
                let missed = i / 100 % 2;
                let missed = Missed { pixels: vec![0; 5 * missed as usize], cracks: 1, closed: 0, most_of_one: 3 * missed };
                frame_line(i as usize, how, &stats, Times { cull: i as f64, frame: None }, Some(&missed))
            })
            .collect();
        let s = summary(how, &lines, Some(3.0), 0);
        assert_eq!((s.frames, s.objects_mean, s.triangles_mean), (200, 100.5, 201.0));
        assert_eq!((s.us_median, s.us_p99, s.missed_pixels, s.crack_pixels), (100.0, 198.0, Some(500), Some(200)));
        assert_eq!((s.worst_missed_pixels, s.most_missed_pixels, s.small_mean), (Some(5), Some(3), Some(3.0)));
        let line = frame_line(0, BOTH, &FrameStats::default(), Times { cull: 1.0, frame: None }, None);
        let none = serde_json::to_string(&summary(BOTH, &[line], None, 0)).unwrap();
        assert!(["missed_pixels", "frame_us", "small", "min_pixels"].iter().all(|absent| !none.contains(absent)), "{none}");
    }
}
