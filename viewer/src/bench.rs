//! Frames a second by mode: each frame is drawn to its end, without a window, before the next begins.

use crate::args::Args;
use crate::culling::{ByDevice, Oracle};
use crate::draw::frame::FrameRequest;
use crate::draw::renderer::Renderer;
use crate::headless::{Headless, Walk};
use crate::mode::ViewMode;
use enfilade::file::PvsFile;
use glam::Vec3;
use serde::Serialize;
use std::time::Instant;

/// Size of frames, where none is given.
const SIZE: [u32; 2] = [960, 540];

/// Frames before those that are timed.
const WARM_UP: usize = 3;

/// A mode on a path.
#[derive(Serialize, Debug)]
pub struct Line {
    /// The mode's name.
    pub mode: &'static str,
    /// The engine for occlusion queries, if there were any.
    pub oracle: &'static str,
    /// Frames of the path.
    pub frames: usize,
    /// Frames over the sum of their times.
    pub fps: f64,
    /// Median of the times of whole frames, milliseconds.
    pub ms_median: f64,
    /// 99th percentile.
    pub ms_p99: f64,
    /// Mean of the milliseconds of processors that the program took a frame, on all threads, software drivers' included: what hardly changes
    /// where the machine has other work. Absent where the system doesn't say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cpu_ms: Option<f64>,
    /// Mean of the processor's milliseconds for deciding.
    pub cull_ms: f64,
    /// Mean of the objects drawn.
    pub objects_mean: f64,
    /// Mean of the triangles drawn.
    pub triangles_mean: f64,
    /// Mean of the ground's triangles, of all frames; absent without a ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground_triangles_mean: Option<f64>,
    /// The same of the frames whose eye is in a room.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground_triangles_inside: Option<f64>,
    /// Mean of the objects that ground hides; absent without a ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground_hides_mean: Option<f64>,
    /// Mean of the triangles of tubes; absent without tubes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tube_triangles_mean: Option<f64>,
    /// Mean of the segments of tubes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tube_segments_mean: Option<f64>,
    /// Mean of all segments of the objects that are drawn, on the screen or not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tube_segments_all: Option<f64>,
    /// Mean of those that are farther off than the limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tube_segments_over: Option<f64>,
    /// Bytes of tubes on the device, and those of a mesh of them, of 48 bytes a triangle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tube_bytes: Option<[u64; 2]>,
    /// Mean of the occlusion queries; in `hiz`, of the boxes held against the pyramid.
    pub queries_mean: f64,
    /// Pixels that were missed; absent without the alarm, which isn't part of the times.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missed_pixels: Option<u64>,
}

/// Prints a line a mode; false where pixels were missed.
///
/// # Errors
///
/// One line.
pub fn bench(args: &Args) -> Result<bool, String> {
    let mut held = Headless::open(args)?;
    let modes: Vec<ViewMode> = args.mode.map_or(ViewMode::ALL.to_vec(), |mode| vec![mode]);
    let mut is_whole = true;
    let lines = held.with_renderer(args, args.size.unwrap_or(SIZE), |walk| {
        modes.iter().map(|&mode| line(walk, mode, args.alarm)).collect::<Result<Vec<Line>, String>>()
    })??;
    for line in lines {
        is_whole &= line.missed_pixels.unwrap_or(0) == 0;
        println!("{}", serde_json::to_string(&line).map_err(|e| e.to_string())?);
    }
    Ok(is_whole)
}

fn line(walk: &mut Walk<'_, '_>, mode: ViewMode, alarm: bool) -> Result<Line, String> {
    let frames = walk.path.frames.len();
    walk.renderer.restart();
    // Drivers compile when they first draw.
    for frame in 0..frames.min(WARM_UP) {
        draw(walk, frame, mode)?;
    }
    let (mut sums, begin) = (Sums::new(&walk.renderer), cpu_ms());
    for frame in 0..frames {
        let ms = draw(walk, frame, mode)?;
        sums.add(walk, frame, ms);
    }
    let cpu_ms = cpu_ms().zip(begin).map(|(end, begin)| (end - begin) / frames.max(1) as f64);
    let mut missed_pixels = None;
    if alarm {
        walk.renderer.restart();
        for frame in 0..frames {
            let missed = walk.missed(walk.camera(frame), mode)?.map_or(0, |missed| u64::from(missed.pixels));
            *missed_pixels.get_or_insert(0) += missed;
        }
    }
    Ok(Line { cpu_ms, missed_pixels, ..sums.line(walk, mode) })
}

/// Draws a frame to its end. Returns its milliseconds.
fn draw(walk: &mut Walk<'_, '_>, frame: usize, mode: ViewMode) -> Result<f64, String> {
    let request = FrameRequest::new(walk.camera(frame), mode);
    let start = Instant::now();
    walk.draw(request)?;
    walk.renderer.settle().map_err(|e| e.to_string())?;
    Ok(start.elapsed().as_secs_f64() * 1e3)
}

/// Sums over frames.
struct Sums {
    times: Vec<f64>,
    cull_ms: f64,
    drawn: ByDevice,
    queries: u64,
    ground: OfGround,
    /// Of tubes: triangles, segments, all segments of the objects that are drawn, segments beyond the error limit.
    tubes: [u64; 4],
}

impl Sums {
    fn new(renderer: &Renderer<'_>) -> Self {
        let ground = OfGround::new(renderer);
        Self { times: Vec::new(), cull_ms: 0.0, drawn: ByDevice::default(), queries: 0, ground, tubes: [0; 4] }
    }

    fn add(&mut self, walk: &Walk<'_, '_>, frame: usize, ms: f64) {
        let renderer = &walk.renderer;
        self.times.push(ms);
        self.ground.add(renderer, walk.file(), walk.camera(frame).eye);
        self.drawn = self.drawn.with(renderer.drawn());
        let Some(decision) = &renderer.culling.last else { return };
        self.cull_ms += decision.ms;
        self.queries += decision.stats.queries;
        if let Some(tubes) = &renderer.tubes {
            let chosen = tubes.drawn.chosen();
            let all: usize = decision.objects.iter().map(|o| walk.scene().objects[o.index()].segments.len()).sum();
            let added = [chosen.triangles, chosen.segments, all as u64, chosen.over];
            self.tubes.iter_mut().zip(added).for_each(|(sum, n)| *sum += n);
        }
    }

    fn line(mut self, walk: &Walk<'_, '_>, mode: ViewMode) -> Line {
        let (renderer, frames) = (&walk.renderer, self.times.len());
        let all = frames.max(1) as f64;
        let oracle = match mode {
            ViewMode::Hiz => Oracle::Device.name(),
            ViewMode::Culled(mode) if mode.has_queries() => renderer.culling.oracle.name(),
            ViewMode::Culled(_) => "none",
        };
        let tubes = self.tubes.map(|sum| renderer.tubes.as_ref().map(|_| sum as f64 / all));
        let fps = frames as f64 * 1e3 / self.times.iter().sum::<f64>();
        self.times.sort_by(f64::total_cmp);
        let at = |share: f64| self.times.get(((frames as f64 * share) as usize).min(frames.max(1) - 1)).copied();
        Line {
            mode: mode.name(),
            oracle,
            frames,
            fps,
            ms_median: at(0.5).unwrap_or(0.0),
            ms_p99: at(0.99).unwrap_or(0.0),
            cpu_ms: None,
            cull_ms: self.cull_ms / all,
            objects_mean: self.drawn.objects as f64 / all,
            triangles_mean: self.drawn.triangles as f64 / all,
            ground_triangles_mean: self.ground.mean(0),
            ground_triangles_inside: self.ground.mean(1),
            ground_hides_mean: self.ground.hides(),
            tube_triangles_mean: tubes[0],
            tube_segments_mean: tubes[1],
            tube_segments_all: tubes[2],
            tube_segments_over: tubes[3],
            tube_bytes: renderer.tubes.as_ref().map(|tubes| [tubes.bytes, tubes.bytes_of_mesh]),
            queries_mean: self.queries as f64 / all,
            missed_pixels: None,
        }
    }
}

/// Ground in the frames of a path.
struct OfGround {
    has_ground: bool,
    /// Triangles and frames: all, and those whose eye is in a room.
    sums: [(u64, u32); 2],
    /// Objects that were left out, of all frames.
    hidden: u64,
}

impl OfGround {
    fn new(renderer: &Renderer<'_>) -> Self {
        Self { has_ground: renderer.terrain.is_some(), sums: Default::default(), hidden: 0 }
    }

    fn add(&mut self, renderer: &Renderer<'_>, file: &PvsFile, eye: Vec3) {
        let Some(terrain) = &renderer.terrain else { return };
        let triangles = terrain.shown.triangles();
        self.hidden += terrain.shown.objects as u64;
        let cell = renderer.culling.culler.cell_of(eye);
        let is_inside = cell.is_some_and(|cell| !file.cells[cell.index()].open);
        for (sum, frames) in &mut self.sums[..1 + usize::from(is_inside)] {
            (*sum, *frames) = (*sum + triangles, *frames + 1);
        }
    }

    fn hides(&self) -> Option<f64> {
        let (_, frames) = self.sums[0];
        (self.has_ground && frames > 0).then(|| self.hidden as f64 / f64::from(frames))
    }

    fn mean(&self, of: usize) -> Option<f64> {
        let (sum, frames) = self.sums[of];
        (self.has_ground && frames > 0).then(|| sum as f64 / f64::from(frames))
    }
}

/// Milliseconds of processors that this program has taken so far.
fn cpu_ms() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // After the name in brackets, which may hold anything: the 12th and 13th, in hundredths of a second.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let mut next = || fields.next()?.parse::<f64>().ok();
    Some((next()? + next()?) * 10.0)
}
